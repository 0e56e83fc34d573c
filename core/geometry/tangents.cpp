#include <glint/geometry/tangents.h>

#include <glint/base/format_error.h>

#include <glm/geometric.hpp>

#include <meshoptimizer.h>

#include <array>
#include <cmath>
#include <numeric>

namespace glint {

namespace {

/// Of unit length; zero if it has no direction.
Vector3d direction(const Vector3d& v) {
    const double length = glm::length(v);
    return length > 0.0 && std::isfinite(length) ? v / length : Vector3d(0.0);
}

Vector3d inPlane(const Vector3d& v, const Vector3d& normal) { return direction(v - normal * glm::dot(v, normal)); }

/// At a right angle to a normal: to its projection on the plane of the two axes along which it is longest.
Vector3d anyTangent(const Vector3d& n) {
    const Vector3d a = glm::abs(n);
    const Vector3d axis = a.x <= a.y && a.x <= a.z ? Vector3d(1, 0, 0)
                          : a.y <= a.z             ? Vector3d(0, 1, 0)
                                                   : Vector3d(0, 0, 1);
    const Vector3d tangent = inPlane(axis, n);
    return tangent == Vector3d(0.0) ? Vector3d(1, 0, 0) : tangent;
}

/// A triangle's tangent and w; no tangent if its texture coordinates have no area.
struct Frame {
    Vector3d tangent = Vector3d(0.0);
    bool is_mirrored = false;
};

Frame frameOf(const Mesh& mesh, const uint32_t* corners) {
    const Vector3d p(mesh.positions[corners[0]]);
    const Vector2d c(mesh.texcoords[corners[0]]);
    const Vector3d d1 = Vector3d(mesh.positions[corners[1]]) - p, d2 = Vector3d(mesh.positions[corners[2]]) - p;
    const Vector2d t1 = Vector2d(mesh.texcoords[corners[1]]) - c, t2 = Vector2d(mesh.texcoords[corners[2]]) - c;
    const double area = t1.x * t2.y - t2.x * t1.y;
    if (area == 0.0 || !std::isfinite(area)) return {};
    return {direction((d1 * t2.y - d2 * t1.y) * (area > 0.0 ? 1.0 : -1.0)), area < 0.0};
}

/// The angle at a corner, between the edges as they are seen along the normal.
double angleAt(const Mesh& mesh, const uint32_t* corners, size_t k, const Vector3d& normal) {
    const Vector3d p(mesh.positions[corners[k]]);
    const Vector3d a = inPlane(Vector3d(mesh.positions[corners[(k + 1) % 3]]) - p, normal);
    const Vector3d b = inPlane(Vector3d(mesh.positions[corners[(k + 2) % 3]]) - p, normal);
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

}  // namespace

Expected<std::vector<Vector4f>> createTangents(Mesh& mesh) {
    if (Status status = mesh.validate(); !status) return unexpected(status.error());
    if (mesh.normals.empty() || mesh.texcoords.empty())
        return unexpected(
            makeError(ErrorCode::InvalidArgument, "mesh.attribute_count",
                      "tangents need normals and texture coordinates; there are {} and {} for {} positions",
                      mesh.normals.size(), mesh.texcoords.size(), mesh.positions.size()));
    const size_t vertices = mesh.positions.size();
    std::vector<uint32_t> shared(vertices);
    const std::array streams = {meshopt_Stream{mesh.positions.data(), sizeof(Vector3f), sizeof(Vector3f)},
                                meshopt_Stream{mesh.normals.data(), sizeof(Vector3f), sizeof(Vector3f)},
                                meshopt_Stream{mesh.texcoords.data(), sizeof(Vector2f), sizeof(Vector2f)}};
    // The library takes corners of whole triangles only.
    std::vector<uint32_t> all((vertices + 2) / 3 * 3, 0);
    std::iota(all.begin(), all.begin() + static_cast<ptrdiff_t>(vertices), 0u);
    meshopt_generateVertexRemapMulti<uint32_t>(shared.data(), all.data(), all.size(), vertices, streams.data(),
                                               streams.size());

    // Sums for w = 1 and for w = -1, and whether anything was added.
    struct Sums {
        std::array<Vector3d, 2> tangents = {Vector3d(0.0), Vector3d(0.0)};
        std::array<bool, 2> has = {false, false};
    };
    std::vector<Sums> sums(vertices);
    std::vector<bool> is_mirrored(mesh.triangleCount(), false);
    for (size_t i = 0; i < mesh.triangleCount(); i++) {
        const uint32_t* corners = &mesh.indices[i * 3];
        const Frame frame = frameOf(mesh, corners);
        if (frame.tangent == Vector3d(0.0)) continue;
        is_mirrored[i] = frame.is_mirrored;
        for (size_t k = 0; k < 3; k++) {
            const Vector3d normal = direction(Vector3d(mesh.normals[corners[k]]));
            Sums& sum = sums[shared[corners[k]]];
            sum.tangents[frame.is_mirrored] += inPlane(frame.tangent, normal) * angleAt(mesh, corners, k, normal);
            sum.has[frame.is_mirrored] = true;
        }
    }

    std::vector<uint32_t> copies(vertices, UINT32_MAX);
    std::vector<uint32_t> indices = mesh.indices;
    for (size_t i = 0; i < indices.size(); i++) {
        const uint32_t vertex = mesh.indices[i];
        const Sums& sum = sums[shared[vertex]];
        if (!is_mirrored[i / 3] || !sum.has[0]) continue;
        if (copies[vertex] == UINT32_MAX) {
            if (mesh.positions.size() >= UINT32_MAX)
                return unexpected(makeError(ErrorCode::OutOfRange, "mesh.too_large",
                                            "more than {} vertices after splitting", UINT32_MAX));
            copies[vertex] = static_cast<uint32_t>(mesh.positions.size());
            mesh.positions.push_back(Vector3f(mesh.positions[vertex]));
            mesh.normals.push_back(Vector3f(mesh.normals[vertex]));
            mesh.texcoords.push_back(Vector2f(mesh.texcoords[vertex]));
        }
        indices[i] = copies[vertex];
    }
    mesh.indices = std::move(indices);

    std::vector<Vector4f> tangents(mesh.positions.size());
    const auto set = [&](uint32_t place, uint32_t vertex, bool mirrored) {
        const Vector3d normal = direction(Vector3d(mesh.normals[vertex]));
        Vector3d tangent = inPlane(sums[shared[vertex]].tangents[mirrored], normal);
        if (tangent == Vector3d(0.0)) tangent = anyTangent(normal);
        tangents[place] = Vector4f(Vector3f(tangent), mirrored ? -1.0f : 1.0f);
    };
    for (uint32_t i = 0; i < vertices; i++) {
        set(i, i, !sums[shared[i]].has[0] && sums[shared[i]].has[1]);
        if (copies[i] != UINT32_MAX) set(copies[i], i, true);
    }
    return tangents;
}

Status createTangents(ScenePrimitive& primitive, uint32_t texcoord) {
    if (Status status = primitive.validate(); !status) return status;
    Mesh mesh;
    mesh.positions = primitive.positions;
    mesh.normals = primitive.normals;
    if (texcoord < primitive.texcoords.size()) mesh.texcoords = primitive.texcoords[texcoord];
    // Up the picture, which is where the green of glTF's normal maps points.
    for (Vector2f& place : mesh.texcoords) place.y = -place.y;
    mesh.indices = primitive.indices;
    Expected<std::vector<Vector4f>> tangents = createTangents(mesh);
    if (!tangents) return tangents.error();

    // Triangles keep their places, so a corner says which vertex the new one at it is a copy of.
    const size_t vertices = primitive.positions.size();
    std::vector<uint32_t> sources(mesh.positions.size() - vertices);
    for (size_t i = 0; i < mesh.indices.size(); i++)
        if (mesh.indices[i] >= vertices) sources[mesh.indices[i] - vertices] = primitive.indices[i];
    const auto split = [&](auto& values) {
        if (values.empty()) return;
        values.reserve(vertices + sources.size());
        for (const uint32_t source : sources) {
            const auto value = values[source];
            values.push_back(value);
        }
    };
    split(primitive.positions);
    split(primitive.normals);
    for (auto& texcoords : primitive.texcoords) split(texcoords);
    split(primitive.colors);
    split(primitive.joints);
    split(primitive.weights);
    for (SceneMorphTarget& target : primitive.targets) {
        split(target.positions);
        split(target.normals);
        split(target.tangents);
    }
    primitive.indices = std::move(mesh.indices);
    primitive.tangents = std::move(*tangents);
    return {};
}

}  // namespace glint
