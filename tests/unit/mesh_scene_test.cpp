// Scenes of `glint cast`: what is read, and how anything else is refused.

#include "support/files.h"
#include "support/matchers.h"

#include <glint/base/file.h>
#include <glint/format/mesh_scene.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

namespace glint::test {

namespace {

const std::filesystem::path file = "scenes/room.json";

/// A scene of one instance, of a mesh that is there, with these keys beside it.
std::string withKeys(const std::string& keys) {
    return R"({"meshes": {"a": "a.obj"}, "instances": [{"mesh": "a", )" + keys + "}]}";
}

struct Case {
    std::string text;
    const char* id;
    const char* place;  ///< what the message has to name
};

void expectRefused(const Case& wrong) {
    const Expected<MeshScene> scene = parseMeshScene(wrong.text, file);
    EXPECT_THAT(scene, HasErrorId(wrong.id)) << wrong.text;
    if (scene) return;
    EXPECT_NE(scene.error().text().find(wrong.place), std::string::npos) << scene.error().text();
    EXPECT_EQ(scene.error().file(), file.string());
}

}  // namespace

TEST(MeshScene, IsRead) {
    const Expected<MeshScene> scene = parseMeshScene(R"({
        "meshes": {"torus": "models/torus.ply", "bunny": "/data/bunny.obj"},
        "instances": [
            {"mesh": "torus"},
            {"mesh": "bunny", "transform": [[1, 2, 3, 4], [0, -6, 7, 8], [0, 0, 11.5, 12]], "mask": 5},
            {"mesh": "bunny", "scale": [1, 2, -3], "rotate": [0, 0, 0.1, 90], "translate": [7, 8, 9], "index": 77},
            {"mesh": "bunny", "scale": 1e-4, "rotate": [1, 1, 1, 120], "index": 4294967294, "mask": 0}
        ]})",
                                                     file);
    ASSERT_THAT(scene, IsOk());
    ASSERT_EQ(scene->meshes.size(), 2u);
    EXPECT_EQ(scene->meshes[0].name, "bunny");
    EXPECT_EQ(scene->meshes[0].path, "/data/bunny.obj");
    EXPECT_EQ(scene->meshes[1].path, "scenes/models/torus.ply");
    ASSERT_EQ(scene->instances.size(), 4u);
    EXPECT_EQ(scene->instances[0], (MeshInstance{.mesh = 1, .transform = {}}));
    const std::array<float, 12> rows = {1, 2, 3, 4, 0, -6, 7, 8, 0, 0, 11.5, 12};
    EXPECT_EQ(scene->instances[1].transform.rows, rows);
    EXPECT_EQ(scene->instances[1].mask, 5u);
    EXPECT_EQ(scene->instances[1].mesh, 0u);
    EXPECT_EQ(scene->instances[2].index, 77u);
    EXPECT_EQ(scene->instances[3].index, 4294967294u);
    EXPECT_EQ(scene->instances[3].mask, 0u);
    // X goes to Y, and Y to -X; cos(90 degrees) is 0 within float64's rounding of pi / 2. The last one goes round.
    const std::array<float, 12> turned = {0, -2, 0, 7, 1, 0, 0, 8, 0, 0, -3, 9};
    const std::array<float, 12> round = {0, 0, 1e-4f, 0, 1e-4f, 0, 0, 0, 0, 1e-4f, 0, 0};
    for (size_t i = 0; i < 12; i++) {
        EXPECT_NEAR(scene->instances[2].transform.rows[i], turned[i], 1e-15) << i;
        EXPECT_NEAR(scene->instances[3].transform.rows[i], round[i], 1e-11) << i;
    }
}

