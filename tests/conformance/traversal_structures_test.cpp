// What ray-tracing pipelines see of structures, whoever answers ray queries: builds, updates, compaction, instances.

#include "conformance/traversal_scene.h"

#include <glint/geometry/primitives.h>

namespace glint::test {

namespace {

/// The same rays as look_down, by a query.
constexpr const char* query_down = R"(
layout(local_size_x = 1) in;
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, std430) writeonly buffer Results { uint results[]; };
void main() {
    vec3 origin = vec3(float(gl_GlobalInvocationID.x) + 0.5, 0.25, 10.0);
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xff, origin, 0.0, vec3(0.0, 0.0, -1.0), 100.0);
    while (rayQueryProceedEXT(query)) {}
    bool is_hit = rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT;
    results[gl_GlobalInvocationID.x] = is_hit ? uint(rayQueryGetIntersectionTEXT(query, true) * 4.0) : 1u;
}
)";

const char* const hit_distance = "uint(gl_HitTEXT * 4.0)";

class TraversalStructures : public TraversalTest {
protected:
    /// Quarters of a distance, or 1. Made once for a test: it may take seconds to compile.
    Traversal makeDistances() {
        if (!distances_)
            distances_ = makeTraversal({{Shader::TypeRayGen, look_down, {}},
                                        {Shader::TypeRayMiss, setPayload("1u"), {}},
                                        {Shader::TypeClosest, setPayload(hit_distance), {}}});
        return distances_;
    }

    Words queryDown(const Tracing& scene, size_t count) {
        const Buffer results = makeBuffer(Words(count, 0xdeadu));
        if (!query_) query_ = makeKernel(query_down);
        compute([&](Compute& list) {
            list.setKernel(query_);
            list.setTracing(0, scene);
            list.setStorageBuffer(0, results);
            list.dispatch(count);
        });
        return read<uint32_t>(results);
    }

    /// Rays of either kind see this.
    void expectBoth(const Tracing& scene, const Words& expected) {
        EXPECT_EQ(lookDown(makeDistances(), scene, expected.size()), expected);
        if (device.getFeatures().computeTracing) { EXPECT_EQ(queryDown(scene, expected.size()), expected); }
    }

private:
    Traversal distances_;
    Kernel query_;
};

}  // namespace

TEST_F(TraversalStructures, BuiltOneByOneAndInLists) {
    for (const Tracing::Flags flags : {Tracing::Flags(Tracing::FlagFastTrace), Tracing::Flags(Tracing::FlagFastBuild)})
        for (const bool in_list : {false, true}) {
            SCOPED_TRACE(testing::Message() << flags << " " << in_list);
            Tracing square = device.createTracing("square");
            square.addVertexBuffer(6, FormatRGBf32, 12, makeBuffer(corners(1), Buffer::FlagTracing));
            ASSERT_THAT(square.create(Tracing::TypeTriangle, flags), IsOk());
            Tracing scene = device.createTracing({place(square)});
            if (in_list) {
                compute([&](Compute& list) {
                    list.buildTracing(square);
                    list.buildTracing(scene);
                });
            } else {
                device.buildTracing(square);
                device.buildTracing(scene);
            }
            expectBoth(scene, {1, 40, 1});
        }
}

TEST_F(TraversalStructures, UpdatedWithTheirVertices) {
    const Buffer vertices = makeBuffer(corners(0), Buffer::FlagTracing);
    Tracing square = device.createTracing("square");
    square.addVertexBuffer(6, FormatRGBf32, 12, vertices);
    ASSERT_THAT(square.create(Tracing::TypeTriangle, Tracing::FlagUpdate | Tracing::FlagFastTrace), IsOk());
    build(square);
    const Tracing scene = makeTop({place(square)});
    expectBoth(scene, {40, 1, 1});
    for (const float z : {1.0f, -3.0f}) {
        device.setBuffer(vertices, std::span<const float>(corners(1, z)));
        compute([&](Compute& list) {
            list.updateTracing(square);
            list.buildTracing(scene);
        });
        expectBoth(scene, {1, static_cast<uint32_t>(40 - 4 * z), 1});
    }
}

TEST_F(TraversalStructures, InstancesMoveFromFrameToFrame) {
    const Tracing square = makeSquares({0});
    const Tracing lower = makeSquares({0}, -1);
    Tracing scene = device.createTracing("scene");
    scene.setInstances(3);
    ASSERT_THAT(scene.create(Tracing::TypeInstance, Tracing::FlagFastBuild | Tracing::FlagUpdate), IsOk());
    const Traversal traversal = makeDistances();
    const std::vector<std::vector<Tracing::Instance>> frames = {
        {place(square)},
        {place(square, 1), place(lower)},
        {place(lower, 1), Tracing::Instance(), place(square, 2)},
        {}};
    const std::vector<Words> expected = {{40, 1, 1}, {44, 40, 1}, {1, 44, 40}, {1, 1, 1}};
    for (size_t frame = 0; frame < frames.size(); frame++) {
        SCOPED_TRACE(frame);
        const Buffer results = makeBuffer(Words(3, 0xdeadu));
        compute([&](Compute& list) {
            list.setInstances(scene, frames[frame]);
            list.buildTracing(scene);
            list.setTraversal(traversal);
            list.setTracing(0, scene);
            list.setStorageBuffer(0, results);
            list.setPushConstants(RayArguments());
            list.dispatch(3);
        });
        EXPECT_EQ(read<uint32_t>(results), expected[frame]);
    }
}

