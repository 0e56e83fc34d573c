// Ray-tracing pipelines: what each stage may do, and what rays ask for.

#include "conformance/traversal_scene.h"

#include <bit>
#include <limits>

namespace glint::test {

namespace {

const RayShader down = {Shader::TypeRayGen, look_down, {}};
const RayShader miss_one = {Shader::TypeRayMiss, setPayload("1u"), {}};
const RayShader closest_instance = {Shader::TypeClosest, setPayload("10u + gl_InstanceCustomIndexEXT"), {}};

class TraversalStages : public TraversalTest {
protected:
    /// Squares at x = 0, one above the other, with custom indices 0, 1, ... from above.
    Tracing makeTower(uint32_t count, Tracing::Flags flags) {
        square_ = makeSquares({0}, 0, flags);
        std::vector<Tracing::Instance> instances;
        for (uint32_t i = 0; i < count; i++) {
            instances.push_back(place(square_, 0, -static_cast<float>(i)));
            instances.back().data = i;
        }
        return makeTop(instances);
    }

private:
    Tracing square_;
};

constexpr Tracing::Flags transparent = Tracing::FlagFastTrace | Tracing::FlagTransparent;

}  // namespace

TEST_F(TraversalStages, MasksOfRaysAndInstances) {
    const Tracing square = makeSquares({0});
    std::vector<Tracing::Instance> instances;
    for (uint32_t i = 0; i < 4; i++) {
        instances.push_back(place(square, static_cast<float>(i)));
        instances.back().mask = i == 3 ? 0xffu : 1u << i;
    }
    const Tracing scene = makeTop(instances);
    const Traversal traversal = makeTraversal({down, miss_one, {Shader::TypeClosest, setPayload("2u"), {}}});
    for (const uint32_t mask : {0u, 1u, 2u, 5u, 0x80u, 0xffu}) {
        SCOPED_TRACE(mask);
        Words expected;
        for (const Tracing::Instance& instance : instances) expected.push_back(instance.mask & mask ? 2 : 1);
        EXPECT_EQ(lookDown(traversal, scene, 4, {.mask = mask}), expected);
    }
}

TEST_F(TraversalStages, FacesAreCulled) {
    // As it is, seen from behind, flipped, flipped and seen from behind, from behind without culling.
    const Tracing square = makeSquares({0});
    std::vector<Tracing::Instance> instances;
    const bool behind[] = {false, true, false, true, true};
    const uint32_t flags[] = {0, 0, Tracing::InstanceFlipFacing, Tracing::InstanceFlipFacing,
                              Tracing::InstanceCullDisable};
    for (uint32_t i = 0; i < 5; i++) {
        instances.push_back(place(square, static_cast<float>(i)));
        Tracing::Instance& instance = instances.back();
        instance.flags = flags[i];
        if (!behind[i]) continue;
        // Turned about an axis along x: no mirror, the same place.
        instance.transform[5] = instance.transform[10] = -1;
        instance.transform[7] = 1;
    }
    const Tracing scene = makeTop(instances);
    const Traversal traversal = makeTraversal({down, miss_one, {Shader::TypeClosest, setPayload("gl_HitKindEXT"), {}}});
    constexpr uint32_t front = 0xfe, back = 0xff;
    EXPECT_EQ(lookDown(traversal, scene, 5), (Words{front, back, back, front, back}));
    EXPECT_EQ(lookDown(traversal, scene, 5, {.flags = RayCullBack}), (Words{front, 1, 1, front, back}));
    EXPECT_EQ(lookDown(traversal, scene, 5, {.flags = RayCullFront}), (Words{1, back, back, 1, back}));
}

TEST_F(TraversalStages, OpaqueAndTransparentAreCulled) {
    const Tracing opaque = makeSquares({0});
    const Tracing clear = makeSquares({1}, 0, transparent);
    const Tracing scene = makeTop({place(opaque), place(clear)});
    const Traversal traversal = makeTraversal({down, miss_one, {Shader::TypeClosest, setPayload("2u"), {}}});
    EXPECT_EQ(lookDown(traversal, scene, 2), (Words{2, 2}));
    EXPECT_EQ(lookDown(traversal, scene, 2, {.flags = RayCullOpaque}), (Words{1, 2}));
    EXPECT_EQ(lookDown(traversal, scene, 2, {.flags = RayCullTransparent}), (Words{2, 1}));
    EXPECT_EQ(lookDown(traversal, scene, 2, {.flags = RayOpaque | RayCullOpaque}), (Words{1, 1}));
}

TEST_F(TraversalStages, AnyHitIgnores) {
    const Tracing scene = makeTower(4, transparent);
    const auto ignoring = [&](std::string_view which) {
        return makeTraversal(
            {down,
             miss_one,
             closest_instance,
             {Shader::TypeFirstHit, "void main() { if (" + std::string(which) + ") ignoreIntersectionEXT; }\n", {}}});
    };
    EXPECT_EQ(lookDown(ignoring("false"), scene, 2), (Words{10, 1}));
    EXPECT_EQ(lookDown(ignoring("gl_InstanceCustomIndexEXT < 2"), scene, 2), (Words{12, 1}));
    const Traversal all = ignoring("true");
    EXPECT_EQ(lookDown(all, scene, 2), (Words{1, 1}));
    // Opaque hits are nobody's to ignore.
    EXPECT_EQ(lookDown(all, scene, 2, {.flags = RayOpaque}), (Words{10, 1}));
    EXPECT_EQ(lookDown(all, makeTower(2, Tracing::FlagFastTrace), 1), (Words{10}));
    EXPECT_EQ(lookDown(all, makeTower(2, Tracing::FlagFastTrace), 1, {.flags = RayTransparent}), (Words{1}));
}

TEST_F(TraversalStages, AnyHitTerminates) {
    const Tracing scene = makeTower(8, transparent);
    // Counts its calls in the payload, to which a closest hit adds 100 and a miss 50.
    const auto counting = [&](std::string_view then) {
        return makeTraversal({down,
                              {Shader::TypeRayMiss, setPayload("payload + 50u"), {}},
                              {Shader::TypeClosest, setPayload("payload + 100u"), {}},
                              {Shader::TypeFirstHit,
                               "layout(location = 0) rayPayloadInEXT uint payload;\nvoid main() { payload++; " +
                                   std::string(then) + " }\n",
                               {}}});
    };
    const Traversal terminating = counting("terminateRayEXT;");
    EXPECT_EQ(lookDown(terminating, scene, 2), (Words{7 + 1 + 100, 7 + 50}));
    EXPECT_EQ(lookDown(terminating, scene, 1, {.flags = RaySkipClosest}), (Words{7 + 1}));
    // The first one that is accepted ends the ray without the shader's asking, too.
    const Traversal plain = counting("");
    EXPECT_EQ(lookDown(plain, scene, 1, {.flags = RayFirst}), (Words{7 + 1 + 100}));
    // All are ignored, so all of them are seen; a driver may ask more than once about one.
    EXPECT_GE(lookDown(counting("ignoreIntersectionEXT;"), scene, 1)[0], 7u + 8u + 50u);
}

TEST_F(TraversalStages, ShadowRays) {
    const Tracing square = makeSquares({0});
    const Tracing scene = makeTop({place(square)});
    const Traversal traversal = makeTraversal({down, miss_one});
    // No hit shader is needed for them.
    EXPECT_EQ(lookDown(traversal, scene, 2, {.flags = RayOpaque | RayFirst | RaySkipClosest}), (Words{7, 1}));
}

TEST_F(TraversalStages, IntersectionsKeepToTheInterval) {
    const Tracing boxes = makeBoxes({{0, 0, -1, 1, 1, 1}});
    const Tracing scene = makeTop({place(boxes)});
    // What is reported, a record each: a bit for each report that was accepted.
    constexpr const char* intersection = R"(
layout(shaderRecordEXT, std430) readonly buffer Record { uint count; float distances[4]; };
hitAttributeEXT uint accepted;
void main() {
    uint bits = 0u;
    for (uint i = 0u; i < count; i++) {
        accepted = bits | 1u << i;
        if (reportIntersectionEXT(distances[i], i)) bits |= 1u << i;
    }
}
)";
    constexpr const char* closest = R"(
layout(location = 0) rayPayloadInEXT uint payload;
hitAttributeEXT uint accepted;
void main() { payload = accepted << 16 | gl_HitKindEXT << 8 | uint(gl_HitTEXT * 4.0); }
)";
    struct Reports {
        uint32_t count;
        std::array<float, 4> distances;
    };
    const std::vector<Reports> reports = {{4, {1.75f, 12, 13, 4}}, {2, {16.25f, 4}}, {1, {1}}, {1, {17}}, {1, {-3}},
                                          {1, {15.75f}},           {1, {3}}};
    const Traversal traversal = makeTraversal(
        {down, miss_one, {Shader::TypeIntersection, intersection, {}}, {Shader::TypeClosest, closest, {}}},
        [&](Traversal& made) {
            for (const Reports& report : reports) made.addHitRecord(0, report);
        });
    const auto reporting = [&](uint32_t record, size_t count, RayArguments arguments) {
        arguments.offset = record;
        return lookDown(traversal, scene, count, arguments);
    };
    const RayArguments rays = {.minimum = 2.0f, .maximum = 16.0f};
    // Below the interval, within, behind what is there by now, before it. (From a shader that reports one below the
    // interval and then one above it, the 580 driver of an H100 never comes back.)
    EXPECT_EQ(reporting(0, 2, rays), (Words{0xau << 16 | 3u << 8 | 16u, 1}));
    EXPECT_EQ(reporting(1, 1, rays), (Words{2u << 16 | 1u << 8 | 16u}));
    EXPECT_EQ(reporting(2, 1, rays), (Words{1}));
    EXPECT_EQ(reporting(3, 1, rays), (Words{1}));
    EXPECT_EQ(reporting(4, 1, {}), (Words{1}));
    EXPECT_EQ(reporting(5, 1, rays), (Words{1u << 16 | 63u}));
    // Beside the box nothing asks the shader.
    EXPECT_EQ(reporting(6, 2, rays)[1], 1u);
}

