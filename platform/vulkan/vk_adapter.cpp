#include "platform/vulkan/vk_adapter.h"

#include "platform/vulkan/vulkan.h"

#include <glint/base/format_error.h>

#include <algorithm>
#include <cctype>
#include <cstring>

namespace glint::vulkan {

namespace {

constexpr const char* known_extensions[] = {
    VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME,
    VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME,
    VK_KHR_RAY_QUERY_EXTENSION_NAME,
    VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME,
    VK_EXT_MESH_SHADER_EXTENSION_NAME,
    VK_EXT_ROBUSTNESS_2_EXTENSION_NAME,
    VK_KHR_SWAPCHAIN_EXTENSION_NAME,
};

bool contains(const std::vector<std::string>& names, const char* name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

FeatureMask offeredFeatures(const Instance& instance, const Adapter& adapter) {
    const FeatureChain& chain = adapter.offered;
    const VkPhysicalDeviceFeatures& core = chain.core.features;
    const bool structures = chain.structures.accelerationStructure && chain.v12.bufferDeviceAddress;
    const bool queries = structures && chain.ray_query.rayQuery;
    FeatureMask mask = 0;
    const auto add = [&mask](FeatureMask feature, bool there) { mask |= there ? feature : 0; };
    add(FeatureComputeTracing, queries);
    add(FeatureFragmentTracing, queries);
    add(FeatureRayTracing, structures && chain.ray_pipeline.rayTracingPipeline);
    add(FeatureMeshShader, chain.mesh.meshShader && chain.mesh.taskShader);
    add(FeatureBufferAddress, chain.v12.bufferDeviceAddress);
    // Null descriptors are what an entry with nothing in it reads.
    const bool tables = chain.v12.runtimeDescriptorArray && chain.v12.descriptorBindingVariableDescriptorCount &&
                        chain.robustness.nullDescriptor;
    add(FeatureTextureTable, tables && chain.v12.shaderSampledImageArrayNonUniformIndexing);
    add(FeatureBufferTable, tables && chain.v12.shaderStorageBufferArrayNonUniformIndexing);
    add(FeatureShaderf16, chain.v12.shaderFloat16 && chain.v11.storageBuffer16BitAccess);
    add(FeatureShaderf64, core.shaderFloat64);
    add(FeatureShaderu8, chain.v12.shaderInt8 && chain.v12.storageBuffer8BitAccess);
    add(FeatureShaderu16, core.shaderInt16 && chain.v11.storageBuffer16BitAccess);
    add(FeatureShaderu64, core.shaderInt64);
    add(FeatureAtomicBufferu64, core.shaderInt64 && chain.v12.shaderBufferInt64Atomics);
    add(FeatureGeometryShader, core.geometryShader);
    add(FeatureTessellation, core.tessellationShader);
    add(FeatureAnisotropy, core.samplerAnisotropy);
    add(FeatureCubeArray, core.imageCubeArray);
    add(FeatureIndirectCount, chain.v12.drawIndirectCount);
    add(FeatureMultiDrawIndirect, core.multiDrawIndirect);
    add(FeatureWireframe, core.fillModeNonSolid);
    add(FeatureDepthClamp, core.depthClamp);
    add(FeatureTextureBC, core.textureCompressionBC);
    add(FeatureSamplerReduction, chain.v12.samplerFilterMinmax);
    add(FeatureStatistics, core.pipelineStatisticsQuery);
    add(FeatureTimestamps, adapter.timestamp_bits[0] != 0 && adapter.properties.limits.timestampPeriod > 0.0f);
    add(FeatureVertexLayer, chain.v12.shaderOutputLayer && chain.v12.shaderOutputViewportIndex);
    add(FeatureMultiViewport, core.multiViewport);
    add(FeaturePresent, instance.surfaces && adapter.has(VK_KHR_SWAPCHAIN_EXTENSION_NAME));
    return mask;
}

/// A family that has `wanted` and nothing of `unwanted`.
uint32_t findFamily(const std::vector<VkQueueFamilyProperties>& families, VkQueueFlags wanted, VkQueueFlags unwanted) {
    for (uint32_t i = 0; i < families.size(); i++) {
        const VkQueueFlags flags = families[i].queueFlags;
        if (families[i].queueCount && (flags & wanted) == wanted && !(flags & unwanted)) return i;
    }
    return no_family;
}

std::string lowerCase(std::string text) {
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

int rank(VkPhysicalDeviceType type) {
    switch (type) {
        case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU: return 4;
        case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU: return 3;
        case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU: return 2;
        case VK_PHYSICAL_DEVICE_TYPE_CPU: return 1;
        default: return 0;
    }
}

std::string listAdapters(const std::vector<Adapter>& adapters) {
    std::string text;
    for (const Adapter& adapter : adapters) {
        text += fmt::format("{}{} '{}'", text.empty() ? "" : ", ", adapter.info.index, adapter.info.name);
    }
    return text;
}

}  // namespace

void FeatureChain::link(const std::vector<std::string>& extensions) {
    core.pNext = &v11;
    v11.pNext = &v12;
    v12.pNext = &v13;
    void** next = &v13.pNext;
    const auto add = [&](const char* extension, auto& structure) {
        if (!contains(extensions, extension)) return;
        *next = &structure;
        next = &structure.pNext;
    };
    add(VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME, structures);
    add(VK_KHR_RAY_QUERY_EXTENSION_NAME, ray_query);
    add(VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME, ray_pipeline);
    add(VK_EXT_MESH_SHADER_EXTENSION_NAME, mesh);
    add(VK_EXT_ROBUSTNESS_2_EXTENSION_NAME, robustness);
    *next = nullptr;
}

bool Adapter::has(const char* extension) const { return contains(extensions, extension); }

Adapter describeAdapter(const Instance& instance, VkPhysicalDevice handle, uint32_t index) {
    const InstanceFunctions& vk = instance.vk;
    Adapter adapter;
    adapter.handle = handle;
    vk.GetPhysicalDeviceProperties(handle, &adapter.properties);
    const uint32_t version = adapter.properties.apiVersion;

    DeviceInfo& info = adapter.info;
    info.name = adapter.properties.deviceName;
    info.api = "vulkan";
    info.version = fmt::format("{}.{}.{}", VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version),
                               VK_API_VERSION_PATCH(version));
    info.index = index;
    info.vendor_id = adapter.properties.vendorID;
    info.device_id = adapter.properties.deviceID;
    info.cpu = adapter.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
    if (version < VK_API_VERSION_1_3) {
        adapter.lacking = fmt::format("Vulkan 1.3 (it has {})", info.version);
        return adapter;
    }

    VkPhysicalDeviceDriverProperties driver = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES};
    VkPhysicalDeviceProperties2 properties = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &driver, {}};
    vk.GetPhysicalDeviceProperties2(handle, &properties);
    // Mesa writes "Mesa 25.0.7" into the second and its driver's short name into the first.
    info.driver = driver.driverInfo[0] ? driver.driverInfo : driver.driverName;

