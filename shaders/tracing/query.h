// Ray queries over Glint's own hierarchies: what GL_EXT_ray_query offers, by functions of the same meaning on a
// structure that holds a query's state. Queries are independent of one another; GLINT_TRACING_QUERIES of them may be on
// their way at once, each with a number of its own below that (their stacks are all that is not in the structure: an
// array in it would be copied at every call).
//
//   GlintQuery query;
//   glintQueryInitialize(query, 0u, top, flags, mask, origin, t_min, direction, t_max);
//   while (glintQueryProceed(query)) { ... glintQueryConfirm(query); }
//   if (glintQueryType(query, true) != 0u) ...
//
// `top` is the first texel of a hierarchy of instances, see core/tracing/detail/instances.h. Of hits at the same
// distance the one of the lowest instance, geometry and primitive is committed.
#pragma once

#include <glint/tracing/memory.h>
#include <glint/tracing/ray_query.h>
#include <glint/tracing/traversal.h>

struct GlintIntersection {
    uint type;
    float t;
    vec2 barycentrics;
    uint primitive;
    uint geometry;
    uint instance;
    bool front;
    bool opaque;
};

struct GlintQuery {
    uint number;
    uint flags;
    uint mask;
    float t_min;
    vec3 origin;
    vec3 direction;
    GlintIntersection candidate;
    GlintIntersection committed;  // its t is where the ray ends

    GlintWay way;
    GlintSpace top;
    bool inside;       // of an instance
    GlintSpace space;  // the ray in its hierarchy
    GlintInstance instance;
};

void glintQueryTerminate(inout GlintQuery query) {
    glintEnd(query.way);
    query.inside = false;
}

// Whether the instance is there for the ray.
bool glintQuerySees(GlintQuery query, GlintInstance instance) {
    const uint skipped = instance.kind == GLINT_KIND_BOXES ? GLINT_RAY_SKIP_BOXES : GLINT_RAY_SKIP_TRIANGLES;
    return (instance.mask & query.mask) != 0u && (query.flags & skipped) == 0u;
}

void glintQueryInitialize(out GlintQuery query, uint number, uint top, uint flags, uint mask, vec3 origin, float t_min,
                          vec3 direction, float t_max) {
    query.number = number;
    query.flags = flags;
    query.mask = mask;
    query.t_min = max(t_min, 0.0);
    query.origin = origin;
    query.direction = direction;
    query.candidate = GlintIntersection(GLINT_CANDIDATE_TRIANGLE, 0.0, vec2(0.0), 0u, 0u, 0u, false, false);
    query.committed = GlintIntersection(GLINT_COMMITTED_NONE, t_max, vec2(0.0), 0u, 0u, 0u, false, false);
    query.instance = GlintInstance(0u, 0u, 0u, 0u, 0u, 0u);
    glintQueryTerminate(query);
    bool goes = glintIsRay(origin, direction, t_min, t_max);
    // A lone instance is where the way begins: there is nothing to find on the level above.
    const uvec4 places = GLINT_TRACING_LOAD(top + 1u);
    uint base = top;
    if (places.w == 1u) {
        query.instance = glintInstance(top, GLINT_TRACING_LOAD(top + places.z + 2u).y);
        query.inside = goes && glintQuerySees(query, query.instance);
        goes = query.inside;
        base = query.instance.base;
        origin = glintToObject(query.instance.texel, origin, true);
        direction = glintToObject(query.instance.texel, direction, false);
    }
    query.space = glintSpace(base, origin, direction);
    query.top = query.space;
    query.top.base = top;
    if (goes) glintBegin(query.way);
}

void glintQueryEnterInstance(inout GlintQuery query) {
    query.instance = glintInstanceAt(query.top, query.way);
    if (!glintQuerySees(query, query.instance)) {
        glintNext(query.way, query.number, query.top.base);
        return;
    }
    query.inside = true;
    query.space = glintInstanceSpace(query.instance, query.origin, query.direction);
    glintPush(query.way, query.number);
    glintBegin(query.way);
}

