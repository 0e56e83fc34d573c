#pragma once

// Judges streams of submissions: are any two conflicting accesses ordered, and is each write seen by what reads it? It
// shares no code and no idea with the tracker that places the barriers, but follows Vulkan's rules:
//
// - Commands of a queue are not ordered by their order alone. A barrier orders what its source stages did before it,
// and
//   what those stages had been ordered after, before its destination stages (a chain); so does a transition. With a
//   source stage come the logically earlier ones of its pipeline, with a destination stage the later ones: for order,
//   not for memory. A wait for another queue's time line orders everything that was submitted there before.
// - A write is seen where a memory barrier, or a wait, lies on such a chain: after the write's own stage and into the
//   stage that reads or writes next. A transition is a memory barrier for its own slice only.
// - A transition reads and writes its slice, between its source and its destination stages.
// - Attachments of one target need no order among themselves until the target is split.
// - Untracked commands do not conflict over parts of a buffer that are apart.
// - Dispatches of one command are not ordered at all; so they must not conflict, but may over parts of a buffer.
//
// For each stage of each queue clocks say how far every stage of every queue is ordered before it, and how far what
// they wrote is available and visible to it. An access is compared with the last write and with the reads since then.

#include <platform/null/hazard_range.h>

#include <glint/base/error.h>
#include <glint/device/detail/backend.h>
#include <glint/device/detail/command_list.h>

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

namespace glint::null {

/// What the checker has to know of an object that a list names.
struct HazardResource {
    uint64_t id = 0;    ///< of the memory, never used again; 0 for what is no memory: samplers, kernels
    uint32_t mips = 0;  ///< 0 for what is no texture
    uint32_t layers = 0;
};

/// "dispatch", "copy to texture", ...
const char* toString(detail::CommandType type);
/// "Compute", "Fragment", ...
const char* toString(detail::Stage stage);
const char* toString(detail::Layout layout);

/// A value: a copy goes on judging from the same state, which is how tests ask "and without this barrier?".
/// Not thread-safe.
class HazardChecker {
public:
    using Resolve = std::function<HazardResource(const detail::Object*)>;
    using Label = std::function<std::string(const detail::Object*)>;

    /// `label` names an object in messages.
    HazardChecker(Resolve resolve, Label label) : resolve_(std::move(resolve)), label_(std::move(label)) {}

    /// Judges the next submission. Ids: "hazard.read_after_write", "hazard.write_after_read",
    /// "hazard.write_after_write"; "hazard.layout" (an access or a transition expects another layout),
    /// "hazard.split" (a barrier within a target that does not split it, or a split outside), "hazard.feedback" (a draw
    /// accesses an attachment of its target), "hazard.discard" (what is read was dropped by a transition from
    /// Undefined), "hazard.side_by_side" (dispatches of one command conflict). The code is InvalidArgument if the later
    /// command is untracked, else Internal. What was found once is taken for ordered from there on.
    std::vector<Error> judge(const detail::Submission& submission);

    /// The memory with this id is gone.
    void forget(uint64_t id) { resources_.erase(id); }

private:
    // One more than stages: transitions are covered by waits even if their destination is empty.
    static constexpr size_t slots = detail::stage_count + 1;

    /// A position for every stage of every queue.
    struct Clock {
        std::array<std::array<uint64_t, slots>, detail::queue_count> at = {};
        void join(const Clock& other);
        void raise(Queue queue, detail::StageMask stages, uint64_t position);
        bool reaches(Queue queue, detail::StageMask stages, uint64_t position) const;
    };
    /// What is ordered before the later work of a stage.
    struct Scope {
        Clock ordered;
        Clock available;  ///< writes that a barrier has made available
        Clock visible;    ///< writes that a barrier after that has made visible
        Clock settled;    ///< transitions, which are available from the start, likewise
    };
    struct Signal {
        uint64_t value = 0;
        Clock clock;
    };
    struct QueueState {
        uint64_t position = 0;
        std::array<Scope, slots> stages;
        Clock waited;
        std::deque<Signal> signals;
        uint64_t forgotten = 0;  ///< signals up to this value are no longer kept
    };

    /// The command of an access, for messages.
    struct Site {
        Queue queue = Queue::Main;
        uint64_t value = 0;    ///< of the submission
        uint32_t command = 0;  ///< index in its list
        uint32_t place = 0;    ///< index into places_
        detail::CommandType type = detail::CommandType::Barrier;
        bool transition = false;  ///< the transition before the command
        bool untracked = false;
    };
    struct Use {
        detail::StageMask stages = 0;  ///< one stage, or the destination of a transition
        uint64_t position = 0;
        uint64_t target = 0;  ///< the target it is an attachment of, 0 for none
        ByteRange range;      ///< of an untracked command
        Site site;
    };
    /// Of a buffer, of a structure, or of one subresource of a texture.
    struct History {
        detail::Layout layout = detail::Layout::Undefined;
        bool written = false;
        bool discarded = false;  ///< by the last transition from Undefined
        Site discard;
        std::vector<Use> writes;  ///< of the last command that wrote, and of those beside it
        std::vector<Use> reads;   ///< since then, the last one of each stage and queue
    };
    struct Resource {
        uint32_t mips = 1;
        uint32_t layers = 1;
        bool texture = false;
        std::vector<History> parts;  ///< layer-major

        /// Calls visit(history, part) for each subresource of the slice; `part` is empty for what is no texture.
        template <class Visitor>
        void forEachPart(const Slice& slice, Visitor&& visit);
    };
    struct Now;

    /// What a barrier with these source stages hands on: `ordered` and, if it only orders, `available`; `visible` and
    /// `settled` if it is a memory barrier.
    Scope gather(const Now& now, detail::StageMask stages) const;
    void wait(QueueState& queue, const detail::TimelinePoint& point);
    void signal(QueueState& queue, Queue kind, uint64_t value);
    void judgeList(Now& now, const detail::ResolvedList& list);
    void judgeCommand(Now& now, const detail::CommandHeader& header);
    void judgeSides(Now& now, const detail::SideDispatchesCommand& command);
    void judgeBarrier(Now& now, const detail::Barrier& barrier, std::span<const detail::ImageBarrier> images);
    void transition(Now& now, const detail::ImageBarrier& image, const Scope& source);
    void access(Now& now, std::span<const detail::Access> accesses);
    /// What comes before a write or a read of a stage.
    bool isVisible(const Now& now, const Use& write, const Use& use) const;
    bool isOrdered(const Now& now, const Use& read, const Use& use) const;
    void check(Now& now, const detail::Access& access, const History& history, const Slice& part);
    void record(Now& now, const detail::Access& access, History& history);
    Use makeUse(const Now& now, const detail::Access& access) const;
    void accessAttachments(Now& now, uint8_t flags);
    void dropContents(Now& now, const detail::Attachment& attachment);
    bool isAttachment(Now& now, const detail::Access& access);
    Resource* find(Now& now, uint32_t index);
    uint32_t place(const Now& now);
    std::string describe(const Site& site) const;
    void report(Now& now, const char* id, uint32_t resource, std::string message);
    void reportConflict(Now& now, const char* id, uint32_t resource, const Slice& part, const Use& earlier,
                        const Use& later);

    Resolve resolve_;
    Label label_;
    std::array<QueueState, detail::queue_count> queues_;
    std::unordered_map<uint64_t, Resource> resources_;
    std::vector<std::string> places_;
    std::map<std::string, uint32_t, std::less<>> place_index_;
    uint64_t targets_ = 0;
};

}  // namespace glint::null
