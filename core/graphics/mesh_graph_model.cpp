#include <glint/graphics/mesh_graph_model.h>

#include <glint/base/format_error.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <span>
#include <vector>

namespace glint {

namespace {

/// shaders/meshes/graph.h.
struct Piece {
    uint32_t group = UINT32_MAX;
    uint32_t first_cluster = 0;
    uint32_t cluster_count = 0;
    uint32_t reserved = 0;
};

/// Cuts the walk's tree into pieces from the leaves up: children hang below their parent as long as all of them fit in
/// one piece with it. `walk` gets the borders.
std::vector<Piece> cutIntoPieces(const MeshGraph& graph, std::vector<Vector2u>& walk) {
    constexpr uint32_t limit = MeshGraphModel::piece_clusters;
    std::vector<Piece> pieces;
    walk.assign(graph.clusters().size(), Vector2u(0));
    std::vector<uint32_t> sizes(walk.size(), 1);  // of what is below a cluster in its piece, with it
    const auto cut = [&](uint32_t group, uint32_t first, uint32_t count) {
        uint64_t size = limit;  // so that the first one begins a piece
        for (uint32_t i = first; i < first + count; i++) {
            size += sizes[i];
            if (size > limit) {
                pieces.push_back({group, i, 0});
                size = sizes[i];
            }
            pieces.back().cluster_count++;
        }
    };
    // Groups come before those within them.
    for (size_t i = graph.groups().size(); i-- > 0;) {
        const MeshClusterGroup& group = graph.groups()[i];
        uint64_t size = 1;
        for (uint32_t k = 0; k < group.child_count; k++) size += sizes[group.first_child + k];
        const uint32_t parent = graph.parents()[group.first_parent];
        if (size <= limit) {
            sizes[parent] = static_cast<uint32_t>(size);
            walk[parent] = {group.first_child, group.child_count};
        } else {
            cut(static_cast<uint32_t>(i), group.first_child, group.child_count);
        }
    }
    cut(UINT32_MAX, 0, graph.rootCount());
    return pieces;
}

std::vector<Vector3f> normalsOf(const MeshGraph& graph) {
    Mesh mesh;
    mesh.positions.assign(graph.positions().begin(), graph.positions().end());
    for (const MeshCluster& cluster : graph.clusters()) {
        if (cluster.source != UINT32_MAX) continue;
        for (const uint32_t packed : graph.clusterTriangles().subspan(cluster.first_triangle, cluster.triangleCount()))
            for (const uint32_t shift : {0u, 10u, 20u})
                mesh.indices.push_back(graph.clusterVertices()[cluster.first_vertex + (packed >> shift & 0x3ffu)]);
    }
    mesh.createNormals();
    return std::move(mesh.normals);
}

}  // namespace

MeshGraphModel::MeshGraphModel(const Device& device, const MeshGraph& graph, std::string_view name, Where where) {
    // Carried.
    (void)create(device, graph, name, where);
}

Error MeshGraphModel::error() const {
    if (error_ || device_) return error_;
    return makeError(ErrorCode::InvalidArgument, "handle.null", "the graph's model was not created");
}

Status MeshGraphModel::create(const Device& device, const MeshGraph& graph, std::string_view name, Where where) {
    *this = MeshGraphModel();
    if (!name.empty()) name_ = name;
    if (!device) return Status(error_ = device.error().at(where));
    device_ = device;
    Status status;
    try {
        status = build(device, graph, where);
    } catch (const std::bad_alloc&) {
        status = makeError(where, ErrorCode::OutOfMemory, "model.out_of_memory",
                           "{}: the host has no memory for a graph of {} clusters", name_, graph.clusters().size());
    }
    if (status) return {};
    error_ = status.error().at(where);
    // The device has told of its own.
    if (error_.id().starts_with("model.")) device_.report(error_);
    return error_;
}

Status MeshGraphModel::build(const Device& device, const MeshGraph& graph, Where where) {
    if (graph.clusters().empty())
        return makeError(where, ErrorCode::InvalidArgument, "model.empty", "{}: the graph has no clusters", name_);
    vertex_count_ = static_cast<uint32_t>(graph.positions().size());
    cluster_count_ = static_cast<uint32_t>(graph.clusters().size());
    root_count_ = graph.rootCount();
    group_count_ = static_cast<uint32_t>(graph.groups().size());
    // Refining a group takes its parents away and adds its children.
    cut_limit_ = root_count_;
    for (const MeshClusterGroup& group : graph.groups())
        cut_limit_ += group.child_count - std::min(group.child_count, group.parent_count);
    for (const MeshCluster& cluster : graph.clusters())
        if (cluster.source == UINT32_MAX) triangle_count_ += cluster.triangleCount();

    std::vector<Vector2u> walk;
    const std::vector<Piece> pieces = cutIntoPieces(graph, walk);
    piece_count_ = static_cast<uint32_t>(pieces.size());
    std::vector<Vector3f> normals;
    if (graph.normals().empty()) normals = normalsOf(graph);

    const Features& features = device.getFeatures();
    const uint64_t limit = std::min(features.maxStorageSize, features.maxBufferSize);
    Device maker = device;
    const auto upload = [&](Buffer& buffer, const char* what, const auto& values) -> Status {
        const std::span<const std::byte> bytes = std::as_bytes(std::span(values));
        const std::string name = fmt::format("{} {}", name_, what);
        if (bytes.size() > limit)
            return makeError(where, ErrorCode::OutOfRange, "model.too_large",
                             "{}: {} of {} bytes exceed the {} of one storage binding", name_, what, bytes.size(),
                             limit);
        // Buffers are never empty.
        static constexpr std::array<std::byte, 64> nothing = {};
        buffer = bytes.empty() ? maker.createBuffer(Buffer::FlagStorage, std::span(nothing), name, where)
                               : maker.createBuffer(Buffer::FlagStorage, bytes, name, where);
        return buffer ? Status() : Status(buffer.error());
    };
    Status status = upload(positions_, "positions", graph.positions());
    if (status)
        status = normals.empty() ? upload(normals_, "normals", graph.normals()) : upload(normals_, "normals", normals);
    if (status && !graph.texcoords().empty()) status = upload(texcoords_, "texture coordinates", graph.texcoords());
    if (status) status = upload(clusters_, "clusters", graph.clusters());
    if (status) status = upload(groups_, "groups", graph.groups());
    if (status) status = upload(parents_, "parents", graph.parents());
    if (status) status = upload(cluster_vertices_, "cluster vertices", graph.clusterVertices());
    if (status) status = upload(cluster_triangles_, "cluster triangles", graph.clusterTriangles());
    if (status) status = upload(walk_, "walk", walk);
    if (status) status = upload(pieces_, "pieces", pieces);
    return status;
}

uint64_t MeshGraphModel::bytes() const {
    uint64_t bytes = 0;
    for (const Buffer& buffer : {positions_, normals_, texcoords_, clusters_, groups_, parents_, cluster_vertices_,
                                 cluster_triangles_, walk_, pieces_})
        bytes += buffer.getSize();
    return bytes;
}

}  // namespace glint
