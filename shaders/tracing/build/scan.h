// Running sums over the binary nodes of how many children, inner ones and leaves, each has once it is a node.
// GLINT_BUILD_SCAN 0: of each tile. 1: of each node, from the tiles' (sort.h has summed those).
#pragma once

#include <glint/tracing/build/common.h>

const uint GLINT_RUN = 16u;  // of a thread
const uint GLINT_TILE = GLINT_GROUP * GLINT_RUN;

shared uvec2 sums[GLINT_GROUP];

void main() {
    const uint local = gl_LocalInvocationIndex;
    const uint tile = gl_WorkGroupID.x;
    const uint begin = min(tile * GLINT_TILE + local * GLINT_RUN, build.primitives);
    const uint end = min(begin + GLINT_RUN, build.primitives);
    uvec2 sum = uvec2(0u);
    for (uint i = begin; i < end; i++) sum += uvec2(scratch[build.sums + 2u * i], scratch[build.sums + 2u * i + 1u]);
    sums[local] = sum;
    barrier();
#if GLINT_BUILD_SCAN == 0
    if (local != 0u) return;
    for (uint i = 1u; i < GLINT_GROUP; i++) sum += sums[i];
    scratch[build.counts + tile] = sum.x;
    scratch[build.counts + build.count + tile] = sum.y;
#else
    uvec2 before = uvec2(scratch[build.counts + tile], scratch[build.counts + build.count + tile]);
    for (uint i = 0u; i < local; i++) before += sums[i];
    for (uint i = begin; i < end; i++) {
        const uvec2 count = uvec2(scratch[build.sums + 2u * i], scratch[build.sums + 2u * i + 1u]);
        scratch[build.sums + 2u * i] = before.x;
        scratch[build.sums + 2u * i + 1u] = before.y;
        before += count;
    }
#endif
}
