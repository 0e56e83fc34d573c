// Windows on an X server without a screen (Xvfb), by Vulkan, under the validation layer. It has no window manager, so
// that nothing is ever minimised: hidden windows stand for that, and the null device (unit/window_test.cpp) for the
// user's keys, mouse and close button.

#include "conformance/conformance.h"
#include "support/reference.h"
#include "support/xvfb.h"

#include <glint/format/image.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <thread>

namespace glint::test {

namespace {

class WindowTest : public ConformanceTest {
protected:
    void SetUp() override {
        GLINT_NEED_XVFB();
        ConformanceTest::SetUp();
    }

    Window open(WindowDesc desc = {}) {
        if (desc.width == 1600) desc.width = 64, desc.height = 48;
        Window window = device.createWindow(desc);
        EXPECT_TRUE(window) << window.error().text();
        return window;
    }

    /// Shows one picture of one colour.
    void show(Window& window, const Color& color) {
        ASSERT_TRUE(window.update());
        ASSERT_TRUE(window.render());
        window.getTarget().setClearColor(color);
        Command list = device.createCommand(window.getTarget());
        submit(list);
        ASSERT_THAT(window.present(), IsOk());
    }

    /// Draws one picture of one colour and reads it back. Expects that all pixels have it.
    void showAndCheck(Window& window, const Color& color, const Pixel& expected) {
        ASSERT_TRUE(window.update());
        ASSERT_TRUE(window.render());
        window.getTarget().setClearColor(color);
        Command list = device.createCommand(window.getTarget());
        submit(list);
        expectAll(window, expected);
        ASSERT_THAT(window.present(), IsOk());
    }

    void expectAll(Window& window, const Pixel& expected) {
        const Expected<Image> image = window.grab();
        ASSERT_THAT(image, IsOk());
        ASSERT_EQ(image->width(), window.getWidth());
        ASSERT_EQ(image->height(), window.getHeight());
        EXPECT_EQ(countImage(*image, expected), size_t(image->width()) * image->height());
    }

    static size_t countImage(const Image& image, const Pixel& color) {
        size_t count = 0;
        for (uint32_t y = 0; y < image.height(); y++)
            for (uint32_t x = 0; x < image.width(); x++)
                count += std::memcmp(image.texel(x, y).data(), color.data(), 4) == 0;
        return count;
    }

    /// Waits until the X server shows `count` pixels of this colour, for at most some seconds.
    static void expectOnScreen(const Pixel& color, size_t count) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
        size_t found = 0;
        do {
            found = countImage(Xvfb::get().screen(), color);
            if (found == count) return;
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        } while (std::chrono::steady_clock::now() < end);
        ADD_FAILURE() << found << " pixels of the colour on the screen instead of " << count;
    }
};

constexpr Color red_color = {1, 0, 0, 1}, green_color = {0, 1, 0, 1}, blue_color = {0, 0, 1, 1};

}  // namespace

TEST_F(WindowTest, DrawsGrabsAndShows) {
    Window window = open({.title = "first"});
    EXPECT_EQ(window.getTitle(), "first");
    EXPECT_EQ(window.getWidth(), 64u);
    EXPECT_EQ(window.getHeight(), 48u);
    EXPECT_FALSE(window.isHidden());
    EXPECT_FALSE(window.isClosed());
    const Format format = window.getColorFormat();
    EXPECT_TRUE(format == FormatRGBAu8n || format == FormatBGRAu8n) << toString(format);
    const Pipeline pipeline = makePipeline(cover_vertex, red_fragment, {}, format);
    for (int frame = 0; frame < 5; frame++) {
        ASSERT_TRUE(window.update());
        ASSERT_TRUE(window.render());
        window.getTarget().setClearColor(blue_color);
        Command list = device.createCommand(window.getTarget());
        list.setPipeline(pipeline);
        list.setScissor(10, 20, 8, 4);
        list.drawArrays(3);
        submit(list);
        const Expected<Image> image = window.grab();
        ASSERT_THAT(image, IsOk());
        EXPECT_EQ(image->format(), FormatRGBAu8n);
        EXPECT_EQ(countImage(*image, red), 32u);
        EXPECT_EQ(countImage(*image, blue), 64u * 48u - 32u);
        EXPECT_EQ(std::memcmp(image->texel(10, 20).data(), red.data(), 4), 0);
        EXPECT_EQ(std::memcmp(image->texel(17, 23).data(), red.data(), 4), 0);
        ASSERT_THAT(window.present(), IsOk());
    }
    EXPECT_THAT(window.finish(), IsOk());
    expectOnScreen(red, 32);
    expectOnScreen(blue, 64 * 48 - 32);
}

