#include <glint/device/handle.h>

#include <glint/device/detail/object.h>

#include <utility>

namespace glint {

Handle::Handle(const Handle& other) : object_(other.object_) {
    if (object_) object_->retain();
}

Handle& Handle::operator=(const Handle& other) {
    Handle copy(other);
    std::swap(object_, copy.object_);
    return *this;
}

Handle& Handle::operator=(Handle&& other) noexcept {
    std::swap(object_, other.object_);
    return *this;
}

Handle::~Handle() {
    if (object_) object_->release();
}

ObjectState Handle::state() const { return object_ ? object_->state() : ObjectState::Null; }

Error Handle::error() const {
    if (object_) return object_->error();
    return Error::inFile(ErrorCode::InvalidArgument, "handle.null", "the handle is null", {}, 0);
}

std::string Handle::name() const { return object_ ? object_->name() : std::string(); }

void Handle::setName(std::string_view name) {
    if (object_) object_->setName(name);
}

}  // namespace glint
