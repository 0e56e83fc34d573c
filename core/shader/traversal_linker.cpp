#include "traversal_linker.h"

#include "traversal_copier.h"

#include <glint/base/format_error.h>

#include <spirv/unified1/spirv.hpp>

#include <algorithm>

namespace glint::shader {

namespace {

[[noreturn]] void internal(std::string message) {
    throw RewriteRefusal{ErrorCode::Internal, "shader.tracing_internal", std::move(message)};
}

class Linker {
public:
    Linker(const TraversalSource& source, std::vector<SpirvModule> stages) : source_(source), stages_(stages.size()) {
        for (size_t i = 0; i < stages.size(); i++) {
            stages_[i].spirv = std::move(stages[i]);
            stages_[i].title =
                fmt::format("the {} shader '{}'", toString(source.stages[i].stage), source.stages[i].name);
            stages_[i].entry = entryOf(stages_[i], source.stages[i]);
        }
    }

    /// The types and resources of all stages.
    SkeletonNeeds addStages() {
        for (size_t i = 0; i < stages_.size(); i++) {
            cut(stages_[i], source_.stages[i].stage);
            joiner_.add(stages_[i]);
        }
        SkeletonNeeds needs;
        for (const JoinedModule& stage : stages_) addNeeds(needs, stage);
        const uint32_t depth = traceDepth(source_, needs), levels = depth > 1 ? depth - 1 : 0;
        if (uint64_t(levels) * needs.saved_words > max_saved_words)
            throw RewriteRefusal{
                ErrorCode::Unsupported, "shader.traversal_size",
                fmt::format("recursion depth {} keeps {} words for each of {} levels, at most {} in all can be",
                            source_.recursion_depth, needs.saved_words, levels, max_saved_words)};
        return needs;
    }

    SpirvModule run(SpirvModule skeleton, const SkeletonNeeds& needs) {
        skeleton_.spirv = std::move(skeleton);
        skeleton_.is_stage = false;
        skeleton_.title = "the skeleton";
        joiner_.add(skeleton_);
        readNames();

        const std::vector<StageCopy> copies = stageCopies(source_, needs);
        if (copies.size() > max_stage_copies)
            throw RewriteRefusal{ErrorCode::Unsupported, "shader.traversal_size",
                                 fmt::format("callable depth {} makes {} copies of {} shaders, at most {} can be",
                                             source_.callable_depth, copies.size(), stages_.size(), max_stage_copies)};
        StageCopier copier(builder_, joiner_, names_, traceDepth(source_, needs), callableLevels(source_, needs),
                           needs.saved_words);
        std::unordered_set<uint32_t> stand_ins;
        for (const StageCopy& copy : copies) {
            // The skeleton calls the copy in the place of its own, empty function.
            const uint32_t function = functionNamed(stageFunction(copy));
            stand_ins.insert(function);
            copier.copy(stages_[copy.stage], source_.stages[copy.stage].stage, copy.level,
                        joiner_.idOf(skeleton_, function));
        }
        const uint32_t begin = functionNamed("glintBegin");
        stand_ins.insert(begin);
        copier.writeBegin(joiner_.idOf(skeleton_, begin), parameterOf(begin));
        for (const Instructions& function : skeleton_.spirv.functions)
            if (!stand_ins.contains(function[0].result())) addSkeletonFunction(function);
        finish();
        return std::move(builder_.module);
    }

private:
    static uint32_t entryOf(const JoinedModule& module, const TraversalSource::Stage& stage) {
        for (const Instruction& point : module.spirv.entry_points)
            if (point.operands()[0] == executionModel(stage.stage) && point.text(2) == stage.entry)
                return point.operands()[1];
        internal(fmt::format("{} has no entry point '{}'", module.title, stage.entry));
    }

    /// Stages that may trace at their level; of others traces are left out.
    void cut(JoinedModule& stage, ShaderStage kind) {
        if (source_.recursion_depth < (kind == ShaderStage::RayGen ? 1u : 2u) || !traces(stage.spirv, stage.entry))
            return;
        try {
            stage.cut = cutAtTraces(stage.spirv, stage.entry);
        } catch (RewriteRefusal& refusal) {
            refusal.message = stage.title + refusal.message;
            throw;
        }
    }

    void addNeeds(SkeletonNeeds& needs, const JoinedModule& stage) {
        bool calls = false;
        for (const uint32_t function : stage.reached)
            for (const Instruction& item : *stage.functions.at(function))
                calls = calls || item.opcode == spv::OpExecuteCallableKHR;
        needs.resumes.push_back(!stage.cut.empty());
        needs.calls.push_back(calls);
        if (source_.stages[needs.calls.size() - 1].stage != ShaderStage::RayGen) addSaved(needs, stage);
        for (const auto& [id, variable] : stage.own) addNeeds(needs, stage, variable);
    }

    void addSaved(SkeletonNeeds& needs, const JoinedModule& stage) {
        for (const StagePiece& piece : stage.cut.pieces) {
            uint32_t words = 0;
            for (const uint32_t id : piece.live) {
                const std::string what =
                    fmt::format("{}{}{}: '{}', with which it goes on after traceRayEXT,", stage.title,
                                piece.line.empty() ? "" : ", ", piece.line, stage.nameOf(id));
                words += joiner_.values().count(stage.own.at(id).type, true, what);
            }
            needs.saved_words = std::max(needs.saved_words, words);
        }
    }

