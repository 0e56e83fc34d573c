#include <glint/format/detail/splat_blocks.h>

#include <glint/base/format_error.h>
#include <glint/base/thread_pool.h>

#include <sys/mman.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <deque>
#include <limits>
#include <new>
#include <optional>
#include <type_traits>

namespace glint::detail {

namespace {

/// Bit 31 is set if the number is NaN or infinite.
uint32_t markSpecial(float value) { return (std::bit_cast<uint32_t>(value) & 0x7fffffffu) + 0x00800000u; }

bool isSpecial(const Vector3f& v) { return ((markSpecial(v.x) | markSpecial(v.y) | markSpecial(v.z)) >> 31) != 0; }

/// True if one of the numbers is NaN or infinite. The numbers may be followed by some that are not meant, and looked at
/// all the same: `values` has `count` rounded up to 16.
bool mayHaveSpecial(const float* values, size_t count) {
    uint32_t marks[16] = {};
    for (size_t i = 0; i < count; i += 16)
        for (size_t k = 0; k < 16; k++) marks[k] |= markSpecial(values[i + k]);
    uint32_t all = 0;
    for (const uint32_t mark : marks) all |= mark;
    return (all >> 31) != 0;
}

/// Makes the pages that an append is about to write, in one call instead of a fault for each: most of the time that
/// large scenes take goes into new pages. Systems that cannot do it leave it to the faults.
template <class T>
void populateNext([[maybe_unused]] const std::vector<T>& values, [[maybe_unused]] size_t count) {
#ifdef MADV_POPULATE_WRITE
    constexpr uintptr_t page = 4096;
    const auto begin = reinterpret_cast<uintptr_t>(values.data() + values.size()) / page * page;
    const auto end = (reinterpret_cast<uintptr_t>(values.data() + values.size() + count) + page - 1) / page * page;
    ::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_POPULATE_WRITE);
#endif
}

/// Judges the splats of a block and brings them to the form of Splats.
class SplatJudge {
public:
    explicit SplatJudge(const SplatSource& source) : source_(source) {
        const size_t coefficients = (source.degree + 1) * (source.degree + 1);
        // A multiple of 16 floats.
        block_.harmonics.resize(SplatBlock::capacity * coefficients);
        block_.splats.resize(SplatBlock::capacity);
        made_.degree = source.degree;
        made_.positions.resize(SplatBlock::capacity);
        made_.scales.resize(SplatBlock::capacity);
        made_.rotations.resize(SplatBlock::capacity);
        made_.opacities.resize(SplatBlock::capacity);
    }

    Status read(uint64_t first, uint32_t count) {
        report_ = {};
        kept_ = 0;
        if (Status status = source_.read(first, count, block_); !status) return status;
        const size_t coefficients = made_.coefficientCount();
        const bool is_suspect = mayHaveSpecial(&block_.harmonics[0].x, count * coefficients * 3);
        for (uint32_t i = 0; i < count; i++) {
            const auto harmonics = block_.harmonics.begin() + static_cast<std::ptrdiff_t>(i * coefficients);
            const bool is_bad = is_suspect && std::any_of(harmonics, harmonics + coefficients, isSpecial);
            if (!add(block_.splats[i], is_bad)) continue;
            if (kept_ != i)
                std::copy_n(harmonics, coefficients,
                            block_.harmonics.begin() + static_cast<std::ptrdiff_t>(kept_ * coefficients));
            kept_++;
        }
        report_.splats = count;
        return {};
    }

    void appendTo(Splats& splats, SplatReport& report) const {
        append(splats.positions, made_.positions, kept_);
        append(splats.scales, made_.scales, kept_);
        append(splats.rotations, made_.rotations, kept_);
        append(splats.opacities, made_.opacities, kept_);
        append(splats.harmonics, block_.harmonics, kept_ * made_.coefficientCount());
        report.splats += report_.splats;
        const auto addCounts = [](SplatReport::Counts& to, const SplatReport::Counts& from) {
            to.position += from.position;
            to.scale += from.scale;
            to.rotation += from.rotation;
            to.opacity += from.opacity;
            to.harmonics += from.harmonics;
        };
        addCounts(report.dropped, report_.dropped);
        addCounts(report.repaired, report_.repaired);
    }

private:
    template <class T>
    static void append(std::vector<T>& to, const std::vector<T>& from, size_t count) {
        static_assert(std::is_trivial_v<T>, "copied as bytes");
        populateNext(to, count);
        to.insert(to.end(), from.begin(), from.begin() + static_cast<std::ptrdiff_t>(count));
    }

