// What the passes of the splat renderer share: the picture, the projected splat, and sums over a group.
#pragma once

// What all passes of a draw know.
layout(std140, set = 0, binding = 0) uniform Frame {
    vec2 half_size;  // of the picture, pixels
    uvec2 size;
    uvec2 tiles;
    float log_cut;    // of the least alpha, to the base 2
    float stop;       // least transmittance
    uint room;        // splats
    uint capacity;    // entries of the tiles' lists
    float low_pass;   // pixels^2
    float near;
    uint first_depth;  // bits of the least view depth
    uint last_key;     // sort keys of depths are from 0 to it
    uint antialiased;
    uint key_bits;     // of sort keys, at most 31; above them is how many tiles a splat reaches, as far as it fits
} frame;

// A splat on the picture, 32 bytes. Coordinates are relative to the picture's middle, so that their rounding is
// least; y points down. With d a pixel's offset from the center, its alpha is
//
//     2^(log_opacity - (scale_x d.x)^2 - (scale_y (d.y - shear d.x))^2)
//
// which is opacity * exp(-1/2 d^T C^-1 d) with the Cholesky factors of C^-1: no sum in it cancels.
struct Footprint {
    vec2 center;  // pixels
    float shear;
    float scale_x;
    float scale_y;
    float log_opacity;  // to the base 2
    uvec2 color;
};

// Three values of at least 0, with 8 bits of exponent and 13 of mantissa: rounded by at most 2^-14 of themselves.
uvec2 packColor(vec3 color) {
    const uvec3 bits = min((floatBitsToUint(color) + 0x1ffu + ((floatBitsToUint(color) >> 10) & 1u)) >> 10, uvec3(0x1fdfffu));
    return uvec2(bits.x | bits.y << 21, bits.y >> 11 | bits.z << 10);
}

vec3 unpackColor(uvec2 word) {
    const uvec3 bits = uvec3(word.x & 0x1fffffu, word.x >> 21 | (word.y & 0x3ffu) << 11, word.y >> 10);
    return uintBitsToFloat(bits << 10);
}

// How many groups there are in a dispatch of one or two dimensions, and which one this is.
uint groupIndex() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }
