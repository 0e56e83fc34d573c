#include <glint/graphics/mesh_model.h>

#include <glint/base/format_error.h>
#include <glint/graphics/detail/vertex_source.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <numeric>

namespace glint {

namespace {

constexpr uint32_t max_slots = 16;
constexpr uint32_t max_stride = 2048;
constexpr MeshModel::Flags all_flags = MeshModel::FlagIndices16 | MeshModel::FlagIndices32 |
                                       MeshModel::FlagBufferStorage | MeshModel::FlagBufferTexel |
                                       MeshModel::FlagBufferAddress | MeshModel::FlagBufferTracing;

using detail::toString;
using detail::VertexSource;

bool wants(const MeshModel::Layout& layout, Pipeline::Attribute attribute) {
    return std::ranges::find(layout, attribute, &Pipeline::VertexAttribute::attribute) != layout.end();
}

std::vector<std::byte> indexBytes(std::span<const uint32_t> indices, Format format) {
    const uint64_t size = format == FormatRu16 ? 2 : 4;
    std::vector<std::byte> bytes((indices.size() * size + 3) / 4 * 4);
    if (format == FormatRu32) {
        std::memcpy(bytes.data(), indices.data(), bytes.size());
    } else {
        for (size_t i = 0; i < indices.size(); i++) {
            const auto index = static_cast<uint16_t>(indices[i]);
            std::memcpy(&bytes[i * sizeof(index)], &index, sizeof(index));
        }
    }
    return bytes;
}

}  // namespace

MeshModel::MeshModel(const Device& device, const Mesh& mesh, Flags flags, Where where) {
    (void)create(device, mesh, flags, where);
}

MeshModel::MeshModel(const Device& device, const Pipeline& pipeline, const Mesh& mesh, Flags flags, Where where) {
    (void)create(device, pipeline, mesh, flags, where);
}

MeshModel::MeshModel(const Device& device, const Layout& layout, const Mesh& mesh, Flags flags, Where where) {
    (void)create(device, layout, mesh, flags, where);
}

MeshModel::MeshModel(const Device& device, const Pipeline& pipeline, const SceneMesh& mesh, Flags flags, Where where) {
    (void)create(device, pipeline, mesh, flags, where);
}

MeshModel::MeshModel(const Device& device, const Layout& layout, const SceneMesh& mesh, Flags flags, Where where) {
    (void)create(device, layout, mesh, flags, where);
}

Status MeshModel::create(const Device& device, const Mesh& mesh, Flags flags, Where where) {
    return create(device, Layout{{Pipeline::AttributePosition, FormatRGBf32, 0, 0, sizeof(Vector3f)}}, mesh, flags,
                  where);
}

Status MeshModel::create(const Device& device, const Pipeline& pipeline, const Mesh& mesh, Flags flags, Where where) {
    if (Status status = layoutOf(device, pipeline, where); !status) return status;
    return create(device, pipeline.getAttributes(), mesh, flags, where);
}

Status MeshModel::create(const Device& device, const Pipeline& pipeline, const SceneMesh& mesh, Flags flags,
                         Where where) {
    if (Status status = layoutOf(device, pipeline, where); !status) return status;
    return create(device, pipeline.getAttributes(), mesh, flags, where);
}

Status MeshModel::layoutOf(const Device& device, const Pipeline& pipeline, Where where) {
    const ObjectState state = pipeline.state();
    if (state != ObjectState::Null && state != ObjectState::Failed) return {};
    device_ = device;
    return fail(pipeline.error().at(where));
}

Status MeshModel::create(const Device& device, const Layout& layout, const Mesh& mesh, Flags flags, Where where) {
    return create(device, layout, flags, where, mesh.positions.size(), mesh.indices.size(),
                  [&]() -> Expected<VertexSource> {
                      if (Status status = mesh.validate(); !status) return unexpected(status.error());
                      return VertexSource::of(mesh, wants(layout_, Pipeline::AttributeNormal));
                  });
}

Status MeshModel::create(const Device& device, const Layout& layout, const SceneMesh& mesh, Flags flags, Where where) {
    uint64_t vertices = 0, indices = 0;
    for (const ScenePrimitive& primitive : mesh.primitives) {
        vertices += primitive.positions.size();
        indices += primitive.indices.size();
    }
    return create(device, layout, flags, where, vertices, indices, [&]() -> Expected<VertexSource> {
        for (size_t i = 0; i < mesh.primitives.size(); i++)
            if (Status status = mesh.primitives[i].validate(); !status)
                return unexpected(status.error().named(fmt::format("primitives[{}]", i)));
        if (indices == 0)
            return unexpected(makeError(ErrorCode::InvalidArgument, "mesh.no_faces", "the mesh has no triangles"));
        return VertexSource::of(mesh, wants(layout_, Pipeline::AttributeNormal));
    });
}

Status MeshModel::create(const Device& device, const Layout& layout, Flags flags, Where where, uint64_t vertices,
                         uint64_t indices, const MakeSource& source) {
    device_ = device;
    error_ = {};
    layout_ = layout;
    std::erase_if(layout_, [](const Pipeline::VertexAttribute& attribute) { return attribute.rate != 0; });
    flags_ = flags;
    geometries_.clear();
    streams_.clear();
    vertex_buffer_ = {};
    index_buffer_ = {};
    vertices_ = 0;
    vertex_size_ = index_size_ = vertex_offset_ = index_offset_ = 0;
    try {
        return build(vertices, indices, source, where);
    } catch (const std::bad_alloc&) {
        return fail(makeError(where, ErrorCode::OutOfMemory, "model.out_of_memory",
                              "{}: memory for {} bytes of vertices and {} of indices ran out", name_, vertex_size_,
                              index_size_));
    }
}

Status MeshModel::build(uint64_t vertex_count, uint64_t index_count, const MakeSource& make, Where where) {
    const auto refused = [&](const Error& error) { return fail(error.named(name_).at(where)); };
    if (!device_) return fail(device_.error().at(where));
    if (Error error = checkFlags(vertex_count, where)) return fail(error);
    if (Error error = findStreams(vertex_count, where)) return fail(error);

    const bool is_read = flags_ & (FlagBufferStorage | FlagBufferTexel | FlagBufferAddress);
    const bool fits = vertex_count <= 65536;
    index_format_ =
        (flags_ & FlagIndices16) || (fits && !is_read && !(flags_ & FlagIndices32)) ? FormatRu16 : FormatRu32;
    index_size_ = (index_count * (index_format_ == FormatRu16 ? 2 : 4) + 3) / 4 * 4;
    const uint64_t limit = device_.getFeatures().maxBufferSize;
    if (index_size_ > limit || index_count > UINT32_MAX)
        return fail(makeError(where, ErrorCode::OutOfRange, "model.too_large",
                              "{}: {} indices of {} bytes exceed the limit of {} bytes", name_, index_count,
                              index_size_, limit));
    const Expected<VertexSource> source = make();
    if (!source) return refused(source.error());
    geometries_ = source->parts;

    std::vector<std::byte> vertices(vertex_size_);
    size_t texcoords = 0;
    for (const Pipeline::VertexAttribute& attribute : layout_) {
        const size_t set = attribute.attribute == Pipeline::AttributeTexCoord ? texcoords++ : 0;
        if (const Error error = source->write(attribute, set, vertices.data() + stream(attribute.buffer)->offset))
            return refused(error);
    }
    const std::vector<std::byte> indices = indexBytes(source->indices, index_format_);

    Buffer::Flags flags = 0;
    if (flags_ & FlagBufferStorage) flags |= Buffer::FlagStorage;
    if (flags_ & FlagBufferTexel) flags |= Buffer::FlagTexel;
    if (flags_ & FlagBufferAddress) flags |= Buffer::FlagAddress;
    if (flags_ & FlagBufferTracing) flags |= Buffer::FlagTracing;
    Device maker = device_;
    if (!vertex_callback_ || !vertex_callback_(vertices.data(), vertices.size()))
        vertex_buffer_ =
            maker.createBuffer(flags | Buffer::FlagVertex, std::span(vertices), name_ + " vertices", where);
    if (!index_callback_ || !index_callback_(indices.data(), indices.size()))
        index_buffer_ = maker.createBuffer(flags | Buffer::FlagIndex, std::span(indices), name_ + " indices", where);
    // The device has told of these.
    for (const Buffer& buffer : {vertex_buffer_, index_buffer_})
        if (buffer.state() == ObjectState::Failed) return error_ = buffer.error();
    return {};
}

Error MeshModel::checkFlags(uint64_t vertices, Where where) const {
    if (flags_ & ~all_flags)
        return makeError(where, ErrorCode::InvalidArgument, "model.flags", "{}: unknown flags {:#x}", name_,
                         flags_ & ~all_flags);
    if ((flags_ & FlagIndices16) && (flags_ & FlagIndices32))
        return makeError(where, ErrorCode::InvalidArgument, "model.flags",
                         "{}: FlagIndices16 and FlagIndices32 exclude each other", name_);
    if ((flags_ & FlagIndices16) && vertices > 65536)
        return makeError(where, ErrorCode::OutOfRange, "model.indices",
                         "{}: {} vertices; indices of 16 bits name at most 65536", name_, vertices);
    return {};
}

/// Checks the layout and finds a place for the vertices of each slot.
Error MeshModel::findStreams(uint64_t vertices, Where where) {
    const auto wrong = [&]<class... Args>(fmt::format_string<Args...> format, Args&&... args) {
        return makeError(where, ErrorCode::InvalidArgument, "model.layout", "{}: {}", name_,
                         fmt::format(format, std::forward<Args>(args)...));
    };
    if (layout_.empty()) return wrong("the layout has no attribute that steps by vertex");
    for (size_t i = 0; i < layout_.size(); i++) {
        const Pipeline::VertexAttribute& a = layout_[i];
        const uint32_t size = formatInfo(a.format).block_size;
        if (size == 0 || formatInfo(a.format).compressed)
            return wrong("attribute {} has format {}", toString(a.attribute), glint::toString(a.format));
        if (a.buffer >= max_slots || a.stride > max_stride || a.offset > a.stride || size > a.stride - a.offset)
            return wrong("attribute {}: {} bytes at offset {} of a stride of {} in slot {}; strides are at most {}, "
                         "slots at most {}",
                         toString(a.attribute), size, a.offset, a.stride, a.buffer, max_stride, max_slots - 1);
        for (size_t k = 0; k < i; k++) {
            const Pipeline::VertexAttribute& b = layout_[k];
            if (a.buffer != b.buffer) continue;
            if (a.stride != b.stride) return wrong("slot {} has strides {} and {}", a.buffer, b.stride, a.stride);
            if (a.offset < b.offset + formatInfo(b.format).block_size && b.offset < a.offset + size)
                return wrong("attributes {} and {} share bytes of slot {}", toString(b.attribute),
                             toString(a.attribute), a.buffer);
        }
        if (!stream(a.buffer)) streams_.push_back({a.buffer, a.stride, 0});
    }
    vertices_ = static_cast<uint32_t>(std::min<uint64_t>(vertices, UINT32_MAX));
    for (Stream& stream : streams_) {
        const uint64_t step = std::lcm(stream.stride, 4u);
        stream.offset = (vertex_size_ + step - 1) / step * step;
        vertex_size_ = stream.offset + vertices * stream.stride;
    }
    const uint64_t limit = device_.getFeatures().maxBufferSize;
    if (vertices > UINT32_MAX || vertex_size_ > limit)
        return makeError(where, ErrorCode::OutOfRange, "model.too_large",
                         "{}: {} vertices of {} bytes exceed the limit of {} bytes", name_, vertices, vertex_size_,
                         limit);
    return {};
}

Status MeshModel::fail(const Error& error) {
    error_ = error;
    device_.report(error);
    return error;
}

Error MeshModel::error() const { return device_ || error_ ? error_ : device_.error(); }

Error MeshModel::placed(const char* what, const Buffer& buffer, uint64_t offset, uint64_t size, Where where) const {
    if (!*this) return error().at(where);
    if (!buffer)
        return makeError(where, ErrorCode::InvalidArgument, "model.buffer", "{}: {}: the buffer is not usable ({})",
                         name_, what, buffer.error().message());
    if (offset > buffer.getSize() || size > buffer.getSize() - offset)
        return makeError(where, ErrorCode::OutOfRange, "model.buffer",
                         "{}: {}: {} bytes from offset {} exceed buffer '{}' of {} bytes", name_, what, size, offset,
                         buffer.name(), buffer.getSize());
    return {};
}

void MeshModel::setVertexBuffer(const Buffer& buffer, uint64_t offset, Where where) {
    Error error = placed("setVertexBuffer", buffer, offset, vertex_size_, where);
    for (const Stream& stream : streams_)
        if (!error && (offset % 4 || (offset + stream.offset) % stream.stride))
            error = makeError(where, ErrorCode::InvalidArgument, "model.buffer",
                              "{}: setVertexBuffer: offset {} puts the vertices of slot {} at {}; it has to be a "
                              "multiple of 4, and that one of their stride {}",
                              name_, offset, stream.slot, offset + stream.offset, stream.stride);
    if (error) return (void)fail(error);
    vertex_buffer_ = buffer;
    vertex_offset_ = offset;
}

void MeshModel::setIndexBuffer(const Buffer& buffer, uint64_t offset, Where where) {
    Error error = placed("setIndexBuffer", buffer, offset, index_size_, where);
    if (!error && offset % 4)
        error = makeError(where, ErrorCode::InvalidArgument, "model.buffer",
                          "{}: setIndexBuffer: offset {} is no multiple of 4", name_, offset);
    if (error) return (void)fail(error);
    index_buffer_ = buffer;
    index_offset_ = offset;
}

const MeshModel::Stream* MeshModel::stream(uint32_t slot) const {
    const auto found = std::ranges::find(streams_, slot, &Stream::slot);
    return found == streams_.end() ? nullptr : &*found;
}

const MeshPart& MeshModel::find(uint32_t geometry) const {
    static const MeshPart none;
    return geometry < geometries_.size() ? geometries_[geometry] : none;
}

uint32_t MeshModel::getVertexStride(uint32_t slot) const {
    const Stream* found = stream(slot);
    return found ? found->stride : 0;
}

uint64_t MeshModel::getVertexOffset(uint32_t slot) const {
    const Stream* found = stream(slot);
    return found ? vertex_offset_ + found->offset : 0;
}

uint32_t MeshModel::getBaseVertex(uint32_t slot) const {
    const Stream* found = stream(slot);
    return found ? static_cast<uint32_t>((vertex_offset_ + found->offset) / found->stride) : 0;
}

uint32_t MeshModel::getFirstIndex(uint32_t geometry) const {
    if (geometry >= geometries_.size()) return 0;
    return static_cast<uint32_t>(index_offset_ / (index_format_ == FormatRu16 ? 2 : 4)) +
           geometries_[geometry].first_index;
}

bool MeshModel::setBuffers(Command& command, Where where) const {
    if (!*this) {
        command.fail(error().at(where));
        return false;
    }
    for (const Stream& stream : streams_)
        command.setVertexBuffer(stream.slot, vertex_buffer_, vertex_offset_ + stream.offset, where);
    command.setIndexBuffer(index_format_, index_buffer_, index_offset_, where);
    return true;
}

void MeshModel::draw(Command& command, Where where) const {
    if (!setBuffers(command, where)) return;
    for (const MeshPart& geometry : geometries_)
        if (geometry.index_count) command.drawElements(geometry.index_count, geometry.first_index, 0, where);
}

void MeshModel::draw(Command& command, uint32_t geometry, uint32_t instances, Where where) const {
    if (*this && geometry >= geometries_.size())
        return command.fail(makeError(where, ErrorCode::OutOfRange, "model.geometry",
                                      "draw: '{}' has {} geometries, there is no number {}", name_, geometries_.size(),
                                      geometry));
    if (!setBuffers(command, where)) return;
    const MeshPart& part = geometries_[geometry];
    if (part.index_count && instances)
        command.drawElementsInstanced(part.index_count, part.first_index, 0, instances, 0, where);
}

Tracing MeshModel::createTracing(Tracing::Flags flags, Where where) const {
    Device device = device_;
    Tracing tracing = device.createTracing(name_, where);
    const auto position =
        std::ranges::find(layout_, Pipeline::AttributePosition, &Pipeline::VertexAttribute::attribute);
    const Format format = position == layout_.end() ? FormatUnknown : position->format;
    const uint32_t slot = position == layout_.end() ? 0 : position->buffer;
    const uint64_t offset = getVertexOffset(slot) + (position == layout_.end() ? 0 : position->offset);
    const uint64_t index_size = index_format_ == FormatRu16 ? 2 : 4;
    // Without buffers the structure fails, and says so.
    const Buffer vertices = *this ? vertex_buffer_ : Buffer();
    const Buffer indices = *this ? index_buffer_ : Buffer();
    for (const MeshPart& geometry : geometries_) {
        tracing.addVertexBuffer(vertices_, format, getVertexStride(slot), vertices, offset, where);
        tracing.addIndexBuffer(geometry.index_count, index_format_, indices,
                               index_offset_ + geometry.first_index * index_size, where);
    }
    (void)tracing.create(Tracing::TypeTriangle, flags, where);
    return tracing;
}

}  // namespace glint
