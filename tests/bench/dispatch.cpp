// overhead.dispatch_1000: the recording thread's time for 1,000 tracked dispatches, from createCompute to the return of
// submit, over that of hand-written Vulkan.

#include "bench/bench.h"
#include "bench/raw_vulkan.h"

#include <fmt/format.h>

#include <array>
#include <cstring>

namespace glint::bench {

namespace {

constexpr uint32_t dispatch_count = 1000;
constexpr uint32_t buffer_count = 4;
constexpr uint32_t value_count = 8;
constexpr uint32_t warm_up = 10;
constexpr uint32_t rounds = 101;

// Reads and writes, so that every use of a buffer has to wait for the one before.
constexpr const char* source = R"(
layout(local_size_x = 8) in;
layout(binding = 0) uniform Parameters { uvec4 add; };
layout(binding = 1) buffer Values { uint values[]; };
void main() { values[gl_GlobalInvocationID.x] += add.x + add.y * values[gl_GlobalInvocationID.x]; }
)";

struct Parameters {
    uint32_t add[4];
};

Parameters parameters(uint32_t dispatch) { return {{dispatch, dispatch & 1, 0, 0}}; }

class GlintDispatches {
public:
    GlintDispatches(const Device& device, const Shader& shader) : device_(device), kernel_(device_.createKernel()) {
        kernel_.setShader(shader);
        check(kernel_.create());
        const std::vector<uint32_t> zeros(value_count);
        for (Buffer& buffer : buffers_) buffer = device_.createBuffer(Buffer::FlagStorage, std::span(zeros));
        check(device_.finish());
    }

    void frame() {
        Compute compute = device_.createCompute();
        compute.setKernel(kernel_);
        for (uint32_t i = 0; i < dispatch_count; i++) {
            compute.setUniform(0, parameters(i));
            compute.setStorageBuffer(0, buffers_[i % buffer_count]);
            compute.dispatch(value_count);
        }
        check(compute.end());
        check(device_.submit(compute));
    }

    void wait() { check(device_.finish()); }

    std::vector<uint32_t> read(uint32_t buffer) { return *check(device_.read<uint32_t>(buffers_[buffer])); }

private:
    Device device_;
    Kernel kernel_;
    std::array<Buffer, buffer_count> buffers_;
};

// A descriptor set for each dispatch, its storage buffer written when the dispatch is recorded, or all of them written
// once beforehand, which only a program that knows its frame can do; uniforms by a dynamic offset into one mapped
// buffer.
class RawDispatches {
public:
    enum class Descriptors { Written, Prepared };

    RawDispatches(RawDevice& device, std::span<const uint32_t> words, Descriptors descriptors)
        : device_(device), descriptors_(descriptors) {
        constexpr std::array bindings = {
            VkDescriptorSetLayoutBinding{0, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC, 1, VK_SHADER_STAGE_COMPUTE_BIT},
            VkDescriptorSetLayoutBinding{1, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT},
        };
        kernel_ = device_.createKernel(words, bindings);
        sets_ = device_.createSets(kernel_, bindings, dispatch_count);
        const auto alignment = static_cast<uint32_t>(device_.limits().minUniformBufferOffsetAlignment);
        stride_ = (static_cast<uint32_t>(sizeof(Parameters)) + alignment - 1) / alignment * alignment;
        uniforms_ = device_.createBuffer(stride_ * dispatch_count, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT, true);
        for (RawBuffer& buffer : buffers_) {
            buffer = device_.createBuffer(value_count * sizeof(uint32_t), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, true);
            std::memset(buffer.mapped, 0, buffer.size);
        }
        for (uint32_t i = 0; i < dispatch_count; i++) {
            const VkDescriptorBufferInfo info = {uniforms_.buffer, 0, sizeof(Parameters)};
            VkWriteDescriptorSet write = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
            write.dstSet = sets_[i];
            write.descriptorCount = 1;
            write.descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC;
            write.pBufferInfo = &info;
            device_.vk.UpdateDescriptorSets(device_.handle(), 1, &write, 0, nullptr);
            writeStorage(i);
        }
    }

