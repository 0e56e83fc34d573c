#include "conformance/conformance.h"
#include "support/files.h"

#include <glint/base/file.h>
#include <glint/shader/shader_compiler.h>

namespace glint::test {

namespace {

class ShaderTest : public ConformanceTest {
protected:
    void TearDown() override {
        Shader::clearMacros();
        ConformanceTest::TearDown();
    }

    /// What a kernel that writes one number writes.
    uint32_t run(const Shader& shader) {
        Kernel kernel = device.createKernel("run");
        kernel.setShader(shader);
        EXPECT_THAT(kernel.create(), IsOk());
        const Buffer result = makeBuffer(std::vector<uint32_t>(1));
        compute([&](Compute& list) {
            list.setKernel(kernel);
            list.setStorageBuffer(0, result);
            list.dispatch(1);
        });
        return read<uint32_t>(result)[0];
    }
};

constexpr const char* value_kernel = R"(
#ifndef VALUE
#define VALUE 1
#endif
layout(local_size_x = 1) in;
layout(binding = 0) buffer Result { uint result; };
void main() { result = uint(VALUE); }
)";

}  // namespace

TEST_F(ShaderTest, KnowsWhatItDeclares) {
    const Shader shader = Shader::createGLSL(Shader::TypeCompute, value_kernel, "VALUE=3", "value");
    ASSERT_TRUE(shader) << shader.error().text();
    EXPECT_EQ(shader.getType(), Shader::TypeCompute);
    EXPECT_EQ(shader.name(), "value");
    ASSERT_EQ(shader.getReflection().resources.size(), 1u);
    EXPECT_EQ(shader.getReflection().resources[0].kind, SlotKind::Storage);
    EXPECT_EQ(shader.getReflection().resources[0].size, 4u);
    ASSERT_FALSE(shader.getWords().empty());
    EXPECT_EQ(shader.getWords()[0], 0x07230203u);
}

TEST_F(ShaderTest, NullShaderIsHarmless) {
    const Shader shader;
    EXPECT_FALSE(shader);
    EXPECT_TRUE(shader.getWords().empty());
    EXPECT_TRUE(shader.getReflection().resources.empty());
    EXPECT_FALSE(shader.reloaded());
}

TEST_F(ShaderTest, MacrosAreDefined) {
    EXPECT_EQ(run(Shader::createGLSL(Shader::TypeCompute, value_kernel)), 1u);
    EXPECT_EQ(run(Shader::createGLSL(Shader::TypeCompute, value_kernel, "VALUE=7; OTHER")), 7u);
    Shader::setMacro("VALUE", 8);
    EXPECT_EQ(run(Shader::createGLSL(Shader::TypeCompute, value_kernel)), 8u);
    EXPECT_EQ(run(Shader::createGLSL(Shader::TypeCompute, value_kernel, "VALUE=9")), 9u);
    Shader::setMacro("VALUE", "(5 + 5)");
    EXPECT_EQ(run(Shader::createGLSL(Shader::TypeCompute, value_kernel)), 10u);
    Shader::removeMacro("VALUE");
    EXPECT_EQ(run(Shader::createGLSL(Shader::TypeCompute, value_kernel)), 1u);
}

TEST_F(ShaderTest, FilesAndTheirIncludes) {
    const TempDir folder;
    ASSERT_THAT(writeTextFile(folder.path() / "main.shader", "#include \"part.h\"\n" + std::string(value_kernel)),
                IsOk());
    ASSERT_THAT(writeTextFile(folder.path() / "part.h", "#define VALUE 21\n"), IsOk());
    EXPECT_EQ(run(Shader::loadGLSL(Shader::TypeCompute, (folder.path() / "main.shader").string())), 21u);
    EXPECT_THAT(Shader::loadGLSL(Shader::TypeCompute, "found_by_path.shader"), HasErrorId("file.open"));
    ASSERT_THAT(writeTextFile(folder.path() / "found_by_path.shader", value_kernel), IsOk());
    Shader::addPath(folder.path().string());
    EXPECT_EQ(run(Shader::loadGLSL(Shader::TypeCompute, "found_by_path.shader")), 1u);
}

TEST_F(ShaderTest, IncludesFromMemory) {
    Shader::setInclude("memory.h", "#define VALUE 33\n");
    const std::string text = "#include \"memory.h\"\n" + std::string(value_kernel);
    EXPECT_EQ(run(Shader::createGLSL(Shader::TypeCompute, text)), 33u);
    Shader::setInclude("memory.h", "");
    EXPECT_THAT(Shader::createGLSL(Shader::TypeCompute, text), HasErrorId("shader.include"));
}

