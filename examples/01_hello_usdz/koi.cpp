#include "01_hello_usdz/koi.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>

using namespace glint;

namespace {

// A koi is 2 long without its tail fin: its nose at x = 1, up is +Y. Along it s goes from 0 at the nose to 1 where the
// tail fin begins, and on.

constexpr uint32_t spine_joints = 14;
constexpr uint32_t joint_count = spine_joints + 2;  // and one for each of the breast fins
constexpr float joint_step = 1.0f / 12.0f;          // in s
constexpr uint32_t root_joint = 3;
constexpr float duration = 8.0f;
constexpr float beat = 1.0f;  // of the tail, in seconds
constexpr uint32_t fish = 3;

float placeOf(float s) { return 1.0f - 2.0f * s; }

float randomAt(uint32_t x, uint32_t y, uint32_t seed) {
    uint32_t h = x * 0x8da6b343u ^ y * 0xd8163841u ^ seed * 0xcb1ab31fu;
    h = (h ^ (h >> 16)) * 0x7feb352du;
    h = (h ^ (h >> 15)) * 0x846ca68bu;
    return static_cast<float>((h ^ (h >> 16)) >> 8) * 0x1p-24f;
}

/// Smooth values in [0, 1]; repeats along v after `around` cells.
float noise(float u, float v, uint32_t around, uint32_t seed) {
    const float fu = std::floor(u), fv = std::floor(v);
    const auto iu = static_cast<uint32_t>(static_cast<int32_t>(fu)),
               iv = static_cast<uint32_t>(static_cast<int32_t>(fv));
    const auto ease = [](float t) { return t * t * (3 - 2 * t); };
    const auto corner = [&](uint32_t du, uint32_t dv) { return randomAt(iu + du, (iv + dv) % around, seed); };
    const float a = ease(u - fu), b = ease(v - fv);
    return std::lerp(std::lerp(corner(0, 0), corner(1, 0), a), std::lerp(corner(0, 1), corner(1, 1), a), b);
}

float clouds(float u, float v, uint32_t around, uint32_t seed) {
    float sum = 0, weight = 0.5f;
    for (uint32_t octave = 0; octave < 4; octave++, u *= 2, v *= 2, around *= 2, weight *= 0.5f)
        sum += weight * noise(u, v, around, seed + octave);
    return sum / 0.9375f;
}

float ease(float from, float to, float value) {
    const float t = std::clamp((value - from) / (to - from), 0.0f, 1.0f);
    return t * t * (3 - 2 * t);
}

/// Half of the height and of the width of the body. Squares are interpolated, which makes the nose round.
Vector2f sectionOf(float s) {
    constexpr std::array<float, 11> places = {0, 0.03f, 0.1f, 0.2f, 0.32f, 0.45f, 0.6f, 0.75f, 0.88f, 0.97f, 1.0f};
    constexpr std::array<float, 11> heights = {0, 0.08f, 0.15f, 0.215f, 0.245f, 0.235f, 0.18f, 0.125f, 0.09f, 0.08f, 0};
    constexpr std::array<float, 11> widths = {0,      0.085f, 0.145f, 0.18f, 0.185f, 0.165f,
                                              0.115f, 0.065f, 0.035f, 0.02f, 0};
    size_t k = 0;
    while (k + 2 < places.size() && s >= places[k + 1]) k++;
    const float t = std::clamp((s - places[k]) / (places[k + 1] - places[k]), 0.0f, 1.0f);
    const auto at = [&](const auto& values) {
        const auto square = [&](size_t i) { return values[i] * values[i]; };
        const float a = square(k), b = square(k + 1);
        const auto slope = [&](size_t i) {
            if (i == 0 || i + 1 == places.size()) return i == 0 ? square(1) / places[1] : -2.0f * square(i - 1);
            return (square(i + 1) - square(i - 1)) / (places[i + 1] - places[i - 1]);
        };
        const float step = places[k + 1] - places[k], r = 1 - t;
        return std::sqrt(std::max(0.0f, r * r * (1 + 2 * t) * a + t * t * (1 + 2 * r) * b +
                                            step * t * r * (r * slope(k) - t * slope(k + 1))));
    };
    return {at(heights), at(widths)};
}

Vector3f bodyAt(float s, float angle) {
    const Vector2f section = sectionOf(s);
    // The belly is rounder than the back.
    const float up = std::cos(angle);
    return {placeOf(s), section.x * up * (up < 0 ? 0.9f : 1.0f), section.y * std::sin(angle)};
}

Vector3f bodyNormal(float s, float angle) {
    constexpr float h = 1e-3f;
    const float low = std::max(s - h, 0.0f), high = std::min(s + h, 1.0f);
    const Vector3f along = bodyAt(high, angle) - bodyAt(low, angle);
    const Vector3f around = bodyAt(s, angle + h) - bodyAt(s, angle - h);
    const Vector3f normal = glm::cross(around, along);
    const float length = glm::length(normal);
    return length > 1e-9f ? normal / length : Vector3f(s < 0.5f ? 1.0f : -1.0f, 0, 0);
}

/// The joints near s with the weights of a cubic B-spline: four, smooth along the body.
void follow(ScenePrimitive& primitive, float s) {
    const float place = s / joint_step - 0.5f;
    const float first = std::floor(place);
    const float t = place - first, r = 1 - t;
    const std::array<float, 4> spline = {r * r * r / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
                                         (3 * r * r * r - 6 * r * r + 4) / 6, t * t * t / 6};
    std::array<uint16_t, 4> joints;
    for (int k = 0; k < 4; k++) {
        const int joint = static_cast<int>(first) - 1 + k;
        joints[static_cast<size_t>(k)] = static_cast<uint16_t>(std::clamp(joint, 0, int(spine_joints) - 1));
    }
    primitive.joints.push_back(joints);
    primitive.weights.emplace_back(spline[0], spline[1], spline[2],
                                   std::max(0.0f, 1.0f - spline[0] - spline[1] - spline[2]));
}

/// Triangles of a grid of (columns + 1) * (rows + 1) vertices that were added last.
void addGrid(ScenePrimitive& primitive, uint32_t columns, uint32_t rows) {
    const auto first = static_cast<uint32_t>(primitive.positions.size()) - (columns + 1) * (rows + 1);
    for (uint32_t y = 0; y < rows; y++)
        for (uint32_t x = 0; x < columns; x++) {
            const uint32_t a = first + y * (columns + 1) + x, b = a + columns + 1;
            primitive.indices.insert(primitive.indices.end(), {a, b, a + 1, b, b + 1, a + 1});
        }
}

ScenePrimitive makeBody(uint32_t material) {
    constexpr uint32_t along = 72, around = 36;
    ScenePrimitive body;
    body.material = material;
    SceneMorphTarget& mouth = body.targets.emplace_back();
    for (uint32_t y = 0; y <= around; y++)
        for (uint32_t x = 0; x <= along; x++) {
            const float u = static_cast<float>(x) / along, v = static_cast<float>(y) / around;
            const float s = u * (0.4f + 0.6f * u);  // finer at the head
            const float angle = 2 * pi * v;
            body.positions.push_back(bodyAt(s, angle));
            body.normals.push_back(bodyNormal(s, angle));
            body.texcoords[0].emplace_back(s, v);
            follow(body, s);
            // The lips go forward and apart, and the cheeks out.
            const float lips = 1 - ease(0.0f, 0.03f, s), cheeks = ease(0.05f, 0.12f, s) * (1 - ease(0.14f, 0.2f, s));
            mouth.positions.emplace_back(0.02f * lips * std::fabs(std::cos(angle)), 0.03f * lips * std::cos(angle),
                                         0.035f * cheeks * std::sin(angle));
        }
    addGrid(body, along, around);
    return body;
}

/// A sheet: p along its root, q from there to its edge, both in [0, 1].
void addFin(ScenePrimitive& fins, const std::function<Vector3f(float p, float q)>& at,
            const std::function<void(const Vector3f&)>& joints) {
    constexpr uint32_t columns = 10, rows = 8;
    constexpr float h = 1e-3f;
    for (uint32_t y = 0; y <= rows; y++)
        for (uint32_t x = 0; x <= columns; x++) {
            const float p = static_cast<float>(x) / columns, q = static_cast<float>(y) / rows;
            const Vector3f position = at(p, q);
            fins.positions.push_back(position);
            fins.normals.push_back(
                glm::normalize(glm::cross(at(p + h, q) - at(p - h, q), at(p, q + h) - at(p, q - h))));
            fins.texcoords[0].emplace_back(p, q);
            joints(position);
        }
    addGrid(fins, columns, rows);
}

ScenePrimitive makeFins(uint32_t material) {
    ScenePrimitive fins;
    fins.material = material;
    fins.targets.resize(1);
    const auto withSpine = [&](const Vector3f& position) { follow(fins, 0.5f * (1.0f - position.x)); };
    const auto bend = [](float q) { return q * (1.3f - 0.3f * q); };
    // Tail, with a fork.
    addFin(
        fins,
        [&](float p, float q) {
            const float y = 2 * p - 1;
            return Vector3f(-0.93f - bend(q) * (0.3f + 0.28f * y * y), y * (0.07f + 0.3f * q), 0.01f * y * q);
        },
        withSpine);
    // Back.
    addFin(
        fins,
        [&](float p, float q) {
            const float s = 0.3f + 0.36f * p;
            const float height = 0.17f * (1 - 0.65f * p) * ease(-0.12f, 0.12f, p);
            return Vector3f(placeOf(s + 0.05f * q), 0.97f * sectionOf(s).x + q * height, 0.004f * q);
        },
        withSpine);
    // Below the tail.
    addFin(
        fins,
        [&](float p, float q) {
            const float s = 0.73f + 0.1f * p;
            return Vector3f(placeOf(s + 0.07f * q), -0.85f * sectionOf(s).x - q * 0.12f * (1 - 0.5f * p), 0.004f * q);
        },
        withSpine);
    for (const float side : {-1.0f, 1.0f}) {
        // Belly.
        addFin(
            fins,
            [&](float p, float q) {
                const float s = 0.5f + 0.06f * p;
                return Vector3f(placeOf(s + 0.09f * q), -0.8f * sectionOf(s).x - q * 0.1f,
                                side * (0.07f + 0.13f * q * (1 - 0.4f * p)));
            },
            withSpine);
        // Breast: of its own joint.
        addFin(
            fins,
            [&](float p, float q) {
                const float s = 0.235f + 0.05f * p;
                return Vector3f(placeOf(s + q * (0.06f + 0.1f * p)), -0.1f - 0.05f * q,
                                side * (0.12f + q * (0.36f - 0.16f * p * p)));
            },
            [&](const Vector3f&) {
                const auto joint = static_cast<uint16_t>(spine_joints + (side < 0 ? 0 : 1));
                fins.joints.push_back({joint, 0, 0, 0});
                fins.weights.emplace_back(1, 0, 0, 0);
            });
    }
    return fins;
}

ScenePrimitive makeEyes(uint32_t material) {
    constexpr uint32_t columns = 16, rows = 8;
    ScenePrimitive eyes;
    eyes.material = material;
    eyes.targets.resize(1);
    for (const float side : {-1.0f, 1.0f}) {
        const Vector3f centre = bodyAt(0.09f, side * 1.25f) * Vector3f(1, 1, 0.93f);
        for (uint32_t y = 0; y <= rows; y++)
            for (uint32_t x = 0; x <= columns; x++) {
                const float a = 2 * pi * static_cast<float>(x) / columns, b = pi * static_cast<float>(y) / rows;
                const Vector3f normal(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b));
                eyes.positions.push_back(centre + 0.03f * normal);
                eyes.normals.push_back(normal);
                eyes.texcoords[0].emplace_back(0.5f, 0.5f);
                eyes.joints.push_back({0, 0, 0, 0});
                eyes.weights.emplace_back(1, 0, 0, 0);
            }
        addGrid(eyes, columns, rows);
    }
    return eyes;
}

