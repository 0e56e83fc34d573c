#pragma once

// For sources only: the part of a joined pipeline that is the same for all, with stand-ins for the stages.

#include "shader_source.h"
#include "traversal_joiner.h"

namespace glint::shader {

/// What stages need of the skeleton.
struct SkeletonNeeds {
    /// Stages that call traceRayEXT or executeCallableEXT: there is one copy of those for each level.
    std::vector<bool> traces, calls;
    uint32_t payload_words = 0;
    uint32_t callable_words = 0;
    uint32_t attribute_words = 0;
    uint32_t push_words = 0;
    bool custom_index = false;
    bool object_ray = false;
    bool to_world = false;
    bool to_object = false;
};

/// A copy of a stage: level 0 where one copy is enough.
struct StageCopy {
    uint32_t stage = 0;
    uint32_t level = 0;
};

/// How deep calls are carried out, 0 if nobody calls.
uint32_t traceLevels(const TraversalSource& source, const SkeletonNeeds& needs);
uint32_t callableLevels(const TraversalSource& source, const SkeletonNeeds& needs);

/// The copies that the skeleton runs, by the functions stageFunction() names.
std::vector<StageCopy> stageCopies(const TraversalSource& source, const SkeletonNeeds& needs);
std::string stageFunction(const StageCopy& copy);  ///< void f()

/// A compute shader that runs the stages' functions, which are empty. Of what stages call it has glintTrace1, ...,
/// glintCallable1, ... and glintReport, and the queries glint_query1, ... that glintTrace1, ... go on with.
ShaderSource skeletonSource(const TraversalSource& source, const SkeletonNeeds& needs);

}  // namespace glint::shader
