// The promise of levels of detail: what is seen of a cut is where the mesh is seen, within the pixels that were
// allowed, and as far away. Judged in float64 from any kind of view.

#include "support/exact_picture.h"
#include "support/files.h"
#include "support/hard_meshes.h"
#include "support/level_judge.h"
#include "support/level_views.h"
#include "support/matchers.h"

#include <glint/geometry/mesh_graph_builder.h>
#include <glint/geometry/primitives.h>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cmath>

using namespace glint;
using namespace glint::test;

namespace {

constexpr Vector2u size = {240, 160};
constexpr double thresholds[] = {0.25, 0.5, 1.0, 2.0, 4.0, 8.0};

/// All kinds of views with all thresholds, and what they found.
LevelComparison judge(const char* name, const Mesh& mesh, int views) {
    const Expected<MeshGraph> graph = createMeshGraph(mesh);
    EXPECT_THAT(graph, IsOk());
    if (!graph) return {};
    const LevelJudge judge(mesh, *graph);
    Random random(11);
    LevelComparison all;
    for (const ViewKind kind : view_kinds) {
        LevelComparison of_kind;
        double share = 0.0;
        for (int i = 0; i < views; i++) {
            const double pixels = thresholds[static_cast<size_t>(i) % std::size(thresholds)];
            const LevelView view = levelView(random, kind, mesh, 1.5f);
            const MeshGraphView seen(view.camera, size, view.instance);
            const LevelComparison found = judge.compare(graph->cut(seen, static_cast<float>(pixels)), view.camera,
                                                        view.instance, size, pixels, 11);
            EXPECT_EQ(found.unexplained, 0u) << name << ", " << nameOf(kind) << " " << i << ": " << found.first;
            EXPECT_LE(found.silhouette, pixels * (1.0 + 1e-4)) << name << ", " << nameOf(kind) << " " << i;
            share = std::max(share, found.silhouette / pixels);
            of_kind.add(found);
        }
        std::printf("%-10s %-8s %8zu pixels %6zu differ %5zu at near, silhouette %.3f of what is allowed, depth 99 %% "
                    "%.3f\n",
                    name, nameOf(kind), static_cast<size_t>(of_kind.pixels), static_cast<size_t>(of_kind.different),
                    static_cast<size_t>(of_kind.at_near), share, of_kind.depth(0.99));
        all.add(of_kind);
    }
    return all;
}

}  // namespace

TEST(LevelError, ClosedMesh) {
    const LevelComparison found = judge("torus", tutorialTorus(3), 12);
    EXPECT_GT(found.different, 200u);
    // Before the near plane lies next to nothing of what is seen.
    EXPECT_LT(found.at_near * 20, found.pixels);
}

TEST(LevelError, OpenMesh) { EXPECT_GT(judge("sheet", tornSheet(), 12).pixels, 50000u); }

TEST(LevelError, SharpEdges) { EXPECT_GT(judge("boxes", boxes(3, 6, 10), 12).different, 10u); }

TEST(LevelError, Soup) { EXPECT_GT(judge("soup", soup(5, 60, 300), 6).pixels, 10000u); }

TEST(LevelError, Bunny) {
    GLINT_NEED_BUNNY();
    EXPECT_GT(judge("bunny", *Mesh::load(bunnyPath()), 6).different, 50u);
}

// A cut that is coarser than it may be, and a graph whose errors are too small, are found out.
TEST(LevelError, WrongCutsAreSeen) {
    const Mesh mesh = tutorialTorus(2);
    const MeshGraph graph = *createMeshGraph(mesh);
    MeshGraphArrays small = {
        .positions = {graph.positions().begin(), graph.positions().end()},
        .clusters = {graph.clusters().begin(), graph.clusters().end()},
        .groups = {graph.groups().begin(), graph.groups().end()},
        .parents = {graph.parents().begin(), graph.parents().end()},
        .cluster_vertices = {graph.clusterVertices().begin(), graph.clusterVertices().end()},
        .cluster_triangles = {graph.clusterTriangles().begin(), graph.clusterTriangles().end()},
        .parts = graph.parts(),
        .root_count = graph.rootCount(),
    };
    for (MeshClusterGroup& group : small.groups) group.error /= 8.0f;
    const MeshGraph wrong = *MeshGraph::create(small);
    const LevelJudge judge(mesh, graph), judge_of_wrong(mesh, wrong);
    const CameraParameters camera = Camera().lookAt({4, 3, 2}, {0, 0, 0}).perspective(60.0f, 1.5f).parameters();
    const MeshGraphView view(camera, size);
    EXPECT_EQ(judge.compare(graph.cut(view, 2.0f), camera, {}, size, 2.0).unexplained, 0u);
    EXPECT_GT(judge.compare(graph.cut(view, 16.0f), camera, {}, size, 0.25).unexplained, 100u);
    EXPECT_GT(judge_of_wrong.compare(wrong.cut(view, 2.0f), camera, {}, size, 2.0).unexplained, 100u);
}

// By hand: a square of half the picture's width and height, 2 away, in the middle; and half of it before the eye.
TEST(LevelError, ThePictureIsWhatItShouldBe) {
    const Mesh square = createPlane(2.0f, 1);
    const CameraParameters camera =
        Camera().lookAt({0, 0, 2}, {0, 0, 0}, {0, 1, 0}).perspective(90.0f, 1.0f).parameters();
    const ExactPicture picture(square, toClip(camera), {64, 64});
    size_t covered = 0;
    for (uint32_t y = 0; y < 64; y++)
        for (uint32_t x = 0; x < 64; x++) {
            if (picture.triangle(x, y) == ExactPicture::none) continue;
            covered++;
            EXPECT_NEAR(picture.depth(x, y), 2.0, 1e-12);
            EXPECT_NEAR(glm::length(Vector2d(picture.project(picture.point(x, y))) - Vector2d(x + 0.5, y + 0.5)), 0.0,
                        1e-9);
        }
    EXPECT_EQ(covered, 32u * 32u);
    EXPECT_EQ(picture.distanceToCoverage({30.0, 40.0}, 4.0), 0.0);
    EXPECT_NEAR(picture.distanceToCoverage({30.0, 51.0}, 4.0), 3.0, 1e-9);
    EXPECT_NEAR(picture.distanceToCoverage({12.0, 13.0}, 6.0), 5.0, 1e-9);
    EXPECT_EQ(picture.distanceToCoverage({30.0, 60.0}, 4.0), INFINITY);
    // Seen along the floor that it is: it goes on behind the eye, and its horizon is at the depth of its far side.
    const CameraParameters along =
        Camera().lookAt({0, 0, 0.5f}, {0, 1, 0.5f}).perspective(90.0f, 1.0f, 0.1f).parameters();
    const ExactPicture floor(square, toClip(along), {64, 64});
    EXPECT_NEAR(floor.depth(32, 63), 0.5 / (31.5 / 32.0), 1e-9);
    // The far side is 1 away, so 16 pixels below the middle.
    EXPECT_EQ(floor.triangle(32, 47), ExactPicture::none);
    EXPECT_NE(floor.triangle(32, 48), ExactPicture::none);
    EXPECT_NEAR(floor.distanceToCoverage({32.0, 46.0}, 8.0), 2.0, 1e-9);
}