TEST_F(WindowTest, AnUndrawnPictureIsCleared) {
    Window window = open();
    window.getTarget().setClearColor(green_color);
    for (int frame = 0; frame < 4; frame++) {
        ASSERT_TRUE(window.update() && window.render());
        if (frame == 2) expectAll(window, green);
        ASSERT_THAT(window.present(), IsOk());
    }
    expectOnScreen(green, 64 * 48);
}

TEST_F(WindowTest, StoresLinearColoursAsSrgb) {
    Window window = open({.srgb = true});
    EXPECT_TRUE(formatInfo(window.getColorFormat()).srgb);
    // 0.5 is 255 (1.055 0.5^(1/2.4) - 0.055) = 187.5 of 255, to be rounded either way.
    ASSERT_TRUE(window.update() && window.render());
    window.getTarget().setClearColor(Color{0.5f, 0, 1, 1});
    Command list = device.createCommand(window.getTarget());
    submit(list);
    const Expected<Image> image = window.grab();
    ASSERT_THAT(image, IsOk());
    EXPECT_EQ(image->format(), FormatRGBAu8ns);
    EXPECT_EQ(countImage(*image, {187, 0, 255, 255}) + countImage(*image, {188, 0, 255, 255}), 64u * 48u);
    EXPECT_THAT(window.present(), IsOk());
}

TEST_F(WindowTest, HasADepthTexture) {
    Window window = open({.depth = FormatDf32});
    EXPECT_EQ(window.getDepthFormat(), FormatDf32);
    const Pipeline pipeline = makePipeline(
        cover_vertex, red_fragment,
        [](Pipeline& p) {
            p.setDepthFormat(FormatDf32);
            p.setDepthFunc(Pipeline::DepthFuncLess);
        },
        window.getColorFormat());
    for (const float depth : {1.0f, 0.25f}) {
        ASSERT_TRUE(window.update() && window.render());
        window.getTarget().setClearDepth(depth);
        Command list = device.createCommand(window.getTarget());
        list.setPipeline(pipeline);
        list.drawArrays(3);  // at depth 0.5
        submit(list);
        expectAll(window, depth > 0.5f ? red : black);
        EXPECT_THAT(window.present(), IsOk());
        window.setSize(depth > 0.5f ? 80 : 64, 48);
    }
}

TEST_F(WindowTest, IsCopiedTo) {
    Window window = open();
    const Texture source = makeTexture(window.getColorFormat(), 64, 48);
    device.clearTexture(source, green_color);
    ASSERT_TRUE(window.update() && window.render());
    compute([&](Compute& list) { list.copyTexture(window.getTexture(), {}, source, {}); });
    expectAll(window, green);
    EXPECT_THAT(window.present(), IsOk());
    ASSERT_TRUE(window.update() && window.render());
    device.clearTexture(window.getTexture(), blue_color);  // queued, played before the presentation
    EXPECT_THAT(device.flush(), IsOk());
    expectAll(window, blue);
    EXPECT_THAT(window.present(), IsOk());
}

TEST_F(WindowTest, SurvivesAHundredRandomResizes) {
    const uint64_t before = device.getMemory().bytes;
    Window window = open({.depth = FormatDf32, .sync = WindowDesc::Sync::Off});
    Random random(7);
    for (int i = 0; i < 100; i++) {
        const auto width = static_cast<uint32_t>(1 + random.below(240));
        const auto height = static_cast<uint32_t>(1 + random.below(180));
        window.setSize(width, height);
        const Color colors[3] = {red_color, green_color, blue_color};
        const Pixel pixels[3] = {red, green, blue};
        if (i % 3 == 0) {
            showAndCheck(window, colors[i / 3 % 3], pixels[i / 3 % 3]);
        } else {
            for (int frame = 0; frame < i % 3; frame++) show(window, colors[i % 3]);
        }
        if (HasFatalFailure()) return;
        EXPECT_EQ(window.getWidth(), width);
        EXPECT_EQ(window.getHeight(), height);
    }
    // Between update() and render(), and in the middle of a frame.
    for (int i = 0; i < 10; i++) {
        ASSERT_TRUE(window.update());
        window.setSize(20 + i, 30);
        ASSERT_TRUE(window.render());
        Command list = device.createCommand(window.getTarget());
        submit(list);
        window.setSize(40, 20 + i);
        ASSERT_TRUE(window.update());
        ASSERT_TRUE(window.render());  // the same picture
        ASSERT_THAT(window.present(), IsOk());
    }
    // The depth textures of all those sizes are gone.
    window.setSize(40, 30);
    for (int i = 0; i < 4; i++) show(window, red_color);
    const uint64_t depth = 40 * 30 * 4;
    EXPECT_LE(device.getMemory().bytes, before + 2 * depth);
    expectOnScreen(red, 40 * 30);
}

