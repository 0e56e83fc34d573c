#include "conformance/conformance.h"
#include "support/files.h"

#include <glint/base/file.h>

namespace glint::test {

namespace {

class PipelineTest : public ConformanceTest {
protected:
    /// Draws vertices of four floats each into 16 x 16 pixels.
    std::vector<Pixel> drawVertices(const Pipeline& pipeline, const std::vector<std::array<float, 4>>& vertices) {
        const Texture color = makeTexture(FormatRGBAu8n, 16, 16);
        draw(color, [&](Command& list) {
            list.setPipeline(pipeline);
            list.setVertices(0, std::span(vertices));
            list.drawArrays(static_cast<uint32_t>(vertices.size()));
        });
        return readTexture<Pixel>(color);
    }

    Pipeline positions(const std::function<void(Pipeline&)>& configure = {}) {
        return makePipeline(position_vertex, red_fragment, [&](Pipeline& pipeline) {
            pipeline.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 0, 0, 16);
            if (configure) configure(pipeline);
        });
    }
};

/// The left half of the target, as two triangles, counter-clockwise as seen.
const std::vector<std::array<float, 4>> left_half = {{-1, -1, 0, 1}, {0, -1, 0, 1}, {0, 1, 0, 1},
                                                     {-1, -1, 0, 1}, {0, 1, 0, 1},  {-1, 1, 0, 1}};

}  // namespace

TEST_F(PipelineTest, NullPipelineIsHarmless) {
    Pipeline pipeline;
    pipeline.addAttribute(Pipeline::AttributePosition, FormatRGBf32, 0, 0, 12);
    pipeline.setPrimitive(Pipeline::PrimitiveLine);
    pipeline.setFillMode(Pipeline::FillModeLine);
    pipeline.setCullMode(Pipeline::CullModeBack);
    pipeline.setFrontMode(Pipeline::FrontModeCW);
    pipeline.setDepthFunc(Pipeline::DepthFuncLess);
    pipeline.setDepthMask(true);
    pipeline.setDepthBias(1, 1);
    pipeline.setDepthClamp(true);
    pipeline.setStencilFunc(Pipeline::DepthFuncAlways, Pipeline::StencilOpKeep, Pipeline::StencilOpKeep,
                            Pipeline::StencilOpKeep);
    pipeline.setStencilMask(1, 1);
    pipeline.setBlend(Pipeline::BlendOpAdd, Pipeline::BlendFuncOne, Pipeline::BlendFuncOne);
    pipeline.setBlendColor(0, Pipeline::BlendOpAdd, Pipeline::BlendFuncOne, Pipeline::BlendFuncOne);
    pipeline.setBlendAlpha(0, Pipeline::BlendOpAdd, Pipeline::BlendFuncOne, Pipeline::BlendFuncOne);
    pipeline.setColorMask(0);
    pipeline.setColorFormat(FormatRGBAu8n);
    pipeline.setDepthFormat(FormatDf32);
    pipeline.setMultisample(4);
    pipeline.setAlphaToCoverage(true);
    pipeline.setUniformMask(0, Shader::MaskAll);
    EXPECT_THAT(pipeline.create(), HasErrorId("handle.null"));
}

TEST_F(PipelineTest, ClipSpaceIsUpAndRowsGoDown) {
    // The upper half in clip space is the upper half of the picture.
    const std::vector<Pixel> pixels = drawVertices(
        positions(), {{-1, 0, 0, 1}, {1, 0, 0, 1}, {1, 1, 0, 1}, {-1, 0, 0, 1}, {1, 1, 0, 1}, {-1, 1, 0, 1}});
    for (size_t y = 0; y < 16; y++)
        for (size_t x = 0; x < 16; x++) EXPECT_EQ(pixels[y * 16 + x], y < 8 ? red : black) << x << ", " << y;
}

