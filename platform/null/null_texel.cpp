#include <platform/null/null_texel.h>

#include <glm/gtc/packing.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace glint::null {

namespace {

uint64_t unorm(float value, uint32_t bits) {
    const auto largest = static_cast<double>((1ull << bits) - 1);
    return static_cast<uint64_t>(std::llround(std::clamp<double>(value, 0.0, 1.0) * largest));
}

uint64_t snorm(float value, uint32_t bits) {
    const auto largest = static_cast<double>((1ull << (bits - 1)) - 1);
    return static_cast<uint64_t>(std::llround(std::clamp<double>(value, -1.0, 1.0) * largest));
}

float encodeSrgb(float value) {
    value = std::clamp(value, 0.0f, 1.0f);
    return value <= 0.0031308f ? 12.92f * value : 1.055f * std::pow(value, 1.0f / 2.4f) - 0.055f;
}

void put(std::byte* texel, uint64_t bits, size_t bytes) { std::memcpy(texel, &bits, bytes); }

/// How one channel of a regular colour format is kept: the letters of its name, "i8n" of "RGBAi8n".
enum class Channel { Unsigned, Signed, Normalized, SignedNormalized, Float };

Channel channelOf(const FormatInfo& info) {
    if (info.type == FormatType::Uint) return Channel::Unsigned;
    if (info.type == FormatType::Int) return Channel::Signed;
    const char* end = info.name + std::strlen(info.name);
    const bool normalized = info.srgb || end[-1] == 'n';
    if (!normalized) return Channel::Float;
    return std::strchr(info.name, 'i') ? Channel::SignedNormalized : Channel::Normalized;
}

}  // namespace

void encodeTexel(Format format, const ClearValue& value, std::byte* texel) {
    const FormatInfo& info = formatInfo(format);
    const float* f = value.f;
    switch (format) {
        case FormatDu16n: return put(texel, unorm(f[0], 16), 2);
        case FormatDf32: return put(texel, glm::floatBitsToUint(f[0]), 4);
        case FormatDu24Su8: return put(texel, unorm(f[0], 24) | static_cast<uint64_t>(value.u[1] & 0xff) << 24, 4);
        case FormatDf32Su8:
            return put(texel, glm::floatBitsToUint(f[0]) | static_cast<uint64_t>(value.u[1] & 0xff) << 32, 8);
        case FormatRGBu10Au2n:
            return put(texel, unorm(f[0], 10) | unorm(f[1], 10) << 10 | unorm(f[2], 10) << 20 | unorm(f[3], 2) << 30,
                       4);
        case FormatRGBf11f11f10: return put(texel, glm::packF2x11_1x10({f[0], f[1], f[2]}), 4);
        case FormatRGBEu9e5: return put(texel, glm::packF3x9_E1x5({f[0], f[1], f[2]}), 4);
        default: break;
    }
    if (info.components == 0) return;
    const size_t bytes = info.block_size / info.components;
    const auto bits = static_cast<uint32_t>(bytes * 8);
    const bool swapped = format == FormatBGRAu8n || format == FormatBGRAu8ns;
    for (size_t i = 0; i < info.components; i++) {
        const size_t source = swapped && i < 3 ? 2 - i : i;
        const float color = info.srgb && source < 3 ? encodeSrgb(f[source]) : f[source];
        uint64_t channel = value.u[source];
        switch (channelOf(info)) {
            case Channel::Unsigned:
            case Channel::Signed: break;
            case Channel::Normalized: channel = unorm(color, bits); break;
            case Channel::SignedNormalized: channel = snorm(color, bits); break;
            case Channel::Float: channel = bits == 16 ? glm::packHalf1x16(color) : glm::floatBitsToUint(color); break;
        }
        put(texel + i * bytes, channel, bytes);
    }
}

}  // namespace glint::null
