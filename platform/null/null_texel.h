#pragma once

#include <glint/format/format.h>

#include <cstddef>
#include <cstdint>

namespace glint::null {

/// A colour to clear with: floats for Float and Depth formats (depth in f[0], stencil in u[1]), else integers.
union ClearValue {
    float f[4];
    uint32_t u[4];
};

/// Writes one texel of an uncompressed format, formatInfo(format).block_size bytes.
void encodeTexel(Format format, const ClearValue& value, std::byte* texel);

}  // namespace glint::null
