// A kernel that finds the closest hits of rays in a buffer. GLINT_TRACING_REFILL 0: a thread for each ray, the form of
// choice on lavapipe. 1: a thread for each GLINT_TRACING_RAYS rays, and lanes that are done take the next of them.
// GLINT_TRACING_LEVELS 1: the hierarchy is one of triangles. 2: it is one of instances of those; others, and those of
// mask 0, are passed over.
//
// The slots: texel buffer 0 (or what GLINT_TRACING_MEMORY says), uniform 0, storage 0 and 1: rays and hits.
#pragma once

#include <glint/tracing/memory.h>
#include <glint/tracing/ray_query.h>
#include <glint/tracing/traversal.h>

#ifndef GLINT_TRACING_REFILL
#define GLINT_TRACING_REFILL 0
#endif
#ifndef GLINT_TRACING_RAYS
#define GLINT_TRACING_RAYS 16
#endif
#ifndef GLINT_TRACING_LEVELS
#define GLINT_TRACING_LEVELS 1
#endif
// Steps between looking for idle lanes.
#define GLINT_TRACING_STEPS 8
#if GLINT_TRACING_REFILL
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#endif

layout(local_size_x = 64) in;

struct GlintRay {
    vec3 origin;
    float t_min;
    vec3 direction;
    float t_max;
};

struct GlintHit {
    float t;  // infinity if there is none
    uint primitive;
    uint geometry;
    float u;  // of the second corner
    float v;  // of the third
    uint front;
    uint instance;
    uint unused;
};

layout(set = 0, binding = 1) uniform GlintBatch {
    uint ray_count;
    uint hierarchy;  // first texel
};
layout(set = 0, binding = 2) readonly buffer GlintRays { GlintRay rays[]; };
layout(set = 0, binding = 3) writeonly buffer GlintHits { GlintHit hits[]; };

// A ray on its way.
struct GlintWay {
    GlintSpace space;
    float t_min;
    float t_max;  // of the closest hit so far
    GlintTriangleHit best;
    bool found;
    uint node;      // whose children are in `list`
    uvec2 header;   // its words 2 and 3
    uint list;      // what is left of them after `slot`
    uint slot;      // the child to go to; NONE when there is none left at this level
    uint stacked;
#if GLINT_TRACING_LEVELS == 2
    GlintSpace top;
    vec3 direction;
    bool inside;         // of an instance
    uint instances;      // texel of the first
    uint bottom;         // entries of the top level when the ray is within an instance
    uint instance;       // its place in the list
    uint best_instance;  // of the closest hit
#endif
};

#if GLINT_TRACING_LEVELS == 2
#define GLINT_BATCH_STACK (2 * GLINT_TRACING_STACK + 1)
#else
#define GLINT_BATCH_STACK GLINT_TRACING_STACK
#endif
uint stack_nodes[GLINT_BATCH_STACK];
uint stack_lists[GLINT_BATCH_STACK];

bool glintAtNode(GlintWay way) { return way.slot != GLINT_TRACING_NONE && !glintIsLeaf(way.header, way.slot); }
bool glintAtLeaf(GlintWay way) { return way.slot != GLINT_TRACING_NONE && glintIsLeaf(way.header, way.slot); }

void glintRoot(inout GlintWay way) {
    way.node = 0u;
    way.header = uvec2(0x100u, 0u);  // child 0 is node 1, the root
    way.list = GLINT_TRACING_EMPTY;
    way.slot = 0u;
}

void glintBegin(uint index, out GlintWay way) {
    const GlintRay ray = rays[index];
    way.space = glintSpace(hierarchy, ray.origin, ray.direction);
    way.t_min = max(ray.t_min, 0.0);
    way.t_max = ray.t_max;
    way.best = GlintTriangleHit(0.0, 1.0, vec3(0.0), 0u, 0u);
    way.found = false;
    glintRoot(way);
    way.slot = glintIsRay(ray.origin, ray.direction, ray.t_min, ray.t_max) ? 0u : GLINT_TRACING_NONE;
    way.stacked = 0u;
#if GLINT_TRACING_LEVELS == 2
    way.top = way.space;
    way.direction = ray.direction;
    way.instances = hierarchy + GLINT_TRACING_LOAD(hierarchy + 3u).w;
    way.inside = false;
    way.instance = 0u;
    way.best_instance = 0u;
#endif
}

// The next child: of this node, or of the last one that has children left. (Keeping on the stack where these begin, and
// passing over what lies beyond the closest hit, takes more time than it saves: docs/tracing.md.)
void glintNext(inout GlintWay way) {
#if GLINT_TRACING_LEVELS == 2
    if (way.inside && way.list == GLINT_TRACING_EMPTY && way.stacked == way.bottom) {
        way.inside = false;
        way.space = way.top;
    }
#endif
    if (way.list == GLINT_TRACING_EMPTY && way.stacked > 0u) {
        way.stacked--;
        way.list = stack_lists[way.stacked];
        way.node = stack_nodes[way.stacked];
        way.header = GLINT_TRACING_LOAD(way.space.base + 4u * way.node).zw;
    }
    way.slot = glintFirst(way.list);
    way.list = glintRest(way.list);
}

