#pragma once

// Finds the barriers between the commands of submitted lists. Every access of a list is compared with the state of its
// resource; what the barriers already placed on the queue do not order yet becomes part of the barrier before that
// command (before the target, for draws, unless the conflict is within it). One instance a device, used under the
// submit lock.
//
// Positions count the commands of a queue over its whole life. ordered_[s][d] is the position of the last memory barrier
// from stage s to stage d, so "is this write ordered before that read?" is one comparison, whatever resource the barrier
// was placed for.

#include <glint/device/detail/command_list.h>
#include <glint/device/detail/object.h>

#include <array>
#include <cstdint>
#include <span>
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
    struct Undo {
        ResourceState* state;
        ResourceState old;
    };
    /// The barrier that is being collected for one command.
    struct Pending {
        StageMask source = 0;
        StageMask destination = 0;
        uint32_t first_image = 0;
        bool needed() const { return source != 0; }
    };

    void resolveList(const CommandList& list);
    void access(const CommandList& list, const Access& access, bool untracked, bool in_target);
    void accessState(ResourceState& state, const CommandList& list, const Access& access, const Slice& slice,
                     bool untracked, bool in_target);
    void touch(ResourceState& state);
    void waitFor(Queue queue, uint64_t value);
    void need(StageMask source, Stage destination, uint64_t position, bool in_target);
    bool orderedAfter(StageMask source, Stage destination, uint64_t position) const;
    void addImage(uint32_t resource, const Slice& slice, Layout from, Layout to, StageMask source, StageMask destination,
                  bool in_target);
    void place(uint32_t command);
    void fullBarrier(uint32_t command);

    std::array<QueueState, queue_count> queues_;
    uint64_t epoch_ = 0;

    // Of the submission being resolved.
    Queue queue_ = Queue::Main;
    QueueState* now_ = nullptr;
    QueueState saved_;
    uint64_t value_ = 0;
    uint64_t target_position_ = 0;
    uint32_t target_command_ = 0;
    Pending pending_;          ///< before the current command
    Pending target_pending_;   ///< before the current target
    std::vector<ImageBarrier> target_images_;
    std::vector<ImageBarrier> command_images_;
    std::vector<Barrier> barriers_;
    std::vector<ImageBarrier> images_;
    std::vector<ResolvedList> resolved_;
    std::vector<TimelinePoint> waits_;
    std::vector<Undo> undo_;
};

}  // namespace glint::detail
