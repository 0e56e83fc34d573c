// What happens between a fragment and its target: stencil operations, depth and stencil together, blending of several
// targets and of values beyond 1, samples of their own.

#include "conformance/conformance.h"

namespace glint::test {

namespace {

constexpr uint32_t size = 4;

class OutputTest : public ConformanceTest {
protected:
    void SetUp() override {
        ConformanceTest::SetUp();
        if (!device) return;
        stencil_format = device.hasTexture(FormatDu24Su8, Texture::FlagTarget) ? FormatDu24Su8 : FormatDf32Su8;
        color = makeTexture(FormatRGBAu8n, size, size);
        depth = makeTexture(stencil_format, size, size);
    }
    void TearDown() override {
        color = depth = {};
        ConformanceTest::TearDown();
    }

    Pipeline covering(const std::function<void(Pipeline&)>& configure) {
        return makePipeline(cover_vertex, red_fragment, [&](Pipeline& pipeline) {
            pipeline.setDepthFormat(stencil_format);
            configure(pipeline);
        });
    }
    /// One draw at depth 0.5 over a target with this depth and stencil.
    void drawOver(const Pipeline& pipeline, float old_depth, uint32_t old_stencil, uint32_t reference) {
        Target target = device.createTarget(color, depth);
        target.setClearDepth(old_depth, old_stencil);
        Command list = device.createCommand(target);
        list.setPipeline(pipeline);
        list.setStencilRef(reference);
        list.drawArrays(3);
        submit(list);
    }
    /// True if the stencil is this one everywhere; by drawing where it equals it.
    bool isStencil(uint32_t value) {
        const Pipeline equal = covering([](Pipeline& pipeline) {
            pipeline.setStencilFunc(Pipeline::DepthFuncEqual, Pipeline::StencilOpKeep, Pipeline::StencilOpKeep,
                                    Pipeline::StencilOpKeep);
        });
        Target target = device.createTarget(color, depth);
        target.setDepthOperation(Target::BeginLoad | Target::EndStore);
        Command list = device.createCommand(target);
        list.setPipeline(equal);
        list.setStencilRef(value);
        list.drawArrays(3);
        submit(list);
        return countPixels(readTexture<Pixel>(color), red) == size * size;
    }

