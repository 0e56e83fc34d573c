#include "scene_reference.h"

#include "reference.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <functional>

// Bounds. u is float32's unit roundoff. A sum or product of computed values x', y' with |x' - x| <= X is off by what X
// and Y bring, and by u of the result. Second-order terms are covered by counting u as 1.01 * 2^-24 and by rounding
// small integers up.

namespace glint::test {

namespace {

constexpr double u = 1.01 * 0x1p-24;

using BoundedMatrix = Bounded<Matrix4x4d>;

Matrix4x4d magnitudes(const Matrix4x4d& m) { return {glm::abs(m[0]), glm::abs(m[1]), glm::abs(m[2]), glm::abs(m[3])}; }

/// Each entry is a sum of four products: 4 roundings of at most the sum of magnitudes.
BoundedMatrix product(const BoundedMatrix& a, const BoundedMatrix& b) {
    const Matrix4x4d abs_a = magnitudes(a.value), abs_b = magnitudes(b.value);
    return {a.value * b.value, a.bound * abs_b + abs_a * b.bound + a.bound * b.bound + 4 * u * (abs_a * abs_b)};
}

struct BoundedTransform {
    Vector3d translation, translation_bound = Vector3d(0.0);
    Vector4d rotation;
    double rotation_bound = 0.0;  // of each component
    Vector3d scale, scale_bound = Vector3d(0.0);
};

/// From a quaternion of any length, whose components are off by at most `bound`: bringing it to unit length divides the
/// error by its length, at most doubles it, and rounds once. An entry of the rotation is 1 - 2 (y y + z z) or
/// 2 (x y - z w); its derivatives by the four components have a magnitude of at most 4, and |x| + |y| + |z| + |w| <= 2,
/// so it is off by at most 8 times the quaternion, and by 8 roundings of values of at most 2. Scaling rounds once more.
BoundedMatrix matrixOf(const BoundedTransform& t) {
    const double length = glm::length(t.rotation);
    const Vector4d q = length > 0.0 ? t.rotation / length : Vector4d(0, 0, 0, 1);
    const double entry = 8 * (2 * t.rotation_bound / std::max(length, 1e-300) + u) + 16 * u;
    // By the vectors that the rotation takes the axes to: v + 2 w (a x v) + 2 a x (a x v).
    const Vector3d axis(q);
    BoundedMatrix result{Matrix4x4d(1.0), Matrix4x4d(0.0)};
    for (int k = 0; k < 3; k++) {
        Vector3d v(0.0);
        v[k] = 1.0;
        const Vector3d turned = v + 2 * q.w * glm::cross(axis, v) + 2.0 * glm::cross(axis, glm::cross(axis, v));
        result.value[k] = Vector4d(t.scale[k] * turned, 0.0);
        const double scale = std::fabs(t.scale[k]) + t.scale_bound[k];
        result.bound[k] = Vector4d(Vector3d(scale * (entry + u) + t.scale_bound[k]), 0.0);
    }
    result.value[3] = Vector4d(t.translation, 1.0);
    result.bound[3] = Vector4d(t.translation_bound, 0.0);
    return result;
}

double weightOf(double a, double b, double t) { return a * (1 - t) + b * t; }

/// Values of a channel, and one bound for each.
void sample(const SceneChannel& channel, float time, size_t width, std::vector<Bounded<double>>& out) {
    const bool is_spline = channel.interpolation == SceneInterpolation::CubicSpline;
    const auto at = [&](size_t key, size_t part, size_t i) -> double {
        return channel.values[((is_spline ? 3 * key + part : key)) * width + i];
    };
    out.assign(width, {});
    size_t key = 0;
    while (key + 1 < channel.times.size() && channel.times[key + 1] <= time) key++;
    const bool is_outside = !(time >= channel.times.front()) || key + 1 == channel.times.size();
    if (is_outside || channel.interpolation == SceneInterpolation::Step) {
        for (size_t i = 0; i < width; i++) out[i].value = at(key, 1, i);
        return;
    }
    const double step = static_cast<double>(channel.times[key + 1]) - channel.times[key];
    const double t = (static_cast<double>(time) - channel.times[key]) / step;
    // t is off by 3 roundings (two differences, a quotient), 1 - t by as much and one more.
    if (is_spline) {
        const double h00 = 2 * t * t * t - 3 * t * t + 1, h10 = t * t * t - 2 * t * t + t;
        const double h01 = -2 * t * t * t + 3 * t * t, h11 = t * t * t - t * t;
        for (size_t i = 0; i < width; i++) {
            const double a = at(key, 1, i), b = at(key + 1, 1, i);
            const double leaving = step * at(key, 2, i), arriving = step * at(key + 1, 0, i);
            out[i].value = h00 * a + h10 * leaving + h01 * b + h11 * arriving;
            // Each weight's slope is at most 1.5 and its magnitude at most 1; it takes at most 6 roundings, its product
            // one, the sum three, and the step one: 4.5 + 6 + 1 + 3 + 1 < 16.
            out[i].bound = 16 * u * (std::fabs(a) + std::fabs(b) + std::fabs(leaving) + std::fabs(arriving));
        }
    } else if (channel.path == ScenePath::Rotation) {
        Vector4d a(at(key, 0, 0), at(key, 0, 1), at(key, 0, 2), at(key, 0, 3));
        Vector4d b(at(key + 1, 0, 0), at(key + 1, 0, 1), at(key + 1, 0, 2), at(key + 1, 0, 3));
        a /= glm::length(a);
        b /= glm::length(b);
        if (glm::dot(a, b) < 0.0) b = -b;
        // Of unit quaternions less than a quarter turn apart, by the arc between them.
        const Vector4d across = b - a * glm::dot(a, b);
        const double sine = glm::length(across);
        const double angle = std::atan2(sine, glm::dot(a, b));
        const Vector4d q = sine > 0.0 ? a * std::cos(t * angle) + across / sine * std::sin(t * angle) : a;
        // The keys are off by u each. The angle, at most pi / 2, comes from two lengths of 4 roundings each and is off
        // by at most 16 u; a weight's slope by the angle is at most 1 and by t at most pi / 2, and it takes two sines
        // of 2 u, two products and a quotient: 16 + 5 + 6 < 28 roundings each. Two products, a sum, two keys, unit
        // length.
        for (int i = 0; i < 4; i++) out[static_cast<size_t>(i)] = {q[i], (2 * 28 + 8) * u};
    } else {
        for (size_t i = 0; i < width; i++) {
            const double a = at(key, 0, i), b = at(key + 1, 0, i);
            out[i] = {weightOf(a, b, t), 6 * u * (std::fabs(a) + std::fabs(b))};
        }
    }
}

template <class Vector>
void assign(Vector& value, Vector& bound, const std::vector<Bounded<double>>& samples) {
    for (int i = 0; i < 3; i++) {
        value[i] = samples[static_cast<size_t>(i)].value;
        bound[i] = samples[static_cast<size_t>(i)].bound;
    }
}

/// A point by a matrix, both off.
Bounded<Vector3d> transformed(const BoundedMatrix& m, const Bounded<Vector3d>& p) {
    const Vector4d size(glm::abs(p.value), 1.0), off(p.bound, 0.0);
    const Matrix4x4d abs_m = magnitudes(m.value);
    return {Vector3d(m.value * Vector4d(p.value, 1.0)),
            Vector3d(m.bound * (size + off) + abs_m * off + 4 * u * (abs_m * size))};
}

/// Of a cross product whose factors are off.
Vector3d crossBound(const Vector3d& a, const Vector3d& a_off, const Vector3d& b, const Vector3d& b_off) {
    Vector3d bound;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        bound[i] = std::fabs(a[j]) * b_off[k] + a_off[j] * (std::fabs(b[k]) + b_off[k]) + std::fabs(a[k]) * b_off[j] +
                   a_off[k] * (std::fabs(b[j]) + b_off[j]);
    }
    return bound;
}

/// A normal by the inverse transpose, of unit length; in float64 but for the matrix and the morphed normal, and rounded
/// once. Bringing a vector to unit length divides its error by its length, and at most doubles it.
Bounded<Vector3d> turned(const BoundedMatrix& m, const Bounded<Vector3d>& n, const NormalRounding& rounding) {
    const Vector3d axes[3] = {Vector3d(m.value[0]), Vector3d(m.value[1]), Vector3d(m.value[2])};
    const Vector3d off[3] = {Vector3d(m.bound[0]), Vector3d(m.bound[1]), Vector3d(m.bound[2])};
    Vector3d direction(0.0), error(0.0);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const Vector3d cofactors = glm::cross(axes[j], axes[k]);
        direction += cofactors * n.value[i];
        error += crossBound(axes[j], off[j], axes[k], off[k]) * (std::fabs(n.value[i]) + n.bound[i]) +
                 glm::abs(cofactors) * (n.bound[i] + rounding.products * u * std::fabs(n.value[i]));
    }
    if (glm::dot(axes[0], glm::cross(axes[1], axes[2])) < 0.0) direction = -direction;
    const double length = glm::length(direction);
    return {direction / length, Vector3d(2 * glm::length(error) / length + rounding.unit * u)};
}

