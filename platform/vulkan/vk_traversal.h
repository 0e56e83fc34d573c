#pragma once

#include "platform/vulkan/vk_layout.h"
#include "platform/vulkan/vk_memory.h"

#include <glint/device/detail/backend.h>

#include <array>

namespace glint::vulkan {

/// A ray-tracing pipeline and its shader binding table.
class VulkanTraversal final : public detail::NativeTraversal {
public:
    static Expected<std::unique_ptr<VulkanTraversal>> create(VulkanDevice& device, const detail::TraversalDesc& desc);
    ~VulkanTraversal() override;

    void setName(const std::string& name) override;
    VkPipeline handle() const { return handle_; }
    const PipelineLayout& layout() const { return *layout_; }

    /// All records of a table but those of ray generation, of which a dispatch takes one.
    const VkStridedDeviceAddressRegionKHR& table(detail::RayTable table) const {
        return regions_[static_cast<size_t>(table)];
    }
    VkStridedDeviceAddressRegionKHR generation(uint32_t index) const;
    /// Bytes that dispatches have to set for the pipeline's stack; 0 where its default is enough.
    uint32_t stackSize() const { return stack_size_; }

private:
    explicit VulkanTraversal(VulkanDevice& device) : device_(device) {}
    Status createPipeline(const detail::TraversalDesc& desc);
    Status writeTables(const detail::TraversalDesc& desc);
    uint32_t sumStack(const detail::TraversalDesc& desc) const;

    VulkanDevice& device_;
    PipelineLayout* layout_ = nullptr;
    VkPipeline handle_ = VK_NULL_HANDLE;
    RawBuffer tables_;
    uint32_t stack_size_ = 0;
    std::array<VkStridedDeviceAddressRegionKHR, detail::ray_tables> regions_ = {};
};

}  // namespace glint::vulkan
