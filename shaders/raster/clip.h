// Cuts triangles that reach behind the near plane or beyond what fixed point holds: a thread each, to polygons.
//
// Each edge is cut by itself, plane after plane in one order, from the corner within to that without: so both triangles
// that share an edge get the same points. They are computed with pairs of floats, as about 48 bits, since what is left of
// the edge may be little of it.
#pragma once

#include <glint/raster/pairs.h>
#include <glint/raster/triangle.h>
#include <glint/raster/wide.h>
#if GLINT_CLUSTERS
#include <glint/raster/cluster.h>
#else
#include <glint/raster/mesh.h>
#endif

layout(local_size_x = GLINT_GROUP) in;

const uint PLANES = 6u;
const uint CORNERS = 9u;
const uint NONE = 3u;

// In homogeneous coordinates, of any positive scale.
struct Point {
    vec4 high, low;
    uint corner;  // of the triangle; NONE: on an edge
};

Point scaled(Point p) {
    const vec4 sizes = abs(p.high);
    const uint size = floatBitsToUint(max(max(sizes.x, sizes.y), max(sizes.z, sizes.w)));
    // 2^-e in two steps, since e may be almost -149 to 128.
    const int exponent = 127 - int(max(size >> 23, 1u));
    const float half_way = uintBitsToFloat(uint(127 + exponent / 2) << 23);
    const float rest = uintBitsToFloat(uint(127 + exponent - exponent / 2) << 23);
    p.high = p.high * half_way * rest;
    p.low = p.low * half_way * rest;
    return p;
}

// Not negative within. The guards are powers of two: nothing is rounded here but the sum, to a pair.
vec2 distanceTo(Point p, uint plane) {
    const vec2 w = vec2(p.high.w, p.low.w);
    if (plane == 0u) return pairSum(w, -vec2(p.high.z, p.low.z));
    if (plane == 1u) return vec2(p.high.z, p.low.z);
    const uint axis = plane / 2u - 1u;
    const vec2 value = vec2(p.high[axis], p.low[axis]);
    return pairSum(frame.guard[axis] * w, plane % 2u == 0u ? value : -value);
}

bool isWithin(vec2 pair) { return pair.x > 0.0 || (pair.x == 0.0 && pair.y >= 0.0); }

Point cut(Point inner, vec2 inner_distance, Point outer, vec2 outer_distance) {
    Point p;
    [[unroll]] for (uint i = 0u; i < 4u; i++) {
        const vec2 value = pairSum(pairProduct(vec2(inner.high[i], inner.low[i]), -outer_distance),
                                   pairProduct(vec2(outer.high[i], outer.low[i]), inner_distance));
        p.high[i] = value.x;
        p.low[i] = value.y;
    }
    p.corner = NONE;
    return scaled(p);
}

Corner cornerOf(Point p) {
    const vec2 w = vec2(p.high.w, p.low.w);
    const vec2 x = pairQuotient(vec2(p.high.x, p.low.x), w), y = pairQuotient(vec2(p.high.y, p.low.y), w);
    precise vec2 at = vec2(x.x, y.x) * frame.scale + vec2(x.y, y.y) * frame.scale;
    Corner corner;
    corner.at = ivec2(roundEven(at)) + frame.middle;
    corner.depth = clamp(pairQuotient(vec2(p.high.z, p.low.z), w).x, 0.0, 1.0);
    corner.flags = p.high.w > 0.0 ? 0u : CORNER_INVALID;
    return corner;
}

void clipTriangle(uint id) {
    vec4 positions[3];
    trianglePositions(id, positions[0], positions[1], positions[2]);
    Point points[CORNERS];
    uint count = 3u;
    [[unroll]] for (uint i = 0u; i < 3u; i++) points[i] = scaled(Point(positions[i], vec4(0.0), i));
    for (uint plane = 0u; plane < PLANES; plane++) {
        Point kept[CORNERS];
        uint kept_count = 0u;
        if (count < 3u) return;
        Point before = points[count - 1u];
        vec2 before_distance = distanceTo(before, plane);
        for (uint i = 0u; i < count; i++) {
            const Point point = points[i];
            const vec2 distance = distanceTo(point, plane);
            const bool was_within = isWithin(before_distance), is_within = isWithin(distance);
            if (was_within && !is_within && kept_count < CORNERS)
                kept[kept_count++] = cut(before, before_distance, point, distance);
            if (!was_within && is_within && kept_count < CORNERS)
                kept[kept_count++] = cut(point, distance, before, before_distance);
            if (is_within && kept_count < CORNERS) kept[kept_count++] = point;
            before = point;
            before_distance = distance;
        }
        count = kept_count;
        for (uint i = 0u; i < count; i++) points[i] = kept[i];
    }
    if (count < 3u) return;

    Corner corners[CORNERS];
    ivec2 low = ivec2(0x7fffffff), high = -low;
    float least = 1.0, most = 0.0;
    for (uint i = 0u; i < count; i++) {
        // What is a triangle's own corner is where its other triangles have it.
        Corner corner = cornerOf(points[i]);
        if (points[i].corner < NONE) corner = project(positions[points[i].corner]);
        if ((corner.flags & (CORNER_INVALID | CORNER_CLIP)) != 0u) return;
        corners[i] = corner;
        low = min(low, corner.at);
        high = max(high, corner.at);
        least = min(least, corner.depth);
        most = max(most, corner.depth);
    }
    ivec2 first, last;
    pixelsWithin(low, high, first, last);
    if (first.x > last.x || first.y > last.y) return;
    Wide area = Wide(0u, 0);
    uint widest = 1u;
    float widest_area = -1.0;
    for (uint i = 1u; i + 1u < count; i++) {
        const Wide part = wideCross(corners[i].at - corners[0].at, corners[i + 1u].at - corners[0].at);
        area = wideSum(area, part);
        if (abs(wideFloat(part)) > widest_area) {
            widest_area = abs(wideFloat(part));
            widest = i;
        }
    }
    const bool is_front = wideSign(area) < 0;
    if (wideSign(area) == 0 || !isKept(is_front)) return;

    uint place, first_tile;
    const uint tiles = tilesOf(first, last);
    if (!takePlaces(POLYGON_PLACES, tiles, place, first_tile)) return;
    state.polygons = 1u;
    Large large;
    large.a = corners[0].at;
    large.b = corners[widest].at;
    large.c = corners[widest + 1u].at;
    large.depth_a = corners[0].depth;
    large.depth_b = corners[widest].depth;
    large.depth_c = corners[widest + 1u].depth;
    large.least = least;
    large.most = most;
    large.id = id;
    large.first_tile = first_tile;
    large.polygon = count | (is_front ? POLYGON_FRONT : 0u);
    large.first = packPixel(first);
    large.last = packPixel(last);
    larges[place] = large;
    // Places without tiles.
#if GLINT_WIDE
    large.first_tile = first_tile + tiles;
#else
    large.first_tile = 0u;
#endif
    large.first = packPixel(ivec2(1));
    large.last = packPixel(ivec2(0));
    for (uint i = 0u; i < CORNERS; i += 3u) {
        large.a = corners[min(i, count - 1u)].at;
        large.b = corners[min(i + 1u, count - 1u)].at;
        large.c = corners[min(i + 2u, count - 1u)].at;
        larges[place + 1u + i / 3u] = large;
    }
}

void main() {
    const uint count = min(state.clips, frame.capacity), threads = groupCount() * GLINT_GROUP;
    for (uint i = groupIndex() * GLINT_GROUP + gl_LocalInvocationIndex; i < count; i += threads) clipTriangle(clips[i]);
}
