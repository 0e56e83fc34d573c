#include <glint/format/scene.h>

#include <glint/base/format_error.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace glint {

namespace {

constexpr double weight_tolerance = 0x1p-16;

/// An error of one element; `place` names it, such as "meshes[1].primitives[0]".
template <class... Args>
Error wrong(ErrorCode code, const char* id, const std::string& place, fmt::format_string<Args...> format,
            Args&&... args) {
    return makeError(code, id, "{}: {}", place, fmt::format(format, std::forward<Args>(args)...));
}

bool isFiniteVector(const Vector2f& v) { return std::isfinite(v.x) && std::isfinite(v.y); }
bool isFiniteVector(const Vector3f& v) { return isFinite(v); }
bool isFiniteVector(const Vector4f& v) { return isFinite(Vector3f(v)) && std::isfinite(v.w); }
bool isFiniteMatrix(const Matrix4x4f& m) {
    return isFiniteVector(m[0]) && isFiniteVector(m[1]) && isFiniteVector(m[2]) && isFiniteVector(m[3]);
}

/// One array of a primitive or of a target: empty, or a finite vector for each vertex.
template <class T>
Error checkArray(const std::string& place, const char* name, const std::vector<T>& values, size_t vertices) {
    if (!values.empty() && values.size() != vertices)
        return wrong(ErrorCode::InvalidArgument, "scene.attribute_count", place, "{} {} for {} vertices", values.size(),
                     name, vertices);
    for (size_t i = 0; i < values.size(); i++)
        if (!isFiniteVector(values[i]))
            return wrong(ErrorCode::InvalidArgument, "scene.not_finite", place, "{} of vertex {}: NaN or infinity",
                         name, i);
    return {};
}

Error checkWeights(const std::string& place, const std::vector<Vector4f>& weights) {
    for (size_t i = 0; i < weights.size(); i++) {
        double sum = 0.0;
        for (int k = 0; k < 4; k++) {
            if (weights[i][k] < 0.0f)
                return wrong(ErrorCode::OutOfRange, "scene.weights", place, "weight {} of vertex {} is {}, less than 0",
                             k, i, weights[i][k]);
            sum += weights[i][k];
        }
        if (std::fabs(sum - 1.0) > weight_tolerance)
            return wrong(ErrorCode::OutOfRange, "scene.weights", place,
                         "the weights of vertex {} add up to {}; 1 to within {}", i, sum, weight_tolerance);
    }
    return {};
}

Error checkPrimitive(const std::string& place, const ScenePrimitive& primitive) {
    const size_t vertices = primitive.positions.size();
    if (vertices == 0 || vertices > UINT32_MAX)
        return wrong(ErrorCode::InvalidArgument, "scene.attribute_count", place, "{} vertices; 1 to {}", vertices,
                     UINT32_MAX);
    if (Error error = checkArray(place, "positions", primitive.positions, vertices)) return error;
    if (Error error = checkArray(place, "normals", primitive.normals, vertices)) return error;
    if (Error error = checkArray(place, "tangents", primitive.tangents, vertices)) return error;
    for (const auto& texcoords : primitive.texcoords)
        if (Error error = checkArray(place, "texture coordinates", texcoords, vertices)) return error;
    if (Error error = checkArray(place, "colors", primitive.colors, vertices)) return error;
    if (Error error = checkArray(place, "weights", primitive.weights, vertices)) return error;
    if (primitive.joints.size() != primitive.weights.size())
        return wrong(ErrorCode::InvalidArgument, "scene.attribute_count", place, "{} joints for {} weights",
                     primitive.joints.size(), primitive.weights.size());
    if (Error error = checkWeights(place, primitive.weights)) return error;
    for (const SceneMorphTarget& target : primitive.targets) {
        if (Error error = checkArray(place, "morphed positions", target.positions, vertices)) return error;
        if (Error error = checkArray(place, "morphed normals", target.normals, vertices)) return error;
        if (Error error = checkArray(place, "morphed tangents", target.tangents, vertices)) return error;
    }
    if (primitive.indices.size() % 3 != 0)
        return wrong(ErrorCode::InvalidArgument, "scene.attribute_count", place,
                     "{} indices are no whole number of triangles", primitive.indices.size());
    for (size_t i = 0; i < primitive.indices.size(); i++)
        if (primitive.indices[i] >= vertices)
            return wrong(ErrorCode::OutOfRange, "scene.vertex_index", place, "index {} is {}, there are {} vertices", i,
                         primitive.indices[i], vertices);
    return {};
}

class SceneChecker {
public:
    explicit SceneChecker(const Scene& scene) : scene_(scene) {}

    Error check() {
        for (const auto step : {&SceneChecker::meshes, &SceneChecker::materials, &SceneChecker::skins,
                                &SceneChecker::nodes, &SceneChecker::tree, &SceneChecker::animations})
            if (Error error = (this->*step)()) return error;
        return {};
    }

private:
    /// `number` has to be below `count`; `is_optional`: or scene_none.
    static Error inRange(const std::string& place, const char* what, uint32_t number, size_t count,
                         bool is_optional = true) {
        if (number < count || (is_optional && number == scene_none)) return {};
        return wrong(ErrorCode::OutOfRange, "scene.index_range", place, "{} {} of {}", what, number, count);
    }

