#pragma once

#include "platform/vulkan/vk_functions.h"

#include <glint/base/error.h>

#include <string>

namespace glint::vulkan {

/// "VK_ERROR_OUT_OF_HOST_MEMORY", or the number of a result that this source does not know.
std::string resultName(VkResult result);

/// The error of a failed call: "device.out_of_memory", "device.lost", "window.lost" or "vulkan.result", naming the call
/// and its result.
Error resultError(const char* call, VkResult result);

}  // namespace glint::vulkan
