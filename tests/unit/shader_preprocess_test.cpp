#include "shader_test.h"

#include <glint/shader/embedded.h>

using namespace glint;
using namespace glint::test;

namespace {

class ShaderPreprocess : public ShaderTest {
protected:
    static Expected<shader::Preprocessed> run(std::string_view text, std::string_view macros = {}) {
        return shader::preprocess(glsl(text, ShaderStage::Compute, macros));
    }
    static bool has(const Expected<shader::Preprocessed>& result, std::string_view part) {
        return result && result->text.find(part) != std::string::npos;
    }
    static size_t count(const std::string& text, std::string_view part) {
        size_t number = 0;
        for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) number++;
        return number;
    }
    /// Compiles, and expects an error of this id at this place.
    static void expectErrorAt(const ShaderSource& source, const std::string& id, std::string_view file, uint32_t line) {
        const Expected<CompiledShader> result = compileShader(source);
        ASSERT_THAT(result, HasErrorId(id));
        EXPECT_EQ(result.error().file(), file) << result.error().text();
        EXPECT_EQ(result.error().line(), line) << result.error().text();
    }
};

const std::string body = "layout(local_size_x = 1) in;\nvoid main() {}\n";

}  // namespace

TEST_F(ShaderPreprocess, EmptyTextIsAnError) {
    EXPECT_THAT(run(""), HasErrorId("shader.empty"));
    EXPECT_THAT(run(" \n\t\r\n"), HasErrorId("shader.empty"));
    EXPECT_THAT(compileShader(glsl("")), HasErrorId("shader.empty"));
}

TEST_F(ShaderPreprocess, AddsVersionAndExtensionsWhereAbsent) {
    const auto plain = run(body);
    ASSERT_THAT(plain, IsOk());
    EXPECT_TRUE(plain->text.starts_with("#version 460\n#extension "));
    EXPECT_TRUE(has(plain, "#extension GL_EXT_ray_query : enable"));
    EXPECT_TRUE(has(plain, "#extension GL_KHR_shader_subgroup_arithmetic : enable"));
    EXPECT_FALSE(has(plain, "GL_EXT_ray_tracing "));

    const auto chosen = run("// a comment may come first\n#version 450 core // note\n" + body);
    ASSERT_THAT(chosen, IsOk());
    EXPECT_TRUE(chosen->text.starts_with("#version 450 core\n#extension "));
    EXPECT_EQ(count(chosen->text, "#version"), 1u);

    // OpenGL ES and old versions know other extensions, or none.
    EXPECT_FALSE(has(run("#version 310 es\n" + body), "#extension"));
    EXPECT_FALSE(has(run("#version 430\n" + body), "#extension"));
}

TEST_F(ShaderPreprocess, ExplicitTypesAreEnabledForThoseWhoUseThem) {
    const std::string name = "GL_EXT_shader_explicit_arithmetic_types ";
    EXPECT_FALSE(has(run(body), name));
    EXPECT_FALSE(has(run("int64_t x; u64vec2 y; int8_type z; if8vec w; f8vec2 v;\n" + body), name));
    for (const char* type :
         {"float16_t", "int8_t", "uint16_t", "f16vec2", "u8vec4", "i16vec3", "f64mat3x2", "uint32_t"})
        EXPECT_TRUE(has(run(fmt::format("void f({} x) {{}}\n", type) + body), name)) << type;
    EXPECT_TRUE(has(run(body, "TYPE=float16_t"), name));
}

TEST_F(ShaderPreprocess, VersionInTheWrongPlaceIsAnError) {
    include("v.h", "#version 460\n");
    EXPECT_THAT(run("#include \"v.h\"\n"), HasErrorId("shader.preprocess"));
    EXPECT_THAT(run("#version 460\n#version 460\n"), HasErrorId("shader.preprocess"));
}

