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

// Both levels' lists.
#define GLINT_QUERY_STACK (2 * GLINT_TRACING_STACK + 1)
uint glint_query_nodes[GLINT_TRACING_QUERIES][GLINT_QUERY_STACK];
uint glint_query_lists[GLINT_TRACING_QUERIES][GLINT_QUERY_STACK];

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

    GlintSpace top;
    GlintSpace space;  // of the level that the ray is at
    uint node;         // whose children are in `list`
    uvec2 header;      // its words 2 and 3
    uint list;         // what is left of them after `slot`
    uint slot;         // the child to go to; NONE when there is none left at this level
    uint stacked;
    uint bottom;          // entries of the top level when the ray is within an instance
    bool inside;          // of an instance
    uint instance;        // texel of it
    uint instance_index;  // and its place in the list
    uint instance_flags;
    uint kind;  // of its hierarchy
};

void glintQueryTerminate(inout GlintQuery query) {
    query.slot = GLINT_TRACING_NONE;
    query.list = GLINT_TRACING_EMPTY;
    query.stacked = 0u;
    query.bottom = 0u;
    query.inside = false;
}

void glintQueryRoot(inout GlintQuery query) {
    query.node = 0u;
    query.header = uvec2(0x100u, 0u);  // child 0 is node 1
    query.list = GLINT_TRACING_EMPTY;
    query.slot = 0u;
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
    query.top = glintSpace(top, origin, direction);
    query.space = query.top;
    query.instance = 0u;
    query.instance_index = 0u;
    query.instance_flags = 0u;
    query.kind = 0u;
    glintQueryTerminate(query);
    if (glintIsRay(origin, direction, t_min, t_max)) glintQueryRoot(query);
}

void glintQueryNext(inout GlintQuery query) {
    if (query.list == GLINT_TRACING_EMPTY && query.stacked > query.bottom) {
        query.stacked--;
        query.list = glint_query_lists[query.number][query.stacked];
        query.node = glint_query_nodes[query.number][query.stacked];
        query.header = GLINT_TRACING_LOAD(query.space.base + 4u * query.node).zw;
    }
    query.slot = glintFirst(query.list);
    query.list = glintRest(query.list);
}

// What is left of this node's children waits on the stack.
void glintQueryPush(inout GlintQuery query) {
    if (query.list == GLINT_TRACING_EMPTY) return;
    glint_query_nodes[query.number][query.stacked] = query.node;
    glint_query_lists[query.number][query.stacked] = query.list;
    query.stacked++;
}

void glintQueryEnterNode(inout GlintQuery query) {
    glintQueryPush(query);
    query.node = glintChildNode(query.header, query.slot);
    query.list = glintNode(query.space, query.node, query.t_min, query.committed.t, query.header);
    glintQueryNext(query);
}

void glintQueryEnterInstance(inout GlintQuery query) {
    const uint record = query.space.records + 3u * glintChildRecord(query.header, query.slot);
    const uint index = GLINT_TRACING_LOAD(record + 2u).y;
    const uint instance = query.top.base + GLINT_TRACING_LOAD(query.top.base + 3u).w + 8u * index;
    const uvec4 data = GLINT_TRACING_LOAD(instance + 6u);
    const uint kind = GLINT_TRACING_LOAD(data.x + 2u).w;
    const uint skipped = kind == GLINT_KIND_BOXES ? GLINT_RAY_SKIP_BOXES : GLINT_RAY_SKIP_TRIANGLES;
    if ((data.y >> 24 & query.mask) == 0u || (query.flags & skipped) != 0u) {
        glintQueryNext(query);
        return;
    }
    glintQueryPush(query);
    query.bottom = query.stacked;
    query.inside = true;
    query.instance = instance;
    query.instance_index = index;
    query.instance_flags = data.z >> 24;
    query.kind = kind;
    query.space = glintSpace(data.x, glintToObject(instance, query.origin, true),
                             glintToObject(instance, query.direction, false));
    glintQueryRoot(query);
}

