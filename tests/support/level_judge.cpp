#include "support/level_judge.h"

#include "support/surface_reference.h"

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace glint::test {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Triangles of clusters with the errors of the groups that they come from.
struct Cut {
    Mesh mesh;
    std::vector<double> errors;
    std::map<uint32_t, uint32_t> first;  ///< triangle of each cluster
};

Cut collect(const MeshGraph& graph, std::span<const uint32_t> clusters) {
    Cut cut;
    cut.mesh.positions.assign(graph.positions().begin(), graph.positions().end());
    for (const uint32_t i : clusters) {
        const MeshCluster& c = graph.clusters()[i];
        cut.first[i] = static_cast<uint32_t>(cut.errors.size());
        for (const uint32_t packed : graph.clusterTriangles().subspan(c.first_triangle, c.triangleCount())) {
            for (const uint32_t shift : {0u, 10u, 20u})
                cut.mesh.indices.push_back(graph.clusterVertices()[c.first_vertex + (packed >> shift & 0x3ffu)]);
            cut.errors.push_back(c.source == UINT32_MAX ? 0.0 : double{graph.groups()[c.source].error});
        }
    }
    return cut;
}

}  // namespace

void LevelComparison::add(const LevelComparison& other) {
    pixels += other.pixels;
    different += other.different;
    at_near += other.at_near;
    unexplained += other.unexplained;
    if (first.empty()) first = other.first;
    triangles += other.triangles;
    silhouette = std::max(silhouette, other.silhouette);
    displacement = std::max(displacement, other.displacement);
    distance = std::max(distance, other.distance);
    depths.insert(depths.end(), other.depths.begin(), other.depths.end());
}

double LevelComparison::depth(double share) {
    if (depths.empty()) return 0.0;
    const auto place = depths.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(depths.size() - 1));
    std::nth_element(depths.begin(), place, depths.end());
    return *place;
}

/// Triangles, each with a reach of its own.
class LevelJudge::Tree {
public:
    Tree(const Mesh& mesh, std::vector<double> reaches) : mesh_(mesh), reaches_(std::move(reaches)) {
        order_.resize(mesh.triangleCount());
        std::vector<Vector3d> centers(order_.size());
        for (uint32_t i = 0; i < order_.size(); i++) {
            order_[i] = i;
            const auto points = corners(i);
            centers[i] = points[0] + points[1] + points[2];
        }
        build(0, static_cast<uint32_t>(order_.size()), centers);
    }

    double reach(uint32_t triangle) const { return reaches_.empty() ? 0.0 : reaches_[triangle]; }
    std::array<Vector3d, 3> corners(uint32_t triangle) const {
        const uint32_t* indices = &mesh_.indices[triangle * size_t{3}];
        return {Vector3d(mesh_.positions[indices[0]]), Vector3d(mesh_.positions[indices[1]]),
                Vector3d(mesh_.positions[indices[2]])};
    }

    /// Calls visit(triangle, its point nearest to `point`, that point's distance) for each triangle within its reach
    /// and `more`.
    template <class Visit>
    void within(const Vector3d& point, double more, const Visit& visit) const {
        uint32_t stack[64];
        uint32_t count = 0;
        stack[count++] = 0;
        while (count > 0) {
            const uint32_t at = stack[--count];
            const Node& node = nodes_[at];
            const Vector3d outside = glm::max(glm::max(node.low - point, point - node.high), Vector3d(0.0));
            const double reach = node.reach + more;
            if (glm::dot(outside, outside) > reach * reach) continue;
            if (node.count == 0) {
                stack[count++] = node.first;
                stack[count++] = at + 1;
                continue;
            }
            for (uint32_t i = node.first; i < node.first + node.count; i++) {
                const Vector3d nearest = nearestOnTriangle(corners(order_[i]), point);
                const double distance = glm::distance(nearest, point);
                if (distance <= this->reach(order_[i]) + more) visit(order_[i], nearest, distance);
            }
        }
    }

private:
    struct Node {
        Vector3d low, high;
        double reach = 0.0;
        uint32_t first = 0;  ///< the second child (the first follows the node), or the leaf's first triangle in order_
        uint32_t count = 0;
    };

