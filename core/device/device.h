#pragma once

#include <glint/base/expected.h>
#include <glint/base/status.h>
#include <glint/device/buffer.h>
#include <glint/device/command.h>
#include <glint/device/compute.h>
#include <glint/device/features.h>
#include <glint/device/fence.h>
#include <glint/device/handle.h>
#include <glint/device/kernel.h>
#include <glint/device/pipeline.h>
#include <glint/device/query.h>
#include <glint/device/sampler.h>
#include <glint/device/shader.h>
#include <glint/device/table.h>
#include <glint/device/target.h>
#include <glint/device/texture.h>
#include <glint/device/tracing.h>
#include <glint/device/traversal.h>
#include <glint/device/types.h>
#include <glint/device/window.h>

#include <array>
#include <functional>
#include <initializer_list>
#include <source_location>
#include <span>
#include <string>
#include <vector>

namespace glint {

/// A message of a device: what broke (errors that handles and recorders carry are told here at once, too) or what looks
/// wrong (warnings of the validation layers).
struct Message {
    enum class Severity : uint8_t { Warning, Error };
    Severity severity = Severity::Error;
    Error error;
};
/// Hears every message; from any thread, and must not call the device.
using MessageCallback = std::function<void(const Message&)>;

/// How a device is chosen and made.
struct DeviceDesc {
    std::string api;                     ///< "vulkan" or "null"; empty: $GLINT_API, else "vulkan"
    std::string adapter;                 ///< index or part of a name; empty: $GLINT_ADAPTER, else the best
    FeatureMask required = FeatureNone;  ///< creation fails without them
    FeatureMask optional = FeatureAll;   ///< enabled where the adapter has them
    /// Who answers ray queries and runs ray-tracing pipelines. Auto: $GLINT_TRACING ("auto", "driver", "software"),
    /// else as TracingEngine says.
    TracingEngine tracing = TracingEngine::Auto;
    /// Khronos validation layer with synchronisation checks. Default: $GLINT_VALIDATION is 1, or a debug build.
    enum class Validation : uint8_t { Default, Off, On } validation = Validation::Default;
    /// Called from any thread, must not call the device. Empty: errors and warnings go to the log.
    MessageCallback message;
};

/// Memory and objects that a device holds.
struct DeviceMemory {
    uint64_t bytes = 0;  ///< of device memory
    uint64_t allocations = 0;
    uint64_t objects_created = 0;  ///< native objects made so far, released ones included
};

/// A recorder for Device::submit.
class SubmitItem {
public:
    SubmitItem(Recorder& recorder) : recorder_(&recorder) {}
    Recorder& recorder() const { return *recorder_; }

private:
    Recorder* recorder_;
};

/// An adapter opened for use; makes everything else. All methods may be called from any thread.
class Device : public Handle {
public:
    using Where = std::source_location;

    Device() = default;
    explicit Device(detail::Object* object) : Handle(object) {}

    /// Opens an adapter. On failure the handle carries the error: "device.no_driver", "device.no_adapter",
    /// "device.unsupported" (naming what is missing on which adapter), "device.api", "device.tracing".
    static Device create(const DeviceDesc& desc = {}, Where where = Where::current());
    /// The adapters of an API.
    static Expected<std::vector<DeviceInfo>> adapters(std::string_view api = {}, Where where = Where::current());

    const Features& getFeatures() const;
    const DeviceInfo& getInfo() const;
    DeviceMemory getMemory() const;
    /// True if the adapter can use the format this way (all flags at once, and sampling).
    bool hasTexture(Format format, Texture::Flags flags = 0, Texture::Type type = Texture::Type2D) const;
    /// True if work for the queue runs beside Queue::Main.
    bool hasQueue(Queue queue) const;

    // Objects. A failed creation gives a handle that carries the error.

    /// Errors: "buffer.size_zero", "buffer.too_large", "buffer.feature", "device.out_of_memory".
    Buffer createBuffer(Buffer::Flags flags, uint64_t size, std::string_view name = {}, Where where = Where::current());
    template <class T, size_t N>
    Buffer createBuffer(Buffer::Flags flags, std::span<T, N> data, std::string_view name = {},
                        Where where = Where::current()) {
        return createBuffer(flags, data.data(), data.size_bytes(), name, where);
    }
    Buffer createBuffer(Buffer::Flags flags, const void* data, uint64_t size, std::string_view name = {},
                        Where where = Where::current());

