// Stable sorts of regions {keys, payload, size, -} by digits of up to 8 bits, the lowest first, from the data to scratch
// memory and back. A pass over large regions takes three kernels: GLINT_STAGE 1 counts the digits of each share of a
// region, 2 makes running sums of each digit's counts, 3 moves each share's elements to where those say. Stage 4 sorts
// small regions, a group each, and stage 0 makes a list of the others: the jobs. One region can be sorted otherwise
// (sort_sweep.h): stage 5 counts all digits at once, and stage 6 is a pass.
//
// GLINT_MANY 0: one region, shared by the groups, is the only job. 1: jobs from the list, a tile a share.
// GLINT_PAYLOAD 0: keys alone. 1: words that go with them. 2: words that become the keys' places.
#pragma once

#include <glint/parallel/common.h>

const uint DIGITS = 256u;
// Elements of a group at a time; columns of a share in the table of counts; the largest of the small regions.
const uint TILE = GLINT_TILE;
const uint COLUMNS = GLINT_TILES == 1 ? 1u : GLINT_GROUP;
const uint SMALL = GLINT_SMALL;

#if GLINT_STAGE == 4
layout(std430, binding = 3) coherent buffer Source { uint source[]; };
layout(std430, binding = 4) coherent buffer Target { uint target[]; };
#else
layout(std430, binding = 3) readonly buffer Source { uint source[]; };
layout(std430, binding = 4) writeonly buffer Target { uint target[]; };
#endif
// For each job the sums of all digits, then rows of a column for each share, one for each digit.
#if GLINT_STAGE != 0 && GLINT_STAGE != 4
#if GLINT_STAGE == 6
layout(std430, binding = 5) coherent buffer Table { uint table[]; };
#else
layout(std430, binding = 5) buffer Table { uint table[]; };
#endif
#endif
// How many, how many shares; eight words a job: keys, payload, size, place in scratch memory, first share, shares; then
// the job of each share.
#if GLINT_MANY
layout(std430, binding = 6) coherent buffer Jobs { uint jobs[]; };
#endif

// The most jobs there can be.
uint jobRoom() { return GLINT_MANY == 1 ? work.capacity / SMALL + 1u : 1u; }
uint tilesOf(uint size) { return size / TILE + (size % TILE == 0u ? 0u : 1u); }

struct Job {
    uint keys, payload, size, room;
    uint shares;
    uint row;  // where its rows begin in the table
};

// Reports what is wrong with a region if it is to.
bool isSortable(uint keys, uint payload, uint size, bool is_reporter) {
    if (!isInside(keys, size) || (GLINT_PAYLOAD != 0 && !isInside(payload, size))) {
        if (is_reporter) atomicAdd(report[0], 1u);
        return false;
    }
    if (size > work.capacity) {
        if (is_reporter) atomicAdd(report[1], 1u);
        return false;
    }
    return true;
}

#if GLINT_MANY

uint jobCount() { return jobs[0]; }
uint shareCount() { return jobs[1]; }
uint jobOfShare(uint share) { return jobs[2u + 8u * jobRoom() + share]; }

Job findJob(uint i) {
    const uint word = 2u + 8u * i;
    const uint first_share = jobs[word + 4u];
    return Job(jobs[word], jobs[word + 1u], jobs[word + 2u], jobs[word + 3u], jobs[word + 5u],
               DIGITS * (jobRoom() + first_share * COLUMNS));
}

uint shareOfJob(uint share, uint job) { return share - jobs[2u + 8u * job + 4u]; }

#else

// Elements of the region, 0 if it is not sorted.
uint sizeOf() {
    const bool is_counting = GLINT_STAGE == 1 || GLINT_STAGE == 5;
    const bool is_reporter = is_counting && work.pass == 0u && gl_GlobalInvocationID.x == 0u;
    if (regionCount(is_reporter) == 0u) return 0u;
    const uint keys = regions[work.first], payload = regions[work.first + 1u], size = regions[work.first + 2u];
    return isSortable(keys, payload, size, is_reporter) ? size : 0u;
}
uint shareCount() { return min(tilesOf(sizeOf()), work.groups); }
uint jobCount() { return shareCount() == 0u ? 0u : 1u; }
uint jobOfShare(uint share) { return 0u; }

