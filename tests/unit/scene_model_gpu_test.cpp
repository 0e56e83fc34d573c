// Scenes on a device: skinned and morphed vertices against float64, textures, and what is refused.

#include "support/device_fixture.h"
#include "support/scene_reference.h"

#include <glint/graphics/scene_model.h>

#include <glm/geometric.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

namespace glint::test {

namespace {

constexpr uint32_t columns = 16;  // of the picture: vertices of an item
constexpr uint32_t rows = 16;     // items

constexpr uint32_t stride = 88;
const SceneModel::Layout layout = {{Pipeline::AttributePosition, FormatRGBf32, 0, 0, stride},
                                   {Pipeline::AttributeNormal, FormatRGBf32, 0, 12, stride},
                                   {Pipeline::AttributeTangent, FormatRGBAf32, 0, 24, stride},
                                   {Pipeline::AttributeJoints, FormatRGBAu16, 0, 40, stride},
                                   {Pipeline::AttributeWeights, FormatRGBAf32, 0, 48, stride},
                                   {Pipeline::AttributeTexCoord, FormatRGf32, 0, 64, stride},
                                   {Pipeline::AttributeColor, FormatRGBAf32, 0, 72, stride}};

// A vertex becomes the pixel of its number in the row of its item.
constexpr const char* vertex_shader = R"(
#include <glint/skin.h>
layout(std430, row_major, set = 0, binding = 0) readonly buffer Transforms { mat4x3 transforms[]; };
layout(std430, set = 0, binding = 1) readonly buffer Weights { float target_weights[]; };
layout(std430, set = 0, binding = 2) readonly buffer Targets { float targets[]; };
layout(push_constant) uniform Item {
    uint first_transform, joint_step, first_weight, target_count, first_target, vertex_count;
    float row;
};
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tangent;
layout(location = 3) in uvec4 joints;
layout(location = 4) in vec4 weights;
layout(location = 0) flat out vec3 world_position;
layout(location = 1) flat out vec3 world_normal;
layout(location = 2) flat out vec4 world_tangent;
void main() {
    vec3 p = position, n = normal;
    for (uint k = 0u; k < target_count; k++) {
        const float weight = target_weights[first_weight + k];
        const uint record = 9u * (first_target + k * vertex_count + uint(gl_VertexIndex));
        p += weight * vec3(targets[record], targets[record + 1u], targets[record + 2u]);
        n += weight * vec3(targets[record + 3u], targets[record + 4u], targets[record + 5u]);
    }
    const uvec4 at = first_transform + joint_step * joints;
    const mat4x3 skin = glintSkin(transforms[at.x], transforms[at.y], transforms[at.z], transforms[at.w], weights);
    world_position = glintTransformPoint(skin, p);
    world_normal = glintTransformNormal(skin, n);
    world_tangent = glintTransformTangent(skin, tangent);
    gl_Position = vec4((float(gl_VertexIndex) + 0.5) / 8.0 - 1.0, 1.0 - (row + 0.5) / 8.0, 0.5, 1.0);
    gl_PointSize = 1.0;
}
)";
constexpr const char* fragment_shader = R"(
layout(location = 0) flat in vec3 world_position;
layout(location = 1) flat in vec3 world_normal;
layout(location = 2) flat in vec4 world_tangent;
layout(location = 0) out vec4 shown_position;
layout(location = 1) out vec4 shown_normal;
layout(location = 2) out vec4 shown_tangent;
void main() {
    shown_position = vec4(world_position, 1.0);
    shown_normal = vec4(world_normal, 1.0);
    shown_tangent = world_tangent;
}
)";

struct Push {
    SceneModel::Vertices vertices;
    float row;
};

class SceneModelTest : public DeviceTest {
protected:
    void SetUp() override {
        DeviceTest::SetUp();
        if (!device) return;
        pipeline = device.createPipeline("points");
        for (const Pipeline::VertexAttribute& a : layout)
            pipeline.addAttribute(a.attribute, a.format, a.buffer, a.offset, a.stride);
        pipeline.setPrimitive(Pipeline::PrimitivePoint);
        for (uint32_t i = 0; i < 3; i++) {
            pipeline.setColorFormat(FormatRGBAf32, i);
            seen[i] = device.createTexture2D(FormatRGBAf32, columns, rows, Texture::FlagTarget, "seen");
            target = i ? target : device.createTarget(seen[0]);
            target.setColorTexture(i, seen[i]);
        }
        pipeline.createShaderGLSL(Shader::TypeVertex, vertex_shader);
        pipeline.createShaderGLSL(Shader::TypeFragment, fragment_shader);
        ASSERT_THAT(pipeline.create(), IsOk());
    }

