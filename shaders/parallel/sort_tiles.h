// The sort of shares and of small regions by tiles: a group takes the elements of a tile in turns, ranks them by the
// votes of its subgroups, and puts them into the order of their digits in shared memory before it writes them.
#pragma once

// Of a thread.
const uint ITEMS = TILE / GLINT_GROUP;

#if GLINT_STAGE == 1

shared uint counters[DIGITS];

#elif GLINT_STAGE == 2

// A group a row.
void scanRows(uint rows) {
    for (uint row = gl_WorkGroupID.x; row < rows; row += gl_NumWorkGroups.x) {
        const Job job = findJob(row / DIGITS);
        const uint begin = job.row + row % DIGITS * job.shares, end = begin + job.shares;
        uint before = 0u;
        for (uint base = begin; base < end; base += 4u * GLINT_GROUP) {
            const uint first = base + 4u * local;
            uint counts[4], sum = 0u, total;
            [[unroll]] for (uint i = 0u; i < 4u; i++) {
                counts[i] = first + i < end ? table[first + i] : 0u;
                sum += counts[i];
            }
            sum = before + sumBefore(sum, total);
            [[unroll]] for (uint i = 0u; i < 4u; i++) {
                if (first + i < end) table[first + i] = sum;
                sum += counts[i];
            }
            before += total;
        }
        if (local == 0u) table[row] = before;
    }
}

#elif GLINT_STAGE != 0 && GLINT_STAGE != 5

// Counters of each subgroup, then the tile itself.
const uint COUNTERS = GLINT_GROUP / GLINT_SUBGROUP * DIGITS;
shared uint stage[COUNTERS > TILE ? COUNTERS : TILE];
shared uint offsets[DIGITS];  // from places in the tile to places in the target
// Digits of a thread, for those that have any.
const uint MANY = DIGITS > GLINT_GROUP ? DIGITS / GLINT_GROUP : 1u;

// The threads of the subgroup whose digit is the same, as a ballot.
#if GLINT_WIDE
#define GLINT_BALLOT uvec2
GLINT_BALLOT ballot(bool value) { return subgroupBallot(value).xy; }
GLINT_BALLOT threadsBefore() { return gl_SubgroupLtMask.xy; }
uint countOf(uvec2 threads) { return bitCount(threads.x) + bitCount(threads.y); }
uint firstOf(uvec2 threads) { return threads.x != 0u ? findLSB(threads.x) : 32u + findLSB(threads.y); }
#else
#define GLINT_BALLOT uint
GLINT_BALLOT ballot(bool value) { return subgroupBallot(value).x; }
GLINT_BALLOT threadsBefore() { return gl_SubgroupLtMask.x; }
uint countOf(uint threads) { return bitCount(threads); }
uint firstOf(uint threads) { return findLSB(threads); }
#endif

GLINT_BALLOT peersOf(uint digit) {
    GLINT_BALLOT peers = ballot(true);
    [[unroll]] for (uint bit = 0u; bit < 8u; bit++) {
        const bool is_set = (digit & (1u << bit)) != 0u;
        const GLINT_BALLOT same = ballot(is_set);
        peers &= is_set ? same : ~same;
    }
    return peers;
}

// Elements of a tile lie in it by subgroup, then by turn, then by thread.
uint elementOf(uint turn, uint turns) {
    return (gl_SubgroupID * turns + turn) * gl_SubgroupSize + gl_SubgroupInvocationID;
}

// Where the keys go among those of their digit and subgroup; counts them in `stage`. Keys beyond the tile's end have the
// largest digit.
void rankInSubgroups(uint key[ITEMS], uint turns, uint shift, uint mask, out uint place[ITEMS]) {
    for (uint i = local; i < gl_NumSubgroups * DIGITS; i += GLINT_GROUP) stage[i] = 0u;
    barrier();
    const uint column = gl_SubgroupID * DIGITS;
    const GLINT_BALLOT before = threadsBefore();
    [[unroll]] for (uint i = 0u; i < ITEMS; i++) {
        place[i] = 0u;
        if (i < turns) {
            const uint digit = digitOf(key[i], shift, mask);
            const GLINT_BALLOT peers = peersOf(digit);
            const uint rank = countOf(peers & before);
            // The first of them counts for all.
            uint count = 0u;
            if (rank == 0u) count = atomicAdd(stage[column + digit], countOf(peers));
            count = subgroupShuffle(count, firstOf(peers));
            place[i] = count + rank;
        }
    }
    barrier();
}

