// Projects the splats of a chunk: a thread for each. GLINT_HALF: the model's storage; GLINT_DEGREE: of the harmonics that
// are summed.
#pragma once

#include <glint/splats/common.h>
#include <glint/splats/harmonics.h>
#include <glint/splats/tiles.h>

layout(local_size_x = GLINT_GROUP) in;

layout(std140, set = 0, binding = 1) uniform Chunk {
    // From the model's space to that of the view, without the offset, row by row.
    vec4 rows[3];
    // The eye in the model's space is the sum of both: what is near the eye keeps its digits.
    vec4 eye_high, eye_low;
    vec2 focal;   // pixels
    vec2 limits;  // of x / z and y / z in the projection's derivative
    uint first;   // number of the chunk's first splat among all of the draw
    uint count;
    uint reserved_0, reserved_1;
} chunk;

layout(std430, binding = 2) readonly buffer Model { uint model[]; };
layout(std430, binding = 3) writeonly buffer Footprints { uvec4 footprints[]; };
// Bits of the view depth, and how many tiles there are.
layout(std430, binding = 4) writeonly buffer Infos { uvec2 infos[]; };

uint splat;

uint wordOf(uint value) { return model[value * chunk.count + splat]; }
float valueOf(uint value) { return uintBitsToFloat(wordOf(value)); }
vec3 vectorOf(uint value) { return vec3(valueOf(value), valueOf(value + 1u), valueOf(value + 2u)); }

#if GLINT_HALF
vec4 rotationOf() { return vec4(unpackSnorm2x16(wordOf(7u)), unpackSnorm2x16(wordOf(8u))); }
float harmonicValue(uint i) {
    const vec2 pair = unpackHalf2x16(wordOf(9u + i / 2u));
    return (i & 1u) == 0u ? pair.x : pair.y;
}
#else
vec4 rotationOf() { return vec4(valueOf(7u), valueOf(8u), valueOf(9u), valueOf(10u)); }
float harmonicValue(uint i) { return valueOf(11u + i); }
#endif
vec3 harmonicOf(uint k) {
    return vec3(harmonicValue(3u * k), harmonicValue(3u * k + 1u), harmonicValue(3u * k + 2u));
}

// R^T v for a quaternion of any length but 0.
vec3 turnBack(vec4 q, vec3 v) {
    const vec3 t = cross(v, q.xyz) * (2.0 / dot(q, q));
    return v + q.w * t - cross(q.xyz, t);
}

void main() {
    splat = groupIndex() * GLINT_GROUP + gl_LocalInvocationIndex;
    if (splat >= chunk.count) return;
    const uint place = chunk.first + splat;
    infos[place] = uvec2(0u);

    precise const vec3 offset = (vectorOf(0u) - chunk.eye_high.xyz) - chunk.eye_low.xyz;
    const vec3 view = vec3(dot(chunk.rows[0].xyz, offset), dot(chunk.rows[1].xyz, offset), dot(chunk.rows[2].xyz, offset));
    const float z = -view.z;
    if (!(z >= frame.near)) return;
    const float opacity = valueOf(6u);
    if (opacity <= 0.0) return;

    // The projection's derivative, in the model's space and then along the splat's axes.
    const vec2 slope = view.xy / z;
    const vec2 bent = clamp(slope, -chunk.limits, chunk.limits);
    const vec3 scale = vectorOf(3u);
    const vec4 rotation = rotationOf();
    vec3 u = turnBack(rotation, (chunk.focal.x / z) * (chunk.rows[0].xyz + bent.x * chunk.rows[2].xyz)) * scale;
    vec3 v = turnBack(rotation, (-chunk.focal.y / z) * (chunk.rows[1].xyz + bent.y * chunk.rows[2].xyz)) * scale;

    // Covariance [a b; b c] = M M^T + low pass, M of the rows u and v. Its determinant is a sum of squares (Cauchy and
    // Binet). In units of the larger of both, so that nothing overflows.
    const vec3 most = max(abs(u), abs(v));
    const float unit = max(max(most.x, most.y), max(most.z, 1.0));
    u /= unit;
    v /= unit;
    const float low_pass = frame.low_pass / (unit * unit);
    const vec3 area = cross(u, v);
    const float uu = dot(u, u), vv = dot(v, v);
    const float sharp = dot(area, area);
    const float determinant = sharp + low_pass * (uu + vv + low_pass);
    const float a = uu + low_pass;

    Footprint f;
    f.center = vec2(chunk.focal.x, -chunk.focal.y) * slope;
    f.shear = dot(u, v) / a;
    // 0.7213 is log2(e) / 2. Beyond 10^8 pixels a splat is as good as constant.
    f.scale_x = max(sqrt(0.72134752044448170 / a) / unit, 1e-8);
    f.scale_y = max(sqrt(0.72134752044448170 * a / determinant) / unit, 1e-8);
    f.log_opacity = log2(opacity);
    if (frame.antialiased != 0u) f.log_opacity += 0.5 * log2(sharp / determinant);
    // What is not finite fails every comparison.
    if (!(abs(f.center.x) + abs(f.center.y) < 1e9 && abs(f.shear) < 1e9 && f.scale_y < 1e9)) return;
    if (!(f.log_opacity >= frame.log_cut)) return;

    uint count = 0u;
    const uvec2 tile_rows = tileRows(f);
    for (uint row = tile_rows.x; row < tile_rows.y; row++) {
        const uvec2 span = tileSpan(f, row);
        count += span.y - min(span.x, span.y);
    }
    if (count == 0u) return;

    const vec3 direction = normalize(offset);
    vec3 color;
    GLINT_SUM_HARMONICS(color, direction, harmonicOf)
    f.color = packColor(max(color + 0.5, 0.0));

    footprints[2u * place] = uvec4(floatBitsToUint(vec4(f.center, f.shear, f.scale_x)));
    footprints[2u * place + 1u] = uvec4(floatBitsToUint(vec2(f.scale_y, f.log_opacity)), f.color);
    infos[place] = uvec2(floatBitsToUint(z), count);
}
