// What createMipmaps makes, against float64: each level from the one below it, as that is stored, and all of them from
// level 0.

#include "conformance/conformance.h"
#include "support/reference.h"

#include <cmath>
#include <cstdio>
#include <cstring>

namespace glint::test {

namespace {

double decodeSrgb(double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }
double encodeSrgb(double v) { return v <= 0.0031308 ? v * 12.92 : 1.055 * std::pow(v, 1 / 2.4) - 0.055; }

double halfValue(uint16_t bits) {
    const int exponent = bits >> 10 & 31, mantissa = bits & 1023;
    const double value = exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
    return bits & 0x8000 ? -value : value;
}

/// How a format keeps its four channels.
struct Kind {
    Format format;
    bool is_srgb;
    uint32_t channel_bytes;
    double unit;  ///< of the last place of values up to 1, as stored
};

/// One level, as stored: sRGB values are encoded ones.
struct Level {
    uint32_t width = 0, height = 0;
    std::vector<double> values;  ///< four channels
    double at(uint32_t x, uint32_t y, size_t channel) const { return values[(y * width + x) * 4 + channel]; }
};

class MipmapTest : public ConformanceTest {
protected:
    Level readLevel(const Texture& texture, const Kind& kind, uint16_t mip) {
        Level level = {std::max(texture.getWidth() >> mip, 1u), std::max(texture.getHeight() >> mip, 1u), {}};
        const std::vector<uint8_t> bytes = readTexture<uint8_t>(texture, {.mip = mip, .mips = 1});
        for (size_t i = 0; i < bytes.size(); i += kind.channel_bytes) {
            if (kind.channel_bytes == 1) level.values.push_back(bytes[i] / 255.0);
            uint16_t bits = 0;
            float value = 0;
            if (kind.channel_bytes == 2) std::memcpy(&bits, &bytes[i], 2), level.values.push_back(halfValue(bits));
            if (kind.channel_bytes == 4) std::memcpy(&value, &bytes[i], 4), level.values.push_back(value);
        }
        return level;
    }

    static double linear(const Kind& kind, double stored, size_t channel) {
        return kind.is_srgb && channel < 3 ? decodeSrgb(stored) : stored;
    }
    static double stored(const Kind& kind, double value, size_t channel) {
        return kind.is_srgb && channel < 3 ? encodeSrgb(value) : value;
    }

    /// The texel of the next level, by a linear filter at its centre, in linear values. Even sizes: the mean of four.
    static double filtered(const Kind& kind, const Level& below, uint32_t width, uint32_t height, uint32_t x,
                           uint32_t y, size_t channel) {
        const auto place = [](uint32_t i, uint32_t size, uint32_t size_below, uint32_t(&texel)[2], double& weight) {
            const double centre = (i + 0.5) * size_below / size - 0.5;
            const double first = std::floor(centre);
            weight = centre - first;
            for (int k = 0; k < 2; k++)
                texel[k] = static_cast<uint32_t>(std::clamp(first + k, 0.0, static_cast<double>(size_below - 1)));
        };
        uint32_t columns[2], rows[2];
        double u = 0, v = 0;
        place(x, width, below.width, columns, u);
        place(y, height, below.height, rows, v);
        const auto value = [&](uint32_t column, uint32_t row) {
            return linear(kind, below.at(column, row, channel), channel);
        };
        return (value(columns[0], rows[0]) * (1 - u) + value(columns[1], rows[0]) * u) * (1 - v) +
               (value(columns[0], rows[1]) * (1 - u) + value(columns[1], rows[1]) * u) * v;
    }

