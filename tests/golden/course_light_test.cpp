// The second half of the ray-tracing course: stored pictures, the two forms of each against one another, and what has a
// closed form, surroundings and motion, against float64.

#include "25_environment/environment.h"
#include "27_cutout/holes.h"
#include "29_motion/motion.h"
#include "golden/render.h"
#include "support/course_reference.h"
#include "support/image_compare.h"

#include <glint/geometry/primitives.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace glint::test {

namespace {

struct FormCase {
    const char* name;  ///< of the stored picture
    const char* program;
    const char* arguments;
    uint32_t golden;  ///< pixels that may differ from the stored picture, of 96 x 54
    uint32_t forms;   ///< pixels that may differ between pipeline and queries
};

void PrintTo(const FormCase& form, std::ostream* stream) { *stream << form.name; }

class CourseForms : public ::testing::TestWithParam<FormCase> {};

/// Rays of the camera, in float64.
struct Eye {
    Eye(float time, uint32_t width_, uint32_t height_)
        : camera(CourseStage::camera(time, static_cast<float>(width_) / static_cast<float>(height_)).parameters()),
          size(width_, height_) {}
    Vector3d origin() const { return Vector3d(Vector3f(camera.position)); }
    Vector3d direction(uint32_t x, uint32_t y) const {
        const Vector2d place = (Vector2d(x, y) + 0.5) / size;
        return glm::normalize(Vector3d(Vector3f(camera.ray_corner)) + Vector3d(Vector3f(camera.ray_x)) * place.x +
                              Vector3d(Vector3f(camera.ray_y)) * place.y);
    }
    CameraParameters camera;
    Vector2d size;
};

}  // namespace

// Of the pixels one or two in a hundred are edges for float64 (course_reference_test.cpp), which another device may put
// on either side. Glass and mirrors multiply what rounding moves a ray by with each of their surfaces, and light that
// is gathered, or dithered, changes with every edge of the floor's rays: those have more.
TEST_P(CourseForms, AgreeWithEachOtherAndTheStoredPicture) {
    const FormCase& form = GetParam();
    const TempDir folder;
    const std::string arguments = std::string("--size 96x54 ") + form.arguments;
    const Expected<Image> pipeline = renderExample(form.program, arguments + " --tracing driver", folder);
    const Expected<Image> query = renderExample(form.program, arguments + " --query", folder);
    ASSERT_TRUE(pipeline && query);
    std::printf("%llu pixels differ between the forms\n",
                static_cast<unsigned long long>(compareImages(*pipeline, *query, 1.5f / 255.0f).differing));
    EXPECT_TRUE(matchesGolden(*pipeline, form.name, {.texels = form.golden}));
    EXPECT_TRUE(matchesGolden(*query, form.name, {.texels = form.golden}));
    EXPECT_TRUE(imagesMatch(*pipeline, *query, std::string(form.name) + "_query", {.texels = form.forms}));
}

INSTANTIATE_TEST_SUITE_P(
    Examples, CourseForms,
    ::testing::Values(FormCase{"25_environment", "25_environment", "--environment sky --samples 8", 50, 26},
                      FormCase{"26_procedural", "26_procedural", "", 100, 52},
                      FormCase{"27_cutout", "27_cutout", "", 50, 26},
                      FormCase{"27_cutout_stochastic", "27_cutout", "--stochastic --opacity 0.7 --samples 4", 50, 26},
                      FormCase{"28_lenses_pinhole", "28_lenses", "--lens pinhole", 50, 26},
                      FormCase{"28_lenses_fisheye", "28_lenses", "--lens fisheye", 50, 26},
                      FormCase{"28_lenses_spherical", "28_lenses", "--lens spherical", 50, 26},
                      FormCase{"29_motion", "29_motion", "--slices 8", 50, 26},
                      FormCase{"29_motion_rolling", "29_motion", "--slices 24 --rolling 0.8 --time 0.3", 50, 26}),
    [](const ::testing::TestParamInfo<FormCase>& form) { return std::string(form.param.name); });