    void build(uint32_t begin, uint32_t end, const std::vector<Vector3d>& centers) {
        const size_t at = nodes_.size();
        nodes_.emplace_back();
        Node node{.low = Vector3d(infinity), .high = Vector3d(-infinity)};
        Vector3d low(infinity), high(-infinity);
        for (uint32_t i = begin; i < end; i++) {
            node.reach = std::max(node.reach, reach(order_[i]));
            for (const Vector3d& corner : corners(order_[i])) {
                node.low = glm::min(node.low, corner);
                node.high = glm::max(node.high, corner);
            }
            low = glm::min(low, centers[order_[i]]);
            high = glm::max(high, centers[order_[i]]);
        }
        if (end - begin <= 4) {
            node.first = begin;
            node.count = end - begin;
            nodes_[at] = node;
            return;
        }
        const Vector3d size = high - low;
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        const uint32_t middle = begin + (end - begin) / 2;
        std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                         [&](uint32_t a, uint32_t b) { return centers[a][axis] < centers[b][axis]; });
        build(begin, middle, centers);
        node.first = static_cast<uint32_t>(nodes_.size());
        build(middle, end, centers);
        nodes_[at] = node;
    }

    const Mesh& mesh_;
    std::vector<double> reaches_;
    std::vector<uint32_t> order_;
    std::vector<Node> nodes_;
};

/// One of both surfaces in one view.
struct LevelJudge::Side {
    const ExactPicture& picture;
    const Tree& tree;
    double pixels;      ///< that are allowed
    double moved;       ///< pixels by which the picture may be off at the depth 1, and ...
    double rounded;     ///< ... at any
    double more;        ///< distance by which rounding may move partners apart
    double depth_unit;  ///< the largest e that may be seen, over its depth
    double near;        ///< depth of the near plane
};

LevelJudge::LevelJudge(const Mesh& mesh, const MeshGraph& graph)
    : mesh_(mesh), graph_(graph), tree_(std::make_unique<Tree>(mesh, std::vector<double>())) {}
LevelJudge::~LevelJudge() = default;

void LevelJudge::look(const Side& from, const Side& to, uint32_t stride, LevelComparison& result) const {
    const Vector2u size = from.picture.size();
    for (uint32_t y = 0; y < size.y; y++)
        for (uint32_t x = 0; x < size.x; x++) {
            const uint32_t triangle = from.picture.triangle(x, y);
            if (triangle == ExactPicture::none) continue;
            const Vector2d place(x + 0.5, y + 0.5);
            const Vector2d border = glm::min(place, Vector2d(size) - place);
            const double allowed = from.pixels + from.rounded + from.moved / from.picture.depth(x, y);
            if (std::min(border.x, border.y) <= allowed) continue;
            const bool is_different = to.picture.triangle(x, y) == ExactPicture::none;
            if (is_different) result.different++;
            if (!is_different && (y * size.x + x) % stride != 0) continue;
            result.pixels++;

            const Vector3d point = from.picture.point(x, y);
            double displacement = infinity, distance = infinity;
            bool is_at_near = false;
            to.tree.within(point, from.tree.reach(triangle) + to.more,
                           [&](uint32_t other, const Vector3d& partner, double apart) {
                               const Vector3d seen = to.picture.project(partner);
                               if (seen.z < from.near) {
                                   is_at_near = true;
                                   return;
                               }
                               const double error = from.tree.reach(triangle) + to.tree.reach(other);
                               displacement = std::min(displacement, glm::distance(Vector2d(seen), place));
                               distance = std::min(distance, error > 0.0 ? apart / error : 0.0);
                           });
            if (!(displacement <= allowed)) {
                if (is_at_near) {
                    result.at_near++;
                } else {
                    result.unexplained++;
                    if (result.first.empty())
                        result.first = fmt::format("pixel {}, {}: a partner at {} pixels, {} of the error", x, y,
                                                   displacement, distance);
                }
                continue;
            }
            result.displacement = std::max(result.displacement, displacement);
            result.distance = std::max(result.distance, distance);
            if (is_different) {
                // It may be further than the partner only if that is wrong.
                result.silhouette = std::max(result.silhouette,
                                             to.picture.distanceToCoverage(place, std::min(allowed * 1.5 + 1.0, 16.0)));
            } else {
                const double depth = from.picture.depth(x, y);
                result.depths.push_back(std::abs(to.picture.depth(x, y) - depth) / (depth * from.depth_unit));
            }
        }
}