TEST_F(PipelineTest, Primitives) {
    const auto with = [&](Pipeline::PrimitiveType primitive) {
        return positions([&](Pipeline& pipeline) { pipeline.setPrimitive(primitive); });
    };
    // Pixel (8, 7) has its centre at (1/16, 1/16) of clip space.
    const float c = 1.0f / 16;
    EXPECT_EQ(countPixels(drawVertices(with(Pipeline::PrimitivePoint), {{c, c, 0, 1}, {-c, c, 0, 1}}), red), 2u);
    EXPECT_EQ(drawVertices(with(Pipeline::PrimitivePoint), {{c, c, 0, 1}})[7 * 16 + 8], red);
    const std::vector<Pixel> line = drawVertices(with(Pipeline::PrimitiveLine), {{-1, c, 0, 1}, {1, c, 0, 1}});
    EXPECT_NEAR(static_cast<double>(countPixels(line, red)), 16, 1);
    EXPECT_EQ(line[7 * 16 + 5], red);
    const std::vector<Pixel> strip =
        drawVertices(with(Pipeline::PrimitiveLineStrip), {{-1, c, 0, 1}, {c, c, 0, 1}, {c, -1, 0, 1}});
    EXPECT_NEAR(static_cast<double>(countPixels(strip, red)), 17, 2);
    EXPECT_EQ(countPixels(drawVertices(with(Pipeline::PrimitiveTriangle), left_half), red), 128u);
    EXPECT_EQ(countPixels(drawVertices(with(Pipeline::PrimitiveTriangleStrip),
                                       {{-1, -1, 0, 1}, {0, -1, 0, 1}, {-1, 1, 0, 1}, {0, 1, 0, 1}}),
                          red),
              128u);
}

TEST_F(PipelineTest, CullingAndFrontFaces) {
    const auto drawn = [&](Pipeline::CullModeType cull, Pipeline::FrontModeType front) {
        return countPixels(drawVertices(positions([&](Pipeline& pipeline) {
                                            pipeline.setCullMode(cull);
                                            pipeline.setFrontMode(front);
                                        }),
                                        left_half),
                           red);
    };
    EXPECT_EQ(drawn(Pipeline::CullModeNone, Pipeline::FrontModeCCW), 128u);
    EXPECT_EQ(drawn(Pipeline::CullModeBack, Pipeline::FrontModeCCW), 128u);
    EXPECT_EQ(drawn(Pipeline::CullModeFront, Pipeline::FrontModeCCW), 0u);
    EXPECT_EQ(drawn(Pipeline::CullModeBack, Pipeline::FrontModeCW), 0u);
    EXPECT_EQ(drawn(Pipeline::CullModeFront, Pipeline::FrontModeCW), 128u);
}

TEST_F(PipelineTest, Wireframe) {
    GLINT_NEED_FEATURE(FeatureWireframe);
    const std::vector<Pixel> pixels =
        drawVertices(positions([](Pipeline& pipeline) { pipeline.setFillMode(Pipeline::FillModeLine); }), left_half);
    EXPECT_GT(countPixels(pixels, red), 20u);
    EXPECT_LT(countPixels(pixels, red), 80u);
}

