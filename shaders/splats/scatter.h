// From visible splats in the order of their depth to entries of tiles' lists. Blocks of GLINT_BLOCK splats, a group each.
// GLINT_STAGE 0: how many entries a block has. 1: the entries: a tile and a splat each. GLINT_WIDE: a thread a splat of the
// block, the form for GPUs.
#pragma once

#include <glint/splats/footprints.h>
#include <glint/splats/group.h>
#include <glint/splats/state.h>
#include <glint/splats/tiles.h>

layout(local_size_x = GLINT_GROUP) in;
const uint RUN = GLINT_BLOCK / GLINT_GROUP;

layout(std430, binding = 3) readonly buffer Infos { uvec2 infos[]; };
layout(std430, binding = 4) readonly buffer Order { uint order[]; };
layout(std430, binding = 5) buffer Sums { uint sums[]; };
#if GLINT_STAGE == 1
layout(std430, binding = 6) writeonly buffer Entries { uint entries[]; };

// The number of tiles stands for no tile: should two kernels ever round differently, lists have no gaps.
void writeEntry(uint place, uint tile, uint splat) {
    entries[place] = tile;
    entries[frame.capacity + place] = splat;
}
#endif


// Of the i-th splat, from its key, which is read in order; the largest number there means that it does not fit.
uint tilesOf(uint i) {
    const uint count = order[i] >> frame.key_bits;
    return count != ~0u >> frame.key_bits ? count : infos[order[frame.room + i]].y;
}

#if GLINT_STAGE == 0 || !GLINT_WIDE

void main() {
    const uint block = groupIndex();
    const uint count = state.splats.size;
    const uint begin = min(block * GLINT_BLOCK + threadIndex() * RUN, count);
    const uint end = min(begin + RUN, count);
    uint own = 0u;
    for (uint i = begin; i < end; i++) own += tilesOf(i);
    uint total;
    const uint before = sumBefore(own, total);
#if GLINT_STAGE == 0
    if (threadIndex() == 0u && block * GLINT_BLOCK < count) sums[block] = total;
#else
    if (begin == end) return;
    uint carry;
    uint place = uaddCarry(sums[block], before, carry);
    if (carry != 0u) return;
    for (uint i = begin; i < end && place < frame.capacity; i++) {
        const uint splat = order[frame.room + i];
        const Footprint f = readFootprint(splat);
        const uint stop = place + min(tilesOf(i), frame.capacity - place);
        const uvec2 rows = tileRows(f);
        for (uint row = rows.x; row < rows.y; row++) {
            const uvec2 span = tileSpan(f, row);
            for (uint column = span.x; column < span.y && place < stop; column++)
                writeEntry(place++, row * frame.tiles.x + column, splat);
        }
        while (place < stop) writeEntry(place++, frame.tiles.x * frame.tiles.y, splat);
    }
#endif
}

#else

// Splats differ much in their numbers of tiles. So the group goes over the rows of all of its splats together, a row a
// thread, and then over the tiles of these rows, a tile a thread.

shared Footprint own_footprints[GLINT_GROUP];
shared uint numbers[GLINT_GROUP];     // of the splats
shared uint first_rows[GLINT_GROUP];  // of the splats, in tiles
shared uint rows_before[GLINT_GROUP];
shared uint tiles_before[GLINT_GROUP];
shared uint first_tiles[GLINT_GROUP];  // of the rows
shared uint owners[GLINT_GROUP];       // of the rows

// The last that begins at or before the place.
#define GLINT_FIND(found, before, place)                                              \
    uint found = 0u;                                                                  \
    for (uint step_size = GLINT_GROUP / 2u; step_size > 0u; step_size /= 2u)          \
        if (before[found + step_size] <= place) found += step_size;

void main() {
    const uint block = groupIndex();
    const uint local = threadIndex();
    const uint i = block * GLINT_BLOCK + local;
    const uint none = frame.tiles.x * frame.tiles.y;
    const uint begin = block * GLINT_BLOCK < state.splats.size ? sums[block] : ~0u;
    if (begin >= frame.capacity) return;
    uvec2 rows = uvec2(0u);
    uint tiles = 0u;
    if (i < state.splats.size) {
        const uint splat = order[frame.room + i];
        const Footprint f = readFootprint(splat);
        rows = tileRows(f);
        tiles = tilesOf(i);
        own_footprints[local] = f;
        numbers[local] = splat;
        first_rows[local] = rows.x;
    }
    uint all_tiles, all_rows;
    sumBefore(tiles, all_tiles);
    rows_before[local] = sumBefore(rows.y - rows.x, all_rows);
    barrier();
    const uint end = begin + min(all_tiles, frame.capacity - begin);
    uint place = begin;
    for (uint first = 0u; first < all_rows && place < end; first += GLINT_GROUP) {
        const uint item = first + local;
        uint length = 0u;
        if (item < all_rows) {
            GLINT_FIND(owner, rows_before, item)
            const uint row = first_rows[owner] + item - rows_before[owner];
            const uvec2 span = tileSpan(own_footprints[owner], row);
            length = span.y - min(span.x, span.y);
            first_tiles[local] = row * frame.tiles.x + span.x;
            owners[local] = numbers[owner];
        }
        uint total;
        tiles_before[local] = sumBefore(length, total);
        barrier();
        for (uint tile = local; tile < total && place + tile < end; tile += GLINT_GROUP) {
            GLINT_FIND(row, tiles_before, tile)
            writeEntry(place + tile, first_tiles[row] + tile - tiles_before[row], owners[row]);
        }
        place += total;
        barrier();
    }
    for (uint left = place + local; left < end; left += GLINT_GROUP) writeEntry(left, none, 0u);
}

#endif