TEST(MeshScene, MalformedOnesAreRefused) {
    const std::string mesh = R"("meshes": {"a": "a.obj"})";
    const std::vector<Case> cases = {
        {"", "scene.json", "byte 1"},
        {"{", "scene.json", "byte 2"},
        {"{} x", "scene.json", "byte"},
        {"\xff", "scene.json", "byte"},
        {R"({"meshes": {"a": "\ud800"}})", "scene.json", "byte"},
        {"{" + mesh + R"(, "instances": [{"mesh": "a", "scale": 1e999}]})", "scene.json", "no JSON"},
        {"{" + mesh + ", " + mesh + "}", "scene.json", "'meshes'"},
        {R"({"meshes": {"a": "a.obj", "a": "b.obj"}, "instances": [{"mesh": "a"}]})", "scene.json", "'a'"},
        {std::string(100000, '['), "scene.json", "nested"},
        {"[]", "scene.type", "an object is needed, not an array"},
        {"3", "scene.type", "not a number"},
        {"null", "scene.type", "not null"},
        {"{}", "scene.missing", "'meshes'"},
        {"{" + mesh + "}", "scene.missing", "'instances'"},
        {R"({"instances": [{"mesh": "a"}]})", "scene.missing", "'meshes'"},
        {"{" + mesh + R"(, "instances": [{"mesh": "a"}], "camera": 1})", "scene.key", "'camera'"},
        {R"({"meshes": ["a.obj"], "instances": [{"mesh": "a"}]})", "scene.type", "meshes: an object"},
        {R"({"meshes": {}, "instances": [{"mesh": "a"}]})", "scene.count", "meshes: there are 0"},
        {R"({"meshes": {"a": 5}, "instances": [{"mesh": "a"}]})", "scene.type", "meshes.a: "},
        {R"({"meshes": {"a": ""}, "instances": [{"mesh": "a"}]})", "scene.value", "meshes.a: "},
        {R"({"meshes": {"a": "b\u0000c"}, "instances": [{"mesh": "a"}]})", "scene.value", "meshes.a: "},
        {"{" + mesh + R"(, "instances": {"mesh": "a"}})", "scene.type", "instances: an array"},
        {"{" + mesh + R"(, "instances": []})", "scene.count", "instances: there are 0"},
        {"{" + mesh + R"(, "instances": ["a"]})", "scene.type", "instances[0]: an object"},
        {"{" + mesh + R"(, "instances": [{"mesh": "a"}, {}]})", "scene.missing", "instances[1]: 'mesh'"},
        {"{" + mesh + R"(, "instances": [{"mesh": 0}]})", "scene.type", "instances[0].mesh"},
        {"{" + mesh + R"(, "instances": [{"mesh": "b"}]})", "scene.mesh", "instances[0].mesh: there is no mesh 'b'"},
        {withKeys(R"("colour": 1)"), "scene.key", "instances[0]: the key 'colour'"},
        {withKeys(R"("mask": 256)"), "scene.value", "instances[0].mask"},
        {withKeys(R"("mask": -1)"), "scene.value", "instances[0].mask"},
        {withKeys(R"("mask": 1.5)"), "scene.value", "instances[0].mask"},
        {withKeys(R"("mask": "all")"), "scene.type", "instances[0].mask"},
        {withKeys(R"("index": 4294967295)"), "scene.value", "4294967294"},
        {withKeys(R"("index": 99999999999999999999)"), "scene.value", "instances[0].index"},
        {withKeys(R"("index": null)"), "scene.type", "instances[0].index"},
        {withKeys(R"("transform": 1)"), "scene.type", "instances[0].transform"},
        {withKeys(R"("transform": [1,0,0,0, 0,1,0,0, 0,0,1,0])"), "scene.count", "there are 12 rows, not 3"},
        {withKeys(R"("transform": [[1,0,0,0], [0,1,0,0], 5])"), "scene.type", "instances[0].transform[2]: an array"},
        {withKeys(R"("transform": [[1,0,0,0], [0,1,0], [0,0,1,0]])"), "scene.count", "instances[0].transform[1]: "},
        {withKeys(R"("transform": [[1,0,0,0], [0,1,0,"x"], [0,0,1,0]])"), "scene.type", "instances[0].transform[1][3]"},
        {withKeys(R"("transform": [[1,0,0,1e39], [0,1,0,0], [0,0,1,0]])"), "scene.value", "transform[0][3]: 1e+39"},
        {withKeys(R"("transform": [[1,0,0,0], [0,0,0,0], [0,0,1,0]])"), "scene.value", "instances[0].transform: "},
        {withKeys(R"("transform": [[0.1,0.2,0,0], [0.3,0.6,0,0], [0,0,1,0]])"), "scene.value", "a plane"},
        {withKeys(R"("transform": [[1,0,0,0], [0,1,0,0], [0,0,1,0]], "scale": 2)"), "scene.key", "'scale'"},
        {withKeys(R"("transform": [[1,0,0,0], [0,1,0,0], [0,0,1,0]], "translate": [0, 0, 0])"), "scene.key",
         "'translate'"},
        {withKeys(R"("translate": 3)"), "scene.type", "instances[0].translate"},
        {withKeys(R"("translate": [1, 2])"), "scene.count", "there are 2 numbers, not 3"},
        {withKeys(R"("translate": [1, 2, true])"), "scene.type", "instances[0].translate[2]"},
        {withKeys(R"("translate": [1, 2, -1e300])"), "scene.value", "instances[0].translate[2]"},
        {withKeys(R"("scale": 0)"), "scene.value", "instances[0]: the transform"},
        {withKeys(R"("scale": [1, 1, 0])"), "scene.value", "instances[0]: the transform"},
        {withKeys(R"("scale": "2")"), "scene.type", "instances[0].scale"},
        {withKeys(R"("scale": 1e-60)"), "scene.value", "instances[0]: the transform"},
        {withKeys(R"("rotate": [0, 0, 90])"), "scene.count", "there are 3 numbers, not 4"},
        {withKeys(R"("rotate": [0, 0, 0, 90])"), "scene.value", "instances[0].rotate: the axis"},
        {withKeys(R"("rotate": {"z": 90})"), "scene.type", "instances[0].rotate"},
    };
    for (const Case& wrong : cases) expectRefused(wrong);
}

