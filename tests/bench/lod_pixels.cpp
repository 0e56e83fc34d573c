// lod.pixels.{0,0.5,1,2,4,8}.{mesh,indirect,raster}_ms: a frame of the scene of 03 and 04 at the error that is allowed:
// 03 through mesh shaders and through indirect draws, 04 in compute, as the examples measure themselves. Beside it the
// triangles that are drawn, and how far the outlines of instances are from those of the full mesh.
// `./dev report` makes the table and the chart of docs/accuracy.md from what is written.

#include "bench/bench.h"

#include "support/files.h"
#include "support/instance_compare.h"

#include <glint/base/file.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace glint::bench {

namespace {

constexpr uint32_t width = 800, height = 450;
constexpr const char* moment = "3.14159";
constexpr const char* thresholds[] = {"0", "0.5", "1", "2", "4", "8"};

/// A way to draw the scene.
struct Way {
    const char* name;
    const char* program;
    const char* arguments;
    const char* title;
};
constexpr Way ways[] = {{"mesh", "03_hello_mesh", "", "mesh shaders"},
                        {"indirect", "03_hello_mesh", "--compute", "indirect draws"},
                        {"raster", "04_hello_raster", "", "compute"}};

nlohmann::json runExample(const Way& way, const std::string& arguments, const test::TempDir& folder) {
    const std::filesystem::path programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
    const std::filesystem::path example = programs.parent_path() / "examples" / way.program;
    if (!std::filesystem::exists(example)) throw std::runtime_error(example.string() + " has not been built");
    const std::string stats = folder / "stats.json";
    const std::string command =
        fmt::format("'{}' --size {}x{} --time {} --stats '{}' {} {} > '{}'", example.string(), width, height, moment,
                    stats, way.arguments, arguments, (folder / "output").string());
    if (std::system(command.c_str()) != 0) throw std::runtime_error("failed: " + command);
    return nlohmann::json::parse(check(readTextFile(stats)).value());
}

/// Milliseconds of a frame on the device: the fastest of each pass.
double frameTime(const nlohmann::json& stats) {
    double sum = 0.0;
    for (const nlohmann::json& pass : stats.at("passes")) sum += pass.at("min_ns").get<double>();
    return sum * 1e-6;
}

/// Pixels of `a` that show another instance than `b`, and how far from there `b` shows the same one.
struct Outlines {
    uint64_t different = 0;
    double largest = 0.0;
    uint64_t beyond = 0;  ///< that are further than `reach`
};

Outlines compareOutlines(const test::InstancePicture& a, const test::InstancePicture& b, int reach) {
    Outlines result;
    for (int y = 0; y < int{height}; y++)
        for (int x = 0; x < int{width}; x++) {
            const uint32_t instance = a.at(static_cast<uint32_t>(x), static_cast<uint32_t>(y));
            if (instance == b.at(static_cast<uint32_t>(x), static_cast<uint32_t>(y))) continue;
            result.different++;
            double nearest = INFINITY;
            for (int v = std::max(y - reach, 0); v <= std::min(y + reach, int{height} - 1); v++)
                for (int u = std::max(x - reach, 0); u <= std::min(x + reach, int{width} - 1); u++)
                    if (b.at(static_cast<uint32_t>(u), static_cast<uint32_t>(v)) == instance)
                        nearest = std::min(nearest, std::hypot(u - x, v - y));
            if (nearest <= reach)
                result.largest = std::max(result.largest, nearest);
            else
                result.beyond++;
        }
    return result;
}

void run(Report& report) {
    const Device device = createDevice();
    const bool is_cpu = device.getInfo().cpu;
    const test::TempDir folder;
    std::string table = fmt::format("{}; {} x {} pixels, --time {}; milliseconds on the device.\n\n| pixels allowed |",
                                    deviceName(device), width, height, moment);
    for (const Way& way : ways) table += fmt::format(" {} |", way.title);
    table +=
        " triangles drawn | pixels of another instance | farthest from it | further than 12 |\n|---|---|---|---|---|"
        "---|---|---|\n";
    std::string curve = "# pixels, ms by mesh shaders, by indirect draws, in compute, triangles\n";
    test::InstancePicture full;
    for (const char* pixels : thresholds) {
        // The full mesh takes the CPU many seconds.
        const bool is_full = std::string_view(pixels) == "0";
        const uint32_t frames = !is_cpu ? 50 : is_full ? 1 : 4;
        std::string row = fmt::format("| {} |", pixels);
        curve += pixels;
        double triangles = 0.0;
        for (const Way& way : ways) {
            const nlohmann::json stats =
                runExample(way, fmt::format("--pixels {} --frames {}", pixels, frames), folder);
            const double time = frameTime(stats);
            triangles = stats.at("counts").at("triangles_drawn").get<double>();
            row += fmt::format(" {:.1f} |", time);
            curve += fmt::format(" {:.4f}", time);
            report.add(fmt::format("lod.pixels.{}.{}_ms", pixels, way.name), time, "ms",
                       is_full ? "" : "lod.pixels.0, the full mesh", deviceName(device));
        }
        report.add(fmt::format("lod.pixels.{}.triangles", pixels), triangles, "triangles", "", deviceName(device));

        const std::string ids = folder / "ids.npy";
        runExample(ways[1], fmt::format("--pixels {} --frames 1 --ids '{}'", pixels, ids), folder);
        const test::InstancePicture shown = check(test::InstancePicture::load(ids)).value();
        if (is_full) full = shown;
        Outlines outlines = compareOutlines(shown, full, 12);
        const Outlines back = compareOutlines(full, shown, 12);
        outlines.largest = std::max(outlines.largest, back.largest);
        outlines.beyond += back.beyond;
        curve += fmt::format(" {:.0f}\n", triangles);
        table += fmt::format("{} {:.0f} | {:.3f} % | {:.2f} | {} |\n", row, triangles,
                             100.0 * static_cast<double>(outlines.different) / (double{width} * height),
                             outlines.largest, outlines.beyond);
        report.add(fmt::format("lod.pixels.{}.farthest", pixels), outlines.largest, "pixels", "the full mesh",
                   deviceName(device));
    }
    fmt::print("{}\n", table);
    check(writeTextFile(report.folder() / "lod_pixels.md", table));
    check(writeTextFile(report.folder() / "lod_pixels.dat", curve));
}

}  // namespace

Benchmark lodPixelsBenchmark() {
    std::vector<std::string> figures;
    for (const char* pixels : thresholds)
        for (const char* figure : {"mesh_ms", "indirect_ms", "raster_ms", "triangles", "farthest"})
            figures.push_back(fmt::format("lod.pixels.{}.{}", pixels, figure));
    return {figures, run};
}

}  // namespace glint::bench
