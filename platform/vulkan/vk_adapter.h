#pragma once

#include "platform/vulkan/vk_instance.h"

#include <glint/device/detail/backend.h>

#include <array>
#include <string>
#include <vector>

namespace glint::vulkan {

/// The feature structures that Glint asks about or enables.
struct FeatureChain {
    VkPhysicalDeviceFeatures2 core = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2};
    VkPhysicalDeviceVulkan11Features v11 = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES};
    VkPhysicalDeviceVulkan12Features v12 = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES};
    VkPhysicalDeviceVulkan13Features v13 = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES};
    VkPhysicalDeviceAccelerationStructureFeaturesKHR structures = {
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_FEATURES_KHR};
    VkPhysicalDeviceRayQueryFeaturesKHR ray_query = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_QUERY_FEATURES_KHR};
    VkPhysicalDeviceRayTracingPipelineFeaturesKHR ray_pipeline = {
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_FEATURES_KHR};
    VkPhysicalDeviceMeshShaderFeaturesEXT mesh = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MESH_SHADER_FEATURES_EXT};
    VkPhysicalDeviceRobustness2FeaturesEXT robustness = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ROBUSTNESS_2_FEATURES_EXT};

    /// Chains those whose extension is among `extensions` to `core`; to be called again for a copy.
    void link(const std::vector<std::string>& extensions);
};

constexpr uint32_t no_family = ~0u;

/// An adapter and what it offers.
struct Adapter {
    VkPhysicalDevice handle = VK_NULL_HANDLE;
    VkPhysicalDeviceProperties properties = {};
    DeviceInfo info;
    /// What Glint needs and the adapter lacks: "Vulkan 1.3 (it has 1.2)"; empty if it will do.
    std::string lacking;
    std::vector<std::string> extensions;  ///< those of the adapter that Glint knows what to do with
    FeatureChain offered;
    std::array<uint32_t, detail::queue_count> families = {no_family, no_family, no_family};
    std::array<uint32_t, detail::queue_count> timestamp_bits = {};

    bool has(const char* extension) const;
};

/// What a device is created with.
struct Enabled {
    FeatureChain features;
    std::vector<std::string> extensions;
    FeatureMask mask = 0;
};

Adapter describeAdapter(const Instance& instance, VkPhysicalDevice handle, uint32_t index);

/// The adapter that `desc` asks for. Errors: "device.no_driver", "device.no_adapter", "device.unsupported".
Expected<Adapter> chooseAdapter(const Instance& instance, const detail::BackendDesc& desc);

/// What `wanted` takes of what the adapter offers, and what Glint uses wherever it is there.
Enabled enabledFeatures(const Adapter& adapter, FeatureMask wanted);

/// The features of `mask` and the adapter's limits.
Features describeFeatures(const Instance& instance, const Adapter& adapter, FeatureMask mask);

}  // namespace glint::vulkan
