#pragma once

// Hierarchies built and refitted by compute kernels (shaders/tracing/build), for what changes each frame. This is the
// half on the host: a plan of dispatches for whoever has a device to play. It knows no device, reads nothing and
// depends on counts only; what is in the buffers is looked at by the kernels. docs/tracing.md has the algorithm.
//
// The result has the form that buildHierarchy gives and lies in the heap: the one row of texels that shaders trace
// through. Playing a plan, each pass after the one before has finished:
//
//   for (const BuildPass& pass : plan.passes) {
//       kernel      createShaderGLSL(kernelSource(pass.kernel), "GLINT_TRACING_MEMORY=...;GLINT_TRACING_NODES=..."),
//                   made once
//       bindings    in this order: the heap if the kernel has it (usesHeap; a storage texel buffer of FormatRGBAu32,
//                   GLINT_TRACING_BUFFERS storage buffers of 128 MiB, or none where it is reached by its address), the
//                   scratch memory, pass.inputs
//       constants   pass.constants as push constants
//       dispatch    pass.threads
//   }
//
// One build after another may use the same scratch memory; builds whose scratch memories differ may run side by side.

#include <glint/tracing/detail/hierarchy.h>

#include <array>
#include <string>

namespace glint::detail {

/// A geometry in device memory, or the instances of a top level.
struct DeviceGeometry {
    uint32_t primitives = 0;  ///< triangles, boxes or instances
    uint64_t offset = 0;      ///< bytes, a multiple of 4, of the first vertex, box or DeviceInstance in its buffer
    uint32_t stride = 12;     ///< bytes, a multiple of 4, from one to the next: 24 at least for boxes, 64 for instances
    bool opaque = true;
    // Of triangles:
    uint32_t vertices = 0;  ///< a triangle with a greater index is inactive
    TriangleGeometry::Index index = TriangleGeometry::Index::None;
    uint64_t index_offset = 0;  ///< bytes, a multiple of 2 or 4
};

/// An instance as the kernels read it.
struct DeviceInstance {
    static constexpr uint32_t none = 0xffffffffu;

    float transform[12];         ///< object to world, row-major 3x4
    uint32_t texel;              ///< of the heap, where its hierarchy begins; `none` makes it inactive
    uint32_t custom_index_mask;  ///< custom index, the mask in bits 24-31
    uint32_t offset_flags;       ///< offset, the flags in bits 24-31
    uint32_t unused;
};
static_assert(sizeof(DeviceInstance) == 64);

/// What is built: one geometry if it is of instances.
struct DeviceInput {
    Hierarchy::Kind kind = Hierarchy::Kind::Triangles;
    std::vector<DeviceGeometry> geometries;
    NodeForm form = NodeForm::Packed;  ///< what the kernels are compiled for
};

/// The programs, by what they do.
enum class BuildKernel : uint8_t {
    Begin,          ///< clears the state in front of the scratch memory
    TriangleBoxes,  ///< a box for each primitive, their common box and the number of active ones
    BoxBoxes,
    InstanceBoxes,  ///< and the instances' records
    Codes,          ///< places along the curve, as keys to sort
    SortCount,      ///< digits of each tile of keys
    SortScan,       ///< where each tile's keys with a digit go, among those with that digit
    SortScatter,
    Tree,      ///< a binary tree over the keys, with boxes and costs, from the leaves up
    Collapse,  ///< which binary nodes become nodes: one level
    ScanSum,   ///< the children of a tile of nodes
    ScanApply,
    Place,  ///< gives each node its place, and each primitive that of its record
    Header,
    Nodes,
    TriangleRecords,
    BoxRecords,
    RefitParents,  ///< of a hierarchy that exists
    RefitPlaces,   ///< where each primitive's record is
    RefitTriangles,
    RefitBoxes,
    RefitHeader,
    RefitNodes,  ///< from the leaves up
};
constexpr uint32_t build_kernels = 23;

/// GLSL of a kernel, to be compiled with the macros of shaders/tracing/memory.h and node_form.h.
std::string kernelSource(BuildKernel kernel);
/// True if it reads or writes the heap.
bool usesHeap(BuildKernel kernel);

/// The push constants: GlintBuild in shaders/tracing/build/common.h. Places in scratch memory count words.
struct BuildConstants {
    uint32_t heap_address[2];  ///< the player's, where the heap is reached by its address; else unused
    uint32_t hierarchy;        ///< first texel
    uint32_t kind;             ///< Hierarchy::Kind
    uint32_t instances;        ///< texel of the hierarchy where the instances begin
    uint32_t primitives;       ///< of all geometries
    uint32_t count;            ///< what there is to do: primitives of a geometry, tiles of keys, ...
    uint32_t step;             ///< the digit's first bit, or the level of nodes
    uint32_t levels;           ///< of nodes, at most
    uint32_t tie_bits;         ///< of the places among keys

