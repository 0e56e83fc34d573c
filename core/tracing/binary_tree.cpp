#include <glint/tracing/detail/binary_tree.h>

#include <glint/tracing/detail/parallel.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace glint::detail {

namespace {

constexpr uint32_t max_bins = 16;
constexpr size_t grain = 4096;

/// Primitives of a node to be.
struct Range {
    uint32_t begin = 0;
    uint32_t end = 0;
    uint32_t depth = 0;  ///< nodes above
    Box4 centers;        ///< of twice the centres

    uint32_t count() const { return end - begin; }
};

uint32_t ceilLog2(uint32_t n) { return static_cast<uint32_t>(std::bit_width(n - 1)); }

/// Which bin a centre falls into, along all axes at once. An axis without extent has one bin.
struct Binning {
    Float4 origin;
    Float4 scale;
    uint32_t bins = 0;
    bool usable[3] = {};
    bool any = false;

    Binning(const Box4& centers, uint32_t bins_) : origin(centers.lo), bins(bins_) {
        float lo[4];
        float hi[4];
        float factor[4] = {};
        centers.lo.store(lo);
        centers.hi.store(hi);
        for (int axis = 0; axis < 3; axis++) {
            // An extent whose reciprocal overflows is as good as none.
            const float f = static_cast<float>(bins) / (hi[axis] - lo[axis]);
            usable[axis] = f > 0.0f && f < 1e30f;
            factor[axis] = usable[axis] ? f : 0.0f;
            any = any || usable[axis];
        }
        scale = Float4::load(factor);
    }

    /// The bounds are for what overflows: NaN becomes 0.
    void bin(const PrimRef& ref, int32_t* at) const {
        const Float4 position = (ref.center() - origin) * scale;
        min(max(position, Float4::all(0.0f)), Float4::all(static_cast<float>(bins - 1))).truncate(at);
    }
};

struct Bins {
    Box4 boxes[3][max_bins];
    uint32_t counts[3][max_bins];

    void clear(uint32_t bins) {
        for (int axis = 0; axis < 3; axis++) {
            for (uint32_t i = 0; i < bins; i++) boxes[axis][i] = Box4();
            for (uint32_t i = 0; i < bins; i++) counts[axis][i] = 0;
        }
    }
    void add(const PrimRef* begin, const PrimRef* end, const Binning& binning) {
        for (const PrimRef* ref = begin; ref != end; ref++) {
            int32_t at[4];
            binning.bin(*ref, at);
            const Box4 box = ref->box();
            for (int axis = 0; axis < 3; axis++) {
                boxes[axis][at[axis]].add(box);
                counts[axis][at[axis]]++;
            }
        }
    }
    void add(const Bins& other, uint32_t bins) {
        for (int axis = 0; axis < 3; axis++) {
            for (uint32_t i = 0; i < bins; i++) {
                boxes[axis][i].add(other.boxes[axis][i]);
                counts[axis][i] += other.counts[axis][i];
            }
        }
    }
};

struct Split {
    int axis = -1;
    int32_t bin = 0;  ///< first bin of the right side
};

Split cheapest(const Bins& bins, const Binning& binning, uint32_t count, Float4 area_scale) {
    Split best;
    float best_cost = std::numeric_limits<float>::infinity();
    for (int axis = 0; axis < 3; axis++) {
        if (!binning.usable[axis]) continue;
        float right_costs[max_bins];
        Box4 box;
        uint32_t right = 0;
        for (uint32_t i = binning.bins - 1; i > 0; i--) {
            if (bins.counts[axis][i] != 0) box.add(bins.boxes[axis][i]);
            right += bins.counts[axis][i];
            right_costs[i] = right == 0 ? 0.0f : halfArea(box, area_scale) * static_cast<float>(right);
        }
        box = Box4();
        uint32_t left = 0;
        for (uint32_t i = 1; i < binning.bins; i++) {
            if (bins.counts[axis][i - 1] != 0) box.add(bins.boxes[axis][i - 1]);
            left += bins.counts[axis][i - 1];
            if (left == 0 || left == count) continue;
            const float cost = halfArea(box, area_scale) * static_cast<float>(left) + right_costs[i];
            if (cost < best_cost) {
                best_cost = cost;
                best = {axis, static_cast<int32_t>(i)};
            }
        }
    }
    return best;
}

class Builder {
public:
    Builder(BinaryTree& tree, BuildMode mode, uint32_t width, ThreadPool* pool)
        : tree_(tree), mode_(mode), width_(width), pool_(pool) {}

