#include "support/surface_reference.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace glint::test {

// With the regions of Ericson 2005, section 5.1.5.
Vector3d nearestOnTriangle(const std::array<Vector3d, 3>& triangle, const Vector3d& p) {
    const auto& [a, b, c] = triangle;
    const Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap), d3 = glm::dot(ab, bp);
    const double d4 = glm::dot(ac, bp), d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d1 <= 0 && d2 <= 0) return a;
    if (d3 >= 0 && d4 <= d3) return b;
    if (d6 >= 0 && d5 <= d6) return c;
    const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    const double sum = va + vb + vc;
    return a + ab * (vb / sum) + ac * (vc / sum);
}

namespace {

std::array<Vector3d, 3> cornersOf(const Mesh& mesh, size_t triangle) {
    return {Vector3d(mesh.positions[mesh.indices[triangle * 3]]),
            Vector3d(mesh.positions[mesh.indices[triangle * 3 + 1]]),
            Vector3d(mesh.positions[mesh.indices[triangle * 3 + 2]])};
}

}  // namespace

double distanceToTriangle(const std::array<Vector3d, 3>& triangle, const Vector3d& point) {
    return glm::distance(nearestOnTriangle(triangle, point), point);
}

NearestReference::NearestReference(const Mesh& mesh) {
    for (size_t i = 0; i < mesh.triangleCount(); i++) {
        Item item{.corners = cornersOf(mesh, i), .center = {}, .radius = 0.0};
        item.center = (item.corners[0] + item.corners[1] + item.corners[2]) / 3.0;
        for (const Vector3d& corner : item.corners)
            item.radius = std::max(item.radius, glm::distance(corner, item.center));
        items_.push_back(item);
    }
}

Vector3d NearestReference::nearest(const Vector3d& point) const {
    double best = std::numeric_limits<double>::infinity();
    Vector3d result(0.0);
    for (const Item& item : items_) {
        const Vector3d away = item.center - point;
        const double reach = best + item.radius;
        if (glm::dot(away, away) > reach * reach) continue;
        const Vector3d candidate = nearestOnTriangle(item.corners, point);
        const double distance = glm::distance(candidate, point);
        if (distance < best) {
            best = distance;
            result = candidate;
        }
    }
    return result;
}

double NearestReference::distance(const Vector3d& point) const { return glm::distance(nearest(point), point); }

std::vector<Vector3d> samplePoints(const Mesh& mesh, double spacing) {
    std::vector<Vector3d> points;
    for (size_t i = 0; i < mesh.triangleCount(); i++) {
        const auto [a, b, c] = cornersOf(mesh, i);
        const double longest = std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
        // A grid of n * n small triangles, each point of which is within longest / n of a corner.
        const int n = std::max(1, static_cast<int>(std::ceil(longest / spacing)));
        for (int j = 0; j <= n; j++)
            for (int k = 0; j + k <= n; k++)
                points.push_back(a + (b - a) * (double(j) / n) + (c - a) * (double(k) / n));
    }
    return points;
}

std::vector<BoundaryEdge> boundaryOf(const Mesh& mesh) {
    std::vector<BoundaryEdge> edges;
    edges.reserve(mesh.indices.size());
    for (size_t k = 0; k < mesh.indices.size(); k++) {
        // 0 and -0 are one place.
        const Vector3f from = mesh.positions[mesh.indices[k]] + 0.0f;
        const Vector3f to = mesh.positions[mesh.indices[k % 3 == 2 ? k - 2 : k + 1]] + 0.0f;
        const std::array<float, 3> a = {from.x, from.y, from.z}, b = {to.x, to.y, to.z};
        if (a == b) continue;
        const auto& [low, high] = std::minmax(a, b);
        edges.push_back({{low[0], low[1], low[2], high[0], high[1], high[2]}, a < b ? 1 : -1});
    }
    std::sort(edges.begin(), edges.end());
    std::vector<BoundaryEdge> result;
    for (const BoundaryEdge& edge : edges) {
        if (!result.empty() && result.back().ends == edge.ends)
            result.back().count += edge.count;
        else if (!result.empty() && result.back().count == 0)
            result.back() = edge;
        else
            result.push_back(edge);
    }
    if (!result.empty() && result.back().count == 0) result.pop_back();
    return result;
}

}  // namespace glint::test
