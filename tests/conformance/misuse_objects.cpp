// Buffers, textures, samplers, queries, targets and devices.

#include "conformance/misuse.h"

#include <limits>

namespace glint::test {

namespace {

Error sampled(MisuseKit& kit, const SamplerDesc& desc) { return kit.device.createSampler(desc).error(); }
Error textured(MisuseKit& kit, const TextureDesc& desc) { return kit.device.createTexture(desc).error(); }

Error opened(MisuseKit& kit, DeviceDesc desc) {
    if (desc.api.empty()) desc.api = kit.device.getInfo().api;
    desc.message = kit.log.callback();
    return Device::create(desc).error();
}

/// A command into a target that `configure` has set up wrongly.
Error targeted(MisuseKit& kit, const std::function<void(Target&)>& configure) {
    Target target = kit.device.createTarget("target");
    configure(target);
    if (!target) return target.error();
    Command list = kit.device.createCommand(target);
    return kit.device.submit(list).error();
}

}  // namespace

MISUSE(DeviceOfNoApi, "device.api") { return opened(kit, {.api = "glide"}); }
MISUSE(DeviceByUnknownName, "device.no_adapter") { return opened(kit, {.adapter = "no such adapter"}); }
MISUSE(DeviceByUnknownIndex, "device.no_adapter") { return opened(kit, {.adapter = "97"}); }
MISUSE(DeviceWithImpossibleFeature, "device.unsupported") { return opened(kit, {.required = 1ull << 62}); }

MISUSE(BufferOfNothing, "buffer.size_zero") { return kit.device.createBuffer(Buffer::FlagStorage, 0).error(); }
MISUSE(BufferOfEmptyData, "buffer.size_zero") {
    return kit.device.createBuffer(Buffer::FlagStorage, std::span<const float>()).error();
}
MISUSE(BufferTooLarge, "buffer.too_large") {
    return kit.device.createBuffer(Buffer::FlagStorage, kit.device.getFeatures().maxBufferSize + 1).error();
}
MISUSE(BufferHuge, "buffer.too_large") { return kit.device.createBuffer(Buffer::FlagStorage, UINT64_MAX).error(); }
MISUSE(BufferOfUnknownFlags, "buffer.flags") { return kit.device.createBuffer(1u << 20, 16).error(); }
MISUSE(BufferAddressWithoutFeature, "buffer.feature") { return kit.bare.createBuffer(Buffer::FlagAddress, 16).error(); }
MISUSE(BufferTracingWithoutFeature, "buffer.feature") { return kit.bare.createBuffer(Buffer::FlagTracing, 16).error(); }

MISUSE(TextureOfNoWidth, "texture.size") { return textured(kit, {.format = FormatRGBAu8n, .width = 0, .height = 4}); }
MISUSE(TextureTooWide, "texture.size") {
    return textured(kit,
                    {.format = FormatRGBAu8n, .width = kit.device.getFeatures().maxTexture2DSize + 1, .height = 1});
}
MISUSE(TextureFlatWithDepth, "texture.size") {
    return textured(kit, {.format = FormatRGBAu8n, .width = 4, .height = 4, .depth = 2});
}
MISUSE(TextureCubeOfOblongs, "texture.size") {
    return textured(kit, {.type = Texture::TypeCube, .format = FormatRGBAu8n, .width = 4, .height = 8});
}
MISUSE(TextureOfNoLayers, "texture.layers") {
    return textured(kit, {.format = FormatRGBAu8n, .width = 4, .height = 4, .layers = 0});
}
MISUSE(TextureOfManyLayers, "texture.layers") {
    return textured(
        kit,
        {.format = FormatRGBAu8n, .width = 4, .height = 4, .layers = kit.device.getFeatures().maxTextureLayers + 1});
}
MISUSE(TextureOfLayeredVolume, "texture.layers") {
    return textured(
        kit, {.type = Texture::Type3D, .format = FormatRGBAu8n, .width = 4, .height = 4, .depth = 4, .layers = 2});
}
MISUSE(TextureOfNoMipmaps, "texture.mipmaps") {
    return textured(kit, {.format = FormatRGBAu8n, .width = 4, .height = 4, .mipmaps = 0});
}
MISUSE(TextureOfManyMipmaps, "texture.mipmaps") {
    return textured(kit, {.format = FormatRGBAu8n, .width = 4, .height = 4, .mipmaps = 4});
}
MISUSE(TextureOfTwoSampleCounts, "texture.samples") {
    return textured(kit, {.format = FormatRGBAu8n,
                          .width = 4,
                          .height = 4,
                          .flags = Texture::FlagTarget | Texture::FlagMultisample2 | Texture::FlagMultisample4});
}
MISUSE(TextureOfSampledVolume, "texture.samples") {
    return textured(kit, {.type = Texture::Type3D,
                          .format = FormatRGBAu8n,
                          .width = 4,
                          .height = 4,
                          .depth = 4,
                          .flags = Texture::FlagMultisample4});
}
MISUSE(TextureOfSampledMipmaps, "texture.samples") {
    return textured(
        kit,
        {.format = FormatRGBAu8n, .width = 4, .height = 4, .flags = Texture::FlagMultisample4 | Texture::FlagMipmaps});
}
MISUSE(TextureOfUnknownFormat, "texture.format") { return textured(kit, {.width = 4, .height = 4}); }
MISUSE(TextureOfImpossibleFormat, "texture.format") {
    return textured(kit, {.format = static_cast<Format>(250), .width = 4, .height = 4});
}
MISUSE(TextureOfDepthAsSurface, "texture.format") {
    return textured(kit, {.format = FormatDf32, .width = 4, .height = 4, .flags = Texture::FlagSurface});
}
MISUSE(TextureOfBlocksAsTarget, "texture.format") {
    return textured(kit, {.format = FormatBC1RGBAu8n, .width = 4, .height = 4, .flags = Texture::FlagTarget});
}
MISUSE(TextureOfCubesWithoutFeature, "texture.feature") {
    return kit.bare
        .createTexture({.type = Texture::TypeCube, .format = FormatRGBAu8n, .width = 4, .height = 4, .layers = 2})
        .error();
}

MISUSE(SamplerOfNoAnisotropy, "sampler.anisotropy") { return sampled(kit, {.anisotropy = 0}); }
MISUSE(SamplerOfMuchAnisotropy, "sampler.anisotropy") { return sampled(kit, {.anisotropy = 1000}); }
MISUSE(SamplerAnisotropyWithoutFeature, "sampler.anisotropy") {
    return kit.bare.createSampler({.anisotropy = 2}).error();
}
MISUSE(SamplerOfNegativeLod, "sampler.lod") { return sampled(kit, {.lod_minimum = -1}); }
MISUSE(SamplerOfReversedLod, "sampler.lod") { return sampled(kit, {.lod_minimum = 3, .lod_maximum = 2}); }
MISUSE(SamplerOfUnknownLod, "sampler.lod") {
    return sampled(kit, {.lod_minimum = std::numeric_limits<float>::quiet_NaN()});
}
MISUSE(SamplerOfMuchBias, "sampler.lod") { return sampled(kit, {.lod_bias = 100}); }
MISUSE(SamplerReductionWithoutFeature, "sampler.reduction") {
    return kit.bare.createSampler({.reduction = Sampler::ReductionMaximum}).error();
}
MISUSE(SamplerOfOddBorder, "sampler.border") { return sampled(kit, {.border = {0.5f, 0, 0, 1}}); }

MISUSE(QueryTimeWithoutFeature, "query.feature") { return kit.bare.createQuery(Query::TypeTime).error(); }
MISUSE(QueryStatisticsWithoutFeature, "query.feature") { return kit.bare.createQuery(Query::TypeStatistics).error(); }

MISUSE(TargetOfNothing, "target.empty") {
    return targeted(kit, [](Target&) {});
}
MISUSE(TargetOfFailedTexture, "target.texture") {
    const Texture failed = kit.device.createTexture2D(FormatRGBAu8n, 0, 0);
    kit.log.take();
    return targeted(kit, [&](Target& target) { target.setColorTexture(0, failed); });
}
MISUSE(TargetWithoutFlag, "target.flag") {
    return targeted(kit, [&](Target& target) { target.setColorTexture(0, kit.texture(Texture::FlagSurface)); });
}
MISUSE(TargetOfDepthAsColour, "target.format") {
    return targeted(kit,
                    [&](Target& target) { target.setColorTexture(0, kit.texture(Texture::FlagTarget, FormatDf32)); });
}
MISUSE(TargetOfColourAsDepth, "target.format") {
    return targeted(kit, [&](Target& target) { target.setDepthTexture(kit.texture()); });
}
MISUSE(TargetBeyondMipmaps, "target.slice") {
    return targeted(kit, [&](Target& target) { target.setColorTexture(0, kit.texture(), {.mip = 1}); });
}
MISUSE(TargetOfSeveralMipmaps, "target.slice") {
    return targeted(kit, [&](Target& target) {
        target.setColorTexture(0, kit.texture(Texture::FlagTarget | Texture::FlagMipmaps), {.mip = 0, .mips = 2});
    });
}
MISUSE(TargetBeyondIndices, "target.index") {
    return targeted(kit, [&](Target& target) { target.setColorTexture(100, kit.texture()); });
}
MISUSE(TargetOfTwoSizes, "target.size") {
    return targeted(kit, [&](Target& target) {
        target.setColorTexture(0, kit.texture());
        target.setColorTexture(1, kit.device.createTexture2D(FormatRGBAu8n, 4, 4, Texture::FlagTarget));
    });
}
MISUSE(TargetOfTwoSampleCounts, "target.samples") {
    return targeted(kit, [&](Target& target) {
        target.setColorTexture(0, kit.texture());
        target.setDepthTexture(kit.texture(Texture::FlagTarget | Texture::FlagMultisample4, FormatDf32));
    });
}
MISUSE(TargetTwiceTheSameTexture, "target.twice") {
    return targeted(kit, [texture = kit.texture()](Target& target) {
        target.setColorTexture(0, texture);
        target.setColorTexture(1, texture);
    });
}
MISUSE(TargetResolvedWithoutSamples, "target.resolve") {
    return targeted(kit, [&](Target& target) {
        target.setColorTexture(0, kit.texture());
        target.setColorResolve(0, kit.texture());
    });
}
MISUSE(TargetResolvedIntoAnotherFormat, "target.resolve") {
    return targeted(kit, [&](Target& target) {
        target.setColorTexture(0, kit.texture(Texture::FlagTarget | Texture::FlagMultisample4));
        target.setColorResolve(0, kit.texture(Texture::FlagTarget, FormatRGBAf16));
    });
}
MISUSE(TargetOfForeignTexture, "handle.device") {
    return targeted(kit, [&](Target& target) {
        target.setColorTexture(0, kit.foreign.createTexture2D(FormatRGBAu8n, 8, 8, Texture::FlagTarget));
    });
}
MISUSE(TargetClearedTooDeep, "clear.depth") {
    return targeted(kit, [&](Target& target) { target.setClearDepth(1.5f); });
}
MISUSE(CommandWithoutTarget, "handle.null") {
    Command list = kit.device.createCommand(Target());
    return kit.device.submit(list).error();
}

}  // namespace glint::test
