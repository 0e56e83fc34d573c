// What a graph of clusters shows: views, cuts, and the mesh of a cut.

#include <glint/format/mesh_graph.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace glint {

namespace {

/// The squares of the smallest and the largest stretch of a linear map: eigenvalues of its Gram matrix, by Jacobi's
/// rotations.
std::pair<double, double> squaredStretches(const glm::dmat3& linear) {
    glm::dmat3 gram = glm::transpose(linear) * linear;
    for (int sweep = 0; sweep < 16; sweep++)
        for (const auto& [p, q] : {std::pair(0, 1), std::pair(0, 2), std::pair(1, 2)}) {
            if (gram[p][q] == 0.0) continue;
            const double theta = (gram[q][q] - gram[p][p]) / (2.0 * gram[p][q]);
            const double t = std::copysign(1.0, theta) / (std::abs(theta) + std::hypot(theta, 1.0));
            const double c = 1.0 / std::hypot(t, 1.0), s = t * c;
            glm::dmat3 turn(1.0);
            turn[p][p] = turn[q][q] = c;
            turn[q][p] = s;
            turn[p][q] = -s;
            gram = glm::transpose(turn) * gram * turn;
        }
    const auto [low, high] = std::minmax({gram[0][0], gram[1][1], gram[2][2]});
    return {low, high};
}

}  // namespace

bool MeshCluster::isFacingAway(const Vector3f& eye) const {
    // With the half angle a of the normals' cone, a point of the ball sees the back of all triangles if the angle
    // between axis and view is t and cos(t + a) |v| >= radius, which follows from cos(t) >= sin(a) + radius / |v|.
    const Vector3f view = center - eye;
    return glm::dot(view, cone_axis) >= cone_cutoff * glm::length(view) + radius;
}

MeshGraphView::MeshGraphView(const CameraParameters& camera, const Vector2u& size, const Transform3x4& instance) {
    const glm::dmat4 to_world(instance.matrix());
    const glm::dmat3 linear(to_world);
    const auto [low, high] = squaredStretches(linear);
    const Vector2d focal(double{camera.projection[0][0]} * size.x / 2.0,
                         double{camera.projection[1][1]} * size.y / 2.0);
    const Vector2d corner(1.0 / camera.projection[0][0], 1.0 / camera.projection[1][1]);
    const double corner_slant = std::sqrt(1.0 + glm::dot(corner, corner));
    // The camera looks along -Z.
    const Vector3d axis = -Vector3d(glm::dmat4(camera.inverse_view)[2]);
    eye = Vector3f(glm::inverse(to_world) * Vector4d(Vector3d(camera.position), 1.0));
    forward = Vector3f(glm::transpose(linear) * axis);
    // Bounds are rounded up, and what they are divided by down.
    constexpr double up = 1.0 + 0x1p-20;
    scale = static_cast<float>(std::max(std::abs(focal.x), std::abs(focal.y)) * corner_slant * std::sqrt(high) * up);
    stretch = static_cast<float>(glm::length(Vector3d(forward)) * up);
    slant = static_cast<float>(std::sqrt(std::max(low, 0.0)) / corner_slant / up);
    near = camera.projection[3][2];
}

float MeshGraphView::error(const MeshClusterGroup& group) const {
    if (group.error == 0.0f) return 0.0f;
    const Vector3f v = group.center - eye;
    const float depth =
        std::max({glm::dot(forward, v) - stretch * group.radius, slant * (glm::length(v) - group.radius), near});
    return depth > 0.0f ? group.error * scale / depth : std::numeric_limits<float>::infinity();
}

std::span<const MeshCluster> MeshGraph::children(uint32_t cluster) const {
    const MeshCluster& c = clusters()[cluster];
    if (c.source == UINT32_MAX) return {};
    const MeshClusterGroup& group = groups()[c.source];
    if (parents()[group.first_parent] != cluster) return {};
    return clusters().subspan(group.first_child, group.child_count);
}

void MeshGraph::walk(const std::function<bool(const MeshClusterGroup&)>& refine,
                     const std::function<void(uint32_t cluster)>& visit) const {
    const std::span<const MeshCluster> all = clusters();
    // A cluster asks for its source; its group is refined, or the walk had not come here. Each group is asked for once,
    // by the first of its parents that comes by: the others look the answer up.
    enum : uint8_t { Unknown, Kept, Refined };
    std::vector<uint8_t> answers(groups().size(), Unknown);
    std::vector<uint32_t> open;
    for (uint32_t i = root_count_; i-- > 0;) open.push_back(i);
    while (!open.empty()) {
        const uint32_t i = open.back();
        open.pop_back();
        const uint32_t source = all[i].source;
        if (source != UINT32_MAX && answers[source] == Unknown)
            answers[source] = refine(groups()[source]) ? Refined : Kept;
        if (source == UINT32_MAX || answers[source] == Kept) {
            visit(i);
            continue;
        }
        const std::span<const MeshCluster> below = children(i);
        for (size_t k = below.size(); k-- > 0;) open.push_back(static_cast<uint32_t>(&below[k] - all.data()));
    }
}

std::vector<uint32_t> MeshGraph::cut(float error) const {
    std::vector<uint32_t> chosen;
    walk([&](const MeshClusterGroup& group) { return !(group.error <= error); },
         [&](uint32_t cluster) { chosen.push_back(cluster); });
    std::sort(chosen.begin(), chosen.end());
    return chosen;
}

std::vector<uint32_t> MeshGraph::cut(const MeshGraphView& view, float pixels) const {
    std::vector<uint32_t> chosen;
    walk([&](const MeshClusterGroup& group) { return !(view.error(group) <= pixels); },
         [&](uint32_t cluster) { chosen.push_back(cluster); });
    std::sort(chosen.begin(), chosen.end());
    return chosen;
}

Mesh MeshGraph::mesh(std::span<const uint32_t> chosen) const {
    Mesh mesh;
    std::vector<uint32_t> ordered(chosen.begin(), chosen.end());
    std::stable_sort(ordered.begin(), ordered.end(),
                     [&](uint32_t a, uint32_t b) { return clusters()[a].part < clusters()[b].part; });
    std::vector<uint32_t> places(positions().size(), UINT32_MAX);
    const std::vector<MeshGraphPart> names = parts();
    uint32_t last_part = UINT32_MAX;
    for (const uint32_t i : ordered) {
        const MeshCluster& c = clusters()[i];
        if (c.part != last_part) {
            mesh.parts.push_back({.name = names[c.part].name,
                                  .first_index = static_cast<uint32_t>(mesh.indices.size()),
                                  .material = names[c.part].material});
            last_part = c.part;
        }
        for (const uint32_t packed : clusterTriangles().subspan(c.first_triangle, c.triangleCount()))
            for (const uint32_t shift : {0u, 10u, 20u}) {
                const uint32_t vertex = clusterVertices()[c.first_vertex + (packed >> shift & 0x3ffu)];
                if (places[vertex] == UINT32_MAX) {
                    places[vertex] = static_cast<uint32_t>(mesh.positions.size());
                    mesh.positions.push_back(positions()[vertex]);
                    if (!normals().empty()) mesh.normals.push_back(normals()[vertex]);
                    if (!texcoords().empty()) mesh.texcoords.push_back(texcoords()[vertex]);
                }
                mesh.indices.push_back(places[vertex]);
            }
        mesh.parts.back().index_count = static_cast<uint32_t>(mesh.indices.size()) - mesh.parts.back().first_index;
    }
    return mesh;
}

}  // namespace glint
