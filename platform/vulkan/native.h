#pragma once

// The way to Vulkan's own handles, for programs that mix Glint with Vulkan code of their own. Opt-in: no other header
// of Glint includes Vulkan's.
//
// Glint tracks what its own commands do. Before a submit that uses an object which other Vulkan code has used since,
// that code has to be done (waited for on the host, or ordered by the caller on the device's queue), and an image has
// to be in the layout that Glint left it in.

#include <glint/device/device.h>

#include <vulkan/vulkan_core.h>

namespace glint::vulkan {

/// Handles of a device and one of its queues. They live as long as the device.
struct NativeDevice {
    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice adapter = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    uint32_t family = 0;
    /// Signaled with 1, 2, 3, ... as the queue's submissions are done.
    VkSemaphore timeline = VK_NULL_HANDLE;
};

/// Handles of a Glint device; all null if it is not ready or not of this API, no queue if it has none of this kind.
/// Glint submits to its queues from the threads that call submit: others have to stay away meanwhile.
NativeDevice nativeDevice(const Device& device, Queue queue = Queue::Main);

/// The object behind a handle, VK_NULL_HANDLE if it is not ready or not of this API. It lives as long as the handle.
VkBuffer nativeBuffer(const Buffer& buffer);
VkImage nativeImage(const Texture& texture);
VkPipeline nativePipeline(const Kernel& kernel);
VkPipeline nativePipeline(const Pipeline& pipeline);
VkAccelerationStructureKHR nativeTracing(const Tracing& tracing);

/// A device of the caller's. Nothing here is destroyed by Glint; all of it outlives the Glint device.
/// The VkDevice is of Vulkan 1.3 with timelineSemaphore, synchronization2, dynamicRendering and maintenance4.
struct DeviceImport {
    VkInstance instance = VK_NULL_HANDLE;
    PFN_vkGetInstanceProcAddr get_proc = nullptr;  ///< nullptr: the loader's
    VkPhysicalDevice adapter = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;  ///< for graphics, compute and copies
    uint32_t family = 0;
    /// Those that the VkDevice was made with. FeatureTextureTable and FeatureBufferTable mean nullDescriptor of
    /// VK_EXT_robustness2 besides what their names say, FeatureVertexLayer shaderOutputLayer and
    /// shaderOutputViewportIndex.
    FeatureMask features = FeatureNone;
    MessageCallback message;
};

/// Errors: "native.null" (a handle is missing), "device.no_driver", "device.unsupported".
Device importDevice(const DeviceImport& source, std::source_location where = std::source_location::current());

/// A buffer of the caller's, who destroys it when the device has no use for it any more. `flags` as it was made;
/// copies need VK_BUFFER_USAGE_TRANSFER_SRC_BIT and DST_BIT. Errors: "native.null", "native.api".
Buffer importBuffer(const Device& device, VkBuffer buffer, uint64_t size, Buffer::Flags flags,
                    std::string_view name = {}, std::source_location where = std::source_location::current());

/// An image of the caller's, as `desc` says (for a cube, `layers` counts cubes) and now in `layout`.
/// Errors: "native.null", "native.api", "native.layout" (one that Glint has no use for).
Texture importTexture(const Device& device, VkImage image, const TextureDesc& desc, VkImageLayout layout,
                      std::string_view name = {}, std::source_location where = std::source_location::current());

}  // namespace glint::vulkan
