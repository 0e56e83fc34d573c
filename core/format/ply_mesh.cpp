#include <glint/format/mesh.h>
#include <glint/format/ply.h>

#include <glint/base/format_error.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <climits>
#include <cstring>

namespace glint {

namespace {

template <size_t N>
using Names = std::array<const char*, N>;

constexpr Names<3> position_names = {"x", "y", "z"};
constexpr Names<3> normal_names = {"nx", "ny", "nz"};
constexpr std::array<Names<2>, 4> texcoord_names = {{{"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}, {"u0", "v0"}}};

class MeshReader {
public:
    MeshReader(std::span<const std::byte> file, const PlyHeader& header, const std::string& name, uint64_t limit)
        : header_(header), name_(name), limit_(limit), reader_(file, header, name) {}

    Expected<Mesh> read() {
        const PlyElement* vertices = header_.find("vertex");
        if (!vertices || vertices->count == 0)
            return unexpected(
                error(ErrorCode::Io, "mesh.no_positions", "the file has no element 'vertex', or none of it"));
        // Faces are split where their corners are, so they wait for the vertices.
        std::vector<std::pair<const PlyElement*, size_t>> waiting;
        bool has_vertices = false;
        for (const PlyElement& element : header_.elements) {
            Status status;
            if (&element == vertices) {
                status = readVertices(element);
                has_vertices = true;
            } else if (!hasTriangles(element)) {
                status = reader_.skip(element);
            } else if (has_vertices) {
                status = readTriangles(element);
            } else {
                waiting.emplace_back(&element, reader_.position());
                status = reader_.skip(element);
            }
            if (!status) return unexpected(status.error());
        }
        for (const auto& [element, position] : waiting) {
            reader_.seek(position);
            if (Status status = readTriangles(*element); !status) return unexpected(status.error());
        }
        if (mesh_.indices.empty())
            return unexpected(error(ErrorCode::Io, "mesh.no_faces", "the file has no faces and no triangle strips"));
        return std::move(mesh_);
    }

private:
    template <class... Args>
    Error error(ErrorCode code, const char* id, fmt::format_string<Args...> format, Args&&... args) const {
        return Error::inFile(code, id, fmt::format(format, std::forward<Args>(args)...), name_, 0);
    }

    static const PlyProperty* indicesOf(const PlyElement& element) {
        const PlyProperty* indices = element.find("vertex_indices");
        if (!indices) indices = element.find("vertex_index");
        return indices && indices->is_list ? indices : nullptr;
    }

    static bool hasTriangles(const PlyElement& element) {
        return (element.name == "face" || element.name == "tristrips") && indicesOf(element);
    }

    /// Whether the element has all of the properties; then an array is made for them, and `columns` says what goes
    /// there.
    template <size_t N, class Vector>
    static bool addColumns(const PlyElement& element, const Names<N>& names, std::vector<Vector>& values,
                           std::vector<PlyReader::Column>& columns) {
        std::array<const PlyProperty*, N> found;
        for (size_t i = 0; i < N; i++) {
            found[i] = element.find(names[i]);
            if (!found[i] || found[i]->is_list) return false;
        }
        values.resize(element.count);
        for (size_t i = 0; i < N; i++)
            columns.push_back({.property = found[i], .values = &values[0][static_cast<int>(i)], .stride = N});
        return true;
    }

    Status readVertices(const PlyElement& element) {
        // Judged with every attribute, so that nothing is allocated for what will be refused.
        if (element.count > UINT32_MAX || element.count * vertex_size > limit_)
            return error(ErrorCode::OutOfRange, "mesh.too_large",
                         "{} vertices of {} bytes exceed the limit of {} bytes", element.count, vertex_size, limit_);
        std::vector<PlyReader::Column> columns;
        if (!addColumns(element, position_names, mesh_.positions, columns))
            return error(ErrorCode::Io, "mesh.no_positions", "the vertices have no properties x, y and z");
        addColumns(element, normal_names, mesh_.normals, columns);
        for (const Names<2>& names : texcoord_names)
            if (addColumns(element, names, mesh_.texcoords, columns)) break;
        if (Status status = reader_.readColumns(element, columns); !status) return status;

        for (size_t i = 0; i < mesh_.positions.size(); i++) {
            const bool is_finite = isFinite(mesh_.positions[i]) &&
                                   (mesh_.normals.empty() || isFinite(mesh_.normals[i])) &&
                                   (mesh_.texcoords.empty() || isFinite(Vector3f(mesh_.texcoords[i], 0.0f)));
            if (!is_finite)
                return error(ErrorCode::Io, "mesh.not_finite", "vertex {} has a coordinate that is NaN or infinite", i);
        }
        for (Vector3f& normal : mesh_.normals) {
            const double length = glm::length(Vector3d(normal));
            normal = length > 0.0 ? Vector3f(Vector3d(normal) / length) : Vector3f(0, 0, 1);
        }
        return {};
    }

    Status readTriangles(const PlyElement& element) {
        const bool is_strip = element.name == "tristrips";
        // Each face gives a triangle at least.
        if (Status status = reserve(is_strip ? 0 : element.count); !status) return status;
        return reader_.readLists(element, *indicesOf(element), [&](uint64_t, std::span<const double> corners) {
            return is_strip ? addStrip(corners) : addFace(corners);
        });
    }

    /// Makes room for more triangles. By halves and never beyond the limit, so that old and new together stay below
    /// twice of it.
    Status reserve(uint64_t triangles) {
        const uint64_t vertices = mesh_.positions.size() * vertex_size;
        const uint64_t most = std::min<uint64_t>((limit_ - vertices) / sizeof(uint32_t), UINT32_MAX);
        if (triangles > (most - mesh_.indices.size()) / 3)
            return makeError(ErrorCode::OutOfRange, "mesh.too_large",
                             "{} vertices and {} and {} more indices exceed the limit of {} bytes",
                             mesh_.positions.size(), mesh_.indices.size(), 3 * triangles, limit_);
        const uint64_t needed = mesh_.indices.size() + 3 * triangles;
        if (needed > mesh_.indices.capacity())
            mesh_.indices.reserve(std::max(needed, std::min<uint64_t>(most, mesh_.indices.capacity() * 3 / 2)));
        return {};
    }

    bool isVertex(double index) const {
        return index >= 0.0 && index < static_cast<double>(mesh_.positions.size()) && index == std::trunc(index);
    }

    Error noVertex(double index, size_t corner) const {
        return makeError(ErrorCode::OutOfRange, "mesh.index_range", "corner {} names vertex {} of {}", corner, index,
                         mesh_.positions.size());
    }

    void addTriangle(double a, double b, double c) {
        for (const double corner : {a, b, c}) mesh_.indices.push_back(static_cast<uint32_t>(corner));
    }

    Status addFace(std::span<const double> corners) {
        const size_t count = corners.size();
        if (count < 3) return makeError(ErrorCode::Io, "mesh.face_corners", "a face of {} corners", count);
        for (size_t i = 0; i < count; i++)
            if (!isVertex(corners[i])) return noVertex(corners[i], i);
        if (Status status = reserve(count - 2); !status) return status;
        // A quadrilateral goes the shorter way, which is never wrong for a convex one.
        size_t first = 0;
        if (count == 4) {
            const auto distance = [&](size_t i, size_t k) {
                return glm::distance(Vector3d(mesh_.positions[static_cast<size_t>(corners[i])]),
                                     Vector3d(mesh_.positions[static_cast<size_t>(corners[k])]));
            };
            first = distance(1, 3) < distance(0, 2) ? 1 : 0;
        }
        for (size_t i = 1; i + 1 < count; i++)
            addTriangle(corners[first], corners[(first + i) % count], corners[(first + i + 1) % count]);
        return {};
    }

    /// Every second triangle of a strip turns the other way; -1 ends a strip and begins the next.
    Status addStrip(std::span<const double> corners) {
        size_t length = 0;
        for (size_t i = 0; i < corners.size(); i++) {
            if (corners[i] == -1.0) {
                length = 0;
                continue;
            }
            if (!isVertex(corners[i])) return noVertex(corners[i], i);
            if (++length < 3) continue;
            if (Status status = reserve(1); !status) return status;
            const bool is_turned = length % 2 == 0;
            addTriangle(corners[i - (is_turned ? 1 : 2)], corners[i - (is_turned ? 2 : 1)], corners[i]);
        }
        return {};
    }

    static constexpr uint64_t vertex_size = sizeof(Vector3f) * 2 + sizeof(Vector2f);

    const PlyHeader& header_;
    const std::string& name_;
    uint64_t limit_ = 0;
    PlyReader reader_;
    Mesh mesh_;
};

template <class T>
std::byte* put(std::byte* at, const T& value) {
    std::memcpy(at, &value, sizeof(T));
    return at + sizeof(T);
}

}  // namespace

Expected<Mesh> parsePly(std::span<const std::byte> file, const std::string& name, uint64_t limit) {
    const Expected<PlyHeader> header = parsePlyHeader(file, name);
    if (!header) return unexpected(header.error());
    return MeshReader(file, *header, name, limit).read();
}

Expected<std::vector<std::byte>> encodePly(const Mesh& mesh) {
    static_assert(std::endian::native == std::endian::little, "values are copied as they are");
    if (Status status = mesh.validate(); !status) return unexpected(status.error());
    if (mesh.positions.size() > INT32_MAX)
        return unexpected(makeError(ErrorCode::OutOfRange, "mesh.too_large", "{} vertices: indices of a PLY end at {}",
                                    mesh.positions.size(), INT32_MAX));
    std::string header =
        fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", mesh.positions.size());
    size_t vertex_size = sizeof(Vector3f);
    const auto addProperties = [&](const auto& names) {
        for (const char* name : names) header += fmt::format("property float {}\n", name);
    };
    addProperties(position_names);
    if (!mesh.normals.empty()) {
        addProperties(normal_names);
        vertex_size += sizeof(Vector3f);
    }
    if (!mesh.texcoords.empty()) {
        addProperties(texcoord_names[1]);
        vertex_size += sizeof(Vector2f);
    }
    header +=
        fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.triangleCount());

    constexpr size_t face_size = 1 + 3 * sizeof(uint32_t);
    std::vector<std::byte> file(header.size() + mesh.positions.size() * vertex_size + mesh.triangleCount() * face_size);
    std::memcpy(file.data(), header.data(), header.size());
    std::byte* at = file.data() + header.size();
    for (size_t i = 0; i < mesh.positions.size(); i++) {
        at = put(at, mesh.positions[i]);
        if (!mesh.normals.empty()) at = put(at, mesh.normals[i]);
        if (!mesh.texcoords.empty()) at = put(at, mesh.texcoords[i]);
    }
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        at = put(at, uint8_t{3});
        for (size_t k = 0; k < 3; k++) at = put(at, mesh.indices[i + k]);
    }
    return file;
}

}  // namespace glint
