#pragma once

// What a recorder does, whatever its public face: keeps the bindings, checks every call, writes the command list.

#include <glint/base/format_error.h>
#include <glint/device/command.h>
#include <glint/device/compute.h>
#include <glint/device/detail/command_list.h>
#include <glint/device/detail/device_object.h>
#include <glint/device/detail/pending_builds.h>
#include <glint/device/detail/table_object.h>
#include <glint/device/detail/target_object.h>

#include <array>
#include <new>
#include <source_location>
#include <string_view>
#include <vector>

namespace glint::detail {

struct BuildPass;
struct MipmapPlan;

class RecorderCore {
public:
    using Where = std::source_location;

    explicit RecorderCore(DeviceObject* device) : device_(device) {}

    /// Makes it ready for a new list; capacities stay.
    void begin(Queue queue, std::string_view name);
    /// Releases what the list holds.
    void clear();

    DeviceObject* device() const { return device_; }
    Queue queue() const { return queue_; }
    const CommandList& list() const { return list_; }
    const Error& error() const { return list_.error; }
    bool isEmpty() const { return list_.command_count == 0 && pending_.isEmpty(); }
    Status end(Where where);

    bool submitted = false;
    /// The list has been handed to the GPU: the structures that it builds are built. Those of a list that is cleared
    /// without this count as unbuilt again.
    void confirmBuilds() { first_builds_.clear(); }
    /// Software engine: writes into the list where structures lie now. Under the submit lock, before the list is
    /// played. Errors: "tracing.moved".
    Error placeTracings();
    /// Keeps the device alive while a user holds the recorder; empty while it rests in the pool.
    Ref<DeviceObject> keep;

    // Recorder.
    void setUniformData(const Slot& slot, const void* data, uint64_t size);
    void setBuffer(SlotKind kind, const Slot& slot, uint32_t step, const Buffer& buffer, uint64_t offset, uint64_t size,
                   Format format = FormatUnknown);
    void setTexture(SlotKind kind, const Slot& slot, uint32_t step, const Texture& texture, Slice slice);
    void setSampler(const Slot& slot, uint32_t step, const Sampler& sampler);
    void setTracing(const Slot& slot, const Tracing& tracing);
    void setTable(const Slot& slot, const Handle& table);
    void setPushData(const void* data, uint64_t size, Where where);
    void useBuffer(const Buffer& buffer, bool write, Where where);
    void clearUses();
    void setTracking(bool enabled) { tracking_ = enabled; }
    void barrier(Where where);
    void query(CommandType type, const Query& query, Where where);
    void pushRegion(std::string_view name, Where where);
    void popRegion(Where where);

    // Compute.
    void setKernel(const Kernel& kernel, Where where);
    void setTraversal(const Traversal& traversal, uint32_t generation, Where where);
    void dispatch(uint64_t width, uint64_t height, uint64_t depth, Where where);
    void dispatchIndirect(const Buffer& buffer, uint64_t offset, Where where);
    void setBufferData(const Buffer& buffer, uint64_t offset, const void* data, uint64_t size, Where where);
    void copyBuffer(const Buffer& destination, uint64_t destination_offset, const Buffer& source,
                    uint64_t source_offset, uint64_t size, Where where);
    /// Checked by the caller. With a structure, it is what is written, within the heap.
    CopyBufferCommand& copyBuffer(BufferObject& to, uint64_t to_offset, BufferObject& from, uint64_t from_offset,
                                  uint64_t size, TracingObject* tracing = nullptr);
    void clearBuffer(const Buffer& buffer, uint32_t value, uint64_t offset, uint64_t size, Where where);
    void setTextureData(const Texture& texture, const void* data, uint64_t size, Slice slice, Region region,
                        Where where);
    void copyBufferTexture(CommandType type, const Texture& texture, const Buffer& buffer, uint64_t offset, Slice slice,
                           Region region, Where where);
    void copyTexture(const Texture& destination, Slice destination_slice, const Texture& source, Slice source_slice,
                     Region region, uint32_t x, uint32_t y, uint32_t z, Where where);
    void clearTexture(const Texture& texture, const Color& color, Slice slice, Where where);
    void createMipmaps(const Texture& texture, Where where);
    void setInstances(const Tracing& tracing, std::span<const Tracing::Instance> instances, Where where);
    void buildTracing(const Tracing& tracing, const Buffer& scratch, uint64_t offset, bool update, Where where);
    /// Builds that may run side by side, each with its scratch offset; checked by the caller.
    void buildTracings(std::span<TracingObject* const> tracings, std::span<const uint64_t> offsets,
                       BufferObject& scratch, bool update, Where where);
    void copyTracing(TracingObject& destination, TracingObject& source, bool compact);
    void writeTracingSize(TracingObject& tracing);
    /// Makes what was copied to the buffer visible to the CPU after a wait.
    void hostRead(BufferObject& buffer);
    /// Makes the picture of a window ready to be shown.
    void presentPicture(TextureObject& picture);

