#include <glint/device/detail/recorder_core.h>
#include <glint/device/detail/texture_layout.h>

#include <algorithm>

namespace glint::detail {

namespace {

/// Vulkan: offsets are not negative and offset + extent does not overflow.
Scissor clipped(const Scissor& scissor) {
    const int64_t left = std::max(scissor.x, 0);
    const int64_t top = std::max(scissor.y, 0);
    const int64_t right = std::min<int64_t>(static_cast<int64_t>(scissor.x) + scissor.width, INT32_MAX);
    const int64_t bottom = std::min<int64_t>(static_cast<int64_t>(scissor.y) + scissor.height, INT32_MAX);
    return {static_cast<int32_t>(left), static_cast<int32_t>(top),
            static_cast<uint32_t>(std::max<int64_t>(right - left, 0)),
            static_cast<uint32_t>(std::max<int64_t>(bottom - top, 0))};
}

}  // namespace

void RecorderCore::beginTarget(TargetObject& target, Where where) {
    graphics_ = true;
    const TargetObject::Attachment* attachments[max_targets + 1];
    uint32_t color_count = 0;
    for (uint32_t i = 0; i < max_targets; i++)
        if (target.colors[i].texture) color_count = i + 1;
    size_t attachment_count = 0;
    for (uint32_t i = 0; i < color_count; i++)
        if (target.colors[i].texture) attachments[attachment_count++] = &target.colors[i];
    if (target.depth.texture) attachments[attachment_count++] = &target.depth;
    if (target.is_window && !target.colors[0].texture)
        return fail(where, ErrorCode::InvalidArgument, "window.no_frame",
                    "{} has a picture between render() and present() only", target.label());
    if (attachment_count == 0)
        return fail(where, ErrorCode::InvalidArgument, "target.empty", "{} has no texture", target.label());

    target_ = Ref<TargetObject>(&target);
    target_width_ = target_height_ = UINT32_MAX;
    target_samples_ = attachments[0]->texture->samples;
    uint32_t layers = UINT32_MAX;
    for (size_t i = 0; i < attachment_count; i++) {
        const TargetObject::Attachment& attachment = *attachments[i];
        const TextureObject& texture = *attachment.texture;
        const uint32_t width = mipSize(texture.desc.width, attachment.slice.mip);
        const uint32_t height = mipSize(texture.desc.height, attachment.slice.mip);
        if (i && (width != target_width_ || height != target_height_))
            return fail(where, ErrorCode::InvalidArgument, "target.size",
                        "{}: {} has {}x{} pixels, the others have {}x{}", target.label(), texture.label(), width,
                        height, target_width_, target_height_);
        if (texture.samples != target_samples_)
            return fail(where, ErrorCode::InvalidArgument, "target.samples",
                        "{}: {} has {} samples a pixel, the others have {}", target.label(), texture.label(),
                        texture.samples, target_samples_);
        for (size_t j = 0; j < i; j++)
            if (attachments[j]->texture.get() == &texture && attachments[j]->slice == attachment.slice)
                return fail(where, ErrorCode::InvalidArgument, "target.twice", "{}: {} is used twice", target.label(),
                            texture.label());
        if (attachment.resolve) {
            const TextureObject& resolve = *attachment.resolve;
            if (texture.samples == 1 || resolve.samples != 1 || resolve.desc.format != texture.desc.format ||
                mipSize(resolve.desc.width, attachment.resolve_slice.mip) != width ||
                mipSize(resolve.desc.height, attachment.resolve_slice.mip) != height)
                return fail(where, ErrorCode::InvalidArgument, "target.resolve",
                            "{}: {} cannot be resolved into {}: it takes samples, equal formats and sizes",
                            target.label(), texture.label(), resolve.label());
        }
        target_width_ = width;
        target_height_ = height;
        layers = std::min<uint32_t>(layers, attachment.slice.layers);
    }
    if (const uint32_t limit = device_->features().maxTargetLayers; layers > limit)
        return fail(where, ErrorCode::OutOfRange, "target.layers", "{}: {} layers, the device draws to {} at once",
                    target.label(), layers, limit);

    const auto resource = [&](const Ref<TextureObject>& texture) { return texture ? use(*texture) : none; };
    const auto fill = [&](const TargetObject::Attachment& from, Attachment& to) {
        to.texture = resource(from.texture);
        to.resolve = resource(from.resolve);
        to.slice = from.slice;
        to.resolve_slice = from.resolve_slice;
        to.load = from.operation & Target::BeginClear     ? LoadOperation::Clear
                  : from.operation & Target::BeginDiscard ? LoadOperation::Discard
                                                          : LoadOperation::Load;
        to.store = from.operation & Target::EndDiscard ? StoreOperation::Discard : StoreOperation::Store;
        const float clear[4] = {from.clear.r, from.clear.g, from.clear.b, from.clear.a};
        std::copy(clear, clear + 4, to.clear);
    };
    BeginTargetCommand begin;
    begin.color_count = color_count;
    for (uint32_t i = 0; i < color_count; i++) fill(target.colors[i], begin.colors[i]);
    fill(target.depth, begin.depth);
    begin.depth.clear[0] = target.clear_depth;
    begin.depth.clear_stencil = target.clear_stencil;
    begin.width = target_width_;
    begin.height = target_height_;
    begin.layers = layers;

    beginAccesses();
    const auto attach = [&](const Attachment& attachment, Stage stage, Layout layout) {
        if (attachment.texture == none) return;
        const auto flags = static_cast<uint8_t>(attachment.load == LoadOperation::Load ? AccessRead | AccessWrite
                                                                                       : AccessWrite | AccessDiscard);
        access(attachment.texture, stage, flags, layout, attachment.slice);
        if (attachment.resolve != none)
            access(attachment.resolve, stage, AccessWrite | AccessDiscard, layout, attachment.resolve_slice);
    };
    for (uint32_t i = 0; i < color_count; i++) attach(begin.colors[i], Stage::ColorTarget, Layout::ColorTarget);
    attach(begin.depth, Stage::DepthTarget, Layout::DepthTarget);
    auto& command = push<BeginTargetCommand>(CommandType::BeginTarget);
    begin.header = command.header;
    command = begin;

    setViewport({0, 0, static_cast<float>(target_width_), static_cast<float>(target_height_), 0, 1});
    setScissor({0, 0, target_width_, target_height_});
}

void RecorderCore::setPipeline(const Pipeline& pipeline, Where where) {
    if (!recording(where)) return;
    if (pipeline.state() == ObjectState::Building) static_cast<PipelineObject*>(pipeline.object())->waitCreated();
    if (!usable(pipeline, "setPipeline", where)) return;
    auto* object = static_cast<PipelineObject*>(pipeline.object());
    const PipelineDesc& desc = object->desc;
    if (desc.samples != target_samples_)
        return fail(where, ErrorCode::InvalidArgument, "draw.samples",
                    "setPipeline: {} draws {} samples a pixel, {} has {}", object->label(), desc.samples,
                    target_->label(), target_samples_);
    for (uint32_t i = 0; i < max_targets; i++) {
        const Format pipeline_format = i < desc.color_formats.size() ? desc.color_formats[i] : FormatUnknown;
        const Format target_format =
            target_->colors[i].texture ? target_->colors[i].texture->desc.format : FormatUnknown;
        if (pipeline_format != target_format)
            return fail(where, ErrorCode::InvalidArgument, "draw.format",
                        "setPipeline: {} draws {} to colour texture {}, {} has {}", object->label(),
                        toString(pipeline_format), i, target_->label(), toString(target_format));
    }
    const Format depth_format = target_->depth.texture ? target_->depth.texture->desc.format : FormatUnknown;
    if (desc.depth_format != depth_format)
        return fail(where, ErrorCode::InvalidArgument, "draw.format", "setPipeline: {} draws depth {}, {} has {}",
                    object->label(), toString(desc.depth_format), target_->label(), toString(depth_format));
    setProgram(*object);
}

void RecorderCore::setVertexBuffer(uint32_t index, const Buffer& buffer, uint64_t offset, Where where) {
    if (!recording(where)) return;
    if (index >= vertices_.size())
        return fail(where, ErrorCode::OutOfRange, "draw.vertex_slot", "setVertexBuffer: slot {} of at most {}", index,
                    vertices_.size());
    BufferObject* object = usableBuffer(buffer, Buffer::FlagVertex, "setVertexBuffer", where);
    if (!object || !inRange(*object, offset, 0, "setVertexBuffer", where)) return;
    vertices_[index] = {use(*object), offset, object->size - offset, true};
    vertices_dirty_ = true;
}

void RecorderCore::setVertexData(uint32_t index, const void* data, uint64_t size, Where where) {
    if (!recording(where)) return;
    if (index >= vertices_.size())
        return fail(where, ErrorCode::OutOfRange, "draw.vertex_slot", "setVertices: slot {} of at most {}", index,
                    vertices_.size());
    if (!data && size)
        return fail(where, ErrorCode::InvalidArgument, "copy.null", "setVertices: {} bytes from a null pointer", size);
    vertices_[index] = {none, appendInline(data, size, 16), size, true};
    vertices_dirty_ = true;
}

void RecorderCore::setIndexBuffer(Format format, const Buffer& buffer, uint64_t offset, Where where) {
    if (!recording(where)) return;
    const uint32_t size = format == FormatRu16 ? 2u : format == FormatRu32 ? 4u : 0u;
    BufferObject* object = usableBuffer(buffer, Buffer::FlagIndex, "setIndexBuffer", where);
    if (!object || !inRange(*object, offset, 0, "setIndexBuffer", where)) return;
    if (!size || offset % size)
        return fail(
            where, ErrorCode::InvalidArgument, "draw.index_format",
            "setIndexBuffer: format {} at offset {}; indices are FormatRu16 or FormatRu32, aligned to their size",
            toString(format), offset);
    indices_ = {use(*object), offset, object->size - offset, true};
    index_size_ = size;
}

void RecorderCore::setIndexData(Format format, const void* data, uint64_t size, Where where) {
    if (!recording(where)) return;
    const uint32_t index_size = format == FormatRu16 ? 2u : format == FormatRu32 ? 4u : 0u;
    if (!index_size)
        return fail(where, ErrorCode::InvalidArgument, "draw.index_format",
                    "setIndices: format {}; indices are FormatRu16 or FormatRu32", toString(format));
    if (!data && size)
        return fail(where, ErrorCode::InvalidArgument, "copy.null", "setIndices: {} bytes from a null pointer", size);
    indices_ = {none, appendInline(data, size, 16), size, true};
    index_size_ = index_size;
}

void RecorderCore::setViewport(const Viewport& viewport) {
    dynamic_.viewport = viewport;
    dynamic_.viewport_count = 1;
    dynamic_dirty_ = true;
}

void RecorderCore::setViewports(std::span<const Viewport> viewports, Where where) {
    if (!recording(where)) return;
    const uint32_t limit = device_->features().maxViewports;
    if (viewports.empty() || viewports.size() > limit)
        return fail(where, ErrorCode::OutOfRange, "draw.viewports", "setViewports: {} viewports of 1 to {}",
                    viewports.size(), limit);
    for (const Viewport& viewport : viewports)
        if (!checkViewport(viewport, where)) return;
    dynamic_.viewport = viewports[0];
    dynamic_.viewport_count = static_cast<uint32_t>(viewports.size());
    dynamic_.viewports = append(viewports.data(), viewports.size_bytes());
    dynamic_dirty_ = true;
}

bool RecorderCore::checkViewport(const Viewport& viewport, Where where) {
    const auto within = [](float depth) { return depth >= 0 && depth <= 1; };
    if (viewport.width > 0 && viewport.height > 0 && within(viewport.minimum_depth) && within(viewport.maximum_depth))
        return true;
    fail(where, ErrorCode::InvalidArgument, "draw.viewport",
         "draw: the viewport has {}x{} pixels, depth {} to {}; sizes are positive, depths in 0..1", viewport.width,
         viewport.height, viewport.minimum_depth, viewport.maximum_depth);
    return false;
}

void RecorderCore::setScissor(const Scissor& scissor) {
    dynamic_.scissor = clipped(scissor);
    dynamic_.scissor_count = 1;
    dynamic_dirty_ = true;
}

void RecorderCore::setScissors(std::span<const Scissor> scissors, Where where) {
    if (!recording(where)) return;
    const uint32_t limit = device_->features().maxViewports;
    if (scissors.empty() || scissors.size() > limit)
        return fail(where, ErrorCode::OutOfRange, "draw.scissors", "setScissors: {} scissors of 1 to {}",
                    scissors.size(), limit);
    std::array<Scissor, max_viewports> all;
    std::transform(scissors.begin(), scissors.end(), all.begin(), clipped);
    dynamic_.scissor = all[0];
    dynamic_.scissor_count = static_cast<uint32_t>(scissors.size());
    dynamic_.scissors = append(all.data(), scissors.size_bytes());
    dynamic_dirty_ = true;
}

void RecorderCore::setBlendFactor(const Color& color) {
    const float values[4] = {color.r, color.g, color.b, color.a};
    std::copy(values, values + 4, dynamic_.blend);
    dynamic_dirty_ = true;
}

void RecorderCore::setStencilRef(uint32_t reference) {
    dynamic_.stencil_reference = reference;
    dynamic_dirty_ = true;
}

bool RecorderCore::flushDraw(DrawKind kind, DrawState& state, Where where) {
    if (!program_) {
        fail(where, ErrorCode::InvalidArgument, "draw.pipeline", "draw: no pipeline has been set");
        return false;
    }
    const bool has_mesh = static_cast<const PipelineObject*>(program_)->has_mesh;
    if (has_mesh != (kind == DrawKind::Mesh)) {
        fail(where, ErrorCode::InvalidArgument, "draw.mesh", "draw: {} has {} shader, which {}", program_->label(),
             has_mesh ? "a mesh" : "a vertex", has_mesh ? "drawMesh starts" : "drawMesh does not start");
        return false;
    }
    if (!checkViewport(dynamic_.viewport, where)) return false;
    if (dynamic_.scissor_count > 1 && dynamic_.scissor_count != dynamic_.viewport_count) {
        fail(where, ErrorCode::InvalidArgument, "draw.scissors", "draw: there are {} scissors and {} viewports",
             dynamic_.scissor_count, dynamic_.viewport_count);
        return false;
    }
    const bool new_bindings = bindings_dirty_;
    if (!flushBindings("draw", where) || !flushPush("draw", where)) return false;
    if (new_bindings) {
        // A target's texture must not be read by what draws to it.
        for (uint32_t i = 0; i < shared_count_; i++) {
            const Access& shared = list_.accesses[first_shared_ + i];
            if (shared.layout == Layout::None) continue;
            const auto* object = static_cast<const TextureObject*>(list_.resources[shared.resource]);
            if (!(object->desc.flags & Texture::FlagTarget)) continue;
            const auto attached = [&](const TargetObject::Attachment& attachment) {
                return (attachment.texture.get() == object && attachment.slice.mip >= shared.slice.mip &&
                        attachment.slice.mip < shared.slice.mip + shared.slice.mips &&
                        attachment.slice.layer < shared.slice.layer + shared.slice.layers &&
                        shared.slice.layer < attachment.slice.layer + attachment.slice.layers) ||
                       (attachment.resolve && attachment.resolve.get() == object);
            };
            if (!attached(target_->depth) && std::none_of(target_->colors, target_->colors + max_targets, attached))
                continue;
            fail(where, ErrorCode::InvalidArgument, "draw.feedback",
                 "draw: {} is bound and is drawn to at the same time", object->label());
            return false;
        }
    }
    if (dynamic_dirty_) {
        dynamic_block_ = append(&dynamic_, sizeof(dynamic_));
        dynamic_dirty_ = false;
    }
    state.pipeline = program_resource_;
    state.bindings = bindings_;
    state.dynamic = dynamic_block_;
    if (kind != DrawKind::Mesh) return flushVertices(kind == DrawKind::Elements, state, where);
    // Vulkan counts vertices that mesh shaders do not have (VUID-vkCmdDrawMeshTasksEXT-pipelineStatistics-07076).
    for (const Query& open : open_queries_) {
        if (open.getType() != Query::TypeStatistics) continue;
        fail(where, ErrorCode::InvalidArgument, "query.mesh", "draw: {} is open, which counts no mesh shaders",
             open.object()->label());
        return false;
    }
    beginAccesses();
    return true;
}

bool RecorderCore::flushVertices(bool indexed, DrawState& state, Where where) {
    const PipelineDesc& desc = static_cast<const PipelineObject*>(program_)->desc;
    if (vertices_dirty_) {
        VertexBinding bindings[std::tuple_size_v<decltype(vertices_)>];
        const size_t count = std::min(desc.vertex_buffers.size(), vertices_.size());
        // A slot that no attribute reads (stride 0) gets what the first one that is read has.
        size_t first = 0;
        while (first < count && desc.vertex_buffers[first].stride == 0) first++;
        for (size_t i = 0; i < count; i++) {
            const size_t slot = desc.vertex_buffers[i].stride ? i : first;
            if (!vertices_[slot].set) {
                fail(where, ErrorCode::InvalidArgument, "draw.vertices",
                     "draw: vertex buffer {} of {} has not been set", slot, program_->label());
                return false;
            }
            bindings[i] = {vertices_[slot].buffer, vertices_[slot].offset};
        }
        vertex_block_count_ = static_cast<uint32_t>(count);
        vertex_block_ = count ? append(bindings, count * sizeof(VertexBinding)) : none;
        vertices_dirty_ = false;
    }
    if (indexed && !indices_.set) {
        fail(where, ErrorCode::InvalidArgument, "draw.indices", "draw: no index buffer has been set");
        return false;
    }
    state.vertices = vertex_block_;
    state.vertex_count = vertex_block_count_;
    if (indexed) {
        state.index_buffer = indices_.buffer;
        state.index_size = index_size_;
        state.index_offset = indices_.offset;
    }
    beginAccesses();
    for (uint32_t i = 0; i < vertex_block_count_; i++)
        if (vertices_[i].buffer != none) access(vertices_[i].buffer, Stage::VertexInput, AccessRead);
    if (indexed && indices_.buffer != none) access(indices_.buffer, Stage::VertexInput, AccessRead);
    return true;
}

void RecorderCore::draw(bool indexed, uint32_t count, uint32_t instances, uint32_t first, int32_t base_vertex,
                        uint32_t first_instance, Where where) {
    if (!recording(where) || count == 0 || instances == 0) return;
    DrawState state;
    if (!flushDraw(indexed ? DrawKind::Elements : DrawKind::Arrays, state, where)) return;
    if (indexed && (static_cast<uint64_t>(first) + count) * index_size_ > indices_.size)
        return fail(where, ErrorCode::OutOfRange, "draw.index_range",
                    "draw: {} indices from {} exceed an index buffer of {} indices", count, first,
                    indices_.size / index_size_);
    // Which vertices indices name is not known here; without them the range is.
    const PipelineDesc& desc = static_cast<const PipelineObject*>(program_)->desc;
    for (uint32_t i = 0; i < vertex_block_count_; i++) {
        const VertexBuffer& buffer = desc.vertex_buffers[i];
        if (indexed && buffer.rate == 0) continue;
        const uint64_t last =
            buffer.rate == 0 ? static_cast<uint64_t>(first) + count : static_cast<uint64_t>(first_instance) + instances;
        if (last * buffer.stride > vertices_[i].size)
            return fail(where, ErrorCode::OutOfRange, "draw.vertex_range",
                        "draw: {} {} of {} bytes exceed vertex buffer {} of {} bytes", last,
                        buffer.rate == 0 ? "vertices" : "instances", buffer.stride, i, vertices_[i].size);
    }
    auto& command = push<DrawCommand>(indexed ? CommandType::DrawIndexed : CommandType::Draw);
    shareAccesses(command.header);
    command.state = state;
    command.count = count;
    command.instances = instances;
    command.first = first;
    command.base_vertex = base_vertex;
    command.first_instance = first_instance;
}

void RecorderCore::drawMesh(uint32_t x, uint32_t y, uint32_t z, Where where) {
    if (!recording(where) || x == 0 || y == 0 || z == 0) return;
    DrawState state;
    if (!flushDraw(DrawKind::Mesh, state, where)) return;
    const Features& limits = device_->features();
    // Two factors at a time: the product of three may not fit.
    const bool within = x <= limits.maxMeshGroupCountX && y <= limits.maxMeshGroupCountY &&
                        z <= limits.maxMeshGroupCountZ && static_cast<uint64_t>(x) * y <= limits.maxMeshGroupCount / z;
    if (!within)
        return fail(where, ErrorCode::OutOfRange, "draw.mesh_groups",
                    "drawMesh: {} x {} x {} groups, the device takes {} x {} x {} and {} in all", x, y, z,
                    limits.maxMeshGroupCountX, limits.maxMeshGroupCountY, limits.maxMeshGroupCountZ,
                    limits.maxMeshGroupCount);
    auto& command = push<DrawMeshCommand>(CommandType::DrawMesh);
    shareAccesses(command.header);
    command.state = state;
    const uint32_t groups[] = {x, y, z};
    std::copy(groups, groups + 3, command.groups);
}

void RecorderCore::drawIndirect(CommandType type, const Indirect& arguments, Where where) {
    if (!recording(where) || arguments.draws == 0) return;
    BufferObject* object = usableBuffer(arguments.buffer, Buffer::FlagIndirect, "drawIndirect", where);
    if (!object) return;
    const auto [buffer, offset, draws, asked_stride, count, count_offset] = arguments;
    const uint32_t size = indirectSize(type);
    const uint32_t stride = asked_stride ? asked_stride : size;
    if (offset % 4 || stride % 4 || stride < size || offset > object->size ||
        (draws - 1ull) * stride + size > object->size - offset)
        return fail(where, ErrorCode::OutOfRange, "draw.indirect",
                    "drawIndirect: {} draws of {} bytes, {} apart, from offset {} of {} of {} bytes; multiples of 4",
                    draws, size, stride, offset, object->label(), object->size);
    const Features& features = device_->features();
    const auto lacks = [&](const char* id, const char* what, Feature feature) {
        fail(where, ErrorCode::Unsupported, id, "drawIndirect: {} needs the feature {}", what, toString(feature));
    };
    BufferObject* counter = nullptr;
    if (count) {
        if (!features.has(FeatureIndirectCount))
            return lacks("draw.count", "a count from a buffer", FeatureIndirectCount);
        counter = usableBuffer(*count, Buffer::FlagIndirect, "drawIndirect", where);
        if (!counter) return;
        if (count_offset % 4 || counter->size < 4 || count_offset > counter->size - 4)
            return fail(where, ErrorCode::OutOfRange, "draw.count",
                        "drawIndirect: a count at offset {} of {} of {} bytes; it has 4 bytes, at a multiple of 4",
                        count_offset, counter->label(), counter->size);
    } else if (draws > 1 && !features.has(FeatureMultiDrawIndirect)) {
        return lacks("draw.multi", "more than one draw", FeatureMultiDrawIndirect);
    }
    if (draws > features.maxIndirectDraws)
        return fail(where, ErrorCode::OutOfRange, "draw.multi", "drawIndirect: {} draws, the device takes {} at once",
                    draws, features.maxIndirectDraws);
    const uint32_t resource = use(*object);
    const uint32_t counter_resource = counter ? use(*counter) : none;
    DrawState state;
    const DrawKind kind = type == CommandType::DrawMeshIndirect      ? DrawKind::Mesh
                          : type == CommandType::DrawIndexedIndirect ? DrawKind::Elements
                                                                     : DrawKind::Arrays;
    if (!flushDraw(kind, state, where)) return;
    access(resource, Stage::Indirect, AccessRead);
    if (counter) access(counter_resource, Stage::Indirect, AccessRead);
    auto& command = push<DrawIndirectCommand>(type);
    shareAccesses(command.header);
    command.state = state;
    command.buffer = resource;
    command.offset = offset;
    command.draws = draws;
    command.stride = stride;
    command.count_buffer = counter_resource;
    command.count_offset = count_offset;
}

}  // namespace glint::detail
