#include <glint/device/buffer.h>

#include <glint/device/detail/object.h>

namespace glint {

namespace {

const detail::BufferObject* ready(const Buffer& buffer) {
    return buffer ? static_cast<const detail::BufferObject*>(buffer.object()) : nullptr;
}

}  // namespace

uint64_t Buffer::getSize() const {
    const auto* buffer = ready(*this);
    return buffer ? buffer->size : 0;
}

Buffer::Flags Buffer::getFlags() const {
    const auto* buffer = ready(*this);
    return buffer ? buffer->flags : 0;
}

uint64_t Buffer::getAddress() const {
    const auto* buffer = ready(*this);
    return buffer ? buffer->nativeBuffer()->address : 0;
}

void* Buffer::map() const {
    const auto* buffer = ready(*this);
    return buffer && (buffer->flags & FlagMapped) ? buffer->nativeBuffer()->mapped : nullptr;
}

}  // namespace glint
