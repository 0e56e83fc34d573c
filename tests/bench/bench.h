#pragma once

// What the benchmarks share: figures, the loop that compares two sides fairly, and the device they run on.

#include <glint/device/device.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace glint::bench {

struct Figure {
    std::string name;
    double value = 0.0;
    std::string unit;
    std::string against;
    std::string device;
    std::string command;
};

struct Options {
    std::string filter;
    std::filesystem::path json = "out/figures.json";
    bool list = false;
};

/// Collects the figures of one run of the program.
class Report {
public:
    explicit Report(const Options& options) : options_(options) {}

    const Options& options() const { return options_; }
    /// False if the program was asked for figures of tracing that begin otherwise.
    bool wants(std::string_view prefix) const {
        const std::string_view filter = options_.filter;
        return !filter.starts_with("tracing.") || prefix.starts_with(filter) || filter.starts_with(prefix);
    }
    /// `command` is the benchmark that makes the figure again.
    void add(std::string name, double value, std::string unit, std::string against, std::string device);
    /// Where `./dev report` finds tables and curves; made if absent.
    std::filesystem::path folder() const;
    /// Writes the figures over those of the same names in the file and keeps the others.
    void write() const;

private:
    const Options& options_;
    std::vector<Figure> figures_;
};

struct Benchmark {
    std::vector<std::string> figures;
    std::function<void(Report&)> run;
};

// One for each source of this folder.
Benchmark shaderCompileBenchmark();
Benchmark dispatchBenchmark();
Benchmark drawBenchmark();
Benchmark mipmapBenchmark();
Benchmark tableBenchmark();
Benchmark warmFrameBenchmark();
Benchmark tracingFrameBenchmark();
Benchmark startupBenchmark();
Benchmark memoryBenchmark();
Benchmark tracingSoftwareBenchmark();
Benchmark tracingBuildBenchmark();
Benchmark tracingDeviceBenchmark();
Benchmark tracingDriverBenchmark();
Benchmark tracingGpuBenchmark();
Benchmark castBenchmark();
Benchmark castMemoryBenchmark();
Benchmark tracingLeaksBenchmark();
Benchmark tracingTradeoffsBenchmark();
Benchmark traversalOffsetBenchmark();
Benchmark traversalHelloBenchmark();
Benchmark traversalFirstBenchmark();
Benchmark traversalWavefrontBenchmark();
Benchmark parallelBenchmark();
Benchmark parallelGpuBenchmark();
Benchmark splatLoadBenchmark();
Benchmark splatFilesBenchmark();
Benchmark lodBenchmark();
Benchmark lodPixelsBenchmark();
Benchmark lodViewsBenchmark();
Benchmark splatAccuracyBenchmark();
Benchmark splatTradeoffsBenchmark();
Benchmark splatNeedlesBenchmark();
Benchmark splatSpeedBenchmark();
Benchmark splatGpuBenchmark();
Benchmark rasterBenchmark();
Benchmark rasterSceneBenchmark();

/// A failure that ends one benchmark and not the others.
template <class T>
decltype(auto) check(T&& result) {
    if (!result) throw std::runtime_error(result.error().text());
    return std::forward<T>(result);
}

/// The adapter that $GLINT_ADAPTER or the default chooses, without validation.
Device createDevice(TracingEngine tracing = TracingEngine::Auto);
/// "llvmpipe (LLVM 15.0.6, 256 bits), Mesa 25.0.7, AMD EPYC": adapter, driver and processor.
std::string deviceName(const Device& device);
std::string processorName();

/// Seconds that the calling thread has spent on a processor: what other threads and processes do is left out.
double threadSeconds();
double wallSeconds();

/// Median, and the smallest, of times in seconds.
struct Times {
    std::vector<double> values;
    double median() const;
    double minimum() const;
};

struct Side {
    std::function<void()> timed;
    std::function<void()> untimed;  ///< after each timed part, such as the wait for the device
};

/// Runs all sides `warm_up` + `rounds` times, in turn and in reverse, and returns the seconds of each, by default those
/// of the calling thread.
std::vector<Times> interleave(std::span<const Side> sides, uint32_t warm_up, uint32_t rounds,
                              double (*clock)() = threadSeconds);

/// "label    median 1.234 ms  minimum 1.200 ms"
void printTimes(std::string_view label, const Times& times);

}  // namespace glint::bench
