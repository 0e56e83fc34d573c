// Counts of rays that the device has written, made the arguments of a joined traversal's dispatch: how many groups, and
// its block GlintLaunch (pipeline.h). Counts beyond the limits start nothing.
#pragma once

layout(local_size_x = 1) in;

layout(binding = 0, std430) buffer Launch {
    uint counts[4];  // three of them
    uint groups[4];  // likewise
};
layout(binding = 1, std430) writeonly buffer Rays { uvec4 rays; };
layout(push_constant, std430) uniform Push {
    uvec3 limits;  // rays along each axis
    uint most;     // rays in all
    uvec3 group_size;
    uint generation;
};

void main() {
    const uvec3 asked = uvec3(counts[0], counts[1], counts[2]);
    // Of each two factors the product's upper half has to be 0.
    uint upper, plane, last, total;
    umulExtended(asked.x, asked.y, upper, plane);
    umulExtended(plane, asked.z, last, total);
    const bool fits = all(lessThanEqual(asked, limits)) && (upper | last) == 0u && total <= most;
    const uvec3 taken = fits ? asked : uvec3(0u);
    rays = uvec4(taken, generation);
    for (uint i = 0u; i < 3u; i++) groups[i] = taken[i] / group_size[i] + uint(taken[i] % group_size[i] != 0u);
}
