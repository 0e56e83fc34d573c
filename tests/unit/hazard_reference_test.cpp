// The hazard checker against a slow judge that follows the definitions: for every pair of conflicting accesses it walks
// over all barriers between them. Random streams, most of them nearly right.

#include "hazard_stream.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <random>

namespace glint::test {
namespace {

constexpr size_t slots = detail::stage_count;

/// How far a write has come towards a stage.
enum Level : uint8_t { Nothing, Ordered, Available, Visible };

struct Step {
    enum Kind { Access, Barrier, Transition, Signal, Wait } kind = Access;
    uint32_t queue = 0;
    uint32_t group = 0;    ///< steps of one command, or of one barrier command: they do not order each other
    StageMask source = 0;  ///< Access: its stage
    StageMask destination = 0;
    std::pair<uint64_t, uint32_t> memory = {};  ///< Access, Transition: thing and part
    bool write = false;
    uint32_t other = 0;  ///< Wait: the queue
    uint64_t value = 0;  ///< Signal, Wait
};

/// Index of the first step that conflicts with an earlier one which is not ordered before it, none if all is well.
class SlowJudge {
public:
    explicit SlowJudge(const std::vector<Step>& steps) : steps_(steps) {}

    std::optional<size_t> firstConflict() const {
        std::optional<size_t> first;
        for (size_t i = 0; i < steps_.size(); i++) {
            if (steps_[i].kind != Step::Access && steps_[i].kind != Step::Transition) continue;
            const std::optional<size_t> found = firstConflict(i);
            if (found && (!first || *found < *first)) first = found;
        }
        return first;
    }

private:
    /// Walks from step `from` on.
    std::optional<size_t> firstConflict(size_t from) const {
        const Step& a = steps_[from];
        Level levels[detail::queue_count][slots] = {};
        bool waited[detail::queue_count] = {};
        std::map<std::pair<uint32_t, uint64_t>, bool> signals;
        // What a transition does is available at once, and visible to its destination.
        if (a.kind == Step::Transition)
            for (size_t s = 0; s < slots; s++)
                if (a.destination >> s & 1) levels[a.queue][s] = Visible;

        const auto source = [&](const Step& b) {
            int level = Nothing;
            const StageMask earlier = withEarlier(b.source);
            const bool here = a.kind == Step::Access && a.queue == b.queue;
            const bool own = here && (b.source & a.source);
            if (here && (earlier & a.source)) level = Ordered;
            for (size_t s = 0; s < slots; s++)
                if (earlier >> s & 1) level = std::max<int>(level, levels[b.queue][s]);
            if ((b.source & detail::stage_all) && waited[b.queue]) level = Visible;
            return std::pair(own, level);
        };
        for (size_t i = from + 1; i < steps_.size();) {
            size_t end = i;
            while (end < steps_.size() && steps_[end].group == steps_[i].group) end++;
            std::vector<std::pair<const Step*, Level>> results;
            for (size_t j = i; j < end; j++) {
                const Step& b = steps_[j];
                switch (b.kind) {
                    case Step::Access:
                        if (b.memory != a.memory || !(a.write || b.write) || b.group == a.group) break;
                        for (size_t s = 0; s < slots; s++)
                            if ((b.source >> s & 1) && levels[b.queue][s] < (a.write ? Visible : Ordered)) return j;
                        break;
                    case Step::Transition:
                    case Step::Barrier: {
                        if (b.group == a.group && b.kind != Step::Transition) break;
                        const auto [own, level] = source(b);
                        const bool same = b.kind == Step::Transition && b.memory == a.memory;
                        if (same) {
                            if (b.group == a.group) return j;
                            if (!own && level < (a.write ? Available : Ordered)) return j;
                        }
                        if (b.group == a.group) break;
                        Level result = Nothing;
                        if (b.kind == Step::Barrier || same) {
                            if (own || level >= Available)
                                result = Visible;
                            else if (level == Ordered)
                                result = Ordered;
                        } else {
                            if (level >= Available)
                                result = Available;
                            else if (own || level == Ordered)
                                result = Ordered;
                        }
                        results.emplace_back(&b, result);
                        break;
                    }
                    case Step::Signal: {
                        bool reached = a.queue == b.queue || waited[b.queue];
                        for (const Level level : levels[b.queue]) reached |= level != Nothing;
                        signals[{b.queue, b.value}] = reached;
                        break;
                    }
                    case Step::Wait: {
                        // The first signal that reaches the value.
                        const auto signal = signals.lower_bound({b.other, b.value});
                        if (signal == signals.end() || signal->first.first != b.other || !signal->second) break;
                        // Signals before step `from` are not in the map: they order nothing after it.
                        if (passed(from, b)) break;
                        waited[b.queue] = true;
                        for (Level& level : levels[b.queue]) level = Visible;
                        break;
                    }
                }
            }
            for (const auto& [step, level] : results) {
                for (size_t s = 0; s < slots; s++) {
                    Level& there = levels[step->queue][s];
                    if (step->destination >> s & 1)
                        there = std::max(there, level);
                    else if (withLater(step->destination) >> s & 1)
                        there = std::max(there, std::min(level, Available));
                }
            }
            i = end;
        }
        return std::nullopt;
    }

