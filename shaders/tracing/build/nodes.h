// The nodes, each at its place.
#pragma once

#define GLINT_BUILD_HEAP 1
#include <glint/tracing/build/binary.h>
#include <glint/tracing/build/encode.h>

uint children;  // of the node on its way: the first one's word

GlintBox glintNodeChild(uint s) { return glintChildBox(scratch[children + s]); }

void main() {
    const GlintGrid grid = glintGrid(GLINT_TRACING_LOAD(build.hierarchy));
    GLINT_FOR(i, glintListed()) {
        const uint node = scratch[build.list + i];
        children = glintBinary(node) + GLINT_BINARY_CHILDREN;
        uint count = 0u;
        uint leaves = 0u;
        for (; count < GLINT_NODE_WIDTH; count++) {
            const uint child = scratch[children + count];
            if (child == GLINT_NONE) break;
            if (glintIsLeaf(child)) leaves++;
        }
        const uint first_node = 2u + scratch[build.sums + 2u * node];
        const uint first_record = scratch[build.sums + 2u * node + 1u];
        glintStoreNode(build.hierarchy + GLINT_NODE_TEXELS * scratch[glintBinary(node)],
                       glintEncode(grid, count, leaves, first_node, first_record));
    }
}
