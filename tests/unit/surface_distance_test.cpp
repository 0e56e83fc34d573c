#include "support/reference.h"
#include "support/surface_reference.h"

#include <glint/geometry/detail/triangle_tree.h>
#include <glint/geometry/primitives.h>
#include <glint/geometry/surface_distance.h>

#include <gtest/gtest.h>

#include <cmath>

using namespace glint;
using namespace glint::test;

namespace {

Mesh shaken(Mesh mesh, uint64_t seed, float amount) {
    Random random(seed);
    for (Vector3f& p : mesh.positions)
        p += amount * Vector3f(random.direction()) * static_cast<float>(random.uniform());
    return mesh;
}

double sampledDistance(const Mesh& a, const Mesh& b, double spacing) {
    const NearestReference to_a(a), to_b(b);
    double distance = 0.0;
    for (const Vector3d& p : samplePoints(a, spacing)) distance = std::max(distance, to_b.distance(p));
    for (const Vector3d& p : samplePoints(b, spacing)) distance = std::max(distance, to_a.distance(p));
    return distance;
}

}  // namespace

TEST(SurfaceDistance, NearestPointsAreThoseOfTheReference) {
    Random random(3);
    for (int i = 0; i < 20000; i++) {
        // Thin ones and such without area among them.
        const double thin = std::pow(10.0, -random.uniform(0, 12)) * (i % 7 != 0);
        const Vector3d a = random.direction(), along = random.direction();
        const std::array<Vector3d, 3> triangle = {a, a + along,
                                                  a + along * random.uniform() + random.direction() * thin};
        const Vector3d point = random.direction() * random.uniform(0, 3);
        const double found = glm::distance(detail::nearestPoint(triangle, point), point);
        // Squares of coordinates up to 3 that are rounded; a root makes 2^-50 of that where the distance vanishes.
        if (thin > 1e-3) { EXPECT_NEAR(found, distanceToTriangle(triangle, point), 1e-9); }
        // On the triangle, whatever its shape: none of its corners is nearer, and no point of it is beyond them.
        for (const Vector3d& corner : triangle) EXPECT_LE(found, glm::distance(corner, point) + 1e-9);
        const Vector3d on = triangle[0] * 0.3 + triangle[1] * 0.5 + triangle[2] * 0.2;
        EXPECT_LE(found, glm::distance(on, point) + 1e-9);
    }
}

// A sample every `spacing` misses at most that: the distance is no further from a sample's than the sample is away.
TEST(SurfaceDistance, BoundsWhatSamplesFind) {
    const Mesh sphere = createSphere(1.0f, 2), torus = createTorus(1.0f, 0.4f, 17, 11);
    const std::pair<Mesh, Mesh> cases[] = {
        {sphere, createSphere(1.0f, 1)},
        {sphere, shaken(sphere, 1, 0.05f)},
        {torus, createTorus(1.0f, 0.4f, 13, 7)},
        {shaken(torus, 2, 0.1f), torus},
        {createPlane(2.0f, 5), createPlane(2.0f, 3)},
        {createPlane(2.0f, 4), shaken(createPlane(2.0f, 4), 5, 0.01f)},
        {createBox({1, 1, 1}), createSphere(0.7f, 2)},
    };
    for (const auto& [a, b] : cases) {
        constexpr double spacing = 0.02;
        const double sampled = sampledDistance(a, b, spacing);
        for (const double tolerance : {0.3, 0.05, 0.01}) {
            const SurfaceDistance distance = hausdorffDistance(a, b, tolerance);
            EXPECT_GE(distance.upper, sampled);
            EXPECT_LE(distance.lower, sampled + spacing);
            // Either as near as was asked for, or below 2^-20 of the size; no size here is 4.
            EXPECT_LE(distance.upper, std::max(distance.lower * (1.0 + tolerance), 4 * 0x1p-20) + 1e-11);
        }
    }
}

TEST(SurfaceDistance, KnownOnes) {
    // A point raised by h over a plane is h away from it; what lies in a plane is not away.
    Mesh raised = createPlane(2.0f, 4);
    raised.positions[12].z = 0.25f;
    const SurfaceDistance distance = hausdorffDistance(createPlane(2.0f, 1), raised);
    EXPECT_GE(distance.upper, 0.25);
    EXPECT_LE(distance.upper, 0.25 * 1.05);
    EXPECT_LE(hausdorffDistance(createPlane(2.0f, 7), createPlane(2.0f, 3)).upper, 3 * 0x1p-20);
    // What only one of the two has counts in both orders.
    Mesh part = createPlane(2.0f, 4);
    part.indices.resize(part.indices.size() / 2);
    EXPECT_NEAR(hausdorffDistance(part, createPlane(2.0f, 4)).upper, 1.0, 0.06);
    EXPECT_NEAR(hausdorffDistance(createPlane(2.0f, 4), part).upper, 1.0, 0.06);

    EXPECT_EQ(hausdorffDistance(Mesh(), Mesh()).upper, 0.0);
    EXPECT_EQ(hausdorffDistance(Mesh(), part).lower, INFINITY);
    EXPECT_EQ(hausdorffDistance(part, Mesh()).upper, INFINITY);
}

// Nothing is too bad to be bounded: triangles without area, repeated ones, large coordinates, far from the origin.
TEST(SurfaceDistance, BadTriangles) {
    Mesh line;
    line.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 0, 0}};
    line.indices = {0, 1, 2, 0, 0, 0, 0, 3, 1, 2, 1, 0};
    Mesh point = line;
    point.indices = {0, 0, 3};
    EXPECT_NEAR(hausdorffDistance(line, point).upper, 2.0, 0.11);
    EXPECT_LE(hausdorffDistance(line, line).upper, 2 * 0x1p-20);

    Mesh far = createTorus(1.0f, 0.4f, 17, 11);
    for (Vector3f& p : far.positions) p += Vector3f(1e6f);
    Mesh moved = far;
    for (Vector3f& p : moved.positions) p.z += 0.25f;
    const SurfaceDistance distance = hausdorffDistance(far, moved);
    EXPECT_GE(distance.upper, sampledDistance(far, moved, 0.05));
    EXPECT_LE(distance.upper, 0.25 * 1.05 + 1e6 * 0x1p-40);
    for (Vector3f& p : moved.positions) p *= 1e30f;
    EXPECT_TRUE(hausdorffDistance(far, moved).upper > 1e35);
}
