// tracing.{build,refit}.device.{bunny,100k,1m}: millions of triangles a second of the builder on the device, from the
// submission until the device is done, beside the host's builders. tracing.device.{bunny,100k,1m}.{camera,bounce}: rays
// a second through its hierarchies over those through the host's quality ones.

#include "bench/tracing_scenes.h"
#include "support/device_builder.h"
#include "support/hierarchies.h"

#include <fmt/format.h>

#include <array>

namespace glint::bench {

namespace {

using detail::BuildMode;
using detail::Hierarchy;

constexpr uint32_t rounds = 5;

/// Millions of triangles a second.
struct Rates {
    Times build;
    Times refit;
};

/// Builds and refits on the device, and returns the hierarchy.
Hierarchy buildOnDevice(Device device, const Mesh& mesh, Rates& rates) {
    const detail::DeviceInput input = {detail::Hierarchy::Kind::Triangles, {test::deviceGeometryOf(mesh)}};
    const detail::DeviceSizes sizes = *check(detail::deviceSizes(input));
    test::DeviceBuilder builder(device);
    const test::GeometryBuffers buffers = {builder.createStorage(std::as_bytes(std::span(mesh.positions))),
                                           builder.createStorage(std::as_bytes(std::span(mesh.indices)))};
    const Buffer heap = builder.createHeap(sizes.texels);
    const uint32_t alignment = device.getFeatures().storageAlignment;
    const detail::BuildPlan build = *check(detail::planBuild(input, 0, alignment));
    const detail::BuildPlan refit = *check(detail::planRefit(input, sizes.nodes, 0, alignment));
    const Buffer scratch = device.createBuffer(Buffer::FlagStorage, std::max(build.scratch, refit.scratch));
    check(device.finish());
    for (uint32_t round = 0; round <= rounds; round++) {
        for (const auto& [plan, times] : {std::pair{&build, &rates.build}, std::pair{&refit, &rates.refit}}) {
            Compute compute = device.createCompute();
            builder.record(compute, *plan, heap, scratch, std::span(&buffers, 1));
            const double begin = wallSeconds();
            check(device.submit(compute));
            check(device.finish());
            // The driver compiles at the first dispatch, which does not count.
            if (round > 0) times->values.push_back(wallSeconds() - begin);
        }
    }
    Hierarchy hierarchy = builder.read(heap, 0);
    const auto triangles = static_cast<double>(mesh.triangleCount());
    fmt::print(
        "  on the device: {:.1f} bytes a triangle, {} nodes, {:.2f} children each; {:.1f} bytes of scratch memory\n",
        double(hierarchy.bytes()) / triangles, hierarchy.nodes,
        double(hierarchy.nodes - 1 + hierarchy.records) / hierarchy.nodes, double(build.scratch) / triangles);
    return hierarchy;
}

/// Rounds of rays through several hierarchies in turns; seconds of each.
std::vector<Times> race(Device device, std::span<const Hierarchy* const> hierarchies, std::span<const Ray> rays) {
    Kernel kernel = device.createKernel();
    kernel.createShaderGLSL("#include <glint/tracing/batch.h>\n", "GLINT_TRACING_MEMORY=0");
    check(kernel.create());
    const Buffer ray_buffer = device.createBuffer(Buffer::FlagStorage, rays);
    const Buffer hits = device.createBuffer(Buffer::FlagStorage, 32 * rays.size());
    std::vector<Buffer> buffers;
    for (const Hierarchy* each : hierarchies)
        buffers.push_back(device.createBuffer(Buffer::FlagTexel, each->texels.data(), each->bytes()));
    std::vector<Times> times(hierarchies.size());
    for (uint32_t round = 0; round <= rounds; round++) {
        for (size_t i = 0; i < buffers.size(); i++) {
            Compute compute = device.createCompute();
            compute.setKernel(kernel);
            compute.setUniform(0, std::array<uint32_t, 4>{static_cast<uint32_t>(rays.size()), 0, 0, 0});
            compute.setTexelBuffer(0, buffers[i], FormatRGBAu32);
            compute.setStorageBuffers(0, {ray_buffer, hits});
            compute.dispatch(rays.size());
            const double begin = wallSeconds();
            check(device.submit(compute));
            check(device.finish());
            if (round > 0) times[i].values.push_back(wallSeconds() - begin);
        }
    }
    return times;
}

void run(Report& report) {
    const Device device = createDevice();
    ThreadPool& pool = ThreadPool::shared();
    for (const char* name : {"bunny", "100k", "1m"}) {
        const TracingScene scene = makeTracingScene(name);
        const double million = static_cast<double>(scene.mesh.triangleCount()) * 1e-6;
        fmt::print("  {}\n", name);
        Rates rates;
        const Hierarchy ours = buildOnDevice(device, scene.mesh, rates);
        printTimes("build", rates.build);
        printTimes("refit", rates.refit);
        report.add(fmt::format("tracing.build.device.{}", name), million / rates.build.minimum(),
                   "million triangles a second", "nothing", deviceName(device));
        report.add(fmt::format("tracing.refit.device.{}", name), million / rates.refit.minimum(),
                   "million triangles a second", "nothing", deviceName(device));
        double begin = wallSeconds();
        Hierarchy fast = test::hierarchyOf(scene.mesh, BuildMode::Fast, &pool);
        const double fast_time = wallSeconds() - begin;
        const detail::TriangleGeometry geometry = test::geometryOf(scene.mesh);
        begin = wallSeconds();
        check(detail::refitHierarchy(fast, std::span(&geometry, 1), &pool));
        fmt::print("  million triangles a second: device {:.2f}, refit {:.2f}; host {:.2f}, refit {:.2f}\n",
                   million / rates.build.minimum(), million / rates.refit.minimum(), million / fast_time,
                   million / (wallSeconds() - begin));
        const Hierarchy quality = test::hierarchyOf(scene.mesh, BuildMode::Quality, &pool);
        for (const auto& [kind, rays] : {std::pair{"camera", &scene.camera}, std::pair{"bounce", &scene.bounce}}) {
            const Hierarchy* const all[] = {&quality, &fast, &ours};
            const std::vector<Times> times = race(device, all, *rays);
            const double millions = static_cast<double>(rays->size()) * 1e-6;
            fmt::print("  {}, million rays a second: quality {:.2f}, fast {:.2f}, device {:.2f}\n", kind,
                       millions / times[0].minimum(), millions / times[1].minimum(), millions / times[2].minimum());
            report.add(fmt::format("tracing.device.{}.{}", name, kind), times[0].minimum() / times[2].minimum(),
                       "ratio", "rays through the host's quality hierarchy", deviceName(device));
        }
    }
}

}  // namespace

Benchmark tracingDeviceBenchmark() {
    Benchmark benchmark;
    for (const char* name : {"bunny", "100k", "1m"}) {
        for (const char* figure : {"tracing.build.device.{}", "tracing.refit.device.{}", "tracing.device.{}.camera",
                                   "tracing.device.{}.bounce"})
            benchmark.figures.push_back(fmt::format(fmt::runtime(figure), name));
    }
    benchmark.run = run;
    return benchmark;
}

}  // namespace glint::bench
