#pragma once

// For sources only: code that takes values apart into words of 32 bits and puts them together again.

#include "spirv_builder.h"

namespace glint::shader {

/// An array of uint in the module: a variable of its own, or the first member of a block.
struct WordArray {
    uint32_t variable = 0;
    uint32_t storage_class = 0;
    bool is_block = false;
    /// Words are counted from here on: the id of a uint, 0 for the very first, and a number to be added.
    uint32_t first = 0;
    uint32_t offset = 0;

    WordArray from(uint32_t index, uint32_t more = 0) const {
        WordArray result = *this;
        result.first = index;
        result.offset = more;
        return result;
    }
};

/// Values as words. Packed, every component takes a word, or two if it has 64 bits, in the order of its type's members:
/// types with the same components are the same words. Otherwise offsets and strides of the type count, in bytes.
class ValueWords {
public:
    explicit ValueWords(SpirvBuilder& builder) : builder_(builder) {}

    /// Types of the module and what decorates them, before they are asked about.
    void noteType(const Instruction& type);
    void noteDecoration(const Instruction& decoration);

    /// A type of the module, null for ids that are none.
    const Instruction* find(uint32_t type) const {
        const auto found = types_.find(type);
        return found == types_.end() ? nullptr : &found->second;
    }

    /// Words that a type takes: packed, or up to the end of its last component. Throws RewriteRefusal for types that
    /// have no words, naming `what`.
    uint32_t count(uint32_t type, bool packed, std::string_view what) const;

    /// Code that sets the variable behind `pointer` (Private) from words, and the reverse, packed.
    void load(Instructions& body, uint32_t type, uint32_t pointer, const WordArray& words, bool packed) const;
    void store(Instructions& body, uint32_t type, uint32_t pointer, const WordArray& words) const;

private:
    struct Leaf {
        std::vector<uint32_t> path;
        uint32_t type = 0;
        uint32_t offset = 0;  ///< words if packed, else bytes
        uint32_t words = 1;
    };
    struct Layout {
        uint32_t matrix_stride = 0;
        bool row_major = false;
    };

    std::vector<Leaf> leaves(uint32_t type, bool packed, std::string_view what) const;
    void gather(std::vector<Leaf>& all, Leaf at, bool packed, Layout layout, std::string_view what) const;
    uint32_t width(uint32_t type) const;
    uint32_t arrayLength(const Instruction& type) const;
    uint32_t memberValue(uint32_t type, uint32_t member, uint32_t decoration, uint32_t otherwise) const;
    uint32_t emit(Instructions& body, uint32_t opcode, uint32_t type, std::span<const uint32_t> operands) const;
    uint32_t place(Instructions& body, const WordArray& words, uint32_t offset) const;
    uint32_t fromWords(Instructions& body, const Leaf& leaf, std::array<uint32_t, 2> values) const;
    std::array<uint32_t, 2> toWords(Instructions& body, const Leaf& leaf, uint32_t value) const;

    SpirvBuilder& builder_;
    std::unordered_map<uint32_t, Instruction> types_;
    std::map<std::array<uint32_t, 3>, uint32_t> members_;  ///< structure, member, decoration
    std::unordered_map<uint32_t, uint32_t> strides_;       ///< of arrays
};

}  // namespace glint::shader
