// Acceleration structures on the null device: what is built, compacted and followed, in both engines.

#include "null_device.h"
#include "random_program.h"

#include <glint/device/detail/device_object.h>

#include <optional>

namespace glint::test {
namespace {

using NullTracing = NullDevice;

TEST_F(NullTracing, StructuresAreBuiltCompactedAndFollowed) {
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

TEST_F(NullTracing, CompactedStructuresCanBeUpdatedButNotBuiltAgain) {
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

TEST_F(NullTracing, TracesFollowWhatWasBuiltNotWhatWasSetSince) {
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
TEST_F(NullTracing, BuildsBesideEachOtherShareBarriers) {
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
TEST_F(NullTracing, StructuresStayWhereASubmissionWritesThem) {
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

TEST_F(NullTracing, StructuresWhoseUploadFailsAreUnbuilt) {
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
        EXPECT_EQ(status.error().file(), "null_tracing_test.cpp");
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

}  // namespace
}  // namespace glint::test
