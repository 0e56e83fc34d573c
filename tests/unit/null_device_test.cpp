// The null device through the public interface: memory works, queues can be held back, and failures come on request.

#include "support/matchers.h"

#include <glint/device/detail/device_object.h>
#include <glint/device/device.h>
#include <platform/null/null.h>
#include <platform/null/null_control.h>

#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <numeric>
#include <optional>
#include <thread>

namespace glint::test {
namespace {

using null::NullControl;
using null::NullSettings;
using null::ScopedSettings;

constexpr const char* trace_kernel = R"(
layout(local_size_x = 8) in;
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1) buffer To { uint to[]; };
void main() {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, 0u, 0xffu, vec3(0.0), 0.0, vec3(1.0), 1.0);
    to[gl_GlobalInvocationID.x] = rayQueryProceedEXT(query) ? 1u : 0u;
})";

class NullDevice : public testing::Test {
protected:
    void open(const NullSettings& settings = {}, FeatureMask required = 0,
              TracingEngine tracing = TracingEngine::Driver) {
        device = {};
        const ScopedSettings scope(settings);
        device = Device::create(
            {.api = "null", .required = required, .tracing = tracing, .message = [this](const Message& message) {
                 if (expected == message.error.id())
                     told++;
                 else
                     ADD_FAILURE() << message.error.text();
             }});
        if (device) control = NullControl::last();
    }
    void SetUp() override { open(); }
    void TearDown() override {
        device = {};
        if (!control) return;
        EXPECT_EQ(control->counters().objects, 0u);
        EXPECT_EQ(control->counters().bytes, 0u);
        for (const Error& finding : control->findings()) ADD_FAILURE() << finding.text();
    }

    std::vector<uint32_t> iota(size_t count) {
        std::vector<uint32_t> values(count);
        std::iota(values.begin(), values.end(), 1u);
        return values;
    }
    template <class T>
    std::vector<T> readTexture(const Texture& texture, const Slice& slice = {}) {
        std::vector<T> texels(texture.getDataSize(slice.mip) / sizeof(T));
        EXPECT_THAT(device.getTexture(texture, texels.data(), texels.size() * sizeof(T), slice), IsOk());
        return texels;
    }

    std::string_view expected;
    std::atomic<int> told = 0;
    std::shared_ptr<NullControl> control;
    Device device;
};

TEST_F(NullDevice, IsAnAdapterOfItsOwn) {
    const auto adapters = Device::adapters("null");
    ASSERT_THAT(adapters, IsOk());
    ASSERT_EQ(adapters->size(), 1u);
    EXPECT_EQ(adapters->front().name, "null");
    EXPECT_EQ(device.getInfo().api, "null");
    EXPECT_TRUE(device.getFeatures().has(FeatureAll));
    for (const Queue queue : {Queue::Main, Queue::Compute, Queue::Copy}) EXPECT_TRUE(device.hasQueue(queue));
    EXPECT_TRUE(device.hasTexture(FormatRGBAu8n, Texture::FlagTarget | Texture::FlagSurface));
    EXPECT_FALSE(device.hasTexture(FormatDf32, Texture::FlagSurface));
}

TEST_F(NullDevice, LacksWhatItIsTold) {
    expected = "device.unsupported";
    open({.missing = FeatureComputeTracing | FeatureAnisotropy}, FeatureComputeTracing);
    EXPECT_THAT(device, HasErrorId("device.unsupported"));
    EXPECT_THAT(device.error().message(), testing::HasSubstr("computeTracing"));
    open({.missing = FeatureComputeTracing, .queues = {true, false, true}});
    ASSERT_TRUE(device);
    EXPECT_FALSE(device.getFeatures().computeTracing);
    EXPECT_TRUE(device.getFeatures().rayTracing);
    EXPECT_FALSE(device.hasQueue(Queue::Compute));
    // What the driver lacks, Glint's own engine offers where it may.
    for (const TracingEngine engine : {TracingEngine::Auto, TracingEngine::Software}) {
        open({.missing = FeatureComputeTracing}, FeatureComputeTracing, engine);
        ASSERT_TRUE(device);
        EXPECT_TRUE(device.getFeatures().computeTracing);
        EXPECT_EQ(device.getFeatures().tracingEngine, TracingEngine::Software);
    }
    open({}, FeatureComputeTracing, TracingEngine::Auto);
    ASSERT_TRUE(device);
    EXPECT_EQ(device.getFeatures().tracingEngine, TracingEngine::Driver);
    EXPECT_THAT(device.getInfo().tracing, testing::HasSubstr("driver"));
    // Also where that is all that was asked for.
    const Device queries = Device::create(
        {.api = "null", .required = FeatureComputeTracing, .optional = 0, .tracing = TracingEngine::Auto});
    ASSERT_TRUE(queries);
    EXPECT_EQ(queries.getFeatures().tracingEngine, TracingEngine::Driver);
    EXPECT_TRUE(queries.getFeatures().computeTracing);
    const Device other = Device::create({.api = "null", .adapter = "llvmpipe", .message = [](const Message&) {}});
    EXPECT_THAT(other, HasErrorId("device.no_adapter"));
}

