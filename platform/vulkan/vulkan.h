#pragma once

#include <glint/base/expected.h>
#include <glint/device/detail/backend.h>

#include <memory>
#include <vector>

namespace glint::vulkan {

/// A device of its own on the adapter that `desc` asks for. Safe to call from several threads.
/// Errors: "device.no_driver" (no loader or no driver), "device.no_adapter" (nothing of that index or name),
/// "device.unsupported" (naming, for every adapter tried, what it lacks), "device.out_of_memory", "vulkan.result".
Expected<std::unique_ptr<detail::Backend>> createVulkanBackend(const detail::BackendDesc& desc);

/// All adapters, in the driver's order, also those that cannot run Glint. Errors: "device.no_driver".
Expected<std::vector<DeviceInfo>> vulkanAdapters();

}  // namespace glint::vulkan
