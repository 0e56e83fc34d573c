// Real spherical harmonics with the signs of the original splats.
#pragma once

// The sum of the first (GLINT_DEGREE + 1)^2 harmonics along a unit direction; `harmonic(k)` gives the k-th factor.
#define GLINT_SUM_HARMONICS(sum, d, harmonic)                                             \
    sum = 0.28209479177387814 * harmonic(0u);                                             \
    if (GLINT_DEGREE >= 1) {                                                              \
        sum += 0.4886025119029199 * (d.z * harmonic(2u) - d.y * harmonic(1u) - d.x * harmonic(3u)); \
    }                                                                                     \
    if (GLINT_DEGREE >= 2) {                                                              \
        const vec3 s = d * d;                                                             \
        sum += 1.0925484305920792 * (d.x * d.y * harmonic(4u) - d.y * d.z * harmonic(5u) - d.x * d.z * harmonic(7u)); \
        sum += 0.31539156525252005 * (2.0 * s.z - s.x - s.y) * harmonic(6u);              \
        sum += 0.5462742152960396 * (s.x - s.y) * harmonic(8u);                           \
    }                                                                                     \
    if (GLINT_DEGREE >= 3) {                                                              \
        const vec3 s = d * d;                                                             \
        sum -= 0.5900435899266435 * d.y * (3.0 * s.x - s.y) * harmonic(9u);               \
        sum += 2.890611442640554 * d.x * d.y * d.z * harmonic(10u);                       \
        sum -= 0.4570457994644658 * d.y * (4.0 * s.z - s.x - s.y) * harmonic(11u);        \
        sum += 0.3731763325901154 * d.z * (2.0 * s.z - 3.0 * s.x - 3.0 * s.y) * harmonic(12u); \
        sum -= 0.4570457994644658 * d.x * (4.0 * s.z - s.x - s.y) * harmonic(13u);        \
        sum += 1.445305721320277 * d.z * (s.x - s.y) * harmonic(14u);                     \
        sum -= 0.5900435899266435 * d.x * (s.x - 3.0 * s.y) * harmonic(15u);              \
    }
