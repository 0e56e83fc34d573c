// The float64 reference: the hierarchy against trying every triangle, bit for bit.

#include "support/hit_accuracy.h"

#include <glint/geometry/primitives.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace glint;
using namespace glint::test;

namespace {

bool same(const ReferenceHit& a, const ReferenceHit& b) {
    return a.hit == b.hit && a.t == b.t && a.triangle == b.triangle && a.barycentrics == b.barycentrics;
}

/// Returns how many rays hit.
uint32_t expectSame(const Mesh& mesh, const std::vector<Ray>& rays) {
    const ReferenceHierarchy hierarchy(mesh);
    uint32_t hits = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        const Vector3d origin(rays[i].origin);
        const Vector3d direction(rays[i].direction);
        const ReferenceHit expected = closestHit(mesh, origin, direction, rays[i].t_min, rays[i].t_max);
        const ReferenceHit actual = hierarchy.closestHit(origin, direction, rays[i].t_min, rays[i].t_max);
        EXPECT_TRUE(same(actual, expected)) << "ray " << i << ": " << actual.triangle << " at " << actual.t
                                            << ", expected " << expected.triangle << " at " << expected.t;
        hits += expected.hit;
    }
    return hits;
}

/// Triangles of all sizes and shapes, some of them needles, flat, doubled or not finite.
Mesh soup(uint32_t count, uint64_t seed) {
    Random random(seed);
    Mesh mesh;
    for (uint32_t i = 0; i < count; i++) {
        const Vector3d centre = random.direction() * random.uniform();
        const double size = std::pow(10.0, random.uniform(-4, 0));
        for (uint32_t k = 0; k < 3; k++) mesh.positions.emplace_back(centre + random.direction() * size);
        Vector3f* corners = &mesh.positions[i * size_t{3}];
        switch (random.below(16)) {
            case 0: corners[1] = corners[0] + Vector3f(1e-6f, 0, 0); break;
            case 1: corners[2] = corners[1]; break;
            case 2: corners[2] = corners[0] * 0.5f + corners[1] * 0.5f; break;
            case 3: corners[0] = corners[1] = corners[2]; break;
            case 4: std::copy(mesh.positions.begin(), mesh.positions.begin() + 3, corners); break;
            case 5: corners[1].y = std::nanf(""); break;
            case 6: corners[2].x = INFINITY; break;
            case 7: corners[0].z = corners[1].z = corners[2].z = 0.25f; break;
            default: break;
        }
        for (uint32_t k = 0; k < 3; k++) mesh.indices.push_back(i * 3 + k);
    }
    return mesh;
}

}  // namespace

TEST(Reference, HierarchyEqualsBruteForce) {
    for (const uint32_t count : {1u, 4u, 5u, 100u, 10000u}) {
        SCOPED_TRACE(count);
        const Mesh mesh = soup(count, count);
        const uint32_t rays = count > 1000 ? 300 : 1000;
        const uint32_t hits = expectSame(mesh, raysAround(mesh, rays, count));
        if (count > 4) { EXPECT_GT(hits, 0u); }
    }
    const Mesh torus = createTorus(1.0f, 0.4f, 100, 50);
    EXPECT_GT(expectSame(torus, raysAround(torus, 300)), 100u);
}

// Along axes, in the planes of boxes, through corners and edges, with an end.
TEST(Reference, HierarchyEqualsBruteForceInHardCases) {
    const Mesh box = createBox({2, 2, 2});
    std::vector<Ray> rays;
    for (int x = -3; x <= 3; x++)
        for (int y = -3; y <= 3; y++) {
            const auto u = static_cast<float>(x) * 0.5f;
            const auto v = static_cast<float>(y) * 0.5f;
            rays.push_back({{u, v, -4}, 0, {0, 0, 1}, 5});
            rays.push_back({{u, v, -4}, 3.0f, {-0.0f, 0, 1}, 3.0f});
            rays.push_back({{-4, u, v}, 0, {1, 0, 0}, 2});
            rays.push_back({{u, 4, v}, 5, {0, -1, 0}, 1e30f});
        }
    EXPECT_GT(expectSame(box, rays), 20u);
    const Mesh sphere = createSphere(1.0f, 3);
    EXPECT_EQ(expectSame(sphere, raysAtCorners(sphere, 500)), 500u);
    EXPECT_EQ(expectSame(sphere, raysAtEdges(sphere, 500)), 500u);
}

