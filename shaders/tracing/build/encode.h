// Nodes as core/tracing/detail/node.h describes them:
//
//   GlintGrid glintGrid(uvec4 header)   from the hierarchy's first texel
//   GlintNodeTexels glintEncode(GlintGrid grid, uint count, uint leaves, uint first_node, uint first_record)
//                                       `count` children, the leaves first
#pragma once

#include <glint/tracing/build/common.h>

struct GlintNodeTexels {
    uvec4 texels[GLINT_NODE_TEXELS];
    GlintBox box;  // of all children
};

// The box of a child of the node to encode, which may be empty. Whoever includes this defines it.
GlintBox glintNodeChild(uint s);

#if GLINT_TRACING_NODES == GLINT_NODES_PACKED
#include <glint/tracing/build/packed_encode.h>
#else
#include <glint/tracing/build/full_encode.h>
#endif

void glintStoreNode(uint texel, GlintNodeTexels node) {
    for (uint i = 0u; i < GLINT_NODE_TEXELS; i++) GLINT_TRACING_STORE(texel + i, node.texels[i]);
}
