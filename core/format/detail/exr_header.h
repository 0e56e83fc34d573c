#pragma once

#include <glint/base/expected.h>
#include <glint/format/format.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace glint {

/// What an EXR file says about its image before the texels, judged before OpenEXR sees it: the library allocates what a
/// header asks for, whatever the size of the file, and makes texels of memory that it never wrote if a block is too
/// short.
struct ExrHeader {
    /// Beyond it OpenEXR's coordinates could overflow.
    static constexpr uint32_t max_side = 0x3fffffff;

    Format format = FormatUnknown;      ///< of the image to be made: one, two or four channels of 16 or 32 float bits
    std::vector<std::string> channels;  ///< the file's names for the image's channels; some may be absent from the file
    uint32_t width = 0;
    uint32_t height = 0;
    bool is_tiled = false;

    /// The header for OpenEXR, as long as the file's own. Attributes that do not bear on the texels are given a type
    /// that is not known, so that the library takes them for plain bytes.
    std::vector<std::byte> bytes;
};

/// Errors: "image.exr_malformed", with the byte; "image.exr_unsupported" (several parts, deep data, subsampled or
/// integer channels, luminance with chroma, channels of which no picture can be made); "image.too_large" (the image
/// exceeds `limit` bytes, or a strip or tile with all of the file's channels exceeds it by more than 16 MiB).
Expected<ExrHeader> parseExrHeader(std::span<const std::byte> file, uint64_t limit);

}  // namespace glint
