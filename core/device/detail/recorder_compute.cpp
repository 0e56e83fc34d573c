#include <glint/device/detail/mipmaps.h>
#include <glint/device/detail/recorder_core.h>
#include <glint/device/detail/texture_layout.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace glint::detail {

namespace {

/// Larger uploads get staging memory of their own instead of a place in the list.
constexpr uint64_t inline_limit = 1u << 20;

}  // namespace

void RecorderCore::setKernel(const Kernel& kernel, Where where) {
    if (!recording(where) || !onQueue(Queue::Compute, "setKernel", where)) return;
    if (kernel.state() == ObjectState::Building) static_cast<KernelObject*>(kernel.object())->waitCreated();
    if (!usable(kernel, "setKernel", where)) return;
    setProgram(*static_cast<KernelObject*>(kernel.object()));
    traversal_ = nullptr;
}

void RecorderCore::setTraversal(const Traversal& traversal, uint32_t generation, Where where) {
    if (!recording(where) || !onQueue(Queue::Compute, "setTraversal", where)) return;
    auto* object = static_cast<TraversalObject*>(traversal.object());
    if (traversal.state() == ObjectState::Building) object->waitCreated();
    if (!usable(traversal, "setTraversal", where)) return;
    if (const uint32_t count = object->countRecords(RayTable::Generation); generation >= count)
        return fail(where, ErrorCode::OutOfRange, "traversal.generation",
                    "setTraversal: ray-generation shader {} of {}, which has {}", generation, object->label(), count);
    ray_generation_ = generation;
    traversal_ = object;
    if (!object->joined) return setProgram(*object);
    use(*object);
    setProgram(*object->joined);
}

void RecorderCore::dispatch(uint64_t width, uint64_t height, uint64_t depth, Where where) {
    if (!recording(where)) return;
    if (!program_)
        return fail(where, ErrorCode::InvalidArgument, "dispatch.kernel",
                    "dispatch: no kernel or traversal has been set");
    if (traversal_) return traceRays(width, height, depth, where);
    const auto& kernel = static_cast<const KernelObject&>(*program_);
    const Features& features = device_->features();
    const uint64_t threads[3] = {width, height, depth};
    const uint32_t limits[3] = {features.maxGroupCountX, features.maxGroupCountY, features.maxGroupCountZ};
    uint32_t groups[3];
    for (size_t i = 0; i < 3; i++) {
        if (threads[i] == 0) return;
        const uint64_t count = (threads[i] - 1) / kernel.group_size[i] + 1;
        if (count > limits[i])
            return fail(where, ErrorCode::OutOfRange, "dispatch.groups",
                        "dispatch: {} threads in groups of {} are {} groups along {}, the limit is {}", threads[i],
                        kernel.group_size[i], count, "xyz"[i], limits[i]);
        groups[i] = static_cast<uint32_t>(count);
    }
    if (!flushBindings("dispatch", where) || !flushPush("dispatch", where)) return;
    beginAccesses();
    auto& command = push<DispatchCommand>(CommandType::Dispatch);
    shareAccesses(command.header);
    command.kernel = program_resource_;
    command.bindings = bindings_;
    std::copy(groups, groups + 3, command.groups);
}

