#include "shader_test.h"

#include <glint/base/log.h>
#include <glint/shader/shader_compiler.h>

#include <spirv/unified1/spirv.hpp>

#include <mutex>
#include <thread>

using namespace glint;
using namespace glint::test;

namespace {

class ShaderCompile : public ShaderTest {};

const std::string scale = "layout(local_size_x = GROUP_SIZE) in;\n"
                          "layout(set = 0, binding = 0) uniform Parameters { float factor; } parameters;\n"
                          "layout(set = 0, binding = 1) buffer Values { float values[]; };\n"
                          "void main() { values[gl_GlobalInvocationID.x] *= parameters.factor; }\n";

const std::string empty_assembly = "OpCapability Shader\n"
                                   "OpMemoryModel Logical GLSL450\n"
                                   "OpEntryPoint GLCompute %main \"main\"\n"
                                   "OpExecutionMode %main LocalSize 8 4 2\n"
                                   "%void = OpTypeVoid\n"
                                   "%fn = OpTypeFunction %void\n"
                                   "%main = OpFunction %void None %fn\n"
                                   "%label = OpLabel\n"
                                   "OpReturn\n"
                                   "OpFunctionEnd\n";

/// The least text that each stage accepts.
std::string leastText(ShaderStage stage) {
    switch (stage) {
        case ShaderStage::Control: return "layout(vertices = 3) out; void main() {}";
        case ShaderStage::Evaluate: return "layout(triangles) in; void main() { gl_Position = vec4(0.0); }";
        case ShaderStage::Geometry:
            return "layout(triangles) in; layout(triangle_strip, max_vertices = 3) out;"
                   "void main() { gl_Position = vec4(0.0); EmitVertex(); }";
        case ShaderStage::Task: return "layout(local_size_x = 32) in; void main() { EmitMeshTasksEXT(1, 1, 1); }";
        case ShaderStage::Mesh:
            return "layout(local_size_x = 32) in; layout(triangles, max_vertices = 3, max_primitives = 1) out;"
                   "void main() { SetMeshOutputsEXT(0, 0); }";
        case ShaderStage::FirstHit: return "void main() { ignoreIntersectionEXT; }";
        case ShaderStage::Intersection: return "void main() { reportIntersectionEXT(1.0, 0u); }";
        default: return "void main() {}";
    }
}

Expected<std::vector<uint32_t>> compileOnly(const ShaderSource& source) {
    const Expected<shader::Preprocessed> text = shader::preprocess(source);
    if (!text) return unexpected(text.error());
    return shader::compile(source, *text);
}

}  // namespace

TEST_F(ShaderCompile, OnlyWhoNamesTheShadingRateAsksForIt) {
    const auto compiled = [](std::string_view member) {
        const std::string text =
            "layout(local_size_x = 1) in; layout(triangles, max_vertices = 3, max_primitives = 1) out;"
            "void main() { SetMeshOutputsEXT(0, 0); uint i = gl_LocalInvocationIndex;" +
            std::string(member) + " }";
        const Expected<CompiledShader> result = compileShader(glsl(text, ShaderStage::Mesh));
        EXPECT_THAT(result, IsOk()) << text;
        return result ? shader::disassemble(result->words) : std::string();
    };
    EXPECT_THAT(compiled("gl_MeshPrimitivesEXT[i].gl_Layer = 1;"),
                testing::AllOf(testing::HasSubstr("BuiltIn Layer"), testing::Not(testing::HasSubstr("ShadingRate")),
                               testing::Not(testing::HasSubstr("shading_rate"))));
    EXPECT_THAT(compiled("gl_MeshPrimitivesEXT[i].gl_PrimitiveShadingRateEXT = 1;"),
                testing::AllOf(testing::HasSubstr("OpCapability FragmentShadingRateKHR"),
                               testing::HasSubstr("BuiltIn PrimitiveShadingRate")));
    EXPECT_THAT(compiled(""), testing::Not(testing::HasSubstr("ShadingRate")));
}