// Where the camera sees the sky: the picture's texels, weighted in float64. Places may be off by 2^-12 of the picture,
// which Vulkan allows arcs of tangents, and by the 1/256 of a texel that it asks of a filter's weights.
TEST(CourseSurroundings, AreThoseOfThePicture) {
    constexpr uint32_t width = 96, height = 54;
    // Every texel differs from its neighbours, so that none can stand for another.
    const TempDir folder;
    const std::filesystem::path file = folder / "noise.exr";
    Expected<Image> noise = Image::create(FormatRGBAf16, 128, 64);
    ASSERT_TRUE(noise);
    Random random(3);
    for (uint32_t y = 0; y < noise->height(); y++)
        for (uint32_t x = 0; x < noise->width(); x++)
            noise->store(x, y, Vector4d(random.uniform(), random.uniform(), random.uniform(), 1.0));
    ASSERT_TRUE(noise->save(file));
    const Expected<Image> environment = loadEnvironment(file);
    const Expected<Image> picture = renderExample(
        "25_environment", "--size 96x54 --samples 1 --query --time 2 --environment '" + file.string() + "'", folder);
    const Expected<CourseStage> stage = CourseStage::load({});
    ASSERT_TRUE(picture && environment && stage);
    const CourseReference reference(*stage, CourseShading::Normals, 2.0f, width, height);
    const Eye eye(2.0f, width, height);

    const Vector2d size(environment->width(), environment->height());
    const auto texel = [&](double x, double y) {
        const double column = x - size.x * std::floor(x / size.x);
        const double row = std::clamp(y, 0.0, size.y - 1.0);
        return Vector3d(Vector3f(environment->load(static_cast<uint32_t>(column), static_cast<uint32_t>(row))));
    };
    const auto bilinear = [&](const Vector2d& place) {
        const Vector2d at = place * size - 0.5, low = glm::floor(at), weight = at - low;
        return glm::mix(glm::mix(texel(low.x, low.y), texel(low.x + 1, low.y), weight.x),
                        glm::mix(texel(low.x, low.y + 1), texel(low.x + 1, low.y + 1), weight.x), weight.y);
    };
    const auto shown = [](double value) {
        value = 1.0 - std::exp(-value);
        return value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1.0 / 2.4) - 0.055;
    };
    constexpr double pi64 = 3.14159265358979323846;
    uint32_t compared = 0;
    double largest = 0.0;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            const CourseReference::Pixel pixel = reference.pixel(x, y);
            if (!pixel.is_miss || pixel.isEdge()) continue;
            compared++;
            const Vector3d way = eye.direction(x, y);
            const Vector2d place(0.5 - std::atan2(way.y, way.x) / (2.0 * pi64),
                                 0.5 - std::atan2(way.z, std::hypot(way.x, way.y)) / pi64);
            Vector3d low(1e300), high(-1e300);
            for (int i = -1; i <= 1; i++)
                for (int k = -1; k <= 1; k++) {
                    const Vector3d color = bilinear(place + Vector2d(i, k) * (0x1p-12 + 1.0 / 256.0 / size));
                    low = glm::min(low, color);
                    high = glm::max(high, color);
                }
            const Vector3d actual(Vector3f(picture->load(x, y)));
            for (int i = 0; i < 3; i++) {
                const double error = std::max(shown(low[i]) - actual[i], actual[i] - shown(high[i]));
                largest = std::max(largest, error);
                // Rounding to 8 bits, for which APIs allow 0.6 steps; float16 in the filter, 2^-11 of up to 1; and the
                // powers and exponentials, below 2^-16.
                EXPECT_LE(error, 0.6 / 255.0 + 0x1p-11 + 0x1p-16) << x << ", " << y;
            }
        }
    std::printf("%u pixels of surroundings, off by at most %.2f steps\n", compared, largest * 255.0);
    EXPECT_GT(compared, width * height / 10);
}

