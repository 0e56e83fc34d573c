#include <glint/device/detail/device_object.h>

#include <glint/base/format_error.h>
#include <glint/base/log.h>
#include <glint/device/detail/backends.h>
#include <glint/device/detail/recorder_core.h>
#include <glint/shader/traversal_joiner.h>
#include <glint/tracing/detail/hierarchy.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace glint::detail {

namespace {

constexpr FeatureMask query_features = FeatureComputeTracing | FeatureFragmentTracing;

// What a joined traversal takes.
constexpr uint32_t joined_recursion = 31;       // as lavapipe's own
constexpr uint64_t joined_rays = 1ull << 30;    // what Vulkan asks of every device
constexpr uint32_t joined_attribute_size = 32;  // likewise
constexpr uint32_t joined_record_size = shader::max_frame_words * 4;

struct EngineChoice {
    TracingEngine engine;
    std::string reason;
};

/// The rule for ray queries, and for pipelines by themselves: `asked` are the features of either.
EngineChoice chooseEngine(TracingEngine wanted, FeatureMask asked, const Features& driver, const DeviceInfo& info,
                          std::string_view what) {
    if (!asked) return {TracingEngine::Driver, fmt::format("no {} asked for", what)};
    if (wanted != TracingEngine::Auto) return {wanted, "asked for"};
    if (const FeatureMask lacking = asked & ~driver.mask)
        return {TracingEngine::Software, fmt::format("the driver lacks {}", featureNames(lacking))};
    if (info.cpu) return {TracingEngine::Software, "faster than the driver's on a CPU"};
    return {TracingEngine::Driver, "the driver's, on a device that is no CPU"};
}

/// What a program asks for, else what the environment does.
Expected<TracingEngine> askedEngine(TracingEngine engine) {
    const char* name = std::getenv("GLINT_TRACING");
    if (engine != TracingEngine::Auto || !name || !*name) return engine;
    for (TracingEngine known : {TracingEngine::Auto, TracingEngine::Driver, TracingEngine::Software})
        if (std::string_view(name) == toString(known)) return known;
    return unexpected(makeError(ErrorCode::InvalidArgument, "device.tracing",
                                "GLINT_TRACING is '{}'; it can be auto, driver or software", name));
}

bool passed(Backend& backend, const std::array<uint64_t, queue_count>& values) {
    for (size_t q = 0; q < queue_count; q++)
        if (values[q] && backend.completed(static_cast<Queue>(q)) < values[q]) return false;
    return true;
}

}  // namespace

DeviceObject::~DeviceObject() {
    if (!backend) return;
    for (size_t q = 0; q < queue_count; q++) {
        const TimelinePoint last = {static_cast<Queue>(q), next_value_[q]};
        if (last.value) (void)backend->wait({&last, 1}, UINT64_MAX);
    }
    if (transfers_) recycleRecorder(transfers_);
    scratch_ = {};
    heap_ = {};
    mipmaps_.clear();
    ray_count_kernel_ = {};
    for (RecorderCore* recorder : recorders_) delete recorder;
    // The device is idle or lost: nothing is in use any more. Deleting one may retire others.
    while (!retired_.empty()) {
        std::vector<Retired> retired = std::move(retired_);
        retired_.clear();
    }
}

Status DeviceObject::open(const DeviceDesc& desc, Where where) {
    message_ = desc.message;
    BackendDesc backend_desc;
    backend_desc.adapter = desc.adapter;
    if (const char* adapter = std::getenv("GLINT_ADAPTER"); adapter && desc.adapter.empty())
        backend_desc.adapter = adapter;
    backend_desc.required = desc.required;
    backend_desc.optional = desc.optional;
#ifdef NDEBUG
    backend_desc.validation = false;
#else
    backend_desc.validation = true;
#endif
    if (const char* validation = std::getenv("GLINT_VALIDATION"))
        backend_desc.validation = std::strcmp(validation, "1") == 0;
    if (desc.validation != DeviceDesc::Validation::Default)
        backend_desc.validation = desc.validation == DeviceDesc::Validation::On;
    backend_desc.message = [this](const Error& error, bool warning) {
        report(error, warning ? Message::Severity::Warning : Message::Severity::Error);
    };
    const auto fail = [&](const Error& error) {
        report(error.at(where));
        return Status(Object::fail(error.at(where)));
    };
    const Expected<TracingEngine> engine = askedEngine(desc.tracing);
    if (!engine) return fail(engine.error());
    // What Glint provides itself, no driver has to.
    constexpr FeatureMask own = query_features | FeatureRayTracing;
    const FeatureMask asked = (desc.required | desc.optional) & own;
    if (*engine != TracingEngine::Driver) {
        backend_desc.required &= ~own;
        backend_desc.optional &= ~own;
    }
    if (*engine == TracingEngine::Auto) {
        backend_desc.optional |= asked;
        // Pipelines that are joined become ray queries.
        if (asked & FeatureRayTracing) backend_desc.optional |= FeatureComputeTracing;
    }
    Expected<std::unique_ptr<Backend>> made = createBackend(desc.api, backend_desc);
    if (!made) return fail(made.error());
    backend = std::move(*made);
    chooseEngines(*engine, asked);
    setReady();
    return {};
}