// Images.

constexpr uint32_t map_width = 1024, map_height = 512;

template <class Texel>
SceneImage makeImage(const char* name, uint32_t width, uint32_t height, Texel&& texel) {
    SceneImage result{name, Image::create(FormatRGBAu8n, width, height).value_or(Image())};
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++)
            result.image.store(x, y,
                               texel((static_cast<float>(x) + 0.5f) / static_cast<float>(width),
                                     (static_cast<float>(y) + 0.5f) / static_cast<float>(height)));
    return result;
}

/// Scales that overlap from the head to the tail: how high the one on top is, and how near its edge.
Vector2f scalesAt(float u, float v) {
    constexpr float along = 58, around = 30, radius = 0.68f;
    const float x = u * along, y = v * around;
    for (float column = std::floor(x - radius); column <= x + 1; column++) {
        const float shift = std::fmod(std::fabs(column), 2.0f) == 0.0f ? 0.0f : 0.5f;
        for (const float row : {std::floor(y - shift), std::floor(y - shift) + 1}) {
            const float dx = (x - column) / 1.15f, dy = y - (row + shift);
            const float distance = std::sqrt(dx * dx + dy * dy);
            if (distance < radius) return {0.5f + 0.5f * dx / radius, distance / radius};
        }
    }
    return {0, 0};
}

