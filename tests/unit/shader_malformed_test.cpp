#include "shader_test.h"

#include <glint/base/log.h>

#include <random>

using namespace glint;
using namespace glint::test;

namespace {

class ShaderMalformed : public ShaderTest {
protected:
    // Text with random edits is full of things to warn about.
    ShaderMalformed() {
        setLogCallback([](LogLevel, std::string_view, std::string_view) {});
    }
    ~ShaderMalformed() override { setLogCallback({}); }

    static std::vector<uint32_t> richModule() {
        const std::string text =
            "layout(local_size_x = 8, local_size_y_id = 2) in;\n"
            "layout(constant_id = 1) const uint count = 3;\n"
            "struct Item { vec3 position; float weight; mat4 transform; };\n"
            "layout(set = 0, binding = 0, row_major) uniform U { Item items[3]; mat4 m; } u;\n"
            "layout(set = 0, binding = 1) readonly buffer S { uint n; vec4 values[]; } s[2];\n"
            "layout(set = 1, binding = 0) uniform texture2D table[];\n"
            "layout(set = 1, binding = 1) uniform sampler point;\n"
            "layout(set = 1, binding = 2, rgba8) uniform image2D surface;\n"
            "layout(set = 1, binding = 3) uniform sampler2D both[count];\n"
            "layout(set = 2, binding = 0) uniform accelerationStructureEXT scene;\n"
            "layout(buffer_reference) buffer P { float x[]; };\n"
            "layout(push_constant) uniform C { P address; float y; };\n"
            "shared float memory[64];\n"
            "precise float f(float x, int n) { for (int i = 0; i < n; i++) x = x * x + y; return x; }\n"
            "void main() {\n"
            "    rayQueryEXT q;\n"
            "    rayQueryInitializeEXT(q, scene, 0, 255, vec3(0), 0.0, vec3(1), 1.0);\n"
            "    while (rayQueryProceedEXT(q)) rayQueryConfirmIntersectionEXT(q);\n"
            "    memory[gl_LocalInvocationIndex] = f(u.items[1].weight, int(s[0].n));\n"
            "    barrier();\n"
            "    vec4 v = textureLod(sampler2D(table[nonuniformEXT(gl_GlobalInvocationID.x)], point), vec2(0), 0.0);\n"
            "    switch (s[1].n) { case 0: v = s[0].values[2]; break; case 5: v *= u.m; default: v.x += memory[3]; }\n"
            "    address.x[count] = subgroupAdd(v.x) + textureLod(both[1], v.xy, 0.0).x;\n"
            "    imageStore(surface, ivec2(gl_GlobalInvocationID.xy), v);\n"
            "}\n";
        const ShaderSource source = glsl(text);
        const Expected<shader::Preprocessed> preprocessed = shader::preprocess(source);
        const Expected<std::vector<uint32_t>> words = shader::compile(source, *preprocessed);
        EXPECT_THAT(words, IsOk());
        return words ? *words : std::vector<uint32_t>();
    }

    /// Everything that takes words from outside. What it says does not matter, that it says it does.
    static bool swallow(const std::vector<uint32_t>& words) {
        const Expected<CompiledShader> whole = compileShader(binary(words));
        EXPECT_TRUE(whole || whole.error().code() == ErrorCode::ShaderCompile);
        const Expected<Reflection> reflection = reflect(words);
        EXPECT_TRUE(reflection || reflection.error().id() == "shader.reflect");
        (void)shader::disassemble(words);
        return whole.has_value();
    }

    /// `count` modules that differ from a valid one in a few words.
    static void mutate(uint32_t seed, int count) {
        const std::vector<uint32_t> good = richModule();
        ASSERT_TRUE(swallow(good));
        std::mt19937 random(seed);
        const auto below = [&](size_t n) { return static_cast<size_t>(random() % n); };
        static constexpr uint32_t tempting[] = {0,       1,          2,          3,          0xffff,
                                                0x10000, 0x7fffffff, 0x80000000, 0xffffffff, 0x3fffff};
        int accepted = 0;
        for (int i = 0; i < count; i++) {
            std::vector<uint32_t> words = good;
            for (size_t edits = 1 + below(3); edits > 0; edits--) {
                const size_t at = below(words.size());
                switch (below(8)) {
                    case 0: words[at] = random(); break;
                    case 1: words[at] ^= 1u << below(32); break;
                    case 2: words[at] = tempting[below(std::size(tempting))]; break;
                    case 3: words[at] = words[below(words.size())]; break;
                    case 4: words[at] = 1 + static_cast<uint32_t>(below(good[3])); break;
                    case 5:
                        words.erase(words.begin() + at, words.begin() + std::min(words.size(), at + 1 + below(6)));
                        break;
                    case 6: words.insert(words.begin() + at, words[below(words.size())]); break;
                    default: words[at] += static_cast<uint32_t>(below(3)) - 1; break;
                }
                if (words.size() < 6) break;
            }
            accepted += swallow(words);
        }
        // The edits are small enough that some modules stay valid and go all the way.
        EXPECT_GT(accepted, 0);
        EXPECT_LT(accepted, count);
    }
};

class ShaderMalformedLong : public ShaderMalformed {};

}  // namespace

