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
    writeWrapper(id);
    for (const uint32_t function : module.reached) copyFunction(*module.functions.at(function));
    copyNotes();
}

void StageCopier::addVariables() {
    records_.clear();
    for (const auto& [id, variable] : module_->own) {
        if (variable.storage_class == spv::StorageClassShaderRecordBufferKHR) records_.insert(id);
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
        unsupported(fmt::format("built-in variable {} has no counterpart", variable.built_in));
    }
    uint32_t value = emit(spv::OpLoad, source.type, std::array{source.id});
    if (source.type != variable.type) value = emit(spv::OpBitcast, variable.type, std::array{value});
    emitStore(variableHere(variable), value);
}

void StageCopier::writeWrapper(uint32_t id) {
    const uint32_t void_type = builder_.shared(spv::OpTypeVoid, 0, {});
    const uint32_t function_type = builder_.shared(spv::OpTypeFunction, 0, {void_type});
    Instruction head(spv::OpFunction, void_type, id, std::array{0u, function_type});
    head.ids = {1, 2, 4};  // the control between them is a literal
    body_.clear();
    body_.push_back(std::move(head));
    emitLabel(builder_.newId());

    // Attributes are an intersection shader's to write.
    const bool reads_attributes = stage_ != ShaderStage::Intersection;
    const ValueWords& values = joiner_.values();
    uint32_t record = 0;
    for (const auto& [name, variable] : module_->own) {
        const uint32_t here = variableHere(variable);
        switch (variable.storage_class) {
            case spv::StorageClassInput: readBuiltIn(variable); break;
            case spv::StorageClassIncomingRayPayloadKHR:
                values.load(body_, variable.type, here, names_.payload, 0, true);
                break;
            case spv::StorageClassIncomingCallableDataKHR:
                values.load(body_, variable.type, here, names_.callable, 0, true);
                break;
            case spv::StorageClassHitAttributeKHR:
                if (reads_attributes) values.load(body_, variable.type, here, names_.attributes, 0, true);
                break;
            case spv::StorageClassPushConstant: values.load(body_, variable.type, here, names_.push, 0, false); break;
            case spv::StorageClassShaderRecordBufferKHR:
                if (!record) record = emit(spv::OpLoad, builder_.uintType(), std::array{frame("glint_record")});
                values.load(body_, variable.type, here, names_.records, record, false);
                break;
            default:
                // At every call of the stage, not once.
                if (variable.initializer) emitStore(here, variable.initializer);
        }
    }
    emit(spv::OpFunctionCall, void_type, std::array{local_.at(module_->entry)});
    for (const auto& [name, variable] : module_->own) {
        if (variable.storage_class == spv::StorageClassIncomingRayPayloadKHR)
            values.store(body_, variable.type, variableHere(variable), names_.payload);
        if (variable.storage_class == spv::StorageClassIncomingCallableDataKHR)
            values.store(body_, variable.type, variableHere(variable), names_.callable);
    }
    body_.emplace_back(spv::OpReturn, 0, 0, std::span<const uint32_t>());
    body_.emplace_back(spv::OpFunctionEnd, 0, 0, std::span<const uint32_t>());
    builder_.module.functions.push_back(std::move(body_));
    body_.clear();
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
    const uint32_t level = level_ + 1;
    if (level > trace_levels_) return;
    std::vector<uint32_t> values;
    for (const uint32_t operand : original.operands()) values.push_back(idHere(operand));
    const StageVariable& payload = ownVariable(original.operands()[10], "traceRayEXT");
    for (size_t i = 1; i < 6; i++) values[i] = asUint(values[i]);
    // Flags of pipelines alone are none of a query's.
    const uint32_t known = builder_.constant(~uint32_t(spv::RayFlagsSkipClosestHitShaderKHRMask));
    const uint32_t flags = emit(spv::OpBitwiseAnd, builder_.uintType(), std::array{values[1], known});
    const uint32_t query = frame(fmt::format("glint_query{}", level).c_str());
    body_.emplace_back(spv::OpRayQueryInitializeKHR, 0, 0,
                       std::array{query, values[0], flags, values[2], values[6], values[7], values[8], values[9]});
    joiner_.values().store(body_, payload.type, variableHere(payload), names_.payload);
    call(fmt::format("glintTrace{}", level), {values.begin() + 1, values.begin() + 10});
    joiner_.values().load(body_, payload.type, variableHere(payload), names_.payload, 0, true);
}

void StageCopier::writeCallable(const Instruction& original) {
    const uint32_t level = stage_ == ShaderStage::Callable ? level_ + 1 : 1;
    if (level > callable_levels_) return;
    const StageVariable& data = ownVariable(original.operands()[1], "executeCallableEXT");
    const uint32_t index = asUint(idHere(original.operands()[0]));
    joiner_.values().store(body_, data.type, variableHere(data), names_.callable);
    call(fmt::format("glintCallable{}", level), {index});
    joiner_.values().load(body_, data.type, variableHere(data), names_.callable, 0, true);
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
