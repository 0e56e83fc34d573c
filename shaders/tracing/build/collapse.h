// One level of nodes: which binary nodes become their children, as core/tracing/wide_tree.cpp chooses them. The list's
// order depends on the threads; what is written for each node does not.
#pragma once

#include <glint/tracing/build/binary.h>

uint children[GLINT_WIDTH];
uint child_count;

uint glintLeft(uint node) { return scratch[glintBinary(node)]; }
uint glintRight(uint node) { return scratch[glintBinary(node) + 1u]; }

void glintAddChild(uint child) { children[child_count++] = child; }

// The cheapest, by the costs.
void glintCollect(uint root) {
    uint waiting[GLINT_WIDTH];
    uint most_of[GLINT_WIDTH];
    uint stacked = 1u;
    waiting[0] = root;
    most_of[0] = GLINT_WIDTH;
    child_count = 0u;
    while (stacked > 0u) {
        stacked--;
        const uint child = waiting[stacked];
        uint most = most_of[stacked];
        if (glintIsLeaf(child) || most == 1u) {
            glintAddChild(child);
            continue;
        }
        const uint left_child = glintLeft(child);
        const uint right_child = glintRight(child);
        const GlintCosts left = glintCosts(left_child);
        const GlintCosts right = glintCosts(right_child);
        uint left_most;
        float cost = glintDistribute(left, right, most, left_most);
        // As cheap with fewer.
        while (most > 1u && most < GLINT_WIDTH &&
               uintBitsToFloat(scratch[glintBinary(child) + GLINT_BINARY_COSTS + most - 2u]) <= cost) {
            most--;
            if (most > 1u) cost = glintDistribute(left, right, most, left_most);
        }
        if (most == 1u) {
            glintAddChild(child);
            continue;
        }
        waiting[stacked] = right_child;
        most_of[stacked++] = most - left_most;
        waiting[stacked] = left_child;
        most_of[stacked++] = left_most;
    }
}

// Opens children until there are eight or all are leaves: those of the largest boxes, or those that may be highest.
void glintOpen(bool highest, float scale) {
    while (child_count < GLINT_WIDTH) {
        uint best = GLINT_NONE;
        float most = -1.0;
        for (uint i = 0u; i < child_count; i++) {
            if (glintIsLeaf(children[i])) continue;
            const float value = highest ? float(glintHeightBound(children[i]))
                                        : glintHalfArea(glintChildBox(children[i]), scale);
            if (value > most) {
                best = i;
                most = value;
            }
        }
        if (best == GLINT_NONE) return;
        const uint opened = children[best];
        children[best] = glintLeft(opened);
        glintAddChild(glintRight(opened));
    }
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
        glintCollect(node);
        // So that no more than 4/7 of a node is there for each primitive: docs/tracing.md.
        glintOpen(false, scale);
        uint height = 0u;
        for (uint c = 0u; c < child_count; c++) {
            if (!glintIsLeaf(children[c])) height = max(height, glintHeightBound(children[c]));
        }
        if (height > 3u * levels_left) {
            children[0] = node;
            child_count = 1u;
            glintOpen(true, scale);
        }
        uint written = 0u;
        const uint to = glintBinary(node) + GLINT_BINARY_CHILDREN;
        for (uint c = 0u; c < child_count; c++) {
            if (glintIsLeaf(children[c])) scratch[to + written++] = children[c];
        }
        const uint leaves = written;
        for (uint c = 0u; c < child_count; c++) {
            if (!glintIsLeaf(children[c])) scratch[to + written++] = children[c];
        }
        for (uint c = child_count; c < GLINT_WIDTH; c++) scratch[to + c] = GLINT_NONE;
        const uint inner = child_count - leaves;
        scratch[build.sums + 2u * node] = inner;
        scratch[build.sums + 2u * node + 1u] = leaves;
        if (inner == 0u) continue;
        const uint place = next + atomicAdd(scratch[GLINT_STATE_LISTED + build.step + 1u], inner);
        for (uint c = 0u; c < inner; c++) scratch[place + c] = scratch[to + leaves + c];
    }
}
