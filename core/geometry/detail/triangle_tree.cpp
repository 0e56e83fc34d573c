#include <glint/geometry/detail/triangle_tree.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>
#include <numeric>

namespace glint::detail {

namespace {

Vector3d nearestOnSegment(const Vector3d& a, const Vector3d& b, const Vector3d& point) {
    const Vector3d along = b - a;
    const double length2 = glm::dot(along, along);
    if (!(length2 > 0.0)) return a;
    return a + along * std::clamp(glm::dot(point - a, along) / length2, 0.0, 1.0);
}

double distance2(const Vector3d& a, const Vector3d& b) { return glm::dot(a - b, a - b); }

/// Squared distance of a point to a box.
double distance2(const BoundBox& box, const Vector3d& point) {
    const Vector3d outside = glm::max(glm::max(Vector3d(box.min) - point, point - Vector3d(box.max)), Vector3d(0.0));
    return glm::dot(outside, outside);
}

}  // namespace

Vector3d nearestPoint(const std::array<Vector3d, 3>& triangle, const Vector3d& point) {
    const auto& [a, b, c] = triangle;
    const Vector3d ab = b - a, ac = c - a, ap = point - a;
    const Vector3d normal = glm::cross(ab, ac);
    const double area2 = glm::dot(normal, normal);
    std::array<double, 3> weights = {-1.0, -1.0, -1.0};  // barycentric coordinates of the projection
    if (area2 > 0.0) {
        weights[1] = glm::dot(glm::cross(ap, ac), normal) / area2;
        weights[2] = glm::dot(glm::cross(ab, ap), normal) / area2;
        weights[0] = 1.0 - weights[1] - weights[2];
        if (weights[0] >= 0.0 && weights[1] >= 0.0 && weights[2] >= 0.0) return a + ab * weights[1] + ac * weights[2];
    }
    // Otherwise it lies on an edge, and on one that the projection lies beyond: the way from the nearest point is a sum
    // of outward normals of its edges, and of two vectors one has a positive product with their sum.
    Vector3d best = a;
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < 3; i++) {
        if (!(weights[i] < 0.0)) continue;
        const Vector3d candidate = nearestOnSegment(triangle[(i + 1) % 3], triangle[(i + 2) % 3], point);
        const double distance = distance2(candidate, point);
        if (distance >= least) continue;
        least = distance;
        best = candidate;
    }
    return best;
}

TriangleTree::TriangleTree(std::span<const Vector3f> positions, std::span<const uint32_t> indices)
    : positions_(positions), indices_(indices), order_(indices.size() / 3) {
    std::iota(order_.begin(), order_.end(), 0u);
    std::vector<Vector3f> centers(order_.size());
    for (size_t i = 0; i < centers.size(); i++)
        centers[i] = positions[indices[i * 3]] / 3.0f + positions[indices[i * 3 + 1]] / 3.0f +
                     positions[indices[i * 3 + 2]] / 3.0f;
    nodes_.reserve(order_.size());
    if (!order_.empty()) build(0, size(), centers);
}

uint32_t TriangleTree::build(uint32_t begin, uint32_t end, std::vector<Vector3f>& centers) {
    const auto index = static_cast<uint32_t>(nodes_.size());
    nodes_.emplace_back();
    BoundBox box, middle;
    for (uint32_t i = begin; i < end; i++) {
        for (uint32_t k = 0; k < 3; k++) box.add(positions_[indices_[order_[i] * size_t{3} + k]]);
        middle.add(centers[order_[i]]);
    }
    nodes_[index].box = box;
    if (end - begin <= 4) {
        nodes_[index].first = begin;
        nodes_[index].count = end - begin;
        return index;
    }
    const Vector3f size = middle.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const uint32_t half = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + half, order_.begin() + end, [&](uint32_t a, uint32_t b) {
        return centers[a][axis] != centers[b][axis] ? centers[a][axis] < centers[b][axis] : a < b;
    });
    build(begin, half, centers);
    const uint32_t second = build(half, end, centers);
    nodes_[index].first = second;
    return index;
}

TriangleTree::Nearest TriangleTree::nearest(const Vector3d& point, uint32_t guess) const {
    Nearest best{guess, distance2(nearestPoint(triangle(guess), point), point)};
    struct Entry {
        uint32_t node;
        double distance2;
    };
    // Halving leaves at most 32 levels.
    std::array<Entry, 64> stack;
    size_t top = 0;
    stack[top++] = {0, distance2(nodes_[0].box, point)};
    while (top > 0) {
        const Entry entry = stack[--top];
        if (entry.distance2 >= best.distance2) continue;
        const Node& node = nodes_[entry.node];
        if (node.count > 0) {
            for (uint32_t i = node.first; i < node.first + node.count; i++) {
                const double d = distance2(nearestPoint(triangle(order_[i]), point), point);
                if (d < best.distance2) best = {order_[i], d};
            }
            continue;
        }
        Entry near{entry.node + 1, distance2(nodes_[entry.node + 1].box, point)};
        Entry far{node.first, distance2(nodes_[node.first].box, point)};
        if (far.distance2 < near.distance2) std::swap(near, far);
        stack[top++] = far;
        stack[top++] = near;
    }
    return best;
}

}  // namespace glint::detail