TEST_F(WindowTest, HiddenIsSkippedAndSleeps) {
    Window window = open();
    show(window, red_color);
    window.setHidden(true);
    ASSERT_TRUE(window.update());
    EXPECT_TRUE(window.isHidden());
    EXPECT_FALSE(window.render());
    expectError("window.no_frame", [&] { return window.present(); });
    const auto begin = std::chrono::steady_clock::now();
    int rounds = 0;
    for (; std::chrono::steady_clock::now() - begin < std::chrono::milliseconds(300); rounds++) {
        ASSERT_TRUE(window.update());
        ASSERT_FALSE(window.render());
    }
    // Each round sleeps for 100 ms, or until one of the few events of hiding comes.
    EXPECT_LE(rounds, 12);
    window.setHidden(false);
    ASSERT_TRUE(window.update());
    EXPECT_FALSE(window.isHidden());
    for (int i = 0; i < 3; i++) showAndCheck(window, green_color, green);
    expectOnScreen(green, 64 * 48);
}

TEST_F(WindowTest, BeginsHidden) {
    Window window = open({.hidden = true});
    ASSERT_TRUE(window.update());
    EXPECT_FALSE(window.render());
    EXPECT_NE(window.getColorFormat(), FormatUnknown);
    window.setHidden(false);
    showAndCheck(window, red_color, red);
}

TEST_F(WindowTest, SyncModes) {
    using Sync = WindowDesc::Sync;
    for (const Sync sync : {Sync::Vertical, Sync::Mailbox, Sync::Off}) {
        SCOPED_TRACE(static_cast<int>(sync));
        Window window = open({.sync = sync});
        EXPECT_LE(window.getSync(), sync);  // what is not there becomes what comes before it
        if (sync == Sync::Vertical) { EXPECT_EQ(window.getSync(), sync); }
        for (int i = 0; i < 10; i++) show(window, i % 2 ? red_color : green_color);
        expectOnScreen(red, 64 * 48);
    }
}

TEST_F(WindowTest, TwoAtATime) {
    Window first = open({.title = "first", .width = 60, .height = 40});
    Window second = open({.title = "second", .width = 300, .height = 200, .srgb = true, .depth = FormatDf32});
    for (int i = 0; i < 8; i++) {
        // Both pictures in one submission.
        ASSERT_TRUE(first.update() && second.update());
        ASSERT_TRUE(first.render() && second.render());
        first.getTarget().setClearColor(red_color);
        second.getTarget().setClearColor(blue_color);
        Command a = device.createCommand(first.getTarget()), b = device.createCommand(second.getTarget());
        EXPECT_THAT(device.submit({a, b}), IsOk());
        expectAll(second, blue);
        ASSERT_THAT(second.present(), IsOk());
        expectAll(first, red);
        ASSERT_THAT(first.present(), IsOk());
        if (i == 4) first.setSize(30, 30);
    }
    first = {};
    show(second, green_color);
    expectOnScreen(green, 300 * 200);
    Window third = open();
    show(third, red_color);
    show(second, green_color);
}

TEST_F(WindowTest, OnTwoDevices) {
    const MessageLog other_log;
    Device other = Device::create({.validation = DeviceDesc::Validation::On, .message = other_log.callback()});
    ASSERT_TRUE(other) << other.error().text();
    Window first = open(), second = other.createWindow({.width = 100, .height = 100});
    ASSERT_TRUE(second) << second.error().text();
    for (int i = 0; i < 3; i++) {
        show(first, red_color);
        ASSERT_TRUE(second.update() && second.render());
        Command list = other.createCommand(second.getTarget());
        EXPECT_THAT(other.submit(list), IsOk());
        EXPECT_THAT(second.present(), IsOk());
    }
    ASSERT_TRUE(second.update() && second.render());
    expectError("handle.device", [&] {
        Command foreign = device.createCommand(second.getTarget());
        return device.submit(foreign);
    });
    other = {};
    second = {};
    other_log.expectNone();
}

