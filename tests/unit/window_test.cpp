// Windows of the null device: what no X server without a window manager and a user can show, with every submission
// judged.

#include "support/matchers.h"

#include <glint/device/device.h>
#include <platform/null/null_control.h>

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <limits>
#include <thread>

namespace glint::test {
namespace {

using detail::WindowEvents;
using null::NullControl;
using null::NullSettings;
using null::ScopedSettings;

class NullWindowTest : public testing::Test {
protected:
    void open(const NullSettings& settings = {}) {
        const ScopedSettings scope(settings);
        device = Device::create({.api = "null", .message = [this](const Message& message) {
                                     told++;
                                     if (expected != message.error.id()) ADD_FAILURE() << message.error.text();
                                 }});
        control = NullControl::last();
        window = device.createWindow({.title = "null", .width = 64, .height = 48});
        events.width = 64;
        events.height = 48;
    }
    void SetUp() override {
        open();
        ASSERT_TRUE(window) << window.error().text();
    }
    void TearDown() override {
        window = {};
        device = {};
        EXPECT_EQ(control->counters().objects, 0u);
        for (const Error& finding : control->findings()) ADD_FAILURE() << finding.text();
    }

    bool update() {
        control->setWindowEvents(events);
        return window.update();
    }
    Status frame() {
        if (!window.render()) return window.error();
        Command list = device.createCommand(window.getTarget());
        if (Status status = device.submit(list); !status) return status;
        return window.present();
    }

