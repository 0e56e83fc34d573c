// Shaders, kernels and pipelines.

#include "conformance/misuse.h"

namespace glint::test {

namespace {

constexpr const char* empty_kernel = "layout(local_size_x = 1) in;\nvoid main() {}";
constexpr const char* constant_kernel = R"(
layout(local_size_x_id = 7) in;
layout(constant_id = 0) const uint COUNT = 4u;
layout(constant_id = 1) const float SCALE = 1.0;
layout(constant_id = 2) const bool ENABLED = true;
layout(binding = 0) buffer Values { float value; };
void main() { if (ENABLED) value = SCALE * float(COUNT); }
)";

/// A pipeline of these shaders into an RGBAu8n target.
Error shaded(MisuseKit& kit, std::string_view vertex, std::string_view fragment,
             const std::function<void(Pipeline&)>& configure = {}) {
    Pipeline pipeline = kit.device.createPipeline("pipeline");
    pipeline.setColorFormat(FormatRGBAu8n);
    if (!vertex.empty()) pipeline.createShaderGLSL(Shader::TypeVertex, vertex);
    if (!fragment.empty()) pipeline.createShaderGLSL(Shader::TypeFragment, fragment);
    if (configure) configure(pipeline);
    return pipeline.create().error();
}

Error bareKernel(MisuseKit& kit, std::string_view text) {
    Kernel kernel = kit.bare.createKernel("kernel");
    kernel.createShaderGLSL(text);
    return kernel.create().error();
}

Error barePipeline(MisuseKit& kit, const std::function<void(Pipeline&)>& configure) {
    Pipeline pipeline = kit.bare.createPipeline("pipeline");
    pipeline.createShaderGLSL(Shader::TypeVertex, cover_vertex);
    pipeline.createShaderGLSL(Shader::TypeFragment, red_fragment);
    pipeline.setColorFormat(FormatRGBAu8n);
    configure(pipeline);
    return pipeline.create().error();
}

}  // namespace

