// Task and mesh shaders.

#include "conformance/conformance.h"

namespace glint::test {

namespace {

/// Group (x, y, z) draws the pixel at x + 4 z, y of a target of 16 by 16, as two triangles, in the colour of the push
/// constants. PAYLOAD: the place comes from a task shader.
constexpr const char* tile_mesh = R"(
layout(local_size_x = GROUP) in;
layout(triangles, max_vertices = 4, max_primitives = 2) out;
#ifdef PAYLOAD
    struct Payload { uvec2 first; uint count; };
    taskPayloadSharedEXT Payload payload;
#endif
void main() {
    SetMeshOutputsEXT(4, 2);
#ifdef PAYLOAD
    uvec2 place = payload.first + uvec2(gl_WorkGroupID.x, 0u);
#else
    uvec2 place = uvec2(gl_WorkGroupID.x + 4u * gl_WorkGroupID.z, gl_WorkGroupID.y);
#endif
    for (uint i = gl_LocalInvocationIndex; i < 4u; i += gl_WorkGroupSize.x) {
        vec2 corner = (vec2(place) + vec2(i & 1u, i >> 1u)) / 8.0 - 1.0;
        gl_MeshVerticesEXT[i].gl_Position = vec4(corner.x, -corner.y, 0.5, 1.0);
    }
    if (gl_LocalInvocationIndex == 0u) {
        gl_PrimitiveTriangleIndicesEXT[0] = uvec3(0, 1, 2);
        gl_PrimitiveTriangleIndicesEXT[1] = uvec3(2, 1, 3);
    }
})";

/// Group (x, y) starts as many mesh groups as it is far from the left, from pixel (4 x, y) on; none if y is odd.
constexpr const char* row_task = R"(
layout(local_size_x = 32) in;
struct Payload { uvec2 first; uint count; };
taskPayloadSharedEXT Payload payload;
shared uint sum;
void main() {
    if (gl_LocalInvocationIndex == 0u) sum = 0u;
    barrier();
    if (gl_LocalInvocationIndex < gl_WorkGroupID.x + 1u) atomicAdd(sum, 1u);
    barrier();
    if (gl_LocalInvocationIndex == 0u) {
        payload.first = uvec2(4u * gl_WorkGroupID.x, gl_WorkGroupID.y);
        payload.count = sum;
    }
    barrier();
    EmitMeshTasksEXT((gl_WorkGroupID.y & 1u) == 1u ? 0u : sum, 1, 1);
})";

class MeshShaderTest : public ConformanceTest {
protected:
    static constexpr uint32_t size = 16;

    void SetUp() override {
        ConformanceTest::SetUp();
        GLINT_NEED_FEATURE(FeatureMeshShader);
        if (device) color = makeTexture(FormatRGBAu8n, size, size);
    }
    void TearDown() override {
        color = {};
        ConformanceTest::TearDown();
    }

    Pipeline meshes(std::string_view mesh, std::string_view fragment,
                    const std::function<void(Pipeline&)>& configure = {}, std::string_view macros = "GROUP=32",
                    std::string_view task = {}) {
        Pipeline pipeline = device.createPipeline("meshes");
        if (!task.empty()) pipeline.createShaderGLSL(Shader::TypeTask, task);
        pipeline.createShaderGLSL(Shader::TypeMesh, mesh, macros);
        pipeline.createShaderGLSL(Shader::TypeFragment, fragment);
        pipeline.setColorFormat(FormatRGBAu8n);
        if (configure) configure(pipeline);
        EXPECT_THAT(pipeline.create(), IsOk());
        return pipeline;
    }

    std::vector<Pixel> pixels() { return readTexture<Pixel>(color); }
    /// Every pixel is red where `expected(x, y)` is true, else black.
    template <class Expected>
    void expectRed(Expected&& expected) {
        const std::vector<Pixel> picture = pixels();
        for (uint32_t i = 0; i < size * size; i++)
            EXPECT_EQ(picture[i], expected(i % size, i / size) ? red : black) << i % size << ", " << i / size;
    }

    Texture color;
};

}  // namespace

