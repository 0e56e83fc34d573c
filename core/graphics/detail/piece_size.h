#pragma once

#include <algorithm>
#include <cstdint>

namespace glint::detail {

/// How many rays to hand to a device at once, by the time that earlier pieces took: about 25 ms, so that rays that are
/// four times as dear still end within 100 ms. Watchdogs of systems end dispatches after seconds, and nothing can be
/// interrupted within one.
class PieceSize {
public:
    static constexpr double target = 0.025;  ///< seconds
    static constexpr uint32_t least = 64;    ///< rays, of the first piece too: one group of the kernel
    static constexpr uint32_t growth = 8;

    /// Rays of the next piece, at most `most`.
    uint32_t next(uint32_t most) const { return std::min(size_, most); }

    /// A piece of `count` rays took `seconds`. One that took too long shrinks the next in proportion; any other may
    /// grow it, never shrink it: a short piece at the end of an array says little about long ones.
    void add(uint32_t count, double seconds) {
        const double share = target / std::max(seconds, 1e-9);
        const double rays = static_cast<double>(count) * std::min<double>(share, growth);
        const auto fitting = static_cast<uint32_t>(std::clamp(rays, double{least}, 0x1p30)) / least * least;
        size_ = share < 1.0 ? fitting : std::max(size_, fitting);
    }

private:
    uint32_t size_ = least;
};

}  // namespace glint::detail
