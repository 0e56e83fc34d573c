#include <glint/format/scene.h>

#include <glint/base/format_error.h>
#include <glint/base/log.h>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>

namespace glint {

namespace {

/// The given nodes and all below them, parents first. Each node comes once, whatever the children say.
std::vector<uint32_t> walk(const std::vector<SceneNode>& nodes, const std::vector<uint32_t>& roots) {
    std::vector<uint32_t> order;
    std::vector<bool> is_seen(nodes.size(), false);
    std::vector<uint32_t> open(roots.rbegin(), roots.rend());
    while (!open.empty()) {
        const uint32_t node = open.back();
        open.pop_back();
        if (is_seen[node]) continue;
        is_seen[node] = true;
        order.push_back(node);
        const std::vector<uint32_t>& children = nodes[node].children;
        open.insert(open.end(), children.rbegin(), children.rend());
    }
    return order;
}

std::vector<uint32_t> parentless(const std::vector<SceneNode>& nodes) {
    std::vector<bool> is_child(nodes.size(), false);
    for (const SceneNode& node : nodes)
        for (const uint32_t child : node.children) is_child[child] = true;
    std::vector<uint32_t> result;
    for (uint32_t i = 0; i < nodes.size(); i++)
        if (!is_child[i]) result.push_back(i);
    return result;
}

Vector4f unit(const Vector4f& q) {
    // In float64, where no square of a float32 overflows or underflows.
    const glm::dvec4 wide(q);
    const double length = std::sqrt(glm::dot(wide, wide));
    return length > 0.0 && std::isfinite(length) ? Vector4f(wide / length) : Vector4f(0, 0, 0, 1);
}

/// Along the shorter arc. The angle comes from the chord and its complement, which are exact to a few ulp whether the
/// keys are close, opposite or a half turn apart, where an arc cosine loses half of its digits.
Vector4f slerp(const Vector4f& from, const Vector4f& to, float t) {
    const Vector4f a = unit(from);
    Vector4f b = unit(to);
    if (glm::dot(a, b) < 0.0f) b = -b;
    const float angle = 2.0f * std::atan2(glm::length(a - b), glm::length(a + b));
    const float sine = std::sin(angle);
    if (!(sine > 0.0f)) return a;
    return unit(a * (std::sin((1.0f - t) * angle) / sine) + b * (std::sin(t * angle) / sine));
}

/// Writes `width` values of a channel at a time.
void sample(const SceneChannel& channel, float time, size_t width, float* out) {
    const bool is_spline = channel.interpolation == SceneInterpolation::CubicSpline;
    const auto at = [&](size_t key, size_t part) {
        return channel.values.data() + (is_spline ? 3 * key + part : key) * width;
    };
    constexpr size_t in_tangent = 0, value = 1, out_tangent = 2;

    // The first key that is later; a NaN is earlier than every key.
    const auto later = std::upper_bound(channel.times.begin(), channel.times.end(), time,
                                        [](float t, float key) { return !(t >= key); });
    const auto next = static_cast<size_t>(later - channel.times.begin());
    const size_t key = next == 0 ? 0 : next - 1;
    if (next == 0 || next == channel.times.size() || channel.interpolation == SceneInterpolation::Step) {
        std::copy_n(at(key, value), width, out);
        return;
    }
    const float step = channel.times[next] - channel.times[key];
    const float t = (time - channel.times[key]) / step;
    const float* a = at(key, value);
    const float* b = at(next, value);
    if (!is_spline) {
        if (channel.path == ScenePath::Rotation) {
            const Vector4f q = slerp({a[0], a[1], a[2], a[3]}, {b[0], b[1], b[2], b[3]}, t);
            for (int i = 0; i < 4; i++) out[i] = q[i];
        } else {
            for (size_t i = 0; i < width; i++) out[i] = (1.0f - t) * a[i] + t * b[i];
        }
        return;
    }
    // glTF 2.0, appendix C.4. The first weight is one less the third, and is written so that both stay exact near the
    // keys.
    const float* leaving = at(key, out_tangent);
    const float* arriving = at(next, in_tangent);
    const float s = 1.0f - t;
    const float weight_a = s * s * (1.0f + 2.0f * t);
    const float weight_b = t * t * (1.0f + 2.0f * s);
    const float weight_leaving = step * (t * s * s);
    const float weight_arriving = step * (-t * t * s);
    for (size_t i = 0; i < width; i++)
        out[i] = weight_a * a[i] + weight_leaving * leaving[i] + weight_b * b[i] + weight_arriving * arriving[i];
}

ScenePose poseOf(const Scene& scene, const SceneAnimation* animation, float time) {
    ScenePose pose;
    std::vector<SceneTransform> transforms(scene.nodes.size());
    pose.weights.resize(scene.nodes.size());
    for (size_t i = 0; i < scene.nodes.size(); i++) {
        const SceneNode& node = scene.nodes[i];
        transforms[i] = node.transform;
        if (!node.weights.empty())
            pose.weights[i] = node.weights;
        else if (node.mesh != scene_none)
            pose.weights[i] = scene.meshes[node.mesh].weights;
    }
    if (animation)
        for (const SceneChannel& channel : animation->channels) {
            SceneTransform& transform = transforms[channel.node];
            switch (channel.path) {
                case ScenePath::Translation: sample(channel, time, 3, &transform.translation.x); break;
                case ScenePath::Rotation: sample(channel, time, 4, &transform.rotation.x); break;
                case ScenePath::Scale: sample(channel, time, 3, &transform.scale.x); break;
                case ScenePath::Weights:
                    sample(channel, time, pose.weights[channel.node].size(), pose.weights[channel.node].data());
                    break;
            }
        }
    pose.world.assign(scene.nodes.size(), Matrix4x4f(1.0f));
    // The walk reaches parents first, and each hands its matrix down.
    for (const uint32_t node : walk(scene.nodes, parentless(scene.nodes))) {
        const SceneNode& source = scene.nodes[node];
        pose.world[node] *= source.matrix ? *source.matrix : transforms[node].matrix();
        for (const uint32_t child : source.children) pose.world[child] = pose.world[node];
    }
    return pose;
}

using Matrix3x3d = glm::dmat3;

/// What normals are multiplied with: the inverse transpose times |determinant|, which exists for every matrix.
Matrix3x3d normalMatrix(const Matrix4x4f& matrix) {
    const Vector3d x(matrix[0]), y(matrix[1]), z(matrix[2]);
    const Matrix3x3d cofactors(glm::cross(y, z), glm::cross(z, x), glm::cross(x, y));
    return glm::dot(x, cofactors[0]) < 0.0 ? -1.0 * cofactors : cofactors;
}

Vector3f unitNormal(const Vector3d& normal) {
    const double length = glm::length(normal);
    return length > 0.0 && std::isfinite(length) ? Vector3f(normal / length) : Vector3f(0, 0, 1);
}

bool mirrors(const Matrix4x4f& matrix) {
    const Vector3d x(matrix[0]), y(matrix[1]), z(matrix[2]);
    return glm::dot(x, glm::cross(y, z)) < 0.0;
}

/// Puts primitives into one mesh.
class Flattener {
public:
    Flattener(bool with_normals, bool with_texcoords) : with_normals_(with_normals), with_texcoords_(with_texcoords) {}

