// The frame loop of the examples, with a user, on a null device.

#include "common/viewer.h"
#include "support/matchers.h"

#include <platform/null/null_control.h>

#include <gtest/gtest.h>

#include <functional>
#include <vector>

namespace glint::test {
namespace {

using null::NullControl;

class ViewerTest : public testing::Test {
protected:
    void SetUp() override {
        example.addKnob("--quick", quick, "less work");
        example.addKnob("--scale", scale, 0.0f, 1.0f, "how large");
    }

    /// Runs an example whose frames do nothing but call `step`, which may change what the user does next.
    void run(std::vector<const char*> arguments, const std::function<void(const Frame&)>& step) {
        arguments.insert(arguments.begin(), {"program", "--api", "null"});
        ASSERT_TRUE(example.parse(static_cast<int>(arguments.size()), arguments.data()));
        Device device = openDevice(example);
        ASSERT_TRUE(device) << device.error().text();
        control = NullControl::last();
        user.width = example.width();
        user.height = example.height();
        {
            Viewer viewer(example, device);
            EXPECT_THAT(viewer.run([&](Frame& frame) -> Status {
                // What happens once has happened.
                user.pressed_keys.reset();
                user.pressed_buttons.reset();
                user.wheel = {0, 0};
                step(frame);
                if (example.options().window) control->setWindowEvents(user);
                Command command = device.createCommand(frame.target);
                frame.timer.begin(command, "draw");
                frame.timer.end(command);
                return device.submit(command);
            }),
                        IsOk());
            EXPECT_EQ(viewer.finish(), 0);
        }
        device = {};
        EXPECT_EQ(control->counters().objects, 0u);
        for (const Error& finding : control->findings()) ADD_FAILURE() << finding.text();
    }

    void press(int key) { user.pressed_keys.set(static_cast<size_t>(key)); }
    void holdLeft(bool is_down) {
        user.pressed_buttons.set(Window::ButtonLeft, is_down && !user.buttons.test(Window::ButtonLeft));
        user.buttons.set(Window::ButtonLeft, is_down);
    }

