// SplatModel and SplatRenderer: what they refuse, growth, extremes. tests/accuracy holds the pictures to float64.

#include "support/device_fixture.h"

#include <glint/graphics/picture.h>
#include <glint/graphics/splat_renderer.h>

#include <cmath>
#include <limits>
#include <random>

namespace glint::test {

namespace {

using Instance = SplatRenderer::Instance;

constexpr float infinity = std::numeric_limits<float>::infinity();

/// Round splats of one color.
void add(Splats& splats, const Vector3f& position, float scale, float opacity, const Vector3f& color = {1, 1, 1}) {
    splats.positions.push_back(position);
    splats.scales.emplace_back(scale);
    splats.rotations.emplace_back(0, 0, 0, 1);
    splats.opacities.push_back(opacity);
    splats.harmonics.push_back((color - 0.5f) / 0.28209479f);
    splats.harmonics.resize(splats.size() * splats.coefficientCount(), Vector3f(0.0f));
}

Splats oneSplat() {
    Splats splats;
    add(splats, {0, 2, 0}, 0.1f, 0.5f);
    return splats;
}

class SplatRendererTest : public DeviceTest {
protected:
    Texture createPicture(uint32_t width, uint32_t height, Format format = FormatRGBAf32) {
        return device.createTexture2D(format, width, height, Texture::FlagSurface, "picture");
    }

    /// The camera looks along +Y.
    Status draw(SplatRenderer& renderer, std::span<const Instance> instances, const SplatRenderer::Outputs& outputs) {
        Camera camera;
        camera.perspective(60.0f, static_cast<float>(outputs.color.getWidth()) /
                                      static_cast<float>(std::max(outputs.color.getHeight(), 1u)));
        Compute compute = device.createCompute();
        renderer.draw(compute, camera, instances, outputs);
        return device.submit(compute);
    }
    Status draw(SplatRenderer& renderer, const SplatModel& model, const SplatRenderer::Outputs& outputs) {
        return draw(renderer, std::array{Instance{model}}, outputs);
    }

    std::vector<float> read(const Texture& texture) {
        const Expected<Image> image = readImage(device, texture);
        EXPECT_THAT(image, IsOk());
        if (!image) return {};
        const auto* first = reinterpret_cast<const float*>(image->bytes().data());
        return {first, first + image->bytes().size() / sizeof(float)};
    }

    /// With the lists as large as they have to be.
    std::vector<float> pictureOf(std::span<const Instance> instances, const SplatRenderer::Options& options,
                                 uint32_t width, uint32_t height) {
        SplatRenderer renderer;
        EXPECT_THAT(renderer.create(device, options), IsOk());
        const Texture color = createPicture(width, height);
        for (int round = 0; round < 2; round++) {
            EXPECT_THAT(draw(renderer, instances, {color, {}, {}}), IsOk());
            if (renderer.check()) break;
        }
        return read(color);
    }
};

float largestDifference(const std::vector<float>& a, const std::vector<float>& b) {
    EXPECT_EQ(a.size(), b.size());
    float largest = 0.0f;
    for (size_t i = 0; i < std::min(a.size(), b.size()); i++) largest = std::max(largest, std::abs(a[i] - b[i]));
    return largest;
}

}  // namespace

TEST_F(SplatRendererTest, ModelsTakeWhatTheirStorageSays) {
    for (const uint32_t degree : {0u, 1u, 2u, 3u}) {
        Splats splats;
        splats.degree = degree;
        for (int i = 0; i < 10; i++) add(splats, {0, 2, static_cast<float>(i)}, 0.1f, 0.5f);
        const uint32_t n = splats.coefficientCount();
        const SplatModel half(device, splats);
        ASSERT_THAT(half, IsOk());
        EXPECT_EQ(half.getMemory(), 10 * (36 + (6 * n + 3) / 4 * 4)) << degree;
        EXPECT_LE(half.getMemory(), 10 * 144);
        const SplatModel exact(device, splats, SplatModel::StorageFloat);
        EXPECT_EQ(exact.getMemory(), 10 * (44 + 12 * n)) << degree;
        EXPECT_EQ(exact.size(), 10u);
        EXPECT_EQ(exact.getDegree(), degree);
        EXPECT_EQ(exact.getBounds(), splats.bounds());
    }
}

TEST_F(SplatRendererTest, DecodedIsWithinTheRoundingOfTheStorage) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> any(-1.0f, 1.0f);
    Splats splats;
    splats.degree = 3;
    for (int i = 0; i < 100; i++) {
        add(splats, {any(random), any(random), any(random)}, 0.1f, 0.5f);
        Vector4f q(any(random), any(random), any(random), any(random));
        splats.rotations.back() = q / std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
        splats.harmonics.back() = {any(random), 1e5f, any(random) * 1e-6f};
    }
    const Splats decoded = SplatModel::decoded(splats, SplatModel::StorageHalf);
    EXPECT_EQ(decoded.positions, splats.positions);
    EXPECT_EQ(decoded.opacities, splats.opacities);
    for (size_t i = 0; i < splats.size(); i++) {
        // Half a step of 1/32767 for each component; making the length 1 again takes away error.
        for (int k = 0; k < 4; k++) EXPECT_NEAR(decoded.rotations[i][k], splats.rotations[i][k], 0.51f * 2 / 32767);
        const Vector3f& from = splats.harmonics[16 * i + 15];
        const Vector3f& to = decoded.harmonics[16 * i + 15];
        EXPECT_NEAR(to.x, from.x, std::abs(from.x) * 0x1p-11f + 0x1p-25f);
        EXPECT_EQ(to.y, 65504.0f);
        EXPECT_NEAR(to.z, from.z, 0x1p-25f);
    }
    const Splats exact = SplatModel::decoded(splats, SplatModel::StorageFloat);
    EXPECT_EQ(exact.harmonics, splats.harmonics);
}

