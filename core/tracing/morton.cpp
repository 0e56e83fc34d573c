#include <glint/tracing/detail/binary_tree.h>
#include <glint/tracing/detail/parallel.h>

#include <array>
#include <cstring>

namespace glint::detail {

namespace {

constexpr uint32_t digit_bits = 10;
constexpr uint32_t digits = 1u << digit_bits;
constexpr size_t grain = 16384;

/// Two zero bits between each two of the lower ten.
uint32_t spread(uint32_t x) {
    x = (x | x << 16) & 0x030000ffu;
    x = (x | x << 8) & 0x0300f00fu;
    x = (x | x << 4) & 0x030c30c3u;
    return (x | x << 2) & 0x09249249u;
}

struct Key {
    uint32_t code;
    uint32_t ref;
};

/// One stable pass of a radix sort.
void sortDigit(const Array<Key>& from, Array<Key>& to, uint32_t shift, ThreadPool* pool) {
    const size_t count = from.size();
    std::vector<std::array<uint32_t, digits>> counts((count + grain - 1) / grain);
    const auto digit = [&](const Key& key) { return key.code >> shift & (digits - 1); };
    parallelRanges(pool, count, grain, [&](size_t begin, size_t end) {
        std::array<uint32_t, digits>& mine = counts[begin / grain];
        for (size_t i = begin; i < end; i++) mine[digit(from[i])]++;
    });
    uint32_t before = 0;
    for (uint32_t d = 0; d < digits; d++) {
        for (std::array<uint32_t, digits>& piece : counts) before += std::exchange(piece[d], before);
    }
    parallelRanges(pool, count, grain, [&](size_t begin, size_t end) {
        std::array<uint32_t, digits>& place = counts[begin / grain];
        for (size_t i = begin; i < end; i++) to[place[digit(from[i])]++] = from[i];
    });
}

}  // namespace

Array<uint32_t> sortByCode(Array<PrimRef>& refs, const Box4& bounds, ThreadPool* pool) {
    const size_t count = refs.size();
    float size[4];
    (bounds.hi - bounds.lo).store(size);
    const float extent = std::max({size[0], size[1], size[2]});
    // Twice the centres, less twice the minimum; the same scale along all axes, so that cells are cubes.
    const float factor = extent > 1e-30f ? 512.0f / extent : 0.0f;
    const Float4 origin = bounds.lo + bounds.lo;

    Array<Key> keys(count);
    Array<Key> other(count);
    parallelRanges(pool, count, grain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            int32_t at[4];
            const Float4 position = (refs[i].center() - origin) * Float4::all(factor);
            min(max(position, Float4::all(0.0f)), Float4::all(1023.0f)).truncate(at);
            keys[i] = {spread(at[0]) << 2 | spread(at[1]) << 1 | spread(at[2]), static_cast<uint32_t>(i)};
        }
    });
    sortDigit(keys, other, 0, pool);
    sortDigit(other, keys, digit_bits, pool);
    sortDigit(keys, other, 2 * digit_bits, pool);

    Array<PrimRef> sorted(count);
    Array<uint32_t> codes(count);
    parallelRanges(pool, count, grain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            sorted[i] = refs[other[i].ref];
            codes[i] = other[i].code;
        }
    });
    refs = std::move(sorted);
    return codes;
}

}  // namespace glint::detail
