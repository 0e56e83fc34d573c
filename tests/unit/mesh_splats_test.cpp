#include "support/matchers.h"

#include <glint/geometry/mesh_splats.h>
#include <glint/geometry/primitives.h>
#include <glint/geometry/surface_samples.h>
#include <glint/math/harmonics.h>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

using namespace glint;
using namespace glint::test;

namespace {

Vector3d normalOf(const Splats& splats, size_t splat) {
    const Vector4f& q = splats.rotations[splat];
    return glm::dquat(q.w, q.x, q.y, q.z) * Vector3d(0, 0, 1);
}

Vector3d colorOf(const Splats& splats, size_t splat, const Vector3d& direction) {
    const auto y = evaluateHarmonics(direction);
    Vector3d color(0.5);
    for (uint32_t k = 0; k < splats.coefficientCount(); k++)
        color += y[k] * Vector3d(splats.harmonics[splat * splats.coefficientCount() + k]);
    return glm::max(color, Vector3d(0.0));
}

/// What a splat with nothing in its way should look like for an eye in the direction `eye`, in float64.
Vector3d referenceColor(const MeshSplatsOptions& options, const Vector3d& albedo, const Vector3d& n,
                        const Vector3d& eye) {
    const SplatLight& light = options.light;
    const Vector3d lamp = glm::normalize(Vector3d(light.direction)), up = glm::normalize(Vector3d(light.up));
    const auto sky = [&](const Vector3d& d) {
        return glm::mix(Vector3d(light.ground), Vector3d(light.sky), 0.5 + 0.5 * glm::dot(d, up));
    };
    const auto fresnel = [&](double cosine) {
        return options.gloss + (1.0 - options.gloss) * std::pow(1 - cosine, 5.0);
    };
    const Vector3d arriving = Vector3d(light.lamp) * std::max(glm::dot(n, lamp), 0.0);
    // A sky that is linear in the direction has its mean over Lambert's cosine at 2/3 of the normal.
    const Vector3d diffuse = (1.0 - options.gloss) * albedo * (arriving + sky(n * (2.0 / 3.0)));
    const Vector3d half = glm::normalize(eye + lamp);
    const double lobe = fresnel(glm::dot(half, eye)) * 24.0 / 8.0 * std::pow(std::max(glm::dot(half, n), 0.0), 16.0);
    const Vector3d mirrored = sky(2.0 * glm::dot(n, eye) * n - eye);
    const Vector3d sum = diffuse + lobe * arriving + fresnel(glm::dot(n, eye)) * mirrored;
    return glm::pow(glm::clamp(sum, 0.0, 1.0), Vector3d(1.0 / 2.2));
}

std::vector<Vector3d> directions() { return sphereRule(10).directions; }

}  // namespace

TEST(MeshSplats, AreDiscsAlongTheNormals) {
    MeshSplatsOptions options;
    options.count = 1500;
    const Mesh mesh = createTorus(2.0f, 0.5f, 48, 24);
    const auto splats = splatsFromMesh(mesh, options);
    ASSERT_THAT(splats, IsOk());
    EXPECT_THAT(splats->validate(), IsOk());
    const auto samples = *sampleSurface(mesh, 1500);
    ASSERT_EQ(splats->size(), samples.size());
    for (size_t i = 0; i < samples.size(); i++) {
        EXPECT_EQ(splats->positions[i], samples[i].position);
        EXPECT_NEAR(glm::distance(normalOf(*splats, i), Vector3d(samples[i].normal)), 0.0, 1e-6);
        EXPECT_EQ(splats->scales[i].x, splats->scales[i].y);
        EXPECT_NEAR(splats->scales[i].z, 0.1f * splats->scales[i].x, 1e-6f);
    }
    EXPECT_EQ(*splatsFromMesh(mesh, options), *splats);
    // The normal that the turn to it is ill defined for.
    Mesh below = createPlane(1.0f);
    for (Vector3f& normal : below.normals) normal = {0, 0, -1};
    const auto turned = splatsFromMesh(below, options);
    ASSERT_THAT(turned, IsOk());
    EXPECT_THAT(turned->validate(), IsOk());
    EXPECT_NEAR(normalOf(*turned, 0).z, -1.0, 1e-6);
}

