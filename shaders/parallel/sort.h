// Stable sorts of regions {keys, payload, size, -} by digits, the lowest first, from the data to scratch memory and
// back. GLINT_STAGE 0: how often each digit occurs in each group's share of a region. 1: where each share's keys of each
// digit go, which is the running sum of that. 2: moves them. 3: copies what has ended in scratch memory. 4: all of it
// for whole regions, a group each.
// GLINT_PAYLOAD 0: keys alone. 1: words that go with them. 2: words that become the keys' places.
#pragma once

#include <glint/parallel/common.h>

const uint DIGITS = 1u << GLINT_DIGIT;

// Keys, then payloads.
layout(std430, binding = 4) coherent buffer Scratch { uint scratch[]; };
#if GLINT_STAGE < 3
layout(std430, binding = 5) buffer Sums { uint sums[]; };
#endif

// A column for each thread, so that no two share a counter.
shared uint counters[DIGITS * GLINT_GROUP];
shared uint places[DIGITS];   // where the next tile's keys of a digit go
shared uint offsets[DIGITS];  // from counters to places in this tile
shared uint taken;

uint keys, payload, size, room;
uint shift, mask;
bool is_flipped, is_first;

uint readKey(uint i) { return is_flipped ? scratch[room + i] : data[keys + i]; }
uint digitOf(uint key) { return (key >> shift) & mask; }

uint readPayload(uint i) {
#if GLINT_PAYLOAD == 2
    if (is_first) return i;
#endif
    return is_flipped ? scratch[work.capacity + room + i] : data[payload + i];
}

void write(uint i, uint key, uint value) {
    // Regions that overlap change while they are sorted.
    if (i >= size) return;
    if (is_flipped) {
        data[keys + i] = key;
#if GLINT_PAYLOAD
        data[payload + i] = value;
#endif
    } else {
        scratch[room + i] = key;
#if GLINT_PAYLOAD
        scratch[work.capacity + room + i] = value;
#endif
    }
}

void move(uint i, uint target) {
#if GLINT_PAYLOAD
    write(target, readKey(i), readPayload(i));
#else
    write(target, readKey(i), 0u);
#endif
}

void clearCounters() {
    for (uint i = 0u; i < DIGITS; i++) counters[i * GLINT_GROUP + gl_LocalInvocationIndex] = 0u;
}

// The digits of elements in any order.
void countDigits(uint begin, uint end) {
    clearCounters();
    for (uint i = begin + gl_LocalInvocationIndex; i < end; i += GLINT_GROUP)
        counters[digitOf(readKey(i)) * GLINT_GROUP + gl_LocalInvocationIndex]++;
    barrier();
}

// Makes running sums of the counters, by digit and then by thread. The sum of all.
uint sumCounters() {
    const uint begin = gl_LocalInvocationIndex * DIGITS;
    uint sum = 0u;
    for (uint i = begin; i < begin + DIGITS; i++) sum += counters[i];
    uint total;
    sum = sumBefore(sum, total);
    for (uint i = begin; i < begin + DIGITS; i++) {
        const uint count = counters[i];
        counters[i] = sum;
        sum += count;
    }
    barrier();
    return total;
}

// Moves the elements to `places`.
void scatter(uint begin, uint end) {
    const uint local = gl_LocalInvocationIndex;
    for (uint tile = begin; tile < end; tile += GLINT_TILE) {
        const uint first = min(tile + local * GLINT_RUN, end);
        const uint last = min(first + GLINT_RUN, end);
        clearCounters();
        for (uint i = first; i < last; i++) counters[digitOf(readKey(i)) * GLINT_GROUP + local]++;
        barrier();
        const uint total = sumCounters();
        for (uint digit = local; digit < DIGITS; digit += GLINT_GROUP) {
            const uint start = counters[digit * GLINT_GROUP];
            const uint stop = digit + 1u < DIGITS ? counters[(digit + 1u) * GLINT_GROUP] : total;
            offsets[digit] = places[digit] - start;
            places[digit] += stop - start;
        }
        barrier();
        for (uint i = first; i < last; i++) {
            const uint digit = digitOf(readKey(i));
            const uint counter = digit * GLINT_GROUP + local;
            const uint place = counters[counter];
            counters[counter] = place + 1u;
            move(i, offsets[digit] + place);
        }
        barrier();
    }
}

