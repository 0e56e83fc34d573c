#include "conformance/conformance.h"

#include <thread>

namespace glint::test {

namespace {

class FenceTest : public ConformanceTest {
protected:
    /// A list that keeps the device busy for some milliseconds.
    Compute busy(const Buffer& buffer) {
        Compute list = device.createCompute();
        list.setKernel(makeKernel(R"(
            layout(local_size_x = 64) in;
            layout(binding = 0) buffer Values { uint values[]; };
            void main() {
                uint x = gl_GlobalInvocationID.x;
                for (uint i = 0; i < 100000u; i++) x = x * 1664525u + 1013904223u;
                values[gl_GlobalInvocationID.x] = x | 1u;
            })"));
        list.setStorageBuffer(0, buffer);
        list.dispatch(buffer.getSize() / 4);
        return list;
    }
};

}  // namespace

TEST_F(FenceTest, SignaledUntilSubmitted) {
    const Fence fence = device.createFence("fence");
    EXPECT_TRUE(fence);
    EXPECT_TRUE(fence.isSignaled());
    EXPECT_THAT(fence.wait(), IsOk());
    EXPECT_FALSE(Fence().isSignaled());
    EXPECT_THAT(Fence().wait(), HasErrorId("handle.null"));
}

TEST_F(FenceTest, SignaledOnceTheWorkIsDone) {
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage | Buffer::FlagMapped, 4096);
    const Fence fence = device.createFence();
    Compute list = busy(buffer);
    ASSERT_THAT(device.submit(list, fence), IsOk());
    ASSERT_THAT(fence.wait(), IsOk());
    EXPECT_TRUE(fence.isSignaled());
    const auto* values = static_cast<const uint32_t*>(buffer.map());
    for (uint32_t i = 0; i < 1024; i++) EXPECT_EQ(values[i] & 1, 1u);
}

TEST_F(FenceTest, EmptySubmissionsAreDoneWithWhatCameBefore) {
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, 4096);
    Compute list = busy(buffer);
    ASSERT_THAT(device.submit(list), IsOk());
    const Fence fence = device.createFence();
    ASSERT_THAT(device.submit({}, fence), IsOk());
    EXPECT_THAT(fence.wait(), IsOk());
}

TEST_F(FenceTest, WaitingHasALimit) {
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, 1 << 18);
    const Fence fence = device.createFence();
    Compute list = busy(buffer);
    ASSERT_THAT(device.submit(list, fence), IsOk());
    const Status status = fence.wait(1);
    if (!status) {
        EXPECT_THAT(status, HasErrorId("fence.timeout"));
        expectTold("fence.timeout");
    }
    EXPECT_THAT(fence.wait(), IsOk());
}

TEST_F(FenceTest, FencesAreUsedAgain) {
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, 256);
    const Fence fence = device.createFence();
    for (int i = 0; i < 10; i++) {
        Compute list = device.createCompute();
        list.clearBuffer(buffer, 1);
        ASSERT_THAT(device.submit(list, fence), IsOk());
        ASSERT_THAT(fence.wait(), IsOk());
    }
}

TEST_F(FenceTest, ManyThreadsWait) {
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, 4096);
    const Fence fence = device.createFence();
    Compute list = busy(buffer);
    ASSERT_THAT(device.submit(list, fence), IsOk());
    std::array<std::thread, 4> threads;
    std::array<Status, 4> results;
    for (size_t i = 0; i < 4; i++) threads[i] = std::thread([&, i] { results[i] = fence.wait(); });
    for (std::thread& thread : threads) thread.join();
    for (const Status& result : results) EXPECT_THAT(result, IsOk());
}

}  // namespace glint::test
