#include "traversal_module.h"

#include <glint/base/format_error.h>

#include <spirv/unified1/spirv.hpp>

#include <algorithm>

namespace glint::shader {

namespace {

template <class... Args>
[[noreturn]] void unsupported(const JoinedModule& module, fmt::format_string<Args...> format, Args&&... args) {
    throw RewriteRefusal{ErrorCode::Unsupported, "shader.traversal_unsupported",
                         fmt::format("{}: {}", module.title, fmt::format(format, std::forward<Args>(args)...))};
}

bool isNote(uint32_t opcode) { return opcode == spv::OpName || opcode == spv::OpMemberName; }

/// Storage that belongs to one call of a stage.
bool isOwn(uint32_t storage_class) {
    switch (storage_class) {
        case spv::StorageClassRayPayloadKHR:
        case spv::StorageClassIncomingRayPayloadKHR:
        case spv::StorageClassCallableDataKHR:
        case spv::StorageClassIncomingCallableDataKHR:
        case spv::StorageClassHitAttributeKHR:
        case spv::StorageClassShaderRecordBufferKHR:
        case spv::StorageClassPushConstant:
        case spv::StorageClassInput:
        case spv::StorageClassPrivate: return true;
        default: return false;
    }
}

bool isBlockCopy(uint32_t storage_class) {
    return storage_class == spv::StorageClassShaderRecordBufferKHR || storage_class == spv::StorageClassPushConstant;
}

bool isPipelineExtension(std::string_view name) {
    return name == "SPV_KHR_ray_tracing" || name == "SPV_KHR_ray_cull_mask";
}

/// What entry points of a module reach; for the skeleton all functions.
void findReached(JoinedModule& module) {
    for (const Instructions& function : module.spirv.functions) module.functions[function[0].result()] = &function;
    std::vector<uint32_t>& reached = module.reached;
    if (!module.is_stage) {
        for (const Instructions& function : module.spirv.functions) reached.push_back(function[0].result());
    } else {
        for (const StagePiece& piece : module.cut.pieces) reached.push_back(piece.function);
        if (reached.empty()) reached = {module.entry};
        for (size_t i = 0; i < reached.size(); i++)
            for (const Instruction& item : *module.functions.at(reached[i]))
                if (item.opcode == spv::OpFunctionCall && std::ranges::count(reached, item.operands()[0]) == 0)
                    reached.push_back(item.operands()[0]);
    }
    for (const uint32_t function : reached)
        for (const Instruction& item : *module.functions.at(function))
            for (const uint16_t place : item.ids) module.used.insert(item.words[place]);
}

void readNotes(JoinedModule& module) {
    for (const Instructions* part : {&module.spirv.names, &module.spirv.decorations})
        for (const Instruction& item : *part) {
            if (item.opcode == spv::OpDecorationGroup || item.opcode == spv::OpGroupDecorate ||
                item.opcode == spv::OpGroupMemberDecorate)
                unsupported(module, "it has groups of decorations");
            module.notes[item.operands()[0]].push_back(&item);
            if (item.opcode == spv::OpDecorate && item.operands()[1] == spv::DecorationBuiltIn)
                module.built_ins[item.operands()[0]] = item.operands()[2];
        }
    for (const Instruction& item : module.spirv.sources)
        if (item.opcode == spv::OpString) module.strings[item.result()] = item.text(0);
}

const Instruction* findDecoration(const JoinedModule& module, uint32_t id, uint32_t decoration) {
    const auto notes = module.notes.find(id);
    if (notes == module.notes.end()) return nullptr;
    for (const Instruction* note : notes->second)
        if (note->opcode == spv::OpDecorate && note->operands()[1] == decoration) return note;
    return nullptr;
}

bool isDecorated(const JoinedModule& module, uint32_t id) {
    const auto notes = module.notes.find(id);
    return notes != module.notes.end() &&
           std::ranges::any_of(notes->second, [](const Instruction* note) { return !isNote(note->opcode); });
}

}  // namespace

std::string_view JoinedModule::nameOf(uint32_t id) const {
    const auto found = notes.find(id);
    if (found != notes.end())
        for (const Instruction* note : found->second)
            if (note->opcode == spv::OpName) return note->text(1);
    return {};
}

uint32_t ModuleJoiner::idOf(JoinedModule& module, uint32_t id) {
    const auto [found, is_new] = module.ids.try_emplace(id, 0);
    if (is_new) found->second = builder_.newId();
    return found->second;
}

Instruction ModuleJoiner::moved(JoinedModule& module, Instruction instruction) {
    for (const uint16_t place : instruction.ids) instruction.words[place] = idOf(module, instruction.words[place]);
    return instruction;
}

void ModuleJoiner::add(JoinedModule& module) {
    findReached(module);
    readNotes(module);
    addHeader(module);
    for (const Instruction& item : module.spirv.globals) addGlobal(module, item);
    addNotes(module);
}

void ModuleJoiner::addHeader(JoinedModule& module) {
    SpirvModule& result = builder_.module;
    result.version = std::max(result.version, module.spirv.version);
    for (const Instruction& item : module.spirv.capabilities) {
        const uint32_t capability = item.operands()[0];
        if (capability == spv::CapabilityRayTracingKHR || capability == spv::CapabilityRayCullMaskKHR) continue;
        if (capability == spv::CapabilityRayTracingNV || capability == spv::CapabilityRayTracingMotionBlurNV)
            unsupported(module, "it is for NVIDIA's own extensions of ray tracing (capability {})", capability);
        if (capabilities_.insert(capability).second) result.capabilities.push_back(item);
    }
    for (const Instruction& item : module.spirv.extensions)
        if (!isPipelineExtension(item.text(0)) && extensions_.emplace(item.text(0)).second)
            result.extensions.push_back(item);
    for (const Instruction& item : module.spirv.imports) {
        const auto [found, is_new] = imports_.try_emplace(std::string(item.text(0)), 0);
        if (is_new) {
            found->second = idOf(module, item.result());
            result.imports.push_back(moved(module, item));
        }
        module.ids[item.result()] = found->second;
    }
    if (!module.spirv.modes.empty() && module.is_stage)
        for (const Instruction& mode : module.spirv.modes)
            if (mode.operands()[0] == module.entry) unsupported(module, "it has execution mode {}", mode.operands()[1]);

    const Instruction& model = module.spirv.memory_model[0];
    if (result.memory_model.empty()) result.memory_model.push_back(model);
    std::span<uint32_t> kept = result.memory_model[0].operands();
    if (kept[1] != model.operands()[1]) unsupported(module, "its memory model is not that of the other shaders");
    if (model.operands()[0] != spv::AddressingModelLogical) kept[0] = model.operands()[0];
    for (const Instruction& item : module.spirv.sources)
        if (item.opcode == spv::OpString) result.sources.push_back(moved(module, item));
}

void ModuleJoiner::addGlobal(JoinedModule& module, const Instruction& original) {
    const uint32_t id = original.result();
    bool is_address = false;
    switch (original.opcode) {
        case spv::OpTypeAccelerationStructureKHR:
        case spv::OpTypeRayQueryKHR:
            if (const auto found = tracing_types_.find(original.opcode); found != tracing_types_.end()) {
                module.ids[id] = found->second;
                return;
            }
            tracing_types_[original.opcode] = idOf(module, id);
            break;
        case spv::OpTypePointer: {
            const uint32_t storage_class = original.operands()[0];
            is_address = storage_class == spv::StorageClassPhysicalStorageBuffer;
            if (!module.is_stage || !isOwn(storage_class)) break;
            const uint32_t pointee = idOf(module, original.operands()[1]);
            if (isBlockCopy(storage_class)) records_.insert(pointee);
            module.ids[id] = builder_.pointerType(spv::StorageClassPrivate, pointee);
            return;
        }
        default: break;
    }
    Instruction item = moved(module, original);
    if (item.opcode == spv::OpVariable && !addVariable(module, original, item)) return;
    if (isSharedType(item.opcode) && !isDecorated(module, id) && !is_address) {
        if (const uint32_t found = builder_.find(item)) {
            module.ids[id] = found;
            item.words[1] = found;
            values_.noteType(item);
            return;
        }
    }
    module.defined.insert(id);
    if (!item.has_type && item.has_result) values_.noteType(item);
    builder_.addGlobal(std::move(item));
}

/// False for one that every copy of the stage is to have for itself, or that nobody uses.
bool ModuleJoiner::addVariable(JoinedModule& module, const Instruction& original, const Instruction& item) {
    if (!module.is_stage) return true;
    const uint32_t storage_class = item.operands()[0], id = original.result();
    if (isOwn(storage_class)) {
        if (!module.used.contains(id)) return false;
        StageVariable variable{.id = id, .pointer = item.type(), .storage_class = storage_class};
        variable.type = builder_.pointer(item.type())->pointee;
        if (item.operands().size() > 1) variable.initializer = item.operands()[1];
        if (const auto built_in = module.built_ins.find(id); built_in != module.built_ins.end())
            variable.built_in = built_in->second;
        module.own[id] = variable;
        return false;
    }
    if (storage_class != spv::StorageClassUniformConstant && storage_class != spv::StorageClassUniform &&
        storage_class != spv::StorageClassStorageBuffer)
        unsupported(module, "it has a variable of storage class {}", storage_class);
    const Instruction* const set = findDecoration(module, id, spv::DecorationDescriptorSet);
    const Instruction* const binding = findDecoration(module, id, spv::DecorationBinding);
    const uint32_t type = builder_.pointer(item.type())->pointee;
    if (set && binding && isWritable(storage_class, type) && !findDecoration(module, id, spv::DecorationRestrict) &&
        !findDecoration(module, id, spv::DecorationAliased))
        resources_[{set->operands()[2], binding->operands()[2]}].push_back(item.result());
    return true;
}

/// Storage blocks and images, and arrays of them.
bool ModuleJoiner::isWritable(uint32_t storage_class, uint32_t type) const {
    if (storage_class == spv::StorageClassStorageBuffer) return true;
    const Instruction* found = values_.find(type);
    while (found && (found->opcode == spv::OpTypeArray || found->opcode == spv::OpTypeRuntimeArray))
        found = values_.find(found->operands()[0]);
    return found && found->opcode == spv::OpTypeImage && found->operands()[5] == 2;
}

/// Names and decorations of what is there once.
void ModuleJoiner::addNotes(JoinedModule& module) {
    for (const Instruction& item : module.spirv.names)
        if (module.defined.contains(item.operands()[0])) builder_.module.names.push_back(moved(module, item));
    for (const Instruction& item : module.spirv.decorations) {
        if (!module.defined.contains(item.operands()[0])) continue;
        Instruction note = moved(module, item);
        const std::span<const uint32_t> operands = note.operands();
        values_.noteDecoration(note);
        // A copy among a shader's variables is no block.
        const bool is_block = note.opcode == spv::OpDecorate && operands[1] == spv::DecorationBlock;
        if (!is_block || !records_.contains(operands[0])) builder_.module.decorations.push_back(std::move(note));
    }
}

void ModuleJoiner::finish() {
    for (const auto& [place, variables] : resources_)
        for (const uint32_t variable : variables)
            if (variables.size() > 1) builder_.decorate(variable, {spv::DecorationAliased});
}

}  // namespace glint::shader
