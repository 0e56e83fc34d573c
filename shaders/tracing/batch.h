// A kernel that finds the closest hits of rays in a buffer.
//
//   GLINT_TRACING_LEVELS 1  the hierarchy is one of triangles
//                        2  it is one of instances; those of boxes, and of mask 0, are passed over
//   GLINT_TRACING_REFILL 0  a thread for each ray: the form of choice on lavapipe
//                        1  a thread for each GLINT_TRACING_RAYS rays, and lanes that are done take the next of them;
//                           with one level only
//
// The slots: texel buffer 0 (or what GLINT_TRACING_MEMORY says), uniform 0, storage 0 and 1: rays and hits.
#pragma once

#ifndef GLINT_TRACING_LEVELS
#define GLINT_TRACING_LEVELS 1
#endif
#ifndef GLINT_TRACING_REFILL
#define GLINT_TRACING_REFILL 0
#endif
#ifndef GLINT_TRACING_RAYS
#define GLINT_TRACING_RAYS 16
#endif
// Steps between looking for idle lanes.
#define GLINT_TRACING_STEPS 8

layout(set = 0, binding = 1) uniform GlintBatch {
    uint ray_count;
    uint hierarchy;  // first texel
    uvec2 pointer;   // to the texels, for GLINT_TRACING_ADDRESS
};
#define GLINT_TRACING_POINTER pointer

#include <glint/tracing/memory.h>
#include <glint/tracing/ray_query.h>
#include <glint/tracing/ray_records.h>
#include <glint/tracing/traversal.h>

#if GLINT_TRACING_REFILL && GLINT_TRACING_LEVELS == 2
#error "GLINT_TRACING_REFILL is for one level"
#endif
#if GLINT_TRACING_REFILL
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#endif

layout(local_size_x = 64) in;

layout(set = 0, binding = 2) readonly buffer GlintRays { GlintRay rays[]; };
layout(set = 0, binding = 3) writeonly buffer GlintHits { GlintHit hits[]; };

// The closest hit so far.
struct GlintClosest {
    float t;  // where the ray ends
    bool found;
    GlintTriangleHit hit;
    uint instance;
};

GlintWay glintBeginRay(GlintRay ray, bool means_something, out GlintClosest closest) {
    GlintWay way;
    glintEnd(way);
    if (means_something) glintBegin(way);
    closest = GlintClosest(ray.t_max, false, GlintTriangleHit(0.0, 1.0, vec3(0.0), 0u, 0u), 0u);
    return way;
}

// A node, then a triangle, in each turn: lanes that loop over nodes until all have come to a leaf wait longer.
void glintStep(inout GlintWay way, GlintSpace space, uint instance, float t_min, inout GlintClosest closest) {
    if (glintAtNode(way)) glintEnterNode(way, 0u, space, t_min, closest.t);
    if (glintAtLeaf(way)) {
        GlintTriangleHit hit;
        const bool met = glintTriangle(space, glintRecord(way), hit);
        const bool wins = instance == closest.instance ? glintIsBefore(hit, closest.hit) : instance < closest.instance;
        if (met && hit.t > t_min && (hit.t < closest.t || closest.found && hit.t == closest.t && wins))
            closest = GlintClosest(hit.t, true, hit, instance);
        glintNext(way, 0u, space.base);
    }
}

void glintStore(uint ray, GlintClosest closest, float scale) {
    const bool found = closest.found;
    bool front = closest.hit.area < 0.0;
#if GLINT_TRACING_LEVELS == 2
    if (found && (glintInstance(hierarchy, closest.instance).flags & GLINT_INSTANCE_FLIP_FACING) != 0u) front = !front;
#endif
    hits[ray].t = found ? closest.t * scale : uintBitsToFloat(GLINT_INFINITY);
    hits[ray].primitive = found ? closest.hit.primitive : GLINT_NO_HIT;
    hits[ray].geometry = found ? closest.hit.geometry & 0x7fffffffu : GLINT_NO_HIT;
    hits[ray].u = found ? closest.hit.weights.y / closest.hit.area : 0.0;
    hits[ray].v = found ? closest.hit.weights.z / closest.hit.area : 0.0;
    hits[ray].front = found && front ? 1u : 0u;
    hits[ray].instance = found ? closest.instance : GLINT_NO_HIT;
}

#if GLINT_TRACING_REFILL

void main() {
    // A subgroup shares a run of rays: the next one goes to the lane that asks first.
    const uint run = gl_SubgroupSize * GLINT_TRACING_RAYS;
    uint next = (gl_WorkGroupID.x * gl_NumSubgroups + gl_SubgroupID) * run;
    const uint end = min(ray_count, next + run);
    uint index = 0xffffffffu;
    GlintSpace space;
    float t_min;
    float scale;
    GlintClosest closest;
    GlintWay way;
    glintEnd(way);
    for (;;) {
        const bool idle = !glintUnderway(way);
        const uvec4 idles = subgroupBallot(idle);
        const uint idle_count = subgroupBallotBitCount(idles);
        const bool all_idle = idle_count == gl_SubgroupSize;
        if (next < end ? idle_count * 2u >= gl_SubgroupSize : all_idle) {
            if (idle) {
                if (index < ray_count) glintStore(index, closest, scale);
                index = next + subgroupBallotExclusiveBitCount(idles);
                if (index >= end) index = 0xffffffffu;
                if (index < end) {
                    GlintRay ray = rays[index];
                    scale = glintScale(ray);
                    space = glintSpace(hierarchy, ray.origin, ray.direction);
                    t_min = ray.t_min;
                    way = glintBeginRay(ray, scale != 0.0, closest);
                }
            }
            if (next >= end) return;
            next += idle_count;
        }
        for (int step = 0; step < GLINT_TRACING_STEPS; step++) glintStep(way, space, 0u, t_min, closest);
    }
}

#else

void main() {
    const uint index = gl_GlobalInvocationID.x;
    if (index >= ray_count) return;
    GlintRay ray = rays[index];
    const float scale = glintScale(ray);
    const float t_min = ray.t_min;
    const GlintSpace space = glintSpace(hierarchy, ray.origin, ray.direction);
    GlintClosest closest;
    GlintWay way = glintBeginRay(ray, scale != 0.0, closest);
#if GLINT_TRACING_LEVELS == 1
    while (glintUnderway(way)) glintStep(way, space, 0u, t_min, closest);
#else
    while (glintUnderway(way)) {
        // All lanes go on to an instance, and then through their instances together, so that what is the same for all
        // of an instance's nodes stays where it is.
        GlintInstance instance;
        bool inside = false;
        while (glintUnderway(way) && !inside) {
            if (glintAtNode(way)) glintEnterNode(way, 0u, space, t_min, closest.t);
            if (glintAtLeaf(way)) {
                instance = glintInstanceAt(space, way);
                inside = instance.mask != 0u && instance.kind == GLINT_KIND_TRIANGLES;
                if (!inside) glintNext(way, 0u, space.base);
            }
        }
        if (inside) {
            const GlintSpace below = glintInstanceSpace(instance, ray.origin, ray.direction);
            glintPush(way, 0u);
            glintBegin(way);
            while (glintUnderway(way)) glintStep(way, below, instance.index, t_min, closest);
            glintLeave(way, 0u, space.base);
        }
    }
#endif
    glintStore(index, closest, scale);
}

#endif
