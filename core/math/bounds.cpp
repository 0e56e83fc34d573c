#include <glint/math/bounds.h>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>

namespace glint {

BoundBox::BoundBox(std::span<const Vector3f> points) {
    for (const Vector3f& point : points) add(point);
}

bool BoundBox::add(const Vector3f& point) {
    if (!isFinite(point)) return false;
    min = glm::min(min, point);
    max = glm::max(max, point);
    return true;
}

void BoundBox::add(const BoundBox& box) {
    if (box.isEmpty()) return;
    min = glm::min(min, box.min);
    max = glm::max(max, box.max);
}

bool BoundBox::isEmpty() const { return !(min.x <= max.x && min.y <= max.y && min.z <= max.z); }

bool BoundBox::contains(const Vector3f& point) const {
    return point.x >= min.x && point.x <= max.x && point.y >= min.y && point.y <= max.y && point.z >= min.z &&
           point.z <= max.z;
}

// Halved before the sum, because the sum of two large coordinates overflows.
Vector3f BoundBox::center() const { return isEmpty() ? Vector3f(0.0f) : min * 0.5f + max * 0.5f; }

Vector3f BoundBox::size() const { return isEmpty() ? Vector3f(0.0f) : max - min; }

BoundSphere::BoundSphere(std::span<const Vector3f> points) {
    const BoundBox box(points);
    if (box.isEmpty()) return;
    center = box.center();
    double farthest = 0.0;
    for (const Vector3f& point : points)
        if (isFinite(point)) farthest = std::max(farthest, glm::length(Vector3d(point) - Vector3d(center)));
    radius = static_cast<float>(farthest);
    if (static_cast<double>(radius) < farthest) radius = std::nextafter(radius, std::numeric_limits<float>::infinity());
}

}  // namespace glint
