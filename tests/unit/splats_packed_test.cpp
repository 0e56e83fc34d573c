// .splat and .spz files: made by hand and read, written and read again, broken.

#include "support/allocations.h"
#include "support/files.h"
#include "support/matchers.h"
#include "support/reference.h"
#include "support/splat_files.h"

#include <glint/base/file.h>
#include <glint/format/splats.h>
#include <glint/math/harmonics.h>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstring>
#include <limits>

using namespace glint;
using namespace glint::test;

namespace {

using Bytes = std::vector<std::byte>;

constexpr double y_0 = 0.28209479177387814;

template <class T>
void append(Bytes& bytes, const T& value) {
    const size_t at = bytes.size();
    bytes.resize(at + sizeof(T));
    std::memcpy(bytes.data() + at, &value, sizeof(T));
}

Bytes gzip(const Bytes& bytes) {
    z_stream stream = {};
    EXPECT_EQ(::deflateInit2(&stream, 6, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
    Bytes packed(::deflateBound(&stream, bytes.size()) + 32);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = static_cast<uInt>(packed.size());
    EXPECT_EQ(::deflate(&stream, Z_FINISH), Z_STREAM_END);
    packed.resize(stream.total_out);
    ::deflateEnd(&stream);
    return packed;
}

/// One splat of an .spz file, as its bytes.
struct SpzSplat {
    uint32_t version = 3;
    uint8_t degree = 0;
    uint8_t fraction_bits = 12;
    uint8_t flags = 0;
    uint32_t count = 1;
    Bytes position = Bytes(9);
    uint8_t opacity = 255;
    std::array<uint8_t, 3> color = {128, 128, 128};
    std::array<uint8_t, 3> scale = {160, 160, 160};
    uint32_t rotation = 3u << 30;              // of version 3
    std::array<uint8_t, 3> rotation_xyz = {};  // of versions 1 and 2
    std::vector<uint8_t> harmonics;

    Bytes unpacked() const {
        Bytes bytes;
        append(bytes, std::array<char, 4>{'N', 'G', 'S', 'P'});
        append(bytes, version);
        append(bytes, count);
        append(bytes, std::array<uint8_t, 4>{degree, fraction_bits, flags, 0});
        bytes.insert(bytes.end(), position.begin(), position.end());
        append(bytes, opacity);
        append(bytes, color);
        append(bytes, scale);
        if (version < 3)
            append(bytes, rotation_xyz);
        else
            append(bytes, rotation);
        for (const uint8_t value : harmonics) append(bytes, value);
        return bytes;
    }
    Expected<Splats> read() const { return parseSpz(gzip(unpacked()), "test.spz"); }
};

Splats parse(const Expected<Splats>& splats) {
    EXPECT_THAT(splats, IsOk());
    if (!splats) return {};
    EXPECT_THAT(splats->validate(), IsOk());
    return *splats;
}

/// In radians, between the turns of two quaternions.
double angleBetween(const Vector4f& a, const Vector4f& b) {
    const Vector4d p(a), q(b);
    const Vector4d other = glm::dot(p, q) < 0.0 ? -q : q;
    return 4.0 * std::asin(0.5 * glm::length(p / glm::length(p) - other / glm::length(other)));
}

Vector3d rotate(const Vector4f& quaternion, const Vector3d& v) {
    const Vector3d axis(quaternion);
    return v + 2.0 * glm::cross(axis, glm::cross(axis, v) + double{quaternion.w} * v);
}

/// The half turn between the axes of .spz files and those of Splats.
Vector3d turn(const Vector3d& v) { return {v.x, -v.y, -v.z}; }

}  // namespace

TEST(DotSplat, ByHand) {
    Bytes file;
    append(file, Vector3f(1, 2, 3));
    append(file, Vector3f(0.5f, 0.25f, 0.0f));
    append(file, std::array<uint8_t, 4>{255, 0, 51, 204});
    append(file, std::array<uint8_t, 4>{128, 128, 0, 128});  // y, turned by half
    const Splats splats = parse(parseDotSplat(file, "a.splat"));
    ASSERT_EQ(splats.size(), 1u);
    EXPECT_EQ(splats.degree, 0u);
    EXPECT_EQ(splats.positions[0], Vector3f(1, 2, 3));
    EXPECT_EQ(splats.scales[0], Vector3f(0.5f, 0.25f, 0.0f));
    EXPECT_EQ(splats.rotations[0], Vector4f(0, -1, 0, 0));
    EXPECT_FLOAT_EQ(splats.opacities[0], 0.8f);
    // 1/2 + h Y_0 is the color; Y_0 and two operations round, each by 2^-24.
    const Vector3d color = Vector3d(splats.harmonics[0]) * y_0 + 0.5;
    EXPECT_NEAR(color.x, 1.0, 0x1p-22);
    EXPECT_NEAR(color.y, 0.0, 0x1p-22);
    EXPECT_NEAR(color.z, 0.2, 0x1p-22);
}

// Positions and scales stay as they are. A byte is right to half a step: of color and opacity 1/510, of a component of
// a quaternion 1/256; but 1 becomes 127/128, which is off by 2/256. So is the quaternion by |(2, 1, 1, 1)| / 256 at
// most, and its turn by about twice as much.
TEST(DotSplat, RoundTrip) {
    const TempDir dir;
    Splats splats = randomSplats(3000, 3, 1);
    splats.rotations[0] = {0, 0, 0, 1};
    splats.rotations[1] = {0, 0, -1, 0};
    ASSERT_THAT(splats.save(dir / "a.splat"), IsOk());
    EXPECT_EQ(std::filesystem::file_size(dir / "a.splat"), 3000u * 32u);
    SplatReport report;
    const Splats read = parse(Splats::load(dir / "a.splat", Splats::default_limit, &report));
    EXPECT_EQ(report, (SplatReport{3000, {}, {}}));
    EXPECT_EQ(read.positions, splats.positions);
    EXPECT_EQ(read.scales, splats.scales);
    double color_error = 0.0, opacity_error = 0.0, angle_error = 0.0;
    for (size_t i = 0; i < splats.size(); i++) {
        opacity_error = std::max(opacity_error, std::abs(double{read.opacities[i]} - splats.opacities[i]));
        angle_error = std::max(angle_error, angleBetween(read.rotations[i], splats.rotations[i]));
        for (int k = 0; k < 3; k++) {
            const double color = std::clamp(splats.harmonics[i * 16][k] * y_0 + 0.5, 0.0, 1.0);
            color_error = std::max(color_error, std::abs(read.harmonics[i][k] * y_0 + 0.5 - color));
        }
    }
    EXPECT_LE(color_error, 1.0 / 510 + 1e-6);
    EXPECT_LE(opacity_error, 1.0 / 510 + 1e-6);
    EXPECT_LE(angle_error, 2.0 * std::sqrt(7.0) / 256 * 1.01);
    EXPECT_GT(color_error, 0.9 / 510);
    const Expected<Bytes> bytes = readFile(dir / "a.splat");
    EXPECT_EQ(parse(parseDotSplat(*bytes, "a.splat")), read);
}

TEST(DotSplat, BadValues) {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
    const Splats good = randomSplats(3, 0, 1);
    const Bytes file = *encodeDotSplat(good);
    const auto read = [&](size_t place, float value) {
        Bytes bad = file;
        std::memcpy(bad.data() + 32 + 4 * place, &value, 4);
        SplatReport report;
        const Splats splats = parse(parseDotSplat(bad, "a.splat", Splats::default_limit, &report));
        EXPECT_EQ(splats.positions, (std::vector{good.positions[0], good.positions[2]}));
        EXPECT_EQ(report.splats, 3u);
        EXPECT_EQ(report.repaired.total(), 0u);
        return report.dropped;
    };
    for (const float value : {not_a_number, infinity, -infinity}) {
        for (const size_t place : {0, 1, 2}) EXPECT_EQ(read(place, value), (SplatReport::Counts{.position = 1}));
        for (const size_t place : {3, 4, 5}) EXPECT_EQ(read(place, value), (SplatReport::Counts{.scale = 1}));
    }
    EXPECT_EQ(read(4, -1e-9f), (SplatReport::Counts{.scale = 1}));

    Bytes zero = file;
    std::memset(zero.data() + 32 + 28, 128, 4);
    SplatReport report;
    EXPECT_EQ(parse(parseDotSplat(zero, "a.splat", Splats::default_limit, &report)).rotations[1], Vector4f(0, 0, 0, 1));
    EXPECT_EQ(report, (SplatReport{3, {}, {.rotation = 1}}));
}

TEST(DotSplat, SizesAndLimits) {
    EXPECT_EQ(parse(parseDotSplat({}, "a.splat")).size(), 0u);
    const Bytes file = *encodeDotSplat(randomSplats(10, 0, 1));
    for (size_t size = 0; size <= file.size(); size++) {
        const auto splats = parseDotSplat(std::span(file).first(size), "a.splat");
        if (size % 32 == 0)
            EXPECT_EQ(parse(splats).size(), size / 32);
        else
            EXPECT_THAT(splats, HasErrorId("splats.truncated")) << size;
    }
    // 14 numbers a splat.
    EXPECT_THAT(parseDotSplat(file, "a.splat", 560), IsOk());
    EXPECT_THAT(parseDotSplat(file, "a.splat", 559), HasErrorId("splats.too_large"));
    const TempDir dir;
    ASSERT_THAT(writeFile(dir / "a.splat", std::span(file).first(33)), IsOk());
    EXPECT_THAT(Splats::load(dir / "a.splat"), HasErrorId("splats.truncated"));
    EXPECT_THAT(Splats::load(dir / "b.splat"), HasErrorId("file.open"));
}

TEST(Spz, PositionsByHand) {
    SpzSplat splat;
    // 0x000800 / 4096 = 0.5, 0xfff800 = -0.5, 0x7fffff = 2048 - 1 / 4096
    splat.position = {std::byte{0},    std::byte{8},    std::byte{0},    std::byte{0},   std::byte{0xf8},
                      std::byte{0xff}, std::byte{0xff}, std::byte{0xff}, std::byte{0x7f}};
    EXPECT_EQ(parse(splat.read()).positions[0], Vector3f(0.5f, 0.5f, -2048.0f + 0x1p-12f));
    splat.fraction_bits = 0;
    EXPECT_EQ(parse(splat.read()).positions[0], Vector3f(2048.0f, 2048.0f, -8388607.0f));
    splat.fraction_bits = 23;
    EXPECT_EQ(parse(splat.read()).positions[0], Vector3f(0x1p-12f, 0x1p-12f, -1.0f + 0x1p-23f));
    splat.fraction_bits = 24;
    EXPECT_THAT(splat.read(), HasErrorId("splats.spz_header"));

    SpzSplat half{.version = 1, .position = Bytes(6)};
    const std::array<uint16_t, 3> numbers = {0x3c00, 0xc000, 0x0001};  // 1, -2, 2^-24
    std::memcpy(half.position.data(), numbers.data(), 6);
    EXPECT_EQ(parse(half.read()).positions[0], Vector3f(1.0f, 2.0f, -0x1p-24f));
    const std::array<uint16_t, 3> bad = {0x3c00, 0x7c00, 0x0000};
    std::memcpy(half.position.data(), bad.data(), 6);
    SplatReport report;
    EXPECT_EQ(parse(parseSpz(gzip(half.unpacked()), "a.spz", 1000, &report)).size(), 0u);
    EXPECT_EQ(report, (SplatReport{1, {.position = 1}, {}}));
}

TEST(Spz, OtherValuesByHand) {
    SpzSplat splat{.flags = 1, .opacity = 51, .color = {0, 255, 128}, .scale = {0, 160, 255}};
    const Splats splats = parse(splat.read());
    EXPECT_TRUE(splats.is_antialiased);
    EXPECT_FLOAT_EQ(splats.opacities[0], 0.2f);
    EXPECT_FLOAT_EQ(splats.scales[0].x, std::exp(-10.0f));
    EXPECT_FLOAT_EQ(splats.scales[0].y, 1.0f);
    EXPECT_FLOAT_EQ(splats.scales[0].z, std::exp(5.9375f));
    EXPECT_FLOAT_EQ(splats.harmonics[0].x, -0.5f / 0.15f);
    EXPECT_FLOAT_EQ(splats.harmonics[0].y, 0.5f / 0.15f);
    EXPECT_NEAR(splats.harmonics[0].z, 0.5 / 255 / 0.15, 1e-6);
    splat.flags = 2;
    EXPECT_FALSE(parse(splat.read()).is_antialiased);
}

TEST(Spz, RotationsByHand) {
    // Version 3: w is the largest; x = 511 steps of sqrt(1/2) / 511, y = 0, z = -0. y and z change their signs.
    SpzSplat splat;
    splat.rotation = 3u << 30 | 511u << 20 | 0u << 10 | 512u;
    const float half = std::sqrt(0.5f);
    for (int k = 0; k < 4; k++)
        EXPECT_NEAR(parse(splat.read()).rotations[0][k], Vector4f(half, 0, 0, half)[k], 1e-6f) << k;
    // y is the largest, x = -256 steps, z = 100, w = 200.
    splat.rotation = 1u << 30 | (512u | 256u) << 20 | 100u << 10 | 200u;
    const Vector3f rest = Vector3f(-256, 100, 200) * (half / 511.0f);
    const float y = std::sqrt(1.0f - glm::dot(rest, rest));
    for (int k = 0; k < 4; k++)
        EXPECT_NEAR(parse(splat.read()).rotations[0][k], Vector4f(rest.x, -y, -rest.y, rest.z)[k], 1e-6f) << k;
    // Three components that are too long for a unit quaternion are brought to one.
    splat.rotation = 0u << 30 | 511u << 20 | 511u << 10 | 511u;
    const float third = std::sqrt(1.0f / 3.0f);
    for (int k = 0; k < 4; k++)
        EXPECT_NEAR(parse(splat.read()).rotations[0][k], Vector4f(0, -third, -third, third)[k], 1e-6f) << k;

    // Versions 1 and 2: x, y, z from -1 to 1, w positive.
    for (const uint32_t version : {1u, 2u}) {
        SpzSplat old{.version = version, .position = Bytes(version == 1 ? 6 : 9), .rotation_xyz = {191, 64, 127}};
        const Vector3f xyz = Vector3f(191, 64, 127) / 127.5f - 1.0f;
        const Vector4f expected = {xyz.x, -xyz.y, -xyz.z, std::sqrt(1.0f - glm::dot(xyz, xyz))};
        for (int k = 0; k < 4; k++) EXPECT_NEAR(parse(old.read()).rotations[0][k], expected[k], 1e-6f) << k;
    }
}

// The file's axes are those of Splats after half a turn about x: what a splat looks like and covers turns with it.
TEST(Spz, Axes) {
    Random random(1);
    SpzSplat splat{.degree = 3};
    for (int i = 0; i < 45; i++) splat.harmonics.push_back(static_cast<uint8_t>(random.below(256)));
    splat.rotation = 2u << 30 | 123u << 20 | (512u | 45u) << 10 | 400u;
    const Splats splats = parse(splat.read());
    ASSERT_EQ(splats.degree, 3u);
    for (int run = 0; run < 20; run++) {
        const Vector3d direction = random.direction();
        const auto ours = evaluateHarmonics(direction);
        const auto theirs = evaluateHarmonics(turn(direction));
        for (int channel = 0; channel < 3; channel++) {
            double color = 0.0, expected = 0.0;
            for (int k = 1; k < 16; k++) {
                color += splats.harmonics[k][channel] * ours[k];
                expected += (splat.harmonics[3 * (k - 1) + channel] - 128.0) / 128.0 * theirs[k];
            }
            EXPECT_NEAR(color, expected, 1e-12);
        }
        const float step = std::sqrt(0.5f) / 511.0f;
        Vector4f q = Vector4f(123, -45, 0, 400) * step;
        q.z = std::sqrt(1.0f - glm::dot(q, q));
        const Vector3d turned = rotate(splats.rotations[0], direction);
        EXPECT_LE(glm::length(turned - turn(rotate(q, turn(direction)))), 1e-6);
    }
    // Degree 4 has 24 coefficients; the first 15 are read.
    SpzSplat fourth = splat;
    fourth.degree = 4;
    fourth.harmonics.resize(72, 7);
    EXPECT_EQ(parse(fourth.read()).harmonics, splats.harmonics);
    fourth.degree = 5;
    EXPECT_THAT(fourth.read(), HasErrorId("splats.spz_header"));
}

// Half a step: 2^-13 of positions, 1/32 of logarithms of scales, 1/510 of opacities, 1/(510 * 0.15) of the first
// coefficients, 1/256 of the others (but 1 becomes 127/128). A quaternion's three smaller components are off by
// sqrt(1/2) / 1022 each, together by e = 1.2e-3; the largest, at least 1/2 and the root of what they leave of 1, by
// |(1, 1, 1)| / 2 / (1/2) e; the turn by twice the length of both, 4.8e-3.
TEST(Spz, RoundTrip) {
    const TempDir dir;
    for (uint32_t degree = 0; degree <= 3; degree++) {
        Splats splats = randomSplats(3000, degree, degree + 1);
        splats.is_antialiased = degree == 2;
        splats.positions[0] = {2047.9f, -2047.9f, 0.0f};
        splats.scales[1] = {0.0f, 1e-6f, 1e30f};  // beyond the file's range: e^-10 to e^5.94
        splats.harmonics[0] = {100.0f, -100.0f, 1.0f};
        ASSERT_THAT(splats.save(dir / "a.spz"), IsOk());
        SplatReport report;
        const Splats read = parse(Splats::load(dir / "a.spz", Splats::default_limit, &report));
        EXPECT_EQ(report, (SplatReport{3000, {}, {}}));
        EXPECT_EQ(read.degree, degree);
        EXPECT_EQ(read.is_antialiased, splats.is_antialiased);
        ASSERT_EQ(read.size(), splats.size());
        double position = 0, scale = 0, opacity = 0, angle = 0, first = 0, others = 0;
        const auto grow = [](double& error, double value) { error = std::max(error, std::abs(value)); };
        for (size_t i = 0; i < splats.size(); i++) {
            grow(opacity, double{read.opacities[i]} - splats.opacities[i]);
            grow(angle, angleBetween(read.rotations[i], splats.rotations[i]));
            for (int axis = 0; axis < 3; axis++) {
                grow(position, double{read.positions[i][axis]} - splats.positions[i][axis]);
                const double wanted = std::clamp(std::log(double{splats.scales[i][axis]}), -10.0, 95.0 / 16.0);
                grow(scale, std::log(double{read.scales[i][axis]}) - wanted);
                for (uint32_t k = 0; k < splats.coefficientCount(); k++) {
                    const size_t at = i * splats.coefficientCount() + k;
                    const double most = k == 0 ? 0.5 / 0.15 : 1.0;
                    const double harmonic = std::clamp<double>(splats.harmonics[at][axis], -most, most);
                    grow(k == 0 ? first : others, read.harmonics[at][axis] - harmonic);
                }
            }
        }
        // What float32 adds to them is below 1e-6 of each.
        EXPECT_LE(position, 0x1p-13);
        EXPECT_GT(position, 0x1p-14);
        EXPECT_LE(scale, 1.0 / 32 + 1e-5);
        EXPECT_LE(opacity, 1.0 / 510 + 1e-6);
        EXPECT_LE(first, 1.0 / (510 * 0.15) + 1e-5);
        EXPECT_LE(others, 2.0 / 256 + 1e-6);
        EXPECT_LE(angle, 4.8e-3);
        EXPECT_GT(angle, 1e-3);
    }
}

TEST(Spz, FarPositionsHaveFewerBits) {
    Splats splats = randomSplats(1, 0, 1);
    for (int bits = 0; bits <= 12; bits++) {
        const auto far = static_cast<float>(std::ldexp((1 << 23) - 1, -bits));
        splats.positions[0] = {far, 0.3f, -0.3f};
        const Splats read = parse(parseSpz(*encodeSpz(splats), "a.spz"));
        EXPECT_EQ(read.positions[0].x, far) << bits;
        EXPECT_NEAR(read.positions[0].y, 0.3, std::ldexp(0.5, -bits) + 1e-7) << bits;
    }
    splats.positions[0].x = -0x1p23f;
    EXPECT_THAT(encodeSpz(splats), HasErrorId("splats.range"));
    splats.rotations[0] = {0, 0, 0, 0};
    EXPECT_THAT(encodeSpz(splats), HasErrorId("splats.value"));
    EXPECT_EQ(parse(parseSpz(*encodeSpz({}), "a.spz")).size(), 0u);
}

TEST(Spz, OtherFilesAreRefused) {
    EXPECT_THAT(parseSpz({}, "a.spz"), HasErrorId("splats.spz_header"));
    EXPECT_THAT(parseSpz(Bytes(100), "a.spz"), HasErrorId("splats.spz_header"));
    Bytes plain = SpzSplat{}.unpacked();
    EXPECT_THAT(parseSpz(plain, "a.spz"), HasErrorId("splats.spz_version"));
    plain[0] = std::byte{'X'};
    EXPECT_THAT(parseSpz(gzip(plain), "a.spz"), HasErrorId("splats.spz_header"));
    EXPECT_THAT((SpzSplat{.version = 0}).read(), HasErrorId("splats.spz_version"));
    const Expected<Splats> newer = (SpzSplat{.version = 4}).read();
    EXPECT_THAT(newer, HasErrorId("splats.spz_version"));
    EXPECT_NE(newer.error().text().find("test.spz"), std::string::npos);
}

TEST(Spz, TruncatedOrDamaged) {
    const Bytes file = *encodeSpz(randomSplats(20, 1, 1));
    for (size_t size = 0; size < file.size(); size++) {
        const auto part = parseSpz(std::span(file).first(size), "a.spz");
        ASSERT_FALSE(part) << size;
        EXPECT_THAT(part, HasErrorId(size < 2 ? "splats.spz_header" : "splats.truncated")) << size;
    }
    // The checksum finds what damaged bytes leave readable; what changes nothing (unused codes) is nobody's loss.
    const Splats splats = parse(parseSpz(file, "a.spz"));
    for (size_t i = 10; i < file.size(); i++) {
        Bytes damaged = file;
        damaged[i] ^= std::byte{0x10};
        const auto read = parseSpz(damaged, "a.spz");
        EXPECT_TRUE(!read || *read == splats) << i;
    }
    // What follows the last splat is an extension.
    Bytes longer = SpzSplat{}.unpacked();
    longer.resize(longer.size() + 10'000);
    EXPECT_THAT(parseSpz(gzip(longer), "a.spz"), IsOk());
    Bytes shorter = SpzSplat{}.unpacked();
    shorter.pop_back();
    EXPECT_THAT(parseSpz(gzip(shorter), "a.spz"), HasErrorId("splats.truncated"));
}

TEST(Spz, LimitsAndLies) {
    const Bytes file = *encodeSpz(randomSplats(100, 3, 1));
    EXPECT_THAT(parseSpz(file, "a.spz", 100 * 59 * 4), IsOk());
    EXPECT_THAT(parseSpz(file, "a.spz", 100 * 59 * 4 - 1), HasErrorId("splats.too_large"));
    const SpzSplat lie{.degree = 3, .count = 50'000'000};
    EXPECT_LT(peakMemory([&] { EXPECT_THAT(lie.read(), HasErrorId("splats.truncated")); }), uint64_t{1} << 20);
}

TEST(Splats, ReducedDegree) {
    const Splats splats = randomSplats(50, 3, 1);
    for (uint32_t degree = 0; degree <= 3; degree++) {
        Splats reduced = splats;
        reduced.reduceDegree(degree);
        EXPECT_EQ(reduced.degree, degree);
        EXPECT_THAT(reduced.validate(), IsOk());
        const size_t count = reduced.coefficientCount();
        for (size_t i = 0; i < splats.size(); i++)
            for (size_t k = 0; k < count; k++)
                EXPECT_EQ(reduced.harmonics[i * count + k], splats.harmonics[i * 16 + k]);
        Splats again = reduced;
        again.reduceDegree(3);
        EXPECT_EQ(again, reduced);
    }
}
