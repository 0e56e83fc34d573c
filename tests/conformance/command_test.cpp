#include "conformance/conformance.h"

namespace glint::test {

namespace {

struct Vertex {
    float position[2];
    float color[4];
};

constexpr const char* color_vertex = R"(
layout(location = 0) in vec2 position;
layout(location = 1) in vec4 color;
layout(location = 0) out vec4 vertex_color;
void main() { gl_Position = vec4(position, 0.5, 1.0); vertex_color = color; }
)";
constexpr const char* color_fragment = R"(
layout(location = 0) in vec4 vertex_color;
layout(location = 0) out vec4 color;
void main() { color = vertex_color; }
)";

class CommandTest : public ConformanceTest {
protected:
    static constexpr uint32_t size = 16;

    void SetUp() override {
        ConformanceTest::SetUp();
        if (device) color = makeTexture(FormatRGBAu8n, size, size);
    }
    void TearDown() override {
        color = {};
        ConformanceTest::TearDown();
    }

    Pipeline colored(const std::function<void(Pipeline&)>& configure = {}) {
        return makePipeline(color_vertex, color_fragment, [&](Pipeline& pipeline) {
            pipeline.addAttribute(Pipeline::AttributePosition, FormatRGf32, 0, 0, sizeof(Vertex));
            pipeline.addAttribute(Pipeline::AttributeColor, FormatRGBAf32, 0, 8, sizeof(Vertex));
            if (configure) configure(pipeline);
        });
    }
    /// Covers the target with the colour of the push constants, at the depth of the constant.
    Pipeline covering(const std::function<void(Pipeline&)>& configure = {}, Format format = FormatRGBAu8n) {
        return makePipeline(cover_vertex, push_fragment, configure, format);
    }

    static std::vector<Vertex> quad(float left, float bottom, float right, float top, const Color& c) {
        const auto corner = [&](float x, float y) { return Vertex{{x, y}, {c.r, c.g, c.b, c.a}}; };
        return {corner(left, bottom), corner(right, bottom), corner(right, top),
                corner(left, bottom), corner(right, top),    corner(left, top)};
    }

    std::vector<Pixel> pixels() { return readTexture<Pixel>(color); }
    Pixel at(const std::vector<Pixel>& picture, uint32_t x, uint32_t y) { return picture[y * size + x]; }

    Texture color;
};

}  // namespace

TEST_F(CommandTest, InlineVertices) {
    const Vertex triangle[] = {{{-1, -1}, {1, 0, 0, 1}}, {{3, -1}, {1, 0, 0, 1}}, {{-1, 3}, {1, 0, 0, 1}}};
    draw(color, [&](Command& list) {
        list.setPipeline(colored());
        list.setVertices(0, triangle);
        list.drawArrays(3);
    });
    EXPECT_EQ(countPixels(pixels(), red), 256u);
}

TEST_F(CommandTest, ColoursAreInterpolated) {
    const Vertex triangle[] = {{{-1, -1}, {0, 0, 0, 1}}, {{3, -1}, {2, 0, 0, 1}}, {{-1, 3}, {0, 0, 0, 1}}};
    draw(color, [&](Command& list) {
        list.setPipeline(colored());
        list.setVertices(0, triangle);
        list.drawArrays(3);
    });
    const std::vector<Pixel> picture = pixels();
    for (uint32_t x = 0; x < size; x++) EXPECT_NEAR(at(picture, x, 7)[0], (x + 0.5) / 16 * 255, 1.0);
}

TEST_F(CommandTest, VertexBuffersAndRanges) {
    std::vector<Vertex> vertices = quad(-1, -1, 0, 1, {1, 0, 0, 1});
    const std::vector<Vertex> right = quad(0, -1, 1, 1, {0, 1, 0, 1});
    vertices.insert(vertices.end(), right.begin(), right.end());
    const Buffer buffer = makeBuffer(vertices, Buffer::FlagVertex);
    draw(color, [&](Command& list) {
        list.setPipeline(colored());
        list.setVertexBuffer(0, buffer);
        list.drawArrays(6, 6);
    });
    EXPECT_EQ(countPixels(pixels(), green), 128u);
    EXPECT_EQ(countPixels(pixels(), red), 0u);
    draw(color, [&](Command& list) {
        list.setPipeline(colored());
        list.setVertexBuffer(0, buffer, 6 * sizeof(Vertex));
        list.drawArrays(6);
        list.setVertexBuffer(0, buffer);
        list.drawArrays(6);
    });
    EXPECT_EQ(countPixels(pixels(), green), 128u);
    EXPECT_EQ(countPixels(pixels(), red), 128u);
}

