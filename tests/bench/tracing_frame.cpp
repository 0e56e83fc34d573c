// overhead.tracing_frame_ms: Glint's own time in a frame of 05_hello_tracing's scene, which rebuilds a top level of
// 4,608 instances and traces it with one dispatch: the recording thread's time less that of the same Vulkan calls made
// by hand. overhead.set_instances_ms: the part of it that takes the instances and records their build.

#include "bench/bench.h"
#include "bench/raw_vulkan.h"
#include "common/instanced_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace glint::bench {

namespace {

constexpr uint32_t instance_count = InstancedScene::grid * InstancedScene::grid * InstancedScene::layers;
constexpr uint32_t size = 32;
constexpr uint32_t group = 8;
constexpr uint32_t warm_up = 10;
constexpr uint32_t rounds = 101;

constexpr const char* source = R"(
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform Parameters { vec4 origin; };
layout(binding = 1) uniform accelerationStructureEXT scene;
layout(binding = 2) writeonly buffer Hits { uint hits[]; };
void main() {
    const uvec2 size = gl_NumWorkGroups.xy * gl_WorkGroupSize.xy;
    const vec2 point = (vec2(gl_GlobalInvocationID.xy) + 0.5) / vec2(size) * 2.0 - 1.0;
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xff, origin.xyz, 0.0, vec3(point, -1.0), 1000.0);
    while (rayQueryProceedEXT(query)) {}
    uint hit = 0u;
    if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionTriangleEXT)
        hit = uint(rayQueryGetIntersectionInstanceIdEXT(query, true)) + 1u;
    hits[gl_GlobalInvocationID.y * size.x + gl_GlobalInvocationID.x] = hit;
}
)";

struct Parameters {
    float origin[4] = {0.0f, 0.0f, 120.0f, 0.0f};
};

using Matrix = Transform3x4;

class GlintFrame {
public:
    GlintFrame(const Device& device, const Shader& shader, const Mesh& mesh, std::span<const Matrix> matrices)
        : device_(device),
          kernel_(device_.createKernel()),
          model_(device_.createTracing()),
          instances_(instance_count) {
        kernel_.setShader(shader);
        check(kernel_.create());
        vertices_ = device_.createBuffer(Buffer::FlagTracing, std::span(mesh.positions));
        indices_ = device_.createBuffer(Buffer::FlagTracing, std::span(mesh.indices));
        hits_ = device_.createBuffer(Buffer::FlagStorage, size * size * sizeof(uint32_t));
        model_.addVertexBuffer(static_cast<uint32_t>(mesh.positions.size()), FormatRGBf32, sizeof(mesh.positions[0]),
                               vertices_);
        model_.addIndexBuffer(static_cast<uint32_t>(mesh.indices.size()), FormatRu32, indices_);
        check(model_.create(Tracing::TypeTriangle));
        for (Tracing::Instance& instance : instances_) instance.tracing = &model_;
        move(matrices);
        scene_ = device_.createTracing(instances_);
        check(device_.buildTracings({model_, scene_}));
        scratch_ = device_.createBuffer(Buffer::FlagScratch, scene_.getBuildSize());
        check(device_.finish());
    }

    void move(std::span<const Matrix> matrices) {
        for (uint32_t i = 0; i < instance_count; i++)
            std::memcpy(instances_[i].transform, matrices[i].rows.data(), sizeof(Matrix));
    }

    void frame() {
        const double begin = threadSeconds();
        device_.setTracing(scene_, instances_);
        device_.buildTracing(scene_, scratch_);
        instance_times.values.push_back(threadSeconds() - begin);
        Compute compute = device_.createCompute();
        compute.setKernel(kernel_);
        compute.setUniform(0, Parameters());
        compute.setTracing(0, scene_);
        compute.setStorageBuffer(0, hits_);
        compute.dispatch(size, size);
        check(compute.end());
        check(device_.submit(compute));
    }

    void wait() { check(device_.finish()); }
    std::vector<uint32_t> read() { return *check(device_.read<uint32_t>(hits_)); }

    Times instance_times;

private:
    Device device_;
    Kernel kernel_;
    Buffer vertices_, indices_, hits_, scratch_;
    Tracing model_, scene_;
    std::vector<Tracing::Instance> instances_;
};

