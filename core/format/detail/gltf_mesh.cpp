#include <glint/format/detail/gltf_scene.h>

#include <glint/base/log.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cstring>

namespace glint::detail {

namespace {

constexpr int scalar[] = {TINYGLTF_TYPE_SCALAR};
constexpr int vec2[] = {TINYGLTF_TYPE_VEC2};
constexpr int vec3[] = {TINYGLTF_TYPE_VEC3};
constexpr int vec4[] = {TINYGLTF_TYPE_VEC4};
constexpr int vec3_or_vec4[] = {TINYGLTF_TYPE_VEC3, TINYGLTF_TYPE_VEC4};
// What KHR_mesh_quantization allows, whether the document names it or not.
constexpr int geometric[] = {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_COMPONENT_TYPE_BYTE,
                             TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, TINYGLTF_COMPONENT_TYPE_SHORT,
                             TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT};
constexpr int fractional[] = {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE,
                              TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT};
constexpr int small_integers[] = {TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT};
constexpr int integers[] = {TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT,
                            TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT};

template <class Vector>
std::vector<Vector> vectors(const std::vector<float>& values) {
    std::vector<Vector> result(values.size() * sizeof(float) / sizeof(Vector));
    if (!result.empty()) std::memcpy(result.data(), values.data(), values.size() * sizeof(float));
    return result;
}

/// Of unit length, by float64, where no square of a float32 overflows or underflows.
Vector3f unit(const Vector3f& vector, const Vector3f& fallback) {
    const Vector3d wide(vector);
    const double length = glm::length(wide);
    return length > 0.0 ? Vector3f(wide / length) : fallback;
}

class PrimitiveMaker {
public:
    PrimitiveMaker(const tinygltf::Primitive& source, const GltfAccessors& accessors, GltfBudget& budget,
                   const GltfPath& path)
        : source_(source), accessors_(accessors), budget_(budget), path_(path) {}

    Status make(ScenePrimitive& primitive) {
        primitive.material = gltfNumber(source_.material);
        const GltfPath place = path_ / "attributes";
        if (Status status = attribute("POSITION", {vec3, geometric}, place, primitive.positions); !status)
            return status;
        count_ = primitive.positions.size();
        if (Status status = attribute("NORMAL", {vec3, geometric}, place, primitive.normals); !status) return status;
        if (Status status = attribute("TANGENT", {vec4, geometric}, place, primitive.tangents); !status) return status;
        if (Status status = attribute("TEXCOORD_0", {vec2, geometric}, place, primitive.texcoords[0]); !status)
            return status;
        if (Status status = attribute("TEXCOORD_1", {vec2, geometric}, place, primitive.texcoords[1]); !status)
            return status;
        if (Status status = colors(primitive, place); !status) return status;
        if (Status status = influences(primitive, place); !status) return status;
        for (Vector3f& normal : primitive.normals) normal = unit(normal, {0, 0, 1});
        for (Vector4f& tangent : primitive.tangents)
            tangent = Vector4f(unit(Vector3f(tangent), {1, 0, 0}), tangent.w < 0.0f ? -1.0f : 1.0f);
        if (Status status = targets(primitive); !status) return status;
        return indices(primitive);
    }

private:
    static int find(const std::map<std::string, int>& names, const char* name) {
        const auto found = names.find(name);
        return found == names.end() ? -1 : found->second;
    }

    Status sameCount(size_t count, const GltfPath& path) const {
        if (count_ == 0 || count == count_) return {};
        return gltfError(path, ErrorCode::Io, "gltf.count", "{} elements for the {} of POSITION", count, count_);
    }

    /// Leaves `result` empty where the attribute is absent.
    template <class Vector>
    Status attribute(const char* name, const GltfUse& use, const GltfPath& path, std::vector<Vector>& result) {
        return attribute(source_.attributes, name, use, path, result);
    }

    template <class Vector>
    Status attribute(const std::map<std::string, int>& names, const char* name, const GltfUse& use,
                     const GltfPath& path, std::vector<Vector>& result) {
        const int accessor = find(names, name);
        if (accessor < 0) return {};
        const GltfPath place = path / name;
        const Expected<GltfElements<float>> elements = accessors_.floats(accessor, use, place);
        if (!elements) return elements.error();
        result = vectors<Vector>(elements->values);
        return sameCount(result.size(), place);
    }