LevelComparison LevelJudge::compare(std::span<const uint32_t> clusters, const CameraParameters& camera,
                                    const Transform3x4& instance, const Vector2u& size, double pixels, uint32_t stride,
                                    std::span<const SeenTriangle> seen) const {
    const Cut cut = collect(graph_, clusters);
    const Tree cut_tree(cut.mesh, cut.errors);
    const Matrix4x4d to_clip = toClip(camera, instance);
    const ExactPicture full(mesh_, to_clip, size);
    ExactPicture shown(cut.mesh, to_clip, size);

    // MeshGraphView::error, and the eye of which it knows, are float32: docs/meshes.md. Points and partners are found
    // by some dozens of operations in float64 on the mesh's coordinates; where the eye is far away, a pixel's ray is
    // exact to the coordinates of the eye.
    const MeshGraphView view(camera, size, instance);
    const Vector3f extent = glm::max(glm::abs(mesh_.bounds().min), glm::abs(mesh_.bounds().max));
    const double reach = glm::length(Vector3d(extent)) + glm::length(Vector3d(view.eye));
    const Vector2d focal(camera.projection[0][0] * 0.5 * size.x, camera.projection[1][1] * 0.5 * size.y);
    const Vector2d corner(1.0 / camera.projection[0][0], 1.0 / camera.projection[1][1]);
    const double scale = std::max(std::abs(focal.x), std::abs(focal.y)) * std::sqrt(1.0 + glm::dot(corner, corner));
    const double allowed = pixels * (1.0 + 0x1p-19 * (1.0 + double{view.stretch} / view.slant)) + 0x1p-30;
    LevelComparison result;
    result.triangles = cut.mesh.triangleCount();
    if (!seen.empty()) {
        std::vector<uint32_t> triangles(seen.size(), ExactPicture::none);
        for (size_t i = 0; i < seen.size(); i++) {
            if (seen[i].cluster == UINT32_MAX) continue;
            const auto place = cut.first.find(seen[i].cluster);
            if (place == cut.first.end() || seen[i].triangle >= graph_.clusters()[seen[i].cluster].triangleCount()) {
                result.unexplained++;
                result.first =
                    fmt::format("cluster {}, triangle {} is not in the cut", seen[i].cluster, seen[i].triangle);
                continue;
            }
            triangles[i] = place->second + seen[i].triangle;
        }
        shown.show(triangles);
    }
    // Half a step of 2^-8 along x and y; and what float32 makes of a place on its way to the picture: three products
    // and sums of up to `reach`, twice, 2^-24 each.
    const auto side = [&](const ExactPicture& picture, const Tree& tree, bool is_rounded) {
        return Side{picture,
                    tree,
                    allowed,
                    is_rounded ? 0x1p-20 * reach * double{view.scale} : 0.0,
                    is_rounded ? 0x1p-8 : 0.0,
                    reach * 0x1p-44,
                    std::max(pixels, 1e-6) / scale,
                    view.near};
    };
    const Side full_side = side(full, *tree_, false), shown_side = side(shown, cut_tree, !seen.empty());
    look(full_side, shown_side, stride, result);
    look(shown_side, full_side, stride, result);
    return result;
}

}  // namespace glint::test
