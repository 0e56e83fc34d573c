// Scenes that are filled by hand: what is refused, and by which rule what is not refused goes.

#include "support/matchers.h"
#include "support/reference.h"
#include "support/scene_reference.h"

#include <glint/format/scene.h>

#include <glm/geometric.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

using namespace glint;
using namespace glint::test;

namespace {

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

/// A node that turns or moves by the given keys.
Scene keyed(ScenePath path, SceneInterpolation interpolation, std::vector<float> times, std::vector<float> values) {
    Scene scene;
    scene.nodes.resize(1);
    scene.roots = {0};
    scene.animations.push_back({"", {{0, path, interpolation, std::move(times), std::move(values)}}});
    return scene;
}

/// A triangle of one joint, which scales by `scale`.
Scene scaledJoint(const Vector3f& scale) {
    Scene scene;
    scene.nodes.resize(2);
    scene.nodes[0].transform.scale = scale;
    scene.nodes[1].mesh = scene.nodes[1].skin = 0;
    scene.roots = {0, 1};
    scene.skins = {{"", {0}, {Matrix4x4f(1.0f)}}};
    ScenePrimitive primitive;
    primitive.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    primitive.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
    primitive.indices = {0, 1, 2};
    primitive.joints.assign(3, {0, 0, 0, 0});
    primitive.weights.assign(3, {1, 0, 0, 0});
    scene.meshes = {{"", {primitive}, {}}};
    return scene;
}

struct Broken {
    const char* id;
    const char* text;  ///< part of the message: the element
    std::function<void(Scene&)> spoil;
};

}  // namespace

TEST(SceneValidate, RandomScenesAreSound) {
    for (uint64_t seed = 0; seed < 20; seed++) EXPECT_THAT(randomScene(seed).validate(), IsOk()) << seed;
    EXPECT_THAT(Scene().validate(), IsOk());
}

