// The null device through the public interface: memory works, and what is played is counted.

#include "null_device.h"

#include <cstring>

namespace glint::test {
namespace {

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

}  // namespace
}  // namespace glint::test
