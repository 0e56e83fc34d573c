// Hits of the driver, and of Embree, against float64. What is compared and by which bounds: support/hit_accuracy.h.

#include "accuracy/caster_test.h"
#include "accuracy/embree.h"
#include "support/files.h"
#include "support/hit_accuracy.h"

#include <glint/geometry/primitives.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace glint::test {

namespace {

class HitAccuracy : public CasterTest {
protected:
    /// Casts and judges. At least `share` of the rays hit.
    HitComparison expectRight(const Mesh& mesh, const std::vector<Ray>& rays, double share = 0.25) {
        const HitComparison result = compareHits(ReferenceHierarchy(mesh), rays, cast(mesh, rays));
        EXPECT_EQ(result.wrong, 0u) << result.first;
        EXPECT_GE(static_cast<double>(result.hits), share * static_cast<double>(rays.size()));
        return result;
    }
};

Mesh moved(Mesh mesh, double scale, const Vector3d& offset) {
    for (Vector3f& position : mesh.positions) position = Vector3f(Vector3d(position) * scale + offset);
    return mesh;
}

void addTriangle(Mesh& mesh, const Vector3f& a, const Vector3f& b, const Vector3f& c) {
    for (const Vector3f& corner : {a, b, c}) {
        mesh.indices.push_back(static_cast<uint32_t>(mesh.positions.size()));
        mesh.positions.push_back(corner);
    }
}

void addSquare(Mesh& mesh, float z, float half = 1.0f) {
    addTriangle(mesh, {-half, -half, z}, {half, -half, z}, {half, half, z});
    addTriangle(mesh, {-half, -half, z}, {half, half, z}, {-half, half, z});
}

/// Rays along Z at a square of 2 x 2 around the origin.
std::vector<Ray> raysDown(uint32_t count, float from) {
    Random random(3);
    std::vector<Ray> rays(count);
    for (Ray& ray : rays) {
        ray.origin = Vector3f(random.uniform(-0.9, 0.9), random.uniform(-0.9, 0.9), from);
        ray.direction = Vector3f(random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01), -1);
    }
    return rays;
}

}  // namespace

TEST_F(HitAccuracy, Bunny) {
    GLINT_NEED_BUNNY();
    const Expected<Mesh> mesh = Mesh::load(bunnyPath());
    ASSERT_THAT(mesh, IsOk());
    const std::vector<Ray> rays = raysAround(*mesh, 20000);
    const HitComparison result = expectRight(*mesh, rays);
    EXPECT_LE(HitComparison::quantile(result.t_errors, 0.9999), 1e-6);

    const HitComparison embree =
        compareHits(ReferenceHierarchy(*mesh), rays, EmbreeScene(*mesh, EmbreeMode::Robust).cast(rays));
    EXPECT_EQ(embree.wrong, 0u) << embree.first;
}

TEST_F(HitAccuracy, TorusOf100kTriangles) {
    const Mesh mesh = createTorus(1.0f, 0.4f, 320, 160);
    const HitComparison result = expectRight(mesh, raysAround(mesh, 20000));
    EXPECT_LE(HitComparison::quantile(result.t_errors, 0.9999), 1e-6);
}

// Origin and mesh are far out, so that coordinates have a unit of the last place of 1.
TEST_F(HitAccuracy, CoordinatesAt1e7) {
    const Mesh mesh = moved(createTorus(1.0f, 0.4f, 64, 32), 1e5, {1e7, -1e7, 1e7});
    expectRight(mesh, raysAround(mesh, 5000));
}

TEST_F(HitAccuracy, SmallAndLargeMeshes) {
    for (const double scale : {1e-6, 1e-3, 1e3, 1e6}) {
        SCOPED_TRACE(scale);
        const Mesh mesh = moved(createTorus(1.0f, 0.4f, 64, 32), scale, Vector3d(0));
        expectRight(mesh, raysAround(mesh, 2000));
    }
}

// Needles 1000 times as long as wide, and grazing rays.
TEST_F(HitAccuracy, Needles) {
    Mesh mesh = createTorus(1.0f, 0.4f, 64, 32);
    for (Vector3f& position : mesh.positions) position.z *= 1e-3f;
    expectRight(mesh, raysAround(mesh, 5000), 0.1);
    mesh = createTorus(1.0f, 0.4f, 3, 300);
    expectRight(mesh, raysAround(mesh, 5000), 0.1);
}

// Two squares whose distance is a few units of the last place of z = 1, seen from above. The bound of t there is at
// most 2^-24 (16 * 2.9 + 6 * 5.7 + 4 * 2.9), 46 of those units: closer than twice that either may be reported, but
// always at its own t, and further apart the upper one is. compareHits asks for just this; here it is also counted.
TEST_F(HitAccuracy, SurfacesAFewUnitsApart) {
    const std::vector<Ray> rays = raysDown(2000, 2.0f);
    for (const int units : {1, 4, 16, 64, 256}) {
        SCOPED_TRACE(units);
        Mesh mesh;
        addSquare(mesh, 1.0f);
        addSquare(mesh, 1.0f + static_cast<float>(units) * 0x1p-23f);
        const std::vector<RayHit> hits = cast(mesh, rays);
        const HitComparison result = compareHits(ReferenceHierarchy(mesh), rays, hits);
        EXPECT_EQ(result.wrong, 0u) << result.first;
        EXPECT_EQ(result.hits, rays.size());
        const auto lower = std::count_if(hits.begin(), hits.end(), [](const RayHit& hit) { return hit.primitive < 2; });
        if (units >= 256) { EXPECT_EQ(lower, 0); }
        RecordProperty("lower_at_" + std::to_string(units), static_cast<int>(lower));
    }
}

