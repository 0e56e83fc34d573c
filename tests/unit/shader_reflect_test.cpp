#include "shader_test.h"

#include <cstring>

using namespace glint;
using namespace glint::test;

namespace {

class ShaderReflect : public ShaderTest {
protected:
    static Reflection of(std::string_view text, ShaderStage stage = ShaderStage::Compute,
                         std::string_view macros = {}) {
        const Expected<CompiledShader> result = compileShader(glsl(text, stage, macros));
        EXPECT_THAT(result, IsOk()) << text;
        return result ? result->reflection : Reflection();
    }
};

const std::string end = "layout(local_size_x = 1) in;\nvoid main() {}\n";

}  // namespace

TEST_F(ShaderReflect, EveryKindIsRead) {
    const Reflection reflection = of("layout(set = 3, binding = 0) uniform U { vec4 a; float b; } u;\n"
                                     "layout(set = 0, binding = 1) buffer S { uint n; vec3 values[]; };\n"
                                     "layout(set = 0, binding = 0) uniform texture2D t;\n"
                                     "layout(set = 0, binding = 2, rgba8) uniform image2D i;\n"
                                     "layout(set = 0, binding = 3) uniform sampler s;\n"
                                     "layout(set = 0, binding = 4) uniform accelerationStructureEXT a;\n"
                                     "layout(set = 0, binding = 5) uniform textureBuffer tb;\n"
                                     "layout(set = 0, binding = 6, r32ui) uniform uimageBuffer ib;\n"
                                     "layout(set = 0, binding = 7) uniform samplerBuffer sb;\n"
                                     "layout(set = 1, binding = 0) uniform texture2D table[];\n"
                                     "layout(set = 1, binding = 1) buffer T { float x; } blocks[];\n"
                                     "layout(set = 2, binding = 9) uniform sampler2D c;\n" +
                                     end);
    struct Row {
        SlotKind kind;
        const char* name;
        uint32_t set, binding, count;
    };
    const Row rows[] = {
        {SlotKind::Texture, "t", 0, 0, 1}, {SlotKind::Storage, "S", 0, 1, 1}, {SlotKind::Surface, "i", 0, 2, 1},
        {SlotKind::Sampler, "s", 0, 3, 1}, {SlotKind::Tracing, "a", 0, 4, 1}, {SlotKind::Texel, "tb", 0, 5, 1},
        {SlotKind::Texel, "ib", 0, 6, 1},  {SlotKind::Texel, "sb", 0, 7, 1},  {SlotKind::Table, "table", 1, 0, 0},
        {SlotKind::Table, "T", 1, 1, 0},   {SlotKind::Texture, "c", 2, 9, 1}, {SlotKind::Uniform, "U", 3, 0, 1},
    };
    ASSERT_EQ(reflection.resources.size(), std::size(rows));
    for (size_t i = 0; i < std::size(rows); i++) {
        const ShaderResource& resource = reflection.resources[i];
        EXPECT_EQ(resource.kind, rows[i].kind) << rows[i].name << " is " << toString(resource.kind);
        EXPECT_EQ(resource.name, rows[i].name);
        EXPECT_EQ(resource.set, rows[i].set) << rows[i].name;
        EXPECT_EQ(resource.binding, rows[i].binding) << rows[i].name;
        EXPECT_EQ(resource.count, rows[i].count) << rows[i].name;
        EXPECT_EQ(resource.stages, stageBit(ShaderStage::Compute));
        EXPECT_EQ(resource.combined, resource.name == "c") << rows[i].name;
        EXPECT_EQ(resource.texel_storage, resource.name == "ib") << rows[i].name;
    }
    EXPECT_EQ(find(reflection, "table")->element, SlotKind::Texture);
    EXPECT_EQ(find(reflection, "T")->element, SlotKind::Storage);
    EXPECT_EQ(find(reflection, "T")->instance, "blocks");
    EXPECT_EQ(find(reflection, "U")->element, SlotKind::Uniform);
    EXPECT_EQ(find(reflection, "U")->instance, "u");
    EXPECT_EQ(find(reflection, "S")->instance, "");
}