TEST_F(TraversalStages, AnyHitJudgesIntersections) {
    const Tracing boxes = makeBoxes({{0, 0, -1, 1, 1, 1}, {0, 0, -3, 1, 1, -2}}, transparent);
    const Tracing scene = makeTop({place(boxes)});
    const Traversal traversal =
        makeTraversal({down,
                       miss_one,
                       {Shader::TypeIntersection,
                        "void main() { reportIntersectionEXT(5.0 + 2.0 * float(gl_PrimitiveID), 9u); }\n",
                        {}},
                       {Shader::TypeFirstHit, "void main() { if (gl_PrimitiveID == 0) ignoreIntersectionEXT; }\n", {}},
                       {Shader::TypeClosest, setPayload("uint(gl_HitTEXT) << 8 | gl_HitKindEXT"), {}}});
    EXPECT_EQ(lookDown(traversal, scene, 2), (Words{7u << 8 | 9u, 1}));
    EXPECT_EQ(lookDown(traversal, scene, 2, {.flags = RayOpaque}), (Words{5u << 8 | 9u, 1}));
}

TEST_F(TraversalStages, AttributesOfTheDevicesSize) {
    const Tracing boxes = makeBoxes({{0, 0, -1, 1, 1, 1}});
    const Tracing scene = makeTop({place(boxes)});
    const uint32_t words = device.getFeatures().maxAttributeSize / 4;
    ASSERT_GE(words, 8u);
    for (const uint32_t count : {3u, words}) {
        const std::string attribute =
            "struct Data { uint values[" + std::to_string(count) + "]; };\nhitAttributeEXT Data data;\n";
        const Traversal traversal = makeTraversal(
            {down,
             miss_one,
             {Shader::TypeIntersection,
              attribute + "void main() {\n"
                          "    for (uint i = 0u; i < data.values.length(); i++) data.values[i] = 100u * i + 3u;\n"
                          "    reportIntersectionEXT(5.0, 0u);\n"
                          "}\n",
              {}},
             {Shader::TypeClosest,
              "layout(location = 0) rayPayloadInEXT uint payload;\n" + attribute +
                  "void main() {\n"
                  "    payload = 0u;\n"
                  "    for (uint i = 0u; i < data.values.length(); i++) payload += data.values[i];\n"
                  "}\n",
              {}}});
        EXPECT_EQ(lookDown(traversal, scene, 1), (Words{50 * count * (count - 1) + 3 * count}));
    }
}