TEST(SceneValidate, WhatIsWrongIsNamed) {
    const auto first = [](Scene& scene) -> ScenePrimitive& { return scene.meshes[0].primitives[0]; };
    const auto channel = [](Scene& scene, size_t i = 0) -> SceneChannel& { return scene.animations[0].channels[i]; };
    const Broken broken[] = {
        {"scene.attribute_count", "meshes[0].primitives[0]", [&](Scene& s) { first(s).positions.clear(); }},
        {"scene.attribute_count", "3 normals for 4", [&](Scene& s) { first(s).normals.pop_back(); }},
        {"scene.attribute_count", "texture", [&](Scene& s) { first(s).texcoords[1].resize(1); }},
        {"scene.attribute_count", "tangents", [&](Scene& s) { first(s).tangents.resize(5); }},
        {"scene.attribute_count", "colors", [&](Scene& s) { first(s).colors.resize(2); }},
        {"scene.attribute_count", "0 joints for 4 weights", [&](Scene& s) { first(s).joints.clear(); }},
        {"scene.attribute_count", "4 joints for 0 weights", [&](Scene& s) { first(s).weights.clear(); }},
        {"scene.attribute_count", "morphed", [&](Scene& s) { first(s).targets[0].normals.resize(9); }},
        {"scene.attribute_count", "5 indices", [&](Scene& s) { first(s).indices.pop_back(); }},
        {"scene.attribute_count", "targets for", [&](Scene& s) { s.meshes[0].weights.pop_back(); }},
        {"scene.attribute_count", "nodes[7]", [&](Scene& s) { s.nodes[7].weights.pop_back(); }},
        {"scene.attribute_count", "skins[0]", [&](Scene& s) { s.skins[0].inverse_bind.pop_back(); }},
        {"scene.attribute_count", "channels[0]", [&](Scene& s) { channel(s).values.pop_back(); }},
        {"scene.attribute_count", "channels[0]", [&](Scene& s) { channel(s).values.resize(2); }},
        {"scene.vertex_index", "index 5 is 4", [&](Scene& s) { first(s).indices[5] = 4; }},
        {"scene.joint_range", "joint 3 of skins[0], which has 3", [&](Scene& s) { first(s).joints[2][1] = 3; }},
        {"scene.weights", "weight 1 of vertex 2",
         [&](Scene& s) {
             first(s).weights[2] = {1.5f, -0.5f, 0, 0};
         }},
        {"scene.weights", "add up to 0", [&](Scene& s) { first(s).weights[0] = Vector4f(0.0f); }},
        {"scene.weights", "add up to 1.5",
         [&](Scene& s) {
             first(s).weights[0] = {1, 0.5f, 0, 0};
         }},
        {"scene.weights", "add up to",
         [&](Scene& s) {
             first(s).weights[0] = {1, 0x1.1p-16f, 0, 0};
         }},
        {"scene.not_finite", "weights of vertex 1", [&](Scene& s) { first(s).weights[1].x = not_a_number; }},
        {"scene.not_finite", "positions of vertex 3", [&](Scene& s) { first(s).positions[3].y = infinity; }},
        {"scene.not_finite", "morphed", [&](Scene& s) { first(s).targets[1].positions[0].z = not_a_number; }},
        {"scene.not_finite", "inverse bind matrix 2",
         [&](Scene& s) { s.skins[0].inverse_bind[2][1].y = not_a_number; }},
        {"scene.not_finite", "nodes[1]", [&](Scene& s) { s.nodes[1].transform.rotation.w = not_a_number; }},
        {"scene.not_finite", "nodes[3]", [&](Scene& s) { (*s.nodes[3].matrix)[3].x = infinity; }},
        {"scene.not_finite", "key 1 is at nan", [&](Scene& s) { channel(s).times[1] = not_a_number; }},
        {"scene.not_finite", "of key 0 is nan", [&](Scene& s) { channel(s, 2).values[1] = not_a_number; }},
        {"scene.key_order", "no keys",
         [&](Scene& s) {
             channel(s).times.clear();
             channel(s).values.clear();
         }},
        {"scene.key_order", "key 2", [&](Scene& s) { channel(s).times[2] = channel(s).times[1]; }},
        {"scene.channel", "two channels", [&](Scene& s) { s.animations[0].channels.emplace_back(channel(s)); }},
        {"scene.channel", "a matrix", [&](Scene& s) { channel(s).node = 3; }},
        {"scene.channel", "no morph targets",
         [&](Scene& s) {
             channel(s).path = ScenePath::Weights;
             channel(s).node = 5;
         }},
        {"scene.index_range", "material 0 of 0", [&](Scene& s) { first(s).material = 0; }},
        {"scene.index_range", "nodes[6]: mesh 2 of 2", [&](Scene& s) { s.nodes[6].mesh = 2; }},
        {"scene.index_range", "skin 1 of 1", [&](Scene& s) { s.nodes[6].skin = 1; }},
        {"scene.index_range", "camera", [&](Scene& s) { s.nodes[6].camera = 0; }},
        {"scene.index_range", "light", [&](Scene& s) { s.nodes[6].light = 0; }},
        {"scene.index_range", "child 8", [&](Scene& s) { s.nodes[5].children = {8}; }},
        {"scene.index_range", "joint's node", [&](Scene& s) { s.skins[0].joints[0] = scene_none; }},
        {"scene.index_range", "channels[0]", [&](Scene& s) { channel(s).node = 8; }},
        {"scene.index_range", "roots", [&](Scene& s) { s.roots[0] = 8; }},
        {"scene.index_range", "materials[0]: texture 3 of 0",
         [&](Scene& s) { s.materials.emplace_back().normal_texture.texture = 3; }},
        {"scene.index_range", "texture coordinates 2",
         [&](Scene& s) { s.materials.emplace_back().emission_texture.texcoord = 2; }},
        {"scene.index_range", "textures[0]: image", [&](Scene& s) { s.textures.emplace_back().image = 0; }},
        {"scene.tree", "child 7 is one of nodes[4]", [&](Scene& s) { s.nodes[6].children = {7}; }},
        {"scene.tree", "descendants", [&](Scene& s) { s.nodes[5].children = {0}; }},
        {"scene.tree", "has a parent", [&](Scene& s) { s.roots[0] = 1; }},
        {"scene.tree", "twice", [&](Scene& s) { s.roots[1] = s.roots[0]; }},
    };
    for (const Broken& each : broken) {
        Scene scene = randomScene(3);
        each.spoil(scene);
        const Status status = scene.validate();
        EXPECT_THAT(status, HasErrorId(each.id)) << each.text;
        EXPECT_NE(status.error().text().find(each.text), std::string::npos) << status.error().text();
    }
}