TEST_F(NullDevice, BuffersKeepWhatTheyAreGiven) {
    for (const bool mapped : {false, true}) {
        open({.mapped = mapped});
        const std::vector<uint32_t> values = iota(1000);
        const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values), "values");
        ASSERT_TRUE(buffer);
        Expected<std::vector<uint32_t>> read = device.read<uint32_t>(buffer);
        ASSERT_THAT(read, IsOk());
        EXPECT_EQ(*read, values);

        const Buffer copy = device.createBuffer(Buffer::FlagStorage, 4000, "copy");
        Compute compute = device.createCompute();
        compute.clearBuffer(copy, 7);
        compute.copyBuffer(copy, 8, buffer, 4, 16);
        ASSERT_THAT(device.submit(compute), IsOk());
        read = device.read<uint32_t>(copy, 0, 7);
        ASSERT_THAT(read, IsOk());
        EXPECT_THAT(*read, testing::ElementsAre(7, 7, 2, 3, 4, 5, 7));
    }
}

TEST_F(NullDevice, LargeUploadsAndMappedBuffers) {
    const std::vector<uint32_t> values = iota(1u << 20);
    const Buffer large = device.createBuffer(Buffer::FlagStorage, std::span(values), "large");
    const Expected<std::vector<uint32_t>> read = device.read<uint32_t>(large);
    ASSERT_THAT(read, IsOk());
    EXPECT_EQ(*read, values);

    const Buffer mapped = device.createBuffer(Buffer::FlagStorage | Buffer::FlagMapped, 64, "mapped");
    ASSERT_TRUE(mapped.map());
    EXPECT_EQ(reinterpret_cast<uintptr_t>(mapped.map()) % 64, 0u);
    device.clearBuffer(mapped, 3);
    ASSERT_THAT(device.finish(), IsOk());
    EXPECT_EQ(*static_cast<uint32_t*>(mapped.map()), 3u);
    EXPECT_FALSE(large.map());
}

TEST_F(NullDevice, TexturesKeepWhatTheyAreGiven) {
    const std::vector<uint32_t> values = iota(8 * 4);
    const Texture texture = device.createTexture2D(FormatRGBAu8n, 8, 4, Texture::FlagMipmaps, "texture");
    ASSERT_TRUE(texture);
    device.setTexture(texture, values.data(), 128);
    EXPECT_EQ(readTexture<uint32_t>(texture), values);

    // Dispatches do nothing, but what they would have written is copied.
    device.createMipmaps(texture);
    EXPECT_EQ(readTexture<uint32_t>(texture, {1, 1, 0, 1}), std::vector<uint32_t>(8));
    const std::vector<uint32_t> level = {1, 3, 5, 7, 17, 19, 21, 23};
    device.setTexture(texture, level.data(), 32, {1, 1, 0, 1});
    EXPECT_EQ(readTexture<uint32_t>(texture, {1, 1, 0, 1}), level);

    const Texture other = device.createTexture2D(FormatRu32, 8, 4, 0, "other");
    device.clearTexture(other, {9, 0, 0, 0});
    device.copyTexture(other, {}, texture, {0, 1, 0, 1}, {2, 1, 0, 3, 2, 1}, 4, 2);
    EXPECT_THAT(readTexture<uint32_t>(other), testing::ElementsAre(9, 9, 9, 9, 9, 9, 9, 9,     //
                                                                   9, 9, 9, 9, 9, 9, 9, 9,     //
                                                                   9, 9, 9, 9, 11, 12, 13, 9,  //
                                                                   9, 9, 9, 9, 19, 20, 21, 9));
}

TEST_F(NullDevice, RegionsOfCompressedAndDeepTextures) {
    const std::vector<uint64_t> blocks = {1, 2, 3, 4, 5, 6};
    const Texture compressed = device.createTexture2D(FormatBC1RGBAu8n, 10, 7, 0, "compressed");
    ASSERT_TRUE(compressed);
    device.setTexture(compressed, blocks.data(), 48);
    const uint64_t last = 7;
    device.setTexture(compressed, &last, 8, {}, {8, 4, 0, 2, 3, 1});
    EXPECT_THAT(readTexture<uint64_t>(compressed), testing::ElementsAre(1, 2, 3, 4, 5, 7));

    const Texture volume = device.createTexture3D(FormatRu8, 2, 2, 3, 0, "volume");
    const std::vector<uint8_t> bytes = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
    device.setTexture(volume, bytes.data(), 12);
    const uint8_t two[] = {20, 21};
    device.setTexture(volume, two, 2, {}, {1, 1, 1, 1, 1, 2});
    EXPECT_THAT(readTexture<uint8_t>(volume), testing::ElementsAre(1, 2, 3, 4, 5, 6, 7, 20, 9, 10, 11, 21));
}