    void run() {
        const auto count = static_cast<uint32_t>(tree_.refs.size());
        tree_.nodes = Array<BinaryNode>(count - 1);
        tree_.heights = Array<uint8_t>(count - 1);
        tree_.costs = Array<CollapseCost>(count - 1);
        Range all = {0, count, 0, {}};
        if (mode_ == BuildMode::Quality) { all.centers = centers(all); }
        // The top is split with all threads at each node, then each thread takes subtrees.
        task_size_ = std::max<uint32_t>(grain, count / 64);
        if (mode_ == BuildMode::Quality && count > task_size_) scratch_ = Array<PrimRef>(count);
        tree_.build_bytes = tree_.bytes() + codes.size() * sizeof(uint32_t) + scratch_.size() * sizeof(PrimRef);
        const BinaryChild root = top(all);
        scratch_ = {};
        task_roots_.resize(tasks_.size());
        parallelFor(pool_, tasks_.size(), [&](size_t i) { task_roots_[i] = build(tasks_[i]); });
        tree_.root = resolved(root);
        for (size_t i = top_nodes_.size(); i-- > 0;) finish(top_nodes_[i]);
    }

    Array<uint32_t> codes;  ///< with BuildMode::Fast

private:
    static constexpr uint32_t task_bit = 0x40000000u;

    static BinaryChild childOf(const Range& range) { return {range.begin | BinaryChild::leaf_bit}; }

    BinaryChild top(const Range& range) {
        if (range.count() == 1) return childOf(range);
        if (range.count() <= task_size_) {
            tasks_.push_back(range);
            // The index of a task's node is known once it has been split: finish() asks for it.
            return {BinaryChild::leaf_bit | task_bit | static_cast<uint32_t>(tasks_.size() - 1)};
        }
        Range left;
        Range right;
        const uint32_t node = split(range, left, right, true);
        top_nodes_.push_back(node);
        const BinaryChild left_child = top(left);
        const BinaryChild right_child = top(right);
        tree_.nodes[node].left = left_child;
        tree_.nodes[node].right = right_child;
        return {node};
    }

    BinaryChild build(const Range& range) {
        if (range.count() == 1) return childOf(range);
        Range left;
        Range right;
        const uint32_t node = split(range, left, right, false);
        tree_.nodes[node].left = build(left);
        tree_.nodes[node].right = build(right);
        finish(node);
        return {node};
    }

    BinaryChild resolved(BinaryChild child) const {
        const bool task = child.isLeaf() && (child.bits & task_bit) != 0;
        return task ? task_roots_[child.index() ^ task_bit] : child;
    }

