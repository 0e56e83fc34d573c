#include "platform/vulkan/vk_kernel.h"

#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_result.h"

namespace glint::vulkan {

Status StageModule::create(const detail::StageDesc& desc) {
    entry_ = desc.entry;
    for (const detail::SpecializationValue& constant : desc.constants) {
        entries_.push_back({constant.id, static_cast<uint32_t>(values_.size() * sizeof(uint32_t)), sizeof(uint32_t)});
        values_.push_back(constant.value);
    }
    constants_ = {static_cast<uint32_t>(entries_.size()), entries_.data(), values_.size() * sizeof(uint32_t),
                  values_.data()};
    info.stage = vulkanStage(desc.stage);
    info.pName = entry_.c_str();
    info.pSpecializationInfo = entries_.empty() ? nullptr : &constants_;

    VkShaderModuleCreateInfo module_info = {VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
    module_info.codeSize = desc.words.size_bytes();
    module_info.pCode = desc.words.data();
    const VkResult result = device_.vk.CreateShaderModule(device_.handle, &module_info, nullptr, &info.module);
    if (result != VK_SUCCESS) return resultError("vkCreateShaderModule", result);
    device_.memory.objects_created++;
    return {};
}

StageModule::~StageModule() { device_.vk.DestroyShaderModule(device_.handle, info.module, nullptr); }

Expected<std::unique_ptr<VulkanKernel>> VulkanKernel::create(VulkanDevice& device, const detail::KernelDesc& desc) {
    Expected<PipelineLayout*> layout = device.layouts.get(*desc.layout);
    if (!layout) return unexpected(layout.error().named(desc.name));
    StageModule stage(device);
    if (Status status = stage.create(desc.stage); !status) return unexpected(status.error().named(desc.name));

    std::unique_ptr<VulkanKernel> kernel(new VulkanKernel(device));
    kernel->layout_ = *layout;
    VkComputePipelineCreateInfo info = {VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO};
    info.stage = stage.info;
    info.layout = kernel->layout_->handle;
    const VkResult result =
        device.vk.CreateComputePipelines(device.handle, VK_NULL_HANDLE, 1, &info, nullptr, &kernel->handle_);
    if (result != VK_SUCCESS) return unexpected(resultError("vkCreateComputePipelines", result).named(desc.name));
    device.memory.objects_created++;
    kernel->setName(desc.name);
    return kernel;
}

VulkanKernel::~VulkanKernel() { device_.vk.DestroyPipeline(device_.handle, handle_, nullptr); }

void VulkanKernel::setName(const std::string& name) { device_.setName(VK_OBJECT_TYPE_PIPELINE, handle_, name); }

}  // namespace glint::vulkan