// Seen from straight above any of its points, at most 2 percent of what is behind the surface shines through.
TEST(MeshSplats, CloseTheSurface) {
    MeshSplatsOptions options;
    options.count = 4000;
    options.degree = 0;
    const Mesh mesh = createTorus(2.0f, 0.5f, 96, 48);
    const auto splats = splatsFromMesh(mesh, options);
    ASSERT_THAT(splats, IsOk());
    double worst = 0.0, sum = 0.0;
    const auto points = *sampleSurface(mesh, 1999);
    for (const SurfaceSample& point : points) {
        double through = 1.0;
        for (size_t i = 0; i < splats->size(); i++) {
            const Vector3d offset(point.position - splats->positions[i]);
            const double radius = splats->scales[i].x;
            if (glm::dot(offset, offset) > 16.0 * radius * radius) continue;
            const Vector3d aside = offset - glm::dot(offset, Vector3d(point.normal)) * Vector3d(point.normal);
            through *= 1.0 - splats->opacities[i] * std::exp(-0.5 * glm::dot(aside, aside) / (radius * radius));
        }
        worst = std::max(worst, through);
        sum += through;
    }
    EXPECT_LT(worst, 0.02);
    EXPECT_LT(sum / static_cast<double>(points.size()), 0.005);
}

// The fit is the nearest sum of 16 harmonics, not the color itself: it is held to what the header states.
TEST(MeshSplats, HaveTheColorsOfTheirLight) {
    MeshSplatsOptions options;
    options.count = 200;
    options.sky_rays = 1024;
    options.light.radius = 0.0f;
    const Vector3d albedo(0.5, 0.25, 0.1);
    options.color = [&](const Vector3f&) { return Vector3f(albedo); };
    double errors[4] = {};
    for (uint32_t degree = 0; degree <= 3; degree++) {
        options.degree = degree;
        const auto splats = splatsFromMesh(createSphere(1.0f, 4), options);
        ASSERT_THAT(splats, IsOk());
        ASSERT_EQ(splats->degree, degree);
        double sum = 0.0, count = 0.0;
        for (size_t i = 0; i < splats->size(); i++) {
            for (const Vector3d& eye : directions()) {
                const Vector3d n = normalOf(*splats, i);
                if (glm::dot(eye, n) < 0.0) continue;
                const Vector3d off = colorOf(*splats, i, -eye) - referenceColor(options, albedo, n, eye);
                sum += glm::dot(off, off) / 3.0;
                count++;
            }
        }
        errors[degree] = std::sqrt(sum / count);
        RecordProperty("rms_degree_" + std::to_string(degree), std::to_string(errors[degree]));
    }
    EXPECT_LT(errors[3], 0.03);
    EXPECT_LT(errors[3], 0.9 * errors[2]);
    EXPECT_LT(errors[2], 0.8 * errors[1]);
    EXPECT_LT(errors[1], 0.8 * errors[0]);
}

// Normals of a coarse mesh may be far from its triangles: its light is theirs, but its discs lie within 25 degrees of
// the triangles.
TEST(MeshSplats, CoverCoarseMeshesWithoutScales) {
    Mesh mesh = createBox({1.0f, 1.0f, 1.0f});
    mesh.texcoords.clear();
    for (size_t i = 0; i < mesh.positions.size(); i++) mesh.normals[i] = glm::normalize(mesh.positions[i]);
    MeshSplatsOptions options;
    options.count = 500;
    const auto splats = splatsFromMesh(mesh, options);
    ASSERT_THAT(splats, IsOk());
    const double least = std::cos(25.0 * std::numbers::pi / 180.0);
    double smallest = 1.0;
    for (size_t i = 0; i < splats->size(); i++) {
        const Vector3d face = glm::abs(normalOf(*splats, i));
        const double cosine = std::max({face.x, face.y, face.z});
        ASSERT_GT(cosine, least - 1e-5) << i;
        smallest = std::min(smallest, cosine);
    }
    EXPECT_NEAR(smallest, least, 1e-5);
}

