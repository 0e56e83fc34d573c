// What is the software engine's own: how it is chosen, where its structures lie, and what moves them.

#include "support/device_fixture.h"

#include <glint/geometry/primitives.h>

#include <array>
#include <cstdlib>

namespace glint::test {

namespace {

constexpr const char* source = R"(
layout(local_size_x = 64) in;
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1) writeonly buffer Distances { float distances[]; };
void main() {
    const uint i = gl_GlobalInvocationID.x;
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xff, vec3(0.0, 0.0, 10.0), 0.0,
                          vec3(vec2(i % 8u, i / 8u) / 8.0 - 0.5, -1.0), 100.0);
    while (rayQueryProceedEXT(query)) {}
    const bool hit = rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT;
    distances[i] = hit ? rayQueryGetIntersectionTEXT(query, true) : -1.0;
})";
constexpr uint32_t rays = 64;

class TracingEngineTest : public testing::TestWithParam<std::string> {
protected:
    void SetUp() override {
        device = Device::create({.api = GetParam(),
                                 .required = FeatureComputeTracing,
                                 .tracing = TracingEngine::Software,
                                 .validation = DeviceDesc::Validation::On,
                                 .message = log.callback()});
        ASSERT_THAT(device, IsOk());
        kernel = device.createKernel("trace");
        kernel.createShaderGLSL(source);
        ASSERT_THAT(kernel.create(), IsOk());
        distances = device.createBuffer(Buffer::FlagStorage, rays * sizeof(float), "distances");
    }
    void TearDown() override { log.expectNone(); }

    Tracing sphere(float radius, uint32_t level, Tracing::Flags flags = Tracing::FlagFastTrace) {
        const Mesh mesh = createSphere(radius, level);
        Tracing tracing = device.createTracing("sphere");
        tracing.addVertexBuffer(static_cast<uint32_t>(mesh.positions.size()), FormatRGBf32, 12,
                                device.createBuffer(Buffer::FlagTracing, std::span(mesh.positions)));
        tracing.addIndexBuffer(static_cast<uint32_t>(mesh.indices.size()), FormatRu32,
                               device.createBuffer(Buffer::FlagTracing, std::span(mesh.indices)));
        EXPECT_THAT(tracing.create(Tracing::TypeTriangle, flags), IsOk());
        return tracing;
    }
    Status trace(const Tracing& top) {
        Compute compute = device.createCompute();
        compute.setKernel(kernel);
        compute.setTracing(0, top);
        compute.setStorageBuffer(0, distances);
        compute.dispatch(rays);
        return device.submit(compute);
    }
    std::vector<float> traced(const Tracing& top) {
        EXPECT_THAT(trace(top), IsOk());
        return *device.read<float>(distances);
    }

    MessageLog log;
    Device device;
    Kernel kernel;
    Buffer distances;
};

TEST_P(TracingEngineTest, IsNamedWithItsReason) {
    EXPECT_EQ(device.getFeatures().tracingEngine, TracingEngine::Software);
    EXPECT_THAT(device.getInfo().tracing, testing::AllOf(testing::HasSubstr("software"), testing::HasSubstr("asked")));
    EXPECT_EQ(device.getFeatures().traversalEngine, TracingEngine::Software);
    EXPECT_EQ(device.getInfo().traversal, "software (asked for)");
}

TEST_P(TracingEngineTest, IsChosenByTheEnvironment) {
    const char* const before = std::getenv("GLINT_TRACING");
    const std::string kept = before ? before : "";
    const auto open = [&](const char* engine) {
        setenv("GLINT_TRACING", engine, 1);
        return Device::create({.api = GetParam(), .message = [](const Message&) {}});
    };
    const Device software = open("software");
    const Device driver = open("driver");
    const Device wrong = open("hardware");
    before ? setenv("GLINT_TRACING", kept.c_str(), 1) : unsetenv("GLINT_TRACING");
    EXPECT_EQ(software.getFeatures().tracingEngine, TracingEngine::Software);
    EXPECT_EQ(software.getFeatures().traversalEngine, TracingEngine::Software);
    EXPECT_EQ(driver.getFeatures().tracingEngine, TracingEngine::Driver);
    EXPECT_EQ(driver.getFeatures().traversalEngine, TracingEngine::Driver);
    EXPECT_THAT(wrong, HasErrorId("device.tracing"));
    EXPECT_THAT(wrong.error().message(), testing::HasSubstr("'hardware'"));
}

TEST_P(TracingEngineTest, TopLevelsOverWhatWasBuiltAnewAreRefused) {
    const Tracing bottom = sphere(1.0f, 2);
    const Tracing top = device.createTracing({Tracing::Instance{.tracing = &bottom}});
    ASSERT_THAT(device.buildTracings({bottom, top}), IsOk());
    EXPECT_THAT(trace(top), IsOk());
    ASSERT_THAT(device.buildTracings({bottom}), IsOk());
    EXPECT_THAT(trace(top), HasErrorId("tracing.moved"));
    const std::vector<Message> told = log.take();
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(told[0].error.id(), "tracing.moved");
    ASSERT_THAT(device.buildTracings({top}), IsOk());
    EXPECT_THAT(trace(top), IsOk());
}