TEST_F(PipelineTest, EveryAttributeType) {
    struct Vertex {
        float position[4];
        uint8_t normalised[4];
        uint16_t whole[2];
        int32_t negative[2];
    };
    const Vertex vertices[] = {{{-1, -1, 0, 1}, {255, 0, 128, 255}, {300, 2}, {-7, 3}},
                               {{3, -1, 0, 1}, {255, 0, 128, 255}, {300, 2}, {-7, 3}},
                               {{-1, 3, 0, 1}, {255, 0, 128, 255}, {300, 2}, {-7, 3}}};
    const Pipeline pipeline = makePipeline(R"(
        layout(location = 0) in vec4 position;
        layout(location = 1) in vec4 normalised;
        layout(location = 2) in uvec2 whole;
        layout(location = 3) in ivec2 negative;
        layout(location = 0) out vec4 value;
        void main() {
            gl_Position = position;
            value = vec4(normalised.rb, float(whole.x - 200u * whole.y + 128u) / 255.0, float(negative.x * negative.y + 100) / 255.0);
        })",
                                           R"(
        layout(location = 0) in vec4 value;
        layout(location = 0) out vec4 color;
        void main() { color = value; })",
                                           [](Pipeline& p) {
                                               p.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 0, 0, 32);
                                               p.addAttribute(Pipeline::AttributeColor, FormatRGBAu8n, 0, 16, 32);
                                               p.addAttribute(Pipeline::AttributeCustom, FormatRGu16, 0, 20, 32);
                                               p.addAttribute(Pipeline::AttributeCustom, FormatRGi32, 0, 24, 32);
                                           });
    const Texture color = makeTexture(FormatRGBAu8n, 4, 4);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setVertices(0, vertices);
        list.drawArrays(3);
    });
    const std::vector<Pixel> pixels = readTexture<Pixel>(color);
    EXPECT_EQ(pixels[5], (Pixel{255, 128, 28, 79}));
}

TEST_F(PipelineTest, AttributesNobodyReadsAreNotFetched) {
    const Pipeline pipeline = makePipeline(position_vertex, red_fragment, [](Pipeline& p) {
        p.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 0, 0, 16);
        p.addAttribute(Pipeline::AttributeNormal, FormatRGBf32, 0, 0, 16);
    });
    EXPECT_EQ(countPixels(drawVertices(pipeline, left_half), red), 128u);
}

TEST_F(PipelineTest, VertexBufferSlotsMayHaveGaps) {
    const Pipeline pipeline = makePipeline(position_vertex, red_fragment, [](Pipeline& p) {
        p.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 2, 0, 16);
    });
    const Texture color = makeTexture(FormatRGBAu8n, 16, 16);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setVertices(2, std::span(left_half));
        list.drawArrays(6);
    });
    EXPECT_EQ(countPixels(readTexture<Pixel>(color), red), 128u);
}

TEST_F(PipelineTest, EveryColourFormat) {
    int tested = 0;
    for (int i = FormatUnknown + 1; i < FormatCount; i++) {
        const auto format = static_cast<Format>(i);
        const FormatInfo& info = formatInfo(format);
        if (info.depth || !device.hasTexture(format, Texture::FlagTarget)) continue;
        SCOPED_TRACE(info.name);
        const char* type = info.type == FormatType::Int ? "ivec4" : info.type == FormatType::Uint ? "uvec4" : "vec4";
        const std::string fragment =
            std::string("layout(location = 0) out ") + type + " color;\nvoid main() { color = " + type + "(1); }";
        const Pipeline pipeline = makePipeline(cover_vertex, fragment, {}, format);
        const Texture drawn = makeTexture(format, 4, 4);
        const Texture cleared = makeTexture(format, 4, 4);
        device.clearTexture(cleared, Color{1, 1, 1, 1});
        draw(drawn, [&](Command& list) {
            list.setPipeline(pipeline);
            list.drawArrays(3);
        });
        EXPECT_EQ(readTexture<uint8_t>(drawn), readTexture<uint8_t>(cleared));
        tested++;
    }
    EXPECT_GE(tested, 15);
}

TEST_F(PipelineTest, EveryDepthFormat) {
    for (const Format format : {FormatDu16n, FormatDf32, FormatDu24Su8, FormatDf32Su8}) {
        if (!device.hasTexture(format, Texture::FlagTarget)) continue;
        SCOPED_TRACE(toString(format));
        const Pipeline pipeline = makePipeline(cover_vertex, red_fragment, [&](Pipeline& p) {
            p.setDepthFormat(format);
            p.setDepthFunc(Pipeline::DepthFuncLess);
        });
        const Texture color = makeTexture(FormatRGBAu8n, 8, 8);
        draw(
            color,
            [&](Command& list) {
                list.setPipeline(pipeline);
                list.drawArrays(3);
            },
            makeTexture(format, 8, 8));
        EXPECT_EQ(countPixels(readTexture<Pixel>(color), red), 64u);
    }
}

