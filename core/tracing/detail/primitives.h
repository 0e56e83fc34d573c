#pragma once

// Triangles and boxes of several geometries, as one row of primitives.

#include <glint/base/format_error.h>
#include <glint/tracing/detail/float4.h>
#include <glint/tracing/detail/hierarchy.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace glint::detail {

/// A primitive as the shader reads it, in three texels: the corners of a triangle, or minimum and maximum of a box.
struct Record {
    static constexpr uint32_t opaque_bit = 0x80000000u;

    float values[9];
    uint32_t primitive;  ///< in its geometry
    uint32_t geometry;   ///< and opaque_bit
    uint32_t row;        ///< of the primitive in the row of all geometries
};
static_assert(sizeof(Record) == 3 * sizeof(Texel));

/// False for NaN too.
inline bool allInRange(const float* values, uint32_t count) {
    bool all = true;
    for (uint32_t i = 0; i < count; i++) all &= std::abs(values[i]) <= max_coordinate;
    return all;
}

struct TriangleReader {
    using Geometry = TriangleGeometry;
    static constexpr Hierarchy::Kind kind = Hierarchy::Kind::Triangles;

    static uint32_t count(const Geometry& geometry) { return geometry.triangles; }

    static uint32_t index(const Geometry& geometry, size_t i) {
        if (geometry.index == Geometry::Index::Uint32) {
            uint32_t value;
            std::memcpy(&value, geometry.indices + 4 * i, 4);
            return value;
        }
        if (geometry.index == Geometry::Index::Uint16) {
            uint16_t value;
            std::memcpy(&value, geometry.indices + 2 * i, 2);
            return value;
        }
        return static_cast<uint32_t>(i);
    }

    /// False if an index is out of range.
    static bool inRange(const Geometry& geometry, uint32_t primitive) {
        for (uint32_t i = 0; i < 3; i++) {
            if (index(geometry, 3 * size_t(primitive) + i) >= geometry.vertices) return false;
        }
        return true;
    }
    static void read(const Geometry& geometry, uint32_t primitive, float values[9]) {
        for (uint32_t i = 0; i < 3; i++) {
            const size_t vertex = index(geometry, 3 * size_t(primitive) + i);
            std::memcpy(values + size_t(3 * i), geometry.positions + vertex * geometry.stride, 12);
        }
    }
    static bool active(const float values[9]) { return allInRange(values, 9); }
    static Box4 box(const float values[9]) {
        Box4 box;
        for (uint32_t i = 0; i < 3; i++) box.add(Float4::load3(values + size_t(3 * i)));
        return box;
    }
    static Error rangeError(const Geometry& geometry, size_t g, uint32_t primitive) {
        if (geometry.index == Geometry::Index::None) {
            return makeError(ErrorCode::InvalidArgument, "tracing.vertex_count",
                             "geometry {} has {} triangles without indices, which take {} vertices; it has {}", g,
                             geometry.triangles, 3 * uint64_t(geometry.triangles), geometry.vertices);
        }
        uint32_t largest = 0;
        for (uint32_t i = 0; i < 3; i++) largest = std::max(largest, index(geometry, 3 * size_t(primitive) + i));
        return makeError(ErrorCode::OutOfRange, "tracing.index_range",
                         "triangle {} of geometry {} has the index {}, there are {} vertices", primitive, g, largest,
                         geometry.vertices);
    }
};

struct BoxReader {
    using Geometry = BoxGeometry;
    static constexpr Hierarchy::Kind kind = Hierarchy::Kind::Boxes;

    static uint32_t count(const Geometry& geometry) { return geometry.count; }
    static bool inRange(const Geometry&, uint32_t) { return true; }
    static void read(const Geometry& geometry, uint32_t primitive, float values[9]) {
        std::memcpy(values, geometry.boxes + size_t(primitive) * geometry.stride, 24);
        values[6] = values[7] = values[8] = 0.0f;
    }
    static bool active(const float values[9]) {
        return allInRange(values, 6) && values[0] <= values[3] && values[1] <= values[4] && values[2] <= values[5];
    }
    static Box4 box(const float values[9]) { return {Float4::load3(values), Float4::load3(values + 3)}; }
    static Error rangeError(const Geometry&, size_t, uint32_t) { return {}; }
};

/// Where each geometry's primitives begin in the row, and the end.
template <class Geometry>
std::vector<uint64_t> firstPrimitives(std::span<const Geometry> geometries, uint32_t (*count)(const Geometry&)) {
    std::vector<uint64_t> first = {0};
    for (const Geometry& geometry : geometries) first.push_back(first.back() + count(geometry));
    return first;
}

}  // namespace glint::detail
