// Points to start rays from and to end them at, and normals under transforms: #include <glint/ray.h>. docs/rays.md
// derives the bounds and says what is promised; core/math/ray.h has the same functions for C++, with the same
// arithmetic.
#pragma once

// The largest relative error of a rounding, 2^-24.
#define GLINT_ROUNDING 5.9604644775390625e-8
// Where a segment ends, in its own lengths: 1 - 2^-20.
#define GLINT_SEGMENT_END 0.99999904632568359375

// A point on a triangle, in the world, with what its rays have to keep away from the triangle's plane.
struct GlintSurfacePoint {
    vec3 position;
    vec3 normal;   // of the plane, length 1, to the side from which the corners are counter-clockwise; 0: there is none
    float offset;  // along the normal: rays start this far from the position
    float slope;   // the same for each unit of distance, for rays that come from afar
};

// A point that is on no surface: a lamp, a camera.
GlintSurfacePoint glintFreePoint(vec3 position) { return GlintSurfacePoint(position, vec3(0.0), 0.0, 0.0); }

float glintLargest(vec3 v) { return max(v.x, max(v.y, v.z)); }

float glintSum(vec3 v) {
    precise float sum = v.x + v.y + v.z;
    return sum;
}

// Its magnitude's power of two, and one over that, exactly. 0 has 0 and 2^127.
float glintPower(float x) { return uintBitsToFloat(floatBitsToUint(x) & 0x7f800000u); }
float glintInversePower(float x) { return uintBitsToFloat(0x7f000000u - (floatBitsToUint(x) & 0x7f800000u)); }

float glintDot(vec3 a, vec3 b) {
    precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
    return sum;
}

// The columns of the left 3x3.
vec3 glintLinear(mat4x3 matrix, vec3 v) {
    precise vec3 sum = matrix[0] * v.x + matrix[1] * v.y + matrix[2] * v.z;
    return sum;
}

// A row vector times the left 3x3.
vec3 glintRow(vec3 v, mat4x3 matrix) {
    return vec3(glintDot(v, matrix[0]), glintDot(v, matrix[1]), glintDot(v, matrix[2]));
}

mat4x3 glintAbsolute(mat4x3 matrix) { return mat4x3(abs(matrix[0]), abs(matrix[1]), abs(matrix[2]), abs(matrix[3])); }

// Of length 1, or 0 where there is no direction: a zero vector, a NaN, an infinity.
vec3 glintUnit(vec3 v) {
    precise vec3 scaled = v * glintInversePower(glintLargest(abs(v)));
    const float square = glintDot(scaled, scaled);
    return square > 0.0 && square <= 12.0 ? scaled / sqrt(square) : vec3(0.0);
}

// What is left of products after rounding, exactly (Dekker).
vec3 glintProductError(vec3 a, vec3 b, vec3 product) {
    precise vec3 split_a = 4097.0 * a;
    precise vec3 split_b = 4097.0 * b;
    precise vec3 a_high = split_a - (split_a - a);
    precise vec3 b_high = split_b - (split_b - b);
    precise vec3 a_low = a - a_high;
    precise vec3 b_low = b - b_high;
    precise vec3 error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
    return error;
}

// Each component to two roundings of its own size, however much cancels. Components up to 2^60.
vec3 glintCross(vec3 a, vec3 b) {
    precise vec3 first = a.yzx * b.zxy;
    precise vec3 second = a.zxy * b.yzx;
    precise vec3 cross =
        (first - second) + (glintProductError(a.yzx, b.zxy, first) - glintProductError(a.zxy, b.yzx, second));
    return cross;
}

// Positive for transforms that keep the order of corners, negative for mirrors, 0 for those without an inverse.
float glintDeterminant(mat4x3 matrix) { return glintDot(matrix[0], glintCross(matrix[1], matrix[2])); }

