// Sums over a group of GLINT_GROUP threads, a power of two.
#pragma once

shared uint group_sums[GLINT_GROUP];

// Threads are counted by subgroups, whatever their order in the group.
uint threadIndex() { return gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID; }

// Of the values of the threads before this one, as threadIndex() counts them. All threads of the group call it.
uint sumBefore(uint value, out uint total) {
    const uint before = subgroupExclusiveAdd(value);
    const uint sum = subgroupAdd(value);
    if (gl_SubgroupInvocationID == 0u) group_sums[gl_SubgroupID] = sum;
    barrier();
    uint others = 0u;
    total = 0u;
    for (uint i = 0u; i < gl_NumSubgroups; i++) {
        others += i < gl_SubgroupID ? group_sums[i] : 0u;
        total += group_sums[i];
    }
    barrier();
    return before + others;
}

// The same with sums that end at 2^32 - 1, for threads as gl_LocalInvocationIndex counts them.
uint boundedSumBefore(uint value, out uint total) {
    const uint local = gl_LocalInvocationIndex;
    uint sum = value;
    group_sums[local] = sum;
    barrier();
    for (uint distance = 1u; distance < GLINT_GROUP; distance *= 2u) {
        uint carry = 0u;
        if (local >= distance) sum = uaddCarry(sum, group_sums[local - distance], carry);
        if (carry != 0u) sum = ~0u;
        barrier();
        group_sums[local] = sum;
        barrier();
    }
    total = group_sums[GLINT_GROUP - 1u];
    const uint before = local == 0u ? 0u : group_sums[local - 1u];
    barrier();
    return before;
}
