#include "platform/vulkan/vk_buffer.h"

#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_result.h"

namespace glint::vulkan {

namespace {

bool hasAddress(Buffer::Flags flags, const FeatureChain& features) {
    Buffer::Flags wanted = Buffer::FlagAddress | Buffer::FlagTracing | Buffer::FlagScratch;
    // Counts of rays are read by address.
    if (features.ray_pipeline.rayTracingPipelineTraceRaysIndirect) wanted |= Buffer::FlagIndirect;
    return (flags & wanted) && features.v12.bufferDeviceAddress;
}

VkBufferUsageFlags bufferUsage(Buffer::Flags flags, const FeatureChain& features) {
    VkBufferUsageFlags usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    if (flags & Buffer::FlagUniform) usage |= VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT;
    if (flags & Buffer::FlagStorage) usage |= VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
    if (flags & Buffer::FlagVertex) usage |= VK_BUFFER_USAGE_VERTEX_BUFFER_BIT;
    if (flags & Buffer::FlagIndex) usage |= VK_BUFFER_USAGE_INDEX_BUFFER_BIT;
    if (flags & Buffer::FlagIndirect) usage |= VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT;
    if (flags & Buffer::FlagTexel) {
        usage |= VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_TEXEL_BUFFER_BIT;
    }
    if (flags & (Buffer::FlagScratch | Buffer::FlagTracing)) usage |= VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
    if ((flags & Buffer::FlagTracing) && features.structures.accelerationStructure) {
        usage |= VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR;
    }
    if (hasAddress(flags, features)) usage |= VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
    return usage;
}

}  // namespace

Expected<std::unique_ptr<VulkanBuffer>> VulkanBuffer::create(VulkanDevice& device,
                                                             const detail::NativeBufferDesc& desc) {
    VkBufferCreateInfo info = {VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
    info.size = (desc.size + 3) / 4 * 4;  // so that kernels may read it by words
    info.usage = bufferUsage(desc.flags, device.enabled.features);
    setSharing(info, device.families);
    MemoryKind kind = MemoryKind::Device;
    if (desc.flags & Buffer::FlagMapped) kind = MemoryKind::Mapped;
    if (desc.staging) kind = MemoryKind::Upload;
    if (desc.readback) kind = MemoryKind::Readback;
    VkDeviceSize alignment = 1;
    if (desc.flags & Buffer::FlagScratch) alignment = device.features().scratchAlignment;
    // Instance records are read at multiples of 16 (VUID-vkCmdBuildAccelerationStructuresKHR-pInfos-03715).
    if (desc.flags & Buffer::FlagTracing) alignment = std::max<VkDeviceSize>(alignment, 16);

    Expected<RawBuffer> raw = device.memory.createBuffer(info, kind, alignment);
    if (!raw) return unexpected(raw.error().named(desc.name));
    std::unique_ptr<VulkanBuffer> buffer(new VulkanBuffer(device));
    buffer->raw_ = *raw;
    buffer->mapped = raw->mapped;
    buffer->memory = raw->memory;
    buffer->readAddress(desc.flags);
    buffer->setName(desc.name);
    return buffer;
}

std::unique_ptr<VulkanBuffer> VulkanBuffer::adopt(VulkanDevice& device, VkBuffer handle, Buffer::Flags flags) {
    std::unique_ptr<VulkanBuffer> buffer(new VulkanBuffer(device));
    buffer->raw_.handle = handle;
    buffer->readAddress(flags);
    return buffer;
}

void VulkanBuffer::readAddress(Buffer::Flags flags) {
    if (!hasAddress(flags, device_.enabled.features)) return;
    const VkBufferDeviceAddressInfo info = {VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO, nullptr, raw_.handle};
    address = device_.vk.GetBufferDeviceAddress(device_.handle, &info);
}

VulkanBuffer::~VulkanBuffer() {
    for (const View& view : views_) device_.vk.DestroyBufferView(device_.handle, view.handle, nullptr);
    device_.memory.destroy(raw_);
}

void VulkanBuffer::setName(const std::string& name) { device_.setName(VK_OBJECT_TYPE_BUFFER, raw_.handle, name); }

Expected<VkBufferView> VulkanBuffer::texels(Format format, uint64_t offset, uint64_t size) {
    for (const View& view : views_) {
        if (view.format == format && view.offset == offset && view.size == size) return view.handle;
    }
    VkBufferViewCreateInfo info = {VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO};
    info.buffer = raw_.handle;
    info.format = vulkanFormat(format);
    info.offset = offset;
    info.range = size;
    View view = {format, offset, size, VK_NULL_HANDLE};
    const VkResult result = device_.vk.CreateBufferView(device_.handle, &info, nullptr, &view.handle);
    if (result != VK_SUCCESS) return unexpected(resultError("vkCreateBufferView", result));
    device_.memory.objects_created++;
    views_.push_back(view);
    return view.handle;
}

}  // namespace glint::vulkan
