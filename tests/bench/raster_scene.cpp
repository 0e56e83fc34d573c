// raster.scene.{raster,mesh,tracing}_ms: a frame of the frozen scene of 04_hello_raster, 03_hello_mesh (the faster of
// its two ways) and 05_hello_tracing at 1600 x 900, as the examples themselves measure their passes, in turns.
// raster.instances.compute_over_driver: speed of 04 over that of 03. A table has all passes, and counts the pixels that
// show different instances.

#include "bench/bench.h"

#include "support/files.h"
#include "support/instance_compare.h"

#include <glint/base/file.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdlib>
#include <map>

namespace glint::bench {

namespace {

constexpr uint32_t turns = 2;
constexpr uint32_t frames = 7;

struct Way {
    const char* name;
    const char* command;
    std::vector<std::string> passes = {};
    std::map<std::string, Times> times = {};  ///< of a pass in all turns, milliseconds
    uint64_t triangles = 0;
    std::string ids;

    /// Of the fastest frame, which other programs have disturbed least.
    double fastest() const {
        double sum = 0.0;
        for (const auto& [pass, each] : times) sum += each.minimum();
        return sum;
    }
    double median() const {
        double sum = 0.0;
        for (const auto& [pass, each] : times) sum += each.median();
        return sum;
    }
};

void runExample(Way& way, const char* time, const test::TempDir& folder) {
    const std::filesystem::path programs =
        std::filesystem::read_symlink("/proc/self/exe").parent_path().parent_path() / "examples";
    const std::string stats = folder / "stats.json";
    const auto start = [&](const std::string& arguments) {
        const std::string command = fmt::format("{}/{} --size 1600x900 --time {} {} > '{}'", programs.string(),
                                                way.command, time, arguments, (folder / "output").string());
        if (std::system(command.c_str()) != 0) throw std::runtime_error("failed: " + command);
    };
    if (way.ids.empty()) {
        way.ids = folder / fmt::format("{}.npy", way.name);
        start(fmt::format("--ids '{}'", way.ids));
    }
    start(fmt::format("--frames {} --stats '{}'", frames, stats));
    const auto json = nlohmann::json::parse(check(readTextFile(stats)).value());
    way.triangles = json.at("counts").value("triangles_drawn", json.at("counts").at("triangles").get<uint64_t>());
    for (const auto& pass : json.at("passes")) {
        const auto name = pass.at("name").get<std::string>();
        if (way.times[name].values.empty()) way.passes.push_back(name);
        // The driver compiles in the first frame, or the first frames, which do not count.
        const auto all = pass.at("gpu_ns").get<std::vector<double>>();
        for (size_t i = all.size() - (frames - 2); i < all.size(); i++) way.times[name].values.push_back(all[i] * 1e-6);
    }
}

void printRow(const Way& way, const Way& traced) {
    std::string passes;
    for (const std::string& pass : way.passes)
        passes += fmt::format("{}{} {:.1f}", passes.empty() ? "" : ", ", pass, way.times.at(pass).minimum());
    const test::InstancePicture ours = *check(test::InstancePicture::load(way.ids));
    const test::InstancePicture theirs = *check(test::InstancePicture::load(traced.ids));
    const test::InstanceDifferences found = test::compareInstances(theirs, ours);
    fmt::print("  {:<26} {:>9.1f} {:>9.1f}  {:>10}  {:>7} {:>7} {:>7} {:>7}  {}\n", way.command, way.fastest(),
               way.median(), way.triangles, found.count(), found.near_both, found.near_one, found.elsewhere, passes);
}

void run(Report& report) {
    const std::string device = deviceName(createDevice());
    for (const char* time : {"3.14159", "8"}) {
        const test::TempDir folder;
        Way ways[] = {{"raster", "04_hello_raster"},
                      {"mesh", "03_hello_mesh"},
                      {"indirect", "03_hello_mesh --compute"},
                      {"tracing", "05_hello_tracing"}};
        for (uint32_t turn = 0; turn < turns; turn++)
            for (Way& way : ways) runExample(way, time, folder);
        fmt::print("1600 x 900 at {} s, milliseconds of a frame, fastest and median of {}; triangles; pixels that show "
                   "another instance "
                   "than 05: all, near an edge in both pictures, in one, in neither\n",
                   time, turns * (frames - 2));
        for (const Way& way : ways) printRow(way, ways[3]);
        if (std::string_view(time) != "3.14159") continue;
        const double driver = std::min(ways[1].fastest(), ways[2].fastest());
        report.add("raster.scene.raster_ms", ways[0].fastest(), "ms", "nothing", device);
        report.add("raster.scene.mesh_ms", driver, "ms", "nothing", device);
        report.add("raster.scene.tracing_ms", ways[3].fastest(), "ms", "nothing", device);
        report.add("raster.instances.compute_over_driver", driver / ways[0].fastest(), "ratio of speeds",
                   "the faster of the driver's pipelines", device);
    }
}

}  // namespace

Benchmark rasterSceneBenchmark() {
    return {{"raster.scene.raster_ms", "raster.scene.mesh_ms", "raster.scene.tracing_ms",
             "raster.instances.compute_over_driver"},
            run};
}

}  // namespace glint::bench
