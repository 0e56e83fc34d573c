#include <glint/tracing/detail/splits.h>

#include <glint/tracing/detail/parallel.h>

#include <cmath>
#include <limits>

namespace glint::detail {

namespace {

constexpr size_t grain = 4096;
constexpr double most_more = 0.6;  // 48 + 12 bytes each: below 100 bytes a triangle
constexpr uint32_t most_cuts = 63;
/// Surface that a cut may leave. Half a right triangle's box is empty, and 0.75 stay after a cut; a diagonal's 0.5.
constexpr double most_left = 0.65;
/// Empty surface of a box worth cutting, in those that the scene's surface has for each triangle: smaller boxes are met
/// by few rays.
constexpr double least_empty = 4.0;
constexpr int levels = 20;

struct Box {
    double lo[3];
    double hi[3];

    double extent(int axis) const { return std::max(hi[axis] - lo[axis], 0.0); }
    double longest() const { return std::max({extent(0), extent(1), extent(2)}); }
    double surface() const { return 2.0 * (extent(0) * extent(1) + extent(1) * extent(2) + extent(2) * extent(0)); }
    bool isEmpty() const { return lo[0] > hi[0] || lo[1] > hi[1] || lo[2] > hi[2]; }
};

Box boxOf(const float lo[4], const float hi[4]) { return {{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}}; }

/// A plane through a box, of a grid that halves the scene's cube again and again: boxes that are near are cut at the
/// same ones. The coarsest; across the longest side of those.
struct Cut {
    int axis = -1;
    int level = levels + 1;
    double place = 0.0;
};

Cut cutOf(const Box& box, const Box& scene) {
    Cut cut;
    const double cube = scene.longest() * 1.0001;
    for (int axis = 0; axis < 3; axis++) {
        const double lo = (box.lo[axis] - scene.lo[axis]) / cube;
        const double hi = (box.hi[axis] - scene.lo[axis]) / cube;
        for (int level = 1; level <= std::min(cut.level, levels); level++) {
            const double plane = (std::floor(std::ldexp(lo, level)) + 1.0) * std::ldexp(1.0, -level);
            if (plane >= hi) continue;
            if (level < cut.level || box.extent(axis) > box.extent(cut.axis))
                cut = {axis, level, scene.lo[axis] + plane * cube};
            break;
        }
    }
    return cut;
}

/// Of what of a triangle lies in `box`, on one side of a cut.
Box sideOf(const float values[9], const Box& box, const Cut& cut, bool above) {
    Box side = {{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
    const auto add = [&](const double p[3]) {
        for (int axis = 0; axis < 3; axis++) {
            side.lo[axis] = std::min(side.lo[axis], p[axis]);
            side.hi[axis] = std::max(side.hi[axis], p[axis]);
        }
    };
    for (size_t corner = 0; corner < 3; corner++) {
        const float* const from = values + 3 * corner;
        const float* const to = values + 3 * ((corner + 1) % 3);
        const double a = from[cut.axis] - cut.place;
        const double b = to[cut.axis] - cut.place;
        const double p[3] = {from[0], from[1], from[2]};
        if (above ? a >= 0.0 : a <= 0.0) add(p);
        if ((a < 0.0) == (b < 0.0)) continue;
        double crossing[3];
        for (int axis = 0; axis < 3; axis++) crossing[axis] = p[axis] + (double(to[axis]) - p[axis]) * (a / (a - b));
        crossing[cut.axis] = cut.place;
        add(crossing);
    }
    for (int axis = 0; axis < 3; axis++) {
        side.lo[axis] = std::max(side.lo[axis], box.lo[axis]);
        side.hi[axis] = std::min(side.hi[axis], box.hi[axis]);
    }
    return side;
}

struct Halves {
    Box below;
    Box above;
    bool pay = false;
};

Halves halvesOf(const float values[9], const Box& box, const Cut& cut) {
    if (cut.axis < 0) return {};
    Halves halves = {sideOf(values, box, cut, false), sideOf(values, box, cut, true)};
    halves.pay = halves.below.surface() + halves.above.surface() <= most_left * box.surface();
    return halves;
}

/// How much a triangle wants to be cut: the cube root lets the largest not take all (Karras and Aila, 2013).
double priorityOf(const float values[9], const Box& box, const Box& scene, double least) {
    double edges[2][3];
    for (int i = 0; i < 3; i++) {
        edges[0][i] = double(values[3 + i]) - values[i];
        edges[1][i] = double(values[6 + i]) - values[i];
    }
    double filled = 0.0;  // the surface that boxes have that are small against the triangle, along its plane
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3;
        filled += std::abs(edges[0][i] * edges[1][j] - edges[0][j] * edges[1][i]);
    }
    const double empty = box.surface() - filled;
    if (!(empty > least)) return 0.0;
    const Cut cut = cutOf(box, scene);
    if (!halvesOf(values, box, cut).pay) return 0.0;
    return std::cbrt(std::ldexp(empty / scene.surface(), -cut.level));
}

void cutAll(const float values[9], const PrimRef& whole, const Box& box, uint32_t cuts, const Box& scene,
            std::vector<PrimRef>& pieces) {
    const Halves halves = cuts == 0 ? Halves() : halvesOf(values, box, cutOf(box, scene));
    if (halves.pay) {
        const double below = halves.below.longest();
        const double share = below / (below + halves.above.longest());
        const auto first = std::min(cuts - 1, static_cast<uint32_t>(std::lround(share * (cuts - 1))));
        cutAll(values, whole, halves.below, first, scene, pieces);
        cutAll(values, whole, halves.above, cuts - 1 - first, scene, pieces);
        return;
    }
    if (box.isEmpty()) return;
    // Float64's rounding is far below float32's, so one step outwards holds the piece.
    PrimRef piece = whole;
    for (int axis = 0; axis < 3; axis++) {
        constexpr float infinity = std::numeric_limits<float>::infinity();
        piece.lo[axis] = std::max(whole.lo[axis], std::nextafter(static_cast<float>(box.lo[axis]), -infinity));
        piece.hi[axis] = std::min(whole.hi[axis], std::nextafter(static_cast<float>(box.hi[axis]), infinity));
    }
    pieces.push_back(piece);
}

}  // namespace

Array<PrimRef> splitBoxes(Array<PrimRef> refs, const Box4& bounds, size_t room, const SplitCorners& corners,
                          ThreadPool* pool) {
    float lo[4];
    float hi[4];
    bounds.lo.store(lo);
    bounds.hi.store(hi);
    const Box scene = boxOf(lo, hi);
    const size_t count = refs.size();
    const double least = least_empty * scene.surface() / static_cast<double>(count);
    Array<float> priorities(count);
    parallelRanges(pool, count, grain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            float values[9];
            const Box box = boxOf(refs[i].lo, refs[i].hi);
            const bool may = box.surface() > least && corners(refs[i].id(), values);
            priorities[i] = may ? static_cast<float>(priorityOf(values, box, scene, least)) : 0.0f;
        }
    });

