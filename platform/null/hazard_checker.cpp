#include <platform/null/hazard_checker.h>

#include <fmt/format.h>

#include <algorithm>

namespace glint::null {

using namespace detail;

namespace {

constexpr StageMask transition_slot = 1u << stage_count;
constexpr StageMask all_slots = (1u << (stage_count + 1)) - 1;
/// Signals of a queue that are kept; a wait for an older one orders nothing here.
constexpr size_t signal_limit = 4096;
/// Writes to different parts of a buffer that are remembered.
constexpr size_t write_limit = 64;

template <class Visitor>
void forEachStage(StageMask stages, Visitor&& visit) {
    for (size_t i = 0; i <= stage_count; i++)
        if (stages & (1u << i)) visit(i);
}

std::string stageNames(StageMask stages) {
    std::string names;
    for (size_t i = 0; i < stage_count; i++)
        if (stages & (1u << i)) names += (names.empty() ? "" : "|") + std::string(toString(static_cast<Stage>(i)));
    return names.empty() ? "nothing" : names;
}

const char* queueName(Queue queue) {
    switch (queue) {
        case Queue::Main: return "main";
        case Queue::Compute: return "compute";
        case Queue::Copy: return "copy";
        case Queue::Count: break;
    }
    return "unknown";
}

// Vulkan, "Pipeline Stages": the order of the stages of one command. Depth tests come both before and after the
// fragment shader, so it holds neither all of them before itself nor all after.
constexpr StageMask front_end = bit(Stage::Indirect) | bit(Stage::VertexInput) | bit(Stage::VertexShader);

constexpr StageMask earlierStages(Stage stage) {
    switch (stage) {
        case Stage::VertexInput:
        case Stage::Compute:
        case Stage::RayTracing: return bit(Stage::Indirect);
        case Stage::VertexShader: return bit(Stage::Indirect) | bit(Stage::VertexInput);
        case Stage::Fragment: return front_end;
        case Stage::DepthTarget: return front_end | bit(Stage::Fragment);
        case Stage::ColorTarget: return front_end | bit(Stage::Fragment) | bit(Stage::DepthTarget);
        default: return 0;
    }
}

constexpr StageMask laterStages(Stage stage) {
    constexpr StageMask back_end = bit(Stage::Fragment) | bit(Stage::DepthTarget) | bit(Stage::ColorTarget);
    switch (stage) {
        case Stage::Indirect:
            return bit(Stage::VertexInput) | bit(Stage::VertexShader) | back_end | bit(Stage::Compute) |
                   bit(Stage::RayTracing);
        case Stage::VertexInput: return bit(Stage::VertexShader) | back_end;
        case Stage::VertexShader: return back_end;
        case Stage::Fragment: return bit(Stage::ColorTarget);
        case Stage::DepthTarget: return bit(Stage::Fragment) | bit(Stage::ColorTarget);
        default: return 0;
    }
}

/// `stages` and those of its pipeline before or after them.
template <StageMask others(Stage)>
StageMask extended(StageMask stages) {
    StageMask all = stages & all_slots;
    for (size_t i = 0; i < stage_count; i++)
        if (stages & (1u << i)) all |= others(static_cast<Stage>(i));
    return all;
}

bool isTargetStage(Stage stage) { return stage == Stage::ColorTarget || stage == Stage::DepthTarget; }

bool overlap(const Slice& a, const Slice& b) {
    return a.mip < b.mip + b.mips && b.mip < a.mip + a.mips && a.layer < b.layer + b.layers &&
           b.layer < a.layer + a.layers;
}

}  // namespace

const char* toString(CommandType type) {
    switch (type) {
        case CommandType::Dispatch: return "dispatch";
        case CommandType::DispatchIndirect: return "indirect dispatch";
        case CommandType::SideDispatches: return "dispatches";
        case CommandType::TraceRays: return "dispatch of rays";
        case CommandType::TraceRaysIndirect: return "indirect dispatch of rays";
        case CommandType::BeginTarget: return "begin of target";
        case CommandType::EndTarget: return "end of target";
        case CommandType::Draw: return "draw";
        case CommandType::DrawIndexed: return "indexed draw";
        case CommandType::DrawIndirect: return "indirect draw";
        case CommandType::DrawIndexedIndirect: return "indirect indexed draw";
        case CommandType::DrawMesh: return "mesh draw";
        case CommandType::DrawMeshIndirect: return "indirect mesh draw";
        case CommandType::CopyInline: return "inline copy";
        case CommandType::CopyBuffer: return "copy of buffer";
        case CommandType::FillBuffer: return "fill of buffer";
        case CommandType::CopyBufferToTexture: return "copy to texture";
        case CommandType::CopyTextureToBuffer: return "copy from texture";
        case CommandType::CopyTexture: return "copy of texture";
        case CommandType::ClearTexture: return "clear of texture";
        case CommandType::BuildTracings: return "build";
        case CommandType::CopyTracing: return "copy of structure";
        case CommandType::WriteTracingSize: return "size of structure";
        case CommandType::BeginQuery: return "begin of query";
        case CommandType::EndQuery: return "end of query";
        case CommandType::PushRegion: return "begin of region";
        case CommandType::PopRegion: return "end of region";
        case CommandType::HostRead: return "read by the CPU";
        case CommandType::Present: return "presentation";
        case CommandType::Barrier: return "barrier";
        case CommandType::Count: break;
    }
    return "end of list";
}

const char* toString(Stage stage) {
    switch (stage) {
        case Stage::Indirect: return "Indirect";
        case Stage::VertexInput: return "VertexInput";
        case Stage::VertexShader: return "VertexShader";
        case Stage::Fragment: return "Fragment";
        case Stage::ColorTarget: return "ColorTarget";
        case Stage::DepthTarget: return "DepthTarget";
        case Stage::Compute: return "Compute";
        case Stage::RayTracing: return "RayTracing";
        case Stage::Copy: return "Copy";
        case Stage::Build: return "Build";
        case Stage::Host: return "Host";
        case Stage::Count: break;
    }
    return "unknown";
}

const char* toString(Layout layout) {
    switch (layout) {
        case Layout::Undefined: return "Undefined";
        case Layout::General: return "General";
        case Layout::Sampled: return "Sampled";
        case Layout::ColorTarget: return "ColorTarget";
        case Layout::DepthTarget: return "DepthTarget";
        case Layout::CopySource: return "CopySource";
        case Layout::CopyDestination: return "CopyDestination";
        case Layout::Present: return "Present";
        case Layout::None: return "None";
    }
    return "unknown";
}

void HazardChecker::Clock::join(const Clock& other) {
    for (size_t q = 0; q < queue_count; q++)
        for (size_t s = 0; s < slots; s++) at[q][s] = std::max(at[q][s], other.at[q][s]);
}

void HazardChecker::Clock::raise(Queue queue, StageMask stages, uint64_t position) {
    forEachStage(stages, [&](size_t stage) { at[static_cast<size_t>(queue)][stage] = position; });
}

bool HazardChecker::Clock::reaches(Queue queue, StageMask stages, uint64_t position) const {
    bool reached = false;
    forEachStage(stages, [&](size_t stage) { reached |= at[static_cast<size_t>(queue)][stage] >= position; });
    return reached;
}

/// Where the judge stands within a submission.
struct HazardChecker::Now {
    Queue kind;
    QueueState& queue;
    uint64_t value;
    std::vector<Error>& findings;

