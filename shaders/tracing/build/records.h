// The primitives' records of one geometry, each at its place. GLINT_BUILD_REFIT 1: of a hierarchy that exists, and the
// box of all that are active. There, with count 0, the geometry is the only one, and the records themselves say which
// primitives they have.
#pragma once

#define GLINT_BUILD_HEAP 1
#include <glint/tracing/build/bounds.h>
#include <glint/tracing/build/input.h>

void main() {
    const uint records = GLINT_TRACING_LOAD(build.hierarchy + 1u).w;
    const uint first_record = build.hierarchy + GLINT_TRACING_LOAD(build.hierarchy + 1u).z;
    GlintBox all_boxes = GLINT_EMPTY;
    uint present = 0u;
#if GLINT_BUILD_REFIT
    const bool gathers = build.count == 0u;
#else
    const bool gathers = false;
#endif
    GLINT_FOR(i, gathers ? records : build.count) {
        uint place = i;
        uint primitive = i;
        if (gathers)
            primitive = GLINT_TRACING_LOAD(first_record + 3u * i + 2u).y;
        else
            place = scratch[build.keys + 2u * (build.first + i)];
        if (place == GLINT_NONE) continue;
        const GlintShape shape = glintShape(primitive);
#if GLINT_BUILD_REFIT
        if (glintIsActive(shape)) {
            all_boxes = glintJoin(all_boxes, glintBoxOf(shape));
            present++;
        }
#endif
#if GLINT_BUILD_INPUT == 0
        const uvec3 a = floatBitsToUint(shape.corners[0]);
        const uvec3 b = floatBitsToUint(shape.corners[1]);
        const uvec3 c = floatBitsToUint(shape.corners[2]);
#else
        const uvec3 a = floatBitsToUint(shape.corners[0]);
        const uvec3 b = floatBitsToUint(shape.corners[1]);
        const uvec3 c = uvec3(0u);
#endif
        const uint texel = first_record + 3u * place;
        GLINT_TRACING_STORE(texel, uvec4(a, b.x));
        GLINT_TRACING_STORE(texel + 1u, uvec4(b.yz, c.xy));
        GLINT_TRACING_STORE(texel + 2u, uvec4(c.z, primitive, build.geometry, build.first + primitive));
    }
#if GLINT_BUILD_REFIT
    glintAddBounds(all_boxes, present);
#endif
}
