// The pictures of 05_hello_tracing against a float64 rendering of its scene.

#include "common/instanced_scene.h"
#include "golden/render.h"
#include "support/image_compare.h"
#include "support/instanced_reference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace glint::test {

namespace {

constexpr uint32_t width = 160, height = 90;
constexpr double t_max = 1000.0;

/// How far float32 may move a ray sideways where it meets a surface, in units of |origin| + t. With u = 2^-24:
/// - the direction is a sum of three vectors of lengths 1.54, 2.05 and 1.15, two of them scaled by a quotient good to
///   2.5 ulp: 9u of 4.75 in all, brought to unit length with 2u more: 45u t;
/// - the ray is moved to object space by an inverse that was computed in float32, 12u, and a product, 4u, of an origin
///   and a translation, which is at most |origin| + t + 2, and of a direction: 32u |origin| + 32u t;
/// - the triangle's test takes differences and products of numbers of up to t: 16u t.
/// Together less than 96u (|origin| + t).
constexpr double ray_error = 0x1p-17;

/// Rounding to 8 bits, for which APIs allow 0.6 steps, and the arithmetic of the shading: Vulkan asks of a cosine an
/// absolute error of 2^-11, which colours have 0.4 of; everything else (a power of 16 of what is good to 2^-21, unit
/// vectors) is below 2^-14.
constexpr double shade_error = 0.6 / 255.0 + 0.4 * 0x1p-11 + 0x1p-14;

class Renderer {
public:
    Renderer(const InstancedScene& scene, float time)
        : mesh_(scene.mesh()),
          reference_(mesh_, scene.transforms(time)),
          camera_(scene.camera(time, static_cast<float>(width) / height).parameters()),
          split_(static_cast<double>(width) * static_cast<double>(InstancedScene::split(time))) {}

    /// All colours that rays within the error of float32 have in a pixel: an interval for each channel.
    struct Interval {
        Vector3d low = Vector3d(1e300), high = Vector3d(-1e300);
        bool is_miss = false;  ///< the exact ray meets nothing
        void add(const Vector3d& color) {
            low = glm::min(low, color);
            high = glm::max(high, color);
        }
    };
    Interval pixel(uint32_t x, uint32_t y) const {
        const Vector3d origin(camera_.position);
        const Vector2d place((x + 0.5) / width, (y + 0.5) / height);
        const Vector3d direction =
            glm::normalize(Vector3d(Vector4d(camera_.ray_corner)) + Vector3d(Vector4d(camera_.ray_x)) * place.x +
                           Vector3d(Vector4d(camera_.ray_y)) * place.y);
        const bool is_plain = x + 0.5 <= split_;
        const InstancedReference::Hit hit = reference_.closestHit(origin, direction, t_max);
        Interval colors;
        colors.is_miss = hit.instance == InstancedReference::none;
        colors.add(shade(hit, direction, is_plain));

        // Four rays around the exact one. The disc of all that float32 may have taken lies within their square, so that
        // a straight border through the disc has one of them on its other side. A miss is moved as far as a hit of the
        // farthest instance would be.
        const double t = colors.is_miss ? 160.0 : hit.t;
        const double radius = std::sqrt(2.0) * ray_error * (glm::length(origin) + t);
        const Vector3d side = glm::normalize(glm::cross(direction, Vector3d(0.3, 0.5, 0.8)));
        const Vector3d up = glm::cross(side, direction);
        for (const Vector3d& offset : {side, -side, up, -up})
            colors.add(shade(reference_.closestHit(origin + offset * radius, direction, t_max), direction, is_plain));

        // Another instance so close behind that float32 may take it for the nearer one: t is moved by as much as the
        // ray, over the cosine between ray and surface.
        if (!colors.is_miss) {
            const InstancedReference::Hit other = reference_.closestHit(origin, direction, t_max, hit.instance);
            if (other.instance != InstancedReference::none &&
                other.t - hit.t <= radius * (1.0 / cosine(hit, direction) + 1.0 / cosine(other, direction)))
                colors.add(shade(other, direction, is_plain));
        }
        return colors;
    }

private:
    Vector3d normal(const InstancedReference::Hit& hit) const {
        const uint32_t* corners = &mesh_.indices[hit.triangle * size_t{3}];
        const Vector3d object = Vector3d(mesh_.normals[corners[0]]) * (1.0 - hit.barycentrics.x - hit.barycentrics.y) +
                                Vector3d(mesh_.normals[corners[1]]) * hit.barycentrics.x +
                                Vector3d(mesh_.normals[corners[2]]) * hit.barycentrics.y;
        return glm::normalize(object * glm::dmat3(reference_.inverse(hit.instance)));
    }
    double cosine(const InstancedReference::Hit& hit, const Vector3d& direction) const {
        return std::max(std::abs(glm::dot(normal(hit), direction)), 1e-3);
    }
    Vector3d shade(const InstancedReference::Hit& hit, const Vector3d& direction, bool is_plain) const {
        if (hit.instance == InstancedReference::none) return Vector3d(0.25);
        const double diffuse = std::max(-glm::dot(normal(hit), direction), 0.0);
        const double specular = std::pow(std::max(2.0 * diffuse * diffuse - 1.0, 0.0), 16.0);
        Vector3d color(0.75);
        if (!is_plain) {
            const double x = (hit.instance * 157u % 256u) / 256.0;
            constexpr double two_pi = 6.283185307179586;
            const Vector3d phase = Vector3d(x) + Vector3d(0.0, 0.33, 0.67);
            color = 0.6 +
                    0.4 * Vector3d(std::cos(two_pi * phase.x), std::cos(two_pi * phase.y), std::cos(two_pi * phase.z));
        }
        return glm::min(color * diffuse + 0.25 * specular, Vector3d(1.0));
    }

