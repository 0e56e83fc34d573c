#pragma once

// The objects behind the handles.

#include <glint/base/error.h>
#include <glint/device/detail/backend.h>
#include <glint/device/handle.h>
#include <glint/device/pipeline.h>
#include <glint/shader/shader_compiler.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <source_location>
#include <string>
#include <utility>
#include <vector>

namespace glint::detail {

class DeviceObject;

enum class ObjectType : uint8_t {
    Device,
    Buffer,
    Texture,
    Sampler,
    Shader,
    Kernel,
    Pipeline,
    Traversal,
    Target,
    Tracing,
    Query,
    Fence,
    Window,
    TextureTable,
    BufferTable,
    Table,  ///< the contents of a table
};
const char* toString(ObjectType type);

/// State the tracker keeps for a buffer, a tracing or one texture subresource. Guarded by the device's submit lock.
struct ResourceState {
    struct Reads {
        uint64_t value = 0;     ///< time-line value of the last submission that read it on this queue
        uint64_t position = 0;  ///< position of the last read on this queue
        StageMask stages = 0;   ///< that read it since the last write
    };
    uint64_t write_value = 0;  ///< submission of the last write
    uint64_t write_position = 0;
    StageMask write_stages = 0;  ///< 0: never written
    StageMask visible = 0;       ///< stages that a transition already made the write visible to
    Queue write_queue = Queue::Main;
    Layout layout = Layout::Undefined;
    Reads reads[queue_count];
    uint64_t epoch = 0;  ///< submission that touched it last, for the undo log
};

/// Counts two kinds of references. Users are handles: while there is one, the object keeps its device alive. Holds are
/// Glint's own (command lists, structures that refer to others): they keep the object, but not the device, so that what
/// a device holds itself never keeps it from going.
class Object {
public:
    /// Begins with one user. `device` is null for objects that live without one (Device itself, Shader).
    Object(ObjectType type, DeviceObject* device);
    Object(const Object&) = delete;
    Object& operator=(const Object&) = delete;

    void retain();
    void release();
    void hold() { holds_.fetch_add(1, std::memory_order_relaxed); }
    void unhold();

    ObjectType type() const { return type_; }
    DeviceObject* device() const { return device_; }

    ObjectState state() const { return state_.load(std::memory_order_acquire); }
    void setReady() { state_.store(ObjectState::Ready, std::memory_order_release); }
    /// Keeps the first error and tells the device's message callback. Returns the error it keeps.
    Error fail(Error error);
    /// The same for an error that has been told already.
    void keep(const Error& error);
    Error error() const;

    std::string name() const;
    /// "storage buffer 'values'": the type and the name, for messages.
    std::string label() const;
    void setName(std::string_view name);

    /// Where in a submitted list the GPU uses it last, for each queue. Guarded by the submit lock.
    std::array<uint64_t, queue_count> last_use = {};

    std::unique_ptr<Native> native;

protected:
    virtual ~Object();
    /// No handle refers to the object any more; it is still whole.
    virtual void lastRelease() {}

private:
    std::atomic<uint32_t> users_ = 1;
    std::atomic<uint32_t> holds_ = 1;  // one of them for all users together
    std::atomic<ObjectState> state_ = ObjectState::Building;
    const ObjectType type_;
    DeviceObject* const device_;
    mutable std::mutex mutex_;  // of error_ and name_
    Error error_;
    std::string name_;
};

/// Holds an object.
template <class T>
class Ref {
public:
    Ref() = default;
    explicit Ref(T* object) : object_(object) {
        if (object_) object_->hold();
    }
    Ref(const Ref& other) : Ref(other.object_) {}
    Ref(Ref&& other) noexcept : object_(other.object_) { other.object_ = nullptr; }
    Ref& operator=(Ref other) noexcept {
        std::swap(object_, other.object_);
        return *this;
    }
    ~Ref() {
        if (object_) object_->unhold();
    }
    /// Holds a new object and gives up the user it began with.
    static Ref adopt(T* object) {
        Ref ref(object);
        object->release();
        return ref;
    }
    T* get() const { return object_; }
    T* operator->() const { return object_; }
    T& operator*() const { return *object_; }
    explicit operator bool() const { return object_ != nullptr; }

private:
    T* object_ = nullptr;
};

class BufferObject final : public Object {
public:
    explicit BufferObject(DeviceObject* device) : Object(ObjectType::Buffer, device) {}
    NativeBuffer* nativeBuffer() const { return static_cast<NativeBuffer*>(native.get()); }

    uint64_t size = 0;
    Buffer::Flags flags = 0;
    ResourceState use;
};

class TextureObject final : public Object {
public:
    explicit TextureObject(DeviceObject* device) : Object(ObjectType::Texture, device) {}
    NativeTexture* nativeTexture() const { return static_cast<NativeTexture*>(native.get()); }
    ResourceState& use(uint32_t mip, uint32_t layer) { return uses[layer * desc.mipmaps + mip]; }

    TextureDesc desc;  ///< mipmaps resolved, layers counts faces
    uint32_t samples = 1;
    std::vector<ResourceState> uses;  ///< one for each subresource, layer-major

