#include "shader_source.h"

#include <glint/base/format_error.h>

#include <spirv-tools/libspirv.hpp>
#include <spirv-tools/optimizer.hpp>
#include <spirv/unified1/spirv.hpp>

#include <algorithm>
#include <cstring>
#include <unordered_map>

namespace glint::shader {

namespace {

constexpr spv_target_env environment = SPV_ENV_VULKAN_1_3;
constexpr size_t header_words = 5;

spv::ExecutionModel modelOf(ShaderStage stage) {
    switch (stage) {
        case ShaderStage::Vertex: return spv::ExecutionModelVertex;
        case ShaderStage::Control: return spv::ExecutionModelTessellationControl;
        case ShaderStage::Evaluate: return spv::ExecutionModelTessellationEvaluation;
        case ShaderStage::Geometry: return spv::ExecutionModelGeometry;
        case ShaderStage::Fragment: return spv::ExecutionModelFragment;
        case ShaderStage::Compute: return spv::ExecutionModelGLCompute;
        case ShaderStage::Task: return spv::ExecutionModelTaskEXT;
        case ShaderStage::Mesh: return spv::ExecutionModelMeshEXT;
        case ShaderStage::RayGen: return spv::ExecutionModelRayGenerationKHR;
        case ShaderStage::RayMiss: return spv::ExecutionModelMissKHR;
        case ShaderStage::Closest: return spv::ExecutionModelClosestHitKHR;
        case ShaderStage::FirstHit: return spv::ExecutionModelAnyHitKHR;
        case ShaderStage::Intersection: return spv::ExecutionModelIntersectionKHR;
        case ShaderStage::Callable: return spv::ExecutionModelCallableKHR;
        case ShaderStage::Count: break;
    }
    return spv::ExecutionModelMax;
}

/// Keeps the first thing that SPIRV-Tools complains about.
struct Complaint {
    std::string text;
    spv_position_t position = {};

