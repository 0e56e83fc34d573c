// glint mesh info: what a file holds, and what is wrong with it.

#include "import_mesh.h"
#include "tool.h"

#include <glint/format/mesh_graph.h>
#include <glint/geometry/mesh_optimize.h>
#include <glint/geometry/surface_distance.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <map>
#include <memory>

using namespace glint;

namespace tool {

namespace {

using nlohmann::ordered_json;

struct Options {
    std::filesystem::path mesh;
    std::filesystem::path against;
    bool json = false;
};

ordered_json toJson(const BoundBox& box) {
    if (box.isEmpty()) return nullptr;
    return {{box.min.x, box.min.y, box.min.z}, {box.max.x, box.max.y, box.max.z}};
}

ordered_json describe(const Mesh& mesh) {
    const MeshStatistics s = statistics(mesh);
    const MeshOrderStatistics order = orderStatistics(mesh);
    ordered_json parts = ordered_json::array();
    for (const MeshPart& part : mesh.parts) parts.push_back({{"name", part.name}, {"triangles", part.index_count / 3}});
    return {{"triangles", s.triangles},
            {"vertices", s.vertices},
            {"normals", !mesh.normals.empty()},
            {"texcoords", !mesh.texcoords.empty()},
            {"parts", parts},
            {"bounds", toJson(mesh.bounds())},
            {"area", s.area},
            {"closed", s.isClosed()},
            {"volume", s.isClosed() ? ordered_json(s.volume) : ordered_json(nullptr)},
            {"components", s.components},
            {"edges", s.edges},
            {"open_edges", s.open_edges},
            {"non_manifold_edges", s.non_manifold_edges},
            {"turned_edges", s.turned_edges},
            {"degenerate_triangles", s.degenerate_triangles},
            {"flat_triangles", s.flat_triangles},
            {"repeated_triangles", s.repeated_triangles},
            {"unused_vertices", s.unused_vertices},
            {"repeated_vertices", s.repeated_vertices},
            {"acmr", order.acmr},
            {"atvr", order.atvr},
            {"overdraw", order.overdraw},
            {"overfetch", order.overfetch}};
}

ordered_json describe(const MeshGraph& graph) {
    struct Level {
        uint64_t groups = 0, children = 0, parents = 0;
        float least = std::numeric_limits<float>::infinity(), most = 0.0f;
    };
    std::map<uint32_t, Level> levels;
    for (const MeshClusterGroup& group : graph.groups()) {
        Level& level = levels[group.level];
        level.groups++;
        level.children += group.child_count;
        level.parents += group.parent_count;
        level.least = std::min(level.least, group.error);
        level.most = std::max(level.most, group.error);
    }
    ordered_json list = ordered_json::array();
    for (const auto& [number, level] : levels)
        list.push_back({{"level", number},
                        {"groups", level.groups},
                        {"clusters", level.children},
                        {"simplified_to", level.parents},
                        {"least_error", level.least},
                        {"largest_error", level.most}});
    uint64_t finest = 0;
    for (const MeshCluster& cluster : graph.clusters())
        if (cluster.source == UINT32_MAX) finest += cluster.triangleCount();
    ordered_json parts = ordered_json::array();
    for (const MeshGraphPart& part : graph.parts()) parts.push_back({{"name", part.name}});
    return {{"triangles", finest},
            {"vertices", graph.positions().size()},
            {"normals", !graph.normals().empty()},
            {"texcoords", !graph.texcoords().empty()},
            {"parts", parts},
            {"bounds", toJson(BoundBox(graph.positions()))},
            {"clusters", graph.clusters().size()},
            {"roots", graph.rootCount()},
            {"groups", graph.groups().size()},
            {"bytes", graph.bytes().size()},
            {"levels", list}};
}

void print(const ordered_json& description) {
    for (const auto& [key, value] : description.items()) {
        std::string name = key;
        std::replace(name.begin(), name.end(), '_', ' ');
        if (!value.is_array() || key == "bounds") {
            fmt::print("{:<21} {}\n", name, value.is_boolean() ? (value.get<bool>() ? "yes" : "no") : value.dump());
            continue;
        }
        fmt::print("{:<21} {}\n", name, value.size());
        for (const ordered_json& element : value) {
            std::string line;
            for (const auto& [field, content] : element.items())
                line += fmt::format("  {} {}", field,
                                    content.is_number_float() ? fmt::format("{:.4g}", content.get<double>())
                                                              : content.dump());
            fmt::print("{}\n", line);
        }
    }
}

int run(const Options& options) {
    ordered_json description;
    Mesh mesh;
    if (options.mesh.extension() == ".lod") {
        const Expected<MeshGraph> graph = MeshGraph::load(options.mesh);
        if (!graph) return fail("mesh info", graph.error());
        description = describe(*graph);
        mesh = graph->mesh(graph->cut(0.0f));
    } else {
        Expected<Mesh> loaded = importMesh(options.mesh);
        if (!loaded) return fail("mesh info", loaded.error());
        mesh = std::move(*loaded);
        description = describe(mesh);
    }
    if (!options.against.empty()) {
        const Expected<Mesh> other = importMesh(options.against);
        if (!other) return fail("mesh info", other.error());
        const SurfaceDistance distance = hausdorffDistance(mesh, *other);
        description["distance"] = {{"least", distance.lower}, {"most", distance.upper}};
    }
    if (options.json)
        fmt::print("{}\n", description.dump(2, ' ', false, ordered_json::error_handler_t::replace));
    else
        print(description);
    return 0;
}

}  // namespace

Command meshInfoCommand(CLI::App& app) {
    auto options = std::make_shared<Options>();
    CLI::App* sub = app.add_subcommand("info", "What a mesh or its levels of detail consist of, and what is wrong");
    sub->add_option("MESH", options->mesh, "Mesh, or levels of detail (.lod)")->required();
    sub->add_option("--against", options->against, "Bound the distance to this mesh")->type_name("MESH");
    sub->add_flag("--json", options->json, "Print a JSON object");
    return {sub, [options] { return run(*options); }};
}

}  // namespace tool