TEST_F(PipelineTest, MasksDeclareSlots) {
    const Pipeline pipeline = makePipeline(R"(
        layout(binding = 0) uniform Shift { vec4 shift; };
        void main() { gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, 0.5, 1.0) + shift; })",
                                           R"(
        layout(binding = 1) uniform Tint { vec4 tint; };
        layout(location = 0) out vec4 color;
        void main() { color = tint; })",
                                           [](Pipeline& p) {
                                               p.setUniformMask(0, Shader::MaskVertex);
                                               p.setUniformMask(1, Shader::MaskVertexFragment);
                                               p.setTextureMasks(0, 4, Shader::MaskFragment);
                                               p.setStorageMask(3, Shader::MaskAll);
                                               p.setSamplerMask(0, Shader::MaskFragment);
                                           });
    EXPECT_EQ(pipeline.getSlots(SlotKind::Uniform), 2u);
    EXPECT_EQ(pipeline.getSlots(SlotKind::Texture), 0u);
    const Texture color = makeTexture(FormatRGBAu8n, 4, 4);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setUniform(0, Color{0, 0, 0, 0});
        list.setUniform(1, Color{0, 0, 1, 1});
        list.drawArrays(3);
    });
    EXPECT_EQ(countPixels(readTexture<Pixel>(color), blue), 16u);
}

TEST_F(PipelineTest, BackgroundCreation) {
    Pipeline pipeline = device.createPipeline("background");
    pipeline.createShaderGLSL(Shader::TypeVertex, cover_vertex);
    pipeline.createShaderGLSL(Shader::TypeFragment, red_fragment);
    pipeline.setColorFormat(FormatRGBAu8n);
    pipeline.createAsync();
    const Texture color = makeTexture(FormatRGBAu8n, 4, 4);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.drawArrays(3);
    });
    EXPECT_EQ(countPixels(readTexture<Pixel>(color), red), 16u);
    EXPECT_THAT(pipeline.wait(), IsOk());
}

TEST_F(PipelineTest, SpecialisedStages) {
    const Pipeline pipeline = makePipeline(cover_vertex, R"(
        layout(constant_id = 0) const float GREEN = 0.0;
        layout(location = 0) out vec4 color;
        void main() { color = vec4(0.0, GREEN, 0.0, 1.0); })",
                                           [](Pipeline& p) { p.setConstant("GREEN", 1.0f); });
    const Texture color = makeTexture(FormatRGBAu8n, 4, 4);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.drawArrays(3);
    });
    EXPECT_EQ(countPixels(readTexture<Pixel>(color), green), 16u);
}

TEST_F(PipelineTest, GeometryShader) {
    GLINT_NEED_FEATURE(FeatureGeometryShader);
    const Pipeline pipeline =
        makePipeline("void main() { gl_Position = vec4(0.0, 0.0, 0.5, 1.0); }", red_fragment, [](Pipeline& p) {
            p.setPrimitive(Pipeline::PrimitivePoint);
            p.createShaderGLSL(Shader::TypeGeometry, R"(
            layout(points) in;
            layout(triangle_strip, max_vertices = 4) out;
            void main() {
                for (int i = 0; i < 4; i++) {
                    gl_Position = vec4(float(i & 1) * 2.0 - 1.0, float(i >> 1) * 2.0 - 1.0, 0.5, 1.0);
                    EmitVertex();
                }
                EndPrimitive();
            })");
        });
    const Texture color = makeTexture(FormatRGBAu8n, 4, 4);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.drawArrays(1);
    });
    EXPECT_EQ(countPixels(readTexture<Pixel>(color), red), 16u);
}

