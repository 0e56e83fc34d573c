#include <glint/device/device.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/backends.h>
#include <glint/device/detail/device_object.h>
#include <glint/device/detail/recorder_core.h>
#include <glint/device/detail/target_object.h>
#include <glint/device/detail/texture_layout.h>

#include <algorithm>

namespace glint {

namespace {

using detail::DeviceObject;
using detail::RecorderCore;

/// The object if the device is open.
DeviceObject* opened(const Device& device) { return device ? static_cast<DeviceObject*>(device.object()) : nullptr; }

/// A handle to a new object of a device; without a device it carries the device's error.
template <class HandleType, class ObjectType, class... Args>
HandleType make(const Device& device, std::string_view name, Device::Where where, Args&&... args) {
    auto* object = new ObjectType(opened(device), std::forward<Args>(args)...);
    object->setName(name);
    if (!object->device()) object->fail(device.error().at(where));
    return HandleType(object);
}

/// Structures of the software engine that are made to be traced, not to be built each frame.
bool isBuiltOnHost(const Tracing& tracing) {
    if (!tracing || !tracing.object()->device()->heap() || tracing.getType() == Tracing::TypeInstance) return false;
    const auto& object = *static_cast<detail::TracingObject*>(tracing.object());
    return !object.compacted && !(object.flags & (Tracing::FlagFastBuild | Tracing::FlagUpdate));
}

template <class Record>
void transfer(const Device& device, Record&& record) {
    if (DeviceObject* object = opened(device)) object->transfer(std::forward<Record>(record));
}

/// At once, unlike what is queued; an error is the next submission's all the same.
void buildOnHost(Device& device, const Tracing& tracing, const Buffer& scratch, Device::Where where) {
    const Status status = device.buildTracings(std::span(&tracing, 1), scratch, 0, where);
    if (!status) transfer(device, [&](RecorderCore& core) { core.keepError(status.error()); });
}

}  // namespace

Device Device::create(const DeviceDesc& desc, Where where) {
    auto* object = new DeviceObject();
    (void)object->open(desc, where);  // carried by the handle
    return Device(object);
}

Expected<std::vector<DeviceInfo>> Device::adapters(std::string_view api, Where where) {
    Expected<std::vector<DeviceInfo>> adapters = detail::listAdapters(api);
    if (!adapters) return unexpected(adapters.error().at(where));
    return adapters;
}

const Features& Device::getFeatures() const {
    static const Features empty;
    const DeviceObject* object = opened(*this);
    return object ? object->features() : empty;
}

const DeviceInfo& Device::getInfo() const {
    static const DeviceInfo empty;
    const DeviceObject* object = opened(*this);
    return object ? object->info() : empty;
}

DeviceMemory Device::getMemory() const {
    const DeviceObject* object = opened(*this);
    if (!object) return {};
    const detail::MemoryUse use = object->backend->memoryUse();
    return {use.bytes, use.allocations, use.objects_created};
}

bool Device::hasTexture(Format format, Texture::Flags flags, Texture::Type type) const {
    const DeviceObject* object = opened(*this);
    constexpr uint32_t sampled = 1u << 31;
    const uint32_t wanted = (flags & ~Texture::Flags(Texture::FlagMipmaps)) | sampled;
    return object && format > FormatUnknown && format < FormatCount &&
           (object->backend->formatSupport(format, type) & wanted) == wanted;
}

bool Device::hasQueue(Queue queue) const {
    const DeviceObject* object = opened(*this);
    return object && queue < Queue::Count && object->backend->hasQueue(queue);
}

Kernel Device::createKernel(std::string_view name, Where where) {
    return make<Kernel, detail::KernelObject>(*this, name, where);
}

Pipeline Device::createPipeline(std::string_view name, Where where) {
    return make<Pipeline, detail::PipelineObject>(*this, name, where);
}

Target Device::createTarget(std::string_view name, Where where) {
    Target target = make<Target, detail::TargetObject>(*this, name, where);
    if (target.state() == ObjectState::Building) target.object()->setReady();
    return target;
}

Target Device::createTarget(const Texture& color, const Texture& depth, Where where) {
    Target target = createTarget({}, where);
    target.setColorTexture(0, color, {}, where);
    target.setDepthTexture(depth, {}, where);
    return target;
}

Fence Device::createFence(std::string_view name, Where where) {
    Fence fence = make<Fence, detail::FenceObject>(*this, name, where);
    if (fence.state() == ObjectState::Building) fence.object()->setReady();
    return fence;
}

Tracing Device::createTracing(std::string_view name, Where where) {
    return make<Tracing, detail::TracingObject>(*this, name, where);
}

Tracing Device::createTracing(std::span<const Tracing::Instance> instances, Tracing::Flags flags, std::string_view name,
                              Where where) {
    Tracing tracing = createTracing(name, where);
    tracing.setInstances(static_cast<uint32_t>(instances.size()), where);
    if (tracing.create(Tracing::TypeInstance, flags, where)) setTracing(tracing, instances, where);
    return tracing;
}

Traversal Device::createTraversal(std::string_view name, Where where) {
    Traversal traversal = make<Traversal, detail::TraversalObject>(*this, name, where);
    if (traversal.state() != ObjectState::Building) return traversal;
    if (!opened(*this)->features().rayTracing)
        traversal.object()->fail(makeError(where, ErrorCode::Unsupported, "device.unsupported",
                                           "{}: {} {} the feature {}", traversal.object()->label(), getInfo().name,
                                           getInfo().features & FeatureRayTracing ? "was opened without" : "lacks",
                                           toString(FeatureRayTracing)));
    return traversal;
}

Compute Device::createCompute(Queue queue, std::string_view name, Where) {
    DeviceObject* object = opened(*this);
    if (!object) return Compute(detail::RecorderPtr());
    return Compute(object->acquireRecorder(queue, name));
}

Command Device::createCommand(const Target& target, std::string_view name, Where where) {
    DeviceObject* object = opened(*this);
    if (!object) return Command(detail::RecorderPtr());
    Command command(object->acquireRecorder(Queue::Main, name));
    if (command.core()->check(target, "createCommand", where))
        command.core()->beginTarget(*static_cast<detail::TargetObject*>(target.object()), where);
    return command;
}

void Device::setBuffer(const Buffer& buffer, uint64_t offset, const void* data, uint64_t size, Where where) {
    DeviceObject* object = opened(*this);
    if (!object) return;
    auto* memory = buffer ? static_cast<detail::BufferObject*>(buffer.object()) : nullptr;
    const bool valid =
        memory && memory->device() == object && data && size && offset <= memory->size && size <= memory->size - offset;
    if (valid && object->writeDirectly(*memory, offset, data, size)) return;
    object->transfer([&](RecorderCore& core) { core.setBufferData(buffer, offset, data, size, where); });
}

void Device::copyBuffer(const Buffer& destination, uint64_t destination_offset, const Buffer& source,
                        uint64_t source_offset, uint64_t size, Where where) {
    transfer(*this, [&](RecorderCore& core) {
        core.copyBuffer(destination, destination_offset, source, source_offset, size, where);
    });
}

void Device::clearBuffer(const Buffer& buffer, uint32_t value, uint64_t offset, uint64_t size, Where where) {
    transfer(*this, [&](RecorderCore& core) { core.clearBuffer(buffer, value, offset, size, where); });
}

void Device::setTexture(const Texture& texture, const void* data, uint64_t size, const Slice& slice,
                        const Region& region, Where where) {
    transfer(*this, [&](RecorderCore& core) { core.setTextureData(texture, data, size, slice, region, where); });
}

void Device::copyTexture(const Texture& destination, const Slice& destination_slice, const Texture& source,
                         const Slice& source_slice, const Region& source_region, uint32_t x, uint32_t y, uint32_t z,
                         Where where) {
    transfer(*this, [&](RecorderCore& core) {
        core.copyTexture(destination, destination_slice, source, source_slice, source_region, x, y, z, where);
    });
}

void Device::clearTexture(const Texture& texture, const Color& color, const Slice& slice, Where where) {
    transfer(*this, [&](RecorderCore& core) { core.clearTexture(texture, color, slice, where); });
}

void Device::createMipmaps(const Texture& texture, Where where) {
    transfer(*this, [&](RecorderCore& core) { core.createMipmaps(texture, where); });
}

void Device::setTracing(const Tracing& tracing, std::span<const Tracing::Instance> instances, Where where) {
    transfer(*this, [&](RecorderCore& core) { core.setInstances(tracing, instances, where); });
}

void Device::buildTracing(const Tracing& tracing, const Buffer& scratch, Where where) {
    if (isBuiltOnHost(tracing) && scratch.state() != ObjectState::Null) {
        buildOnHost(*this, tracing, scratch, where);
        return;
    }
    transfer(*this, [&](RecorderCore& core) {
        if (core.check(scratch, "buildTracing", where)) core.buildTracing(tracing, scratch, 0, false, where);
    });
}

void Device::buildTracing(const Tracing& tracing, Where where) {
    if (isBuiltOnHost(tracing)) {
        buildOnHost(*this, tracing, Buffer(), where);
        return;
    }
    transfer(*this, [&](RecorderCore& core) { core.buildTracing(tracing, Buffer(), 0, false, where); });
}

void Device::updateTracing(const Tracing& tracing, const Buffer& scratch, Where where) {
    transfer(*this, [&](RecorderCore& core) {
        if (core.check(scratch, "updateTracing", where)) core.buildTracing(tracing, scratch, 0, true, where);
    });
}

void Device::updateTracing(const Tracing& tracing, Where where) {
    transfer(*this, [&](RecorderCore& core) { core.buildTracing(tracing, Buffer(), 0, true, where); });
}

void Device::flushBuffer(const Buffer& buffer, Where where) { flushBuffers({buffer}, where); }
void Device::flushTexture(const Texture& texture, Where where) { flushTextures({texture}, where); }
void Device::flushTracing(const Tracing& tracing, Where where) { flushTracings({tracing}, where); }

void Device::flushBuffers(std::initializer_list<Buffer> buffers, Where where) {
    transfer(*this, [&](RecorderCore& core) {
        for (const Buffer& buffer : buffers) core.check(buffer, "flushBuffer", where);
    });
}

void Device::flushTextures(std::initializer_list<Texture> textures, Where where) {
    transfer(*this, [&](RecorderCore& core) {
        for (const Texture& texture : textures) core.check(texture, "flushTexture", where);
    });
}

void Device::flushTracings(std::initializer_list<Tracing> tracings, Where where) {
    transfer(*this, [&](RecorderCore& core) {
        for (const Tracing& tracing : tracings) core.check(tracing, "flushTracing", where);
    });
}

Status Device::submit(std::initializer_list<SubmitItem> items, const Fence& fence, Where where) {
    DeviceObject* object = opened(*this);
    if (!object) return error().at(where);
    constexpr size_t limit = 64;
    if (items.size() > limit) {
        const Error many = makeError(where, ErrorCode::OutOfRange, "submit.count",
                                     "submit: {} recorders, the limit is {}", items.size(), limit);
        object->report(many);
        return many;
    }
    RecorderCore* recorders[limit];
    size_t count = 0;
    for (const SubmitItem& item : items) {
        if (!item.recorder().core()) {
            const Error empty = item.recorder().error().at(where);
            object->report(empty);
            return empty;
        }
        recorders[count++] = item.recorder().core();
    }
    auto* fence_object = static_cast<detail::FenceObject*>(fence.object());
    if (fence_object && fence_object->device() != object) {
        const Error foreign = makeError(where, ErrorCode::InvalidArgument, "handle.device",
                                        "submit: {} belongs to another device", fence_object->label());
        object->report(foreign);
        return foreign;
    }
    return object->submit({recorders, count}, fence_object, where);
}

Status Device::flush(Where where) {
    DeviceObject* object = opened(*this);
    return object ? object->flush(where) : Status(error().at(where));
}

Status Device::finish(Where where) {
    DeviceObject* object = opened(*this);
    if (!object) return error().at(where);
    if (Status status = object->flush(where); !status) return status;
    return object->waitIdle(where);
}

bool Device::check() const {
    DeviceObject* object = opened(*this);
    return object && !object->isLost();
}

void Device::report(const Error& error) const {
    if (DeviceObject* object = opened(*this); object && error) object->report(error);
}

Expected<uint64_t> Device::getTime(const Query& query, Where where) {
    const Expected<std::array<uint64_t, 7>> words = queryWords(query, Query::TypeTime, where);
    if (!words) return unexpected(words.error());
    return (*words)[1] - (*words)[0];
}

Expected<uint64_t> Device::getSamples(const Query& query, Where where) {
    const Expected<std::array<uint64_t, 7>> words = queryWords(query, Query::TypeSamples, where);
    if (!words) return unexpected(words.error());
    return (*words)[0];
}

Expected<Query::Statistics> Device::getStatistics(const Query& query, Where where) {
    const Expected<std::array<uint64_t, 7>> words = queryWords(query, Query::TypeStatistics, where);
    if (!words) return unexpected(words.error());
    const auto& w = *words;
    return Query::Statistics{w[0], w[1], w[2], w[3], w[4], w[5], w[6]};
}

Expected<std::array<uint64_t, 7>> Device::queryWords(const Query& query, Query::Type type, Where where) {
    DeviceObject* object = opened(*this);
    if (!object) return unexpected(error().at(where));
    const auto complain = [&](const char* id, const std::string& text) {
        const Error wrong = makeError(where, ErrorCode::InvalidArgument, id, "{}", text);
        object->report(wrong);
        return unexpected(wrong);
    };
    if (!query) return complain("handle.not_ready", "the query is not usable: " + query.error().message());
    auto* query_object = static_cast<detail::QueryObject*>(query.object());
    if (query.getType() != type)
        return complain("query.type", fmt::format("{} is of another type", query_object->label()));
    return object->queryResult(*query_object, where);
}

}  // namespace glint
