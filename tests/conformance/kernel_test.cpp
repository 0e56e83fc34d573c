#include "conformance/conformance.h"
#include "support/files.h"

#include <glint/base/file.h>
#include <glint/base/thread_pool.h>

#include <chrono>
#include <future>
#include <thread>

namespace glint::test {

namespace {

class KernelTest : public ConformanceTest {
protected:
    std::vector<uint32_t> run(const Kernel& kernel, uint32_t count = 4) {
        const Buffer result = makeBuffer(std::vector<uint32_t>(count));
        compute([&](Compute& list) {
            list.setKernel(kernel);
            list.setStorageBuffer(0, result);
            list.dispatch(1);
        });
        return read<uint32_t>(result);
    }

    /// Rewrites a file so that its stamp differs even where the clock of the file system is coarse.
    void rewrite(const std::filesystem::path& path, const std::string& text) {
        static int step = 0;
        ASSERT_THAT(writeTextFile(path, text + std::string(static_cast<size_t>(++step), '\n')), IsOk());
    }
};

constexpr const char* constants_kernel = R"(
layout(local_size_x_id = 3, local_size_y = 1) in;
layout(constant_id = 0) const uint AMOUNT = 1u;
layout(constant_id = 1) const int OFFSET = -2;
layout(constant_id = 2) const float SCALE = 0.5;
layout(constant_id = 4) const bool ENABLED = false;
layout(binding = 0) buffer Result { uint result[4]; };
void main() {
    result[0] = AMOUNT;
    result[1] = uint(OFFSET);
    result[2] = uint(SCALE * 8.0);
    result[3] = (ENABLED ? 1000u : 0u) + gl_WorkGroupSize.x;
}
)";

std::string value_kernel(int value, const char* more = "") {
    return "layout(local_size_x = 1) in;\nlayout(binding = 0) buffer Result { uint result[4]; };\n" +
           std::string(more) + "\nvoid main() { result[0] = " + std::to_string(value) + "u; }\n";
}

}  // namespace

TEST_F(KernelTest, StatesFollowEachOther) {
    Kernel kernel = device.createKernel("steps");
    EXPECT_EQ(kernel.state(), ObjectState::Building);
    EXPECT_FALSE(kernel.error());
    EXPECT_EQ(kernel.getGroupSizeX(), 1u);
    EXPECT_EQ(kernel.getSlots(SlotKind::Storage), 0u);
    EXPECT_TRUE(kernel.createShaderGLSL(value_kernel(1)));
    EXPECT_EQ(kernel.state(), ObjectState::Building);
    ASSERT_THAT(kernel.create(), IsOk());
    EXPECT_EQ(kernel.state(), ObjectState::Ready);
    EXPECT_EQ(kernel.name(), "steps");
    EXPECT_EQ(kernel.getSlots(SlotKind::Storage), 1u);
    EXPECT_EQ(kernel.getSlots(SlotKind::Count), 0u);
    EXPECT_EQ(kernel.getLayout().resources.size(), 1u);
}

TEST_F(KernelTest, NullKernelIsHarmless) {
    Kernel kernel;
    kernel.setConstant("A", 1);
    kernel.setUniforms(1).setStorages(2).setTextures(3).setSurfaces(4).setSamplers(5).setTracings(6).setTexels(7);
    kernel.setShader(Shader());
    EXPECT_FALSE(kernel.createShaderGLSL(value_kernel(1)));
    EXPECT_THAT(kernel.create(), HasErrorId("handle.null"));
    kernel.createAsync();
    EXPECT_THAT(kernel.wait(), HasErrorId("handle.null"));
    EXPECT_THAT(kernel.reload(), HasErrorId("handle.null"));
    EXPECT_EQ(kernel.getGroupSizeX() + kernel.getGroupSizeY() + kernel.getGroupSizeZ(), 3u);
    EXPECT_TRUE(kernel.getLayout().resources.empty());
}

