// Stages of a pipeline joined into one compute shader: what comes out is valid and can be rewritten for the software
// engine, and what cannot be carried over is refused by name. What joined shaders compute is tested by
// traversal_join_gpu_test.cpp.

#include "shader_test.h"

#include <glint/shader/traversal_joiner.h>

#include <spirv/unified1/spirv.hpp>

#include <deque>

namespace glint::test {

namespace {

using shader::TraversalSource;
using Words = std::vector<uint32_t>;

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
constexpr const char* closest = R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, std430) buffer Other { float values[]; };
layout(location = 0) rayPayloadInEXT vec4 payload;
void main() {
    values[3] = gl_HitTEXT;
    traceRayEXT(scene, 0u, 0xff, 0, 1, 0, gl_WorldRayOriginEXT, 0.0, vec3(0.0, 1.0, 0.0), 100.0, 0);
}
)";

class TraversalJoinText : public ShaderTest {
protected:
    struct Part {
        ShaderStage stage = ShaderStage::RayGen;
        std::string_view text;
    };

    /// Joins stages as they come out of the compiler: one group for each table.
    Expected<Words> join(std::initializer_list<Part> parts, uint32_t depth = 2, bool optimized = false) {
        TraversalSource source;
        source.name = "test";
        source.recursion_depth = depth;
        for (const Part& part : parts) {
            const ShaderSource text = glsl(part.text, part.stage);
            const bool is_assembly = part.text.find("OpEntryPoint") != part.text.npos;
            const Expected<shader::Preprocessed> preprocessed = shader::preprocess(text);
            if (!preprocessed) return unexpected(preprocessed.error());
            Expected<Words> words = is_assembly ? shader::assemble(text) : shader::compile(text, *preprocessed);
            if (words && optimized) words = shader::optimize(text, *words);
            if (!words) return unexpected(words.error());
            words_.push_back(std::move(*words));
            const auto index = static_cast<uint32_t>(source.stages.size());
            source.stages.push_back({.stage = part.stage, .name = text.name, .words = words_.back()});
            addTo(source, part.stage, index);
        }
        return shader::joinTraversal(source);
    }

    static void addTo(TraversalSource& source, ShaderStage stage, uint32_t index) {
        const bool is_general =
            stage == ShaderStage::RayGen || stage == ShaderStage::RayMiss || stage == ShaderStage::Callable;
        auto& groups = source.groups[stage == ShaderStage::RayGen     ? TraversalSource::Generation
                                     : stage == ShaderStage::RayMiss  ? TraversalSource::Miss
                                     : stage == ShaderStage::Callable ? TraversalSource::Callable
                                                                      : TraversalSource::Hit];
        if (is_general || groups.empty()) groups.emplace_back();
        TraversalSource::Group& group = groups.back();
        (stage == ShaderStage::Closest        ? group.closest
         : stage == ShaderStage::FirstHit     ? group.first_hit
         : stage == ShaderStage::Intersection ? group.intersection
                                              : group.general) = index;
    }

    Error refusal(std::initializer_list<Part> parts, uint32_t depth = 2) {
        const Expected<Words> joined = join(parts, depth);
        EXPECT_FALSE(joined);
        return joined ? Error() : joined.error();
    }

private:
    std::deque<Words> words_;
};

constexpr const char* writing_miss = R"(
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
)";

std::string incoming(std::string_view declarations, std::string_view body) {
    return std::string(declarations) + "layout(location = 0) rayPayloadInEXT vec4 payload;\nvoid main() { " +
           std::string(body) + " }\n";
}

}  // namespace

TEST_F(TraversalJoinText, RewritesForTheSoftwareEngine) {
    for (const bool optimized : {false, true}) {
        const Expected<Words> joined =
            join({{ShaderStage::RayGen, generation}, {ShaderStage::Closest, closest}}, 2, optimized);
        ASSERT_THAT(joined, IsOk());
        EXPECT_EQ(countInstructions(*joined, spv::OpCapability, spv::CapabilityRayTracingKHR, 1), 0u);
        EXPECT_EQ(countInstructions(*joined, spv::OpTraceRayKHR), 0u);
        // However many traces there are, and however deep: one search.
        EXPECT_EQ(countInstructions(*joined, spv::OpRayQueryInitializeKHR), 1u);
        EXPECT_EQ(countInstructions(*joined, spv::OpRayQueryProceedKHR), 1u);

        ShaderSource source = binary(*joined);
        source.tracing.library = "glint/tracing/query.h";
        source.tracing.set = 8;
        Expected<Reflection> reflection = reflect(*joined);
        ASSERT_THAT(reflection, IsOk());
        const Expected<Words> rewritten = shader::rewriteRayQueries(source, *joined, *reflection);
        ASSERT_THAT(rewritten, IsOk());
        EXPECT_EQ(countInstructions(*rewritten, spv::OpTypeRayQueryKHR), 0u);
        if (optimized) { EXPECT_THAT(shader::optimize(source, *rewritten), IsOk()); }
    }
}

