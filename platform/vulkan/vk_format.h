#pragma once

// Glint's enumerations in Vulkan's words.

#include "platform/vulkan/vk_functions.h"

#include <glint/device/detail/backend.h>

namespace glint::vulkan {

/// VK_FORMAT_UNDEFINED for FormatUnknown.
VkFormat vulkanFormat(Format format);
/// FormatUnknown for what Glint has no name for.
Format glintFormat(VkFormat format);
/// All aspects of the format.
VkImageAspectFlags formatAspects(Format format);
/// The aspect that is sampled and copied: colour, or depth where there is depth.
VkImageAspectFlags mainAspect(Format format);

VkImageLayout vulkanLayout(detail::Layout layout);
VkImageType vulkanImageType(Texture::Type type);
VkSampleCountFlagBits vulkanSamples(uint32_t samples);
VkShaderStageFlagBits vulkanStage(ShaderStage stage);
VkShaderStageFlags vulkanStages(ShaderMask stages);

inline VkCompareOp vulkanCompare(Compare compare) {
    static_assert(VK_COMPARE_OP_NEVER == int(Compare::Never) &&
                  VK_COMPARE_OP_LESS_OR_EQUAL == int(Compare::LessEqual) &&
                  VK_COMPARE_OP_NOT_EQUAL == int(Compare::NotEqual) && VK_COMPARE_OP_ALWAYS == int(Compare::Always));
    return static_cast<VkCompareOp>(compare);
}

}  // namespace glint::vulkan
