#include <glint/format/cameras.h>

#include <glint/base/file.h>
#include <glint/base/format_error.h>
#include <glint/format/detail/json_text.h>

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace glint {

namespace {

using nlohmann::json;

constexpr size_t max_depth = 8;
constexpr uint32_t max_size = 65536;
constexpr uint64_t max_bytes = 64ull << 20;

/// Reads one camera; the first thing that is wrong with it is kept, and what follows it is read as nothing.
class CameraReading {
public:
    CameraReading(const json& object, size_t index, const std::string& name)
        : object_(object), index_(index), name_(name) {}

    Expected<PictureCamera> read() {
        PictureCamera result;
        const auto position = readNumbers<3>(value("position"), "position");
        std::array<std::array<double, 3>, 3> rows = {};
        if (const json* rotation = value("rotation"); rotation && rotation->is_array() && rotation->size() == 3)
            for (size_t i = 0; i < 3; i++) rows[i] = readNumbers<3>(&(*rotation)[i], "rotation");
        else
            fail("cameras.key", "'rotation' is needed, three rows of three numbers");
        const double focal_x = readNumber(value("fx"), "fx");
        const double focal_y = readNumber(value("fy"), "fy");
        result.width = readSize("width");
        result.height = readSize("height");
        if (const auto found = object_.find("img_name"); object_.is_object() && found != object_.end()) {
            if (found->is_string())
                result.name = found->get<std::string>();
            else
                fail("cameras.key", "'img_name' is no text");
        }
        if (!error_) place(result.camera, position, rows);
        if (!error_) open(result.camera, result.width / (2.0 * focal_x), result.height / (2.0 * focal_y));
        if (error_) return unexpected(error_);
        return result;
    }

private:
    template <class... Args>
    void fail(const char* id, fmt::format_string<Args...> format, Args&&... args) {
        if (error_) return;
        const std::string text = fmt::format(format, std::forward<Args>(args)...);
        error_ = Error::inFile(ErrorCode::InvalidArgument, id, fmt::format("camera {}: {}", index_, text), name_, 0);
    }

    const json* value(const char* key) {
        if (!object_.is_object()) return fail("cameras.key", "an object is needed"), nullptr;
        const auto found = object_.find(key);
        if (found == object_.end()) return fail("cameras.key", "'{}' is missing", key), nullptr;
        return &*found;
    }

    double readNumber(const json* value, const char* key) {
        if (!value) return 0.0;
        if (!value->is_number()) return fail("cameras.key", "'{}' has no number where one is needed", key), 0.0;
        const auto number = value->get<double>();
        if (!(std::abs(number) <= double{std::numeric_limits<float>::max()}))
            fail("cameras.value", "'{}' has {}, which is beyond float32", key, number);
        return number;
    }

    template <size_t count>
    std::array<double, count> readNumbers(const json* value, const char* key) {
        std::array<double, count> numbers = {};
        if (!value) return numbers;
        if (!value->is_array() || value->size() != count)
            return fail("cameras.key", "'{}' has no list of {} numbers where one is needed", key, count), numbers;
        for (size_t i = 0; i < count; i++) numbers[i] = readNumber(&(*value)[i], key);
        return numbers;
    }

    uint32_t readSize(const char* key) {
        const double number = readNumber(value(key), key);
        if (number >= 1.0 && number <= max_size && number == std::trunc(number)) return static_cast<uint32_t>(number);
        fail("cameras.value", "'{}' is {}, and not a whole number from 1 to {}", key, number, max_size);
        return 1;
    }

    void place(Camera& camera, const std::array<double, 3>& position,
               const std::array<std::array<double, 3>, 3>& rows) {
        const auto column = [&rows](size_t k) { return Vector3d(rows[0][k], rows[1][k], rows[2][k]); };
        const Vector3d right = column(0), down = column(1), forward = column(2);
        constexpr double tolerance = 1e-3;
        const auto isUnit = [](const Vector3d& v) { return std::abs(glm::dot(v, v) - 1.0) <= 2.0 * tolerance; };
        const Vector3d difference = glm::cross(right, down) - forward;
        if (!isUnit(right) || !isUnit(down) || !isUnit(forward) ||
            !(glm::dot(difference, difference) <= tolerance * tolerance))
            return fail("cameras.rotation", "the columns of 'rotation' are not three axes at right angles, of length 1 "
                                            "and right-handed");
        // A point to look at as far away as the origin: its rounding turns the camera by no more than 2^-22.
        const Vector3f from(static_cast<float>(position[0]), static_cast<float>(position[1]),
                            static_cast<float>(position[2]));
        const Vector3d origin(from);
        const Vector3f to(origin + forward * std::max(1.0, glm::length(origin)));
        if (!isFinite(to)) return fail("cameras.value", "'position' is too far away");
        camera.lookAt(from, to, Vector3f(-down));
    }

    void open(Camera& camera, double tangent_x, double tangent_y) {
        const double fov = std::atan(tangent_y) * (360.0 / 3.14159265358979323846);
        const double fov_x = std::atan(tangent_x) * (360.0 / 3.14159265358979323846);
        const double aspect = tangent_x / tangent_y;
        const auto isInRange = [](double angle) { return angle >= 0.01 && angle <= 179.0; };
        if (!isInRange(fov) || !isInRange(fov_x) || !(aspect >= 1e-4 && aspect <= 1e4))
            return fail("cameras.value", "the focal lengths make a field of view of {} by {} degrees", fov_x, fov);
        camera.perspective(static_cast<float>(fov), static_cast<float>(aspect));
    }

    const json& object_;
    const size_t index_;
    const std::string& name_;
    Error error_;
};

}  // namespace

Expected<std::vector<PictureCamera>> parseCameras(std::string_view text, const std::string& name) {
    const auto fail = [&name](std::string complaint) {
        return unexpected(Error::inFile(ErrorCode::InvalidArgument, "cameras.json", std::move(complaint), name, 0));
    };
    if (std::string complaint = detail::checkJson(text, max_depth); !complaint.empty()) return fail(complaint);
    const json document = json::parse(text.begin(), text.end());
    if (!document.is_array()) return fail("the text is no list of cameras");
    std::vector<PictureCamera> cameras;
    for (size_t i = 0; i < document.size(); i++) {
        Expected<PictureCamera> camera = CameraReading(document[i], i, name).read();
        if (!camera) return unexpected(camera.error());
        cameras.push_back(std::move(*camera));
    }
    return cameras;
}

Expected<std::vector<PictureCamera>> loadCameras(const std::filesystem::path& path) {
    const Expected<std::string> text = readTextFile(path, max_bytes);
    if (!text) return unexpected(text.error());
    return parseCameras(*text, path.filename().string());
}

}  // namespace glint
