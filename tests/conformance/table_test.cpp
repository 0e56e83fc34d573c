// Tables of textures and of buffers.

#include "conformance/conformance.h"

namespace glint::test {

namespace {

/// result[i] = texel (0, 0) of entry i, in an order that differs from thread to thread.
constexpr const char* gather_textures = R"(
layout(local_size_x = 32) in;
layout(set = 0, binding = 0) buffer Result { vec4 result[]; };
layout(set = 0, binding = 1) uniform Count { uint count; };
layout(set = 1, binding = 3) uniform texture2D textures[];
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    uint k = (i * 7u) % count;
    result[k] = texelFetch(textures[nonuniformEXT(k)], ivec2(0), 0);
})";

class TableTest : public ConformanceTest {
protected:
    void SetUp() override {
        ConformanceTest::SetUp();
        GLINT_NEED_FEATURE(FeatureTextureTable);
        GLINT_NEED_FEATURE(FeatureBufferTable);
    }

    /// One texel of this value in the red channel.
    Texture texel(float value) {
        const Texture texture = makeTexture(FormatRGBAf32, 1, 1, 0);
        device.clearTexture(texture, Color{value, 1, 0, 1});
        return texture;
    }
    TextureTable makeTable(uint32_t count) {
        TextureTable table = device.createTextureTable(count, "table");
        EXPECT_TRUE(table) << table.error().text();
        return table;
    }
    void record(Compute& list, const Kernel& kernel, const TextureTable& table, const Buffer& result) {
        list.setKernel(kernel);
        list.setStorageBuffer(0, result);
        list.setUniform(0, table.getCount());
        list.setTextureTable(0, table);
        list.dispatch(table.getCount());
    }
    /// The red channel of every entry.
    std::vector<float> reds(const Buffer& result) {
        std::vector<float> values;
        const std::vector<float> all = read<float>(result);
        for (size_t i = 0; i < all.size(); i += 4) values.push_back(all[i]);
        return values;
    }
};

}  // namespace

TEST_F(TableTest, NullTablesAreHarmless) {
    TextureTable textures;
    textures.set(0, Texture());
    EXPECT_EQ(textures.getCount(), 0u);
    BufferTable buffers;
    buffers.set(0, Buffer());
    EXPECT_EQ(buffers.getCount(), 0u);
}

TEST_F(TableTest, TexturesByIndex) {
    const Kernel kernel = makeKernel(gather_textures);
    EXPECT_EQ(kernel.getSlots(SlotKind::Table), 1u);
    // Tables of any length go with one kernel.
    for (const uint32_t count : {1u, 2u, 100u, 2048u}) {
        SCOPED_TRACE(count);
        TextureTable table = makeTable(count);
        EXPECT_EQ(table.getCount(), count);
        std::vector<float> expected;
        for (uint32_t i = 0; i < count; i++) {
            expected.push_back(static_cast<float>(i + 1));
            table.set(i, texel(expected.back()));
        }
        const Buffer result = makeBuffer(std::vector<float>(4 * count));
        compute([&](Compute& list) { record(list, kernel, table, result); });
        EXPECT_EQ(reds(result), expected);
    }
}

TEST_F(TableTest, NothingReadsAsZero) {
    const Kernel kernel = makeKernel(gather_textures);
    TextureTable table = makeTable(5);
    table.set(1, texel(7));
    table.set(3, texel(8));
    table.set(3, Texture());
    const Buffer result = makeBuffer(std::vector<float>(20, 99.0f));
    compute([&](Compute& list) { record(list, kernel, table, result); });
    std::vector<float> expected(20, 0.0f);
    expected[4] = 7;
    expected[5] = expected[7] = 1;
    EXPECT_EQ(read<float>(result), expected);
}

TEST_F(TableTest, AListSeesTheTableAsItWas) {
    const Kernel kernel = makeKernel(gather_textures);
    TextureTable table = makeTable(3);
    for (uint32_t i = 0; i < 3; i++) table.set(i, texel(1));
    const Buffer first = makeBuffer(std::vector<float>(12)), second = makeBuffer(std::vector<float>(12)),
                 third = makeBuffer(std::vector<float>(12));
    Compute before = device.createCompute();
    record(before, kernel, table, first);
    table.set(1, texel(2));
    Compute after = device.createCompute();
    record(after, kernel, table, second);
    table.set(1, texel(3));
    table.set(2, Texture());
    // Also within a list; and without another call it stays what it was.
    after.dispatch(3);
    record(after, kernel, table, third);
    table = {};
    EXPECT_THAT(device.submit({before, after}), IsOk());
    EXPECT_EQ(reds(first), (std::vector<float>{1, 1, 1}));
    EXPECT_EQ(reds(second), (std::vector<float>{1, 2, 1}));
    EXPECT_EQ(reds(third), (std::vector<float>{1, 3, 0}));
}