    uint32_t boxes;
    uint32_t keys;      ///< read
    uint32_t keys_out;  ///< written
    uint32_t nodes;
    uint32_t list;    ///< of nodes to come
    uint32_t sums;    ///< of children
    uint32_t counts;  ///< of tiles

    uint32_t first;     ///< the geometry's first primitive, in the row of all
    uint32_t geometry;  ///< its index, and Record::opaque_bit
    uint32_t data;      ///< first word of its data in what is bound
    uint32_t stride;    ///< words
    uint32_t vertices;
    uint32_t index_size;  ///< words of 16 bits; 0 without indices
    uint32_t index;       ///< first index in what is bound
};
static_assert(sizeof(BuildConstants) <= 128 && sizeof(BuildConstants) % 4 == 0);

/// A storage buffer of a pass.
struct BuildBinding {
    enum class Buffer : uint8_t { Data, Indices, Scratch };  ///< Data: vertices, boxes, instances

    Buffer buffer = Buffer::Data;
    uint32_t geometry = 0;  ///< whose
    uint64_t offset = 0;    ///< bytes, a multiple of the alignment that was asked for
    /// A multiple of 4, so up to 2 bytes of it can be beyond the last of an odd number of 16-bit indices.
    uint64_t size = 0;
};

struct BuildPass {
    BuildKernel kernel = BuildKernel::Begin;
    uint32_t threads = 0;  ///< 1 at least, at most 2^20
    uint32_t input_count = 0;
    std::array<BuildBinding, 2> inputs;
    BuildConstants constants = {};
};

struct BuildPlan {
    std::vector<BuildPass> passes;
    uint64_t scratch = 0;  ///< bytes, bound as one storage buffer
};

/// What a hierarchy built on the device takes.
struct DeviceSizes {
    uint64_t texels = 0;         ///< of the heap, in the worst case; what is used is known to the header on the device
    uint32_t nodes = 0;          ///< at most
    uint64_t build_scratch = 0;  ///< bytes
};

/// Errors: "tracing.too_large" (more than max_primitives).
Expected<DeviceSizes> deviceSizes(const DeviceInput& input);

/// Builds at a texel of the heap. `alignment`: of storage bindings' offsets, bytes, at most 256
/// (Features::storageAlignment). Errors: those of deviceSizes.
Expected<BuildPlan> planBuild(const DeviceInput& input, uint32_t texel, uint32_t alignment);

/// Takes the coordinates again and keeps the tree, as refitHierarchy does: of a hierarchy built on the device or on the
/// host, with at most that many nodes (DeviceSizes::nodes, Hierarchy::nodes). Form, counts and indices are those of the
/// build. A top level takes its instances' matrices and hierarchies again too. Errors: those of deviceSizes.
Expected<BuildPlan> planRefit(const DeviceInput& input, uint32_t nodes, uint32_t texel, uint32_t alignment);

}  // namespace glint::detail