TEST_F(ShaderPreprocess, MacrosBecomeDefinitions) {
    const auto result = run(body, "RAYGEN_SHADER=1; GROUP_SIZE = 64 ;NAME; TYPE=vec4(1, 2, 3, 4);;");
    EXPECT_TRUE(has(result, "#define RAYGEN_SHADER 1\n"));
    EXPECT_TRUE(has(result, "#define GROUP_SIZE 64\n"));
    EXPECT_TRUE(has(result, "#define NAME \n"));
    EXPECT_TRUE(has(result, "#define TYPE vec4(1, 2, 3, 4)\n"));
}

TEST_F(ShaderPreprocess, MalformedMacrosAreErrors) {
    for (const char* macros : {"=1", "1A=2", "A B=1", "A-B", "GL_X=1", "defined=1", "A=1;A=2", "A=1\n2", "F(x)=x"})
        EXPECT_THAT(run(body, macros), HasErrorId("shader.macro")) << macros;
    EXPECT_THAT(run(body, "A=1; A=1"), IsOk());
    EXPECT_THAT(compileShader(glsl(body, ShaderStage::Compute, "1A=2")), HasErrorId("shader.macro"));
}

TEST_F(ShaderPreprocess, GlobalMacrosGiveWayToTheSourcesOwn) {
    setShaderMacro("GROUP_SIZE", "32");
    setShaderMacro(" QUALITY ", "");
    EXPECT_TRUE(has(run(body), "#define GROUP_SIZE 32\n"));
    EXPECT_TRUE(has(run(body), "#define QUALITY \n"));
    const auto own = run(body, "GROUP_SIZE=64");
    EXPECT_TRUE(has(own, "#define GROUP_SIZE 64\n"));
    EXPECT_FALSE(has(own, "GROUP_SIZE 32"));
    removeShaderMacro("GROUP_SIZE");
    EXPECT_FALSE(has(run(body), "GROUP_SIZE"));
    clearShaderMacros();
    EXPECT_FALSE(has(run(body), "QUALITY"));
    setShaderMacro("not a name", "1");
    EXPECT_THAT(run(body), HasErrorId("shader.macro"));
}

TEST_F(ShaderPreprocess, MemoryComesBeforeTheDisk) {
    const TempDir dir;
    ASSERT_THAT(writeTextFile(dir / "a.h", "float from_disk;\n"), IsOk());
    ShaderSource source = glsl("#include \"a.h\"\n" + body);
    source.name = (dir / "main.shader").string();
    EXPECT_TRUE(has(shader::preprocess(source), "from_disk"));
    include("a.h", "float from_memory;\n");
    EXPECT_TRUE(has(shader::preprocess(source), "from_memory"));
    setShaderInclude("a.h", "");
    EXPECT_TRUE(has(shader::preprocess(source), "from_disk"));
}

TEST_F(ShaderPreprocess, SearchesBesideTheIncludingFileThenThePaths) {
    const TempDir dir;
    std::filesystem::create_directories(dir / "sub");
    std::filesystem::create_directories(dir / "library");
    ASSERT_THAT(writeTextFile(dir / "sub/a.h", "#include \"b.h\"\n#include <c.h>\n"), IsOk());
    ASSERT_THAT(writeTextFile(dir / "sub/b.h", "float beside;\n"), IsOk());
    ASSERT_THAT(writeTextFile(dir / "sub/c.h", "float wrong;\n"), IsOk());
    ASSERT_THAT(writeTextFile(dir / "library/b.h", "float wrong;\n"), IsOk());
    ASSERT_THAT(writeTextFile(dir / "library/c.h", "float from_path;\n"), IsOk());
    ASSERT_THAT(writeTextFile(dir / "main.shader", "is here for its name"), IsOk());
    ShaderSource source = glsl("#include \"sub/a.h\"\n" + body);
    source.name = (dir / "main.shader").string();
    EXPECT_THAT(shader::preprocess(source), HasErrorId("shader.include"));
    source.include_paths = {dir / "absent", dir / "library"};
    const auto result = shader::preprocess(source);
    EXPECT_TRUE(has(result, "float beside;"));
    EXPECT_TRUE(has(result, "float from_path;"));
    EXPECT_FALSE(has(result, "float wrong;"));
    EXPECT_EQ(result->files, (std::vector<std::filesystem::path>{dir / "main.shader", dir / "sub/a.h", dir / "sub/b.h",
                                                                 dir / "library/c.h"}));
    ASSERT_EQ(result->stamps.size(), 4u);
    EXPECT_EQ(result->stamps[2].path, dir / "sub/b.h");
    EXPECT_EQ(result->stamps[2].size, 14u);
}

