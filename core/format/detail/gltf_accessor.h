#pragma once

#include <glint/base/expected.h>
#include <glint/format/detail/gltf_document.h>

#include <tiny_gltf.h>

#include <cstddef>
#include <span>
#include <vector>

namespace glint::detail {

/// What an accessor has to be for its use.
struct GltfUse {
    std::span<const int> types;       ///< TINYGLTF_TYPE_*: those that are allowed
    std::span<const int> components;  ///< TINYGLTF_COMPONENT_TYPE_*
    bool fractions_only = false;      ///< integers have to be normalised
};

/// Elements read from an accessor, one after the other.
template <class T>
struct GltfElements {
    size_t components = 0;  ///< of each element
    std::vector<T> values;
    size_t count() const { return components == 0 ? 0 : values.size() / components; }
};

/// Reads accessors. Everything is checked before it is used: views against their buffers, elements against their views,
/// alignment, strides, sparse indices, types; floats are finite. `path` is where the accessor is named. Errors:
/// "gltf.view_range", "gltf.accessor_range", "gltf.accessor_type", "gltf.alignment", "gltf.stride", "gltf.sparse",
/// "gltf.not_finite", "gltf.too_large".
class GltfAccessors {
public:
    /// The document has passed checkGltf(); a buffer has at least the bytes that the document says.
    GltfAccessors(const tinygltf::Model& model, std::span<const std::span<const std::byte>> buffers, GltfBudget& budget)
        : model_(model), buffers_(buffers), budget_(budget) {}

    /// Of a view, checked.
    Expected<std::span<const std::byte>> view(int view, const GltfPath& path) const;

    /// Integers become fractions if the accessor says so, as the specification defines: c / 255, max(c / 127, -1), ...
    Expected<GltfElements<float>> floats(int accessor, const GltfUse& use, const GltfPath& path) const;
    Expected<GltfElements<uint32_t>> integers(int accessor, const GltfUse& use, const GltfPath& path) const;

private:
    /// Elements in a view, not yet converted.
    struct Source {
        const std::byte* first = nullptr;  ///< null: zeros
        size_t stride = 0;
        const std::byte* at(size_t element) const { return first + element * stride; }
    };
    Expected<Source> source(int view, uint64_t offset, uint64_t count, size_t component_size, size_t element_size,
                            bool has_stride, const GltfPath& path) const;
    template <class T>
    Expected<GltfElements<T>> read(int accessor, const GltfUse& use, const GltfPath& path) const;

    const tinygltf::Model& model_;
    std::span<const std::span<const std::byte>> buffers_;
    GltfBudget& budget_;
};

}  // namespace glint::detail
