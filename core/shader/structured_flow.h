#pragma once

// For sources only: the blocks of a function and what its control flow says about them.

#include "spirv_module.h"

#include <functional>
#include <map>
#include <set>
#include <unordered_map>

namespace glint::shader {

struct FlowBlock {
    uint32_t label = 0;
    Instructions phis;
    Instructions body;
    Instruction merge;  ///< of a header, else without opcode
    Instruction end;    ///< a branch, a return, or OpTraceRayKHR, whose block is the next one's only predecessor

    bool isHeader() const { return merge.opcode != 0; }
    bool isLoop() const;
    uint32_t mergeBlock() const { return merge.operands()[0]; }
    std::vector<uint32_t> targets;  ///< of `end`
};

/// A function's blocks in their order. A block is split after each trace.
class StructuredFlow {
public:
    /// `new_id` gives labels to blocks that begin after a trace.
    StructuredFlow(const Instructions& function, const std::function<uint32_t()>& new_id);

    std::vector<FlowBlock> blocks;
    Instructions variables;

    const FlowBlock& at(uint32_t label) const { return blocks[places_.at(label)]; }
    /// Branches, and from headers to the blocks that their merge instructions name.
    std::vector<uint32_t> successors(const FlowBlock& block) const;
    /// Whether a block belongs to a header's construct: structurally dominated by the header, and not by its merge
    /// block.
    bool isWithin(uint32_t label, const FlowBlock& header) const;
    /// In the order of the blocks.
    size_t place(uint32_t label) const { return places_.at(label); }
    bool isReached(uint32_t label) const { return dominators_.contains(label); }

private:
    void findDominators();
    bool dominates(uint32_t above, uint32_t label) const;

    std::unordered_map<uint32_t, size_t> places_;
    std::unordered_map<uint32_t, uint32_t> dominators_;  ///< immediate ones
};

/// The blocks that begin pieces, and the piece of each block: from such a block on everything up to the next ones.
/// Constructs of which a part begins a piece are dissolved: all that they branch to begins one, too.
class FlowPieces {
public:
    explicit FlowPieces(const StructuredFlow& flow);

    const std::set<uint32_t>& heads() const { return heads_; }
    /// The first block of the piece that a block belongs to, 0 for one that is never reached.
    uint32_t headOf(uint32_t label) const;
    bool isDissolved(uint32_t header) const { return dissolved_.contains(header); }
    /// Whether a branch leaves the piece in which it is.
    bool leaves(uint32_t from, uint32_t to) const;

private:
    bool dissolve();
    bool assign();

    const StructuredFlow& flow_;
    std::set<uint32_t> heads_;
    std::set<uint32_t> dissolved_;
    std::unordered_map<uint32_t, uint32_t> owners_;
};

}  // namespace glint::shader
