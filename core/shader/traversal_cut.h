#pragma once

// For sources only: a stage that calls traceRayEXT, cut into pieces that can be left at a trace and gone on with.

#include "spirv_module.h"

#include <string>

namespace glint::shader {

/// A part of a stage that runs without a break: a function without parameters.
struct StagePiece {
    static constexpr uint32_t none = ~0u;

    uint32_t function = 0;
    uint32_t after = none;  ///< the piece that goes on where this one has ended with a trace
    /// Of a piece that begins after a trace: the payload's variable, and the variables whose values from before the
    /// trace it or a later piece may read, the payload's apart.
    uint32_t payload = 0;
    std::vector<uint32_t> live;
    std::string line;  ///< the trace's, "file:7", where the module has lines
};

/// How a stage's entry point was cut. To run it: set `next` to 0 and call pieces[next] until `next` is pieces.size().
/// In a piece OpTraceRayKHR is followed by nothing but the store that sets `next` to the piece after it, and a return.
struct StageCut {
    std::vector<StagePiece> pieces;  ///< those that come later in the stage are later in the list
    uint32_t next = 0;               ///< variable (Private, uint)

    bool empty() const { return pieces.empty(); }
};

/// Whether a function that the entry point reaches calls traceRayEXT.
bool traces(const SpirvModule& module, uint32_t entry);

/// Replaces the entry point, which calls no function that traces, and none with pointers to its own variables, by its
/// pieces. Its variables and the values that one piece takes over from another become variables of the module
/// (Private). Any control flow can be cut: a construct without traces stays whole within a piece, and that of all
/// others becomes the order in which the pieces run. Throws RewriteRefusal, whose message is to follow the stage's
/// name.
StageCut cutAtTraces(SpirvModule& module, uint32_t entry);

}  // namespace glint::shader