TEST_F(TraversalStages, BarycentricsAreTheAttributesOfTriangles) {
    const Tracing square = makeSquares({0, 1});
    const Tracing scene = makeTop({place(square)});
    const Traversal traversal = makeTraversal({{Shader::TypeRayGen,
                                                R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, std430) writeonly buffer Results { vec4 results[]; };
layout(location = 0) rayPayloadEXT vec4 payload;
void main() {
    vec2 place = vec2(0.25 + 0.5 * float(gl_LaunchIDEXT.x), 0.125);
    traceRayEXT(scene, 0u, 0xff, 0, 0, 0, vec3(place, 4.0), 0.0, vec3(0.0, 0.0, -1.0), 8.0, 0);
    results[gl_LaunchIDEXT.x] = payload;
}
)",
                                                {}},
                                               {Shader::TypeClosest,
                                                R"(
layout(location = 0) rayPayloadInEXT vec4 payload;
hitAttributeEXT vec2 barycentrics;
void main() { payload = vec4(barycentrics, gl_HitTEXT, float(gl_PrimitiveID)); }
)",
                                                {}}});
    const Words bits = trace(traversal, 16, [&](Compute& list) {
        list.setTracing(0, scene);
        list.dispatch(4);
    });
    for (uint32_t ray = 0; ray < 4; ray++) {
        const auto value = [&](size_t i) { return std::bit_cast<float>(bits[ray * 4 + i]); };
        const float x = ray % 2 ? 0.75f : 0.25f;  // within its square
        // Of the triangle (0, 0), (1, 0), (1, 1). Sums and products of these numbers are exact in any order; what is
        // left is one division, 2.5 ulp of 1 at most.
        const float tolerance = 3 * std::numeric_limits<float>::epsilon();
        EXPECT_NEAR(value(0), x - 0.125f, tolerance);
        EXPECT_NEAR(value(1), 0.125f, tolerance);
        EXPECT_NEAR(value(2), 4.0f, 4 * tolerance);
        EXPECT_EQ(value(3), 0.0f);
    }
}

