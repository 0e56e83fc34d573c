// Glint's own hierarchies in a shader: a ray against one of them, the tests of a node's boxes and of a triangle, and the
// way from node to node. For what is built on this: batch.h and query.h. docs/tracing.md derives the bounds.
//
// GLINT_TRACING_LOAD(i) has to be defined before: see memory.h.
#pragma once

// Levels of hierarchies: 2 where instances are traced.
#ifndef GLINT_TRACING_LEVELS
#define GLINT_TRACING_LEVELS 2
#endif
// Rays that may be on their way at once in a thread.
#ifndef GLINT_TRACING_QUERIES
#define GLINT_TRACING_QUERIES 1
#endif
#include <glint/tracing/node_form.h>

// Of a hierarchy, as in core/tracing/detail/hierarchy.h.
const uint GLINT_KIND_TRIANGLES = 0u;
const uint GLINT_KIND_BOXES = 1u;

// How far planes are moved apart, in the largest distance of a coordinate from the ray's origin: 2^-19. Less is not
// safe; it is a macro so that what it costs can be measured.
#ifndef GLINT_TRACING_WIDENING
#define GLINT_TRACING_WIDENING 1.9073486e-6
#endif

// A ray in the space of one hierarchy.
struct GlintSpace {
    uint base;        // the hierarchy's first texel
    uint records;     // its first record's
    uint scale_bits;  // of a plane's scale, less the exponent
    float step;       // of the grid
    vec3 origin;
    vec3 to_grid;  // from the origin to the grid's minimum
    vec3 inverse;  // of the direction, finite
    vec3 margin;   // how far planes are moved apart, in t
    vec3 shear_x;  // rows of the matrix that takes the direction to (0, 0, 1)
    vec3 shear_y;
    vec3 shear_z;
};

// False for a ray that means nothing, and meets nothing: NaN, infinity, no direction, an empty interval.
bool glintIsRay(vec3 origin, vec3 direction, float t_min, float t_max) {
    const vec3 most = vec3(3.0e38);
    return all(lessThanEqual(abs(origin), most)) && all(lessThanEqual(abs(direction), most)) &&
           any(greaterThan(abs(direction), vec3(1.2e-38))) && t_min <= t_max;
}

GlintSpace glintSpace(uint base, vec3 origin, vec3 direction) {
    GlintSpace space;
    const uvec4 grid = GLINT_TRACING_LOAD(base);
    const uvec4 places = GLINT_TRACING_LOAD(base + 1u);
    const vec3 low = uintBitsToFloat(GLINT_TRACING_LOAD(base + 2u).xyz);
    const vec3 high = uintBitsToFloat(GLINT_TRACING_LOAD(base + 3u).xyz);
    space.base = base;
    space.scale_bits = places.x;
    space.records = base + places.z;
    space.step = uintBitsToFloat(grid.w);
    space.origin = origin;
    precise vec3 to_grid = uintBitsToFloat(grid.xyz) - origin;
    space.to_grid = to_grid;

    // How far any coordinate of the hierarchy is from the origin's. Rounding moves planes and corners by less than 2^-19
    // of it.
    const vec3 reaches = max(abs(low - origin), abs(high - origin));
    const float reach = max(reaches.x, max(reaches.y, reaches.z));
    const vec3 size = abs(direction);
    const float largest = max(size.x, max(size.y, size.z));
    // Making a smaller component that large moves the ray by less than rounding does, within reach.
    const float least = max(largest * 9.0949470e-13, reach * 7.5231638e-37);  // 2^-40, 2^-120
    const vec3 inverse = 1.0 / max(size, vec3(least));
    space.inverse = uintBitsToFloat(floatBitsToUint(inverse) | (floatBitsToUint(direction) & 0x80000000u));
    space.margin = inverse * (reach * GLINT_TRACING_WIDENING);

    // The longest component's axis becomes z; the others follow it in turn, mirrored where it looks backwards, so that
    // a triangle's winding stays.
    precise vec3 slope;
    vec3 x;
    vec3 y;
    vec3 z;
    if (size.x >= size.y && size.x >= size.z) {
        slope = direction / direction.x;
        z = vec3(1.0 / direction.x, 0.0, 0.0);
        x = vec3(-slope.y, 1.0, 0.0);
        y = vec3(-slope.z, 0.0, 1.0);
    } else if (size.y >= size.z) {
        slope = direction / direction.y;
        z = vec3(0.0, 1.0 / direction.y, 0.0);
        x = vec3(0.0, -slope.z, 1.0);
        y = vec3(1.0, -slope.x, 0.0);
    } else {
        slope = direction / direction.z;
        z = vec3(0.0, 0.0, 1.0 / direction.z);
        x = vec3(1.0, 0.0, -slope.x);
        y = vec3(0.0, 1.0, -slope.y);
    }
    space.shear_x = x;
    space.shear_y = z.x + z.y + z.z < 0.0 ? -y : y;
    space.shear_z = z;
    return space;
}

