#pragma once

// The object behind Device: the back end, the submit path, and what waits to be released.

#include <glint/device/detail/backend.h>
#include <glint/device/detail/mipmaps.h>
#include <glint/device/detail/object.h>
#include <glint/device/detail/tracing_heap.h>
#include <glint/device/detail/tracker.h>
#include <glint/device/device.h>

#include <memory>
#include <mutex>
#include <source_location>
#include <vector>

namespace glint::detail {

struct Hierarchy;
class RecorderCore;

class DeviceObject final : public Object {
public:
    using Where = std::source_location;

    DeviceObject() : Object(ObjectType::Device, nullptr) {}
    ~DeviceObject() override;

    Status open(const DeviceDesc& desc, Where where);
    /// Takes a back end that exists already: foreign handles.
    void adopt(std::unique_ptr<Backend> made, MessageCallback message);

    const Features& features() const { return features_; }
    const DeviceInfo& info() const { return info_; }
    /// The heap of the software engine, null if structures are the driver's.
    TracingHeap* heap() const { return heap_.get(); }
    MipmapKernels& mipmaps() { return mipmaps_; }
    /// The kernel that turns counts of rays into the arguments of a dispatch. From any thread.
    Expected<KernelObject*> rayCountKernel(Where where);
    /// Whether ray-tracing pipelines are joined into kernels with ray queries, whoever answers those.
    bool joinsTraversals() const {
        return features_.rayTracing && features_.traversalEngine == TracingEngine::Software;
    }

    /// Tells the message callback.
    void report(const Error& error, Message::Severity severity = Message::Severity::Error) const;

    /// Deletes a native object once the submissions in `last_use` are done.
    void retire(std::unique_ptr<Native> native, const std::array<uint64_t, queue_count>& last_use);
    /// Gives an object another native one between submissions; the old one is retired.
    void replaceNative(Object& object, std::unique_ptr<Native> native);
    /// Software engine: the structure lies elsewhere from the submission on that is being made. Under the submit lock.
    void moveTracing(TracingObject& tracing, TracingHeap::Range range);
    /// As replaceNative if nothing but those submissions has used the object; else false, and nothing happens.
    bool replaceUnused(Object& object, std::unique_ptr<Native>& native, const std::array<uint64_t, queue_count>& known);
    std::array<uint64_t, queue_count> lastUse(const Object& object);
    /// Deletes what the GPU has passed.
    void collect();

    /// A recorder from the pool, empty.
    RecorderPtr acquireRecorder(Queue queue, std::string_view name);
    void recycleRecorder(RecorderCore* core);

    /// Runs `record(RecorderCore&)` on the list of queued transfers.
    template <class Record>
    void transfer(Record&& record) {
        std::lock_guard lock(transfer_mutex_);
        if (!transfers_) transfers_ = takeRecorder(Queue::Main, "transfers");
        record(*transfers_);
    }
    /// Writes to a buffer without the GPU if its memory is host-visible and nothing submitted or queued uses it.
    bool writeDirectly(BufferObject& buffer, uint64_t offset, const void* data, uint64_t size);

    /// `presented`: the window whose picture the last list hands over; it is shown at once.
    Status submit(std::span<RecorderCore* const> recorders, FenceObject* fence, Where where,
                  NativeWindow* presented = nullptr);
    /// Makes the picture, or none, the one that lists may use; nothing is known of its contents.
    void setAcquired(TextureObject& picture, NativeWindow* window);
    /// True if a submission has used the acquired picture.
    bool isAwaited(const TextureObject& picture);
    /// Waits for the last uses of an object.
    void waitUnused(const Object& object);
    Status flush(Where where) { return submit({}, nullptr, where); }
    /// Waits for every submission so far.
    Status waitIdle(Where where);
    Status wait(const std::array<uint64_t, queue_count>& values, uint64_t nanoseconds, Where where);
    bool isDone(const std::array<uint64_t, queue_count>& values);
    bool isLost();
    /// Records, plays and waits.
    template <class Record>
    Status playNow(std::string_view name, Where where, Record&& record) {
        const RecorderPtr core = acquireRecorder(Queue::Main, name);
        record(*core);
        const Ref<FenceObject> fence = Ref<FenceObject>::adopt(new FenceObject(this));
        RecorderCore* const recorders[] = {core.get()};
        if (Status status = submit(recorders, fence.get(), where); !status) return status;
        return wait(fence->values, UINT64_MAX, where);
    }

    /// Host-visible memory for an upload or a read-back; kept alive by the list that uses it.
    Expected<Ref<BufferObject>> createInternal(const NativeBufferDesc& desc, Where where);
    Expected<Ref<BufferObject>> createStaging(uint64_t size, bool readback, Where where);

    /// Scratch memory above this is not kept between builds.
    static constexpr uint64_t scratch_limit = 64ull << 20;
    /// Scratch memory shared by mip levels and by the builds that bring none: one buffer, which grows.
    Expected<Ref<BufferObject>> acquireScratch(uint64_t size, Where where);

    /// Plays what `core` holds, then puts compacted copies in the place of the structures. `core` is a fresh one
    /// afterwards.
    Status compact(RecorderPtr& core, std::span<TracingObject* const> tracings, Where where);
    /// Software engine: builds on the CPU's cores and waits for what the geometry depends on. Errors: those of
    /// buildHierarchy, "tracing.heap", "device.out_of_memory".
    Status buildOnHost(std::span<TracingObject* const> tracings, Where where);
    /// Waits for the query's last submission. Errors: "query.unused".
    Expected<std::array<uint64_t, 7>> queryResult(QueryObject& query, Where where);

    std::unique_ptr<Backend> backend;

private:
    struct Retired {
        std::unique_ptr<Native> native;
        std::array<uint64_t, queue_count> last_use;
    };

    /// Decides who answers ray queries and who runs pipelines; `asked` are the features of either that were asked for.
    void chooseEngines(TracingEngine wanted, FeatureMask asked);
    Status upload(TracingObject& tracing, const Hierarchy& hierarchy, Where where);
    RecorderCore* takeRecorder(Queue queue, std::string_view name);
    Error checkPictures(const RecorderCore& recorder) const;
    Status play(Queue queue, Where where, NativeWindow* presented);
    Status failed(Error error, Where where);
    void setLost();

    MessageCallback message_;
    Features features_;
    DeviceInfo info_;
    std::shared_ptr<TracingHeap> heap_;
    MipmapKernels mipmaps_{*this};
    std::mutex ray_count_mutex_;
    Ref<KernelObject> ray_count_kernel_;

    std::mutex submit_mutex_;  // of tracker_, next_value_, scratch below, last_use of objects
    Tracker tracker_;
    std::array<uint64_t, queue_count> next_value_ = {};  // last value submitted
    std::vector<const CommandList*> lists_;
    std::vector<NativeWindow*> acquired_;
    bool lost_ = false;

    std::mutex transfer_mutex_;          // of transfers_; taken before submit_mutex_
    RecorderCore* transfers_ = nullptr;  // does not keep the device: it is the device's own

    std::mutex retired_mutex_;
    std::vector<Retired> retired_;

    std::mutex scratch_mutex_;
    Ref<BufferObject> scratch_;

    std::mutex recorder_mutex_;
    std::vector<RecorderCore*> recorders_;  // idle
};

}  // namespace glint::detail
