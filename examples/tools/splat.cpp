// glint splat: looks at scenes of Gaussian splats and converts them. Its subcommands that are longer have a source of
// their own.

#include "tool.h"

#include <glint/format/splats.h>
#include <glint/graphics/splat_model.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

using namespace glint;

namespace tool {

namespace {

using nlohmann::ordered_json;

ordered_json toJson(const SplatReport::Counts& counts) {
    return {{"position", counts.position},
            {"scale", counts.scale},
            {"rotation", counts.rotation},
            {"opacity", counts.opacity},
            {"harmonics", counts.harmonics}};
}

/// "2 (1 position, 1 scale)"
std::string describe(const SplatReport::Counts& counts) {
    const ordered_json kinds = toJson(counts);
    std::string text;
    for (const auto& [name, count] : kinds.items())
        if (count != 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count.get<uint64_t>(), name);
    return text.empty() ? "0" : fmt::format("{} ({})", counts.total(), text);
}

struct InfoOptions {
    std::filesystem::path splats;
    bool json = false;
};

/// What a scene holds.
struct Summary {
    Summary(const Splats& splats, const SplatReport& counted) : report(counted) {
        size = splats.size();
        degree = splats.degree;
        is_antialiased = splats.is_antialiased;
        bounds = splats.bounds();
        for (const float opacity : splats.opacities)
            opacities[std::min(static_cast<size_t>(opacity * 10.0f), opacities.size() - 1)]++;
        std::vector<float> all;
        all.reserve(3 * size);
        for (const Vector3f& scale : splats.scales) all.insert(all.end(), {scale.x, scale.y, scale.z});
        for (size_t i = 0; i < scales.size() && !all.empty(); i++) {
            const size_t place = (all.size() - 1) * i / (scales.size() - 1);
            std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(place), all.end());
            scales[i] = all[place];
        }
        host_bytes = size * (sizeof(Vector3f) * (2 + splats.coefficientCount()) + sizeof(Vector4f) + sizeof(float));
        half_bytes = size * SplatModel::splatSize(degree, SplatModel::StorageHalf);
        float_bytes = size * SplatModel::splatSize(degree, SplatModel::StorageFloat);
    }

