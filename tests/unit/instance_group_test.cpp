// Groups of groups of instances, against compositions in float64.

#include "support/matchers.h"
#include "support/reference.h"

#include <glint/graphics/instance_group.h>

#include <gtest/gtest.h>

#include <algorithm>

namespace glint::test {

namespace {

using Instances = std::vector<Tracing::Instance>;

Transform3x4 moved(float x, float y = 0.0f, float z = 0.0f) { return Transform3x4(translate({x, y, z})); }

Tracing::Instance instanceAt(const Transform3x4& transform, uint32_t data = 0) {
    Tracing::Instance instance = {.data = data};
    std::copy(transform.rows.begin(), transform.rows.end(), instance.transform);
    return instance;
}

/// A place of a group, for what add() does not set.
InstanceGroup::Entry place(uint32_t group, const Tracing::Instance& instance) { return {instance, group}; }

}  // namespace

TEST(InstanceGroup, SharesGroupsInTheOrderOfTheirEntries) {
    const Tracing leaf;
    std::vector<InstanceGroup> groups(3);
    groups[0].add({.tracing = &leaf, .data = 1});
    groups[0].add(instanceAt(moved(1), 2));
    groups[1].add(0, moved(10), 4);
    groups[1].add({.data = 3, .offset = 1});
    groups[1].add(0, moved(20), 8);
    groups[2].add(1, moved(0, 100), 16);

    const Expected<Instances> all = flattenInstances(groups, 2);
    ASSERT_THAT(all, IsOk());
    ASSERT_EQ(all->size(), 5u);
    const uint32_t data[] = {1, 2, 3, 1, 2}, offsets[] = {20, 20, 17, 24, 24};
    const float x[] = {10, 11, 0, 20, 21};
    for (size_t i = 0; i < all->size(); i++) {
        const Tracing::Instance& instance = (*all)[i];
        EXPECT_EQ(instance.data, data[i]) << i;
        EXPECT_EQ(instance.offset, offsets[i]) << i;
        EXPECT_EQ(instance.transform[3], x[i]) << i;
        EXPECT_EQ(instance.transform[7], 100.0f) << i;
        EXPECT_EQ(instance.tracing, data[i] == 1 ? &leaf : nullptr) << i;
    }
    const Expected<Instances> inner = flattenInstances(groups, 0);
    ASSERT_THAT(inner, IsOk());
    EXPECT_EQ(inner->size(), 2u);
}

// Chains of random stretches, turns and moves: as float64 has it, associated the other way round, to the stated bound.
TEST(InstanceGroup, ComposesInFloat64AndRoundsOnce) {
    Random random(7);
    for (const uint32_t depth : {1u, 2u, 5u, 40u}) {
        std::vector<InstanceGroup> groups(depth);
        Matrix4x4d exact(1.0), size(1.0);
        for (uint32_t i = 0; i < depth; i++) {
            Transform3x4 transform;
            for (size_t k = 0; k < 12; k++)
                transform.rows[k] = static_cast<float>(k % 4 == 3 ? random.uniform(-1e4, 1e4) : random.uniform(-1, 1));
            if (i == 0)
                groups[0].add(instanceAt(transform));
            else
                groups[i].add(i - 1, transform);
            Matrix4x4d matrix(transform.matrix()), magnitudes(matrix);
            for (int column = 0; column < 4; column++) magnitudes[column] = glm::abs(matrix[column]);
            exact = matrix * exact;  // from the inside out; the other goes from the outside in
            size = magnitudes * size;
        }
        const Expected<Instances> all = flattenInstances(groups, depth - 1);
        ASSERT_THAT(all, IsOk());
        ASSERT_EQ(all->size(), 1u);
        for (int row = 0; row < 3; row++)
            for (int column = 0; column < 4; column++) {
                // Both sides have the rounding of float64: sums of four products at each step.
                const double bound =
                    0x1p-24 * std::abs(exact[column][row]) + 2.0 * 4.0 * depth * 0x1p-53 * size[column][row];
                EXPECT_NEAR(static_cast<double>((*all)[0].transform[row * 4 + column]), exact[column][row], bound);
            }
    }
}

// Near and far cancel: a product in float32 would be off by 64.
TEST(InstanceGroup, KeepsSmallPlacesInLargeWorlds) {
    std::vector<InstanceGroup> groups(3);
    groups[0].add(instanceAt(moved(0.125f)));
    groups[1].add(0, moved(1e9f));
    groups[2].add(1, moved(-1e9f));
    const Expected<Instances> all = flattenInstances(groups, 2);
    ASSERT_THAT(all, IsOk());
    EXPECT_EQ((*all)[0].transform[3], 0.125f);
}

TEST(InstanceGroup, IntersectsMasksAndUnitesFlags) {
    using enum Tracing::InstanceFlag;
    std::vector<InstanceGroup> groups(2);
    groups[0].add({.mask = 0x3c, .flags = InstanceOpaque});
    groups[0].add({.mask = 0xff});
    groups[1].entries.push_back(place(0, {.mask = 0x0f, .flags = InstanceTransparent | InstanceCullDisable}));
    const Expected<Instances> all = flattenInstances(groups, 1);
    ASSERT_THAT(all, IsOk());
    EXPECT_EQ((*all)[0].mask, 0x0cu);
    EXPECT_EQ((*all)[0].flags, static_cast<uint32_t>(InstanceOpaque | InstanceCullDisable));
    EXPECT_EQ((*all)[1].mask, 0x0fu);
    EXPECT_EQ((*all)[1].flags, static_cast<uint32_t>(InstanceTransparent | InstanceCullDisable));
}

TEST(InstanceGroup, RefusesWhatHasNoEnd) {
    std::vector<InstanceGroup> groups(3);
    groups[0].add(2, {});
    groups[1].add(0, {});
    groups[2].add(1, {});
    EXPECT_THAT(flattenInstances(groups, 1), HasErrorId("groups.cycle"));
    groups[2].entries.clear();
    EXPECT_THAT(flattenInstances(groups, 1), IsOk());
    groups[2].add(2, {});
    EXPECT_THAT(flattenInstances(groups, 1), HasErrorId("groups.cycle"));
    groups[2].entries[0].group = 3;
    EXPECT_THAT(flattenInstances(groups, 1), HasErrorId("groups.index"));
    EXPECT_THAT(flattenInstances(groups, 3), HasErrorId("groups.index"));
    EXPECT_THAT(flattenInstances({}, 0), HasErrorId("groups.index"));
}

// Each group holds the one before twice: 2^99 instances, or none. Neither takes long.
TEST(InstanceGroup, CountsBeforeItMakes) {
    std::vector<InstanceGroup> groups(100);
    for (uint32_t i = 1; i < groups.size(); i++)
        for (uint32_t k = 0; k < 2; k++) groups[i].add(i - 1, {});
    const Expected<Instances> none = flattenInstances(groups, 99);
    ASSERT_THAT(none, IsOk());
    EXPECT_TRUE(none->empty());
    groups[0].add({});
    EXPECT_THAT(flattenInstances(groups, 99), HasErrorId("groups.too_many"));
    EXPECT_THAT(flattenInstances(groups, 10, 1023), HasErrorId("groups.too_many"));
    EXPECT_THAT(flattenInstances(groups, 10, 1024), IsOk());
    EXPECT_THAT(flattenInstances(groups, 99, UINT64_MAX), HasErrorId("groups.too_many"));
}

// Long chains need no stack of the program.
TEST(InstanceGroup, TakesLongChains) {
    std::vector<InstanceGroup> groups(200'000);
    groups[0].add({});
    for (uint32_t i = 1; i < groups.size(); i++) groups[i].add(i - 1, moved(1));
    const Expected<Instances> all = flattenInstances(groups, 199'999);
    ASSERT_THAT(all, IsOk());
    EXPECT_EQ((*all)[0].transform[3], 199'999.0f);
}

TEST(InstanceGroup, NamesWhatDoesNotFit) {
    std::vector<InstanceGroup> groups(2);
    groups[0].name = "leaf";
    groups[0].add({.offset = 0xffffff});
    groups[1].add(0, {}, 1);
    const Expected<Instances> offset = flattenInstances(groups, 1);
    ASSERT_THAT(offset, HasErrorId("tracing.instance_bits"));
    EXPECT_NE(offset.error().message().find("entry 0 of group 0 'leaf'"), std::string::npos);

    groups[0].entries[0].instance = {.mask = 0x100};
    EXPECT_THAT(flattenInstances(groups, 1), HasErrorId("tracing.instance_bits"));
    groups[0].entries[0].instance = {.data = UINT32_MAX};
    EXPECT_THAT(flattenInstances(groups, 1), HasErrorId("tracing.instance_bits"));
    groups[0].entries[0].instance = instanceAt(Transform3x4(scale(Vector3f(1e30f))));
    EXPECT_THAT(flattenInstances(groups, 1), IsOk());
    groups[1].entries[0].instance = groups[0].entries[0].instance;
    EXPECT_THAT(flattenInstances(groups, 1), HasErrorId("tracing.instance_transform"));
    groups[1].entries[0].instance = instanceAt(moved(NAN));
    EXPECT_THAT(flattenInstances(groups, 1), HasErrorId("tracing.instance_transform"));
}

}  // namespace glint::test
