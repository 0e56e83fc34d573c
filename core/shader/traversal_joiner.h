#pragma once

// For sources only: the stages of a ray-tracing pipeline joined into one compute shader with ray queries.

#include <glint/base/expected.h>
#include <glint/shader/reflection.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace glint::shader {

/// A pipeline's stages and groups.
struct TraversalSource {
    static constexpr uint32_t none = ~0u;

    struct Stage {
        ShaderStage stage = ShaderStage::RayGen;
        std::string name;  ///< for messages
        std::span<const uint32_t> words;
        std::string entry = "main";
        std::vector<std::pair<uint32_t, uint32_t>> constants;  ///< ids and bits of specialisation constants
    };
    /// Indices into `stages`: `general` alone (ray generation, miss, callable), or any of the others.
    struct Group {
        uint32_t general = none;
        uint32_t closest = none;
        uint32_t first_hit = none;
        uint32_t intersection = none;
    };
    /// The tables by their numbers in shaders/tracing/pipeline.h.
    enum Table : uint8_t { Generation, Miss, Hit, Callable, Tables };

    std::string name;
    std::vector<Stage> stages;
    std::array<std::vector<Group>, Tables> groups;
    uint32_t recursion_depth = 1;  ///< traceRayEXT nests so deep; deeper calls do nothing
    uint32_t callable_depth = 2;   ///< likewise executeCallableEXT
    /// Where the blocks of the records and of the launch are, the latter at the binding after this; no shader may have
    /// that set.
    uint32_t set = 7;
    uint32_t binding = 8;
    std::array<uint32_t, 3> group_size = {8, 8, 1};
};

/// The most words (of 32 bits) that a payload, a callable's data, an attribute or a record may have.
constexpr uint32_t max_frame_words = 1024;
/// The most words that all levels of recursion together keep: they are memory of every thread that runs, 32 KiB of it.
constexpr uint32_t max_saved_words = 8192;
/// The most copies of stages: callables that call others are there once for each level.
constexpr uint32_t max_stage_copies = 256;

/// One module for the compute stage that does what the pipeline does, ray by ray: shaders/tracing/pipeline.h says what
/// its two blocks hold. Resources keep their sets and bindings, push constants their offsets; specialisation constants
/// have become fixed. The result has been validated and is not optimised.
/// Errors: "shader.traversal_unsupported" (what cannot be carried over, with its stage and, where the module has lines,
/// its line), "shader.traversal_size" (a payload or a record beyond max_frame_words, recursion beyond
/// max_saved_words, more copies than max_stage_copies), "shader.tracing_internal" (a fault of ours, with the module
/// that came of it).
Expected<std::vector<uint32_t>> joinTraversal(const TraversalSource& source);

}  // namespace glint::shader
