// traversal.offset.*: where shadow rays and mirrored rays of a ray-tracing pipeline start: by multiples of the derived
// offset, and at a fixed t_min, against rays that meet what they leave and rays that miss what is near. `./dev report`
// makes the table and the chart of docs/accuracy.md from what is written.

#include "bench/example_runs.h"
#include "support/secondary_judge.h"

#include <glint/base/file.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace glint::bench {

namespace {

using test::SecondaryCount;
using test::SecondaryStart;

constexpr uint32_t primary_rays = 32768;
constexpr float fixed_nearest = 1e-3f;

double share(uint64_t part, uint64_t all) {
    return all == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(all);
}

/// Shadow rays and mirrored rays together, for each start.
std::vector<SecondaryCount> countAll(test::SecondaryTracer& tracer, const test::SecondaryCase& scene,
                                     std::span<const SecondaryStart> starts) {
    const std::vector<test::SecondarySample> samples = test::secondarySamples(scene, primary_rays, 60);
    tracer.load(scene, samples);
    const test::SecondaryJudge judge(scene, samples, tracer.trace(SecondaryStart::derived()));
    std::vector<SecondaryCount> counts;
    for (const SecondaryStart& start : starts) {
        auto [both, mirror] = judge.count(tracer.trace(start));
        both += mirror;
        counts.push_back(both);
    }
    return counts;
}

void run(Report& report) {
    const Device device = createDevice(), driver = createPipelineDevice();
    test::SecondaryTracer tracer = driver ? test::SecondaryTracer(driver, test::SecondaryForm::Pipeline)
                                          : test::SecondaryTracer(device, test::SecondaryForm::Query);

    std::vector<SecondaryStart> starts;
    for (const float multiple :
         {0.0f, 0x1p-6f, 0x1p-5f, 0x1p-4f, 0x1p-3f, 0x1p-2f, 0.5f, 1.0f, 2.0f, 4.0f, 8.0f, 16.0f, 32.0f, 64.0f})
        starts.push_back(SecondaryStart::derived(multiple));
    for (int i = -12; i <= 0; i++)
        starts.push_back(SecondaryStart::fixed(std::pow(10.0f, 0.5f * static_cast<float>(i))));
    const auto indexOf = [&](const auto& is) {
        return static_cast<size_t>(std::find_if(starts.begin(), starts.end(), is) - starts.begin());
    };
    const size_t first_fixed = indexOf([](const SecondaryStart& start) { return start.is_fixed; });
    const size_t at_bound = indexOf([](const SecondaryStart& start) { return start.multiple == 1.0f; });
    const size_t at_fixed = indexOf([](const SecondaryStart& start) {
        return start.is_fixed && std::abs(start.nearest / fixed_nearest - 1.0f) < 0.01f;
    });

    const std::vector<test::SecondaryCase> cases = test::secondaryCases();
    std::vector<std::vector<SecondaryCount>> counts;
    std::vector<SecondaryCount> all(starts.size());
    for (const test::SecondaryCase& scene : cases) {
        counts.push_back(countAll(tracer, scene, starts));
        for (size_t i = 0; i < starts.size(); i++) all[i] += counts.back()[i];
    }

    std::string table =
        fmt::format("{}; {}, {} shadow rays and mirrored rays in {} cases.\n\n", deviceName(device),
                    driver ? "the driver's ray-tracing pipeline" : "ray queries", all[0].rays, cases.size()) +
        "| case | derived offset: acne, strays, leaks | contacts lost | t_min = 1e-3: acne | leaks | contacts lost | "
        "least t_min without acne | contacts lost with that |\n"
        "|---|---|---|---|---|---|---|---|\n";
    for (size_t i = 0; i < cases.size(); i++) {
        const SecondaryCount& derived = counts[i][at_bound];
        const SecondaryCount& fixed = counts[i][at_fixed];
        size_t least = starts.size();
        while (least > first_fixed && counts[i][least - 1].acne == 0) least--;
        const bool has_least = least < starts.size();
        table += fmt::format(
            "| {} | {}, {}, {} | {:.2f} % | {:.2f} % | {:.2f} % | {:.2f} % | {} | {} |\n", cases[i].name, derived.acne,
            derived.strays, derived.leaks, 100.0 * share(derived.lost, derived.blocked),
            100.0 * share(fixed.acne, fixed.rays), 100.0 * share(fixed.leaks, fixed.sure),
            100.0 * share(fixed.lost, fixed.blocked),
            has_least ? fmt::format("{:.0e}", starts[least].nearest) : "above 1",
            has_least ? fmt::format("{:.2f} %", 100.0 * share(counts[i][least].lost, counts[i][least].blocked)) : "");
    }
    fmt::print("{}\n", table);
    check(writeTextFile(report.folder() / "offset.md", table));

    // The case's name over its three columns: shares of acne, of strays and of contacts lost.
    for (const bool is_fixed : {false, true}) {
        std::string curve = is_fixed ? "t_min" : "multiple";
        for (const test::SecondaryCase& scene : cases) curve += fmt::format(" \"{}\" strays lost", scene.name);
        curve += "\n";
        for (size_t i = is_fixed ? first_fixed : 0; i < (is_fixed ? starts.size() : first_fixed); i++) {
            curve += fmt::format("{}", is_fixed ? starts[i].nearest : starts[i].multiple);
            for (const std::vector<SecondaryCount>& each : counts)
                curve += fmt::format(" {} {} {}", share(each[i].acne, each[i].rays),
                                     share(each[i].strays, each[i].rays), share(each[i].lost, each[i].blocked));
            curve += "\n";
        }
        check(writeTextFile(report.folder() / (is_fixed ? "offset_fixed.dat" : "offset_derived.dat"), curve));
    }

    const std::string name = deviceName(device);
    const auto add = [&](const std::string& figure, uint64_t part, uint64_t of, const char* against) {
        report.add("traversal.offset." + figure, static_cast<double>(part), fmt::format("of {} rays", of), against,
                   name);
    };
    add("acne", all[at_bound].acne, all[at_bound].rays, "float64");
    add("strays", all[at_bound].strays, all[at_bound].rays, "float64");
    add("acne_fixed", all[at_fixed].acne, all[at_fixed].rays, "float64");
    add("leaks", all[at_bound].leaks, all[at_bound].sure, "float64");
    add("leaks_fixed", all[at_fixed].leaks, all[at_fixed].sure, "float64");
    add("lost", all[at_bound].lost, all[at_bound].blocked, "float64");
    add("lost_fixed", all[at_fixed].lost, all[at_fixed].blocked, "float64");
    size_t least = at_bound + 1;
    while (least > 0 && all[least - 1].acne == 0) least--;
    report.add("traversal.offset.least_multiple", starts[least].multiple, "of the bound", "no acne", name);

    // The same by ray queries.
    test::SecondaryTracer queries(device, test::SecondaryForm::Query);
    const SecondaryStart two[] = {SecondaryStart::derived(), SecondaryStart::fixed(fixed_nearest)};
    SecondaryCount sums[2];
    for (const test::SecondaryCase& scene : cases) {
        const std::vector<SecondaryCount> each = countAll(queries, scene, two);
        for (size_t i = 0; i < 2; i++) sums[i] += each[i];
    }
    for (const SecondaryCount& sum : sums)
        fmt::print("ray queries, {}: acne {} and strays {} of {}, leaks {} of {}, lost {} of {}\n",
                   &sum == sums ? "derived offset" : "t_min = 1e-3", sum.acne, sum.strays, sum.rays, sum.leaks,
                   sum.sure, sum.lost, sum.blocked);
    add("acne_query", sums[0].acne, sums[0].rays, "float64");
    add("leaks_query", sums[0].leaks, sums[0].sure, "float64");
}

}  // namespace

Benchmark traversalOffsetBenchmark() {
    return {{"traversal.offset.acne", "traversal.offset.acne_fixed", "traversal.offset.strays",
             "traversal.offset.leaks", "traversal.offset.leaks_fixed", "traversal.offset.lost",
             "traversal.offset.lost_fixed", "traversal.offset.least_multiple", "traversal.offset.acne_query",
             "traversal.offset.leaks_query"},
            run};
}

}  // namespace glint::bench
