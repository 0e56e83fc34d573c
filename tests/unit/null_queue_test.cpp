// Queues of the null device that are held back, failures that come on request, and what the back end holds against its
// caller.

#include "null_device.h"

#include <glint/device/detail/device_object.h>
#include <platform/null/null.h>

#include <thread>

namespace glint::test {
namespace {

using NullQueue = NullDevice;

// Time.

TEST_F(NullQueue, HeldQueuesDoNotFinish) {
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

TEST_F(NullQueue, MemoryStaysUntilTheQueueHasPassedIt) {
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

TEST_F(NullQueue, QueuesWaitForEachOther) {
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

TEST_F(NullQueue, ThreadsShareIt) {
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

TEST_F(NullQueue, MemoryRunsOut) {
    open({.memory = 10000});
    const Buffer first = device.createBuffer(Buffer::FlagNone, 8000, "first");
    ASSERT_TRUE(first);
    expected = "device.out_of_memory";
    const Buffer second = device.createBuffer(Buffer::FlagNone, 8000, "second");
    EXPECT_THAT(second, HasErrorId("device.out_of_memory"));
    EXPECT_EQ(told, 1);
    EXPECT_EQ(control->counters().objects, 1u);
}

TEST_F(NullQueue, CreationsFailOnRequest) {
    control->failCreation(2);
    EXPECT_TRUE(device.createBuffer(Buffer::FlagNone, 16));
    expected = "device.out_of_memory";
    EXPECT_THAT(device.createSampler(), HasErrorId("device.out_of_memory"));
    EXPECT_TRUE(device.createSampler());
}

TEST_F(NullQueue, SubmissionsFailOnRequest) {
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
