#pragma once

// For sources only: ray queries of a module replaced by calls of a library's functions.

#include "spirv_module.h"

namespace glint::shader {

/// Links `user`, a valid module with ray queries, with `library`, a module of the functions that
/// shaders/tracing/ray_query.h lists: every OpRayQuery* instruction of the entry point's code becomes a call, queries
/// become the library's GlintQuery, and every acceleration structure becomes a block of references at its own set
/// and binding: element i of it, counted through all dimensions, is at byte 16 i. The block is uniform; it is a
/// storage block where it has more than `max_uniform_references`, or a length that is not known here. Other entry
/// points of the module are dropped. All else stays as it is, instruction by instruction.
///
/// Both modules must be for the same range of versions: up to 1.3, or from 1.4.
/// Errors: "shader.tracing_unsupported" (something the library or the linker has no counterpart for, named),
/// "shader.tracing_internal" (the library lacks what ray_query.h asks for).
Expected<SpirvModule> linkRayQueries(SpirvModule user, std::string_view entry, uint32_t execution_model,
                                     const SpirvModule& library);

/// The variables of ray queries in a module, elements of arrays counted one by one: linkRayQueries gives each a number
/// below that, for which the library has to be compiled (GLINT_TRACING_QUERIES).
uint32_t countRayQueries(const SpirvModule& module);

constexpr uint32_t max_uniform_references = 1024;  ///< 16 KiB, which every device takes as a uniform block

}  // namespace glint::shader