void glintQueryCommit(inout GlintQuery query, uint type) {
    query.committed = query.candidate;
    query.committed.type = type;
    if ((query.flags & GLINT_RAY_TERMINATE) != 0u) glintQueryTerminate(query);
}

bool glintQueryIsOpaque(GlintQuery query, uint geometry) {
    bool opaque = (geometry & 0x80000000u) != 0u;
    if ((query.instance.flags & GLINT_INSTANCE_OPAQUE) != 0u) opaque = true;
    if ((query.instance.flags & GLINT_INSTANCE_NO_OPAQUE) != 0u) opaque = false;
    if ((query.flags & GLINT_RAY_OPAQUE) != 0u) opaque = true;
    if ((query.flags & GLINT_RAY_NO_OPAQUE) != 0u) opaque = false;
    return opaque;
}

bool glintQueryCullsOpacity(GlintQuery query, bool opaque) {
    return (query.flags & (opaque ? GLINT_RAY_CULL_OPAQUE : GLINT_RAY_CULL_NO_OPAQUE)) != 0u;
}

bool glintQueryIsBefore(GlintIntersection a, GlintIntersection b) {
    if (a.instance != b.instance) return a.instance < b.instance;
    if (a.geometry != b.geometry) return a.geometry < b.geometry;
    return a.primitive < b.primitive;
}

// True if the leaf is a candidate that the caller has to decide on.
bool glintQueryEnterLeaf(inout GlintQuery query, GlintSpace space) {
    const uint record = glintRecord(query.way);
    GlintIntersection next;
    next.instance = query.instance.index;
    if (query.instance.kind == GLINT_KIND_BOXES) {
        const uvec4 last = GLINT_TRACING_LOAD(space.records + 3u * record + 2u);
        next.type = GLINT_CANDIDATE_BOX;
        next.t = 0.0;
        next.barycentrics = vec2(0.0);
        next.primitive = last.y;
        next.geometry = last.z & 0x7fffffffu;
        next.front = false;
        next.opaque = glintQueryIsOpaque(query, last.z);
        glintNext(query.way, query.number, space.base);
        if (glintQueryCullsOpacity(query, next.opaque)) return false;
        query.candidate = next;
        return true;
    }

    GlintTriangleHit hit;
    bool met = glintTriangle(space, record, hit);
    next.type = GLINT_CANDIDATE_TRIANGLE;
    next.t = hit.t;
    next.barycentrics = hit.weights.yz / hit.area;
    next.primitive = hit.primitive;
    next.geometry = hit.geometry & 0x7fffffffu;
    // Seen along z, with x to the right, y is down: clockwise triangles have the positive area.
    next.front = hit.area < 0.0 != ((query.instance.flags & GLINT_INSTANCE_FLIP_FACING) != 0u);
    next.opaque = glintQueryIsOpaque(query, hit.geometry);
    met = met && hit.t > query.t_min && !glintQueryCullsOpacity(query, next.opaque);
    met = met && (hit.t < query.committed.t ||
                  (query.committed.type != GLINT_COMMITTED_NONE && hit.t == query.committed.t &&
                   glintQueryIsBefore(next, query.committed)));
    const uint culled = next.front ? GLINT_RAY_CULL_FRONT : GLINT_RAY_CULL_BACK;
    if ((query.instance.flags & GLINT_INSTANCE_CULL_DISABLE) == 0u) met = met && (query.flags & culled) == 0u;
    if (met && next.opaque) {
        query.committed = next;
        query.committed.type = GLINT_COMMITTED_TRIANGLE;
    } else if (met) {
        query.candidate = next;
    }
    glintNext(query.way, query.number, space.base);
    if (met && next.opaque && (query.flags & GLINT_RAY_TERMINATE) != 0u) glintQueryTerminate(query);
    return met && !next.opaque;
}

