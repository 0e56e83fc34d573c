#include "support/files.h"
#include "support/gltf_builder.h"
#include "support/matchers.h"

#include <glint/base/file.h>
#include <glint/base/log.h>
#include <glint/format/gltf.h>

#include <glm/geometric.hpp>

#include <gtest/gtest.h>

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#endif
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#include <stb/stb_image_write.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

using namespace glint;
using namespace glint::test;
using nlohmann::json;

namespace {

Expected<Scene> parse(const std::string& text, const GltfOptions& options = {}) {
    return parseGltf(std::as_bytes(std::span(text)), options);
}

const std::vector<float> corner = {0, 0, 0, 1, 0, 0, 0, 1, 0};
const std::vector<float> square = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};

/// A document with one triangle, shown.
GltfBuilder triangle() {
    GltfBuilder builder;
    builder.node({{"mesh", builder.mesh(corner)}});
    return builder;
}

/// What is logged while it lives: ids, one after the other.
class Warnings {
public:
    Warnings() {
        setLogCallback([this](LogLevel, std::string_view id, std::string_view text) {
            (ids += id) += ' ';
            last = text;
        });
    }
    ~Warnings() { setLogCallback({}); }
    std::string ids;
    std::string last;
};

Image chequers() {
    Image image = Image::create(FormatRGBAu8n, 4, 2).value();
    for (uint32_t y = 0; y < 2; y++)
        for (uint32_t x = 0; x < 4; x++) image.store(x, y, (x + y) % 2 ? Vector4f(1, 0, 0, 1) : Vector4f(0, 0, 1, 1));
    return image;
}

std::vector<std::byte> jpegOf(const std::vector<uint8_t>& rgb, int width, int height) {
    std::vector<std::byte> bytes;
    const auto write = [](void* context, void* data, int size) {
        auto* out = static_cast<std::vector<std::byte>*>(context);
        const auto* first = static_cast<const std::byte*>(data);
        out->insert(out->end(), first, first + size);
    };
    stbi_write_jpg_to_func(write, &bytes, width, height, 3, rgb.data(), 100);
    return bytes;
}

}  // namespace

