// Places: of nodes, each node's children in a row, and of records, likewise. The word of a primitive's code becomes that
// of its record's place, NONE if it has none.
#pragma once

#include <glint/tracing/build/binary.h>

void main() {
    const uint present = scratch[GLINT_STATE_ACTIVE];
    GLINT_FOR(i, glintListed()) {
        const uint node = scratch[build.list + i];
        if (i == 0u) scratch[glintBinary(node)] = 1u;
        const uint first_node = 2u + scratch[build.sums + 2u * node];
        const uint first_record = scratch[build.sums + 2u * node + 1u];
        uint leaves = 0u;
        for (uint c = 0u; c < GLINT_NODE_WIDTH; c++) {
            const uint child = scratch[glintBinary(node) + GLINT_BINARY_CHILDREN + c];
            if (child == GLINT_NONE) break;
            if (glintIsLeaf(child)) {
                scratch[build.keys + 2u * glintPrimitiveAt(child ^ GLINT_LEAF)] = first_record + c;
                leaves++;
            } else {
                scratch[glintBinary(child)] = first_node + c - leaves;
            }
        }
    }
    GLINT_FOR(i, build.primitives) {
        if (i >= present) scratch[build.keys + 2u * glintPrimitiveAt(i)] = GLINT_NONE;
    }
}