    Texture makeChain(const Kind& kind, uint32_t width, uint32_t height, uint64_t seed) {
        const Texture texture = device.createTexture2D(kind.format, width, height, Texture::FlagMipmaps, "chain");
        EXPECT_TRUE(texture) << texture.error().text();
        Random random(seed);
        std::vector<uint8_t> bytes(texture.getDataSize());
        for (size_t i = 0; i < bytes.size(); i += kind.channel_bytes) {
            const auto value = static_cast<float>(random.below(1u << 24)) * 0x1p-24f;
            // A half of 0.5 to 1, whose last place is the largest.
            const auto bits = static_cast<uint16_t>(0x3800 + random.below(1024));
            if (kind.channel_bytes == 1) bytes[i] = static_cast<uint8_t>(random.below(256));
            if (kind.channel_bytes == 2) std::memcpy(&bytes[i], &bits, 2);
            if (kind.channel_bytes == 4) std::memcpy(&bytes[i], &value, 4);
        }
        device.setTexture(texture, bytes.data(), bytes.size());
        device.createMipmaps(texture);
        return texture;
    }
};

constexpr Kind kinds[] = {{FormatRGBAu8n, false, 1, 1 / 255.0},
                          {FormatRGBAu8ns, true, 1, 1 / 255.0},
                          {FormatRGBAf16, false, 2, 0x1p-11},
                          {FormatRGBAf32, false, 4, 0x1p-24}};

}  // namespace

// Vulkan does not say how exactly a blit filters. Exact sums and rounding to nearest would be half a unit off. What is
// allowed here: a device may keep no more bits than the format has between the two axes of its filter (lavapipe filters
// 8 bits in 8 bits), whose roundings are half a unit each, and may cut off float16 where others round: one unit. sRGB
// is filtered in linear values, and its encoding may be 0.1 unit off besides rounding (Khronos Data Format
// Specification 1.3, section 13.3.2): within that unit. Float32: two roundings of a sum, two units.
constexpr double level_error(const Kind& kind) { return kind.channel_bytes == 4 ? 2.0 : 1.001; }

TEST_F(MipmapTest, EachLevelIsTheMeanOfTheOneBelow) {
    for (const Kind& kind : kinds) {
        if (!device.hasTexture(kind.format, Texture::FlagMipmaps)) continue;
        const Texture texture = makeChain(kind, 64, 32, 5);
        double largest = 0;
        for (uint16_t mip = 1; mip < texture.getMipmaps(); mip++) {
            const Level below = readLevel(texture, kind, static_cast<uint16_t>(mip - 1)),
                        level = readLevel(texture, kind, mip);
            for (uint32_t y = 0; y < level.height; y++)
                for (uint32_t x = 0; x < level.width; x++)
                    for (size_t channel = 0; channel < 4; channel++) {
                        const double expected =
                            stored(kind, filtered(kind, below, level.width, level.height, x, y, channel), channel);
                        largest = std::max(largest, std::abs(level.at(x, y, channel) - expected) / kind.unit);
                    }
        }
        std::printf("%s: %.3f units\n", toString(kind.format), largest);
        EXPECT_LE(largest, level_error(kind)) << toString(kind.format);
    }
}

TEST_F(MipmapTest, ErrorsOfAllLevelsAddUp) {
    for (const Kind& kind : kinds) {
        if (!device.hasTexture(kind.format, Texture::FlagMipmaps)) continue;
        const Texture texture = makeChain(kind, 64, 64, 9);
        const Level base = readLevel(texture, kind, 0);
        for (uint16_t mip = 1; mip < texture.getMipmaps(); mip++) {
            const Level level = readLevel(texture, kind, mip);
            const uint32_t side = 1u << mip;
            double largest = 0;
            for (uint32_t y = 0; y < level.height; y++)
                for (uint32_t x = 0; x < level.width; x++)
                    for (size_t channel = 0; channel < 4; channel++) {
                        double sum = 0;
                        for (uint32_t j = 0; j < side; j++)
                            for (uint32_t i = 0; i < side; i++)
                                sum += linear(kind, base.at(x * side + i, y * side + j, channel), channel);
                        const double expected = stored(kind, sum / (side * side), channel);
                        largest = std::max(largest, std::abs(level.at(x, y, channel) - expected) / kind.unit);
                    }
            std::printf("%s, level %u: %.3f units\n", toString(kind.format), mip, largest);
            // A mean keeps at most the largest error of what it is of, and each level adds its own. In sRGB's stored
            // units a linear error is larger where the curve is steeper, but the means of random texels are near the
            // middle.
            EXPECT_LE(largest, level_error(kind) * mip) << toString(kind.format) << ", level " << mip;
        }
    }
}

// Odd sizes: one linear sample at the centre of each texel, as a blit takes it. Its weights have as many bits as the
// device's filter, 4 at least (limits.subTexelPrecisionBits), 8 on nearly all: an error of 2^-9 of the largest
// difference of two texels, which is 1, for each axis.
TEST_F(MipmapTest, OddSizesAreSampledAtTheirCentres) {
    for (const Kind& kind : kinds) {
        if (!device.hasTexture(kind.format, Texture::FlagMipmaps)) continue;
        double largest = 0;
        for (const auto& [width, height] : {std::pair(5u, 7u), {3u, 1u}, {13u, 64u}, {31u, 33u}}) {
            const Texture texture = makeChain(kind, width, height, width);
            for (uint16_t mip = 1; mip < texture.getMipmaps(); mip++) {
                const Level below = readLevel(texture, kind, static_cast<uint16_t>(mip - 1));
                const Level level = readLevel(texture, kind, mip);
                for (uint32_t y = 0; y < level.height; y++)
                    for (uint32_t x = 0; x < level.width; x++)
                        for (size_t channel = 0; channel < 4; channel++) {
                            const double expected = filtered(kind, below, level.width, level.height, x, y, channel);
                            const double value = linear(kind, level.at(x, y, channel), channel);
                            largest = std::max(largest, std::abs(value - expected));
                        }
            }
        }
        std::printf("%s: %.5f of 1\n", toString(kind.format), largest);
        // As stored; of sRGB near 1, a unit is 2.28 times as large in linear values.
        const double rounding = level_error(kind) * kind.unit * (kind.is_srgb ? 2.28 : 1.0);
        EXPECT_LE(largest, 2 * 0x1p-9 + rounding) << toString(kind.format);
    }
}

}  // namespace glint::test
