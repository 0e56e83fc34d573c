// sort.*, scan.*: RadixSort and PrefixScan against the standard library and against a radix sort on one core.

#include "bench/bench.h"

#include <glint/parallel/prefix_scan.h>
#include <glint/parallel/radix_sort.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <random>

namespace glint::bench {

namespace {

constexpr uint32_t rounds = 5;

struct Pair {
    uint32_t key;
    uint32_t value;
    bool operator<(const Pair& other) const { return key < other.key; }
};

/// The least-significant-digit sort of 8 bits at a time.
void sortByDigits(std::vector<Pair>& pairs, std::vector<Pair>& scratch) {
    for (uint32_t shift = 0; shift < 32; shift += 8) {
        std::array<uint32_t, 256> places = {};
        for (const Pair& pair : pairs) places[(pair.key >> shift) & 255]++;
        std::exclusive_scan(places.begin(), places.end(), places.begin(), 0u);
        for (const Pair& pair : pairs) scratch[places[(pair.key >> shift) & 255]++] = pair;
        std::swap(pairs, scratch);
    }
}

double secondsOf(const std::function<void()>& work) {
    const double begin = wallSeconds();
    work();
    return wallSeconds() - begin;
}

/// Of the list that `record` makes, with the wait for its end.
double secondsOnDevice(Device& device, const std::function<void(Compute&)>& record) {
    check(device.finish());
    return secondsOf([&] {
        Compute compute = device.createCompute();
        record(compute);
        check(device.submit(compute));
        check(device.finish());
    });
}

void compareSorts(Report& report, Device& device, const char* name, uint32_t size) {
    std::mt19937 random(1);
    std::vector<uint32_t> words(size_t{2} * size);
    std::vector<Pair> pairs(size);
    for (uint32_t i = 0; i < size; i++) {
        pairs[i] = {static_cast<uint32_t>(random()), i};
        words[i] = pairs[i].key;
        words[size + i] = i;
    }
    RadixSort sort;
    check(sort.create(device, RadixSort::FlagSingle, size));
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, words.size() * 4);
    Times ours, standard, digits;
    std::vector<Pair> sorted, scratch(size);
    for (uint32_t i = 0; i <= rounds; i++) {
        device.setBuffer(buffer, std::span(words));
        const double seconds =
            secondsOnDevice(device, [&](Compute& compute) { sort.dispatch(compute, buffer, 0, size, size); });
        // Kernels are compiled in the first round.
        if (i == 0) continue;
        ours.values.push_back(seconds);
        sorted = pairs;
        standard.values.push_back(secondsOf([&] { std::sort(sorted.begin(), sorted.end()); }));
        sorted = pairs;
        digits.values.push_back(secondsOf([&] { sortByDigits(sorted, scratch); }));
    }
    const auto result = check(device.read<uint32_t>(buffer));
    for (uint32_t i = 0; i < size; i++)
        if ((*result)[i] != sorted[i].key || (*result)[size + i] != sorted[i].value)
            throw std::runtime_error(fmt::format("sort.{}: element {} differs", name, i));
    printTimes(fmt::format("RadixSort, {} pairs", name), ours);
    printTimes("  std::sort", standard);
    printTimes("  by digits of 8 bits, one core", digits);
    report.add(fmt::format("sort.{}.over_std_sort", name), standard.median() / ours.median(), "ratio of speeds",
               "std::sort of pairs", deviceName(device));
    report.add(fmt::format("sort.{}.over_cpu_radix", name), digits.median() / ours.median(), "ratio of speeds",
               "radix sort on one core", deviceName(device));
}

void compareScans(Report& report, Device& device, const char* name, uint32_t size) {
    std::mt19937 random(1);
    std::vector<uint32_t> values(size);
    for (uint32_t& value : values) value = static_cast<uint32_t>(random());
    PrefixScan scan;
    check(scan.create(device, PrefixScan::ModeSingle));
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, values.size() * 4);
    Times ours, standard;
    std::vector<uint32_t> sums;
    for (uint32_t i = 0; i <= rounds; i++) {
        device.setBuffer(buffer, std::span(values));
        const double seconds =
            secondsOnDevice(device, [&](Compute& compute) { scan.dispatch(compute, buffer, 0, size); });
        if (i == 0) continue;
        ours.values.push_back(seconds);
        sums = values;
        standard.values.push_back(secondsOf([&] { std::exclusive_scan(sums.begin(), sums.end(), sums.begin(), 0u); }));
    }
    if (*check(device.read<uint32_t>(buffer)) != sums)
        throw std::runtime_error(fmt::format("scan.{}: sums differ", name));
    printTimes(fmt::format("PrefixScan, {}", name), ours);
    printTimes("  std::exclusive_scan", standard);
    report.add(fmt::format("scan.{}.over_std", name), standard.median() / ours.median(), "ratio of speeds",
               "std::exclusive_scan", deviceName(device));
}

}  // namespace

Benchmark parallelBenchmark() {
    return {{"sort.1m.over_std_sort", "sort.1m.over_cpu_radix", "sort.16m.over_std_sort", "sort.16m.over_cpu_radix",
             "scan.1m.over_std", "scan.16m.over_std"},
            [](Report& report) {
                Device device = createDevice();
                compareSorts(report, device, "1m", 1u << 20);
                compareSorts(report, device, "16m", 1u << 24);
                compareScans(report, device, "1m", 1u << 20);
                compareScans(report, device, "16m", 1u << 24);
            }};
}

}  // namespace glint::bench