TEST_F(TableTest, EntriesChangeWhileWorkIsInFlight) {
    const Kernel kernel = makeKernel(gather_textures);
    TextureTable table = makeTable(4);
    std::vector<Buffer> results;
    for (uint32_t round = 0; round < 20; round++) {
        // The texture before goes while it may still be read.
        table.set(round % 4, texel(static_cast<float>(round + 1)));
        results.push_back(makeBuffer(std::vector<float>(16)));
        compute([&](Compute& list) { record(list, kernel, table, results.back()); });
    }
    for (uint32_t round = 0; round < 20; round++) {
        std::vector<float> expected(4, 0.0f);
        for (uint32_t r = round < 4 ? 0 : round - 3; r <= round; r++) expected[r % 4] = static_cast<float>(r + 1);
        EXPECT_EQ(reds(results[round]), expected) << round;
    }
}

TEST_F(TableTest, WhatItHoldsIsTracked) {
    // Written as a target and by a copy, read through the table, and written again after that.
    const Kernel kernel = makeKernel(gather_textures);
    const Texture drawn = makeTexture(FormatRGBAf32, 1, 1, Texture::FlagTarget);
    const Texture stored = makeTexture(FormatRGBAf32, 1, 1, Texture::FlagSurface);
    const Kernel store = makeKernel(R"(
        layout(local_size_x = 1) in;
        layout(binding = 0, rgba32f) uniform image2D surface;
        layout(push_constant) uniform Push { float value; };
        void main() { imageStore(surface, ivec2(0), vec4(value)); })");
    TextureTable table = makeTable(2);
    table.set(0, drawn);
    table.set(1, stored);
    std::vector<Buffer> results;
    for (int round = 1; round <= 3; round++) {
        const float value = static_cast<float>(round);
        Target target = device.createTarget(drawn);
        target.setClearColor(Color{value, 0, 0, 0});
        Command clear = device.createCommand(target);
        Compute list = device.createCompute();
        list.setKernel(store);
        list.setSurfaceTexture(0, stored);
        list.setPushConstants(10 * value);
        list.dispatch(1);
        results.push_back(makeBuffer(std::vector<float>(8)));
        record(list, kernel, table, results.back());
        EXPECT_THAT(device.submit({clear, list}), IsOk());
    }
    for (size_t i = 0; i < 3; i++) {
        const auto value = static_cast<float>(i + 1);
        EXPECT_EQ(reds(results[i]), (std::vector<float>{value, 10 * value})) << i;
    }
}

TEST_F(TableTest, SampledInAFragmentShader) {
    // A mip level and a sampler of its own; every pixel another entry.
    const Pipeline pipeline = makePipeline(cover_vertex, R"(
        layout(set = 2, binding = 0) uniform texture2D textures[];
        layout(set = 0, binding = 0) uniform sampler nearest;
        layout(location = 0) out vec4 color;
        void main() {
            int i = int(gl_FragCoord.x) + 4 * int(gl_FragCoord.y);
            color = textureLod(sampler2D(textures[nonuniformEXT(i)], nearest), vec2(0.5), 0.0);
        })");
    const Texture mips = device.createTexture2D(FormatRGBAu8n, 4, 4, Texture::FlagMipmaps, "mips");
    for (uint16_t mip = 0; mip < 3; mip++)
        device.clearTexture(mips, Color{static_cast<float>(mip) / 255, 0, 0, 1}, {mip, 1, 0, 1});
    TextureTable table = makeTable(16);
    for (uint16_t i = 0; i < 15; i++) table.set(i, mips, {.mip = static_cast<uint16_t>(i % 3)});
    const Texture color = makeTexture(FormatRGBAu8n, 4, 4);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setTextureTable(0, table);
        list.setSampler(0, device.createSampler(Sampler::FilterBipoint));
        list.drawArrays(3);
    });
    const std::vector<Pixel> picture = readTexture<Pixel>(color);
    for (uint8_t i = 0; i < 15; i++) EXPECT_EQ(picture[i], (Pixel{static_cast<uint8_t>(i % 3), 0, 0, 255})) << int(i);
    EXPECT_EQ(picture[15], (Pixel{0, 0, 0, 0}));
}