TEST_F(MeshShaderTest, GroupsInThreeDimensions) {
    for (const char* group : {"GROUP=1", "GROUP=3", "GROUP=32", "GROUP=128"}) {
        SCOPED_TRACE(group);
        const Pipeline pipeline = meshes(tile_mesh, red_fragment, {}, group);
        draw(color, [&](Command& list) {
            list.setPipeline(pipeline);
            list.drawMesh(2, 5, 3);
        });
        expectRed([](uint32_t x, uint32_t y) { return x < 12 && x % 4 < 2 && y < 5; });
    }
}

TEST_F(MeshShaderTest, NothingIsDrawnByNoGroups) {
    const Pipeline pipeline = meshes(tile_mesh, red_fragment);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.drawMesh(0);
        list.drawMesh(1, 0);
        list.drawMesh(1, 1, 0);
    });
    expectRed([](uint32_t, uint32_t) { return false; });
}

TEST_F(MeshShaderTest, TasksStartMeshesAndHandThemAPayload) {
    const Pipeline pipeline = meshes(tile_mesh, red_fragment, {}, "GROUP=32; PAYLOAD", row_task);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.drawMesh(4, 16);
    });
    expectRed([](uint32_t x, uint32_t y) { return y % 2 == 0 && x % 4 <= x / 4; });
}

TEST_F(MeshShaderTest, GroupSizesMayBeSpecialised) {
    std::string text = tile_mesh;
    text.replace(text.find("local_size_x = GROUP"), 20, "local_size_x_id = 3");
    for (const uint32_t threads : {1u, 7u, 64u}) {
        const Pipeline pipeline = meshes(text, red_fragment, [&](Pipeline& p) { p.setConstant(3, threads); });
        draw(color, [&](Command& list) {
            list.setPipeline(pipeline);
            list.drawMesh(threads % 5);
        });
        expectRed([&](uint32_t x, uint32_t y) { return y == 0 && x < threads % 5; });
    }
}

TEST_F(MeshShaderTest, IndirectWithAndWithoutCounts) {
    const Pipeline pipeline = meshes(tile_mesh, red_fragment);
    const Buffer arguments =
        makeBuffer(std::vector<uint32_t>{0, 3, 1, 1, 0, 1, 5, 1, 0, 1, 2, 2}, Buffer::FlagIndirect);
    const Buffer count = makeBuffer(std::vector<uint32_t>{7, 2}, Buffer::FlagIndirect);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.drawMeshIndirect(arguments, 4);
    });
    expectRed([](uint32_t x, uint32_t y) { return x < 3 && y == 0; });
    if (device.getFeatures().has(FeatureMultiDrawIndirect)) {
        draw(color, [&](Command& list) {
            list.setPipeline(pipeline);
            list.drawMeshIndirect(arguments, 4, 2, 16);
        });
        expectRed([](uint32_t x, uint32_t y) { return (x < 3 && y == 0) || (x == 0 && y < 5); });
    }
    if (!device.getFeatures().has(FeatureIndirectCount)) return;
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.drawMeshIndirect(arguments, 4, count, 4, 2, 16);
    });
    expectRed([](uint32_t x, uint32_t y) { return (x < 3 && y == 0) || (x == 0 && y < 5); });
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.drawMeshIndirect(arguments, 4, count, 0, 1);
    });
    expectRed([](uint32_t x, uint32_t y) { return x < 3 && y == 0; });
}

TEST_F(MeshShaderTest, CountsAreWrittenByADispatch) {
    GLINT_NEED_FEATURE(FeatureIndirectCount);
    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 4) in;
        layout(binding = 0) buffer Arguments { uint arguments[]; };
        void main() { arguments[gl_LocalInvocationIndex] = gl_LocalInvocationIndex == 3u ? 1u : gl_LocalInvocationIndex + 1u; })");
    const Buffer arguments = device.createBuffer(Buffer::FlagIndirect | Buffer::FlagStorage, 16);
    const Pipeline pipeline = meshes(tile_mesh, red_fragment);
    Compute compute = device.createCompute();
    compute.setKernel(kernel);
    compute.setStorageBuffer(0, arguments);
    compute.dispatch(4);
    Command list = device.createCommand(device.createTarget(color));
    list.setPipeline(pipeline);
    list.drawMeshIndirect(arguments, 4, arguments, 0, 1);
    EXPECT_THAT(device.submit({compute, list}), IsOk());
    expectRed([](uint32_t x, uint32_t y) { return x < 2 && y < 3; });
}

