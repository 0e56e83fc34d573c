#pragma once

// The interface a back end implements. The front end (core/device) has checked every argument against flags, sizes and
// limits before it calls: a back end reports what the driver says and nothing else. Calls that create are made from any
// thread at once; submit and the calls about queries under the device's submit lock. Native objects are deleted once no
// submitted work uses them.

#include <glint/base/expected.h>
#include <glint/base/status.h>
#include <glint/device/buffer.h>
#include <glint/device/detail/command_list.h>
#include <glint/device/features.h>
#include <glint/device/query.h>
#include <glint/device/sampler.h>
#include <glint/device/texture.h>
#include <glint/device/tracing.h>
#include <glint/device/window.h>

#include <array>
#include <bitset>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace glint::detail {

constexpr size_t queue_count = static_cast<size_t>(Queue::Count);
/// Pictures of a window that may be drawn at the same time.
constexpr size_t frames_in_flight = 2;

/// Base of what a back end makes for an object.
struct Native {
    virtual ~Native() = default;
    virtual void setName(const std::string&) {}
};

struct NativeBuffer : Native {
    void* mapped = nullptr;  ///< host address if the memory is host-visible and coherent, else nullptr
    uint64_t address = 0;    ///< device address if asked for
    uint64_t memory = 0;     ///< bytes allocated
};

struct NativeTexture : Native {
    uint64_t memory = 0;
};

struct NativeSampler : Native {};
struct NativeKernel : Native {};
struct NativePipeline : Native {};
struct NativeTraversal : Native {};
struct NativeQuery : Native {};
struct NativeTable : Native {};

struct NativeTracing : Native {
    uint64_t memory = 0;      ///< bytes of the structure
    uint64_t build_size = 0;  ///< scratch bytes, alignment included
    uint64_t update_size = 0;
    uint64_t address = 0;  ///< what an instance record refers to
};

struct NativeBufferDesc {
    uint64_t size = 0;
    Buffer::Flags flags = 0;
    bool staging = false;   ///< host memory for uploads
    bool readback = false;  ///< host memory for reads, cached
    std::string name;
};

struct NativeTextureDesc {
    TextureDesc desc;  ///< mipmaps resolved; layers counts faces of cubes
    uint32_t samples = 1;
    std::string name;
};

struct SpecializationValue {
    uint32_t id = 0;
    uint32_t value = 0;  ///< bit pattern
};

struct StageDesc {
    ShaderStage stage = ShaderStage::Compute;
    std::span<const uint32_t> words;
    std::string entry = "main";
    std::span<const SpecializationValue> constants;
};

struct KernelDesc {
    StageDesc stage;
    const BindingLayout* layout = nullptr;
    std::string name;
};

enum class Primitive : uint8_t { Point, Line, LineStrip, Triangle, TriangleStrip, Patch };
enum class FillMode : uint8_t { Solid, Line };
enum class CullMode : uint8_t { None, Back, Front };
enum class FrontMode : uint8_t { CounterClockwise, Clockwise };
enum class BlendOperation : uint8_t { Add, Subtract, ReverseSubtract, Minimum, Maximum };
enum class BlendFactor : uint8_t {
    Zero,
    One,
    SourceColor,
    InvSourceColor,
    SourceAlpha,
    InvSourceAlpha,
    DestinationColor,
    InvDestinationColor,
    DestinationAlpha,
    InvDestinationAlpha,
    Constant,
    InvConstant,
};
enum class StencilOperation : uint8_t {
    Keep,
    Zero,
    Replace,
    Invert,
    IncrementWrap,
    DecrementWrap,
    Increment,
    Decrement
};

struct VertexAttribute {
    uint32_t location = 0;
    Format format = FormatUnknown;
    uint32_t buffer = 0;
    uint32_t offset = 0;
};

struct VertexBuffer {
    uint32_t stride = 0;
    uint32_t rate = 0;  ///< 0: a vertex, 1: an instance
};

struct BlendDesc {
    bool enabled = false;
    BlendOperation color_operation = BlendOperation::Add;
    BlendFactor color_source = BlendFactor::One;
    BlendFactor color_destination = BlendFactor::Zero;
    BlendOperation alpha_operation = BlendOperation::Add;
    BlendFactor alpha_source = BlendFactor::One;
    BlendFactor alpha_destination = BlendFactor::Zero;
    uint8_t write_mask = 0xf;
};