TEST(Gltf, TriangleAsTextAndAsGlb) {
    GltfBuilder builder = triangle();
    builder.json["nodes"][0]["name"] = "n";
    const Expected<Scene> text = parse(builder.text());
    ASSERT_THAT(text, IsOk());
    ASSERT_EQ(text->nodes.size(), 1u);
    EXPECT_EQ(text->nodes[0].name, "n");
    EXPECT_EQ(text->nodes[0].mesh, 0u);
    EXPECT_EQ(text->nodes[0].skin, scene_none);
    EXPECT_EQ(text->roots, (std::vector<uint32_t>{0})) << "without a scene, all that have no parent";
    const ScenePrimitive& primitive = text->meshes.at(0).primitives.at(0);
    EXPECT_EQ(primitive.positions, (std::vector<Vector3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(primitive.indices, (std::vector<uint32_t>{0, 1, 2})) << "made up";
    EXPECT_EQ(primitive.material, scene_none);
    EXPECT_TRUE(primitive.normals.empty());

    const Expected<Scene> binary = parseGltf(builder.glb());
    ASSERT_THAT(binary, IsOk());
    EXPECT_EQ(*binary, *text);
}

TEST(Gltf, PropertiesThatAreNotReadMayBeAnything) {
    GltfBuilder builder = triangle();
    const std::string plain = builder.text();
    builder.json["extras"] = json::parse(std::string(400, '[') + std::string(400, ']'));
    builder.json["nodes"][0]["extras"] = 1;
    builder.json["nodes"][0]["extensions"] = json::parse(R"({"VENDOR_x": {"a": [null, "b"]}})");
    builder.json["meshes"][0]["extensions"]["VENDOR_x"] = 1;
    builder.json["extensionsUsed"] = 7;
    builder.json["accessors"][0]["min"] = "none";
    EXPECT_EQ(parse(builder.text()).value(), parse(plain).value());
}

TEST(Gltf, IntegersSpeltAsFractions) {
    GltfBuilder builder = triangle();
    const Scene plain = parse(builder.text()).value();
    builder.json["nodes"][0]["mesh"] = 0.0;
    builder.json["accessors"][0]["count"] = 3.0;
    builder.json["bufferViews"][0]["byteOffset"] = 0.0;
    EXPECT_EQ(parse(builder.text()).value(), plain);
}

// glTF 2.0, section 3.6.2.2.
TEST(Gltf, IntegerAttributes) {
    GltfBuilder builder = triangle();
    json& attributes = builder.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_0"] = builder.accessor(std::vector<uint8_t>{0, 51, 255, 1, 2, 3, 0, 0}, "VEC2", true);
    attributes["TEXCOORD_1"] = builder.accessor(std::vector<int16_t>{-32768, -32767, 0, 32767, 1, 2}, "VEC2", true);
    attributes["COLOR_0"] = builder.accessor(std::vector<uint16_t>{0, 65535, 13107, 0, 0, 0, 1, 2, 3}, "VEC3", true);
    attributes["POSITION"] = builder.accessor(std::vector<int8_t>{-128, 127, 0, 1, 2, 3, 4, 5, 6}, "VEC3");
    builder.json["accessors"][static_cast<size_t>(attributes["TEXCOORD_0"])]["count"] = 3;
    const Expected<Scene> scene = parse(builder.text());
    ASSERT_THAT(scene, IsOk());
    const ScenePrimitive& primitive = scene->meshes[0].primitives[0];
    EXPECT_EQ(primitive.texcoords[0][0], Vector2f(0.0f, 51 / 255.0f));
    EXPECT_EQ(primitive.texcoords[0][1], Vector2f(1.0f, 1 / 255.0f));
    EXPECT_EQ(primitive.texcoords[1][0], Vector2f(-1.0f, -1.0f)) << "the least integer is -1 too";
    EXPECT_EQ(primitive.texcoords[1][1], Vector2f(0.0f, 1.0f));
    EXPECT_EQ(primitive.colors[0], Vector4f(0.0f, 1.0f, 13107 / 65535.0f, 1.0f));
    EXPECT_EQ(primitive.positions[0], Vector3f(-128, 127, 0)) << "KHR_mesh_quantization";
}

TEST(Gltf, StridesAndOffsets) {
    // Position and texture coordinate of one vertex after the other, then 4 bytes of nothing; the last vertex ends
    // early.
    const std::vector<float> vertices = {0, 0, 0, 5, 6, 99, 1, 0, 0, 7, 8, 99, 0, 1, 0, 9, 10};
    GltfBuilder builder;
    builder.view(std::as_bytes(std::span(vertices)));
    builder.json["bufferViews"][0]["byteStride"] = 24;
    builder.json.merge_patch(json::parse(R"({
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                      {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC2", "byteOffset": 12}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}]}]
    })"));
    const Expected<Scene> scene = parse(builder.text());
    ASSERT_THAT(scene, IsOk());
    const ScenePrimitive& primitive = scene->meshes[0].primitives[0];
    EXPECT_EQ(primitive.positions[2], Vector3f(0, 1, 0));
    EXPECT_EQ(primitive.texcoords[0], (std::vector<Vector2f>{{5, 6}, {7, 8}, {9, 10}}));
    builder.json["accessors"][1]["byteOffset"] = 16;
    EXPECT_THAT(parse(builder.text()), HasErrorId("gltf.accessor_range"));
}

TEST(Gltf, SparseAccessors) {
    GltfBuilder builder = triangle();
    const std::vector<uint16_t> at = {0, 2};
    const std::vector<float> put = {7, 8, 9, 4, 5, 6};
    const int places = builder.view(std::as_bytes(std::span(at)));
    const int values = builder.view(std::as_bytes(std::span(put)));
    json sparse = json::parse(R"({"count": 2, "indices": {"componentType": 5123}})");
    sparse["indices"]["bufferView"] = places;
    sparse["values"]["bufferView"] = values;
    builder.json["accessors"][0]["sparse"] = sparse;
    builder.json["accessors"][1] = json::parse(R"({"componentType": 5126, "count": 3, "type": "VEC3"})");
    builder.json["accessors"][1]["sparse"] = sparse;
    builder.json["meshes"][0]["primitives"][0]["targets"] = json::parse(R"([{"POSITION": 1}])");
    const Expected<Scene> scene = parse(builder.text());
    ASSERT_THAT(scene, IsOk());
    const ScenePrimitive& primitive = scene->meshes[0].primitives[0];
    EXPECT_EQ(primitive.positions, (std::vector<Vector3f>{{7, 8, 9}, {1, 0, 0}, {4, 5, 6}}));
    EXPECT_EQ(primitive.targets.at(0).positions, (std::vector<Vector3f>{{7, 8, 9}, {0, 0, 0}, {4, 5, 6}}))
        << "zeros without a view";
    EXPECT_EQ(scene->meshes[0].weights, (std::vector<float>{0}));
}

TEST(Gltf, StripsAndFans) {
    for (const int mode : {4, 5, 6}) {
        GltfBuilder builder;
        std::vector<float> positions = square;
        positions.insert(positions.end(), {2, 0, 0, 2, 1, 0});
        const int indices = builder.accessor(std::vector<uint8_t>{5, 4, 3, 2, 1, 0}, "SCALAR");
        builder.mesh(positions, {{"mode", mode}, {"indices", indices}});
        const Expected<Scene> scene = parse(builder.text());
        ASSERT_THAT(scene, IsOk());
        // glTF 2.0, section 3.7.2.1: strip {v_i, v_(i + 1 + i % 2), v_(i + 2 - i % 2)}, fan {v_(i+1), v_(i+2), v_0}.
        const std::vector<uint32_t> expected = mode == 4   ? std::vector<uint32_t>{5, 4, 3, 2, 1, 0}
                                               : mode == 5 ? std::vector<uint32_t>{5, 4, 3, 4, 2, 3, 3, 2, 1, 2, 0, 1}
                                                           : std::vector<uint32_t>{4, 3, 5, 3, 2, 5, 2, 1, 5, 1, 0, 5};
        EXPECT_EQ(scene->meshes[0].primitives[0].indices, expected) << mode;
    }
}

TEST(Gltf, WhatIsLeftOutIsSaid) {
    GltfBuilder builder = triangle();
    builder.mesh(corner, {{"mode", 1}});
    builder.json["meshes"][1]["primitives"][1]["attributes"] = json::object();
    json& attributes = builder.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_2"] = builder.accessor(std::vector<float>(6), "VEC2");
    attributes["_OWN"] = 0;
    const Warnings warnings;
    GltfOptions options;
    options.name = "a.gltf";
    const Expected<Scene> scene = parse(builder.text(), options);
    ASSERT_THAT(scene, IsOk());
    EXPECT_TRUE(scene->meshes[1].primitives.empty());
    EXPECT_EQ(warnings.ids, "gltf.attribute_dropped gltf.primitive_dropped gltf.primitive_dropped ");
    EXPECT_EQ(warnings.last, "a.gltf: meshes[1].primitives[1]: there are no positions");
}

TEST(Gltf, NormalsTangentsAndWeightsAreNormalised) {
    GltfBuilder builder = triangle();
    json& attributes = builder.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["NORMAL"] = builder.accessor(std::vector<float>{0, 3, 4, 0, 0, 0, 1e-30f, 0, 0}, "VEC3");
    attributes["TANGENT"] = builder.accessor(std::vector<float>{3, 0, 4, -1, 0, 0, 0, 1, 1e30f, 0, 0, 1}, "VEC4");
    attributes["JOINTS_0"] = builder.accessor(std::vector<uint8_t>{1, 2, 3, 4, 5, 6, 7, 8, 0, 0, 0, 0}, "VEC4");
    attributes["WEIGHTS_0"] = builder.accessor(std::vector<float>{1, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 9}, "VEC4");
    const Expected<Scene> scene = parse(builder.text());
    ASSERT_THAT(scene, IsOk());
    const ScenePrimitive& primitive = scene->meshes[0].primitives[0];
    EXPECT_EQ(primitive.normals, (std::vector<Vector3f>{{0, 0.6f, 0.8f}, {0, 0, 1}, {1, 0, 0}}));
    EXPECT_EQ(primitive.tangents, (std::vector<Vector4f>{{0.6f, 0, 0.8f, -1}, {1, 0, 0, 1}, {1, 0, 0, 1}}));
    EXPECT_EQ(primitive.weights, (std::vector<Vector4f>{{0.25f, 0.75f, 0, 0}, {1, 0, 0, 0}, {0, 0, 0, 1}}));
    EXPECT_EQ(primitive.joints[0], (std::array<uint16_t, 4>{1, 2, 0, 0})) << "joints without a weight";
    EXPECT_EQ(primitive.joints[1], (std::array<uint16_t, 4>{5, 0, 0, 0}));
}

// More than four joints a vertex: the further ones are left out, and the first four share what there is.
TEST(Gltf, FurtherJointsAreLeftOut) {
    GltfBuilder builder = triangle();
    json& attributes = builder.json["meshes"][0]["primitives"][0]["attributes"];
    for (const char* set : {"0", "1"}) {
        attributes[std::string("JOINTS_") + set] =
            builder.accessor(std::vector<uint8_t>{1, 2, 3, 4, 1, 2, 3, 4, 1, 2, 3, 4}, "VEC4");
        attributes[std::string("WEIGHTS_") + set] = builder.accessor(std::vector<float>(12, 0.125f), "VEC4");
    }
    const Warnings warnings;
    const Expected<Scene> scene = parse(builder.text());
    ASSERT_THAT(scene, IsOk());
    EXPECT_THAT(scene->validate(), IsOk());
    EXPECT_EQ(warnings.ids, "gltf.attribute_dropped gltf.attribute_dropped ");
    EXPECT_EQ(scene->meshes[0].primitives[0].weights[0], Vector4f(0.25f));
}

TEST(Gltf, Materials) {
    GltfBuilder builder;
    builder.json.merge_patch(json::parse(R"({
        "extensionsRequired": ["KHR_texture_transform", "KHR_materials_unlit"],
        "textures": [{"sampler": 0}, {}, {"sampler": 1}, {"sampler": 2}],
        "samplers": [{"magFilter": 9728, "minFilter": 9728, "wrapS": 33071, "wrapT": 33648},
                     {"magFilter": 9729, "minFilter": 9984}, {"minFilter": 9986}],
        "materials": [{}, {
            "name": "m",
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.25, 0.5, 0.75, 1],
                "baseColorTexture": {"index": 2, "extensions": {"KHR_texture_transform":
                    {"offset": [0.5, -1], "rotation": 0.25, "scale": [2, 3], "texCoord": 1}}},
                "metallicFactor": 0.5, "roughnessFactor": 0, "metallicRoughnessTexture": {"index": 1}},
            "normalTexture": {"index": 1, "texCoord": 1, "scale": -2},
            "occlusionTexture": {"index": 3, "strength": 0.5},
            "emissiveTexture": {"index": 2}, "emissiveFactor": [0.5, 1, 0],
            "alphaMode": "MASK", "alphaCutoff": 0.75, "doubleSided": true,
            "extensions": {
                "KHR_materials_emissive_strength": {"emissiveStrength": 4},
                "KHR_materials_ior": {"ior": 1.25},
                "KHR_materials_transmission": {"transmissionFactor": 0.5, "transmissionTexture":
                    {"index": 2, "extensions": {"KHR_texture_transform":
                        {"offset": [0.5, -1], "rotation": 0.25, "scale": [2, 3], "texCoord": 1}}}},
                "KHR_materials_unlit": {}}}]
    })"));
    const Expected<Scene> scene = parse(builder.text());
    ASSERT_THAT(scene, IsOk());
    EXPECT_EQ(scene->materials.at(0), SceneMaterial()) << "the defaults are the specification's";
    SceneMaterial expected;
    const SceneTextureUse use = {2, 1, {0.5f, -1.0f}, 0.25f, {2, 3}};
    expected.name = "m";
    expected.base_color = {0.25f, 0.5f, 0.75f, 1.0f};
    expected.base_color_texture = use;
    expected.metallic = 0.5f;
    expected.roughness = 0.0f;
    expected.metallic_roughness_texture.texture = 1;
    expected.normal_texture = {.texture = 1, .texcoord = 1};
    expected.normal_scale = -2.0f;
    expected.occlusion_texture.texture = 3;
    expected.occlusion_strength = 0.5f;
    expected.emission_texture.texture = 2;
    expected.emission = {2, 4, 0};
    expected.alpha = SceneAlpha::Mask;
    expected.alpha_cutoff = 0.75f;
    expected.is_double_sided = true;
    expected.ior = 1.25f;
    expected.transmission = 0.5f;
    expected.transmission_texture = use;
    expected.is_unlit = true;
    EXPECT_EQ(scene->materials.at(1), expected);

    ASSERT_EQ(scene->textures.size(), 4u);
    EXPECT_EQ(scene->textures[1], SceneTexture());
    using enum SceneFilter;
    const SceneTexture nearest{"", scene_none, Nearest, Nearest, std::nullopt, {SceneWrap::Clamp, SceneWrap::Mirror}};
    EXPECT_EQ(scene->textures[0], nearest);
    EXPECT_EQ(scene->textures[2], (SceneTexture{"", scene_none, Linear, Nearest, Nearest}));
    EXPECT_EQ(scene->textures[3], (SceneTexture{"", scene_none, Linear, Nearest, Linear}));
}

TEST(Gltf, CamerasAndLights) {
    GltfBuilder builder;
    builder.json.merge_patch(json::parse(R"({
        "nodes": [{"camera": 2, "extensions": {"KHR_lights_punctual": {"light": 3}}}],
        "cameras": [
            {"type": "perspective", "perspective": {"yfov": 1.5, "znear": 0.5}},
            {"type": "perspective", "perspective": {"yfov": 1, "znear": 0.5, "zfar": 9, "aspectRatio": 2}},
            {"type": "orthographic", "orthographic": {"xmag": 2, "ymag": -3, "znear": 0, "zfar": 4}}],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "directional", "name": "sun", "color": [1, 0.5, 0], "intensity": 100},
            {"type": "point", "range": 8},
            {"type": "spot", "spot": {"innerConeAngle": 0.25, "outerConeAngle": 0.5}},
            {"type": "spot"}]}}
    })"));
    const Expected<Scene> scene = parse(builder.text());
    ASSERT_THAT(scene, IsOk());
    EXPECT_EQ(scene->nodes[0].camera, 2u);
    EXPECT_EQ(scene->nodes[0].light, 3u);
    EXPECT_EQ(scene->cameras.at(0), (SceneCamera{.fov = 1.5f, .near = 0.5f}));
    EXPECT_EQ(scene->cameras.at(1), (SceneCamera{.fov = 1, .aspect = 2, .near = 0.5f, .far = 9}));
    EXPECT_EQ(scene->cameras.at(2), (SceneCamera{.is_perspective = false, .half_size = {2, 3}, .near = 0, .far = 4}));
    using enum SceneLightType;
    EXPECT_EQ(scene->lights.at(0), (SceneLight{"sun", Directional, {1, 0.5f, 0}, 100}));
    EXPECT_EQ(scene->lights.at(1), (SceneLight{.range = 8}));
    EXPECT_EQ(scene->lights.at(2), (SceneLight{.type = Spot, .inner_angle = 0.25f, .outer_angle = 0.5f}));
    EXPECT_EQ(scene->lights.at(3), (SceneLight{.type = Spot}));
}

