// The float64 pictures of splats that renderers are held to, against closed forms.

#include "support/reference.h"
#include "support/splat_reference.h"
#include "support/splat_scenes.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace glint::test {

namespace {

constexpr double exact = 1e-12;
const Vector4f unturned = {0, 0, 0, 1};

/// At the origin, along +Y, with Z up.
Camera frontal(float fov = 60.0f, float aspect = 1.0f) {
    return Camera().lookAt({0, 0, 0}, {0, 1, 0}).perspective(fov, aspect);
}

/// Pixels for a unit of size at a depth of 1, along y.
double focalOf(const Camera& camera, uint32_t height) {
    return 0.5 * height * static_cast<double>(camera.parameters().projection[1][1]);
}

void expectNear(const Vector3d& actual, const Vector3d& expected, double error) {
    for (int k = 0; k < 3; k++) EXPECT_NEAR(actual[k], expected[k], error) << "channel " << k;
}

SplatPicture render(const Splats& splats, const Camera& camera, uint32_t width, uint32_t height,
                    const SplatSettings& settings = {}) {
    const SplatInstance instance = {&splats};
    return renderSplats(camera, width, height, {&instance, 1}, settings);
}

}  // namespace

TEST(SplatReferenceTest, ABallAheadIsRound) {
    const Camera camera = frontal();
    Splats splats;
    const Vector3f color = {0.25f, 0.5f, 1};
    addSplat(splats, {0, 2, 0}, Vector3f(0.125f), unturned, 0.75f, color);
    const SplatPicture picture = render(splats, camera, 32, 32);
    const double focal = focalOf(camera, 32);
    const double variance = std::pow(focal * 0.125 / 2.0, 2.0) + static_cast<double>(0.3f);
    for (const auto& [x, y] : {std::pair(16, 16), std::pair(3, 20), std::pair(22, 12)}) {
        const double distance2 = std::pow(x + 0.5 - 16.0, 2.0) + std::pow(y + 0.5 - 16.0, 2.0);
        const double alpha = 0.75 * std::exp(-0.5 * distance2 / variance);
        const size_t at = static_cast<size_t>(y) * 32 + static_cast<size_t>(x);
        // The color passes through float32 coefficients.
        expectNear(picture.color[at], alpha * Vector3d(color), 2e-7);
        EXPECT_NEAR(picture.transmittance[at], 1.0 - alpha, exact);
        EXPECT_NEAR(picture.depth[at], 2.0, exact);
    }
}

TEST(SplatReferenceTest, PlacesAreThoseOfTheCamerasRays) {
    const Camera camera = Camera().lookAt({1, -3, 2}, {0.2f, 0.1f, 0.4f}).perspective(50.0f, 1.5f);
    const CameraParameters parameters = camera.parameters();
    const Vector2d size(90, 60);
    Random random(1);
    for (int i = 0; i < 20; i++) {
        const Vector2d pixel(random.uniform(0, size.x), random.uniform(0, size.y));
        const double depth = random.uniform(1, 5);
        const Vector3d ray = Vector3d(parameters.ray_corner) + Vector3d(parameters.ray_x) * pixel.x / size.x +
                             Vector3d(parameters.ray_y) * pixel.y / size.y;
        Splats splats;
        addSplat(splats, Vector3f(Vector3d(camera.position()) + ray * depth), Vector3f(0.1f), unturned, 1, {1, 1, 1});
        const auto splat = projectSplat({&splats}, 0, parameters, 90, 60);
        ASSERT_TRUE(splat);
        // The camera's vectors are float32, u = 2^-24 = 6e-8: 8 roundings of lengths up to 5, over a depth of 1 and
        // more, times 64 pixels.
        EXPECT_NEAR(splat->centre.x, pixel.x, 64 * 8 * 5 * 0x1p-24);
        EXPECT_NEAR(splat->centre.y, pixel.y, 64 * 8 * 5 * 0x1p-24);
        EXPECT_NEAR(splat->depth, depth, 8 * 5 * 0x1p-24);
    }
}

