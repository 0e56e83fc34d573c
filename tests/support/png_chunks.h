#pragma once

#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace glint::test {

/// Gives every chunk of a PNG file its right checksum again, so that what is changed in a file reaches what lies behind
/// the checksums.
inline void repairChecksums(std::vector<std::byte>& png) {
    const auto* bytes = reinterpret_cast<const Bytef*>(png.data());
    size_t at = 8;
    while (at + 12 <= png.size()) {
        size_t length = 0;
        for (size_t k = 0; k < 4; k++) length = length << 8 | bytes[at + k];
        if (length > png.size() - at - 12) return;
        const auto value = static_cast<uint32_t>(crc32(0, bytes + at + 4, static_cast<uInt>(length + 4)));
        for (size_t k = 0; k < 4; k++) png[at + 8 + length + k] = static_cast<std::byte>(value >> (24 - 8 * k));
        at += 12 + length;
    }
}

}  // namespace glint::test
