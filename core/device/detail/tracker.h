#pragma once

// Finds the barriers between the commands of submitted lists. Every access of a list is compared with the state of its
// resource; what the barriers already placed on the queue do not order yet becomes part of the barrier before that
// command (before the target, for draws, unless the conflict is within it). One instance a device, used under the
// submit lock.
//
// Positions count the commands of a queue over its whole life. ordered_[s][d] is the position of the last memory
// barrier from stage s to stage d, so "is this write ordered before that read?" is one comparison, whatever resource
// the barrier was placed for.

#include <glint/device/detail/command_list.h>
#include <glint/device/detail/object.h>

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace glint::detail {

class Tracker {
public:
    /// Resolves `lists` as one submission of `queue` with time-line value `value`. The result is valid until the next
    /// call. The states of all resources and of the queue are those after the submission; rollback() restores them.
    void resolve(Queue queue, uint64_t value, std::span<const CommandList* const> lists);

    std::span<const ResolvedList> lists() const { return resolved_; }
    /// Time-line values of other queues that the submission has to wait for.
    std::span<const TimelinePoint> waits() const { return waits_; }

    /// The submission failed and was not played: forgets it.
    void rollback();

private:
    struct QueueState {
        uint64_t position = 1;
        /// Position up to which a full wait (semaphore) has ordered everything of other queues: their values.
        std::array<uint64_t, queue_count> waited = {};
        std::array<std::array<uint64_t, stage_count>, stage_count> ordered = {};
    };
    /// The bindings of the command before, if they only read: while nothing has changed since, a command with the same
    /// ones, of which a table makes thousands, is ordered already, and its reads may count as those before.
    struct Known {
        const CommandList* list = nullptr;
        uint32_t first = 0;
        uint32_t count = 0;
        bool untracked = false;
        uint64_t changes = 0;
    };
    struct Undo {
        ResourceState* state;
        ResourceState old;
    };
    void resolveList(const CommandList& list);
    void playAccesses(const CommandList& list, const CommandHeader& header);
    using Step = void (Tracker::*)(ResourceState& state, const Access& access, const Slice& slice);
    void forEachState(const CommandList& list, const Access& access, Step step);
    /// Adds to the barrier what orders the access after everything before its command.
    void order(ResourceState& state, const Access& access, const Slice& slice);
    /// Remembers the access.
    void record(ResourceState& state, const Access& access, const Slice& slice);
    /// True if a transition in the barrier being collected can serve the stage of this access, too.
    bool joinTransition(ResourceState& state, const Access& access, const Slice& slice);
    void endAttachment(const CommandList& list, const Access& access);
    void touch(ResourceState& state);

    /// True if the other queue's value is waited for; false for the queue itself.
    bool waitFor(Queue queue, uint64_t value);
    bool isOrdered(StageMask source, Stage destination, uint64_t position) const;

    // The barrier being collected: before the current command or, within a target, before the target or its last split.
    void openBarrier(uint32_t command, bool is_split);
    void closeBarrier();
    void split();
    void require(StageMask source, StageMask destination);
    void addTransition(uint32_t resource, const Slice& slice, Layout from, Layout to, StageMask source,
                       StageMask destination);
    static bool covers(const Slice& range, const Slice& single);

    std::array<QueueState, queue_count> queues_;
    uint64_t epoch_ = 0;

    // Of the submission being resolved.
    Queue queue_ = Queue::Main;
    QueueState* now_ = nullptr;
    QueueState saved_;
    uint64_t value_ = 0;
    uint64_t position_ = 0;
    uint32_t command_ = 0;
    bool untracked_ = false;
    bool in_target_ = false;
    uint64_t changes_ = 0;  ///< writes, transitions and barriers so far
    Known known_;
    uint32_t barrier_ = 0;
    uint64_t barrier_position_ = 0;
    std::vector<ImageBarrier> pending_images_;
    std::vector<Barrier> barriers_;
    std::vector<ImageBarrier> images_;
    std::vector<std::pair<size_t, size_t>> ranges_;
    std::vector<ResolvedList> resolved_;
    std::vector<TimelinePoint> waits_;
    std::vector<Undo> undo_;
};

}  // namespace glint::detail