    void frame() {
        const RawFunctions& vk = device_.vk;
        VkCommandBuffer commands = device_.begin();
        vk.CmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel_.pipeline);
        for (uint32_t i = 0; i < dispatch_count; i++) {
            const Parameters values = parameters(i);
            const uint32_t offset = i * stride_;
            std::memcpy(uniforms_.mapped + offset, &values, sizeof(values));
            if (descriptors_ == Descriptors::Written) writeStorage(i);
            vk.CmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel_.layout, 0, 1, &sets_[i], 1,
                                     &offset);
            // One barrier orders the dispatches of all buffers: the next is needed when the buffers come round again.
            if (i != 0 && i % buffer_count == 0) {
                memoryBarrier(vk, commands, VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_WRITE_BIT,
                              VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT,
                              VK_ACCESS_2_SHADER_READ_BIT | VK_ACCESS_2_SHADER_WRITE_BIT);
            }
            vk.CmdDispatch(commands, 1, 1, 1);
        }
        device_.submit();
    }

    void wait() { device_.wait(); }

    std::vector<uint32_t> read(uint32_t buffer) const {
        std::vector<uint32_t> values(value_count);
        std::memcpy(values.data(), buffers_[buffer].mapped, buffers_[buffer].size);
        return values;
    }

private:
    void writeStorage(uint32_t dispatch) {
        const VkDescriptorBufferInfo info = {buffers_[dispatch % buffer_count].buffer, 0, VK_WHOLE_SIZE};
        VkWriteDescriptorSet write = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
        write.dstSet = sets_[dispatch];
        write.dstBinding = 1;
        write.descriptorCount = 1;
        write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        write.pBufferInfo = &info;
        device_.vk.UpdateDescriptorSets(device_.handle(), 1, &write, 0, nullptr);
    }

    RawDevice& device_;
    const Descriptors descriptors_;
    RawProgram kernel_;
    std::vector<VkDescriptorSet> sets_;
    uint32_t stride_ = 0;
    RawBuffer uniforms_;
    std::array<RawBuffer, buffer_count> buffers_;
};

void run(Report& report) {
    Device device = createDevice();
    const Shader shader = check(Shader::createGLSL(Shader::TypeCompute, source));
    RawDevice raw_device(device.getInfo().name);

    GlintDispatches glint(device, shader);
    RawDispatches raw(raw_device, shader.getWords(), RawDispatches::Descriptors::Written);
    RawDispatches prepared(raw_device, shader.getWords(), RawDispatches::Descriptors::Prepared);
    const std::array sides = {
        Side{[&] { glint.frame(); }, [&] { glint.wait(); }},
        Side{[&] { raw.frame(); }, [&] { raw.wait(); }},
        Side{[&] { prepared.frame(); }, [&] { prepared.wait(); }},
    };
    const std::vector<Times> times = interleave(sides, warm_up, rounds);
    for (uint32_t i = 0; i < buffer_count; i++) {
        if (glint.read(i) != raw.read(i) || raw.read(i) != prepared.read(i))
            throw std::runtime_error("the sides computed different values");
    }

    printTimes("Glint", times[0]);
    printTimes("Vulkan", times[1]);
    printTimes("Vulkan, descriptors prepared", times[2]);
    fmt::print("  ratio of medians {:.2f}, of minima {:.2f}; to prepared descriptors {:.2f}\n",
               times[0].median() / times[1].median(), times[0].minimum() / times[1].minimum(),
               times[0].median() / times[2].median());
    report.add("overhead.dispatch_1000", times[0].median() / times[1].median(), "ratio", "hand-written Vulkan",
               deviceName(device));
}

}  // namespace

Benchmark dispatchBenchmark() { return {{"overhead.dispatch_1000"}, run}; }

}  // namespace glint::bench