TEST_F(ShaderCompile, EveryStageCompilesWithoutWarning) {
    std::vector<std::string> warnings;
    setLogCallback([&](LogLevel, std::string_view, std::string_view text) { warnings.emplace_back(text); });
    for (uint32_t i = 0; i < static_cast<uint32_t>(ShaderStage::Count); i++) {
        const auto stage = static_cast<ShaderStage>(i);
        for (const char* version : {"", "#version 450\n", "#version 460 core\n"}) {
            if (stage >= ShaderStage::RayGen && std::string_view(version).starts_with("#version 450")) continue;
            const Expected<CompiledShader> result = compileShader(glsl(version + leastText(stage), stage));
            EXPECT_THAT(result, IsOk()) << toString(stage) << version;
            EXPECT_TRUE(result && result->reflection.stage == stage);
        }
        // The lists of extensions hold nothing that a stage does not take.
        const Expected<shader::Preprocessed> text =
            shader::preprocess(glsl("float16_t f();\n" + leastText(stage), stage));
        ASSERT_THAT(text, IsOk());
        EXPECT_THAT(shader::compile(glsl("", stage), *text), IsOk()) << toString(stage);
    }
    setLogCallback({});
    EXPECT_THAT(warnings, ::testing::IsEmpty());
}

TEST_F(ShaderCompile, StepsGiveWhatTheWholeGives) {
    const ShaderSource source = glsl(scale, ShaderStage::Compute, "GROUP_SIZE=64");
    const Expected<std::vector<uint32_t>> words = compileOnly(source);
    ASSERT_THAT(words, IsOk());
    EXPECT_THAT(shader::validate(source, *words), IsOk());
    const Expected<Reflection> reflection = reflect(*words);
    ASSERT_THAT(reflection, IsOk());
    EXPECT_EQ(reflection->group_size[0], 64u);
    const Expected<std::vector<uint32_t>> optimized = shader::optimize(source, *words);
    ASSERT_THAT(optimized, IsOk());
    const Expected<CompiledShader> whole = compileShader(source);
    ASSERT_THAT(whole, IsOk());
    EXPECT_EQ(whole->words, *optimized);
    EXPECT_FALSE(whole->from_cache);
    EXPECT_EQ(words->at(1), 0x00010600u);
}

TEST_F(ShaderCompile, CommonOverloadsStayUnambiguous) {
    EXPECT_THAT(
        compileShader(glsl("layout(set = 0, binding = 0) buffer B { float f; int i; uint u; int64_t l; };\n"
                           "void main() {\n"
                           "    f = sqrt(2) + pow(2, f) + max(f, 0) + mix(0, 1, f) + clamp(i, 0u, 1u) + mod(i, 2);\n"
                           "    f += min(u, i) + floor(i) + atan(1, 2) + dot(vec3(i), ivec3(u));\n"
                           "    u = i < 0 ? 1u : 2;\n"
                           "    l = max(l, 3l) + i;\n"
                           "    atomicAdd(u, 1);\n"
                           "    atomicAdd(l, 1l);\n"
                           "}\n")),
        IsOk());
}

TEST_F(ShaderCompile, ExtensionsNeedNoLineOfTheUsers) {
    const std::string text =
        "layout(set = 0, binding = 0, scalar) buffer A { f16vec3 half_vector; u8vec4 bytes; vec3 v; };\n"
        "layout(buffer_reference, scalar) buffer P { float x[]; };\n"
        "layout(push_constant) uniform C { P address; uint64_t number; };\n"
        "layout(set = 1, binding = 0) uniform texture2D table[];\n"
        "layout(set = 1, binding = 1) uniform sampler point;\n"
        "layout(set = 2, binding = 0) uniform accelerationStructureEXT scene;\n"
        "void main() {\n"
        "    half_vector *= float16_t(2.0);\n"
        "    [[branch]] if (number > 3) address.x[0] = subgroupAdd(v.x);\n"
        "    [[unroll]] for (int i = 0; i < 2; i++) bytes += u8vec4(1);\n"
        "    v.y = textureLod(sampler2D(table[nonuniformEXT(uint(number))], point), vec2(0), 0.0).x;\n"
        "    v.z = texelFetch(table[0], ivec2(0), 0).x;\n"
        "    rayQueryEXT query;\n"
        "    rayQueryInitializeEXT(query, scene, 0, 255, vec3(0), 0.0, v, 1.0);\n"
        "    rayQueryProceedEXT(query);\n"
        "    debugPrintfEXT(\"number %u\\n\", uint(number));\n"
        "}\n";
    EXPECT_THAT(compileShader(glsl(text)), IsOk());
    EXPECT_THAT(
        compileShader(glsl("layout(location = 0) rayPayloadEXT vec3 color;\n"
                           "layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;\n"
                           "void main() { traceRayEXT(scene, gl_RayFlagsSkipAABBEXT, 255, 0, 1, 0, vec3(0), 0.0,\n"
                           "              vec3(1), 1.0, 0); }\n",
                           ShaderStage::RayGen)),
        IsOk());
}

