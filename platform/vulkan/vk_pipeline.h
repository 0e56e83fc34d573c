#pragma once

#include "platform/vulkan/vk_layout.h"

#include <glint/device/detail/backend.h>

namespace glint::vulkan {

class VulkanPipeline final : public detail::NativePipeline {
public:
    static Expected<std::unique_ptr<VulkanPipeline>> create(VulkanDevice& device, const detail::PipelineDesc& desc);
    ~VulkanPipeline() override;

    void setName(const std::string& name) override;
    VkPipeline handle() const { return handle_; }
    const PipelineLayout& layout() const { return *layout_; }

private:
    explicit VulkanPipeline(VulkanDevice& device) : device_(device) {}

    VulkanDevice& device_;
    PipelineLayout* layout_ = nullptr;
    VkPipeline handle_ = VK_NULL_HANDLE;
};

}  // namespace glint::vulkan
