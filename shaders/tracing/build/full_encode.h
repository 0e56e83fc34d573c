// Full nodes. Included by encode.h.
#pragma once

struct GlintGrid {
    vec3 minimum;
};

GlintGrid glintGrid(uvec4 header) { return GlintGrid(uintBitsToFloat(header.xyz)); }

// An empty box stays empty.
GlintNodeTexels glintEncode(GlintGrid grid, uint count, uint leaves, uint first_node, uint first_record) {
    GlintNodeTexels node;
    node.box = GLINT_EMPTY;
    uvec3 low[GLINT_NODE_WIDTH];
    uvec3 high[GLINT_NODE_WIDTH];
    for (uint s = 0u; s < GLINT_NODE_WIDTH; s++) {
        low[s] = uvec3(0u);
        high[s] = uvec3(0u);
        if (s >= count) continue;
        const GlintBox box = glintNodeChild(s);
        low[s] = floatBitsToUint(GLINT_EMPTY.low);
        high[s] = floatBitsToUint(GLINT_EMPTY.high);
        if (glintIsEmpty(box)) continue;
        node.box = glintJoin(node.box, box);
        // The difference is one of the two floats around the exact one, positive and normal, as the minimum lies more
        // than 4096 steps below. So the float before is not above, and the one after not below.
        precise vec3 to_low = box.low - grid.minimum;
        precise vec3 to_high = box.high - grid.minimum;
        low[s] = floatBitsToUint(to_low) - 1u;
        high[s] = floatBitsToUint(to_high) + 1u;
    }
    node.texels[0] = uvec4(0u, 0u, leaves | count << 4 | (first_node - leaves) << 8, first_record << 8);
    node.texels[7] = uvec4(0u);
    for (uint axis = 0u; axis < 3u; axis++) {
        node.texels[1u + 2u * axis] = uvec4(low[0][axis], low[1][axis], low[2][axis], low[3][axis]);
        node.texels[2u + 2u * axis] = uvec4(high[0][axis], high[1][axis], high[2][axis], high[3][axis]);
    }
    return node;
}
