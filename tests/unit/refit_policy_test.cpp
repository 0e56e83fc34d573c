// When 08_hello_dynamic rebuilds its structures, against the best plan made in hindsight.

#include "08_hello_dynamic/policy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace {

/// Costs of following a deformation: tracing takes `trace(frames since the last rebuild)`.
struct Costs {
    double refit, rebuild, trace, loss;
    double frame(int age) const { return (age == 0 ? rebuild : refit) + trace + loss * age; }
};

/// Total time of `frames` frames, whose times the policy hears `delay` frames later.
double totalOf(const Costs& costs, int frames, int delay, int* rebuilds = nullptr) {
    RefitPolicy policy;
    std::vector<int> ages;
    double total = 0.0;
    int heard = 0;
    for (int i = 0; i < frames; i++) {
        for (; heard < i - delay; heard++) {
            const bool rebuilt = ages[heard] == 0;
            policy.add(rebuilt, rebuilt ? costs.rebuild : costs.refit,
                       costs.frame(ages[heard]) - (rebuilt ? costs.rebuild : costs.refit));
        }
        const bool rebuild = policy.shouldRebuild();
        policy.decided(rebuild);
        ages.push_back(rebuild || ages.empty() ? 0 : ages.back() + 1);
        if (rebuilds) *rebuilds += rebuild;
        total += costs.frame(ages.back());
    }
    return total;
}

/// The least total with a rebuild every n frames.
double bestOf(const Costs& costs, int frames) {
    double best = std::numeric_limits<double>::infinity();
    for (int every = 1; every <= frames; every++) {
        double total = 0.0;
        for (int i = 0; i < frames; i++) total += costs.frame(i % every);
        best = std::min(best, total);
    }
    return best;
}

}  // namespace

TEST(RefitPolicy, IsNeverFarFromTheBestPlan) {
    for (const double loss : {0.0, 0.01, 0.1, 1.0, 10.0}) {
        const Costs costs = {.refit = 2.0, .rebuild = 10.0, .trace = 5.0, .loss = loss};
        for (const int delay : {0, 3}) {
            const double total = totalOf(costs, 1000, delay), best = bestOf(costs, 1000);
            // At most twice the cost that a plan can choose; times that come late cost up to that many frames more.
            EXPECT_LE(total, 2.0 * best + 1000.0 * loss * delay) << loss << " " << delay;
            if (delay == 0) { EXPECT_LE(total, 1.3 * best) << loss; }
        }
    }
}

TEST(RefitPolicy, Extremes) {
    // Nothing is lost: one rebuild, the first, from which it learns the cost.
    int rebuilds = 0;
    totalOf({.refit = 1, .rebuild = 10, .trace = 5, .loss = 0}, 100, 3, &rebuilds);
    EXPECT_EQ(rebuilds, 1);
    // A frame's loss is more than a rebuild costs: every other frame at least.
    rebuilds = 0;
    totalOf({.refit = 1, .rebuild = 10, .trace = 5, .loss = 100}, 100, 0, &rebuilds);
    EXPECT_GE(rebuilds, 50);
    // A rebuild that is as cheap as a refit is taken whenever its times are known.
    rebuilds = 0;
    totalOf({.refit = 10, .rebuild = 9, .trace = 5, .loss = 1}, 100, 0, &rebuilds);
    EXPECT_GE(rebuilds, 50);
}