class RawFrame {
public:
    RawFrame(RawDevice& device, std::span<const uint32_t> words, const Mesh& mesh, std::span<const Matrix> matrices)
        : device_(device) {
        constexpr std::array bindings = {
            VkDescriptorSetLayoutBinding{0, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC, 1, VK_SHADER_STAGE_COMPUTE_BIT},
            VkDescriptorSetLayoutBinding{1, VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR, 1,
                                         VK_SHADER_STAGE_COMPUTE_BIT},
            VkDescriptorSetLayoutBinding{2, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT},
        };
        kernel_ = device_.createKernel(words, bindings);
        set_ = device_.createSets(kernel_, bindings, 1)[0];
        uniforms_ = device_.createBuffer(sizeof(Parameters), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT, true);
        hits_ = device_.createBuffer(size * size * sizeof(uint32_t), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, true);

        constexpr VkBufferUsageFlags input = VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR |
                                             VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
        const RawBuffer vertices = device_.createBuffer(mesh.positions.size() * sizeof(mesh.positions[0]), input, true);
        const RawBuffer indices = device_.createBuffer(mesh.indices.size() * sizeof(uint32_t), input, true);
        records_ = device_.createBuffer(instance_count * sizeof(VkAccelerationStructureInstanceKHR), input, true);
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

        geometry_ = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR};
        geometry_.geometryType = VK_GEOMETRY_TYPE_INSTANCES_KHR;
        geometry_.geometry.instances = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_INSTANCES_DATA_KHR};
        geometry_.geometry.instances.data.deviceAddress = records_.address;
        scene_ = device_.createAcceleration(VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR, geometry_, instance_count);
        scratch_ =
            device_.createBuffer(std::max(model_.scratch_size, scene_.scratch_size),
                                 VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT, false);
        writeSet();
        build(device_.begin(), VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR, model_, triangles, triangle_count);
        device_.submit();
        device_.wait();
        write(matrices);
    }

    void write(std::span<const Matrix> matrices) {
        auto* records = reinterpret_cast<VkAccelerationStructureInstanceKHR*>(records_.mapped);
        for (uint32_t i = 0; i < instance_count; i++) {
            VkAccelerationStructureInstanceKHR record = {};
            std::memcpy(&record.transform, matrices[i].rows.data(), sizeof(Matrix));
            record.mask = 0xff;
            record.accelerationStructureReference = model_.address;
            std::memcpy(records + i, &record, sizeof(record));
        }
    }

    void frame() {
        const RawFunctions& vk = device_.vk;
        VkCommandBuffer commands = device_.begin();
        const Parameters values;
        std::memcpy(uniforms_.mapped, &values, sizeof(values));
        // The frame before may still read the structure and use the scratch memory.
        memoryBarrier(
            vk, commands,
            VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_ACCELERATION_STRUCTURE_BUILD_BIT_KHR,
            VK_ACCESS_2_ACCELERATION_STRUCTURE_WRITE_BIT_KHR, VK_PIPELINE_STAGE_2_ACCELERATION_STRUCTURE_BUILD_BIT_KHR,
            VK_ACCESS_2_ACCELERATION_STRUCTURE_READ_BIT_KHR | VK_ACCESS_2_ACCELERATION_STRUCTURE_WRITE_BIT_KHR);
        build(commands, VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR, scene_, geometry_, instance_count);
        memoryBarrier(vk, commands,
                      VK_PIPELINE_STAGE_2_ACCELERATION_STRUCTURE_BUILD_BIT_KHR | VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT,
                      VK_ACCESS_2_ACCELERATION_STRUCTURE_WRITE_BIT_KHR | VK_ACCESS_2_SHADER_WRITE_BIT,
                      VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT,
                      VK_ACCESS_2_ACCELERATION_STRUCTURE_READ_BIT_KHR | VK_ACCESS_2_SHADER_WRITE_BIT);
        const uint32_t offset = 0;
        vk.CmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel_.pipeline);
        vk.CmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel_.layout, 0, 1, &set_, 1, &offset);
        vk.CmdDispatch(commands, size / group, size / group, 1);
        device_.submit();
    }

    void wait() { device_.wait(); }

    std::vector<uint32_t> read() const {
        std::vector<uint32_t> values(size * size);
        std::memcpy(values.data(), hits_.mapped, hits_.size);
        return values;
    }

