// Spawn points, segments and normals of <glint/ray.h> on the device: against both engines, float64 and the functions of
// the same names in C++.

#include "support/device_fixture.h"
#include "support/reference.h"
#include "support/spawn_tracer.h"

#include <glint/geometry/primitives.h>
#include <glint/math/ray.h>

#include <fmt/format.h>

#include <cmath>
#include <cstring>

namespace glint::test {

namespace {

class RayHelpers : public DeviceTest {
protected:
    /// Runs a body for each engine that the device has: the software one has the larger part of the rays.
    template <class Body>
    void withEngines(const Body& body) {
        for (const bool driver : {false, true}) {
            if (driver && !device.getFeatures().has(FeatureComputeTracing)) continue;
            SCOPED_TRACE(driver ? "driver" : "software");
            SpawnTracer tracer(device, driver);
            body(tracer, driver);
        }
    }
};

TEST_F(RayHelpers, RaysDoNotMeetWhatTheyLeave) {
    withEngines([](SpawnTracer& tracer, bool driver) {
        for (const SpawnCase& scene : spawnCases()) {
            SCOPED_TRACE(scene.name);
            const std::vector<SpawnSample> samples = spawnSamples(scene, driver ? 5000 : 40000, 1);
            for (const float multiple : {0.0f, 1.0f}) {
                uint32_t left = 0;
                uint32_t own = 0;
                for (const SpawnResult& result : tracer.trace(scene, samples, SpawnMode::Corners, multiple)) {
                    left += result.first != SpawnResult::none ? 1 : 0;
                    own += result.meetsItsOwn() ? 1 : 0;
                }
                EXPECT_GT(left, samples.size() / 2);
                fmt::print("{:8} {:40} {} : {} of {}\n", driver ? "driver" : "software", scene.name, multiple, own,
                           left);
                if (multiple == 0.0f)
                    EXPECT_GT(own, left / 50);
                else
                    EXPECT_EQ(own, 0u);
            }
        }
    });
}

}  // namespace

}  // namespace glint::test
