#include <glint/geometry/mesh_optimize.h>

#include <glint/geometry/detail/graph_build.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <numeric>

namespace glint {

namespace {

struct EdgeSide {
    uint64_t key;
    uint32_t triangle;
    bool is_forward;
};

/// Sets that are joined.
class Sets {
public:
    explicit Sets(size_t count) : parents_(count) { std::iota(parents_.begin(), parents_.end(), 0u); }
    uint32_t find(uint32_t i) {
        while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
        return i;
    }
    void join(uint32_t a, uint32_t b) { parents_[find(a)] = find(b); }

private:
    std::vector<uint32_t> parents_;
};

}  // namespace

MeshStatistics statistics(const Mesh& mesh) {
    MeshStatistics result;
    result.triangles = mesh.triangleCount();
    result.vertices = mesh.positions.size();
    const std::vector<uint32_t> places = detail::firstWithPosition(mesh.positions);
    std::vector<bool> is_used(mesh.positions.size(), false);
    for (const uint32_t index : mesh.indices) is_used[index] = true;
    for (uint32_t i = 0; i < places.size(); i++) {
        result.unused_vertices += !is_used[i];
        result.repeated_vertices += places[i] != i;
    }

    std::vector<EdgeSide> sides;
    std::vector<std::array<uint32_t, 3>> triples;
    const Vector3d center(mesh.bounds().center());
    for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        std::array<uint32_t, 3> corners;
        std::array<Vector3d, 3> points;
        for (size_t k = 0; k < 3; k++) {
            corners[k] = places[mesh.indices[i + k]];
            points[k] = Vector3d(mesh.positions[corners[k]]) - center;
        }
        if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
            result.degenerate_triangles++;
            continue;
        }
        const double area = glm::length(glm::cross(points[1] - points[0], points[2] - points[0])) / 2.0;
        result.flat_triangles += area == 0.0;
        result.area += area;
        result.volume += glm::dot(points[0], glm::cross(points[1], points[2])) / 6.0;
        for (size_t k = 0; k < 3; k++) {
            const uint32_t from = corners[k], to = corners[(k + 1) % 3];
            const auto [low, high] = std::minmax(from, to);
            sides.push_back({uint64_t{low} << 32 | high, static_cast<uint32_t>(triples.size()), from < to});
        }
        std::sort(corners.begin(), corners.end());
        triples.push_back(corners);
    }

    Sets components(triples.size());
    std::sort(sides.begin(), sides.end(), [](const EdgeSide& a, const EdgeSide& b) { return a.key < b.key; });
    for (size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
        for (end = begin; end < sides.size() && sides[end].key == sides[begin].key; end++)
            components.join(sides[begin].triangle, sides[end].triangle);
        result.edges++;
        result.open_edges += end - begin == 1;
        result.non_manifold_edges += end - begin > 2;
        result.turned_edges += end - begin == 2 && sides[begin].is_forward == sides[begin + 1].is_forward;
    }
    for (uint32_t i = 0; i < triples.size(); i++) result.components += components.find(i) == i;
    std::sort(triples.begin(), triples.end());
    result.repeated_triangles =
        triples.size() - static_cast<size_t>(std::unique(triples.begin(), triples.end()) - triples.begin());
    return result;
}

}  // namespace glint