    spvtools::MessageConsumer consumer() {
        return [this](spv_message_level_t level, const char*, const spv_position_t& where, const char* message) {
            if (level > SPV_MSG_ERROR || !text.empty()) return;
            text = message;
            position = where;
        };
    }
};

/// The line of the text on which the module's instruction of this number, counted from 1, begins; 0 if there is none.
uint32_t lineOfInstruction(std::string_view text, uint64_t instruction) {
    uint64_t count = 0;
    uint32_t line = 1;
    for (size_t begin = 0; begin < text.size(); line++) {
        const size_t end = std::min(text.find('\n', begin), text.size());
        std::string_view content = text.substr(begin, end - begin);
        begin = end + 1;
        content.remove_prefix(std::min(content.find_first_not_of(" \t\r"), content.size()));
        // An instruction may go on in the next line; it begins with its opcode or with the id that it defines.
        const bool starts =
            content.starts_with("Op") || (content.starts_with('%') && content.find('=') != content.npos);
        if (starts && ++count == instruction) return line;
    }
    return 0;
}

}  // namespace

uint32_t executionModel(ShaderStage stage) { return static_cast<uint32_t>(modelOf(stage)); }

std::vector<uint32_t> nativeWords(std::span<const uint32_t> words) {
    std::vector<uint32_t> result(words.begin(), words.end());
    if (!result.empty() && result[0] == __builtin_bswap32(spv::MagicNumber))
        for (uint32_t& word : result) word = __builtin_bswap32(word);
    return result;
}

std::optional<std::string> findFault(std::span<const uint32_t> words, uint64_t* instruction) {
    if (words.size() < header_words) return fmt::format("{} words are too few for a SPIR-V module", words.size());
    if (words[0] != spv::MagicNumber)
        return fmt::format("the first word is {:#010x}, SPIR-V begins with {:#010x}", words[0], spv::MagicNumber + 0u);
    Complaint complaint;
    spvtools::SpirvTools tools(environment);
    tools.SetMessageConsumer(complaint.consumer());
    spvtools::ValidatorOptions options;
    options.SetScalarBlockLayout(true);
    options.SetWorkgroupScalarBlockLayout(true);
    // Names take two thirds of the time, and only a complaint has use for them.
    options.SetFriendlyNames(false);
    if (tools.Validate(words.data(), words.size(), options)) return {};
    complaint = {};
    options.SetFriendlyNames(true);
    if (tools.Validate(words.data(), words.size(), options)) return {};
    if (instruction) *instruction = complaint.position.index;
    while (!complaint.text.empty() && (complaint.text.back() == ' ' || complaint.text.back() == '\n'))
        complaint.text.pop_back();
    return complaint.text.empty() ? "the module is not valid" : complaint.text;
}

std::vector<EntryPoint> entryPoints(std::span<const uint32_t> words) {
    std::vector<EntryPoint> points;
    for (size_t i = header_words; i < words.size();) {
        const size_t length = words[i] >> 16;
        if (length == 0 || length > words.size() - i) break;
        if ((words[i] & 0xffffu) == spv::OpEntryPoint && length > 3) {
            const char* text = reinterpret_cast<const char*>(&words[i + 3]);
            points.push_back({words[i + 1], {text, ::strnlen(text, (length - 3) * sizeof(uint32_t))}});
        }
        i += length;
    }
    return points;
}

Status checkEntry(const ShaderSource& source, std::span<const uint32_t> words) {
    const uint32_t model = executionModel(source.stage);
    bool named = false;
    std::string others;
    for (const EntryPoint& point : entryPoints(words)) {
        if (point.name == source.entry && point.model == model) return {};
        named = named || point.name == source.entry;
        others += fmt::format("{}'{}'", others.empty() ? "" : ", ", point.name);
    }
    if (named)
        return sourceError(
            source, ErrorCode::ShaderCompile, "shader.stage",
            fmt::format("entry point '{}' is not for the {} stage", source.entry, toString(source.stage)));
    return sourceError(
        source, ErrorCode::ShaderCompile, "shader.entry",
        fmt::format("there is no entry point '{}', only {}", source.entry, others.empty() ? "none" : others));
}

Expected<std::vector<uint32_t>> assemble(const ShaderSource& source) {
    if (source.text.find_first_not_of(" \t\r\n") == std::string::npos)
        return unexpected(sourceError(source, ErrorCode::ShaderCompile, "shader.empty", "the shader has no text"));
    Complaint complaint;
    spvtools::SpirvTools tools(environment);
    tools.SetMessageConsumer(complaint.consumer());
    std::vector<uint32_t> words;
    if (tools.Assemble(source.text.data(), source.text.size(), &words, spvtools::SpirvTools::kDefaultAssembleOption))
        return words;
    return unexpected(sourceError(source, ErrorCode::ShaderCompile, "shader.assemble", std::move(complaint.text), {},
                                  static_cast<uint32_t>(complaint.position.line) + 1));
}

Status validate(const ShaderSource& source, std::span<const uint32_t> words) {
    if (words.empty()) return sourceError(source, ErrorCode::ShaderCompile, "shader.empty", "the module has no words");
    uint64_t instruction = 0;
    std::optional<std::string> fault = findFault(words, &instruction);
    if (!fault) return checkEntry(source, words);
    const bool has_lines = source.language == ShaderSource::Language::Assembly;
    return sourceError(source, ErrorCode::ShaderCompile, "shader.validate", std::move(*fault), {},
                       has_lines ? lineOfInstruction(source.text, instruction) : 0);
}

Expected<std::vector<uint32_t>> optimizeValid(const ShaderSource& source, std::span<const uint32_t> words) {
    Complaint complaint;
    spvtools::Optimizer optimizer(environment);
    optimizer.SetMessageConsumer(complaint.consumer());
    optimizer.RegisterPerformancePasses();
    spvtools::OptimizerOptions options;
    options.set_run_validator(false);
    std::vector<uint32_t> result;
    std::optional<std::string> fault;
    if (!optimizer.Run(words.data(), words.size(), &result, options))
        fault = complaint.text.empty() ? "the optimiser failed" : complaint.text;
    else if ((fault = findFault(result)))
        fault = "the optimised module is not valid: " + *fault;
    if (fault) return unexpected(sourceError(source, ErrorCode::ShaderCompile, "shader.optimize", std::move(*fault)));
    return result;
}

Expected<std::vector<uint32_t>> optimize(const ShaderSource& source, std::span<const uint32_t> words) {
    // The optimiser trusts what it gets.
    if (std::optional<std::string> fault = findFault(words))
        return unexpected(sourceError(source, ErrorCode::ShaderCompile, "shader.optimize", std::move(*fault)));
    return optimizeValid(source, words);
}

Expected<std::vector<uint32_t>> fixConstants(std::span<const uint32_t> words,
                                             std::span<const std::pair<uint32_t, uint32_t>> values) {
    std::unordered_map<uint32_t, std::vector<uint32_t>> bits;
    for (const auto& [id, value] : values) bits[id] = {value};
    Complaint complaint;
    spvtools::Optimizer optimizer(environment);
    optimizer.SetMessageConsumer(complaint.consumer());
    optimizer.RegisterPass(spvtools::CreateSetSpecConstantDefaultValuePass(bits));
    optimizer.RegisterPass(spvtools::CreateFreezeSpecConstantValuePass());
    optimizer.RegisterPass(spvtools::CreateFoldSpecConstantOpAndCompositePass());
    spvtools::OptimizerOptions options;
    options.set_run_validator(false);
    std::vector<uint32_t> result;
    if (optimizer.Run(words.data(), words.size(), &result, options)) return result;
    return unexpected(
        makeError(ErrorCode::Internal, "shader.tracing_internal", "constants cannot be fixed: {}", complaint.text));
}

Expected<std::vector<uint32_t>> inlineFunctions(std::span<const uint32_t> words) {
    Complaint complaint;
    spvtools::Optimizer optimizer(environment);
    optimizer.SetMessageConsumer(complaint.consumer());
    optimizer.RegisterPass(spvtools::CreateMergeReturnPass());
    optimizer.RegisterPass(spvtools::CreateInlineExhaustivePass());
    optimizer.RegisterPass(spvtools::CreateEliminateDeadFunctionsPass());
    spvtools::OptimizerOptions options;
    options.set_run_validator(false);
    std::vector<uint32_t> result;
    if (optimizer.Run(words.data(), words.size(), &result, options)) return result;
    return unexpected(makeError(ErrorCode::Internal, "shader.tracing_internal",
                                "functions cannot be made part of their "
                                "callers: {}",
                                complaint.text));
}

std::string disassemble(std::span<const uint32_t> words) {
    const std::vector<uint32_t> native = nativeWords(words);
    spvtools::SpirvTools tools(environment);
    tools.SetMessageConsumer([](spv_message_level_t, const char*, const spv_position_t&, const char*) {});
    std::string text;
    const uint32_t options = SPV_BINARY_TO_TEXT_OPTION_FRIENDLY_NAMES | SPV_BINARY_TO_TEXT_OPTION_INDENT |
                             SPV_BINARY_TO_TEXT_OPTION_NO_HEADER;
    if (native.empty() || !tools.Disassemble(native.data(), native.size(), &text, options)) return {};
    return text;
}

}  // namespace glint::shader
