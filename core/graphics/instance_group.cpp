#include <glint/graphics/instance_group.h>

#include <glint/base/format_error.h>

#include <algorithm>
#include <cmath>

namespace glint {

namespace {

using Rows = std::array<double, 12>;

/// What stands above an entry.
struct Place {
    Rows transform = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    uint64_t data = 0, offset = 0;
    uint32_t mask = 0xff, flags = 0;
};

constexpr uint32_t opacity = Tracing::InstanceOpaque | Tracing::InstanceTransparent;

Place within(const Place& outer, const Tracing::Instance& inner) {
    Place place;
    for (size_t row = 0; row < 12; row += 4)
        for (size_t column = 0; column < 4; column++) {
            double sum = column == 3 ? outer.transform[row + 3] : 0.0;
            for (size_t i = 0; i < 3; i++) sum += outer.transform[row + i] * inner.transform[4 * i + column];
            place.transform[row + column] = sum;
        }
    place.data = outer.data + inner.data;
    place.offset = outer.offset + inner.offset;
    place.mask = outer.mask & inner.mask;
    place.flags = (inner.flags & opacity ? outer.flags & ~opacity : outer.flags) | inner.flags;
    return place;
}

/// "entry 3 of group 1 'branch'"
std::string nameOf(std::span<const InstanceGroup> groups, uint32_t group, size_t entry) {
    const std::string& name = groups[group].name;
    return fmt::format("entry {} of group {}{}{}{}", entry, group, name.empty() ? "" : " '", name,
                       name.empty() ? "" : "'");
}

/// A way into the groups that is under way: explicit stacks, since chains of groups may be long.
struct Level {
    uint32_t group;
    size_t entry = 0;
    Place place = {};
};

/// How many instances each group has that the root needs, without making them.
Expected<std::vector<uint64_t>> countInstances(std::span<const InstanceGroup> groups, uint32_t root, uint64_t limit) {
    enum class State : uint8_t { New, Open, Done };
    std::vector<State> states(groups.size(), State::New);
    std::vector<uint64_t> counts(groups.size(), 0);
    std::vector<Level> stack = {{root}};
    states[root] = State::Open;
    while (!stack.empty()) {
        Level& level = stack.back();
        const InstanceGroup& group = groups[level.group];
        if (level.entry == group.entries.size()) {
            states[level.group] = State::Done;
            stack.pop_back();
            continue;
        }
        const InstanceGroup::Entry& entry = group.entries[level.entry];
        if (entry.group != InstanceGroup::none) {
            if (entry.group >= groups.size())
                return unexpected(makeError(ErrorCode::OutOfRange, "groups.index", "{} is group {}, there are {}",
                                            nameOf(groups, level.group, level.entry), entry.group, groups.size()));
            if (states[entry.group] == State::Open)
                return unexpected(makeError(ErrorCode::InvalidArgument, "groups.cycle",
                                            "{} is group {}, in which it is itself",
                                            nameOf(groups, level.group, level.entry), entry.group));
            if (states[entry.group] == State::New) {
                states[entry.group] = State::Open;
                stack.push_back({entry.group});
                continue;
            }
        }
        // Stays at limit + 1, so that no sum is too large for its type.
        const uint64_t count = entry.group == InstanceGroup::none ? 1 : counts[entry.group];
        counts[level.group] += std::min(count, limit + 1 - counts[level.group]);
        level.entry++;
    }
    return counts;
}

}  // namespace

void InstanceGroup::add(uint32_t group, const Transform3x4& transform, uint32_t offset) {
    Entry& entry = entries.emplace_back();
    std::copy(transform.rows.begin(), transform.rows.end(), entry.instance.transform);
    entry.instance.offset = offset;
    entry.group = group;
}

Expected<std::vector<Tracing::Instance>> flattenInstances(std::span<const InstanceGroup> groups, uint32_t root,
                                                          uint64_t limit) {
    if (root >= groups.size())
        return unexpected(makeError(ErrorCode::OutOfRange, "groups.index", "the root is group {}, there are {}", root,
                                    groups.size()));
    limit = std::min(limit, uint64_t{UINT32_MAX});
    const Expected<std::vector<uint64_t>> counts = countInstances(groups, root, limit);
    if (!counts) return unexpected(counts.error());
    if ((*counts)[root] > limit)
        return unexpected(makeError(ErrorCode::OutOfRange, "groups.too_many",
                                    "group {} has more than {} instances, which is the limit", root, limit));

    std::vector<Tracing::Instance> instances;
    instances.reserve((*counts)[root]);
    std::vector<Level> stack = {{root}};
    while (!stack.empty()) {
        Level& level = stack.back();
        const std::vector<InstanceGroup::Entry>& entries = groups[level.group].entries;
        if (level.entry == entries.size()) {
            stack.pop_back();
            continue;
        }
        const size_t number = level.entry++;
        const InstanceGroup::Entry& entry = entries[number];
        const Place place = within(level.place, entry.instance);
        if (entry.instance.mask > 0xff)
            return unexpected(makeError(ErrorCode::OutOfRange, "tracing.instance_bits",
                                        "{} has mask {:#x}; the limit is 8 bits", nameOf(groups, level.group, number),
                                        entry.instance.mask));
        if (entry.group != InstanceGroup::none) {
            // Groups of nothing may stand at more places than could be visited.
            if ((*counts)[entry.group] > 0) stack.push_back({entry.group, 0, place});
            continue;
        }
        if (place.data >> 24 || place.offset >> 24)
            return unexpected(makeError(ErrorCode::OutOfRange, "tracing.instance_bits",
                                        "{} has, with its groups', data {:#x} and offset {:#x}; the limit is 24 bits",
                                        nameOf(groups, level.group, number), place.data, place.offset));
        Tracing::Instance& instance = instances.emplace_back(entry.instance);
        instance.data = static_cast<uint32_t>(place.data);
        instance.offset = static_cast<uint32_t>(place.offset);
        instance.mask = place.mask;
        instance.flags = place.flags;
        for (size_t i = 0; i < 12; i++) {
            instance.transform[i] = static_cast<float>(place.transform[i]);
            if (!std::isfinite(instance.transform[i]))
                return unexpected(makeError(ErrorCode::OutOfRange, "tracing.instance_transform",
                                            "{} has, with its groups', {} in element {} of its transform",
                                            nameOf(groups, level.group, number), place.transform[i], i));
        }
    }
    return instances;
}

}  // namespace glint
