// RadixSort against std::stable_sort.

#include "support/kernel_values.h"

#include <glint/parallel/radix_sort.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <optional>
#include <random>
#include <string>

namespace glint::test {

namespace {

using Region = RadixSort::Region;

enum class Keys : uint8_t { Equal, Sorted, Reversed, Random, Few };
constexpr Keys all_keys[] = {Keys::Equal, Keys::Sorted, Keys::Reversed, Keys::Random, Keys::Few};

/// Values for a whole buffer: keys of a kind wherever a region has them.
std::vector<uint32_t> makeValues(size_t count, Keys kind, uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<uint32_t> values(count);
    for (size_t i = 0; i < count; i++) {
        const auto any = static_cast<uint32_t>(random());
        values[i] = kind == Keys::Equal      ? 0x9e3779b9u
                    : kind == Keys::Sorted   ? static_cast<uint32_t>(i * 251)
                    : kind == Keys::Reversed ? ~static_cast<uint32_t>(i * 251)
                    : kind == Keys::Random   ? any
                                             : (any % 5) * 0x33333333u;
    }
    return values;
}

/// What a sort should leave in a buffer.
void sortOnHost(std::vector<uint32_t>& values, std::span<const Region> regions, RadixSort::Flags flags, uint32_t bits) {
    const uint32_t mask = ~0u >> (32 - bits);
    for (const Region& region : regions) {
        std::vector<uint32_t> order(region.size);
        std::iota(order.begin(), order.end(), 0u);
        const uint32_t* keys = values.data() + region.keys;
        std::stable_sort(order.begin(), order.end(),
                         [&](uint32_t a, uint32_t b) { return (keys[a] & mask) < (keys[b] & mask); });
        const std::vector<uint32_t> before = values;
        for (uint32_t i = 0; i < region.size; i++) {
            values[region.keys + i] = before[region.keys + order[i]];
            if (flags & RadixSort::FlagKeys) continue;
            values[region.payload + i] = flags & RadixSort::FlagOrder ? order[i] : before[region.payload + order[i]];
        }
    }
}

/// The same for many regions, without copying all the values for each.
void sortManyOnHost(std::vector<uint32_t>& values, std::span<const Region> regions, uint32_t bits,
                    RadixSort::Flags flags = 0) {
    for (const Region& region : regions) {
        std::vector<uint32_t> part(values.begin() + region.keys, values.begin() + region.keys + region.size);
        part.insert(part.end(), values.begin() + region.payload, values.begin() + region.payload + region.size);
        const Region own = {0, region.size, region.size, 0};
        sortOnHost(part, std::span(&own, 1), flags, bits);
        std::copy_n(part.begin(), region.size, values.begin() + region.keys);
        std::copy_n(part.begin() + region.size, region.size, values.begin() + region.payload);
    }
}

/// Lengths of regions as scenes have them: most are short, a few are long, some are empty.
uint32_t anySize(std::mt19937& random, uint32_t most) {
    const auto kind = random() % 100;
    const uint32_t limit = kind < 10 ? 2 : kind < 85 ? 300 : kind < 98 ? 5000 : most;
    return static_cast<uint32_t>(random() % limit);
}

/// Keys and payloads of these sizes, with gaps of 0 to 4 elements.
std::vector<Region> layOut(std::span<const uint32_t> sizes, uint32_t& end) {
    std::mt19937 random(3);
    std::vector<Region> regions;
    end = 0;
    for (const uint32_t size : sizes) {
        const uint32_t keys = end + static_cast<uint32_t>(random() % 5);
        const uint32_t payload = keys + size + static_cast<uint32_t>(random() % 5);
        regions.push_back({keys, payload, size, 0});
        end = payload + size;
    }
    end += 3;
    return regions;
}

/// $GLINT_PARALLEL for as long as it lives.
class Form {
public:
    explicit Form(const char* name) {
        if (const char* const value = std::getenv("GLINT_PARALLEL")) before_ = value;
        setenv("GLINT_PARALLEL", name, 1);
    }
    ~Form() {
        if (before_)
            setenv("GLINT_PARALLEL", before_->c_str(), 1);
        else
            unsetenv("GLINT_PARALLEL");
    }
    Form(const Form&) = delete;
    Form& operator=(const Form&) = delete;

private:
    std::optional<std::string> before_;
};

class RadixSortTest : public DeviceTest {
protected:
    void expectSingle(const RadixSort& sort, RadixSort::Flags flags, uint32_t size, Keys kind, uint32_t bits = 32) {
        SCOPED_TRACE(testing::Message() << size << " keys of kind " << static_cast<int>(kind) << ", " << bits
                                        << " bits");
        const bool has_payload = (flags & RadixSort::FlagKeys) == 0;
        const size_t words = (has_payload ? size_t{2} : size_t{1}) * size;
        // Between gaps, unless they are what the device cannot bind.
        const bool has_gaps = (words + 9) * 4 <= device.getFeatures().maxStorageSize;
        if (words * 4 > device.getFeatures().maxStorageSize) return;
        std::vector<uint32_t> values = makeValues(words + (has_gaps ? 9 : 0), kind, size);
        const Region region = has_gaps ? Region{size % 3, size + 5, size, 0} : Region{0, size, size, 0};
        const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values));
        Compute compute = device.createCompute();
        sort.dispatch(compute, buffer, region.keys, region.payload, size, bits);
        ASSERT_THAT(device.submit(compute), IsOk());
        sortOnHost(values, std::span(&region, 1), flags, bits);
        expectValues(device, buffer, values);
    }

