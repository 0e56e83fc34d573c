#include "mesh_block.h"
#include "shader_source.h"

#include <glint/base/format_error.h>

#include <glslang/Include/intermediate.h>
#include <glslang/MachineIndependent/localintermediate.h>
#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>
#include <glslang/SPIRV/GlslangToSpv.h>
#include <spirv/unified1/spirv.hpp>

#include <algorithm>
#include <charconv>
#include <mutex>

namespace glint::shader {

namespace {

EShLanguage languageOf(ShaderStage stage) {
    switch (stage) {
        case ShaderStage::Vertex: return EShLangVertex;
        case ShaderStage::Control: return EShLangTessControl;
        case ShaderStage::Evaluate: return EShLangTessEvaluation;
        case ShaderStage::Geometry: return EShLangGeometry;
        case ShaderStage::Fragment: return EShLangFragment;
        case ShaderStage::Task: return EShLangTask;
        case ShaderStage::Mesh: return EShLangMesh;
        case ShaderStage::RayGen: return EShLangRayGen;
        case ShaderStage::RayMiss: return EShLangMiss;
        case ShaderStage::Closest: return EShLangClosestHit;
        case ShaderStage::FirstHit: return EShLangAnyHit;
        case ShaderStage::Intersection: return EShLangIntersect;
        case ShaderStage::Callable: return EShLangCallable;
        case ShaderStage::Compute:
        case ShaderStage::Count: break;
    }
    return EShLangCompute;
}

/// One line of the compiler's log, taken apart.
struct Message {
    bool is_error = false;
    uint32_t source = 0;
    uint32_t line = 0;  ///< 0 if the message has no place
    std::string text;
};

/// "ERROR: 2:7: 'x' : undeclared identifier", where 2 is the number of the source string.
std::vector<Message> parseLog(std::string_view log) {
    std::vector<Message> messages;
    while (!log.empty()) {
        const size_t end = std::min(log.find('\n'), log.size());
        std::string_view line = log.substr(0, end);
        log.remove_prefix(std::min(end + 1, log.size()));

        Message message;
        const size_t colon = line.find(": ");
        const std::string_view severity = line.substr(0, std::min(colon, line.size()));
        if (severity == "ERROR" || severity == "INTERNAL ERROR" || severity == "UNIMPLEMENTED")
            message.is_error = true;
        else if (severity != "WARNING") {
            // A message may go on in the next line.
            if (!messages.empty() && !line.empty()) messages.back().text.append("\n").append(line);
            continue;
        }
        line.remove_prefix(colon + 2);
        if (line.find("compilation errors.") != std::string_view::npos) continue;
        const char* last = line.data() + line.size();
        const auto [after_source, no_source] = std::from_chars(line.data(), last, message.source);
        if (no_source == std::errc() && after_source != last && *after_source == ':') {
            const auto [after_line, no_line] = std::from_chars(after_source + 1, last, message.line);
            if (no_line == std::errc() && after_line != last && *after_line == ':') {
                line.remove_prefix(static_cast<size_t>(after_line + 1 - line.data()));
                while (line.starts_with(' ')) line.remove_prefix(1);
            }
        }
        while (line.ends_with(' ')) line.remove_suffix(1);
        message.text = line;
        messages.push_back(std::move(message));
    }
    return messages;
}

std::string fileOf(const ShaderSource& source, const Preprocessed& text, const Message& message) {
    return message.source < text.sources.size() ? text.sources[message.source] : displayName(source);
}

void logWarnings(const ShaderSource& source, const Preprocessed& text, const std::vector<Message>& messages) {
    for (const Message& message : messages) {
        if (message.is_error) continue;
        logWarning(sourceError(source, ErrorCode::ShaderCompile, "shader.warning", message.text,
                               fileOf(source, text, message), message.line));
    }
}

/// The compiler stops at the first error of a text; what it says after that about linking follows from it.
Error firstError(const ShaderSource& source, const Preprocessed& text, const std::vector<Message>& messages) {
    const auto first =
        std::find_if(messages.begin(), messages.end(), [](const Message& message) { return message.is_error; });
    if (first == messages.end())
        return sourceError(source, ErrorCode::ShaderCompile, "shader.compile", "the compiler gave no reason");
    const char* id = first->text.find("Missing entry point") != std::string::npos ? "shader.entry" : "shader.compile";
    return sourceError(source, ErrorCode::ShaderCompile, id, first->text, fileOf(source, text, *first), first->line);
}

/// Keeps resource arrays declared without a length that way. The compiler would give one that is never indexed by a
/// variable the length that its constant indices show, so that stages sharing a declaration would disagree about it.
class KeepUnsized : public glslang::TIntermTraverser {
public:
    void visitSymbol(glslang::TIntermSymbol* symbol) override {
        glslang::TType& type = symbol->getWritableType();
        const glslang::TStorageQualifier storage = type.getQualifier().storage;
        if (type.isUnsizedArray() && (storage == glslang::EvqUniform || storage == glslang::EvqBuffer))
            type.setArrayVariablyIndexed();
    }
};

/// OpSourceExtension only repeats the #extension lines, most of which are not the user's.
void dropSourceExtensions(std::vector<uint32_t>& words) {
    size_t out = 5;
    for (size_t i = 5; i < words.size();) {
        const uint32_t length = words[i] >> 16;
        if (length == 0 || length > words.size() - i) return;
        const bool keep = (words[i] & 0xffffu) != spv::OpSourceExtension;
        for (uint32_t k = 0; keep && k < length; k++) words[out++] = words[i + k];
        i += length;
    }
    words.resize(out);
}

/// #line directives with the names of files in the place of their numbers, which do not reach SPIR-V.
std::string nameFiles(const Preprocessed& text) {
    constexpr std::string_view directive = "#line ";
    std::string result;
    for (size_t begin = 0; begin < text.text.size();) {
        const size_t end = std::min(text.text.find('\n', begin), text.text.size() - 1) + 1;
        std::string_view line = std::string_view(text.text).substr(begin, end - begin);
        begin = end;
        uint32_t number = 0, file = 0;
        const char* const last = line.data() + line.size();
        const bool starts = line.starts_with(directive);
        const auto [space, no_number] =
            std::from_chars(line.data() + (starts ? directive.size() : line.size()), last, number);
        const bool has_file = no_number == std::errc() && space != last && *space == ' ' &&
                              std::from_chars(space + 1, last, file).ec == std::errc() && file < text.sources.size();
        if (has_file && text.sources[file].find_first_of("\"\\\n") == std::string::npos)
            fmt::format_to(std::back_inserter(result), "#line {} \"{}\"\n", number, text.sources[file]);
        else
            result += line;
    }
    return result;
}

Expected<std::vector<uint32_t>> translate(const ShaderSource& source, const Preprocessed& text,
                                          glslang::EShTargetLanguageVersion target, EShMessages rules,
                                          bool with_lines = false) {
    // Never finalised: other threads may be compiling while static objects are destroyed.
    static std::once_flag initialized;
    std::call_once(initialized, [] { glslang::InitializeProcess(); });

    const EShLanguage language = languageOf(source.stage);
    const std::string named = with_lines ? nameFiles(text) : std::string();
    const std::string& code = with_lines ? named : text.text;
    const char* string = code.data();
    const int length = static_cast<int>(code.size());
    const std::string file_name = displayName(source);
    const char* const file = file_name.c_str();
    glslang::TShader shader(language);
    if (with_lines) {
        shader.setStringsWithLengthsAndNames(&string, &length, &file, 1);
        shader.setPreamble("#extension GL_GOOGLE_cpp_style_line_directive : enable\n");
    } else {
        shader.setStringsWithLengths(&string, &length, 1);
    }
    shader.setEnvInput(glslang::EShSourceGlsl, language, glslang::EShClientVulkan, 100);
    shader.setEnvClient(glslang::EShClientVulkan, glslang::EShTargetVulkan_1_3);
    shader.setEnvTarget(glslang::EShTargetSpv, target);
    shader.setEntryPoint(source.entry.c_str());
    shader.setSourceEntryPoint(source.entry.c_str());
    const bool parsed = shader.parse(GetDefaultResources(), 460, false, rules);
    std::vector<Message> messages = parseLog(shader.getInfoLog());
    logWarnings(source, text, messages);
    if (!parsed) return unexpected(firstError(source, text, messages));

    KeepUnsized keep_unsized;
    shader.getIntermediate()->getTreeRoot()->traverse(&keep_unsized);
    glslang::TProgram program;
    program.addShader(&shader);
    const bool linked = program.link(rules);
    messages = parseLog(program.getInfoLog());
    logWarnings(source, text, messages);
    if (!linked) return unexpected(firstError(source, text, messages));

    std::vector<uint32_t> words;
    spv::SpvBuildLogger logger;
    glslang::SpvOptions options;
    options.disableOptimizer = true;
    options.generateDebugInfo = with_lines;
    glslang::GlslangToSpv(*program.getIntermediate(language), words, &logger, &options);
    if (words.size() < 5)
        return unexpected(sourceError(source, ErrorCode::ShaderCompile, "shader.compile",
                                      fmt::format("no SPIR-V was made: {}", logger.getAllMessages())));
    dropSourceExtensions(words);
    if (source.stage == ShaderStage::Mesh) dropUnusedShadingRate(words);
    return words;
}

}  // namespace

Expected<std::vector<uint32_t>> compile(const ShaderSource& source, const Preprocessed& text) {
    return translate(source, text, glslang::EShTargetSpv_1_6,
                     static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules));
}

Expected<std::vector<uint32_t>> compileWithLines(const ShaderSource& source, const Preprocessed& text) {
    return translate(source, text, glslang::EShTargetSpv_1_6,
                     static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules), true);
}

Expected<std::vector<uint32_t>> compileLibrary(const ShaderSource& source, const Preprocessed& text, uint32_t version) {
    return translate(source, text, static_cast<glslang::EShTargetLanguageVersion>(version),
                     static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules | EShMsgKeepUncalled));
}

}  // namespace glint::shader
