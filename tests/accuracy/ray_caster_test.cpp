// What RayCaster promises beside exact hits: rays that mean nothing, ranges, parts, chunks, errors.

#include "accuracy/caster_test.h"

#include <glint/geometry/primitives.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace glint::test {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

using RayCasterTest = CasterTest;

/// A square of two triangles at z = 0, counter-clockwise seen from above.
Mesh square() { return createPlane(2.0f); }

Ray down(float t_min, float t_max) { return {{0.3f, 0.1f, 2}, t_min, {0, 0, -1}, t_max}; }

}  // namespace

TEST_F(RayCasterTest, GivesWhatItSays) {
    const std::vector<RayHit> hits =
        cast(square(), {down(0, infinity), {{0.3f, 0.1f, -4}, 0, {0, 0, 2}, infinity}, {{5, 0, 2}, 0, {0, 0, -1}, 10}});
    ASSERT_EQ(hits.size(), 3u);
    EXPECT_EQ(hits[0].t, 2.0f);
    EXPECT_EQ(hits[0].geometry, 0u);
    EXPECT_EQ(hits[0].front, 1u);
    EXPECT_EQ(hits[0].instance, 0u);
    EXPECT_EQ(hits[1].t, 2.0f);
    EXPECT_EQ(hits[1].front, 0u);
    EXPECT_EQ(hits[1].primitive, hits[0].primitive);
    EXPECT_EQ(hits[2], RayHit());
    EXPECT_EQ(hits[2].t, infinity);
    EXPECT_EQ(hits[2].primitive, 0xffffffffu);
    const Mesh mesh = square();
    const uint32_t* corners = &mesh.indices[hits[0].primitive * size_t{3}];
    const Vector3f place = mesh.positions[corners[0]] * (1 - hits[0].u - hits[0].v) +
                           mesh.positions[corners[1]] * hits[0].u + mesh.positions[corners[2]] * hits[0].v;
    // Three roundings of numbers up to 1.
    EXPECT_NEAR(place.x, 0.3f, 4 * 0x1p-24f);
    EXPECT_NEAR(place.y, 0.1f, 4 * 0x1p-24f);
}

TEST_F(RayCasterTest, Ranges) {
    const std::vector<RayHit> hits =
        cast(square(), {down(0, 1.99f), down(2.01f, infinity), down(1.99f, 2.01f), down(-1, 3),
                        down(-infinity, infinity), down(-3, -1), down(3, 1), down(infinity, infinity), down(0, -0.0f)});
    std::string pattern;
    for (const RayHit& hit : hits) pattern += hit.isHit() ? 'x' : '.';
    EXPECT_EQ(pattern, "..xxx....");
}

TEST_F(RayCasterTest, RaysThatMeanNothingMiss) {
    std::vector<Ray> rays;
    for (const float value : {NAN, infinity, -infinity})
        for (int i = 0; i < 8; i++) {
            Ray ray = down(0, infinity);
            auto* numbers = reinterpret_cast<float*>(&ray);
            numbers[i] = value;
            const bool is_end = i == 3 || i == 7;  // t_min = -inf and t_max = inf mean something
            if (!is_end || std::isnan(value) || (i == 3) == (value > 0)) rays.push_back(ray);
        }
    Ray still = down(0, infinity);
    still.direction = Vector3f(0);
    rays.push_back(still);
    still.direction = Vector3f(-0.0f, 0, -0x1p-140f);
    rays.push_back(still);
    ASSERT_EQ(rays.size(), 24u);
    for (const RayHit& hit : cast(square(), rays)) EXPECT_EQ(hit, RayHit());
}

TEST_F(RayCasterTest, NumbersAreThoseOfTheMesh) {
    // Three spheres in a row as parts, in an order unlike that in space, and a fourth in no part.
    Mesh mesh;
    const Mesh sphere = createSphere(0.4f, 1);
    const std::array<float, 4> places = {2, 0, 3, 1};
    for (size_t i = 0; i < 4; i++) {
        const auto base = static_cast<uint32_t>(mesh.positions.size());
        if (i != 2)
            mesh.parts.push_back(
                {"", static_cast<uint32_t>(mesh.indices.size()), static_cast<uint32_t>(sphere.indices.size())});
        for (const Vector3f& position : sphere.positions)
            mesh.positions.push_back(position + Vector3f(places[i], 0, 0));
        for (const uint32_t index : sphere.indices) mesh.indices.push_back(base + index);
    }
    const ReferenceHierarchy reference(mesh);
    std::vector<Ray> rays;
    for (const float place : places) rays.push_back({{place + 0.05f, 0.07f, 3}, 0, {0.01f, 0.02f, -1}, 100});
    const std::vector<RayHit> hits = cast(mesh, rays);
    ASSERT_EQ(hits.size(), 4u);
    const std::array<uint32_t, 4> parts = {0, 1, 3, 2};
    for (size_t i = 0; i < 4; i++) {
        const ReferenceHit exact = reference.closestHit(Vector3d(rays[i].origin), Vector3d(rays[i].direction));
        EXPECT_EQ(hits[i].primitive, exact.triangle) << i;
        EXPECT_EQ(hits[i].geometry, parts[i]) << i;
    }
}

