#pragma once

// The back ends there are.

#include <glint/base/expected.h>
#include <glint/device/detail/backend.h>

#include <memory>
#include <string_view>
#include <vector>

namespace glint::detail {

/// `api` as in DeviceDesc. Errors: "device.api" for an unknown one, and those of the back end.
Expected<std::unique_ptr<Backend>> createBackend(std::string_view api, const BackendDesc& desc);
Expected<std::vector<DeviceInfo>> listAdapters(std::string_view api);

}  // namespace glint::detail
