// splat.tradeoff.*: what the splat renderer's numbers trade: time against error for the stop, the cut, the degree of
// the harmonics, the size of the tiles, and memory against error for ways to store splats. `./dev report` makes the
// tables and charts of docs/accuracy.md from what is written.

#include "bench/splat_views.h"
#include "bench/tracing_batch.h"

#include <fmt/format.h>
#include <glint/base/file.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace glint::bench {

namespace {

using test::SplatDrawer;
using test::SplatPicture;
using test::SplatScene;

/// One way to draw a scene.
struct Trial {
    std::string label;
    double value = 0.0;
    SplatRenderer::Options options;
    double time = 0.0;  ///< of a picture, over that of the first trial
    double rmse = 0.0;
};

/// Fills in times and errors. Best times of drawers that take turns, in processor time, which does not depend on what
/// else runs; the first turn, when kernels are compiled, does not count.
void drawAll(const Device& device, const SplatScene& scene, const SplatModel& model, const SplatPicture& truth,
             std::vector<Trial>& trials) {
    std::vector<std::unique_ptr<SplatDrawer>> drawers;
    for (Trial& trial : trials) {
        drawers.push_back(std::make_unique<SplatDrawer>(device, trial.options));
        drawers.back()->draw(scene, model);
        trial.rmse = test::comparePictures(drawers.back()->picture(), truth).rmse;
        trial.time = INFINITY;
    }
    for (uint32_t turn = 0; turn < 7; turn++)
        for (size_t i = 0; i < trials.size(); i++) {
            const double begin = processSeconds();
            drawers[i]->draw(scene, model);
            trials[i].time = std::min(trials[i].time, processSeconds() - begin);
        }
    const double first = trials[0].time;
    for (Trial& trial : trials) trial.time /= first;
}

/// The first trial is the default, at the value that is among the others'.
void write(Report& report, const std::string& name, const std::string& header, const std::vector<Trial>& trials,
           std::string& table) {
    std::string curve = fmt::format("# {}, time over the default's, rmse\n", header);
    for (size_t i = 1; i < trials.size(); i++) {
        const Trial& trial = trials[i];
        curve += fmt::format("{:.6e} {:.4f} {:.4e}\n", trial.value, trial.time, trial.rmse);
        const std::string label = trial.value == trials[0].value ? "**" + trial.label + "**" : trial.label;
        table += fmt::format("| {} | {} | {:.3f} | {:.1e} |\n", name.substr(name.find('_') + 1), label, trial.time,
                             trial.rmse);
    }
    check(writeTextFile(report.folder() / ("splat_" + name + ".dat"), curve));
}

std::string fraction(double value) {
    const double inverse = 1.0 / value;
    return value > 1e-3 ? fmt::format("1/{:.0f}", inverse) : fmt::format("{:.0e}", value);
}

void compareCutOffs(Report& report, const Device& device, std::span<const SplatScene> scenes) {
    std::string stops = fmt::format("{}; 480 x 270 pixels.\n\n| scene | transmittance stop | time | rmse |\n"
                                    "|---|---|---|---|\n",
                                    deviceName(device));
    std::string cuts = fmt::format("{}; 480 x 270 pixels.\n\n| scene | alpha cut | time | rmse |\n|---|---|---|---|\n",
                                   deviceName(device));
    const SplatRenderer::Options defaults;
    for (const SplatScene& scene : scenes) {
        const SplatModel model(device, scene.splats, SplatModel::StorageFloat);
        const SplatPicture truth = test::referenceOf(scene, {});
        std::vector<Trial> trials = {{"", static_cast<double>(defaults.transmittance_stop), defaults}};
        for (const float stop : {1e-6f, 1e-5f, 1e-4f, 1e-3f, 1.0f / 255.0f, 1.0f / 64.0f, 1.0f / 16.0f, 0.25f}) {
            trials.push_back({fraction(static_cast<double>(stop)), static_cast<double>(stop), defaults});
            trials.back().options.transmittance_stop = stop;
        }
        drawAll(device, scene, model, truth, trials);
        write(report, "stop_" + scene.name, "stop", trials, stops);

        trials = {{"", static_cast<double>(defaults.alpha_cut), defaults}};
        for (const float cut : {1e-5f, 1e-4f, 1.0f / 2048.0f, 1.0f / 1024.0f, 1.0f / 512.0f, 1.0f / 255.0f,
                                1.0f / 128.0f, 1.0f / 64.0f, 1.0f / 32.0f, 1.0f / 16.0f}) {
            trials.push_back({fraction(static_cast<double>(cut)), static_cast<double>(cut), defaults});
            trials.back().options.alpha_cut = cut;
        }
        drawAll(device, scene, model, truth, trials);
        write(report, "cut_" + scene.name, "cut", trials, cuts);
    }
    fmt::print("{}\n{}\n", stops, cuts);
    check(writeTextFile(report.folder() / "splat_stops.md", stops));
    check(writeTextFile(report.folder() / "splat_cuts.md", cuts));
}

void compareTiles(Report& report, const Device& device, std::span<const SplatScene> scenes) {
    constexpr uint32_t sizes[] = {8, 16, 32, 64};
    std::string table = fmt::format("{}; 480 x 270 pixels; times over that of the default.\n\n"
                                    "| scene | height | width 8 | 16 | 32 | 64 |\n|---|---|---|---|---|---|\n",
                                    deviceName(device));
    for (const SplatScene& scene : scenes) {
        const SplatModel model(device, scene.splats);
        std::vector<Trial> trials = {{"", 0.0, {}}};
        for (const uint32_t height : sizes)
            for (const uint32_t width : sizes) {
                trials.push_back({});
                trials.back().options.tile_width = width;
                trials.back().options.tile_height = height;
            }
        drawAll(device, scene, model, test::referenceOf(scene, test::settingsOf({})), trials);
        std::string grid = "# width, height, time over the default's\n";
        double best = INFINITY;
        for (size_t i = 1; i < trials.size(); i++) {
            const Trial& trial = trials[i];
            const uint32_t height = sizes[(i - 1) / 4];
            if (i % 4 == 1) {
                if (i > 1) grid += "\n";
                table += fmt::format("| {} | {} |", scene.name, height);
            }
            table += fmt::format(" {:.3f} |", trial.time);
            if (i % 4 == 0) table += "\n";
            grid += fmt::format("{} {} {:.4f}\n", trial.options.tile_width, height, trial.time);
            best = std::min(best, trial.time);
        }
        check(writeTextFile(report.folder() / ("splat_tiles_" + scene.name + ".dat"), grid));
        report.add("splat.tradeoff." + scene.name + ".best_tiles", best, "of the time", "the default size of tiles",
                   deviceName(device));
    }
    fmt::print("{}\n", table);
    check(writeTextFile(report.folder() / "splat_tiles.md", table));
}

void compareStorages(Report& report, const Device& device, std::span<const SplatScene> scenes) {
    std::string table =
        fmt::format("{}; rmse, and time of drawing over that of float32 with all harmonics.\n\n"
                    "| scene | storage | degree | bytes a splat | rmse | time |\n|---|---|---|---|---|---|\n",
                    deviceName(device));
    for (const SplatScene& scene : scenes) {
        const SplatPicture truth = test::referenceOf(scene, {});
        std::string curves;
        double first_time = 0.0;
        for (const SplatStorage& storage : splatStorages()) {
            curves += fmt::format("# {}: degree, bytes a splat, rmse\n", storage.name);
            for (int degree = static_cast<int>(scene.splats.degree); degree >= 0; degree--) {
                SplatScene stored = scene;
                stored.splats = storage.store(withDegree(scene.splats, static_cast<uint32_t>(degree)));
                const double rmse = test::comparePictures(test::referenceOf(stored, {}), truth).rmse;
                const uint32_t bytes = storage.bytes(stored.splats.coefficientCount());
                std::string time;
                if (storage.name == "float32" || storage.name == "default") {
                    const SplatModel model(device, stored.splats,
                                           storage.name == "default" ? SplatModel::StorageHalf
                                                                     : SplatModel::StorageFloat);
                    SplatDrawer drawer(device);
                    drawer.draw(scene, model);
                    double best = INFINITY;
                    for (uint32_t turn = 0; turn < 7; turn++) {
                        const double begin = processSeconds();
                        drawer.draw(scene, model);
                        best = std::min(best, processSeconds() - begin);
                    }
                    if (first_time == 0.0) first_time = best;
                    time = fmt::format("{:.3f}", best / first_time);
                }
                // What is exact has no place on a logarithmic axis.
                curves += fmt::format("{} {} {}\n", degree, bytes, rmse > 0.0 ? fmt::format("{:.4e}", rmse) : "NaN");
                table += fmt::format("| {} | {} | {} | {} | {} | {} |\n", scene.name, storage.name, degree, bytes,
                                     rmse > 0.0 ? fmt::format("{:.1e}", rmse) : "0", time);
                if (storage.name == "default" && degree == static_cast<int>(scene.splats.degree))
                    report.add("splat.tradeoff." + scene.name + ".storage_rmse", rmse, "of a peak of 1",
                               "float32 storage", "float64 on the host");
            }
            curves += "\n\n";
        }
        check(writeTextFile(report.folder() / ("splat_storage_" + scene.name + ".dat"), curves));
    }
    fmt::print("{}\n", table);
    check(writeTextFile(report.folder() / "splat_storage.md", table));
}

void run(Report& report) {
    const Device device = createDevice();
    const std::vector<SplatScene> scenes = splatViews();
    compareCutOffs(report, device, scenes);
    compareStorages(report, device, scenes);
    compareTiles(report, device, scenes);
}

}  // namespace

Benchmark splatTradeoffsBenchmark() {
    return {{"splat.tradeoff.playbot.best_tiles", "splat.tradeoff.mesh.best_tiles",
             "splat.tradeoff.playbot.storage_rmse", "splat.tradeoff.mesh.storage_rmse"},
            run};
}

}  // namespace glint::bench
