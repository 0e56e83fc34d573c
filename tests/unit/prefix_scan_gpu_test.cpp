// PrefixScan against std::exclusive_scan.

#include "support/kernel_values.h"
#include "support/reference.h"

#include <glint/parallel/prefix_scan.h>

#include <numeric>
#include <random>

namespace glint::test {

namespace {

using Region = PrefixScan::Region;

std::vector<uint32_t> randomValues(size_t count, uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<uint32_t> values(count);
    // All bits, so that sums wrap.
    for (uint32_t& value : values) value = static_cast<uint32_t>(random());
    return values;
}

void scanOnHost(std::vector<uint32_t>& values, std::span<const Region> regions) {
    for (const Region& region : regions) {
        const auto begin = values.begin() + region.offset;
        std::exclusive_scan(begin, begin + region.size, begin, 0u);
    }
}

/// Regions of these sizes, with gaps of 0 to 4 elements.
std::vector<Region> layOut(std::span<const uint32_t> sizes, uint32_t& end) {
    std::mt19937 random(3);
    std::vector<Region> regions;
    end = 0;
    for (const uint32_t size : sizes) {
        end += static_cast<uint32_t>(random() % 5);
        regions.push_back({end, size, {}});
        end += size;
    }
    end += 3;
    return regions;
}

class PrefixScanTest : public DeviceTest {
protected:
    void expectSingle(const PrefixScan& scan, uint32_t offset, uint32_t size) {
        SCOPED_TRACE(size);
        std::vector<uint32_t> values = randomValues(offset + size + 2, size);
        const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values));
        Compute compute = device.createCompute();
        scan.dispatch(compute, buffer, offset, size);
        ASSERT_THAT(device.submit(compute), IsOk());
        const Region region = {offset, size, {}};
        scanOnHost(values, std::span(&region, 1));
        expectValues(device, buffer, values);
    }
};

using PrefixScanLong = PrefixScanTest;

}  // namespace

TEST_F(PrefixScanTest, EqualsTheStandardScanInOneRegion) {
    PrefixScan scan;
    ASSERT_THAT(scan.create(device, PrefixScan::ModeSingle), IsOk());
    for (uint32_t k = 0; k <= 20; k++)
        for (const uint32_t size : {(1u << k) - 1, 1u << k, (1u << k) + 1}) expectSingle(scan, k % 3, size);
    EXPECT_THAT(scan.check(), IsOk());
}

TEST_F(PrefixScanLong, EqualsTheStandardScanInLargeRegions) {
    PrefixScan scan;
    ASSERT_THAT(scan.create(device, PrefixScan::ModeSingle), IsOk());
    for (uint32_t k = 21; k <= 24; k++)
        for (const uint32_t size : {(1u << k) - 1, 1u << k, (1u << k) + 1}) expectSingle(scan, 1, size);
}

TEST_F(PrefixScanTest, TakesEverySizeInOneList) {
    std::vector<uint32_t> sizes(4100);
    std::iota(sizes.begin(), sizes.end(), 0u);
    uint32_t end = 0;
    const std::vector<Region> regions = layOut(sizes, end);
    std::vector<uint32_t> values = randomValues(end, 1);
    std::vector<uint32_t> expected = values;
    scanOnHost(expected, regions);

    PrefixScan many;
    ASSERT_THAT(many.create(device, PrefixScan::ModeMultiple, 0, 4100), IsOk());
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values));
    Compute compute = device.createCompute();
    many.dispatch(compute, buffer, regions);
    ASSERT_THAT(device.submit(compute), IsOk());
    expectValues(device, buffer, expected);

    // The same sizes one by one, with few groups, so that sizes below and above a group's share occur.
    PrefixScan single;
    ASSERT_THAT(single.create(device, PrefixScan::ModeSingle, 2), IsOk());
    const Buffer again = device.createBuffer(Buffer::FlagStorage, std::span(values));
    Compute list = device.createCompute();
    for (const Region& region : regions) single.dispatch(list, again, region.offset, region.size);
    ASSERT_THAT(device.submit(list), IsOk());
    expectValues(device, again, expected);
    EXPECT_THAT(many.check(), IsOk());
    EXPECT_THAT(single.check(), IsOk());
}

TEST_F(PrefixScanTest, TakesRegionsFromTheDevice) {
    std::mt19937 random(5);
    std::vector<uint32_t> sizes(300);
    for (uint32_t& size : sizes) size = static_cast<uint32_t>(random() % 3000);
    uint32_t end = 0;
    const std::vector<Region> regions = layOut(sizes, end);
    const std::vector<uint32_t> values = randomValues(end, 2);
    const std::vector<uint32_t> counts = {7, 200, 0};
    const Buffer where = device.createBuffer(Buffer::FlagStorage, std::span(regions));
    const Buffer how_many = device.createBuffer(Buffer::FlagStorage, std::span(counts));
    PrefixScan scan;
    ASSERT_THAT(scan.create(device, PrefixScan::ModeMultiple), IsOk());
    const auto expectFrom = [&](size_t first, size_t count, const auto& record) {
        const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values));
        Compute compute = device.createCompute();
        record(compute, buffer);
        ASSERT_THAT(device.submit(compute), IsOk());
        std::vector<uint32_t> expected = values;
        scanOnHost(expected, std::span(regions).subspan(first, count));
        expectValues(device, buffer, expected);
    };
    expectFrom(4, 1, [&](Compute& c, const Buffer& b) { scan.dispatchIndirect(c, b, where, 64); });
    expectFrom(4, 96, [&](Compute& c, const Buffer& b) { scan.dispatchIndirect(c, b, 96, where, 64); });
    expectFrom(4, 200, [&](Compute& c, const Buffer& b) { scan.dispatchIndirect(c, b, how_many, where, 4, 64); });
    expectFrom(4, 0, [&](Compute& c, const Buffer& b) { scan.dispatchIndirect(c, b, how_many, where, 8, 64); });
    ASSERT_THAT(scan.create(device, PrefixScan::ModeSingle), IsOk());
    expectFrom(9, 1, [&](Compute& c, const Buffer& b) { scan.dispatchIndirect(c, b, where, 144); });
    EXPECT_THAT(scan.check(), IsOk());
}

