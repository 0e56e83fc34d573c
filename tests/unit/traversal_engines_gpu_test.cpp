// Ray-tracing pipelines on devices that lack them, or ray queries, or both: the same rays see the same everywhere.

#include "conformance/traversal_scene.h"
#include "support/hiding_backend.h"

namespace glint::test {

namespace {

constexpr FeatureMask queries = FeatureComputeTracing | FeatureFragmentTracing;

class TraversalEngines : public TraversalTest {
protected:
    void SetUp() override {}

    void open(FeatureMask hidden) {
        device = createHiding(hidden, log.callback());
        ASSERT_TRUE(device);
        EXPECT_EQ(offered() & hidden, 0u);
    }
    /// What the driver's device was made with.
    FeatureMask offered() const {
        return static_cast<detail::DeviceObject*>(device.object())->backend->features().mask;
    }

    /// Whether structures are the software engine's.
    bool hasHeap() const { return static_cast<detail::DeviceObject*>(device.object())->heap() != nullptr; }

    Traversal makeDown() {
        return makeTraversal({{Shader::TypeRayGen, look_down, {}},
                              {Shader::TypeRayMiss, setPayload("1u"), {}},
                              {Shader::TypeClosest, setPayload("uint(gl_HitTEXT * 4.0)"), {}}});
    }
    /// Rays of a pipeline see a square at 1, its second place at 3, and nothing between.
    void expectSeen() {
        const Traversal traversal = makeDown();
        const Tracing square = makeSquares({1});
        const Tracing scene = makeTop({place(square), place(square, 2, -2)});
        EXPECT_EQ(lookDown(traversal, scene, 4), (Words{1, 40, 1, 48}));
    }
};

}  // namespace

TEST_F(TraversalEngines, NeitherQueriesNorPipelines) {
    open(queries | FeatureRayTracing);
    const Features& features = device.getFeatures();
    EXPECT_TRUE(features.rayTracing);
    EXPECT_EQ(features.traversalEngine, TracingEngine::Software);
    EXPECT_EQ(features.tracingEngine, TracingEngine::Software);
    EXPECT_GE(features.recursionDepth, 1u);
    EXPECT_EQ(features.maxRays, 1u << 30);
    EXPECT_EQ(features.maxRecordSize, 4096u);
    EXPECT_EQ(features.maxAttributeSize, 32u);
    EXPECT_TRUE(features.indirectRays);
    EXPECT_THAT(device.getInfo().traversal, testing::HasSubstr("software (the driver lacks rayTracing)"));
    expectSeen();
}

// What the pipelines are joined into is answered by the driver's ray queries: no structure is the software engine's.
TEST_F(TraversalEngines, QueriesWithoutPipelines) {
    open(FeatureRayTracing);
    if (const FeatureMask lacking = queries & ~offered())
        GTEST_SKIP() << "'" << device.getInfo().name << "' lacks " << featureNames(lacking);
    EXPECT_EQ(device.getFeatures().traversalEngine, TracingEngine::Software);
    EXPECT_EQ(device.getFeatures().tracingEngine, TracingEngine::Driver);
    EXPECT_FALSE(hasHeap());
    expectSeen();
}

// Pipelines are joined although the driver has them: its structures would not serve the software engine's queries.
TEST_F(TraversalEngines, PipelinesWithoutQueries) {
    open(queries);
    EXPECT_EQ(device.getFeatures().traversalEngine, TracingEngine::Software);
    EXPECT_EQ(device.getFeatures().tracingEngine, TracingEngine::Software);
    EXPECT_TRUE(hasHeap());
    expectSeen();
}

// Asked for, the driver's pipelines need none of its queries.
TEST_F(TraversalEngines, DriverLeavesQueriesAlone) {
    device = Device::create({.optional = FeatureRayTracing,
                             .tracing = TracingEngine::Driver,
                             .validation = DeviceDesc::Validation::On,
                             .message = log.callback()});
    ASSERT_TRUE(device) << device.error().text();
    GLINT_NEED_FEATURE(FeatureRayTracing);
    EXPECT_EQ(offered() & queries, 0u);
    EXPECT_EQ(device.getFeatures().traversalEngine, TracingEngine::Driver);
    EXPECT_FALSE(device.getFeatures().computeTracing);
    EXPECT_FALSE(hasHeap());
    expectSeen();
}

// Asked for, the software engine needs nothing of the driver's, whatever the driver offers.
TEST_F(TraversalEngines, SoftwareLeavesTheDriversAlone) {
    device = Device::create({.required = FeatureRayTracing,
                             .tracing = TracingEngine::Software,
                             .validation = DeviceDesc::Validation::On,
                             .message = log.callback()});
    ASSERT_TRUE(device) << device.error().text();
    EXPECT_EQ(offered() & (queries | FeatureRayTracing), 0u);
    EXPECT_EQ(device.getFeatures().traversalEngine, TracingEngine::Software);
    expectSeen();
}

}  // namespace glint::test
