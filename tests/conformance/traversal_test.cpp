// Ray-tracing pipelines: groups, records and dispatches.

#include "conformance/traversal_scene.h"

#include "support/files.h"

#include <glint/base/file.h>

#include <numeric>

namespace glint::test {

namespace {

const RayShader down = {Shader::TypeRayGen, look_down, {}};
const RayShader miss_one = {Shader::TypeRayMiss, setPayload("1u"), {}};

/// Sets the payload to what the record holds.
constexpr const char* from_record = R"(
layout(location = 0) rayPayloadInEXT uint payload;
layout(shaderRecordEXT, std430) readonly buffer Record { uint value; };
void main() { payload = value; }
)";

/// Ray i writes its index to results[i].
constexpr const char* write_index = R"(
layout(binding = 0, std430) writeonly buffer Results { uint results[]; };
void main() {
    uvec3 id = gl_LaunchIDEXT, size = gl_LaunchSizeEXT;
    uint index = (id.z * size.y + id.y) * size.x + id.x;
    results[index] = index;
}
)";

Words upTo(size_t count) {
    Words all(count);
    std::iota(all.begin(), all.end(), 0u);
    return all;
}

}  // namespace

TEST_F(TraversalTest, TracesHitsAndMisses) {
    const Tracing squares = makeSquares({0, 2});
    const Tracing scene = makeTop({place(squares)});
    const Traversal traversal =
        makeTraversal({down, miss_one, {Shader::TypeClosest, setPayload("2u + uint(gl_GeometryIndexEXT)"), {}}});
    EXPECT_EQ(lookDown(traversal, scene, 4), (Words{2, 1, 3, 1}));
    EXPECT_EQ(lookDown(traversal, scene, 1, {.maximum = 9.0f}), (Words{1}));
    EXPECT_EQ(lookDown(traversal, scene, 1, {.minimum = 11.0f}), (Words{1}));
}

TEST_F(TraversalTest, RendersOnSurface) {
    const Tracing squares = makeSquares({0});
    const Tracing scene = makeTop({place(squares)});
    const Traversal traversal = makeTraversal({{Shader::TypeRayGen,
                                                R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, rgba8) writeonly uniform image2D surface;
layout(location = 0) rayPayloadEXT vec4 color;
void main() {
    vec2 place = (vec2(gl_LaunchIDEXT.xy) + 0.5) / vec2(gl_LaunchSizeEXT.xy) * 2.0;
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, vec3(place, 1.0), 0.0, vec3(0.0, 0.0, -1.0), 2.0, 0);
    imageStore(surface, ivec2(gl_LaunchIDEXT.xy), color);
}
)",
                                                {}},
                                               {Shader::TypeRayMiss,
                                                R"(
layout(location = 0) rayPayloadInEXT vec4 color;
void main() { color = vec4(0.0, 0.0, 1.0, 1.0); }
)",
                                                {}},
                                               {Shader::TypeClosest,
                                                R"(
layout(location = 0) rayPayloadInEXT vec4 color;
void main() { color = vec4(0.0, 1.0, 0.0, gl_HitTEXT); }
)",
                                                {}}});
    const Texture surface = makeTexture(FormatRGBAu8n, 16, 8, Texture::FlagSurface);
    compute([&](Compute& list) {
        list.setTraversal(traversal);
        list.setTracing(0, scene);
        list.setSurfaceTexture(0, surface);
        list.dispatch(surface);
    });
    const auto pixels = readTexture<Pixel>(surface);
    EXPECT_EQ(countPixels(pixels, green), 8 * 4u);
    EXPECT_EQ(countPixels(pixels, blue), 16 * 8u - 8 * 4u);
    EXPECT_EQ(pixels[0], green);
}