    bool is_picture = false;  ///< of a window
    /// Of a picture, guarded by the submit lock: the window while the picture is the one of its frame, and whether a
    /// submission has waited for it.
    NativeWindow* acquired_from = nullptr;
    bool awaited = false;
};

class SamplerObject final : public Object {
public:
    explicit SamplerObject(DeviceObject* device) : Object(ObjectType::Sampler, device) {}
};

class ShaderObject final : public Object {
public:
    ShaderObject() : Object(ObjectType::Shader, nullptr) {}

    ShaderSource source;
    CompiledShader compiled;
    FileStamp file;  ///< of the file it was loaded from, no path if there is none
};

/// What a Kernel, a Pipeline and a Traversal have in common.
class ProgramObject : public Object {
public:
    using Where = std::source_location;

    ProgramObject(ObjectType type, DeviceObject* device) : Object(type, device) {}

    /// A value for the specialisation constant with this name, or with this id if the name is empty.
    struct Constant {
        std::string name;
        uint32_t id = 0;
        SpecializationConstant::Type type = SpecializationConstant::Type::Uint;
        uint32_t value = 0;
    };
    /// The compiled stages with the constants that each of them has.
    struct Stages {
        std::vector<Ref<ShaderObject>> shaders;
        std::vector<std::vector<SpecializationValue>> constants;
        const Reflection* find(ShaderStage stage) const;
        StageDesc desc(size_t index) const;
        /// Of a stage with groups, as its constants say.
        std::array<uint32_t, 3> groupSize(size_t index) const;
    };

    /// In the place of one of the same stage.
    virtual void addShader(Ref<ShaderObject> shader);
    Status create(Where where);
    void createAsync(Where where);
    /// Returns once no createAsync is under way, and does its work itself if no thread has begun it yet.
    void waitCreated();
    Status reload(bool& changed, Where where);
    /// True if the program can still be configured. Keeps an error, or tells of one if it is ready already.
    bool configurable(Where where);

    /// An error about this program; the message begins with its label.
    Error problem(Where where, ErrorCode code, const char* id, std::string_view message) const;
    /// Features that the device was made without: "program.feature".
    Error missing(Where where, FeatureMask features, std::string_view what) const;

    std::vector<Ref<ShaderObject>> shaders;
    std::vector<Constant> constants;
    /// Slots of each kind that were declared, -1 if none were, and the stages that see them.
    std::array<int32_t, static_cast<size_t>(SlotKind::Count)> declared = {-1, -1, -1, -1, -1, -1, -1, -1};
    std::array<std::vector<ShaderMask>, static_cast<size_t>(SlotKind::Count)> masks;
    /// Of a kernel that a traversal has been joined into: what the traversal's shaders declare, though the kernel may
    /// have lost what none of them uses. They are slots all the same.
    std::vector<ShaderResource> joined_resources;
    BindingLayout layout;
    /// Where element 0 of BindingLayout::resources[i] stands in a binding block.
    std::vector<uint32_t> first_element;  ///< hidden ones follow
    std::vector<uint32_t> first_uniform;  ///< likewise, among the uniform elements
    uint32_t element_count = 0;
    uint32_t uniform_elements = 0;

protected:
    /// Checks what is left to check and makes the native object from `stages` and `layout`. Changes the object's other
    /// members only on success.
    virtual Expected<std::unique_ptr<Native>> createNative(const Stages& stages, Where where) = 0;

private:
    struct Creation;

    void lastRelease() override;
    Status build(Where where);
    Expected<BindingLayout> mergeStages(const Stages& stages, Where where) const;
    /// The shaders as the device's engine plays them: with ray queries in software they are compiled anew.
    Expected<std::vector<Ref<ShaderObject>>> forEngine(const std::vector<Ref<ShaderObject>>& compiled,
                                                       Where where) const;
    Expected<Stages> specialize(std::vector<Ref<ShaderObject>> compiled, Where where) const;
    Reflection joinedDeclarations(const Stages& stages) const;
    Error checkFeatures(const Reflection& stage, Where where) const;
    Error checkResource(const ShaderResource& resource, Where where) const;
    Error checkTables(const BindingLayout& merged, Where where) const;
    Error checkSlots(const BindingLayout& merged, Where where) const;

    std::shared_ptr<Creation> creation_;  ///< of createAsync
    std::vector<FileStamp> stamps_;       ///< of the files behind `shaders` when they were last compiled, or tried to
};

class KernelObject final : public ProgramObject {
public:
    explicit KernelObject(DeviceObject* device) : ProgramObject(ObjectType::Kernel, device) {}
    NativeKernel* nativeKernel() const { return static_cast<NativeKernel*>(native.get()); }

    std::array<uint32_t, 3> group_size = {1, 1, 1};

private:
    Expected<std::unique_ptr<Native>> createNative(const Stages& stages, Where where) override;
};

class PipelineObject final : public ProgramObject {
public:
    explicit PipelineObject(DeviceObject* device) : ProgramObject(ObjectType::Pipeline, device) {
        desc.depth_write = true;  // once there is a depth test
    }
    NativePipeline* nativePipeline() const { return static_cast<NativePipeline*>(native.get()); }