TEST_F(ShaderPreprocess, MemoryIncludesFindTheirNeighbours) {
    include("lib/a.h", "#include \"b.h\"\n");
    include("lib/b.h", "float neighbour;\n");
    EXPECT_TRUE(has(run("#include \"lib/a.h\"\n" + body), "float neighbour;"));
}

TEST_F(ShaderPreprocess, TheSdksOwnShadersAreFound) {
    ASSERT_FALSE(embeddedShaders().empty());
    const auto result = run("#include <glint/constants.h>\n" + body);
    ASSERT_THAT(result, IsOk());
    EXPECT_TRUE(has(result, "GLINT_PI"));
    EXPECT_TRUE(result->files.empty());
    EXPECT_THAT(run("#include \"glint/constants.h\"\n" + body), IsOk());
    EXPECT_THAT(run("#include <glint/absent.h>\n" + body), HasErrorId("shader.include"));
}

TEST_F(ShaderPreprocess, MissingIncludeNamesPlaceAndFolders) {
    const auto result = run("\n#include \"absent.h\"\n", "A=1");
    ASSERT_THAT(result, HasErrorId("shader.include"));
    EXPECT_EQ(result.error().line(), 2u);
    EXPECT_EQ(result.error().file(), "test.shader");
    EXPECT_EQ(result.error().context(), "A=1");
    EXPECT_NE(result.error().message().find("'absent.h'"), std::string::npos);
    EXPECT_EQ(result.error().code(), ErrorCode::ShaderCompile);
}

TEST_F(ShaderPreprocess, MalformedIncludesAreErrors) {
    for (const char* line : {"#include", "#include a.h", "#include \"a.h", "#include <a.h", "#include \"\"",
                             "#include \"a.h\" b", "#include UNKNOWN"})
        EXPECT_THAT(run(std::string(line) + "\n"), HasErrorId("shader.preprocess")) << line;
}

TEST_F(ShaderPreprocess, IncludeTakesAMacro) {
    include("chosen.h", "float chosen;\n");
    EXPECT_TRUE(has(run("#include FILE\n" + body, "FILE=\"chosen.h\""), "float chosen;"));
    EXPECT_TRUE(has(run("#define FILE <chosen.h>\n#include FILE\n" + body), "float chosen;"));
}

TEST_F(ShaderPreprocess, CyclesAndDepthAreErrors) {
    include("a.h", "#include \"b.h\"\n");
    include("b.h", "#include \"a.h\"\n");
    const auto cycle = run("#include \"a.h\"\n");
    ASSERT_THAT(cycle, HasErrorId("shader.include"));
    EXPECT_EQ(cycle.error().message(), "include cycle: a.h -> b.h -> a.h");
    EXPECT_EQ(cycle.error().line(), 1u);

    for (int i = 0; i < 40; i++) include(fmt::format("d{}.h", i), fmt::format("#include \"d{}.h\"\n", i + 1));
    include("d40.h", "float deep;\n");
    const auto deep = run("#include \"d0.h\"\n");
    ASSERT_THAT(deep, HasErrorId("shader.include"));
    EXPECT_NE(deep.error().message().find("32 deep"), std::string::npos);
    EXPECT_TRUE(has(run("#include \"d20.h\"\n"), "float deep;"));
}