    Error meshes() {
        joint_counts_.assign(scene_.meshes.size(), 0);
        for (size_t i = 0; i < scene_.meshes.size(); i++) {
            const SceneMesh& mesh = scene_.meshes[i];
            for (size_t k = 0; k < mesh.primitives.size(); k++) {
                const ScenePrimitive& primitive = mesh.primitives[k];
                const std::string place = fmt::format("meshes[{}].primitives[{}]", i, k);
                if (Error error = checkPrimitive(place, primitive)) return error;
                if (Error error = inRange(place, "material", primitive.material, scene_.materials.size())) return error;
                if (primitive.targets.size() != mesh.weights.size())
                    return wrong(ErrorCode::InvalidArgument, "scene.attribute_count", place,
                                 "{} morph targets for {} weights of the mesh", primitive.targets.size(),
                                 mesh.weights.size());
                for (const auto& joints : primitive.joints)
                    joint_counts_[i] =
                        std::max<size_t>(joint_counts_[i], 1u + *std::max_element(joints.begin(), joints.end()));
            }
        }
        return {};
    }

    Error materials() {
        for (size_t i = 0; i < scene_.materials.size(); i++) {
            const SceneMaterial& material = scene_.materials[i];
            const std::string place = fmt::format("materials[{}]", i);
            for (const SceneTextureUse* use :
                 {&material.base_color_texture, &material.metallic_roughness_texture, &material.normal_texture,
                  &material.occlusion_texture, &material.emission_texture, &material.transmission_texture}) {
                if (Error error = inRange(place, "texture", use->texture, scene_.textures.size())) return error;
                if (Error error = inRange(place, "texture coordinates", use->texcoord, 2, false)) return error;
            }
        }
        for (size_t i = 0; i < scene_.textures.size(); i++)
            if (Error error =
                    inRange(fmt::format("textures[{}]", i), "image", scene_.textures[i].image, scene_.images.size()))
                return error;
        return {};
    }

    Error skins() {
        for (size_t i = 0; i < scene_.skins.size(); i++) {
            const SceneSkin& skin = scene_.skins[i];
            const std::string place = fmt::format("skins[{}]", i);
            if (skin.inverse_bind.size() != skin.joints.size())
                return wrong(ErrorCode::InvalidArgument, "scene.attribute_count", place,
                             "{} inverse bind matrices for {} joints", skin.inverse_bind.size(), skin.joints.size());
            for (size_t k = 0; k < skin.joints.size(); k++) {
                if (Error error = inRange(place, "joint's node", skin.joints[k], scene_.nodes.size(), false))
                    return error;
                if (!isFiniteMatrix(skin.inverse_bind[k]))
                    return wrong(ErrorCode::InvalidArgument, "scene.not_finite", place,
                                 "inverse bind matrix {}: NaN or infinity", k);
            }
        }
        return {};
    }

    Error nodes() {
        for (size_t i = 0; i < scene_.nodes.size(); i++) {
            const SceneNode& node = scene_.nodes[i];
            const std::string place = fmt::format("nodes[{}]", i);
            if (Error error = inRange(place, "mesh", node.mesh, scene_.meshes.size())) return error;
            if (Error error = inRange(place, "skin", node.skin, scene_.skins.size())) return error;
            if (Error error = inRange(place, "camera", node.camera, scene_.cameras.size())) return error;
            if (Error error = inRange(place, "light", node.light, scene_.lights.size())) return error;
            for (const uint32_t child : node.children)
                if (Error error = inRange(place, "child", child, scene_.nodes.size(), false)) return error;
            const SceneTransform& transform = node.transform;
            if (!isFinite(transform.translation) || !isFiniteVector(transform.rotation) || !isFinite(transform.scale) ||
                (node.matrix && !isFiniteMatrix(*node.matrix)))
                return wrong(ErrorCode::InvalidArgument, "scene.not_finite", place, "transform: NaN or infinity");
            if (node.mesh == scene_none) continue;
            const size_t weights = scene_.meshes[node.mesh].weights.size();
            if (!node.weights.empty() && node.weights.size() != weights)
                return wrong(ErrorCode::InvalidArgument, "scene.attribute_count", place,
                             "{} weights for {} morph targets", node.weights.size(), weights);
            if (node.skin != scene_none && joint_counts_[node.mesh] > scene_.skins[node.skin].joints.size())
                return wrong(ErrorCode::OutOfRange, "scene.joint_range", place,
                             "meshes[{}] names joint {} of skins[{}], which has {}", node.mesh,
                             joint_counts_[node.mesh] - 1, node.skin, scene_.skins[node.skin].joints.size());
        }
        return {};
    }