void RecorderCore::dispatchIndirect(const Buffer& buffer, uint64_t offset, Where where) {
    if (!recording(where)) return;
    if (!program_)
        return fail(where, ErrorCode::InvalidArgument, "dispatch.kernel",
                    "dispatchIndirect: no kernel or traversal has been set");
    if (traversal_ && !device_->features().indirectRays)
        return fail(where, ErrorCode::Unsupported, "dispatch.rays_indirect",
                    "dispatchIndirect: {} takes no counts of rays from a buffer", device_->info().name);
    BufferObject* object = usableBuffer(buffer, Buffer::FlagIndirect, "dispatchIndirect", where);
    if (!object) return;
    if (offset % 4 || offset > object->size || object->size - offset < 12)
        return fail(where, ErrorCode::OutOfRange, "dispatch.indirect",
                    "dispatchIndirect: 12 bytes at offset {} of {} of {} bytes; offsets are multiples of 4", offset,
                    object->label(), object->size);
    if (traversal_) return traceRaysIndirect(*object, offset, where);
    if (!flushBindings("dispatchIndirect", where) || !flushPush("dispatchIndirect", where)) return;
    const uint32_t resource = use(*object);
    beginAccesses();
    access(resource, Stage::Indirect, AccessRead);
    auto& command = push<DispatchIndirectCommand>(CommandType::DispatchIndirect);
    shareAccesses(command.header);
    command.kernel = program_resource_;
    command.bindings = bindings_;
    command.buffer = resource;
    command.offset = offset;
}

void RecorderCore::setBufferData(const Buffer& buffer, uint64_t offset, const void* data, uint64_t size, Where where) {
    if (!recording(where)) return;
    BufferObject* object = usableBuffer(buffer, Buffer::FlagNone, "setBuffer", where);
    if (!object || !inRange(*object, offset, size, "setBuffer", where) || size == 0) return;
    if (!data)
        return fail(where, ErrorCode::InvalidArgument, "copy.null", "setBuffer: {} bytes from a null pointer", size);
    const uint32_t resource = use(*object);
    if (size <= inline_limit) {
        const uint32_t place = appendInline(data, size, 16);
        beginAccesses();
        access(resource, Stage::Copy, AccessWrite);
        auto& command = push<CopyInlineCommand>(CommandType::CopyInline);
        command.buffer = resource;
        command.offset = offset;
        command.data = place;
        command.size = size;
        return;
    }
    const Expected<Ref<BufferObject>> staging = device_->createStaging(size, false, where);
    if (!staging) return fail(staging.error());
    std::memcpy((*staging)->nativeBuffer()->mapped, data, size);
    const uint32_t source = use(**staging);
    beginAccesses();
    access(source, Stage::Copy, AccessRead);
    access(resource, Stage::Copy, AccessWrite);
    auto& command = push<CopyBufferCommand>(CommandType::CopyBuffer);
    command.source = source;
    command.destination = resource;
    command.destination_offset = offset;
    command.size = size;
}

void RecorderCore::copyBuffer(const Buffer& destination, uint64_t destination_offset, const Buffer& source,
                              uint64_t source_offset, uint64_t size, Where where) {
    if (!recording(where)) return;
    BufferObject* to = usableBuffer(destination, Buffer::FlagNone, "copyBuffer", where);
    BufferObject* from = to ? usableBuffer(source, Buffer::FlagNone, "copyBuffer", where) : nullptr;
    if (!from || !inRange(*to, destination_offset, size, "copyBuffer", where) ||
        !inRange(*from, source_offset, size, "copyBuffer", where) || size == 0)
        return;
    if (to == from && destination_offset < source_offset + size && source_offset < destination_offset + size)
        return fail(where, ErrorCode::InvalidArgument, "copy.overlap",
                    "copyBuffer: {} bytes at {} and at {} of {} overlap", size, source_offset, destination_offset,
                    to->label());
    copyBuffer(*to, destination_offset, *from, source_offset, size);
}

CopyBufferCommand& RecorderCore::copyBuffer(BufferObject& to, uint64_t to_offset, BufferObject& from,
                                            uint64_t from_offset, uint64_t size, TracingObject* tracing) {
    const uint32_t to_resource = use(to);
    const uint32_t from_resource = use(from);
    const uint32_t structure = tracing ? use(*tracing) : none;
    beginAccesses();
    if (&to == &from) {
        access(to_resource, Stage::Copy, AccessRead | AccessWrite);
    } else {
        access(from_resource, Stage::Copy, AccessRead);
        access(to_resource, Stage::Copy, AccessWrite);
    }
    if (tracing) access(structure, Stage::Copy, AccessWrite);
    auto& command = push<CopyBufferCommand>(CommandType::CopyBuffer);
    command.source = from_resource;
    command.destination = to_resource;
    command.source_offset = from_offset;
    command.destination_offset = to_offset;
    command.size = size;
    return command;
}

