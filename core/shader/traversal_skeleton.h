#pragma once

// For sources only: the part of a joined pipeline that is the same for all, with stand-ins for the stages.

#include "shader_source.h"
#include "traversal_joiner.h"

namespace glint::shader {

/// What stages need of the skeleton.
struct SkeletonNeeds {
    std::vector<bool> resumes;  ///< stages that have been cut at their traces
    std::vector<bool> calls;    ///< stages that call executeCallableEXT: a callable one is there once for each level
    uint32_t saved_words = 0;   ///< of stages that nest, for each level
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

/// How deep rays nest at which stages may trace, 0 if none does.
uint32_t traceDepth(const TraversalSource& source, const SkeletonNeeds& needs);
/// How deep calls of callables are carried out, 0 if nobody calls.
uint32_t callableLevels(const TraversalSource& source, const SkeletonNeeds& needs);

/// The copies that the skeleton runs, by the functions stageFunction() names.
std::vector<StageCopy> stageCopies(const TraversalSource& source, const SkeletonNeeds& needs);
std::string stageFunction(const StageCopy& copy);  ///< void f()

/// A compute shader that runs the stages' functions, which are empty, and so is glintBegin. Of what stages call it has
/// glintAsk, glintCallable1, ... and glintReport.
ShaderSource skeletonSource(const TraversalSource& source, const SkeletonNeeds& needs);

}  // namespace glint::shader