    /// What follows from the children.
    void finish(uint32_t index) {
        BinaryNode& node = tree_.nodes[index];
        node.left = resolved(node.left);
        node.right = resolved(node.right);
        const BinaryChild left = node.left;
        const BinaryChild right = node.right;
        Box4 box = tree_.box(left);
        box.add(tree_.box(right));
        box.lo.store(node.lo);
        box.hi.store(node.hi);
        // The fourth lanes have overwritten the children.
        node.left = left;
        node.right = right;
        tree_.heights[index] = static_cast<uint8_t>(1 + std::max(tree_.height(left), tree_.height(right)));
        // The cheapest distribution of i + 2 children to the two sides, for all i at once.
        const float* left_costs = collapseCosts(tree_, left);
        const float* right_costs = collapseCosts(tree_, right);
        float cheapest[CollapseCost::count];
        for (uint32_t i = 0; i < CollapseCost::count; i++) cheapest[i] = left_costs[0] + right_costs[i];
        for (uint32_t l = 1; l < CollapseCost::count; l++) {
            for (uint32_t i = l; i < CollapseCost::count; i++)
                cheapest[i] = std::min(cheapest[i], left_costs[l] + right_costs[i - l]);
        }
        float* costs = tree_.costs[index].costs;
        costs[0] = cheapest[width_ - 2] + halfArea(box, tree_.area_scale);
        for (uint32_t i = 1; i < CollapseCost::count; i++) costs[i] = std::min(costs[i - 1], cheapest[i - 1]);
    }

    Box4 centers(const Range& range) {
        const size_t pieces = (range.count() + grain - 1) / grain;
        std::vector<Box4> boxes(pieces);
        parallelRanges(pool_, range.count(), grain, [&](size_t begin, size_t end) {
            Box4 box;
            for (size_t i = begin; i < end; i++) box.add(tree_.refs[range.begin + i].center());
            boxes[begin / grain] = box;
        });
        Box4 all;
        for (const Box4& box : boxes) all.add(box);
        return all;
    }

    uint32_t split(const Range& range, Range& left, Range& right, bool parallel) {
        uint32_t middle = 0;
        if (mode_ == BuildMode::Fast)
            middle = splitByCode(range);
        else if (range.depth + 1 + ceilLog2(range.count()) < BinaryTree::max_height)
            middle = parallel ? splitParallel(range, left, right) : splitBySurface(range, left, right);
        const bool by_order = middle == 0;
        if (by_order) middle = range.begin + range.count() / 2;
        left.begin = range.begin;
        left.end = right.begin = middle;
        right.end = range.end;
        left.depth = right.depth = range.depth + 1;
        if (by_order && mode_ == BuildMode::Quality) {
            left.centers = centers(left);
            right.centers = centers(right);
        }
        return middle - 1;
    }

    /// At the highest bit in which the codes differ; in the middle where they are equal. So no deeper than the bits of
    /// the codes and the logarithm of the count.
    uint32_t splitByCode(const Range& range) const {
        const uint32_t first = codes[range.begin];
        const uint32_t difference = first ^ codes[range.end - 1];
        if (difference == 0) return 0;
        const uint32_t bit = std::bit_floor(difference);
        uint32_t low = range.begin;
        uint32_t high = range.end - 1;
        while (high - low > 1) {
            const uint32_t middle = low + (high - low) / 2;
            (codes[middle] & bit) != 0 ? high = middle : low = middle;
        }
        return high;
    }

    static uint32_t binsFor(uint32_t count) { return count <= 4 ? 4 : count <= 32 ? 8 : max_bins; }

    /// 0 if nothing separates the centres.
    uint32_t splitBySurface(const Range& range, Range& left, Range& right) {
        PrimRef* const begin = tree_.refs.data() + range.begin;
        PrimRef* const end = tree_.refs.data() + range.end;
        const Binning binning(range.centers, binsFor(range.count()));
        if (!binning.any) return 0;
        Bins bins;
        bins.clear(binning.bins);
        bins.add(begin, end, binning);
        const Split split = cheapest(bins, binning, range.count(), tree_.area_scale);
        if (split.axis < 0) return 0;

        PrimRef* low = begin;
        PrimRef* high = end;
        for (;;) {
            while (low != high && isLeft(*low, binning, split)) left.centers.add((low++)->center());
            while (low != high && !isLeft(*(high - 1), binning, split)) right.centers.add((--high)->center());
            if (low == high) break;
            std::swap(*low, *(high - 1));
        }
        return static_cast<uint32_t>(low - tree_.refs.data());
    }