    /// Regions that do not overlap, of any length, by any number of bits, with any flags, from host or device.
    void expectAnything(uint32_t seed) {
        std::mt19937 random(seed);
        const RadixSort::Flags payloads[] = {0u, RadixSort::FlagKeys, RadixSort::FlagOrder};
        const RadixSort::Flags flags =
            RadixSort::FlagMultiple | payloads[random() % 3] | (random() % 2 ? RadixSort::FlagSingle : 0u);
        const auto bits = static_cast<uint32_t>(1 + random() % 32);
        std::vector<uint32_t> sizes(random() % 200);
        for (uint32_t& size : sizes) size = anySize(random, 70000);
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", flags " << flags << ", " << bits << " bits, "
                                        << sizes.size() << " regions");
        uint32_t end = 0;
        const std::vector<Region> regions = layOut(sizes, end);
        const uint32_t all = std::accumulate(sizes.begin(), sizes.end(), 0u);
        std::vector<uint32_t> values = makeValues(end, all_keys[random() % 5], seed);
        const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values));
        RadixSort sort;
        ASSERT_THAT(sort.create(device, flags, all + 1, static_cast<uint32_t>(random() % 3 * 40), 200), IsOk());
        Compute compute = device.createCompute();
        if (random() % 2 || sizes.empty()) {
            sort.dispatch(compute, buffer, regions, bits);
        } else {
            const Buffer where = device.createBuffer(Buffer::FlagStorage, std::span(regions));
            const std::vector<uint32_t> count = {static_cast<uint32_t>(sizes.size())};
            const Buffer how_many = device.createBuffer(Buffer::FlagStorage, std::span(count));
            sort.dispatchIndirect(compute, buffer, how_many, where, 0, 0, bits);
        }
        ASSERT_THAT(device.submit(compute), IsOk());
        sortManyOnHost(values, regions, bits, flags);
        expectValues(device, buffer, values);
        EXPECT_THAT(sort.check(), IsOk());
    }
};

using RadixSortLong = RadixSortTest;

}  // namespace

TEST_F(RadixSortTest, EqualsTheStandardSortInOneRegion) {
    RadixSort sort;
    ASSERT_THAT(sort.create(device, RadixSort::FlagSingle, (1u << 20) + 1), IsOk());
    for (uint32_t k = 0; k <= 20; k++)
        for (const uint32_t size : {(1u << k) - 1, 1u << k, (1u << k) + 1})
            for (const Keys kind : all_keys)
                if (k <= 10 || (k + static_cast<uint32_t>(kind)) % 5 == 0)
                    expectSingle(sort, RadixSort::FlagSingle, size, kind);
    EXPECT_THAT(sort.check(), IsOk());
}

