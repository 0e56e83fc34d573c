// Recorders: bindings, dispatches, copies, draws, queries, submission.

#include "conformance/misuse.h"

#include <cmath>
#include <limits>

namespace glint::test {

namespace {

/// A kernel with one resource of a kind, dispatched with `record`'s bindings.
Error bound(MisuseKit& kit, const std::string& declaration, const std::string& use,
            const std::function<void(Compute&)>& record) {
    return kit.list([&](Compute& list) {
        list.setKernel(kit.kernel("layout(local_size_x = 1) in;\nlayout(binding = 9) buffer Out { vec4 result; };\n" +
                                  declaration + "\nvoid main() { result = " + use + "; }"));
        list.setStorageBuffer("Out", kit.buffer());
        record(list);
        list.dispatch(1);
    });
}

constexpr const char* picture =
    "layout(binding = 0) uniform texture2D picture; layout(binding = 1) uniform sampler nearest;";
constexpr const char* picture_use = "texelFetch(sampler2D(picture, nearest), ivec2(0), 0)";

/// A transfer of the device, played.
Error transferred(MisuseKit& kit, const std::function<void(Device&)>& transfer) {
    transfer(kit.device);
    return kit.device.flush().error();
}

/// Everything that one draw with kit.pipeline() wants.
Error drawn(MisuseKit& kit, const std::function<void(Command&)>& record) {
    return kit.command([&](Command& list) {
        list.setPipeline(kit.pipeline());
        list.setVertexBuffer(0, kit.buffer(Buffer::FlagVertex, 48));
        record(list);
        list.drawArrays(3);
    });
}

}  // namespace

// Handles.

MISUSE(KernelOfNull, "handle.null") {
    return kit.list([](Compute& list) { list.setKernel(Kernel()); });
}
MISUSE(PipelineOfNull, "handle.null") {
    return kit.command([](Command& list) { list.setPipeline(Pipeline()); });
}
MISUSE(BufferOfNull, "handle.null") {
    return kit.compute([](Compute& list) { list.setStorageBuffer(0, Buffer()); });
}
MISUSE(TextureOfNull, "handle.null") {
    return kit.compute([](Compute& list) { list.setTexture(0, Texture()); });
}
MISUSE(SamplerOfNull, "handle.null") {
    return kit.compute([](Compute& list) { list.setSampler(0, Sampler()); });
}
MISUSE(TracingOfNull, "handle.null") {
    return kit.compute([](Compute& list) { list.setTracing(0, Tracing()); });
}
MISUSE(QueryOfNull, "handle.null") {
    return kit.compute([](Compute& list) { list.beginQuery(Query()); });
}
MISUSE(VertexBufferOfNull, "handle.null") {
    return kit.command([](Command& list) { list.setVertexBuffer(0, Buffer()); });
}
MISUSE(ReadingANullBuffer, "handle.null") {
    int value = 0;
    return kit.device.getBuffer(Buffer(), 0, &value, 4).error();
}
MISUSE(WritingANullBuffer, "handle.null") {
    return transferred(kit, [](Device& device) { device.setBuffer(Buffer(), 0, "abc", 4); });
}
MISUSE(FlushingANullBuffer, "handle.null") {
    return transferred(kit, [](Device& device) { device.flushBuffer(Buffer()); });
}
MISUSE(BufferThatFailed, "handle.not_ready") {
    return kit.compute([&](Compute& list) { list.setStorageBuffer(0, kit.failedBuffer()); });
}
MISUSE(KernelNotCreated, "handle.not_ready") {
    return kit.list([&](Compute& list) { list.setKernel(kit.device.createKernel("not created")); });
}
MISUSE(PipelineNotCreated, "handle.not_ready") {
    return kit.command([&](Command& list) { list.setPipeline(kit.unfinished()); });
}
MISUSE(ReadingAFailedBuffer, "handle.not_ready") {
    int value = 0;
    return kit.device.getBuffer(kit.failedBuffer(), 0, &value, 4).error();
}
MISUSE(BufferOfAnotherDevice, "handle.device") {
    return kit.compute(
        [&](Compute& list) { list.setStorageBuffer(0, kit.foreign.createBuffer(Buffer::FlagStorage, 64)); });
}
MISUSE(KernelOfAnotherDevice, "handle.device") {
    return kit.list([&](Compute& list) {
        Kernel kernel = kit.foreign.createKernel();
        kernel.createShaderGLSL("layout(local_size_x = 1) in;\nvoid main() {}");
        EXPECT_THAT(kernel.create(), IsOk());
        list.setKernel(kernel);
    });
}
MISUSE(CopyFromAnotherDevice, "handle.device") {
    return transferred(kit, [&](Device& device) {
        device.copyBuffer(kit.buffer(), 0, kit.foreign.createBuffer(Buffer::FlagStorage, 64), 0, 4);
    });
}
MISUSE(RecorderOfAnotherDevice, "handle.device") {
    Compute list = kit.foreign.createCompute();
    return kit.device.submit(list).error();
}
MISUSE(FenceOfAnotherDevice, "handle.device") { return kit.device.submit({}, kit.foreign.createFence()).error(); }

// Bindings.

MISUSE(SlotNegative, "bind.slot") {
    return kit.compute([&](Compute& list) { list.setStorageBuffer(-1, kit.buffer()); });
}
MISUSE(SlotFarAway, "bind.slot") {
    return kit.compute([&](Compute& list) { list.setStorageBuffer(100000, kit.buffer()); });
}
MISUSE(SlotHuge, "bind.slot") {
    return kit.compute([&](Compute& list) { list.setUniform(std::numeric_limits<int64_t>::max(), Color()); });
}
MISUSE(SlotBeyondItsArray, "bind.slot") {
    return bound(kit, "layout(binding = 0) buffer Parts { vec4 value; } parts[2];", "parts[0].value + parts[1].value",
                 [&](Compute& list) {
                     list.setStorageBuffers("Parts", {kit.buffer(), kit.buffer(), kit.buffer()});
                 });
}
MISUSE(SlotOfUnknownName, "bind.name") {
    return kit.compute([&](Compute& list) { list.setUniform("Parametres", Color()); });
}
MISUSE(SlotNameOfAnotherKind, "bind.name") {
    return kit.compute([&](Compute& list) { list.setStorageBuffer("Parameters", kit.buffer()); });
}
MISUSE(SlotOfUnknownBinding, "bind.name") {
    return kit.compute([&](Compute& list) { list.setUniform(Slot::at(3, 0), Color()); });
}
MISUSE(SlotNameBeforeTheKernel, "bind.program") {
    return kit.list([&](Compute& list) { list.setStorageBuffer("Values", kit.buffer()); });
}
MISUSE(SlotBindingBeforeTheKernel, "bind.program") {
    return kit.list([&](Compute& list) { list.setStorageBuffer(Slot::at(0, 0), kit.buffer()); });
}
MISUSE(UniformNotSet, "bind.unset") {
    return kit.list([&](Compute& list) {
        list.setKernel(kit.kernel());
        list.setStorageBuffer(0, kit.buffer());
        list.dispatch(1);
    });
}
MISUSE(StorageNotSet, "bind.unset") {
    return kit.list([&](Compute& list) {
        list.setKernel(kit.kernel());
        list.setUniform(0, Color());
        list.dispatch(1);
    });
}
MISUSE(TextureNotSet, "bind.unset") {
    return bound(kit, picture, picture_use, [&](Compute& list) { list.setSampler(0, kit.device.createSampler()); });
}
MISUSE(SamplerNotSet, "bind.unset") {
    return bound(kit, picture, picture_use, [&](Compute& list) { list.setTexture(0, kit.texture()); });
}
MISUSE(SurfaceNotSet, "bind.unset") {
    return bound(kit, "layout(binding = 0, rgba8) uniform image2D surface;", "imageLoad(surface, ivec2(0))",
                 [](Compute&) {});
}
MISUSE(TexelNotSet, "bind.unset") {
    return bound(kit, "layout(binding = 0) uniform textureBuffer texels;", "texelFetch(texels, 0)", [](Compute&) {});
}
MISUSE(ArrayElementNotSet, "bind.unset") {
    return bound(kit, "layout(binding = 0) buffer Parts { vec4 value; } parts[2];", "parts[0].value + parts[1].value",
                 [&](Compute& list) { list.setStorageBuffers("Parts", {kit.buffer()}); });
}
MISUSE(SingleBufferAfterAnArray, "bind.unset") {
    // What was set as an element of an array is not set as a buffer.
    return kit.list([&](Compute& list) {
        list.setKernel(kit.kernel("layout(local_size_x = 1) in;\nlayout(binding = 0) buffer P { vec4 v; } parts[2];\n"
                                  "void main() { parts[0].v = parts[1].v; }"));
        list.setStorageBuffers(0, {kit.buffer(), kit.buffer()});
        list.dispatch(1);
        list.setKernel(kit.kernel("layout(local_size_x = 1) in;\nlayout(binding = 0) buffer P { vec4 v; };\n"
                                  "void main() { v = vec4(1.0); }"));
        list.dispatch(1);
    });
}
MISUSE(UniformOfAnotherSize, "bind.uniform_size") {
    return kit.compute([](Compute& list) { list.setUniform(0, std::array<float, 8>()); });
}
MISUSE(UniformOfNothing, "bind.uniform_size") {
    return kit.compute([](Compute& list) { list.setUniformData(0, nullptr, 16); });
}
MISUSE(UniformBufferTooSmall, "bind.uniform_size") {
    return kit.compute([&](Compute& list) { list.setUniformBuffer(0, kit.buffer(Buffer::FlagUniform, 12)); });
}
MISUSE(UniformInlineTooLarge, "bind.too_large") {
    return kit.compute([&](Compute& list) {
        const std::vector<std::byte> data(kit.device.getFeatures().maxUniformSize + 16);
        list.setUniformData(0, data.data(), data.size());
    });
}
MISUSE(UniformBufferTooLarge, "bind.too_large") {
    return kit.compute([&](Compute& list) {
        const uint64_t size = kit.device.getFeatures().maxUniformSize + 256;
        list.setUniformBuffer(0, kit.buffer(Buffer::FlagUniform, size), 0, size);
    });
}
MISUSE(StorageTooSmall, "bind.storage_size") {
    return kit.compute([&](Compute& list) { list.setStorageBuffer(0, kit.buffer(Buffer::FlagStorage, 12)); });
}
MISUSE(StoragePartTooSmall, "bind.storage_size") {
    return kit.compute([&](Compute& list) { list.setStorageBuffer(0, kit.buffer(), 0, 4); });
}
MISUSE(UniformMisaligned, "bind.alignment") {
    return kit.compute([&](Compute& list) { list.setUniformBuffer(0, kit.buffer(Buffer::FlagUniform), 1); });
}
MISUSE(StorageMisaligned, "bind.alignment") {
    return kit.compute([&](Compute& list) { list.setStorageBuffer(0, kit.buffer(), 1); });
}
MISUSE(StorageBeyondItsBuffer, "bind.range") {
    return kit.compute([&](Compute& list) { list.setStorageBuffer(0, kit.buffer(), 256); });
}
MISUSE(StorageLongerThanItsBuffer, "bind.range") {
    return kit.compute([&](Compute& list) { list.setStorageBuffer(0, kit.buffer(), 0, 257); });
}
MISUSE(StorageOfOverflowingRange, "bind.range") {
    return kit.compute([&](Compute& list) { list.setStorageBuffer(0, kit.buffer(), 64, UINT64_MAX); });
}
MISUSE(StorageWithoutFlag, "buffer.flag") {
    return kit.compute([&](Compute& list) { list.setStorageBuffer(0, kit.buffer(Buffer::FlagVertex)); });
}
MISUSE(UniformWithoutFlag, "buffer.flag") {
    return kit.compute([&](Compute& list) { list.setUniformBuffer(0, kit.buffer()); });
}
MISUSE(TexelWithoutFlag, "buffer.flag") {
    return kit.compute([&](Compute& list) { list.setTexelBuffer(0, kit.buffer(), FormatRf32); });
}
MISUSE(AddressWithoutFlag, "buffer.flag") {
    return kit.compute([&](Compute& list) { list.useBuffer(kit.buffer(), true); });
}
MISUSE(SurfaceWithoutFlag, "texture.flag") {
    return kit.compute([&](Compute& list) { list.setSurfaceTexture(0, kit.texture()); });
}
MISUSE(SurfaceOfSeveralMipmaps, "bind.surface_mips") {
    return kit.compute([&](Compute& list) {
        list.setSurfaceTexture(0, kit.texture(Texture::FlagSurface | Texture::FlagMipmaps), {.mip = 0, .mips = 2});
    });
}
MISUSE(TextureBeyondItsLayers, "texture.slice") {
    return kit.compute([&](Compute& list) { list.setTexture(0, kit.texture(), Slice{.layer = 3}); });
}
MISUSE(TextureBeyondItsMipmaps, "texture.slice") {
    return kit.compute([&](Compute& list) { list.setTexture(0, kit.texture(), Slice{.mip = 0, .mips = 9}); });
}
MISUSE(VolumeAsFlatTexture, "bind.texture_type") {
    return bound(kit, picture, picture_use, [&](Compute& list) {
        list.setTexture(0, kit.device.createTexture3D(FormatRGBAu8n, 4, 4, 4));
        list.setSampler(0, kit.device.createSampler());
    });
}
MISUSE(LayersAsFlatTexture, "bind.texture_type") {
    return bound(kit, picture, picture_use, [&](Compute& list) {
        list.setTexture(0, kit.device.createTexture({.format = FormatRGBAu8n, .width = 4, .height = 4, .layers = 3}));
        list.setSampler(0, kit.device.createSampler());
    });
}
MISUSE(SamplesAsFlatTexture, "bind.texture_type") {
    return bound(kit, picture, picture_use, [&](Compute& list) {
        list.setTexture(0, kit.texture(Texture::FlagTarget | Texture::FlagMultisample4));
        list.setSampler(0, kit.device.createSampler());
    });
}
MISUSE(FlatTextureAsCube, "bind.texture_type") {
    return bound(kit, "layout(binding = 0) uniform samplerCube faces;", "textureLod(faces, vec3(1.0), 0.0)",
                 [&](Compute& list) {
                     list.setTexture(0, kit.texture());
                     list.setSampler(0, kit.device.createSampler());
                 });
}
MISUSE(TextureAndSurfaceAtOnce, "bind.layout_conflict") {
    return bound(kit, std::string(picture) + "layout(binding = 2, rgba8) uniform image2D surface;",
                 std::string(picture_use) + " + imageLoad(surface, ivec2(0))", [&](Compute& list) {
                     const Texture both = kit.texture(Texture::FlagSurface);
                     list.setTexture(0, both);
                     list.setSurfaceTexture(0, both);
                     list.setSampler(0, kit.device.createSampler());
                 });
}
MISUSE(PushConstantsTooMany, "bind.push_size") {
    return kit.compute([&](Compute& list) {
        const std::vector<std::byte> data(4096);
        list.setPushData(data.data(), data.size());
    });
}
MISUSE(PushConstantsOfOddSize, "bind.push_size") {
    return kit.compute([](Compute& list) { list.setPushData("abc", 3); });
}
MISUSE(PushConstantsMissing, "bind.push_size") {
    return bound(kit, "layout(push_constant) uniform Push { vec4 pushed; };", "pushed",
                 [](Compute& list) { list.setPushConstants(1.0f); });
}

// Dispatches.

MISUSE(DispatchWithoutKernel, "dispatch.kernel") {
    return kit.list([](Compute& list) { list.dispatch(1); });
}
MISUSE(DispatchIndirectWithoutKernel, "dispatch.kernel") {
    return kit.list([&](Compute& list) { list.dispatchIndirect(kit.buffer(Buffer::FlagIndirect)); });
}
MISUSE(DispatchOfManyGroups, "dispatch.groups") {
    return kit.compute([](Compute& list) { list.dispatch(1ull << 40); });
}
MISUSE(DispatchOfManyGroupsDeep, "dispatch.groups") {
    return kit.compute([](Compute& list) { list.dispatch(1, 1, 1ull << 40); });
}
MISUSE(DispatchIndirectMisaligned, "dispatch.indirect") {
    return kit.compute([&](Compute& list) { list.dispatchIndirect(kit.buffer(Buffer::FlagIndirect), 2); });
}
MISUSE(DispatchIndirectBeyondTheEnd, "dispatch.indirect") {
    return kit.compute([&](Compute& list) { list.dispatchIndirect(kit.buffer(Buffer::FlagIndirect, 16), 8); });
}
MISUSE(DispatchIndirectWithoutFlag, "buffer.flag") {
    return kit.compute([&](Compute& list) { list.dispatchIndirect(kit.buffer()); });
}

// Copies.

MISUSE(WriteBeyondTheEnd, "copy.range") {
    return transferred(kit, [&](Device& device) { device.setBuffer(kit.buffer(), 254, "abcd", 4); });
}
MISUSE(WriteAtAnOverflowingOffset, "copy.range") {
    return transferred(kit, [&](Device& device) { device.setBuffer(kit.buffer(), UINT64_MAX, "abcd", 4); });
}
MISUSE(WriteFromNowhere, "copy.null") {
    return transferred(kit, [&](Device& device) { device.setBuffer(kit.buffer(), 0, nullptr, 4); });
}
MISUSE(ReadBeyondTheEnd, "copy.range") {
    std::array<std::byte, 300> data;
    return kit.device.getBuffer(kit.buffer(), 0, data.data(), data.size()).error();
}
MISUSE(ReadToNowhere, "copy.null") { return kit.device.getBuffer(kit.buffer(), 0, nullptr, 4).error(); }
MISUSE(CopyBeyondTheSource, "copy.range") {
    return kit.list(
        [&](Compute& list) { list.copyBuffer(kit.buffer(Buffer::FlagNone, 512), 0, kit.buffer(), 200, 100); });
}
MISUSE(CopyBeyondTheDestination, "copy.range") {
    return kit.list(
        [&](Compute& list) { list.copyBuffer(kit.buffer(), 200, kit.buffer(Buffer::FlagNone, 512), 0, 100); });
}
MISUSE(CopyOntoItself, "copy.overlap") {
    return kit.list([&](Compute& list) {
        const Buffer buffer = kit.buffer();
        list.copyBuffer(buffer, 50, buffer, 0, 100);
    });
}
MISUSE(ClearMisaligned, "copy.alignment") {
    return kit.list([&](Compute& list) { list.clearBuffer(kit.buffer(), 0, 1, 4); });
}
MISUSE(ClearOfOddSize, "copy.alignment") {
    return kit.list([&](Compute& list) { list.clearBuffer(kit.buffer(), 0, 0, 6); });
}
MISUSE(ClearBeyondTheEnd, "copy.range") {
    return kit.list([&](Compute& list) { list.clearBuffer(kit.buffer(), 0, 252, 8); });
}
MISUSE(UploadOfWrongSize, "copy.size") {
    return transferred(kit, [&](Device& device) { device.setTexture(kit.texture(), "abcd", 4); });
}
MISUSE(UploadFromNowhere, "copy.size") {
    return transferred(kit, [&](Device& device) { device.setTexture(kit.texture(), nullptr, 256); });
}
MISUSE(UploadBeyondTheTexture, "texture.region") {
    return transferred(kit, [&](Device& device) {
        device.setTexture(kit.texture(), "abcd", 4, {}, {.x = 8, .width = 1, .height = 1, .depth = 1});
    });
}
MISUSE(UploadOfOverflowingRegion, "texture.region") {
    return transferred(kit, [&](Device& device) {
        device.setTexture(kit.texture(), "abcd", 4, {}, {.x = 4, .width = UINT32_MAX, .height = 1, .depth = 1});
    });
}
MISUSE(UploadOfPartOfABlock, "texture.region") {
    return transferred(kit, [&](Device& device) {
        const std::array<std::byte, 64> data = {};
        const Format format = device.hasTexture(FormatBC1RGBAu8n) ? FormatBC1RGBAu8n : FormatBC7RGBAu8n;
        device.setTexture(kit.texture(0, format), data.data(), 8, {}, {.x = 1, .width = 4, .height = 4, .depth = 1});
    });
}
MISUSE(DownloadOfWrongSize, "copy.size") {
    std::array<std::byte, 16> data;
    return kit.device.getTexture(kit.texture(), data.data(), data.size()).error();
}
MISUSE(DownloadOfSamples, "copy.samples") {
    std::array<std::byte, 256> data;
    return kit.device.getTexture(kit.texture(Texture::FlagTarget | Texture::FlagMultisample4), data.data(), 256)
        .error();
}
MISUSE(CopyOfSeveralMipmaps, "copy.mips") {
    return kit.list([&](Compute& list) {
        list.copyTextureToBuffer(kit.buffer(Buffer::FlagNone, 4096), 0, kit.texture(Texture::FlagMipmaps),
                                 {.mip = 0, .mips = 2});
    });
}
MISUSE(CopyOfUnequalLayers, "copy.mips") {
    return kit.list([&](Compute& list) {
        const Texture layers =
            kit.device.createTexture({.format = FormatRGBAu8n, .width = 8, .height = 8, .layers = 3});
        list.copyTexture(layers, {.layers = 2}, layers, {.layer = 2, .layers = 1});
    });
}
MISUSE(CopyMisalignedForTheFormat, "copy.alignment") {
    return kit.list(
        [&](Compute& list) { list.copyTextureToBuffer(kit.buffer(Buffer::FlagNone, 4096), 2, kit.texture()); });
}
MISUSE(CopyBeyondTheBuffer, "copy.range") {
    return kit.list(
        [&](Compute& list) { list.copyTextureToBuffer(kit.buffer(Buffer::FlagNone, 255), 0, kit.texture()); });
}
MISUSE(CopyOfUnequalFormats, "copy.format") {
    return kit.list([&](Compute& list) { list.copyTexture(kit.texture(), {}, kit.texture(0, FormatRGBAf16), {}); });
}
MISUSE(CopyOfATextureOntoItself, "copy.overlap") {
    return kit.list([&](Compute& list) {
        const Texture texture = kit.texture();
        list.copyTexture(texture, {}, texture, {}, {.width = 2, .height = 2}, 4, 4);
    });
}
MISUSE(CopyOutsideTheDestination, "texture.region") {
    return kit.list([&](Compute& list) { list.copyTexture(kit.texture(), {}, kit.texture(), {}, {}, 1, 0); });
}
MISUSE(ClearOfBlocks, "clear.format") {
    return transferred(
        kit, [&](Device& device) { device.clearTexture(device.createTexture2D(FormatBC1RGBAu8n, 8, 8), Color()); });
}
MISUSE(ClearOfUnknownDepth, "clear.depth") {
    return transferred(kit, [&](Device& device) {
        device.clearTexture(kit.texture(Texture::FlagTarget, FormatDf32), Color{std::nanf(""), 0, 0, 0});
    });
}
MISUSE(MipmapsOfIntegers, "mipmaps.format") {
    return transferred(kit,
                       [&](Device& device) { device.createMipmaps(kit.texture(Texture::FlagMipmaps, FormatRu32)); });
}

// Draws.

MISUSE(DrawWithoutPipeline, "draw.pipeline") {
    return kit.command([](Command& list) { list.drawArrays(3); });
}
MISUSE(DrawToAnotherFormat, "draw.format") {
    return kit.command([&](Command& list) {
        list.setPipeline(kit.pipeline([](Pipeline& pipeline) { pipeline.setColorFormat(FormatRGBAf16); }));
    });
}
MISUSE(DrawWithDepthWhereThereIsNone, "draw.format") {
    return kit.command([&](Command& list) {
        list.setPipeline(kit.pipeline([](Pipeline& pipeline) { pipeline.setDepthFormat(FormatDf32); }));
    });
}
MISUSE(DrawOfSamplesWhereThereAreNone, "draw.samples") {
    return kit.command(
        [&](Command& list) { list.setPipeline(kit.pipeline([](Pipeline& pipeline) { pipeline.setMultisample(4); })); });
}
MISUSE(DrawWithoutVertices, "draw.vertices") {
    return kit.command([&](Command& list) {
        list.setPipeline(kit.pipeline());
        list.drawArrays(3);
    });
}
MISUSE(DrawOfManyVertices, "draw.vertex_range") {
    return drawn(kit, [](Command& list) { list.drawArrays(4); });
}
MISUSE(DrawFromALateVertex, "draw.vertex_range") {
    return drawn(kit, [](Command& list) { list.drawArrays(3, UINT32_MAX); });
}
MISUSE(DrawFromAVertexSlotThatIsNone, "draw.vertex_slot") {
    return kit.command([&](Command& list) { list.setVertexBuffer(16, kit.buffer(Buffer::FlagVertex)); });
}
MISUSE(DrawOfDataInAVertexSlotThatIsNone, "draw.vertex_slot") {
    return kit.command([](Command& list) { list.setVertexData(99, "abcd", 4); });
}
MISUSE(DrawFromABufferWithoutFlag, "buffer.flag") {
    return kit.command([&](Command& list) { list.setVertexBuffer(0, kit.buffer(Buffer::FlagStorage)); });
}
MISUSE(DrawOfVerticesFromNowhere, "copy.null") {
    return kit.command([](Command& list) { list.setVertexData(0, nullptr, 4); });
}
MISUSE(DrawWithoutIndices, "draw.indices") {
    return drawn(kit, [](Command& list) { list.drawElements(3); });
}
MISUSE(DrawOfManyIndices, "draw.index_range") {
    return drawn(kit, [](Command& list) {
        const uint16_t indices[] = {0, 1, 2};
        list.setIndices(indices);
        list.drawElements(4);
    });
}
MISUSE(DrawOfIndicesOfBytes, "draw.index_format") {
    return drawn(kit, [&](Command& list) { list.setIndexBuffer(FormatRu8, kit.buffer(Buffer::FlagIndex)); });
}
MISUSE(DrawOfMisalignedIndices, "draw.index_format") {
    return drawn(kit, [&](Command& list) { list.setIndexBuffer(FormatRu32, kit.buffer(Buffer::FlagIndex), 2); });
}
MISUSE(DrawOfIndicesWithoutFlag, "buffer.flag") {
    return drawn(kit, [&](Command& list) { list.setIndexBuffer(FormatRu32, kit.buffer(Buffer::FlagVertex)); });
}
MISUSE(DrawIndirectMisaligned, "draw.indirect") {
    return drawn(kit, [&](Command& list) { list.drawArraysIndirect(kit.buffer(Buffer::FlagIndirect), 1); });
}
MISUSE(DrawIndirectBeyondTheEnd, "draw.indirect") {
    return drawn(kit, [&](Command& list) { list.drawArraysIndirect(kit.buffer(Buffer::FlagIndirect, 16), 4); });
}
MISUSE(DrawIndirectOfOverlappingArguments, "draw.indirect") {
    return drawn(kit, [&](Command& list) { list.drawArraysIndirect(kit.buffer(Buffer::FlagIndirect), 0, 2, 8); });
}
MISUSE(DrawIndirectWithoutFlag, "buffer.flag") {
    return drawn(kit, [&](Command& list) { list.drawArraysIndirect(kit.buffer()); });
}
MISUSE(DrawSeveralWithoutFeature, "draw.multi") {
    Command list = kit.bare.createCommand(
        kit.bare.createTarget(kit.bare.createTexture2D(FormatRGBAu8n, 8, 8, Texture::FlagTarget)));
    list.drawArraysIndirect(kit.bare.createBuffer(Buffer::FlagIndirect, 64), 0, 2);
    return list.end().error();
}
MISUSE(DrawInAViewportOfNothing, "draw.viewport") {
    return drawn(kit, [](Command& list) { list.setViewport(0, 0, 0, 8); });
}
MISUSE(DrawInAViewportOfNaN, "draw.viewport") {
    return drawn(kit, [](Command& list) { list.setViewport(0, 0, std::numeric_limits<float>::quiet_NaN(), 8); });
}
MISUSE(DrawBeyondTheDepthRange, "draw.viewport") {
    return drawn(kit, [](Command& list) { list.setViewport(0, 0, 8, 8, 0, 2); });
}
MISUSE(DrawFromTheTargetItself, "draw.feedback") {
    const Texture color = kit.texture();
    Command list = kit.device.createCommand(kit.device.createTarget(color));
    Pipeline pipeline = kit.device.createPipeline("feedback");
    pipeline.createShaderGLSL(Shader::TypeVertex, cover_vertex);
    pipeline.createShaderGLSL(Shader::TypeFragment, R"(
        layout(binding = 0) uniform sampler2D picture;
        layout(location = 0) out vec4 color;
        void main() { color = texture(picture, vec2(0.5)); })");
    pipeline.setColorFormat(FormatRGBAu8n);
    EXPECT_THAT(pipeline.create(), IsOk());
    list.setPipeline(pipeline);
    list.setTexture(0, color);
    list.setSampler(0, kit.device.createSampler());
    list.drawArrays(3);
    return kit.device.submit(list).error();
}

// Queues.

MISUSE(KernelOnTheCopyQueue, "recorder.queue") {
    return kit.list([&](Compute& list) { list.setKernel(kit.kernel()); }, Queue::Copy);
}
MISUSE(ClearOnTheCopyQueue, "recorder.queue") {
    return kit.list([&](Compute& list) { list.clearTexture(kit.texture(), Color()); }, Queue::Copy);
}
MISUSE(MipmapsOnTheCopyQueue, "recorder.queue") {
    return kit.list([&](Compute& list) { list.createMipmaps(kit.texture(Texture::FlagMipmaps)); }, Queue::Copy);
}
MISUSE(DepthClearedOnTheComputeQueue, "recorder.queue") {
    return kit.list(
        [&](Compute& list) { list.clearTexture(kit.texture(Texture::FlagTarget, FormatDf32), Color::black()); },
        Queue::Compute);
}
MISUSE(DepthCopiedOnTheComputeQueue, "recorder.queue") {
    return kit.list(
        [&](Compute& list) { list.copyTextureToBuffer(kit.buffer(), 0, kit.texture(Texture::FlagTarget, FormatDf32)); },
        Queue::Compute);
}

// Queries, regions, submission.

MISUSE(QueryBegunTwice, "query.begun") {
    return kit.list([query = kit.device.createQuery(Query::TypeTime)](Compute& list) {
        list.beginQuery(query);
        list.beginQuery(query);
    });
}
MISUSE(QueryUsedTwice, "query.twice") {
    return kit.list([query = kit.device.createQuery(Query::TypeTime)](Compute& list) {
        list.beginQuery(query);
        list.endQuery(query);
        list.beginQuery(query);
        list.endQuery(query);
    });
}
MISUSE(QueryEndedUnbegun, "query.not_begun") {
    return kit.list([&](Compute& list) { list.endQuery(kit.device.createQuery(Query::TypeTime)); });
}
MISUSE(QueryLeftOpen, "query.open") {
    return kit.list([&](Compute& list) { list.beginQuery(kit.device.createQuery(Query::TypeTime)); });
}
MISUSE(QueryOfSamplesInCompute, "query.samples") {
    return kit.list([&](Compute& list) { list.beginQuery(kit.device.createQuery(Query::TypeSamples)); });
}
MISUSE(QueryOfSamplesNested, "query.nested") {
    return kit.command([&](Command& list) {
        list.beginQuery(kit.device.createQuery(Query::TypeSamples));
        list.beginQuery(kit.device.createQuery(Query::TypeSamples));
    });
}
MISUSE(QueryOfAnotherType, "query.type") {
    return errorOf(kit.device.getSamples(kit.device.createQuery(Query::TypeTime)));
}
MISUSE(QueryNeverSubmitted, "query.unused") {
    return errorOf(kit.device.getTime(kit.device.createQuery(Query::TypeTime)));
}
MISUSE(RegionPoppedUnpushed, "recorder.region") {
    return kit.list([](Compute& list) { list.popRegion(); });
}
MISUSE(RegionLeftOpen, "recorder.region") {
    return kit.list([](Compute& list) { list.pushRegion("open"); });
}
MISUSE(RecordingAfterTheEnd, "recorder.ended") {
    Compute list = kit.device.createCompute();
    EXPECT_THAT(list.end(), IsOk());
    list.clearBuffer(kit.buffer());
    return list.error();
}
MISUSE(SubmittingWhatWasMovedFrom, "recorder.null") {
    Compute list = kit.device.createCompute();
    const Compute moved = std::move(list);
    return kit.device.submit(list).error();
}
MISUSE(SubmittedTwice, "submit.twice") {
    Compute list = kit.device.createCompute();
    EXPECT_THAT(kit.device.submit(list), IsOk());
    return kit.device.submit(list).error();
}
MISUSE(SubmittedTwiceAtOnce, "submit.twice") {
    Compute list = kit.device.createCompute();
    list.clearBuffer(kit.buffer());
    return kit.device.submit({list, list}).error();
}
MISUSE(SubmittedManyAtOnce, "submit.count") {
    Compute l = kit.device.createCompute();
    return kit.device
        .submit({l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l,
                 l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l, l})
        .error();
}

}  // namespace glint::test
