#pragma once

#include <glint/format/mesh_graph.h>
#include <glint/math/bounds.h>

#include <cstdint>
#include <span>
#include <vector>

namespace glint::detail {

/// For each position the first vertex that has an equal one (0 and -0 are).
std::vector<uint32_t> firstWithPosition(std::span<const Vector3f> positions);

/// A cluster while the graph is built. Corners are vertices of the mesh.
struct BuiltCluster {
    std::vector<uint32_t> indices;
    uint32_t part = 0;
    uint32_t source = UINT32_MAX;
    uint32_t group = UINT32_MAX;
    uint32_t failures = 0;  ///< how often its group could not be simplified
    BoundSphere ball;       ///< of its vertices; of clusters with a source that group's
    BoundBox box;           ///< the same
    float error = 0.0f;     ///< the source's
};

/// The mesh, with what concerns places and not vertices: `places` is firstWithPosition().
struct GraphMesh {
    std::span<const Vector3f> positions;
    std::vector<uint32_t> places;
};

/// Cuts triangles into clusters of neighbours.
std::vector<std::vector<uint32_t>> splitClusters(const GraphMesh& mesh, std::span<const uint32_t> indices);

/// Ball, box and cone.
void setBounds(MeshCluster& cluster, std::span<const Vector3f> positions, std::span<const uint32_t> indices);

/// A ball around balls, larger by 2^-16 of its radius, rounding included.
BoundSphere enclose(std::span<const BoundSphere> balls);

/// An edge between places, low << 32 | high.
using EdgeKey = uint64_t;

/// Some of the clusters of one part, to be simplified together, with what must not change meanwhile.
struct ClusterGroup {
    std::vector<uint32_t> clusters;
    std::vector<EdgeKey> locked_edges;    ///< that triangles outside have too; ascending
    std::vector<uint32_t> locked_places;  ///< that triangles outside have too; ascending
};

/// Divides the pending clusters into groups of about `size` neighbours of one part.
std::vector<ClusterGroup> makeGroups(const GraphMesh& mesh, std::span<const BuiltCluster> clusters,
                                     std::span<const uint32_t> pending, uint32_t size);

/// A group's triangles simplified to about half of them, and the distance between both. Empty where that cannot be done
/// without touching what is locked, or saves too little.
struct SimplifiedGroup {
    std::vector<std::vector<uint32_t>> clusters;
    double distance = 0.0;
};
SimplifiedGroup simplifyGroup(const GraphMesh& mesh, std::span<const BuiltCluster> clusters, const ClusterGroup& group);

}  // namespace glint::detail
