// tracing.{bunny,100k,1m}.{camera,bounce}.software_over_embree1: rays a second of Glint's own engine over those of
// Embree's rtcIntersect1 on two threads, in turns in one run. tracing.build.{quality,fast,refit}: millions of triangles
// a second of the builders, on the 1m mesh. tracing.leaks.software: rays at edges that slip through.

#include "accuracy/embree.h"
#include "bench/tracing_pipeline.h"
#include "bench/tracing_scenes.h"
#include "support/hierarchies.h"
#include "support/reference.h"

#include <glint/geometry/primitives.h>
#include <glint/tracing/detail/hierarchy.h>

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <ctime>

namespace glint::bench {

namespace {

using detail::BuildMode;
using detail::Hierarchy;

constexpr uint32_t rounds = 9;

/// A kernel over one set of rays.
class Batch {
public:
    Batch(const Device& device, const Kernel& kernel, const Buffer& hierarchy, std::span<const Ray> rays)
        : device_(device),
          kernel_(kernel),
          hierarchy_(hierarchy),
          count_(static_cast<uint32_t>(rays.size())),
          rays_(device_.createBuffer(Buffer::FlagStorage, rays)),
          hits_(device_.createBuffer(Buffer::FlagStorage, rays.size() * sizeof(BatchHit))) {}

    void trace(uint32_t threads) {
        Compute compute = device_.createCompute();
        compute.setKernel(kernel_);
        compute.setUniform(0, std::array<uint32_t, 4>{count_, 0, 0, 0});
        compute.setTexelBuffer(0, hierarchy_, FormatRGBAu32);
        compute.setStorageBuffers(0, {rays_, hits_});
        compute.dispatch(threads);
        check(device_.submit(compute));
        check(device_.finish());
    }

