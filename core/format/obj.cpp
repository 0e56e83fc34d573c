#include <glint/format/mesh.h>

#include <glint/base/format_error.h>
#include <glint/base/hash.h>
#include <glint/base/log.h>

#include <glm/geometric.hpp>
#include <tiny_obj_loader.h>

#include <array>
#include <charconv>
#include <climits>
#include <unordered_map>

namespace glint {

namespace {

constexpr std::string_view blanks = " \t";  // tinyobjloader's

template <class... Args>
Error fileError(const std::string& name, uint32_t line, ErrorCode code, const char* id,
                fmt::format_string<Args...> format, Args&&... args) {
    return Error::inFile(code, id, fmt::format(format, std::forward<Args>(args)...), name, line);
}

std::string_view trim(std::string_view text) {
    const size_t begin = text.find_first_not_of(blanks);
    if (begin == std::string_view::npos) return {};
    return text.substr(begin, text.find_last_not_of(blanks) - begin + 1);
}

/// Takes the next word off a line; empty at its end.
std::string_view takeWord(std::string_view& line) {
    line.remove_prefix(std::min(line.find_first_not_of(blanks), line.size()));
    const std::string_view word = line.substr(0, line.find_first_of(blanks));
    line.remove_prefix(word.size());
    return word;
}

/// Stands before tinyobjloader (2.0.0rc10), which never fails where a defect can be read over and names no line:
/// refuses what the library would misread, and hands on the lines that describe triangles.
class ObjGuard {
public:
    explicit ObjGuard(const std::string& name) : name_(name) {}

    /// Other lines are not handed on: the library fails for the whole file at a bad line or point, repeats both at each
    /// change of material, and makes 400 KB of a tag of 20 bytes.
    Expected<std::string> filter(std::string_view text) {
        if (text.find_first_not_of(" \t\r\n") == std::string_view::npos)
            return unexpected(error(ErrorCode::Io, "mesh.empty_file", "the file is empty"));
        std::string kept;
        kept.reserve(text.size());
        while (!text.empty()) {
            line_++;
            const std::string_view line = text.substr(0, text.find_first_of("\r\n"));
            text.remove_prefix(line.size());
            text.remove_prefix(std::min<size_t>(text.starts_with("\r\n") ? 2 : 1, text.size()));

            std::string_view words = line;
            const std::string_view keyword = takeWord(words);
            Status status;
            if (keyword == "v")
                status = checkNumbers(words, 0, 3, 3);
            else if (keyword == "vt")
                status = checkNumbers(words, 1, 1, 2);
            else if (keyword == "vn")
                status = checkNumbers(words, 2, 3, 3);
            else if (keyword == "f")
                status = checkFace(words);
            else if (keyword != "o" && keyword != "g")
                continue;
            // The library reads a line up to its first zero byte.
            if (status && line.find('\0') != std::string_view::npos)
                status = error(ErrorCode::Io, "mesh.syntax", "the line has a zero byte");
            if (!status) return unexpected(status.error());
            // The library takes a keyword for one if a blank follows, and `g` may stand alone.
            kept.append(line).append(" \n");
        }
        return kept;
    }

    /// How many triangles the faces have if every polygon of n corners gives n - 2.
    uint64_t triangleCount() const { return triangles_; }

private:
    template <class... Args>
    Error error(ErrorCode code, const char* id, fmt::format_string<Args...> format, Args&&... args) const {
        return fileError(name_, line_, code, id, format, std::forward<Args>(args)...);
    }

    /// The library reads a word that is no number as 0, '1x' as 1, a missing number as 0, and 1e39 as infinity.
    Status checkNumbers(std::string_view words, size_t what, int required, int count) {
        for (int i = 0; i < count; i++) {
            const std::string_view word = takeWord(words);
            if (word.empty() && i >= required) break;
            const std::string_view digits = word.starts_with('+') && !word.starts_with("+-") ? word.substr(1) : word;
            const char* end = digits.data() + digits.size();
            double value = 0.0;
            const auto [rest, failure] = std::from_chars(digits.data(), end, value);
            if (rest != end || failure != std::errc())
                return error(ErrorCode::Io, "mesh.syntax", "{} {} has '{}' for number {} of {}", names[what],
                             counts_[what] + 1, word.substr(0, 100), i + 1, count);
            if (!std::isfinite(static_cast<float>(value)))
                return error(ErrorCode::Io, "mesh.not_finite", "{} {} has the value {}", names[what], counts_[what] + 1,
                             value);
        }
        // The library counts in int.
        if (++counts_[what] == INT_MAX)
            return error(ErrorCode::OutOfRange, "mesh.too_large", "{} {}s are too many", counts_[what], names[what]);
        return {};
    }