TEST_F(TraversalTest, GroupsFollowTheOrderOfLoading) {
    const Tracing squares = makeSquares({0, 1, 2, 3});
    const Tracing scene = makeTop({place(squares)});
    constexpr const char* any_hit = "void main() {}\n";
    const Traversal traversal = makeTraversal({{Shader::TypeClosest, setPayload("10u"), {}},
                                               {Shader::TypeRayMiss, setPayload("20u"), {}},
                                               {Shader::TypeFirstHit, any_hit, {}},
                                               {Shader::TypeClosest, setPayload("11u"), {}},
                                               down,
                                               {Shader::TypeRayMiss, setPayload("21u"), {}}},
                                              [](Traversal& made) {
                                                  made.addHitGroup();
                                                  made.addHitGroup();
                                                  made.createShaderGLSL(Shader::TypeClosest, setPayload("13u"));
                                              });
    EXPECT_EQ(traversal.getHitGroups(), 4u);
    EXPECT_EQ(traversal.getHitRecords(), 4u);
    EXPECT_EQ(traversal.getMissRecords(), 2u);
    EXPECT_EQ(traversal.getCallableRecords(), 0u);
    EXPECT_EQ(traversal.getGenerations(), 1u);
    // The third group is empty: its hits run nothing.
    EXPECT_EQ(lookDown(traversal, scene, 5, {.stride = 1, .miss = 1}), (Words{10, 11, 7, 13, 21}));
    EXPECT_EQ(lookDown(traversal, scene, 5, {.offset = 1}), (Words{11, 11, 11, 11, 20}));
}

TEST_F(TraversalTest, RecordsAreFoundByOffsetsAndStrides) {
    const Tracing squares = makeSquares({0, 1, 2});
    const Tracing scene = makeTop({place(squares), place(squares, 3, 0, 3), place(squares, 6, 0, 7)});
    const Traversal traversal = makeTraversal(
        {down, {Shader::TypeRayMiss, from_record, {}}, {Shader::TypeClosest, from_record, {}}}, [](Traversal& made) {
            for (uint32_t i = 0; i < 16; i++) EXPECT_EQ(made.addHitRecord(0, 100 + i), i);
            for (uint32_t i = 0; i < 3; i++) EXPECT_EQ(made.addMissRecord(0, 200 + i), i);
        });
    EXPECT_EQ(traversal.getHitRecords(), 16u);
    for (const uint32_t offset : {0u, 1u, 2u})
        for (const uint32_t stride : {0u, 1u, 3u})
            for (const uint32_t miss : {0u, 2u}) {
                SCOPED_TRACE(testing::Message() << offset << " " << stride << " " << miss);
                Words expected;
                for (const uint32_t of_instance : {0u, 3u, 7u})
                    for (const uint32_t geometry : {0u, 1u, 2u})
                        expected.push_back(100 + of_instance + geometry * stride + offset);
                expected.push_back(200 + miss);
                EXPECT_EQ(lookDown(traversal, scene, 10, {.offset = offset, .stride = stride, .miss = miss}), expected);
            }
}

TEST_F(TraversalTest, RecordsHoldDataOfAnySize) {
    // Sizes differ within the table, whose stride is that of the longest; the groups alternate.
    struct Data {
        uint32_t value = 0;
        std::array<uint32_t, 60> rest = {};
        uint32_t last = 0;
    };
    constexpr const char* from_long = R"(
layout(location = 0) rayPayloadInEXT uint payload;
layout(shaderRecordEXT, std430) readonly buffer Record { uint value; uint rest[60]; uint last; };
void main() { payload = value + last; }
)";
    const Tracing squares = makeSquares({0, 1, 2, 3});
    const Tracing scene = makeTop({place(squares)});
    const std::vector<uint32_t> words = {40, 41, 42};
    const Traversal traversal =
        makeTraversal({down, miss_one, {Shader::TypeClosest, from_record, {}}, {Shader::TypeClosest, from_long, {}}},
                      [&](Traversal& made) {
                          made.addHitRecord(0, std::span(words));
                          made.addHitRecord(1, Data{.value = 1, .last = 1000});
                          made.addHitRecord(0, words.data() + 1, 4);
                          made.addHitRecord(1, Data{.value = 2, .last = 2000});
                      });
    EXPECT_EQ(lookDown(traversal, scene, 4, {.stride = 1}), (Words{40, 1001, 41, 2002}));
}