namespace {

double linear(float stored) {
    const auto value = static_cast<double>(stored);
    return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

}  // namespace

// An upright square: where the camera's ray meets it, and what the texture has there, in float64. Where that is half
// within what a filter's weights of 1/256 make of its slope, 1/36 a texel, either is right. Random hits have their
// probability as mean: five standard deviations of 256 samples, and a step of 8 bits.
TEST(CourseCutout, HasItsHolesWhereTheTextureHas) {
    constexpr uint32_t width = 96, height = 54, samples = 256;
    constexpr double opacity = 0.6;
    const TempDir folder;
    const std::filesystem::path file = folder / "square.ply";
    ASSERT_TRUE(createPlane(2.0f).save(file));
    const Expected<CourseStage> stage = CourseStage::load(file);
    const Expected<Image> holes = createHoles();
    ASSERT_TRUE(stage && holes);
    const std::string arguments = "--size 96x54 --query --mesh '" + file.string() + "'";
    const Expected<Image> cut = renderExample("27_cutout", arguments, folder);
    const Expected<Image> absent = renderExample("27_cutout", arguments + " --opacity 0", folder);
    const Expected<Image> mixed =
        renderExample("27_cutout", arguments + " --stochastic --opacity 0.6 --samples 256", folder);
    ASSERT_TRUE(cut && absent && mixed);

    const Eye eye(0.0f, width, height);
    const Matrix4x4d to_object = glm::inverse(Matrix4x4d(stage->transform(CourseStage::object_mesh).matrix()));
    const Vector3d origin(to_object * Vector4d(eye.origin(), 1.0));
    const auto texel = [&](double x, double y) {
        const auto wrap = [](double i) { return static_cast<uint32_t>(i - 256.0 * std::floor(i / 256.0)); };
        return static_cast<double>(holes->load(wrap(x), wrap(y)).x);
    };
    uint32_t there = 0, through = 0, random = 0;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            const Vector3d direction(to_object * Vector4d(eye.direction(x, y), 0.0));
            const Vector3d place = origin - direction * (origin.z / direction.z);
            if (std::max(std::abs(place.x), std::abs(place.y)) > 0.999) continue;
            const Vector2d at = Vector2d(place) * 2.5 * 256.0 - 0.5, low = glm::floor(at), weight = at - low;
            const double alpha =
                glm::mix(glm::mix(texel(low.x, low.y), texel(low.x + 1, low.y), weight.x),
                         glm::mix(texel(low.x, low.y + 1), texel(low.x + 1, low.y + 1), weight.x), weight.y);
            const Vector4f seen = cut->load(x, y), behind = absent->load(x, y);
            // The mesh is orange, the floor grey, the sky blue.
            const bool is_there = seen.x - seen.z > 0.1f;
            if (std::abs(alpha - 0.5) > 2.0 / 36.0 / 256.0 + 1e-3) {
                EXPECT_EQ(is_there, alpha > 0.5) << x << ", " << y;
            }
            (is_there ? there : through)++;
            // Before the sky, which no shadow falls on, and where the texture is full.
            const bool is_sky = behind.z > behind.x + 0.03f;
            if (!is_sky || alpha < 1.0 || !is_there) continue;
            random++;
            const double full = linear(seen.z), empty = linear(behind.z);
            const double share = (linear(mixed->load(x, y).z) - empty) / (full - empty);
            EXPECT_NEAR(share, opacity,
                        5.0 * std::sqrt(opacity * (1.0 - opacity) / samples) + 0.01 / std::abs(full - empty));
        }
    std::printf("%u pixels are there, %u are holes; %u are there at random\n", there, through, random);
    EXPECT_GT(there, 300u);
    EXPECT_GT(through, 100u);
    EXPECT_GT(random, 100u);
}

