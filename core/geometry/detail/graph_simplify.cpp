// Simplifies a group of clusters, and makes sure that nothing has happened at its border.

#include <glint/geometry/detail/graph_build.h>
#include <glint/geometry/surface_distance.h>

#include <meshoptimizer.h>

#include <algorithm>
#include <array>

namespace glint::detail {

namespace {

EdgeKey keyOf(uint32_t a, uint32_t b) {
    const auto [low, high] = std::minmax(a, b);
    return EdgeKey{low} << 32 | high;
}

/// How often an edge is run along, from the lower place to the higher one and back.
struct EdgeCount {
    EdgeKey key;
    uint32_t forward = 0, backward = 0;
    bool operator==(const EdgeCount&) const = default;
};

std::vector<EdgeCount> countEdges(const GraphMesh& mesh, std::span<const uint32_t> indices) {
    std::vector<EdgeCount> edges;
    edges.reserve(indices.size());
    for (size_t k = 0; k < indices.size(); k++) {
        const uint32_t from = mesh.places[indices[k]], to = mesh.places[indices[k % 3 == 2 ? k - 2 : k + 1]];
        const auto [low, high] = std::minmax(from, to);
        edges.push_back({EdgeKey{low} << 32 | high, from<to, from> to});
    }
    std::sort(edges.begin(), edges.end(), [](const EdgeCount& a, const EdgeCount& b) { return a.key < b.key; });
    size_t count = 0;
    for (const EdgeCount& edge : edges) {
        if (count == 0 || edges[count - 1].key != edge.key) {
            edges[count++] = edge;
        } else {
            edges[count - 1].forward += edge.forward;
            edges[count - 1].backward += edge.backward;
        }
    }
    edges.resize(count);
    return edges;
}

/// Keeps, of the edges, what other triangles may rely on: locked ones as they are, of all others how much more often
/// they are run along in one direction than in the other. That is the boundary of the triangles, as a sum of edges.
void keepBorder(std::vector<EdgeCount>& edges, const std::vector<EdgeKey>& locked) {
    size_t count = 0;
    for (EdgeCount edge : edges) {
        if (!std::binary_search(locked.begin(), locked.end(), edge.key)) {
            if (edge.forward == edge.backward) continue;
            const uint32_t both = std::min(edge.forward, edge.backward);
            edge.forward -= both;
            edge.backward -= both;
        }
        edges[count++] = edge;
    }
    edges.resize(count);
}

std::vector<uint32_t> placesOf(const GraphMesh& mesh, std::span<const uint32_t> indices) {
    std::vector<uint32_t> places;
    for (const uint32_t vertex : indices) places.push_back(mesh.places[vertex]);
    std::sort(places.begin(), places.end());
    places.erase(std::unique(places.begin(), places.end()), places.end());
    return places;
}

/// Divides triangles into such as the library may see and others, so that it changes nothing that it should not. It
/// locks what lies on an edge of one triangle, and takes edges of several triangles, or of repeated ones, for ordinary
/// ones. So these triangles are withheld, and then one at each place that has to stay and lies on no edge of one
/// triangle.
void withhold(const GraphMesh& mesh, std::span<const uint32_t> indices, const std::vector<EdgeCount>& edges,
              const ClusterGroup& group, std::vector<uint32_t>& given, std::vector<uint32_t>& withheld) {
    std::vector<EdgeKey> irregular;
    for (const EdgeCount& edge : edges)
        if (edge.forward > 1 || edge.backward > 1) irregular.push_back(edge.key);
    std::vector<uint32_t> regular;
    for (size_t i = 0; i < indices.size(); i += 3) {
        const uint32_t a = mesh.places[indices[i]], b = mesh.places[indices[i + 1]], c = mesh.places[indices[i + 2]];
        bool is_irregular = false;
        if (!irregular.empty())
            for (const EdgeKey key : {keyOf(a, b), keyOf(b, c), keyOf(c, a)})
                is_irregular = is_irregular || std::binary_search(irregular.begin(), irregular.end(), key);
        for (size_t k = 0; k < 3; k++) (is_irregular ? withheld : regular).push_back(indices[i + k]);
    }
    std::vector<uint32_t> staying = placesOf(mesh, withheld), bordering;
    staying.insert(staying.end(), group.locked_places.begin(), group.locked_places.end());
    std::sort(staying.begin(), staying.end());
    staying.erase(std::unique(staying.begin(), staying.end()), staying.end());
    for (const EdgeCount& edge : withheld.empty() ? edges : countEdges(mesh, regular))
        if (edge.forward == 0 || edge.backward == 0) {
            bordering.push_back(static_cast<uint32_t>(edge.key >> 32));
            bordering.push_back(static_cast<uint32_t>(edge.key));
        }
    std::sort(bordering.begin(), bordering.end());
    std::vector<uint32_t> free;
    std::set_difference(staying.begin(), staying.end(), bordering.begin(), bordering.end(), std::back_inserter(free));
    for (size_t i = 0; i < regular.size(); i += 3) {
        bool holds = false;
        for (size_t k = 0; k < 3 && !free.empty(); k++) {
            const auto found = std::lower_bound(free.begin(), free.end(), mesh.places[regular[i + k]]);
            if (found == free.end() || *found != mesh.places[regular[i + k]]) continue;
            holds = true;
            free.erase(found);
        }
        for (size_t k = 0; k < 3; k++) (holds ? withheld : given).push_back(regular[i + k]);
    }
}

/// meshoptimizer's simplification to half of the triangles, degenerate results left out.
std::vector<uint32_t> simplify(const GraphMesh& mesh, std::span<const uint32_t> indices,
                               const std::vector<EdgeCount>& edges, const ClusterGroup& group) {
    std::vector<uint32_t> given, result;
    withhold(mesh, indices, edges, group, given, result);
    if (given.empty()) return result;

    std::vector<uint32_t> vertices(given);
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    std::vector<Vector3f> positions(vertices.size());
    for (size_t i = 0; i < vertices.size(); i++) positions[i] = mesh.positions[vertices[i]];
    for (uint32_t& index : given)
        index = static_cast<uint32_t>(std::lower_bound(vertices.begin(), vertices.end(), index) - vertices.begin());
    std::vector<uint32_t> fewer(given.size());
    // The library's own error does not bound anything: the distance is measured afterwards.
    const size_t target = std::min(given.size(), indices.size() / 6 * 3);
    const size_t count = meshopt_simplify(fewer.data(), given.data(), given.size(), &positions[0].x, positions.size(),
                                          sizeof(Vector3f), target, 1.0f, meshopt_SimplifyLockBorder, nullptr);
    for (size_t i = 0; i + 2 < count; i += 3) {
        const std::array<uint32_t, 3> corners = {vertices[fewer[i]], vertices[fewer[i + 1]], vertices[fewer[i + 2]]};
        const uint32_t a = mesh.places[corners[0]], b = mesh.places[corners[1]], c = mesh.places[corners[2]];
        if (a != b && b != c && c != a) result.insert(result.end(), corners.begin(), corners.end());
    }
    return result;
}

}  // namespace

SimplifiedGroup simplifyGroup(const GraphMesh& mesh, std::span<const BuiltCluster> clusters,
                              const ClusterGroup& group) {
    std::vector<uint32_t> before;
    for (const uint32_t cluster : group.clusters)
        before.insert(before.end(), clusters[cluster].indices.begin(), clusters[cluster].indices.end());
    std::vector<EdgeCount> edges = countEdges(mesh, before);
    const std::vector<uint32_t> after = simplify(mesh, before, edges, group);
    if (after.empty() || after.size() * 100 > before.size() * 85) return {};

    std::vector<EdgeCount> kept = countEdges(mesh, after);
    keepBorder(edges, group.locked_edges);
    keepBorder(kept, group.locked_edges);
    const std::vector<uint32_t> places = placesOf(mesh, after);
    if (edges != kept ||
        !std::includes(places.begin(), places.end(), group.locked_places.begin(), group.locked_places.end()))
        return {};
    SimplifiedGroup result;
    result.clusters = splitClusters(mesh, after);
    if (result.clusters.size() >= group.clusters.size()) return {};
    result.distance = hausdorffDistance(mesh.positions, before, mesh.positions, after).upper;
    return result;
}

}  // namespace glint::detail
