#include <glint/device/detail/software_tracing.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/device_object.h>
#include <glint/device/detail/recorder_core.h>
#include <glint/tracing/detail/instances.h>

#include <cstring>
#include <unordered_map>
#include <utility>

namespace glint::detail {

namespace {

uint64_t primitivesOf(const TracingGeometry& geometry) {
    if (geometry.bound_buffer) return geometry.bounds;
    return (geometry.index_buffer ? geometry.indices : geometry.vertices) / 3;
}

/// What buffers of a structure hold, in host memory: theirs if the CPU is the device, else a copy.
class HostInput {
public:
    HostInput(DeviceObject& device, DeviceObject::Where where) : device_(device), where_(where) {}

    Status read(std::span<TracingObject* const> tracings) {
        if (Status status = device_.flush(where_); !status) return status;
        for (const TracingObject* tracing : tracings)
            for (const Ref<BufferObject>& buffer : tracing->buffers)
                if (Status status = read(*buffer); !status) return status;
        return {};
    }
    const std::byte* at(const Object* buffer, uint64_t offset) const { return places_.at(buffer) + offset; }

private:
    Status read(BufferObject& buffer) {
        const std::byte*& place = places_[&buffer];
        if (place) return {};
        if (device_.info().cpu && buffer.nativeBuffer()->mapped) {
            device_.waitUnused(buffer);
            place = static_cast<const std::byte*>(buffer.nativeBuffer()->mapped);
            return {};
        }
        Expected<Ref<BufferObject>> staging = device_.createStaging(buffer.size, true, where_);
        if (!staging) {
            device_.report(staging.error());
            return staging.error();
        }
        BufferObject& memory = **staging;
        Status copied = device_.playNow("read-back", where_, [&](RecorderCore& core) {
            core.copyBuffer(memory, 0, buffer, 0, buffer.size);
            core.hostRead(memory);
        });
        if (!copied) return copied;
        place = static_cast<const std::byte*>(memory.nativeBuffer()->mapped);
        copies_.push_back(std::move(*staging));
        return {};
    }