    Format stencil_format = FormatUnknown;
    Texture color, depth;
};

}  // namespace

TEST_F(OutputTest, EveryStencilOperation) {
    struct Case {
        Pipeline::StencilOp op;
        uint32_t before, after;
    };
    const Case cases[] = {
        {Pipeline::StencilOpKeep, 7, 7},        {Pipeline::StencilOpZero, 7, 0},
        {Pipeline::StencilOpReplace, 7, 0x5a},  {Pipeline::StencilOpInvert, 0x0f, 0xf0},
        {Pipeline::StencilOpIncrWrap, 255, 0},  {Pipeline::StencilOpIncrWrap, 7, 8},
        {Pipeline::StencilOpDecrWrap, 0, 255},  {Pipeline::StencilOpDecrWrap, 7, 6},
        {Pipeline::StencilOpIncrSat, 255, 255}, {Pipeline::StencilOpIncrSat, 7, 8},
        {Pipeline::StencilOpDecrSat, 0, 0},     {Pipeline::StencilOpDecrSat, 7, 6},
    };
    for (const Case& c : cases) {
        const Pipeline pipeline = covering([&](Pipeline& p) {
            p.setStencilFunc(Pipeline::DepthFuncAlways, Pipeline::StencilOpKeep, Pipeline::StencilOpKeep, c.op);
        });
        drawOver(pipeline, 1, c.before, 0x5a);
        EXPECT_TRUE(isStencil(c.after)) << static_cast<int>(c.op) << " of " << c.before;
    }
}

TEST_F(OutputTest, WhichStencilOperation) {
    // Fail: invert; depth fails: add; passes: replace.
    const Pipeline pipeline = covering([](Pipeline& p) {
        p.setDepthFunc(Pipeline::DepthFuncLess);
        p.setStencilFunc(Pipeline::DepthFuncLess, Pipeline::StencilOpInvert, Pipeline::StencilOpIncrSat,
                         Pipeline::StencilOpReplace);
    });
    drawOver(pipeline, 1, 9, 10);  // 10 < 9 does not hold
    EXPECT_TRUE(isStencil(0xf6));
    drawOver(pipeline, 0.25f, 11, 10);
    EXPECT_TRUE(isStencil(12));
    drawOver(pipeline, 1, 11, 10);
    EXPECT_TRUE(isStencil(10));
}

TEST_F(OutputTest, EachFaceHasAStencilOfItsOwn) {
    // The front face to the left, the back face to the right.
    constexpr const char* two_faces = R"(
        void main() {
            int corner = gl_VertexIndex % 6, side = gl_VertexIndex / 6;
            vec2 p = vec2(corner == 1 || corner == 2 || corner == 4, corner == 2 || corner == 4 || corner == 5);
            if (side == 1) p.x = 1.0 - p.x;
            gl_Position = vec4(p.x - 1.0 + float(side), p.y * 2.0 - 1.0, 0.5, 1.0);
        })";
    using P = Pipeline;
    struct Case {
        std::function<void(Pipeline&)> configure;
        uint32_t left, right;
    };
    const auto keep = P::StencilOpKeep;
    const Case cases[] = {
        {[=](Pipeline& p) {
             p.setStencilFrontFunc(P::DepthFuncAlways, keep, keep, P::StencilOpIncrSat);
             p.setStencilBackFunc(P::DepthFuncAlways, keep, keep, P::StencilOpDecrSat);
         },
         8, 6},
        {[=](Pipeline& p) {
             p.setStencilFrontFunc(P::DepthFuncEqual, P::StencilOpZero, keep, P::StencilOpInvert);
             p.setStencilBackFunc(P::DepthFuncNotEqual, P::StencilOpZero, keep, P::StencilOpInvert);
         },
         0xf8, 0},
        {[=](Pipeline& p) { p.setStencilBackFunc(P::DepthFuncAlways, keep, keep, P::StencilOpZero); }, 7, 0},
        {[=](Pipeline& p) {
             p.setStencilFunc(P::DepthFuncAlways, keep, keep, P::StencilOpZero);
             p.setStencilBackFunc(P::DepthFuncNone, keep, keep, P::StencilOpZero);
         },
         0, 7},
    };
    for (const Case& c : cases) {
        SCOPED_TRACE(&c - cases);
        const Pipeline pipeline = makePipeline(two_faces, red_fragment, [&](Pipeline& p) {
            p.setDepthFormat(stencil_format);
            c.configure(p);
        });
        Target target = device.createTarget(color, depth);
        target.setClearDepth(1, 7);
        Command list = device.createCommand(target);
        list.setPipeline(pipeline);
        list.setStencilRef(7);
        list.drawArrays(12);
        submit(list);
        const auto equals = [&](uint32_t value, uint32_t side) {
            isStencil(value);
            const std::vector<Pixel> picture = readTexture<Pixel>(color);
            for (uint32_t i = 0; i < size * size; i++)
                if (i % size / 2 == side && picture[i] != red) return false;
            return true;
        };
        EXPECT_TRUE(equals(c.left, 0));
        EXPECT_TRUE(equals(c.right, 1));
    }
}

TEST_F(OutputTest, StencilMasks) {
    const Pipeline pipeline = covering([](Pipeline& p) {
        p.setStencilFunc(Pipeline::DepthFuncAlways, Pipeline::StencilOpKeep, Pipeline::StencilOpKeep,
                         Pipeline::StencilOpReplace);
        p.setStencilMask(0xff, 0x0f);
    });
    drawOver(pipeline, 1, 0xa0, 0x5b);
    EXPECT_TRUE(isStencil(0xab));
}

TEST_F(OutputTest, EveryTargetBlendsAsItSays) {
    const Texture first = makeTexture(FormatRGBAu8n, size, size), second = makeTexture(FormatRGBAf16, size, size);
    Target target = device.createTarget();
    target.setColorTexture(0, first);
    target.setColorTexture(1, second);
    target.setClearColor(0, Color{0.2f, 0.2f, 0.2f, 0.2f});
    target.setClearColor(1, Color{2, 2, 2, 2});
    const Pipeline pipeline = makePipeline(
        cover_vertex, R"(
        layout(location = 0) out vec4 first;
        layout(location = 1) out vec4 second;
        void main() { first = vec4(0.4, 0.0, 1.0, 0.5); second = vec4(100.0, -1.0, 0.5, 0.25); })",
        [](Pipeline& p) {
            p.setColorFormat(FormatRGBAf16, 1);
            p.setBlendColor(0, Pipeline::BlendOpAdd, Pipeline::BlendFuncOne, Pipeline::BlendFuncOne);
            p.setBlendAlpha(0, Pipeline::BlendOpMax, Pipeline::BlendFuncOne, Pipeline::BlendFuncOne);
            p.setBlendColor(1, Pipeline::BlendOpRevSub, Pipeline::BlendFuncSrcAlpha, Pipeline::BlendFuncOne);
            p.setBlendAlpha(1, Pipeline::BlendOpAdd, Pipeline::BlendFuncZero, Pipeline::BlendFuncDestAlpha);
        });
    Command list = device.createCommand(target);
    list.setPipeline(pipeline);
    list.drawArrays(3);
    submit(list);
    const Pixel pixel = readTexture<Pixel>(first)[5];
    const std::array<int, 4> expected = {153, 51, 255, 128};
    for (size_t i = 0; i < 4; i++) EXPECT_NEAR(pixel[i], expected[i], 1) << i;
    // 2 - 0.25 x, beyond the range of what is normalised; 2 * 2. All exact in float16.
    const std::vector<uint16_t> halves = readTexture<uint16_t>(second);
    EXPECT_EQ(halves[0], 0xcdc0);  // -23
    EXPECT_EQ(halves[1], 0x4080);  // 2.25
    EXPECT_EQ(halves[2], 0x3f80);  // 1.875
    EXPECT_EQ(halves[3], 0x4400);  // 4
}

