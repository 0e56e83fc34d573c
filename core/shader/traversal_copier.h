#pragma once

// For sources only: a stage of a pipeline as functions of the joined module.

#include "traversal_module.h"
#include "traversal_skeleton.h"

#include <functional>

namespace glint::shader {

/// The skeleton's functions and variables, by their names.
struct SkeletonNames {
    struct Variable {
        uint32_t id = 0;
        uint32_t type = 0;
    };
    std::unordered_map<std::string, uint32_t> functions;
    std::unordered_map<std::string, Variable> variables;
    WordArray payload, callable, attributes, records, push, saved;
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
    StageCopier(SpirvBuilder& builder, ModuleJoiner& joiner, const SkeletonNames& names, uint32_t depth,
                uint32_t callable_levels, uint32_t saved_words)
        : builder_(builder),
          joiner_(joiner),
          names_(names),
          depth_(depth),
          callable_levels_(callable_levels),
          saved_words_(saved_words) {}

    /// `id` becomes a function without parameters that does what the stage does; of one that has pieces it runs those
    /// that can run now. Throws RewriteRefusal.
    void copy(JoinedModule& module, ShaderStage stage, uint32_t level, uint32_t id);
    /// Once all are copied: `id` becomes the skeleton's glintBegin, for the structures that the stages trace.
    void writeBegin(uint32_t id, uint32_t flags_pointer);

private:
    void addVariables();
    void beginFunction(uint32_t id);
    void endFunction();
    void writeStart();
    void writeFinish();
    void writeWrapper(uint32_t id);
    void writePieces(uint32_t id);
    uint32_t isAbove();
    void writeSaved(const StagePiece& piece, bool saves);
    WordArray savedWords();
    void writeIf(uint32_t condition, const std::function<void()>& body);
    bool isNested() const { return stage_ != ShaderStage::RayGen; }
    void readBuiltIn(const StageVariable& variable);
    void findUnwinding();
    void copyFunction(const Instructions& function);
    void copyInstruction(const Instruction& original);
    void copyNotes();
    void writeTrace(const Instruction& original);
    void writeStructure(uint32_t id);
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
    const uint32_t depth_;
    const uint32_t callable_levels_;
    const uint32_t saved_words_;
    std::map<uint32_t, SkeletonNames::Variable> inputs_;  ///< of compute shaders, by their built-in

    /// A structure that stages trace: a variable, an element of one, or an address.
    struct Structure {
        uint32_t variable = 0;  ///< 0 for an address
        uint32_t type = 0;      ///< of structures
        uint32_t element = 0;   ///< of a place in the variable, 0 if it has none
        bool operator==(const Structure&) const = default;
    };
    std::vector<Structure> structures_;
    std::map<std::array<uint32_t, 3>, uint32_t> places_;  ///< a variable, by its set, binding and type

    // Of the copy in the making.
    JoinedModule* module_ = nullptr;
    ShaderStage stage_ = ShaderStage::RayGen;
    uint32_t level_ = 0;
    std::unordered_map<uint32_t, uint32_t> local_;
    std::unordered_set<uint32_t> unwinding_;  ///< functions that a flag may end
    std::unordered_set<uint32_t> records_;    ///< pointers to the record's data, or into it
    Instructions body_;
    // Of the function in the making.
    const StagePiece* piece_ = nullptr;
    std::unordered_map<uint32_t, const Instruction*> definitions_;
    uint32_t return_type_ = 0;
    uint32_t label_ = 0;
    std::unordered_set<uint32_t> continues_;
    std::unordered_map<uint32_t, uint32_t> ends_;  ///< last part of a block that had to be split, by its label
    std::string line_;
};

}  // namespace glint::shader
