// The rules of the hazard checker, one by one: what it has to find, and what it must not.

#include "hazard_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace glint::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr auto read_after_write = "hazard.read_after_write";
constexpr auto write_after_read = "hazard.write_after_read";
constexpr auto write_after_write = "hazard.write_after_write";

std::vector<std::string> ids(const std::vector<Error>& findings) {
    std::vector<std::string> names;
    for (const Error& finding : findings) names.emplace_back(finding.id());
    return names;
}

class HazardChecker : public testing::Test {
protected:
    /// What one list on the main queue is found to do wrong.
    std::vector<std::string> judged(const List& list, Queue queue = Queue::Main, const std::vector<Wait>& waits = {}) {
        findings = judge(checker, queue, ++values[static_cast<size_t>(queue)], {list}, waits);
        return ids(findings);
    }

    null::HazardChecker checker = makeChecker();
    std::vector<Error> findings;
    uint64_t values[detail::queue_count] = {};

    Thing a{.id = 1, .name = "a"};
    Thing b{.id = 2, .name = "b"};
    Thing c{.id = 3, .name = "c"};
    Thing image{.id = 4, .mips = 1, .layers = 1, .name = "image"};
    Thing atlas{.id = 5, .mips = 3, .layers = 2, .name = "atlas"};

    static constexpr StageMask compute = detail::bit(Stage::Compute);
    static constexpr StageMask copy = detail::bit(Stage::Copy);
    static constexpr StageMask fragment = detail::bit(Stage::Fragment);
    static constexpr StageMask color = detail::bit(Stage::ColorTarget);
};

// Buffers on one queue.

TEST_F(HazardChecker, OrderOfCommandsOrdersNothing) {
    EXPECT_THAT(judged(List().dispatch({writes(a, Stage::Compute)}).dispatch({reads(a, Stage::Compute)})),
                ElementsAre(read_after_write));
    EXPECT_THAT(judged(List().dispatch({reads(b, Stage::Compute)}).dispatch({writes(b, Stage::Compute)})),
                ElementsAre(write_after_read));
    EXPECT_THAT(judged(List().dispatch({writes(c, Stage::Compute)}).dispatch({writes(c, Stage::Compute)})),
                ElementsAre(write_after_write));
}

TEST_F(HazardChecker, ReadModifyWriteIsARead) {
    EXPECT_THAT(judged(List().dispatch({changes(a, Stage::Compute)}).dispatch({changes(a, Stage::Compute)})),
                ElementsAre(read_after_write));
}

TEST_F(HazardChecker, BarrierOrders) {
    EXPECT_THAT(judged(List()
                           .dispatch({writes(a, Stage::Compute), reads(b, Stage::Compute), writes(c, Stage::Compute)})
                           .barrier(compute, compute)
                           .dispatch({reads(a, Stage::Compute), writes(b, Stage::Compute), writes(c, Stage::Compute)})),
                IsEmpty());
}

TEST_F(HazardChecker, ReadsNeedNoOrder) {
    EXPECT_THAT(judged(List().dispatch({reads(a, Stage::Compute)}).dispatch({reads(a, Stage::Compute)})), IsEmpty());
    EXPECT_THAT(judged(List().command(CommandType::CopyBuffer, {reads(a, Stage::Copy)})), IsEmpty());
}

TEST_F(HazardChecker, OneCommandDoesNotConflictWithItself) {
    EXPECT_THAT(
        judged(List().draw({reads(a, Stage::VertexInput), writes(a, Stage::Fragment), writes(a, Stage::VertexShader)})),
        IsEmpty());
}

TEST_F(HazardChecker, WhatFollowsMustComeAfterEveryStageOfACommand) {
    const List both = List().draw({reads(a, Stage::Fragment), writes(a, Stage::VertexShader)});
    EXPECT_THAT(judged(List(both).barrier(stages(Stage::VertexShader), compute).dispatch({writes(a, Stage::Compute)})),
                ElementsAre(write_after_read));
    const List second = List().draw({writes(b, Stage::VertexShader), writes(b, Stage::Fragment)});
    EXPECT_THAT(judged(List(second).barrier(fragment, compute).dispatch({reads(b, Stage::Compute)})),
                ElementsAre(read_after_write));
    const List third = List().draw({writes(c, Stage::VertexShader), writes(c, Stage::Fragment)});
    EXPECT_THAT(judged(List(third)
                           .barrier(stages(Stage::Fragment, Stage::VertexShader), compute)
                           .dispatch({reads(c, Stage::Compute)})),
                IsEmpty());
}

