#include "support/files.h"

#include <fmt/format.h>

#include <unistd.h>

#include <atomic>
#include <cstdlib>

namespace glint::test {

namespace fs = std::filesystem;

TempDir::TempDir() {
    static std::atomic<int> counter = 0;
    path_ = fs::temp_directory_path() / fmt::format("glint-test-{}-{}", ::getpid(), counter++);
    fs::create_directories(path_);
}

TempDir::~TempDir() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
}

fs::path outputDir() {
    const char* chosen = std::getenv("GLINT_TEST_OUTPUT");
    fs::path path = chosen && *chosen ? fs::path(chosen) : fs::path(GLINT_SOURCE_DIR) / "out" / "test";
    std::error_code ignored;
    fs::create_directories(path, ignored);
    return path;
}

fs::path testsDir() { return fs::path(GLINT_SOURCE_DIR) / "tests"; }

fs::path bunnyPath() {
    const fs::path path = "/usr/share/glmark2/models/bunny.obj";
    std::error_code ignored;
    return fs::exists(path, ignored) ? path : fs::path();
}

fs::path assimpModelPath(std::string_view name) {
    const fs::path path = fs::path("/usr/share/assimp/models") / name;
    std::error_code ignored;
    return fs::exists(path, ignored) ? path : fs::path();
}

}  // namespace glint::test
