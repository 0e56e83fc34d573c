#include "conformance/conformance.h"

#include <atomic>
#include <thread>

namespace glint::test {

namespace {

class BufferTest : public ApiTest {
protected:
    std::vector<uint8_t> bytes(size_t count) {
        std::vector<uint8_t> values(count);
        for (size_t i = 0; i < count; i++) values[i] = static_cast<uint8_t>(i * 7 + i / 256);
        return values;
    }
};

class BufferShaderTest : public ConformanceTest {};

constexpr Buffer::Flag all_flags[] = {
    Buffer::FlagUniform, Buffer::FlagStorage, Buffer::FlagVertex,  Buffer::FlagIndex,   Buffer::FlagIndirect,
    Buffer::FlagTexel,   Buffer::FlagAddress, Buffer::FlagTracing, Buffer::FlagScratch, Buffer::FlagMapped,
};

}  // namespace

TEST_P(BufferTest, KnowsItsProperties) {
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage | Buffer::FlagVertex, 1000, "numbers");
    ASSERT_TRUE(buffer);
    EXPECT_EQ(buffer.state(), ObjectState::Ready);
    EXPECT_EQ(buffer.getSize(), 1000u);
    EXPECT_EQ(buffer.getFlags(), Buffer::FlagStorage | Buffer::FlagVertex);
    EXPECT_EQ(buffer.name(), "numbers");
    EXPECT_EQ(buffer.map(), nullptr);
    EXPECT_FALSE(buffer.error());
}

TEST_P(BufferTest, NullBufferIsHarmless) {
    const Buffer buffer;
    EXPECT_FALSE(buffer);
    EXPECT_EQ(buffer.state(), ObjectState::Null);
    EXPECT_THAT(buffer, HasErrorId("handle.null"));
    EXPECT_EQ(buffer.getSize(), 0u);
    EXPECT_EQ(buffer.getFlags(), 0u);
    EXPECT_EQ(buffer.getAddress(), 0u);
    EXPECT_EQ(buffer.map(), nullptr);
    EXPECT_EQ(buffer.name(), "");
}

TEST_P(BufferTest, HandlesShareAndMove) {
    Buffer a = makeBuffer(std::vector<uint32_t>{1});
    Buffer b = a;
    EXPECT_TRUE(a == b);
    b.setName("renamed");
    EXPECT_EQ(a.name(), "renamed");
    Buffer c = std::move(a);
    EXPECT_TRUE(b == c);
    const Buffer& same = c;
    c = same;
    b = Buffer();
    EXPECT_EQ(read<uint32_t>(c), std::vector<uint32_t>{1});
}

TEST_P(BufferTest, EveryFlagAloneAndTogether) {
    Buffer::Flags together = 0;
    for (const Buffer::Flag flag : all_flags) {
        if (flag == Buffer::FlagAddress && !device.getFeatures().bufferAddress) continue;
        if ((flag == Buffer::FlagTracing || flag == Buffer::FlagScratch) && !device.getFeatures().computeTracing)
            continue;
        together |= flag;
        EXPECT_TRUE(device.createBuffer(flag, 256)) << flag;
    }
    EXPECT_TRUE(device.createBuffer(together, 256));
    EXPECT_TRUE(device.createBuffer(Buffer::FlagNone, 256));
}

TEST_P(BufferTest, RoundTripOfEverySize) {
    for (const size_t size : {1u, 2u, 3u, 4u, 5u, 15u, 16u, 17u, 255u, 256u, 257u, 65535u, 65536u, 65537u, 1u << 20,
                              (1u << 20) + 1, (9u << 20) + 3}) {
        const std::vector<uint8_t> expected = bytes(size);
        EXPECT_EQ(read<uint8_t>(makeBuffer(expected)), expected) << size;
    }
}

TEST_P(BufferTest, DataThenZeroes) {
    // What creation without data leaves is undefined; a fill defines it.
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, 64);
    device.clearBuffer(buffer);
    EXPECT_EQ(read<uint32_t>(buffer), std::vector<uint32_t>(16));
}

TEST_P(BufferTest, WritesAtOffsetsComeInOrder) {
    const Buffer buffer = makeBuffer(std::vector<uint8_t>(16));
    const std::vector<uint8_t> data = {1, 2, 3, 4, 5};
    device.setBuffer(buffer, 3, data.data(), 5);
    device.setBuffer(buffer, 5, data.data(), 1);
    device.setBuffer(buffer, 15, data.data(), 1);
    device.setBuffer(buffer, 16, data.data(), 0);
    EXPECT_EQ(read<uint8_t>(buffer), (std::vector<uint8_t>{0, 0, 0, 1, 2, 1, 4, 5, 0, 0, 0, 0, 0, 0, 0, 1}));
}

TEST_P(BufferTest, AFailedListLeavesWhatIsQueued) {
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, 64);
    device.clearBuffer(buffer, 0x01020304);
    Compute failing = device.createCompute();
    expectError("copy.range", [&] {
        failing.clearBuffer(buffer, 0, 128, 4);
        return device.submit(failing);
    });
    device.clearBuffer(buffer, 0x05060708, 0, 4);
    auto words = device.read<uint32_t>(buffer);
    ASSERT_THAT(words, IsOk());
    EXPECT_EQ(words->front(), 0x05060708u);
    words->front() = 0x01020304;
    EXPECT_EQ(*words, std::vector<uint32_t>(16, 0x01020304));
}