TEST_F(HazardChecker, ReadAndWriteOfOneCommandAreBothComparedWithEarlierOnes) {
    // The read of the second dispatch must not hide that of the first from its write.
    EXPECT_THAT(judged(List()
                           .dispatch({reads(a, Stage::Compute)})
                           .dispatch({reads(a, Stage::Compute), writes(a, Stage::Compute)})),
                ElementsAre(write_after_read));
    // Nor its write the write of the first from its read, which is in another stage.
    EXPECT_THAT(judged(List()
                           .dispatch({writes(b, Stage::Compute)})
                           .barrier(compute, fragment)
                           .draw({writes(b, Stage::Fragment), reads(b, Stage::VertexInput)})),
                ElementsAre(read_after_write));
}

TEST_F(HazardChecker, StagesOfABarrierCount) {
    EXPECT_THAT(
        judged(
            List().dispatch({writes(a, Stage::Compute)}).barrier(copy, compute).dispatch({reads(a, Stage::Compute)})),
        ElementsAre(read_after_write));
    EXPECT_THAT(
        judged(
            List().dispatch({writes(b, Stage::Compute)}).barrier(compute, copy).dispatch({reads(b, Stage::Compute)})),
        ElementsAre(read_after_write));
    EXPECT_THAT(judged(List()
                           .dispatch({writes(c, Stage::Compute)})
                           .barrier(compute | copy, copy | compute)
                           .command(CommandType::CopyBuffer, {reads(c, Stage::Copy)})),
                IsEmpty());
}

TEST_F(HazardChecker, EarlierStagesOfAPipelineAreOrderedToo) {
    // A source stage holds the stages before it, a destination stage those after it.
    EXPECT_THAT(judged(List()
                           .draw({reads(a, Stage::VertexInput)})
                           .barrier(fragment, compute)
                           .dispatch({writes(a, Stage::Compute)})),
                IsEmpty());
    EXPECT_THAT(judged(List()
                           .dispatch({reads(b, Stage::Compute)})
                           .barrier(compute, stages(Stage::VertexShader))
                           .draw({writes(b, Stage::Fragment)})),
                IsEmpty());
    EXPECT_THAT(judged(List()
                           .draw({reads(c, Stage::Fragment)})
                           .barrier(stages(Stage::VertexShader), compute)
                           .dispatch({writes(c, Stage::Compute)})),
                ElementsAre(write_after_read));
    checker = makeChecker();
    // That is order: what they wrote is not made visible.
    EXPECT_THAT(judged(List()
                           .draw({writes(a, Stage::VertexShader)})
                           .barrier(fragment, compute)
                           .dispatch({reads(a, Stage::Compute)})),
                ElementsAre(read_after_write));
    EXPECT_THAT(judged(List()
                           .dispatch({writes(b, Stage::Compute)})
                           .barrier(compute, stages(Stage::VertexShader))
                           .draw({reads(b, Stage::Fragment)})),
                ElementsAre(read_after_write));
    // But it makes chains.
    EXPECT_THAT(judged(List()
                           .dispatch({writes(c, Stage::Compute)})
                           .barrier(compute, stages(Stage::VertexShader))
                           .barrier(fragment, copy)
                           .command(CommandType::CopyBuffer, {reads(c, Stage::Copy)})),
                IsEmpty());
}

TEST_F(HazardChecker, BarrierServesOnlyWhatWasBeforeIt) {
    EXPECT_THAT(judged(List()
                           .barrier(compute, compute)
                           .dispatch({writes(a, Stage::Compute)})
                           .dispatch({reads(a, Stage::Compute)})),
                ElementsAre(read_after_write));
}

TEST_F(HazardChecker, ChainsCarryWrites) {
    EXPECT_THAT(judged(List()
                           .dispatch({writes(a, Stage::Compute)})
                           .barrier(compute, copy)
                           .barrier(copy, fragment)
                           .draw({reads(a, Stage::Fragment)})),
                IsEmpty());
}

TEST_F(HazardChecker, ChainsNeedACommonStage) {
    EXPECT_THAT(judged(List()
                           .dispatch({writes(a, Stage::Compute)})
                           .barrier(compute, copy)
                           .barrier(compute, fragment | color)
                           .command(CommandType::CopyBuffer, {reads(a, Stage::Copy)})
                           .draw({reads(a, Stage::VertexShader)})),
                ElementsAre(read_after_write));
    EXPECT_THAT(judged(List()
                           .dispatch({reads(b, Stage::Compute)})
                           .barrier(compute, copy)
                           .barrier(fragment, color)
                           .draw({writes(b, Stage::ColorTarget)})),
                ElementsAre(write_after_read));
}

TEST_F(HazardChecker, BarriersOfOneCommandDoNotChain) {
    EXPECT_THAT(judged(List()
                           .dispatch({writes(a, Stage::Compute)})
                           .barrier(copy, fragment, {{&image, Layout::Undefined, Layout::General, compute, copy}})
                           .draw({reads(a, Stage::Fragment)})),
                ElementsAre(read_after_write));
}