    PipelineDesc desc;  ///< blends and layout are completed by create(); stages stay empty
    std::vector<Pipeline::VertexAttribute> attributes;  ///< as they were added
    bool has_mesh = false;                              ///< a mesh shader in the place of a vertex shader

private:
    Error checkStages(const Stages& stages, Where where) const;
    Error checkMesh(const Stages& stages, Where where) const;
    Error checkAttributes(const Reflection& vertex, Where where) const;
    Error checkTargets(const PipelineDesc& complete, const Reflection* fragment, Where where) const;
    Error checkState(const PipelineDesc& complete, Where where) const;
    Expected<std::unique_ptr<Native>> createNative(const Stages& stages, Where where) override;
};

class TraversalObject final : public ProgramObject {
public:
    struct Record {
        uint32_t group = 0;
        std::vector<std::byte> data;
    };

    explicit TraversalObject(DeviceObject* device) : ProgramObject(ObjectType::Traversal, device) {}
    NativeTraversal* nativeTraversal() const { return static_cast<NativeTraversal*>(native.get()); }

    /// Behind the others, into its group.
    void addShader(Ref<ShaderObject> shader) override;
    /// Those that were added, else one a group.
    uint32_t countRecords(RayTable table) const {
        const auto t = static_cast<size_t>(table);
        return static_cast<uint32_t>(records[t].empty() ? groups[t].size() : records[t].size());
    }

    std::array<std::vector<TraversalDesc::Group>, ray_tables> groups;
    std::array<std::vector<Record>, ray_tables> records;
    uint32_t recursion_depth = 1;
    uint32_t callable_depth = 2;
    /// In software: the stages joined into one kernel, which is what lists play, its binding table, and what a dispatch
    /// with counts from a buffer begins with (JoinedLaunch).
    Ref<KernelObject> joined;
    Ref<BufferObject> joined_records;
    Ref<BufferObject> joined_launch;

private:
    Status check(const Stages& stages, Where where) const;
    Status join(const Stages& stages, Where where);
    Status createJoinedBuffers(Where where);
    std::vector<uint32_t> recordWords() const;
    Error checkRecords(const Stages& stages, Where where) const;
    bool isCalled(const Stages& stages, uint32_t shader) const;
    Error checkVariables(const Stages& stages, Where where) const;
    Expected<std::unique_ptr<Native>> createNative(const Stages& stages, Where where) override;
};

/// TraversalObject::joined_launch, as shaders/tracing/ray_counts.h has it: two parts, each where a block may begin.
struct JoinedLaunch {
    static constexpr uint64_t counts = 0;
    static constexpr uint64_t groups = 16;
    static constexpr uint64_t arguments_size = 32;
    /// Of the block GlintLaunch, for a device with these alignments.
    static uint64_t rays(const Features& features) {
        return std::max<uint64_t>({arguments_size, features.uniformAlignment, features.storageAlignment});
    }
    static constexpr uint64_t rays_size = 16;
};

class QueryObject final : public Object {
public:
    QueryObject(DeviceObject* device, Query::Type type) : Object(ObjectType::Query, device), query_type(type) {}
    NativeQuery* nativeQuery() const { return static_cast<NativeQuery*>(native.get()); }

    const Query::Type query_type;
    ResourceState use;  ///< unused by the tracker; last_use says when a result is there
};

class TracingObject final : public Object {
public:
    explicit TracingObject(DeviceObject* device) : Object(ObjectType::Tracing, device) {}
    NativeTracing* nativeTracing() const { return static_cast<NativeTracing*>(native.get()); }

    Tracing::Type tracing_type = Tracing::TypeTriangle;
    Tracing::Flags flags = 0;
    std::vector<TracingGeometry> geometries;
    std::vector<Ref<BufferObject>> buffers;         ///< every buffer the geometries name
    uint32_t instances = 0;                         ///< capacity of a top level
    std::vector<Tracing::Instance> instance_data;   ///< set by setTracing; their `tracing` is not used
    std::vector<TracingObject*> instance_tracings;  ///< what they refer to, or nullptr
    uint32_t largest_offset = 0;                    ///< of the instances that refer to something
    uint32_t built_offset = 0;                      ///< of those that were built last
    std::vector<Ref<TracingObject>> references;     ///< the same, each once
    /// Those of the instances that were built last: what a trace reads, whatever has been set since.
    std::vector<Ref<TracingObject>> built_references;
    Ref<BufferObject> instance_buffer;  ///< native records, written when it is built: compaction moves structures
    bool built = false;                 ///< a build has been recorded
    bool compacted = false;
    /// Software engine: how often the hierarchy has been put elsewhere, and for a top level the sum of its references'
    /// numbers when it was built. Guarded by the submit lock.
    uint64_t moves = 0;
    uint64_t built_moves = 0;
    ResourceState use;
};

class FenceObject final : public Object {
public:
    explicit FenceObject(DeviceObject* device) : Object(ObjectType::Fence, device) {}

    std::mutex mutex;
    std::array<uint64_t, queue_count> values = {};  ///< time-line values it stands for
};

}  // namespace glint::detail
