#include "support/matchers.h"
#include "support/reference.h"
#include "support/scene_reference.h"

#include <glint/base/log.h>
#include <glint/format/scene.h>

#include <glm/geometric.hpp>

#include <gtest/gtest.h>

using namespace glint;
using namespace glint::test;

namespace {

float uniform(Random& random, double low, double high) { return static_cast<float>(random.uniform(low, high)); }

Vector3f vector(Random& random, double size) {
    return {uniform(random, -size, size), uniform(random, -size, size), uniform(random, -size, size)};
}

Vector4f quaternion(Random& random) {
    const Vector3f xyz = vector(random, 1.0);
    return {xyz, uniform(random, -1, 1)};
}

template <class T>
void expectWithin(const T& value, const Bounded<Vector3d>& reference, double& largest, const char* what) {
    for (int k = 0; k < 3; k++) {
        const double error = std::fabs(value[k] - reference.value[k]);
        EXPECT_LE(error, reference.bound[k]) << what;
        largest = std::max(largest, error / std::max(reference.bound[k], 1e-300));
    }
}

/// Two triangles without joints, with two morph targets.
ScenePrimitive squareOf(uint64_t seed) { return randomScene(seed).meshes[1].primitives[0]; }

Scene nodeWith(SceneChannel channel) {
    Scene scene;
    scene.nodes.resize(1);
    scene.roots = {0};
    channel.node = 0;
    scene.animations.push_back({"", {std::move(channel)}});
    return scene;
}

Vector3f translationAt(const Scene& scene, float time) { return Vector3f(scene.pose(0, time).world[0][3]); }

/// The quaternion of a rotation matrix, to a sign: the eigenvector that its four diagonal sums say is safe.
Vector4d quaternionOf(const Matrix4x4d& m) {
    const double squares[4] = {1 + m[0][0] - m[1][1] - m[2][2], 1 - m[0][0] + m[1][1] - m[2][2],
                               1 - m[0][0] - m[1][1] + m[2][2], 1 + m[0][0] + m[1][1] + m[2][2]};
    const auto largest = std::max_element(squares, squares + 4) - squares;
    Vector4d q;
    switch (largest) {
        case 0: q = {squares[0], m[0][1] + m[1][0], m[2][0] + m[0][2], m[1][2] - m[2][1]}; break;
        case 1: q = {m[0][1] + m[1][0], squares[1], m[1][2] + m[2][1], m[2][0] - m[0][2]}; break;
        case 2: q = {m[2][0] + m[0][2], m[1][2] + m[2][1], squares[2], m[0][1] - m[1][0]}; break;
        default: q = {m[1][2] - m[2][1], m[2][0] - m[0][2], m[0][1] - m[1][0], squares[3]}; break;
    }
    return glm::normalize(q);
}

}  // namespace

// The reference carries the bound: see scene_reference.cpp.
TEST(Scene, PosesAreThoseOfFloat64) {
    double largest_world = 0, largest_position = 0, largest_normal = 0;
    for (uint64_t seed = 0; seed < 60; seed++) {
        const Scene scene = randomScene(seed);
        Random random(1000 + seed);
        for (int run = 0; run < 12; run++) {
            const bool at_rest = run == 0;
            const float time = uniform(random, -0.5, 5.5);
            const ScenePose pose = at_rest ? scene.pose() : scene.pose(0, time);
            const ReferencePose reference = referencePose(scene, at_rest ? scene_none : 0, time);
            for (size_t i = 0; i < scene.nodes.size(); i++)
                for (int column = 0; column < 4; column++) {
                    expectWithin(
                        Vector3d(pose.world[i][column]),
                        {Vector3d(reference.world[i].value[column]), Vector3d(reference.world[i].bound[column])},
                        largest_world, "world");
                    EXPECT_EQ(pose.world[i][column].w, column == 3 ? 1.0f : 0.0f);
                }
            const Expected<Mesh> mesh = scene.mesh(pose);
            ASSERT_THAT(mesh, IsOk());
            const ReferenceMesh expected = referenceMesh(scene, reference);
            ASSERT_EQ(mesh->positions.size(), expected.positions.size());
            ASSERT_EQ(mesh->normals.size(), expected.normals.size());
            for (size_t i = 0; i < expected.positions.size(); i++) {
                expectWithin(mesh->positions[i], expected.positions[i], largest_position, "position");
                expectWithin(mesh->normals[i], expected.normals[i], largest_normal, "normal");
            }
        }
    }
    // Bounds that are much too wide would find nothing. Errors add up at random, bounds do not, so that what comes out
    // of six matrices is off by a small part of its bound.
    std::printf("largest errors, in bounds: world %.3f, positions %.3f, normals %.3f\n", largest_world,
                largest_position, largest_normal);
    EXPECT_GT(largest_world, 1e-3);
    EXPECT_GT(largest_position, 1e-3);
    EXPECT_GT(largest_normal, 1e-3);
}

