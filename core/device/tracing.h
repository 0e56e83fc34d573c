#pragma once

#include <glint/base/status.h>
#include <glint/device/buffer.h>
#include <glint/format/format.h>

#include <cstdint>
#include <source_location>

namespace glint {

/// An acceleration structure: triangles or boxes (bottom level), or instances of those (top level).
/// Device::createTracing() gives one that is being configured; create() sizes and allocates it; Device::buildTracing
/// fills it.
class Tracing : public Handle {
public:
    enum Type : uint8_t { TypeTriangle, TypeBound, TypeInstance };

    enum Flag : uint32_t {
        FlagNone = 0,
        FlagUpdate = 1u << 0,   ///< can be updated (refitted) after vertices have moved
        FlagCompact = 1u << 1,  ///< can be compacted
        FlagFastBuild = 1u << 2,
        FlagFastTrace = 1u << 3,
        FlagTransparent = 1u << 4,  ///< geometries are not opaque: queries see candidates
    };
    using Flags = uint32_t;

    enum InstanceFlag : uint32_t {
        InstanceCullDisable = 1u << 0,
        InstanceFlipFacing = 1u << 1,
        InstanceOpaque = 1u << 2,
        InstanceTransparent = 1u << 3,
    };

    /// One instance of a top-level structure.
    struct Instance {
        float transform[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  ///< row-major 3x4, object to world
        const Tracing* tracing = nullptr;  ///< a null pointer is an instance that is never hit
        uint32_t data = 0;                 ///< custom index, 24 bits
        uint32_t mask = 0xff;              ///< 8 bits, tested against the ray's mask
        uint32_t offset = 0;               ///< shader binding table record, 24 bits
        uint32_t flags = 0;                ///< InstanceFlag
    };

    Tracing() = default;
    explicit Tracing(detail::Object* object) : Handle(object) {}

    /// Adds a triangle geometry: `vertices` positions of `format` (FormatRGBf32) at `stride` bytes from `offset` of
    /// `buffer` (FlagTracing). An addIndexBuffer after it gives it indices; without, vertices 3i..3i+2 are triangle i.
    void addVertexBuffer(uint32_t vertices, Format format, uint32_t stride, const Buffer& buffer, uint64_t offset = 0,
                         std::source_location where = std::source_location::current());
    /// Indices (FormatRu16 or FormatRu32) of the geometry added last; three a triangle.
    void addIndexBuffer(uint32_t indices, Format format, const Buffer& buffer, uint64_t offset = 0,
                        std::source_location where = std::source_location::current());
    /// Adds a geometry of `bounds` boxes: minimum and maximum, six floats each, at `stride` bytes (a multiple of 8).
    void addBoundBuffer(uint32_t bounds, uint32_t stride, const Buffer& buffer, uint64_t offset = 0,
                        std::source_location where = std::source_location::current());
    /// Room for `instances` of a top-level structure.
    void setInstances(uint32_t instances, std::source_location where = std::source_location::current());

    /// Sizes the structure and makes room for it (in the software engine, that of what only the host builds comes with
    /// its first build). Errors: "tracing.*".
    Status create(Type type, Flags flags = FlagFastTrace, std::source_location where = std::source_location::current());

    Type getType() const;
    uint32_t getGeometries() const;
    /// Triangles or boxes of all geometries, or instances.
    uint64_t getPrimitives() const;
    /// Bytes of scratch memory that a build or an update needs.
    uint64_t getBuildSize() const;
    uint64_t getUpdateSize() const;
    /// Bytes of the structure; less after compaction. Before the first build in software: the most that it may take.
    uint64_t getMemory() const;
};

/// Both flags.
constexpr Tracing::Flags operator|(Tracing::Flag a, Tracing::Flag b) {
    return static_cast<Tracing::Flags>(a) | static_cast<Tracing::Flags>(b);
}

}  // namespace glint
