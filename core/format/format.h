#pragma once

#include <cstdint>
#include <string_view>

namespace glint {

/// Formats of texels, vertex attributes and indices. Letters: channels, type (u unsigned, i signed, f float), bits of
/// one channel, n normalised, s sRGB.
// clang-format off
enum Format : uint8_t {
    FormatUnknown,
    FormatRu8n, FormatRi8n, FormatRu8, FormatRi8, FormatRu16n, FormatRi16n, FormatRu16, FormatRi16, FormatRf16,
    FormatRu32, FormatRi32, FormatRf32, FormatRu64,
    FormatRGu8n, FormatRGi8n, FormatRGu8, FormatRGi8, FormatRGu16n, FormatRGi16n, FormatRGu16, FormatRGi16, FormatRGf16,
    FormatRGu32, FormatRGi32, FormatRGf32,
    FormatRGBu32, FormatRGBi32, FormatRGBf32,
    FormatRGBAu8n, FormatRGBAi8n, FormatRGBAu8, FormatRGBAi8, FormatRGBAu8ns, FormatBGRAu8n, FormatBGRAu8ns,
    FormatRGBAu16n, FormatRGBAi16n, FormatRGBAu16, FormatRGBAi16, FormatRGBAf16,
    FormatRGBAu32, FormatRGBAi32, FormatRGBAf32,
    FormatRGBu10Au2n, FormatRGBf11f11f10, FormatRGBEu9e5,
    FormatDu16n, FormatDf32, FormatDu24Su8, FormatDf32Su8,
    FormatBC1RGBAu8n, FormatBC1RGBAu8ns, FormatBC3RGBAu8n, FormatBC3RGBAu8ns, FormatBC4Ru8n, FormatBC5RGu8n,
    FormatBC6HRGBf16, FormatBC7RGBAu8n, FormatBC7RGBAu8ns,
    FormatCount,
};
// clang-format on

/// What a shader sees in a texel of a format.
enum class FormatType : uint8_t { None, Float, Int, Uint, Depth };

/// What there is to know about a format.
struct FormatInfo {
    const char* name = "";  ///< "RGBAu8n"
    FormatType type = FormatType::None;
    uint8_t components = 0;
    uint8_t block_size = 0;   ///< bytes of one texel, or of one block of a compressed format
    uint8_t block_width = 1;  ///< texels along each side of a block
    bool srgb = false;
    bool depth = false;
    bool stencil = false;
    bool compressed = false;
};

/// For a number that is no format what FormatUnknown has.
const FormatInfo& formatInfo(Format format);
inline const char* toString(Format format) { return formatInfo(format).name; }

}  // namespace glint
