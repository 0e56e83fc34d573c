// Pictures of ray-tracing pipelines by either engine: the driver's pipeline, and the one that Glint joins into a
// kernel.

#include "golden/render.h"
#include "support/image_compare.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace glint::test {

namespace {

struct EngineCase {
    const char* name;
    const char* program;
    const char* arguments;
    uint32_t pixels;  ///< that may differ
};

void PrintTo(const EngineCase& item, std::ostream* stream) { *stream << item.name; }

class Engines : public ::testing::TestWithParam<EngineCase> {};
/// The others, as each takes seconds to compile.
class EnginesLong : public ::testing::TestWithParam<EngineCase> {};

std::string nameOf(const ::testing::TestParamInfo<EngineCase>& item) { return item.param.name; }

// The same shaders on the same numbers: what differs is on which side of an edge a ray falls, where the two triangle
// tests round differently. One or two pixels in a hundred are edges for float64 (course_reference_test.cpp), of which a
// quarter to a half is allowed: half a pixel in a hundred, and twice that where glass or mirrors multiply what rounding
// moves a ray by, as between pipelines and queries (course_light_test.cpp). A pixel differs if a channel is off by more
// than a step of 8 bits and the half that rounding to them may add.
void expectAgreement(const EngineCase& item) {
    const TempDir folder;
    const Expected<Image> driver =
        renderExample(item.program, std::string(item.arguments) + " --tracing driver", folder);
    const Expected<Image> software =
        renderExample(item.program, std::string(item.arguments) + " --tracing software", folder);
    ASSERT_TRUE(driver && software);
    std::printf("%llu pixels differ between the engines\n",
                static_cast<unsigned long long>(compareImages(*software, *driver, 1.5f / 255.0f).differing));
    EXPECT_TRUE(imagesMatch(*software, *driver, std::string(item.name) + "_software",
                            {.channel = 1.5f / 255.0f, .texels = item.pixels}));
}

}  // namespace

TEST_P(Engines, Agree) { expectAgreement(GetParam()); }
TEST_P(EnginesLong, Agree) { expectAgreement(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Examples, Engines,
                         ::testing::Values(EngineCase{"06", "06_hello_traversal", "--size 160x90 --time 3", 72},
                                           EngineCase{"23", "23_shadows", "--size 96x54", 26},
                                           EngineCase{"24", "24_reflections", "--size 96x54", 52},
                                           EngineCase{"26", "26_procedural", "--size 96x54", 52},
                                           EngineCase{"27_stochastic", "27_cutout",
                                                      "--size 96x54 --stochastic --opacity 0.7 --samples 4", 26},
                                           EngineCase{"28_fisheye", "28_lenses", "--size 96x54 --lens fisheye", 26}),
                         nameOf);

INSTANTIATE_TEST_SUITE_P(
    Examples, EnginesLong,
    ::testing::Values(EngineCase{"06_primary", "06_hello_traversal", "--size 160x90 --time 3 --primary", 72},
                      EngineCase{"20", "20_normals", "--size 96x54", 26},
                      EngineCase{"21", "21_diffuse", "--size 96x54", 26},
                      EngineCase{"22", "22_phong", "--size 96x54", 26},
                      EngineCase{"25", "25_environment", "--size 96x54 --environment sky --samples 8", 26},
                      EngineCase{"27", "27_cutout", "--size 96x54", 26},
                      EngineCase{"28_pinhole", "28_lenses", "--size 96x54 --lens pinhole", 26},
                      EngineCase{"28_spherical", "28_lenses", "--size 96x54 --lens spherical", 26},
                      EngineCase{"29", "29_motion", "--size 96x54 --slices 8", 26}),
    nameOf);

}  // namespace glint::test
