#include <glint/parallel/radix_sort.h>

#include <glint/base/format_error.h>
#include <glint/parallel/detail/regions.h>

#include <algorithm>

namespace glint {

static_assert(sizeof(RadixSort::Region) == sizeof(detail::ParallelRegions::Region));

namespace {

/// GLINT_STAGE of shaders/parallel/sort.h.
enum Stage : uint32_t { StageList, StageCount, StageRows, StageMove, StageSmall, StageTotals, StageSweep, stages };

/// A digit has at most eight bits, and an even number of passes ends where it began.
constexpr uint32_t digits = 256;
constexpr uint32_t most_passes = 4;

/// Bytes of the table that shaders/parallel/sort_sweep.h describes.
uint64_t sweepTableSize(uint64_t tiles) { return (most_passes + 2 * tiles) * digits * 4; }

}  // namespace

struct RadixSort::State {
    /// What a pass over large regions takes: kernels for one region or for a list of jobs.
    struct Passes {
        Kernel kernels[stages];
        Buffer table;
        uint32_t shares = 0;  ///< the most that all regions together have
    };

    Flags flags = 0;
    uint32_t capacity = 0;
    uint32_t tile = 0;   ///< elements of a group at a time
    uint32_t small = 0;  ///< the most elements of a region that one group sorts
    detail::ParallelRegions regions;
    Passes single, multiple;
    bool is_swept = false;  ///< one region, by StageTotals and StageSweep
    Buffer scratch;
    Buffer small_scratch;  ///< of each group, where threads walk runs
    Buffer jobs;