// Goes on to the next candidate that the caller has to decide on. False when there is none.
bool glintQueryProceed(inout GlintQuery query) {
    bool asks = false;
    while (!asks && (glintUnderway(query.way) || query.inside)) {
        // All lanes go on to an instance, and then through their instances together, so that what is the same for all
        // of an instance's nodes stays where it is.
        while (glintUnderway(query.way) && !query.inside) {
            if (glintAtNode(query.way))
                glintEnterNode(query.way, query.number, query.top, query.t_min, query.committed.t);
            if (glintAtLeaf(query.way)) glintQueryEnterInstance(query);
        }
        const GlintSpace space = query.space;
        while (glintUnderway(query.way) && !asks) {
            if (glintAtNode(query.way)) glintEnterNode(query.way, query.number, space, query.t_min, query.committed.t);
            if (glintAtLeaf(query.way)) asks = glintQueryEnterLeaf(query, space);
        }
        if (query.inside && !asks) {
            query.inside = false;
            glintLeave(query.way, query.number, query.top.base);
        }
    }
    return asks;
}

void glintQueryConfirm(inout GlintQuery query) { glintQueryCommit(query, GLINT_COMMITTED_TRIANGLE); }

// Of a box candidate. A distance out of the ray's interval, or beyond what is committed, is none.
void glintQueryGenerate(inout GlintQuery query, float t) {
    if (!(t >= query.t_min && t <= query.committed.t)) return;
    query.candidate.t = t;
    glintQueryCommit(query, GLINT_COMMITTED_GENERATED);
}

// What the getters are about.
GlintIntersection glintQueryAbout(GlintQuery query, bool committed) {
    if (committed) return query.committed;
    return query.candidate;
}
uint glintQueryType(GlintQuery query, bool committed) { return glintQueryAbout(query, committed).type; }
float glintQueryT(GlintQuery query, bool committed) { return glintQueryAbout(query, committed).t; }
vec2 glintQueryBarycentrics(GlintQuery query, bool committed) { return glintQueryAbout(query, committed).barycentrics; }
bool glintQueryFrontFace(GlintQuery query, bool committed) { return glintQueryAbout(query, committed).front; }
int glintQueryPrimitiveIndex(GlintQuery query, bool committed) {
    return int(glintQueryAbout(query, committed).primitive);
}
int glintQueryGeometryIndex(GlintQuery query, bool committed) { return int(glintQueryAbout(query, committed).geometry); }
int glintQueryInstanceId(GlintQuery query, bool committed) { return int(glintQueryAbout(query, committed).instance); }
bool glintQueryCandidateBoxOpaque(GlintQuery query) { return query.candidate.opaque; }
uint glintQueryInstance(GlintQuery query, bool committed) {
    return query.top.base + GLINT_TRACING_LOAD(query.top.base + 3u).w +
           8u * glintQueryAbout(query, committed).instance;
}
int glintQueryInstanceCustomIndex(GlintQuery query, bool committed) {
    return int(GLINT_TRACING_LOAD(glintQueryInstance(query, committed) + 6u).y & 0xffffffu);
}
uint glintQueryInstanceOffset(GlintQuery query, bool committed) {
    return GLINT_TRACING_LOAD(glintQueryInstance(query, committed) + 6u).z & 0xffffffu;
}
mat4x3 glintQueryObjectToWorld(GlintQuery query, bool committed) {
    return glintMatrix(glintQueryInstance(query, committed));
}
mat4x3 glintQueryWorldToObject(GlintQuery query, bool committed) {
    return glintMatrix(glintQueryInstance(query, committed) + 3u);
}
vec3 glintQueryObjectRayOrigin(GlintQuery query, bool committed) {
    return glintToObject(glintQueryInstance(query, committed), query.origin, true);
}
vec3 glintQueryObjectRayDirection(GlintQuery query, bool committed) {
    return glintToObject(glintQueryInstance(query, committed), query.direction, false);
}
float glintQueryTMin(GlintQuery query) { return query.t_min; }
uint glintQueryFlags(GlintQuery query) { return query.flags; }
vec3 glintQueryWorldRayOrigin(GlintQuery query) { return query.origin; }
vec3 glintQueryWorldRayDirection(GlintQuery query) { return query.direction; }
