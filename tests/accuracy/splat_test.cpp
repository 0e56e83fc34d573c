// What SplatRenderer draws, against float64: docs/splatting.md has the model.

#include "support/device_fixture.h"
#include "support/reference.h"
#include "support/splat_device.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace glint::test {

namespace {

using Storage = SplatModel::Storage;

/// Projected colors, which are about 1 at most, are rounded by up to 2^-14 = 6e-5; all else is below that.
constexpr double rounding = 1e-4;

class SplatAccuracyTest : public DeviceTest {
protected:
    /// Expects what is promised of every scene: at least 60 dB against the float64 picture of the same values, and
    /// 45 dB of the default storage against that of the original ones.
    static void expectAccurate(SplatDrawer& drawer, const SplatScene& scene) {
        SCOPED_TRACE(scene.name);
        const SplatSettings settings = drawer.settings();
        const SplatPicture exact = drawer.draw(scene, SplatModel::StorageFloat);
        const PictureError error =
            comparePictures(exact, referenceOf(scene, SplatModel::StorageFloat, settings), rounding);
        EXPECT_GE(error.psnr(), 60.0);
        // A splat whose alpha float32 takes to the other side of the cut changes a pixel by the cut. That is rare, and
        // more than two in one pixel are not to be expected.
        EXPECT_LE(error.above, 2 + scene.width * scene.height / 1000);
        EXPECT_LE(error.largest, 2.0 * static_cast<double>(settings.alpha_cut) + rounding);

        const SplatPicture expected = referenceOf(scene, settings);
        const SplatPicture half = drawer.draw(scene, SplatModel::StorageHalf);
        EXPECT_GE(comparePictures(exact, expected).psnr(), 60.0);
        EXPECT_GE(comparePictures(half, expected).psnr(), 45.0);
        EXPECT_GE(comparePictures(half, referenceOf(scene, SplatModel::StorageHalf, settings)).psnr(), 60.0);
    }
};

/// Depths and transmittances where something is seen.
void expectSameDepths(const SplatPicture& actual, const SplatPicture& expected) {
    uint64_t seen = 0;
    uint64_t differing = 0;
    for (size_t i = 0; i < expected.depth.size(); i++) {
        EXPECT_EQ(std::isinf(actual.depth[i]), std::isinf(expected.depth[i])) << i;
        if (std::isinf(expected.depth[i])) continue;
        seen++;
        // Rounding of some hundred products is far below; what exceeds these is a splat on the other side of the cut.
        differing += std::abs(actual.depth[i] / expected.depth[i] - 1.0) > 1e-4 ||
                     std::abs(actual.transmittance[i] - expected.transmittance[i]) > 1e-4;
    }
    EXPECT_GT(seen, expected.depth.size() / 10);
    EXPECT_LE(differing, seen / 100);
}

}  // namespace

TEST_F(SplatAccuracyTest, Surfaces) {
    SplatDrawer drawer(device);
    for (const uint32_t degree : {0u, 1u, 2u, 3u}) expectAccurate(drawer, surfaceScene(4000, degree, 96, 64));
}

TEST_F(SplatAccuracyTest, AMesh) {
    GLINT_NEED_FEATURE(FeatureComputeTracing);
    SplatDrawer drawer(device);
    expectAccurate(drawer, meshScene(device, 6000, 4, 128, 96));
}

TEST_F(SplatAccuracyTest, HardCases) {
    // Both forms of the passes, whichever the device has by default.
    for (const uint32_t threads : {8u, 64u}) {
        SplatRenderer::Options options;
        options.threads = threads;
        options.tile_width = options.tile_height = 16;
        SplatDrawer drawer(device, options);
        for (const SplatScene& scene : hardSplatScenes()) expectAccurate(drawer, scene);
    }
}

TEST_F(SplatAccuracyTest, ARealScene) {
    GLINT_NEED_SPLATS();
    const Expected<SplatScene> scene = realSplatScene(256, 144);
    ASSERT_THAT(scene, IsOk());
    SplatDrawer drawer(device);
    expectAccurate(drawer, *scene);
}

