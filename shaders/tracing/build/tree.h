// The binary tree over sorted keys, from the leaves up: a thread climbs from each primitive, and where two meet the
// second goes on. A subtree's sibling is on the side where keys differ less (Apetrei, "Fast and Simple Agglomerative LBVH
// Construction", 2014). What a node holds does not depend on who came first.
#pragma once

#define GLINT_BUILD_COHERENT 1
#include <glint/tracing/build/binary.h>

// The same memory as quads of words, for what is read and written together. Whatever goes through both names has a
// barrier between.
layout(set = 0, binding = 1) coherent buffer GlintQuads { uvec4 quads[]; };

// Costs for at most 1 .. 4 and 5 .. 7 children; of full nodes for at most 1 .. 3.
struct GlintCosts {
    vec4 few;
    vec3 many;
};

struct GlintSubtree {
    GlintBox box;
    GlintCosts costs;
};

GlintSubtree glintSubtree(uint child) {
    GlintSubtree result;
    if (glintIsLeaf(child)) {
        result.box = glintChildBox(child);
        result.costs = GlintCosts(vec4(0.0), vec3(0.0));
    } else {
        const uint quad = glintBinary(child) / 4u;
        const uvec2 begin = quads[quad].zw;
        const uvec4 end = quads[quad + 1u];
        result.box = GlintBox(uintBitsToFloat(uvec3(begin, end.x)), uintBitsToFloat(end.yzw));
        result.costs = GlintCosts(uintBitsToFloat(quads[quad + 2u]), uintBitsToFloat(quads[quad + 3u].xyz));
    }
    return result;
}

// Costs of a node over two subtrees, and how a node that may become 2, 3, .. children gives them out: three bits each,
// how many of them are the left one's, or 0 if the node stays one child.
#define GLINT_TRY(cost, count)  \
    if ((cost) < best) {        \
        best = cost;            \
        left_count = count;     \
    }
GlintCosts glintJoinCosts(GlintCosts left, GlintCosts right, float area, out uint decisions) {
    GlintCosts costs;
    float best = GLINT_MOST;
    uint left_count = 1u;
#if GLINT_TRACING_NODES == GLINT_NODES_FULL
    GLINT_TRY(left.few.x + right.few.z, 1u)
    GLINT_TRY(left.few.y + right.few.y, 2u)
    GLINT_TRY(left.few.z + right.few.x, 3u)
    decisions = left_count << 6;
    best += area;
    costs.few = vec4(best);
    left_count = 0u;
    GLINT_TRY(left.few.x + right.few.x, 1u)
    decisions |= left_count;
    costs.few.y = best;
    GLINT_TRY(left.few.x + right.few.y, 1u)
    GLINT_TRY(left.few.y + right.few.x, 2u)
    decisions |= left_count << 3;
    costs.few.z = best;
    costs.many = vec3(best);
#else
    GLINT_TRY(left.few.x + right.many.z, 1u)
    GLINT_TRY(left.few.y + right.many.y, 2u)
    GLINT_TRY(left.few.z + right.many.x, 3u)
    GLINT_TRY(left.few.w + right.few.w, 4u)
    GLINT_TRY(left.many.x + right.few.z, 5u)
    GLINT_TRY(left.many.y + right.few.y, 6u)
    GLINT_TRY(left.many.z + right.few.x, 7u)
    decisions = left_count << 18;
    best += area;
    costs.few.x = best;
    left_count = 0u;
    GLINT_TRY(left.few.x + right.few.x, 1u)
    decisions |= left_count;
    costs.few.y = best;
    GLINT_TRY(left.few.x + right.few.y, 1u)
    GLINT_TRY(left.few.y + right.few.x, 2u)
    decisions |= left_count << 3;
    costs.few.z = best;
    GLINT_TRY(left.few.x + right.few.z, 1u)
    GLINT_TRY(left.few.y + right.few.y, 2u)
    GLINT_TRY(left.few.z + right.few.x, 3u)
    decisions |= left_count << 6;
    costs.few.w = best;
    GLINT_TRY(left.few.x + right.few.w, 1u)
    GLINT_TRY(left.few.y + right.few.z, 2u)
    GLINT_TRY(left.few.z + right.few.y, 3u)
    GLINT_TRY(left.few.w + right.few.x, 4u)
    decisions |= left_count << 9;
    costs.many.x = best;
    GLINT_TRY(left.few.x + right.many.x, 1u)
    GLINT_TRY(left.few.y + right.few.w, 2u)
    GLINT_TRY(left.few.z + right.few.z, 3u)
    GLINT_TRY(left.few.w + right.few.y, 4u)
    GLINT_TRY(left.many.x + right.few.x, 5u)
    decisions |= left_count << 12;
    costs.many.y = best;
    GLINT_TRY(left.few.x + right.many.y, 1u)
    GLINT_TRY(left.few.y + right.many.x, 2u)
    GLINT_TRY(left.few.z + right.few.w, 3u)
    GLINT_TRY(left.few.w + right.few.z, 4u)
    GLINT_TRY(left.many.x + right.few.y, 5u)
    GLINT_TRY(left.many.y + right.few.x, 6u)
    decisions |= left_count << 15;
    costs.many.z = best;
#endif
    return costs;
}

void glintClimb(uint place, uint present, float scale) {
    uint begin = place;
    uint last = place;
    uint child = GLINT_LEAF | place;
    GlintSubtree subtree = glintSubtree(child);
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
        const GlintSubtree other = glintSubtree(sibling);
        subtree.box = glintJoin(subtree.box, other.box);
        GlintCosts left = other.costs;
        GlintCosts right = subtree.costs;
        if (is_left) {
            left = subtree.costs;
            right = other.costs;
        }
        uint decisions;
        subtree.costs = glintJoinCosts(left, right, glintHalfArea(subtree.box, scale), decisions);
        const uint quad = node / 4u;
        const uvec3 low = floatBitsToUint(subtree.box.low);
        quads[quad] = uvec4(is_left ? uvec2(child, sibling) : uvec2(sibling, child), low.xy);
        quads[quad + 1u] = uvec4(low.z, floatBitsToUint(subtree.box.high));
        quads[quad + 2u] = floatBitsToUint(subtree.costs.few);
        quads[quad + 3u] = uvec4(floatBitsToUint(subtree.costs.many), decisions);
        child = parent;
    }
    // The root is the first node of the first level.
    if (!glintIsLeaf(child)) {
        scratch[build.list] = child;
        scratch[GLINT_STATE_LISTED] = 1u;
    }
}

void main() {
    const uint present = scratch[GLINT_STATE_ACTIVE];
    const float scale = glintAreaScale();
    if (present < 2u && gl_GlobalInvocationID.x == 0u) {
        scratch[build.list] = 0u;
        scratch[glintBinary(0u) + GLINT_BINARY_CHILDREN] = present == 1u ? GLINT_LEAF : GLINT_NONE;
        scratch[glintBinary(0u) + GLINT_BINARY_CHILDREN + 1u] = GLINT_NONE;
    }
    // One more than there are gaps: the root of a single primitive, again.
    GLINT_FOR(i, max(build.primitives, 1u)) {
        scratch[build.sums + 2u * i] = 0u;
        scratch[build.sums + 2u * i + 1u] = 0u;
        if (i < present && present > 1u) glintClimb(i, present, scale);
    }
}
