#include "spirv_builder.h"

#include <spirv/unified1/spirv.hpp>

namespace glint::shader {

namespace {

/// All of an instruction but its result.
std::vector<uint32_t> keyOf(const Instruction& item) {
    std::vector<uint32_t> key = {item.opcode, item.type()};
    key.insert(key.end(), item.operands().begin(), item.operands().end());
    return key;
}

}  // namespace

bool isSharedType(uint32_t opcode) {
    switch (opcode) {
        case spv::OpTypeVoid:
        case spv::OpTypeBool:
        case spv::OpTypeInt:
        case spv::OpTypeFloat:
        case spv::OpTypeVector:
        case spv::OpTypeMatrix:
        case spv::OpTypeImage:
        case spv::OpTypeSampler:
        case spv::OpTypeSampledImage:
        case spv::OpTypePointer:
        case spv::OpTypeFunction: return true;
        default: return false;
    }
}

void SpirvBuilder::addGlobal(Instruction item) {
    switch (item.opcode) {
        case spv::OpConstant: constants_[item.result()] = item.operands()[0]; [[fallthrough]];
        case spv::OpConstantTrue:
        case spv::OpConstantFalse: shared_.emplace(keyOf(item), item.result()); break;
        case spv::OpTypePointer: pointers_[item.result()] = {item.operands()[0], item.operands()[1]}; [[fallthrough]];
        default:
            if (isSharedType(item.opcode)) shared_.emplace(keyOf(item), item.result());
    }
    note(item);
    module.globals.push_back(std::move(item));
}

void SpirvBuilder::note(const Instruction& item) {
    if (item.has_type) types_[item.result()] = item.type();
    if (item.opcode == spv::OpVariable || item.opcode == spv::OpFunctionParameter) objects_.insert(item.result());
}

uint32_t SpirvBuilder::find(const Instruction& item) const {
    const auto found = shared_.find(keyOf(item));
    return found == shared_.end() ? 0 : found->second;
}

uint32_t SpirvBuilder::shared(uint32_t opcode, uint32_t type, std::span<const uint32_t> operands,
                              size_t literals_from) {
    const Instruction item(opcode, type, next_, operands, literals_from);
    if (const uint32_t found = find(item)) return found;
    addGlobal(item);
    return next_++;
}

uint32_t SpirvBuilder::pointerType(uint32_t storage_class, uint32_t pointee) {
    Instruction item(spv::OpTypePointer, 0, next_, std::array{storage_class, pointee});
    item.ids = {1, 3};  // the storage class between them is a literal
    if (const uint32_t found = find(item)) return found;
    addGlobal(std::move(item));
    return next_++;
}

uint32_t SpirvBuilder::boolType() { return shared(spv::OpTypeBool, 0, {}); }

uint32_t SpirvBuilder::uintType() { return shared(spv::OpTypeInt, 0, {32, 0}, 0); }

uint32_t SpirvBuilder::constant(uint32_t value) { return shared(spv::OpConstant, uintType(), {value}, 0); }

void SpirvBuilder::decorate(uint32_t target, std::initializer_list<uint32_t> words) {
    std::vector<uint32_t> operands = {target};
    operands.insert(operands.end(), words);
    module.decorations.emplace_back(spv::OpDecorate, 0, 0, operands, 1);
}

void SpirvBuilder::decorateMember(uint32_t target, uint32_t member, std::initializer_list<uint32_t> words) {
    std::vector<uint32_t> operands = {target, member};
    operands.insert(operands.end(), words);
    module.decorations.emplace_back(spv::OpMemberDecorate, 0, 0, operands, 1);
}

uint32_t SpirvBuilder::typeOf(uint32_t id) const {
    const auto found = types_.find(id);
    return found == types_.end() ? 0 : found->second;
}

std::optional<PointerType> SpirvBuilder::pointer(uint32_t type) const {
    const auto found = pointers_.find(type);
    return found == pointers_.end() ? std::optional<PointerType>() : found->second;
}

std::optional<uint32_t> SpirvBuilder::constantValue(uint32_t id) const {
    const auto found = constants_.find(id);
    return found == constants_.end() ? std::optional<uint32_t>() : found->second;
}

}  // namespace glint::shader
