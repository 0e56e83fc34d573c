// Targets of several layers, and several viewports.

#include "conformance/conformance.h"

namespace glint::test {

namespace {

constexpr uint32_t size = 8;

/// Colours by layer or viewport, so that a picture says which one it is.
constexpr const char* number_fragment = R"(
layout(location = 0) flat in uint number;
layout(location = 0) out vec4 color;
void main() { color = vec4(float(number) * 10.0 / 255.0, 0.0, 0.0, 1.0); }
)";
/// Instance i covers layer i, or viewport i.
constexpr const char* instance_vertex = R"(
layout(location = 0) flat out uint number;
void main() {
    gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, 0.5, 1.0);
    number = gl_InstanceIndex + 1;
    NUMBER = gl_InstanceIndex;
})";
constexpr const char* all_geometry = R"(
layout(triangles) in;
layout(triangle_strip, max_vertices = 18) out;
layout(location = 0) flat out uint number;
void main() {
    for (uint l = 0u; l < 6u; l++) {
        for (int i = 0; i < 3; i++) {
            gl_Position = gl_in[i].gl_Position;
            NUMBER = int(l);
            number = l + 1u;
            EmitVertex();
        }
        EndPrimitive();
    }
})";
constexpr const char* all_mesh = R"(
layout(local_size_x = 6) in;
layout(triangles, max_vertices = 18, max_primitives = 6) out;
layout(location = 0) flat out uint number[];
void main() {
    SetMeshOutputsEXT(18, 6);
    uint l = gl_LocalInvocationIndex;
    for (uint i = 0u; i < 3u; i++) {
        gl_MeshVerticesEXT[3u * l + i].gl_Position = vec4(vec2(i & 1u, i >> 1u) * 4.0 - 1.0, 0.5, 1.0);
        number[3u * l + i] = l + 1u;
    }
    gl_PrimitiveTriangleIndicesEXT[l] = 3u * l + uvec3(0, 1, 2);
    gl_MeshPrimitivesEXT[l].NUMBER = int(l);
})";

enum class By : uint8_t { Vertex, Geometry, Mesh };

class LayersTest : public ConformanceTest, public ::testing::WithParamInterface<By> {
protected:
    void SetUp() override {
        ConformanceTest::SetUp();
        const By by = GetParam();
        GLINT_NEED_FEATURE(by == By::Vertex     ? FeatureVertexLayer
                           : by == By::Geometry ? FeatureGeometryShader
                                                : FeatureMeshShader);
    }

    /// Draws to six layers, or in six viewports.
    Pipeline numbered(const char* variable, const std::function<void(Pipeline&)>& configure = {}) {
        const std::string macro = std::string("NUMBER=") + variable;
        Pipeline pipeline = device.createPipeline("numbered");
        if (GetParam() == By::Mesh) {
            pipeline.createShaderGLSL(Shader::TypeMesh, all_mesh, macro);
        } else if (GetParam() == By::Geometry) {
            pipeline.createShaderGLSL(Shader::TypeVertex, cover_vertex);
            pipeline.createShaderGLSL(Shader::TypeGeometry, all_geometry, macro);
        } else {
            pipeline.createShaderGLSL(Shader::TypeVertex, instance_vertex, macro);
        }
        pipeline.createShaderGLSL(Shader::TypeFragment, number_fragment);
        pipeline.setColorFormat(FormatRGBAu8n);
        if (configure) configure(pipeline);
        EXPECT_THAT(pipeline.create(), IsOk());
        return pipeline;
    }
    void drawAll(Command& list) {
        switch (GetParam()) {
            case By::Vertex: return list.drawArraysInstanced(3, 0, 6);
            case By::Geometry: return list.drawArrays(3);
            case By::Mesh: return list.drawMesh(1);
        }
    }
    static Pixel numberColor(uint32_t number) { return {static_cast<uint8_t>(number * 10), 0, 0, 255}; }
};

}  // namespace