TEST_F(KernelTest, SpecialisationConstants) {
    const auto make = [&](const std::function<void(Kernel&)>& configure) {
        Kernel kernel = device.createKernel("constants");
        kernel.createShaderGLSL(constants_kernel);
        configure(kernel);
        EXPECT_THAT(kernel.create(), IsOk());
        return kernel;
    };
    EXPECT_EQ(run(make([](Kernel&) {})), (std::vector<uint32_t>{1, static_cast<uint32_t>(-2), 4, 1}));
    const Kernel by_id = make([](Kernel& kernel) {
        kernel.setConstant(0, 10u);
        kernel.setConstant(1, -3);
        kernel.setConstant(2, 2.0f);
        kernel.setConstant(3, 32u);
        kernel.setConstant(4, true);
    });
    EXPECT_EQ(by_id.getGroupSizeX(), 32u);
    EXPECT_EQ(run(by_id), (std::vector<uint32_t>{10, static_cast<uint32_t>(-3), 16, 1032}));
    const Kernel by_name = make([](Kernel& kernel) {
        kernel.setConstant("AMOUNT", 5);  // an int that is not negative fits an unsigned constant
        kernel.setConstant("OFFSET", 6u);
        kernel.setConstant("SCALE", 1.0f);
        kernel.setConstant("ENABLED", true);
        kernel.setConstant("AMOUNT", 11u);  // the last one counts
    });
    EXPECT_EQ(run(by_name), (std::vector<uint32_t>{11, 6, 8, 1001}));
}

TEST_F(KernelTest, DeclaredSlotsMayBeMore) {
    Kernel kernel = device.createKernel();
    kernel.setStorages(3).setUniforms(0).setTextures(2);
    kernel.createShaderGLSL(value_kernel(3));
    ASSERT_THAT(kernel.create(), IsOk());
    EXPECT_EQ(run(kernel)[0], 3u);
}

TEST_F(KernelTest, UnusedResourcesKeepTheirSlots) {
    Kernel kernel = device.createKernel();
    kernel.createShaderGLSL(R"(
        layout(local_size_x = 1) in;
        layout(binding = 0) buffer Unused { uint unused; };
        layout(binding = 1) buffer Result { uint result; };
        void main() { result = 9u; })");
    ASSERT_THAT(kernel.create(), IsOk());
    EXPECT_EQ(kernel.getSlots(SlotKind::Storage), 2u);
    const Buffer unused = makeBuffer(std::vector<uint32_t>(1)), result = makeBuffer(std::vector<uint32_t>(1));
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setStorageBuffers(0, {unused, result});
        list.dispatch(1);
    });
    EXPECT_EQ(read<uint32_t>(result)[0], 9u);
}

TEST_F(KernelTest, ManyInTheBackground) {
    std::vector<Kernel> kernels;
    for (int i = 0; i < 12; i++) {
        Kernel kernel = device.createKernel("background");
        kernel.createShaderGLSL(value_kernel(i));
        kernel.createAsync();
        kernels.push_back(kernel);
    }
    for (int i = 0; i < 12; i++) {
        // Recording waits for those that are not ready.
        if (i % 2) { EXPECT_THAT(kernels[i].wait(), IsOk()); }
        EXPECT_EQ(run(kernels[i])[0], static_cast<uint32_t>(i));
        EXPECT_EQ(kernels[i].state(), ObjectState::Ready);
    }
}

TEST_F(KernelTest, BackgroundFailureIsCarried) {
    Kernel kernel = device.createKernel();
    expectError("program.stage", [&] {
        kernel.createAsync();
        return kernel.wait();
    });
    EXPECT_EQ(kernel.state(), ObjectState::Failed);
}

TEST_F(KernelTest, WaitingInThePoolCannotBlock) {
    // More waiters than workers, each for a creation that is queued behind all of them.
    ThreadPool& pool = ThreadPool::shared();
    const uint32_t count = 2 * pool.size();
    std::vector<Kernel> kernels;
    for (uint32_t i = 0; i < count; i++) {
        Kernel kernel = device.createKernel();
        kernel.createShaderGLSL(value_kernel(1));
        kernels.push_back(kernel);
    }
    std::promise<void> all_set;
    std::shared_future<void> start = all_set.get_future().share();
    std::vector<std::promise<bool>> results(count);
    for (uint32_t i = 0; i < count; i++)
        pool.submit([&, i] {
            start.wait();
            results[i].set_value(static_cast<bool>(kernels[i].wait()));
        });
    for (Kernel& kernel : kernels) kernel.createAsync();
    all_set.set_value();
    for (std::promise<bool>& result : results) EXPECT_TRUE(result.get_future().get());
}