TEST_F(WindowTest, RunsUntilClosed) {
    Window window = open();
    int frames = 0;
    EXPECT_THAT(window.run([&]() -> Status {
        if (++frames == 5) window.close();
        Command list = device.createCommand(window.getTarget());
        return device.submit(list);
    }),
                IsOk());
    EXPECT_EQ(frames, 5);
    EXPECT_TRUE(window.isClosed());
    EXPECT_FALSE(window.update());
    // The first error of the frame ends it, too.
    Window other = open();
    expectError("window.no_frame", [&] { return other.run([&] { return window.present(); }); });
}

TEST_F(WindowTest, IsReleasedInAnyOrder) {
    enum Order { WindowFirst, DeviceFirst, InTheFrame, Submitted, TargetLast, TextureLast, ListLast, OtherThread };
    for (int order = WindowFirst; order <= OtherThread; order++) {
        SCOPED_TRACE(order);
        const MessageLog own_log;
        Device own = Device::create({.validation = DeviceDesc::Validation::On, .message = own_log.callback()});
        ASSERT_TRUE(own) << own.error().text();
        Window window = own.createWindow({.width = 200, .height = 100, .depth = FormatDf32});
        ASSERT_TRUE(window) << window.error().text();
        Target target;
        Texture texture;
        for (int frame = 0; frame < 3; frame++) {
            ASSERT_TRUE(window.update() && window.render());
            texture = window.getTexture();
            Command list = own.createCommand(window.getTarget());
            ASSERT_THAT(own.submit(list), IsOk());
            ASSERT_THAT(window.present(), IsOk());
            if (frame == 1) window.setSize(100, 120);
        }
        if (order != TextureLast) texture = {};
        if (order == TargetLast) target = window.getTarget();
        if (order == InTheFrame || order == Submitted) { ASSERT_TRUE(window.update() && window.render()); }
        if (order == Submitted) {
            Command list = own.createCommand(window.getTarget());
            ASSERT_THAT(own.submit(list), IsOk());
        }
        if (order == ListLast) {
            ASSERT_TRUE(window.update() && window.render());
            Command list = own.createCommand(window.getTarget());
            window = {};
            EXPECT_THAT(own.submit(list), HasErrorId("window.no_frame"));
            EXPECT_EQ(own_log.take().size(), 1u);
        }
        if (order == OtherThread) std::thread([moved = std::move(window)] {}).join();
        if (order != WindowFirst && order != ListLast) own = {};
        window = {};
        EXPECT_EQ(target.getWidth(), 0u);
        target = {};
        texture = {};
        own = {};
        own_log.expectNone();
    }
    // The one that another thread released is closed by now.
    Window last = open();
    EXPECT_TRUE(last.update());
}

TEST_F(WindowTest, AFrameIsNeeded) {
    Window window = open();
    expectError("window.no_frame", [&] { return window.present(); });
    expectError("window.no_frame", [&] { return window.grab(); });
    EXPECT_FALSE(window.getTexture());
    expectError("window.no_frame", [&] {
        Command list = device.createCommand(window.getTarget());
        return device.submit(list);
    });
    // What was recorded for a picture is refused once that is over.
    ASSERT_TRUE(window.update() && window.render());
    const Texture texture = window.getTexture();
    Command late = device.createCommand(window.getTarget());
    EXPECT_THAT(window.present(), IsOk());
    expectError("window.no_frame", [&] { return device.submit(late); });
    expectError("window.no_frame", [&] {
        device.clearTexture(texture, red_color);
        return device.flush();
    });
    // And so is the picture of a size that the window has no more.
    window.setSize(50, 50);
    show(window, red_color);
    EXPECT_TRUE(texture);
    std::vector<Pixel> pixels(64 * 48);
    expectError("window.no_frame", [&] { return device.getTexture(texture, pixels.data(), pixels.size() * 4); });
    show(window, red_color);
    // Twice is once.
    ASSERT_TRUE(window.update() && window.render() && window.render());
    EXPECT_THAT(window.present(), IsOk());
    expectError("window.no_frame", [&] { return window.present(); });
}

