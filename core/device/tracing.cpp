#include <glint/device/tracing.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/device_object.h>
#include <glint/device/detail/software_tracing.h>

#include <algorithm>

namespace glint {

namespace {

using detail::TracingObject;

/// The object if it can still be configured.
TracingObject* building(const Tracing& tracing, const char* what, std::source_location where) {
    auto* object = static_cast<TracingObject*>(tracing.object());
    if (!object || object->state() == ObjectState::Failed) return nullptr;
    if (object->state() == ObjectState::Building) return object;
    // A ready structure stays as it is: the mistake is reported and the call ignored.
    object->device()->report(makeError(where, ErrorCode::InvalidArgument, "tracing.created",
                                       "{}: {} has been created already", what, object->label()));
    return nullptr;
}

/// Checks an input buffer and keeps it alive with the structure.
detail::BufferObject* input(TracingObject& tracing, const char* what, const Buffer& buffer, uint64_t offset,
                            uint64_t alignment, uint64_t count, uint64_t stride, uint64_t element,
                            std::source_location where) {
    const auto complain = [&]<class... Args>(ErrorCode code, const char* id, fmt::format_string<Args...> format,
                                             Args&&... args) {
        tracing.fail(makeError(where, code, id, "{}: {} of {}", tracing.label(),
                               fmt::format(format, std::forward<Args>(args)...), what));
        return nullptr;
    };
    if (!buffer)
        return complain(ErrorCode::InvalidArgument, "tracing.buffer", "the buffer is not usable ({})",
                        buffer.error().message());
    auto* object = static_cast<detail::BufferObject*>(buffer.object());
    if (object->device() != tracing.device())
        return complain(ErrorCode::InvalidArgument, "handle.device", "{} belongs to another device", object->label());
    if (!(object->flags & Buffer::FlagTracing))
        return complain(ErrorCode::InvalidArgument, "buffer.flag", "{} was made without Buffer::FlagTracing",
                        object->label());
    if (offset % alignment || stride % alignment || stride < element)
        return complain(ErrorCode::InvalidArgument, "tracing.stride",
                        "offset {} and stride {} must be multiples of {}, the stride at least {}", offset, stride,
                        alignment, element);
    const uint64_t bytes = count ? (count - 1) * stride + element : 0;
    if (offset > object->size || bytes > object->size - offset)
        return complain(ErrorCode::OutOfRange, "tracing.range",
                        "{} elements of {} bytes from offset {} exceed {} of {} bytes", count, stride, offset,
                        object->label(), object->size);
    tracing.buffers.emplace_back(object);
    return object;
}

/// The driver's structure for a configured one and, for a top level, room for its instances.
Expected<std::unique_ptr<detail::NativeTracing>> createDriverTracing(TracingObject& tracing,
                                                                     std::source_location where) {
    detail::DeviceObject& device = *tracing.device();
    if (tracing.tracing_type == Tracing::TypeInstance) {
        detail::NativeBufferDesc desc;
        desc.size = std::max<uint64_t>(tracing.instances, 1) * device.backend->instanceSize();
        desc.flags = Buffer::FlagTracing | Buffer::FlagAddress;
        desc.name = "instances";
        Expected<detail::Ref<detail::BufferObject>> made = device.createInternal(desc, where);
        if (!made) return unexpected(made.error());
        tracing.instance_buffer = std::move(*made);
    }
    detail::NativeTracingDesc desc;
    desc.type = tracing.tracing_type;
    desc.flags = tracing.flags;
    desc.geometries = tracing.geometries;
    desc.instances = tracing.instances;
    desc.name = tracing.name();
    return device.backend->createTracing(desc);
}

}  // namespace

void Tracing::addVertexBuffer(uint32_t vertices, Format format, uint32_t stride, const Buffer& buffer, uint64_t offset,
                              std::source_location where) {
    TracingObject* object = building(*this, "addVertexBuffer", where);
    if (!object) return;
    if (format != FormatRGBf32) {
        object->fail(makeError(where, ErrorCode::InvalidArgument, "tracing.format",
                               "{}: vertex format {}; positions are FormatRGBf32", object->label(), toString(format)));
        return;
    }
    detail::BufferObject* memory = input(*object, "addVertexBuffer", buffer, offset, 4, vertices, stride, 12, where);
    if (!memory) return;
    detail::TracingGeometry geometry;
    geometry.vertices = vertices;
    geometry.vertex_format = format;
    geometry.vertex_stride = stride;
    geometry.vertex_offset = offset;
    geometry.vertex_buffer = memory;
    object->geometries.push_back(geometry);
}

void Tracing::addIndexBuffer(uint32_t indices, Format format, const Buffer& buffer, uint64_t offset,
                             std::source_location where) {
    TracingObject* object = building(*this, "addIndexBuffer", where);
    if (!object) return;
    if (object->geometries.empty() || !object->geometries.back().vertex_buffer ||
        object->geometries.back().index_buffer) {
        object->fail(makeError(where, ErrorCode::InvalidArgument, "tracing.order",
                               "{}: addIndexBuffer follows its addVertexBuffer", object->label()));
        return;
    }
    const uint32_t size = format == FormatRu16 ? 2u : format == FormatRu32 ? 4u : 0u;
    if (!size || indices % 3) {
        object->fail(makeError(where, ErrorCode::InvalidArgument, "tracing.indices",
                               "{}: {} indices of format {}; they are FormatRu16 or FormatRu32, three a triangle",
                               object->label(), indices, toString(format)));
        return;
    }
    detail::BufferObject* memory = input(*object, "addIndexBuffer", buffer, offset, size, indices, size, size, where);
    if (!memory) return;
    detail::TracingGeometry& geometry = object->geometries.back();
    geometry.indices = indices;
    geometry.index_format = format;
    geometry.index_offset = offset;
    geometry.index_buffer = memory;
}

void Tracing::addBoundBuffer(uint32_t bounds, uint32_t stride, const Buffer& buffer, uint64_t offset,
                             std::source_location where) {
    TracingObject* object = building(*this, "addBoundBuffer", where);
    if (!object) return;
    detail::BufferObject* memory = input(*object, "addBoundBuffer", buffer, offset, 8, bounds, stride, 24, where);
    if (!memory) return;
    detail::TracingGeometry geometry;
    geometry.bounds = bounds;
    geometry.bound_stride = stride;
    geometry.bound_offset = offset;
    geometry.bound_buffer = memory;
    object->geometries.push_back(geometry);
}

void Tracing::setInstances(uint32_t instances, std::source_location where) {
    if (TracingObject* object = building(*this, "setInstances", where)) object->instances = instances;
}

Status Tracing::create(Type type, Flags flags, std::source_location where) {
    auto* object = static_cast<TracingObject*>(object_);
    if (!object) return error().at(where);
    if (object->state() == ObjectState::Failed) return object->error();
    if (!building(*this, "create", where))
        return makeError(where, ErrorCode::InvalidArgument, "tracing.created", "{} has been created already",
                         object->label());
    detail::DeviceObject& device = *object->device();
    const Features& features = device.features();
    const auto complain = [&]<class... Args>(ErrorCode code, const char* id, fmt::format_string<Args...> format,
                                             Args&&... args) {
        return Status(object->fail(
            makeError(where, code, id, "{}: {}", object->label(), fmt::format(format, std::forward<Args>(args)...))));
    };
    if (!features.computeTracing && !features.fragmentTracing && !features.rayTracing)
        return complain(ErrorCode::Unsupported, "tracing.unsupported", "the device has none of {}",
                        featureNames(FeatureComputeTracing | FeatureFragmentTracing | FeatureRayTracing));
    if ((flags & FlagFastBuild) && (flags & FlagFastTrace))
        return complain(ErrorCode::InvalidArgument, "tracing.flags",
                        "FlagFastBuild and FlagFastTrace exclude each other");
    object->tracing_type = type;
    object->flags = flags;
    for (detail::TracingGeometry& geometry : object->geometries)
        if (type == TypeInstance || (geometry.bound_buffer != nullptr) != (type == TypeBound))
            return complain(ErrorCode::InvalidArgument, "tracing.geometry",
                            "a structure holds triangles, boxes or instances, not several of them");
    if (type != TypeInstance && object->geometries.empty())
        return complain(ErrorCode::InvalidArgument, "tracing.empty", "no geometry has been added");
    if (type != TypeInstance && object->instances)
        return complain(ErrorCode::InvalidArgument, "tracing.geometry", "instances belong to a top-level structure");
    for (const detail::TracingGeometry& geometry : object->geometries)
        if (geometry.vertex_buffer && !geometry.index_buffer && geometry.vertices % 3)
            return complain(ErrorCode::InvalidArgument, "tracing.vertices",
                            "{} vertices without indices; they are three a triangle", geometry.vertices);
    const uint64_t limit = type == TypeInstance ? features.maxTracingInstances : features.maxTracingPrimitives;
    if (getPrimitives() > limit)
        return complain(ErrorCode::OutOfRange, "tracing.too_large", "{} primitives exceed the limit of {}",
                        getPrimitives(), limit);

    Expected<std::unique_ptr<detail::NativeTracing>> made =
        device.heap() ? detail::createSoftwareTracing(device, *object, where) : createDriverTracing(*object, where);
    if (!made) return Status(object->fail(made.error().at(where)));
    object->native = std::move(*made);
    object->setReady();
    return {};
}

Tracing::Type Tracing::getType() const {
    return object_ ? static_cast<TracingObject*>(object_)->tracing_type : TypeTriangle;
}

uint32_t Tracing::getGeometries() const {
    return object_ ? static_cast<uint32_t>(static_cast<TracingObject*>(object_)->geometries.size()) : 0;
}

uint64_t Tracing::getPrimitives() const {
    if (!object_) return 0;
    const auto& object = *static_cast<TracingObject*>(object_);
    uint64_t count = object.instances;
    for (const detail::TracingGeometry& geometry : object.geometries)
        count += geometry.bound_buffer ? geometry.bounds
                                       : (geometry.index_buffer ? geometry.indices : geometry.vertices) / 3;
    return count;
}

uint64_t Tracing::getBuildSize() const {
    return *this ? static_cast<TracingObject*>(object_)->nativeTracing()->build_size : 0;
}

uint64_t Tracing::getUpdateSize() const {
    return *this ? static_cast<TracingObject*>(object_)->nativeTracing()->update_size : 0;
}

uint64_t Tracing::getMemory() const {
    return *this ? static_cast<TracingObject*>(object_)->nativeTracing()->memory : 0;
}

}  // namespace glint
