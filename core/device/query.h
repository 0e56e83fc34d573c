#pragma once

#include <glint/device/handle.h>

#include <cstdint>

namespace glint {

/// Measures what the GPU does between beginQuery and endQuery of a recorder, once in a list. Created by
/// Device::createQuery.
class Query : public Handle {
public:
    enum Type : uint8_t {
        TypeTime,        ///< needs FeatureTimestamps
        TypeStatistics,  ///< needs FeatureStatistics; graphics and compute counters
        TypeSamples,     ///< samples that passed depth and stencil tests, within one Command
    };

    /// Counters of TypeStatistics.
    struct Statistics {
        uint64_t input_vertices = 0;
        uint64_t input_primitives = 0;
        uint64_t vertex_invocations = 0;
        uint64_t clipping_invocations = 0;
        uint64_t clipping_primitives = 0;
        uint64_t fragment_invocations = 0;
        uint64_t compute_invocations = 0;
    };

    Query() = default;
    explicit Query(detail::Object* object) : Handle(object) {}

    Type getType() const;
};

}  // namespace glint