    std::vector<RayHit> hits() {
        const auto all = *check(device_.read<BatchHit>(hits_));
        std::vector<RayHit> hits(all.size());
        std::transform(all.begin(), all.end(), hits.begin(), [](const BatchHit& each) { return each.hit; });
        return hits;
    }

private:
    Device device_;
    Kernel kernel_;
    Buffer hierarchy_;
    uint32_t count_;
    Buffer rays_;
    Buffer hits_;
};

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
    std::string macros;
    uint32_t rays_per_thread = 1;
};

Kernel createKernel(const Device& device, const Variant& variant) {
    Device maker = device;
    Kernel kernel = maker.createKernel();
    kernel.createShaderGLSL("#include <glint/tracing/batch.h>\n", "GLINT_TRACING_MEMORY=0;" + variant.macros);
    check(kernel.create());
    return kernel;
}

/// Seconds of all the process' threads on processors. Both sides keep two threads busy, so half of it is the time that
/// they take where nothing else runs.
double processSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct RaceTimes {
    Times wall;
    Times process;

    template <class Work>
    void take(const Work& work, bool counts) {
        const double wall_begin = wallSeconds();
        const double process_begin = processSeconds();
        work();
        if (!counts) return;
        wall.values.push_back(wallSeconds() - wall_begin);
        process.values.push_back(0.5 * (processSeconds() - process_begin));
    }
};

/// Traces one set of rays by all variants and by Embree in turns. Returns their times: Embree first.
std::vector<RaceTimes> race(const Device& device, const Buffer& hierarchy, const TracingScene& scene, const char* kind,
                            std::span<const Ray> rays, std::span<const Variant> variants, uint32_t turns) {
    std::vector<Kernel> kernels;
    std::vector<std::unique_ptr<Batch>> batches;
    for (const Variant& variant : variants) {
        kernels.push_back(createKernel(device, variant));
        batches.push_back(std::make_unique<Batch>(device, kernels.back(), hierarchy, rays));
    }
    std::vector<RayHit> reference(rays.size());
    test::EmbreeScene(scene.mesh, test::EmbreeMode::Robust).cast(rays, reference, 2);
    const test::EmbreeScene embree(scene.mesh, test::EmbreeMode::Fast);
    std::vector<RayHit> hits(rays.size());
    std::vector<RaceTimes> times(variants.size() + 1);
    for (uint32_t turn = 0; turn <= turns; turn++) {
        // The driver compiles at the first dispatch, which does not count.
        times[0].take([&] { embree.cast(rays, hits, 2); }, turn > 0);
        for (size_t i = 0; i < variants.size(); i++) {
            const auto count = static_cast<uint32_t>(rays.size());
            const uint32_t threads = (count + variants[i].rays_per_thread - 1) / variants[i].rays_per_thread;
            times[i + 1].take([&] { batches[i]->trace(threads); }, turn > 0);
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
    for (size_t i = 0; i < variants.size(); i++)
        compare(batches[i]->hits(), reference).print("    " + variants[i].name);
    std::fflush(stdout);
    return times;
}

void runTracing(Report& report) {
    const Device device = createDevice();
    const Variant variants[] = {{"one ray a lane", "GLINT_TRACING_REFILL=0"},
                                {"refilling", "GLINT_TRACING_REFILL=1;GLINT_TRACING_RAYS=16", 16}};
    for (const char* name : {"bunny", "100k", "1m"}) {
        const TracingScene scene = makeTracingScene(name);
        const Hierarchy hierarchy = test::hierarchyOf(scene.mesh, BuildMode::Quality, &ThreadPool::shared());
        Device owner = device;
        const Buffer buffer = owner.createBuffer(Buffer::FlagTexel, hierarchy.texels.data(), hierarchy.bytes());
        const auto camera = race(device, buffer, scene, "camera", scene.camera, variants, rounds);
        const auto bounce = race(device, buffer, scene, "bounce", scene.bounce, variants, rounds);
        const std::string figure = fmt::format("tracing.{}.", name);
        report.add(figure + "camera.software_over_embree1", camera[0].wall.minimum() / camera[1].wall.minimum(),
                   "ratio", "Embree's rtcIntersect1 on two threads", deviceName(device));
        report.add(figure + "bounce.software_over_embree1", bounce[0].wall.minimum() / bounce[1].wall.minimum(),
                   "ratio", "Embree's rtcIntersect1 on two threads", deviceName(device));
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
    const Kernel kernel = createKernel(device, {"coherent", ""});
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
        Batch batch(device, kernel, buffer, rays);
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
    Times quality;
    Times fast;
    Times refit;
    for (uint32_t round = 0; round < 5; round++) {
        double begin = wallSeconds();
        const Hierarchy slow = test::hierarchyOf(scene.mesh, BuildMode::Quality, &pool);
        quality.values.push_back(wallSeconds() - begin);
        begin = wallSeconds();
        Hierarchy quick = test::hierarchyOf(scene.mesh, BuildMode::Fast, &pool);
        fast.values.push_back(wallSeconds() - begin);
        begin = wallSeconds();
        check(detail::refitHierarchy(quick, std::span(&geometry, 1), &pool));
        refit.values.push_back(wallSeconds() - begin);
        if (round != 0) continue;
        const Hierarchy& fast_built = quick;
        for (const auto& [name, hierarchy] : {std::pair{"quality", &slow}, std::pair{"fast", &fast_built}}) {
            fmt::print(
                "  {}: {:.1f} bytes a triangle, {:.1f} at the peak of the build; {} nodes, {:.2f} children each, "
                "{} levels\n",
                name, double(hierarchy->bytes()) / geometry.triangles,
                double(hierarchy->build_bytes) / geometry.triangles, hierarchy->nodes,
                double(hierarchy->nodes - 1 + hierarchy->records) / hierarchy->nodes, hierarchy->depth);
        }
    }
    printTimes("quality", quality);
    printTimes("fast", fast);
    printTimes("refit", refit);
    const std::string machine = fmt::format("{}, {} threads", processorName(), pool.size());
    report.add("tracing.build.quality", million / quality.minimum(), "million triangles a second", "nothing", machine);
    report.add("tracing.build.fast", million / fast.minimum(), "million triangles a second", "nothing", machine);
    report.add("tracing.build.refit", million / refit.minimum(), "million triangles a second", "nothing", machine);
}

}  // namespace

Benchmark tracingSoftwareBenchmark() {
    return {{"tracing.bunny.camera.software_over_embree1", "tracing.bunny.bounce.software_over_embree1",
             "tracing.100k.camera.software_over_embree1", "tracing.100k.bounce.software_over_embree1",
             "tracing.1m.camera.software_over_embree1", "tracing.1m.bounce.software_over_embree1"},
            runTracing};
}

Benchmark tracingLeaksBenchmark() { return {{"tracing.leaks.software"}, runLeaks}; }

Benchmark tracingBuildBenchmark() {
    return {{"tracing.build.quality", "tracing.build.fast", "tracing.build.refit"}, runBuilds};
}

}  // namespace glint::bench
