#include <glint/device/detail/object.h>

#include <glint/device/detail/device_object.h>

#include <fmt/format.h>

namespace glint::detail {

const char* toString(ObjectType type) {
    switch (type) {
        case ObjectType::Device: return "device";
        case ObjectType::Buffer: return "buffer";
        case ObjectType::Texture: return "texture";
        case ObjectType::Sampler: return "sampler";
        case ObjectType::Shader: return "shader";
        case ObjectType::Kernel: return "kernel";
        case ObjectType::Pipeline: return "pipeline";
        case ObjectType::Traversal: return "traversal";
        case ObjectType::Target: return "target";
        case ObjectType::Tracing: return "tracing";
        case ObjectType::Query: return "query";
        case ObjectType::Fence: return "fence";
        case ObjectType::Window: return "window";
        case ObjectType::TextureTable: return "texture table";
        case ObjectType::BufferTable: return "buffer table";
        case ObjectType::Table: return "table";
    }
    return "object";
}

Object::Object(ObjectType type, DeviceObject* device) : type_(type), device_(device) {
    if (device_) device_->hold();
}

Object::~Object() = default;

void Object::retain() {
    if (users_.fetch_add(1, std::memory_order_relaxed) != 0) return;
    // A handle made from a held object.
    hold();
    if (device_) device_->hold();
}

void Object::release() {
    if (users_.fetch_sub(1, std::memory_order_acq_rel) != 1) return;
    lastRelease();
    DeviceObject* const device = device_;
    unhold();
    if (device) device->unhold();
}

void Object::unhold() {
    if (holds_.fetch_sub(1, std::memory_order_acq_rel) != 1) return;
    // No list holds the object any more, so last_use is final: lists let go of it after their submission is counted.
    DeviceObject* const device = device_;
    std::unique_ptr<Native> last_native = std::move(native);
    const std::array<uint64_t, queue_count> last = last_use;
    delete this;
    if (device && last_native) device->retire(std::move(last_native), last);
}

Error Object::fail(Error error) {
    keep(error);
    if (device_) device_->report(error);
    return error;
}

void Object::keep(const Error& error) {
    std::lock_guard lock(mutex_);
    if (!error_) error_ = error;
    state_.store(ObjectState::Failed, std::memory_order_release);
}

Error Object::error() const {
    std::lock_guard lock(mutex_);
    return error_;
}

std::string Object::name() const {
    std::lock_guard lock(mutex_);
    return name_;
}

std::string Object::label() const {
    const std::string name = this->name();
    return name.empty() ? std::string(toString(type_)) : fmt::format("{} '{}'", toString(type_), name);
}

void Object::setName(std::string_view name) {
    {
        std::lock_guard lock(mutex_);
        name_ = name;
    }
    if (native && !name.empty()) native->setName(std::string(name));
}

}  // namespace glint::detail