    /// Draws all items: positions, normals, tangents, `columns` for each item.
    std::array<std::vector<Vector4f>, 3> draw(const SceneModel& model) {
        Command command = device.createCommand(target);
        command.setPipeline(pipeline);
        command.setStorageBuffers(0, {model.getTransforms(), model.getWeights(), model.getTargets()});
        float row = 0;
        for (const SceneModel::Item& item : model.getItems()) {
            command.setPushConstants(Push{item.vertices, row++});
            model.draw(command, item);
        }
        EXPECT_THAT(device.submit(command), IsOk());
        std::array<std::vector<Vector4f>, 3> result;
        for (uint32_t i = 0; i < 3; i++) {
            result[i].resize(columns * rows);
            EXPECT_THAT(device.getTexture(seen[i], result[i].data(), result[i].size() * sizeof(Vector4f)), IsOk());
        }
        return result;
    }

    Pipeline pipeline;
    std::array<Texture, 3> seen;
    Target target;
};

/// Mirrors what some joints carry, and turns the sign of quaternions from key to key.
void makeHard(Scene& scene) {
    for (SceneChannel& channel : scene.animations[0].channels) {
        if (channel.interpolation == SceneInterpolation::CubicSpline) continue;
        if (channel.path == ScenePath::Scale && channel.node % 2 == 0)
            for (size_t i = 0; i < channel.values.size(); i += 3) channel.values[i] = -channel.values[i];
        if (channel.path == ScenePath::Rotation)
            for (size_t i = 4; i < channel.values.size(); i += 8)
                for (size_t k = 0; k < 4; k++) channel.values[i + k] = -channel.values[i + k];
    }
}

/// A vertex of an item by the pose's own float32 matrices, in float64. A target takes a product and a sum, so two take
/// less than 5 roundings of at most the sum of magnitudes; four products and sums of matrices 4, as many of the point
/// 4, the translation's sum 1: 14 in all.
Bounded<Vector3d> placed(const Scene& scene, const ScenePose& pose, const SceneModel::Item& item, size_t vertex) {
    const SceneNode& node = scene.nodes[item.node];
    const ScenePrimitive& primitive = scene.meshes[item.mesh].primitives[item.primitive];
    Vector3d p(primitive.positions[vertex]), size = glm::abs(p);
    for (size_t k = 0; k < primitive.targets.size(); k++) {
        if (primitive.targets[k].positions.empty()) continue;
        const Vector3d step = double{pose.weights[item.node][k]} * Vector3d(primitive.targets[k].positions[vertex]);
        p += step;
        size += glm::abs(step);
    }
    Bounded<Vector3d> result;
    const bool is_skinned = node.skin != scene_none && !primitive.joints.empty();
    const std::vector<Matrix4x4f> joints =
        is_skinned ? scene.jointMatrices(pose, node.skin) : std::vector<Matrix4x4f>{pose.world[item.node]};
    for (int k = 0; k < (is_skinned ? 4 : 1); k++) {
        const Matrix4x4d m(joints[is_skinned ? primitive.joints[vertex][static_cast<size_t>(k)] : 0]);
        const double weight = is_skinned ? primitive.weights[vertex][k] : 1.0;
        result.value += weight * Vector3d(m * Vector4d(p, 1.0));
        for (int c = 0; c < 4; c++)
            result.bound += weight * 14 * 0x1.01p-24 * glm::abs(Vector3d(m[c])) * (c < 3 ? size[c] : 1.0);
    }
    return result;
}

}  // namespace

