// Ray-tracing pipelines.

#include "conformance/misuse.h"

namespace glint::test {

namespace {

constexpr const char* generation = R"(
layout(binding = 0, std430) writeonly buffer Results { uint results[]; };
void main() { results[gl_LaunchIDEXT.x] = 1u; }
)";
constexpr const char* tracing_generation = R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(location = 0) rayPayloadEXT uvec2 payload;
layout(location = 1) callableDataEXT vec3 data;
void main() {
    traceRayEXT(scene, 0u, 0xff, 0, 0, 0, vec3(0.0), 0.0, vec3(1.0), 1.0, 0);
    executeCallableEXT(0, 1);
}
)";

/// A traversal with a ray-generation shader, before create(); what `configure` does to it is wrong.
Error created(MisuseKit& kit, const std::function<void(Traversal&)>& configure, const char* text = generation) {
    Traversal traversal = kit.device.createTraversal("traversal");
    traversal.createShaderGLSL(Shader::TypeRayGen, text);
    configure(traversal);
    return traversal.create().error();
}

Traversal ready(MisuseKit& kit, Device device = {}) {
    if (!device) device = kit.device;
    Traversal traversal = device.createTraversal("traversal");
    traversal.createShaderGLSL(Shader::TypeRayGen, generation);
    EXPECT_THAT(traversal.create(), IsOk());
    return traversal;
}

/// A list with a ready traversal; what `record` does to it is wrong.
Error traced(MisuseKit& kit, const std::function<void(Compute&)>& record) {
    const Traversal traversal = ready(kit);
    return kit.list([&](Compute& list) {
        list.setTraversal(traversal);
        list.setStorageBuffer(0, kit.buffer());
        record(list);
    });
}

}  // namespace

