// The corners of a triangle of a mesh in clip space, by its number less the first.
#pragma once

#include <glint/raster/corner.h>

layout(std430, binding = 5) readonly buffer Positions { float positions[]; };
layout(std430, binding = 6) readonly buffer Indices { uint indices[]; };

uvec3 meshCorners(uint triangle) {
    uvec3 corners = 3u * triangle + uvec3(0u, 1u, 2u);
    const uint first = frame.index_first + corners.x;
    if (frame.is_indexed != 0u) corners = uvec3(indices[first], indices[first + 1u], indices[first + 2u]);
    return corners;
}

// One that is not there is NaN, and so is what it becomes.
vec4 meshPosition(uint vertex) {
    const uint first = frame.position_first + min(vertex, frame.vertices - 1u) * frame.position_stride;
    const vec3 p = vec3(positions[first], positions[first + 1u], positions[first + 2u]);
    vec4 clip = transformPosition(p);
    if (vertex >= frame.vertices) clip.w = uintBitsToFloat(0x7fc00000u);
    return clip;
}

void trianglePositions(uint id, out vec4 a, out vec4 b, out vec4 c) {
    const uvec3 corners = meshCorners(id - frame.first_id);
    a = meshPosition(corners.x);
    b = meshPosition(corners.y);
    c = meshPosition(corners.z);
}