// Positions: the shader's sums have the roundings of the host's, whose bound scene_reference.cpp derives (Vulkan rounds
// products and sums once, or leaves out the product's). Normals: GlintUnit scales by a power of two, squares (3
// roundings, half of them after the root), takes the root (4.5 ulp = 9: an inverse root of 2 ulp and a quotient of 2.5)
// and divides (2.5 ulp = 5): 16 in all. A cofactor takes 2 and the product and the two sums 3 more: 16 + 2 + 3 < 22 for
// each product, and 16 once more at the end. Denormal numbers may be flushed.
TEST_F(SceneModelTest, VerticesAreThoseOfFloat64) {
    double largest_position = 0, largest_stage = 0, largest_normal = 0;
    for (uint64_t seed = 0; seed < 24; seed++) {
        Scene scene = randomScene(seed);
        if (seed % 2) makeHard(scene);
        SceneModel model(device, pipeline, scene);
        ASSERT_THAT(model, IsOk());
        ASSERT_EQ(model.getItems().size(), 2u);
        EXPECT_EQ(model.getJoints(), 3u);
        for (const float time : {-1.0f, 0.7f, 1.9f, 3.3f, 9.0f}) {
            const ScenePose pose = scene.pose(0, time);
            ASSERT_THAT(model.setPose(pose), IsOk());
            const auto shown = draw(model);
            const ReferenceMesh reference =
                referenceMesh(scene, referencePose(scene, 0, time), {.products = 22, .unit = 16});
            ASSERT_EQ(reference.positions.size(), 8u);
            for (size_t i = 0; i < 8; i++) {
                // Four vertices each, in the order of the walk.
                const size_t pixel = i / 4 * columns + i % 4;
                ASSERT_EQ(shown[0][pixel].w, 1.0f);
                const Bounded<Vector3d> by_matrices = placed(scene, pose, model.getItems()[i / 4], i % 4);
                for (int k = 0; k < 3; k++) {
                    const Bounded<Vector3d>& p = reference.positions[i];
                    const double error = std::fabs(shown[0][pixel][k] - p.value[k]);
                    EXPECT_LE(error, p.bound[k] + 0x1p-120) << seed << " " << time << " vertex " << i;
                    largest_position = std::max(largest_position, error / p.bound[k]);
                    const double stage = std::fabs(shown[0][pixel][k] - by_matrices.value[k]);
                    EXPECT_LE(stage, by_matrices.bound[k] + 0x1p-120) << seed << " " << time << " vertex " << i;
                    largest_stage = std::max(largest_stage, stage / by_matrices.bound[k]);
                    const Bounded<Vector3d>& n = reference.normals[i];
                    const double turned = std::fabs(shown[1][pixel][k] - n.value[k]);
                    EXPECT_LE(turned, n.bound[k] + 0x1p-120) << seed << " " << time << " normal " << i;
                    largest_normal = std::max(largest_normal, turned / n.bound[k]);
                }
            }
        }
    }
    std::printf("largest errors, in bounds: positions %.3f, by the pose's matrices %.3f, normals %.4f\n",
                largest_position, largest_stage, largest_normal);
    // A bound that is far away says nothing.
    EXPECT_GT(largest_position, 0.01);
    EXPECT_GT(largest_stage, 0.1);
    EXPECT_GT(largest_normal, 0.0004);
}

TEST_F(SceneModelTest, PosesAreOfTheListsThatFollow) {
    Scene scene = randomScene(5);
    SceneModel model(device, layout, scene);
    ASSERT_THAT(model, IsOk());
    const auto rest = draw(model)[0];
    ASSERT_THAT(model.setPose(scene.pose(0, 2.5f)), IsOk());
    const auto moved = draw(model)[0];
    EXPECT_NE(rest[0], moved[0]);
    ASSERT_THAT(model.setPose(scene.pose()), IsOk());
    EXPECT_EQ(draw(model)[0], rest);
    // A copy shares what is on the device.
    SceneModel copy = model;
    ASSERT_THAT(copy.setPose(scene.pose(0, 2.5f)), IsOk());
    EXPECT_EQ(draw(model)[0], moved);
}

TEST_F(SceneModelTest, SkinsThatANodeOrAPrimitiveLacks) {
    // A mesh of joints under a node without a skin, and a skin over a primitive without joints: both follow their node.
    Scene scene = randomScene(7);
    scene.nodes[6].skin = scene_none;
    scene.nodes[7].skin = 0;
    SceneModel model(device, layout, scene);
    ASSERT_THAT(model, IsOk());
    const auto shown = draw(model);
    const ReferenceMesh reference = referenceMesh(scene, referencePose(scene, scene_none, 0.0f));
    for (size_t i = 0; i < 8; i++) {
        const Vector3f p(shown[0][i / 4 * columns + i % 4]);
        for (int k = 0; k < 3; k++)
            // The blend of one matrix by four weights rounds five times more.
            EXPECT_NEAR(p[k], reference.positions[i].value[k], reference.positions[i].bound[k] + 8 * 0x1p-24 * 64.0);
    }
}