    /// Each node has one parent at most, so what is not reached from those without any lies on or below a cycle.
    Error tree() {
        std::vector<uint32_t> parents(scene_.nodes.size(), scene_none);
        for (uint32_t i = 0; i < scene_.nodes.size(); i++)
            for (const uint32_t child : scene_.nodes[i].children) {
                if (parents[child] != scene_none)
                    return wrong(ErrorCode::InvalidArgument, "scene.tree", fmt::format("nodes[{}]", i),
                                 "child {} is one of nodes[{}] already", child, parents[child]);
                parents[child] = i;
            }
        std::vector<uint32_t> reached;
        for (uint32_t i = 0; i < parents.size(); i++)
            if (parents[i] == scene_none) reached.push_back(i);
        for (size_t i = 0; i < reached.size(); i++) {
            const std::vector<uint32_t>& children = scene_.nodes[reached[i]].children;
            reached.insert(reached.end(), children.begin(), children.end());
        }
        if (reached.size() != parents.size())
            return makeError(ErrorCode::InvalidArgument, "scene.tree",
                             "{} of {} nodes are, or are below, their own descendants", parents.size() - reached.size(),
                             parents.size());
        std::vector<bool> is_root(scene_.nodes.size(), false);
        for (const uint32_t root : scene_.roots) {
            if (Error error = inRange("roots", "node", root, scene_.nodes.size(), false)) return error;
            if (parents[root] != scene_none || is_root[root])
                return wrong(ErrorCode::InvalidArgument, "scene.tree", "roots", "nodes[{}] {}", root,
                             is_root[root] ? "stands there twice" : "has a parent");
            is_root[root] = true;
        }
        return {};
    }

    Error animations() {
        for (size_t i = 0; i < scene_.animations.size(); i++) {
            std::vector<std::pair<uint32_t, ScenePath>> moved;
            const std::vector<SceneChannel>& channels = scene_.animations[i].channels;
            for (size_t k = 0; k < channels.size(); k++) {
                if (Error error = checkChannel(fmt::format("animations[{}].channels[{}]", i, k), channels[k]))
                    return error;
                moved.emplace_back(channels[k].node, channels[k].path);
            }
            std::sort(moved.begin(), moved.end());
            if (const auto twice = std::adjacent_find(moved.begin(), moved.end()); twice != moved.end())
                return wrong(ErrorCode::InvalidArgument, "scene.channel", fmt::format("animations[{}]", i),
                             "two channels move one property of nodes[{}]", twice->first);
        }
        return {};
    }

    Error checkChannel(const std::string& place, const SceneChannel& channel) {
        if (Error error = inRange(place, "node", channel.node, scene_.nodes.size(), false)) return error;
        const SceneNode& node = scene_.nodes[channel.node];
        const bool is_weights = channel.path == ScenePath::Weights;
        size_t width = channel.path == ScenePath::Rotation ? 4 : 3;
        if (is_weights) width = node.mesh == scene_none ? 0 : scene_.meshes[node.mesh].weights.size();
        if (width == 0 || (node.matrix && !is_weights))
            return wrong(ErrorCode::InvalidArgument, "scene.channel", place, "nodes[{}] has {}", channel.node,
                         width == 0 ? "no morph targets" : "a matrix, which cannot be animated");
        if (channel.times.empty()) return wrong(ErrorCode::InvalidArgument, "scene.key_order", place, "no keys");
        for (size_t k = 0; k < channel.times.size(); k++) {
            if (!std::isfinite(channel.times[k]))
                return wrong(ErrorCode::InvalidArgument, "scene.not_finite", place, "key {} is at {} s", k,
                             channel.times[k]);
            if (k > 0 && channel.times[k] <= channel.times[k - 1])
                return wrong(ErrorCode::InvalidArgument, "scene.key_order", place,
                             "key {} is at {} s, not later than the one before at {} s", k, channel.times[k],
                             channel.times[k - 1]);
        }
        const size_t parts = channel.interpolation == SceneInterpolation::CubicSpline ? 3 : 1;
        if (channel.values.size() / width / parts != channel.times.size() ||
            channel.values.size() % (width * parts) != 0)
            return wrong(ErrorCode::InvalidArgument, "scene.attribute_count", place, "{} numbers for {} keys of {}",
                         channel.values.size(), channel.times.size(), width * parts);
        for (size_t k = 0; k < channel.values.size(); k++)
            if (!std::isfinite(channel.values[k]))
                return wrong(ErrorCode::InvalidArgument, "scene.not_finite", place, "value {} of key {} is {}",
                             k % (width * parts), k / (width * parts), channel.values[k]);
        return {};
    }

    const Scene& scene_;
    std::vector<size_t> joint_counts_;  ///< of each mesh: one more than the largest joint that is named
};

}  // namespace

Status ScenePrimitive::validate() const { return checkPrimitive("primitive", *this); }

Status Scene::validate() const { return SceneChecker(*this).check(); }

}  // namespace glint
