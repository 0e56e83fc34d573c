#include "platform/vulkan/vk_memory.h"

#include "platform/vulkan/vk_result.h"

#include <glint/base/format_error.h>

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wunused-variable"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wparentheses"
#endif
#define VMA_IMPLEMENTATION
#define VMA_STATIC_VULKAN_FUNCTIONS 0
#define VMA_DYNAMIC_VULKAN_FUNCTIONS 1
#define VMA_VULKAN_VERSION 1003000
#include <vk_mem_alloc.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

namespace glint::vulkan {

namespace {

VKAPI_ATTR void VKAPI_CALL onAllocate(VmaAllocator, uint32_t, VkDeviceMemory, VkDeviceSize, void* user) {
    Memory& memory = *static_cast<Memory*>(user);
    memory.allocations++;
    memory.objects_created++;
}

VKAPI_ATTR void VKAPI_CALL onFree(VmaAllocator, uint32_t, VkDeviceMemory, VkDeviceSize, void* user) {
    Memory& memory = *static_cast<Memory*>(user);
    memory.allocations--;
}

Error memoryError(const char* call, VkResult result, uint64_t size) {
    Error error = resultError(call, result);
    if (error.code() != ErrorCode::OutOfMemory) return error;
    return makeError(ErrorCode::OutOfMemory, "device.out_of_memory", "{} gave {} for {} bytes", call,
                     resultName(result), size);
}

}  // namespace

Status Memory::create(const Instance& instance, VkPhysicalDevice adapter, VkDevice device, bool addresses) {
    VkPhysicalDeviceMemoryProperties properties;
    instance.vk.GetPhysicalDeviceMemoryProperties(adapter, &properties);
    VkDeviceSize largest = 0;
    for (uint32_t i = 0; i < properties.memoryTypeCount; i++) {
        constexpr VkMemoryPropertyFlags host =
            VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT | VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT |
            VK_MEMORY_PROPERTY_HOST_COHERENT_BIT | VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
        const VkMemoryType& type = properties.memoryTypes[i];
        const VkDeviceSize size = properties.memoryHeaps[type.heapIndex].size;
        if (!(type.propertyFlags & VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT) || size < largest) continue;
        const bool fits = (type.propertyFlags & host) == host;
        is_host_memory_ = size > largest ? fits : is_host_memory_ || fits;
        largest = size;
    }

    // The driver is not to be asked for more than there is (VUID-vkAllocateMemory-pAllocateInfo-01713).
    VkDeviceSize limits[VK_MAX_MEMORY_HEAPS] = {};
    for (uint32_t i = 0; i < properties.memoryHeapCount; i++) limits[i] = properties.memoryHeaps[i].size;

    VmaVulkanFunctions functions = {};
    functions.vkGetInstanceProcAddr = instance.vk.GetInstanceProcAddr;
    functions.vkGetDeviceProcAddr = instance.vk.GetDeviceProcAddr;
    VmaDeviceMemoryCallbacks callbacks = {};
    callbacks.pfnAllocate = onAllocate;
    callbacks.pfnFree = onFree;
    callbacks.pUserData = this;
    VmaAllocatorCreateInfo info = {};
    info.flags = VMA_ALLOCATOR_CREATE_KHR_MAINTENANCE4_BIT;
    if (addresses) info.flags |= VMA_ALLOCATOR_CREATE_BUFFER_DEVICE_ADDRESS_BIT;
    info.physicalDevice = adapter;
    info.device = device;
    info.instance = instance.handle;
    info.vulkanApiVersion = VK_API_VERSION_1_3;
    info.pHeapSizeLimit = limits;
    info.pDeviceMemoryCallbacks = &callbacks;
    info.pVulkanFunctions = &functions;
    const VkResult result = vmaCreateAllocator(&info, &allocator_);
    return result == VK_SUCCESS ? Status() : resultError("vmaCreateAllocator", result);
}

Memory::~Memory() {
    if (allocator_) vmaDestroyAllocator(allocator_);
}

Expected<RawBuffer> Memory::createBuffer(const VkBufferCreateInfo& info, MemoryKind kind, VkDeviceSize alignment) {
    VmaAllocationCreateInfo wanted = {};
    wanted.usage = VMA_MEMORY_USAGE_AUTO_PREFER_DEVICE;
    constexpr VkMemoryPropertyFlags host = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    switch (kind) {
        case MemoryKind::Device:
            if (!is_host_memory_) break;
            wanted.flags = VMA_ALLOCATION_CREATE_MAPPED_BIT | VMA_ALLOCATION_CREATE_HOST_ACCESS_RANDOM_BIT |
                           VMA_ALLOCATION_CREATE_HOST_ACCESS_ALLOW_TRANSFER_INSTEAD_BIT;
            break;
        case MemoryKind::Upload:
            wanted.flags = VMA_ALLOCATION_CREATE_MAPPED_BIT | VMA_ALLOCATION_CREATE_HOST_ACCESS_SEQUENTIAL_WRITE_BIT;
            wanted.requiredFlags = host;
            break;
        case MemoryKind::Mapped:
        case MemoryKind::Readback:
            wanted.flags = VMA_ALLOCATION_CREATE_MAPPED_BIT | VMA_ALLOCATION_CREATE_HOST_ACCESS_RANDOM_BIT;
            wanted.requiredFlags = host;
            wanted.usage = kind == MemoryKind::Mapped ? VMA_MEMORY_USAGE_AUTO : VMA_MEMORY_USAGE_AUTO_PREFER_HOST;
            break;
    }
    RawBuffer buffer;
    VmaAllocationInfo allocated = {};
    const VkResult result = vmaCreateBufferWithAlignment(allocator_, &info, &wanted, alignment, &buffer.handle,
                                                         &buffer.allocation, &allocated);
    if (result != VK_SUCCESS) return unexpected(memoryError("vkCreateBuffer", result, info.size));
    objects_created++;
    buffer.memory = allocated.size;
    bytes += buffer.memory;
    VkMemoryPropertyFlags flags = 0;
    vmaGetAllocationMemoryProperties(allocator_, buffer.allocation, &flags);
    if ((flags & host) == host) buffer.mapped = allocated.pMappedData;
    return buffer;
}

Expected<RawImage> Memory::createImage(const VkImageCreateInfo& info) {
    VmaAllocationCreateInfo wanted = {};
    wanted.usage = VMA_MEMORY_USAGE_AUTO_PREFER_DEVICE;
    RawImage image;
    VmaAllocationInfo allocated = {};
    const VkResult result = vmaCreateImage(allocator_, &info, &wanted, &image.handle, &image.allocation, &allocated);
    if (result != VK_SUCCESS) return unexpected(resultError("vkCreateImage", result));
    objects_created++;
    image.memory = allocated.size;
    bytes += image.memory;
    return image;
}

void Memory::destroy(RawBuffer& buffer) {
    if (buffer.allocation) {
        vmaDestroyBuffer(allocator_, buffer.handle, buffer.allocation);
        bytes -= buffer.memory;
    }
    buffer = {};
}

void Memory::destroy(RawImage& image) {
    if (image.allocation) {
        vmaDestroyImage(allocator_, image.handle, image.allocation);
        bytes -= image.memory;
    }
    image = {};
}

}  // namespace glint::vulkan