TEST_F(HazardChecker, EarlierListsAndSubmissionsCount) {
    EXPECT_THAT(judged(List().dispatch({writes(a, Stage::Compute)})), IsEmpty());
    EXPECT_THAT(judged(List().dispatch({reads(a, Stage::Compute)})), ElementsAre(read_after_write));
    EXPECT_THAT(judged(List().barrier(compute, compute).dispatch({writes(a, Stage::Compute)})), IsEmpty());

    const auto found =
        judge(checker, Queue::Main, 100,
              {List().dispatch({reads(b, Stage::Compute)}), List().dispatch({writes(b, Stage::Compute)})});
    EXPECT_THAT(ids(found), ElementsAre(write_after_read));
}

TEST_F(HazardChecker, BarrierAtTheEndOfAListServesTheNext) {
    EXPECT_THAT(judged(List().dispatch({writes(a, Stage::Compute)}).barrier(compute, fragment)), IsEmpty());
    EXPECT_THAT(judged(List().draw({reads(a, Stage::Fragment)})), IsEmpty());
}

TEST_F(HazardChecker, ForgottenMemoryStartsAnew) {
    EXPECT_THAT(judged(List().dispatch({writes(a, Stage::Compute)})), IsEmpty());
    checker.forget(a.id);
    EXPECT_THAT(judged(List().dispatch({writes(a, Stage::Compute)})), IsEmpty());
}

TEST_F(HazardChecker, ThingsWithoutMemoryAreIgnored) {
    Thing sampler{.id = 0, .name = "sampler"};
    EXPECT_THAT(judged(List().dispatch({writes(sampler, Stage::Compute)}).dispatch({writes(sampler, Stage::Compute)})),
                IsEmpty());
}

// What the commands of a renderer do.

TEST_F(HazardChecker, IndirectArgumentsAreRead) {
    EXPECT_THAT(judged(List()
                           .dispatch({writes(a, Stage::Compute)})
                           .barrier(compute, compute)
                           .command(CommandType::DispatchIndirect, {reads(a, Stage::Indirect)})),
                ElementsAre(read_after_write));
    EXPECT_THAT(judged(List()
                           .dispatch({writes(b, Stage::Compute)})
                           .barrier(compute, stages(Stage::Indirect))
                           .command(CommandType::DispatchIndirect, {reads(b, Stage::Indirect)})),
                IsEmpty());
}

TEST_F(HazardChecker, CopiesAreOrderedLikeEverythingElse) {
    EXPECT_THAT(judged(List()
                           .command(CommandType::CopyInline, {writes(a, Stage::Copy)})
                           .command(CommandType::CopyBuffer, {reads(a, Stage::Copy), writes(b, Stage::Copy)})
                           .barrier(copy, copy)
                           .command(CommandType::FillBuffer, {writes(a, Stage::Copy)})),
                ElementsAre(read_after_write));
}

TEST_F(HazardChecker, BuildAndQuery) {
    Thing bottom{.id = 20, .name = "bottom"}, top{.id = 21, .name = "top"}, scratch{.id = 22, .name = "scratch"};
    const StageMask build = stages(Stage::Build);
    const auto builds = [&](StageMask between, StageMask before_query, bool resident) {
        List list;
        list.command(CommandType::BuildTracings, {writes(bottom, Stage::Build), changes(scratch, Stage::Build)});
        list.barrier(build, between);
        list.command(CommandType::BuildTracings,
                     {reads(bottom, Stage::Build), writes(top, Stage::Build), changes(scratch, Stage::Build)});
        list.barrier(build, before_query);
        std::vector<Touch> traced = {reads(top, Stage::Compute)};
        if (resident) traced.push_back(reads(bottom, Stage::Compute));
        list.dispatch(traced);
        list.barrier(resident ? compute : 0, build);
        list.command(CommandType::BuildTracings, {writes(bottom, Stage::Build)});
        return list;
    };
    EXPECT_THAT(judged(builds(build, compute, true)), IsEmpty());
    checker = makeChecker();
    // The second build meets both the structure and the scratch memory of the first.
    EXPECT_THAT(judged(builds(0, compute, true)), ElementsAre(read_after_write, read_after_write));
    checker = makeChecker();
    // Both structures are seen too early.
    EXPECT_THAT(judged(builds(build, build, true)), ElementsAre(read_after_write, read_after_write));
    checker = makeChecker();
    // A second build of the bottom level has to wait for the first and for its readers.
    EXPECT_THAT(judged(builds(build, compute, false)), ElementsAre(write_after_read));
}

TEST_F(HazardChecker, ReadsByTheCpuNeedABarrierBefore) {
    const auto list = [&](StageMask destination) {
        return List()
            .command(CommandType::CopyBuffer, {writes(a, Stage::Copy)})
            .barrier(copy, destination)
            .command(CommandType::HostRead, {reads(a, Stage::Host)});
    };
    EXPECT_THAT(judged(list(stages(Stage::Host))), IsEmpty());
    EXPECT_THAT(judged(List().barrier(copy, copy)), IsEmpty());
    // The next write needs no barrier after the read by the CPU, which the program itself waits for.
    EXPECT_THAT(judged(list(compute)), ElementsAre(read_after_write));
}

