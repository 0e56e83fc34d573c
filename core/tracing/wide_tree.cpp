#include <glint/tracing/detail/wide_tree.h>

#include <glint/tracing/detail/parallel.h>

#include <bit>
#include <cstring>

namespace glint::detail {

namespace {

/// By how much a node lowers the height if it opens its highest children: eight children take three binary levels.
template <class Node>
constexpr uint32_t height_per_level = std::bit_width(Node::width) - 1;
template <class Node>
constexpr bool fits = BinaryTree::max_height <= maxDepth(Node::form) * height_per_level<Node>;
static_assert(fits<Node> && fits<FullNode>);

/// A node to be: a binary subtree over the refs [begin, end), whose wide node has the place `node`.
struct Item {
    BinaryChild child;
    uint32_t begin = 0;
    uint32_t end = 0;
    uint32_t level = 0;  ///< nodes above
    uint32_t node = 0;

    uint32_t count() const { return end - begin; }
};

template <class Node>
struct Children {
    Item items[Node::width];
    uint32_t count = 0;
};

/// Nodes and records of the top or of one subtree, counted from 0.
template <class Node>
struct Run {
    std::vector<Node> nodes;
    std::vector<uint32_t> order;
    uint32_t depth = 0;
};

template <class Node>
class Collapse {
public:
    Collapse(const BinaryTree& tree, const Grid& grid) : tree_(tree), grid_(grid) {}

    /// Writes the node of an item into `node`, and appends room for its children to the run. Returns them.
    Children<Node> open(const Item& item, Node& node, Run<Node>& run) const {
        Children<Node> children;
        collect(item, Node::width, children);
        // So many levels are enough for a subtree as high as that, if the highest children are opened first; when the
        // others would leave too few, that is done. See docs/tracing.md, "Depth".
        uint32_t height = 0;
        for (uint32_t s = 0; s < children.count; s++) height = std::max(height, heightOf(children.items[s]));
        if (height > height_per_level<Node> * (maxDepth(Node::form) - 1 - item.level)) {
            children = {};
            openHighest(item, children);
        }

        std::stable_partition(children.items, children.items + children.count,
                              [](const Item& child) { return child.child.isLeaf(); });
        const auto first_record = static_cast<uint32_t>(run.order.size());
        const auto first_node = static_cast<uint32_t>(run.nodes.size());
        uint32_t leaves = 0;
        Box4 boxes[Node::width];
        for (uint32_t s = 0; s < children.count; s++) {
            Item& child = children.items[s];
            boxes[s] = tree_.box(child.child);
            child.level = item.level + 1;
            if (child.child.isLeaf()) {
                run.order.push_back(child.begin);
                leaves++;
            } else {
                child.node = first_node + s - leaves;
            }
        }
        run.nodes.resize(first_node + children.count - leaves);
        run.depth = std::max(run.depth, item.level + 1);
        node = Node::encode(grid_, boxes, children.count, leaves, first_node, first_record);
        return children;
    }

    /// All that is below an item, whose own node is kept apart.
    void openAll(const Item& item, Node& node, Run<Node>& run) const {
        const Children<Node> children = open(item, node, run);
        for (uint32_t s = 0; s < children.count; s++) {
            const Item& child = children.items[s];
            if (child.child.isLeaf()) continue;
            Node below;
            openAll(child, below, run);
            run.nodes[child.node] = below;
        }
    }

private:
    uint32_t heightOf(const Item& item) const { return tree_.height(item.child); }

    const BinaryNode& nodeOf(const Item& item) const { return tree_.nodes[item.child.index()]; }
    Item leftOf(const Item& item) const { return {nodeOf(item).left, item.begin, item.child.index() + 1, 0, 0}; }
    Item rightOf(const Item& item) const { return {nodeOf(item).right, item.child.index() + 1, item.end, 0, 0}; }

    /// As the costs were found.
    void collect(const Item& item, uint32_t most, Children<Node>& children) const {
        if (item.child.isLeaf()) {
            children.items[children.count++] = item;
            return;
        }
        const float* costs = collapseCosts(tree_, item.child);
        while (most > 1 && most < Node::width && costs[most - 1] == costs[most - 2]) most--;
        if (most == 1) {
            children.items[children.count++] = item;
            return;
        }
        const float* left_costs = collapseCosts(tree_, nodeOf(item).left);
        const float* right_costs = collapseCosts(tree_, nodeOf(item).right);
        uint32_t best = 1;
        float best_cost = left_costs[0] + right_costs[most - 2];
        for (uint32_t left = 2; left < most; left++) {
            const float cost = left_costs[left - 1] + right_costs[most - left - 1];
            if (cost < best_cost) {
                best = left;
                best_cost = cost;
            }
        }
        collect(leftOf(item), best, children);
        collect(rightOf(item), most - best, children);
    }