    Mesh mesh;

    void add(const ScenePrimitive& primitive, const std::string& name, const Matrix4x4f& world,
             const std::vector<Matrix4x4f>* joints, const std::vector<float>& weights) {
        const auto first_vertex = static_cast<uint32_t>(mesh.positions.size());
        const auto first_index = static_cast<uint32_t>(mesh.indices.size());
        const bool is_skinned = joints && !primitive.joints.empty();
        const Matrix3x3d to_normals = normalMatrix(world);
        std::vector<size_t> active;
        for (size_t k = 0; k < primitive.targets.size(); k++)
            if (weights[k] != 0.0f) active.push_back(k);
        for (size_t i = 0; i < primitive.positions.size(); i++) {
            Vector3f position = primitive.positions[i];
            Vector3f normal = with_normals_ ? primitive.normals[i] : Vector3f(0.0f);
            for (const size_t k : active) {
                const SceneMorphTarget& target = primitive.targets[k];
                if (!target.positions.empty()) position += weights[k] * target.positions[i];
                if (with_normals_ && !target.normals.empty()) normal += weights[k] * target.normals[i];
            }
            if (is_skinned) {
                Matrix4x4f blend(0.0f);
                for (int k = 0; k < 4; k++)
                    blend += primitive.weights[i][k] * (*joints)[primitive.joints[i][static_cast<size_t>(k)]];
                position = transformPoint(blend, position);
                if (with_normals_) mesh.normals.push_back(unitNormal(normalMatrix(blend) * Vector3d(normal)));
            } else {
                position = transformPoint(world, position);
                if (with_normals_) mesh.normals.push_back(unitNormal(to_normals * Vector3d(normal)));
            }
            mesh.positions.push_back(position);
        }
        if (with_texcoords_)
            mesh.texcoords.insert(mesh.texcoords.end(), primitive.texcoords[0].begin(), primitive.texcoords[0].end());
        const bool is_turned = !is_skinned && mirrors(world);
        for (size_t i = 0; i + 2 < primitive.indices.size(); i += 3) {
            const uint32_t* corners = &primitive.indices[i];
            mesh.indices.push_back(first_vertex + corners[0]);
            mesh.indices.push_back(first_vertex + corners[is_turned ? 2 : 1]);
            mesh.indices.push_back(first_vertex + corners[is_turned ? 1 : 2]);
        }
        mesh.parts.push_back({.name = name,
                              .first_index = first_index,
                              .index_count = static_cast<uint32_t>(primitive.indices.size()),
                              .material = primitive.material});
    }

private:
    bool with_normals_;
    bool with_texcoords_;
};

void warnDropped(size_t with, size_t count, const char* what) {
    if (with > 0 && with < count)
        log(LogLevel::Warning, "mesh.attribute_dropped",
            fmt::format("{} of {} primitives have no {}; none is kept", count - with, count, what));
}

}  // namespace

Matrix4x4f SceneTransform::matrix() const {
    const Vector4f q = unit(rotation);
    const float x = q.x, y = q.y, z = q.z, w = q.w;
    return Matrix4x4f(
        Vector4f(scale.x * Vector3f(1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)), 0.0f),
        Vector4f(scale.y * Vector3f(2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)), 0.0f),
        Vector4f(scale.z * Vector3f(2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)), 0.0f),
        Vector4f(translation, 1.0f));
}

