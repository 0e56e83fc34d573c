#include <glint/geometry/mesh_graph_builder.h>

#include <glint/base/format_error.h>
#include <glint/base/thread_pool.h>
#include <glint/geometry/detail/graph_build.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <thread>

namespace glint {

namespace {

using detail::BuiltCluster;
using detail::ClusterGroup;
using detail::SimplifiedGroup;

struct BuiltGroup {
    std::vector<uint32_t> children;
    std::vector<uint32_t> parents;
    BoundSphere ball;
    BoundBox box;
    float error = 0.0f;
    uint32_t level = 0;
};

class Builder {
public:
    Builder(const Mesh& mesh, const MeshGraphOptions& options)
        : mesh_(mesh), options_(options), places_{mesh.positions, detail::firstWithPosition(mesh.positions)} {
        const uint32_t threads = options.threads > 0 ? options.threads : std::thread::hardware_concurrency();
        if (threads > 1) pool_.emplace(threads - 1);
    }

    Expected<MeshGraph> build() {
        makeLeaves();
        if (clusters_.empty())
            return unexpected(makeError(ErrorCode::InvalidArgument, "graph.no_triangles",
                                        "all {} triangles have two corners at one place", mesh_.triangleCount()));
        while (!pending_.empty()) {
            if (!simplifyLevel())
                return unexpected(makeError(ErrorCode::InvalidArgument, "graph.cancelled", "given up after {} groups",
                                            groups_.size()));
        }
        return assemble();
    }

private:
    void makeLeaves() {
        uint32_t end = 0;
        for (size_t i = 0; i <= mesh_.parts.size(); i++) {
            // What lies between parts, or is all there is, has a part without a name.
            const bool is_last = i == mesh_.parts.size();
            const uint32_t begin = is_last ? static_cast<uint32_t>(mesh_.indices.size()) : mesh_.parts[i].first_index;
            if (begin > end) addPart({.name = {}, .first_index = end, .index_count = begin - end});
            if (is_last) break;
            addPart(mesh_.parts[i]);
            end = mesh_.parts[i].first_index + mesh_.parts[i].index_count;
        }
        pending_.resize(clusters_.size());
        std::iota(pending_.begin(), pending_.end(), 0u);
        for (const BuiltCluster& cluster : clusters_) work_ += cluster.indices.size();
        left_ = work_;
    }

    void addPart(const MeshPart& part) {
        std::vector<uint32_t> indices;
        for (size_t i = part.first_index; i < size_t{part.first_index} + part.index_count; i += 3) {
            const uint32_t* corners = &mesh_.indices[i];
            const uint32_t a = places_.places[corners[0]], b = places_.places[corners[1]],
                           c = places_.places[corners[2]];
            if (a != b && b != c && c != a) indices.insert(indices.end(), corners, corners + 3);
        }
        const auto number = static_cast<uint32_t>(parts_.size());
        parts_.push_back({part.name, part.material});
        if (indices.empty()) return;
        for (std::vector<uint32_t>& cluster : detail::splitClusters(places_, indices))
            addCluster(std::move(cluster), number);
    }

    BuiltCluster& addCluster(std::vector<uint32_t> indices, uint32_t part) {
        BuiltCluster& cluster = clusters_.emplace_back();
        std::vector<Vector3f> points(indices.size());
        for (size_t i = 0; i < indices.size(); i++) points[i] = mesh_.positions[indices[i]];
        cluster.ball = BoundSphere(points);
        cluster.box = BoundBox(points);
        cluster.indices = std::move(indices);
        cluster.part = part;
        return cluster;
    }

    /// Simplifies what can be of the pending clusters; false if the caller gives up.
    bool simplifyLevel() {
        const std::vector<ClusterGroup> planned =
            detail::makeGroups(places_, clusters_, pending_, options_.group_clusters);
        std::vector<SimplifiedGroup> results(planned.size());
        std::atomic<size_t> next = 0;
        std::atomic<uint64_t> done = 0;
        std::atomic<bool> is_cancelled = false;
        // All threads take groups; this one tells how far they are.
        const auto work = [&](bool tells) {
            for (size_t group = next++; group < planned.size() && !is_cancelled; group = next++) {
                if (planned[group].clusters.size() > 1)
                    results[group] = detail::simplifyGroup(places_, clusters_, planned[group]);
                for (const uint32_t cluster : planned[group].clusters) done += clusters_[cluster].indices.size();
                if (tells && !tell(done)) is_cancelled = true;
            }
        };
        if (pool_)
            for (uint32_t i = 0; i < pool_->size(); i++) pool_->submit([&] { work(false); });
        work(true);
        if (pool_) pool_->wait();
        if (is_cancelled) return false;

        std::vector<uint32_t> pending;
        for (size_t i = 0; i < planned.size(); i++) {
            if (!std::isfinite(results[i].distance)) results[i].clusters.clear();
            if (results[i].clusters.empty())
                retry(planned[i], pending);
            else
                addGroup(planned[i], results[i], pending);
        }
        dropFinished(pending);
        pending_ = std::move(pending);
        left_ = 0;
        for (const uint32_t cluster : pending_) left_ += clusters_[cluster].indices.size();
        return tell(0);
    }

