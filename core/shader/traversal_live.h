#pragma once

// For sources only: what of a stage's variables has to outlive a trace.

#include "traversal_cut.h"

#include <map>

namespace glint::shader {

/// The pieces that may come next, by the labels of the blocks that leave a piece; the number of pieces is the end.
using PieceExits = std::map<uint32_t, std::vector<uint32_t>>;

/// Sets `live` of the pieces that begin after a trace. Stores to a variable as a whole end what was in it before,
/// everything else counts as its use.
void findLive(const Instructions& globals, const SpirvModule& module, const std::vector<Instructions>& pieces,
              const std::vector<PieceExits>& exits, StageCut& cut);

}  // namespace glint::shader
