#pragma once

#include <glint/device/device.h>

#include <cstdint>
#include <memory>
#include <span>

namespace glint {

/// Exclusive sums of uint32_t values in place, modulo 2^32: element i becomes the sum of elements 0 to i - 1 of its
/// region. Regions are counted in elements; they may begin anywhere and have any size, 0 included, within a buffer with
/// FlagStorage of at most Features::maxStorageSize bytes. What lies outside of a region is not written.
///
/// Two ways: ModeSingle spreads one region over the whole device; ModeMultiple gives each region to one group, for many
/// regions of some thousand elements.
///
/// Dispatches set the list's kernel, its storage buffers from slot 0 on and its push constants. Recording calls fail
/// the list; what only the device can see is found by check(). A region that fails is left as it was. Lists of one
/// object may be recorded by one thread at a time.
class PrefixScan {
public:
    using Where = std::source_location;

    enum Mode : uint8_t {
        ModeSingle,
        ModeMultiple,
    };

    /// A region as the indirect forms read it: 16 bytes. Regions of one dispatch must not overlap.
    struct Region {
        uint32_t offset = 0;  ///< elements from the buffer's begin
        uint32_t size = 0;    ///< elements
        uint32_t padding[2] = {};
    };

    /// `groups`: how many work at a time, 0 as many as suit the device. `regions`: the most that one dispatch takes
    /// from the host. Errors: "parallel.regions", those of buffers and kernels.
    Status create(const Device& device, Mode mode, uint32_t groups = 0, uint32_t regions = 1,
                  Where where = Where::current());
    /// True once create() has succeeded.
    explicit operator bool() const { return state_ != nullptr; }

    /// Errors: "parallel.range" if a region is not within the buffer, "parallel.regions" if there are more than
    /// create() was told, "parallel.mode" for other than one region in ModeSingle, "handle.null" before create().
    void dispatch(Compute& compute, const Buffer& data, uint32_t offset, uint32_t size,
                  Where where = Where::current()) const;
    void dispatch(Compute& compute, const Buffer& data, std::span<const Region> regions,
                  Where where = Where::current()) const;

    /// Regions from a buffer with FlagStorage, from byte `offset` on, a multiple of 4: one, `count` of them, or as many
    /// as a uint32_t at a byte of `counts` says, at most those that their buffer has room for. Any number in the form
    /// with counts, in ModeSingle the first alone. Errors: "parallel.indirect" if they are not within their buffer,
    /// "parallel.mode".
    void dispatchIndirect(Compute& compute, const Buffer& data, const Buffer& regions, uint64_t offset = 0,
                          Where where = Where::current()) const;
    void dispatchIndirect(Compute& compute, const Buffer& data, uint32_t count, const Buffer& regions,
                          uint64_t offset = 0, Where where = Where::current()) const;
    void dispatchIndirect(Compute& compute, const Buffer& data, const Buffer& counts, const Buffer& regions,
                          uint64_t counts_offset, uint64_t offset, Where where = Where::current()) const;

    /// Waits for the device and says what it has found since the last check: "parallel.outside" if a region was not
    /// within the buffer, "parallel.count" if there were more than their buffer holds.
    Status check(Where where = Where::current()) const;

private:
    struct State;
    bool isUsable(Compute& compute, uint64_t count, Where where) const;

    std::shared_ptr<const State> state_;
};

}  // namespace glint