    /// With `done` indices of this level seen to, each of which leaves half of one.
    bool tell(uint64_t done) {
        if (!options_.progress) return true;
        const uint64_t halved = std::min(done, left_) / 2;
        told_ = std::max(told_, 1.0f - static_cast<float>(left_ - halved) / static_cast<float>(work_));
        return options_.progress(told_);
    }

    /// Clusters that could not be simplified may be in other company.
    void retry(const ClusterGroup& group, std::vector<uint32_t>& pending) {
        for (const uint32_t cluster : group.clusters)
            if (++clusters_[cluster].failures < 2) pending.push_back(cluster);
    }

    void addGroup(const ClusterGroup& plan, SimplifiedGroup& result, std::vector<uint32_t>& pending) {
        const auto number = static_cast<uint32_t>(groups_.size());
        BuiltGroup& group = groups_.emplace_back();
        group.children = plan.clusters;
        std::vector<BoundSphere> balls;
        float error = 0.0f;
        for (const uint32_t i : plan.clusters) {
            BuiltCluster& child = clusters_[i];
            child.group = number;
            balls.push_back(child.ball);
            group.box.add(child.box);
            error = std::max(error, child.error);
            if (child.source != UINT32_MAX) group.level = std::max(group.level, groups_[child.source].level + 1);
        }
        group.ball = detail::enclose(balls);
        // Larger than what it contains by 2^-10, for those who compare projected errors in float32.
        const double sum = std::max(error + result.distance, error * (1.0 + 0x1p-10));
        group.error = static_cast<float>(sum);
        if (group.error < sum) group.error = std::nextafter(group.error, std::numeric_limits<float>::infinity());

        const uint32_t part = clusters_[plan.clusters.front()].part;
        for (std::vector<uint32_t>& indices : result.clusters) {
            const auto parent = static_cast<uint32_t>(clusters_.size());
            BuiltCluster& cluster = addCluster(std::move(indices), part);
            cluster.source = number;
            cluster.ball = group.ball;
            cluster.box = group.box;
            cluster.error = group.error;
            group.parents.push_back(parent);
            pending.push_back(parent);
        }
    }

    /// A part that is down to one cluster needs no more.
    void dropFinished(std::vector<uint32_t>& pending) const {
        std::vector<uint32_t> counts(parts_.size(), 0);
        for (const uint32_t cluster : pending) counts[clusters_[cluster].part]++;
        std::erase_if(pending, [&](uint32_t cluster) { return counts[clusters_[cluster].part] == 1; });
    }

    /// Numbers clusters and groups from above: roots, then the children of each group; groups last made come first.
    Expected<MeshGraph> assemble() {
        MeshGraphArrays arrays;
        arrays.parts = parts_;
        std::vector<uint32_t> order;
        for (uint32_t i = 0; i < clusters_.size(); i++)
            if (clusters_[i].group == UINT32_MAX) order.push_back(i);
        arrays.root_count = static_cast<uint32_t>(order.size());
        const auto group_count = static_cast<uint32_t>(groups_.size());
        for (uint32_t i = group_count; i-- > 0;)
            order.insert(order.end(), groups_[i].children.begin(), groups_[i].children.end());
        std::vector<uint32_t> numbers(order.size());
        for (uint32_t i = 0; i < order.size(); i++) numbers[order[i]] = i;

        uint32_t child = arrays.root_count;
        for (uint32_t i = group_count; i-- > 0;) {
            const BuiltGroup& group = groups_[i];
            arrays.groups.push_back({.center = group.ball.center,
                                     .radius = group.ball.radius,
                                     .box_min = group.box.min,
                                     .error = group.error,
                                     .box_max = group.box.max,
                                     .level = group.level,
                                     .first_child = child,
                                     .child_count = static_cast<uint32_t>(group.children.size()),
                                     .first_parent = static_cast<uint32_t>(arrays.parents.size()),
                                     .parent_count = static_cast<uint32_t>(group.parents.size())});
            child += arrays.groups.back().child_count;
            for (const uint32_t parent : group.parents) arrays.parents.push_back(numbers[parent]);
        }
        const auto groupNumber = [&](uint32_t group) {
            return group == UINT32_MAX ? UINT32_MAX : group_count - 1 - group;
        };
        std::vector<uint32_t> vertices(mesh_.positions.size(), UINT32_MAX);
        for (const uint32_t i : order) {
            const BuiltCluster& built = clusters_[i];
            MeshCluster cluster;
            detail::setBounds(cluster, mesh_.positions, built.indices);
            cluster.part = built.part;
            cluster.source = groupNumber(built.source);
            cluster.group = groupNumber(built.group);
            addTriangles(cluster, built.indices, vertices, arrays);
            arrays.clusters.push_back(cluster);
            if (arrays.cluster_vertices.size() * 8 > options_.limit)
                return unexpected(tooLarge(arrays.cluster_vertices.size() * 8));
        }
        Expected<MeshGraph> graph = MeshGraph::create(arrays);
        if (graph && graph->bytes().size() > options_.limit) return unexpected(tooLarge(graph->bytes().size()));
        return graph;
    }

