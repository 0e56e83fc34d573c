// Formats that `glint mesh` reads through assimp, on the files of Debian's package assimp-testmodels.

#include "tools/import_mesh.h"

#include "support/files.h"
#include "support/matchers.h"
#include "support/reference.h"

#include <glint/base/file.h>
#include <glint/format/scene.h>
#include <glint/geometry/mesh_optimize.h>
#include <glint/geometry/surface_distance.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <csignal>
#include <future>
#include <map>
#include <thread>

using namespace glint;
using namespace glint::test;
using tool::importMesh;

namespace {

struct Known {
    const char* file;
    uint64_t triangles;
    uint64_t components;
    bool closed;
};

/// A cube between any two corners has 12 triangles, 18 edges and is closed.
constexpr Known known[] = {
    {"FBX/box.fbx", 12, 1, true},        {"FBX/boxWithCompressedCTypeArray.FBX", 12, 1, true},
    {"FBX/phong_cube.fbx", 12, 1, true}, {"Collada/cube_triangulate.dae", 12, 1, true},
    {"STL/triangle.stl", 1, 1, false},   {"OFF/Cube.off", 12, 1, true},
    {"BLEND/box.blend", 12, 1, true},    {"LWO/LWO2/boxuv.lwo", 12, 1, true},
    {"SMD/triangle.smd", 1, 1, false},
};

}  // namespace

TEST(Import, KnownShapes) {
    GLINT_NEED_ASSIMP_MODELS();
    for (const Known& k : known) {
        SCOPED_TRACE(k.file);
        const Expected<Mesh> mesh = importMesh(assimpModelPath(k.file));
        if (errorOf(mesh).id() == "tool.library") GTEST_SKIP() << mesh.error().text();
        ASSERT_THAT(mesh, IsOk());
        const MeshStatistics s = statistics(*mesh);
        EXPECT_EQ(s.triangles, k.triangles);
        EXPECT_EQ(s.components, k.components);
        EXPECT_EQ(s.isClosed(), k.closed);
        if (k.closed) { EXPECT_GT(s.volume, 0.0) << "front faces are counter-clockwise"; }
    }
}

// One shape in many formats, and one format written in two ways.
TEST(Import, FormatsAgree) {
    GLINT_NEED_ASSIMP_MODELS();
    const auto load = [](const char* name) { return importMesh(assimpModelPath(name)); };
    const Expected<Mesh> text = load("STL/Spider_ascii.stl"), binary = load("STL/Spider_binary.stl");
    if (errorOf(text).id() == "tool.library") GTEST_SKIP() << text.error().text();
    ASSERT_THAT(text, IsOk());
    ASSERT_THAT(binary, IsOk());
    EXPECT_EQ(text->triangleCount(), binary->triangleCount());
    // A text has six digits of coordinates of up to 100.
    EXPECT_LE(hausdorffDistance(*text, *binary).upper, 1e-3);
    const Expected<Mesh> duck = load("Collada/duck.dae"), same = load("Collada/duck_triangulate.dae");
    ASSERT_THAT(duck, IsOk());
    ASSERT_THAT(same, IsOk());
    EXPECT_EQ(duck->triangleCount(), 4212u);
    // The same of coordinates of up to 180, which were written twice.
    EXPECT_LE(hausdorffDistance(*duck, *same).upper, 0.02);
}

// Whatever is there: a mesh or an error with a reason, never anything else.
TEST(Import, EveryFileIsReadOrRefused) {
    GLINT_NEED_ASSIMP_MODELS();
    std::map<std::string, std::array<int, 2>> counts;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(assimpModelPath("."))) {
        std::string kind = entry.path().extension().string();
        for (char& c : kind) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        const auto& known_kinds = tool::import_extensions;
        if (!entry.is_regular_file() ||
            std::find(std::begin(known_kinds), std::end(known_kinds), kind) == std::end(known_kinds))
            continue;
        if (entry.file_size() > 400'000) continue;  // for the time
        const Expected<Mesh> mesh = importMesh(entry.path(), 1 << 26);
        if (errorOf(mesh).id() == "tool.library") GTEST_SKIP() << mesh.error().text();
        counts[kind][static_cast<bool>(mesh)]++;
        if (mesh) {
            EXPECT_THAT(mesh->validate(), IsOk()) << entry.path();
        } else {
            EXPECT_TRUE(mesh.error().id().starts_with("mesh.") || mesh.error().id() == "tool.import")
                << mesh.error().text();
            EXPECT_EQ(mesh.error().file(), entry.path().filename().string());
        }
    }
    for (const auto& [kind, count] : counts) {
        RecordProperty(kind.substr(1), count[1]);
        std::printf("%s: %d read, %d refused\n", kind.c_str(), count[1], count[0]);
        EXPECT_GT(count[1], 0) << kind;
    }
    EXPECT_EQ(counts.size(), std::size(tool::import_extensions));
}

