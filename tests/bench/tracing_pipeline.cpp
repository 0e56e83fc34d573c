#include "bench/tracing_pipeline.h"

#include "bench/bench.h"

#include <glint/shader/shader_compiler.h>

#include <array>
#include <cstring>

namespace glint::bench {

namespace {

constexpr const char* declarations = R"(
struct Payload { float t; uint primitive; uint geometry; uint front; vec2 barycentrics; uint instance; };
)";

constexpr const char* generation_source = R"(
struct Ray { vec3 origin; float t_min; vec3 direction; float t_max; };
struct Hit { float t; uint primitive, geometry; float u, v; uint front, instance; };
layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;
layout(set = 0, binding = 1) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 2) writeonly buffer Hits { Hit hits[]; };
layout(location = 0) rayPayloadEXT Payload payload;
void main() {
    const uint index = gl_LaunchIDEXT.x;
    const Ray ray = rays[index];
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, ray.origin, ray.t_min, ray.direction, ray.t_max, 0);
    hits[index] = Hit(payload.t, payload.primitive, payload.geometry, payload.barycentrics.x, payload.barycentrics.y,
                      payload.front, payload.instance);
}
)";

constexpr const char* miss_source = R"(
layout(location = 0) rayPayloadInEXT Payload payload;
void main() {
    payload = Payload(uintBitsToFloat(0x7f800000u), 0xffffffffu, 0xffffffffu, 0u, vec2(0.0), 0xffffffffu);
}
)";

constexpr const char* hit_source = R"(
layout(location = 0) rayPayloadInEXT Payload payload;
hitAttributeEXT vec2 barycentrics;
void main() {
    payload = Payload(gl_HitTEXT, uint(gl_PrimitiveID), uint(gl_GeometryIndexEXT),
                      gl_HitKindEXT == gl_HitKindFrontFacingTriangleEXT ? 1u : 0u, barycentrics, uint(gl_InstanceID));
}
)";

std::vector<uint32_t> compile(ShaderStage stage, const char* source) {
    ShaderSource text;
    text.stage = stage;
    text.name = "pipeline";
    text.text = std::string(declarations) + source;
    return check(compileShader(text))->words;
}

constexpr std::array bindings = {
    VkDescriptorSetLayoutBinding{0, VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR, 1, VK_SHADER_STAGE_RAYGEN_BIT_KHR},
    VkDescriptorSetLayoutBinding{1, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_RAYGEN_BIT_KHR},
    VkDescriptorSetLayoutBinding{2, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_RAYGEN_BIT_KHR},
};

constexpr VkPipelineStageFlags2 all_stages = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
constexpr VkAccessFlags2 all_accesses = VK_ACCESS_2_MEMORY_READ_BIT | VK_ACCESS_2_MEMORY_WRITE_BIT;

}  // namespace

TracingPipeline::TracingPipeline(RawDevice& device, const Mesh& mesh, std::span<const Transform3x4> instances,
                                 size_t capacity)
    : device_(device) {
    build(mesh, instances);
    rays_program_ =
        device_.createRays(compile(ShaderStage::RayGen, generation_source), compile(ShaderStage::RayMiss, miss_source),
                           compile(ShaderStage::Closest, hit_source), bindings);
    const size_t size = capacity * std::max(sizeof(Ray), sizeof(RayHit));
    constexpr VkBufferUsageFlags usage =
        VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    staging_ = device_.createBuffer(size, VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT, true);
    rays_ = device_.createBuffer(size, usage, false);
    hits_ = device_.createBuffer(size, usage, false);
    queries_ = device_.createTimestamps(2);
    writeSet();
}

void TracingPipeline::build(const Mesh& mesh, std::span<const Transform3x4> instances) {
    constexpr VkBufferUsageFlags input = VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR |
                                         VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
    const RawBuffer vertices = device_.createBuffer(mesh.positions.size() * sizeof(mesh.positions[0]), input, true);
    const RawBuffer indices = device_.createBuffer(mesh.indices.size() * sizeof(uint32_t), input, true);
    const RawBuffer records =
        device_.createBuffer(instances.size() * sizeof(VkAccelerationStructureInstanceKHR), input, true);
    std::memcpy(vertices.mapped, mesh.positions.data(), vertices.size);
    std::memcpy(indices.mapped, mesh.indices.data(), indices.size);

    VkAccelerationStructureGeometryKHR triangles = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR};
    triangles.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_KHR;
    triangles.flags = VK_GEOMETRY_OPAQUE_BIT_KHR;
    triangles.geometry.triangles = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_TRIANGLES_DATA_KHR};
    triangles.geometry.triangles.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT;
    triangles.geometry.triangles.vertexData.deviceAddress = vertices.address;
    triangles.geometry.triangles.vertexStride = sizeof(mesh.positions[0]);
    triangles.geometry.triangles.maxVertex = static_cast<uint32_t>(mesh.positions.size()) - 1;
    triangles.geometry.triangles.indexType = VK_INDEX_TYPE_UINT32;
    triangles.geometry.triangles.indexData.deviceAddress = indices.address;
    const auto triangle_count = static_cast<uint32_t>(mesh.triangleCount());
    model_ = device_.createAcceleration(VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR, triangles, triangle_count);
    buildOne(VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR, model_, triangles, triangle_count);

    for (size_t i = 0; i < instances.size(); i++) {
        VkAccelerationStructureInstanceKHR record = {};
        std::memcpy(&record.transform, instances[i].rows.data(), sizeof(record.transform));
        record.mask = 0xff;
        record.flags = VK_GEOMETRY_INSTANCE_TRIANGLE_FACING_CULL_DISABLE_BIT_KHR;
        record.accelerationStructureReference = model_.address;
        std::memcpy(records.mapped + i * sizeof(record), &record, sizeof(record));
    }
    VkAccelerationStructureGeometryKHR geometry = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR};
    geometry.geometryType = VK_GEOMETRY_TYPE_INSTANCES_KHR;
    geometry.flags = VK_GEOMETRY_OPAQUE_BIT_KHR;
    geometry.geometry.instances = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_INSTANCES_DATA_KHR};
    geometry.geometry.instances.data.deviceAddress = records.address;
    const auto instance_count = static_cast<uint32_t>(instances.size());
    scene_ = device_.createAcceleration(VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR, geometry, instance_count);
    buildOne(VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR, scene_, geometry, instance_count);
}