TEST_F(SplatAccuracyTest, PicturesOfAllShapes) {
    SplatDrawer drawer(device);
    expectAccurate(drawer, spreadScene("1x1", 20, 60.0f, 1, 1));
    expectAccurate(drawer, spreadScene("17x3", 100, 60.0f, 17, 3));
    expectAccurate(drawer, spreadScene("3x17", 100, 20.0f, 3, 17));
    expectAccurate(drawer, spreadScene("8191x5", 3000, 1.0f, 8191, 5));
    expectAccurate(drawer, spreadScene("5x2047", 1000, 100.0f, 5, 2047));
    expectAccurate(drawer, spreadScene("65x63, 170 degrees", 500, 170.0f, 65, 63));
    expectAccurate(drawer, spreadScene("63x65, 1 degree", 500, 1.0f, 63, 65));
}

TEST_F(SplatAccuracyTest, ScenesFarFromTheOrigin) {
    // Places are taken relative to the eye, so nothing is lost but what rounding the positions has lost before.
    SplatScene scene = spreadScene("far", 500, 60.0f, 96, 72);
    const Vector3f offset(30000.0f, -50000.0f, 20000.0f);
    for (Vector3f& position : scene.splats.positions) position += offset;
    scene.camera.lookAt(offset, offset + Vector3f(0, 1, 0));
    SplatDrawer drawer(device);
    expectAccurate(drawer, scene);
}

TEST_F(SplatAccuracyTest, Options) {
    const SplatScene scene = surfaceScene(3000, 3, 80, 60);
    SplatRenderer::Options options;
    const auto expectWithOptions = [&] {
        SplatDrawer drawer(device, std::exchange(options, {}));
        expectAccurate(drawer, scene);
    };
    options.antialiased = true;
    expectWithOptions();
    options.max_degree = 1;
    expectWithOptions();
    options.low_pass = 2.0f;
    options.near = 2.9f;
    expectWithOptions();
    options.alpha_cut = 0.05f;
    options.transmittance_stop = 0.05f;
    expectWithOptions();
}

TEST_F(SplatAccuracyTest, DepthAndTransmittance) {
    const SplatScene scene = surfaceScene(4000, 1, 96, 64);
    SplatDrawer drawer(device);
    expectSameDepths(drawer.draw(scene, SplatModel::StorageFloat), referenceOf(scene, drawer.settings()));
}

TEST_F(SplatAccuracyTest, SeveralModelsInTheWorld) {
    const SplatScene torus = surfaceScene(2000, 3, 96, 64);
    const SplatScene others = spreadScene("others", 200, 60.0f, 96, 64);
    Matrix4x4f sheared = translate({0.3f, 0.2f, 0}) * rotateX(70.0f) * scale({0.8f, -1.1f, 0.4f});
    sheared[0] += 0.2f * sheared[1];
    const std::array transforms = {Matrix4x4f(1.0f), sheared, translate({0, -1.5f, 0}) * rotateZ(30.0f)};
    const std::array scenes = {&torus, &torus, &others};
    std::vector<SplatInstance> expected;
    std::vector<SplatRenderer::Instance> instances;
    for (size_t i = 0; i < 3; i++) {
        expected.push_back({&scenes[i]->splats, transforms[i]});
        instances.push_back({SplatModel(device, scenes[i]->splats, SplatModel::StorageFloat), transforms[i]});
    }
    SplatDrawer drawer(device);
    drawer.draw(torus.camera, 96, 64, instances);
    const SplatPicture reference = renderSplats(torus.camera, 96, 64, expected, drawer.settings());
    EXPECT_GE(comparePictures(drawer.picture(), reference).psnr(), 60.0);
    expectSameDepths(drawer.picture(), reference);
}

