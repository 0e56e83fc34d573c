// PLY files of splats: every order, type and encoding, bad values of every kind, files that are broken or lie.

#include "support/allocations.h"
#include "support/files.h"
#include "support/matchers.h"
#include "support/reference.h"
#include "support/splat_files.h"
#include "support/splat_scenes.h"

#include <glint/base/file.h>
#include <glint/format/splats.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

using namespace glint;
using namespace glint::test;

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

struct Outcome {
    Splats splats;
    SplatReport report;
};

Outcome parse(const std::vector<std::byte>& file) {
    Outcome outcome;
    Expected<Splats> splats = parsePlySplats(file, "test.ply", Splats::default_limit, &outcome.report);
    EXPECT_THAT(splats, IsOk());
    if (splats) outcome.splats = std::move(*splats);
    EXPECT_THAT(outcome.splats.validate(), IsOk());
    return outcome;
}

std::vector<std::byte> bytesOf(std::string_view text) {
    const auto bytes = std::as_bytes(std::span(text));
    return {bytes.begin(), bytes.end()};
}

/// exp of the C library is within 1 ulp, a float64 result rounded to float32 within 1/2: 2 between them. A sigmoid has
/// a sum and a quotient of 1/2 each beside that, and exp's own error. The quotient and root of a quaternion are taken
/// in float64.
void expectNear(const Splats& splats, const Splats& expected) {
    EXPECT_EQ(splats.degree, expected.degree);
    EXPECT_EQ(splats.positions, expected.positions);
    EXPECT_EQ(splats.harmonics, expected.harmonics);
    ASSERT_EQ(splats.size(), expected.size());
    for (size_t i = 0; i < splats.size(); i++) {
        for (int axis = 0; axis < 3; axis++)
            EXPECT_LE(ulpDistance(splats.scales[i][axis], expected.scales[i][axis]), 2u) << i;
        for (int k = 0; k < 4; k++) EXPECT_LE(ulpDistance(splats.rotations[i][k], expected.rotations[i][k]), 1u) << i;
        EXPECT_LE(ulpDistance(splats.opacities[i], expected.opacities[i]), 4u) << i;
    }
}

template <class T>
void append(std::string& file, float value, bool is_big) {
    const auto typed = static_cast<T>(value);
    std::string bytes(sizeof(T), '\0');
    std::memcpy(bytes.data(), &typed, sizeof(T));
    if (is_big) std::reverse(bytes.begin(), bytes.end());
    file += bytes;
}

/// A header of these properties and a row of zeros.
std::vector<std::byte> fileOf(const std::vector<std::string>& names) {
    return PlyRows{names, {std::vector<float>(names.size(), 0.0f)}}.bytes();
}

}  // namespace

TEST(SplatsPly, OfThePaperInEveryDegree) {
    for (uint32_t degree = 0; degree <= 3; degree++) {
        const PlyRows rows = randomPlyRows(100, degree, degree);
        const Outcome outcome = parse(rows.bytes());
        expectNear(outcome.splats, expectedSplats(rows, degree));
        EXPECT_EQ(outcome.report, (SplatReport{100, {}, {}}));
    }
    EXPECT_EQ(plySplatNames(3).size(), 62u);
}

