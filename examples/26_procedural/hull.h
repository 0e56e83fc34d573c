#pragma once

#include <glint/math/bounds.h>

#include <algorithm>
#include <span>
#include <vector>

/// A convex body: all points with dot(plane.xyz, point) <= plane.w for each of its planes. Normals have length 1 and
/// point outwards.
struct Hull {
    std::vector<glint::Vector4f> planes;
    glint::BoundBox box;  ///< holds the body
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
    for (const Vector3f& direction : directions) {
        float farthest = glm::dot(direction, hull.box.center());
        for (const Vector3f& point : points) farthest = std::max(farthest, glm::dot(direction, point));
        hull.planes.emplace_back(direction, farthest);
    }
    return hull;
}
