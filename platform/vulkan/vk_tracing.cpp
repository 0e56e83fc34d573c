#include "platform/vulkan/vk_tracing.h"

#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_result.h"

#include <glint/device/detail/object.h>

#include <cstring>

namespace glint::vulkan {

using detail::TracingGeometry;

namespace {

VkBuildAccelerationStructureFlagsKHR buildFlags(Tracing::Flags flags) {
    VkBuildAccelerationStructureFlagsKHR result = 0;
    if (flags & Tracing::FlagUpdate) result |= VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_KHR;
    if (flags & Tracing::FlagCompact) result |= VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_COMPACTION_BIT_KHR;
    // The two are exclusive (VUID-VkAccelerationStructureBuildGeometryInfoKHR-flags-03796).
    if (flags & Tracing::FlagFastTrace) {
        result |= VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR;
    } else if (flags & Tracing::FlagFastBuild) {
        result |= VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_KHR;
    }
    return result;
}

uint64_t alignUp(uint64_t value, uint64_t alignment) { return (value + alignment - 1) / alignment * alignment; }

uint64_t bufferAddress(const detail::Object* object) {
    return static_cast<const detail::NativeBuffer*>(object->native.get())->address;
}

/// All but the addresses.
VkAccelerationStructureGeometryKHR nativeGeometry(const TracingGeometry& geometry, bool is_bounds, bool is_opaque) {
    VkAccelerationStructureGeometryKHR native = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR};
    native.flags = is_opaque ? VK_GEOMETRY_OPAQUE_BIT_KHR : 0;
    if (is_bounds) {
        native.geometryType = VK_GEOMETRY_TYPE_AABBS_KHR;
        native.geometry.aabbs = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_AABBS_DATA_KHR};
        native.geometry.aabbs.stride = geometry.bound_stride;
        return native;
    }
    native.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_KHR;
    VkAccelerationStructureGeometryTrianglesDataKHR& triangles = native.geometry.triangles;
    triangles = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_TRIANGLES_DATA_KHR};
    triangles.vertexFormat = vulkanFormat(geometry.vertex_format);
    triangles.vertexStride = geometry.vertex_stride;
    triangles.maxVertex = geometry.vertices ? geometry.vertices - 1 : 0;
    triangles.indexType = VK_INDEX_TYPE_NONE_KHR;
    if (geometry.index_buffer) {
        triangles.indexType = geometry.index_format == FormatRu16 ? VK_INDEX_TYPE_UINT16 : VK_INDEX_TYPE_UINT32;
    }
    return native;
}

}  // namespace

Expected<std::unique_ptr<VulkanTracing>> VulkanTracing::create(VulkanDevice& device,
                                                               const detail::NativeTracingDesc& desc) {
    std::unique_ptr<VulkanTracing> tracing(new VulkanTracing(device));
    tracing->type_ = desc.type;
    tracing->flags_ = desc.flags;
    const bool is_opaque = !(desc.flags & Tracing::FlagTransparent);
    std::vector<uint32_t> counts;
    if (desc.type == Tracing::TypeInstance) {
        VkAccelerationStructureGeometryKHR native = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR};
        native.geometryType = VK_GEOMETRY_TYPE_INSTANCES_KHR;
        native.geometry.instances = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_INSTANCES_DATA_KHR};
        tracing->native_.push_back(native);
        counts.push_back(desc.instances);
    } else {
        tracing->geometries_ = desc.geometries;
        for (const TracingGeometry& geometry : desc.geometries) {
            const bool is_bounds = desc.type == Tracing::TypeBound;
            tracing->native_.push_back(nativeGeometry(geometry, is_bounds, is_opaque));
            if (is_bounds) {
                counts.push_back(geometry.bounds);
            } else {
                counts.push_back((geometry.index_buffer ? geometry.indices : geometry.vertices) / 3);
            }
        }
    }
    for (uint32_t count : counts) tracing->ranges_.push_back({count, 0, 0, 0});

    uint64_t size = desc.compacted_size;
    if (size == 0) {
        const VkAccelerationStructureBuildGeometryInfoKHR info = tracing->buildInfo();
        VkAccelerationStructureBuildSizesInfoKHR sizes = {
            VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_SIZES_INFO_KHR};
        device.vk.GetAccelerationStructureBuildSizesKHR(device.handle, VK_ACCELERATION_STRUCTURE_BUILD_TYPE_DEVICE_KHR,
                                                        &info, counts.data(), &sizes);
        size = sizes.accelerationStructureSize;
        // Room for any offset: the player aligns the address.
        const uint64_t alignment = device.features().scratchAlignment;
        tracing->build_size = alignUp(sizes.buildScratchSize, alignment) + alignment;
        if (desc.flags & Tracing::FlagUpdate) {
            tracing->update_size = alignUp(sizes.updateScratchSize, alignment) + alignment;
        }
    }
    if (Status status = tracing->allocate(size, desc.name); !status) return unexpected(status.error().named(desc.name));
    return tracing;
}

