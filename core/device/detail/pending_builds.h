#pragma once

// Builds of the software engine that a recorder collects, so that their dispatches share rounds: pass k of all of them
// side by side, a barrier, pass k + 1. A build takes dozens of short dispatches, and what it mostly does is wait for
// each; so many builds take hardly longer than one.

#include <glint/device/detail/command_list.h>

#include <cstdint>
#include <span>
#include <vector>

namespace glint::detail {

class PendingBuilds {
public:
    /// The part of a buffer that a build alone uses while it runs.
    struct Scratch {
        uint32_t buffer = 0;  ///< resource of the list
        uint64_t begin = 0;   ///< bytes
        uint64_t end = 0;
    };
    struct Pass {
        SideDispatch dispatch;  ///< its accesses are those of the build, and not filled in
        bool uses_heap = false;
    };
    /// To a buffer that one of the builds reads, before them all.
    struct Copy {
        uint32_t buffer = 0;
        uint32_t data = 0;  ///< offset into the inline data
        uint64_t size = 0;
    };

    bool isEmpty() const { return builds_.empty(); }
    void clear();

    /// True if a build can run beside all that are there: none writes what another one accesses. `accesses`: all that
    /// its passes access, but for the scratch memory, and for the heap, of which each structure has a part of its own.
    bool takes(std::span<const Access> accesses, const Scratch& scratch) const;
    void add(std::span<const Access> accesses, const Scratch& scratch, std::span<const Pass> passes);
    void add(const Copy& copy) { copies_.push_back(copy); }

    std::span<const Copy> copies() const { return copies_; }
    /// Of all builds, one after the other, that to its scratch memory being the last of each.
    std::span<const Access> accesses() const { return accesses_; }
    /// Passes of the longest build.
    uint32_t rounds() const { return rounds_; }
    /// Calls visit(pass) for each build that has a pass of this number. The accesses of its dispatch are a range of
    /// accesses().
    template <class Visitor>
    void forEachPass(uint32_t round, Visitor&& visit) const {
        for (const Build& build : builds_)
            if (round < build.pass_count) visit(passes_[build.first_pass + round]);
    }

private:
    struct Build {
        Scratch scratch;
        uint32_t first_access = 0;
        uint32_t access_count = 0;
        uint32_t first_pass = 0;
        uint32_t pass_count = 0;
    };

    std::vector<Build> builds_;
    std::vector<Access> accesses_;
    std::vector<Pass> passes_;
    std::vector<Copy> copies_;
    uint32_t rounds_ = 0;
};

}  // namespace glint::detail