TEST_F(ShaderReflect, MeshesAndTheirPayload) {
    const std::string payload = "struct Payload { uint first; vec3 box[2]; };\ntaskPayloadSharedEXT Payload payload;\n";
    const Reflection mesh = of("layout(local_size_x = 32) in;\n"
                               "layout(triangles, max_vertices = 96, max_primitives = 64) out;\n" +
                                   payload + "void main() { SetMeshOutputsEXT(payload.first, 0); }\n",
                               ShaderStage::Mesh);
    EXPECT_EQ(mesh.mesh_vertices, 96u);
    EXPECT_EQ(mesh.mesh_primitives, 64u);
    EXPECT_EQ(mesh.payload_size, 28u);
    EXPECT_EQ(mesh.group_size, (std::array<uint32_t, 3>{32, 1, 1}));
    const Reflection task = of("layout(local_size_x = 4) in;\n" + payload +
                                   "void main() { payload.first = 1; EmitMeshTasksEXT(1, 1, 1); }\n",
                               ShaderStage::Task);
    EXPECT_EQ(task.payload_size, 28u);
    EXPECT_EQ(task.mesh_vertices + task.mesh_primitives, 0u);
}

TEST_F(ShaderReflect, LayersOfVertices) {
    EXPECT_TRUE(of("void main() { gl_Position = vec4(0.0); gl_Layer = 1; }", ShaderStage::Vertex).uses_layer);
    EXPECT_TRUE(of("void main() { gl_Position = vec4(0.0); gl_ViewportIndex = 1; }", ShaderStage::Vertex).uses_layer);
    EXPECT_FALSE(of("void main() { gl_Position = vec4(0.0); }", ShaderStage::Vertex).uses_layer);
}

TEST_F(ShaderReflect, SizesOfBlocks) {
    const Reflection reflection = of("layout(set = 0, binding = 0) uniform A { vec4 a; float b; };\n"
                                     "layout(set = 0, binding = 1) buffer B { float values[]; };\n"
                                     "layout(set = 0, binding = 2) buffer C { uint n; vec3 c[]; };\n"
                                     "layout(set = 0, binding = 3, scalar) buffer D { uint m; vec3 d[]; };\n"
                                     "layout(set = 0, binding = 4) buffer E { float e[][4]; };\n"
                                     "struct Item { vec3 position; float weight; mat4 transform; };\n"
                                     "layout(set = 0, binding = 5) buffer F { Item items[3]; float last; };\n"
                                     "layout(set = 0, binding = 6) uniform G { float g[3]; };\n" +
                                     end);
    const auto expect = [&](const char* name, uint32_t size, uint32_t stride) {
        ASSERT_NE(find(reflection, name), nullptr) << name;
        EXPECT_EQ(find(reflection, name)->size, size) << name;
        EXPECT_EQ(find(reflection, name)->stride, stride) << name;
    };
    expect("A", 20, 0);
    expect("B", 0, 4);
    expect("C", 16, 16);
    expect("D", 4, 12);
    expect("E", 0, 16);
    expect("F", 3 * 80 + 4, 0);
    expect("G", 48, 0);
}

TEST_F(ShaderReflect, ArraysCountTheirElements) {
    const Reflection reflection = of("layout(set = 0, binding = 0) uniform A { float a; } a[4];\n"
                                     "layout(set = 0, binding = 1) uniform texture2D b[3];\n"
                                     "layout(constant_id = 7) const uint count = 6;\n"
                                     "layout(set = 0, binding = 3) uniform sampler d[count];\n" +
                                     end);
    EXPECT_EQ(find(reflection, "A")->count, 4u);
    EXPECT_EQ(find(reflection, "b")->count, 3u);
    EXPECT_EQ(find(reflection, "d")->count, 6u);

    // Whatever a stage does with it, a declaration without length means a table.
    for (const char* use : {"", "v = texelFetch(t[0], ivec2(0), 0);", "v = texelFetch(t[int(v.x)], ivec2(0), 0);"}) {
        const Reflection table = of("layout(set = 0, binding = 0) uniform texture2D t[];\n"
                                    "layout(set = 0, binding = 1) buffer B { vec4 v; };\n"
                                    "void main() { " +
                                    std::string(use) + " }\n");
        EXPECT_EQ(table.resources.at(0).kind, SlotKind::Table) << use;
        EXPECT_EQ(table.resources.at(0).count, 0u) << use;
    }
}