// Keys that are close together, and keys that are close but for their sign, which is the same rotation.
TEST(Scene, RotationsBetweenCloseKeys) {
    for (const double angle : {0.0, 1e-30, 1e-9, 1e-7, 1e-5, 1e-3, 0.1, 1.0, 3.0})
        for (const float sign : {1.0f, -1.0f})
            for (const float t : {0.0f, 0.125f, 0.5f, 0.875f}) {
                const Vector4f a(0.5f, 0.5f, 0.5f, 0.5f);
                // A turn by `angle` about z, after a.
                const double s = std::sin(angle / 2), c = std::cos(angle / 2);
                const Vector4f b(Vector4d(0.5 * c - 0.5 * s, 0.5 * c + 0.5 * s, 0.5 * c + 0.5 * s, 0.5 * c - 0.5 * s));
                const Scene scene = nodeWith({0,
                                              ScenePath::Rotation,
                                              SceneInterpolation::Linear,
                                              {0, 1},
                                              {a.x, a.y, a.z, a.w, sign * b.x, sign * b.y, sign * b.z, sign * b.w}});
                const double st = std::sin(t * angle / 2), ct = std::cos(t * angle / 2);
                const Vector4d expected(0.5 * (ct - st), 0.5 * (ct + st), 0.5 * (ct + st), 0.5 * (ct - st));
                Vector4d q = quaternionOf(Matrix4x4d(scene.pose(0, t).world[0]));
                if (glm::dot(q, expected) < 0.0) q = -q;
                // 64 roundings of the interpolation (scene_reference.cpp) and 18 of each entry of the matrix, of whose
                // three sums of four a component is made.
                EXPECT_LT(glm::length(q - expected), (64 + 2 * 18) * 0x1p-24) << angle << " " << sign << " " << t;
            }
}

TEST(Scene, RotationsThatAreNone) {
    const Vector4f zero(0.0f);
    EXPECT_EQ((SceneTransform{{1, 2, 3}, zero, {2, 2, 2}}).matrix(), translate({1, 2, 3}) * scale({2, 2, 2}));
    EXPECT_EQ((SceneTransform{{}, {0, 0, 1e30f, 0}, {1, 1, 1}}).matrix()[0], Vector4f(-1, 0, 0, 0));
    EXPECT_EQ((SceneTransform{{}, {0, 0, 1e-40f, 0}, {1, 1, 1}}).matrix()[0], Vector4f(-1, 0, 0, 0));
    // A spline through zero: from (0, 0, 0, 1) to (0, 0, 0, -1) without tangents.
    const Scene spline = nodeWith(
        {0, ScenePath::Rotation, SceneInterpolation::CubicSpline, {0, 1}, {0, 0, 0, 0, 0, 0, 0, 1,  0, 0, 0, 0,
                                                                           0, 0, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0}});
    EXPECT_EQ(spline.pose(0, 0.5f).world[0], Matrix4x4f(1.0f));
}

