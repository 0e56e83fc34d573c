#include "shader_cache.h"
#include "shader_source.h"

#include <glint/base/format_error.h>

#include <glslang/Public/ShaderLang.h>
#include <spirv-tools/libspirv.h>

namespace glint {

namespace {

/// Raised with any change of what the steps make of the same text, or of what an entry holds.
constexpr uint32_t cache_version = 5;

}  // namespace

Hash shader::toolHash() {
    static const Hash hash = [] {
        const glslang::Version version = glslang::GetVersion();
        return hashText(fmt::format("{} glslang {}.{}.{} {}", cache_version, version.major, version.minor,
                                    version.patch, spvSoftwareVersionDetailsString()));
    }();
    return hash;
}

namespace {

/// Of everything that decides the result: the texts hold the includes and the macros.
Hash makeKey(const ShaderSource& source, std::string_view text, std::span<const uint32_t> words,
             std::string_view library) {
    const std::array<uint8_t, 3> kind = {static_cast<uint8_t>(source.language), static_cast<uint8_t>(source.stage),
                                         source.optimize};
    Hash key = hashBytes(kind.data(), kind.size(), shader::toolHash());
    key = hashText(source.entry, key);
    key = hashText(text, key);
    if (!library.empty()) key = hashText(fmt::format("{} {}", source.tracing.set, library), key);
    return hashBytes(words.data(), words.size_bytes(), key);
}

/// The steps after the front end, for a module in this machine's byte order.
Expected<CompiledShader> finish(const ShaderSource& source, std::vector<uint32_t> words) {
    if (Status status = shader::validate(source, words); !status) return unexpected(status.error());
    Expected<Reflection> reflection = shader::reflectValid(words, source.stage, source.entry);
    if (!reflection)
        return unexpected(
            shader::sourceError(source, ErrorCode::ShaderCompile, "shader.reflect", reflection.error().message()));
    if (!source.tracing.library.empty()) {
        Expected<std::vector<uint32_t>> rewritten = shader::rewriteRayQueries(source, words, *reflection);
        if (!rewritten) return unexpected(rewritten.error());
        words = std::move(*rewritten);
    }
    CompiledShader result;
    result.reflection = std::move(*reflection);
    Expected<std::vector<uint32_t>> optimized;
    if (source.optimize) optimized = shader::optimizeValid(source, words);
    if (!optimized) shader::logWarning(optimized.error());
    result.words = source.optimize && optimized ? std::move(*optimized) : std::move(words);
    return result;
}

}  // namespace

Expected<CompiledShader> compileShader(const ShaderSource& source) {
    shader::Preprocessed text;
    std::vector<uint32_t> words;
    if (source.language == ShaderSource::Language::GLSL) {
        Expected<shader::Preprocessed> preprocessed = shader::preprocess(source);
        if (!preprocessed) return unexpected(preprocessed.error());
        text = std::move(*preprocessed);
    } else {
        if (source.language == ShaderSource::Language::SPIRV)
            words = shader::nativeWords(source.words);
        else
            text.text = source.text;
        if (FileStamp stamp = stampFile(source.name); stamp.time >= 0) {
            text.files.push_back(stamp.path);
            text.stamps.push_back(std::move(stamp));
        }
    }

    shader::Preprocessed library;
    if (!source.tracing.library.empty()) {
        Expected<shader::Preprocessed> preprocessed = shader::preprocessLibrary(source.tracing);
        if (!preprocessed) return unexpected(preprocessed.error());
        library = std::move(*preprocessed);
    }
    const Hash key = makeKey(source, text.text, words, library.text);
    std::optional<CompiledShader> cached = shader::loadFromCache(key);
    if (!cached) {
        if (source.language != ShaderSource::Language::SPIRV) {
            Expected<std::vector<uint32_t>> compiled = source.language == ShaderSource::Language::GLSL
                                                           ? shader::compile(source, text)
                                                           : shader::assemble(source);
            if (!compiled) return unexpected(compiled.error());
            words = std::move(*compiled);
        }
        Expected<CompiledShader> finished = finish(source, std::move(words));
        if (!finished) return finished;
        shader::storeInCache(key, *finished);
        cached = std::move(*finished);
    }
    cached->files = std::move(text.files);
    cached->stamps = std::move(text.stamps);
    return std::move(*cached);
}

}  // namespace glint
