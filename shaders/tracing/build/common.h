// What the kernels that build hierarchies have in common: their constants and the scratch memory. The plan of their
// dispatches is core/tracing/device_build.cpp; docs/tracing.md has the algorithm.
//
// GLINT_BUILD_HEAP 1 for those that reach the heap; GLINT_BUILD_COHERENT 1 where threads of one dispatch wait for what
// others have written. GLINT_TRACING_NODES names the form of nodes, as in the traversal.
#pragma once

#include <glint/tracing/node_form.h>

#ifndef GLINT_BUILD_HEAP
#define GLINT_BUILD_HEAP 0
#endif
#ifndef GLINT_BUILD_COHERENT
#define GLINT_BUILD_COHERENT 0
#endif

layout(local_size_x = 64) in;
const uint GLINT_GROUP = 64u;

// BuildConstants of core/tracing/detail/device_build.h.
layout(push_constant) uniform GlintBuild {
    uvec2 heap_address;
    uint hierarchy;
    uint kind;
    uint instances;
    uint primitives;
    uint count;
    uint step;
    uint levels;
    uint tie_bits;
    // Places in scratch memory, in words.
    uint boxes;     // 6 for each primitive
    uint keys;      // 2 for each: code, primitive
    uint keys_out;  // likewise
    uint nodes;     // 16 for each: see tree.h and refit.h
    uint list;
    uint sums;
    uint counts;
    uint first;
    uint geometry;
    uint data;
    uint stride;
    uint vertices;
    uint index_size;
    uint index;
} build;

#if GLINT_BUILD_HEAP
#define GLINT_TRACING_WRITE 1
#define GLINT_TRACING_POINTER build.heap_address
#include <glint/tracing/memory.h>
#endif

#if GLINT_BUILD_COHERENT
layout(set = 0, binding = 1) coherent buffer GlintScratch { uint scratch[]; };
#else
layout(set = 0, binding = 1) buffer GlintScratch { uint scratch[]; };
#endif

// The state, in front of the scratch memory.
const uint GLINT_STATE_BOX = 0u;      // of all active primitives: minimum and maximum by glintOrder
const uint GLINT_STATE_ACTIVE = 6u;   // number of them
const uint GLINT_STATE_LISTED = 16u;  // nodes of each level
const uint GLINT_STATE_TOTALS = 64u;  // of the rows that SortScan went through: digits; inner children and leaves
const uint GLINT_STATE_WORDS = 256u;

const uint GLINT_NONE = 0xffffffffu;
const uint GLINT_LEAF = 0x80000000u;
const float GLINT_MOST = 3.402823466e38;

// A loop over all there is to do, whatever the number of threads.
#define GLINT_FOR(i, count) \
    for (uint i = gl_GlobalInvocationID.x; i < (count); i += gl_NumWorkGroups.x * GLINT_GROUP)

// Unsigned integers in the order of floats.
uint glintOrder(float x) {
    const uint bits = floatBitsToUint(x);
    return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}
float glintUnorder(uint order) {
    return uintBitsToFloat((order & 0x80000000u) != 0u ? order & 0x7fffffffu : ~order);
}

struct GlintBox {
    vec3 low;
    vec3 high;
};
const GlintBox GLINT_EMPTY = GlintBox(vec3(GLINT_MOST), vec3(-GLINT_MOST));

GlintBox glintJoin(GlintBox a, GlintBox b) { return GlintBox(min(a.low, b.low), max(a.high, b.high)); }
bool glintIsEmpty(GlintBox box) { return box.low.x > box.high.x; }

GlintBox glintScratchBox(uint word) {
    return GlintBox(vec3(uintBitsToFloat(scratch[word]), uintBitsToFloat(scratch[word + 1u]),
                         uintBitsToFloat(scratch[word + 2u])),
                    vec3(uintBitsToFloat(scratch[word + 3u]), uintBitsToFloat(scratch[word + 4u]),
                         uintBitsToFloat(scratch[word + 5u])));
}
void glintSetScratchBox(uint word, GlintBox box) {
    for (uint i = 0u; i < 3u; i++) {
        scratch[word + i] = floatBitsToUint(box.low[i]);
        scratch[word + 3u + i] = floatBitsToUint(box.high[i]);
    }
}

GlintBox glintBounds() {
    GlintBox box;
    for (uint i = 0u; i < 3u; i++) {
        box.low[i] = glintUnorder(scratch[GLINT_STATE_BOX + i]);
        box.high[i] = glintUnorder(scratch[GLINT_STATE_BOX + 3u + i]);
    }
    return box;
}

// Finite and within max_coordinate, 2^100. By its bits: what comparisons do with NaN is not promised.
bool glintInRange(vec3 v) {
    return all(lessThanEqual(floatBitsToUint(v) & 0x7fffffffu, uvec3(0x71800000u)));
}