TEST(Scene, TimesBeforeBetweenAndAfterKeys) {
    using enum SceneInterpolation;
    const Scene linear = nodeWith({0, ScenePath::Translation, Linear, {1, 2, 4}, {0, 0, 0, 8, 0, 0, 16, 2, 0}});
    const Scene step = nodeWith({0, ScenePath::Translation, Step, {1, 2, 4}, {0, 0, 0, 8, 0, 0, 16, 2, 0}});
    constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    for (const Scene* scene : {&linear, &step}) {
        for (const float time : {-infinity, -1.0f, 0.0f, 1.0f, nan})
            EXPECT_EQ(translationAt(*scene, time), Vector3f(0, 0, 0)) << time;
        EXPECT_EQ(translationAt(*scene, 2.0f), Vector3f(8, 0, 0));
        for (const float time : {4.0f, 4.1f, infinity}) EXPECT_EQ(translationAt(*scene, time), Vector3f(16, 2, 0));
    }
    EXPECT_EQ(translationAt(linear, 1.25f), Vector3f(2, 0, 0));
    EXPECT_EQ(translationAt(linear, 3.0f), Vector3f(12, 1, 0));
    EXPECT_EQ(translationAt(step, 1.999f), Vector3f(0, 0, 0));
    EXPECT_EQ(translationAt(step, 3.999f), Vector3f(8, 0, 0));
    EXPECT_EQ(linear.animations[0].duration(), 4.0f);
    EXPECT_EQ(SceneAnimation().duration(), 0.0f);
    const Scene single = nodeWith({0, ScenePath::Translation, Linear, {1}, {3, 4, 5}});
    for (const float time : {0.0f, 1.0f, 2.0f}) EXPECT_EQ(translationAt(single, time), Vector3f(3, 4, 5));
}

// Hermite's spline by hand: value 1 to 3 in 2 seconds, leaving at 4 and arriving at -2 a second. At half time
// (1 + 3) / 2 + 2 * (4 - -2) / 8 = 3.5.
TEST(Scene, CubicSplinesHaveTheirTangents) {
    const Scene scene = nodeWith({0,
                                  ScenePath::Translation,
                                  SceneInterpolation::CubicSpline,
                                  {1, 3},
                                  {9, 9, 9, 1, 0, 0, 4, 0, 0, -2, 0, 0, 3, 0, 0, 9, 9, 9}});
    EXPECT_EQ(translationAt(scene, 1.0f).x, 1.0f);
    EXPECT_EQ(translationAt(scene, 3.0f).x, 3.0f);
    EXPECT_EQ(translationAt(scene, 2.0f).x, 3.5f);
    EXPECT_EQ(translationAt(scene, 0.0f).x, 1.0f) << "the value, not the tangent";
    // Its slope at the first key, over 1/1024 s, but for the second-order term (6 (3 - 1) / 4 - (2 * 2 * 4 - 2 * 2) /
    // 2) / 2 = -1.5 and roundings of values near 1.
    const float slope = (translationAt(scene, 1.0f + 0x1p-10f).x - 1.0f) * 0x1p10f;
    EXPECT_NEAR(slope, 4.0f, 2.0f * 0x1p-10f + 0x1p10f * 16 * 0x1p-24f);
}

