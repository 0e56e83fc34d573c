#pragma once

// What the subcommands of `glint` share.

#include <glint/base/error.h>
#include <glint/device/device.h>
#include <glint/math/math.h>

#include <CLI/CLI.hpp>

#include <functional>
#include <string>

namespace tool {

/// Exit statuses beside 0.
enum Exit : int {
    ExitFailure = 1,       ///< a file, a driver or a compiler failed
    ExitUsage = 2,         ///< wrong arguments or malformed input
    ExitInterrupted = 130  ///< by SIGINT or SIGTERM
};

/// A subcommand: its arguments, and what runs once they are read. Returns the exit status.
struct Command {
    CLI::App* app = nullptr;
    std::function<int()> run;
};

// One for each source of this folder.
Command infoCommand(CLI::App& app);
Command shaderCommand(CLI::App& app);
Command castCommand(CLI::App& app);
Command splatCommand(CLI::App& app);
Command meshCommand(CLI::App& app);

// Subcommands of `glint splat` that have a source of their own.
Command splatRenderCommand(CLI::App& app);
Command splatFromMeshCommand(CLI::App& app);

// Subcommands of `glint mesh` that have a source of their own.
Command meshInfoCommand(CLI::App& app);
Command meshLodCommand(CLI::App& app);

/// Adds --adapter and --api: where to compute.
void addDevice(CLI::App& app, std::string& adapter, std::string& api);
/// A device of which only the validation layer's messages are printed: errors are returned too, and one line is enough.
glint::Device openDevice(glint::DeviceDesc desc);
/// Adds an option of three numbers: X,Y,Z.
CLI::Option* addVector(CLI::App& app, const std::string& flag, glint::Vector3f& value, const std::string& help);
/// Adds --tracing auto|driver|software: the engine for ray tracing.
void addTracing(CLI::App& app, glint::TracingEngine& engine);

/// Prints "glint cast: what went wrong [id]" on stderr and returns the status that fits.
int fail(const char* command, const glint::Error& error);
/// The same for arguments that are wrong, with the id "tool.arguments".
int failUsage(const char* command, const std::string& text);

}  // namespace tool
