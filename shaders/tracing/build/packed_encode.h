// Packed nodes, in integers: the unit is 2^-10 of the grid's step, 2^-8 of the finest plane's scale. docs/tracing.md,
// "Building on the device", shows that planes hold what they are to hold. Included by encode.h.
#pragma once

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

// All three axes at once, and boxes are read twice: arrays of them would take longer
// to compile and to run.
GlintNodeTexels glintEncode(GlintGrid grid, uint count, uint leaves, uint first_node, uint first_record) {
    GlintNodeTexels node;
    node.box = GLINT_EMPTY;
    for (uint s = 0u; s < count; s++) node.box = glintJoin(node.box, glintNodeChild(s));
    uvec3 origin = uvec3(0u);
    uvec3 exponent = uvec3(0u);
    uvec3 planes[4];  // of the children 0-3 and 4-7: low ones, high ones
    for (uint i = 0u; i < 4u; i++) planes[i] = uvec3(0u);
    if (!glintIsEmpty(node.box)) {
        const uvec3 all_low = glintBelow(grid, node.box.low);
        const uvec3 all_high = glintAbove(grid, node.box.high);
        // The smallest scale whose 255th plane, counted from a step that is one scale below everything, is not below
        // anything. With the highest bit of the extent, m, 254 scales of 2^(m - 7) may just not do; twice that does.
        exponent = uvec3(max(findMSB(all_high - all_low) - 15, ivec3(0)));
        origin = (all_low - (uvec3(256u) << exponent)) >> 10;
        exponent += uvec3(lessThan((origin << 10) + (uvec3(65280u) << exponent), all_high));
        origin = (all_low - (uvec3(256u) << exponent)) >> 10;
        const uvec3 base = origin << 10;
        const uvec3 shift = exponent + 8u;
        const uvec3 rest = (uvec3(1u) << shift) - 1u;
        uvec3 low_word = uvec3(0u);
        uvec3 high_word = uvec3(0u);
        for (uint s = 0u; s < count; s++) {
            const GlintBox box = glintNodeChild(s);
            uvec3 from = all_low - base;
            uvec3 to = from;
            if (!glintIsEmpty(box)) {
                from = glintBelow(grid, box.low) - base;
                to = glintAbove(grid, box.high) - base;
            }
            // What the bytes before this one add to the plane, in units: from above for the low plane, from below for
            // the high one.
            const uint bits = 8u * (s & 3u);
            const uvec3 up = max(shift, uvec3(bits)) - bits;
            const uvec3 down = max(shift, uvec3(bits)) - shift;
            const uvec3 low_part = ((low_word << up) + (uvec3(1u) << down) - 1u) >> down;
            const uvec3 high_part = (high_word << up) >> down;
            low_word |= ((from - low_part) >> shift ^ 128u) << bits;
            high_word |= ((to - high_part + rest) >> shift ^ 128u) << bits;
            if (bits == 24u || s + 1u == count) {
                planes[s < 4u ? 0 : 1] = low_word;
                planes[s < 4u ? 2 : 3] = high_word;
                low_word = uvec3(0u);
                high_word = uvec3(0u);
            }
        }
    }
    node.texels[0] = uvec4(origin.x | exponent.x << 20 | (origin.z & 255u) << 24,
                           origin.y | exponent.y << 20 | (origin.z >> 8 & 255u) << 24,
                           leaves | count << 4 | (first_node - leaves) << 8,
                           origin.z >> 16 | exponent.z << 4 | first_record << 8);
    for (uint axis = 0u; axis < 3u; axis++)
        node.texels[1u + axis] = uvec4(planes[0][axis], planes[1][axis], planes[2][axis], planes[3][axis]);
    return node;
}
