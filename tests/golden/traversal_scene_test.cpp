// The scene of 06_hello_traversal against what the tutorial says of it.

#include "06_hello_traversal/scene.h"
#include "support/reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <utility>

namespace glint::test {

TEST(TraversalScene, IsTheTutorials) {
    const Expected<TraversalScene> scene = TraversalScene::load();
    ASSERT_TRUE(scene) << scene.error().text();
    const Mesh& model = scene->mesh(TraversalScene::mesh_model);
    const Mesh& plane = scene->mesh(TraversalScene::mesh_plane);
    EXPECT_EQ(model.triangleCount(), 90112u);
    EXPECT_EQ(plane.triangleCount(), 128u);
    EXPECT_EQ(plane.positions.size(), 81u);
    EXPECT_FLOAT_EQ(plane.bounds().max.x, 81.92f);
    EXPECT_FLOAT_EQ(plane.bounds().min.y, -81.92f);

    ASSERT_EQ(scene->instances().size(), 163u);
    uint32_t counts[TraversalScene::mesh_count] = {};
    std::set<std::pair<long, long>> cells;
    for (const TraversalScene::Instance& instance : scene->instances()) {
        counts[instance.mesh]++;
        const Matrix4x4f matrix = instance.transform.matrix();
        if (instance.mesh == TraversalScene::mesh_plane) {
            EXPECT_EQ(matrix, Matrix4x4f(1.0f));
            continue;
        }
        // The middle of the mesh is 4 above the plane and on a grid of 5: models on it, dodecahedra between.
        const Vector3f place = transformPoint(matrix, scene->mesh(instance.mesh).bounds().center());
        EXPECT_NEAR(place.z, 4.0f, 1e-5f);
        const double x = place.x / 2.5, y = place.y / 2.5;
        ASSERT_NEAR(x, std::round(x), 1e-5);
        ASSERT_NEAR(y, std::round(y), 1e-5);
        EXPECT_EQ(std::lround(x) % 2 != 0, instance.mesh == TraversalScene::mesh_dodecahedron);
        EXPECT_TRUE(cells.emplace(std::lround(x), std::lround(y)).second) << "two in one place";
    }
    EXPECT_EQ(counts[TraversalScene::mesh_model], 81u);
    EXPECT_EQ(counts[TraversalScene::mesh_dodecahedron], 81u);
    EXPECT_EQ(counts[TraversalScene::mesh_plane], 1u);
}

TEST(TraversalScene, CameraAndLightAreTheTutorials) {
    for (const float time : {0.0f, 1.3f, 3.0f}) {
        const double t = time;
        const Camera camera = TraversalScene::camera(time, 1.0f);
        const double distance = 1.0 + 0.2 * std::sin(0.5 * t), angle = std::sin(t) * 4.0 * 3.14159265358979 / 180.0;
        EXPECT_NEAR(camera.position().x, 16.0 * distance * std::cos(angle), 1e-5);
        EXPECT_NEAR(camera.position().y, 16.0 * distance * std::sin(angle), 1e-5);
        EXPECT_NEAR(camera.position().z, (8.0 + 0.5 * std::cos(2.0 * t)) * distance, 1e-5);
        // It looks at (0, 0, -3).
        const Vector3d way = glm::normalize(Vector3d(0, 0, -3) - Vector3d(camera.position()));
        EXPECT_GT(glm::dot(way, Vector3d(camera.forward())), 1.0 - 1e-6);
        const Vector3f light = TraversalScene::light(time);
        EXPECT_NEAR(light.x, 12.0 + 2.0 * std::sin(0.5 * t), 1e-5);
        EXPECT_NEAR(light.y, 2.0 * std::cos(0.5 * t), 1e-5);
        EXPECT_EQ(light.z, 8.0f);
    }
}

TEST(TraversalScene, DodecahedronIsRegular) {
    const Mesh mesh = TraversalScene::dodecahedron();
    ASSERT_TRUE(mesh.validate());
    EXPECT_EQ(mesh.triangleCount(), 36u);
    EXPECT_EQ(mesh.positions.size(), 60u);
    EXPECT_TRUE(isClosed(mesh));
    const BoundBox box = mesh.bounds();
    for (int i = 0; i < 3; i++) {
        EXPECT_FLOAT_EQ(box.min[i], -0.4f);
        EXPECT_FLOAT_EQ(box.max[i], 0.4f);
    }
    // Of edge a: (15 + 7 sqrt(5)) / 4 a^3. Half the longest axis is phi^2 / 2 edges. Coordinates are rounded, to 2^-26.
    const double phi = (1.0 + std::sqrt(5.0)) / 2.0, edge = 0.4 * 2.0 / (phi * phi);
    const double volume = (15.0 + 7.0 * std::sqrt(5.0)) / 4.0 * edge * edge * edge;
    EXPECT_NEAR(volumeOf(mesh), volume, 1e-6 * volume);
    // Flat: a face's corners have its normal.
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        const Vector3d a(mesh.positions[mesh.indices[i]]), b(mesh.positions[mesh.indices[i + 1]]),
            c(mesh.positions[mesh.indices[i + 2]]);
        const Vector3d normal = glm::normalize(glm::cross(b - a, c - a));
        for (size_t k = 0; k < 3; k++)
            EXPECT_GT(glm::dot(normal, Vector3d(mesh.normals[mesh.indices[i + k]])), 1.0 - 1e-6);
    }
}

}  // namespace glint::test
