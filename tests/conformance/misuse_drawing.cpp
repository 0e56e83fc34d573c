// Wrong uses of draws: indirect ones with counts, mesh shaders, viewports.

#include "conformance/misuse.h"

#include <fmt/format.h>

#include <limits>

namespace glint::test {

namespace {

constexpr const char* triangle_mesh = R"(
layout(local_size_x = 1) in;
layout(triangles, max_vertices = 3, max_primitives = 1) out;
void main() { SetMeshOutputsEXT(0, 0); })";
constexpr const char* reading_mesh = R"(
layout(local_size_x = 1) in;
layout(triangles, max_vertices = 3, max_primitives = 1) out;
struct Payload { uint first[4]; };
taskPayloadSharedEXT Payload payload;
void main() { SetMeshOutputsEXT(payload.first[0], 0); })";

Pipeline unfinishedMeshes(MisuseKit& kit, std::string_view mesh = triangle_mesh, std::string_view task = {}) {
    Pipeline pipeline = kit.device.createPipeline("meshes");
    if (!mesh.empty()) pipeline.createShaderGLSL(Shader::TypeMesh, mesh);
    if (!task.empty()) pipeline.createShaderGLSL(Shader::TypeTask, task);
    pipeline.createShaderGLSL(Shader::TypeFragment, red_fragment);
    pipeline.setColorFormat(FormatRGBAu8n);
    return pipeline;
}

Pipeline meshes(MisuseKit& kit) {
    Pipeline pipeline = unfinishedMeshes(kit);
    EXPECT_THAT(pipeline.create(), IsOk());
    return pipeline;
}

/// A list with a pipeline of mesh shaders.
Error meshed(MisuseKit& kit, const std::function<void(Command&)>& record) {
    const Pipeline pipeline = meshes(kit);
    return kit.command([&](Command& list) {
        list.setPipeline(pipeline);
        record(list);
    });
}

Error viewed(MisuseKit& kit, const std::vector<Viewport>& viewports) {
    return kit.command([&](Command& list) { list.setViewports(viewports); });
}

Error counted(MisuseKit& kit, const Buffer& count, uint64_t offset) {
    return kit.command([&](Command& list) {
        list.setPipeline(kit.pipeline());
        list.setVertexBuffer(0, kit.buffer(Buffer::FlagVertex));
        list.drawArraysIndirect(kit.buffer(Buffer::FlagIndirect), 0, count, offset, 2);
    });
}

/// Compilers of GLSL know limits of their own, so the number behind an execution mode is written into the module.
Error meshOutputs(MisuseKit& kit, uint32_t mode, uint32_t value) {
    const Shader shader = Shader::createGLSL(Shader::TypeMesh, triangle_mesh);
    std::vector<uint32_t> words(shader.getWords().begin(), shader.getWords().end());
    for (size_t i = 5; i + 3 < words.size(); i += std::max(words[i] >> 16, 1u)) {
        constexpr uint32_t execution_mode = 16;
        if ((words[i] & 0xffffu) == execution_mode && words[i + 2] == mode) words[i + 3] = value;
    }
    Pipeline pipeline = kit.device.createPipeline("meshes");
    pipeline.setShader(Shader::createSPIRV(Shader::TypeMesh, words));
    pipeline.createShaderGLSL(Shader::TypeFragment, red_fragment);
    pipeline.setColorFormat(FormatRGBAu8n);
    return pipeline.create().error();
}

}  // namespace

// Counts.

MISUSE(CountWithoutFeature, "draw.count") {
    Command list = kit.bare.createCommand(
        kit.bare.createTarget(kit.bare.createTexture2D(FormatRGBAu8n, 8, 8, Texture::FlagTarget)));
    const Buffer buffer = kit.bare.createBuffer(Buffer::FlagIndirect, 64);
    list.drawElementsIndirect(buffer, 0, buffer, 0, 1);
    return list.end().error();
}
MISUSE(CountMisaligned, "draw.count") { return counted(kit, kit.buffer(Buffer::FlagIndirect), 2); }
MISUSE(CountBeyondTheEnd, "draw.count") { return counted(kit, kit.buffer(Buffer::FlagIndirect), 256); }
MISUSE(CountFarBeyondTheEnd, "draw.count") { return counted(kit, kit.buffer(Buffer::FlagIndirect), ~3ull); }
MISUSE(CountInASmallBuffer, "draw.count") { return counted(kit, kit.buffer(Buffer::FlagIndirect, 3), 0); }
MISUSE(CountWithoutFlag, "buffer.flag") { return counted(kit, kit.buffer(), 0); }
MISUSE(CountThatIsNull, "handle.null") { return counted(kit, Buffer(), 0); }
MISUSE(CountOfAnotherDevice, "handle.device") {
    return counted(kit, kit.foreign.createBuffer(Buffer::FlagIndirect, 64), 0);
}
MISUSE(CountedArgumentsBeyondTheEnd, "draw.indirect") {
    return kit.command([&](Command& list) {
        const Buffer buffer = kit.buffer(Buffer::FlagIndirect);
        list.drawArraysIndirect(buffer, 16, buffer, 0, 16);
    });
}