TEST(Gltf, Nodes) {
    GltfBuilder builder;
    builder.json.merge_patch(json::parse(R"({
        "nodes": [{"children": [2, 1], "translation": [1, 2, 3], "rotation": [0, 0, 1, 0], "scale": [4, 5, 6]},
                  {"matrix": [1, 2, 3, 0, 5, 6, 7, 0, 9, 10, 11, 0, 13, 14, 15, 1]}, {}, {}],
        "scenes": [{"nodes": [3]}, {"nodes": [3, 0]}]
    })"));
    EXPECT_EQ(parse(builder.text())->roots, (std::vector<uint32_t>{3})) << "the first scene";
    builder.json["scene"] = 1;
    const Expected<Scene> scene = parse(builder.text());
    ASSERT_THAT(scene, IsOk());
    EXPECT_EQ(scene->roots, (std::vector<uint32_t>{3, 0}));
    EXPECT_EQ(scene->nodes[0].children, (std::vector<uint32_t>{2, 1}));
    EXPECT_EQ(scene->nodes[0].transform, (SceneTransform{{1, 2, 3}, {0, 0, 1, 0}, {4, 5, 6}}));
    EXPECT_FALSE(scene->nodes[0].matrix);
    EXPECT_EQ(scene->nodes[1].matrix, Matrix4x4f(1, 2, 3, 0, 5, 6, 7, 0, 9, 10, 11, 0, 13, 14, 15, 1));
    EXPECT_EQ(scene->nodes[2].transform, SceneTransform());
}

