#include "support/matchers.h"
#include "support/reference.h"

#include <glint/geometry/primitives.h>

#include <glm/geometric.hpp>

#include <gtest/gtest.h>

using namespace glint;
using namespace glint::test;

namespace {

void expectGoodNormals(const Mesh& mesh) {
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    for (const Vector3f& normal : mesh.normals) EXPECT_NEAR(glm::length(normal), 1.0f, 1e-6f);
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        const Vector3f& a = mesh.positions[mesh.indices[i]];
        const Vector3f face =
            glm::cross(mesh.positions[mesh.indices[i + 1]] - a, mesh.positions[mesh.indices[i + 2]] - a);
        EXPECT_GT(glm::dot(face, mesh.normals[mesh.indices[i]]), 0.0f) << "triangle " << i / 3;
    }
}

}  // namespace

TEST(Primitives, Torus) {
    const Mesh mesh = createTorus(2.0f, 0.5f, 60, 24);
    EXPECT_THAT(mesh.validate(), IsOk());
    EXPECT_EQ(mesh.positions.size(), 60u * 24u);
    EXPECT_EQ(mesh.triangleCount(), 2u * 60u * 24u);
    EXPECT_TRUE(isClosed(mesh));
    expectGoodNormals(mesh);
    EXPECT_NEAR(volumeOf(mesh), 2 * 9.8696044 * 2.0 * 0.25, 0.02 * 9.87);
    EXPECT_NEAR(mesh.bounds().max.x, 2.5f, 1e-6f);
    EXPECT_NEAR(mesh.bounds().max.z, 0.5f, 1e-6f);
    EXPECT_EQ(createTorus(2, 1, 0, 1).triangleCount(), 18u);
    EXPECT_TRUE(isClosed(createTorus(2, 1, 0, 1)));
}

TEST(Primitives, Sphere) {
    for (uint32_t step = 0; step <= 4; step++) {
        const Mesh mesh = createSphere(3.0f, step);
        EXPECT_THAT(mesh.validate(), IsOk());
        EXPECT_EQ(mesh.triangleCount(), 20u << (2 * step));
        EXPECT_EQ(mesh.positions.size(), (10u << (2 * step)) + 2);
        EXPECT_TRUE(isClosed(mesh));
        expectGoodNormals(mesh);
        for (const Vector3f& p : mesh.positions) EXPECT_NEAR(glm::length(p), 3.0f, 1e-6f);
    }
    EXPECT_NEAR(volumeOf(createSphere(1.0f, 5)), 4.18879, 0.01);
}

TEST(Primitives, Box) {
    const Mesh mesh = createBox({1, 2, 3});
    EXPECT_THAT(mesh.validate(), IsOk());
    EXPECT_EQ(mesh.triangleCount(), 12u);
    EXPECT_EQ(mesh.positions.size(), 24u);
    EXPECT_TRUE(isClosed(mesh));
    expectGoodNormals(mesh);
    EXPECT_NEAR(volumeOf(mesh), 6.0, 1e-6);
    EXPECT_EQ(mesh.bounds(), BoundBox({-0.5f, -1.0f, -1.5f}, {0.5f, 1.0f, 1.5f}));
}

TEST(Primitives, Plane) {
    const Mesh mesh = createPlane(4.0f, 8);
    EXPECT_THAT(mesh.validate(), IsOk());
    EXPECT_EQ(mesh.triangleCount(), 128u);
    EXPECT_EQ(mesh.positions.size(), 81u);
    expectGoodNormals(mesh);
    EXPECT_EQ(mesh.bounds(), BoundBox({-2, -2, 0}, {2, 2, 0}));
    EXPECT_EQ(createPlane(1.0f, 0).triangleCount(), 2u);
}

// Rays from inside a closed mesh hit it, the ones through its vertices and edges too.
TEST(Primitives, NoRayLeavesAClosedMesh) {
    Random random(5);
    const Mesh torus = createTorus(2.0f, 0.5f, 24, 12);
    const Mesh sphere = createSphere(1.0f, 2);
    for (const auto& [mesh, origin] :
         {std::pair(&torus, Vector3d(2, 0.05, 0.03)), {&sphere, Vector3d(0.1, 0.2, 0.05)}}) {
        for (int i = 0; i < 500; i++) {
            const size_t triangle = random.below(mesh->triangleCount());
            const Vector3d a(mesh->positions[mesh->indices[3 * triangle]]);
            const Vector3d b(mesh->positions[mesh->indices[3 * triangle + 1]]);
            const Vector3d targets[] = {origin + random.direction(), a, (a + b) * 0.5};
            for (const Vector3d& target : targets) EXPECT_TRUE(closestHit(*mesh, origin, target - origin).hit);
        }
    }
}

TEST(Reference, ClosestHit) {
    const Mesh box = createBox({2, 2, 2});
    const ReferenceHit hit = closestHit(box, {5, 0.25, 0.5}, {-2, 0, 0});
    ASSERT_TRUE(hit.hit);
    EXPECT_DOUBLE_EQ(hit.t, 2.0);
    const Vector3d point = Vector3d(5, 0.25, 0.5) + Vector3d(-2, 0, 0) * hit.t;
    const Vector3d a(box.positions[box.indices[3 * hit.triangle]]);
    const Vector3d b(box.positions[box.indices[3 * hit.triangle + 1]]);
    const Vector3d c(box.positions[box.indices[3 * hit.triangle + 2]]);
    const Vector3d rebuilt = a + (b - a) * hit.barycentrics.x + (c - a) * hit.barycentrics.y;
    EXPECT_NEAR(glm::length(rebuilt - point), 0.0, 1e-12);
    EXPECT_FALSE(closestHit(box, {5, 0.25, 0.5}, {2, 0, 0}).hit);
    EXPECT_FALSE(closestHit(box, {5, 0.25, 0.5}, {-2, 0, 0}, 0.0, 1.9).hit);
    EXPECT_DOUBLE_EQ(closestHit(box, {5, 0.25, 0.5}, {-2, 0, 0}, 2.5).t, 3.0);
    EXPECT_FALSE(closestHit(box, {5, 1.5, 0.5}, {-2, 0, 0}).hit);
}
