#include <glint/tracing/detail/header.h>
#include <glint/tracing/detail/hierarchy.h>
#include <glint/tracing/detail/parallel.h>
#include <glint/tracing/detail/primitives.h>

namespace glint::detail {

namespace {

template <class Reader, class Node>
class Refit {
public:
    Refit(Hierarchy& hierarchy, std::span<const typename Reader::Geometry> geometries, ThreadPool* pool)
        : hierarchy_(hierarchy), geometries_(geometries), pool_(pool), boxes_(size_t(hierarchy.nodes) + 1) {}

    void run() {
        const Box4 bounds = readAll();
        const Grid grid = makeGrid(bounds);
        writeHeader(hierarchy_, grid, bounds);
        // Children come after their parents, and those of a run's nodes are in the run itself; so backwards, the runs
        // before the top.
        const std::vector<uint32_t>& runs = hierarchy_.runs;
        parallelFor(pool_, runs.size() - 2, [&](size_t i) { encode(grid, runs[i + 1], runs[i + 2]); });
        encode(grid, runs[0], runs[1]);
    }

private:
    Texel* recordAt(size_t i) { return &hierarchy_.texels[hierarchy_.firstRecord() + 3 * i]; }

    /// Takes the coordinates of all primitives, and returns their box. The grid has to be known before the first node
    /// is encoded; and in a loop of its own a read need not wait for the one before, wherever the corners are.
    Box4 readAll() {
        constexpr size_t grain = 4096;
        std::vector<Box4> boxes((hierarchy_.records + grain - 1) / grain);
        parallelRanges(pool_, hierarchy_.records, grain, [&](size_t begin, size_t end) {
            Box4 box;
            for (size_t i = begin; i < end; i++) {
                Record record;
                std::memcpy(&record, recordAt(i), sizeof(Record));
                Reader::read(geometries_[record.geometry & ~Record::opaque_bit], record.primitive, record.values);
                std::memcpy(recordAt(i), record.values, sizeof(record.values));
                if (Reader::active(record.values)) box.add(Reader::box(record.values));
            }
            boxes[begin / grain] = box;
        });
        Box4 bounds;
        for (const Box4& box : boxes) bounds.add(box);
        return bounds;
    }

    void encode(const Grid& grid, size_t begin, size_t end) {
        for (size_t place = end; place-- > begin;) {
            Node node;
            std::memcpy(&node, &hierarchy_.texels[texelsOf(Node::form) * (place + 1)], sizeof(Node));
            const uint32_t children = node.children();
            const uint32_t leaves = node.leaves();
            Box4 boxes[Node::width];
            for (uint32_t s = 0; s < leaves; s++) {
                float values[9];
                std::memcpy(values, recordAt(node.record() + s), sizeof(values));
                if (Reader::active(values)) boxes[s] = Reader::box(values);
            }
            for (uint32_t s = leaves; s < children; s++) boxes[s] = boxes_[node.child(s)];
            Box4 all;
            for (uint32_t s = 0; s < children; s++) all.add(boxes[s]);
            boxes_[place + 1] = all;
            const Node encoded = Node::encode(grid, boxes, children, leaves, node.child(leaves), node.record());
            std::memcpy(&hierarchy_.texels[texelsOf(Node::form) * (place + 1)], &encoded, sizeof(Node));
        }
    }

    Hierarchy& hierarchy_;
    const std::span<const typename Reader::Geometry> geometries_;
    ThreadPool* const pool_;
    Array<Box4> boxes_;  ///< of node i
};

template <class Reader>
Status refit(Hierarchy& hierarchy, std::span<const typename Reader::Geometry> geometries, ThreadPool* pool) {
    const uint64_t count = firstPrimitives(geometries, Reader::count).back();
    const uint64_t expected = uint64_t(hierarchy.records) + hierarchy.inactive;
    if (hierarchy.kind != Reader::kind || count != expected) {
        return makeError(ErrorCode::InvalidArgument, "tracing.refit",
                         "a structure of {} primitives cannot take the coordinates of {}{}", expected, count,
                         hierarchy.kind != Reader::kind ? " of another kind" : "");
    }
    if (hierarchy.form == NodeForm::Packed)
        Refit<Reader, Node>(hierarchy, geometries, pool).run();
    else
        Refit<Reader, FullNode>(hierarchy, geometries, pool).run();
    return {};
}

}  // namespace

Status refitHierarchy(Hierarchy& hierarchy, std::span<const TriangleGeometry> geometries, ThreadPool* pool) {
    return refit<TriangleReader>(hierarchy, geometries, pool);
}

Status refitHierarchy(Hierarchy& hierarchy, std::span<const BoxGeometry> geometries, ThreadPool* pool) {
    return refit<BoxReader>(hierarchy, geometries, pool);
}

}  // namespace glint::detail
