// glint mesh lod: a graph of clusters at many levels of detail.

#include "import_mesh.h"
#include "progress.h"
#include "tool.h"

#include <glint/geometry/mesh_graph_builder.h>
#include <glint/geometry/mesh_optimize.h>

#include <fmt/format.h>

#include <memory>

using namespace glint;

namespace tool {

namespace {

struct Options {
    std::filesystem::path from, to;
    MeshGraphOptions graph;
    bool positions = false;
};

int failOrInterrupted(const Error& error) {
    if (Status interrupted = checkInterrupt(); !interrupted) {
        fail("mesh lod", interrupted.error());
        return ExitInterrupted;
    }
    return fail("mesh lod", error);
}

int run(Options& options) {
    catchSignals();
    Expected<Mesh> mesh = importMesh(options.from);
    if (!mesh) return failOrInterrupted(mesh.error());
    options.positions ? weldPositions(*mesh) : weld(*mesh);
    if (options.positions && !mesh->indices.empty()) mesh->createNormals();
    if (Status status = mesh->validate(); !status) return failOrInterrupted(status.error());

    const double begin = now();
    Expected<MeshGraph> graph = [&] {
        Progress progress(mesh->triangleCount(), "million triangles", 1e-6);
        options.graph.progress = [&](float share) {
            progress.update(static_cast<uint64_t>(share * static_cast<double>(mesh->triangleCount())));
            return static_cast<bool>(checkInterrupt());
        };
        return createMeshGraph(*mesh, options.graph);
    }();
    if (!graph) return failOrInterrupted(graph.error());
    if (Status status = graph->save(options.to); !status) return fail("mesh lod", status.error());
    uint64_t coarsest = 0;
    for (uint32_t i = 0; i < graph->rootCount(); i++) coarsest += graph->clusters()[i].triangleCount();
    fmt::print("{}: {} triangles down to {}, {} clusters in {} groups, {} bytes, {:.2f} s\n", options.to.string(),
               mesh->triangleCount(), coarsest, graph->clusters().size(), graph->groups().size(), graph->bytes().size(),
               now() - begin);
    return 0;
}

}  // namespace

Command meshLodCommand(CLI::App& app) {
    auto options = std::make_shared<Options>();
    CLI::App* sub =
        app.add_subcommand("lod", "Makes levels of detail: clusters of triangles and what may stand for them");
    sub->add_option("FROM", options->from, "Mesh to read")->required();
    sub->add_option("TO", options->to, "Where to write them (.lod)")->required();
    sub->add_option("--group", options->graph.group_clusters, "Clusters that are simplified together, about")
        ->type_name("N")
        ->check(CLI::Range(2u, 64u))
        ->capture_default_str();
    sub->add_option("--threads", options->graph.threads, "Threads; 0 is one for each core")
        ->type_name("N")
        ->check(CLI::Range(0u, 256u))
        ->capture_default_str();
    sub->add_flag("--positions", options->positions,
                  "Join vertices at one place, whatever their normals and texture coordinates; make new normals");
    return {sub, [options] { return run(*options); }};
}

}  // namespace tool
