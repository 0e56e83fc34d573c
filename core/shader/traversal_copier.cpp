#include "traversal_copier.h"

#include <glint/base/format_error.h>

#include <spirv-tools/libspirv.h>
#include <spirv/unified1/spirv.hpp>

#include <algorithm>

namespace glint::shader {

namespace {

constexpr FrameVariable frame_variables[] = {
    {spv::BuiltInLaunchIdKHR, "glint_launch_id", nullptr},
    {spv::BuiltInLaunchSizeKHR, "glint_launch_size", nullptr},
    {spv::BuiltInWorldRayOriginKHR, "glint_world_origin", nullptr},
    {spv::BuiltInWorldRayDirectionKHR, "glint_world_direction", nullptr},
    {spv::BuiltInObjectRayOriginKHR, "glint_object_origin", &SkeletonNeeds::object_ray},
    {spv::BuiltInObjectRayDirectionKHR, "glint_object_direction", &SkeletonNeeds::object_ray},
    {spv::BuiltInRayTminKHR, "glint_t_min", nullptr},
    {spv::BuiltInRayTmaxKHR, "glint_t_max", nullptr},
    {spv::BuiltInInstanceCustomIndexKHR, "glint_custom_index", &SkeletonNeeds::custom_index},
    {spv::BuiltInObjectToWorldKHR, "glint_to_world", &SkeletonNeeds::to_world},
    {spv::BuiltInWorldToObjectKHR, "glint_to_object", &SkeletonNeeds::to_object},
    {spv::BuiltInHitKindKHR, "glint_hit_kind", nullptr},
    {spv::BuiltInIncomingRayFlagsKHR, "glint_ray_flags", nullptr},
    {spv::BuiltInRayGeometryIndexKHR, "glint_geometry", nullptr},
    {spv::BuiltInInstanceId, "glint_instance", nullptr},
    {spv::BuiltInPrimitiveId, "glint_primitive", nullptr},
    {spv::BuiltInCullMaskKHR, "glint_cull_mask", nullptr},
};

/// Those that mean the same in compute shaders.
bool isComputeInput(uint32_t built_in) {
    return built_in == spv::BuiltInSubgroupSize || built_in == spv::BuiltInSubgroupLocalInvocationId ||
           (built_in >= spv::BuiltInSubgroupEqMask && built_in <= spv::BuiltInSubgroupLtMask) ||
           built_in == spv::BuiltInDeviceIndex;
}

constexpr uint32_t no_stage = 0xffff;  // GLINT_NO_STAGE

bool endsStage(uint32_t opcode) {
    return opcode == spv::OpIgnoreIntersectionKHR || opcode == spv::OpTerminateRayKHR ||
           opcode == spv::OpReportIntersectionKHR;
}

}  // namespace

const FrameVariable* frameVariable(uint32_t built_in) {
    const auto* const found = std::ranges::find(frame_variables, built_in, &FrameVariable::built_in);
    return found == std::end(frame_variables) ? nullptr : found;
}

void StageCopier::unsupported(std::string_view what) const {
    throw RewriteRefusal{ErrorCode::Unsupported, "shader.traversal_unsupported",
                         fmt::format("{}{}: {}", module_->title, line_.empty() ? "" : ", " + line_, what)};
}

void StageCopier::copy(JoinedModule& module, ShaderStage stage, uint32_t level, uint32_t id) {
    module_ = &module;
    stage_ = stage;
    level_ = level;
    local_.clear();
    line_.clear();
    for (const uint32_t function : module.reached)
        for (const Instruction& item : *module.functions.at(function))
            if (item.has_result) local_[item.result()] = builder_.newId();
    addVariables();
    findUnwinding();
    if (module.cut.empty())
        writeWrapper(id);
    else
        writePieces(id);
    for (const uint32_t function : module.reached) copyFunction(*module.functions.at(function));
    copyNotes();
}

void StageCopier::addVariables() {
    records_.clear();
    for (const auto& [id, variable] : module_->own) {
        if (variable.storage_class == spv::StorageClassShaderRecordBufferKHR) records_.insert(id);
        if (id == module_->cut.next) {
            local_[id] = frame("glint_piece");
            continue;
        }
        local_[id] = builder_.newId();
        const uint32_t storage_class = spv::StorageClassPrivate;
        builder_.addGlobal(Instruction(spv::OpVariable, variable.pointer, local_[id], std::array{storage_class}, 0));
    }
}

// From the frame to the stage's variables and back.

void StageCopier::readBuiltIn(const StageVariable& variable) {
    SkeletonNames::Variable source;
    if (const FrameVariable* known = frameVariable(variable.built_in)) {
        source = names_.variables.at(known->name);
    } else if (isComputeInput(variable.built_in)) {
        SkeletonNames::Variable& input = inputs_[variable.built_in];
        if (!input.id) {
            const uint32_t storage_class = spv::StorageClassInput;
            input = {builder_.newId(), variable.type};
            builder_.addGlobal(Instruction(spv::OpVariable, builder_.pointerType(storage_class, variable.type),
                                           input.id, std::array{storage_class}, 0));
            builder_.decorate(input.id, {spv::DecorationBuiltIn, variable.built_in});
        }
        source = input;
    } else {
        unsupported(fmt::format("built-in variable {} ('{}') has no counterpart", variable.built_in,
                                module_->nameOf(variable.id)));
    }
    uint32_t value = emit(spv::OpLoad, source.type, std::array{source.id});
    if (source.type != variable.type) value = emit(spv::OpBitcast, variable.type, std::array{value});
    emitStore(variableHere(variable), value);
}

void StageCopier::beginFunction(uint32_t id) {
    const uint32_t void_type = builder_.shared(spv::OpTypeVoid, 0, {});
    const uint32_t function_type = builder_.shared(spv::OpTypeFunction, 0, {void_type});
    Instruction head(spv::OpFunction, void_type, id, std::array{0u, function_type});
    head.ids = {1, 2, 4};  // the control between them is a literal
    body_.clear();
    body_.push_back(std::move(head));
    emitLabel(builder_.newId());
}

void StageCopier::endFunction() {
    body_.emplace_back(spv::OpReturn, 0, 0, std::span<const uint32_t>());
    body_.emplace_back(spv::OpFunctionEnd, 0, 0, std::span<const uint32_t>());
    builder_.module.functions.push_back(std::move(body_));
    body_.clear();
}

void StageCopier::writeStart() {
    // Attributes are an intersection shader's to write.
    const bool reads_attributes = stage_ != ShaderStage::Intersection;
    const ValueWords& values = joiner_.values();
    uint32_t record = 0;
    for (const auto& [name, variable] : module_->own) {
        const uint32_t here = variableHere(variable);
        switch (variable.storage_class) {
            case spv::StorageClassInput: readBuiltIn(variable); break;
            case spv::StorageClassIncomingRayPayloadKHR:
                values.load(body_, variable.type, here, names_.payload, true);
                break;
            case spv::StorageClassIncomingCallableDataKHR:
                values.load(body_, variable.type, here, names_.callable, true);
                break;
            case spv::StorageClassHitAttributeKHR:
                if (reads_attributes) values.load(body_, variable.type, here, names_.attributes, true);
                break;
            case spv::StorageClassPushConstant: values.load(body_, variable.type, here, names_.push, false); break;
            case spv::StorageClassShaderRecordBufferKHR:
                if (!record) record = emit(spv::OpLoad, builder_.uintType(), std::array{frame("glint_record")});
                values.load(body_, variable.type, here, names_.records.from(record), false);
                break;
            default:
                // At every call of the stage, not once.
                if (variable.initializer) emitStore(here, variable.initializer);
        }
    }
}

void StageCopier::writeFinish() {
    for (const auto& [name, variable] : module_->own) {
        if (variable.storage_class == spv::StorageClassIncomingRayPayloadKHR)
            joiner_.values().store(body_, variable.type, variableHere(variable), names_.payload);
        if (variable.storage_class == spv::StorageClassIncomingCallableDataKHR)
            joiner_.values().store(body_, variable.type, variableHere(variable), names_.callable);
    }
}

void StageCopier::writeWrapper(uint32_t id) {
    beginFunction(id);
    writeStart();
    emit(spv::OpFunctionCall, builder_.shared(spv::OpTypeVoid, 0, {}), std::array{local_.at(module_->entry)});
    writeFinish();
    endFunction();
}

/// The pieces one after the other: a branch forwards is taken at once, and one backwards when the function is called
/// again.
void StageCopier::writePieces(uint32_t id) {
    beginFunction(id);
    const std::vector<StagePiece>& pieces = module_->cut.pieces;
    const uint32_t bool_type = builder_.boolType();
    for (uint32_t i = 0; i <= pieces.size(); i++) {
        const uint32_t next = emit(spv::OpLoad, builder_.uintType(), std::array{frame("glint_piece")});
        uint32_t is_next = emit(spv::OpIEqual, bool_type, std::array{next, builder_.constant(i)});
        const bool resumes = i < pieces.size() && pieces[i].payload;
        if (resumes) {
            // It is the next already while its ray is asked for.
            const uint32_t asks = emit(spv::OpLoad, bool_type, std::array{frame("glint_asks")});
            const uint32_t is_back = emit(spv::OpLogicalNot, bool_type, std::array{asks});
            is_next = emit(spv::OpLogicalAnd, bool_type, std::array{is_next, is_back});
        }
        writeIf(is_next, [&] {
            if (i == 0) writeStart();
            if (resumes) writeSaved(pieces[i], false);
            if (i < pieces.size()) {
                emit(spv::OpFunctionCall, builder_.shared(spv::OpTypeVoid, 0, {}),
                     std::array{local_.at(pieces[i].function)});
            } else {
                writeFinish();
                emitStore(frame("glint_stage"), builder_.constant(no_stage));
            }
        });
    }
    endFunction();
}

void StageCopier::writeIf(uint32_t condition, const std::function<void()>& body) {
    const uint32_t then = builder_.newId(), after = builder_.newId();
    body_.emplace_back(spv::OpSelectionMerge, 0, 0, std::array{after, 0u}, 1);
    body_.emplace_back(spv::OpBranchConditional, 0, 0, std::array{condition, then, after});
    emitLabel(then);
    body();
    body_.emplace_back(spv::OpBranch, 0, 0, std::array{after});
    emitLabel(after);
}

/// The words of the stage's level.
WordArray StageCopier::savedWords() {
    if (depth_ == 2) return names_.saved;
    const uint32_t uint_type = builder_.uintType();
    const uint32_t level = emit(spv::OpLoad, uint_type, std::array{frame("glint_level")});
    const uint32_t frame = emit(spv::OpISub, uint_type, std::array{level, builder_.constant(1)});
    return names_.saved.from(emit(spv::OpIMul, uint_type, std::array{frame, builder_.constant(saved_words_)}));
}

/// What the stage knows is put away before a trace, or found again in `piece` after it, with the payload. A call of the
/// stage at a deeper level would overwrite it; ray generation has no other. Where rays nest no deeper, none is asked
/// for and nothing has happened.
void StageCopier::writeSaved(const StagePiece& piece, bool saves) {
    const ValueWords& values = joiner_.values();
    const auto handOn = [&] {
        if (isNested() && !piece.live.empty()) {
            WordArray words = savedWords();
            for (const uint32_t id : piece.live) {
                const StageVariable& variable = module_->own.at(id);
                if (saves)
                    values.store(body_, variable.type, variableHere(variable), words);
                else
                    values.load(body_, variable.type, variableHere(variable), words, true);
                words.offset += values.count(variable.type, true, "a variable");
            }
        }
        const StageVariable& payload = ownVariable(piece.payload, "traceRayEXT");
        if (saves)
            values.store(body_, payload.type, variableHere(payload), names_.payload);
        else
            values.load(body_, payload.type, variableHere(payload), names_.payload, true);
    };
    if (saves || !isNested()) return handOn();
    writeIf(isAbove(), handOn);
}

uint32_t StageCopier::isAbove() {
    const uint32_t level = emit(spv::OpLoad, builder_.uintType(), std::array{frame("glint_level")});
    return emit(spv::OpULessThan, builder_.boolType(), std::array{level, builder_.constant(depth_)});
}

// The stage's own code.

void StageCopier::findUnwinding() {
    unwinding_.clear();
    const auto unwinds = [&](const Instruction& item) {
        return endsStage(item.opcode) ||
               (item.opcode == spv::OpFunctionCall && unwinding_.contains(item.operands()[0]));
    };
    for (size_t before = SIZE_MAX; before != unwinding_.size();) {
        before = unwinding_.size();
        for (const uint32_t function : module_->reached)
            if (std::ranges::any_of(*module_->functions.at(function), unwinds)) unwinding_.insert(function);
    }
}

void StageCopier::copyFunction(const Instructions& function) {
    body_.clear();
    continues_.clear();
    ends_.clear();
    piece_ = nullptr;
    for (const StagePiece& piece : module_->cut.pieces)
        if (piece.function == function[0].result()) piece_ = &piece;
    definitions_.clear();
    for (const Instruction& item : function)
        if (item.has_result) definitions_[item.result()] = &item;
    return_type_ = idHere(function[0].type());
    for (const Instruction& item : function)
        if (item.opcode == spv::OpLoopMerge) continues_.insert(idHere(item.operands()[1]));
    for (const Instruction& item : function) copyInstruction(item);
    for (Instruction& item : body_) {
        if (item.opcode != spv::OpPhi) continue;
        for (size_t i = 1; i < item.operands().size(); i += 2)
            if (const auto end = ends_.find(item.operands()[i]); end != ends_.end()) item.operands()[i] = end->second;
    }
    builder_.module.functions.push_back(std::move(body_));
    body_.clear();
}

void StageCopier::copyInstruction(const Instruction& original) {
    switch (original.opcode) {
        case spv::OpTraceRayKHR: return writeTrace(original);
        case spv::OpExecuteCallableKHR: return writeCallable(original);
        case spv::OpReportIntersectionKHR: return writeReport(original);
        case spv::OpIgnoreIntersectionKHR: return writeEnd("glint_ignored");
        case spv::OpTerminateRayKHR: return writeEnd("glint_ended");
        case spv::OpTraceNV:
        case spv::OpTraceMotionNV:
        case spv::OpTraceRayMotionNV:
        case spv::OpExecuteCallableNV:
        case spv::OpIgnoreIntersectionNV:
        case spv::OpTerminateRayNV:
            unsupported(fmt::format("Op{} has no counterpart", spvOpcodeString(original.opcode)));
        case spv::OpLine:
            line_ = fmt::format("{}:{}", module_->strings[original.operands()[0]], original.operands()[1]);
            break;
        case spv::OpLabel: label_ = idHere(original.result()); break;
        case spv::OpLoopMerge:
            if (ends_.contains(label_))
                unsupported("what ends an any-hit or intersection shader is called in the head of a loop");
            break;
        case spv::OpStore:
        case spv::OpCopyMemory:
            if (records_.contains(original.operands()[0])) unsupported("it writes to its shaderRecordEXT block");
            break;
        case spv::OpAccessChain:
        case spv::OpInBoundsAccessChain:
        case spv::OpCopyObject:
            if (records_.contains(original.operands()[0])) records_.insert(original.result());
            break;
        default:
            if (std::string_view(spvOpcodeString(original.opcode)).starts_with("Atomic") &&
                records_.contains(original.operands()[0]))
                unsupported("it changes its shaderRecordEXT block");
            break;
    }
    Instruction item = original;
    for (const uint16_t place : item.ids) item.words[place] = idHere(original.words[place]);
    builder_.note(item);
    body_.push_back(std::move(item));
    if (original.opcode == spv::OpFunctionCall && unwinding_.contains(original.operands()[0])) writeUnwinding();
}

void StageCopier::writeTrace(const Instruction& original) {
    // Beyond the recursion depth it does nothing.
    if (!piece_) return;
    const auto ask = [&] {
        writeSaved(module_->cut.pieces[piece_->after], true);
        writeStructure(original.operands()[0]);
        std::vector<uint32_t> values;
        for (const uint32_t operand : original.operands().subspan(1, 9)) values.push_back(idHere(operand));
        for (size_t i = 0; i < 5; i++) values[i] = asUint(values[i]);
        call("glintAsk", std::move(values));
    };
    if (!isNested()) return ask();
    writeIf(isAbove(), ask);
}

/// Says which structure a ray is for: no variable can hold one, so that it is loaded again where the search begins.
void StageCopier::writeStructure(uint32_t id) {
    const Instruction* item = definitions_.at(id);
    while (item->opcode == spv::OpCopyObject) item = definitions_.at(item->operands()[0]);
    Structure structure;
    structure.type = idHere(item->type());
    const uint32_t uint_type = builder_.uintType();
    const uint32_t pair_type = builder_.shared(spv::OpTypeVector, 0, {uint_type, 2}, 1);
    const char* const unknown = "a branch chooses the structure that its traceRayEXT is for";
    if (item->opcode == spv::OpConvertUToAccelerationStructureKHR) {
        uint32_t address = idHere(item->operands()[0]);
        if (builder_.typeOf(address) != pair_type) address = emit(spv::OpBitcast, pair_type, std::array{address});
        emitStore(frame("glint_structure_place"), address);
    } else if (item->opcode == spv::OpLoad) {
        uint32_t variable = item->operands()[0];
        if (const auto chain = definitions_.find(variable); chain != definitions_.end()) {
            const Instruction& place = *chain->second;
            if (place.operands().size() != 2 ||
                (place.opcode != spv::OpAccessChain && place.opcode != spv::OpInBoundsAccessChain))
                unsupported(unknown);
            variable = place.operands()[0];
            structure.element = idHere(place.type());
            const uint32_t index = asUint(idHere(place.operands()[1]));
            emitStore(frame("glint_structure_place"),
                      emit(spv::OpCompositeConstruct, pair_type, std::array{index, index}));
        }
        if (definitions_.contains(variable)) unsupported(unknown);
        structure.variable = idHere(variable);
        // The stages' declarations of a resource are different variables.
        std::array<uint32_t, 3> key = {structure.variable, 0, builder_.typeOf(structure.variable)};
        for (const Instruction* note : module_->notes[variable]) {
            if (note->opcode != spv::OpDecorate || note->operands().size() < 3) continue;
            if (note->operands()[1] == spv::DecorationDescriptorSet) key[0] = note->operands()[2];
            if (note->operands()[1] == spv::DecorationBinding) key[1] = note->operands()[2];
        }
        structure.variable = places_.try_emplace(key, structure.variable).first->second;
    } else {
        unsupported(unknown);
    }
    auto known = std::ranges::find(structures_, structure);
    if (known == structures_.end()) known = structures_.insert(known, structure);
    emitStore(frame("glint_structure"), builder_.constant(static_cast<uint32_t>(known - structures_.begin())));
}

void StageCopier::writeBegin(uint32_t id, uint32_t flags_pointer) {
    const uint32_t void_type = builder_.shared(spv::OpTypeVoid, 0, {});
    const uint32_t uint_type = builder_.uintType();
    const uint32_t flags = builder_.newId();
    Instruction head(spv::OpFunction, void_type, id,
                     std::array{0u, builder_.shared(spv::OpTypeFunction, 0, {void_type, flags_pointer})});
    head.ids = {1, 2, 4};
    body_.clear();
    body_.push_back(std::move(head));
    body_.emplace_back(spv::OpFunctionParameter, flags_pointer, flags, std::span<const uint32_t>());
    emitLabel(builder_.newId());
    const auto load = [&](const char* name) {
        const SkeletonNames::Variable& variable = names_.variables.at(name);
        return emit(spv::OpLoad, variable.type, std::array{variable.id});
    };
    for (uint32_t i = 0; i < structures_.size(); i++) {
        const Structure& structure = structures_[i];
        const auto begin = [&] {
            uint32_t value = 0;
            if (!structure.variable) {
                const uint32_t address = load("glint_structure_place");
                value = emit(spv::OpConvertUToAccelerationStructureKHR, structure.type, std::array{address});
            } else {
                uint32_t place = structure.variable;
                if (structure.element) {
                    const uint32_t pair = load("glint_structure_place"), index = builder_.newId();
                    body_.emplace_back(spv::OpCompositeExtract, uint_type, index, std::array{pair, 0u}, 1);
                    place = emit(spv::OpAccessChain, structure.element, std::array{place, index});
                }
                value = emit(spv::OpLoad, structure.type, std::array{place});
            }
            const std::array operands = {frame("glint_query"),
                                         value,
                                         flags,
                                         load("glint_cull_mask"),
                                         load("glint_world_origin"),
                                         load("glint_t_min"),
                                         load("glint_world_direction"),
                                         load("glint_ray_end")};
            body_.emplace_back(spv::OpRayQueryInitializeKHR, 0, 0, operands);
        };
        if (structures_.size() == 1) {
            begin();
            break;
        }
        const uint32_t which = load("glint_structure");
        writeIf(emit(spv::OpIEqual, builder_.boolType(), std::array{which, builder_.constant(i)}), begin);
    }
    endFunction();
}

void StageCopier::writeCallable(const Instruction& original) {
    const uint32_t level = stage_ == ShaderStage::Callable ? level_ + 1 : 1;
    if (level > callable_levels_) return;
    const StageVariable& data = ownVariable(original.operands()[1], "executeCallableEXT");
    const uint32_t index = asUint(idHere(original.operands()[0]));
    joiner_.values().store(body_, data.type, variableHere(data), names_.callable);
    call(fmt::format("glintCallable{}", level), {index});
    joiner_.values().load(body_, data.type, variableHere(data), names_.callable, true);
}

void StageCopier::writeReport(const Instruction& original) {
    for (const auto& [id, variable] : module_->own)
        if (variable.storage_class == spv::StorageClassHitAttributeKHR)
            joiner_.values().store(body_, variable.type, variableHere(variable), names_.attributes);
    const uint32_t kind = asUint(idHere(original.operands()[1]));
    const std::array operands = {names_.functions.at("glintReport"), idHere(original.operands()[0]), kind};
    body_.emplace_back(spv::OpFunctionCall, idHere(original.type()), idHere(original.result()), operands);
    builder_.note(body_.back());
    // gl_RayTmaxEXT is where the nearest of the reported is now.
    for (const auto& [id, variable] : module_->own)
        if (variable.built_in == spv::BuiltInRayTmaxKHR) readBuiltIn(variable);
    writeUnwinding();
}

void StageCopier::writeEnd(const char* flag) {
    const uint32_t yes = builder_.shared(spv::OpConstantTrue, builder_.boolType(), {});
    emitStore(frame(flag), yes);
    emitStore(frame("glint_unwind"), yes);
    writeReturn();
}

void StageCopier::writeReturn() {
    const std::optional<uint32_t> nothing = builder_.find(Instruction(spv::OpTypeVoid, 0, 1, std::span<uint32_t>()));
    if (return_type_ == *nothing) {
        body_.emplace_back(spv::OpReturn, 0, 0, std::span<const uint32_t>());
        return;
    }
    const uint32_t value = emit(spv::OpUndef, return_type_, {});
    body_.emplace_back(spv::OpReturnValue, 0, 0, std::array{value});
}

/// Returns if the flag says so: the block goes on in another one.
void StageCopier::writeUnwinding() {
    if (continues_.contains(label_))
        unsupported("what ends an any-hit or intersection shader is called where a loop goes on to its next turn");
    const uint32_t leaves = builder_.newId(), stays = builder_.newId();
    const uint32_t flag = emit(spv::OpLoad, builder_.boolType(), std::array{frame("glint_unwind")});
    body_.emplace_back(spv::OpSelectionMerge, 0, 0, std::array{stays, 0u}, 1);
    body_.emplace_back(spv::OpBranchConditional, 0, 0, std::array{flag, leaves, stays});
    emitLabel(leaves);
    writeReturn();
    emitLabel(stays);
    ends_[label_] = stays;
}

void StageCopier::copyNotes() {
    for (const auto& [id, here] : local_) {
        const auto notes = module_->notes.find(id);
        if (notes == module_->notes.end()) continue;
        for (const Instruction* note : notes->second) {
            Instruction item = *note;
            for (const uint16_t place : item.ids) item.words[place] = idHere(note->words[place]);
            const bool is_name = item.opcode == spv::OpName;
            // Built-ins, locations and the like have gone with the storage classes.
            if (!is_name && module_->own.contains(id)) continue;
            (is_name ? builder_.module.names : builder_.module.decorations).push_back(std::move(item));
        }
    }
}

// Small pieces.

uint32_t StageCopier::idHere(uint32_t id) const {
    const auto found = local_.find(id);
    return found == local_.end() ? joiner_.idOf(*module_, id) : found->second;
}

uint32_t StageCopier::asUint(uint32_t value) {
    if (builder_.typeOf(value) == builder_.uintType()) return value;
    return emit(spv::OpBitcast, builder_.uintType(), std::array{value});
}

const StageVariable& StageCopier::ownVariable(uint32_t id, const char* what) const {
    const auto found = module_->own.find(id);
    if (found == module_->own.end()) unsupported(fmt::format("{} has no variable for its data", what));
    return found->second;
}

uint32_t StageCopier::emit(uint32_t opcode, uint32_t type, std::span<const uint32_t> operands) {
    const uint32_t id = builder_.newId();
    body_.emplace_back(opcode, type, id, operands);
    builder_.note(body_.back());
    return id;
}

void StageCopier::emitStore(uint32_t pointer, uint32_t value) {
    body_.emplace_back(spv::OpStore, 0, 0, std::array{pointer, value});
}

void StageCopier::emitLabel(uint32_t label) { body_.emplace_back(spv::OpLabel, 0, label, std::span<const uint32_t>()); }

void StageCopier::call(const std::string& name, std::vector<uint32_t> arguments) {
    arguments.insert(arguments.begin(), names_.functions.at(name));
    emit(spv::OpFunctionCall, builder_.shared(spv::OpTypeVoid, 0, {}), arguments);
}

}  // namespace glint::shader