    // As many cuts for a priority as the room allows.
    const auto cutsOf = [&](size_t i, double factor) {
        return static_cast<uint32_t>(std::min<double>(most_cuts, priorities[i] * factor));
    };
    const auto total = [&](double factor) {
        uint64_t cuts = 0;
        for (size_t i = 0; i < count; i++) cuts += cutsOf(i, factor);
        return cuts;
    };
    const auto most = std::min<uint64_t>(room, static_cast<uint64_t>(most_more * static_cast<double>(count)));
    double factor = 0.0;
    for (double step = 0x1p24; step > 0x1p-8; step *= 0.5) {
        if (total(factor + step) <= most) factor += step;
    }
    if (total(factor) == 0) return refs;

    std::vector<std::vector<PrimRef>> pieces((count + grain - 1) / grain);
    parallelRanges(pool, count, grain, [&](size_t begin, size_t end) {
        std::vector<PrimRef>& mine = pieces[begin / grain];
        mine.reserve(end - begin);
        for (size_t i = begin; i < end; i++) {
            const uint32_t cuts = cutsOf(i, factor);
            float values[9];
            if (cuts == 0 || !corners(refs[i].id(), values))
                mine.push_back(refs[i]);
            else
                cutAll(values, refs[i], boxOf(refs[i].lo, refs[i].hi), cuts, scene, mine);
        }
    });
    size_t size = 0;
    for (const std::vector<PrimRef>& each : pieces) size += each.size();
    Array<PrimRef> all(size);
    PrimRef* to = all.begin();
    for (const std::vector<PrimRef>& each : pieces) to = std::copy(each.begin(), each.end(), to);
    return all;
}

}  // namespace glint::detail