void DeviceObject::chooseEngines(TracingEngine wanted, FeatureMask asked) {
    const Features& driver = backend->features();
    features_ = driver;
    info_ = backend->info();

    EngineChoice pipelines = chooseEngine(wanted, asked & FeatureRayTracing, driver, info_, "ray-tracing pipelines");
    FeatureMask queried = asked & query_features;
    const bool traverses = asked & FeatureRayTracing;
    if (traverses && (pipelines.engine == TracingEngine::Software || !queried)) queried |= FeatureComputeTracing;
    const EngineChoice queries = chooseEngine(wanted, queried, driver, info_, "ray queries");
    // A structure is built by one of the two. So pipelines are the driver's only where queries are, asked for or not.
    if (traverses && pipelines.engine == TracingEngine::Driver) pipelines = queries;
    const bool joins = pipelines.engine == TracingEngine::Software;
    if (joins) asked |= FeatureComputeTracing;
    features_.traversalEngine = pipelines.engine;
    features_.tracingEngine = queries.engine;

    features_.mask &= ~query_features | asked;
    if (queries.engine == TracingEngine::Software) {
        features_.mask |= asked & query_features;
        features_.maxTracingPrimitives = features_.maxTracingInstances = max_primitives;
        features_.scratchAlignment = std::max(features_.scratchAlignment, features_.storageAlignment);
        heap_ = std::make_shared<TracingHeap>(*this);
    }
    if (joins) {
        features_.mask |= FeatureRayTracing;
        features_.recursionDepth = joined_recursion;
        features_.maxRays = joined_rays;
        features_.maxRecordSize = joined_record_size;
        features_.maxAttributeSize = joined_attribute_size;
        features_.indirectRays = true;
    }
    features_.computeTracing = features_.has(FeatureComputeTracing);
    features_.fragmentTracing = features_.has(FeatureFragmentTracing);
    features_.rayTracing = features_.has(FeatureRayTracing);

    info_.tracing =
        fmt::format("{}{} ({})", toString(queries.engine),
                    heap_ ? fmt::format(", nodes read as {}", toString(heap_->form())) : "", queries.reason);
    info_.traversal = features_.rayTracing ? fmt::format("{} ({})", toString(pipelines.engine), pipelines.reason)
                                           : fmt::format("none ({})", (asked & FeatureRayTracing)
                                                                          ? "the driver offers no ray-tracing pipelines"
                                                                          : pipelines.reason);
}

Expected<KernelObject*> DeviceObject::rayCountKernel(Where where) {
    std::lock_guard lock(ray_count_mutex_);
    if (ray_count_kernel_) return ray_count_kernel_.get();
    const Shader shader =
        Shader::createGLSL(Shader::TypeCompute, "#include <glint/tracing/ray_counts.h>\n", {}, "counts of rays");
    if (!shader) return unexpected(shader.error());
    auto made = Ref<KernelObject>::adopt(new KernelObject(this));
    made->setName("counts of rays");
    made->shaders.emplace_back(static_cast<ShaderObject*>(shader.object()));
    if (Status status = made->create(where); !status) return unexpected(status.error());
    ray_count_kernel_ = std::move(made);
    return ray_count_kernel_.get();
}