    /// The library leaves out faces of fewer than three corners. The time it takes for a polygon can grow with the cube
    /// of its corners.
    Status checkFace(std::string_view words) {
        faces_++;
        size_t corners = 0;
        for (std::string_view word = takeWord(words); !word.empty(); word = takeWord(words)) {
            if (Status status = checkCorner(word); !status) return status;
            if (++corners > max_corners) break;
        }
        if (corners < 3 || corners > max_corners)
            return error(ErrorCode::Io, "mesh.face_corners", "face {} has {}{} corners, 3 to {} are allowed", faces_,
                         corners > max_corners ? "more than " : "", std::min(corners, max_corners), max_corners);
        triangles_ += corners - 2;
        return {};
    }

    /// i, i/j, i//k or i/j/k. The library leaves out polygons with a position out of range and hands on every other bad
    /// index, reads '1.5' and '1x' as 1, for '1/' takes the next corner's number too, and begins a new corner after the
    /// third index.
    Status checkCorner(std::string_view word) const {
        size_t what = 0;
        for (size_t begin = 0; begin <= word.size(); what++) {
            const size_t end = std::min(word.find('/', begin), word.size());
            const bool is_absent = what == 1 && end == begin && end < word.size();
            if (what == 3 || (!is_absent && !isIndex(word.substr(begin, end - begin), counts_[what])))
                return error(ErrorCode::Io, "mesh.index_range", "face {}: '{}' names no {}; {} of them stand above",
                             faces_, word.substr(0, 100), names[std::min<size_t>(what, 2)],
                             counts_[std::min<size_t>(what, 2)]);
            begin = end + 1;
        }
        return {};
    }

    static bool isIndex(std::string_view word, int64_t count) {
        int64_t value = 0;
        const char* end = word.data() + word.size();
        const auto [rest, failure] = std::from_chars(word.data(), end, value);
        return rest == end && failure == std::errc() && value != 0 && value >= -count && value <= count;
    }

    static constexpr size_t max_corners = 1024;
    static constexpr std::array names = {"position", "texture coordinate", "normal"};

    const std::string& name_;
    uint32_t line_ = 0;
    std::array<int64_t, 3> counts_{};  // as names
    uint64_t faces_ = 0;
    uint64_t triangles_ = 0;
};

/// Position, texture coordinate and normal of a corner, from 0; -1 is absent.
using Corner = std::array<int, 3>;

struct CornerHash {
    size_t operator()(const Corner& corner) const { return hashBytes(corner.data(), sizeof corner).low; }
};

/// Makes a mesh of what the library has read.
class MeshBuilder {
public:
    MeshBuilder(const tinyobj::attrib_t& source, const std::string& name) : source_(source), name_(name) {}

