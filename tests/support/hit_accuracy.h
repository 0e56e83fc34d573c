#pragma once

// Hits in float32 against float64: which differences rounding explains, and how large the errors are.

#include "support/reference_hierarchy.h"

#include <glint/graphics/ray_caster.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace glint::test {

/// How far float32 arithmetic may move the hit of a ray with a triangle; docs/accuracy.md derives it.
struct HitBound {
    double edge = 0.0;  ///< distance between the ray and the triangle's border at which it may hit or miss
    double t = 0.0;     ///< error of t, in lengths of the direction
};
HitBound hitBound(const Mesh& mesh, uint32_t triangle, const Ray& ray);

/// Distance from the line of a ray to the border of a triangle.
double borderDistance(const Mesh& mesh, uint32_t triangle, const Ray& ray);

/// What compareHits finds.
struct HitComparison {
    uint64_t rays = 0;
    uint64_t hits = 0;    ///< rays that hit by float64
    uint64_t differ = 0;  ///< rays that miss, hit or name another triangle than float64 does, within the bounds
    uint64_t wrong = 0;   ///< rays whose result no rounding within the bounds explains
    std::string first;    ///< the first of those
    double worst = 0.0;   ///< largest error of t in units of its bound
    /// For each hit, sorted: |t - t64| |direction| / (|origin| + t64 |direction|), t64 being the exact t for the
    /// triangle that the hit names, and the distance of the barycentrics' point from the exact point over the same
    /// length.
    std::vector<double> t_errors;
    std::vector<double> place_errors;

    /// The error that a share of the hits (0 to 1) does not exceed; 0 without hits.
    static double quantile(const std::vector<double>& errors, double share);
};

/// A hit is right if the ray passes through the triangle it names, but for the bound at its border; if t differs from
/// the exact one by no more than its bound; and if no triangle lies nearer by more than both bounds whose border the
/// ray keeps clear of. A miss is right if no such triangle lies anywhere between t_min and t_max.
HitComparison compareHits(const ReferenceHierarchy& reference, std::span<const Ray> rays, std::span<const RayHit> hits);

/// Rays that see a mesh from all sides, the same on every machine: every other one from a sphere around its box to a
/// point in the box, the rest from points in the box in any direction.
std::vector<Ray> raysAround(const Mesh& mesh, uint32_t count, uint64_t seed = 1);

/// Rays from within a closed mesh to its corners, and to points on its edges. Their origins lie within `spread` of the
/// origin of coordinates.
std::vector<Ray> raysAtCorners(const Mesh& mesh, uint32_t count, double spread = 0.0);
std::vector<Ray> raysAtEdges(const Mesh& mesh, uint32_t count, double spread = 0.0);

}  // namespace glint::test