// Viewports.

MISUSE(ScissorsOfNone, "draw.scissors") {
    return kit.command([](Command& list) { list.setScissors({}); });
}
MISUSE(ScissorsOfMany, "draw.scissors") {
    const std::vector<Scissor> scissors(kit.device.getFeatures().maxViewports + 1, {0, 0, 1, 1});
    return kit.command([&](Command& list) { list.setScissors(scissors); });
}
MISUSE(ScissorsUnlikeViewports, "draw.scissors") {
    if (kit.device.getFeatures().maxViewports < 3) return kit.command([](Command& list) { list.setScissors({}); });
    const Pipeline pipeline = kit.pipeline();
    return kit.command([&](Command& list) {
        list.setPipeline(pipeline);
        list.setViewports({{.width = 1, .height = 1}, {.width = 1, .height = 1}, {.width = 1, .height = 1}});
        list.setScissors({{0, 0, 1, 1}, {0, 0, 1, 1}});
        list.drawArrays(3);
    });
}
MISUSE(ViewportsOfNone, "draw.viewports") { return viewed(kit, {}); }
MISUSE(ViewportsOfMany, "draw.viewports") {
    return viewed(kit, std::vector<Viewport>(kit.device.getFeatures().maxViewports + 1, {.width = 8, .height = 8}));
}
MISUSE(ViewportsWithoutFeature, "draw.viewports") {
    Command list = kit.bare.createCommand(
        kit.bare.createTarget(kit.bare.createTexture2D(FormatRGBAu8n, 8, 8, Texture::FlagTarget)));
    list.setViewports({{.width = 8, .height = 8}, {.width = 8, .height = 8}});
    return list.end().error();
}
MISUSE(SecondViewportOfNothing, "draw.viewport") { return viewed(kit, {{.width = 8, .height = 8}, {.width = 8}}); }
MISUSE(SecondViewportOfNaN, "draw.viewport") {
    return viewed(kit, {{.width = 8, .height = 8},
                        {.width = 8, .height = 8, .maximum_depth = std::numeric_limits<float>::quiet_NaN()}});
}

// Mesh shaders.