void RecorderCore::clearBuffer(const Buffer& buffer, uint32_t value, uint64_t offset, uint64_t size, Where where) {
    if (!recording(where)) return;
    BufferObject* object = usableBuffer(buffer, Buffer::FlagNone, "clearBuffer", where);
    if (!object) return;
    if (size == 0 && offset <= object->size) size = (object->size - offset) / 4 * 4;
    if (!inRange(*object, offset, size, "clearBuffer", where)) return;
    if (offset % 4 || size % 4)
        return fail(where, ErrorCode::InvalidArgument, "copy.alignment",
                    "clearBuffer: {} bytes from offset {} of {} are not multiples of 4", size, offset, object->label());
    if (size == 0) return;
    const uint32_t resource = use(*object);
    beginAccesses();
    access(resource, Stage::Copy, AccessWrite);
    auto& command = push<FillBufferCommand>(CommandType::FillBuffer);
    command.buffer = resource;
    command.value = value;
    command.offset = offset;
    command.size = size;
}

void RecorderCore::setTextureData(const Texture& texture, const void* data, uint64_t size, Slice slice, Region region,
                                  Where where) {
    if (!recording(where) || !usable(texture, "setTexture", where)) return;
    const auto& object = *static_cast<TextureObject*>(texture.object());
    Slice resolved = slice;
    if (resolved.mips == 0) resolved.mips = 1;
    Region box = region;
    if (!resolve(object, resolved, "setTexture", where)) return;
    if (!resolveRegion(object.desc, resolved.mip, box))
        return fail(where, ErrorCode::OutOfRange, "texture.region",
                    "setTexture: {}x{}x{} texels from ({}, {}, {}) do not lie in mip level {} of {}", region.width,
                    region.height, region.depth, region.x, region.y, region.z, resolved.mip, object.label());
    const uint64_t wanted = dataSize(object.desc.format, box) * resolved.layers;
    if (size != wanted || !data)
        return fail(where, ErrorCode::InvalidArgument, "copy.size",
                    "setTexture: {} takes {} bytes, {} bytes were given", object.label(), wanted, data ? size : 0);
    const Expected<Ref<BufferObject>> staging = device_->createStaging(size, false, where);
    if (!staging) return fail(staging.error());
    std::memcpy((*staging)->nativeBuffer()->mapped, data, size);
    (*staging)->retain();
    copyBufferTexture(CommandType::CopyBufferToTexture, texture, Buffer(staging->get()), 0, slice, region, where);
}