TEST_F(ShaderReflect, AccessIsReadOffTheQualifiers) {
    const Reflection reflection = of("layout(set = 0, binding = 0) buffer A { float a; };\n"
                                     "layout(set = 0, binding = 1) readonly buffer B { float b; };\n"
                                     "layout(set = 0, binding = 2) writeonly buffer C { float c; };\n"
                                     "layout(set = 0, binding = 3, r32f) uniform image2D d;\n"
                                     "layout(set = 0, binding = 4) uniform readonly image2D e;\n"
                                     "layout(set = 0, binding = 5) uniform writeonly image2D f;\n"
                                     "layout(set = 0, binding = 6) uniform G { float g; };\n"
                                     "layout(set = 0, binding = 7) uniform texture2D h;\n"
                                     "layout(set = 0, binding = 8, r32f) uniform readonly imageBuffer i;\n"
                                     "layout(set = 0, binding = 9) readonly buffer J { float j; } j[];\n" +
                                     end);
    const auto expect = [&](const char* name, bool read, bool write) {
        ASSERT_NE(find(reflection, name), nullptr) << name;
        EXPECT_EQ(find(reflection, name)->read, read) << name;
        EXPECT_EQ(find(reflection, name)->write, write) << name;
    };
    expect("A", true, true);
    expect("B", true, false);
    expect("C", false, true);
    expect("d", true, true);
    expect("e", true, false);
    expect("f", false, true);
    expect("G", true, false);
    expect("h", true, false);
    expect("i", true, false);
    expect("J", true, false);
}

TEST_F(ShaderReflect, MatricesThatDoNotFit) {
    const Reflection reflection = of("struct Inner { mat4 m; };\n"
                                     "layout(set = 0, binding = 0) uniform A { mat4 a; };\n"
                                     "layout(set = 0, binding = 1) uniform B { layout(row_major) mat4 b; };\n"
                                     "layout(set = 0, binding = 2) uniform C { mat4 c; float d; };\n"
                                     "layout(set = 0, binding = 3) uniform D { mat4 e[2]; };\n"
                                     "layout(set = 0, binding = 4) uniform E { vec4 f; };\n"
                                     "layout(set = 0, binding = 5) buffer F { mat4 g; };\n"
                                     "layout(set = 0, binding = 6, row_major) uniform G { vec4 h; Inner inner[2]; };\n"
                                     "layout(buffer_reference) buffer Node;\n"
                                     "layout(buffer_reference) buffer Node { Node next; mat4 n; };\n"
                                     "layout(set = 0, binding = 7) uniform H { Node node; };\n" +
                                     end);
    const auto expect = [&](const char* name, bool lone, bool row_major) {
        ASSERT_NE(find(reflection, name), nullptr) << name;
        EXPECT_EQ(find(reflection, name)->has_lone_matrix, lone) << name;
        EXPECT_EQ(find(reflection, name)->has_row_major, row_major) << name;
    };
    expect("A", true, false);
    expect("B", false, true);
    expect("C", false, false);
    expect("D", false, false);
    expect("E", false, false);
    expect("F", false, false);
    expect("G", false, true);
    expect("H", false, false);
}

TEST_F(ShaderReflect, DimensionsOfImages) {
    const Reflection reflection = of("layout(set = 0, binding = 0) uniform texture2D a;\n"
                                     "layout(set = 0, binding = 1) uniform texture3D b;\n"
                                     "layout(set = 0, binding = 2) uniform textureCube c;\n"
                                     "layout(set = 0, binding = 3) uniform texture2DArray d;\n"
                                     "layout(set = 0, binding = 4) uniform textureCubeArray e;\n"
                                     "layout(set = 0, binding = 5) uniform texture2DMS f;\n"
                                     "layout(set = 0, binding = 6, r32f) uniform image3D g;\n"
                                     "layout(set = 0, binding = 7) uniform sampler2DShadow h;\n"
                                     "layout(set = 0, binding = 8) uniform utexture2D i;\n" +
                                     end);
    const ImageDimension expected[] = {
        ImageDimension::Image2D,      ImageDimension::Image3D,   ImageDimension::Cube,
        ImageDimension::Image2DArray, ImageDimension::CubeArray, ImageDimension::Image2DMultisample,
        ImageDimension::Image3D,      ImageDimension::Image2D,   ImageDimension::Image2D};
    ASSERT_EQ(reflection.resources.size(), std::size(expected));
    for (size_t i = 0; i < std::size(expected); i++)
        EXPECT_EQ(reflection.resources[i].dimension, expected[i]) << reflection.resources[i].name;
}

