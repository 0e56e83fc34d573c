#pragma once

// From the binary tree to nodes of eight children.

#include <glint/tracing/detail/binary_tree.h>
#include <glint/tracing/detail/node.h>

namespace glint::detail {

struct WideTree {
    /// Root first. Children are nodes 1, 2, ... as Node::child counts: one more than the place here.
    Array<Node> nodes;
    /// BinaryTree::refs in the order of their records.
    Array<uint32_t> order;
    std::vector<uint32_t> runs;  ///< first nodes of Hierarchy::runs, and the end; places here
    uint32_t depth = 0;
};

/// The cheapest nodes, by their surfaces; no deeper than max_depth.
WideTree collapse(const BinaryTree& tree, const Grid& grid, ThreadPool* pool);

}  // namespace glint::detail
