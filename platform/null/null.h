#pragma once

// A device without a driver. Host memory stands for device memory: copies, fills and clears work on bytes; dispatches
// and draws are counted, and that is all. Every submission is judged by a HazardChecker, whose findings go to the
// device's message callback. Tests make it fail, hold its queues back and look inside through NullControl.

#include <glint/base/expected.h>
#include <glint/device/detail/backend.h>

#include <memory>
#include <vector>

namespace glint::null {

/// Errors: "device.no_adapter", "device.unsupported", "device.out_of_memory".
Expected<std::unique_ptr<detail::Backend>> createNullBackend(const detail::BackendDesc& desc);

/// The one adapter there is, "null".
Expected<std::vector<DeviceInfo>> nullAdapters();

}  // namespace glint::null
