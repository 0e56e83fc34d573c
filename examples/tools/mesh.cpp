// glint mesh: looks at meshes, converts, refines, simplifies and orders them, and makes levels of detail. Its
// subcommands that are longer have a source of their own.

#include "import_mesh.h"
#include "tool.h"

#include <glint/format/mesh_graph.h>
#include <glint/geometry/mesh_optimize.h>
#include <glint/geometry/refine.h>
#include <glint/geometry/simplify.h>

#include <fmt/format.h>

#include <limits>
#include <memory>
#include <vector>

using namespace glint;

namespace tool {

namespace {

/// Writes a mesh and says so.
int writeMesh(const char* command, const Mesh& mesh, const std::filesystem::path& path) {
    if (Status status = mesh.save(path); !status) return fail(command, status.error());
    fmt::print("{}: {} triangles, {} vertices\n", path.string(), mesh.triangleCount(), mesh.positions.size());
    return 0;
}

struct ConvertOptions {
    std::filesystem::path from, to;
    bool weld = false;
    bool positions = false;
    bool normals = false;
    float error = 0.0f;
};

Expected<Mesh> loadMesh(const std::filesystem::path& path, float error) {
    if (path.extension() != ".lod") return importMesh(path);
    const Expected<MeshGraph> graph = MeshGraph::load(path);
    if (!graph) return unexpected(graph.error());
    return graph->mesh(graph->cut(error));
}

int runConvert(const ConvertOptions& options) {
    Expected<Mesh> mesh = loadMesh(options.from, options.error);
    if (!mesh) return fail("mesh convert", mesh.error());
    if (options.weld || options.positions) {
        const MeshWeld taken = options.positions ? weldPositions(*mesh) : weld(*mesh);
        fmt::print("{} vertices and {} triangles were not needed\n", taken.vertices, taken.triangles);
    }
    if (options.normals) mesh->createNormals();
    return writeMesh("mesh convert", *mesh, options.to);
}

Command convertCommand(CLI::App& app) {
    auto options = std::make_shared<ConvertOptions>();
    CLI::App* sub = app.add_subcommand("convert", "Writes a mesh in another format");
    sub->add_option("FROM", options->from, "Mesh to read, or levels of detail (.lod)")->required();
    sub->add_option("TO", options->to, "Where to write it (.ply)")->required();
    sub->add_flag("--weld", options->weld,
                  "Join vertices that are equal; drop those not used and degenerate triangles");
    sub->add_flag("--positions", options->positions, "Keep only positions, and join vertices at one place");
    sub->add_flag("--normals", options->normals, "Make new normals: those of the triangles around a vertex");
    sub->add_option("--error", options->error,
                    "Of levels of detail: those with at most this error, in units of the mesh")
        ->type_name("E")
        ->check(CLI::NonNegativeNumber);
    return {sub, [options] { return runConvert(*options); }};
}

struct RefineOptions {
    std::filesystem::path from, to;
    bool loop = false;
    bool limit = false;
    uint32_t steps = 1;
};

int runRefine(const RefineOptions& options) {
    const Expected<Mesh> mesh = importMesh(options.from);
    if (!mesh) return fail("mesh refine", mesh.error());
    const Expected<PolygonMesh> cage = toPolygons(*mesh);
    if (!cage) return fail("mesh refine", cage.error());
    const Subdivision scheme = options.loop ? Subdivision::Loop : Subdivision::CatmullClark;
    const Expected<PolygonMesh> fine =
        options.limit ? toLimit(*cage, scheme, options.steps) : refine(*cage, scheme, options.steps);
    if (!fine) return fail("mesh refine", fine.error());
    Expected<Mesh> result = toTriangles(*fine);
    if (!result) return fail("mesh refine", result.error());
    if (!options.limit) result->createNormals();
    return writeMesh("mesh refine", *result, options.to);
}

Command refineCommand(CLI::App& app) {
    auto options = std::make_shared<RefineOptions>();
    CLI::App* sub = app.add_subcommand("refine", "Refines a mesh towards a smooth surface");
    sub->add_option("FROM", options->from, "Mesh to read: the cage")->required();
    sub->add_option("TO", options->to, "Where to write the refined mesh (.ply)")->required();
    sub->add_option("--steps", options->steps, "How often: each step makes four triangles of one, or more")
        ->type_name("N")
        ->check(CLI::Range(0u, 16u))
        ->capture_default_str();
    sub->add_flag("--loop", options->loop, "Loop's rules, for triangles; without it those of Catmull and Clark");
    sub->add_flag("--limit", options->limit, "Move vertices to where refining for ever would bring them");
    return {sub, [options] { return runRefine(*options); }};
}

struct OptimizeOptions {
    std::filesystem::path from, to;
    double ratio = 1.0;
    double error = std::numeric_limits<double>::infinity();
    bool positions = false;
    bool keep_border = false;
};

void print(const char* name, const Mesh& mesh) {
    const MeshOrderStatistics s = orderStatistics(mesh);
    fmt::print("{:<7} {:>10} triangles {:>10} vertices  ACMR {:.3f}  ATVR {:.3f}  overdraw {:.3f}  overfetch {:.3f}\n",
               name, mesh.triangleCount(), mesh.positions.size(), s.acmr, s.atvr, s.overdraw, s.overfetch);
}

int runOptimize(const OptimizeOptions& options) {
    Expected<Mesh> mesh = importMesh(options.from);
    if (!mesh) return fail("mesh optimize", mesh.error());
    print("before", *mesh);
    options.positions ? weldPositions(*mesh) : weld(*mesh);
    if (Status status = mesh->validate(); !status) return fail("mesh optimize", status.error());
    if (options.ratio < 1.0 || options.error < std::numeric_limits<double>::infinity()) {
        // With an error alone, as far as that goes.
        const double ratio = options.ratio < 1.0 ? options.ratio : 0.0;
        Expected<SimplifiedMesh> simple =
            simplify(*mesh, {.ratio = ratio, .max_error = options.error, .keep_border = options.keep_border});
        if (!simple) return fail("mesh optimize", simple.error());
        fmt::print("simplified: at most {:.6g} away, at least {:.6g}\n", simple->distance.upper,
                   simple->distance.lower);
        *mesh = std::move(simple->mesh);
    }
    if (options.positions) mesh->createNormals();
    optimize(*mesh);
    print("after", *mesh);
    return writeMesh("mesh optimize", *mesh, options.to);
}

Command optimizeCommand(CLI::App& app) {
    auto options = std::make_shared<OptimizeOptions>();
    CLI::App* sub = app.add_subcommand("optimize", "Orders a mesh for drawing, and simplifies it");
    sub->add_option("FROM", options->from, "Mesh to read")->required();
    sub->add_option("TO", options->to, "Where to write it (.ply)")->required();
    sub->add_option("--ratio", options->ratio, "Keep about this share of the triangles")
        ->type_name("R")
        ->check(CLI::Range(0.0, 1.0));
    sub->add_option("--error", options->error, "Keep within this distance, in units of the mesh")
        ->type_name("E")
        ->check(CLI::NonNegativeNumber);
    sub->add_flag("--positions", options->positions,
                  "Join vertices at one place, whatever their normals and texture coordinates; make new normals");
    sub->add_flag("--keep-border", options->keep_border, "Leave the border of an open mesh as it is");
    return {sub, [options] { return runOptimize(*options); }};
}

}  // namespace

Command meshCommand(CLI::App& app) {
    CLI::App* sub = app.add_subcommand("mesh", "Meshes: looks at them, converts, refines, orders and simplifies them");
    sub->require_subcommand(1);
    const std::vector<Command> commands = {meshInfoCommand(*sub), convertCommand(*sub), refineCommand(*sub),
                                           optimizeCommand(*sub), meshLodCommand(*sub)};
    return {sub, [commands] {
                for (const Command& command : commands)
                    if (command.app->parsed()) return command.run();
                return static_cast<int>(ExitUsage);
            }};
}

}  // namespace tool
