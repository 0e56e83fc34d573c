#include "conformance/conformance.h"

namespace glint::test {

namespace {

class TargetTest : public ConformanceTest {
protected:
    /// Runs an empty pass.
    void pass(const Target& target) {
        Command list = device.createCommand(target);
        submit(list);
    }
    std::vector<Pixel> pixels(const Texture& texture, const Slice& slice = {}) {
        return readTexture<Pixel>(texture, slice);
    }
};

}  // namespace

TEST_F(TargetTest, NullTargetIsHarmless) {
    Target target;
    target.setColorTexture(0, Texture());
    target.setColorResolve(0, Texture());
    target.setDepthTexture(Texture());
    target.setColorOperation(0, Target::OpDefault);
    target.setDepthOperation(Target::OpDefault);
    target.setClearColor(Color::white());
    target.setClearDepth(0);
    EXPECT_EQ(target.getWidth() + target.getHeight(), 0u);
}

TEST_F(TargetTest, ClearsAndLoads) {
    const Texture color = makeTexture(FormatRGBAu8n, 8, 4);
    Target target = device.createTarget(color);
    EXPECT_EQ(target.getWidth(), 8u);
    EXPECT_EQ(target.getHeight(), 4u);
    target.setClearColor(Color{1, 0, 0, 1});
    pass(target);
    EXPECT_EQ(countPixels(pixels(color), red), 32u);
    target.setColorOperation(0, Target::BeginLoad | Target::EndStore);
    target.setClearColor(Color{0, 1, 0, 1});
    pass(target);
    EXPECT_EQ(countPixels(pixels(color), red), 32u);
    target.setColorOperation(0, Target::OpDefault);
    pass(target);
    EXPECT_EQ(countPixels(pixels(color), green), 32u);
}

TEST_F(TargetTest, DiscardedContentsMayBeDrawnOver) {
    const Texture color = makeTexture(FormatRGBAu8n, 8, 8);
    Target target = device.createTarget(color);
    target.setColorOperation(0, Target::BeginDiscard | Target::EndStore);
    const Pipeline pipeline = makePipeline(cover_vertex, red_fragment);
    Command list = device.createCommand(target);
    list.setPipeline(pipeline);
    list.drawArrays(3);
    submit(list);
    EXPECT_EQ(countPixels(pixels(color), red), 64u);
}

TEST_F(TargetTest, ClearsOfEveryClass) {
    const Texture whole = makeTexture(FormatRu32, 4, 4);
    const Texture negative = makeTexture(FormatRi32, 4, 4);
    const Texture real = makeTexture(FormatRGBAf32, 4, 4);
    Target target = device.createTarget();
    target.setColorTexture(0, whole);
    target.setColorTexture(1, negative);
    target.setColorTexture(2, real);
    target.setClearColor(0, Color{1000, 0, 0, 0});
    target.setClearColor(1, Color{-5, 0, 0, 0});
    target.setClearColor(2, Color{0.25f, -4, 1e6f, 0});
    pass(target);
    EXPECT_EQ(readTexture<uint32_t>(whole), std::vector<uint32_t>(16, 1000));
    EXPECT_EQ(readTexture<int32_t>(negative), std::vector<int32_t>(16, -5));
    EXPECT_EQ(readTexture<float>(real)[2], 1e6f);
}

TEST_F(TargetTest, SeveralColours) {
    const uint32_t count = std::min(device.getFeatures().maxTargets, 4u);
    ASSERT_GE(count, 2u);
    std::vector<Texture> colors;
    Target target = device.createTarget();
    std::string outputs, writes;
    for (uint32_t i = 0; i < count; i++) {
        colors.push_back(makeTexture(FormatRGBAu8n, 4, 4));
        target.setColorTexture(i, colors.back());
        outputs += "layout(location = " + std::to_string(i) + ") out vec4 color" + std::to_string(i) + ";\n";
        writes += "color" + std::to_string(i) + " = vec4(" + std::to_string(i * 10) + ".0 / 255.0);\n";
    }
    const Pipeline pipeline = makePipeline(cover_vertex, outputs + "void main() {\n" + writes + "}", [&](Pipeline& p) {
        for (uint32_t i = 1; i < count; i++) p.setColorFormat(FormatRGBAu8n, i);
    });
    Command list = device.createCommand(target);
    list.setPipeline(pipeline);
    list.drawArrays(3);
    submit(list);
    for (uint32_t i = 0; i < count; i++) {
        const auto value = static_cast<uint8_t>(i * 10);
        EXPECT_EQ(countPixels(pixels(colors[i]), {value, value, value, value}), 16u) << i;
    }
}

TEST_F(TargetTest, MaskedColoursNeedNoOutput) {
    Target target = device.createTarget();
    const Texture first = makeTexture(FormatRGBAu8n, 4, 4), second = makeTexture(FormatRGBAu8n, 4, 4);
    target.setColorTexture(0, first);
    target.setColorTexture(1, second);
    const Pipeline pipeline = makePipeline(cover_vertex, red_fragment, [](Pipeline& p) {
        p.setColorFormat(FormatRGBAu8n, 1);
        p.setColorMask(Pipeline::ColorMaskNone, 1);
    });
    Command list = device.createCommand(target);
    list.setPipeline(pipeline);
    list.drawArrays(3);
    submit(list);
    EXPECT_EQ(countPixels(pixels(first), red), 16u);
    EXPECT_EQ(countPixels(pixels(second), black), 16u);
}

TEST_F(TargetTest, ColoursMayHaveGaps) {
    if (device.getFeatures().maxTargets < 3)
        GTEST_SKIP() << "needs three colour targets at once, the adapter has " << device.getFeatures().maxTargets;
    const Texture first = makeTexture(FormatRGBAu8n, 4, 4), third = makeTexture(FormatRGBAu8n, 4, 4);
    Target target = device.createTarget();
    target.setColorTexture(0, first);
    target.setColorTexture(2, third);
    const Pipeline pipeline = makePipeline(cover_vertex, R"(
        layout(location = 0) out vec4 first;
        layout(location = 2) out vec4 third;
        void main() { first = vec4(1.0, 0.0, 0.0, 1.0); third = vec4(0.0, 0.0, 1.0, 1.0); })",
                                           [](Pipeline& p) { p.setColorFormat(FormatRGBAu8n, 2); });
    Command list = device.createCommand(target);
    list.setPipeline(pipeline);
    list.drawArrays(3);
    submit(list);
    EXPECT_EQ(countPixels(pixels(first), red), 16u);
    EXPECT_EQ(countPixels(pixels(third), blue), 16u);
}

