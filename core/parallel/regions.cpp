#include <glint/parallel/detail/regions.h>

#include <glint/base/format_error.h>

#include <algorithm>
#include <cstdlib>

namespace glint::detail {

namespace {

constexpr uint64_t region_bytes = sizeof(ParallelRegions::Region);

}  // namespace

ParallelForm parallelFormOf(const Device& device) {
    const Features& features = device.getFeatures();
    ParallelForm form;
    const char* const variable = std::getenv("GLINT_PARALLEL");
    const std::string_view asked = variable ? variable : "";
    form.is_silent = asked == "silent";
    form.is_swept = variable ? asked == "sweep" || form.is_silent : !device.getInfo().cpu;
    form.tiles = form.is_swept || asked == "tiles";
    form.subgroup = std::max(features.minSubgroupSize, 1u);
    form.is_wide = features.maxSubgroupSize > 32;
    // Counters of eight subgroups take 8 KiB. On CPUs a subgroup a group makes barriers cheap.
    form.group = form.tiles ? std::clamp(8 * form.subgroup, 64u, features.maxGroupThreads) : 8;
    form.subgroup = std::min(form.subgroup, form.group);
    form.most = features.maxGroupThreads;
    return form;
}

Status ParallelRegions::create(const Device& device, std::string_view name, uint32_t groups, uint32_t gpu_groups,
                               uint32_t regions, Where where) {
    if (!device) return device.error().at(where);
    if (regions == 0)
        return makeError(where, ErrorCode::InvalidArgument, "parallel.regions", "{} with room for 0 regions", name);
    device_ = device;
    form_ = parallelFormOf(device);
    // A few groups for each core, so that the last to end is not waited for long.
    const uint32_t limit = device.getFeatures().maxGroupCountX;
    groups_ = std::min(groups != 0 ? groups : form_.tiles ? gpu_groups : 64, limit);
    room_ = regions;
    regions_ =
        device_.createBuffer(Buffer::FlagStorage, regions * region_bytes, fmt::format("{}: regions", name), where);
    const std::array<uint32_t, 4> zero = {};
    report_ = device_.createBuffer(Buffer::FlagStorage, std::span(zero), fmt::format("{}: report", name), where);
    if (!regions_) return regions_.error();
    if (!report_) return report_.error();
    return {};
}

bool ParallelRegions::upload(Compute& compute, std::span<const Region> regions, Source& source, Where where) const {
    if (regions.size() > room_) {
        compute.fail(makeError(where, ErrorCode::OutOfRange, "parallel.regions", "{} regions, there is room for {}",
                               regions.size(), room_));
        return false;
    }
    if (regions.empty()) return false;
    compute.setBuffer(regions_, 0, regions.data(), regions.size_bytes(), where);
    return find(compute, static_cast<uint32_t>(regions.size()), regions_, 0, source, where);
}

bool ParallelRegions::find(Compute& compute, uint32_t count, const Buffer& regions, uint64_t offset, Source& source,
                           Where where) const {
    if (count == 0) return false;
    if (!regions) {
        compute.fail(regions.error().at(where));
        return false;
    }
    if (offset % 4 != 0 || offset > regions.getSize() || count * region_bytes > regions.getSize() - offset) {
        compute.fail(makeError(where, ErrorCode::OutOfRange, "parallel.indirect",
                               "{} regions at offset {} of the {} bytes of buffer '{}'; regions have {} bytes, offsets "
                               "are multiples of 4",
                               count, offset, regions.getSize(), regions.name(), region_bytes));
        return false;
    }
    source.regions = regions;
    source.counts = regions;
    source.work.first = static_cast<uint32_t>(offset / 4);
    source.work.count = count;
    return true;
}

bool ParallelRegions::find(Compute& compute, const Buffer& counts, uint64_t counts_offset, const Buffer& regions,
                           uint64_t offset, Source& source, Where where) const {
    if (!counts) {
        compute.fail(counts.error().at(where));
        return false;
    }
    if (counts_offset % 4 != 0 || counts_offset > counts.getSize() || counts.getSize() - counts_offset < 4) {
        compute.fail(makeError(where, ErrorCode::OutOfRange, "parallel.indirect",
                               "a count at offset {} of the {} bytes of buffer '{}'; offsets are multiples of 4",
                               counts_offset, counts.getSize(), counts.name()));
        return false;
    }
    const uint64_t room = offset < regions.getSize() ? (regions.getSize() - offset) / region_bytes : 0;
    // At least one, so that a buffer without room for any is told.
    const uint32_t most = static_cast<uint32_t>(std::clamp<uint64_t>(room, 1, UINT32_MAX));
    if (!find(compute, most, regions, offset, source, where)) return false;
    source.counts = counts;
    source.work.count_word = static_cast<uint32_t>(counts_offset / 4);
    return true;
}

Status ParallelRegions::checkRange(const Buffer& data, uint64_t offset, uint64_t size, Where where) const {
    if (!data) return data.error().at(where);
    const uint64_t words = data.getSize() / 4;
    if (offset <= words && size <= words - offset) return {};
    return makeError(where, ErrorCode::OutOfRange, "parallel.range",
                     "{} elements from element {} on, buffer '{}' has {}", size, offset, data.name(), words);
}

void ParallelRegions::bind(Compute& compute, const Kernel& kernel, const Source& source, Where where) const {
    compute.setKernel(kernel, where);
    compute.setStorageBuffers(Slot(0, where), {source.regions, source.counts, report_});
}

void ParallelRegions::run(Compute& compute, const ParallelWork& work, const Kernel& kernel, uint32_t groups,
                          Where where) const {
    compute.setPushConstants(work, where);
    compute.dispatch(uint64_t{groups} * kernel.getGroupSizeX(), 1, 1, where);
}

Status ParallelRegions::check(Where where) const {
    Device device = device_;
    const Expected<std::vector<uint32_t>> report = device.read<uint32_t>(report_);
    if (!report) return report.error();
    device.clearBuffer(report_, 0, 0, 0, where);
    if ((*report)[0] != 0)
        return makeError(where, ErrorCode::OutOfRange, "parallel.outside",
                         "{} regions that the device chose are not within their buffer; they are as they were",
                         (*report)[0]);
    if ((*report)[1] != 0)
        return makeError(where, ErrorCode::OutOfRange, "parallel.room",
                         "{} regions that the device chose had no room in scratch memory; they are as they were",
                         (*report)[1]);
    if ((*report)[2] != 0)
        return makeError(where, ErrorCode::OutOfRange, "parallel.count",
                         "the device counted more regions than their buffer holds, {} times; the others were passed "
                         "over",
                         (*report)[2]);
    return {};
}

Error ParallelRegions::uncreated(const char* what, Where where) {
    return makeError(where, ErrorCode::InvalidArgument, "handle.null", "{} is used before create()", what);
}

Buffer ParallelRegions::createBuffer(uint64_t size, std::string_view name, Where where) const {
    return Device(device_).createBuffer(Buffer::FlagStorage, size, name, where);
}

Expected<Kernel> ParallelRegions::createKernel(std::string_view file, std::string_view macros, uint32_t group,
                                               Where where) const {
    Device device = device_;
    Kernel kernel = device.createKernel(file, where);
    kernel.createShaderGLSL(fmt::format("#include <glint/parallel/{}.h>\n", file),
                            fmt::format("GLINT_TILES={}; GLINT_GROUP={}u; GLINT_SUBGROUP={}u; GLINT_WIDE={}; {}",
                                        form_.tiles ? 1 : 0, group, form_.subgroup, form_.is_wide ? 1 : 0, macros),
                            where);
    if (Status status = kernel.create(where); !status) return unexpected(status.error());
    return kernel;
}

}  // namespace glint::detail
