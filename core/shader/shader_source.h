#pragma once

// For sources only: what the shader steps share.

#include <glint/shader/shader_compiler.h>

#include <memory>
#include <optional>
#include <utility>

namespace glint::shader {

struct Macro {
    std::string name;
    std::string value;
};

/// The global macros and, before them in rank, the source's own. Error: "shader.macro".
Expected<std::vector<Macro>> collectMacros(const ShaderSource& source);

/// "A=1; B": how messages give a set of macros.
std::string describeMacros(const std::vector<Macro>& macros);

/// The name a source goes by in messages.
std::string displayName(const ShaderSource& source);

/// An error of one source, in its own file unless `file` says otherwise, with its macros.
Error sourceError(const ShaderSource& source, ErrorCode code, const char* id, std::string message,
                  std::string file = {}, uint32_t line = 0);

/// Sends an error that stops nothing to the log.
void logWarning(const Error& error);

/// A file that #include has found.
struct Included {
    std::string name;      ///< for messages, and what its own includes are relative to
    std::string identity;  ///< equal for the same file however it was reached
    std::shared_ptr<const std::string> text;
    enum class Origin : uint8_t { Memory, Disk, Embedded } origin = Origin::Disk;
    FileStamp stamp;  ///< on the disk only
};

/// The identity of a file on the disk.
std::string diskIdentity(const std::filesystem::path& path);

/// Finds what #include "name" (or <name>) means in the file `from`. Nothing if there is no such file; an error if
/// there is one that cannot be read.
Expected<std::optional<Included>> findInclude(const ShaderSource& source, std::string_view name, bool quoted,
                                              const Included& from);

/// The #extension lines a stage needs for everything that GLSL for Vulkan 1.3 offers there.
std::string extensionLines(ShaderStage stage, bool with_explicit_types);

/// Whether types of explicit width other than 64-bit integers (float16_t, u8vec4, ...) occur in the text.
bool usesExplicitTypes(std::string_view text);

/// SPIR-V's number of a stage.
uint32_t executionModel(ShaderStage stage);

/// Words in this machine's byte order: SPIR-V may come in either.
std::vector<uint32_t> nativeWords(std::span<const uint32_t> words);

/// GLSL of the SDK's own to SPIR-V of this version (0x10300 or 0x10400) with all its functions, called or not.
Expected<std::vector<uint32_t>> compileLibrary(const ShaderSource& source, const Preprocessed& text, uint32_t version);

/// The text of the library that a source is to be rewritten for, as for one query.
Expected<Preprocessed> preprocessLibrary(const TracingRewrite& tracing);

/// As compile(), with the line of every instruction: for messages about what comes later.
Expected<std::vector<uint32_t>> compileWithLines(const ShaderSource& source, const Preprocessed& text);

/// `validate` without the check of the stage; what is wrong with the words, or nothing. `instruction` is the number of
/// the instruction that it concerns, counted from 1, 0 if it is none.
std::optional<std::string> findFault(std::span<const uint32_t> words, uint64_t* instruction = nullptr);

/// The entry points of a module in their order; names point into the words.
struct EntryPoint {
    uint32_t model = 0;  ///< SPIR-V's number of the stage
    std::string_view name;
};
std::vector<EntryPoint> entryPoints(std::span<const uint32_t> words);

/// Whether the module has the entry point that the source asks for. Errors: "shader.stage", "shader.entry".
Status checkEntry(const ShaderSource& source, std::span<const uint32_t> words);

/// `optimize` for words that have passed `findFault`.
Expected<std::vector<uint32_t>> optimizeValid(const ShaderSource& source, std::span<const uint32_t> words);

/// A valid module in which entry points call no functions, but for those that cannot be made part of their callers.
/// Error: "shader.tracing_internal".
Expected<std::vector<uint32_t>> inlineFunctions(std::span<const uint32_t> words);

/// A valid module with these values (ids and bits) of its specialisation constants, which are constants as any others
/// afterwards. Error: "shader.tracing_internal".
Expected<std::vector<uint32_t>> fixConstants(std::span<const uint32_t> words,
                                             std::span<const std::pair<uint32_t, uint32_t>> values);

/// `reflect` for words that have passed `findFault`.
Expected<Reflection> reflectValid(std::span<const uint32_t> words, ShaderStage stage, std::string_view entry);

}  // namespace glint::shader
