// Particles: emitters spawn them, compute shaders move, count and sort the living, an indirect draw blends them from
// the farthest to the nearest.

#include "common/viewer.h"

#include <glint/math/camera.h>
#include <glint/parallel/radix_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <span>
#include <vector>

using namespace glint;

namespace {

constexpr uint32_t group_size = 128;
constexpr uint32_t max_particles = 1u << 20;
constexpr uint32_t emitter_pairs = 5;
constexpr float step = 1.0f / 60.0f;

// The structures of main.shader.
struct Emitter {
    Vector4f position;   // w: particles to spawn in this step
    Vector4f direction;  // w: velocity
    Vector4f spread;     // velocity spread, radius mean and spread, life mean
    Vector4f damping;    // damping, opacity, life spread, seed
    Vector4f color;
};

struct Simulation {
    Vector4f gravity;
    Vector4f wind;  // w: force
    float time_step;
    uint32_t emitters;
    uint32_t max_particles;
    uint32_t frame;
};

struct Particle {
    Vector4f position;  // w: radius
    Vector4f velocity;  // w: life left
    Vector4f color;     // w: whole life
    Vector4f twist;     // angle, speed, damping of both speeds, opacity
};

struct View {
    CameraParameters camera;
};

/// The emitters of one moment: five pairs that circle at height 8, each pair a fountain and a burst.
std::vector<Emitter> emittersAt(float time, std::array<float, emitter_pairs * 2>& owed) {
    std::vector<Emitter> emitters;
    for (uint32_t i = 0; i < emitter_pairs; i++) {
        const float offset = 6.2831853f * static_cast<float>(i) / emitter_pairs;
        const float angle = 0.14f * time + offset;
        const float reach = 12.0f + 4.0f * std::cos(time + offset);
        const Vector4f position = {reach * std::cos(angle), reach * std::sin(angle), 4.0f, 0.0f};
        const Vector3f hue =
            0.55f + 0.45f * glm::vec3(std::cos(offset), std::cos(offset - 2.1f), std::cos(offset + 2.1f));
        Emitter fountain;
        fountain.position = position;
        fountain.direction = {0.0f, 0.0f, 1.0f, 12.0f};
        fountain.spread = {2.0f + 4.0f * std::abs(std::sin(time)), 0.12f, 0.06f, 4.0f};
        fountain.damping = {0.5f + 0.5f * std::abs(std::sin(time)), 0.7f, 1.5f, static_cast<float>(2 * i)};
        fountain.color = Vector4f(hue * 0.35f, 1.0f);
        Emitter burst = fountain;
        burst.direction = {0.0f, 0.0f, 1.0f, 2.0f};
        burst.spread = {20.0f, 0.05f, 0.05f, 0.3f};
        burst.damping = {0.5f, 0.0f, 0.2f, static_cast<float>(2 * i + 1)};
        burst.color = {0.5f, 0.35f, 0.2f, 1.0f};
        const float rates[2] = {2500.0f, 10000.0f};
        Emitter* pair[2] = {&fountain, &burst};
        for (uint32_t k = 0; k < 2; k++) {
            // What is not a whole particle yet is owed to the next step.
            float& rest = owed[2 * i + k];
            rest += rates[k] * step;
            pair[k]->position.w = std::floor(rest);
            rest -= pair[k]->position.w;
            emitters.push_back(*pair[k]);
        }
    }
    return emitters;
}

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "A particle system in compute shaders, drawn with indirect arguments.");
    float gravity = 8.0f, wind = 4.0f, drag = 0.2f;
    example.addKnob("--gravity", gravity, -20.0f, 20.0f, "Downward acceleration");
    example.addKnob("--wind", wind, -20.0f, 20.0f, "Speed of the air, upward");
    example.addKnob("--drag", drag, 0.0f, 2.0f, "How much of that speed a particle takes over in a second");
    example.setStart(4.0);  // the scene has a past: that frame takes 240 steps from nothing
    if (!example.parse(argc, argv)) return example.exitCode();

    Device device = openDevice(example);
    if (!device) return report(device.error());

    const auto loadKernel = [&](const char* name, const char* macros) {
        Kernel kernel = device.createKernel(name);
        kernel.loadShaderGLSL(EXAMPLE_DIR "/main.shader", macros);
        (void)kernel.create();  // carried by the handle
        return kernel;
    };
    Kernel emit = loadKernel("emit", "EMIT_SHADER=1; GROUP_SIZE=128");
    Kernel arguments = loadKernel("arguments", "ARGUMENTS_SHADER=1; GROUP_SIZE=128");
    Kernel update = loadKernel("update", "UPDATE_SHADER=1; GROUP_SIZE=128");
    Kernel keys = loadKernel("keys", "KEYS_SHADER=1; GROUP_SIZE=128");
    Kernel tone = loadKernel("tone", "TONE_SHADER=1");
    for (const Kernel& kernel : {emit, arguments, update, keys, tone})
        if (!kernel) return report(kernel.error());

    Pipeline draw = device.createPipeline("particles");
    draw.setColorFormat(FormatRGBAf16);
    draw.setPrimitive(Pipeline::PrimitiveTriangleStrip);
    draw.setBlend(Pipeline::BlendOpAdd, Pipeline::BlendFuncOne, Pipeline::BlendFuncInvSrcAlpha);
    draw.loadShaderGLSL(Shader::TypeVertex, EXAMPLE_DIR "/main.shader", "VERTEX_SHADER=1");
    draw.loadShaderGLSL(Shader::TypeFragment, EXAMPLE_DIR "/main.shader", "FRAGMENT_SHADER=1");
    if (!draw.create()) return report(draw.error());

    // The living move from one buffer to the other in each step. Counters: of the source, of the destination.
    // Indirect arguments: a dispatch (3 words), then a draw (4 words).
    Buffer particles[2];
    for (Buffer& buffer : particles)
        buffer = device.createBuffer(Buffer::FlagStorage, max_particles * sizeof(Particle), "particles");
    Buffer counters = device.createBuffer(Buffer::FlagStorage, 2 * sizeof(uint32_t), "counters");
    Buffer indirect = device.createBuffer(Buffer::FlagStorage | Buffer::FlagIndirect, 7 * sizeof(uint32_t), "indirect");
    // Keys of the particles, then their numbers in the order of the keys; and which of both there are.
    Buffer order = device.createBuffer(Buffer::FlagStorage, 2 * max_particles * sizeof(uint32_t), "order");
    Buffer region = device.createBuffer(Buffer::FlagStorage, sizeof(RadixSort::Region), "region");
    for (const Buffer& buffer : {counters, indirect, region}) device.clearBuffer(buffer);
    RadixSort sort;
    if (Status status = sort.create(device, RadixSort::FlagSingle | RadixSort::FlagOrder, max_particles); !status)
        return report(status.error());

    Texture light;
    Target target;
    std::array<float, emitter_pairs* 2> owed = {};
    uint32_t steps = 0;

    example.statistics().counts["emitters"] = emitter_pairs * 2;
    Viewer viewer(example, device);
    const Status status = viewer.run([&](Frame& frame) -> Status {
        if (frame.is_resized) {
            light = device.createTexture2D(FormatRGBAf16, frame.width, frame.height, Texture::FlagTarget, "light");
            target = device.createTarget(light);
        }
        const auto last_step = static_cast<uint32_t>(std::lround(frame.time / static_cast<double>(step)));
        for (; steps < last_step; steps++) {
            const std::vector<Emitter> emitters = emittersAt(static_cast<float>(steps) * step, owed);
            const Simulation simulation = {{0.0f, 0.0f, -gravity, 0.0f},
                                           {0.0f, 0.0f, wind, drag},
                                           step,
                                           static_cast<uint32_t>(emitters.size()),
                                           max_particles,
                                           steps};
            std::array<Emitter, emitter_pairs * 2> block;
            std::copy(emitters.begin(), emitters.end(), block.begin());

            const bool last = steps + 1 == last_step;
            Compute compute = device.createCompute();
            if (last) frame.timer.begin(compute, "simulate");
            compute.setKernel(emit);
            compute.setUniform(0, simulation);
            compute.setUniform(1, block);
            compute.setStorageBuffers(0, {particles[0], counters});
            compute.dispatch(emitters.size() * group_size);

            compute.setKernel(arguments);
            compute.setStorageBuffers(0, {counters, indirect, region});
            compute.setPushConstants(0u);
            compute.dispatch(1);

            compute.setKernel(update);
            compute.setStorageBuffers(0, {particles[0], particles[1], counters});
            compute.dispatchIndirect(indirect);

            // The survivors are what is drawn, and what the next step begins with.
            compute.setKernel(arguments);
            compute.setStorageBuffers(0, {counters, indirect, region});
            compute.setPushConstants(1u);
            compute.dispatch(1);
            if (last) frame.timer.end(compute);
            if (Status submitted = device.submit(compute); !submitted) return submitted;
            std::swap(particles[0], particles[1]);
        }

        const Vector3f centre = {0.0f, 0.0f, 4.0f};
        const float angle = -0.14f * static_cast<float>(frame.time);
        Camera camera;
        camera.lookAt(frame.view.eye({30.0f * std::cos(angle), 30.0f * std::sin(angle), 16.0f}, centre), centre);
        camera.perspective(60.0f, frame.aspect());
        const View view = {camera.parameters()};
        Compute sorting = device.createCompute();
        frame.timer.begin(sorting, "sort");
        sorting.setKernel(keys);
        sorting.setUniform(0, view);
        sorting.setStorageBuffers(0, {particles[0], counters, order});
        sorting.dispatchIndirect(indirect);
        sort.dispatchIndirect(sorting, order, region);
        frame.timer.end(sorting);

        Command command = device.createCommand(target);
        frame.timer.begin(command, "draw");
        command.setPipeline(draw);
        command.setUniform(0, view);
        command.setStorageBuffers(0, {particles[0], order});
        command.drawArraysIndirect(indirect, 3 * sizeof(uint32_t));
        frame.timer.end(command);

        Compute compute = device.createCompute();
        frame.timer.begin(compute, "tone");
        compute.setKernel(tone);
        compute.setTexture(0, light);
        compute.setSurfaceTexture(0, frame.picture);
        compute.dispatch(frame.picture);
        frame.timer.end(compute);
        return device.submit({sorting, command, compute});
    });
    if (!status) return report(status.error());

    const Expected<std::vector<uint32_t>> count = device.read<uint32_t>(counters);
    if (!count) return report(count.error());
    if (Status sorted = sort.check(); !sorted) return report(sorted.error());
    example.statistics().counts["particles"] = (*count)[0];
    example.statistics().counts["steps"] = steps;
    std::printf("%u particles after %u steps, %.1f ms a step, %.1f ms to sort, %.1f ms to draw\n", (*count)[0], steps,
                example.statistics().median("simulate") * 1e-6, example.statistics().median("sort") * 1e-6,
                example.statistics().median("draw") * 1e-6);
    return viewer.finish();
}
