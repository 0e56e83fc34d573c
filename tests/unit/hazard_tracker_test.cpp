// The tracker under the eye of the hazard checker: random lists through the public interface must be judged clean, and
// hardly any of the barriers may be left out.

#include "random_program.h"

#include <platform/null/null_control.h>

#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <optional>
#include <set>

namespace glint::test {
namespace {

using detail::Barrier;
using detail::ImageBarrier;
using detail::StageMask;
using detail::Submission;
using detail::TimelinePoint;
using null::HazardChecker;
using null::NullControl;

// Mutations: a submission with something left out, judged beside the true one, and all that follows it.

struct Mutant {
    std::vector<std::vector<Barrier>> barriers;
    std::vector<ImageBarrier> images;
    std::vector<TimelinePoint> waits;

    explicit Mutant(const Submission& submission) : waits(submission.waits.begin(), submission.waits.end()) {
        for (const detail::ResolvedList& list : submission.lists) {
            barriers.emplace_back(list.barriers.begin(), list.barriers.end());
            images.assign(list.images.begin(), list.images.end());
        }
    }
    std::vector<Error> judge(const Submission& submission, HazardChecker& checker) const {
        std::vector<detail::ResolvedList> lists;
        for (size_t i = 0; i < submission.lists.size(); i++)
            lists.push_back({submission.lists[i].list, barriers[i], images});
        return checker.judge({submission.queue, lists, waits, submission.value});
    }
};

enum Mutation {
    DropMemory,
    DropSource,
    DropDestination,
    DropTransition,
    DropTransitionSource,
    DropWait,
    MutationCount
};

/// Of what the tracker places, how much may be left out without a finding: what chains of other barriers do anyway.
struct MutationLimit {
    const char* name;
    double redundant;
};
constexpr MutationLimit mutation_limits[] = {{"memory barriers", 0.2},         {"source stages", 0.3},
                                             {"destination stages", 0.25},     {"transitions", 0.01},
                                             {"sources of transitions", 0.03}, {"waits", 0.1}};

/// Takes one thing away at random; false if there is nothing of the kind.
bool mutate(Mutant& mutant, Mutation mutation, Random& random) {
    const auto takeBit = [&](StageMask& mask) {
        std::vector<StageMask> bits;
        for (uint32_t i = 0; i < 16; i++)
            if (mask >> i & 1) bits.push_back(static_cast<StageMask>(1u << i));
        if (bits.empty()) return false;
        mask = static_cast<StageMask>(mask & ~bits[random.below(bits.size())]);
        return true;
    };
    if (mutation == DropWait) {
        if (mutant.waits.empty()) return false;
        mutant.waits.erase(mutant.waits.begin() + static_cast<std::ptrdiff_t>(random.below(mutant.waits.size())));
        return true;
    }
    std::vector<Barrier*> memory, transitions;
    for (auto& list : mutant.barriers) {
        for (Barrier& barrier : list) {
            if (barrier.source && barrier.destination) memory.push_back(&barrier);
            if (barrier.image_count) transitions.push_back(&barrier);
        }
    }
    if (mutation == DropTransition || mutation == DropTransitionSource) {
        if (transitions.empty()) return false;
        Barrier& barrier = *transitions[random.below(transitions.size())];
        ImageBarrier& image = mutant.images[barrier.first_image + random.below(barrier.image_count)];
        if (mutation == DropTransitionSource) return takeBit(image.source);
        // Images stay where they are; an empty slice is no transition.
        image.slice.layers = 0;
        return true;
    }
    if (memory.empty()) return false;
    Barrier& barrier = *memory[random.below(memory.size())];
    if (mutation == DropSource) return takeBit(barrier.source);
    if (mutation == DropDestination) return takeBit(barrier.destination);
    barrier.source = barrier.destination = 0;
    return true;
}

/// True if two tracked commands of the list conflict over a buffer or a structure.
bool hasConflict(const detail::CommandList& list) {
    std::map<uint32_t, std::set<uint32_t>> readers, writers;
    detail::forEachCommand(list, [&](uint32_t index, const detail::CommandHeader& header) {
        if (header.untracked) return;
        const auto add = [&](uint32_t first, uint32_t count) {
            for (uint32_t i = first; i < first + count; i++) {
                const detail::Access& access = list.accesses[i];
                if (access.layout != detail::Layout::None) continue;
                ((access.flags & detail::AccessWrite) ? writers : readers)[access.resource].insert(index);
            }
        };
        add(header.first_access, header.access_count);
        add(header.first_shared, header.shared_count);
    });
    return std::ranges::any_of(writers, [&](const auto& entry) {
        std::set<uint32_t> all = readers[entry.first];
        all.insert(entry.second.begin(), entry.second.end());
        return all.size() > 1;
    });
}

class HazardTracker : public testing::Test {
protected:
    void SetUp() override { open(TracingEngine::Driver); }
    void open(TracingEngine engine) {
        device = Device::create({.api = "null", .tracing = engine, .message = [this](const Message& message) {
                                     if (tolerated.contains(message.error.id()))
                                         told++;
                                     else if (messages++ < 10)
                                         ADD_FAILURE() << "seed " << seed << ": " << message.error.text();
                                 }});
        ASSERT_TRUE(device);
        control = NullControl::last();
        programs.emplace(device);
    }

