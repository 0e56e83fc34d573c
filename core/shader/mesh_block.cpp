#include "mesh_block.h"

#include "spirv_module.h"

#include <spirv/unified1/spirv.hpp>

#include <algorithm>

namespace glint::shader {

namespace {

const Instruction* find(const Instructions& part, uint32_t id) {
    const auto found = std::ranges::find_if(part, [&](const Instruction& item) { return item.result() == id; });
    return found == part.end() ? nullptr : &*found;
}

bool isMember(const Instruction& item, uint32_t block, uint32_t member) {
    const bool has_member = item.opcode == spv::OpMemberName || item.opcode == spv::OpMemberDecorate;
    return has_member && item.operands()[0] == block && item.operands()[1] == member;
}

/// Whether `item` reaches the member through a variable of an array of blocks. What reaches the block in a way that
/// glslang does not write counts as reaching the member.
bool reaches(const SpirvModule& module, const Instruction& item, uint32_t variable, uint32_t member) {
    const bool names = std::ranges::any_of(item.ids, [&](uint16_t place) { return item.words[place] == variable; });
    if (!names) return false;
    if (item.opcode != spv::OpAccessChain || item.operands().size() < 3) return true;
    const Instruction* const index = find(module.globals, item.operands()[2]);
    return !index || index->opcode != spv::OpConstant || index->operands()[0] == member;
}

}  // namespace

void dropUnusedShadingRate(std::vector<uint32_t>& words) {
    Expected<SpirvModule> parsed = SpirvModule::parse(words);
    if (!parsed) return;
    SpirvModule& module = *parsed;
    const auto rate = std::ranges::find_if(module.decorations, [](const Instruction& item) {
        return item.opcode == spv::OpMemberDecorate && item.operands().size() == 4 &&
               item.operands()[2] == spv::DecorationBuiltIn &&
               item.operands()[3] == spv::BuiltInPrimitiveShadingRateKHR;
    });
    if (rate == module.decorations.end()) return;
    const uint32_t block = rate->operands()[0];
    const uint32_t member = rate->operands()[1];
    const auto structure =
        std::ranges::find_if(module.globals, [&](const Instruction& item) { return item.result() == block; });
    // The members behind it would move.
    if (structure == module.globals.end() || structure->operands().size() != member + 1) return;

    // Array of the block, pointer to it, variable.
    for (const Instruction& variable : module.globals) {
        if (variable.opcode != spv::OpVariable) continue;
        const Instruction* const pointer = find(module.globals, variable.type());
        const Instruction* const array = pointer ? find(module.globals, pointer->operands()[1]) : nullptr;
        if (!array || array->opcode != spv::OpTypeArray || array->operands()[0] != block) continue;
        for (const Instructions& function : module.functions)
            for (const Instruction& item : function)
                if (reaches(module, item, variable.result(), member)) return;
    }
    structure->words.pop_back();
    structure->ids.pop_back();
    std::erase_if(module.names, [&](const Instruction& item) { return isMember(item, block, member); });
    std::erase_if(module.decorations, [&](const Instruction& item) { return isMember(item, block, member); });
    std::erase_if(module.capabilities,
                  [](const Instruction& item) { return item.operands()[0] == spv::CapabilityFragmentShadingRateKHR; });
    std::erase_if(module.extensions,
                  [](const Instruction& item) { return item.text(0) == "SPV_KHR_fragment_shading_rate"; });
    words = module.words();
}

}  // namespace glint::shader