TEST_F(RayCasterTest, AnyNumberOfRays) {
    Expected<RayCaster> caster = RayCaster::create(device, square());
    ASSERT_THAT(caster, IsOk());
    for (const uint64_t count :
         {uint64_t{0}, uint64_t{1}, uint64_t{63}, uint64_t{65}, uint64_t{RayCaster::chunk} - 1,
          uint64_t{RayCaster::chunk}, uint64_t{RayCaster::chunk} + 1, uint64_t{RayCaster::chunk} * 3 + 7}) {
        SCOPED_TRACE(count);
        // Every third ray misses; the distance tells the others apart.
        uint64_t made = 0;
        uint64_t seen = 0;
        uint64_t wrong = 0;
        const Status status = caster->cast(
            [&](std::span<Ray> rays) -> Expected<uint64_t> {
                const uint64_t more = std::min<uint64_t>(rays.size(), count - made);
                for (uint64_t i = 0; i < more; i++, made++)
                    rays[i] = {
                        {0.25f, made % 3 ? 0.5f : 7.0f, static_cast<float>(made % 1000 + 1)}, 0, {0, 0, -1}, 1e9f};
                return more;
            },
            [&](std::span<const RayHit> hits) {
                for (const RayHit& hit : hits) {
                    wrong +=
                        hit.isHit() != (seen % 3 != 0) || (hit.isHit() && hit.t != static_cast<float>(seen % 1000 + 1));
                    seen++;
                }
                return Status();
            });
        EXPECT_THAT(status, IsOk());
        EXPECT_EQ(seen, count);
        EXPECT_EQ(wrong, 0u);
    }
}

TEST_F(RayCasterTest, ErrorsEndTheCast) {
    Expected<RayCaster> caster = RayCaster::create(device, square());
    ASSERT_THAT(caster, IsOk());
    const Error stop = Error::inFile(ErrorCode::Io, "test.stop", "enough", {}, 0);
    int calls = 0;
    uint64_t first = 0;
    const RayCaster::Source endless = [&](std::span<Ray> rays) -> Expected<uint64_t> {
        std::fill(rays.begin(), rays.end(), Ray());
        if (calls == 0) first = rays.size();
        if (calls++ == 2) return unexpected(stop);
        return rays.size();
    };
    uint64_t taken = 0;
    const RayCaster::HitSink count = [&](std::span<const RayHit> hits) {
        taken += hits.size();
        return Status();
    };
    EXPECT_THAT(caster->cast(endless, count), HasErrorId("test.stop"));
    EXPECT_EQ(taken, first);
    calls = 10;
    EXPECT_THAT(caster->cast(endless, [&](std::span<const RayHit>) { return Status(stop); }), HasErrorId("test.stop"));
    // The caster is as good as new.
    EXPECT_EQ(caster->cast(std::vector{down(0, 10)})->at(0).t, 2.0f);
}

TEST_F(RayCasterTest, Refuses) {
    EXPECT_THAT(RayCaster::create(Device(), square()), HasErrorId("handle.null"));
    EXPECT_THAT(RayCaster::create(device, Mesh()), HasErrorId("mesh.no_faces"));
    Mesh mesh = square();
    mesh.positions[0].x = mesh.positions[3].x = NAN;
    mesh.positions[1].y = mesh.positions[2].y = infinity;
    EXPECT_THAT(RayCaster::create(device, mesh), HasErrorId("mesh.no_faces"));
    mesh = square();
    mesh.indices[4] = 9;
    EXPECT_THAT(RayCaster::create(device, mesh), HasErrorId("mesh.index_range"));
    const Device plain = Device::create({.optional = FeatureNone});
    ASSERT_THAT(plain, IsOk());
    EXPECT_THAT(RayCaster::create(plain, square()), HasErrorId("device.unsupported"));
}

}  // namespace glint::test
