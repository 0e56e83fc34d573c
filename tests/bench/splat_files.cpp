// splat.files.*: what formats of files leave of a picture, and their sizes.

#include "bench/splat_views.h"

#include <glint/format/splats.h>

#include <fmt/format.h>

namespace glint::bench {

namespace {

using test::SplatScene;

struct FileFormat {
    const char* name;
    Expected<std::vector<std::byte>> (*encode)(const Splats&);
    Expected<Splats> (*parse)(std::span<const std::byte>, const std::string&, uint64_t, SplatReport*);
};
constexpr FileFormat formats[] = {
    {"ply", encodePlySplats, parsePlySplats}, {"spz", encodeSpz, parseSpz}, {"splat", encodeDotSplat, parseDotSplat}};

void run(Report& report) {
    const Device device = createDevice();
    test::SplatDrawer drawer(device);
    for (const SplatScene& scene : splatViews()) {
        const auto picture = drawer.draw(scene, SplatModel::StorageFloat);
        const auto compare = [&](const std::string& name, const Splats& splats) {
            SplatScene changed = scene;
            changed.splats = splats;
            const auto error = test::comparePictures(drawer.draw(changed, SplatModel::StorageFloat), picture);
            report.add(fmt::format("splat.files.{}.psnr_{}", scene.name, name), error.psnr(), "dB",
                       "the picture of the splats before they were written", deviceName(device));
        };
        for (const FileFormat& format : formats) {
            const std::vector<std::byte> file = *check(format.encode(scene.splats));
            const double bytes = static_cast<double>(file.size()) / static_cast<double>(scene.splats.size());
            fmt::print("{}.{}: {} bytes, {:.1f} a splat\n", scene.name, format.name, file.size(), bytes);
            compare(format.name, *check(format.parse(file, format.name, Splats::default_limit, nullptr)));
        }
        Splats plain = scene.splats;
        plain.reduceDegree(0);
        compare("degree_0", plain);
    }
}

}  // namespace

Benchmark splatFilesBenchmark() {
    Benchmark benchmark{{}, run};
    for (const char* scene : {"playbot", "mesh"})
        for (const char* kind : {"ply", "spz", "splat", "degree_0"})
            benchmark.figures.push_back(fmt::format("splat.files.{}.psnr_{}", scene, kind));
    return benchmark;
}

}  // namespace glint::bench
