// 03, 04 and 05 show the same scene by the driver's pipeline, by compute shaders and by rays: each pixel has to show
// the same instance, except within a pixel of an edge.

#include "common/instanced_scene.h"
#include "golden/render.h"
#include "support/image_compare.h"
#include "support/instance_compare.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>

namespace glint::test {

namespace {

constexpr uint32_t width = 320, height = 180;

struct Way {
    const char* program;
    const char* arguments;
    double pixels;  ///< by how much it may move an edge
};

struct Shown {
    InstancePicture instances;
    Image image;
};

Shown show(const Way& way, const std::string& time) {
    const TempDir folder;
    const std::filesystem::path path = folder / "ids.npy";
    const Expected<Image> image = renderExample(
        way.program,
        fmt::format("--size {}x{} --time {} --ids '{}'{}", width, height, time, path.string(), way.arguments), folder);
    EXPECT_TRUE(image);
    const Expected<InstancePicture> picture = InstancePicture::load(path);
    EXPECT_TRUE(picture) << picture.error().text();
    if (!image || !picture) return {};
    EXPECT_EQ(picture->width, width);
    EXPECT_EQ(picture->height, height);
    return {*picture, *image};
}

class InstancesAgree : public ::testing::TestWithParam<const char*> {
protected:
    void SetUp() override {
        time = GetParam();
        const float moment = std::stof(time);
        Expected<InstancedScene> loaded = InstancedScene::load({}, false);
        ASSERT_TRUE(loaded) << loaded.error().text();
        scene = std::move(*loaded);
        judge.emplace(scene->mesh(), scene->transforms(moment),
                      scene->camera(moment, float(width) / height).parameters(), width, height);
        traced = show({"05_hello_tracing", "", 0.0}, time);
        ASSERT_EQ(traced.instances.instances.size(), size_t{width} * height);
    }

    /// Nothing differs from what rays show but within a pixel of an edge.
    void expectTraced(const Way& way, const Shown& shown) {
        SCOPED_TRACE(std::string(way.program) + way.arguments);
        ASSERT_EQ(shown.instances.instances.size(), traced.instances.instances.size());
        const InstanceDifferences found = compareInstances(traced.instances, shown.instances);
        uint32_t unseen = 0;
        for (const auto* pixels : {&found.near_both_pixels, &found.other_pixels})
            for (const Vector2u& at : *pixels)
                unseen += judge->isSeen(shown.instances.at(at.x, at.y), at, 1.0 + way.pixels) ? 0 : 1;
        fmt::print("{}{}, time {}: {} of {} pixels differ, {} near an edge in both pictures, {} in one, {} in neither; "
                   "{} show what no ray within {} pixels meets\n",
                   way.program, way.arguments, time, found.count(), found.pixels, found.near_both, found.near_one,
                   found.elsewhere, unseen, 1.0 + way.pixels);
        EXPECT_EQ(found.elsewhere, 0u);
        // With levels of detail, two tori that cross at a small angle may do so a few pixels further on.
        if (way.pixels == 0.0) { EXPECT_EQ(unseen, 0u); }
    }

    /// Two rasterisers of the same triangles.
    void expectSame(const Shown& a, const Shown& b) {
        const InstanceDifferences found = compareInstances(a.instances, b.instances);
        const ImageDifference colors = compareImages(a.image, b.image, 1.5f / 255.0f);
        fmt::print("time {}: {} instances and {} colours differ between rasterisers\n", time, found.count(),
                   colors.differing);
        // Both round corners to 2^-8 pixel, so that they may disagree about a pixel whose centre is as near to an edge:
        // if one edge, between instances or between clusters of different colours, went through each pixel, along any
        // line, two in 256 of them.
        EXPECT_LE(found.count(), found.pixels / 128);
        EXPECT_LE(colors.differing, found.pixels / 128);
    }

