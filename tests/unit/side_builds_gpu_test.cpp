// Builds that share rounds of dispatches: the bits are those of builds one by one, and the validation layers see no
// hazard.

#include "support/device_fixture.h"

#include <glint/device/detail/device_object.h>
#include <glint/device/detail/recorder_core.h>
#include <glint/geometry/primitives.h>

#include <cstdlib>

namespace glint::test {

namespace {

/// As on CPUs and as on GPUs: how the kernels reach the heap, and which form of nodes they build.
class SideBuilds : public testing::TestWithParam<std::pair<const char*, const char*>> {
protected:
    static constexpr uint32_t nothing = 0xdeadbeefu;

    void SetUp() override {
        setenv("GLINT_TRACING_MEMORY", GetParam().first, 1);
        setenv("GLINT_TRACING_NODES", GetParam().second, 1);
        device = Device::create({.api = "vulkan",
                                 .required = FeatureComputeTracing,
                                 .tracing = TracingEngine::Software,
                                 .validation = DeviceDesc::Validation::On,
                                 .message = log.callback()});
        unsetenv("GLINT_TRACING_MEMORY");
        unsetenv("GLINT_TRACING_NODES");
        ASSERT_THAT(device, IsOk());
        for (uint32_t i = 0; i < 9; i++) addMesh(createSphere(1.0f + 0.1f * static_cast<float>(i), i % 4));
        addMesh(createTorus(1.0f, 0.3f, 24, 12));
        addMesh(createTorus(1.0f, 0.2f, 5, 3), true);
        addBoxes(100);
        std::vector<Tracing::Instance> instances(bottoms.size());
        for (size_t i = 0; i < bottoms.size(); i++) instances[i].tracing = &bottoms[i];
        for (uint32_t count : {3u, static_cast<uint32_t>(bottoms.size())})
            tops.push_back(device.createTracing(std::span(instances).first(count), Tracing::FlagFastBuild, "top"));
        scratch_part = 1;
        for (const auto* level : {&bottoms, &tops})
            for (const Tracing& tracing : *level) {
                ASSERT_THAT(tracing, IsOk());
                scratch_part = std::max({scratch_part, tracing.getBuildSize(), tracing.getUpdateSize()});
            }
        const uint64_t alignment = device.getFeatures().scratchAlignment;
        scratch_part = (scratch_part + alignment - 1) / alignment * alignment;
        scratch = device.createBuffer(Buffer::FlagScratch, scratch_part * bottoms.size(), "parts");
        heap_bytes = device_object().heap()->texels().size;
        copy = device.createBuffer(Buffer::FlagNone, heap_bytes, "copy");
        ASSERT_THAT(copy, IsOk());
    }
    void TearDown() override { log.expectNone(); }

    void addMesh(const Mesh& mesh, bool is_two = false) {
        Tracing& tracing = bottoms.emplace_back(device.createTracing("mesh"));
        const Buffer vertices = device.createBuffer(Buffer::FlagTracing, std::span(mesh.positions), "vertices");
        const Buffer indices = device.createBuffer(Buffer::FlagTracing, std::span(mesh.indices), "indices");
        for (int i = 0; i < (is_two ? 2 : 1); i++) {
            tracing.addVertexBuffer(static_cast<uint32_t>(mesh.positions.size()), FormatRGBf32, 12, vertices);
            tracing.addIndexBuffer(static_cast<uint32_t>(mesh.indices.size()), FormatRu32, indices);
        }
        EXPECT_THAT(tracing.create(Tracing::TypeTriangle, Tracing::FlagFastBuild | Tracing::FlagUpdate), IsOk());
        inputs.emplace_back(vertices, std::vector<float>(&mesh.positions[0].x, &mesh.positions.back().z + 1));
    }
    void addBoxes(uint32_t count) {
        std::vector<float> boxes;
        for (uint32_t i = 0; i < count; i++) {
            const auto at = static_cast<float>(i * 7 % count);
            boxes.insert(boxes.end(), {at, at * 0.5f, 0.0f, at + 0.5f, at * 0.5f + 2.0f, 1.0f});
        }
        const Buffer buffer = device.createBuffer(Buffer::FlagTracing, std::span(boxes), "boxes");
        Tracing& tracing = bottoms.emplace_back(device.createTracing("boxes"));
        tracing.addBoundBuffer(count, 24, buffer);
        EXPECT_THAT(tracing.create(Tracing::TypeBound, Tracing::FlagFastBuild | Tracing::FlagUpdate), IsOk());
        inputs.emplace_back(buffer, boxes);
    }
    /// What is built, at rest or where it is once updated. To a device or a list.
    template <class To>
    void setInputs(To& to, bool is_moved) {
        for (const auto& [buffer, values] : inputs) {
            std::vector<float> moved = values;
            // Boxes have six numbers each.
            for (size_t i = 0; is_moved && i < moved.size(); i++)
                moved[i] *= 1.0f + 0.1f * static_cast<float>(i / 6 % 5);
            to.setBuffer(buffer, 0, moved.data(), moved.size() * sizeof(float));
        }
    }