MISUSE(MeshShaderWithoutFeature, "program.feature") {
    Pipeline pipeline = kit.bare.createPipeline();
    pipeline.createShaderGLSL(Shader::TypeMesh, triangle_mesh);
    pipeline.createShaderGLSL(Shader::TypeFragment, red_fragment);
    pipeline.setColorFormat(FormatRGBAu8n);
    return pipeline.create().error();
}
MISUSE(LayerOfAVertexWithoutFeature, "program.feature") {
    Pipeline pipeline = kit.bare.createPipeline();
    pipeline.createShaderGLSL(Shader::TypeVertex, "void main() { gl_Position = vec4(0.0); gl_Layer = 1; }");
    pipeline.createShaderGLSL(Shader::TypeFragment, red_fragment);
    pipeline.setColorFormat(FormatRGBAu8n);
    return pipeline.create().error();
}
MISUSE(MeshAndVertexShader, "program.stage") {
    Pipeline pipeline = unfinishedMeshes(kit);
    pipeline.createShaderGLSL(Shader::TypeVertex, cover_vertex);
    return pipeline.create().error();
}
MISUSE(TaskWithoutMesh, "program.stage") {
    return unfinishedMeshes(kit, {}, "layout(local_size_x = 1) in; void main() { EmitMeshTasksEXT(1, 1, 1); }")
        .create()
        .error();
}
MISUSE(TaskAndVertexShader, "program.stage") {
    Pipeline pipeline =
        unfinishedMeshes(kit, {}, "layout(local_size_x = 1) in; void main() { EmitMeshTasksEXT(1, 1, 1); }");
    pipeline.createShaderGLSL(Shader::TypeVertex, cover_vertex);
    return pipeline.create().error();
}
MISUSE(KernelOfAMeshShader, "program.stage") {
    Kernel kernel = kit.device.createKernel();
    kernel.setShader(Shader::createGLSL(Shader::TypeMesh, triangle_mesh));
    return kernel.create().error();
}
MISUSE(AttributesOfAMeshShader, "pipeline.attribute") {
    Pipeline pipeline = unfinishedMeshes(kit);
    pipeline.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 0, 0, 16);
    return pipeline.create().error();
}
MISUSE(PayloadThatNobodyWrites, "pipeline.payload") { return unfinishedMeshes(kit, reading_mesh).create().error(); }
MISUSE(PayloadOfAnotherSize, "pipeline.payload") {
    return unfinishedMeshes(kit, reading_mesh, R"(
        layout(local_size_x = 1) in;
        struct Payload { uint first[5]; };
        taskPayloadSharedEXT Payload payload;
        void main() {
            payload.first[0] = 0u;
            EmitMeshTasksEXT(1, 1, 1);
        })")
        .create()
        .error();
}
MISUSE(PayloadOfManyBytes, "pipeline.mesh") {
    return unfinishedMeshes(kit, triangle_mesh,
                            fmt::format("layout(local_size_x = 1) in; struct Payload {{ uint values[{}]; }};"
                                        "taskPayloadSharedEXT Payload payload;"
                                        "void main() {{ payload.values[0] = 0u; EmitMeshTasksEXT(1, 1, 1); }}",
                                        kit.device.getFeatures().maxTaskPayload / 4 + 1))
        .create()
        .error();
}
MISUSE(MeshOfManySpecialisedThreads, "pipeline.mesh") {
    Pipeline pipeline = unfinishedMeshes(kit, R"(
        layout(local_size_x_id = 7) in;
        layout(triangles, max_vertices = 3, max_primitives = 1) out;
        void main() { SetMeshOutputsEXT(0, 0); })");
    pipeline.setConstant(7, kit.device.getFeatures().maxMeshThreads + 1);
    return pipeline.create().error();
}
MISUSE(TaskOfManySpecialisedThreads, "pipeline.mesh") {
    Pipeline pipeline = unfinishedMeshes(kit, triangle_mesh,
                                         "layout(local_size_x_id = 7) in; void main() { EmitMeshTasksEXT(1, 1, 1); }");
    pipeline.setConstant(7, kit.device.getFeatures().maxTaskThreads + 1);
    return pipeline.create().error();
}
MISUSE(MeshOfManyVertices, "pipeline.mesh") {
    return meshOutputs(kit, 26, kit.device.getFeatures().maxMeshVertices + 1);
}
MISUSE(MeshOfManyPrimitives, "pipeline.mesh") {
    return meshOutputs(kit, 5270, kit.device.getFeatures().maxMeshPrimitives + 1);
}
MISUSE(DrawMeshOfVertices, "draw.mesh") {
    return kit.command([&](Command& list) {
        list.setPipeline(kit.pipeline());
        list.drawMesh(1);
    });
}
MISUSE(DrawMeshIndirectOfVertices, "draw.mesh") {
    return kit.command([&](Command& list) {
        list.setPipeline(kit.pipeline());
        list.drawMeshIndirect(kit.buffer(Buffer::FlagIndirect));
    });
}
MISUSE(DrawArraysOfMeshes, "draw.mesh") {
    return meshed(kit, [](Command& list) { list.drawArrays(3); });
}
MISUSE(DrawMeshWithoutPipeline, "draw.pipeline") {
    return kit.command([](Command& list) { list.drawMesh(1); });
}
MISUSE(DrawMeshOfManyGroups, "draw.mesh_groups") {
    return meshed(kit, [&](Command& list) { list.drawMesh(kit.device.getFeatures().maxMeshGroupCountX + 1); });
}
MISUSE(DrawMeshOfManyGroupsInAll, "draw.mesh_groups") {
    return meshed(kit, [&](Command& list) { list.drawMesh(65535, 65535, 65535); });
}
MISUSE(DrawMeshIndirectMisaligned, "draw.indirect") {
    return meshed(kit, [&](Command& list) { list.drawMeshIndirect(kit.buffer(Buffer::FlagIndirect), 3); });
}
MISUSE(DrawMeshIndirectBeyondTheEnd, "draw.indirect") {
    return meshed(kit, [&](Command& list) { list.drawMeshIndirect(kit.buffer(Buffer::FlagIndirect), 248); });
}
MISUSE(DrawMeshUnderStatistics, "query.mesh") {
    const Query query = kit.device.createQuery(Query::TypeStatistics);
    return meshed(kit, [&](Command& list) {
        list.beginQuery(query);
        list.drawMesh(1);
        list.endQuery(query);
    });
}

}  // namespace glint::test
