#pragma once

// For sources only: one module among those that become a pipeline's shader.

#include "spirv_builder.h"
#include "traversal_cut.h"
#include "traversal_joiner.h"
#include "value_words.h"

namespace glint::shader {

/// A variable that every copy of a stage has for itself.
struct StageVariable {
    uint32_t id = 0;       ///< the stage's
    uint32_t pointer = 0;  ///< types in the joined module
    uint32_t type = 0;
    uint32_t storage_class = 0;  ///< as the stage has it
    uint32_t built_in = ~0u;
    uint32_t initializer = 0;  ///< in the joined module
};

/// A stage's module, or the skeleton's, on its way into the joined one.
struct JoinedModule {
    SpirvModule spirv;
    std::string title;  ///< for messages: "the Closest shader 'name'"
    bool is_stage = true;
    uint32_t entry = 0;                          ///< function
    StageCut cut;                                ///< instead of the entry, if it has pieces
    std::unordered_map<uint32_t, uint32_t> ids;  ///< of the module to the joined one's
    std::map<uint32_t, StageVariable> own;       ///< by the module's id
    std::unordered_map<uint32_t, const Instructions*> functions;
    std::vector<uint32_t> reached;                                        ///< functions from the entry on, in order
    std::unordered_set<uint32_t> used;                                    ///< ids in them
    std::unordered_set<uint32_t> defined;                                 ///< globals that came from here
    std::unordered_map<uint32_t, std::vector<const Instruction*>> notes;  ///< names and decorations of an id
    std::unordered_map<uint32_t, std::string> strings;                    ///< OpString
    std::unordered_map<uint32_t, uint32_t> built_ins;

    /// An id's, for messages; empty where the module has none.
    std::string_view nameOf(uint32_t id) const;
};

class ModuleJoiner {
public:
    explicit ModuleJoiner(SpirvBuilder& builder) : builder_(builder), values_(builder) {}

    /// Takes in all but functions. Throws RewriteRefusal.
    void add(JoinedModule& module);
    /// Once all are in: says which resources share a binding.
    void finish();

    /// The id that stands for a module's, given out where it is first asked for.
    uint32_t idOf(JoinedModule& module, uint32_t id);
    Instruction moved(JoinedModule& module, Instruction instruction);
    const ValueWords& values() const { return values_; }

private:
    void addHeader(JoinedModule& module);
    void addGlobal(JoinedModule& module, const Instruction& original);
    bool addVariable(JoinedModule& module, const Instruction& original, const Instruction& item);
    void addNotes(JoinedModule& module);
    bool isWritable(uint32_t storage_class, uint32_t type) const;

    SpirvBuilder& builder_;
    ValueWords values_;
    std::unordered_set<uint32_t> capabilities_;
    std::unordered_set<std::string> extensions_;
    std::unordered_map<std::string, uint32_t> imports_;
    std::unordered_set<uint32_t> records_;        ///< structures of shaderRecordEXT and push-constant blocks
    std::map<uint32_t, uint32_t> tracing_types_;  ///< by their opcode
    std::map<std::pair<uint32_t, uint32_t>, std::vector<uint32_t>> resources_;  ///< writable ones, by set and binding
};

}  // namespace glint::shader
