#include <glint/base/format_error.h>
#include <glint/device/detail/device_object.h>
#include <glint/device/detail/recorder_core.h>
#include <glint/device/detail/texture_layout.h>
#include <glint/device/device.h>

#include <algorithm>
#include <cstring>

namespace glint {

namespace {

using detail::BufferObject;
using detail::DeviceObject;
using detail::RecorderCore;
using detail::Ref;
using detail::TracingObject;

/// Reads `size` bytes that `record(core, staging)` copies.
template <class Record>
Status readBack(DeviceObject& device, void* data, uint64_t size, Device::Where where, Record&& record) {
    const Expected<Ref<BufferObject>> staging = device.createStaging(size, true, where);
    if (!staging) {
        device.report(staging.error());
        return staging.error();
    }
    BufferObject& memory = **staging;
    memory.retain();
    const Buffer buffer(&memory);
    Status status = device.playNow("read-back", where, [&](RecorderCore& core) {
        record(core, buffer);
        if (!core.error()) core.hostRead(memory);
    });
    if (status) std::memcpy(data, memory.nativeBuffer()->mapped, size);
    return status;
}

/// Scratch memory for builds to run side by side, within reason.
uint64_t reasonableScratch(uint64_t largest, uint64_t total) {
    constexpr uint64_t reasonable = 32ull << 20;
    return std::max(largest, std::min(total, reasonable));
}

/// Calls build(tracings, offsets) for as many builds at a time as find room in `size` bytes of scratch memory, which
/// are enough for each of them.
template <class Build>
void forEachBatch(std::span<TracingObject* const> tracings, uint64_t size, uint64_t alignment, Build&& build) {
    std::vector<uint64_t> offsets;
    uint64_t offset = 0;
    size_t first = 0;
    for (size_t i = 0; i < tracings.size(); i++) {
        const uint64_t needed = tracings[i]->nativeTracing()->build_size;
        if (offset + needed > size) {
            if (i > first) build(tracings.subspan(first, i - first), std::span<const uint64_t>(offsets));
            offsets.clear();
            offset = 0;
            first = i;
        }
        offsets.push_back(offset);
        offset += (needed + alignment - 1) / alignment * alignment;
    }
    if (first < tracings.size()) build(tracings.subspan(first), std::span<const uint64_t>(offsets));
}

}  // namespace

Status Device::getBuffer(const Buffer& buffer, uint64_t offset, void* data, uint64_t size, Where where) {
    if (!*this) return error().at(where);
    auto& device = *static_cast<DeviceObject*>(object_);
    // Wrong arguments are found before any memory is made for them.
    const bool valid = buffer && size && data && offset <= buffer.getSize() && size <= buffer.getSize() - offset;
    if (!valid) {
        const detail::RecorderPtr core = device.acquireRecorder(Queue::Main, "getBuffer");
        if (!core->check(buffer, "getBuffer", where)) return core->error();
        if (size == 0) return flush(where);
        core->fail(data ? makeError(where, ErrorCode::OutOfRange, "copy.range",
                                    "getBuffer: {} bytes from offset {} exceed {} of {} bytes", size, offset,
                                    buffer.object()->label(), buffer.getSize())
                        : makeError(where, ErrorCode::InvalidArgument, "copy.null",
                                    "getBuffer: {} bytes to a null pointer", size));
        return core->error();
    }
    return readBack(device, data, size, where, [&](RecorderCore& core, const Buffer& staging) {
        core.copyBuffer(staging, 0, buffer, offset, size, where);
    });
}

Status Device::getTexture(const Texture& texture, void* data, uint64_t size, const Slice& slice, Where where) {
    if (!*this) return error().at(where);
    auto& device = *static_cast<DeviceObject*>(object_);
    Slice one = slice;
    one.mips = 1;
    if (one.layers == 0) one.layers = 1;
    const uint64_t wanted = texture.getDataSize(one.mip) * one.layers;
    if (!texture || size != wanted || !data) {
        const detail::RecorderPtr core = device.acquireRecorder(Queue::Main, "getTexture");
        if (!core->check(texture, "getTexture", where)) return core->error();
        core->fail(makeError(where, ErrorCode::InvalidArgument, "copy.size",
                             "getTexture: mip level {} of {} has {} bytes, room for {} was given", one.mip,
                             texture.object()->label(), wanted, data ? size : 0));
        return core->error();
    }
    return readBack(device, data, size, where, [&](RecorderCore& core, const Buffer& staging) {
        core.copyBufferTexture(detail::CommandType::CopyTextureToBuffer, texture, staging, 0, one, {}, where);
    });
}

Status Device::buildTracings(std::span<const Tracing> tracings, const Buffer& scratch, Tracing::Flags flags,
                             Where where) {
    if (!*this) return error().at(where);
    auto& device = *static_cast<DeviceObject*>(object_);
    detail::RecorderPtr core = device.acquireRecorder(Queue::Main, "buildTracings");

    // Bottom levels first, and compacted first: a top level refers to where they are.
    std::vector<TracingObject*> levels[2];
    uint64_t largest = 0;
    uint64_t total = 0;
    for (const Tracing& tracing : tracings) {
        if (!core->check(tracing, "buildTracings", where)) return core->error();
        auto* object = static_cast<TracingObject*>(tracing.object());
        auto& level = levels[object->tracing_type == Tracing::TypeInstance ? 1 : 0];
        if (std::find(level.begin(), level.end(), object) != level.end()) continue;
        if (object->compacted) {
            core->fail(makeError(where, ErrorCode::InvalidArgument, "tracing.compacted",
                                 "buildTracings: {} has been compacted and cannot be built again", object->label()));
            return core->error();
        }
        level.push_back(object);
        largest = std::max(largest, object->nativeTracing()->build_size);
        total += object->nativeTracing()->build_size;
    }
    if (levels[0].empty() && levels[1].empty()) return {};

    Ref<BufferObject> memory;
    if (scratch.state() != ObjectState::Null) {
        if (!core->check(scratch, "buildTracings", where)) return core->error();
        memory = Ref<BufferObject>(static_cast<BufferObject*>(scratch.object()));
        if (!(memory->flags & Buffer::FlagScratch) || memory->size < largest) {
            core->fail(memory->flags & Buffer::FlagScratch
                           ? makeError(where, ErrorCode::OutOfRange, "tracing.scratch",
                                       "buildTracings: {} has {} bytes, the largest build needs {}", memory->label(),
                                       memory->size, largest)
                           : makeError(where, ErrorCode::InvalidArgument, "buffer.flag",
                                       "buildTracings: {} was made without Buffer::FlagScratch", memory->label()));
            return core->error();
        }
    } else {
        const Expected<Ref<BufferObject>> own = device.acquireScratch(reasonableScratch(largest, total), where);
        if (!own) {
            core->fail(own.error());
            return core->error();
        }
        memory = *own;
    }

    const auto build = [&](std::span<TracingObject* const> objects) {
        forEachBatch(objects, memory->size, device.features().scratchAlignment,
                     [&](std::span<TracingObject* const> batch, std::span<const uint64_t> offsets) {
                         core->buildTracings(batch, offsets, *memory, false, where);
                     });
    };

    std::vector<TracingObject*> compacted;
    if (flags & Tracing::FlagCompact)
        for (TracingObject* object : levels[0])
            if (object->flags & Tracing::FlagCompact) compacted.push_back(object);
    if (device.heap()) {
        if (Status status = device.buildOnHost(levels[0], where); !status) return status;
        // Ours have no room to spare.
        for (TracingObject* object : compacted) object->compacted = true;
    } else {
        build(levels[0]);
        if (Status status = device.compact(core, compacted, where); !status) return status;
    }
    build(levels[1]);
    RecorderCore* const recorders[] = {core.get()};
    return device.submit(recorders, nullptr, where);
}

}  // namespace glint

