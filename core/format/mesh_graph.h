#pragma once

#include <glint/base/expected.h>
#include <glint/base/status.h>
#include <glint/format/mesh.h>
#include <glint/math/camera.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace glint {

/// At most 128 triangles with at most 128 vertices: what one workgroup draws. As a shader reads it (std430, 80 bytes).
struct MeshCluster {
    static constexpr uint32_t max_vertices = 128;
    static constexpr uint32_t max_triangles = 128;

    Vector3f center = {0, 0, 0};  ///< of a ball around its vertices
    float radius = 0.0f;
    Vector3f cone_axis = {0, 0, 1};  ///< of unit length; see isFacingAway
    float cone_cutoff = 2.0f;        ///< sine of the cone's half angle; 2 if it faces every way
    Vector3f box_min = {0, 0, 0};    ///< exact
    uint32_t first_vertex = 0;       ///< of MeshGraph::clusterVertices
    Vector3f box_max = {0, 0, 0};    ///< exact
    uint32_t first_triangle = 0;     ///< of MeshGraph::clusterTriangles
    uint32_t counts = 0;             ///< of vertices, and of triangles << 16
    uint32_t part = 0;               ///< of MeshGraph::parts
    uint32_t source = UINT32_MAX;    ///< the group that it simplifies, together with others; none: the mesh as it was
    uint32_t group = UINT32_MAX;     ///< the group that it belongs to, and is simplified with; none: a root

    uint32_t vertexCount() const { return counts & 0xffffu; }
    uint32_t triangleCount() const { return counts >> 16; }

    /// True only if all its triangles are clockwise, or edge-on, seen from the eye.
    bool isFacingAway(const Vector3f& eye) const;

    bool operator==(const MeshCluster&) const = default;
};
static_assert(sizeof(MeshCluster) == 80);

/// Clusters (its children) that have been simplified together to fewer ones (its parents), along the border of which
/// nothing was changed: so either stand for the other. As a shader reads it (std430, 64 bytes).
struct MeshClusterGroup {
    Vector3f center = {0, 0, 0};  ///< of a ball around all of the mesh that the parents stand for, and they themselves
    float radius = 0.0f;          ///< it holds the balls of the children's sources
    Vector3f box_min = {0, 0, 0};
    float error = 0.0f;  ///< between the mesh and the parents; at least that of the children's sources
    Vector3f box_max = {0, 0, 0};
    uint32_t level = 0;  ///< 1 + the highest of the children's sources; 0 if all of them are of the mesh as it was
    uint32_t first_child = 0;  ///< of MeshGraph::clusters
    uint32_t child_count = 0;
    uint32_t first_parent = 0;  ///< of MeshGraph::parents
    uint32_t parent_count = 0;
    bool operator==(const MeshClusterGroup&) const = default;
};
static_assert(sizeof(MeshClusterGroup) == 64);

/// From where a mesh is seen, in the mesh's own space, and how its errors look from there.
struct MeshGraphView {
    Vector3f eye = {0, 0, 0};
    float scale = 0.0f;            ///< pixels that a length of 1 takes at most at depth 1, anywhere in the picture
    Vector3f forward = {0, 0, 0};  ///< depth of a point p: dot(forward, p - eye)
    float stretch = 0.0f;          ///< length of `forward`: by how much a ball's radius counts in depth
    float slant = 0.0f;  ///< what is in the picture at a distance d from the eye has at least the depth slant * d
    float near = 0.0f;   ///< depth of the near plane

    /// For a camera, a picture of this size in pixels, and an instance of the mesh, whose transform may be anything
    /// invertible. docs/meshes.md derives the numbers.
    MeshGraphView() = default;
    MeshGraphView(const CameraParameters& camera, const Vector2u& size, const Transform3x4& instance = {});

    /// Bound of a group's error in pixels, wherever it is in the picture:
    ///
    ///     error * scale / max(dot(forward, v) - stretch * radius, slant * (length(v) - radius), near)
    ///
    /// with v = center - eye. A group that contains another has at least that group's value, rounding to float32
    /// included.
    float error(const MeshClusterGroup& group) const;
};

/// A named part of the mesh; its clusters have its number.
struct MeshGraphPart {
    std::string name;
    uint32_t material = UINT32_MAX;  ///< of the scene that the mesh was part of; UINT32_MAX is none
    bool operator==(const MeshGraphPart&) const = default;
};