// A normal under any affine transform, by cofactors: no inverse is needed, and a transform that flattens everything to
// a plane gives that plane's. Outside stays outside under mirrors. Length 1, or 0 where the normal has no image.
vec3 glintTransformNormal(mat4x3 to_world, vec3 normal) {
    const float scale = glintInversePower(
        max(glintLargest(abs(to_world[0])), max(glintLargest(abs(to_world[1])), glintLargest(abs(to_world[2])))));
    precise mat4x3 m = mat4x3(to_world[0] * scale, to_world[1] * scale, to_world[2] * scale, vec3(0.0));
    const mat4x3 cofactors = mat4x3(glintCross(m[1], m[2]), glintCross(m[2], m[0]), glintCross(m[0], m[1]), vec3(0.0));
    const vec3 unit = glintUnit(glintLinear(cofactors, glintUnit(normal)));
    return glintDot(m[0], cofactors[0]) < 0.0 ? -unit : unit;
}

// A tangent with the sign of its bitangent in w: cross(normal, tangent) * w. Length 1, or 0 where it has no image.
vec4 glintTransformTangent(mat4x3 to_world, vec4 tangent) {
    const float scale = glintInversePower(
        max(glintLargest(abs(to_world[0])), max(glintLargest(abs(to_world[1])), glintLargest(abs(to_world[2])))));
    precise mat4x3 m = mat4x3(to_world[0] * scale, to_world[1] * scale, to_world[2] * scale, vec3(0.0));
    return vec4(glintUnit(glintLinear(m, glintUnit(tangent.xyz))),
                glintDeterminant(m) < 0.0 ? -tangent.w : tangent.w);
}

// A hit on a triangle with the corners a, b, c: its barycentrics are of b and c, as queries give them. The transforms
// are the instance's, as queries give them too.
GlintSurfacePoint glintSurfacePoint(vec3 a, vec3 b, vec3 c, vec2 barycentrics, mat4x3 to_world, mat4x3 to_object) {
    GlintSurfacePoint point;
    precise vec3 ab = b - a;
    precise vec3 ac = c - a;
    precise vec3 bc = c - b;
    precise vec3 place = a + (ab * barycentrics.x + ac * barycentrics.y);
    precise vec3 position = glintLinear(to_world, place) + to_world[3];
    point.position = position;
    // Where the position is in object space, with what both transforms and their rounding add.
    precise vec3 residual = (glintLinear(to_object, position) + to_object[3]) - place;

    // The normal by the two edges that are not the longest one, in units of the triangle's size.
    const float size = max(glintLargest(abs(ab)), max(glintLargest(abs(ac)), glintLargest(abs(bc))));
    const float scale = glintInversePower(size);
    precise vec3 unit_ab = ab * scale;
    precise vec3 unit_ac = ac * scale;
    precise vec3 unit_bc = bc * scale;
    const float square_ab = glintDot(unit_ab, unit_ab);
    const float square_ac = glintDot(unit_ac, unit_ac);
    const float square_bc = glintDot(unit_bc, unit_bc);
    const float longest = max(square_ab, max(square_ac, square_bc));
    const vec3 first = square_ab == longest ? unit_ac : unit_ab;
    const vec3 second = square_ab != longest && square_ac != longest ? unit_ac : unit_bc;
    precise vec3 plus = first.yzx * second.zxy;
    precise vec3 minus = first.zxy * second.yzx;
    precise vec3 object_normal = plus - minus;
    precise vec3 doubt = (abs(plus) + abs(minus)) * (4.0 * GLINT_ROUNDING);  // of the normal
    const vec3 normal = glintRow(object_normal, to_object);
    const float inverse_power = glintInversePower(glintLargest(abs(normal)));
    precise vec3 scaled = normal * inverse_power;
    const float square = glintDot(scaled, scaled);
    if (!(square > 0.0 && square <= 12.0)) return glintFreePoint(position);
    const float length = sqrt(square);
    point.normal = scaled / length;
    precise float inverse_length = inverse_power / length;

    // What a distance in object space, and in the world, counts as height over the plane.
    precise vec3 object_weights = (abs(object_normal) + doubt) * inverse_length;
    const mat4x3 to_object_size = glintAbsolute(to_object);
    const vec3 weights = glintRow(object_weights, to_object_size);
    precise float doubts = glintSum(doubt) * inverse_length;
    const float rows = glintLargest(to_object_size[0] + to_object_size[1] + to_object_size[2]);
    const float reach = 2.0 * size;
    const mat4x3 to_world_size = glintAbsolute(to_world);
    precise vec3 world_reach = (to_world_size[0] + to_world_size[1] + to_world_size[2]) * reach;
    const vec3 corners = max(abs(a), max(abs(b), abs(c)));
    const vec3 edges = max(abs(ab), abs(ac));
    precise vec3 object_errors = edges * 3.0 + corners * 5.0 + vec3(15.0 * reach);
    precise vec3 world_errors = abs(position) * 9.0 + to_world_size[3] * 8.0 + world_reach * 10.0;
    precise float slenderness = longest * sqrt(longest) * inverse_length * glintPower(size);
    precise float rounding = glintDot(object_weights, object_errors) + glintDot(weights, world_errors) + 8.0 * slenderness;
    precise float offset = abs(glintDot(object_normal, residual)) * inverse_length + rounding * GLINT_ROUNDING + doubts * reach;
    point.offset = offset * 1.0078125;
    precise float slope = (16.0 * glintSum(weights) + 15.0 * glintSum(object_weights) * rows) * GLINT_ROUNDING + doubts * rows;
    point.slope = slope * 1.0078125;
    return point;
}

