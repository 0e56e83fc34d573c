#pragma once

#include <glint/base/error.h>

#include <string>
#include <string_view>

namespace glint {

namespace detail {
class Object;
}

/// What a handle stands for.
enum class ObjectState : uint8_t {
    Null,      ///< no object
    Building,  ///< being configured (a Kernel, Pipeline or Traversal before create()), or created in the background
    Ready,     ///< usable
    Failed,    ///< error() says why
};

/// Base of every object: a small value that holds one reference. Copies share the object, moves are free, and the order
/// of destruction never matters: the native object goes when the last reference is gone and the GPU has passed its
/// last use. Handles may be copied and released from any thread; one handle must not be written by two at once.
class Handle {
public:
    Handle() = default;
    Handle(const Handle& other);
    Handle(Handle&& other) noexcept : object_(other.object_) { other.object_ = nullptr; }
    Handle& operator=(const Handle& other);
    Handle& operator=(Handle&& other) noexcept;
    ~Handle();

    /// True if the object is ready. Using a handle that is not is never a crash: the use fails with an error.
    explicit operator bool() const { return state() == ObjectState::Ready; }
    ObjectState state() const;
    /// Why the object failed; "handle.null" for a null handle, no error for any other state.
    Error error() const;

    /// Debug name: given at creation, or afterwards; shown in messages, validation layers and debuggers.
    std::string name() const;
    void setName(std::string_view name);

    /// Same object.
    bool operator==(const Handle& other) const { return object_ == other.object_; }

    /// For Glint's own sources and for the back ends' native access.
    detail::Object* object() const { return object_; }

protected:
    /// Takes over one reference.
    explicit Handle(detail::Object* object) : object_(object) {}

    detail::Object* object_ = nullptr;
};

}  // namespace glint
