// Binary nodes. The one that splits the sorted primitives between g and g + 1 has the index g. In scratch memory, 16
// words for each:
//
//   0, 1    children: another's index, or GLINT_LEAF and a place among the sorted primitives
//   2 - 7   box
//   8 - 14  costs: the least sum of areas of the nodes below, if it gives its parent at most 1, 2, .. children, up to
//           one less than a node has
//   15      where the subtree that came first ends; then how the node gives out children: see tree.h
//
// and, once it has been chosen to become a node: from 8 on that node's children, leaves first, ended by GLINT_NONE; 0
// the node's place.
#pragma once

#include <glint/tracing/build/common.h>

const uint GLINT_BINARY_BOX = 2u;
const uint GLINT_BINARY_END = 15u;
const uint GLINT_BINARY_DECISIONS = 15u;
const uint GLINT_BINARY_CHILDREN = 8u;

uint glintBinary(uint index) { return build.nodes + 16u * index; }
bool glintIsLeaf(uint child) { return (child & GLINT_LEAF) != 0u; }

// The primitive at a place among the sorted ones.
uint glintPrimitiveAt(uint place) { return scratch[build.keys + 2u * place + 1u]; }

GlintBox glintChildBox(uint child) {
    if (glintIsLeaf(child)) return glintScratchBox(build.boxes + 6u * glintPrimitiveAt(child ^ GLINT_LEAF));
    return glintScratchBox(glintBinary(child) + GLINT_BINARY_BOX);
}

// Half of a box's surface, where the scene's largest extent is 1.
float glintHalfArea(GlintBox box, float scale) {
    const vec3 d = (box.high - box.low) * scale;
    return d.x * (d.y + d.z) + d.y * d.z;
}
float glintAreaScale() {
    const GlintBox bounds = glintBounds();
    const vec3 size = bounds.high - bounds.low;
    const float extent = max(size.x, max(size.y, size.z));
    return extent > 1e-30 ? 1.0 / extent : 0.0;
}

// What tells g from g + 1: the greater, the higher the first bit in which they differ. Codes first, then places.
uint glintDifference(uint g) {
    const uint codes = scratch[build.keys + 2u * g] ^ scratch[build.keys + 2u * (g + 1u)];
    return codes != 0u ? codes | 0x40000000u : g ^ (g + 1u);
}

// No less than the levels of binary nodes from this one down: the bits that are left.
uint glintHeightBound(uint g) {
    const uint difference = glintDifference(g);
    const uint bit = uint(findMSB(difference & 0x3fffffffu)) + 1u;
    return difference >= 0x40000000u ? build.tie_bits + bit : bit;
}

// Nodes to come, on all levels. There is one at least: tree.h makes the root of no primitive or one look like a node
// that has been chosen.
uint glintListed() {
    uint listed = 0u;
    for (uint level = 0u; level < build.levels; level++) listed += scratch[GLINT_STATE_LISTED + level];
    return max(listed, 1u);
}