MISUSE(KernelOfBrokenText, "shader.compile") {
    return kit.program("layout(local_size_x = 1) in;\nvoid main() { nonsense }");
}
MISUSE(KernelOfNoText, "shader.empty") { return kit.program(""); }
MISUSE(KernelOfMissingFile, "file.open") {
    Kernel kernel = kit.device.createKernel();
    kernel.loadShaderGLSL("no/such/file.shader");
    return kernel.create().error();
}
MISUSE(KernelOfNullShader, "handle.null") {
    Kernel kernel = kit.device.createKernel();
    kernel.setShader(Shader());
    return kernel.create().error();
}
MISUSE(KernelWithoutShader, "program.stage") { return kit.device.createKernel().create().error(); }
MISUSE(KernelOfAnotherStage, "program.stage") {
    Kernel kernel = kit.device.createKernel();
    kernel.setShader(Shader::createGLSL(Shader::TypeFragment, red_fragment));
    return kernel.create().error();
}
MISUSE(KernelCreatedTwice, "program.created") { return kit.kernel().create().error(); }
MISUSE(KernelWaitedForUncreated, "program.not_created") { return kit.device.createKernel().wait().error(); }
MISUSE(KernelReloadedUncreated, "program.not_created") { return kit.device.createKernel().reload().error(); }
MISUSE(ConstantOfUnknownId, "program.constant") {
    return kit.program(constant_kernel, [](Kernel& kernel) { kernel.setConstant(99, 1u); });
}
MISUSE(ConstantOfUnknownName, "program.constant") {
    return kit.program(constant_kernel, [](Kernel& kernel) { kernel.setConstant("COUNTER", 1u); });
}
MISUSE(ConstantFloatForUint, "program.constant_type") {
    return kit.program(constant_kernel, [](Kernel& kernel) { kernel.setConstant("COUNT", 1.0f); });
}
MISUSE(ConstantIntForFloat, "program.constant_type") {
    return kit.program(constant_kernel, [](Kernel& kernel) { kernel.setConstant("SCALE", 1); });
}
MISUSE(ConstantNegativeForUint, "program.constant_type") {
    return kit.program(constant_kernel, [](Kernel& kernel) { kernel.setConstant(0, -1); });
}
MISUSE(ConstantUintForBool, "program.constant_type") {
    return kit.program(constant_kernel, [](Kernel& kernel) { kernel.setConstant("ENABLED", 1u); });
}
MISUSE(GroupOfManyThreads, "kernel.group_size") {
    return kit.program("layout(local_size_x = 1024, local_size_y = 1024) in;\nvoid main() {}");
}
MISUSE(GroupOfManyThreadsByConstant, "kernel.group_size") {
    return kit.program(constant_kernel, [](Kernel& kernel) { kernel.setConstant(7, 1u << 20); });
}
MISUSE(GroupOfNoThreadsByConstant, "kernel.group_size") {
    return kit.program(constant_kernel, [](Kernel& kernel) { kernel.setConstant(7, 0u); });
}
MISUSE(SlotsDeclaredTooFew, "program.slots") {
    return kit.program(constant_kernel, [](Kernel& kernel) { kernel.setStorages(0); });
}
MISUSE(SlotsDeclaredTooMany, "program.slots") {
    return kit.program(constant_kernel, [](Kernel& kernel) { kernel.setUniforms(1u << 30); });
}
MISUSE(SlotsDeclaredBeyondCounting, "program.slots") {
    return kit.draws([](Pipeline& pipeline) { pipeline.setStorageMasks(UINT32_MAX, UINT32_MAX, Shader::MaskAll); });
}
MISUSE(SlotsOfAPipelineTooFew, "program.slots") {
    return shaded(kit, R"(
        layout(binding = 0) uniform A { vec4 a; };
        layout(binding = 1) uniform B { vec4 b; };
        void main() { gl_Position = a + b; })",
                  red_fragment, [](Pipeline& pipeline) { pipeline.setUniformMask(0, Shader::MaskVertex); });
}
MISUSE(MaskWithoutTheStage, "program.mask") {
    return shaded(kit, "layout(binding = 0) uniform A { vec4 a; };\nvoid main() { gl_Position = a; }", red_fragment,
                  [](Pipeline& pipeline) { pipeline.setUniformMask(0, Shader::MaskFragment); });
}
MISUSE(TableBesideOthers, "program.table") {
    return kit.program(R"(
        #extension GL_EXT_nonuniform_qualifier : require
        layout(local_size_x = 1) in;
        layout(binding = 0) uniform texture2D pictures[];
        layout(binding = 1) uniform sampler nearest;
        layout(binding = 2) buffer Values { vec4 value; uint index; };
        void main() { value = texelFetch(sampler2D(pictures[nonuniformEXT(index)], nearest), ivec2(0), 0); })");
}
MISUSE(TableOfCombinedTextures, "program.table") {
    return kit.program(R"(
        layout(local_size_x = 1) in;
        layout(set = 1, binding = 0) uniform sampler2D pictures[];
        layout(binding = 2) buffer Values { vec4 value; uint index; };
        void main() { value = texelFetch(pictures[index], ivec2(0), 0); })");
}
MISUSE(TableOfSurfaces, "program.table") {
    return kit.program(R"(
        layout(local_size_x = 1) in;
        layout(set = 1, binding = 0, rgba8) uniform image2D pictures[];
        layout(binding = 2) buffer Values { vec4 value; uint index; };
        void main() { value = imageLoad(pictures[index], ivec2(0)); })");
}
MISUSE(TableOfUniforms, "program.table") {
    return kit.program(R"(
        layout(local_size_x = 1) in;
        layout(set = 1, binding = 0) uniform Part { vec4 value; } parts[];
        layout(binding = 2) buffer Values { vec4 value; uint index; };
        void main() { value = parts[index].value; })");
}
MISUSE(TablesOfManySets, "program.table") {
    return kit.program(R"(
        layout(local_size_x = 1) in;
        layout(set = 0, binding = 0) uniform texture2D a[];
        layout(set = 1, binding = 0) uniform texture2D b[];
        layout(set = 2, binding = 0) uniform texture2D c[];
        layout(set = 3, binding = 0) uniform texture2D d[];
        layout(set = 4, binding = 0) uniform texture2D e[];
        void main() {})");
}
MISUSE(TwoTablesInOneSet, "program.table") {
    return kit.program(R"(
        layout(local_size_x = 1) in;
        layout(set = 0, binding = 0) uniform texture2D a[];
        layout(set = 0, binding = 1) uniform texture2D b[];
        void main() {})");
}
MISUSE(TableShaderWithoutFeature, "program.feature") {
    Kernel kernel = kit.bare.createKernel();
    kernel.createShaderGLSL("layout(local_size_x = 1) in; layout(binding = 0) uniform texture2D a[]; void main() {}");
    return kernel.create().error();
}
MISUSE(BufferTableShaderWithoutFeature, "program.feature") {
    Kernel kernel = kit.bare.createKernel();
    kernel.createShaderGLSL(
        "layout(local_size_x = 1) in; layout(binding = 0) buffer A { float value; } a[]; void main() {}");
    return kernel.create().error();
}
MISUSE(ArrayOfManyBuffers, "program.array") {
    return kit.program(R"(
        layout(local_size_x = 1) in;
        layout(binding = 0) buffer Values { float value; } values[5000];
        void main() { values[3].value = 1.0; })");
}
MISUSE(PushConstantsTooLarge, "program.push_size") {
    return kit.program(R"(
        layout(local_size_x = 1) in;
        layout(push_constant) uniform Push { vec4 pushed[1000]; };
        layout(binding = 0) buffer Values { vec4 value; };
        void main() { value = pushed[999]; })");
}
MISUSE(UniformBlockTooLarge, "program.uniform_size") {
    return kit.program(R"(
        layout(local_size_x = 1) in;
        layout(binding = 0) uniform Large { vec4 large[10000000]; };
        layout(binding = 1) buffer Values { vec4 value; };
        void main() { value = large[77]; })");
}
MISUSE(StagesDisagreeAboutABinding, "shader.binding_conflict") {
    return shaded(kit, "layout(binding = 0) uniform A { vec4 a; };\nvoid main() { gl_Position = a; }", R"(
        layout(binding = 0) uniform sampler2D picture;
        layout(location = 0) out vec4 color;
        void main() { color = texture(picture, vec2(0.5)); })");
}
MISUSE(DoublesWithoutFeature, "program.feature") {
    return bareKernel(
        kit, "layout(local_size_x = 1) in;\nlayout(binding = 0) buffer V { double v; };\nvoid main() { v = 1.0lf; }");
}
MISUSE(LongsWithoutFeature, "program.feature") {
    return bareKernel(
        kit, "layout(local_size_x = 1) in;\nlayout(binding = 0) buffer V { uint64_t v; };\nvoid main() { v = 1ul; }");
}
MISUSE(AddressesWithoutFeature, "program.feature") {
    return bareKernel(kit, R"(
        layout(local_size_x = 1) in;
        layout(buffer_reference) buffer Values { uint value; };
        layout(push_constant) uniform Push { Values values; };
        void main() { values.value = 1u; })");
}
MISUSE(ComputeTracingWithoutFeature, "program.feature") {
    return bareKernel(kit, R"(
        layout(local_size_x = 1) in;
        layout(binding = 0) uniform accelerationStructureEXT scene;
        layout(binding = 1) buffer Values { uint value; };
        void main() {
            rayQueryEXT query;
            rayQueryInitializeEXT(query, scene, 0, 0xff, vec3(0), 0.0, vec3(1), 1.0);
            rayQueryProceedEXT(query);
            value = rayQueryGetIntersectionTypeEXT(query, true);
        })");
}
MISUSE(FragmentTracingWithoutFeature, "program.feature") {
    return barePipeline(kit, [](Pipeline& pipeline) {
        pipeline.createShaderGLSL(Shader::TypeFragment, R"(
            layout(binding = 0) uniform accelerationStructureEXT scene;
            layout(location = 0) out vec4 color;
            void main() {
                rayQueryEXT query;
                rayQueryInitializeEXT(query, scene, 0, 0xff, vec3(0), 0.0, vec3(1), 1.0);
                rayQueryProceedEXT(query);
                color = vec4(rayQueryGetIntersectionTypeEXT(query, true));
            })");
    });
}
MISUSE(GeometryShaderWithoutFeature, "program.feature") {
    return barePipeline(kit, [](Pipeline& pipeline) {
        pipeline.createShaderGLSL(Shader::TypeGeometry, R"(
            layout(triangles) in;
            layout(triangle_strip, max_vertices = 3) out;
            void main() { gl_Position = gl_in[0].gl_Position; EmitVertex(); })");
    });
}
MISUSE(WireframeWithoutFeature, "program.feature") {
    return barePipeline(kit, [](Pipeline& pipeline) { pipeline.setFillMode(Pipeline::FillModeLine); });
}
MISUSE(DepthClampWithoutFeature, "program.feature") {
    return barePipeline(kit, [](Pipeline& pipeline) { pipeline.setDepthClamp(true); });
}

