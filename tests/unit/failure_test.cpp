// A small scene that goes wrong at every place where it can: each native object that cannot be made, each submission
// that fails, memory that runs out, features that are missing. Whatever happens, an error says so, nothing crashes,
// nothing is left behind and nothing is deleted while it is in use.

#include "support/matchers.h"

#include <glint/device/device.h>
#include <platform/null/null_control.h>

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace glint::test {
namespace {

using null::NullControl;
using null::NullSettings;
using null::ScopedSettings;

/// Compiled once: what a shader is made of is no matter of devices.
struct Shaders {
    Shader change = Shader::createGLSL(Shader::TypeCompute, R"(
        layout(local_size_x = 8) in;
        layout(binding = 0) uniform Parameters { uint amount; };
        layout(binding = 1) buffer Values { uint values[]; };
        layout(binding = 2, rgba8) writeonly uniform image2D surface;
        void main() {
            values[gl_GlobalInvocationID.x] += amount;
            imageStore(surface, ivec2(gl_GlobalInvocationID.x, 0), vec4(1.0));
        })");
    Shader trace = Shader::createGLSL(Shader::TypeCompute, R"(
        layout(local_size_x = 8) in;
        layout(binding = 0) uniform accelerationStructureEXT scene;
        layout(binding = 1) buffer Values { uint values[]; };
        void main() {
            rayQueryEXT query;
            rayQueryInitializeEXT(query, scene, 0u, 0xffu, vec3(0.0), 0.0, vec3(1.0), 1.0);
            values[gl_GlobalInvocationID.x] = rayQueryProceedEXT(query) ? 1u : 0u;
        })");
    Shader generation = Shader::createGLSL(Shader::TypeRayGen, R"(
        layout(binding = 0) uniform accelerationStructureEXT scene;
        layout(binding = 1) buffer Values { uint values[]; };
        layout(location = 0) rayPayloadEXT uint payload;
        void main() {
            traceRayEXT(scene, 0u, 0xff, 0, 0, 0, vec3(0.0), 0.0, vec3(1.0), 1.0, 0);
            values[gl_LaunchIDEXT.x] = payload;
        })");
    Shader miss = Shader::createGLSL(Shader::TypeRayMiss, R"(
        layout(location = 0) rayPayloadInEXT uint payload;
        void main() { payload = 1u; })");
    Shader vertex = Shader::createGLSL(Shader::TypeVertex, R"(
        layout(location = 0) in vec4 position;
        void main() { gl_Position = position; })");
    Shader fragment = Shader::createGLSL(Shader::TypeFragment, R"(
        layout(binding = 0) uniform sampler2D image;
        layout(location = 0) out vec4 color;
        void main() { color = texelFetch(image, ivec2(0), 0); })");
};

const Shaders& shaders() {
    static const Shaders all;
    return all;
}

/// The first error of a run of the scene, if there was one, and whether it went to the end.
struct Outcome {
    Error error;
    bool finished = false;
};

/// Runs the scene. A careful program stops at the first handle or status that is not good; a careless one goes on with
/// what it has and looks at the end.
Outcome runScene(Device& device, bool careful) {
    Outcome outcome;
    const auto good = [&](const auto& value) {
        const Error error = errorOf(value);
        if (error && !outcome.error) outcome.error = error;
        return !error || !careful;
    };

    std::vector<uint32_t> values(64, 1);
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values), "values");
    if (!good(buffer)) return outcome;
    const std::vector<uint32_t> many(1u << 19, 2);
    const Buffer large = device.createBuffer(Buffer::FlagStorage | Buffer::FlagVertex, std::span(many), "large");
    if (!good(large)) return outcome;
    const Texture image =
        device.createTexture2D(FormatRGBAu8n, 16, 16, Texture::FlagSurface | Texture::FlagMipmaps, "image");
    if (!good(image)) return outcome;
    const Texture picture = device.createTexture2D(FormatRGBAu8n, 16, 16, Texture::FlagTarget, "picture");
    if (!good(picture)) return outcome;
    const Sampler sampler = device.createSampler(Sampler::FilterTrilinear);
    if (!good(sampler)) return outcome;
    const Query query = device.createQuery(Query::TypeTime, "time");
    if (!good(query)) return outcome;

    Kernel change = device.createKernel("change");
    change.setShader(shaders().change);
    if (!good(change.create())) return outcome;
    Kernel trace = device.createKernel("trace");
    trace.setShader(shaders().trace);
    if (!good(trace.create())) return outcome;
    Traversal rays;
    if (device.getFeatures().rayTracing) {
        rays = device.createTraversal("rays");
        rays.setShader(shaders().generation);
        rays.setShader(shaders().miss);
        rays.addMissRecord(0, 1u);
        if (!good(rays.create())) return outcome;
    }
    Pipeline pipeline = device.createPipeline("pipeline");
    pipeline.setShader(shaders().vertex);
    pipeline.setShader(shaders().fragment);
    pipeline.setColorFormat(FormatRGBAu8n);
    pipeline.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 0, 0, 16);
    if (!good(pipeline.create())) return outcome;

    const std::vector<float> triangle = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const Buffer vertices = device.createBuffer(Buffer::FlagTracing, std::span(triangle), "vertices");
    if (!good(vertices)) return outcome;
    Tracing bottom = device.createTracing("bottom");
    bottom.addVertexBuffer(3, FormatRGBf32, 12, vertices);
    if (!good(bottom.create(Tracing::TypeTriangle, Tracing::FlagCompact))) return outcome;
    const Tracing top = device.createTracing({Tracing::Instance{.tracing = &bottom}});
    if (!good(top)) return outcome;
    if (!good(device.buildTracings({bottom, top}, Tracing::FlagCompact))) return outcome;

    const std::vector<uint32_t> texels(256, 0xff00ff00u);
    device.setTexture(image, texels.data(), 1024);
    device.createMipmaps(image);
    Compute compute = device.createCompute(Queue::Main, "compute");
    compute.beginQuery(query);
    compute.setKernel(change);
    compute.setUniform(0, 1u);
    compute.setStorageBuffer(0, buffer);
    compute.setSurfaceTexture(0, image);
    compute.dispatch(64);
    compute.setKernel(trace);
    compute.setTracing(0, top);
    compute.dispatch(64);
    if (device.getFeatures().rayTracing) {
        compute.setTraversal(rays);
        compute.dispatch(64);
    }
    compute.endQuery(query);
    Command command = device.createCommand(device.createTarget(picture), "command");
    command.setPipeline(pipeline);
    command.setVertexBuffer(0, large);
    command.setTexture(0, image);
    command.setSampler(0, sampler);
    command.drawArrays(3);
    const Fence fence = device.createFence("fence");
    if (!good(device.submit({compute, command}, fence))) return outcome;
    if (!good(fence.wait())) return outcome;

    Compute other = device.createCompute(Queue::Copy, "other");
    other.copyBuffer(large, 0, buffer, 0, 128);
    if (!good(device.submit(other))) return outcome;
    const Expected<std::vector<uint32_t>> read = device.read<uint32_t>(large);
    if (!good(read)) return outcome;
    std::vector<uint32_t> pixels(256);
    if (!good(device.getTexture(picture, pixels.data(), 1024))) return outcome;
    if (!good(device.getTime(query))) return outcome;
    if (!good(device.finish())) return outcome;
    outcome.finished = true;
    return outcome;
}

