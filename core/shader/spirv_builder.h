#pragma once

// For sources only: a SPIR-V module in the making, with what has to be known of its ids.

#include "spirv_module.h"

#include <initializer_list>
#include <map>
#include <optional>
#include <unordered_map>
#include <unordered_set>

namespace glint::shader {

struct PointerType {
    uint32_t storage_class = 0;
    uint32_t pointee = 0;
};

/// Types of which a module may have one alike only, and those that have to be the same in a call and its callee.
bool isSharedType(uint32_t opcode);

class SpirvBuilder {
public:
    explicit SpirvBuilder(uint32_t first_id) : next_(first_id) {}

    SpirvModule module;

    uint32_t newId() { return next_++; }
    uint32_t bound() const { return next_; }

    /// Adds a type, constant or variable to the module.
    void addGlobal(Instruction item);
    /// Keeps the type of an instruction's result; addGlobal does it by itself.
    void note(const Instruction& item);
    /// The id of a shared type or a constant alike, 0 if there is none.
    uint32_t find(const Instruction& item) const;
    /// The shared type or constant of this description, made if there is none.
    uint32_t shared(uint32_t opcode, uint32_t type, std::span<const uint32_t> operands,
                    size_t literals_from = SIZE_MAX);
    uint32_t shared(uint32_t opcode, uint32_t type, std::initializer_list<uint32_t> operands,
                    size_t literals_from = SIZE_MAX) {
        return shared(opcode, type, std::span(operands.begin(), operands.size()), literals_from);
    }
    uint32_t pointerType(uint32_t storage_class, uint32_t pointee);
    uint32_t boolType();
    uint32_t uintType();
    uint32_t constant(uint32_t value);

    void decorate(uint32_t target, std::initializer_list<uint32_t> words);
    void decorateMember(uint32_t target, uint32_t member, std::initializer_list<uint32_t> words);

    /// Of the id's value, 0 if it has none or is not known.
    uint32_t typeOf(uint32_t id) const;
    /// What a pointer type points to.
    std::optional<PointerType> pointer(uint32_t type) const;
    /// The first word of an OpConstant.
    std::optional<uint32_t> constantValue(uint32_t id) const;
    /// A variable or a parameter: pointers to these may be passed to functions.
    bool isObject(uint32_t id) const { return objects_.contains(id); }

private:
    uint32_t next_;
    std::map<std::vector<uint32_t>, uint32_t> shared_;
    std::unordered_map<uint32_t, PointerType> pointers_;
    std::unordered_map<uint32_t, uint32_t> constants_;
    std::unordered_map<uint32_t, uint32_t> types_;
    std::unordered_set<uint32_t> objects_;
};

/// What stops a rewriting; turned into an error where it began.
struct RewriteRefusal {
    ErrorCode code;
    const char* id;
    std::string message;
};

}  // namespace glint::shader
