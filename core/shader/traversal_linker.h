#pragma once

// For sources only: modules of a pipeline's stages put together.

#include "spirv_module.h"
#include "traversal_skeleton.h"

#include <functional>

namespace glint::shader {

/// Links the stages' modules, in the order of the source, with the skeleton that `make_skeleton` makes once it is known
/// what they need. Errors as of joinTraversal, and make_skeleton's.
Expected<SpirvModule> linkTraversal(const TraversalSource& source, std::vector<SpirvModule> stages,
                                    const std::function<Expected<SpirvModule>(const SkeletonNeeds&)>& make_skeleton);

}  // namespace glint::shader
