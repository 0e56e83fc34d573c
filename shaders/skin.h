// Vertices that follow joints: #include <glint/skin.h>. docs/models.md shows a vertex shader, and says what is exact.
#pragma once

#include <glint/ray.h>

// The transform of a vertex from those of its four joints; weights add up to 1. Joints in a buffer of Transform3x4, as
// SceneModel has them: layout(std430, row_major) readonly buffer Joints { mat4x3 joints[]; };
mat4x3 glintSkin(mat4x3 a, mat4x3 b, mat4x3 c, mat4x3 d, vec4 weights) {
    precise mat4x3 blend = mat4x3(a[0] * weights.x + b[0] * weights.y + c[0] * weights.z + d[0] * weights.w,
                                  a[1] * weights.x + b[1] * weights.y + c[1] * weights.z + d[1] * weights.w,
                                  a[2] * weights.x + b[2] * weights.y + c[2] * weights.z + d[2] * weights.w,
                                  a[3] * weights.x + b[3] * weights.y + c[3] * weights.z + d[3] * weights.w);
    return blend;
}

// A point. Its normal goes by glintTransformNormal, its tangent by glintTransformTangent: <glint/ray.h>.
vec3 glintTransformPoint(mat4x3 matrix, vec3 point) {
    precise vec3 sum = glintLinear(matrix, point) + matrix[3];
    return sum;
}