TEST(Gltf, SkinsAndAnimations) {
    GltfBuilder builder = triangle();
    std::vector<float> matrices(32);
    for (size_t i = 0; i < 32; i++) matrices[i] = static_cast<float>(i);
    // Accessors 1 to 5; 0 is the triangle's.
    builder.accessor(matrices, "MAT4");
    builder.accessor(std::vector<float>{0.5, 1.5}, "SCALAR");
    builder.accessor(std::vector<int16_t>{0, 0, 0, 32767, 0, 32767, 0, 0}, "VEC4", true);
    builder.accessor(std::vector<float>{1, 2, 3, 4}, "SCALAR");
    builder.accessor(std::vector<float>(18, 1.0f), "VEC3");
    builder.json["meshes"][0]["primitives"][0]["targets"] = json::parse(R"([{"POSITION": 0}, {}])");
    builder.json.merge_patch(json::parse(R"({
        "nodes": [{"mesh": 0, "weights": [0.25, 0.5]}, {"children": [2]}, {}],
        "skins": [{"joints": [2, 1], "inverseBindMatrices": 1, "name": "s"}, {"joints": [1]}],
        "animations": [{
            "name": "a",
            "samplers": [{"input": 2, "output": 3}, {"input": 2, "output": 4, "interpolation": "STEP"},
                         {"input": 2, "output": 5, "interpolation": "CUBICSPLINE"}],
            "channels": [{"sampler": 0, "target": {"path": "rotation"}},
                         {"sampler": 0, "target": {"node": 1, "path": "rotation"}},
                         {"sampler": 1, "target": {"node": 0, "path": "weights"}},
                         {"sampler": 0, "target": {"node": 1, "path": "pointer"}},
                         {"sampler": 2, "target": {"node": 1, "path": "scale"}}]}]
    })"));
    const Expected<Scene> scene = parse(builder.text());
    ASSERT_THAT(scene, IsOk());
    EXPECT_EQ(scene->nodes[0].weights, (std::vector<float>{0.25f, 0.5f}));
    EXPECT_EQ(scene->skins.at(0).joints, (std::vector<uint32_t>{2, 1}));
    EXPECT_EQ(scene->skins[0].inverse_bind.at(1)[2], Vector4f(24, 25, 26, 27));
    EXPECT_EQ(scene->skins.at(1).inverse_bind, (std::vector<Matrix4x4f>{Matrix4x4f(1.0f)}));
    const SceneAnimation& animation = scene->animations.at(0);
    EXPECT_EQ(animation.name, "a");
    EXPECT_EQ(animation.duration(), 1.5f);
    ASSERT_EQ(animation.channels.size(), 3u) << "channels without a node, or with a path of an extension, are left out";
    EXPECT_EQ(animation.channels[0],
              (SceneChannel{1, ScenePath::Rotation, SceneInterpolation::Linear, {0.5, 1.5}, {0, 0, 0, 1, 0, 1, 0, 0}}));
    EXPECT_EQ(animation.channels[1],
              (SceneChannel{0, ScenePath::Weights, SceneInterpolation::Step, {0.5, 1.5}, {1, 2, 3, 4}}));
    EXPECT_EQ(animation.channels[2].interpolation, SceneInterpolation::CubicSpline);
    EXPECT_EQ(animation.channels[2].values.size(), 18u);
}

