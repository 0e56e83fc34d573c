#include <glint/parallel/prefix_scan.h>

#include <glint/base/format_error.h>
#include <glint/parallel/detail/regions.h>

#include <algorithm>

namespace glint {

static_assert(sizeof(PrefixScan::Region) == sizeof(detail::ParallelRegions::Region));

struct PrefixScan::State {
    Mode mode = ModeSingle;
    detail::ParallelRegions regions;
    std::vector<Kernel> kernels;
    Buffer sums;  ///< of each group's share

    Status create(const Device& device, uint32_t groups, uint32_t room, Where where);
    void record(Compute& compute, const Buffer& data, const detail::ParallelRegions::Source& source, Where where) const;
};

Status PrefixScan::State::create(const Device& device, uint32_t groups, uint32_t room, Where where) {
    if (Status status = regions.create(device, "prefix scan", groups, 1024, room, where); !status) return status;
    if (mode == ModeSingle) {
        const uint32_t columns = regions.form().tiles ? 1 : regions.form().group;
        sums = regions.createBuffer(uint64_t{regions.groups()} * columns * 4, "prefix scan: sums", where);
        if (!sums) return sums.error();
    }
    for (uint32_t stage = mode == ModeSingle ? 0 : 2; stage < (mode == ModeSingle ? 2 : 3); stage++) {
        Expected<Kernel> kernel =
            regions.createKernel("scan", fmt::format("GLINT_STAGE={}", stage), regions.form().group, where);
        if (!kernel) return kernel.error();
        kernels.push_back(std::move(*kernel));
    }
    return {};
}

void PrefixScan::State::record(Compute& compute, const Buffer& data, const detail::ParallelRegions::Source& source,
                               Where where) const {
    detail::ParallelWork work = source.work;
    work.words = static_cast<uint32_t>(data.getSize() / 4);
    work.groups = regions.groups();
    if (mode == ModeMultiple) work.groups = std::min(work.groups, work.count);
    for (const Kernel& kernel : kernels) {
        regions.bind(compute, kernel, source, where);
        compute.setStorageBuffer(Slot(3, where), data);
        if (mode == ModeSingle) compute.setStorageBuffer(Slot(4, where), sums);
        regions.run(compute, work, kernel, work.groups, where);
    }
}

Status PrefixScan::create(const Device& device, Mode mode, uint32_t groups, uint32_t regions, Where where) {
    state_ = nullptr;
    auto state = std::make_shared<State>();
    state->mode = mode;
    if (Status status = state->create(device, groups, regions, where); !status) return status;
    state_ = std::move(state);
    return {};
}

Status PrefixScan::check(Where where) const {
    return state_ ? state_->regions.check(where) : Status(detail::ParallelRegions::uncreated("PrefixScan", where));
}

bool PrefixScan::isUsable(Compute& compute, uint64_t count, Where where) const {
    if (!state_) {
        compute.fail(detail::ParallelRegions::uncreated("PrefixScan", where));
    } else if (state_->mode == ModeSingle && count > 1) {
        compute.fail(makeError(where, ErrorCode::InvalidArgument, "parallel.mode",
                               "PrefixScan: {} regions, ModeSingle takes one", count));
    } else {
        return true;
    }
    return false;
}

void PrefixScan::dispatch(Compute& compute, const Buffer& data, uint32_t offset, uint32_t size, Where where) const {
    const Region region = {offset, size, {}};
    dispatch(compute, data, std::span(&region, 1), where);
}

void PrefixScan::dispatch(Compute& compute, const Buffer& data, std::span<const Region> regions, Where where) const {
    if (!isUsable(compute, regions.size(), where)) return;
    std::vector<detail::ParallelRegions::Region> records;
    records.reserve(regions.size());
    for (const Region& region : regions) {
        const Status status = state_->regions.checkRange(data, region.offset, region.size, where);
        if (!status) return compute.fail(status.error());
        records.push_back({region.offset, region.size, 0, 0});
    }
    detail::ParallelRegions::Source source;
    if (state_->regions.upload(compute, records, source, where)) state_->record(compute, data, source, where);
}

void PrefixScan::dispatchIndirect(Compute& compute, const Buffer& data, const Buffer& regions, uint64_t offset,
                                  Where where) const {
    dispatchIndirect(compute, data, 1, regions, offset, where);
}

void PrefixScan::dispatchIndirect(Compute& compute, const Buffer& data, uint32_t count, const Buffer& regions,
                                  uint64_t offset, Where where) const {
    detail::ParallelRegions::Source source;
    if (isUsable(compute, count, where) && state_->regions.find(compute, count, regions, offset, source, where))
        state_->record(compute, data, source, where);
}

void PrefixScan::dispatchIndirect(Compute& compute, const Buffer& data, const Buffer& counts, const Buffer& regions,
                                  uint64_t counts_offset, uint64_t offset, Where where) const {
    detail::ParallelRegions::Source source;
    if (isUsable(compute, 1, where) &&
        state_->regions.find(compute, counts, counts_offset, regions, offset, source, where))
        state_->record(compute, data, source, where);
}

}  // namespace glint
