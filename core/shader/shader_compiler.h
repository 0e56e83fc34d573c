#pragma once

#include <glint/base/expected.h>
#include <glint/base/status.h>
#include <glint/shader/reflection.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace glint {

/// What a shader is made from: GLSL, SPIR-V assembly or SPIR-V words.
struct ShaderSource {
    enum class Language : uint8_t { GLSL, Assembly, SPIRV };
    Language language = Language::GLSL;
    ShaderStage stage = ShaderStage::Compute;
    std::string name;                          ///< file name, for messages
    std::string text;                          ///< GLSL or assembly
    std::vector<uint32_t> words;               ///< SPIR-V
    std::string macros;                        ///< "RAYGEN_SHADER=1; GROUP_SIZE=64"
    std::vector<std::filesystem::path> include_paths;  ///< beside the folder of the including file and the SDK's own
    std::string entry = "main";
};

/// A shader that has passed all steps.
struct CompiledShader {
    std::vector<uint32_t> words;   ///< optimised SPIR-V, names kept
    Reflection reflection;         ///< read before the optimiser removed anything
    std::vector<std::filesystem::path> files;  ///< every file that went in, for reloading
    bool from_cache = false;
};

/// The steps, one by one; compileShader runs them all. Pure functions; safe to call from several threads.
/// All errors name the file, the line and the macros: ids "shader.empty", "shader.macro", "shader.include",
/// "shader.preprocess", "shader.compile", "shader.assemble", "shader.validate", "shader.optimize", "shader.reflect",
/// "shader.stage" (SPIR-V for another stage), "shader.entry" (no such entry point).
namespace shader {

/// Text after #include and macros, with #version and the extensions a stage needs; carries #line directives back to
/// the user's files.
struct Preprocessed {
    std::string text;
    std::vector<std::string> sources;          ///< name of source string i in #line directives
    std::vector<std::filesystem::path> files;
};

Expected<Preprocessed> preprocess(const ShaderSource& source);
Expected<std::vector<uint32_t>> compile(const ShaderSource& source, const Preprocessed& text);
Expected<std::vector<uint32_t>> assemble(const ShaderSource& source);
Status validate(const ShaderSource& source, std::span<const uint32_t> words);
Expected<std::vector<uint32_t>> optimize(const ShaderSource& source, std::span<const uint32_t> words);
std::string disassemble(std::span<const uint32_t> words);

}  // namespace shader

/// Runs all steps, or takes the result from the disk cache.
Expected<CompiledShader> compileShader(const ShaderSource& source);

/// Global macros, defined for every shader compiled from now on. An empty value defines the name alone.
void setShaderMacro(std::string_view name, std::string_view value);
void removeShaderMacro(std::string_view name);
void clearShaderMacros();

/// A file that #include finds by this name before the disk is asked. An empty text removes it.
void setShaderInclude(std::string_view name, std::string_view text);

/// The disk cache of compiled shaders: a folder bounded in bytes (least recently used files go first), safe under
/// concurrent processes; a damaged entry is recompiled. The default is $GLINT_CACHE, else $XDG_CACHE_HOME/glint, else
/// ~/.cache/glint, with 256 MiB. An empty folder turns it off.
void setShaderCache(const std::filesystem::path& folder, uint64_t limit = 256ull << 20);

}  // namespace glint