namespace {

/// For which share of a time each pixel sees a body, and how often that begins or ends.
struct Seen {
    double share = 0.0;
    uint32_t changes = 0;
};

/// Tries `moments` of them from 0 to 1, in float64, with windows as the rolling shutter has them.
std::vector<Seen> seenBodies(const CourseStage& stage, const Motion& motion, uint32_t width, uint32_t height,
                             double rolling, uint32_t moments) {
    const Eye eye(0.0f, width, height);
    const Mesh& mesh = stage.mesh(CourseStage::object_mesh);
    const Mesh target = Motion::target(mesh);
    std::vector<Seen> result(size_t{width} * height);
    std::vector<int> was(result.size(), -1);
    std::vector<uint32_t> tried(result.size());
    for (uint32_t i = 0; i < moments; i++) {
        const double moment = (i + 0.5) / moments;
        Mesh morphed = mesh;
        const float weight = motion.weight(static_cast<float>(moment));
        for (size_t k = 0; k < mesh.positions.size(); k++)
            morphed.positions[k] = glm::mix(mesh.positions[k], target.positions[k], weight);
        std::vector<InstancedReference> bodies;
        for (const Motion::Body body : {Motion::MatrixKeys, Motion::TransformKeys, Motion::Morph}) {
            const Transform3x4 transform = motion.transform(body, static_cast<float>(moment));
            bodies.emplace_back(body == Motion::Morph ? morphed : mesh, std::span(&transform, 1));
        }
        for (uint32_t y = 0; y < height; y++) {
            const double begin = (y + 0.5) / height * rolling;
            if (moment < begin || moment >= begin + 1.0 - rolling) continue;
            for (uint32_t x = 0; x < width; x++) {
                const Vector3d direction = eye.direction(x, y);
                const int sees = std::any_of(bodies.begin(), bodies.end(), [&](const InstancedReference& body) {
                    return body.closestHit(eye.origin(), direction, 1000.0).instance != InstancedReference::none;
                });
                const size_t pixel = size_t{y} * width + x;
                result[pixel].share += sees;
                result[pixel].changes += was[pixel] >= 0 && was[pixel] != sees;
                was[pixel] = sees;
                tried[pixel]++;
            }
        }
    }
    for (size_t i = 0; i < result.size(); i++) result[i].share /= tried[i];
    return result;
}

}  // namespace

// A mean over moments in the middle of equal slices, of something that is there or not: each time that it begins or
// ends between two moments adds half a slice at most. Where the window is not made of whole slices, as the rolling
// shutter's, so do both its ends. The reference has the same error, of its own moments.
TEST(CourseMotion, IsTheMeanOverTime) {
    constexpr uint32_t width = 64, height = 36, moments = 256;
    const TempDir folder;
    const std::filesystem::path file = folder / "box.ply";
    ASSERT_TRUE(createBox({1.0f, 0.7f, 1.6f}).save(file));
    const Expected<CourseStage> stage = CourseStage::load(file);
    ASSERT_TRUE(stage);
    const Motion motion(*stage, 0.25, 0.75);
    for (const double rolling : {0.0, 0.75}) {
        const std::vector<Seen> exact = seenBodies(*stage, motion, width, height, rolling, moments);
        for (const uint32_t slices : {8u, 32u})
            for (const char* form : {" --tracing driver", " --query"}) {
                if (slices == 8 && std::string_view(form) != " --query") continue;
                const std::string arguments = "--size 64x36 --matte --time 0.25 --shutter 0.5 --mesh '" +
                                              file.string() + "' --slices " + std::to_string(slices) + " --rolling " +
                                              std::to_string(rolling) + form;
                const Expected<Image> picture = renderExample("29_motion", arguments, folder);
                ASSERT_TRUE(picture);
                const double window = 1.0 - rolling;
                double largest = 0.0;
                uint32_t wrong = 0, blurred = 0;
                for (uint32_t y = 0; y < height; y++)
                    for (uint32_t x = 0; x < width; x++) {
                        const Seen& seen = exact[size_t{y} * width + x];
                        const double error = std::abs(static_cast<double>(picture->load(x, y).x) - seen.share);
                        const double ends = seen.changes + (rolling > 0.0 ? 2.0 : 0.0);
                        const double bound =
                            ends * 0.5 / window * (1.0 / slices + 1.0 / moments) + 0.6 / 255.0 + 0x1p-20;
                        largest = std::max(largest, error);
                        blurred += seen.share > 0.02 && seen.share < 0.98;
                        wrong += error > bound;
                    }
                std::printf("rolling %.2f, %2u slices%s: off by at most %.4f, %u pixels are blurred\n", rolling, slices,
                            form, largest, blurred);
                // Moments at which float32 sees an edge on the other side than float64: one a pixel, and few pixels.
                EXPECT_LE(wrong, 2u);
                EXPECT_GT(blurred, width * height / 20u);
            }
    }
}

}  // namespace glint::test
