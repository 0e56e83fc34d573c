#include <glint/tracing/detail/node.h>

#include <glint/tracing/detail/rounded.h>

#include <bit>
#include <cmath>

namespace glint::detail {

namespace {

double powerOfTwo(int exponent) { return std::bit_cast<double>(static_cast<uint64_t>(exponent + 1023) << 52); }

// A node begins below its boxes by one unit of its scale, which is 2^12 steps at most, and a step for rounding.
constexpr double margin_steps = 4097.0;

/// The plane of child s in units of the node's scale: its byte, and those before it as a fraction.
double planeOf(const uint32_t words[2], uint32_t s) {
    return 128.0 + static_cast<int32_t>(words[s / 4] << (24 - 8 * (s & 3))) * 0x1p-24;
}

/// Smallest e with x <= 2^e, for finite x >= 0.
int exponentAbove(double x) {
    if (x <= 0.0) return -1022;
    const auto bits = std::bit_cast<uint64_t>(x);
    const int e = static_cast<int>(bits >> 52) - 1023;
    return (bits & 0xfffffffffffffu) != 0 ? e + 1 : e;
}

}  // namespace

Grid makeGrid(const Box4& bounds) {
    float lo[4];
    float hi[4];
    bounds.lo.store(lo);
    bounds.hi.store(hi);
    if (!(lo[0] <= hi[0])) return {};
    double extent = 0.0;
    double farthest = 0.0;
    for (int axis = 0; axis < 3; axis++) {
        extent = std::max(extent, double(hi[axis]) - lo[axis]);
        farthest = std::max({farthest, std::abs(double(lo[axis])), std::abs(double(hi[axis]))});
    }
    // 2^19 steps and one for the rounding of the minimum fit into 20 bits. Coordinates are below 2^22 steps, so those
    // of the origins, at most two steps beyond them, have 24 bits. Scales, from step * 2^-2 to step * 2^13, are normal
    // numbers.
    const int step = std::max({exponentAbove(extent) - 19, exponentAbove(farthest) - 22, -100});
    Grid grid;
    grid.step = static_cast<float>(powerOfTwo(step));
    const double inverse = powerOfTwo(-step);
    for (int axis = 0; axis < 3; axis++) {
        const double below = std::floor(lo[axis] * inverse) - margin_steps;
        grid.minimum[axis] = static_cast<float>(below * powerOfTwo(step));
    }
    return grid;
}

void Node::box(const Grid& grid, uint32_t s, double lo[3], double hi[3]) const {
    const uint32_t origin[3] = {words[0] & 0xfffffu, words[1] & 0xfffffu,
                                words[0] >> 24 | words[1] >> 24 << 8 | (words[3] & 15u) << 16};
    const uint32_t exponent[3] = {words[0] >> 20 & 15u, words[1] >> 20 & 15u, words[3] >> 4 & 15u};
    for (uint32_t axis = 0; axis < 3; axis++) {
        const double base = double(grid.minimum[axis]) + double(origin[axis]) * double(grid.step);
        const double scale = double(grid.step) * powerOfTwo(static_cast<int>(exponent[axis]) - exponent_bias);
        lo[axis] = base + scale * planeOf(words + 4 + 4 * axis, s);
        hi[axis] = base + scale * planeOf(words + 6 + 4 * axis, s);
    }
}

Node Node::encode(const Grid& grid, const Box4* boxes, uint32_t count, uint32_t leaves, uint32_t first_node,
                  uint32_t first_record) {
    float lo[width][4];
    float hi[width][4];
    Box4 all;
    for (uint32_t s = 0; s < count; s++) {
        boxes[s].lo.store(lo[s]);
        boxes[s].hi.store(hi[s]);
        all.add(boxes[s]);
    }
    float all_lo[4];
    float all_hi[4];
    all.lo.store(all_lo);
    all.hi.store(all_hi);

    Node node = {};
    uint32_t origins[3] = {};
    uint32_t exponents[3] = {};
    constexpr double units[4] = {1.0, 0x1p-8, 0x1p-16, 0x1p-24};
    const double step = grid.step;
    const double inverse_step = 1.0 / step;
    const int step_exponent = static_cast<int>(std::bit_cast<uint64_t>(step) >> 52) - 1023;
    for (uint32_t axis = 0; axis < 3; axis++) {
        uint32_t* planes = node.words + 4 + 4 * axis;
        if (!(all_lo[axis] <= all_hi[axis])) continue;
        // Differences of floats may need more than 53 bits; products of powers of two and the planes themselves do not.
        // So the quotients may be rounded across a whole number, and comparing with the planes sets that right.
        const double minimum = grid.minimum[axis];
        const double extent = double(all_hi[axis]) - all_lo[axis];
        int exponent = std::max(exponentAbove(extent * (1.0 / 254.0)), step_exponent - exponent_bias);
        int64_t origin;
        double base;
        double scale;
        do {
            scale = powerOfTwo(exponent++);
            origin = static_cast<int64_t>((all_lo[axis] - scale - minimum) * inverse_step);
            if (minimum + static_cast<double>(origin) * step > all_lo[axis] - scale) origin--;
            base = minimum + static_cast<double>(origin) * step;
        } while (base + 255.0 * scale < all_hi[axis]);
        const double inverse = 1.0 / scale;
        origins[axis] = static_cast<uint32_t>(origin);
        exponents[axis] = static_cast<uint32_t>(exponent - 1 - step_exponent + exponent_bias);
        // A byte depends on those before it in its word, which makes one long chain of each word: two at a time.
        for (uint32_t byte = 0; byte < 4; byte++) {
            const uint32_t shift = 8 * byte;
            const uint32_t before = (1u << shift) - 1;
            const double unit = units[byte];
            for (uint32_t s = byte; s < count; s += 4) {
                const bool empty = !(lo[s][axis] <= hi[s][axis]);
                const double low = empty ? all_lo[axis] : lo[s][axis];
                const double high = empty ? all_lo[axis] : hi[s][axis];
                const double low_part = static_cast<int32_t>(planes[s / 4] & before) * unit;
                const double high_part = static_cast<int32_t>(planes[2 + s / 4] & before) * unit;
                auto below = static_cast<int32_t>((low - base) * inverse - low_part);
                below -= base + (below + low_part) * scale > low ? 1 : 0;
                auto above = static_cast<int32_t>((high - base) * inverse - high_part);
                above += base + (above + high_part) * scale < high ? 1 : 0;
                planes[s / 4] |= (static_cast<uint32_t>(below) ^ 128u) << shift;
                planes[2 + s / 4] |= (static_cast<uint32_t>(above) ^ 128u) << shift;
            }
        }
    }
    node.words[0] = origins[0] | exponents[0] << 20 | (origins[2] & 255u) << 24;
    node.words[1] = origins[1] | exponents[1] << 20 | (origins[2] >> 8 & 255u) << 24;
    node.words[2] = leaves | count << 4 | (first_node - leaves) << 8;
    node.words[3] = origins[2] >> 16 | exponents[2] << 4 | first_record << 8;
    return node;
}

void FullNode::box(const Grid& grid, uint32_t s, double lo[3], double hi[3]) const {
    for (uint32_t axis = 0; axis < 3; axis++) {
        lo[axis] = double(grid.minimum[axis]) + std::bit_cast<float>(words[4 + 8 * axis + s]);
        hi[axis] = double(grid.minimum[axis]) + std::bit_cast<float>(words[8 + 8 * axis + s]);
    }
}

FullNode FullNode::encode(const Grid& grid, const Box4* boxes, uint32_t count, uint32_t leaves, uint32_t first_node,
                          uint32_t first_record) {
    FullNode node = {};
    node.words[2] = leaves | count << 4 | (first_node - leaves) << 8;
    node.words[3] = first_record << 8;
    for (uint32_t s = 0; s < count; s++) {
        float lo[4];
        float hi[4];
        boxes[s].lo.store(lo);
        boxes[s].hi.store(hi);
        for (uint32_t axis = 0; axis < 3; axis++) {
            node.words[4 + 8 * axis + s] = std::bit_cast<uint32_t>(differenceDown(lo[axis], grid.minimum[axis]));
            node.words[8 + 8 * axis + s] = std::bit_cast<uint32_t>(differenceUp(hi[axis], grid.minimum[axis]));
        }
    }
    return node;
}

}  // namespace glint::detail
