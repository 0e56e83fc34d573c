// Every example in a window, against what it renders without one.

#include "support/files.h"
#include "support/image_compare.h"
#include "support/xvfb.h"

#include <glint/base/file.h>
#include <glint/format/image.h>

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <string>

namespace glint::test {

namespace {

struct Outcome {
    int status = -1;
    std::string messages;  ///< stderr: validation layers speak there
};

Outcome start(const std::string& program, const std::string& arguments, const TempDir& folder) {
    const std::string messages = (folder / "messages.txt").string();
    const std::string command =
        "GLINT_VALIDATION=1 '" GLINT_EXAMPLES "/" + program + "' " + arguments + " > /dev/null 2> '" + messages + "'";
    Outcome run;
    run.status = std::system(command.c_str());
    run.messages = readTextFile(messages).value_or("");
    return run;
}

Image load(const TempDir& folder, std::string_view name) {
    Expected<Image> image = Image::load(folder / name);
    EXPECT_TRUE(image) << image.error().text();
    return image.value_or(Image());
}

/// The columns of an image from x on.
Image rightOf(const Image& image, uint32_t x) {
    Image part = Image::create(image.format(), image.width() - x, image.height()).value();
    for (uint32_t y = 0; y < image.height(); y++)
        std::memcpy(part.texel(0, y).data(), image.texel(x, y).data(), size_t(part.width()) * image.texelSize());
    return part;
}

/// What a window shows is the picture that is rendered without one, and the panel on its left.
void expectSame(const std::string& program, const std::string& arguments, const ImageTolerance& tolerance) {
    GLINT_NEED_XVFB();
    const TempDir folder;
    const std::string path = folder.path().string();
    const std::string common = " --size 560x240 " + arguments;
    Outcome run = start(program, "--image '" + path + "/plain.png'" + common, folder);
    ASSERT_EQ(run.status, 0) << run.messages;
    run = start(program,
                "--window --frames 3 --image '" + path + "/window.png' --screenshot '" + path + "/screen.png'" + common,
                folder);
    ASSERT_EQ(run.status, 0) << run.messages;
    EXPECT_EQ(run.messages, "");
    const Image plain = load(folder, "plain.png"), window = load(folder, "window.png");
    const Image screen = load(folder, "screen.png");
    ASSERT_EQ(screen.width(), 560u);
    EXPECT_TRUE(imagesMatch(window, plain, program + "_window", tolerance));
    EXPECT_TRUE(imagesMatch(rightOf(screen, 340), rightOf(window, 340), program + "_screen", {}));
    EXPECT_FALSE(screen == window) << "the panel is missing";
}

}  // namespace

TEST(WindowExample, Triangle) { expectSame("00_hello_triangle", "--time 0.5", {}); }

// The order in which particles blend differs from run to run: tests/golden/examples_test.cpp has the bound.
TEST(WindowExample, Particles) {
    expectSame("02_hello_compute", "--time 0.5", {.channel = 5.5f / 255.0f, .texels = 1344});
}

// The same rays, from the same driver.
TEST(WindowExample, Tracing) { expectSame("05_hello_tracing", "--time 0 --single", {}); }

// Two draws of the same splats are equal to the bit.
TEST(WindowExample, Splats) { expectSame("07_hello_splatting", "--time 0 --count 3000", {}); }

TEST(WindowExample, WithoutADisplayThereIsAPictureAllTheSame) {
    const TempDir folder;
    const std::string path = folder.path().string();
    const std::string display = std::getenv("DISPLAY") ? std::getenv("DISPLAY") : "";
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    const Outcome run =
        start("00_hello_triangle", "--window --size 64x36 --time 0 --image '" + path + "/a.png'", folder);
    if (!display.empty()) setenv("DISPLAY", display.c_str(), 1);
    EXPECT_EQ(run.status, 0);
    EXPECT_NE(run.messages.find("rendering without a window: there is no display"), std::string::npos) << run.messages;
    EXPECT_EQ(load(folder, "a.png").width(), 64u);
}

}  // namespace glint::test