TEST_F(ShaderCompile, EntryPointsMustExist) {
    EXPECT_THAT(compileShader(glsl("void other() {}\n")), HasErrorId("shader.entry"));
    ShaderSource source = glsl("void other() {}\n");
    source.entry = "other";
    const Expected<CompiledShader> result = compileShader(source);
    ASSERT_THAT(result, IsOk());
    EXPECT_EQ(result->reflection.entry, "other");

    ShaderSource missing = assembly(empty_assembly);
    missing.entry = "absent";
    EXPECT_THAT(compileShader(missing), HasErrorId("shader.entry"));
}

TEST_F(ShaderCompile, SpirvOfAnotherStageIsAnError) {
    const Expected<CompiledShader> compute = compileShader(glsl(scale, ShaderStage::Compute, "GROUP_SIZE=8"));
    ASSERT_THAT(compute, IsOk());
    EXPECT_THAT(compileShader(binary(compute->words)), IsOk());
    EXPECT_THAT(compileShader(binary(compute->words, ShaderStage::Vertex)), HasErrorId("shader.stage"));
    EXPECT_THAT(compileShader(assembly(empty_assembly, ShaderStage::RayGen)), HasErrorId("shader.stage"));
    EXPECT_THAT(shader::validate(binary({}, ShaderStage::Vertex), compute->words), HasErrorId("shader.stage"));
}

TEST_F(ShaderCompile, AssemblyAndWordsGoTheSameWay) {
    const Expected<CompiledShader> result = compileShader(assembly(empty_assembly));
    ASSERT_THAT(result, IsOk());
    EXPECT_EQ(result->reflection.group_size, (std::array<uint32_t, 3>{8, 4, 2}));
    const std::string text = shader::disassemble(result->words);
    EXPECT_NE(text.find("OpEntryPoint GLCompute %1 \"main\""), std::string::npos) << text;
    EXPECT_THAT(compileShader(assembly(text)), IsOk());

    std::vector<uint32_t> swapped = result->words;
    for (uint32_t& word : swapped) word = __builtin_bswap32(word);
    const Expected<CompiledShader> again = compileShader(binary(swapped));
    ASSERT_THAT(again, IsOk());
    EXPECT_EQ(again->words, result->words);
    EXPECT_EQ(shader::disassemble(swapped), text);
}

TEST_F(ShaderCompile, FaultsOfAssemblyNameTheirLine) {
    const Expected<CompiledShader> unknown =
        compileShader(assembly("OpCapability Shader\nOpMemoryModel Logical GLSL450\nOpNonsense\n"));
    ASSERT_THAT(unknown, HasErrorId("shader.assemble"));
    EXPECT_EQ(unknown.error().line(), 3u);
    EXPECT_EQ(unknown.error().file(), "test.spvasm");
    EXPECT_THAT(compileShader(assembly("  \n")), HasErrorId("shader.empty"));

    std::string text = empty_assembly;
    text.replace(text.find("OpReturn\n"), 9, "; comment\n\n%x = OpIAdd %void %void %void\nOpReturn\n");
    const Expected<CompiledShader> invalid = compileShader(assembly(text));
    ASSERT_THAT(invalid, HasErrorId("shader.validate"));
    EXPECT_EQ(invalid.error().line(), 11u) << invalid.error().text();
}

TEST_F(ShaderCompile, WordsThatAreNoSpirvAreErrors) {
    EXPECT_THAT(compileShader(binary({})), HasErrorId("shader.empty"));
    EXPECT_THAT(compileShader(binary({1})), HasErrorId("shader.validate"));
    EXPECT_THAT(compileShader(binary({1, 2, 3, 4, 5, 6})), HasErrorId("shader.validate"));
    EXPECT_THAT(compileShader(binary({spv::MagicNumber, 0x10600, 0, 1, 0})), HasErrorId("shader.validate"));
    const std::vector<uint32_t> garbage(100, 0xffffffffu);
    EXPECT_THAT(shader::optimize(binary({}), garbage), HasErrorId("shader.optimize"));
    EXPECT_THAT(reflect(garbage), HasErrorId("shader.reflect"));
    EXPECT_THAT(reflect({}), HasErrorId("shader.reflect"));
    EXPECT_EQ(shader::disassemble(garbage), "");
    EXPECT_EQ(shader::disassemble({}), "");
}

TEST_F(ShaderCompile, NamesOutliveTheOptimiser) {
    const Expected<CompiledShader> result = compileShader(glsl(scale, ShaderStage::Compute, "GROUP_SIZE=8"));
    ASSERT_THAT(result, IsOk());
    const std::string text = shader::disassemble(result->words);
    for (const char* name :
         {"OpName %Values \"Values\"", "OpName %parameters \"parameters\"", "\"factor\"", "\"main\""})
        EXPECT_NE(text.find(name), std::string::npos) << name << "\n" << text;
    EXPECT_EQ(text.find("OpSourceExtension"), std::string::npos);
}