void copyBack(uint begin, uint end) {
    for (uint i = begin + gl_LocalInvocationIndex; i < end; i += GLINT_GROUP) move(i, i);
}

// Whether the region can be sorted; `is_reporter` says it if not.
bool setRegion(uint i, bool is_reporter) {
    keys = regions[work.first + 4u * i];
    payload = regions[work.first + 4u * i + 1u];
    size = regions[work.first + 4u * i + 2u];
    room = 0u;
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

void setPass(uint pass_shift, uint bits, bool flipped) {
    shift = pass_shift;
    mask = (1u << bits) - 1u;
    is_flipped = flipped;
    is_first = pass_shift == 0u;
}

#if GLINT_STAGE == 4

// Takes scratch memory for the region. Where it lies makes no difference to the result.
bool takeRoom() {
    if (gl_LocalInvocationIndex == 0u) {
        uint seen = report[3], before;
        taken = ~0u;
        while (size <= work.capacity - seen) {
            before = seen;
            seen = atomicCompSwap(report[3], before, before + size);
            if (seen == before) {
                taken = before;
                break;
            }
        }
        if (taken == ~0u) atomicAdd(report[1], 1u);
    }
    barrier();
    room = taken;
    barrier();
    return room != ~0u;
}

void sortRegion() {
    bool flipped = false;
    for (uint begin = 0u; begin < work.bits; begin += GLINT_DIGIT) {
        setPass(begin, min(uint(GLINT_DIGIT), work.bits - begin), flipped);
        countDigits(0u, size);
        sumCounters();
        for (uint digit = gl_LocalInvocationIndex; digit < DIGITS; digit += GLINT_GROUP)
            places[digit] = counters[digit * GLINT_GROUP];
        barrier();
        scatter(0u, size);
        memoryBarrierBuffer();
        barrier();
        flipped = !flipped;
    }
    if (!flipped) return;
    is_flipped = true;
    is_first = false;
    copyBack(0u, size);
}

void main() {
    if (gl_WorkGroupID.x >= work.groups) return;
    const uint count = regionCount();
    for (uint i = gl_WorkGroupID.x; i < count; i += work.groups)
        if (setRegion(i, gl_LocalInvocationIndex == 0u) && takeRoom()) sortRegion();
}

#else

void main() {
    const uint group = gl_WorkGroupID.x;
    if (group >= work.groups || regionCount() == 0u) return;
    if (!setRegion(0u, GLINT_STAGE == 0 && work.shift == 0u && gl_GlobalInvocationID.x == 0u)) return;
    setPass(work.shift, work.bits, work.flipped != 0u);
    const uint local = gl_LocalInvocationIndex;
    const uint share = shareOf(size);
    const uint begin = min(group * share, size), end = min((group + 1u) * share, size);
#if GLINT_STAGE == 0
    countDigits(begin, end);
    for (uint digit = local; digit < DIGITS; digit += GLINT_GROUP) {
        uint sum = 0u;
        for (uint i = 0u; i < GLINT_GROUP; i++) sum += counters[digit * GLINT_GROUP + i];
        sums[digit * work.groups + group] = sum;
    }
#elif GLINT_STAGE == 1
    const uint all = DIGITS * work.groups;
    const uint run = (all + GLINT_GROUP - 1u) / GLINT_GROUP;
    const uint first = min(local * run, all), last = min(first + run, all);
    uint sum = 0u;
    for (uint i = first; i < last; i++) sum += sums[i];
    uint total;
    sum = sumBefore(sum, total);
    for (uint i = first; i < last; i++) {
        const uint value = sums[i];
        sums[i] = sum;
        sum += value;
    }
#elif GLINT_STAGE == 2
    for (uint digit = local; digit < DIGITS; digit += GLINT_GROUP) places[digit] = sums[digit * work.groups + group];
    barrier();
    scatter(begin, end);
#else
    is_first = false;
    copyBack(begin, end);
#endif
}

#endif
