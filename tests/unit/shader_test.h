#pragma once

// What the tests of the shader steps share.

#include "support/files.h"
#include "support/matchers.h"

#include <glint/base/file.h>
#include <glint/shader/shader_compiler.h>

#include <fmt/format.h>

#include <algorithm>

namespace glint::test {

inline ShaderSource glsl(std::string_view text, ShaderStage stage = ShaderStage::Compute,
                         std::string_view macros = {}) {
    ShaderSource source;
    source.stage = stage;
    source.name = "test.shader";
    source.text = text;
    source.macros = macros;
    return source;
}

inline ShaderSource assembly(std::string_view text, ShaderStage stage = ShaderStage::Compute) {
    ShaderSource source = glsl(text, stage);
    source.language = ShaderSource::Language::Assembly;
    source.name = "test.spvasm";
    return source;
}

inline ShaderSource binary(std::vector<uint32_t> words, ShaderStage stage = ShaderStage::Compute) {
    ShaderSource source;
    source.language = ShaderSource::Language::SPIRV;
    source.stage = stage;
    source.name = "test.spv";
    source.words = std::move(words);
    return source;
}

/// Instructions of this opcode in a module.
inline size_t countInstructions(std::span<const uint32_t> words, uint32_t opcode, uint32_t operand = ~0u,
                                size_t operand_index = 2) {
    size_t count = 0;
    for (size_t i = 5; i < words.size() && (words[i] >> 16) != 0; i += words[i] >> 16)
        if ((words[i] & 0xffff) == opcode && (operand == ~0u || words[i + operand_index] == operand)) count++;
    return count;
}

/// A test that finds no cache, no global macro and no memory include, and leaves none.
class ShaderTest : public ::testing::Test {
protected:
    ShaderTest() { setShaderCache({}); }
    ~ShaderTest() override {
        clearShaderMacros();
        for (const std::string& name : includes_) setShaderInclude(name, "");
        setShaderCache({});
    }

    void include(const std::string& name, std::string_view text) {
        setShaderInclude(name, text);
        includes_.push_back(name);
    }

    /// The resource of this name in a shader's reflection.
    static const ShaderResource* find(const Reflection& reflection, std::string_view name) {
        for (const ShaderResource& resource : reflection.resources)
            if (resource.name == name) return &resource;
        return nullptr;
    }

private:
    std::vector<std::string> includes_;
};

}  // namespace glint::test
