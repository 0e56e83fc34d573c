#include "support/hit_accuracy.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace glint::test {

namespace {

constexpr double unit = 0x1p-24;  ///< largest relative error of one rounding to float32

struct Corners {
    Vector3d a, b, c;  ///< seen from the ray's origin
};

Corners cornersOf(const Mesh& mesh, uint32_t triangle, const Ray& ray) {
    const uint32_t* corners = &mesh.indices[triangle * size_t{3}];
    const Vector3d origin(ray.origin);
    return {Vector3d(mesh.positions[corners[0]]) - origin, Vector3d(mesh.positions[corners[1]]) - origin,
            Vector3d(mesh.positions[corners[2]]) - origin};
}

/// Distance between the line through the origin along the unit vector `d` and the segment from `p` to `q`.
double lineToSegment(const Vector3d& d, const Vector3d& p, const Vector3d& q) {
    // Seen along the line both are in a plane, and the line is a point.
    const Vector3d from = p - d * glm::dot(p, d);
    const Vector3d to = q - d * glm::dot(q, d);
    const Vector3d along = to - from;
    const double square = glm::dot(along, along);
    const double place = square > 0.0 ? std::clamp(-glm::dot(from, along) / square, 0.0, 1.0) : 0.0;
    return glm::length(from + along * place);
}

}  // namespace

HitBound hitBound(const Mesh& mesh, uint32_t triangle, const Ray& ray) {
    const Corners corners = cornersOf(mesh, triangle, ray);
    const Vector3d direction(ray.direction);
    const double length = glm::length(direction);
    const double reach = std::max({glm::length(corners.a), glm::length(corners.b), glm::length(corners.c)});
    const double side = std::max(
        {glm::length(corners.b - corners.a), glm::length(corners.c - corners.b), glm::length(corners.a - corners.c)});
    // Twice the area as seen along the ray, and on the triangle itself.
    const Vector3d normal = glm::cross(corners.b - corners.a, corners.c - corners.a);
    const double area = glm::length(normal);
    const double seen = std::abs(glm::dot(normal, direction)) / length;
    HitBound bound;
    bound.edge = 16.0 * unit * reach;
    bound.t = unit * (16.0 * reach * area / seen + 6.0 * side * side * side / seen + 4.0 * reach) / length;
    return bound;
}

double borderDistance(const Mesh& mesh, uint32_t triangle, const Ray& ray) {
    const Corners corners = cornersOf(mesh, triangle, ray);
    const Vector3d d = glm::normalize(Vector3d(ray.direction));
    return std::min({lineToSegment(d, corners.a, corners.b), lineToSegment(d, corners.b, corners.c),
                     lineToSegment(d, corners.c, corners.a)});
}

double HitComparison::quantile(const std::vector<double>& errors, double share) {
    if (errors.empty()) return 0.0;
    const auto place = static_cast<size_t>(std::ceil(share * static_cast<double>(errors.size())));
    return errors[std::clamp<size_t>(place, 1, errors.size()) - 1];
}

