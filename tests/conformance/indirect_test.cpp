// Draws whose arguments, and numbers, come from the device.

#include "conformance/conformance.h"

namespace glint::test {

namespace {

/// A point at pixel (vertex, instance) of a target of 16 by 16 pixels.
constexpr const char* point_vertex = R"(
void main() {
    gl_Position = vec4(vec2(gl_VertexIndex, gl_InstanceIndex) * (2.0 / 16.0) - 15.0 / 16.0, 0.5, 1.0);
    gl_Position.y = -gl_Position.y;
    gl_PointSize = 1.0;
})";

class IndirectTest : public ConformanceTest {
protected:
    static constexpr uint32_t size = 16;

    void SetUp() override {
        ConformanceTest::SetUp();
        if (!device) return;
        color = makeTexture(FormatRGBAu8n, size, size);
        pipeline = makePipeline(point_vertex, red_fragment,
                                [](Pipeline& points) { points.setPrimitive(Pipeline::PrimitivePoint); });
    }
    void TearDown() override {
        color = {};
        pipeline = {};
        ConformanceTest::TearDown();
    }

    /// The columns drawn in each row.
    std::vector<std::vector<uint32_t>> drawn() {
        const std::vector<Pixel> picture = readTexture<Pixel>(color);
        std::vector<std::vector<uint32_t>> rows(size);
        for (uint32_t i = 0; i < size * size; i++)
            if (picture[i] == red) rows[i / size].push_back(i % size);
        return rows;
    }

    Texture color;
    Pipeline pipeline;
};

}  // namespace

TEST_F(IndirectTest, CountsFromABuffer) {
    GLINT_NEED_FEATURE(FeatureIndirectCount);
    // Draw i: vertices 2 i and 2 i + 1, instance i.
    std::vector<uint32_t> words;
    for (uint32_t i = 0; i < 4; i++) words.insert(words.end(), {2, 1, 2 * i, i, 0xdeadbeef});
    const Buffer arguments = makeBuffer(words, Buffer::FlagIndirect);
    const Buffer counts = makeBuffer(std::vector<uint32_t>{0, 1, 3, 4, 9}, Buffer::FlagIndirect);
    for (uint64_t c = 0; c < 5; c++) {
        draw(color, [&](Command& list) {
            list.setPipeline(pipeline);
            list.drawArraysIndirect(arguments, 0, counts, 4 * c, 4, 20);
        });
        const std::vector<std::vector<uint32_t>> rows = drawn();
        const std::array<uint32_t, 5> expected = {0, 1, 3, 4, 4};  // never more than the call allows
        for (uint32_t i = 0; i < size; i++)
            EXPECT_EQ(rows[i], i < expected[c] ? (std::vector<uint32_t>{2 * i, 2 * i + 1}) : std::vector<uint32_t>())
                << "count " << c << ", row " << i;
    }
}

TEST_F(IndirectTest, CountsOfIndexedDraws) {
    GLINT_NEED_FEATURE(FeatureIndirectCount);
    const Buffer indices = makeBuffer(std::vector<uint16_t>{7, 3, 9, 1}, Buffer::FlagIndex);
    // Five words: indices, instances, first, base vertex, first instance.
    const Buffer arguments =
        makeBuffer(std::vector<uint32_t>{0, 2, 1, 0, 0, 0, 2, 1, 2, 4, 1, 1, 1, 0, 0, 8}, Buffer::FlagIndirect);
    const Buffer counts = makeBuffer(std::vector<uint32_t>{9, 2}, Buffer::FlagIndirect);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setIndexBuffer(FormatRu16, indices);
        list.drawElementsIndirect(arguments, 4, counts, 4, 3);
    });
    const std::vector<std::vector<uint32_t>> rows = drawn();
    EXPECT_EQ(rows[0], (std::vector<uint32_t>{3, 7}));
    EXPECT_EQ(rows[1], (std::vector<uint32_t>{5, 13}));
    EXPECT_EQ(rows[8], std::vector<uint32_t>());
}