TEST_F(TraversalTest, GenerationsAreChosen) {
    const Traversal traversal = makeTraversal({{Shader::TypeRayGen, write_index, {}},
                                               {Shader::TypeRayGen,
                                                R"(
layout(binding = 0, std430) writeonly buffer Results { uint results[]; };
void main() { results[gl_LaunchIDEXT.x] = 100u; }
)",
                                                {}}});
    EXPECT_EQ(traversal.getGenerations(), 2u);
    EXPECT_EQ(trace(traversal, 3, [](Compute& list) { list.dispatch(2); }), (Words{0, 1, 0xdead}));
    EXPECT_EQ(trace(traversal, 3,
                    [&](Compute& list) {
                        list.dispatch(3);
                        list.setTraversal(traversal, 1);
                        list.dispatch(1);
                    }),
              (Words{100, 1, 2}));
}

TEST_F(TraversalTest, DispatchesAnyNumberOfRays) {
    const Traversal traversal = makeTraversal({{Shader::TypeRayGen, write_index, {}}});
    const std::array<uint64_t, 3> sizes[] = {{1, 1, 1},     {3, 2, 1},     {1, 70000, 1}, {70000, 1, 1},
                                             {65, 1025, 1}, {2, 300, 130}, {257, 1, 3}};
    for (const auto& [width, height, depth] : sizes) {
        SCOPED_TRACE(testing::Message() << width << " x " << height << " x " << depth);
        const size_t count = static_cast<size_t>(width * height * depth);
        Words expected = upTo(count);
        expected.push_back(0xdead);  // no more rays than were asked for
        EXPECT_TRUE(trace(traversal, count + 1, [&](Compute& list) { list.dispatch(width, height, depth); }) ==
                    expected);
    }
    EXPECT_EQ(trace(traversal, 1, [](Compute& list) { list.dispatch(0); }), (Words{0xdead}));
    EXPECT_EQ(trace(traversal, 1, [](Compute& list) { list.dispatch(1, 1, 0); }), (Words{0xdead}));
}

TEST_F(TraversalTest, CountsOfRaysComeFromBuffers) {
    if (!device.getFeatures().indirectRays) GTEST_SKIP() << "the device reads no counts of rays from buffers";
    const Traversal traversal = makeTraversal({{Shader::TypeRayGen, write_index, {}}});
    const Kernel kernel = makeKernel(R"(
layout(local_size_x = 1) in;
layout(binding = 0, std430) writeonly buffer Counts { uint counts[]; };
void main() { counts[1] = 3u; counts[2] = 5u; counts[3] = 1u; }
)");
    const Buffer counts = makeBuffer(Words(4, 0u), Buffer::FlagStorage | Buffer::FlagIndirect);
    const Buffer results = makeBuffer(Words(16, 0xdeadu));
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setStorageBuffer(0, counts);
        list.dispatch(1);
        list.setTraversal(traversal);
        list.setStorageBuffer(0, results);
        list.dispatchIndirect(counts, 4);
    });
    Words expected = upTo(15);
    expected.push_back(0xdead);
    EXPECT_EQ(read<uint32_t>(results), expected);
}

// Where pipelines are joined, the counts are read by a kernel first, which judges them; else nobody does.
TEST_F(TraversalTest, CountsBeyondTheLimitsStartNothing) {
    if (device.getFeatures().traversalEngine == TracingEngine::Driver) GTEST_SKIP() << "the driver takes any counts";
    const Traversal traversal = makeTraversal({{Shader::TypeRayGen, write_index, {}}});
    const Words counts = {1u << 31, 1, 1, 1, 1u << 31, 1, 1, 1, 1u << 31, 1u << 15, 1u << 15, 2, 0, 5, 1, 2, 1, 1};
    const Buffer buffer = makeBuffer(counts, Buffer::FlagIndirect);
    for (uint64_t i = 0; i < counts.size(); i += 3) {
        SCOPED_TRACE(i);
        EXPECT_EQ(trace(traversal, 3, [&](Compute& list) { list.dispatchIndirect(buffer, i * 4); }),
                  (i + 3 == counts.size() ? Words{0, 1, 0xdead} : Words(3, 0xdead)));
    }
}

