#pragma once

#include <glint/format/mesh_graph.h>

#include <cstdint>
#include <functional>

namespace glint {

/// How a graph of levels of detail is made.
struct MeshGraphOptions {
    uint32_t group_clusters = 8;  ///< clusters that are simplified together, about; 2 to 64
    uint32_t threads = 0;         ///< 0 is one for each core; the graph is the same whatever their number
    /// The bytes of the graph; about six times the mesh and the graph are needed meanwhile.
    uint64_t limit = Mesh::default_limit;
    /// Called with the share that is done, in [0, 1], from the calling thread; false gives up. May be empty.
    std::function<bool(float)> progress;
};

/// Makes a graph of levels of detail from triangles of any kind: open, closed or neither, several at an edge,
/// degenerate and repeated ones, with seams. Clusters hold triangles of one part only.
///
/// - The clusters without a source are the mesh's triangles, but those that have two corners at one place.
/// - Groups of neighbouring clusters are simplified to about half (meshoptimizer). Edges at which a group borders on
///   another, on another part or on nothing stay as they are, corner by corner, and so does the boundary of every set
///   of triangles, as a sum of directed edges: whatever the library does is compared with that and taken back where it
///   is not so. Hence no cut has a crack that the mesh does not have.
/// - Simplifying ends with one cluster for each part, or where a group keeps more than 85 of 100 triangles twice.
/// - A group's error bounds the two-sided Hausdorff distance between the mesh's triangles that its parents stand for
///   and the parents, in units of the mesh: the largest error of the children's sources, plus the distance between
///   children and parents (hausdorffDistance, which bounds it for every point), rounded up. Distances between sets of
///   points add up, so the bound holds for each cut: every point of the mesh has one of the cut within the largest
///   error of the clusters' sources, and the other way round. Normals and texture coordinates are not judged by it.
/// - Vertices are the mesh's, those without a triangle left out, in the order in which they are first used, coarse
/// levels
///   first.
///
/// Deterministic. Errors: those of Mesh::validate; "graph.too_large" (more than 2^32 - 1 indices, coordinates beyond
/// 2^60, more than `limit` bytes), "graph.options", "graph.no_triangles" (all are degenerate), "graph.cancelled".
Expected<MeshGraph> createMeshGraph(const Mesh& mesh, const MeshGraphOptions& options = {});

}  // namespace glint
