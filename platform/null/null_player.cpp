#include <platform/null/null_player.h>

#include <platform/null/null_texel.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/texture_layout.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace glint::null {

using namespace detail;

namespace {

template <class T>
const T& as(const CommandHeader& header) {
    return reinterpret_cast<const T&>(header);
}

/// Texels of a mip level as the memory has them: in blocks, samples side by side.
struct Grid {
    Grid(const NullTexture& texture, uint32_t mip)
        : block(formatInfo(texture.desc.format).block_width),
          texel(formatInfo(texture.desc.format).block_size * texture.samples),
          width((mipSize(texture.desc.width, mip) + block - 1) / block),
          height((mipSize(texture.desc.height, mip) + block - 1) / block),
          depth(mipSize(texture.desc.depth, mip)) {}

    /// In blocks.
    uint64_t offset(uint32_t x, uint32_t y, uint32_t z) const {
        return ((static_cast<uint64_t>(z) * height + y) * width + x) * texel;
    }
    /// A region of texels in blocks.
    Region blocks(const Region& region) const {
        return {region.x / block,
                region.y / block,
                region.z,
                (region.width + block - 1) / block,
                (region.height + block - 1) / block,
                region.depth};
    }

    uint32_t block;
    uint64_t texel;
    uint32_t width, height, depth;
};

void clear(const NullTexture& texture, const Slice& slice, const ClearValue& value) {
    const size_t size = formatInfo(texture.desc.format).block_size;
    for (uint32_t layer = slice.layer; layer < uint32_t(slice.layer) + slice.layers; layer++) {
        for (uint32_t mip = slice.mip; mip < uint32_t(slice.mip) + slice.mips; mip++) {
            const Grid grid(texture, mip);
            const uint64_t count = grid.offset(0, 0, grid.depth) / size;
            std::byte* texels = texture.texels(mip, layer);
            if (count) encodeTexel(texture.desc.format, value, texels);
            for (uint64_t i = 1; i < count; i++) std::memcpy(texels + i * size, texels, size);
        }
    }
}

}  // namespace

void NullPlayer::play(const CommandList& list) {
    list_ = &list;
    target_ = nullptr;
    counters_.lists++;
    forEachCommand(list, [&](uint32_t index, const CommandHeader& header) {
        command_ = index;
        counters_.commands++;
        nanoseconds_ += 1000;
        play(header);
    });
}

NullCounters NullPlayer::takeCounters() { return std::exchange(counters_, {}); }