TEST_F(ShaderPreprocess, GuardsAndPragmaOnceHold) {
    include("guard.h", "#ifndef GUARD_H\n#define GUARD_H\n#include \"guard.h\"\nfloat guarded;\n#endif\n");
    include("once.h", "// comment\n#pragma once\n#include \"once.h\"\nfloat once;\n");
    include("both.h", "#include \"guard.h\"\n#include \"once.h\"\n");
    const auto result = run("#include \"guard.h\"\n#include \"once.h\"\n#include \"both.h\"\n" + body);
    ASSERT_THAT(result, IsOk());
    EXPECT_EQ(count(result->text, "float once;"), 1u);
    EXPECT_THAT(compileShader(glsl("#include \"both.h\"\n#include \"both.h\"\n" + body)), IsOk());
}

TEST_F(ShaderPreprocess, BranchesNotTakenNeedNoFiles) {
    const std::string use = "#include \"absent.h\"\n";
    for (const char* condition : {"#if 0",
                                  "#ifdef ABSENT",
                                  "#ifndef YES",
                                  "#if defined(ABSENT)",
                                  "#if defined ABSENT && NUMBER > 3",
                                  "#if NUMBER * 2 + 1 != 7",
                                  "#if !YES",
                                  "#if (NUMBER << 1) == 0x7 || 010 == 10u",
                                  "#if NUMBER / 2 > 1",
                                  "#if ALIAS == 4",
                                  "#if UNDEFINED_NAME",
                                  "#if ~0 == 0",
                                  "#if NUMBER % 2 == 0",
                                  "#if -1 > +1",
                                  "#if 6 & 1",
                                  "#if (1 ^ 1) | 0",
                                  "#if GL_unknown && 0",
                                  "#if 1 <= 0",
                                  "#if 1 < 1 || 0 >= 1",
                                  "#if 8 >> 4"}) {
        EXPECT_THAT(run(std::string(condition) + "\n" + use + "#endif\n" + body, "YES=1; NUMBER=3; ALIAS=NUMBER"),
                    IsOk())
            << condition;
        EXPECT_THAT(
            run(std::string(condition) + "\n#else\n" + use + "#endif\n" + body, "YES=1; NUMBER=3; ALIAS=NUMBER"),
            HasErrorId("shader.include"))
            << condition;
    }
    EXPECT_THAT(run("#if 1\n#elif 1\n" + use + "#else\n" + use + "#endif\n" + body), IsOk());
    EXPECT_THAT(run("#if 0\n#if 1\n" + use + "#else\n" + use + "#endif\n#endif\n" + body), IsOk());
    EXPECT_THAT(run("#define A\n#undef A\n#ifdef A\n" + use + "#endif\n" + body), IsOk());
    EXPECT_THAT(run("/*\n#include \"absent.h\"\n*/ // #include \"absent.h\"\n" + body), IsOk());
    EXPECT_THAT(run("// goes on \\\n#include \"absent.h\"\n" + body), IsOk());
}

TEST_F(ShaderPreprocess, WhatOnlyTheCompilerKnowsIsLeftToIt) {
    include("once.h", "#pragma once\nconst float once_value = 1.0;\n");
    // Defined by the compiler, so that the branch counts and the missing file is an error after all.
    expectErrorAt(glsl("#ifdef GL_EXT_ray_query\n#include \"absent.h\"\n#endif\n" + body), "shader.compile",
                  "test.shader", 2);
    // Not defined: nothing is missing.
    EXPECT_THAT(compileShader(glsl("#ifdef GL_EXT_absent\n#include \"absent.h\"\n#endif\n" + body)), IsOk());
    EXPECT_THAT(compileShader(glsl("#if __VERSION__ < 460\n#include \"absent.h\"\n#endif\n" + body)), IsOk());
    // Whichever branch counts, a file that is to be taken once is taken once.
    const std::string text = "#ifdef GL_EXT_absent\n#include \"once.h\"\n#endif\n#include \"once.h\"\n"
                             "layout(set = 0, binding = 0) buffer B { float b; };\nvoid main() { b = once_value; }\n";
    EXPECT_THAT(compileShader(glsl(text)), IsOk());
    EXPECT_THAT(compileShader(glsl("#ifdef GL_EXT_ray_query\n#include \"once.h\"\n#endif\n" + text)), IsOk());
    EXPECT_THAT(compileShader(glsl("#ifdef GL_EXT_absent\n#error no\n#endif\n" + body)), IsOk());
    expectErrorAt(glsl("#ifdef GL_EXT_ray_query\n#error yes\n#endif\n" + body), "shader.compile", "test.shader", 2);
    EXPECT_THAT(compileShader(glsl("#ifdef GL_EXT_absent\n#define KIND 1\n#else\n#define KIND 2\n#endif\n"
                                   "#if KIND == 1\n#include \"absent.h\"\n#endif\n" +
                                   body)),
                IsOk());
}