TEST_F(SceneModelTest, TangentsAreMadeWhereANormalMapIs) {
    Scene scene;
    ScenePrimitive square;
    for (const float y : {0.0f, 1.0f})
        for (const float x : {0.0f, 1.0f}) {
            square.positions.emplace_back(x, y, 0);
            square.normals.emplace_back(0, 0, 1);
            square.texcoords[0].emplace_back(1 - x, 1 - y);
        }
    square.indices = {0, 1, 2, 2, 1, 3};
    square.material = 0;
    ScenePrimitive plain = square;
    plain.material = scene_none;
    ScenePrimitive given = square;
    given.tangents.assign(4, {0, 1, 0, 1});
    scene.meshes = {{"squares", {square, plain, given}, {}}};
    scene.images = {{"gray", *Image::create(FormatRu8n, 2, 2)}};
    scene.images[0].image.store(0, 0, {1, 0, 0, 0});
    scene.textures.emplace_back().image = 0;
    scene.materials.emplace_back();
    scene.materials[0].normal_texture.texture = 0;
    scene.materials[0].alpha = SceneAlpha::Blend;
    scene.nodes.resize(1);
    scene.nodes[0].mesh = 0;
    scene.nodes[0].transform.scale = {1, 1, -1};
    scene.roots = {0};
    SceneModel model(device, pipeline, scene, "squares");
    ASSERT_THAT(model, IsOk());
    ASSERT_EQ(model.getItems().size(), 3u);
    EXPECT_EQ(model.getTriangles(), 6u);
    EXPECT_EQ(model.getItems()[0].primitive, 1u) << "what blends comes last";
    EXPECT_EQ(model.getItems()[1].primitive, 0u);
    const auto shown = draw(model);
    EXPECT_EQ(Vector3f(shown[2][4]), Vector3f(0.0f)) << "no map, no tangent";
    EXPECT_EQ(shown[2][1 * columns], Vector4f(-1, 0, 0, 1)) << "u grows to the left, and the mirror turns w";
    EXPECT_EQ(shown[2][2 * columns + 8], Vector4f(0, 1, 0, -1)) << "those of the file are kept";

    // The gray image is gray in all channels, and there in the way that the material reads it alone.
    const SceneTextureUse& use = scene.materials[0].normal_texture;
    EXPECT_FALSE(model.getTexture(use, true));
    EXPECT_FALSE(model.getTexture({}, false));
    EXPECT_TRUE(model.getSampler({}));
    EXPECT_TRUE(model.getSampler(use));
    const Texture& texture = model.getTexture(use, false);
    ASSERT_TRUE(texture);
    EXPECT_EQ(texture.getMipmaps(), 2u);
    EXPECT_EQ(model.getTextureSize(), 20u);
    std::array<std::array<uint8_t, 4>, 4> texels;
    ASSERT_THAT(device.getTexture(texture, texels.data(), sizeof(texels)), IsOk());
    EXPECT_EQ(texels[0], (std::array<uint8_t, 4>{255, 255, 255, 255}));
    EXPECT_EQ(texels[3], (std::array<uint8_t, 4>{0, 0, 0, 255}));
}

TEST_F(SceneModelTest, WhatIsRefused) {
    const Scene scene = randomScene(2);
    expectError("model.no_items", [&] { return SceneModel(device, layout, Scene()).error(); });
    expectError("model.layout", [&] { return SceneModel(device, SceneModel::Layout(), scene).error(); });
    expectError("handle.null", [&] { return SceneModel(device, Pipeline(), scene).error(); });
    EXPECT_EQ(SceneModel(Device(), layout, scene).error().id(), "handle.null");
    EXPECT_EQ(SceneModel().error().id(), "handle.null");
    Scene broken = scene;
    broken.meshes[0].primitives[0].weights[0].x = -1.0f;
    expectError("scene.weights", [&] { return SceneModel(device, layout, broken).error(); });

    SceneModel model(device, layout, scene);
    ASSERT_THAT(model, IsOk());
    ScenePose pose = scene.pose();
    pose.weights[6].pop_back();
    expectError("model.pose", [&] { return model.setPose(pose); });
    expectError("model.pose", [&] { return model.setPose(ScenePose()); });
    expectError("model.item", [&] {
        Command command = device.createCommand(target);
        command.setPipeline(pipeline);
        model.draw(command, {.mesh = 9});
        return command.end();
    });
    EXPECT_EQ(draw(model)[0][0].w, 1.0f) << "the model is as it was";
}

}  // namespace glint::test
