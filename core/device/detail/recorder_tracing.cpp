#include <glint/device/detail/recorder_core.h>

#include <algorithm>
#include <bit>
#include <utility>

namespace glint::detail {

namespace {

// By bits and without a branch, which the compiler turns into a few vector instructions: thousands of instances pass
// here each frame.
bool isFinite(const float (&values)[12]) {
    constexpr uint32_t exponent = 0x7f800000u;
    uint32_t infinite = 0;
    for (const float value : values) infinite |= (std::bit_cast<uint32_t>(value) & exponent) == exponent;
    return !infinite;
}

}  // namespace

void RecorderCore::setInstances(const Tracing& tracing, std::span<const Tracing::Instance> instances, Where where) {
    if (!recording(where) || !usable(tracing, "setTracing", where)) return;
    auto* object = static_cast<TracingObject*>(tracing.object());
    if (object->tracing_type != Tracing::TypeInstance)
        return fail(where, ErrorCode::InvalidArgument, "tracing.type", "setTracing: {} is no top-level structure",
                    object->label());
    if (instances.size() > object->instances)
        return fail(where, ErrorCode::OutOfRange, "tracing.instances", "setTracing: {} instances, {} has room for {}",
                    instances.size(), object->label(), object->instances);

    // References are sorted to hold each once; the last one is remembered, as neighbours mostly share it. Until all are
    // known to be right, the object stays as it is.
    references_.clear();
    bottoms_.clear();
    bottoms_.reserve(instances.size());
    uint32_t largest_offset = 0;
    for (size_t i = 0; i < instances.size(); i++) {
        const Tracing::Instance& instance = instances[i];
        const auto complain = [&](const char* id, const std::string& text) {
            fail(where, ErrorCode::InvalidArgument, id, "setTracing: instance {} of {} {}", i, object->label(), text);
        };
        if (instance.data >> 24 || instance.offset >> 24 || instance.mask > 0xff)
            return complain("tracing.instance_bits",
                            fmt::format("has data {:#x}, offset {:#x}, mask {:#x}; the limits are 24, 24 and 8 bits",
                                        instance.data, instance.offset, instance.mask));
        if (!isFinite(instance.transform))
            return complain("tracing.instance_transform", "has a transform that is not finite");
        auto* bottom = instance.tracing ? static_cast<TracingObject*>(instance.tracing->object()) : nullptr;
        bottoms_.push_back(bottom);
        if (bottom) largest_offset = std::max(largest_offset, instance.offset);
        if (!bottom || (!references_.empty() && references_.back() == bottom)) continue;
        if (bottom->state() != ObjectState::Ready || bottom->device() != device_)
            return complain("tracing.instance_failed",
                            fmt::format("refers to {}, which is not usable", bottom->label()));
        if (bottom->tracing_type == Tracing::TypeInstance)
            return complain("tracing.instance_type",
                            fmt::format("refers to {}, a top-level structure", bottom->label()));
        references_.push_back(bottom);
    }
    std::sort(references_.begin(), references_.end());
    references_.erase(std::unique(references_.begin(), references_.end()), references_.end());
    if (!std::equal(references_.begin(), references_.end(), object->references.begin(), object->references.end(),
                    [](TracingObject* a, const Ref<TracingObject>& b) { return a == b.get(); })) {
        object->references.clear();
        for (TracingObject* reference : references_) object->references.emplace_back(reference);
    }
    object->instance_tracings.swap(bottoms_);
    object->largest_offset = largest_offset;
    object->instance_data.assign(instances.begin(), instances.end());
}

void RecorderCore::writeInstances(TracingObject& tracing) {
    if (tracing.instance_data.empty()) return;
    natives_.clear();
    for (TracingObject* bottom : tracing.instance_tracings)
        natives_.push_back(bottom ? bottom->nativeTracing() : nullptr);
    const uint64_t size = tracing.instance_data.size() * device_->backend->instanceSize();
    const uint32_t place = appendInline(nullptr, size, 16);
    device_->backend->writeInstances(tracing.instance_data, natives_, list_.inline_data.data() + place);
    const uint32_t resource = use(*tracing.instance_buffer);
    beginAccesses();
    access(resource, Stage::Copy, AccessWrite);
    auto& command = push<CopyInlineCommand>(CommandType::CopyInline);
    command.header.untracked = false;  // see buildTracings
    command.buffer = resource;
    command.data = place;
    command.size = size;
}

void RecorderCore::buildTracing(const Tracing& tracing, const Buffer& scratch, uint64_t offset, bool update,
                                Where where) {
    const char* what = update ? "updateTracing" : "buildTracing";
    if (!recording(where) || !usable(tracing, what, where) || !onQueue(Queue::Compute, what, where)) return;
    auto* object = static_cast<TracingObject*>(tracing.object());
    const uint64_t size = update ? object->nativeTracing()->update_size : object->nativeTracing()->build_size;
    if (update && !(object->flags & Tracing::FlagUpdate))
        return fail(where, ErrorCode::InvalidArgument, "tracing.update",
                    "updateTracing: {} was made without Tracing::FlagUpdate", object->label());
    if (update && !object->built)
        return fail(where, ErrorCode::InvalidArgument, "tracing.unbuilt", "updateTracing: {} has not been built",
                    object->label());
    if (object->compacted && !update)
        return fail(where, ErrorCode::InvalidArgument, "tracing.compacted",
                    "{}: {} has been compacted and cannot be built again", what, object->label());
    BufferObject* memory = nullptr;
    Ref<BufferObject> own;
    if (scratch.state() == ObjectState::Null) {
        // Behind what pending builds use, so that they run side by side; or in its place, one after the other.
        if (shared_scratch_ + size <= DeviceObject::scratch_limit) offset = shared_scratch_;
        Expected<Ref<BufferObject>> shared = device_->acquireScratch(offset + size, where);
        if (!shared && offset > 0) {
            offset = 0;
            shared = device_->acquireScratch(size, where);
        }
        if (!shared) return fail(shared.error());
        own = *shared;
        memory = own.get();
    } else {
        memory = usableBuffer(scratch, Buffer::FlagScratch, what, where);
        if (!memory) return;
        if (offset % device_->features().scratchAlignment)
            return fail(where, ErrorCode::InvalidArgument, "tracing.scratch_alignment",
                        "{}: scratch offset {} is not a multiple of {}", what, offset,
                        device_->features().scratchAlignment);
        if (offset > memory->size || memory->size - offset < size)
            return fail(where, ErrorCode::OutOfRange, "tracing.scratch",
                        "{}: {} needs {} bytes of scratch memory, {} has {} from offset {}", what, object->label(),
                        size, memory->label(), memory->size, offset);
    }
    buildTracings({&object, 1}, {&offset, 1}, *memory, update, where);
    const uint64_t alignment = device_->features().scratchAlignment;
    if (own && !pending_.isEmpty()) shared_scratch_ = (offset + size + alignment - 1) / alignment * alignment;
}

void RecorderCore::buildTracings(std::span<TracingObject* const> tracings, std::span<const uint64_t> offsets,
                                 BufferObject& scratch, bool update, Where where) {
    if (!recording(where)) return;
    if (!device_->heap()) return buildByDriver(tracings, offsets, scratch, update, where);
    buildInSoftware(tracings, offsets, scratch, update, where);
}

void RecorderCore::buildByDriver(std::span<TracingObject* const> tracings, std::span<const uint64_t> offsets,
                                 BufferObject& scratch, bool update, Where where) {
    const uint32_t scratch_resource = use(scratch);
    for (TracingObject* tracing : tracings)
        if (tracing->tracing_type == Tracing::TypeInstance) writeInstances(*tracing);
    builds_.clear();
    beginAccesses();
    access(scratch_resource, Stage::Build, AccessWrite);
    for (size_t i = 0; i < tracings.size(); i++) {
        TracingObject& tracing = *tracings[i];
        TracingBuild build;
        build.tracing = use(tracing);
        build.update = update;
        build.scratch = scratch_resource;
        build.scratch_offset = offsets[i];
        access(build.tracing, Stage::Build, static_cast<uint8_t>(update ? AccessRead | AccessWrite : AccessWrite));
        for (const Ref<BufferObject>& buffer : tracing.buffers) access(use(*buffer), Stage::Build, AccessRead);
        if (tracing.tracing_type == Tracing::TypeInstance) {
            if (!checkReferences(tracing, where)) return;
            for (const Ref<TracingObject>& reference : tracing.references)
                access(use(*reference), Stage::Build, AccessRead);
            build.instances = use(*tracing.instance_buffer);
            build.instance_count = static_cast<uint32_t>(tracing.instance_data.size());
            access(build.instances, Stage::Build, AccessRead);
        }
        confirmBuild(tracing);
        builds_.push_back(build);
    }
    const uint32_t place = append(builds_.data(), builds_.size() * sizeof(TracingBuild));
    auto& command = push<BuildTracingsCommand>(CommandType::BuildTracings);
    // Builds share instance records and scratch memory that the caller does not see, so they are always tracked.
    command.header.untracked = false;
    command.builds = place;
    command.count = static_cast<uint32_t>(builds_.size());
}

bool RecorderCore::checkReferences(const TracingObject& tracing, Where where) {
    for (const Ref<TracingObject>& reference : tracing.references)
        if (!reference->built) {
            fail(where, ErrorCode::InvalidArgument, "tracing.unbuilt",
                 "buildTracing: {} refers to {}, which has not been built", tracing.label(), reference->label());
            return false;
        }
    return true;
}

void RecorderCore::confirmBuild(TracingObject& tracing) {
    const bool same =
        std::equal(tracing.references.begin(), tracing.references.end(), tracing.built_references.begin(),
                   tracing.built_references.end(),
                   [](const Ref<TracingObject>& a, const Ref<TracingObject>& b) { return a.get() == b.get(); });
    if (!same) tracing.built_references = tracing.references;
    if (!tracing.built || !same) first_builds_.push_back(&tracing);
    tracing.built = true;
    tracing.built_offset = tracing.largest_offset;
}

void RecorderCore::copyTracing(TracingObject& destination, TracingObject& source, bool compact) {
    const uint32_t to = use(destination);
    const uint32_t from = use(source);
    beginAccesses();
    access(from, Stage::Build, AccessRead);
    access(to, Stage::Build, AccessWrite);
    auto& command = push<CopyTracingCommand>(CommandType::CopyTracing);
    command.source = from;
    command.destination = to;
    command.compact = compact;
}

void RecorderCore::writeTracingSize(TracingObject& tracing) {
    const uint32_t resource = use(tracing);
    beginAccesses();
    access(resource, Stage::Build, AccessRead);
    push<WriteTracingSizeCommand>(CommandType::WriteTracingSize).tracing = resource;
}

}  // namespace glint::detail
