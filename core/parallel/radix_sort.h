#pragma once

#include <glint/device/device.h>

#include <bit>
#include <cstdint>
#include <memory>
#include <span>

namespace glint {

/// Stable sorts of uint32_t keys in place, in ascending order, with or without a uint32_t beside each key. Keys and
/// payloads are ranges of one buffer with FlagStorage of at most Features::maxStorageSize bytes, counted in elements;
/// they may begin anywhere and have any size, 0 included, but must not overlap. What lies outside is not written.
///
/// Two ways, and the flags say which are prepared: FlagSingle spreads one region over the whole device; FlagMultiple
/// takes many regions of any lengths: short ones a group each, long ones spread over the device. A dispatch of one
/// region takes the first if it is there.
///
/// Dispatches set the list's kernel, its storage buffers from slot 0 on and its push constants. Recording calls fail
/// the list; what only the device can see is found by check(). A region that fails is left as it was. Lists of one
/// object may be recorded by one thread at a time.
class RadixSort {
public:
    using Where = std::source_location;

    enum Flag : uint32_t {
        FlagSingle = 1u << 0,
        FlagMultiple = 1u << 1,
        FlagKeys = 1u << 2,   ///< keys alone: payload offsets mean nothing
        FlagOrder = 1u << 3,  ///< payloads become the places, from 0 on, that the keys had in their region
    };
    using Flags = uint32_t;

    /// A region as the indirect forms read it: 16 bytes.
    struct Region {
        uint32_t keys = 0;     ///< elements from the buffer's begin
        uint32_t payload = 0;  ///< the same
        uint32_t size = 0;     ///< elements
        uint32_t padding = 0;
    };

    /// `size`: the most elements of one dispatch, all regions together; of regions from the device, of each of them and
    /// of the long ones together. Scratch memory is 8 bytes for each, 4 with FlagKeys, and at most
    /// Features::maxStorageSize; counts take about a quarter byte more each way. `groups`: how many work at a time, 0
    /// as many as suit the device. `regions`: the most that one dispatch takes from the host. Errors: "sort.flags" if
    /// neither FlagSingle nor FlagMultiple is there or FlagKeys and FlagOrder both are, "sort.capacity" if the size is
    /// 0 or too large, "parallel.regions", those of buffers and kernels.
    Status create(const Device& device, Flags flags, uint32_t size, uint32_t groups = 0, uint32_t regions = 1,
                  Where where = Where::current());
    /// True once create() has succeeded.
    explicit operator bool() const { return state_ != nullptr; }

    /// By the lowest `bits` bits of the keys, 1 to 32. Errors: "parallel.range" if keys or payloads are not within the
    /// buffer, "sort.overlap" if they overlap in a region, "sort.capacity", "sort.bits", "parallel.regions" if there
    /// are more than create() was told, "parallel.mode" for other than one region without FlagMultiple, "handle.null"
    /// before create().
    void dispatch(Compute& compute, const Buffer& data, uint32_t keys, uint32_t payload, uint32_t size,
                  uint32_t bits = 32, Where where = Where::current()) const;
    void dispatch(Compute& compute, const Buffer& data, std::span<const Region> regions, uint32_t bits = 32,
                  Where where = Where::current()) const;

    /// Regions from a buffer with FlagStorage, from byte `offset` on, a multiple of 4: one, `count` of them, or as many
    /// as a uint32_t at a byte of `counts` says, at most those that their buffer has room for; without FlagMultiple the
    /// first alone. Regions that overlap end in any order. Errors: "parallel.indirect" if they are not within their
    /// buffer, "parallel.mode", "sort.bits".
    void dispatchIndirect(Compute& compute, const Buffer& data, const Buffer& regions, uint64_t offset = 0,
                          uint32_t bits = 32, Where where = Where::current()) const;
    void dispatchIndirect(Compute& compute, const Buffer& data, uint32_t count, const Buffer& regions,
                          uint64_t offset = 0, uint32_t bits = 32, Where where = Where::current()) const;
    void dispatchIndirect(Compute& compute, const Buffer& data, const Buffer& counts, const Buffer& regions,
                          uint64_t counts_offset, uint64_t offset, uint32_t bits = 32,
                          Where where = Where::current()) const;

    /// Waits for the device and says what it has found since the last check: "parallel.outside" if a region was not
    /// within the buffer, "parallel.room" if there was no scratch memory left for one, "parallel.count" if there were
    /// more than their buffer holds.
    Status check(Where where = Where::current()) const;

private:
    struct State;
    bool isUsable(Compute& compute, uint64_t count, uint32_t bits, Where where) const;

    std::shared_ptr<const State> state_;
};

/// Both flags.
constexpr RadixSort::Flags operator|(RadixSort::Flag a, RadixSort::Flag b) {
    return static_cast<RadixSort::Flags>(a) | static_cast<RadixSort::Flags>(b);
}

/// The key of a float, in the total order of IEEE 754: NaNs with the sign bit, -infinity, negative numbers, -0, +0,
/// positive numbers, infinity, NaNs without it; NaNs of one sign by their bits. <glint/parallel/key.h> has the same for
/// shaders.
constexpr uint32_t sortKey(float value) {
    const uint32_t bits = std::bit_cast<uint32_t>(value);
    return (bits >> 31) != 0 ? ~bits : bits | 0x80000000u;
}
/// The float of a key.
constexpr float sortValue(uint32_t key) { return std::bit_cast<float>((key >> 31) != 0 ? key & 0x7fffffffu : ~key); }

}  // namespace glint
