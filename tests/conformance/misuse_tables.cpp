// Wrong uses of tables of textures and of buffers.

#include "conformance/misuse.h"

namespace glint::test {

namespace {

constexpr const char* textures_kernel = R"(
layout(local_size_x = 1) in;
layout(set = 1, binding = 0) uniform texture2D textures[];
layout(set = 0, binding = 0) buffer Result { vec4 result; };
void main() { result = texelFetch(textures[0], ivec2(0), 0); })";
constexpr const char* buffers_kernel = R"(
layout(local_size_x = 1) in;
layout(set = 1, binding = 0) readonly buffer Part { vec4 value; vec4 more; } parts[];
layout(set = 0, binding = 0) buffer Result { vec4 result; };
void main() { result = parts[0].value + parts[0].more; })";

Error textureEntry(MisuseKit& kit, uint32_t index, const Texture& texture, const Slice& slice = {}) {
    TextureTable table = kit.device.createTextureTable(4, "table");
    table.set(index, texture, slice);
    return table.error();
}
Error bufferEntry(MisuseKit& kit, uint32_t index, const Buffer& buffer, uint64_t offset = 0, uint64_t size = 0) {
    BufferTable table = kit.device.createBufferTable(4, "table");
    table.set(index, buffer, offset, size);
    return table.error();
}
/// A dispatch of a kernel with a table in slot 0.
Error tabled(MisuseKit& kit, const char* text, const std::function<void(Compute&)>& bind) {
    const Kernel kernel = kit.kernel(text);
    return kit.list([&](Compute& list) {
        list.setKernel(kernel);
        list.setStorageBuffer(0, kit.buffer());
        bind(list);
        list.dispatch(1);
    });
}
Error texturesBound(MisuseKit& kit, const Texture& texture, const Slice& slice = {}) {
    TextureTable table = kit.device.createTextureTable(4, "table");
    table.set(2, texture, slice);
    EXPECT_TRUE(table);
    return tabled(kit, textures_kernel, [&](Compute& list) { list.setTextureTable(0, table); });
}

}  // namespace

MISUSE(TextureTableWithoutFeature, "table.feature") { return kit.bare.createTextureTable(4).error(); }
MISUSE(BufferTableWithoutFeature, "table.feature") { return kit.bare.createBufferTable(4).error(); }
MISUSE(TextureTableOfNothing, "table.count") { return kit.device.createTextureTable(0).error(); }
MISUSE(BufferTableOfNothing, "table.count") { return kit.device.createBufferTable(0).error(); }
MISUSE(TextureTableOfMany, "table.count") {
    return kit.device.createTextureTable(kit.device.getFeatures().maxTableTextures + 1).error();
}
MISUSE(BufferTableOfMany, "table.count") { return kit.device.createBufferTable(~0u).error(); }

MISUSE(TextureEntryBeyondTheEnd, "table.index") { return textureEntry(kit, 4, kit.texture()); }
MISUSE(NoEntryBeyondTheEnd, "table.index") { return textureEntry(kit, ~0u, Texture()); }
MISUSE(BufferEntryBeyondTheEnd, "table.index") { return bufferEntry(kit, 4, kit.buffer()); }
MISUSE(TextureEntryThatFailed, "table.entry") {
    const Texture failed = kit.device.createTexture2D(FormatRGBAu8n, 0, 8);
    kit.log.take();
    return textureEntry(kit, 0, failed);
}
MISUSE(BufferEntryThatFailed, "table.entry") { return bufferEntry(kit, 0, kit.failedBuffer()); }
MISUSE(TextureEntryOfAnotherDevice, "handle.device") {
    return textureEntry(kit, 0, kit.foreign.createTexture2D(FormatRGBAu8n, 8, 8));
}
MISUSE(BufferEntryOfAnotherDevice, "handle.device") {
    return bufferEntry(kit, 0, kit.foreign.createBuffer(Buffer::FlagStorage, 64));
}
MISUSE(TextureEntryOfNoLevel, "texture.slice") { return textureEntry(kit, 0, kit.texture(), {.mip = 1}); }
MISUSE(TextureEntryOfManyLayers, "texture.slice") { return textureEntry(kit, 0, kit.texture(), {.layers = 2}); }
MISUSE(BufferEntryWithoutFlag, "buffer.flag") { return bufferEntry(kit, 0, kit.buffer(Buffer::FlagUniform)); }
MISUSE(BufferEntryMisaligned, "bind.alignment") { return bufferEntry(kit, 0, kit.buffer(), 1); }
MISUSE(BufferEntryBeyondItsBuffer, "bind.range") { return bufferEntry(kit, 0, kit.buffer(), 0, 257); }
MISUSE(BufferEntryFarBeyondItsBuffer, "bind.range") { return bufferEntry(kit, 0, kit.buffer(), ~0ull << 8); }
MISUSE(BufferEntryTooLarge, "bind.too_large") {
    const uint64_t limit = kit.device.getFeatures().maxStorageSize;
    return bufferEntry(kit, 0, kit.buffer(Buffer::FlagStorage, limit + 256));
}

