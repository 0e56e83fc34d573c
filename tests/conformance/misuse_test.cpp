#include "conformance/misuse.h"

#include <algorithm>
#include <map>
#include <set>

namespace glint::test {

std::vector<Misuse>& misuses() {
    static std::vector<Misuse> all;
    return all;
}

namespace {

class MisuseTest : public ApiTest {};

std::vector<Misuse> sorted() {
    std::vector<Misuse> all = misuses();
    std::sort(all.begin(), all.end(), [](const Misuse& a, const Misuse& b) {
        return std::pair(std::string_view(a.id), std::string_view(a.name)) <
               std::pair(std::string_view(b.id), std::string_view(b.name));
    });
    return all;
}

}  // namespace

TEST_P(MisuseTest, IsCarriedAndTold) {
    MisuseKit kit;
    kit.device = device;
    kit.log = log;
    DeviceDesc desc = {.api = GetParam(), .validation = DeviceDesc::Validation::On, .message = log.callback()};
    kit.foreign = Device::create(desc);
    desc.optional = FeatureNone;
    kit.bare = Device::create(desc);
    ASSERT_TRUE(kit.foreign) << kit.foreign.error().text();
    ASSERT_TRUE(kit.bare) << kit.bare.error().text();
    for (const Misuse& misuse : sorted()) {
        SCOPED_TRACE(misuse.name);
        expectError(misuse.id, [&] { return misuse.run(kit); });
        // What went wrong must not linger: the next work goes through.
        EXPECT_THAT(device.flush(), IsOk());
        log.expectNone();
    }
}

INSTANTIATE_APIS(MisuseTest);

TEST(MisuseCount, IsAtLeast120) {
    std::set<std::pair<std::string, std::string>> distinct;
    std::set<std::string> ids;
    for (const Misuse& misuse : misuses()) {
        EXPECT_TRUE(distinct.emplace(misuse.id, misuse.name).second) << misuse.name;
        ids.insert(misuse.id);
    }
    EXPECT_GE(distinct.size(), 120u);
    EXPECT_GE(ids.size(), 90u);
    RecordProperty("cases", static_cast<int>(distinct.size()));
    RecordProperty("ids", static_cast<int>(ids.size()));
}

}  // namespace glint::test
