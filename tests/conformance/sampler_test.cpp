#include "conformance/conformance.h"

namespace glint::test {

namespace {

class SamplerTest : public ConformanceTest {
protected:
    /// What a sampler gives at these coordinates (u, v, level of detail) in a texture.
    std::vector<float> sample(const Texture& texture, const Sampler& sampler,
                              const std::vector<std::array<float, 4>>& at) {
        EXPECT_TRUE(sampler) << sampler.error().text();
        const Buffer result = makeBuffer(std::vector<float>(at.size()));
        const Buffer coordinates = makeBuffer(at);
        compute([&](Compute& list) {
            list.setKernel(makeKernel(R"(
                layout(local_size_x = 1) in;
                layout(binding = 0) uniform sampler2D picture;
                layout(binding = 1) readonly buffer Coordinates { vec4 coordinates[]; };
                layout(binding = 2) buffer Result { float result[]; };
                void main() {
                    uint i = gl_GlobalInvocationID.x;
                    result[i] = textureLod(picture, coordinates[i].xy, coordinates[i].z).x;
                })"));
            list.setTexture(0, texture);
            list.setSampler(0, sampler);
            list.setStorageBuffers(0, {coordinates, result});
            list.dispatch(at.size());
        });
        return read<float>(result);
    }

    /// 4 x 1 texels of values 0, 1, 2, 3; further mip levels hold 10 and 20.
    Texture ramp() {
        Texture texture = device.createTexture2D(FormatRf32, 4, 1, Texture::FlagMipmaps, "ramp");
        const float level0[] = {0, 1, 2, 3}, level1[] = {10, 10}, level2[] = {20};
        device.setTexture(texture, level0, 16);
        device.setTexture(texture, level1, 8, {.mip = 1, .mips = 1});
        device.setTexture(texture, level2, 4, {.mip = 2, .mips = 1});
        return texture;
    }
};

constexpr float middle(int texel) { return (static_cast<float>(texel) + 0.5f) / 4; }

}  // namespace

TEST_F(SamplerTest, PointAndLinear) {
    const Texture texture = ramp();
    const std::vector<std::array<float, 4>> at = {{middle(1), 0.5f}, {0.5f + 0.0625f, 0.5f}, {0.5f, 0.5f}};
    EXPECT_EQ(sample(texture, device.createSampler(Sampler::FilterPoint), {at[0], at[1]}), (std::vector<float>{1, 2}));
    const std::vector<float> linear = sample(texture, device.createSampler(Sampler::FilterLinear), at);
    EXPECT_NEAR(linear[0], 1.0f, 0.01);
    EXPECT_NEAR(linear[1], 1.75f, 0.01);
    EXPECT_NEAR(linear[2], 1.5f, 0.01);
}

TEST_F(SamplerTest, MipFilters) {
    const Texture texture = ramp();
    const std::vector<std::array<float, 4>> at = {
        {middle(1), 0.5f, 0}, {middle(1), 0.5f, 0.9f}, {middle(1), 0.5f, 1.5f}};
    EXPECT_EQ(sample(texture, device.createSampler(Sampler::FilterPoint), at), (std::vector<float>{1, 1, 1}));
    EXPECT_EQ(sample(texture, device.createSampler(Sampler::FilterBipoint), {at[0], at[1]}),
              (std::vector<float>{1, 10}));
    EXPECT_EQ(sample(texture, device.createSampler(Sampler::FilterBilinear), {at[0], at[1]}),
              (std::vector<float>{1, 10}));
    EXPECT_NEAR(sample(texture, device.createSampler(Sampler::FilterTrilinear), at)[2], 15.0f, 0.1);
}

TEST_F(SamplerTest, WrapModes) {
    const Texture texture = ramp();
    const std::vector<std::array<float, 4>> at = {{middle(-1), 0.5f}, {middle(4), 0.5f}, {middle(5), 0.5f}};
    const auto wrapped = [&](Sampler::WrapMode mode) {
        return sample(texture, device.createSampler(Sampler::FilterPoint, mode), at);
    };
    EXPECT_EQ(wrapped(Sampler::WrapModeClamp), (std::vector<float>{0, 3, 3}));
    EXPECT_EQ(wrapped(Sampler::WrapModeRepeat), (std::vector<float>{3, 0, 1}));
    EXPECT_EQ(wrapped(Sampler::WrapModeMirror), (std::vector<float>{0, 3, 2}));
    EXPECT_EQ(wrapped(Sampler::WrapModeBorder), (std::vector<float>{0, 0, 0}));
}

TEST_F(SamplerTest, BorderColors) {
    const Texture texture = ramp();
    for (const Color& border : {Color{0, 0, 0, 0}, Color{0, 0, 0, 1}, Color{1, 1, 1, 1}}) {
        const Sampler sampler =
            device.createSampler({.filter = Sampler::FilterPoint, .wrap = Sampler::WrapModeBorder, .border = border});
        EXPECT_EQ(sample(texture, sampler, {{-0.5f, 0.5f}}), std::vector<float>{border.r});
    }
}

TEST_F(SamplerTest, LevelOfDetailIsClampedAndBiased) {
    const Texture texture = ramp();
    const std::vector<std::array<float, 4>> at = {{middle(0), 0.5f, 0}, {middle(0), 0.5f, 5}};
    EXPECT_EQ(sample(texture,
                     device.createSampler({.filter = Sampler::FilterBipoint, .lod_minimum = 1, .lod_maximum = 1}), at),
              (std::vector<float>{10, 10}));
    EXPECT_EQ(sample(texture, device.createSampler({.filter = Sampler::FilterBipoint, .lod_bias = 2}), at),
              (std::vector<float>{20, 20}));
}

TEST_F(SamplerTest, Comparing) {
    const Texture texture = makeTexture(FormatDf32, 1, 1);
    device.clearTexture(texture, Color{0.5f, 0, 0, 0});
    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 1) in;
        layout(binding = 0) uniform sampler2DShadow shadow;
        layout(binding = 1) buffer Result { float result[3]; };
        void main() {
            float references[3] = {0.25, 0.5, 0.75};
            for (int i = 0; i < 3; i++) result[i] = textureLod(shadow, vec3(0.5, 0.5, references[i]), 0.0);
        })");
    const std::pair<Compare, std::vector<float>> cases[] = {
        {Compare::Never, {0, 0, 0}},        {Compare::Less, {1, 0, 0}},    {Compare::Equal, {0, 1, 0}},
        {Compare::LessEqual, {1, 1, 0}},    {Compare::Greater, {0, 0, 1}}, {Compare::NotEqual, {1, 0, 1}},
        {Compare::GreaterEqual, {0, 1, 1}}, {Compare::Always, {1, 1, 1}},
    };
    for (const auto& [compare, expected] : cases) {
        const Buffer result = makeBuffer(std::vector<float>(3));
        compute([&](Compute& list) {
            list.setKernel(kernel);
            list.setTexture(0, texture);
            list.setSampler(
                0, device.createSampler({.filter = Sampler::FilterPoint, .comparing = true, .compare = compare}));
            list.setStorageBuffer(0, result);
            list.dispatch(1);
        });
        EXPECT_EQ(read<float>(result), expected) << static_cast<int>(compare);
    }
}

