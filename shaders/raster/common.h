// What the kernels of the compute rasteriser share: the draw, its lists, and how a pixel is written.
// docs/rasterization.md explains the numbers.
//
// GLINT_OUTPUT 0: depth and triangle by one 64-bit atomic. 1, 2: by 32-bit ones, first the depth, then the triangle of
// that depth. 3: counts of triangles. GLINT_WIDE 1: there are 64-bit atomics. GLINT_PEEK 1: looks before it writes, which
// pays where atomics are dearer than loads.
#pragma once

layout(std140, set = 0, binding = 0) uniform Frame {
    mat4 matrix;     // from the mesh, or the world, to clip space
    vec2 scale;      // from x / w and y / w to fixed point, about the picture's middle
    vec2 guard;      // |x / w| and |y / w| that fixed point holds: powers of two
    ivec2 middle;    // of the picture, fixed point
    ivec2 size;      // pixels
    uint cull;       // 1: front faces are kept, 2: back faces, 3: both
    uint first_id;
    uint triangles;  // of a mesh
    uint vertices;
    uint position_first, position_stride;  // words
    uint index_first;                      // words
    uint is_indexed;
    uint small_pixels;  // that one thread draws
    uint capacity;      // of either list
    uint instances, clusters, entries;  // of a draw of clusters
} frame;

// Fixed point: 8 bits below the pixel, the origin in the picture's top left corner, y down.
const int UNIT = 256;
const int TILE = 32;  // pixels

// A triangle that many threads draw. A polygon, which is what cutting leaves of one, is followed by three places whose
// corners are the polygon's, in turn.
struct Large {
    ivec2 a, b, c;      // whose plane gives the depth
    float depth_a, depth_b, depth_c;
    float least, most;  // of the depths
    uint id;
    uint first_tile;    // of all that are listed; without 64-bit atomics the number of tiles, until sums.h has run
    uint polygon;       // 0: a triangle; else the number of corners, and 16 if it faces the front
    uint first, last;   // pixels, x | y << 16
};

const uint POLYGON_PLACES = 4u;
const uint POLYGON_FRONT = 16u;

layout(std430, binding = 1) buffer State {
#if GLINT_WIDE
    uint64_t taken;    // places << 40 | tiles
#else
    uint places, tiles;
#endif
    uint cut;       // ~ of the first place that is not to be used
    uint clips;     // triangles that have to be clipped
    uint missing;   // places that there was no room for
    uint polygons;  // 1: there are some
    // Since the last check.
    uint most_places, most_clips;
    uint is_crowded;  // 1: the tiles of a draw were 2^32 or more
} state;

#if GLINT_OUTPUT == 0
layout(std430, binding = 2) buffer Picture { uint64_t pixels[]; };
#else
layout(std430, binding = 2) buffer Picture { uint words[]; };
#endif
layout(std430, binding = 3) buffer Larges { Large larges[]; };
layout(std430, binding = 4) buffer Clips { uint clips[]; };

uint groupIndex() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }
uint groupCount() { return gl_NumWorkGroups.x * gl_NumWorkGroups.y; }

// A pixel that a triangle covers.
void writePixel(ivec2 at, float depth, uint id, bool is_front) {
    const uint pixel = uint(at.y * frame.size.x + at.x);
#if GLINT_OUTPUT == 3
    atomicAdd(words[2u * pixel + (is_front ? 0u : 1u)], 1u);
#else
    if (!(depth > 0.0)) return;
    const uint bits = floatBitsToUint(depth);
#if GLINT_OUTPUT == 0
    const uint64_t value = packUint2x32(uvec2(~id, bits));
#if GLINT_PEEK
    // The depth only grows: what is read may be out of date, or its halves of different times, but is never more.
    if (unpackUint2x32(pixels[pixel]).y > bits) return;
#endif
    atomicMax(pixels[pixel], value);
#elif GLINT_OUTPUT == 1
    // The triangle of a lesser depth is forgotten; all of this happens before the second pass.
    if (words[2u * pixel + 1u] < bits && atomicMax(words[2u * pixel + 1u], bits) < bits) words[2u * pixel] = 0u;
#else
    if (words[2u * pixel + 1u] == bits) atomicMax(words[2u * pixel], ~id);
#endif
#endif
}

uint packPixel(ivec2 at) { return uint(at.x) | uint(at.y) << 16; }
ivec2 unpackPixel(uint word) { return ivec2(word & 0xffffu, word >> 16); }

uint tilesOf(ivec2 first, ivec2 last) {
    const ivec2 tiles = (last - first + TILE) / TILE;
    return uint(tiles.x * tiles.y);
}

// Takes `count` places in a row; false if they are not there.
bool takePlaces(uint count, uint tiles, out uint place, out uint first_tile) {
    place = 0u;
    first_tile = 0u;
    if (state.cut == 0u) {
#if GLINT_WIDE
        const uint64_t before = atomicAdd(state.taken, (uint64_t(count) << 40) | uint64_t(tiles));
        place = uint(before >> 40);
        const uint64_t first = before & 0xffffffffffUL;
        first_tile = uint(first);
        const bool is_crowded = first + uint64_t(tiles) > 0xffffffffUL;
#else
        place = atomicAdd(state.places, count);
        first_tile = tiles;
        const bool is_crowded = false;
#endif
        if (is_crowded) state.is_crowded = 1u;
        if (place <= frame.capacity && count <= frame.capacity - place && !is_crowded) return true;
        atomicMax(state.cut, ~place);
    }
    atomicAdd(state.missing, count);
    return false;
}
