// Shaders with ray queries, rewritten for a traversal library: what comes out is valid, free of ray queries, and has
// kept what it had. What they compute is tested by ray_query_rewrite_gpu_test.cpp.

#include "ray_query_cases.h"

#include "support/plain_library.h"

#include <glint/shader/convert.h>

#include <spirv/unified1/spirv.hpp>

#include <chrono>
#include <set>

namespace glint::test {

namespace {

ShaderSource rewritten(ShaderSource source) {
    source.tracing.library = plainLibrary();
    return source;
}

std::set<std::string> namesOf(std::span<const uint32_t> words) {
    std::set<std::string> names;
    for (size_t i = 5; i < words.size(); i += words[i] >> 16)
        if ((words[i] & 0xffff) == spv::OpName) names.insert(reinterpret_cast<const char*>(&words[i + 2]));
    return names;
}

/// Nothing in the module is for the driver's ray queries.
void expectFree(std::span<const uint32_t> words) {
    EXPECT_EQ(countInstructions(words, spv::OpCapability, spv::CapabilityRayQueryKHR, 1), 0u);
    EXPECT_EQ(countInstructions(words, spv::OpCapability, spv::CapabilityRayTraversalPrimitiveCullingKHR, 1), 0u);
    EXPECT_EQ(countInstructions(words, spv::OpTypeRayQueryKHR), 0u);
    EXPECT_EQ(countInstructions(words, spv::OpTypeAccelerationStructureKHR), 0u);
    for (size_t i = 5; i < words.size(); i += words[i] >> 16) {
        if ((words[i] & 0xffff) != spv::OpExtension) continue;
        EXPECT_STRNE(reinterpret_cast<const char*>(&words[i + 1]), "SPV_KHR_ray_query");
    }
}

class RewriteTest : public ShaderTest {
protected:
    /// The steps up to the rewriting, one by one.
    struct Steps {
        std::vector<uint32_t> original, words;
        Reflection before, reflection;
    };

    static Expected<Steps> steps(const ShaderSource& source) {
        Steps result;
        if (source.language == ShaderSource::Language::GLSL) {
            Expected<shader::Preprocessed> text = shader::preprocess(source);
            if (!text) return unexpected(text.error());
            Expected<std::vector<uint32_t>> words = shader::compile(source, *text);
            if (!words) return unexpected(words.error());
            result.original = std::move(*words);
        } else if (source.language == ShaderSource::Language::Assembly) {
            Expected<std::vector<uint32_t>> words = shader::assemble(source);
            if (!words) return unexpected(words.error());
            result.original = std::move(*words);
        } else {
            result.original = source.words;
        }
        if (Status status = shader::validate(source, result.original); !status) return unexpected(status.error());
        Expected<Reflection> reflection = reflect(result.original, source.entry);
        if (!reflection) return unexpected(reflection.error());
        result.before = result.reflection = std::move(*reflection);
        Expected<std::vector<uint32_t>> words = shader::rewriteRayQueries(source, result.original, result.reflection);
        if (!words) return unexpected(words.error());
        result.words = std::move(*words);
        return result;
    }