TEST_F(MeshShaderTest, ResourcesInEveryStage) {
    // What the task stage adds to a buffer the mesh stage of the next draw reads: a barrier splits the target.
    const Pipeline pipeline = meshes(R"(
        layout(local_size_x = 1) in;
        layout(triangles, max_vertices = 3, max_primitives = 1) out;
        layout(binding = 1) readonly buffer Shift { uint columns; };
        void main() {
            SetMeshOutputsEXT(3, 1);
            float right = float(columns) / 4.0 - 1.0;
            gl_MeshVerticesEXT[0].gl_Position = vec4(-1.0, -3.0, 0.5, 1.0);
            gl_MeshVerticesEXT[1].gl_Position = vec4(right, -3.0, 0.5, 1.0);
            gl_MeshVerticesEXT[2].gl_Position = vec4(-1.0, right * 1e6, 0.5, 1.0);
            gl_PrimitiveTriangleIndicesEXT[0] = uvec3(0, 1, 2);
        })",
                                     R"(
        layout(binding = 2) uniform Tint { vec4 tint; };
        layout(location = 0) out vec4 color;
        void main() { color = tint; })",
                                     {}, {}, R"(
        layout(local_size_x = 1) in;
        layout(binding = 0) buffer Count { uint count; };
        void main() {
            atomicAdd(count, 1u);
            EmitMeshTasksEXT(1, 1, 1);
        })");
    const Buffer count = makeBuffer(std::vector<uint32_t>{0});
    const Buffer columns = makeBuffer(std::vector<uint32_t>{4});
    EXPECT_EQ(pipeline.getSlots(SlotKind::Storage), 2u);
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setUniform(0, Color{1, 0, 0, 1});
        list.setStorageBuffers(0, {count, columns});
        for (int i = 0; i < 3; i++) list.drawMesh(2);
    });
    EXPECT_EQ(read<uint32_t>(count)[0], 6u);
}

TEST_F(MeshShaderTest, OutputsOfVerticesAndOfPrimitives) {
    // 64 quads: colours by primitive, culled where the column is odd; the green part is interpolated.
    const Pipeline pipeline = meshes(R"(
        layout(local_size_x = 64) in;
        layout(triangles, max_vertices = 256, max_primitives = 128) out;
        layout(location = 0) out float shade[];
        layout(location = 1) perprimitiveEXT out float part[];
        void main() {
            SetMeshOutputsEXT(256, 128);
            uint q = gl_LocalInvocationIndex;
            for (uint i = 0u; i < 4u; i++) {
                vec2 corner = (vec2(q % 8u, q / 8u) + vec2(i & 1u, i >> 1u)) / 4.0 - 1.0;
                gl_MeshVerticesEXT[4u * q + i].gl_Position = vec4(corner.x, -corner.y, 0.5, 1.0);
                shade[4u * q + i] = corner.x * 0.5 + 0.5;
            }
            for (uint i = 0u; i < 2u; i++) {
                gl_PrimitiveTriangleIndicesEXT[2u * q + i] = 4u * q + (i == 0u ? uvec3(0, 1, 2) : uvec3(2, 1, 3));
                gl_MeshPrimitivesEXT[2u * q + i].gl_CullPrimitiveEXT = (q & 1u) == 1u;
                part[2u * q + i] = float(q) / 255.0;
            }
        })",
                                     R"(
        layout(location = 0) in float shade;
        layout(location = 1) perprimitiveEXT in float part;
        layout(location = 0) out vec4 color;
        void main() { color = vec4(part, shade, 1.0, 1.0); })");
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.drawMesh(1);
    });
    const std::vector<Pixel> picture = pixels();
    for (uint32_t y = 0; y < size; y++)
        for (uint32_t x = 0; x < size; x++) {
            const Pixel& pixel = picture[y * size + x];
            const uint32_t quad = y / 2 * 8 + x / 2;
            if (quad % 2 == 1) {
                EXPECT_EQ(pixel, black) << x << ", " << y;
                continue;
            }
            EXPECT_EQ(pixel[0], quad) << x << ", " << y;
            // Eight bits round to a half of 1 / 255, and interpolation has 2^-8 of a pixel to give away.
            EXPECT_NEAR(pixel[1], (x + 0.5) / 16 * 255, 1) << x << ", " << y;
            EXPECT_EQ(pixel[2], 255u) << x << ", " << y;
        }
}

