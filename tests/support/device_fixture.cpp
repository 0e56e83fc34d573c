#include "support/device_fixture.h"

#include <map>

namespace glint::test {

MessageCallback MessageLog::callback() const {
    return [data = data_](const Message& message) {
        std::lock_guard lock(data->mutex);
        data->messages.push_back(message);
    };
}

std::vector<Message> MessageLog::take() const {
    std::lock_guard lock(data_->mutex);
    return std::exchange(data_->messages, {});
}

void MessageLog::expectNone() const {
    for (const Message& message : take()) ADD_FAILURE() << "unexpected message: " << message.error.text();
}

namespace {

struct Shared {
    Device device;
    MessageLog log;
};

class SharedDevices : public ::testing::Environment {
public:
    Shared& get(const std::string& api, TracingEngine tracing) {
        const auto [place, fresh] = devices_.try_emplace({api, tracing});
        Shared& shared = place->second;
        if (fresh)
            shared.device = Device::create({.api = api,
                                            .tracing = tracing,
                                            .validation = DeviceDesc::Validation::On,
                                            .message = shared.log.callback()});
        return shared;
    }

    void TearDown() override {
        for (auto& [key, shared] : devices_) {
            shared.device = {};
            shared.log.expectNone();
        }
        devices_.clear();
    }

private:
    std::map<std::pair<std::string, TracingEngine>, Shared> devices_;
};

// GoogleTest owns it and takes it down before the drivers are unloaded.
SharedDevices* const environment = [] {
    auto* devices = new SharedDevices;
    ::testing::AddGlobalTestEnvironment(devices);
    return devices;
}();

}  // namespace

Device sharedDevice(const std::string& api, TracingEngine tracing) { return environment->get(api, tracing).device; }
MessageLog sharedLog(const std::string& api, TracingEngine tracing) { return environment->get(api, tracing).log; }

void DeviceTest::SetUp() {
    device = sharedDevice(api_, tracing_);
    log = sharedLog(api_, tracing_);
    ASSERT_TRUE(device) << "no device, no test: " << device.error().text();
    log.expectNone();
}

void DeviceTest::TearDown() {
    if (!device) return;
    EXPECT_THAT(device.finish(), IsOk());
    log.expectNone();
    device = {};
}

void DeviceTest::expectTold(std::string_view id) {
    const std::vector<Message> messages = log.take();
    EXPECT_FALSE(messages.empty()) << "'" << id << "' was not told to the message callback";
    for (const Message& message : messages) EXPECT_EQ(message.error.id(), id) << message.error.text();
}

}  // namespace glint::test
