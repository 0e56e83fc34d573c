#pragma once

#include "platform/vulkan/vk_functions.h"

#include <glint/device/detail/backend.h>

namespace glint::vulkan {

class VulkanDevice;

/// Time: slots {begin, end}. Others: one slot for each piece of a target that the player had to split meanwhile.
class VulkanQuery final : public detail::NativeQuery {
public:
    static constexpr uint32_t most_slots = 16;

    static Expected<std::unique_ptr<VulkanQuery>> create(VulkanDevice& device, Query::Type type);
    ~VulkanQuery() override;

    void setName(const std::string& name) override;
    VkQueryPool pool() const { return pool_; }
    Query::Type type() const { return type_; }
    uint32_t slots() const { return type_ == Query::TypeTime ? 2 : most_slots; }

    /// Result words of a query that is done. Errors: "query.split" (interrupted too often to count), "vulkan.result".
    Expected<std::array<uint64_t, 7>> result() const;

    uint32_t used = 0;             ///< slots that the last recorded use took
    uint32_t timestamp_bits = 64;  ///< of the queue that the last use went to

private:
    VulkanQuery(VulkanDevice& device, Query::Type type) : device_(device), type_(type) {}

    VulkanDevice& device_;
    const Query::Type type_;
    VkQueryPool pool_ = VK_NULL_HANDLE;
};

}  // namespace glint::vulkan
