// Drawing on devices that lack one feature each: what needs it is refused with its id, and everything else works.

#include "null_device.h"

#include <functional>

namespace glint::test {
namespace {

constexpr const char* vertex = "void main() { gl_Position = vec4(0.0, 0.0, 0.0, 1.0); }";
constexpr const char* fragment = R"(
    layout(location = 0) out vec4 color;
    void main() { color = vec4(1.0); })";

/// What a pipeline makes of these stages and this state.
Error piped(Device& device, std::initializer_list<std::pair<Shader::Type, const char*>> stages,
            const std::function<void(Pipeline&)>& configure = {}) {
    Pipeline pipeline = device.createPipeline("pipeline");
    for (const auto& [type, text] : stages) pipeline.createShaderGLSL(type, text);
    pipeline.createShaderGLSL(Shader::TypeFragment, fragment);
    pipeline.setColorFormat(FormatRGBAu8n);
    if (configure) configure(pipeline);
    return pipeline.create().error();
}

/// What a list in a target makes of it, submitted.
Error drawn(Device& device, const std::function<void(Command&, const Buffer&)>& record) {
    Pipeline pipeline = device.createPipeline("pipeline");
    pipeline.createShaderGLSL(Shader::TypeVertex, vertex);
    pipeline.createShaderGLSL(Shader::TypeFragment, fragment);
    pipeline.setColorFormat(FormatRGBAu8n);
    EXPECT_THAT(pipeline.create(), IsOk());
    const Buffer arguments = device.createBuffer(Buffer::FlagIndirect, 256, "arguments");
    Command list =
        device.createCommand(device.createTarget(device.createTexture2D(FormatRGBAu8n, 8, 8, Texture::FlagTarget)));
    list.setPipeline(pipeline);
    record(list, arguments);
    return device.submit(list).error();
}

struct Case {
    const char* name;
    FeatureMask feature;
    const char* id;
    std::function<Error(Device&)> use;
};

const std::vector<Case>& cases() {
    using S = Shader;
    constexpr const char* layered = "void main() { gl_Position = vec4(0.0); gl_Layer = 1; }";
    constexpr const char* viewported = "void main() { gl_Position = vec4(0.0); gl_ViewportIndex = 1; }";
    static const std::vector<Case> all = {
        {"mesh shader", FeatureMeshShader, "program.feature",
         [](Device& d) {
             return piped(d, {{S::TypeMesh, R"(
                 layout(local_size_x = 1) in;
                 layout(triangles, max_vertices = 3, max_primitives = 1) out;
                 void main() { SetMeshOutputsEXT(0, 0); })"}});
         }},
        {"geometry shader", FeatureGeometryShader, "program.feature",
         [](Device& d) {
             return piped(d, {{S::TypeVertex, vertex}, {S::TypeGeometry, R"(
                 layout(triangles) in;
                 layout(triangle_strip, max_vertices = 3) out;
                 void main() { gl_Position = vec4(0.0); EmitVertex(); })"}});
         }},
        {"tessellation", FeatureTessellation, "program.feature",
         [](Device& d) {
             return piped(d,
                          {{S::TypeVertex, vertex},
                           {S::TypeControl, R"(
                 layout(vertices = 3) out;
                 void main() { gl_TessLevelOuter[0] = 1.0; })"},
                           {S::TypeEvaluate, R"(
                 layout(triangles) in;
                 void main() { gl_Position = vec4(0.0); })"}},
                          [](Pipeline& p) { p.setPrimitive(Pipeline::PrimitivePatch); });
         }},
        {"layer of a vertex", FeatureVertexLayer, "program.feature",
         [=](Device& d) {
             return piped(d, {{S::TypeVertex, layered}});
         }},
        {"viewport of a vertex", FeatureVertexLayer, "program.feature",
         [=](Device& d) {
             return piped(d, {{S::TypeVertex, viewported}});
         }},
        {"lines", FeatureWireframe, "program.feature",
         [](Device& d) {
             return piped(d, {{S::TypeVertex, vertex}}, [](Pipeline& p) { p.setFillMode(Pipeline::FillModeLine); });
         }},
        {"depth clamp", FeatureDepthClamp, "program.feature",
         [](Device& d) {
             return piped(d, {{S::TypeVertex, vertex}}, [](Pipeline& p) { p.setDepthClamp(true); });
         }},
        {"texture table in a shader", FeatureTextureTable, "program.feature",
         [](Device& d) {
             return piped(d, {{S::TypeVertex, R"(
                 layout(set = 0, binding = 0) uniform texture2D textures[];
                 void main() { gl_Position = texelFetch(textures[0], ivec2(0), 0); })"}});
         }},
        {"buffer table in a shader", FeatureBufferTable, "program.feature",
         [](Device& d) {
             return piped(d, {{S::TypeVertex, R"(
                 layout(set = 0, binding = 0) readonly buffer Block { vec4 value; } blocks[];
                 void main() { gl_Position = blocks[0].value; })"}});
         }},
        {"texture table", FeatureTextureTable, "table.feature",
         [](Device& d) { return d.createTextureTable(4).error(); }},
        {"buffer table", FeatureBufferTable, "table.feature", [](Device& d) { return d.createBufferTable(4).error(); }},
        {"count", FeatureIndirectCount, "draw.count",
         [](Device& d) { return drawn(d, [](Command& c, const Buffer& b) { c.drawArraysIndirect(b, 0, b, 64, 1); }); }},
        {"several indirect draws", FeatureMultiDrawIndirect, "draw.multi",
         [](Device& d) { return drawn(d, [](Command& c, const Buffer& b) { c.drawArraysIndirect(b, 0, 2); }); }},
        {"viewports", FeatureMultiViewport, "draw.viewports",
         [](Device& d) {
             return drawn(d, [](Command& c, const Buffer&) {
                 c.setViewports({{.width = 8, .height = 8}, {.width = 8, .height = 8}});
                 c.drawArrays(3);
             });
         }},
        {"scissors", FeatureMultiViewport, "draw.scissors",
         [](Device& d) {
             return drawn(d, [](Command& c, const Buffer&) {
                 c.setScissors({{0, 0, 8, 8}, {0, 0, 8, 8}});
                 c.setViewports({{.width = 8, .height = 8}, {.width = 8, .height = 8}});
                 c.drawArrays(3);
             });
         }},
        {"cubes", FeatureCubeArray, "texture.feature",
         [](Device& d) {
             return d
                 .createTexture(
                     {.type = Texture::TypeCube, .format = FormatRGBAu8n, .width = 4, .height = 4, .layers = 2})
                 .error();
         }},
        {"blocks", FeatureTextureBC, "texture.format",
         [](Device& d) { return d.createTexture2D(FormatBC1RGBAu8n, 8, 8).error(); }},
        {"anisotropy", FeatureAnisotropy, "sampler.anisotropy",
         [](Device& d) { return d.createSampler({.anisotropy = 2}).error(); }},
        {"reduction", FeatureSamplerReduction, "sampler.reduction",
         [](Device& d) { return d.createSampler({.reduction = Sampler::ReductionMaximum}).error(); }},
        {"statistics", FeatureStatistics, "query.feature",
         [](Device& d) { return d.createQuery(Query::TypeStatistics).error(); }},
        {"time", FeatureTimestamps, "query.feature", [](Device& d) { return d.createQuery(Query::TypeTime).error(); }},
    };
    return all;
}

class NullFeatures : public NullDevice {
protected:
    /// Ids in the order of the cases; empty where it worked.
    void expectRefused(FeatureMask missing) {
        open({.missing = missing});
        ASSERT_TRUE(device);
        for (const Case& each : cases()) {
            SCOPED_TRACE(each.name);
            const bool is_refused = each.feature & missing;
            expected = is_refused ? each.id : std::string_view();
            told = 0;
            const Error error = each.use(device);
            EXPECT_EQ(error.id(), is_refused ? each.id : "") << error.text();
            EXPECT_EQ(told, is_refused ? 1 : 0);
            if (is_refused && each.id == std::string_view("program.feature")) {
                EXPECT_THAT(error.message(), testing::HasSubstr(toString(static_cast<Feature>(each.feature))));
            }
        }
        expected = {};
    }
};

TEST_F(NullFeatures, WithAllOfThemEverythingWorks) { expectRefused(0); }

TEST_F(NullFeatures, WithoutOneWhatNeedsItIsRefusedAndNothingElse) {
    FeatureMask tried = 0;
    for (const Case& each : cases()) {
        if (tried & each.feature) continue;
        tried |= each.feature;
        SCOPED_TRACE(toString(static_cast<Feature>(each.feature)));
        expectRefused(each.feature);
    }
}

TEST_F(NullFeatures, WithoutAnyEverythingIsRefused) { expectRefused(FeatureAll); }

TEST_F(NullFeatures, WithoutAnyMipLevelsAndPlainDrawsWork) {
    open({.missing = FeatureAll});
    ASSERT_TRUE(device);
    const Texture texture =
        device.createTexture2D(FormatRGBAu8n, 8, 8, Texture::FlagMipmaps | Texture::FlagTarget, "texture");
    ASSERT_TRUE(texture);
    device.createMipmaps(texture);
    EXPECT_THAT(drawn(device,
                      [](Command& c, const Buffer& b) {
                          c.drawArrays(3);
                          c.drawArraysIndirect(b);
                          c.setScissors({{0, 0, 4, 4}});
                          c.setViewports({{.width = 8, .height = 8}});
                          c.drawArrays(3);
                      }),
                IsOk());
}

}  // namespace
}  // namespace glint::test
