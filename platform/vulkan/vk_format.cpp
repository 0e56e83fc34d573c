#include "platform/vulkan/vk_format.h"

#include <array>

namespace glint::vulkan {

namespace {

constexpr std::array<VkFormat, FormatCount> makeTable() {
    std::array<VkFormat, FormatCount> table = {};
    table[FormatRu8n] = VK_FORMAT_R8_UNORM;
    table[FormatRi8n] = VK_FORMAT_R8_SNORM;
    table[FormatRu8] = VK_FORMAT_R8_UINT;
    table[FormatRi8] = VK_FORMAT_R8_SINT;
    table[FormatRu16n] = VK_FORMAT_R16_UNORM;
    table[FormatRi16n] = VK_FORMAT_R16_SNORM;
    table[FormatRu16] = VK_FORMAT_R16_UINT;
    table[FormatRi16] = VK_FORMAT_R16_SINT;
    table[FormatRf16] = VK_FORMAT_R16_SFLOAT;
    table[FormatRu32] = VK_FORMAT_R32_UINT;
    table[FormatRi32] = VK_FORMAT_R32_SINT;
    table[FormatRf32] = VK_FORMAT_R32_SFLOAT;
    table[FormatRu64] = VK_FORMAT_R64_UINT;
    table[FormatRGu8n] = VK_FORMAT_R8G8_UNORM;
    table[FormatRGi8n] = VK_FORMAT_R8G8_SNORM;
    table[FormatRGu8] = VK_FORMAT_R8G8_UINT;
    table[FormatRGi8] = VK_FORMAT_R8G8_SINT;
    table[FormatRGu16n] = VK_FORMAT_R16G16_UNORM;
    table[FormatRGi16n] = VK_FORMAT_R16G16_SNORM;
    table[FormatRGu16] = VK_FORMAT_R16G16_UINT;
    table[FormatRGi16] = VK_FORMAT_R16G16_SINT;
    table[FormatRGf16] = VK_FORMAT_R16G16_SFLOAT;
    table[FormatRGu32] = VK_FORMAT_R32G32_UINT;
    table[FormatRGi32] = VK_FORMAT_R32G32_SINT;
    table[FormatRGf32] = VK_FORMAT_R32G32_SFLOAT;
    table[FormatRGBu32] = VK_FORMAT_R32G32B32_UINT;
    table[FormatRGBi32] = VK_FORMAT_R32G32B32_SINT;
    table[FormatRGBf32] = VK_FORMAT_R32G32B32_SFLOAT;
    table[FormatRGBAu8n] = VK_FORMAT_R8G8B8A8_UNORM;
    table[FormatRGBAi8n] = VK_FORMAT_R8G8B8A8_SNORM;
    table[FormatRGBAu8] = VK_FORMAT_R8G8B8A8_UINT;
    table[FormatRGBAi8] = VK_FORMAT_R8G8B8A8_SINT;
    table[FormatRGBAu8ns] = VK_FORMAT_R8G8B8A8_SRGB;
    table[FormatBGRAu8n] = VK_FORMAT_B8G8R8A8_UNORM;
    table[FormatBGRAu8ns] = VK_FORMAT_B8G8R8A8_SRGB;
    table[FormatRGBAu16n] = VK_FORMAT_R16G16B16A16_UNORM;
    table[FormatRGBAi16n] = VK_FORMAT_R16G16B16A16_SNORM;
    table[FormatRGBAu16] = VK_FORMAT_R16G16B16A16_UINT;
    table[FormatRGBAi16] = VK_FORMAT_R16G16B16A16_SINT;
    table[FormatRGBAf16] = VK_FORMAT_R16G16B16A16_SFLOAT;
    table[FormatRGBAu32] = VK_FORMAT_R32G32B32A32_UINT;
    table[FormatRGBAi32] = VK_FORMAT_R32G32B32A32_SINT;
    table[FormatRGBAf32] = VK_FORMAT_R32G32B32A32_SFLOAT;
    // Vulkan's packed formats name the highest bits first.
    table[FormatRGBu10Au2n] = VK_FORMAT_A2B10G10R10_UNORM_PACK32;
    table[FormatRGBf11f11f10] = VK_FORMAT_B10G11R11_UFLOAT_PACK32;
    table[FormatRGBEu9e5] = VK_FORMAT_E5B9G9R9_UFLOAT_PACK32;
    table[FormatDu16n] = VK_FORMAT_D16_UNORM;
    table[FormatDf32] = VK_FORMAT_D32_SFLOAT;
    table[FormatDu24Su8] = VK_FORMAT_D24_UNORM_S8_UINT;
    table[FormatDf32Su8] = VK_FORMAT_D32_SFLOAT_S8_UINT;
    table[FormatBC1RGBAu8n] = VK_FORMAT_BC1_RGBA_UNORM_BLOCK;
    table[FormatBC1RGBAu8ns] = VK_FORMAT_BC1_RGBA_SRGB_BLOCK;
    table[FormatBC3RGBAu8n] = VK_FORMAT_BC3_UNORM_BLOCK;
    table[FormatBC3RGBAu8ns] = VK_FORMAT_BC3_SRGB_BLOCK;
    table[FormatBC4Ru8n] = VK_FORMAT_BC4_UNORM_BLOCK;
    table[FormatBC5RGu8n] = VK_FORMAT_BC5_UNORM_BLOCK;
    table[FormatBC6HRGBf16] = VK_FORMAT_BC6H_UFLOAT_BLOCK;
    table[FormatBC7RGBAu8n] = VK_FORMAT_BC7_UNORM_BLOCK;
    table[FormatBC7RGBAu8ns] = VK_FORMAT_BC7_SRGB_BLOCK;
    return table;
}

constexpr std::array<VkFormat, FormatCount> table = makeTable();

constexpr bool isFilled() {
    for (size_t i = 1; i < table.size(); i++) {
        if (table[i] == VK_FORMAT_UNDEFINED) return false;
    }
    return true;
}
static_assert(isFilled(), "a format has no entry in the table");

}  // namespace

VkFormat vulkanFormat(Format format) { return table[format < FormatCount ? format : FormatUnknown]; }

Format glintFormat(VkFormat format) {
    for (size_t i = 1; i < table.size(); i++) {
        if (table[i] == format) return static_cast<Format>(i);
    }
    return FormatUnknown;
}

VkImageAspectFlags formatAspects(Format format) {
    const FormatInfo& info = formatInfo(format);
    VkImageAspectFlags aspects = 0;
    if (info.depth) aspects |= VK_IMAGE_ASPECT_DEPTH_BIT;
    if (info.stencil) aspects |= VK_IMAGE_ASPECT_STENCIL_BIT;
    if (aspects == 0) aspects = VK_IMAGE_ASPECT_COLOR_BIT;
    return aspects;
}

VkImageAspectFlags mainAspect(Format format) {
    return formatInfo(format).depth ? VK_IMAGE_ASPECT_DEPTH_BIT : VK_IMAGE_ASPECT_COLOR_BIT;
}

VkImageLayout vulkanLayout(detail::Layout layout) {
    switch (layout) {
        case detail::Layout::Undefined: return VK_IMAGE_LAYOUT_UNDEFINED;
        case detail::Layout::General: return VK_IMAGE_LAYOUT_GENERAL;
        case detail::Layout::Sampled: return VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;
        case detail::Layout::ColorTarget: return VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
        case detail::Layout::DepthTarget: return VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
        case detail::Layout::CopySource: return VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
        case detail::Layout::CopyDestination: return VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
        case detail::Layout::Present: return VK_IMAGE_LAYOUT_PRESENT_SRC_KHR;
        case detail::Layout::None: break;
    }
    return VK_IMAGE_LAYOUT_GENERAL;
}

VkImageType vulkanImageType(Texture::Type type) {
    return type == Texture::Type3D ? VK_IMAGE_TYPE_3D : VK_IMAGE_TYPE_2D;
}

VkSampleCountFlagBits vulkanSamples(uint32_t samples) {
    static_assert(VK_SAMPLE_COUNT_1_BIT == 1 && VK_SAMPLE_COUNT_8_BIT == 8);
    return static_cast<VkSampleCountFlagBits>(samples);
}

VkShaderStageFlagBits vulkanStage(ShaderStage stage) {
    switch (stage) {
        case ShaderStage::Vertex: return VK_SHADER_STAGE_VERTEX_BIT;
        case ShaderStage::Control: return VK_SHADER_STAGE_TESSELLATION_CONTROL_BIT;
        case ShaderStage::Evaluate: return VK_SHADER_STAGE_TESSELLATION_EVALUATION_BIT;
        case ShaderStage::Geometry: return VK_SHADER_STAGE_GEOMETRY_BIT;
        case ShaderStage::Fragment: return VK_SHADER_STAGE_FRAGMENT_BIT;
        case ShaderStage::Compute: return VK_SHADER_STAGE_COMPUTE_BIT;
        case ShaderStage::Task: return VK_SHADER_STAGE_TASK_BIT_EXT;
        case ShaderStage::Mesh: return VK_SHADER_STAGE_MESH_BIT_EXT;
        case ShaderStage::RayGen: return VK_SHADER_STAGE_RAYGEN_BIT_KHR;
        case ShaderStage::RayMiss: return VK_SHADER_STAGE_MISS_BIT_KHR;
        case ShaderStage::Closest: return VK_SHADER_STAGE_CLOSEST_HIT_BIT_KHR;
        case ShaderStage::FirstHit: return VK_SHADER_STAGE_ANY_HIT_BIT_KHR;
        case ShaderStage::Intersection: return VK_SHADER_STAGE_INTERSECTION_BIT_KHR;
        case ShaderStage::Callable: return VK_SHADER_STAGE_CALLABLE_BIT_KHR;
        case ShaderStage::Count: break;
    }
    return VK_SHADER_STAGE_COMPUTE_BIT;
}

VkShaderStageFlags vulkanStages(ShaderMask stages) {
    VkShaderStageFlags flags = 0;
    for (uint32_t i = 0; i < static_cast<uint32_t>(ShaderStage::Count); i++) {
        if (stages & (1u << i)) flags |= vulkanStage(static_cast<ShaderStage>(i));
    }
    return flags;
}

}  // namespace glint::vulkan