class Failure : public testing::TestWithParam<TracingEngine> {
protected:
    /// Opens a device with these settings and runs the scene; checks what holds whatever happens.
    Outcome run(const NullSettings& settings, bool careful) {
        messages.clear();
        const ScopedSettings scope(settings);
        Outcome outcome;
        {
            Device device =
                Device::create({.api = "null", .tracing = GetParam(), .message = [this](const Message& message) {
                                    messages.push_back(message.error);
                                }});
            control = NullControl::last();
            EXPECT_TRUE(device) << device.error().text();
            outcome = runScene(device, careful);
            is_lost = !device.check();
        }
        EXPECT_EQ(control->counters().objects, 0u);
        EXPECT_EQ(control->counters().bytes, 0u);
        for (const Error& finding : control->findings()) ADD_FAILURE() << finding.text();
        EXPECT_EQ(outcome.finished, !careful || !outcome.error);
        EXPECT_EQ(!outcome.error, messages.empty());
        // Every error has a line of this file: it is the caller's, not one of the SDK.
        if (outcome.error) {
            EXPECT_EQ(outcome.error.file(), "failure_test.cpp") << outcome.error.text();
            EXPECT_NE(outcome.error.line(), 0u);
        }
        return outcome;
    }
    bool wasTold(std::string_view id) {
        return std::ranges::any_of(messages, [&](const Error& message) { return message.id() == id; });
    }