    Status create(const Device& device, uint32_t groups, uint32_t room, Where where);
    Status createKernels(Passes& passes, bool is_multiple, Where where) const;
    bool canSweep(const Device& device) const;
    Status createSweep(Where where);
    Status check(std::span<const Region> list, const Buffer& data, Where where) const;
    void record(Compute& compute, const Buffer& data, const detail::ParallelRegions::Source& source, uint32_t bits,
                Where where) const;
    void runPasses(Compute& compute, const Passes& passes, detail::ParallelWork work, const Buffer& data,
                   const detail::ParallelRegions::Source& source, uint32_t bits, Where where) const;
    void runRegions(Compute& compute, detail::ParallelWork work, const Buffer& data,
                    const detail::ParallelRegions::Source& source, uint32_t bits, Where where) const;
};

Status RadixSort::State::create(const Device& device, uint32_t groups, uint32_t room, Where where) {
    const bool has_way = (flags & (FlagSingle | FlagMultiple)) != 0;
    if (!has_way || (flags & (FlagKeys | FlagOrder)) == (FlagKeys | FlagOrder))
        return makeError(where, ErrorCode::InvalidArgument, "sort.flags",
                         "RadixSort: flags {:#x}; FlagSingle or FlagMultiple is needed, FlagKeys excludes FlagOrder",
                         flags);
    if (Status status = regions.create(device, "radix sort", groups, 4096, room, where); !status) return status;
    const uint64_t element = flags & FlagKeys ? 4 : 8;
    const uint64_t limit = device.getFeatures().maxStorageSize;
    if (capacity == 0 || capacity * element > limit)
        return makeError(where, ErrorCode::OutOfRange, "sort.capacity",
                         "RadixSort: {} elements need {} bytes of scratch memory, the device takes 1 to {}", capacity,
                         capacity * element, limit);
    const detail::ParallelForm& form = regions.form();
    // As many keys, ranks and payloads as registers take, but few where they make the compiler slow; runs that are long
    // against the counters of a thread.
    tile = form.group * (!form.tiles ? 4096 : device.getInfo().cpu ? 2 : 16);
    small = form.tiles ? tile : 16384;
    scratch = regions.createBuffer(capacity * element, "radix sort: scratch", where);
    if (!scratch) return scratch.error();
    const uint32_t tiles = (capacity - 1) / tile + 1;
    const uint64_t columns = form.tiles ? 1 : form.group;
    if ((flags & FlagSingle) && canSweep(device)) {
        if (Status status = createSweep(where); !status) return status;
    } else if (flags & FlagSingle) {
        single.shares = std::min(tiles, regions.groups());
        single.table = regions.createBuffer((1 + single.shares * columns) * digits * 4, "radix sort: table", where);
        if (!single.table) return single.table.error();
        if (Status status = createKernels(single, false, where); !status) return status;
    }
    if (flags & FlagMultiple) {
        // Each job may end in a tile that is not full.
        const uint64_t job_room = capacity / small + 1;
        multiple.shares = tiles + static_cast<uint32_t>(job_room);
        multiple.table =
            regions.createBuffer((job_room + multiple.shares * columns) * digits * 4, "radix sort: table", where);
        if (!multiple.table) return multiple.table.error();
        jobs = regions.createBuffer((2 + 8 * job_room + multiple.shares) * 4, "radix sort: jobs", where);
        if (!jobs) return jobs.error();
        if (!form.tiles) {
            small_scratch = regions.createBuffer(uint64_t{regions.groups()} * std::min(small, capacity) * 8,
                                                 "radix sort: small regions", where);
            if (!small_scratch) return small_scratch.error();
        }
        if (Status status = createKernels(multiple, true, where); !status) return status;
    }
    return {};
}

Status RadixSort::State::createKernels(Passes& passes, bool is_multiple, Where where) const {
    const detail::ParallelForm& form = regions.form();
    const int payload = flags & FlagKeys ? 0 : flags & FlagOrder ? 2 : 1;
    for (uint32_t stage = 0; stage < stages; stage++) {
        if (stage >= StageTotals || (!is_multiple && (stage == StageList || stage == StageSmall))) continue;
        // A row has as many elements as there are shares.
        const uint32_t group = stage == StageRows && form.tiles ? std::min(4 * form.group, form.most) : form.group;
        Expected<Kernel> kernel = regions.createKernel(
            "sort",
            fmt::format("GLINT_TILE={}u; GLINT_SMALL={}u; GLINT_PAYLOAD={}; GLINT_MANY={}; GLINT_STAGE={}", tile, small,
                        payload, is_multiple && stage != StageSmall ? 1 : 0, stage),
            group, where);
        if (!kernel) return kernel.error();
        passes.kernels[stage] = std::move(*kernel);
    }
    return {};
}

/// A group has a tile; the device binds the table at once, and its words have 30 bits for places.
bool RadixSort::State::canSweep(const Device& device) const {
    const uint64_t tiles = (capacity - 1) / tile + 1;
    return regions.form().is_swept && capacity < 1u << 30 && tiles <= device.getFeatures().maxGroupCountX &&
           sweepTableSize(tiles) <= device.getFeatures().maxStorageSize;
}

Status RadixSort::State::createSweep(Where where) {
    is_swept = true;
    single.shares = (capacity - 1) / tile + 1;
    single.table = regions.createBuffer(sweepTableSize(single.shares), "radix sort: table", where);
    if (!single.table) return single.table.error();
    const int payload = flags & FlagKeys ? 0 : flags & FlagOrder ? 2 : 1;
    const bool is_silent = regions.form().is_silent;
    for (const Stage stage : {StageTotals, StageSweep}) {
        Expected<Kernel> kernel = regions.createKernel(
            "sort",
            fmt::format("GLINT_TILE={}u; GLINT_SMALL={}u; GLINT_PAYLOAD={}; GLINT_MANY=0; GLINT_STAGE={}; "
                        "GLINT_POLLS={}u; GLINT_SILENT={}",
                        tile, small, payload, static_cast<uint32_t>(stage), is_silent ? 4 : 100000, is_silent ? 1 : 0),
            regions.form().group, where);
        if (!kernel) return kernel.error();
        single.kernels[stage] = std::move(*kernel);
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
    work.words = static_cast<uint32_t>(data.getSize() / 4);
    work.groups = regions.groups();
    work.capacity = capacity;
    if ((flags & FlagMultiple) == 0 || (work.count == 1 && (flags & FlagSingle)))
        runPasses(compute, single, work, data, source, bits, where);
    else
        runRegions(compute, work, data, source, bits, where);
}

void RadixSort::State::runPasses(Compute& compute, const Passes& passes, detail::ParallelWork work, const Buffer& data,
                                 const detail::ParallelRegions::Source& source, uint32_t bits, Where where) const {
    // Groups that take a row each, or a row a thread.
    const uint32_t rows = regions.form().tiles ? digits : digits / regions.form().group;
    const uint32_t count = (bits + 15) / 16 * 2;
    const uint32_t width = (bits + count - 1) / count;
    const bool is_sweep = is_swept && &passes == &single;
    if (is_sweep) {
        compute.clearBuffer(passes.table, 0, 0, sweepTableSize(0), where);
        work.shift = width;
        work.bits = bits;
        regions.bind(compute, passes.kernels[StageTotals], source, where);
        compute.setStorageBuffers(Slot(3, where), {data, scratch, passes.table});
        regions.run(compute, work, passes.kernels[StageTotals], std::min(passes.shares, 512u), where);
    }
    for (uint32_t i = 0; i < count; i++) {
        // A pass without bits that are left copies.
        work.shift = std::min(i * width, 31u);
        work.bits = std::min(width, bits - std::min(i * width, bits));
        work.pass = i;
        if (is_sweep) {
            regions.bind(compute, passes.kernels[StageSweep], source, where);
            compute.setStorageBuffers(Slot(3, where), {i % 2 ? scratch : data, i % 2 ? data : scratch, passes.table});
            regions.run(compute, work, passes.kernels[StageSweep], passes.shares, where);
            continue;
        }
        for (const Stage stage : {StageCount, StageRows, StageMove}) {
            regions.bind(compute, passes.kernels[stage], source, where);
            const Buffer& from = work.pass % 2 ? scratch : data;
            const Buffer& to = work.pass % 2 ? data : scratch;
            compute.setStorageBuffers(Slot(3, where), {from, to, passes.table});
            if (passes.kernels[StageList]) compute.setStorageBuffer(Slot(6, where), jobs);
            const uint32_t count_of_groups = stage == StageRows ? rows : std::min(regions.groups(), passes.shares);
            regions.run(compute, work, passes.kernels[stage], count_of_groups, where);
        }
    }
}

void RadixSort::State::runRegions(Compute& compute, detail::ParallelWork work, const Buffer& data,
                                  const detail::ParallelRegions::Source& source, uint32_t bits, Where where) const {
    compute.clearBuffer(regions.report(), 0, 12, 4, where);
    compute.clearBuffer(jobs, 0, 0, 8, where);
    work.bits = bits;
    const Kernel& list = multiple.kernels[StageList];
    regions.bind(compute, list, source, where);
    compute.setStorageBuffers(Slot(3, where), {data, scratch, jobs});
    regions.run(compute, work, list, std::min(regions.groups(), (work.count - 1) / regions.form().group + 1), where);

    const Kernel& small_regions = multiple.kernels[StageSmall];
    regions.bind(compute, small_regions, source, where);
    compute.setStorageBuffers(Slot(3, where), {data, small_scratch ? small_scratch : scratch});
    regions.run(compute, work, small_regions, std::min(work.groups, work.count), where);

    runPasses(compute, multiple, work, data, source, bits, where);
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