// Transitions.

TEST_F(HazardChecker, LayoutsMustAgree) {
    const Touch stored{&image, Stage::Compute, AccessWrite, Layout::General};
    const Touch sampled{&image, Stage::Fragment, AccessRead, Layout::Sampled};
    EXPECT_THAT(judged(List().dispatch({stored})), ElementsAre("hazard.layout"));
    checker = makeChecker();
    EXPECT_THAT(judged(List()
                           .turn(image, Layout::Undefined, Layout::General, compute, compute)
                           .dispatch({stored})
                           .barrier(compute, fragment)
                           .draw({sampled})),
                ElementsAre("hazard.layout"));
    EXPECT_THAT(judged(List().turn(image, Layout::CopySource, Layout::Sampled, compute | fragment, fragment)),
                ElementsAre("hazard.layout"));
}

TEST_F(HazardChecker, TransitionOrdersItsOwnSlice) {
    const Touch stored{&image, Stage::Compute, AccessWrite, Layout::General};
    const Touch sampled{&image, Stage::Fragment, AccessRead, Layout::Sampled};
    EXPECT_THAT(judged(List()
                           .turn(image, Layout::Undefined, Layout::General, 0, compute)
                           .dispatch({stored})
                           .turn(image, Layout::General, Layout::Sampled, compute, fragment)
                           .draw({sampled})
                           .turn(image, Layout::Sampled, Layout::General, fragment, compute)
                           .dispatch({stored})),
                IsEmpty());
}

TEST_F(HazardChecker, TransitionWaitsForEarlierAccesses) {
    const Touch stored{&image, Stage::Compute, AccessWrite, Layout::General};
    const Touch sampled{&image, Stage::Fragment, AccessRead, Layout::Sampled};
    EXPECT_THAT(judged(List()
                           .turn(image, Layout::Undefined, Layout::General, 0, compute)
                           .dispatch({stored})
                           .turn(image, Layout::General, Layout::Sampled, copy, fragment)),
                ElementsAre(write_after_write));
    EXPECT_THAT(judged(List().draw({sampled}).turn(image, Layout::Sampled, Layout::General, compute, compute)),
                ElementsAre(write_after_write, write_after_read));
    // An earlier barrier between the right stages does not hold back the transition, which waits for copies alone.
    EXPECT_THAT(judged(List()
                           .dispatch({stored})
                           .barrier(compute, fragment)
                           .turn(image, Layout::General, Layout::Sampled, copy, fragment)),
                ElementsAre(write_after_write));
}

TEST_F(HazardChecker, TransitionReachesItsDestinationOnly) {
    EXPECT_THAT(judged(List()
                           .turn(image, Layout::Undefined, Layout::General, 0, copy)
                           .dispatch({{&image, Stage::Compute, AccessWrite, Layout::General}})),
                ElementsAre(write_after_write));
    checker = makeChecker();
    EXPECT_THAT(judged(List()
                           .turn(image, Layout::Undefined, Layout::General, 0, copy)
                           .barrier(copy, compute)
                           .dispatch({{&image, Stage::Compute, AccessWrite, Layout::General}})),
                IsEmpty());
    checker = makeChecker();
    // The write came before the transition, so a barrier after the writing stage does not wait for the transition.
    EXPECT_THAT(judged(List()
                           .turn(image, Layout::Undefined, Layout::General, 0, copy)
                           .command(CommandType::ClearTexture, {{&image, Stage::Copy, AccessWrite, Layout::General}})
                           .turn(image, Layout::General, Layout::Sampled, copy, fragment)
                           .draw({{&image, Stage::Fragment, AccessRead, Layout::Sampled}})
                           .barrier(copy, compute)
                           .dispatch({{&image, Stage::Compute, AccessRead, Layout::Sampled}})),
                ElementsAre(read_after_write));
}

TEST_F(HazardChecker, TransitionOrdersOtherThingsButShowsNoWritesOfTheirs) {
    // Write after read needs order alone.
    EXPECT_THAT(judged(List()
                           .dispatch({reads(a, Stage::Compute)})
                           .turn(image, Layout::Undefined, Layout::General, compute, copy)
                           .command(CommandType::FillBuffer, {writes(a, Stage::Copy)})),
                IsEmpty());
    // A write needs a memory barrier.
    EXPECT_THAT(judged(List()
                           .dispatch({writes(b, Stage::Compute)})
                           .turn(image, Layout::Undefined, Layout::General, compute | copy, copy)
                           .command(CommandType::CopyBuffer, {reads(b, Stage::Copy)})),
                ElementsAre(read_after_write));
    // What a memory barrier has made available travels on: ordered by the transition, shown by the barrier after it.
    EXPECT_THAT(judged(List()
                           .dispatch({writes(c, Stage::Compute)})
                           .barrier(compute, copy)
                           .turn(image, Layout::Undefined, Layout::General, copy, fragment)
                           .barrier(fragment, color)
                           .draw({reads(c, Stage::ColorTarget)})),
                IsEmpty());
}

