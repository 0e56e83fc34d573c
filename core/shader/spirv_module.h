#pragma once

// For sources only: a SPIR-V module as a list of instructions that can be taken apart and put together.

#include <glint/base/expected.h>

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace glint::shader {

/// One instruction. `words` starts with its first word, whose length `SpirvModule::words` sets anew.
struct Instruction {
    Instruction() = default;
    /// Of plain operands, all ids but those that follow `literals_from`; `type` and `result` may be 0 for none.
    Instruction(uint32_t opcode, uint32_t type, uint32_t result, std::span<const uint32_t> operands,
                size_t literals_from = SIZE_MAX);

    uint16_t opcode = 0;
    bool has_type = false;
    bool has_result = false;
    std::vector<uint32_t> words;
    std::vector<uint16_t> ids;  ///< places in `words` that hold ids, in their order, type and result included

    uint32_t type() const { return has_type ? words[1] : 0; }
    uint32_t result() const { return has_result ? words[has_type ? 2 : 1] : 0; }
    /// Words after the type and the result.
    std::span<const uint32_t> operands() const { return std::span(words).subspan(firstOperand()); }
    std::span<uint32_t> operands() { return std::span(words).subspan(firstOperand()); }
    /// The zero-terminated text that begins at this operand.
    std::string_view text(size_t operand) const;

private:
    size_t firstOperand() const { return 1u + (has_type ? 1u : 0u) + (has_result ? 1u : 0u); }
};

using Instructions = std::vector<Instruction>;

/// The parts of a module in the order that SPIR-V prescribes.
struct SpirvModule {
    uint32_t version = 0;
    uint32_t bound = 0;
    Instructions capabilities;
    Instructions extensions;
    Instructions imports;
    Instructions memory_model;
    Instructions entry_points;
    Instructions modes;
    Instructions sources;  ///< OpString, OpSource and its kin
    Instructions names;
    Instructions processes;
    Instructions decorations;
    Instructions globals;                 ///< types, constants, variables
    std::vector<Instructions> functions;  ///< OpFunction to OpFunctionEnd each

    /// Takes a valid module apart. Error: "shader.tracing_internal" if the words are no SPIR-V.
    static Expected<SpirvModule> parse(std::span<const uint32_t> words);
    std::vector<uint32_t> words() const;

    /// All parts but the functions.
    static constexpr std::array parts = {
        &SpirvModule::capabilities, &SpirvModule::extensions,  &SpirvModule::imports, &SpirvModule::memory_model,
        &SpirvModule::entry_points, &SpirvModule::modes,       &SpirvModule::sources, &SpirvModule::names,
        &SpirvModule::processes,    &SpirvModule::decorations, &SpirvModule::globals};
};

}  // namespace glint::shader
