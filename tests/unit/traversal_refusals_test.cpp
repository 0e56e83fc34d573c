// What cannot be joined into a kernel is refused by name: the shader, what it does, and the line where it has lines.

#include "support/matchers.h"

#include <glint/device/device.h>

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace glint::test {
namespace {

constexpr const char* generation = R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, std430) buffer Results { vec4 results[]; };
layout(location = 0) rayPayloadEXT vec4 payload;
void main() {
    payload = vec4(0.0);
    traceRayEXT(scene, 0u, 0xff, 0, 1, 0, vec3(gl_LaunchIDEXT), 0.0, vec3(0.0, 0.0, -1.0), 100.0, 0);
    results[gl_LaunchIDEXT.x] = payload;
}
)";

class TraversalRefusals : public testing::Test {
protected:
    void SetUp() override {
        device = Device::create({.api = "null",
                                 .tracing = TracingEngine::Software,
                                 .message = [this](const Message& message) { told = message.error.id(); }});
        ASSERT_THAT(device, IsOk());
    }

    /// Why a traversal with this shader cannot be created.
    Error refusal(const Shader& shader, const char* rays = generation) {
        EXPECT_THAT(shader, IsOk());
        Traversal traversal = device.createTraversal("refused");
        traversal.setRecursionDepth(recursion);
        traversal.setShader(Shader::createGLSL(Shader::TypeRayGen, rays, {}, "rays.shader"));
        traversal.setShader(shader);
        if (!traversal.getHitGroups()) traversal.addHitGroup();
        traversal.addHitRecord(0, 1u);
        const Status created = traversal.create();
        EXPECT_FALSE(created);
        EXPECT_EQ(told, created.error().id());
        return created.error();
    }
    void expectRefused(const Shader& shader, std::string_view title, std::string_view line, std::string_view what) {
        const Error error = refusal(shader);
        EXPECT_EQ(error.id(), "shader.traversal_unsupported") << error.text();
        EXPECT_EQ(error.code(), ErrorCode::Unsupported);
        EXPECT_EQ(error.object(), "refused");
        EXPECT_THAT(std::string(error.message()), testing::HasSubstr(std::string(title) + std::string(line) + ": "));
        EXPECT_THAT(std::string(error.message()), testing::HasSubstr(std::string(what)));
    }

    Device device;
    std::string told;
    uint32_t recursion = 1;
};

TEST_F(TraversalRefusals, EndsWhereALoopGoesOn) {
    // Found in a function, whose call is what cannot stand there.
    const Shader shader = Shader::createGLSL(Shader::TypeFirstHit, R"(layout(location = 0) rayPayloadInEXT vec4 payload;
bool judge() {
    if (gl_PrimitiveID > 3) ignoreIntersectionEXT;
    return true;
}
void main() {
    int i = 0;
    do {
        i++;
    } while (judge() && i < 3);
}
)",
                                             {}, "loops.shader");
    expectRefused(shader, "the FirstHit shader 'loops.shader'", ", loops.shader:10", "loop");
}

TEST_F(TraversalRefusals, ReportsInTheThirdPartOfALoop) {
    const Shader shader = Shader::createGLSL(Shader::TypeIntersection, R"(
void main() {
    float t = 1.0;
    for (int i = 0; i < 3; reportIntersectionEXT(t, 0u)) {
        t += 1.0;
        i++;
    }
}
)",
                                             {}, "third.shader");
    expectRefused(shader, "the Intersection shader 'third.shader'", ", third.shader:4", "loop");
}

TEST_F(TraversalRefusals, NamesTheIncludedFile) {
    Shader::setInclude("judging.h", R"(bool judge() {
    if (gl_PrimitiveID > 3) ignoreIntersectionEXT;
    return true;
}
void judgeAll() {
    for (int i = 0; i < 3; judge()) i++;
}
)");
    const Shader shader = Shader::createGLSL(
        Shader::TypeFirstHit, "#include \"judging.h\"\nvoid main() {\n    judgeAll();\n}\n", {}, "including.shader");
    expectRefused(shader, "the FirstHit shader 'including.shader'", ", judging.h:6", "loop");
    Shader::setInclude("judging.h", {});
}

TEST_F(TraversalRefusals, WritesToTheRecord) {
    // GLSL has no way to, and Khronos' rules for SPIR-V know none either.
    const Shader shader = Shader::createAssembly(Shader::TypeRayMiss, R"(
OpCapability RayTracingKHR
OpExtension "SPV_KHR_ray_tracing"
OpMemoryModel Logical GLSL450
OpEntryPoint MissKHR %main "main" %record
OpDecorate %Record Block
OpMemberDecorate %Record 0 Offset 0
%void = OpTypeVoid
%type = OpTypeFunction %void
%uint = OpTypeInt 32 0
%zero = OpConstant %uint 0
%Record = OpTypeStruct %uint
%block = OpTypePointer ShaderRecordBufferKHR %Record
%place = OpTypePointer ShaderRecordBufferKHR %uint
%record = OpVariable %block ShaderRecordBufferKHR
%main = OpFunction %void None %type
%begin = OpLabel
%value = OpAccessChain %place %record %zero
OpStore %value %zero
OpReturn
OpFunctionEnd
)",
                                                 "writing.spvasm");
    EXPECT_THAT(shader, HasErrorId("shader.validate"));
    EXPECT_EQ(shader.error().file(), "writing.spvasm");
    EXPECT_EQ(shader.error().line(), 19u);
    EXPECT_THAT(shader.error().message(), testing::HasSubstr("read only"));
}

