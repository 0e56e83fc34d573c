// What scans and sorts share: the regions that a dispatch works on, and sums over a group. No group waits for another
// one, and subgroups may have any size.
//
// GLINT_TILES 1, for GPUs: the threads of a group take the elements of a tile in turns, so that accesses are to
// neighbours. 0, for CPUs, where every access of a thread is one by itself: each thread walks a run of its own.
#pragma once

layout(local_size_x = GLINT_GROUP) in;

layout(push_constant) uniform Work {
    uint first;       // word at which the regions begin, four words each
    uint count;       // of regions, at most
    uint count_word;  // where the device keeps how many there are; ~0: `count`
    uint words;       // of the data
    uint groups;  // that share a region, at most
    uint capacity;  // elements of a sort's scratch memory
    uint shift;     // bits below the digit
    uint bits;      // of the digit, or all of them where a kernel takes all digits
    uint pass;      // of a sort; odd ones move from scratch memory back to the data
} work;

layout(std430, binding = 0) readonly buffer Regions { uint regions[]; };
layout(std430, binding = 1) readonly buffer Counts { uint counts[]; };
// How many regions lay outside of the data, had no room in scratch memory, how many counts exceeded the regions; what
// is taken of scratch memory.
layout(std430, binding = 2) coherent buffer Report { uint report[4]; };

// Threads are counted by subgroups, whatever their order in the group.
uint local = gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID;

// GLINT_SUBGROUP is the size of the smallest subgroups.
shared uint subgroup_sums[GLINT_GROUP / GLINT_SUBGROUP];

uint regionCount(bool is_reporter) {
    if (work.count_word == ~0u) return work.count;
    const uint count = counts[work.count_word];
    if (count > work.count && is_reporter) atomicAdd(report[2], 1u);
    return min(count, work.count);
}

bool isInside(uint offset, uint size) { return offset <= work.words && size <= work.words - offset; }

// The sum of the values of the subgroups before this one. All threads of the group call it.
uint sumBeforeSubgroup(uint subgroup_sum, out uint total) {
    if (gl_SubgroupInvocationID == 0u) subgroup_sums[gl_SubgroupID] = subgroup_sum;
    barrier();
    uint before = 0u;
    total = 0u;
    for (uint i = 0u; i < gl_NumSubgroups; i++) {
        const uint sum = subgroup_sums[i];
        before += i < gl_SubgroupID ? sum : 0u;
        total += sum;
    }
    barrier();
    return before;
}

// The sum of the values of the threads before this one. All threads of the group call it.
uint sumBefore(uint value, out uint total) {
    const uint before = subgroupExclusiveAdd(value);
    return before + sumBeforeSubgroup(subgroupAdd(value), total);
}
