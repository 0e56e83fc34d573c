// glint splat: looks at scenes of Gaussian splats and converts them. Its subcommands that are longer have a source of
// their own.

#include "tool.h"

#include <glint/format/splats.h>

#include <fmt/format.h>

#include <memory>
#include <vector>

using namespace glint;

namespace tool {

namespace {

struct InfoOptions {
    std::filesystem::path splats;
};

int runInfo(const InfoOptions& options) {
    SplatReport report;
    const Expected<Splats> splats = Splats::load(options.splats, Splats::default_limit, &report);
    if (!splats) return fail("splat info", splats.error());
    const BoundBox bounds = splats->bounds();
    fmt::print("splats     {}\n", splats->size());
    fmt::print("degree     {}\n", splats->degree);
    fmt::print("bounds     ({}, {}, {}) to ({}, {}, {})\n", bounds.min.x, bounds.min.y, bounds.min.z, bounds.max.x,
               bounds.max.y, bounds.max.z);
    return 0;
}

Command splatInfoCommand(CLI::App& app) {
    auto options = std::make_shared<InfoOptions>();
    CLI::App* sub = app.add_subcommand("info", "What a scene of splats holds");
    sub->add_option("SPLATS", options->splats, "Splats (.ply, .splat, .spz)")->required();
    return {sub, [options] { return runInfo(*options); }};
}

struct ConvertOptions {
    std::filesystem::path from;
    std::filesystem::path to;
};

int runConvert(const ConvertOptions& options) {
    const Expected<Splats> splats = Splats::load(options.from);
    if (!splats) return fail("splat convert", splats.error());
    if (Status status = splats->save(options.to); !status) return fail("splat convert", status.error());
    return 0;
}

Command splatConvertCommand(CLI::App& app) {
    auto options = std::make_shared<ConvertOptions>();
    CLI::App* sub = app.add_subcommand("convert", "Writes a scene of splats in another format");
    sub->add_option("FROM", options->from, "Splats to read (.ply, .splat, .spz)")->required();
    sub->add_option("TO", options->to, "Where to write them (.ply, .splat, .spz)")->required();
    return {sub, [options] { return runConvert(*options); }};
}

}  // namespace

Command splatCommand(CLI::App& app) {
    CLI::App* sub = app.add_subcommand("splat", "Gaussian splats: looks at scenes, converts them");
    sub->require_subcommand(1);
    const std::vector<Command> commands = {splatInfoCommand(*sub), splatConvertCommand(*sub)};
    return {sub, [commands] {
                for (const Command& command : commands)
                    if (command.app->parsed()) return command.run();
                return static_cast<int>(ExitUsage);
            }};
}

}  // namespace tool
