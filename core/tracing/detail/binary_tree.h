#pragma once

// What the builders make first: a binary tree down to single primitives.

#include <glint/tracing/detail/float4.h>
#include <glint/tracing/detail/hierarchy.h>

namespace glint::detail {

/// A primitive's box and where it is from.
struct PrimRef {
    float lo[3];
    uint32_t tagged_id;
    float hi[3];
    uint32_t unused;

    // The fourth lanes go through the boxes' arithmetic too: the tag makes a number near 1 of what would be a
    // denormal, which processors take a hundred times as long to add.
    static constexpr uint32_t tag = 0x40000000u;
    static_assert(max_primitives <= 1u << 24);

    uint32_t id() const { return tagged_id ^ tag; }
    Box4 box() const { return {Float4::load(lo), Float4::load(hi)}; }
    /// Twice the middle.
    Float4 center() const { return Float4::load(lo) + Float4::load(hi); }
};
static_assert(sizeof(PrimRef) == 32);

/// A child: a node, or a leaf, which is a position in BinaryTree::refs.
struct BinaryChild {
    static constexpr uint32_t leaf_bit = 0x80000000u;
    uint32_t bits = 0;

    bool isLeaf() const { return (bits & leaf_bit) != 0; }
    uint32_t index() const { return bits & ~leaf_bit; }
};

/// The node that splits the primitives [begin, end) between m - 1 and m has the index m - 1: so no two have the same,
/// and where a node is does not depend on who made it first.
struct BinaryNode {
    float lo[3];
    BinaryChild left;
    float hi[3];
    BinaryChild right;

    Box4 box() const { return {Float4::load(lo), Float4::load(hi)}; }
};
static_assert(sizeof(BinaryNode) == 32);

/// Costs[i - 1]: least sum of areas of the wide nodes that hold what is below a node, if the node gives its parent at
/// most i children. For nodes of w children at most only those below w are of use.
struct CollapseCost {
    static constexpr uint32_t count = 7;
    float costs[count];
};

struct BinaryTree {
    /// Nodes on the longest way from the root to a leaf, by construction.
    static constexpr uint32_t max_height = 64;

    Array<PrimRef> refs;
    Array<BinaryNode> nodes;
    Array<uint8_t> heights;  ///< of each node: 1 if both children are leaves
    Array<CollapseCost> costs;
    BinaryChild root;                       ///< of one primitive at least
    Float4 area_scale = Float4::all(1.0f);  ///< for halfArea
    uint64_t build_bytes = 0;               ///< largest number of bytes held during the build, the result included

    uint64_t bytes() const {
        return refs.size() * sizeof(PrimRef) + nodes.size() * (sizeof(BinaryNode) + sizeof(CollapseCost) + 1);
    }
    uint32_t height(BinaryChild child) const { return child.isLeaf() ? 0 : heights[child.index()]; }
    Box4 box(BinaryChild child) const {
        return child.isLeaf() ? refs[child.index()].box() : nodes[child.index()].box();
    }
};

/// `refs` are finite, one at least; `bounds` holds them.
/// `width` is that of the nodes to come, CollapseCost::count + 1 at most.
BinaryTree buildBinaryTree(Array<PrimRef> refs, const Box4& bounds, BuildMode mode, uint32_t width, ThreadPool* pool);

/// Sorts the refs along a Z-order curve of 10 bits an axis and returns their codes.
Array<uint32_t> sortByCode(Array<PrimRef>& refs, const Box4& bounds, ThreadPool* pool);

/// Costs of a child for 1 to CollapseCost::count children given to its parent: a leaf costs nothing.
inline const float* collapseCosts(const BinaryTree& tree, BinaryChild child) {
    static constexpr CollapseCost nothing = {};
    return child.isLeaf() ? nothing.costs : tree.costs[child.index()].costs;
}

}  // namespace glint::detail