TEST_F(SplatRendererTest, ModelsSayWhatIsWrong) {
    EXPECT_EQ(SplatModel().error().id(), "handle.null");
    Splats splats = oneSplat();
    splats.opacities[0] = 2.0f;
    SplatModel model;
    expectError("splats.value", [&] { return model.create(device, splats); });
    EXPECT_EQ(model.error().id(), "splats.value");
    EXPECT_EQ(model.getMemory(), 0u);
    ASSERT_THAT(model.create(device, oneSplat()), IsOk());
    EXPECT_EQ(model.size(), 1u);
    EXPECT_EQ(SplatModel(Device(), oneSplat()).error().id(), "handle.null");
}

TEST_F(SplatRendererTest, RefusesOptions) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const auto refuses = [&](auto&& change) {
        SplatRenderer::Options options;
        change(options);
        SplatRenderer renderer;
        EXPECT_EQ(errorOf(renderer.create(device, options)).id(), "splats.options");
        EXPECT_FALSE(renderer);
    };
    refuses([](auto& o) { o.tile_width = 16; });
    refuses([](auto& o) { o.tile_width = 24, o.tile_height = 16; });
    refuses([](auto& o) { o.tile_width = 16, o.tile_height = 128; });
    refuses([](auto& o) { o.threads = 12; });
    refuses([](auto& o) { o.tile_width = 64, o.tile_height = 64, o.threads = 8; });
    refuses([](auto& o) { o.tile_width = 8, o.tile_height = 8, o.threads = 128; });
    refuses([](auto& o) { o.tile_width = 16, o.tile_height = 16, o.threads = 32; });
    refuses([](auto& o) { o.near = 0; });
    refuses([&](auto& o) { o.near = nan; });
    refuses([](auto& o) { o.near = infinity; });
    refuses([](auto& o) { o.alpha_cut = 0; });
    refuses([&](auto& o) { o.alpha_cut = nan; });
    refuses([](auto& o) { o.transmittance_stop = 0.6f; });
    refuses([&](auto& o) { o.transmittance_stop = nan; });
    refuses([](auto& o) { o.low_pass = 0; });
    refuses([&](auto& o) { o.low_pass = nan; });
    log.take();
}