TEST_F(IndirectTest, ArgumentsAndCountsAreWrittenByADispatch) {
    GLINT_NEED_FEATURE(FeatureIndirectCount);
    // As culling does: each thread that survives appends its draw. Which one comes first is open.
    const Kernel cull = makeKernel(R"(
        layout(local_size_x = 8) in;
        layout(binding = 0) buffer Count { uint count; };
        layout(binding = 1) writeonly buffer Arguments { uvec4 arguments[]; };
        void main() {
            if (gl_GlobalInvocationID.x % 3u == 1u) return;
            arguments[atomicAdd(count, 1u)] = uvec4(1u, 1u, gl_GlobalInvocationID.x, gl_GlobalInvocationID.x);
        })");
    const Buffer count = device.createBuffer(Buffer::FlagIndirect | Buffer::FlagStorage, 4, "count");
    const Buffer arguments = device.createBuffer(Buffer::FlagIndirect | Buffer::FlagStorage, 256, "arguments");
    // The list that fills comes again while the draws of the round before may still run.
    for (int round = 0; round < 3; round++) {
        Compute fill = device.createCompute();
        fill.clearBuffer(count);
        fill.setKernel(cull);
        fill.setStorageBuffers(0, {count, arguments});
        fill.dispatch(16);
        Command list = device.createCommand(device.createTarget(color));
        list.setPipeline(pipeline);
        list.drawArraysIndirect(arguments, 0, count, 0, 16);
        EXPECT_THAT(device.submit({fill, list}), IsOk());
    }
    const std::vector<std::vector<uint32_t>> rows = drawn();
    for (uint32_t i = 0; i < size; i++)
        EXPECT_EQ(rows[i], i % 3 == 1 ? std::vector<uint32_t>() : std::vector<uint32_t>{i}) << i;
    EXPECT_EQ(read<uint32_t>(count)[0], 11u);
}

TEST_F(IndirectTest, CountThatHasRunAway) {
    GLINT_NEED_FEATURE(FeatureIndirectCount);
    // It takes the device away from all programs until the process is ended.
    if (device.getInfo().vendor_id == 0x10de)
        GTEST_SKIP() << device.getInfo().name << ": NVIDIA's driver 580.159 never comes back from this count";
    const Buffer arguments = makeBuffer(std::vector<uint32_t>{2, 1, 0, 0, 2, 1, 2, 1}, Buffer::FlagIndirect);
    const Buffer count = makeBuffer(std::vector<uint32_t>{0xffffffff}, Buffer::FlagIndirect);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.drawArraysIndirect(arguments, 0, count, 0, 2);
    });
    const std::vector<std::vector<uint32_t>> rows = drawn();
    for (uint32_t i = 0; i < size; i++)
        EXPECT_EQ(rows[i], i < 2 ? (std::vector<uint32_t>{2 * i, 2 * i + 1}) : std::vector<uint32_t>()) << "row " << i;
}

TEST_F(IndirectTest, CountsOfThousands) {
    GLINT_NEED_FEATURE(FeatureIndirectCount);
    constexpr uint32_t draws = 5000;
    if (device.getFeatures().maxIndirectDraws < draws)
        GTEST_SKIP() << "one command takes " << device.getFeatures().maxIndirectDraws << " draws, this wants " << draws;
    std::vector<uint32_t> words;
    for (uint32_t i = 0; i < draws; i++) words.insert(words.end(), {1, 1, i % 16, i / 16 % 16});
    const Buffer arguments = makeBuffer(words, Buffer::FlagIndirect);
    const Buffer count = makeBuffer(std::vector<uint32_t>{255}, Buffer::FlagIndirect);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.drawArraysIndirect(arguments, 0, count, 0, draws);
    });
    EXPECT_EQ(countPixels(readTexture<Pixel>(color), red), 255u);
}

}  // namespace glint::test
