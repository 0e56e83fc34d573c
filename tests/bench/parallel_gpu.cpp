// {sort,scan}.{1m,4m,16m}.over_cub: RadixSort and PrefixScan against CUB on the same GPU, whose times cub/cub.cu writes
// to the file that $GLINT_CUB names; both by the device's clock. sort.regions.over_one: pairs a second in tens of
// thousands of regions with a large one among them, over those in one region.

#include "bench/bench.h"

#include <glint/parallel/prefix_scan.h>
#include <glint/parallel/radix_sort.h>

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <random>

namespace glint::bench {

namespace {

constexpr uint32_t rounds = 31;
/// GPUs that idle at a fraction of their clock take so long to come up to it.
constexpr double warm_up_seconds = 0.5;

/// Milliseconds by name.
std::map<std::string, double> readTimes(const char* path) {
    std::map<std::string, double> times;
    std::ifstream file(path);
    std::string name;
    for (double time = 0.0; file >> name >> time;) times[name] = time;
    if (times.empty()) throw std::runtime_error(fmt::format("GLINT_CUB: '{}' holds no times", path));
    return times;
}

std::vector<uint32_t> randomWords(size_t count) {
    std::mt19937 random(1);
    std::vector<uint32_t> words(count);
    for (uint32_t& word : words) word = static_cast<uint32_t>(random());
    return words;
}

/// Seconds of what `record` does to a buffer that holds `words` each time.
Times timeOnDevice(Device& device, std::span<const uint32_t> words,
                   const std::function<void(Compute&, const Buffer&)>& record) {
    const Buffer fresh = device.createBuffer(Buffer::FlagStorage, words);
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, words.size_bytes());
    const Query query = device.createQuery(Query::TypeTime);
    const auto play = [&] {
        Compute compute = device.createCompute();
        compute.copyBuffer(buffer, 0, fresh, 0, words.size_bytes());
        compute.beginQuery(query);
        record(compute, buffer);
        compute.endQuery(query);
        check(device.submit(compute));
        check(device.finish());
        return static_cast<double>(*check(device.getTime(query))) * 1e-9;
    };
    const double begin = wallSeconds();
    while (wallSeconds() - begin < warm_up_seconds) play();
    Times times;
    for (uint32_t i = 0; i < rounds; i++) times.values.push_back(play());
    return times;
}

void compareSize(Report& report, Device& device, const std::map<std::string, double>& cub, const char* name,
                 uint32_t size) {
    const std::vector<uint32_t> words = randomWords(size_t{2} * size);
    const auto add = [&](const std::string& figure, const std::string& other, const Times& times) {
        printTimes(fmt::format("{}, {:.1f} billion a second", figure, size / times.median() * 1e-9), times);
        if (const auto found = cub.find(other); found != cub.end())
            report.add(figure + ".over_cub", found->second * 1e-3 / times.median(), "ratio of speeds", "CUB",
                       deviceName(device));
    };
    RadixSort sort;
    check(sort.create(device, RadixSort::FlagSingle, size));
    for (const uint32_t bits : {32u, 16u})
        add(fmt::format("sort.{}{}", name, bits == 32 ? "" : ".16bits"), fmt::format("sort.{}.{}bits", name, bits),
            timeOnDevice(device, words, [&](Compute& compute, const Buffer& buffer) {
                sort.dispatch(compute, buffer, 0, size, size, bits);
            }));
    PrefixScan scan;
    check(scan.create(device, PrefixScan::ModeSingle));
    add(fmt::format("scan.{}", name), fmt::format("scan.{}", name),
        timeOnDevice(device, std::span(words).first(size),
                     [&](Compute& compute, const Buffer& buffer) { scan.dispatch(compute, buffer, 0, size); }));
}

void compareRegions(Report& report, Device& device) {
    std::mt19937 random(2);
    std::vector<RadixSort::Region> regions(30000);
    uint32_t end = 0;
    for (size_t i = 0; i < regions.size(); i++) {
        const uint32_t size = i == 12345 ? 1000000 : static_cast<uint32_t>(random() % 4097) >> random() % 8;
        regions[i] = {end, end + size, size, 0};
        end += 2 * size;
    }
    const std::vector<uint32_t> words = randomWords(end);
    const Buffer where = device.createBuffer(Buffer::FlagStorage, std::span(regions));
    RadixSort sort;
    check(sort.create(device, RadixSort::FlagSingle | RadixSort::FlagMultiple, end / 2));
    const Times many = timeOnDevice(device, words, [&](Compute& compute, const Buffer& buffer) {
        sort.dispatchIndirect(compute, buffer, static_cast<uint32_t>(regions.size()), where);
    });
    const Times one = timeOnDevice(device, words, [&](Compute& compute, const Buffer& buffer) {
        sort.dispatch(compute, buffer, 0, end / 2, end / 2);
    });
    printTimes(fmt::format("sort.regions: {} pairs in {} regions", end / 2, regions.size()), many);
    printTimes("  in one region", one);
    report.add("sort.regions.over_one", one.median() / many.median(), "ratio of speeds", "one region",
               deviceName(device));
}

}  // namespace

Benchmark parallelGpuBenchmark() {
    std::vector<std::string> figures = {"sort.regions.over_one"};
    for (const char* name : {"1m", "4m", "16m"})
        for (const char* figure : {"sort.{}.over_cub", "sort.{}.16bits.over_cub", "scan.{}.over_cub"})
            figures.push_back(fmt::format(fmt::runtime(figure), name));
    return {figures, [](Report& report) {
                Device device = createDevice();
                if (!device.getFeatures().has(FeatureTimestamps)) {
                    fmt::print("sort and scan by the device's clock: it has none\n");
                    return;
                }
                compareRegions(report, device);
                const char* const path = std::getenv("GLINT_CUB");
                if (device.getInfo().cpu || !path) {
                    fmt::print("sort and scan over CUB: for GPUs, with CUB's times in the file $GLINT_CUB names\n");
                    return;
                }
                const std::map<std::string, double> cub = readTimes(path);
                compareSize(report, device, cub, "1m", 1u << 20);
                compareSize(report, device, cub, "4m", 1u << 22);
                compareSize(report, device, cub, "16m", 1u << 24);
            }};
}

}  // namespace glint::bench