TEST_F(SplatRendererTest, RefusesWhatItCannotDraw) {
    SplatRenderer renderer;
    const SplatModel model(device, oneSplat());
    const Texture color = createPicture(16, 16);
    expectError("handle.null", [&] { return draw(renderer, model, {color, {}, {}}); });
    EXPECT_EQ(errorOf(renderer.check()).id(), "handle.null");
    ASSERT_THAT(renderer.create(device), IsOk());
    EXPECT_EQ(errorOf(renderer.getTimes()).id(), "splats.options");

    expectError("handle.null", [&] { return draw(renderer, model, {}); });
    expectError("handle.null", [&] { return draw(renderer, SplatModel(), {color, {}, {}}); });
    const Texture sampled = device.createTexture2D(FormatRGBAf32, 16, 16);
    expectError("splats.output", [&] { return draw(renderer, model, {sampled, {}, {}}); });
    expectError("splats.output", [&] { return draw(renderer, model, {createPicture(16, 16, FormatRf32), {}, {}}); });
    expectError("splats.output", [&] { return draw(renderer, model, {color, color, {}}); });
    expectError("splats.output", [&] { return draw(renderer, model, {color, createPicture(16, 8, FormatRf32), {}}); });
    expectError("splats.output", [&] { return draw(renderer, model, {color, {}, createPicture(8, 16, FormatRf32)}); });
    for (const Matrix4x4f& transform : {scale({1, 0, 1}), translate({infinity, 0, 0}), Matrix4x4f(2.0f)})
        expectError("splats.transform", [&] {
            return draw(renderer, std::array{Instance{model, transform}}, {color, {}, {}});
        });
    EXPECT_THAT(draw(renderer, model, {color, {}, {}}), IsOk());
    EXPECT_THAT(renderer.check(), IsOk());
}

TEST_F(SplatRendererTest, NothingIsDrawnOfNothing) {
    SplatRenderer renderer;
    ASSERT_THAT(renderer.create(device), IsOk());
    const SplatModel empty(device, Splats());
    ASSERT_THAT(empty, IsOk());
    Splats behind;
    add(behind, {0, -2, 0}, 0.1f, 1.0f);
    add(behind, {0, 0.1f, 0}, 0.01f, 1.0f);
    add(behind, {0, 2, 0}, 0.1f, 0.0f);
    add(behind, {90, 2, 0}, 0.1f, 1.0f);
    const SplatModel unseen(device, behind);
    const Texture color = createPicture(17, 3), depth = createPicture(17, 3, FormatRf32),
                  rest = createPicture(17, 3, FormatRf32);
    const std::vector<Instance> scenes[] = {{}, {{empty}}, {{unseen}}, {{empty}, {unseen}, {empty}}};
    for (const std::vector<Instance>& scene : scenes) {
        device.clearTexture(color, {1, 2, 3, 4});
        ASSERT_THAT(draw(renderer, scene, {color, depth, rest}), IsOk());
        EXPECT_THAT(renderer.check(), IsOk());
        EXPECT_EQ(renderer.getStatistics().visible, 0u);
        EXPECT_EQ(renderer.getStatistics().entries, 0u);
        EXPECT_EQ(read(color), std::vector<float>(size_t{17 * 3 * 4}, 0.0f));
        EXPECT_EQ(read(depth), std::vector<float>(size_t{17 * 3}, infinity));
        EXPECT_EQ(read(rest), std::vector<float>(size_t{17 * 3}, 1.0f));
    }
}