TEST_F(RadixSortLong, EqualsTheStandardSortInLargeRegions) {
    for (const RadixSort::Flags flags : {RadixSort::FlagSingle | 0u, RadixSort::FlagSingle | RadixSort::FlagKeys}) {
        const uint64_t most = device.getFeatures().maxStorageSize / (flags & RadixSort::FlagKeys ? 4 : 8);
        RadixSort sort;
        ASSERT_THAT(sort.create(device, flags, static_cast<uint32_t>(std::min<uint64_t>(most, (1u << 24) + 1))),
                    IsOk());
        for (uint32_t k = 21; k <= 24; k++)
            for (const uint32_t size : {(1u << k) - 1, 1u << k, (1u << k) + 1})
                expectSingle(sort, flags, size, all_keys[(size + k) % 5]);
        for (const Keys kind : all_keys) expectSingle(sort, flags, 1u << 24, kind);
    }
}

TEST_F(RadixSortLong, EqualsTheStandardSortAtEverySize) {
    std::vector<uint32_t> sizes(4100);
    std::iota(sizes.begin(), sizes.end(), 0u);
    uint32_t end = 0;
    const std::vector<Region> regions = layOut(sizes, end);
    std::vector<uint32_t> values = makeValues(end, Keys::Random, 1);
    RadixSort sort;
    ASSERT_THAT(sort.create(device, RadixSort::FlagSingle, 4099), IsOk());
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values));
    for (size_t first = 0; first < regions.size(); first += 100) {
        Compute compute = device.createCompute();
        for (size_t i = first; i < first + 100; i++)
            sort.dispatch(compute, buffer, regions[i].keys, regions[i].payload, regions[i].size);
        ASSERT_THAT(device.submit(compute), IsOk());
    }
    sortManyOnHost(values, regions, 32);
    expectValues(device, buffer, values);
    EXPECT_THAT(sort.check(), IsOk());
}

TEST_F(RadixSortTest, TakesAnyNumberOfBitsWithAndWithoutPayloads) {
    for (const RadixSort::Flags way : {RadixSort::FlagSingle, RadixSort::FlagMultiple})
        for (const RadixSort::Flags payload : {0u, RadixSort::FlagKeys | 0u, RadixSort::FlagOrder | 0u}) {
            SCOPED_TRACE(testing::Message() << "flags " << (way | payload));
            RadixSort sort;
            ASSERT_THAT(sort.create(device, way | payload, 9000), IsOk());
            for (const uint32_t bits : {1u, 8u, 12u, 31u})
                for (const uint32_t size : {1u, 9000u}) expectSingle(sort, way | payload, size, Keys::Random, bits);
            EXPECT_THAT(sort.check(), IsOk());
        }
}

TEST_F(RadixSortTest, CountsTilesThatSayNothing) {
    // Two of three tiles of a sweep, the first one among them.
    const Form form("silent");
    RadixSort sort;
    ASSERT_THAT(sort.create(device, RadixSort::FlagSingle, 20000), IsOk());
    for (const uint32_t size : {1u, 128u, 129u, 4097u, 20000u})
        expectSingle(sort, RadixSort::FlagSingle, size, size % 2 ? Keys::Few : Keys::Random);
    EXPECT_THAT(sort.check(), IsOk());
}

TEST_F(RadixSortTest, WritesNothingOutsideOfPayloadsOverKeys) {
    // A sweep counts all digits before the first pass. The payloads of the largest keys, which come first, end up over
    // keys after two passes: their highest digit is larger than all that were counted.
    std::vector<uint32_t> values(10000, 0x01010101u);
    std::fill_n(values.begin() + 2000, 500, 0xff010101u);
    std::fill_n(values.begin() + 2500, 500, 0x02020202u);
    const std::vector<Region> overlapping = {{2500, 2000, 6000, 0}};
    const Buffer regions = device.createBuffer(Buffer::FlagStorage, std::span(overlapping));
    for (const char* name : {"sweep", "silent"}) {
        const Form form(name);
        RadixSort sort;
        ASSERT_THAT(sort.create(device, RadixSort::FlagSingle, 6000), IsOk());
        const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values));
        Compute compute = device.createCompute();
        sort.dispatchIndirect(compute, buffer, regions);
        ASSERT_THAT(device.submit(compute), IsOk());
        const auto after = device.read<uint32_t>(buffer);
        ASSERT_TRUE(after) << after.error().text();
        EXPECT_TRUE(std::equal(values.begin(), values.begin() + 2000, after->begin()));
        EXPECT_TRUE(std::equal(values.begin() + 8500, values.end(), after->begin() + 8500));
        EXPECT_THAT(sort.check(), IsOk());
    }
}

