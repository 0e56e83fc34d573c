// The plainest library behind <glint/tracing/ray_query.h>: every ray is held against every primitive, in the order of
// instances, geometries and primitives. It says what a query means, and the rewriting of shaders is tested with it.
//
// Everything is in one storage buffer of words; floats by their bits. A structure's address is the index of its first
// word. A top level: the number of instances, then 32 words for each of them:
//     0..11  object to world, three rows of four     24  custom index (24 bits), mask (8 bits)
//     12..23 world to object, likewise               25  shader binding table record offset (24 bits), flags (8 bits)
//     26     address of its bottom level
// A bottom level: the number of geometries, then 4 words for each of them: kind (0 triangles, 1 boxes), first word of
// its primitives (9 for a triangle, three corners; 6 for a box, minimum and maximum), their number, 1 if opaque.
#pragma once

#include <glint/tracing/ray_query.h>

layout(set = GLINT_TRACING_SET, binding = 0, std430) readonly buffer GlintTracingWords { uint glint_words[]; };

struct GlintHit {
    uint type;
    int instance, geometry, primitive;
    float t;
    vec2 barycentrics;
    bool front;
};

struct GlintQuery {
    uint number;
    uint top, flags, mask;
    vec3 origin, direction, object_origin, object_direction;
    float tmin;
    // The primitive to look at next, in the geometry whose record is at `record`.
    uint instance, instances, geometry, geometries, primitive, primitives, first, kind, instance_flags, record;
    bool opaque;
    GlintHit candidate, committed;
};

uint glintInstanceWord(uint top, int instance) { return top + 1u + 32u * uint(instance); }

vec3 glintColumn(uint word) {
    return vec3(uintBitsToFloat(glint_words[word]), uintBitsToFloat(glint_words[word + 4u]),
                uintBitsToFloat(glint_words[word + 8u]));
}

mat4x3 glintRows(uint word) {
    return mat4x3(glintColumn(word), glintColumn(word + 1u), glintColumn(word + 2u), glintColumn(word + 3u));
}

vec3 glintVector(uint word) {
    return vec3(uintBitsToFloat(glint_words[word]), uintBitsToFloat(glint_words[word + 1u]),
                uintBitsToFloat(glint_words[word + 2u]));
}

// Edge functions of the corners as seen from the origin: neighbours compute the same numbers for the edge they share,
// with opposite signs, so that no ray slips between them.
bool glintTestTriangle(vec3 a, vec3 b, vec3 c, vec3 direction, out float t, out vec2 barycentrics, out bool front) {
    precise float u = dot(direction, cross(c, a));
    precise float v = dot(direction, cross(a, b));
    precise float w = dot(direction, cross(b, c));
    precise float sum = u + v + w;
    front = sum < 0.0;
    precise vec3 normal = cross(b - a, c - a);
    t = dot(normal, a) / dot(normal, direction);
    barycentrics = vec2(u, v) / sum;
    return (min(min(u, v), w) >= 0.0 || max(max(u, v), w) <= 0.0) && sum != 0.0;
}

// Of the box with the ray from tmin to tmax; NaN where a plane holds the ray counts as inside.
bool glintTestBox(vec3 low, vec3 high, vec3 origin, vec3 direction, float tmin, float tmax) {
    for (int i = 0; i < 3; i++) {
        float a = (low[i] - origin[i]) / direction[i];
        float b = (high[i] - origin[i]) / direction[i];
        if (direction[i] == 0.0 && (origin[i] < low[i] || origin[i] > high[i])) return false;
        if (direction[i] == 0.0) continue;
        tmin = max(tmin, min(a, b));
        tmax = min(tmax, max(a, b));
    }
    return tmin <= tmax;
}

