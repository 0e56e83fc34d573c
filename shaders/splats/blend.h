// Blends the list of each tile, a group a tile; each thread blends GLINT_COLUMNS * GLINT_ROWS of its pixels.
// GLINT_SHARED: the group reads the list together, a splat a thread, through shared memory, and finds which of them reach
// the part of the tile that each 32 threads have. GLINT_DEPTH, GLINT_TRANSMITTANCE: further outputs.
#pragma once

#include <glint/splats/footprints.h>
#include <glint/splats/tiles.h>

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

#if GLINT_SHARED
// Parts of 8 pixels in width, 32 threads each: strips of 8 x 4, of which each thread has a pixel.
const uint PARTS = GLINT_GROUP / 32u, PARTS_X = GLINT_TILE_X / 8u;
const uint STRIPS_Y = GLINT_TILE_Y / 4u;
const uint STEP = 4u;  // rows from one pixel of a thread to the next
const uint WORDS = GLINT_GROUP / 32u;
const uint THREADS_X = 8u;
#else
// Threads along x; each has GLINT_COLUMNS columns at this distance.
const uint THREADS_X = GLINT_TILE_X / GLINT_COLUMNS;
const uint STEP = 1u;
#endif
// Beyond every logarithm of alpha.
const float NEVER = 1e30;

#if GLINT_SHARED
// Batches alternate between two places, so that one barrier each suffices: who writes to a place has passed the barrier
// that all have reached after reading it. What is cleared between takes turns of three.
shared vec2 centers[2][GLINT_GROUP];
shared vec4 conics[2][GLINT_GROUP];
shared vec4 paints[2][GLINT_GROUP];
shared uint open_strips[3][PARTS];
// Which splats of a batch reach each strip: a bit each.
shared uint reaching[3][PARTS * GLINT_ROWS * WORDS];
#endif

Footprint read(uint entry, out float depth) {
    const uint splat = entries[frame.capacity + entry];
#if GLINT_DEPTH
    depth = uintBitsToFloat(infos[splat].x);
#else
    depth = 0.0;
#endif
    return readFootprint(splat);
}