// What is left of a product after rounding, exactly: Dekker's two-product.
float glintProductError(float a, float b, float product) {
    precise float split_a = 4097.0 * a;
    precise float split_b = 4097.0 * b;
    precise float a_high = split_a - (split_a - a);
    precise float b_high = split_b - (split_b - b);
    precise float a_low = a - a_high;
    precise float b_low = b - b_high;
    precise float error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
    return error;
}

// a.x * b.y - a.y * b.x where both products round to the same number: its sign is exact.
float glintEqualProducts(vec2 a, vec2 b) {
    precise float first = a.x * b.y;
    precise float second = a.y * b.x;
    precise float difference = glintProductError(a.x, b.y, first) - glintProductError(a.y, b.x, second);
    return difference;
}

// Where a ray meets a triangle. `weights` of the corners, not divided by their sum `area`, which is negative if the
// corners are counter-clockwise seen from the origin: the front.
struct GlintTriangleHit {
    float t;
    float area;
    vec3 weights;
    uint primitive;
    uint geometry;  // and 2^31 if it is opaque
};

// True if the ray's line goes through the triangle, its edges and corners included: if the origin lies within the
// sheared corners, whose rounding is the same for all triangles that share them. The signs are those of exact
// arithmetic, so a closed mesh has no gaps.
bool glintTriangle(GlintSpace space, uint record, out GlintTriangleHit hit) {
    const uint texel = space.records + 3u * record;
    const uvec4 texel0 = GLINT_TRACING_LOAD(texel);
    const uvec4 texel1 = GLINT_TRACING_LOAD(texel + 1u);
    const uvec4 texel2 = GLINT_TRACING_LOAD(texel + 2u);
    hit.primitive = texel2.y;
    hit.geometry = texel2.z;
    precise vec3 a = uintBitsToFloat(texel0.xyz) - space.origin;
    precise vec3 b = uintBitsToFloat(uvec3(texel0.w, texel1.xy)) - space.origin;
    precise vec3 c = uintBitsToFloat(uvec3(texel1.zw, texel2.x)) - space.origin;
    precise vec3 x = vec3(a.x, b.x, c.x) * space.shear_x.x + vec3(a.y, b.y, c.y) * space.shear_x.y +
                     vec3(a.z, b.z, c.z) * space.shear_x.z;
    precise vec3 y = vec3(a.x, b.x, c.x) * space.shear_y.x + vec3(a.y, b.y, c.y) * space.shear_y.y +
                     vec3(a.z, b.z, c.z) * space.shear_y.z;
    precise vec3 z = vec3(a.x, b.x, c.x) * space.shear_z.x + vec3(a.y, b.y, c.y) * space.shear_z.y +
                     vec3(a.z, b.z, c.z) * space.shear_z.z;
    precise float u = x.y * y.z - y.y * x.z;
    precise float v = x.z * y.x - y.z * x.x;
    precise float w = x.x * y.y - y.x * x.y;
    if (u == 0.0 || v == 0.0 || w == 0.0) {
        if (u == 0.0) u = glintEqualProducts(vec2(x.y, y.y), vec2(x.z, y.z));
        if (v == 0.0) v = glintEqualProducts(vec2(x.z, y.z), vec2(x.x, y.x));
        if (w == 0.0) w = glintEqualProducts(vec2(x.x, y.x), vec2(x.y, y.y));
    }
    const float smallest = min(u, min(v, w));
    const float largest = max(u, max(v, w));
    precise float area = u + v + w;
    precise float t = (u * z.x + v * z.y + w * z.z) / area;
    hit.t = t;
    hit.area = area;
    hit.weights = vec3(u, v, w);
    return (smallest >= 0.0 || largest <= 0.0) && area != 0.0;
}

