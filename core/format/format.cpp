#include <glint/format/format.h>

#include <array>

namespace glint {

namespace {

constexpr FormatInfo color(const char* name, FormatType type, uint8_t components, uint8_t block_size) {
    return {.name = name, .type = type, .components = components, .block_size = block_size};
}

constexpr FormatInfo srgb(const char* name) {
    FormatInfo info = color(name, FormatType::Float, 4, 4);
    info.srgb = true;
    return info;
}

constexpr FormatInfo depth(const char* name, uint8_t block_size, bool stencil) {
    FormatInfo info = color(name, FormatType::Depth, stencil ? 2 : 1, block_size);
    info.depth = true;
    info.stencil = stencil;
    return info;
}

constexpr FormatInfo block(const char* name, uint8_t components, uint8_t block_size, bool srgb = false) {
    FormatInfo info = color(name, FormatType::Float, components, block_size);
    info.block_width = 4;
    info.srgb = srgb;
    info.compressed = true;
    return info;
}

constexpr std::array<FormatInfo, FormatCount> makeTable() {
    using enum FormatType;
    std::array<FormatInfo, FormatCount> table = {};
    table[FormatUnknown] = color("Unknown", None, 0, 0);

    table[FormatRu8n] = color("Ru8n", Float, 1, 1);
    table[FormatRi8n] = color("Ri8n", Float, 1, 1);
    table[FormatRu8] = color("Ru8", Uint, 1, 1);
    table[FormatRi8] = color("Ri8", Int, 1, 1);
    table[FormatRu16n] = color("Ru16n", Float, 1, 2);
    table[FormatRi16n] = color("Ri16n", Float, 1, 2);
    table[FormatRu16] = color("Ru16", Uint, 1, 2);
    table[FormatRi16] = color("Ri16", Int, 1, 2);
    table[FormatRf16] = color("Rf16", Float, 1, 2);
    table[FormatRu32] = color("Ru32", Uint, 1, 4);
    table[FormatRi32] = color("Ri32", Int, 1, 4);
    table[FormatRf32] = color("Rf32", Float, 1, 4);
    table[FormatRu64] = color("Ru64", Uint, 1, 8);

    table[FormatRGu8n] = color("RGu8n", Float, 2, 2);
    table[FormatRGi8n] = color("RGi8n", Float, 2, 2);
    table[FormatRGu8] = color("RGu8", Uint, 2, 2);
    table[FormatRGi8] = color("RGi8", Int, 2, 2);
    table[FormatRGu16n] = color("RGu16n", Float, 2, 4);
    table[FormatRGi16n] = color("RGi16n", Float, 2, 4);
    table[FormatRGu16] = color("RGu16", Uint, 2, 4);
    table[FormatRGi16] = color("RGi16", Int, 2, 4);
    table[FormatRGf16] = color("RGf16", Float, 2, 4);
    table[FormatRGu32] = color("RGu32", Uint, 2, 8);
    table[FormatRGi32] = color("RGi32", Int, 2, 8);
    table[FormatRGf32] = color("RGf32", Float, 2, 8);

    table[FormatRGBu32] = color("RGBu32", Uint, 3, 12);
    table[FormatRGBi32] = color("RGBi32", Int, 3, 12);
    table[FormatRGBf32] = color("RGBf32", Float, 3, 12);

    table[FormatRGBAu8n] = color("RGBAu8n", Float, 4, 4);
    table[FormatRGBAi8n] = color("RGBAi8n", Float, 4, 4);
    table[FormatRGBAu8] = color("RGBAu8", Uint, 4, 4);
    table[FormatRGBAi8] = color("RGBAi8", Int, 4, 4);
    table[FormatRGBAu8ns] = srgb("RGBAu8ns");
    table[FormatBGRAu8n] = color("BGRAu8n", Float, 4, 4);
    table[FormatBGRAu8ns] = srgb("BGRAu8ns");
    table[FormatRGBAu16n] = color("RGBAu16n", Float, 4, 8);
    table[FormatRGBAi16n] = color("RGBAi16n", Float, 4, 8);
    table[FormatRGBAu16] = color("RGBAu16", Uint, 4, 8);
    table[FormatRGBAi16] = color("RGBAi16", Int, 4, 8);
    table[FormatRGBAf16] = color("RGBAf16", Float, 4, 8);
    table[FormatRGBAu32] = color("RGBAu32", Uint, 4, 16);
    table[FormatRGBAi32] = color("RGBAi32", Int, 4, 16);
    table[FormatRGBAf32] = color("RGBAf32", Float, 4, 16);

    table[FormatRGBu10Au2n] = color("RGBu10Au2n", Float, 4, 4);
    table[FormatRGBf11f11f10] = color("RGBf11f11f10", Float, 3, 4);
    table[FormatRGBEu9e5] = color("RGBEu9e5", Float, 3, 4);

    table[FormatDu16n] = depth("Du16n", 2, false);
    table[FormatDf32] = depth("Df32", 4, false);
    table[FormatDu24Su8] = depth("Du24Su8", 4, true);
    table[FormatDf32Su8] = depth("Df32Su8", 8, true);

    table[FormatBC1RGBAu8n] = block("BC1RGBAu8n", 4, 8);
    table[FormatBC1RGBAu8ns] = block("BC1RGBAu8ns", 4, 8, true);
    table[FormatBC3RGBAu8n] = block("BC3RGBAu8n", 4, 16);
    table[FormatBC3RGBAu8ns] = block("BC3RGBAu8ns", 4, 16, true);
    table[FormatBC4Ru8n] = block("BC4Ru8n", 1, 8);
    table[FormatBC5RGu8n] = block("BC5RGu8n", 2, 16);
    table[FormatBC6HRGBf16] = block("BC6HRGBf16", 3, 16);
    table[FormatBC7RGBAu8n] = block("BC7RGBAu8n", 4, 16);
    table[FormatBC7RGBAu8ns] = block("BC7RGBAu8ns", 4, 16, true);
    return table;
}

constexpr std::array<FormatInfo, FormatCount> table = makeTable();

constexpr bool isFilled() {
    for (size_t i = 0; i < table.size(); i++) {
        if (std::string_view(table[i].name).empty()) return false;
        if (i != FormatUnknown && (table[i].block_size == 0 || table[i].components == 0)) return false;
    }
    return true;
}
static_assert(isFilled(), "a format has no entry in the table");

}  // namespace

const FormatInfo& formatInfo(Format format) { return table[format < FormatCount ? format : FormatUnknown]; }

}  // namespace glint
