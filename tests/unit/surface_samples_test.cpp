#include "support/matchers.h"

#include <glint/geometry/primitives.h>
#include <glint/geometry/surface_samples.h>

#include <glm/geometric.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace glint;
using namespace glint::test;

namespace {

/// Distance to the nearest other sample of the same side.
float nearestOf(const std::vector<SurfaceSample>& samples, size_t sample) {
    float nearest = std::numeric_limits<float>::infinity();
    for (size_t i = 0; i < samples.size(); i++)
        if (i != sample && glm::dot(samples[i].normal, samples[sample].normal) > 0.0f)
            nearest = std::min(nearest, glm::distance(samples[i].position, samples[sample].position));
    return nearest;
}

/// Distance between neighbours of an even (hexagonal) pattern of as many points on this area.
float evenSpacing(float area, uint32_t count) {
    return std::sqrt(2.0f * area / (std::sqrt(3.0f) * static_cast<float>(count)));
}

float areaOf(const Mesh& mesh) {
    float area = 0.0f;
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        const Vector3f& a = mesh.positions[mesh.indices[i]];
        area += 0.5f * glm::length(glm::cross(mesh.positions[mesh.indices[i + 1]] - a,
                                              mesh.positions[mesh.indices[i + 2]] - a));
    }
    return area;
}

/// None may be much nearer to another than in an even pattern: Yuksel's sets reach 0.7 to 0.8 of it, random points 0.
void expectEven(const std::vector<SurfaceSample>& samples, float area) {
    const float even = evenSpacing(area, static_cast<uint32_t>(samples.size()));
    for (size_t i = 0; i < samples.size(); i++) {
        ASSERT_GT(nearestOf(samples, i), 0.6f * even) << "sample " << i;
        // The mean of six is beyond the nearest; holes that another sample would fit into are not left.
        ASSERT_GT(samples[i].spacing, 0.7f * even) << "sample " << i;
        ASSERT_LT(samples[i].spacing, 1.6f * even) << "sample " << i;
    }
}

}  // namespace

TEST(SurfaceSamples, LieOnTheirTriangles) {
    const Mesh mesh = createTorus(2.0f, 0.5f, 24, 12);
    const auto samples = sampleSurface(mesh, 1000);
    ASSERT_THAT(samples, IsOk());
    ASSERT_EQ(samples->size(), 1000u);
    for (const SurfaceSample& sample : *samples) {
        ASSERT_LT(sample.triangle, mesh.triangleCount());
        const Vector2f& b = sample.barycentrics;
        ASSERT_TRUE(b.x >= 0.0f && b.y >= 0.0f && b.x + b.y <= 1.0f + 1e-6f);
        const uint32_t* corners = &mesh.indices[size_t{sample.triangle} * 3];
        const Vector3f at = (1.0f - b.x - b.y) * mesh.positions[corners[0]] + b.x * mesh.positions[corners[1]] +
                            b.y * mesh.positions[corners[2]];
        ASSERT_NEAR(glm::distance(at, sample.position), 0.0f, 1e-6f);
        // Outwards, and near that of the round torus: the circle around the tube has 12 corners.
        ASSERT_NEAR(glm::length(sample.normal), 1.0f, 1e-6f);
        const Vector3f centre = glm::normalize(Vector3f(at.x, at.y, 0.0f)) * 2.0f;
        ASSERT_GT(glm::dot(glm::normalize(at - centre), sample.normal), 0.95f);
    }
    EXPECT_EQ(*sampleSurface(mesh, 1000), *samples);
}

TEST(SurfaceSamples, AreEvenWhateverTheTrianglesAre) {
    expectEven(*sampleSurface(createPlane(2.0f), 2000), 4.0f);
    expectEven(*sampleSurface(createPlane(2.0f, 100), 2000), 4.0f);
    // Two large triangles beside many small ones, and needles.
    Mesh mesh = createPlane(1.0f, 40);
    const Mesh large = createPlane(1.0f);
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (const Vector3f& p : large.positions) mesh.positions.push_back(p + Vector3f(1.0f, 0.0f, 0.0f));
    for (const uint32_t index : large.indices) mesh.indices.push_back(first + index);
    mesh.normals.clear();
    mesh.texcoords.clear();
    const auto samples = sampleSurface(mesh, 2000);
    ASSERT_THAT(samples, IsOk());
    expectEven(*samples, 2.0f);
    const auto on_large =
        std::count_if(samples->begin(), samples->end(), [](const SurfaceSample& s) { return s.position.x > 0.5f; });
    // Half of them, to about a row of samples along the line between: 45 of 2000.
    EXPECT_NEAR(static_cast<double>(on_large), 1000.0, 45.0);
    const Mesh needles = createTorus(2.0f, 0.5f, 4000, 8);
    expectEven(*sampleSurface(needles, 500), areaOf(needles));
}

