// overhead.startup: the time from starting examples/00_hello_triangle to its picture on the disk, over that of a
// hand-written twin. Shader caches are warm on both sides: Glint's own, and the driver's.

#include "bench/bench.h"

#include "support/files.h"

#include <fmt/format.h>
#include <glint/base/file.h>
#include <glint/format/image.h>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/inotify.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>

extern char** environ;  // NOLINT(readability-redundant-declaration): POSIX leaves it to the program

namespace glint::bench {

namespace {

constexpr const char* width = "512";
constexpr const char* size = "512x512";
constexpr uint32_t warm_up = 3;
constexpr uint32_t rounds = 21;

/// Notices when a file of a folder is complete: written and closed, or moved there.
class FileWatch {
public:
    explicit FileWatch(const std::filesystem::path& folder) : notify_(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {
        if (notify_ < 0 || ::inotify_add_watch(notify_, folder.c_str(), IN_CLOSE_WRITE | IN_MOVED_TO) < 0)
            throw std::runtime_error("cannot watch " + folder.string());
    }
    ~FileWatch() { ::close(notify_); }
    FileWatch(const FileWatch&) = delete;
    FileWatch& operator=(const FileWatch&) = delete;

    bool wait(const std::string& name, int milliseconds) {
        const double end = wallSeconds() + milliseconds * 1e-3;
        alignas(inotify_event) std::array<char, 4096> events = {};
        while (wallSeconds() < end) {
            pollfd descriptor = {notify_, POLLIN, 0};
            if (::poll(&descriptor, 1, milliseconds) <= 0) return false;
            const ssize_t bytes = ::read(notify_, events.data(), events.size());
            for (ssize_t at = 0; at < bytes;) {
                const auto* event = reinterpret_cast<const inotify_event*>(events.data() + at);
                if (event->len != 0 && name == event->name) return true;
                at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
            }
        }
        return false;
    }

private:
    int notify_;
};

struct Run {
    double picture = 0.0;  ///< seconds until the picture is complete
    double exit = 0.0;     ///< seconds until the process is gone
};

Run start(const std::vector<std::string>& command, const std::filesystem::path& picture) {
    std::filesystem::remove(picture);
    FileWatch watch(picture.parent_path());
    std::vector<char*> arguments;
    arguments.reserve(command.size() + 1);
    for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);

    const double begin = wallSeconds();
    pid_t child = 0;
    const int result = ::posix_spawn(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    if (result != 0) throw std::runtime_error("cannot start " + command[0] + ": " + std::strerror(result));
    const bool written = watch.wait(picture.filename().string(), 30000);
    const double seen = wallSeconds();
    int status = 0;
    ::waitpid(child, &status, 0);
    const double end = wallSeconds();
    if (!written || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
        throw std::runtime_error(command[0] + " wrote no picture");
    return {seen - begin, end - begin};
}

void saveWords(const std::filesystem::path& path, Shader::Type type, const std::filesystem::path& source,
               const char* macros) {
    const Shader shader = check(Shader::loadGLSL(type, source.string(), macros));
    check(writeFile(path, std::as_bytes(shader.getWords())));
}

void run(Report& report) {
    const std::filesystem::path programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
    const std::filesystem::path example = programs.parent_path() / "examples" / "00_hello_triangle";
    const std::filesystem::path twin = programs / "startup_twin";
    if (!std::filesystem::exists(example)) throw std::runtime_error(example.string() + " has not been built");

    const test::TempDir folder;
    const std::filesystem::path shader =
        std::filesystem::path(GLINT_SOURCE_DIR) / "examples" / "00_hello_triangle" / "main.shader";
    saveWords(folder / "vertex.spv", Shader::TypeVertex, shader, "VERTEX_SHADER=1");
    saveWords(folder / "fragment.spv", Shader::TypeFragment, shader, "FRAGMENT_SHADER=1");
    const std::filesystem::path glint_picture = folder / "glint.png";
    const std::filesystem::path twin_picture = folder / "twin.png";
    const std::vector<std::string> glint_command = {example.string(), "--size", size, "--image",
                                                    glint_picture.string()};
    const std::vector<std::string> twin_command = {twin.string(),
                                                   (folder / "vertex.spv").string(),
                                                   (folder / "fragment.spv").string(),
                                                   twin_picture.string(),
                                                   width,
                                                   width};

    Times glint_times, twin_times, glint_exits, twin_exits;
    for (uint32_t i = 0; i < warm_up + rounds; i++) {
        const Run glint = start(glint_command, glint_picture);
        const Run twin_run = start(twin_command, twin_picture);
        if (i < warm_up) continue;
        glint_times.values.push_back(glint.picture);
        glint_exits.values.push_back(glint.exit);
        twin_times.values.push_back(twin_run.picture);
        twin_exits.values.push_back(twin_run.exit);
    }
    const Image glint_image = *check(Image::load(glint_picture));
    const Image twin_image = *check(Image::load(twin_picture));
    if (!std::ranges::equal(glint_image.bytes(), twin_image.bytes()))
        throw std::runtime_error("the programs drew different pictures");
    printTimes("Glint, to the picture", glint_times);
    printTimes("Vulkan, to the picture", twin_times);
    printTimes("Glint, to the exit", glint_exits);
    printTimes("Vulkan, to the exit", twin_exits);
    report.add("overhead.startup", glint_times.median() / twin_times.median(), "ratio", "hand-written Vulkan",
               deviceName(createDevice()));
}

}  // namespace

Benchmark startupBenchmark() { return {{"overhead.startup"}, run}; }

}  // namespace glint::bench