TEST_F(OutputTest, SlopesAddToDepthBias) {
    // A plane whose depth grows by 0.5 over the 4 pixels of the target: 0.125 a pixel.
    const Texture plain = makeTexture(FormatDf32, size, size);
    const auto depthsWith = [&](float bias, float slope) {
        const Pipeline pipeline = makePipeline(R"(
            void main() {
                vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0;
                gl_Position = vec4(corner, 0.5 + 0.25 * corner.x, 1.0);
            })",
                                               red_fragment, [&](Pipeline& p) {
                                                   p.setDepthFormat(FormatDf32);
                                                   p.setDepthFunc(Pipeline::DepthFuncAlways);
                                                   p.setDepthBias(bias, slope);
                                               });
        Command list = device.createCommand(device.createTarget(color, plain));
        list.setPipeline(pipeline);
        list.drawArrays(3);
        submit(list);
        return readTexture<float>(plain);
    };
    const std::vector<float> without = depthsWith(0, 0), with = depthsWith(0, 0.5f);
    // Interpolated depths and the slope are float32: a few units of 2^-24 each.
    for (size_t i = 0; i < without.size(); i++) {
        EXPECT_NEAR(without[i], 0.25f + 0.125f * (static_cast<float>(i % size) + 0.5f), 1e-6f) << i;
        EXPECT_NEAR(with[i] - without[i], 0.5f * 0.125f, 1e-6f) << i;
    }
}

TEST_F(OutputTest, ShadersMayRunForEverySample) {
    if (!device.hasTexture(FormatRGBAf32, Texture::FlagTarget | Texture::FlagMultisample4))
        GTEST_SKIP() << "no float32 targets of 4 samples";
    const Texture samples = makeTexture(FormatRGBAf32, size, size, Texture::FlagTarget | Texture::FlagMultisample4);
    const Texture mean = makeTexture(FormatRGBAf32, size, size);
    Target target = device.createTarget(samples);
    target.setColorResolve(0, mean);
    const Pipeline pipeline = makePipeline(
        cover_vertex, "layout(location = 0) out vec4 color; void main() { color = vec4(float(1 << gl_SampleID)); }",
        [](Pipeline& p) { p.setMultisample(4); }, FormatRGBAf32);
    Command list = device.createCommand(target);
    list.setPipeline(pipeline);
    list.drawArrays(3);
    submit(list);
    for (const float value : readTexture<float>(mean)) EXPECT_EQ(value, 3.75f);  // of 1, 2, 4 and 8
}

TEST_F(OutputTest, DrawsBlendInTheirOrder) {
    // Blending does not commute: the order is that of the draws, whatever runs at once.
    const Pipeline pipeline = makePipeline(cover_vertex, push_fragment, [](Pipeline& p) {
        p.setBlend(Pipeline::BlendOpAdd, Pipeline::BlendFuncSrcAlpha, Pipeline::BlendFuncInvSrcAlpha);
    });
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        for (int i = 0; i < 32; i++) {
            list.setPushConstants(i % 2 ? Color{1, 0, 0, 0.5f} : Color{0, 1, 0, 0.5f});
            list.drawArrays(3);
        }
    });
    // The last is red at 1/2, the one before green at 1/4, ...: 2/3 and 1/3.
    const Pixel pixel = readTexture<Pixel>(color)[0];
    EXPECT_NEAR(pixel[0], 170, 2);
    EXPECT_NEAR(pixel[1], 85, 2);
}

}  // namespace glint::test