TEST_F(ShaderCompile, PreciseOutlivesTheOptimiser) {
    const auto count = [](const std::string& qualifier) {
        const std::string text = "layout(set = 0, binding = 0) buffer B { float a, b, c; vec3 v; float result[4]; };\n"
                                 "float product(float x, float y, float z) { " +
                                 qualifier +
                                 " float p = x * y + z; return p; }\n"
                                 "void error(out " +
                                 qualifier +
                                 " float e, float x, float y) { e = x * y - c; }\n"
                                 "void main() {\n"
                                 "    float e;\n"
                                 "    error(e, a, b);\n"
                                 "    " +
                                 qualifier +
                                 " vec3 w = v * a - v.zxy * b;\n"
                                 "    result[0] = product(a, b, c);\n"
                                 "    result[1] = product(b, c, a);\n"
                                 "    result[2] = e;\n"
                                 "    result[3] = w.x + w.y + w.z;\n"
                                 "}\n";
        const Expected<CompiledShader> result = compileShader(glsl(text));
        EXPECT_THAT(result, IsOk());
        return result ? countInstructions(result->words, spv::OpDecorate, spv::DecorationNoContraction) : 0;
    };
    EXPECT_EQ(count(""), 0u);
    // Two calls of two operations each, one of two, and one of three.
    EXPECT_EQ(count("precise"), 2u * 2u + 2u + 3u);
}

TEST_F(ShaderCompile, OptimiserInlinesAndFolds) {
    const Expected<std::vector<uint32_t>> words =
        compileOnly(glsl("layout(set = 0, binding = 0) buffer B { float b; };\n"
                         "float twice(float x) { return x * 2.0; }\n"
                         "void main() { if (false) b = 3.0; b = twice(twice(b)); }\n"));
    ASSERT_THAT(words, IsOk());
    const Expected<std::vector<uint32_t>> optimized = shader::optimize(glsl(""), *words);
    ASSERT_THAT(optimized, IsOk());
    EXPECT_EQ(countInstructions(*words, spv::OpFunctionCall), 2u);
    EXPECT_EQ(countInstructions(*optimized, spv::OpFunctionCall), 0u);
    EXPECT_EQ(countInstructions(*optimized, spv::OpBranchConditional), 0u);
}

TEST_F(ShaderCompile, WarningsReachTheLog) {
    std::vector<std::string> texts;
    setLogCallback([&](LogLevel level, std::string_view id, std::string_view text) {
        EXPECT_EQ(level, LogLevel::Warning);
        EXPECT_EQ(id, "shader.warning");
        texts.emplace_back(text);
    });
    EXPECT_THAT(
        compileShader(glsl("\n#extension GL_EXT_absent : enable\nvoid main() {}\n", ShaderStage::Compute, "A=1")),
        IsOk());
    setLogCallback({});
    ASSERT_EQ(texts.size(), 1u);
    EXPECT_EQ(texts[0], "test.shader:2 (A=1): '#extension' : extension not supported: GL_EXT_absent");
}

TEST_F(ShaderCompile, NamelessSourcesAreCalledByTheirStage) {
    ShaderSource source = glsl("void main() { x = 1; }", ShaderStage::Vertex);
    source.name.clear();
    const Expected<CompiledShader> result = compileShader(source);
    ASSERT_THAT(result, HasErrorId("shader.compile"));
    EXPECT_EQ(result.error().file(), "<Vertex shader>");
}

TEST_F(ShaderCompile, ThreadsCompileSideBySide) {
    std::vector<std::thread> threads;
    for (int thread = 0; thread < 4; thread++)
        threads.emplace_back([thread] {
            for (int i = 0; i < 5; i++) {
                const std::string macros = fmt::format("GROUP_SIZE={}", 1 + thread * 8 + i);
                const Expected<CompiledShader> good = compileShader(glsl(scale, ShaderStage::Compute, macros));
                ASSERT_THAT(good, IsOk());
                EXPECT_EQ(good->reflection.group_size[0], 1u + thread * 8u + i);
                EXPECT_THAT(compileShader(glsl("void main() { x = 1; }", ShaderStage::Fragment, macros)),
                            HasErrorId("shader.compile"));
                setShaderMacro(fmt::format("THREAD_{}", thread), macros.substr(11));
            }
        });
    for (std::thread& thread : threads) thread.join();
}