TEST_F(NullDevice, ClearsByFormat) {
    const auto cleared = [&]<class T>(Format format, const Color& color, T) {
        const Texture texture = device.createTexture2D(format, 3, 2, 0, "cleared");
        EXPECT_TRUE(texture) << toString(format);
        device.clearTexture(texture, color);
        const std::vector<T> texels = readTexture<T>(texture);
        EXPECT_EQ(texels, std::vector<T>(texels.size(), texels.front()));
        return texels.front();
    };
    const Color color = {1.0f, 0.5f, 0.0f, -1.0f};
    EXPECT_EQ(cleared(FormatRGBAu8n, color, uint32_t()), 0x000080ffu);
    EXPECT_EQ(cleared(FormatBGRAu8n, color, uint32_t()), 0x00ff8000u);
    EXPECT_EQ(cleared(FormatRGBAu8ns, {0.5f, 1, 0, 0.5f}, uint32_t()), 0x8000ffbcu);
    EXPECT_EQ(cleared(FormatRGBAi8n, color, uint32_t()), 0x8100407fu);
    EXPECT_EQ(cleared(FormatRGBAf16, color, uint64_t()), 0xbc00000038003c00u);
    EXPECT_EQ(cleared(FormatRf32, color, float()), 1.0f);
    EXPECT_EQ(cleared(FormatRGi16, {-2, 300, 0, 0}, uint32_t()), 0x012cfffeu);
    EXPECT_EQ(cleared(FormatRGu16, {2, 300, 0, 0}, uint32_t()), 0x012c0002u);
    EXPECT_EQ(cleared(FormatRGBu10Au2n, {1, 0, 1, 1}, uint32_t()), 0xfff003ffu);
    EXPECT_EQ(cleared(FormatDf32, {0.25f, 0, 0, 0}, float()), 0.25f);
    EXPECT_EQ(cleared(FormatDu16n, {1, 0, 0, 0}, uint16_t()), 0xffff);
}

TEST_F(NullDevice, TargetsAreClearedAndResolved) {
    const Texture color =
        device.createTexture2D(FormatRGBAu8n, 4, 4, Texture::FlagTarget | Texture::FlagMultisample4, "color");
    const Texture resolved = device.createTexture2D(FormatRGBAu8n, 4, 4, Texture::FlagTarget, "resolved");
    Target target = device.createTarget(color);
    target.setColorResolve(0, resolved);
    target.setClearColor({1, 1, 0, 0});
    Command command = device.createCommand(target);
    ASSERT_THAT(device.submit(command), IsOk());
    EXPECT_EQ(readTexture<uint32_t>(resolved), std::vector<uint32_t>(16, 0x0000ffffu));
}

TEST_F(NullDevice, CountsWhatItPlays) {
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, 64, "buffer");
    const null::NullCounters before = control->counters();
    Kernel kernel = device.createKernel("kernel");
    kernel.createShaderGLSL("layout(local_size_x = 8) in; layout(binding = 0) buffer B { uint b[]; };"
                            "void main() { b[gl_GlobalInvocationID.x] += 1u; }");
    ASSERT_THAT(kernel.create(), IsOk());
    Compute compute = device.createCompute();
    compute.setKernel(kernel);
    compute.setStorageBuffer(0, buffer);
    for (int i = 0; i < 3; i++) compute.dispatch(16);
    ASSERT_THAT(device.submit(compute), IsOk());
    const null::NullCounters after = control->counters();
    EXPECT_EQ(after.creations, before.creations + 1);
    EXPECT_EQ(after.objects, before.objects + 1);
    EXPECT_EQ(after.submits, before.submits + 1);
    EXPECT_EQ(after.dispatches, before.dispatches + 3);
    EXPECT_EQ(after.barriers, before.barriers + 2);
    EXPECT_EQ(device.getMemory().bytes, after.bytes);
}

TEST_F(NullDevice, QueriesCountAndTime) {
    const Query time = device.createQuery(Query::TypeTime, "time");
    const Buffer buffer = device.createBuffer(Buffer::FlagNone, 64, "buffer");
    Compute compute = device.createCompute();
    compute.beginQuery(time);
    compute.clearBuffer(buffer);
    compute.endQuery(time);
    ASSERT_THAT(device.submit(compute), IsOk());
    const Expected<uint64_t> nanoseconds = device.getTime(time);
    ASSERT_THAT(nanoseconds, IsOk());
    EXPECT_EQ(*nanoseconds, 2000u);
}

