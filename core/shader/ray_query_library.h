#pragma once

// For sources only: the functions of a traversal library (shaders/tracing/ray_query.h), brought into another module.

#include "spirv_builder.h"

#include <deque>
#include <string_view>

namespace glint::shader {

/// The library's function that stands for an instruction with ray queries; its parameters are the instruction's
/// operands. Null for any other instruction.
const char* rayQueryFunction(uint32_t opcode);

/// A function of the library, its types by their ids in the module in the making.
struct LibraryFunction {
    uint32_t id = 0;  ///< the library's
    const Instructions* code = nullptr;
    uint32_t return_type = 0;
    std::vector<uint32_t> parameters;
};

/// Puts a library's types and variables into a module, as its first globals, and then those functions that are asked
/// for. Ids of the library, which has to outlive this, are moved up by `offset`. Throws RewriteRefusal,
/// "shader.tracing_internal".
class RayQueryLibrary {
public:
    RayQueryLibrary(const SpirvModule& library, uint32_t offset, SpirvBuilder& builder);

    uint32_t queryType() const { return query_type_; }          ///< GlintQuery
    uint32_t referenceType() const { return reference_type_; }  ///< of an acceleration structure: uvec2
    const LibraryFunction& function(std::string_view name) const;

    /// The id of a function whose query is in this storage class; it is brought in by importPending.
    uint32_t import(const LibraryFunction& function, uint32_t storage_class);
    void importPending();
    /// Once all is imported: drops the library's globals that nothing needs, adds names and decorations of the others,
    /// and returns its variables that are left.
    Instructions sweep();

private:
    struct Import {
        const LibraryFunction* function = nullptr;
        uint32_t storage_class = 0;
        uint32_t id = 0;
    };

    uint32_t moved(uint32_t id) const { return id + offset_; }
    Instruction moved(const Instruction& instruction) const;
    void copyNotes(uint32_t library_id, uint32_t id);
    void importFunction(const Import& item);
    void retarget(Instruction& item, const Instruction& original, const Import& import_item,
                  std::unordered_set<uint32_t>& queries);

    const uint32_t offset_;
    SpirvBuilder& builder_;
    std::map<std::string_view, uint32_t> names_;
    std::unordered_map<uint32_t, LibraryFunction> functions_;
    std::unordered_map<uint32_t, std::vector<const Instruction*>> notes_;  ///< names and decorations of an id
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> imports_;
    std::deque<Import> pending_;
    size_t globals_ = 0;  ///< how many of the module's first globals are the library's
    uint32_t query_type_ = 0;
    uint32_t reference_type_ = 0;
};

}  // namespace glint::shader
