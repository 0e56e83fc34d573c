// One level of nodes: which binary nodes become their children, as core/tracing/wide_tree.cpp chooses them. The list's
// order depends on the threads; what is written for each node does not.
#pragma once

#include <glint/tracing/build/binary.h>

// By how much a node lowers the height if it opens its highest children.
const uint GLINT_HEIGHT_PER_LEVEL = GLINT_NODE_WIDTH == 8u ? 3u : 2u;

// Of the node on its way: the first one's word, and how many there are. They take the place of the node's own costs and
// decisions, which nobody needs any more.
uint children;
uint child_count;

uint glintLeft(uint node) { return scratch[glintBinary(node)]; }
uint glintRight(uint node) { return scratch[glintBinary(node) + 1u]; }

void glintAddChild(uint child) { scratch[children + child_count++] = child; }

// The cheapest, as tree.h has decided.
void glintCollect(uint root) {
    // To be opened or not, and how many children each may become, four bits each.
    uint waiting[GLINT_NODE_WIDTH];
    uint most_of = GLINT_NODE_WIDTH;
    uint stacked = 1u;
    waiting[0] = root;
    while (stacked > 0u) {
        const uint child = waiting[--stacked];
        const uint most = most_of & 15u;
        most_of >>= 4;
        uint left = 0u;
        if (most > 1u && !glintIsLeaf(child))
            left = scratch[glintBinary(child) + GLINT_BINARY_DECISIONS] >> 3u * (most - 2u) & 7u;
        if (left == 0u) {
            glintAddChild(child);
        } else {
            waiting[stacked++] = glintRight(child);
            waiting[stacked++] = glintLeft(child);
            most_of = most_of << 8 | (most - left) << 4 | left;
        }
    }
}

// Opens children until there are as many as a node has or all are leaves: those of the largest boxes, or those that may be highest.
void glintOpen(bool highest, float scale) {
    while (child_count < GLINT_NODE_WIDTH) {
        uint best = GLINT_NONE;
        float most = -1.0;
        for (uint i = 0u; i < child_count; i++) {
            const uint child = scratch[children + i];
            if (glintIsLeaf(child)) continue;
            const float value =
                highest ? float(glintHeightBound(child)) : glintHalfArea(glintChildBox(child), scale);
            if (value > most) {
                best = i;
                most = value;
            }
        }
        if (best == GLINT_NONE) return;
        const uint opened = scratch[children + best];
        scratch[children + best] = glintLeft(opened);
        glintAddChild(glintRight(opened));
    }
}

// Leaves first, in the order that they have. Returns how many there are.
uint glintPartition() {
    uint leaves = 0u;
    for (uint c = 0u; c < child_count; c++) {
        const uint child = scratch[children + c];
        if (!glintIsLeaf(child)) continue;
        for (uint to = c; to > leaves; to--) scratch[children + to] = scratch[children + to - 1u];
        scratch[children + leaves++] = child;
    }
    return leaves;
}

void main() {
    const float scale = glintAreaScale();
    uint begin = build.list;
    for (uint level = 0u; level < build.step; level++) begin += scratch[GLINT_STATE_LISTED + level];
    const uint listed = scratch[GLINT_STATE_LISTED + build.step];
    const uint next = begin + listed;
    const uint levels_left = build.levels - 1u - build.step;
    GLINT_FOR(i, listed) {
        const uint node = scratch[begin + i];
        children = glintBinary(node) + GLINT_BINARY_CHILDREN;
        child_count = 0u;
        glintCollect(node);
        // So that no more than 4/7 of a packed node or 2/3 of a full one is there for each primitive: docs/tracing.md.
        glintOpen(false, scale);
        uint height = 0u;
        for (uint c = 0u; c < child_count; c++) {
            const uint child = scratch[children + c];
            if (!glintIsLeaf(child)) height = max(height, glintHeightBound(child));
        }
        if (height > GLINT_HEIGHT_PER_LEVEL * levels_left) {
            scratch[children] = node;
            child_count = 1u;
            glintOpen(true, scale);
        }
        const uint leaves = glintPartition();
        for (uint c = child_count; c < GLINT_NODE_WIDTH; c++) scratch[children + c] = GLINT_NONE;
        const uint inner = child_count - leaves;
        scratch[build.sums + 2u * node] = inner;
        scratch[build.sums + 2u * node + 1u] = leaves;
        if (inner == 0u) continue;
        const uint place = next + atomicAdd(scratch[GLINT_STATE_LISTED + build.step + 1u], inner);
        for (uint c = 0u; c < inner; c++) scratch[place + c] = scratch[children + leaves + c];
    }
}