TEST_F(RadixSortTest, TakesMoreThanASweepHasWordsFor) {
    // On a CPU, whose tiles are short, the table of a sweep takes more than scratch memory, which is all it binds.
    const uint64_t most = device.getFeatures().maxStorageSize / 8;
    if (most > 1u << 27) GTEST_SKIP() << "scratch memory of " << most * 8 << " bytes";
    const Form form("sweep");
    RadixSort sort;
    ASSERT_THAT(sort.create(device, RadixSort::FlagSingle, static_cast<uint32_t>(most)), IsOk());
    for (const uint32_t size : {1u, 9000u}) expectSingle(sort, RadixSort::FlagSingle, size, Keys::Random);
    EXPECT_THAT(sort.check(), IsOk());
}

TEST_F(RadixSortTest, TakesEverySizeInOneList) {
    std::vector<uint32_t> sizes(4100);
    std::iota(sizes.begin(), sizes.end(), 0u);
    std::shuffle(sizes.begin(), sizes.end(), std::mt19937(9));
    uint32_t end = 0;
    const std::vector<Region> regions = layOut(sizes, end);
    const uint32_t all = std::accumulate(sizes.begin(), sizes.end(), 0u);
    RadixSort sort;
    ASSERT_THAT(sort.create(device, RadixSort::FlagMultiple, all, 0, 4100), IsOk());
    std::vector<uint32_t> values = makeValues(end, Keys::Random, 1);
    for (const Region& region : regions) {
        const std::vector<uint32_t> keys = makeValues(region.size, all_keys[region.size % 5], region.size);
        std::copy(keys.begin(), keys.end(), values.begin() + region.keys);
    }
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values));
    Compute compute = device.createCompute();
    sort.dispatch(compute, buffer, regions);
    ASSERT_THAT(device.submit(compute), IsOk());
    sortManyOnHost(values, regions, 32);
    expectValues(device, buffer, values);
    EXPECT_THAT(sort.check(), IsOk());
}

TEST_F(RadixSortTest, TakesRegionsOfAnyLength) {
    for (uint32_t seed = 1; seed <= 6; seed++) expectAnything(seed);
}

TEST_F(RadixSortLong, TakesManyRegionsOfAnyLength) {
    for (uint32_t seed = 100; seed < 200; seed++) expectAnything(seed);
}

TEST_F(RadixSortLong, TakesTensOfThousandsOfRegionsAndALargeOne) {
    std::mt19937 random(8);
    std::vector<uint32_t> sizes(30000);
    for (uint32_t& size : sizes) size = static_cast<uint32_t>(random() % 4097) >> random() % 8;
    sizes[12345] = 1000000;
    uint32_t end = 0;
    const std::vector<Region> regions = layOut(sizes, end);
    std::vector<uint32_t> values = makeValues(end, Keys::Random, 3);
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values));
    const Buffer where = device.createBuffer(Buffer::FlagStorage, std::span(regions));
    RadixSort sort;
    // Small regions need no scratch memory.
    ASSERT_THAT(sort.create(device, RadixSort::FlagMultiple, 1000000), IsOk());
    Compute compute = device.createCompute();
    sort.dispatchIndirect(compute, buffer, 30000, where);
    ASSERT_THAT(device.submit(compute), IsOk());
    sortManyOnHost(values, regions, 32);
    expectValues(device, buffer, values);
    EXPECT_THAT(sort.check(), IsOk());
}

