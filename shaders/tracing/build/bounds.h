// The common box of what the threads of a dispatch have seen, and the number of active primitives.
#pragma once

#include <glint/tracing/build/common.h>

shared uint group_box[6];
shared uint group_active;

// Every thread of the group calls this, once. Minima, maxima and sums do not depend on the order.
void glintAddBounds(GlintBox box, uint present) {
    if (gl_LocalInvocationIndex < 3u) {
        group_box[gl_LocalInvocationIndex] = 0xffffffffu;
        group_box[gl_LocalInvocationIndex + 3u] = 0u;
    }
    if (gl_LocalInvocationIndex == 0u) group_active = 0u;
    barrier();
    if (present > 0u) {
        for (uint i = 0u; i < 3u; i++) {
            atomicMin(group_box[i], glintOrder(box.low[i]));
            atomicMax(group_box[i + 3u], glintOrder(box.high[i]));
        }
        atomicAdd(group_active, present);
    }
    barrier();
    if (group_active == 0u) return;
    if (gl_LocalInvocationIndex < 3u) {
        atomicMin(scratch[GLINT_STATE_BOX + gl_LocalInvocationIndex], group_box[gl_LocalInvocationIndex]);
        atomicMax(scratch[GLINT_STATE_BOX + 3u + gl_LocalInvocationIndex], group_box[gl_LocalInvocationIndex + 3u]);
    }
    if (gl_LocalInvocationIndex == 0u) atomicAdd(scratch[GLINT_STATE_ACTIVE], group_active);
}