TEST_F(HazardChecker, TwoTransitionsOfOneSliceAtOnce) {
    EXPECT_THAT(judged(List().barrier(0, 0,
                                      {{&image, Layout::Undefined, Layout::General, compute, compute},
                                       {&image, Layout::General, Layout::Sampled, compute, fragment}})),
                ElementsAre(write_after_write));
}

TEST_F(HazardChecker, SubresourcesAreApart) {
    const Slice all{0, 3, 0, 2};
    const auto level = [](uint16_t mip, uint16_t layer) { return Slice{mip, 1, layer, 1}; };
    const auto touch = [&](uint8_t flags, Slice slice) {
        return Touch{&atlas, Stage::Compute, flags, Layout::General, slice};
    };
    List list;
    list.turn(atlas, Layout::Undefined, Layout::General, 0, compute, all);
    for (uint16_t layer = 0; layer < 2; layer++)
        for (uint16_t mip = 0; mip < 3; mip++) list.dispatch({touch(AccessWrite, level(mip, layer))});
    EXPECT_THAT(judged(list), IsEmpty());
    EXPECT_THAT(judged(List()
                           .barrier(compute, compute)
                           .dispatch({touch(AccessRead, level(0, 0)), touch(AccessWrite, level(1, 0))})),
                IsEmpty());
    EXPECT_THAT(judged(List().dispatch({touch(AccessRead, level(1, 1)), touch(AccessRead, level(2, 1))})), IsEmpty());
    EXPECT_THAT(judged(List().dispatch({touch(AccessRead, {0, 3, 0, 1})})), ElementsAre(read_after_write));
    EXPECT_THAT(findings[0].message(), HasSubstr("mip level 1, layer 0"));
}

TEST_F(HazardChecker, MipLevelsAreFilledOneFromTheOther) {
    const auto list = [&](StageMask between) {
        List made;
        made.turn(atlas, Layout::Undefined, Layout::CopyDestination, 0, copy, {0, 1, 0, 1});
        made.command(CommandType::CopyBufferToTexture,
                     {{&atlas, Stage::Copy, AccessWrite | AccessDiscard, Layout::CopyDestination, {0, 1, 0, 1}}});
        for (uint16_t mip = 1; mip < 3; mip++) {
            const auto below = static_cast<uint16_t>(mip - 1);
            made.barrier(0, 0,
                         {{&atlas, Layout::CopyDestination, Layout::CopySource, between, copy, {below, 1, 0, 1}},
                          {&atlas, Layout::Undefined, Layout::CopyDestination, 0, copy, {mip, 1, 0, 1}}});
            made.command(CommandType::CopyTexture,
                         {{&atlas, Stage::Copy, AccessRead, Layout::CopySource, {below, 1, 0, 1}},
                          {&atlas, Stage::Copy, AccessWrite | AccessDiscard, Layout::CopyDestination, {mip, 1, 0, 1}}});
        }
        return made;
    };
    EXPECT_THAT(judged(list(copy)), IsEmpty());
    checker = makeChecker();
    EXPECT_THAT(judged(list(0)), ElementsAre(write_after_write, write_after_write));
}

// Contents that a transition drops.

TEST_F(HazardChecker, DroppedContentsMustNotBeRead) {
    const Touch stored{&image, Stage::Compute, AccessWrite, Layout::General};
    const Touch loaded{&image, Stage::Compute, AccessRead, Layout::General};
    const Touch replaced{&image, Stage::Compute, AccessWrite | AccessDiscard, Layout::General};
    // A new texture has nothing to lose.
    EXPECT_THAT(judged(List()
                           .turn(image, Layout::Undefined, Layout::General, 0, compute)
                           .dispatch({stored})
                           .barrier(compute, compute)
                           .dispatch({loaded})),
                IsEmpty());
    EXPECT_THAT(judged(List().turn(image, Layout::Undefined, Layout::General, compute, compute).dispatch({loaded})),
                ElementsAre("hazard.discard"));
    EXPECT_THAT(
        judged(List().barrier(compute, compute).dispatch({stored}).barrier(compute, compute).dispatch({loaded})),
        ElementsAre("hazard.discard"));
    EXPECT_THAT(
        judged(List().barrier(compute, compute).dispatch({replaced}).barrier(compute, compute).dispatch({loaded})),
        IsEmpty());
}

// Targets.