TEST_F(KernelTest, DroppedWhileBuilding) {
    for (int i = 0; i < 20; i++) {
        Kernel kernel = device.createKernel();
        kernel.createShaderGLSL(value_kernel(i));
        kernel.createAsync();
        if (i % 3 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

TEST_F(KernelTest, DeviceDroppedWhileBuilding) {
    MessageLog messages;
    {
        Device other = Device::create({.validation = DeviceDesc::Validation::On, .message = messages.callback()});
        ASSERT_TRUE(other) << other.error().text();
        Kernel kernel = other.createKernel();
        kernel.createShaderGLSL(value_kernel(1));
        kernel.createAsync();
        other = {};
    }
    messages.expectNone();
}

TEST_F(KernelTest, ReloadFollowsTheFile) {
    const TempDir folder;
    const std::filesystem::path path = folder.path() / "value.shader";
    rewrite(path, value_kernel(1));
    Kernel kernel = device.createKernel("reloaded");
    ASSERT_TRUE(kernel.loadShaderGLSL(path.string()));
    ASSERT_THAT(kernel.create(), IsOk());
    bool changed = true;
    EXPECT_THAT(kernel.reload(&changed), IsOk());
    EXPECT_FALSE(changed);
    EXPECT_EQ(run(kernel)[0], 1u);

    rewrite(path, value_kernel(2));
    EXPECT_THAT(kernel.reload(&changed), IsOk());
    EXPECT_TRUE(changed);
    EXPECT_EQ(run(kernel)[0], 2u);

    // A broken file leaves the kernel as it was, and is told once.
    rewrite(path, "void main() { nonsense }");
    expectError("shader.compile", [&] { return kernel.reload(&changed); });
    EXPECT_FALSE(changed);
    EXPECT_THAT(kernel.reload(&changed), IsOk());
    EXPECT_FALSE(changed);
    EXPECT_TRUE(kernel);
    EXPECT_EQ(run(kernel)[0], 2u);

    rewrite(path, value_kernel(3, "layout(binding = 1) uniform Other { uint other; };"));
    expectError("program.layout_changed", [&] { return kernel.reload(&changed); });
    EXPECT_EQ(run(kernel)[0], 2u);

    rewrite(path, value_kernel(4));
    EXPECT_THAT(kernel.reload(&changed), IsOk());
    EXPECT_TRUE(changed);
    EXPECT_EQ(run(kernel)[0], 4u);
}

TEST_F(KernelTest, ReloadFollowsIncludes) {
    const TempDir folder;
    rewrite(folder.path() / "value.h", "#define VALUE 1\n");
    rewrite(folder.path() / "main.shader", "#include \"value.h\"\nlayout(local_size_x = 1) in;\n"
                                           "layout(binding = 0) buffer Result { uint result[4]; };\n"
                                           "void main() { result[0] = VALUE; }\n");
    Kernel kernel = device.createKernel();
    ASSERT_TRUE(kernel.loadShaderGLSL((folder.path() / "main.shader").string()));
    ASSERT_THAT(kernel.create(), IsOk());
    EXPECT_EQ(run(kernel)[0], 1u);
    rewrite(folder.path() / "value.h", "#define VALUE 2\n");
    bool changed = false;
    EXPECT_THAT(kernel.reload(&changed), IsOk());
    EXPECT_TRUE(changed);
    EXPECT_EQ(run(kernel)[0], 2u);
}

TEST_F(KernelTest, ReloadWhileWorkIsInFlight) {
    const TempDir folder;
    const std::filesystem::path path = folder.path() / "value.shader";
    rewrite(path, value_kernel(1));
    Kernel kernel = device.createKernel();
    ASSERT_TRUE(kernel.loadShaderGLSL(path.string()));
    ASSERT_THAT(kernel.create(), IsOk());
    const Buffer result = makeBuffer(std::vector<uint32_t>(4));
    for (int i = 2; i < 8; i++) {
        compute([&](Compute& list) {
            list.setKernel(kernel);
            list.setStorageBuffer(0, result);
            for (int repeat = 0; repeat < 50; repeat++) list.dispatch(1);
        });
        rewrite(path, value_kernel(i));
        EXPECT_THAT(kernel.reload(), IsOk());
    }
    EXPECT_EQ(run(kernel)[0], 7u);
}

}  // namespace glint::test