namespace glint::detail {

Status DeviceObject::compact(RecorderPtr& core, std::span<TracingObject* const> tracings, Where where) {
    if (tracings.empty()) return {};
    const auto play = [&]() -> Status {
        FenceObject* fence = new FenceObject(this);
        const Fence handle(fence);
        RecorderCore* const recorders[] = {core.get()};
        Status status = submit(recorders, fence, where);
        if (status) status = wait(fence->values, UINT64_MAX, where);
        core = acquireRecorder(Queue::Main, "buildTracings");
        return status;
    };
    for (TracingObject* tracing : tracings) core->writeTracingSize(*tracing);
    if (Status status = play(); !status) return status;

    std::vector<Ref<TracingObject>> copies;
    for (TracingObject* tracing : tracings) {
        Expected<uint64_t> size = backend->tracingSize(*tracing->nativeTracing());
        if (!size) return failed(size.error(), where);
        NativeTracingDesc desc;
        desc.type = tracing->tracing_type;
        desc.flags = tracing->flags;
        desc.compacted_size = *size;
        desc.name = tracing->name();
        Expected<std::unique_ptr<NativeTracing>> made = backend->createTracing(desc);
        if (!made) return failed(made.error(), where);
        auto copy = Ref<TracingObject>::adopt(new TracingObject(this));
        copy->native = std::move(*made);
        copy->setReady();
        core->copyTracing(*copy, *tracing, true);
        copies.push_back(std::move(copy));
    }
    if (Status status = play(); !status) return status;
    for (size_t i = 0; i < tracings.size(); i++) {
        NativeTracing& compacted = *copies[i]->nativeTracing();
        compacted.update_size = tracings[i]->nativeTracing()->update_size;
        {
            // The copy wrote what comes next to be read, not the build. The wait alone makes it visible to no one.
            std::lock_guard lock(submit_mutex_);
            tracings[i]->use = copies[i]->use;
        }
        replaceNative(*tracings[i], std::move(copies[i]->native));
        tracings[i]->compacted = true;
    }
    return {};
}

Expected<std::array<uint64_t, 7>> DeviceObject::queryResult(QueryObject& query, Where where) {
    std::array<uint64_t, queue_count> use;
    {
        std::lock_guard lock(submit_mutex_);
        use = query.last_use;
    }
    if (use == std::array<uint64_t, queue_count>{}) {
        const Error unused =
            makeError(where, ErrorCode::InvalidArgument, "query.unused", "{} has not been submitted", query.label());
        report(unused);
        return unexpected(unused);
    }
    if (Status status = wait(use, UINT64_MAX, where); !status) return unexpected(status.error());
    std::lock_guard lock(submit_mutex_);
    return backend->queryResult(*query.nativeQuery());
}

}  // namespace glint::detail