TEST(SplatReferenceTest, CovarianceIsThatOfTheDerivative) {
    const Camera camera = Camera().lookAt({1, -3, 2}, {0, 0, 0}).perspective(70.0f, 1.5f);
    Matrix4x4f transform = translate({0.1f, 0.2f, -0.1f}) * rotateX(20.0f) * scale({1.0f, -2.0f, 0.5f});
    transform[1][0] += 0.3f;
    Random random(2);
    SplatSettings settings;
    settings.low_pass = 0.0f;
    for (int i = 0; i < 20; i++) {
        Splats splats;
        const Vector3f place(Vector3d(random.uniform(-0.6, 0.6), random.uniform(-0.5, 0.5), random.uniform(-1, 1)));
        const glm::dquat turn = glm::angleAxis(random.uniform(0, 3), random.direction());
        const Vector3d scales(0.3, 0.1, 0.05);
        // 1 % longer than 1: rotations are those of the quaternion's direction.
        const Vector4d rotation = 1.01 * Vector4d(turn.x, turn.y, turn.z, turn.w);
        addSplat(splats, place, Vector3f(scales), Vector4f(rotation), 1, {1, 1, 1});
        const auto splat = projectSplat({&splats, transform}, 0, camera.parameters(), 90, 60, settings);
        ASSERT_TRUE(splat);

        // Moves along the splat's axes, by central differences of the camera's clip space.
        const Matrix4x4d to_clip = Matrix4x4d(camera.projection()) * Matrix4x4d(camera.view()) * Matrix4x4d(transform);
        const auto pixelOf = [&](const Vector3d& p) {
            const Vector4d clip = to_clip * Vector4d(p, 1.0);
            return Vector2d(45.0 * (1.0 + clip.x / clip.w), 30.0 * (1.0 - clip.y / clip.w));
        };
        double a = 0, b = 0, c = 0;
        for (int k = 0; k < 3; k++) {
            Vector3d axis(0.0);
            axis[k] = 1.0;
            axis = turn * axis;
            constexpr double step = 1e-5;
            const Vector2d move = (pixelOf(Vector3d(place) + axis * step) - pixelOf(Vector3d(place) - axis * step)) *
                                  (scales[k] / (2 * step));
            a += move.x * move.x;
            b += move.x * move.y;
            c += move.y * move.y;
        }
        // Errors of the difference: step^2 / 6 of third derivatives, which are about 60 here; and float32 quaternions
        // and scales.
        const double error = 4e-6 * (a + c);
        EXPECT_NEAR(splat->a, a, error);
        EXPECT_NEAR(splat->c, c, error);
        EXPECT_NEAR(splat->shear * splat->a, b, error);
        // One over the variance of y given x.
        EXPECT_NEAR(1.0 / splat->scale, c - b * b / a, error);
    }
}

TEST(SplatReferenceTest, TheNearerOneCoversTheOther) {
    Splats splats;
    const Vector3f red = {1, 0, 0}, blue = {0, 0, 0.5f};
    addSplat(splats, {0, 3, 0}, Vector3f(0.5f), unturned, 0.5f, blue);
    addSplat(splats, {0, 2, 0}, Vector3f(0.5f), unturned, 0.75f, red);
    // The centre of the only pixel is on the axis.
    const SplatPicture picture = render(splats, frontal(), 1, 1);
    expectNear(picture.color[0], {0.75, 0, 0.25 * 0.5 * 0.5}, 2e-7);
    EXPECT_NEAR(picture.transmittance[0], 0.125, exact);
    EXPECT_NEAR(picture.depth[0], (0.75 * 2 + 0.125 * 3) / 0.875, exact);

    // Equal depths: the first of the first instance first.
    splats.positions[0].y = 2;
    expectNear(render(splats, frontal(), 1, 1).color[0], {0.5 * 0.75, 0, 0.25}, 2e-7);
    const std::array<SplatInstance, 2> both = {SplatInstance{&splats}, {&splats}};
    expectNear(renderSplats(frontal(), 1, 1, both).color[0], {0.375 * (1 + 0.125), 0, 0.25 * (1 + 0.125)}, 2e-7);
}