TEST_F(PrefixScanTest, LeavesWhatTheDeviceGetsWrong) {
    const std::vector<uint32_t> values = randomValues(1000, 4);
    const std::vector<Region> wrong = {{0, 1001, {}}, {1000, 1, {}}, {~0u, 2, {}}, {999, ~0u, {}}, {500, 400, {}}};
    const std::vector<uint32_t> counts = {6};
    std::vector<uint32_t> expected = values;
    scanOnHost(expected, std::span(wrong).last(1));
    const Buffer regions = device.createBuffer(Buffer::FlagStorage, std::span(wrong));
    const Buffer how_many = device.createBuffer(Buffer::FlagStorage, std::span(counts));
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values));
    PrefixScan scan;
    ASSERT_THAT(scan.create(device, PrefixScan::ModeMultiple), IsOk());
    Compute compute = device.createCompute();
    scan.dispatchIndirect(compute, buffer, 5, regions);
    ASSERT_THAT(device.submit(compute), IsOk());
    expectValues(device, buffer, expected);
    EXPECT_THAT(scan.check(), HasErrorId("parallel.outside"));
    EXPECT_THAT(scan.check(), IsOk());

    Compute counted = device.createCompute();
    scan.dispatchIndirect(counted, buffer, how_many, regions, 0, 64);
    ASSERT_THAT(device.submit(counted), IsOk());
    EXPECT_THAT(scan.check(), HasErrorId("parallel.count"));

    ASSERT_THAT(scan.create(device, PrefixScan::ModeSingle), IsOk());
    const Buffer other = device.createBuffer(Buffer::FlagStorage, std::span(values));
    Compute single = device.createCompute();
    scan.dispatchIndirect(single, other, regions);
    ASSERT_THAT(device.submit(single), IsOk());
    expectValues(device, other, values);
    EXPECT_THAT(scan.check(), HasErrorId("parallel.outside"));
}

TEST_F(PrefixScanTest, SaysWhatIsWrong) {
    PrefixScan scan, many;
    ASSERT_THAT(scan.create(device, PrefixScan::ModeSingle), IsOk());
    ASSERT_THAT(many.create(device, PrefixScan::ModeMultiple, 0, 2), IsOk());
    EXPECT_THAT(PrefixScan().create(device, PrefixScan::ModeSingle, 0, 0), HasErrorId("parallel.regions"));
    EXPECT_THAT(PrefixScan().create(Device(), PrefixScan::ModeSingle), HasErrorId("handle.null"));
    const Buffer data = device.createBuffer(Buffer::FlagStorage, 400, "values");
    const Buffer regions = device.createBuffer(Buffer::FlagStorage, 40, "regions");
    const std::vector<Region> three(3);
    const auto expectFailure = [&](std::string_view id, const auto& record) {
        Compute compute = device.createCompute();
        record(compute);
        EXPECT_THAT(compute.error(), HasErrorId(std::string(id)));
        expectTold(id);
    };
    expectFailure("handle.null", [&](Compute& c) { PrefixScan().dispatch(c, data, 0, 1); });
    expectFailure("handle.null", [&](Compute& c) { scan.dispatch(c, Buffer(), 0, 1); });
    expectFailure("parallel.range", [&](Compute& c) { scan.dispatch(c, data, 0, 101); });
    expectFailure("parallel.range", [&](Compute& c) { scan.dispatch(c, data, ~0u, 2); });
    expectFailure("parallel.mode", [&](Compute& c) { scan.dispatch(c, data, three); });
    expectFailure("parallel.mode", [&](Compute& c) { scan.dispatchIndirect(c, data, 2, regions); });
    expectFailure("parallel.regions", [&](Compute& c) { many.dispatch(c, data, three); });
    expectFailure("parallel.indirect", [&](Compute& c) { many.dispatchIndirect(c, data, 3, regions); });
    expectFailure("parallel.indirect", [&](Compute& c) { many.dispatchIndirect(c, data, regions, 2); });
    expectFailure("parallel.indirect", [&](Compute& c) { many.dispatchIndirect(c, data, regions, regions, 40, 0); });
    expectFailure("parallel.indirect", [&](Compute& c) { many.dispatchIndirect(c, data, regions, regions, 0, 28); });
    expectFailure("handle.null", [&](Compute& c) { many.dispatchIndirect(c, data, Buffer(), regions, 0, 0); });
    expectFailure("handle.null", [&](Compute& c) { many.dispatchIndirect(c, data, Buffer()); });
}

}  // namespace glint::test