void RecorderCore::copyBufferTexture(CommandType type, const Texture& texture, const Buffer& buffer, uint64_t offset,
                                     Slice slice, Region region, Where where) {
    const bool upload = type == CommandType::CopyBufferToTexture;
    const char* what = upload ? "copyBufferToTexture" : "copyTextureToBuffer";
    if (!recording(where) || !usable(texture, what, where)) return;
    auto* object = static_cast<TextureObject*>(texture.object());
    // Vulkan: copies of depth and stencil are for queues that can draw.
    if (formatInfo(object->desc.format).depth && !onQueue(Queue::Main, what, where)) return;
    BufferObject* memory = usableBuffer(buffer, Buffer::FlagNone, what, where);
    if (!memory) return;
    if (object->samples > 1)
        return fail(where, ErrorCode::InvalidArgument, "copy.samples", "{}: {} has {} samples a pixel", what,
                    object->label(), object->samples);
    if (slice.mips == 0) slice.mips = 1;
    if (!resolve(*object, slice, what, where)) return;
    if (slice.mips != 1)
        return fail(where, ErrorCode::InvalidArgument, "copy.mips", "{}: {} mip levels of {}, a copy takes one", what,
                    slice.mips, object->label());
    const Region asked = region;
    if (!resolveRegion(object->desc, slice.mip, region))
        return fail(where, ErrorCode::OutOfRange, "texture.region",
                    "{}: {}x{}x{} texels from ({}, {}, {}) do not lie in mip level {} of {}", what, asked.width,
                    asked.height, asked.depth, asked.x, asked.y, asked.z, slice.mip, object->label());
    // Vulkan: a multiple of the texel block size, and of 4 for depth and stencil formats.
    const FormatInfo& info = formatInfo(object->desc.format);
    const uint64_t alignment = info.depth ? 4u : info.block_size;
    if (offset % alignment)
        return fail(where, ErrorCode::InvalidArgument, "copy.alignment", "{}: offset {} of {} is not a multiple of {}",
                    what, offset, memory->label(), alignment);
    if (!inRange(*memory, offset, dataSize(object->desc.format, region) * slice.layers, what, where)) return;
    const Region all = mipRegion(object->desc, slice.mip);
    const bool whole = region.width == all.width && region.height == all.height && region.depth == all.depth;
    const uint32_t texture_resource = use(*object);
    const uint32_t buffer_resource = use(*memory);
    beginAccesses();
    access(buffer_resource, Stage::Copy, upload ? AccessRead : AccessWrite);
    access(texture_resource, Stage::Copy,
           static_cast<uint8_t>(!upload ? AccessRead
                                : whole ? AccessWrite | AccessDiscard
                                        : AccessWrite),
           upload ? Layout::CopyDestination : Layout::CopySource, slice);
    auto& command = push<CopyBufferTextureCommand>(type);
    command.buffer = buffer_resource;
    command.texture = texture_resource;
    command.offset = offset;
    command.slice = slice;
    command.region = region;
}

void RecorderCore::copyTexture(const Texture& destination, Slice destination_slice, const Texture& source,
                               Slice source_slice, Region region, uint32_t x, uint32_t y, uint32_t z, Where where) {
    if (!recording(where) || !usable(destination, "copyTexture", where) || !usable(source, "copyTexture", where))
        return;
    auto* to = static_cast<TextureObject*>(destination.object());
    auto* from = static_cast<TextureObject*>(source.object());
    if (formatInfo(to->desc.format).block_size != formatInfo(from->desc.format).block_size ||
        formatInfo(to->desc.format).depth != formatInfo(from->desc.format).depth || to->samples != from->samples)
        return fail(where, ErrorCode::InvalidArgument, "copy.format",
                    "copyTexture: {} ({}, {} samples) and {} ({}, {} samples) do not fit each other", from->label(),
                    toString(from->desc.format), from->samples, to->label(), toString(to->desc.format), to->samples);
    if (source_slice.mips == 0) source_slice.mips = 1;
    if (destination_slice.mips == 0) destination_slice.mips = 1;
    if (!resolve(*from, source_slice, "copyTexture", where)) return;
    if (destination_slice.layers == 0) destination_slice.layers = source_slice.layers;
    if (!resolve(*to, destination_slice, "copyTexture", where)) return;
    if (source_slice.mips != 1 || destination_slice.mips != 1 || source_slice.layers != destination_slice.layers)
        return fail(
            where, ErrorCode::InvalidArgument, "copy.mips",
            "copyTexture: a copy takes one mip level and equally many layers; given {} levels, {} layers and {} "
            "levels, {} layers",
            source_slice.mips, source_slice.layers, destination_slice.mips, destination_slice.layers);
    if (!resolveRegion(from->desc, source_slice.mip, region))
        return fail(where, ErrorCode::OutOfRange, "texture.region",
                    "copyTexture: the region does not lie in mip level {} of {}", source_slice.mip, from->label());
    Region target = {x, y, z, region.width, region.height, region.depth};
    if (!resolveRegion(to->desc, destination_slice.mip, target))
        return fail(where, ErrorCode::OutOfRange, "texture.region",
                    "copyTexture: {}x{}x{} texels at ({}, {}, {}) do not lie in mip level {} of {}", region.width,
                    region.height, region.depth, x, y, z, destination_slice.mip, to->label());
    if (to == from && destination_slice.mip == source_slice.mip &&
        destination_slice.layer < source_slice.layer + source_slice.layers &&
        source_slice.layer < destination_slice.layer + destination_slice.layers)
        return fail(where, ErrorCode::InvalidArgument, "copy.overlap",
                    "copyTexture: source and destination are the same mip level and layers of {}", to->label());
    const Region all = mipRegion(to->desc, destination_slice.mip);
    const bool whole = region.width == all.width && region.height == all.height && region.depth == all.depth;
    const uint32_t to_resource = use(*to);
    const uint32_t from_resource = use(*from);
    beginAccesses();
    access(from_resource, Stage::Copy, AccessRead, Layout::CopySource, source_slice);
    access(to_resource, Stage::Copy, static_cast<uint8_t>(whole ? AccessWrite | AccessDiscard : AccessWrite),
           Layout::CopyDestination, destination_slice);
    auto& command = push<CopyTextureCommand>(CommandType::CopyTexture);
    command.source = from_resource;
    command.destination = to_resource;
    command.source_slice = source_slice;
    command.destination_slice = destination_slice;
    command.source_region = region;
    command.x = x;
    command.y = y;
    command.z = z;
}