TEST_F(ShaderReflect, WhatGlintHasNoPlaceForIsRefused) {
    for (const char* declaration : {"layout(set = 0, binding = 0) uniform texture1D t;\n",
                                    "layout(set = 0, binding = 0) uniform texture2DMSArray t;\n",
                                    "layout(set = 0, binding = 0) uniform texture1DArray t;\n"})
        EXPECT_THAT(compileShader(glsl(declaration + end)), HasErrorId("shader.reflect")) << declaration;
    const Expected<CompiledShader> subpass =
        compileShader(glsl("layout(input_attachment_index = 0, set = 0, binding = 0) uniform subpassInput s;\n"
                           "layout(location = 0) out vec4 o;\nvoid main() { o = subpassLoad(s); }\n",
                           ShaderStage::Fragment, "A=1"));
    ASSERT_THAT(subpass, HasErrorId("shader.reflect"));
    EXPECT_EQ(subpass.error().file(), "test.shader");
    EXPECT_EQ(subpass.error().context(), "A=1");
}

TEST_F(ShaderReflect, SpecializationConstants) {
    const Reflection reflection = of("layout(constant_id = 3) const float scale = 1.5;\n"
                                     "layout(constant_id = 0) const bool on = true;\n"
                                     "layout(constant_id = 1) const int minus = -2;\n"
                                     "layout(constant_id = 2) const uint count = 7;\n"
                                     "layout(constant_id = 9) const double wide = 2.0;\n"
                                     "layout(set = 0, binding = 0) buffer B { float b; };\n"
                                     "void main() { b = on ? scale * minus : float(count) * float(wide); }\n");
    ASSERT_EQ(reflection.constants.size(), 4u);
    using Type = SpecializationConstant::Type;
    const auto expect = [&](uint32_t id, const char* name, Type type, uint32_t value) {
        EXPECT_EQ(reflection.constants[id].id, id);
        EXPECT_EQ(reflection.constants[id].name, name);
        EXPECT_EQ(reflection.constants[id].type, type);
        EXPECT_EQ(reflection.constants[id].default_value, value);
    };
    expect(0, "on", Type::Bool, 1);
    expect(1, "minus", Type::Int, 0xfffffffeu);
    expect(2, "count", Type::Uint, 7);
    expect(3, "scale", Type::Float, 0x3fc00000u);
}

TEST_F(ShaderReflect, GroupSizes) {
    const auto none = Reflection::no_constant;
    Reflection reflection = of("layout(local_size_x = 8, local_size_y = 4) in;\nvoid main() {}\n");
    EXPECT_EQ(reflection.group_size, (std::array<uint32_t, 3>{8, 4, 1}));
    EXPECT_EQ(reflection.group_constants, (std::array<uint32_t, 3>{none, none, none}));

    reflection = of("layout(local_size_x = 8, local_size_y = 16, local_size_y_id = 5) in;\n"
                    "layout(constant_id = 5) const uint rows = 16;\nvoid main() {}\n");
    EXPECT_EQ(reflection.group_size, (std::array<uint32_t, 3>{8, 16, 1}));
    EXPECT_EQ(reflection.group_constants, (std::array<uint32_t, 3>{none, 5, none}));
    ASSERT_EQ(reflection.constants.size(), 1u);
    EXPECT_EQ(reflection.constants[0].name, "rows");

    reflection = of("layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;\n"
                    "layout(set = 0, binding = 0) buffer B { uvec3 b; };\nvoid main() { b = gl_WorkGroupSize; }\n");
    EXPECT_EQ(reflection.group_size, (std::array<uint32_t, 3>{1, 1, 1}));
    EXPECT_EQ(reflection.group_constants, (std::array<uint32_t, 3>{0, 1, 2}));

    reflection = of("layout(local_size_x = 32) in; layout(triangles, max_vertices = 3, max_primitives = 1) out;"
                    "void main() { SetMeshOutputsEXT(0, 0); }",
                    ShaderStage::Mesh);
    EXPECT_EQ(reflection.group_size[0], 32u);
    reflection = of("void main() {}\n", ShaderStage::Vertex);
    EXPECT_EQ(reflection.group_size, (std::array<uint32_t, 3>{1, 1, 1}));
}