    static Steps stepsOf(std::string_view text, ShaderStage stage = ShaderStage::Compute) {
        Expected<Steps> result =
            steps(rewritten(glsl(std::string(prologue) + std::string(text), stage, stageMacro(stage))));
        EXPECT_THAT(result, IsOk());
        return result ? *result : Steps();
    }
};

class RewriteCaseTest : public RewriteTest, public ::testing::WithParamInterface<RayQueryCase> {};

}  // namespace

TEST_P(RewriteCaseTest, IsValidFreeAndWhole) {
    const ShaderSource source = rewritten(sourceOf(GetParam()));
    const Expected<Steps> result = steps(source);
    ASSERT_THAT(result, IsOk());
    expectFree(result->words);
    EXPECT_THAT(shader::validate(source, result->words), IsOk());

    // The slots are those of the shader as it was written.
    ASSERT_EQ(result->reflection.resources.size(), result->before.resources.size());
    for (size_t i = 0; i < result->before.resources.size(); i++) {
        const ShaderResource &before = result->before.resources[i], &after = result->reflection.resources[i];
        EXPECT_EQ(before.kind, after.kind);
        EXPECT_EQ(before.name, after.name);
        EXPECT_EQ(before.set, after.set);
        EXPECT_EQ(before.count, after.count);
        if (after.element == SlotKind::Tracing) {
            EXPECT_TRUE(after.descriptor == SlotKind::Uniform || after.descriptor == SlotKind::Storage);
        } else {
            EXPECT_EQ(after.descriptor, after.element);
        }
    }
    for (const ShaderResource& resource : result->reflection.hidden) {
        EXPECT_EQ(resource.set, source.tracing.set);
        EXPECT_EQ(resource.kind, SlotKind::Storage);
        EXPECT_FALSE(resource.write);
    }
    EXPECT_EQ(result->reflection.hidden.size(),
              countInstructions(result->words, spv::OpFunctionCall) && GetParam().name != std::string("UnusedStructure")
                  ? 1u
                  : 0u);

    // Debug names stay; so do `precise` and the specialisation constants.
    const std::set<std::string> before = namesOf(result->original), after = namesOf(result->words);
    for (const std::string& name : before) EXPECT_TRUE(after.contains(name)) << name;
    const auto decorations = [](std::span<const uint32_t> words, uint32_t decoration) {
        return countInstructions(words, spv::OpDecorate, decoration, 2);
    };
    EXPECT_GE(decorations(result->words, spv::DecorationNoContraction),
              decorations(result->original, spv::DecorationNoContraction));
    for (const uint32_t decoration : {spv::DecorationSpecId, spv::DecorationNonUniform, spv::DecorationBuiltIn})
        EXPECT_EQ(decorations(result->words, decoration), decorations(result->original, decoration)) << decoration;

    // And the rest of the way.
    const Expected<CompiledShader> compiled = compileShader(source);
    ASSERT_THAT(compiled, IsOk());
    expectFree(compiled->words);
    EXPECT_FALSE(compiled->reflection.uses_ray_query);
}

INSTANTIATE_TEST_SUITE_P(Shaders, RewriteCaseTest, ::testing::ValuesIn(ray_query_cases),
                         [](const auto& item) { return std::string(item.param.name); });

TEST_F(RewriteTest, CoversEnough) { EXPECT_GE(std::size(ray_query_cases), 60u); }

TEST_F(RewriteTest, ExamplesShader) {
    const std::filesystem::path path = testsDir().parent_path() / "examples/05_hello_tracing/main.shader";
    const Expected<std::string> text = readTextFile(path);
    ASSERT_THAT(text, IsOk());
    for (const ShaderStage stage : {ShaderStage::Fragment, ShaderStage::Compute}) {
        const Expected<CompiledShader> compiled = compileShader(rewritten(glsl(*text, stage, stageMacro(stage))));
        ASSERT_THAT(compiled, IsOk());
        expectFree(compiled->words);
        const ShaderResource* scene = find(compiled->reflection, "scene");
        ASSERT_TRUE(scene);
        EXPECT_EQ(scene->kind, SlotKind::Tracing);
        EXPECT_EQ(scene->descriptor, SlotKind::Uniform);
        EXPECT_EQ(scene->set, 1u);
        EXPECT_EQ(compiled->reflection.hidden.size(), 1u);
    }
    // A stage without queries is left as it is.
    const ShaderSource vertex = glsl(*text, ShaderStage::Vertex, "VERTEX_SHADER=1");
    const Expected<CompiledShader> one = compileShader(vertex), two = compileShader(rewritten(vertex));
    ASSERT_THAT(one, IsOk());
    ASSERT_THAT(two, IsOk());
    EXPECT_EQ(one->words, two->words);
}

TEST_F(RewriteTest, BlocksOfReferences) {
    const auto descriptor = [&](const char* declaration, const char* use) {
        const Steps result =
            stepsOf(std::string("layout(set = 1, binding = 4) uniform accelerationStructureEXT ") + declaration +
                    ";\nvoid main() { rayQueryEXT q; rayQueryInitializeEXT(q, " + use + ", RAY); }");
        for (const ShaderResource& resource : result.reflection.resources)
            if (resource.set == 1) {
                const Expected<Reflection> made = reflect(result.words);
                EXPECT_THAT(made, IsOk());
                const auto block = std::find_if(made->resources.begin(), made->resources.end(),
                                                [](const ShaderResource& item) { return item.set == 1; });
                EXPECT_EQ(block->binding, 4u);
                EXPECT_EQ(block->count, 1u);
                EXPECT_FALSE(block->write);
                return std::tuple(resource.descriptor, block->size, block->stride);
            }
        return std::tuple(SlotKind::Count, 0u, 0u);
    };
    EXPECT_EQ(descriptor("one", "one"), std::tuple(SlotKind::Uniform, 8u, 0u));
    EXPECT_EQ(descriptor("a[3]", "a[INDEX]"), std::tuple(SlotKind::Uniform, 48u, 0u));
    EXPECT_EQ(descriptor("a[1024]", "a[INDEX]"), std::tuple(SlotKind::Uniform, 16384u, 0u));
    EXPECT_EQ(descriptor("a[1025]", "a[INDEX]"), std::tuple(SlotKind::Storage, 16400u, 0u));
    EXPECT_EQ(descriptor("a[]", "a[INDEX]"), std::tuple(SlotKind::Storage, 0u, 16u));
}

TEST_F(RewriteTest, MergedLayoutsKeepTheHiddenApart) {
    const Expected<CompiledShader> vertex =
        compileShader(rewritten(sourceOf({"", "void main() { gl_Position = vec4(result[0]); }", ShaderStage::Vertex})));
    const Expected<CompiledShader> fragment = compileShader(
        rewritten(sourceOf({"", "void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); color = vec4(1); }",
                            ShaderStage::Fragment})));
    const Expected<CompiledShader> drivers =
        compileShader(sourceOf({"", "void main() { color = vec4(1); }", ShaderStage::Fragment}));
    ASSERT_THAT(vertex, IsOk());
    ASSERT_THAT(fragment, IsOk());
    ASSERT_THAT(drivers, IsOk());
    const std::array both = {&vertex->reflection, &fragment->reflection};
    const Expected<BindingLayout> layout = mergeLayouts(both);
    ASSERT_THAT(layout, IsOk());
    EXPECT_EQ(layout->resources.size(), 2u);
    EXPECT_EQ(layout->findSlot(SlotKind::Tracing, "scene"), 0);
    ASSERT_EQ(layout->hidden.size(), 1u);
    EXPECT_EQ(layout->hidden[0].set, 7u);
    EXPECT_EQ(layout->hidden[0].stages, stageBit(ShaderStage::Fragment));
    EXPECT_EQ(layout->set_count, 8u);
    // One engine for all the stages.
    const std::array mixed = {&vertex->reflection, &drivers->reflection};
    EXPECT_THAT(mergeLayouts(mixed), HasErrorId("shader.binding_conflict"));
}

TEST_F(RewriteTest, ErrorsAreThoseOfTheUsersText) {
    const auto fail = [](const ShaderSource& source) { return compileShader(source).error(); };
    const Error typo = fail(
        rewritten(glsl("layout(binding = 0) uniform accelerationStructureEXT scene;\nvoid main() {\n  rayQueryEXT q;\n"
                       "  rayQueryInitializeEXT(q, scene, 0u, 0xff, vec3(0), 0.0, vec3(1));\n}")));
    EXPECT_EQ(typo.id(), "shader.compile");
    EXPECT_EQ(typo.line(), 4u);
    EXPECT_EQ(typo.file(), "test.shader");

    const std::string with_set = "layout(set = 7, binding = 0) uniform Block { vec4 v; };\n";
    EXPECT_THAT(
        fail(rewritten(glsl(prologue + with_set +
                                "void main() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); result[0] = v.x; }",
                            ShaderStage::Compute, "COMPUTE_SHADER=1"))),
        HasErrorId("shader.tracing_set"));
    // Where there is nothing to rewrite, no set is taken.
    EXPECT_THAT(compileShader(rewritten(glsl(with_set + "void main() {}"))), IsOk());

    EXPECT_THAT(
        fail(rewritten(glsl("layout(binding = 0) uniform accelerationStructureEXT scene;\nlayout(location = 0) "
                            "rayPayloadEXT vec4 value;\n"
                            "void main() { traceRayEXT(scene, 0, 0xff, 0, 0, 0, vec3(0), 0.0, vec3(1), 1.0, 0); }",
                            ShaderStage::RayGen))),
        HasErrorId("shader.tracing_stage"));
    // An array whose length is not fixed cannot go into a function by value.
    EXPECT_THAT(fail(rewritten(sourceOf({"", R"(layout(constant_id = 1) const uint N = 2;
        layout(set = 1, binding = 0) uniform accelerationStructureEXT a[N];
        void start(rayQueryEXT q, accelerationStructureEXT s[N]) { rayQueryInitializeEXT(q, s[1], RAY); }
        void main() { rayQueryEXT q; start(q, a); })"}))),
                HasErrorId("shader.tracing_unsupported"));
}

TEST_F(RewriteTest, FaultsOfALibraryAreInternal) {
    const auto with = [&](std::string_view text) {
        include("mine/library.h", text);
        ShaderSource source = sourceOf(ray_query_cases[1]);
        source.tracing.library = "mine/library.h";
        return compileShader(source);
    };
    const std::string head = "struct GlintQuery { uint number; uint x; };\n";
    const std::string initialize = "void glintQueryInitialize(inout GlintQuery q, const uint n, const uvec2 s, const "
                                   "uint f, const uint m, const vec3 o, "
                                   "const float a, const vec3 d, const float b) { q.x = s.x; }\n";
    const std::string proceed = "bool glintQueryProceed(inout GlintQuery q) { return q.x-- != 0u; }\n";
    EXPECT_THAT(with(head + initialize + proceed), IsOk());
    EXPECT_THAT(with(head + initialize), HasErrorId("shader.tracing_internal"));  // lacks a function
    EXPECT_THAT(with(head + proceed), HasErrorId("shader.tracing_internal"));     // lacks the first
    EXPECT_THAT(with("#define uvec2 vec2\nstruct GlintQuery { uint number; float x; };\n" + initialize + proceed),
                HasErrorId("shader.tracing_internal"));
    EXPECT_THAT(with(head + initialize + "void glintQueryProceed(inout GlintQuery q) {}\n"),
                HasErrorId("shader.tracing_internal"));
    EXPECT_THAT(with(head + "syntax error"), HasErrorId("shader.tracing_internal"));
    ShaderSource missing = sourceOf(ray_query_cases[1]);
    missing.tracing.library = "mine/nothing.h";
    EXPECT_THAT(compileShader(missing), HasErrorId("shader.include"));
}

TEST_F(RewriteTest, TheLibraryMayBeLooselyWritten) {
    // Parameters that are not const, helpers that take the query, own types and constants beside the user's.
    include("mine/library.h", R"(
struct GlintQuery { uint number, count; vec3 origin; uint stack[4]; };
layout(set = GLINT_TRACING_SET, binding = 0) uniform sampler2D maps[2];
layout(set = GLINT_TRACING_SET, binding = 3, rgba32ui) uniform readonly uimageBuffer nodes;
uint advance(inout GlintQuery q, uint step) { q.count += step; q.stack[q.count & 3u] = imageLoad(nodes, int(step)).y; return q.count; }
void glintQueryInitialize(inout GlintQuery q, const uint n, const uvec2 s, uint f, uint m, vec3 o, float a, vec3 d, float b) {
    q.count = s.x + f; q.origin = o; q.origin.y += textureLod(maps[1], d.xy, a).x; o.x = 3.0; advance(q, 2u); }
bool glintQueryProceed(inout GlintQuery q) { precise float x = q.origin.x * q.origin.y + q.origin.z; return advance(q, 1u) < uint(x); }
)");
    ShaderSource source = sourceOf(ray_query_cases[1]);
    source.tracing = {"mine/library.h", "", 5};
    const Expected<Steps> result = steps(source);
    ASSERT_THAT(result, IsOk());
    expectFree(result->words);
    ASSERT_EQ(result->reflection.hidden.size(), 2u);
    EXPECT_EQ(result->reflection.hidden[0].count, 2u);
    EXPECT_TRUE(result->reflection.hidden[0].combined);
    EXPECT_EQ(result->reflection.hidden[1].binding, 3u);
    EXPECT_EQ(result->reflection.hidden[1].kind, SlotKind::Texel);
    EXPECT_EQ(result->reflection.hidden[1].set, 5u);
    EXPECT_GT(countInstructions(result->words, spv::OpDecorate, spv::DecorationNoContraction, 2), 0u);
}

TEST_F(RewriteTest, SpirvWithoutNames) {
    for (const RayQueryCase& item : ray_query_cases) {
        const Expected<Steps> named = steps(rewritten(sourceOf(item)));
        ASSERT_THAT(named, IsOk()) << item.name;
        std::vector<uint32_t> bare(named->original.begin(), named->original.begin() + 5);
        for (size_t i = 5; i < named->original.size(); i += named->original[i] >> 16) {
            const uint32_t opcode = named->original[i] & 0xffff;
            if (opcode == spv::OpName || opcode == spv::OpMemberName || opcode == spv::OpSource) continue;
            bare.insert(bare.end(), named->original.begin() + static_cast<ptrdiff_t>(i),
                        named->original.begin() + static_cast<ptrdiff_t>(i + (named->original[i] >> 16)));
        }
        const Expected<Steps> result = steps(rewritten(binary(bare, item.stage)));
        ASSERT_THAT(result, IsOk()) << item.name;
        expectFree(result->words);
    }
}

// As compilers of other languages write it: queries among the variables of functions, structures by value and through
// phis, signed operands, SPIR-V 1.3, an entry point of another name beside one of another stage.
constexpr const char* foreign = R"(
OpCapability Shader
OpCapability RayQueryKHR
OpExtension "SPV_KHR_ray_query"
OpExtension "SPV_KHR_storage_buffer_storage_class"
OpMemoryModel Logical GLSL450
OpEntryPoint GLCompute %trace "trace" %thread
OpEntryPoint Fragment %paint "paint" %color
OpExecutionMode %trace LocalSize 8 8 1
OpExecutionMode %paint OriginUpperLeft
OpName %color "color"
OpDecorate %thread BuiltIn GlobalInvocationId
OpDecorate %color Location 0
OpDecorate %first DescriptorSet 0
OpDecorate %first Binding 0
OpDecorate %second DescriptorSet 0
OpDecorate %second Binding 1
OpDecorate %values ArrayStride 4
OpDecorate %Block Block
OpMemberDecorate %Block 0 Offset 0
OpDecorate %out DescriptorSet 0
OpDecorate %out Binding 2
%void = OpTypeVoid
%procedure = OpTypeFunction %void
%int = OpTypeInt 32 1
%uint = OpTypeInt 32 0
%bool = OpTypeBool
%float = OpTypeFloat 32
%float3 = OpTypeVector %float 3
%float4 = OpTypeVector %float 4
%uint3 = OpTypeVector %uint 3
%i0 = OpConstant %int 0
%i1 = OpConstant %int 1
%i255 = OpConstant %int 255
%u0 = OpConstant %uint 0
%f0 = OpConstant %float 0
%f1 = OpConstant %float 1
%ones = OpConstantComposite %float3 %f1 %f1 %f1
%ones4 = OpConstantComposite %float4 %f1 %f1 %f1 %f1
%structure = OpTypeAccelerationStructureKHR
%structure_p = OpTypePointer UniformConstant %structure
%query = OpTypeRayQueryKHR
%query_p = OpTypePointer Function %query
%uint3_p = OpTypePointer Input %uint3
%float4_p = OpTypePointer Output %float4
%values = OpTypeRuntimeArray %uint
%Block = OpTypeStruct %values
%Block_p = OpTypePointer StorageBuffer %Block
%uint_p = OpTypePointer StorageBuffer %uint
%by_value = OpTypeFunction %void %query_p %structure
%thread = OpVariable %uint3_p Input
%color = OpVariable %float4_p Output
%first = OpVariable %structure_p UniformConstant
%second = OpVariable %structure_p UniformConstant
%out = OpVariable %Block_p StorageBuffer
%start = OpFunction %void None %by_value
%q = OpFunctionParameter %query_p
%s = OpFunctionParameter %structure
%start_1 = OpLabel
OpRayQueryInitializeKHR %q %s %i0 %i255 %ones %f0 %ones %f1
OpReturn
OpFunctionEnd
%trace = OpFunction %void None %procedure
%trace_1 = OpLabel
%mine = OpVariable %query_p Function
%id = OpLoad %uint3 %thread
%x = OpCompositeExtract %uint %id 0
%odd = OpUGreaterThan %bool %x %u0
OpSelectionMerge %trace_4 None
OpBranchConditional %odd %trace_2 %trace_3
%trace_2 = OpLabel
%a = OpLoad %structure %first
OpBranch %trace_4
%trace_3 = OpLabel
%b = OpLoad %structure %second
OpBranch %trace_4
%trace_4 = OpLabel
%chosen = OpPhi %structure %a %trace_2 %b %trace_3
%ignored = OpFunctionCall %void %start %mine %chosen
%more = OpRayQueryProceedKHR %bool %mine
%kind = OpRayQueryGetIntersectionTypeKHR %uint %mine %i1
%number = OpRayQueryGetIntersectionInstanceIdKHR %uint %mine %i0
%sum = OpIAdd %uint %kind %number
%place = OpAccessChain %uint_p %out %i0 %x
OpStore %place %sum
OpReturn
OpFunctionEnd
%paint = OpFunction %void None %procedure
%paint_1 = OpLabel
OpStore %color %ones4
OpReturn
OpFunctionEnd
)";

TEST_F(RewriteTest, SpirvOfOtherCompilers) {
    {
        Expected<std::vector<uint32_t>> words = shader::assemble(assembly(foreign));
        ASSERT_THAT(words, IsOk());
        (*words)[1] = 0x10300;
        ShaderSource source = rewritten(binary(*words));
        source.entry = "trace";
        const Expected<Steps> result = steps(source);
        ASSERT_THAT(result, IsOk());
        expectFree(result->words);
        EXPECT_EQ(result->words[1], 0x10300u);
        EXPECT_EQ(countInstructions(result->words, spv::OpEntryPoint), 1u);
        EXPECT_FALSE(namesOf(result->words).contains("color"));
        EXPECT_EQ(result->reflection.group_size, (std::array<uint32_t, 3>{8, 8, 1}));
        EXPECT_THAT(compileShader(source), IsOk());
        // The other entry point makes no query, but shares the module.
        source = rewritten(binary(*words, ShaderStage::Fragment));
        source.entry = "paint";
        const Expected<Steps> paint = steps(source);
        ASSERT_THAT(paint, IsOk());
        expectFree(paint->words);
        EXPECT_TRUE(paint->reflection.hidden.empty());
    }
}

TEST_F(RewriteTest, ConvertsToEveryLanguage) {
    // With the driver's ray queries two of them refuse.
    for (const char* name : {"TypeCompared", "TwoFunctionsWithQueries", "Matrices", "Fragment"}) {
        const auto item = std::find_if(std::begin(ray_query_cases), std::end(ray_query_cases),
                                       [&](const RayQueryCase& other) { return other.name == std::string(name); });
        ASSERT_NE(item, std::end(ray_query_cases));
        const Expected<Steps> result = steps(rewritten(sourceOf(*item)));
        ASSERT_THAT(result, IsOk());
        for (size_t i = 0; i < static_cast<size_t>(ShadingLanguage::Count); i++) {
            const auto language = static_cast<ShadingLanguage>(i);
            EXPECT_THAT(shader::convert(binary(result->words, item->stage), result->words, language), IsOk())
                << name << " to " << toString(language);
        }
    }
}

TEST_F(RewriteTest, CacheKeepsEnginesApart) {
    const TempDir folder;
    setShaderCache(folder.path());
    const ShaderSource driver = sourceOf(ray_query_cases[7]);
    ShaderSource software = rewritten(driver), other_set = software, other_form = software;
    other_set.tracing.set = 6;
    other_form.tracing.macros = "FORM=2";
    std::set<std::vector<uint32_t>> results;
    for (const ShaderSource& source : {driver, software, other_set, other_form}) {
        const Expected<CompiledShader> cold = compileShader(source);
        ASSERT_THAT(cold, IsOk());
        EXPECT_FALSE(cold->from_cache);
        const Expected<CompiledShader> warm = compileShader(source);
        ASSERT_THAT(warm, IsOk());
        EXPECT_TRUE(warm->from_cache);
        EXPECT_EQ(warm->words, cold->words);
        EXPECT_EQ(warm->reflection.hidden.size(), cold->reflection.hidden.size());
        for (size_t i = 0; i < cold->reflection.resources.size(); i++)
            EXPECT_EQ(warm->reflection.resources[i].descriptor, cold->reflection.resources[i].descriptor);
        results.insert(cold->words);
    }
    EXPECT_EQ(results.size(), 3u);  // the form means nothing to this library
}

TEST_F(RewriteTest, TakesNoLongerThanTheRest) {
    // Printed for the documentation; only an accident of another order fails.
    const ShaderSource driver = sourceOf(ray_query_cases[1]), software = rewritten(driver);
    const auto time = [](const ShaderSource& source) {
        const auto begin = std::chrono::steady_clock::now();
        EXPECT_THAT(compileShader(source), IsOk());
        return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    };
    time(driver);
    const double first = time(software), plain = std::min(time(driver), time(driver)),
                 next = std::min(time(software), time(software));
    const TempDir folder;
    setShaderCache(folder.path());
    time(software);
    const double cached = std::min(time(software), time(software));
    std::printf("ms: driver %.2f, rewritten first %.2f, next %.2f, cached %.3f\n", plain, first, next, cached);
    EXPECT_LT(next, 1000);
}

}  // namespace glint::test
