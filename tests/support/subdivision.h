#pragma once

// Subdivision surfaces in float64, written down from the papers' rules face by face: slow, and independent of the
// SDK's.

#include <glint/geometry/refine.h>

#include <map>
#include <utility>
#include <vector>

namespace glint::test {

struct ReferenceSurface {
    std::vector<Vector3d> points;
    std::vector<std::vector<uint32_t>> faces;
    std::map<std::pair<uint32_t, uint32_t>, double> sharpness;  ///< of edges, the lower vertex first; 0 if absent

    explicit ReferenceSurface(const PolygonMesh& mesh);
    ReferenceSurface() = default;
};

/// One step. Vertices keep their numbers and come first.
ReferenceSurface subdivide(const ReferenceSurface& surface, Subdivision scheme);

/// The faces around a vertex, which becomes vertex 0: a step brings it, the edges and the faces there to the same
/// places whether or not the rest is there.
ReferenceSurface ringAround(const ReferenceSurface& surface, uint32_t vertex);

/// Where a vertex comes to rest: 100 steps of its ring.
Vector3d limitPosition(const ReferenceSurface& surface, uint32_t vertex, Subdivision scheme);

/// The mean normal, weighted by area, of what face `face` around the vertex has become after `steps`, with the faces
/// that are joined to it around the vertex by edges of no sharpness. The ring is brought back to size 1 at each step,
/// so that nothing is lost to rounding.
Vector3d limitNormal(const ReferenceSurface& surface, uint32_t vertex, uint32_t face, Subdivision scheme, int steps);

/// Uniform bicubic B-spline over a grid of control points, row by row, at (u, v) in units of cells; beyond the grid
/// each row and column goes on straight, as boundary rules have it. Value and the two derivatives.
struct SplinePoint {
    Vector3d value, du, dv;
};
SplinePoint bicubicSpline(const std::vector<Vector3d>& grid, int columns, double u, double v);

/// Quartic box spline over the same kind of grid with triangles along the diagonals (0, 0) to (1, 1). At least two
/// cells from the grid's border.
SplinePoint boxSpline(const std::vector<Vector3d>& grid, int columns, double u, double v);

}  // namespace glint::test