TEST_F(CommandTest, IndicesOfBothSizes) {
    const std::vector<Vertex> vertices = {{{9, 9}, {0, 0, 0, 0}},
                                          {{-1, -1}, {0, 0, 1, 1}},
                                          {{1, -1}, {0, 0, 1, 1}},
                                          {{-1, 1}, {0, 0, 1, 1}},
                                          {{1, 1}, {0, 0, 1, 1}}};
    const Buffer buffer = makeBuffer(vertices, Buffer::FlagVertex);
    const uint16_t small[] = {1, 2, 3, 3, 2, 4};
    const std::vector<uint32_t> large = {7, 7, 7, 0, 1, 2, 2, 1, 3};
    const Buffer indices = makeBuffer(large, Buffer::FlagIndex);
    const Pipeline pipeline = colored();
    for (int which = 0; which < 3; which++) {
        draw(color, [&](Command& list) {
            list.setPipeline(pipeline);
            list.setVertexBuffer(0, buffer);
            if (which == 0) {
                list.setIndices(small);
                list.drawElements(6);
            } else if (which == 1) {
                list.setIndexBuffer(FormatRu32, indices);
                list.drawElements(6, 3, 1);
            } else {
                list.setIndexBuffer(FormatRu32, indices, 12);
                list.drawElementsInstanced(6, 0, 1, 1);
            }
        });
        EXPECT_EQ(countPixels(pixels(), blue), 256u) << which;
    }
}

TEST_F(CommandTest, Instances) {
    const Pipeline pipeline = makePipeline(R"(
        layout(location = 0) in vec2 position;
        layout(location = 1) in float shift;
        void main() { gl_Position = vec4(position + vec2(shift, 0.0), 0.5, 1.0); })",
                                           red_fragment, [](Pipeline& p) {
                                               p.addAttribute(Pipeline::AttributePosition, FormatRGf32, 0, 0, 8);
                                               p.addAttribute(Pipeline::AttributeCustom, FormatRf32, 1, 0, 4, 1);
                                           });
    const std::array<float, 2> strip[] = {{-1, -1}, {-0.75f, -1}, {-0.75f, 1}, {-1, -1}, {-0.75f, 1}, {-1, 1}};
    const float shifts[] = {5, 0, 0.5f, 1};
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setVertices(0, strip);
        list.setVertices(1, shifts);
        list.drawArraysInstanced(6, 0, 3, 1);
    });
    const std::vector<Pixel> picture = pixels();
    EXPECT_EQ(countPixels(picture, red), 3u * 2 * 16);
    EXPECT_EQ(at(picture, 0, 0), red);
    EXPECT_EQ(at(picture, 4, 0), red);
    EXPECT_EQ(at(picture, 8, 0), red);
    EXPECT_EQ(at(picture, 12, 0), black);
}

TEST_F(CommandTest, Indirect) {
    const std::vector<Vertex> left = quad(-1, -1, 0, 1, {1, 0, 0, 1});
    const Buffer vertices = makeBuffer(left, Buffer::FlagVertex);
    const Buffer indices = makeBuffer(std::vector<uint32_t>{0, 1, 2, 3, 4, 5}, Buffer::FlagIndex);
    const Buffer arguments = makeBuffer(std::vector<uint32_t>{6, 1, 0, 0, 6, 1, 0, 0, 0}, Buffer::FlagIndirect);
    for (const bool indexed : {false, true}) {
        draw(color, [&](Command& list) {
            list.setPipeline(colored());
            list.setVertexBuffer(0, vertices);
            if (indexed) {
                list.setIndexBuffer(FormatRu32, indices);
                list.drawElementsIndirect(arguments, 16);
            } else {
                list.drawArraysIndirect(arguments);
            }
        });
        EXPECT_EQ(countPixels(pixels(), red), 128u) << indexed;
    }
}