float SceneAnimation::duration() const {
    float last = 0.0f;
    for (const SceneChannel& channel : channels)
        if (!channel.times.empty()) last = std::max(last, channel.times.back());
    return last;
}

ScenePose Scene::pose() const { return poseOf(*this, nullptr, 0.0f); }

ScenePose Scene::pose(uint32_t animation, float time) const {
    return poseOf(*this, animation < animations.size() ? &animations[animation] : nullptr, time);
}

std::vector<Matrix4x4f> Scene::jointMatrices(const ScenePose& pose, uint32_t skin) const {
    const SceneSkin& source = skins[skin];
    std::vector<Matrix4x4f> matrices;
    matrices.reserve(source.joints.size());
    for (size_t i = 0; i < source.joints.size(); i++)
        matrices.push_back(pose.world[source.joints[i]] * source.inverse_bind[i]);
    return matrices;
}

Expected<Mesh> Scene::mesh(const ScenePose& pose, uint64_t limit) const {
    // First the size, so that a small scene of many nodes with one large mesh is refused before it is made.
    const std::vector<uint32_t> order = walk(nodes, roots);
    const auto nameOf = [this](uint32_t node) -> const std::string& {
        return nodes[node].name.empty() ? meshes[nodes[node].mesh].name : nodes[node].name;
    };
    uint64_t vertices = 0, corners = 0, names = 0;
    size_t count = 0, with_normals = 0, with_texcoords = 0;
    for (const uint32_t node : order) {
        if (nodes[node].mesh == scene_none) continue;
        for (const ScenePrimitive& primitive : meshes[nodes[node].mesh].primitives) {
            count++;
            with_normals += !primitive.normals.empty();
            with_texcoords += !primitive.texcoords[0].empty();
            names += sizeof(MeshPart) + nameOf(node).size();
            vertices += primitive.positions.size();
            corners += primitive.indices.size();
            const uint64_t size =
                vertices * (2 * sizeof(Vector3f) + sizeof(Vector2f)) + corners * sizeof(uint32_t) + names;
            if (size > limit || vertices > UINT32_MAX || corners > UINT32_MAX)
                return unexpected(makeError(ErrorCode::OutOfRange, "mesh.too_large",
                                            "{} vertices and {} indices of {} primitives and more take more than the "
                                            "limit of {} bytes",
                                            vertices, corners, count, limit));
        }
    }
    if (corners == 0) return unexpected(makeError(ErrorCode::Io, "mesh.no_faces", "the shown nodes have no triangles"));
    warnDropped(with_normals, count, "normals");
    warnDropped(with_texcoords, count, "texture coordinates");

    Flattener flattener(with_normals == count, with_texcoords == count);
    flattener.mesh.positions.reserve(vertices);
    flattener.mesh.indices.reserve(corners);
    std::vector<std::vector<Matrix4x4f>> joints(skins.size());  // of the skins that are met
    for (const uint32_t node : order) {
        const SceneNode& source = nodes[node];
        if (source.mesh == scene_none) continue;
        const std::vector<Matrix4x4f>* skin = nullptr;
        if (source.skin != scene_none) {
            skin = &joints[source.skin];
            if (skin->empty()) joints[source.skin] = jointMatrices(pose, source.skin);
        }
        for (const ScenePrimitive& primitive : meshes[source.mesh].primitives)
            flattener.add(primitive, nameOf(node), pose.world[node], skin, pose.weights[node]);
    }
    if (Status status = flattener.mesh.validate(); !status) return unexpected(status.error());
    return std::move(flattener.mesh);
}

}  // namespace glint
