#pragma once

// What a recorder records: commands that know no API, the resources they name and how each is accessed. The tracker
// (core/device/detail/tracker.h) reads the accesses alone; a back end replays the commands.

#include <glint/base/error.h>
#include <glint/device/types.h>
#include <glint/format/format.h>
#include <glint/shader/reflection.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace glint::detail {

class Object;

/// Where in the pipeline an access happens. A barrier orders all earlier work of its source stages before all later
/// work of its destination stages and makes every write of the former visible to the latter.
enum class Stage : uint8_t {
    Indirect,      ///< indirect arguments
    VertexInput,   ///< vertex and index buffers
    VertexShader,  ///< all shader stages before rasterisation, task and mesh shaders
    Fragment,
    ColorTarget,  ///< colour attachments and resolves
    DepthTarget,  ///< depth and stencil attachments
    Compute,
    RayTracing,
    Copy,   ///< copies, clears
    Build,  ///< acceleration structures: builds, copies, size queries
    Host,   ///< reads by the CPU after a wait
    Count,
};
constexpr size_t stage_count = static_cast<size_t>(Stage::Count);

using StageMask = uint16_t;
constexpr StageMask bit(Stage stage) { return static_cast<StageMask>(1u << static_cast<uint32_t>(stage)); }
/// Source of an image transition after a semaphore wait or before any use: everything the wait ordered.
constexpr StageMask stage_all = 0x8000;

enum AccessFlag : uint8_t {
    AccessRead = 1,
    AccessWrite = 2,
    /// A write that keeps nothing of the old contents (whole subresource): the transition may discard them.
    AccessDiscard = 4,
};

enum class Layout : uint8_t {
    Undefined,  ///< contents are lost at the next transition
    General,    ///< storage image
    Sampled,
    ColorTarget,
    DepthTarget,
    CopySource,
    CopyDestination,
    Present,
    None,  ///< the resource is not a texture
};

/// One access of a command to a resource. For textures the slice is resolved: counts are never 0.
struct Access {
    uint32_t resource = 0;  ///< index into CommandList::resources
    Stage stage = Stage::Compute;
    uint8_t flags = AccessRead;
    Layout layout = Layout::None;
    Slice slice;
};

enum class CommandType : uint8_t {
    Dispatch,
    DispatchIndirect,
    SideDispatches,
    TraceRays,
    TraceRaysIndirect,
    BeginTarget,
    EndTarget,
    Draw,
    DrawIndexed,
    DrawIndirect,
    DrawIndexedIndirect,
    DrawMesh,
    DrawMeshIndirect,
    CopyInline,  ///< inline data to a buffer
    CopyBuffer,
    FillBuffer,
    CopyBufferToTexture,
    CopyTextureToBuffer,
    CopyTexture,
    ClearTexture,
    BuildTracings,
    CopyTracing,
    WriteTracingSize,
    BeginQuery,
    EndQuery,
    PushRegion,
    PopRegion,
    HostRead,  ///< does nothing; its accesses make writes visible to the CPU
    Present,   ///< does nothing; its access gives the picture of a window the layout to be shown in
    Barrier,   ///< explicit full barrier, in untracked sections
    Count,
};

/// What every command starts with. `size` is the whole command's bytes, a multiple of 8.
struct CommandHeader {
    CommandType type = CommandType::Barrier;
    bool untracked = false;  ///< the caller looks after hazards; layout transitions still happen
    uint16_t padding = 0;
    uint32_t size = 0;
    uint32_t first_access = 0;  ///< range of CommandList::accesses
    uint32_t access_count = 0;
    uint32_t first_shared = 0;  ///< a second range: that of the bindings, shared by commands with the same bindings
    uint32_t shared_count = 0;
};

constexpr uint32_t none = 0xffffffffu;
/// Size of a binding that reaches to the end of the buffer, or as far as the device can bind, when it is played.
constexpr uint64_t whole_buffer = ~0ull;

