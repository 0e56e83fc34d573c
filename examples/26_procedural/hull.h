#pragma once

#include "common/course.h"

#include <glint/geometry/primitives.h>
#include <glint/math/bounds.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

/// A convex body: all points with dot(plane.xyz, point) <= plane.w for each of its planes. Normals have length 1 and
/// point outwards.
struct Hull {
    std::vector<glint::Vector4f> planes;
    glint::BoundBox box;  ///< holds the body, and a little more: rays start on its sides
};

/// The least body with sides across these directions, of length 1, and across the axes, that holds all points. It holds
/// their convex hull, and is closer to it with more directions.
inline Hull hullOf(std::span<const glint::Vector3f> points, std::span<const glint::Vector3f> directions) {
    using namespace glint;
    Hull hull;
    hull.box = BoundBox(points);
    for (int axis = 0; axis < 3; axis++) {
        Vector4f plane(0.0f);
        plane[axis] = 1.0f;
        plane.w = hull.box.max[axis];
        hull.planes.push_back(plane);
        plane[axis] = -1.0f;
        plane.w = -hull.box.min[axis];
        hull.planes.push_back(plane);
    }
    const Vector3f margin = 1e-4f * hull.box.size();
    hull.box = BoundBox(hull.box.min - margin, hull.box.max + margin);
    for (const Vector3f& direction : directions) {
        float farthest = glm::dot(direction, hull.box.center());
        for (const Vector3f& point : points) farthest = std::max(farthest, glm::dot(direction, point));
        hull.planes.emplace_back(direction, farthest);
    }
    return hull;
}

/// A hull about the mesh, a little above the floor, and two crystals beside it; all in the world.
inline std::vector<Hull> createHulls(const CourseStage& stage) {
    using namespace glint;
    std::vector<Vector3f> points;
    for (const Vector3f& position : stage.mesh(CourseStage::object_mesh).positions)
        points.push_back(transformPoint(stage.transform(CourseStage::object_mesh).matrix(), position) +
                         Vector3f(0, 0, 0.05f));
    const std::vector<Vector3f> directions = createSphere(1.0f, 1).positions;
    std::vector<Hull> hulls = {hullOf(points, directions)};

    const auto addCrystal = [&](const Vector3f& bottom, float radius, float height, int sides) {
        std::vector<Vector3f> corners = {bottom + Vector3f(0, 0, height)};
        std::vector<Vector3f> normals;
        for (int i = 0; i < sides; i++) {
            const float turn = 2.0f * pi * static_cast<float>(i) / static_cast<float>(sides);
            const Vector3f out(std::cos(turn), std::sin(turn), 0.0f);
            corners.push_back(bottom + radius * out);
            corners.push_back(bottom + radius * out + Vector3f(0, 0, 0.6f * height));
            const Vector3f across(std::cos(turn + pi / static_cast<float>(sides)),
                                  std::sin(turn + pi / static_cast<float>(sides)), 0.0f);
            normals.push_back(across);
            normals.push_back(glm::normalize(across * 0.4f * height + Vector3f(0, 0, radius)));
        }
        hulls.push_back(hullOf(corners, normals));
    };
    addCrystal({0.9f, 2.5f, 0.02f}, 0.5f, 1.5f, 6);
    addCrystal({1.3f, -2.1f, 0.02f}, 0.45f, 0.9f, 5);
    return hulls;
}

/// Where the mesh itself is: about the centre of its hull, at half its size.
inline glint::Transform3x4 floatingMesh(const CourseStage& stage, const glint::Vector3f& center) {
    using namespace glint;
    return Transform3x4(translate(center) * scale(Vector3f(0.5f)) * translate(-center) *
                        stage.transform(CourseStage::object_mesh).matrix());
}
