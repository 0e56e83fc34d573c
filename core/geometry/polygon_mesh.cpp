#include <glint/geometry/polygon_mesh.h>

#include <glint/base/format_error.h>
#include <glint/base/hash.h>

#include <glm/geometric.hpp>

#include <array>
#include <bit>
#include <unordered_map>

namespace glint {

namespace {

Status checkAttribute(const PolygonAttribute& attribute, size_t corners) {
    const std::string& name = attribute.name;
    if (attribute.components == 0 || attribute.values.size() % attribute.components != 0)
        return makeError(ErrorCode::InvalidArgument, "polygon.attribute_count",
                         "attribute '{}' has {} numbers for values of {} components", name, attribute.values.size(),
                         attribute.components);
    if (attribute.indices.size() != corners)
        return makeError(ErrorCode::InvalidArgument, "polygon.attribute_count",
                         "attribute '{}' has {} indices for {} corners", name, attribute.indices.size(), corners);
    const size_t count = attribute.values.size() / attribute.components;
    for (size_t i = 0; i < corners; i++)
        if (attribute.indices[i] >= count)
            return makeError(ErrorCode::OutOfRange, "polygon.attribute_range",
                             "attribute '{}': corner {} names value {} of {}", name, i, attribute.indices[i], count);
    for (size_t i = 0; i < attribute.values.size(); i++)
        if (!std::isfinite(attribute.values[i]))
            return makeError(ErrorCode::InvalidArgument, "polygon.not_finite", "attribute '{}': value {} has {}", name,
                             i / attribute.components, attribute.values[i]);
    return {};
}

/// Numbers keys in the order in which they come.
template <size_t Size>
class Numbering {
public:
    explicit Numbering(size_t expected) { numbers_.reserve(expected); }

    uint32_t operator()(const std::array<uint32_t, Size>& key) {
        return numbers_.try_emplace(key, static_cast<uint32_t>(numbers_.size())).first->second;
    }

private:
    struct KeyHash {
        size_t operator()(const std::array<uint32_t, Size>& key) const { return hashBytes(key.data(), sizeof key).low; }
    };
    std::unordered_map<std::array<uint32_t, Size>, uint32_t, KeyHash> numbers_;
};

/// The bits of a number; those of 0 for -0.
uint32_t bitsOf(float value) { return std::bit_cast<uint32_t>(value + 0.0f); }

/// Numbers the combinations of an index and another one, in any order but the same for the same calls. Nearly every
/// second index belongs to one first one, so a table by the second does for most.
class PairNumbering {
public:
    explicit PairNumbering(size_t seconds) : firsts_(seconds, UINT32_MAX), numbers_(seconds) {}

    uint32_t operator()(uint32_t first, uint32_t second) {
        if (firsts_[second] == UINT32_MAX) {
            firsts_[second] = first;
            numbers_[second] = count_++;
        }
        if (firsts_[second] == first) return numbers_[second];
        const auto [entry, is_new] = others_.try_emplace(uint64_t{first} << 32 | second, count_);
        count_ += is_new;
        return entry->second;
    }

private:
    std::vector<uint32_t> firsts_, numbers_;
    std::unordered_map<uint64_t, uint32_t> others_;
    uint32_t count_ = 0;
};

/// The corners of a polygon's triangles.
class Triangulation {
public:
    explicit Triangulation(const PolygonMesh& polygons) : polygons_(polygons) {}