    // Command.
    void beginTarget(TargetObject& target, Where where);
    void setPipeline(const Pipeline& pipeline, Where where);
    void setVertexBuffer(uint32_t index, const Buffer& buffer, uint64_t offset, Where where);
    void setVertexData(uint32_t index, const void* data, uint64_t size, Where where);
    void setIndexBuffer(Format format, const Buffer& buffer, uint64_t offset, Where where);
    void setIndexData(Format format, const void* data, uint64_t size, Where where);
    void setViewport(const Viewport& viewport);
    void setViewports(std::span<const Viewport> viewports, Where where);
    void setScissor(const Scissor& scissor);
    void setScissors(std::span<const Scissor> scissors, Where where);
    void setBlendFactor(const Color& color);
    void setStencilRef(uint32_t reference);
    void draw(bool indexed, uint32_t count, uint32_t instances, uint32_t first, int32_t base_vertex,
              uint32_t first_instance, Where where);
    /// Where the arguments of an indirect command are; `count` may be null.
    struct Indirect {
        const Buffer& buffer;
        uint64_t offset = 0;
        uint32_t draws = 1;
        uint32_t stride = 0;
        const Buffer* count = nullptr;
        uint64_t count_offset = 0;
    };
    void drawIndirect(CommandType type, const Indirect& arguments, Where where);
    void drawMesh(uint32_t x, uint32_t y, uint32_t z, Where where);

    /// Keeps the first error and reports it.
    void fail(const Error& error);
    /// The same for an error that has been told already.
    void keepError(const Error& error);
    /// False, and the error is kept, if the list takes no more or the handle cannot be used.
    bool check(const Handle& handle, const char* what, Where where) {
        return recording(where) && usable(handle, what, where);
    }

private:
    /// One slot of one kind as it was set last.
    struct Bound {
        bool set = false;
        bool inlined = false;  ///< inline uniform: offset is into the inline data
        BoundResource value;
        uint32_t references = 0;      ///< tracing in software: its block in the inline data
        std::vector<Bound> elements;  ///< of an array slot, element 0 included; empty otherwise
    };
    struct VertexSource {
        uint32_t buffer = none;
        uint64_t offset = 0;
        uint64_t size = 0;  ///< bytes from offset
        bool set = false;
    };
    /// What is known of the software engine's structures when the list is played, at a place in the inline data.
    struct Placement {
        enum class Kind : uint8_t {
            Instance,   ///< texel of a structure, in an instance
            Reference,  ///< texel of a top level, in a shader's block of references
            Built,      ///< a top level has been built from its references
            Heap,       ///< the heap's address
            Address,    ///< the same in CommandList::bytes
            Hierarchy,  ///< texel of a structure in CommandList::bytes
            Move,       ///< a structure gets the range moves_[place]
        };
        Kind kind = Kind::Instance;
        uint32_t place = 0;
        uint32_t resource = 0;
    };
    struct Use {
        uint32_t resource;
        bool write;
    };
    struct TableEntry {
        Object* object = nullptr;
        uint32_t index = 0;
        uint32_t generation = 0;
    };

