// From clip space to fixed point.
#pragma once

#include <glint/raster/common.h>

struct Corner {
    ivec2 at;     // fixed point; with CORNER_CLIP and CORNER_INVALID of no meaning
    float depth;
    uint flags;
};

const uint CORNER_OUTSIDE = 63u;    // a bit for each side of what is seen
const uint CORNER_CLIP = 64u;       // beyond what fixed point holds, or behind the eye
const uint CORNER_INVALID = 128u;   // not finite, or not there

// One order of operations for all kernels: a corner of several triangles is at one place.
vec4 transformPosition(vec3 p) {
    precise vec4 clip = frame.matrix[0] * p.x + (frame.matrix[1] * p.y + (frame.matrix[2] * p.z + frame.matrix[3]));
    return clip;
}

// By its bits: compilers may take for granted that there is no NaN.
bool isFinite(vec4 v) {
    const uvec4 bits = floatBitsToUint(v) & 0x7fffffffu;
    return max(max(bits.x, bits.y), max(bits.z, bits.w)) < 0x7f800000u;
}

uint sides(vec4 p) {
    return uint(p.x < -p.w) | uint(p.x > p.w) << 1 | uint(p.y < -p.w) << 2 | uint(p.y > p.w) << 3 |
           uint(p.z > p.w) << 4 | uint(p.z <= 0.0) << 5;
}

// x / w and y / w to fixed point, to the nearest, ties to even.
ivec2 toFixed(vec2 ndc) {
    precise vec2 scaled = ndc * frame.scale;
    return ivec2(roundEven(scaled)) + frame.middle;
}

Corner project(vec4 p) {
    Corner corner;
    const bool is_held = p.w > 0.0 && p.z <= p.w && p.z >= 0.0 && abs(p.x) <= frame.guard.x * p.w &&
                         abs(p.y) <= frame.guard.y * p.w;
    corner.flags = (isFinite(p) ? sides(p) : CORNER_INVALID) | (is_held ? 0u : CORNER_CLIP);
    precise vec3 ndc = p.xyz / (is_held ? p.w : 1.0);
    corner.at = is_held ? toFixed(ndc.xy) : ivec2(0);
    corner.depth = ndc.z;
    return corner;
}