TEST_F(TraversalStructures, CompactedOnes) {
    std::vector<Tracing> all;
    std::vector<Tracing::Instance> instances;
    all.reserve(5);
    for (uint32_t i = 0; i < 5; i++) {
        Tracing& square = all.emplace_back(device.createTracing("square"));
        const auto flags =
            i == 2 ? Tracing::Flags(Tracing::FlagFastTrace) : Tracing::FlagFastTrace | Tracing::FlagCompact;
        square.addVertexBuffer(6, FormatRGBf32, 12, makeBuffer(corners(0), Buffer::FlagTracing));
        ASSERT_THAT(square.create(Tracing::TypeTriangle, flags), IsOk());
        instances.push_back(place(square, static_cast<float>(i), static_cast<float>(i)));
    }
    all.push_back(device.createTracing(instances));
    ASSERT_THAT(device.buildTracings(all, Buffer(), Tracing::FlagCompact), IsOk());
    expectBoth(all.back(), {40, 36, 32, 28, 24, 1});
    Tracing again = all[0];
    expectError("tracing.compacted", [&] { return device.buildTracings({again}); });
}

TEST_F(TraversalStructures, BoxesAndTrianglesSideBySide) {
    const Tracing square = makeSquares({0});
    const Tracing boxes = makeBoxes({{1, 0, -1, 2, 1, 1}, {2, 0, -1, 3, 1, 1}});
    const Tracing scene = makeTop({place(square), place(boxes, 0, 0, 1)});
    const Traversal traversal =
        makeTraversal({{Shader::TypeRayGen, look_down, {}},
                       {Shader::TypeRayMiss, setPayload("1u"), {}},
                       {Shader::TypeClosest, setPayload("2u"), {}},
                       {Shader::TypeClosest, setPayload("10u + gl_PrimitiveID"), {}},
                       {Shader::TypeIntersection,
                        "void main() { reportIntersectionEXT(gl_ObjectRayOriginEXT.z - 1.0, 0u); }\n",
                        {}}});
    EXPECT_EQ(traversal.getHitGroups(), 2u);
    EXPECT_EQ(lookDown(traversal, scene, 4), (Words{2, 10, 11, 1}));
    // An empty group is for either: the triangles are hit, the boxes are not.
    const Traversal empty = makeTraversal(
        {{Shader::TypeRayGen, look_down, {}}, {Shader::TypeRayMiss, setPayload("1u"), {}}}, [](Traversal& made) {
            made.addHitGroup();
            made.addHitRecord(0);
            made.addHitRecord(0);
        });
    EXPECT_EQ(lookDown(empty, scene, 4), (Words{7, 1, 1, 1}));
}

TEST_F(TraversalStructures, ListsThatAreDroppedBuildNothing) {
    const Tracing square = makeSquares({0});
    Tracing scene = device.createTracing({place(square)});
    {
        Compute list = device.createCompute();
        list.buildTracing(scene);
    }
    expectError("bind.tracing_unbuilt", [&] {
        Compute list = device.createCompute();
        list.setTraversal(makeDistances());
        list.setTracing(0, scene);
        return device.submit(list);
    });
    build(scene);
    expectBoth(scene, {40, 1});
}

TEST_F(TraversalStructures, QueriesInHitShaders) {
    if (!device.getFeatures().computeTracing) GTEST_SKIP() << "the device has no ray queries";
    const Tracing square = makeSquares({0});
    const Tracing scene = makeTop({place(square)});
    Traversal traversal = device.createTraversal("traversal");
    traversal.createShaderGLSL(Shader::TypeRayGen, look_down);
    traversal.createShaderGLSL(Shader::TypeRayMiss, setPayload("1u"));
    traversal.createShaderGLSL(Shader::TypeClosest, R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(location = 0) rayPayloadInEXT uint payload;
void main() {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xff, vec3(0.5, 0.25, 3.0), 0.0, vec3(0.0, 0.0, -1.0), 9.0);
    while (rayQueryProceedEXT(query)) {}
    payload = 100u + uint(rayQueryGetIntersectionTEXT(query, true));
}
)");
    ASSERT_THAT(traversal.create(), IsOk());
    EXPECT_EQ(lookDown(traversal, scene, 2), (Words{103, 1}));
}

TEST_F(TraversalStructures, ManyShareAScratchBuffer) {
    // For the driver's builds more than one batch.
    std::vector<Tracing> all;
    std::vector<Tracing::Instance> instances;
    constexpr uint32_t count = 24;
    all.reserve(count + 1);
    for (uint32_t i = 0; i < count; i++) {
        Tracing& square = all.emplace_back(device.createTracing("square"));
        square.addVertexBuffer(6, FormatRGBf32, 12, makeBuffer(corners(0), Buffer::FlagTracing));
        ASSERT_THAT(square.create(Tracing::TypeTriangle), IsOk());
        instances.push_back(place(square, static_cast<float>(i)));
    }
    all.push_back(device.createTracing(instances));
    uint64_t largest = 0;
    for (const Tracing& tracing : all) largest = std::max(largest, tracing.getBuildSize());
    const Buffer scratch = device.createBuffer(Buffer::FlagScratch, largest, "scratch");
    ASSERT_THAT(device.buildTracings(all, scratch), IsOk());
    Words expected(count, 40);
    expected.push_back(1);
    expectBoth(all.back(), expected);
}

}  // namespace glint::test
