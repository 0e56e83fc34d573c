// lod.views.MESH.{silhouette,partner}: what is seen of levels of detail against the pixels that were allowed, from any
// kind of view, judged in float64 (tests/support/level_judge.h). `./dev report` puts the table into docs/accuracy.md.

#include "bench/bench.h"

#include "support/files.h"
#include "support/hard_meshes.h"
#include "support/level_judge.h"
#include "support/level_views.h"

#include <glint/base/file.h>
#include <glint/geometry/mesh_graph_builder.h>

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace glint::bench {

namespace {

constexpr Vector2u size = {480, 320};
constexpr double thresholds[] = {0.25, 0.5, 1.0, 2.0, 4.0, 8.0};
constexpr int views = 3;  ///< of each kind

void run(Report& report) {
    std::vector<std::pair<std::string, Mesh>> meshes = {
        {"torus", test::tutorialTorus(3)}, {"sheet", test::tornSheet()}, {"boxes", test::boxes(3, 6, 10)}};
    if (const std::filesystem::path bunny = test::bunnyPath(); !bunny.empty())
        meshes.emplace_back("bunny", *check(Mesh::load(bunny)));
    std::string table =
        "| mesh | pixels allowed | triangles | pixels in one picture only | farthest from the other | partners, "
        "farthest |"
        " of the group's error | without a partner | depth, 99 % |\n|---|---|---|---|---|---|---|---|---|\n";
    for (const auto& [name, mesh] : meshes) {
        const MeshGraph graph = *check(createMeshGraph(mesh));
        const test::LevelJudge judge(mesh, graph);
        double silhouette = 0.0, partner = 0.0;
        for (const double pixels : thresholds) {
            test::Random random(11);
            test::LevelComparison all;
            for (const test::ViewKind kind : test::view_kinds)
                for (int i = 0; i < views; i++) {
                    const test::LevelView view = test::levelView(random, kind, mesh, 1.5f);
                    const MeshGraphView seen(view.camera, size, view.instance);
                    all.add(judge.compare(graph.cut(seen, static_cast<float>(pixels)), view.camera, view.instance, size,
                                          pixels, 7));
                }
            silhouette = std::max(silhouette, all.silhouette / pixels);
            partner = std::max(partner, all.displacement / pixels);
            const double finest = static_cast<double>(mesh.triangleCount()) * views * std::size(test::view_kinds);
            table += fmt::format("| {} | {} | {:.1f} % | {} | {:.3f} | {:.3f} | {:.2f} | {} | {:.3f} |\n", name, pixels,
                                 100.0 * static_cast<double>(all.triangles) / finest, all.different, all.silhouette,
                                 all.displacement, all.distance, all.unexplained, all.depth(0.99));
        }
        report.add("lod.views." + name + ".silhouette", silhouette, "of the pixels allowed", "the mesh",
                   "float64 on the host");
        report.add("lod.views." + name + ".partner", partner, "of the pixels allowed", "the mesh",
                   "float64 on the host");
    }
    fmt::print("{}\n", table);
    check(writeTextFile(report.folder() / "lod_views.md", table));
}

}  // namespace

Benchmark lodViewsBenchmark() {
    std::vector<std::string> figures;
    for (const char* mesh : {"torus", "sheet", "boxes", "bunny"})
        for (const char* figure : {"silhouette", "partner"})
            figures.push_back(fmt::format("lod.views.{}.{}", mesh, figure));
    return {figures, run};
}

}  // namespace glint::bench