TEST_F(TraversalStages, PayloadsOfManySizes) {
    const Tracing square = makeSquares({0});
    const Tracing scene = makeTop({place(square)});
    constexpr const char* payload = "struct Data { uint values[SIZE]; };\n";
    for (const uint32_t size : {1u, 3u, 64u}) {
        SCOPED_TRACE(size);
        const std::string macros = "SIZE=" + std::to_string(size);
        const auto change = [&](std::string_view amount) {
            return payload +
                   std::string("layout(location = 2) rayPayloadInEXT Data data;\nvoid main() { for (int i = "
                               "0; i < SIZE; i++) data.values[i] += ") +
                   std::string(amount) + "; }\n";
        };
        const Traversal traversal = makeTraversal({{Shader::TypeRayGen, std::string(payload) + R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, std430) writeonly buffer Results { uint results[]; };
layout(location = 2) rayPayloadEXT Data data;
void main() {
    uint ray = gl_LaunchIDEXT.x;
    for (uint i = 0u; i < SIZE; i++) data.values[i] = 1000u * ray + i;
    vec3 origin = vec3(float(ray) + 0.5, 0.5, 10.0);
    traceRayEXT(scene, 0u, 0xff, 0, 0, 0, origin, 0.0, vec3(0.0, 0.0, -1.0), 100.0, 2);
    for (uint i = 0u; i < SIZE; i++) results[ray * SIZE + i] = data.values[i];
}
)",
                                                    macros},
                                                   {Shader::TypeRayMiss, change("200u"), macros},
                                                   {Shader::TypeClosest, change("100u + uint(i)"), macros}});
        Words expected;
        for (uint32_t i = 0; i < size; i++) expected.push_back(100 + 2 * i);
        for (uint32_t i = 0; i < size; i++) expected.push_back(1200 + i);
        EXPECT_EQ(trace(traversal, 2 * size_t(size),
                        [&](Compute& list) {
                            list.setTracing(0, scene);
                            list.dispatch(2);
                        }),
                  expected);
    }
}

