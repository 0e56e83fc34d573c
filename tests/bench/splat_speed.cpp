// splat.*.over_plain: the splat renderer against its plain variant, in one run. splat.gpu.*: frames a second on a GPU,
// and the times of the passes, for a scene and its copies on a grid.

#include "bench/bench.h"
#include "bench/splat_views.h"

#include <glint/graphics/splat_renderer.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace glint::bench {

namespace {

struct Size {
    const char* name;
    uint32_t width, height;
};
constexpr Size sizes[] = {{"1080p", 1920, 1080}, {"4k", 3840, 2160}};
/// Copies of a scene of 31 thousand: about that, 0.5, 2 and 6 million.
constexpr struct {
    const char* name;
    uint32_t copies;
} scenes[] = {{"31k", 1}, {"500k", 16}, {"2m", 64}, {"6m", 192}};
constexpr const char* views[] = {"whole", "close"};

/// A renderer, and what it draws into.
struct Frame {
    SplatRenderer renderer;
    Texture color;

    Frame(Device& device, const Size& size, const SplatRenderer::Options& options) {
        check(renderer.create(device, options));
        color = device.createTexture2D(FormatRGBAf16, size.width, size.height, Texture::FlagSurface);
        check(color);
    }
    void submit(Device& device, const Camera& camera, const SplatModel& model) {
        Compute compute = device.createCompute();
        renderer.draw(compute, camera, std::array{SplatRenderer::Instance{model}}, {color, {}, {}});
        check(device.submit(compute));
    }
    /// With the wait for its end.
    double seconds(Device& device, const Camera& camera, const SplatModel& model) {
        check(device.finish());
        const double begin = wallSeconds();
        submit(device, camera, model);
        check(device.finish());
        return wallSeconds() - begin;
    }
};

void compareWithPlain(Report& report, Device& device, const test::SplatScene& scene) {
    constexpr uint32_t rounds = 7;
    constexpr Size size = {"", 1280, 720};
    const SplatModel model(device, scene.splats);
    check(model);
    SplatRenderer::Options plain;
    plain.method = SplatRenderer::MethodPlain;
    Frame frames[] = {Frame(device, size, {}), Frame(device, size, plain)};
    Times times[2];
    for (uint32_t round = 0; round < rounds + 2; round++)
        for (size_t i = 0; i < 2; i++) {
            const double seconds = frames[i].seconds(device, scene.camera, model);
            // Kernels are compiled in the first round, and lists have grown after it.
            if (Status status = frames[i].renderer.check(); !status && round > 0) check(status);
            if (round > 1) times[i].values.push_back(seconds);
        }
    fmt::print("{}, {} splats, {}x{}\n", scene.name, scene.splats.size(), size.width, size.height);
    for (size_t i = 0; i < 2; i++) {
        const SplatRenderer::Statistics statistics = frames[i].renderer.getStatistics();
        printTimes(fmt::format("  {}, {} entries", i == 0 ? "tiles" : "plain", statistics.entries), times[i]);
    }
    report.add(fmt::format("splat.{}.over_plain", scene.name), times[1].median() / times[0].median(), "ratio of speeds",
               "one pixel a thread, square bounds", deviceName(device));
}

/// Copies side by side on the ground, which is the plane of x and z: the scene's up is -Y.
Splats replicate(const Splats& scene, uint32_t copies, float pitch) {
    Splats result;
    result.degree = scene.degree;
    const auto side = static_cast<uint32_t>(std::ceil(std::sqrt(static_cast<double>(copies))));
    for (uint32_t i = 0; i < copies; i++) {
        const Vector3f offset(static_cast<float>(i % side) * pitch, 0, static_cast<float>(i / side) * pitch);
        for (const Vector3f& position : scene.positions) result.positions.push_back(position + offset);
        result.scales.insert(result.scales.end(), scene.scales.begin(), scene.scales.end());
        result.rotations.insert(result.rotations.end(), scene.rotations.begin(), scene.rotations.end());
        result.opacities.insert(result.opacities.end(), scene.opacities.begin(), scene.opacities.end());
        result.harmonics.insert(result.harmonics.end(), scene.harmonics.begin(), scene.harmonics.end());
    }
    return result;
}

/// All of the copies from above, or from low above the middle of them towards the horizon.
Camera cameraOf(const BoundBox& box, float pitch, bool is_close, const Size& size) {
    const Vector3f center = box.center();
    const float extent = std::max(box.size().x, box.size().z);
    const float unit = pitch / 2.06f;
    const Vector3f from = is_close ? center + Vector3f(0.5f, -0.45f, -0.9f) * unit
                                   : center + Vector3f(0.3f, -0.8f, -0.6f) * (extent * 0.8f + 0.3f * unit);
    Camera camera;
    camera.lookAt(from, is_close ? from + Vector3f(-0.45f, 0.28f, 1.0f) : center, {0, -1, 0});
    return camera.perspective(50.0f, static_cast<float>(size.width) / static_cast<float>(size.height));
}

void measureGpu(Report& report, Device& device, const std::string& name, const Camera& camera, const Size& size,
                const SplatModel& model) {
    constexpr uint32_t rounds = 31;
    SplatRenderer::Options options;
    options.timed = true;
    Frame frame(device, size, options);
    // Kernels are compiled, lists grow; then clocks rise, which they do under load alone.
    for (int round = 0; round < 4; round++) {
        frame.submit(device, camera, model);
        if (Status status = frame.renderer.check(); !status && status.error().id() != "splats.capacity") check(status);
    }
    for (const double end = wallSeconds() + 0.5; wallSeconds() < end; check(device.finish()))
        for (int i = 0; i < 20; i++) frame.submit(device, camera, model);
    Times times[SplatRenderer::PassCount], whole;
    for (uint32_t round = 0; round < rounds; round++) {
        frame.submit(device, camera, model);
        const auto passes = *check(frame.renderer.getTimes());
        double sum = 0.0;
        for (size_t i = 0; i < passes.size(); i++) {
            times[i].values.push_back(static_cast<double>(passes[i]) * 1e-9);
            sum += times[i].values.back();
        }
        whole.values.push_back(sum);
    }
    check(frame.renderer.check());
    const SplatRenderer::Statistics statistics = frame.renderer.getStatistics();
    fmt::print("{:24} {:7} visible {:8} entries {:6.3f} ms:", name, statistics.visible, statistics.entries,
               whole.median() * 1e3);
    for (uint8_t i = 0; i < SplatRenderer::PassCount; i++) {
        const char* pass = SplatRenderer::toString(static_cast<SplatRenderer::Pass>(i));
        fmt::print(" {} {:.3f}", pass, times[i].median() * 1e3);
        report.add(fmt::format("{}.{}", name, pass), times[i].median() * 1e3, "ms", "", deviceName(device));
    }
    fmt::print("\n");
    std::fflush(stdout);
    report.add(fmt::format("{}.frames", name), 1.0 / whole.median(), "frames a second", "", deviceName(device));
}

void measureGpu(Report& report) {
    Device device = createDevice();
    if (device.getInfo().cpu) {
        fmt::print("  for GPUs; {} is a CPU\n", device.getInfo().name);
        return;
    }
    const std::vector<test::SplatScene> known = splatViews();
    const Splats& scene = known.front().splats;
    const BoundBox box = scene.bounds();
    const float pitch = std::max(box.size().x, box.size().z);
    fmt::print("{}, {} splats, and copies of it\n", known.front().name, scene.size());
    for (const auto& [name, copies] : scenes) {
        const SplatModel model(device, replicate(scene, copies, pitch));
        check(model);
        for (const char* view : views)
            for (const Size& size : sizes)
                measureGpu(report, device, fmt::format("splat.gpu.{}.{}.{}", name, view, size.name),
                           cameraOf(model.getBounds(), pitch, view == views[1], size), size, model);
    }
}

}  // namespace

Benchmark splatSpeedBenchmark() {
    return {{"splat.playbot.over_plain", "splat.mesh.over_plain"}, [](Report& report) {
                Device device = createDevice();
                for (const test::SplatScene& scene : splatViews()) compareWithPlain(report, device, scene);
            }};
}

Benchmark splatGpuBenchmark() {
    std::vector<std::string> figures;
    for (const auto& scene : scenes)
        for (const char* view : views)
            for (const Size& size : sizes)
                figures.push_back(fmt::format("splat.gpu.{}.{}.{}.frames", scene.name, view, size.name));
    return {figures, [](Report& report) { measureGpu(report); }};
}

}  // namespace glint::bench
