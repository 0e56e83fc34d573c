// Sums over a group of GLINT_GROUP threads, a power of two.
#pragma once

shared uint group_sums[GLINT_GROUP];

// Of the values of the threads before this one, at most 2^32 - 1. All threads of the group call it.
uint sumBefore(uint value, out uint total) {
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