void NullPlayer::play(const CommandHeader& header) {
    switch (header.type) {
        case CommandType::Dispatch: {
            const auto& command = as<DispatchCommand>(header);
            countDispatch(uint64_t(command.groups[0]) * command.groups[1] * command.groups[2]);
            break;
        }
        case CommandType::SideDispatches: {
            const auto& command = as<SideDispatchesCommand>(header);
            for (uint32_t i = 0; i < command.count; i++)
                countDispatch(list_->at<SideDispatch>(command.dispatches)[i].groups);
            break;
        }
        case CommandType::DispatchIndirect: {
            const auto& command = as<DispatchIndirectCommand>(header);
            counters_.dispatches++;
            bytes(command.buffer, command.offset, 12);
            break;
        }
        case CommandType::TraceRays: counters_.dispatches++; break;
        case CommandType::TraceRaysIndirect: {
            const auto& command = as<TraceRaysIndirectCommand>(header);
            counters_.dispatches++;
            bytes(command.buffer, command.offset, 12);
            break;
        }
        case CommandType::BeginTarget: beginTarget(as<BeginTargetCommand>(header)); break;
        case CommandType::EndTarget: endTarget(); break;
        case CommandType::Draw:
        case CommandType::DrawIndexed: {
            const auto& command = as<DrawCommand>(header);
            if (header.type == CommandType::DrawIndexed && command.state.index_buffer != none)
                bytes(command.state.index_buffer, command.state.index_offset,
                      (uint64_t(command.first) + command.count) * command.state.index_size);
            countDraw(command.count, command.instances);
            break;
        }
        case CommandType::DrawIndirect:
        case CommandType::DrawIndexedIndirect:
        case CommandType::DrawMeshIndirect: drawIndirect(as<DrawIndirectCommand>(header)); break;
        case CommandType::DrawMesh: counters_.draws++; break;
        case CommandType::CopyInline: play(as<CopyInlineCommand>(header)); break;
        case CommandType::CopyBuffer: play(as<CopyBufferCommand>(header)); break;
        case CommandType::FillBuffer: play(as<FillBufferCommand>(header)); break;
        case CommandType::CopyBufferToTexture:
        case CommandType::CopyTextureToBuffer: play(as<CopyBufferTextureCommand>(header)); break;
        case CommandType::CopyTexture: play(as<CopyTextureCommand>(header)); break;
        case CommandType::ClearTexture: play(as<ClearTextureCommand>(header)); break;
        case CommandType::BuildTracings: play(as<BuildTracingsCommand>(header)); break;
        case CommandType::CopyTracing: play(as<CopyTracingCommand>(header)); break;
        case CommandType::WriteTracingSize: play(as<WriteTracingSizeCommand>(header)); break;
        case CommandType::BeginQuery:
        case CommandType::EndQuery: query(as<QueryCommand>(header)); break;
        case CommandType::PushRegion:
        case CommandType::PopRegion:
        case CommandType::HostRead:
        case CommandType::Present:
        case CommandType::Barrier:
        case CommandType::Count: break;
    }
}

void NullPlayer::countDispatch(uint64_t groups) {
    counters_.dispatches++;
    statistics_[6] += groups;
    nanoseconds_ += groups * control_.settings().group_time;
}

void NullPlayer::countDraw(uint64_t vertices, uint64_t instances) {
    counters_.draws++;
    statistics_[0] += vertices * instances;
    statistics_[2] += vertices * instances;
}

void NullPlayer::drawIndirect(const DrawIndirectCommand& command) {
    uint32_t draws = command.draws;
    if (command.count_buffer != none) {
        uint32_t count = 0;
        if (const std::byte* place = bytes(command.count_buffer, command.count_offset, 4))
            std::memcpy(&count, place, 4);
        draws = std::min(draws, count);
    }
    for (uint32_t i = 0; i < draws; i++) {
        const std::byte* record =
            bytes(command.buffer, command.offset + uint64_t(i) * command.stride, indirectSize(command.header.type));
        uint32_t counts[2] = {};
        if (record && command.header.type != CommandType::DrawMeshIndirect) std::memcpy(counts, record, sizeof(counts));
        countDraw(counts[0], counts[1]);
    }
}

void NullPlayer::play(const CopyInlineCommand& command) {
    std::byte* to = bytes(command.buffer, command.offset, command.size);
    if (!to) return;
    if (command.data > list_->inline_data.size() || command.size > list_->inline_data.size() - command.data)
        return complain(command.buffer, "the data end before the copy does");
    std::memcpy(to, list_->inline_data.data() + command.data, command.size);
}

void NullPlayer::play(const CopyBufferCommand& command) {
    const std::byte* from = bytes(command.source, command.source_offset, command.size);
    std::byte* to = bytes(command.destination, command.destination_offset, command.size);
    if (from && to) std::memmove(to, from, command.size);
}

void NullPlayer::play(const FillBufferCommand& command) {
    std::byte* to = bytes(command.buffer, command.offset, command.size);
    if (!to) return;
    for (uint64_t i = 0; i + 4 <= command.size; i += 4) std::memcpy(to + i, &command.value, 4);
}

