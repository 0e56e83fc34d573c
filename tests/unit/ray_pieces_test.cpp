// How RayCaster cuts its rays into pieces: no dispatch of a slow device gets long, and a fast one gets large ones.

#include "support/matchers.h"

#include <glint/geometry/primitives.h>
#include <glint/graphics/detail/piece_size.h>
#include <glint/graphics/ray_caster.h>
#include <platform/null/null_control.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace glint::test {

namespace {

using detail::PieceSize;

constexpr double longest = 0.1;  // seconds

}  // namespace

// From the slowest driver known (thousands of shuffled instances on lavapipe) to large GPUs. A piece of n rays takes
// 30 us and n / rate.
TEST(RayPieces, SuitTheDevice) {
    for (const double rate : {1.1e3, 1e4, 1e5, 1e6, 1e7, 1e9}) {
        SCOPED_TRACE(rate);
        PieceSize pieces;
        double total = 0.0;
        uint64_t rays = 0;
        for (int i = 0; i < 100; i++) {
            const uint32_t count = pieces.next(RayCaster::chunk);
            ASSERT_GE(count, 1u);
            ASSERT_LE(count, RayCaster::chunk);
            const double seconds = 30e-6 + count / rate;
            EXPECT_LE(seconds, longest);
            pieces.add(count, seconds);
            total += seconds;
            rays += count;
        }
        // Cutting costs little: more than half of the time is the rays', where no piece is the largest.
        const bool is_fast = rate > 2e7;
        EXPECT_GT(static_cast<double>(rays) / rate, is_fast ? 0.0 : 0.5 * total);
        EXPECT_EQ(pieces.next(RayCaster::chunk) == RayCaster::chunk, is_fast);
    }
}

TEST(RayPieces, FollowTheRays) {
    PieceSize pieces;
    const auto run = [&](double rate, int count) {
        double slowest = 0.0;
        for (int i = 0; i < count; i++) {
            const uint32_t rays = pieces.next(RayCaster::chunk);
            slowest = std::max(slowest, rays / rate);
            pieces.add(rays, rays / rate);
        }
        return slowest;
    };
    run(4e6, 20);
    EXPECT_LE(run(1e6, 20), longest + 1e-3);  // four times as dear
    EXPECT_GT(run(1e4, 1), longest);          // a hundred times: one piece is too long, the next are not
    EXPECT_LE(run(1e4, 20), longest);
    run(4e6, 20);
    const uint32_t size = pieces.next(RayCaster::chunk);
    EXPECT_GE(size, 64000u);
    // The end of an array: a few rays, of which nothing can be told.
    pieces.add(3, 50e-6);
    EXPECT_EQ(pieces.next(RayCaster::chunk), size);
    pieces.add(3, 0.0);
    EXPECT_EQ(pieces.next(1000), 1000u);
}

// The same through a device, whose clock goes on by what its dispatches cost.
TEST(RayPieces, OfADeviceWithoutHurry) {
    for (const bool has_clock : {true, false}) {
        const null::ScopedSettings scope(
            {.missing = has_clock ? FeatureNone : FeatureTimestamps, .group_time = 6'400'000});  // 10,000 rays a second
        const Device device = Device::create({.api = "null"});
        ASSERT_THAT(device, IsOk());
        Expected<RayCaster> caster = RayCaster::create(device, createPlane(2.0f));
        ASSERT_THAT(caster, IsOk());
        std::vector<size_t> asked;
        uint64_t left = 5000, taken = 0;
        const Status status = caster->cast(
            [&](std::span<Ray> rays) -> Expected<uint64_t> {
                asked.push_back(rays.size());
                const uint64_t count = std::min<uint64_t>(rays.size(), left);
                std::fill_n(rays.begin(), count, Ray());
                left -= count;
                return count;
            },
            [&](std::span<const RayHit> hits) {
                taken += hits.size();
                return Status();
            });
        EXPECT_THAT(status, IsOk());
        EXPECT_EQ(taken, 5000u);
        const size_t largest = *std::max_element(asked.begin(), asked.end());
        if (has_clock) {
            // 25 ms and no more, in whole groups.
            EXPECT_EQ(largest, 192u);
        } else {
            // Nothing really takes time here, and the host's clock sees that.
            EXPECT_GT(largest, 192u);
        }
    }
}

}  // namespace glint::test
