// The rays of lenses, in the camera's own space, which looks along -Z with +Y up: #include <glint/lens.h>. Places on the
// picture count from its centre, x to the right and y up; directions have length 1.
#pragma once

#include <glint/constants.h>

// Straight lines stay straight. `place.y` is -1 at the bottom and 1 at the top, `place.x` as much in its own unit;
// `angle` is that from bottom to top, below pi.
vec3 glintPinholeLens(vec2 place, float angle) { return normalize(vec3(place * tan(0.5 * angle), -1.0)); }

// Angles from the axis grow with the distance from the centre (equidistant): at distance 1 it is half of `angle`, which
// may be 2 pi. There is nothing outside of that circle: a zero vector.
vec3 glintFisheyeLens(vec2 place, float angle) {
    const float radius = length(place), off_axis = 0.5 * angle * radius;
    if (radius > 1.0) return vec3(0.0);
    return vec3(place * (radius > 0.0 ? sin(off_axis) / radius : 0.0), -cos(off_axis));
}

// All directions, as latitude and longitude: the picture from (-1, -1) to (1, 1).
vec3 glintSphericalLens(vec2 place) {
    const float longitude = place.x * GLINT_PI, latitude = place.y * GLINT_HALF_PI;
    return vec3(cos(latitude) * sin(longitude), sin(latitude), -cos(latitude) * cos(longitude));
}
