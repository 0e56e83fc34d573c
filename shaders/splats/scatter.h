// From visible splats in the order of their depth to entries of tiles' lists. Blocks of GLINT_BLOCK splats, a group each.
// GLINT_STAGE 0: how many entries a block has. 1: the entries: a tile and a splat each.
#pragma once

#include <glint/splats/footprints.h>
#include <glint/splats/group.h>
#include <glint/splats/state.h>
#include <glint/splats/tiles.h>

layout(local_size_x = GLINT_GROUP) in;
const uint RUN = GLINT_BLOCK / GLINT_GROUP;

layout(std430, binding = 3) readonly buffer Infos { uvec2 infos[]; };
layout(std430, binding = 4) readonly buffer Order { uint order[]; };
layout(std430, binding = 5) buffer Sums { uint sums[]; };
#if GLINT_STAGE == 1
layout(std430, binding = 6) writeonly buffer Entries { uint entries[]; };
#endif

void main() {
    const uint block = groupIndex();
    const uint count = state.splats.size;
    const uint begin = min(block * GLINT_BLOCK + gl_LocalInvocationIndex * RUN, count);
    const uint end = min(begin + RUN, count);
    uint own = 0u;
    for (uint i = begin; i < end; i++) own += infos[order[frame.room + i]].y;
    uint total;
    uint before = sumBefore(own, total);
#if GLINT_STAGE == 0
    if (gl_LocalInvocationIndex == 0u && block * GLINT_BLOCK < count) sums[block] = total;
#else
    if (begin == end) return;
    uint carry;
    uint place = uaddCarry(sums[block], before, carry);
    if (carry != 0u) return;
    for (uint i = begin; i < end && place < frame.capacity; i++) {
        const uint splat = order[frame.room + i];
        const Footprint f = readFootprint(splat);
        const uint stop = place + min(infos[splat].y, frame.capacity - place);
        const uvec2 rows = tileRows(f);
        for (uint row = rows.x; row < rows.y; row++) {
            const uvec2 span = tileSpan(f, row);
            for (uint column = span.x; column < span.y && place < stop; column++) {
                entries[place] = row * frame.tiles.x + column;
                entries[frame.capacity + place] = splat;
                place++;
            }
        }
        // Should the two kernels ever round differently: entries of no tile.
        for (; place < stop; place++) {
            entries[place] = frame.tiles.x * frame.tiles.y;
            entries[frame.capacity + place] = splat;
        }
    }
#endif
}