TEST_P(BufferTest, PartialReads) {
    const Buffer buffer = makeBuffer(bytes(1000));
    const Expected<std::vector<uint8_t>> part = device.read<uint8_t>(buffer, 3, 10);
    ASSERT_THAT(part, IsOk());
    const std::vector<uint8_t> expected = bytes(1000);
    EXPECT_TRUE(std::equal(part->begin(), part->end(), expected.begin() + 3));
    EXPECT_EQ(part->size(), 10u);
    const Expected<std::vector<uint8_t>> rest = device.read<uint8_t>(buffer, 990);
    ASSERT_THAT(rest, IsOk());
    EXPECT_EQ(rest->size(), 10u);
}

TEST_P(BufferTest, CopiesWithinAndBetween) {
    const Buffer a = makeBuffer(bytes(100));
    const Buffer b = makeBuffer(std::vector<uint8_t>(100));
    device.copyBuffer(b, 7, a, 50, 13);
    device.copyBuffer(b, 50, b, 7, 13);
    std::vector<uint8_t> expected(100);
    const std::vector<uint8_t> source = bytes(100);
    std::copy_n(source.begin() + 50, 13, expected.begin() + 7);
    std::copy_n(source.begin() + 50, 13, expected.begin() + 50);
    EXPECT_EQ(read<uint8_t>(b), expected);
}

TEST_P(BufferTest, FillsARange) {
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(8));
    device.clearBuffer(buffer, 0x01020304, 4, 8);
    device.clearBuffer(buffer, 0xffffffff, 28);
    EXPECT_EQ(read<uint32_t>(buffer), (std::vector<uint32_t>{0, 0x01020304, 0x01020304, 0, 0, 0, 0, 0xffffffff}));
}

TEST_F(BufferShaderTest, MappedMemoryGoesBothWays) {
    const Buffer buffer = device.createBuffer(Buffer::FlagMapped | Buffer::FlagStorage, 64, "mapped");
    ASSERT_TRUE(buffer);
    auto* values = static_cast<uint32_t*>(buffer.map());
    ASSERT_NE(values, nullptr);
    for (uint32_t i = 0; i < 16; i++) values[i] = i;
    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 16) in;
        layout(binding = 0) buffer Values { uint values[]; };
        void main() { values[gl_GlobalInvocationID.x] *= 2u; })");
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setStorageBuffer(0, buffer);
        list.dispatch(16);
    });
    ASSERT_THAT(device.finish(), IsOk());
    for (uint32_t i = 0; i < 16; i++) EXPECT_EQ(values[i], 2 * i);
}

TEST_P(BufferTest, AddressesDifferAndAreStable) {
    GLINT_NEED_FEATURE(FeatureBufferAddress);
    const Buffer a = device.createBuffer(Buffer::FlagAddress, 256);
    const Buffer b = device.createBuffer(Buffer::FlagAddress, 256);
    EXPECT_NE(a.getAddress(), 0u);
    EXPECT_NE(a.getAddress(), b.getAddress());
    EXPECT_EQ(a.getAddress(), a.getAddress());
    EXPECT_EQ(device.createBuffer(Buffer::FlagStorage, 256).getAddress(), 0u);
}

TEST_P(BufferTest, ReleaseBeforeUseIsOver) {
    const Buffer kept = makeBuffer(std::vector<uint8_t>(1 << 16));
    for (int i = 0; i < 20; i++) {
        const Buffer temporary = makeBuffer(bytes(1 << 16));
        device.copyBuffer(kept, 0, temporary, 0, 1 << 16);
        if (i % 3 == 0) { ASSERT_THAT(device.flush(), IsOk()); }
    }
    EXPECT_EQ(read<uint8_t>(kept), bytes(1 << 16));
}

TEST_P(BufferTest, MemoryComesBack) {
    // The allocator may keep a block for the next object, but not more with each round.
    uint64_t after_first = 0;
    for (int round = 0; round < 4; round++) {
        const uint64_t created = device.getMemory().objects_created;
        {
            std::array<Buffer, 8> buffers;
            for (Buffer& buffer : buffers) buffer = device.createBuffer(Buffer::FlagStorage, 8 << 20);
            EXPECT_GE(device.getMemory().bytes, 64u << 20);
            EXPECT_GE(device.getMemory().objects_created, created + 8);
        }
        ASSERT_THAT(device.finish(), IsOk());
        if (round == 0) after_first = device.getMemory().bytes;
    }
    EXPECT_LE(device.getMemory().bytes, after_first);
}

TEST_P(BufferTest, ManyThreadsCreateAndRelease) {
    std::array<std::thread, 4> threads;
    std::atomic<int> failures = 0;
    for (std::thread& thread : threads)
        thread = std::thread([&] {
            for (uint32_t i = 1; i <= 50; i++) {
                const std::vector<uint32_t> values(i, i);
                const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values));
                const Expected<std::vector<uint32_t>> result = device.read<uint32_t>(buffer);
                if (!result || *result != values) failures++;
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(failures, 0);
}

INSTANTIATE_APIS(BufferTest);

}  // namespace glint::test
