// Dispatches of rays: by the driver's pipelines, or by the kernel that a traversal has been joined into.

#include <glint/device/detail/recorder_core.h>

#include <algorithm>
#include <utility>

namespace glint::detail {

/// Rays along each axis: Vulkan bounds them by the threads of a dispatch.
std::array<uint64_t, 3> RecorderCore::rayLimits() const {
    const Features& features = device_->features();
    const std::array<uint32_t, 3> sizes =
        traversal_->joined
            ? traversal_->joined->group_size
            : std::array<uint32_t, 3>{features.maxGroupSizeX, features.maxGroupSizeY, features.maxGroupSizeZ};
    const auto limit = [&](uint32_t groups, size_t i) {
        return std::min<uint64_t>(uint64_t(groups) * sizes[i], UINT32_MAX);
    };
    return {limit(features.maxGroupCountX, 0), limit(features.maxGroupCountY, 1), limit(features.maxGroupCountZ, 2)};
}

void RecorderCore::traceRays(uint64_t width, uint64_t height, uint64_t depth, Where where) {
    const std::array<uint64_t, 3> rays = {width, height, depth}, limits = rayLimits();
    uint64_t left = device_->features().maxRays;
    for (const uint64_t count : rays) {
        if (count == 0) return;
        left /= count;
    }
    for (size_t i = 0; i < 3; i++)
        if (left == 0 || rays[i] > limits[i])
            return fail(where, ErrorCode::OutOfRange, "dispatch.rays",
                        "dispatch: {} x {} x {} rays, the limits are {} x {} x {} and {} in all", width, height, depth,
                        limits[0], limits[1], limits[2], device_->features().maxRays);
    const std::array<uint32_t, 3> counts = {static_cast<uint32_t>(width), static_cast<uint32_t>(height),
                                            static_cast<uint32_t>(depth)};
    if (traversal_->joined) return traceJoined(counts, where);
    if (!flushBindings("dispatch", where) || !flushPush("dispatch", where)) return;
    beginAccesses();
    auto& command = push<TraceRaysCommand>(CommandType::TraceRays);
    shareAccesses(command.header);
    command.traversal = program_resource_;
    command.generation = ray_generation_;
    command.bindings = bindings_;
    std::ranges::copy(counts, command.rays);
}

void RecorderCore::traceRaysIndirect(BufferObject& counts, uint64_t offset, Where where) {
    if (traversal_->joined) return traceJoinedIndirect(counts, offset, where);
    if (!flushBindings("dispatchIndirect", where) || !flushPush("dispatchIndirect", where)) return;
    const uint32_t resource = use(counts);
    beginAccesses();
    access(resource, Stage::Indirect, AccessRead);
    auto& command = push<TraceRaysIndirectCommand>(CommandType::TraceRaysIndirect);
    shareAccesses(command.header);
    command.traversal = program_resource_;
    command.generation = ray_generation_;
    command.bindings = bindings_;
    command.buffer = resource;
    command.offset = offset;
}

/// With the blocks of records and launch in the kernel's last slots, where otherwise is what the user has set.
bool RecorderCore::flushJoined(const Bound& launch, const char* what, Where where) {
    Bound records;
    records.set = true;
    records.value.resource = use(*traversal_->joined_records);
    records.value.size = traversal_->joined_records->size;
    std::pair<SlotKind, Bound> blocks[] = {{SlotKind::Storage, records}, {SlotKind::Uniform, launch}};
    const auto swap = [&] {
        for (auto& [kind, bound] : blocks) {
            std::vector<Bound>& slots = bound_[static_cast<size_t>(kind)];
            const size_t count = program_->layout.slots[static_cast<size_t>(kind)].size();
            if (slots.size() < count) slots.resize(count);
            std::swap(slots[count - 1], bound);
        }
        bindings_dirty_ = uniforms_dirty_ = true;
    };
    swap();
    const bool flushed = flushBindings(what, where) && flushPush(what, where);
    swap();
    return flushed;
}

void RecorderCore::traceJoined(const std::array<uint32_t, 3>& rays, Where where) {
    const uint32_t words[4] = {rays[0], rays[1], rays[2], ray_generation_};
    Bound launch;
    launch.set = launch.inlined = true;
    launch.value.offset = appendInline(words, sizeof(words), device_->features().uniformAlignment, sizeof(words));
    launch.value.size = sizeof(words);
    if (!flushJoined(launch, "dispatch", where)) return;
    beginAccesses();
    auto& command = push<DispatchCommand>(CommandType::Dispatch);
    shareAccesses(command.header);
    command.kernel = program_resource_;
    command.bindings = bindings_;
    const std::array<uint32_t, 3>& group = traversal_->joined->group_size;
    for (size_t i = 0; i < 3; i++) command.groups[i] = (rays[i] - 1) / group[i] + 1;
}

void RecorderCore::traceJoinedIndirect(BufferObject& counts, uint64_t offset, Where where) {
    const Expected<KernelObject*> kernel = device_->rayCountKernel(where);
    if (!kernel) return fail(kernel.error().at(where));
    BufferObject& memory = *traversal_->joined_launch;
    const uint32_t resource = use(memory);
    const uint32_t kernel_resource = use(**kernel);
    const uint64_t rays = JoinedLaunch::rays(device_->features());

    // Nobody else sees the memory of the launch: its hazards are not the caller's.
    const bool tracking = std::exchange(tracking_, true);
    copyBuffer(memory, JoinedLaunch::counts, counts, offset, 3 * sizeof(uint32_t));

    struct Constants {
        uint32_t limits[3];
        uint32_t most;
        uint32_t group_size[3];
        uint32_t generation;
    } constants = {};
    const std::array<uint64_t, 3> limits = rayLimits();
    for (size_t i = 0; i < 3; i++) {
        constants.limits[i] = static_cast<uint32_t>(limits[i]);
        constants.group_size[i] = traversal_->joined->group_size[i];
    }
    constants.most = static_cast<uint32_t>(std::min<uint64_t>(device_->features().maxRays, UINT32_MAX));
    constants.generation = ray_generation_;
    BoundResource elements[2];
    elements[0].resource = elements[1].resource = resource;
    elements[0].size = JoinedLaunch::arguments_size;
    elements[1].offset = rays;
    elements[1].size = JoinedLaunch::rays_size;
    beginAccesses();
    access(resource, Stage::Compute, AccessRead | AccessWrite);
    auto& count = push<DispatchCommand>(CommandType::Dispatch);
    count.kernel = kernel_resource;
    count.bindings.bound = append(elements, sizeof(elements), alignof(BoundResource));
    count.bindings.bound_count = 2;
    count.bindings.push = append(&constants, sizeof(constants), 4);
    count.bindings.push_size = sizeof(constants);
    std::fill_n(count.groups, 3, 1u);

    Bound launch;
    launch.set = true;
    launch.value.resource = resource;
    launch.value.offset = rays;
    launch.value.size = JoinedLaunch::rays_size;
    if (flushJoined(launch, "dispatchIndirect", where)) {
        beginAccesses();
        access(resource, Stage::Indirect, AccessRead);
        auto& command = push<DispatchIndirectCommand>(CommandType::DispatchIndirect);
        shareAccesses(command.header);
        command.kernel = program_resource_;
        command.bindings = bindings_;
        command.buffer = resource;
        command.offset = JoinedLaunch::groups;
    }
    tracking_ = tracking;
}

}  // namespace glint::detail