TEST_F(TraversalJoinText, ResourcesKeepTheirPlacesAndMayShareThem) {
    const Expected<Words> joined = join({{ShaderStage::RayGen, generation}, {ShaderStage::Closest, closest}});
    ASSERT_THAT(joined, IsOk());
    const Expected<Reflection> reflection = reflect(*joined);
    ASSERT_THAT(reflection, IsOk());
    for (const char* name : {"Results", "Other"}) {
        const ShaderResource* const resource = find(*reflection, name);
        ASSERT_TRUE(resource) << name;
        EXPECT_EQ(resource->set, 0u);
        EXPECT_EQ(resource->binding, 1u);
    }
    // Else a compiler may believe that they are not the same memory.
    EXPECT_EQ(countInstructions(*joined, spv::OpDecorate, spv::DecorationAliased), 2u);
    EXPECT_EQ(reflection->group_size, (std::array<uint32_t, 3>{8, 8, 1}));
}

TEST_F(TraversalJoinText, WhatCannotBeCarriedOverIsNamed) {
    const Part rays = {ShaderStage::RayGen, generation};
    // GLSL has no way to write to a record.
    Error error = refusal({rays, {ShaderStage::RayMiss, writing_miss}});
    EXPECT_EQ(error.id(), "shader.traversal_unsupported");
    EXPECT_NE(error.message().find("writes to its shaderRecordEXT block"), std::string::npos) << error.text();
    EXPECT_NE(error.message().find("test.shader"), std::string::npos) << error.text();

    const std::string narrow = incoming("layout(shaderRecordEXT, std430) readonly buffer Record { uint16_t value; };\n",
                                        "payload.x = float(value);");
    error = refusal({rays, {ShaderStage::Closest, narrow}});
    EXPECT_EQ(error.id(), "shader.traversal_unsupported");
    EXPECT_NE(error.message().find("16 bits"), std::string::npos) << error.text();

    const std::string loop = incoming("bool judge() { if (gl_PrimitiveID > 3) ignoreIntersectionEXT; return true; }\n",
                                      "int i = 0; do { i++; } while (judge() && i < 3);");
    error = refusal({rays, {ShaderStage::FirstHit, loop}});
    EXPECT_EQ(error.id(), "shader.traversal_unsupported");
    EXPECT_NE(error.message().find("loop"), std::string::npos) << error.text();

    const std::string big =
        "layout(location = 0) rayPayloadInEXT float payload[2000];\nvoid main() { payload[7] = 1.0; }\n";
    error = refusal({rays, {ShaderStage::RayMiss, big}});
    EXPECT_EQ(error.id(), "shader.traversal_size");
    EXPECT_NE(error.message().find("1024 words"), std::string::npos) << error.text();

    const std::string keeping =
        "layout(binding = 0) uniform accelerationStructureEXT scene;\n"
        "layout(location = 0) rayPayloadEXT vec4 inner;\nlayout(location = 1) rayPayloadInEXT vec4 payload;\n"
        "float kept[300];\n"
        "void main() {\n"
        "    for (int i = 0; i < 300; i++) kept[i] = payload.x * float(i);\n"
        "    traceRayEXT(scene, 0u, 0xff, 0, 1, 0, vec3(0.0), 0.0, vec3(0.0, 1.0, 0.0), 100.0, 0);\n"
        "    payload = vec4(kept[int(inner.x)]);\n}\n";
    error = refusal({rays, {ShaderStage::Closest, keeping}}, 31);
    EXPECT_EQ(error.id(), "shader.traversal_size");
    EXPECT_EQ(error.code(), ErrorCode::Unsupported);
    EXPECT_NE(error.message().find("recursion depth 31"), std::string::npos) << error.text();
    EXPECT_NE(error.message().find("8192"), std::string::npos) << error.text();
    EXPECT_THAT(join({rays, {ShaderStage::Closest, keeping}}, 20), IsOk());
}

