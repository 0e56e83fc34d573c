#include <glint/format/detail/gltf_accessor.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace glint::detail {

namespace {

static_assert(std::endian::native == std::endian::little, "glTF's binary data is little-endian");

template <class T>
T load(const std::byte* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
}

/// One component as a float: glTF 2.0, section 3.6.2.2 for normalised integers.
float toFloat(const std::byte* bytes, int type, bool is_normalized) {
    switch (type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE: {
            const auto value = static_cast<float>(load<int8_t>(bytes));
            return is_normalized ? std::max(value / 127.0f, -1.0f) : value;
        }
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: {
            const auto value = static_cast<float>(load<uint8_t>(bytes));
            return is_normalized ? value / 255.0f : value;
        }
        case TINYGLTF_COMPONENT_TYPE_SHORT: {
            const auto value = static_cast<float>(load<int16_t>(bytes));
            return is_normalized ? std::max(value / 32767.0f, -1.0f) : value;
        }
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: {
            const auto value = static_cast<float>(load<uint16_t>(bytes));
            return is_normalized ? value / 65535.0f : value;
        }
        default: return load<float>(bytes);
    }
}

uint32_t toInteger(const std::byte* bytes, int type) {
    switch (type) {
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return load<uint8_t>(bytes);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return load<uint16_t>(bytes);
        default: return load<uint32_t>(bytes);
    }
}

bool contains(std::span<const int> values, int value) {
    return std::find(values.begin(), values.end(), value) != values.end();
}

const char* typeName(int type) {
    switch (type) {
        case TINYGLTF_TYPE_SCALAR: return "SCALAR";
        case TINYGLTF_TYPE_VEC2: return "VEC2";
        case TINYGLTF_TYPE_VEC3: return "VEC3";
        case TINYGLTF_TYPE_VEC4: return "VEC4";
        case TINYGLTF_TYPE_MAT4: return "MAT4";
        default: return "MAT2 or MAT3";
    }
}

}  // namespace

Expected<std::span<const std::byte>> GltfAccessors::view(int view, const GltfPath& path) const {
    const tinygltf::BufferView& source = model_.bufferViews[static_cast<size_t>(view)];
    const std::span<const std::byte> buffer = buffers_[static_cast<size_t>(source.buffer)];
    if (source.byteOffset > buffer.size() || source.byteLength > buffer.size() - source.byteOffset)
        return unexpected(gltfError(path, ErrorCode::Io, "gltf.view_range",
                                    "bufferViews[{}] has {} bytes from byte {} of the {} of buffers[{}]", view,
                                    source.byteLength, source.byteOffset, buffer.size(), source.buffer));
    return buffer.subspan(source.byteOffset, source.byteLength);
}

Expected<GltfAccessors::Source> GltfAccessors::source(int view_index, uint64_t offset, uint64_t count,
                                                      size_t component_size, size_t element_size, bool has_stride,
                                                      const GltfPath& path) const {
    const Expected<std::span<const std::byte>> bytes = view(view_index, path);
    if (!bytes) return unexpected(bytes.error());
    const tinygltf::BufferView& view = model_.bufferViews[static_cast<size_t>(view_index)];
    const size_t stride = has_stride && view.byteStride != 0 ? view.byteStride : element_size;
    if (stride < element_size)
        return unexpected(gltfError(path, ErrorCode::Io, "gltf.stride",
                                    "bufferViews[{}] has a stride of {} bytes for elements of {}", view_index, stride,
                                    element_size));
    if ((view.byteOffset % component_size + offset % component_size) % component_size != 0 ||
        stride % component_size != 0)
        return unexpected(gltfError(path, ErrorCode::Io, "gltf.alignment",
                                    "components of {} bytes begin at byte {} of bufferViews[{}], which begins at byte "
                                    "{}, and are {} bytes apart",
                                    component_size, offset, view_index, view.byteOffset, stride));
    // The last element may end before its stride does.
    if (offset > bytes->size() || bytes->size() - offset < element_size ||
        count - 1 > (bytes->size() - offset - element_size) / stride)
        return unexpected(gltfError(path, ErrorCode::Io, "gltf.accessor_range",
                                    "{} elements of {} bytes, {} bytes apart, from byte {} end beyond the {} bytes of "
                                    "bufferViews[{}]",
                                    count, element_size, stride, offset, bytes->size(), view_index));
    return Source{bytes->data() + offset, stride};
}

