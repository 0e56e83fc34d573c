// Exclusive sums of regions {offset, size, -, -}, in place. GLINT_STAGE 0: the sum of each group's share of a region.
// 1: the share's elements, from the sums of those before it. 2: whole regions, a group each.
#pragma once

#include <glint/parallel/common.h>

#if GLINT_STAGE != 2
layout(std430, binding = 4) buffer Sums { uint sums[]; };
#endif

// Of elements in any order.
uint sumOf(uint begin, uint end) {
    uint sum = 0u;
    for (uint i = begin + gl_LocalInvocationIndex; i < end; i += GLINT_GROUP) sum += data[i];
    uint total;
    sumBefore(sum, total);
    return total;
}

void scan(uint begin, uint end, uint before) {
    for (uint tile = begin; tile < end; tile += GLINT_TILE) {
        const uint first = min(tile + gl_LocalInvocationIndex * GLINT_RUN, end);
        const uint last = min(first + GLINT_RUN, end);
        uint sum = 0u;
        for (uint i = first; i < last; i++) sum += data[i];
        uint total;
        sum = before + sumBefore(sum, total);
        for (uint i = first; i < last; i++) {
            const uint value = data[i];
            data[i] = sum;
            sum += value;
        }
        before += total;
    }
}

void main() {
    const uint group = gl_WorkGroupID.x;
    if (group >= work.groups) return;
    const uint count = regionCount();
#if GLINT_STAGE == 2
    for (uint i = group; i < count; i += work.groups) {
        const uint offset = regions[work.first + 4u * i], size = regions[work.first + 4u * i + 1u];
        if (isInside(offset, size))
            scan(offset, offset + size, 0u);
        else if (gl_LocalInvocationIndex == 0u)
            atomicAdd(report[0], 1u);
    }
#else
    if (count == 0u) return;
    const uint offset = regions[work.first], size = regions[work.first + 1u];
    if (!isInside(offset, size)) {
        if (GLINT_STAGE == 0 && gl_GlobalInvocationID.x == 0u) atomicAdd(report[0], 1u);
        return;
    }
    const uint share = shareOf(size);
    const uint begin = offset + min(group * share, size), end = offset + min((group + 1u) * share, size);
#if GLINT_STAGE == 0
    const uint sum = sumOf(begin, end);
    if (gl_LocalInvocationIndex == 0u) sums[group] = sum;
#else
    uint sum = 0u;
    for (uint i = gl_LocalInvocationIndex; i < group; i += GLINT_GROUP) sum += sums[i];
    uint before;
    sumBefore(sum, before);
    scan(begin, end, before);
#endif
#endif
}