    /// Calls visit(a, b, c) with corners.
    template <class Visit>
    void forEach(Visit&& visit) const {
        for (size_t face = 0; face < polygons_.faceCount(); face++) {
            const uint32_t first = polygons_.offsets[face], end = polygons_.offsets[face + 1];
            if (end - first == 4 && distance(first + 1, first + 3) < distance(first, first + 2)) {
                visit(first, first + 1, first + 3);
                visit(first + 1, first + 2, first + 3);
                continue;
            }
            for (uint32_t corner = first + 2; corner < end; corner++) visit(first, corner - 1, corner);
        }
    }

private:
    double distance(uint32_t a, uint32_t b) const {
        const Vector3d along =
            Vector3d(polygons_.positions[polygons_.indices[a]]) - Vector3d(polygons_.positions[polygons_.indices[b]]);
        return glm::dot(along, along);
    }
    const PolygonMesh& polygons_;
};

/// An attribute that Mesh has too, nullptr if it is absent.
Expected<const PolygonAttribute*> known(const PolygonMesh& polygons, std::string_view name, uint32_t components) {
    const PolygonAttribute* attribute = polygons.attribute(name);
    if (attribute && attribute->components != components)
        return unexpected(makeError(ErrorCode::InvalidArgument, "polygon.attribute_count",
                                    "attribute '{}' has {} components, {} are what a mesh has", name,
                                    attribute->components, components));
    return attribute;
}

}  // namespace

const PolygonAttribute* PolygonMesh::attribute(std::string_view name) const {
    for (const PolygonAttribute& attribute : attributes)
        if (attribute.name == name) return &attribute;
    return nullptr;
}

Status PolygonMesh::validate() const {
    if (faceCount() == 0) return makeError(ErrorCode::InvalidArgument, "polygon.no_faces", "there are no polygons");
    if (offsets.front() != 0 || offsets.back() != indices.size())
        return makeError(ErrorCode::InvalidArgument, "polygon.offsets", "offsets run from {} to {}, not from 0 to {}",
                         offsets.front(), offsets.back(), indices.size());
    for (size_t face = 0; face < faceCount(); face++) {
        if (offsets[face + 1] < offsets[face] || offsets[face + 1] > indices.size())
            return makeError(ErrorCode::InvalidArgument, "polygon.offsets",
                             "face {} has the corners from {} up to {}, of {} in all", face, offsets[face],
                             offsets[face + 1], indices.size());
        if (offsets[face + 1] - offsets[face] < 3)
            return makeError(ErrorCode::InvalidArgument, "polygon.face_corners",
                             "face {} has {} corners, not 3 or more", face, offsets[face + 1] - offsets[face]);
    }
    // The last face that named each vertex, plus 1.
    std::vector<uint32_t> faces(positions.size(), 0);
    for (size_t face = 0; face < faceCount(); face++)
        for (uint32_t corner = offsets[face]; corner < offsets[face + 1]; corner++) {
            if (indices[corner] >= positions.size())
                return makeError(ErrorCode::OutOfRange, "polygon.index_range", "face {} names vertex {} of {}", face,
                                 indices[corner], positions.size());
            uint32_t& last = faces[indices[corner]];
            if (last == face + 1)
                return makeError(ErrorCode::InvalidArgument, "polygon.repeated_vertex", "face {} names vertex {} twice",
                                 face, indices[corner]);
            last = static_cast<uint32_t>(face + 1);
        }
    for (size_t i = 0; i < positions.size(); i++)
        if (!isFinite(positions[i]))
            return makeError(ErrorCode::InvalidArgument, "polygon.not_finite", "position {} is ({}, {}, {})", i,
                             positions[i].x, positions[i].y, positions[i].z);
    for (const PolygonAttribute& attribute : attributes)
        if (Status status = checkAttribute(attribute, indices.size()); !status) return status;
    for (const PolygonCrease& crease : creases) {
        if (crease.first >= positions.size() || crease.second >= positions.size())
            return makeError(ErrorCode::OutOfRange, "polygon.crease", "a crease from vertex {} to vertex {} of {}",
                             crease.first, crease.second, positions.size());
        if (!(crease.sharpness >= 0.0f))
            return makeError(ErrorCode::InvalidArgument, "polygon.crease",
                             "the crease from vertex {} to vertex {} has the sharpness {}, not one of 0 to infinity",
                             crease.first, crease.second, crease.sharpness);
    }
    return {};
}

Expected<PolygonMesh> toPolygons(const Mesh& mesh) {
    if (Status status = mesh.validate(); !status) return unexpected(status.error());
    PolygonMesh polygons;
    polygons.offsets.push_back(0);
    PolygonAttribute texcoords{.name = "texcoord", .components = 2, .values = {}, .indices = {}};

    std::vector<uint32_t> welded(mesh.positions.size());
    Numbering<3> places(mesh.positions.size());
    for (size_t i = 0; i < welded.size(); i++) {
        const Vector3f& p = mesh.positions[i];
        welded[i] = places({bitsOf(p.x), bitsOf(p.y), bitsOf(p.z)});
        if (welded[i] == polygons.positions.size()) polygons.positions.push_back(p);
    }
    Numbering<3> values(mesh.texcoords.size());
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        const std::array<uint32_t, 3> corners = {welded[mesh.indices[i]], welded[mesh.indices[i + 1]],
                                                 welded[mesh.indices[i + 2]]};
        if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
        polygons.indices.insert(polygons.indices.end(), corners.begin(), corners.end());
        polygons.offsets.push_back(static_cast<uint32_t>(polygons.indices.size()));
        if (mesh.texcoords.empty()) continue;
        for (size_t k = 0; k < 3; k++) {
            const Vector2f& uv = mesh.texcoords[mesh.indices[i + k]];
            const uint32_t value = values({corners[k], bitsOf(uv.x), bitsOf(uv.y)});
            if (2 * size_t{value} == texcoords.values.size())
                texcoords.values.insert(texcoords.values.end(), {uv.x, uv.y});
            texcoords.indices.push_back(value);
        }
    }
    if (polygons.indices.empty())
        return unexpected(makeError(ErrorCode::InvalidArgument, "polygon.no_faces",
                                    "each of the {} triangles has two corners at one place", mesh.triangleCount()));
    if (!mesh.texcoords.empty()) polygons.attributes.push_back(std::move(texcoords));
    return polygons;
}

