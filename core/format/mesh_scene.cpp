#include <glint/format/mesh_scene.h>

#include <glint/base/file.h>
#include <glint/base/format_error.h>
#include <glint/format/detail/json_text.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <set>

namespace glint {

namespace {

using nlohmann::json;

constexpr size_t max_depth = 8;  // a number of a transform is at 5

/// Reads a document; the first thing that is wrong with it is kept, and what follows it is read as nothing.
class SceneReading {
public:
    explicit SceneReading(const std::filesystem::path& path) : path_(path) {}

    Expected<MeshScene> read(std::string_view text) {
        const json document = parse(text);
        const json* meshes = required(document, "", "meshes", json::value_t::object);
        const json* instances = required(document, "", "instances", json::value_t::array);
        allow(document, "", {"meshes", "instances"});
        if (meshes && count("meshes", meshes->size(), MeshScene::max_meshes)) readFiles(*meshes);
        if (instances && count("instances", instances->size(), MeshScene::max_instances)) readInstances(*instances);
        if (error_) return unexpected(error_);
        return std::move(scene_);
    }

private:
    template <class... Args>
    void fail(const std::string& place, const char* id, fmt::format_string<Args...> format, Args&&... args) {
        if (error_) return;
        std::string message = fmt::format(format, std::forward<Args>(args)...);
        if (!place.empty()) message.insert(0, place + ": ");
        error_ = Error::inFile(ErrorCode::InvalidArgument, id, std::move(message), path_.string(), 0);
    }

    json parse(std::string_view text) {
        const std::string complaint = detail::checkJson(text, max_depth);
        if (complaint.empty()) return json::parse(text.begin(), text.end());
        fail("", "scene.json", "{}", complaint);
        return json::object();
    }

    static std::string join(const std::string& place, const char* key) {
        return place.empty() ? key : place + "." + key;
    }

    /// The value of a key, if the object has it and it is of the type.
    const json* optional(const json& object, const std::string& place, const char* key, json::value_t type) {
        if (!object.is_object())
            return fail(place, "scene.type", "an object is needed, not {}", nameOf(object)), nullptr;
        const auto found = object.find(key);
        if (found == object.end()) return nullptr;
        if (found->type() == type) return &*found;
        fail(join(place, key), "scene.type", "{} is needed, not {}", nameOf(json(type)), nameOf(*found));
        return nullptr;
    }
    const json* required(const json& object, const std::string& place, const char* key, json::value_t type) {
        const json* value = optional(object, place, key, type);
        if (!value) fail(place, "scene.missing", "'{}' is missing", key);
        return value;
    }

    void allow(const json& object, const std::string& place, std::initializer_list<std::string_view> keys) {
        if (!object.is_object()) return;
        for (const auto& [key, value] : object.items())
            if (std::find(keys.begin(), keys.end(), key) == keys.end())
                fail(place, "scene.key", "the key '{}' means nothing here", key);
    }

    static const char* nameOf(const json& value) {
        switch (value.type()) {
            case json::value_t::object: return "an object";
            case json::value_t::array: return "an array";
            case json::value_t::string: return "a text";
            case json::value_t::boolean: return "a boolean";
            case json::value_t::null: return "null";
            default: return "a number";
        }
    }

    bool count(const char* place, size_t elements, size_t most) {
        if (elements >= 1 && elements <= most) return true;
        fail(place, "scene.count", "there are {} elements; 1 to {} are taken", elements, most);
        return false;
    }

    void readFiles(const json& meshes) {
        for (const auto& [name, file] : meshes.items()) {
            const std::string place = "meshes." + name;
            if (!file.is_string()) return fail(place, "scene.type", "a text is needed, not {}", nameOf(file));
            const std::string& text = file.get_ref<const std::string&>();
            if (text.empty() || text.find('\0') != std::string::npos)
                return fail(place, "scene.value", "the text names no file");
            scene_.meshes.push_back({name, path_.parent_path() / text});
        }
    }

    void readInstances(const json& instances) {
        scene_.instances.reserve(instances.size());
        for (size_t i = 0; i < instances.size() && !error_; i++)
            readInstance(instances[i], fmt::format("instances[{}]", i));
    }

