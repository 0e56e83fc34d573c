#include <glint/tracing/detail/hierarchy.h>

#include <glint/tracing/detail/binary_tree.h>
#include <glint/tracing/detail/header.h>
#include <glint/tracing/detail/parallel.h>
#include <glint/tracing/detail/primitives.h>
#include <glint/tracing/detail/splits.h>
#include <glint/tracing/detail/wide_tree.h>

#include <atomic>
#include <numeric>

namespace glint::detail {

namespace {

constexpr size_t grain = 16384;

/// The active primitives, in the order of the row, and their box.
struct Gathered {
    Array<PrimRef> refs;
    Box4 bounds;
    uint32_t active = 0;
};

template <class Reader>
Expected<Gathered> gather(std::span<const typename Reader::Geometry> geometries, std::span<const uint64_t> first,
                          ThreadPool* pool) {
    struct Piece {
        Box4 bounds;
        size_t active = 0;
    };
    const size_t count = first.back();
    Gathered result;
    result.refs = Array<PrimRef>(count);
    std::vector<Piece> pieces((count + grain - 1) / grain);
    std::atomic<uint64_t> bad = count;  // the first primitive with an index out of range
    parallelRanges(pool, count, grain, [&](size_t begin, size_t end) {
        Piece& piece = pieces[begin / grain];
        size_t g = std::upper_bound(first.begin(), first.end(), begin) - first.begin() - 1;
        for (size_t i = begin; i < end; i++) {
            while (i >= first[g + 1]) g++;
            const auto primitive = static_cast<uint32_t>(i - first[g]);
            if (!Reader::inRange(geometries[g], primitive)) {
                uint64_t known = bad;
                while (i < known && !bad.compare_exchange_weak(known, i)) {}
                return;
            }
            float values[9];
            Reader::read(geometries[g], primitive, values);
            if (!Reader::active(values)) continue;
            const Box4 box = Reader::box(values);
            PrimRef& ref = result.refs[begin + piece.active++];
            box.lo.store(ref.lo);
            box.hi.store(ref.hi);
            ref.tagged_id = PrimRef::tag | static_cast<uint32_t>(i);
            piece.bounds.add(box);
        }
    });
    if (bad < count) {
        const size_t g = std::upper_bound(first.begin(), first.end(), bad.load()) - first.begin() - 1;
        return unexpected(Reader::rangeError(geometries[g], g, static_cast<uint32_t>(bad - first[g])));
    }
    size_t active = 0;
    for (size_t i = 0; i < pieces.size(); i++) {
        if (active != i * grain)
            std::memmove(&result.refs[active], &result.refs[i * grain], pieces[i].active * sizeof(PrimRef));
        active += pieces[i].active;
        result.bounds.add(pieces[i].bounds);
    }
    result.active = static_cast<uint32_t>(active);
    if (active != count) {
        Array<PrimRef> fitting(active);
        std::copy(result.refs.begin(), result.refs.begin() + active, fitting.begin());
        result.refs = std::move(fitting);
    }
    return result;
}

/// Builds the nodes into `result`, whose form is Node's, with room for the records behind them. Returns the primitives
/// in the order of their records.
template <class Node>
Array<uint32_t> buildNodes(Gathered gathered, const Grid& grid, BuildMode mode, ThreadPool* pool, Hierarchy& result) {
    WideTree<Node> wide;
    Array<uint32_t> order(gathered.active);
    if (gathered.active == 0) {
        wide.nodes = Array<Node>(1);
        wide.nodes[0] = Node::encode(grid, nullptr, 0, 0, 0, 0);
        wide.depth = 1;
        wide.runs = {0, 1};
    } else {
        const BinaryTree tree = buildBinaryTree(std::move(gathered.refs), gathered.bounds, mode, Node::width, pool);
        wide = collapse<Node>(tree, grid, pool);
        parallelRanges(pool, order.size(), grain, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++) order[i] = tree.refs[wide.order[i]].id();
        });
        // While the wide nodes are made, each subtree's are copied to their places.
        result.build_bytes =
            std::max(tree.build_bytes, tree.bytes() + 2 * wide.nodes.size() * sizeof(Node) + 12 * order.size());
    }
    result.nodes = static_cast<uint32_t>(wide.nodes.size());
    result.depth = wide.depth;
    result.runs = std::move(wide.runs);
    result.texels = Array<Texel>(result.firstRecord() + 3 * size_t(result.records));
    result.build_bytes =
        std::max(result.build_bytes, result.bytes() + wide.nodes.size() * sizeof(Node) + 4 * order.size());
    std::fill_n(result.texels.begin(), texelsOf(Node::form), Texel{});
    parallelRanges(pool, wide.nodes.size(), grain, [&](size_t begin, size_t end) {
        std::memcpy(&result.texels[texelsOf(Node::form) * (begin + 1)], &wide.nodes[begin],
                    (end - begin) * sizeof(Node));
    });
    return order;
}

