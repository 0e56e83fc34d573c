// The sort of one region in one kernel a digit, which reads each element once ("onesweep": Adinets and Merrill 2022).
// Stage 5 counts all digits of all passes. In stage 6 a group has a tile, says how many keys of each digit it has, and
// adds up what the tiles before it have said (decoupled look-back, Merrill and Garland 2016): where its keys go.
//
// No group waits for another one: who finds a tile that has not said anything counts that tile's keys itself.
//
// A branch that only some threads of a subgroup take may leave them apart from the others, across barriers too: on an
// H100 two branches for thread 0, before a loop and at its head, did. Here whole subgroups take the branches before what
// subgroups do together, other than those of sort_tiles.h, and they do nothing together from the look-back on.
//
// The table: counts of the digits of each pass; two halves of a row for each tile, of a word for each digit. Passes take
// the halves in turns, and clear the other one.
#pragma once

const uint PASSES = 4u;
const uint ROWS = PASSES * DIGITS;
// A word: nothing, the count of a tile's keys, or where the keys of the tile after it go.
const uint KNOWN = 1u << 30, ENDS = 2u << 30, VALUE = KNOWN - 1u;

uint rowOf(uint half_of_rows, uint tile) {
    return ROWS + (half_of_rows * tilesOf(work.capacity) + tile) * DIGITS;
}

#if GLINT_STAGE == 5

shared uint counters[PASSES * DIGITS];

// `work.shift` is the width of the digits, `work.bits` what all have together.
void countTile(uint first, uint count, bool is_full) {
    uint keys[ITEMS];
    [[unroll]] for (uint i = 0u; i < ITEMS; i++)
        keys[i] = is_full || i * GLINT_GROUP + local < count ? source[first + i * GLINT_GROUP + local] : 0u;
    [[unroll]] for (uint pass = 0u; pass < PASSES; pass++) {
        const uint shift = pass * work.shift;
        if (shift >= work.bits) break;
        const uint mask = (1u << min(work.shift, work.bits - shift)) - 1u;
        [[unroll]] for (uint i = 0u; i < ITEMS; i++)
            if (is_full || i * GLINT_GROUP + local < count)
                atomicAdd(counters[pass * DIGITS + digitOf(keys[i], shift, mask)], 1u);
    }
}

void main() {
    const uint size = sizeOf(), tiles = tilesOf(size), keys = regions[work.first];
    for (uint i = local; i < PASSES * DIGITS; i += GLINT_GROUP) counters[i] = 0u;
    barrier();
    for (uint tile = gl_WorkGroupID.x; tile < tiles; tile += gl_NumWorkGroups.x) {
        for (uint digit = local; digit < DIGITS; digit += GLINT_GROUP) table[rowOf(0u, tile) + digit] = 0u;
        if (size - tile * TILE >= TILE)
            countTile(keys + tile * TILE, TILE, true);
        else
            countTile(keys + tile * TILE, size - tile * TILE, false);
    }
    barrier();
    for (uint i = local; i < PASSES * DIGITS; i += GLINT_GROUP)
        if (counters[i] != 0u) atomicAdd(table[i], counters[i]);
}

#else

// Of the tile, then of one that has not said anything.
shared uint counters[2u * DIGITS];
shared uint silent;  // one more than the number of the last of the tiles that have not said anything

uint totalOf(uint digit) { return table[work.pass * DIGITS + digit]; }

// Says how many keys a tile has, or where they end if it is the first one. `begin`: where those of the thread's first
// digit begin in all.
void publish(uint tile, uint counter, uint begin) {
    const uint row = rowOf(work.pass & 1u, tile);
    const uint first = min(local * MANY, DIGITS), last = min(first + MANY, DIGITS);
    for (uint digit = first; digit < last; digit++) {
        const uint count = counters[counter + digit];
        atomicMax(table[row + digit], tile == 0u ? ENDS | (begin + count) : KNOWN | count);
        if (tile == 0u) begin += totalOf(digit);
    }
}

// Whether a tile says anything: tests have most of them say nothing.
bool isHeard(uint tile) { return GLINT_SILENT == 0 || tile % 3u == 2u; }

