// Ray queries over 81 models that are deformed in every frame: their structures are refitted, or built anew.

#include "08_hello_dynamic/crossover.h"
#include "08_hello_dynamic/models.h"
#include "08_hello_dynamic/policy.h"
#include "common/viewer.h"

#include <cstdio>
#include <string>

using namespace glint;

namespace {

struct Parameters {
    CameraParameters camera;
    uint32_t vertices;  // of a model
    uint32_t grid;
    float floor_z;
};

enum class Mode { Refit, Rebuild, Auto };

/// What was decided for each frame, and how long it took.
class Schedule {
public:
    Schedule(Mode mode, const Statistics& statistics) : mode_(mode), statistics_(statistics) {}

    bool nextIsRebuilt() {
        // Times come some frames later.
        while (seen_ < statistics_.times("trace").size()) {
            policy_.add(rebuilt_[seen_], buildTime(), traceTime());
            seen_++;
        }
        const bool rebuild = mode_ == Mode::Rebuild || (mode_ == Mode::Auto && policy_.shouldRebuild());
        policy_.decided(rebuild);
        rebuilt_.push_back(rebuild);
        return rebuild;
    }

    void print(const Example& example) const {
        std::printf("%6s %8s %8s %12s %10s %10s %10s\n", "frame", "time", "deformed", "", "build ms", "scene ms",
                    "trace ms");
        const std::vector<uint64_t>& traces = statistics_.times("trace");
        const std::vector<uint64_t>& scenes = statistics_.times("scene");
        size_t counts[2] = {};
        for (size_t i = 0; i < std::min(traces.size(), rebuilt_.size()); i++) {
            const bool rebuilt = rebuilt_[i];
            const double time = example.time(static_cast<uint32_t>(i));
            const auto build = static_cast<double>(statistics_.times(rebuilt ? "rebuild" : "refit")[counts[rebuilt]++]);
            std::printf("%6zu %8.3f %8.2f %12s %10.2f %10.2f %10.2f\n", i, time, Models::amount(time),
                        rebuilt ? "rebuilt" : "refitted", build * 1e-6, static_cast<double>(scenes[i]) * 1e-6,
                        static_cast<double>(traces[i]) * 1e-6);
        }
    }

private:
    double buildTime() {
        const bool rebuilt = rebuilt_[seen_];
        return static_cast<double>(statistics_.times(rebuilt ? "rebuild" : "refit")[used_[rebuilt]++]);
    }
    double traceTime() const { return static_cast<double>(statistics_.times("trace")[seen_]); }

    Mode mode_;
    const Statistics& statistics_;
    RefitPolicy policy_;
    std::vector<bool> rebuilt_;
    size_t seen_ = 0;
    size_t used_[2] = {};  ///< of the times of refits and rebuilds
};

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Traces 81 models that a kernel deforms in every frame.");
    std::string mode_name = "auto";
    bool is_verbose = false, is_crossover = false;
    example.add("--mode", mode_name, "What follows a deformation: refit, rebuild or auto, as measured times suggest");
    example.add("--statistics", is_verbose, "Print the times of each frame");
    example.add("--crossover", is_crossover, "Measure from which deformation on rebuilding is cheaper, before drawing");
    if (!example.parse(argc, argv)) return example.exitCode();
    if (mode_name != "refit" && mode_name != "rebuild" && mode_name != "auto") {
        std::fprintf(stderr, "--mode: '%s' is none of refit, rebuild, auto\n", mode_name.c_str());
        return 2;
    }
    const Mode mode = mode_name == "refit" ? Mode::Refit : mode_name == "rebuild" ? Mode::Rebuild : Mode::Auto;

    Device device = openDevice(example, FeatureComputeTracing);
    if (!device) return report(device.error());
    const Models models(device);
    if (models.error()) return report(models.error());
    // What is built once may take its time.
    const Structures structures(device, models, mode == Mode::Refit ? Tracing::FlagFastTrace : Tracing::FlagFastBuild);
    if (structures.error()) return report(structures.error());
    Kernel kernel = device.createKernel("trace");
    kernel.loadShaderGLSL(EXAMPLE_DIR "/main.shader", "TRACE_SHADER=1");
    if (!kernel.create()) return report(kernel.error());

    const auto trace = [&](Compute& compute, const Structures& traced, const Camera& camera, const Texture& picture) {
        compute.setKernel(kernel);
        compute.setUniform(0, Parameters{camera.parameters(), models.vertices(), Models::grid, Models::floor_z});
        compute.setStorageBuffers(0, {models.vertexBuffer(), models.indexBuffer()});
        compute.setTracing(0, traced.scene());
        compute.setSurfaceTexture(0, picture);
        compute.dispatch(picture);
    };
    if (is_crossover) {
        const Texture picture =
            device.createTexture2D(FormatRGBAu8n, example.width(), example.height(), Texture::FlagSurface, "picture");
        if (!picture) return report(picture.error());
        const Camera camera = Models::camera(0.0f, example.aspect());
        const Status status =
            measureCrossover(example, device, models, [&](Compute& compute, const Structures& traced) {
                trace(compute, traced, camera, picture);
            });
        if (!status) return report(status.error());
    }

    // The structures at rest, to be refitted.
    Compute first = device.createCompute();
    models.deform(first, 0.0f, 0.0f);
    if (Status status = device.submit(first); !status) return report(status.error());
    if (Status status = structures.build(device, false); !status) return report(status.error());

    Statistics& statistics = example.statistics();
    statistics.counts = {{"models", Models::count},
                         {"triangles", uint64_t{Models::count} * models.triangles()},
                         {"vertices", uint64_t{Models::count} * models.vertices()},
                         {"tracing_bytes", structures.memory()},
                         {"scratch_bytes", structures.scratchMemory()}};
    Schedule schedule(mode, statistics);
    Viewer viewer(example, device);
    const Status status = viewer.run([&](Frame& frame) {
        const auto time = static_cast<float>(frame.time);
        const bool rebuild = schedule.nextIsRebuilt();
        Compute compute = device.createCompute();
        frame.timer.begin(compute, "deform");
        models.deform(compute, Models::amount(frame.time), time);
        frame.timer.end(compute);
        frame.timer.begin(compute, rebuild ? "rebuild" : "refit");
        structures.build(compute, !rebuild);
        frame.timer.end(compute);
        frame.timer.begin(compute, "scene");
        structures.buildScene(compute, Models::instances(time));
        frame.timer.end(compute);

        Camera camera = Models::camera(time, frame.aspect());
        camera.lookAt(frame.view.eye(camera.position(), Models::target()), Models::target());
        frame.timer.begin(compute, "trace");
        trace(compute, structures, camera, frame.picture);
        frame.timer.end(compute);
        return device.submit(compute);
    });
    if (!status) return report(status.error());

    // A ray for each pixel, and one towards the sun where it meets something that faces it.
    statistics.setRays("trace", 1ull * statistics.width * statistics.height);
    std::printf("%u models of %u triangles\n", Models::count, models.triangles());
    if (is_verbose) schedule.print(example);
    std::printf("%.1f ms to deform, %.1f ms to refit, %.1f ms to rebuild, %.1f ms to trace\n",
                statistics.median("deform") * 1e-6, statistics.median("refit") * 1e-6,
                statistics.median("rebuild") * 1e-6, statistics.median("trace") * 1e-6);
    return viewer.finish();
}