TEST(Gltf, Images) {
    const std::vector<std::byte> png = encodePng(chequers()).value();
    GltfBuilder builder = triangle();
    const int view = builder.view(png);
    builder.json["images"] = json::parse(R"([{"name": "i"}, {}, {"uri": "two%20words/%C3%A4.png"}])");
    builder.json["images"][0]["bufferView"] = view;
    builder.json["images"][1]["uri"] = "data:image/png;base64," + base64(png);
    builder.json["textures"] = json::parse(R"([{"source": 2, "name": "t"}])");
    GltfOptions options;
    std::string asked;
    options.read = [&](const std::string& name, uint64_t) -> Expected<std::vector<std::byte>> {
        asked += name;
        return png;
    };
    const Expected<Scene> scene = parse(builder.text(), options);
    ASSERT_THAT(scene, IsOk());
    EXPECT_EQ(asked, "two words/\xc3\xa4.png");
    ASSERT_EQ(scene->images.size(), 3u);
    EXPECT_EQ(scene->images[0].name, "i");
    for (const SceneImage& each : scene->images) EXPECT_EQ(each.image, chequers());
    EXPECT_EQ(scene->textures[0].image, 2u);
    EXPECT_EQ(scene->textures[0].name, "t");

    options.with_images = false;
    asked.clear();
    const Expected<Scene> without = parse(builder.text(), options);
    ASSERT_THAT(without, IsOk());
    EXPECT_EQ(asked, "");
    ASSERT_EQ(without->images.size(), 3u);
    EXPECT_EQ(without->images[0].name, "i");
    EXPECT_TRUE(without->images[0].image.isEmpty());
}