// Other properties, a list and another element stand between, and values have every type that holds them.
TEST(SplatsPly, EveryOrderTypeAndEncoding) {
    Random random(1);
    for (int run = 0; run < 60; run++) {
        const auto degree = static_cast<uint32_t>(random.below(4));
        const int encoding = run % 3;  // ASCII, little-endian, big-endian
        PlyRows rows = randomPlyRows(3, degree, run);
        std::vector<size_t> order(rows.names.size());
        for (size_t i = 0; i < order.size(); i++) order[i] = i;
        for (size_t i = order.size() - 1; i > 0; i--) std::swap(order[i], order[random.below(i + 1)]);
        const bool has_normals = random.below(2) == 0;
        const size_t list_at = random.below(3) == 0 ? random.below(order.size()) : order.size();
        const bool has_doubles = random.below(2) == 0;
        std::vector<bool> is_double(rows.names.size());
        for (size_t i = 0; i < is_double.size(); i++) is_double[i] = has_doubles && random.below(2) == 0;

        std::string file = fmt::format("ply\nformat {} 1.0\nelement camera 2\nproperty uchar kind\nelement vertex 3\n",
                                       encoding == 0   ? "ascii"
                                       : encoding == 1 ? "binary_little_endian"
                                                       : "binary_big_endian");
        const auto isLeftOut = [&](size_t i) { return !has_normals && rows.names[i].starts_with("n"); };
        for (size_t place = 0; place < order.size(); place++) {
            const size_t i = order[place];
            if (place == list_at) file += "property list uchar short neighbours\n";
            if (!isLeftOut(i))
                file += fmt::format("property {} {}\n", is_double[i] ? "double" : "float", rows.names[i]);
        }
        file += "property uchar segment\nelement face 0\nend_header\n";
        const bool is_big = encoding == 2;
        file += encoding == 0 ? "1\n2\n" : "\x01\x02";
        for (const std::vector<float>& row : rows.rows) {
            for (size_t place = 0; place < order.size(); place++) {
                const size_t i = order[place];
                if (place == list_at) {
                    if (encoding == 0) {
                        file += "2 7 8 ";
                    } else {
                        file += '\x02';
                        append<int16_t>(file, 7.0f, is_big);
                        append<int16_t>(file, 8.0f, is_big);
                    }
                }
                if (isLeftOut(i)) continue;
                if (encoding == 0)
                    file += fmt::format("{} ", row[i]);
                else
                    (is_double[i] ? append<double> : append<float>)(file, row[i], is_big);
            }
            file += encoding == 0 ? "9\n" : "\x09";
        }
        const Outcome outcome = parse(bytesOf(file));
        expectNear(outcome.splats, expectedSplats(rows, degree));
    }
}

TEST(SplatsPly, OtherNumbersOfHarmonicsAreRefused) {
    const std::vector<std::string> none = plySplatNames(0);
    EXPECT_THAT(parsePlySplats(fileOf(none), "a.ply"), IsOk());
    for (const int count : {1, 8, 10, 23, 25, 44, 46, 72}) {
        std::vector<std::string> names = none;
        for (int i = 0; i < count; i++) names.push_back(fmt::format("f_rest_{}", i));
        const Expected<Splats> splats = parsePlySplats(fileOf(names), "a.ply");
        EXPECT_THAT(splats, HasErrorId("splats.rest"));
        EXPECT_NE(splats.error().text().find(fmt::format("{} numbers", count)), std::string::npos)
            << splats.error().text();
    }
    // As many as there should be, but not those.
    std::vector<std::string> names = plySplatNames(1);
    std::replace(names.begin(), names.end(), std::string("f_rest_3"), std::string("f_rest_9"));
    const Expected<Splats> splats = parsePlySplats(fileOf(names), "a.ply");
    EXPECT_THAT(splats, HasErrorId("splats.property"));
    EXPECT_NE(splats.error().text().find("f_rest_3"), std::string::npos) << splats.error().text();
}

TEST(SplatsPly, MissingPropertiesAreNamed) {
    for (const std::string& name : plySplatNames(0)) {
        std::vector<std::string> names = plySplatNames(0);
        names.erase(std::find(names.begin(), names.end(), name));
        const Expected<Splats> splats = parsePlySplats(fileOf(names), "a.ply");
        if (name.starts_with("n")) {
            EXPECT_THAT(splats, IsOk()) << name;
        } else {
            EXPECT_THAT(splats, HasErrorId("splats.property")) << name;
            EXPECT_NE(splats.error().text().find("'" + name + "'"), std::string::npos) << splats.error().text();
        }
    }
    EXPECT_THAT(parsePlySplats(bytesOf("ply\nformat ascii 1.0\nelement face 0\nend_header\n"), "a.ply"),
                HasErrorId("splats.property"));
    EXPECT_THAT(parsePlySplats(bytesOf("solid"), "a.ply"), HasErrorId("ply.header"));
}

