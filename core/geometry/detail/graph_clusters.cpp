// Clusters of a graph, and what encloses them.

#include <glint/geometry/detail/graph_build.h>

#include <glm/geometric.hpp>

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace glint::detail {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

float roundedUp(double value) {
    const auto rounded = static_cast<float>(value);
    return static_cast<double>(rounded) < value ? std::nextafter(rounded, infinity) : rounded;
}

}  // namespace

std::vector<uint32_t> firstWithPosition(std::span<const Vector3f> positions) {
    std::vector<Vector3f> plain(positions.begin(), positions.end());
    for (Vector3f& p : plain) p += Vector3f(0.0f);  // -0 becomes 0
    std::vector<uint32_t> numbers(plain.size()), first(plain.size(), UINT32_MAX);
    if (plain.empty()) return first;
    meshopt_generateVertexRemap<uint32_t>(numbers.data(), nullptr, plain.size(), plain.data(), plain.size(),
                                          sizeof(Vector3f));
    for (uint32_t i = 0; i < numbers.size(); i++) {
        uint32_t& vertex = first[numbers[i]];
        if (vertex == UINT32_MAX) vertex = i;
        numbers[i] = vertex;
    }
    return numbers;
}

std::vector<std::vector<uint32_t>> splitClusters(const GraphMesh& mesh, std::span<const uint32_t> indices) {
    // The library's time and memory go with the vertices that it is given: it gets those in use.
    std::vector<uint32_t> vertices(indices.begin(), indices.end());
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    std::vector<Vector3f> positions(vertices.size());
    for (size_t i = 0; i < vertices.size(); i++) positions[i] = mesh.positions[vertices[i]];
    std::vector<uint32_t> local(indices.size());
    for (size_t i = 0; i < indices.size(); i++)
        local[i] =
            static_cast<uint32_t>(std::lower_bound(vertices.begin(), vertices.end(), indices[i]) - vertices.begin());

    constexpr size_t most_vertices = MeshCluster::max_vertices, most_triangles = MeshCluster::max_triangles;
    const size_t bound = meshopt_buildMeshletsBound(indices.size(), most_vertices, most_triangles);
    std::vector<meshopt_Meshlet> meshlets(bound);
    std::vector<uint32_t> meshlet_vertices(bound * most_vertices);
    std::vector<unsigned char> meshlet_triangles(bound * most_triangles * 3);
    const size_t count = meshopt_buildMeshlets(meshlets.data(), meshlet_vertices.data(), meshlet_triangles.data(),
                                               local.data(), local.size(), &positions[0].x, positions.size(),
                                               sizeof(Vector3f), most_vertices, most_triangles, 0.25f);
    std::vector<std::vector<uint32_t>> clusters(count);
    for (size_t i = 0; i < count; i++) {
        const meshopt_Meshlet& meshlet = meshlets[i];
        clusters[i].resize(size_t{meshlet.triangle_count} * 3);
        for (size_t k = 0; k < clusters[i].size(); k++)
            clusters[i][k] =
                vertices[meshlet_vertices[meshlet.vertex_offset + meshlet_triangles[meshlet.triangle_offset + k]]];
    }
    return clusters;
}

void setBounds(MeshCluster& cluster, std::span<const Vector3f> positions, std::span<const uint32_t> indices) {
    std::vector<Vector3f> points(indices.size());
    for (size_t i = 0; i < indices.size(); i++) points[i] = positions[indices[i]];
    const BoundBox box(points);
    const BoundSphere ball(points);
    cluster.box_min = box.min;
    cluster.box_max = box.max;
    cluster.center = ball.center;
    cluster.radius = ball.radius;

    // Normals of unit length. A triangle so thin that rounding turns its normal by more than 2^-24 has no cone.
    std::vector<Vector3d> normals;
    Vector3d sum(0.0);
    bool has_cone = true;
    for (size_t i = 0; i + 2 < points.size(); i += 3) {
        const Vector3d a(points[i]), ab = Vector3d(points[i + 1]) - a, ac = Vector3d(points[i + 2]) - a;
        const Vector3d normal = glm::cross(ab, ac);
        const double length = glm::length(normal);
        if (length == 0.0) continue;  // covers nothing
        // Three products and differences, each rounded by 2^-53 of the product of two sides.
        if (length < 0x1p-26 * glm::length(ab) * glm::length(ac)) has_cone = false;
        normals.push_back(normal / length);
        sum += normals.back();
    }
    cluster.cone_axis = {0, 0, 1};
    cluster.cone_cutoff = 2.0f;
    if (!has_cone || !(glm::length(sum) > 0.0)) return;
    const Vector3f axis(glm::normalize(sum));
    double least = 1.0;
    for (const Vector3d& normal : normals) least = std::min(least, glm::dot(normal, glm::normalize(Vector3d(axis))));
    if (!(least > 0.05)) return;
    cluster.cone_axis = axis;
    // 2^-20 covers the rounding of the test in float32: 2^-22 for the dot product and the length.
    cluster.cone_cutoff = roundedUp(std::sqrt(1.0 - least * least) + 0x1p-20);
}

BoundSphere enclose(std::span<const BoundSphere> balls) {
    BoundSphere result;
    Vector3d low(infinity), high(-infinity);
    for (const BoundSphere& ball : balls) {
        low = glm::min(low, Vector3d(ball.center) - Vector3d(ball.radius));
        high = glm::max(high, Vector3d(ball.center) + Vector3d(ball.radius));
    }
    result.center = Vector3f((low + high) * 0.5);
    double radius = 0.0;
    for (const BoundSphere& ball : balls)
        radius = std::max(radius, glm::distance(Vector3d(result.center), Vector3d(ball.center)) + ball.radius);
    result.radius = roundedUp(radius * (1.0 + 0x1p-16));
    return result;
}

}  // namespace glint::detail
