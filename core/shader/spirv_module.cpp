#include "spirv_module.h"

#include <glint/base/format_error.h>

#include <spirv-tools/libspirv.h>
#include <spirv/unified1/spirv.hpp>

#include <algorithm>
#include <cstring>
#include <memory>

namespace glint::shader {

namespace {

bool isId(spv_operand_type_t type) {
    return type == SPV_OPERAND_TYPE_ID || type == SPV_OPERAND_TYPE_TYPE_ID || type == SPV_OPERAND_TYPE_RESULT_ID ||
           type == SPV_OPERAND_TYPE_MEMORY_SEMANTICS_ID || type == SPV_OPERAND_TYPE_SCOPE_ID;
}

Instructions& partOf(SpirvModule& module, uint16_t opcode) {
    switch (opcode) {
        case spv::OpCapability: return module.capabilities;
        case spv::OpExtension: return module.extensions;
        case spv::OpExtInstImport: return module.imports;
        case spv::OpMemoryModel: return module.memory_model;
        case spv::OpEntryPoint: return module.entry_points;
        case spv::OpExecutionMode:
        case spv::OpExecutionModeId: return module.modes;
        case spv::OpString:
        case spv::OpSource:
        case spv::OpSourceContinued:
        case spv::OpSourceExtension: return module.sources;
        case spv::OpName:
        case spv::OpMemberName: return module.names;
        case spv::OpModuleProcessed: return module.processes;
        case spv::OpDecorate:
        case spv::OpMemberDecorate:
        case spv::OpDecorationGroup:
        case spv::OpGroupDecorate:
        case spv::OpGroupMemberDecorate:
        case spv::OpDecorateId:
        case spv::OpDecorateString:
        case spv::OpMemberDecorateString: return module.decorations;
        default: return module.globals;
    }
}

struct Parser {
    SpirvModule module;
    bool in_function = false;

    void header(uint32_t version, uint32_t bound) {
        module.version = version;
        module.bound = bound;
    }

    void add(const spv_parsed_instruction_t& parsed) {
        Instruction made;
        made.opcode = parsed.opcode;
        made.has_type = parsed.type_id != 0;
        made.has_result = parsed.result_id != 0;
        made.words.assign(parsed.words, parsed.words + parsed.num_words);
        for (const spv_parsed_operand_t& operand : std::span(parsed.operands, parsed.num_operands))
            if (isId(operand.type)) made.ids.push_back(operand.offset);
        if (made.opcode == spv::OpFunction) {
            in_function = true;
            module.functions.emplace_back();
        }
        Instructions& part = in_function ? module.functions.back() : partOf(module, made.opcode);
        if (made.opcode == spv::OpFunctionEnd) in_function = false;
        part.push_back(std::move(made));
    }
};

void append(std::vector<uint32_t>& words, const Instructions& part) {
    for (const Instruction& instruction : part) {
        words.push_back(static_cast<uint32_t>(instruction.words.size()) << 16 | instruction.opcode);
        words.insert(words.end(), instruction.words.begin() + 1, instruction.words.end());
    }
}

}  // namespace

Instruction::Instruction(uint32_t code, uint32_t type, uint32_t result, std::span<const uint32_t> operands,
                         size_t literals_from)
    : opcode(static_cast<uint16_t>(code)), has_type(type != 0), has_result(result != 0) {
    words.push_back(0);
    if (has_type) words.push_back(type);
    if (has_result) words.push_back(result);
    const size_t first = words.size();
    words.insert(words.end(), operands.begin(), operands.end());
    for (size_t i = 1; i < words.size() && (i < first || i - first < literals_from); i++)
        ids.push_back(static_cast<uint16_t>(i));
}

std::string_view Instruction::text(size_t operand) const {
    const std::span<const uint32_t> rest = operands().subspan(std::min(operand, operands().size()));
    const char* begin = reinterpret_cast<const char*>(rest.data());
    return {begin, ::strnlen(begin, rest.size_bytes())};
}

Expected<SpirvModule> SpirvModule::parse(std::span<const uint32_t> words) {
    const std::unique_ptr<spv_context_t, void (*)(spv_context)> context(spvContextCreate(SPV_ENV_VULKAN_1_3),
                                                                        spvContextDestroy);
    Parser parser;
    const spv_result_t result = spvBinaryParse(
        context.get(), &parser, words.data(), words.size(),
        [](void* self, spv_endianness_t, uint32_t, uint32_t made_for, uint32_t, uint32_t ids, uint32_t) {
            static_cast<Parser*>(self)->header(made_for, ids);
            return SPV_SUCCESS;
        },
        [](void* self, const spv_parsed_instruction_t* parsed) {
            static_cast<Parser*>(self)->add(*parsed);
            return SPV_SUCCESS;
        },
        nullptr);
    if (result != SPV_SUCCESS)
        return unexpected(
            makeError(ErrorCode::Internal, "shader.tracing_internal", "the words are no SPIR-V ({})", int(result)));
    return std::move(parser.module);
}

std::vector<uint32_t> SpirvModule::words() const {
    std::vector<uint32_t> result = {spv::MagicNumber, version, 0, bound, 0};
    for (const auto part : parts) append(result, this->*part);
    for (const Instructions& function : functions) append(result, function);
    return result;
}

}  // namespace glint::shader