TEST_F(CommandTest, IndirectWithSeveralDrawsWrittenByADispatch) {
    GLINT_NEED_FEATURE(FeatureMultiDrawIndirect);
    std::vector<Vertex> vertices = quad(-1, -1, 0, 1, {1, 0, 0, 1});
    const std::vector<Vertex> right = quad(0, -1, 1, 1, {0, 1, 0, 1});
    vertices.insert(vertices.end(), right.begin(), right.end());
    const Buffer buffer = makeBuffer(vertices, Buffer::FlagVertex);
    const Buffer arguments = device.createBuffer(Buffer::FlagIndirect | Buffer::FlagStorage, 64);
    Compute fill = device.createCompute();
    fill.setKernel(makeKernel(R"(
        layout(local_size_x = 2) in;
        layout(binding = 0) buffer Arguments { uint arguments[]; };
        void main() {
            uint i = gl_GlobalInvocationID.x * 8u;
            arguments[i] = 6u;
            arguments[i + 1u] = 1u;
            arguments[i + 2u] = gl_GlobalInvocationID.x * 6u;
            arguments[i + 3u] = 0u;
        })"));
    fill.setStorageBuffer(0, arguments);
    fill.dispatch(2);
    Command list = device.createCommand(device.createTarget(color));
    list.setPipeline(colored());
    list.setVertexBuffer(0, buffer);
    list.drawArraysIndirect(arguments, 0, 2, 32);
    EXPECT_THAT(device.submit({fill, list}), IsOk());
    EXPECT_EQ(countPixels(pixels(), red), 128u);
    EXPECT_EQ(countPixels(pixels(), green), 128u);
}

TEST_F(CommandTest, DrawsOfNothing) {
    draw(color, [&](Command& list) {
        list.setPipeline(covering());
        list.setPushConstants(Color::white());
        list.drawArrays(0);
        list.drawArraysInstanced(3, 0, 0);
        list.drawElements(0);
    });
    EXPECT_EQ(countPixels(pixels(), black), 256u);
}

TEST_F(CommandTest, ScissorAndViewport) {
    const Pipeline pipeline = covering();
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setPushConstants(Color{1, 0, 0, 1});
        list.setScissor(2, 3, 4, 5);
        list.drawArrays(3);
    });
    std::vector<Pixel> picture = pixels();
    EXPECT_EQ(countPixels(picture, red), 20u);
    EXPECT_EQ(at(picture, 2, 3), red);
    EXPECT_EQ(at(picture, 5, 7), red);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setPushConstants(Color{1, 0, 0, 1});
        list.setScissor(-5, -5, 7, 1000);
        list.drawArrays(3);
        list.setScissor(0, 0, 0, 0);
        list.drawArrays(3);
    });
    EXPECT_EQ(countPixels(pixels(), red), 32u);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setPushConstants(Color{1, 0, 0, 1});
        list.setViewport(8, 0, 8, 4);
        list.drawArrays(3);
    });
    picture = pixels();
    EXPECT_EQ(countPixels(picture, red), 32u);
    EXPECT_EQ(at(picture, 8, 0), red);
    EXPECT_EQ(at(picture, 15, 3), red);
}

TEST_F(CommandTest, DepthTest) {
    const std::pair<Pipeline::DepthFunc, std::array<bool, 3>> cases[] = {
        // Passes where the new depth is below, at and above the one in the target.
        {Pipeline::DepthFuncNever, {false, false, false}},      {Pipeline::DepthFuncLess, {true, false, false}},
        {Pipeline::DepthFuncEqual, {false, true, false}},       {Pipeline::DepthFuncLessEqual, {true, true, false}},
        {Pipeline::DepthFuncGreater, {false, false, true}},     {Pipeline::DepthFuncNotEqual, {true, false, true}},
        {Pipeline::DepthFuncGreaterEqual, {false, true, true}}, {Pipeline::DepthFuncAlways, {true, true, true}},
        {Pipeline::DepthFuncNone, {true, true, true}},
    };
    const Texture depth = makeTexture(FormatDf32, size, size);
    for (const auto& [func, expected] : cases) {
        const Pipeline pipeline = covering([&, f = func](Pipeline& p) {
            p.setDepthFormat(FormatDf32);
            p.setDepthFunc(f);
            p.setDepthMask(false);
        });
        for (size_t i = 0; i < 3; i++) {
            Target target = device.createTarget(color, depth);
            target.setClearDepth(0.75f - 0.25f * static_cast<float>(i));
            Command list = device.createCommand(target);
            list.setPipeline(pipeline);
            list.setPushConstants(Color{1, 0, 0, 1});
            list.drawArrays(3);
            submit(list);
            EXPECT_EQ(countPixels(pixels(), red), expected[i] ? 256u : 0u) << static_cast<int>(func) << ", " << i;
        }
    }
}

