// Ray-tracing pipelines on the null device, whose checker judges what they read and write: the driver's, and joined
// into kernels over ray queries of the driver's and of the software engine.

#include "support/matchers.h"

#include <glint/device/detail/object.h>
#include <glint/device/device.h>
#include <platform/null/null_control.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

namespace glint::test {
namespace {

using null::HazardChecker;
using null::NullControl;

constexpr FeatureMask queries = FeatureComputeTracing | FeatureFragmentTracing;

enum class Form : uint8_t { Driver, JoinedOverDriver, JoinedOverSoftware };
const char* nameOf(Form form) {
    return form == Form::Driver ? "Driver" : form == Form::JoinedOverDriver ? "JoinedOverDriver" : "JoinedOverSoftware";
}

class TraversalOnNull : public testing::TestWithParam<Form> {
protected:
    void SetUp() override {
        const null::ScopedSettings settings(
            {.missing = GetParam() == Form::JoinedOverDriver ? FeatureRayTracing : FeatureNone});
        const TracingEngine engines[] = {TracingEngine::Driver, TracingEngine::Auto, TracingEngine::Software};
        const TracingEngine engine = engines[static_cast<size_t>(GetParam())];
        device = Device::create({.api = "null", .tracing = engine, .message = [this](const Message& message) {
                                     if (!is_failing) ADD_FAILURE() << message.error.text();
                                 }});
        ASSERT_TRUE(device) << device.error().text();
        control = NullControl::last();
        traversal = device.createTraversal("traversal");
        traversal.setShader(Shader::createGLSL(Shader::TypeRayGen, R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, std430) readonly buffer From { uint from[]; };
layout(binding = 2, std430) writeonly buffer To { uint to[]; };
layout(location = 0) rayPayloadEXT uint payload;
void main() {
    traceRayEXT(scene, 0u, 0xff, 0, 0, 0, vec3(0.0), 0.0, vec3(1.0), 1.0, 0);
    to[gl_LaunchIDEXT.x] = from[gl_LaunchIDEXT.x] + payload;
})"));
        traversal.addHitGroup();
        ASSERT_THAT(traversal.create(), IsOk());
        vertices = device.createBuffer(Buffer::FlagTracing, 36, "vertices");
        for (Buffer& buffer : buffers) {
            buffer = device.createBuffer(Buffer::FlagStorage | Buffer::FlagIndirect, 64, "buffer");
            ASSERT_TRUE(buffer);
        }
    }
    void TearDown() override {
        device = {};
        traversal = {};
        vertices = {};
        for (Buffer& buffer : buffers) buffer = {};
        EXPECT_EQ(control->counters().objects, 0u);
        EXPECT_EQ(control->counters().bytes, 0u);
        for (const Error& finding : control->findings()) ADD_FAILURE() << finding.text();
    }

    Tracing makeBottom(Tracing::Flags flags = Tracing::FlagFastTrace) {
        Tracing bottom = device.createTracing("bottom");
        bottom.addVertexBuffer(3, FormatRGBf32, 12, vertices);
        EXPECT_THAT(bottom.create(Tracing::TypeTriangle, flags), IsOk());
        device.buildTracing(bottom);
        return bottom;
    }
    Tracing makeTop(const Tracing& bottom) {
        Tracing top = device.createTracing({Tracing::Instance{.tracing = &bottom}});
        device.buildTracing(top);
        return top;
    }
    void trace(Compute& list, const Tracing& top, const Buffer& from, const Buffer& to) {
        list.setTraversal(traversal);
        list.setTracing(0, top);
        list.setStorageBuffers(0, {from, to});
        list.dispatch(16);
    }
    /// Memory barriers of a list.
    template <class Record>
    uint64_t barriers(Record&& record) {
        EXPECT_THAT(device.flush(), IsOk());
        const uint64_t before = control->counters().barriers;
        Compute list = device.createCompute();
        record(list);
        EXPECT_THAT(device.submit(list), IsOk());
        return control->counters().barriers - before;
    }

    bool isJoined() const { return GetParam() != Form::Driver; }

