#pragma once

// For sources only: a stage of a pipeline as functions of the joined module.

#include "traversal_module.h"
#include "traversal_skeleton.h"

namespace glint::shader {

/// The skeleton's functions and variables, by their names.
struct SkeletonNames {
    struct Variable {
        uint32_t id = 0;
        uint32_t type = 0;
    };
    std::unordered_map<std::string, uint32_t> functions;
    std::unordered_map<std::string, Variable> variables;
    WordArray payload, callable, attributes, records, push;
};

/// A built-in variable of a stage: what has it in the frame, and what it takes to have it there.
struct FrameVariable {
    uint32_t built_in;
    const char* name;
    bool SkeletonNeeds::*need;
};
/// Null for others.
const FrameVariable* frameVariable(uint32_t built_in);

/// Writes copies of stages into the joined module.
class StageCopier {
public:
    StageCopier(SpirvBuilder& builder, ModuleJoiner& joiner, const SkeletonNames& names, uint32_t trace_levels,
                uint32_t callable_levels)
        : builder_(builder),
          joiner_(joiner),
          names_(names),
          trace_levels_(trace_levels),
          callable_levels_(callable_levels) {}

    /// `id` becomes a function without parameters that does what the stage does. Throws RewriteRefusal.
    void copy(JoinedModule& module, ShaderStage stage, uint32_t level, uint32_t id);

private:
    void addVariables();
    void writeWrapper(uint32_t id);
    void readBuiltIn(const StageVariable& variable);
    void findUnwinding();
    void copyFunction(const Instructions& function);
    void copyInstruction(const Instruction& original);
    void copyNotes();
    void writeTrace(const Instruction& original);
    void writeCallable(const Instruction& original);
    void writeReport(const Instruction& original);
    void writeEnd(const char* flag);
    void writeReturn();
    void writeUnwinding();

    uint32_t idHere(uint32_t id) const;
    uint32_t asUint(uint32_t value);
    uint32_t variableHere(const StageVariable& variable) const { return local_.at(variable.id); }
    const StageVariable& ownVariable(uint32_t id, const char* what) const;
    uint32_t emit(uint32_t opcode, uint32_t type, std::span<const uint32_t> operands);
    void emitStore(uint32_t pointer, uint32_t value);
    void emitLabel(uint32_t label);
    uint32_t frame(const char* name) const { return names_.variables.at(name).id; }
    void call(const std::string& name, std::vector<uint32_t> arguments);
    [[noreturn]] void unsupported(std::string_view what) const;

    SpirvBuilder& builder_;
    ModuleJoiner& joiner_;
    const SkeletonNames& names_;
    const uint32_t trace_levels_;
    const uint32_t callable_levels_;
    std::map<uint32_t, SkeletonNames::Variable> inputs_;  ///< of compute shaders, by their built-in

    // Of the copy in the making.
    JoinedModule* module_ = nullptr;
    ShaderStage stage_ = ShaderStage::RayGen;
    uint32_t level_ = 0;
    std::unordered_map<uint32_t, uint32_t> local_;
    std::unordered_set<uint32_t> unwinding_;  ///< functions that a flag may end
    std::unordered_set<uint32_t> records_;    ///< pointers to the record's data, or into it
    Instructions body_;
    // Of the function in the making.
    uint32_t return_type_ = 0;
    uint32_t label_ = 0;
    std::unordered_set<uint32_t> continues_;
    std::unordered_map<uint32_t, uint32_t> ends_;  ///< last part of a block that had to be split, by its label
    std::string line_;
};

}  // namespace glint::shader
