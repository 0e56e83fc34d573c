// Nodes of eight children on a grid of 8 bits an axis, the form for CPUs (core/tracing/detail/node.h,
// NodeForm::Packed), and the way of a ray through them, which keeps what is left of a node's children in a list.
// Included by traversal.h.
#pragma once

// Entries of the stack: a hierarchy has 24 levels of nodes at most, and the last one pushes nothing; but the instances
// beside the one that the ray is within wait too.
#define GLINT_TRACING_STACK (24 * GLINT_TRACING_LEVELS - 1)

// The slot that ends a list of children, and a list of nothing else.
#define GLINT_TRACING_NONE 15u
#define GLINT_TRACING_EMPTY 0xffffffffu

// A node's children that the ray meets between t_min >= 0 and t_max, nearest first: their slots, four bits each, ended
// by NONE. `header` is the node's words 2 and 3.
#define GLINT_PLANE(word, shift) float(int((word) << (24 - shift)))
#define GLINT_CHILD(s, nx, fx, ny, fy, nz, fz, shift)                                                        \
    int key##s;                                                                                              \
    {                                                                                                        \
        const int tx0 = floatBitsToInt(GLINT_PLANE(nx, shift) * scale.x + near.x);                           \
        const int ty0 = floatBitsToInt(GLINT_PLANE(ny, shift) * scale.y + near.y);                           \
        const int tz0 = floatBitsToInt(GLINT_PLANE(nz, shift) * scale.z + near.z);                           \
        const int tx1 = floatBitsToInt(GLINT_PLANE(fx, shift) * scale.x + far.x);                            \
        const int ty1 = floatBitsToInt(GLINT_PLANE(fy, shift) * scale.y + far.y);                            \
        const int tz1 = floatBitsToInt(GLINT_PLANE(fz, shift) * scale.z + far.z);                            \
        const int t0 = max(max(tx0, ty0), max(tz0, first));                                                  \
        const int t1 = min(min(tx1, ty1), min(tz1, last));                                                   \
        key##s = t0 <= t1 && s < children ? (t0 & ~15) | s : 0x7fffffff;                                     \
    }