TEST_F(SplatRendererTest, ListsGrowAndTheFarthestIsWhatTheyLose) {
    // Each covers all 1024 tiles of the picture; room is made for 65,536 entries at first, that is for 64 of them. The
    // nearer half is red, of an opacity that leaves 0.99^100 = 0.366 of what is behind.
    Splats splats;
    for (int i = 0; i < 200; i++)
        add(splats, {0, 2.0f + 0.01f * static_cast<float>(i), 0}, 100.0f, 0.01f,
            i < 100 ? Vector3f(1, 0, 0) : Vector3f(0, 1, 0));
    const SplatModel model(device, splats);
    const auto square = [](uint32_t threads) {
        SplatRenderer::Options options;
        options.tile_width = options.tile_height = 8;
        options.threads = threads;
        return options;
    };
    for (const uint32_t threads : {8u, 32u}) {
        SplatRenderer renderer;
        ASSERT_THAT(renderer.create(device, square(threads)), IsOk());
        const Texture color = createPicture(256, 256);
        ASSERT_THAT(draw(renderer, model, {color, {}, {}}), IsOk());
        EXPECT_EQ(errorOf(renderer.check()).id(), "splats.capacity");
        SplatRenderer::Statistics statistics = renderer.getStatistics();
        EXPECT_EQ(statistics.entries, 200u * 1024);
        EXPECT_EQ(statistics.capacity, 65536u);
        std::vector<float> picture = read(color);
        // 100 products of float32 rounding; exp2 and the log of the opacity are off by some 2^-22.
        for (size_t i = 0; i < picture.size(); i += 4) {
            EXPECT_NEAR(picture[i], 1.0 - std::pow(0.99, 64), 1e-4) << i;
            EXPECT_EQ(picture[i + 1], 0.0f) << i;
        }
        EXPECT_THAT(renderer.check(), IsOk()) << "told once";
        ASSERT_THAT(draw(renderer, model, {color, {}, {}}), IsOk());
        EXPECT_THAT(renderer.check(), IsOk());
        statistics = renderer.getStatistics();
        EXPECT_GE(statistics.capacity, statistics.entries);
        EXPECT_LE(statistics.bytes_per_splat, 64.0);
        picture = read(color);
        for (size_t i = 0; i < picture.size(); i += 4) {
            EXPECT_NEAR(picture[i], 1.0 - std::pow(0.99, 100), 1e-4) << i;
            EXPECT_NEAR(picture[i + 3], 1.0 - std::pow(0.99, 200), 1e-4) << i;
        }
    }
}

TEST_F(SplatRendererTest, BothFormsAndAllTilesGiveOnePicture) {
    std::mt19937 random(2);
    std::uniform_real_distribution<float> any(-1.0f, 1.0f);
    Splats splats;
    for (int i = 0; i < 400; i++) {
        add(splats, {any(random) * 2, 2.0f + any(random), any(random)}, 0.1f, 0.5f + 0.5f * any(random),
            {0.5f + 0.5f * any(random), 0.5f, 0.2f});
        splats.scales.back() *= Vector3f(1.0f, 0.02f + std::abs(any(random)), 0.3f);
        const Vector4f q(any(random), any(random), any(random), 1.0f);
        splats.rotations.back() = q / std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    }
    const SplatModel model(device, splats);
    const std::array instances = {Instance{model}};
    SplatRenderer::Options options;
    options.tile_width = options.tile_height = 16;
    const std::vector<float> first = pictureOf(instances, options, 83, 45);
    const uint32_t forms[][3] = {{8, 8, 8}, {8, 8, 32}, {16, 16, 64}, {16, 8, 128}, {32, 16, 128}, {64, 8, 8}};
    for (const auto& form : forms) {
        options.tile_width = form[0];
        options.tile_height = form[1];
        options.threads = form[2];
        SCOPED_TRACE(testing::Message() << form[0] << "x" << form[1] << ", " << form[2] << " threads");
        // Threads add up the rows from other ones on. A splat whose alpha is the cut, to that rounding, may be in one
        // picture and not in the other.
        EXPECT_LE(largestDifference(pictureOf(instances, options, 83, 45), first), 1.01f / 255.0f);
    }
}