TEST_P(LayersTest, EveryFaceOfACube) {
    const Texture cube =
        device.createTextureCube(FormatRGBAu8n, size, Texture::FlagTarget | Texture::FlagMipmaps, "cube");
    ASSERT_TRUE(cube) << cube.error().text();
    const Pipeline pipeline = numbered("gl_Layer");
    for (const uint16_t mip : {uint16_t(0), uint16_t(1)}) {
        Target target = device.createTarget();
        target.setColorTexture(0, cube, {.mip = mip, .mips = 1});
        Command list = device.createCommand(target);
        list.setPipeline(pipeline);
        list.setScissor(0, 0, size / 4, size);
        drawAll(list);
        submit(list);
        for (uint16_t face = 0; face < 6; face++) {
            const std::vector<Pixel> picture = readTexture<Pixel>(cube, {mip, 1, face, 1});
            const uint32_t height = size >> mip;
            EXPECT_EQ(countPixels(picture, numberColor(face + 1u)), size / 4 * height) << mip << ", " << face;
            EXPECT_EQ(countPixels(picture, black), picture.size() - size / 4 * height) << mip << ", " << face;
        }
    }
}

TEST_P(LayersTest, LayersCountFromTheSlice) {
    const Texture layers = device.createTexture(
        {.format = FormatRGBAu8n, .width = size, .height = size, .layers = 9, .flags = Texture::FlagTarget}, "layers");
    device.clearTexture(layers, Color{0, 0, 1, 1});
    Target target = device.createTarget();
    target.setColorTexture(0, layers, {.mip = 0, .mips = 1, .layer = 2, .layers = 6});
    Command list = device.createCommand(target);
    list.setPipeline(numbered("gl_Layer"));
    drawAll(list);
    submit(list);
    for (uint16_t layer = 0; layer < 9; layer++) {
        const bool drawn = layer >= 2 && layer < 8;
        EXPECT_EQ(countPixels(readTexture<Pixel>(layers, {0, 1, layer, 1}), drawn ? numberColor(layer - 1u) : blue),
                  size * size)
            << layer;
    }
}

TEST_P(LayersTest, DepthHasLayersToo) {
    const TextureDesc desc = {.width = size, .height = size, .layers = 6, .flags = Texture::FlagTarget};
    TextureDesc color_desc = desc, depth_desc = desc;
    color_desc.format = FormatRGBAu8n;
    depth_desc.format = FormatDf32;
    const Texture color = device.createTexture(color_desc, "color"), depth = device.createTexture(depth_desc, "depth");
    // The draws are at 0.5: layers whose depth is less stay as they are.
    for (uint16_t layer = 0; layer < 6; layer++)
        device.clearTexture(depth, Color{layer % 2 ? 0.25f : 0.75f, 0, 0, 0}, {0, 1, layer, 1});
    Target target = device.createTarget(color, depth);
    target.setDepthOperation(Target::BeginLoad | Target::EndStore);
    Command list = device.createCommand(target);
    list.setPipeline(numbered("gl_Layer", [](Pipeline& pipeline) {
        pipeline.setDepthFormat(FormatDf32);
        pipeline.setDepthFunc(Pipeline::DepthFuncLess);
    }));
    drawAll(list);
    submit(list);
    for (uint16_t layer = 0; layer < 6; layer++) {
        EXPECT_EQ(countPixels(readTexture<Pixel>(color, {0, 1, layer, 1}), layer % 2 ? black : numberColor(layer + 1u)),
                  size * size)
            << layer;
        EXPECT_EQ(readTexture<float>(depth, {0, 1, layer, 1})[0], layer % 2 ? 0.25f : 0.5f) << layer;
    }
}