    /// The stages that random streams use, in the order of a draw; compute and copies stand alone.
    static StageMask withEarlier(StageMask stages) {
        if (stages & detail::bit(Stage::ColorTarget)) stages |= detail::bit(Stage::Fragment);
        if (stages & detail::bit(Stage::Fragment)) stages |= detail::bit(Stage::VertexShader);
        return stages;
    }
    static StageMask withLater(StageMask stages) {
        if (stages & detail::bit(Stage::VertexShader)) stages |= detail::bit(Stage::Fragment);
        if (stages & detail::bit(Stage::Fragment)) stages |= detail::bit(Stage::ColorTarget);
        return stages;
    }

    /// True if a signal before step `from` already reached what `wait` waits for.
    bool passed(size_t from, const Step& wait) const {
        for (size_t i = 0; i < from; i++)
            if (steps_[i].kind == Step::Signal && steps_[i].queue == wait.other && steps_[i].value >= wait.value)
                return true;
        return false;
    }

    const std::vector<Step>& steps_;
};

/// Makes a stream for both judges. Every command gets a barrier before it that is right more often than not.
class RandomStream {
public:
    explicit RandomStream(uint64_t seed) : random_(seed), care_(3u << below(6)) {}

    struct Verdict {
        size_t submissions = 0;
        std::optional<size_t> fast;  ///< submission with the first finding
        std::optional<size_t> slow;
    };

    Verdict run() {
        null::HazardChecker checker = makeChecker();
        Verdict verdict;
        std::vector<size_t> starts;
        const size_t submissions = 3 + below(4);
        for (size_t i = 0; i < submissions; i++) {
            starts.push_back(steps_.size());
            const auto queue = static_cast<uint32_t>(below(4) == 0 ? 1 + below(2) : 0);
            std::vector<Wait> waits;
            for (uint32_t other = 0; other < detail::queue_count; other++) {
                if (values_[other] == 0 || slips()) continue;
                const uint64_t value = slips() ? 1 + below(values_[other]) : values_[other];
                waits.push_back({static_cast<Queue>(other), value});
                steps_.push_back(
                    {.kind = Step::Wait, .queue = queue, .group = ++group_, .other = other, .value = value});
            }
            std::vector<List> lists(1 + below(2));
            for (List& list : lists)
                for (size_t command = 1 + below(5); command > 0; command--) addCommand(list, queue, !waits.empty());
            steps_.push_back({.kind = Step::Signal, .queue = queue, .group = ++group_, .value = ++values_[queue]});
            const auto found = judge(checker, static_cast<Queue>(queue), values_[queue], lists, waits);
            if (!verdict.fast && std::ranges::any_of(found, isConflict)) verdict.fast = i;
        }
        verdict.submissions = submissions;
        if (const std::optional<size_t> step = SlowJudge(steps_).firstConflict())
            verdict.slow = static_cast<size_t>(std::ranges::upper_bound(starts, *step) - starts.begin()) - 1;
        return verdict;
    }

private:
    static bool isConflict(const Error& finding) { return finding.id().find("_after_") != std::string_view::npos; }

