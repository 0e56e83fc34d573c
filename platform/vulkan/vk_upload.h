#pragma once

#include "platform/vulkan/vk_memory.h"

#include <memory>
#include <span>
#include <vector>

namespace glint::vulkan {

/// A piece of host-visible memory that one submission fills from front to back.
struct Chunk {
    RawBuffer buffer;
    uint64_t size = 0;
    uint64_t used = 0;
};

/// Chunks for inline data, recycled when their submission is done. Called under the submit lock alone.
class Upload {
public:
    struct Region {
        VkBuffer buffer = VK_NULL_HANDLE;
        uint64_t offset = 0;  ///< a multiple of 256, which is the largest alignment Vulkan lets a driver ask for
    };

    Upload(Memory& memory, std::span<const uint32_t> families) : memory_(memory), families_(families) {}
    ~Upload();
    Upload(const Upload&) = delete;
    Upload& operator=(const Upload&) = delete;

    /// Copies `data` into the last of `chunks`, which belong to one submission, or into a further one.
    Expected<Region> write(std::vector<std::unique_ptr<Chunk>>& chunks, std::span<const std::byte> data);
    void recycle(std::vector<std::unique_ptr<Chunk>>& chunks);

private:
    Expected<std::unique_ptr<Chunk>> acquire(uint64_t size);

    Memory& memory_;
    const std::span<const uint32_t> families_;
    std::vector<std::unique_ptr<Chunk>> free_;
    size_t chunk_count_ = 0;  ///< free or in use
};

/// The sharing mode of buffers and images: concurrent if the device's queues are of several families.
template <class Info>
void setSharing(Info& info, std::span<const uint32_t> families) {
    info.sharingMode = families.size() > 1 ? VK_SHARING_MODE_CONCURRENT : VK_SHARING_MODE_EXCLUSIVE;
    info.queueFamilyIndexCount = families.size() > 1 ? static_cast<uint32_t>(families.size()) : 0;
    info.pQueueFamilyIndices = families.data();
}

}  // namespace glint::vulkan