    static bool isLeft(const PrimRef& ref, const Binning& binning, const Split& split) {
        int32_t at[4];
        binning.bin(ref, at);
        return at[split.axis] < split.bin;
    }

    uint32_t splitParallel(const Range& range, Range& left, Range& right) {
        const PrimRef* const refs = tree_.refs.data() + range.begin;
        const Binning binning(range.centers, binsFor(range.count()));
        if (!binning.any) return 0;
        struct Piece {
            Bins bins;
            Box4 left_centers;
            Box4 right_centers;
            size_t left = 0;
        };
        const size_t piece = std::max<size_t>(grain, range.count() / 32);
        std::vector<Piece> pieces((range.count() + piece - 1) / piece);
        parallelRanges(pool_, range.count(), piece, [&](size_t begin, size_t end) {
            Bins& bins = pieces[begin / piece].bins;
            bins.clear(binning.bins);
            bins.add(refs + begin, refs + end, binning);
        });
        Bins& bins = pieces[0].bins;
        for (size_t i = 1; i < pieces.size(); i++) bins.add(pieces[i].bins, binning.bins);
        const Split split = cheapest(bins, binning, range.count(), tree_.area_scale);
        if (split.axis < 0) return 0;

        size_t lefts = 0;
        for (int32_t i = 0; i < split.bin; i++) lefts += bins.counts[split.axis][i];
        parallelRanges(pool_, range.count(), piece, [&](size_t begin, size_t end) {
            Piece& mine = pieces[begin / piece];
            for (size_t i = begin; i < end; i++) {
                const bool is_left = isLeft(refs[i], binning, split);
                (is_left ? mine.left_centers : mine.right_centers).add(refs[i].center());
                mine.left += is_left ? 1 : 0;
            }
        });
        size_t before = 0;
        for (Piece& each : pieces) {
            left.centers.add(each.left_centers);
            right.centers.add(each.right_centers);
            before += std::exchange(each.left, before);
        }
        PrimRef* const sorted = scratch_.data() + range.begin;
        parallelRanges(pool_, range.count(), piece, [&](size_t begin, size_t end) {
            size_t to_left = pieces[begin / piece].left;
            size_t to_right = lefts + (begin - to_left);
            for (size_t i = begin; i < end; i++)
                sorted[isLeft(refs[i], binning, split) ? to_left++ : to_right++] = refs[i];
        });
        parallelRanges(pool_, range.count(), piece, [&](size_t begin, size_t end) {
            std::memcpy(tree_.refs.data() + range.begin + begin, sorted + begin, (end - begin) * sizeof(PrimRef));
        });
        return range.begin + static_cast<uint32_t>(lefts);
    }

    BinaryTree& tree_;
    const BuildMode mode_;
    const uint32_t width_;
    ThreadPool* const pool_;
    uint32_t task_size_ = 0;
    Array<PrimRef> scratch_;
    std::vector<Range> tasks_;
    std::vector<BinaryChild> task_roots_;
    std::vector<uint32_t> top_nodes_;  ///< parents before children
};

}  // namespace

BinaryTree buildBinaryTree(Array<PrimRef> refs, const Box4& bounds, BuildMode mode, uint32_t width, ThreadPool* pool) {
    if (mode == BuildMode::Split) mode = BuildMode::Quality;
    BinaryTree tree;
    tree.refs = std::move(refs);
    float size[4];
    (bounds.hi - bounds.lo).store(size);
    const float extent = std::max({size[0], size[1], size[2]});
    tree.area_scale = Float4::all(extent > 1e-30f ? (extent < 1e38f ? 1.0f / extent : 1e-38f) : 1e30f);
    if (tree.refs.size() == 1) {
        tree.root = {BinaryChild::leaf_bit};
        tree.build_bytes = tree.bytes();
        return tree;
    }
    Builder builder(tree, mode, width, pool);
    if (mode == BuildMode::Fast) builder.codes = sortByCode(tree.refs, bounds, pool);
    builder.run();
    return tree;
}

}  // namespace glint::detail