    uint64_t below(uint64_t count) { return random_() % count; }
    bool slips() { return below(care_) == 0; }
    StageMask someStages() {
        StageMask mask = 0;
        for (const Stage stage : used_stages)
            if (below(3) == 0) mask |= detail::bit(stage);
        return mask;
    }

    void addCommand(List& list, uint32_t queue, bool waited) {
        std::vector<Touch> touches;
        std::vector<Turn> turns;
        for (size_t i = 1 + below(2); i > 0; i--) {
            const Stage stage = used_stages[below(used_stages.size())];
            const uint8_t flags = below(2) ? AccessRead : below(2) ? AccessWrite : AccessRead | AccessWrite;
            const size_t thing = below(things_.size());
            if (things_[thing].mips == 0) {
                touches.push_back({&things_[thing], stage, flags});
                continue;
            }
            const auto mip = static_cast<uint16_t>(below(things_[thing].mips));
            Layout& layout = layouts_[mip];
            const Slice slice{mip, 1, 0, 1};
            if (layout == Layout::Undefined || below(3) == 0) {
                const Layout to = below(2) ? Layout::General : Layout::Sampled;
                const bool right = !slips();
                StageMask source = right ? all_used : someStages();
                if (waited && below(2)) source |= detail::stage_all;
                turns.push_back({&things_[thing], layout, to, source,
                                 right ? static_cast<StageMask>(detail::bit(stage)) : someStages(), slice});
                layout = to;
            }
            touches.push_back({&things_[thing], stage, flags, layout, slice});
        }

        StageMask source = 0, destination = 0;
        if (!slips()) {
            source = slips() ? someStages() : all_used;
            destination = slips() ? someStages() : all_used;
        }
        if (source || !turns.empty()) {
            group_++;
            list.barrier(source, destination, turns);
            steps_.push_back(
                {.kind = Step::Barrier, .queue = queue, .group = group_, .source = source, .destination = destination});
            for (const Turn& turn : turns)
                steps_.push_back({.kind = Step::Transition,
                                  .queue = queue,
                                  .group = group_,
                                  .source = turn.source,
                                  .destination = turn.destination,
                                  .memory = {turn.thing->id, turn.slice.mip},
                                  .write = true});
        }
        group_++;
        list.dispatch(touches);
        for (const Touch& touch : touches)
            steps_.push_back({.kind = Step::Access,
                              .queue = queue,
                              .group = group_,
                              .source = detail::bit(touch.stage),
                              .memory = {touch.thing->id, touch.slice.mip},
                              .write = (touch.flags & AccessWrite) != 0});
    }

    static constexpr std::array used_stages = {Stage::Compute, Stage::Copy, Stage::VertexShader, Stage::Fragment,
                                               Stage::ColorTarget};
    static constexpr StageMask all_used = detail::bit(Stage::Compute) | detail::bit(Stage::Copy) |
                                          detail::bit(Stage::VertexShader) | detail::bit(Stage::Fragment) |
                                          detail::bit(Stage::ColorTarget);

    std::mt19937_64 random_;
    uint64_t care_;  ///< one decision of this many is wrong
    std::array<Thing, 3> things_ = {Thing{.id = 1, .name = "a"}, Thing{.id = 2, .name = "b"},
                                    Thing{.id = 3, .mips = 2, .layers = 1, .name = "image"}};
    std::array<Layout, 2> layouts_ = {};
    std::array<uint64_t, detail::queue_count> values_ = {};
    std::vector<Step> steps_;
    uint32_t group_ = 0;
};

TEST(HazardReference, BothJudgesAgreeOnRandomStreams) {
    size_t clean = 0, late = 0;
    constexpr uint64_t seeds = 5000;
    for (uint64_t seed = 0; seed < seeds; seed++) {
        const RandomStream::Verdict verdict = RandomStream(seed).run();
        ASSERT_EQ(verdict.fast, verdict.slow) << "seed " << seed;
        clean += !verdict.fast;
        late += verdict.fast && *verdict.fast > 0;
    }
    // Streams that are always right, or wrong at once, would show little.
    EXPECT_GT(clean, seeds / 4);
    EXPECT_GT(late, seeds / 5);
    RecordProperty("clean", static_cast<int>(clean));
}

}  // namespace
}  // namespace glint::test
