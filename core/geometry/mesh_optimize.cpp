#include <glint/geometry/mesh_optimize.h>

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cstddef>

namespace glint {

namespace {

/// The runs of triangles that stay together: parts, and what lies between them.
std::vector<std::pair<size_t, size_t>> runsOf(const Mesh& mesh) {
    std::vector<std::pair<size_t, size_t>> runs;
    size_t end = 0;
    const auto add = [&](size_t begin, size_t count) {
        if (begin > end) runs.emplace_back(end, begin - end);
        if (count > 0) runs.emplace_back(begin, count);
        end = begin + count;
    };
    for (const MeshPart& part : mesh.parts) add(part.first_index, part.index_count);
    add(mesh.indices.size(), 0);
    return runs;
}

template <class T>
void remapAttribute(std::vector<T>& values, const std::vector<uint32_t>& remap, size_t count) {
    if (values.empty()) return;
    std::vector<T> moved(count);
    for (size_t i = 0; i < remap.size(); i++)
        if (remap[i] != UINT32_MAX) moved[remap[i]] = values[i];
    values = std::move(moved);
}

/// Moves vertex i to remap[i], or drops it.
void remapVertices(Mesh& mesh, const std::vector<uint32_t>& remap, size_t count) {
    remapAttribute(mesh.positions, remap, count);
    remapAttribute(mesh.normals, remap, count);
    remapAttribute(mesh.texcoords, remap, count);
    for (uint32_t& index : mesh.indices) index = remap[index];
}

/// Drops triangles of which two corners are at one place; parts shrink.
uint64_t dropDegenerate(Mesh& mesh) {
    const size_t before = mesh.triangleCount();
    std::vector<uint32_t> kept_before(before + 1, 0);
    uint32_t kept = 0;
    for (size_t i = 0; i < before; i++) {
        kept_before[i] = kept;
        const std::array<uint32_t, 3> corners = {mesh.indices[i * 3], mesh.indices[i * 3 + 1], mesh.indices[i * 3 + 2]};
        const Vector3f &a = mesh.positions[corners[0]], &b = mesh.positions[corners[1]],
                       &c = mesh.positions[corners[2]];
        if (a == b || b == c || c == a) continue;
        std::copy(corners.begin(), corners.end(), mesh.indices.begin() + std::ptrdiff_t{3} * kept++);
    }
    kept_before[before] = kept;
    mesh.indices.resize(size_t{kept} * 3);
    for (MeshPart& part : mesh.parts) {
        const uint32_t begin = kept_before[part.first_index / 3] * 3;
        part.index_count = kept_before[(part.first_index + part.index_count) / 3] * 3 - begin;
        part.first_index = begin;
    }
    return before - kept;
}

/// -0 becomes 0, so that equal places have equal bytes.
void plainZeros(std::vector<Vector3f>& values) {
    for (Vector3f& value : values) value += Vector3f(0.0f);
}

}  // namespace

MeshWeld weld(Mesh& mesh) {
    MeshWeld taken;
    const size_t vertices = mesh.positions.size();
    plainZeros(mesh.positions);
    plainZeros(mesh.normals);
    taken.triangles = dropDegenerate(mesh);
    if (mesh.indices.empty()) {
        mesh.positions.clear();
        mesh.normals.clear();
        mesh.texcoords.clear();
        taken.vertices = vertices;
        return taken;
    }
    std::vector<meshopt_Stream> streams = {{mesh.positions.data(), sizeof(Vector3f), sizeof(Vector3f)}};
    if (!mesh.normals.empty()) streams.push_back({mesh.normals.data(), sizeof(Vector3f), sizeof(Vector3f)});
    if (!mesh.texcoords.empty()) streams.push_back({mesh.texcoords.data(), sizeof(Vector2f), sizeof(Vector2f)});
    std::vector<uint32_t> remap(vertices);
    const size_t count = meshopt_generateVertexRemapMulti(remap.data(), mesh.indices.data(), mesh.indices.size(),
                                                          vertices, streams.data(), streams.size());
    remapVertices(mesh, remap, count);
    taken.vertices = vertices - count;
    return taken;
}

MeshWeld weldPositions(Mesh& mesh) {
    mesh.normals.clear();
    mesh.texcoords.clear();
    return weld(mesh);
}

void optimizeVertexCache(Mesh& mesh) {
    for (const auto& [first, count] : runsOf(mesh)) {
        std::vector<uint32_t> ordered(count);
        meshopt_optimizeVertexCache(ordered.data(), &mesh.indices[first], count, mesh.positions.size());
        std::copy(ordered.begin(), ordered.end(), mesh.indices.begin() + static_cast<std::ptrdiff_t>(first));
    }
}

void optimizeOverdraw(Mesh& mesh, float threshold) {
    for (const auto& [first, count] : runsOf(mesh)) {
        std::vector<uint32_t> ordered(count);
        meshopt_optimizeOverdraw(ordered.data(), &mesh.indices[first], count, &mesh.positions[0].x,
                                 mesh.positions.size(), sizeof(Vector3f), threshold);
        std::copy(ordered.begin(), ordered.end(), mesh.indices.begin() + static_cast<std::ptrdiff_t>(first));
    }
}

void optimizeVertexFetch(Mesh& mesh) {
    std::vector<uint32_t> remap(mesh.positions.size());
    const size_t count =
        meshopt_optimizeVertexFetchRemap(remap.data(), mesh.indices.data(), mesh.indices.size(), mesh.positions.size());
    remapVertices(mesh, remap, count);
}

void optimize(Mesh& mesh) {
    optimizeVertexCache(mesh);
    optimizeOverdraw(mesh);
    optimizeVertexFetch(mesh);
}

MeshOrderStatistics orderStatistics(const Mesh& mesh) {
    MeshOrderStatistics result;
    if (mesh.indices.empty()) return result;
    const meshopt_VertexCacheStatistics cache =
        meshopt_analyzeVertexCache(mesh.indices.data(), mesh.indices.size(), mesh.positions.size(), 16, 0, 0);
    const meshopt_OverdrawStatistics overdraw = meshopt_analyzeOverdraw(
        mesh.indices.data(), mesh.indices.size(), &mesh.positions[0].x, mesh.positions.size(), sizeof(Vector3f));
    std::vector<bool> is_used(mesh.positions.size(), false);
    for (const uint32_t index : mesh.indices) is_used[index] = true;
    const auto used = static_cast<double>(std::count(is_used.begin(), is_used.end(), true));
    const meshopt_VertexFetchStatistics fetch =
        meshopt_analyzeVertexFetch(mesh.indices.data(), mesh.indices.size(), mesh.positions.size(), 32);
    result.acmr = cache.acmr;
    result.atvr = cache.vertices_transformed / used;
    result.overdraw = overdraw.overdraw;
    result.overfetch = fetch.bytes_fetched / (used * 32);
    return result;
}

}  // namespace glint