    void readInstance(const json& value, const std::string& place) {
        const json* name = required(value, place, "mesh", json::value_t::string);
        if (!name) return;
        allow(value, place, {"mesh", "transform", "translate", "rotate", "scale", "mask", "index"});
        MeshInstance instance;
        instance.mesh = findMesh(name->get_ref<const std::string&>(), place);
        instance.transform = readTransform(value, place);
        instance.mask = readInteger(value, place, "mask", 255).value_or(instance.mask);
        instance.index = readInteger(value, place, "index", MeshInstance::by_place - 1).value_or(instance.index);
        scene_.instances.push_back(instance);
    }

    uint32_t findMesh(const std::string& name, const std::string& place) {
        // The library's objects, and so the meshes, are sorted by their keys.
        const auto found =
            std::lower_bound(scene_.meshes.begin(), scene_.meshes.end(), name,
                             [](const MeshScene::File& file, const std::string& n) { return file.name < n; });
        if (found == scene_.meshes.end() || found->name != name) {
            fail(place + ".mesh", "scene.mesh", "there is no mesh '{}' among the {} of 'meshes'", name,
                 scene_.meshes.size());
            return 0;
        }
        return static_cast<uint32_t>(found - scene_.meshes.begin());
    }

    std::optional<uint32_t> readInteger(const json& object, const std::string& place, const char* key, uint32_t most) {
        const auto found = object.find(key);
        if (found == object.end()) return {};
        if (found->is_number_unsigned() && found->get<uint64_t>() <= most) return found->get<uint32_t>();
        if (found->is_number())
            fail(join(place, key), "scene.value", "{} is no whole number from 0 to {}", found->dump(), most);
        else
            fail(join(place, key), "scene.type", "a number is needed, not {}", nameOf(*found));
        return {};
    }

    double readNumber(const json& value, const std::string& place) {
        if (!value.is_number()) return fail(place, "scene.type", "a number is needed, not {}", nameOf(value)), 0.0;
        const double number = value.get<double>();
        if (!(std::abs(number) <= double{std::numeric_limits<float>::max()}))
            fail(place, "scene.value", "{} is beyond float32", number);
        return number;
    }

    template <size_t count>
    std::array<double, count> readNumbers(const json& value, const std::string& place) {
        std::array<double, count> numbers = {};
        if (!value.is_array()) return fail(place, "scene.type", "an array is needed, not {}", nameOf(value)), numbers;
        if (value.size() != count)
            return fail(place, "scene.count", "there are {} numbers, not {}", value.size(), count), numbers;
        for (size_t i = 0; i < count; i++) numbers[i] = readNumber(value[i], fmt::format("{}[{}]", place, i));
        return numbers;
    }

    Transform3x4 readTransform(const json& object, const std::string& place) {
        const json* rows = optional(object, place, "transform", json::value_t::array);
        Transform3x4 transform;
        if (rows) {
            for (const char* key : {"translate", "rotate", "scale"})
                if (object.contains(key)) fail(place, "scene.key", "'transform' and '{}' exclude each other", key);
            if (rows->size() != 3)
                return fail(place + ".transform", "scene.count", "there are {} rows, not 3", rows->size()), transform;
            for (size_t row = 0; row < 3; row++) {
                const auto numbers = readNumbers<4>((*rows)[row], fmt::format("{}.transform[{}]", place, row));
                for (size_t column = 0; column < 4; column++)
                    transform.rows[row * 4 + column] = static_cast<float>(numbers[column]);
            }
        } else {
            transform = readPlacement(object, place);
        }
        if (!error_ && !isInvertible(transform))
            fail(rows ? place + ".transform" : place, "scene.value",
                 "the transform makes a plane, a line or a point of the mesh");
        return transform;
    }

