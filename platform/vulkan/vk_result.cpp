#include "platform/vulkan/vk_result.h"

#include <glint/base/format_error.h>

namespace glint::vulkan {

std::string resultName(VkResult result) {
    switch (result) {
#define GLINT_VULKAN_NAME(name) \
    case name: return #name;
        GLINT_VULKAN_NAME(VK_SUCCESS)
        GLINT_VULKAN_NAME(VK_NOT_READY)
        GLINT_VULKAN_NAME(VK_TIMEOUT)
        GLINT_VULKAN_NAME(VK_INCOMPLETE)
        GLINT_VULKAN_NAME(VK_ERROR_OUT_OF_HOST_MEMORY)
        GLINT_VULKAN_NAME(VK_ERROR_OUT_OF_DEVICE_MEMORY)
        GLINT_VULKAN_NAME(VK_ERROR_INITIALIZATION_FAILED)
        GLINT_VULKAN_NAME(VK_ERROR_DEVICE_LOST)
        GLINT_VULKAN_NAME(VK_ERROR_MEMORY_MAP_FAILED)
        GLINT_VULKAN_NAME(VK_ERROR_LAYER_NOT_PRESENT)
        GLINT_VULKAN_NAME(VK_ERROR_EXTENSION_NOT_PRESENT)
        GLINT_VULKAN_NAME(VK_ERROR_FEATURE_NOT_PRESENT)
        GLINT_VULKAN_NAME(VK_ERROR_INCOMPATIBLE_DRIVER)
        GLINT_VULKAN_NAME(VK_ERROR_TOO_MANY_OBJECTS)
        GLINT_VULKAN_NAME(VK_ERROR_FORMAT_NOT_SUPPORTED)
        GLINT_VULKAN_NAME(VK_ERROR_FRAGMENTED_POOL)
        GLINT_VULKAN_NAME(VK_ERROR_UNKNOWN)
        GLINT_VULKAN_NAME(VK_SUBOPTIMAL_KHR)
        GLINT_VULKAN_NAME(VK_ERROR_OUT_OF_DATE_KHR)
        GLINT_VULKAN_NAME(VK_ERROR_SURFACE_LOST_KHR)
        GLINT_VULKAN_NAME(VK_ERROR_NATIVE_WINDOW_IN_USE_KHR)
        GLINT_VULKAN_NAME(VK_ERROR_OUT_OF_POOL_MEMORY)
        GLINT_VULKAN_NAME(VK_ERROR_INVALID_EXTERNAL_HANDLE)
        GLINT_VULKAN_NAME(VK_ERROR_FRAGMENTATION)
        GLINT_VULKAN_NAME(VK_ERROR_INVALID_OPAQUE_CAPTURE_ADDRESS)
        GLINT_VULKAN_NAME(VK_ERROR_VALIDATION_FAILED_EXT)
        GLINT_VULKAN_NAME(VK_ERROR_INVALID_SHADER_NV)
        GLINT_VULKAN_NAME(VK_PIPELINE_COMPILE_REQUIRED)
#undef GLINT_VULKAN_NAME
        default: return fmt::format("VkResult {}", static_cast<int>(result));
    }
}

Error resultError(const char* call, VkResult result) {
    switch (result) {
        case VK_ERROR_OUT_OF_HOST_MEMORY:
        case VK_ERROR_OUT_OF_DEVICE_MEMORY:
        case VK_ERROR_OUT_OF_POOL_MEMORY:
        case VK_ERROR_FRAGMENTED_POOL:
        case VK_ERROR_TOO_MANY_OBJECTS:
            return makeError(ErrorCode::OutOfMemory, "device.out_of_memory", "{} gave {}", call, resultName(result));
        case VK_ERROR_SURFACE_LOST_KHR:
            return makeError(ErrorCode::Internal, "window.lost", "{} gave {}: the system has taken the window away",
                             call, resultName(result));
        case VK_ERROR_DEVICE_LOST:
            return makeError(ErrorCode::DeviceLost, "device.lost", "{} gave {}", call, resultName(result));
        default: return makeError(ErrorCode::Internal, "vulkan.result", "{} gave {}", call, resultName(result));
    }
}

}  // namespace glint::vulkan