TEST_F(HazardChecker, DrawsToATargetNeedNoOrder) {
    Thing depth{.id = 30, .mips = 1, .layers = 1, .name = "depth"};
    const StageMask depth_stage = stages(Stage::DepthTarget);
    EXPECT_THAT(judged(List()
                           .barrier(0, 0,
                                    {{&image, Layout::Undefined, Layout::ColorTarget, 0, color},
                                     {&depth, Layout::Undefined, Layout::DepthTarget, 0, depth_stage}})
                           .begin({{&image, Stage::ColorTarget, AccessWrite | AccessDiscard, Layout::ColorTarget},
                                   {&depth, Stage::DepthTarget, AccessWrite | AccessDiscard, Layout::DepthTarget}})
                           .draw({reads(a, Stage::VertexInput)})
                           .draw({reads(a, Stage::VertexInput)})
                           .end()
                           .turn(image, Layout::ColorTarget, Layout::Sampled, color, compute)
                           .dispatch({{&image, Stage::Compute, AccessRead, Layout::Sampled}})),
                IsEmpty());
}

TEST_F(HazardChecker, TwoTargetsNeedABarrierBetween) {
    const auto target = [&](List& list) {
        list.begin({{&image, Stage::ColorTarget, AccessRead | AccessWrite, Layout::ColorTarget}}).draw({}).end();
    };
    List apart, joined;
    apart.turn(image, Layout::Undefined, Layout::ColorTarget, 0, color);
    target(apart);
    apart.barrier(color, color);
    target(apart);
    EXPECT_THAT(judged(apart), IsEmpty());
    joined.barrier(color, color);
    target(joined);
    target(joined);
    EXPECT_THAT(judged(joined), ElementsAre(read_after_write));
}

TEST_F(HazardChecker, AttachmentsAreWrittenUntilTheEnd) {
    // The split's barrier orders the first half before the dispatch, not the second.
    const auto list = [&](bool again) {
        List made;
        made.turn(image, Layout::Undefined, Layout::ColorTarget, 0, color);
        made.begin({{&image, Stage::ColorTarget, AccessWrite | AccessDiscard, Layout::ColorTarget}});
        made.draw({});
        made.split(color | fragment, color | fragment | compute);
        made.draw({});
        made.end();
        made.barrier(0, 0, {{&image, Layout::ColorTarget, Layout::Sampled, again ? color : compute, compute}});
        made.dispatch({{&image, Stage::Compute, AccessRead, Layout::Sampled}});
        return made;
    };
    EXPECT_THAT(judged(list(true)), IsEmpty());
    checker = makeChecker();
    EXPECT_THAT(judged(list(false)), ElementsAre(write_after_write));
}

TEST_F(HazardChecker, ConflictsBetweenDrawsNeedASplit) {
    const auto list = [&](int kind) {
        List made;
        made.turn(image, Layout::Undefined, Layout::ColorTarget, 0, color);
        made.begin({{&image, Stage::ColorTarget, AccessWrite | AccessDiscard, Layout::ColorTarget}});
        made.draw({writes(a, Stage::Fragment)});
        if (kind == 1) made.barrier(fragment | color, fragment | color);
        if (kind == 2) made.split(fragment | color, fragment | color);
        if (kind == 3) made.split(fragment, fragment);
        made.draw({reads(a, Stage::Fragment)});
        return made.end();
    };
    EXPECT_THAT(judged(list(0)), ElementsAre(read_after_write));
    checker = makeChecker();
    EXPECT_THAT(judged(list(1)), ElementsAre("hazard.split"));
    checker = makeChecker();
    EXPECT_THAT(judged(list(2)), IsEmpty());
    checker = makeChecker();
    // The second half loads what the first stored.
    EXPECT_THAT(judged(list(3)), ElementsAre(read_after_write));
    EXPECT_EQ(findings[0].object(), "'image'");
}

TEST_F(HazardChecker, SplitsBelongInTargets) {
    EXPECT_THAT(judged(List().split(compute, compute).dispatch({})), ElementsAre("hazard.split"));
    EXPECT_THAT(judged(List()
                           .turn(image, Layout::Undefined, Layout::ColorTarget, 0, color)
                           .begin({{&image, Stage::ColorTarget, AccessWrite, Layout::ColorTarget}})
                           .barrier(color, color)
                           .end()),
                ElementsAre("hazard.split"));
}

TEST_F(HazardChecker, DrawsMustNotUseTheirAttachments) {
    const Slice first{0, 1, 0, 1}, second{1, 1, 0, 1};
    const auto list = [&](Slice sampled) {
        List made;
        made.barrier(0, 0,
                     {{&atlas, Layout::Undefined, Layout::ColorTarget, color | fragment, color, first},
                      {&atlas, Layout::Undefined, Layout::Sampled, color | fragment, fragment, second}});
        made.begin({{&atlas, Stage::ColorTarget, AccessWrite | AccessDiscard, Layout::ColorTarget, first}});
        made.draw({{&atlas, Stage::Fragment, AccessRead, Layout::Sampled, sampled}});
        return made.end();
    };
    EXPECT_THAT(judged(list(second)), IsEmpty());
    EXPECT_THAT(judged(list(first)), ElementsAre("hazard.feedback"));
}

