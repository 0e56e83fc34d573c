#pragma once

// The nodes. Exact on the builder's side: what is encoded holds what was to be held, as numbers.
// shaders/tracing/traversal.h decodes.
//
// NodeForm::Packed: eight boxes in 64 bytes, on a grid of 8 bits an axis.
//
//   word 0: origin x in bits 0-19, exponent x in 20-23, origin z bits 0-7 in 24-31
//   word 1: origin y in bits 0-19, exponent y in 20-23, origin z bits 8-15 in 24-31
//   word 2: number of leaves in bits 0-3, of children in 4-7, (first child node - number of leaves) mod 2^24 in 8-31
//   word 3: origin z bits 16-19 in 0-3, exponent z in 4-7, first record in 8-31
//   words 4-5: low planes along x of the children 0-3 and 4-7, a byte each; 6-7 high planes; 8-11 y; 12-15 z
//
// Leaves come first, each a single primitive: child s is record `first record + s`, or node `(word 2 >> 8) + s`.
//
// A plane's byte is that of bits 8 (s mod 4) and up, with the top bit inverted. The traversal does not cut off the
// bytes below it, which saves it an operation in five: they count as the plane's fraction. Bytes are chosen with those
// below them in mind, so boxes are no larger for it. With  p = int(word << (24 - 8 (s mod 4))) / 2^24 + 128  (int has a
// sign) the plane is at  minimum + origin * step + p * step * 2^(exponent - 2),  with the grid's minimum and step. The
// step is a power of two, the minimum a multiple of it, and both so chosen that the sum of the first two terms has 24
// bits at most: a float32.
//
// NodeForm::Full: four boxes in 128 bytes. Words 2 and 3 as above, but for the bits of z; what is not named is 0.
//
//   words 4-7: low planes along x of the children 0-3, floats, as distances from the grid's minimum; 8-11 high planes;
//   12-15 and 16-19 y; 20-23 and 24-27 z. Rounded outward.

#include <glint/tracing/detail/float4.h>
#include <glint/tracing/detail/hierarchy.h>

namespace glint::detail {

struct Grid {
    float minimum[3] = {};
    float step = 1.0f;  ///< a power of two
};

/// The grid for boxes within `bounds` (finite; or empty).
Grid makeGrid(const Box4& bounds);

constexpr int exponent_bias = 2;

/// What all forms have in common.
template <uint32_t word_count>
struct NodeBase {
    uint32_t words[word_count];

    uint32_t leaves() const { return words[2] & 15u; }
    /// Leaves included.
    uint32_t children() const { return words[2] >> 4 & 15u; }
    uint32_t record() const { return words[3] >> 8; }
    /// Node index of child s, which is no leaf.
    uint32_t child(uint32_t s) const { return ((words[2] >> 8) + s) & 0xffffffu; }
    /// Moves the children's first indices.
    void offset(uint32_t nodes, uint32_t records) {
        words[2] += nodes << 8;
        words[3] += records << 8;
    }
};

struct Node : NodeBase<16> {
    static constexpr NodeForm form = NodeForm::Packed;
    static constexpr uint32_t width = 8;

    /// Boxes of `count` children, the leaves first. An empty box, of what has become inactive, is a point of the node.
    static Node encode(const Grid& grid, const Box4* boxes, uint32_t count, uint32_t leaves, uint32_t first_node,
                       uint32_t first_record);
    /// The box of child s, exact.
    void box(const Grid& grid, uint32_t s, double lo[3], double hi[3]) const;
};
static_assert(sizeof(Node) == texelsOf(Node::form) * sizeof(Texel));

struct FullNode : NodeBase<32> {
    static constexpr NodeForm form = NodeForm::Full;
    static constexpr uint32_t width = 4;

    /// As Node's; an empty box stays empty.
    static FullNode encode(const Grid& grid, const Box4* boxes, uint32_t count, uint32_t leaves, uint32_t first_node,
                           uint32_t first_record);
    void box(const Grid& grid, uint32_t s, double lo[3], double hi[3]) const;
};
static_assert(sizeof(FullNode) == texelsOf(FullNode::form) * sizeof(Texel));

}  // namespace glint::detail
