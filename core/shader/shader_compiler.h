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

/// By whom a shader's ray queries are answered: by the driver, or by a traversal library of Glint's own, for which the
/// module is rewritten (docs/shaders.md, "Ray queries in software").
struct TracingRewrite {
    std::string library;  ///< the library, as #include finds it ("glint/tracing/query.h"); empty: the driver
    std::string macros;   ///< for the library alone, such as the form its nodes are read in
    uint32_t set = 7;  ///< the library's own descriptor set, above those of the shader; the same for a program's stages
};

/// What a shader is made from: GLSL, SPIR-V assembly or SPIR-V words.
struct ShaderSource {
    enum class Language : uint8_t { GLSL, Assembly, SPIRV };
    Language language = Language::GLSL;
    ShaderStage stage = ShaderStage::Compute;
    std::string name;             ///< file name, for messages and for #include relative to it
    std::string text;             ///< GLSL or assembly
    std::vector<uint32_t> words;  ///< SPIR-V
    std::string macros;           ///< "RAYGEN_SHADER=1; GROUP_SIZE=64"; a name alone is defined as empty
    std::vector<std::filesystem::path> include_paths;  ///< beside the folder of the including file and the SDK's own
    std::string entry = "main";
    TracingRewrite tracing;
    bool optimize = true;  ///< by SPIRV-Tools; a module made of optimised ones is left to the driver
};

/// When a file was last written and how long it is: enough to notice a change without reading it.
struct FileStamp {
    std::filesystem::path path;
    int64_t time = -1;  ///< nanoseconds, -1 if there is no such file
    uint64_t size = 0;
    bool operator==(const FileStamp&) const = default;
};

/// Looks at one file now.
FileStamp stampFile(const std::filesystem::path& path);

/// True if any of the files is not what its stamp says: changed, gone or come back. One system call a file.
bool filesChanged(std::span<const FileStamp> stamps);

/// A shader that has passed all steps.
struct CompiledShader {
    std::vector<uint32_t> words;               ///< SPIR-V, optimised unless asked otherwise, names kept
    Reflection reflection;                     ///< read before the optimiser removed anything
    std::vector<std::filesystem::path> files;  ///< every file that went in, for reloading
    std::vector<FileStamp> stamps;             ///< the same files as they were when read, for filesChanged
    bool from_cache = false;
};

/// The steps, one by one; compileShader runs them all. Pure functions; safe to call from several threads.
/// All errors name the file, the line and the macros: ids "shader.empty", "shader.macro", "shader.include",
/// "shader.preprocess", "shader.compile", "shader.assemble", "shader.validate", "shader.optimize", "shader.reflect",
/// "shader.stage" (SPIR-V for another stage), "shader.entry" (no such entry point), and those of rewriteRayQueries.
/// Bytes that are no SPIR-V are errors in every step, never a crash.
namespace shader {

/// Text with includes in place, macros defined before it, and #version and the extensions a stage needs where absent;
/// carries #line directives back to the user's files.
struct Preprocessed {
    std::string text;
    std::vector<std::string> sources;          ///< name of source string i in #line directives
    std::vector<std::filesystem::path> files;  ///< the source's own file, if it is one, and all includes from the disk
    std::vector<FileStamp> stamps;             ///< of `files`, taken before they were read
};

/// Puts #include in place and defines the global and the source's macros. #include "x" looks for memory includes
/// (setShaderInclude), beside the including file, in include_paths and in the SDK's own shaders ("glint/..."), in this
/// order; #include <x> leaves out the including file's folder. Includes nest 32 deep. Conditions are followed, so that
/// an include in a branch not taken need not exist; one that depends on a macro of the compiler's own (GL_EXT_...) is
/// left to the compiler.
Expected<Preprocessed> preprocess(const ShaderSource& source);
/// GLSL to SPIR-V 1.6 for Vulkan 1.3, unoptimised, with names. Warnings go to the log as "shader.warning".
Expected<std::vector<uint32_t>> compile(const ShaderSource& source, const Preprocessed& text);
/// SPIR-V assembly (`source.text`) to words.
Expected<std::vector<uint32_t>> assemble(const ShaderSource& source);
/// Khronos' rules for Vulkan 1.3, with scalar block layout, and that there is an entry point for the source's stage.
Status validate(const ShaderSource& source, std::span<const uint32_t> words);
/// Makes a valid module's ray queries calls of the library that `source.tracing` names, which has one. `reflection` is
/// that of the module: it learns what became of the acceleration structures, and what the library declares.
/// A module without queries and structures comes back as it is.
/// Errors: "shader.tracing_stage" (a stage of ray-tracing pipelines), "shader.tracing_set" (a resource at or above
/// `source.tracing.set`), "shader.tracing_unsupported" (what the software engine cannot do, named), and
/// "shader.tracing_internal" (a fault of the library or of the rewriting, with the module that came of it).
Expected<std::vector<uint32_t>> rewriteRayQueries(const ShaderSource& source, std::span<const uint32_t> words,
                                                  Reflection& reflection);
/// Optimises for speed; names stay, `precise` is respected, interfaces keep their locations and bindings.
Expected<std::vector<uint32_t>> optimize(const ShaderSource& source, std::span<const uint32_t> words);
/// SPIR-V assembly with friendly names; empty if the words are no SPIR-V.
std::string disassemble(std::span<const uint32_t> words);

}  // namespace shader

/// Runs all steps, or takes the result from the disk cache: then neither compiler, validator nor reflection is started.
/// Safe to call from several threads and processes. Should the optimiser fail on a valid module, that is logged as
/// "shader.optimize" and the module stays as it was.
Expected<CompiledShader> compileShader(const ShaderSource& source);

/// Global macros, defined for every shader compiled from now on; a source's own macro of the same name goes before. An
/// empty value defines the name alone. A malformed name is reported by the next compilation. From any thread.
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
