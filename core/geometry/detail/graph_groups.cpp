// Which clusters of a graph are simplified together, and what they share with others.

#include <glint/geometry/detail/graph_build.h>
#include <glint/math/bounds.h>

#include <glm/common.hpp>

#include <algorithm>
#include <numeric>

namespace glint::detail {

namespace {

struct EdgeUse {
    EdgeKey key;
    uint32_t cluster;  ///< of the pending ones
    auto operator<=>(const EdgeUse&) const = default;
};

/// The edges of all pending clusters, each once for each cluster, ascending.
std::vector<EdgeUse> edgesOf(const GraphMesh& mesh, std::span<const BuiltCluster> clusters,
                             std::span<const uint32_t> pending) {
    std::vector<EdgeUse> edges;
    for (uint32_t i = 0; i < pending.size(); i++) {
        const std::vector<uint32_t>& indices = clusters[pending[i]].indices;
        for (size_t k = 0; k < indices.size(); k++) {
            const size_t next = k % 3 == 2 ? k - 2 : k + 1;
            const auto [low, high] = std::minmax(mesh.places[indices[k]], mesh.places[indices[next]]);
            edges.push_back({EdgeKey{low} << 32 | high, i});
        }
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    return edges;
}

/// Calls run(begin, end) for each run of edges with one key that more than one cluster has.
template <class Run>
void forEachShared(const std::vector<EdgeUse>& edges, Run&& run) {
    for (size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
        for (end = begin; end < edges.size() && edges[end].key == edges[begin].key;) end++;
        if (end - begin > 1) run(begin, end);
    }
}

/// Neighbours of each pending cluster, with the number of edges that they share.
struct Adjacency {
    struct Link {
        uint32_t from, to;
        uint32_t weight;
    };
    std::vector<Link> links;
    std::vector<size_t> first;  ///< of each cluster's; one more than clusters

    std::span<const Link> of(uint32_t cluster) const {
        return std::span(links).subspan(first[cluster], first[cluster + 1] - first[cluster]);
    }
};

Adjacency adjacencyOf(const std::vector<EdgeUse>& edges, std::span<const BuiltCluster> clusters,
                      std::span<const uint32_t> pending) {
    Adjacency result;
    // Of an edge of many clusters, each is linked with the next one: all pairs would be too many.
    forEachShared(edges, [&](size_t begin, size_t end) {
        for (size_t i = begin; i + 1 < end; i++) {
            const uint32_t a = edges[i].cluster, b = edges[i + 1].cluster;
            if (clusters[pending[a]].part != clusters[pending[b]].part) continue;
            result.links.push_back({a, b, 1});
            result.links.push_back({b, a, 1});
        }
    });
    const auto key = [](const Adjacency::Link& link) { return uint64_t{link.from} << 32 | link.to; };
    std::sort(result.links.begin(), result.links.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
    size_t count = 0;
    for (const Adjacency::Link& link : result.links) {
        if (count > 0 && key(result.links[count - 1]) == key(link))
            result.links[count - 1].weight++;
        else
            result.links[count++] = link;
    }
    result.links.resize(count);
    result.first.assign(pending.size() + 1, 0);
    for (const Adjacency::Link& link : result.links) result.first[link.from + 1]++;
    std::partial_sum(result.first.begin(), result.first.end(), result.first.begin());
    return result;
}

/// The pending clusters, part by part, along a Z-order curve of 20 bits an axis.
std::vector<uint32_t> spatialOrder(std::span<const BuiltCluster> clusters, std::span<const uint32_t> pending) {
    BoundBox box;
    for (const uint32_t i : pending) box.add(clusters[i].box.center());
    const Vector3d low(box.min), size = glm::max(Vector3d(box.max) - low, Vector3d(1e-300));
    std::vector<uint64_t> codes(pending.size(), 0);
    for (size_t i = 0; i < pending.size(); i++) {
        const Vector3d cell = (Vector3d(clusters[pending[i]].box.center()) - low) / size * 1048575.0;
        for (int bit = 0; bit < 20; bit++)
            for (int axis = 0; axis < 3; axis++)
                codes[i] |= (static_cast<uint64_t>(cell[axis]) >> bit & 1) << (3 * bit + axis);
    }
    std::vector<uint32_t> order(pending.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
        const uint32_t part_a = clusters[pending[a]].part, part_b = clusters[pending[b]].part;
        return part_a != part_b ? part_a < part_b : codes[a] < codes[b];
    });
    return order;
}

/// Assigns a group to each pending cluster; returns how many there are.
uint32_t assign(std::span<const BuiltCluster> clusters, std::span<const uint32_t> pending, const Adjacency& adjacency,
                uint32_t size, std::vector<uint32_t>& group_of) {
    constexpr uint32_t none = UINT32_MAX;
    const std::vector<uint32_t> order = spatialOrder(clusters, pending);
    std::vector<uint32_t> sizes, shared(pending.size(), 0), total(pending.size(), 0);
    for (const Adjacency::Link& link : adjacency.links) total[link.from] += link.weight;
    group_of.assign(pending.size(), none);
    for (size_t seed = 0; seed < order.size(); seed++) {
        if (group_of[order[seed]] != none) continue;
        const auto group = static_cast<uint32_t>(sizes.size());
        sizes.push_back(0);
        std::vector<uint32_t> candidates;
        const auto take = [&](uint32_t cluster) {
            group_of[cluster] = group;
            sizes[group]++;
            for (const Adjacency::Link& link : adjacency.of(cluster)) {
                if (group_of[link.to] != none) continue;
                if (shared[link.to] == 0) candidates.push_back(link.to);
                shared[link.to] += link.weight;
            }
        };
        take(order[seed]);
        while (sizes[group] < size) {
            // The one with most of its border inside, so that groups come out round.
            uint32_t best = none;
            double best_share = 0.0;
            for (const uint32_t candidate : candidates) {
                if (group_of[candidate] != none) continue;
                const double share = static_cast<double>(shared[candidate]) / total[candidate];
                if (share > best_share || (share == best_share && candidate < best)) {
                    best_share = share;
                    best = candidate;
                }
            }
            if (best == none) break;
            take(best);
        }
        for (const uint32_t candidate : candidates) shared[candidate] = 0;
        if (sizes[group] > 1) continue;

        // Left alone: to the neighbouring group that has room, or else with what comes next on the curve.
        uint32_t best = none, best_weight = 0;
        for (const Adjacency::Link& link : adjacency.of(order[seed])) {
            const uint32_t other = group_of[link.to];
            if (other == none || other == group || sizes[other] > size + size / 2) continue;
            if (link.weight > best_weight) {
                best_weight = link.weight;
                best = other;
            }
        }
        if (best != none) {
            group_of[order[seed]] = best;
            sizes[best]++;
            sizes.pop_back();
            continue;
        }
        const uint32_t part = clusters[pending[order[seed]]].part;
        for (size_t i = seed + 1; i < order.size() && sizes[group] < size; i++) {
            if (clusters[pending[order[i]]].part != part) break;
            if (group_of[order[i]] == none) take(order[i]);
        }
        for (const uint32_t candidate : candidates) shared[candidate] = 0;
    }
    return static_cast<uint32_t>(sizes.size());
}

}  // namespace

std::vector<ClusterGroup> makeGroups(const GraphMesh& mesh, std::span<const BuiltCluster> clusters,
                                     std::span<const uint32_t> pending, uint32_t size) {
    const std::vector<EdgeUse> edges = edgesOf(mesh, clusters, pending);
    std::vector<uint32_t> group_of;
    const uint32_t count = assign(clusters, pending, adjacencyOf(edges, clusters, pending), size, group_of);
    std::vector<ClusterGroup> groups(count);
    for (uint32_t i = 0; i < pending.size(); i++) groups[group_of[i]].clusters.push_back(pending[i]);

    forEachShared(edges, [&](size_t begin, size_t end) {
        bool is_inner = true;
        for (size_t i = begin; i < end; i++)
            is_inner = is_inner && group_of[edges[i].cluster] == group_of[edges[begin].cluster];
        if (is_inner) return;
        for (size_t i = begin; i < end; i++) {
            std::vector<EdgeKey>& locked = groups[group_of[edges[i].cluster]].locked_edges;
            if (locked.empty() || locked.back() != edges[i].key) locked.push_back(edges[i].key);
        }
    });
    // Places in more than one group, whether by an edge or not.
    constexpr uint32_t none = UINT32_MAX, several = UINT32_MAX - 1;
    std::vector<uint32_t> owner(mesh.places.size(), none);
    const auto forEachPlace = [&](auto&& visit) {
        for (uint32_t i = 0; i < pending.size(); i++)
            for (const uint32_t vertex : clusters[pending[i]].indices) visit(group_of[i], mesh.places[vertex]);
    };
    forEachPlace([&](uint32_t group, uint32_t place) {
        owner[place] = owner[place] == none || owner[place] == group ? group : several;
    });
    forEachPlace([&](uint32_t group, uint32_t place) {
        if (owner[place] == several) groups[group].locked_places.push_back(place);
    });
    for (ClusterGroup& group : groups) {
        std::vector<uint32_t>& places = group.locked_places;
        std::sort(places.begin(), places.end());
        places.erase(std::unique(places.begin(), places.end()), places.end());
    }
    return groups;
}

}  // namespace glint::detail
