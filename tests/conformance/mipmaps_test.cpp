// What createMipmaps makes, against float64: every level as the mean of what its texels cover of the level below,
// without rounding on the way from level 0.

#include "conformance/conformance.h"
#include "support/reference.h"

#include <cmath>
#include <cstdio>
#include <cstring>

namespace glint::test {

namespace {

double decodeSrgb(double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }
double encodeSrgb(double v) { return v <= 0.0031308 ? v * 12.92 : 1.055 * std::pow(v, 1 / 2.4) - 0.055; }

/// Of 5 bits of exponent, without a sign.
double smallFloat(uint32_t bits, int mantissa) {
    const int exponent = static_cast<int>(bits >> mantissa);
    const auto low = static_cast<double>(bits & ((1u << mantissa) - 1));
    return exponent == 0 ? std::ldexp(low, -14 - mantissa)
                         : std::ldexp(low + std::ldexp(1.0, mantissa), exponent - 15 - mantissa);
}

/// The distance from one float of so many bits of mantissa to the next.
double lastPlace(double value, int mantissa) { return std::ldexp(1.0, std::max(std::ilogb(value), -14) - mantissa); }

/// How a format keeps its channels.
struct Kind {
    enum class Type { Unorm, Snorm, Srgb, Half, Float, Rgb10A2, Rg11B10, Rgb9E5 };
    Format format;
    Type type;
    uint32_t channels;
    uint32_t bits;  ///< of a channel; of packed formats the whole
};

using Type = Kind::Type;
constexpr Kind kinds[] = {
    {FormatRu8n, Type::Unorm, 1, 8},          {FormatRGu8n, Type::Unorm, 2, 8},
    {FormatRGBAu8n, Type::Unorm, 4, 8},       {FormatRi8n, Type::Snorm, 1, 8},
    {FormatRGBAu8ns, Type::Srgb, 4, 8},       {FormatBGRAu8ns, Type::Srgb, 4, 8},
    {FormatRu16n, Type::Unorm, 1, 16},        {FormatRGBAu16n, Type::Unorm, 4, 16},
    {FormatRGi16n, Type::Snorm, 2, 16},       {FormatRGBAf16, Type::Half, 4, 16},
    {FormatRf32, Type::Float, 1, 32},         {FormatRGBAf32, Type::Float, 4, 32},
    {FormatRGBu10Au2n, Type::Rgb10A2, 4, 32}, {FormatRGBf11f11f10, Type::Rg11B10, 3, 32},
    {FormatRGBEu9e5, Type::Rgb9E5, 3, 32},
};

const Kind& kind(Format format) {
    return *std::find_if(std::begin(kinds), std::end(kinds), [&](const Kind& each) { return each.format == format; });
}

bool isPacked(Type type) { return type >= Type::Rgb10A2; }
bool isEncoded(const Kind& kind, size_t channel) { return kind.type == Type::Srgb && channel < 3; }

/// The bits of a random channel: floats are of 1/8 to 1, so that no sum loses what counts.
uint32_t randomBits(const Kind& kind, Random& random) {
    switch (kind.type) {
        case Type::Half: return static_cast<uint32_t>(0x3000 + random.below(0xc00));
        case Type::Float: return static_cast<uint32_t>(0x3e000000 + random.below(0x1800000));
        case Type::Rg11B10: {
            const auto channel = [&](uint32_t mantissa) {
                return static_cast<uint32_t>((12u << mantissa) + random.below(3ull << mantissa));
            };
            return channel(6) | channel(6) << 11 | channel(5) << 22;
        }
        case Type::Rgb9E5: return static_cast<uint32_t>(random.below(1u << 27) | (12 + random.below(4)) << 27);
        default: return static_cast<uint32_t>(random.below(1ull << kind.bits));
    }
}

/// The channels of a texel, as stored: sRGB values are encoded ones.
std::array<double, 4> decode(const Kind& kind, const uint8_t* bytes) {
    std::array<double, 4> value = {};
    uint32_t word = 0;
    if (isPacked(kind.type)) std::memcpy(&word, bytes, 4);
    switch (kind.type) {
        case Type::Rgb10A2:
            return {(word & 1023) / 1023.0, (word >> 10 & 1023) / 1023.0, (word >> 20 & 1023) / 1023.0,
                    (word >> 30) / 3.0};
        case Type::Rg11B10:
            return {smallFloat(word & 2047, 6), smallFloat(word >> 11 & 2047, 6), smallFloat(word >> 22, 5), 0};
        case Type::Rgb9E5:
            for (int i = 0; i < 3; i++)
                value[static_cast<size_t>(i)] =
                    std::ldexp(word >> (9 * i) & 511, static_cast<int>(word >> 27) - 15 - 9);
            return value;
        default: break;
    }
    for (size_t channel = 0; channel < kind.channels; channel++) {
        uint32_t bits = 0;
        std::memcpy(&bits, bytes + channel * kind.bits / 8, kind.bits / 8);
        const auto negative = static_cast<int32_t>(bits << (32 - kind.bits)) >> (32 - kind.bits);
        double& v = value[channel];
        switch (kind.type) {
            case Type::Snorm:
                v = std::max(-1.0, negative / (std::ldexp(1.0, static_cast<int>(kind.bits) - 1) - 1));
                break;
            case Type::Half: v = smallFloat(bits & 0x7fff, 10) * (bits & 0x8000 ? -1 : 1); break;
            case Type::Float: v = std::bit_cast<float>(bits); break;
            default: v = bits / (std::ldexp(1.0, static_cast<int>(kind.bits)) - 1); break;
        }
    }
    // What comes first in memory is blue.
    if (kind.format == FormatBGRAu8n || kind.format == FormatBGRAu8ns) std::swap(value[0], value[2]);
    return value;
}

/// The last place of a channel of this texel, as stored.
double unitOf(const Kind& kind, const std::array<double, 4>& texel, size_t channel) {
    switch (kind.type) {
        case Type::Snorm: return 1 / (std::ldexp(1.0, static_cast<int>(kind.bits) - 1) - 1);
        case Type::Half: return lastPlace(texel[channel], 10);
        case Type::Float: return 0x1p-24;  // of values from a half to 1
        case Type::Rgb10A2: return channel < 3 ? 1 / 1023.0 : 1 / 3.0;
        case Type::Rg11B10: return lastPlace(texel[channel], channel < 2 ? 6 : 5);
        case Type::Rgb9E5: {
            const double most = *std::max_element(texel.begin(), texel.begin() + 3);
            const double unit = std::ldexp(1.0, std::ilogb(most) - 8);
            return most > 511.5 * unit ? 2 * unit : unit;
        }
        default: return 1 / (std::ldexp(1.0, static_cast<int>(kind.bits)) - 1);
    }
}

/// One level in linear values; z are layers, but for volumes.
struct Level {
    std::array<uint32_t, 3> size = {};
    std::vector<std::array<double, 4>> texels;
};

/// Half as long along an axis.
Level halved(const Level& from, size_t axis) {
    Level to = {from.size, {}};
    const uint32_t below = from.size[axis];
    if (below == 1) return from;
    to.size[axis] = below / 2;
    to.texels.resize(size_t(to.size[0]) * to.size[1] * to.size[2]);
    size_t step = 1;
    for (size_t a = 0; a < axis; a++) step *= from.size[a];
    const uint32_t n = to.size[axis];
    for (size_t t = 0; t < to.texels.size(); t++) {
        const auto i = static_cast<uint32_t>(t / step % n);
        const size_t first = t % step + (t / step / n * below + 2 * i) * step;
        // Texel i of n covers (2n + 1) / n texels of an odd size, from i (2n + 1) / n on.
        const double weights[3] = {below % 2 ? double(n - i) / below : 0.5, below % 2 ? double(n) / below : 0.5,
                                   below % 2 ? double(i + 1) / below : 0.0};
        for (uint32_t k = 0; k < 2 + below % 2; k++)
            for (size_t channel = 0; channel < 4; channel++)
                to.texels[t][channel] += weights[k] * from.texels[first + k * step][channel];
    }
    return to;
}

// What float32 adds to the rounding of what is stored, for each level, relative to the largest value; Vulkan divides to
// 2.5 units of the last place, which is 5 x 2^-24. Even sizes: weights are powers of two, and 2 sums one into the other
// (in volumes 3) are off by 2^-25 each. Odd sizes: for each axis a division and a product, and of 9 (27) terms 8 (26)
// sums.
double floatError(bool is_even, bool is_volume) {
    if (is_even) return (is_volume ? 1.5 : 1.0) * 0x1p-24;
    return (is_volume ? 3 * 6 + 26 : 2 * 6 + 8) * 0x1p-24;
}

class MipmapTest : public ConformanceTest {
protected:
    Level readLevel(const Texture& texture, const Kind& kind, uint16_t mip) {
        const bool is_volume = texture.getType() == Texture::Type3D;
        const uint32_t depth = is_volume ? std::max(texture.getDepth() >> mip, 1u) : texture.getLayers();
        Level level = {{std::max(texture.getWidth() >> mip, 1u), std::max(texture.getHeight() >> mip, 1u), depth}, {}};
        const size_t step = isPacked(kind.type) ? 4 : kind.channels * kind.bits / 8;
        for (uint16_t layer = 0; layer < texture.getLayers(); layer++) {
            const std::vector<uint8_t> bytes = readTexture<uint8_t>(texture, {mip, 1, layer, 1});
            for (size_t i = 0; i < bytes.size(); i += step) level.texels.push_back(decode(kind, &bytes[i]));
        }
        return level;
    }