TEST_F(CommandTest, DepthIsWrittenAndBiased) {
    const Texture depth = makeTexture(FormatDf32, size, size);
    const auto drawn = [&](bool write, float bias) {
        const Pipeline pipeline = covering([&](Pipeline& p) {
            p.setDepthFormat(FormatDf32);
            p.setDepthFunc(Pipeline::DepthFuncLess);
            p.setDepthMask(write);
            if (bias != 0) p.setDepthBias(bias, 0);
        });
        Command list = device.createCommand(device.createTarget(color, depth));
        list.setPipeline(pipeline);
        list.setPushConstants(Color{1, 0, 0, 1});
        list.drawArrays(3);
        submit(list);
        return readTexture<float>(depth)[0];
    };
    EXPECT_EQ(drawn(true, 0), 0.5f);
    EXPECT_EQ(drawn(false, 0), 1.0f);
    EXPECT_GT(drawn(true, 1000), 0.5f);
    EXPECT_LT(drawn(true, -1000), 0.5f);
}

TEST_F(CommandTest, DepthClamp) {
    GLINT_NEED_FEATURE(FeatureDepthClamp);
    const std::array<float, 4> beyond[] = {{-1, -1, 2, 1}, {3, -1, 2, 1}, {-1, 3, 2, 1}};
    for (const bool clamp : {false, true}) {
        const Pipeline pipeline = makePipeline(position_vertex, red_fragment, [&](Pipeline& p) {
            p.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 0, 0, 16);
            p.setDepthClamp(clamp);
        });
        draw(color, [&](Command& list) {
            list.setPipeline(pipeline);
            list.setVertices(0, beyond);
            list.drawArrays(3);
        });
        EXPECT_EQ(countPixels(pixels(), red), clamp ? 256u : 0u);
    }
}

TEST_F(CommandTest, Stencil) {
    const Format format = device.hasTexture(FormatDu24Su8, Texture::FlagTarget) ? FormatDu24Su8 : FormatDf32Su8;
    const Texture depth = makeTexture(format, size, size);
    const Pipeline mark = covering([&](Pipeline& p) {
        p.setDepthFormat(format);
        p.setStencilFunc(Pipeline::DepthFuncAlways, Pipeline::StencilOpKeep, Pipeline::StencilOpKeep,
                         Pipeline::StencilOpReplace);
    });
    const Pipeline add = covering([&](Pipeline& p) {
        p.setDepthFormat(format);
        p.setStencilFunc(Pipeline::DepthFuncAlways, Pipeline::StencilOpKeep, Pipeline::StencilOpKeep,
                         Pipeline::StencilOpIncrSat);
    });
    const Pipeline equal = covering([&](Pipeline& p) {
        p.setDepthFormat(format);
        p.setStencilFunc(Pipeline::DepthFuncEqual, Pipeline::StencilOpKeep, Pipeline::StencilOpKeep,
                         Pipeline::StencilOpKeep);
        p.setStencilMask(0x0f, 0x00);
    });
    Command list = device.createCommand(device.createTarget(color, depth));
    list.setPushConstants(Color{0, 0, 1, 1});
    list.setPipeline(mark);
    list.setStencilRef(0x15);
    list.setScissor(0, 0, 8, 16);
    list.drawArrays(3);
    list.setPipeline(add);
    list.setScissor(0, 0, 4, 16);
    list.drawArrays(3);
    list.setPipeline(equal);
    list.setScissor(0, 0, 16, 16);
    list.setPushConstants(Color{1, 0, 0, 1});
    list.setStencilRef(0x06);  // 0x16 in the bits that are read
    list.drawArrays(3);
    submit(list);
    const std::vector<Pixel> picture = pixels();
    EXPECT_EQ(countPixels(picture, red), 64u);
    EXPECT_EQ(countPixels(picture, blue), 64u);
    EXPECT_EQ(countPixels(picture, black), 128u);
}

