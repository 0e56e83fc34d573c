#pragma once

// Values that kernels give: one for each input, or in place.

#include "support/device_fixture.h"

#include <algorithm>
#include <string_view>
#include <vector>

namespace glint::test {

/// What a compute shader makes of each input: Inputs at storage slot 0, Outputs at 1, a thread for each. Empty after a
/// failure, which fails the test.
template <class Output, class Input>
std::vector<Output> runOnEach(Device device, std::string_view shader, const std::vector<Input>& inputs) {
    Kernel kernel = device.createKernel();
    kernel.createShaderGLSL(shader);
    EXPECT_TRUE(kernel.create()) << kernel.error().text();
    const Buffer in = device.createBuffer(Buffer::FlagStorage, std::span(inputs));
    const Buffer out = device.createBuffer(Buffer::FlagStorage, inputs.size() * sizeof(Output));
    Compute compute = device.createCompute();
    compute.setKernel(kernel);
    compute.setStorageBuffers(0, {in, out});
    compute.dispatch(inputs.size());
    EXPECT_TRUE(device.submit(compute));
    auto outputs = device.read<Output>(out);
    EXPECT_TRUE(outputs) << outputs.error().text();
    return outputs ? std::move(*outputs) : std::vector<Output>();
}

/// Expects these values in a buffer, and tells the first that differs.
inline void expectValues(Device device, const Buffer& buffer, const std::vector<uint32_t>& expected) {
    const auto values = device.read<uint32_t>(buffer);
    ASSERT_TRUE(values) << values.error().text();
    ASSERT_EQ(values->size(), expected.size());
    const auto [a, b] = std::mismatch(values->begin(), values->end(), expected.begin());
    EXPECT_TRUE(a == values->end()) << "element " << a - values->begin() << " is " << *a << ", not " << *b;
}

}  // namespace glint::test