    void addNeeds(SkeletonNeeds& needs, const JoinedModule& stage, const StageVariable& variable) {
        const auto grow = [&](uint32_t& words, bool packed, std::string_view what) {
            words = std::max(words,
                             joiner_.values().count(variable.type, packed, fmt::format("{}: {}", stage.title, what)));
        };
        uint32_t record_words = 0;
        switch (variable.storage_class) {
            case spv::StorageClassRayPayloadKHR: grow(needs.payload_words, true, "its payload"); break;
            case spv::StorageClassIncomingRayPayloadKHR: grow(needs.payload_words, true, "its incoming payload"); break;
            case spv::StorageClassCallableDataKHR: grow(needs.callable_words, true, "its callable data"); break;
            case spv::StorageClassIncomingCallableDataKHR:
                grow(needs.callable_words, true, "its incoming callable data");
                break;
            case spv::StorageClassHitAttributeKHR: grow(needs.attribute_words, true, "its hit attribute"); break;
            case spv::StorageClassPushConstant: grow(needs.push_words, false, "its push constants"); break;
            case spv::StorageClassShaderRecordBufferKHR: grow(record_words, false, "its shader record"); break;
            case spv::StorageClassInput:
                if (const FrameVariable* known = frameVariable(variable.built_in); known && known->need)
                    needs.*known->need = true;
                break;
            default: break;
        }
    }

    /// The type of a function's parameter.
    uint32_t parameterOf(uint32_t id) {
        for (const Instructions& function : skeleton_.spirv.functions)
            if (function[0].result() == id) return joiner_.idOf(skeleton_, function[1].type());
        internal("a stand-in has no parameter");
    }

    /// Of the skeleton: its names of functions end with a parenthesis and their parameters.
    uint32_t functionNamed(const std::string& name) const {
        const auto found = skeleton_functions_.find(name);
        if (found == skeleton_functions_.end()) internal(fmt::format("the skeleton has no function {}", name));
        return found->second;
    }

    void readNames() {
        std::unordered_map<uint32_t, std::string> text;
        for (const Instruction& item : skeleton_.spirv.names)
            if (item.opcode == spv::OpName) text[item.operands()[0]] = item.text(1);
        for (const Instructions& function : skeleton_.spirv.functions) {
            const std::string& name = text[function[0].result()];
            skeleton_functions_[name.substr(0, name.find('('))] = function[0].result();
        }
        for (const auto& [name, id] : skeleton_functions_) names_.functions[name] = joiner_.idOf(skeleton_, id);
        for (const Instruction& item : skeleton_.spirv.globals) {
            if (item.opcode != spv::OpVariable) continue;
            const uint32_t id = joiner_.idOf(skeleton_, item.result());
            const std::optional<PointerType> pointer = builder_.pointer(builder_.typeOf(id));
            names_.variables[text[item.result()]] = {id, pointer->pointee};
        }
        const auto words = [&](const char* name, uint32_t storage_class, bool is_block) {
            const auto found = names_.variables.find(name);
            return WordArray{found == names_.variables.end() ? 0 : found->second.id, storage_class, is_block};
        };
        names_.payload = words("glint_payload", spv::StorageClassPrivate, false);
        names_.callable = words("glint_callable", spv::StorageClassPrivate, false);
        names_.saved = words("glint_saved", spv::StorageClassPrivate, false);
        names_.attributes = words("glint_attributes", spv::StorageClassPrivate, false);
        names_.records = words("glint_records", spv::StorageClassStorageBuffer, true);
        names_.push = words("glint_push", spv::StorageClassPushConstant, true);
    }

    void addSkeletonFunction(const Instructions& function) {
        Instructions body;
        for (const Instruction& item : function) {
            if (item.has_result)
                for (const Instruction* note : skeleton_.notes[item.result()]) {
                    const bool is_name = note->opcode == spv::OpName;
                    (is_name ? builder_.module.names : builder_.module.decorations)
                        .push_back(joiner_.moved(skeleton_, *note));
                }
            body.push_back(joiner_.moved(skeleton_, item));
        }
        builder_.module.functions.push_back(std::move(body));
    }

    void finish() {
        joiner_.finish();
        SpirvModule& result = builder_.module;
        // From SPIR-V 1.4 on entry points list all variables.
        Instruction entry = joiner_.moved(skeleton_, skeleton_.spirv.entry_points[0]);
        const uint32_t main = entry.operands()[1];
        const std::array operands = {uint32_t(spv::ExecutionModelGLCompute), main, 0x6e69616du, 0u};  // "main"
        entry = Instruction(spv::OpEntryPoint, 0, 0, operands, 0);
        entry.ids = {2};
        for (const Instruction& item : result.globals) {
            if (item.opcode != spv::OpVariable) continue;
            entry.ids.push_back(static_cast<uint16_t>(entry.words.size()));
            entry.words.push_back(item.result());
        }
        result.entry_points = {std::move(entry)};
        for (const Instruction& mode : skeleton_.spirv.modes) result.modes.push_back(joiner_.moved(skeleton_, mode));
        result.bound = builder_.bound();
    }

    const TraversalSource& source_;
    std::vector<JoinedModule> stages_;
    JoinedModule skeleton_;
    std::unordered_map<std::string, uint32_t> skeleton_functions_;
    SpirvBuilder builder_{1};
    ModuleJoiner joiner_{builder_};
    SkeletonNames names_;
};

}  // namespace

Expected<SpirvModule> linkTraversal(const TraversalSource& source, std::vector<SpirvModule> stages,
                                    const std::function<Expected<SpirvModule>(const SkeletonNeeds&)>& make_skeleton) {
    try {
        Linker linker(source, std::move(stages));
        const SkeletonNeeds needs = linker.addStages();
        Expected<SpirvModule> skeleton = make_skeleton(needs);
        if (!skeleton) return unexpected(skeleton.error());
        return linker.run(std::move(*skeleton), needs);
    } catch (const RewriteRefusal& refusal) {
        return unexpected(makeError(refusal.code, refusal.id, "{}", refusal.message));
    }
}

}  // namespace glint::shader
