#pragma once

// Vulkan's functions, loaded at run time into tables of our own: one for each instance and one for each device, so that
// calls go straight to the driver and several devices live side by side. The library defines no symbol of Vulkan's:
// global pointers named like its functions would be called as functions by a program that links the loader.

#ifndef VK_NO_PROTOTYPES
#define VK_NO_PROTOTYPES
#endif
#include <vulkan/vulkan_core.h>

namespace glint::vulkan {

// clang-format off
#define GLINT_VULKAN_GLOBAL_FUNCTIONS(X) \
    X(CreateInstance) X(EnumerateInstanceVersion) X(EnumerateInstanceLayerProperties) \
    X(EnumerateInstanceExtensionProperties)

#define GLINT_VULKAN_INSTANCE_FUNCTIONS(X) \
    X(DestroyInstance) X(EnumeratePhysicalDevices) X(EnumerateDeviceExtensionProperties) \
    X(GetDeviceProcAddr) X(CreateDevice) X(GetPhysicalDeviceProperties) \
    X(GetPhysicalDeviceProperties2) X(GetPhysicalDeviceFeatures2) \
    X(GetPhysicalDeviceFormatProperties) X(GetPhysicalDeviceImageFormatProperties2) \
    X(GetPhysicalDeviceMemoryProperties) X(GetPhysicalDeviceQueueFamilyProperties)

#define GLINT_VULKAN_SURFACE_FUNCTIONS(X) \
    X(DestroySurfaceKHR) X(GetPhysicalDeviceSurfaceSupportKHR) \
    X(GetPhysicalDeviceSurfaceCapabilitiesKHR) X(GetPhysicalDeviceSurfaceFormatsKHR) \
    X(GetPhysicalDeviceSurfacePresentModesKHR)

#define GLINT_VULKAN_DEBUG_FUNCTIONS(X) \
    X(CreateDebugUtilsMessengerEXT) X(DestroyDebugUtilsMessengerEXT) X(SetDebugUtilsObjectNameEXT) \
    X(CmdBeginDebugUtilsLabelEXT) X(CmdEndDebugUtilsLabelEXT)

#define GLINT_VULKAN_DEVICE_FUNCTIONS(X) \
    X(DestroyDevice) X(DeviceWaitIdle) X(GetDeviceQueue) X(QueueSubmit2) X(QueueWaitIdle) X(CreateSemaphore) \
    X(DestroySemaphore) X(GetSemaphoreCounterValue) X(WaitSemaphores) X(CreateFence) X(DestroyFence) \
    X(WaitForFences) X(ResetFences) X(CreateCommandPool) X(DestroyCommandPool) X(ResetCommandPool) \
    X(AllocateCommandBuffers) X(BeginCommandBuffer) X(EndCommandBuffer) X(GetBufferDeviceAddress) \
    X(CreateBufferView) X(DestroyBufferView) X(CreateImageView) X(DestroyImageView) X(CreateSampler) \
    X(DestroySampler) X(CreateShaderModule) X(DestroyShaderModule) X(CreateDescriptorSetLayout) \
    X(DestroyDescriptorSetLayout) X(CreatePipelineLayout) X(DestroyPipelineLayout) \
    X(CreateDescriptorUpdateTemplate) X(DestroyDescriptorUpdateTemplate) \
    X(UpdateDescriptorSets) X(UpdateDescriptorSetWithTemplate) X(CreateDescriptorPool) X(DestroyDescriptorPool) \
    X(AllocateDescriptorSets) X(CreateComputePipelines) X(CreateGraphicsPipelines) \
    X(DestroyPipeline) X(CreateQueryPool) X(DestroyQueryPool) X(ResetQueryPool) \
    X(GetQueryPoolResults) X(CmdPipelineBarrier2) X(CmdBindPipeline) X(CmdBindDescriptorSets) \
    X(CmdPushConstants) X(CmdDispatch) X(CmdDispatchIndirect) X(CmdBeginRendering) \
    X(CmdEndRendering) X(CmdSetViewportWithCount) X(CmdSetScissorWithCount) X(CmdSetBlendConstants) \
    X(CmdSetStencilReference) X(CmdBindVertexBuffers) X(CmdBindIndexBuffer) X(CmdDraw) \
    X(CmdDrawIndexed) X(CmdDrawIndirect) X(CmdDrawIndexedIndirect) \
    X(CmdDrawIndirectCount) X(CmdDrawIndexedIndirectCount) X(CmdCopyBuffer) X(CmdFillBuffer) \
    X(CmdCopyBufferToImage) X(CmdCopyImageToBuffer) X(CmdCopyImage) X(CmdClearColorImage) \
    X(CmdClearDepthStencilImage) X(CmdResetQueryPool) X(CmdBeginQuery) \
    X(CmdEndQuery) X(CmdWriteTimestamp2)

#define GLINT_VULKAN_SWAPCHAIN_FUNCTIONS(X) \
    X(CreateSwapchainKHR) X(DestroySwapchainKHR) X(GetSwapchainImagesKHR) X(AcquireNextImageKHR) \
    X(QueuePresentKHR)

#define GLINT_VULKAN_TRACING_FUNCTIONS(X) \
    X(CreateAccelerationStructureKHR) X(DestroyAccelerationStructureKHR) \
    X(GetAccelerationStructureBuildSizesKHR) X(GetAccelerationStructureDeviceAddressKHR) \
    X(CmdBuildAccelerationStructuresKHR) X(CmdCopyAccelerationStructureKHR) \
    X(CmdWriteAccelerationStructuresPropertiesKHR)

#define GLINT_VULKAN_TRAVERSAL_FUNCTIONS(X) \
    X(CreateRayTracingPipelinesKHR) X(GetRayTracingShaderGroupHandlesKHR) X(CmdTraceRaysKHR) \
    X(CmdTraceRaysIndirectKHR) X(GetRayTracingShaderGroupStackSizeKHR) X(CmdSetRayTracingPipelineStackSizeKHR)

#define GLINT_VULKAN_MESH_FUNCTIONS(X) \
    X(CmdDrawMeshTasksEXT) X(CmdDrawMeshTasksIndirectEXT) X(CmdDrawMeshTasksIndirectCountEXT)
// clang-format on

#define GLINT_VULKAN_MEMBER(name) PFN_vk##name name = nullptr;

/// What the loader offers before there is an instance.
struct LoaderFunctions {
    PFN_vkGetInstanceProcAddr GetInstanceProcAddr = nullptr;
    GLINT_VULKAN_GLOBAL_FUNCTIONS(GLINT_VULKAN_MEMBER)
};

/// Opens the Vulkan loader once for the whole process; nullptr if this machine has none.
const LoaderFunctions* loaderFunctions();

/// Functions of one instance. Those of VK_EXT_debug_utils and of surfaces are nullptr where the instance does not
/// enable them.
struct InstanceFunctions {
    PFN_vkGetInstanceProcAddr GetInstanceProcAddr = nullptr;
    GLINT_VULKAN_INSTANCE_FUNCTIONS(GLINT_VULKAN_MEMBER)
    GLINT_VULKAN_SURFACE_FUNCTIONS(GLINT_VULKAN_MEMBER)
    GLINT_VULKAN_DEBUG_FUNCTIONS(GLINT_VULKAN_MEMBER)

    void load(PFN_vkGetInstanceProcAddr get, VkInstance instance);
};

/// Functions of one device. Those of swapchains, acceleration structures, ray-tracing pipelines and mesh shaders are
/// nullptr where the device does not enable them.
struct DeviceFunctions {
    GLINT_VULKAN_DEVICE_FUNCTIONS(GLINT_VULKAN_MEMBER)
    GLINT_VULKAN_SWAPCHAIN_FUNCTIONS(GLINT_VULKAN_MEMBER)
    GLINT_VULKAN_TRACING_FUNCTIONS(GLINT_VULKAN_MEMBER)
    GLINT_VULKAN_TRAVERSAL_FUNCTIONS(GLINT_VULKAN_MEMBER)
    GLINT_VULKAN_MESH_FUNCTIONS(GLINT_VULKAN_MEMBER)

    void load(PFN_vkGetDeviceProcAddr get, VkDevice device);
};

#undef GLINT_VULKAN_MEMBER

}  // namespace glint::vulkan