TEST_F(PipelineTest, Tessellation) {
    GLINT_NEED_FEATURE(FeatureTessellation);
    const Pipeline pipeline = makePipeline(
        "void main() { gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, 0.5, 1.0); }",
        red_fragment, [](Pipeline& p) {
            p.setPrimitive(Pipeline::PrimitivePatch);
            p.createShaderGLSL(Shader::TypeControl, R"(
                layout(vertices = 3) out;
                void main() {
                    gl_out[gl_InvocationID].gl_Position = gl_in[gl_InvocationID].gl_Position;
                    gl_TessLevelOuter[0] = gl_TessLevelOuter[1] = gl_TessLevelOuter[2] = gl_TessLevelInner[0] = 4.0;
                })");
            p.createShaderGLSL(Shader::TypeEvaluate, R"(
                layout(triangles, equal_spacing, ccw) in;
                void main() {
                    gl_Position = gl_TessCoord.x * gl_in[0].gl_Position + gl_TessCoord.y * gl_in[1].gl_Position +
                                  gl_TessCoord.z * gl_in[2].gl_Position;
                })");
        });
    const Texture color = makeTexture(FormatRGBAu8n, 8, 8);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.drawArrays(3);
    });
    EXPECT_EQ(countPixels(readTexture<Pixel>(color), red), 64u);
}

TEST_F(PipelineTest, ReloadFollowsTheFile) {
    const TempDir folder;
    const std::filesystem::path path = folder / "color.shader";
    const std::string blue_fragment =
        "layout(location = 0) out vec4 color;\nvoid main() { color = vec4(0.0, 0.0, 1.0, 1.0); }\n";
    ASSERT_THAT(writeTextFile(path, red_fragment), IsOk());
    Pipeline pipeline = device.createPipeline("reloaded");
    pipeline.createShaderGLSL(Shader::TypeVertex, cover_vertex);
    ASSERT_TRUE(pipeline.loadShaderGLSL(Shader::TypeFragment, path.string()));
    pipeline.setColorFormat(FormatRGBAu8n);
    ASSERT_THAT(pipeline.create(), IsOk());
    const Texture color = makeTexture(FormatRGBAu8n, 4, 4);
    const auto drawn = [&] {
        draw(color, [&](Command& list) {
            list.setPipeline(pipeline);
            list.drawArrays(3);
        });
        return readTexture<Pixel>(color)[0];
    };
    EXPECT_EQ(drawn(), red);
    ASSERT_THAT(writeTextFile(path, blue_fragment + "\n"), IsOk());
    bool changed = false;
    EXPECT_THAT(pipeline.reload(&changed), IsOk());
    EXPECT_TRUE(changed);
    EXPECT_EQ(drawn(), blue);
    // What the state forbids is refused, and the pipeline stays as it was.
    ASSERT_THAT(writeTextFile(path, "layout(location = 1) out vec4 color;\nvoid main() { color = vec4(1.0); }\n\n\n"),
                IsOk());
    expectError("pipeline.format", [&] { return pipeline.reload(&changed); });
    EXPECT_FALSE(changed);
    EXPECT_EQ(drawn(), blue);
}

TEST_F(PipelineTest, AlphaToCoverage) {
    const Texture color = makeTexture(FormatRGBAu8n, 4, 4, Texture::FlagTarget | Texture::FlagMultisample4);
    const Texture resolved = makeTexture(FormatRGBAu8n, 4, 4);
    Target target = device.createTarget(color);
    target.setColorResolve(0, resolved);
    const Pipeline pipeline = makePipeline(cover_vertex, push_fragment, [](Pipeline& p) {
        p.setMultisample(4);
        p.setAlphaToCoverage(true);
    });
    for (const float alpha : {0.0f, 0.5f, 1.0f}) {
        Command list = device.createCommand(target);
        list.setPipeline(pipeline);
        list.setPushConstants(Color{1, 0, 0, alpha});
        list.drawArrays(3);
        submit(list);
        EXPECT_NEAR(readTexture<Pixel>(resolved)[5][0], alpha * 255, 1) << alpha;
    }
}

}  // namespace glint::test
