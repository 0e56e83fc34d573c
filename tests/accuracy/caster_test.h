#pragma once

#include "support/device_fixture.h"
#include "support/hit_accuracy.h"

#include <vector>

namespace glint::test {

/// A test that casts rays with a device.
class CasterTest : public DeviceTest {
protected:
    void SetUp() override {
        DeviceTest::SetUp();
        GLINT_NEED_FEATURE(FeatureComputeTracing);
    }

    /// Closest hits. Expects that the rays that hit anything at all are the same.
    std::vector<RayHit> cast(const Mesh& mesh, const std::vector<Ray>& rays) {
        Expected<RayCaster> caster = RayCaster::create(device, mesh);
        EXPECT_THAT(caster, IsOk());
        if (!caster) return {};
        const Expected<std::vector<RayHit>> hits = caster->cast(rays);
        const Expected<std::vector<uint8_t>> any = caster->castAny(rays);
        EXPECT_THAT(hits, IsOk());
        EXPECT_THAT(any, IsOk());
        if (!hits || !any) return {};
        EXPECT_EQ(any->size(), hits->size());
        for (size_t i = 0; i < rays.size(); i++) EXPECT_EQ((*any)[i], (*hits)[i].isHit() ? 1 : 0) << "ray " << i;
        return *hits;
    }
};

}  // namespace glint::test