TEST_F(SamplerTest, Reductions) {
    GLINT_NEED_FEATURE(FeatureSamplerReduction);
    const Texture texture = ramp();
    const auto reduced = [&](Sampler::Reduction reduction) {
        return sample(texture, device.createSampler({.filter = Sampler::FilterLinear, .reduction = reduction}),
                      {{0.5f, 0.5f}})[0];
    };
    EXPECT_EQ(reduced(Sampler::ReductionMinimum), 1.0f);
    EXPECT_EQ(reduced(Sampler::ReductionMaximum), 2.0f);
}

TEST_F(SamplerTest, Anisotropy) {
    GLINT_NEED_FEATURE(FeatureAnisotropy);
    EXPECT_TRUE(
        device.createSampler({.filter = Sampler::FilterTrilinear, .anisotropy = device.getFeatures().maxAnisotropy}));
}

TEST_F(SamplerTest, EveryCombinationCanBeMade) {
    for (int filter = 0; filter <= Sampler::FilterTrilinear; filter++)
        for (int wrap = 0; wrap <= Sampler::WrapModeBorder; wrap++)
            EXPECT_TRUE(
                device.createSampler(static_cast<Sampler::Filter>(filter), static_cast<Sampler::WrapMode>(wrap)));
}

}  // namespace glint::test