Status VulkanTracing::allocate(uint64_t size, const std::string& name) {
    VkBufferCreateInfo buffer_info = {VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
    buffer_info.size = size;
    buffer_info.usage =
        VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
    setSharing(buffer_info, device_.families);
    Expected<RawBuffer> storage = device_.memory.createBuffer(buffer_info, MemoryKind::Device);
    if (!storage) return storage.error();
    storage_ = *storage;
    memory = size;

    VkAccelerationStructureCreateInfoKHR info = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_KHR};
    info.buffer = storage_.handle;
    info.size = size;
    info.type = type_ == Tracing::TypeInstance ? VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR
                                               : VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR;
    VkResult result = device_.vk.CreateAccelerationStructureKHR(device_.handle, &info, nullptr, &handle_);
    if (result != VK_SUCCESS) return resultError("vkCreateAccelerationStructureKHR", result);
    device_.memory.objects_created++;
    VkAccelerationStructureDeviceAddressInfoKHR address_info = {
        VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_DEVICE_ADDRESS_INFO_KHR};
    address_info.accelerationStructure = handle_;
    address = device_.vk.GetAccelerationStructureDeviceAddressKHR(device_.handle, &address_info);
    setName(name);

    if (!(flags_ & Tracing::FlagCompact)) return {};
    VkQueryPoolCreateInfo pool_info = {VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO};
    pool_info.queryType = VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
    pool_info.queryCount = 1;
    result = device_.vk.CreateQueryPool(device_.handle, &pool_info, nullptr, &size_pool_);
    if (result != VK_SUCCESS) return resultError("vkCreateQueryPool", result);
    device_.memory.objects_created++;
    return {};
}

VulkanTracing::~VulkanTracing() {
    device_.vk.DestroyQueryPool(device_.handle, size_pool_, nullptr);
    if (handle_) device_.vk.DestroyAccelerationStructureKHR(device_.handle, handle_, nullptr);
    device_.memory.destroy(storage_);
}

void VulkanTracing::setName(const std::string& name) {
    device_.setName(VK_OBJECT_TYPE_ACCELERATION_STRUCTURE_KHR, handle_, name);
    device_.setName(VK_OBJECT_TYPE_BUFFER, storage_.handle, name);
}

VkAccelerationStructureBuildGeometryInfoKHR VulkanTracing::buildInfo() const {
    VkAccelerationStructureBuildGeometryInfoKHR info = {
        VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR};
    info.type = type_ == Tracing::TypeInstance ? VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR
                                               : VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR;
    info.flags = buildFlags(flags_);
    info.mode = VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR;
    info.geometryCount = static_cast<uint32_t>(native_.size());
    info.pGeometries = native_.data();
    return info;
}

void VulkanTracing::prepareBuild(const detail::TracingBuild& build, uint64_t scratch, uint64_t instances,
                                 VkAccelerationStructureBuildGeometryInfoKHR& info,
                                 const VkAccelerationStructureBuildRangeInfoKHR*& ranges) {
    if (type_ == Tracing::TypeInstance) {
        native_[0].geometry.instances.data.deviceAddress = instances;
        ranges_[0].primitiveCount = build.instance_count;
    }
    for (size_t i = 0; i < geometries_.size(); i++) {
        const TracingGeometry& geometry = geometries_[i];
        if (type_ == Tracing::TypeBound) {
            native_[i].geometry.aabbs.data.deviceAddress = bufferAddress(geometry.bound_buffer) + geometry.bound_offset;
            continue;
        }
        VkAccelerationStructureGeometryTrianglesDataKHR& triangles = native_[i].geometry.triangles;
        triangles.vertexData.deviceAddress = bufferAddress(geometry.vertex_buffer) + geometry.vertex_offset;
        if (geometry.index_buffer) {
            triangles.indexData.deviceAddress = bufferAddress(geometry.index_buffer) + geometry.index_offset;
        }
    }
    info = buildInfo();
    info.dstAccelerationStructure = handle_;
    info.scratchData.deviceAddress = alignUp(scratch, device_.features().scratchAlignment);
    if (build.update) {
        info.mode = VK_BUILD_ACCELERATION_STRUCTURE_MODE_UPDATE_KHR;
        info.srcAccelerationStructure = handle_;
    }
    ranges = ranges_.data();
}

Expected<uint64_t> VulkanTracing::compactedSize() const {
    uint64_t size = 0;
    const VkResult result = device_.vk.GetQueryPoolResults(device_.handle, size_pool_, 0, 1, sizeof(size), &size,
                                                           sizeof(size), VK_QUERY_RESULT_64_BIT);
    if (result != VK_SUCCESS) return unexpected(resultError("vkGetQueryPoolResults", result));
    return size;
}

void writeInstanceRecords(std::span<const Tracing::Instance> instances,
                          std::span<const detail::NativeTracing* const> tracings, void* records) {
    static_assert(int(Tracing::InstanceCullDisable) == VK_GEOMETRY_INSTANCE_TRIANGLE_FACING_CULL_DISABLE_BIT_KHR &&
                  int(Tracing::InstanceFlipFacing) == VK_GEOMETRY_INSTANCE_TRIANGLE_FLIP_FACING_BIT_KHR &&
                  int(Tracing::InstanceOpaque) == VK_GEOMETRY_INSTANCE_FORCE_OPAQUE_BIT_KHR &&
                  int(Tracing::InstanceTransparent) == VK_GEOMETRY_INSTANCE_FORCE_NO_OPAQUE_BIT_KHR);
    auto* record = static_cast<std::byte*>(records);
    for (size_t i = 0; i < instances.size(); i++, record += instance_size) {
        const Tracing::Instance& instance = instances[i];
        VkAccelerationStructureInstanceKHR native = {};
        static_assert(sizeof(native.transform) == sizeof(instance.transform) && sizeof(native) == 64);
        std::memcpy(&native.transform, instance.transform, sizeof(native.transform));
        native.instanceCustomIndex = instance.data & 0xffffffu;
        native.mask = instance.mask & 0xffu;
        native.instanceShaderBindingTableRecordOffset = instance.offset & 0xffffffu;
        native.flags = instance.flags & 0xffu;
        native.accelerationStructureReference = tracings[i] ? tracings[i]->address : 0;
        std::memcpy(record, &native, sizeof(native));
    }
}

}  // namespace glint::vulkan
