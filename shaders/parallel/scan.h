// Exclusive sums of regions {offset, size, -, -}, in place. GLINT_STAGE 0: the sums of each group's share of a region,
// one a group, or one a thread where threads walk runs. 1: the share's elements, from the sums of those before it.
// 2: whole regions, a group each.
#pragma once

#include <glint/parallel/common.h>

layout(std430, binding = 3) buffer Data { uint data[]; };
#if GLINT_TILES
layout(std430, binding = 3) buffer Fours { uvec4 fours[]; };
#endif
#if GLINT_STAGE != 2
layout(std430, binding = 4) buffer Sums { uint sums[]; };
#endif

#if GLINT_TILES

// Fours of a thread in a tile; elements.
const uint ITEMS = 4u;
const uint TILE = 4u * GLINT_GROUP * ITEMS;

// What of a four lies within the elements `range.x` to `range.y - 1`; 0 for the rest.
uvec4 readFour(uint four, bool is_inside, uvec2 range) {
    if (is_inside) return fours[four];
    uvec4 values = uvec4(0u);
    [[unroll]] for (uint i = 0u; i < 4u; i++) {
        const uint element = 4u * four + i;
        if (element >= range.x && element < range.y) values[i] = data[element];
    }
    return values;
}

void writeFour(uint four, bool is_inside, uvec2 range, uvec4 values) {
    if (is_inside) {
        fours[four] = values;
        return;
    }
    [[unroll]] for (uint i = 0u; i < 4u; i++) {
        const uint element = 4u * four + i;
        if (element >= range.x && element < range.y) data[element] = values[i];
    }
}

// Tiles begin at multiples of four.
uint tilesOf(uvec2 range) { return (range.y - range.x / 4u * 4u + TILE - 1u) / TILE; }
bool isWithin(uint tile, uvec2 range) { return tile >= range.x && tile + TILE <= range.y; }

uint sumTile(uint tile, bool is_inside, uvec2 range) {
    uvec4 sum = uvec4(0u);
    [[unroll]] for (uint i = 0u; i < ITEMS; i++)
        sum += readFour(tile / 4u + i * GLINT_GROUP + local, is_inside, range);
    return sum.x + sum.y + sum.z + sum.w;
}

// `sum` is that of what comes before the tile if `is_forward`, else of all to its end, and goes to its other end.
void scanTile(uint tile, bool is_inside, uvec2 range, bool is_forward, inout uint sum) {
    const uint first = tile / 4u + gl_SubgroupID * gl_SubgroupSize * ITEMS + gl_SubgroupInvocationID;
    uvec4 values[ITEMS];
    uint before[ITEMS];
    [[unroll]] for (uint i = 0u; i < ITEMS; i++)
        values[i] = readFour(first + i * gl_SubgroupSize, is_inside, range);
    uint subgroup_sum = 0u;
    [[unroll]] for (uint i = 0u; i < ITEMS; i++) {
        const uint four_sum = values[i].x + values[i].y + values[i].z + values[i].w;
        const uint inclusive = subgroupInclusiveAdd(four_sum);
        before[i] = subgroup_sum + inclusive - four_sum;
        subgroup_sum += subgroupShuffle(inclusive, gl_SubgroupSize - 1u);
    }
    uint total;
    const uint start = sumBeforeSubgroup(subgroup_sum, total) + (is_forward ? sum : sum - total);
    [[unroll]] for (uint i = 0u; i < ITEMS; i++) {
        uvec4 sums;
        sums.x = start + before[i];
        sums.y = sums.x + values[i].x;
        sums.z = sums.y + values[i].y;
        sums.w = sums.z + values[i].z;
        writeFour(first + i * gl_SubgroupSize, is_inside, range, sums);
    }
    sum += is_forward ? total : 0u - total;
}

// The branches are for whole groups.
void scanTile(uint tile, uvec2 range, bool is_forward, inout uint sum) {
    if (isWithin(tile, range))
        scanTile(tile, true, range, is_forward, sum);
    else
        scanTile(tile, false, range, is_forward, sum);
}

