#pragma once

// What PrefixScan and RadixSort share, host side: where the regions of a dispatch come from and what the device says of
// them.

#include <glint/device/device.h>

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

namespace glint::detail {

/// The push constants of shaders/parallel/common.h.
struct ParallelWork {
    uint32_t first = 0;
    uint32_t count = 1;
    uint32_t count_word = ~0u;
    uint32_t groups = 0;
    uint32_t capacity = 0;
    uint32_t shift = 0;
    uint32_t bits = 0;
    uint32_t flipped = 0;
};

/// Regions of four words, of the host or of the device.
class ParallelRegions {
public:
    using Where = std::source_location;
    using Region = std::array<uint32_t, 4>;

    /// Where the regions of one dispatch lie.
    struct Source {
        Buffer regions;
        Buffer counts;  ///< `regions` if the host knows how many there are
        ParallelWork work;
    };

    /// `groups` 0: as many as suit the device. Room for `regions` of the host.
    Status create(const Device& device, std::string_view name, uint32_t groups, uint32_t regions, Where where);

    uint32_t groups() const { return groups_; }
    /// CPUs pay for each barrier of a group, GPUs for idle threads.
    bool isCpu() const { return device_.getInfo().cpu; }
    const Buffer& report() const { return report_; }

    /// Each gives a source, or fails the list.
    bool upload(Compute& compute, std::span<const Region> regions, Source& source, Where where) const;
    bool find(Compute& compute, uint32_t count, const Buffer& regions, uint64_t offset, Source& source,
              Where where) const;
    bool find(Compute& compute, const Buffer& counts, uint64_t counts_offset, const Buffer& regions, uint64_t offset,
              Source& source, Where where) const;
    /// "parallel.range" if the region is not within the buffer.
    Status checkRange(const Buffer& data, uint64_t offset, uint64_t size, Where where) const;

    void bind(Compute& compute, const Kernel& kernel, const Buffer& data, const Source& source) const;
    void run(Compute& compute, const ParallelWork& work, const Kernel& kernel, uint32_t groups, Where where) const;

    Status check(Where where) const;

    /// What a use before create() fails with.
    static Error uncreated(const char* what, Where where);
    Buffer createBuffer(uint64_t size, std::string_view name, Where where) const;
    /// Of a file of shaders/parallel.
    Expected<Kernel> createKernel(std::string_view file, std::string_view macros, Where where) const;

private:
    Device device_;
    uint32_t groups_ = 0;
    uint32_t room_ = 0;
    Buffer regions_;
    Buffer report_;
};

}  // namespace glint::detail