uint countOfDigit(uint digit) {
    uint count = 0u;
    for (uint i = 0u; i < gl_NumSubgroups; i++) count += stage[i * DIGITS + digit];
    return count;
}

// Turns a digit's counts into places in the tile, from `place` on, which ends behind them.
void placeDigit(uint digit, inout uint place) {
    for (uint i = 0u; i < gl_NumSubgroups; i++) {
        const uint count = stage[i * DIGITS + digit];
        stage[i * DIGITS + digit] = place;
        place += count;
    }
}

void addPlaces(uint key[ITEMS], uint turns, uint shift, uint mask, inout uint place[ITEMS]) {
    barrier();
    [[unroll]] for (uint i = 0u; i < ITEMS; i++)
        if (i < turns) place[i] += stage[gl_SubgroupID * DIGITS + digitOf(key[i], shift, mask)];
    barrier();
}

#if GLINT_STAGE != 6

shared uint places[DIGITS];  // where the next tile's keys of a digit go

// Where the keys go in the tile. Moves `places` on over the tile.
void rankTile(uint key[ITEMS], uint turns, uint shift, uint mask, out uint place[ITEMS]) {
    rankInSubgroups(key, turns, shift, mask, place);
    uint sum = 0u, total;
    const uint first = min(local * MANY, DIGITS), last = min(first + MANY, DIGITS);
    for (uint digit = first; digit < last; digit++) sum += countOfDigit(digit);
    uint start = sumBefore(sum, total);
    for (uint digit = first; digit < last; digit++) {
        const uint begin = start;
        placeDigit(digit, start);
        offsets[digit] = places[digit] - begin;
        places[digit] += start - begin;
    }
    addPlaces(key, turns, shift, mask, place);
}

#endif
#endif

#if GLINT_STAGE == 1 || GLINT_STAGE == 3

// Elements of a share: whole tiles, spread evenly.
uvec2 elementsOf(Job job, uint share) {
    const uint tiles = tilesOf(job.size);
    const uint many = tiles / job.shares, rest = tiles % job.shares;
    const uint first = share * many + min(share, rest), last = first + many + (share < rest ? 1u : 0u);
    return uvec2(first * TILE, min(last * TILE, job.size));
}

#endif

#if GLINT_STAGE == 1

// A tile, or the last one, which may have fewer elements.
void countTile(uint first, uint count, bool is_full, uint shift, uint mask) {
    uint keys[ITEMS];
    [[unroll]] for (uint i = 0u; i < ITEMS; i++)
        keys[i] = is_full || i * GLINT_GROUP + local < count ? source[first + i * GLINT_GROUP + local] : 0u;
    [[unroll]] for (uint i = 0u; i < ITEMS; i++)
        if (is_full || i * GLINT_GROUP + local < count) atomicAdd(counters[digitOf(keys[i], shift, mask)], 1u);
}

void countShare(Job job, uint share, uvec2 from, uint shift, uint mask) {
    for (uint digit = local; digit < DIGITS; digit += GLINT_GROUP) counters[digit] = 0u;
    barrier();
    const uvec2 elements = elementsOf(job, share);
    for (uint tile = elements.x; tile < elements.y; tile += TILE)
        if (elements.y - tile >= TILE)
            countTile(from.x + tile, TILE, true, shift, mask);
        else
            countTile(from.x + tile, elements.y - tile, false, shift, mask);
    barrier();
    for (uint digit = local; digit < DIGITS; digit += GLINT_GROUP)
        table[job.row + digit * job.shares + share] = counters[digit];
    barrier();
}

#elif GLINT_STAGE == 3 || GLINT_STAGE == 6

void readKeys(uint first, uint count, bool is_full, out uint key[ITEMS]) {
    [[unroll]] for (uint i = 0u; i < ITEMS; i++) {
        const uint element = elementOf(i, ITEMS);
        key[i] = is_full || element < count ? source[first + element] : ~0u;
    }
}

