// Blends the list of each tile, a group a tile; each thread blends GLINT_COLUMNS * GLINT_ROWS of its pixels.
// GLINT_SHARED: the group reads the list together, a splat a thread, through shared memory. GLINT_DEPTH,
// GLINT_TRANSMITTANCE: further outputs.
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
// Beyond every logarithm of alpha.
const float NEVER = 1e30;

#if GLINT_SHARED
// Batches alternate between two places, so that one barrier each suffices: who writes to a place has passed the barrier
// that all have reached after reading it.
shared vec2 centers[2][GLINT_GROUP];
shared vec4 conics[2][GLINT_GROUP];
shared vec4 paints[2][GLINT_GROUP];
shared uint is_open[3];
#endif

// `conic`: shear, scale_x, scale_y, log_opacity. `paint`: color and depth.
void read(uint entry, out vec2 center, out vec4 conic, out vec4 paint) {
    const uint splat = entries[frame.capacity + entry];
    const Footprint f = readFootprint(splat);
    center = f.center;
    conic = vec4(f.shear, f.scale_x, f.scale_y, f.log_opacity);
    paint = vec4(unpackColor(f.color), 0.0);
#if GLINT_DEPTH
    paint.a = uintBitsToFloat(infos[splat].x);
#endif
}

// One function: what each pixel has must stay in registers.
void main() {
    const uint tile = groupIndex();
    if (tile >= frame.tiles.x * frame.tiles.y) return;
    const uint local = gl_LocalInvocationIndex;
    const uvec2 thread = uvec2(local % THREADS_X, local / THREADS_X);
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
    uint open = 0u;  // pixels that have not ended
    [[unroll]] for (uint c = 0u; c < GLINT_COLUMNS; c++)
        [[unroll]] for (uint r = 0u; r < GLINT_ROWS; r++) {
            colors[c][r] = vec3(0.0);
            transmittances[c][r] = 1.0;
            const bool is_inside = corner.x + c * THREADS_X < frame.size.x && corner.y + r < frame.size.y;
            cuts[c][r] = is_inside ? frame.log_cut : NEVER;
            open += uint(is_inside);
#if GLINT_DEPTH
            depths[c][r] = 0.0;
#endif
        }

    const uvec2 range = ranges[tile];
    vec2 center = vec2(0.0);
    vec4 conic = vec4(0.0), paint = vec4(0.0);
#if GLINT_SHARED
    if (local < 3u) is_open[local] = 0u;
    if (range.x + local < range.y) read(range.x + local, center, conic, paint);
    barrier();
    uint batch = 0u;
    for (uint begin = range.x; begin < range.y; begin += GLINT_GROUP) {
        const uint place = batch & 1u;
        centers[place][local] = center;
        conics[place][local] = conic;
        paints[place][local] = paint;
        if (open != 0u) is_open[batch % 3u] = 1u;
        barrier();
        if (is_open[batch % 3u] == 0u) break;
        if (local == 0u) is_open[(batch + 2u) % 3u] = 0u;
        batch++;
        const uint count = min(range.y - begin, GLINT_GROUP);
        // While this batch is blended the next one is on its way.
        vec2 next_center = vec2(0.0);
        vec4 next_conic = vec4(0.0), next_paint = vec4(0.0);
        if (begin + GLINT_GROUP + local < range.y) read(begin + GLINT_GROUP + local, next_center, next_conic, next_paint);
        for (uint i = 0u; i < count; i++) {
            center = centers[place][i];
            conic = conics[place][i];
            paint = paints[place][i];
#else
    {
        for (uint i = range.x; i < range.y && open != 0u; i++) {
            read(i, center, conic, paint);
#endif
            [[unroll]] for (uint c = 0u; c < GLINT_COLUMNS; c++) {
                const vec2 offset = pixel + vec2(c * THREADS_X, 0.0) - center;
                const float across = conic.y * offset.x;
                const float most = conic.w - across * across;
                float along = conic.z * (offset.y - conic.x * offset.x);
#if !GLINT_SHARED
                // Lanes that are idle together skip the column.
                const float last = along + float(GLINT_ROWS - 1) * conic.z;
                const float nearest = along > 0.0 ? along : min(last, 0.0);
                if (most - nearest * nearest >= frame.log_cut)
#endif
                [[unroll]] for (uint r = 0u; r < GLINT_ROWS; r++) {
                    const float power = most - along * along;
                    if (power >= cuts[c][r]) {
                        const float weight = transmittances[c][r] * exp2(power);
                        colors[c][r] += weight * paint.rgb;
#if GLINT_DEPTH
                        depths[c][r] += weight * paint.a;
#endif
                        transmittances[c][r] -= weight;
                        if (transmittances[c][r] <= frame.stop) {
                            cuts[c][r] = NEVER;
                            open--;
                        }
                    }
                    along += conic.z;
                }
            }
        }
#if GLINT_SHARED
        center = next_center;
        conic = next_conic;
        paint = next_paint;
#endif
    }

    [[unroll]] for (uint c = 0u; c < GLINT_COLUMNS; c++)
        [[unroll]] for (uint r = 0u; r < GLINT_ROWS; r++) {
            const uvec2 place = corner + uvec2(c * THREADS_X, r);
            if (place.x >= frame.size.x || place.y >= frame.size.y) continue;
            const float coverage = 1.0 - max(transmittances[c][r], 0.0);
            imageStore(picture, ivec2(place), vec4(colors[c][r], coverage));
#if GLINT_DEPTH
            const float depth = coverage > 0.0 ? depths[c][r] / coverage : uintBitsToFloat(0x7f800000u);
            imageStore(depth_picture, ivec2(place), vec4(depth));
#endif
#if GLINT_TRANSMITTANCE
            imageStore(transmittance_picture, ivec2(place), vec4(1.0 - coverage));
#endif
        }
}
