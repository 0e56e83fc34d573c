#pragma once

#include <glint/format/mesh.h>

#include <cstdint>
#include <vector>

namespace glint {

// The order of triangles and vertices in memory, through meshoptimizer. All of these keep the set of triangles (corner
// by corner, up to which corner comes first), and triangles stay in their part. Deterministic. Indices have to be in
// range.

/// What welding has taken away.
struct MeshWeld {
    uint64_t vertices = 0;
    uint64_t triangles = 0;
};
/// Makes one vertex of those that are equal in every attribute, and drops vertices that no triangle uses and triangles
/// with two corners at one place.
MeshWeld weld(Mesh& mesh);

/// Makes one vertex of all those at one position, without normals and texture coordinates: what a flat-shaded mesh
/// needs before it can be simplified.
MeshWeld weldPositions(Mesh& mesh);

/// Orders the triangles of each part so that vertices are used again while a cache still has them.
void optimizeVertexCache(Mesh& mesh);

/// Orders runs of triangles, as optimizeVertexCache leaves them, so that those in front tend to come first from any
/// side. `threshold` is by how much the cache may get worse: 1.05 by at most a twentieth.
void optimizeOverdraw(Mesh& mesh, float threshold = 1.05f);

/// Orders vertices as triangles first use them; vertices in no triangle are dropped.
void optimizeVertexFetch(Mesh& mesh);

/// All three, in the order in which they build on each other.
void optimize(Mesh& mesh);

/// What an order costs.
struct MeshOrderStatistics {
    double acmr = 0.0;       ///< vertices transformed for each triangle, with a cache of 16: 0.5 at best, 3 at worst
    double atvr = 0.0;       ///< vertices transformed for each vertex in use: 1 at best
    double overdraw = 0.0;   ///< pixels shaded for each pixel covered, from six sides: 1 at best
    double overfetch = 0.0;  ///< bytes fetched for each byte of vertices in use, of 32 bytes each: 1 at best
};
/// Takes it from meshoptimizer's models of a device.
MeshOrderStatistics orderStatistics(const Mesh& mesh);

/// What a mesh is like.
struct MeshStatistics {
    uint64_t triangles = 0;
    uint64_t vertices = 0;
    uint64_t unused_vertices = 0;       ///< in no triangle
    uint64_t repeated_vertices = 0;     ///< at a place where a vertex before has been
    uint64_t degenerate_triangles = 0;  ///< with two corners at one place
    uint64_t flat_triangles = 0;        ///< other ones without area
    uint64_t repeated_triangles = 0;    ///< with the same three places as one before
    uint64_t edges = 0;
    uint64_t open_edges = 0;          ///< of one triangle
    uint64_t non_manifold_edges = 0;  ///< of more than two
    uint64_t turned_edges = 0;        ///< of two that run along it in the same direction
    uint64_t components = 0;          ///< that edges hold together
    double area = 0.0;
    double volume = 0.0;  ///< within a closed mesh
    bool isClosed() const { return edges > 0 && open_edges + non_manifold_edges + turned_edges == 0; }
};
/// Edges are counted by position, without triangles that have two corners at one place.
MeshStatistics statistics(const Mesh& mesh);

}  // namespace glint