TEST_F(NullDevice, StructuresAreBuiltCompactedAndFollowed) {
    const Buffer vertices = device.createBuffer(Buffer::FlagTracing, 36 * 100, "vertices");
    Tracing bottom = device.createTracing("bottom");
    bottom.addVertexBuffer(300, FormatRGBf32, 12, vertices);
    ASSERT_THAT(bottom.create(Tracing::TypeTriangle, Tracing::FlagCompact), IsOk());
    const Tracing top = device.createTracing({Tracing::Instance{.tracing = &bottom}, Tracing::Instance{}});
    ASSERT_TRUE(top);
    const uint64_t memory = bottom.getMemory();
    EXPECT_GT(bottom.getBuildSize(), 0u);
    ASSERT_THAT(device.buildTracings({bottom, top}, Tracing::FlagCompact), IsOk());
    EXPECT_LT(bottom.getMemory(), memory);

    Kernel kernel = device.createKernel("kernel");
    kernel.createShaderGLSL(trace_kernel);
    ASSERT_THAT(kernel.create(), IsOk());
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, 64, "buffer");
    Compute compute = device.createCompute();
    compute.setKernel(kernel);
    compute.setTracing(0, top);
    compute.setStorageBuffer(0, buffer);
    compute.dispatch(16);
    ASSERT_THAT(device.submit(compute), IsOk());
    EXPECT_EQ(control->counters().builds, 2u);
}

TEST_F(NullDevice, CompactedStructuresCanBeUpdatedButNotBuiltAgain) {
    const Buffer vertices = device.createBuffer(Buffer::FlagTracing, 36 * 100, "vertices");
    Tracing tracing = device.createTracing("tracing");
    tracing.addVertexBuffer(300, FormatRGBf32, 12, vertices);
    ASSERT_THAT(tracing.create(Tracing::TypeTriangle, Tracing::FlagCompact | Tracing::FlagUpdate), IsOk());
    ASSERT_THAT(device.buildTracings({tracing}, Tracing::FlagCompact), IsOk());
    device.updateTracing(tracing);
    ASSERT_THAT(device.finish(), IsOk());
    expected = "tracing.compacted";
    device.buildTracing(tracing);
    EXPECT_THAT(device.finish(), HasErrorId("tracing.compacted"));
}

TEST_F(NullDevice, TracesFollowWhatWasBuiltNotWhatWasSetSince) {
    const Buffer vertices = device.createBuffer(Buffer::FlagTracing, 36, "vertices");
    const auto makeBottom = [&] {
        Tracing bottom = device.createTracing("bottom");
        bottom.addVertexBuffer(3, FormatRGBf32, 12, vertices);
        EXPECT_THAT(bottom.create(Tracing::TypeTriangle), IsOk());
        device.buildTracing(bottom);
        return bottom;
    };
    Kernel kernel = device.createKernel("kernel");
    kernel.createShaderGLSL(trace_kernel);
    ASSERT_THAT(kernel.create(), IsOk());
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, 64, "buffer");
    const auto trace = [&](const Tracing& top) {
        Compute compute = device.createCompute();
        compute.setKernel(kernel);
        compute.setTracing(0, top);
        compute.setStorageBuffer(0, buffer);
        compute.dispatch(16);
        EXPECT_THAT(device.submit(compute), IsOk());
    };

    Tracing first = makeBottom();
    const Tracing second = makeBottom();
    const Tracing top = device.createTracing({Tracing::Instance{.tracing = &first}});
    device.buildTracing(top);
    trace(top);
    const Tracing::Instance next = {.tracing = &second};
    device.setTracing(top, {&next, 1});
    first = {};
    trace(top);
    device.buildTracing(top);
    trace(top);
    ASSERT_THAT(device.finish(), IsOk());
}

