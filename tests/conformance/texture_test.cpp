#include "conformance/conformance.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>

namespace glint::test {

namespace {

class TextureTest : public ApiTest {
protected:
    /// Bytes that are no special values in any format: exponents stay small, so that no copy meets a NaN.
    static std::vector<uint8_t> pattern(uint64_t size, uint32_t seed = 0) {
        std::vector<uint8_t> bytes(size);
        for (uint64_t i = 0; i < size; i++) bytes[i] = static_cast<uint8_t>((i * 31 + seed * 17 + i / 61) & 0x3b);
        return bytes;
    }

    void roundTrip(const Texture& texture) {
        ASSERT_TRUE(texture) << texture.error().text();
        const auto mips = static_cast<uint16_t>(texture.getMipmaps());
        const auto layers = static_cast<uint16_t>(texture.getLayers());
        for (uint16_t mip = 0; mip < mips; mip++)
            for (uint16_t layer = 0; layer < layers; layer++) {
                const std::vector<uint8_t> data = pattern(texture.getDataSize(mip), mip * 8u + layer);
                device.setTexture(texture, data.data(), data.size(), {mip, 1, layer, 1});
            }
        for (uint16_t mip = 0; mip < mips; mip++)
            for (uint16_t layer = 0; layer < layers; layer++)
                EXPECT_EQ(readTexture<uint8_t>(texture, {mip, 1, layer, 1}),
                          pattern(texture.getDataSize(mip), mip * 8u + layer))
                    << toString(texture.getFormat()) << ", mip " << mip << ", layer " << layer;
    }
};

class TextureShaderTest : public ConformanceTest {};

/// Formats whose bytes come back as they went in: all but those with depth, whose copies may round or drop bits.
std::vector<Format> exactFormats() {
    std::vector<Format> formats;
    for (int i = FormatUnknown + 1; i < FormatCount; i++)
        if (!formatInfo(static_cast<Format>(i)).depth) formats.push_back(static_cast<Format>(i));
    return formats;
}

}  // namespace

TEST_P(TextureTest, KnowsItsProperties) {
    const Texture texture =
        device.createTexture2D(FormatRGBAf16, 33, 20, Texture::FlagMipmaps | Texture::FlagSurface, "picture");
    ASSERT_TRUE(texture);
    EXPECT_EQ(texture.getType(), Texture::Type2D);
    EXPECT_EQ(texture.getFormat(), FormatRGBAf16);
    EXPECT_EQ(texture.getFlags(), Texture::FlagMipmaps | Texture::FlagSurface);
    EXPECT_EQ(texture.getWidth(), 33u);
    EXPECT_EQ(texture.getHeight(), 20u);
    EXPECT_EQ(texture.getDepth(), 1u);
    EXPECT_EQ(texture.getLayers(), 1u);
    EXPECT_EQ(texture.getMipmaps(), 6u);
    EXPECT_EQ(texture.getSamples(), 1u);
    EXPECT_EQ(texture.getDataSize(), 33u * 20 * 8);
    EXPECT_EQ(texture.getDataSize(1), 16u * 10 * 8);
    EXPECT_EQ(texture.getDataSize(5), 8u);
    EXPECT_EQ(texture.name(), "picture");
}

TEST_P(TextureTest, NullTextureIsHarmless) {
    const Texture texture;
    EXPECT_FALSE(texture);
    EXPECT_EQ(texture.getWidth() + texture.getHeight() + texture.getDepth() + texture.getLayers(), 0u);
    EXPECT_EQ(texture.getFormat(), FormatUnknown);
    EXPECT_EQ(texture.getDataSize(), 0u);
    EXPECT_EQ(texture.getDataSize(100), 0u);
}

TEST_P(TextureTest, RoundTripOfEveryFormat) {
    int tested = 0;
    for (const Format format : exactFormats()) {
        if (!device.hasTexture(format)) continue;
        SCOPED_TRACE(toString(format));
        const uint32_t block = formatInfo(format).block_width;
        roundTrip(device.createTexture2D(format, 8 * block, 4 * block));
        if (block == 1) roundTrip(device.createTexture2D(format, 7, 5));
        tested++;
    }
    EXPECT_GE(tested, 30);
}

TEST_P(TextureTest, RoundTripOfEveryType) {
    roundTrip(device.createTexture({.format = FormatRGBAu8n, .width = 13, .height = 7, .layers = 5, .mipmaps = 3}));
    roundTrip(device.createTexture3D(FormatRGBAu8n, 9, 6, 5, Texture::FlagMipmaps));
    roundTrip(device.createTextureCube(FormatRGBAf16, 16, Texture::FlagMipmaps));
    roundTrip(device.createTexture2D(FormatRf32, 1, 1));
    roundTrip(device.createTexture2D(FormatRf32, 257, 1, Texture::FlagMipmaps));
    // Levels of compressed formats are filled by hand; the last ones are smaller than a block.
    if (device.hasTexture(FormatBC1RGBAu8n, Texture::FlagMipmaps))
        roundTrip(device.createTexture2D(FormatBC1RGBAu8n, 16, 12, Texture::FlagMipmaps));
    if (device.getInfo().features & FeatureCubeArray)
        roundTrip(device.createTexture(
            {.type = Texture::TypeCube, .format = FormatRGBAu8n, .width = 8, .height = 8, .layers = 2}));
}

TEST_P(TextureTest, DepthRoundTrip) {
    for (const Format format : {FormatDu16n, FormatDf32}) {
        if (!device.hasTexture(format, Texture::FlagTarget)) continue;
        const Texture texture = makeTexture(format, 8, 8);
        device.clearTexture(texture, Color{0.5f, 0, 0, 0});
        if (format == FormatDf32)
            EXPECT_EQ(readTexture<float>(texture), std::vector<float>(64, 0.5f));
        else
            for (const uint16_t value : readTexture<uint16_t>(texture)) EXPECT_NEAR(value, 32768, 1);
        const std::vector<uint8_t> data(texture.getDataSize());
        device.setTexture(texture, data.data(), data.size());
        EXPECT_EQ(readTexture<uint8_t>(texture), data);
    }
}

TEST_P(TextureTest, RegionsAndSlices) {
    const Texture texture =
        device.createTexture({.format = FormatRu32, .width = 8, .height = 8, .layers = 3, .mipmaps = 2});
    device.clearTexture(texture, Color{1, 0, 0, 0});
    const std::vector<uint32_t> data = {10, 11, 12, 13, 14, 15};
    device.setTexture(texture, data.data(), 24, {.mip = 1, .layer = 2}, {.x = 1, .y = 2, .width = 3, .height = 2});
    const std::vector<uint32_t> level = readTexture<uint32_t>(texture, {.mip = 1, .mips = 1, .layer = 2, .layers = 1});
    EXPECT_EQ(level, (std::vector<uint32_t>{1, 1, 1, 1, 1, 1, 1, 1, 1, 10, 11, 12, 1, 13, 14, 15}));
    EXPECT_EQ(readTexture<uint32_t>(texture, {.mip = 1, .mips = 1, .layer = 1, .layers = 1}),
              std::vector<uint32_t>(16, 1));
    // Two layers at once.
    const std::vector<uint32_t> layers(128, 77);
    device.setTexture(texture, layers.data(), 512, {.layer = 1, .layers = 2});
    EXPECT_EQ(readTexture<uint32_t>(texture, {.layer = 2, .layers = 1}), std::vector<uint32_t>(64, 77));
    EXPECT_EQ(readTexture<uint32_t>(texture, {.layer = 0, .layers = 1}), std::vector<uint32_t>(64, 1));
}

TEST_P(TextureTest, RegionOfACompressedTexture) {
    GLINT_NEED_FEATURE(FeatureTextureBC);
    const Texture texture = device.createTexture2D(FormatBC1RGBAu8n, 16, 16);
    const std::vector<uint8_t> all = pattern(128);
    device.setTexture(texture, all.data(), 128);
    const std::vector<uint8_t> block = pattern(8, 5);
    device.setTexture(texture, block.data(), 8, {}, {.x = 4, .y = 8, .width = 4, .height = 4});
    std::vector<uint8_t> expected = all;
    std::copy(block.begin(), block.end(), expected.begin() + (2 * 4 + 1) * 8);
    EXPECT_EQ(readTexture<uint8_t>(texture), expected);
}

TEST_P(TextureTest, CopiesBetweenTextures) {
    const Texture a = device.createTexture({.format = FormatRu32, .width = 8, .height = 8, .mipmaps = 2});
    const Texture b = device.createTexture({.format = FormatRGBAu8n, .width = 8, .height = 8, .layers = 2});
    std::vector<uint32_t> data(64);
    for (uint32_t i = 0; i < 64; i++) data[i] = i;
    device.setTexture(a, data.data(), 256);
    device.clearTexture(b, Color{0, 0, 0, 0});
    device.copyTexture(b, {.layer = 1, .layers = 1}, a, {}, {.x = 2, .y = 3, .width = 4, .height = 2}, 1, 5);
    std::vector<uint32_t> expected(64);
    for (uint32_t y = 0; y < 2; y++)
        for (uint32_t x = 0; x < 4; x++) expected[(y + 5) * 8 + x + 1] = (y + 3) * 8 + x + 2;
    EXPECT_EQ(readTexture<uint32_t>(b, {.layer = 1, .layers = 1}), expected);
    EXPECT_EQ(readTexture<uint32_t>(b, {.layer = 0, .layers = 1}), std::vector<uint32_t>(64));
}

TEST_P(TextureTest, CopiesToAndFromBuffers) {
    const Texture texture = device.createTexture2D(FormatRu32, 8, 4);
    device.clearTexture(texture, Color{9, 0, 0, 0});
    const Buffer buffer = makeBuffer(std::vector<uint32_t>{0, 1, 2, 3, 4, 5, 6, 7});
    compute([&](Compute& list) {
        list.copyBufferToTexture(texture, buffer, 8, {}, {.x = 1, .y = 1, .width = 2, .height = 2});
        list.copyTextureToBuffer(buffer, 16, texture, {}, {.x = 0, .y = 1, .width = 4, .height = 1});
    });
    EXPECT_EQ(read<uint32_t>(buffer), (std::vector<uint32_t>{0, 1, 2, 3, 9, 2, 3, 9}));
}

TEST_P(TextureTest, ClearsEveryClassOfFormat) {
    const auto cleared = [&](Format format, const Color& color) {
        const Texture texture = device.createTexture2D(format, 2, 2);
        device.clearTexture(texture, color);
        return readTexture<uint8_t>(texture);
    };
    EXPECT_EQ(cleared(FormatRGBAu8n, {1, 0, 0.5f, 1})[0], 255);
    EXPECT_EQ(cleared(FormatRu8, {200, 0, 0, 0}), std::vector<uint8_t>(4, 200));
    const std::vector<uint8_t> negative = cleared(FormatRi32, {-3, 0, 0, 0});
    int32_t first;
    std::memcpy(&first, negative.data(), 4);
    EXPECT_EQ(first, -3);
    const std::vector<uint8_t> real = cleared(FormatRf32, {-1.5f, 0, 0, 0});
    float value;
    std::memcpy(&value, real.data(), 4);
    EXPECT_EQ(value, -1.5f);
}

TEST_P(TextureTest, ClearsOfIntegersAreKeptInRange) {
    constexpr float infinite = std::numeric_limits<float>::infinity();
    const std::tuple<float, uint32_t, int32_t> cases[] = {
        {-1, 0, -1},
        {1e20f, UINT32_MAX, INT32_MAX},
        {-1e20f, 0, INT32_MIN},
        {infinite, UINT32_MAX, INT32_MAX},
        {-infinite, 0, INT32_MIN},
        {std::numeric_limits<float>::quiet_NaN(), 0, 0},
        {2147483648.0f, 2147483648u, INT32_MAX},
        {2.9f, 2, 2},
    };
    for (const auto& [value, expected_uint, expected_int] : cases) {
        SCOPED_TRACE(value);
        const Texture whole = makeTexture(FormatRu32, 2, 2);
        const Texture negative = makeTexture(FormatRi32, 2, 2);
        device.clearTexture(whole, Color{value, 0, 0, 0});
        device.clearTexture(negative, Color{value, 0, 0, 0});
        EXPECT_EQ(readTexture<uint32_t>(whole), std::vector<uint32_t>(4, expected_uint));
        EXPECT_EQ(readTexture<int32_t>(negative), std::vector<int32_t>(4, expected_int));
        // The same through a target.
        device.clearTexture(whole, Color{});
        device.clearTexture(negative, Color{});
        Target target = device.createTarget();
        target.setColorTexture(0, whole);
        target.setColorTexture(1, negative);
        target.setClearColor(0, Color{value, 0, 0, 0});
        target.setClearColor(1, Color{value, 0, 0, 0});
        Command list = device.createCommand(target);
        submit(list);
        EXPECT_EQ(readTexture<uint32_t>(whole), std::vector<uint32_t>(4, expected_uint));
        EXPECT_EQ(readTexture<int32_t>(negative), std::vector<int32_t>(4, expected_int));
    }
}

TEST_F(TextureShaderTest, MipmapsAverage) {
    const Texture texture = device.createTexture2D(FormatRf32, 8, 8, Texture::FlagMipmaps);
    std::vector<float> data(64);
    for (size_t i = 0; i < 64; i++) data[i] = static_cast<float>(i);
    device.setTexture(texture, data.data(), 256);
    device.createMipmaps(texture);
    const std::vector<float> level = readTexture<float>(texture, {.mip = 1, .mips = 1});
    for (size_t y = 0; y < 4; y++)
        for (size_t x = 0; x < 4; x++)
            EXPECT_NEAR(level[y * 4 + x], static_cast<float>(2 * y * 8 + 2 * x) + 4.5f, 1e-4);
    EXPECT_NEAR(readTexture<float>(texture, {.mip = 3, .mips = 1})[0], 31.5f, 1e-4);
}

TEST_F(TextureShaderTest, SurfacesOfEveryFormatThatCanBeOne) {
    struct Case {
        Format format;
        const char* qualifier;
        const char* type;
        const char* value;
    };
    const Case cases[] = {
        {FormatRGBAu8n, "rgba8", "image2D", "vec4"},       {FormatRGBAi8n, "rgba8_snorm", "image2D", "vec4"},
        {FormatRGBAf16, "rgba16f", "image2D", "vec4"},     {FormatRGBAf32, "rgba32f", "image2D", "vec4"},
        {FormatRf32, "r32f", "image2D", "vec4"},           {FormatRGf32, "rg32f", "image2D", "vec4"},
        {FormatRu32, "r32ui", "uimage2D", "uvec4"},        {FormatRi32, "r32i", "iimage2D", "ivec4"},
        {FormatRGBAu8, "rgba8ui", "uimage2D", "uvec4"},    {FormatRGBAi8, "rgba8i", "iimage2D", "ivec4"},
        {FormatRGBAu16, "rgba16ui", "uimage2D", "uvec4"},  {FormatRGBAu32, "rgba32ui", "uimage2D", "uvec4"},
        {FormatRGu8n, "rg8", "image2D", "vec4"},           {FormatRu8n, "r8", "image2D", "vec4"},
        {FormatRf16, "r16f", "image2D", "vec4"},           {FormatRGBf11f11f10, "r11f_g11f_b10f", "image2D", "vec4"},
        {FormatRGBu10Au2n, "rgb10_a2", "image2D", "vec4"},
    };
    for (const Case& c : cases) {
        if (!device.hasTexture(c.format, Texture::FlagSurface)) continue;
        SCOPED_TRACE(toString(c.format));
        const Texture source = makeTexture(c.format, 4, 4, Texture::FlagSurface);
        const Texture result = makeTexture(c.format, 4, 4, Texture::FlagSurface);
        device.clearTexture(source, Color{1, 1, 1, 1});
        device.clearTexture(result, Color{0, 0, 0, 0});
        const std::string text = std::string("layout(local_size_x = 4, local_size_y = 4) in;\n") +
                                 "layout(binding = 0, " + c.qualifier + ") readonly uniform " + c.type + " source;\n" +
                                 "layout(binding = 1, " + c.qualifier + ") writeonly uniform " + c.type + " result;\n" +
                                 "void main() { ivec2 i = ivec2(gl_GlobalInvocationID.xy);\n" +
                                 "imageStore(result, i, " + c.value + "(imageLoad(source, i))); }";
        compute([&](Compute& list) {
            list.setKernel(makeKernel(text));
            list.setSurfaceTextures(0, {source, result});
            list.dispatch(result);
        });
        EXPECT_EQ(readTexture<uint8_t>(result), readTexture<uint8_t>(source));
    }
}

TEST_F(TextureShaderTest, SurfaceOfAMipLevelAndALayer) {
    const Texture texture = device.createTexture(
        {.format = FormatRu32, .width = 8, .height = 8, .layers = 2, .mipmaps = 3, .flags = Texture::FlagSurface});
    device.clearTexture(texture, Color{0, 0, 0, 0});
    compute([&](Compute& list) {
        list.setKernel(makeKernel(R"(
            layout(local_size_x = 2, local_size_y = 2) in;
            layout(binding = 0, r32ui) uniform uimage2D surface;
            void main() { imageStore(surface, ivec2(gl_GlobalInvocationID.xy), uvec4(imageSize(surface).x)); })"));
        list.setSurfaceTexture(0, texture, {.mip = 2, .mips = 1, .layer = 1, .layers = 1});
        list.dispatch(2, 2);
    });
    EXPECT_EQ(readTexture<uint32_t>(texture, {2, 1, 1, 1}), std::vector<uint32_t>(4, 2));
    EXPECT_EQ(readTexture<uint32_t>(texture, {2, 1, 0, 1}), std::vector<uint32_t>(4, 0));
}

TEST_F(TextureShaderTest, SampledTypes) {
    const Texture array = device.createTexture({.format = FormatRu32, .width = 2, .height = 2, .layers = 3});
    const Texture volume = device.createTexture3D(FormatRu32, 2, 2, 2);
    const Texture cube = device.createTextureCube(FormatRf32, 2);
    for (uint16_t layer = 0; layer < 3; layer++)
        device.clearTexture(array, Color{10.0f + layer, 0, 0, 0}, {0, 1, layer, 1});
    for (uint16_t face = 0; face < 6; face++) device.clearTexture(cube, Color{20.0f + face, 0, 0, 0}, {0, 1, face, 1});
    std::vector<uint32_t> texels = {0, 1, 2, 3, 4, 5, 6, 7};
    device.setTexture(volume, texels.data(), 32);
    const Buffer result = makeBuffer(std::vector<uint32_t>(16));
    compute([&](Compute& list) {
        list.setKernel(makeKernel(R"(
            layout(local_size_x = 1) in;
            layout(binding = 0) uniform utexture2DArray layers;
            layout(binding = 1) uniform utexture3D volume;
            layout(binding = 2) uniform textureCube faces;
            layout(binding = 3) uniform utexture2D layer;
            layout(binding = 4) uniform sampler nearest;
            layout(binding = 5) buffer Result { uint result[]; };
            void main() {
                for (int i = 0; i < 3; i++) result[i] = texelFetch(usampler2DArray(layers, nearest), ivec3(1, 1, i), 0).x;
                result[3] = texelFetch(usampler3D(volume, nearest), ivec3(1, 0, 1), 0).x;
                vec3 directions[6] = {vec3(1, 0, 0), vec3(-1, 0, 0), vec3(0, 1, 0), vec3(0, -1, 0), vec3(0, 0, 1), vec3(0, 0, -1)};
                for (int i = 0; i < 6; i++)
                    result[4 + i] = uint(textureLod(samplerCube(faces, nearest), directions[i], 0.0).x);
                result[10] = texelFetch(usampler2D(layer, nearest), ivec2(0), 0).x;
            })"));
        list.setTextures(0, {array, volume, cube});
        list.setTexture(3, array, Slice{.layer = 2, .layers = 1});
        list.setSampler(0, device.createSampler(Sampler::FilterPoint));
        list.setStorageBuffer(0, result);
        list.dispatch(1);
    });
    const std::vector<uint32_t> values = read<uint32_t>(result);
    EXPECT_EQ(std::vector<uint32_t>(values.begin(), values.begin() + 11),
              (std::vector<uint32_t>{10, 11, 12, 5, 20, 21, 22, 23, 24, 25, 12}));
}

TEST_F(TextureShaderTest, CubeArrays) {
    GLINT_NEED_FEATURE(FeatureCubeArray);
    const Texture cubes =
        device.createTexture({.type = Texture::TypeCube, .format = FormatRf32, .width = 2, .height = 2, .layers = 2});
    EXPECT_EQ(cubes.getLayers(), 12u);
    for (uint16_t face = 0; face < 12; face++) device.clearTexture(cubes, Color{1.0f + face, 0, 0, 0}, {0, 1, face, 1});
    const Buffer result = makeBuffer(std::vector<float>(4));
    compute([&](Compute& list) {
        list.setKernel(makeKernel(R"(
            layout(local_size_x = 1) in;
            layout(binding = 0) uniform samplerCubeArray cubes;
            layout(binding = 1) uniform samplerCube cube;
            layout(binding = 2) buffer Result { vec4 result; };
            void main() {
                result.x = textureLod(cubes, vec4(1, 0, 0, 0), 0.0).x;
                result.y = textureLod(cubes, vec4(0, 0, -1, 1), 0.0).x;
                result.z = textureLod(cube, vec3(0, 1, 0), 0.0).x;
            })"));
        list.setTexture(0, cubes);
        list.setTexture(1, cubes, Slice{.layer = 6, .layers = 6});
        list.setSamplers(0, {device.createSampler(Sampler::FilterPoint), device.createSampler(Sampler::FilterPoint)});
        list.setStorageBuffer(0, result);
        list.dispatch(1);
    });
    EXPECT_EQ(read<float>(result), (std::vector<float>{1, 12, 9, 0}));
}

TEST_F(TextureShaderTest, MipLevelsOfAView) {
    const Texture texture = device.createTexture2D(FormatRf32, 8, 8, Texture::FlagMipmaps);
    for (uint16_t mip = 0; mip < 4; mip++) device.clearTexture(texture, Color{10.0f + mip, 0, 0, 0}, {mip, 1, 0, 1});
    const Buffer result = makeBuffer(std::vector<float>(4));
    compute([&](Compute& list) {
        list.setKernel(makeKernel(R"(
            layout(local_size_x = 1) in;
            layout(binding = 0) uniform sampler2D picture;
            layout(binding = 1) buffer Result { vec4 result; };
            void main() {
                result = vec4(textureLod(picture, vec2(0.5), 0.0).x, textureLod(picture, vec2(0.5), 1.0).x,
                              textureQueryLevels(picture), textureSize(picture, 0).x);
            })"));
        list.setTexture(0, texture, Slice{.mip = 1, .mips = 2});
        list.setSampler(0, device.createSampler(Sampler::FilterBipoint));
        list.setStorageBuffer(0, result);
        list.dispatch(1);
    });
    EXPECT_EQ(read<float>(result), (std::vector<float>{11, 12, 2, 4}));
}

TEST_F(TextureShaderTest, ReadOneLevelWriteTheNext) {
    // One texture sampled and stored at the same time, in different mip levels.
    const Texture texture = device.createTexture2D(FormatRf32, 8, 8, Texture::FlagMipmaps | Texture::FlagSurface);
    device.clearTexture(texture, Color{3, 0, 0, 0});
    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 4, local_size_y = 4) in;
        layout(binding = 0) uniform sampler2D source;
        layout(binding = 1, r32f) writeonly uniform image2D result;
        void main() {
            ivec2 i = ivec2(gl_GlobalInvocationID.xy);
            if (all(lessThan(i, imageSize(result)))) imageStore(result, i, texelFetch(source, i * 2, 0) * 2.0);
        })");
    const Sampler sampler = device.createSampler(Sampler::FilterPoint);
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setSampler(0, sampler);
        for (uint16_t mip = 1; mip < 4; mip++) {
            list.setTexture(0, texture, Slice{.mip = static_cast<uint16_t>(mip - 1), .mips = 1});
            list.setSurfaceTexture(0, texture, {.mip = mip, .mips = 1});
            list.dispatch(8 >> mip, 8 >> mip);
        }
    });
    for (uint16_t mip = 0; mip < 4; mip++)
        EXPECT_EQ(readTexture<float>(texture, {.mip = mip, .mips = 1})[0], static_cast<float>(3 << mip));
}

TEST_F(TextureShaderTest, SamplesOfAMultisampledTexture) {
    const Texture texture = makeTexture(FormatRGBAu8n, 4, 4, Texture::FlagTarget | Texture::FlagMultisample4);
    Target target = device.createTarget(texture);
    target.setClearColor(Color{0.2f, 0, 0, 1});
    Command clear = device.createCommand(target);
    submit(clear);
    const Buffer result = makeBuffer(std::vector<float>(4));
    compute([&](Compute& list) {
        list.setKernel(makeKernel(R"(
            layout(local_size_x = 1) in;
            layout(binding = 0) uniform sampler2DMS samples;
            layout(binding = 1) buffer Result { float result[4]; };
            void main() { for (int i = 0; i < 4; i++) result[i] = texelFetch(samples, ivec2(2), i).x; })"));
        list.setTexture(0, texture);
        list.setSampler(0, device.createSampler());
        list.setStorageBuffer(0, result);
        list.dispatch(1);
    });
    for (const float value : read<float>(result)) EXPECT_NEAR(value, 0.2f, 1e-3);
}

TEST_F(TextureShaderTest, SrgbIsDecodedWhenSampled) {
    const Texture texture = makeTexture(FormatRGBAu8ns, 1, 1, 0);
    device.setTexture(texture, Pixel{188, 0, 255, 128}.data(), 4);
    const Buffer result = makeBuffer(std::vector<float>(4));
    compute([&](Compute& list) {
        list.setKernel(makeKernel(R"(
            layout(local_size_x = 1) in;
            layout(binding = 0) uniform sampler2D picture;
            layout(binding = 1) buffer Result { vec4 value; };
            void main() { value = textureLod(picture, vec2(0.5), 0.0); })"));
        list.setTexture(0, texture);
        list.setSampler(0, device.createSampler());
        list.setStorageBuffer(0, result);
        list.dispatch(1);
    });
    const std::vector<float> value = read<float>(result);
    const double expected = std::pow((188 / 255.0 + 0.055) / 1.055, 2.4);
    EXPECT_NEAR(value[0], expected, 2.0 / 255);
    EXPECT_EQ(value[1], 0.0f);
    EXPECT_EQ(value[2], 1.0f);
    EXPECT_NEAR(value[3], 128 / 255.0, 1e-3);
}

TEST_P(TextureTest, ReleaseBeforeUseIsOver) {
    const Texture kept = makeTexture(FormatRGBAu8n, 64, 64, 0);
    for (int i = 0; i < 10; i++) {
        const Texture temporary = makeTexture(FormatRGBAu8n, 64, 64, 0);
        device.clearTexture(temporary, Color{0, 1, 0, 1});
        device.copyTexture(kept, {}, temporary, {});
        if (i % 2) { ASSERT_THAT(device.flush(), IsOk()); }
    }
    EXPECT_EQ(countPixels(readTexture<Pixel>(kept), green), 64u * 64);
}

INSTANTIATE_APIS(TextureTest);

}  // namespace glint::test