void NullPlayer::play(const CopyBufferTextureCommand& command) {
    if (!inRange(command.texture, command.slice, command.region)) return;
    const auto& texture = native<NullTexture>(command.texture);
    const uint64_t layer_size = dataSize(texture.desc.format, command.region);
    std::byte* memory = bytes(command.buffer, command.offset, layer_size * command.slice.layers);
    if (!memory) return;
    const Grid grid(texture, command.slice.mip);
    const Region blocks = grid.blocks(command.region);
    const uint64_t row = blocks.width * grid.texel;
    for (uint32_t layer = 0; layer < command.slice.layers; layer++) {
        std::byte* texels = texture.texels(command.slice.mip, command.slice.layer + layer);
        for (uint32_t z = 0; z < blocks.depth; z++) {
            for (uint32_t y = 0; y < blocks.height; y++, memory += row) {
                std::byte* line = texels + grid.offset(blocks.x, blocks.y + y, blocks.z + z);
                if (command.header.type == CommandType::CopyBufferToTexture)
                    std::memcpy(line, memory, row);
                else
                    std::memcpy(memory, line, row);
            }
        }
    }
}

void NullPlayer::play(const CopyTextureCommand& command) {
    Region target = command.source_region;
    target.x = command.x;
    target.y = command.y;
    target.z = command.z;
    if (!inRange(command.source, command.source_slice, command.source_region) ||
        !inRange(command.destination, command.destination_slice, target))
        return;
    const auto& from = native<NullTexture>(command.source);
    const auto& to = native<NullTexture>(command.destination);
    const Grid source(from, command.source_slice.mip);
    const Grid destination(to, command.destination_slice.mip);
    const Region blocks = source.blocks(command.source_region);
    for (uint32_t layer = 0; layer < command.source_slice.layers; layer++) {
        const std::byte* read = from.texels(command.source_slice.mip, command.source_slice.layer + layer);
        std::byte* write = to.texels(command.destination_slice.mip, command.destination_slice.layer + layer);
        for (uint32_t z = 0; z < blocks.depth; z++)
            for (uint32_t y = 0; y < blocks.height; y++)
                std::memmove(write + destination.offset(command.x / destination.block,
                                                        command.y / destination.block + y, command.z + z),
                             read + source.offset(blocks.x, blocks.y + y, blocks.z + z), blocks.width * source.texel);
    }
}

void NullPlayer::play(const ClearTextureCommand& command) {
    ClearValue value;
    std::memcpy(&value, &command.value, sizeof(value));
    if (inRange(command.texture, command.slice, {})) clear(native<NullTexture>(command.texture), command.slice, value);
}

void NullPlayer::play(const BuildTracingsCommand& command) {
    for (const TracingBuild& build : std::span(list_->at<TracingBuild>(command.builds), command.count)) {
        auto& tracing = native<NullTracing>(build.tracing);
        counters_.builds++;
        if (tracing.is_compacted && !build.update)
            complain(build.tracing, "it was compacted and has no room for a build");
        bytes(build.scratch, build.scratch_offset, build.update ? tracing.update_size : tracing.build_size);
        if (build.instances == none) continue;
        const std::byte* records =
            bytes(build.instances, build.instances_offset, build.instance_count * sizeof(InstanceRecord));
        if (records) tracing.references = referencesOf({records, build.instance_count * sizeof(InstanceRecord)});
    }
}

void NullPlayer::play(const CopyTracingCommand& command) {
    native<NullTracing>(command.destination).references = native<NullTracing>(command.source).references;
}

void NullPlayer::play(const WriteTracingSizeCommand& command) {
    auto& tracing = native<NullTracing>(command.tracing);
    tracing.written_size = tracing.compacted_size;
}

void NullPlayer::beginTarget(const BeginTargetCommand& command) {
    target_ = &command;
    const auto load = [&](const Attachment& attachment) {
        if (attachment.texture == none || attachment.load != LoadOperation::Clear ||
            !inRange(attachment.texture, attachment.slice, {}))
            return;
        const auto& texture = native<NullTexture>(attachment.texture);
        const FormatInfo& info = formatInfo(texture.desc.format);
        ClearValue value;
        for (size_t i = 0; i < 4; i++) value.u[i] = clearBits(info.type, attachment.clear[i]);
        if (info.depth) value.u[1] = attachment.clear_stencil;
        clear(texture, attachment.slice, value);
    };
    for (uint32_t i = 0; i < command.color_count; i++) load(command.colors[i]);
    load(command.depth);
}