TEST_F(TableTest, OtherDimensions) {
    const Texture cube = device.createTextureCube(FormatRGBAf32, 2, 0, "cube");
    const Texture layers = device.createTexture({.format = FormatRGBAf32, .width = 2, .height = 2, .layers = 3});
    for (uint16_t i = 0; i < 6; i++) device.clearTexture(cube, Color{10.0f + i, 0, 0, 0}, {0, 1, i, 1});
    for (uint16_t i = 0; i < 3; i++) device.clearTexture(layers, Color{20.0f + i, 0, 0, 0}, {0, 1, i, 1});
    TextureTable cubes = makeTable(2), arrays = makeTable(3);
    cubes.set(1, cube);
    arrays.set(0, layers);
    arrays.set(2, layers, {.layer = 1, .layers = 1});
    const Buffer result = makeBuffer(std::vector<float>(4));
    compute([&](Compute& list) {
        list.setKernel(makeKernel(R"(
            layout(local_size_x = 1) in;
            layout(set = 1, binding = 0) uniform textureCube cubes[];
            layout(set = 2, binding = 0) uniform texture2DArray arrays[];
            layout(set = 0, binding = 0) uniform sampler nearest;
            layout(set = 0, binding = 1) buffer Result { vec4 result; };
            void main() {
                result.x = textureLod(samplerCube(cubes[1], nearest), vec3(0, -1, 0), 0.0).x;
                result.y = texelFetch(arrays[0], ivec3(0, 0, 2), 0).x;
                result.z = texelFetch(arrays[2], ivec3(0, 0, 0), 0).x;
                result.w = textureLod(samplerCube(cubes[0], nearest), vec3(0, -1, 0), 0.0).x;
            })"));
        list.setTextureTable(0, cubes);
        list.setTextureTable("arrays", arrays);
        list.setSampler(0, device.createSampler(Sampler::FilterPoint));
        list.setStorageBuffer(0, result);
        list.dispatch(1);
    });
    EXPECT_EQ(read<float>(result), (std::vector<float>{13, 22, 21, 0}));
}

TEST_F(TableTest, OneTableInTwoWays) {
    // As 2D and as array textures: two kinds of views of the same entries.
    TextureTable table = makeTable(2);
    table.set(0, texel(1));
    table.set(1, texel(2));
    const char* text = R"(
        layout(local_size_x = 1) in;
        layout(set = 1, binding = 0) uniform KIND textures[];
        layout(set = 0, binding = 0) buffer Result { vec2 result; };
        void main() { result = vec2(texelFetch(textures[0], PLACE, 0).x, texelFetch(textures[1], PLACE, 0).x); })";
    for (const char* macros : {"KIND=texture2D; PLACE=ivec2(0)", "KIND=texture2DArray; PLACE=ivec3(0)"}) {
        const Buffer result = makeBuffer(std::vector<float>(2));
        const Kernel kernel = makeKernel(text, macros);
        for (int i = 0; i < 2; i++)
            compute([&](Compute& list) {
                list.setKernel(kernel);
                list.setTextureTable(0, table);
                list.setStorageBuffer(0, result);
                list.dispatch(1);
            });
        EXPECT_EQ(read<float>(result), (std::vector<float>{1, 2})) << macros;
    }
}

TEST_F(TableTest, BuffersAreReadAndWritten) {
    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 8) in;
        layout(set = 3, binding = 0) buffer Part { uint values[]; } parts[];
        layout(set = 0, binding = 0) buffer Result { uint result[]; };
        void main() {
            uint i = gl_GlobalInvocationID.x;
            result[i] = parts[nonuniformEXT(i)].values[1];
            parts[nonuniformEXT(i)].values[1] += 100u + i;
        })");
    const uint64_t step = std::max<uint64_t>(device.getFeatures().storageAlignment, 16);
    std::vector<uint32_t> words(4 * step / 4);
    words[1] = 1;
    words[2 * step / 4 + 1] = 2;
    const Buffer shared = makeBuffer(words), own = makeBuffer(std::vector<uint32_t>{0, 3, 0, 0});
    const Buffer result = makeBuffer(std::vector<uint32_t>(8, 77u));
    BufferTable table = device.createBufferTable(8, "parts");
    table.set(0, shared, 0, 16);
    table.set(2, shared, 2 * step);
    table.set(7, own);
    // What the first dispatch writes the second reads: the table's buffers are tracked.
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setBufferTable(0, table);
        list.setStorageBuffer(0, result);
        list.dispatch(8);
        list.dispatch(8);
    });
    EXPECT_EQ(read<uint32_t>(result), (std::vector<uint32_t>{101, 0, 104, 0, 0, 0, 0, 110}));
    const std::vector<uint32_t> after = read<uint32_t>(shared);
    EXPECT_EQ(after[1], 201u);
    EXPECT_EQ(after[2 * step / 4 + 1], 206u);
    EXPECT_EQ(read<uint32_t>(own)[1], 217u);
}