// In the software engine builds are dozens of dispatches, each after the one before.
TEST_F(NullDevice, BuildsBesideEachOtherShareBarriers) {
    open({}, FeatureComputeTracing, TracingEngine::Software);
    const Buffer vertices = device.createBuffer(Buffer::FlagTracing, 36 * 100, "vertices");
    std::vector<Tracing> bottoms(40);
    for (Tracing& bottom : bottoms) {
        bottom = device.createTracing("bottom");
        bottom.addVertexBuffer(300, FormatRGBf32, 12, vertices);
        ASSERT_THAT(bottom.create(Tracing::TypeTriangle, Tracing::FlagFastBuild | Tracing::FlagUpdate), IsOk());
    }
    const uint64_t alignment = device.getFeatures().scratchAlignment;
    const uint64_t part = (bottoms[0].getBuildSize() + alignment - 1) / alignment * alignment;
    const Buffer scratch = device.createBuffer(Buffer::FlagScratch, part * bottoms.size(), "scratch");
    struct Counts {
        uint64_t dispatches, barriers;
        bool operator==(const Counts&) const = default;
    };
    // `distance`: between the parts of scratch memory; the device's without.
    const auto count = [&](size_t structures, bool update, std::optional<uint64_t> distance) {
        const null::NullCounters before = control->counters();
        Compute list = device.createCompute();
        for (size_t i = 0; i < structures; i++) {
            const Tracing& bottom = bottoms[i];
            if (!distance)
                update ? list.updateTracing(bottom) : list.buildTracing(bottom);
            else
                update ? list.updateTracing(bottom, scratch, i * *distance)
                       : list.buildTracing(bottom, scratch, i * *distance);
        }
        EXPECT_THAT(device.submit(list), IsOk());
        const null::NullCounters after = control->counters();
        return Counts{after.dispatches - before.dispatches, after.barriers - before.barriers};
    };
    for (const bool update : {false, true}) {
        SCOPED_TRACE(update);
        count(40, update, {});  // from here on something is always before
        const Counts one = count(1, update, 0);
        EXPECT_GE(one.dispatches, 4u);
        EXPECT_EQ(one.barriers, one.dispatches);
        EXPECT_EQ(count(40, update, {}), Counts(40 * one.dispatches, one.barriers));
        EXPECT_EQ(count(40, update, part), Counts(40 * one.dispatches, one.barriers));
        EXPECT_EQ(count(40, update, 0), Counts(40 * one.dispatches, 40 * one.barriers));
    }
}

// A structure that the host has built is uploaded by a copy where the host does not see the device's memory. If that
// fails, at whichever step, the structure counts as unbuilt, and can be built again.
TEST_F(NullDevice, StructuresStayWhereASubmissionWritesThem) {
    open({}, FeatureComputeTracing, TracingEngine::Software);
    const Buffer vertices = device.createBuffer(Buffer::FlagTracing, 36 * 100, "vertices");
    Tracing bottom = device.createTracing("bottom");
    bottom.addVertexBuffer(300, FormatRGBf32, 12, vertices);
    ASSERT_THAT(bottom.create(Tracing::TypeTriangle, Tracing::FlagFastTrace), IsOk());
    // The first build on the device moves it to where any tree fits, the others do not.
    const auto& object = static_cast<const detail::TracingObject&>(*bottom.object());
    const uint64_t moves = object.moves;
    Compute first = device.createCompute();
    first.buildTracing(bottom);
    first.buildTracing(bottom);
    Compute second = device.createCompute();
    second.buildTracing(bottom);
    ASSERT_THAT(device.submit({first, second}), IsOk());
    EXPECT_EQ(object.moves, moves + 1);
    EXPECT_THAT(device.finish(), IsOk());
}

TEST_F(NullDevice, StructuresWhoseUploadFailsAreUnbuilt) {
    open({.mapped = false}, FeatureComputeTracing, TracingEngine::Software);
    const Buffer vertices = device.createBuffer(Buffer::FlagTracing, 36 * 100, "vertices");
    Tracing bottom = device.createTracing("bottom");
    bottom.addVertexBuffer(300, FormatRGBf32, 12, vertices);
    ASSERT_THAT(bottom.create(Tracing::TypeTriangle, Tracing::FlagUpdate), IsOk());
    const auto steps = [&](auto member) {
        const auto before = control->counters().*member;
        EXPECT_THAT(device.buildTracings({bottom}), IsOk());
        return control->counters().*member - before;
    };
    // The vertices are read back first, and the copy to the heap is last.
    ASSERT_EQ(steps(&null::NullCounters::submits), 2u);
    const uint64_t creations = steps(&null::NullCounters::creations);
    ASSERT_GE(creations, 2u);
    device.updateTracing(bottom);
    ASSERT_THAT(device.finish(), IsOk());
    const null::NullCounters before = control->counters();
    const auto fails = [&](const char* step) {
        SCOPED_TRACE(step);
        expected = "device.out_of_memory";
        const Status status = device.buildTracings({bottom});
        EXPECT_THAT(status, HasErrorId("device.out_of_memory"));
        EXPECT_EQ(status.error().file(), "null_device_test.cpp");
        expected = "tracing.unbuilt";
        Compute compute = device.createCompute();
        compute.updateTracing(bottom);
        const Status unbuilt = device.submit(compute);
        EXPECT_THAT(unbuilt, HasErrorId("tracing.unbuilt"));
        EXPECT_THAT(unbuilt.error().message(), testing::HasSubstr("'bottom'"));
        EXPECT_EQ(told, 2);
        expected = {};
        told = 0;
        EXPECT_THAT(device.buildTracings({bottom}), IsOk());
        device.updateTracing(bottom);
        EXPECT_THAT(device.finish(), IsOk());
        EXPECT_EQ(control->counters().objects, before.objects);
        EXPECT_EQ(control->counters().bytes, before.bytes);
    };
    // More often than the heap has room for structures that nobody gives back.
    const uint64_t rounds = (1u << 20) / bottom.getMemory() + 1;
    for (uint64_t i = 0; i < rounds; i++) {
        control->failSubmit(2, ErrorCode::OutOfMemory);
        fails("the submission of the copy");
        control->failCreation(creations);
        fails("the memory that it copies from");
    }
}