// To the places in the tile, and from there to where `offsets` say, at most `most`.
void writeTile(uint tile, uint count, bool is_full, uvec2 from, uvec2 to, uint most, uint shift, uint mask,
               uint key[ITEMS], uint place[ITEMS]) {
    [[unroll]] for (uint i = 0u; i < ITEMS; i++) stage[place[i]] = key[i];
#if GLINT_PAYLOAD
    uint payload[ITEMS];
    [[unroll]] for (uint i = 0u; i < ITEMS; i++) {
        const uint element = elementOf(i, ITEMS);
        payload[i] = GLINT_PAYLOAD == 2 && shift == 0u ? tile + element
                     : is_full || element < count      ? source[from.y + tile + element]
                                                       : 0u;
    }
#endif
    barrier();
    [[unroll]] for (uint i = 0u; i < ITEMS; i++) {
        const uint at = i * GLINT_GROUP + local;
        if (is_full || at < count) {
            const uint value = stage[at];
            const uint goal = min(offsets[digitOf(value, shift, mask)] + at, most);
            target[to.x + goal] = value;
            key[i] = goal;
        }
    }
    barrier();
#if GLINT_PAYLOAD
    [[unroll]] for (uint i = 0u; i < ITEMS; i++) stage[place[i]] = payload[i];
    barrier();
    [[unroll]] for (uint i = 0u; i < ITEMS; i++) {
        const uint at = i * GLINT_GROUP + local;
        if (is_full || at < count) target[to.y + key[i]] = stage[at];
    }
    barrier();
#endif
}

#endif

#if GLINT_STAGE == 3

// A tile, or the last one, which may have fewer elements.
void moveTile(uint tile, uint count, bool is_full, uvec2 from, uvec2 to, uint shift, uint mask) {
    uint key[ITEMS], place[ITEMS];
    readKeys(from.x + tile, count, is_full, key);
    rankTile(key, ITEMS, shift, mask, place);
    writeTile(tile, count, is_full, from, to, ~0u, shift, mask, key, place);
}

void moveShare(Job job, uint index, uint share, uvec2 from, uvec2 to, uint shift, uint mask) {
    // Where the share's keys of each digit begin.
    const uint first = min(local * MANY, DIGITS), last = min(first + MANY, DIGITS);
    uint sum = 0u, total;
    for (uint digit = first; digit < last; digit++) sum += table[index * DIGITS + digit];
    uint start = sumBefore(sum, total);
    for (uint digit = first; digit < last; digit++) {
        places[digit] = start + table[job.row + digit * job.shares + share];
        start += table[index * DIGITS + digit];
    }
    const uvec2 elements = elementsOf(job, share);
    for (uint tile = elements.x; tile < elements.y; tile += TILE)
        if (elements.y - tile >= TILE)
            moveTile(tile, TILE, true, from, to, shift, mask);
        else
            moveTile(tile, elements.y - tile, false, from, to, shift, mask);
}

#endif

#if GLINT_STAGE == 4

// In one tile, from registers to shared memory and back.
void sortSmall(uint keys, uint payload, uint size) {
    const uint turns = (size + GLINT_GROUP - 1u) / GLINT_GROUP;
    uint key[ITEMS], value[ITEMS], place[ITEMS];
    [[unroll]] for (uint i = 0u; i < ITEMS; i++) {
        const uint element = elementOf(i, turns);
        key[i] = element < size ? source[keys + element] : ~0u;
#if GLINT_PAYLOAD
        value[i] = GLINT_PAYLOAD == 2 ? element : element < size ? source[payload + element] : 0u;
#endif
    }
    for (uint shift = 0u; shift < work.bits; shift += 8u) {
        const bool is_last = shift + 8u >= work.bits;
        rankTile(key, turns, shift, (1u << min(work.bits - shift, 8u)) - 1u, place);
        [[unroll]] for (uint i = 0u; i < ITEMS; i++)
            if (i < turns) stage[place[i]] = key[i];
        barrier();
        if (is_last)
            for (uint i = local; i < size; i += GLINT_GROUP) source[keys + i] = stage[i];
        [[unroll]] for (uint i = 0u; i < ITEMS; i++)
            if (i < turns) key[i] = stage[elementOf(i, turns)];
        barrier();
#if GLINT_PAYLOAD
        [[unroll]] for (uint i = 0u; i < ITEMS; i++)
            if (i < turns) stage[place[i]] = value[i];
        barrier();
        if (is_last)
            for (uint i = local; i < size; i += GLINT_GROUP) source[payload + i] = stage[i];
        [[unroll]] for (uint i = 0u; i < ITEMS; i++)
            if (i < turns) value[i] = stage[elementOf(i, turns)];
        barrier();
#endif
    }
}

#endif
