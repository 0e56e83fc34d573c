// The sort of shares and of small regions where each thread walks a run of its own.
#pragma once

// A column for each thread, so that no two share a counter.
shared uint counters[DIGITS * GLINT_GROUP];

// A thread's run of a share.
uvec2 runOf(Job job, uint share) {
    // An odd number of cache lines, so that the runs of neighbours are in different sets.
    const uint threads = job.shares * GLINT_GROUP;
    const uint run = (((job.size + threads - 1u) / threads + 15u) / 16u | 1u) * 16u;
    const uint begin = min((share * GLINT_GROUP + local) * run, job.size);
    return uvec2(begin, min(begin + run, job.size));
}

#if GLINT_STAGE == 1

void countShare(Job job, uint share, uvec2 from, uint shift, uint mask) {
    for (uint digit = 0u; digit < DIGITS; digit++) counters[digit * GLINT_GROUP + local] = 0u;
    const uvec2 run = runOf(job, share);
    uint i = run.x;
    for (; i + 4u <= run.y; i += 4u)
        [[unroll]] for (uint k = 0u; k < 4u; k++)
            counters[digitOf(source[from.x + i + k], shift, mask) * GLINT_GROUP + local]++;
    for (; i < run.y; i++) counters[digitOf(source[from.x + i], shift, mask) * GLINT_GROUP + local]++;
    const uint columns = job.shares * GLINT_GROUP;
    for (uint digit = 0u; digit < DIGITS; digit++)
        table[job.row + digit * columns + share * GLINT_GROUP + local] = counters[digit * GLINT_GROUP + local];
}

#elif GLINT_STAGE == 2

// A thread a row.
void scanRows(uint rows) {
    for (uint row = gl_GlobalInvocationID.x; row < rows; row += gl_NumWorkGroups.x * GLINT_GROUP) {
        const Job job = findJob(row / DIGITS);
        const uint columns = job.shares * COLUMNS;
        const uint begin = job.row + row % DIGITS * columns;
        uint sum = 0u;
        for (uint i = begin; i < begin + columns; i++) {
            const uint count = table[i];
            table[i] = sum;
            sum += count;
        }
        table[row] = sum;
    }
}

#elif GLINT_STAGE == 3

shared uint starts[DIGITS];

void moveElement(uint i, uvec2 from, uvec2 to, uint shift, uint mask) {
    const uint key = source[from.x + i];
    const uint counter = digitOf(key, shift, mask) * GLINT_GROUP + local;
    const uint place = counters[counter];
    counters[counter] = place + 1u;
    target[to.x + place] = key;
#if GLINT_PAYLOAD == 2
    target[to.y + place] = work.shift == 0u ? i : source[from.y + i];
#elif GLINT_PAYLOAD
    target[to.y + place] = source[from.y + i];
#endif
}

void moveShare(Job job, uint index, uint share, uvec2 from, uvec2 to, uint shift, uint mask) {
    // Where the keys of each digit begin.
    const uint many = DIGITS / GLINT_GROUP;
    uint sum = 0u, total;
    for (uint digit = local * many; digit < local * many + many; digit++) sum += table[index * DIGITS + digit];
    sum = sumBefore(sum, total);
    for (uint digit = local * many; digit < local * many + many; digit++) {
        starts[digit] = sum;
        sum += table[index * DIGITS + digit];
    }
    barrier();
    const uint columns = job.shares * GLINT_GROUP;
    for (uint digit = 0u; digit < DIGITS; digit++)
        counters[digit * GLINT_GROUP + local] =
            starts[digit] + table[job.row + digit * columns + share * GLINT_GROUP + local];
    const uvec2 run = runOf(job, share);
    // Loops cost as much as accesses: four elements in a turn.
    uint i = run.x;
    for (; i + 4u <= run.y; i += 4u)
        [[unroll]] for (uint k = 0u; k < 4u; k++) moveElement(i + k, from, to, shift, mask);
    for (; i < run.y; i++) moveElement(i, from, to, shift, mask);
    barrier();
}

#elif GLINT_STAGE == 4

// A stable pass between buffers. Nothing is written outside of the region, even if other groups change its keys, as
// they do where regions overlap.
#if GLINT_PAYLOAD
#define GLINT_MOVE_PAYLOAD(FROM, TO) TO[to.y + place] = is_first && GLINT_PAYLOAD == 2 ? i : FROM[from.y + i];
#else
#define GLINT_MOVE_PAYLOAD(FROM, TO)
#endif
#define GLINT_PASS(name, FROM, TO)                                                                       \
    void name(uint size, uvec2 from, uvec2 to, uint shift, uint width, uint bits, bool is_first) {       \
        const uint digits = 1u << width, mask = (1u << bits) - 1u;                                       \
        for (uint digit = 0u; digit < digits; digit++) counters[digit * GLINT_GROUP + local] = 0u;       \
        const uint run = (size + GLINT_GROUP - 1u) / GLINT_GROUP;                                        \
        const uint first = min(local * run, size), last = min(first + run, size);                        \
        for (uint i = first; i < last; i++)                                                              \
            counters[digitOf(FROM[from.x + i], shift, mask) * GLINT_GROUP + local]++;                    \
        barrier();                                                                                       \
        uint sum = 0u, total;                                                                            \
        for (uint i = local * digits; i < local * digits + digits; i++) sum += counters[i];              \
        sum = sumBefore(sum, total);                                                                     \
        for (uint i = local * digits; i < local * digits + digits; i++) {                                \
            const uint value = counters[i];                                                              \
            counters[i] = sum;                                                                           \
            sum += value;                                                                                \
        }                                                                                                \
        barrier();                                                                                       \
        for (uint i = first; i < last; i++) {                                                            \
            const uint key = FROM[from.x + i];                                                           \
            const uint counter = digitOf(key, shift, mask) * GLINT_GROUP + local;                        \
            const uint place = min(counters[counter], size - 1u);                                        \
            counters[counter] = place + 1u;                                                              \
            TO[to.x + place] = key;                                                                      \
            GLINT_MOVE_PAYLOAD(FROM, TO)                                                                 \
        }                                                                                                \
        memoryBarrierBuffer();                                                                           \
        barrier();                                                                                       \
    }

GLINT_PASS(moveOut, source, target)
GLINT_PASS(moveBack, target, source)

// Counters take as long as so many elements: few of them for few elements.
void sortSmall(uint keys, uint payload, uint size) {
    const uint most = size < 512u ? 4u : 8u;
    const uint pairs = (work.bits + 2u * most - 1u) / (2u * most);
    const uint width = (work.bits + 2u * pairs - 1u) / (2u * pairs);
    const uvec2 data = uvec2(keys, payload);
    const uint room = min(SMALL, work.capacity);
    const uvec2 scratch = gl_WorkGroupID.x * 2u * room + uvec2(0u, room);
    for (uint i = 0u; i < pairs; i++) {
        const uint shift = 2u * i * width;
        moveOut(size, data, scratch, shift, width, min(width, work.bits - shift), i == 0u);
        // Without bits that are left it copies.
        const uint next = min(shift + width, 31u);
        moveBack(size, scratch, data, next, width, min(width, work.bits - min(shift + width, work.bits)), false);
    }
}

#endif
