#include "bench/example_runs.h"

#include "support/files.h"

#include <glint/base/file.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <sys/resource.h>

#include <cstdlib>

namespace glint::bench {

namespace {

/// Seconds that the programs started so far have spent on processors.
double childSeconds() {
    rusage usage = {};
    getrusage(RUSAGE_CHILDREN, &usage);
    const auto seconds = [](const timeval& time) {
        return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace

ExampleRun runExample(std::string_view name, const std::string& arguments, const std::string& environment) {
    const std::filesystem::path programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
    const std::filesystem::path example = programs.parent_path() / "examples" / name;
    if (!std::filesystem::exists(example)) throw std::runtime_error(example.string() + " has not been built");
    const test::TempDir folder;
    const std::string stats = folder / "stats.json";
    const std::string command = fmt::format("{} '{}' --stats '{}' {} > '{}'", environment, example.string(), stats,
                                            arguments, (folder / "output").string());
    ExampleRun run;
    const double begin = childSeconds(), wall_begin = wallSeconds();
    if (std::system(command.c_str()) != 0) throw std::runtime_error("failed: " + command);
    run.wall = wallSeconds() - wall_begin;
    run.processor = childSeconds() - begin;
    const auto json = nlohmann::json::parse(check(readTextFile(stats)).value());
    run.trace_ms = json.at("passes").at(0).at("min_ns").get<double>() * 1e-6;
    return run;
}

Device createPipelineDevice() {
    Device device = createDevice(TracingEngine::Driver);
    return device.getFeatures().rayTracing ? device : Device();
}

}  // namespace glint::bench