TEST(SplatReferenceTest, PixelsCanHaveAnOrderOfTheirOwn) {
    // Two discs that cross like an X seen from above: each is in front on one side.
    Splats splats;
    const auto turned = [](double degrees) {
        const glm::dquat q = glm::angleAxis(glm::radians(degrees), Vector3d(0, 0, 1));
        return Vector4f(Vector4d(q.x, q.y, q.z, q.w));
    };
    addSplat(splats, {0, 2, 0}, {1, 0, 1}, turned(40), 0.9f, {1, 0, 0});
    addSplat(splats, {0, 2, 0}, {1, 0, 1}, turned(-40), 0.9f, {0, 0, 1});
    const Camera camera = frontal();
    // Where the rays meet the planes of the discs: along y = 2 + x tan(angle).
    for (const double x : {1.5, 10.5, 25.0}) {
        const double ray = (x - 16.0) / focalOf(camera, 32);
        for (const size_t i : {0u, 1u}) {
            const double tangent = std::tan(glm::radians(i == 0 ? 40.0 : -40.0));
            // The quaternions are float32.
            EXPECT_NEAR(splatDepthAlong({&splats}, i, camera.parameters(), 32, 32, {x, 7.5}),
                        2.0 / (1.0 - tangent * ray), 4e-6);
        }
    }
    SplatSettings settings;
    settings.order = SplatOrder::PerPixel;
    const SplatPicture picture = render(splats, camera, 32, 32, settings);
    const SplatPicture centres = render(splats, camera, 32, 32);
    for (const size_t x : {12u, 19u}) {
        const size_t at = 16 * 32 + x;
        const auto first = *projectSplat({&splats}, 0, camera.parameters(), 32, 32);
        const double alpha = first.opacity * std::exp(first.power(Vector2d(x + 0.5, 16.5) - first.centre));
        // Mirrored, so both have this alpha; the red one goes away to the right.
        const Vector3d expected =
            x > 16 ? Vector3d(alpha * (1 - alpha), 0, alpha) : Vector3d(alpha, 0, alpha * (1 - alpha));
        expectNear(picture.color[at], expected, 2e-6);
        expectNear(centres.color[at], {alpha, 0, alpha * (1 - alpha)}, 2e-6);
    }
}

TEST(SplatReferenceTest, DepthAlongARayIsWhereTheWeightIsGreatest) {
    const SplatScene scene = surfaceScene(40, 0, 64, 48);
    const CameraParameters parameters = scene.camera.parameters();
    const Matrix4x4f transform = translate({0.1f, 0, 0}) * scale({1, 1.5f, -0.7f});
    const Matrix4x4d to_world(transform);
    for (size_t i = 0; i < scene.splats.size(); i += 7) {
        const Vector2d pixel(20.0 + static_cast<double>(i), 25.0);
        const double depth = splatDepthAlong({&scene.splats, transform}, i, parameters, 64, 48, pixel);
        const Vector3d ray = Vector3d(parameters.ray_corner) + Vector3d(parameters.ray_x) * pixel.x / 64.0 +
                             Vector3d(parameters.ray_y) * pixel.y / 48.0;
        const auto powerAt = [&](double t) {
            const Vector3d world = Vector3d(parameters.position) + ray * t;
            const Vector3d p(glm::inverse(to_world) * Vector4d(world, 1.0));
            const Vector4d q(scene.splats.rotations[i]);
            const Vector3d own =
                glm::inverse(glm::dquat(q.w, q.x, q.y, q.z)) * (p - Vector3d(scene.splats.positions[i]));
            const Vector3d unit = own / Vector3d(scene.splats.scales[i]);
            return -0.5 * glm::dot(unit, unit);
        };
        // A parabola: nothing but its vertex has the same on both sides. Its slope there may be as large as float32's
        // rounding of the rays makes it, 1e-6 of the curvature.
        const double curvature = powerAt(depth + 1) - 2 * powerAt(depth) + powerAt(depth - 1);
        EXPECT_LT(curvature, 0.0);
        EXPECT_NEAR((powerAt(depth + 1) - powerAt(depth - 1)) / (2 * curvature), 0.0, 4e-6 * std::abs(depth)) << i;
    }
}

TEST(SplatReferenceTest, AntialiasedSplatsKeepTheirLight) {
    // Mip-Splatting: what the low-pass spreads it also dims, so alpha's integral is what it is without.
    SplatSettings settings;
    settings.is_antialiased = true;
    const Camera camera = frontal();
    for (const float size : {0.01f, 0.05f, 0.2f}) {
        Splats splats;
        addSplat(splats, {0.1f, 2, 0.05f}, Vector3f(size, size, size * 0.5f), unturned, 0.8f, {1, 1, 1});
        double sum = 0.0;
        for (const double each : render(splats, camera, 64, 64, settings).transmittance) sum += 1.0 - each;
        SplatSettings plain;
        plain.low_pass = 0.0f;
        const auto splat = projectSplat({&splats}, 0, camera.parameters(), 64, 64, plain);
        // Area of the ellipse: the square root of the determinant, a / scale. A sum over pixels of a Gaussian of
        // variance 0.3 and more is its integral but for 2 exp(-2 pi^2 0.3) = 0.5 % for either axis.
        const double integral = 0.8 * 2.0 * glm::pi<double>() * std::sqrt(splat->a / splat->scale);
        EXPECT_NEAR(sum / integral, 1.0, 0.012) << size;
    }
}

