#include "support/files.h"
#include "support/matchers.h"
#include "support/reference.h"

#include <glint/base/file.h>
#include <glint/format/cameras.h>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cmath>

using namespace glint;
using namespace glint::test;

namespace {

const std::string camera_text =
    R"({"id": 0, "img_name": "00001", "width": 1959, "height": 1090, "position": [1, 2, 3],
        "rotation": [[1, 0, 0], [0, 0, 1], [0, -1, 0]], "fy": 1161.2, "fx": 1159.5})";

std::string replaced(std::string text, std::string_view what, std::string_view with) {
    const size_t at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    return at == std::string::npos ? text : text.replace(at, what.size(), with);
}

Expected<std::vector<PictureCamera>> parse(const std::string& list) { return parseCameras(list, "cameras.json"); }

}  // namespace

TEST(Cameras, OfTheProgram) {
    const auto cameras = parse("[" + camera_text + "]");
    ASSERT_THAT(cameras, IsOk());
    ASSERT_EQ(cameras->size(), 1u);
    const PictureCamera& camera = cameras->front();
    EXPECT_EQ(camera.width, 1959u);
    EXPECT_EQ(camera.height, 1090u);
    EXPECT_EQ(camera.name, "00001");
    EXPECT_EQ(camera.camera.position(), Vector3f(1, 2, 3));
    // The columns: right is x, down is -z, forward is y.
    EXPECT_LE(glm::length(camera.camera.right() - Vector3f(1, 0, 0)), 5e-7f);
    EXPECT_LE(glm::length(camera.camera.up() - Vector3f(0, 0, 1)), 5e-7f);
    EXPECT_LE(glm::length(camera.camera.forward() - Vector3f(0, 1, 0)), 5e-7f);
    EXPECT_EQ(parse("[]")->size(), 0u);
}

// A point comes to the pixel where the focal lengths put it: f x / z from the centre of the picture.
TEST(Cameras, ProjectAsTheFileSays) {
    Random random(1);
    for (int run = 0; run < 200; run++) {
        const Vector3d forward = random.direction();
        const Vector3d right = glm::normalize(glm::cross(forward, random.direction()));
        const Vector3d down = glm::cross(forward, right);
        const double far = std::exp(random.uniform(-3.0, 12.0));
        const Vector3d from = random.direction() * far;
        const double fx = random.uniform(100, 3000), fy = fx * random.uniform(0.9, 1.1);
        const auto width = 1 + random.below(4000), height = 1 + random.below(3000);
        const auto cameras = parse(fmt::format(
            R"([{{"position": [{}, {}, {}], "rotation": [[{}, {}, {}], [{}, {}, {}], [{}, {}, {}]],
                "fx": {}, "fy": {}, "width": {}, "height": {}}}])",
            from.x, from.y, from.z, right.x, down.x, forward.x, right.y, down.y, forward.y, right.z, down.z, forward.z,
            fx, fy, width, height));
        ASSERT_THAT(cameras, IsOk());
        const CameraParameters p = cameras->front().camera.parameters();
        const auto axisError = [](const Vector4f& column, const Vector3d& axis) {
            return glm::length(Vector3d(column) - axis);
        };
        EXPECT_LE(axisError(p.inverse_view[0], right), 5e-7);
        EXPECT_LE(axisError(p.inverse_view[1], -down), 5e-7);
        EXPECT_LE(axisError(p.inverse_view[2], -forward), 5e-7);
        EXPECT_NEAR(p.projection[0][0] * static_cast<double>(width) / 2.0 / fx, 1.0, 1e-6);
        EXPECT_NEAR(p.projection[1][1] * static_cast<double>(height) / 2.0 / fy, 1.0, 1e-6);
        EXPECT_EQ(cameras->front().name, "");
    }
}

TEST(Cameras, Malformed) {
    const auto expectError = [](const std::string& list, const char* id, const char* text = "") {
        const auto cameras = parse(list);
        EXPECT_THAT(cameras, HasErrorId(id)) << list;
        if (cameras) return;
        EXPECT_NE(cameras.error().text().find(text), std::string::npos) << cameras.error().text();
        EXPECT_EQ(cameras.error().file(), "cameras.json");
    };
    expectError("", "cameras.json");
    expectError("{}", "cameras.json");
    expectError("[1, 2", "cameras.json");
    expectError(std::string(1'000'000, '['), "cameras.json", "8 deep");
    expectError("[1]", "cameras.key", "camera 0");
    expectError("[{}]", "cameras.key", "position");
    const auto change = [&](const char* what, const char* with, const char* id, const char* text) {
        expectError("[" + camera_text + ", " + replaced(camera_text, what, with) + "]", id, text);
    };
    change("\"fx\"", "\"fz\"", "cameras.key", "camera 1: 'fx' is missing");
    change("\"fx\"", "\"fy\"", "cameras.json", "twice");
    change("1959,", "\"1959\",", "cameras.key", "width");
    change("1959,", "0,", "cameras.value", "width");
    change("1959,", "19.5,", "cameras.value", "width");
    change("1959,", "65537,", "cameras.value", "width");
    change("1090,", "-4,", "cameras.value", "height");
    change("[1, 2, 3]", "[1, 2]", "cameras.key", "position");
    change("[1, 2, 3]", "[1, 2, 1e39]", "cameras.value", "position");
    change("[1, 2, 3]", "[1, 3e38, 3e38]", "cameras.value", "too far");
    change("[1, 2, 3]", "[1, 2, null]", "cameras.key", "position");
    change("[0, -1, 0]]", "[0, -1, 0], [0, 0, 0]]", "cameras.key", "rotation");
    change("[0, -1, 0]]", "0]", "cameras.key", "rotation");
    change("[0, -1, 0]]", "[0, 1, 0]]", "cameras.rotation", "axes");
    change("[0, -1, 0]]", "[0, -1, 0.1]]", "cameras.rotation", "axes");
    change("[0, -1, 0]]", "[0, -1.1, 0]]", "cameras.rotation", "axes");
    change("[1, 0, 0]", "[0, 0, 0]", "cameras.rotation", "axes");
    change("1161.2", "0", "cameras.value", "field of view");
    change("1161.2", "-1161.2", "cameras.value", "field of view");
    change("1159.5", "1e-30", "cameras.value", "field of view");
    change("1159.5", "1e30", "cameras.value", "field of view");
    change("\"00001\"", "1", "cameras.key", "img_name");
}

TEST(Cameras, FromFile) {
    const TempDir dir;
    ASSERT_THAT(writeTextFile(dir / "cameras.json", "[" + camera_text + "]"), IsOk());
    EXPECT_EQ(loadCameras(dir / "cameras.json")->size(), 1u);
    EXPECT_THAT(loadCameras(dir / "absent.json"), HasErrorId("file.open"));
}