TEST_P(LayersTest, SamplesAreResolvedInEveryLayer) {
    TextureDesc desc = {.format = FormatRGBAu8n,
                        .width = size,
                        .height = size,
                        .layers = 6,
                        .flags = Texture::FlagTarget | Texture::FlagMultisample4};
    const Texture samples = device.createTexture(desc, "samples");
    desc.flags = Texture::FlagTarget;
    const Texture resolved = device.createTexture(desc, "resolved");
    Target target = device.createTarget(samples);
    target.setColorResolve(0, resolved);
    Command list = device.createCommand(target);
    list.setPipeline(numbered("gl_Layer", [](Pipeline& pipeline) { pipeline.setMultisample(4); }));
    drawAll(list);
    submit(list);
    for (uint16_t layer = 0; layer < 6; layer++)
        EXPECT_EQ(countPixels(readTexture<Pixel>(resolved, {0, 1, layer, 1}), numberColor(layer + 1u)), size * size)
            << layer;
}

TEST_P(LayersTest, ViewportsByIndex) {
    GLINT_NEED_FEATURE(FeatureMultiViewport);
    const Texture color = makeTexture(FormatRGBAu8n, 24, 8);
    const Pipeline pipeline = numbered("gl_ViewportIndex");
    std::vector<Viewport> viewports;
    for (uint32_t i = 0; i < 6; i++)
        viewports.push_back({.x = 4.0f * static_cast<float>(i), .y = 2, .width = 4, .height = 6});
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setViewports(viewports);
        list.setScissor(1, 0, 24, 7);
        drawAll(list);
    });
    const std::vector<Pixel> picture = readTexture<Pixel>(color);
    for (uint32_t y = 0; y < 8; y++)
        for (uint32_t x = 0; x < 24; x++)
            EXPECT_EQ(picture[y * 24 + x], x >= 1 && y >= 2 && y < 7 ? numberColor(x / 4 + 1) : black)
                << x << ", " << y;
}

TEST_P(LayersTest, AScissorForEachViewport) {
    GLINT_NEED_FEATURE(FeatureMultiViewport);
    const Texture color = makeTexture(FormatRGBAu8n, 24, 8);
    const Pipeline pipeline = numbered("gl_ViewportIndex");
    std::vector<Viewport> viewports(6, {.width = 24, .height = 8});
    std::vector<Scissor> scissors;
    for (int32_t i = 0; i < 6; i++) scissors.push_back({4 * i - 2, i - 2, 4, 6});
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setScissors(scissors);
        list.setViewports(viewports);
        drawAll(list);
    });
    const std::vector<Pixel> picture = readTexture<Pixel>(color);
    for (int32_t y = 0; y < 8; y++)
        for (int32_t x = 0; x < 24; x++) {
            const int32_t i = (x + 2) / 4;
            const bool inside = i < 6 && y >= i - 2 && y < i + 4;
            EXPECT_EQ(picture[static_cast<size_t>(y * 24 + x)],
                      inside ? numberColor(static_cast<uint32_t>(i) + 1) : black)
                << x << ", " << y;
        }
}

TEST_P(LayersTest, OneViewportAgainAfterSeveral) {
    GLINT_NEED_FEATURE(FeatureMultiViewport);
    const Texture color = makeTexture(FormatRGBAu8n, size, size);
    const Pipeline cover = makePipeline(cover_vertex, red_fragment);
    draw(color, [&](Command& list) {
        list.setPipeline(cover);
        list.setViewports({{.width = 2, .height = 2}, {.x = 4, .y = 4, .width = 2, .height = 2}});
        list.drawArrays(3);
        list.setScissors({{0, 0, 1, 1}, {0, 0, 1, 1}});
        list.setViewport(6, 6, 2, 2);
        list.setScissor(0, 0, size, size);
        list.drawArrays(3);
    });
    const std::vector<Pixel> picture = readTexture<Pixel>(color);
    EXPECT_EQ(countPixels(picture, red), 8u);
    EXPECT_EQ(picture[0], red);
    EXPECT_EQ(picture[63], red);
}

INSTANTIATE_TEST_SUITE_P(Stages, LayersTest, ::testing::Values(By::Vertex, By::Geometry, By::Mesh),
                         [](const auto& stage) {
                             return stage.param == By::Vertex     ? std::string("Vertex")
                                    : stage.param == By::Geometry ? std::string("Geometry")
                                                                  : std::string("Mesh");
                         });

}  // namespace glint::test