TEST_F(CommandTest, Blending) {
    struct Case {
        Pipeline::BlendOp op;
        Pipeline::BlendFunc source, destination;
        Color first, second;
        Pixel expected;
    };
    const Case cases[] = {
        {Pipeline::BlendOpAdd,
         Pipeline::BlendFuncOne,
         Pipeline::BlendFuncOne,
         {0.2f, 0, 0, 0},
         {0.4f, 1, 0, 0},
         {153, 255, 0, 0}},
        {Pipeline::BlendOpAdd,
         Pipeline::BlendFuncSrcAlpha,
         Pipeline::BlendFuncInvSrcAlpha,
         {1, 0, 0, 1},
         {0, 1, 0, 0.2f},
         {204, 51, 0, 214}},
        {Pipeline::BlendOpSub,
         Pipeline::BlendFuncOne,
         Pipeline::BlendFuncOne,
         {0.2f, 1, 0, 0},
         {0.4f, 0, 0, 0},
         {51, 0, 0, 0}},
        {Pipeline::BlendOpRevSub,
         Pipeline::BlendFuncOne,
         Pipeline::BlendFuncOne,
         {0.4f, 1, 0, 0},
         {0.2f, 0, 0, 0},
         {51, 255, 0, 0}},
        {Pipeline::BlendOpMin,
         Pipeline::BlendFuncOne,
         Pipeline::BlendFuncOne,
         {0.4f, 0.2f, 0, 0},
         {0.2f, 0.4f, 1, 0},
         {51, 51, 0, 0}},
        {Pipeline::BlendOpMax,
         Pipeline::BlendFuncOne,
         Pipeline::BlendFuncOne,
         {0.4f, 0.2f, 0, 0},
         {0.2f, 0.4f, 1, 0},
         {102, 102, 255, 0}},
        {Pipeline::BlendOpAdd,
         Pipeline::BlendFuncDestColor,
         Pipeline::BlendFuncZero,
         {0.4f, 1, 0, 1},
         {0.5f, 0.2f, 1, 1},
         {51, 51, 0, 255}},
        {Pipeline::BlendOpAdd,
         Pipeline::BlendFuncFactor,
         Pipeline::BlendFuncInvFactor,
         {1, 0, 0, 1},
         {0, 1, 0, 1},
         {204, 51, 0, 255}},
        {Pipeline::BlendOpNone,
         Pipeline::BlendFuncOne,
         Pipeline::BlendFuncOne,
         {1, 0, 0, 1},
         {0, 1, 0, 0.2f},
         {0, 255, 0, 51}},
        {Pipeline::BlendOpAdd,
         Pipeline::BlendFuncSrcColor,
         Pipeline::BlendFuncInvSrcColor,
         {1, 0, 0, 1},
         {0.2f, 0.2f, 0, 1},
         {214, 10, 0, 255}},
        {Pipeline::BlendOpAdd,
         Pipeline::BlendFuncDestAlpha,
         Pipeline::BlendFuncInvDestAlpha,
         {1, 0, 0, 0.2f},
         {0, 1, 0, 0},
         {204, 51, 0, 41}},
        {Pipeline::BlendOpAdd,
         Pipeline::BlendFuncInvDestColor,
         Pipeline::BlendFuncZero,
         {0.8f, 1, 0, 0},
         {1, 1, 1, 1},
         {51, 0, 255, 255}},
    };
    for (const Case& c : cases) {
        SCOPED_TRACE(&c - cases);
        const Pipeline plain = covering();
        const Pipeline blending = covering([&](Pipeline& p) { p.setBlend(c.op, c.source, c.destination); });
        draw(color, [&](Command& list) {
            list.setBlendFactor({0.2f, 0.2f, 0.2f, 0.2f});
            list.setPipeline(plain);
            list.setPushConstants(c.first);
            list.drawArrays(3);
            list.setPipeline(blending);
            list.setPushConstants(c.second);
            list.drawArrays(3);
        });
        const Pixel pixel = at(pixels(), 5, 5);
        for (size_t i = 0; i < 4; i++) EXPECT_NEAR(pixel[i], c.expected[i], 1) << i;
    }
}