MISUSE(TraversalWithoutFeature, "device.unsupported") { return kit.bare.createTraversal("bare").error(); }
MISUSE(TraversalWithoutGeneration, "program.stage") {
    Traversal traversal = kit.device.createTraversal("traversal");
    traversal.createShaderGLSL(Shader::TypeRayMiss, "void main() {}");
    return traversal.create().error();
}
MISUSE(TraversalOfAVertexShader, "program.stage") {
    return created(kit, [](Traversal& traversal) { traversal.createShaderGLSL(Shader::TypeVertex, cover_vertex); });
}
MISUSE(TraversalOfAComputeShader, "program.stage") {
    return created(kit, [](Traversal& traversal) {
        traversal.setShader(Shader::createGLSL(Shader::TypeCompute, "layout(local_size_x = 1) in; void main() {}"));
    });
}
MISUSE(KernelOfAMissShader, "program.stage") {
    return kit.program("layout(local_size_x = 1) in; void main() {}", [](Kernel& kernel) {
        kernel.setShader(Shader::createGLSL(Shader::TypeRayMiss, "void main() {}"));
    });
}
MISUSE(TraversalOfABrokenShader, "shader.compile") {
    return created(kit, [](Traversal& traversal) { traversal.createShaderGLSL(Shader::TypeClosest, "nonsense"); });
}
MISUSE(TraversalOfAMissingFile, "file.open") {
    return created(kit, [](Traversal& traversal) { traversal.loadShaderGLSL(Shader::TypeClosest, "no/such.shader"); });
}
MISUSE(TraversalOfUnknownConstant, "program.constant") {
    return created(kit, [](Traversal& traversal) { traversal.setConstant("amount", 1u); });
}
MISUSE(TraversalCreatedTwice, "program.created") { return ready(kit).create().error(); }
MISUSE(RecursionBeyondTheLimit, "traversal.recursion") {
    return created(
        kit, [&](Traversal& traversal) { traversal.setRecursionDepth(kit.device.getFeatures().recursionDepth + 1); });
}
MISUSE(CallablesBeyondTheLimit, "traversal.callable_depth") {
    return created(kit, [](Traversal& traversal) { traversal.setCallableDepth(Traversal::max_callable_depth + 1); });
}
MISUSE(RecordOfNoGroup, "traversal.record_group") {
    return created(kit, [](Traversal& traversal) {
        traversal.createShaderGLSL(Shader::TypeClosest, "void main() {}");
        traversal.addHitRecord(1);
    });
}
MISUSE(RecordOfTooMuch, "traversal.record_size") {
    return created(kit, [&](Traversal& traversal) {
        const std::vector<std::byte> data(kit.device.getFeatures().maxRecordSize + 1);
        traversal.addHitGroup();
        traversal.addHitRecord(0, data.data(), data.size());
    });
}
MISUSE(RecordFromNowhere, "traversal.record_size") {
    return created(kit, [](Traversal& traversal) {
        traversal.createShaderGLSL(Shader::TypeRayMiss, "void main() {}");
        traversal.addMissRecord(0, nullptr, 4);
    });
}
MISUSE(RecordOfTooLittle, "traversal.record_size") {
    return created(kit, [](Traversal& traversal) {
        traversal.createShaderGLSL(Shader::TypeCallable, R"(
            layout(shaderRecordEXT, std430) readonly buffer Record { uvec4 value; };
            layout(location = 0) callableDataInEXT uvec4 data;
            void main() { data = value; })");
        traversal.addCallableRecord(0, 1u);
    });
}
MISUSE(RecordWithoutData, "traversal.record_size") {
    return created(kit, [](Traversal& traversal) {
        traversal.createShaderGLSL(Shader::TypeRayMiss, R"(
            layout(shaderRecordEXT, std430) readonly buffer Record { uint value; };
            layout(binding = 0, std430) writeonly buffer Results { uint results[]; };
            void main() { results[0] = value; })");
    });
}
MISUSE(PayloadThatNobodySends, "traversal.payload") {
    return created(
        kit,
        [](Traversal& traversal) {
            traversal.createShaderGLSL(Shader::TypeRayMiss,
                                       "layout(location = 0) rayPayloadInEXT uvec4 got;\nvoid main() { got.x = 1u; }");
        },
        tracing_generation);
}
MISUSE(CallableDataThatNobodySends, "traversal.payload") {
    return created(
        kit,
        [](Traversal& traversal) {
            traversal.createShaderGLSL(
                Shader::TypeCallable, "layout(location = 1) callableDataInEXT vec4 got;\nvoid main() { got.x = 1.0; }");
        },
        tracing_generation);
}
MISUSE(AttributesTooLarge, "traversal.attribute") {
    return created(kit, [](Traversal& traversal) {
        traversal.createShaderGLSL(
            Shader::TypeIntersection,
            "struct Data { uint values[64]; };\nhitAttributeEXT Data data;\n"
            "void main() { data.values[gl_PrimitiveID & 63] = 1u; reportIntersectionEXT(1.0, 0u); }");
    });
}
MISUSE(NullTraversal, "handle.null") {
    return kit.list([](Compute& list) { list.setTraversal(Traversal()); });
}
MISUSE(UncreatedTraversal, "handle.not_ready") {
    const Traversal traversal = kit.device.createTraversal("traversal");
    return kit.list([&](Compute& list) { list.setTraversal(traversal); });
}
MISUSE(FailedTraversal, "handle.not_ready") {
    Traversal traversal = kit.device.createTraversal("traversal");
    EXPECT_FALSE(traversal.create());
    kit.log.take();
    return kit.list([&](Compute& list) { list.setTraversal(traversal); });
}
MISUSE(TraversalOfAnotherDevice, "handle.device") {
    const Traversal traversal = ready(kit, kit.foreign);
    return kit.list([&](Compute& list) { list.setTraversal(traversal); });
}
MISUSE(TraversalOnACopyQueue, "recorder.queue") {
    const Traversal traversal = ready(kit);
    return kit.list([&](Compute& list) { list.setTraversal(traversal); }, Queue::Copy);
}
MISUSE(GenerationThatIsNotThere, "traversal.generation") {
    const Traversal traversal = ready(kit);
    return kit.list([&](Compute& list) { list.setTraversal(traversal, 1); });
}
MISUSE(RaysTooManyInAll, "dispatch.rays") {
    return traced(kit, [&](Compute& list) { list.dispatch(65536, 65536, kit.device.getFeatures().maxGroupSizeZ); });
}
MISUSE(RaysTooManyAlongX, "dispatch.rays") {
    return traced(kit, [](Compute& list) { list.dispatch(1ull << 33); });
}
MISUSE(RaysUncountable, "dispatch.rays") {
    return traced(kit, [](Compute& list) { list.dispatch(1ull << 40, 1ull << 40, 1ull << 40); });
}
MISUSE(RaysWithoutTheirBuffer, "bind.unset") {
    const Traversal traversal = ready(kit);
    return kit.list([&](Compute& list) {
        list.setTraversal(traversal);
        list.dispatch(1);
    });
}
MISUSE(RaysCountedWithoutFlag, "buffer.flag") {
    return traced(kit, [&](Compute& list) { list.dispatchIndirect(kit.buffer()); });
}
MISUSE(RaysCountedBeyondTheEnd, "dispatch.indirect") {
    return traced(kit, [&](Compute& list) { list.dispatchIndirect(kit.buffer(Buffer::FlagIndirect, 16), 8); });
}
MISUSE(InstanceBeyondTheHitRecords, "traversal.hit_record") {
    Traversal traversal = kit.device.createTraversal("traversal");
    traversal.createShaderGLSL(Shader::TypeRayGen, tracing_generation);
    traversal.addHitGroup();
    traversal.addHitRecord(0);
    traversal.addHitRecord(0);
    EXPECT_THAT(traversal.create(), IsOk());
    const Tracing triangle = kit.triangle();
    const Tracing scene = kit.device.createTracing({Tracing::Instance{.tracing = &triangle, .offset = 2}});
    EXPECT_THAT(kit.device.buildTracings({triangle, scene}), IsOk());
    return kit.list([&](Compute& list) {
        list.setTraversal(traversal);
        list.setTracing(0, scene);
        list.dispatch(1);
    });
}
MISUSE(RaysOfABottomLevel, "bind.tracing_type") {
    const Tracing triangle = kit.triangle();
    return traced(kit, [&](Compute& list) { list.setTracing(0, triangle); });
}
MISUSE(RaysOfAnUnbuiltScene, "bind.tracing_unbuilt") {
    const Tracing triangle = kit.triangle();
    const Tracing scene = kit.device.createTracing({Tracing::Instance{.tracing = &triangle}});
    return traced(kit, [&](Compute& list) { list.setTracing(0, scene); });
}

}  // namespace glint::test
