// Sums of the blocks before each block, in place, by one group; then what the passes that follow need to know.
// GLINT_STAGE 0: of visible splats. 1: of entries; sums end at 2^32 - 1.
#pragma once

#include <glint/splats/common.h>
#include <glint/splats/group.h>
#include <glint/splats/state.h>

layout(local_size_x = GLINT_GROUP) in;

layout(std430, binding = 1) buffer Sums { uint sums[]; };
const uint AT_ONCE = 8u;
layout(push_constant) uniform Work { uint count; } work;  // of blocks in stage 0

#if GLINT_STAGE == 1
shared uvec2 wide_sums[GLINT_GROUP];

// Low and high words of the sum over the group, in thread 0.
uvec2 sumOf(uvec2 value) {
    wide_sums[gl_LocalInvocationIndex] = value;
    barrier();
    for (uint distance = GLINT_GROUP / 2u; distance > 0u; distance /= 2u) {
        if (gl_LocalInvocationIndex < distance) {
            const uvec2 other = wide_sums[gl_LocalInvocationIndex + distance];
            uint carry;
            value.x = uaddCarry(value.x, other.x, carry);
            value.y += other.y + carry;
            wide_sums[gl_LocalInvocationIndex] = value;
        }
        barrier();
    }
    return value;
}
#endif

void main() {
#if GLINT_STAGE == 0
    const uint blocks = work.count;
#else
    const uint blocks = (state.splats.size + GLINT_BLOCK - 1u) / GLINT_BLOCK;
#endif
    const uint run = (blocks + GLINT_GROUP - 1u) / GLINT_GROUP;
    const uint begin = min(gl_LocalInvocationIndex * run, blocks), end = min(begin + run, blocks);
    // Several at a time, so that they are waited for together.
    uvec2 own = uvec2(0u);
    for (uint first = begin; first < end; first += AT_ONCE) {
        uint values[AT_ONCE];
        [[unroll]] for (uint i = 0u; i < AT_ONCE; i++) values[i] = first + i < end ? sums[first + i] : 0u;
        [[unroll]] for (uint i = 0u; i < AT_ONCE; i++) {
            uint carry;
            own.x = uaddCarry(own.x, values[i], carry);
            own.y += carry;
        }
    }
    uint total;
    uint sum = boundedSumBefore(own.y == 0u ? own.x : ~0u, total);
    for (uint first = begin; first < end; first += AT_ONCE) {
        uint values[AT_ONCE];
        [[unroll]] for (uint i = 0u; i < AT_ONCE; i++) values[i] = first + i < end ? sums[first + i] : 0u;
        [[unroll]] for (uint i = 0u; i < AT_ONCE; i++) {
            if (first + i < end) sums[first + i] = sum;
            uint carry;
            sum = uaddCarry(sum, values[i], carry);
            if (carry != 0u) sum = ~0u;
        }
    }
#if GLINT_STAGE == 0
    if (gl_LocalInvocationIndex != 0u) return;
    state.splats = Region(0u, frame.room, total, 0u);
    state.splat_groups = groupsFor((total + GLINT_BLOCK - 1u) / GLINT_BLOCK);
#else
    const uvec2 wanted = sumOf(own);
    if (gl_LocalInvocationIndex != 0u) return;
    const uint size = min(total, frame.capacity);
    state.entries = Region(0u, frame.capacity, size, 0u);
    state.entry_groups = groupsFor((size + GLINT_BLOCK - 1u) / GLINT_BLOCK);
    state.wanted_low = wanted.x;
    state.wanted_high = wanted.y;
    if (wanted.y > state.most_high || (wanted.y == state.most_high && wanted.x > state.most_low)) {
        state.most_low = wanted.x;
        state.most_high = wanted.y;
    }
#endif
}