TEST_F(SplatRendererTest, ModelsBeyondOneBindingAreDrawnAsTheirParts) {
    const uint64_t limit = device.getFeatures().maxStorageSize;
    constexpr uint64_t bytes = 236;
    if (limit > (256u << 20)) GTEST_SKIP() << "one binding holds " << limit << " bytes";
    const auto count = static_cast<uint32_t>(limit / bytes + 1000);
    Splats parts[2];
    for (uint32_t i = 0; i < count; i++) {
        Splats& part = parts[i < count / 3 ? 0 : 1];
        part.degree = 3;
        // On a sheet beside the camera's view, but for one in a thousand.
        const float x = static_cast<float>(i % 1000) - 1.0f, z = static_cast<float>(i / 1000) / 400.0f - 0.5f;
        add(part, {x, 1.5f, z}, 0.02f, 0.5f, {0.5f, static_cast<float>(i / 1000) / 600.0f, 1});
    }
    Splats all = parts[0];
    all.positions.insert(all.positions.end(), parts[1].positions.begin(), parts[1].positions.end());
    all.scales.insert(all.scales.end(), parts[1].scales.begin(), parts[1].scales.end());
    all.rotations.insert(all.rotations.end(), parts[1].rotations.begin(), parts[1].rotations.end());
    all.opacities.insert(all.opacities.end(), parts[1].opacities.begin(), parts[1].opacities.end());
    all.harmonics.insert(all.harmonics.end(), parts[1].harmonics.begin(), parts[1].harmonics.end());
    const SplatModel whole(device, all, SplatModel::StorageFloat);
    ASSERT_THAT(whole, IsOk());
    EXPECT_EQ(whole.getChunks().size(), 2u);
    EXPECT_EQ(whole.getMemory(), count * bytes);
    const SplatModel first(device, parts[0], SplatModel::StorageFloat);
    const SplatModel second(device, parts[1], SplatModel::StorageFloat);
    const std::vector<float> expected = pictureOf(std::array{Instance{first}, Instance{second}}, {}, 64, 48);
    EXPECT_EQ(pictureOf(std::array{Instance{whole}}, {}, 64, 48), expected);
    EXPECT_GT(*std::max_element(expected.begin(), expected.end()), 0.3f);
}

TEST_F(SplatRendererTest, NoValuesMakeTheResultInvalid) {
    std::mt19937 random(3);
    const float extremes[] = {0.0f, 1e-38f, 1e-20f, 1e-6f, 0.2f, 0.20000002f, 1.0f, 3.0f, 1e4f, 1e10f, 1e20f, 3e38f};
    const auto any = [&] { return extremes[random() % std::size(extremes)]; };
    const auto sign = [&] { return random() % 2 ? 1.0f : -1.0f; };
    Splats splats;
    splats.degree = 1;
    for (int i = 0; i < 5000; i++) {
        add(splats, {sign() * any(), any(), sign() * any()}, 1.0f,
            random() % 500 == 0 ? 1.0f : static_cast<float>(random() % 3) * 0.02f);
        splats.scales.back() = {any(), any(), any()};
        splats.harmonics.back() = Vector3f(sign() * any());
        if (i % 3 == 0) splats.rotations.back() = Vector4f(0.5f);
    }
    for (const SplatModel::Storage storage : {SplatModel::StorageHalf, SplatModel::StorageFloat})
        for (const bool antialiased : {false, true}) {
            const SplatModel model(device, splats, storage);
            ASSERT_THAT(model, IsOk());
            SplatRenderer::Options options;
            options.antialiased = antialiased;
            SplatRenderer renderer;
            ASSERT_THAT(renderer.create(device, options), IsOk());
            const Texture color = createPicture(40, 40), depth = createPicture(40, 40, FormatRf32);
            for (int round = 0; round < 2; round++) {
                ASSERT_THAT(draw(renderer, model, {color, depth, {}}), IsOk());
                if (renderer.check()) break;
            }
            const std::vector<float> picture = read(color), depths = read(depth);
            for (size_t i = 0; i < picture.size(); i++) {
                EXPECT_TRUE(picture[i] >= 0.0f) << i << ": " << picture[i];
                if (i % 4 == 3) { EXPECT_LE(picture[i], 1.0f); }
            }
            // The mean of depths of at least 0.2, rounded once for each splat.
            for (const float value : depths) EXPECT_TRUE(value >= 0.1999f) << value;
        }
}

TEST_F(SplatRendererTest, TellsTheTimesOfItsPasses) {
    GLINT_NEED_FEATURE(FeatureTimestamps);
    SplatRenderer::Options options;
    options.timed = true;
    SplatRenderer renderer;
    ASSERT_THAT(renderer.create(device, options), IsOk());
    ASSERT_THAT(draw(renderer, SplatModel(device, oneSplat()), {createPicture(64, 64), {}, {}}), IsOk());
    const auto times = renderer.getTimes();
    ASSERT_THAT(times, IsOk());
    for (uint8_t pass = 0; pass < SplatRenderer::PassCount; pass++)
        EXPECT_GT((*times)[pass], 0u) << SplatRenderer::toString(static_cast<SplatRenderer::Pass>(pass));
}

}  // namespace glint::test
