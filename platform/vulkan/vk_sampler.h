#pragma once

#include "platform/vulkan/vk_functions.h"

#include <glint/device/detail/backend.h>

namespace glint::vulkan {

class VulkanDevice;

class VulkanSampler final : public detail::NativeSampler {
public:
    static Expected<std::unique_ptr<VulkanSampler>> create(VulkanDevice& device, const SamplerDesc& desc);
    ~VulkanSampler() override;

    void setName(const std::string& name) override;
    VkSampler handle() const { return handle_; }

private:
    explicit VulkanSampler(VulkanDevice& device) : device_(device) {}

    VulkanDevice& device_;
    VkSampler handle_ = VK_NULL_HANDLE;
};

}  // namespace glint::vulkan
