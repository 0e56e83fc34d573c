#pragma once

// A look at every node and record of a hierarchy.

#include <glint/tracing/detail/header.h>
#include <glint/tracing/detail/primitives.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <vector>

namespace glint::test {

struct WalkBounds {
    double lo[3] = {1e300, 1e300, 1e300};
    double hi[3] = {-1e300, -1e300, -1e300};
};

/// Walks through a hierarchy and checks all that the traversal relies on.
class HierarchyWalk {
public:
    explicit HierarchyWalk(const detail::Hierarchy& hierarchy) : hierarchy_(hierarchy), seen_(hierarchy.records) {
        const detail::Header header = detail::readHeader(hierarchy);
        std::memcpy(grid_.minimum, header.minimum, sizeof(grid_.minimum));
        grid_.step = header.step;
        EXPECT_EQ(header.nodes, hierarchy.nodes);
        EXPECT_EQ(header.records, hierarchy.records);
        EXPECT_EQ(header.first_record, hierarchy.firstRecord());
        if (hierarchy.form == detail::NodeForm::Packed)
            node<detail::Node>(1, 1);
        else
            node<detail::FullNode>(1, 1);
        EXPECT_EQ(visited_, hierarchy.nodes);
        EXPECT_EQ(deepest_, hierarchy.depth != 0 ? hierarchy.depth : deepest_);
        EXPECT_LE(deepest_, detail::maxDepth(hierarchy.form));
        EXPECT_EQ(std::count(seen_.begin(), seen_.end(), 1u), hierarchy.records) << "each record belongs to one leaf";
    }

    double area = 0.0;  ///< of all nodes' boxes but the root's, decoded: what the collapse keeps small

private:
    template <class Node>
    WalkBounds node(uint32_t index, uint32_t level) {
        WalkBounds bounds;
        if (index == 0 || index > hierarchy_.nodes) {
            ADD_FAILURE() << "no node has the index " << index;
            return bounds;
        }
        if (::testing::Test::HasFailure()) return bounds;  // one message is enough
        visited_++;
        deepest_ = std::max(deepest_, level);
        Node node;
        std::memcpy(&node, &hierarchy_.texels[detail::texelsOf(Node::form) * size_t(index)], sizeof(node));
        EXPECT_LE(node.leaves(), node.children());
        EXPECT_LE(node.children(), Node::width);
        for (uint32_t s = 0; s < node.children(); s++) {
            const WalkBounds inner =
                s < node.leaves() ? record(node.record() + s) : this->node<Node>(node.child(s), level + 1);
            double lo[3];
            double hi[3];
            node.box(grid_, s, lo, hi);
            for (int axis = 0; axis < 3; axis++) {
                if (!(inner.lo[axis] <= inner.hi[axis])) continue;
                EXPECT_LE(lo[axis], inner.lo[axis]) << "node " << index << " child " << s;
                EXPECT_GE(hi[axis], inner.hi[axis]) << "node " << index << " child " << s;
                bounds.lo[axis] = std::min(bounds.lo[axis], inner.lo[axis]);
                bounds.hi[axis] = std::max(bounds.hi[axis], inner.hi[axis]);
            }
            const double d[3] = {hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]};
            if (s >= node.leaves()) area += d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
        }
        return bounds;
    }

    WalkBounds record(uint32_t index) {
        WalkBounds bounds;
        if (index >= hierarchy_.records) {
            ADD_FAILURE() << "no record has the index " << index;
            return bounds;
        }
        seen_[index]++;
        detail::Record record;
        std::memcpy(&record, &hierarchy_.texels[hierarchy_.firstRecord() + 3 * size_t(index)], sizeof(record));
        const uint32_t corners = hierarchy_.kind == detail::Hierarchy::Kind::Triangles ? 3 : 2;
        if (!detail::allInRange(record.values, 3 * corners)) return bounds;
        for (uint32_t i = 0; i < 3 * corners; i++) {
            bounds.lo[i % 3] = std::min(bounds.lo[i % 3], double(record.values[i]));
            bounds.hi[i % 3] = std::max(bounds.hi[i % 3], double(record.values[i]));
        }
        return bounds;
    }

    const detail::Hierarchy& hierarchy_;
    detail::Grid grid_;
    std::vector<uint32_t> seen_;
    uint32_t visited_ = 0;
    uint32_t deepest_ = 0;
};

}  // namespace glint::test
