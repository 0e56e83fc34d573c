#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace glint {

/// A 128-bit content hash (XXH3), stable over runs and machines of one byte order.
struct Hash {
    uint64_t low = 0;
    uint64_t high = 0;
    bool operator==(const Hash&) const = default;
    /// 32 lower-case hexadecimal digits.
    std::string hex() const;
};

/// Hash of `size` bytes; chain by passing the former hash as `seed`.
Hash hashBytes(const void* data, size_t size, const Hash& seed = {});
inline Hash hashText(std::string_view text, const Hash& seed = {}) { return hashBytes(text.data(), text.size(), seed); }

}  // namespace glint