    Status colors(ScenePrimitive& primitive, const GltfPath& path) {
        const int accessor = find(source_.attributes, "COLOR_0");
        if (accessor < 0) return {};
        const GltfPath place = path / "COLOR_0";
        const Expected<GltfElements<float>> elements =
            accessors_.floats(accessor, {vec3_or_vec4, fractional, true}, place);
        if (!elements) return elements.error();
        if (Status status = sameCount(elements->count(), place); !status) return status;
        const size_t added = 4 - elements->components;  // alpha, if it is absent
        if (Status status = budget_.take(place, elements->count(), added * sizeof(float)); !status) return status;
        primitive.colors.reserve(elements->count());
        for (size_t i = 0; i < elements->count(); i++) {
            const float* color = &elements->values[i * elements->components];
            primitive.colors.emplace_back(color[0], color[1], color[2], elements->components == 4 ? color[3] : 1.0f);
        }
        return {};
    }

    Status influences(ScenePrimitive& primitive, const GltfPath& path) {
        const int joints = find(source_.attributes, "JOINTS_0");
        const int weights = find(source_.attributes, "WEIGHTS_0");
        if ((joints < 0) != (weights < 0))
            return gltfError(path, ErrorCode::Io, "gltf.missing", "JOINTS_0 and WEIGHTS_0 need each other");
        if (joints < 0) return {};
        const GltfPath place = path / "JOINTS_0";
        const Expected<GltfElements<uint32_t>> numbers = accessors_.integers(joints, {vec4, small_integers}, place);
        if (!numbers) return numbers.error();
        if (Status status = sameCount(numbers->count(), place); !status) return status;
        if (Status status = attribute("WEIGHTS_0", {vec4, fractional, true}, path, primitive.weights); !status)
            return status;
        primitive.joints.resize(count_);
        for (size_t i = 0; i < count_; i++) {
            Vector4f& weight = primitive.weights[i];
            double sum = 0.0;
            for (int k = 0; k < 4; k++) {
                if (weight[k] < 0.0f)
                    return gltfError(path / "WEIGHTS_0", ErrorCode::Io, "gltf.value",
                                     "weight {} of vertex {} is {}, less than 0", k, i, weight[k]);
                sum += weight[k];
            }
            weight = sum > 0.0 ? Vector4f(Vector4d(weight) / sum) : Vector4f(1, 0, 0, 0);
            // Joints without a weight may be any number.
            for (size_t k = 0; k < 4; k++)
                if (weight[static_cast<int>(k)] > 0.0f)
                    primitive.joints[i][k] = static_cast<uint16_t>(numbers->values[4 * i + k]);
        }
        return {};
    }

    Status targets(ScenePrimitive& primitive) {
        const GltfPath list = path_ / "targets";
        for (size_t i = 0; i < source_.targets.size(); i++) {
            SceneMorphTarget& target = primitive.targets.emplace_back();
            const std::map<std::string, int>& names = source_.targets[i];
            const GltfPath place = list / i;
            if (Status status = attribute(names, "POSITION", {vec3, geometric}, place, target.positions); !status)
                return status;
            if (Status status = attribute(names, "NORMAL", {vec3, geometric}, place, target.normals); !status)
                return status;
            if (Status status = attribute(names, "TANGENT", {vec3, geometric}, place, target.tangents); !status)
                return status;
        }
        return {};
    }

