#pragma once

#include "platform/vulkan/vk_memory.h"

#include <glint/device/detail/backend.h>

#include <vector>

namespace glint::vulkan {

class VulkanDevice;

/// What the adapter allows for a format: Texture::Flag bits, plus sampling in bit 31.
uint32_t textureSupport(const VulkanDevice& device, Format format, Texture::Type type);
constexpr uint32_t supports_sampling = 1u << 31;

class VulkanTexture;
/// The view type of a descriptor, whose slice gets as many layers as it takes. Without a dimension (aliases of a table
/// that differ) it follows the texture.
VkImageViewType viewType(ImageDimension dimension, const VulkanTexture& texture, Slice& slice);

class VulkanTexture final : public detail::NativeTexture {
public:
    static Expected<std::unique_ptr<VulkanTexture>> create(VulkanDevice& device, const detail::NativeTextureDesc& desc);
    /// An image of the caller's, who destroys it.
    static std::unique_ptr<VulkanTexture> adopt(VulkanDevice& device, VkImage handle, const TextureDesc& desc,
                                                uint32_t samples);
    ~VulkanTexture() override;

    void setName(const std::string& name) override;
    VkImage handle() const { return raw_.handle; }
    const TextureDesc& desc() const { return desc_; }
    uint32_t samples() const { return samples_; }
    VkFormat format() const { return format_; }
    VkImageAspectFlags aspects() const { return aspects_; }

    /// A view of a slice, made when first asked for. Under the submit lock.
    Expected<VkImageView> view(Slice slice, VkImageViewType type, VkImageAspectFlags aspects);

private:
    struct View {
        Slice slice;
        VkImageViewType type = VK_IMAGE_VIEW_TYPE_2D;
        VkImageAspectFlags aspects = 0;
        VkImageView handle = VK_NULL_HANDLE;
    };

    VulkanTexture(VulkanDevice& device, const TextureDesc& desc, uint32_t samples);

    VulkanDevice& device_;
    const TextureDesc desc_;
    const uint32_t samples_;
    const VkFormat format_;
    const VkImageAspectFlags aspects_;
    RawImage raw_;
    std::vector<View> views_;
};

}  // namespace glint::vulkan
