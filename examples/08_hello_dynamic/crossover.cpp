#include "08_hello_dynamic/crossover.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

using namespace glint;

namespace {

constexpr int steps = 9;
constexpr int rounds = 3;
/// Beyond what the example shows: the models wind up to ropes.
constexpr float most = 4.0f * Models::strongest;

/// Runs the work to its end: its milliseconds.
template <class Work>
Expected<double> measure(Device& device, Work&& work) {
    if (Status status = device.finish(); !status) return unexpected(status.error());
    const auto begin = std::chrono::steady_clock::now();
    if (Status status = work(); !status) return unexpected(status.error());
    if (Status status = device.finish(); !status) return unexpected(status.error());
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

/// Milliseconds to bring structures up to date, and to trace them.
struct Cost {
    double build = std::numeric_limits<double>::infinity();
    double trace = std::numeric_limits<double>::infinity();
    double sum() const { return build + trace; }
};

class Measurement {
public:
    using Trace = std::function<void(Compute&, const Structures&)>;
    Measurement(Device& device, const Models& models, const Trace& trace)
        : device_(device), models_(models), trace_(trace) {}

    /// The least of some rounds.
    Status run(const Structures& structures, bool refit, bool is_recorded, Cost& cost) {
        for (int round = 0; round < rounds; round++) {
            const Expected<double> build = measure(device_, [&] {
                if (!is_recorded) return structures.build(device_, refit);
                Compute compute = device_.createCompute();
                structures.build(compute, refit);
                return device_.submit(compute);
            });
            if (!build) return build.error();
            Compute scene = device_.createCompute();
            structures.buildScene(scene, Models::instances(0.0f));
            if (Status status = device_.submit(scene); !status) return status;
            const Expected<double> trace = measure(device_, [&] {
                Compute compute = device_.createCompute();
                trace_(compute, structures);
                return device_.submit(compute);
            });
            if (!trace) return trace.error();
            cost.build = std::min(cost.build, *build);
            cost.trace = std::min(cost.trace, *trace);
        }
        return {};
    }

    Status deform(float amount) {
        Compute compute = device_.createCompute();
        models_.deform(compute, amount, 0.0f);
        return device_.submit(compute);
    }

private:
    Device& device_;
    const Models& models_;
    const Trace& trace_;
};

/// Times of two runs differ by so much for no reason.
constexpr double noise = 0.05;

/// From where on to rebuild: the plan of the least sum over all deformations, which a single odd time does not change.
/// Between two of them the crossing is interpolated. NaN: never.
double crossing(const std::vector<double>& amounts, const std::vector<Cost>& refit, const std::vector<Cost>& rebuild) {
    const auto loss = [&](size_t i) { return refit[i].sum() - (1.0 + noise) * rebuild[i].sum(); };
    size_t first = amounts.size();
    double saved = 0.0, most_saved = 0.0;
    for (size_t i = amounts.size(); i-- > 0;) {
        saved += loss(i);
        if (saved <= most_saved) continue;
        most_saved = saved;
        first = i;
    }
    if (first == amounts.size()) return std::numeric_limits<double>::quiet_NaN();
    if (first == 0) return amounts[0];
    // The plan is the best one: refitting is not dearer just before, and dearer here.
    const double share = loss(first - 1) / (loss(first - 1) - loss(first));
    return amounts[first - 1] + share * (amounts[first] - amounts[first - 1]);
}

void print(const char* how, const std::vector<double>& amounts, const std::vector<Cost>& refit,
           const std::vector<Cost>& rebuild) {
    std::printf("\n%s builds, ms\n%12s %30s %30s\n%12s %10s%10s%10s %10s%10s%10s\n", how, "", "refit", "rebuild",
                "deformation", "build", "trace", "sum", "build", "trace", "sum");
    for (size_t i = 0; i < amounts.size(); i++)
        std::printf("%12.2f %10.2f%10.2f%10.2f %10.2f%10.2f%10.2f\n", amounts[i], refit[i].build, refit[i].trace,
                    refit[i].sum(), rebuild[i].build, rebuild[i].trace, rebuild[i].sum());
    const double cross = crossing(amounts, refit, rebuild);
    if (std::isnan(cross))
        std::printf("refitting is cheaper up to %.2f, or as cheap\n", amounts.back());
    else if (cross <= 0.0)
        std::printf("rebuilding is cheaper from the start\n");
    else if (cross <= Models::strongest)
        std::printf("rebuilding is cheaper from %.2f on (%.1f s, frame %.0f)\n", cross,
                    Models::timeOf(static_cast<float>(cross)), 60.0 * Models::timeOf(static_cast<float>(cross)));
    else
        std::printf("rebuilding is cheaper from %.2f on (the example ends at %.2f)\n", cross, Models::strongest);
}

}  // namespace

Status measureCrossover(Example& example, Device& device, const Models& models,
                        const std::function<void(Compute&, const Structures&)>& trace) {
    Measurement measurement(device, models, trace);
    for (const bool is_recorded : {true, false}) {
        const std::string how = is_recorded ? "recorded" : "queued";
        if (Status status = measurement.deform(0.0f); !status) return status;
        const Structures refitted(device, models, Tracing::FlagFastTrace);
        if (refitted.error()) return refitted.error();
        const Structures rebuilt(device, models, Tracing::FlagFastBuild);
        if (rebuilt.error()) return rebuilt.error();
        // At rest, and once more of all: the first use of a shader compiles it.
        Cost untimed;
        for (const bool refit : {false, true})
            if (Status status = measurement.run(refitted, refit, is_recorded, untimed); !status) return status;
        if (Status status = measurement.run(rebuilt, false, is_recorded, untimed); !status) return status;

        std::vector<double> amounts;
        std::vector<Cost> refit(steps), rebuild(steps);
        for (size_t i = 0; i < steps; i++) {
            const float amount = most * static_cast<float>(i) / (steps - 1);
            amounts.push_back(amount);
            if (Status status = measurement.deform(amount); !status) return status;
            if (Status status = measurement.run(refitted, true, is_recorded, refit[i]); !status) return status;
            if (Status status = measurement.run(rebuilt, false, is_recorded, rebuild[i]); !status) return status;
        }
        print(is_recorded ? "recorded" : "the device's", amounts, refit, rebuild);

        auto& series = example.statistics().series;
        series["crossover.deformation"] = amounts;
        for (size_t i = 0; i < steps; i++) {
            series["crossover." + how + ".refit_build"].push_back(refit[i].build);
            series["crossover." + how + ".refit_trace"].push_back(refit[i].trace);
            series["crossover." + how + ".rebuild_build"].push_back(rebuild[i].build);
            series["crossover." + how + ".rebuild_trace"].push_back(rebuild[i].trace);
        }
        series["crossover." + how] = {crossing(amounts, refit, rebuild)};
    }
    return {};
}