void glintEnterNode(inout GlintWay way) {
    // What is left of the node before waits on the stack.
    if (way.list != GLINT_TRACING_EMPTY) {
        stack_nodes[way.stacked] = way.node;
        stack_lists[way.stacked] = way.list;
        way.stacked++;
    }
    way.node = glintChildNode(way.header, way.slot);
    way.list = glintNode(way.space, way.node, way.t_min, way.t_max, way.header);
    glintNext(way);
}

bool glintWins(GlintTriangleHit hit, GlintWay way) {
#if GLINT_TRACING_LEVELS == 2
    if (way.instance != way.best_instance) return way.instance < way.best_instance;
#endif
    return glintIsBefore(hit, way.best);
}

void glintEnterTriangle(inout GlintWay way) {
    GlintTriangleHit hit;
    if (glintTriangle(way.space, glintChildRecord(way.header, way.slot), hit) && hit.t > way.t_min &&
        (hit.t < way.t_max || way.found && hit.t == way.t_max && glintWins(hit, way))) {
        way.t_max = hit.t;
        way.best = hit;
        way.found = true;
#if GLINT_TRACING_LEVELS == 2
        way.best_instance = way.instance;
#endif
    }
    glintNext(way);
}

#if GLINT_TRACING_LEVELS == 2

void glintEnterInstance(inout GlintWay way) {
    const uint index = GLINT_TRACING_LOAD(way.space.records + 3u * glintChildRecord(way.header, way.slot) + 2u).y;
    const uint instance = way.instances + 8u * index;
    const uvec4 data = GLINT_TRACING_LOAD(instance + 6u);
    const uint kind = GLINT_TRACING_LOAD(data.x + 2u).w;
    if (data.y >> 24 == 0u || kind != GLINT_KIND_TRIANGLES) {
        glintNext(way);
        return;
    }
    if (way.list != GLINT_TRACING_EMPTY) {
        stack_nodes[way.stacked] = way.node;
        stack_lists[way.stacked] = way.list;
        way.stacked++;
    }
    way.bottom = way.stacked;
    way.inside = true;
    way.instance = index;
    way.space = glintSpace(data.x, glintToObject(instance, way.top.origin, true),
                           glintToObject(instance, way.direction, false));
    glintRoot(way);
}

#endif

// A node, then a leaf.
void glintStep(inout GlintWay way) {
    if (glintAtNode(way)) glintEnterNode(way);
#if GLINT_TRACING_LEVELS == 2
    if (glintAtLeaf(way) && way.inside) glintEnterTriangle(way);
    if (glintAtLeaf(way) && !way.inside) glintEnterInstance(way);
#else
    if (glintAtLeaf(way)) glintEnterTriangle(way);
#endif
}

void glintStore(uint ray, GlintWay way) {
    const bool found = way.found;
    bool front = way.best.area < 0.0;
#if GLINT_TRACING_LEVELS == 2
    const uint instance = way.best_instance;
    if (found) {
        const uint flags = GLINT_TRACING_LOAD(way.instances + 8u * instance + 6u).z >> 24;
        if ((flags & GLINT_INSTANCE_FLIP_FACING) != 0u) front = !front;
    }
#else
    const uint instance = 0u;
#endif
    hits[ray].t = found ? way.t_max : uintBitsToFloat(0x7f800000u);
    hits[ray].primitive = found ? way.best.primitive : 0xffffffffu;
    hits[ray].geometry = found ? way.best.geometry & 0x7fffffffu : 0xffffffffu;
    hits[ray].u = found ? way.best.weights.y / way.best.area : 0.0;
    hits[ray].v = found ? way.best.weights.z / way.best.area : 0.0;
    hits[ray].front = found && front ? 1u : 0u;
    hits[ray].instance = found ? instance : 0xffffffffu;
}

#if GLINT_TRACING_REFILL == 0

void main() {
    const uint index = gl_GlobalInvocationID.x;
    if (index >= ray_count) return;
    GlintWay way;
    glintBegin(index, way);
    // A node, then a leaf, in each turn: lanes that loop over nodes until all have come to a leaf wait longer.
    while (way.slot != GLINT_TRACING_NONE) {
        glintStep(way);
    }
    glintStore(index, way);
}

#else

void main() {
    // A subgroup shares a run of rays: the next one goes to the lane that asks first.
    const uint run = gl_SubgroupSize * GLINT_TRACING_RAYS;
    uint next = (gl_WorkGroupID.x * gl_NumSubgroups + gl_SubgroupID) * run;
    const uint end = min(ray_count, next + run);
    uint index = 0xffffffffu;
    GlintWay way;
    way.slot = GLINT_TRACING_NONE;
    for (;;) {
        const bool idle = way.slot == GLINT_TRACING_NONE;
        const uvec4 idles = subgroupBallot(idle);
        const uint idle_count = subgroupBallotBitCount(idles);
        const bool all_idle = idle_count == gl_SubgroupSize;
        if (next < end ? idle_count * 2u >= gl_SubgroupSize : all_idle) {
            if (idle) {
                if (index < ray_count) glintStore(index, way);
                index = next + subgroupBallotExclusiveBitCount(idles);
                if (index >= end) index = 0xffffffffu;
                if (index < end) glintBegin(index, way);
            }
            if (next >= end) return;
            next += idle_count;
        }
        for (int step = 0; step < GLINT_TRACING_STEPS; step++) {
            glintStep(way);
        }
    }
}

#endif
