// shader.compile.*: what a shader costs from its text to its optimised module, and from the disk cache, in time of the
// thread that compiles. `small` is a kernel of ten lines, `first` the same as the first shader of a process; `driver`
// and `software` are 05_hello_tracing's compute shader, with the driver's ray queries and rewritten for Glint's engine.

#include "bench/bench.h"
#include "support/files.h"

#include <fmt/format.h>
#include <glint/base/file.h>
#include <glint/shader/shader_compiler.h>

#include <sys/wait.h>
#include <unistd.h>

namespace glint::bench {

namespace {

constexpr const char* small_text = R"(
layout(local_size_x = 64) in;
layout(binding = 0) uniform Parameters { uint count; float factor; };
layout(binding = 1) readonly buffer Source { float source[]; };
layout(binding = 2) writeonly buffer Values { float values[]; };
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    values[i] = factor * source[i];
}
)";

ShaderSource smallSource() {
    ShaderSource source;
    source.name = "small.shader";
    source.text = small_text;
    return source;
}

ShaderSource exampleSource(const char* library) {
    const std::filesystem::path path = test::testsDir().parent_path() / "examples/05_hello_tracing/main.shader";
    ShaderSource source;
    source.name = path.string();
    source.text = *check(readTextFile(path));
    source.macros = "COMPUTE_SHADER=1";
    source.tracing.library = library;
    return source;
}

double secondsOf(const ShaderSource& source, bool is_cached) {
    const double begin = threadSeconds();
    const Expected<CompiledShader> shader = compileShader(source);
    const double end = threadSeconds();
    check(shader);
    if (shader->from_cache != is_cached)
        throw std::runtime_error("the cache was hit, or missed, where it should not be");
    return end - begin;
}

/// The same in a child, so that the compiler has not been used before.
double secondsInProcess(const ShaderSource& source, bool is_cached) {
    int ends[2];
    if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
    const pid_t child = ::fork();
    if (child == 0) {
        double seconds = -1.0;
        try {
            seconds = secondsOf(source, is_cached);
        } catch (const std::exception&) {}  // told by -1
        ::_exit(::write(ends[1], &seconds, sizeof(seconds)) == sizeof(seconds) ? 0 : 1);
    }
    ::close(ends[1]);
    double seconds = -1.0;
    const bool is_read = ::read(ends[0], &seconds, sizeof(seconds)) == sizeof(seconds);
    ::close(ends[0]);
    if (child > 0) ::waitpid(child, nullptr, 0);
    if (!is_read || seconds < 0.0) throw std::runtime_error("a process could not compile a shader");
    return seconds;
}

void run(Report& report) {
    const auto measure = [&](const char* name, const char* against, const ShaderSource& source, uint32_t rounds,
                             const auto& seconds) {
        Times cold, cached;
        setShaderCache({});
        for (uint32_t i = 0; i < rounds; i++) cold.values.push_back(seconds(source, false));
        const test::TempDir cache;
        setShaderCache(cache.path());
        seconds(source, false);
        for (uint32_t i = 0; i < 3 * rounds; i++) cached.values.push_back(seconds(source, true));
        setShaderCache({});
        const std::string figure = fmt::format("shader.compile.{}", name);
        printTimes(figure, cold);
        printTimes(figure + "_cached", cached);
        report.add(figure + "_ms", cold.median() * 1e3, "ms", against, processorName());
        report.add(figure + "_cached_ms", cached.median() * 1e3, "ms",
                   fmt::format("{:.1f} ms without the cache", cold.median() * 1e3), processorName());
    };
    // Before this process compiles anything itself: this benchmark has to be the first.
    measure("first", "the next shader, shader.compile.small_ms", smallSource(), 11, secondsInProcess);
    measure("small", "the first shader, shader.compile.first_ms", smallSource(), 31, secondsOf);
    measure("driver", "software ray queries, shader.compile.software_ms", exampleSource(""), 15, secondsOf);
    const ShaderSource software = exampleSource("glint/tracing/query.h");
    check(compileShader(software));  // the library itself is compiled once a process
    measure("software", "the driver's ray queries, shader.compile.driver_ms", software, 7, secondsOf);
}

}  // namespace

Benchmark shaderCompileBenchmark() {
    Benchmark benchmark{{}, run};
    for (const char* name : {"first", "small", "driver", "software"})
        for (const char* kind : {"_ms", "_cached_ms"})
            benchmark.figures.push_back(fmt::format("shader.compile.{}{}", name, kind));
    return benchmark;
}

}  // namespace glint::bench
