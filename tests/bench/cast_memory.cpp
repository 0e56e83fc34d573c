// cast.peak_mib.*: memory of `glint cast` at its largest, for arrays of two lengths: rays stream, so it is the same.

#include "bench/bench.h"

#include "support/files.h"

#include <fmt/format.h>
#include <glint/base/file.h>
#include <glint/format/npy.h>
#include <glint/geometry/primitives.h>
#include <glint/graphics/ray_caster.h>

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

extern char** environ;  // NOLINT(readability-redundant-declaration): POSIX leaves it to the program

namespace glint::bench {

namespace {

/// Rays of which every 256th meets the mesh: what they cost is not the question.
void writeRays(const std::filesystem::path& path, uint64_t count) {
    NpyWriter writer = std::move(*check(NpyWriter::create(path, {{NpyField::of<float>()}, {count, 8}})));
    std::vector<Ray> rays(1u << 16);
    for (size_t i = 0; i < rays.size(); i++)
        rays[i] = {{i % 256 ? 100.0f : 1.0f, 0.01f, 5.0f}, 0.0f, {0.0f, 0.0f, -1.0f}, 100.0f};
    for (uint64_t left = count; left > 0;) {
        const size_t now = std::min<uint64_t>(left, rays.size());
        check(writer.write(std::as_bytes(std::span(rays).first(now))));
        left -= now;
    }
    check(writer.close());
}

/// Runs a program: the most memory that it had, in MiB.
double peakOf(const std::vector<std::string>& command) {
    std::vector<char*> arguments;
    arguments.reserve(command.size() + 1);
    for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    pid_t child = 0;
    const int result = ::posix_spawn(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    if (result != 0) throw std::runtime_error("cannot start " + command[0] + ": " + std::strerror(result));
    int status = 0;
    rusage usage = {};
    if (::wait4(child, &status, 0, &usage) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
        throw std::runtime_error(command[0] + " failed");
    return static_cast<double>(usage.ru_maxrss) / 1024.0;  // Linux counts KiB
}

void run(Report& report) {
    const Device device = createDevice();
    if (!device.getFeatures().computeTracing) {
        fmt::print("  left out: {} has no ray queries\n\n", device.getInfo().name);
        return;
    }
    const std::filesystem::path programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
    const std::filesystem::path tool = programs.parent_path() / "examples" / "glint";
    if (!std::filesystem::exists(tool)) throw std::runtime_error(tool.string() + " has not been built");
    const test::TempDir folder;
    check(createTorus(1.0f, 0.4f, 40, 20).save(folder / "torus.ply"));
    for (const auto& [name, count] : {std::pair("1m", 1'000'000u), std::pair("10m", 10'000'000u)}) {
        writeRays(folder / "rays.npy", count);
        const double peak = peakOf({tool.string(), "cast", (folder / "torus.ply").string(),
                                    (folder / "rays.npy").string(), (folder / "hits.npy").string()});
        report.add(fmt::format("cast.peak_mib.{}", name), peak, "MiB",
                   fmt::format("{} rays of 32 bytes, hits of 28", count), deviceName(device));
    }
}

}  // namespace

Benchmark castMemoryBenchmark() { return {{"cast.peak_mib.1m", "cast.peak_mib.10m"}, run}; }

}  // namespace glint::bench