void glintQueryLeaveInstance(inout GlintQuery query) {
    query.inside = false;
    query.bottom = 0u;
    query.space = query.top;
    query.list = GLINT_TRACING_EMPTY;
    glintQueryNext(query);
}

void glintQueryCommit(inout GlintQuery query, uint type) {
    query.committed = query.candidate;
    query.committed.type = type;
    if ((query.flags & GLINT_RAY_TERMINATE) != 0u) glintQueryTerminate(query);
}

bool glintQueryIsOpaque(GlintQuery query, uint geometry) {
    bool opaque = (geometry & 0x80000000u) != 0u;
    if ((query.instance_flags & GLINT_INSTANCE_OPAQUE) != 0u) opaque = true;
    if ((query.instance_flags & GLINT_INSTANCE_NO_OPAQUE) != 0u) opaque = false;
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
bool glintQueryEnterLeaf(inout GlintQuery query) {
    const uint record = glintChildRecord(query.header, query.slot);
    GlintIntersection next;
    next.instance = query.instance_index;
    if (query.kind == GLINT_KIND_BOXES) {
        const uvec4 last = GLINT_TRACING_LOAD(query.space.records + 3u * record + 2u);
        next.type = GLINT_CANDIDATE_BOX;
        next.t = 0.0;
        next.barycentrics = vec2(0.0);
        next.primitive = last.y;
        next.geometry = last.z & 0x7fffffffu;
        next.front = false;
        next.opaque = glintQueryIsOpaque(query, last.z);
        glintQueryNext(query);
        if (glintQueryCullsOpacity(query, next.opaque)) return false;
        query.candidate = next;
        return true;
    }

    GlintTriangleHit hit;
    bool met = glintTriangle(query.space, record, hit);
    next.type = GLINT_CANDIDATE_TRIANGLE;
    next.t = hit.t;
    next.barycentrics = hit.weights.yz / hit.area;
    next.primitive = hit.primitive;
    next.geometry = hit.geometry & 0x7fffffffu;
    // Seen along z, with x to the right, y is down: clockwise triangles have the positive area.
    next.front = hit.area < 0.0 != ((query.instance_flags & GLINT_INSTANCE_FLIP_FACING) != 0u);
    next.opaque = glintQueryIsOpaque(query, hit.geometry);
    met = met && hit.t > query.t_min && !glintQueryCullsOpacity(query, next.opaque);
    met = met && (hit.t < query.committed.t ||
                  (query.committed.type != GLINT_COMMITTED_NONE && hit.t == query.committed.t &&
                   glintQueryIsBefore(next, query.committed)));
    const uint culled = next.front ? GLINT_RAY_CULL_FRONT : GLINT_RAY_CULL_BACK;
    if ((query.instance_flags & GLINT_INSTANCE_CULL_DISABLE) == 0u) met = met && (query.flags & culled) == 0u;
    if (met) {
        query.candidate = next;
        if (next.opaque) {
            query.committed = next;
            query.committed.type = GLINT_COMMITTED_TRIANGLE;
        }
    }
    glintQueryNext(query);
    if (met && next.opaque && (query.flags & GLINT_RAY_TERMINATE) != 0u) glintQueryTerminate(query);
    return met && !next.opaque;
}

// Goes on to the next candidate that the caller has to decide on. False when there is none.
bool glintQueryProceed(inout GlintQuery query) {
    bool asks = false;
    while (!asks && (query.slot != GLINT_TRACING_NONE || query.inside)) {
        if (query.slot != GLINT_TRACING_NONE && !glintIsLeaf(query.header, query.slot)) glintQueryEnterNode(query);
        if (query.slot == GLINT_TRACING_NONE) {
            if (query.inside) glintQueryLeaveInstance(query);
        } else if (glintIsLeaf(query.header, query.slot)) {
            if (query.inside)
                asks = glintQueryEnterLeaf(query);
            else
                glintQueryEnterInstance(query);
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
