#pragma once

// From the binary tree to wide nodes.

#include <glint/tracing/detail/binary_tree.h>
#include <glint/tracing/detail/node.h>

namespace glint::detail {

template <class Node>
struct WideTree {
    /// Root first. Children are nodes 1, 2, ... as Node::child counts: one more than the place here.
    Array<Node> nodes;
    /// BinaryTree::refs in the order of their records.
    Array<uint32_t> order;
    std::vector<uint32_t> runs;  ///< first nodes of Hierarchy::runs, and the end; places here
    uint32_t depth = 0;
};

/// The cheapest nodes, by their surfaces; no deeper than maxDepth. The tree's costs are those for nodes of this width.
template <class Node>
WideTree<Node> collapse(const BinaryTree& tree, const Grid& grid, ThreadPool* pool);

}  // namespace glint::detail
