#pragma once

#include <glint/base/status.h>
#include <glint/device/handle.h>

#include <cstdint>

namespace glint {

/// A point on the GPU's time line: passed to Device::submit, it is signaled once that work is done.
/// Created by Device::createFence; a fence that was never submitted counts as signaled.
class Fence : public Handle {
public:
    Fence() = default;
    explicit Fence(detail::Object* object) : Handle(object) {}

    bool isSignaled() const;
    /// Waits for at most `nanoseconds`. Errors: "fence.timeout", "device.lost".
    Status wait(uint64_t nanoseconds = UINT64_MAX) const;
};

}  // namespace glint
