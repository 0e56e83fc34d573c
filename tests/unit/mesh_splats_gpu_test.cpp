#include "support/device_fixture.h"
#include "support/matchers.h"

#include <glint/geometry/mesh_splats.h>
#include <glint/geometry/primitives.h>
#include <glint/graphics/ray_caster.h>
#include <glint/math/harmonics.h>

#include <gtest/gtest.h>

#include <cmath>

namespace glint::test {

namespace {

using MeshSplats = DeviceTest;

double brightness(const Splats& splats, size_t splat, const Vector3d& direction) {
    const auto y = evaluateHarmonics(direction);
    double value = 0.5;
    for (uint32_t k = 0; k < splats.coefficientCount(); k++)
        value += y[k] * double{splats.harmonics[splat * splats.coefficientCount() + k].y};
    return value;
}

}  // namespace

// A ball of radius 1/2 that touches a floor, under a lamp to the right: its shadow falls to the left, as far as the
// lamp's rays through its outline reach, and beside it only the sky is missed.
TEST_F(MeshSplats, HaveShadowsOfWhatTheCasterSees) {
    GLINT_NEED_FEATURE(FeatureComputeTracing);
    const Mesh floor = createPlane(6.0f, 4);
    const std::vector<Mesh> meshes = {floor, createSphere(0.5f, 4)};
    std::vector<MeshInstance> instances(2);
    instances[1].mesh = 1;
    instances[1].transform = Transform3x4(translate({0.0f, 0.0f, 0.5f}));
    Expected<RayCaster> caster = RayCaster::create(device, meshes, instances);
    ASSERT_THAT(caster, IsOk());

    MeshSplatsOptions options;
    options.count = 3000;
    options.gloss = 0.0f;
    options.light.direction = {1.0f, 0.0f, 1.0f};
    options.light.radius = 1.0f;
    const auto splats =
        splatsFromMesh(floor, options, [&](std::span<const Ray> rays) { return caster->castAny(rays); });
    ASSERT_THAT(splats, IsOk());
    const auto open = splatsFromMesh(floor, options);
    ASSERT_THAT(open, IsOk());
    size_t dark = 0, bright = 0;
    for (size_t i = 0; i < splats->size(); i++) {
        const Vector3f& p = splats->positions[i];
        const double seen = brightness(*splats, i, {0, 0, -1}), unhidden = brightness(*open, i, {0, 0, -1});
        // The distance of the ball's centre from the line to the lamp.
        const double along = (-double{p.x} + 0.5) * std::sqrt(0.5);
        const double distance = std::sqrt(double{p.x} * p.x + double{p.y} * p.y + 0.25 - along * along);
        if (along > 0.0 && distance < 0.45) {
            ASSERT_LT(seen, 0.75 * unhidden) << p.x << " " << p.y;
            dark++;
        } else if (distance > 0.55) {
            // The ball hides less than a third of what its cosine lets arrive of a sky that is a fifth of the light.
            ASSERT_GT(seen, 0.93 * unhidden) << p.x << " " << p.y;
            bright++;
        }
        ASSERT_LT(seen, unhidden + 1e-4);
    }
    EXPECT_GT(dark, 50u);
    EXPECT_GT(bright, 2000u);
}

}  // namespace glint::test
