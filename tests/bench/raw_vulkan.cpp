#include "bench/raw_vulkan.h"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace glint::bench {

void require(VkResult result, const char* what) {
    if (result != VK_SUCCESS) {
        throw std::runtime_error(std::string("hand-written Vulkan: ") + what + " gave " +
                                 std::to_string(static_cast<int>(result)));
    }
}

RawDevice::RawDevice(std::string_view adapter, Tracing tracing) {
    library_ = ::dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
    if (!library_) throw std::runtime_error("hand-written Vulkan: there is no libvulkan.so.1");
    const auto loader =
        reinterpret_cast<PFN_vkGetInstanceProcAddr>(::dlsym(library_, "vkGetInstanceProcAddr"));  // NOLINT
    const auto create_instance = reinterpret_cast<PFN_vkCreateInstance>(loader(nullptr, "vkCreateInstance"));

    VkApplicationInfo application = {VK_STRUCTURE_TYPE_APPLICATION_INFO};
    application.apiVersion = VK_API_VERSION_1_3;
    VkInstanceCreateInfo instance_info = {VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
    instance_info.pApplicationInfo = &application;
    require(create_instance(&instance_info, nullptr, &instance_), "vkCreateInstance");
#define GLINT_RAW_LOAD(name) vk.name = reinterpret_cast<PFN_vk##name>(loader(instance_, "vk" #name));
    GLINT_RAW_INSTANCE_FUNCTIONS(GLINT_RAW_LOAD)
#undef GLINT_RAW_LOAD

    uint32_t count = 0;
    require(vk.EnumeratePhysicalDevices(instance_, &count, nullptr), "vkEnumeratePhysicalDevices");
    std::vector<VkPhysicalDevice> adapters(count);
    require(vk.EnumeratePhysicalDevices(instance_, &count, adapters.data()), "vkEnumeratePhysicalDevices");
    for (VkPhysicalDevice candidate : adapters) {
        vk.GetPhysicalDeviceProperties(candidate, &properties_);
        if (!adapter.empty() && adapter != properties_.deviceName) continue;
        adapter_ = candidate;
        break;
    }
    if (!adapter_) throw std::runtime_error("hand-written Vulkan: there is no adapter '" + std::string(adapter) + "'");
    vk.GetPhysicalDeviceMemoryProperties(adapter_, &memory_);

    vk.GetPhysicalDeviceQueueFamilyProperties(adapter_, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vk.GetPhysicalDeviceQueueFamilyProperties(adapter_, &count, families.data());
    const auto family = std::find_if(families.begin(), families.end(), [](const VkQueueFamilyProperties& each) {
        constexpr VkQueueFlags wanted = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
        return (each.queueFlags & wanted) == wanted;
    });
    if (family == families.end()) throw std::runtime_error("hand-written Vulkan: no queue draws and computes");
    family_ = static_cast<uint32_t>(family - families.begin());

    const float priority = 1.0f;
    VkDeviceQueueCreateInfo queue_info = {VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
    queue_info.queueFamilyIndex = family_;
    queue_info.queueCount = 1;
    queue_info.pQueuePriorities = &priority;

    VkPhysicalDeviceVulkan13Features features13 = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES};
    features13.synchronization2 = VK_TRUE;
    features13.dynamicRendering = VK_TRUE;
    features13.maintenance4 = VK_TRUE;  // SPIR-V 1.6 states group sizes by LocalSizeId
    VkPhysicalDeviceVulkan12Features features12 = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES};
    features12.pNext = &features13;
    features12.timelineSemaphore = VK_TRUE;
    features12.bufferDeviceAddress = VK_TRUE;
    VkPhysicalDeviceAccelerationStructureFeaturesKHR acceleration = {
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_FEATURES_KHR};
    acceleration.accelerationStructure = VK_TRUE;
    VkPhysicalDeviceRayQueryFeaturesKHR ray_query = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_QUERY_FEATURES_KHR};
    ray_query.pNext = &acceleration;
    ray_query.rayQuery = VK_TRUE;
    VkPhysicalDeviceRayTracingPipelineFeaturesKHR pipelines = {
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_FEATURES_KHR};
    pipelines.pNext = &acceleration;
    pipelines.rayTracingPipeline = VK_TRUE;
    const std::array extensions = {
        VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME, VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME,
        tracing == Tracing::On ? VK_KHR_RAY_QUERY_EXTENSION_NAME : VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME};

    VkDeviceCreateInfo device_info = {VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
    device_info.pNext = &features12;
    device_info.queueCreateInfoCount = 1;
    device_info.pQueueCreateInfos = &queue_info;
    if (tracing != Tracing::Off) {
        features13.pNext = tracing == Tracing::On ? static_cast<void*>(&ray_query) : &pipelines;
        device_info.enabledExtensionCount = static_cast<uint32_t>(extensions.size());
        device_info.ppEnabledExtensionNames = extensions.data();
    }
    require(vk.CreateDevice(adapter_, &device_info, nullptr, &device_), "vkCreateDevice");
#define GLINT_RAW_LOAD(name) vk.name = reinterpret_cast<PFN_vk##name>(vk.GetDeviceProcAddr(device_, "vk" #name));
    GLINT_RAW_DEVICE_FUNCTIONS(GLINT_RAW_LOAD)
    if (tracing != Tracing::Off) { GLINT_RAW_TRACING_FUNCTIONS(GLINT_RAW_LOAD) }
    if (tracing == Tracing::Pipelines) { GLINT_RAW_PIPELINE_FUNCTIONS(GLINT_RAW_LOAD) }
#undef GLINT_RAW_LOAD
    vk.GetDeviceQueue(device_, family_, 0, &queue_);

    VkSemaphoreTypeCreateInfo timeline = {VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO};
    timeline.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
    VkSemaphoreCreateInfo semaphore_info = {VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO};
    semaphore_info.pNext = &timeline;
    require(vk.CreateSemaphore(device_, &semaphore_info, nullptr, &timeline_), "vkCreateSemaphore");

    VkCommandPoolCreateInfo pool_info = {VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
    pool_info.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
    pool_info.queueFamilyIndex = family_;
    require(vk.CreateCommandPool(device_, &pool_info, nullptr, &pool_), "vkCreateCommandPool");
    VkCommandBufferAllocateInfo commands_info = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
    commands_info.commandPool = pool_;
    commands_info.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    commands_info.commandBufferCount = 1;
    require(vk.AllocateCommandBuffers(device_, &commands_info, &commands_), "vkAllocateCommandBuffers");
}

RawDevice::~RawDevice() {
    if (device_) {
        vk.DeviceWaitIdle(device_);
        for (auto release = releases_.rbegin(); release != releases_.rend(); ++release) (*release)();
        vk.DestroyCommandPool(device_, pool_, nullptr);
        vk.DestroySemaphore(device_, timeline_, nullptr);
        vk.DestroyDevice(device_, nullptr);
    }
    if (instance_) vk.DestroyInstance(instance_, nullptr);
    ::dlclose(library_);
}

VkDeviceMemory RawDevice::allocate(const VkMemoryRequirements& requirements, VkMemoryPropertyFlags wanted,
                                   bool address) {
    VkMemoryAllocateFlagsInfo flags = {VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO};
    flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
    VkMemoryAllocateInfo info = {VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
    if (address) info.pNext = &flags;
    info.allocationSize = requirements.size;
    uint32_t type = 0;
    while (type < memory_.memoryTypeCount && ((requirements.memoryTypeBits & (1u << type)) == 0 ||
                                              (memory_.memoryTypes[type].propertyFlags & wanted) != wanted)) {
        type++;
    }
    if (type == memory_.memoryTypeCount) throw std::runtime_error("hand-written Vulkan: no memory type fits");
    info.memoryTypeIndex = type;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    require(vk.AllocateMemory(device_, &info, nullptr, &memory), "vkAllocateMemory");
    own([this, memory] { vk.FreeMemory(device_, memory, nullptr); });
    return memory;
}

RawBuffer RawDevice::createBuffer(VkDeviceSize size, VkBufferUsageFlags usage, bool host) {
    RawBuffer result = {.size = size};
    VkBufferCreateInfo info = {VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
    info.size = size;
    info.usage = usage;
    require(vk.CreateBuffer(device_, &info, nullptr, &result.buffer), "vkCreateBuffer");
    VkMemoryRequirements requirements = {};
    vk.GetBufferMemoryRequirements(device_, result.buffer, &requirements);
    VkMemoryPropertyFlags wanted = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
    if (host) {
        // Cached where there is such memory: the processor reads other kinds a hundred times slower.
        wanted = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
        for (uint32_t type = 0; type < memory_.memoryTypeCount; type++) {
            constexpr VkMemoryPropertyFlags cached = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT |
                                                     VK_MEMORY_PROPERTY_HOST_COHERENT_BIT |
                                                     VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
            const bool usable = (requirements.memoryTypeBits & (1u << type)) != 0;
            if (usable && (memory_.memoryTypes[type].propertyFlags & cached) == cached) wanted = cached;
        }
    }
    const bool address = (usage & VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT) != 0;
    const VkDeviceMemory memory = allocate(requirements, wanted, address);
    require(vk.BindBufferMemory(device_, result.buffer, memory, 0), "vkBindBufferMemory");
    if (host) {
        void* mapped = nullptr;
        require(vk.MapMemory(device_, memory, 0, VK_WHOLE_SIZE, 0, &mapped), "vkMapMemory");
        result.mapped = static_cast<std::byte*>(mapped);
    }
    if (address) {
        VkBufferDeviceAddressInfo address_info = {VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO};
        address_info.buffer = result.buffer;
        result.address = vk.GetBufferDeviceAddress(device_, &address_info);
    }
    own([this, buffer = result.buffer] { vk.DestroyBuffer(device_, buffer, nullptr); });
    return result;
}

RawImage RawDevice::createImage(VkFormat format, uint32_t width, uint32_t height, VkImageUsageFlags usage,
                                uint32_t mips) {
    RawImage result = {.format = format, .width = width, .height = height};
    VkImageCreateInfo info = {VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = format;
    info.extent = {width, height, 1};
    info.mipLevels = mips;
    info.arrayLayers = 1;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.tiling = VK_IMAGE_TILING_OPTIMAL;
    info.usage = usage;
    require(vk.CreateImage(device_, &info, nullptr, &result.image), "vkCreateImage");
    VkMemoryRequirements requirements = {};
    vk.GetImageMemoryRequirements(device_, result.image, &requirements);
    require(vk.BindImageMemory(device_, result.image,
                               allocate(requirements, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, false), 0),
            "vkBindImageMemory");

    VkImageViewCreateInfo view = {VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO};
    view.image = result.image;
    view.viewType = VK_IMAGE_VIEW_TYPE_2D;
    view.format = format;
    view.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    require(vk.CreateImageView(device_, &view, nullptr, &result.view), "vkCreateImageView");
    own([this, result] {
        vk.DestroyImageView(device_, result.view, nullptr);
        vk.DestroyImage(device_, result.image, nullptr);
    });
    return result;
}

VkSampler RawDevice::createSampler() {
    VkSamplerCreateInfo info = {VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO};
    info.magFilter = VK_FILTER_LINEAR;
    info.minFilter = VK_FILTER_LINEAR;
    info.addressModeU = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
    info.addressModeV = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
    info.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
    VkSampler sampler = VK_NULL_HANDLE;
    require(vk.CreateSampler(device_, &info, nullptr, &sampler), "vkCreateSampler");
    own([this, sampler] { vk.DestroySampler(device_, sampler, nullptr); });
    return sampler;
}

RawProgram RawDevice::createLayout(std::span<const VkDescriptorSetLayoutBinding> bindings) {
    RawProgram program;
    VkDescriptorSetLayoutCreateInfo set_info = {VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
    set_info.bindingCount = static_cast<uint32_t>(bindings.size());
    set_info.pBindings = bindings.data();
    require(vk.CreateDescriptorSetLayout(device_, &set_info, nullptr, &program.set_layout),
            "vkCreateDescriptorSetLayout");
    VkPipelineLayoutCreateInfo info = {VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
    info.setLayoutCount = 1;
    info.pSetLayouts = &program.set_layout;
    require(vk.CreatePipelineLayout(device_, &info, nullptr, &program.layout), "vkCreatePipelineLayout");
    own([this, program] {
        vk.DestroyPipelineLayout(device_, program.layout, nullptr);
        vk.DestroyDescriptorSetLayout(device_, program.set_layout, nullptr);
    });
    return program;
}

VkShaderModule RawDevice::createModule(std::span<const uint32_t> words) {
    VkShaderModuleCreateInfo info = {VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
    info.codeSize = words.size_bytes();
    info.pCode = words.data();
    VkShaderModule module = VK_NULL_HANDLE;
    require(vk.CreateShaderModule(device_, &info, nullptr, &module), "vkCreateShaderModule");
    return module;
}

RawProgram RawDevice::createKernel(std::span<const uint32_t> words,
                                   std::span<const VkDescriptorSetLayoutBinding> bindings) {
    RawProgram program = createLayout(bindings);
    VkComputePipelineCreateInfo info = {VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO};
    info.stage = {VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO};
    info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    info.stage.module = createModule(words);
    info.stage.pName = "main";
    info.layout = program.layout;
    const VkResult result = vk.CreateComputePipelines(device_, VK_NULL_HANDLE, 1, &info, nullptr, &program.pipeline);
    vk.DestroyShaderModule(device_, info.stage.module, nullptr);
    require(result, "vkCreateComputePipelines");
    own([this, pipeline = program.pipeline] { vk.DestroyPipeline(device_, pipeline, nullptr); });
    return program;
}

RawProgram RawDevice::createPipeline(const RawGraphics& desc) {
    RawProgram program = createLayout(desc.bindings);

    std::array<VkPipelineShaderStageCreateInfo, 2> stages = {};
    stages[0].sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    stages[0].stage = VK_SHADER_STAGE_VERTEX_BIT;
    stages[0].module = createModule(desc.vertex);
    stages[0].pName = "main";
    stages[1] = stages[0];
    stages[1].stage = VK_SHADER_STAGE_FRAGMENT_BIT;
    stages[1].module = createModule(desc.fragment);

    const VkVertexInputBindingDescription binding = {0, desc.stride, VK_VERTEX_INPUT_RATE_VERTEX};
    VkPipelineVertexInputStateCreateInfo vertex_input = {VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO};
    vertex_input.vertexBindingDescriptionCount = 1;
    vertex_input.pVertexBindingDescriptions = &binding;
    vertex_input.vertexAttributeDescriptionCount = static_cast<uint32_t>(desc.attributes.size());
    vertex_input.pVertexAttributeDescriptions = desc.attributes.data();
    VkPipelineInputAssemblyStateCreateInfo assembly = {VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO};
    assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
    VkPipelineViewportStateCreateInfo viewport = {VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO};
    viewport.viewportCount = 1;
    viewport.scissorCount = 1;
    VkPipelineRasterizationStateCreateInfo raster = {VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO};
    raster.lineWidth = 1.0f;
    VkPipelineMultisampleStateCreateInfo multisample = {VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO};
    multisample.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
    VkPipelineColorBlendAttachmentState attachment = {};
    attachment.colorWriteMask = 0xf;
    VkPipelineColorBlendStateCreateInfo blend = {VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO};
    blend.attachmentCount = 1;
    blend.pAttachments = &attachment;
    constexpr std::array dynamic_states = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
    VkPipelineDynamicStateCreateInfo dynamic = {VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO};
    dynamic.dynamicStateCount = static_cast<uint32_t>(dynamic_states.size());
    dynamic.pDynamicStates = dynamic_states.data();
    VkPipelineRenderingCreateInfo rendering = {VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO};
    rendering.colorAttachmentCount = 1;
    rendering.pColorAttachmentFormats = &desc.color_format;

    VkGraphicsPipelineCreateInfo info = {VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO};
    info.pNext = &rendering;
    info.stageCount = static_cast<uint32_t>(stages.size());
    info.pStages = stages.data();
    info.pVertexInputState = &vertex_input;
    info.pInputAssemblyState = &assembly;
    info.pViewportState = &viewport;
    info.pRasterizationState = &raster;
    info.pMultisampleState = &multisample;
    info.pColorBlendState = &blend;
    info.pDynamicState = &dynamic;
    info.layout = program.layout;
    const VkResult result = vk.CreateGraphicsPipelines(device_, VK_NULL_HANDLE, 1, &info, nullptr, &program.pipeline);
    for (const auto& stage : stages) vk.DestroyShaderModule(device_, stage.module, nullptr);
    require(result, "vkCreateGraphicsPipelines");
    own([this, pipeline = program.pipeline] { vk.DestroyPipeline(device_, pipeline, nullptr); });
    return program;
}

RawRays RawDevice::createRays(std::span<const uint32_t> generation, std::span<const uint32_t> miss,
                              std::span<const uint32_t> hit, std::span<const VkDescriptorSetLayoutBinding> bindings) {
    RawRays rays = {.program = createLayout(bindings)};
    std::array<VkPipelineShaderStageCreateInfo, 3> stages = {};
    std::array<VkRayTracingShaderGroupCreateInfoKHR, 3> groups = {};
    const std::array modules = {generation, miss, hit};
    constexpr std::array kinds = {VK_SHADER_STAGE_RAYGEN_BIT_KHR, VK_SHADER_STAGE_MISS_BIT_KHR,
                                  VK_SHADER_STAGE_CLOSEST_HIT_BIT_KHR};
    for (uint32_t i = 0; i < 3; i++) {
        stages[i].sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
        stages[i].stage = kinds[i];
        stages[i].module = createModule(modules[i]);
        stages[i].pName = "main";
        groups[i] = {VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_KHR};
        groups[i].type = i < 2 ? VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_KHR
                               : VK_RAY_TRACING_SHADER_GROUP_TYPE_TRIANGLES_HIT_GROUP_KHR;
        groups[i].generalShader = i < 2 ? i : VK_SHADER_UNUSED_KHR;
        groups[i].closestHitShader = i < 2 ? VK_SHADER_UNUSED_KHR : i;
        groups[i].anyHitShader = VK_SHADER_UNUSED_KHR;
        groups[i].intersectionShader = VK_SHADER_UNUSED_KHR;
    }
    VkRayTracingPipelineCreateInfoKHR info = {VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_KHR};
    info.stageCount = static_cast<uint32_t>(stages.size());
    info.pStages = stages.data();
    info.groupCount = static_cast<uint32_t>(groups.size());
    info.pGroups = groups.data();
    info.maxPipelineRayRecursionDepth = 1;
    info.layout = rays.program.layout;
    const VkResult result = vk.CreateRayTracingPipelinesKHR(device_, VK_NULL_HANDLE, VK_NULL_HANDLE, 1, &info, nullptr,
                                                            &rays.program.pipeline);
    for (const auto& stage : stages) vk.DestroyShaderModule(device_, stage.module, nullptr);
    require(result, "vkCreateRayTracingPipelinesKHR");
    own([this, pipeline = rays.program.pipeline] { vk.DestroyPipeline(device_, pipeline, nullptr); });

    VkPhysicalDeviceRayTracingPipelinePropertiesKHR limits = {
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_PROPERTIES_KHR};
    VkPhysicalDeviceProperties2 properties = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2};
    properties.pNext = &limits;
    vk.GetPhysicalDeviceProperties2(adapter_, &properties);
    const uint32_t size = limits.shaderGroupHandleSize;
    const VkDeviceSize step = std::max(size, limits.shaderGroupBaseAlignment);
    std::vector<std::byte> handles(3 * size_t(size));
    require(vk.GetRayTracingShaderGroupHandlesKHR(device_, rays.program.pipeline, 0, 3, handles.size(), handles.data()),
            "vkGetRayTracingShaderGroupHandlesKHR");
    const RawBuffer table = createBuffer(
        4 * step, VK_BUFFER_USAGE_SHADER_BINDING_TABLE_BIT_KHR | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT, true);
    const VkDeviceSize first = (table.address + step - 1) / step * step - table.address;
    const std::array regions = {&rays.generation, &rays.miss, &rays.hit};
    for (uint32_t i = 0; i < 3; i++) {
        std::copy_n(handles.data() + size_t(i) * size, size, table.mapped + first + i * step);
        *regions[i] = {table.address + first + i * step, step, step};
    }
    return rays;
}

std::vector<VkDescriptorSet> RawDevice::createSets(const RawProgram& program,
                                                   std::span<const VkDescriptorSetLayoutBinding> bindings,
                                                   uint32_t count) {
    std::vector<VkDescriptorPoolSize> sizes;
    for (const auto& binding : bindings) sizes.push_back({binding.descriptorType, binding.descriptorCount * count});
    VkDescriptorPoolCreateInfo info = {VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    info.maxSets = count;
    info.poolSizeCount = static_cast<uint32_t>(sizes.size());
    info.pPoolSizes = sizes.data();
    VkDescriptorPool pool = VK_NULL_HANDLE;
    require(vk.CreateDescriptorPool(device_, &info, nullptr, &pool), "vkCreateDescriptorPool");
    own([this, pool] { vk.DestroyDescriptorPool(device_, pool, nullptr); });

    const std::vector<VkDescriptorSetLayout> layouts(count, program.set_layout);
    VkDescriptorSetAllocateInfo allocation = {VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
    allocation.descriptorPool = pool;
    allocation.descriptorSetCount = count;
    allocation.pSetLayouts = layouts.data();
    std::vector<VkDescriptorSet> sets(count);
    require(vk.AllocateDescriptorSets(device_, &allocation, sets.data()), "vkAllocateDescriptorSets");
    return sets;
}

VkQueryPool RawDevice::createTimestamps(uint32_t count) {
    VkQueryPoolCreateInfo info = {VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO};
    info.queryType = VK_QUERY_TYPE_TIMESTAMP;
    info.queryCount = count;
    VkQueryPool pool = VK_NULL_HANDLE;
    require(vk.CreateQueryPool(device_, &info, nullptr, &pool), "vkCreateQueryPool");
    own([this, pool] { vk.DestroyQueryPool(device_, pool, nullptr); });
    return pool;
}

RawAcceleration RawDevice::createAcceleration(VkAccelerationStructureTypeKHR type,
                                              const VkAccelerationStructureGeometryKHR& geometry, uint32_t primitives) {
    VkAccelerationStructureBuildGeometryInfoKHR build = {
        VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR};
    build.type = type;
    build.flags = VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR;
    build.geometryCount = 1;
    build.pGeometries = &geometry;
    VkAccelerationStructureBuildSizesInfoKHR sizes = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_SIZES_INFO_KHR};
    vk.GetAccelerationStructureBuildSizesKHR(device_, VK_ACCELERATION_STRUCTURE_BUILD_TYPE_DEVICE_KHR, &build,
                                             &primitives, &sizes);
    const RawBuffer storage = createBuffer(
        sizes.accelerationStructureSize,
        VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT, false);
    VkAccelerationStructureCreateInfoKHR info = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_KHR};
    info.buffer = storage.buffer;
    info.size = sizes.accelerationStructureSize;
    info.type = type;
    RawAcceleration result = {.scratch_size = sizes.buildScratchSize};
    require(vk.CreateAccelerationStructureKHR(device_, &info, nullptr, &result.structure),
            "vkCreateAccelerationStructureKHR");
    own([this, structure = result.structure] { vk.DestroyAccelerationStructureKHR(device_, structure, nullptr); });
    VkAccelerationStructureDeviceAddressInfoKHR address = {
        VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_DEVICE_ADDRESS_INFO_KHR};
    address.accelerationStructure = result.structure;
    result.address = vk.GetAccelerationStructureDeviceAddressKHR(device_, &address);
    return result;
}

VkCommandBuffer RawDevice::begin() {
    require(vk.ResetCommandPool(device_, pool_, 0), "vkResetCommandPool");
    VkCommandBufferBeginInfo info = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    require(vk.BeginCommandBuffer(commands_, &info), "vkBeginCommandBuffer");
    return commands_;
}

void RawDevice::submit() {
    require(vk.EndCommandBuffer(commands_), "vkEndCommandBuffer");
    VkCommandBufferSubmitInfo commands = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO};
    commands.commandBuffer = commands_;
    VkSemaphoreSubmitInfo signal = {VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO};
    signal.semaphore = timeline_;
    signal.value = ++value_;
    signal.stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
    VkSubmitInfo2 info = {VK_STRUCTURE_TYPE_SUBMIT_INFO_2};
    info.commandBufferInfoCount = 1;
    info.pCommandBufferInfos = &commands;
    info.signalSemaphoreInfoCount = 1;
    info.pSignalSemaphoreInfos = &signal;
    require(vk.QueueSubmit2(queue_, 1, &info, VK_NULL_HANDLE), "vkQueueSubmit2");
}

void RawDevice::wait() {
    VkSemaphoreWaitInfo info = {VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO};
    info.semaphoreCount = 1;
    info.pSemaphores = &timeline_;
    info.pValues = &value_;
    require(vk.WaitSemaphores(device_, &info, UINT64_MAX), "vkWaitSemaphores");
}

void memoryBarrier(const RawFunctions& vk, VkCommandBuffer commands, VkPipelineStageFlags2 source_stage,
                   VkAccessFlags2 source_access, VkPipelineStageFlags2 destination_stage,
                   VkAccessFlags2 destination_access) {
    VkMemoryBarrier2 barrier = {VK_STRUCTURE_TYPE_MEMORY_BARRIER_2};
    barrier.srcStageMask = source_stage;
    barrier.srcAccessMask = source_access;
    barrier.dstStageMask = destination_stage;
    barrier.dstAccessMask = destination_access;
    VkDependencyInfo dependency = {VK_STRUCTURE_TYPE_DEPENDENCY_INFO};
    dependency.memoryBarrierCount = 1;
    dependency.pMemoryBarriers = &barrier;
    vk.CmdPipelineBarrier2(commands, &dependency);
}

void imageBarrier(const RawFunctions& vk, VkCommandBuffer commands, VkImage image, const ImageState& from,
                  const ImageState& to) {
    VkImageMemoryBarrier2 barrier = {VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2};
    barrier.srcStageMask = from.stage;
    barrier.srcAccessMask = from.access;
    barrier.dstStageMask = to.stage;
    barrier.dstAccessMask = to.access;
    barrier.oldLayout = from.layout;
    barrier.newLayout = to.layout;
    barrier.srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image;
    barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    VkDependencyInfo dependency = {VK_STRUCTURE_TYPE_DEPENDENCY_INFO};
    dependency.imageMemoryBarrierCount = 1;
    dependency.pImageMemoryBarriers = &barrier;
    vk.CmdPipelineBarrier2(commands, &dependency);
}

}  // namespace glint::bench