TEST_F(TraversalStages, SeveralPayloads) {
    const Tracing square = makeSquares({0});
    const Tracing scene = makeTop({place(square)});
    const Traversal traversal = makeTraversal({{Shader::TypeRayGen,
                                                R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, std430) writeonly buffer Results { uint results[]; };
layout(location = 0) rayPayloadEXT uvec2 first;
layout(location = 5) rayPayloadEXT uint second;
void main() {
    first = uvec2(1u, 2u);
    second = 3u;
    vec3 origin = vec3(0.5, 0.5, 1.0);
    traceRayEXT(scene, 0u, 0xff, 0, 0, 0, origin, 0.0, vec3(0.0, 0.0, -1.0), 2.0, 0);
    traceRayEXT(scene, 0u, 0xff, 1, 0, 0, origin, 0.0, vec3(0.0, 0.0, -1.0), 2.0, 5);
    results[0] = first.x;
    results[1] = first.y;
    results[2] = second;
}
)",
                                                {}},
                                               {Shader::TypeClosest,
                                                R"(
layout(location = 0) rayPayloadInEXT uvec2 payload;
void main() { payload = payload.yx * 10u; }
)",
                                                {}},
                                               {Shader::TypeClosest,
                                                R"(
layout(location = 5) rayPayloadInEXT uint payload;
void main() { payload += 40u; }
)",
                                                {}}});
    EXPECT_EQ(trace(traversal, 3,
                    [&](Compute& list) {
                        list.setTracing(0, scene);
                        list.dispatch(1);
                    }),
              (Words{20, 10, 43}));
}

TEST_F(TraversalStages, CallablesFromEveryStageThatMay) {
    const Tracing square = makeSquares({0});
    const Tracing scene = makeTop({place(square)});
    const auto callableText = [](std::string_view body) {
        return "layout(location = 0) callableDataInEXT uint data;\n"
               "layout(shaderRecordEXT, std430) readonly buffer Record { uint amount; };\nvoid main() { " +
               std::string(body) + " }\n";
    };
    const auto calling = [](std::string_view record) {
        return "layout(location = 0) rayPayloadInEXT uint payload;\nlayout(location = 1) callableDataEXT uint data;\n"
               "void main() { data = payload; executeCallableEXT(" +
               std::string(record) + ", 1); payload = data; }\n";
    };
    const Traversal traversal =
        makeTraversal({{Shader::TypeRayGen,
                        R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, std430) writeonly buffer Results { uint results[]; };
layout(location = 0) rayPayloadEXT uint payload;
layout(location = 3) callableDataEXT uint data;
void main() {
    uint ray = gl_LaunchIDEXT.x;
    data = ray;
    executeCallableEXT(2, 3);
    payload = data;
    traceRayEXT(scene, 0u, 0xff, 0, 0, 0, vec3(float(ray) + 0.5, 0.5, 1.0), 0.0, vec3(0.0, 0.0, -1.0), 2.0, 0);
    results[ray] = payload;
}
)",
                        {}},
                       {Shader::TypeRayMiss, calling("1"), {}},
                       {Shader::TypeClosest, calling("0"), {}},
                       {Shader::TypeCallable, callableText("data += amount;"), {}},
                       // Calls the first one.
                       {Shader::TypeCallable,
                        "layout(location = 1) callableDataEXT uint inner;\n" +
                            callableText("inner = data; executeCallableEXT(0, 1); data = inner * amount;"),
                        {}}},
                      [](Traversal& made) {
                          EXPECT_EQ(made.addCallableRecord(0, 5u), 0u);
                          EXPECT_EQ(made.addCallableRecord(1, 100u), 1u);
                          EXPECT_EQ(made.addCallableRecord(0, 30u), 2u);
                      });
    EXPECT_EQ(traversal.getCallableRecords(), 3u);
    EXPECT_EQ(trace(traversal, 2,
                    [&](Compute& list) {
                        list.setTracing(0, scene);
                        list.dispatch(2);
                    }),
              (Words{0 + 30 + 5, (1 + 30 + 5) * 100}));
}

