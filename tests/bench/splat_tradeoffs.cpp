// splat.tradeoff.*: what the splat renderer's numbers trade: time against error for the stop, the cut, the degree of
// the harmonics, the size of the tiles, and memory against error for ways to store splats. `./dev report` makes the
// tables and charts of docs/accuracy.md from what is written.

#include "bench/splat_views.h"
#include "bench/tracing_batch.h"

#include <fmt/format.h>
#include <glint/base/file.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

namespace glint::bench {

namespace {

using test::SplatDrawer;
using test::SplatPicture;
using test::SplatScene;

/// One way to draw a scene.
struct Trial {
    double value = 0.0;
    SplatRenderer::Options options;
    double time = 0.0;  ///< of a picture, over that of the default
    double rmse = 0.0;
};

/// Best processor times of drawers that take turns, which do not depend on what else runs.
std::vector<double> bestTimes(std::span<const std::function<void()>> draws) {
    std::vector<double> best(draws.size(), INFINITY);
    for (uint32_t turn = 0; turn < 15; turn++)
        for (size_t i = 0; i < draws.size(); i++) {
            const double begin = processSeconds();
            draws[i]();
            best[i] = std::min(best[i], processSeconds() - begin);
        }
    return best;
}

/// Fills in times and errors.
void drawAll(const Device& device, const SplatScene& scene, const SplatModel& model, const SplatPicture& truth,
             std::span<Trial> trials, size_t default_trial) {
    std::vector<std::unique_ptr<SplatDrawer>> drawers;
    std::vector<std::function<void()>> draws;
    for (Trial& trial : trials) {
        drawers.push_back(std::make_unique<SplatDrawer>(device, trial.options));
        SplatDrawer& drawer = *drawers.back();
        drawer.draw(scene, model);
        trial.rmse = test::comparePictures(drawer.picture(), truth).rmse;
        draws.push_back([&] { drawer.draw(scene, model); });
    }
    const std::vector<double> times = bestTimes(draws);
    for (size_t i = 0; i < trials.size(); i++) trials[i].time = times[i] / times[default_trial];
}

std::string fraction(double value) {
    const double inverse = 1.0 / value;
    return value > 1e-3 ? fmt::format("1/{:.0f}", inverse) : fmt::format("{:.0e}", value);
}

/// Draws with all values of one cut-off. The error is that of this one: the truth leaves out what the other does.
void compareCutOff(Report& report, const Device& device, std::span<const SplatScene> scenes, const std::string& name,
                   const char* title, float SplatRenderer::Options::*option, float test::SplatSettings::*setting,
                   std::span<const float> values) {
    std::string table = fmt::format("{}; 480 x 270 pixels.\n\n| scene | {} | time | rmse |\n|---|---|---|---|\n",
                                    deviceName(device), title);
    const SplatRenderer::Options defaults;
    for (const SplatScene& scene : scenes) {
        test::SplatSettings settings = test::settingsOf(defaults);
        settings.*setting = 0.0f;
        std::vector<Trial> trials;
        for (const float value : values) {
            trials.push_back({static_cast<double>(value), defaults});
            trials.back().options.*option = value;
        }
        const auto chosen = std::find(values.begin(), values.end(), defaults.*option) - values.begin();
        const SplatModel model(device, scene.splats, SplatModel::StorageFloat);
        drawAll(device, scene, model, test::referenceOf(scene, settings), trials, static_cast<size_t>(chosen));
        std::string curve = fmt::format("# {}, time over the default's, rmse\n", name);
        for (const Trial& trial : trials) {
            curve += fmt::format("{:.6e} {:.4f} {:.4e}\n", trial.value, trial.time, trial.rmse);
            const char* mark = &trial - trials.data() == chosen ? "**" : "";
            table += fmt::format("| {} | {}{}{} | {:.3f} | {:.1e} |\n", scene.name, mark, fraction(trial.value), mark,
                                 trial.time, trial.rmse);
        }
        check(writeTextFile(report.folder() / fmt::format("splat_{}_{}.dat", name, scene.name), curve));
    }
    fmt::print("{}\n", table);
    check(writeTextFile(report.folder() / fmt::format("splat_{}.md", name), table));
}

void compareCutOffs(Report& report, const Device& device, std::span<const SplatScene> scenes) {
    constexpr float stops[] = {1e-6f, 1e-5f, 1e-4f, 1e-3f, 1.0f / 255.0f, 1.0f / 64.0f, 1.0f / 16.0f, 0.25f};
    compareCutOff(report, device, scenes, "stop", "transmittance stop", &SplatRenderer::Options::transmittance_stop,
                  &test::SplatSettings::transmittance_stop, stops);
    constexpr float cuts[] = {1e-5f,         1e-4f,         1.0f / 2048.0f, 1.0f / 1024.0f, 1.0f / 512.0f,
                              1.0f / 255.0f, 1.0f / 128.0f, 1.0f / 64.0f,   1.0f / 32.0f,   1.0f / 16.0f};
    compareCutOff(report, device, scenes, "cut", "alpha cut", &SplatRenderer::Options::alpha_cut,
                  &test::SplatSettings::alpha_cut, cuts);
}

void compareTiles(Report& report, const Device& device, std::span<const SplatScene> scenes) {
    constexpr uint32_t sizes[] = {8, 16, 32};
    std::string table = fmt::format("{}; 480 x 270 pixels; times over that of the default.\n\n"
                                    "| scene | height | width 8 | 16 | 32 |\n|---|---|---|---|---|\n",
                                    deviceName(device));
    for (const SplatScene& scene : scenes) {
        const SplatModel model(device, scene.splats);
        std::vector<Trial> trials(1);  // the default's
        for (const uint32_t height : sizes)
            for (const uint32_t width : sizes) {
                trials.emplace_back();
                trials.back().options.tile_width = width;
                trials.back().options.tile_height = height;
            }
        drawAll(device, scene, model, test::referenceOf(scene, test::settingsOf({})), trials, 0);
        std::string grid = "# width, height, time over the default's\n";
        double best = INFINITY;
        for (size_t i = 1; i < trials.size(); i++) {
            const Trial& trial = trials[i];
            const uint32_t height = sizes[(i - 1) / 3];
            if (i % 3 == 1) {
                if (i > 1) grid += "\n";
                table += fmt::format("| {} | {} |", scene.name, height);
            }
            table += fmt::format(" {:.3f} |", trial.time);
            if (i % 3 == 0) table += "\n";
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
    struct Row {
        std::string storage;
        uint32_t degree = 0;
        double bytes = 0.0, rmse = 0.0;
        double drawn_rmse = 0.0, time = 0.0;  ///< of the renderer's own storages
    };
    std::string table = fmt::format(
        "{}; times over that of float32 with all harmonics.\n\n"
        "| scene | storage | degree | bytes a splat | rmse | drawn: rmse | time |\n|---|---|---|---|---|---|---|\n",
        deviceName(device));
    SplatDrawer drawer(device);
    for (const SplatScene& scene : scenes) {
        const SplatPicture truth = test::referenceOf(scene, {});
        const SplatPicture cut_truth = test::referenceOf(scene, drawer.settings());
        std::vector<Row> rows;
        std::vector<std::function<void()>> draws;  // of the first rows
        for (const SplatStorage& storage : splatStorages()) {
            const uint32_t most = storage.name == ".splat" ? 0 : scene.splats.degree;
            for (uint32_t degree = most + 1; degree-- > 0;) {
                Splats splats = scene.splats;
                splats.reduceDegree(degree);
                const StoredSplats stored = storage.store(splats);
                const test::SplatInstance instance = {&stored.splats};
                const SplatPicture picture =
                    test::renderSplats(scene.camera, scene.width, scene.height, {&instance, 1});
                const double rmse = test::comparePictures(picture, truth).rmse;
                rows.push_back({storage.name, degree, stored.bytes, rmse});
                if (storage.name == "default" && degree == most)
                    report.add("splat.tradeoff." + scene.name + ".storage_rmse", rmse, "of a peak of 1",
                               "float32 storage", "float64 on the host");
                if (storage.name != "float32" && storage.name != "default") continue;
                const auto kind = storage.name == "default" ? SplatModel::StorageHalf : SplatModel::StorageFloat;
                const SplatModel model(device, stored.splats, kind);
                draws.push_back([&drawer, &scene, model] { drawer.draw(scene, model); });
                draws.back()();
                rows.back().drawn_rmse = test::comparePictures(drawer.picture(), cut_truth).rmse;
            }
        }
        const std::vector<double> times = bestTimes(draws);
        for (size_t i = 0; i < times.size(); i++) rows[i].time = times[i] / times[0];

        std::string curves = "# degree, bytes a splat, rmse, rmse of what is drawn, time over that of the first\n";
        for (size_t i = 0; i < rows.size(); i++) {
            const Row& row = rows[i];
            if (i > 0 && row.storage != rows[i - 1].storage) curves += "\n\n";
            // What is exact has no place on a logarithmic axis.
            curves += fmt::format("{} {} {} {:.4e} {:.4f}\n", row.degree, row.bytes,
                                  row.rmse > 0.0 ? fmt::format("{:.4e}", row.rmse) : "NaN", row.drawn_rmse, row.time);
            table += fmt::format("| {} | {} | {} | {} | {} |", scene.name, row.storage, row.degree, row.bytes,
                                 row.rmse > 0.0 ? fmt::format("{:.1e}", row.rmse) : "0");
            table += row.time > 0.0 ? fmt::format(" {:.1e} | {:.3f} |\n", row.drawn_rmse, row.time) : "  |  |\n";
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
