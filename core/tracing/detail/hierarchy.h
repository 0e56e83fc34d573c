#pragma once

// Bounding-volume hierarchies of Glint's own tracing engine: built on the CPU, laid out for the traversal in
// shaders/tracing. docs/tracing.md has the layout, the bounds and the measurements.

#include <glint/base/expected.h>
#include <glint/base/status.h>
#include <glint/base/thread_pool.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace glint::detail {

/// Elements that are written before they are read, so nobody clears them first.
template <class T>
class Array {
public:
    Array() = default;
    explicit Array(size_t size) : data_(std::make_unique_for_overwrite<T[]>(size)), size_(size) {}

    T* data() { return data_.get(); }
    const T* data() const { return data_.get(); }
    size_t size() const { return size_; }
    T& operator[](size_t i) { return data_[i]; }
    const T& operator[](size_t i) const { return data_[i]; }
    T* begin() { return data_.get(); }
    T* end() { return data_.get() + size_; }
    const T* begin() const { return data_.get(); }
    const T* end() const { return data_.get() + size_; }

private:
    std::unique_ptr<T[]> data_;
    size_t size_ = 0;
};

/// What a shader reads at once: 16 bytes.
struct alignas(16) Texel {
    uint32_t words[4];
    bool operator==(const Texel&) const = default;
};

/// A view of triangles in host memory: vertex i at `positions + i * stride`, three floats. A triangle with a coordinate
/// that is NaN, infinite or beyond max_coordinate is inactive: no ray meets it. So is a box with one, or with min >
/// max.
struct TriangleGeometry {
    enum class Index : uint8_t { None, Uint16, Uint32 };

    const std::byte* positions = nullptr;
    uint32_t stride = 12;
    uint32_t vertices = 0;
    const std::byte* indices = nullptr;  ///< three a triangle; without, triangle i has the vertices 3i .. 3i + 2
    Index index = Index::None;
    uint32_t triangles = 0;
    bool opaque = true;
};

/// A view of boxes in host memory: minimum and maximum, six floats, at `boxes + i * stride`.
struct BoxGeometry {
    const std::byte* boxes = nullptr;
    uint32_t stride = 24;
    uint32_t count = 0;
    bool opaque = true;
};

enum class BuildMode : uint8_t {
    Quality,  ///< surface area heuristic, optimal collapse: for tracing
    /// The same, with spatial splits: opaque triangles that are long and thin may have several records. For what is
    /// never refitted, which is an error then if there are any.
    Split,
    Fast,  ///< along a Z-order curve: for structures that live for a frame
};

/// How nodes are laid out: what the traversal is compiled for (GLINT_TRACING_NODES), so one for all hierarchies of a
/// device. docs/tracing.md has the measurements behind the choice.
enum class NodeForm : uint8_t {
    Packed,  ///< eight children in 64 bytes, boxes on a grid of 8 bits an axis: for CPUs
    Full,    ///< four children in 128 bytes, boxes of floats: for GPUs
};

constexpr NodeForm nodeFormOf(bool is_cpu) { return is_cpu ? NodeForm::Packed : NodeForm::Full; }
constexpr uint32_t texelsOf(NodeForm form) { return form == NodeForm::Packed ? 4 : 8; }
/// Largest number of nodes on a way from the root to a leaf, by construction; the traversal's stack has its room from
/// that.
constexpr uint32_t maxDepth(NodeForm form) { return form == NodeForm::Packed ? 24 : 32; }

constexpr float max_coordinate = 0x1p100f;  // 1.27e30
/// Primitives of one hierarchy, all geometries together.
constexpr uint64_t max_primitives = 1u << 24;

/// A hierarchy as the shader reads it. In texels: 4 or 8 for each node (the root is node 1: the header, of 4, has the
/// place of node 0), 3 for each primitive's record, 8 for each instance. Bit-equal for equal input, whatever the
/// number of threads.
struct Hierarchy {
    enum class Kind : uint8_t { Triangles, Boxes, Instances };

    Array<Texel> texels;
    Kind kind = Kind::Triangles;
    NodeForm form = NodeForm::Packed;
    uint32_t nodes = 0;        ///< 1 at least: the root of an empty hierarchy has no children
    uint32_t records = 0;      ///< active primitives; more with BuildMode::Split
    uint32_t inactive = 0;     ///< primitives that were left out
    uint32_t depth = 0;        ///< nodes on the longest way from the root; at most maxDepth(form)
    uint64_t build_bytes = 0;  ///< largest number of bytes held during the build, the result included

    /// Nodes of each run have no child outside of it, but for those of run 0, which is the top: for refitting.
    std::vector<uint32_t> runs;

    uint64_t bytes() const { return texels.size() * sizeof(Texel); }
    size_t firstRecord() const { return texelsOf(form) * (size_t(nodes) + 1); }
};

/// Errors: "tracing.too_large" (more than max_primitives), "tracing.index_range" (an index names no vertex;
/// geometry and triangle are named), "tracing.vertex_count" (no indices, and too few vertices).
Expected<Hierarchy> buildHierarchy(std::span<const TriangleGeometry> geometries, BuildMode mode,
                                   ThreadPool* pool = nullptr, NodeForm form = NodeForm::Packed);
Expected<Hierarchy> buildHierarchy(std::span<const BoxGeometry> geometries, BuildMode mode, ThreadPool* pool = nullptr,
                                   NodeForm form = NodeForm::Packed);

/// Takes the coordinates again, of the same geometries with the same indices, and keeps the tree. A primitive that was
/// inactive stays so; one that becomes so is never hit. Errors: "tracing.refit" (other counts than at the build).
Status refitHierarchy(Hierarchy& hierarchy, std::span<const TriangleGeometry> geometries, ThreadPool* pool = nullptr);
Status refitHierarchy(Hierarchy& hierarchy, std::span<const BoxGeometry> geometries, ThreadPool* pool = nullptr);

}  // namespace glint::detail