TEST_F(ShaderTest, SpirvAndAssembly) {
    const Shader five = Shader::createGLSL(Shader::TypeCompute, value_kernel, "VALUE=5");
    ASSERT_TRUE(five);
    EXPECT_EQ(run(Shader::createSPIRV(Shader::TypeCompute, five.getWords(), "words")), 5u);

    const TempDir folder;
    const std::string path = (folder.path() / "words.spv").string();
    ASSERT_THAT(writeFile(path, std::as_bytes(five.getWords())), IsOk());
    EXPECT_EQ(run(Shader::loadSPIRV(Shader::TypeCompute, path)), 5u);
    EXPECT_EQ(run(Shader::createAssembly(Shader::TypeCompute, shader::disassemble(five.getWords()), "text")), 5u);
}

TEST_F(ShaderTest, ErrorsNameFileLineAndMacros) {
    const Shader shader =
        Shader::createGLSL(Shader::TypeCompute, "layout(local_size_x = 1) in;\nvoid main() { valeus = 1; }\n",
                           "GROUP_SIZE=64", "scale.shader");
    EXPECT_EQ(shader.state(), ObjectState::Failed);
    EXPECT_THAT(shader, HasErrorId("shader.compile"));
    EXPECT_EQ(shader.error().code(), ErrorCode::ShaderCompile);
    EXPECT_EQ(shader.error().file(), "scale.shader");
    EXPECT_EQ(shader.error().line(), 2u);
    EXPECT_NE(shader.error().text().find("GROUP_SIZE=64"), std::string::npos) << shader.error().text();
    EXPECT_NE(shader.error().message().find("valeus"), std::string::npos);
    EXPECT_TRUE(shader.getWords().empty());
}

TEST_F(ShaderTest, WhatIsNoShaderFails) {
    EXPECT_THAT(Shader::createGLSL(Shader::TypeCompute, ""), HasErrorId("shader.empty"));
    EXPECT_THAT(Shader::createGLSL(Shader::TypeCompute, "void main() {", "1BAD=2"), HasErrorId("shader.macro"));
    EXPECT_THAT(Shader::createGLSL(Shader::TypeCompute, "#include \"nowhere.h\"\nvoid main() {}"),
                HasErrorId("shader.include"));
    EXPECT_THAT(Shader::createAssembly(Shader::TypeCompute, "OpNonsense"), HasErrorId("shader.assemble"));
    const std::vector<uint32_t> garbage = {1, 2, 3, 4, 5, 6, 7};
    EXPECT_THAT(Shader::createSPIRV(Shader::TypeCompute, garbage), HasErrorId("shader.validate"));
    EXPECT_FALSE(Shader::createSPIRV(Shader::TypeCompute, {}));
    const Shader compute = Shader::createGLSL(Shader::TypeCompute, value_kernel);
    EXPECT_THAT(Shader::createSPIRV(Shader::TypeFragment, compute.getWords()), HasErrorId("shader.stage"));
    EXPECT_THAT(Shader::createGLSL(static_cast<Shader::Type>(99), value_kernel), HasErrorId("shader.type"));
    EXPECT_THAT(Shader::loadGLSL(Shader::TypeCompute, "no/such/file.shader"), HasErrorId("file.open"));
    EXPECT_THAT(Shader::loadSPIRV(Shader::TypeCompute, "no/such/file.spv"), HasErrorId("file.open"));
    const TempDir folder;
    ASSERT_THAT(writeTextFile(folder.path() / "odd.spv", "abc"), IsOk());
    EXPECT_THAT(Shader::loadSPIRV(Shader::TypeCompute, (folder.path() / "odd.spv").string()),
                HasErrorId("shader.validate"));
}

TEST_F(ShaderTest, OneShaderInManyKernels) {
    const Shader shader = Shader::createGLSL(Shader::TypeCompute, value_kernel, "VALUE=2");
    EXPECT_EQ(run(shader), 2u);
    EXPECT_EQ(run(shader), 2u);
}

TEST_F(ShaderTest, ReloadedReadsTheFileAgain) {
    const TempDir folder;
    const std::string path = (folder.path() / "value.shader").string();
    ASSERT_THAT(writeTextFile(path, "#define VALUE 4\n" + std::string(value_kernel)), IsOk());
    const Shader first = Shader::loadGLSL(Shader::TypeCompute, path);
    ASSERT_THAT(writeTextFile(path, "#define VALUE 6\n" + std::string(value_kernel)), IsOk());
    const Shader second = first.reloaded();
    EXPECT_EQ(run(first), 4u);
    EXPECT_EQ(run(second), 6u);
}

}  // namespace glint::test