    Texture makeChain(const Kind& kind, TextureDesc desc) {
        desc.format = kind.format;
        desc.flags = Texture::FlagMipmaps;
        const Texture texture = device.createTexture(desc, "chain");
        EXPECT_TRUE(texture) << texture.error().text();
        Random random(desc.width * 100 + desc.height);
        std::vector<uint8_t> bytes(texture.getDataSize() * texture.getLayers());
        for (size_t i = 0; i < bytes.size(); i += kind.bits / 8) {
            const uint32_t bits = randomBits(kind, random);
            std::memcpy(&bytes[i], &bits, kind.bits / 8);
        }
        device.setTexture(texture, bytes.data(), bytes.size(), {0, 1, 0, static_cast<uint16_t>(texture.getLayers())});
        device.createMipmaps(texture);
        return texture;
    }

    /// Compares all levels. Returns the largest error in units of the last place.
    double compare(const Texture& texture, const Kind& kind, double per_level) {
        Level reference = readLevel(texture, kind, 0);
        for (auto& texel : reference.texels)
            for (size_t channel = 0; channel < 4; channel++)
                if (isEncoded(kind, channel)) texel[channel] = decodeSrgb(texel[channel]);
        double largest = 0;
        for (uint16_t mip = 1; mip < texture.getMipmaps(); mip++) {
            reference = halved(halved(reference, 0), 1);
            if (texture.getType() == Texture::Type3D) reference = halved(reference, 2);
            const Level level = readLevel(texture, kind, mip);
            EXPECT_EQ(level.size, reference.size);
            EXPECT_EQ(level.texels.size(), reference.texels.size());
            double worst = 0, allowed = 0;
            for (size_t i = 0; i < level.texels.size(); i++) {
                std::array<double, 4> expected = reference.texels[i];
                for (size_t channel = 0; channel < 4; channel++)
                    if (isEncoded(kind, channel)) expected[channel] = encodeSrgb(expected[channel]);
                for (size_t channel = 0; channel < kind.channels; channel++) {
                    const double unit = unitOf(kind, expected, channel);
                    const double error = std::abs(level.texels[i][channel] - expected[channel]) / unit;
                    // float32 is stored as it is; the others are rounded once at the end.
                    double limit = per_level * mip / unit + (kind.type == Type::Float ? 0.0 : 0.5);
                    // Where the curve is steepest, a float counts 12.92 times; besides, Vulkan's pow(x, y) is good to
                    // 3 + 2 |y log2 x| units of float32 and |y| units of a logarithm of 2^-21: less than 2^-17 both
                    // ways.
                    if (isEncoded(kind, channel)) limit += 0x1p-17 * 255 + 12 * per_level * mip / unit;
                    worst = std::max(worst, error);
                    if (error > limit) allowed = std::max(allowed, limit);
                }
            }
            EXPECT_EQ(allowed, 0) << "level " << mip << ": " << worst << " units";
            largest = std::max(largest, worst);
        }
        return largest;
    }
};

}  // namespace

TEST_F(MipmapTest, EverySizeThatHalves) {
    for (const Kind& kind : kinds) {
        SCOPED_TRACE(toString(kind.format));
        if (!device.hasTexture(kind.format, Texture::FlagMipmaps)) continue;
        const double largest = compare(makeChain(kind, {.width = 64, .height = 32}), kind, floatError(true, false));
        std::printf("%s: %.4f units\n", toString(kind.format), largest);
    }
}

TEST_F(MipmapTest, OddSizesCoverAllTexels) {
    for (const Format format : {FormatRu8n, FormatRGBAu8n, FormatRGBAu8ns, FormatRGBAu16n, FormatRGBAf32}) {
        SCOPED_TRACE(toString(format));
        if (!device.hasTexture(format, Texture::FlagMipmaps)) continue;
        const Kind& kind = test::kind(format);
        double largest = 0;
        for (const auto& [width, height] : {std::pair(5u, 7u), {3u, 1u}, {13u, 64u}, {31u, 33u}, {1u, 101u}})
            largest = std::max(
                largest, compare(makeChain(kind, {.width = width, .height = height}), kind, floatError(false, false)));
        std::printf("%s: %.4f units\n", toString(kind.format), largest);
    }
}

TEST_F(MipmapTest, LayersFacesAndVolumes) {
    for (const Format format : {FormatRu8n, FormatRGBAu8n, FormatRGBAf32}) {
        SCOPED_TRACE(toString(format));
        const Kind& kind = test::kind(format);
        for (const TextureDesc& desc : {TextureDesc{.width = 9, .height = 4, .layers = 3},
                                        TextureDesc{.type = Texture::TypeCube, .width = 8, .height = 8},
                                        TextureDesc{.type = Texture::TypeCube, .width = 7, .height = 7, .layers = 2}})
            compare(makeChain(kind, desc), kind, floatError(false, false));
        for (const uint32_t depth : {1u, 4u, 11u})
            compare(makeChain(kind, {.type = Texture::Type3D, .width = 6, .height = 8, .depth = depth}), kind,
                    floatError(false, true));
    }
}

TEST_F(MipmapTest, LevelsBeyondTheScratchMemory) {
    // 64 MiB hold 2.5 million texels of 20 bytes with all that follow them. Of one layer that has more, level 1 is made
    // from what is stored, and level 2 from that, which has been rounded; of several, each by itself.
    const Kind& kind = test::kind(FormatRGBAu8n);
    constexpr uint32_t side = 64;
    Random random(1);
    std::vector<uint32_t> tile(side * side);
    for (uint32_t& texel : tile) texel = static_cast<uint32_t>(random.below(1ull << 32));
    struct Case {
        TextureDesc desc;
        double rounded;
    };
    for (const Case& each :
         {Case{{.width = 4096, .height = 2560}, 0.5}, {{.width = 1024, .height = 512, .layers = 24}, 0}}) {
        TextureDesc desc = each.desc;
        desc.format = kind.format;
        desc.flags = Texture::FlagMipmaps;
        const Texture texture = device.createTexture(desc);
        std::vector<uint32_t> texels(size_t(desc.width) * desc.height);
        for (size_t i = 0; i < texels.size(); i++) texels[i] = tile[i / desc.width % side * side + i % side];
        for (uint16_t layer = 0; layer < desc.layers; layer++)
            device.setTexture(texture, texels.data(), texels.size() * 4, {0, 1, layer, 1});
        device.createMipmaps(texture);
        Level reference = {{side, side, 1}, {}};
        for (const uint32_t& texel : tile)
            reference.texels.push_back(decode(kind, reinterpret_cast<const uint8_t*>(&texel)));
        for (uint16_t mip = 1; mip <= 6; mip++) {
            reference = halved(halved(reference, 0), 1);
            const double limit = (0.5 + (mip > 1 ? each.rounded : 0.0)) / 255 + mip * floatError(true, false);
            for (const uint16_t layer : {uint16_t(0), static_cast<uint16_t>(desc.layers - 1)}) {
                const std::vector<uint32_t> level = readTexture<uint32_t>(texture, {mip, 1, layer, 1});
                const uint32_t width = desc.width >> mip, period = side >> mip;
                size_t wrong = 0;
                for (size_t i = 0; i < level.size(); i++) {
                    const auto& expected = reference.texels[i / width % period * period + i % period];
                    for (uint32_t channel = 0; channel < 4; channel++)
                        wrong += std::abs((level[i] >> (8 * channel) & 255) / 255.0 - expected[channel]) > limit;
                }
                EXPECT_EQ(wrong, 0u) << "level " << mip << ", layer " << layer;
            }
        }
    }
}

TEST_F(MipmapTest, ValuesThatAreNoNumbersStayWhatTheyAre) {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    const std::vector<float> values = {1, infinity, -infinity, std::nanf(""), 1, 2, 3, 4, 5, 6};
    const Texture texture = device.createTexture2D(FormatRf32, 5, 2, Texture::FlagMipmaps);
    device.setTexture(texture, values.data(), 40);
    device.createMipmaps(texture);
    const std::vector<float> level = readTexture<float>(texture, {1, 1, 0, 1});
    EXPECT_TRUE(std::isnan(level[0]));  // both infinities
    EXPECT_TRUE(std::isnan(level[1]));
    const std::vector<float> large(16, 3e38f);
    const Texture bright = device.createTexture2D(FormatRf32, 4, 4, Texture::FlagMipmaps);
    device.setTexture(bright, large.data(), 64);
    device.createMipmaps(bright);
    EXPECT_EQ(readTexture<float>(bright, {2, 1, 0, 1}), std::vector<float>(1, 3e38f));
}

TEST_F(MipmapTest, AListDrawsOnWithItsOwnProgram) {
    // The kernel, bindings and push constants of a list are its own again afterwards; it needs no barriers for this.
    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 1) in;
        layout(binding = 0) buffer Result { float result[]; };
        layout(binding = 1) uniform texture2D picture;
        layout(push_constant) uniform Push { uint i; };
        void main() { result[i] = texelFetch(picture, ivec2(0), 2).x; })");
    const Texture texture = device.createTexture2D(FormatRf32, 4, 4, Texture::FlagMipmaps);
    const Buffer result = makeBuffer(std::vector<float>(2));
    for (const Queue queue : {Queue::Main, Queue::Compute}) {
        compute([&](Compute& list) {
            list.setKernel(kernel);
            list.setStorageBuffer(0, result);
            list.setTexture(0, texture);
            for (uint32_t i = 0; i < 2; i++) {
                list.clearTexture(texture, Color{3.0f + static_cast<float>(i), 0, 0, 0}, {0, 1, 0, 1});
                list.setPushConstants(i);
                list.createMipmaps(texture);
                list.dispatch(1);
            }
        });
        EXPECT_EQ(read<float>(result), (std::vector<float>{3, 4})) << static_cast<int>(queue);
    }
}

}  // namespace glint::test