TEST(SplatReferenceTest, CutOffsLeaveOutWhatTheySay) {
    Splats splats;
    addSplat(splats, {0, 2, 0}, Vector3f(0.5f), unturned, 0.5f, {1, 0, 0});
    addSplat(splats, {0, 3, 0}, Vector3f(0.5f), unturned, 0.25f, {0, 1, 0});
    addSplat(splats, {0, 4, 0}, Vector3f(0.5f), unturned, 0.5f, {0, 0, 1});
    SplatSettings settings;
    settings.alpha_cut = 0.3f;
    expectNear(render(splats, frontal(), 1, 1, settings).color[0], {0.5, 0, 0.25}, 2e-7);
    settings.alpha_cut = 0.25f;
    expectNear(render(splats, frontal(), 1, 1, settings).color[0], {0.5, 0.125, 0.1875}, 2e-7);
    settings.alpha_cut = 0.0f;
    settings.transmittance_stop = 0.4f;
    expectNear(render(splats, frontal(), 1, 1, settings).color[0], {0.5, 0.125, 0}, 2e-7);
    settings.near = 2.5f;
    expectNear(render(splats, frontal(), 1, 1, settings).color[0], {0, 0.25, 0.375}, 2e-7);
}

TEST(SplatReferenceTest, NothingIsLostInTiles) {
    // Every splat in every pixel, in order.
    SplatScene scene = surfaceScene(300, 2, 53, 37);
    for (const SplatScene& hard : {needleScene(5, 5000.0f, 53, 37), scene}) {
        const SplatInstance instance = {&hard.splats};
        std::vector<ProjectedSplat> splats;
        for (size_t i = 0; i < hard.splats.size(); i++)
            if (const auto splat = projectSplat(instance, i, hard.camera.parameters(), 53, 37))
                splats.push_back(*splat);
        std::stable_sort(splats.begin(), splats.end(),
                         [](const ProjectedSplat& a, const ProjectedSplat& b) { return a.depth < b.depth; });
        double largest_color = 0.0;
        SplatPicture expected = {53, 37, std::vector<Vector3d>(53 * 37), {}, {}};
        for (size_t at = 0; at < expected.color.size(); at++) {
            double transmittance = 1.0;
            for (const ProjectedSplat& splat : splats) {
                const double alpha = splat.opacity * std::exp(splat.power(expected.place(at) - splat.centre));
                expected.color[at] += transmittance * alpha * splat.color;
                transmittance *= 1.0 - alpha;
                largest_color = std::max({largest_color, splat.color.x, splat.color.y, splat.color.z});
            }
        }
        EXPECT_LT(comparePictures(render(hard.splats, hard.camera, 53, 37), expected).largest, 1e-12 * largest_color);
    }
}

TEST(SplatReferenceTest, HarmonicsAreThoseOfThePaper) {
    // Seen from the origin along a direction, each alone.
    const auto basis = [](uint32_t k, const Vector3d& direction) {
        Splats splats;
        splats.degree = 3;
        addSplat(splats, Vector3f(direction * 4.0), Vector3f(0.1f), unturned, 1, {0.5f, 0.5f, 0.5f});
        splats.harmonics[k] = Vector3f(0.125f);
        const Camera camera = Camera().lookAt({0, 0, 0}, Vector3f(direction)).perspective(60, 1);
        return (projectSplat({&splats}, 0, camera.parameters(), 8, 8)->color.x - 0.5) / 0.125;
    };
    // The paper's constants have 7 to 16 digits; positions are float32.
    const double x = 0.48, y = -0.6, z = 0.64, error = 1e-6;
    const Vector3d d(x, y, z);
    EXPECT_NEAR(basis(0, d), 0.28209479, error);
    EXPECT_NEAR(basis(1, d), -0.48860251 * y, error);
    EXPECT_NEAR(basis(2, d), 0.48860251 * z, error);
    EXPECT_NEAR(basis(3, d), -0.48860251 * x, error);
    EXPECT_NEAR(basis(4, d), 1.09254843 * x * y, error);
    EXPECT_NEAR(basis(5, d), -1.09254843 * y * z, error);
    EXPECT_NEAR(basis(6, d), 0.31539157 * (2 * z * z - x * x - y * y), error);
    EXPECT_NEAR(basis(7, d), -1.09254843 * x * z, error);
    EXPECT_NEAR(basis(8, d), 0.54627422 * (x * x - y * y), error);
    EXPECT_NEAR(basis(9, d), -0.59004359 * y * (3 * x * x - y * y), error);
    EXPECT_NEAR(basis(10, d), 2.89061144 * x * y * z, error);
    EXPECT_NEAR(basis(11, d), -0.45704579 * y * (4 * z * z - x * x - y * y), error);
    EXPECT_NEAR(basis(12, d), 0.37317633 * z * (2 * z * z - 3 * x * x - 3 * y * y), error);
    EXPECT_NEAR(basis(13, d), -0.45704579 * x * (4 * z * z - x * x - y * y), error);
    EXPECT_NEAR(basis(14, d), 1.44530572 * z * (x * x - y * y), error);
    EXPECT_NEAR(basis(15, d), -0.59004359 * x * (x * x - 3 * y * y), error);

    // A degree that is not asked for, and colors below 0.
    Splats splats;
    splats.degree = 1;
    addSplat(splats, {0, 2, 0}, Vector3f(1), unturned, 1, {0.5f, 0.25f, 0});
    splats.harmonics[1] = Vector3f(1, 1, 1);
    SplatSettings settings;
    const auto color = [&] { return projectSplat({&splats}, 0, frontal().parameters(), 8, 8, settings)->color; };
    expectNear(color(), {0.5 - 0.48860251, 0, 0}, error);
    settings.max_degree = 0;
    expectNear(color(), {0.5, 0.25, 0}, error);
}

