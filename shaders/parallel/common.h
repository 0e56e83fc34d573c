// What scans and sorts share: the regions that a dispatch works on, and sums over a group. Groups work on ranges that
// nobody else waits for, so nothing here depends on which of them run at the same time, or on the size of subgroups.
#pragma once

// Threads of a group, a power of two, and consecutive elements of a thread in a tile.
layout(local_size_x = GLINT_GROUP) in;
const uint GLINT_TILE = GLINT_GROUP * GLINT_RUN;

layout(push_constant) uniform Work {
    uint first;       // word at which the regions begin, four words each
    uint count;       // of regions, at most
    uint count_word;  // where the device keeps how many there are; ~0: `count`
    uint groups;
    uint capacity;  // elements of a sort's scratch memory
    uint shift;     // bits below the digit
    uint bits;      // of the digit, or all of them where a kernel takes all digits
    uint flipped;   // 1: from scratch memory back to the data
} work;

layout(std430, binding = 0) coherent buffer Data { uint data[]; };
layout(std430, binding = 1) readonly buffer Regions { uint regions[]; };
layout(std430, binding = 2) readonly buffer Counts { uint counts[]; };
// How many regions lay outside of the data, had no room in scratch memory, how many counts exceeded the regions; what
// is taken of scratch memory.
layout(std430, binding = 3) coherent buffer Report { uint report[4]; };

shared uint group_sums[GLINT_GROUP];

uint regionCount() {
    if (work.count_word == ~0u) return work.count;
    const uint count = counts[work.count_word];
    if (count > work.count && gl_GlobalInvocationID.x == 0u) atomicAdd(report[2], 1u);
    return min(count, work.count);
}

bool isInside(uint offset, uint size) {
    const uint words = uint(data.length());
    return offset <= words && size <= words - offset;
}

// Elements of each group that shares a region.
uint shareOf(uint size) { return max((size + work.groups - 1u) / work.groups, GLINT_TILE); }

// The sum of the values of the threads before this one. All threads of the group call it.
uint sumBefore(uint value, out uint total) {
    const uint local = gl_LocalInvocationIndex;
    uint sum = value;
    group_sums[local] = sum;
    barrier();
    for (uint distance = 1u; distance < GLINT_GROUP; distance *= 2u) {
        if (local >= distance) sum += group_sums[local - distance];
        barrier();
        group_sums[local] = sum;
        barrier();
    }
    total = group_sums[GLINT_GROUP - 1u];
    barrier();
    return sum - value;
}