// The centre of a closed mesh sees surface wherever it looks, also at 100k triangles.
TEST(Reference, LeaksNothing) {
    const Mesh sphere = createSphere(1.0f, 6);
    const ReferenceHierarchy hierarchy(sphere);
    for (const auto& rays :
         {raysAtCorners(sphere, 10000), raysAtEdges(sphere, 10000), raysAtCorners(sphere, 10000, 0.5)})
        for (const Ray& ray : rays)
            EXPECT_TRUE(hierarchy.closestHit(Vector3d(ray.origin), Vector3d(ray.direction)).hit);
}

TEST(Reference, FilterSkips) {
    const Mesh sphere = createSphere(1.0f, 2);
    const ReferenceHierarchy hierarchy(sphere);
    const Vector3d origin(-3, 0.1, 0.2);
    const ReferenceHit first = hierarchy.closestHit(origin, {1, 0, 0});
    const ReferenceHit second = hierarchy.closestHit(
        origin, {1, 0, 0}, 0, 1e300, [&](const ReferenceHit& hit) { return hit.triangle != first.triangle; });
    ASSERT_TRUE(first.hit && second.hit);
    EXPECT_NEAR(first.t, 2, 0.1);
    EXPECT_NEAR(second.t, 4, 0.1);
    EXPECT_FALSE(hierarchy.closestHit(origin, {1, 0, 0}, 0, 1e300, [](const ReferenceHit&) { return false; }).hit);
}

// The judge has to see what is wrong: each of these changes one hit of many.
TEST(Reference, ComparisonFindsWrongHits) {
    const Mesh torus = createTorus(1.0f, 0.4f, 60, 30);
    const ReferenceHierarchy hierarchy(torus);
    const std::vector<Ray> rays = raysAround(torus, 200);
    std::vector<RayHit> exact;
    for (const Ray& ray : rays) {
        const ReferenceHit hit = hierarchy.closestHit(Vector3d(ray.origin), Vector3d(ray.direction));
        exact.push_back({});
        if (hit.hit)
            exact.back() = {static_cast<float>(hit.t),
                            hit.triangle,
                            0,
                            static_cast<float>(hit.barycentrics.x),
                            static_cast<float>(hit.barycentrics.y),
                            1};
    }
    const HitComparison right = compareHits(hierarchy, rays, exact);
    EXPECT_EQ(right.wrong, 0u) << right.first;
    EXPECT_EQ(right.differ, 0u);
    EXPECT_EQ(right.t_errors.size(), right.hits);
    // Half a unit of the last place of t, and of each barycentric coordinate.
    EXPECT_LE(right.t_errors.back(), 0x1p-24);
    EXPECT_LE(right.place_errors.back(), 0x1p-23);

    const auto hit = static_cast<size_t>(
        std::find_if(exact.begin(), exact.end(), [](const RayHit& each) { return each.isHit(); }) - exact.begin());
    const auto miss = static_cast<size_t>(
        std::find_if(exact.begin(), exact.end(), [](const RayHit& each) { return !each.isHit(); }) - exact.begin());
    ASSERT_LT(std::max(hit, miss), rays.size());
    const auto wrongAfter = [&](size_t place, const RayHit& changed) {
        std::vector<RayHit> hits = exact;
        hits[place] = changed;
        return compareHits(hierarchy, rays, hits).wrong;
    };
    RayHit changed = exact[hit];
    EXPECT_EQ(wrongAfter(hit, {}), 1u);
    EXPECT_EQ(wrongAfter(miss, changed), 1u);
    changed.t *= 1.001f;
    EXPECT_EQ(wrongAfter(hit, changed), 1u);
    changed = exact[hit];
    changed.primitive = (changed.primitive + 900) % 3600;
    EXPECT_EQ(wrongAfter(hit, changed), 1u);
    changed.primitive = 1u << 30;
    EXPECT_EQ(wrongAfter(hit, changed), 1u);
    changed.t = NAN;
    EXPECT_EQ(wrongAfter(hit, changed), 1u);
    EXPECT_EQ(compareHits(hierarchy, rays, std::span(exact).first(3)).wrong, 1u);
}
