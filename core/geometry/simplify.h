#pragma once

#include <glint/base/expected.h>
#include <glint/format/mesh.h>
#include <glint/geometry/surface_distance.h>

#include <limits>

namespace glint {

/// How far a mesh is simplified.
struct SimplifyOptions {
    double ratio = 0.5;  ///< of triangles to keep, about: simplifying stops there; in [0, 1]
    /// Largest distance, in units of the mesh; infinite if the ratio alone counts. See SimplifiedMesh::distance.
    double max_error = std::numeric_limits<double>::infinity();
    bool keep_border = false;  ///< leave vertices on edges of one triangle where they are
};

/// What simplify() gives.
struct SimplifiedMesh {
    Mesh mesh;                 ///< with vertices of the original one, those not used left out
    SurfaceDistance distance;  ///< between it and the original
};

/// Removes triangles by collapsing edges where it matters least (meshoptimizer), part by part: parts keep the borders
/// that they share. The topology of a mesh whose edges have at most two triangles stays: no holes, no merging. With
/// `max_error`, the distance between the result and the original is at most that, as hausdorffDistance bounds it; the
/// most simplified of some attempts that keeps it is the result, or the mesh as it was.
///
/// A vertex that has several normals or texture coordinates holds up simplifying: see weldPositions. Errors: those of
/// Mesh::validate, "simplify.options" (a ratio outside of [0, 1], an error that is negative or NaN),
/// "simplify.too_large" (more than 2^32 - 1 indices).
Expected<SimplifiedMesh> simplify(const Mesh& mesh, const SimplifyOptions& options = {});

}  // namespace glint