    detail::DeviceObject& device_object() { return *static_cast<detail::DeviceObject*>(device.object()); }
    void copyHeap(bool to_heap) {
        auto& other = *static_cast<detail::BufferObject*>(copy.object());
        detail::BufferObject& heap = device_object().heap()->texels();
        const Status status = device_object().playNow("heap", std::source_location::current(), [&](auto& core) {
            core.copyBuffer(to_heap ? heap : other, 0, to_heap ? other : heap, 0, heap_bytes);
        });
        EXPECT_THAT(status, IsOk());
    }
    std::vector<uint32_t> heap() {
        EXPECT_EQ(device_object().heap()->texels().size, heap_bytes) << "the heap has grown";
        copyHeap(false);
        return *device.read<uint32_t>(copy);
    }
    void setHeap(const std::vector<uint32_t>& words) {
        device.setBuffer(copy, 0, words.data(), heap_bytes);
        copyHeap(true);
    }

    /// Whose scratch memory: of each its own, parts of one, or the device's.
    enum class Memory { Own, Parts, Shared };
    void record(Compute& list, size_t i, Memory memory, bool update) {
        const Tracing& tracing = bottoms[i];
        const Buffer own = memory == Memory::Own ? device.createBuffer(Buffer::FlagScratch, scratch_part) : scratch;
        const uint64_t offset = memory == Memory::Own ? 0 : i * scratch_part;
        if (memory == Memory::Shared)
            update ? list.updateTracing(tracing) : list.buildTracing(tracing);
        else
            update ? list.updateTracing(tracing, own, offset) : list.buildTracing(tracing, own, offset);
    }
    std::vector<uint32_t> builtOneByOne(bool update) {
        for (size_t i = 0; i < bottoms.size(); i++) {
            Compute list = device.createCompute();
            record(list, i, Memory::Own, update);
            EXPECT_THAT(device.submit(list), IsOk());
        }
        for (const Tracing& top : tops) {
            Compute list = device.createCompute();
            list.buildTracing(top);
            EXPECT_THAT(device.submit(list), IsOk());
        }
        return heap();
    }
    std::vector<uint32_t> builtTogether(Memory memory, bool update) {
        Compute list = device.createCompute();
        for (size_t i = 0; i < bottoms.size(); i++) record(list, i, memory, update);
        for (const Tracing& top : tops) list.buildTracing(top);
        EXPECT_THAT(device.submit(list), IsOk());
        return heap();
    }

    MessageLog log;
    Device device;
    std::vector<Tracing> bottoms, tops;
    std::vector<std::pair<Buffer, std::vector<float>>> inputs;
    Buffer scratch, copy;
    uint64_t scratch_part = 0;
    uint64_t heap_bytes = 0;
};

TEST_P(SideBuilds, AreTheSameAsOneByOne) {
    const std::vector<uint32_t> empty(heap_bytes / 4, nothing);
    setHeap(empty);
    const std::vector<uint32_t> built = builtOneByOne(false);
    EXPECT_NE(built, empty);
    setInputs(device, true);
    const std::vector<uint32_t> updated = builtOneByOne(true);
    EXPECT_NE(updated, built);
    for (Memory memory : {Memory::Own, Memory::Parts, Memory::Shared}) {
        SCOPED_TRACE(static_cast<int>(memory));
        setHeap(empty);
        setInputs(device, false);
        EXPECT_TRUE(builtTogether(memory, false) == built);
        setInputs(device, true);
        EXPECT_TRUE(builtTogether(memory, true) == updated);
    }
}

// What comes in between in a list comes in between; what depends on what waits, or is built twice, follows.
TEST_P(SideBuilds, KeepTheirPlaceInTheList) {
    const std::vector<uint32_t> empty(heap_bytes / 4, nothing);
    setHeap(empty);
    const std::vector<uint32_t> built = builtOneByOne(false);
    setInputs(device, true);
    const std::vector<uint32_t> updated = builtOneByOne(true);
    setInputs(device, false);
    setHeap(empty);
    Compute list = device.createCompute();
    for (size_t i = 0; i < bottoms.size(); i++) {
        record(list, i, Memory::Shared, false);
        if (i % 3 == 0) record(list, i, Memory::Own, false);
    }
    setInputs(list, true);
    for (size_t i = 0; i < bottoms.size(); i++) record(list, i, Memory::Shared, true);
    for (const Tracing& top : tops) list.buildTracing(top);
    for (size_t i = 0; i < bottoms.size(); i++) record(list, i, Memory::Parts, true);
    for (const Tracing& top : tops) list.buildTracing(top);
    setInputs(list, false);
    ASSERT_THAT(device.submit(list), IsOk());
    EXPECT_TRUE(heap() == updated);
    EXPECT_TRUE(builtTogether(Memory::Shared, false) == built);
}

// Queued builds count as work that waits: what the host writes comes after.
TEST_P(SideBuilds, WaitInTheDevicesQueue) {
    const std::vector<uint32_t> empty(heap_bytes / 4, nothing);
    setHeap(empty);
    const std::vector<uint32_t> built = builtOneByOne(false);
    setHeap(empty);
    ASSERT_THAT(device.finish(), IsOk());
    for (const Tracing& bottom : bottoms) device.buildTracing(bottom);
    setInputs(device, true);
    for (const Tracing& top : tops) device.buildTracing(top);
    EXPECT_TRUE(heap() == built);
}

INSTANTIATE_TEST_SUITE_P(Forms, SideBuilds,
                         testing::Values(std::pair("texels", "packed"), std::pair("address", "full")),
                         [](const auto& test) { return std::string(test.param.first) + "_" + test.param.second; });

}  // namespace

}  // namespace glint::test