    const CommandList* list = nullptr;
    std::vector<Resource*> resources = {};  // of the list, once looked up
    std::vector<bool> known = {};
    std::vector<const char*> regions = {};
    uint32_t place = 0;
    Site site = {};
    const CommandHeader* header = nullptr;

    const BeginTargetCommand* target = nullptr;
    std::vector<Access> attachments = {};
    std::vector<Access> accesses = {};  // of the command
    uint64_t target_id = 0;
};

template <class Visitor>
void HazardChecker::Resource::forEachPart(const Slice& slice, Visitor&& visit) {
    if (!texture) {
        visit(parts.front(), Slice{});
        return;
    }
    for (uint32_t layer = slice.layer; layer < std::min<uint32_t>(slice.layer + slice.layers, layers); layer++)
        for (uint32_t mip = slice.mip; mip < std::min<uint32_t>(slice.mip + slice.mips, mips); mip++)
            visit(parts[layer * mips + mip], Slice{static_cast<uint16_t>(mip), 1, static_cast<uint16_t>(layer), 1});
}

std::vector<Error> HazardChecker::judge(const Submission& submission) {
    std::vector<Error> findings;
    QueueState& queue = queues_[static_cast<size_t>(submission.queue)];
    Now now{.kind = submission.queue, .queue = queue, .value = submission.value, .findings = findings};
    for (const TimelinePoint& point : submission.waits) wait(queue, point);
    for (const ResolvedList& list : submission.lists) judgeList(now, list);
    signal(queue, submission.queue, submission.value);
    return findings;
}

// A wait is for the first signal that reaches its value. Its second scope is every command from here on.
void HazardChecker::wait(QueueState& queue, const TimelinePoint& point) {
    const QueueState& other = queues_[static_cast<size_t>(point.queue)];
    if (point.value <= other.forgotten) return;
    const auto signal = std::ranges::lower_bound(other.signals, point.value, {}, &Signal::value);
    if (signal == other.signals.end()) return;
    const Clock clock = signal->clock;
    queue.waited.join(clock);
    for (Scope& stage : queue.stages) {
        stage.ordered.join(clock);
        stage.available.join(clock);
        stage.visible.join(clock);
        stage.settled.join(clock);
    }
}

void HazardChecker::signal(QueueState& queue, Queue kind, uint64_t value) {
    Signal signal{value, queue.waited};
    for (const Scope& stage : queue.stages) signal.clock.join(stage.ordered);
    signal.clock.raise(kind, all_slots, queue.position);
    queue.signals.push_back(signal);
    if (queue.signals.size() > signal_limit) {
        queue.forgotten = queue.signals.front().value;
        queue.signals.pop_front();
    }
}

void HazardChecker::judgeList(Now& now, const ResolvedList& list) {
    now.list = list.list;
    now.resources.assign(list.list->resources.size(), nullptr);
    now.known.assign(list.list->resources.size(), false);
    now.regions.clear();
    now.place = place(now);
    now.target = nullptr;
    now.target_id = 0;
    now.attachments.clear();

    size_t next = 0;
    const auto judgeBarriers = [&](uint32_t command) {
        for (; next < list.barriers.size() && list.barriers[next].command <= command; next++) {
            const Barrier& barrier = list.barriers[next];
            judgeBarrier(now, barrier, list.images.subspan(barrier.first_image, barrier.image_count));
        }
    };
    const auto setSite = [&](uint32_t index, CommandType type, bool untracked) {
        now.site = {.queue = now.kind,
                    .value = now.value,
                    .command = index,
                    .place = now.place,
                    .type = type,
                    .transition = false,
                    .untracked = untracked};
    };
    forEachCommand(*list.list, [&](uint32_t index, const CommandHeader& header) {
        setSite(index, header.type, header.untracked);
        judgeBarriers(index);
        judgeCommand(now, header);
    });
    setSite(list.list->command_count, CommandType::Count, false);
    judgeBarriers(list.list->command_count);
}

void HazardChecker::judgeCommand(Now& now, const CommandHeader& header) {
    const CommandList& list = *now.list;
    now.queue.position++;
    now.header = &header;
    switch (header.type) {
        case CommandType::BeginTarget:
            now.target = reinterpret_cast<const BeginTargetCommand*>(&header);
            now.target_id = ++targets_;
            break;
        case CommandType::PushRegion:
            now.regions.push_back(list.at<char>(reinterpret_cast<const RegionCommand&>(header).name));
            now.place = place(now);
            break;
        case CommandType::PopRegion:
            if (!now.regions.empty()) now.regions.pop_back();
            now.place = place(now);
            break;
        case CommandType::SideDispatches:
            judgeSides(now, reinterpret_cast<const SideDispatchesCommand&>(header));
            break;
        default: break;
    }
    now.accesses.clear();
    const auto collect = [&](uint32_t first, uint32_t count) {
        for (const Access& one : std::span(list.accesses).subspan(first, count)) {
            const bool attached = now.target && isTargetStage(one.stage);
            if (attached && header.type == CommandType::BeginTarget) now.attachments.push_back(one);
            if (attached || !now.target || !isAttachment(now, one)) {
                now.accesses.push_back(one);
                continue;
            }
            report(
                now, "hazard.feedback", one.resource,
                fmt::format("{} accesses an attachment of its target at {}", describe(now.site), toString(one.stage)));
        }
    };
    collect(header.first_access, header.access_count);
    collect(header.first_shared, header.shared_count);
    access(now, now.accesses);

    // Draws between the two write the attachments too: the end stands for them all.
    if (header.type == CommandType::EndTarget && now.target) {
        accessAttachments(now, AccessWrite);
        for (uint32_t i = 0; i < now.target->color_count; i++) dropContents(now, now.target->colors[i]);
        dropContents(now, now.target->depth);
        now.target = nullptr;
        now.target_id = 0;
        now.attachments.clear();
    }
}

void HazardChecker::judgeSides(Now& now, const SideDispatchesCommand& command) {
    struct Part {
        uint32_t dispatch;
        bool is_written;
        ByteRange range;
        bool meets(const Part& other) const {
            return dispatch != other.dispatch && (is_written || other.is_written) && range.meets(other.range);
        }
    };
    const CommandList& list = *now.list;
    std::map<uint32_t, std::vector<Part>> parts;
    for (uint32_t i = 0; i < command.count; i++) {
        const SideDispatch& dispatch = list.at<SideDispatch>(command.dispatches)[i];
        for (const Access& one : std::span(list.accesses).subspan(dispatch.first_access, dispatch.access_count))
            parts[one.resource].push_back(
                {i, (one.flags & AccessWrite) != 0, touchedRange(list, dispatch, one.resource)});
    }
    for (const auto& [resource, all] : parts) {
        if (std::ranges::none_of(all, &Part::is_written)) continue;
        for (size_t i = 0; i < all.size(); i++) {
            const auto met = std::find_if(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(i),
                                          [&](const Part& before) { return before.meets(all[i]); });
            if (met == all.begin() + static_cast<std::ptrdiff_t>(i)) continue;
            report(now, "hazard.side_by_side", resource,
                   fmt::format("{}: number {} {} what number {} {}, and they run side by side", describe(now.site),
                               all[i].dispatch, all[i].is_written ? "writes" : "reads", met->dispatch,
                               met->is_written ? "writes" : "reads"));
            break;
        }
    }
}

// All barriers of one command are taken at once: none of them is ordered after another.
void HazardChecker::judgeBarrier(Now& now, const Barrier& barrier, std::span<const ImageBarrier> images) {
    const bool within = now.target != nullptr;
    if (within != barrier.split) {
        const char* what = within ? "does not split the target around it" : "splits a target, but none is open";
        report(now, "hazard.split", none, fmt::format("the barrier before {} {}", describe(now.site), what));
    }
    if (within) {
        now.queue.position++;
        accessAttachments(now, AccessWrite);
    }

    const Scope memory = gather(now, barrier.source);
    std::vector<Scope> sources;
    for (const ImageBarrier& image : images) sources.push_back(gather(now, image.source));
    now.queue.position++;
    forEachStage(extended<laterStages>(barrier.destination), [&](size_t stage) {
        Scope& scope = now.queue.stages[stage];
        scope.ordered.join(memory.ordered);
        scope.available.join(memory.visible);
        if (!(barrier.destination & (1u << stage))) return;
        scope.visible.join(memory.visible);
        scope.settled.join(memory.settled);
    });
    for (size_t i = 0; i < images.size(); i++) {
        transition(now, images[i], sources[i]);
        forEachStage(extended<laterStages>(images[i].destination), [&](size_t stage) {
            now.queue.stages[stage].ordered.join(sources[i].ordered);
            now.queue.stages[stage].available.join(sources[i].available);
        });
    }

    if (within) {
        now.target_id = ++targets_;
        now.queue.position++;
        accessAttachments(now, AccessRead | AccessWrite);  // loaded again
    }
}

HazardChecker::Scope HazardChecker::gather(const Now& now, StageMask stages) const {
    Scope scope;
    const StageMask earlier = extended<earlierStages>(stages);
    forEachStage(earlier, [&](size_t stage) {
        scope.ordered.join(now.queue.stages[stage].ordered);
        scope.available.join(now.queue.stages[stage].available);
    });
    if (stages & stage_all) {
        scope.ordered.join(now.queue.waited);
        scope.available.join(now.queue.waited);
    }
    scope.visible = scope.available;
    scope.ordered.raise(now.kind, earlier, now.queue.position);
    scope.visible.raise(now.kind, stages & all_slots, now.queue.position);
    scope.settled = scope.ordered;
    return scope;
}

void HazardChecker::transition(Now& now, const ImageBarrier& image, const Scope& source) {
    Resource* resource = find(now, image.resource);
    if (!resource || !resource->texture) return;
    Use use{.stages = static_cast<StageMask>((image.destination & all_slots) | transition_slot),
            .position = now.queue.position,
            .site = now.site};
    use.site.transition = true;
    resource->forEachPart(image.slice, [&](History& history, const Slice& part) {
        if (image.from != Layout::Undefined && image.from != history.layout) {
            report(now, "hazard.layout", image.resource,
                   fmt::format("{} of mip level {}, layer {} is from layout {}, not from {}", describe(use.site),
                               part.mip, part.layer, toString(image.from), toString(history.layout)));
        }
        for (const Use& write : history.writes) {
            const Clock& seen = write.site.transition ? source.settled : source.visible;
            if (seen.reaches(write.site.queue, write.stages, write.position)) continue;
            reportConflict(now, "hazard.write_after_write", image.resource, part, write, use);
            break;
        }
        for (const Use& read : history.reads) {
            if (source.ordered.reaches(read.site.queue, read.stages, read.position)) continue;
            reportConflict(now, "hazard.write_after_read", image.resource, part, read, use);
            break;
        }
        if (image.from == Layout::Undefined) {
            history.discarded |= history.written;
            history.discard = use.site;
            history.written = false;
        }
        history.layout = image.to;
        history.writes = {use};
        history.reads.clear();
    });
}

// All accesses of a command are compared with what was before it, and only then remembered.
void HazardChecker::access(Now& now, std::span<const Access> accesses) {
    for (const Access& one : accesses)
        if (Resource* resource = find(now, one.resource))
            resource->forEachPart(one.slice,
                                  [&](History& history, const Slice& part) { check(now, one, history, part); });
    for (const Access& one : accesses)
        if (Resource* resource = find(now, one.resource))
            resource->forEachPart(one.slice, [&](History& history, const Slice&) { record(now, one, history); });
}

bool HazardChecker::isVisible(const Now& now, const Use& write, const Use& use) const {
    if ((use.target != 0 && write.target == use.target) || !write.range.meets(use.range)) return true;
    if (write.site.transition && write.site.queue == now.kind && (write.stages & use.stages)) return true;
    bool visible = false;
    forEachStage(use.stages, [&](size_t stage) {
        const Scope& scope = now.queue.stages[stage];
        const Clock& seen = write.site.transition ? scope.settled : scope.visible;
        visible |= seen.reaches(write.site.queue, write.stages, write.position);
    });
    return visible;
}

bool HazardChecker::isOrdered(const Now& now, const Use& read, const Use& use) const {
    if ((use.target != 0 && read.target == use.target) || !read.range.meets(use.range)) return true;
    bool ordered = false;
    forEachStage(use.stages, [&](size_t stage) {
        ordered |= now.queue.stages[stage].ordered.reaches(read.site.queue, read.stages, read.position);
    });
    return ordered;
}

void HazardChecker::check(Now& now, const Access& access, const History& history, const Slice& part) {
    const Use use = makeUse(now, access);
    if (access.layout != history.layout) {
        report(now, "hazard.layout", access.resource,
               fmt::format("{} expects mip level {}, layer {} in layout {}, not in {}", describe(now.site), part.mip,
                           part.layer, toString(access.layout), toString(history.layout)));
    }
    if ((access.flags & AccessRead) && history.discarded) {
        report(now, "hazard.discard", access.resource,
               fmt::format("{} reads mip level {}, layer {}, whose contents {} dropped", describe(now.site), part.mip,
                           part.layer, describe(history.discard)));
    }
    for (const Use& write : history.writes) {
        if (isVisible(now, write, use)) continue;
        reportConflict(now, access.flags & AccessRead ? "hazard.read_after_write" : "hazard.write_after_write",
                       access.resource, part, write, use);
        break;
    }
    if (!(access.flags & AccessWrite)) return;
    for (const Use& read : history.reads) {
        if (isOrdered(now, read, use)) continue;
        reportConflict(now, "hazard.write_after_read", access.resource, part, read, use);
        break;
    }
}

void HazardChecker::record(Now& now, const Access& access, History& history) {
    const Use use = makeUse(now, access);
    if (access.flags & AccessWrite) {
        // Whatever comes after this write comes after what it covers.
        const auto covered = [&](const Use& earlier) {
            return (earlier.site.queue != now.kind || earlier.position != use.position) &&
                   use.range.covers(earlier.range);
        };
        std::erase_if(history.writes, covered);
        std::erase_if(history.reads, covered);
        if (history.writes.size() >= write_limit) history.writes.erase(history.writes.begin());
        history.writes.push_back(use);
        history.written = true;
        if (access.flags & AccessDiscard) history.discarded = false;
        return;
    }
    // When the CPU reads is not the queues' affair: the program waits before, and submits what overwrites it after.
    if (access.stage == Stage::Host) return;
    // A stage's later read stands for its earlier ones: whatever is ordered after it is ordered after them.
    const auto same = std::ranges::find_if(
        history.reads, [&](const Use& read) { return read.site.queue == now.kind && read.stages == use.stages; });
    if (same == history.reads.end()) {
        history.reads.push_back(use);
        return;
    }
    const ByteRange both{std::min(same->range.begin, use.range.begin), std::max(same->range.end, use.range.end)};
    *same = use;
    same->range = both;
}

HazardChecker::Use HazardChecker::makeUse(const Now& now, const Access& access) const {
    const bool is_free = now.site.untracked && access.layout == Layout::None;
    return {.stages = bit(access.stage),
            .position = now.queue.position,
            .target = isTargetStage(access.stage) ? now.target_id : 0,
            .range = is_free ? touchedRange(*now.list, *now.header, access.resource) : ByteRange{},
            .site = now.site};
}

void HazardChecker::accessAttachments(Now& now, uint8_t flags) {
    std::vector<Access> attachments = now.attachments;
    for (Access& attachment : attachments)
        attachment.flags = attachment.flags & AccessWrite ? flags : static_cast<uint8_t>(AccessRead);
    access(now, attachments);
}

// Who asked for a store that keeps nothing may read what comes: that is no discard of the barriers.
void HazardChecker::dropContents(Now& now, const Attachment& attachment) {
    if (attachment.texture == none || attachment.store != StoreOperation::Discard) return;
    Resource* resource = find(now, attachment.texture);
    if (!resource || !resource->texture) return;
    resource->forEachPart(attachment.slice,
                          [](History& history, const Slice&) { history.written = history.discarded = false; });
}

bool HazardChecker::isAttachment(Now& now, const Access& access) {
    const Resource* resource = find(now, access.resource);
    return resource && resource->texture && std::ranges::any_of(now.attachments, [&](const Access& attachment) {
               return find(now, attachment.resource) == resource && overlap(attachment.slice, access.slice);
           });
}

HazardChecker::Resource* HazardChecker::find(Now& now, uint32_t index) {
    if (index >= now.resources.size()) return nullptr;
    if (!now.known[index]) {
        now.known[index] = true;
        const HazardResource found = resolve_(now.list->resources[index]);
        if (found.id == 0) return nullptr;
        Resource& resource = resources_[found.id];
        if (resource.parts.empty()) {
            resource.texture = found.mips != 0;
            resource.mips = std::max(found.mips, 1u);
            resource.layers = std::max(found.layers, 1u);
            resource.parts.resize(size_t(resource.mips) * resource.layers);
            if (!resource.texture) resource.parts.front().layout = Layout::None;
        }
        now.resources[index] = &resource;
    }
    return now.resources[index];
}

uint32_t HazardChecker::place(const Now& now) {
    std::string text = now.list->label.empty() ? "" : fmt::format(" of '{}'", now.list->label);
    for (size_t i = 0; i < now.regions.size(); i++) text += (i == 0 ? " in " : "/") + std::string(now.regions[i]);
    const auto found = place_index_.find(text);
    if (found != place_index_.end()) return found->second;
    const auto index = static_cast<uint32_t>(places_.size());
    places_.push_back(text);
    place_index_.emplace(std::move(text), index);
    return index;
}

// "the transition before dispatch 3 of 'blur' in shade/soft (compute 12)": queue and submission stand in brackets.
std::string HazardChecker::describe(const Site& site) const {
    return fmt::format("{}{} {}{} ({} {})", site.transition ? "the transition before " : "", toString(site.type),
                       site.command, places_[site.place], queueName(site.queue), site.value);
}

void HazardChecker::report(Now& now, const char* id, uint32_t resource, std::string message) {
    std::string name = resource < now.list->resources.size() ? label_(now.list->resources[resource]) : std::string();
    if (!name.empty()) message = name + ": " + message;
    const ErrorCode code = now.site.untracked ? ErrorCode::InvalidArgument : ErrorCode::Internal;
    now.findings.push_back(Error::inFile(code, id, std::move(message), {}, 0).named(std::move(name)));
}

void HazardChecker::reportConflict(Now& now, const char* id, uint32_t resource, const Slice& part, const Use& earlier,
                                   const Use& later) {
    const std::string_view kind = id;
    const char* did = kind == "hazard.write_after_read" ? "read" : "wrote";
    const char* does = kind == "hazard.read_after_write" ? "reads" : "writes";
    const std::string where =
        part.mips == 0 ? std::string() : fmt::format("mip level {}, layer {}: ", part.mip, part.layer);
    report(now, id, resource,
           fmt::format("{}{} {} at {} what {} {} at {}; {}", where, describe(later.site), does,
                       stageNames(later.stages), describe(earlier.site), did, stageNames(earlier.stages),
                       kind == "hazard.write_after_read" ? "nothing orders them"
                                                         : "nothing makes the write visible to it"));
}

}  // namespace glint::null
