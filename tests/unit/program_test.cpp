// Kernels created in the background, on the null device: what the conformance tests cannot show to a thread sanitizer,
// because drivers are not built for one.

#include "support/device_fixture.h"

#include <glint/base/thread_pool.h>

#include <array>
#include <atomic>
#include <thread>
#include <vector>

namespace glint::test {

namespace {

class ProgramTest : public DeviceTest {
protected:
    ProgramTest()
        : DeviceTest("null"), shader_(Shader::createGLSL(Shader::TypeCompute, R"(
        layout(local_size_x = 1) in;
        layout(binding = 0) buffer Values { uint value; };
        void main() { value = 1u; })")) {}

    Kernel background() {
        Kernel kernel = device.createKernel("background");
        kernel.setShader(shader_);
        kernel.createAsync();
        return kernel;
    }

private:
    const Shader shader_;
};

}  // namespace

TEST_F(ProgramTest, ManyWaitersAgree) {
    for (int round = 0; round < 20; round++) {
        const Kernel kernel = background();
        std::array<std::thread, 4> threads;
        std::atomic<int> ready = 0;
        for (std::thread& thread : threads)
            thread = std::thread([&] { ready += kernel.wait() && kernel.getSlots(SlotKind::Storage) == 1; });
        for (std::thread& thread : threads) thread.join();
        EXPECT_EQ(ready, 4);
    }
}

TEST_F(ProgramTest, RecordersWait) {
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, 64);
    for (int round = 0; round < 20; round++) {
        const Kernel kernel = background();
        std::array<std::thread, 4> threads;
        std::array<Status, 4> results;
        for (size_t i = 0; i < threads.size(); i++)
            threads[i] = std::thread([&, i] {
                Compute list = device.createCompute();
                list.setKernel(kernel);
                list.setStorageBuffer(0, buffer);
                list.dispatch(1);
                results[i] = device.submit(list);
            });
        for (std::thread& thread : threads) thread.join();
        for (const Status& result : results) EXPECT_THAT(result, IsOk());
    }
}

TEST_F(ProgramTest, DroppedFromManyThreads) {
    for (int round = 0; round < 50; round++) {
        std::array<std::thread, 3> threads;
        {
            const Kernel kernel = background();
            for (std::thread& thread : threads) thread = std::thread([copy = kernel]() mutable { copy = Kernel(); });
        }
        for (std::thread& thread : threads) thread.join();
    }
}

TEST_F(ProgramTest, DeviceGoesFirst) {
    for (int round = 0; round < 20; round++) {
        MessageLog messages;
        {
            Device other = Device::create({.api = "null", .message = messages.callback()});
            ASSERT_TRUE(other) << other.error().text();
            Kernel kernel = other.createKernel("nothing to create");
            kernel.createAsync();
            other = {};
            if (round % 2) { EXPECT_THAT(kernel.wait(), HasErrorId("program.stage")); }
        }
        // Told while the device was there, or not at all.
        EXPECT_LE(messages.take().size(), 1u);
    }
}

TEST_F(ProgramTest, ConfiguringWhatIsBeingCreatedIsRefused) {
    Kernel kernel = background();
    kernel.setConstant("A", 1);
    expectTold("program.created");
    EXPECT_THAT(kernel.wait(), IsOk());
    kernel.setStorages(0);
    expectTold("program.created");
    EXPECT_TRUE(kernel);
}

TEST_F(ProgramTest, WaitersInThePoolDoTheWork) {
    ThreadPool& pool = ThreadPool::shared();
    std::vector<Kernel> kernels(3 * static_cast<size_t>(pool.size()));
    std::atomic<size_t> ready = 0;
    for (Kernel& kernel : kernels) {
        kernel = background();
        pool.submit([&ready, &kernel] { ready += static_cast<bool>(kernel.wait()); });
    }
    pool.wait();
    EXPECT_EQ(ready, kernels.size());
}

}  // namespace glint::test
