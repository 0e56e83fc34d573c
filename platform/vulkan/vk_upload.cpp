#include "platform/vulkan/vk_upload.h"

#include <algorithm>
#include <cstring>

namespace glint::vulkan {

namespace {

constexpr uint64_t alignment = 256;
constexpr uint64_t chunk_size = 256ull << 10;
/// Larger chunks are not kept: one big upload should not hold host memory for ever.
constexpr uint64_t largest_kept = 64ull << 20;

}  // namespace

Upload::~Upload() {
    for (std::unique_ptr<Chunk>& chunk : free_) memory_.destroy(chunk->buffer);
}

Expected<std::unique_ptr<Chunk>> Upload::acquire(uint64_t size) {
    // The smallest that fits, so that a small list does not take what a large one needs.
    auto best = free_.end();
    for (auto i = free_.begin(); i != free_.end(); ++i) {
        if ((*i)->size >= size && (best == free_.end() || (*i)->size < (*best)->size)) best = i;
    }
    if (best != free_.end()) {
        std::unique_ptr<Chunk> chunk = std::move(*best);
        *best = std::move(free_.back());
        free_.pop_back();
        return chunk;
    }
    auto chunk = std::make_unique<Chunk>();
    chunk->size = std::max(chunk_size, (size + chunk_size - 1) / chunk_size * chunk_size);
    VkBufferCreateInfo info = {VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
    info.size = chunk->size;
    info.usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT |
                 VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_VERTEX_BUFFER_BIT |
                 VK_BUFFER_USAGE_INDEX_BUFFER_BIT;
    setSharing(info, families_);
    Expected<RawBuffer> buffer = memory_.createBuffer(info, MemoryKind::Upload);
    if (!buffer) return unexpected(buffer.error());
    chunk->buffer = *buffer;
    free_.reserve(++chunk_count_);  // all may be free at once one day; recycling allocates nothing
    return chunk;
}

Expected<Upload::Region> Upload::write(std::vector<std::unique_ptr<Chunk>>& chunks, std::span<const std::byte> data) {
    if (chunks.empty() || chunks.back()->size - chunks.back()->used < data.size()) {
        Expected<std::unique_ptr<Chunk>> chunk = acquire(data.size());
        if (!chunk) return unexpected(chunk.error());
        chunks.push_back(std::move(*chunk));
    }
    Chunk& chunk = *chunks.back();
    const Region region = {chunk.buffer.handle, chunk.used};
    std::memcpy(static_cast<std::byte*>(chunk.buffer.mapped) + chunk.used, data.data(), data.size());
    chunk.used = std::min(chunk.size, (chunk.used + data.size() + alignment - 1) / alignment * alignment);
    return region;
}

void Upload::recycle(std::vector<std::unique_ptr<Chunk>>& chunks) {
    for (std::unique_ptr<Chunk>& chunk : chunks) {
        chunk->used = 0;
        if (chunk->size > largest_kept) {
            memory_.destroy(chunk->buffer);
            chunk_count_--;
        } else {
            free_.push_back(std::move(chunk));
        }
    }
    chunks.clear();
}

}  // namespace glint::vulkan