TEST_F(ShaderReflect, PushConstants) {
    EXPECT_EQ(of(end).push_size, 0u);
    EXPECT_EQ(of("layout(push_constant) uniform P { mat4 a; uint b; };\n" + end).push_size, 68u);
    EXPECT_EQ(of("layout(push_constant) uniform P { layout(offset = 32) vec2 a; };\n" + end).push_size, 40u);
}

TEST_F(ShaderReflect, InputsAndOutputs) {
    const Reflection vertex = of("layout(location = 3) in uvec2 c;\n"
                                 "layout(location = 0) in vec3 a;\n"
                                 "layout(location = 1) in int b;\n"
                                 "layout(location = 4) in mat4x3 m;\n"
                                 "layout(location = 8) in float d[2];\n"
                                 "void main() { gl_Position = vec4(a, b + c.x + gl_VertexIndex) + m[0].x + d[1]; }\n",
                                 ShaderStage::Vertex);
    ASSERT_EQ(vertex.inputs.size(), 9u);
    using Type = ShaderVariable::Type;
    const auto expect = [](const ShaderVariable& variable, uint32_t location, const char* name, Type type,
                           uint32_t components) {
        EXPECT_EQ(variable.location, location);
        EXPECT_EQ(variable.name, name);
        EXPECT_EQ(variable.type, type);
        EXPECT_EQ(variable.components, components);
    };
    expect(vertex.inputs[0], 0, "a", Type::Float, 3);
    expect(vertex.inputs[1], 1, "b", Type::Int, 1);
    expect(vertex.inputs[2], 3, "c", Type::Uint, 2);
    for (uint32_t i = 0; i < 4; i++) expect(vertex.inputs[3 + i], 4 + i, "m", Type::Float, 3);
    for (uint32_t i = 0; i < 2; i++) expect(vertex.inputs[7 + i], 8 + i, "d", Type::Float, 1);
    EXPECT_TRUE(vertex.outputs.empty());

    const Reflection fragment = of("layout(location = 0) in vec3 a;\n"
                                   "layout(location = 1) out vec4 second;\nlayout(location = 0) out ivec2 first;\n"
                                   "void main() { first = ivec2(a.xy); second = vec4(a, 1); gl_FragDepth = a.z; }\n",
                                   ShaderStage::Fragment);
    ASSERT_EQ(fragment.outputs.size(), 2u);
    expect(fragment.outputs[0], 0, "first", Type::Int, 2);
    expect(fragment.outputs[1], 1, "second", Type::Float, 4);
    EXPECT_TRUE(fragment.inputs.empty());
}

TEST_F(ShaderReflect, UsesOfFeatures) {
    const Reflection none = of(end);
    EXPECT_FALSE(none.uses_ray_query || none.uses_addresses || none.uses_float64 || none.uses_int64 ||
                 none.uses_subgroups);
    EXPECT_TRUE(of("layout(set = 0, binding = 0) uniform accelerationStructureEXT a;\n"
                   "void main() { rayQueryEXT q; rayQueryInitializeEXT(q, a, 0, 255, vec3(0), 0.0, vec3(1), 1.0); }\n")
                    .uses_ray_query);
    EXPECT_TRUE(of("layout(set = 0, binding = 0) uniform accelerationStructureEXT a;\n" + end).uses_ray_query);
    EXPECT_TRUE(of("layout(buffer_reference) buffer P { float x; };\n"
                   "layout(push_constant) uniform C { P p; };\nvoid main() { p.x = 1.0; }\n")
                    .uses_addresses);
    EXPECT_TRUE(of("layout(set = 0, binding = 0) buffer B { double d; };\nvoid main() { d = 1.0; }\n").uses_float64);
    EXPECT_TRUE(of("layout(set = 0, binding = 0) buffer B { int64_t l; };\nvoid main() { l = 1; }\n").uses_int64);
    EXPECT_TRUE(of("layout(set = 0, binding = 0) buffer B { float f; };\nvoid main() { f = subgroupAdd(f); }\n")
                    .uses_subgroups);
}