// Draws and tables.

TEST_F(NullDevice, CountsOfDrawsAreRead) {
    const std::array<uint32_t, 3> counts = {2, 9, 0};
    const Buffer count = device.createBuffer(Buffer::FlagIndirect, counts.data(), sizeof(counts), "count");
    const Buffer arguments = device.createBuffer(Buffer::FlagIndirect, 256, "arguments");
    Pipeline pipeline = device.createPipeline("pipeline");
    pipeline.createShaderGLSL(Shader::TypeVertex, "void main() { gl_Position = vec4(0.0); }");
    pipeline.createShaderGLSL(Shader::TypeFragment, "layout(location = 0) out vec4 c; void main() { c = vec4(1.0); }");
    pipeline.setColorFormat(FormatRGBAu8n);
    ASSERT_THAT(pipeline.create(), IsOk());
    const Target target = device.createTarget(device.createTexture2D(FormatRGBAu8n, 8, 8, Texture::FlagTarget));
    const auto drawn = [&](uint64_t offset) {
        const uint64_t before = control->counters().draws;
        Command list = device.createCommand(target);
        list.setPipeline(pipeline);
        list.drawArraysIndirect(arguments, 0, count, offset, 5);
        EXPECT_THAT(device.submit(list), IsOk());
        return control->counters().draws - before;
    };
    EXPECT_EQ(drawn(0), 2u);
    EXPECT_EQ(drawn(4), 5u);
    EXPECT_EQ(drawn(8), 0u);
}

TEST_F(NullDevice, TargetsOfManyLayersAreRefused) {
    const uint32_t limit = device.getFeatures().maxTargetLayers;
    ASSERT_LT(limit, device.getFeatures().maxTextureLayers);
    const Texture layers = device.createTexture(
        {.format = FormatRGBAu8n, .width = 1, .height = 1, .layers = limit + 1, .flags = Texture::FlagTarget},
        "layers");
    Target target = device.createTarget();
    target.setColorTexture(0, layers, {.layer = 1});
    EXPECT_THAT(device.submit(device.createCommand(target)), IsOk());
    target.setColorTexture(0, layers);
    expected = "target.layers";
    EXPECT_THAT(device.submit(device.createCommand(target)), HasErrorId("target.layers"));
}

TEST_F(NullDevice, TablesKeepWhatListsUnderWayRead) {
    Kernel kernel = device.createKernel("kernel");
    kernel.createShaderGLSL(R"(
        layout(local_size_x = 1) in;
        layout(set = 0, binding = 0) uniform texture2D textures[];
        layout(set = 1, binding = 0) buffer Part { float value; } parts[];
        void main() { parts[0].value = texelFetch(textures[1], ivec2(0), 0).x; })");
    ASSERT_THAT(kernel.create(), IsOk());
    const null::NullCounters before = control->counters();
    control->hold(Queue::Main);
    {
        TextureTable textures = device.createTextureTable(4, "textures");
        BufferTable parts = device.createBufferTable(2, "parts");
        for (uint32_t round = 0; round < 3; round++) {
            textures.set(1, device.createTexture2D(FormatRGBAu8n, 8, 8, 0, "picture"));
            parts.set(0, device.createBuffer(Buffer::FlagStorage, 64, "part"));
            Compute list = device.createCompute();
            list.setKernel(kernel);
            list.setTextureTable(0, textures);
            list.setBufferTable(1, parts);
            list.dispatch(1);
            EXPECT_THAT(device.submit(list), IsOk());
        }
    }
    // Three of each kind of contents with a texture or a buffer each; what is deleted too early is a finding.
    EXPECT_EQ(control->counters().objects, before.objects + 12);
    control->release(Queue::Main);
    EXPECT_THAT(device.finish(), IsOk());
    EXPECT_EQ(control->counters().objects, before.objects);
}