void DeviceObject::adopt(std::unique_ptr<Backend> made, MessageCallback message) {
    message_ = std::move(message);
    backend = std::move(made);
    const Expected<TracingEngine> engine = askedEngine(TracingEngine::Auto);
    if (!engine) report(engine.error());
    chooseEngines(engine ? *engine : TracingEngine::Auto, query_features | FeatureRayTracing);
    setReady();
}

void DeviceObject::report(const Error& error, Message::Severity severity) const {
    if (message_) return message_({severity, error});
    log(severity == Message::Severity::Error ? LogLevel::Error : LogLevel::Warning, error.id(), error.summary());
}

Status DeviceObject::failed(Error error, Where where) {
    error = error.at(where);
    report(error);
    return error;
}

void DeviceObject::retire(std::unique_ptr<Native> native_object, const std::array<uint64_t, queue_count>& use) {
    if (passed(*backend, use)) return;  // deletes it
    std::lock_guard lock(retired_mutex_);
    retired_.push_back({std::move(native_object), use});
}

void DeviceObject::replaceNative(Object& object, std::unique_ptr<Native> made) {
    std::unique_ptr<Native> old;
    std::array<uint64_t, queue_count> use;
    {
        std::lock_guard lock(submit_mutex_);
        old = std::move(object.native);
        object.native = std::move(made);
        use = object.last_use;
    }
    if (old) retire(std::move(old), use);
}

bool DeviceObject::replaceUnused(Object& object, std::unique_ptr<Native>& made,
                                 const std::array<uint64_t, queue_count>& known) {
    {
        std::lock_guard lock(submit_mutex_);
        if (object.last_use != known) return false;
        std::swap(object.native, made);
    }
    if (made) retire(std::move(made), known);
    return true;
}

std::array<uint64_t, queue_count> DeviceObject::lastUse(const Object& object) {
    std::lock_guard lock(submit_mutex_);
    return object.last_use;
}

void DeviceObject::collect() {
    std::vector<Retired> done;
    {
        std::lock_guard lock(retired_mutex_);
        if (retired_.empty()) return;
        const auto first = std::stable_partition(retired_.begin(), retired_.end(), [&](const Retired& retired) {
            return !passed(*backend, retired.last_use);
        });
        done.assign(std::make_move_iterator(first), std::make_move_iterator(retired_.end()));
        retired_.erase(first, retired_.end());
    }
}

RecorderCore* DeviceObject::takeRecorder(Queue queue, std::string_view name) {
    RecorderCore* core = nullptr;
    {
        std::lock_guard lock(recorder_mutex_);
        if (!recorders_.empty()) {
            core = recorders_.back();
            recorders_.pop_back();
        }
    }
    if (!core) core = new RecorderCore(this);
    core->begin(queue, name);
    return core;
}

RecorderPtr DeviceObject::acquireRecorder(Queue queue, std::string_view name) {
    RecorderCore* core = takeRecorder(queue, name);
    core->keep = Ref<DeviceObject>(this);
    return RecorderPtr(core);
}

void DeviceObject::recycleRecorder(RecorderCore* core) {
    core->clear();
    core->keep = {};
    std::lock_guard lock(recorder_mutex_);
    recorders_.push_back(core);
}

bool DeviceObject::writeDirectly(BufferObject& buffer, uint64_t offset, const void* data, uint64_t size) {
    void* mapped = buffer.nativeBuffer()->mapped;
    if (!mapped) return false;
    std::scoped_lock lock(transfer_mutex_, submit_mutex_);
    if ((transfers_ && !transfers_->isEmpty()) || !passed(*backend, buffer.last_use)) return false;
    // Host writes before a submission are visible to it.
    std::memcpy(static_cast<std::byte*>(mapped) + offset, data, size);
    return true;
}

Error DeviceObject::checkPictures(const RecorderCore& recorder) const {
    const CommandList& list = recorder.list();
    for (uint32_t resource : list.pictures) {
        const auto& picture = *static_cast<const TextureObject*>(list.resources[resource]);
        if (!picture.acquired_from)
            return makeError(ErrorCode::InvalidArgument, "window.no_frame",
                             "submit: the recorder '{}' uses {}, which is not the picture of the window's frame",
                             list.label, picture.label());
        if (recorder.queue() != Queue::Main)
            return makeError(ErrorCode::InvalidArgument, "window.queue",
                             "submit: the recorder '{}' uses {} on another queue than Queue::Main", list.label,
                             picture.label());
    }
    return {};
}

