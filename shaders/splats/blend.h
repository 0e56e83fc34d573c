// Blends the list of each tile, a group a tile; each thread blends GLINT_COLUMNS * GLINT_ROWS of its pixels.
// GLINT_DEPTH, GLINT_TRANSMITTANCE: further outputs.
#pragma once

#include <glint/splats/footprints.h>

layout(local_size_x = GLINT_GROUP) in;

layout(std430, binding = 2) readonly buffer Ranges { uvec2 ranges[]; };
layout(std430, binding = 3) readonly buffer Entries { uint entries[]; };
#if GLINT_DEPTH
layout(std430, binding = 4) readonly buffer Infos { uvec2 infos[]; };
layout(binding = 6) writeonly uniform image2D depth_picture;
#endif
layout(binding = 5) writeonly uniform image2D picture;
#if GLINT_TRANSMITTANCE
layout(binding = 7) writeonly uniform image2D transmittance_picture;
#endif

// Threads along x; each has GLINT_COLUMNS columns at this distance, and rows that follow one another.
const uint THREADS_X = GLINT_TILE_X / GLINT_COLUMNS;

void main() {
    const uint tile = groupIndex();
    if (tile >= frame.tiles.x * frame.tiles.y) return;
    const uvec2 thread = uvec2(gl_LocalInvocationIndex % THREADS_X, gl_LocalInvocationIndex / THREADS_X);
    const uvec2 corner = uvec2(tile % frame.tiles.x * GLINT_TILE_X + thread.x,
                               tile / frame.tiles.x * GLINT_TILE_Y + thread.y * GLINT_ROWS);
    const vec2 pixel = vec2(corner) + 0.5 - frame.half_size;

    vec3 colors[GLINT_COLUMNS][GLINT_ROWS];
    float transmittances[GLINT_COLUMNS][GLINT_ROWS];
    // Least logarithm of alpha that counts; none does in a pixel that has ended.
    float cuts[GLINT_COLUMNS][GLINT_ROWS];
#if GLINT_DEPTH
    float depths[GLINT_COLUMNS][GLINT_ROWS];
#endif
    uint open = 0u;
    [[unroll]] for (uint c = 0u; c < GLINT_COLUMNS; c++)
        [[unroll]] for (uint r = 0u; r < GLINT_ROWS; r++) {
            colors[c][r] = vec3(0.0);
            transmittances[c][r] = 1.0;
            const bool is_inside = corner.x + c * THREADS_X < frame.size.x && corner.y + r < frame.size.y;
            cuts[c][r] = is_inside ? frame.log_cut : 1e30;
            open += uint(is_inside);
#if GLINT_DEPTH
            depths[c][r] = 0.0;
#endif
        }

    const uvec2 range = ranges[tile];
    for (uint i = range.x; i < range.y && open != 0u; i++) {
        const uint splat = entries[frame.capacity + i];
        const Footprint f = readFootprint(splat);
        const vec3 color = unpackColor(f.color);
#if GLINT_DEPTH
        const float depth = uintBitsToFloat(infos[splat].x);
#endif
        [[unroll]] for (uint c = 0u; c < GLINT_COLUMNS; c++) {
            const vec2 offset = pixel + vec2(c * THREADS_X, 0.0) - f.center;
            const float across = f.scale_x * offset.x;
            const float most = f.log_opacity - across * across;
            float along = f.scale_y * (offset.y - f.shear * offset.x);
            [[unroll]] for (uint r = 0u; r < GLINT_ROWS; r++) {
                const float power = most - along * along;
                if (power >= cuts[c][r]) {
                    const float weight = transmittances[c][r] * min(exp2(power), 1.0);
                    colors[c][r] += weight * color;
#if GLINT_DEPTH
                    depths[c][r] += weight * depth;
#endif
                    transmittances[c][r] -= weight;
                    if (transmittances[c][r] <= frame.stop) {
                        cuts[c][r] = 1e30;
                        open--;
                    }
                }
                along += f.scale_y;
            }
        }
    }

    [[unroll]] for (uint c = 0u; c < GLINT_COLUMNS; c++)
        [[unroll]] for (uint r = 0u; r < GLINT_ROWS; r++) {
            const uvec2 place = corner + uvec2(c * THREADS_X, r);
            if (place.x >= frame.size.x || place.y >= frame.size.y) continue;
            const float coverage = 1.0 - transmittances[c][r];
            imageStore(picture, ivec2(place), vec4(colors[c][r], coverage));
#if GLINT_DEPTH
            const float depth = coverage > 0.0 ? depths[c][r] / coverage : uintBitsToFloat(0x7f800000u);
            imageStore(depth_picture, ivec2(place), vec4(depth));
#endif
#if GLINT_TRANSMITTANCE
            imageStore(transmittance_picture, ivec2(place), vec4(transmittances[c][r]));
#endif
        }
}
