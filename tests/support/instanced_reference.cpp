#include "support/instanced_reference.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace glint::test {

namespace {

constexpr uint32_t leaf_size = 4;
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Where the ray enters the box, or infinity. Zeros in the direction give infinities, which compare rightly.
double enter(const Vector3d& min, const Vector3d& max, const Vector3d& origin, const Vector3d& inverse, double t_max) {
    double low = 0.0, high = t_max;
    for (int i = 0; i < 3; i++) {
        const double a = (min[i] - origin[i]) * inverse[i];
        const double b = (max[i] - origin[i]) * inverse[i];
        low = std::max(low, std::min(a, b));
        high = std::min(high, std::max(a, b));
    }
    return low <= high + 1e-9 ? low : infinity;
}

}  // namespace

InstancedReference::InstancedReference(const Mesh& mesh, std::span<const Transform3x4> instances)
    : mesh_(mesh), order_(mesh.triangleCount()) {
    std::iota(order_.begin(), order_.end(), 0u);
    nodes_.reserve(order_.size());
    nodes_.emplace_back();
    build(0, 0, static_cast<uint32_t>(order_.size()));

    const Vector3d& low = nodes_[0].min;
    const Vector3d& high = nodes_[0].max;
    for (const Transform3x4& transform : instances) {
        const Matrix4x4d matrix(transform.matrix());
        const Vector3d center(matrix * Vector4d((low + high) * 0.5, 1.0));
        double radius = 0.0;
        for (int i = 0; i < 8; i++) {
            const Vector4d corner(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z, 1.0);
            radius = std::max(radius, glm::length(Vector3d(matrix * corner) - center));
        }
        instances_.push_back({glm::inverse(matrix), center, radius * (1.0 + 1e-12)});
    }
}

std::array<Vector3d, 3> InstancedReference::corners(uint32_t triangle) const {
    const uint32_t* indices = &mesh_.indices[triangle * size_t{3}];
    return {Vector3d(mesh_.positions[indices[0]]), Vector3d(mesh_.positions[indices[1]]),
            Vector3d(mesh_.positions[indices[2]])};
}

// Halves at the median along the longest side.
void InstancedReference::build(uint32_t node, uint32_t first, uint32_t count) {
    Vector3d low(infinity), high(-infinity);
    for (uint32_t i = first; i < first + count; i++)
        for (const Vector3d& corner : corners(order_[i])) {
            low = glm::min(low, corner);
            high = glm::max(high, corner);
        }
    nodes_[node] = {low, high, first, count};
    if (count <= leaf_size) return;
    const Vector3d size = high - low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto begin = order_.begin() + first;
    const auto place = [&](uint32_t triangle) {
        const std::array<Vector3d, 3> c = corners(triangle);
        return c[0][axis] + c[1][axis] + c[2][axis];
    };
    std::nth_element(begin, begin + count / 2, begin + count,
                     [&](uint32_t a, uint32_t b) { return place(a) < place(b); });
    const auto children = static_cast<uint32_t>(nodes_.size());
    nodes_.resize(nodes_.size() + 2);
    nodes_[node].first = children;
    nodes_[node].count = 0;
    build(children, first, count / 2);
    build(children + 1, first + count / 2, count - count / 2);
}

void InstancedReference::traverse(const Vector3d& origin, const Vector3d& direction, uint32_t instance,
                                  Hit& best) const {
    const Vector3d inverse = 1.0 / direction;
    std::array<std::pair<double, uint32_t>, 64> stack;  // as deep as 2^64 triangles need
    size_t depth = 0;
    const auto push = [&](uint32_t node) {
        const double t = enter(nodes_[node].min, nodes_[node].max, origin, inverse, best.t);
        if (t <= best.t) stack[depth++] = {t, node};
    };
    push(0);
    while (depth > 0) {
        const auto [t_enter, index] = stack[--depth];
        if (t_enter > best.t) continue;
        const Node& node = nodes_[index];
        if (node.count == 0) {
            const size_t before = depth;
            push(node.first);
            push(node.first + 1);
            if (depth == before + 2 && stack[before] < stack[before + 1]) std::swap(stack[before], stack[before + 1]);
            continue;
        }
        for (uint32_t i = node.first; i < node.first + node.count; i++) {
            const auto [a, b, c] = corners(order_[i]);
            const Vector3d ab = b - a, ac = c - a;
            const Vector3d p = glm::cross(direction, ac);
            const double determinant = glm::dot(ab, p);
            if (determinant == 0.0) continue;
            const Vector3d from = origin - a;
            const Vector3d q = glm::cross(from, ab);
            const double u = glm::dot(from, p) / determinant;
            const double v = glm::dot(direction, q) / determinant;
            const double t = glm::dot(ac, q) / determinant;
            constexpr double slack = 1e-12;
            if (!(u >= -slack && v >= -slack && u + v <= 1.0 + slack && t >= 0.0 && t < best.t)) continue;
            best = {instance, order_[i], t, {u, v}};
        }
    }
}

InstancedReference::Hit InstancedReference::closestHit(const Vector3d& origin, const Vector3d& direction, double t_max,
                                                       uint32_t skip) const {
    // Those whose ball the ray passes, the nearest first.
    std::vector<std::pair<double, uint32_t>> near;
    for (uint32_t i = 0; i < instances_.size(); i++) {
        const Instance& instance = instances_[i];
        const Vector3d to_center = instance.center - origin;
        const double along = glm::dot(to_center, direction);
        const double reach = instance.radius * instance.radius - (glm::dot(to_center, to_center) - along * along);
        if (reach < 0.0 || i == skip) continue;
        if (along + std::sqrt(reach) >= 0.0) near.emplace_back(along - std::sqrt(reach), i);
    }
    std::sort(near.begin(), near.end());
    Hit best;
    best.t = t_max;
    for (const auto& [t, i] : near) {
        if (t > best.t) break;
        // An affine map keeps t.
        traverse(Vector3d(instances_[i].inverse * Vector4d(origin, 1.0)),
                 Vector3d(instances_[i].inverse * Vector4d(direction, 0.0)), i, best);
    }
    return best;
}

}  // namespace glint::test