TEST_P(TracingEngineTest, TheHeapGrowsAroundWhatItHolds) {
    const Tracing small = sphere(1.0f, 2);
    const Tracing top = device.createTracing({Tracing::Instance{.tracing = &small}});
    ASSERT_THAT(device.buildTracings({small, top}), IsOk());
    const std::vector<float> before = traced(top);
    std::vector<Tracing> others;
    for (uint32_t i = 0; i < 6; i++) {
        // Some that the host builds, some that a list does.
        const bool listed = i % 2 == 1;
        others.push_back(sphere(2.0f, 5, listed ? Tracing::FlagFastBuild : Tracing::FlagFastTrace));
        if (listed)
            device.buildTracing(others.back());
        else
            ASSERT_THAT(device.buildTracings({others.back()}), IsOk());
        // The lists refer to structures by place only when they are played.
        ASSERT_THAT(trace(top), IsOk());
        if (GetParam() != "null") { ASSERT_EQ(traced(top), before); }
    }
    for (const Tracing& other : others) {
        const Tracing over = device.createTracing({Tracing::Instance{.tracing = &other}});
        ASSERT_THAT(device.buildTracings({over}), IsOk());
        if (GetParam() != "null") { EXPECT_NEAR(traced(over)[36], 8.0f, 1e-2f); }
    }
}

TEST_P(TracingEngineTest, AnOddNumberOfShortIndices) {
    const std::array<Vector3f, 3> corners = {Vector3f(-50, -50, 0), Vector3f(50, -50, 0), Vector3f(0, 80, 0)};
    const std::array<uint16_t, 3> indices = {0, 1, 2};
    Tracing bottom = device.createTracing("triangle");
    bottom.addVertexBuffer(3, FormatRGBf32, 12, device.createBuffer(Buffer::FlagTracing, std::span(corners)));
    bottom.addIndexBuffer(3, FormatRu16, device.createBuffer(Buffer::FlagTracing, std::span(indices)));
    ASSERT_THAT(bottom.create(Tracing::TypeTriangle, Tracing::FlagFastBuild), IsOk());
    const Tracing top = device.createTracing({Tracing::Instance{.tracing = &bottom}});
    device.buildTracing(bottom);
    device.buildTracing(top);
    const std::vector<float> found = traced(top);
    if (GetParam() != "null") { EXPECT_EQ(found, std::vector<float>(rays, 10.0f)); }
}

TEST_P(TracingEngineTest, RangesAreUsedAgain) {
    // How many of a round's submissions are under way at once, each with 256 KiB for its uploads, is a matter of
    // timing. Fifteen structures that stayed would take 300 KiB each.
    constexpr uint64_t under_way = 4 * (256 << 10);
    uint64_t bytes = 0;
    for (uint32_t i = 0; i < 20; i++) {
        const Tracing bottom = sphere(1.0f, 4);
        const Tracing top = device.createTracing({Tracing::Instance{.tracing = &bottom}});
        ASSERT_THAT(device.buildTracings({bottom, top}), IsOk());
        ASSERT_THAT(trace(top), IsOk());
        ASSERT_THAT(device.finish(), IsOk());
        if (i == 4) bytes = device.getMemory().bytes;
        if (i > 4) { EXPECT_LE(device.getMemory().bytes, bytes + under_way); }
    }
}

TEST_P(TracingEngineTest, AHeapHasAnEnd) {
    Tracing top = device.createTracing("too large");
    top.setInstances(1u << 24);
    if (device.getFeatures().maxBufferSize > 4ull << 30)
        GTEST_SKIP() << "the largest top level, of 4 GiB, fits into this device's heap: buffers of "
                     << device.getFeatures().maxBufferSize << " bytes";
    EXPECT_THAT(top.create(Tracing::TypeInstance), HasErrorId("tracing.heap"));
    const std::vector<Message> told = log.take();
    ASSERT_EQ(told.size(), 1u);
    EXPECT_THAT(told[0].error.message(), testing::HasSubstr("the limit is"));
}

TEST_P(TracingEngineTest, ProgramsThatMayTraceRunBeforeAnythingIsBuilt) {
    std::string text = source;
    text.replace(text.find("uniform accelerationStructureEXT scene;"), 39, "uniform Where { uvec2 scene; };");
    text.replace(text.find("query, scene"), 12, "query, accelerationStructureEXT(scene)");
    text.replace(text.find("rayQueryEXT query;"), 18,
                 "distances[i] = -2.0; if (scene == uvec2(0u)) return; rayQueryEXT query;");
    Kernel careful = device.createKernel("careful");
    careful.createShaderGLSL(text.c_str());
    ASSERT_THAT(careful.create(), IsOk());
    Compute compute = device.createCompute();
    compute.setKernel(careful);
    compute.setUniform(0, std::array<uint32_t, 4>{});
    compute.setStorageBuffer(0, distances);
    compute.dispatch(rays);
    ASSERT_THAT(device.submit(compute), IsOk());
    const Expected<std::vector<float>> found = device.read<float>(distances);
    ASSERT_TRUE(found);
    if (GetParam() != "null") { EXPECT_EQ(*found, std::vector<float>(rays, -2.0f)); }
}

INSTANTIATE_TEST_SUITE_P(Apis, TracingEngineTest, testing::Values("null", "vulkan"),
                         [](const auto& test) { return test.param; });

}  // namespace

}  // namespace glint::test