TEST_F(SplatAccuracyTest, NeedlesKeepTheirWeights) {
    // White and alone, a splat's color is its weight. Along the needle an error of its direction grows with the
    // distance from its centre, r <= 460 pixels here. With u = 2^-24, rounding turns it by some 16 u in all
    // (quaternion, view, Jacobian, a product each) and moves its centre by 8 u of 512 pixels; a weight's slope is at
    // most exp(-1/2) / sqrt(0.31) = 1.1 a pixel. Together less than 1e-3; what is measured is a quarter of it.
    SplatRenderer::Options options;
    options.alpha_cut = 1e-4f;  // no weight is off by more where it is cut
    SplatDrawer drawer(device, options);
    const SplatScene all = needleScene(24, 5000.0f, 512, 512);
    for (size_t i = 0; i < all.splats.size(); i++) {
        SplatScene scene = {"needle", {}, all.camera, 512, 512};
        addSplat(scene.splats, all.splats.positions[i], all.splats.scales[i], all.splats.rotations[i], 1.0f, {1, 1, 1});
        const SplatPicture expected = referenceOf(scene, drawer.settings());
        const SplatPicture actual = drawer.draw(scene, SplatModel::StorageFloat);
        EXPECT_LE(comparePictures(actual, expected).largest, 1e-3) << "needle " << i;
        // It goes through the whole picture.
        const auto lit = std::count_if(expected.color.begin(), expected.color.end(),
                                       [](const Vector3d& color) { return color.x > 0.5; });
        EXPECT_GT(lit, 300) << "needle " << i;
    }
}

TEST_F(SplatAccuracyTest, TheStopChangesNoPixelByMore) {
    const std::array scenes = {crowdScene(20000, 0.05f), spreadScene("spread", 2000, 60.0f, 64, 48)};
    std::vector<SplatPicture> all;
    SplatRenderer::Options options;
    for (const float stop : {0.0f, 1e-4f, 1.0f / 255.0f, 0.0625f, 0.5f}) {
        options.transmittance_stop = stop;
        SplatDrawer drawer(device, options);
        for (size_t i = 0; i < scenes.size(); i++) {
            SCOPED_TRACE(scenes[i].name + ", " + std::to_string(stop));
            const SplatPicture picture = drawer.draw(scenes[i], SplatModel::StorageFloat);
            if (stop == 0.0f) all.push_back(picture);
            // Colors are at most 1. The same sums up to where they end, so rounding adds next to nothing.
            const double largest = comparePictures(picture, all[i]).largest;
            EXPECT_LE(largest, static_cast<double>(stop) * (1.0 + 1e-5));
            if (stop > 0.01f) { EXPECT_GT(largest, static_cast<double>(stop) * 0.1); }
        }
    }
}

TEST_F(SplatAccuracyTest, TheCutTakesNoMoreThanItsAlphas) {
    // Each of n splats that are left out of a pixel changes it by at most its alpha times the largest color, which is
    // 1: by less than n/255 in all. Half of these are left out everywhere.
    const auto scenes = hardSplatScenes();
    const auto faint =
        std::find_if(scenes.begin(), scenes.end(), [](const SplatScene& s) { return s.name == "faint"; });
    ASSERT_NE(faint, scenes.end());
    const SplatPicture actual = SplatDrawer(device).draw(*faint, SplatModel::StorageFloat);
    const SplatPicture expected = referenceOf(*faint, SplatSettings());
    const CameraParameters camera = faint->camera.parameters();
    std::vector<double> left_out(expected.color.size());
    for (size_t i = 0; i < faint->splats.size(); i++) {
        const auto splat = projectSplat({&faint->splats}, i, camera, faint->width, faint->height);
        ASSERT_TRUE(splat);
        for (size_t at = 0; at < left_out.size(); at++) {
            const double alpha = splat->opacity * std::exp(splat->power(expected.place(at) - splat->centre));
            if (alpha < 1.0 / 255.0) left_out[at] += alpha;
        }
    }
    double largest = 0.0;
    for (size_t at = 0; at < left_out.size(); at++) {
        const Vector3d error = glm::abs(actual.color[at] - expected.color[at]);
        largest = std::max({largest, error.x, error.y, error.z});
        // And those that float32 leaves out.
        EXPECT_LE(std::max({error.x, error.y, error.z}), left_out[at] + 2.0 / 255.0) << at;
    }
    EXPECT_GT(largest, 0.1);
}

