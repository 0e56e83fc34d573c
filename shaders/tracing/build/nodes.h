// The nodes, each at its place.
#pragma once

#define GLINT_BUILD_HEAP 1
#include <glint/tracing/build/binary.h>
#include <glint/tracing/build/encode.h>

void main() {
    const GlintGrid grid = glintGrid(GLINT_TRACING_LOAD(build.hierarchy));
    const uint present = scratch[GLINT_STATE_ACTIVE];
    uint listed = 0u;
    for (uint level = 0u; level < build.levels; level++) listed += scratch[GLINT_STATE_LISTED + level];
    GlintBox boxes[8];
    // The root of no primitive or one is no binary node.
    if (present < 2u && gl_GlobalInvocationID.x == 0u) {
        if (present == 1u) boxes[0] = glintChildBox(GLINT_LEAF);
        glintStoreNode(build.hierarchy + 4u, glintEncode(grid, boxes, present, present, present, 0u));
    }
    GLINT_FOR(i, listed) {
        const uint node = scratch[build.list + i];
        uint count = 0u;
        uint leaves = 0u;
        for (; count < GLINT_WIDTH; count++) {
            const uint child = scratch[glintBinary(node) + GLINT_BINARY_CHILDREN + count];
            if (child == GLINT_NONE) break;
            boxes[count] = glintChildBox(child);
            if (glintIsLeaf(child)) leaves++;
        }
        const GlintNodeTexels encoded = glintEncode(grid, boxes, count, leaves, 2u + scratch[build.sums + 2u * node],
                                                    scratch[build.sums + 2u * node + 1u]);
        glintStoreNode(build.hierarchy + 4u * scratch[glintBinary(node)], encoded);
    }
}