    const Mesh& mesh_;
    InstancedReference reference_;
    CameraParameters camera_;
    double split_;
};

class TracingReference : public ::testing::TestWithParam<float> {};

}  // namespace

TEST(TracingScene, IsTheTutorials) {
    const Expected<InstancedScene> scene = InstancedScene::load({}, false);
    ASSERT_TRUE(scene) << scene.error().text();
    EXPECT_EQ(scene->mesh().triangleCount(), 90112u);
    EXPECT_EQ(scene->mesh().positions.size(), 45056u);
    EXPECT_TRUE(isClosed(scene->mesh()));
    // Refined, the torus is thinner than its cage; it is scaled to the cage's 3.7 x 3.7 x 1.54.
    const Vector3f size = scene->mesh().bounds().size();
    const Matrix4x4f first = scene->transforms(0.0f)[0].matrix();
    const float factor = glm::length(Vector3f(first[0]));
    EXPECT_NEAR(size.x * factor, 3.70f, 0.01f);
    EXPECT_NEAR(size.y * factor, 3.70f, 0.01f);
    EXPECT_NEAR(size.z * factor, 1.54f, 0.01f);

    // Every cell of both layers is taken once; the layers have turned by 8 t degrees against the grid, in opposite
    // directions.
    for (const float time : {0.0f, 3.0f}) {
        const std::vector<Transform3x4> transforms = scene->transforms(time);
        ASSERT_EQ(transforms.size(), 4608u);
        std::vector<uint32_t> taken(4608);
        for (uint32_t i = 0; i < 4608; i++) {
            const uint32_t layer = i / 2304;
            const double angle = (layer ? -8.0 : 8.0) * static_cast<double>(time) * 0.017453292519943295;
            const auto& m = transforms[i].rows;
            const double x = m[3] * std::cos(angle) - m[7] * std::sin(angle);
            const double y = m[3] * std::sin(angle) + m[7] * std::cos(angle);
            EXPECT_NEAR(m[11], layer ? 1.0f : -1.0f, 1e-5f);
            const double column = x / 4.0 + 23.5, row = y / 4.0 + 23.5;
            ASSERT_NEAR(column, std::round(column), 1e-4);
            ASSERT_NEAR(row, std::round(row), 1e-4);
            const auto cell = static_cast<uint32_t>(std::lround(row) * 48 + std::lround(column));
            ASSERT_LT(cell, 2304u);
            taken[layer * 2304 + cell]++;
            // The axis of the torus was turned into the layer.
            EXPECT_NEAR(m[10], 0.0f, 1e-5f);
        }
        EXPECT_EQ(std::count(taken.begin(), taken.end(), 1u), 4608);
    }
}

