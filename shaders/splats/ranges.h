// Where each tile's list begins and ends among the sorted entries.
#pragma once

#include <glint/splats/common.h>
#include <glint/splats/state.h>

layout(local_size_x = GLINT_BLOCK) in;

layout(std430, binding = 3) readonly buffer Entries { uint entries[]; };
layout(std430, binding = 4) writeonly buffer Ranges { uint ranges[]; };

void main() {
    const uint i = groupIndex() * GLINT_BLOCK + gl_LocalInvocationIndex;
    const uint count = state.entries.size;
    if (i >= count) return;
    const uint tile = entries[i];
    if (tile >= frame.tiles.x * frame.tiles.y) return;
    if (i == 0u || entries[i - 1u] != tile) ranges[2u * tile] = i;
    if (i + 1u == count || entries[i + 1u] != tile) ranges[2u * tile + 1u] = i + 1u;
}