TEST_F(NullDevice, TablesThatCannotBeCopiedFail) {
    const null::NullCounters before = control->counters();
    {
        TextureTable table = device.createTextureTable(4, "textures");
        Compute list = device.createCompute();
        list.setTextureTable(0, table);
        control->failCreation(1);
        expected = "device.out_of_memory";
        table.set(2, Texture());  // a list has seen the contents
        EXPECT_EQ(table.error().id(), "device.out_of_memory");
        EXPECT_EQ(told, 1);
        control->failCreation(1);
        EXPECT_EQ(device.createBufferTable(4).error().id(), "device.out_of_memory");
    }
    EXPECT_EQ(control->counters().objects, before.objects);
}

// Time.

TEST_F(NullDevice, HeldQueuesDoNotFinish) {
    const Buffer buffer = device.createBuffer(Buffer::FlagNone, 64, "buffer");
    ASSERT_THAT(device.finish(), IsOk());
    control->hold(Queue::Main);
    Fence fence = device.createFence("fence");
    EXPECT_TRUE(fence.isSignaled());
    Compute compute = device.createCompute();
    compute.clearBuffer(buffer);
    ASSERT_THAT(device.submit(compute, fence), IsOk());
    EXPECT_FALSE(fence.isSignaled());
    expected = "fence.timeout";
    EXPECT_THAT(fence.wait(1000), HasErrorId("fence.timeout"));

    std::thread later([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        control->release(Queue::Main);
    });
    EXPECT_THAT(fence.wait(), IsOk());
    EXPECT_TRUE(fence.isSignaled());
    later.join();
}

TEST_F(NullDevice, MemoryStaysUntilTheQueueHasPassedIt) {
    ASSERT_THAT(device.finish(), IsOk());
    const null::NullCounters before = control->counters();
    control->hold(Queue::Main);
    for (int i = 0; i < 3; i++) {
        const Buffer buffer = device.createBuffer(Buffer::FlagNone, 64, "buffer");
        Compute compute = device.createCompute();
        compute.clearBuffer(buffer);
        ASSERT_THAT(device.submit(compute), IsOk());
    }
    EXPECT_EQ(control->counters().objects, before.objects + 3);
    control->release(Queue::Main, before.submits + 2);
    ASSERT_THAT(device.flush(), IsOk());
    const Buffer unused = device.createBuffer(Buffer::FlagNone, 64, "unused");
    device.clearBuffer(unused);
    ASSERT_THAT(device.flush(), IsOk());
    EXPECT_EQ(control->counters().objects, before.objects + 2);
    control->release(Queue::Main);
    ASSERT_THAT(device.finish(), IsOk());
    EXPECT_EQ(control->counters().objects, before.objects + 1);
}

TEST_F(NullDevice, QueuesWaitForEachOther) {
    const Buffer buffer = device.createBuffer(Buffer::FlagNone, 64, "buffer");
    const Buffer copy = device.createBuffer(Buffer::FlagNone, 64, "copy");
    ASSERT_THAT(device.finish(), IsOk());
    control->hold(Queue::Main);
    Compute main = device.createCompute();
    main.clearBuffer(buffer, 5);
    ASSERT_THAT(device.submit(main), IsOk());
    Fence fence = device.createFence();
    Compute other = device.createCompute(Queue::Copy);
    other.copyBuffer(copy, 0, buffer, 0, 64);
    ASSERT_THAT(device.submit(other, fence), IsOk());
    EXPECT_EQ(control->counters().waits, 1u);
    EXPECT_FALSE(fence.isSignaled());
    control->release(Queue::Main);
    EXPECT_TRUE(fence.isSignaled());
}

TEST_F(NullDevice, ThreadsShareIt) {
    std::vector<std::thread> threads;
    for (uint32_t t = 0; t < 4; t++) {
        threads.emplace_back([this, t] {
            const Queue queue = t % 2 ? Queue::Compute : Queue::Main;
            for (uint32_t i = 0; i < 50; i++) {
                const Buffer buffer = device.createBuffer(Buffer::FlagNone, 256, "buffer");
                Compute compute = device.createCompute(queue);
                compute.clearBuffer(buffer, i);
                ASSERT_THAT(device.submit(compute), IsOk());
                const Expected<std::vector<uint32_t>> read = device.read<uint32_t>(buffer, 0, 4);
                ASSERT_THAT(read, IsOk());
                EXPECT_THAT(*read, testing::Each(i));
            }
        });
    }
    for (uint32_t i = 0; i < 200; i++) (void)control->counters();
    for (std::thread& thread : threads) thread.join();
}

// Failures.

TEST_F(NullDevice, MemoryRunsOut) {
    open({.memory = 10000});
    const Buffer first = device.createBuffer(Buffer::FlagNone, 8000, "first");
    ASSERT_TRUE(first);
    expected = "device.out_of_memory";
    const Buffer second = device.createBuffer(Buffer::FlagNone, 8000, "second");
    EXPECT_THAT(second, HasErrorId("device.out_of_memory"));
    EXPECT_EQ(told, 1);
    EXPECT_EQ(control->counters().objects, 1u);
}