TEST_F(ShaderMalformed, RandomWords) {
    std::mt19937 random(1);
    for (int i = 0; i < 500; i++) {
        std::vector<uint32_t> words(random() % 200);
        for (uint32_t& word : words) word = random();
        EXPECT_FALSE(swallow(words));
        if (words.size() < 5) continue;
        words[0] = 0x07230203;
        words[1] = 0x00010600;
        words[3] = random() % 1000;
        words[4] = 0;
        EXPECT_FALSE(swallow(words));
        for (size_t k = 5; k < words.size(); k++) words[k] = (1 + random() % 5) << 16 | random() % 400;
        EXPECT_FALSE(swallow(words));
    }
}

TEST_F(ShaderMalformed, EveryTruncation) {
    const std::vector<uint32_t> good = richModule();
    for (size_t size = 0; size < good.size(); size++)
        EXPECT_FALSE(swallow({good.begin(), good.begin() + static_cast<ptrdiff_t>(size)})) << size;
}

TEST_F(ShaderMalformed, HugeHeaders) {
    const std::vector<uint32_t> good = richModule();
    for (const uint32_t bound : {0u, 1u, 0x7fffffffu, 0xffffffffu}) {
        std::vector<uint32_t> words = good;
        words[3] = bound;
        EXPECT_FALSE(swallow(words)) << bound;
    }
    std::vector<uint32_t> words = good;
    words[1] = 0xffffffffu;
    EXPECT_FALSE(swallow(words));
}

TEST_F(ShaderMalformed, MutationsOfAValidModule) { mutate(2, 3000); }

TEST_F(ShaderMalformedLong, ManyMutations) {
    for (uint32_t seed = 10; seed < 40; seed++) mutate(seed, 3000);
}

TEST_F(ShaderMalformed, MutationsOfGlsl) {
    const std::string good =
        "#version 460\n#if defined(A) && (B > 2)\n#include \"a.h\"\n#elif 1\n#define C(x) x * 2\n#endif\n"
        "/* c */ layout(local_size_x = 1) in; // d \\\n more\n"
        "layout(set = 0, binding = 0) buffer B0 { float f; vec4 v[]; };\n"
        "float g(float x) { return x * 2.0 + sin(x); }\n"
        "void main() { f = g(f); for (int i = 0; i < 3; i++) v[i] += vec4(f) * mat4(1.0); }\n";
    include("a.h", "#pragma once\nconst float a = 1.0;\n");
    std::mt19937 random(3);
    static constexpr std::string_view pieces[] = {"#", "\"",   "/*",       "*/",        "//",   "\\\n", "\n", "(",
                                                  ")", "#if ", "#endif\n", "#include ", "<",    ">",    "##", "defined",
                                                  "1", ";",    "{",        "}",         "\xff", "'"};
    for (int i = 0; i < 1500; i++) {
        std::string text = good;
        for (size_t edits = 1 + random() % 4; edits > 0 && !text.empty(); edits--) {
            const size_t at = random() % text.size();
            switch (random() % 4) {
                case 0: text.erase(at, 1 + random() % 8); break;
                case 1: text.insert(at, pieces[random() % std::size(pieces)]); break;
                case 2: text[at] = static_cast<char>(random()); break;
                default: text.insert(at, text.substr(random() % text.size(), random() % 30)); break;
            }
        }
        const Expected<CompiledShader> result = compileShader(glsl(text, ShaderStage::Compute, i % 2 ? "A; B=3" : ""));
        EXPECT_TRUE(result || result.error().code() == ErrorCode::ShaderCompile);
    }
}

TEST_F(ShaderMalformed, MutationsOfAssembly) {
    const std::string good = shader::disassemble(richModule());
    std::mt19937 random(4);
    for (int i = 0; i < 500; i++) {
        std::string text = good;
        for (size_t edits = 1 + random() % 3; edits > 0; edits--) {
            const size_t at = random() % text.size();
            if (random() % 2)
                text.erase(at, 1 + random() % 6);
            else
                text[at] = static_cast<char>(random());
        }
        const Expected<CompiledShader> result = compileShader(assembly(text));
        EXPECT_TRUE(result || result.error().code() == ErrorCode::ShaderCompile);
    }
}