void glintQueryInitialize(inout GlintQuery query, const uint number, const uint top, const uint flags, const uint mask,
                          const vec3 origin, const float tmin, const vec3 direction, const float tmax) {
    query.number = number;
    query.top = top;
    query.flags = flags;
    query.mask = mask & 0xffu;
    query.origin = origin;
    query.direction = direction;
    query.tmin = tmin;
    query.instances = glint_words[top];
    query.instance = ~0u;  // none yet
    query.geometry = query.geometries = query.primitive = query.primitives = 0u;
    query.committed = query.candidate = GlintHit(GLINT_COMMITTED_NONE, 0, 0, 0, tmax, vec2(0.0), false);
    // NaN: such a ray hits nothing.
    if (!(tmin <= tmax)) query.instances = 0u;
}

void glintQueryTerminate(inout GlintQuery query) {
    query.instances = 0u;
    query.geometries = 0u;
    query.primitives = 0u;
}

void glintQueryConfirm(inout GlintQuery query) {
    query.committed = query.candidate;
    query.committed.type = GLINT_COMMITTED_TRIANGLE;
    if ((query.flags & GLINT_RAY_TERMINATE) != 0u) query.instances = query.geometries = query.primitives = 0u;
}

void glintQueryGenerate(inout GlintQuery query, const float t) {
    if (!(t >= query.tmin && t <= query.committed.t)) return;
    query.committed = query.candidate;
    query.committed.type = GLINT_COMMITTED_GENERATED;
    query.committed.t = t;
    if ((query.flags & GLINT_RAY_TERMINATE) != 0u) query.instances = query.geometries = query.primitives = 0u;
}

bool glintQueryProceed(inout GlintQuery query) {
    for (;;) {
        if (query.primitive < query.primitives) {
            uint primitive = query.primitive++;
            query.candidate.instance = int(query.instance);
            query.candidate.geometry = int(query.geometry) - 1;
            query.candidate.primitive = int(primitive);
            if (query.kind == 0u) {
                uint word = query.first + 9u * primitive;
                float t;
                if (!glintTestTriangle(glintVector(word) - query.object_origin,
                                       glintVector(word + 3u) - query.object_origin,
                                       glintVector(word + 6u) - query.object_origin, query.object_direction, t,
                                       query.candidate.barycentrics, query.candidate.front))
                    continue;
                if (!(t > query.tmin && t < query.committed.t)) continue;
                bool flip = (query.instance_flags & GLINT_INSTANCE_FLIP_FACING) != 0u;
                query.candidate.front = query.candidate.front != flip;
                uint cull = query.candidate.front ? GLINT_RAY_CULL_FRONT : GLINT_RAY_CULL_BACK;
                if ((query.flags & cull) != 0u && (query.instance_flags & GLINT_INSTANCE_CULL_DISABLE) == 0u) continue;
                query.candidate.t = t;
                query.candidate.type = GLINT_CANDIDATE_TRIANGLE;
                if (!query.opaque) return true;
                query.committed = query.candidate;
                query.committed.type = GLINT_COMMITTED_TRIANGLE;
                if ((query.flags & GLINT_RAY_TERMINATE) != 0u)
                    query.instances = query.geometries = query.primitives = 0u;
            } else {
                uint word = query.first + 6u * primitive;
                if (!glintTestBox(glintVector(word), glintVector(word + 3u), query.object_origin,
                                  query.object_direction, query.tmin, query.committed.t))
                    continue;
                query.candidate.type = GLINT_CANDIDATE_BOX;
                return true;
            }
        } else if (query.geometry < query.geometries) {
            uint record = query.record + 4u * query.geometry++;
            query.kind = glint_words[record];
            query.first = glint_words[record + 1u];
            query.primitives = glint_words[record + 2u];
            query.primitive = 0u;
            query.opaque = glint_words[record + 3u] != 0u;
            if ((query.instance_flags & GLINT_INSTANCE_OPAQUE) != 0u) query.opaque = true;
            if ((query.instance_flags & GLINT_INSTANCE_NO_OPAQUE) != 0u) query.opaque = false;
            if ((query.flags & GLINT_RAY_OPAQUE) != 0u) query.opaque = true;
            if ((query.flags & GLINT_RAY_NO_OPAQUE) != 0u) query.opaque = false;
            uint skip = query.kind == 0u ? GLINT_RAY_SKIP_TRIANGLES : GLINT_RAY_SKIP_BOXES;
            uint cull = query.opaque ? GLINT_RAY_CULL_OPAQUE : GLINT_RAY_CULL_NO_OPAQUE;
            if ((query.flags & (skip | cull)) != 0u) query.primitives = 0u;
        } else if (query.instance + 1u < query.instances) {
            query.instance++;
            uint word = glintInstanceWord(query.top, int(query.instance));
            if ((glint_words[word + 24u] >> 24 & query.mask) == 0u) continue;
            query.instance_flags = glint_words[word + 25u] >> 24;
            mat4x3 inverse = glintRows(word + 12u);
            query.object_origin = inverse * vec4(query.origin, 1.0);
            query.object_direction = inverse * vec4(query.direction, 0.0);
            query.record = glint_words[word + 26u] + 1u;
            query.geometries = glint_words[query.record - 1u];
            query.geometry = 0u;
        } else {
            return false;
        }
    }
}

