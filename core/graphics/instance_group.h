#pragma once

#include <glint/base/expected.h>
#include <glint/device/tracing.h>
#include <glint/math/math.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace glint {

/// Things that stand together: instances, and places where other groups stand. A scene is an array of groups that refer
/// to one another by number; a group may stand at many places, so that a leaf that is made once hangs on a branch a
/// hundred times, and the branch on every tree.
///
///     std::vector<InstanceGroup> groups(2);
///     groups[0].add({.tracing = &leaf});                      // a branch ...
///     for (const Transform3x4& place : places) groups[1].add(0, place);  // ... and a tree of them
///     const Expected<std::vector<Tracing::Instance>> instances = flattenInstances(groups, 1);
struct InstanceGroup {
    static constexpr uint32_t none = UINT32_MAX;

    /// An instance; or, if `group` is given, that group, with its `tracing` passed over and all else applied to what is
    /// in it.
    struct Entry {
        Tracing::Instance instance;
        uint32_t group = none;
    };

    std::string name;  ///< for messages
    std::vector<Entry> entries;

    /// Adds an instance.
    void add(const Tracing::Instance& instance) { entries.push_back({instance, none}); }
    /// Adds a group. `transform`: from there to this one; `offset`: for all instances in it.
    void add(uint32_t group, const Transform3x4& transform, uint32_t offset = 0);
};

/// The instances of a group, and of all groups in it, in the order of the entries, as Device::createTracing takes them:
///
/// - transforms are composed in float64 and rounded once: with n of them on the way, an entry is off by 2^-24 of itself
///   and 4n 2^-53 of what the product of the transforms' magnitudes has in its place;
/// - masks are intersected, `data` and `offset` (into the hit records) are added up;
/// - flags are united. InstanceOpaque and InstanceTransparent exclude one another: the innermost that says either
///   decides.
///
/// Errors name group and entry: "groups.index" (a group that there is not), "groups.cycle" (a group that is in itself),
/// "groups.too_many" (more than `limit` instances; nothing is made then), "tracing.instance_bits" (sums of more than 24
/// bits, masks of more than 8), "tracing.instance_transform" (what is composed is not finite in float32).
Expected<std::vector<Tracing::Instance>> flattenInstances(std::span<const InstanceGroup> groups, uint32_t root,
                                                          uint64_t limit = (1u << 24) - 1);

}  // namespace glint
