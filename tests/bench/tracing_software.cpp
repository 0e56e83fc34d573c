// tracing.{bunny,100k,1m}.{camera,bounce}.software_over_embree1: rays a second of Glint's own engine over those of
// Embree's rtcIntersect1 on two threads, in turns in one run; tracing.instances.software_over_embree1, of camera rays,
// and tracing.instances.bounce. query_over_embree1: of queries, as rewritten shaders have them, of a top level with one
// instance in the first three scenes. tracing.build.{quality,fast,refit}: millions of triangles a second of the
// builders, on the 1m mesh. tracing.leaks.{software,driver}: rays at corners and edges of closed meshes
// that slip through.

#include "accuracy/embree.h"
#include "bench/tracing_batch.h"
#include "bench/tracing_scenes.h"
#include "support/allocations.h"
#include "support/hierarchies.h"
#include "support/seam_rays.h"

#include <glint/tracing/detail/hierarchy.h>
#include <glint/tracing/detail/parallel.h>

#include <fmt/format.h>
#include <malloc.h>

#include <array>
#include <cmath>
#include <ctime>
#include <mutex>

namespace glint::bench {

namespace {

using detail::BuildMode;
using detail::Hierarchy;

constexpr uint32_t rounds = 9;

/// Differences to Embree's robust answers.
struct Differences {
    uint32_t missed = 0;  ///< hits that only Embree has
    uint32_t extra = 0;
    uint32_t primitives = 0;
    double largest = 0.0;  ///< relative difference in t

    void print(const std::string& label) const {
        fmt::print("  {}: against Embree robust {} missed, {} extra, {} other triangles, t within {:.1e}\n", label,
                   missed, extra, primitives, largest);
    }
};

Differences compare(std::span<const RayHit> ours, std::span<const RayHit> theirs) {
    Differences differences;
    for (size_t i = 0; i < ours.size(); i++) {
        if (ours[i].isHit() != theirs[i].isHit()) {
            (ours[i].isHit() ? differences.extra : differences.missed)++;
            continue;
        }
        if (!ours[i].isHit()) continue;
        differences.primitives += ours[i].primitive != theirs[i].primitive ? 1 : 0;
        differences.largest = std::max(differences.largest, std::abs(double(ours[i].t) - theirs[i].t) / theirs[i].t);
    }
    return differences;
}

struct Variant {
    std::string name;
    const char* kernel;
    std::string macros;
    bool has_instances = false;
    uint32_t rays_per_thread = 1;
};

const Variant mesh_variants[] = {
    {"one ray a lane", batch_kernel, ""},
    {"query", query_kernel, "DRIVER=0", true},
    {"refilling", batch_kernel, "GLINT_TRACING_REFILL=1;GLINT_TRACING_RAYS=16", false, 16},
};
const Variant instance_variants[] = {
    {"one ray a lane", batch_kernel, "GLINT_TRACING_LEVELS=2", true},
    {"query", query_kernel, "DRIVER=0", true},
};

/// What the kernels read: the mesh's hierarchy, and the same below a top level, of one instance if the scene has none.
struct Structures {
    Buffer mesh;
    Buffer instances;