TEST_F(RadixSortTest, TakesRegionsFromTheDevice) {
    std::mt19937 random(5);
    std::vector<uint32_t> sizes(300);
    for (uint32_t& size : sizes) size = static_cast<uint32_t>(random() % 700);
    uint32_t end = 0;
    const std::vector<Region> regions = layOut(sizes, end);
    const std::vector<uint32_t> values = makeValues(end, Keys::Random, 2);
    const std::vector<uint32_t> counts = {7, 200, 0};
    const Buffer where = device.createBuffer(Buffer::FlagStorage, std::span(regions));
    const Buffer how_many = device.createBuffer(Buffer::FlagStorage, std::span(counts));
    RadixSort sort;
    const auto expectFrom = [&](size_t first, size_t count, const auto& record) {
        const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values));
        Compute compute = device.createCompute();
        record(compute, buffer);
        ASSERT_THAT(device.submit(compute), IsOk());
        std::vector<uint32_t> expected = values;
        sortManyOnHost(expected, std::span(regions).subspan(first, count), 32);
        expectValues(device, buffer, expected);
    };
    for (const RadixSort::Flags flags :
         {RadixSort::FlagMultiple | 0u, RadixSort::FlagSingle | RadixSort::FlagMultiple}) {
        ASSERT_THAT(sort.create(device, flags, end), IsOk());
        expectFrom(4, 1, [&](Compute& c, const Buffer& b) { sort.dispatchIndirect(c, b, where, 64); });
        expectFrom(4, 96, [&](Compute& c, const Buffer& b) { sort.dispatchIndirect(c, b, 96, where, 64); });
        expectFrom(4, 200, [&](Compute& c, const Buffer& b) { sort.dispatchIndirect(c, b, how_many, where, 4, 64); });
        expectFrom(4, 0, [&](Compute& c, const Buffer& b) { sort.dispatchIndirect(c, b, how_many, where, 8, 64); });
        EXPECT_THAT(sort.check(), IsOk());
    }
}

TEST_F(RadixSortTest, OrdersFloats) {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<float> sorted = {-nan, -infinity, -3e38f, -1.0f, -1e-38f, -1e-45f,  -0.0f,
                                       0.0f, 1e-45f,    1e-38f, 1.0f,  3e38f,   infinity, nan};
    std::vector<uint32_t> keys;
    for (const float value : sorted) keys.push_back(sortKey(value));
    EXPECT_TRUE(std::is_sorted(keys.begin(), keys.end()));
    std::vector<uint32_t> shuffled = keys;
    std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(1));
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(shuffled));
    RadixSort sort;
    ASSERT_THAT(sort.create(device, RadixSort::FlagSingle | RadixSort::FlagKeys, 14), IsOk());
    Compute compute = device.createCompute();
    sort.dispatch(compute, buffer, 0, 0, 14);
    ASSERT_THAT(device.submit(compute), IsOk());
    expectValues(device, buffer, keys);
    for (const float value : sorted)
        EXPECT_EQ(std::bit_cast<uint32_t>(sortValue(sortKey(value))), std::bit_cast<uint32_t>(value));

    // Shaders make the same keys, here of floats that every device keeps as they are.
    const std::vector<float> normal = {-infinity, -3e38f, -1.0f, -0.0f, 0.0f, 1.0f, 3e38f, infinity};
    Kernel kernel = device.createKernel();
    kernel.createShaderGLSL(R"(
#include <glint/parallel/key.h>
layout(local_size_x = 8) in;
layout(binding = 0) readonly buffer Floats { float floats[]; };
layout(binding = 1) writeonly buffer Keys { uint keys[]; };
void main() {
    const uint i = gl_GlobalInvocationID.x;
    const uint key = glintSortKey(floats[i]);
    keys[2u * i] = key;
    keys[2u * i + 1u] = floatBitsToUint(glintSortValue(key));
}
)");
    ASSERT_THAT(kernel.create(), IsOk());
    const Buffer floats = device.createBuffer(Buffer::FlagStorage, std::span(normal));
    const Buffer made = device.createBuffer(Buffer::FlagStorage, 64);
    Compute list = device.createCompute();
    list.setKernel(kernel);
    list.setStorageBuffers(0, {floats, made});
    list.dispatch(8);
    ASSERT_THAT(device.submit(list), IsOk());
    std::vector<uint32_t> expected;
    for (const float value : normal) {
        expected.push_back(sortKey(value));
        expected.push_back(std::bit_cast<uint32_t>(value));
    }
    expectValues(device, made, expected);
}