void scanRegion(uint offset, uint size) {
    const uvec2 range = uvec2(offset, offset + size);
    uint sum = 0u;
    for (uint tile = offset / 4u * 4u; tile < range.y; tile += TILE) scanTile(tile, range, true, sum);
}

#else

// Of a run; all before it have a sum of `sum`.
void scanRun(uint begin, uint end, uint sum) {
    uint i = begin;
    for (; i + 4u <= end; i += 4u)
        [[unroll]] for (uint k = 0u; k < 4u; k++) {
            const uint value = data[i + k];
            data[i + k] = sum;
            sum += value;
        }
    for (; i < end; i++) {
        const uint value = data[i];
        data[i] = sum;
        sum += value;
    }
}

uint sumRun(uint begin, uint end) {
    uint sum = 0u, i = begin;
    for (; i + 4u <= end; i += 4u) sum += data[i] + data[i + 1u] + data[i + 2u] + data[i + 3u];
    for (; i < end; i++) sum += data[i];
    return sum;
}

void scanRegion(uint offset, uint size) {
    const uint run = (size + GLINT_GROUP - 1u) / GLINT_GROUP;
    const uint begin = offset + min(local * run, size), end = min(begin + run, offset + size);
    uint total;
    scanRun(begin, end, sumBefore(sumRun(begin, end), total));
}

#endif

void main() {
    const uint group = gl_WorkGroupID.x;
    const uint count = regionCount(GLINT_STAGE != 1 && gl_GlobalInvocationID.x == 0u);
#if GLINT_STAGE == 2
    for (uint i = group; i < count; i += gl_NumWorkGroups.x) {
        const uint offset = regions[work.first + 4u * i], size = regions[work.first + 4u * i + 1u];
        if (!isInside(offset, size)) {
            if (local == 0u) atomicAdd(report[0], 1u);
            continue;
        }
        scanRegion(offset, size);
    }
#else
    if (count == 0u) return;
    const uint offset = regions[work.first], size = regions[work.first + 1u];
    if (!isInside(offset, size)) {
        if (GLINT_STAGE == 0 && gl_GlobalInvocationID.x == 0u) atomicAdd(report[0], 1u);
        return;
    }
#if GLINT_TILES
    // Whole tiles, spread evenly.
    const uvec2 range = uvec2(offset, offset + size);
    const uint tiles = tilesOf(range), shares = min(tiles, work.groups);
    if (size == 0u || group >= shares) return;
    const uint many = tiles / shares, rest = tiles % shares;
    const uint first = group * many + min(group, rest), last = first + many + (group < rest ? 1u : 0u);
#if GLINT_STAGE == 0
    uint sum = 0u, total;
    for (uint i = first; i < last; i++) {
        const uint tile = offset / 4u * 4u + i * TILE;
        if (isWithin(tile, range))
            sum += sumTile(tile, true, range);
        else
            sum += sumTile(tile, false, range);
    }
    sumBefore(sum, total);
    if (local == 0u) sums[group] = total;
#else
    uint sum = 0u, after;
    for (uint i = local; i <= group; i += GLINT_GROUP) sum += sums[i];
    sumBefore(sum, after);
    // Backwards: the end of each share is what caches have seen last.
    for (uint i = last; i > first; i--) scanTile(offset / 4u * 4u + (i - 1u) * TILE, range, false, after);
#endif
#else
    // Runs of an odd number of cache lines, so that those of neighbours are in different sets.
    const uint threads = work.groups * GLINT_GROUP;
    const uint run = (((size + threads - 1u) / threads + 15u) / 16u | 1u) * 16u;
    const uint thread = group * GLINT_GROUP + local;
    const uint begin = offset + min(thread * run, size), end = offset + min(thread * run + run, size);
#if GLINT_STAGE == 0
    sums[thread] = sumRun(begin, end);
#else
    uint sum = 0u, before, total;
    for (uint i = local; i < group * GLINT_GROUP; i += GLINT_GROUP) sum += sums[i];
    sumBefore(sum, before);
    scanRun(begin, end, before + sumBefore(sums[thread], total));
#endif
#endif
#endif
}