private:
    void build(VkCommandBuffer commands, VkAccelerationStructureTypeKHR type, const RawAcceleration& structure,
               const VkAccelerationStructureGeometryKHR& geometry, uint32_t primitives) {
        VkAccelerationStructureBuildGeometryInfoKHR info = {
            VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR};
        info.type = type;
        info.flags = VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR;
        info.mode = VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR;
        info.dstAccelerationStructure = structure.structure;
        info.geometryCount = 1;
        info.pGeometries = &geometry;
        info.scratchData.deviceAddress = scratch_.address;
        const VkAccelerationStructureBuildRangeInfoKHR range = {primitives, 0, 0, 0};
        const VkAccelerationStructureBuildRangeInfoKHR* ranges = &range;
        device_.vk.CmdBuildAccelerationStructuresKHR(commands, 1, &info, &ranges);
    }

    void writeSet() {
        const VkDescriptorBufferInfo uniforms = {uniforms_.buffer, 0, sizeof(Parameters)};
        const VkDescriptorBufferInfo hits = {hits_.buffer, 0, VK_WHOLE_SIZE};
        VkWriteDescriptorSetAccelerationStructureKHR structure = {
            VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET_ACCELERATION_STRUCTURE_KHR};
        structure.accelerationStructureCount = 1;
        structure.pAccelerationStructures = &scene_.structure;
        std::array<VkWriteDescriptorSet, 3> writes = {};
        for (uint32_t i = 0; i < writes.size(); i++) {
            writes[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
            writes[i].dstSet = set_;
            writes[i].dstBinding = i;
            writes[i].descriptorCount = 1;
        }
        writes[0].descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC;
        writes[0].pBufferInfo = &uniforms;
        writes[1].descriptorType = VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR;
        writes[1].pNext = &structure;
        writes[2].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        writes[2].pBufferInfo = &hits;
        device_.vk.UpdateDescriptorSets(device_.handle(), static_cast<uint32_t>(writes.size()), writes.data(), 0,
                                        nullptr);
    }

    RawDevice& device_;
    RawProgram kernel_;
    VkDescriptorSet set_ = VK_NULL_HANDLE;
    RawBuffer uniforms_, hits_, records_, scratch_;
    RawAcceleration model_, scene_;
    VkAccelerationStructureGeometryKHR geometry_ = {};
};

void run(Report& report) {
    Device device = createDevice(TracingEngine::Driver);
    if (!device.getFeatures().computeTracing) {
        fmt::print("  left out: {} has no ray queries\n\n", device.getInfo().name);
        return;
    }
    const Shader shader = check(Shader::createGLSL(Shader::TypeCompute, source));
    const InstancedScene places = *check(InstancedScene::load({}, false));
    const Mesh& mesh = places.mesh();
    RawDevice raw_device(device.getInfo().name, RawDevice::Tracing::On);
    float time = 0.0f;
    std::vector<Matrix> matrices = places.transforms(time);
    Times record_times;
    GlintFrame glint(device, shader, mesh, matrices);
    RawFrame raw(raw_device, shader.getWords(), mesh, matrices);

    // Glint turns instances into the driver's records within the frame. The hand-written side is timed without and with
    // writing the same records, and the figure takes that without: all work that is not a Vulkan call is Glint's own.
    const std::array sides = {
        Side{[&] { glint.frame(); }, [&] { glint.wait(); }},
        Side{[&] { raw.frame(); }, [&] { raw.wait(); }},
        Side{[&] {
                 const double begin = threadSeconds();
                 raw.write(matrices);
                 record_times.values.push_back(threadSeconds() - begin);
                 raw.frame();
             },
             [&] {
                 raw.wait();
                 time += 1.0f / 60.0f;
                 matrices = places.transforms(time);
                 glint.move(matrices);
                 raw.write(matrices);
             }},
    };
    const std::vector<Times> times = interleave(sides, warm_up, rounds);
    glint.frame();
    raw.frame();
    raw.wait();
    const std::vector<uint32_t> hits = raw.read();
    if (std::all_of(hits.begin(), hits.end(), [](uint32_t hit) { return hit == 0; }))
        throw std::runtime_error("the hand-written side hit nothing");
    if (glint.read() != hits) throw std::runtime_error("the sides hit different instances");

    printTimes("Glint", times[0]);
    printTimes("Vulkan calls alone", times[1]);
    printTimes("Vulkan and instance records", times[2]);
    report.add("overhead.tracing_frame_ms", (times[0].median() - times[1].median()) * 1e3, "ms",
               "the same Vulkan calls by hand, subtracted", deviceName(device));
    printTimes("Glint's instances", glint.instance_times);
    printTimes("instance records by hand", record_times);
    report.add("overhead.set_instances_ms", glint.instance_times.median() * 1e3, "ms",
               fmt::format("{:.3f} ms to write the records by hand", record_times.median() * 1e3), deviceName(device));
}

}  // namespace

Benchmark tracingFrameBenchmark() { return {{"overhead.tracing_frame_ms", "overhead.set_instances_ms"}, run}; }

}  // namespace glint::bench