TEST(SceneValidate, WeightsMayBeOffByTheirRounding) {
    Scene scene = randomScene(1);
    Vector4f& weights = scene.meshes[0].primitives[0].weights[0];
    for (const float off : {0.0f, 0x1p-16f, -0x1p-16f}) {
        weights = {1.0f + off, 0, 0, 0};
        EXPECT_THAT(scene.validate(), IsOk()) << off;
    }
}

// What no channel, or no animation, moves is at rest; one key is one value at all times.
TEST(SceneValidate, NoKeysOneKeyAndNoAnimation) {
    Scene scene = keyed(ScenePath::Translation, SceneInterpolation::Linear, {2.0f}, {1, 2, 3});
    EXPECT_THAT(scene.validate(), IsOk());
    for (const float time : {-infinity, 0.0f, 2.0f, 9.0f, infinity, not_a_number})
        EXPECT_EQ(Vector3f(scene.pose(0, time).world[0][3]), Vector3f(1, 2, 3)) << time;
    EXPECT_EQ(scene.pose(1, 0.0f).world[0], Matrix4x4f(1.0f));
    EXPECT_EQ(scene.pose(scene_none, 0.0f).world[0], Matrix4x4f(1.0f));
    scene.animations[0].channels.clear();
    EXPECT_THAT(scene.validate(), IsOk());
    EXPECT_EQ(scene.pose(0, 1.0f).world[0], Matrix4x4f(1.0f));
    EXPECT_EQ(scene.animations[0].duration(), 0.0f);
}

// Keys of q and -q are the same turn: nothing moves between them, and from q to -r it goes as from q to r. Lengths do
// not matter. A quarter turn about Y, halfway, is an eighth: entries to 8 roundings of values of at most 2.
TEST(SceneValidate, QuaternionsOfAnySignAndLength) {
    const float h = std::sqrt(0.5f);
    for (const float sign : {1.0f, -1.0f})
        for (const float length : {1.0f, 0.125f, 700.0f}) {
            const float k = sign * length;
            const Scene same =
                keyed(ScenePath::Rotation, SceneInterpolation::Linear, {0, 1}, {0, h, 0, h, 0, k * h, 0, k * h});
            const Scene turn =
                keyed(ScenePath::Rotation, SceneInterpolation::Linear, {0, 1}, {0, 0, 0, 1, 0, k * h, 0, k * h});
            for (const Scene* scene : {&same, &turn}) EXPECT_THAT(scene->validate(), IsOk());
            const Vector3f x = Vector3f(same.pose(0, 0.5f).world[0][0]);
            EXPECT_NEAR(glm::length(x - Vector3f(0, 0, -1)), 0.0f, 16 * 0x1p-24f);
            const Vector3f half = Vector3f(turn.pose(0, 0.5f).world[0][0]);
            EXPECT_NEAR(glm::length(half - Vector3f(h, 0, -h)), 0.0f, 16 * 0x1p-24f) << k;
        }
}

// A joint that mirrors keeps normals on the outer side, as mirrored nodes do; one that flattens has a plane's normal.
TEST(SceneValidate, JointsOfNegativeAndNoScale) {
    for (const Vector3f& scale : {Vector3f(-1, 1, 1), Vector3f(1, 1, -1), Vector3f(-2, -3, -1), Vector3f(2, 3, 0)}) {
        const Scene scene = scaledJoint(scale);
        EXPECT_THAT(scene.validate(), IsOk());
        const Expected<Mesh> mesh = scene.mesh(scene.pose());
        ASSERT_THAT(mesh, IsOk());
        EXPECT_EQ(mesh->positions[1], Vector3f(scale.x, 0, 0));
        const Vector3f normal = scale.z < 0 ? Vector3f(0, 0, -1) : Vector3f(0, 0, 1);
        EXPECT_EQ(mesh->normals[0], normal) << scale.x << " " << scale.y << " " << scale.z;
    }
}
