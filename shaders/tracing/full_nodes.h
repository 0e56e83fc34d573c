// Nodes of four children with boxes of floats, the form for GPUs (core/tracing/detail/node.h, NodeForm::Full), and the
// way of a ray through them. Included by traversal.h.
#pragma once

// Entries of the stack: a hierarchy has 32 levels of nodes at most, and each leaves three children to wait.
#define GLINT_TRACING_STACK (96 * GLINT_TRACING_LEVELS)

// A place in a hierarchy: a node's index; a record's, and 2^31; or none.
#define GLINT_TRACING_LEAF 0x80000000u
#define GLINT_TRACING_NONE 0x7fffffffu

struct GlintWay {
    uint place;
    uint stacked;  // entries of the stack
    uint bottom;   // and those of the level above
};

uint glint_stack[GLINT_TRACING_QUERIES][GLINT_TRACING_STACK];

// To the root, above what is on the stack.
void glintBegin(inout GlintWay way) {
    way.place = 1u;
    way.bottom = way.stacked;
}

void glintEnd(out GlintWay way) { way = GlintWay(GLINT_TRACING_NONE, 0u, 0u); }

bool glintUnderway(GlintWay way) { return way.place != GLINT_TRACING_NONE; }
bool glintAtNode(GlintWay way) { return way.place < GLINT_TRACING_NONE; }
bool glintAtLeaf(GlintWay way) { return way.place > GLINT_TRACING_NONE; }
uint glintRecord(GlintWay way) { return way.place ^ GLINT_TRACING_LEAF; }

void glintNext(inout GlintWay way, uint number, uint base) {
    way.place = GLINT_TRACING_NONE;
    if (way.stacked > way.bottom) {
        way.stacked--;
        way.place = glint_stack[number][way.stacked];
    }
}

// All that is left waits already.
void glintPush(inout GlintWay way, uint number) {}

void glintLeave(inout GlintWay way, uint number, uint base) {
    way.bottom = 0u;
    glintNext(way, number, base);
}

// Floats that are not negative are ordered as their bits are; a negative far end is below any near one, as it should be,
// and a negative near one below t_min. The lowest bits make way for the child's number.
#define GLINT_CHILD(s) const int child##s = first[s] <= last[s] && s < children ? (first[s] & ~3) | s : 0x7fffffff;
#define GLINT_PLACE(key)                                                      \
    ((uint(key) & 3u) < (head.z & 15u) ? leaf + (uint(key) & 3u)              \
                                       : node + (uint(key) & 3u) & 0xffffffu)
#define GLINT_WAIT(key)                                      \
    if (key != 0x7fffffff) {                                 \
        glint_stack[number][way.stacked] = GLINT_PLACE(key); \
        way.stacked++;                                       \
    }

// The children that are not the nearest wait, the farthest lowest.
void glintEnterNode(inout GlintWay way, uint number, GlintSpace space, float t_min, float t_max) {
    const uint texel = space.base + GLINT_NODE_TEXELS * way.place;
    const uvec4 head = GLINT_TRACING_LOAD(texel);
    // Which planes are the near ones is the ray's matter: so it is one of where to read.
    const uvec3 back = uvec3(lessThan(space.inverse, vec3(0.0)));
    const vec3 near = space.to_grid * space.inverse - space.margin;
    const vec3 far = space.to_grid * space.inverse + space.margin;
    const vec4 near_x = uintBitsToFloat(GLINT_TRACING_LOAD(texel + 1u + back.x)) * space.inverse.x + near.x;
    const vec4 near_y = uintBitsToFloat(GLINT_TRACING_LOAD(texel + 3u + back.y)) * space.inverse.y + near.y;
    const vec4 near_z = uintBitsToFloat(GLINT_TRACING_LOAD(texel + 5u + back.z)) * space.inverse.z + near.z;
    const vec4 far_x = uintBitsToFloat(GLINT_TRACING_LOAD(texel + 2u - back.x)) * space.inverse.x + far.x;
    const vec4 far_y = uintBitsToFloat(GLINT_TRACING_LOAD(texel + 4u - back.y)) * space.inverse.y + far.y;
    const vec4 far_z = uintBitsToFloat(GLINT_TRACING_LOAD(texel + 6u - back.z)) * space.inverse.z + far.z;
    const ivec4 first = max(max(floatBitsToInt(near_x), floatBitsToInt(near_y)),
                            max(floatBitsToInt(near_z), ivec4(floatBitsToInt(t_min))));
    const ivec4 last = min(min(floatBitsToInt(far_x), floatBitsToInt(far_y)),
                           min(floatBitsToInt(far_z), ivec4(floatBitsToInt(t_max))));
    const int children = int(head.z >> 4 & 15u);
    GLINT_CHILD(0)
    GLINT_CHILD(1)
    GLINT_CHILD(2)
    GLINT_CHILD(3)
    const int low0 = min(child0, child2), high0 = max(child0, child2);
    const int low1 = min(child1, child3), high1 = max(child1, child3);
    const int nearest = min(low0, low1);
    const int second = min(max(low0, low1), min(high0, high1));
    const int third = max(max(low0, low1), min(high0, high1));
    const int farthest = max(high0, high1);
    const uint leaf = head.w >> 8 | GLINT_TRACING_LEAF;
    const uint node = head.z >> 8;
    GLINT_WAIT(farthest)
    GLINT_WAIT(third)
    GLINT_WAIT(second)
    if (nearest != 0x7fffffff)
        way.place = GLINT_PLACE(nearest);
    else
        glintNext(way, number, space.base);
}
