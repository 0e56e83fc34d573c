#include <glint/format/mesh.h>

#include <glint/base/file.h>
#include <glint/base/format_error.h>
#include <glint/format/scene.h>

#include <glm/geometric.hpp>

#include <cctype>
#include <cmath>

namespace glint {

namespace {

std::string extension(const std::filesystem::path& path) {
    std::string text = path.extension().string();
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

Error unknownExtension(const std::filesystem::path& path, const char* known) {
    return makeError(ErrorCode::Unsupported, "mesh.unknown_extension", "'{}': meshes end in {}, not in '{}'",
                     path.string(), known, path.extension().string());
}

}  // namespace

Expected<Mesh> Mesh::load(const std::filesystem::path& path, uint64_t limit) {
    const std::string kind = extension(path);
    const std::string name = path.filename().string();
    if (kind == ".obj") {
        const Expected<std::string> text = readTextFile(path, limit);
        if (!text) return unexpected(text.error());
        return parseObj(*text, name, limit);
    }
    if (kind == ".ply") {
        const Expected<std::vector<std::byte>> bytes = readFile(path, limit);
        if (!bytes) return unexpected(bytes.error());
        return parsePly(*bytes, name, limit);
    }
    if (kind == ".gltf" || kind == ".glb") {
        const Expected<Scene> scene = Scene::load(path, limit, false);
        if (!scene) return unexpected(scene.error());
        Expected<Mesh> mesh = scene->mesh(scene->pose(), limit);
        if (mesh) return mesh;
        return unexpected(
            Error::inFile(mesh.error().code(), mesh.error().id().data(), mesh.error().message(), name, 0));
    }
    return unexpected(
        unknownExtension(path, ".obj, .ply, .gltf, .glb (and `glint mesh convert` reads more, to write .ply)"));
}

Status Mesh::save(const std::filesystem::path& path) const {
    if (extension(path) != ".ply") return unknownExtension(path, ".ply");
    const Expected<std::vector<std::byte>> bytes = encodePly(*this);
    if (!bytes) return bytes.error();
    return writeFile(path, *bytes);
}

Status Mesh::validate() const {
    if (indices.empty()) return makeError(ErrorCode::InvalidArgument, "mesh.no_faces", "the mesh has no triangles");
    if (indices.size() % 3 != 0)
        return makeError(ErrorCode::InvalidArgument, "mesh.index_count", "{} indices are no multiple of 3",
                         indices.size());
    for (size_t i = 0; i < indices.size(); i++)
        if (indices[i] >= positions.size())
            return makeError(ErrorCode::OutOfRange, "mesh.index_range", "triangle {} names vertex {} of {}", i / 3,
                             indices[i], positions.size());
    if (!normals.empty() && normals.size() != positions.size())
        return makeError(ErrorCode::InvalidArgument, "mesh.attribute_count", "{} normals for {} positions",
                         normals.size(), positions.size());
    if (!texcoords.empty() && texcoords.size() != positions.size())
        return makeError(ErrorCode::InvalidArgument, "mesh.attribute_count", "{} texture coordinates for {} positions",
                         texcoords.size(), positions.size());
    for (size_t i = 0; i < positions.size(); i++)
        if (!isFinite(positions[i]))
            return makeError(ErrorCode::InvalidArgument, "mesh.not_finite", "position {} is ({}, {}, {})", i,
                             positions[i].x, positions[i].y, positions[i].z);
    uint64_t end = 0;
    for (size_t i = 0; i < parts.size(); i++) {
        const MeshPart& part = parts[i];
        const uint64_t part_end = static_cast<uint64_t>(part.first_index) + part.index_count;
        if (part.first_index < end || part_end > indices.size() || part.first_index % 3 || part.index_count % 3)
            return makeError(ErrorCode::OutOfRange, "mesh.part_range",
                             "part {} '{}' has the indices {} to {}: parts are ordered runs of triangles within the {} "
                             "indices, the one before ends at {}",
                             i, part.name, part.first_index, part_end, indices.size(), end);
        end = part_end;
    }
    return {};
}

void Mesh::createNormals() {
    // A triangle's cross product is twice its area times its normal, so plain sums are weighted by area. In float64, so
    // that a vertex with many large triangles keeps what small ones add.
    std::vector<Vector3d> sums(positions.size(), Vector3d(0.0));
    for (size_t i = 0; i + 2 < indices.size(); i += 3) {
        const Vector3d a(positions[indices[i]]);
        const Vector3d b(positions[indices[i + 1]]);
        const Vector3d c(positions[indices[i + 2]]);
        const Vector3d normal = glm::cross(b - a, c - a);
        for (size_t k = 0; k < 3; k++) sums[indices[i + k]] += normal;
    }
    normals.assign(positions.size(), Vector3f(0, 0, 1));
    for (size_t i = 0; i < sums.size(); i++) {
        const double length = glm::length(sums[i]);
        if (length > 0.0 && std::isfinite(length)) normals[i] = Vector3f(sums[i] / length);
    }
}

}  // namespace glint
