// glint: looks at adapters, compiles and converts shaders, casts rays at meshes, handles Gaussian splats. One source
// for each subcommand.

#include "tool.h"

#include "common/example.h"

#include <fmt/format.h>

#include <array>
#include <cstdio>

namespace tool {

namespace {

/// Errors that are nobody's wrong input.
bool isFailure(const glint::Error& error) {
    switch (error.code()) {
        case glint::ErrorCode::OutOfMemory:
        case glint::ErrorCode::DeviceLost:
        case glint::ErrorCode::ShaderCompile:
        case glint::ErrorCode::Internal: return true;
        default: break;
    }
    for (const char* group : {"file.", "device.", "shader.", "vulkan."})
        if (error.id().starts_with(group)) return true;
    return false;
}

}  // namespace

glint::Device openDevice(glint::DeviceDesc desc) {
    desc.message = [](const glint::Message& message) {
        if (message.error.id() == "vulkan.validation") fmt::print(stderr, "{}\n", message.error.text());
    };
    return glint::Device::create(desc);
}

void addTracing(CLI::App& app, glint::TracingEngine& engine) {
    // The check has it before the function is called.
    app.add_option_function<std::string>(
           "--tracing", [](const std::string&) {}, "Engine for ray tracing")
        ->type_name("auto|driver|software")
        ->default_str("auto")
        ->check([&engine](const std::string& text) { return parseTracingEngine(text, engine); });
}

void addDevice(CLI::App& app, std::string& adapter, std::string& api) {
    app.add_option("--adapter", adapter, "Adapter: its index or a part of its name")->type_name("N|NAME");
    app.add_option("--api", api, "Graphics API")->type_name("NAME");
}

CLI::Option* addVector(CLI::App& app, const std::string& flag, glint::Vector3f& value, const std::string& help) {
    return app
        .add_option_function<std::vector<float>>(
            flag,
            [&value](const std::vector<float>& numbers) {
                value = {numbers[0], numbers[1], numbers[2]};
            },
            help)
        ->type_name("X,Y,Z")
        ->delimiter(',')
        ->expected(3)
        ->default_str(fmt::format("{},{},{}", value.x, value.y, value.z));
}

int fail(const char* command, const glint::Error& error) {
    // Whoever calls the program has no use for a line of its sources; of a shader or a mesh, yes.
    const bool in_sources = error.file().ends_with(".cpp");
    const std::string text = in_sources ? fmt::format("{} [{}]", error.message(), error.id()) : error.text();
    fmt::print(stderr, "glint {}: {}\n", command, text);
    return isFailure(error) ? ExitFailure : ExitUsage;
}

int failUsage(const char* command, const std::string& text) {
    fmt::print(stderr, "glint {}: {} ('glint {} --help' tells more) [tool.arguments]\n", command, text, command);
    return ExitUsage;
}

}  // namespace tool

int main(int argc, char** argv) {
    CLI::App app(
        "Looks at adapters, compiles and converts shaders, casts rays at meshes, handles Gaussian splats and meshes.",
        "glint");
    app.set_help_flag("-h,--help", "Print this and end");
    app.require_subcommand(1);
    const std::array commands = {tool::infoCommand(app), tool::shaderCommand(app), tool::castCommand(app),
                                 tool::splatCommand(app), tool::meshCommand(app)};
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        for (const tool::Command& command : commands) {
            if (!command.app->parsed()) continue;
            fmt::print("{}", command.app->help());
            return 0;
        }
        fmt::print("{}", app.help());
        return 0;
    } catch (const CLI::ParseError& error) {
        for (const tool::Command& command : commands)
            if (command.app->parsed()) return tool::failUsage(command.app->get_name().c_str(), error.what());
        fmt::print(stderr, "glint: {} ('glint --help' lists the subcommands) [tool.arguments]\n", error.what());
        return tool::ExitUsage;
    }
    for (const tool::Command& command : commands)
        if (command.app->parsed()) return command.run();
    return tool::ExitUsage;
}