TEST_F(WindowTest, AFailedSubmitLeavesTheFrameOpen) {
    Window window = open();
    ASSERT_TRUE(window.update() && window.render());
    expectError("handle.null", [&] {
        device.clearBuffer(Buffer());  // a queued transfer that cannot be played
        return window.present();
    });
    EXPECT_TRUE(window);
    EXPECT_TRUE(window.getTexture());
    EXPECT_THAT(window.present(), IsOk());
    show(window, red_color);
}

TEST_F(WindowTest, WrongSizesAndFormats) {
    const uint32_t limit = device.getFeatures().maxTexture2DSize;
    for (const auto& [width, height] : {std::pair{0u, 5u}, {5u, 0u}, {limit + 1, 5u}, {5u, ~0u}})
        expectError("window.size", [&] { return device.createWindow({.width = width, .height = height}); });
    expectError("window.format", [&] { return device.createWindow({.depth = FormatRGBAu8n}); });
    expectError("window.format", [&] { return device.createWindow({.depth = static_cast<Format>(250)}); });
    Window window = open();
    window.setSize(0, 10);
    expectTold("window.size");
    EXPECT_TRUE(window.update());
    EXPECT_EQ(window.getWidth(), 64u);
}

TEST_F(WindowTest, OfOneThread) {
    Window window = open();
    expectError("window.thread", [&] {
        Status status;
        std::thread([&] { status = window.present(); }).join();
        return status;
    });
    std::thread([&] {
        EXPECT_FALSE(window.update());
        EXPECT_FALSE(window.render());
    }).join();
    expectTold("window.thread");
    expectError("window.thread", [&] {
        Window other;
        std::thread([&] { other = device.createWindow(); }).join();
        return other;
    });
    show(window, red_color);
    window = {};
    // With no windows left another thread may begin.
    std::thread([&] {
        Window other = open();
        show(other, red_color);
    }).join();
    show(window = open(), red_color);
}

TEST_F(WindowTest, NoDisplay) {
    const std::string display = std::getenv("DISPLAY");
    unsetenv("DISPLAY");
    expectError("window.no_display", [&] {
        const Window window = device.createWindow();
        EXPECT_NE(window.error().message().find("DISPLAY is not set"), std::string::npos) << window.error().text();
        EXPECT_NE(window.error().message().find("WAYLAND_DISPLAY is not set"), std::string::npos);
        return window;
    });
    setenv("DISPLAY", ":987", 1);
    expectError("window.no_display", [&] {
        const Window window = device.createWindow();
        EXPECT_NE(window.error().message().find("DISPLAY is ':987'"), std::string::npos) << window.error().text();
        return window;
    });
    // A device needs none.
    EXPECT_TRUE(Device::create());
    setenv("DISPLAY", display.c_str(), 1);
    Window window = open();
    show(window, red_color);
}

TEST_F(WindowTest, WithoutTheFeature) {
    const MessageLog own_log;
    const Device plain = Device::create(
        {.optional = FeatureNone, .validation = DeviceDesc::Validation::On, .message = own_log.callback()});
    ASSERT_TRUE(plain);
    Device handle = plain;
    EXPECT_THAT(handle.createWindow(), HasErrorId("window.unsupported"));
    EXPECT_EQ(own_log.take().size(), 1u);
}

TEST_F(WindowTest, NullIsHarmless) {
    Window window;
    EXPECT_FALSE(window.update());
    EXPECT_FALSE(window.render());
    EXPECT_THAT(window.present(), HasErrorId("handle.null"));
    EXPECT_THAT(window.finish(), HasErrorId("handle.null"));
    EXPECT_THAT(window.grab(), HasErrorId("handle.null"));
    EXPECT_THAT(window.run([] { return Status(); }), HasErrorId("handle.null"));
    window.close();
    window.setCloseCallback([] { return true; });
    window.setTitle("x");
    window.setSize(1, 1);
    window.setHidden(true);
    EXPECT_TRUE(window.isClosed());
    EXPECT_FALSE(window.isHidden() || window.isFocused() || window.isKeyDown('A') || window.isKeyDown(-1));
    EXPECT_FALSE(window.getTarget());
    EXPECT_FALSE(window.getTexture());
    EXPECT_EQ(window.getWidth() + window.getHeight(), 0u);
    EXPECT_EQ(window.getColorFormat(), FormatUnknown);
}

}  // namespace glint::test