// At t = 0 the whole picture is plain; at 3 s half of it is coloured and the layers have turned.
TEST_P(TracingReference, AgreesWithFloat64) {
    const float time = GetParam();
    const TempDir folder;
    const std::string arguments = "--size 160x90 --time " + std::to_string(time);
    const Expected<Image> compute = renderExample("05_hello_tracing", arguments, folder);
    const Expected<Image> fragment = renderExample("05_hello_tracing", arguments + " --fragment", folder);
    ASSERT_TRUE(compute && fragment);
    ASSERT_EQ(compute->width(), width);
    ASSERT_EQ(compute->height(), height);

    const Expected<InstancedScene> scene = InstancedScene::load({}, false);
    ASSERT_TRUE(scene) << scene.error().text();
    const Renderer renderer(*scene, time);
    Expected<Image> picture = Image::create(FormatRGBAu8n, width, height);
    ASSERT_TRUE(picture);
    uint32_t edges = 0, misses = 0, unequal = 0, wrong = 0;
    double largest = 0.0;
    std::string first;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            const Renderer::Interval exact = renderer.pixel(x, y);
            picture->store(x, y, Vector4f(Vector3f((exact.low + exact.high) * 0.5), 1.0f));
            misses += exact.is_miss;
            unequal += compute->load(x, y) != fragment->load(x, y);
            const Vector3d range = exact.high - exact.low;
            // More than two steps of 8 bits between rays that float32 cannot tell apart.
            const bool is_edge = std::max({range.x, range.y, range.z}) > 2.0 / 255.0;
            edges += is_edge;
            for (const Image* image : {&*compute, &*fragment}) {
                const Vector3d color(Vector3f(image->load(x, y)));
                const Vector3d outside = glm::max(glm::max(exact.low - color, color - exact.high), Vector3d(0.0));
                const double error = std::max({outside.x, outside.y, outside.z});
                if (!is_edge) largest = std::max(largest, error);
                if (is_edge || error <= shade_error) continue;
                if (wrong++ == 0)
                    first = "(" + std::to_string(x) + ", " + std::to_string(y) + ") by " +
                            std::to_string(error * 255.0) + " steps";
            }
        }
    const std::string name = "05_hello_tracing_float64_" + std::to_string(std::lround(time));
    EXPECT_TRUE(picture->save(outputDir() / (name + ".png")));
    const double pixels = static_cast<double>(width) * height;
    std::printf("time %g: %.2f%% of the pixels are edges, %.1f%% miss, %u differ between compute and fragment; largest "
                "error elsewhere %.3f of %.3f steps\n",
                static_cast<double>(time), edges / pixels * 100.0, misses / pixels * 100.0, unequal, largest * 255.0,
                shade_error * 255.0);
    EXPECT_EQ(wrong, 0u) << first;
    // Borders are one to two pixels in a hundred here; if they were many, nothing would be compared.
    EXPECT_LT(edges, pixels * 0.05);
    EXPECT_GT(misses, pixels * 0.05);
    // The two forms have the same instructions, but a compiler may contract them differently: edges only.
    EXPECT_LE(unequal, edges);
}

INSTANTIATE_TEST_SUITE_P(Times, TracingReference, ::testing::Values(0.0f, 3.0f),
                         [](const auto& time) { return std::to_string(std::lround(time.param)) + "s"; });

// Two levels and boxes against every triangle of every instance.
TEST(InstancedReferenceTest, IsWhatAllTrianglesGive) {
    const Mesh mesh = createTorus(1.0f, 0.4f, 24, 12);
    Random random(5);
    std::vector<Transform3x4> transforms;
    for (int i = 0; i < 12; i++) {
        const auto angle = static_cast<float>(random.uniform(0, 360));
        transforms.emplace_back(translate(Vector3f(random.direction() * 3.0)) * rotateX(angle) * rotateZ(3 * angle) *
                                scale(Vector3f(1.0f, i % 3 ? 1.0f : -0.5f, 1.5f)));
    }
    const InstancedReference reference(mesh, transforms);
    uint32_t hits = 0, differing = 0;
    for (int ray = 0; ray < 500; ray++) {
        const Vector3d origin = random.direction() * 8.0;
        const Vector3d direction = glm::normalize(random.direction() * 3.0 - origin);
        const uint32_t skip = ray % 2 ? InstancedReference::none : static_cast<uint32_t>(random.below(12));
        double t = 100.0;
        for (uint32_t i = 0; i < transforms.size(); i++) {
            if (i == skip) continue;
            const Matrix4x4d& inverse = reference.inverse(i);
            const ReferenceHit hit = closestHit(mesh, Vector3d(inverse * Vector4d(origin, 1.0)),
                                                Vector3d(inverse * Vector4d(direction, 0.0)), 0.0, t);
            if (hit.hit) t = hit.t;
        }
        const InstancedReference::Hit hit = reference.closestHit(origin, direction, 100.0, skip);
        ASSERT_EQ(hit.instance != InstancedReference::none, t < 100.0);
        hits += t < 100.0;
        // Computed from other products: equal but for rounding.
        if (t < 100.0) {
            EXPECT_NEAR(hit.t, t, 1e-9);
            EXPECT_NE(hit.instance, skip);
        }
        differing += hit.t != reference.closestHit(origin, direction, 100.0).t;
    }
    EXPECT_GT(hits, 100u);
    EXPECT_LT(hits, 450u);
    EXPECT_GT(differing, 5u);
}

}  // namespace glint::test