// NaN, infinity and -infinity in each of the 62 values in turn: what is left is the file without the splat to the bit,
// or the splat repaired by the rule, and either is counted.
TEST(SplatsPly, BadValuesAreDroppedOrRepairedAndCounted) {
    const PlyRows good = randomPlyRows(5, 3, 1);
    PlyRows without = good;
    without.rows.erase(without.rows.begin() + 2);
    const Splats all = parse(good.bytes()).splats;
    const Splats rest = parse(without.bytes()).splats;
    for (const std::string& name : good.names) {
        for (const float value : {not_a_number, infinity, -infinity}) {
            SCOPED_TRACE(fmt::format("{} = {}", name, value));
            PlyRows rows = good;
            rows.at(2, name) = value;
            Splats expected = rest;
            SplatReport report{5, {}, {}};
            if (name.starts_with("n")) {
                expected = all;
            } else if (name.starts_with("scale") && value == -infinity) {
                expected = all;
                expected.scales[2][name.back() - '0'] = 0.0f;
                report.repaired.scale = 1;
            } else if (name == "opacity" && !std::isnan(value)) {
                expected = all;
                expected.opacities[2] = value > 0.0f ? 1.0f : 0.0f;
                report.repaired.opacity = 1;
            } else if (name.starts_with("scale")) {
                report.dropped.scale = 1;
            } else if (name.starts_with("rot")) {
                report.dropped.rotation = 1;
            } else if (name == "opacity") {
                report.dropped.opacity = 1;
            } else if (name.starts_with("f_")) {
                report.dropped.harmonics = 1;
            } else {
                report.dropped.position = 1;
            }
            const Outcome outcome = parse(rows.bytes());
            EXPECT_EQ(outcome.splats, expected);
            EXPECT_EQ(outcome.report, report);
        }
    }
}

TEST(SplatsPly, RuleForFiniteValues) {
    const auto read = [](std::initializer_list<std::pair<const char*, float>> values) {
        PlyRows rows = randomPlyRows(1, 0, 1);
        for (const auto& [name, value] : values) rows.at(0, name) = value;
        return parse(rows.bytes());
    };
    // exp(88.73) is beyond float32, exp(88.72) is not.
    EXPECT_EQ(read({{"scale_1", 88.73f}}).report.dropped.scale, 1u);
    EXPECT_EQ(read({{"scale_1", 88.72f}}).report.dropped.total(), 0u);
    // What is too small for float32 becomes 0; that is no bad value.
    EXPECT_EQ(read({{"scale_1", -110.0f}}).splats.scales[0].y, 0.0f);
    EXPECT_EQ(read({{"scale_1", -110.0f}}).report, (SplatReport{1, {}, {}}));
    EXPECT_EQ(read({{"opacity", -110.0f}}).splats.opacities[0], 0.0f);
    EXPECT_EQ(read({{"opacity", 20.0f}}).splats.opacities[0], 1.0f);
    // A quaternion of zeros turns nothing; all others do, whatever their length.
    const Outcome zero = read({{"rot_0", 0.0f}, {"rot_1", -0.0f}, {"rot_2", 0.0f}, {"rot_3", 0.0f}});
    EXPECT_EQ(zero.splats.rotations[0], Vector4f(0, 0, 0, 1));
    EXPECT_EQ(zero.report.repaired.rotation, 1u);
    for (const float length : {1e-45f, 1e-30f, 1e30f, 3e38f}) {
        const Outcome outcome = read({{"rot_0", 0.0f}, {"rot_1", 0.0f}, {"rot_2", -length}, {"rot_3", 0.0f}});
        EXPECT_EQ(outcome.splats.rotations[0], Vector4f(0, -1, 0, 0)) << length;
        EXPECT_EQ(outcome.report, (SplatReport{1, {}, {}})) << length;
    }
    // Of several bad values the first counts, and what is dropped was not repaired.
    const Outcome several = read({{"scale_0", -infinity}, {"opacity", not_a_number}, {"f_dc_1", infinity}});
    EXPECT_EQ(several.report, (SplatReport{1, {.opacity = 1}, {}}));
    const Outcome repaired = read({{"scale_0", -infinity}, {"opacity", infinity}});
    EXPECT_EQ(repaired.report, (SplatReport{1, {}, {.scale = 1}}));
}