TEST_F(CommandTest, BlendingOfColourAndAlphaApart) {
    const Pipeline pipeline = covering([](Pipeline& p) {
        p.setBlendColor(0, Pipeline::BlendOpAdd, Pipeline::BlendFuncZero, Pipeline::BlendFuncOne);
        p.setBlendAlpha(0, Pipeline::BlendOpAdd, Pipeline::BlendFuncOne, Pipeline::BlendFuncZero);
    });
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setPushConstants(Color{1, 1, 1, 0.2f});
        list.drawArrays(3);
    });
    EXPECT_EQ(at(pixels(), 0, 0), (Pixel{0, 0, 0, 51}));
}

TEST_F(CommandTest, ColourMask) {
    const Pipeline pipeline =
        covering([](Pipeline& p) { p.setColorMask(Pipeline::ColorMaskR | Pipeline::ColorMaskB); });
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setPushConstants(Color{1, 1, 1, 0});
        list.drawArrays(3);
    });
    EXPECT_EQ(at(pixels(), 0, 0), (Pixel{255, 0, 255, 255}));
}

TEST_F(CommandTest, EveryResourceInADraw) {
    const Pipeline pipeline = makePipeline(R"(
        layout(binding = 0) uniform Shift { vec4 shift; };
        layout(binding = 1) readonly buffer Corners { vec2 corners[]; };
        void main() { gl_Position = vec4(corners[gl_VertexIndex] + shift.xy, 0.5, 1.0); })",
                                           R"(
        layout(set = 1, binding = 0) uniform sampler2D picture;
        layout(set = 1, binding = 1) uniform samplerBuffer texels;
        layout(push_constant) uniform Push { float blue_part; };
        layout(location = 0) out vec4 color;
        void main() { color = vec4(texture(picture, vec2(0.5)).r, texelFetch(texels, 1).r, blue_part, 1.0); })");
    const Texture picture = makeTexture(FormatRGBAu8n, 1, 1, 0);
    device.setTexture(picture, Pixel{51, 0, 0, 0}.data(), 4);
    const Buffer texels = makeBuffer(std::vector<float>{0, 0.4f}, Buffer::FlagTexel);
    const Buffer corners = makeBuffer(std::vector<std::array<float, 2>>{{-2, -1}, {2, -1}, {-2, 3}});
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setUniform(0, Color{1, 0, 0, 0});
        list.setStorageBuffer(0, corners);
        list.setTexture(0, picture);
        list.setSampler(0, device.createSampler());
        list.setTexelBuffer(0, texels, FormatRf32);
        list.setPushConstants(0.6f);
        list.drawArrays(3);
    });
    EXPECT_EQ(countPixels(pixels(), {51, 102, 153, 255}), 256u);
}

TEST_F(CommandTest, FragmentsWriteBuffersAndSurfaces) {
    const Pipeline pipeline = makePipeline(cover_vertex, R"(
        layout(binding = 0) buffer Count { uint count; };
        layout(binding = 1, r32ui) uniform uimage2D surface;
        layout(location = 0) out vec4 color;
        void main() {
            atomicAdd(count, 1u);
            imageStore(surface, ivec2(gl_FragCoord.xy), uvec4(gl_FragCoord.x));
            color = vec4(1.0);
        })");
    const Buffer count = makeBuffer(std::vector<uint32_t>(1));
    const Texture surface = makeTexture(FormatRu32, size, size, Texture::FlagSurface);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setStorageBuffer(0, count);
        list.setSurfaceTexture(0, surface);
        list.drawArrays(3);
    });
    EXPECT_EQ(read<uint32_t>(count)[0], 256u);
    const std::vector<uint32_t> columns = readTexture<uint32_t>(surface);
    for (uint32_t i = 0; i < 256; i++) EXPECT_EQ(columns[i], i % 16);
}