MISUSE(PipelineWithoutVertexShader, "program.stage") { return shaded(kit, "", red_fragment); }
MISUSE(PipelineWithoutFragmentShader, "program.stage") { return shaded(kit, cover_vertex, ""); }
MISUSE(PipelineOfAComputeShader, "program.stage") {
    return shaded(kit, cover_vertex, red_fragment,
                  [](Pipeline& pipeline) { pipeline.createShaderGLSL(Shader::TypeCompute, empty_kernel); });
}
MISUSE(PatchesWithoutTheirShaders, "program.stage") {
    return shaded(kit, cover_vertex, red_fragment,
                  [](Pipeline& pipeline) { pipeline.setPrimitive(Pipeline::PrimitivePatch); });
}
MISUSE(PipelineCreatedTwice, "program.created") { return kit.pipeline().create().error(); }
MISUSE(AttributeMissing, "pipeline.attribute") { return shaded(kit, position_vertex, red_fragment); }
MISUSE(AttributeOfAnotherType, "pipeline.attribute") {
    return shaded(kit, position_vertex, red_fragment, [](Pipeline& pipeline) {
        pipeline.addAttribute(Pipeline::AttributePosition, FormatRGBAu32, 0, 0, 16);
    });
}
MISUSE(AttributeOfAnotherSign, "pipeline.attribute") {
    return shaded(kit, "layout(location = 0) in ivec2 a;\nvoid main() { gl_Position = vec4(a, a); }", red_fragment,
                  [](Pipeline& pipeline) { pipeline.addAttribute(Pipeline::AttributeCustom, FormatRGu32, 0, 0, 8); });
}
MISUSE(AttributeOfBlocks, "pipeline.attribute") {
    return kit.draws([](Pipeline& p) { p.addAttribute(Pipeline::AttributeCustom, FormatBC1RGBAu8n, 0, 0, 16); });
}
MISUSE(AttributeOfNoFormat, "pipeline.attribute") {
    return kit.draws([](Pipeline& p) { p.addAttribute(Pipeline::AttributeCustom, FormatUnknown, 0, 0, 16); });
}
MISUSE(AttributeBeyondItsStride, "pipeline.attribute") {
    return kit.draws([](Pipeline& p) { p.addAttribute(Pipeline::AttributeCustom, FormatRGBAf32, 1, 4, 16); });
}
MISUSE(AttributeOfNoStride, "pipeline.attribute") {
    return kit.draws([](Pipeline& p) { p.addAttribute(Pipeline::AttributeCustom, FormatRGBAf32, 1, 0, 0); });
}
MISUSE(AttributeOfHugeStride, "pipeline.attribute") {
    return kit.draws([](Pipeline& p) { p.addAttribute(Pipeline::AttributeCustom, FormatRGBAf32, 1, 0, 1u << 20); });
}
MISUSE(AttributeMisaligned, "pipeline.attribute") {
    return kit.draws([](Pipeline& p) { p.addAttribute(Pipeline::AttributeCustom, FormatRGf32, 1, 2, 16); });
}
MISUSE(AttributeOfOddRate, "pipeline.attribute") {
    return kit.draws([](Pipeline& p) { p.addAttribute(Pipeline::AttributeCustom, FormatRGf32, 1, 0, 16, 2); });
}
MISUSE(AttributeOfUnknownBuffer, "pipeline.attribute") {
    return kit.draws([](Pipeline& p) { p.addAttribute(Pipeline::AttributeCustom, FormatRGf32, 16, 0, 16); });
}
MISUSE(AttributesTooMany, "pipeline.attribute") {
    return kit.draws([](Pipeline& pipeline) {
        for (int i = 0; i < 16; i++) pipeline.addAttribute(Pipeline::AttributeCustom, FormatRf32, 0, 0, 16);
    });
}
MISUSE(AttributesOfTwoStrides, "pipeline.attribute") {
    return kit.draws([](Pipeline& p) { p.addAttribute(Pipeline::AttributeCustom, FormatRf32, 0, 0, 20); });
}
MISUSE(PipelineWithoutFormats, "pipeline.format") {
    return shaded(kit, cover_vertex, "", [](Pipeline& pipeline) { pipeline.setColorFormat(FormatUnknown); });
}
MISUSE(DepthFormatAsColour, "pipeline.format") {
    return kit.draws([](Pipeline& p) { p.setColorFormat(FormatDf32); });
}
MISUSE(ColourFormatAsDepth, "pipeline.format") {
    return kit.draws([](Pipeline& p) { p.setDepthFormat(FormatRGBAu8n); });
}
MISUSE(BlocksAsColourFormat, "pipeline.format") {
    return kit.draws([](Pipeline& p) { p.setColorFormat(FormatBC1RGBAu8n); });
}
MISUSE(ImpossibleColourFormat, "pipeline.format") {
    return kit.draws([](Pipeline& p) { p.setColorFormat(static_cast<Format>(251)); });
}
MISUSE(OutputWithoutFormat, "pipeline.format") {
    return shaded(kit, cover_vertex, R"(
        layout(location = 0) out vec4 first;
        layout(location = 1) out vec4 second;
        void main() { first = second = vec4(1.0); })");
}
MISUSE(OutputOfAnotherType, "pipeline.format") {
    return shaded(kit, cover_vertex, red_fragment, [](Pipeline& p) { p.setColorFormat(FormatRGBAu8); });
}
MISUSE(FormatWithoutOutput, "pipeline.output") {
    return kit.draws([](Pipeline& p) { p.setColorFormat(FormatRGBAu8n, 1); });
}
MISUSE(BlendingOfIntegers, "pipeline.blend") {
    return shaded(kit, cover_vertex, "layout(location = 0) out uvec4 color;\nvoid main() { color = uvec4(1u); }",
                  [](Pipeline& pipeline) {
                      pipeline.setColorFormat(FormatRGBAu8);
                      pipeline.setBlend(Pipeline::BlendOpAdd, Pipeline::BlendFuncOne, Pipeline::BlendFuncOne);
                  });
}
MISUSE(DepthTestWithoutFormat, "pipeline.depth") {
    return kit.draws([](Pipeline& p) { p.setDepthFunc(Pipeline::DepthFuncLess); });
}
MISUSE(StencilTestWithoutStencil, "pipeline.stencil") {
    return kit.draws([](Pipeline& pipeline) {
        pipeline.setDepthFormat(FormatDf32);
        pipeline.setStencilFunc(Pipeline::DepthFuncAlways, Pipeline::StencilOpKeep, Pipeline::StencilOpKeep,
                                Pipeline::StencilOpKeep);
    });
}
MISUSE(ThreeSamples, "pipeline.samples") {
    return kit.draws([](Pipeline& p) { p.setMultisample(3); });
}
MISUSE(ManySamples, "pipeline.samples") {
    return kit.draws([](Pipeline& p) { p.setMultisample(64); });
}
MISUSE(FormatOfManyTargets, "pipeline.target") {
    return kit.draws([](Pipeline& p) { p.setColorFormat(FormatRGBAu8n, 1000); });
}
MISUSE(BlendOfManyTargets, "pipeline.target") {
    return kit.draws([](Pipeline& pipeline) {
        pipeline.setBlendColor(8, Pipeline::BlendOpAdd, Pipeline::BlendFuncOne, Pipeline::BlendFuncOne);
    });
}
MISUSE(MaskOfManyTargets, "pipeline.target") {
    return kit.draws([](Pipeline& p) { p.setColorMask(Pipeline::ColorMaskAll, 100); });
}
MISUSE(ImpossiblePrimitive, "pipeline.value") {
    return kit.draws([](Pipeline& p) { p.setPrimitive(static_cast<Pipeline::PrimitiveType>(77)); });
}
MISUSE(ImpossibleStencilOp, "pipeline.value") {
    return kit.draws([](Pipeline& pipeline) {
        pipeline.setStencilFunc(Pipeline::DepthFuncAlways, static_cast<Pipeline::StencilOp>(99),
                                Pipeline::StencilOpKeep, Pipeline::StencilOpKeep);
    });
}

}  // namespace glint::test