    Status indices(ScenePrimitive& primitive) {
        const GltfPath place = path_ / "indices";
        std::vector<uint32_t> corners;
        if (source_.indices >= 0) {
            Expected<GltfElements<uint32_t>> elements = accessors_.integers(source_.indices, {scalar, integers}, place);
            if (!elements) return elements.error();
            corners = std::move(elements->values);
            for (size_t i = 0; i < corners.size(); i++)
                if (corners[i] >= count_)
                    return gltfError(place, ErrorCode::Io, "gltf.vertex_index", "index {} is {}, there are {} vertices",
                                     i, corners[i], count_);
        } else {
            if (Status status = budget_.take(path_, count_, sizeof(uint32_t)); !status) return status;
            if (count_ > UINT32_MAX)
                return gltfError(path_, ErrorCode::OutOfRange, "gltf.too_large", "{} vertices are too many", count_);
            corners.resize(count_);
            for (size_t i = 0; i < count_; i++) corners[i] = static_cast<uint32_t>(i);
        }
        const bool is_list = source_.mode == TINYGLTF_MODE_TRIANGLES;
        if (corners.size() < 3 || (is_list && corners.size() % 3 != 0))
            return gltfError(path_, ErrorCode::Io, "gltf.count", "{} corners make no {}", corners.size(),
                             is_list ? "whole triangles" : "strip or fan");
        if (is_list) {
            primitive.indices = std::move(corners);
            return {};
        }
        // glTF 2.0, section 3.7.2.1: which corners, and which way round.
        if (Status status = budget_.take(path_, corners.size() - 2, 3 * sizeof(uint32_t)); !status) return status;
        primitive.indices.reserve(3 * (corners.size() - 2));
        for (size_t i = 0; i + 2 < corners.size(); i++) {
            if (source_.mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
                const size_t odd = i % 2;
                primitive.indices.insert(primitive.indices.end(),
                                         {corners[i], corners[i + 1 + odd], corners[i + 2 - odd]});
            } else {
                primitive.indices.insert(primitive.indices.end(), {corners[i + 1], corners[i + 2], corners[0]});
            }
        }
        return {};
    }

    const tinygltf::Primitive& source_;
    const GltfAccessors& accessors_;
    GltfBudget& budget_;
    const GltfPath& path_;
    size_t count_ = 0;  // of vertices; 0 until the positions are known
};

void warn(const char* id, const GltfPath& path, std::string_view text) {
    log(LogLevel::Warning, id, fmt::format("{}: {}: {}", path.document(), path.text(), text));
}

bool isRead(std::string_view attribute) {
    constexpr std::string_view read[] = {"POSITION",   "NORMAL",  "TANGENT",  "TEXCOORD_0",
                                         "TEXCOORD_1", "COLOR_0", "JOINTS_0", "WEIGHTS_0"};
    return std::find(std::begin(read), std::end(read), attribute) != std::end(read);
}

}  // namespace

Expected<SceneMesh> makeGltfMesh(const tinygltf::Mesh& source, const GltfAccessors& accessors, GltfBudget& budget,
                                 const GltfPath& path) {
    SceneMesh mesh;
    mesh.name = source.name;
    const GltfPath list = path / "primitives";
    mesh.primitives.reserve(source.primitives.size());
    const size_t target_count = source.primitives.empty() ? 0 : source.primitives[0].targets.size();
    for (size_t i = 0; i < source.primitives.size(); i++) {
        const tinygltf::Primitive& each = source.primitives[i];
        const GltfPath place = list / i;
        if (each.targets.size() != target_count)
            return unexpected(gltfError(place, ErrorCode::Io, "gltf.count",
                                        "{} morph targets, where the mesh's first primitive has {}",
                                        each.targets.size(), target_count));
        if (each.mode < TINYGLTF_MODE_TRIANGLES || !each.attributes.contains("POSITION")) {
            warn("gltf.primitive_dropped", place,
                 each.mode < TINYGLTF_MODE_TRIANGLES ? "points and lines are left out" : "there are no positions");
            continue;
        }
        for (const auto& [name, accessor] : each.attributes)
            if (!isRead(name) && !name.starts_with('_'))
                warn("gltf.attribute_dropped", place, fmt::format("'{}' is left out", name.substr(0, 60)));
        ScenePrimitive primitive;
        if (Status status = budget.take(place, 1 + target_count, sizeof(ScenePrimitive)); !status)
            return unexpected(status.error());
        if (Status status = PrimitiveMaker(each, accessors, budget, place).make(primitive); !status)
            return unexpected(status.error());
        mesh.primitives.push_back(std::move(primitive));
    }
    if (!source.weights.empty() && source.weights.size() != target_count)
        return unexpected(gltfError(path / "weights", ErrorCode::Io, "gltf.count", "{} weights for {} morph targets",
                                    source.weights.size(), target_count));
    mesh.weights.assign(target_count, 0.0f);
    for (size_t i = 0; i < source.weights.size(); i++) mesh.weights[i] = static_cast<float>(source.weights[i]);
    return mesh;
}

}  // namespace glint::detail
