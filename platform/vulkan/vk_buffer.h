#pragma once

#include "platform/vulkan/vk_memory.h"

#include <glint/device/detail/backend.h>

#include <vector>

namespace glint::vulkan {

class VulkanDevice;

class VulkanBuffer final : public detail::NativeBuffer {
public:
    static Expected<std::unique_ptr<VulkanBuffer>> create(VulkanDevice& device, const detail::NativeBufferDesc& desc);
    /// A buffer of the caller's, who destroys it.
    static std::unique_ptr<VulkanBuffer> adopt(VulkanDevice& device, VkBuffer handle, Buffer::Flags flags);
    ~VulkanBuffer() override;

    void setName(const std::string& name) override;
    VkBuffer handle() const { return raw_.handle; }
    /// A view for a texel buffer, made when first asked for. Under the submit lock.
    Expected<VkBufferView> texels(Format format, uint64_t offset, uint64_t size);

private:
    struct View {
        Format format = FormatUnknown;
        uint64_t offset = 0;
        uint64_t size = 0;
        VkBufferView handle = VK_NULL_HANDLE;
    };

    explicit VulkanBuffer(VulkanDevice& device) : device_(device) {}
    void readAddress(Buffer::Flags flags);

    VulkanDevice& device_;
    RawBuffer raw_;
    std::vector<View> views_;
};

}  // namespace glint::vulkan
