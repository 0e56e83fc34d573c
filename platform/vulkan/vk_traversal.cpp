#include "platform/vulkan/vk_traversal.h"

#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_kernel.h"
#include "platform/vulkan/vk_result.h"

#include <algorithm>
#include <cstring>
#include <deque>

namespace glint::vulkan {

using detail::RayTable;
using detail::TraversalDesc;

namespace {

uint64_t alignUp(uint64_t value, uint64_t alignment) { return (value + alignment - 1) / alignment * alignment; }

VkPhysicalDeviceRayTracingPipelinePropertiesKHR properties(const VulkanDevice& device) {
    VkPhysicalDeviceRayTracingPipelinePropertiesKHR pipelines = {
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_PROPERTIES_KHR};
    VkPhysicalDeviceProperties2 all = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &pipelines, {}};
    device.instance->vk.GetPhysicalDeviceProperties2(device.adapter.handle, &all);
    return pipelines;
}

VkRayTracingShaderGroupCreateInfoKHR nativeGroup(const TraversalDesc::Group& group) {
    static_assert(detail::none == VK_SHADER_UNUSED_KHR);
    VkRayTracingShaderGroupCreateInfoKHR native = {VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_KHR};
    native.type = group.general != detail::none        ? VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_KHR
                  : group.intersection != detail::none ? VK_RAY_TRACING_SHADER_GROUP_TYPE_PROCEDURAL_HIT_GROUP_KHR
                                                       : VK_RAY_TRACING_SHADER_GROUP_TYPE_TRIANGLES_HIT_GROUP_KHR;
    native.generalShader = group.general;
    native.closestHitShader = group.closest;
    native.anyHitShader = group.first_hit;
    native.intersectionShader = group.intersection;
    return native;
}

/// Callables that nest deeper than a pipeline's default stack is made for.
bool needsStack(const TraversalDesc& desc) {
    constexpr uint32_t default_depth = 2;
    return desc.callable_depth > default_depth && !desc.tables[static_cast<size_t>(RayTable::Callable)].empty();
}

bool isEmpty(const TraversalDesc::Group& group) {
    return (group.general & group.closest & group.first_hit & group.intersection) == detail::none;
}

}  // namespace

Expected<std::unique_ptr<VulkanTraversal>> VulkanTraversal::create(VulkanDevice& device, const TraversalDesc& desc) {
    std::unique_ptr<VulkanTraversal> traversal(new VulkanTraversal(device));
    Status status = traversal->createPipeline(desc);
    if (status) status = traversal->writeTables(desc);
    if (!status) return unexpected(status.error().named(desc.name));
    traversal->setName(desc.name);
    return traversal;
}

Status VulkanTraversal::createPipeline(const TraversalDesc& desc) {
    Expected<PipelineLayout*> layout = device_.layouts.get(*desc.layout);
    if (!layout) return layout.error();
    layout_ = *layout;
    std::deque<StageModule> modules;
    std::vector<VkPipelineShaderStageCreateInfo> stages;
    stages.reserve(desc.stages.size());
    for (const detail::StageDesc& stage : desc.stages) {
        if (Status status = modules.emplace_back(device_).create(stage); !status) return status;
        stages.push_back(modules.back().info);
    }
    std::vector<VkRayTracingShaderGroupCreateInfoKHR> groups;
    groups.reserve(desc.groups.size());
    for (const TraversalDesc::Group& group : desc.groups) groups.push_back(nativeGroup(group));

    VkRayTracingPipelineCreateInfoKHR info = {VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_KHR};
    info.stageCount = static_cast<uint32_t>(stages.size());
    info.pStages = stages.data();
    info.groupCount = static_cast<uint32_t>(groups.size());
    info.pGroups = groups.data();
    info.maxPipelineRayRecursionDepth = desc.recursion_depth;
    info.layout = layout_->handle;
    constexpr VkDynamicState stack = VK_DYNAMIC_STATE_RAY_TRACING_PIPELINE_STACK_SIZE_KHR;
    VkPipelineDynamicStateCreateInfo dynamic = {VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO};
    dynamic.dynamicStateCount = 1;
    dynamic.pDynamicStates = &stack;
    if (needsStack(desc)) info.pDynamicState = &dynamic;
    const VkResult result = device_.vk.CreateRayTracingPipelinesKHR(device_.handle, VK_NULL_HANDLE, VK_NULL_HANDLE, 1,
                                                                    &info, nullptr, &handle_);
    if (result != VK_SUCCESS) return resultError("vkCreateRayTracingPipelinesKHR", result);
    device_.memory.objects_created++;
    if (needsStack(desc)) stack_size_ = sumStack(desc);
    return {};
}

