#include <glint/parallel/radix_sort.h>

#include <glint/base/format_error.h>
#include <glint/parallel/detail/regions.h>

#include <algorithm>

namespace glint {

static_assert(sizeof(RadixSort::Region) == sizeof(detail::ParallelRegions::Region));

namespace {

/// GLINT_STAGE of shaders/parallel/sort.h.
enum Stage : uint32_t { StageCount, StageSum, StageScatter, StageCopy, StageRegions, stages };

}  // namespace

struct RadixSort::State {
    Flags flags = 0;
    uint32_t capacity = 0;
    uint32_t digit = 0;  ///< bits that are sorted by at a time
    detail::ParallelRegions regions;
    Kernel kernels[stages];
    Buffer scratch;
    Buffer sums;  ///< for each digit, of each group's share

    Status create(const Device& device, uint32_t groups, uint32_t room, Where where);
    Status check(std::span<const Region> list, const Buffer& data, Where where) const;
    void record(Compute& compute, const Buffer& data, const detail::ParallelRegions::Source& source, uint32_t bits,
                Where where) const;
    void runSingle(Compute& compute, detail::ParallelWork work, const Buffer& data,
                   const detail::ParallelRegions::Source& source, uint32_t bits, Where where) const;
};

Status RadixSort::State::create(const Device& device, uint32_t groups, uint32_t room, Where where) {
    const bool has_way = (flags & (FlagSingle | FlagMultiple)) != 0;
    if (!has_way || (flags & (FlagKeys | FlagOrder)) == (FlagKeys | FlagOrder))
        return makeError(where, ErrorCode::InvalidArgument, "sort.flags",
                         "RadixSort: flags {:#x}; FlagSingle or FlagMultiple is needed, FlagKeys excludes FlagOrder",
                         flags);
    if (Status status = regions.create(device, "radix sort", groups, room, where); !status) return status;
    const uint64_t bytes = uint64_t{capacity} * (flags & FlagKeys ? 4 : 8);
    const uint64_t limit = device.getFeatures().maxStorageSize;
    if (bytes == 0 || bytes > limit)
        return makeError(where, ErrorCode::OutOfRange, "sort.capacity",
                         "RadixSort: {} elements need {} bytes of scratch memory, the device takes 1 to {}", capacity,
                         bytes, limit);
    // Counters take 8 KiB of a group's memory both ways.
    const uint32_t group = regions.isCpu() ? 8 : 128;
    const uint32_t run = regions.isCpu() ? 2048 : 8;
    digit = regions.isCpu() ? 8 : 4;
    scratch = regions.createBuffer(bytes, "radix sort: scratch", where);
    if (!scratch) return scratch.error();
    if (flags & FlagSingle) {
        sums = regions.createBuffer((uint64_t{regions.groups()} << digit) * 4, "radix sort: sums", where);
        if (!sums) return sums.error();
    }
    const int payload = flags & FlagKeys ? 0 : flags & FlagOrder ? 2 : 1;
    for (uint32_t stage = 0; stage < stages; stage++) {
        if ((flags & (stage == StageRegions ? FlagMultiple : FlagSingle)) == 0) continue;
        Expected<Kernel> kernel = regions.createKernel(
            "sort",
            fmt::format("GLINT_GROUP={}u; GLINT_RUN={}u; GLINT_DIGIT={}; GLINT_PAYLOAD={}; GLINT_STAGE={}", group, run,
                        digit, payload, stage),
            where);
        if (!kernel) return kernel.error();
        kernels[stage] = std::move(*kernel);
    }
    return {};
}

/// Finds what is wrong with regions of the host.
Status RadixSort::State::check(std::span<const Region> list, const Buffer& data, Where where) const {
    uint64_t all = 0;
    for (const Region& region : list) {
        if (Status status = regions.checkRange(data, region.keys, region.size, where); !status) return status;
        all += region.size;
        if (flags & FlagKeys) continue;
        if (Status status = regions.checkRange(data, region.payload, region.size, where); !status) return status;
        const uint32_t distance = std::max(region.keys, region.payload) - std::min(region.keys, region.payload);
        if (distance < region.size)
            return makeError(where, ErrorCode::InvalidArgument, "sort.overlap",
                             "RadixSort: {} keys from element {} on overlap their payloads from element {} on",
                             region.size, region.keys, region.payload);
    }
    if (all > capacity)
        return makeError(where, ErrorCode::OutOfRange, "sort.capacity",
                         "RadixSort: {} elements, there is scratch memory for {}", all, capacity);
    return {};
}

void RadixSort::State::record(Compute& compute, const Buffer& data, const detail::ParallelRegions::Source& source,
                              uint32_t bits, Where where) const {
    detail::ParallelWork work = source.work;
    work.groups = regions.groups();
    work.capacity = capacity;
    if (work.count == 1 && (flags & FlagSingle)) return runSingle(compute, work, data, source, bits, where);
    if ((flags & FlagMultiple) == 0) return runSingle(compute, work, data, source, bits, where);
    work.groups = std::min(work.groups, work.count);
    work.bits = bits;
    compute.clearBuffer(regions.report(), 0, 12, 4, where);
    regions.bind(compute, kernels[StageRegions], data, source);
    compute.setStorageBuffer(4, scratch);
    regions.run(compute, work, kernels[StageRegions], work.groups, where);
}

void RadixSort::State::runSingle(Compute& compute, detail::ParallelWork work, const Buffer& data,
                                 const detail::ParallelRegions::Source& source, uint32_t bits, Where where) const {
    const auto play = [&](Stage stage, uint32_t groups) {
        regions.bind(compute, kernels[stage], data, source);
        compute.setStorageBuffer(4, scratch);
        if (stage != StageCopy) compute.setStorageBuffer(5, sums);
        regions.run(compute, work, kernels[stage], groups, where);
    };
    for (work.shift = 0; work.shift < bits; work.shift += digit) {
        work.bits = std::min(digit, bits - work.shift);
        play(StageCount, work.groups);
        play(StageSum, 1);
        play(StageScatter, work.groups);
        work.flipped ^= 1;
    }
    if (work.flipped) play(StageCopy, work.groups);
}

Status RadixSort::create(const Device& device, Flags flags, uint32_t size, uint32_t groups, uint32_t regions,
                         Where where) {
    state_ = nullptr;
    auto state = std::make_shared<State>();
    state->flags = flags;
    state->capacity = size;
    if (Status status = state->create(device, groups, regions, where); !status) return status;
    state_ = std::move(state);
    return {};
}

Status RadixSort::check(Where where) const {
    return state_ ? state_->regions.check(where) : Status(detail::ParallelRegions::uncreated("RadixSort", where));
}

bool RadixSort::isUsable(Compute& compute, uint64_t count, uint32_t bits, Where where) const {
    if (!state_) {
        compute.fail(detail::ParallelRegions::uncreated("RadixSort", where));
    } else if (count > 1 && (state_->flags & FlagMultiple) == 0) {
        compute.fail(makeError(where, ErrorCode::InvalidArgument, "parallel.mode",
                               "RadixSort: {} regions without FlagMultiple", count));
    } else if (bits == 0 || bits > 32) {
        compute.fail(
            makeError(where, ErrorCode::OutOfRange, "sort.bits", "RadixSort: {} bits, keys have 1 to 32", bits));
    } else {
        return true;
    }
    return false;
}

void RadixSort::dispatch(Compute& compute, const Buffer& data, uint32_t keys, uint32_t payload, uint32_t size,
                         uint32_t bits, Where where) const {
    const Region region = {keys, payload, size, 0};
    dispatch(compute, data, std::span(&region, 1), bits, where);
}

void RadixSort::dispatch(Compute& compute, const Buffer& data, std::span<const Region> regions, uint32_t bits,
                         Where where) const {
    if (!isUsable(compute, regions.size(), bits, where)) return;
    if (Status status = state_->check(regions, data, where); !status) return compute.fail(status.error());
    std::vector<detail::ParallelRegions::Region> records;
    records.reserve(regions.size());
    for (const Region& region : regions) records.push_back({region.keys, region.payload, region.size, 0});
    detail::ParallelRegions::Source source;
    if (state_->regions.upload(compute, records, source, where)) state_->record(compute, data, source, bits, where);
}

void RadixSort::dispatchIndirect(Compute& compute, const Buffer& data, const Buffer& regions, uint64_t offset,
                                 uint32_t bits, Where where) const {
    dispatchIndirect(compute, data, 1, regions, offset, bits, where);
}

void RadixSort::dispatchIndirect(Compute& compute, const Buffer& data, uint32_t count, const Buffer& regions,
                                 uint64_t offset, uint32_t bits, Where where) const {
    detail::ParallelRegions::Source source;
    if (isUsable(compute, count, bits, where) && state_->regions.find(compute, count, regions, offset, source, where))
        state_->record(compute, data, source, bits, where);
}

void RadixSort::dispatchIndirect(Compute& compute, const Buffer& data, const Buffer& counts, const Buffer& regions,
                                 uint64_t counts_offset, uint64_t offset, uint32_t bits, Where where) const {
    detail::ParallelRegions::Source source;
    if (isUsable(compute, 1, bits, where) &&
        state_->regions.find(compute, counts, counts_offset, regions, offset, source, where))
        state_->record(compute, data, source, bits, where);
}

}  // namespace glint