// Over many blocks, with bad splats here and there: in order, and the same from a file as from memory.
TEST(SplatsPly, ManyBlocks) {
    const TempDir dir;
    const PlyRows good = randomPlyRows(20'000, 1, 3);
    PlyRows bad = good, without{good.names, {}};
    Random random(5);
    uint64_t dropped = 0;
    for (size_t i = 0; i < good.rows.size(); i++) {
        const bool is_bad = i == 0 || i + 1 == good.rows.size() || random.below(100) == 0 || (i > 6000 && i < 11'000);
        if (is_bad)
            bad.rows[i][6 + random.below(12)] = not_a_number;
        else
            without.rows.push_back(good.rows[i]);
        dropped += is_bad;
    }
    const Splats expected = parse(without.bytes()).splats;
    const Outcome outcome = parse(bad.bytes());
    EXPECT_EQ(outcome.splats, expected);
    EXPECT_EQ(outcome.report, (SplatReport{20'000, {.harmonics = dropped}, {}}));

    ASSERT_THAT(writeFile(dir / "bad.PLY", bad.bytes()), IsOk());
    SplatReport report;
    const Expected<Splats> loaded = Splats::load(dir / "bad.PLY", Splats::default_limit, &report);
    ASSERT_THAT(loaded, IsOk());
    EXPECT_EQ(*loaded, expected);
    EXPECT_EQ(report, outcome.report);
}

TEST(SplatsPly, EmptyFile) {
    const Outcome outcome = parse(PlyRows{plySplatNames(3), {}}.bytes());
    EXPECT_EQ(outcome.splats.size(), 0u);
    EXPECT_EQ(outcome.splats.degree, 3u);
    EXPECT_EQ(outcome.report, SplatReport());
}

// The logarithm's rounding, 2^-24 of its size of at most 9.3, is a relative error of the scale; exp and log add an ulp
// each. The same holds for a logit x of an opacity p, of which d p / d x = p (1 - p).
TEST(SplatsPly, RoundTrip) {
    Splats splats = randomSplats(1000, 3, 1);
    splats.opacities[0] = 0.0f;
    splats.opacities[1] = 1.0f;
    splats.scales[2] = {0.0f, 1.0f, 1e30f};
    splats.scales[3] = {1e-38f, 1e-44f, 3.4e38f};
    const Expected<std::vector<std::byte>> file = encodePlySplats(splats);
    ASSERT_THAT(file, IsOk());
    const Outcome outcome = parse(*file);
    EXPECT_EQ(outcome.report, (SplatReport{1000, {}, {}}));
    EXPECT_EQ(outcome.splats.positions, splats.positions);
    EXPECT_EQ(outcome.splats.harmonics, splats.harmonics);
    for (size_t i = 0; i < splats.size(); i++) {
        for (int axis = 0; axis < 3; axis++) {
            const float scale = splats.scales[i][axis];
            const double logarithm = std::abs(std::log(std::max(double{scale}, 1e-300)));
            // Below 2^-126 steps are absolute.
            const double bound = scale * (logarithm * 0x1p-23 + 0x1p-22) + 0x1p-149;
            EXPECT_LE(std::abs(outcome.splats.scales[i][axis] - scale), scale == 0.0f ? 0.0 : bound) << i;
        }
        const double logit = std::log(splats.opacities[i] / (1.0 - splats.opacities[i]));
        const double bound = std::isfinite(logit) ? (std::abs(logit) + 4.0) * 0x1p-23 : 0.0;
        EXPECT_LE(std::abs(outcome.splats.opacities[i] - splats.opacities[i]), bound) << i;
        for (int k = 0; k < 4; k++)
            EXPECT_LE(ulpDistance(outcome.splats.rotations[i][k], splats.rotations[i][k]), 2u) << i;
    }
    // No number in the file is infinite: other programs stumble over those.
    SplatReport report;
    ASSERT_THAT(parsePlySplats(*file, "test.ply", Splats::default_limit, &report), IsOk());
    EXPECT_EQ(report.repaired.total(), 0u);
    Splats broken = splats;
    broken.opacities[7] = 2.0f;
    EXPECT_THAT(encodePlySplats(broken), HasErrorId("splats.value"));
}

TEST(SplatsPly, TruncatedAnywhere) {
    const TempDir dir;
    const std::vector<std::byte> file = randomPlyRows(3, 1, 1).bytes();
    for (size_t size = 0; size < file.size(); size++) {
        const std::vector<std::byte> part(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size));
        const Expected<Splats> splats = parsePlySplats(part, "test.ply");
        ASSERT_FALSE(splats) << size;
        EXPECT_TRUE(splats.error().id() == "ply.header" || splats.error().id() == "ply.truncated");
        if (size % 97 == 0) {
            ASSERT_THAT(writeFile(dir / "part.ply", part), IsOk());
            EXPECT_THAT(Splats::load(dir / "part.ply"), HasErrorId(std::string(splats.error().id())));
        }
    }
}

TEST(SplatsPly, LimitsAndLies) {
    const PlyRows rows = randomPlyRows(100, 3, 1);
    // A splat of degree 3 has 59 numbers.
    EXPECT_THAT(parsePlySplats(rows.bytes(), "a.ply", 100 * 59 * 4), IsOk());
    EXPECT_THAT(parsePlySplats(rows.bytes(), "a.ply", 100 * 59 * 4 - 1), HasErrorId("splats.too_large"));
    std::string text = "ply\nformat ascii 1.0\nelement vertex 1000000000000\n";
    for (const std::string& name : plySplatNames(0)) text += fmt::format("property float {}\n", name);
    text += "end_header\n1 2 3\n";
    EXPECT_LT(peakMemory([&] { EXPECT_THAT(parsePlySplats(bytesOf(text), "a.ply"), HasErrorId("ply.truncated")); }),
              uint64_t{1} << 20);
}

// A header that is longer than what is looked at first, and a file that is no PLY.
TEST(SplatsPly, LongHeaderFromFile) {
    const TempDir dir;
    std::vector<std::byte> file = randomPlyRows(10, 0, 1).bytes();
    const std::vector<std::byte> comment = bytesOf("comment " + std::string(200'000, 'x') + "\n");
    file.insert(file.begin() + 4, comment.begin(), comment.end());
    ASSERT_THAT(writeFile(dir / "long.ply", file), IsOk());
    const Expected<Splats> splats = Splats::load(dir / "long.ply");
    ASSERT_THAT(splats, IsOk());
    EXPECT_EQ(*splats, parse(file).splats);
    ASSERT_THAT(writeFile(dir / "no.ply", bytesOf(std::string(100'000, 'x'))), IsOk());
    EXPECT_THAT(Splats::load(dir / "no.ply"), HasErrorId("ply.header"));
    EXPECT_THAT(Splats::load(dir / "absent.ply"), HasErrorId("file.open"));
    EXPECT_THAT(Splats::load(dir / "long.obj"), HasErrorId("splats.unknown_extension"));
    EXPECT_THAT(splats->save(dir / "long.obj"), HasErrorId("splats.unknown_extension"));
}

// Beside the splats a load takes the blocks in flight: 2 for each of at most 4 threads and one, of 1.1 MiB each, and
// what threads take for themselves.
TEST(SplatsPly, LoadTakesLittleBesideTheSplats) {
    const TempDir dir;
    const Splats splats = randomSplats(100'000, 3, 1);
    ASSERT_THAT(splats.save(dir / "a.ply"), IsOk());
    Splats loaded;
    const uint64_t peak = peakMemory([&] { loaded = *Splats::load(dir / "a.ply"); });
    EXPECT_EQ(loaded.size(), splats.size());
    EXPECT_LT(peak, uint64_t{100'000} * 59 * 4 + (2 * 4 + 8) * (1u << 20));
}

// A trained scene, if there is one: nothing of it is bad, and every format keeps it whole.
TEST(SplatsPly, RealScene) {
    GLINT_NEED_SPLATS();
    SplatReport report;
    const Expected<Splats> splats = Splats::load(splatsPath(), Splats::default_limit, &report);
    ASSERT_THAT(splats, IsOk());
    EXPECT_THAT(splats->validate(), IsOk());
    EXPECT_GT(splats->size(), 0u);
    EXPECT_EQ(report, (SplatReport{splats->size(), {}, {}}));
    const TempDir dir;
    for (const char* name : {"a.ply", "a.splat", "a.spz"}) {
        ASSERT_THAT(splats->save(dir / name), IsOk());
        const Expected<Splats> again = Splats::load(dir / name, Splats::default_limit, &report);
        ASSERT_THAT(again, IsOk());
        EXPECT_EQ(report, (SplatReport{splats->size(), {}, {}})) << name;
    }
}
