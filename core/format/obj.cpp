#include <glint/format/mesh.h>

#include <glint/base/format_error.h>
#include <glint/base/hash.h>
#include <glint/base/log.h>

#include <glm/geometric.hpp>

#include <charconv>
#include <unordered_map>

// Read here and not by tinyobjloader, because of what 2.0.0rc10 does with defective files: a malformed number becomes
// 0, a quad with an index out of range disappears, errors have no line; and its decimals are not correctly rounded.

namespace glint {

namespace {

/// The blank-separated words of one line.
class Words {
public:
    explicit Words(std::string_view line) : rest_(line) {}

    /// The next word, empty at the end of the line.
    std::string_view next() {
        const size_t begin = std::min(rest_.find_first_not_of(blanks), rest_.size());
        rest_.remove_prefix(begin);
        const std::string_view word = rest_.substr(0, rest_.find_first_of(blanks));
        rest_.remove_prefix(word.size());
        return word;
    }

    /// What is left, without blanks at its ends.
    std::string_view remainder() const {
        const size_t begin = rest_.find_first_not_of(blanks);
        if (begin == std::string_view::npos) return {};
        return rest_.substr(begin, rest_.find_last_not_of(blanks) - begin + 1);
    }

private:
    static constexpr std::string_view blanks = " \t\r\v\f";
    std::string_view rest_;
};

bool parseFloat(std::string_view word, float& value) {
    if (!word.empty() && word.front() == '+') word.remove_prefix(1);
    const char* end = word.data() + word.size();
    const auto [rest, error] = std::from_chars(word.data(), end, value);
    if (rest != end || word.empty() || error == std::errc::invalid_argument) return false;
    if (error == std::errc()) return true;
    // Out of float's range: too small is 0, too large infinity, and float64 tells them apart (its own range ends where
    // the number's exponent has lost all sense, which is malformed).
    double wide = 0.0;
    if (std::from_chars(word.data(), end, wide).ec != std::errc()) return false;
    value = static_cast<float>(wide);
    return true;
}

/// Indices of one corner into positions, texture coordinates and normals, from 1; 0 is absent.
struct Corner {
    uint32_t position = 0;
    uint32_t texcoord = 0;
    uint32_t normal = 0;
    bool operator==(const Corner&) const = default;
};

struct CornerHash {
    size_t operator()(const Corner& corner) const { return hashBytes(&corner, sizeof corner).low; }
};

class ObjReader {
public:
    ObjReader(const std::string& name, uint64_t limit) : name_(name), limit_(limit) {}

    Expected<Mesh> read(std::string_view text) {
        if (text.find_first_not_of(" \t\r\n") == std::string_view::npos)
            return unexpected(error(ErrorCode::Io, "mesh.empty_file", "the file is empty"));
        while (!text.empty()) {
            const std::string_view line = text.substr(0, text.find('\n'));
            text.remove_prefix(std::min(line.size() + 1, text.size()));
            line_++;
            if (Status status = readLine(line); !status) return unexpected(status.error());
        }
        line_ = 0;
        endPart();
        if (mesh_.indices.empty()) return unexpected(error(ErrorCode::Io, "mesh.no_faces", "the file has no faces"));
        dropPartialAttributes();
        return std::move(mesh_);
    }

private:
    template <class... Args>
    Error error(ErrorCode code, const char* id, fmt::format_string<Args...> format, Args&&... args) const {
        return Error::inFile(code, id, fmt::format(format, std::forward<Args>(args)...), name_, line_);
    }

    Status readLine(std::string_view line) {
        Words words(line);
        const std::string_view keyword = words.next();
        if (keyword == "v") return readNumbers(words, "position", positions_);
        if (keyword == "vt") return readNumbers(words, "texture coordinate", texcoords_);
        if (keyword == "vn") return readNumbers(words, "normal", normals_);
        if (keyword == "f") return readFace(words);
        if (keyword == "o" || keyword == "g") {
            endPart();
            part_.name = words.remainder();
        }
        return {};
    }

    template <class Vector>
    Status readNumbers(Words& words, const char* what, std::vector<Vector>& vectors) {
        Vector vector(0.0f);
        // A texture coordinate may stop after its first number.
        const int required = std::is_same_v<Vector, Vector2f> ? 1 : 3;
        for (int i = 0; i < Vector::length(); i++) {
            const std::string_view word = words.next();
            if (word.empty() && i >= required) break;
            if (!parseFloat(word, vector[i]))
                return error(ErrorCode::Io, "mesh.syntax", "{} {} has '{}' for number {} of {}", what,
                             vectors.size() + 1, word, i + 1, Vector::length());
            if (!std::isfinite(vector[i]))
                return error(ErrorCode::Io, "mesh.not_finite", "{} {} has the value {}", what, vectors.size() + 1,
                             vector[i]);
        }
        if (vectors.size() >= max_elements)
            return error(ErrorCode::OutOfRange, "mesh.too_large", "more than {} {}s", max_elements, what);
        vectors.push_back(vector);
        return {};
    }