/// Where there are scales: not on the head, nor where the tail fin begins.
float scaly(float u, float v) {
    const float back = 0.5f + 0.5f * std::cos(2 * pi * v);
    return ease(0.19f + 0.03f * back, 0.24f + 0.03f * back, u) * (1 - ease(0.95f, 0.99f, u));
}

float heightAt(float u, float v) {
    // The edge of the gills.
    const float gill = 0.185f + 0.025f * std::cos(4 * pi * v);
    const float sides = ease(0.1f, 0.2f, std::min(v, 1 - v)) * (1 - ease(0.42f, 0.5f, std::min(v, 1 - v)));
    return scalesAt(u, v).x * scaly(u, v) * 0.011f -
           0.02f * sides * ease(0, 0.012f, u - gill) * (1 - ease(0.012f, 0.03f, u - gill));
}

SceneImage normalMap() {
    return makeImage("scales", map_width, map_height, [](float u, float v) {
        constexpr float h = 0.7f / map_width;
        // The body is about 2 long and 1.2 around. Green counts up the picture, against v.
        const float du = (heightAt(u + h, v) - heightAt(u - h, v)) / (2 * h * 2.0f);
        const float dv = (heightAt(u, v + h) - heightAt(u, v - h)) / (2 * h * 1.2f);
        const Vector3f n = glm::normalize(Vector3f(-du, dv, 1.0f));
        return Vector4f(n * 0.5f + 0.5f, 1.0f);
    });
}