    std::shared_ptr<NullControl> control;
    std::vector<Error> messages;
    bool is_lost = false;
};

TEST_P(Failure, TheSceneIsWell) {
    for (const bool careful : {true, false}) {
        const Outcome outcome = run({}, careful);
        EXPECT_TRUE(outcome.finished);
        EXPECT_THAT(outcome.error, IsOk());
        EXPECT_GT(control->counters().creations, 15u);
    }
}

TEST_P(Failure, EveryCreation) {
    for (const bool careful : {true, false}) {
        for (const bool mapped : {true, false}) {
            uint64_t n = 1;
            for (;; n++) {
                SCOPED_TRACE(n);
                const Outcome outcome = run({.mapped = mapped, .fail_creation = n}, careful);
                if (control->counters().creations < n) break;
                // Scratch memory and the software engine's heap make do with what is needed if there is no memory to
                // grow further.
                if (outcome.finished && messages.empty()) continue;
                EXPECT_THAT(outcome.error, HasErrorId("device.out_of_memory"));
                EXPECT_TRUE(wasTold("device.out_of_memory"));
                ASSERT_LT(n, 1000u);
            }
            EXPECT_GT(n, 15u);
        }
    }
}

TEST_P(Failure, EverySubmission) {
    for (const ErrorCode code : {ErrorCode::OutOfMemory, ErrorCode::DeviceLost}) {
        const char* id = code == ErrorCode::OutOfMemory ? "device.out_of_memory" : "device.lost";
        for (const bool careful : {true, false}) {
            uint64_t n = 1;
            for (;; n++) {
                SCOPED_TRACE(std::string(id) + " " + std::to_string(n));
                const Outcome outcome = run({.fail_submit = n, .fail_code = code}, careful);
                if (control->counters().submits < n) break;
                EXPECT_THAT(outcome.error, HasErrorId(id));
                EXPECT_TRUE(wasTold(id));
                EXPECT_EQ(is_lost, code == ErrorCode::DeviceLost);
                ASSERT_LT(n, 1000u);
            }
            EXPECT_GT(n, 5u);
        }
    }
}

TEST_P(Failure, AnyAmountOfMemory) {
    run({}, true);
    for (uint64_t memory = 64; memory < 32u << 20; memory += memory / 3) {
        SCOPED_TRACE(memory);
        const Outcome outcome = run({.memory = memory}, false);
        if (!outcome.error) return;
        EXPECT_THAT(outcome.error, HasErrorId("device.out_of_memory"));
    }
    ADD_FAILURE() << "the scene does not fit into 32 MiB";
}

TEST_P(Failure, EveryFeature) {
    for (uint32_t i = 0; i < FeatureCount; i++) {
        const auto feature = static_cast<Feature>(1ull << i);
        SCOPED_TRACE(toString(feature));
        const Outcome outcome = run({.missing = feature}, true);
        const bool needed =
            (feature == FeatureComputeTracing && GetParam() == TracingEngine::Driver) || feature == FeatureTimestamps;
        EXPECT_EQ(!outcome.finished, needed) << outcome.error.text();
        EXPECT_EQ(outcome.error.code(), needed ? ErrorCode::Unsupported : ErrorCode::None) << outcome.error.text();
    }
}

TEST_P(Failure, FewerQueues) {
    for (const bool compute : {true, false})
        for (const bool copy : {true, false}) EXPECT_TRUE(run({.queues = {true, compute, copy}}, true).finished);
}

INSTANTIATE_TEST_SUITE_P(Engines, Failure, testing::Values(TracingEngine::Driver, TracingEngine::Software),
                         [](const auto& test) { return std::string(toString(test.param)); });

}  // namespace
}  // namespace glint::test
