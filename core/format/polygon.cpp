#include <glint/format/mesh.h>

#include <glm/geometric.hpp>

#include <numeric>

namespace glint {

namespace {

double cross(const Vector2d& a, const Vector2d& b) { return a.x * b.y - a.y * b.x; }

/// Twice the signed area; positive if the corners turn counter-clockwise.
double area(const Vector2d& a, const Vector2d& b, const Vector2d& c) { return cross(b - a, c - a); }

/// The polygon seen along its normal (Newell's sum), so that it turns counter-clockwise. Empty if it has no area.
std::vector<Vector2d> flatten(std::span<const Vector3f> corners) {
    Vector3d normal(0.0);
    const Vector3d origin(corners[0]);
    for (size_t i = 0; i < corners.size(); i++) {
        const Vector3d a = Vector3d(corners[i]) - origin;
        const Vector3d b = Vector3d(corners[(i + 1) % corners.size()]) - origin;
        normal += glm::cross(a, b);
    }
    const double length = glm::length(normal);
    if (!(length > 0.0) || !std::isfinite(length)) return {};
    normal /= length;
    const Vector3d other = std::abs(normal.x) < 0.7 ? Vector3d(1, 0, 0) : Vector3d(0, 1, 0);
    const Vector3d x = glm::normalize(glm::cross(other, normal));
    const Vector3d y = glm::cross(normal, x);
    std::vector<Vector2d> flat;
    flat.reserve(corners.size());
    for (const Vector3f& corner : corners) {
        const Vector3d p = Vector3d(corner) - origin;
        flat.emplace_back(glm::dot(p, x), glm::dot(p, y));
    }
    return flat;
}

bool isConvex(const std::vector<Vector2d>& flat) {
    const size_t n = flat.size();
    for (size_t i = 0; i < n; i++)
        if (area(flat[i], flat[(i + 1) % n], flat[(i + 2) % n]) < 0.0) return false;
    return true;
}

bool isInside(const Vector2d& p, const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    return area(a, b, p) >= 0.0 && area(b, c, p) >= 0.0 && area(c, a, p) >= 0.0;
}

/// Whether the corner at `place` can be cut off: it turns left, and no other corner lies in its triangle.
bool isEar(const std::vector<Vector2d>& flat, const std::vector<uint32_t>& left, size_t place) {
    const size_t n = left.size();
    const Vector2d& a = flat[left[(place + n - 1) % n]];
    const Vector2d& b = flat[left[place]];
    const Vector2d& c = flat[left[(place + 1) % n]];
    if (!(area(a, b, c) > 0.0)) return false;
    for (size_t k = 2; k + 1 < n; k++) {
        const Vector2d& p = flat[left[(place + k) % n]];
        // A corner that touches one of the three (the bridge to a hole does) is in nobody's way.
        if (p != a && p != b && p != c && isInside(p, a, b, c)) return false;
    }
    return true;
}

}  // namespace

std::vector<uint32_t> triangulatePolygon(std::span<const Vector3f> corners) {
    const auto count = static_cast<uint32_t>(corners.size());
    std::vector<uint32_t> triangles;
    if (count < 3) return triangles;
    triangles.reserve(3 * (count - 2));

    const std::vector<Vector2d> flat = count > 3 ? flatten(corners) : std::vector<Vector2d>();
    if (flat.empty() || isConvex(flat)) {
        for (uint32_t i = 1; i + 1 < count; i++) triangles.insert(triangles.end(), {0, i, i + 1});
        return triangles;
    }

    std::vector<uint32_t> left(count);
    std::iota(left.begin(), left.end(), 0u);
    size_t place = 0;
    while (left.size() > 3) {
        const size_t n = left.size();
        size_t tried = 0;
        while (tried < n && !isEar(flat, left, (place + tried) % n)) tried++;
        // A flat polygon that does not cross itself has an ear; of any other one corner goes all the same.
        place = (place + tried) % n;
        triangles.insert(triangles.end(), {left[(place + n - 1) % n], left[place], left[(place + 1) % n]});
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(place));
        if (place == left.size()) place = 0;
    }
    triangles.insert(triangles.end(), {left[0], left[1], left[2]});
    return triangles;
}

}  // namespace glint