float uniform(Random& random, double low, double high) { return static_cast<float>(random.uniform(low, high)); }

Vector3f vector(Random& random, double size) {
    return {uniform(random, -size, size), uniform(random, -size, size), uniform(random, -size, size)};
}

Vector4f quaternion(Random& random) {
    const Vector3f xyz = vector(random, 1.0);
    return {xyz, uniform(random, -1, 1)};
}

ScenePrimitive square(Random& random, bool with_joints) {
    ScenePrimitive primitive;
    primitive.indices = {0, 1, 2, 2, 1, 3};
    for (int i = 0; i < 4; i++) {
        primitive.positions.push_back(vector(random, 2.0));
        primitive.normals.push_back(Vector3f(random.direction()));
        primitive.texcoords[0].emplace_back(uniform(random, 0, 1), uniform(random, 0, 1));
        if (!with_joints) continue;
        Vector4d weights(random.uniform(), random.uniform(), random.uniform(), random.uniform());
        weights /= weights.x + weights.y + weights.z + weights.w;
        primitive.weights.emplace_back(weights);
        primitive.joints.push_back({0, 1, 2, static_cast<uint16_t>(i % 3)});
    }
    for (int k = 0; k < 2; k++) {
        SceneMorphTarget& target = primitive.targets.emplace_back();
        for (int i = 0; i < 4; i++) {
            target.positions.push_back(vector(random, 0.5));
            // Small, so that no normal comes near to length zero.
            if (k == 0) target.normals.push_back(vector(random, 0.2));
        }
    }
    return primitive;
}

