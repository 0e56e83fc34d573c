#include <glint/tracing/detail/header.h>
#include <glint/tracing/detail/hierarchy.h>
#include <glint/tracing/detail/parallel.h>
#include <glint/tracing/detail/primitives.h>

namespace glint::detail {

namespace {

template <class Reader>
class Refit {
public:
    Refit(Hierarchy& hierarchy, std::span<const typename Reader::Geometry> geometries, ThreadPool* pool)
        : hierarchy_(hierarchy), geometries_(geometries), pool_(pool), boxes_(size_t(hierarchy.nodes) + 1) {}

    void run() {
        // Children come after their parents, and those of a run's nodes are in the run itself; so backwards, the runs
        // before the top.
        const std::vector<uint32_t>& runs = hierarchy_.runs;
        parallelFor(pool_, runs.size() - 2, [&](size_t i) { measure(runs[i + 1], runs[i + 2]); });
        measure(runs[0], runs[1]);
        const Grid grid = makeGrid(boxes_[1]);
        writeHeader(hierarchy_, grid, boxes_[1]);
        parallelRanges(pool_, hierarchy_.nodes, 1024, [&](size_t begin, size_t end) { encode(grid, begin, end); });
    }

private:
    Node node(size_t place) const {
        Node node;
        std::memcpy(&node, &hierarchy_.texels[4 * (place + 1)], sizeof(Node));
        return node;
    }
    Texel* recordAt(uint32_t i) { return &hierarchy_.texels[hierarchy_.firstRecord() + 3 * size_t(i)]; }

    /// Reads the primitives of the nodes [begin, end) again, and finds the boxes of the nodes.
    void measure(size_t begin, size_t end) {
        for (size_t place = end; place-- > begin;) {
            const Node node = this->node(place);
            Box4 box;
            for (uint32_t s = 0; s < node.leaves(); s++) {
                Record record;
                std::memcpy(&record, recordAt(node.record() + s), sizeof(Record));
                Reader::read(geometries_[record.geometry & ~Record::opaque_bit], record.primitive, record.values);
                std::memcpy(recordAt(node.record() + s), &record, sizeof(Record));
                if (Reader::active(record.values)) box.add(Reader::box(record.values));
            }
            const uint32_t children = node.children();
            for (uint32_t s = node.leaves(); s < children; s++) box.add(boxes_[node.child(s)]);
            boxes_[place + 1] = box;
        }
    }

    void encode(const Grid& grid, size_t begin, size_t end) {
        for (size_t place = begin; place < end; place++) {
            const Node old = node(place);
            const uint32_t children = old.children();
            Box4 boxes[node_width];
            for (uint32_t s = 0; s < children; s++) {
                if (s >= old.leaves()) {
                    boxes[s] = boxes_[old.child(s)];
                    continue;
                }
                Record record;
                std::memcpy(&record, recordAt(old.record() + s), sizeof(Record));
                if (Reader::active(record.values)) boxes[s] = Reader::box(record.values);
            }
            const Node encoded = encodeNode(grid, boxes, children, old.leaves(), old.child(old.leaves()), old.record());
            std::memcpy(&hierarchy_.texels[4 * (place + 1)], &encoded, sizeof(Node));
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
    Refit<Reader>(hierarchy, geometries, pool).run();
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