TEST_F(TableTest, TexturesAndBuffersInOneProgram) {
    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 1) in;
        layout(set = 2, binding = 1) uniform texture2D textures[];
        layout(set = 1, binding = 0) readonly buffer Index { uint index; } indices[];
        layout(set = 0, binding = 0) buffer Result { float result; };
        void main() { result = texelFetch(textures[indices[1].index], ivec2(0), 0).x; })");
    EXPECT_EQ(kernel.getSlots(SlotKind::Table), 2u);
    TextureTable textures = makeTable(3);
    textures.set(2, texel(5));
    BufferTable indices = device.createBufferTable(2);
    indices.set(1, makeBuffer(std::vector<uint32_t>{2, 0, 0, 0}));
    const Buffer result = makeBuffer(std::vector<float>(1));
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setBufferTable(0, indices);
        list.setTextureTable(1, textures);
        list.setStorageBuffer(0, result);
        list.dispatch(1);
    });
    EXPECT_EQ(read<float>(result)[0], 5.0f);
}

TEST_F(TableTest, BesideRayQueries) {
    GLINT_NEED_FEATURE(FeatureComputeTracing);
    const std::array<float, 9> corners = {-9, -9, 2, 9, -9, 2, 0, 9, 2};
    Tracing triangle = device.createTracing("triangle");
    triangle.addVertexBuffer(3, FormatRGBf32, 12, device.createBuffer(Buffer::FlagTracing, corners.data(), 36));
    ASSERT_THAT(triangle.create(Tracing::TypeTriangle), IsOk());
    Tracing::Instance instance;
    instance.data = 2;
    instance.tracing = &triangle;
    const Tracing scene = device.createTracing({instance});
    ASSERT_THAT(device.buildTracings({triangle, scene}), IsOk());
    TextureTable table = makeTable(4);
    table.set(2, texel(9));
    const Buffer result = makeBuffer(std::vector<float>(1));
    compute([&](Compute& list) {
        list.setKernel(makeKernel(R"(
            layout(local_size_x = 1) in;
            layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;
            layout(set = 0, binding = 1) buffer Result { float result; };
            layout(set = 1, binding = 0) uniform texture2D textures[];
            void main() {
                rayQueryEXT query;
                rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xffu, vec3(0), 0.0, vec3(0, 0, 1), 10.0);
                while (rayQueryProceedEXT(query)) {}
                int index = rayQueryGetIntersectionInstanceCustomIndexEXT(query, true);
                result = texelFetch(textures[nonuniformEXT(index)], ivec2(0), 0).x;
            })"));
        list.setTracing(0, scene);
        list.setStorageBuffer(0, result);
        list.setTextureTable(0, table);
        list.dispatch(1);
    });
    EXPECT_EQ(read<float>(result)[0], 9.0f);
}

TEST_F(TableTest, InATraversal) {
    GLINT_NEED_FEATURE(FeatureRayTracing);
    // Of its own: a traversal changes how a device builds structures from then on, which others measure.
    device = Device::create({.validation = DeviceDesc::Validation::On, .message = log.callback()});
    ASSERT_TRUE(device) << device.error().text();
    Traversal traversal = device.createTraversal("traversal");
    traversal.createShaderGLSL(Shader::TypeRayGen, R"(
        layout(set = 0, binding = 0) buffer Result { float result[]; };
        layout(set = 1, binding = 0) uniform texture2D textures[];
        void main() { result[gl_LaunchIDEXT.x] = texelFetch(textures[nonuniformEXT(gl_LaunchIDEXT.x)], ivec2(0), 0).x; })");
    ASSERT_THAT(traversal.create(), IsOk());
    TextureTable table = makeTable(3);
    for (uint32_t i = 0; i < 3; i++) table.set(i, texel(static_cast<float>(i)));
    const Buffer result = makeBuffer(std::vector<float>(3));
    compute([&](Compute& list) {
        list.setTraversal(traversal);
        list.setStorageBuffer(0, result);
        list.setTextureTable(0, table);
        list.dispatch(3);
    });
    EXPECT_EQ(read<float>(result), (std::vector<float>{0, 1, 2}));
}

TEST_F(TableTest, MemoryComesBack) {
    const Kernel kernel = makeKernel(gather_textures);
    const Buffer result = makeBuffer(std::vector<float>(4 * 64));
    ASSERT_THAT(device.finish(), IsOk());
    const uint64_t before = device.getMemory().bytes;
    for (int round = 0; round < 5; round++) {
        TextureTable table = makeTable(64);
        for (uint32_t i = 0; i < 64; i++) table.set(i, texel(1));
        compute([&](Compute& list) { record(list, kernel, table, result); });
    }
    ASSERT_THAT(device.finish(), IsOk());
    EXPECT_EQ(device.getMemory().bytes, before);
}

}  // namespace glint::test