SceneImage colorMap(uint32_t kind) {
    const char* names[] = {"kohaku", "showa", "ogon"};
    return makeImage(names[kind], map_width, map_height, [kind](float u, float v) {
        const float back = 0.5f + 0.5f * std::cos(2 * pi * v);  // 1 on the back, 0 on the belly
        const float wave = clouds(u * 7, v * 4, 4, 11 + 40 * kind);
        const float second = clouds(u * 9 + 3, v * 5, 5, 77 + 40 * kind);
        const Vector3f white(0.96f, 0.93f, 0.88f), red(0.87f, 0.24f, 0.08f), black(0.06f, 0.06f, 0.075f),
            gold(0.98f, 0.74f, 0.32f);
        Vector3f color = white;
        if (kind == 2) color = glm::mix(gold * 0.72f, gold, ease(0.2f, 0.7f, wave) * 0.5f + 0.5f * back);
        const float reds = ease(0.48f, 0.53f, wave * (0.62f + 0.5f * back));
        if (kind < 2) color = glm::mix(color, red, reds * ease(0.05f, 0.3f, back));
        if (kind == 1) color = glm::mix(color, black, ease(0.52f, 0.56f, second * (0.72f + 0.35f * back)));
        const float edge = ease(0.75f, 1.0f, scalesAt(u, v).y) * scaly(u, v);
        return Vector4f(color * (1 - 0.3f * edge), 1.0f);
    });
}