TEST_F(NullDevice, CreationsFailOnRequest) {
    control->failCreation(2);
    EXPECT_TRUE(device.createBuffer(Buffer::FlagNone, 16));
    expected = "device.out_of_memory";
    EXPECT_THAT(device.createSampler(), HasErrorId("device.out_of_memory"));
    EXPECT_TRUE(device.createSampler());
}

TEST_F(NullDevice, SubmissionsFailOnRequest) {
    const Buffer buffer = device.createBuffer(Buffer::FlagNone, 16, "buffer");
    expected = "device.out_of_memory";
    control->failSubmit(1, ErrorCode::OutOfMemory);
    device.clearBuffer(buffer, 1);
    EXPECT_THAT(device.flush(), HasErrorId("device.out_of_memory"));
    device.clearBuffer(buffer, 2);
    EXPECT_THAT(device.flush(), IsOk());
    EXPECT_TRUE(device.check());

    // What the failed submission would have built is not built.
    Tracing bottom = device.createTracing("bottom");
    bottom.addVertexBuffer(3, FormatRGBf32, 12, device.createBuffer(Buffer::FlagTracing, 36, "vertices"));
    ASSERT_THAT(bottom.create(Tracing::TypeTriangle), IsOk());
    const Tracing top = device.createTracing({Tracing::Instance{.tracing = &bottom}});
    control->failSubmit(1, ErrorCode::OutOfMemory);
    device.buildTracing(bottom);
    EXPECT_THAT(device.flush(), HasErrorId("device.out_of_memory"));
    expected = "tracing.unbuilt";
    device.buildTracing(top);
    EXPECT_THAT(device.flush(), HasErrorId("tracing.unbuilt"));
    device.buildTracing(bottom);
    device.buildTracing(top);
    EXPECT_THAT(device.flush(), IsOk());

    expected = "device.lost";
    control->failSubmit(1, ErrorCode::DeviceLost);
    device.clearBuffer(buffer, 3);
    EXPECT_THAT(device.flush(), HasErrorId("device.lost"));
    EXPECT_FALSE(device.check());
    device.clearBuffer(buffer, 4);
    EXPECT_THAT(device.finish(), HasErrorId("device.lost"));
}

// What the back end itself holds against its caller.

struct Raw : testing::Test {
    void SetUp() override {
        auto made =
            null::createNullBackend({.message = [this](const Error& error, bool) { ids.emplace_back(error.id()); }});
        ASSERT_THAT(made, IsOk());
        backend = std::move(*made);
        control = NullControl::last();
    }
    std::vector<std::string> ids;
    std::unique_ptr<detail::Backend> backend;
    std::shared_ptr<NullControl> control;
};

using NullBackend = Raw;

TEST_F(NullBackend, ValuesMustGrow) {
    EXPECT_THAT(backend->submit({.queue = Queue::Main, .lists = {}, .waits = {}, .value = 2}), IsOk());
    EXPECT_EQ(backend->completed(Queue::Main), 2u);
    EXPECT_THAT(backend->submit({.queue = Queue::Main, .lists = {}, .waits = {}, .value = 2}),
                HasErrorId("null.value"));
    const detail::TimelinePoint future = {Queue::Main, 9};
    EXPECT_THAT(backend->submit({.queue = Queue::Copy, .lists = {}, .waits = {&future, 1}, .value = 1}),
                HasErrorId("null.value"));
    EXPECT_EQ(backend->completed(Queue::Copy), 0u);
}

TEST_F(NullBackend, ObjectsMustNotOutliveIt) {
    auto buffer = backend->createBuffer({.size = 16, .flags = 0, .staging = false, .readback = false, .name = "late"});
    ASSERT_THAT(buffer, IsOk());
    backend.reset();
    buffer->reset();
    ASSERT_EQ(control->findings().size(), 1u);
    EXPECT_THAT(control->findings().front(), HasErrorId("null.outlived"));
    EXPECT_TRUE(ids.empty());
}

TEST_F(NullBackend, AddressesAreGivenWhereTheyAreAskedFor) {
    const auto address = [&](Buffer::Flags flags) {
        auto buffer =
            backend->createBuffer({.size = 16, .flags = flags, .staging = false, .readback = false, .name = {}});
        return (*buffer)->address;
    };
    EXPECT_EQ(address(Buffer::FlagStorage), 0u);
    EXPECT_NE(address(Buffer::FlagAddress), 0u);
    EXPECT_NE(address(Buffer::FlagScratch), 0u);
}

}  // namespace
}  // namespace glint::test
