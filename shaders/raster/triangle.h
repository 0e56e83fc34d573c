// A triangle of three corners: left out, drawn by this thread, or listed for those that draw large ones.
#pragma once

#include <glint/raster/corner.h>

// The first and last pixel whose centres may be in the box.
void pixelsWithin(ivec2 low, ivec2 high, out ivec2 first, out ivec2 last) {
    first = max((low + 127) >> 8, ivec2(0));
    // What ends at a centre does not cover it.
    last = min((high - 129) >> 8, frame.size - 1);
}

// Depth at a centre: a plane through the first corner, not beyond the corners' depths.
struct Plane {
    ivec2 origin;
    float depth;
    vec2 slope;  // for each unit of fixed point
    float least, most;
};

// `area`: twice that of the triangle, in units squared, with its sign.
Plane makePlane(ivec2 a, ivec2 b, ivec2 c, float depth_a, float depth_b, float depth_c, float area) {
    Plane plane;
    plane.origin = a;
    plane.depth = depth_a;
    const vec2 ab = vec2(b - a), ac = vec2(c - a);
    precise vec2 rise = vec2(depth_b - depth_a, depth_c - depth_a);
    precise vec2 slope = vec2(rise.x * ac.y - rise.y * ab.y, rise.y * ab.x - rise.x * ac.x) / area;
    plane.slope = slope;
    plane.least = min(depth_a, min(depth_b, depth_c));
    plane.most = max(depth_a, max(depth_b, depth_c));
    return plane;
}

float depthAt(Plane plane, ivec2 pixel) {
    const vec2 offset = vec2(pixel * UNIT + UNIT / 2 - plane.origin);
    precise float depth = plane.depth + (plane.slope.x * offset.x + plane.slope.y * offset.y);
    return clamp(depth, plane.least, plane.most);
}

// 0 for edges whose points are the triangle's, -1 for the others: top and left ones are, of a triangle with a positive
// area.
int edgeBias(ivec2 d) { return d.y < 0 || (d.y == 0 && d.x > 0) ? 0 : -1; }

bool isKept(bool is_front) { return (frame.cull & (is_front ? 1u : 2u)) != 0u; }

// Pixels of one thread: what is covered is found first, without branches, and written then. A turn that writes costs far
// more than one that tests.
const ivec2 BLOCK = ivec2(4, 8);

// Pixels `stride` apart from `first` on, not beyond `last`; `row`, `along_x`, `along_y`: the edges' values at the first
// pixel, and how they grow from pixel to pixel of the block.
void drawBlock(ivec2 first, ivec2 stride, ivec2 last, ivec3 row, ivec3 along_x, ivec3 along_y, Plane plane, uint id,
               bool is_front) {
    uint columns = 0u;
    [[unroll]] for (int x = 0; x < BLOCK.x; x++) columns |= uint(first.x + x * stride.x <= last.x) << x;
    uint covered = 0u;
    for (int y = 0; y < BLOCK.y && first.y + y * stride.y <= last.y; y++) {
        ivec3 edges = row;
        uint bits = 0u;
        [[unroll]] for (int x = 0; x < BLOCK.x; x++) {
            bits |= (uint(~(edges.x | edges.y | edges.z)) >> 31) << x;
            edges += along_x;
        }
        covered |= (bits & columns) << (BLOCK.x * y);
        row += along_y;
    }
    while (covered != 0u) {
        const uint bit = uint(findLSB(covered));
        covered &= covered - 1u;
        const ivec2 pixel = first + stride * ivec2(bit % uint(BLOCK.x), bit / uint(BLOCK.x));
        writePixel(pixel, depthAt(plane, pixel), id, is_front);
    }
}

// Of at most 64 pixels each way: 32 bits suffice.
void drawSmall(Corner a, Corner b, Corner c, ivec2 first, ivec2 last, uint id) {
    const ivec2 centre = first * UNIT + UNIT / 2;
    ivec2 p = a.at - centre, q = b.at - centre, r = c.at - centre;
    const int area = (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
    // With y down what is clockwise has a positive area.
    const bool is_front = area < 0;
    if (area == 0 || !isKept(is_front)) return;
    const Plane plane = makePlane(a.at, b.at, c.at, a.depth, b.depth, c.depth, float(area));
    if (is_front) {
        const ivec2 swapped = q;
        q = r;
        r = swapped;
    }
    const ivec2 pq = q - p, qr = r - q, rp = p - r;
    const ivec3 corner = ivec3(pq.y * p.x - pq.x * p.y + edgeBias(pq), qr.y * q.x - qr.x * q.y + edgeBias(qr),
                               rp.y * r.x - rp.x * r.y + edgeBias(rp));
    const ivec3 along_x = -UNIT * ivec3(pq.y, qr.y, rp.y), along_y = UNIT * ivec3(pq.x, qr.x, rp.x);
    // One loop, since threads that run together take as many turns as the longest of them.
    ivec2 at = first;
    while (at.y <= last.y) {
        const ivec2 offset = at - first;
        drawBlock(at, ivec2(1), last, corner + offset.x * along_x + offset.y * along_y, along_x, along_y, plane, id,
                  is_front);
        at.x += BLOCK.x;
        if (at.x > last.x) at = ivec2(first.x, at.y + BLOCK.y);
    }
}

#if GLINT_LIST
void listClip(uint id) {
    const uint place = atomicAdd(state.clips, 1u);
    if (place < frame.capacity) clips[place] = id;
}

void listLarge(Corner a, Corner b, Corner c, ivec2 first, ivec2 last, uint id) {
    // Only what is surely left out: whole numbers decide later. Each product is rounded by 2^-24 of itself, and so is
    // the difference.
    const vec2 ab = vec2(b.at - a.at), ac = vec2(c.at - a.at);
    const float left = ab.x * ac.y, right = ab.y * ac.x;
    const float doubt = 2e-7 * (abs(left) + abs(right));
    if (!(left - right < -doubt ? isKept(true) : left - right > doubt ? isKept(false) : true)) return;
    uint place, first_tile;
    if (!takePlaces(1u, tilesOf(first, last), place, first_tile)) return;
    Large large;
    large.a = a.at;
    large.b = b.at;
    large.c = c.at;
    large.depth_a = a.depth;
    large.depth_b = b.depth;
    large.depth_c = c.depth;
    large.least = min(a.depth, min(b.depth, c.depth));
    large.most = max(a.depth, max(b.depth, c.depth));
    large.id = id;
    large.first_tile = first_tile;
    large.polygon = 0u;
    large.first = packPixel(first);
    large.last = packPixel(last);
    larges[place] = large;
}
#endif

void drawTriangle(Corner a, Corner b, Corner c, uint id) {
    const uint any = a.flags | b.flags | c.flags;
    if ((a.flags & b.flags & c.flags & CORNER_OUTSIDE) != 0u || (any & CORNER_INVALID) != 0u) return;
#if GLINT_LIST
    if ((any & CORNER_CLIP) != 0u) listClip(id);
#endif
    if ((any & CORNER_CLIP) != 0u) return;
    const ivec2 low = min(a.at, min(b.at, c.at)), high = max(a.at, max(b.at, c.at));
    ivec2 first, last;
    pixelsWithin(low, high, first, last);
    if (first.x > last.x || first.y > last.y) return;
    const ivec2 box = last - first + 1, reach = high - low;
    if (max(reach.x, reach.y) <= 64 * UNIT && uint(box.x * box.y) <= frame.small_pixels)
        drawSmall(a, b, c, first, last, id);
#if GLINT_LIST
    else
        listLarge(a, b, c, first, last, id);
#endif
}
