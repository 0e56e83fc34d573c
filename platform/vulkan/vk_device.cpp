#include "platform/vulkan/vk_device.h"

#include "platform/vulkan/vk_buffer.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_kernel.h"
#include "platform/vulkan/vk_pipeline.h"
#include "platform/vulkan/vk_query.h"
#include "platform/vulkan/vk_result.h"
#include "platform/vulkan/vk_sampler.h"
#include "platform/vulkan/vk_table.h"
#include "platform/vulkan/vk_texture.h"
#include "platform/vulkan/vk_tracing.h"
#include "platform/vulkan/vk_traversal.h"
#include "platform/vulkan/vk_window.h"
#include "platform/vulkan/vulkan.h"

#include <glint/base/format_error.h>

#include <algorithm>

namespace glint::vulkan {

using namespace detail;

RawDevice::~RawDevice() {
    if (owned && handle) vk.DestroyDevice(handle, nullptr);
}

VulkanDevice::VulkanDevice(std::shared_ptr<Instance> shared, const Adapter& chosen, const Enabled& wanted,
                           const Messenger::Receive& receive)
    : RawDevice(std::move(shared), receive),
      adapter(chosen),
      enabled(wanted),
      layouts(*this),
      tables(*this),
      upload(memory, families),
      features_(describeFeatures(*instance, adapter, enabled.mask)) {
    for (uint32_t family : adapter.families) {
        if (family != no_family) families.push_back(family);
    }
}

Expected<std::unique_ptr<Backend>> VulkanDevice::create(const BackendDesc& desc) {
    Expected<std::shared_ptr<Instance>> instance = Instance::shared(desc.validation);
    if (!instance) return unexpected(instance.error());
    if (desc.validation && !(*instance)->validation && desc.message) {
        desc.message(makeError(ErrorCode::Unsupported, "vulkan.no_validation",
                               "validation was asked for, but the Khronos validation layer is not installed"),
                     true);
    }
    Expected<Adapter> adapter = chooseAdapter(**instance, desc);
    if (!adapter) return unexpected(adapter.error());
    std::unique_ptr<VulkanDevice> device(
        new VulkanDevice(*instance, *adapter, enabledFeatures(*adapter, desc.required | desc.optional), desc.message));
    if (Status status = device->createDevice(); !status) return unexpected(status.error());
    if (Status status = device->createQueues(VK_NULL_HANDLE); !status) return unexpected(status.error());
    return device;
}

Expected<std::unique_ptr<Backend>> VulkanDevice::adopt(const ForeignDevice& foreign) {
    std::shared_ptr<Instance> instance = Instance::adopt(foreign.instance, foreign.get);
    Adapter adapter = describeAdapter(*instance, foreign.adapter, 0);
    const uint32_t bits = foreign.family == adapter.families[0]   ? adapter.timestamp_bits[0]
                          : foreign.family == adapter.families[1] ? adapter.timestamp_bits[1]
                                                                  : 0;
    adapter.families = {foreign.family, no_family, no_family};
    adapter.timestamp_bits = {bits, 0, 0};
    if (!adapter.lacking.empty()) {
        return unexpected(makeError(ErrorCode::Unsupported, "device.unsupported", "'{}' lacks {}", adapter.info.name,
                                    adapter.lacking));
    }
    Enabled enabled = enabledFeatures(adapter, foreign.features);
    // Glint uses these wherever it may; whether it may here is not known.
    enabled.features.core.features.occlusionQueryPrecise = VK_FALSE;
    enabled.features.v12.hostQueryReset = VK_FALSE;
    enabled.features.ray_pipeline.rayTracingPipelineTraceRaysIndirect = VK_FALSE;
    // Whoever made the instance hears its messages.
    std::unique_ptr<VulkanDevice> device(new VulkanDevice(std::move(instance), adapter, enabled, {}));
    device->owned = false;
    device->features_.indirectRays = false;
    device->handle = foreign.device;
    if (Status status = device->createQueues(foreign.queue); !status) return unexpected(status.error());
    return device;
}

Status VulkanDevice::createDevice() {
    const float priority = 1.0f;
    std::vector<VkDeviceQueueCreateInfo> queue_infos;
    queue_infos.reserve(families.size());
    for (uint32_t family : families) {
        VkDeviceQueueCreateInfo info = {VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
        info.queueFamilyIndex = family;
        info.queueCount = 1;
        info.pQueuePriorities = &priority;
        queue_infos.push_back(info);
    }
    FeatureChain chain = enabled.features;
    chain.link(enabled.extensions);
    std::vector<const char*> extensions;
    extensions.reserve(enabled.extensions.size());
    for (const std::string& extension : enabled.extensions) extensions.push_back(extension.c_str());
    VkDeviceCreateInfo info = {VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
    info.pNext = &chain.core;
    info.queueCreateInfoCount = static_cast<uint32_t>(queue_infos.size());
    info.pQueueCreateInfos = queue_infos.data();
    info.enabledExtensionCount = static_cast<uint32_t>(extensions.size());
    info.ppEnabledExtensionNames = extensions.data();
    const VkResult result = instance->vk.CreateDevice(adapter.handle, &info, nullptr, &handle);
    return result == VK_SUCCESS ? Status() : resultError("vkCreateDevice", result).named(adapter.info.name);
}

Status VulkanDevice::createQueues(VkQueue foreign) {
    vk.load(instance->vk.GetDeviceProcAddr, handle);
    const bool addresses = enabled.features.v12.bufferDeviceAddress;
    if (Status status = memory.create(*instance, adapter.handle, handle, addresses); !status) return status;
    constexpr const char* names[queue_count] = {"main time line", "compute time line", "copy time line"};
    constexpr VkQueueFlags flags[queue_count] = {VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT | VK_QUEUE_TRANSFER_BIT,
                                                 VK_QUEUE_COMPUTE_BIT | VK_QUEUE_TRANSFER_BIT, VK_QUEUE_TRANSFER_BIT};
    for (size_t i = 0; i < queue_count; i++) {
        const uint32_t family = adapter.families[i];
        if (family == no_family) continue;
        VkQueue queue = foreign;
        if (!queue) vk.GetDeviceQueue(handle, family, 0, &queue);
        queues_[i] = std::make_unique<VulkanQueue>(*this, queue, family, flags[i], adapter.timestamp_bits[i]);
        if (Status status = queues_[i]->create(names[i]); !status) return status;
    }
    waits_.reserve(queue_count);
    return {};
}

void VulkanDevice::setName(VkObjectType type, uint64_t object, const std::string& name) const {
    if (!instance->debug_utils || name.empty() || !object) return;
    VkDebugUtilsObjectNameInfoEXT info = {VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT};
    info.objectType = type;
    info.objectHandle = object;
    info.pObjectName = name.c_str();
    instance->vk.SetDebugUtilsObjectNameEXT(handle, &info);
}

uint32_t VulkanDevice::formatSupport(Format format, Texture::Type type) const {
    return textureSupport(*this, format, type);
}

bool VulkanDevice::vertexFormatSupport(Format format) const {
    VkFormatProperties properties = {};
    instance->vk.GetPhysicalDeviceFormatProperties(adapter.handle, vulkanFormat(format), &properties);
    return (properties.bufferFeatures & VK_FORMAT_FEATURE_VERTEX_BUFFER_BIT) != 0;
}

Expected<std::unique_ptr<NativeBuffer>> VulkanDevice::createBuffer(const NativeBufferDesc& desc) {
    return VulkanBuffer::create(*this, desc);
}

Expected<std::unique_ptr<NativeTexture>> VulkanDevice::createTexture(const NativeTextureDesc& desc) {
    return VulkanTexture::create(*this, desc);
}

Expected<std::unique_ptr<NativeSampler>> VulkanDevice::createSampler(const SamplerDesc& desc) {
    return VulkanSampler::create(*this, desc);
}

Expected<std::unique_ptr<NativeTable>> VulkanDevice::createTable(const std::string& name) {
    auto table = std::make_unique<VulkanTable>(*this);
    table->setName(name);
    return table;
}

Expected<std::unique_ptr<NativeKernel>> VulkanDevice::createKernel(const KernelDesc& desc) {
    return VulkanKernel::create(*this, desc);
}

Expected<std::unique_ptr<NativePipeline>> VulkanDevice::createPipeline(const PipelineDesc& desc) {
    return VulkanPipeline::create(*this, desc);
}

Expected<std::unique_ptr<NativeTraversal>> VulkanDevice::createTraversal(const TraversalDesc& desc) {
    return VulkanTraversal::create(*this, desc);
}

Expected<std::unique_ptr<NativeTracing>> VulkanDevice::createTracing(const NativeTracingDesc& desc) {
    return VulkanTracing::create(*this, desc);
}

Expected<std::unique_ptr<NativeQuery>> VulkanDevice::createQuery(Query::Type type) {
    return VulkanQuery::create(*this, type);
}

Expected<std::unique_ptr<NativeWindow>> VulkanDevice::createWindow(const WindowDesc& desc) {
    return VulkanWindow::create(*this, desc);
}

uint32_t VulkanDevice::instanceSize() const { return instance_size; }

void VulkanDevice::writeInstances(std::span<const Tracing::Instance> instances,
                                  std::span<const NativeTracing* const> tracings, void* records) const {
    writeInstanceRecords(instances, tracings, records);
}

Expected<uint64_t> VulkanDevice::tracingSize(NativeTracing& tracing) {
    return static_cast<VulkanTracing&>(tracing).compactedSize();
}

Expected<std::array<uint64_t, 7>> VulkanDevice::queryResult(NativeQuery& query) {
    return static_cast<VulkanQuery&>(query).result();
}

Status VulkanDevice::submit(const Submission& submission) {
    Status status;
    {
        const std::lock_guard lock(submit_mutex_);
        waits_.clear();
        for (const TimelinePoint& point : submission.waits) {
            VkSemaphoreSubmitInfo info = {VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO};
            info.semaphore = queue(point.queue).timeline();
            info.value = point.value;
            info.stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
            waits_.push_back(info);
            // The layer sees no order in time lines, but in fences: without this, every wait is a race to it.
            if (instance->validation) queue(point.queue).settle(point.value);
        }
        for (NativeWindow* window : submission.acquired) {
            VkSemaphoreSubmitInfo info = {VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO};
            info.semaphore = static_cast<VulkanWindow*>(window)->acquired();
            info.stageMask = picture_stages;
            waits_.push_back(info);
        }
        auto* const presented = static_cast<VulkanWindow*>(submission.presented);
        status = queues_[static_cast<size_t>(submission.queue)]->submit(
            submission, waits_, presented ? presented->drawn() : VK_NULL_HANDLE);
        if (status && presented) presented->noteSubmission(submission.value);
    }
    if (!status && status.error().code() == ErrorCode::DeviceLost) return lost("vkQueueSubmit2");
    return status;
}

uint64_t VulkanDevice::completed(Queue which) { return queue(which).completed(); }

Status VulkanDevice::wait(std::span<const TimelinePoint> points, uint64_t nanoseconds) {
    std::array<VkSemaphore, queue_count> semaphores = {};
    std::array<uint64_t, queue_count> values = {};
    uint32_t count = 0;
    for (const TimelinePoint& point : points) {
        const VkSemaphore semaphore = queue(point.queue).timeline();
        const uint32_t i = static_cast<uint32_t>(std::find(semaphores.begin(), semaphores.begin() + count, semaphore) -
                                                 semaphores.begin());
        semaphores[i] = semaphore;
        values[i] = std::max(values[i], point.value);
        count = std::max(count, i + 1);
    }
    VkSemaphoreWaitInfo info = {VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO};
    info.semaphoreCount = count;
    info.pSemaphores = semaphores.data();
    info.pValues = values.data();
    const VkResult result = vk.WaitSemaphores(handle, &info, nanoseconds);
    if (result == VK_SUCCESS) return {};
    if (result == VK_ERROR_DEVICE_LOST) return lost("vkWaitSemaphores");
    if (result == VK_TIMEOUT) {
        return makeError(ErrorCode::Internal, "fence.timeout", "the work was not done within {} ns", nanoseconds);
    }
    return resultError("vkWaitSemaphores", result);
}

Error VulkanDevice::lost(const char* call) const {
    const std::lock_guard lock(submit_mutex_);
    constexpr const char* names[queue_count] = {"main", "compute", "copy"};
    std::string progress;
    for (size_t i = 0; i < queue_count; i++) {
        if (queues_[i]) progress += fmt::format("; on the {} queue {}", names[i], queues_[i]->progress());
    }
    return makeError(ErrorCode::DeviceLost, "device.lost", "{} gave VK_ERROR_DEVICE_LOST{}", call, progress)
        .named(adapter.info.name);
}

MemoryUse VulkanDevice::memoryUse() const {
    return {memory.bytes.load(), memory.allocations.load(), memory.objects_created.load()};
}

Expected<std::unique_ptr<Backend>> createVulkanBackend(const BackendDesc& desc) { return VulkanDevice::create(desc); }

}  // namespace glint::vulkan
