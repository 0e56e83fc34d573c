#include <glint/device/detail/driver_tracing.h>

#include <glint/device/detail/device_object.h>

#include <algorithm>

namespace glint::detail {

Error createDriverNative(TracingObject& tracing, std::source_location where) {
    DeviceObject& device = *tracing.device();
    if (tracing.tracing_type == Tracing::TypeInstance) {
        NativeBufferDesc desc;
        desc.size = std::max<uint64_t>(tracing.instances, 1) * device.backend->instanceSize();
        desc.flags = Buffer::FlagTracing | Buffer::FlagAddress;
        desc.name = "instances";
        Expected<Ref<BufferObject>> made = device.createInternal(desc, where);
        if (!made) return made.error();
        tracing.instance_buffer = std::move(*made);
    }
    NativeTracingDesc desc;
    desc.type = tracing.tracing_type;
    desc.flags = tracing.flags;
    desc.geometries = tracing.geometries;
    desc.instances = tracing.instances;
    desc.name = tracing.name();
    Expected<std::unique_ptr<NativeTracing>> made = device.backend->createTracing(desc);
    if (!made) return made.error().at(where);
    tracing.native = std::move(*made);
    tracing.setReady();
    return {};
}

Expected<TracingObject*> driverTracing(TracingObject& tracing, std::source_location where) {
    if (tracing.driver) return tracing.driver.get();
    auto twin = Ref<TracingObject>::adopt(new TracingObject(tracing.device()));
    twin->setName(tracing.name());
    twin->tracing_type = tracing.tracing_type;
    twin->flags = tracing.flags;
    twin->geometries = tracing.geometries;
    twin->buffers = tracing.buffers;
    twin->instances = tracing.instances;
    if (Error error = createDriverNative(*twin, where)) return unexpected(error);
    tracing.driver = std::move(twin);
    return tracing.driver.get();
}

const TracingObject* notBuiltByDriver(const TracingObject& tracing) {
    if (tracing.driver && tracing.driver->built) return nullptr;
    for (const Ref<TracingObject>& reference : tracing.references)
        if (!reference->driver || !reference->driver->built) return reference.get();
    return &tracing;
}

}  // namespace glint::detail
