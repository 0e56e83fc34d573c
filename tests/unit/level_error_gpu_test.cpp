// The promise of levels of detail, of what a device makes of it: clusters that MeshGraphSelector lists, in pictures
// that Rasterizer draws. And what becomes of bad meshes on the way there.

#include "support/bad_meshes.h"
#include "support/device_fixture.h"
#include "support/hard_meshes.h"
#include "support/level_judge.h"
#include "support/level_views.h"

#include <glint/geometry/mesh_graph_builder.h>
#include <glint/geometry/primitives.h>
#include <glint/graphics/mesh_graph_selector.h>
#include <glint/graphics/rasterizer.h>

#include <algorithm>
#include <cmath>

namespace glint::test {

namespace {

constexpr Vector2u size = {240, 160};

struct Drawn {
    std::vector<std::array<uint32_t, 2>> list;  ///< instance, cluster
    std::vector<uint64_t> pixels;
};

class LevelErrorTest : public DeviceTest {
protected:
    void SetUp() override {
        DeviceTest::SetUp();
        ASSERT_TRUE(device);
        ASSERT_THAT(selector.create(device), IsOk());
        ASSERT_THAT(rasterizer.create(device), IsOk());
    }
    void TearDown() override {
        selector = {};
        rasterizer = {};
        DeviceTest::TearDown();
    }

    /// Once more if a list was too small.
    Drawn draw(const MeshGraphModel& model, const LevelView& view, double pixels, MeshGraphSelector::Cull cull,
               Rasterizer::Cull faces = Rasterizer::CullNone) {
        const Buffer instances = device.createBuffer(Buffer::FlagStorage, std::span(&view.instance, 1), "instances");
        Drawn drawn;
        for (int attempt = 0; attempt < 3; attempt++) {
            Compute compute = device.createCompute();
            selector.select(compute, model, instances, 1, view.camera, size, static_cast<float>(pixels), cull);
            rasterizer.begin(compute, size);
            rasterizer.drawClusters(compute, model, instances, selector.getList(), selector.getCount(), view.camera,
                                    faces);
            const Status status = device.submit(compute);
            EXPECT_THAT(status, IsOk());
            const bool is_selected = static_cast<bool>(selector.check()),
                       is_drawn = static_cast<bool>(rasterizer.check());
            if (!status || (is_selected && is_drawn)) break;
            EXPECT_LT(attempt, 2) << "the lists do not grow";
        }
        log.take();  // that they grow
        const auto count = device.read<uint32_t>(selector.getCount());
        const auto list = device.read<std::array<uint32_t, 2>>(selector.getList());
        const auto visible = device.read<uint64_t>(rasterizer.getVisibility());
        EXPECT_TRUE(count && list && visible);
        if (!count || !list || !visible) return drawn;
        drawn.list.assign(list->begin(), list->begin() + std::min<size_t>(count->front(), list->size()));
        drawn.pixels.assign(visible->begin(), visible->begin() + std::min<size_t>(size.x * size.y, visible->size()));
        return drawn;
    }