SceneChannel channel(Random& random, uint32_t node, ScenePath path, SceneInterpolation interpolation) {
    SceneChannel result{node, path, interpolation, {}, {}};
    const size_t width = path == ScenePath::Rotation ? 4 : path == ScenePath::Weights ? 2 : 3;
    for (int key = 0; key < 5; key++) {
        result.times.push_back(static_cast<float>(key) + uniform(random, 0, 0.9));
        for (int part = 0; part < (interpolation == SceneInterpolation::CubicSpline ? 3 : 1); part++) {
            const double low = path == ScenePath::Scale ? 0.5 : -1.0;
            for (size_t i = 0; i < width; i++) result.values.push_back(uniform(random, low, 1.5));
        }
    }
    return result;
}

}  // namespace

Scene randomScene(uint64_t seed) {
    Random random(seed);
    Scene scene;
    scene.meshes = {{"skinned", {square(random, true)}, {0.25f, -0.5f}}, {"plain", {square(random, false)}, {0, 0}}};
    for (uint32_t i = 0; i < 8; i++) {
        SceneNode& node = scene.nodes.emplace_back();
        node.transform = {vector(random, 3.0), quaternion(random), Vector3f(1.0f) + vector(random, 0.4)};
        if (i < 5) node.children = {i + 1};
    }
    scene.nodes[3].matrix = Matrix4x4f(Vector4f(vector(random, 1.0), 0), Vector4f(vector(random, 1.0), 0),
                                       Vector4f(vector(random, 1.0), 0), Vector4f(vector(random, 1.0), 1));
    scene.nodes[6].mesh = 0;
    scene.nodes[6].skin = 0;
    scene.nodes[4].children.push_back(7);
    scene.nodes[7].mesh = 1;
    scene.nodes[7].weights = {0.5f, 0.75f};
    scene.roots = {0, 6};
    SceneSkin& skin = scene.skins.emplace_back();
    skin.joints = {1, 4, 2};
    for (int i = 0; i < 3; i++)
        skin.inverse_bind.push_back(
            SceneTransform{vector(random, 1.0), quaternion(random), Vector3f(1.0f) + vector(random, 0.3)}.matrix());
    SceneAnimation& animation = scene.animations.emplace_back();
    using enum ScenePath;
    uint32_t at = static_cast<uint32_t>(seed);
    for (const uint32_t node : {0u, 1u, 2u, 4u, 5u})
        for (const ScenePath path : {Translation, Rotation, Scale})
            animation.channels.push_back(channel(random, node, path, static_cast<SceneInterpolation>(at++ % 3)));
    for (const uint32_t node : {6u, 7u})
        animation.channels.push_back(channel(random, node, Weights, static_cast<SceneInterpolation>(at++ % 3)));
    return scene;
}