uint glintQueryType(inout GlintQuery query, const bool committed) {
    return committed ? query.committed.type : query.candidate.type;
}
float glintQueryTMin(inout GlintQuery query) { return query.tmin; }
uint glintQueryFlags(inout GlintQuery query) { return query.flags; }
vec3 glintQueryWorldRayOrigin(inout GlintQuery query) { return query.origin; }
vec3 glintQueryWorldRayDirection(inout GlintQuery query) { return query.direction; }
float glintQueryT(inout GlintQuery query, const bool committed) {
    return committed ? query.committed.t : query.candidate.t;
}
int glintQueryInstanceId(inout GlintQuery query, const bool committed) {
    return committed ? query.committed.instance : query.candidate.instance;
}
int glintQueryGeometryIndex(inout GlintQuery query, const bool committed) {
    return committed ? query.committed.geometry : query.candidate.geometry;
}
int glintQueryPrimitiveIndex(inout GlintQuery query, const bool committed) {
    return committed ? query.committed.primitive : query.candidate.primitive;
}
vec2 glintQueryBarycentrics(inout GlintQuery query, const bool committed) {
    return committed ? query.committed.barycentrics : query.candidate.barycentrics;
}
bool glintQueryFrontFace(inout GlintQuery query, const bool committed) {
    return committed ? query.committed.front : query.candidate.front;
}
bool glintQueryCandidateBoxOpaque(inout GlintQuery query) { return query.opaque; }
int glintQueryInstanceCustomIndex(inout GlintQuery query, const bool committed) {
    int instance = committed ? query.committed.instance : query.candidate.instance;
    return int(glint_words[glintInstanceWord(query.top, instance) + 24u] & 0xffffffu);
}
uint glintQueryInstanceOffset(inout GlintQuery query, const bool committed) {
    int instance = committed ? query.committed.instance : query.candidate.instance;
    return glint_words[glintInstanceWord(query.top, instance) + 25u] & 0xffffffu;
}
mat4x3 glintQueryObjectToWorld(inout GlintQuery query, const bool committed) {
    return glintRows(glintInstanceWord(query.top, committed ? query.committed.instance : query.candidate.instance));
}
mat4x3 glintQueryWorldToObject(inout GlintQuery query, const bool committed) {
    int instance = committed ? query.committed.instance : query.candidate.instance;
    return glintRows(glintInstanceWord(query.top, instance) + 12u);
}
vec3 glintQueryObjectRayOrigin(inout GlintQuery query, const bool committed) {
    int instance = committed ? query.committed.instance : query.candidate.instance;
    return glintRows(glintInstanceWord(query.top, instance) + 12u) * vec4(query.origin, 1.0);
}
vec3 glintQueryObjectRayDirection(inout GlintQuery query, const bool committed) {
    int instance = committed ? query.committed.instance : query.candidate.instance;
    return glintRows(glintInstanceWord(query.top, instance) + 12u) * vec4(query.direction, 0.0);
}