void RecorderCore::clearTexture(const Texture& texture, const Color& color, Slice slice, Where where) {
    if (!recording(where) || !usable(texture, "clearTexture", where)) return;
    auto* object = static_cast<TextureObject*>(texture.object());
    const FormatInfo& info = formatInfo(object->desc.format);
    if (!onQueue(info.depth ? Queue::Main : Queue::Compute, "clearTexture", where)) return;
    if (info.compressed)
        return fail(where, ErrorCode::InvalidArgument, "clear.format", "clearTexture: {} has the compressed format {}",
                    object->label(), info.name);
    if (info.depth && !(color.r >= 0 && color.r <= 1))
        return fail(where, ErrorCode::OutOfRange, "clear.depth", "clearTexture: depth {} for {}; it is 0 to 1", color.r,
                    object->label());
    if (!resolve(*object, slice, "clearTexture", where)) return;
    const uint32_t resource = use(*object);
    beginAccesses();
    access(resource, Stage::Copy, AccessWrite | AccessDiscard, Layout::CopyDestination, slice);
    auto& command = push<ClearTextureCommand>(CommandType::ClearTexture);
    command.texture = resource;
    command.slice = slice;
    const float values[4] = {color.r, color.g, color.b, color.a};
    for (size_t i = 0; i < 4; i++)
        command.value.u[i] = clearBits(info.depth && i == 1 ? FormatType::Uint : info.type, values[i]);
}

