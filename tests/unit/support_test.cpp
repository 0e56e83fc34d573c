#include "support/allocations.h"
#include "support/files.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

using namespace glint::test;

namespace {

// What escapes into it has to be allocated: compilers may leave out allocations that nobody sees.
void* volatile escape = nullptr;

}  // namespace

TEST(Support, CountsAllocations) {
    const Allocations before = allocations();
    auto value = std::make_unique<std::vector<int>>(1000);
    escape = value->data();
    const Allocations during = allocations();
    EXPECT_EQ(during.made, before.made + 2);
    EXPECT_EQ(during.released, before.released);
    value.reset();
    const Allocations after = allocations();
    EXPECT_EQ(after.made, during.made);
    EXPECT_EQ(after.live(), before.live());
}

TEST(Support, CountsAlignedAllocations) {
    struct alignas(128) Wide {
        char bytes[100] = {};
    };
    const Allocations before = allocations();
    auto value = std::make_unique<Wide>();
    escape = value.get();
    EXPECT_EQ(reinterpret_cast<uintptr_t>(value.get()) % 128, 0u);
    EXPECT_EQ(allocations().made, before.made + 1);
    value.reset();
    EXPECT_EQ(allocations().live(), before.live());
}

TEST(Support, ResidentMemoryGrows) {
    const uint64_t before = residentMemory();
    EXPECT_GT(before, 0u);
    std::vector<char> bytes(64 << 20, 1);
    escape = bytes.data();
    EXPECT_GE(residentMemory() + (1 << 20), before + bytes.size());
}

TEST(Support, TempDirIsRemoved) {
    std::filesystem::path path;
    {
        const TempDir dir;
        path = dir.path();
        EXPECT_TRUE(std::filesystem::is_directory(path));
        const TempDir other;
        EXPECT_NE(other.path(), path);
    }
    EXPECT_FALSE(std::filesystem::exists(path));
}
