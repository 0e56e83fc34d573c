// traversal.first.NAME.{cold,warm}: what 06_hello_traversal and the examples of the course cost from the start of the
// program to its end, with one picture of 64 x 64, through stages joined for the software engine over through the
// driver's pipeline: processor time, and .wall by the clock. So it holds the start, the scene with its structures, the
// shaders from their sources, the first dispatch and the wait for it, on both sides; nothing is subtracted. Cold: with
// empty caches of shaders, Glint's and the driver's; warm: the programs that follow with the same ones.

#include "bench/example_runs.h"
#include "support/files.h"

#include <fmt/format.h>

#include <algorithm>

namespace glint::bench {

namespace {

constexpr uint32_t warm_runs = 3;
constexpr struct {
    const char* name;
    const char* program;
} examples[] = {{"hello", "06_hello_traversal"},
                {"normals", "20_normals"},
                {"diffuse", "21_diffuse"},
                {"phong", "22_phong"},
                {"shadows", "23_shadows"},
                {"reflections", "24_reflections"},
                {"environment", "25_environment"},
                {"procedural", "26_procedural"},
                {"cutout", "27_cutout"},
                {"lenses", "28_lenses"},
                {"motion", "29_motion"}};

std::string figureOf(const char* name, bool is_warm) {
    return fmt::format("traversal.first.{}.{}", name, is_warm ? "warm" : "cold");
}

struct Costs {
    double wall[2], processor[2];  ///< cold, warm: seconds
};

Costs measure(const char* program, const char* tracing) {
    const test::TempDir folder;
    const std::string path = folder.path().string();
    const std::string caches = fmt::format("GLINT_CACHE='{0}/glint' MESA_SHADER_CACHE_DIR='{0}/mesa' "
                                           "__GL_SHADER_DISK_CACHE=1 __GL_SHADER_DISK_CACHE_PATH='{0}' "
                                           "XDG_CACHE_HOME='{0}/other'",
                                           path);
    const std::string arguments = fmt::format("--size 64x64 --time 0 {}", tracing);
    const auto start = [&] { return runExample(program, arguments, caches); };
    const ExampleRun cold = start();
    ExampleRun warm = start();
    for (uint32_t i = 1; i < warm_runs; i++) {
        const ExampleRun run = start();
        warm.wall = std::min(warm.wall, run.wall);
        warm.processor = std::min(warm.processor, run.processor);
    }
    return {{cold.wall, warm.wall}, {cold.processor, warm.processor}};
}

void run(Report& report) {
    const Device device = createDevice();
    if (!createPipelineDevice()) {
        fmt::print("  left out: {} has no ray-tracing pipelines\n\n", device.getInfo().name);
        return;
    }
    const std::string where = deviceName(device), against = "the driver's pipeline";
    const std::string& filter = report.options().filter;
    // The files of program and driver are in memory from here on.
    runExample("20_normals", "--size 64x64");
    for (const auto& [name, program] : examples) {
        if (figureOf(name, false).find(filter) == std::string::npos &&
            figureOf(name, true).find(filter) == std::string::npos)
            continue;
        const Costs theirs = measure(program, "--tracing driver");
        const Costs ours = measure(program, "--tracing software");
        for (const size_t i : {0u, 1u}) {
            fmt::print(
                "  {:<19} {}: driver {:6.2f} s of processors, {:6.2f} s by the clock; software {:6.2f}, {:6.2f}\n",
                program, i == 0 ? "cold" : "warm", theirs.processor[i], theirs.wall[i], ours.processor[i],
                ours.wall[i]);
            const std::string figure = figureOf(name, i == 1);
            report.add(figure, ours.processor[i] / theirs.processor[i], "ratio of processor times", against, where);
            report.add(figure + ".wall", ours.wall[i] / theirs.wall[i], "ratio of times", against, where);
        }
        std::fflush(stdout);
    }
}

}  // namespace

Benchmark traversalFirstBenchmark() {
    Benchmark benchmark = {{}, run};
    for (const auto& example : examples)
        for (const bool is_warm : {false, true}) benchmark.figures.push_back(figureOf(example.name, is_warm));
    return benchmark;
}

}  // namespace glint::bench