/// Roughness in green, metal in blue.
SceneImage surfaceMap(float metal) {
    return makeImage(metal > 0 ? "metal" : "skin", map_width / 4, map_height / 4, [metal](float u, float v) {
        const float scales = scaly(u, v);
        return Vector4f(1.0f, 0.3f + 0.12f * scales * scalesAt(u, v).y, metal * (0.35f + 0.65f * scales), 1.0f);
    });
}

/// The rays of fins; u across them, v outward.
SceneImage finMap() {
    return makeImage("fins", 256, 128, [](float u, float v) {
        const float ray = std::pow(0.5f + 0.5f * std::cos(2 * pi * 14 * u), 3.0f);
        const float edge = 1 - ease(0.9f, 1.0f, v + 0.05f * noise(u * 40, 0, 8, 5));
        const float body = std::lerp(0.95f, 0.32f, ease(0.0f, 0.7f, v));
        const Vector3f color =
            glm::mix(Vector3f(0.95f, 0.62f, 0.42f), Vector3f(0.97f, 0.92f, 0.86f), ease(0.0f, 0.45f, v));
        return Vector4f(color, std::clamp((body + 0.4f * ray * (1 - 0.5f * v)) * edge, 0.0f, 1.0f));
    });
}

// Joints and their animation.

Vector4f turnY(float angle) { return {0, std::sin(0.5f * angle), 0, std::cos(0.5f * angle)}; }

/// The angle of the body at a joint: a wave that runs to the tail and grows.
float bodyAngle(uint32_t joint, float time, float phase) {
    const float s = (static_cast<float>(joint) + 0.5f) * joint_step;
    const float amplitude = 0.1f + 0.62f * s * s;
    return amplitude * std::cos(2 * pi * (0.95f * s - time / beat) + phase);
}

/// The joint that carries another one: from the root to the nose and to the tail.
uint32_t parentOf(uint32_t joint) {
    if (joint >= spine_joints) return root_joint - 1;
    return joint < root_joint ? joint + 1 : joint - 1;
}

Vector3f pivotOf(uint32_t joint) {
    if (joint >= spine_joints) return {placeOf(0.25f), -0.1f, joint == spine_joints ? -0.13f : 0.13f};
    // Of joints before the root the end towards it, of the others the beginning.
    return {placeOf(static_cast<float>(joint < root_joint ? joint + 1 : joint) * joint_step), 0, 0};
}

SceneChannel channelOf(uint32_t node, ScenePath path, SceneInterpolation interpolation) {
    SceneChannel channel;
    channel.node = node;
    channel.path = path;
    channel.interpolation = interpolation;
    return channel;
}

void addKey(SceneChannel& channel, float time, const Vector4f& value) {
    channel.times.push_back(time);
    for (int i = 0; i < 4; i++) channel.values.push_back(value[i]);
}