    SplatReport report;
    uint64_t size = 0;
    uint32_t degree = 0;
    bool is_antialiased = false;
    BoundBox bounds;
    std::array<float, 5> scales = {};         ///< least, quarter, median, three quarters, greatest
    std::array<uint64_t, 10> opacities = {};  ///< splats in each tenth of 0 to 1
    uint64_t host_bytes = 0, half_bytes = 0, float_bytes = 0;
};

void print(const Summary& summary) {
    fmt::print("splats       {}\n", summary.size);
    fmt::print("  dropped    {}\n", describe(summary.report.dropped));
    fmt::print("  repaired   {}\n", describe(summary.report.repaired));
    fmt::print("degree       {}\n", summary.degree);
    fmt::print("antialiased  {}\n", summary.is_antialiased ? "yes" : "no, or the file has no place for it");
    if (summary.size > 0) {
        const Vector3f &low = summary.bounds.min, &high = summary.bounds.max;
        fmt::print("centres      ({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g})\n", low.x, low.y, low.z, high.x,
                   high.y, high.z);
        fmt::print("scales       {:.3g} to {:.3g}; quarters at {:.3g}, {:.3g}, {:.3g}\n", summary.scales[0],
                   summary.scales[4], summary.scales[1], summary.scales[2], summary.scales[3]);
        fmt::print("opacities\n");
        const uint64_t most = *std::max_element(summary.opacities.begin(), summary.opacities.end());
        for (size_t i = 0; i < summary.opacities.size(); i++) {
            const uint64_t count = summary.opacities[i];
            fmt::print("  {:.1f} to {:.1f} {:>10} {}\n", static_cast<double>(i) / 10.0,
                       static_cast<double>(i + 1) / 10.0, count, std::string((count * 50 + most - 1) / most, '#'));
        }
    }
    const auto mebibytes = [](uint64_t bytes) { return static_cast<double>(bytes) / (1u << 20); };
    fmt::print("memory       {:.1f} MiB on the host, {:.1f} MiB on a device ({:.1f} MiB in float32)\n",
               mebibytes(summary.host_bytes), mebibytes(summary.half_bytes), mebibytes(summary.float_bytes));
}

ordered_json toJson(const Summary& summary) {
    const Vector3f &low = summary.bounds.min, &high = summary.bounds.max;
    ordered_json json = {{"splats", summary.size},
                         {"dropped", toJson(summary.report.dropped)},
                         {"repaired", toJson(summary.report.repaired)},
                         {"degree", summary.degree},
                         {"antialiased", summary.is_antialiased},
                         {"scales", summary.scales},
                         {"opacities", summary.opacities},
                         {"host_bytes", summary.host_bytes},
                         {"device_bytes", {{"half", summary.half_bytes}, {"float", summary.float_bytes}}}};
    if (summary.size > 0) json["centres"] = {{low.x, low.y, low.z}, {high.x, high.y, high.z}};
    return json;
}

int runInfo(const InfoOptions& options) {
    SplatReport report;
    const Expected<Splats> splats = Splats::load(options.splats, Splats::default_limit, &report);
    if (!splats) return fail("splat info", splats.error());
    const Summary summary(*splats, report);
    if (options.json)
        fmt::print("{}\n", toJson(summary).dump(2));
    else
        print(summary);
    return 0;
}

Command splatInfoCommand(CLI::App& app) {
    auto options = std::make_shared<InfoOptions>();
    CLI::App* sub = app.add_subcommand("info", "What a scene of splats holds");
    sub->add_option("SPLATS", options->splats, "Splats (.ply, .splat, .spz)")->required();
    sub->add_flag("--json", options->json, "Print a JSON object");
    return {sub, [options] { return runInfo(*options); }};
}

struct ConvertOptions {
    std::filesystem::path from;
    std::filesystem::path to;
    uint32_t degree = Splats::max_degree;
    float min_opacity = 0.0f;
    bool antialiased = false;
};

/// Keeps the splats that are at least as opaque.
void dropTransparent(Splats& splats, float min_opacity) {
    const size_t coefficients = splats.coefficientCount();
    size_t kept = 0;
    for (size_t i = 0; i < splats.size(); i++) {
        if (splats.opacities[i] < min_opacity) continue;
        splats.positions[kept] = splats.positions[i];
        splats.scales[kept] = splats.scales[i];
        splats.rotations[kept] = splats.rotations[i];
        splats.opacities[kept] = splats.opacities[i];
        if (kept != i)
            std::copy_n(splats.harmonics.data() + i * coefficients, coefficients,
                        splats.harmonics.data() + kept * coefficients);
        kept++;
    }
    splats.positions.resize(kept);
    splats.scales.resize(kept);
    splats.rotations.resize(kept);
    splats.opacities.resize(kept);
    splats.harmonics.resize(kept * coefficients);
}

int runConvert(const ConvertOptions& options) {
    SplatReport report;
    Expected<Splats> splats = Splats::load(options.from, Splats::default_limit, &report);
    if (!splats) return fail("splat convert", splats.error());
    const size_t read = splats->size();
    splats->reduceDegree(options.degree);
    dropTransparent(*splats, options.min_opacity);
    splats->is_antialiased |= options.antialiased;
    if (Status status = splats->save(options.to); !status) return fail("splat convert", status.error());
    fmt::print("{} of {} splats written, of degree {}; {} dropped, {} repaired, {} too transparent\n", splats->size(),
               report.splats, splats->degree, describe(report.dropped), describe(report.repaired),
               read - splats->size());
    return 0;
}

Command splatConvertCommand(CLI::App& app) {
    auto options = std::make_shared<ConvertOptions>();
    CLI::App* sub = app.add_subcommand("convert", "Writes a scene of splats in another format");
    sub->add_option("FROM", options->from, "Splats to read (.ply, .splat, .spz)")->required();
    sub->add_option("TO", options->to, "Where to write them (.ply, .splat, .spz)")->required();
    sub->add_option("--degree", options->degree, "Leave out harmonics of higher degrees")
        ->type_name("0|1|2|3")
        ->check(CLI::Range(0u, Splats::max_degree));
    sub->add_option("--min-opacity", options->min_opacity, "Leave out splats of a lower opacity")
        ->type_name("X")
        ->check(CLI::Range(0.0f, 1.0f));
    sub->add_flag("--antialiased", options->antialiased,
                  "Say that the scene was made for the filter of Mip-Splatting (.spz)");
    return {sub, [options] { return runConvert(*options); }};
}

}  // namespace

Command splatCommand(CLI::App& app) {
    CLI::App* sub = app.add_subcommand("splat", "Gaussian splats: looks at scenes, converts, renders and makes them");
    sub->require_subcommand(1);
    const std::vector<Command> commands = {splatInfoCommand(*sub), splatConvertCommand(*sub), splatRenderCommand(*sub),
                                           splatFromMeshCommand(*sub)};
    return {sub, [commands] {
                for (const Command& command : commands)
                    if (command.app->parsed()) return command.run();
                return static_cast<int>(ExitUsage);
            }};
}

}  // namespace tool
