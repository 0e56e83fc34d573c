#include "platform/vulkan/vk_sampler.h"

#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_result.h"

namespace glint::vulkan {

namespace {

VkSamplerAddressMode addressMode(Sampler::WrapMode wrap) {
    switch (wrap) {
        case Sampler::WrapModeClamp: return VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
        case Sampler::WrapModeRepeat: return VK_SAMPLER_ADDRESS_MODE_REPEAT;
        case Sampler::WrapModeMirror: return VK_SAMPLER_ADDRESS_MODE_MIRRORED_REPEAT;
        case Sampler::WrapModeBorder: return VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_BORDER;
    }
    return VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
}

VkSamplerReductionMode reductionMode(Sampler::Reduction reduction) {
    switch (reduction) {
        case Sampler::ReductionAverage: return VK_SAMPLER_REDUCTION_MODE_WEIGHTED_AVERAGE;
        case Sampler::ReductionMinimum: return VK_SAMPLER_REDUCTION_MODE_MIN;
        case Sampler::ReductionMaximum: return VK_SAMPLER_REDUCTION_MODE_MAX;
    }
    return VK_SAMPLER_REDUCTION_MODE_WEIGHTED_AVERAGE;
}

VkBorderColor borderColor(const Color& color) {
    if (color.a < 0.5f) return VK_BORDER_COLOR_FLOAT_TRANSPARENT_BLACK;
    return color.r < 0.5f ? VK_BORDER_COLOR_FLOAT_OPAQUE_BLACK : VK_BORDER_COLOR_FLOAT_OPAQUE_WHITE;
}

}  // namespace

Expected<std::unique_ptr<VulkanSampler>> VulkanSampler::create(VulkanDevice& device, const SamplerDesc& desc) {
    const bool is_point = desc.filter == Sampler::FilterPoint || desc.filter == Sampler::FilterBipoint;
    const bool has_mips = desc.filter != Sampler::FilterPoint && desc.filter != Sampler::FilterLinear;
    VkSamplerReductionModeCreateInfo reduction = {VK_STRUCTURE_TYPE_SAMPLER_REDUCTION_MODE_CREATE_INFO, nullptr,
                                                  reductionMode(desc.reduction)};
    VkSamplerCreateInfo info = {VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO};
    if (desc.reduction != Sampler::ReductionAverage) info.pNext = &reduction;
    info.magFilter = is_point ? VK_FILTER_NEAREST : VK_FILTER_LINEAR;
    info.minFilter = info.magFilter;
    info.mipmapMode =
        desc.filter == Sampler::FilterTrilinear ? VK_SAMPLER_MIPMAP_MODE_LINEAR : VK_SAMPLER_MIPMAP_MODE_NEAREST;
    info.addressModeU = info.addressModeV = info.addressModeW = addressMode(desc.wrap);
    info.anisotropyEnable = desc.anisotropy > 1;
    info.maxAnisotropy = static_cast<float>(desc.anisotropy);
    info.compareEnable = desc.comparing;
    info.compareOp = vulkanCompare(desc.compare);
    info.minLod = has_mips ? desc.lod_minimum : 0.0f;
    info.maxLod = has_mips ? desc.lod_maximum : 0.0f;
    info.mipLodBias = has_mips ? desc.lod_bias : 0.0f;
    info.borderColor = borderColor(desc.border);

    std::unique_ptr<VulkanSampler> sampler(new VulkanSampler(device));
    const VkResult result = device.vk.CreateSampler(device.handle, &info, nullptr, &sampler->handle_);
    if (result != VK_SUCCESS) return unexpected(resultError("vkCreateSampler", result));
    device.memory.objects_created++;
    return sampler;
}

VulkanSampler::~VulkanSampler() { device_.vk.DestroySampler(device_.handle, handle_, nullptr); }

void VulkanSampler::setName(const std::string& name) { device_.setName(VK_OBJECT_TYPE_SAMPLER, handle_, name); }

}  // namespace glint::vulkan