/// One element of a binding block, in the order of BindingLayout::resources, `count` elements each.
struct BoundResource {
    uint32_t resource = none;       ///< index into CommandList::resources; none for an inline uniform
    uint32_t second = none;         ///< sampler of a combined image and sampler
    uint64_t offset = 0;            ///< bytes into the buffer. Uniforms: 0, theirs is dynamic (below)
    uint64_t size = 0;              ///< bytes, or whole_buffer
    Slice slice;                    ///< textures, resolved
    Format format = FormatUnknown;  ///< texel buffers
};

/// The bindings of a dispatch or draw. Commands recorded with unchanged resources share `bound`, so that a back end
/// that sees the same offset again can keep its descriptors.
struct Bindings {
    uint32_t bound = none;  ///< byte offset in CommandList::bytes of the array of BoundResource, none if empty
    uint32_t bound_count = 0;
    /// Byte offset in CommandList::bytes of one uint32_t for each uniform element in layout order: its offset into the
    /// inline data if the element's resource is none, else into its buffer.
    uint32_t uniform_offsets = none;
    uint32_t uniform_count = 0;
    uint32_t push = none;  ///< byte offset in CommandList::bytes of the push constants
    uint32_t push_size = 0;
};

struct DispatchCommand {
    CommandHeader header;
    uint32_t kernel = 0;
    Bindings bindings;
    uint32_t groups[3] = {1, 1, 1};
};

struct DispatchIndirectCommand {
    CommandHeader header;
    uint32_t kernel = 0;
    Bindings bindings;
    uint32_t buffer = 0;
    uint64_t offset = 0;
};

struct SideDispatch {
    uint32_t kernel = 0;
    Bindings bindings;
    uint32_t groups = 1;
    uint32_t first_access = 0;  ///< range of CommandList::accesses, within the command's shared ones
    uint32_t access_count = 0;
};

/// Dispatches that may run side by side: none writes what another one accesses, as their own accesses say. The
/// command's first range is what they use in parts that no words of theirs tell apart: structures in the software
/// engine's heap.
struct SideDispatchesCommand {
    CommandHeader header;
    uint32_t dispatches = 0;  ///< byte offset in CommandList::bytes of an array of SideDispatch
    uint32_t count = 0;
};

/// Rays of a Traversal, from one of its ray-generation records.
struct TraceRaysCommand {
    CommandHeader header;
    uint32_t traversal = 0;
    uint32_t generation = 0;
    Bindings bindings;
    uint32_t rays[3] = {1, 1, 1};
};

struct TraceRaysIndirectCommand {
    CommandHeader header;
    uint32_t traversal = 0;
    uint32_t generation = 0;
    Bindings bindings;
    uint32_t buffer = 0;
    uint64_t offset = 0;
};

enum class LoadOperation : uint8_t { Load, Clear, Discard };
enum class StoreOperation : uint8_t { Store, Discard };

struct Attachment {
    uint32_t texture = none;
    uint32_t resolve = none;
    Slice slice;  ///< one mip level, one or more layers
    Slice resolve_slice;
    LoadOperation load = LoadOperation::Clear;
    StoreOperation store = StoreOperation::Store;
    float clear[4] = {0, 0, 0, 0};  ///< colour; depth in [0]
    uint32_t clear_stencil = 0;
};

constexpr uint32_t max_targets = 8;
constexpr uint32_t max_viewports = 16;

struct BeginTargetCommand {
    CommandHeader header;
    Attachment colors[max_targets];
    uint32_t color_count = 0;
    Attachment depth;
    uint32_t width = 0;
    uint32_t height = 0;
    uint32_t layers = 1;
};

struct EndTargetCommand {
    CommandHeader header;
};

struct VertexBinding {
    uint32_t buffer = none;
    uint64_t offset = 0;
};

/// State of a draw. Offsets as in Bindings; an inline vertex or index buffer has resource none and its offset is into
/// the inline data.
struct DrawState {
    uint32_t pipeline = 0;
    Bindings bindings;
    uint32_t vertices = none;   ///< byte offset in CommandList::bytes of the array of VertexBinding
    uint32_t vertex_count = 0;  ///< vertex buffers
    uint32_t index_buffer = none;
    uint32_t index_size = 0;  ///< bytes of an index: 2 or 4
    uint64_t index_offset = 0;
    uint32_t dynamic = none;  ///< byte offset of a DynamicState; commands with unchanged state share it
};