// Two in a row, of different generations, share what they keep on the device.
TEST_F(TraversalTest, CountsFromBuffersTakeTurns) {
    if (!device.getFeatures().indirectRays) GTEST_SKIP() << "the device reads no counts of rays from buffers";
    constexpr const char* add = R"(
layout(binding = 0, std430) buffer Results { uint results[]; };
void main() { results[gl_LaunchIDEXT.x] = results[gl_LaunchIDEXT.x] * 10u + gl_LaunchSizeEXT.x + OWN; }
)";
    const Traversal traversal = makeTraversal({{Shader::TypeRayGen, add, "OWN=1"}, {Shader::TypeRayGen, add, "OWN=5"}});
    const Buffer counts = makeBuffer(Words{2, 1, 1, 3, 1, 1}, Buffer::FlagIndirect);
    const Buffer results = makeBuffer(Words(4, 0u));
    compute([&](Compute& list) {
        list.setStorageBuffer(0, results);
        list.setTraversal(traversal);
        list.dispatchIndirect(counts);
        list.setTraversal(traversal, 1);
        list.dispatchIndirect(counts, 12);
        list.setTraversal(traversal);
        list.dispatch(1);
    });
    EXPECT_EQ(read<uint32_t>(results), (Words{382, 38, 8, 0}));
}

TEST_F(TraversalTest, ResourcesThatNobodyUsesKeepTheirSlots) {
    const Traversal traversal = makeTraversal({{Shader::TypeRayGen,
                                                R"(
layout(set = 0, binding = 0, std430) readonly buffer Unused { uint unused[]; };
layout(set = 0, binding = 1, std430) readonly buffer From { uint from[]; };
layout(set = 1, binding = 0) uniform Forgotten { vec4 forgotten; };
layout(set = 1, binding = 1) uniform Added { uvec4 added; };
layout(set = 2, binding = 3, std430) writeonly buffer To { uint to[]; };
void main() { to[gl_LaunchIDEXT.x] = from[gl_LaunchIDEXT.x] + added.y; }
)",
                                                {}}});
    EXPECT_EQ(traversal.getSlots(SlotKind::Storage), 3u);
    const Buffer results = makeBuffer(Words(2, 0xdeadu));
    compute([&](Compute& list) {
        list.setTraversal(traversal);
        list.setStorageBuffers(0, {makeBuffer(Words(2, 1u)), makeBuffer(Words(2, 7u))});
        list.setStorageBuffer("To", results);
        list.setUniform(0, std::array<float, 4>{});
        list.setUniform(1, std::array<uint32_t, 4>{1, 20, 3, 4});
        list.dispatch(2);
    });
    EXPECT_EQ(read<uint32_t>(results), (Words{27, 27}));
}

TEST_F(TraversalTest, ConstantsReachEveryStage) {
    const Tracing squares = makeSquares({0});
    const Tracing scene = makeTop({place(squares)});
    const auto shader = [](uint32_t base) {
        return "layout(constant_id = 3) const uint amount = 1u;\n" + setPayload(std::to_string(base) + "u + amount");
    };
    for (const bool by_name : {true, false}) {
        const Traversal traversal = makeTraversal(
            {down, {Shader::TypeRayMiss, shader(10), {}}, {Shader::TypeClosest, shader(20), {}}}, [&](Traversal& made) {
                if (by_name)
                    made.setConstant("amount", 5u);
                else
                    made.setConstant(3u, 6u);
            });
        const uint32_t amount = by_name ? 5 : 6;
        EXPECT_EQ(lookDown(traversal, scene, 2), (Words{20 + amount, 10 + amount}));
    }
}

TEST_F(TraversalTest, MasksAreDeclared) {
    const Tracing squares = makeSquares({0});
    const Tracing scene = makeTop({place(squares)});
    const Traversal traversal = makeTraversal({down, miss_one}, [](Traversal& made) {
        made.setStorageMasks(0, 2, Shader::MaskTracing);
        made.setTracingMask(0, Shader::MaskRayGen | Shader::MaskClosest);
        made.addHitGroup();
    });
    EXPECT_EQ(lookDown(traversal, scene, 2), (Words{7, 1}));
    Traversal hidden = device.createTraversal("hidden");
    hidden.createShaderGLSL(Shader::TypeRayGen, look_down);
    hidden.setTracingMask(0, Shader::MaskClosest);
    expectError("program.mask", [&] { return hidden.create(); });
}

