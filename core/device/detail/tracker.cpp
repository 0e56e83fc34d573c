#include <glint/device/detail/tracker.h>

#include <algorithm>
#include <bit>

namespace glint::detail {

namespace {

constexpr StageMask all_stages = static_cast<StageMask>((1u << stage_count) - 1);

/// Calls f(index) for each set bit.
template <class F>
void forEachStage(StageMask mask, F&& f) {
    for (unsigned bits = mask & all_stages; bits; bits &= bits - 1) f(static_cast<size_t>(std::countr_zero(bits)));
}

constexpr uint32_t no_barrier = 0xffffffffu;

}  // namespace

void Tracker::resolve(Queue queue, uint64_t value, std::span<const CommandList* const> lists) {
    queue_ = queue;
    now_ = &queues_[static_cast<size_t>(queue)];
    saved_ = *now_;
    value_ = value;
    epoch_++;
    barriers_.clear();
    images_.clear();
    resolved_.clear();
    waits_.clear();
    undo_.clear();
    known_ = {};

    ranges_.clear();
    for (const CommandList* list : lists) {
        const size_t first = barriers_.size();
        resolveList(*list);
        ranges_.push_back({first, barriers_.size() - first});
    }
    // The vectors have stopped growing: now spans into them stay valid.
    for (size_t i = 0; i < lists.size(); i++)
        resolved_.push_back({lists[i], std::span(barriers_).subspan(ranges_[i].first, ranges_[i].second), images_});
}

void Tracker::rollback() {
    for (size_t i = undo_.size(); i-- > 0;) *undo_[i].state = undo_[i].old;
    *now_ = saved_;
    undo_.clear();
}

void Tracker::resolveList(const CommandList& list) {
    const BeginTargetCommand* target = nullptr;
    forEachCommand(list, [&](uint32_t index, const CommandHeader& header) {
        position_ = ++now_->position;
        command_ = index;
        if (header.type == CommandType::BeginTarget) {
            target = reinterpret_cast<const BeginTargetCommand*>(&header);
            openBarrier(index, false);
            in_target_ = true;
        } else if (!in_target_) {
            // Most commands need no barrier; one is opened by the first access that does.
            barrier_ = no_barrier;
            barrier_position_ = position_;
        }
        if (header.type == CommandType::Barrier) {
            if (in_target_) split();
            require(all_stages, all_stages);
        }
        untracked_ = header.untracked;
        playAccesses(list, header);
        if (header.type == CommandType::EndTarget && target) {
            in_target_ = false;
            // Attachments are written until here, also by the parts that splits have made.
            const CommandHeader& begin = target->header;
            for (uint32_t i = 0; i < begin.access_count; i++)
                endAttachment(list, list.accesses[begin.first_access + i]);
        }
        if (!in_target_) closeBarrier();
    });
}

// All accesses are ordered after what was before the command, and only then remembered: no barrier lies between the
// stages of one command.
void Tracker::playAccesses(const CommandList& list, const CommandHeader& header) {
    const std::span own = std::span(list.accesses).subspan(header.first_access, header.access_count);
    const std::span shared = std::span(list.accesses).subspan(header.first_shared, header.shared_count);
    const auto isKnown = [&] {
        return known_.list == &list && known_.first == header.first_shared && known_.count == header.shared_count &&
               known_.untracked == untracked_ && known_.changes == changes_;
    };
    for (const Access& access : own) forEachState(list, access, &Tracker::order);
    if (!isKnown())
        for (const Access& access : shared) forEachState(list, access, &Tracker::order);
    for (const Access& access : own) forEachState(list, access, &Tracker::record);
    if (isKnown()) return;
    bool writes = false;
    for (const Access& access : shared) {
        forEachState(list, access, &Tracker::record);
        writes = writes || access.flags & AccessWrite;
    }
    known_ = {};
    if (!writes && !shared.empty()) known_ = {&list, header.first_shared, header.shared_count, untracked_, changes_};
}

void Tracker::openBarrier(uint32_t command, bool is_split) {
    barrier_ = static_cast<uint32_t>(barriers_.size());
    barrier_position_ = position_;
    barriers_.push_back({.command = command, .split = is_split});
    pending_images_.clear();
}

void Tracker::closeBarrier() {
    if (barrier_ == no_barrier) return;
    Barrier& barrier = barriers_[barrier_];
    barrier.first_image = static_cast<uint32_t>(images_.size());
    barrier.image_count = static_cast<uint32_t>(pending_images_.size());
    images_.insert(images_.end(), pending_images_.begin(), pending_images_.end());
    pending_images_.clear();
    barrier_ = no_barrier;
}

void Tracker::split() {
    closeBarrier();
    openBarrier(command_, true);
    // The second part loads what the first has stored.
    const StageMask attachments = bit(Stage::ColorTarget) | bit(Stage::DepthTarget);
    require(attachments, attachments);
}

void Tracker::require(StageMask source, StageMask destination) {
    changes_++;
    if (barrier_ == no_barrier) openBarrier(command_, false);
    Barrier& barrier = barriers_[barrier_];
    barrier.source |= source;
    barrier.destination |= destination;
    forEachStage(barrier.source, [&](size_t s) {
        forEachStage(barrier.destination, [&](size_t d) { now_->ordered[s][d] = barrier_position_; });
    });
}

bool Tracker::isOrdered(StageMask source, Stage destination, uint64_t position) const {
    bool ordered = true;
    forEachStage(source,
                 [&](size_t s) { ordered = ordered && now_->ordered[s][static_cast<size_t>(destination)] > position; });
    return ordered;
}

void Tracker::touch(ResourceState& state) {
    if (state.epoch == epoch_) return;
    undo_.push_back({&state, state});
    state.epoch = epoch_;
}

bool Tracker::waitFor(Queue queue, uint64_t value) {
    if (queue == queue_) return false;
    uint64_t& waited = now_->waited[static_cast<size_t>(queue)];
    if (waited >= value) return true;
    waited = value;
    for (TimelinePoint& wait : waits_) {
        if (wait.queue != queue) continue;
        wait.value = value;
        return true;
    }
    waits_.push_back({queue, value});
    return true;
}

void Tracker::forEachState(const CommandList& list, const Access& access, Step step) {
    Object* object = list.resources[access.resource];
    switch (object->type()) {
        case ObjectType::Buffer: (this->*step)(static_cast<BufferObject*>(object)->use, access, {}); break;
        case ObjectType::Tracing: (this->*step)(static_cast<TracingObject*>(object)->use, access, {}); break;
        case ObjectType::Texture: {
            auto* texture = static_cast<TextureObject*>(object);
            for (uint32_t layer = access.slice.layer; layer < access.slice.layer + access.slice.layers; layer++)
                for (uint32_t mip = access.slice.mip; mip < access.slice.mip + access.slice.mips; mip++)
                    (this->*step)(texture->use(mip, layer), access,
                                  {static_cast<uint16_t>(mip), 1, static_cast<uint16_t>(layer), 1});
            break;
        }
        default: break;
    }
}

void Tracker::order(ResourceState& state, const Access& access, const Slice& slice) {
    touch(state);
    const size_t queue = static_cast<size_t>(queue_);
    const StageMask stage = bit(access.stage);
    const bool write = access.flags & AccessWrite;
    const bool transition = access.layout != Layout::None && state.layout != access.layout;
    const bool changes = write || transition;

    // Work of other queues is ordered by a wait before the whole submission.
    bool waited = false;
    if (state.write_stages && state.write_queue != queue_) waited = waitFor(state.write_queue, state.write_value);
    if (changes)
        for (size_t q = 0; q < queue_count; q++)
            if (q != queue && state.reads[q].stages)
                waited = waitFor(static_cast<Queue>(q), state.reads[q].value) || waited;

    // What this queue did that has to come before.
    const bool own_write = state.write_stages && state.write_queue == queue_;
    const ResourceState::Reads& reads = state.reads[queue];
    StageMask source = 0;
    uint64_t newest = 0;
    if (own_write && !(state.visible & stage) && !isOrdered(state.write_stages, access.stage, state.write_position) &&
        (transition || !joinTransition(state, access, slice))) {
        source |= state.write_stages;
        newest = state.write_position;
    }
    if (changes && reads.stages && !isOrdered(reads.stages, access.stage, reads.position)) {
        source |= reads.stages;
        newest = std::max(newest, reads.position);
    }
    if (transition) {
        // The transition itself has to wait, so an earlier barrier to this stage is no substitute.
        if (own_write) newest = std::max(newest, state.write_position);
        if (reads.stages) newest = std::max(newest, reads.position);
    }

    const bool places = transition || (source && !untracked_);
    if (places && in_target_ && newest >= barrier_position_) split();

    if (transition) {
        StageMask before = 0;
        if (own_write) before |= state.write_stages;
        before |= reads.stages;
        if (waited) before |= stage_all;
        const Layout from = access.flags & AccessDiscard ? Layout::Undefined : state.layout;
        addTransition(access.resource, slice, from, access.layout, before, stage);
        state.layout = access.layout;
        state.write_value = value_;
        state.write_position = barrier_position_;
        state.write_stages = stage;
        state.visible = stage;
        state.write_queue = queue_;
        for (ResourceState::Reads& other : state.reads) other = {};
    } else if (source && !untracked_) {
        require(source, stage);
    }
}

void Tracker::record(ResourceState& state, const Access& access, const Slice&) {
    const StageMask stage = bit(access.stage);
    ResourceState::Reads& own = state.reads[static_cast<size_t>(queue_)];
    if (!(access.flags & AccessWrite)) {
        own.value = value_;
        own.position = position_;
        own.stages |= stage;
        return;
    }
    changes_++;
    const bool joins = state.write_queue == queue_ && state.write_position == position_ && !state.visible;
    state.write_value = value_;
    state.write_position = position_;
    state.write_stages = joins ? static_cast<StageMask>(state.write_stages | stage) : stage;
    state.visible = 0;
    state.write_queue = queue_;
    for (ResourceState::Reads& reads : state.reads)
        if (&reads != &own || reads.position != position_) reads = {};
}

bool Tracker::joinTransition(ResourceState& state, const Access& access, const Slice& slice) {
    if (!state.visible || state.write_position != barrier_position_) return false;
    bool joined = false;
    for (ImageBarrier& image : pending_images_) {
        if (image.resource != access.resource || !covers(image.slice, slice)) continue;
        image.destination |= bit(access.stage);
        joined = true;
    }
    if (!joined) return false;
    changes_++;
    state.visible |= bit(access.stage);
    state.write_stages |= bit(access.stage);
    return true;
}

void Tracker::endAttachment(const CommandList& list, const Access& access) {
    changes_++;
    auto* texture = static_cast<TextureObject*>(list.resources[access.resource]);
    for (uint32_t layer = access.slice.layer; layer < access.slice.layer + access.slice.layers; layer++)
        for (uint32_t mip = access.slice.mip; mip < access.slice.mip + access.slice.mips; mip++)
            texture->use(mip, layer).write_position = position_;
}

bool Tracker::covers(const Slice& range, const Slice& single) {
    return single.mip >= range.mip && single.mip < range.mip + range.mips && single.layer >= range.layer &&
           single.layer < range.layer + range.layers;
}

void Tracker::addTransition(uint32_t resource, const Slice& slice, Layout from, Layout to, StageMask source,
                            StageMask destination) {
    changes_++;
    if (barrier_ == no_barrier) openBarrier(command_, false);
    pending_images_.push_back({resource, slice, from, to, source, destination});
    // Subresources come mip by mip, then layer by layer: join neighbours, so that a whole texture is one transition.
    const auto alike = [](const ImageBarrier& a, const ImageBarrier& b) {
        return a.resource == b.resource && a.from == b.from && a.to == b.to && a.source == b.source &&
               a.destination == b.destination;
    };
    while (pending_images_.size() > 1) {
        ImageBarrier& last = pending_images_.back();
        ImageBarrier& before = pending_images_[pending_images_.size() - 2];
        if (!alike(before, last)) break;
        if (before.slice.layer == last.slice.layer && before.slice.layers == last.slice.layers &&
            before.slice.mip + before.slice.mips == last.slice.mip) {
            before.slice.mips = static_cast<uint16_t>(before.slice.mips + last.slice.mips);
        } else if (before.slice.mip == last.slice.mip && before.slice.mips == last.slice.mips &&
                   before.slice.layer + before.slice.layers == last.slice.layer) {
            before.slice.layers = static_cast<uint16_t>(before.slice.layers + last.slice.layers);
        } else {
            break;
        }
        pending_images_.pop_back();
    }
}

}  // namespace glint::detail
