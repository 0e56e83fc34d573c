#pragma once

// Sizes and ranges of textures, in one place.

#include <glint/device/texture.h>
#include <glint/device/types.h>

#include <algorithm>
#include <bit>
#include <cstdint>

namespace glint::detail {

inline uint32_t mipSize(uint32_t size, uint32_t mip) { return std::max(size >> mip, 1u); }

/// All texels of a mip level.
inline Region mipRegion(const TextureDesc& desc, uint32_t mip) {
    return {0, 0, 0, mipSize(desc.width, mip), mipSize(desc.height, mip), mipSize(desc.depth, mip)};
}

/// One channel of a clear colour as a format of this type holds it: integers are cut off towards zero and kept within
/// 32 bits, NaN is 0.
inline uint32_t clearBits(FormatType type, float value) {
    if (type == FormatType::Uint) {
        if (!(value > 0.0f)) return 0;
        return value < 0x1p32f ? static_cast<uint32_t>(value) : UINT32_MAX;
    }
    if (type != FormatType::Int) return std::bit_cast<uint32_t>(value);
    if (!(value > -0x1p31f)) return value == value ? 0x80000000u : 0u;
    return value < 0x1p31f ? static_cast<uint32_t>(static_cast<int32_t>(value)) : 0x7fffffffu;
}

/// Bytes of tightly packed texels of a resolved region; partial blocks of compressed formats count whole.
inline uint64_t dataSize(Format format, const Region& region) {
    const FormatInfo& info = formatInfo(format);
    const uint64_t columns = (region.width + info.block_width - 1u) / info.block_width;
    const uint64_t rows = (region.height + info.block_width - 1u) / info.block_width;
    return columns * rows * region.depth * info.block_size;
}

/// Puts numbers in place of "all that are left". False if the slice does not lie in the texture.
inline bool resolveSlice(const TextureDesc& desc, Slice& slice) {
    if (slice.mip >= desc.mipmaps || slice.layer >= desc.layers) return false;
    if (slice.mips == 0) slice.mips = static_cast<uint16_t>(desc.mipmaps - slice.mip);
    if (slice.layers == 0) slice.layers = static_cast<uint16_t>(desc.layers - slice.layer);
    return slice.mip + slice.mips <= static_cast<int>(desc.mipmaps) &&
           slice.layer + slice.layers <= static_cast<int>(desc.layers);
}

/// The same for a region of a mip level. Compressed formats need whole blocks, except at the far edges.
inline bool resolveRegion(const TextureDesc& desc, uint32_t mip, Region& region) {
    const Region all = mipRegion(desc, mip);
    if (region.x >= all.width || region.y >= all.height || region.z >= all.depth) return false;
    if (region.width == 0) region.width = all.width - region.x;
    if (region.height == 0) region.height = all.height - region.y;
    if (region.depth == 0) region.depth = all.depth - region.z;
    if (region.width > all.width - region.x || region.height > all.height - region.y ||
        region.depth > all.depth - region.z)
        return false;
    const uint32_t block = formatInfo(desc.format).block_width;
    const auto whole = [&](uint32_t offset, uint32_t size, uint32_t end) {
        return offset % block == 0 && (size % block == 0 || offset + size == end);
    };
    return whole(region.x, region.width, all.width) && whole(region.y, region.height, all.height);
}

}  // namespace glint::detail
