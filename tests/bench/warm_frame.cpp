// overhead.warm_allocations, overhead.warm_objects: what a frame like all frames before it still allocates and creates.

#include "bench/allocation_counter.h"
#include "bench/bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace glint::bench {

namespace {

constexpr uint32_t size = 64;
constexpr uint32_t dispatches = 16;
constexpr uint32_t draws = 32;
constexpr uint32_t value_count = 256;
constexpr uint32_t warm_up = 32;
constexpr uint32_t crowded = 8;  // first frames of the warm-up, which do not wait for one another
constexpr uint32_t frames = 100;
constexpr uint32_t frames_in_flight = 2;

constexpr const char* compute_source = R"(
layout(local_size_x = 64) in;
layout(binding = 0) uniform Parameters { uvec4 add; };
layout(binding = 1) buffer Values { uint values[]; };
void main() { values[gl_GlobalInvocationID.x] += add.x; }
)";

constexpr const char* vertex_source = R"(
layout(binding = 0) uniform Parameters { vec4 offset; };
layout(location = 0) in vec4 position;
void main() { gl_Position = position + offset; }
)";

constexpr const char* fragment_source = R"(
layout(binding = 1) uniform texture2D picture;
layout(binding = 2) uniform sampler picture_sampler;
layout(binding = 3) readonly buffer Values { uint values[]; };
layout(location = 0) out vec4 color;
void main() { color = texture(sampler2D(picture, picture_sampler), vec2(0.5)) + float(values[0] & 1u); }
)";

struct Vector {
    float values[4];
};

struct Numbers {
    uint32_t values[4];
};

class WarmFrame {
public:
    explicit WarmFrame(const Device& device)
        : device_(device),
          kernel_(device_.createKernel()),
          pipeline_(device_.createPipeline()),
          picture_(device_.createTexture2D(FormatRGBAu8n, 4, 4)),
          color_(device_.createTexture2D(FormatRGBAu8n, size, size, Texture::FlagTarget)),
          target_(device_.createTarget(color_)),
          sampler_(device_.createSampler()) {
        kernel_.createShaderGLSL(compute_source);
        check(kernel_.create());
        pipeline_.createShaderGLSL(Shader::TypeVertex, vertex_source);
        pipeline_.createShaderGLSL(Shader::TypeFragment, fragment_source);
        pipeline_.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 0, 0, sizeof(Vector));
        pipeline_.setColorFormat(FormatRGBAu8n);
        check(pipeline_.create());
        for (Buffer& buffer : buffers_) buffer = device_.createBuffer(Buffer::FlagStorage, value_count * 4);
        readback_ = device_.createBuffer(Buffer::FlagMapped, size * size * 4);
        constexpr std::array<Vector, 3> vertices = {{{{-1, -1, 0, 1}}, {{1, -1, 0, 1}}, {{0, 1, 0, 1}}}};
        vertices_ = device_.createBuffer(Buffer::FlagVertex, vertices.data(), sizeof(vertices));
        for (const Buffer& buffer : buffers_) device_.clearBuffer(buffer);
        device_.clearTexture(picture_, Color::gray());
        for (Fence& fence : fences_) fence = device_.createFence();
        check(device_.finish());
    }

    void frame(uint32_t number) {
        const Fence& fence = fences_[number % frames_in_flight];
        // More frames at once than later, so that no timing of the device asks for a pool that is not there yet.
        if (number >= crowded) check(fence.wait());

        const std::array<uint32_t, 4> values = {number, 1, 2, 3};
        device_.setBuffer(buffers_[0], 0, values.data(), sizeof(values));

        Compute compute = device_.createCompute(Queue::Main, "simulation");
        compute.setKernel(kernel_);
        for (uint32_t i = 0; i < dispatches; i++) {
            compute.setUniform(0, Numbers{{number, i, 0, 0}});
            compute.setStorageBuffer(0, buffers_[i % buffers_.size()]);
            compute.dispatch(value_count);
        }
        compute.copyBuffer(buffers_[2], 0, buffers_[0], 0, value_count * 4);
        compute.clearBuffer(buffers_[3]);
        check(compute.end());

        Command command = device_.createCommand(target_, "picture");
        command.setPipeline(pipeline_);
        command.setSampler(0, sampler_);
        command.setTexture(0, picture_);
        command.setVertexBuffer(0, vertices_);
        for (uint32_t i = 0; i < draws; i++) {
            command.setUniform(0, Vector{{0.01f * static_cast<float>(i), 0, 0, 0}});
            command.setStorageBuffer(0, buffers_[i % buffers_.size()]);
            command.drawArrays(3);
        }
        check(command.end());

        Compute copy = device_.createCompute();
        copy.copyTextureToBuffer(readback_, 0, color_);
        check(copy.end());

        check(device_.submit({compute, command, copy}, fence));
        signaled_ += fence.isSignaled() ? 1 : 0;
    }

    uint64_t objects() const { return device_.getMemory().objects_created; }

private:
    Device device_;
    Kernel kernel_;
    Pipeline pipeline_;
    Texture picture_;
    Texture color_;
    Target target_;
    Sampler sampler_;
    std::array<Buffer, 4> buffers_;
    Buffer readback_;
    Buffer vertices_;
    std::array<Fence, frames_in_flight> fences_;
    uint32_t signaled_ = 0;
};

void run(Report& report) {
    Device device = createDevice();
    WarmFrame scene(device);
    for (uint32_t i = 0; i < warm_up; i++) scene.frame(i);

    const bool counts = AllocationCounter::prepare();
    const uint64_t objects_before = scene.objects();
    AllocationCounter::reset();
    uint64_t most = 0;
    uint64_t before = 0;
    for (uint32_t i = 0; i < frames; i++) {
        AllocationCounter::begin();
        scene.frame(warm_up + i);
        AllocationCounter::end();
        const uint64_t now = AllocationCounter::counts().program;
        most = std::max(most, now - before);
        before = now;
    }
    const uint64_t objects = scene.objects() - objects_before;
    const AllocationCounter::Counts all = AllocationCounter::counts();
    check(device.finish());

    fmt::print("  {} frames: {} allocations by Glint (at most {} a frame), {} by the driver, {} objects created\n",
               frames, all.program, most, all.libraries, objects);
    for (const std::string& stack : AllocationCounter::stacks()) fmt::print("    {}\n", stack);
    if (counts) {
        report.add("overhead.warm_allocations", static_cast<double>(all.program) / frames, "allocations a frame",
                   "a frame like those before it", deviceName(device));
    }
    report.add("overhead.warm_objects", static_cast<double>(objects) / frames, "native objects a frame",
               "a frame like those before it", deviceName(device));
}

}  // namespace

Benchmark warmFrameBenchmark() { return {{"overhead.warm_allocations", "overhead.warm_objects"}, run}; }

}  // namespace glint::bench