TEST_F(TraversalStages, CallablesNestAsDeepAsTheySay) {
    // Each level adds 1 on the way down and 100 on the way up, and keeps words of its own meanwhile.
    const std::string callable = R"(
layout(constant_id = 0) const uint depth = 1u;
layout(location = 0) callableDataInEXT uint data;
layout(location = 1) callableDataEXT uint inner;
void main() {
    uint kept[16];
    for (uint i = 0u; i < 16u; i++) kept[i] = data * 3u + i;
    data++;
    if (data < depth) {
        inner = data;
        executeCallableEXT(0, 1);
        data = inner;
    }
    uint sum = 0u;
    for (uint i = 0u; i < 16u; i++) sum += kept[(data + i) % 16u];
    data += 100u + sum * 10000u;
}
)";
    constexpr const char* generation = R"(
layout(binding = 0, std430) writeonly buffer Results { uint results[]; };
layout(location = 0) callableDataEXT uint data;
void main() {
    data = 0u;
    executeCallableEXT(0, 0);
    results[gl_LaunchIDEXT.x] = data;
}
)";
    for (const uint32_t depth : {3u, 5u}) {
        const Traversal traversal = makeTraversal(
            {{Shader::TypeRayGen, generation, {}}, {Shader::TypeCallable, callable, {}}}, [&](Traversal& made) {
                made.setCallableDepth(depth);
                made.setConstant(0u, depth);
            });
        EXPECT_EQ(traversal.getCallableDepth(), depth);
        // 16 words of 3 * level + i each: 48 * level + 120.
        uint32_t expected = depth + 100 * depth;
        for (uint32_t level = 0; level < depth; level++) expected += (48 * level + 120) * 10000;
        EXPECT_EQ(trace(traversal, 2, [](Compute& list) { list.dispatch(2); }), (Words{expected, expected}));
    }
}

TEST_F(TraversalStages, RecursesToTheLimit) {
    const Tracing square = makeSquares({0});
    const Tracing scene = makeTop({place(square)});
    // Each level adds 1 on the way down and 100 on the way up.
    constexpr const char* closest = R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(constant_id = 0) const uint depth = 1u;
layout(location = 0) rayPayloadInEXT uint payload;
void main() {
    payload++;
    if (payload - 7u < depth)
        traceRayEXT(scene, 0u, 0xff, 0, 0, 0, vec3(0.5, 0.5, 1.0), 0.0, vec3(0.0, 0.0, -1.0), 2.0, 0);
    payload += 100u;
}
)";
    const uint32_t limit = device.getFeatures().recursionDepth;
    for (const uint32_t depth : {1u, 2u, 31u}) {
        if (depth > limit) continue;
        const Traversal traversal =
            makeTraversal({down, miss_one, {Shader::TypeClosest, closest, {}}}, [&](Traversal& made) {
                made.setRecursionDepth(depth);
                made.setConstant(0u, depth);
            });
        EXPECT_EQ(traversal.getRecursionDepth(), depth);
        // Below 100 they are the levels that were reached; payload counts up to depth before the first addition.
        EXPECT_EQ(lookDown(traversal, scene, 2), (Words{7 + depth + 100 * depth, 1}));
    }
    Traversal deeper = device.createTraversal("deeper");
    deeper.createShaderGLSL(Shader::TypeRayGen, look_down);
    deeper.setRecursionDepth(limit + 1);
    const Error error = errorOf(deeper.create());
    expectTold("traversal.recursion");
    EXPECT_THAT(error.message(), testing::HasSubstr(std::to_string(limit)));
    EXPECT_THAT(error.message(), testing::HasSubstr(std::to_string(limit + 1)));
}

}  // namespace glint::test