    void openHighest(const Item& item, Children<Node>& children) const {
        children.items[0] = leftOf(item);
        children.items[1] = rightOf(item);
        children.count = 2;
        while (children.count < Node::width) {
            Item* highest = children.items;
            for (uint32_t s = 1; s < children.count; s++) {
                if (heightOf(children.items[s]) > heightOf(*highest)) highest = &children.items[s];
            }
            if (highest->child.isLeaf()) return;
            const Item opened = *highest;
            *highest = leftOf(opened);
            children.items[children.count++] = rightOf(opened);
        }
    }

    const BinaryTree& tree_;
    const Grid& grid_;
};

}  // namespace

template <class Node>
WideTree<Node> collapse(const BinaryTree& tree, const Grid& grid, ThreadPool* pool) {
    const Collapse<Node> nodes(tree, grid);
    const auto count = static_cast<uint32_t>(tree.refs.size());
    const uint32_t task_size = std::max(4096u, count / 64);

    Run<Node> top;
    top.nodes.resize(1);
    std::vector<Item> tasks;
    std::vector<Item> open = {{tree.root, 0, count, 0, 0}};
    for (size_t i = 0; i < open.size(); i++) {
        const Item item = open[i];
        if (item.count() <= task_size) {
            tasks.push_back(item);
            continue;
        }
        Node node;
        const Children<Node> children = nodes.open(item, node, top);
        top.nodes[item.node] = node;
        for (uint32_t s = 0; s < children.count; s++) {
            if (!children.items[s].child.isLeaf()) open.push_back(children.items[s]);
        }
    }

    std::vector<Run<Node>> runs(tasks.size());
    std::vector<Node> task_nodes(tasks.size());
    parallelFor(pool, tasks.size(), [&](size_t i) {
        runs[i].nodes.reserve(tasks[i].count() / 4 + 8);
        runs[i].order.reserve(tasks[i].count());
        nodes.openAll(tasks[i], task_nodes[i], runs[i]);
    });

    // Each run gets its place, and what it counted from 0 is moved there.
    WideTree<Node> wide;
    wide.depth = top.depth;
    wide.runs = {0, static_cast<uint32_t>(top.nodes.size())};
    std::vector<uint32_t> first_records;
    auto records = static_cast<uint32_t>(top.order.size());
    for (const Run<Node>& run : runs) {
        wide.depth = std::max(wide.depth, run.depth);
        wide.runs.push_back(wide.runs.back() + static_cast<uint32_t>(run.nodes.size()));
        first_records.push_back(records);
        records += static_cast<uint32_t>(run.order.size());
    }
    wide.nodes = Array<Node>(wide.runs.back());
    wide.order = Array<uint32_t>(count);
    for (Node& node : top.nodes) node.offset(1, 0);
    for (size_t i = 0; i < tasks.size(); i++) {
        task_nodes[i].offset(1 + wide.runs[i + 1], first_records[i]);
        top.nodes[tasks[i].node] = task_nodes[i];
    }
    std::copy(top.nodes.begin(), top.nodes.end(), wide.nodes.begin());
    std::copy(top.order.begin(), top.order.end(), wide.order.begin());
    parallelFor(pool, tasks.size(), [&](size_t i) {
        Node* const to = wide.nodes.data() + wide.runs[i + 1];
        for (size_t n = 0; n < runs[i].nodes.size(); n++) {
            to[n] = runs[i].nodes[n];
            to[n].offset(1 + wide.runs[i + 1], first_records[i]);
        }
        std::copy(runs[i].order.begin(), runs[i].order.end(), wide.order.begin() + first_records[i]);
        runs[i] = {};
    });
    return wide;
}

template WideTree<Node> collapse(const BinaryTree& tree, const Grid& grid, ThreadPool* pool);
template WideTree<FullNode> collapse(const BinaryTree& tree, const Grid& grid, ThreadPool* pool);

}  // namespace glint::detail
