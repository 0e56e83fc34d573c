#include "platform/vulkan/vk_texture.h"

#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_result.h"

namespace glint::vulkan {

namespace {

VkFormatFeatureFlags formatFeatures(const VulkanDevice& device, Format format) {
    VkFormatProperties properties = {};
    device.instance->vk.GetPhysicalDeviceFormatProperties(device.adapter.handle, vulkanFormat(format), &properties);
    return properties.optimalTilingFeatures;
}

VkImageUsageFlags usageOf(Format format, Texture::Flags flags, VkFormatFeatureFlags features) {
    VkImageUsageFlags usage = 0;
    if (features & VK_FORMAT_FEATURE_TRANSFER_SRC_BIT) usage |= VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
    if (features & VK_FORMAT_FEATURE_TRANSFER_DST_BIT) usage |= VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    if (features & VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT) usage |= VK_IMAGE_USAGE_SAMPLED_BIT;
    if (flags & Texture::FlagSurface) usage |= VK_IMAGE_USAGE_STORAGE_BIT;
    if (flags & Texture::FlagTarget) {
        usage |= formatInfo(format).depth ? VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT
                                          : VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
    }
    return usage;
}

VkImageCreateFlags createFlags(Texture::Type type, Texture::Flags flags) {
    if (type == Texture::TypeCube) return VK_IMAGE_CREATE_CUBE_COMPATIBLE_BIT;
    // Slices of a volume are drawn to as layers.
    const bool is_target = flags & Texture::FlagTarget;
    return type == Texture::Type3D && is_target ? VK_IMAGE_CREATE_2D_ARRAY_COMPATIBLE_BIT : 0;
}

/// Sample counts that an image of this use may have, 0 if there can be none.
VkSampleCountFlags sampleCounts(const VulkanDevice& device, Format format, Texture::Type type, Texture::Flags flags,
                                VkFormatFeatureFlags features) {
    VkPhysicalDeviceImageFormatInfo2 info = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_IMAGE_FORMAT_INFO_2};
    info.format = vulkanFormat(format);
    info.type = vulkanImageType(type);
    info.tiling = VK_IMAGE_TILING_OPTIMAL;
    info.usage = usageOf(format, flags, features);
    info.flags = createFlags(type, flags);
    VkImageFormatProperties2 properties = {VK_STRUCTURE_TYPE_IMAGE_FORMAT_PROPERTIES_2};
    const VkResult result =
        device.instance->vk.GetPhysicalDeviceImageFormatProperties2(device.adapter.handle, &info, &properties);
    return result == VK_SUCCESS ? properties.imageFormatProperties.sampleCounts : 0;
}

}  // namespace

uint32_t textureSupport(const VulkanDevice& device, Format format, Texture::Type type) {
    const FormatInfo& info = formatInfo(format);
    if (vulkanFormat(format) == VK_FORMAT_UNDEFINED) return 0;
    // The driver reports compressed formats even if the feature is not enabled.
    if (info.compressed && !(device.enabled.mask & FeatureTextureBC)) return 0;
    const VkFormatFeatureFlags features = formatFeatures(device, format);
    constexpr VkFormatFeatureFlags copies = VK_FORMAT_FEATURE_TRANSFER_SRC_BIT | VK_FORMAT_FEATURE_TRANSFER_DST_BIT;
    if ((features & copies) != copies || !sampleCounts(device, format, type, 0, features)) return 0;

    uint32_t support = 0;
    if (features & VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT) support |= supports_sampling | Texture::FlagMipmaps;
    // GLSL has no image formats for depth, whatever a driver offers.
    if ((features & VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT) && !info.depth &&
        sampleCounts(device, format, type, Texture::FlagSurface, features)) {
        support |= Texture::FlagSurface;
    }
    const VkFormatFeatureFlags attachment =
        info.depth ? VK_FORMAT_FEATURE_DEPTH_STENCIL_ATTACHMENT_BIT : VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BIT;
    if (features & attachment) {
        const VkSampleCountFlags samples = sampleCounts(device, format, type, Texture::FlagTarget, features);
        if (samples) support |= Texture::FlagTarget;
        if (type == Texture::Type2D) {
            if (samples & VK_SAMPLE_COUNT_2_BIT) support |= Texture::FlagMultisample2;
            if (samples & VK_SAMPLE_COUNT_4_BIT) support |= Texture::FlagMultisample4;
            if (samples & VK_SAMPLE_COUNT_8_BIT) support |= Texture::FlagMultisample8;
        }
    }
    return support;
}