TEST_F(TraversalRefusals, QueriesHeldThroughATrace) {
    const Shader shader = Shader::createGLSL(Shader::TypeClosest, R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(location = 0) rayPayloadInEXT vec4 payload;
layout(location = 1) rayPayloadEXT vec4 second;
void main() {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, 0u, 0xff, vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 1.0);
    while (rayQueryProceedEXT(query)) break;
    traceRayEXT(scene, 0u, 0xff, 0, 1, 0, vec3(0.0), 0.0, vec3(0.0, 0.0, -1.0), 100.0, 1);
    while (rayQueryProceedEXT(query)) payload += second;
}
)",
                                             {}, "held.shader");
    recursion = 2;
    expectRefused(shader, "the Closest shader 'held.shader'", ", held.shader:9", "'query', with which it goes on");
}

TEST_F(TraversalRefusals, ExtensionsOfOneVendor) {
    expectRefused(Shader::createGLSL(Shader::TypeFirstHit, R"(
#extension GL_NV_ray_tracing : require
layout(location = 0) rayPayloadInNV vec4 payload;
void main() {
    payload.x += 1.0;
    ignoreIntersectionNV();
}
)",
                                     {}, "vendor.shader"),
                  "the FirstHit shader 'vendor.shader'", "", "NVIDIA's own extensions of ray tracing");
    expectRefused(Shader::createGLSL(Shader::TypeRayMiss, R"(
#extension GL_NV_shader_sm_builtins : require
layout(location = 0) rayPayloadInEXT vec4 payload;
void main() { payload.x = float(gl_SMIDNV); }
)",
                                     {}, "processor.shader"),
                  "the RayMiss shader 'processor.shader'", "",
                  "built-in variable 5377 ('gl_SMIDNV') has no counterpart");
}

// What is about a whole shader has no line.
TEST_F(TraversalRefusals, NarrowWordsInRecords) {
    const Shader shader = Shader::createGLSL(Shader::TypeClosest, R"(
layout(shaderRecordEXT, std430) readonly buffer Record { uint16_t value; };
layout(location = 0) rayPayloadInEXT vec4 payload;
void main() { payload.x = float(value); }
)",
                                             {}, "narrow.shader");
    expectRefused(shader, "the Closest shader 'narrow.shader'", "", "16 bits");
}

TEST_F(TraversalRefusals, OtherModesThanThoseOfTheOthers) {
    const auto assembly = [](const char* capabilities, const char* model, const char* mode) {
        return std::string("OpCapability RayTracingKHR\n") + capabilities +
               "OpExtension \"SPV_KHR_ray_tracing\"\nOpMemoryModel Logical " + model +
               "\nOpEntryPoint MissKHR %main \"main\"\n" + mode +
               "%void = OpTypeVoid\n%type = OpTypeFunction %void\n%main = OpFunction %void None %type\n"
               "%begin = OpLabel\nOpReturn\nOpFunctionEnd\n";
    };
    expectRefused(Shader::createAssembly(
                      Shader::TypeRayMiss,
                      assembly("OpCapability DenormPreserve\n", "GLSL450", "OpExecutionMode %main DenormPreserve 32\n"),
                      "modes.spvasm"),
                  "the RayMiss shader 'modes.spvasm'", "", "execution mode");
    expectRefused(Shader::createAssembly(Shader::TypeRayMiss,
                                         assembly("OpCapability VulkanMemoryModel\n", "Vulkan", ""), "model.spvasm"),
                  "the RayMiss shader 'model.spvasm'", "", "memory model");
}

TEST_F(TraversalRefusals, SetsOfGlintsOwn) {
    const auto create = [&](const char* set) {
        Traversal traversal = device.createTraversal("refused");
        traversal.setShader(Shader::createGLSL(Shader::TypeRayGen, R"(
layout(set = SET, binding = 0, std430) writeonly buffer Results { uint results[]; };
void main() { results[gl_LaunchIDEXT.x] = 1u; }
)",
                                               std::string("SET=") + set));
        return traversal.create();
    };
    EXPECT_THAT(create("5"), IsOk());
    const Status created = create("6");
    EXPECT_THAT(created, HasErrorId("traversal.set"));
    EXPECT_THAT(created.error().message(), testing::HasSubstr("set 6"));
    EXPECT_THAT(created.error().message(), testing::HasSubstr("is 5"));
}

TEST_F(TraversalRefusals, TooManyWordsAndLevels) {
    const Error error =
        refusal(Shader::createGLSL(
                    Shader::TypeRayMiss,
                    "layout(location = 0) rayPayloadInEXT float payload[2000];\nvoid main() { payload[7] = 1.0; }\n",
                    {}, "much.shader"),
                R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(location = 0) rayPayloadEXT float payload[2000];
void main() {
    payload[3] = 1.0;
    traceRayEXT(scene, 0u, 0xff, 0, 1, 0, vec3(0.0), 0.0, vec3(0.0, 0.0, -1.0), 100.0, 0);
}
)");
    EXPECT_EQ(error.id(), "shader.traversal_size") << error.text();
    EXPECT_THAT(error.message(), testing::HasSubstr("1024 words"));
    EXPECT_THAT(error.message(), testing::HasSubstr("rays.shader"));
    Traversal traversal = device.createTraversal("refused");
    traversal.setShader(Shader::createGLSL(Shader::TypeRayGen, generation));
    traversal.setRecursionDepth(device.getFeatures().recursionDepth + 1);
    const Status created = traversal.create();
    EXPECT_THAT(created, HasErrorId("traversal.recursion"));
    EXPECT_EQ(created.error().code(), ErrorCode::Unsupported);
}

}  // namespace
}  // namespace glint::test
