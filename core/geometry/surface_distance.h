#pragma once

#include <glint/format/mesh.h>

#include <cstdint>
#include <span>

namespace glint {

/// How far two surfaces are from each other: bounds of the two-sided Hausdorff distance, which is the largest distance
/// from a point of either surface to the nearest point of the other.
struct SurfaceDistance {
    double lower = 0.0;  ///< the distance of a point that was found
    double upper = 0.0;  ///< no point is further away
};

/// Bounds the distance between two sets of triangles that cover the same place, such as a mesh and its simplification.
///
/// The upper bound holds for every point, not for samples: the distance to one triangle is a convex function, so on a
/// convex polygon it is largest at a corner. A triangle of one surface is cut along the borders of the nearest
/// triangles of the other until that bound is at most `tolerance` above the distance of a point that was found (or
/// below 2^-20 of the size of the surfaces); where 2^16 pieces and 16 for each triangle do not suffice, the bound
/// that the last pieces have stands. Rounding is part of it: float64 throughout, and 2^-40 of the largest coordinate on
/// top.
///
/// Infinite if only one of the two has triangles. Indices have to be in range and positions finite.
SurfaceDistance hausdorffDistance(std::span<const Vector3f> positions_a, std::span<const uint32_t> indices_a,
                                  std::span<const Vector3f> positions_b, std::span<const uint32_t> indices_b,
                                  double tolerance = 0.05);
SurfaceDistance hausdorffDistance(const Mesh& a, const Mesh& b, double tolerance = 0.05);

}  // namespace glint
