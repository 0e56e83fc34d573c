#include <glint/graphics/mesh_model.h>

#include <glint/base/format_error.h>
#include <glint/format/image.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <numeric>
#include <optional>

namespace glint {

namespace {

constexpr uint32_t max_slots = 16;
constexpr uint32_t max_stride = 2048;
constexpr MeshModel::Flags all_flags = MeshModel::FlagIndices16 | MeshModel::FlagIndices32 |
                                       MeshModel::FlagBufferStorage | MeshModel::FlagBufferTexel |
                                       MeshModel::FlagBufferAddress | MeshModel::FlagBufferTracing;

const char* toString(Pipeline::Attribute attribute) {
    constexpr const char* names[] = {"Position", "Basis",  "Normal", "Tangent", "TexCoord",
                                     "Weights",  "Joints", "Color",  "Custom"};
    return attribute <= Pipeline::AttributeCustom ? names[attribute] : "unknown";
}

/// What a format can hold, and half of the distance between the values that it has there.
struct FormatRange {
    float low, high, half_step;
};

std::optional<FormatRange> rangeOf(Format format) {
    switch (format) {
        case FormatRf32:
        case FormatRGf32:
        case FormatRGBf32:
        case FormatRGBAf32:
            return FormatRange{-std::numeric_limits<float>::max(), std::numeric_limits<float>::max(), 0};
        case FormatRf16:
        case FormatRGf16:
        case FormatRGBAf16: return FormatRange{-65504, 65504, 0};
        case FormatRu8n:
        case FormatRGu8n:
        case FormatRGBAu8n:
        case FormatBGRAu8n: return FormatRange{0, 1, 0.5f / 255};
        case FormatRi8n:
        case FormatRGi8n:
        case FormatRGBAi8n: return FormatRange{-1, 1, 0.5f / 127};
        case FormatRu16n:
        case FormatRGu16n:
        case FormatRGBAu16n: return FormatRange{0, 1, 0.5f / 65535};
        case FormatRi16n:
        case FormatRGi16n:
        case FormatRGBAi16n: return FormatRange{-1, 1, 0.5f / 32767};
        default: return std::nullopt;
    }
}

bool isInteger(Format format) {
    const FormatInfo& info = formatInfo(format);
    return info.type == FormatType::Int || info.type == FormatType::Uint;
}

/// Writes one attribute of all vertices. `value(i)` is what vertex i has.
template <class Value>
Error writeAttribute(const Pipeline::VertexAttribute& attribute, std::byte* bytes, uint32_t vertices,
                     const FormatRange& range, Value&& value) {
    const FormatInfo& info = formatInfo(attribute.format);
    const bool is_plain = info.block_size == info.components * sizeof(float);
    // An image of one texel knows how to round to every format.
    Expected<Image> texel = Image::create(attribute.format, 1, 1);
    if (!texel) return texel.error();
    for (uint32_t i = 0; i < vertices; i++, bytes += attribute.stride) {
        const Vector4f v = value(i);
        for (int c = 0; c < info.components; c++)
            if (!(v[c] >= range.low - range.half_step && v[c] <= range.high + range.half_step))
                return makeError(ErrorCode::OutOfRange, "model.range",
                                 "vertex {} has {} in attribute {}; {} holds {} to {}", i, v[c],
                                 toString(attribute.attribute), info.name, range.low, range.high);
        if (is_plain) {
            std::memcpy(bytes, &v, info.block_size);
        } else {
            texel->store(0, 0, v);
            std::memcpy(bytes, texel->bytes().data(), info.block_size);
        }
    }
    return {};
}

/// Writes an attribute where it belongs; `bytes` are zero.
Error write(const Pipeline::VertexAttribute& attribute, const Mesh& mesh, const std::vector<Vector3f>& normals,
            std::byte* bytes) {
    const auto vertices = static_cast<uint32_t>(mesh.positions.size());
    bytes += attribute.offset;
    if (attribute.attribute == Pipeline::AttributeJoints) {
        if (isInteger(attribute.format)) return {};
        return makeError(ErrorCode::InvalidArgument, "model.format", "attribute Joints is of integers, not of {}",
                         glint::toString(attribute.format));
    }
    const std::optional<FormatRange> range = rangeOf(attribute.format);
    if (!range)
        return makeError(ErrorCode::InvalidArgument, "model.format",
                         "attribute {} cannot be {}: float32, float16, or 8 or 16 normalised bits",
                         toString(attribute.attribute), glint::toString(attribute.format));
    switch (attribute.attribute) {
        case Pipeline::AttributePosition:
            return writeAttribute(attribute, bytes, vertices, *range,
                                  [&](uint32_t i) { return Vector4f(mesh.positions[i], 1.0f); });
        case Pipeline::AttributeNormal:
            return writeAttribute(attribute, bytes, vertices, *range,
                                  [&](uint32_t i) { return Vector4f(normals[i], 0.0f); });
        case Pipeline::AttributeTexCoord:
            if (mesh.texcoords.empty())
                return makeError(ErrorCode::InvalidArgument, "model.attribute", "the mesh has no texture coordinates");
            return writeAttribute(attribute, bytes, vertices, *range,
                                  [&](uint32_t i) { return Vector4f(mesh.texcoords[i], 0.0f, 0.0f); });
        case Pipeline::AttributeColor:
            return writeAttribute(attribute, bytes, vertices, *range, [](uint32_t) { return Vector4f(1.0f); });
        case Pipeline::AttributeWeights:
            return writeAttribute(attribute, bytes, vertices, *range, [](uint32_t) { return Vector4f(1, 0, 0, 0); });
        default:
            return makeError(ErrorCode::Unsupported, "model.attribute", "a mesh has nothing for attribute {}",
                             toString(attribute.attribute));
    }
}

std::vector<std::byte> indexBytes(const Mesh& mesh, Format format) {
    const uint64_t size = format == FormatRu16 ? 2 : 4;
    std::vector<std::byte> bytes((mesh.indices.size() * size + 3) / 4 * 4);
    if (format == FormatRu32) {
        std::memcpy(bytes.data(), mesh.indices.data(), bytes.size());
    } else {
        for (size_t i = 0; i < mesh.indices.size(); i++) {
            const auto index = static_cast<uint16_t>(mesh.indices[i]);
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

Status MeshModel::create(const Device& device, const Mesh& mesh, Flags flags, Where where) {
    return create(device, Layout{{Pipeline::AttributePosition, FormatRGBf32, 0, 0, sizeof(Vector3f)}}, mesh, flags,
                  where);
}

Status MeshModel::create(const Device& device, const Pipeline& pipeline, const Mesh& mesh, Flags flags, Where where) {
    const ObjectState state = pipeline.state();
    if (state == ObjectState::Null || state == ObjectState::Failed) {
        device_ = device;
        return fail(pipeline.error().at(where));
    }
    return create(device, pipeline.getAttributes(), mesh, flags, where);
}

Status MeshModel::create(const Device& device, const Layout& layout, const Mesh& mesh, Flags flags, Where where) {
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
        return build(device, mesh, where);
    } catch (const std::bad_alloc&) {
        return fail(makeError(where, ErrorCode::OutOfMemory, "model.out_of_memory",
                              "{}: memory for {} bytes of vertices and {} of indices ran out", name_, vertex_size_,
                              index_size_));
    }
}

Status MeshModel::build(const Device& device, const Mesh& mesh, Where where) {
    const auto refused = [&](const Error& error) { return fail(error.named(name_).at(where)); };
    if (!device) return fail(device.error().at(where));
    if (Status status = mesh.validate(); !status) return refused(status.error());
    if (Error error = checkFlags(mesh, where)) return fail(error);
    if (Error error = findStreams(mesh.positions.size(), where)) return fail(error);

    const bool is_read = flags_ & (FlagBufferStorage | FlagBufferTexel | FlagBufferAddress);
    const bool fits = mesh.positions.size() <= 65536;
    index_format_ =
        (flags_ & FlagIndices16) || (fits && !is_read && !(flags_ & FlagIndices32)) ? FormatRu16 : FormatRu32;
    index_size_ = (mesh.indices.size() * (index_format_ == FormatRu16 ? 2 : 4) + 3) / 4 * 4;
    const uint64_t limit = device.getFeatures().maxBufferSize;
    if (index_size_ > limit || mesh.indices.size() > UINT32_MAX)
        return fail(makeError(where, ErrorCode::OutOfRange, "model.too_large",
                              "{}: {} indices of {} bytes exceed the limit of {} bytes", name_, mesh.indices.size(),
                              index_size_, limit));
    geometries_ = mesh.parts;
    if (geometries_.empty()) geometries_.push_back({{}, 0, static_cast<uint32_t>(mesh.indices.size())});

    std::vector<Vector3f> made;
    const bool wants_normals = std::ranges::any_of(
        layout_, [](const auto& attribute) { return attribute.attribute == Pipeline::AttributeNormal; });
    if (wants_normals && mesh.normals.empty()) {
        Mesh bare;
        bare.positions = mesh.positions;
        bare.indices = mesh.indices;
        bare.createNormals();
        made = std::move(bare.normals);
    }
    std::vector<std::byte> vertices(vertex_size_);
    for (const Pipeline::VertexAttribute& attribute : layout_)
        if (const Error error = write(attribute, mesh, made.empty() ? mesh.normals : made,
                                      vertices.data() + stream(attribute.buffer)->offset))
            return refused(error);
    const std::vector<std::byte> indices = indexBytes(mesh, index_format_);

    Buffer::Flags flags = 0;
    if (flags_ & FlagBufferStorage) flags |= Buffer::FlagStorage;
    if (flags_ & FlagBufferTexel) flags |= Buffer::FlagTexel;
    if (flags_ & FlagBufferAddress) flags |= Buffer::FlagAddress;
    if (flags_ & FlagBufferTracing) flags |= Buffer::FlagTracing;
    Device maker = device;
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

Error MeshModel::checkFlags(const Mesh& mesh, Where where) const {
    if (flags_ & ~all_flags)
        return makeError(where, ErrorCode::InvalidArgument, "model.flags", "{}: unknown flags {:#x}", name_,
                         flags_ & ~all_flags);
    if ((flags_ & FlagIndices16) && (flags_ & FlagIndices32))
        return makeError(where, ErrorCode::InvalidArgument, "model.flags",
                         "{}: FlagIndices16 and FlagIndices32 exclude each other", name_);
    if ((flags_ & FlagIndices16) && mesh.positions.size() > 65536)
        return makeError(where, ErrorCode::OutOfRange, "model.indices",
                         "{}: {} vertices; indices of 16 bits name at most 65536", name_, mesh.positions.size());
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