    bool is_failing = false;  ///< on purpose
    Device device;
    std::shared_ptr<NullControl> control;
    Traversal traversal;
    Buffer vertices;
    std::array<Buffer, 3> buffers;
};

TEST_P(TraversalOnNull, RaysWaitForRays) {
    const Tracing bottom = makeBottom();
    const Tracing top = makeTop(bottom);
    barriers([&](Compute& list) { trace(list, top, buffers[0], buffers[1]); });
    // Those that read what others read need not wait; those that read what others wrote do.
    EXPECT_EQ(barriers([&](Compute& list) { trace(list, top, buffers[0], buffers[2]); }), 0u);
    EXPECT_EQ(barriers([&](Compute& list) {
                  trace(list, top, buffers[2], buffers[1]);
                  trace(list, top, buffers[2], buffers[0]);
                  trace(list, top, buffers[0], buffers[2]);
              }),
              2u);
}

TEST_P(TraversalOnNull, RaysWaitForBuilds) {
    const Tracing bottom = makeBottom(Tracing::FlagUpdate);
    const Tracing top = makeTop(bottom);
    for (int frame = 0; frame < 3; frame++) {
        EXPECT_GT(barriers([&](Compute& list) {
                      list.updateTracing(bottom);
                      list.buildTracing(top);
                      trace(list, top, buffers[0], buffers[1]);
                  }),
                  1u);
        // Nothing has been built since.
        EXPECT_EQ(barriers([&](Compute& list) { trace(list, top, buffers[0], buffers[2]); }), 0u);
    }
}

TEST_P(TraversalOnNull, CountsWaitForWhoWritesThem) {
    const Tracing bottom = makeBottom();
    const Tracing top = makeTop(bottom);
    barriers([&](Compute& list) { trace(list, top, buffers[0], buffers[1]); });
    EXPECT_EQ(barriers([&](Compute& list) {
                  list.clearBuffer(buffers[2]);
                  list.setTraversal(traversal);
                  list.setTracing(0, top);
                  list.setStorageBuffers(0, {buffers[0], buffers[1]});
                  list.dispatchIndirect(buffers[2], 16);
              }),
              // One for all: what the rays wrote, and the counts. Joined, they are copied, judged, and read.
              isJoined() ? 3u : 1u);
}

TEST_P(TraversalOnNull, TracesFollowWhatWasBuilt) {
    Tracing first = makeBottom();
    const Tracing second = makeBottom();
    const Tracing top = makeTop(first);
    const auto look = [&] { barriers([&](Compute& list) { trace(list, top, buffers[0], buffers[1]); }); };
    look();
    const Tracing::Instance next = {.tracing = &second};
    device.setTracing(top, {&next, 1});
    first = {};
    look();
    device.buildTracing(top);
    look();
    EXPECT_THAT(device.finish(), IsOk());
}

TEST_P(TraversalOnNull, TakesWhatNobodyCalls) {
    const auto create = [&](const char* miss) {
        Traversal made = device.createTraversal("made");
        made.createShaderGLSL(Shader::TypeRayGen, R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, std430) writeonly buffer To { float to[]; };
layout(push_constant) uniform Push { int chosen; };
layout(location = 0) rayPayloadEXT vec3 color;
void main() {
    traceRayEXT(scene, 0u, 0xff, 0, 0, MISS, vec3(0.0), 0.0, vec3(1.0), 1.0, 0);
    to[0] = color.x;
})",
                              std::string("MISS=") + miss);
        made.createShaderGLSL(Shader::TypeRayMiss,
                              "layout(location = 0) rayPayloadInEXT vec3 color;\nvoid main() { color = vec3(1.0); }");
        made.createShaderGLSL(Shader::TypeRayMiss,
                              "layout(location = 1) rayPayloadInEXT float visible;\nvoid main() { visible = 1.0; }");
        return made.create();
    };
    EXPECT_THAT(create("0"), IsOk());
    is_failing = true;
    EXPECT_THAT(create("1"), HasErrorId("traversal.payload"));
    EXPECT_THAT(create("chosen"), HasErrorId("traversal.payload"));
    is_failing = false;
}

TEST_P(TraversalOnNull, GoesWhenTheQueueHasPassedIt) {
    const Tracing bottom = makeBottom();
    Tracing top = makeTop(bottom);
    EXPECT_THAT(device.finish(), IsOk());
    control->hold(Queue::Main);
    barriers([&](Compute& list) { trace(list, top, buffers[0], buffers[1]); });
    const uint64_t objects = control->counters().objects;
    traversal = {};
    // A joined one has memory for counts that no list has used.
    EXPECT_EQ(control->counters().objects, objects - isJoined());
    top = {};
    control->release(Queue::Main);
    EXPECT_THAT(device.finish(), IsOk());
    EXPECT_LT(control->counters().objects, objects - 1);
}

