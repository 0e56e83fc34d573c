#pragma once

// Devices whose every message has to be expected.

#include "support/matchers.h"

#include <glint/device/device.h>

#include <gtest/gtest.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace glint::test {

/// What a device has told since somebody last looked. Copies share.
class MessageLog {
public:
    /// For DeviceDesc::message.
    MessageCallback callback() const;
    /// All messages so far, which the log then forgets.
    std::vector<Message> take() const;
    /// Takes the messages and fails the running test for each of them.
    void expectNone() const;

private:
    struct Data {
        std::mutex mutex;
        std::vector<Message> messages;
    };
    std::shared_ptr<Data> data_ = std::make_shared<Data>();
};

/// A device with validation and all features of the adapter, opened once a process and closed after the last test: what
/// the layers say about objects still alive then is a failure, too. A device that cannot be opened carries the error.
Device sharedDevice(const std::string& api, TracingEngine tracing = TracingEngine::Auto);
/// The log of a shared device.
MessageLog sharedLog(const std::string& api, TracingEngine tracing = TracingEngine::Auto);

/// In a test's body or SetUp: skips it where the adapter lacks a feature, and says which.
#define GLINT_NEED_FEATURE(feature)                   \
    if (device && !device.getFeatures().has(feature)) \
    GTEST_SKIP() << "'" << device.getInfo().name << "' lacks " << ::glint::toString(feature)

/// A test with a device; with the driver's engine where it is about what the driver itself answers. It fails if there
/// is none, and if the device tells anything that the test did not ask for.
class DeviceTest : public ::testing::Test {
protected:
    explicit DeviceTest(std::string api = "vulkan", TracingEngine tracing = TracingEngine::Auto)
        : api_(std::move(api)), tracing_(tracing) {}

    void SetUp() override;
    void TearDown() override;

    /// Runs `action`. Expects that what it returns carries the error, and that the device told of the same id and of
    /// nothing else.
    template <class Action>
    void expectError(std::string_view id, Action&& action) {
        log.expectNone();
        const Error error = errorOf(std::forward<Action>(action)());
        EXPECT_EQ(error.id(), id) << error.text();
        expectTold(id);
    }
    /// Expects that the device told of this id, at least once, and of nothing else.
    void expectTold(std::string_view id);

    Device device;
    MessageLog log;

private:
    const std::string api_;
    const TracingEngine tracing_;
};

}  // namespace glint::test
