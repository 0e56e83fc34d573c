#pragma once

#include <glint/format/image.h>

#include <gtest/gtest.h>

#include <string>

namespace glint::test {

/// How different two pictures may be.
struct ImageTolerance {
    /// Largest difference of a channel that does not count; 8-bit pictures are compared in steps of 1 / 255.
    float channel = 1.5f / 255.0f;
    /// Number of texels that may differ by more.
    uint64_t texels = 0;
};

/// What compareImages finds. NaN differs from everything.
struct ImageDifference {
    bool is_comparable = false;  ///< same size, and formats that Image::load can read
    uint64_t differing = 0;      ///< texels with a channel that differs by more than the threshold
    float largest = 0.0f;        ///< largest difference of a channel
    double mean_square = 0.0;    ///< mean over all texels and channels of the squared difference
    Image heat_map;              ///< black where equal, blue to the threshold, then red to white at 16 times as much
};

ImageDifference compareImages(const Image& actual, const Image& expected, float threshold);

/// True if the pictures agree. If not, `name`.actual.png, `name`.expected.png and `name`.heat.png are left in
/// outputDir(), and the message says how many texels differ, by how much, and where the pictures are.
testing::AssertionResult imagesMatch(const Image& actual, const Image& expected, const std::string& name,
                                     const ImageTolerance& tolerance = {});

/// The same against tests/golden/`name`.png. With GLINT_UPDATE_GOLDEN=1 in the environment the picture is written there
/// instead, and the test passes.
testing::AssertionResult matchesGolden(const Image& actual, const std::string& name,
                                       const ImageTolerance& tolerance = {});

}  // namespace glint::test