TEST_F(TargetTest, DepthAlone) {
    const Texture depth = makeTexture(FormatDf32, 8, 8);
    Target target = device.createTarget();
    target.setDepthTexture(depth);
    target.setClearDepth(0.75f);
    EXPECT_EQ(target.getWidth(), 8u);
    const Pipeline pipeline = makePipeline(cover_vertex, "", [](Pipeline& p) {
        p.setColorFormat(FormatUnknown);
        p.setDepthFormat(FormatDf32);
        p.setDepthFunc(Pipeline::DepthFuncLess);
    });
    Command list = device.createCommand(target);
    list.setPipeline(pipeline);
    list.setScissor(0, 0, 4, 8);
    list.drawArrays(3);
    submit(list);
    const std::vector<float> values = readTexture<float>(depth);
    for (size_t i = 0; i < 64; i++) EXPECT_EQ(values[i], i % 8 < 4 ? 0.5f : 0.75f);
}

TEST_F(TargetTest, MipLevelsAndLayers) {
    const Texture color = device.createTexture(
        {.format = FormatRGBAu8n, .width = 16, .height = 8, .layers = 3, .mipmaps = 3, .flags = Texture::FlagTarget});
    device.clearTexture(color, Color{0, 0, 1, 1});
    Target target = device.createTarget();
    target.setColorTexture(0, color, {.mip = 1, .mips = 1, .layer = 2, .layers = 1});
    EXPECT_EQ(target.getWidth(), 8u);
    EXPECT_EQ(target.getHeight(), 4u);
    target.setClearColor(Color{1, 0, 0, 1});
    pass(target);
    EXPECT_EQ(countPixels(pixels(color, {1, 1, 2, 1}), red), 32u);
    EXPECT_EQ(countPixels(pixels(color, {1, 1, 1, 1}), blue), 32u);
    EXPECT_EQ(countPixels(pixels(color, {0, 1, 2, 1}), blue), 128u);
}

TEST_F(TargetTest, ResolvesSamples) {
    for (const uint32_t samples : {2u, 4u, 8u}) {
        const Texture::Flags flag = samples == 2   ? Texture::FlagMultisample2
                                    : samples == 4 ? Texture::FlagMultisample4
                                                   : Texture::FlagMultisample8;
        if (samples > device.getFeatures().maxTextureSamples) continue;
        if (!device.hasTexture(FormatRGBAu8n, Texture::FlagTarget | flag)) continue;
        SCOPED_TRACE(samples);
        const Texture color = makeTexture(FormatRGBAu8n, 16, 16, Texture::FlagTarget | flag);
        EXPECT_EQ(color.getSamples(), samples);
        const Texture depth = makeTexture(FormatDf32, 16, 16, Texture::FlagTarget | flag);
        const Texture resolved = makeTexture(FormatRGBAu8n, 16, 16);
        Target target = device.createTarget(color, depth);
        target.setColorResolve(0, resolved);
        const Pipeline pipeline = makePipeline(position_vertex, red_fragment, [&](Pipeline& p) {
            p.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 0, 0, 16);
            p.setMultisample(samples);
            p.setDepthFormat(FormatDf32);
            p.setDepthFunc(Pipeline::DepthFuncLess);
        });
        // A slanted edge, not along the diagonal of a pixel: it passes through 28 pixels, at ever other distances from
        // their centres. Devices place the samples where they like, so how many of the pixels get a part of them is
        // theirs; 2 samples near the centre, along the edge's direction, are the worst case.
        const std::array<float, 4> triangle[] = {{-1, -1, 0.5f, 1}, {1.3f, -1, 0.5f, 1}, {-1, 0.5f, 0.5f, 1}};
        Command list = device.createCommand(target);
        list.setPipeline(pipeline);
        list.setVertices(0, triangle);
        list.drawArrays(3);
        submit(list);
        const std::vector<Pixel> result = pixels(resolved);
        const size_t partial = result.size() - countPixels(result, red) - countPixels(result, black);
        EXPECT_GT(countPixels(result, red), 90u);
        EXPECT_GT(countPixels(result, black), 90u);
        EXPECT_GT(partial, 0u);
    }
}