TEST_F(HazardChecker, WhoStoresNothingMayReadAnything) {
    EXPECT_THAT(judged(List()
                           .turn(image, Layout::Undefined, Layout::ColorTarget, 0, color)
                           .begin({{&image, Stage::ColorTarget, AccessWrite | AccessDiscard, Layout::ColorTarget}},
                                  detail::StoreOperation::Discard)
                           .end()
                           .turn(image, Layout::Undefined, Layout::Sampled, color, fragment)
                           .draw({{&image, Stage::Fragment, AccessRead, Layout::Sampled}})),
                IsEmpty());
}

// Queues.

TEST_F(HazardChecker, QueuesAreApartUntilOneWaits) {
    EXPECT_THAT(judged(List().dispatch({writes(a, Stage::Compute), writes(b, Stage::Compute)})), IsEmpty());
    EXPECT_THAT(judged(List().barrier(compute, compute).dispatch({reads(a, Stage::Compute)}), Queue::Compute),
                ElementsAre(read_after_write));
    EXPECT_THAT(judged(List().dispatch({reads(b, Stage::Compute)}), Queue::Compute, {{Queue::Main, 1}}), IsEmpty());
}

TEST_F(HazardChecker, WaitsOrderEverythingUpToTheirValue) {
    EXPECT_THAT(judged(List().dispatch({writes(a, Stage::Compute)})), IsEmpty());
    EXPECT_THAT(judged(List().dispatch({writes(b, Stage::Compute)})), IsEmpty());
    EXPECT_THAT(judged(List().dispatch({writes(c, Stage::Compute)})), IsEmpty());
    EXPECT_THAT(
        judged(List().dispatch({reads(a, Stage::Copy), reads(b, Stage::Copy)}), Queue::Copy, {{Queue::Main, 2}}),
        IsEmpty());
    EXPECT_THAT(judged(List().dispatch({reads(c, Stage::Copy)}), Queue::Copy), ElementsAre(read_after_write));
}

TEST_F(HazardChecker, WaitsServeLaterSubmissionsToo) {
    EXPECT_THAT(judged(List().dispatch({reads(a, Stage::Compute)})), IsEmpty());
    EXPECT_THAT(judged(List(), Queue::Copy, {{Queue::Main, 1}}), IsEmpty());
    EXPECT_THAT(judged(List().command(CommandType::FillBuffer, {writes(a, Stage::Copy)}), Queue::Copy), IsEmpty());
}

TEST_F(HazardChecker, OrderPassesFromQueueToQueue) {
    EXPECT_THAT(judged(List().dispatch({writes(a, Stage::Compute)})), IsEmpty());
    EXPECT_THAT(judged(List().dispatch({}), Queue::Compute, {{Queue::Main, 1}}), IsEmpty());
    EXPECT_THAT(
        judged(List().command(CommandType::CopyBuffer, {reads(a, Stage::Copy)}), Queue::Copy, {{Queue::Compute, 1}}),
        IsEmpty());
}

TEST_F(HazardChecker, WaitOfTheOtherQueueCarriesNothingBack) {
    EXPECT_THAT(judged(List().dispatch({reads(a, Stage::Compute)})), IsEmpty());
    EXPECT_THAT(judged(List().dispatch({reads(a, Stage::Compute)}), Queue::Compute, {{Queue::Main, 1}}), IsEmpty());
    EXPECT_THAT(judged(List().barrier(compute, compute).dispatch({writes(a, Stage::Compute)})),
                ElementsAre(write_after_read));
}

TEST_F(HazardChecker, TransitionAfterAWait) {
    const Touch stored{&image, Stage::Compute, AccessWrite, Layout::General};
    EXPECT_THAT(
        judged(List().turn(image, Layout::Undefined, Layout::General, 0, compute).dispatch({stored}), Queue::Compute),
        IsEmpty());
    // Without a source the transition does not even wait for what the wait ordered.
    null::HazardChecker before = checker;
    EXPECT_THAT(
        judged(List().turn(image, Layout::General, Layout::Sampled, 0, fragment), Queue::Main, {{Queue::Compute, 1}}),
        ElementsAre(write_after_write));
    checker = before;
    EXPECT_THAT(judged(List()
                           .turn(image, Layout::General, Layout::Sampled, detail::stage_all, fragment)
                           .draw({{&image, Stage::Fragment, AccessRead, Layout::Sampled}}),
                       Queue::Main, {{Queue::Compute, 1}}),
                IsEmpty());
    checker = before;
    // Any stage will do: the wait holds all of them.
    EXPECT_THAT(judged(List().turn(image, Layout::General, Layout::Sampled, color, fragment), Queue::Main,
                       {{Queue::Compute, 1}}),
                IsEmpty());
    checker = before;
    EXPECT_THAT(judged(List().turn(image, Layout::General, Layout::Sampled, detail::stage_all, fragment)),
                ElementsAre(write_after_write));
}

