// Pictures of all directions, latitude-longitude: #include <glint/environment.h>. The picture's centre is +X, its top
// row +Z, and what is to the right on it is to the right for who looks at it from within: its quarters are +Y, +X, -Y.
#pragma once

#include <glint/constants.h>

// Where a direction of any length is on the picture, from (0, 0) at its top left to (1, 1). The edge of the picture is
// -X. Off by 2^-12 where arcs of tangents have the worst error that Vulkan allows them.
vec2 glintLatitudeLongitude(vec3 direction) {
    const bool is_pole = direction.xy == vec2(0.0);  // where GLSL leaves the arc open
    return vec2(0.5 - (is_pole ? 0.0 : atan(direction.y, direction.x)) * (0.5 * GLINT_INVERSE_PI),
                0.5 - atan(direction.z, length(direction.xy)) * GLINT_INVERSE_PI);
}

// The direction, of length 1, of a place on the picture.
vec3 glintLatitudeLongitudeDirection(vec2 place) {
    const float longitude = (0.5 - place.x) * GLINT_TWO_PI, latitude = (0.5 - place.y) * GLINT_PI;
    return vec3(cos(latitude) * cos(longitude), cos(latitude) * sin(longitude), sin(latitude));
}
