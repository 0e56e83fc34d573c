#include "support/reference.h"

#include <glm/geometric.hpp>

#include <bit>
#include <cmath>
#include <map>
#include <tuple>

namespace glint::test {

uint32_t ulpDistance(float a, float b) {
    if (std::isnan(a) || std::isnan(b)) return UINT32_MAX;
    // Signed magnitude to an order without a jump at zero.
    const auto place = [](float value) {
        const auto bits = static_cast<int64_t>(std::bit_cast<uint32_t>(value) & 0x7fffffffu);
        return std::signbit(value) ? -bits : bits;
    };
    return static_cast<uint32_t>(std::abs(place(a) - place(b)));
}

namespace {

/// Signed volume of the ray and an edge; all three are of one sign inside a triangle. 0 where rounding could have
/// chosen the sign, else rays through a vertex could miss every triangle around it.
double edgeVolume(const Vector3d& direction, const Vector3d& a, const Vector3d& b) {
    const double volume = glm::dot(direction, glm::cross(a, b));
    const double rounding = 1e-15 * glm::length(direction) * glm::length(a) * glm::length(b);
    return std::abs(volume) <= rounding ? 0.0 : volume;
}

}  // namespace

ReferenceHit closestHit(const Mesh& mesh, const Vector3d& origin, const Vector3d& direction, double t_min,
                        double t_max) {
    ReferenceHit best;
    best.t = t_max;
    for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        const Vector3d a = Vector3d(mesh.positions[mesh.indices[i]]) - origin;
        const Vector3d b = Vector3d(mesh.positions[mesh.indices[i + 1]]) - origin;
        const Vector3d c = Vector3d(mesh.positions[mesh.indices[i + 2]]) - origin;
        const double u = edgeVolume(direction, c, b);
        const double v = edgeVolume(direction, a, c);
        const double w = edgeVolume(direction, b, a);
        if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) continue;
        const double sum = u + v + w;
        if (sum == 0.0) continue;
        const Vector3d normal = glm::cross(b - a, c - a);
        const double t = glm::dot(a, normal) / glm::dot(direction, normal);
        if (!(t >= t_min) || !(t <= best.t) || (best.hit && t == best.t)) continue;
        best = {.hit = true, .t = t, .triangle = static_cast<uint32_t>(i / 3), .barycentrics = {v / sum, w / sum}};
    }
    if (!best.hit) best.t = 0.0;
    return best;
}

bool isClosed(const Mesh& mesh) {
    using Point = std::tuple<float, float, float>;
    std::map<std::pair<Point, Point>, int> edges;
    const auto point = [&](size_t i) {
        const Vector3f& p = mesh.positions[mesh.indices[i]];
        return Point(p.x, p.y, p.z);
    };
    for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3)
        for (size_t k = 0; k < 3; k++) edges[{point(i + k), point(i + (k + 1) % 3)}]++;
    for (const auto& [edge, count] : edges) {
        const auto opposite = edges.find({edge.second, edge.first});
        if (count != 1 || opposite == edges.end() || opposite->second != 1) return false;
    }
    return true;
}

double volumeOf(const Mesh& mesh) {
    double volume = 0.0;
    for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        const Vector3d a(mesh.positions[mesh.indices[i]]);
        const Vector3d b(mesh.positions[mesh.indices[i + 1]]);
        const Vector3d c(mesh.positions[mesh.indices[i + 2]]);
        volume += glm::dot(a, glm::cross(b, c)) / 6.0;
    }
    return volume;
}

double areaOf(const Mesh& mesh) {
    double area = 0.0;
    for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        const Vector3d a(mesh.positions[mesh.indices[i]]);
        const Vector3d b(mesh.positions[mesh.indices[i + 1]]);
        const Vector3d c(mesh.positions[mesh.indices[i + 2]]);
        area += glm::length(glm::cross(b - a, c - a)) / 2.0;
    }
    return area;
}

Vector3d Random::direction() {
    const double z = uniform(-1.0, 1.0);
    const double angle = uniform(0.0, 6.283185307179586);
    const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
    return {r * std::cos(angle), r * std::sin(angle), z};
}

}  // namespace glint::test