/// A fish, which swims on a circle: its nodes, its skin and its channels.
void addFish(Scene& scene, uint32_t number) {
    const float phase = 2 * pi * static_cast<float>(number) / fish;
    const auto first = static_cast<uint32_t>(scene.nodes.size());
    const uint32_t circle = first, place = first + 1, shape = first + 2, joints = first + 3;
    scene.nodes.resize(first + 3 + joint_count);
    scene.roots.push_back(circle);
    scene.nodes[circle].name = "circle";
    scene.nodes[circle].children = {place, shape};
    scene.nodes[circle].transform.rotation = turnY(phase);
    scene.nodes[place].name = "place";
    // The nose is where the circle goes to.
    scene.nodes[place].transform = {
        {0.0f, -0.25f * static_cast<float>(number), 1.6f - 0.1f * static_cast<float>(number)},
        {0, 0, 0, 1},
        Vector3f(1.0f)};
    scene.nodes[place].children = {joints + root_joint};
    scene.nodes[shape].name = "koi";
    scene.nodes[shape].mesh = number;
    scene.nodes[shape].skin = number;
    SceneSkin& skin = scene.skins.emplace_back();
    SceneAnimation& animation = scene.animations[0];
    for (uint32_t j = 0; j < joint_count; j++) {
        SceneNode& node = scene.nodes[joints + j];
        const bool is_root = j == root_joint;
        node.name = "joint " + std::to_string(j);
        node.transform.translation = pivotOf(j) - (is_root ? Vector3f(0.0f) : pivotOf(parentOf(j)));
        if (!is_root) scene.nodes[joints + parentOf(j)].children.push_back(joints + j);
        skin.joints.push_back(joints + j);
        skin.inverse_bind.push_back(translate(-pivotOf(j)));

        if (j < spine_joints) {
            constexpr uint32_t keys = 12 * static_cast<uint32_t>(duration / beat);
            SceneChannel& turn =
                animation.channels.emplace_back(channelOf(joints + j, ScenePath::Rotation, SceneInterpolation::Linear));
            for (uint32_t k = 0; k <= keys; k++) {
                const float time = duration * static_cast<float>(k) / keys;
                const float carried = is_root ? 0.0f : bodyAngle(parentOf(j), time, phase);
                addKey(turn, time, turnY(bodyAngle(j, time, phase) - carried));
            }
        } else {
            // Breast fins beat slowly, at rest at each key: the tangents are 0.
            SceneChannel& flap = animation.channels.emplace_back(
                channelOf(joints + j, ScenePath::Rotation, SceneInterpolation::CubicSpline));
            const float side = j == spine_joints ? 1.0f : -1.0f;
            for (uint32_t k = 0; k <= 8; k++) {
                const float angle = side * (k % 2 ? 0.55f : -0.25f);
                flap.times.push_back(duration * static_cast<float>(k) / 8);
                flap.values.insert(flap.values.end(), {0, 0, 0, 0});
                flap.values.insert(flap.values.end(), {std::sin(0.5f * angle), 0, 0, std::cos(0.5f * angle)});
                flap.values.insert(flap.values.end(), {0, 0, 0, 0});
            }
        }
    }
    SceneChannel& round =
        animation.channels.emplace_back(channelOf(circle, ScenePath::Rotation, SceneInterpolation::Linear));
    for (uint32_t k = 0; k <= 4; k++)
        addKey(round, duration * static_cast<float>(k) / 4, turnY(phase + 2 * pi * static_cast<float>(k) / 4));
    SceneChannel& mouth =
        animation.channels.emplace_back(channelOf(shape, ScenePath::Weights, SceneInterpolation::Linear));
    for (uint32_t k = 0; k <= 16; k++) {
        mouth.times.push_back(duration * static_cast<float>(k) / 16);
        mouth.values.push_back((k + number) % 2 ? 1.0f : 0.0f);
    }
}

}  // namespace

Scene makeKoi() {
    Scene scene;
    const auto texture = [&](SceneImage image) {
        scene.images.push_back(std::move(image));
        SceneTexture& made = scene.textures.emplace_back();
        made.image = static_cast<uint32_t>(scene.images.size()) - 1;
        return SceneTextureUse{static_cast<uint32_t>(scene.textures.size()) - 1};
    };
    const SceneTextureUse scales = texture(normalMap());
    const SceneTextureUse skin = texture(surfaceMap(0.0f)), metal = texture(surfaceMap(0.9f));
    SceneMaterial fins;
    fins.name = "fins";
    fins.base_color_texture = texture(finMap());
    fins.metallic = 0.0f;
    fins.roughness = 0.45f;
    fins.alpha = SceneAlpha::Blend;
    fins.is_double_sided = true;
    SceneMaterial eyes;
    eyes.name = "eyes";
    eyes.base_color = {0.012f, 0.01f, 0.01f, 1.0f};
    eyes.metallic = 0.0f;
    eyes.roughness = 0.1f;
    scene.materials = {fins, eyes};
    scene.animations.push_back({"swim", {}});
    for (uint32_t number = 0; number < fish; number++) {
        SceneMaterial body;
        body.base_color_texture = texture(colorMap(number));
        body.name = scene.images.back().name;
        body.normal_texture = scales;
        body.metallic_roughness_texture = number == 2 ? metal : skin;
        scene.materials.push_back(body);
        const auto material = static_cast<uint32_t>(scene.materials.size()) - 1;
        scene.meshes.push_back({"koi", {makeBody(material), makeFins(0), makeEyes(1)}, {0.0f}});
        addFish(scene, number);
    }
    return scene;
}
