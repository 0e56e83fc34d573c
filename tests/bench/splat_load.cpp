// splat.load.*: Splats::load of a large PLY file against read() of the same file, both from the page cache.

#include "bench/bench.h"

#include "support/files.h"
#include "support/splat_files.h"
#include "support/splat_scenes.h"

#include <glint/base/file.h>
#include <glint/format/ply.h>
#include <glint/format/splats.h>

#include <fmt/format.h>

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <memory>

namespace glint::bench {

namespace {

constexpr uint64_t file_size = 1ull << 30;
constexpr uint32_t rounds = 7;

/// Writes the scene that $GLINT_SPLATS names, or one that is made for it, over and over into one file.
std::string replicate(const std::filesystem::path& path) {
    const std::filesystem::path scene = test::splatsPath();
    const bool is_real = scene.extension() == ".ply";
    const std::vector<std::byte> bytes =
        is_real ? *check(readFile(scene)) : *check(encodePlySplats(test::randomSplats(30'000, 3, 1)));
    const PlyHeader header = *check(parsePlyHeader(bytes, scene.string()));
    const PlyElement& vertices = header.elements.at(0);
    std::string text(reinterpret_cast<const char*>(bytes.data()), header.size);
    const std::string count = fmt::format("vertex {}", vertices.count);
    const size_t at = text.find(count);
    if (at == std::string::npos || header.elements.size() != 1 || vertices.has_list || vertices.count == 0)
        throw std::runtime_error(scene.string() + " is no plain file of splats");
    const std::span<const std::byte> rows = std::span(bytes).subspan(header.size, vertices.count * vertices.stride);
    const uint64_t times = file_size / rows.size();
    text.replace(at, count.size(), fmt::format("vertex {}", vertices.count * times));
    std::ofstream file(path, std::ios::binary);
    file << text;
    for (uint64_t i = 0; i < times; i++)
        file.write(reinterpret_cast<const char*>(rows.data()), static_cast<std::streamsize>(rows.size()));
    file.close();
    if (!file) throw std::runtime_error("cannot write " + path.string());
    return fmt::format("{} times {}", times, is_real ? scene.filename().string() : "a scene of 30000 splats");
}

double secondsOf(const std::function<void()>& work) {
    const double begin = wallSeconds();
    work();
    return wallSeconds() - begin;
}

struct Released {
    void operator()(std::byte* bytes) const { std::free(bytes); }
};
using Memory = std::unique_ptr<std::byte, Released>;

/// read() of a file, `piece` bytes at a time.
void readAll(int descriptor, uint64_t size, std::byte* to, uint64_t piece, bool is_reused) {
    for (uint64_t done = 0; done < size;) {
        const ssize_t count =
            ::pread(descriptor, is_reused ? to : to + done, std::min(piece, size - done), static_cast<off_t>(done));
        if (count <= 0) throw std::runtime_error("cannot read");
        done += static_cast<uint64_t>(count);
    }
}

void run(Report& report) {
    const test::TempDir folder;
    if (std::filesystem::space(folder.path()).available < 2 * file_size) {
        fmt::print("  left out: {} has no room for a file of 1 GiB\n\n", folder.path().string());
        return;
    }
    const std::filesystem::path path = folder / "large.ply";
    const std::string content = replicate(path);
    const uint64_t size = std::filesystem::file_size(path);
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) throw std::runtime_error("cannot open " + path.string());

    constexpr uint64_t piece = 1u << 20;
    const Memory reused(static_cast<std::byte*>(std::calloc(1, piece)));
    Times fresh_read, reused_read, load;
    uint64_t splats = 0;
    for (uint32_t i = 0; i <= rounds; i++) {
        const double reused_seconds = secondsOf([&] { readAll(descriptor, size, reused.get(), piece, true); });
        const double fresh_seconds = secondsOf([&] {
            const Memory memory(static_cast<std::byte*>(std::malloc(size)));
            readAll(descriptor, size, memory.get(), size, false);
        });
        const double load_seconds = secondsOf([&] { splats = check(Splats::load(path))->size(); });
        // In the first round the file comes into the page cache.
        if (i == 0) continue;
        reused_read.values.push_back(reused_seconds);
        fresh_read.values.push_back(fresh_seconds);
        load.values.push_back(load_seconds);
    }
    ::close(descriptor);
    fmt::print("{} bytes, {} splats: {}\n", size, splats, content);
    printTimes("Splats::load", load);
    printTimes("  read() into memory of its own", fresh_read);
    printTimes("  read() into the same 1 MiB over and over", reused_read);
    report.add("splat.load.over_read", fresh_read.median() / load.median(), "ratio of speeds",
               "read() of the file into memory of its own", processorName());
    report.add("splat.load.over_read_reused", reused_read.median() / load.median(), "ratio of speeds",
               "read() of the file into 1 MiB over and over", processorName());
}

}  // namespace

Benchmark splatLoadBenchmark() { return {{"splat.load.over_read", "splat.load.over_read_reused"}, run}; }

}  // namespace glint::bench