    /// Errors: "texture.size", "texture.format", "texture.samples", "texture.layers", "texture.mipmaps",
    /// "device.out_of_memory".
    Texture createTexture(const TextureDesc& desc, std::string_view name = {}, Where where = Where::current());
    Texture createTexture2D(Format format, uint32_t width, uint32_t height, Texture::Flags flags = 0,
                            std::string_view name = {}, Where where = Where::current());
    Texture createTexture3D(Format format, uint32_t width, uint32_t height, uint32_t depth, Texture::Flags flags = 0,
                            std::string_view name = {}, Where where = Where::current());
    Texture createTextureCube(Format format, uint32_t size, Texture::Flags flags = 0, std::string_view name = {},
                              Where where = Where::current());

    /// Errors: "sampler.anisotropy", "sampler.lod", "sampler.reduction", "sampler.border".
    Sampler createSampler(const SamplerDesc& desc = {}, std::string_view name = {}, Where where = Where::current());
    Sampler createSampler(Sampler::Filter filter, Sampler::WrapMode wrap = Sampler::WrapModeClamp,
                          Where where = Where::current());

    /// Tables of `count` entries, with nothing in them. Errors: "table.feature", "table.count".
    TextureTable createTextureTable(uint32_t count, std::string_view name = {}, Where where = Where::current());
    BufferTable createBufferTable(uint32_t count, std::string_view name = {}, Where where = Where::current());

    Kernel createKernel(std::string_view name = {}, Where where = Where::current());
    Pipeline createPipeline(std::string_view name = {}, Where where = Where::current());
    Target createTarget(std::string_view name = {}, Where where = Where::current());
    /// A target with one colour texture and, if given, a depth texture.
    Target createTarget(const Texture& color, const Texture& depth = {}, Where where = Where::current());
    Query createQuery(Query::Type type, std::string_view name = {}, Where where = Where::current());
    Fence createFence(std::string_view name = {}, Where where = Where::current());
    /// Opens a window. Nothing before this call touches the window system. Errors: "window.no_display" (there is none
    /// to open it on), "window.create" (the system refuses), "window.unsupported" (the adapter cannot present to it, or
    /// the device was made without FeaturePresent), "window.size", "window.format", "window.thread".
    Window createWindow(const WindowDesc& desc = {}, Where where = Where::current());

    /// A structure to configure. Errors of the short forms as of Tracing::create.
    Tracing createTracing(std::string_view name = {}, Where where = Where::current());
    /// A top-level structure with these instances, which buildTracing builds.
    Tracing createTracing(std::span<const Tracing::Instance> instances, Tracing::Flags flags = Tracing::FlagFastTrace,
                          std::string_view name = {}, Where where = Where::current());
    Tracing createTracing(std::initializer_list<Tracing::Instance> instances, Where where = Where::current()) {
        return createTracing(std::span(instances.begin(), instances.size()), Tracing::FlagFastTrace, {}, where);
    }

    /// A ray-tracing pipeline to configure. Errors: "device.unsupported" without Features::rayTracing.
    Traversal createTraversal(std::string_view name = {}, Where where = Where::current());

    // Recorders.

    Compute createCompute(Queue queue = Queue::Main, std::string_view name = {}, Where where = Where::current());
    /// Errors: "target.empty", "target.size", "target.samples".
    Command createCommand(const Target& target, std::string_view name = {}, Where where = Where::current());

    // Transfers and builds: queued, and played before the next submit, in the order of the calls.

    void setBuffer(const Buffer& buffer, uint64_t offset, const void* data, uint64_t size,
                   Where where = Where::current());
    template <class T, size_t N>
    void setBuffer(const Buffer& buffer, std::span<T, N> data, Where where = Where::current()) {
        setBuffer(buffer, 0, data.data(), data.size_bytes(), where);
    }
    void copyBuffer(const Buffer& destination, uint64_t destination_offset, const Buffer& source,
                    uint64_t source_offset, uint64_t size, Where where = Where::current());
    void clearBuffer(const Buffer& buffer, uint32_t value = 0, uint64_t offset = 0, uint64_t size = 0,
                     Where where = Where::current());
    void setTexture(const Texture& texture, const void* data, uint64_t size, const Slice& slice = {},
                    const Region& region = {}, Where where = Where::current());
    void copyTexture(const Texture& destination, const Slice& destination_slice, const Texture& source,
                     const Slice& source_slice, const Region& source_region = {}, uint32_t x = 0, uint32_t y = 0,
                     uint32_t z = 0, Where where = Where::current());
    void clearTexture(const Texture& texture, const Color& color, const Slice& slice = {},
                      Where where = Where::current());
    void createMipmaps(const Texture& texture, Where where = Where::current());
    void setTracing(const Tracing& tracing, std::span<const Tracing::Instance> instances,
                    Where where = Where::current());
    /// With a scratch buffer of the caller's of at least getBuildSize() bytes. In the software engine structures made
    /// without FlagFastBuild and FlagUpdate are built at once on the CPU's cores, as by buildTracings.
    void buildTracing(const Tracing& tracing, const Buffer& scratch, Where where = Where::current());
    void buildTracing(const Tracing& tracing, Where where = Where::current());
    void updateTracing(const Tracing& tracing, const Buffer& scratch, Where where = Where::current());
    void updateTracing(const Tracing& tracing, Where where = Where::current());