// Cut anywhere, or with any byte replaced, a scene is an error or a scene; nothing else happens.
TEST(MeshScene, DamagedOnes) {
    const std::string text = withKeys(R"("scale": [1, 2.5e0, -3], "rotate": [0, 0, 1, 90], "index": 7)");
    ASSERT_THAT(parseMeshScene(text, file), IsOk());
    for (size_t i = 0; i < text.size(); i++) {
        EXPECT_FALSE(parseMeshScene(text.substr(0, i), file)) << i;
        for (const char c : {'"', '{', ']', '0', '-', '\0', '\xe2'}) {
            std::string damaged = text;
            damaged[i] = c;
            const Expected<MeshScene> scene = parseMeshScene(damaged, file);
            EXPECT_TRUE(scene || scene.error().id().starts_with("scene.")) << damaged;
        }
    }
}

TEST(MeshScene, CountsHaveLimits) {
    std::string text = R"({"meshes": {"a": "a.obj"}, "instances": [)";
    const std::string instance = R"({"mesh":"a"},)";
    text.reserve(text.size() + (MeshScene::max_instances + 2) * instance.size());
    for (size_t i = 0; i < MeshScene::max_instances; i++) text += instance;
    expectRefused({text + instance.substr(0, instance.size() - 1) + "]}", "scene.count", "1048577 elements"});
}

TEST(MeshScene, MeshesAreLoadedFromItsFolder) {
    const TempDir dir;
    std::filesystem::create_directory(dir / "sub");
    ASSERT_THAT(writeTextFile(dir / "sub" / "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), IsOk());
    ASSERT_THAT(writeTextFile(dir / "bad.obj", "v 0 0 x\n"), IsOk());
    const auto load = [&](const std::string& path) {
        EXPECT_THAT(writeTextFile(dir / "scene.json", fmt::format(R"({{"meshes": {{"a": "{0}", "b": "{0}"}},
                                                                      "instances": [{{"mesh": "b"}}]}})",
                                                                  path)),
                    IsOk());
        const Expected<MeshScene> scene = MeshScene::load(dir / "scene.json");
        EXPECT_THAT(scene, IsOk());
        return scene->loadMeshes(1000);
    };
    const Expected<std::vector<Mesh>> meshes = load("sub/a.obj");
    ASSERT_THAT(meshes, IsOk());
    ASSERT_EQ(meshes->size(), 2u);
    EXPECT_EQ((*meshes)[1].positions.size(), 3u);
    EXPECT_THAT(load("absent.obj"), HasErrorId("file.open"));
    const Expected<std::vector<Mesh>> bad = load("bad.obj");
    EXPECT_THAT(bad, HasErrorId("mesh.syntax"));
    EXPECT_NE(bad.error().text().find("meshes.a"), std::string::npos) << bad.error().text();
    EXPECT_THAT(load("a.txt"), HasErrorId("mesh.unknown_extension"));
    EXPECT_THAT(MeshScene::load(dir / "absent.json"), HasErrorId("file.open"));
    // The limit is that of all together: the second mesh has what the first leaves.
    EXPECT_THAT(MeshScene::load(dir / "scene.json")->loadMeshes(20), testing::Not(IsOk()));
}

TEST(MeshScene, TransformsThatCanBeInverted) {
    const auto check = [](const std::array<float, 9>& m) {
        Transform3x4 transform;
        for (size_t i = 0; i < 9; i++) transform.rows[i / 3 * 4 + i % 3] = m[i];
        return isInvertible(transform);
    };
    EXPECT_TRUE(check({1, 0, 0, 0, 1, 0, 0, 0, 1}));
    EXPECT_TRUE(check({1e-4f, 0, 0, 0, 1e4f, 0, 0, 0, -1}));
    EXPECT_TRUE(check({1e-12f, 0, 0, 0, 1e-12f, 0, 0, 0, 1e-12f}));
    EXPECT_TRUE(check({1, 1, 0, 1, 1.000001f, 0, 0, 0, 1}));
    EXPECT_TRUE(check({1e-30f, 0, 0, 0, 1e-30f, 0, 0, 0, 1e-30f}));
    EXPECT_FALSE(check({1e-39f, 0, 0, 0, 1, 0, 0, 0, 1}));
    EXPECT_FALSE(check({1, 2, 3, 2, 4, 6, 0, 0, 1}));
    EXPECT_FALSE(check({0.1f, 0.7f, 0.3f, 0.2f, 1.4f, 0.6f, 0, 0, 1}));
    EXPECT_FALSE(check({1, 0, 0, 0, 0, 0, 0, 0, 1}));
    EXPECT_FALSE(check({std::numeric_limits<float>::quiet_NaN(), 0, 0, 0, 1, 0, 0, 0, 1}));
    EXPECT_FALSE(check({1, 0, 0, 0, std::numeric_limits<float>::infinity(), 0, 0, 0, 1}));
}

}  // namespace glint::test