void DeviceObject::setAcquired(TextureObject& picture, NativeWindow* window) {
    std::lock_guard lock(submit_mutex_);
    picture.acquired_from = window;
    picture.awaited = false;
    // As if they had just been written in the stages that wait for the picture: so the first transition comes after.
    picture.uses.assign(1, {.write_stages = bit(Stage::ColorTarget) | bit(Stage::Copy)});
}

bool DeviceObject::isAwaited(const TextureObject& picture) {
    std::lock_guard lock(submit_mutex_);
    return picture.awaited;
}

void DeviceObject::waitUnused(const Object& object) {
    const std::array<uint64_t, queue_count> use = lastUse(object);
    if (!passed(*backend, use)) (void)wait(use, UINT64_MAX, Where::current());
}

Status DeviceObject::submit(std::span<RecorderCore* const> recorders, FenceObject* fence, Where where,
                            NativeWindow* presented) {
    // Released after the locks: letting go of a list may delete objects.
    RecorderCore* transfers = nullptr;
    Status status;
    {
        std::scoped_lock lock(transfer_mutex_, submit_mutex_);
        if (lost_)
            return failed(makeError(where, ErrorCode::DeviceLost, "device.lost", "submit: the device is lost"), where);
        const Queue queue = recorders.empty() ? Queue::Main : recorders[0]->queue();
        Error error;
        for (RecorderCore* recorder : recorders) {
            if (recorder->device() != this)
                error = makeError(where, ErrorCode::InvalidArgument, "handle.device",
                                  "submit: the recorder '{}' belongs to another device", recorder->list().label);
            else if (recorder->submitted || std::count(recorders.begin(), recorders.end(), recorder) > 1)
                error = makeError(where, ErrorCode::InvalidArgument, "submit.twice",
                                  "submit: the recorder '{}' has been submitted already", recorder->list().label);
            else if (recorder->queue() != queue)
                error = makeError(where, ErrorCode::InvalidArgument, "submit.queue",
                                  "submit: recorders of different queues in one call");
            if (error) return failed(error, where);
        }
        for (RecorderCore* recorder : recorders) {
            const Status ended = recorder->end(where);
            if (!ended && !error) error = ended.error();
            if (!error && (error = checkPictures(*recorder))) error = failed(error, where).error();
            recorder->submitted = true;
        }
        // A list that has failed leaves what is queued to the next submission: nobody would hand its data over again.
        if (!error) {
            transfers = std::exchange(transfers_, nullptr);
            if (transfers) error = transfers->end(where).error();
            if (transfers && !error && (error = checkPictures(*transfers))) (void)failed(error, where);
            if (transfers && !error && (error = transfers->placeTracings())) (void)failed(error, where);
            for (RecorderCore* recorder : recorders)
                if (!error && (error = recorder->placeTracings())) error = failed(error, where).error();
        }
        if (error) {
            status = error;  // reported when it happened
        } else {
            lists_.clear();
            if (transfers && !transfers->isEmpty()) lists_.push_back(&transfers->list());
            if (!lists_.empty() && queue != Queue::Main) {
                status = play(Queue::Main, where, nullptr);
                if (status) transfers->confirmBuilds();
                lists_.clear();
            }
            if (status) {
                for (RecorderCore* recorder : recorders)
                    if (!recorder->isEmpty()) lists_.push_back(&recorder->list());
                if (!lists_.empty()) status = play(queue, where, presented);
            }
            if (status) {
                if (transfers) transfers->confirmBuilds();
                for (RecorderCore* recorder : recorders) recorder->confirmBuilds();
            }
            if (status && fence) {
                std::lock_guard fence_lock(fence->mutex);
                fence->values = {};
                fence->values[static_cast<size_t>(queue)] = next_value_[static_cast<size_t>(queue)];
                fence->values[static_cast<size_t>(Queue::Main)] = next_value_[static_cast<size_t>(Queue::Main)];
            }
        }
    }
    // Without the locks: it may wait until the display has shown another picture.
    if (status && presented) {
        status = presented->present();
        if (!status) {
            if (status.error().code() == ErrorCode::DeviceLost) setLost();
            status = failed(status.error(), where);
        }
    }
    if (transfers) recycleRecorder(transfers);
    for (RecorderCore* recorder : recorders) recorder->clear();
    collect();
    return status;
}

