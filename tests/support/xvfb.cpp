#include "support/xvfb.h"

#include "support/files.h"

#include <glint/base/file.h>

#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <memory>
#include <optional>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace glint::test {

namespace {

/// The server's process, ended with the tests.
class Server : public ::testing::Environment {
public:
    void TearDown() override {
        if (process > 0) {
            kill(process, SIGTERM);
            waitpid(process, nullptr, 0);
        }
        process = 0;
        folder.reset();
    }

    pid_t process = 0;
    std::optional<TempDir> folder;
};

Server* const server = [] {
    auto* environment = new Server;
    ::testing::AddGlobalTestEnvironment(environment);
    return environment;
}();

uint32_t word(const std::string& bytes, size_t index) {
    uint32_t value = 0;
    for (size_t i = 0; i < 4; i++) value = value << 8 | static_cast<uint8_t>(bytes.at(index * 4 + i));
    return value;
}

}  // namespace

Xvfb& Xvfb::get() {
    static Xvfb xvfb;
    return xvfb;
}

void Xvfb::start() {
    is_installed_ = std::system("command -v Xvfb > /dev/null 2>&1") == 0;
    if (!is_installed_) return;
    server->folder.emplace();
    const std::string folder = server->folder->path().string();
    picture_ = folder + "/Xvfb_screen0";
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    server->process = fork();
    if (server->process == 0) {
        prctl(PR_SET_PDEATHSIG, SIGTERM);  // it must not outlive a crashing test
        close(ends[0]);
        const std::string number = std::to_string(ends[1]);
        execlp("Xvfb", "Xvfb", "-displayfd", number.c_str(), "-screen", "0", "1024x768x24", "-fbdir", folder.c_str(),
               "-nolisten", "tcp", "-noreset", nullptr);
        _exit(127);
    }
    close(ends[1]);
    // The server writes the number of the display that it has found free, once it is ready.
    std::string display = ":";
    char c = 0;
    while (read(ends[0], &c, 1) == 1 && c != '\n') display += c;
    close(ends[0]);
    ASSERT_GT(display.size(), 1u) << "Xvfb did not start";
    setenv("DISPLAY", display.c_str(), 1);
    unsetenv("WAYLAND_DISPLAY");
}

Image Xvfb::screen() const {
    // An XWD file of version 7: a header of big-endian words, its size first, then the colour map, then rows of BGRX.
    const Expected<std::string> bytes = readTextFile(picture_);
    EXPECT_TRUE(bytes) << bytes.error().text();
    if (!bytes || bytes->size() < 100) return Image();
    const uint32_t width = word(*bytes, 4), height = word(*bytes, 5), stride = word(*bytes, 12);
    const size_t begin = word(*bytes, 0) + word(*bytes, 19) * size_t(12);
    Expected<Image> image = Image::create(FormatRGBAu8n, width, height);
    EXPECT_TRUE(image && word(*bytes, 11) == 32 && bytes->size() >= begin + size_t(stride) * height);
    if (!image || bytes->size() < begin + size_t(stride) * height) return Image();
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            const char* from = bytes->data() + begin + size_t(y) * stride + size_t(x) * 4;
            const auto to = image->texel(x, y);
            for (size_t i = 0; i < 3; i++) to[i] = static_cast<std::byte>(from[2 - i]);
            to[3] = std::byte(255);
        }
    return *image;
}

}  // namespace glint::test