HitComparison compareHits(const ReferenceHierarchy& reference, std::span<const Ray> rays,
                          std::span<const RayHit> hits) {
    const Mesh& mesh = reference.mesh();
    HitComparison result;
    result.rays = rays.size();
    const auto complain = [&](size_t i, const std::string& what) {
        if (result.wrong++ == 0) result.first = fmt::format("ray {}: {}", i, what);
    };
    if (hits.size() != rays.size()) {
        complain(0, fmt::format("{} hits for {} rays", hits.size(), rays.size()));
        return result;
    }
    for (size_t i = 0; i < rays.size(); i++) {
        const Ray& ray = rays[i];
        const RayHit& hit = hits[i];
        const Vector3d origin(ray.origin);
        const Vector3d direction(ray.direction);
        const ReferenceHit exact = reference.closestHit(origin, direction, ray.t_min, ray.t_max);
        result.hits += exact.hit;
        result.differ += exact.hit != hit.isHit() || (exact.hit && exact.triangle != hit.primitive);

        double nearest = ray.t_max;  // where anything that must be hit has to lie before
        if (hit.isHit()) {
            if (hit.primitive >= mesh.triangleCount()) {
                complain(i, fmt::format("triangle {} of {}", hit.primitive, mesh.triangleCount()));
                continue;
            }
            // The plane's t: the ray may pass the triangle at its border.
            const Corners corners = cornersOf(mesh, hit.primitive, ray);
            const Vector3d normal = glm::cross(corners.b - corners.a, corners.c - corners.a);
            const double t = glm::dot(corners.a, normal) / glm::dot(direction, normal);
            const HitBound bound = hitBound(mesh, hit.primitive, ray);
            const bool inside = intersectTriangle(mesh, hit.primitive, origin, direction).hit;
            if (!inside && borderDistance(mesh, hit.primitive, ray) > bound.edge) {
                complain(i, fmt::format("it passes triangle {} at {} of the bound", hit.primitive,
                                        borderDistance(mesh, hit.primitive, ray) / bound.edge));
                continue;
            }
            const double error = std::abs(hit.t - t);
            result.worst = std::max(result.worst, error / bound.t);
            if (!(error <= bound.t) || t < ray.t_min - bound.t || t > ray.t_max + bound.t) {
                complain(i, fmt::format("t of triangle {} is {}, not {}: {} of the bound", hit.primitive, hit.t, t,
                                        error / bound.t));
                continue;
            }
            const double scale = glm::length(origin) + t * glm::length(direction);
            result.t_errors.push_back(error * glm::length(direction) / scale);
            const Vector3d place = corners.a + static_cast<double>(hit.u) * (corners.b - corners.a) +
                                   static_cast<double>(hit.v) * (corners.c - corners.a);
            result.place_errors.push_back(glm::length(place - t * direction) / scale);
            nearest = t - bound.t;
        }
        const bool may_be_right = exact.hit && exact.t < nearest;
        if (!may_be_right) continue;
        const ReferenceHit missed =
            reference.closestHit(origin, direction, ray.t_min, nearest, [&](const ReferenceHit& candidate) {
                const HitBound bound = hitBound(mesh, candidate.triangle, ray);
                return candidate.t < nearest - bound.t && candidate.t > ray.t_min + bound.t &&
                       borderDistance(mesh, candidate.triangle, ray) > bound.edge;
            });
        if (missed.hit)
            complain(
                i, fmt::format("it goes through triangle {} at {}, clear of its border by {} of the bound",
                               missed.triangle, missed.t,
                               borderDistance(mesh, missed.triangle, ray) / hitBound(mesh, missed.triangle, ray).edge));
    }
    std::sort(result.t_errors.begin(), result.t_errors.end());
    std::sort(result.place_errors.begin(), result.place_errors.end());
    return result;
}

std::vector<Ray> raysAround(const Mesh& mesh, uint32_t count, uint64_t seed) {
    Random random(seed);
    const BoundBox box = mesh.bounds();
    const Vector3d centre(box.center());
    const Vector3d size(box.size());
    const double radius = glm::length(size);
    const auto inside = [&] {
        return centre +
               size * Vector3d(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5));
    };
    std::vector<Ray> rays;
    for (uint32_t i = 0; i < count; i++) {
        Ray ray;
        if (i % 2 == 0) {
            ray.origin = Vector3f(centre + random.direction() * radius);
            ray.direction = Vector3f(inside()) - ray.origin;
        } else {
            ray.origin = Vector3f(inside());
            ray.direction = Vector3f(random.direction() * radius);
        }
        rays.push_back(ray);
    }
    return rays;
}

namespace {

Ray rayTo(const Vector3d& target, double spread, Random& random) {
    Ray ray;
    ray.origin = Vector3f(random.direction() * random.uniform(0.0, spread));
    ray.direction = Vector3f(target - Vector3d(ray.origin));
    return ray;
}

}  // namespace

std::vector<Ray> raysAtCorners(const Mesh& mesh, uint32_t count, double spread) {
    Random random(5);
    std::vector<Ray> rays;
    for (uint32_t i = 0; i < count; i++)
        rays.push_back(rayTo(Vector3d(mesh.positions[mesh.indices[i % mesh.indices.size()]]), spread, random));
    return rays;
}

std::vector<Ray> raysAtEdges(const Mesh& mesh, uint32_t count, double spread) {
    Random random(7);
    std::vector<Ray> rays;
    for (uint32_t i = 0; i < count; i++) {
        const size_t corner = i % mesh.indices.size();
        const size_t next = corner % 3 == 2 ? corner - 2 : corner + 1;
        const Vector3d a(mesh.positions[mesh.indices[corner]]);
        const Vector3d b(mesh.positions[mesh.indices[next]]);
        rays.push_back(rayTo(glm::mix(a, b, random.uniform(0.05, 0.95)), spread, random));
    }
    return rays;
}

}  // namespace glint::test