TEST_F(RadixSortTest, LeavesWhatTheDeviceGetsWrong) {
    const std::vector<uint32_t> values = makeValues(1000, Keys::Random, 4);
    const std::vector<Region> wrong = {
        {0, 500, 501, 0}, {800, 0, 201, 0}, {~0u, 0, 2, 0}, {10, ~0u, 2, 0}, {500, 750, 200, 0}};
    std::vector<uint32_t> expected = values;
    sortManyOnHost(expected, std::span(wrong).last(1), 32);
    const Buffer regions = device.createBuffer(Buffer::FlagStorage, std::span(wrong));
    const std::vector<uint32_t> counts = {6};
    const Buffer how_many = device.createBuffer(Buffer::FlagStorage, std::span(counts));
    RadixSort sort;
    const auto run = [&](const auto& record) {
        const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values));
        Compute compute = device.createCompute();
        record(compute, buffer);
        EXPECT_THAT(device.submit(compute), IsOk());
        return buffer;
    };
    ASSERT_THAT(sort.create(device, RadixSort::FlagMultiple, 300), IsOk());
    expectValues(device, run([&](Compute& c, const Buffer& b) { sort.dispatchIndirect(c, b, 5, regions); }), expected);
    EXPECT_THAT(sort.check(), HasErrorId("parallel.outside"));
    EXPECT_THAT(sort.check(), IsOk());
    expectValues(device,
                 run([&](Compute& c, const Buffer& b) { sort.dispatchIndirect(c, b, how_many, regions, 0, 64); }),
                 expected);
    EXPECT_THAT(sort.check(), HasErrorId("parallel.count"));
    for (const RadixSort::Flags flags : {RadixSort::FlagSingle, RadixSort::FlagMultiple}) {
        ASSERT_THAT(sort.create(device, flags | 0u, 199), IsOk());
        expectValues(device, run([&](Compute& c, const Buffer& b) { sort.dispatchIndirect(c, b, regions, 64); }),
                     values);
        EXPECT_THAT(sort.check(), HasErrorId("parallel.room"));
        expectValues(device, run([&](Compute& c, const Buffer& b) { sort.dispatchIndirect(c, b, regions); }), values);
        EXPECT_THAT(sort.check(), HasErrorId("parallel.outside"));
    }
    // Two large regions where there is room for one: either may be the one that is sorted.
    const std::vector<uint32_t> large = makeValues(80000, Keys::Random, 5);
    const std::vector<Region> two = {{0, 20000, 20000, 0}, {40000, 60000, 20000, 0}};
    const Buffer both = device.createBuffer(Buffer::FlagStorage, std::span(two));
    ASSERT_THAT(sort.create(device, RadixSort::FlagMultiple, 39999), IsOk());
    const Buffer halves = device.createBuffer(Buffer::FlagStorage, std::span(large));
    Compute list = device.createCompute();
    sort.dispatchIndirect(list, halves, 2, both);
    EXPECT_THAT(device.submit(list), IsOk());
    EXPECT_THAT(sort.check(), HasErrorId("parallel.room"));
    std::vector<uint32_t> first = large, second = large;
    sortManyOnHost(first, std::span(two).first(1), 32);
    sortManyOnHost(second, std::span(two).last(1), 32);
    const auto halved = device.read<uint32_t>(halves);
    ASSERT_TRUE(halved) << halved.error().text();
    EXPECT_TRUE(*halved == first || *halved == second);
    // Overlapping regions end in any order, and nothing outside of them changes.
    const std::vector<Region> overlapping(64, Region{100, 150, 90, 0});
    const Buffer many = device.createBuffer(Buffer::FlagStorage, std::span(overlapping));
    ASSERT_THAT(sort.create(device, RadixSort::FlagMultiple, 64 * 90), IsOk());
    const Buffer mixed = run([&](Compute& c, const Buffer& b) { sort.dispatchIndirect(c, b, 64, many); });
    const auto after = device.read<uint32_t>(mixed);
    ASSERT_TRUE(after) << after.error().text();
    EXPECT_TRUE(std::equal(values.begin(), values.begin() + 100, after->begin()));
    EXPECT_TRUE(std::equal(values.begin() + 240, values.end(), after->begin() + 240));
    EXPECT_THAT(sort.check(), IsOk());
}

