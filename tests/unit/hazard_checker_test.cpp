// The rules of the hazard checker, one by one: what it has to find, and what it must not. Those of textures and targets
// are in hazard_image_test.cpp.

#include "hazard_rules.h"

namespace glint::test {
namespace {

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