VkImageViewType viewType(ImageDimension dimension, const VulkanTexture& texture, Slice& slice) {
    switch (dimension) {
        case ImageDimension::Image2D:
        case ImageDimension::Image2DMultisample: slice.layers = 1; return VK_IMAGE_VIEW_TYPE_2D;
        case ImageDimension::Image3D: return VK_IMAGE_VIEW_TYPE_3D;
        case ImageDimension::Cube: slice.layers = 6; return VK_IMAGE_VIEW_TYPE_CUBE;
        case ImageDimension::Image2DArray: return VK_IMAGE_VIEW_TYPE_2D_ARRAY;
        case ImageDimension::CubeArray: return VK_IMAGE_VIEW_TYPE_CUBE_ARRAY;
        case ImageDimension::None: break;
    }
    switch (texture.desc().type) {
        case Texture::Type3D: return VK_IMAGE_VIEW_TYPE_3D;
        case Texture::TypeCube: return slice.layers == 6 ? VK_IMAGE_VIEW_TYPE_CUBE : VK_IMAGE_VIEW_TYPE_CUBE_ARRAY;
        case Texture::Type2D: break;
    }
    return slice.layers == 1 ? VK_IMAGE_VIEW_TYPE_2D : VK_IMAGE_VIEW_TYPE_2D_ARRAY;
}

VulkanTexture::VulkanTexture(VulkanDevice& device, const TextureDesc& desc, uint32_t samples)
    : device_(device),
      desc_(desc),
      samples_(samples),
      format_(vulkanFormat(desc.format)),
      aspects_(formatAspects(desc.format)) {}

Expected<std::unique_ptr<VulkanTexture>> VulkanTexture::create(VulkanDevice& device,
                                                               const detail::NativeTextureDesc& native) {
    const TextureDesc& desc = native.desc;
    VkImageCreateInfo info = {VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
    info.flags = createFlags(desc.type, desc.flags);
    info.imageType = vulkanImageType(desc.type);
    info.format = vulkanFormat(desc.format);
    info.extent = {desc.width, desc.height, desc.depth};
    info.mipLevels = desc.mipmaps;
    info.arrayLayers = desc.layers;
    info.samples = vulkanSamples(native.samples);
    info.tiling = VK_IMAGE_TILING_OPTIMAL;
    info.usage = usageOf(desc.format, desc.flags, formatFeatures(device, desc.format));
    info.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED;
    setSharing(info, device.families);
    Expected<RawImage> raw = device.memory.createImage(info);
    if (!raw) return unexpected(raw.error().named(native.name));
    std::unique_ptr<VulkanTexture> texture(new VulkanTexture(device, desc, native.samples));
    texture->raw_ = *raw;
    texture->memory = raw->memory;
    texture->setName(native.name);
    return texture;
}

std::unique_ptr<VulkanTexture> VulkanTexture::adopt(VulkanDevice& device, VkImage handle, const TextureDesc& desc,
                                                    uint32_t samples) {
    std::unique_ptr<VulkanTexture> texture(new VulkanTexture(device, desc, samples));
    texture->raw_.handle = handle;
    return texture;
}

VulkanTexture::~VulkanTexture() {
    for (const View& view : views_) device_.vk.DestroyImageView(device_.handle, view.handle, nullptr);
    device_.memory.destroy(raw_);
}

void VulkanTexture::setName(const std::string& name) { device_.setName(VK_OBJECT_TYPE_IMAGE, raw_.handle, name); }

Expected<VkImageView> VulkanTexture::view(Slice slice, VkImageViewType type, VkImageAspectFlags aspects) {
    for (const View& view : views_) {
        if (view.slice == slice && view.type == type && view.aspects == aspects) return view.handle;
    }
    VkImageViewCreateInfo info = {VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO};
    info.image = raw_.handle;
    info.viewType = type;
    info.format = format_;
    info.subresourceRange = {aspects, slice.mip, slice.mips, slice.layer, slice.layers};
    View view = {slice, type, aspects, VK_NULL_HANDLE};
    const VkResult result = device_.vk.CreateImageView(device_.handle, &info, nullptr, &view.handle);
    if (result != VK_SUCCESS) return unexpected(resultError("vkCreateImageView", result));
    device_.memory.objects_created++;
    views_.push_back(view);
    return view.handle;
}

}  // namespace glint::vulkan
