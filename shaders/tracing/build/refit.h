// Refitting keeps the tree, whoever built it. GLINT_BUILD_REFIT 0: finds each node's parent. 1: finds the place of each
// primitive's record. 2: the nodes' boxes, from the leaves up: a thread climbs from each node without inner children,
// and of those that meet the last goes on.
//
// In scratch memory, 8 words for each node: 0 - 5 its box, 6 its parent, 7 how many of its children are done.
#pragma once

#define GLINT_BUILD_HEAP 1
#define GLINT_BUILD_COHERENT 1
#include <glint/tracing/build/encode.h>

const uint GLINT_NODE_PARENT = 6u;
const uint GLINT_NODE_DONE = 7u;

uint glintNodeWord(uint node) { return build.nodes + 8u * (node - 1u); }

#if GLINT_BUILD_REFIT == 0

void main() {
    const uint nodes = GLINT_TRACING_LOAD(build.hierarchy + 1u).y;
    GLINT_FOR(i, nodes) {
        const uint node = i + 1u;
        const uint header = GLINT_TRACING_LOAD(build.hierarchy + GLINT_NODE_TEXELS * node).z;
        scratch[glintNodeWord(node) + GLINT_NODE_DONE] = 0u;
        if (node == 1u) scratch[glintNodeWord(node) + GLINT_NODE_PARENT] = 0u;
        for (uint s = header & 15u; s < (header >> 4 & 15u); s++)
            scratch[glintNodeWord((header >> 8) + s & 0xffffffu) + GLINT_NODE_PARENT] = node;
    }
}

#elif GLINT_BUILD_REFIT == 1

void main() {
    const uvec4 places = GLINT_TRACING_LOAD(build.hierarchy + 1u);
    GLINT_FOR(i, places.w) {
        const uint row = GLINT_TRACING_LOAD(build.hierarchy + places.z + 3u * i + 2u).w;
        if (row < build.primitives) scratch[build.keys + 2u * row] = i;
    }
}

#else

// Of a record; empty if it has become inactive.
GlintBox glintRecordBox(uint texel) {
    const uvec4 texel0 = GLINT_TRACING_LOAD(texel);
    const uvec4 texel1 = GLINT_TRACING_LOAD(texel + 1u);
    const vec3 a = uintBitsToFloat(texel0.xyz);
    const vec3 b = uintBitsToFloat(uvec3(texel0.w, texel1.xy));
    if (!glintInRange(a) || !glintInRange(b)) return GLINT_EMPTY;
    if (build.kind != 0u) {
        if (all(lessThanEqual(a, b))) return GlintBox(a, b);
        return GLINT_EMPTY;
    }
    const vec3 c = uintBitsToFloat(uvec3(texel1.zw, GLINT_TRACING_LOAD(texel + 2u).x));
    if (!glintInRange(c)) return GLINT_EMPTY;
    return GlintBox(min(min(a, b), c), max(max(a, b), c));
}

// The node on its way: words 2 and 3, and the first record of all.
uvec2 header;
uint records;

GlintBox glintNodeChild(uint s) {
    if (s < (header.x & 15u)) return glintRecordBox(records + 3u * ((header.y >> 8) + s));
    return glintScratchBox(glintNodeWord((header.x >> 8) + s & 0xffffffu));
}

void main() {
    const GlintGrid grid = glintGrid(GLINT_TRACING_LOAD(build.hierarchy));
    const uvec4 places = GLINT_TRACING_LOAD(build.hierarchy + 1u);
    records = build.hierarchy + places.z;
    GLINT_FOR(i, places.y) {
        uint node = i + 1u;
        header = GLINT_TRACING_LOAD(build.hierarchy + GLINT_NODE_TEXELS * node).zw;
        if ((header.x & 15u) != (header.x >> 4 & 15u)) continue;
        for (;;) {
            const uint leaves = header.x & 15u;
            const uint count = header.x >> 4 & 15u;
            const GlintNodeTexels encoded =
                glintEncode(grid, count, leaves, (header.x >> 8) + leaves & 0xffffffu, header.y >> 8);
            glintStoreNode(build.hierarchy + GLINT_NODE_TEXELS * node, encoded);
            const uint parent = scratch[glintNodeWord(node) + GLINT_NODE_PARENT];
            if (parent == 0u) break;
            glintSetScratchBox(glintNodeWord(node), encoded.box);
            memoryBarrierBuffer();
            header = GLINT_TRACING_LOAD(build.hierarchy + GLINT_NODE_TEXELS * parent).zw;
            const uint done = atomicAdd(scratch[glintNodeWord(parent) + GLINT_NODE_DONE], 1u) + 1u;
            if (done < (header.x >> 4 & 15u) - (header.x & 15u)) break;
            memoryBarrierBuffer();
            node = parent;
        }
    }
}

#endif
