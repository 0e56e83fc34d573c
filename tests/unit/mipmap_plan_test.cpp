// The passes that make mip levels: every texel once, nothing read before it is there, and no place in scratch memory
// used for two things at once.

#include "support/reference.h"

#include <glint/device/detail/mipmaps.h>
#include <glint/device/detail/texture_layout.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace glint::test {
namespace {

using detail::MipmapPass;
using detail::MipmapPlan;

uint64_t keptBytes(const TextureDesc& desc, const MipmapPass& pass) {
    return uint64_t(detail::mipSize(desc.width, pass.level)) * pass.rows * pass.slices * detail::keptSize(desc.format);
}

void check(const TextureDesc& desc, uint64_t budget) {
    SCOPED_TRACE(testing::Message() << toString(desc.format) << ", " << desc.width << " x " << desc.height << " x "
                                    << desc.depth << ", " << desc.layers << " layers, " << budget << " bytes");
    constexpr uint64_t alignment = 64;
    const MipmapPlan plan = detail::planMipmaps(desc, alignment, budget);
    std::vector<std::vector<int>> made(desc.mipmaps);  // rows of slices of levels
    made[0].assign(size_t(desc.height) * desc.depth * desc.layers, 1);
    for (uint32_t level = 1; level < desc.mipmaps; level++) {
        const Region all = detail::mipRegion(desc, level);
        made[level].assign(size_t(all.height) * all.depth * desc.layers, 0);
    }
    uint64_t kept_end = 0;
    for (size_t i = 0; i < plan.passes.size(); i++) {
        const MipmapPass& pass = plan.passes[i];
        ASSERT_LT(pass.level, desc.mipmaps);
        const uint32_t height = detail::mipSize(desc.height, pass.level);
        if (pass.from_kept) {
            // Of the same layers, the pass before has kept all.
            const MipmapPass& before = plan.passes[i - 1];
            ASSERT_TRUE(before.keeps);
            ASSERT_EQ(before.level + 1, pass.level);
            ASSERT_EQ(before.first_slice, pass.first_slice);
            ASSERT_EQ(before.rows, detail::mipSize(desc.height, before.level));
            // What the chain has stored so far is copied at its end.
            EXPECT_GE(pass.stored, kept_end);
        } else {
            for (const int times : made[pass.level - 1]) ASSERT_EQ(times, 1);
        }
        for (uint32_t slice = 0; slice < pass.slices; slice++)
            for (uint32_t row = 0; row < pass.rows; row++)
                made[pass.level].at(size_t(pass.first_slice + slice) * height + pass.first_row + row)++;
        const uint64_t stored_end = pass.stored + detail::storedSize(desc, pass);
        EXPECT_EQ(pass.stored % alignment, 0u);
        EXPECT_EQ(pass.kept % alignment, 0u);
        EXPECT_GE(pass.kept, stored_end);
        kept_end = pass.kept + (pass.keeps ? keptBytes(desc, pass) : 0);
        EXPECT_LE(stored_end, plan.scratch);
        EXPECT_LE(kept_end, plan.scratch);
    }
    for (const std::vector<int>& level : made)
        for (const int times : level) ASSERT_EQ(times, 1);
    // A row at least is made at a time. Places of texels of 12 bytes are multiples of 3 alignments.
    const uint64_t row = uint64_t(desc.width) * 16;
    EXPECT_LE(plan.scratch, std::max(budget, row) + 3 * alignment);
}

uint32_t levels(const TextureDesc& desc) {
    return static_cast<uint32_t>(std::bit_width(std::max({desc.width, desc.height, desc.depth})));
}

TEST(MipmapPlan, MakesEveryTexelOnce) {
    Random random(3);
    for (int i = 0; i < 2000; i++) {
        TextureDesc desc;
        const Format formats[] = {FormatRu8n, FormatRGu8n, FormatRGBAu8n, FormatRGBf32, FormatRGBAf32};
        desc.format = formats[random.below(5)];
        desc.width = 1 + static_cast<uint32_t>(random.below(70));
        desc.height = 1 + static_cast<uint32_t>(random.below(70));
        if (random.below(3) == 0) {
            desc.type = Texture::Type3D;
            desc.depth = 1 + static_cast<uint32_t>(random.below(20));
        } else {
            desc.layers = 1 + static_cast<uint32_t>(random.below(7));
        }
        desc.mipmaps = levels(desc) - static_cast<uint32_t>(random.below(std::min(levels(desc), 2u)));
        if (desc.mipmaps < 2) continue;
        check(desc, 64ull << random.below(14));
    }
}

TEST(MipmapPlan, KeepsAllLevelsThatFit) {
    const TextureDesc desc = {.format = FormatRGBAu8n, .width = 2048, .height = 2048, .mipmaps = 12};
    const MipmapPlan plan = detail::planMipmaps(desc, 64, 64 << 20);
    ASSERT_EQ(plan.passes.size(), 11u);
    for (size_t i = 1; i < plan.passes.size(); i++) EXPECT_TRUE(plan.passes[i].from_kept);
    // 20 bytes a texel, a third more for what follows.
    EXPECT_NEAR(static_cast<double>(plan.scratch), 1024.0 * 1024 * 20 * 4 / 3, 2048);
    // The whole texture at once, if there are several layers.
    const TextureDesc layers = {.format = FormatRGBAu8n, .width = 64, .height = 64, .layers = 6, .mipmaps = 7};
    EXPECT_EQ(detail::planMipmaps(layers, 64, 64 << 20).passes.size(), 6u);
}

}  // namespace
}  // namespace glint::test