#define GLINT_SORT(a, b)                          \
    {                                             \
        const int smaller = min(key##a, key##b);  \
        key##b = max(key##a, key##b);             \
        key##a = smaller;                         \
    }

uint glintNode(GlintSpace space, uint node, float t_min, float t_max, out uvec2 header) {
    const uint texel = space.base + GLINT_NODE_TEXELS * node;
    const uvec4 head = GLINT_TRACING_LOAD(texel);
    const uvec4 planes_x = GLINT_TRACING_LOAD(texel + 1u);
    const uvec4 planes_y = GLINT_TRACING_LOAD(texel + 2u);
    const uvec4 planes_z = GLINT_TRACING_LOAD(texel + 3u);
    header = head.zw;

    const uvec3 exponents = uvec3(head.x << 3, head.y << 3, head.w << 19) & 0x07800000u;
    const uvec3 origin = uvec3(head.xy & 0xfffffu, head.x >> 24 | head.y >> 24 << 8 | (head.w & 15u) << 16);
    const vec3 unit = uintBitsToFloat(exponents + space.scale_bits);
    const vec3 corner = (vec3(origin) * space.step + space.to_grid + unit * 128.0) * space.inverse;
    const vec3 scale = unit * space.inverse * 5.9604645e-8;  // 2^-24
    const vec3 near = corner - space.margin;
    const vec3 far = corner + space.margin;

    const bvec3 back = lessThan(space.inverse, vec3(0.0));
    const uvec2 near_x = back.x ? planes_x.zw : planes_x.xy;
    const uvec2 far_x = back.x ? planes_x.xy : planes_x.zw;
    const uvec2 near_y = back.y ? planes_y.zw : planes_y.xy;
    const uvec2 far_y = back.y ? planes_y.xy : planes_y.zw;
    const uvec2 near_z = back.z ? planes_z.zw : planes_z.xy;
    const uvec2 far_z = back.z ? planes_z.xy : planes_z.zw;

    // Floats that are not negative are ordered as their bits are; a negative far end is below any near one, as it should
    // be, and a negative near one below t_min.
    const int first = floatBitsToInt(t_min);
    const int last = floatBitsToInt(t_max);
    const int children = int(head.z >> 4 & 15u);
    GLINT_CHILD(0, near_x.x, far_x.x, near_y.x, far_y.x, near_z.x, far_z.x, 0)
    GLINT_CHILD(1, near_x.x, far_x.x, near_y.x, far_y.x, near_z.x, far_z.x, 8)
    GLINT_CHILD(2, near_x.x, far_x.x, near_y.x, far_y.x, near_z.x, far_z.x, 16)
    GLINT_CHILD(3, near_x.x, far_x.x, near_y.x, far_y.x, near_z.x, far_z.x, 24)
    GLINT_CHILD(4, near_x.y, far_x.y, near_y.y, far_y.y, near_z.y, far_z.y, 0)
    GLINT_CHILD(5, near_x.y, far_x.y, near_y.y, far_y.y, near_z.y, far_z.y, 8)
    GLINT_CHILD(6, near_x.y, far_x.y, near_y.y, far_y.y, near_z.y, far_z.y, 16)
    GLINT_CHILD(7, near_x.y, far_x.y, near_y.y, far_y.y, near_z.y, far_z.y, 24)

    GLINT_SORT(0, 2) GLINT_SORT(1, 3) GLINT_SORT(4, 6) GLINT_SORT(5, 7)
    GLINT_SORT(0, 4) GLINT_SORT(1, 5) GLINT_SORT(2, 6) GLINT_SORT(3, 7)
    GLINT_SORT(0, 1) GLINT_SORT(2, 3) GLINT_SORT(4, 5) GLINT_SORT(6, 7)
    GLINT_SORT(2, 4) GLINT_SORT(3, 5)
    GLINT_SORT(1, 4) GLINT_SORT(3, 6)
    GLINT_SORT(1, 2) GLINT_SORT(3, 4) GLINT_SORT(5, 6)

    return uint(key0 & 15 | (key1 & 15) << 4 | (key2 & 15) << 8 | (key3 & 15) << 12 | (key4 & 15) << 16 |
                (key5 & 15) << 20 | (key6 & 15) << 24 | key7 << 28);
}

uint glintFirst(uint list) { return list & 15u; }
uint glintRest(uint list) { return list >> 4 | 0xf0000000u; }
bool glintIsLeaf(uvec2 header, uint slot) { return slot < (header.x & 15u); }
uint glintChildNode(uvec2 header, uint slot) { return ((header.x >> 8) + slot) & 0xffffffu; }

// The way of a ray through a hierarchy. What waits for it is on the stack, beside the structure: an array in it would be
// copied at every call.
struct GlintWay {
    uint node;     // whose children are in `list`
    uvec2 header;  // its words 2 and 3
    uint list;     // what is left of them after `slot`
    uint slot;     // the child to go to; NONE when there is none left
    uint stacked;  // entries of the stack
    uint bottom;   // and those of the level above
};

uint glint_stack_nodes[GLINT_TRACING_QUERIES][GLINT_TRACING_STACK];
uint glint_stack_lists[GLINT_TRACING_QUERIES][GLINT_TRACING_STACK];

// To the root, above what is on the stack.
void glintBegin(inout GlintWay way) {
    way.node = 0u;
    way.header = uvec2(0x100u, 0u);  // child 0 is node 1
    way.list = GLINT_TRACING_EMPTY;
    way.slot = 0u;
    way.bottom = way.stacked;
}

void glintEnd(out GlintWay way) { way = GlintWay(0u, uvec2(0u), GLINT_TRACING_EMPTY, GLINT_TRACING_NONE, 0u, 0u); }

bool glintUnderway(GlintWay way) { return way.slot != GLINT_TRACING_NONE; }
bool glintAtNode(GlintWay way) { return glintUnderway(way) && !glintIsLeaf(way.header, way.slot); }
bool glintAtLeaf(GlintWay way) { return glintUnderway(way) && glintIsLeaf(way.header, way.slot); }

// The record of the leaf.
uint glintRecord(GlintWay way) { return (way.header.y >> 8) + way.slot; }

// To the next child: of this node, or of the last one that has children left. (Keeping on the stack where these begin,
// and passing over what lies beyond the closest hit, takes more time than it saves: docs/tracing.md.)
void glintNext(inout GlintWay way, uint number, uint base) {
    if (way.list == GLINT_TRACING_EMPTY && way.stacked > way.bottom) {
        way.stacked--;
        way.list = glint_stack_lists[number][way.stacked];
        way.node = glint_stack_nodes[number][way.stacked];
        way.header = GLINT_TRACING_LOAD(base + GLINT_NODE_TEXELS * way.node).zw;
    }
    way.slot = glintFirst(way.list);
    way.list = glintRest(way.list);
}

// What is left of this node's children waits on the stack.
void glintPush(inout GlintWay way, uint number) {
    if (way.list == GLINT_TRACING_EMPTY) return;
    glint_stack_nodes[number][way.stacked] = way.node;
    glint_stack_lists[number][way.stacked] = way.list;
    way.stacked++;
}

void glintEnterNode(inout GlintWay way, uint number, GlintSpace space, float t_min, float t_max) {
    glintPush(way, number);
    way.node = glintChildNode(way.header, way.slot);
    way.list = glintNode(space, way.node, t_min, t_max, way.header);
    glintNext(way, number, space.base);
}

// From the root of an instance's hierarchy, with nothing left there, back to the level above, whose texels begin at
// `base`.
void glintLeave(inout GlintWay way, uint number, uint base) {
    way.list = GLINT_TRACING_EMPTY;
    way.bottom = 0u;
    glintNext(way, number, base);
}