TEST(Gltf, JpegImages) {
    // Two halves of one colour each, on a border between blocks. At quality 100 coefficients are rounded to whole
    // numbers, the constant one of 8 per level; turning colours to luminance and back takes two roundings to levels
    // whose factors sum up to at most 1 + 1.77 each: less than 3 levels.
    std::vector<uint8_t> rgb;
    for (int y = 0; y < 16; y++)
        for (int x = 0; x < 32; x++)
            for (const int value : {x < 16 ? 200 : 30, 100, x < 16 ? 0 : 220})
                rgb.push_back(static_cast<uint8_t>(value));
    const std::vector<std::byte> jpeg = jpegOf(rgb, 32, 16);
    GltfBuilder builder = triangle();
    builder.json["images"][0]["bufferView"] = builder.view(jpeg);
    const Expected<Scene> scene = parse(builder.text());
    ASSERT_THAT(scene, IsOk());
    const Image& image = scene->images.at(0).image;
    ASSERT_EQ(image.width(), 32u);
    ASSERT_EQ(image.height(), 16u);
    EXPECT_EQ(image.format(), FormatRGBAu8n);
    for (uint32_t i = 0; i < 32 * 16; i++) {
        const Vector4f texel = 255.0f * image.load(i % 32, i / 32);
        for (int k = 0; k < 3; k++) EXPECT_NEAR(texel[k], rgb[3 * i + static_cast<size_t>(k)], 3.0f) << i;
        EXPECT_EQ(texel.w, 255.0f);
    }
    EXPECT_THAT(decodeJpeg(jpeg, 32 * 16 * 4 - 1), HasErrorId("image.too_large"));
}