TEST_F(ShaderPreprocess, FaultsOfConditionsAreErrors) {
    expectErrorAt(glsl("\n#error no luck\n" + body), "shader.preprocess", "test.shader", 2);
    expectErrorAt(glsl("\n#if 1\n" + body), "shader.preprocess", "test.shader", 2);
    expectErrorAt(glsl("\n#ifdef A\n#else\n#else\n#endif\n" + body), "shader.preprocess", "test.shader", 4);
    expectErrorAt(glsl("#endif\n" + body), "shader.preprocess", "test.shader", 1);
    expectErrorAt(glsl("#elif 1\n" + body), "shader.preprocess", "test.shader", 1);
    expectErrorAt(glsl("#else\n" + body), "shader.preprocess", "test.shader", 1);
    expectErrorAt(glsl("\n\n/* open\n\n" + body), "shader.preprocess", "test.shader", 3);
    expectErrorAt(glsl("\n" + std::string("a\0b", 3) + "\n" + body), "shader.preprocess", "test.shader", 2);
    include("open.h", "\n#if 1\n");
    expectErrorAt(glsl("#include \"open.h\"\n#endif\n" + body), "shader.preprocess", "open.h", 2);
    include("close.h", "#endif\n");
    expectErrorAt(glsl("#if 1\n#include \"close.h\"\n" + body), "shader.preprocess", "close.h", 1);
    EXPECT_THAT(run("#if 0\n#error not reached\n#endif\n" + body), IsOk());
}

TEST_F(ShaderPreprocess, ErrorsKeepTheirLines) {
    const std::string layout = "layout(local_size_x = GROUP_SIZE) in;\n";
    const auto source = [](std::string_view text) { return glsl(text, ShaderStage::Compute, "GROUP_SIZE=64; NAME"); };
    expectErrorAt(source(layout + "\nvoid main() { x = 1; }\n"), "shader.compile", "test.shader", 3);
    expectErrorAt(source("#version 460\n" + layout + "\nvoid main() { x = 1; }\n"), "shader.compile", "test.shader", 4);
    expectErrorAt(source("// c\n/* d\n */\n#version 460 core\n" + layout + "void main() { x = 1; }"), "shader.compile",
                  "test.shader", 6);
    expectErrorAt(source("\xef\xbb\xbf\r\n" + layout + "#define LONG a \\\r\n  b\r\nvoid main() { x = 1; }\r\n"),
                  "shader.compile", "test.shader", 5);
    expectErrorAt(source(layout + "#define A \\\n 1 \\\n 2\n\nvoid main() { x = 1; }\n"), "shader.compile",
                  "test.shader", 6);
    expectErrorAt(source("#if NAME_NOT\n\n#else\n#endif\n" + layout + "void main() { x = 1; }\n"), "shader.compile",
                  "test.shader", 6);
}