    Expected<Mesh> build(const std::vector<tinyobj::shape_t>& shapes, uint64_t limit) {
        // The library makes infinity or NaN of some finite numbers, such as 0e999.
        for (const auto* numbers : {&source_.vertices, &source_.texcoords, &source_.normals})
            for (const float number : *numbers)
                if (!std::isfinite(number))
                    return unexpected(fileError(name_, 0, ErrorCode::Io, "mesh.not_finite",
                                                "a number has too many digits or too large an exponent"));
        for (const tinyobj::shape_t& shape : shapes) {
            const size_t first = mesh_.indices.size();
            for (const tinyobj::index_t& index : shape.mesh.indices) {
                mesh_.indices.push_back(vertex({index.vertex_index, index.texcoord_index, index.normal_index}));
                const uint64_t size = mesh_.positions.size() * vertex_size + mesh_.indices.size() * sizeof(uint32_t);
                if (size > limit || mesh_.indices.size() > UINT32_MAX)
                    return unexpected(fileError(name_, 0, ErrorCode::OutOfRange, "mesh.too_large",
                                                "{} vertices and {} indices take more than the limit of {} bytes",
                                                mesh_.positions.size(), mesh_.indices.size(), limit));
            }
            if (const size_t count = mesh_.indices.size() - first; count > 0)
                mesh_.parts.push_back({.name = std::string(trim(shape.name)),
                                       .first_index = static_cast<uint32_t>(first),
                                       .index_count = static_cast<uint32_t>(count)});
        }
        if (mesh_.indices.empty())
            return unexpected(fileError(name_, 0, ErrorCode::Io, "mesh.no_faces", "the file has no faces"));
        dropIfPartial(mesh_.texcoords, with_texcoord_, "texture coordinate");
        dropIfPartial(mesh_.normals, with_normal_, "normal");
        return std::move(mesh_);
    }

private:
    uint32_t vertex(const Corner& corner) {
        const auto [entry, is_new] = vertices_.try_emplace(corner, static_cast<uint32_t>(mesh_.positions.size()));
        if (!is_new) return entry->second;
        const auto [position, texcoord, normal] = corner;
        mesh_.positions.push_back(vector3(source_.vertices, position));
        Vector2f uv(0.0f);
        if (texcoord >= 0) {
            const auto at = 2 * static_cast<size_t>(texcoord);
            uv = {source_.texcoords[at], source_.texcoords[at + 1]};
            with_texcoord_++;
        }
        mesh_.texcoords.push_back(uv);
        Vector3f unit(0, 0, 1);
        if (normal >= 0) {
            const Vector3d given(vector3(source_.normals, normal));
            if (const double length = glm::length(given); length > 0.0) unit = Vector3f(given / length);
            with_normal_++;
        }
        mesh_.normals.push_back(unit);
        return entry->second;
    }

    static Vector3f vector3(const std::vector<float>& numbers, int index) {
        const auto at = 3 * static_cast<size_t>(index);
        return {numbers[at], numbers[at + 1], numbers[at + 2]};
    }

    template <class Vector>
    void dropIfPartial(std::vector<Vector>& attribute, size_t with, const char* what) const {
        const size_t count = mesh_.positions.size();
        if (with == count) return;
        attribute.clear();
        if (with > 0)
            log(LogLevel::Warning, "mesh.attribute_dropped",
                fmt::format("{}: {} of {} vertices have no {}; none is kept", name_, count - with, count, what));
    }

    static constexpr uint64_t vertex_size = sizeof(Vector3f) * 2 + sizeof(Vector2f);

    const tinyobj::attrib_t& source_;
    const std::string& name_;
    std::unordered_map<Corner, uint32_t, CornerHash> vertices_;
    size_t with_texcoord_ = 0;
    size_t with_normal_ = 0;
    Mesh mesh_;
};

}  // namespace

Expected<Mesh> parseObj(std::string_view text, const std::string& name, uint64_t limit) {
    ObjGuard guard(name);
    Expected<std::string> lines = guard.filter(text);
    if (!lines) return unexpected(lines.error());

    tinyobj::ObjReaderConfig config;
    config.triangulate = true;
    config.vertex_color = false;
    tinyobj::ObjReader reader;
    if (!reader.ParseFromString(*lines, {}, config))
        return unexpected(fileError(name, 0, ErrorCode::Io, "mesh.syntax", "{}", reader.Error()));
    Expected<Mesh> mesh = MeshBuilder(reader.GetAttrib(), name).build(reader.GetShapes(), limit);
    if (mesh && mesh->triangleCount() < guard.triangleCount())
        log(LogLevel::Warning, "mesh.polygon_incomplete",
            fmt::format("{}: {} of {} triangles are missing: their polygons are concave or cross themselves", name,
                        guard.triangleCount() - mesh->triangleCount(), guard.triangleCount()));
    return mesh;
}

}  // namespace glint