    void runPrograms(uint64_t seeds) {
        for (seed = 0; seed < seeds && messages == 0; seed++) RandomProgram(device, *programs, seed).run();
        EXPECT_THAT(device.finish(), IsOk());
    }
    void runMutants(uint64_t seeds);

    Device device;
    std::shared_ptr<NullControl> control;
    std::optional<Programs> programs;
    uint64_t seed = 0;
    uint64_t messages = 0;
    std::set<std::string_view> tolerated;
    uint64_t told = 0;
};

void HazardTracker::runMutants(uint64_t seeds) {
    struct Shadow {
        HazardChecker checker;
        Mutation mutation;
        bool caught;
    };
    std::vector<Shadow> shadows;
    std::array<double, MutationCount> made = {}, caught = {};
    uint64_t emptied = 0;
    std::optional<Random> random;
    control->setObserver([&](const Submission& submission, const HazardChecker& before) {
        for (Shadow& shadow : shadows)
            if (!shadow.caught) shadow.caught = !shadow.checker.judge(submission).empty();
        for (int i = 0; i < MutationCount; i++) {
            Mutant mutant(submission);
            if (!mutate(mutant, static_cast<Mutation>(i), *random)) continue;
            shadows.push_back({before, static_cast<Mutation>(i), false});
            shadows.back().caught = !mutant.judge(submission, shadows.back().checker).empty();
        }
        // Without any of its barriers a list with a conflict in it is always caught.
        for (size_t i = 0; i < submission.lists.size(); i++) {
            if (!hasConflict(*submission.lists[i].list)) continue;
            Mutant mutant(submission);
            mutant.barriers[i].clear();
            HazardChecker checker = before;
            emptied++;
            EXPECT_FALSE(mutant.judge(submission, checker).empty()) << "seed " << seed;
        }
    });
    for (seed = 0; seed < seeds && messages == 0; seed++) {
        random.emplace(seed ^ 0x5eed);
        RandomProgram(device, *programs, seed).run();
        for (const Shadow& shadow : shadows) {
            made[shadow.mutation]++;
            caught[shadow.mutation] += shadow.caught;
        }
        shadows.clear();
    }
    EXPECT_THAT(device.finish(), IsOk());
    EXPECT_GT(emptied, seeds);
    for (size_t i = 0; i < MutationCount; i++) {
        const double redundant = 1.0 - caught[i] / made[i];
        std::printf("%s: %.0f left out, %.1f%% of them redundant\n", mutation_limits[i].name, made[i],
                    100.0 * redundant);
        EXPECT_GT(made[i], static_cast<double>(seeds)) << mutation_limits[i].name;
        EXPECT_LT(redundant, mutation_limits[i].redundant) << mutation_limits[i].name;
    }
}

using HazardTrackerLong = HazardTracker;

/// Structures are built by compute kernels, side by side where that is right.
class HazardTrackerSoftware : public HazardTracker {
protected:
    void SetUp() override { open(TracingEngine::Software); }
};
using HazardTrackerSoftwareLong = HazardTrackerSoftware;

TEST_F(HazardTracker, RandomProgramsAreClean) { runPrograms(3000); }

TEST_F(HazardTrackerLong, RandomProgramsAreClean) {
    runPrograms(100000);
    const null::NullCounters counters = control->counters();
    std::printf("%llu commands, %llu barriers, %llu transitions, %llu splits, %llu waits\n",
                static_cast<unsigned long long>(counters.commands), static_cast<unsigned long long>(counters.barriers),
                static_cast<unsigned long long>(counters.image_barriers),
                static_cast<unsigned long long>(counters.splits), static_cast<unsigned long long>(counters.waits));
}

TEST_F(HazardTracker, WhatIsLeftOutIsMissed) { runMutants(100); }

TEST_F(HazardTrackerSoftware, RandomProgramsAreClean) {
    uint64_t beside = 0;
    control->setObserver([&](const Submission& submission, const HazardChecker&) {
        for (const detail::ResolvedList& list : submission.lists)
            detail::forEachCommand(*list.list, [&](uint32_t, const detail::CommandHeader& header) {
                if (header.type != detail::CommandType::SideDispatches) return;
                beside += reinterpret_cast<const detail::SideDispatchesCommand&>(header).count > 1;
            });
    });
    runPrograms(300);
    EXPECT_GT(beside, 1000u);
}

TEST_F(HazardTrackerSoftware, WhatIsLeftOutIsMissed) { runMutants(60); }

TEST_F(HazardTrackerSoftwareLong, RandomProgramsAreClean) { runPrograms(20000); }

TEST_F(HazardTrackerLong, WhatIsLeftOutIsMissed) { runMutants(500); }

TEST_F(HazardTracker, UntrackedCommandsMayShareABuffer) {
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, 256, "buffer");
    const auto change = [&](Compute& list, uint64_t offset, uint64_t size) {
        list.setStorageBuffer(0, buffer, offset, size);
        list.dispatch(8);
    };
    const auto record = [&](uint64_t second, bool ends_with_barrier) {
        Compute list = device.createCompute();
        list.setKernel(programs->change);
        change(list, 0, 256);
        list.setTracking(false);
        list.barrier();
        change(list, 0, 128);
        change(list, second, 128);
        if (ends_with_barrier) list.barrier();
        list.copyBuffer(buffer, 192, buffer, 0, 64);
        list.setTracking(true);
        change(list, 0, 256);
        EXPECT_THAT(device.submit(list), IsOk());
        return std::exchange(told, 0);
    };
    EXPECT_EQ(record(128, true), 0u);
    tolerated = {"hazard.read_after_write"};
    EXPECT_EQ(record(64, true), 1u);
    EXPECT_EQ(record(128, false), 1u);
    for (const Error& finding : control->findings()) EXPECT_EQ(finding.code(), ErrorCode::InvalidArgument);
}

// A submission that failed was not played: what comes after it must not count on it.
TEST_F(HazardTracker, FailedSubmissionsLeaveNoTrace) {
    tolerated = {"device.out_of_memory"};
    for (seed = 0; seed < 300 && messages == 0; seed++) {
        control->failSubmit(1 + seed % 7, ErrorCode::OutOfMemory);
        RandomProgram(device, *programs, seed, true).run();
    }
    control->failSubmit(0, ErrorCode::OutOfMemory);
    EXPECT_GT(told, 200u);
    EXPECT_THAT(device.finish(), IsOk());
}

}  // namespace
}  // namespace glint::test