Job findJob(uint i) {
    const uint size = regions[work.first + 2u];
    return Job(regions[work.first], regions[work.first + 1u], size, 0u, min(tilesOf(size), work.groups), DIGITS);
}

uint shareOfJob(uint share, uint job) { return share; }

#endif

uint digitOf(uint key, uint shift, uint mask) { return (key >> shift) & mask; }

#if GLINT_TILES
#include <glint/parallel/sort_tiles.h>
#if GLINT_STAGE >= 5
#include <glint/parallel/sort_sweep.h>
#endif
#else
#include <glint/parallel/sort_runs.h>
#endif

#if GLINT_STAGE == 0

// Takes scratch memory for a region, ~0 if none is left. Where it lies makes no difference to the result.
uint takeRoom(uint size) {
    uint seen = report[3];
    while (size <= work.capacity - seen) {
        const uint before = seen;
        seen = atomicCompSwap(report[3], before, before + size);
        if (seen == before) return before;
    }
    atomicAdd(report[1], 1u);
    return ~0u;
}

void main() {
    const uint count = regionCount(gl_GlobalInvocationID.x == 0u);
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * GLINT_GROUP) {
        const uint keys = regions[work.first + 4u * i], payload = regions[work.first + 4u * i + 1u];
        const uint size = regions[work.first + 4u * i + 2u];
        if (!isSortable(keys, payload, size, true) || size <= SMALL) continue;
        const uint room = takeRoom(size);
        if (room == ~0u) continue;
        const uint shares = tilesOf(size);
        const uint job = atomicAdd(jobs[0], 1u);
        const uint first_share = atomicAdd(jobs[1], shares);
        const uint word = 2u + 8u * job;
        jobs[word] = keys;
        jobs[word + 1u] = payload;
        jobs[word + 2u] = size;
        jobs[word + 3u] = room;
        jobs[word + 4u] = first_share;
        jobs[word + 5u] = shares;
        for (uint share = 0u; share < shares; share++) jobs[2u + 8u * jobRoom() + first_share + share] = job;
    }
}

#elif GLINT_STAGE == 2

void main() { scanRows(DIGITS * jobCount()); }

#elif GLINT_STAGE == 4

void main() {
    const uint count = regionCount(false);
    for (uint i = gl_WorkGroupID.x; i < count; i += gl_NumWorkGroups.x) {
        const uint keys = regions[work.first + 4u * i], payload = regions[work.first + 4u * i + 1u];
        const uint size = regions[work.first + 4u * i + 2u];
        if (size != 0u && size <= SMALL && isSortable(keys, payload, size, false)) sortSmall(keys, payload, size);
    }
}

#elif GLINT_STAGE == 1 || GLINT_STAGE == 3

void main() {
    const uint all = shareCount();
    for (uint share = gl_WorkGroupID.x; share < all; share += gl_NumWorkGroups.x) {
        const uint index = jobOfShare(share);
        const Job job = findJob(index);
        const uint own = shareOfJob(share, index);
        // Offsets into source and target.
        const bool is_flipped = (work.pass & 1u) != 0u;
        const uvec2 in_data = uvec2(job.keys, job.payload), in_scratch = uvec2(job.room, work.capacity + job.room);
        const uvec2 from = is_flipped ? in_scratch : in_data, to = is_flipped ? in_data : in_scratch;
        const uint mask = (1u << work.bits) - 1u;
#if GLINT_STAGE == 1
        countShare(job, own, from, work.shift, mask);
#else
        moveShare(job, index, own, from, to, work.shift, mask);
#endif
    }
}

#endif
