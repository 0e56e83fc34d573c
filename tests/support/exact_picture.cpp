#include "support/exact_picture.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace glint::test {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

Vector2d toPixels(const Vector4d& clip, const Vector2u& size) {
    return {(0.5 + 0.5 * clip.x / clip.w) * size.x, (0.5 - 0.5 * clip.y / clip.w) * size.y};
}

double distanceToSegment(const Vector2d& a, const Vector2d& b, const Vector2d& p) {
    const Vector2d along = b - a;
    const double length2 = glm::dot(along, along);
    const double t = length2 > 0.0 ? std::clamp(glm::dot(p - a, along) / length2, 0.0, 1.0) : 0.0;
    return glm::distance(a + t * along, p);
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x * b.y - a.y * b.x; }

/// Shares of a point at the ray through `place` of three corners (x, y and w, in pixels), without the division that
/// makes their sum 1: they are of one sign within the triangle.
std::array<double, 3> shares(const std::array<Vector3d, 3>& corners, const Vector2d& place) {
    const Vector3d ray(place, 1.0);
    return {glm::dot(glm::cross(corners[1], corners[2]), ray), glm::dot(glm::cross(corners[2], corners[0]), ray),
            glm::dot(glm::cross(corners[0], corners[1]), ray)};
}

/// A corner in units of pixels before the division by w.
Vector3d beforeDivision(const Vector4d& clip, const Vector2u& size) {
    return {0.5 * (clip.w + clip.x) * size.x, 0.5 * (clip.w - clip.y) * size.y, clip.w};
}

}  // namespace

Matrix4x4d toClip(const CameraParameters& camera, const Transform3x4& instance) {
    return Matrix4x4d(camera.projection) * Matrix4x4d(camera.view) * Matrix4x4d(instance.matrix());
}

ExactPicture::ExactPicture(const Mesh& mesh, const Matrix4x4d& to_clip, const Vector2u& size)
    : mesh_(mesh),
      to_clip_(to_clip),
      size_(size),
      tiles_((size.x + tile - 1) / tile + 2, (size.y + tile - 1) / tile + 2),
      pixels_(size_t{size.x} * size.y, {infinity, none}),
      at_tile_(size_t{tiles_.x} * tiles_.y) {
    for (uint32_t i = 0; i < mesh.triangleCount(); i++) {
        std::array<Vector4d, 3> clip;
        const auto points = corners(i);
        for (size_t k = 0; k < 3; k++) clip[k] = to_clip * Vector4d(points[k], 1.0);
        // What is beyond the near plane, z <= w.
        Polygon polygon;
        for (size_t k = 0; k < 3; k++) {
            const Vector4d &a = clip[k], &b = clip[(k + 1) % 3];
            const double from = a.w - a.z, to = b.w - b.z;
            if (from >= 0.0 && a.w > 0.0) polygon.corners[polygon.count++] = toPixels(a, size);
            if ((from < 0.0 && to > 0.0) || (from > 0.0 && to < 0.0))
                polygon.corners[polygon.count++] = toPixels(a + (b - a) * (from / (from - to)), size);
        }
        if (polygon.count < 3) continue;
        draw(i, polygon, clip);
        sort(polygon);
    }
}

void ExactPicture::show(std::span<const uint32_t> triangles) {
    for (uint32_t i = 0; i < pixels_.size(); i++) {
        pixels_[i] = {infinity, triangles[i]};
        if (triangles[i] != none) pixels_[i].depth = project(point(i % size_.x, i / size_.x)).z;
    }
}

std::array<Vector3d, 3> ExactPicture::corners(uint32_t triangle) const {
    const uint32_t* indices = &mesh_.indices[triangle * size_t{3}];
    return {Vector3d(mesh_.positions[indices[0]]), Vector3d(mesh_.positions[indices[1]]),
            Vector3d(mesh_.positions[indices[2]])};
}