    Structures(const Device& device, const TracingScene& scene) {
        const Hierarchy hierarchy = test::hierarchyOf(scene.mesh, BuildMode::Quality, &ThreadPool::shared());
        std::vector<Transform3x4> transforms = scene.instances;
        if (transforms.empty()) transforms.resize(1);
        const std::vector<detail::Texel> texels = test::instancesOf(hierarchy, transforms, &ThreadPool::shared());
        Device owner = device;
        mesh = owner.createBuffer(Buffer::FlagTexel, hierarchy.texels.data(), hierarchy.bytes());
        instances = owner.createBuffer(Buffer::FlagTexel, std::span(texels));
    }
};

/// Traces one set of rays by all variants and by Embree in turns. Returns their times: Embree first.
std::vector<RaceTimes> race(const Device& device, const Structures& structures, const TracingScene& scene,
                            const char* kind, std::span<const Ray> rays, std::span<const Variant> variants) {
    std::vector<RayBatch> batches;
    for (const Variant& variant : variants) {
        const Kernel kernel = createRayKernel(device, variant.kernel, variant.macros);
        batches.emplace_back(device, kernel, variant.has_instances ? structures.instances : structures.mesh, rays);
    }
    std::vector<RayHit> reference(rays.size());
    test::EmbreeScene(scene.mesh, test::EmbreeMode::Robust, scene.instances).cast(rays, reference, 2);
    const test::EmbreeScene embree(scene.mesh, test::EmbreeMode::Fast, scene.instances);
    std::vector<RayHit> hits(rays.size());
    std::vector<RaceTimes> times(variants.size() + 1);
    for (uint32_t turn = 0; turn <= rounds; turn++) {
        // The driver compiles at the first dispatch, which does not count.
        times[0].take([&] { embree.cast(rays, hits, 2); }, turn > 0);
        for (size_t i = 0; i < variants.size(); i++) {
            const auto count = static_cast<uint32_t>(rays.size());
            const uint32_t threads = (count + variants[i].rays_per_thread - 1) / variants[i].rays_per_thread;
            times[i + 1].take([&] { batches[i].trace(threads); }, turn > 0);
        }
    }
    const double million = static_cast<double>(rays.size()) * 1e-6;
    fmt::print("  {} {}, million rays a second: best, (median), by processor time\n", scene.name, kind);
    for (size_t i = 0; i < times.size(); i++) {
        const RaceTimes& each = times[i];
        fmt::print("    {:<24} {:6.2f} ({:5.2f}) {:6.2f}", i == 0 ? "Embree" : variants[i - 1].name,
                   million / each.wall.minimum(), million / each.wall.median(), million / each.process.minimum());
        fmt::print("   over Embree {:.3f} ({:.3f}) {:.3f}\n", times[0].wall.minimum() / each.wall.minimum(),
                   times[0].wall.median() / each.wall.median(), times[0].process.minimum() / each.process.minimum());
    }
    for (size_t i = 0; i < variants.size(); i++) compare(batches[i].hits(), reference).print("    " + variants[i].name);
    std::fflush(stdout);
    return times;
}

constexpr const char* tracing_scenes[] = {"bunny", "100k", "1m", "instances"};

/// "tracing.100k.bounce.query_over_embree1"
std::string figureName(const std::string& scene, const std::string& kind, const char* what) {
    const bool is_plain = scene == "instances" && kind == "camera";
    return fmt::format("tracing.{}.{}{}_over_embree1", scene, is_plain ? "" : kind + ".", what);
}

void runTracing(Report& report) {
    const Device device = createDevice();
    for (const char* name : tracing_scenes) {
        if (!report.wants(fmt::format("tracing.{}.", name))) continue;
        const TracingScene scene = makeTracingScene(name);
        const Structures structures(device, scene);
        for (const char* kind : {"camera", "bounce"}) {
            const auto& rays = std::string_view(kind) == "camera" ? scene.camera : scene.bounce;
            const std::span<const Variant> variants =
                scene.instances.empty() ? std::span<const Variant>(mesh_variants) : instance_variants;
            const std::vector<RaceTimes> times = race(device, structures, scene, kind, rays, variants);
            const auto add = [&](const char* what, size_t variant) {
                report.add(figureName(name, kind, what), times[0].wall.minimum() / times[variant].wall.minimum(),
                           "ratio", "Embree's rtcIntersect1 on two threads", deviceName(device));
            };
            add("software", 1);
            add("query", 2);
        }
    }
}

/// Traces `count` rays at the seams of each closed mesh, `chunk` at a time; returns what leaks.
template <class Trace>
test::SeamLeaks seamLeaks(const test::ClosedMesh& mesh, uint64_t count, uint64_t seed, const Trace& trace) {
    constexpr uint32_t chunk = 1u << 20;
    constexpr uint32_t piece = 1u << 16;
    test::SeamLeaks leaks;
    for (uint64_t begin = 0; begin < count; begin += chunk) {
        const auto size = static_cast<uint32_t>(std::min<uint64_t>(chunk, count - begin));
        std::vector<Ray> rays(size);
        detail::parallelRanges(&ThreadPool::shared(), size, piece, [&](size_t first, size_t last) {
            const auto part = test::raysAtSeams(mesh, static_cast<uint32_t>(last - first), seed + begin + first);
            std::copy(part.begin(), part.end(), rays.begin() + static_cast<ptrdiff_t>(first));
        });
        const std::vector<RayHit> hits = trace(rays);
        std::mutex mutex;
        detail::parallelRanges(&ThreadPool::shared(), size, piece, [&](size_t first, size_t last) {
            const test::SeamLeaks part = test::countLeaks(mesh, std::span(rays).subspan(first, last - first),
                                                          std::span(hits).subspan(first, last - first));
            const std::lock_guard lock(mutex);
            leaks += part;
        });
    }
    return leaks;
}

void runLeaks(Report& report) {
    constexpr uint64_t rays = 100'000'000;
    constexpr uint64_t driver_rays = 1'000'000;
    Device device = createDevice();
    const Kernel kernel = createRayKernel(device, batch_kernel, "");
    const std::vector<test::ClosedMesh> meshes = test::closedMeshes();
    test::SeamLeaks ours;
    test::SeamLeaks driver;
    test::SeamLeaks embree;
    test::SeamLeaks robust;
    const Device driver_device = createDevice(TracingEngine::Driver);
    const bool has_driver = driver_device.getFeatures().computeTracing;
    for (size_t i = 0; i < meshes.size(); i++) {
        const test::ClosedMesh& mesh = meshes[i];
        const uint64_t seed = (i + 1) << 32;
        const auto share = [&](uint64_t all) { return all * (i + 1) / meshes.size() - all * i / meshes.size(); };
        const Hierarchy hierarchy = test::hierarchyOf(mesh.mesh, BuildMode::Quality, &ThreadPool::shared());
        const Buffer buffer = device.createBuffer(Buffer::FlagTexel, hierarchy.texels.data(), hierarchy.bytes());
        const test::SeamLeaks found = seamLeaks(mesh, share(rays), seed, [&](std::span<const Ray> some) {
            RayBatch batch(device, kernel, buffer, some);
            batch.trace(static_cast<uint32_t>(some.size()));
            return batch.hits();
        });
        ours += found;
        std::string line = fmt::format("  {:<14} {:>6} triangles: {} of {} rays leak", mesh.name,
                                       mesh.mesh.triangleCount(), found.all(), share(rays));
        if (has_driver) {
            RayCaster caster = std::move(*check(RayCaster::create(driver_device, mesh.mesh)));
            const test::SeamLeaks theirs = seamLeaks(mesh, share(driver_rays), seed, [&](std::span<const Ray> some) {
                return std::move(*check(caster.cast(some)));
            });
            driver += theirs;
            line += fmt::format("; of {}: driver {} ({} miss, {} beyond, {} wrong)", share(driver_rays), theirs.all(),
                                theirs.misses, theirs.beyond, theirs.wrong);
        }
        for (const bool is_robust : {false, true}) {
            const test::EmbreeScene scene(mesh.mesh, is_robust ? test::EmbreeMode::Robust : test::EmbreeMode::Fast);
            const test::SeamLeaks theirs = seamLeaks(mesh, share(driver_rays), seed, [&](std::span<const Ray> some) {
                std::vector<RayHit> hits(some.size());
                scene.cast(some, hits, 2);
                return hits;
            });
            (is_robust ? robust : embree) += theirs;
            line += fmt::format(", {} {}", is_robust ? "robust" : "Embree", theirs.all());
        }
        fmt::print("{}\n", line);
        std::fflush(stdout);
    }
    fmt::print("  all: {} of {}; driver {}, Embree {}, robust {} of {}\n", ours.all(), rays, driver.all(), embree.all(),
               robust.all(), driver_rays);
    const std::string what = "closed meshes of up to 20,480 triangles, aimed at corners and edges; float64";
    report.add("tracing.leaks.software", static_cast<double>(ours.all()), fmt::format("of {} rays", rays), what,
               deviceName(device));
    if (has_driver)
        report.add("tracing.leaks.driver", static_cast<double>(driver.all()), fmt::format("of {} rays", driver_rays),
                   what, deviceName(device));
}

void runBuilds(Report& report) {
    const TracingScene scene = makeTracingScene("1m");
    const detail::TriangleGeometry geometry = test::geometryOf(scene.mesh);
    const double million = static_cast<double>(geometry.triangles) * 1e-6;
    ThreadPool& pool = ThreadPool::shared();
    RaceTimes quality;
    RaceTimes fast;
    RaceTimes refit;
    for (uint32_t round = 0; round < 5; round++) {
        Hierarchy slow;
        Hierarchy quick;
        quality.take([&] { slow = test::hierarchyOf(scene.mesh, BuildMode::Quality, &pool); }, true);
        fast.take([&] { quick = test::hierarchyOf(scene.mesh, BuildMode::Fast, &pool); }, true);
        refit.take([&] { check(detail::refitHierarchy(quick, std::span(&geometry, 1), &pool)); }, true);
        if (round != 0) continue;
        for (const auto& [name, hierarchy] : {std::pair{"quality", &slow}, std::pair{"fast", &quick}}) {
            fmt::print("  {}: {:.1f} bytes a triangle; {} nodes, {:.2f} children each, {} levels\n", name,
                       double(hierarchy->bytes()) / geometry.triangles, hierarchy->nodes,
                       double(hierarchy->nodes - 1 + hierarchy->records) / hierarchy->nodes, hierarchy->depth);
        }
    }
    const std::string machine = fmt::format("{}, {} threads", processorName(), pool.size());
    // Large blocks go back to the system when they are freed, as at the start of a program; else glibc keeps more and
    // more of them, and what is held says little about what is needed.
    ::mallopt(M_MMAP_THRESHOLD, 1 << 20);
    for (const auto& [name, mode] : {std::pair{"quality", BuildMode::Quality}, std::pair{"fast", BuildMode::Fast}}) {
        uint64_t stated = 0;
        const uint64_t peak =
            test::peakMemory([&] { stated = test::hierarchyOf(scene.mesh, mode, &pool).build_bytes; });
        report.add(fmt::format("tracing.build.peak_bytes_per_triangle.{}", name),
                   static_cast<double>(peak) / geometry.triangles, "bytes",
                   fmt::format("{:.1f} as the builder counts", static_cast<double>(stated) / geometry.triangles),
                   machine);
    }
    for (const auto& [name, times] :
         {std::pair{"quality", &quality}, std::pair{"fast", &fast}, std::pair{"refit", &refit}}) {
        fmt::print("  {}: by processor time {:.2f}\n", name, million / times->process.minimum());
        report.add(fmt::format("tracing.build.{}", name), million / times->wall.minimum(), "million triangles a second",
                   "nothing", machine);
    }
}

}  // namespace

Benchmark tracingSoftwareBenchmark() {
    Benchmark benchmark = {{}, runTracing};
    for (const char* scene : tracing_scenes) {
        for (const char* kind : {"camera", "bounce"}) {
            for (const char* what : {"software", "query"}) benchmark.figures.push_back(figureName(scene, kind, what));
        }
    }
    return benchmark;
}

Benchmark tracingLeaksBenchmark() { return {{"tracing.leaks.software", "tracing.leaks.driver"}, runLeaks}; }

Benchmark tracingBuildBenchmark() {
    return {{"tracing.build.quality", "tracing.build.fast", "tracing.build.refit",
             "tracing.build.peak_bytes_per_triangle.quality", "tracing.build.peak_bytes_per_triangle.fast"},
            runBuilds};
}

}  // namespace glint::bench
