// The header and its grid, as core/tracing/node.cpp makes them. GLINT_BUILD_REFIT 1: of a hierarchy that exists.
#pragma once

#define GLINT_BUILD_HEAP 1
#include <glint/tracing/build/common.h>

// Smallest e with x <= 2^e, for normal x; -126 at most for 0 and denormals.
int glintExponentAbove(float x) {
    const uint bits = floatBitsToUint(x);
    return int(bits >> 23) - 127 + ((bits & 0x7fffffu) != 0u ? 1 : 0);
}

void main() {
    if (gl_GlobalInvocationID.x != 0u) return;
    const GlintBox bounds = glintBounds();
    vec3 minimum = vec3(0.0);
    float step = 1.0;
    if (!glintIsEmpty(bounds)) {
        const vec3 size = bounds.high - bounds.low;
        const vec3 reach = max(abs(bounds.low), abs(bounds.high));
        const int extent = glintExponentAbove(max(size.x, max(size.y, size.z)));
        const int farthest = glintExponentAbove(max(reach.x, max(reach.y, reach.z)));
        const int exponent = max(max(extent - 19, farthest - 22), -100);
        step = uintBitsToFloat(uint(127 + exponent) << 23);
        precise vec3 places = floor(bounds.low * uintBitsToFloat(uint(127 - exponent) << 23)) - 4097.0;
        minimum = places * step;
    }
#if GLINT_BUILD_REFIT
    const uvec4 places = GLINT_TRACING_LOAD(build.hierarchy + 1u);
    const uint instances = GLINT_TRACING_LOAD(build.hierarchy + 3u).w;
    const uint nodes = places.y;
    const uint records = places.w;
#else
    const uint instances = build.instances;
    const uint nodes = 1u + scratch[GLINT_STATE_TOTALS];
    const uint records = scratch[GLINT_STATE_ACTIVE];
#endif
    GLINT_TRACING_STORE(build.hierarchy, uvec4(floatBitsToUint(minimum), floatBitsToUint(step)));
    GLINT_TRACING_STORE(build.hierarchy + 1u,
                        uvec4(floatBitsToUint(step) - (2u << 23), nodes, GLINT_NODE_TEXELS * (nodes + 1u), records));
    GLINT_TRACING_STORE(build.hierarchy + 2u, uvec4(floatBitsToUint(bounds.low), build.kind));
    GLINT_TRACING_STORE(build.hierarchy + 3u, uvec4(floatBitsToUint(bounds.high), instances));
}
