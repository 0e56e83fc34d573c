#pragma once

// What the conformance tests share: short ways to objects that have to work.

#include "support/device_fixture.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace glint::test {

using Pixel = std::array<uint8_t, 4>;

constexpr Pixel black = {0, 0, 0, 255};
constexpr Pixel white = {255, 255, 255, 255};
constexpr Pixel red = {255, 0, 0, 255};
constexpr Pixel green = {0, 255, 0, 255};
constexpr Pixel blue = {0, 0, 255, 255};

/// A triangle that covers the target, from three vertices without buffers.
constexpr const char* cover_vertex = R"(
void main() { gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, 0.5, 1.0); }
)";
/// Positions from attribute 0 of buffer 0.
constexpr const char* position_vertex = R"(
layout(location = 0) in vec4 position;
void main() { gl_Position = position; gl_PointSize = 1.0; }
)";
constexpr const char* red_fragment = R"(
layout(location = 0) out vec4 color;
void main() { color = vec4(1.0, 0.0, 0.0, 1.0); }
)";
/// The colour comes from the push constants.
constexpr const char* push_fragment = R"(
layout(push_constant) uniform Push { vec4 value; };
layout(location = 0) out vec4 color;
void main() { color = value; }
)";

class ConformanceTest : public DeviceTest {
protected:
    using DeviceTest::DeviceTest;

    Kernel makeKernel(std::string_view text, std::string_view macros = {}) {
        Kernel kernel = device.createKernel("kernel");
        kernel.createShaderGLSL(text, macros);
        EXPECT_THAT(kernel.create(), IsOk());
        return kernel;
    }

    Pipeline makePipeline(std::string_view vertex, std::string_view fragment,
                          const std::function<void(Pipeline&)>& configure = {}, Format color = FormatRGBAu8n) {
        Pipeline pipeline = device.createPipeline("pipeline");
        pipeline.createShaderGLSL(Shader::TypeVertex, vertex);
        if (!fragment.empty()) pipeline.createShaderGLSL(Shader::TypeFragment, fragment);
        pipeline.setColorFormat(color);
        if (configure) configure(pipeline);
        EXPECT_THAT(pipeline.create(), IsOk());
        return pipeline;
    }

    template <class T>
    Buffer makeBuffer(const std::vector<T>& values, Buffer::Flags flags = Buffer::FlagStorage) {
        Buffer buffer = device.createBuffer(flags, std::span(values), "buffer");
        EXPECT_TRUE(buffer) << buffer.error().text();
        return buffer;
    }

    Texture makeTexture(Format format, uint32_t width, uint32_t height, Texture::Flags flags = Texture::FlagTarget) {
        Texture texture = device.createTexture2D(format, width, height, flags, "texture");
        EXPECT_TRUE(texture) << texture.error().text();
        return texture;
    }

    template <class T>
    std::vector<T> read(const Buffer& buffer) {
        Expected<std::vector<T>> values = device.read<T>(buffer);
        EXPECT_THAT(values, IsOk());
        return values ? *values : std::vector<T>();
    }

    template <class T>
    std::vector<T> readTexture(const Texture& texture, const Slice& slice = {}) {
        std::vector<T> texels(texture.getDataSize(slice.mip) / sizeof(T));
        EXPECT_THAT(device.getTexture(texture, texels.data(), texels.size() * sizeof(T), slice), IsOk());
        return texels;
    }

    void submit(Recorder& recorder) { EXPECT_THAT(device.submit(recorder), IsOk()); }

    /// Records into a compute list and submits it.
    void compute(const std::function<void(Compute&)>& record) {
        Compute list = device.createCompute();
        record(list);
        submit(list);
    }

    /// Draws into a colour texture that begins black, and perhaps a depth texture that begins at 1.
    void draw(const Texture& color, const std::function<void(Command&)>& record, const Texture& depth = {}) {
        Command list = device.createCommand(device.createTarget(color, depth));
        record(list);
        submit(list);
    }
};

/// The same body on every API: for what needs no shader to run.
class ApiTest : public ConformanceTest, public ::testing::WithParamInterface<const char*> {
protected:
    ApiTest() : ConformanceTest(GetParam()) {}
};

/// INSTANTIATE_APIS(BufferTest);
#define INSTANTIATE_APIS(suite)                                                \
    INSTANTIATE_TEST_SUITE_P(Apis, suite, ::testing::Values("vulkan", "null"), \
                             [](const auto& api) { return std::string(api.param); })

/// How many pixels have this colour.
inline size_t countPixels(const std::vector<Pixel>& pixels, const Pixel& color) {
    return static_cast<size_t>(std::count(pixels.begin(), pixels.end(), color));
}

}  // namespace glint::test