// The order of hits at the same distance.
bool glintIsBefore(GlintTriangleHit a, GlintTriangleHit b) {
    const uint geometry_a = a.geometry & 0x7fffffffu;
    const uint geometry_b = b.geometry & 0x7fffffffu;
    return geometry_a < geometry_b || (geometry_a == geometry_b && a.primitive < b.primitive);
}

// The way of a ray through a hierarchy, GlintWay. What waits for it is on a stack beside the structure, that of the
// ray's `number`: an array in it would be copied at every call. `base` is the hierarchy's first texel.
//
//   void glintBegin(inout GlintWay way)     to the root, above what is on the stack
//   void glintEnd(out GlintWay way)         to nowhere, with nothing on the stack
//   bool glintUnderway(GlintWay way)        not at the end of this level
//   bool glintAtNode(GlintWay way), glintAtLeaf(GlintWay way)
//   uint glintRecord(GlintWay way)          the leaf's
//   void glintEnterNode(inout GlintWay way, uint number, GlintSpace space, float t_min, float t_max)
//                                           to the nearest child that the ray meets between t_min >= 0 and t_max
//   void glintNext(inout GlintWay way, uint number, uint base)
//                                           from a leaf to what is next
//   void glintPush(inout GlintWay way, uint number)
//                                           before glintBegin at an instance: what is left at this level waits
//   void glintLeave(inout GlintWay way, uint number, uint base)
//                                           from the end of an instance's hierarchy to what is next at the level above
#if GLINT_TRACING_NODES == GLINT_NODES_PACKED
#include <glint/tracing/packed_nodes.h>
#else
#include <glint/tracing/full_nodes.h>
#endif

// Rows of a 3x4 matrix that begins at a texel.
mat4x3 glintMatrix(uint texel) {
    return transpose(mat3x4(uintBitsToFloat(GLINT_TRACING_LOAD(texel)), uintBitsToFloat(GLINT_TRACING_LOAD(texel + 1u)),
                            uintBitsToFloat(GLINT_TRACING_LOAD(texel + 2u))));
}

// To the space of the instance whose texels begin at `instance`.
vec3 glintToObject(uint instance, vec3 world, bool is_point) {
    const mat4x3 inverse = glintMatrix(instance + 3u);
    precise vec3 v = world;
    if (is_point) {
        // Less the instance's place first: what is near to it keeps its digits.
        v = world - vec3(uintBitsToFloat(GLINT_TRACING_LOAD(instance).w),
                         uintBitsToFloat(GLINT_TRACING_LOAD(instance + 1u).w),
                         uintBitsToFloat(GLINT_TRACING_LOAD(instance + 2u).w));
    }
    precise vec3 object = inverse[0] * v.x + inverse[1] * v.y + inverse[2] * v.z;
    return object;
}

// An instance, as in core/tracing/detail/instances.h.
struct GlintInstance {
    uint index;  // its place in the list
    uint texel;  // its first
    uint base;   // the first texel of its hierarchy
    uint kind;   // of that
    uint mask;
    uint flags;
};

GlintInstance glintInstance(uint top, uint index) {
    GlintInstance instance;
    instance.index = index;
    instance.texel = top + GLINT_TRACING_LOAD(top + 3u).w + 8u * index;
    const uvec4 data = GLINT_TRACING_LOAD(instance.texel + 6u);
    instance.base = data.x;
    instance.kind = GLINT_TRACING_LOAD(data.x + 2u).w;
    instance.mask = data.y >> 24;
    instance.flags = data.z >> 24;
    return instance;
}

// That of a top level's leaf.
GlintInstance glintInstanceAt(GlintSpace top, GlintWay way) {
    const uint record = top.records + 3u * glintRecord(way);
    return glintInstance(top.base, GLINT_TRACING_LOAD(record + 2u).y);
}

// A ray in an instance's space.
GlintSpace glintInstanceSpace(GlintInstance instance, vec3 origin, vec3 direction) {
    return glintSpace(instance.base, glintToObject(instance.texel, origin, true),
                      glintToObject(instance.texel, direction, false));
}