TEST_F(MeshShaderTest, LinesAndPoints) {
    const Pipeline points = meshes(R"(
        layout(local_size_x = 16) in;
        layout(points, max_vertices = 16, max_primitives = 16) out;
        void main() {
            SetMeshOutputsEXT(16, 16);
            float place = (float(gl_LocalInvocationIndex) + 0.5) / 8.0 - 1.0;
            gl_MeshVerticesEXT[gl_LocalInvocationIndex].gl_Position = vec4(place, -place, 0.5, 1.0);
            gl_MeshVerticesEXT[gl_LocalInvocationIndex].gl_PointSize = 1.0;
            gl_PrimitivePointIndicesEXT[gl_LocalInvocationIndex] = gl_LocalInvocationIndex;
        })",
                                   red_fragment);
    draw(color, [&](Command& list) {
        list.setPipeline(points);
        list.drawMesh(1);
    });
    expectRed([](uint32_t x, uint32_t y) { return x == y; });
    const Pipeline lines = meshes(R"(
        layout(local_size_x = 1) in;
        layout(lines, max_vertices = 2, max_primitives = 1) out;
        void main() {
            SetMeshOutputsEXT(2, 1);
            gl_MeshVerticesEXT[0].gl_Position = vec4(-1.0, 0.5 / 8.0, 0.5, 1.0);
            gl_MeshVerticesEXT[1].gl_Position = vec4(1.0, 0.5 / 8.0, 0.5, 1.0);
            gl_PrimitiveLineIndicesEXT[0] = uvec2(0, 1);
        })",
                                  red_fragment);
    draw(color, [&](Command& list) {
        list.setPipeline(lines);
        list.drawMesh(1);
    });
    expectRed([](uint32_t, uint32_t y) { return y == 7; });
}

TEST_F(MeshShaderTest, DepthCullingAndSamples) {
    const Texture depth = makeTexture(FormatDf32, size, size);
    const Pipeline hidden = meshes(tile_mesh, red_fragment, [](Pipeline& p) {
        p.setDepthFormat(FormatDf32);
        p.setDepthFunc(Pipeline::DepthFuncGreater);
        p.setCullMode(Pipeline::CullModeFront);
    });
    for (const bool front : {false, true}) {
        Target target = device.createTarget(color, depth);
        target.setClearDepth(front ? 0.25f : 0.75f);
        const Query samples = device.createQuery(Query::TypeSamples);
        Command list = device.createCommand(target);
        list.setPipeline(hidden);
        list.beginQuery(samples);
        list.drawMesh(4, 4);
        list.endQuery(samples);
        submit(list);
        const Expected<uint64_t> count = device.getSamples(samples);
        ASSERT_THAT(count, IsOk());
        EXPECT_EQ(*count, front ? 16u : 0u);
        EXPECT_EQ(countPixels(pixels(), red), front ? 16u : 0u);
    }
}

TEST_F(MeshShaderTest, VertexAndMeshPipelinesInOneList) {
    const Pipeline plain = makePipeline(cover_vertex, push_fragment);
    const Pipeline pipeline = meshes(tile_mesh, red_fragment);
    draw(color, [&](Command& list) {
        list.setPipeline(plain);
        list.setPushConstants(Color{0, 0, 1, 1});
        list.setScissor(0, 0, 8, 16);
        list.drawArrays(3);
        list.setPipeline(pipeline);
        list.drawMesh(16, 2);
        list.setPipeline(plain);
        list.setScissor(0, 0, 1, 1);
        list.drawArrays(3);
    });
    const std::vector<Pixel> picture = pixels();
    EXPECT_EQ(countPixels(picture, red), 15u);
    EXPECT_EQ(countPixels(picture, blue), 8u * 14 + 1);
}

}  // namespace glint::test