TEST_P(TraversalOnNull, CompactedStructuresAreTraced) {
    Tracing bottom = device.createTracing("bottom");
    bottom.addVertexBuffer(3, FormatRGBf32, 12, vertices);
    ASSERT_THAT(bottom.create(Tracing::TypeTriangle, Tracing::FlagCompact | Tracing::FlagUpdate), IsOk());
    Tracing top = device.createTracing({Tracing::Instance{.tracing = &bottom}});
    ASSERT_THAT(device.buildTracings({bottom, top}, Tracing::FlagCompact), IsOk());
    barriers([&](Compute& list) { trace(list, top, buffers[0], buffers[1]); });
    EXPECT_GT(barriers([&](Compute& list) {
                  list.updateTracing(bottom);
                  list.buildTracing(top);
                  trace(list, top, buffers[0], buffers[1]);
              }),
              1u);
}

TEST_P(TraversalOnNull, BuildsSideBySideHaveScratchMemoryOfTheirOwn) {
    uint64_t largest = 0;
    control->setObserver([&](const detail::Submission& submission, const HazardChecker&) {
        for (const detail::ResolvedList& resolved : submission.lists)
            detail::forEachCommand(*resolved.list, [&](uint32_t, const detail::CommandHeader& header) {
                if (header.type != detail::CommandType::BuildTracings) return;
                const auto& command = reinterpret_cast<const detail::BuildTracingsCommand&>(header);
                const auto* builds = resolved.list->at<detail::TracingBuild>(command.builds);
                uint64_t end = 0;
                for (uint32_t i = 0; i < command.count; i++) {
                    const auto& object =
                        *static_cast<const detail::TracingObject*>(resolved.list->resources[builds[i].tracing]);
                    const detail::NativeTracing& native = *object.nativeTracing();
                    EXPECT_GE(builds[i].scratch_offset, end);
                    end = builds[i].scratch_offset + (builds[i].update ? native.update_size : native.build_size);
                }
                largest = std::max<uint64_t>(largest, command.count);
            });
    });
    std::vector<Tracing> all;
    std::vector<Tracing::Instance> instances;
    all.reserve(8);
    for (int i = 0; i < 8; i++) {
        all.push_back(device.createTracing("bottom"));
        all.back().addVertexBuffer(3, FormatRGBf32, 12, vertices);
        const Tracing::Flags compact = i % 2 ? Tracing::FlagCompact : Tracing::FlagNone;
        ASSERT_THAT(all.back().create(Tracing::TypeTriangle, Tracing::FlagUpdate | compact), IsOk());
        instances.push_back({.tracing = &all.back()});
    }
    ASSERT_THAT(device.buildTracings(all, Buffer(), Tracing::FlagCompact), IsOk());
    EXPECT_EQ(largest, GetParam() == Form::JoinedOverSoftware ? 0u : 8u);
    const Tracing top = device.createTracing(instances);
    // Compacted structures have no size of a build any more, only that of an update.
    barriers([&](Compute& list) {
        for (const Tracing& bottom : all) list.updateTracing(bottom);
        list.buildTracing(top);
        trace(list, top, buffers[0], buffers[1]);
    });
    control->setObserver({});
}

INSTANTIATE_TEST_SUITE_P(Engines, TraversalOnNull,
                         testing::Values(Form::Driver, Form::JoinedOverDriver, Form::JoinedOverSoftware),
                         [](const auto& test) { return std::string(nameOf(test.param)); });

