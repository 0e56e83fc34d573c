// memory.cycles_10000: how much more memory the process holds after 10,000 objects of a class were made and released
// than after 1,000. A figure for each class; the one without a class is the largest.

#include "bench/bench.h"

#include "support/allocations.h"

#include <fmt/format.h>
#include <glint/geometry/primitives.h>

#include <malloc.h>

#include <algorithm>
#include <array>
#include <utility>

namespace glint::bench {

namespace {

constexpr uint32_t cycles = 10000;
constexpr uint32_t settled = 1000;
constexpr const char* figure = "memory.cycles_10000";

constexpr const char* compute_source = R"(
layout(local_size_x = 8) in;
layout(binding = 0) uniform Parameters { uvec4 add; };
layout(binding = 1) buffer Values { uint values[]; };
void main() { values[gl_GlobalInvocationID.x] += add.x; }
)";

constexpr const char* vertex_source = R"(
layout(location = 0) in vec4 position;
void main() { gl_Position = position; }
)";

constexpr const char* fragment_source = R"(
layout(location = 0) out vec4 color;
void main() { color = vec4(1.0); }
)";

struct Numbers {
    uint32_t values[4];
};

/// What the objects of some classes need of others.
struct Scene {
    explicit Scene(const Device& opened) : device(opened) {
        compute = check(Shader::createGLSL(Shader::TypeCompute, compute_source));
        vertex = check(Shader::createGLSL(Shader::TypeVertex, vertex_source));
        fragment = check(Shader::createGLSL(Shader::TypeFragment, fragment_source));
        kernel = device.createKernel();
        kernel.setShader(compute);
        check(kernel.create());
        values = device.createBuffer(Buffer::FlagStorage, 4096);
        color = device.createTexture2D(FormatRGBAu8n, 16, 16, Texture::FlagTarget);
        target = device.createTarget(color);
        pipeline = makePipeline();
        const std::vector<float> positions(12, 0.5f);
        vertices = device.createBuffer(Buffer::FlagVertex, std::span(positions));
        if (device.getFeatures().computeTracing) {
            const Mesh mesh = createSphere(1.0f, 2);
            positions_count = static_cast<uint32_t>(mesh.positions.size());
            indices_count = static_cast<uint32_t>(mesh.indices.size());
            mesh_positions = device.createBuffer(Buffer::FlagTracing, std::span(mesh.positions));
            mesh_indices = device.createBuffer(Buffer::FlagTracing, std::span(mesh.indices));
        }
        check(device.finish());
    }

    Pipeline makePipeline() {
        Pipeline made = device.createPipeline();
        made.setShader(vertex);
        made.setShader(fragment);
        made.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 0, 0, 16);
        made.setColorFormat(FormatRGBAu8n);
        check(made.create());
        return made;
    }

    void record(Compute& list) {
        list.setKernel(kernel);
        list.setUniform(0, Numbers{{1, 2, 3, 4}});
        list.setStorageBuffer(0, values);
        list.dispatch(8);
        check(list.end());
    }

    Device device;
    Shader compute, vertex, fragment;
    Kernel kernel;
    Pipeline pipeline;
    Buffer values, vertices, mesh_positions, mesh_indices;
    Texture color;
    Target target;
    uint32_t positions_count = 0;
    uint32_t indices_count = 0;
};

struct Class {
    std::string name;
    std::function<void()> cycle;
};

std::vector<Class> classes(Scene& scene) {
    Device& device = scene.device;
    std::vector<Class> all = {
        {"buffer", [&] { check(device.createBuffer(Buffer::FlagStorage, 4096)); }},
        {"texture", [&] { check(device.createTexture2D(FormatRGBAu8n, 16, 16, Texture::FlagSurface)); }},
        {"sampler", [&] { check(device.createSampler(Sampler::FilterTrilinear, Sampler::WrapModeRepeat)); }},
        {"shader", [&] { check(Shader::createGLSL(Shader::TypeCompute, compute_source)); }},
        {"shader_words", [&] { check(Shader::createSPIRV(Shader::TypeCompute, scene.compute.getWords())); }},
        {"kernel",
         [&] {
             Kernel kernel = device.createKernel();
             kernel.setShader(scene.compute);
             check(kernel.create());
         }},
        {"pipeline", [&] { check(scene.makePipeline()); }},
        {"target", [&] { device.createTarget(scene.color).setClearColor(Color::gray()); }},
        {"command",
         [&] {
             Command list = device.createCommand(scene.target);
             list.setPipeline(scene.pipeline);
             list.setVertexBuffer(0, scene.vertices);
             list.drawArrays(3);
             check(list.end());
         }},
        {"compute",
         [&] {
             Compute list = device.createCompute();
             scene.record(list);
         }},
        {"query", [&] { check(device.createQuery(Query::TypeTime)); }},
        {"fence", [&] { check(device.createFence()); }},
        // Objects that the device has used go another way than those that it never saw.
        {"submitted",
         [&] {
             Compute list = device.createCompute();
             list.setKernel(scene.kernel);
             list.setUniform(0, Numbers{{1, 2, 3, 4}});
             list.setStorageBuffer(0, device.createBuffer(Buffer::FlagStorage, 4096));
             list.dispatch(8);
             const Fence fence = device.createFence();
             check(device.submit(list, fence));
             check(fence.wait());
         }},
    };
    if (device.getFeatures().computeTracing) {
        all.push_back({"tracing", [&] {
                           Tracing tracing = device.createTracing();
                           tracing.addVertexBuffer(scene.positions_count, FormatRGBf32, 12, scene.mesh_positions);
                           tracing.addIndexBuffer(scene.indices_count, FormatRu32, scene.mesh_indices);
                           check(tracing.create(Tracing::TypeTriangle));
                       }});
    }
    return all;
}

// What the C library holds ready for itself is no growth of ours.
int64_t settledMemory() {
    ::malloc_trim(0);
    return static_cast<int64_t>(test::residentMemory());
}

void run(Report& report) {
    Device device = createDevice();
    Scene scene(device);
    const std::string name = deviceName(device);

    double largest = 0.0;
    bool complete = true;
    for (const Class& each : classes(scene)) {
        const std::string full = std::string(figure) + "." + each.name;
        const std::string& filter = report.options().filter;
        if (full.find(filter) == std::string::npos) {
            complete = false;
            continue;
        }
        int64_t before = 0;
        const double begin = wallSeconds();
        for (uint32_t i = 0; i < cycles; i++) {
            if (i == settled) before = settledMemory();
            each.cycle();
        }
        const auto growth = static_cast<double>(settledMemory() - before);
        fmt::print("  {:.2f} us a cycle\n", (wallSeconds() - begin) * 1e6 / cycles);
        report.add(full, growth, "bytes", "the process after 1,000 cycles", name);
        largest = std::max(largest, growth);
    }
    if (complete) report.add(figure, largest, "bytes", "the process after 1,000 cycles, largest class", name);
}

}  // namespace

Benchmark memoryBenchmark() {
    Benchmark benchmark = {{figure}, run};
    for (const char* name : {"buffer", "texture", "sampler", "shader", "shader_words", "kernel", "pipeline", "target",
                             "command", "compute", "query", "fence", "submitted", "tracing"}) {
        benchmark.figures.push_back(std::string(figure) + "." + name);
    }
    return benchmark;
}

}  // namespace glint::bench
