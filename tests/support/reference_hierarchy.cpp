#include "support/reference_hierarchy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace glint::test {

namespace {

constexpr uint32_t leaf_size = 4;

/// Where the ray enters the box, if it does. Wider than the box by far more than the rounding of float64, here and in
/// the triangle test.
std::optional<double> enter(const Vector3d& min, const Vector3d& max, const Vector3d& origin, const Vector3d& direction,
                            double t_min, double t_max) {
    double low = -std::numeric_limits<double>::infinity();
    double high = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; i++) {
        const double pad = 1e-12 * (std::abs(min[i]) + std::abs(max[i]) + std::abs(origin[i]));
        const double begin = min[i] - pad - origin[i];
        const double end = max[i] + pad - origin[i];
        if (direction[i] == 0.0) {
            if (begin > 0.0 || end < 0.0) return {};
            continue;
        }
        const double first = begin / direction[i];
        const double second = end / direction[i];
        low = std::max(low, std::min(first, second));
        high = std::min(high, std::max(first, second));
    }
    const double margin = 1e-12 * (std::abs(low) + std::abs(high));
    const bool meets = low - margin <= high + margin && high + margin >= t_min && low - margin <= t_max;
    return meets ? std::optional(low - margin) : std::nullopt;
}

}  // namespace

ReferenceHierarchy::ReferenceHierarchy(const Mesh& mesh) : mesh_(mesh) {
    std::vector<Vector3d> centres(mesh.triangleCount());
    for (uint32_t i = 0; i < centres.size(); i++) {
        Vector3d low(std::numeric_limits<double>::infinity());
        Vector3d high = -low;
        bool finite = true;
        for (uint32_t k = 0; k < 3; k++) {
            const Vector3f& corner = mesh.positions[mesh.indices[i * size_t{3} + k]];
            finite = finite && isFinite(corner);
            low = glm::min(low, Vector3d(corner));
            high = glm::max(high, Vector3d(corner));
        }
        centres[i] = low + high;
        if (finite) order_.push_back(i);
    }
    nodes_.reserve(centres.size() + 1);
    nodes_.emplace_back();
    build(0, 0, static_cast<uint32_t>(order_.size()), centres);
}

// Halves at the median along the longest side of the centres' box.
void ReferenceHierarchy::build(uint32_t node, uint32_t first, uint32_t count, const std::vector<Vector3d>& centres) {
    Vector3d low(std::numeric_limits<double>::infinity());
    Vector3d high = -low;
    Vector3d centre_low = low;
    Vector3d centre_high = high;
    for (uint32_t i = first; i < first + count; i++) {
        centre_low = glm::min(centre_low, centres[order_[i]]);
        centre_high = glm::max(centre_high, centres[order_[i]]);
        for (uint32_t k = 0; k < 3; k++) {
            const Vector3d corner(mesh_.positions[mesh_.indices[order_[i] * size_t{3} + k]]);
            low = glm::min(low, corner);
            high = glm::max(high, corner);
        }
    }
    nodes_[node].min = low;
    nodes_[node].max = high;
    nodes_[node].first = first;
    nodes_[node].count = count;
    if (count <= leaf_size) return;

    const Vector3d size = centre_high - centre_low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto begin = order_.begin() + first;
    std::nth_element(begin, begin + count / 2, begin + count,
                     [&](uint32_t a, uint32_t b) { return centres[a][axis] < centres[b][axis]; });
    const auto children = static_cast<uint32_t>(nodes_.size());
    nodes_.resize(nodes_.size() + 2);
    nodes_[node].first = children;
    nodes_[node].count = 0;
    build(children, first, count / 2, centres);
    build(children + 1, first + count / 2, count - count / 2, centres);
}

ReferenceHit ReferenceHierarchy::closestHit(const Vector3d& origin, const Vector3d& direction, double t_min,
                                            double t_max, const Filter& filter) const {
    ReferenceHit best;
    best.t = t_max;
    std::vector<std::pair<double, uint32_t>> stack;
    const auto push = [&](uint32_t index) {
        if (const auto t = enter(nodes_[index].min, nodes_[index].max, origin, direction, t_min, best.t))
            stack.emplace_back(*t, index);
    };
    if (!order_.empty()) push(0);
    while (!stack.empty()) {
        const auto [t, index] = stack.back();
        stack.pop_back();
        if (t > best.t) continue;
        const Node& node = nodes_[index];
        if (node.count == 0) {
            push(node.first);
            push(node.first + 1);
            // The nearer child comes off first.
            const size_t size = stack.size();
            if (size >= 2 && stack[size - 1].first > stack[size - 2].first && stack[size - 2].second >= node.first)
                std::swap(stack[size - 1], stack[size - 2]);
            continue;
        }
        for (uint32_t i = node.first; i < node.first + node.count; i++) {
            const ReferenceHit hit = intersectTriangle(mesh_, order_[i], origin, direction);
            if (!hit.hit || !(hit.t >= t_min) || !(hit.t <= best.t)) continue;
            if (best.hit && hit.t == best.t && hit.triangle > best.triangle) continue;
            if (!filter || filter(hit)) best = hit;
        }
    }
    if (!best.hit) best.t = 0.0;
    return best;
}

}  // namespace glint::test
