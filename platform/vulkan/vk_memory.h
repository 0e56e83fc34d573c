#pragma once

#include "platform/vulkan/vk_instance.h"

#include <glint/base/status.h>

#include <atomic>
#include <cstdint>

using VmaAllocator = struct VmaAllocator_T*;
using VmaAllocation = struct VmaAllocation_T*;

namespace glint::vulkan {

/// Where memory lives. All but Device are mapped and coherent; Device is where that costs nothing.
enum class MemoryKind : uint8_t {
    Device,    ///< for the GPU
    Mapped,    ///< written and read by both
    Upload,    ///< written by the host, read by the GPU
    Readback,  ///< written by the GPU, read by the host: cached
};

/// A VkBuffer and its memory. Without `allocation` it is the caller's.
struct RawBuffer {
    VkBuffer handle = VK_NULL_HANDLE;
    VmaAllocation allocation = nullptr;
    void* mapped = nullptr;
    uint64_t memory = 0;
};

struct RawImage {
    VkImage handle = VK_NULL_HANDLE;
    VmaAllocation allocation = nullptr;
    uint64_t memory = 0;
};

/// Memory of a device, by the Vulkan Memory Allocator. Safe to call from several threads.
class Memory {
public:
    Memory() = default;
    ~Memory();
    Memory(const Memory&) = delete;
    Memory& operator=(const Memory&) = delete;

    Status create(const Instance& instance, VkPhysicalDevice adapter, VkDevice device, bool addresses);

    /// The address is a multiple of `alignment`. Errors: "device.out_of_memory", "vulkan.result".
    Expected<RawBuffer> createBuffer(const VkBufferCreateInfo& info, MemoryKind kind, VkDeviceSize alignment = 1);
    Expected<RawImage> createImage(const VkImageCreateInfo& info);
    void destroy(RawBuffer& buffer);
    void destroy(RawImage& image);

    std::atomic<uint64_t> bytes = 0;  ///< of live buffers and images; the allocator keeps some more for the next ones
    std::atomic<uint64_t> allocations = 0;  ///< of VkDeviceMemory
    std::atomic<uint64_t> objects_created = 0;

private:
    VmaAllocator allocator_ = nullptr;
    /// Device memory is the CPU's own, cached and coherent: lavapipe and some integrated GPUs. Elsewhere the CPU reads
    /// mapped device memory uncached over the bus, slower than a copy to Readback memory.
    bool is_host_memory_ = false;
};

}  // namespace glint::vulkan