    Example example{"50_test", "A test."};
    bool quick = false;
    float scale = 0.5f;
    std::shared_ptr<NullControl> control;
    detail::WindowEvents user;
};

TEST_F(ViewerTest, WithoutAWindowItDrawsNFrames) {
    std::vector<double> times;
    run({"--frames", "5", "--size", "32x16"}, [&](const Frame& frame) {
        EXPECT_EQ(frame.index, times.size());
        EXPECT_EQ(frame.is_resized, frame.index == 0);
        EXPECT_EQ(frame.width, 32u);
        EXPECT_EQ(frame.aspect(), 2.0f);
        EXPECT_EQ(frame.view.eye({1, 2, 3}, {0, 0, 0}), Vector3f(1, 2, 3));
        times.push_back(frame.time);
    });
    EXPECT_EQ(times, (std::vector<double>{0, 1 / 60.0, 2 / 60.0, 3 / 60.0, 4 / 60.0}));
    EXPECT_EQ(example.statistics().frames, 5u);
    EXPECT_EQ(example.statistics().passNames(), std::vector<std::string>{"draw"});
}

TEST_F(ViewerTest, AWindowDrawsNFramesToo) {
    run({"--window", "--frames", "4", "--time", "2"}, [&](const Frame& frame) { EXPECT_EQ(frame.time, 2.0); });
    EXPECT_EQ(example.statistics().frames, 4u);
}

TEST_F(ViewerTest, EscapeEndsAfterOneMoreFrame) {
    run({"--window"}, [&](const Frame& frame) {
        if (frame.index == 2) press(Window::KeyEscape);
    });
    EXPECT_EQ(example.statistics().frames, 4u);
}

TEST_F(ViewerTest, SoDoesTheCloseButton) {
    run({"--window"}, [&](const Frame& frame) { user.close = frame.index == 2; });
    EXPECT_EQ(example.statistics().frames, 4u);
}

TEST_F(ViewerTest, SpaceStopsTheTime) {
    std::vector<double> times;
    run({"--window", "--frames", "12"}, [&](const Frame& frame) {
        times.push_back(frame.time);
        if (frame.index == 3 || frame.index == 7) press(Window::KeySpace);
    });
    for (size_t i = 1; i < times.size(); i++) {
        EXPECT_LE(times[i] - times[i - 1], 1 / 30.0 + 1e-9);
        if (i >= 4 && i <= 7) {
            EXPECT_EQ(times[i], times[i - 1]) << i;
        } else {
            EXPECT_GT(times[i], times[i - 1]) << i;
        }
    }
}

TEST_F(ViewerTest, DragsTurnAndTheWheelZooms) {
    const Vector3f from = {3, 0, 0}, to = {0, 0, 0};
    run({"--window", "--frames", "16", "--size", "800x400"}, [&](const Frame& frame) {
        const Vector3f eye = frame.view.eye(from, to);
        switch (frame.index) {
            case 0: user.mouse = {700, 200}; break;
            case 1: holdLeft(true); break;
            case 2: user.mouse = {500, 200}; break;
            case 3:  // a quarter of the width is an eighth of a turn
                EXPECT_NEAR(frame.view.turn(), pi / 4, 1e-5f);
                EXPECT_NEAR(eye.x, 3 * std::sqrt(0.5f), 1e-5f);
                EXPECT_NEAR(eye.y, 3 * std::sqrt(0.5f), 1e-5f);
                EXPECT_NEAR(eye.z, 0, 1e-5f);
                user.mouse = {500, 300};
                break;
            case 4:
                EXPECT_NEAR(eye.z, 3 * std::sin(pi / 4), 1e-5f);
                user.mouse = {500, 4000};  // steeper than straight up it never gets
                break;
            case 5:
                EXPECT_NEAR(eye.z, 3 * std::sin(radians(89.0f)), 1e-5f);
                EXPECT_NEAR(glm::length(eye), 3, 1e-5f);
                holdLeft(false);
                user.wheel = {0, 2};
                break;
            case 6:
                EXPECT_NEAR(glm::length(eye), 3 * 0.81f, 1e-5f);
                press(Window::KeyHome);
                break;
            case 7: EXPECT_EQ(eye, from); break;
            case 8: user.wheel = {0, -1}; break;
            case 9: EXPECT_NEAR(frame.view.distance(), 1 / 0.9f, 1e-5f); break;
            case 10: holdLeft(true); break;
            case 11: holdLeft(false); break;
            case 12: holdLeft(true); break;  // the second click
            case 13: EXPECT_EQ(eye, from); break;
            default: break;
        }
    });
}

TEST_F(ViewerTest, ThePanelHasKnobsAndKeepsTheMouse) {
    // Clicks down the panel's left side, where the box of the knob is somewhere.
    run({"--window", "--frames", "160", "--size", "800x400"}, [&](const Frame& frame) {
        user.mouse = {28.0f, 12.0f + static_cast<float>(frame.index / 4 * 6)};
        holdLeft(frame.index % 4 == 2 && !quick);
        if (frame.index > 8 && user.mouse.y < 100) { EXPECT_EQ(frame.view.turn(), 0.0f); }
    });
    EXPECT_TRUE(quick);
}

TEST_F(ViewerTest, ASizeComesWithNewPictures) {
    run({"--window", "--frames", "6"}, [&](const Frame& frame) {
        EXPECT_EQ(frame.is_resized, frame.index == 0 || frame.index == 3);
        EXPECT_EQ(frame.width, frame.index < 3 ? 1600u : 640u);
        EXPECT_EQ(frame.picture.getWidth(), frame.width);
        if (frame.index == 2) user.width = 640;
    });
    EXPECT_EQ(example.statistics().width, 640u);
}

TEST_F(ViewerTest, TheFirstErrorEndsIt) {
    const char* arguments[] = {"program", "--api", "null", "--frames", "9"};
    ASSERT_TRUE(example.parse(5, arguments));
    Device device = openDevice(example);
    Viewer viewer(example, device);
    int frames = 0;
    EXPECT_THAT(viewer.run([&](Frame& frame) -> Status {
        frames++;
        if (frame.index < 2) return {};
        return Error::inFile(ErrorCode::Io, "test.error", "an error", {}, 0);
    }),
                HasErrorId("test.error"));
    EXPECT_EQ(frames, 3);
}

}  // namespace
}  // namespace glint::test