Status DeviceObject::play(Queue queue, Where where, NativeWindow* presented) {
    uint64_t& next = next_value_[static_cast<size_t>(queue)];
    const uint64_t value = next + 1;
    tracker_.resolve(queue, value, lists_);
    acquired_.clear();
    const auto forEachAcquired = [&](auto visit) {
        for (const CommandList* list : lists_)
            for (uint32_t resource : list->pictures) visit(*static_cast<TextureObject*>(list->resources[resource]));
    };
    forEachAcquired([&](TextureObject& picture) {
        NativeWindow* const window = picture.acquired_from;
        if (!picture.awaited && std::find(acquired_.begin(), acquired_.end(), window) == acquired_.end())
            acquired_.push_back(window);
    });
    const Submission submission = {queue, tracker_.lists(), tracker_.waits(), value, acquired_, presented};
    if (Status status = backend->submit(submission); !status) {
        tracker_.rollback();
        lost_ = lost_ || status.error().code() == ErrorCode::DeviceLost;
        return failed(status.error(), where);
    }
    next = value;
    forEachAcquired([](TextureObject& picture) { picture.awaited = true; });
    for (const CommandList* list : lists_)
        for (Object* object : list->resources) object->last_use[static_cast<size_t>(queue)] = value;
    return {};
}

Status DeviceObject::waitIdle(Where where) {
    std::array<uint64_t, queue_count> values;
    {
        std::lock_guard lock(submit_mutex_);
        values = next_value_;
    }
    return wait(values, UINT64_MAX, where);
}

Status DeviceObject::wait(const std::array<uint64_t, queue_count>& values, uint64_t nanoseconds, Where where) {
    std::array<TimelinePoint, queue_count> points;
    size_t count = 0;
    for (size_t q = 0; q < queue_count; q++)
        if (values[q]) points[count++] = {static_cast<Queue>(q), values[q]};
    if (count == 0) return {};
    const Status status = backend->wait({points.data(), count}, nanoseconds);
    if (!status) {
        if (status.error().code() == ErrorCode::DeviceLost) setLost();
        return failed(status.error(), where);
    }
    collect();
    return {};
}

bool DeviceObject::isDone(const std::array<uint64_t, queue_count>& values) { return passed(*backend, values); }

void DeviceObject::setLost() {
    std::lock_guard lock(submit_mutex_);
    lost_ = true;
}

bool DeviceObject::isLost() {
    std::lock_guard lock(submit_mutex_);
    return lost_;
}

Expected<Ref<BufferObject>> DeviceObject::createInternal(const NativeBufferDesc& desc, Where where) {
    Expected<std::unique_ptr<NativeBuffer>> made = backend->createBuffer(desc);
    if (!made) return unexpected(made.error().at(where));
    auto buffer = Ref<BufferObject>::adopt(new BufferObject(this));
    buffer->size = desc.size;
    buffer->flags = desc.flags;
    buffer->native = std::move(*made);
    buffer->setReady();
    return buffer;
}

Expected<Ref<BufferObject>> DeviceObject::createStaging(uint64_t size, bool readback, Where where) {
    NativeBufferDesc desc;
    desc.size = size;
    desc.staging = !readback;
    desc.readback = readback;
    desc.name = readback ? "read-back" : "staging";
    return createInternal(desc, where);
}

Expected<Ref<BufferObject>> DeviceObject::acquireScratch(uint64_t size, Where where) {
    std::lock_guard lock(scratch_mutex_);
    if (scratch_ && scratch_->size >= size) return scratch_;
    NativeBufferDesc desc;
    desc.flags = Buffer::FlagScratch;
    desc.name = "scratch";
    // Twice as much at least, so that builds side by side do not make it anew one by one.
    desc.size = std::max({size, uint64_t(1), scratch_ ? std::min(2 * scratch_->size, scratch_limit) : 0});
    Expected<Ref<BufferObject>> scratch = createInternal(desc, where);
    if (!scratch && desc.size > size) {
        desc.size = size;
        scratch = createInternal(desc, where);
    }
    if (scratch && size <= scratch_limit) scratch_ = *scratch;
    return scratch;
}

}  // namespace glint::detail