Expected<Mesh> toTriangles(const PolygonMesh& polygons) {
    if (Status status = polygons.validate(); !status) return unexpected(status.error());
    const Expected<const PolygonAttribute*> texcoords = known(polygons, "texcoord", 2);
    if (!texcoords) return unexpected(texcoords.error());
    const Expected<const PolygonAttribute*> normals = known(polygons, "normal", 3);
    if (!normals) return unexpected(normals.error());
    const uint64_t index_count = (uint64_t{polygons.indices.size()} - 2 * polygons.faceCount()) * 3;
    if (index_count > UINT32_MAX)
        return unexpected(makeError(ErrorCode::OutOfRange, "polygon.too_large", "{} indices of triangles, at most {}",
                                    index_count, UINT32_MAX));

    Mesh mesh;
    mesh.indices.reserve(index_count);
    const Triangulation triangulation(polygons);
    if (!*texcoords && !*normals) {
        mesh.positions = polygons.positions;
        triangulation.forEach([&](uint32_t a, uint32_t b, uint32_t c) {
            mesh.indices.insert(mesh.indices.end(), {polygons.indices[a], polygons.indices[b], polygons.indices[c]});
        });
        return mesh;
    }

    // The combination at each corner, then the combinations in the order in which the triangles use them.
    std::vector<uint32_t> combined = polygons.indices;
    for (const PolygonAttribute* attribute : {*texcoords, *normals}) {
        if (!attribute) continue;
        PairNumbering numbering(attribute->values.size() / attribute->components);
        for (size_t i = 0; i < combined.size(); i++) combined[i] = numbering(combined[i], attribute->indices[i]);
    }
    std::vector<uint32_t> vertices(combined.size(), UINT32_MAX);
    const auto vertex = [&](uint32_t corner) {
        uint32_t& number = vertices[combined[corner]];
        if (number != UINT32_MAX) return number;
        number = static_cast<uint32_t>(mesh.positions.size());
        mesh.positions.push_back(polygons.positions[polygons.indices[corner]]);
        if (*texcoords) {
            const float* uv = &(*texcoords)->values[size_t{2} * (*texcoords)->indices[corner]];
            mesh.texcoords.emplace_back(uv[0], uv[1]);
        }
        if (*normals) {
            const float* n = &(*normals)->values[size_t{3} * (*normals)->indices[corner]];
            const Vector3d given(n[0], n[1], n[2]);
            const double length = glm::length(given);
            mesh.normals.push_back(length > 0.0 ? Vector3f(given / length) : Vector3f(0, 0, 1));
        }
        return number;
    };
    triangulation.forEach([&](uint32_t a, uint32_t b, uint32_t c) {
        for (const uint32_t corner : {a, b, c}) mesh.indices.push_back(vertex(corner));
    });
    return mesh;
}

}  // namespace glint
