// Acceleration structures.

#include "conformance/misuse.h"

#include <limits>

namespace glint::test {

namespace {

Buffer corners(MisuseKit& kit, uint64_t size = 256) { return kit.buffer(Buffer::FlagTracing, size); }

/// A top level with room for `room`, given these instances.
Error instanced(MisuseKit& kit, uint32_t room, const std::vector<Tracing::Instance>& instances) {
    Tracing scene = kit.device.createTracing("scene");
    scene.setInstances(room);
    EXPECT_THAT(scene.create(Tracing::TypeInstance), IsOk());
    kit.device.setTracing(scene, instances);
    return kit.device.flush().error();
}

Error built(MisuseKit& kit, const std::function<void(Device&)>& build) {
    build(kit.device);
    return kit.device.flush().error();
}

}  // namespace

MISUSE(StructureOfNothing, "tracing.empty") {
    return kit.configured(Tracing::TypeTriangle, [](Tracing&) {});
}
MISUSE(StructureWithoutFeature, "tracing.unsupported") {
    return kit.bare.createTracing("bare").create(Tracing::TypeInstance).error();
}
MISUSE(StructureCreatedTwice, "tracing.created") { return kit.triangle().create(Tracing::TypeTriangle).error(); }
MISUSE(StructureOfContraryFlags, "tracing.flags") {
    return kit.configured(
        Tracing::TypeInstance, [](Tracing& tracing) { tracing.setInstances(1); },
        Tracing::FlagFastBuild | Tracing::FlagFastTrace);
}
MISUSE(VerticesOfAnotherFormat, "tracing.format") {
    return kit.configured(Tracing::TypeTriangle,
                          [&](Tracing& tracing) { tracing.addVertexBuffer(3, FormatRGBAf32, 16, corners(kit)); });
}
MISUSE(VerticesOfNullBuffer, "tracing.buffer") {
    return kit.configured(Tracing::TypeTriangle,
                          [](Tracing& tracing) { tracing.addVertexBuffer(3, FormatRGBf32, 12, Buffer()); });
}
MISUSE(VerticesWithoutFlag, "buffer.flag") {
    return kit.configured(Tracing::TypeTriangle,
                          [&](Tracing& tracing) { tracing.addVertexBuffer(3, FormatRGBf32, 12, kit.buffer()); });
}
MISUSE(VerticesBeyondTheEnd, "tracing.range") {
    return kit.configured(Tracing::TypeTriangle,
                          [&](Tracing& tracing) { tracing.addVertexBuffer(300, FormatRGBf32, 12, corners(kit)); });
}
MISUSE(VerticesOfShortStride, "tracing.stride") {
    return kit.configured(Tracing::TypeTriangle,
                          [&](Tracing& tracing) { tracing.addVertexBuffer(3, FormatRGBf32, 8, corners(kit)); });
}
MISUSE(VerticesMisaligned, "tracing.stride") {
    return kit.configured(Tracing::TypeTriangle,
                          [&](Tracing& tracing) { tracing.addVertexBuffer(3, FormatRGBf32, 12, corners(kit), 2); });
}
MISUSE(VerticesOfAnotherDevice, "handle.device") {
    return kit.configured(Tracing::TypeTriangle, [&](Tracing& tracing) {
        tracing.addVertexBuffer(3, FormatRGBf32, 12, kit.foreign.createBuffer(Buffer::FlagTracing, 64));
    });
}
MISUSE(VerticesOfPartOfATriangle, "tracing.vertices") {
    return kit.configured(Tracing::TypeTriangle,
                          [&](Tracing& tracing) { tracing.addVertexBuffer(4, FormatRGBf32, 12, corners(kit)); });
}
MISUSE(IndicesBeforeVertices, "tracing.order") {
    return kit.configured(Tracing::TypeTriangle,
                          [&](Tracing& tracing) { tracing.addIndexBuffer(3, FormatRu32, corners(kit)); });
}
MISUSE(IndicesTwice, "tracing.order") {
    return kit.configured(Tracing::TypeTriangle, [&](Tracing& tracing) {
        tracing.addVertexBuffer(3, FormatRGBf32, 12, corners(kit));
        tracing.addIndexBuffer(3, FormatRu32, corners(kit));
        tracing.addIndexBuffer(3, FormatRu32, corners(kit));
    });
}
MISUSE(IndicesOfPartOfATriangle, "tracing.indices") {
    return kit.configured(Tracing::TypeTriangle, [&](Tracing& tracing) {
        tracing.addVertexBuffer(3, FormatRGBf32, 12, corners(kit));
        tracing.addIndexBuffer(4, FormatRu32, corners(kit));
    });
}
MISUSE(IndicesOfAnotherFormat, "tracing.indices") {
    return kit.configured(Tracing::TypeTriangle, [&](Tracing& tracing) {
        tracing.addVertexBuffer(3, FormatRGBf32, 12, corners(kit));
        tracing.addIndexBuffer(3, FormatRf32, corners(kit));
    });
}
MISUSE(BoxesOfShortStride, "tracing.stride") {
    return kit.configured(Tracing::TypeBound, [&](Tracing& tracing) { tracing.addBoundBuffer(1, 16, corners(kit)); });
}
MISUSE(BoxesAmongTriangles, "tracing.geometry") {
    return kit.configured(Tracing::TypeTriangle, [&](Tracing& tracing) {
        tracing.addVertexBuffer(3, FormatRGBf32, 12, corners(kit));
        tracing.addBoundBuffer(1, 24, corners(kit));
    });
}
MISUSE(TrianglesAmongInstances, "tracing.geometry") {
    return kit.configured(Tracing::TypeInstance,
                          [&](Tracing& tracing) { tracing.addVertexBuffer(3, FormatRGBf32, 12, corners(kit)); });
}
MISUSE(InstancesAmongTriangles, "tracing.geometry") {
    return kit.configured(Tracing::TypeTriangle, [&](Tracing& tracing) {
        tracing.addVertexBuffer(3, FormatRGBf32, 12, corners(kit));
        tracing.setInstances(4);
    });
}
MISUSE(InstancesTooMany, "tracing.instances") {
    const Tracing triangle = kit.triangle();
    return instanced(kit, 1, {{.tracing = &triangle}, {.tracing = &triangle}});
}
MISUSE(InstancesOfABottomLevel, "tracing.type") {
    return built(kit, [&](Device& device) { device.setTracing(kit.triangle(), {}); });
}
MISUSE(InstanceOfManyBits, "tracing.instance_bits") {
    const Tracing triangle = kit.triangle();
    return instanced(kit, 1, {{.tracing = &triangle, .data = 1u << 24}});
}
MISUSE(InstanceOfAWideMask, "tracing.instance_bits") {
    const Tracing triangle = kit.triangle();
    return instanced(kit, 1, {{.tracing = &triangle, .mask = 0x100}});
}
MISUSE(InstanceInfinitelyFar, "tracing.instance_transform") {
    const Tracing triangle = kit.triangle();
    Tracing::Instance instance = {.tracing = &triangle};
    instance.transform[3] = std::numeric_limits<float>::infinity();
    return instanced(kit, 1, {instance});
}
MISUSE(InstanceOfAFailure, "tracing.instance_failed") {
    Tracing failed = kit.device.createTracing("failed");
    EXPECT_FALSE(failed.create(Tracing::TypeTriangle));
    kit.log.take();
    return instanced(kit, 1, {{.tracing = &failed}});
}
MISUSE(InstanceOfATopLevel, "tracing.instance_type") {
    Tracing top = kit.device.createTracing("top");
    top.setInstances(1);
    EXPECT_THAT(top.create(Tracing::TypeInstance), IsOk());
    return instanced(kit, 1, {{.tracing = &top}});
}
MISUSE(UpdateWithoutFlag, "tracing.update") {
    return built(kit, [&](Device& device) {
        const Tracing triangle = kit.triangle();
        device.buildTracing(triangle);
        device.updateTracing(triangle);
    });
}
MISUSE(UpdateBeforeTheBuild, "tracing.unbuilt") {
    return built(kit, [&](Device& device) { device.updateTracing(kit.triangle(Tracing::FlagUpdate)); });
}
MISUSE(InstancesOfWhatIsNotBuilt, "tracing.unbuilt") {
    return built(kit, [&](Device& device) {
        const Tracing triangle = kit.triangle();
        device.buildTracing(device.createTracing({Tracing::Instance{.tracing = &triangle}}));
    });
}
MISUSE(ScratchTooSmall, "tracing.scratch") {
    return built(kit, [&](Device& device) { device.buildTracing(kit.triangle(), kit.buffer(Buffer::FlagScratch, 4)); });
}
MISUSE(ScratchTooSmallForAny, "tracing.scratch") {
    const Tracing triangle = kit.triangle();
    return kit.device.buildTracings({&triangle, 1}, kit.buffer(Buffer::FlagScratch, 4)).error();
}
MISUSE(ScratchWithoutFlag, "buffer.flag") {
    return built(
        kit, [&](Device& device) { device.buildTracing(kit.triangle(), kit.buffer(Buffer::FlagStorage, 1 << 20)); });
}
MISUSE(ScratchMisaligned, "tracing.scratch_alignment") {
    return kit.list(
        [&](Compute& list) { list.buildTracing(kit.triangle(), kit.buffer(Buffer::FlagScratch, 1 << 20), 1); });
}
MISUSE(BuildOfNull, "handle.null") {
    return built(kit, [](Device& device) { device.buildTracing(Tracing()); });
}
MISUSE(BuildOfTheUncreated, "handle.not_ready") {
    return built(kit, [&](Device& device) { device.buildTracing(device.createTracing("uncreated")); });
}
MISUSE(BuildOnTheCopyQueue, "recorder.queue") {
    return kit.list([&](Compute& list) { list.buildTracing(kit.triangle()); }, Queue::Copy);
}
MISUSE(BuildAfterCompaction, "tracing.compacted") {
    const Tracing triangle = kit.triangle(Tracing::FlagCompact);
    EXPECT_THAT(kit.device.buildTracings({triangle}, Tracing::FlagCompact), IsOk());
    kit.device.buildTracing(triangle);
    return kit.device.flush().error();
}
MISUSE(TraceOfABottomLevel, "bind.tracing_type") {
    return kit.compute([&](Compute& list) { list.setTracing(0, kit.triangle()); });
}
MISUSE(TraceOfWhatIsNotBuilt, "bind.tracing_unbuilt") {
    return kit.compute([&](Compute& list) {
        Tracing scene = kit.device.createTracing("scene");
        scene.setInstances(1);
        EXPECT_THAT(scene.create(Tracing::TypeInstance), IsOk());
        list.setTracing(0, scene);
    });
}

}  // namespace glint::test
