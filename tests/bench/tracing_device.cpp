// tracing.{build,refit}.device.{bunny,100k,1m}: millions of triangles a second of the builder on the device, from the
// submission until the device is done, beside the host's builders. tracing.device.{bunny,100k,1m}.{camera,bounce}: rays
// a second through its hierarchies over those through the host's quality ones. All with the device's form of nodes.

#include "bench/tracing_scenes.h"
#include "support/device_builder.h"
#include "support/hierarchies.h"

#include <fmt/format.h>

#include <array>
#include <ctime>

namespace glint::bench {

namespace {

using detail::BuildMode;
using detail::Hierarchy;
using detail::NodeForm;

constexpr uint32_t rounds = 5;

NodeForm formOf(const Device& device) { return detail::nodeFormOf(device.getInfo().cpu); }

/// Wall clock, and seconds of all the process' threads on two processors: what lavapipe and the host's builders take
/// where nothing else runs.
struct Clocks {
    Times wall;
    Times process;

    template <class Work>
    void take(const Work& work, bool counts) {
        const double wall_begin = wallSeconds();
        const std::clock_t process_begin = std::clock();
        work();
        if (!counts) return;
        wall.values.push_back(wallSeconds() - wall_begin);
        process.values.push_back(0.5 * static_cast<double>(std::clock() - process_begin) / CLOCKS_PER_SEC);
    }
    void print(std::string_view label, double millions) const {
        fmt::print("    {:<14} {:6.2f} ({:6.2f} by processor time)\n", label, millions / wall.minimum(),
                   millions / process.minimum());
    }
};

void play(Device device, Compute compute) {
    check(device.submit(compute));
    check(device.finish());
}

/// Builds and refits on the device and on the host, in turns.
struct Builders {
    Clocks device_build;
    Clocks device_refit;
    Clocks host_build;
    Clocks host_refit;

    Hierarchy ours;
    Hierarchy fast;

    Builders(Device device, const Mesh& mesh) {
        const detail::DeviceInput input = {Hierarchy::Kind::Triangles, {test::deviceGeometryOf(mesh)}, formOf(device)};
        const detail::DeviceSizes sizes = *check(detail::deviceSizes(input));
        test::DeviceBuilder builder(device, test::HeapForm::Texels, input.form);
        const test::GeometryBuffers buffers = {builder.createStorage(std::as_bytes(std::span(mesh.positions))),
                                               builder.createStorage(std::as_bytes(std::span(mesh.indices)))};
        const Buffer heap = builder.createHeap(sizes.texels);
        const uint32_t alignment = device.getFeatures().storageAlignment;
        const detail::BuildPlan build = *check(detail::planBuild(input, 0, alignment));
        const detail::BuildPlan refit = *check(detail::planRefit(input, sizes.nodes, 0, alignment));
        const Buffer scratch = device.createBuffer(Buffer::FlagStorage, std::max(build.scratch, refit.scratch));
        const detail::TriangleGeometry geometry = test::geometryOf(mesh);
        check(device.finish());
        for (uint32_t round = 0; round <= rounds; round++) {
            // The driver compiles at the first dispatch, which does not count.
            const bool counts = round > 0;
            for (const auto& [plan, clocks] : {std::pair{&build, &device_build}, std::pair{&refit, &device_refit}}) {
                Compute compute = device.createCompute();
                builder.record(compute, *plan, heap, scratch, std::span(&buffers, 1));
                clocks->take([&] { play(device, std::move(compute)); }, counts);
            }
            host_build.take([&] { fast = test::hierarchyOf(mesh, BuildMode::Fast, &ThreadPool::shared(), input.form); },
                            counts);
            host_refit.take(
                [&] { check(detail::refitHierarchy(fast, std::span(&geometry, 1), &ThreadPool::shared())); }, counts);
        }
        ours = builder.read(heap, 0);
        const auto triangles = static_cast<double>(mesh.triangleCount());
        fmt::print(
            "    {:.1f} bytes a triangle, {} nodes, {:.2f} children each; {:.0f} bytes of scratch memory, {:.0f} "
            "for refitting\n",
            double(ours.bytes()) / triangles, ours.nodes, double(ours.nodes - 1 + ours.records) / ours.nodes,
            double(build.scratch) / triangles, double(refit.scratch) / triangles);
    }
};

/// Rounds of rays through several hierarchies in turns.
std::vector<Clocks> race(Device device, std::span<const Hierarchy* const> hierarchies, std::span<const Ray> rays) {
    Kernel kernel = device.createKernel();
    kernel.createShaderGLSL(
        "#include <glint/tracing/batch.h>\n",
        fmt::format("GLINT_TRACING_MEMORY=0;GLINT_TRACING_NODES={}", static_cast<int>(formOf(device))));
    check(kernel.create());
    const Buffer ray_buffer = device.createBuffer(Buffer::FlagStorage, rays);
    const Buffer hits = device.createBuffer(Buffer::FlagStorage, 32 * rays.size());
    std::vector<Buffer> buffers;
    for (const Hierarchy* each : hierarchies)
        buffers.push_back(device.createBuffer(Buffer::FlagTexel, each->texels.data(), each->bytes()));
    std::vector<Clocks> clocks(hierarchies.size());
    for (uint32_t round = 0; round <= rounds; round++) {
        for (size_t i = 0; i < buffers.size(); i++) {
            Compute compute = device.createCompute();
            compute.setKernel(kernel);
            compute.setUniform(0, std::array<uint32_t, 4>{static_cast<uint32_t>(rays.size()), 0, 0, 0});
            compute.setTexelBuffer(0, buffers[i], FormatRGBAu32);
            compute.setStorageBuffers(0, {ray_buffer, hits});
            compute.dispatch(rays.size());
            clocks[i].take([&] { play(device, std::move(compute)); }, round > 0);
        }
    }
    return clocks;
}

void run(Report& report) {
    const Device device = createDevice();
    for (const char* name : {"bunny", "100k", "1m"}) {
        const TracingScene scene = makeTracingScene(name);
        const double million = static_cast<double>(scene.mesh.triangleCount()) * 1e-6;
        fmt::print("  {}: million triangles a second\n", name);
        const Builders builders(device, scene.mesh);
        builders.device_build.print("device build", million);
        builders.device_refit.print("device refit", million);
        builders.host_build.print("host build", million);
        builders.host_refit.print("host refit", million);
        report.add(fmt::format("tracing.build.device.{}", name), million / builders.device_build.wall.minimum(),
                   "million triangles a second", "nothing", deviceName(device));
        report.add(fmt::format("tracing.refit.device.{}", name), million / builders.device_refit.wall.minimum(),
                   "million triangles a second", "nothing", deviceName(device));
        const Hierarchy quality =
            test::hierarchyOf(scene.mesh, BuildMode::Quality, &ThreadPool::shared(), formOf(device));
        for (const auto& [kind, rays] : {std::pair{"camera", &scene.camera}, std::pair{"bounce", &scene.bounce}}) {
            const Hierarchy* const all[] = {&quality, &builders.fast, &builders.ours};
            const std::vector<Clocks> clocks = race(device, all, *rays);
            const double millions = static_cast<double>(rays->size()) * 1e-6;
            fmt::print("  {} {}: million rays a second\n", name, kind);
            clocks[0].print("host, quality", millions);
            clocks[1].print("host, fast", millions);
            clocks[2].print("device", millions);
            report.add(fmt::format("tracing.device.{}.{}", name, kind),
                       clocks[0].wall.minimum() / clocks[2].wall.minimum(), "ratio",
                       "rays through the host's quality hierarchy", deviceName(device));
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
