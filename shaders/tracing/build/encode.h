// Nodes as core/tracing/detail/node.h describes them, in integers: the unit is 2^-10 of the grid's step, 2^-8 of the
// finest plane's scale. docs/tracing.md, "Building on the device", shows that planes hold what they are to hold.
#pragma once

#include <glint/tracing/build/common.h>

struct GlintGrid {
    ivec3 minimum;       // in steps
    float inverse_step;  // a power of two
};

GlintGrid glintGrid(uvec4 header) {
    GlintGrid grid;
    grid.inverse_step = uintBitsToFloat(0x7f000000u - header.w);
    grid.minimum = ivec3(uintBitsToFloat(header.xyz) * grid.inverse_step);
    return grid;
}

// Places on the grid, below and above. The product by a power of two is exact, and so is the part after the point,
// unless the product is so small that it may be taken for 0: that is what the unit on either side is for.
uvec3 glintBelow(GlintGrid grid, vec3 v) {
    const vec3 place = v * grid.inverse_step;
    const vec3 whole = floor(place);
    return uvec3((ivec3(whole) - grid.minimum) << 10) + uvec3((place - whole) * 1024.0) - 1u;
}
uvec3 glintAbove(GlintGrid grid, vec3 v) {
    const vec3 place = v * grid.inverse_step;
    const vec3 whole = floor(place);
    return uvec3((ivec3(whole) - grid.minimum) << 10) + uvec3(ceil((place - whole) * 1024.0)) + 1u;
}

struct GlintNodeTexels {
    uvec4 texels[4];
};

// `count` children, the leaves first. An empty box becomes a point of the node.
GlintNodeTexels glintEncode(GlintGrid grid, GlintBox boxes[8], uint count, uint leaves, uint first_node,
                            uint first_record) {
    uvec3 low[8];
    uvec3 high[8];
    uvec3 all_low = uvec3(0xffffffffu);
    uvec3 all_high = uvec3(0u);
    for (uint s = 0u; s < count; s++) {
        if (glintIsEmpty(boxes[s])) continue;
        low[s] = glintBelow(grid, boxes[s].low);
        high[s] = glintAbove(grid, boxes[s].high);
        all_low = min(all_low, low[s]);
        all_high = max(all_high, high[s]);
    }
    GlintNodeTexels node;
    for (uint i = 0u; i < 4u; i++) node.texels[i] = uvec4(0u);
    uvec3 origins = uvec3(0u);
    uvec3 exponents = uvec3(0u);
    if (all_low.x <= all_high.x) {
        for (uint axis = 0u; axis < 3u; axis++) {
            // The smallest scale whose 255th plane, counted from a step that is one scale below everything, is not
            // below anything.
            uint exponent = uint(max(findMSB(all_high[axis] - all_low[axis]) - 15, 0));
            uint shift = exponent + 8u;
            uint origin = (all_low[axis] - (1u << shift)) >> 10;
            while ((origin << 10) + (255u << shift) < all_high[axis]) {
                exponent++;
                shift++;
                origin = (all_low[axis] - (1u << shift)) >> 10;
            }
            const uint base = origin << 10;
            uvec4 planes = uvec4(0u);
            for (uint s = 0u; s < count; s++) {
                const bool empty = glintIsEmpty(boxes[s]);
                const uint from = (empty ? all_low[axis] : low[s][axis]) - base;
                const uint to = (empty ? all_low[axis] : high[s][axis]) - base;
                // What the bytes before this one add to the plane, in units: from above for the low plane, from below
                // for the high one.
                const uint bits = 8u * (s & 3u);
                const uint before = (1u << bits) - 1u;
                const uint low_bits = planes[s / 4u] & before;
                const uint high_bits = planes[2u + s / 4u] & before;
                uint low_part = low_bits << (max(shift, bits) - bits);
                uint high_part = high_bits << (max(shift, bits) - bits);
                if (bits > shift) {
                    low_part = (low_bits + (1u << (bits - shift)) - 1u) >> (bits - shift);
                    high_part = high_bits >> (bits - shift);
                }
                const uint below = (from - low_part) >> shift;
                const uint above = (to - high_part + (1u << shift) - 1u) >> shift;
                planes[s / 4u] |= (below ^ 128u) << bits;
                planes[2u + s / 4u] |= (above ^ 128u) << bits;
            }
            node.texels[1u + axis] = planes;
            origins[axis] = origin;
            exponents[axis] = exponent;
        }
    }
    node.texels[0] = uvec4(origins.x | exponents.x << 20 | (origins.z & 255u) << 24,
                           origins.y | exponents.y << 20 | (origins.z >> 8 & 255u) << 24,
                           leaves | count << 4 | (first_node - leaves) << 8,
                           origins.z >> 16 | exponents.z << 4 | first_record << 8);
    return node;
}

void glintStoreNode(uint texel, GlintNodeTexels node) {
    for (uint i = 0u; i < 4u; i++) GLINT_TRACING_STORE(texel + i, node.texels[i]);
}
