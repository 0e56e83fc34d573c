// What has been listed, tile by tile: each group has a row of tiles, and each of its threads pixels of every tile.
// GLINT_POLYGONS 0: triangles. 1: polygons, by a kernel of their own, which most draws do not need.
#pragma once

#include <glint/raster/triangle.h>
#include <glint/raster/wide.h>

layout(local_size_x = GLINT_GROUP) in;

// Threads side by side.
const int ROW = 8;

// The value of an edge at the centre of a pixel, divided by 256 and rounded down, which keeps its sign, and not beyond
// 2^30: from there on the other pixels of a tile, at most 62 * 2^24 away, have the same sign.
int edgeAt(ivec2 from, ivec2 to, int bias, ivec2 pixel) {
    const Wide value = wideCross(to - from, pixel * UNIT + UNIT / 2 - from);
    return wideUnits(wideSum(value, Wide(uint(bias), bias)));
}

Plane planeOf(Large large) {
    Plane plane = makePlane(large.a, large.b, large.c, large.depth_a, large.depth_b, large.depth_c,
                            wideFloat(wideCross(large.b - large.a, large.c - large.a)));
    plane.least = large.least;
    plane.most = large.most;
    return plane;
}

#if GLINT_POLYGONS == 0
void drawTile(Large large, ivec2 first, ivec2 last) {
    ivec2 a = large.a, b = large.b, c = large.c;
    const Wide area = wideCross(b - a, c - a);
    const bool is_front = area.high < 0;
    if (wideSign(area) == 0 || !isKept(is_front)) return;
    const Plane plane = planeOf(large);
    if (is_front) {
        b = large.c;
        c = large.b;
    }
    const ivec2 ab = b - a, bc = c - b, ca = a - c;
    const int local = int(gl_LocalInvocationIndex);
    const ivec2 step = ivec2(ROW, GLINT_GROUP / ROW);
    const ivec2 begin = first + ivec2(local % ROW, local / ROW);
    const ivec3 corner = ivec3(edgeAt(a, b, edgeBias(ab), first), edgeAt(b, c, edgeBias(bc), first),
                               edgeAt(c, a, edgeBias(ca), first));
    const ivec3 along_x = -ivec3(ab.y, bc.y, ca.y), along_y = ivec3(ab.x, bc.x, ca.x);
    // The largest value of each edge in the tile: if it is negative, there is nothing here.
    const ivec2 reach = last - first;
    const ivec3 largest = corner + reach.x * max(along_x, ivec3(0)) + reach.y * max(along_y, ivec3(0));
    if ((largest.x | largest.y | largest.z) < 0) return;
    const ivec3 row = corner + (begin.x - first.x) * along_x + (begin.y - first.y) * along_y;
    for (int y = 0; begin.y + y * step.y <= last.y; y += BLOCK.y)
        drawBlock(begin + ivec2(0, y * step.y), step, last, row + y * step.y * along_y, step.x * along_x,
                  step.y * along_y, plane, large.id, is_front);
}

#else

ivec2 polygonCorner(uint place, uint corner) {
    const Large part = larges[place + 1u + corner / 3u];
    return corner % 3u == 0u ? part.a : corner % 3u == 1u ? part.b : part.c;
}

// A pixel is within if the edges to the left of its centre are odd in number, each without its lower end. Of a triangle
// that is the same as above; a polygon may have lost its convexity in rounding, and neighbours share its edges.
void drawPolygonTile(Large large, uint place, ivec2 first, ivec2 last) {
    const Plane plane = planeOf(large);
    const uint corners = large.polygon % POLYGON_FRONT;
    const int local = int(gl_LocalInvocationIndex);
    const ivec2 step = ivec2(ROW, GLINT_GROUP / ROW);
    const ivec2 begin = first + ivec2(local % ROW, local / ROW);
    for (int y = begin.y; y <= last.y; y += step.y) {
        bool is_within[TILE / ROW];
        [[unroll]] for (int i = 0; i < TILE / ROW; i++) is_within[i] = false;
        const int centre = y * UNIT + UNIT / 2;
        ivec2 from = polygonCorner(place, corners - 1u);
        for (uint i = 0u; i < corners; i++) {
            const ivec2 to = polygonCorner(place, i);
            const ivec2 upper = from.y < to.y ? from : to, lower = from.y < to.y ? to : from;
            from = to;
            if (!(upper.y <= centre && centre < lower.y)) continue;
            int edge = edgeAt(lower, upper, 0, ivec2(begin.x, y));
            [[unroll]] for (int k = 0; k < TILE / ROW; k++) {
                is_within[k] = is_within[k] != (edge >= 0);
                edge += ROW * (lower.y - upper.y);
            }
        }
        [[unroll]] for (int k = 0; k < TILE / ROW; k++) {
            const ivec2 pixel = ivec2(begin.x + ROW * k, y);
            if (is_within[k] && pixel.x <= last.x)
                writePixel(pixel, depthAt(plane, pixel), large.id, (large.polygon & POLYGON_FRONT) != 0u);
        }
    }
}

#endif

// The last place whose first tile is not beyond this one. Places without tiles are never it.
uint placeOf(uint tile, uint count) {
    uint begin = 0u, end = count;
    while (end - begin > 1u) {
        const uint middle = (begin + end) / 2u;
        if (larges[middle].first_tile <= tile) begin = middle;
        else end = middle;
    }
    return begin;
}

void main() {
#if GLINT_WIDE
    const uint places = uint(state.taken >> 40);
#else
    const uint places = state.places;
#endif
    const uint count = min(places, ~state.cut);
#if GLINT_POLYGONS
    if (state.polygons == 0u) return;
#else
    if (groupIndex() == 0u && gl_LocalInvocationIndex == 0u) {
        state.most_places = max(state.most_places, count + state.missing);
        state.most_clips = max(state.most_clips, state.clips);
    }
#endif
    if (count == 0u) return;
    const Large final = larges[count - 1u];
    const uint tiles = final.first_tile + tilesOf(unpackPixel(final.first), unpackPixel(final.last));
    // An even share for each group.
    const uint share = tiles / groupCount(), left = tiles % groupCount();
    uint tile = groupIndex() * share + min(groupIndex(), left);
    const uint end = tile + share + (groupIndex() < left ? 1u : 0u);
    if (tile >= end) return;
    uint place = placeOf(tile, count);
    while (tile < end) {
        while (place + 1u < count && larges[place + 1u].first_tile <= tile) place++;
        const Large large = larges[place];
        if ((large.polygon != 0u) != (GLINT_POLYGONS == 1)) {
            tile = large.first_tile + tilesOf(unpackPixel(large.first), unpackPixel(large.last));
            continue;
        }
        const ivec2 box_first = unpackPixel(large.first), box_last = unpackPixel(large.last);
        const int columns = (box_last.x - box_first.x + TILE) / TILE, number = int(tile - large.first_tile);
        const ivec2 first = box_first + TILE * ivec2(number % columns, number / columns);
        const ivec2 last = min(first + TILE - 1, box_last);
#if GLINT_POLYGONS
        drawPolygonTile(large, place, first, last);
#else
        drawTile(large, first, last);
#endif
        tile++;
    }
}