    /// Makes splat `kept_`, unless it is dropped.
    bool add(const FileSplat& splat, bool has_bad_harmonics) {
        const bool is_logarithmic = source_.is_logarithmic;
        Vector3f scale = splat.scale;
        float opacity = splat.opacity;
        if (is_logarithmic) {
            scale = {std::exp(scale.x), std::exp(scale.y), std::exp(scale.z)};
            opacity = 1.0f / (1.0f + std::exp(-opacity));
        }
        // In float64 no square overflows or vanishes: only a quaternion of zeros has the length 0.
        const Vector4d q(splat.quaternion);
        const double square = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
        Vector4f rotation(q * (1.0 / std::sqrt(square)));

        const bool is_good = !has_bad_harmonics && isFinite(splat.position) && isFinite(splat.scale) &&
                             isFinite(scale) && std::min({scale.x, scale.y, scale.z}) >= 0.0f &&
                             std::isfinite(square) && square > 0.0 && std::isfinite(splat.opacity) && opacity >= 0.0f &&
                             opacity <= 1.0f;
        if (!is_good) {
            uint64_t* repaired = nullptr;
            const auto repair = [&repaired](uint64_t& count) {
                if (!repaired) repaired = &count;
            };
            const auto drop = [](uint64_t& count) {
                count++;
                return false;
            };
            if (!isFinite(splat.position)) return drop(report_.dropped.position);
            if (!isFinite(scale) || std::min({scale.x, scale.y, scale.z}) < 0.0f) return drop(report_.dropped.scale);
            if (!isFinite(splat.scale)) repair(report_.repaired.scale);
            if (!std::isfinite(square)) return drop(report_.dropped.rotation);
            if (square == 0.0) {
                rotation = {0, 0, 0, 1};
                repair(report_.repaired.rotation);
            }
            if (!(opacity >= 0.0f && opacity <= 1.0f)) return drop(report_.dropped.opacity);
            if (!std::isfinite(splat.opacity)) repair(report_.repaired.opacity);
            if (has_bad_harmonics) return drop(report_.dropped.harmonics);
            if (repaired) (*repaired)++;
        }
        made_.positions[kept_] = splat.position;
        made_.scales[kept_] = scale;
        made_.rotations[kept_] = rotation;
        made_.opacities[kept_] = opacity;
        return true;
    }

    const SplatSource& source_;
    SplatBlock block_;
    Splats made_;  // but for the harmonics, which stay in the block
    size_t kept_ = 0;
    SplatReport report_;
};

struct Slot {
    explicit Slot(const SplatSource& source) : judge(source) {}

    SplatJudge judge;
    Status status;
    std::atomic<bool> is_ready = false;
};

}  // namespace

Status checkSplatBytes(const SplatSource& source, uint64_t limit) {
    const uint64_t size = sizeof(FileSplat) + (source.degree + 1) * (source.degree + 1) * sizeof(Vector3f);
    if (source.count <= limit / size) return {};
    return Error::inFile(
        ErrorCode::OutOfRange, "splats.too_large",
        fmt::format("{} splats of {} bytes take more than the limit of {} bytes", source.count, size, limit),
        source.name, 0);
}

Expected<Splats> readSplats(const SplatSource& source, uint64_t limit, SplatReport* report) {
    if (Status status = checkSplatBytes(source, limit); !status) return unexpected(status.error());
    Splats splats;
    splats.degree = source.degree;
    try {
        splats.positions.reserve(source.count);
        splats.scales.reserve(source.count);
        splats.rotations.reserve(source.count);
        splats.opacities.reserve(source.count);
        splats.harmonics.reserve(source.count * splats.coefficientCount());
    } catch (const std::bad_alloc&) {
        return unexpected(Error::inFile(ErrorCode::OutOfMemory, "splats.out_of_memory",
                                        fmt::format("the host has no memory for {} splats", source.count), source.name,
                                        0));
    }

    // Threads read and judge blocks, this one appends them in order. More than a few would only wait for it.
    constexpr uint64_t capacity = SplatBlock::capacity;
    const uint64_t blocks = (source.count + capacity - 1) / capacity;
    const auto threads = static_cast<uint32_t>(
        std::min<uint64_t>(std::clamp(std::thread::hardware_concurrency(), 1u, 4u), blocks > 1 ? blocks : 0));
    std::deque<Slot> slots;
    for (uint64_t i = 0; i < std::min<uint64_t>(2 * threads + 1, blocks); i++) slots.emplace_back(source);
    std::optional<ThreadPool> pool;  // ends before the slots do
    if (threads > 0) pool.emplace(threads);
    const auto start = [&](uint64_t block) {
        Slot& slot = slots[block % slots.size()];
        const uint64_t first = block * capacity;
        const auto count = static_cast<uint32_t>(std::min(capacity, source.count - first));
        const auto work = [&slot, first, count] {
            slot.status = slot.judge.read(first, count);
            slot.is_ready.store(true, std::memory_order_release);
            slot.is_ready.notify_one();
        };
        if (pool)
            pool->submit(work);
        else
            work();
    };
    for (uint64_t i = 0; i < slots.size(); i++) start(i);
    SplatReport total;
    for (uint64_t i = 0; i < blocks; i++) {
        Slot& slot = slots[i % slots.size()];
        slot.is_ready.wait(false, std::memory_order_acquire);
        if (!slot.status) return unexpected(slot.status.error());
        slot.judge.appendTo(splats, total);
        slot.is_ready.store(false, std::memory_order_relaxed);
        if (i + slots.size() < blocks) start(i + slots.size());
    }
    if (report) *report = total;
    return splats;
}

}  // namespace glint::detail