    /// Builds many structures, bottom levels before top levels, in as many batches as the scratch buffer asks for (the
    /// SDK brings one if it is null). With Tracing::FlagCompact those made with that flag are compacted, which waits.
    /// The software engine waits for the geometry, too, and builds bottom levels on the CPU's cores. Errors:
    /// "tracing.scratch" if the buffer is smaller than the largest getBuildSize(); "tracing.index_range",
    /// "tracing.heap" in software.
    Status buildTracings(std::span<const Tracing> tracings, const Buffer& scratch, Tracing::Flags flags = 0,
                         Where where = Where::current());
    Status buildTracings(std::initializer_list<Tracing> tracings, Tracing::Flags flags = 0,
                         Where where = Where::current()) {
        return buildTracings(std::span(tracings.begin(), tracings.size()), Buffer(), flags, where);
    }

    /// Accepted as in the tutorials, checked, and without effect: hazards are tracked.
    void flushBuffer(const Buffer& buffer, Where where = Where::current());
    void flushBuffers(std::initializer_list<Buffer> buffers, Where where = Where::current());
    void flushTexture(const Texture& texture, Where where = Where::current());
    void flushTextures(std::initializer_list<Texture> textures, Where where = Where::current());
    void flushTracing(const Tracing& tracing, Where where = Where::current());
    void flushTracings(std::initializer_list<Tracing> tracings, Where where = Where::current());

    // Submission.

    /// Plays the lists in this order, after the queued transfers. Recorders are closed and cannot be submitted again
    /// ("submit.twice"). The first error of any of them, or of a queued transfer, is returned and nothing is played;
    /// after an error of a list the transfers stay queued.
    /// All recorders must be for one queue ("submit.queue").
    Status submit(std::initializer_list<SubmitItem> items, const Fence& fence = {}, Where where = Where::current());
    Status submit(Recorder& recorder, const Fence& fence = {}, Where where = Where::current()) {
        return submit({SubmitItem(recorder)}, fence, where);
    }
    Status submit(Recorder&& recorder, Where where = Where::current()) {
        return submit({SubmitItem(recorder)}, {}, where);
    }
    /// Plays what is queued.
    Status flush(Where where = Where::current());
    /// flush(), then waits until everything submitted is done.
    Status finish(Where where = Where::current());
    /// False once the device is lost.
    bool check() const;
    /// Tells the message callback of an error as of one of the device's own: for what is written on top of it.
    void report(const Error& error) const;

    // Reading back: plays what is queued, then waits for the data.

    Status getBuffer(const Buffer& buffer, uint64_t offset, void* data, uint64_t size, Where where = Where::current());
    template <class T>
    Expected<std::vector<T>> read(const Buffer& buffer, uint64_t offset = 0, uint64_t count = 0,
                                  Where where = Where::current()) {
        if (count == 0 && buffer.getSize() > offset) count = (buffer.getSize() - offset) / sizeof(T);
        std::vector<T> values(count);
        if (Status status = getBuffer(buffer, offset, values.data(), count * sizeof(T), where); !status)
            return unexpected(status.error());
        return values;
    }
    /// Tightly packed texels of one layer of a mip level. Errors: "copy.range".
    Status getTexture(const Texture& texture, void* data, uint64_t size, const Slice& slice = {},
                      Where where = Where::current());
    /// Nanoseconds between beginQuery and endQuery. Errors: "query.type", "query.unused".
    Expected<uint64_t> getTime(const Query& query, Where where = Where::current());
    Expected<uint64_t> getSamples(const Query& query, Where where = Where::current());
    Expected<Query::Statistics> getStatistics(const Query& query, Where where = Where::current());

private:
    Expected<std::array<uint64_t, 7>> queryWords(const Query& query, Query::Type type, Where where);
};

}  // namespace glint