    DeviceObject& device_;
    const DeviceObject::Where where_;
    std::unordered_map<const Object*, const std::byte*> places_;
    std::vector<Ref<BufferObject>> copies_;
};

Expected<Hierarchy> build(const TracingObject& tracing, const HostInput& input) {
    const bool opaque = !(tracing.flags & Tracing::FlagTransparent);
    const BuildMode mode = buildMode(tracing.flags);
    const NodeForm form = tracing.device()->heap()->nodes();
    if (tracing.tracing_type == Tracing::TypeBound) {
        std::vector<BoxGeometry> boxes;
        for (const TracingGeometry& geometry : tracing.geometries) {
            BoxGeometry& box = boxes.emplace_back();
            box.boxes = input.at(geometry.bound_buffer, geometry.bound_offset);
            box.stride = geometry.bound_stride;
            box.count = geometry.bounds;
            box.opaque = opaque;
        }
        return buildHierarchy(boxes, mode, &ThreadPool::shared(), form);
    }
    std::vector<TriangleGeometry> triangles;
    for (const TracingGeometry& geometry : tracing.geometries) {
        TriangleGeometry& triangle = triangles.emplace_back();
        triangle.positions = input.at(geometry.vertex_buffer, geometry.vertex_offset);
        triangle.stride = geometry.vertex_stride;
        triangle.vertices = geometry.vertices;
        triangle.triangles = static_cast<uint32_t>(primitivesOf(geometry));
        triangle.opaque = opaque;
        if (!geometry.index_buffer) continue;
        triangle.indices = input.at(geometry.index_buffer, geometry.index_offset);
        triangle.index =
            geometry.index_format == FormatRu16 ? TriangleGeometry::Index::Uint16 : TriangleGeometry::Index::Uint32;
    }
    return buildHierarchy(triangles, mode, &ThreadPool::shared(), form);
}

}  // namespace

BuildMode buildMode(Tracing::Flags flags) {
    if (flags & Tracing::FlagFastBuild) return BuildMode::Fast;
    return (flags & Tracing::FlagFastTrace) && !(flags & Tracing::FlagUpdate) ? BuildMode::Split : BuildMode::Quality;
}

std::optional<TexelHierarchy> texelHierarchy(const Tracing& tracing) {
    auto* const object = static_cast<TracingObject*>(tracing.object());
    TracingHeap* const heap = object->device()->heap();
    if (!heap || heap->form() != HeapForm::Texels) return {};
    heap->texels().retain();
    return TexelHierarchy{Buffer(&heap->texels()), softwareOf(*object).range.first, heap->rewrite().macros};
}

Expected<std::unique_ptr<NativeTracing>> createSoftwareTracing(DeviceObject& device, const TracingObject& tracing,
                                                               std::source_location where) {
    const Expected<DeviceSizes> sizes = deviceSizes(deviceInput(tracing));
    if (!sizes) return unexpected(sizes.error());
    auto made = std::make_unique<SoftwareTracing>();
    made->device_texels = sizes->texels;
    made->device_nodes = sizes->nodes;
    made->build_size = std::max<uint64_t>(sizes->build_scratch, 1);
    if (tracing.flags & Tracing::FlagUpdate) made->update_size = made->build_size;
    made->memory = sizes->texels * sizeof(Texel);
    // The host's trees take less room as a rule, so it makes room for them once they are there.
    const bool on_device = tracing.tracing_type == Tracing::TypeInstance ||
                           (tracing.flags & (Tracing::FlagFastBuild | Tracing::FlagUpdate));
    if (!on_device) return made;
    Expected<TracingHeap::Range> range = device.heap()->allocate(sizes->texels, where);
    if (!range) return unexpected(range.error());
    made->range = std::move(*range);
    made->memory = made->range.texels * sizeof(Texel);
    return made;
}

DeviceInput deviceInput(const TracingObject& tracing) {
    DeviceInput input;
    input.form = tracing.device()->heap()->nodes();
    input.kind = tracing.tracing_type == Tracing::TypeInstance ? Hierarchy::Kind::Instances
                 : tracing.tracing_type == Tracing::TypeBound  ? Hierarchy::Kind::Boxes
                                                               : Hierarchy::Kind::Triangles;
    if (input.kind == Hierarchy::Kind::Instances) {
        // Of the capacity until there are some: sizes are asked for before.
        DeviceGeometry& instances = input.geometries.emplace_back();
        instances.primitives = tracing.native ? static_cast<uint32_t>(tracing.instance_data.size()) : tracing.instances;
        instances.stride = sizeof(DeviceInstance);
        return input;
    }
    for (const TracingGeometry& from : tracing.geometries) {
        DeviceGeometry& geometry = input.geometries.emplace_back();
        geometry.primitives = static_cast<uint32_t>(primitivesOf(from));
        geometry.opaque = !(tracing.flags & Tracing::FlagTransparent);
        geometry.offset = from.bound_buffer ? from.bound_offset : from.vertex_offset;
        geometry.stride = from.bound_buffer ? from.bound_stride : from.vertex_stride;
        geometry.vertices = from.vertices;
        if (!from.index_buffer) continue;
        geometry.index =
            from.index_format == FormatRu16 ? TriangleGeometry::Index::Uint16 : TriangleGeometry::Index::Uint32;
        geometry.index_offset = from.index_offset;
    }
    return input;
}

Expected<Hierarchy> buildInstances(const TracingObject& tracing) {
    std::vector<HierarchyInstance> instances(tracing.instance_data.size());
    for (size_t i = 0; i < instances.size(); i++) {
        const Tracing::Instance& from = tracing.instance_data[i];
        HierarchyInstance& to = instances[i];
        std::copy(std::begin(from.transform), std::end(from.transform), to.transform.rows.begin());
        to.custom_index = from.data;
        to.mask = from.mask;
        to.offset = from.offset;
        to.flags = from.flags;
        if (const TracingObject* bottom = tracing.instance_tracings[i]) {
            to.bounds = *softwareOf(*bottom).bounds;
            to.texel = softwareOf(*bottom).range.first;
        }
    }
    return buildHierarchy(instances, buildMode(tracing.flags), &ThreadPool::shared(),
                          tracing.device()->heap()->nodes());
}

Status DeviceObject::buildOnHost(std::span<TracingObject* const> tracings, Where where) {
    if (tracings.empty()) return {};
    HostInput input(*this, where);
    if (Status status = input.read(tracings); !status) return status;
    for (TracingObject* tracing : tracings) {
        Expected<Hierarchy> hierarchy = build(*tracing, input);
        if (!hierarchy)
            return failed(makeError(where, hierarchy.error().code(), hierarchy.error().id().data(), "{}: {}",
                                    tracing->label(), hierarchy.error().message()),
                          where);
        SoftwareTracing& old = softwareOf(*tracing);
        auto made = std::make_unique<SoftwareTracing>();
        made->build_size = old.build_size;
        made->update_size = old.update_size;
        made->device_texels = old.device_texels;
        made->device_nodes = old.device_nodes;
        made->bounds = boundsOf(*hierarchy);
        made->nodes = hierarchy->nodes;
        // In the place of one that nobody has seen yet. What the device is to build again keeps the room for that.
        const bool on_device = tracing->flags & (Tracing::FlagFastBuild | Tracing::FlagUpdate);
        if (!tracing->built) old.range.release();
        Expected<TracingHeap::Range> range =
            heap_->allocate(std::max<uint64_t>(hierarchy->texels.size(), on_device ? old.device_texels : 0), where);
        if (!range) return failed(range.error().at(where), where);
        made->range = std::move(*range);
        made->memory = made->range.texels * sizeof(Texel);
        replaceNative(*tracing, std::move(made));
        Status uploaded = upload(*tracing, *hierarchy, where);
        {
            // Also without the upload: the place is another one, and nothing has been built there.
            std::lock_guard lock(submit_mutex_);
            tracing->moves++;
            tracing->built = static_cast<bool>(uploaded);
        }
        if (!uploaded) return uploaded;
    }
    return {};
}

void DeviceObject::moveTracing(TracingObject& tracing, TracingHeap::Range range) {
    SoftwareTracing& old = softwareOf(tracing);
    auto made = std::make_unique<SoftwareTracing>();
    made->build_size = old.build_size;
    made->update_size = old.update_size;
    made->device_texels = old.device_texels;
    made->device_nodes = old.device_nodes;
    made->nodes = old.device_nodes;
    made->bounds.reset();
    made->range = std::move(range);
    made->memory = made->range.texels * sizeof(Texel);
    tracing.moves++;
    std::unique_ptr<Native> before = std::exchange(tracing.native, std::move(made));
    retire(std::move(before), tracing.last_use);
}

Status DeviceObject::upload(TracingObject& tracing, const Hierarchy& hierarchy, Where where) {
    const TracingHeap::Range& range = softwareOf(tracing).range;
    // Nobody uses the range yet, so the host may write to it whatever else is under way.
    if (heap_->writeDirectly(range, hierarchy.texels.data(), hierarchy.bytes())) return {};
    Expected<Ref<BufferObject>> staging = createStaging(hierarchy.bytes(), false, where);
    if (!staging) return failed(staging.error(), where);
    std::memcpy((*staging)->nativeBuffer()->mapped, hierarchy.texels.data(), hierarchy.bytes());
    const RecorderPtr core = acquireRecorder(Queue::Main, "hierarchy");
    core->copyBuffer(heap_->texels(), uint64_t(range.first) * sizeof(Texel), **staging, 0, hierarchy.bytes(), &tracing);
    RecorderCore* const recorders[] = {core.get()};
    return submit(recorders, nullptr, where);
}

}  // namespace glint::detail