void NullPlayer::endTarget() {
    if (!target_) return;
    const auto store = [&](const Attachment& attachment) {
        if (attachment.texture == none || attachment.resolve == none ||
            !inRange(attachment.texture, attachment.slice, {}) ||
            !inRange(attachment.resolve, attachment.resolve_slice, {}))
            return;
        const auto& from = native<NullTexture>(attachment.texture);
        const auto& to = native<NullTexture>(attachment.resolve);
        const Grid source(from, attachment.slice.mip);
        const Grid destination(to, attachment.resolve_slice.mip);
        const uint32_t layers = std::min(attachment.slice.layers, attachment.resolve_slice.layers);
        for (uint32_t layer = 0; layer < layers; layer++)
            for (uint32_t y = 0; y < std::min(source.height, destination.height); y++)
                for (uint32_t x = 0; x < std::min(source.width, destination.width); x++)
                    std::memcpy(to.texels(attachment.resolve_slice.mip, attachment.resolve_slice.layer + layer) +
                                    destination.offset(x, y, 0),
                                from.texels(attachment.slice.mip, attachment.slice.layer + layer) +
                                    source.offset(x, y, 0),
                                formatInfo(to.desc.format).block_size);
    };
    for (uint32_t i = 0; i < target_->color_count; i++) store(target_->colors[i]);
    store(target_->depth);
    target_ = nullptr;
}

void NullPlayer::query(const QueryCommand& command) {
    auto& query = native<NullQuery>(command.query);
    std::array<uint64_t, 7> now = statistics_;
    if (query.type == Query::TypeTime) now = {nanoseconds_};
    if (query.type == Query::TypeSamples) now = {0};
    if (command.header.type == CommandType::BeginQuery) {
        query.begin = now;
        query.ended = false;
        return;
    }
    query.ended = true;
    if (query.type == Query::TypeTime)
        query.result = {query.begin[0], now[0]};
    else
        for (size_t i = 0; i < now.size(); i++) query.result[i] = now[i] - query.begin[i];
}

std::byte* NullPlayer::bytes(uint32_t resource, uint64_t offset, uint64_t size) {
    const auto& buffer = native<NullBuffer>(resource);
    if (offset <= buffer.size && size <= buffer.size - offset) return buffer.bytes.data() + offset;
    complain(resource, fmt::format("{} bytes from {} of {}", size, offset, buffer.size));
    return nullptr;
}

bool NullPlayer::inRange(uint32_t resource, const Slice& slice, const Region& region) {
    const auto& texture = native<NullTexture>(resource);
    const Region all = mipRegion(texture.desc, slice.mip);
    const auto within = [](uint32_t offset, uint32_t count, uint32_t end) {
        return offset <= end && count <= end - offset;
    };
    if (within(slice.mip, slice.mips, texture.desc.mipmaps) && within(slice.layer, slice.layers, texture.desc.layers) &&
        within(region.x, region.width, all.width) && within(region.y, region.height, all.height) &&
        within(region.z, region.depth, all.depth))
        return true;
    complain(resource, fmt::format("mip level {}, layers {} to {}, texels ({}, {}, {}) to ({}, {}, {})", slice.mip,
                                   slice.layer, slice.layer + slice.layers, region.x, region.y, region.z,
                                   region.x + region.width, region.y + region.height, region.z + region.depth));
    return false;
}

void NullPlayer::complain(uint32_t resource, const std::string& what) {
    control_.report(makeError(ErrorCode::Internal, "null.range", "command {} of '{}' reaches beyond {}: {}", command_,
                              list_->label, list_->resources[resource]->label(), what));
}

}  // namespace glint::null