    bool recording(Where where);
    template <class... Args>
    void fail(Where where, ErrorCode code, const char* id, fmt::format_string<Args...> format, Args&&... args) {
        fail(makeError(where, code, id, format, std::forward<Args>(args)...));
    }
    /// False, and the error is kept, if the handle is not ready or belongs to another device.
    bool usable(const Handle& handle, const char* what, Where where);
    /// False, and the error is kept, if the recorder's queue comes after `last` (see Queue).
    bool onQueue(Queue last, const char* what, Where where);
    BufferObject* usableBuffer(const Buffer& buffer, Buffer::Flag flag, const char* what, Where where);
    bool inRange(const BufferObject& buffer, uint64_t offset, uint64_t size, const char* what, Where where);
    bool resolve(const TextureObject& texture, Slice& slice, const char* what, Where where);

    /// Index of an object in the list's resources; the list keeps it alive.
    uint32_t use(Object& object);
    /// Zeroed bytes at the end of CommandList::bytes; the offset, or none for no bytes.
    uint32_t room(size_t size, size_t alignment);
    /// Appends to CommandList::bytes; the offset.
    uint32_t append(const void* data, size_t size, size_t alignment = 8);
    uint32_t appendInline(const void* data, uint64_t size, uint64_t alignment, uint64_t padded = 0);
    template <class T>
    T& push(CommandType type) {
        constexpr size_t size = (sizeof(T) + 7) / 8 * 8;
        const size_t offset = list_.commands.size();
        list_.commands.resize(offset + size);
        T* command = new (list_.commands.data() + offset) T();
        command->header.type = type;
        command->header.untracked = !tracking_;
        command->header.size = size;
        command->header.first_access = first_access_;
        command->header.access_count = static_cast<uint32_t>(list_.accesses.size()) - first_access_;
        list_.command_count++;
        return *command;
    }
    /// The accesses added from here on belong to the next push(), which comes after the builds that are pending.
    void beginAccesses() {
        if (!pending_.isEmpty()) playPending();
        first_access_ = static_cast<uint32_t>(list_.accesses.size());
    }
    void access(uint32_t resource, Stage stage, uint8_t flags) {
        list_.accesses.push_back({resource, stage, flags, Layout::None, {}});
    }
    void access(uint32_t resource, Stage stage, uint8_t flags, Layout layout, const Slice& slice) {
        list_.accesses.push_back({resource, stage, flags, layout, slice});
    }

    void writeInstances(TracingObject& tracing);
    void buildByDriver(std::span<TracingObject* const> tracings, std::span<const uint64_t> offsets,
                       BufferObject& scratch, bool update, Where where);
    void buildInSoftware(std::span<TracingObject* const> tracings, std::span<const uint64_t> offsets,
                         BufferObject& scratch, bool update, Where where);
    bool buildInstancesOnHost(TracingObject& tracing, Where where);
    bool buildOnDevice(TracingObject& tracing, BufferObject& scratch, uint64_t scratch_offset, bool update,
                       Where where);
    bool writeDeviceInstances(TracingObject& tracing, PendingBuilds::Copy& copy, Where where);
    bool preparePass(const BuildPass& pass, TracingObject& tracing, const PendingBuilds::Scratch& scratch, Where where);
    void playPending();
    /// Of the accesses that were begun.
    void copyInline(uint32_t resource, uint64_t offset, uint32_t place, uint64_t size);
    void makeMipmap(TextureObject& texture, const MipmapPlan& plan, size_t index, BufferObject& scratch, Where where);
    std::array<uint64_t, 3> rayLimits() const;
    void traceRays(uint64_t width, uint64_t height, uint64_t depth, Where where);
    void traceRaysIndirect(BufferObject& counts, uint64_t offset, Where where);
    void traceJoined(const std::array<uint32_t, 3>& rays, Where where);
    void traceJoinedIndirect(BufferObject& counts, uint64_t offset, Where where);
    bool flushJoined(const Bound& launch, const char* what, Where where);
    /// What the program is to its user: a traversal, also where a joined kernel is played in its place.
    std::string programLabel() const { return traversal_ ? traversal_->label() : program_->label(); }
    bool checkReferences(const TracingObject& tracing, Where where);
    void confirmBuild(TracingObject& tracing);
    uint64_t bindReferences(const ShaderResource& resource, Bound& bound);
    void bindHidden(std::span<BoundResource> elements, uint32_t* offsets);
    Bound* bind(SlotKind kind, const Slot& slot, uint32_t step);
    void setProgram(ProgramObject& program);
    bool flushBindings(const char* what, Where where);
    bool checkBound(const ShaderResource& resource, SlotKind kind, uint32_t slot, Bound& bound, const char* what,
                    Where where);
    bool checkTable(const ShaderResource& resource, const TableContents& table, uint32_t slot, const char* what,
                    Where where);
    void accessTable(const ShaderResource& resource, const TableContents& table);
    void accessBound(const ShaderResource& resource, SlotKind kind, const Bound& bound);
    bool flushPush(const char* what, Where where);
    void shareAccesses(CommandHeader& header) const;
    bool checkViewport(const Viewport& viewport, Where where);
    enum class DrawKind : uint8_t { Arrays, Elements, Mesh };
    bool flushDraw(DrawKind kind, DrawState& state, Where where);
    bool flushVertices(bool indexed, DrawState& state, Where where);
    bool checkTexture(const ShaderResource& resource, const TextureObject& texture, const Slice& slice) const;

