// splat.*.psnr_*: pictures of splats against float64, with the kinds of error apart. docs/splatting.md says what they
// are; `./dev report` makes its tables from what is written.

#include "bench/splat_views.h"

#include <fmt/format.h>
#include <glint/base/file.h>

#include <algorithm>
#include <array>

namespace glint::bench {

namespace {

using test::PictureError;
using test::SplatPicture;
using test::SplatScene;
using test::SplatSettings;

enum Kind : uint8_t { Float, Half, Default, CutOffs, Storage, Ordering, KindCount };
constexpr std::array<const char*, KindCount> figure_names = {
    "implementation", "implementation_default", "default", "cut_offs", "storage", "ordering"};
constexpr std::array<const char*, KindCount> titles = {"implementation, float32 storage",
                                                       "implementation, default storage",
                                                       "implementation and storage, default",
                                                       "cut-offs",
                                                       "storage, default",
                                                       "ordering"};

std::array<PictureError, KindCount> errorsOf(test::SplatDrawer& drawer, const SplatScene& scene) {
    constexpr auto stored_float = SplatModel::StorageFloat;
    constexpr auto stored_half = SplatModel::StorageHalf;
    const SplatSettings cut = drawer.settings();
    const SplatSettings all;
    SplatSettings per_pixel;
    per_pixel.order = test::SplatOrder::PerPixel;
    const SplatPicture with_cut_offs = test::referenceOf(scene, cut);
    const SplatPicture without = test::referenceOf(scene, all);
    const SplatPicture drawn_float = drawer.draw(scene, stored_float);
    const SplatPicture drawn_half = drawer.draw(scene, stored_half);
    std::array<PictureError, KindCount> errors;
    errors[Float] = test::comparePictures(drawn_float, test::referenceOf(scene, stored_float, cut));
    errors[Half] = test::comparePictures(drawn_half, test::referenceOf(scene, stored_half, cut));
    errors[Default] = test::comparePictures(drawn_half, with_cut_offs);
    errors[CutOffs] = test::comparePictures(with_cut_offs, without);
    errors[Storage] = test::comparePictures(test::referenceOf(scene, stored_half, all), without);
    errors[Ordering] = test::comparePictures(without, test::referenceOf(scene, per_pixel));
    return errors;
}

std::string psnrOf(const PictureError& error) {
    return error.rmse > 0.0 ? fmt::format("{:.1f}", error.psnr()) : std::string("equal");
}

void add(Report& report, const Device& device, const std::string& name,
         const std::array<PictureError, KindCount>& errors) {
    const std::string prefix = "splat." + name;
    const std::string against = "float64 reference";
    report.add(prefix + ".psnr_float", errors[Float].psnr(), "dB", against, deviceName(device));
    report.add(prefix + ".psnr_default", errors[Default].psnr(), "dB", against + " of the original values",
               deviceName(device));
    for (const Kind kind : {Float, CutOffs, Storage, Ordering})
        for (const auto& [what, value] :
             {std::pair("rmse", errors[kind].rmse), std::pair("largest", errors[kind].largest)})
            report.add(fmt::format("{}.{}.{}", prefix, figure_names[kind], what), value, "of a peak of 1", against,
                       deviceName(device));
}

void run(Report& report) {
    const Device device = createDevice();
    test::SplatDrawer drawer(device);
    std::string table =
        fmt::format("{}.\n\n| scene | kind of error | rmse | largest | PSNR, dB | pixels above 1/255 |\n"
                    "|---|---|---|---|---|---|\n",
                    deviceName(device));
    for (const SplatScene& scene : splatViews()) {
        const auto errors = errorsOf(drawer, scene);
        add(report, device, scene.name, errors);
        for (size_t kind = 0; kind < KindCount; kind++)
            table += fmt::format("| {}, {} splats | {} | {:.1e} | {:.1e} | {} | {:.2f} % |\n", scene.name,
                                 scene.splats.size(), titles[kind], errors[kind].rmse, errors[kind].largest,
                                 psnrOf(errors[kind]),
                                 100.0 * static_cast<double>(errors[kind].above) / (scene.width * scene.height));
    }
    fmt::print("{}\n", table);
    check(writeTextFile(report.folder() / "splat_errors.md", table));

    // Of the hard ones the worst of each kind counts.
    table = fmt::format("{}; PSNR in dB, and the largest error.\n\n| scene |", deviceName(device));
    for (const char* title : titles) table += fmt::format(" {} |", title);
    table += "\n|---|---|---|---|---|---|---|\n";
    std::array<PictureError, KindCount> worst;
    for (const SplatScene& scene : test::hardSplatScenes()) {
        const auto errors = errorsOf(drawer, scene);
        table += fmt::format("| {} |", scene.name);
        for (size_t kind = 0; kind < KindCount; kind++) {
            table += fmt::format(" {}, {:.0e} |", psnrOf(errors[kind]), errors[kind].largest);
            worst[kind].rmse = std::max(worst[kind].rmse, errors[kind].rmse);
            worst[kind].largest = std::max(worst[kind].largest, errors[kind].largest);
        }
        table += "\n";
    }
    fmt::print("{}\n", table);
    check(writeTextFile(report.folder() / "splat_hard.md", table));
    add(report, device, "hard", worst);
}

}  // namespace

Benchmark splatAccuracyBenchmark() {
    Benchmark benchmark = {{}, run};
    for (const char* scene : {"playbot", "mesh", "hard"}) {
        const std::string prefix = fmt::format("splat.{}", scene);
        for (const char* name : {"psnr_float", "psnr_default"}) benchmark.figures.push_back(prefix + "." + name);
        for (const Kind kind : {Float, CutOffs, Storage, Ordering})
            for (const char* what : {"rmse", "largest"})
                benchmark.figures.push_back(fmt::format("{}.{}.{}", prefix, figure_names[kind], what));
    }
    return benchmark;
}

}  // namespace glint::bench