template <class T>
Expected<GltfElements<T>> GltfAccessors::read(int index, const GltfUse& use, const GltfPath& path) const {
    const tinygltf::Accessor& accessor = model_.accessors[static_cast<size_t>(index)];
    const bool is_integer = accessor.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT;
    if (!contains(use.types, accessor.type) || !contains(use.components, accessor.componentType) ||
        (use.fractions_only && is_integer && !accessor.normalized))
        return unexpected(gltfError(path, ErrorCode::Io, "gltf.accessor_type",
                                    "accessors[{}] has elements {} of component type {}{}, which this cannot be", index,
                                    typeName(accessor.type), accessor.componentType,
                                    accessor.normalized ? ", normalised" : ""));
    const auto components = static_cast<size_t>(tinygltf::GetNumComponentsInType(static_cast<uint32_t>(accessor.type)));
    const auto component_size =
        static_cast<size_t>(tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(accessor.componentType)));
    const size_t element_size = components * component_size;

    Source base;
    if (accessor.bufferView >= 0) {
        Expected<Source> found =
            source(accessor.bufferView, accessor.byteOffset, accessor.count, component_size, element_size, true, path);
        if (!found) return unexpected(found.error());
        base = *found;
    }
    if (Status status = budget_.take(path, accessor.count, components * sizeof(T)); !status)
        return unexpected(status.error());

    GltfElements<T> elements;
    elements.components = components;
    elements.values.resize(accessor.count * components);
    const auto convert = [&](const std::byte* bytes, size_t element) -> Status {
        for (size_t k = 0; k < components; k++) {
            const std::byte* component = bytes + k * component_size;
            T& value = elements.values[element * components + k];
            if constexpr (std::is_same_v<T, float>) {
                value = toFloat(component, accessor.componentType, accessor.normalized);
                if (!std::isfinite(value))
                    return gltfError(path, ErrorCode::Io, "gltf.not_finite",
                                     "element {} of accessors[{}] has the value {}", element, index, value);
            } else {
                value = toInteger(component, accessor.componentType);
            }
        }
        return {};
    };
    if (base.first)
        for (size_t i = 0; i < accessor.count; i++)
            if (Status status = convert(base.at(i), i); !status) return unexpected(status.error());

    if (accessor.sparse.isSparse) {
        const auto& sparse = accessor.sparse;
        const auto count = static_cast<uint64_t>(sparse.count);
        const auto index_size =
            static_cast<size_t>(tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(sparse.indices.componentType)));
        const Expected<Source> places =
            source(sparse.indices.bufferView, static_cast<uint64_t>(sparse.indices.byteOffset), count, index_size,
                   index_size, false, path / "sparse.indices");
        if (!places) return unexpected(places.error());
        const Expected<Source> values =
            source(sparse.values.bufferView, static_cast<uint64_t>(sparse.values.byteOffset), count, component_size,
                   element_size, false, path / "sparse.values");
        if (!values) return unexpected(values.error());
        uint64_t least = 0;
        for (size_t i = 0; i < count; i++) {
            const uint32_t place = toInteger(places->at(i), sparse.indices.componentType);
            if (place < least || place >= accessor.count)
                return unexpected(gltfError(path, ErrorCode::Io, "gltf.sparse",
                                            "sparse index {} of accessors[{}] is {}: they increase, and are less than "
                                            "the {} elements",
                                            i, index, place, accessor.count));
            least = uint64_t{place} + 1;
            if (Status status = convert(values->at(i), place); !status) return unexpected(status.error());
        }
    }
    return elements;
}

Expected<GltfElements<float>> GltfAccessors::floats(int accessor, const GltfUse& use, const GltfPath& path) const {
    return read<float>(accessor, use, path);
}

Expected<GltfElements<uint32_t>> GltfAccessors::integers(int accessor, const GltfUse& use, const GltfPath& path) const {
    return read<uint32_t>(accessor, use, path);
}

}  // namespace glint::detail