TEST_F(SplatAccuracyTest, TilesDoNotShow) {
    // Lists hold whatever reaches a pixel, so the size of the tiles changes nothing but the rounding of offsets, which
    // takes a splat to the other side of the cut now and then. One that is missing along an edge is so in many pixels.
    const std::array scenes = {surfaceScene(4000, 1, 97, 65), spreadScene("spread", 2000, 60.0f, 97, 65),
                               needleScene(18, 5000.0f, 97, 65)};
    std::vector<SplatPicture> first;
    SplatRenderer::Options options;
    for (const auto& [width, height] : {std::pair(16u, 16u), std::pair(8u, 32u), std::pair(32u, 8u)}) {
        options.tile_width = width;
        options.tile_height = height;
        SplatDrawer drawer(device, options);
        for (size_t i = 0; i < scenes.size(); i++) {
            const SplatPicture picture = drawer.draw(scenes[i], SplatModel::StorageFloat);
            if (first.size() == i) first.push_back(picture);
            EXPECT_LE(comparePictures(picture, first[i], rounding).above, picture.color.size() / 1000)
                << scenes[i].name << ", " << width << "x" << height;
        }
    }
}

TEST_F(SplatAccuracyTest, DrawsAreEqualToTheBit) {
    SplatDrawer drawer(device);
    SplatDrawer other(device);
    for (const SplatScene& scene : hardSplatScenes()) {
        if (scene.name != "equal_depths" && scene.name != "crowd") continue;
        const SplatModel model(device, scene.splats);
        drawer.draw(scene, model);
        const Image first = drawer.colors();
        drawer.draw(scene, model);
        EXPECT_EQ(drawer.colors(), first) << scene.name;
        other.draw(scene, SplatModel(device, scene.splats));
        EXPECT_EQ(other.colors(), first) << scene.name;
    }
}

TEST_F(SplatAccuracyTest, OpacityOneHidesAndZeroIsNotThere) {
    Splats splats;
    const Vector4f unturned = {0, 0, 0, 1};
    addSplat(splats, {0, 1, 0}, Vector3f(0.5f), unturned, 0.0f, {0, 0, 1});
    addSplat(splats, {0, 2, 0}, Vector3f(0.5f), unturned, 1.0f, {1, 0, 0});
    addSplat(splats, {0, 3, 0}, Vector3f(0.5f), unturned, 1.0f, {0, 1, 0});
    SplatScene scene = {"opaque", splats, Camera().lookAt({0, 0, 0}, {0, 1, 0}).perspective(60, 1), 1, 1};
    const SplatPicture picture = SplatDrawer(device).draw(scene, SplatModel::StorageFloat);
    // A product and a sum of numbers of about 1.
    EXPECT_NEAR(picture.color[0].x, 1.0, 4 * 0x1p-24);
    EXPECT_NEAR(picture.color[0].y, 0.0, 4 * 0x1p-24);
    EXPECT_EQ(picture.color[0].z, 0.0);
    EXPECT_EQ(picture.transmittance[0], 0.0);
    EXPECT_EQ(picture.depth[0], 2.0);
}

TEST_F(SplatAccuracyTest, FormatsRoundOnce) {
    const SplatScene scene = surfaceScene(2000, 0, 64, 48);
    const SplatPicture expected = SplatDrawer(device).draw(scene, SplatModel::StorageHalf);
    // 8 bits: half a step, for which APIs allow 0.6; float16: half of 2^-10 of numbers below 1, and truncation is
    // allowed.
    for (const auto& [format, error] : {std::pair(FormatRGBAu8n, 0.6 / 255.0), std::pair(FormatRGBAf16, 0x1p-10)}) {
        SplatDrawer drawer(device, {}, format);
        EXPECT_LE(comparePictures(drawer.draw(scene, SplatModel::StorageHalf), expected).largest, error);
    }
}

}  // namespace glint::test