TEST(Gltf, Files) {
    const TempDir dir;
    GltfBuilder builder = triangle();
    const std::vector<std::byte> png = encodePng(chequers()).value();
    builder.json["images"][0]["uri"] = "textures/a.png";
    json document = json::parse(builder.text());
    const std::string uri = document["buffers"][0]["uri"];
    document["buffers"][0]["uri"] = "a%2Ebin";
    ASSERT_THAT(writeTextFile(dir / "a.gltf", document.dump()), IsOk());
    EXPECT_THAT(Scene::load(dir / "a.gltf"), HasErrorId("file.open"));
    ASSERT_THAT(writeFile(dir / "a.bin", std::as_bytes(std::span(corner))), IsOk());
    const Expected<Scene> no_image = Scene::load(dir / "a.gltf");
    ASSERT_THAT(no_image, HasErrorId("file.open"));
    EXPECT_TRUE(no_image.error().text().starts_with("a.gltf: images[0].uri: cannot open ")) << no_image.error().text();
    const Expected<Mesh> mesh = Mesh::load(dir / "a.gltf");
    ASSERT_THAT(mesh, IsOk()) << "a mesh needs no images";
    EXPECT_EQ(mesh->triangleCount(), 1u);
    std::filesystem::create_directory(dir / "textures");
    ASSERT_THAT(writeFile(dir / "textures/a.png", png), IsOk());
    const Expected<Scene> scene = Scene::load(dir / "a.gltf");
    ASSERT_THAT(scene, IsOk());
    EXPECT_EQ(scene->images[0].image, chequers());

    ASSERT_THAT(writeFile(dir / "b.GLB", triangle().glb()), IsOk());
    EXPECT_EQ(Mesh::load(dir / "b.GLB").value(), mesh.value());
    EXPECT_THAT(Mesh::load(dir / "b.GLB", 100), HasErrorId("file.too_large"));
    ASSERT_THAT(writeTextFile(dir / "c.gltf", "{\"asset\":{\"version\":\"2.0\"}}"), IsOk());
    const Expected<Mesh> empty = Mesh::load(dir / "c.gltf");
    ASSERT_THAT(empty, HasErrorId("mesh.no_faces"));
    EXPECT_EQ(empty.error().file(), "c.gltf");
    EXPECT_THAT(Mesh::load(dir / "d.glb"), HasErrorId("file.open"));
}