void countSilent(uint tile, uint keys, uint shift, uint mask) {
    for (uint i = local; i < DIGITS; i += GLINT_GROUP) counters[DIGITS + i] = 0u;
    barrier();
    for (uint i = local; i < TILE; i += GLINT_GROUP)
        atomicAdd(counters[DIGITS + digitOf(source[keys + tile * TILE + i], shift, mask)], 1u);
    barrier();
    uint begin = 0u;
    if (tile == 0u)
        for (uint digit = 0u; digit < min(local * MANY, DIGITS); digit++) begin += totalOf(digit);
    publish(tile, DIGITS, begin);
}

// Adds to `offsets` where the keys of each digit go.
void lookBack(uint tile, uint keys, uint shift, uint mask) {
    const uint half_of_rows = work.pass & 1u;
    for (uint base = 0u; base < DIGITS; base += GLINT_GROUP) {
        const uint digit = base + local;
        uint place = 0u, next = tile;
        bool is_done = digit >= DIGITS || tile == 0u;
        for (;;) {
            for (uint poll = 0u; !is_done && poll < GLINT_POLLS;) {
                const uint word = atomicLoad(table[rowOf(half_of_rows, next - 1u) + digit], gl_ScopeDevice,
                                             gl_StorageSemanticsBuffer, gl_SemanticsRelaxed);
                if (word == 0u) {
                    poll++;
                    continue;
                }
                place += word & VALUE;
                is_done = word >= ENDS;
                next--;
            }
            if (!is_done) atomicMax(silent, next);
            barrier();
            const uint other = silent;
            barrier();
            if (other == 0u) break;
            if (gl_SubgroupID == 0u) atomicAnd(silent, 0u);
            countSilent(other - 1u, keys, shift, mask);
        }
        if (digit < DIGITS && tile != 0u) {
            if (isHeard(tile)) atomicMax(table[rowOf(half_of_rows, tile) + digit], ENDS | (place + counters[digit]));
            offsets[digit] += place;
        }
    }
}

void sweepTile(uint tile, uint count, bool is_full, uvec2 from, uvec2 to, uint most, uint shift, uint mask) {
    uint key[ITEMS], place[ITEMS];
    readKeys(from.x + tile * TILE, count, is_full, key);
    const uint first = min(local * MANY, DIGITS), last = min(first + MANY, DIGITS);
    for (uint digit = first; digit < last; digit++) counters[digit] = 0u;
    barrier();
    [[unroll]] for (uint i = 0u; i < ITEMS; i++) atomicAdd(counters[digitOf(key[i], shift, mask)], 1u);
    barrier();
    uint sum = 0u, begin = 0u, total;
    if (tile == 0u) {
        for (uint digit = first; digit < last; digit++) sum += totalOf(digit);
        begin = sumBefore(sum, total);
    }
    // Before they are ranked, so that those who look back find them.
    if (isHeard(tile)) publish(tile, 0u, begin);
    rankInSubgroups(key, ITEMS, shift, mask, place);
    sum = 0u;
    for (uint digit = first; digit < last; digit++) sum += counters[digit];
    uint start = sumBefore(sum, total);
    for (uint digit = first; digit < last; digit++) {
        offsets[digit] = begin - start;
        if (tile == 0u) begin += totalOf(digit);
        placeDigit(digit, start);
    }
    addPlaces(key, ITEMS, shift, mask, place);
    lookBack(tile, from.x, shift, mask);
    writeTile(tile * TILE, count, is_full, from, to, most, shift, mask, key, place);
}

void main() {
    const uint size = sizeOf(), tile = gl_WorkGroupID.x;
    if (tile >= tilesOf(size)) return;
    const uint half_of_rows = work.pass & 1u;
    const uvec2 in_data = uvec2(regions[work.first], regions[work.first + 1u]), in_scratch = uvec2(0u, work.capacity);
    const uvec2 from = half_of_rows != 0u ? in_scratch : in_data, to = half_of_rows != 0u ? in_data : in_scratch;
    const uint mask = (1u << work.bits) - 1u;
    if (gl_SubgroupID == 0u) atomicAnd(silent, 0u);
    for (uint digit = local; digit < DIGITS; digit += GLINT_GROUP) table[rowOf(1u - half_of_rows, tile) + digit] = 0u;
    // No place beyond the region, even if its payloads lie over its keys and change them after they were counted.
    if (size - tile * TILE >= TILE)
        sweepTile(tile, TILE, true, from, to, size - 1u, work.shift, mask);
    else
        sweepTile(tile, size - tile * TILE, false, from, to, size - 1u, work.shift, mask);
}

#endif