TEST_F(CommandTest, ConflictsWithinAPassAreOrdered) {
    // The second draw reads what the first wrote: the pass has to be split.
    const Pipeline write = makePipeline(cover_vertex, R"(
        layout(binding = 0) writeonly buffer Values { uint values[]; };
        layout(location = 0) out vec4 color;
        void main() { values[uint(gl_FragCoord.y) * 16u + uint(gl_FragCoord.x)] = uint(gl_FragCoord.x); color = vec4(0.0); })");
    const Pipeline show = makePipeline(cover_vertex, R"(
        layout(binding = 0) readonly buffer Values { uint values[]; };
        layout(location = 0) out vec4 color;
        void main() { color = vec4(float(values[uint(gl_FragCoord.y) * 16u + 15u - uint(gl_FragCoord.x)]) / 255.0); })");
    const Buffer values = makeBuffer(std::vector<uint32_t>(256));
    draw(color, [&](Command& list) {
        list.setStorageBuffer(0, values);
        list.setPipeline(write);
        list.drawArrays(3);
        list.setPipeline(show);
        list.drawArrays(3);
    });
    const std::vector<Pixel> picture = pixels();
    for (uint32_t x = 0; x < size; x++) EXPECT_EQ(at(picture, x, 3)[0], 15 - x);
}

TEST_F(CommandTest, ComputeAndDrawsTakeTurns) {
    const Pipeline pipeline = makePipeline(cover_vertex, R"(
        layout(binding = 0) readonly buffer Values { float value; };
        layout(location = 0) out vec4 color;
        void main() { color = vec4(value / 255.0); })");
    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 1) in;
        layout(binding = 0) buffer Values { float value; };
        layout(binding = 1) uniform sampler2D picture;
        void main() { value = texelFetch(picture, ivec2(3), 0).x * 255.0 + 7.0; })");
    const Buffer value = makeBuffer(std::vector<float>{0});
    const Sampler sampler = device.createSampler();
    const Target target = device.createTarget(color);
    for (int i = 0; i < 5; i++) {
        Compute compute = device.createCompute();
        compute.setKernel(kernel);
        compute.setStorageBuffer(0, value);
        compute.setTexture(0, color);
        compute.setSampler(0, sampler);
        if (i) compute.dispatch(1);
        Command command = device.createCommand(target);
        command.setPipeline(pipeline);
        command.setStorageBuffer(0, value);
        command.drawArrays(3);
        EXPECT_THAT(device.submit({compute, command}), IsOk());
    }
    EXPECT_EQ(at(pixels(), 0, 0), (Pixel{28, 28, 28, 28}));
}

TEST_F(CommandTest, ManyDrawsWithChangingUniforms) {
    const Pipeline pipeline = makePipeline(cover_vertex, R"(
        layout(binding = 0) uniform Tint { vec4 tint; };
        layout(location = 0) out vec4 color;
        void main() { color = tint; })");
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        for (uint32_t i = 0; i < 256; i++) {
            list.setUniform(0, Color{static_cast<float>(i) / 255, 0, 0, 1});
            list.setScissor(static_cast<int32_t>(i % 16), static_cast<int32_t>(i / 16), 1, 1);
            list.drawArrays(3);
        }
    });
    const std::vector<Pixel> picture = pixels();
    for (uint32_t i = 0; i < 256; i++) EXPECT_EQ(picture[i][0], i);
}

TEST_F(CommandTest, LayeredRendering) {
    const Texture layers = device.createTexture(
        {.format = FormatRGBAu8n, .width = 4, .height = 4, .layers = 2, .flags = Texture::FlagTarget});
    Target target = device.createTarget();
    target.setColorTexture(0, layers);
    target.setClearColor(Color{0, 1, 0, 1});
    Command list = device.createCommand(target);
    list.setPipeline(covering());
    list.setPushConstants(Color{1, 0, 0, 1});
    list.drawArrays(3);
    submit(list);
    // Without a layer chosen by the shader a draw goes to the first; the clear covers all.
    EXPECT_EQ(countPixels(readTexture<Pixel>(layers, {0, 1, 0, 1}), red), 16u);
    EXPECT_EQ(countPixels(readTexture<Pixel>(layers, {0, 1, 1, 1}), green), 16u);
}

TEST_F(CommandTest, RegionsAndQueriesInADraw) {
    const Query samples = device.createQuery(Query::TypeSamples);
    draw(color, [&](Command& list) {
        list.pushRegion("draw");
        list.setPipeline(covering());
        list.setPushConstants(Color::white());
        list.beginQuery(samples);
        list.setScissor(0, 0, 3, 3);
        list.drawArrays(3);
        list.endQuery(samples);
        list.popRegion();
    });
    const Expected<uint64_t> count = device.getSamples(samples);
    ASSERT_THAT(count, IsOk());
    EXPECT_EQ(*count, 9u);
}

}  // namespace glint::test