    uint32_t count = 0;
    vk.EnumerateDeviceExtensionProperties(handle, nullptr, &count, nullptr);
    std::vector<VkExtensionProperties> extensions(count);
    vk.EnumerateDeviceExtensionProperties(handle, nullptr, &count, extensions.data());
    extensions.resize(count);
    for (const char* known : known_extensions) {
        for (const VkExtensionProperties& extension : extensions) {
            if (!std::strcmp(extension.extensionName, known)) adapter.extensions.push_back(known);
        }
    }
    adapter.offered.link(adapter.extensions);
    vk.GetPhysicalDeviceFeatures2(handle, &adapter.offered.core);

    vk.GetPhysicalDeviceQueueFamilyProperties(handle, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vk.GetPhysicalDeviceQueueFamilyProperties(handle, &count, families.data());
    constexpr VkQueueFlags graphics = VK_QUEUE_GRAPHICS_BIT, compute = VK_QUEUE_COMPUTE_BIT;
    adapter.families = {findFamily(families, graphics | compute, 0), findFamily(families, compute, graphics),
                        findFamily(families, VK_QUEUE_TRANSFER_BIT,
                                   graphics | compute | VK_QUEUE_OPTICAL_FLOW_BIT_NV | VK_QUEUE_VIDEO_DECODE_BIT_KHR)};
    for (size_t i = 0; i < detail::queue_count; i++) {
        if (adapter.families[i] != no_family)
            adapter.timestamp_bits[i] = families[adapter.families[i]].timestampValidBits;
    }
    info.features = offeredFeatures(instance, adapter);

    const auto need = [&adapter](bool there, const char* name) {
        if (!there) adapter.lacking += (adapter.lacking.empty() ? "" : ", ") + std::string(name);
    };
    need(adapter.families[0] != no_family, "a queue for graphics and compute");
    need(adapter.offered.v12.timelineSemaphore, "timelineSemaphore");
    need(adapter.offered.v13.synchronization2, "synchronization2");
    need(adapter.offered.v13.dynamicRendering, "dynamicRendering");
    need(adapter.offered.v13.maintenance4, "maintenance4");
    return adapter;
}

Expected<Adapter> chooseAdapter(const Instance& instance, const detail::BackendDesc& desc) {
    std::vector<Adapter> adapters;
    for (VkPhysicalDevice handle : instance.adapters()) {
        adapters.push_back(describeAdapter(instance, handle, static_cast<uint32_t>(adapters.size())));
    }
    if (adapters.empty()) {
        return unexpected(
            makeError(ErrorCode::Unsupported, "device.no_driver", "no Vulkan driver here offers an adapter"));
    }

    std::vector<const Adapter*> tried;
    const bool is_index =
        !desc.adapter.empty() && desc.adapter.size() < 6 &&
        std::all_of(desc.adapter.begin(), desc.adapter.end(), [](char c) { return c >= '0' && c <= '9'; });
    for (const Adapter& adapter : adapters) {
        const bool wanted = is_index ? adapter.info.index == static_cast<uint32_t>(std::stoul(desc.adapter))
                                     : lowerCase(adapter.info.name).find(lowerCase(desc.adapter)) != std::string::npos;
        if (wanted) tried.push_back(&adapter);
    }
    if (tried.empty()) {
        return unexpected(makeError(ErrorCode::InvalidArgument, "device.no_adapter", "no adapter {} '{}': there are {}",
                                    is_index ? "of number" : "is called", desc.adapter, listAdapters(adapters)));
    }
    std::stable_sort(tried.begin(), tried.end(), [](const Adapter* a, const Adapter* b) {
        return rank(a->properties.deviceType) > rank(b->properties.deviceType);
    });

    std::string reasons;
    for (const Adapter* adapter : tried) {
        const FeatureMask missing = desc.required & ~adapter->info.features;
        if (adapter->lacking.empty() && !missing) return *adapter;
        std::string lacking = adapter->lacking;
        if (missing) lacking += (lacking.empty() ? "" : ", ") + featureNames(missing);
        reasons += fmt::format("{}'{}' lacks {}", reasons.empty() ? "" : "; ", adapter->info.name, lacking);
    }
    return unexpected(
        makeError(ErrorCode::Unsupported, "device.unsupported", "no adapter offers all that is needed: {}", reasons));
}

Enabled enabledFeatures(const Adapter& adapter, FeatureMask wanted) {
    Enabled enabled;
    enabled.mask = wanted & adapter.info.features;
    const FeatureMask mask = enabled.mask;
    const FeatureChain& offered = adapter.offered;
    FeatureChain& features = enabled.features;

    const VkPhysicalDeviceFeatures& from = offered.core.features;
    VkPhysicalDeviceFeatures& core = features.core.features;
    // Costs nothing where it is there, and shaders count on it.
    core.independentBlend = from.independentBlend;
    core.sampleRateShading = from.sampleRateShading;
    core.fullDrawIndexUint32 = from.fullDrawIndexUint32;
    core.drawIndirectFirstInstance = from.drawIndirectFirstInstance;
    core.largePoints = from.largePoints;
    core.depthBiasClamp = from.depthBiasClamp;
    core.occlusionQueryPrecise = from.occlusionQueryPrecise;
    core.vertexPipelineStoresAndAtomics = from.vertexPipelineStoresAndAtomics;
    core.fragmentStoresAndAtomics = from.fragmentStoresAndAtomics;
    core.shaderImageGatherExtended = from.shaderImageGatherExtended;
    core.shaderStorageImageExtendedFormats = from.shaderStorageImageExtendedFormats;
    core.shaderStorageImageReadWithoutFormat = from.shaderStorageImageReadWithoutFormat;
    core.shaderStorageImageWriteWithoutFormat = from.shaderStorageImageWriteWithoutFormat;
    core.shaderStorageImageMultisample = from.shaderStorageImageMultisample;
    core.shaderUniformBufferArrayDynamicIndexing = from.shaderUniformBufferArrayDynamicIndexing;
    core.shaderSampledImageArrayDynamicIndexing = from.shaderSampledImageArrayDynamicIndexing;
    core.shaderStorageBufferArrayDynamicIndexing = from.shaderStorageBufferArrayDynamicIndexing;
    core.shaderStorageImageArrayDynamicIndexing = from.shaderStorageImageArrayDynamicIndexing;
    core.shaderClipDistance = from.shaderClipDistance;
    core.shaderCullDistance = from.shaderCullDistance;
    core.shaderTessellationAndGeometryPointSize = from.shaderTessellationAndGeometryPointSize;
    features.v11.shaderDrawParameters = offered.v11.shaderDrawParameters;
    features.v11.variablePointers = offered.v11.variablePointers;
    features.v11.variablePointersStorageBuffer = offered.v11.variablePointersStorageBuffer;
    features.v12.shaderUniformBufferArrayNonUniformIndexing = offered.v12.shaderUniformBufferArrayNonUniformIndexing;
    features.v12.shaderSampledImageArrayNonUniformIndexing = offered.v12.shaderSampledImageArrayNonUniformIndexing;
    features.v12.shaderStorageBufferArrayNonUniformIndexing = offered.v12.shaderStorageBufferArrayNonUniformIndexing;
    features.v12.shaderStorageImageArrayNonUniformIndexing = offered.v12.shaderStorageImageArrayNonUniformIndexing;
    features.v12.shaderUniformTexelBufferArrayDynamicIndexing =
        offered.v12.shaderUniformTexelBufferArrayDynamicIndexing;
    features.v12.shaderStorageTexelBufferArrayDynamicIndexing =
        offered.v12.shaderStorageTexelBufferArrayDynamicIndexing;
    features.v12.shaderUniformTexelBufferArrayNonUniformIndexing =
        offered.v12.shaderUniformTexelBufferArrayNonUniformIndexing;
    features.v12.shaderStorageTexelBufferArrayNonUniformIndexing =
        offered.v12.shaderStorageTexelBufferArrayNonUniformIndexing;
    features.v12.scalarBlockLayout = offered.v12.scalarBlockLayout;
    features.v12.uniformBufferStandardLayout = offered.v12.uniformBufferStandardLayout;
    features.v12.shaderSubgroupExtendedTypes = offered.v12.shaderSubgroupExtendedTypes;
    features.v12.hostQueryReset = offered.v12.hostQueryReset;
    features.v12.vulkanMemoryModel = offered.v12.vulkanMemoryModel;
    features.v12.vulkanMemoryModelDeviceScope = offered.v12.vulkanMemoryModelDeviceScope;
    features.v12.timelineSemaphore = VK_TRUE;
    features.v13.synchronization2 = VK_TRUE;
    features.v13.dynamicRendering = VK_TRUE;
    features.v13.maintenance4 = VK_TRUE;
    features.v13.subgroupSizeControl = offered.v13.subgroupSizeControl;
    features.v13.computeFullSubgroups = offered.v13.computeFullSubgroups;
    features.v13.shaderDemoteToHelperInvocation = offered.v13.shaderDemoteToHelperInvocation;
    features.v13.shaderTerminateInvocation = offered.v13.shaderTerminateInvocation;
    features.v13.shaderZeroInitializeWorkgroupMemory = offered.v13.shaderZeroInitializeWorkgroupMemory;
    features.v13.shaderIntegerDotProduct = offered.v13.shaderIntegerDotProduct;

    core.shaderFloat64 = (mask & FeatureShaderf64) != 0;
    core.shaderInt64 = (mask & (FeatureShaderu64 | FeatureAtomicBufferu64)) != 0;
    core.shaderInt16 = (mask & FeatureShaderu16) != 0;
    core.geometryShader = (mask & FeatureGeometryShader) != 0;
    core.tessellationShader = (mask & FeatureTessellation) != 0;
    core.samplerAnisotropy = (mask & FeatureAnisotropy) != 0;
    core.imageCubeArray = (mask & FeatureCubeArray) != 0;
    core.multiDrawIndirect = (mask & FeatureMultiDrawIndirect) != 0;
    core.fillModeNonSolid = (mask & FeatureWireframe) != 0;
    core.depthClamp = (mask & FeatureDepthClamp) != 0;
    core.textureCompressionBC = (mask & FeatureTextureBC) != 0;
    features.v12.shaderOutputLayer = (mask & FeatureVertexLayer) != 0;
    features.v12.shaderOutputViewportIndex = (mask & FeatureVertexLayer) != 0;
    core.multiViewport = (mask & FeatureMultiViewport) != 0;
    core.pipelineStatisticsQuery = (mask & FeatureStatistics) != 0;
    features.v12.drawIndirectCount = (mask & FeatureIndirectCount) != 0;
    features.v12.samplerFilterMinmax = (mask & FeatureSamplerReduction) != 0;
    features.v12.shaderBufferInt64Atomics = (mask & FeatureAtomicBufferu64) != 0;
    features.v12.shaderSharedInt64Atomics = (mask & FeatureAtomicBufferu64) && offered.v12.shaderSharedInt64Atomics;
    if (mask & FeatureShaderu8) {
        features.v12.shaderInt8 = VK_TRUE;
        features.v12.storageBuffer8BitAccess = VK_TRUE;
        features.v12.uniformAndStorageBuffer8BitAccess = offered.v12.uniformAndStorageBuffer8BitAccess;
        features.v12.storagePushConstant8 = offered.v12.storagePushConstant8;
    }
    features.v12.shaderFloat16 = (mask & FeatureShaderf16) != 0;
    if (mask & (FeatureShaderf16 | FeatureShaderu16)) {
        features.v11.storageBuffer16BitAccess = VK_TRUE;
        features.v11.uniformAndStorageBuffer16BitAccess = offered.v11.uniformAndStorageBuffer16BitAccess;
        features.v11.storagePushConstant16 = offered.v11.storagePushConstant16;
        features.v11.storageInputOutput16 = offered.v11.storageInputOutput16;
    }
    if (mask & (FeatureTextureTable | FeatureBufferTable)) {
        features.v12.descriptorIndexing = offered.v12.descriptorIndexing;
        features.v12.runtimeDescriptorArray = VK_TRUE;
        features.v12.descriptorBindingVariableDescriptorCount = VK_TRUE;
        features.robustness.nullDescriptor = VK_TRUE;
        enabled.extensions.push_back(VK_EXT_ROBUSTNESS_2_EXTENSION_NAME);
    }
    constexpr FeatureMask queries = FeatureComputeTracing | FeatureFragmentTracing;
    features.v12.bufferDeviceAddress = (mask & (FeatureBufferAddress | queries | FeatureRayTracing)) != 0;
    if (mask & (queries | FeatureRayTracing)) {
        features.structures.accelerationStructure = VK_TRUE;
        enabled.extensions.push_back(VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME);
        enabled.extensions.push_back(VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME);
    }
    if (mask & queries) {
        features.ray_query.rayQuery = VK_TRUE;
        enabled.extensions.push_back(VK_KHR_RAY_QUERY_EXTENSION_NAME);
    }
    if (mask & FeatureRayTracing) {
        features.ray_pipeline.rayTracingPipeline = VK_TRUE;
        features.ray_pipeline.rayTraversalPrimitiveCulling = offered.ray_pipeline.rayTraversalPrimitiveCulling;
        features.ray_pipeline.rayTracingPipelineTraceRaysIndirect =
            offered.ray_pipeline.rayTracingPipelineTraceRaysIndirect;
        enabled.extensions.push_back(VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME);
    }
    if (mask & FeatureMeshShader) {
        features.mesh.meshShader = VK_TRUE;
        features.mesh.taskShader = VK_TRUE;
        enabled.extensions.push_back(VK_EXT_MESH_SHADER_EXTENSION_NAME);
    }
    if (mask & FeaturePresent) enabled.extensions.push_back(VK_KHR_SWAPCHAIN_EXTENSION_NAME);
    return enabled;
}

namespace {

/// Layouts declare tables at their largest, so a program's four, and what it has besides, have to fit. No more than a
/// scene may ask for: lavapipe makes every set as large as its layout.
uint32_t tableSize(const VkPhysicalDeviceLimits& limits, SlotKind element) {
    constexpr uint32_t most = 65536;
    const bool is_texture = element == SlotKind::Texture;
    const uint32_t stage =
        is_texture ? limits.maxPerStageDescriptorSampledImages : limits.maxPerStageDescriptorStorageBuffers;
    const uint32_t set = is_texture ? limits.maxDescriptorSetSampledImages : limits.maxDescriptorSetStorageBuffers;
    return std::min({stage / 8, set / 8, limits.maxPerStageResources / 8, most});
}

/// Where task and mesh shaders have limits of their own, the lower one: groups are started the same way.
void describeMesh(const VkPhysicalDeviceMeshShaderPropertiesEXT& mesh, Features& features) {
    const auto count = [&](size_t i) { return std::min(mesh.maxTaskWorkGroupCount[i], mesh.maxMeshWorkGroupCount[i]); };
    // Along each axis Vulkan asks for as many threads as in all.
    const auto threads = [](uint32_t all, const uint32_t(&size)[3]) {
        return std::min(all, *std::min_element(std::begin(size), std::end(size)));
    };
    features.maxMeshGroupCountX = count(0);
    features.maxMeshGroupCountY = count(1);
    features.maxMeshGroupCountZ = count(2);
    features.maxMeshGroupCount = std::min(mesh.maxTaskWorkGroupTotalCount, mesh.maxMeshWorkGroupTotalCount);
    features.maxTaskThreads = threads(mesh.maxTaskWorkGroupInvocations, mesh.maxTaskWorkGroupSize);
    features.maxTaskPayload = mesh.maxTaskPayloadSize;
    features.maxMeshThreads = threads(mesh.maxMeshWorkGroupInvocations, mesh.maxMeshWorkGroupSize);
    features.maxMeshVertices = mesh.maxMeshOutputVertices;
    features.maxMeshPrimitives = mesh.maxMeshOutputPrimitives;
}

}  // namespace

Features describeFeatures(const Instance& instance, const Adapter& adapter, FeatureMask mask) {
    VkPhysicalDeviceVulkan11Properties v11 = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_PROPERTIES};
    VkPhysicalDeviceVulkan13Properties v13 = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_PROPERTIES};
    VkPhysicalDeviceAccelerationStructurePropertiesKHR structures = {
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_PROPERTIES_KHR};
    VkPhysicalDeviceRayTracingPipelinePropertiesKHR pipelines = {
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_PROPERTIES_KHR};
    VkPhysicalDeviceMeshShaderPropertiesEXT mesh = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MESH_SHADER_PROPERTIES_EXT};
    VkPhysicalDeviceProperties2 properties = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &v11, {}};
    v11.pNext = &v13;
    if (mask & FeatureMeshShader) {
        properties.pNext = &mesh;
        mesh.pNext = &v11;
    }
    if (adapter.has(VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME)) {
        v13.pNext = &structures;
        if (adapter.has(VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME)) structures.pNext = &pipelines;
    }
    instance.vk.GetPhysicalDeviceProperties2(adapter.handle, &properties);
    VkPhysicalDeviceMemoryProperties memory;
    instance.vk.GetPhysicalDeviceMemoryProperties(adapter.handle, &memory);
    const VkPhysicalDeviceLimits& limits = properties.properties.limits;

    Features features;
    features.mask = mask;
    features.computeTracing = (mask & FeatureComputeTracing) != 0;
    features.fragmentTracing = (mask & FeatureFragmentTracing) != 0;
    features.rayTracing = (mask & FeatureRayTracing) != 0;
    features.meshShader = (mask & FeatureMeshShader) != 0;
    features.bufferAddress = (mask & FeatureBufferAddress) != 0;
    features.textureTable = (mask & FeatureTextureTable) != 0;
    features.bufferTable = (mask & FeatureBufferTable) != 0;
    features.shaderf16 = (mask & FeatureShaderf16) != 0;
    features.shaderf64 = (mask & FeatureShaderf64) != 0;
    features.shaderu8 = (mask & FeatureShaderu8) != 0;
    features.shaderu16 = (mask & FeatureShaderu16) != 0;
    features.shaderu64 = (mask & FeatureShaderu64) != 0;
    features.atomicBufferu64 = (mask & FeatureAtomicBufferu64) != 0;

    if (features.rayTracing) {
        features.recursionDepth = pipelines.maxRayRecursionDepth;
        features.maxRays = pipelines.maxRayDispatchInvocationCount;
        features.maxRecordSize = pipelines.maxShaderGroupStride - pipelines.shaderGroupHandleSize;
        features.maxAttributeSize = pipelines.maxRayHitAttributeSize;
        features.indirectRays = adapter.offered.ray_pipeline.rayTracingPipelineTraceRaysIndirect;
    }
    features.subgroupSize = v11.subgroupSize;
    features.minSubgroupSize = v13.minSubgroupSize;
    features.maxSubgroupSize = v13.maxSubgroupSize;

    features.maxTexture2DSize = limits.maxImageDimension2D;
    features.maxTexture3DSize = limits.maxImageDimension3D;
    features.maxTextureCubeSize = limits.maxImageDimensionCube;
    features.maxTextureLayers = limits.maxImageArrayLayers;
    const VkSampleCountFlags samples = limits.framebufferColorSampleCounts & limits.framebufferDepthSampleCounts;
    for (uint32_t count : {2u, 4u, 8u}) {
        if (samples & count) features.maxTextureSamples = count;
    }
    features.maxTargets = std::min(limits.maxColorAttachments, detail::max_targets);
    features.maxTargetLayers = limits.maxFramebufferLayers;
    features.maxViewports = (mask & FeatureMultiViewport) ? std::min(limits.maxViewports, detail::max_viewports) : 1;
    features.maxIndirectDraws = limits.maxDrawIndirectCount;
    if (features.meshShader) describeMesh(mesh, features);
    features.maxGroupSizeX = limits.maxComputeWorkGroupSize[0];
    features.maxGroupSizeY = limits.maxComputeWorkGroupSize[1];
    features.maxGroupSizeZ = limits.maxComputeWorkGroupSize[2];
    features.maxGroupThreads = limits.maxComputeWorkGroupInvocations;
    features.maxGroupCountX = limits.maxComputeWorkGroupCount[0];
    features.maxGroupCountY = limits.maxComputeWorkGroupCount[1];
    features.maxGroupCountZ = limits.maxComputeWorkGroupCount[2];
    features.groupMemory = limits.maxComputeSharedMemorySize;
    features.maxPushSize = limits.maxPushConstantsSize;
    features.maxAnisotropy = (mask & FeatureAnisotropy) ? static_cast<uint32_t>(limits.maxSamplerAnisotropy) : 1;
    features.maxUniformSize = limits.maxUniformBufferRange;
    features.maxStorageSize = limits.maxStorageBufferRange;
    features.maxTexels = limits.maxTexelBufferElements;
    if (features.textureTable) features.maxTableTextures = tableSize(limits, SlotKind::Texture);
    if (features.bufferTable) features.maxTableBuffers = tableSize(limits, SlotKind::Storage);
    features.maxSets = limits.maxBoundDescriptorSets;
    features.maxBufferSize = v13.maxBufferSize;
    features.maxTracingInstances = structures.maxInstanceCount;
    features.maxTracingPrimitives = structures.maxPrimitiveCount;
    for (uint32_t i = 0; i < memory.memoryHeapCount; i++) {
        if (memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) {
            features.videoMemory += memory.memoryHeaps[i].size;
        }
    }
    features.uniformAlignment = static_cast<uint32_t>(limits.minUniformBufferOffsetAlignment);
    features.storageAlignment = static_cast<uint32_t>(limits.minStorageBufferOffsetAlignment);
    features.texelAlignment = static_cast<uint32_t>(limits.minTexelBufferOffsetAlignment);
    features.scratchAlignment = std::max(structures.minAccelerationStructureScratchOffsetAlignment, 1u);
    features.timestampPeriod = static_cast<double>(limits.timestampPeriod);
    return features;
}

Expected<std::vector<DeviceInfo>> vulkanAdapters() {
    Expected<std::shared_ptr<Instance>> instance = Instance::shared(false);
    if (!instance) return unexpected(instance.error());
    std::vector<DeviceInfo> infos;
    for (VkPhysicalDevice handle : (*instance)->adapters()) {
        infos.push_back(describeAdapter(**instance, handle, static_cast<uint32_t>(infos.size())).info);
    }
    if (infos.empty()) {
        return unexpected(
            makeError(ErrorCode::Unsupported, "device.no_driver", "no Vulkan driver here offers an adapter"));
    }
    return infos;
}

}  // namespace glint::vulkan