MISUSE(TableUnset, "bind.unset") {
    return tabled(kit, textures_kernel, [](Compute&) {});
}
MISUSE(TableThatIsNull, "handle.null") {
    return tabled(kit, textures_kernel, [](Compute& list) { list.setTextureTable(0, TextureTable()); });
}
MISUSE(TableOfAnotherDevice, "handle.device") {
    const TextureTable table = kit.foreign.createTextureTable(2);
    return tabled(kit, textures_kernel, [&](Compute& list) { list.setTextureTable(0, table); });
}
MISUSE(TableThatFailed, "handle.not_ready") {
    TextureTable table = kit.device.createTextureTable(4, "table");
    table.set(9, Texture());
    kit.log.take();
    return tabled(kit, textures_kernel, [&](Compute& list) { list.setTextureTable(0, table); });
}
MISUSE(TableOfBuffersForTextures, "bind.table") {
    const BufferTable table = kit.device.createBufferTable(2);
    return tabled(kit, textures_kernel, [&](Compute& list) { list.setBufferTable(0, table); });
}
MISUSE(TableOfTexturesForBuffers, "bind.table") {
    const TextureTable table = kit.device.createTextureTable(2);
    return tabled(kit, buffers_kernel, [&](Compute& list) { list.setTextureTable(0, table); });
}
MISUSE(TableOfUnknownName, "bind.name") {
    const TextureTable table = kit.device.createTextureTable(2);
    return tabled(kit, textures_kernel, [&](Compute& list) { list.setTextureTable("pictures", table); });
}
MISUSE(TableEntryOfACube, "bind.texture_type") {
    return texturesBound(kit, kit.device.createTextureCube(FormatRGBAu8n, 8));
}
MISUSE(TableEntryOfLayers, "bind.texture_type") {
    return texturesBound(kit,
                         kit.device.createTexture({.format = FormatRGBAu8n, .width = 8, .height = 8, .layers = 2}));
}
MISUSE(TableEntryOfSamples, "bind.texture_type") {
    return texturesBound(kit, kit.texture(Texture::FlagTarget | Texture::FlagMultisample4));
}
MISUSE(TableEntryOfFewBytes, "bind.storage_size") {
    BufferTable table = kit.device.createBufferTable(2);
    table.set(1, kit.buffer(), 0, 16);
    return tabled(kit, buffers_kernel, [&](Compute& list) { list.setBufferTable(0, table); });
}
MISUSE(TableEntryAndSurface, "bind.layout_conflict") {
    const Texture texture = kit.texture(Texture::FlagSurface);
    TextureTable table = kit.device.createTextureTable(2);
    table.set(1, texture);
    const Kernel kernel = kit.kernel(R"(
        layout(local_size_x = 1) in;
        layout(set = 1, binding = 0) uniform texture2D textures[];
        layout(set = 0, binding = 0, rgba8) uniform image2D surface;
        void main() { imageStore(surface, ivec2(0), texelFetch(textures[0], ivec2(0), 0)); })");
    return kit.list([&](Compute& list) {
        list.setKernel(kernel);
        list.setSurfaceTexture(0, texture);
        list.setTextureTable(0, table);
        list.dispatch(1);
    });
}
MISUSE(TableEntryIsTheTarget, "draw.feedback") {
    const Texture color = kit.texture();
    TextureTable table = kit.device.createTextureTable(2);
    table.set(1, color);
    Pipeline pipeline = kit.device.createPipeline("feedback");
    pipeline.createShaderGLSL(Shader::TypeVertex, cover_vertex);
    pipeline.createShaderGLSL(Shader::TypeFragment, R"(
        layout(set = 0, binding = 0) uniform texture2D textures[];
        layout(location = 0) out vec4 color;
        void main() { color = texelFetch(textures[0], ivec2(0), 0); })");
    pipeline.setColorFormat(FormatRGBAu8n);
    EXPECT_THAT(pipeline.create(), IsOk());
    Command list = kit.device.createCommand(kit.device.createTarget(color));
    list.setPipeline(pipeline);
    list.setTextureTable(0, table);
    list.drawArrays(3);
    return kit.device.submit(list).error();
}

}  // namespace glint::test