void TracingPipeline::buildOne(VkAccelerationStructureTypeKHR type, const RawAcceleration& structure,
                               const VkAccelerationStructureGeometryKHR& geometry, uint32_t primitives) {
    // The most that Vulkan lets a driver ask for the addresses of scratch memory.
    constexpr VkDeviceSize alignment = 256;
    const RawBuffer scratch =
        device_.createBuffer(structure.scratch_size + alignment,
                             VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT, false);
    VkAccelerationStructureBuildGeometryInfoKHR info = {
        VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR};
    info.type = type;
    info.flags = VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR;
    info.mode = VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR;
    info.dstAccelerationStructure = structure.structure;
    info.geometryCount = 1;
    info.pGeometries = &geometry;
    info.scratchData.deviceAddress = (scratch.address + alignment - 1) / alignment * alignment;
    const VkAccelerationStructureBuildRangeInfoKHR range = {primitives, 0, 0, 0};
    const VkAccelerationStructureBuildRangeInfoKHR* ranges = &range;
    device_.vk.CmdBuildAccelerationStructuresKHR(device_.begin(), 1, &info, &ranges);
    device_.submit();
    device_.wait();
}

void TracingPipeline::writeSet() {
    set_ = device_.createSets(rays_program_.program, bindings, 1)[0];
    VkWriteDescriptorSetAccelerationStructureKHR structure = {
        VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET_ACCELERATION_STRUCTURE_KHR};
    structure.accelerationStructureCount = 1;
    structure.pAccelerationStructures = &scene_.structure;
    const std::array buffers = {VkDescriptorBufferInfo{rays_.buffer, 0, VK_WHOLE_SIZE},
                                VkDescriptorBufferInfo{hits_.buffer, 0, VK_WHOLE_SIZE}};
    std::array<VkWriteDescriptorSet, 3> writes = {};
    for (uint32_t i = 0; i < writes.size(); i++) {
        writes[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        writes[i].dstSet = set_;
        writes[i].dstBinding = i;
        writes[i].descriptorCount = 1;
        writes[i].descriptorType = bindings[i].descriptorType;
        if (i > 0) writes[i].pBufferInfo = &buffers[i - 1];
    }
    writes[0].pNext = &structure;
    device_.vk.UpdateDescriptorSets(device_.handle(), static_cast<uint32_t>(writes.size()), writes.data(), 0, nullptr);
}

void TracingPipeline::copy(const RawBuffer& from, const RawBuffer& to, size_t size) {
    VkCommandBuffer commands = device_.begin();
    const VkBufferCopy region = {0, 0, size};
    memoryBarrier(device_.vk, commands, all_stages, all_accesses, all_stages, all_accesses);
    device_.vk.CmdCopyBuffer(commands, from.buffer, to.buffer, 1, &region);
    memoryBarrier(device_.vk, commands, all_stages, all_accesses, all_stages | VK_PIPELINE_STAGE_2_HOST_BIT,
                  all_accesses | VK_ACCESS_2_HOST_READ_BIT);
    device_.submit();
    device_.wait();
}

void TracingPipeline::setRays(std::span<const Ray> rays) {
    count_ = static_cast<uint32_t>(rays.size());
    std::memcpy(staging_.mapped, rays.data(), rays.size_bytes());
    copy(staging_, rays_, rays.size_bytes());
}

double TracingPipeline::trace() {
    const RawFunctions& vk = device_.vk;
    VkCommandBuffer commands = device_.begin();
    vk.CmdResetQueryPool(commands, queries_, 0, 2);
    memoryBarrier(vk, commands, all_stages, all_accesses, all_stages, all_accesses);
    vk.CmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR, rays_program_.program.pipeline);
    vk.CmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR, rays_program_.program.layout, 0, 1,
                             &set_, 0, nullptr);
    const VkStridedDeviceAddressRegionKHR callable = {};
    vk.CmdWriteTimestamp2(commands, all_stages, queries_, 0);
    vk.CmdTraceRaysKHR(commands, &rays_program_.generation, &rays_program_.miss, &rays_program_.hit, &callable, count_,
                       1, 1);
    vk.CmdWriteTimestamp2(commands, all_stages, queries_, 1);
    device_.submit();
    device_.wait();
    std::array<uint64_t, 2> ticks = {};
    require(vk.GetQueryPoolResults(device_.handle(), queries_, 0, 2, sizeof(ticks), ticks.data(), sizeof(ticks[0]),
                                   VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
            "vkGetQueryPoolResults");
    return static_cast<double>(ticks[1] - ticks[0]) * device_.limits().timestampPeriod * 1e-9;
}

std::vector<RayHit> TracingPipeline::hits() {
    std::vector<RayHit> hits(count_);
    copy(hits_, staging_, hits.size() * sizeof(RayHit));
    std::memcpy(static_cast<void*>(hits.data()), staging_.mapped, hits.size() * sizeof(RayHit));
    return hits;
}

}  // namespace glint::bench
