#include <glint/device/fence.h>

#include <glint/device/detail/device_object.h>

namespace glint {

namespace {

std::array<uint64_t, detail::queue_count> values(detail::Object* object) {
    auto* fence = static_cast<detail::FenceObject*>(object);
    std::lock_guard lock(fence->mutex);
    return fence->values;
}

}  // namespace

bool Fence::isSignaled() const { return object_ && object_->device()->isDone(values(object_)); }

Status Fence::wait(uint64_t nanoseconds) const {
    if (!object_) return error();
    return object_->device()->wait(values(object_), nanoseconds, std::source_location::current());
}

}  // namespace glint