// One function: what each pixel has must stay in registers.
void main() {
    const uint tile = groupIndex();
    if (tile >= frame.tiles.x * frame.tiles.y) return;
    const uint local = gl_LocalInvocationIndex;
    const uvec2 origin = uvec2(tile % frame.tiles.x * GLINT_TILE_X, tile / frame.tiles.x * GLINT_TILE_Y);
    uvec2 corner = origin + uvec2(local % THREADS_X, local / THREADS_X * GLINT_ROWS);
#if GLINT_SHARED
    const uint part = local / 32u;
    corner = origin + uvec2(part % PARTS_X * 8u + local % 8u, part / PARTS_X * (4u * GLINT_ROWS) + local % 32u / 8u);
#endif
    const vec2 pixel = vec2(corner) + 0.5 - frame.half_size;

    vec3 colors[GLINT_COLUMNS][GLINT_ROWS];
    float transmittances[GLINT_COLUMNS][GLINT_ROWS];
#if !GLINT_SHARED
    // Least logarithm of alpha that counts; none does in a pixel that has ended.
    float cuts[GLINT_COLUMNS][GLINT_ROWS];
    uint open = 0u;  // pixels that have not ended
#endif
#if GLINT_DEPTH
    float depths[GLINT_COLUMNS][GLINT_ROWS];
#endif
    [[unroll]] for (uint c = 0u; c < GLINT_COLUMNS; c++)
        [[unroll]] for (uint r = 0u; r < GLINT_ROWS; r++) {
            colors[c][r] = vec3(0.0);
            const bool is_inside = corner.x + c * THREADS_X < frame.size.x && corner.y + r * STEP < frame.size.y;
#if GLINT_SHARED
            // What is outside has ended.
            transmittances[c][r] = is_inside ? 1.0 : -1.0;
#else
            transmittances[c][r] = 1.0;
            cuts[c][r] = is_inside ? frame.log_cut : NEVER;
            open += uint(is_inside);
#endif
#if GLINT_DEPTH
            depths[c][r] = 0.0;
#endif
        }

    const uvec2 range = ranges[tile];
    vec2 center;
    vec4 conic, paint;  // shear, scale_x, scale_y, log_opacity; color, depth
#if GLINT_SHARED
    Footprint next;
    float next_depth;
    for (uint i = local; i < 3u * PARTS; i += GLINT_GROUP) open_strips[i % 3u][i / 3u] = 0u;
    for (uint i = local; i < 3u * PARTS * GLINT_ROWS * WORDS; i += GLINT_GROUP) reaching[i % 3u][i / 3u] = 0u;
    if (range.x + local < range.y) next = read(range.x + local, next_depth);
    barrier();
    uint batch = 0u;
    for (uint begin = range.x; begin < range.y; begin += GLINT_GROUP) {
        const uint place = batch & 1u, third = batch % 3u;
        if (begin + local < range.y) {
            centers[place][local] = next.center;
            conics[place][local] = vec4(next.shear, next.scale_x, next.scale_y, next.log_opacity);
            paints[place][local] = vec4(unpackColor(next.color), next_depth);
            const float left = float(origin.x) + 0.5 - frame.half_size.x;
            const float height = heightOf(next);
            // Strips between the ellipse's highest and lowest points.
            const float above = next.center.y + frame.half_size.y - 0.5 - float(origin.y);
            const uint first = uint(max(ceil((above - height - 3.0) * 0.25), 0.0));
            const uint last = uint(clamp(floor((above + height) * 0.25) + 1.0, 0.0, float(STRIPS_Y)));
            for (uint strip = first; strip < last; strip++) {
                const float top = float(4u * strip) - above;
                const vec2 span = next.center.x + widthBetween(next, top, top + 3.0);
                [[unroll]] for (uint x = 0u; x < PARTS_X; x++)
                    if (span.x <= left + float(8u * x + 7u) && span.y >= left + float(8u * x)) {
                        const uint at = (strip / GLINT_ROWS * PARTS_X + x) * GLINT_ROWS + strip % GLINT_ROWS;
                        atomicOr(reaching[third][at * WORDS + local / 32u], 1u << (local % 32u));
                    }
            }
        }
        uint open = 0u;
        [[unroll]] for (uint r = 0u; r < GLINT_ROWS; r++) open |= transmittances[0][r] > frame.stop ? 1u << r : 0u;
        if (open != 0u) atomicOr(open_strips[third][part], open);
        barrier();
        uint any_open = 0u;
        [[unroll]] for (uint i = 0u; i < PARTS; i++) any_open |= open_strips[third][i];
        if (any_open == 0u) break;
        batch++;
        const uint after_next = (third + 2u) % 3u;
        if (local < PARTS) open_strips[after_next][local] = 0u;
        for (uint i = local; i < PARTS * GLINT_ROWS * WORDS; i += GLINT_GROUP) reaching[after_next][i] = 0u;
        // While this batch is blended the next one is on its way.
        if (begin + GLINT_GROUP + local < range.y) next = read(begin + GLINT_GROUP + local, next_depth);
        const uint strips = open_strips[third][part];
        for (uint word = 0u; word < WORDS; word++) {
            uint masks[GLINT_ROWS], left = 0u;
            [[unroll]] for (uint r = 0u; r < GLINT_ROWS; r++) {
                const uint reached = reaching[third][(part * GLINT_ROWS + r) * WORDS + word];
                masks[r] = (strips & (1u << r)) != 0u ? reached : 0u;
                left |= masks[r];
            }
            while (left != 0u) {
                const uint bit = left & (0u - left);
                const uint i = word * 32u + uint(findLSB(left));
                left ^= bit;
                center = centers[place][i];
                conic = conics[place][i];
                paint = paints[place][i];
#else
    {
        for (uint i = range.x; i < range.y && open != 0u; i++) {
            {
                const Footprint f = read(i, paint.a);
                center = f.center;
                conic = vec4(f.shear, f.scale_x, f.scale_y, f.log_opacity);
                paint.rgb = unpackColor(f.color);
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
#if GLINT_SHARED
                        // A branch for 32 threads together; within it all of them work, which is cheaper than to part.
                        if ((masks[r] & bit) == 0u) continue;
                        const float down = along + float(r * STEP) * conic.z;
                        const float power = most - down * down;
                        const bool is_seen = power >= frame.log_cut && transmittances[c][r] > frame.stop;
                        const float weight = is_seen ? transmittances[c][r] * exp2(power) : 0.0;
                        colors[c][r] += weight * paint.rgb;
#if GLINT_DEPTH
                        depths[c][r] += weight * paint.a;
#endif
                        transmittances[c][r] -= weight;
#else
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
#endif
                    }
                }
            }
        }
    }

    [[unroll]] for (uint c = 0u; c < GLINT_COLUMNS; c++)
        [[unroll]] for (uint r = 0u; r < GLINT_ROWS; r++) {
            const uvec2 place = corner + uvec2(c * THREADS_X, r * STEP);
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