TEST(MeshSplats, AreDarkWhereNoLightArrives) {
    MeshSplatsOptions options;
    options.count = 300;
    uint64_t rays = 0, aimed = 0;
    const auto splats = splatsFromMesh(createSphere(1.0f, 3), options, [&](std::span<const Ray> asked) {
        for (const Ray& ray : asked) {
            rays++;
            if (ray.direction == Vector3f(0.0f)) continue;
            aimed++;
            // From outside of the facets, away from the sphere.
            EXPECT_GT(glm::dot(ray.direction, ray.origin), 0.0f);
            EXPECT_GT(glm::length(ray.origin), 0.98f);
            EXPECT_LT(glm::length(ray.origin), 1.0001f);
        }
        return Expected<std::vector<uint8_t>>(std::vector<uint8_t>(asked.size(), 1));
    });
    ASSERT_THAT(splats, IsOk());
    EXPECT_EQ(rays, 300u * (options.lamp_rays + options.sky_rays));
    EXPECT_GT(aimed, rays / 2);
    EXPECT_LT(aimed, rays);  // half of the splats face away from the lamp
    // All 0 in every direction, but for sums in float32.
    for (size_t i = 0; i < splats->size(); i++) {
        for (const Vector3d& eye : directions()) { ASSERT_LT(glm::length(colorOf(*splats, i, -eye)), 1e-4); }
    }
}

TEST(MeshSplats, PassErrorsOn) {
    const Mesh mesh = createPlane(1.0f);
    MeshSplatsOptions options;
    options.count = 100;
    EXPECT_THAT(splatsFromMesh(mesh, options, [](std::span<const Ray>) { return std::vector<uint8_t>(3); }),
                HasErrorId("splats.occlusion"));
    EXPECT_THAT(splatsFromMesh(mesh, options,
                               [](std::span<const Ray>) -> Expected<std::vector<uint8_t>> {
                                   return unexpected(Error(ErrorCode::DeviceLost, "device.lost", "gone"));
                               }),
                HasErrorId("device.lost"));
    EXPECT_THAT(splatsFromMesh({}, options), HasErrorId("mesh.no_faces"));
    const auto expectRefused = [&](auto&& change) {
        MeshSplatsOptions changed = options;
        change(changed);
        EXPECT_THAT(splatsFromMesh(mesh, changed), HasErrorId("splats.from_mesh"));
    };
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    expectRefused([](MeshSplatsOptions& o) { o.degree = 4; });
    expectRefused([](MeshSplatsOptions& o) { o.gloss = -0.1f; });
    expectRefused([](MeshSplatsOptions& o) { o.gloss = nan; });
    expectRefused([](MeshSplatsOptions& o) { o.lamp_rays = 0; });
    expectRefused([](MeshSplatsOptions& o) { o.sky_rays = 1025; });
    expectRefused([](MeshSplatsOptions& o) { o.light.up = Vector3f(0.0f); });
    expectRefused([](MeshSplatsOptions& o) { o.light.direction.x = nan; });
    expectRefused([](MeshSplatsOptions& o) { o.light.radius = 46.0f; });
    expectRefused([](MeshSplatsOptions& o) { o.light.sky.y = -1.0f; });
    expectRefused([](MeshSplatsOptions& o) { o.light.lamp.z = std::numeric_limits<float>::infinity(); });
    expectRefused([](MeshSplatsOptions& o) { o.color = [](const Vector3f&) { return Vector3f(1.1f, 0.0f, 0.0f); }; });
    expectRefused([](MeshSplatsOptions& o) { o.color = [](const Vector3f&) { return Vector3f(nan); }; });
    options.count = 0;
    EXPECT_THAT(splatsFromMesh(mesh, options), HasErrorId("surface.count"));
}