TEST_F(TraversalJoinText, KindsOfPayloadsAndConstants) {
    const std::string rays = R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
struct Inner { bool flag; mat2x3 matrix; };
struct Data { int64_t wide; float16_t half_float; Inner inner[2]; i16vec2 pair; uint8_t small; uvec4 last; };
layout(location = 0) rayPayloadEXT Data data;
void main() { traceRayEXT(scene, 0u, 0xff, 0, 1, 0, vec3(0.0), 0.0, vec3(0.0, 0.0, -1.0), 100.0, 0); }
)";
    const std::string miss = R"(
struct Inner { bool flag; mat2x3 matrix; };
struct Data { int64_t wide; float16_t half_float; Inner inner[2]; i16vec2 pair; uint8_t small; uvec4 last; };
layout(location = 0) rayPayloadInEXT Data data;
layout(push_constant, std430) uniform Push { layout(offset = 16) mat3 turn; layout(row_major) mat2x4 rows; double wide; };
layout(constant_id = 3) const int count = 4;
float table[count];
void main() {
    table[count - 1] = turn[1].y + rows[1].w;
    data.inner[1].matrix[1][2] += table[3] + float(wide);
    data.inner[0].flag = !data.inner[1].flag;
    data.pair = data.pair.yx;
}
)";
    EXPECT_THAT(join({{ShaderStage::RayGen, rays}, {ShaderStage::RayMiss, miss}}), IsOk());
    EXPECT_THAT(join({{ShaderStage::RayGen, rays}, {ShaderStage::RayMiss, miss}}, 1, true), IsOk());
}

TEST_F(TraversalJoinText, StructuresOfManyPlaces) {
    const std::string rays = R"(
layout(binding = 0) uniform accelerationStructureEXT scenes[4];
layout(binding = 1) uniform accelerationStructureEXT table[];
layout(push_constant) uniform Push { uvec2 address; uint64_t wide; };
layout(location = 0) rayPayloadEXT vec4 data;
void look(accelerationStructureEXT scene) {
    traceRayEXT(scene, 0u, 0xff, 0, 1, 0, vec3(0.0), 0.0, vec3(0.0, 0.0, -1.0), 100.0, 0);
}
void main() {
    look(scenes[gl_LaunchIDEXT.x & 3u]);
    for (uint i = 0u; i < 3u; i++) look(table[nonuniformEXT(i + gl_LaunchIDEXT.x)]);
    traceRayEXT(accelerationStructureEXT(address), 0u, 0xff, 0, 1, 0, vec3(0.0), 0.0, vec3(1.0), 100.0, 0);
    traceRayEXT(accelerationStructureEXT(wide), 0u, 0xff, 0, 1, 0, vec3(0.0), 0.0, vec3(1.0), 100.0, 0);
}
)";
    for (const bool optimized : {false, true}) {
        const Expected<Words> joined =
            join({{ShaderStage::RayGen, rays}, {ShaderStage::Closest, closest}}, 2, optimized);
        ASSERT_THAT(joined, IsOk());
        // Both arrays, addresses, and the lone one.
        EXPECT_EQ(countInstructions(*joined, spv::OpRayQueryInitializeKHR), 4u);
        EXPECT_EQ(countInstructions(*joined, spv::OpRayQueryProceedKHR), 1u);
        ShaderSource source = binary(*joined);
        source.tracing.library = "glint/tracing/query.h";
        source.tracing.set = 8;
        Expected<Reflection> reflection = reflect(*joined);
        ASSERT_THAT(reflection, IsOk());
        EXPECT_THAT(shader::rewriteRayQueries(source, *joined, *reflection), IsOk());
    }
}

TEST_F(TraversalJoinText, QueriesWithinStages) {
    const std::string asking = incoming("layout(binding = 0) uniform accelerationStructureEXT scene;\n",
                                        "rayQueryEXT query; rayQueryInitializeEXT(query, scene, 0u, 0xff, vec3(0.0), "
                                        "0.0, vec3(1.0), 5.0); while (rayQueryProceedEXT(query)) {} payload.x = "
                                        "rayQueryGetIntersectionTEXT(query, true);");
    const Expected<Words> joined = join({{ShaderStage::RayGen, generation}, {ShaderStage::Closest, asking}});
    ASSERT_THAT(joined, IsOk());
    EXPECT_EQ(countInstructions(*joined, spv::OpTypeRayQueryKHR), 1u);
    EXPECT_EQ(countInstructions(*joined, spv::OpTypeAccelerationStructureKHR), 1u);
}

}  // namespace glint::test
