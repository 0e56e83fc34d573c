#include <glint/graphics/detail/vertex_source.h>

#include <glint/base/format_error.h>
#include <glint/format/image.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

namespace glint::detail {

const char* toString(Pipeline::Attribute attribute) {
    constexpr const char* names[] = {"Position", "Basis",  "Normal", "Tangent", "TexCoord",
                                     "Weights",  "Joints", "Color",  "Custom"};
    return attribute <= Pipeline::AttributeCustom ? names[attribute] : "unknown";
}

namespace {

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

template <class Joint>
Error writeJoints(const Pipeline::VertexAttribute& attribute, std::byte* bytes,
                  std::span<const std::array<uint16_t, 4>> joints) {
    const size_t components = formatInfo(attribute.format).components;
    for (size_t i = 0; i < joints.size(); i++, bytes += attribute.stride) {
        std::array<Joint, 4> values;
        for (size_t k = 0; k < components; k++) {
            values[k] = static_cast<Joint>(joints[i][k]);
            if (values[k] < 0 || static_cast<uint64_t>(values[k]) != joints[i][k])
                return makeError(ErrorCode::OutOfRange, "model.range",
                                 "vertex {} follows joint {}, which {} cannot hold", i, joints[i][k],
                                 glint::toString(attribute.format));
        }
        std::memcpy(bytes, values.data(), components * sizeof(Joint));
    }
    return {};
}

Error writeJoints(const Pipeline::VertexAttribute& attribute, std::byte* bytes,
                  std::span<const std::array<uint16_t, 4>> joints) {
    const FormatInfo& info = formatInfo(attribute.format);
    const bool is_signed = info.type == FormatType::Int;
    if (!isInteger(attribute.format))
        return makeError(ErrorCode::InvalidArgument, "model.format", "attribute Joints is of integers, not of {}",
                         glint::toString(attribute.format));
    switch (info.block_size / info.components) {
        case 1:
            return is_signed ? writeJoints<int8_t>(attribute, bytes, joints)
                             : writeJoints<uint8_t>(attribute, bytes, joints);
        case 2:
            return is_signed ? writeJoints<int16_t>(attribute, bytes, joints)
                             : writeJoints<uint16_t>(attribute, bytes, joints);
        default: return writeJoints<uint32_t>(attribute, bytes, joints);
    }
}

/// Appends an attribute of a primitive, or as many defaults.
template <class T>
void append(std::vector<T>& all, const std::vector<T>& values, size_t vertices, const T& missing) {
    if (values.empty())
        all.resize(all.size() + vertices, missing);
    else
        all.insert(all.end(), values.begin(), values.end());
}

std::vector<Vector3f> createNormals(const std::vector<Vector3f>& positions, const std::vector<uint32_t>& indices) {
    Mesh bare;
    bare.positions = positions;
    bare.indices = indices;
    bare.createNormals();
    return std::move(bare.normals);
}

}  // namespace

VertexSource VertexSource::of(const Mesh& mesh, bool with_normals) {
    VertexSource source;
    source.positions = mesh.positions;
    source.texcoords[0] = mesh.texcoords;
    source.indices = mesh.indices;
    source.parts = mesh.parts;
    if (source.parts.empty()) source.parts.push_back({{}, 0, static_cast<uint32_t>(mesh.indices.size())});
    if (!with_normals) return source;
    if (mesh.normals.empty()) source.own_normals_ = createNormals(mesh.positions, mesh.indices);
    source.normals = mesh.normals.empty() ? source.own_normals_ : mesh.normals;
    return source;
}

VertexSource VertexSource::of(const SceneMesh& mesh, bool with_normals) {
    VertexSource source;
    source.is_scene = true;
    for (const ScenePrimitive& primitive : mesh.primitives) {
        const size_t vertices = primitive.positions.size();
        const auto first_vertex = static_cast<uint32_t>(source.own_positions_.size());
        append(source.own_positions_, primitive.positions, vertices, {});
        if (with_normals)
            append(source.own_normals_,
                   primitive.normals.empty() ? createNormals(primitive.positions, primitive.indices)
                                             : primitive.normals,
                   vertices, {});
        for (size_t set = 0; set < 2; set++)
            append(source.own_texcoords_[set], primitive.texcoords[set], vertices, Vector2f(0.0f));
        append(source.own_tangents_, primitive.tangents, vertices, Vector4f(0, 0, 0, 1));
        append(source.own_colors_, primitive.colors, vertices, Vector4f(1.0f));
        append(source.own_weights_, primitive.weights, vertices, Vector4f(1, 0, 0, 0));
        append(source.own_joints_, primitive.joints, vertices, {});
        source.parts.push_back({.name = mesh.name,
                                .first_index = static_cast<uint32_t>(source.own_indices_.size()),
                                .index_count = static_cast<uint32_t>(primitive.indices.size()),
                                .material = primitive.material});
        for (const uint32_t index : primitive.indices) source.own_indices_.push_back(first_vertex + index);
    }
    source.positions = source.own_positions_;
    source.normals = source.own_normals_;
    source.texcoords = {source.own_texcoords_[0], source.own_texcoords_[1]};
    source.tangents = source.own_tangents_;
    source.colors = source.own_colors_;
    source.weights = source.own_weights_;
    source.joints = source.own_joints_;
    source.indices = source.own_indices_;
    return source;
}

Error VertexSource::write(const Pipeline::VertexAttribute& attribute, size_t set, std::byte* bytes) const {
    const auto vertices = static_cast<uint32_t>(positions.size());
    bytes += attribute.offset;
    if (attribute.attribute == Pipeline::AttributeJoints) return writeJoints(attribute, bytes, joints);
    const std::optional<FormatRange> range = rangeOf(attribute.format);
    if (!range)
        return makeError(ErrorCode::InvalidArgument, "model.format",
                         "attribute {} cannot be {}: float32, float16, or 8 or 16 normalised bits",
                         toString(attribute.attribute), glint::toString(attribute.format));
    const auto nothing = [&](const char* what) {
        return makeError(ErrorCode::Unsupported, "model.attribute", "a mesh has {} for attribute {}", what,
                         toString(attribute.attribute));
    };
    const auto vectors = [&](std::span<const Vector4f> values, const Vector4f& missing) {
        return writeAttribute(attribute, bytes, vertices, *range,
                              [&](uint32_t i) { return values.empty() ? missing : values[i]; });
    };
    switch (attribute.attribute) {
        case Pipeline::AttributePosition:
            return writeAttribute(attribute, bytes, vertices, *range,
                                  [&](uint32_t i) { return Vector4f(positions[i], 1.0f); });
        case Pipeline::AttributeNormal:
            return writeAttribute(attribute, bytes, vertices, *range,
                                  [&](uint32_t i) { return Vector4f(normals[i], 0.0f); });
        case Pipeline::AttributeTexCoord:
            if (set >= (is_scene ? 2 : 1)) return nothing("no further texture coordinates");
            if (texcoords[set].empty())
                return makeError(ErrorCode::InvalidArgument, "model.attribute", "the mesh has no texture coordinates");
            return writeAttribute(attribute, bytes, vertices, *range,
                                  [&](uint32_t i) { return Vector4f(texcoords[set][i], 0.0f, 0.0f); });
        case Pipeline::AttributeTangent:
            if (!is_scene) return nothing("nothing");
            return vectors(tangents, Vector4f(0, 0, 0, 1));
        case Pipeline::AttributeColor: return vectors(colors, Vector4f(1.0f));
        case Pipeline::AttributeWeights: return vectors(weights, Vector4f(1, 0, 0, 0));
        default: return nothing("nothing");
    }
}

}  // namespace glint::detail