TEST(Import, Errors) {
    const TempDir dir;
    ASSERT_THAT(writeTextFile(dir / "a.fbx", "nothing of that kind"), IsOk());
    const Expected<Mesh> broken = importMesh(dir / "a.fbx");
    if (errorOf(broken).id() == "tool.library") GTEST_SKIP() << broken.error().text();
    EXPECT_THAT(broken, HasErrorId("tool.import"));
    EXPECT_THAT(importMesh(dir / "b.fbx"), HasErrorId("file.open"));
    EXPECT_THAT(importMesh(dir / "a.fbx", 5), HasErrorId("file.too_large"));
    EXPECT_THAT(importMesh(dir / "a.usdz"), HasErrorId("mesh.unknown_extension"));
    GLINT_NEED_ASSIMP_MODELS();
    // It says that it has more elements than any memory could hold: assimp ends there, and the program does not.
    EXPECT_THAT(importMesh(assimpModelPath("invalid/OutOfMemory.off")), HasErrorId("tool.import"));
    const std::filesystem::path duck = assimpModelPath("Collada/duck.dae");
    EXPECT_THAT(importMesh(duck, std::filesystem::file_size(duck)), IsOk());
    EXPECT_THAT(importMesh(assimpModelPath("STL/Spider_binary.stl"), 90'000), HasErrorId("mesh.too_large"));
}

// A copy of a process has one thread, and what others had locked stays locked in it.
TEST(Import, NotWithSeveralThreads) {
    GLINT_NEED_ASSIMP_MODELS();
    std::promise<void> end;
    std::thread other([&] { end.get_future().wait(); });
    const Expected<Mesh> mesh = importMesh(assimpModelPath("STL/triangle.stl"));
    end.set_value();
    other.join();
    if (errorOf(mesh).id() == "tool.library") GTEST_SKIP() << mesh.error().text();
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "sanitizers may have threads of their own: theirs are not counted";
#endif
    EXPECT_THAT(mesh, HasErrorId("tool.threads"));
}

// A program that was started with SIGCHLD ignored learns nothing of its children unless it takes that back.
TEST(Import, WhateverTheParentIgnores) {
    GLINT_NEED_ASSIMP_MODELS();
    std::signal(SIGCHLD, SIG_IGN);
    const Expected<Mesh> mesh = importMesh(assimpModelPath("STL/triangle.stl"));
    if (errorOf(mesh).id() == "tool.library") GTEST_SKIP() << mesh.error().text();
    EXPECT_THAT(mesh, IsOk());
}

// The SDK says where to go.
TEST(Import, NotByTheSdk) {
    const Expected<Mesh> mesh = Mesh::load("a.stl");
    EXPECT_THAT(mesh, HasErrorId("mesh.unknown_extension"));
    EXPECT_NE(mesh.error().text().find("glint mesh convert"), std::string::npos) << mesh.error().text();
}

// glTF is read by the SDK itself: skins and animations of others' files.
TEST(Import, AnimatedGltf) {
    GLINT_NEED_ASSIMP_MODELS();
    for (const char* name : {"glTF2/simple_skin/simple_skin.gltf",
                             "glTF2/glTF-Sample-Models/AnimatedMorphCube-glTF/AnimatedMorphCube.gltf"}) {
        SCOPED_TRACE(name);
        const Expected<Scene> scene = Scene::load(assimpModelPath(name));
        ASSERT_THAT(scene, IsOk());
        ASSERT_FALSE(scene->animations.empty());
        const float duration = scene->animations[0].duration();
        EXPECT_GT(duration, 0.5f);
        const Expected<Mesh> begin = scene->mesh(scene->pose(0, 0.0f)),
                             later = scene->mesh(scene->pose(0, duration / 4));
        ASSERT_THAT(begin, IsOk());
        ASSERT_THAT(later, IsOk());
        EXPECT_EQ(begin->indices, later->indices);
        EXPECT_NE(begin->positions, later->positions) << "it moves";
    }
}