TEST_F(TraversalTest, TakesTurnsWithKernels) {
    // Each has push constants of its own, the same every time, in the same place of the command buffer.
    const Kernel kernel = makeKernel(R"(
layout(local_size_x = 4) in;
layout(binding = 0, std430) buffer Results { uint results[]; };
layout(push_constant) uniform Push { uint factor; };
void main() { results[gl_GlobalInvocationID.x] *= factor; }
)");
    const Traversal traversal = makeTraversal({{Shader::TypeRayGen,
                                                R"(
layout(binding = 0, std430) buffer Results { uint results[]; };
layout(push_constant) uniform Push { uint unused, amount; };
void main() { results[gl_LaunchIDEXT.x] += amount; }
)",
                                                {}}});
    const Buffer results = makeBuffer(Words(4, 1u));
    compute([&](Compute& list) {
        list.setStorageBuffer(0, results);
        for (int turn = 0; turn < 2; turn++) {
            list.setPushConstants(10u);
            list.setKernel(kernel);
            list.dispatch(4);
            list.setPushConstants(std::array<uint32_t, 2>{99, 2});
            list.setTraversal(traversal);
            list.dispatch(3);
        }
        list.setPushConstants(10u);
        list.setKernel(kernel);
        list.dispatch(4);
    });
    // ((1 * 10 + 2) * 10 + 2) * 10, and without the additions.
    EXPECT_EQ(read<uint32_t>(results), (Words{1220, 1220, 1220, 1000}));
}

TEST_F(TraversalTest, TakesSpirv) {
    const TempDir folder;
    const std::string file = (folder / "trace.spv").string();
    const Shader shader = Shader::createGLSL(Shader::TypeRayGen, write_index);
    ASSERT_TRUE(shader) << shader.error().text();
    const auto words = std::as_bytes(shader.getWords());
    ASSERT_THAT(writeTextFile(file, {reinterpret_cast<const char*>(words.data()), words.size()}), IsOk());
    Traversal traversal = device.createTraversal("traversal");
    EXPECT_TRUE(traversal.loadShaderSPIRV(Shader::TypeRayGen, file));
    traversal.setShader(Shader::createSPIRV(Shader::TypeRayGen, shader.getWords()));
    ASSERT_THAT(traversal.create(), IsOk());
    EXPECT_EQ(traversal.getGenerations(), 2u);
    EXPECT_EQ(trace(traversal, 3,
                    [&](Compute& list) {
                        list.setTraversal(traversal, 1);
                        list.dispatch(2);
                    }),
              (Words{0, 1, 0xdead}));
}

TEST_F(TraversalTest, IsCreatedInTheBackground) {
    Traversal traversal = device.createTraversal("traversal");
    traversal.createShaderGLSL(Shader::TypeRayGen, write_index);
    traversal.createAsync();
    EXPECT_EQ(trace(traversal, 2, [](Compute& list) { list.dispatch(2); }), (Words{0, 1}));
    EXPECT_THAT(traversal.wait(), IsOk());
}

TEST_F(TraversalTest, ReloadsChangedFiles) {
    const TempDir folder;
    const std::string file = (folder / "trace.shader").string();
    ASSERT_THAT(writeTextFile(file, setPayload("30u")), IsOk());
    const Tracing squares = makeSquares({0});
    const Tracing scene = makeTop({place(squares)});
    Traversal traversal = device.createTraversal("traversal");
    traversal.createShaderGLSL(Shader::TypeRayGen, look_down);
    traversal.loadShaderGLSL(Shader::TypeClosest, file);
    traversal.loadShaderGLSL(Shader::TypeRayMiss, file);
    ASSERT_THAT(traversal.create(), IsOk());
    EXPECT_EQ(lookDown(traversal, scene, 2), (Words{30, 30}));
    ASSERT_THAT(writeTextFile(file, setPayload("gl_IncomingRayFlagsEXT + 3131u")), IsOk());
    bool changed = false;
    EXPECT_THAT(traversal.reload(&changed), IsOk());
    EXPECT_TRUE(changed);
    EXPECT_EQ(lookDown(traversal, scene, 2), (Words{3131, 3131}));
}

}  // namespace glint::test
