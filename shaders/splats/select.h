// From all splats to the visible ones, whose order they keep. Blocks of GLINT_BLOCK splats, a group each.
// GLINT_STAGE 0: how many are visible. 1: their sort keys and numbers.
#pragma once

#include <glint/splats/common.h>
#include <glint/splats/group.h>

layout(local_size_x = GLINT_GROUP) in;
const uint RUN = GLINT_BLOCK / GLINT_GROUP;

layout(std430, binding = 1) readonly buffer Infos { uvec2 infos[]; };
layout(std430, binding = 2) buffer Sums { uint sums[]; };
#if GLINT_STAGE == 1
layout(std430, binding = 3) writeonly buffer Keys { uint keys[]; };
#endif
layout(push_constant) uniform Work { uint count; } work;

void main() {
    const uint block = groupIndex();
    const uint begin = min(block * GLINT_BLOCK + threadIndex() * RUN, work.count);
    const uint end = min(begin + RUN, work.count);
    uint visible = 0u;
    for (uint i = begin; i < end; i++) visible += min(infos[i].y, 1u);
    uint total;
    uint place = sumBefore(visible, total);
#if GLINT_STAGE == 0
    if (threadIndex() == 0u && block * GLINT_BLOCK < work.count) sums[block] = total;
#else
    if (visible == 0u) return;
    place += sums[block];
    for (uint i = begin; i < end; i++) {
        const uvec2 info = infos[i];
        if (info.y == 0u) continue;
        const uint key = min(max(info.x, frame.first_depth) - frame.first_depth, frame.last_key);
        keys[place] = key | min(info.y, ~0u >> frame.key_bits) << frame.key_bits;
        keys[frame.room + place] = i;
        place++;
    }
#endif
}