TEST(Scene, MirroringNodesKeepFrontFaces) {
    Random random(5);
    Scene scene;
    ScenePrimitive primitive;
    primitive.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    primitive.normals.assign(3, {0, 0, 1});
    primitive.indices = {0, 1, 2};
    scene.meshes = {{"m", {primitive}, {}}};
    for (int run = 0; run < 200; run++) {
        Vector3f factors = Vector3f(1.5f) + vector(random, 1.0);
        for (int k = 0; k < 3; k++)
            if (random.below(2)) factors[k] = -factors[k];
        scene.nodes = {SceneNode{.transform = {vector(random, 3.0), quaternion(random), factors}, .mesh = 0}};
        scene.roots = {0};
        const Expected<Mesh> mesh = scene.mesh(scene.pose());
        ASSERT_THAT(mesh, IsOk());
        const Vector3f& a = mesh->positions[mesh->indices[0]];
        const Vector3f front = glm::cross(mesh->positions[mesh->indices[1]] - a, mesh->positions[mesh->indices[2]] - a);
        // Shading and geometric normal agree, so both are turned or neither is: the triangle is at least 0.5 long, and
        // its corners are off by less than 1e-5.
        EXPECT_GT(glm::dot(glm::normalize(front), mesh->normals[0]), 0.999f);
    }
}

TEST(Scene, PartsNameNodesAndMaterials) {
    Random random(6);
    Scene scene;
    ScenePrimitive first = squareOf(3), second = squareOf(4);
    for (ScenePrimitive* each : {&first, &second}) each->targets.clear();
    second.material = 3;
    second.indices.resize(3);
    scene.meshes = {{"mesh", {first, second}, {}}};
    scene.nodes.resize(4);
    scene.nodes[0].children = {2, 1};
    scene.nodes[1] = {.name = "node", .mesh = 0};
    scene.nodes[2].mesh = 0;
    scene.nodes[3].mesh = 0;
    scene.roots = {0};
    const Expected<Mesh> mesh = scene.mesh(scene.pose());
    ASSERT_THAT(mesh, IsOk());
    EXPECT_EQ(mesh->parts,
              (std::vector<MeshPart>{
                  {"mesh", 0, 6, UINT32_MAX}, {"mesh", 6, 3, 3}, {"node", 9, 6, UINT32_MAX}, {"node", 15, 3, 3}}))
        << "node 3 is not shown";
    EXPECT_EQ(mesh->texcoords.size(), 16u);
    EXPECT_EQ(mesh->texcoords[4], second.texcoords[0][0]);
    EXPECT_EQ(mesh->indices[6], 4u);
}

TEST(Scene, PartialAttributesAreDroppedWithAWarning) {
    Random random(6);
    Scene scene;
    scene.meshes = {{"", {squareOf(5), squareOf(6)}, {0, 0}}};
    scene.nodes = {SceneNode{.mesh = 0}};
    scene.roots = {0};
    scene.meshes[0].primitives[1].normals.clear();
    std::string ids;
    setLogCallback([&](LogLevel, std::string_view id, std::string_view) { ids += id; });
    const Expected<Mesh> mesh = scene.mesh(scene.pose());
    setLogCallback({});
    ASSERT_THAT(mesh, IsOk());
    EXPECT_TRUE(mesh->normals.empty());
    EXPECT_EQ(mesh->texcoords.size(), 8u);
    EXPECT_EQ(ids, "mesh.attribute_dropped");
}

TEST(Scene, MeshesThatCannotBe) {
    Scene scene;
    EXPECT_THAT(scene.mesh(scene.pose()), HasErrorId("mesh.no_faces"));
    scene.meshes = {{"", {squareOf(6)}, {0, 0}}};
    scene.nodes = {SceneNode{.mesh = 0}};
    EXPECT_THAT(scene.mesh(scene.pose()), HasErrorId("mesh.no_faces")) << "nothing is shown";
    scene.roots = {0};
    // Four vertices of 32 bytes, six indices, a part.
    const uint64_t size = 4 * 32 + 6 * 4 + sizeof(MeshPart);
    EXPECT_THAT(scene.mesh(scene.pose(), size), IsOk());
    EXPECT_THAT(scene.mesh(scene.pose(), size - 1), HasErrorId("mesh.too_large"));
    scene.nodes[0].transform.scale = {3e38f, 3e38f, 3e38f};
    EXPECT_THAT(scene.mesh(scene.pose()), HasErrorId("mesh.not_finite"));
}
