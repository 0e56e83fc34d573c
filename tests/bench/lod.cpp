// lod.load.over_read: MeshGraph::load of a large file against read() of the same file, both from the page cache.
// lod.error.*: how much a cut's guaranteed error is above the distance that is there, and how many triangles that
// takes.

#include "bench/bench.h"

#include "support/files.h"

#include <glint/geometry/mesh_graph_builder.h>
#include <glint/geometry/primitives.h>
#include <glint/geometry/surface_distance.h>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>

namespace glint::bench {

namespace {

constexpr uint64_t file_size = 1ull << 28;
constexpr uint32_t rounds = 9;

Mesh sourceMesh() {
    const std::filesystem::path bunny = test::bunnyPath();
    return bunny.empty() ? createTorus(1.0f, 0.4f, 300, 120) : *check(Mesh::load(bunny));
}

/// A graph of several copies of another one.
MeshGraph replicate(const MeshGraph& one, uint32_t times) {
    MeshGraphArrays all;
    all.root_count = one.rootCount() * times;
    all.parts = one.parts();
    const auto below = static_cast<uint32_t>(one.clusters().size()) - one.rootCount();
    const auto groups = static_cast<uint32_t>(one.groups().size());
    const auto clusterNumber = [&](uint32_t cluster, uint32_t copy) {
        return cluster < one.rootCount() ? copy * one.rootCount() + cluster
                                         : all.root_count + copy * below + cluster - one.rootCount();
    };
    const auto addCluster = [&](uint32_t i, uint32_t copy) {
        MeshCluster cluster = one.clusters()[i];
        const auto vertices = one.clusterVertices().subspan(cluster.first_vertex, cluster.vertexCount());
        const auto triangles = one.clusterTriangles().subspan(cluster.first_triangle, cluster.triangleCount());
        cluster.first_vertex = static_cast<uint32_t>(all.cluster_vertices.size());
        cluster.first_triangle = static_cast<uint32_t>(all.cluster_triangles.size());
        if (cluster.source != UINT32_MAX) cluster.source += copy * groups;
        if (cluster.group != UINT32_MAX) cluster.group += copy * groups;
        for (const uint32_t vertex : vertices)
            all.cluster_vertices.push_back(vertex + copy * static_cast<uint32_t>(one.positions().size()));
        all.cluster_triangles.insert(all.cluster_triangles.end(), triangles.begin(), triangles.end());
        all.clusters.push_back(cluster);
    };
    for (uint32_t copy = 0; copy < times; copy++)
        for (uint32_t i = 0; i < one.rootCount(); i++) addCluster(i, copy);
    for (uint32_t copy = 0; copy < times; copy++) {
        all.positions.insert(all.positions.end(), one.positions().begin(), one.positions().end());
        all.normals.insert(all.normals.end(), one.normals().begin(), one.normals().end());
        for (uint32_t i = one.rootCount(); i < one.clusters().size(); i++) addCluster(i, copy);
        for (MeshClusterGroup group : one.groups()) {
            group.first_child = clusterNumber(group.first_child, copy);
            group.first_parent += copy * static_cast<uint32_t>(one.parents().size());
            all.groups.push_back(group);
        }
        for (const uint32_t parent : one.parents()) all.parents.push_back(clusterNumber(parent, copy));
    }
    return *check(MeshGraph::create(all));
}

double secondsOf(const std::function<void()>& work) {
    const double begin = wallSeconds();
    work();
    return wallSeconds() - begin;
}

void measureLoading(Report& report, const MeshGraph& graph) {
    const test::TempDir folder;
    const std::filesystem::path path = folder / "large.lod";
    const auto times = static_cast<uint32_t>(file_size / graph.bytes().size());
    check(replicate(graph, times).save(path));
    const uint64_t size = std::filesystem::file_size(path);

    Times read, load;
    size_t clusters = 0;
    for (uint32_t i = 0; i <= rounds; i++) {
        const double read_seconds = secondsOf([&] {
            const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
            const std::unique_ptr<void, decltype(&std::free)> memory(std::malloc(size), &std::free);
            if (descriptor < 0 || ::read(descriptor, memory.get(), size) != static_cast<ssize_t>(size))
                throw std::runtime_error("cannot read");
            ::close(descriptor);
        });
        const double load_seconds = secondsOf([&] { clusters = check(MeshGraph::load(path))->clusters().size(); });
        // In the first round the file comes into the page cache.
        if (i == 0) continue;
        read.values.push_back(read_seconds);
        load.values.push_back(load_seconds);
    }
    fmt::print("{} bytes, {} clusters: {} copies\n", size, clusters, times);
    printTimes("MeshGraph::load", load);
    printTimes("  read() into memory of its own", read);
    report.add("lod.load.over_read", read.median() / load.median(), "ratio of speeds",
               "read() of the file into memory of its own", processorName());
}

void measureErrors(Report& report, const Mesh& mesh, const MeshGraph& graph) {
    const double size = glm::length(mesh.bounds().size());
    fmt::print("\n{:>10} {:>10} {:>12} {:>12} {:>8}\n", "allowed", "triangles", "guaranteed", "found", "ratio");
    double largest = 0.0;
    for (const double share : {0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05}) {
        const std::vector<uint32_t> cut = graph.cut(static_cast<float>(share * size));
        const Mesh shown = graph.mesh(cut);
        double error = 0.0;
        for (const uint32_t i : cut)
            if (const uint32_t source = graph.clusters()[i].source; source != UINT32_MAX)
                error = std::max<double>(error, graph.groups()[source].error);
        const double found = hausdorffDistance(mesh, shown).lower;
        fmt::print("{:>10.5f} {:>10} {:>12.6f} {:>12.6f} {:>8.2f}\n", share * size, shown.triangleCount(), error, found,
                   found > 0.0 ? error / found : 1.0);
        if (found > 0.0) largest = std::max(largest, error / found);
        if (share == 0.001 || share == 0.01)
            report.add(fmt::format("lod.triangles.{}", share),
                       static_cast<double>(shown.triangleCount()) / static_cast<double>(mesh.triangleCount()), "share",
                       "the mesh's triangles", processorName());
    }
    report.add("lod.error.guaranteed_over_found", largest, "ratio", "the distance of a point that was found",
               processorName());
}

void run(Report& report) {
    const Mesh mesh = sourceMesh();
    const double begin = wallSeconds();
    const MeshGraph graph = *check(createMeshGraph(mesh));
    fmt::print("{} triangles: {:.2f} s to make the graph\n", mesh.triangleCount(), wallSeconds() - begin);
    measureLoading(report, graph);
    measureErrors(report, mesh, graph);
}

}  // namespace

Benchmark lodBenchmark() {
    return {{"lod.load.over_read", "lod.triangles.0.001", "lod.triangles.0.01", "lod.error.guaranteed_over_found"},
            run};
}

}  // namespace glint::bench
