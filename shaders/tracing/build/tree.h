// The binary tree over sorted keys, from the leaves up: a thread climbs from each primitive, and where two meet the
// second goes on. A subtree's sibling is on the side where keys differ less (Apetrei, "Fast and Simple Agglomerative LBVH
// Construction", 2014). What a node holds does not depend on who came first.
#pragma once

#define GLINT_BUILD_COHERENT 1
#include <glint/tracing/build/binary.h>

void glintClimb(uint place, uint present, float scale) {
    uint begin = place;
    uint last = place;
    uint child = GLINT_LEAF | place;
    GlintBox box = glintChildBox(child);
    GlintCosts costs = glintCosts(child);
    while (begin != 0u || last != present - 1u) {
        const bool is_left =
            begin == 0u || (last != present - 1u && glintDifference(last) < glintDifference(begin - 1u));
        const uint parent = is_left ? last : begin - 1u;
        const uint node = glintBinary(parent);
        scratch[node + (is_left ? 0u : 1u)] = child;
        memoryBarrierBuffer();
        const uint end = atomicExchange(scratch[node + GLINT_BINARY_END], is_left ? begin : last);
        if (end == GLINT_NONE) return;
        memoryBarrierBuffer();
        if (is_left)
            last = end;
        else
            begin = end;
        const uint sibling = scratch[node + (is_left ? 1u : 0u)];
        const GlintCosts other = glintCosts(sibling);
        box = glintJoin(box, glintChildBox(sibling));
        glintSetScratchBox(node + GLINT_BINARY_BOX, box);
        GlintCosts left = other;
        GlintCosts right = costs;
        if (is_left) {
            left = costs;
            right = other;
        }
        uint unused;
        float cost = glintHalfArea(box, scale) + glintDistribute(left, right, 8u, unused);
        for (uint i = 1u; i <= 7u; i++) {
            if (i > 1u) cost = min(cost, glintDistribute(left, right, i, unused));
            costs.costs[i - 1u] = cost;
            scratch[node + GLINT_BINARY_COSTS + i - 1u] = floatBitsToUint(cost);
        }
        child = parent;
    }
    // The root is the first node of the first level; a single primitive has none.
    if (!glintIsLeaf(child)) {
        scratch[build.list] = child;
        scratch[GLINT_STATE_LISTED] = 1u;
    }
}

void main() {
    const uint present = scratch[GLINT_STATE_ACTIVE];
    const float scale = glintAreaScale();
    GLINT_FOR(i, build.primitives) {
        scratch[build.sums + 2u * i] = 0u;
        scratch[build.sums + 2u * i + 1u] = 0u;
        if (i < present) glintClimb(i, present, scale);
    }
}
