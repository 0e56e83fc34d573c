// What the device keeps of a draw for the host and for its own indirect dispatches.
#pragma once

struct Region {
    uint keys, payload, size, padding;
};

layout(std430, binding = 2) buffer State {
    Region splats;         // visible ones, by depth
    Region entries;        // of the tiles' lists
    uvec4 splat_groups;    // indirect arguments: GLINT_BLOCK splats a group
    uvec4 entry_groups;    // GLINT_BLOCK entries a group
    uint wanted_low, wanted_high;  // entries without a limit
    uint most_low, most_high;      // largest of these since the last check
} state;

// `count` groups in one or two dimensions.
uvec4 groupsFor(uint count) { return uvec4(min(count, 32768u), (count + 32767u) / 32768u, 1u, 0u); }
