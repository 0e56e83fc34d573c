#include <glint/device/detail/pending_builds.h>

#include <algorithm>

namespace glint::detail {

namespace {

/// Enough to share a barrier's cost, and few enough to compare each with all.
constexpr size_t most_builds = 256;

}  // namespace

void PendingBuilds::clear() {
    builds_.clear();
    accesses_.clear();
    passes_.clear();
    copies_.clear();
    rounds_ = 0;
}

bool PendingBuilds::takes(std::span<const Access> accesses, const Scratch& scratch) const {
    if (builds_.size() == most_builds) return false;
    const auto uses = [](std::span<const Access> all, const Scratch& memory) {
        return std::ranges::any_of(all, [&](const Access& access) { return access.resource == memory.buffer; });
    };
    const auto conflict = [](const Access& a, const Access& b) {
        return a.resource == b.resource && ((a.flags | b.flags) & AccessWrite);
    };
    return std::ranges::none_of(builds_, [&](const Build& build) {
        const auto others = std::span(accesses_).subspan(build.first_access, build.access_count - 1);
        const Scratch& other = build.scratch;
        if (other.buffer == scratch.buffer && other.begin < scratch.end && scratch.begin < other.end) return true;
        return uses(accesses, other) || uses(others, scratch) || std::ranges::any_of(others, [&](const Access& there) {
                   return std::ranges::any_of(accesses, [&](const Access& here) { return conflict(here, there); });
               });
    });
}

void PendingBuilds::add(std::span<const Access> accesses, const Scratch& scratch, std::span<const Pass> passes) {
    Build& build = builds_.emplace_back();
    build.scratch = scratch;
    build.first_access = static_cast<uint32_t>(accesses_.size());
    build.access_count = static_cast<uint32_t>(accesses.size() + 1);
    build.first_pass = static_cast<uint32_t>(passes_.size());
    build.pass_count = static_cast<uint32_t>(passes.size());
    accesses_.insert(accesses_.end(), accesses.begin(), accesses.end());
    accesses_.push_back({scratch.buffer, Stage::Compute, AccessRead | AccessWrite, Layout::None, {}});
    for (Pass pass : passes) {
        pass.dispatch.first_access = build.first_access;
        pass.dispatch.access_count = build.access_count;
        passes_.push_back(pass);
    }
    rounds_ = std::max(rounds_, build.pass_count);
}

}  // namespace glint::detail
