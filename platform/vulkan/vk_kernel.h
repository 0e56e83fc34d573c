#pragma once

#include "platform/vulkan/vk_layout.h"

#include <glint/device/detail/backend.h>

namespace glint::vulkan {

/// One stage of a pipeline: its shader module, which lives until the pipeline is made, and its constants. Not movable:
/// `info` points into it.
class StageModule {
public:
    explicit StageModule(VulkanDevice& device) : device_(device) {}
    ~StageModule();
    StageModule(const StageModule&) = delete;
    StageModule& operator=(const StageModule&) = delete;

    Status create(const detail::StageDesc& desc);

    VkPipelineShaderStageCreateInfo info = {VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO};

private:
    VulkanDevice& device_;
    std::string entry_;
    std::vector<VkSpecializationMapEntry> entries_;
    std::vector<uint32_t> values_;
    VkSpecializationInfo constants_ = {};
};

class VulkanKernel final : public detail::NativeKernel {
public:
    static Expected<std::unique_ptr<VulkanKernel>> create(VulkanDevice& device, const detail::KernelDesc& desc);
    ~VulkanKernel() override;

    void setName(const std::string& name) override;
    VkPipeline handle() const { return handle_; }
    const PipelineLayout& layout() const { return *layout_; }

private:
    explicit VulkanKernel(VulkanDevice& device) : device_(device) {}

    VulkanDevice& device_;
    PipelineLayout* layout_ = nullptr;
    VkPipeline handle_ = VK_NULL_HANDLE;
};

}  // namespace glint::vulkan
