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

#ifdef __SIZEOF_FLOAT128__
__extension__ typedef __float128 Quad;
#else
using Quad = long double;  // of 113 bits where there is no __float128
#endif

/// Signed volume of the ray and an edge; all three are of one sign inside a triangle. Exactly 0 on the edge.
double edgeVolume(const Vector3d& direction, const Vector3d& a, const Vector3d& b) {
    const double volume = glm::dot(direction, glm::cross(a, b));
    const double size = glm::length(direction) * glm::length(a) * glm::length(b);
    if (std::abs(volume) > 1e-14 * size) return volume;
    // The sums may have cancelled. Factors of 24 to 53 bits: what 113 bits lose is below 1e-31 of the terms.
    const auto product = [](double x, double y, double z) { return Quad(x) * Quad(y) * Quad(z); };
    const Quad exact = product(direction.x, a.y, b.z) - product(direction.x, a.z, b.y) +
                       product(direction.y, a.z, b.x) - product(direction.y, a.x, b.z) +
                       product(direction.z, a.x, b.y) - product(direction.z, a.y, b.x);
    const auto rounded = static_cast<double>(exact);
    return std::abs(rounded) <= 1e-30 * size ? 0.0 : rounded;
}

}  // namespace

ReferenceHit intersectTriangle(const Mesh& mesh, uint32_t triangle, const Vector3d& origin, const Vector3d& direction) {
    const uint32_t* corners = &mesh.indices[triangle * size_t{3}];
    for (int i = 0; i < 3; i++)
        if (!isFinite(mesh.positions[corners[i]])) return {};
    const Vector3d a = Vector3d(mesh.positions[corners[0]]) - origin;
    const Vector3d b = Vector3d(mesh.positions[corners[1]]) - origin;
    const Vector3d c = Vector3d(mesh.positions[corners[2]]) - origin;
    const double u = edgeVolume(direction, c, b);
    const double v = edgeVolume(direction, a, c);
    const double w = edgeVolume(direction, b, a);
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return {};
    const double sum = u + v + w;
    if (sum == 0.0) return {};
    const Vector3d normal = glm::cross(b - a, c - a);
    const double t = glm::dot(a, normal) / glm::dot(direction, normal);
    if (!std::isfinite(t)) return {};
    return {.hit = true, .t = t, .triangle = triangle, .barycentrics = {v / sum, w / sum}};
}

ReferenceHit closestHit(const Mesh& mesh, const Vector3d& origin, const Vector3d& direction, double t_min,
                        double t_max) {
    ReferenceHit best;
    best.t = t_max;
    for (uint32_t i = 0; i < mesh.triangleCount(); i++) {
        const ReferenceHit hit = intersectTriangle(mesh, i, origin, direction);
        if (hit.hit && hit.t >= t_min && (best.hit ? hit.t < best.t : hit.t <= best.t)) best = hit;
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