TEST(SplatReferenceTest, HarmonicsTurnWithTheInstance) {
    Splats splats;
    splats.degree = 3;
    addSplat(splats, {0.3f, 0.1f, 0.2f}, {0.2f, 0.1f, 0.05f}, unturned, 0.9f, {0.5f, 0.5f, 0.5f});
    Random random(5);
    for (uint32_t k = 1; k < 16; k++) splats.harmonics[k] = Vector3f(random.direction() * 0.1);
    const Camera camera = Camera().lookAt({1, -3, 2}, {0, 0, 0}).perspective(50, 1);
    const SplatPicture expected = render(splats, camera, 32, 32);

    // The same seen after everything was turned by 90 degrees, which float32 does exactly but for the sine's rounding.
    const Matrix4x4f turn = rotateZ(90.0f);
    const Camera turned = Camera().lookAt(transformPoint(turn, {1, -3, 2}), {0, 0, 0}).perspective(50, 1);
    const SplatInstance instance = {&splats, turn};
    EXPECT_LT(comparePictures(renderSplats(turned, 32, 32, {&instance, 1}), expected).largest, 1e-5);
}

TEST(SplatReferenceTest, DegenerateSplatsAreFinite) {
    for (const SplatScene& scene : hardSplatScenes()) {
        if (scene.splats.size() > 20000) continue;  // for the time it takes
        SCOPED_TRACE(scene.name);
        const SplatPicture picture = render(scene.splats, scene.camera, scene.width / 2, scene.height / 2);
        double seen = 0.0;
        for (size_t i = 0; i < picture.color.size(); i++) {
            const Vector3d& color = picture.color[i];
            ASSERT_TRUE(std::isfinite(color.x + color.y + color.z));
            ASSERT_GE(std::min({color.x, color.y, color.z}), 0.0);
            ASSERT_GE(picture.transmittance[i], 0.0);
            ASSERT_LE(picture.transmittance[i], 1.0);
            seen += 1.0 - picture.transmittance[i];
        }
        // Something is to be seen.
        EXPECT_GT(seen / static_cast<double>(picture.color.size()), 0.01);
    }
    // A point, without a low-pass, has no area.
    Splats splats;
    addSplat(splats, {0, 2, 0}, Vector3f(0), unturned, 1, {1, 1, 1});
    SplatSettings settings;
    settings.low_pass = 0.0f;
    EXPECT_FALSE(projectSplat({&splats}, 0, frontal().parameters(), 8, 8, settings));
    EXPECT_EQ(render(splats, frontal(), 8, 8, settings).transmittance[0], 1.0);
}

TEST(SplatReferenceTest, PicturesAreCompared) {
    SplatPicture a = {2, 1, {{0, 0, 0}, {0.5, 0, 0}}, {}, {}};
    SplatPicture b = a;
    EXPECT_EQ(comparePictures(a, b).psnr(), 999.0);
    b.color[1].x = 0.5 + 0.01 * std::sqrt(6.0);
    EXPECT_NEAR(comparePictures(a, b).psnr(), 40.0, 1e-9);
    EXPECT_EQ(comparePictures(a, b).above, 1u);
    b.color[0].y = NAN;
    EXPECT_EQ(comparePictures(b, a).largest, std::numeric_limits<double>::infinity());
    EXPECT_EQ(comparePictures(b, a).above, 2u);
}

}  // namespace glint::test