    Error tooLarge(uint64_t bytes) const {
        return makeError(ErrorCode::OutOfRange, "graph.too_large", "the graph takes {} bytes or more, the limit is {}",
                         bytes, options_.limit);
    }

    void addTriangles(MeshCluster& cluster, std::span<const uint32_t> indices, std::vector<uint32_t>& numbers,
                      MeshGraphArrays& arrays) const {
        cluster.first_vertex = static_cast<uint32_t>(arrays.cluster_vertices.size());
        cluster.first_triangle = static_cast<uint32_t>(arrays.cluster_triangles.size());
        uint32_t packed = 0;
        for (size_t k = 0; k < indices.size(); k++) {
            uint32_t& number = numbers[indices[k]];
            if (number == UINT32_MAX) {
                number = static_cast<uint32_t>(arrays.positions.size());
                arrays.positions.push_back(mesh_.positions[indices[k]]);
                if (!mesh_.normals.empty()) arrays.normals.push_back(mesh_.normals[indices[k]]);
                if (!mesh_.texcoords.empty()) arrays.texcoords.push_back(mesh_.texcoords[indices[k]]);
            }
            const auto begin = arrays.cluster_vertices.begin() + cluster.first_vertex;
            const auto found = std::find(begin, arrays.cluster_vertices.end(), number);
            packed |= static_cast<uint32_t>(found - begin) << (k % 3 * 10);
            if (found == arrays.cluster_vertices.end()) arrays.cluster_vertices.push_back(number);
            if (k % 3 != 2) continue;
            arrays.cluster_triangles.push_back(packed);
            packed = 0;
        }
        const auto vertex_count = static_cast<uint32_t>(arrays.cluster_vertices.size()) - cluster.first_vertex;
        cluster.counts = vertex_count | static_cast<uint32_t>(indices.size() / 3) << 16;
    }

    const Mesh& mesh_;
    const MeshGraphOptions& options_;
    const detail::GraphMesh places_;
    std::optional<ThreadPool> pool_;  ///< beside the calling thread
    std::vector<MeshGraphPart> parts_;
    std::vector<BuiltCluster> clusters_;
    std::vector<BuiltGroup> groups_;
    std::vector<uint32_t> pending_;
    uint64_t work_ = 0;  ///< indices at the beginning
    uint64_t left_ = 0;  ///< indices pending
    float told_ = 0.0f;
};

}  // namespace

Expected<MeshGraph> createMeshGraph(const Mesh& mesh, const MeshGraphOptions& options) {
    if (options.group_clusters < 2 || options.group_clusters > 64)
        return unexpected(makeError(ErrorCode::InvalidArgument, "graph.options",
                                    "groups of {} clusters; 2 to 64 are allowed", options.group_clusters));
    if (mesh.indices.size() > UINT32_MAX || mesh.positions.size() > UINT32_MAX)
        return unexpected(makeError(ErrorCode::OutOfRange, "graph.too_large",
                                    "{} positions and {} indices; at most {} are allowed", mesh.positions.size(),
                                    mesh.indices.size(), UINT32_MAX));
    if (mesh.indices.size() * sizeof(uint32_t) > options.limit)
        return unexpected(makeError(ErrorCode::OutOfRange, "graph.too_large",
                                    "{} indices alone take more than the limit of {} bytes", mesh.indices.size(),
                                    options.limit));
    if (Status status = mesh.validate(); !status) return unexpected(status.error());
    for (size_t i = 0; i < mesh.positions.size(); i++)
        for (int axis = 0; axis < 3; axis++)
            if (std::abs(mesh.positions[i][axis]) > 0x1p60f)
                return unexpected(makeError(ErrorCode::OutOfRange, "graph.too_large",
                                            "position {} has the coordinate {}; at most 2^60 is allowed", i,
                                            mesh.positions[i][axis]));
    for (size_t i = 0; i < mesh.normals.size(); i++)
        if (!isFinite(mesh.normals[i]))
            return unexpected(makeError(ErrorCode::InvalidArgument, "mesh.not_finite", "normal {} is not finite", i));
    for (size_t i = 0; i < mesh.texcoords.size(); i++)
        if (!isFinite(Vector3f(mesh.texcoords[i], 0.0f)))
            return unexpected(
                makeError(ErrorCode::InvalidArgument, "mesh.not_finite", "texture coordinate {} is not finite", i));
    return Builder(mesh, options).build();
}

}  // namespace glint