ReferencePose referencePose(const Scene& scene, uint32_t animation, float time) {
    ReferencePose pose;
    std::vector<BoundedMatrix> local;
    std::vector<uint32_t> parents(scene.nodes.size(), scene_none);
    std::vector<Bounded<double>> samples;
    for (uint32_t i = 0; i < scene.nodes.size(); i++) {
        const SceneNode& node = scene.nodes[i];
        for (const uint32_t child : node.children) parents[child] = i;
        BoundedTransform t;
        t.translation = node.transform.translation;
        t.rotation = node.transform.rotation;
        t.scale = node.transform.scale;
        auto& weights = pose.weights.emplace_back();
        if (node.mesh != scene_none)
            for (const float weight : node.weights.empty() ? scene.meshes[node.mesh].weights : node.weights)
                weights.push_back({weight, 0.0});
        if (animation != scene_none)
            for (const SceneChannel& channel : scene.animations[animation].channels) {
                if (channel.node != i) continue;
                const size_t width = channel.path == ScenePath::Weights    ? weights.size()
                                     : channel.path == ScenePath::Rotation ? 4
                                                                           : 3;
                sample(channel, time, width, samples);
                switch (channel.path) {
                    case ScenePath::Translation: assign(t.translation, t.translation_bound, samples); break;
                    case ScenePath::Scale: assign(t.scale, t.scale_bound, samples); break;
                    case ScenePath::Weights: weights = samples; break;
                    case ScenePath::Rotation:
                        for (int k = 0; k < 4; k++) {
                            t.rotation[k] = samples[static_cast<size_t>(k)].value;
                            t.rotation_bound = std::max(t.rotation_bound, samples[static_cast<size_t>(k)].bound);
                        }
                        break;
                }
            }
        local.push_back(node.matrix ? BoundedMatrix{Matrix4x4d(*node.matrix), Matrix4x4d(0.0)} : matrixOf(t));
    }
    for (uint32_t i = 0; i < scene.nodes.size(); i++) {
        BoundedMatrix world = local[i];
        for (uint32_t parent = parents[i]; parent != scene_none; parent = parents[parent])
            world = product(local[parent], world);
        pose.world.push_back(world);
    }
    // The chain was multiplied from its end here and is from its start there: either way each product of the matrices'
    // entries takes at most 4 roundings a link, which the bound counts at every link.
    return pose;
}

ReferenceMesh referenceMesh(const Scene& scene, const ReferencePose& pose, const NormalRounding& rounding) {
    ReferenceMesh mesh;
    bool has_normals = true;
    const std::function<void(uint32_t)> add = [&](uint32_t index) {
        const SceneNode& node = scene.nodes[index];
        if (node.mesh != scene_none)
            for (const ScenePrimitive& primitive : scene.meshes[node.mesh].primitives)
                for (size_t i = 0; i < primitive.positions.size(); i++) {
                    Bounded<Vector3d> position{Vector3d(primitive.positions[i]), Vector3d(0.0)};
                    Bounded<Vector3d> normal{Vector3d(1.0), Vector3d(0.0)};
                    has_normals &= !primitive.normals.empty();
                    if (!primitive.normals.empty()) normal.value = Vector3d(primitive.normals[i]);
                    // Each target adds a product and a sum, whose roundings are of at most what has been added up.
                    const auto morph = [&](Bounded<Vector3d>& value, const Vector3f& delta,
                                           const Bounded<double>& weight) {
                        const Vector3d d(delta), step = weight.value * d;
                        value.bound += weight.bound * glm::abs(d) + 2 * u * (glm::abs(step) + glm::abs(value.value));
                        value.value += step;
                    };
                    for (size_t k = 0; k < primitive.targets.size(); k++) {
                        const SceneMorphTarget& target = primitive.targets[k];
                        if (!target.positions.empty()) morph(position, target.positions[i], pose.weights[index][k]);
                        if (!target.normals.empty()) morph(normal, target.normals[i], pose.weights[index][k]);
                    }
                    BoundedMatrix matrix = pose.world[index];
                    if (node.skin != scene_none && !primitive.joints.empty()) {
                        matrix = {Matrix4x4d(0.0), Matrix4x4d(0.0)};
                        const SceneSkin& skin = scene.skins[node.skin];
                        for (int k = 0; k < 4; k++) {
                            const size_t joint = primitive.joints[i][static_cast<size_t>(k)];
                            const BoundedMatrix bind{Matrix4x4d(skin.inverse_bind[joint]), Matrix4x4d(0.0)};
                            const BoundedMatrix each = product(pose.world[skin.joints[joint]], bind);
                            const double weight = primitive.weights[i][k];
                            matrix.value += weight * each.value;
                            // A product and up to four sums.
                            matrix.bound += weight * (each.bound + 5 * u * magnitudes(each.value));
                        }
                    }
                    mesh.positions.push_back(transformed(matrix, position));
                    mesh.normals.push_back(turned(matrix, normal, rounding));
                }
        for (const uint32_t child : node.children) add(child);
    };
    for (const uint32_t root : scene.roots) add(root);
    if (!has_normals) mesh.normals.clear();
    return mesh;
}

}  // namespace glint::test
