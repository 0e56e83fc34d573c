// Rays and hits as kernels that trace many of them read and write them: Ray and RayHit of core/graphics/ray_caster.h.
#pragma once

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
};

const uint GLINT_NO_HIT = 0xffffffffu;
const uint GLINT_INFINITY = 0x7f800000u;

bool glintIsFinite(vec3 v) {
    const uvec3 exponents = floatBitsToUint(v) & GLINT_INFINITY;
    return max(max(exponents.x, exponents.y), exponents.z) != GLINT_INFINITY;
}

bool glintIsNumber(float x) { return (floatBitsToUint(x) & 0x7fffffffu) <= GLINT_INFINITY; }

// Scales a ray's direction by a power of two, so that its largest component lies in [1, 2), and t by the inverse: that is
// exact, and keeps products within range whatever the direction's length. Returns what t is to be multiplied by then; 0
// if the ray means nothing. Floats are judged by their bits: compilers of shaders may assume that there is no NaN.
float glintScale(inout GlintRay ray) {
    const uvec3 exponents = (floatBitsToUint(ray.direction) & GLINT_INFINITY) >> 23;
    const uint exponent = min(max(max(exponents.x, exponents.y), exponents.z), 253u);
    bool valid = glintIsFinite(ray.origin) && glintIsFinite(ray.direction) && glintIsNumber(ray.t_min) &&
                 glintIsNumber(ray.t_max) && exponent != 0u;
    const float scale = uintBitsToFloat((254u - exponent) << 23);
    const float inverse = uintBitsToFloat(exponent << 23);
    ray.direction *= scale;
    ray.t_min = valid ? max(ray.t_min, 0.0) * inverse : 0.0;
    ray.t_max = valid ? ray.t_max * inverse : 0.0;
    valid = valid && ray.t_min <= ray.t_max && floatBitsToUint(ray.t_min) != GLINT_INFINITY;
    return valid ? scale : 0.0;
}