TEST_F(ShaderPreprocess, ErrorsInNestedIncludesNameTheirFile) {
    include("a.h", "\n#include \"inner/b.h\" // trailing\nfloat a() { return b(); }\nfloat broken_a() { return y; }\n");
    include("inner/b.h", "#pragma once\n\n#ifdef GROUP_SIZE\nfloat b() { return z; }\n#endif\n");
    ShaderSource source = glsl("#include \"a.h\"\nlayout(local_size_x = GROUP_SIZE) in;\nvoid main() { x = 1; }\n",
                               ShaderStage::Compute, "GROUP_SIZE=64");
    const Expected<CompiledShader> result = compileShader(source);
    ASSERT_THAT(result, HasErrorId("shader.compile"));
    EXPECT_EQ(result.error().file(), "inner/b.h");
    EXPECT_EQ(result.error().line(), 4u);
    EXPECT_EQ(result.error().context(), "GROUP_SIZE=64");

    include("inner/b.h", "#pragma once\n\nfloat b() { return 1.0; }\n");
    expectErrorAt(source, "shader.compile", "a.h", 4);
    include("a.h", "/* begins \n here */ #include \"inner/b.h\" /* goes\n on */ float c() { return w; }\n");
    expectErrorAt(source, "shader.compile", "a.h", 3);
    include("a.h", "float c = 1.0; \\");
    expectErrorAt(source, "shader.compile", "test.shader", 3);
}

TEST_F(ShaderPreprocess, LineDirectivesAreFollowed) {
    expectErrorAt(glsl("#line 100\nvoid main() { x = 1; }\n"), "shader.compile", "test.shader", 100);
    expectErrorAt(glsl("#line 7 \"made/by tool.gen\"\n\nvoid main() { x = 1; }\n"), "shader.compile",
                  "made/by tool.gen", 8);
    include("a.h", "float a;\n");
    expectErrorAt(glsl("\n#line 50 \"other\"\n#include \"a.h\"\n\nvoid main() { x = 1; }\n"), "shader.compile", "other",
                  52);
    expectErrorAt(glsl("#line 50 \"other\"\n\n#include \"absent.h\"\n"), "shader.include", "other", 51);
}

TEST_F(ShaderPreprocess, TextOfAnErrorReadsAsPromised) {
    ShaderSource source = glsl("layout(local_size_x = GROUP_SIZE) in;\n"
                               "layout(set = 0, binding = 0) uniform Parameters { float factor; };\n"
                               "layout(set = 0, binding = 1) buffer Values { float values[]; };\n"
                               "void main() {\n"
                               "    uint i = gl_GlobalInvocationID.x;\n"
                               "    if (i >= values.length()) return;\n"
                               "    valeus[i] *= factor;\n"
                               "}\n",
                               ShaderStage::Compute, "GROUP_SIZE=64");
    source.name = "scale.shader";
    const Expected<CompiledShader> result = compileShader(source);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().text(),
              "scale.shader:7 (GROUP_SIZE=64): 'valeus' : undeclared identifier [shader.compile]");
}

TEST_F(ShaderPreprocess, FilesChangedIsNoticed) {
    const TempDir dir;
    ASSERT_THAT(writeTextFile(dir / "a.h", "float a;\n"), IsOk());
    ShaderSource source = glsl("#include \"a.h\"\n" + body);
    source.name = (dir / "main.shader").string();
    const Expected<CompiledShader> shader = compileShader(source);
    ASSERT_THAT(shader, IsOk());
    ASSERT_EQ(shader->files, (std::vector<std::filesystem::path>{dir / "a.h"}));
    EXPECT_FALSE(filesChanged(shader->stamps));
    ASSERT_THAT(writeTextFile(dir / "a.h", "float ab;\n"), IsOk());
    EXPECT_TRUE(filesChanged(shader->stamps));
    const std::vector<FileStamp> again = {stampFile(dir / "a.h")};
    EXPECT_FALSE(filesChanged(again));
    std::filesystem::remove(dir / "a.h");
    EXPECT_TRUE(filesChanged(again));
    EXPECT_EQ(stampFile(dir / "a.h").time, -1);
    EXPECT_EQ(stampFile(dir.path()).time, -1);
    EXPECT_FALSE(filesChanged({}));
}