// A hit at origin + t * direction, for programs that do not have the corners: many times the offset of the above. The
// normal is the triangle's in the world, of length 1 and right to 2^-20; no side of a triangle is longer than
// `longest`, in object space, and none is narrower than an eighth of that.
GlintSurfacePoint glintSurfacePoint(vec3 origin, vec3 direction, float t, vec3 normal, float longest, mat4x3 to_world,
                                    mat4x3 to_object) {
    GlintSurfacePoint point;
    precise vec3 way = direction * t;
    precise vec3 position = origin + way;
    point.position = position;
    point.normal = normal;
    const mat4x3 to_world_size = glintAbsolute(to_world);
    const mat4x3 to_object_size = glintAbsolute(to_object);
    precise vec3 object_weights =
        abs(glintRow(normal, to_world)) + glintRow(abs(normal), to_world_size) * (4.0 * GLINT_ROUNDING);
    const vec3 weights = max(glintRow(object_weights, to_object_size), abs(normal));
    const float rows = glintLargest(to_object_size[0] + to_object_size[1] + to_object_size[2]);
    precise vec3 world_reach = (to_world_size[0] + to_world_size[1] + to_world_size[2]) * (2.0 * longest);
    precise vec3 world_errors = abs(origin) * 4.0 + abs(way) * 18.0 + abs(position) * 6.0 + to_world_size[3] * 10.0 +
                                world_reach * 26.0;
    const float distance = glintLargest(glintLinear(to_object_size, abs(way)));
    precise float object_errors = distance * 15.0 + longest * 141.0;
    precise float rounding = glintDot(weights, world_errors) + glintSum(object_weights) * object_errors;
    point.offset = rounding * (GLINT_ROUNDING * 1.0078125);
    precise float slope = 32.0 * glintSum(weights) + 15.0 * glintSum(object_weights) * rows;
    point.slope = slope * (GLINT_ROUNDING * 1.0078125);
    return point;
}

// Where a ray with this direction starts, with t_min = 0: on the side of the plane that it goes to.
vec3 glintSpawnPoint(GlintSurfacePoint point, vec3 direction) {
    const float offset = glintDot(point.normal, direction) < 0.0 ? -point.offset : point.offset;
    precise vec3 origin = point.position + point.normal * offset;
    return origin;
}

// A ray from one point to another that meets the triangle of neither: t from 0 to GLINT_SEGMENT_END.
void glintSegment(GlintSurfacePoint from, GlintSurfacePoint to, out vec3 origin, out vec3 direction) {
    precise vec3 between = to.position - from.position;
    const float distance = glintLargest(abs(between));
    precise float offset = to.offset + to.slope * distance;
    GlintSurfacePoint end = to;
    end.offset = offset;
    origin = glintSpawnPoint(from, between);
    precise vec3 way = glintSpawnPoint(end, -between) - origin;
    direction = way;
}