template <class Reader>
Expected<Hierarchy> build(std::span<const typename Reader::Geometry> geometries, BuildMode mode, ThreadPool* pool,
                          NodeForm form) {
    const std::vector<uint64_t> first = firstPrimitives(geometries, Reader::count);
    if (first.back() > max_primitives) {
        return unexpected(makeError(ErrorCode::OutOfRange, "tracing.too_large",
                                    "{} primitives in a structure, at most {} are possible", first.back(),
                                    max_primitives));
    }
    Expected<Gathered> gathered = gather<Reader>(geometries, first, pool);
    if (!gathered) return unexpected(gathered.error());

    Hierarchy result;
    result.kind = Reader::kind;
    result.form = form;
    result.inactive = static_cast<uint32_t>(first.back()) - gathered->active;
    if (Reader::kind == Hierarchy::Kind::Triangles && mode == BuildMode::Split) {
        gathered->refs = splitBoxes(
            std::move(gathered->refs), gathered->bounds, max_primitives - gathered->active,
            [&](uint32_t id, float values[9]) {
                const size_t g = std::upper_bound(first.begin(), first.end(), id) - first.begin() - 1;
                if (geometries[g].opaque) Reader::read(geometries[g], static_cast<uint32_t>(id - first[g]), values);
                return geometries[g].opaque;
            },
            pool);
        gathered->active = static_cast<uint32_t>(gathered->refs.size());
    }
    result.records = gathered->active;
    const Grid grid = makeGrid(gathered->bounds);
    const Box4 bounds = gathered->bounds;
    const Array<uint32_t> order = form == NodeForm::Packed
                                      ? buildNodes<Node>(std::move(*gathered), grid, mode, pool, result)
                                      : buildNodes<FullNode>(std::move(*gathered), grid, mode, pool, result);
    writeHeader(result, grid, bounds);
    parallelRanges(pool, order.size(), grain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            const size_t g = std::upper_bound(first.begin(), first.end(), order[i]) - first.begin() - 1;
            Record record = {};
            record.row = order[i];
            record.primitive = static_cast<uint32_t>(order[i] - first[g]);
            record.geometry = static_cast<uint32_t>(g) | (geometries[g].opaque ? Record::opaque_bit : 0);
            Reader::read(geometries[g], record.primitive, record.values);
            std::memcpy(&result.texels[result.firstRecord() + 3 * i], &record, sizeof(Record));
        }
    });
    return result;
}

}  // namespace

void writeHeader(Hierarchy& hierarchy, const Grid& grid, const Box4& bounds) {
    Header header = {};
    std::memcpy(header.minimum, grid.minimum, sizeof(header.minimum));
    header.step = grid.step;
    header.scale_bits = std::bit_cast<uint32_t>(grid.step) - (uint32_t(exponent_bias) << 23);
    header.nodes = hierarchy.nodes;
    header.first_record = static_cast<uint32_t>(hierarchy.firstRecord());
    header.records = hierarchy.records;
    float lo[4];
    float hi[4];
    bounds.lo.store(lo);
    bounds.hi.store(hi);
    std::memcpy(header.lo, lo, sizeof(header.lo));
    std::memcpy(header.hi, hi, sizeof(header.hi));
    header.kind = static_cast<uint32_t>(hierarchy.kind);
    std::memcpy(hierarchy.texels.data(), &header, sizeof(header));
}

Expected<Hierarchy> buildHierarchy(std::span<const TriangleGeometry> geometries, BuildMode mode, ThreadPool* pool,
                                   NodeForm form) {
    return build<TriangleReader>(geometries, mode, pool, form);
}

Expected<Hierarchy> buildHierarchy(std::span<const BoxGeometry> geometries, BuildMode mode, ThreadPool* pool,
                                   NodeForm form) {
    return build<BoxReader>(geometries, mode, pool, form);
}

}  // namespace glint::detail