    /// Turns an index of the file, from 1 or negative from the end, into one from 1. False if it names nothing.
    static bool resolve(std::string_view word, size_t count, uint32_t& index) {
        int64_t value = 0;
        const char* end = word.data() + word.size();
        const auto [rest, error] = std::from_chars(word.data(), end, value);
        if (rest != end || error != std::errc()) return false;
        const auto size = static_cast<int64_t>(count);
        if (value < 0 && value >= -size) value += size + 1;
        if (value < 1 || value > size) return false;
        index = static_cast<uint32_t>(value);
        return true;
    }

    Status readCorner(std::string_view word, Corner& corner) const {
        const size_t first = std::min(word.find('/'), word.size());
        const size_t second = std::min(word.find('/', first + 1), word.size());
        const std::string_view position = word.substr(0, first);
        const std::string_view texcoord = first < word.size() ? word.substr(first + 1, second - first - 1) : "";
        const std::string_view normal = second < word.size() ? word.substr(second + 1) : "";
        if (!resolve(position, positions_.size(), corner.position))
            return outOfRange(word, "position", positions_.size());
        if (!texcoord.empty() && !resolve(texcoord, texcoords_.size(), corner.texcoord))
            return outOfRange(word, "texture coordinate", texcoords_.size());
        if (!normal.empty() && !resolve(normal, normals_.size(), corner.normal))
            return outOfRange(word, "normal", normals_.size());
        return {};
    }

    Error outOfRange(std::string_view word, const char* what, size_t count) const {
        return error(ErrorCode::Io, "mesh.index_range", "face {}: '{}' names no {}; {} of them stand above", face_ + 1,
                     word.substr(0, 100), what, count);
    }

    Status readFace(Words& words) {
        corners_.clear();
        for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
            Corner corner;
            if (Status status = readCorner(word, corner); !status) return status;
            corners_.push_back(corner);
            if (corners_.size() > max_corners) break;
        }
        if (corners_.size() < 3 || corners_.size() > max_corners)
            return error(ErrorCode::Io, "mesh.face_corners", "face {} has {}{} corners, 3 to {} are allowed", face_ + 1,
                         corners_.size() > max_corners ? "more than " : "", std::min(corners_.size(), max_corners),
                         max_corners);
        face_++;

        polygon_.clear();
        for (const Corner& corner : corners_) polygon_.push_back(positions_[corner.position - 1]);
        for (const uint32_t corner : triangulatePolygon(polygon_)) mesh_.indices.push_back(vertex(corners_[corner]));

        const uint64_t size = mesh_.positions.size() * vertex_size + mesh_.indices.size() * sizeof(uint32_t);
        if (size > limit_ || mesh_.indices.size() > UINT32_MAX)
            return error(ErrorCode::OutOfRange, "mesh.too_large",
                         "{} vertices and {} indices take more than the limit of {} bytes", mesh_.positions.size(),
                         mesh_.indices.size(), limit_);
        return {};
    }

    uint32_t vertex(const Corner& corner) {
        const auto [entry, is_new] = vertices_.try_emplace(corner, static_cast<uint32_t>(mesh_.positions.size()));
        if (is_new) {
            mesh_.positions.push_back(positions_[corner.position - 1]);
            mesh_.texcoords.push_back(corner.texcoord ? texcoords_[corner.texcoord - 1] : Vector2f(0.0f));
            Vector3f normal(0, 0, 1);
            if (corner.normal) {
                const Vector3d given(normals_[corner.normal - 1]);
                const double length = glm::length(given);
                if (length > 0.0) normal = Vector3f(given / length);
            }
            mesh_.normals.push_back(normal);
            with_texcoord_ += corner.texcoord != 0;
            with_normal_ += corner.normal != 0;
        }
        return entry->second;
    }

    void endPart() {
        const auto end = static_cast<uint32_t>(mesh_.indices.size());
        part_.index_count = end - part_.first_index;
        if (part_.index_count) mesh_.parts.push_back(part_);
        part_ = {.name = {}, .first_index = end, .index_count = 0};
    }

    void dropPartialAttributes() {
        const size_t count = mesh_.positions.size();
        if (with_texcoord_ < count) mesh_.texcoords.clear();
        if (with_normal_ < count) mesh_.normals.clear();
        const auto warn = [&](size_t with, const char* what) {
            if (with == 0 || with == count) return;
            log(LogLevel::Warning, "mesh.attribute_dropped",
                fmt::format("{}: {} of {} vertices have no {}; none is kept", name_, count - with, count, what));
        };
        warn(with_texcoord_, "texture coordinate");
        warn(with_normal_, "normal");
    }

    static constexpr size_t max_corners = 1024;
    static constexpr size_t max_elements = UINT32_MAX - 1;
    static constexpr uint64_t vertex_size = sizeof(Vector3f) * 2 + sizeof(Vector2f);

    const std::string& name_;
    uint64_t limit_ = 0;
    uint32_t line_ = 0;
    size_t face_ = 0;
    std::vector<Vector3f> positions_;
    std::vector<Vector2f> texcoords_;
    std::vector<Vector3f> normals_;
    std::vector<Corner> corners_;
    std::vector<Vector3f> polygon_;
    std::unordered_map<Corner, uint32_t, CornerHash> vertices_;
    size_t with_texcoord_ = 0;
    size_t with_normal_ = 0;
    MeshPart part_;
    Mesh mesh_;
};

}  // namespace

Expected<Mesh> parseObj(std::string_view text, const std::string& name, uint64_t limit) {
    return ObjReader(name, limit).read(text);
}

}  // namespace glint
