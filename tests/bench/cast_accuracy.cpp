// cast.*: hits of both engines' ray queries, as RayCaster and `glint cast` give them, against float64, with Embree
// beside them. docs/accuracy.md says what the figures mean; `./dev report` makes its tables and charts from what is
// written.

#include "accuracy/embree.h"
#include "bench/bench.h"
#include "support/files.h"
#include "support/hit_accuracy.h"

#include <fmt/format.h>
#include <glint/base/file.h>
#include <glint/geometry/primitives.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace glint::bench {

namespace {

using test::EmbreeMode;
using test::HitComparison;

constexpr uint32_t ray_count = 100000;
constexpr uint32_t leak_rays = 131072;

/// Something that traces. The first is what the plain figures are of; others add their suffix.
struct Tracer {
    std::string name;
    std::string suffix;
    std::string device;
    std::function<std::vector<RayHit>(const Mesh& mesh, std::span<const Ray> rays, double& seconds)> cast;
};

std::vector<Tracer> tracers() {
    std::vector<Tracer> list;
    for (const TracingEngine engine : {TracingEngine::Software, TracingEngine::Driver}) {
        const Device device = createDevice(engine);
        const bool is_driver = engine == TracingEngine::Driver;
        if (!device.getFeatures().computeTracing) {
            fmt::print("  left out: the driver of {} has no ray queries\n", device.getInfo().name);
            continue;
        }
        list.push_back({is_driver ? "driver" : "Glint's engine", is_driver ? ".driver" : "", deviceName(device),
                        [device](const Mesh& mesh, std::span<const Ray> rays, double& seconds) {
                            RayCaster caster = std::move(*check(RayCaster::create(device, mesh)));
                            // The shader is compiled at its first dispatch.
                            check(caster.cast(rays.first(1)));
                            const double begin = wallSeconds();
                            std::vector<RayHit> hits = std::move(*check(caster.cast(rays)));
                            seconds = wallSeconds() - begin;
                            return hits;
                        }});
    }
    const auto embree = [](EmbreeMode mode) {
        return [mode](const Mesh& mesh, std::span<const Ray> rays, double& seconds) {
            const test::EmbreeScene scene(mesh, mode);
            const double begin = wallSeconds();
            std::vector<RayHit> hits = scene.cast(rays);
            seconds = wallSeconds() - begin;
            return hits;
        };
    };
    list.push_back({"Embree", ".embree", test::embreeName(), embree(EmbreeMode::Fast)});
    list.push_back({"Embree, robust", ".embree_robust", test::embreeName(), embree(EmbreeMode::Robust)});
    return list;
}

/// The share of hits whose error is larger, over the error: one line each, at most 400 of them.
void writeCurve(const std::filesystem::path& path, const std::vector<double>& errors) {
    std::string text = "# error, share of the hits with a larger one\n";
    const auto count = static_cast<double>(errors.size());
    double last = -1.0;
    for (size_t i = 0; i < errors.size(); i++) {
        const double share = (count - static_cast<double>(i)) / count;
        // Even steps of the logarithm, which is what is drawn.
        const double step = std::floor(-80.0 * std::log10(share));
        if (step == last || errors[i] <= 0.0) continue;
        last = step;
        text += fmt::format("{:.6e} {:.6e}\n", errors[i], share);
    }
    check(writeTextFile(path, text));
}

struct Scene {
    std::string name;   ///< in figures
    std::string title;  ///< in tables
    Mesh mesh;
};

std::vector<Scene> scenes() {
    std::vector<Scene> list;
    if (const std::filesystem::path bunny = test::bunnyPath(); !bunny.empty())
        list.push_back({"bunny", "Stanford bunny, 69,666 triangles", std::move(*check(Mesh::load(bunny)))});
    else
        fmt::print("  left out: the Stanford bunny (Debian's package glmark2-data)\n");
    list.push_back({"torus_100k", "torus, 102,400 triangles", createTorus(1.0f, 0.4f, 320, 160)});
    return list;
}

void compareScene(Report& report, const Scene& scene, std::span<const Tracer> list, std::string& table) {
    const std::vector<Ray> rays = test::raysAround(scene.mesh, ray_count);
    const test::ReferenceHierarchy reference(scene.mesh);
    for (const Tracer& tracer : list) {
        double seconds = 0.0;
        const std::vector<RayHit> hits = tracer.cast(scene.mesh, rays, seconds);
        const HitComparison result = test::compareHits(reference, rays, hits);
        if (result.wrong) fmt::print("  {} of {}: {} wrong, {}\n", tracer.name, scene.name, result.wrong, result.first);
        const auto quantile = [&](double share) { return HitComparison::quantile(result.t_errors, share); };
        table +=
            fmt::format("| {} | {} | {} | {} | {} | {:.1e} | {:.1e} | {:.1e} | {:.1e} | {:.2f} | {:.1e} | {:.2f} |\n",
                        scene.title, tracer.name, result.hits, result.differ, result.wrong, quantile(0.5),
                        quantile(0.99), quantile(0.9999), quantile(1.0), result.worst,
                        HitComparison::quantile(result.place_errors, 0.9999), ray_count / seconds * 1e-6);
        const std::string prefix = "cast." + scene.name;
        report.add(prefix + ".t_error_p9999" + tracer.suffix, quantile(0.9999), "of |origin| + t |direction|",
                   "float64 hierarchy", tracer.device);
        report.add(prefix + ".wrong" + tracer.suffix, static_cast<double>(result.wrong), "rays", "float64 hierarchy",
                   tracer.device);
        writeCurve(report.folder() / fmt::format("t_error_{}{}.dat", scene.name, tracer.suffix), result.t_errors);
    }
}

void countLeaks(Report& report, std::span<const Tracer> list, std::string& table) {
    const Mesh sphere = createSphere(1.0f, 5);
    const auto at_corners = test::raysAtCorners(sphere, leak_rays, 0.5);
    const auto at_edges = test::raysAtEdges(sphere, leak_rays, 0.5);
    for (const Tracer& tracer : list) {
        std::array<uint64_t, 2> leaks = {};
        for (size_t i = 0; i < 2; i++) {
            double seconds = 0.0;
            const std::vector<RayHit> hits = tracer.cast(sphere, i == 0 ? at_corners : at_edges, seconds);
            leaks[i] = static_cast<uint64_t>(
                std::count_if(hits.begin(), hits.end(), [](const RayHit& hit) { return !hit.isHit(); }));
            report.add(fmt::format("cast.leaks_{}{}", i == 0 ? "corners" : "edges", tracer.suffix),
                       static_cast<double>(leaks[i]), fmt::format("of {} rays", leak_rays), "a closed mesh: none",
                       tracer.device);
        }
        table += fmt::format("| {} | {} | {} |\n", tracer.name, leaks[0], leaks[1]);
    }
}

void run(Report& report) {
    const std::vector<Tracer> list = tracers();
    const std::string machine = fmt::format("{}; {}, one thread.\n\n", list.front().device, test::embreeName());
    std::string table = machine +
                        "| mesh | tracer | hits | differ | wrong | t error, median | 99 % | 99.99 % | largest | of its "
                        "bound | place, 99.99 % | million rays a second |\n"
                        "|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for (const Scene& scene : scenes()) compareScene(report, scene, list, table);
    check(writeTextFile(report.folder() / "hits.md", table));
    std::string leaks = machine + "| tracer | aimed at corners | aimed at edges |\n|---|---|---|\n";
    countLeaks(report, list, leaks);
    check(writeTextFile(report.folder() / "leaks.md", leaks));
}

std::vector<std::string> figureNames() {
    std::vector<std::string> names;
    for (const char* suffix : {"", ".driver", ".embree", ".embree_robust"})
        for (const char* figure : {"bunny.t_error_p9999", "bunny.wrong", "torus_100k.t_error_p9999", "torus_100k.wrong",
                                   "leaks_corners", "leaks_edges"})
            names.push_back(fmt::format("cast.{}{}", figure, suffix));
    return names;
}

}  // namespace

Benchmark castBenchmark() { return {figureNames(), run}; }

}  // namespace glint::bench