struct StencilFace {
    bool test = false;  ///< without it, a face passes if the other one is tested
    Compare compare = Compare::Always;
    StencilOperation fail = StencilOperation::Keep;
    StencilOperation depth_fail = StencilOperation::Keep;
    StencilOperation pass = StencilOperation::Keep;
};

struct PipelineDesc {
    std::vector<StageDesc> stages;
    const BindingLayout* layout = nullptr;
    std::vector<VertexAttribute> attributes;
    std::vector<VertexBuffer> vertex_buffers;
    Primitive primitive = Primitive::Triangle;
    FillMode fill = FillMode::Solid;
    CullMode cull = CullMode::None;
    FrontMode front = FrontMode::CounterClockwise;
    bool depth_clamp = false;
    float depth_bias = 0.0f;
    float depth_slope = 0.0f;
    bool depth_test = false;
    bool depth_write = false;
    Compare depth_compare = Compare::Always;
    StencilFace stencil_front, stencil_back;
    bool hasStencilTest() const { return stencil_front.test || stencil_back.test; }
    uint8_t stencil_read_mask = 0xff, stencil_write_mask = 0xff;
    std::vector<Format> color_formats;
    std::vector<BlendDesc> blends;  ///< one for each colour format
    Format depth_format = FormatUnknown;
    uint32_t samples = 1;
    bool alpha_to_coverage = false;
    std::string name;
};

/// The tables of a ray-tracing pipeline's records.
enum class RayTable : uint8_t { Generation, Miss, Hit, Callable, Count };
constexpr size_t ray_tables = static_cast<size_t>(RayTable::Count);

/// A ray-tracing pipeline with its binding table, which the back end writes before the pipeline is used.
struct TraversalDesc {
    /// Indices into `stages`: `general` alone (ray generation, miss, callable), or any of the others.
    struct Group {
        uint32_t general = none;
        uint32_t closest = none;
        uint32_t first_hit = none;
        uint32_t intersection = none;
    };
    struct Record {
        uint32_t group = 0;
        std::span<const std::byte> data;
    };
    std::vector<StageDesc> stages;
    std::vector<Group> groups;
    std::array<std::vector<Record>, ray_tables> tables;
    const BindingLayout* layout = nullptr;
    uint32_t recursion_depth = 1;
    uint32_t callable_depth = 2;
    std::string name;
};

struct TracingGeometry {
    uint32_t vertices = 0;
    Format vertex_format = FormatUnknown;
    uint32_t vertex_stride = 0;
    uint64_t vertex_offset = 0;
    Object* vertex_buffer = nullptr;  ///< the Tracing object holds the references
    uint32_t indices = 0;
    Format index_format = FormatUnknown;
    uint64_t index_offset = 0;
    Object* index_buffer = nullptr;
    uint32_t bounds = 0;
    uint32_t bound_stride = 0;
    uint64_t bound_offset = 0;
    Object* bound_buffer = nullptr;
};

struct NativeTracingDesc {
    Tracing::Type type = Tracing::TypeTriangle;
    Tracing::Flags flags = 0;
    std::vector<TracingGeometry> geometries;
    uint32_t instances = 0;
    /// Not 0: storage of this many bytes for a compacted copy; nothing is sized.
    uint64_t compacted_size = 0;
    std::string name;
};

/// What a window of the system is like, and what its user did since somebody last asked.
struct WindowEvents {
    uint32_t width = 0;  ///< pixels
    uint32_t height = 0;
    bool hidden = false;
    bool focused = false;
    bool close = false;  ///< was asked for
    Vector2f mouse = {0, 0};
    std::bitset<Window::ButtonCount> buttons, pressed_buttons;
    std::bitset<Window::KeyCount> keys, pressed_keys;
    Vector2f wheel = {0, 0};
    std::string text;
};

/// A window of the system and the pictures that it shows in turn. All but present() from the thread of windows alone.
struct NativeWindow : Native {
    static constexpr uint32_t no_picture = ~0u;

    struct Pictures {
        TextureDesc desc;
        WindowDesc::Sync sync = WindowDesc::Sync::Vertical;
        std::vector<std::unique_ptr<NativeTexture>> textures;  ///< none while the window has no area
    };

    /// Delivers the events of all windows; sleeps until there are some, but no longer than this, if none of the
    /// process's windows is shown.
    virtual void poll(uint64_t nanoseconds) = 0;
    virtual WindowEvents takeEvents() = 0;
    virtual void setTitle(const std::string& title) = 0;
    virtual void setSize(uint32_t width, uint32_t height) = 0;
    virtual void setHidden(bool hidden) = 0;

