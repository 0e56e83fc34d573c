#include "value_words.h"

#include "traversal_joiner.h"

#include <glint/base/format_error.h>

#include <spirv/unified1/spirv.hpp>

#include <algorithm>

namespace glint::shader {

namespace {

constexpr uint32_t word_bytes = 4;

[[noreturn]] void refuse(const char* id, std::string message) {
    throw RewriteRefusal{ErrorCode::Unsupported, id, std::move(message)};
}

}  // namespace

void ValueWords::noteType(const Instruction& type) { types_[type.result()] = type; }

void ValueWords::noteDecoration(const Instruction& decoration) {
    const std::span<const uint32_t> operands = decoration.operands();
    if (decoration.opcode == spv::OpMemberDecorate)
        members_[{operands[0], operands[1], operands[2]}] = operands.size() > 3 ? operands[3] : 1;
    if (decoration.opcode == spv::OpDecorate && operands[1] == spv::DecorationArrayStride)
        strides_[operands[0]] = operands[2];
}

uint32_t ValueWords::memberValue(uint32_t type, uint32_t member, uint32_t decoration, uint32_t otherwise) const {
    const auto found = members_.find({type, member, decoration});
    return found == members_.end() ? otherwise : found->second;
}

/// Bits of a scalar.
uint32_t ValueWords::width(uint32_t type) const {
    const Instruction& item = types_.at(type);
    switch (item.opcode) {
        case spv::OpTypeInt:
        case spv::OpTypeFloat: return item.operands()[0];
        case spv::OpTypePointer: return 64;
        default: return 32;
    }
}

uint32_t ValueWords::arrayLength(const Instruction& type) const {
    return builder_.constantValue(type.operands()[1]).value_or(0);
}

void ValueWords::gather(std::vector<Leaf>& all, Leaf at, bool packed, Layout layout, std::string_view what) const {
    const auto found = types_.find(at.type);
    if (found == types_.end()) refuse("shader.traversal_unsupported", fmt::format("{} has a type without words", what));
    const Instruction& type = found->second;
    const auto visit = [&](uint32_t index, uint32_t element, uint32_t bytes, Layout inner) {
        Leaf next = at;
        next.path.push_back(index);
        next.type = element;
        next.offset = packed ? (all.empty() ? 0 : all.back().offset + all.back().words) : at.offset + bytes;
        gather(all, std::move(next), packed, inner, what);
    };
    switch (type.opcode) {
        case spv::OpTypeBool:
        case spv::OpTypeInt:
        case spv::OpTypeFloat:
        case spv::OpTypePointer: {
            if (type.opcode == spv::OpTypePointer && type.operands()[0] != spv::StorageClassPhysicalStorageBuffer)
                refuse("shader.traversal_unsupported", fmt::format("{} has a pointer that is no address", what));
            const uint32_t bits = width(at.type);
            if (!packed && bits < 32)
                refuse("shader.traversal_unsupported", fmt::format("{} has a component of {} bits", what, bits));
            at.words = bits == 64 ? 2 : 1;
            const uint32_t end = at.words + (packed ? at.offset : at.offset / word_bytes);
            if (end > max_frame_words)
                throw RewriteRefusal{ErrorCode::OutOfRange, "shader.traversal_size",
                                     fmt::format("{} has more than {} words", what, max_frame_words)};
            all.push_back(std::move(at));
            return;
        }
        case spv::OpTypeVector: {
            const uint32_t element = type.operands()[0],
                           bytes = layout.row_major && layout.matrix_stride ? layout.matrix_stride : width(element) / 8;
            for (uint32_t i = 0; i < type.operands()[1]; i++) visit(i, element, i * bytes, {});
            return;
        }
        case spv::OpTypeMatrix: {
            const uint32_t column = type.operands()[0];
            const uint32_t component = width(types_.at(column).operands()[0]) / 8;
            for (uint32_t i = 0; i < type.operands()[1]; i++)
                visit(i, column, i * (layout.row_major ? component : layout.matrix_stride), layout);
            return;
        }
        case spv::OpTypeArray: {
            const auto stride = strides_.find(at.type);
            const uint32_t bytes = stride == strides_.end() ? 0 : stride->second;
            for (uint32_t i = 0; i < arrayLength(type); i++) visit(i, type.operands()[0], i * bytes, layout);
            return;
        }
        case spv::OpTypeStruct:
            for (uint32_t i = 0; i < type.operands().size(); i++) {
                Layout inner;
                inner.matrix_stride = memberValue(at.type, i, spv::DecorationMatrixStride, 0);
                inner.row_major = memberValue(at.type, i, spv::DecorationRowMajor, 0) != 0;
                visit(i, type.operands()[i], memberValue(at.type, i, spv::DecorationOffset, 0), inner);
            }
            return;
        default:
            refuse("shader.traversal_unsupported",
                   fmt::format("{} has a member that is neither a number nor an array of fixed length", what));
    }
}

std::vector<ValueWords::Leaf> ValueWords::leaves(uint32_t type, bool packed, std::string_view what) const {
    std::vector<Leaf> all;
    Leaf root;
    root.type = type;
    gather(all, std::move(root), packed, {}, what);
    return all;
}

uint32_t ValueWords::count(uint32_t type, bool packed, std::string_view what) const {
    uint32_t end = 0;
    for (const Leaf& leaf : leaves(type, packed, what))
        end = std::max(end, leaf.words + (packed ? leaf.offset : leaf.offset / word_bytes));
    return end;
}

uint32_t ValueWords::emit(Instructions& body, uint32_t opcode, uint32_t type,
                          std::span<const uint32_t> operands) const {
    const uint32_t id = builder_.newId();
    body.emplace_back(opcode, type, id, operands);
    builder_.note(body.back());
    return id;
}

uint32_t ValueWords::place(Instructions& body, const WordArray& words, uint32_t offset) const {
    const uint32_t uint_type = builder_.uintType();
    offset += words.offset;
    uint32_t index = words.first ? words.first : builder_.constant(offset);
    if (words.first && offset)
        index = emit(body, spv::OpIAdd, uint_type, std::array{words.first, builder_.constant(offset)});
    std::vector<uint32_t> chain = {words.variable};
    if (words.is_block) chain.push_back(builder_.constant(0));
    chain.push_back(index);
    return emit(body, spv::OpAccessChain, builder_.pointerType(words.storage_class, uint_type), chain);
}

uint32_t ValueWords::fromWords(Instructions& body, const Leaf& leaf, std::array<uint32_t, 2> values) const {
    const Instruction& type = types_.at(leaf.type);
    const uint32_t uint_type = builder_.uintType();
    if (leaf.words == 2) {
        const uint32_t pair_type = builder_.shared(spv::OpTypeVector, 0, {uint_type, 2}, 1);
        const uint32_t pair = emit(body, spv::OpCompositeConstruct, pair_type, values);
        return emit(body, spv::OpBitcast, leaf.type, std::array{pair});
    }
    if (leaf.type == uint_type) return values[0];
    if (type.opcode == spv::OpTypeBool)
        return emit(body, spv::OpINotEqual, leaf.type, std::array{values[0], builder_.constant(0)});
    if (width(leaf.type) == 32) return emit(body, spv::OpBitcast, leaf.type, std::array{values[0]});
    if (type.opcode == spv::OpTypeInt)
        return emit(body, type.operands()[1] ? spv::OpSConvert : spv::OpUConvert, leaf.type, std::array{values[0]});
    const uint32_t float_type = builder_.shared(spv::OpTypeFloat, 0, {32}, 0);
    const uint32_t wide = emit(body, spv::OpBitcast, float_type, std::array{values[0]});
    return emit(body, spv::OpFConvert, leaf.type, std::array{wide});
}

std::array<uint32_t, 2> ValueWords::toWords(Instructions& body, const Leaf& leaf, uint32_t value) const {
    const Instruction& type = types_.at(leaf.type);
    const uint32_t uint_type = builder_.uintType();
    if (leaf.words == 2) {
        const uint32_t pair_type = builder_.shared(spv::OpTypeVector, 0, {uint_type, 2}, 1);
        const uint32_t pair = emit(body, spv::OpBitcast, pair_type, std::array{value});
        std::array<uint32_t, 2> words = {};
        for (uint32_t i = 0; i < 2; i++) {
            words[i] = builder_.newId();
            body.emplace_back(spv::OpCompositeExtract, uint_type, words[i], std::array{pair, i}, 1);
            builder_.note(body.back());
        }
        return words;
    }
    if (leaf.type == uint_type) return {value, 0};
    if (type.opcode == spv::OpTypeBool)
        return {emit(body, spv::OpSelect, uint_type, std::array{value, builder_.constant(1), builder_.constant(0)}), 0};
    if (width(leaf.type) == 32) return {emit(body, spv::OpBitcast, uint_type, std::array{value}), 0};
    if (type.opcode == spv::OpTypeInt)
        return {emit(body, type.operands()[1] ? spv::OpSConvert : spv::OpUConvert, uint_type, std::array{value}), 0};
    const uint32_t float_type = builder_.shared(spv::OpTypeFloat, 0, {32}, 0);
    const uint32_t wide = emit(body, spv::OpFConvert, float_type, std::array{value});
    return {emit(body, spv::OpBitcast, uint_type, std::array{wide}), 0};
}

void ValueWords::load(Instructions& body, uint32_t type, uint32_t pointer, const WordArray& words, bool packed) const {
    for (const Leaf& leaf : leaves(type, packed, "a variable")) {
        const uint32_t offset = packed ? leaf.offset : leaf.offset / word_bytes;
        std::array<uint32_t, 2> values = {};
        for (uint32_t i = 0; i < leaf.words; i++)
            values[i] = emit(body, spv::OpLoad, builder_.uintType(), std::array{place(body, words, offset + i)});
        const uint32_t value = fromWords(body, leaf, values);
        uint32_t target = pointer;
        if (!leaf.path.empty()) {
            std::vector<uint32_t> chain = {pointer};
            for (const uint32_t index : leaf.path) chain.push_back(builder_.constant(index));
            target = emit(body, spv::OpAccessChain, builder_.pointerType(spv::StorageClassPrivate, leaf.type), chain);
        }
        body.emplace_back(spv::OpStore, 0, 0, std::array{target, value});
    }
}

void ValueWords::store(Instructions& body, uint32_t type, uint32_t pointer, const WordArray& words) const {
    for (const Leaf& leaf : leaves(type, true, "a variable")) {
        uint32_t source = pointer;
        if (!leaf.path.empty()) {
            std::vector<uint32_t> chain = {pointer};
            for (const uint32_t index : leaf.path) chain.push_back(builder_.constant(index));
            source = emit(body, spv::OpAccessChain, builder_.pointerType(spv::StorageClassPrivate, leaf.type), chain);
        }
        const uint32_t value = emit(body, spv::OpLoad, leaf.type, std::array{source});
        const std::array<uint32_t, 2> values = toWords(body, leaf, value);
        for (uint32_t i = 0; i < leaf.words; i++)
            body.emplace_back(spv::OpStore, 0, 0, std::array{place(body, words, leaf.offset + i), values[i]});
    }
}

}  // namespace glint::shader