struct DynamicState {
    Viewport viewport;
    uint32_t viewports = none;  ///< byte offset in CommandList::bytes of the array of Viewport, if there are several
    uint32_t viewport_count = 1;
    Scissor scissor;
    uint32_t scissors = none;  ///< likewise of Scissor, one for each viewport, if there are several
    uint32_t scissor_count = 1;
    float blend[4] = {0, 0, 0, 0};
    uint32_t stencil_reference = 0;
};

struct DrawCommand {
    CommandHeader header;  ///< Draw: vertices; DrawIndexed: indices
    DrawState state;
    uint32_t count = 0;
    uint32_t instances = 1;
    uint32_t first = 0;  ///< vertex or index
    int32_t base_vertex = 0;
    uint32_t first_instance = 0;
};

struct DrawMeshCommand {
    CommandHeader header;
    DrawState state;
    uint32_t groups[3] = {1, 1, 1};
};

struct DrawIndirectCommand {
    CommandHeader header;  ///< DrawIndirect, DrawIndexedIndirect or DrawMeshIndirect
    DrawState state;
    uint32_t buffer = 0;
    uint64_t offset = 0;
    uint32_t draws = 1;  ///< at most, with a count
    uint32_t stride = 0;
    uint32_t count_buffer = none;  ///< holds a uint32_t, the number of draws
    uint64_t count_offset = 0;
};

/// Bytes of the arguments of one draw.
constexpr uint32_t indirectSize(CommandType type) {
    return type == CommandType::DrawMeshIndirect ? 12 : type == CommandType::DrawIndexedIndirect ? 20 : 16;
}

struct CopyInlineCommand {
    CommandHeader header;
    uint32_t buffer = 0;
    uint64_t offset = 0;
    uint32_t data = 0;  ///< offset into the inline data
    uint64_t size = 0;
};

struct CopyBufferCommand {
    CommandHeader header;
    uint32_t source = 0;
    uint32_t destination = 0;
    uint64_t source_offset = 0;
    uint64_t destination_offset = 0;
    uint64_t size = 0;
};

struct FillBufferCommand {
    CommandHeader header;
    uint32_t buffer = 0;
    uint32_t value = 0;
    uint64_t offset = 0;  ///< multiples of 4
    uint64_t size = 0;
};

/// CopyBufferToTexture and CopyTextureToBuffer: one mip level, `slice.layers` layers, tightly packed.
struct CopyBufferTextureCommand {
    CommandHeader header;
    uint32_t buffer = 0;
    uint32_t texture = 0;
    uint64_t offset = 0;
    Slice slice;
    Region region;  ///< resolved
};

struct CopyTextureCommand {
    CommandHeader header;
    uint32_t source = 0;
    uint32_t destination = 0;
    Slice source_slice;
    Slice destination_slice;
    Region source_region;  ///< resolved
    uint32_t x = 0, y = 0, z = 0;
};

struct ClearTextureCommand {
    CommandHeader header;
    uint32_t texture = 0;
    Slice slice;
    union {
        float f[4];
        uint32_t u[4];
    } value = {};  ///< by the format's type; depth in f[0], stencil in u[1]
};

/// One build or update. Geometry comes from the Tracing object; instances from `instances`.
struct TracingBuild {
    uint32_t tracing = 0;
    bool update = false;
    uint32_t scratch = 0;  ///< buffer
    uint64_t scratch_offset = 0;
    uint32_t instances = none;  ///< buffer of native instance records
    uint64_t instances_offset = 0;
    uint32_t instance_count = 0;
};

/// Builds that may run side by side: their scratch ranges are apart and none refers to another.
struct BuildTracingsCommand {
    CommandHeader header;
    uint32_t builds = 0;  ///< byte offset in CommandList::bytes of an array of TracingBuild
    uint32_t count = 0;
};

struct CopyTracingCommand {
    CommandHeader header;
    uint32_t source = 0;
    uint32_t destination = 0;
    bool compact = false;
};

/// Compacted size of a built structure into a query slot owned by the native structure.
struct WriteTracingSizeCommand {
    CommandHeader header;
    uint32_t tracing = 0;
};

