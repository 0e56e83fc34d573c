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
    uint32_t words = 0;
    uint32_t groups = 0;
    uint32_t capacity = 0;
    uint32_t shift = 0;
    uint32_t bits = 0;
    uint32_t pass = 0;
};

/// How groups share their elements, which `shaders/parallel/common.h` explains: by tiles on GPUs, by runs on CPUs.
struct ParallelForm {
    bool tiles = false;
    bool is_swept = false;   ///< sorts of one region read each element once a digit
    bool is_silent = false;  ///< most tiles of a sweep say nothing to others, for tests
    uint32_t group = 0;      ///< threads
    uint32_t most = 0;       ///< threads of the largest groups
    uint32_t subgroup = 0;   ///< the smallest there are
    bool is_wide = false;    ///< subgroups may have more than 32 threads
};

/// Of the device, or as $GLINT_PARALLEL ("tiles", "runs", "sweep", "silent") says.
ParallelForm parallelFormOf(const Device& device);

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

    /// `groups` 0: as many as suit the device, which are `gpu_groups` on GPUs. Room for `regions` of the host.
    Status create(const Device& device, std::string_view name, uint32_t groups, uint32_t gpu_groups, uint32_t regions,
                  Where where);

    uint32_t groups() const { return groups_; }
    const ParallelForm& form() const { return form_; }
    const Buffer& report() const { return report_; }

    /// Each gives a source, or fails the list.
    bool upload(Compute& compute, std::span<const Region> regions, Source& source, Where where) const;
    bool find(Compute& compute, uint32_t count, const Buffer& regions, uint64_t offset, Source& source,
              Where where) const;
    bool find(Compute& compute, const Buffer& counts, uint64_t counts_offset, const Buffer& regions, uint64_t offset,
              Source& source, Where where) const;
    /// "parallel.range" if the region is not within the buffer.
    Status checkRange(const Buffer& data, uint64_t offset, uint64_t size, Where where) const;

    /// Sets what all kernels have: regions, counts and report, in slots 0 to 2.
    void bind(Compute& compute, const Kernel& kernel, const Source& source, Where where) const;
    void run(Compute& compute, const ParallelWork& work, const Kernel& kernel, uint32_t groups, Where where) const;

    Status check(Where where) const;

    /// What a use before create() fails with.
    static Error uncreated(const char* what, Where where);
    Buffer createBuffer(uint64_t size, std::string_view name, Where where) const;
    /// Of a file of shaders/parallel, in the device's form, with groups of `group` threads.
    Expected<Kernel> createKernel(std::string_view file, std::string_view macros, uint32_t group, Where where) const;

private:
    Device device_;
    ParallelForm form_;
    uint32_t groups_ = 0;
    uint32_t room_ = 0;
    Buffer regions_;
    Buffer report_;
};

}  // namespace glint::detail