    MeshGraphSelector selector;
    Rasterizer rasterizer;
};

std::vector<SeenTriangle> seenIn(const Drawn& drawn) {
    std::vector<SeenTriangle> seen;
    for (const uint64_t pixel : drawn.pixels) {
        const auto number = ~static_cast<uint32_t>(pixel);
        seen.push_back(pixel == Rasterizer::background ? SeenTriangle() : SeenTriangle{number / 128, number % 128});
    }
    return seen;
}

}  // namespace

TEST_F(LevelErrorTest, PicturesKeepThePromise) {
    constexpr double thresholds[] = {0.25, 1.0, 4.0, 0.5, 2.0, 8.0};
    const std::pair<const char*, Mesh> meshes[] = {
        {"torus", tutorialTorus(3)}, {"sheet", tornSheet()}, {"boxes", boxes(3, 6, 10)}};
    for (const auto& [name, mesh] : meshes) {
        const MeshGraph graph = *createMeshGraph(mesh);
        const MeshGraphModel model(device, graph, name);
        ASSERT_TRUE(model) << model.error().text();
        const LevelJudge judge(mesh, graph);
        Random random(12);
        LevelComparison all;
        double share = 0.0;
        size_t views = 0;
        for (const ViewKind kind : view_kinds)
            for (int i = 0; i < 3; i++) {
                const double pixels = thresholds[views++ % std::size(thresholds)];
                const LevelView view = levelView(random, kind, mesh, 1.5f);
                // What is outside of the picture is no partner of what is seen in it.
                const Drawn drawn = draw(model, view, pixels, MeshGraphSelector::CullFrustum);
                std::vector<uint32_t> cut;
                for (const auto& [instance, cluster] : drawn.list) cut.push_back(cluster);
                const LevelComparison found =
                    judge.compare(cut, view.camera, view.instance, size, pixels, 11, seenIn(drawn));
                EXPECT_EQ(found.unexplained, 0u) << name << ", " << nameOf(kind) << " " << i << ": " << found.first;
                share = std::max(share, found.silhouette / pixels);
                all.add(found);
            }
        std::printf("%-6s %7zu pixels, %5zu differ, silhouette %.3f of what is allowed\n", name,
                    static_cast<size_t>(all.pixels), static_cast<size_t>(all.different), share);
        EXPECT_GT(all.pixels, 5000u);
    }
}

// What is left out of the list is not seen: the picture is the same to the bit.
TEST_F(LevelErrorTest, WhatIsCulledIsNotSeen) {
    const Mesh mesh = tutorialTorus(2);
    const MeshGraphModel model(device, *createMeshGraph(mesh), "torus");
    Random random(5);
    size_t all = 0, some = 0;
    for (const ViewKind kind : view_kinds)
        for (int i = 0; i < 2; i++) {
            LevelView view = levelView(random, kind, mesh, 1.5f);
            // A mirror turns front faces into back faces.
            view.instance = Transform3x4();
            const Drawn full = draw(model, view, 1.0, MeshGraphSelector::CullNone, Rasterizer::CullBack);
            const Drawn culled = draw(model, view, 1.0, MeshGraphSelector::CullAll, Rasterizer::CullBack);
            EXPECT_TRUE(full.pixels == culled.pixels) << nameOf(kind);
            all += full.list.size();
            some += culled.list.size();
        }
    EXPECT_LT(some * 10, all * 9);
}

// Drawn as they are and through levels of detail, or refused with a reason.
TEST_F(LevelErrorTest, BadMeshesAreDrawnOrRefused) {
    const auto buffer = [&](const auto& values) {
        return device.createBuffer(Buffer::FlagStorage, std::span(values), "bad");
    };
    size_t refused = 0;
    for (const BadMesh& bad : badMeshes()) {
        SCOPED_TRACE(bad.name);
        // As wide as the picture, wherever it is.
        LevelView view;
        const BoundBox box = bad.mesh.bounds();
        const Vector3f center = bad.invalid.empty() ? box.center() : Vector3f(0.0f);
        const float length = bad.invalid.empty() ? glm::length(box.size()) : 2.0f;
        view.camera = Camera()
                          .lookAt(center + length * Vector3f(0.5f, 0.6f, 0.7f), center)
                          .perspective(60.0f, 1.5f, std::max(0.01f * length, 1e-6f))
                          .parameters();

        // As they are: the rasteriser leaves out what is no triangle.
        uint64_t covered = 0;
        if (!bad.mesh.positions.empty() && !bad.mesh.indices.empty()) {
            const Rasterizer::Mesh mesh = {.positions = buffer(bad.mesh.positions),
                                           .indices = buffer(bad.mesh.indices),
                                           .triangles = static_cast<uint32_t>(bad.mesh.triangleCount())};
            const Matrix4x4f to_clip = view.camera.projection * view.camera.view;
            for (int attempt = 0; attempt < 2; attempt++) {
                Compute compute = device.createCompute();
                rasterizer.begin(compute, size);
                rasterizer.draw(compute, mesh, to_clip);
                const Status status = device.submit(compute);
                EXPECT_TRUE(status || status.error().id() == "raster.matrix") << status.error().text();
                if (!status || rasterizer.check()) break;
            }
            log.take();
            const auto visible = device.read<uint64_t>(rasterizer.getVisibility());
            ASSERT_TRUE(visible);
            for (uint32_t i = 0; i < size.x * size.y; i++) covered += (*visible)[i] != Rasterizer::background;
        }

        const Expected<MeshGraph> graph = createMeshGraph(bad.mesh);
        ASSERT_EQ(errorOf(graph).id(), bad.no_graph);
        if (!graph) {
            refused++;
            continue;
        }
        const MeshGraphModel model(device, *graph, bad.name);
        ASSERT_TRUE(model) << model.error().text();
        for (const double pixels : {0.0, 4.0}) {
            const Drawn drawn = draw(model, view, pixels, MeshGraphSelector::CullNone);
            EXPECT_GT(drawn.list.size(), 0u);
            const auto seen =
                static_cast<uint64_t>(std::ranges::count_if(drawn.pixels, [](uint64_t pixel) { return pixel != 0; }));
            // The full mesh, whose corners may come to the picture by other roundings: some move by a step of 2^-8
            // pixel, and an outline of a thousand pixels passes four centres then.
            if (pixels == 0.0) { EXPECT_LE(std::max(seen, covered) - std::min(seen, covered), 8u); }
            if (covered > 1000) { EXPECT_GT(seen, covered / 2); }
        }
    }
    EXPECT_GT(refused, 10u);
}

}  // namespace glint::test