// A wall thinner than the distance of samples has as many on either side as without the other.
TEST(SurfaceSamples, CoverBothSidesOfAWall) {
    const auto samples = sampleSurface(createBox({2.0f, 2.0f, 0.001f}), 2000);
    ASSERT_THAT(samples, IsOk());
    const auto above =
        std::count_if(samples->begin(), samples->end(), [](const SurfaceSample& s) { return s.normal.z > 0.5f; });
    EXPECT_NEAR(static_cast<double>(above), 1000.0, 25.0);
    expectEven(*samples, 8.0f);
}

TEST(SurfaceSamples, TakeAnyCountAndSize) {
    for (const uint32_t count : {1u, 2u, 3u, 17u}) {
        const auto samples = sampleSurface(createSphere(1e-12f, 1), count);
        ASSERT_THAT(samples, IsOk());
        EXPECT_EQ(samples->size(), count);
        for (const SurfaceSample& sample : *samples) EXPECT_GT(sample.spacing, 0.0f);
    }
    for (const float size : {1e12f, 1e18f}) {
        const auto samples = sampleSurface(createPlane(size), 100);
        ASSERT_THAT(samples, IsOk());
        expectEven(*samples, size * size);
    }
    // Far from the origin, where coordinates are 1/16 apart.
    Mesh far = createPlane(100.0f);
    for (Vector3f& p : far.positions) p += Vector3f(1e6f);
    EXPECT_THAT(sampleSurface(far, 1000), IsOk());
}

TEST(SurfaceSamples, PassOverWhatHasNoArea) {
    Mesh mesh = createPlane(1.0f);
    mesh.indices.insert(mesh.indices.begin(), {0, 0, 1, 2, 2, 2});
    mesh.indices.insert(mesh.indices.end(), {1, 1, 0});
    const auto samples = sampleSurface(mesh, 100);
    ASSERT_THAT(samples, IsOk());
    for (const SurfaceSample& sample : *samples) EXPECT_TRUE(sample.triangle == 2 || sample.triangle == 3);
    // Normals that are not to be used give way to the triangle's.
    for (Vector3f& normal : mesh.normals) normal = Vector3f(std::numeric_limits<float>::quiet_NaN());
    const auto flat = sampleSurface(mesh, 100);
    ASSERT_THAT(flat, IsOk());
    for (const SurfaceSample& sample : *flat) EXPECT_EQ(sample.normal, Vector3f(0, 0, 1));
}

TEST(SurfaceSamples, RefuseWhatHasNoSurface) {
    EXPECT_THAT(sampleSurface(createPlane(1.0f), 0), HasErrorId("surface.count"));
    EXPECT_THAT(sampleSurface(createPlane(1.0f), max_surface_samples + 1), HasErrorId("surface.count"));
    EXPECT_THAT(sampleSurface({}, 10), HasErrorId("mesh.no_faces"));
    Mesh mesh = createPlane(1.0f);
    mesh.indices = {0, 1, 1};
    EXPECT_THAT(sampleSurface(mesh, 10), HasErrorId("surface.area"));
    mesh.indices = {0, 1, 9};
    EXPECT_THAT(sampleSurface(mesh, 10), HasErrorId("mesh.index_range"));
    mesh.indices = {0, 1, 2};
    mesh.positions[0].x = std::numeric_limits<float>::infinity();
    EXPECT_THAT(sampleSurface(mesh, 10), HasErrorId("mesh.not_finite"));
    mesh.positions[0] = Vector3f(-3e38f);
    mesh.positions[1] = Vector3f(3e38f);
    EXPECT_THAT(sampleSurface(mesh, 10), HasErrorId("surface.area"));
}
