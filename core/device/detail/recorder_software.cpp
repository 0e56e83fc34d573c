#include <glint/device/detail/recorder_core.h>
#include <glint/device/detail/software_tracing.h>
#include <glint/tracing/detail/header.h>
#include <glint/tracing/detail/instances.h>

#include <algorithm>
#include <cstddef>
#include <cstring>

namespace glint::detail {

namespace {

/// Bytes between the references of a rewritten shader's block (core/shader/ray_query_linker.h).
constexpr uint32_t reference_stride = 16;

/// How often what a top level refers to has moved.
BufferObject* dataOf(const TracingObject& tracing, uint32_t geometry) {
    if (tracing.tracing_type == Tracing::TypeInstance) return tracing.instance_buffer.get();
    const TracingGeometry& from = tracing.geometries[geometry];
    return static_cast<BufferObject*>(from.bound_buffer ? from.bound_buffer : from.vertex_buffer);
}

/// A top level whose references' boxes the host knows.
bool isBoundedOnHost(const TracingObject& tracing) {
    return tracing.tracing_type == Tracing::TypeInstance &&
           std::ranges::all_of(tracing.references, [](const Ref<TracingObject>& reference) {
               return softwareOf(*reference).bounds.has_value();
           });
}

uint64_t movesOf(const std::vector<Ref<TracingObject>>& references) {
    uint64_t moves = 0;
    for (const Ref<TracingObject>& reference : references) moves += reference->moves;
    return moves;
}

}  // namespace

void RecorderCore::buildInSoftware(std::span<TracingObject* const> tracings, std::span<const uint64_t> offsets,
                                   BufferObject& scratch, bool update, Where where) {
    for (size_t i = 0; i < tracings.size(); i++) {
        TracingObject& tracing = *tracings[i];
        if (!checkReferences(tracing, where)) return;
        const bool done = isBoundedOnHost(tracing) ? buildInstancesOnHost(tracing, where)
                                                   : buildOnDevice(tracing, scratch, offsets[i], update, where);
        if (!done) return;
        confirmBuild(tracing);
    }
}

bool RecorderCore::buildOnDevice(TracingObject& tracing, BufferObject& scratch, uint64_t scratch_offset, bool update,
                                 Where where) {
    TracingHeap& heap = *device_->heap();
    const uint32_t resource = use(tracing);
    SoftwareTracing& native = softwareOf(tracing);
    const bool is_top = tracing.tracing_type == Tracing::TypeInstance;
    const DeviceInput input = deviceInput(tracing);
    if (!update && native.range.texels < native.device_texels) {
        // Room for any tree that the device may build, which becomes the structure's when the list is played.
        Expected<TracingHeap::Range> range = heap.allocate(native.device_texels, where);
        if (!range) {
            fail(range.error().at(where));
            return false;
        }
        placements_.push_back({Placement::Kind::Move, static_cast<uint32_t>(moves_.size()), resource});
        moves_.push_back(std::move(*range));
    }
    const uint32_t alignment = device_->features().storageAlignment;
    const Expected<BuildPlan> plan =
        update && !is_top ? planRefit(input, native.nodes, 0, alignment) : planBuild(input, 0, alignment);
    if (!plan) {
        fail(makeError(where, plan.error().code(), plan.error().id().data(), "{}: {}", tracing.label(),
                       plan.error().message()));
        return false;
    }
    PendingBuilds::Copy instances;
    if (is_top && !writeDeviceInstances(tracing, instances, where)) return false;

    const PendingBuilds::Scratch memory = {use(scratch), scratch_offset, scratch_offset + plan->scratch};
    passes_.clear();
    build_accesses_.clear();
    const auto read = [&](Object& object) {
        build_accesses_.push_back({use(object), Stage::Compute, AccessRead, Layout::None, {}});
    };
    build_accesses_.push_back({resource, Stage::Compute, AccessRead | AccessWrite, Layout::None, {}});
    for (const Ref<TracingObject>& reference : tracing.references) read(*reference);
    for (const BuildPass& pass : plan->passes)
        if (!preparePass(pass, tracing, memory, where)) return false;
    if (!pending_.takes(build_accesses_, memory)) playPending();
    pending_.add(build_accesses_, memory, passes_);
    if (instances.size) pending_.add(instances);

    if (is_top) placements_.push_back({Placement::Kind::Built, 0, resource});
    native.bounds.reset();
    if (!update) native.nodes = native.device_nodes;
    return true;
}

bool RecorderCore::writeDeviceInstances(TracingObject& tracing, PendingBuilds::Copy& copy, Where where) {
    if (tracing.instance_data.empty()) return true;
    const uint64_t size = tracing.instance_data.size() * sizeof(DeviceInstance);
    if (!tracing.instance_buffer || tracing.instance_buffer->size < size) {
        NativeBufferDesc desc;
        desc.size = std::max<uint64_t>(tracing.instances, 1) * sizeof(DeviceInstance);
        desc.flags = Buffer::FlagStorage;
        desc.name = "instances";
        Expected<Ref<BufferObject>> made = device_->createInternal(desc, where);
        if (!made) {
            fail(made.error());
            return false;
        }
        tracing.instance_buffer = std::move(*made);
    }
    const uint32_t place = appendInline(nullptr, size, 16);
    for (size_t i = 0; i < tracing.instance_data.size(); i++) {
        const Tracing::Instance& from = tracing.instance_data[i];
        DeviceInstance to = {};
        std::copy(std::begin(from.transform), std::end(from.transform), to.transform);
        to.texel = DeviceInstance::none;
        to.custom_index_mask = from.data | from.mask << 24;
        to.offset_flags = from.offset | from.flags << 24;
        const auto at = static_cast<uint32_t>(place + i * sizeof(to));
        std::memcpy(list_.inline_data.data() + at, &to, sizeof(to));
        if (TracingObject* bottom = tracing.instance_tracings[i])
            placements_.push_back(
                {Placement::Kind::Instance, at + static_cast<uint32_t>(offsetof(DeviceInstance, texel)), use(*bottom)});
    }
    copy = {use(*tracing.instance_buffer), place, size};
    return true;
}

bool RecorderCore::preparePass(const BuildPass& pass, TracingObject& tracing, const PendingBuilds::Scratch& scratch,
                               Where where) {
    TracingHeap& heap = *device_->heap();
    const Expected<KernelObject*> kernel = heap.kernel(pass.kernel);
    if (!kernel) {
        fail(kernel.error().at(where));
        return false;
    }
    const bool uses_heap = usesHeap(pass.kernel);
    const uint32_t heap_resource = use(heap.texels());

    std::vector<BoundResource>& elements = pass_elements_;
    elements.clear();
    const auto bind = [&](uint32_t resource, uint64_t offset, uint64_t size) {
        BoundResource& element = elements.emplace_back();
        element.resource = resource;
        element.offset = offset;
        element.size = size;
        element.format = FormatRGBAu32;
    };
    if (uses_heap && heap.form() != HeapForm::Address)
        for (uint32_t i = 0; i < heap.buffers(); i++) bind(heap_resource, i * heap_buffer_size, whole_buffer);
    bind(scratch.buffer, scratch.begin, scratch.end - scratch.begin);
    for (uint32_t i = 0; i < pass.input_count; i++) {
        const BuildBinding& input = pass.inputs[i];
        if (input.buffer == BuildBinding::Buffer::Scratch) {
            bind(scratch.buffer, scratch.begin + input.offset, input.size);
            continue;
        }
        BufferObject& buffer = input.buffer == BuildBinding::Buffer::Data
                                   ? *dataOf(tracing, input.geometry)
                                   : *static_cast<BufferObject*>(tracing.geometries[input.geometry].index_buffer);
        const uint32_t resource = use(buffer);
        // Back ends make buffers of whole words.
        bind(resource, input.offset, std::min(input.size, (buffer.size + 3) / 4 * 4 - input.offset));
        const bool is_known =
            std::ranges::any_of(build_accesses_, [&](const Access& access) { return access.resource == resource; });
        if (!is_known) build_accesses_.push_back({resource, Stage::Compute, AccessRead, Layout::None, {}});
    }
    for (const BoundResource& element : elements)
        if (element.size != whole_buffer && element.size > device_->features().maxStorageSize) {
            fail(where, ErrorCode::OutOfRange, "tracing.device_build",
                 "{}: a build on the device would bind {} bytes of {}, the limit is {}", tracing.label(), element.size,
                 list_.resources[element.resource]->label(), device_->features().maxStorageSize);
            return false;
        }

    PendingBuilds::Pass& made = passes_.emplace_back();
    made.uses_heap = uses_heap;
    made.dispatch.kernel = use(**kernel);
    made.dispatch.groups = (pass.threads + (*kernel)->group_size[0] - 1) / (*kernel)->group_size[0];
    Bindings& bindings = made.dispatch.bindings;
    bindings.bound = append(elements.data(), elements.size() * sizeof(BoundResource), alignof(BoundResource));
    bindings.bound_count = static_cast<uint32_t>(elements.size());
    bindings.push = append(&pass.constants, sizeof(pass.constants), 4);
    bindings.push_size = sizeof(pass.constants);
    const auto constant = [&](size_t offset) { return bindings.push + static_cast<uint32_t>(offset); };
    placements_.push_back({Placement::Kind::Hierarchy, constant(offsetof(BuildConstants, hierarchy)), use(tracing)});
    if (heap.form() == HeapForm::Address)
        placements_.push_back(
            {Placement::Kind::Address, constant(offsetof(BuildConstants, heap_address)), heap_resource});
    return true;
}

void RecorderCore::playPending() {
    const auto count = [&] { return static_cast<uint32_t>(list_.accesses.size()); };
    for (const PendingBuilds::Copy& copy : pending_.copies()) {
        first_access_ = count();
        access(copy.buffer, Stage::Copy, AccessWrite);
        copyInline(copy.buffer, 0, copy.data, copy.size);
    }
    const uint32_t first = count();
    list_.accesses.insert(list_.accesses.end(), pending_.accesses().begin(), pending_.accesses().end());
    const uint32_t heap = use(device_->heap()->texels());
    const auto play = [&](std::span<const SideDispatch> dispatches, bool uses_heap, uint32_t shared, uint32_t size) {
        first_access_ = count();
        if (uses_heap) access(heap, Stage::Compute, AccessRead | AccessWrite);
        const uint32_t place = append(dispatches.data(), dispatches.size_bytes(), alignof(SideDispatch));
        auto& command = push<SideDispatchesCommand>(CommandType::SideDispatches);
        command.header.untracked = false;  // see buildTracings
        command.header.first_shared = shared;
        command.header.shared_count = size;
        command.dispatches = place;
        command.count = static_cast<uint32_t>(dispatches.size());
    };
    // Where the heap is bound, it is bound whole: the validation layers would see two dispatches write all of it.
    const bool is_bound = device_->heap()->form() != HeapForm::Address;
    for (uint32_t round = 0; round < pending_.rounds(); round++) {
        round_.clear();
        bool uses_heap = false;
        pending_.forEachPass(round, [&](const PendingBuilds::Pass& pass) {
            SideDispatch dispatch = pass.dispatch;
            dispatch.first_access += first;
            if (pass.uses_heap && is_bound)
                return play({&dispatch, 1}, true, dispatch.first_access, dispatch.access_count);
            round_.push_back(dispatch);
            uses_heap = uses_heap || pass.uses_heap;
        });
        if (!round_.empty()) play(round_, uses_heap, first, static_cast<uint32_t>(pending_.accesses().size()));
    }
    pending_.clear();
    shared_scratch_ = 0;
}

void RecorderCore::copyInline(uint32_t resource, uint64_t offset, uint32_t place, uint64_t size) {
    auto& command = push<CopyInlineCommand>(CommandType::CopyInline);
    command.header.untracked = false;  // see buildTracings
    command.buffer = resource;
    command.offset = offset;
    command.data = place;
    command.size = size;
}

bool RecorderCore::buildInstancesOnHost(TracingObject& tracing, Where where) {
    const Expected<Hierarchy> hierarchy = buildInstances(tracing);
    if (!hierarchy) {
        fail(hierarchy.error().at(where));
        return false;
    }
    SoftwareTracing& native = softwareOf(tracing);
    const uint32_t place = appendInline(hierarchy->texels.data(), hierarchy->bytes(), sizeof(Texel));
    const size_t first = place + readHeader(*hierarchy).first_instance * sizeof(Texel);
    for (size_t i = 0; i < tracing.instance_tracings.size(); i++) {
        if (!tracing.instance_tracings[i]) continue;
        placements_.push_back(
            {Placement::Kind::Instance,
             static_cast<uint32_t>(first + i * sizeof(InstanceRecord) + offsetof(InstanceRecord, texel)),
             use(*tracing.instance_tracings[i])});
    }
    const uint32_t resource = use(tracing);
    const uint32_t heap = use(device_->heap()->texels());
    placements_.push_back({Placement::Kind::Built, 0, resource});
    beginAccesses();
    access(heap, Stage::Copy, AccessWrite);
    access(resource, Stage::Copy, AccessWrite);
    copyInline(heap, uint64_t(native.range.first) * sizeof(Texel), place, hierarchy->bytes());
    native.bounds = boundsOf(*hierarchy);
    return true;
}

uint64_t RecorderCore::bindReferences(const ShaderResource& resource, Bound& bound) {
    const uint32_t size = resource.count * reference_stride;
    bound.references = appendInline(nullptr, size, device_->features().uniformAlignment, size);
    for (uint32_t i = 0; i < resource.count; i++) {
        const BoundResource& value = resource.count == 1 ? bound.value : bound.elements[i].value;
        placements_.push_back({Placement::Kind::Reference, bound.references + i * reference_stride, value.resource});
    }
    return size;
}

void RecorderCore::bindHidden(std::span<BoundResource> elements, uint32_t* offsets) {
    const std::vector<ShaderResource>& hidden = program_->layout.hidden;
    if (hidden.empty()) return;
    const uint32_t heap = use(device_->heap()->texels());
    for (size_t h = 0; h < hidden.size(); h++) {
        const ShaderResource& resource = hidden[h];
        const size_t index = program_->layout.resources.size() + h;
        if (resource.kind == SlotKind::Uniform) {
            if (heap_block_ == none) {
                heap_block_ = appendInline(nullptr, resource.size, device_->features().uniformAlignment, 16);
                placements_.push_back({Placement::Kind::Heap, heap_block_, heap});
            }
            offsets[program_->first_uniform[index]] = heap_block_;
        }
        if (!bindings_dirty_) continue;
        for (uint32_t e = 0; e < resource.count; e++) {
            BoundResource& element = elements[program_->first_element[index] + e];
            element = {};
            element.size = resource.kind == SlotKind::Uniform ? 16 : whole_buffer;
            if (resource.kind == SlotKind::Uniform) continue;
            element.resource = heap;
            element.offset = e * heap_buffer_size;
            element.format = FormatRGBAu32;
        }
        forEachStage(resource.stages, [&](Stage stage) { access(heap, stage, AccessRead); });
    }
}

Error RecorderCore::placeTracings() {
    for (const Placement& placement : placements_) {
        Object* const object = list_.resources[placement.resource];
        auto* const tracing = static_cast<TracingObject*>(object);  // unless it is about the heap
        std::byte* place = list_.inline_data.data() + placement.place;
        switch (placement.kind) {
            case Placement::Kind::Heap:
            case Placement::Kind::Address: {
                if (placement.kind == Placement::Kind::Address) place = list_.bytes.data() + placement.place;
                const uint64_t address = device_->heap()->address();
                std::memcpy(place, &address, sizeof(address));
                continue;
            }
            case Placement::Kind::Move:
                // An earlier build of the same submission may have moved it: that place is in use from here on.
                if (softwareOf(*tracing).range.texels < softwareOf(*tracing).device_texels)
                    device_->moveTracing(*tracing, std::move(moves_[placement.place]));
                continue;
            case Placement::Kind::Built: tracing->built_moves = movesOf(tracing->built_references); continue;
            case Placement::Kind::Reference:
                if (movesOf(tracing->built_references) == tracing->built_moves) break;
                return makeError(ErrorCode::InvalidArgument, "tracing.moved",
                                 "submit: the recorder '{}' traces {}, whose instances refer to structures that have "
                                 "been built anew since; it has to be built again",
                                 list_.label, tracing->label());
            case Placement::Kind::Hierarchy: place = list_.bytes.data() + placement.place; break;
            case Placement::Kind::Instance: break;
        }
        std::memcpy(place, &softwareOf(*tracing).range.first, sizeof(uint32_t));
    }
    return {};
}

}  // namespace glint::detail
