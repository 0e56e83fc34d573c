// Triangles and boxes as the caller has them. GLINT_BUILD_INPUT: 0 triangles, 1 boxes, 2 instances.
#pragma once

#include <glint/tracing/build/common.h>

layout(set = 0, binding = 2) readonly buffer GlintData { uint data[]; };

vec3 glintDataVector(uint word) {
    return vec3(uintBitsToFloat(data[word]), uintBitsToFloat(data[word + 1u]), uintBitsToFloat(data[word + 2u]));
}

#if GLINT_BUILD_INPUT == 0
layout(set = 0, binding = 3) readonly buffer GlintIndices { uint indices[]; };

uint glintIndex(uint i) {
    if (build.index_size == 2u) return indices[build.index / 2u + i];
    if (build.index_size == 1u) return indices[(build.index + i) >> 1] >> 16 * ((build.index + i) & 1u) & 0xffffu;
    return i;
}

struct GlintShape {
    vec3 corners[3];
};

// One that names a vertex that is not there has no corners that are numbers.
GlintShape glintShape(uint primitive) {
    GlintShape shape;
    for (uint i = 0u; i < 3u; i++) {
        const uint vertex = glintIndex(3u * primitive + i);
        shape.corners[i] = vec3(uintBitsToFloat(0x7fc00000u));
        if (vertex < build.vertices) shape.corners[i] = glintDataVector(build.data + vertex * build.stride);
    }
    return shape;
}

bool glintIsActive(GlintShape shape) {
    return glintInRange(shape.corners[0]) && glintInRange(shape.corners[1]) && glintInRange(shape.corners[2]);
}

GlintBox glintBoxOf(GlintShape shape) {
    return GlintBox(min(min(shape.corners[0], shape.corners[1]), shape.corners[2]),
                    max(max(shape.corners[0], shape.corners[1]), shape.corners[2]));
}

#else

struct GlintShape {
    vec3 corners[2];
};

GlintShape glintShape(uint primitive) {
    const uint word = build.data + primitive * build.stride;
    GlintShape shape;
    shape.corners[0] = glintDataVector(word);
    shape.corners[1] = glintDataVector(word + 3u);
    return shape;
}

bool glintIsActive(GlintShape shape) {
    return glintInRange(shape.corners[0]) && glintInRange(shape.corners[1]) &&
           all(lessThanEqual(shape.corners[0], shape.corners[1]));
}

GlintBox glintBoxOf(GlintShape shape) { return GlintBox(shape.corners[0], shape.corners[1]); }

#endif
