#pragma once

#include <glint/device/device.h>
#include <glint/format/mesh_graph.h>

#include <cstdint>
#include <source_location>
#include <string>
#include <string_view>

namespace glint {

/// A graph of levels of detail on a device, as MeshGraphSelector, Rasterizer and task shaders read it; the structures
/// are those of shaders/meshes/graph.h.
///
///     MeshGraphModel model(device, *createMeshGraph(mesh));
///     selector.select(compute, model, instances, count, camera.parameters(), {1600, 900}, 1.0f);
///
/// A value: copies share the buffers. Like a handle it carries its first error, of which the device's message callback
/// is told; using a failed model fails.
///
/// **Pieces.** The clusters that a walk from the roots comes by are a tree: below a cluster are its source's children,
/// if it is the first of the source's parents (MeshGraph::children). The tree is cut into pieces of at most
/// `piece_clusters` clusters, each of which one workgroup walks: so its stack, and what it finds, are never more. A
/// piece is the children of one group, or some of them, or of the roots, and what is below them but not in a piece of
/// its own. It is walked where its group is refined, which says the same of all the groups above.
class MeshGraphModel {
public:
    using Where = std::source_location;

    /// Clusters of a piece, at most.
    static constexpr uint32_t piece_clusters = 2048;

    MeshGraphModel() = default;
    /// This is create(); the error is carried.
    MeshGraphModel(const Device& device, const MeshGraph& graph, std::string_view name = {},
                   Where where = Where::current());

    /// Uploads, anew if there was something. Meshes without normals get those of Mesh::createNormals, from their finest
    /// triangles. Errors: "model.empty" (a graph without clusters), "model.too_large" (an array that exceeds one
    /// storage binding of the device), "model.out_of_memory", those of Device::createBuffer.
    Status create(const Device& device, const MeshGraph& graph, std::string_view name = {},
                  Where where = Where::current());

    /// True once created without an error.
    explicit operator bool() const { return device_ && !error_; }
    /// Why the model failed; "handle.null" before create().
    Error error() const;
    /// Names the model in messages, and its buffers.
    const std::string& name() const { return name_; }

    // All buffers have FlagStorage and are read in GLSL's std430 layout.

    const Buffer& getPositions() const { return positions_; }  ///< float[3] each, tightly packed
    const Buffer& getNormals() const { return normals_; }      ///< the same
    const Buffer& getTexcoords() const { return texcoords_; }  ///< vec2 each; null if the mesh has none
    const Buffer& getClusters() const { return clusters_; }    ///< MeshCluster each, 80 bytes
    const Buffer& getGroups() const { return groups_; }        ///< MeshClusterGroup each, 64 bytes; see groupCount
    const Buffer& getParents() const { return parents_; }      ///< uint each, of the groups: clusters
    const Buffer& getClusterVertices() const { return cluster_vertices_; }  ///< uint each: positions
    /// uint each: corners a | b << 10 | c << 20, counted within the cluster.
    const Buffer& getClusterTriangles() const { return cluster_triangles_; }
    /// uvec2 for each cluster: first and number of the clusters that a walk goes on to within the piece, where the
    /// cluster's source is refined. None at the border of a piece.
    const Buffer& getWalk() const { return walk_; }
    /// MeshPiece each, 16 bytes: the group that has to be refined (0xffffffff: none, always), first and number of the
    /// clusters to begin with, 0.
    const Buffer& getPieces() const { return pieces_; }

    uint32_t vertexCount() const { return vertex_count_; }
    uint32_t clusterCount() const { return cluster_count_; }
    uint32_t rootCount() const { return root_count_; }
    /// May be 0: the buffers of groups and parents then have one element of zeros.
    uint32_t groupCount() const { return group_count_; }
    uint32_t pieceCount() const { return piece_count_; }
    /// No cut has more clusters.
    uint32_t cutLimit() const { return cut_limit_; }
    /// Triangles of the finest cut.
    uint64_t triangleCount() const { return triangle_count_; }
    /// Bytes on the device.
    uint64_t bytes() const;

private:
    Status build(const Device& device, const MeshGraph& graph, Where where);

    std::string name_ = "graph";
    Device device_;
    Error error_;
    Buffer positions_, normals_, texcoords_, clusters_, groups_, parents_, cluster_vertices_, cluster_triangles_;
    Buffer walk_, pieces_;
    uint32_t vertex_count_ = 0, cluster_count_ = 0, root_count_ = 0, group_count_ = 0, piece_count_ = 0;
    uint32_t cut_limit_ = 0;
    uint64_t triangle_count_ = 0;
};

}  // namespace glint