/// What a graph consists of, as a plain value.
struct MeshGraphArrays {
    std::vector<Vector3f> positions;
    std::vector<Vector3f> normals;           ///< empty, or one for each position
    std::vector<Vector2f> texcoords;         ///< empty, or one for each position
    std::vector<MeshCluster> clusters;       ///< the roots first, then the children of each group in order
    std::vector<MeshClusterGroup> groups;    ///< those above first
    std::vector<uint32_t> parents;           ///< of the groups: clusters
    std::vector<uint32_t> cluster_vertices;  ///< of the clusters: positions
    /// Of the clusters: corners a, b, c of a triangle as a | b << 10 | c << 20, counted within the cluster.
    std::vector<uint32_t> cluster_triangles;
    std::vector<MeshGraphPart> parts;
    uint32_t root_count = 0;
};

/// A mesh at many levels of detail at once: a graph of clusters, some of which can be drawn in place of others without
/// a crack between them. Made by createMeshGraph (<glint/geometry/mesh_graph_builder.h>), read from a file. Constant;
/// copies share.
///
/// A choice of clusters is a cut: a group is either refined (its children, or what stands for them, are drawn) or not
/// (its parents, or what stands for them, are). Where no group is refined whose container is not, the clusters whose
/// source is not refined and whose group is cover the mesh exactly once. A threshold on `error`, or on
/// MeshGraphView::error, is such a rule.
class MeshGraph {
public:
    /// A graph without anything.
    MeshGraph() = default;

    /// Checks everything that walking the graph and drawing it relies on. Errors: "graph.counts" (a count beyond the
    /// format's, or of attributes), "graph.cluster", "graph.group", "graph.index_range", "graph.not_finite",
    /// "graph.order" (groups that contain themselves, or are finer than what they contain).
    static Expected<MeshGraph> create(const MeshGraphArrays& arrays);

    /// Reads a file as save() writes it; docs/meshes.md has the format. The file's bytes are the value's memory:
    /// reading and checking is all there is. Errors: those of readFile; "graph.magic", "graph.version", "graph.size"
    /// (of the file and what it says to hold), and those of create().
    static Expected<MeshGraph> load(const std::filesystem::path& path, uint64_t limit = Mesh::default_limit);
    /// The same from bytes, which are copied. `name` names them in errors.
    static Expected<MeshGraph> decode(std::span<const std::byte> bytes, const std::string& name);

    /// Errors: those of writeFile.
    Status save(const std::filesystem::path& path) const;
    /// What save() writes.
    std::span<const std::byte> bytes() const { return {data_.get(), size_}; }

    std::span<const Vector3f> positions() const;
    std::span<const Vector3f> normals() const;    ///< empty, or one for each position
    std::span<const Vector2f> texcoords() const;  ///< empty, or one for each position
    std::span<const MeshCluster> clusters() const;
    std::span<const MeshClusterGroup> groups() const;
    std::span<const uint32_t> parents() const;
    std::span<const uint32_t> clusterVertices() const;
    std::span<const uint32_t> clusterTriangles() const;
    std::vector<MeshGraphPart> parts() const;
    /// The first so many clusters are in no group. A walk starts from them.
    uint32_t rootCount() const;
    /// The children of a cluster's source, if it is the first of the source's parents: so a walk from the roots, which
    /// goes on to these wherever the source is refined, comes by each cluster of refined groups once.
    std::span<const MeshCluster> children(uint32_t cluster) const;

    /// Calls refine(group) at most once for each group, and visit(cluster) for each cluster of the cut, from the roots
    /// on. As children() says, by the walk that a shader makes.
    void walk(const std::function<bool(const MeshClusterGroup&)>& refine,
              const std::function<void(uint32_t cluster)>& visit) const;

    /// The clusters that stand for the mesh with an error of at most `error`, in units of the mesh: ascending.
    std::vector<uint32_t> cut(float error) const;
    /// Those that do so with at most `pixels` in a view.
    std::vector<uint32_t> cut(const MeshGraphView& view, float pixels) const;

    /// The triangles of some clusters, with the vertices that they use, parts as in parts(), empty ones left out.
    Mesh mesh(std::span<const uint32_t> clusters) const;

private:
    struct Section {
        uint64_t offset = 0;
        uint64_t count = 0;
    };
    template <class T>
    std::span<const T> array(size_t section) const;
    static Expected<MeshGraph> adopt(std::shared_ptr<const std::byte[]> data, uint64_t size);
    Status check() const;
    Status checkClusters() const;
    Status checkGroups() const;

    std::shared_ptr<const std::byte[]> data_;
    uint64_t size_ = 0;
    uint32_t root_count_ = 0;
    std::array<Section, 10> sections_ = {};
};

}  // namespace glint