/// The default of Vulkan 1.3, 14.1 "Ray Tracing Pipeline Stack", but that callables nest deeper than twice.
uint32_t VulkanTraversal::sumStack(const TraversalDesc& desc) const {
    // For the shaders of a kind the largest one counts; a group without one has 0.
    const auto largest = [&](RayTable table, uint32_t TraversalDesc::Group::*member, VkShaderGroupShaderKHR kind) {
        VkDeviceSize size = 0;
        for (const TraversalDesc::Record& record : desc.tables[static_cast<size_t>(table)]) {
            if (desc.groups[record.group].*member == detail::none) continue;
            size = std::max(
                size, device_.vk.GetRayTracingShaderGroupStackSizeKHR(device_.handle, handle_, record.group, kind));
        }
        return size;
    };
    using Group = TraversalDesc::Group;
    const auto general = VK_SHADER_GROUP_SHADER_GENERAL_KHR;
    const VkDeviceSize generation = largest(RayTable::Generation, &Group::general, general);
    const VkDeviceSize miss = largest(RayTable::Miss, &Group::general, general);
    const VkDeviceSize callable = largest(RayTable::Callable, &Group::general, general);
    const VkDeviceSize closest = largest(RayTable::Hit, &Group::closest, VK_SHADER_GROUP_SHADER_CLOSEST_HIT_KHR);
    const VkDeviceSize any = largest(RayTable::Hit, &Group::first_hit, VK_SHADER_GROUP_SHADER_ANY_HIT_KHR);
    const VkDeviceSize intersection =
        largest(RayTable::Hit, &Group::intersection, VK_SHADER_GROUP_SHADER_INTERSECTION_KHR);
    const uint64_t depth = desc.recursion_depth;
    const uint64_t sum = generation + std::min<uint64_t>(1, depth) * std::max({closest, miss, intersection + any}) +
                         (depth > 1 ? depth - 1 : 0) * std::max(closest, miss) + desc.callable_depth * callable;
    // A stack of no bytes is one that shaders do not need.
    return static_cast<uint32_t>(std::clamp<uint64_t>(sum, 1, UINT32_MAX));
}

Status VulkanTraversal::writeTables(const TraversalDesc& desc) {
    const VkPhysicalDeviceRayTracingPipelinePropertiesKHR limits = properties(device_);
    const size_t handle_size = limits.shaderGroupHandleSize;
    std::vector<std::byte> handles(desc.groups.size() * handle_size);
    VkResult result = device_.vk.GetRayTracingShaderGroupHandlesKHR(
        device_.handle, handle_, 0, static_cast<uint32_t>(desc.groups.size()), handles.size(), handles.data());
    if (result != VK_SUCCESS) return resultError("vkGetRayTracingShaderGroupHandlesKHR", result);

    // Each ray-generation record is bound by itself, so it begins where a table may.
    uint64_t size = 0;
    for (size_t t = 0; t < detail::ray_tables; t++) {
        size_t data = 0;
        for (const TraversalDesc::Record& record : desc.tables[t]) data = std::max(data, record.data.size());
        const bool is_generation = t == static_cast<size_t>(RayTable::Generation);
        VkStridedDeviceAddressRegionKHR& region = regions_[t];
        region.stride = alignUp(handle_size + data,
                                is_generation ? limits.shaderGroupBaseAlignment : limits.shaderGroupHandleAlignment);
        region.size = region.stride * desc.tables[t].size();
        region.deviceAddress = size;
        size = alignUp(size + region.size, limits.shaderGroupBaseAlignment);
    }

    VkBufferCreateInfo info = {VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
    info.size = size;
    info.usage = VK_BUFFER_USAGE_SHADER_BINDING_TABLE_BIT_KHR | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
    setSharing(info, device_.families);
    Expected<RawBuffer> made = device_.memory.createBuffer(info, MemoryKind::Upload, limits.shaderGroupBaseAlignment);
    if (!made) return made.error();
    tables_ = *made;
    const VkBufferDeviceAddressInfo address_info = {VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO, nullptr,
                                                    tables_.handle};
    const VkDeviceAddress address = device_.vk.GetBufferDeviceAddress(device_.handle, &address_info);
    auto* const bytes = static_cast<std::byte*>(tables_.mapped);
    std::memset(bytes, 0, size);
    for (size_t t = 0; t < detail::ray_tables; t++) {
        VkStridedDeviceAddressRegionKHR& region = regions_[t];
        std::byte* place = bytes + region.deviceAddress;
        for (const TraversalDesc::Record& record : desc.tables[t]) {
            // Zeros are no shaders, for triangles and boxes alike; an empty group would be for triangles alone.
            if (!isEmpty(desc.groups[record.group]))
                std::memcpy(place, handles.data() + record.group * handle_size, handle_size);
            if (!record.data.empty()) std::memcpy(place + handle_size, record.data.data(), record.data.size());
            place += region.stride;
        }
        region.deviceAddress += address;
        if (desc.tables[t].empty()) region = {};
    }
    return {};
}

VulkanTraversal::~VulkanTraversal() {
    device_.vk.DestroyPipeline(device_.handle, handle_, nullptr);
    device_.memory.destroy(tables_);
}

VkStridedDeviceAddressRegionKHR VulkanTraversal::generation(uint32_t index) const {
    const VkStridedDeviceAddressRegionKHR& all = table(RayTable::Generation);
    return {all.deviceAddress + index * all.stride, all.stride, all.stride};
}

void VulkanTraversal::setName(const std::string& name) {
    device_.setName(VK_OBJECT_TYPE_PIPELINE, handle_, name);
    device_.setName(VK_OBJECT_TYPE_BUFFER, tables_.handle, name);
}

}  // namespace glint::vulkan