TEST_F(RadixSortTest, SaysWhatIsWrong) {
    RadixSort sort, many;
    ASSERT_THAT(sort.create(device, RadixSort::FlagSingle, 50), IsOk());
    ASSERT_THAT(many.create(device, RadixSort::FlagMultiple, 50, 0, 2), IsOk());
    RadixSort none;
    EXPECT_THAT(none.create(Device(), RadixSort::FlagSingle, 1), HasErrorId("handle.null"));
    EXPECT_THAT(none.create(device, 0, 1), HasErrorId("sort.flags"));
    EXPECT_THAT(none.create(device, RadixSort::FlagKeys, 1), HasErrorId("sort.flags"));
    EXPECT_THAT(none.create(device, 15, 1), HasErrorId("sort.flags"));
    EXPECT_THAT(none.create(device, RadixSort::FlagSingle, 0), HasErrorId("sort.capacity"));
    const uint64_t limit = device.getFeatures().maxStorageSize;
    if (limit / 8 < UINT32_MAX) {
        const auto above = static_cast<uint32_t>(limit / 8 + 1);
        EXPECT_THAT(none.create(device, RadixSort::FlagSingle, above), HasErrorId("sort.capacity"));
    }
    EXPECT_THAT(none.create(device, RadixSort::FlagSingle, 1, 0, 0), HasErrorId("parallel.regions"));
    EXPECT_THAT(none.check(), HasErrorId("handle.null"));
    EXPECT_FALSE(none);
    const Buffer data = device.createBuffer(Buffer::FlagStorage, 400, "values");
    const Buffer regions = device.createBuffer(Buffer::FlagStorage, 40, "regions");
    const std::vector<Region> three(3);
    const std::vector<Region> large = {{0, 50, 26, 0}, {26, 75, 25, 0}};
    const auto expectFailure = [&](std::string_view id, const auto& record) {
        Compute compute = device.createCompute();
        record(compute);
        EXPECT_THAT(compute.error(), HasErrorId(std::string(id)));
        expectTold(id);
    };
    expectFailure("handle.null", [&](Compute& c) { none.dispatch(c, data, 0, 50, 1); });
    expectFailure("handle.null", [&](Compute& c) { sort.dispatch(c, Buffer(), 0, 50, 1); });
    expectFailure("parallel.range", [&](Compute& c) { sort.dispatch(c, data, 51, 0, 50); });
    expectFailure("parallel.range", [&](Compute& c) { sort.dispatch(c, data, 0, 51, 50); });
    if (limit < device.getFeatures().maxBufferSize && limit < (1ull << 30)) {
        // What a device cannot bind at once.
        const Buffer unbindable = device.createBuffer(Buffer::FlagStorage, limit + 4, "large");
        expectFailure("bind.too_large", [&](Compute& c) { sort.dispatch(c, unbindable, 0, 50, 50); });
        expectFailure("bind.too_large", [&](Compute& c) { many.dispatchIndirect(c, unbindable, regions); });
    }
    expectFailure("sort.overlap", [&](Compute& c) { sort.dispatch(c, data, 0, 49, 50); });
    expectFailure("sort.overlap", [&](Compute& c) { sort.dispatch(c, data, 30, 30, 1); });
    expectFailure("sort.capacity", [&](Compute& c) { many.dispatch(c, data, large); });
    expectFailure("sort.bits", [&](Compute& c) { sort.dispatch(c, data, 0, 50, 50, 0); });
    expectFailure("sort.bits", [&](Compute& c) { sort.dispatchIndirect(c, data, regions, 0, 33); });
    expectFailure("parallel.mode", [&](Compute& c) { sort.dispatch(c, data, three); });
    expectFailure("parallel.mode", [&](Compute& c) { sort.dispatchIndirect(c, data, 2, regions); });
    expectFailure("parallel.regions", [&](Compute& c) { many.dispatch(c, data, three); });
    expectFailure("parallel.indirect", [&](Compute& c) { many.dispatchIndirect(c, data, 3, regions); });
    expectFailure("parallel.indirect", [&](Compute& c) { many.dispatchIndirect(c, data, regions, 26); });
    expectFailure("parallel.indirect", [&](Compute& c) { many.dispatchIndirect(c, data, regions, regions, 40, 0); });
}

}  // namespace glint::test