TEST_F(HazardChecker, TransitionForAnotherQueue) {
    EXPECT_THAT(judged(List().turn(image, Layout::Undefined, Layout::General, 0, 0)), IsEmpty());
    EXPECT_THAT(judged(List().dispatch({{&image, Stage::Compute, AccessWrite, Layout::General}}), Queue::Compute,
                       {{Queue::Main, 1}}),
                IsEmpty());
}

// What is said.

TEST_F(HazardChecker, MessageNamesBothCommands) {
    EXPECT_THAT(judged(List("upload").command(CommandType::CopyInline, {writes(a, Stage::Copy)})), IsEmpty());
    EXPECT_THAT(judged(List("frame").push("shadows").push("blur").dispatch({reads(a, Stage::Compute)}).pop().pop()),
                ElementsAre(read_after_write));
    EXPECT_EQ(findings[0].code(), ErrorCode::Internal);
    EXPECT_EQ(findings[0].object(), "'a'");
    EXPECT_EQ(findings[0].message(),
              "'a': dispatch 2 of 'frame' in shadows/blur (main 2) reads at Compute what inline copy 0 of 'upload' "
              "(main 1) wrote at Copy; nothing makes the write visible to it");
}

TEST_F(HazardChecker, UntrackedCommandsAreTheCallersAffair) {
    EXPECT_THAT(judged(List()
                           .dispatch({writes(a, Stage::Compute)})
                           .command(CommandType::Dispatch, {reads(a, Stage::Compute)}, true)),
                ElementsAre(read_after_write));
    EXPECT_EQ(findings[0].code(), ErrorCode::InvalidArgument);
}

// Dispatches of one command.

TEST_F(HazardChecker, DispatchesSideBySideMustNotMeet) {
    const Side change = {{changes(a, Stage::Compute), reads(c, Stage::Compute)}};
    const Side change_other = {{changes(b, Stage::Compute), reads(c, Stage::Compute)}};
    EXPECT_THAT(judged(List().dispatches({change, change_other})), IsEmpty());
    EXPECT_THAT(judged(List().barrier(compute, compute).dispatches({change, change_other, change})),
                ElementsAre("hazard.side_by_side"));
    EXPECT_EQ(findings[0].object(), "'a'");
    EXPECT_THAT(findings[0].message(), HasSubstr("number 2 writes what number 0 writes"));
    EXPECT_THAT(judged(List().barrier(compute, compute).dispatches({change, {{reads(a, Stage::Compute)}}})),
                ElementsAre("hazard.side_by_side"));
    EXPECT_THAT(judged(List().barrier(compute, compute).dispatches({{{reads(a, Stage::Compute)}}, change})),
                ElementsAre("hazard.side_by_side"));
}

TEST_F(HazardChecker, DispatchesSideBySideMayShareABufferInParts) {
    const auto part = [&](uint64_t offset, uint64_t size) {
        return Side{{changes(a, Stage::Compute)}, {{&a, offset, size}}};
    };
    EXPECT_THAT(judged(List().dispatches({part(0, 64), part(64, 64), part(192, 64), part(128, 64)})), IsEmpty());
    EXPECT_THAT(judged(List().barrier(compute, compute).dispatches({part(0, 64), part(128, 64), part(60, 8)})),
                ElementsAre("hazard.side_by_side"));
    // What is bound twice is used from the first to the last of it.
    const Side both = {{changes(a, Stage::Compute)}, {{&a, 0, 16}, {&a, 112, 16}}};
    EXPECT_THAT(judged(List().barrier(compute, compute).dispatches({both, part(64, 16)})),
                ElementsAre("hazard.side_by_side"));
    EXPECT_THAT(judged(List().barrier(compute, compute).dispatches({both, part(128, 16)})), IsEmpty());
}

TEST_F(HazardChecker, DispatchesSideBySideAreOrderedWithTheRest) {
    const Side change = {{changes(a, Stage::Compute)}};
    const Side change_other = {{changes(b, Stage::Compute)}};
    EXPECT_THAT(judged(List().dispatches({change, change_other}).dispatches({change, change_other})),
                ElementsAre(read_after_write, read_after_write));
    EXPECT_THAT(judged(List()
                           .barrier(compute, compute)
                           .dispatches({change, change_other})
                           .barrier(compute, compute)
                           .dispatch({reads(b, Stage::Compute)})),
                IsEmpty());
}

}  // namespace
}  // namespace glint::test