void RecorderCore::createMipmaps(const Texture& texture, Where where) {
    if (!recording(where) || !usable(texture, "createMipmaps", where) ||
        !onQueue(Queue::Compute, "createMipmaps", where))
        return;
    auto* object = static_cast<TextureObject*>(texture.object());
    const TextureDesc& desc = object->desc;
    if (!MipmapKernels::canFilter(desc.format))
        return fail(where, ErrorCode::InvalidArgument, "mipmaps.format",
                    "createMipmaps: {} has format {}, which cannot be filtered", object->label(),
                    toString(desc.format));
    if (desc.mipmaps < 2) return;
    const Features& features = device_->features();
    const MipmapPlan plan = planMipmaps(desc, std::max(features.storageAlignment, 16u),
                                        std::min(DeviceObject::scratch_limit, features.maxStorageSize));
    const Expected<Ref<BufferObject>> scratch = device_->acquireScratch(plan.scratch, where);
    if (!scratch) return fail(scratch.error());
    (*scratch)->retain();
    const Buffer memory(scratch->get());

    // Nobody else sees the scratch memory: its hazards are not the caller's.
    const bool tracking = std::exchange(tracking_, true);
    size_t copied = 0;
    const auto copyUpTo = [&](size_t end) {
        for (; copied < end && !error(); copied++) {
            const MipmapPass& pass = plan.passes[copied];
            const auto mip = static_cast<uint16_t>(pass.level);
            Slice slice = {mip, 1, static_cast<uint16_t>(pass.first_slice), static_cast<uint16_t>(pass.slices)};
            Region box = mipRegion(desc, pass.level);
            box.y = pass.first_row;
            box.height = pass.rows;
            if (desc.type == Texture::Type3D) {
                box.z = pass.first_slice;
                box.depth = pass.slices;
                slice.layer = 0;
                slice.layers = 1;
            }
            copyBufferTexture(CommandType::CopyBufferToTexture, texture, memory, pass.stored, slice, box, where);
        }
    };
    for (size_t i = 0; i < plan.passes.size() && !error(); i++) {
        // What is kept for the next level stays until then; before anything else, what is stored has to be copied.
        if (!plan.passes[i].from_kept) copyUpTo(i);
        makeMipmap(*object, plan, i, **scratch, where);
    }
    copyUpTo(plan.passes.size());
    tracking_ = tracking;
}

void RecorderCore::makeMipmap(TextureObject& texture, const MipmapPlan& plan, size_t index, BufferObject& scratch,
                              Where where) {
    const MipmapPass& pass = plan.passes[index];
    const Expected<KernelObject*> kernel = device_->mipmaps().kernel(texture.desc, pass, where);
    if (!kernel) return fail(kernel.error().at(where));
    const uint32_t kernel_resource = use(**kernel);
    const uint32_t scratch_resource = use(scratch);
    BoundResource elements[3];
    const auto bind = [&](BoundResource& element, uint64_t offset) {
        element.resource = scratch_resource;
        element.offset = offset;
        element.size = std::min(plan.scratch - offset, device_->features().maxStorageSize);
    };
    bind(elements[1], pass.keeps ? pass.kept : pass.stored);
    bind(elements[2], pass.stored);
    beginAccesses();
    access(scratch_resource, Stage::Compute, AccessRead | AccessWrite);
    if (pass.from_kept) {
        bind(elements[0], plan.passes[index - 1].kept);
    } else {
        elements[0].resource = use(texture);
        elements[0].slice = {static_cast<uint16_t>(pass.level - 1), 1, 0, static_cast<uint16_t>(texture.desc.layers)};
        access(elements[0].resource, Stage::Compute, AccessRead, Layout::Sampled, elements[0].slice);
    }
    const MipmapConstants constants = mipmapConstants(texture.desc, pass);
    auto& command = push<DispatchCommand>(CommandType::Dispatch);
    command.kernel = kernel_resource;
    command.bindings.bound = append(elements, sizeof(elements), alignof(BoundResource));
    command.bindings.bound_count = 3;
    command.bindings.push = append(&constants, sizeof(constants), 4);
    command.bindings.push_size = sizeof(constants);
    MipmapKernels::countGroups(texture.desc, pass, command.groups);
}

void RecorderCore::hostRead(BufferObject& buffer) {
    const uint32_t resource = use(buffer);
    beginAccesses();
    access(resource, Stage::Host, AccessRead);
    push<HostReadCommand>(CommandType::HostRead);
}

void RecorderCore::presentPicture(TextureObject& picture) {
    const uint32_t resource = use(picture);
    beginAccesses();
    // The stage is that of the drawing before it: the semaphore that presentation waits for covers every stage.
    access(resource, Stage::ColorTarget, AccessRead, Layout::Present, {0, 1, 0, 1});
    push<PresentCommand>(CommandType::Present);
}

}  // namespace glint::detail