// What a document makes of few bytes is bounded by the limit, and said before it is allocated.
TEST(Gltf, LimitsBoundWhatIsMade) {
    GltfBuilder builder = triangle();
    GltfOptions options;
    options.limit = 64 << 10;
    EXPECT_THAT(parse(builder.text(), options), IsOk());
    const json plain = builder.json;

    builder.json["accessors"][1] = json::parse(R"({"componentType": 5126, "count": 1125899906842624, "type": "VEC3"})");
    builder.json["meshes"][0]["primitives"][0]["targets"] = json::parse(R"([{"POSITION": 1}])");
    EXPECT_THAT(parse(builder.text(), options), HasErrorId("gltf.too_large")) << "zeros without a view";
    EXPECT_THAT(parse(builder.text()), HasErrorId("gltf.too_large"));

    builder.json = plain;
    for (int i = 0; i < 1000; i++)
        builder.json["meshes"][0]["primitives"].push_back(plain["meshes"][0]["primitives"][0]);
    EXPECT_THAT(parse(builder.text(), options), HasErrorId("gltf.too_large")) << "one accessor a thousand times";

    builder.json = plain;
    for (int i = 0; i < 100; i++) builder.json["materials"].push_back(json::object());
    EXPECT_THAT(parse(builder.text(), options), HasErrorId("gltf.too_large")) << "materials of two letters";

    builder.json = plain;
    builder.json["images"][0]["uri"] = "a.png";
    options.read = [](const std::string&, uint64_t) -> Expected<std::vector<std::byte>> {
        return encodePng(Image::create(FormatRGBAu8n, 200, 200).value());
    };
    EXPECT_THAT(parse(builder.text(), options), HasErrorId("image.too_large"));

    builder.json = plain;
    builder.json["asset"]["generator"] = std::string(100 << 10, 'x');
    EXPECT_THAT(parse(builder.text(), options), HasErrorId("gltf.too_large")) << "the text itself";
}