    Device device;
    Window window;
    std::shared_ptr<NullControl> control;
    WindowEvents events;
    std::string expected;
    int told = 0;
};

TEST_F(NullWindowTest, KeysButtonsAndText) {
    events.keys.set('W');
    events.pressed_keys.set('W');
    events.pressed_keys.set(Window::KeyEscape);
    events.buttons.set(Window::ButtonRight);
    events.pressed_buttons.set(Window::ButtonRight);
    events.mouse = {3, 5};
    events.wheel = {0, -2};
    events.text = "ä";
    events.focused = true;
    EXPECT_FALSE(window.isKeyDown('W'));
    ASSERT_TRUE(update());
    EXPECT_TRUE(window.isKeyDown('W'));
    EXPECT_TRUE(window.isKeyPressed('W'));
    EXPECT_TRUE(window.isKeyPressed(Window::KeyEscape));
    EXPECT_FALSE(window.isKeyDown(Window::KeyEscape));
    EXPECT_TRUE(window.isMouseDown(Window::ButtonRight));
    EXPECT_FALSE(window.isMouseDown(Window::ButtonLeft));
    EXPECT_TRUE(window.isMousePressed(Window::ButtonRight));
    EXPECT_EQ(window.getMouse(), Vector2f(3, 5));
    EXPECT_EQ(window.getWheel(), Vector2f(0, -2));
    EXPECT_EQ(window.getText(), "ä");
    EXPECT_TRUE(window.isFocused());
    // What happens once is over at the next update, what lasts is not.
    ASSERT_TRUE(window.update());
    EXPECT_TRUE(window.isKeyDown('W'));
    EXPECT_FALSE(window.isKeyPressed('W'));
    EXPECT_TRUE(window.isMouseDown(Window::ButtonRight));
    EXPECT_FALSE(window.isMousePressed(Window::ButtonRight));
    EXPECT_EQ(window.getWheel(), Vector2f(0, 0));
    EXPECT_EQ(window.getText(), "");
    for (const int wrong : {-1, int(Window::KeyCount), 1 << 20, std::numeric_limits<int>::min()})
        EXPECT_FALSE(window.isKeyDown(wrong) || window.isKeyPressed(wrong));
    EXPECT_FALSE(window.isMouseDown(static_cast<Window::Button>(200)));
}

TEST_F(NullWindowTest, AsksBeforeItCloses) {
    int asked = 0;
    bool allowed = false;
    window.setCloseCallback([&] {
        asked++;
        return allowed;
    });
    events.close = true;
    EXPECT_TRUE(update());
    EXPECT_FALSE(window.isClosed());
    EXPECT_TRUE(window.update());
    EXPECT_EQ(asked, 1);
    allowed = true;
    EXPECT_FALSE(update());
    EXPECT_TRUE(window.isClosed());
    EXPECT_EQ(asked, 2);
    EXPECT_FALSE(window.update());
}

TEST_F(NullWindowTest, ClosesWithoutACallback) {
    events.close = true;
    EXPECT_FALSE(update());
    EXPECT_TRUE(window.isClosed());
}

TEST_F(NullWindowTest, MayBeReleasedByItsCallback) {
    window.setCloseCallback([this] {
        window = {};
        return true;
    });
    events.close = true;
    EXPECT_FALSE(update());
    EXPECT_EQ(window.state(), ObjectState::Null);
}

TEST_F(NullWindowTest, HasNoPictureWithoutAreaOrWhileHidden) {
    EXPECT_THAT(frame(), IsOk());
    events.width = 0;
    ASSERT_TRUE(update());
    EXPECT_FALSE(window.render());
    events.width = 100;
    events.hidden = true;
    ASSERT_TRUE(update());
    EXPECT_TRUE(window.isHidden());
    EXPECT_FALSE(window.render());
    events.hidden = false;
    ASSERT_TRUE(update());
    EXPECT_THAT(frame(), IsOk());
    EXPECT_EQ(window.getWidth(), 100u);
}

TEST_F(NullWindowTest, IsRenewedWhenOutdated) {
    for (int i = 0; i < 3; i++) {
        EXPECT_THAT(frame(), IsOk());
        const uint64_t before = control->counters().creations;
        control->outdateWindow();  // found by acquiring
        EXPECT_THAT(frame(), IsOk());
        EXPECT_EQ(control->counters().creations, before + 3);
        ASSERT_TRUE(window.render());
        control->outdateWindow();  // found by presenting
        EXPECT_THAT(window.present(), IsOk());
        EXPECT_EQ(control->counters().creations, before + 3);
        EXPECT_THAT(frame(), IsOk());
        EXPECT_EQ(control->counters().creations, before + 6);
    }
}

TEST_F(NullWindowTest, PicturesOfOldSizesLiveUntilTheGpuIsDone) {
    control->hold(Queue::Main);
    EXPECT_THAT(frame(), IsOk());
    EXPECT_THAT(frame(), IsOk());
    control->release(Queue::Main, 3);  // the third frame waits for the first: its drawing and its presentation
    const uint64_t before = control->counters().objects;
    events.width = 80;
    ASSERT_TRUE(update());
    EXPECT_THAT(frame(), IsOk());
    EXPECT_GT(control->counters().objects, before);
    control->release(Queue::Main);
    EXPECT_THAT(device.finish(), IsOk());
    EXPECT_EQ(control->counters().objects, before);
}

TEST_F(NullWindowTest, TwoFramesAreUnderWayAtMost) {
    control->hold(Queue::Main);
    EXPECT_THAT(frame(), IsOk());
    EXPECT_THAT(frame(), IsOk());
    bool done = false;
    std::thread releases([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        done = true;
        control->release(Queue::Main);
    });
    ASSERT_TRUE(window.render());
    EXPECT_TRUE(done);
    releases.join();
    EXPECT_THAT(window.present(), IsOk());
}

// A display that shows one picture after the other may let its caller wait for it.
TEST_F(NullWindowTest, NobodyElseWaitsForAPresentation) {
    std::future<Status> other;
    control->setPresentation([&] {
        other = std::async(std::launch::async, [&] {
            const Buffer buffer = device.createBuffer(Buffer::FlagStorage, 64);
            device.clearBuffer(buffer);
            Compute list = device.createCompute(Queue::Compute);
            list.clearBuffer(buffer);
            return device.submit(list);
        });
        EXPECT_EQ(other.wait_for(std::chrono::seconds(10)), std::future_status::ready);
    });
    EXPECT_THAT(frame(), IsOk());
    ASSERT_TRUE(other.valid());
    EXPECT_THAT(other.get(), IsOk());
}

TEST_F(NullWindowTest, ALostWindowFails) {
    expected = "window.lost";
    ASSERT_TRUE(window.render());
    control->loseWindow();
    EXPECT_THAT(window.present(), HasErrorId("window.lost"));
    EXPECT_EQ(told, 1);
    EXPECT_THAT(window, HasErrorId("window.lost"));
    EXPECT_FALSE(window.update());
    EXPECT_FALSE(window.render());
    EXPECT_THAT(window.present(), HasErrorId("window.lost"));
    Window other = device.createWindow({.width = 5, .height = 5});
    EXPECT_FALSE(other.render());
    EXPECT_THAT(other, HasErrorId("window.lost"));
    EXPECT_TRUE(device.check());
}

TEST_F(NullWindowTest, ALostDeviceFailsTheWindow) {
    expected = "device.lost";
    ASSERT_TRUE(window.render());
    control->failSubmit(2, ErrorCode::DeviceLost);
    Command list = device.createCommand(window.getTarget());
    EXPECT_THAT(device.submit(list), IsOk());
    EXPECT_THAT(window.present(), HasErrorId("device.lost"));
    EXPECT_FALSE(window.update());
    EXPECT_THAT(window.run([] { return Status(); }), HasErrorId("device.lost"));
}

TEST_F(NullWindowTest, EveryCreationMayFail) {
    window = {};
    expected = "device.out_of_memory";
    // The window, then its three pictures, then its depth texture.
    for (uint64_t n = 1; n <= 5; n++) {
        control->failCreation(n);
        const Window failing = device.createWindow({.width = 5, .height = 5, .depth = FormatDf32});
        EXPECT_THAT(failing, HasErrorId("device.out_of_memory")) << n;
    }
    EXPECT_EQ(control->counters().objects, 0u);
    window = device.createWindow({.width = 5, .height = 5, .depth = FormatDf32});
    EXPECT_THAT(frame(), IsOk());
    events.width = 6;
    ASSERT_TRUE(update());
    control->failCreation(2);
    EXPECT_FALSE(window.render());
    EXPECT_THAT(window, HasErrorId("device.out_of_memory"));
}

TEST_F(NullWindowTest, IsJudgedClean) {
    // Copies, draws, reads and presentations in many orders: the checker reports what is not ordered.
    const Texture picture = device.createTexture2D(FormatBGRAu8n, 64, 48, Texture::FlagTarget);
    const Target off_screen = device.createTarget(picture);
    for (int i = 0; i < 64; i++) {
        ASSERT_TRUE(window.render());
        if (i & 1) {
            Command list = device.createCommand(off_screen);
            EXPECT_THAT(device.submit(list), IsOk());
        }
        if (i & 2) {
            Compute list = device.createCompute();
            list.copyTexture(window.getTexture(), {}, picture, {});
            EXPECT_THAT(device.submit(list), IsOk());
        }
        if (i & 4) {
            Command list = device.createCommand(window.getTarget());
            EXPECT_THAT(device.submit(list), IsOk());
        }
        if (i & 8 && i & 6) {
            Compute list = device.createCompute();
            list.copyTexture(picture, {}, window.getTexture(), {});
            EXPECT_THAT(device.submit(list), IsOk());
        }
        if (i & 16) device.clearTexture(window.getTexture(), Color::white());
        if (i & 32) { EXPECT_THAT(device.finish(), IsOk()); }
        EXPECT_THAT(window.present(), IsOk());
    }
}

TEST_F(NullWindowTest, PicturesAreForTheMainQueue) {
    ASSERT_TRUE(device.hasQueue(Queue::Compute));
    ASSERT_TRUE(window.render());
    expected = "window.queue";
    Compute list = device.createCompute(Queue::Compute);
    list.clearTexture(window.getTexture(), Color::white());
    EXPECT_THAT(device.submit(list), HasErrorId("window.queue"));
    EXPECT_EQ(told, 1);
    EXPECT_THAT(window.present(), IsOk());
}

TEST_F(NullWindowTest, TheFeatureMayBeMissing) {
    window = {};
    device = {};
    expected = "window.unsupported";
    open({.missing = FeaturePresent});
    EXPECT_THAT(window, HasErrorId("window.unsupported"));
    EXPECT_FALSE(window.update());
    EXPECT_THAT(window.present(), HasErrorId("window.unsupported"));
    EXPECT_EQ(window.getWidth(), 0u);
}

}  // namespace
}  // namespace glint::test
