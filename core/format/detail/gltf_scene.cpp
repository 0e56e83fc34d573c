#include <glint/format/detail/gltf_scene.h>

#include <glm/common.hpp>

#include <algorithm>
#include <cstring>

namespace glint::detail {

namespace {

constexpr int scalar[] = {TINYGLTF_TYPE_SCALAR};
constexpr int vec3[] = {TINYGLTF_TYPE_VEC3};
constexpr int vec4[] = {TINYGLTF_TYPE_VEC4};
constexpr int mat4[] = {TINYGLTF_TYPE_MAT4};
constexpr int floats[] = {TINYGLTF_COMPONENT_TYPE_FLOAT};
constexpr int fractional[] = {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_COMPONENT_TYPE_BYTE,
                              TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, TINYGLTF_COMPONENT_TYPE_SHORT,
                              TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT};

Vector3f vector3(const std::vector<double>& values, const Vector3f& fallback) {
    return values.empty() ? fallback : Vector3f(Vector3d(values[0], values[1], values[2]));
}

std::vector<uint32_t> numbers(const std::vector<int>& values) { return {values.begin(), values.end()}; }

SceneWrap wrap(int code) {
    if (code == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return SceneWrap::Clamp;
    return code == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? SceneWrap::Mirror : SceneWrap::Repeat;
}

SceneTexture makeTexture(const tinygltf::Texture& source, const std::vector<tinygltf::Sampler>& samplers) {
    SceneTexture texture;
    texture.name = source.name;
    texture.image = gltfNumber(source.source);
    if (source.sampler < 0) return texture;
    const tinygltf::Sampler& sampler = samplers[static_cast<size_t>(source.sampler)];
    texture.wrap = {wrap(sampler.wrapS), wrap(sampler.wrapT)};
    if (sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST) texture.mag_filter = SceneFilter::Nearest;
    switch (sampler.minFilter) {
        case TINYGLTF_TEXTURE_FILTER_NEAREST: texture.mip_filter.reset(); [[fallthrough]];
        case TINYGLTF_TEXTURE_FILTER_NEAREST_MIPMAP_LINEAR: texture.min_filter = SceneFilter::Nearest; break;
        case TINYGLTF_TEXTURE_FILTER_LINEAR: texture.mip_filter.reset(); break;
        case TINYGLTF_TEXTURE_FILTER_NEAREST_MIPMAP_NEAREST: texture.min_filter = SceneFilter::Nearest; [[fallthrough]];
        case TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_NEAREST: texture.mip_filter = SceneFilter::Nearest; break;
        default: break;
    }
    return texture;
}

class SceneMaker {
public:
    SceneMaker(const tinygltf::Model& model, const GltfAccessors& accessors, GltfBudget& budget, const GltfPath& root)
        : model_(model), accessors_(accessors), budget_(budget), root_(root) {}

    Expected<Scene> make() {
        for (const auto step : {&SceneMaker::materials, &SceneMaker::meshes, &SceneMaker::skins, &SceneMaker::nodes,
                                &SceneMaker::roots, &SceneMaker::animations, &SceneMaker::cameras, &SceneMaker::lights})
            if (Status status = (this->*step)(); !status) return unexpected(status.error());
        scene_.textures.reserve(model_.textures.size());
        for (const tinygltf::Texture& each : model_.textures)
            scene_.textures.push_back(makeTexture(each, model_.samplers));
        return std::move(scene_);
    }

private:
    Status materials() {
        const GltfPath list = root_ / "materials";
        scene_.materials.reserve(model_.materials.size());
        for (size_t i = 0; i < model_.materials.size(); i++) {
            Expected<SceneMaterial> material = makeGltfMaterial(model_.materials[i], list / i);
            if (!material) return material.error();
            scene_.materials.push_back(std::move(*material));
        }
        return {};
    }

    Status meshes() {
        const GltfPath list = root_ / "meshes";
        scene_.meshes.reserve(model_.meshes.size());
        for (size_t i = 0; i < model_.meshes.size(); i++) {
            Expected<SceneMesh> mesh = makeGltfMesh(model_.meshes[i], accessors_, budget_, list / i);
            if (!mesh) return mesh.error();
            uint32_t count = 0;
            for (const ScenePrimitive& primitive : mesh->primitives)
                for (const auto& joints : primitive.joints)
                    for (const uint16_t joint : joints) count = std::max(count, uint32_t{joint} + 1);
            joint_counts_.push_back(count);
            scene_.meshes.push_back(std::move(*mesh));
        }
        return {};
    }

    Status skins() {
        const GltfPath list = root_ / "skins";
        scene_.skins.reserve(model_.skins.size());
        for (size_t i = 0; i < model_.skins.size(); i++) {
            const tinygltf::Skin& source = model_.skins[i];
            const GltfPath path = list / i;
            SceneSkin skin{.name = source.name, .joints = numbers(source.joints), .inverse_bind = {}};
            if (skin.joints.empty())
                return gltfError(path / "joints", ErrorCode::Io, "gltf.count", "there is no joint");
            if (Status status = budget_.take(path, skin.joints.size(), sizeof(Matrix4x4f)); !status) return status;
            skin.inverse_bind.assign(skin.joints.size(), Matrix4x4f(1.0f));
            if (source.inverseBindMatrices >= 0) {
                const GltfPath place = path / "inverseBindMatrices";
                const auto matrices = accessors_.floats(source.inverseBindMatrices, {mat4, floats}, place);
                if (!matrices) return matrices.error();
                if (matrices->count() < skin.joints.size())
                    return gltfError(place, ErrorCode::Io, "gltf.count", "{} matrices for {} joints", matrices->count(),
                                     skin.joints.size());
                std::memcpy(static_cast<void*>(skin.inverse_bind.data()), matrices->values.data(),
                            skin.joints.size() * sizeof(Matrix4x4f));
            }
            scene_.skins.push_back(std::move(skin));
        }
        return {};
    }

    Status nodes() {
        const GltfPath list = root_ / "nodes";
        scene_.nodes.reserve(model_.nodes.size());
        for (size_t i = 0; i < model_.nodes.size(); i++) {
            const tinygltf::Node& source = model_.nodes[i];
            const GltfPath path = list / i;
            SceneNode& node = scene_.nodes.emplace_back();
            node.name = source.name;
            node.children = numbers(source.children);
            node.transform.translation = vector3(source.translation, node.transform.translation);
            node.transform.scale = vector3(source.scale, node.transform.scale);
            if (!source.rotation.empty())
                for (int k = 0; k < 4; k++)
                    node.transform.rotation[k] = static_cast<float>(source.rotation[static_cast<size_t>(k)]);
            if (!source.matrix.empty()) {
                node.matrix.emplace(0.0f);
                for (int k = 0; k < 16; k++)
                    (*node.matrix)[k / 4][k % 4] = static_cast<float>(source.matrix[static_cast<size_t>(k)]);
            }
            node.mesh = gltfNumber(source.mesh);
            node.skin = gltfNumber(source.skin);
            node.camera = gltfNumber(source.camera);
            if (const auto found = source.extensions.find("KHR_lights_punctual"); found != source.extensions.end())
                node.light = static_cast<uint32_t>(found->second.Get("light").GetNumberAsInt());
            if (Status status = shape(node, source, path); !status) return status;
        }
        return {};
    }

    /// Morph weights and joints have to fit the mesh.
    Status shape(SceneNode& node, const tinygltf::Node& source, const GltfPath& path) {
        if (node.mesh == scene_none) {
            node.skin = scene_none;
            return {};
        }
        const size_t weights = scene_.meshes[node.mesh].weights.size();
        if (Status status = budget_.take(path, weights, sizeof(float)); !status) return status;
        if (!source.weights.empty() && source.weights.size() != weights)
            return gltfError(path / "weights", ErrorCode::Io, "gltf.count", "{} weights for {} morph targets",
                             source.weights.size(), weights);
        for (const double weight : source.weights) node.weights.push_back(static_cast<float>(weight));
        if (node.skin != scene_none && joint_counts_[node.mesh] > scene_.skins[node.skin].joints.size())
            return gltfError(path, ErrorCode::Io, "gltf.joint", "meshes[{}] names joint {} of skins[{}], which has {}",
                             node.mesh, joint_counts_[node.mesh] - 1, node.skin, scene_.skins[node.skin].joints.size());
        return {};
    }

    /// The nodes have to be a forest, and the scene shows roots of it.
    Status roots() {
        const GltfPath list = root_ / "nodes";
        std::vector<uint32_t> parents(scene_.nodes.size(), scene_none);
        for (uint32_t i = 0; i < scene_.nodes.size(); i++) {
            const GltfPath node = list / i;
            const GltfPath children = node / "children";
            for (size_t k = 0; k < scene_.nodes[i].children.size(); k++) {
                uint32_t& parent = parents[scene_.nodes[i].children[k]];
                if (parent != scene_none)
                    return gltfError(children / k, ErrorCode::Io, "gltf.two_parents",
                                     "nodes[{}] is a child of nodes[{}] already", scene_.nodes[i].children[k], parent);
                parent = i;
            }
        }
        // Each node has at most one parent, so what no walk from the parentless ones reaches lies on or below a cycle.
        std::vector<uint32_t> reached;
        for (uint32_t i = 0; i < parents.size(); i++)
            if (parents[i] == scene_none) reached.push_back(i);
        const std::vector<uint32_t> parentless = reached;
        std::vector<bool> is_reached(parents.size(), false);
        for (size_t i = 0; i < reached.size(); i++) {
            is_reached[reached[i]] = true;
            const std::vector<uint32_t>& children = scene_.nodes[reached[i]].children;
            reached.insert(reached.end(), children.begin(), children.end());
        }
        for (size_t i = 0; i < parents.size(); i++)
            if (!is_reached[i])
                return gltfError(list / i, ErrorCode::Io, "gltf.cycle", "the node is, or is below, its own descendant");

        if (model_.scenes.empty()) {
            scene_.roots = parentless;
            return {};
        }
        const auto chosen = static_cast<size_t>(std::max(model_.defaultScene, 0));
        const GltfPath scenes = root_ / "scenes";
        const GltfPath scene = scenes / chosen;
        const GltfPath shown = scene / "nodes";
        scene_.roots = numbers(model_.scenes[chosen].nodes);
        std::vector<bool> is_shown(parents.size(), false);
        for (size_t k = 0; k < scene_.roots.size(); k++) {
            const uint32_t node = scene_.roots[k];
            if (parents[node] != scene_none || is_shown[node])
                return gltfError(shown / k, ErrorCode::Io, "gltf.root", "nodes[{}] {}", node,
                                 is_shown[node] ? "stands there twice"
                                                : fmt::format("is no root, but a child of nodes[{}]", parents[node]));
            is_shown[node] = true;
        }
        return {};
    }

    Status animations() {
        const GltfPath list = root_ / "animations";
        scene_.animations.reserve(model_.animations.size());
        for (size_t i = 0; i < model_.animations.size(); i++) {
            const tinygltf::Animation& source = model_.animations[i];
            const GltfPath path = list / i;
            const GltfPath channels = path / "channels";
            SceneAnimation& animation = scene_.animations.emplace_back();
            animation.name = source.name;
            std::vector<std::pair<uint32_t, ScenePath>> moved;
            animation.channels.reserve(source.channels.size());
            for (size_t k = 0; k < source.channels.size(); k++) {
                const GltfPath place = channels / k;
                if (source.channels[k].target_path == "pointer") continue;  // of an extension, or of no node
                Expected<SceneChannel> channel = makeChannel(source, source.channels[k], place);
                if (!channel) return channel.error();
                moved.emplace_back(channel->node, channel->path);
                animation.channels.push_back(std::move(*channel));
            }
            std::sort(moved.begin(), moved.end());
            if (const auto twice = std::adjacent_find(moved.begin(), moved.end()); twice != moved.end())
                return gltfError(path, ErrorCode::Io, "gltf.channel", "two channels move one property of nodes[{}]",
                                 twice->first);
        }
        return {};
    }

    Expected<SceneChannel> makeChannel(const tinygltf::Animation& animation, const tinygltf::AnimationChannel& source,
                                       const GltfPath& path) {
        if (static_cast<size_t>(source.sampler) >= animation.samplers.size())
            return unexpected(gltfError(path / "sampler", ErrorCode::Io, "gltf.index",
                                        "{} names none of the {} samplers of the animation", source.sampler,
                                        animation.samplers.size()));
        const tinygltf::AnimationSampler& sampler = animation.samplers[static_cast<size_t>(source.sampler)];
        SceneChannel channel;
        channel.node = static_cast<uint32_t>(source.target_node);
        const SceneNode& node = scene_.nodes[channel.node];
        size_t width = 3;
        if (source.target_path == "rotation") {
            channel.path = ScenePath::Rotation;
            width = 4;
        } else if (source.target_path == "scale") {
            channel.path = ScenePath::Scale;
        } else if (source.target_path == "weights") {
            channel.path = ScenePath::Weights;
            width = node.mesh == scene_none ? 0 : scene_.meshes[node.mesh].weights.size();
        }
        if (width == 0 || (node.matrix && channel.path != ScenePath::Weights))
            return unexpected(gltfError(path, ErrorCode::Io, "gltf.channel", "nodes[{}] has {}", channel.node,
                                        width == 0 ? "no morph targets" : "a matrix, which cannot be animated"));
        if (sampler.interpolation == "STEP") channel.interpolation = SceneInterpolation::Step;
        if (sampler.interpolation == "CUBICSPLINE") channel.interpolation = SceneInterpolation::CubicSpline;

        const GltfPath keys = path / "sampler";
        const GltfPath input = keys / "input";
        Expected<GltfElements<float>> times = accessors_.floats(sampler.input, {scalar, floats}, input);
        if (!times) return unexpected(times.error());
        channel.times = std::move(times->values);
        for (size_t i = 0; i < channel.times.size(); i++)
            if (i == 0 ? channel.times[0] < 0.0f : !(channel.times[i] > channel.times[i - 1]))
                return unexpected(gltfError(input, ErrorCode::Io, "gltf.key_order", "key {} is at {} s, {}", i,
                                            channel.times[i], i == 0 ? "before 0" : "not later than the one before"));

        const GltfPath output = keys / "output";
        const bool is_rotation = channel.path == ScenePath::Rotation;
        const bool is_weights = channel.path == ScenePath::Weights;
        const GltfUse use = is_rotation  ? GltfUse{vec4, fractional, true}
                            : is_weights ? GltfUse{scalar, fractional, true}
                                         : GltfUse{vec3, floats};
        Expected<GltfElements<float>> values = accessors_.floats(sampler.output, use, output);
        if (!values) return unexpected(values.error());
        const size_t parts = channel.interpolation == SceneInterpolation::CubicSpline ? 3 : 1;
        if (values->values.size() / width / parts != channel.times.size() ||
            values->values.size() % (width * parts) != 0)
            return unexpected(gltfError(output, ErrorCode::Io, "gltf.count", "{} numbers for {} keys of {} each",
                                        values->values.size(), channel.times.size(), width * parts));
        channel.values = std::move(values->values);
        return channel;
    }

    Status cameras() {
        const GltfPath list = root_ / "cameras";
        scene_.cameras.reserve(model_.cameras.size());
        for (size_t i = 0; i < model_.cameras.size(); i++) {
            const tinygltf::Camera& source = model_.cameras[i];
            SceneCamera& camera = scene_.cameras.emplace_back();
            camera.name = source.name;
            camera.is_perspective = source.type == "perspective";
            if (camera.is_perspective) {
                camera.fov = static_cast<float>(source.perspective.yfov);
                camera.aspect = static_cast<float>(source.perspective.aspectRatio);
                camera.near = static_cast<float>(source.perspective.znear);
                camera.far = static_cast<float>(source.perspective.zfar);
            } else {
                camera.half_size = Vector2f(glm::abs(Vector2d(source.orthographic.xmag, source.orthographic.ymag)));
                camera.near = static_cast<float>(source.orthographic.znear);
                camera.far = static_cast<float>(source.orthographic.zfar);
            }
            if (camera.half_size.x == 0.0f || camera.half_size.y == 0.0f)
                return gltfError(list / i, ErrorCode::Io, "gltf.value", "half of the view is {} by {} wide",
                                 camera.half_size.x, camera.half_size.y);
            if (camera.far != 0.0f && camera.far <= camera.near)
                return gltfError(list / i, ErrorCode::Io, "gltf.value",
                                 "the far plane at {} is not beyond the near one at {}", camera.far, camera.near);
        }
        return {};
    }

    Status lights() {
        const GltfPath extensions = root_ / "extensions";
        const GltfPath punctual = extensions / "KHR_lights_punctual";
        const GltfPath list = punctual / "lights";
        scene_.lights.reserve(model_.lights.size());
        for (size_t i = 0; i < model_.lights.size(); i++) {
            const tinygltf::Light& source = model_.lights[i];
            SceneLight& light = scene_.lights.emplace_back();
            light.name = source.name;
            if (source.type == "directional") light.type = SceneLightType::Directional;
            if (source.type == "spot") light.type = SceneLightType::Spot;
            light.color = vector3(source.color, light.color);
            light.intensity = static_cast<float>(source.intensity);
            light.range = static_cast<float>(source.range);
            light.inner_angle = static_cast<float>(source.spot.innerConeAngle);
            light.outer_angle = static_cast<float>(source.spot.outerConeAngle);
            if (light.inner_angle >= light.outer_angle)
                return gltfError(list / i, ErrorCode::Io, "gltf.value",
                                 "the inner angle {} is not less than the outer {}", light.inner_angle,
                                 light.outer_angle);
        }
        return {};
    }

    const tinygltf::Model& model_;
    const GltfAccessors& accessors_;
    GltfBudget& budget_;
    const GltfPath& root_;
    Scene scene_;
    std::vector<uint32_t> joint_counts_;  // for each mesh: the greatest joint that has a weight, and 1
};

}  // namespace

Expected<Scene> makeGltfScene(const tinygltf::Model& model, const GltfAccessors& accessors, GltfBudget& budget,
                              const GltfPath& root) {
    return SceneMaker(model, accessors, budget, root).make();
}

}  // namespace glint::detail
