// tracing.{bunny,100k,1m}.{camera,bounce}.software_over_embree1: rays a second of Glint's own engine over those of
// Embree's rtcIntersect1 on two threads, in turns in one run; tracing.instances.software_over_embree1, of camera rays,
// and tracing.instances.bounce. query_over_embree1: of queries, as rewritten shaders have them, of a top level with one
// instance in the first three scenes. tracing.build.{quality,fast,refit}: millions of triangles a second of the
// builders, on the 1m mesh. tracing.leaks.software: rays at edges that slip through.

#include "accuracy/embree.h"
#include "bench/tracing_batch.h"
#include "bench/tracing_scenes.h"
#include "support/allocations.h"
#include "support/hierarchies.h"
#include "support/reference.h"

#include <glint/geometry/primitives.h>
#include <glint/tracing/detail/hierarchy.h>

#include <fmt/format.h>
#include <malloc.h>

#include <array>
#include <cmath>
#include <ctime>

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

/// From the middle of a torus' tube at its corners and at points of its edges: a ray that meets nothing near to where
/// it was aimed at, at t = 1, has slipped through. (Directions are rounded, so rays pass on either side of what they
/// aim at.)
std::vector<Ray> raysAtEdges(const Mesh& torus, uint32_t count, uint64_t seed) {
    test::Random random(seed);
    std::vector<Ray> rays(count);
    for (uint32_t i = 0; i < count; i++) {
        const uint64_t triangle = random.below(torus.triangleCount());
        const Vector3d a(torus.positions[torus.indices[3 * triangle + i % 3]]);
        const Vector3d b(torus.positions[torus.indices[3 * triangle + (i + 1) % 3]]);
        const Vector3d target = i % 2 == 0 ? a : a + (b - a) * random.uniform();
        const double angle = std::atan2(target.y, target.x) + random.uniform(-0.2, 0.2);
        rays[i].origin = Vector3f(Vector3d(std::cos(angle), std::sin(angle), 0.0));
        rays[i].direction = Vector3f(target - Vector3d(rays[i].origin));
    }
    return rays;
}

void runLeaks(Report& report) {
    constexpr uint32_t batches = 16;
    const Device device = createDevice();
    const Mesh mesh = createTorus(1.0f, 0.4f, 100, 50);
    const Hierarchy hierarchy = test::hierarchyOf(mesh, BuildMode::Quality, &ThreadPool::shared());
    Device owner = device;
    const Buffer buffer = owner.createBuffer(Buffer::FlagTexel, hierarchy.texels.data(), hierarchy.bytes());
    const Kernel kernel = createRayKernel(device, batch_kernel, "");
    uint64_t leaks = 0;
    uint64_t embree_leaks = 0;
    uint64_t robust_leaks = 0;
    const test::EmbreeScene embree(mesh, test::EmbreeMode::Fast);
    const test::EmbreeScene robust(mesh, test::EmbreeMode::Robust);
    const auto count = [](std::span<const RayHit> hits) {
        return static_cast<uint64_t>(
            std::count_if(hits.begin(), hits.end(), [](const RayHit& hit) { return !hit.isHit() || hit.t > 1.01f; }));
    };
    for (uint32_t i = 0; i < batches; i++) {
        const std::vector<Ray> rays = raysAtEdges(mesh, 1u << 20, 100 + i);
        RayBatch batch(device, kernel, buffer, rays);
        batch.trace(static_cast<uint32_t>(rays.size()));
        leaks += count(batch.hits());
        if (i != 0) continue;
        std::vector<RayHit> hits(rays.size());
        embree.cast(rays, hits, 2);
        embree_leaks = count(hits);
        robust.cast(rays, hits, 2);
        robust_leaks = count(hits);
    }
    fmt::print("  {} of {} million rays; Embree {}, robust {} of the first million\n", leaks, batches, embree_leaks,
               robust_leaks);
    report.add("tracing.leaks.software", static_cast<double>(leaks), "rays",
               fmt::format("{} rays at corners and edges of a closed torus of 10,000 triangles", batches << 20),
               deviceName(device));
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

Benchmark tracingLeaksBenchmark() { return {{"tracing.leaks.software"}, runLeaks}; }

Benchmark tracingBuildBenchmark() {
    return {{"tracing.build.quality", "tracing.build.fast", "tracing.build.refit",
             "tracing.build.peak_bytes_per_triangle.quality", "tracing.build.peak_bytes_per_triangle.fast"},
            runBuilds};
}

}  // namespace glint::bench