    /// New pictures, of the size that the window has now. What is under way with the ones before goes on.
    /// Errors: "window.format", "window.lost".
    virtual Expected<Pictures> createPictures() = 0;
    /// Which picture is next; no_picture, without an error, if none gets free for a while or they are outdated.
    virtual Expected<uint32_t> acquire() = 0;
    /// Shows the picture that a submission has handed over; under the submit lock. Errors: "window.lost".
    virtual Status present() = 0;

    /// The pictures do not suit the window any more.
    bool outdated = true;
};

struct TimelinePoint {
    Queue queue = Queue::Main;
    uint64_t value = 0;
};

/// Lists for one queue. `value` is the queue's next time-line value, signaled when all of it is done.
struct Submission {
    Queue queue = Queue::Main;
    std::span<const ResolvedList> lists;
    std::span<const TimelinePoint> waits;  ///< before the first command
    uint64_t value = 0;
    /// Windows whose acquired picture these lists are the first to use: it has to be free before they draw or copy.
    std::span<NativeWindow* const> acquired;
    /// The window whose picture is presented next, once all of it is done.
    NativeWindow* presented = nullptr;
};

/// What createDevice needs.
struct BackendDesc {
    std::string adapter;  ///< index, part of a name, or empty for the best
    FeatureMask required = 0;
    FeatureMask optional = 0;
    bool validation = false;
    std::function<void(const Error&, bool warning)> message;
};

struct MemoryUse {
    uint64_t bytes = 0;  ///< device memory allocated
    uint64_t allocations = 0;
    uint64_t objects_created = 0;  ///< native objects created so far
};

class Backend {
public:
    virtual ~Backend() = default;

    virtual const DeviceInfo& info() const = 0;
    virtual const Features& features() const = 0;
    /// True if the adapter has a queue of this kind of its own.
    virtual bool hasQueue(Queue queue) const = 0;
    /// Which uses the adapter allows for a format: Texture::Flag bits, plus sampling in bit 31.
    virtual uint32_t formatSupport(Format format, Texture::Type type) const = 0;
    virtual bool vertexFormatSupport(Format format) const = 0;

    virtual Expected<std::unique_ptr<NativeBuffer>> createBuffer(const NativeBufferDesc& desc) = 0;
    virtual Expected<std::unique_ptr<NativeTexture>> createTexture(const NativeTextureDesc& desc) = 0;
    virtual Expected<std::unique_ptr<NativeSampler>> createSampler(const SamplerDesc& desc) = 0;
    /// For a TableContents, whose entries are set by the time it is played.
    virtual Expected<std::unique_ptr<NativeTable>> createTable(const std::string& name) = 0;
    virtual Expected<std::unique_ptr<NativeKernel>> createKernel(const KernelDesc& desc) = 0;
    virtual Expected<std::unique_ptr<NativePipeline>> createPipeline(const PipelineDesc& desc) = 0;
    virtual Expected<std::unique_ptr<NativeTraversal>> createTraversal(const TraversalDesc& desc) = 0;
    virtual Expected<std::unique_ptr<NativeTracing>> createTracing(const NativeTracingDesc& desc) = 0;
    virtual Expected<std::unique_ptr<NativeQuery>> createQuery(Query::Type type) = 0;
    /// Called with FeaturePresent only. Errors: "window.no_display", "window.create", "window.unsupported",
    /// "window.thread".
    virtual Expected<std::unique_ptr<NativeWindow>> createWindow(const WindowDesc& desc) = 0;

    /// Bytes of one instance record.
    virtual uint32_t instanceSize() const = 0;
    /// Writes native records; `tracings[i]` is the structure of instance i or nullptr.
    virtual void writeInstances(std::span<const Tracing::Instance> instances,
                                std::span<const NativeTracing* const> tracings, void* records) const = 0;
    /// Result of the last WriteTracingSize, once it is done.
    virtual Expected<uint64_t> tracingSize(NativeTracing& tracing) = 0;
    /// Result words of a query that is done: Time {begin, end} in ns, Samples {count}, Statistics in declared order.
    virtual Expected<std::array<uint64_t, 7>> queryResult(NativeQuery& query) = 0;

    virtual Status submit(const Submission& submission) = 0;
    /// Highest value of the queue's time line that is done.
    virtual uint64_t completed(Queue queue) = 0;
    /// Errors: "fence.timeout", "device.lost".
    virtual Status wait(std::span<const TimelinePoint> points, uint64_t nanoseconds) = 0;
    virtual MemoryUse memoryUse() const = 0;
};

}  // namespace glint::detail