TEST(TraversalChoice, FollowsWhatWasAskedForAndIsThere) {
    using enum TracingEngine;
    struct Case {
        TracingEngine wanted;
        FeatureMask missing, optional;
        TracingEngine traversal, tracing;
        FeatureMask offered;  ///< of the three
    };
    constexpr FeatureMask compute = FeatureComputeTracing, pipelines = FeatureRayTracing, all = queries | pipelines;
    const Case cases[] = {
        {Auto, FeatureNone, queries, Driver, Driver, all},
        {Auto, queries, queries, Software, Software, all},
        {Auto, FeatureFragmentTracing, queries, Software, Software, all},
        {Auto, FeatureFragmentTracing, compute, Driver, Driver, compute | pipelines},
        {Auto, pipelines, queries, Software, Driver, all},
        {Auto, all, queries, Software, Software, all},
        // Without queries asked for, they come along only where pipelines become queries.
        {Auto, FeatureNone, FeatureNone, Driver, Driver, pipelines},
        {Auto, queries, FeatureNone, Software, Software, compute | pipelines},
        {Auto, pipelines, FeatureNone, Software, Driver, compute | pipelines},
        {Auto, pipelines | compute, FeatureFragmentTracing, Software, Software, all},
        {Driver, FeatureNone, queries, Driver, Driver, all},
        {Driver, queries, queries, Driver, Driver, pipelines},
        {Driver, FeatureNone, FeatureNone, Driver, Driver, pipelines},
        {Software, FeatureNone, queries, Software, Software, all},
        {Software, all, FeatureNone, Software, Software, compute | pipelines},
    };
    for (const Case& item : cases) {
        SCOPED_TRACE(toString(item.wanted) + (" without " + featureNames(item.missing)) + ", asked for " +
                     featureNames(item.optional));
        const null::ScopedSettings settings({.missing = item.missing});
        Device device = Device::create(
            {.api = "null", .required = FeatureRayTracing, .optional = item.optional, .tracing = item.wanted});
        ASSERT_THAT(device, IsOk());
        const Features& features = device.getFeatures();
        EXPECT_EQ(features.mask, item.offered);
        EXPECT_EQ(features.traversalEngine, item.traversal);
        EXPECT_EQ(features.tracingEngine, item.tracing);
        EXPECT_EQ(device.createTraversal().state(), ObjectState::Building);
    }
}

TEST(TraversalChoice, IsNamedWithItsReason) {
    const auto reasons = [](FeatureMask missing) {
        const null::ScopedSettings settings({.missing = missing});
        const DeviceInfo info = Device::create({.api = "null"}).getInfo();
        return std::pair(info.traversal, info.tracing);
    };
    using testing::HasSubstr, testing::Pair;
    EXPECT_THAT(reasons(FeatureNone), Pair("driver (the driver's, on a device that is no CPU)",
                                           "driver (the driver's, on a device that is no CPU)"));
    EXPECT_THAT(reasons(queries), Pair("software (the driver lacks computeTracing, fragmentTracing)",
                                       HasSubstr("(the driver lacks computeTracing, fragmentTracing)")));
    EXPECT_THAT(reasons(FeatureRayTracing),
                Pair("software (the driver lacks rayTracing)", "driver (the driver's, on a device that is no CPU)"));
}

TEST(TraversalChoice, MayBeNone) {
    using enum TracingEngine;
    const null::ScopedSettings settings({.missing = FeatureRayTracing});
    const auto ignore = [](const Message&) {};
    Device driver = Device::create({.api = "null", .tracing = Driver, .message = ignore});
    EXPECT_FALSE(driver.getFeatures().rayTracing);
    EXPECT_EQ(driver.getInfo().traversal, "none (the driver offers no ray-tracing pipelines)");
    EXPECT_THAT(driver.createTraversal(), HasErrorId("device.unsupported"));
    Device bare = Device::create({.api = "null", .optional = queries, .message = ignore});
    EXPECT_FALSE(bare.getFeatures().rayTracing);
    EXPECT_EQ(bare.getInfo().traversal, "none (no ray-tracing pipelines asked for)");
    EXPECT_THAT(bare.createTraversal(), HasErrorId("device.unsupported"));
}

TEST(TraversalChoice, QueriesInStagesAreThoseOfTheDevice) {
    const auto create = [](FeatureMask missing, TracingEngine engine) {
        const null::ScopedSettings settings({.missing = missing});
        Device device = Device::create({.api = "null", .tracing = engine, .message = [](const Message&) {}});
        Traversal traversal = device.createTraversal("traversal");
        traversal.createShaderGLSL(Shader::TypeRayGen, R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
void main() {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, 0u, 0xff, vec3(0.0), 0.0, vec3(1.0), 1.0);
    rayQueryProceedEXT(query);
})");
        return traversal.create();
    };
    EXPECT_THAT(create(FeatureNone, TracingEngine::Driver), IsOk());
    EXPECT_THAT(create(queries, TracingEngine::Auto), IsOk());
    EXPECT_THAT(create(queries, TracingEngine::Driver), HasErrorId("program.feature"));
}

}  // namespace
}  // namespace glint::test