    std::string time;
    std::optional<InstancedScene> scene;
    std::optional<InstanceJudge> judge;
    Shown traced;
};

class InstancesAgreeLong : public InstancesAgree {};

}  // namespace

// The driver's pipeline in both its forms, and the compute rasteriser, at one pixel of error.
TEST_P(InstancesAgree, ExceptWithinAPixelOfAnEdge) {
    const Way ways[] = {{"03_hello_mesh", "", 1.0}, {"03_hello_mesh", " --compute", 1.0}, {"04_hello_raster", "", 1.0}};
    Shown shown[3];
    for (int i = 0; i < 3; i++) {
        shown[i] = show(ways[i], time);
        expectTraced(ways[i], shown[i]);
    }
    expectSame(shown[0], shown[2]);
    expectSame(shown[1], shown[2]);
}

// The full mesh, of which most triangles are smaller than a pixel, and less than one pixel of error.
TEST_P(InstancesAgreeLong, ExceptWithinAPixelOfAnEdge) {
    for (const Way& way :
         {Way{"04_hello_raster", " --pixels 0", 0.0}, Way{"03_hello_mesh", " --pixels 0", 0.0},
          Way{"03_hello_mesh", " --compute --pixels 0", 0.0}, Way{"04_hello_raster", " --pixels 0.25", 0.25}})
        expectTraced(way, show(way, time));
}

INSTANTIATE_TEST_SUITE_P(Times, InstancesAgree, ::testing::Values("3.14159", "8"));
INSTANTIATE_TEST_SUITE_P(Times, InstancesAgreeLong, ::testing::Values("3.14159", "8"));

TEST(InstancesAgreeTest, TellsEdgesFromTheRest) {
    // Two halves, and the same with the border moved, a stray pixel, and an instance that is not there at all.
    const auto halves = [](uint32_t border) {
        InstancePicture picture{.width = 12, .height = 6, .instances = {}};
        for (uint32_t i = 0; i < 72; i++) picture.instances.push_back(i % 12 < border ? 7 : InstancePicture::none);
        return picture;
    };
    const InstancePicture a = halves(4);
    EXPECT_EQ(compareInstances(a, a).count(), 0u);
    EXPECT_EQ(compareInstances(a, a).edge_pixels, 12u);
    const InstanceDifferences moved = compareInstances(a, halves(5));
    EXPECT_EQ(moved.near_both, 6u);
    EXPECT_EQ(moved.count(), 6u);
    // Columns 4 and 7 of eight-wide differences are near the edge in one of the two.
    const InstanceDifferences far = compareInstances(a, halves(8));
    EXPECT_EQ(far.near_both, 0u);
    EXPECT_EQ(far.near_one, 12u);
    EXPECT_EQ(far.elsewhere, 12u);
    InstancePicture stray = a;
    stray.instances[2 * 12 + 9] = 3;
    const InstanceDifferences found = compareInstances(a, stray);
    EXPECT_EQ(found.near_one, 1u);
    EXPECT_EQ(found.count(), 1u);
    ASSERT_EQ(found.other_pixels.size(), 1u);
    EXPECT_EQ(found.other_pixels[0], Vector2u(9, 2));
}

TEST(InstancesAgreeTest, JudgesByRays) {
    const Mesh mesh = createTorus(1.0f, 0.4f, 64, 32);  // around Z
    const Transform3x4 still;
    const Camera camera = Camera().lookAt({0.0f, 0.0f, 5.0f}, {}, {0, 1, 0}).perspective(60.0f, 1.0f);
    const InstanceJudge judge(mesh, std::span(&still, 1), camera.parameters(), 64, 64);
    // From above, at a distance of 5, the hole of radius 0.6 has 32 / tan(30 degrees) * 0.6 / 5 = 6.65 pixels, or 0.03
    // less, as the narrowest that is seen lies deeper.
    EXPECT_EQ(judge.at({32.0, 32.0}), InstancePicture::none);
    EXPECT_EQ(judge.at({32.0 + 11.0, 32.0}), 0u);
    EXPECT_EQ(judge.at({32.0 + 6.4, 32.0}), InstancePicture::none);
    EXPECT_EQ(judge.at({32.0 + 6.8, 32.0}), 0u);
    // The pixel's centre is at (4.5, 0.5) from the middle, so (5.5, 1.5) and (6.375, 2.375) are the farthest places.
    EXPECT_TRUE(judge.isSeen(0, {36, 32}, 1.9));
    EXPECT_FALSE(judge.isSeen(0, {36, 32}, 1.0));
    EXPECT_TRUE(judge.isSeen(InstancePicture::none, {36, 32}, 0.0));
    EXPECT_FALSE(judge.isSeen(3, {36, 32}, 0.5));
}

}  // namespace glint::test
