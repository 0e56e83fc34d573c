#include <glint/tracing/detail/instances.h>

#include <glint/tracing/detail/header.h>
#include <glint/tracing/detail/parallel.h>
#include <glint/tracing/detail/rounded.h>

#include <cmath>

namespace glint::detail {

namespace {

/// False if there is no inverse in float32.
bool invert(const Transform3x4& transform, float to_object[12]) {
    const auto& m = transform.rows;
    const auto at = [&](int row, int column) { return static_cast<double>(m[4 * row + column]); };
    double inverse[3][3];
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++) {
            const int r1 = (column + 1) % 3;
            const int r2 = (column + 2) % 3;
            const int c1 = (row + 1) % 3;
            const int c2 = (row + 2) % 3;
            inverse[row][column] = at(r1, c1) * at(r2, c2) - at(r1, c2) * at(r2, c1);
        }
    }
    const double determinant = at(0, 0) * inverse[0][0] + at(0, 1) * inverse[1][0] + at(0, 2) * inverse[2][0];
    bool finite = determinant != 0.0;
    for (int row = 0; row < 3; row++) {
        double moved = 0.0;
        for (int column = 0; column < 3; column++) {
            to_object[4 * row + column] = static_cast<float>(inverse[row][column] / determinant);
            moved -= inverse[row][column] / determinant * at(column, 3);
        }
        to_object[4 * row + 3] = static_cast<float>(moved);
        for (int column = 0; column < 4; column++)
            finite = finite && std::isfinite(to_object[4 * row + column]) && std::isfinite(m[4 * row + column]);
    }
    return finite;
}

}  // namespace

BoundBox boundsOf(const Hierarchy& hierarchy) {
    const Header header = readHeader(hierarchy);
    return {Vector3f(header.lo[0], header.lo[1], header.lo[2]), Vector3f(header.hi[0], header.hi[1], header.hi[2])};
}

BoundBox worldBounds(const HierarchyInstance& instance) {
    if (instance.bounds.isEmpty()) return {};
    BoundBox world;
    for (int row = 0; row < 3; row++) {
        const float* m = &instance.transform.rows[size_t(4 * row)];
        double lo = m[3];
        double hi = m[3];
        double size = std::abs(lo);
        for (int column = 0; column < 3; column++) {
            const double a = double(m[column]) * instance.bounds.min[column];
            const double b = double(m[column]) * instance.bounds.max[column];
            lo += std::min(a, b);
            hi += std::max(a, b);
            size += std::max(std::abs(a), std::abs(b));
        }
        // The products are exact, each of the three sums is off by 2^-53 of its size at most.
        world.min[row] = roundedDown(lo - size * 0x1p-51);
        world.max[row] = roundedUp(hi + size * 0x1p-51);
    }
    return world;
}

Expected<Hierarchy> buildHierarchy(std::span<const HierarchyInstance> instances, BuildMode mode, ThreadPool* pool,
                                   NodeForm form) {
    Array<float> boxes(6 * instances.size());
    Array<InstanceRecord> records(instances.size());
    parallelRanges(pool, instances.size(), 1024, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            const HierarchyInstance& instance = instances[i];
            InstanceRecord& record = records[i] = {};
            std::copy(instance.transform.rows.begin(), instance.transform.rows.end(), record.to_world);
            const bool usable = invert(instance.transform, record.to_object);
            record.texel = instance.texel;
            record.custom_index_mask = instance.custom_index | instance.mask << 24;
            record.offset_flags = instance.offset | instance.flags << 24;
            const BoundBox world = usable ? worldBounds(instance) : BoundBox();
            for (int axis = 0; axis < 3; axis++) {
                boxes[6 * i + axis] = world.min[axis];
                boxes[6 * i + 3 + axis] = world.max[axis];
            }
        }
    });
    BoxGeometry geometry;
    geometry.boxes = reinterpret_cast<const std::byte*>(boxes.data());
    geometry.count = static_cast<uint32_t>(instances.size());
    Expected<Hierarchy> hierarchy = buildHierarchy(std::span<const BoxGeometry>(&geometry, 1), mode, pool, form);
    if (!hierarchy) return hierarchy;

    const Array<Texel> nodes = std::move(hierarchy->texels);
    hierarchy->texels = Array<Texel>(nodes.size() + 8 * instances.size());
    std::copy(nodes.begin(), nodes.end(), hierarchy->texels.begin());
    std::memcpy(hierarchy->texels.data() + nodes.size(), records.data(), records.size() * sizeof(InstanceRecord));
    hierarchy->kind = Hierarchy::Kind::Instances;
    Header header = readHeader(*hierarchy);
    header.kind = static_cast<uint32_t>(hierarchy->kind);
    header.first_instance = static_cast<uint32_t>(nodes.size());
    std::memcpy(hierarchy->texels.data(), &header, sizeof(header));
    return hierarchy;
}

}  // namespace glint::detail