TEST_F(ShaderReflect, RayVariables) {
    using Kind = RayVariable::Kind;
    const Reflection sender = of("layout(binding = 0) uniform accelerationStructureEXT scene;\n"
                                 "struct Part { vec3 a; bool b; };\n"
                                 "struct Data { Part parts[2]; mat2x3 c; };\n"
                                 "layout(location = 4) rayPayloadEXT Data data;\n"
                                 "layout(location = 1) callableDataEXT uvec2 call;\n"
                                 "layout(location = 2) rayPayloadEXT uint unused;\n"
                                 "void main() {\n"
                                 "    traceRayEXT(scene, 0u, 0xff, 0, 0, 2, vec3(0.0), 0.0, vec3(1.0), 1.0, 4);\n"
                                 "    executeCallableEXT(gl_LaunchIDEXT.x, 1);\n"
                                 "}\n",
                                 ShaderStage::RayGen);
    EXPECT_FALSE(sender.uses_ray_query);
    EXPECT_EQ(sender.record_size, 0u);
    ASSERT_EQ(sender.ray_calls.size(), 2u);
    for (const RayCall& call : sender.ray_calls) EXPECT_EQ(call.record, call.is_callable ? RayCall::unknown : 2u);
    ASSERT_EQ(sender.ray_variables.size(), 2u);
    for (const RayVariable& variable : sender.ray_variables) {
        const bool is_data = variable.name == "data";
        EXPECT_EQ(variable.kind, is_data ? Kind::Payload : Kind::Callable);
        EXPECT_EQ(variable.size, is_data ? 2 * 16u + 24u : 8u);
    }

    const Reflection receiver = of("layout(shaderRecordEXT, std430) readonly buffer Record { uint a; vec4 b; };\n"
                                   "layout(location = 0) rayPayloadInEXT double payload;\n"
                                   "hitAttributeEXT vec2 barycentrics;\n"
                                   "void main() { payload = double(barycentrics.x + b.x); }\n",
                                   ShaderStage::Closest);
    EXPECT_EQ(receiver.record_size, 32u);
    ASSERT_EQ(receiver.ray_variables.size(), 2u);
    for (const RayVariable& variable : receiver.ray_variables)
        EXPECT_EQ(variable.kind, variable.name == "payload" ? Kind::IncomingPayload : Kind::Attribute);
    EXPECT_EQ(receiver.ray_variables[0].size, 8u);
    EXPECT_EQ(receiver.ray_variables[1].size, 8u);
    EXPECT_EQ(
        of("layout(location = 3) callableDataInEXT vec4 data;\nvoid main() { data.x = 1.0; }\n", ShaderStage::Callable)
            .ray_variables.at(0)
            .kind,
        Kind::IncomingCallable);
}

TEST_F(ShaderReflect, ChoosesAmongEntryPoints) {
    const std::string text = "OpCapability Shader\nOpMemoryModel Logical GLSL450\n"
                             "OpEntryPoint GLCompute %a \"first\"\nOpEntryPoint GLCompute %b \"second\"\n"
                             "OpEntryPoint Fragment %c \"first\"\nOpExecutionMode %c OriginUpperLeft\n"
                             "OpExecutionMode %a LocalSize 2 1 1\nOpExecutionMode %b LocalSize 3 1 1\n"
                             "%void = OpTypeVoid\n%fn = OpTypeFunction %void\n"
                             "%a = OpFunction %void None %fn\n%la = OpLabel\nOpReturn\nOpFunctionEnd\n"
                             "%b = OpFunction %void None %fn\n%lb = OpLabel\nOpReturn\nOpFunctionEnd\n"
                             "%c = OpFunction %void None %fn\n%lc = OpLabel\nOpReturn\nOpFunctionEnd\n";
    ShaderSource source = assembly(text);
    const Expected<std::vector<uint32_t>> words = shader::assemble(source);
    ASSERT_THAT(words, IsOk());
    ASSERT_THAT(reflect(*words), IsOk());
    EXPECT_EQ(reflect(*words)->group_size[0], 2u);
    ASSERT_THAT(reflect(*words, "second"), IsOk());
    EXPECT_EQ(reflect(*words, "second")->group_size[0], 3u);
    EXPECT_THAT(reflect(*words, "third"), HasErrorId("shader.reflect"));
    source.entry = "first";
    source.stage = ShaderStage::Fragment;
    const Expected<CompiledShader> fragment = compileShader(source);
    ASSERT_THAT(fragment, IsOk());
    EXPECT_EQ(fragment->reflection.stage, ShaderStage::Fragment);
    EXPECT_EQ(fragment->reflection.entry, "first");
}
