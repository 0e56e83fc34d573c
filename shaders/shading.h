// How surfaces answer light, and how colours go on pictures: #include <glint/shading.h>. Directions have length 1;
// normals are on the side of the viewer.
#pragma once

// A value at a hit from the values at the triangle's corners; barycentrics are of the second and the third.
vec3 glintInterpolate(vec3 a, vec3 b, vec3 c, vec2 barycentrics) {
    return a * (1.0 - barycentrics.x - barycentrics.y) + b * barycentrics.x + c * barycentrics.y;
}

// The normal on the side from which a ray with this direction comes.
vec3 glintFaceRay(vec3 normal, vec3 direction) { return dot(normal, direction) > 0.0 ? -normal : normal; }

// Lambert's law: the share of the light of a surface across the light's way.
float glintDiffuse(vec3 normal, vec3 to_light) { return max(dot(normal, to_light), 0.0); }

// Phong's highlight, 1 where the mirrored ray meets the light; `direction` is that of the ray which sees the surface.
float glintPhong(vec3 normal, vec3 to_light, vec3 direction, float shininess) {
    return pow(max(dot(reflect(direction, normal), to_light), 0.0), shininess);
}

// The mirrored direction. Interpolated normals may send it below the surface: then it is mirrored at the triangle, whose
// own normal `geometric` is.
vec3 glintMirror(vec3 direction, vec3 normal, vec3 geometric) {
    const vec3 mirrored = reflect(direction, normal);
    return dot(mirrored, geometric) > 0.0 ? mirrored : reflect(direction, geometric);
}

// Linear values in [0, 1] as sRGB stores them (IEC 61966-2-1); others are clamped.
vec3 glintEncodeSrgb(vec3 linear) {
    const vec3 value = clamp(linear, 0.0, 1.0);
    return mix(1.055 * pow(value, vec3(1.0 / 2.4)) - 0.055, 12.92 * value, lessThanEqual(value, vec3(0.0031308)));
}

// The share of unpolarised light that the surface of a dielectric mirrors (Fresnel's equations). `cosine`: of the angle
// to the normal, in [0, 1]; `eta`: the index on the ray's side over the one beyond, as for refract(). 1 where nothing
// is refracted, and along the surface.
float glintFresnel(float cosine, float eta) {
    const float square = 1.0 - eta * eta * (1.0 - cosine * cosine);
    if (square <= 0.0 || cosine <= 0.0) return 1.0;
    const float beyond = sqrt(square);
    const float across = (eta * cosine - beyond) / (eta * cosine + beyond);
    const float along = (cosine - eta * beyond) / (cosine + eta * beyond);
    return 0.5 * (across * across + along * along);
}
