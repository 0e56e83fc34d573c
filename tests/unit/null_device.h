#pragma once

// What the tests of the null device share: one that says nothing unexpected, and holds nothing at the end.

#include "support/matchers.h"

#include <glint/device/device.h>
#include <platform/null/null_control.h>

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <numeric>
#include <string_view>
#include <vector>

namespace glint::test {

using null::NullControl;
using null::NullSettings;
using null::ScopedSettings;

class NullDevice : public testing::Test {
protected:
    void open(const NullSettings& settings = {}, FeatureMask required = 0,
              TracingEngine tracing = TracingEngine::Driver) {
        device = {};
        const ScopedSettings scope(settings);
        device = Device::create(
            {.api = "null", .required = required, .tracing = tracing, .message = [this](const Message& message) {
                 if (expected == message.error.id())
                     told++;
                 else
                     ADD_FAILURE() << message.error.text();
             }});
        if (device) control = NullControl::last();
    }
    void SetUp() override { open(); }
    void TearDown() override {
        device = {};
        if (!control) return;
        EXPECT_EQ(control->counters().objects, 0u);
        EXPECT_EQ(control->counters().bytes, 0u);
        for (const Error& finding : control->findings()) ADD_FAILURE() << finding.text();
    }

    std::vector<uint32_t> iota(size_t count) {
        std::vector<uint32_t> values(count);
        std::iota(values.begin(), values.end(), 1u);
        return values;
    }
    template <class T>
    std::vector<T> readTexture(const Texture& texture, const Slice& slice = {}) {
        std::vector<T> texels(texture.getDataSize(slice.mip) / sizeof(T));
        EXPECT_THAT(device.getTexture(texture, texels.data(), texels.size() * sizeof(T), slice), IsOk());
        return texels;
    }

    std::string_view expected;
    std::atomic<int> told = 0;
    std::shared_ptr<NullControl> control;
    Device device;
};

}  // namespace glint::test