TEST_F(TargetTest, AverageOfSamples) {
    const Texture color = makeTexture(FormatRGBAu8n, 4, 4, Texture::FlagTarget | Texture::FlagMultisample4);
    const Texture resolved = makeTexture(FormatRGBAu8n, 4, 4);
    Target target = device.createTarget(color);
    target.setColorResolve(0, resolved);
    target.setClearColor(Color{0.2f, 0.4f, 0.6f, 0.8f});
    target.setColorOperation(0, Target::BeginClear | Target::EndDiscard);
    pass(target);
    EXPECT_EQ(countPixels(pixels(resolved), {51, 102, 153, 204}), 16u);
}

TEST_F(TargetTest, FirstSampleOfDepthAndStencil) {
    for (const Format format : {FormatDf32, FormatDu24Su8, FormatDf32Su8}) {
        if (!device.hasTexture(format, Texture::FlagTarget | Texture::FlagMultisample4)) continue;
        SCOPED_TRACE(toString(format));
        const Texture color = makeTexture(FormatRGBAu8n, 8, 8, Texture::FlagTarget | Texture::FlagMultisample4);
        const Texture depth = makeTexture(format, 8, 8, Texture::FlagTarget | Texture::FlagMultisample4);
        const Texture first = makeTexture(format, 8, 8);
        const Texture resolved = makeTexture(FormatRGBAu8n, 8, 8);
        Target target = device.createTarget(color, depth);
        target.setDepthResolve(first);
        target.setClearDepth(0.75f, 3);
        Command list = device.createCommand(target);
        list.setPipeline(makePipeline(cover_vertex, red_fragment, [&](Pipeline& p) {
            p.setMultisample(4);
            p.setDepthFormat(format);
            p.setDepthFunc(Pipeline::DepthFuncLess);
        }));
        list.setScissor(0, 0, 4, 8);
        list.drawArrays(3);
        submit(list);
        // Drawn against it: what is not nearer than the resolved depth stays.
        Target next = device.createTarget(resolved, first);
        next.setDepthOperation(Target::BeginLoad | Target::EndStore);
        const bool has_stencil = formatInfo(format).stencil;
        Command second = device.createCommand(next);
        second.setPipeline(makePipeline(cover_vertex, red_fragment, [&](Pipeline& p) {
            p.setDepthFormat(format);
            p.setDepthFunc(Pipeline::DepthFuncLess);
            if (has_stencil)
                p.setStencilFunc(Pipeline::DepthFuncEqual, Pipeline::StencilOpKeep, Pipeline::StencilOpKeep,
                                 Pipeline::StencilOpKeep);
        }));
        second.setStencilRef(3);
        second.drawArrays(3);
        submit(second);
        const std::vector<Pixel> picture = pixels(resolved);
        for (uint32_t i = 0; i < 64; i++) EXPECT_EQ(picture[i], i % 8 < 4 ? black : red) << i;
    }
}

TEST_F(TargetTest, SmallestTextureBounds) {
    const Texture color = makeTexture(FormatRGBAu8n, 8, 8);
    const Texture depth = makeTexture(FormatDf32, 8, 8);
    Target target = device.createTarget(color, depth);
    EXPECT_EQ(target.getWidth(), 8u);
    target.setDepthTexture(Texture());
    EXPECT_EQ(target.getWidth(), 8u);
    target.setColorTexture(0, Texture());
    EXPECT_EQ(target.getWidth(), 0u);
}

TEST_F(TargetTest, ATargetIsReadByTheNextPass) {
    const Texture first = makeTexture(FormatRGBAu8n, 8, 8), second = makeTexture(FormatRGBAu8n, 8, 8);
    const Pipeline copy = makePipeline(cover_vertex, R"(
        layout(binding = 0) uniform sampler2D picture;
        layout(location = 0) out vec4 color;
        void main() { color = texelFetch(picture, ivec2(gl_FragCoord.xy), 0).bgra; })");
    Target target = device.createTarget(first);
    target.setClearColor(Color{1, 0, 0, 1});
    Command clear = device.createCommand(target);
    Command list = device.createCommand(device.createTarget(second));
    list.setPipeline(copy);
    list.setTexture(0, first);
    list.setSampler(0, device.createSampler());
    list.drawArrays(3);
    EXPECT_THAT(device.submit({clear, list}), IsOk());
    EXPECT_EQ(countPixels(pixels(second), blue), 64u);
}

}  // namespace glint::test