struct QueryCommand {
    CommandHeader header;
    uint32_t query = 0;
};

struct RegionCommand {
    CommandHeader header;
    uint32_t name = 0;  ///< byte offset in CommandList::bytes of a zero-terminated string
};

struct HostReadCommand {
    CommandHeader header;
};

struct PresentCommand {
    CommandHeader header;
};

struct BarrierCommand {
    CommandHeader header;
};

/// Leaves elements that a vector makes by growing as the memory was: they are written right after.
template <class T>
struct UnsetAllocator : std::allocator<T> {
    template <class U>
    struct rebind {
        using other = UnsetAllocator<U>;
    };
    void construct(T*) noexcept {}
    template <class... Args>
    void construct(T* place, Args&&... args) {
        new (place) T(std::forward<Args>(args)...);
    }
};
using UnsetBytes = std::vector<std::byte, UnsetAllocator<std::byte>>;

/// A closed list is constant until it is recycled. Buffers keep their capacity, so that a warm frame allocates nothing.
struct CommandList {
    std::vector<std::byte> bytes;  ///< command payloads that commands point into: bindings, names
    UnsetBytes commands;           ///< commands one after the other, each a multiple of 8 bytes
    std::vector<Access> accesses;
    std::vector<Object*> resources;  ///< one reference held for each
    std::vector<uint32_t> pictures;  ///< the resources that are pictures of windows
    UnsetBytes inline_data;          ///< uploaded at submit, to an address aligned to 256 bytes
    uint32_t command_count = 0;
    uint32_t region_depth = 0;
    std::string label;  ///< of the recorder, for debuggers and lost-device messages
    Error error;

    template <class T>
    const T* at(uint32_t offset) const {
        return reinterpret_cast<const T*>(bytes.data() + offset);
    }
};

/// Calls visit(index, const CommandHeader&) for each command in order; cast by header.type.
template <class Visitor>
void forEachCommand(const CommandList& list, Visitor&& visit) {
    const std::byte* position = list.commands.data();
    for (uint32_t i = 0; i < list.command_count; i++) {
        const auto* header = reinterpret_cast<const CommandHeader*>(position);
        visit(i, *header);
        position += header->size;
    }
}

/// Calls f(Stage) for each stage of the tracker that the shader stages run in.
template <class F>
void forEachStage(ShaderMask stages, F&& f) {
    constexpr ShaderMask compute = stageBit(ShaderStage::Compute);
    constexpr ShaderMask fragment = stageBit(ShaderStage::Fragment);
    constexpr ShaderMask rays = stageBit(ShaderStage::RayGen) | stageBit(ShaderStage::RayMiss) |
                                stageBit(ShaderStage::Closest) | stageBit(ShaderStage::FirstHit) |
                                stageBit(ShaderStage::Intersection) | stageBit(ShaderStage::Callable);
    if (stages & compute) f(Stage::Compute);
    if (stages & fragment) f(Stage::Fragment);
    if (stages & rays) f(Stage::RayTracing);
    if (stages & ~(compute | fragment | rays)) f(Stage::VertexShader);
}

/// A transition of one slice of one texture.
struct ImageBarrier {
    uint32_t resource = 0;
    Slice slice;
    Layout from = Layout::Undefined;
    Layout to = Layout::Undefined;
    StageMask source = 0;  ///< 0: nothing to wait for; stage_all: after the semaphore waits of the submission
    StageMask destination = 0;
};

/// What has to happen before a command: one memory barrier over everything and any number of image transitions.
struct Barrier {
    uint32_t command = 0;  ///< index of the command it precedes; command_count for the end of the list
    StageMask source = 0;  ///< both 0: no memory barrier
    StageMask destination = 0;
    uint32_t first_image = 0;  ///< range of ResolvedList::images
    uint32_t image_count = 0;
    bool split = false;  ///< within a target: end it (storing), apply the barrier, begin it again (loading)
};

/// A list and the barriers the tracker found for it, in order of commands (at most one Barrier a command).
struct ResolvedList {
    const CommandList* list = nullptr;
    std::span<const Barrier> barriers;
    std::span<const ImageBarrier> images;
};

}  // namespace glint::detail