    DeviceObject* const device_;
    Queue asked_ = Queue::Main;
    Queue queue_ = Queue::Main;
    CommandList list_;
    bool ended_ = false;
    bool tracking_ = true;
    bool graphics_ = false;
    uint32_t first_access_ = 0;

    std::vector<TableEntry> table_;  ///< open addressing, entries of older generations count as empty
    uint32_t generation_ = 0;

    std::array<std::vector<Bound>, static_cast<size_t>(SlotKind::Count)> bound_;
    std::vector<Use> uses_;
    ProgramObject* program_ = nullptr;  ///< the list keeps it alive
    uint32_t program_resource_ = 0;
    TraversalObject* traversal_ = nullptr;  ///< what is set, if it is one: `program_` itself, or joined into that
    uint32_t ray_generation_ = 0;
    bool bindings_dirty_ = true;
    bool uniforms_dirty_ = true;
    bool push_dirty_ = true;
    Bindings bindings_;
    uint32_t first_shared_ = 0;
    uint32_t shared_count_ = 0;
    std::array<std::byte, 256> push_data_ = {};
    uint32_t push_size_ = 0;

    Ref<TargetObject> target_;
    uint32_t target_width_ = 0;
    uint32_t target_height_ = 0;
    uint32_t target_samples_ = 1;
    std::array<VertexSource, 16> vertices_;
    uint32_t vertex_block_ = none;
    uint32_t vertex_block_count_ = 0;
    bool vertices_dirty_ = true;
    VertexSource indices_;
    uint32_t index_size_ = 0;
    DynamicState dynamic_;
    bool dynamic_dirty_ = true;
    uint32_t dynamic_block_ = none;
    uint32_t region_depth_ = 0;
    std::vector<Query> open_queries_;
    std::vector<TracingObject*>
        first_builds_;  ///< what no earlier list has built from the same; the list keeps them alive

    std::vector<Placement> placements_;
    std::vector<TracingHeap::Range> moves_;
    PendingBuilds pending_;
    uint64_t shared_scratch_ = 0;  ///< bytes of the device's scratch memory that pending builds use
    uint32_t heap_block_ = none;   ///< inline data: the heap's address

    // Scratch of one call, kept for its capacity.
    std::vector<const NativeTracing*> natives_;
    std::vector<TracingObject*> references_;
    std::vector<TracingObject*> bottoms_;
    std::vector<TracingBuild> builds_;
    std::vector<BoundResource> pass_elements_;
    std::vector<PendingBuilds::Pass> passes_;
    std::vector<Access> build_accesses_;
    std::vector<SideDispatch> round_;
};

}  // namespace glint::detail
