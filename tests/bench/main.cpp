#include "bench/bench.h"

#include <fmt/format.h>

#include <cstdio>
#include <exception>

namespace {

using namespace glint::bench;

constexpr const char* usage = "bench [NAME] [--list] [--json FILE]\n"
                              "  NAME     run the benchmarks that make a figure whose name holds NAME\n"
                              "  --list   print the figures\n"
                              "  --json   file of figures, out/figures.json by default\n";

bool parse(int argc, char** argv, Options& options) {
    for (int i = 1; i < argc; i++) {
        const std::string_view argument = argv[i];
        if (argument == "--list") {
            options.list = true;
        } else if (argument == "--json" && i + 1 < argc) {
            options.json = argv[++i];
        } else if (!argument.starts_with("-") && options.filter.empty()) {
            options.filter = argument;
        } else {
            return false;
        }
    }
    return true;
}

bool matches(const Benchmark& benchmark, const std::string& filter) {
    for (const std::string& figure : benchmark.figures) {
        if (figure.find(filter) != std::string::npos) return true;
    }
    return false;
}

}  // namespace

int main(int argc, char** argv) {
    Options options;
    if (!parse(argc, argv, options)) {
        fmt::print(stderr, "{}", usage);
        return 2;
    }

    Report report(options);
    int failed = 0;
    int found = 0;
    // The compiler's first shader is timed before any other benchmark compiles one.
    const Benchmark benchmarks[] = {shaderCompileBenchmark(),
                                    dispatchBenchmark(),
                                    drawBenchmark(),
                                    warmFrameBenchmark(),
                                    tracingFrameBenchmark(),
                                    startupBenchmark(),
                                    memoryBenchmark(),
                                    tracingSoftwareBenchmark(),
                                    tracingBuildBenchmark(),
                                    tracingDeviceBenchmark(),
                                    tracingLeaksBenchmark(),
                                    tracingDriverBenchmark(),
                                    tracingTradeoffsBenchmark(),
                                    tracingGpuBenchmark(),
                                    castBenchmark(),
                                    castMemoryBenchmark(),
                                    traversalHelloBenchmark(),
                                    traversalFirstBenchmark(),
                                    traversalWavefrontBenchmark(),
                                    traversalOffsetBenchmark(),
                                    parallelBenchmark(),
                                    parallelGpuBenchmark(),
                                    splatAccuracyBenchmark(),
                                    splatLoadBenchmark(),
                                    splatFilesBenchmark(),
                                    splatTradeoffsBenchmark(),
                                    splatNeedlesBenchmark(),
                                    splatSpeedBenchmark(),
                                    splatGpuBenchmark(),
                                    lodBenchmark(),
                                    lodPixelsBenchmark(),
                                    lodViewsBenchmark(),
                                    rasterBenchmark(),
                                    rasterSceneBenchmark(),
                                    mipmapBenchmark(),
                                    tableBenchmark()};
    for (const Benchmark& benchmark : benchmarks) {
        if (!matches(benchmark, options.filter)) continue;
        found++;
        if (options.list) {
            for (const std::string& figure : benchmark.figures) fmt::print("{}\n", figure);
            continue;
        }
        fmt::print("{}\n", fmt::join(benchmark.figures, ", "));
        std::fflush(stdout);
        try {
            benchmark.run(report);
        } catch (const std::exception& error) {
            fmt::print(stderr, "  failed: {}\n", error.what());
            failed++;
        }
        std::fflush(stdout);
    }
    if (found == 0) {
        fmt::print(stderr, "no figure's name holds '{}'\n", options.filter);
        return 2;
    }
    try {
        report.write();
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}\n", error.what());
        failed++;
    }
    return failed == 0 ? 0 : 1;
}
