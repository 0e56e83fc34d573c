// The rules of the hazard checker for textures: layouts, transitions, contents that are dropped, and targets.

#include "hazard_rules.h"

namespace glint::test {
namespace {

using HazardImage = HazardChecker;

// Transitions.

TEST_F(HazardImage, LayoutsMustAgree) {
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

TEST_F(HazardImage, TransitionOrdersItsOwnSlice) {
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

TEST_F(HazardImage, TransitionWaitsForEarlierAccesses) {
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

TEST_F(HazardImage, TransitionReachesItsDestinationOnly) {
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

TEST_F(HazardImage, TransitionOrdersOtherThingsButShowsNoWritesOfTheirs) {
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

TEST_F(HazardImage, TwoTransitionsOfOneSliceAtOnce) {
    EXPECT_THAT(judged(List().barrier(0, 0,
                                      {{&image, Layout::Undefined, Layout::General, compute, compute},
                                       {&image, Layout::General, Layout::Sampled, compute, fragment}})),
                ElementsAre(write_after_write));
}

TEST_F(HazardImage, SubresourcesAreApart) {
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

TEST_F(HazardImage, MipLevelsAreFilledOneFromTheOther) {
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

TEST_F(HazardImage, DroppedContentsMustNotBeRead) {
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

TEST_F(HazardImage, DrawsToATargetNeedNoOrder) {
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

TEST_F(HazardImage, TwoTargetsNeedABarrierBetween) {
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

TEST_F(HazardImage, AttachmentsAreWrittenUntilTheEnd) {
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

TEST_F(HazardImage, ConflictsBetweenDrawsNeedASplit) {
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

TEST_F(HazardImage, SplitsBelongInTargets) {
    EXPECT_THAT(judged(List().split(compute, compute).dispatch({})), ElementsAre("hazard.split"));
    EXPECT_THAT(judged(List()
                           .turn(image, Layout::Undefined, Layout::ColorTarget, 0, color)
                           .begin({{&image, Stage::ColorTarget, AccessWrite, Layout::ColorTarget}})
                           .barrier(color, color)
                           .end()),
                ElementsAre("hazard.split"));
}

TEST_F(HazardImage, DrawsMustNotUseTheirAttachments) {
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

TEST_F(HazardImage, WhoStoresNothingMayReadAnything) {
    EXPECT_THAT(judged(List()
                           .turn(image, Layout::Undefined, Layout::ColorTarget, 0, color)
                           .begin({{&image, Stage::ColorTarget, AccessWrite | AccessDiscard, Layout::ColorTarget}},
                                  detail::StoreOperation::Discard)
                           .end()
                           .turn(image, Layout::Undefined, Layout::Sampled, color, fragment)
                           .draw({{&image, Stage::Fragment, AccessRead, Layout::Sampled}})),
                IsEmpty());
}

}  // namespace
}  // namespace glint::test