// The second of them is hit by rays that begin past the first.
TEST_F(HitAccuracy, TheSecondSurfaceIsHitFromTheFirst) {
    Mesh mesh;
    addSquare(mesh, 1.0f);
    addSquare(mesh, 1.0f - 0x1p-10f);
    std::vector<Ray> rays = raysDown(2000, 2.0f);
    for (Ray& ray : rays) ray.t_min = 1.0f + 0x1p-11f;
    for (const RayHit& hit : cast(mesh, rays)) EXPECT_GE(hit.primitive, 2u);
}

// Triangles of zero area are not there; what lies behind them is.
TEST_F(HitAccuracy, DegenerateTrianglesAreNotHit) {
    Mesh mesh;
    addSquare(mesh, 0.0f);
    const std::vector<Ray> rays = raysDown(2000, 2.0f);
    for (int i = 0; i < 50; i++) {
        const Vector3f p = rays[static_cast<size_t>(i)].origin + rays[static_cast<size_t>(i)].direction;
        addTriangle(mesh, p, p, p);
        addTriangle(mesh, p, p, p + Vector3f(0.5f, 0.25f, 0.125f));
        addTriangle(mesh, p - Vector3f(0.25f, 0, 0), p, p + Vector3f(0.25f, 0, 0));
        addTriangle(mesh, p, p + Vector3f(0, 0, 0.5f), p + Vector3f(0, 0, 1));
    }
    const std::vector<RayHit> hits = cast(mesh, rays);
    for (size_t i = 0; i < rays.size(); i++) EXPECT_LT(hits[i].primitive, 2u) << i;
}

// Either of two equal triangles may be named, and t is that of one.
TEST_F(HitAccuracy, DoubledTriangles) {
    Mesh mesh = createTorus(1.0f, 0.4f, 40, 20);
    const std::vector<Ray> rays = raysAround(mesh, 5000);
    const HitComparison once = compareHits(ReferenceHierarchy(mesh), rays, cast(mesh, rays));
    const std::vector<uint32_t> indices = mesh.indices;
    mesh.indices.insert(mesh.indices.end(), indices.begin(), indices.end());
    const HitComparison twice = compareHits(ReferenceHierarchy(mesh), rays, cast(mesh, rays));
    EXPECT_EQ(once.wrong, 0u) << once.first;
    EXPECT_EQ(twice.wrong, 0u) << twice.first;
    EXPECT_EQ(once.t_errors, twice.t_errors);
}

TEST_F(HitAccuracy, TrianglesThatAreNotFiniteAreNotThere) {
    Mesh mesh = createTorus(1.0f, 0.4f, 40, 20);
    const std::vector<Ray> rays = raysAround(mesh, 5000);
    const std::vector<RayHit> expected = cast(mesh, rays);
    mesh.normals.clear();
    mesh.texcoords.clear();
    const auto count = static_cast<uint32_t>(mesh.triangleCount());
    for (const float value : {NAN, INFINITY, -INFINITY})
        for (int axis = 0; axis < 3; axis++)
            for (int corner = 0; corner < 3; corner++) {
                Vector3f corners[3] = {{-2, -2, 0}, {2, -2, 0.1f}, {0, 2, -0.1f}};
                corners[corner][axis] = value;
                addTriangle(mesh, corners[0], corners[1], corners[2]);
            }
    // Others share no corner with them, so nothing else changes, and the numbers stay.
    const std::vector<RayHit> hits = cast(mesh, rays);
    ASSERT_EQ(hits.size(), expected.size());
    for (size_t i = 0; i < hits.size(); i++) {
        EXPECT_EQ(hits[i], expected[i]) << i;
        EXPECT_TRUE(!hits[i].isHit() || hits[i].primitive < count);
    }
}

// A direction scaled by a power of two changes t by its inverse, exactly, however long it is.
TEST_F(HitAccuracy, DirectionsOfAnyLength) {
    const Mesh mesh = createTorus(1.0f, 0.4f, 40, 20);
    const std::vector<Ray> rays = raysAround(mesh, 1000);
    const std::vector<RayHit> expected = cast(mesh, rays);
    for (const int exponent : {-100, -60, -1, 1, 60, 100}) {
        SCOPED_TRACE(exponent);
        std::vector<Ray> scaled = rays;
        for (Ray& ray : scaled) ray.direction = ray.direction * std::ldexp(1.0f, exponent);
        const std::vector<RayHit> hits = cast(mesh, scaled);
        ASSERT_EQ(hits.size(), rays.size());
        for (size_t i = 0; i < hits.size(); i++) {
            EXPECT_EQ(hits[i].primitive, expected[i].primitive) << i;
            if (expected[i].isHit()) { EXPECT_EQ(std::ldexp(hits[i].t, exponent), expected[i].t) << i; }
        }
    }
}

TEST_F(HitAccuracy, EmbreeIsNoLessExactInItsRobustMode) {
    const Mesh mesh = createTorus(1.0f, 0.4f, 64, 32);
    const std::vector<Ray> rays = raysAround(mesh, 20000);
    const HitComparison result =
        compareHits(ReferenceHierarchy(mesh), rays, EmbreeScene(mesh, EmbreeMode::Robust).cast(rays));
    EXPECT_EQ(result.wrong, 0u) << result.first;
    EXPECT_GT(result.hits, rays.size() / 4);
}

}  // namespace glint::test