    /// translate, rotate and scale, in float64 until the end.
    Transform3x4 readPlacement(const json& object, const std::string& place) {
        std::array<double, 3> offset = {0, 0, 0}, factors = {1, 1, 1};
        Matrix4x4d turn(1.0);
        if (const auto found = object.find("translate"); found != object.end())
            offset = readNumbers<3>(*found, place + ".translate");
        if (const auto found = object.find("scale"); found != object.end()) {
            if (found->is_number())
                factors.fill(readNumber(*found, place + ".scale"));
            else
                factors = readNumbers<3>(*found, place + ".scale");
        }
        if (const auto found = object.find("rotate"); found != object.end())
            turn = rotation(readNumbers<4>(*found, place + ".rotate"), place + ".rotate");
        Transform3x4 transform;
        for (int row = 0; row < 3; row++) {
            for (int column = 0; column < 3; column++)
                transform.rows[row * 4 + column] = static_cast<float>(turn[column][row] * factors[column]);
            transform.rows[row * 4 + 3] = static_cast<float>(offset[row]);
        }
        return transform;
    }

    /// Rodrigues' formula.
    Matrix4x4d rotation(const std::array<double, 4>& numbers, const std::string& place) {
        const Vector3d axis(numbers[0], numbers[1], numbers[2]);
        const double length = glm::length(axis);
        if (!(length > 0.0)) return fail(place, "scene.value", "the axis has no direction"), Matrix4x4d(1.0);
        const Vector3d n = axis / length;
        const double angle = std::remainder(numbers[3], 360.0) * (3.14159265358979323846 / 180.0);
        const double s = std::sin(angle), c = std::cos(angle);
        Matrix4x4d matrix(1.0);
        for (int column = 0; column < 3; column++) {
            Vector3d e(0.0);
            e[column] = 1.0;
            const Vector3d turned = e * c + glm::cross(n, e) * s + n * (glm::dot(n, e) * (1.0 - c));
            matrix[column] = Vector4d(turned, 0.0);
        }
        return matrix;
    }

    const std::filesystem::path path_;
    MeshScene scene_;
    Error error_;
};

}  // namespace

bool isInvertible(const Transform3x4& transform) {
    std::array<Vector3d, 3> rows;
    for (size_t i = 0; i < 3; i++) {
        const float* row = &transform.rows[i * 4];
        if (!isFinite({row[0], row[1], row[2]}) || !std::isfinite(row[3])) return false;
        rows[i] = Vector3d(row[0], row[1], row[2]);
    }
    // Products of three float32 numbers round in float64, by 2^-53 each: a volume below that is none.
    const double volume = std::abs(glm::dot(rows[0], glm::cross(rows[1], rows[2])));
    if (!(volume > 0x1p-48 * glm::length(rows[0]) * glm::length(rows[1]) * glm::length(rows[2]))) return false;
    // The inverse has to be of float32 numbers, too.
    for (size_t i = 0; i < 3; i++) {
        const Vector3d column = glm::abs(glm::cross(rows[i], rows[(i + 1) % 3])) / volume;
        const double largest = std::max({column.x, column.y, column.z});
        if (!(largest <= double{std::numeric_limits<float>::max()})) return false;
    }
    return true;
}

Expected<MeshScene> parseMeshScene(std::string_view text, const std::filesystem::path& path) {
    return SceneReading(path).read(text);
}

Expected<MeshScene> MeshScene::load(const std::filesystem::path& path) {
    const Expected<std::string> text = readTextFile(path, max_bytes);
    if (!text) return unexpected(text.error());
    return parseMeshScene(*text, path);
}

Expected<std::vector<Mesh>> MeshScene::loadMeshes(uint64_t limit) const {
    std::vector<Mesh> loaded;
    loaded.reserve(meshes.size());
    for (const File& file : meshes) {
        Expected<Mesh> mesh = Mesh::load(file.path, limit);
        if (!mesh) {
            const Error& error = mesh.error();
            return unexpected(Error::inFile(error.code(), error.id().data(), error.message(), error.file(),
                                            error.line(), "meshes." + file.name));
        }
        const uint64_t bytes = mesh->positions.size() * (sizeof(Vector3f) * 2 + sizeof(Vector2f)) +
                               mesh->indices.size() * sizeof(uint32_t);
        limit -= std::min(limit, bytes);
        loaded.push_back(std::move(*mesh));
    }
    return loaded;
}

}  // namespace glint