void ExactPicture::draw(uint32_t triangle, const Polygon& polygon, const std::array<Vector4d, 3>& clip) {
    Vector2d low(infinity), high(-infinity);
    for (uint32_t k = 0; k < polygon.count; k++) {
        low = glm::min(low, polygon.corners[k]);
        high = glm::max(high, polygon.corners[k]);
    }
    const auto first = [](double value) { return static_cast<int64_t>(std::ceil(std::max(value - 0.5, 0.0))); };
    const auto last = [](double value, uint32_t count) {
        return static_cast<int64_t>(std::floor(std::min(value - 0.5, count - 1.0)));
    };
    std::array<Vector3d, 3> flat;
    for (size_t k = 0; k < 3; k++) flat[k] = beforeDivision(clip[k], size_);
    const double volume = glm::dot(flat[0], glm::cross(flat[1], flat[2]));
    if (volume == 0.0) return;
    for (int64_t y = first(low.y); y <= last(high.y, size_.y); y++)
        for (int64_t x = first(low.x); x <= last(high.x, size_.x); x++) {
            auto share = shares(flat, {static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5});
            for (double& s : share) s /= volume;
            if (share[0] < 0.0 || share[1] < 0.0 || share[2] < 0.0) continue;
            const double depth = 1.0 / (share[0] + share[1] + share[2]);
            const double z = (share[0] * clip[0].z + share[1] * clip[1].z + share[2] * clip[2].z) * depth;
            Pixel& pixel = pixels_[static_cast<size_t>(y) * size_.x + static_cast<size_t>(x)];
            if (!(z <= depth) || !(depth < pixel.depth)) continue;
            pixel = {depth, triangle};
        }
}

void ExactPicture::sort(const Polygon& polygon) {
    Vector2d low(infinity), high(-infinity);
    for (uint32_t k = 0; k < polygon.count; k++) {
        low = glm::min(low, polygon.corners[k]);
        high = glm::max(high, polygon.corners[k]);
    }
    const auto number = static_cast<uint32_t>(polygons_.size());
    polygons_.push_back(polygon);
    const auto place = [](double value, uint32_t count) {
        return static_cast<int64_t>(std::floor(std::clamp(value / tile + 1.0, -1.0, static_cast<double>(count) + 1.0)));
    };
    for (int64_t y = std::max<int64_t>(place(low.y, tiles_.y), 0);
         y <= std::min<int64_t>(place(high.y, tiles_.y), tiles_.y - 1); y++)
        for (int64_t x = std::max<int64_t>(place(low.x, tiles_.x), 0);
             x <= std::min<int64_t>(place(high.x, tiles_.x), tiles_.x - 1); x++)
            at_tile_[static_cast<size_t>(y) * tiles_.x + static_cast<size_t>(x)].push_back(number);
}

Vector3d ExactPicture::point(uint32_t x, uint32_t y) const {
    const auto points = corners(triangle(x, y));
    std::array<Vector3d, 3> flat;
    for (size_t k = 0; k < 3; k++) flat[k] = beforeDivision(to_clip_ * Vector4d(points[k], 1.0), size_);
    auto share = shares(flat, {x + 0.5, y + 0.5});
    // Of one sign; what is beyond an edge comes to the edge.
    const double sign = share[0] + share[1] + share[2] < 0.0 ? -1.0 : 1.0;
    for (double& s : share) s = std::max(s * sign, 0.0);
    return (points[0] * share[0] + points[1] * share[1] + points[2] * share[2]) / (share[0] + share[1] + share[2]);
}

Vector3d ExactPicture::project(const Vector3d& point) const {
    const Vector4d clip = to_clip_ * Vector4d(point, 1.0);
    return {toPixels(clip, size_), clip.w};
}

double ExactPicture::distanceToCoverage(const Vector2d& place, double reach) const {
    double best = infinity;
    const auto tileOf = [](double value) { return static_cast<int64_t>(std::floor(value / tile)) + 1; };
    for (int64_t y = std::max<int64_t>(tileOf(place.y - reach), 0);
         y <= std::min<int64_t>(tileOf(place.y + reach), tiles_.y - 1); y++)
        for (int64_t x = std::max<int64_t>(tileOf(place.x - reach), 0);
             x <= std::min<int64_t>(tileOf(place.x + reach), tiles_.x - 1); x++)
            for (const uint32_t i : at_tile_[static_cast<size_t>(y) * tiles_.x + static_cast<size_t>(x)]) {
                const Polygon& polygon = polygons_[i];
                bool left = true, right = true;
                for (uint32_t k = 0; k < polygon.count; k++) {
                    const Vector2d &a = polygon.corners[k], &b = polygon.corners[(k + 1) % polygon.count];
                    best = std::min(best, distanceToSegment(a, b, place));
                    const double side = cross(b - a, place - a);
                    left = left && side > 0.0;
                    right = right && side < 0.0;
                }
                if (left || right) return 0.0;
            }
    return best <= reach ? best : infinity;
}

}  // namespace glint::test
