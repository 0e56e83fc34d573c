// `glint mesh`, run as a program.

#include "tool_test.h"

#include "support/reference.h"

#include <glint/format/mesh_graph.h>
#include <glint/geometry/primitives.h>
#include <glint/geometry/surface_distance.h>

#include <nlohmann/json.hpp>

using namespace glint;
using namespace glint::test;

namespace {

class MeshTool : public Tool {
protected:
    void SetUp() override { ASSERT_THAT(torus.save(dir / "torus.ply"), IsOk()); }

    nlohmann::json info(const std::string& arguments) {
        return nlohmann::json::parse(expectSuccess("mesh info " + arguments + " --json").output, nullptr, false);
    }

    const Mesh torus = createTorus(2.0f, 0.7f, 60, 40);
};

}  // namespace

TEST_F(MeshTool, Info) {
    const nlohmann::json json = info("torus.ply --against torus.ply");
    EXPECT_EQ(json["triangles"], 4800);
    EXPECT_EQ(json["vertices"], 2400);
    EXPECT_EQ(json["closed"], true);
    EXPECT_EQ(json["components"], 1);
    EXPECT_EQ(json["normals"], true);
    EXPECT_NEAR(json["volume"], volumeOf(torus), 1e-4);
    EXPECT_LT(json["distance"]["most"], 1e-5);
    EXPECT_NE(expectSuccess("mesh info torus.ply").output.find("open edges            0"), std::string::npos);
}

TEST_F(MeshTool, ConvertRefineOptimize) {
    expectSuccess("mesh convert torus.ply a.ply --positions --normals");
    EXPECT_EQ(Mesh::load(dir / "a.ply")->normals.size(), 2400u);
    expectSuccess("mesh refine torus.ply b.ply --steps 1 --loop --limit");
    EXPECT_EQ(Mesh::load(dir / "b.ply")->triangleCount(), 4 * 4800u);
    expectSuccess("mesh refine torus.ply b.ply --steps 1");
    EXPECT_EQ(Mesh::load(dir / "b.ply")->triangleCount(), 6 * 4800u);
    expectSuccess("mesh optimize torus.ply c.ply --ratio 0.25");
    EXPECT_NEAR(Mesh::load(dir / "c.ply")->triangleCount(), 1200, 4);
    expectSuccess("mesh optimize torus.ply d.ply --error 0.02");
    const Mesh simple = *Mesh::load(dir / "d.ply");
    EXPECT_LT(simple.triangleCount(), 3000u);
    // The writer rounds nothing; what the program has bounded holds for the file.
    EXPECT_LE(hausdorffDistance(simple, torus).lower, 0.02);
}

// In every format that is read, by all subcommands.
TEST_F(MeshTool, Imports) {
    GLINT_NEED_ASSIMP_MODELS();
    const std::string duck = assimpModelPath("Collada/duck.dae").string();
    if (run("mesh info " + duck).errors.ends_with("[tool.library]\n")) GTEST_SKIP() << "needs assimp's library";
    EXPECT_EQ(info(duck)["triangles"], 4212);
    expectSuccess("mesh convert " + duck + " duck.ply --weld");
    EXPECT_GT(Mesh::load(dir / "duck.ply")->triangleCount(), 4000u);
    expectSuccess("mesh lod " + duck + " duck.lod --positions");
    write("damaged.fbx", "nothing of that kind");
    expectFailure("mesh info damaged.fbx", 2, "tool.import");
}

TEST_F(MeshTool, LevelsOfDetail) {
    expectSuccess("mesh lod torus.ply torus.lod --threads 2");
    const Expected<MeshGraph> graph = MeshGraph::load(dir / "torus.lod");
    ASSERT_THAT(graph, IsOk());
    EXPECT_EQ(graph->rootCount(), 1u);
    const nlohmann::json json = info("torus.lod");
    EXPECT_EQ(json["triangles"], 4800);
    EXPECT_EQ(json["clusters"], graph->clusters().size());
    EXPECT_GT(json["levels"].size(), 3u);
    expectSuccess("mesh convert torus.lod cut.ply --error 0.05");
    const nlohmann::json cut = info("cut.ply --against torus.ply");
    EXPECT_LE(cut["triangles"], 2400);
    EXPECT_EQ(cut["closed"], true);
    EXPECT_LE(cut["distance"]["least"], 0.05);
}

TEST_F(MeshTool, WhatCannotBe) {
    for (const char* help :
         {"--help", "info --help", "convert --help", "refine --help", "optimize --help", "lod --help"})
        EXPECT_NE(expectSuccess(std::string("mesh ") + help).output.find("Options"), std::string::npos);
    expectFailure("mesh", 2, "tool.arguments");
    expectFailure("mesh paint a.ply", 2, "tool.arguments");
    expectFailure("mesh lod torus.ply", 2, "tool.arguments");
    expectFailure("mesh lod torus.ply a.lod --group 1", 2, "tool.arguments");
    expectFailure("mesh optimize torus.ply a.ply --ratio 2", 2, "tool.arguments");
    expectFailure("mesh optimize torus.ply a.ply --error=-1", 2, "tool.arguments");
    expectFailure("mesh info none.ply", 1, "file.open");
    expectFailure("mesh info torus.usdz", 2, "mesh.unknown_extension");
    expectFailure("mesh convert torus.ply a.obj", 2, "mesh.unknown_extension");
    expectFailure("mesh lod torus.ply none/a.lod", 1, "file.create");
    write("bad.lod", "no such thing");
    expectFailure("mesh info bad.lod", 2, "graph.size");
    write("empty.obj", "v 0 0 0\n");
    write("nan.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n");
    write("point.obj", "v 1 1 1\nf 1 1 1\n");
    write("fin.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\nf 1 2 5\n");
    for (const char* verb : {"lod", "optimize", "refine"}) {
        const std::string to = std::string(" out") + (verb == std::string("lod") ? ".lod" : ".ply");
        expectFailure(fmt::format("mesh {} empty.obj {}", verb, to), 2, "mesh.no_faces");
        expectFailure(fmt::format("mesh {} nan.obj {}", verb, to), 2, "mesh.not_finite");
    }
    expectFailure("mesh lod point.obj out.lod", 2, "mesh.no_faces");
    expectFailure("mesh refine point.obj out.ply", 2, "polygon.no_faces");
    expectFailure("mesh refine fin.obj out.ply", 2, "refine.edge_faces");
    expectSuccess("mesh lod fin.obj fin.lod");
    expectSuccess("mesh optimize fin.obj fin.ply --ratio 0.5");
    expectSuccess("mesh info point.obj");
}

// An interrupt leaves nothing behind.
TEST_F(MeshTool, Interrupted) {
    const Mesh large = createTorus(2.0f, 0.7f, 700, 300);
    ASSERT_THAT(large.save(dir / "large.ply"), IsOk());
    const Outcome outcome =
        run("mesh lod large.ply large.lod --threads 1", "timeout --signal=INT --preserve-status 0.7");
    EXPECT_EQ(outcome.status, 130);
    EXPECT_TRUE(outcome.errors.ends_with("[tool.interrupted]\n")) << outcome.errors;
    EXPECT_EQ(files(), (std::vector<std::string>{"large.ply", "torus.ply"}));
}
