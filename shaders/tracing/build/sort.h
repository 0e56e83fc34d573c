// One stable pass of a radix sort, by six bits. GLINT_BUILD_SORT 0: how often each tile of keys has each digit. 1: sums
// of these, digit by digit (and of other tiles' counts: scan.h). 2: the keys to their places.
#pragma once

#include <glint/tracing/build/common.h>

const uint GLINT_DIGITS = 64u;
const uint GLINT_KEYS = 32u;  // of a thread
const uint GLINT_TILE = GLINT_GROUP * GLINT_KEYS;

#if GLINT_BUILD_SORT == 1

shared uint sums[GLINT_GROUP];

// A group for each row of counts.
void main() {
    const uint local = gl_LocalInvocationIndex;
    const uint row = build.counts + gl_WorkGroupID.x * build.count;
    const uint share = (build.count + GLINT_GROUP - 1u) / GLINT_GROUP;
    const uint begin = min(local * share, build.count);
    const uint end = min(begin + share, build.count);
    uint sum = 0u;
    for (uint i = begin; i < end; i++) sum += scratch[row + i];
    sums[local] = sum;
    barrier();
    uint before = 0u;
    for (uint i = 0u; i < local; i++) before += sums[i];
    if (local == GLINT_GROUP - 1u) scratch[GLINT_STATE_TOTALS + gl_WorkGroupID.x] = before + sum;
    for (uint i = begin; i < end; i++) {
        const uint count = scratch[row + i];
        scratch[row + i] = before;
        before += count;
    }
}

#else

// Counters of each digit and thread. A thread's keys follow one another, so that order is kept without looking at the
// others' keys. Rows are turned by the digit: threads of a row and digits of a column are in different banks.
shared uint counters[GLINT_DIGITS * GLINT_GROUP];
#define GLINT_COUNTER(digit, thread) counters[(digit)*GLINT_GROUP + ((thread) + (digit)) % GLINT_GROUP]

void main() {
    const uint local = gl_LocalInvocationIndex;
    const uint tile = gl_WorkGroupID.x;
    const uint begin = min(tile * GLINT_TILE + local * GLINT_KEYS, build.primitives);
    const uint end = min(begin + GLINT_KEYS, build.primitives);
    for (uint digit = 0u; digit < GLINT_DIGITS; digit++) GLINT_COUNTER(digit, local) = 0u;
    for (uint i = begin; i < end; i++)
        GLINT_COUNTER(scratch[build.keys + 2u * i] >> build.step & (GLINT_DIGITS - 1u), local)++;
    barrier();
    // Thread d looks after digit d.
#if GLINT_BUILD_SORT == 0
    uint sum = 0u;
    for (uint thread = 0u; thread < GLINT_GROUP; thread++) sum += GLINT_COUNTER(local, thread);
    scratch[build.counts + local * build.count + tile] = sum;
#else
    uint place = scratch[build.counts + local * build.count + tile];
    for (uint digit = 0u; digit < local; digit++) place += scratch[GLINT_STATE_TOTALS + digit];
    for (uint thread = 0u; thread < GLINT_GROUP; thread++) {
        const uint count = GLINT_COUNTER(local, thread);
        GLINT_COUNTER(local, thread) = place;
        place += count;
    }
    barrier();
    for (uint i = begin; i < end; i++) {
        const uint key = scratch[build.keys + 2u * i];
        const uint to = GLINT_COUNTER(key >> build.step & (GLINT_DIGITS - 1u), local)++;
        scratch[build.keys_out + 2u * to] = key;
        scratch[build.keys_out + 2u * to + 1u] = scratch[build.keys + 2u * i + 1u];
    }
#endif
}

#endif
