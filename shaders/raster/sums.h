// Numbers of tiles to first tiles, by one group: for devices without 64-bit atomics.
#pragma once

#include <glint/raster/common.h>

layout(local_size_x = GLINT_GROUP) in;

shared uint sums[GLINT_GROUP];

uint limitedSum(uint a, uint b) {
    uint carry;
    const uint sum = uaddCarry(a, b, carry);
    return carry != 0u ? ~0u : sum;
}

void main() {
    const uint count = min(state.places, ~state.cut);
    const uint local = gl_LocalInvocationIndex;
    const uint run = (count + GLINT_GROUP - 1u) / GLINT_GROUP;
    const uint begin = min(local * run, count), end = min(begin + run, count);
    uint own = 0u;
    for (uint i = begin; i < end; i++) own = limitedSum(own, larges[i].first_tile);
    sums[local] = own;
    barrier();
    uint first = 0u;
    for (uint i = 0u; i < local; i++) first = limitedSum(first, sums[i]);
    for (uint i = begin; i < end; i++) {
        const uint tiles = larges[i].first_tile;
        larges[i].first_tile = first;
        first = limitedSum(first, tiles);
        if (first == ~0u) {
            atomicMax(state.cut, ~i);
            state.is_crowded = 1u;
        }
    }
}
