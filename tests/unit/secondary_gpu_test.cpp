// Shadow rays and mirrored rays on cases that are hard for where they start, through ray-tracing pipelines and through
// ray queries on both engines, against float64: neither acne nor leaks with the derived offset of <glint/ray.h>.

#include "support/device_fixture.h"
#include "support/secondary_judge.h"

#include <stdexcept>

namespace glint::test {

namespace {

class SecondaryRays : public DeviceTest {
protected:
    SecondaryRays() : DeviceTest("vulkan", TracingEngine::Driver) {}

    /// Each form that the device has, with the number of primary rays that suits its speed.
    template <class Body>
    void withForms(const Body& body) {
        const auto with = [&](const char* name, const Device& tracing, SecondaryForm form, uint32_t rays) {
            SCOPED_TRACE(name);
            SecondaryTracer tracer(tracing, form);
            body(tracer, rays);
        };
        const Features& features = device.getFeatures();
        if (features.has(FeatureRayTracing)) with("pipeline", device, SecondaryForm::Pipeline, 3000);
        if (features.has(FeatureComputeTracing)) with("driver's queries", device, SecondaryForm::Query, 3000);
        with("software", software(), SecondaryForm::Query, 8000);
    }

    static Device software() { return sharedDevice("vulkan", TracingEngine::Software); }
};

/// Where t_min = 1e-3 is too small: acne. Where it is too large: leaks.
bool isTooSmall(const SecondaryCase& scene) { return scene.name != "plain" && scene.name != "scaled 1e-3"; }

TEST_F(SecondaryRays, DerivedOffsetLeavesNeitherAcneNorLeaks) {
    withForms([](SecondaryTracer& tracer, uint32_t rays) {
        for (const SecondaryCase& scene : secondaryCases()) {
            SCOPED_TRACE(scene.name);
            const std::vector<SecondarySample> samples = secondarySamples(scene, rays, 1);
            tracer.load(scene, samples);
            const std::vector<SecondaryResult> results = tracer.trace(SecondaryStart::derived());
            const SecondaryJudge judge(scene, samples, results);
            const auto derived = judge.count(results);
            const auto none = judge.count(tracer.trace(SecondaryStart::derived(0.0f)));
            const auto fixed = judge.count(tracer.trace(SecondaryStart::fixed(1e-3f)));
            for (const auto kind : {&SecondaryJudge::Counts::shadow, &SecondaryJudge::Counts::mirror}) {
                SCOPED_TRACE(kind == &SecondaryJudge::Counts::shadow ? "shadow" : "mirror");
                const SecondaryCount& count = derived.*kind;
                EXPECT_EQ(count.acne, 0u) << count.first;
                EXPECT_EQ(count.strays, 0u) << count.first;
                EXPECT_EQ(count.leaks, 0u) << count.first;
                EXPECT_GT(count.rays, rays / 2);
                EXPECT_GT(count.sure, rays / 50);
                EXPECT_GT((none.*kind).acne, rays / 20);
            }
            EXPECT_GT(isTooSmall(scene) ? fixed.shadow.acne + fixed.mirror.acne : fixed.mirror.leaks, rays / 1000);
        }
    });
}

TEST_F(SecondaryRays, TheJudgeNotices) {
    constexpr uint32_t rays = 2000;
    SecondaryTracer tracer(software(), SecondaryForm::Query);
    const SecondaryCase scene = secondaryCases()[0];
    const std::vector<SecondarySample> samples = secondarySamples(scene, rays, 2);
    tracer.load(scene, samples);
    const std::vector<SecondaryResult> results = tracer.trace(SecondaryStart::derived());
    const SecondaryJudge judge(scene, samples, results);
    const auto spoiled = [&](const auto& spoil) {
        std::vector<SecondaryResult> changed = results;
        for (SecondaryResult& result : changed)
            if (result.first != SecondaryResult::none && result.shadow != SecondaryResult::not_traced) spoil(result);
        return judge.count(changed);
    };
    const auto right = judge.count(results);
    ASSERT_GT(right.shadow.rays, rays / 2u);
    EXPECT_EQ(right.shadow.first + right.mirror.first, "");

    const auto nothing =
        spoiled([](SecondaryResult& result) { result.shadow = result.mirror = SecondaryResult::none; });
    EXPECT_EQ(nothing.shadow.leaks, right.shadow.sure);
    EXPECT_EQ(nothing.shadow.lost, right.shadow.blocked);
    EXPECT_GT(nothing.mirror.leaks, right.mirror.sure * 2 / 3);

    const auto own = spoiled([](SecondaryResult& result) {
        result.shadow = result.mirror = result.first;
        result.shadow_instance = result.mirror_instance = result.instance;
    });
    EXPECT_EQ(own.shadow.acne, own.shadow.rays);

    const auto other = spoiled([&](SecondaryResult& result) {
        if (result.shadow != SecondaryResult::none)
            result.shadow = (result.shadow + 100) % static_cast<uint32_t>(scene.mesh.triangleCount());
        if (result.mirror != SecondaryResult::none)
            result.mirror = (result.mirror + 100) % static_cast<uint32_t>(scene.mesh.triangleCount());
    });
    EXPECT_GT(other.shadow.strays + other.shadow.acne, right.shadow.blocked * 9 / 10);
    EXPECT_GT(other.mirror.strays + other.mirror.acne, right.mirror.blocked / 2);
    EXPECT_GT(other.mirror.strays, other.mirror.acne);

    // Counts are of the same primary hits.
    std::vector<SecondaryResult> shifted = results;
    shifted[0].barycentrics.x += 0.5f;
    EXPECT_THROW(judge.count(shifted), std::runtime_error);
}

}  // namespace

}  // namespace glint::test
