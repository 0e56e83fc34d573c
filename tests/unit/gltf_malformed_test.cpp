// Every defect of a document has its id, and the error names the element.

#include "support/allocations.h"
#include "support/gltf_builder.h"
#include "support/matchers.h"
#include "support/reference.h"

#include <glint/base/log.h>
#include <glint/format/gltf.h>

#include <gtest/gtest.h>

using namespace glint;
using namespace glint::test;
using nlohmann::json;

namespace {

Expected<Scene> parse(std::string_view text) {
    GltfOptions options;
    options.name = "test";
    return parseGltf(std::as_bytes(std::span(text)), options);
}

// Two triangles with all that a document may have. Accessors: 0 positions, 1 indices, 2 joints, 3 weights, 4 key times,
// 5 three numbers a key, 6 matrices, 7 one number a key. Views have the same numbers, each begins at its accessor's
// first byte.
GltfBuilder sound() {
    GltfBuilder builder;
    builder.accessor(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}, "VEC3");
    builder.accessor(std::vector<uint16_t>{0, 1, 2, 2, 1, 3}, "SCALAR");
    builder.accessor(std::vector<uint8_t>{0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0}, "VEC4");
    builder.accessor(std::vector<float>{0.5, 0.5, 0, 0, 0.5, 0.5, 0, 0, 0.5, 0.5, 0, 0, 0.5, 0.5, 0, 0}, "VEC4");
    builder.accessor(std::vector<float>{0, 1}, "SCALAR");
    builder.accessor(std::vector<float>{0, 0, 0, 1, 1, 1}, "VEC3");
    builder.accessor(std::vector<float>(32, 1.0f), "MAT4");
    builder.accessor(std::vector<float>{0, 1}, "SCALAR");
    builder.json.merge_patch(json::parse(R"({
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0, "skin": 0}, {"children": [2]}, {"camera": 0}],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}, "indices": 1, "material": 0,
            "targets": [{"POSITION": 0}]}]}],
        "skins": [{"joints": [1, 2], "inverseBindMatrices": 6}],
        "animations": [{
            "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}},
                         {"sampler": 1, "target": {"node": 0, "path": "weights"}}],
            "samplers": [{"input": 4, "output": 5}, {"input": 4, "output": 7}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
                       "extensions": {"KHR_materials_ior": {"ior": 1.5}}}],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{}],
        "images": [{"uri":
"data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNoAAAAggCBd81ytgAAAABJRU5ErkJggg=="}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}}
    })"));
    return builder;
}

/// One property of the sound document is set, or taken out where the value is empty.
struct Case {
    const char* id;
    const char* place;  ///< what the message begins with
    const char* pointer;
    std::string_view value;
};

std::string numbers(std::initializer_list<float> values) {
    const std::vector<float> list(values);
    return "{\"byteLength\": " + std::to_string(4 * list.size()) +
           ", \"uri\": \"data:application/octet-stream;base64," + base64(std::as_bytes(std::span(list))) + "\"}";
}

// A second buffer, and a view of it in the place of another.
std::string viewOfSecond(size_t length) { return "{\"buffer\": 1, \"byteLength\": " + std::to_string(length) + "}"; }

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

void expectError(const GltfBuilder& builder, const std::vector<Case>& changes) {
    json document = json::parse(builder.text());
    for (const Case& change : changes) {
        const json::json_pointer pointer(change.pointer);
        if (change.value.empty())
            document[pointer.parent_pointer()].erase(pointer.back());
        else
            document[pointer] = json::parse(change.value);
    }
    const Case& last = changes.back();
    const Expected<Scene> scene = parse(document.dump());
    ASSERT_THAT(scene, HasErrorId(last.id)) << last.pointer << " = " << last.value;
    EXPECT_TRUE(scene.error().message().starts_with(last.place))
        << last.pointer << " = " << last.value << ": " << scene.error().text();
    EXPECT_EQ(scene.error().file(), "test");
}

}  // namespace

TEST(GltfMalformed, TheSoundDocumentIsSound) {
    const Expected<Scene> scene = parse(sound().text());
    ASSERT_THAT(scene, IsOk());
    EXPECT_THAT(scene->mesh(scene->pose(0, 0.5f)), IsOk());
}

TEST(GltfMalformed, Properties) {
    const Case cases[] = {
        {"gltf.type", "cameras: an array is wanted, not an object", "/cameras", "{}"},
        {"gltf.type", "nodes[1]: an object is wanted, not 3", "/nodes/1", "3"},
        {"gltf.type", "nodes[1].name: a string", "/nodes/1/name", "[]"},
        {"gltf.type", "nodes[1].children: an array", "/nodes/1/children", "2"},
        {"gltf.type", "nodes[1].children[0]: an integer is wanted, not 1.5", "/nodes/1/children/0", "1.5"},
        {"gltf.type", "nodes[1].translation[1]: a number", "/nodes/1/translation", "[0, \"x\", 0]"},
        {"gltf.type", "accessors[0].normalized: true or false", "/accessors/0/normalized", "1"},
        {"gltf.type", "meshes[0].primitives[0].attributes: an object", "/meshes/0/primitives/0/attributes", "[0]"},
        {"gltf.type", "meshes[0].primitives[0].targets[0]: an object", "/meshes/0/primitives/0/targets/0", "0"},
        {"gltf.type", "extensionsRequired: an array", "/extensionsRequired", "\"KHR_texture_transform\""},
        {"gltf.type", "extensionsRequired[0]: a string", "/extensionsRequired", "[1]"},
        {"gltf.type", "materials[0].alphaMode: a string", "/materials/0/alphaMode", "2"},
        {"gltf.missing", "'asset' is required", "/asset", ""},
        {"gltf.missing", "asset: 'version' is required", "/asset", "{}"},
        {"gltf.missing", "buffers[0]: 'byteLength' is required", "/buffers/0/byteLength", ""},
        {"gltf.missing", "buffers[0]: there is no 'uri'", "/buffers/0/uri", ""},
        {"gltf.missing", "bufferViews[2]: 'buffer' is required", "/bufferViews/2/buffer", ""},
        {"gltf.missing", "accessors[1]: 'count' is required", "/accessors/1/count", ""},
        {"gltf.missing", "meshes[0].primitives[0]: 'attributes' is", "/meshes/0/primitives/0/attributes", ""},
        {"gltf.missing", "meshes[0].primitives[0].attributes: JOINTS_0 and WEIGHTS_0",
         "/meshes/0/primitives/0/attributes/WEIGHTS_0", ""},
        {"gltf.missing", "skins[0]: 'joints' is required", "/skins/0/joints", ""},
        {"gltf.missing", "images[0]: either", "/images/0/bufferView", "0"},
        {"gltf.missing", "images[0]: either", "/images/0/uri", ""},
        {"gltf.missing", "cameras[0]: 'orthographic' is required", "/cameras/0/type", "\"orthographic\""},
        {"gltf.value", "accessors[0].componentType: 5124 is none of", "/accessors/0/componentType", "5124"},
        {"gltf.value", "accessors[0].type: \"VEC5\" is none of", "/accessors/0/type", "\"VEC5\""},
        {"gltf.value", "accessors[0].type: \"VEC\" is none of", "/accessors/0/type", "\"VEC\""},
        {"gltf.value", "accessors[0].type: \"VEC2|VEC3\" is none of", "/accessors/0/type", "\"VEC2|VEC3\""},
        {"gltf.value", "accessors[0].count: 0 is not in", "/accessors/0/count", "0"},
        {"gltf.value", "accessors[0].count: -1 is not in", "/accessors/0/count", "-1"},
        {"gltf.value", "accessors[0].count: 18446744073709551615 is not in", "/accessors/0/count",
         "18446744073709551615"},
        {"gltf.value", "bufferViews[0].byteLength: 0 is not in", "/bufferViews/0/byteLength", "0"},
        {"gltf.value", "nodes[0].matrix: 16 numbers are wanted, not 15", "/nodes/0/matrix",
         "[0,0,0,0,0,0,0,0,0,0,0,0,0,0,0]"},
        {"gltf.value", "nodes[0].scale[2]: 1e+39 is not in", "/nodes/0/scale", "[1, 1, 1e39]"},
        {"gltf.value", "meshes[0].primitives[0].mode: 7 is not in", "/meshes/0/primitives/0/mode", "7"},
        {"gltf.value", "materials[0].pbrMetallicRoughness.metallicFactor: 1.5",
         "/materials/0/pbrMetallicRoughness/metallicFactor", "1.5"},
        {"gltf.value", "materials[0].extensions.KHR_materials_ior: ", "/materials/0/extensions/KHR_materials_ior/ior",
         "0.5"},
        {"gltf.value", "materials[0].pbrMetallicRoughness.baseColorTexture.texCoord: 2",
         "/materials/0/pbrMetallicRoughness/baseColorTexture/texCoord", "2"},
        {"gltf.value", "samplers[0].wrapS: 10498 is none of", "/samplers/0/wrapS", "10498"},
        {"gltf.value", "cameras[0]: the far plane at 0.5", "/cameras/0/perspective/zfar", "0.5"},
        {"gltf.value", "cameras[0].perspective.yfov: 0 is not in", "/cameras/0/perspective/yfov", "0"},
        {"gltf.value", "cameras[0]: half of the view", "/cameras/0",
         R"({"type": "orthographic", "orthographic": {"xmag": 0, "ymag": 1, "znear": 0, "zfar": 1}})"},
        {"gltf.value", "extensions.KHR_lights_punctual.lights[0]: the inner angle",
         "/extensions/KHR_lights_punctual/lights/0/spot/innerConeAngle", "1"},
        {"gltf.index", "scene: 1 names none of the 1 scenes", "/scene", "1"},
        {"gltf.index", "nodes[0].mesh: -1 names none of the 1 meshes", "/nodes/0/mesh", "-1"},
        {"gltf.index", "nodes[1].children[0]: 3 names none of the 3 nodes", "/nodes/1/children/0", "3"},
        {"gltf.index", "nodes[0].extensions.KHR_lights_punctual.light: 1 names none of the 1 extensions.KHR_lights",
         "/nodes/0/extensions", R"({"KHR_lights_punctual": {"light": 1}})"},
        {"gltf.index", "bufferViews[1].buffer: 1 names none of the 1 buffers", "/bufferViews/1/buffer", "1"},
        {"gltf.index", "accessors[0].bufferView: 8 names none of the 8", "/accessors/0/bufferView", "8"},
        {"gltf.index", "meshes[0].primitives[0].attributes.POSITION: 8 names none of the 8",
         "/meshes/0/primitives/0/attributes/POSITION", "8"},
        {"gltf.index", "meshes[0].primitives[0].targets[0].NORMAL: 9", "/meshes/0/primitives/0/targets/0/NORMAL", "9"},
        {"gltf.index", "meshes[0].primitives[0].indices: 4294967297", "/meshes/0/primitives/0/indices", "4294967297"},
        {"gltf.index", "materials[0].pbrMetallicRoughness.baseColorTexture.index: 1 names none of the 1 textures",
         "/materials/0/pbrMetallicRoughness/baseColorTexture/index", "1"},
        {"gltf.index", "textures[0].source: 1", "/textures/0/source", "1"},
        {"gltf.index", "animations[0].channels[0].sampler: 2 names none of the 2", "/animations/0/channels/0/sampler",
         "2"},
        {"gltf.index", "animations[0].samplers[0].input: 99", "/animations/0/samplers/0/input", "99"},
        {"gltf.index", "skins[0].joints[1]: 3", "/skins/0/joints/1", "3"},
        {"gltf.version", "the document is of version '1.0'", "/asset/version", "\"1.0\""},
        {"gltf.version", "the document is of version '3.0'", "/asset/version", "\"3.0\""},
        {"gltf.version", "the document is of version '2.0' and asks for a reader of '2.1'", "/asset/minVersion",
         "\"2.1\""},
        {"gltf.extension", "extensionsRequired[1]: the document cannot be read without the extension 'KHR_draco",
         "/extensionsRequired", R"(["KHR_texture_transform", "KHR_draco_mesh_compression"])"},
        {"gltf.extension", "extensionsRequired[0]: the document cannot be read without the extension 'EXT_meshopt",
         "/extensionsRequired", R"(["EXT_meshopt_compression"])"},
        {"gltf.library", "tinygltf refuses", "/accessors/1/bufferView", ""},
    };
    for (const Case& each : cases) expectError(sound(), {each});
}

TEST(GltfMalformed, BinaryData) {
    const Case cases[] = {
        {"gltf.buffer_size", "buffers[0]: 100000 bytes are promised", "/buffers/0/byteLength", "100000"},
        {"gltf.uri", "buffers[0].uri: ", "/buffers/0/uri", "\"data:application/octet-stream;base64,****\""},
        {"gltf.uri", "buffers[0].uri: ", "/buffers/0/uri", "\"data:application/octet-stream,abc\""},
        {"gltf.uri", "buffers[0].uri: ", "/buffers/0/uri", "\"\""},
        {"gltf.uri", "buffers[0].uri: '../a.bin' names no file beside", "/buffers/0/uri", "\"../a.bin\""},
        {"gltf.uri", "buffers[0].uri: 'b/%2E%2e/../a.bin' names no", "/buffers/0/uri", "\"b/%2E%2e/../a.bin\""},
        {"gltf.uri", "buffers[0].uri: '/etc/passwd' names no", "/buffers/0/uri", "\"/etc/passwd\""},
        {"gltf.uri", "buffers[0].uri: '%2fetc/passwd' names no", "/buffers/0/uri", "\"%2fetc/passwd\""},
        {"gltf.uri", "buffers[0].uri: 'file:///a.bin' names no", "/buffers/0/uri", "\"file:///a.bin\""},
        {"gltf.uri", "buffers[0].uri: 'a\\b.bin' names no", "/buffers/0/uri", R"("a\\b.bin")"},
        {"gltf.uri", "buffers[0].uri: 'a%00.bin' names no", "/buffers/0/uri", "\"a%00.bin\""},
        {"gltf.uri", "buffers[0].uri: 'a%2' names no", "/buffers/0/uri", "\"a%2\""},
        {"gltf.uri", "buffers[0].uri: 'a.bin' is another file", "/buffers/0/uri", "\"a.bin\""},
        {"gltf.view_range", "meshes[0].primitives[0].attributes.POSITION: bufferViews[0] has 9999 bytes",
         "/bufferViews/0/byteLength", "9999"},
        {"gltf.view_range", "meshes[0].primitives[0].attributes.POSITION: bufferViews[0] has 48 bytes from byte 9000",
         "/bufferViews/0/byteOffset", "9000"},
        {"gltf.view_range", "meshes[0].primitives[0].attributes.POSITION: bufferViews[0] has 9007199254740992 bytes",
         "/bufferViews/0/byteLength", "9007199254740992"},
        {"gltf.accessor_range", "meshes[0].primitives[0].attributes.POSITION: 5 elements", "/accessors/0/count", "5"},
        {"gltf.accessor_range", "meshes[0].primitives[0].attributes.POSITION: 9007199254740992 elements",
         "/accessors/0/count", "9007199254740992"},
        {"gltf.accessor_range", "meshes[0].primitives[0].attributes.POSITION: 4 elements", "/accessors/0/byteOffset",
         "4"},
        {"gltf.accessor_range", "meshes[0].primitives[0].attributes.POSITION: 4 elements", "/accessors/0/byteOffset",
         "9007199254740992"},
        {"gltf.accessor_range", "meshes[0].primitives[0].attributes.POSITION: 4 elements", "/bufferViews/0/byteStride",
         "16"},
        {"gltf.stride", "bufferViews[0]: a stride of 18 bytes", "/bufferViews/0/byteStride", "18"},
        {"gltf.stride", "meshes[0].primitives[0].attributes.POSITION: bufferViews[0] has a stride of 8",
         "/bufferViews/0/byteStride", "8"},
        {"gltf.alignment", "meshes[0].primitives[0].attributes.POSITION: components of 4 bytes begin at byte 2",
         "/accessors/0/byteOffset", "2"},
        {"gltf.alignment", "meshes[0].primitives[0].indices: components of 2 bytes begin at byte 0",
         "/bufferViews/1/byteOffset", "49"},
        {"gltf.accessor_type", "meshes[0].primitives[0].attributes.POSITION: accessors[0] has elements VEC2",
         "/accessors/0/type", "\"VEC2\""},
        {"gltf.accessor_type", "meshes[0].primitives[0].attributes.POSITION: accessors[1] has elements SCALAR",
         "/meshes/0/primitives/0/attributes/POSITION", "1"},
        {"gltf.accessor_type", "meshes[0].primitives[0].indices: accessors[4]", "/meshes/0/primitives/0/indices", "4"},
        {"gltf.accessor_type", "meshes[0].primitives[0].attributes.WEIGHTS_0: accessors[2]",
         "/meshes/0/primitives/0/attributes/WEIGHTS_0", "2"},
        {"gltf.accessor_type", "meshes[0].primitives[0].attributes.JOINTS_0: accessors[3]",
         "/meshes/0/primitives/0/attributes/JOINTS_0", "3"},
        {"gltf.accessor_type", "skins[0].inverseBindMatrices: accessors[0]", "/skins/0/inverseBindMatrices", "0"},
        {"gltf.accessor_type", "animations[0].channels[0].sampler.input: accessors[5]",
         "/animations/0/samplers/0/input", "5"},
        {"gltf.sparse", "meshes[0].primitives[0].attributes.POSITION: sparse index 1", "/accessors/0/sparse",
         R"({"count": 2, "indices": {"bufferView": 6, "componentType": 5121}, "values": {"bufferView": 0}})"},
        {"gltf.sparse", "meshes[0].primitives[0].attributes.POSITION: sparse index 0", "/accessors/0/sparse",
         R"({"count": 1, "indices": {"bufferView": 6, "byteOffset": 4, "componentType": 5125},
             "values": {"bufferView": 0}})"},
        {"gltf.accessor_range", "meshes[0].primitives[0].attributes.POSITION.sparse.values: 5 elements",
         "/accessors/0/sparse",
         R"({"count": 5, "indices": {"bufferView": 6, "componentType": 5125}, "values": {"bufferView": 0}})"},
        {"gltf.accessor_range", "meshes[0].primitives[0].attributes.POSITION.sparse.indices: 2147483647 elements",
         "/accessors/0/sparse",
         R"({"count": 2147483647, "indices": {"bufferView": 6, "componentType": 5125}, "values": {"bufferView": 0}})"},
        {"gltf.index", "accessors[0].sparse.values.bufferView: 8", "/accessors/0/sparse",
         R"({"count": 1, "indices": {"bufferView": 6, "componentType": 5125}, "values": {"bufferView": 8}})"},
        {"gltf.image_format", "images[0]: the 48 bytes begin neither", "/images/0", R"({"bufferView": 0})"},
        {"image.png_malformed", "images[0]: ", "/images/0/uri", "\"data:image/png;base64,iVBORw0KGgo=\""},
        {"image.jpeg_malformed", "images[0]: ", "/images/0/uri", "\"data:image/jpeg;base64,/9j/4AAQ\""},
    };
    for (const Case& each : cases) expectError(sound(), {each});

    const auto withSecond = [](const char* view, const std::string& buffer, size_t length, Case expected) {
        expected.pointer = view;
        const std::string second = viewOfSecond(length);
        expected.value = second;
        expectError(sound(), {{"", "", "/buffers/1", buffer}, expected});
    };
    withSecond("/bufferViews/0", numbers({0, 0, 0, 1, not_a_number, 0, 0, 1, 0, 1, 1, 0}), 48,
               {"gltf.not_finite",
                "meshes[0].primitives[0].attributes.POSITION: element 1 of accessors[0] has the value nan", "", ""});
    withSecond("/bufferViews/0", numbers({0, 0, 0, 1, 0, 0, 0, 1, 0, -infinity, 1, 0}), 48,
               {"gltf.not_finite", "meshes[0].primitives[0].attributes.POSITION: element 3", "", ""});
    withSecond("/bufferViews/3", numbers({1, 0, 0, 0, 1, 0, 0, 0, -1, 0, 0, 0, 1, 0, 0, 0}), 64,
               {"gltf.value", "meshes[0].primitives[0].attributes.WEIGHTS_0: weight 0 of vertex 2 is -1", "", ""});
    withSecond("/bufferViews/4", numbers({1, 1}), 8,
               {"gltf.key_order", "animations[0].channels[0].sampler.input: key 1 is at 1 s, not later", "", ""});
    withSecond("/bufferViews/4", numbers({-1, 1}), 8,
               {"gltf.key_order", "animations[0].channels[0].sampler.input: key 0 is at -1 s, before 0", "", ""});
    withSecond("/bufferViews/4", numbers({0, not_a_number}), 8,
               {"gltf.not_finite", "animations[0].channels[0].sampler.input: element 1", "", ""});
    withSecond("/bufferViews/6", numbers({0}), 4,
               {"gltf.accessor_range", "skins[0].inverseBindMatrices: 2 elements", "", ""});
}

TEST(GltfMalformed, Structure) {
    const Case cases[] = {
        {"gltf.count", "meshes[0].primitives[0].attributes.NORMAL: 2 elements for the 4",
         "/meshes/0/primitives/0/attributes/NORMAL", "5"},
        {"gltf.count", "meshes[0].primitives[0].targets[0].NORMAL: 2 elements",
         "/meshes/0/primitives/0/targets/0/NORMAL", "5"},
        {"gltf.count", "meshes[0].primitives[0]: 4 corners make no whole triangles", "/accessors/1/count", "4"},
        {"gltf.count", "meshes[0].primitives[0]: 4 corners make no whole triangles", "/meshes/0/primitives/0/indices",
         ""},
        {"gltf.count", "meshes[0].weights: 2 weights for 1 morph targets", "/meshes/0/weights", "[0, 1]"},
        {"gltf.count", "nodes[0].weights: 3 weights for 1 morph targets", "/nodes/0/weights", "[0, 1, 2]"},
        {"gltf.count", "meshes[0].primitives[1]: 0 morph targets, where", "/meshes/0/primitives/1",
         R"({"attributes": {"POSITION": 0}})"},
        {"gltf.count", "skins[0].joints: there is no joint", "/skins/0/joints", "[]"},
        {"gltf.count", "skins[0].inverseBindMatrices: 1 matrices for 2 joints", "/accessors/6/count", "1"},
        {"gltf.count", "animations[0].channels[0].sampler.output: 3 numbers for 2 keys of 3", "/accessors/5/count",
         "1"},
        {"gltf.count", "animations[0].channels[0].sampler.output: 6 numbers for 2 keys of 9",
         "/animations/0/samplers/0/interpolation", "\"CUBICSPLINE\""},
        {"gltf.vertex_index", "meshes[0].primitives[0].indices: index 2 is 16256", "/meshes/0/primitives/0/indices",
         "8"},
        {"gltf.joint", "nodes[0]: meshes[0] names joint 1 of skins[0], which has 1", "/skins/0/joints", "[1]"},
        {"gltf.two_parents", "nodes[2].children[0]: nodes[2] is a child of nodes[1] already", "/nodes/2/children",
         "[2]"},
        {"gltf.two_parents", "nodes[1].children[1]: nodes[2] is a child of nodes[1] already", "/nodes/1/children",
         "[2, 2]"},
        {"gltf.cycle", "nodes[1]: ", "/nodes/2/children", "[1]"},
        {"gltf.cycle", "nodes[0]: ", "/nodes/0/children", "[0]"},
        {"gltf.root", "scenes[0].nodes[1]: nodes[2] is no root, but a child of nodes[1]", "/scenes/0/nodes", "[0, 2]"},
        {"gltf.root", "scenes[0].nodes[2]: nodes[0] stands there twice", "/scenes/0/nodes", "[0, 1, 0]"},
        {"gltf.channel", "animations[0].channels[0]: nodes[1] has a matrix", "/nodes/1/matrix",
         "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]"},
        {"gltf.channel", "animations[0].channels[1]: nodes[1] has no morph targets",
         "/animations/0/channels/1/target/node", "1"},
        {"gltf.channel", "animations[0]: two channels move one property of nodes[1]", "/animations/0/channels/1",
         R"({"sampler": 0, "target": {"node": 1, "path": "translation"}})"},
    };
    for (const Case& each : cases) {
        GltfBuilder builder = sound();
        // The times, 0.0f and 1.0f, seen as 16-bit numbers.
        builder.json["accessors"].push_back(
            {{"bufferView", 4}, {"componentType", 5123}, {"count", 3}, {"type", "SCALAR"}});
        builder.json["accessors"][8]["byteOffset"] = 2;
        expectError(builder, {each});
    }
}

TEST(GltfMalformed, Text) {
    for (const char* text : {"", " ", "{", "[1,", "{\"asset\":}", "nul", "{\"a\":\"\xff\"}", "{} {}", "\x89PNG\r\n"})
        EXPECT_THAT(parse(text), HasErrorId("gltf.json")) << text;
    for (const char* text : {"[]", "1", "null", "\"glTF\""}) EXPECT_THAT(parse(text), HasErrorId("gltf.type")) << text;
    EXPECT_THAT(parse("{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"scale\":[1e999,1,1]}]}"),
                HasErrorId("gltf.json"));
    EXPECT_THAT(parse(std::string(100000, '[')), HasErrorId("gltf.json")) << "nothing recurses";
    EXPECT_THAT(parse(std::string(100000, '[') + std::string(100000, ']')), HasErrorId("gltf.type"));
    const std::string deep = std::string(100000, '[') + std::string(100000, ']');
    EXPECT_THAT(parse("{\"asset\":{\"version\":\"2.0\",\"extras\":" + deep + "}}"), IsOk());
    EXPECT_THAT(parse("{\"asset\":{\"version\":" + deep + "}}"), HasErrorId("gltf.type"));
}

TEST(GltfMalformed, Binary) {
    const std::vector<std::byte> glb = sound().glb();
    const size_t json_size = static_cast<size_t>(glb[12]) | static_cast<size_t>(glb[13]) << 8;
    ASSERT_THAT(parseGltf(glb), IsOk());
    const auto expect = [&](size_t at, int value, const char* id, const char* message) {
        std::vector<std::byte> changed = glb;
        changed[at] = static_cast<std::byte>(value);
        const Expected<Scene> scene = parseGltf(changed);
        ASSERT_THAT(scene, HasErrorId(id)) << at;
        EXPECT_NE(scene.error().message().find(message), std::string::npos) << scene.error().text();
    };
    expect(4, 1, "gltf.version", "version 1");
    expect(11, 1, "gltf.glb", "the header promises");
    expect(15, 1, "gltf.glb", "chunk 0 has");
    expect(16, 'X', "gltf.glb", "chunk 0 is of type");
    expect(12, static_cast<int>(glb[12]) + 8, "gltf.glb", "chunk");
    expect(20 + json_size + 3, 0x7f, "gltf.glb", "chunk 1 has");
    expect(20 + json_size + 4, 'X', "gltf.missing", "buffers[0]");
    expect(20 + json_size, 4, "gltf.glb", "chunk 2 has");
    expect(20, '[', "gltf.json", "byte");
    for (size_t size = 4; size < glb.size(); size++)
        ASSERT_THAT(parseGltf(std::span(glb).first(size)), HasErrorId("gltf.glb")) << size;

    json longer = json::parse(sound().text());
    longer["buffers"] = {{{"byteLength", glb.size() + 5}}};
    EXPECT_THAT(parseGltf(makeGlb(longer.dump(), glb)), HasErrorId("gltf.buffer_size"));

    // A second binary buffer has nothing to be read from; a second chunk of JSON is no document.
    GltfBuilder two = sound();
    json document = json::parse(two.text());
    document["buffers"] = {{{"byteLength", 4}}, {{"byteLength", 4}}};
    EXPECT_THAT(parseGltf(makeGlb(document.dump(), glb)), HasErrorId("gltf.missing"));
    std::vector<std::byte> twice = makeGlb("{\"asset\":{\"version\":\"2.0\"}}", {});
    twice[twice.size() - 4] = std::byte('J');
    twice[twice.size() - 3] = std::byte('S');
    twice[twice.size() - 2] = std::byte('O');
    twice[twice.size() - 1] = std::byte('N');
    EXPECT_THAT(parseGltf(twice), HasErrorId("gltf.glb"));
}

// Whatever is changed, there is an error of ours or a scene that can be used.
TEST(GltfMalformed, MutationsAreErrorsOrScenes) {
    setLogCallback([](LogLevel, std::string_view, std::string_view) {});
    const std::string text = sound().text();
    const std::vector<std::byte> glb = sound().glb();
    constexpr std::string_view letters = "0123456789.-+eE\"{}[]:,ntf \\";
    Random random(7);
    int sound_ones = 0;
    for (int run = 0; run < 4000; run++) {
        std::vector<std::byte> bytes = glb;
        if (run % 2) {
            const auto first = std::as_bytes(std::span(text));
            bytes.assign(first.begin(), first.end());
        }
        for (uint64_t edit = 1 + random.below(3); edit > 0; edit--) {
            const size_t at = random.below(bytes.size());
            bytes[at] = random.below(2) ? static_cast<std::byte>(letters[random.below(letters.size())])
                                        : static_cast<std::byte>(random.bits());
        }
        GltfOptions options;
        options.limit = 1 << 20;
        const Expected<Scene> scene = parseGltf(bytes, options);
        if (!scene) {
            const std::string_view id = scene.error().id();
            EXPECT_TRUE(id.starts_with("gltf.") || id.starts_with("image.")) << scene.error().text();
            continue;
        }
        sound_ones++;
        const Expected<Mesh> mesh = scene->mesh(scene->animations.empty() ? scene->pose() : scene->pose(0, 0.5f));
        if (mesh)
            EXPECT_THAT(mesh->validate(), IsOk());
        else
            EXPECT_TRUE(mesh.error().id().starts_with("mesh.")) << mesh.error().text();
    }
    setLogCallback({});
    EXPECT_GT(sound_ones, 200);
}

namespace {

std::string listOf(const char* element, size_t count) {
    std::string text = element;
    for (size_t i = 1; i < count; i++) text.append(",").append(element);
    return "[" + text + "]";
}

std::string documentOf(const std::string& properties) { return "{\"asset\":{\"version\":\"2.0\"}," + properties + "}"; }

/// The least limit, or a little more, that is enough.
uint64_t leastLimit(std::span<const std::byte> bytes) {
    GltfOptions options;
    uint64_t low = 0, high = 1 << 28;
    while (high - low > (low >> 6) + 256) {
        options.limit = (low + high) / 2;
        const Expected<Scene> scene = parseGltf(bytes, options);
        (!scene && scene.error().id() == "gltf.too_large" ? low : high) = options.limit;
    }
    return high;
}

/// What is beyond the limit, which is just enough, and beyond 128 bytes for each byte of JSON and the largest accessor.
void expectWithinLimits(const char* what, std::span<const std::byte> bytes, uint64_t json_size, uint64_t accessor = 0) {
    constexpr uint64_t slack = 2 << 20;  // pages of the allocator
    GltfOptions options;
    options.limit = leastLimit(bytes);
    const uint64_t peak = peakMemory([&] { (void)parseGltf(bytes, options); });
    EXPECT_LE(peak, options.limit + 128 * json_size + accessor + slack)
        << what << ": " << (static_cast<double>(peak) - static_cast<double>(options.limit)) / double(json_size)
        << " bytes a byte of JSON beside a limit of " << options.limit;
}

}  // namespace

// What takes most for its bytes. Lists have just doubled their room where they have an element more than a power of
// two.
TEST(GltfMalformed, MemoryStaysWithinItsLimits) {
    setLogCallback([](LogLevel, std::string_view, std::string_view) {});
    constexpr size_t many = (1 << 14) + 1;
    const std::string meshes = "\"accessors\":[{\"componentType\":5126,\"count\":1,\"type\":\"VEC3\"}],\"meshes\":";
    std::string names = "\"0\":0";
    for (size_t i = 1; i < many; i++) names += ",\"" + std::to_string(i) + "\":0";
    const std::pair<const char*, std::string> documents[] = {
        {"nested", std::string(many * 4, '[')},
        {"nested extras", documentOf("\"extras\":" + std::string(many * 2, '[') + std::string(many * 2, ']'))},
        {"empty objects in extras", documentOf("\"extras\":" + listOf("{}", many))},
        {"names in extras", documentOf("\"extras\":{" + names + "}")},
        {"weights", documentOf("\"nodes\":[{\"weights\":" + listOf("0", many) + "}]")},
        {"children", documentOf("\"nodes\":[{\"children\":" + listOf("0", many) + "}]")},
        {"joints", documentOf("\"nodes\":[{}],\"skins\":[{\"joints\":" + listOf("0", many) + "}]")},
        {"attributes", documentOf(meshes + "[{\"primitives\":[{\"attributes\":{" + names + "}}]}]")},
        {"targets",
         documentOf("\"meshes\":[{\"primitives\":[{\"attributes\":{},\"targets\":" + listOf("{}", many) + "}]}]")},
        {"attributes of targets",
         documentOf(meshes + "[{\"primitives\":[{\"attributes\":{},\"targets\":" + listOf("{\"\":0}", many) + "}]}]")},
        {"primitives", documentOf("\"meshes\":[{\"primitives\":" + listOf("{\"attributes\":{}}", many) + "}]")},
        {"meshes", documentOf("\"meshes\":" + listOf("{\"primitives\":[]}", many))},
        {"nodes", documentOf("\"nodes\":" + listOf("{}", many))},
        {"scenes", documentOf("\"scenes\":" + listOf("{}", many))},
        {"samplers", documentOf("\"samplers\":" + listOf("{}", many))},
        {"materials", documentOf("\"materials\":" + listOf("{}", many / 2 + 1))},
        {"data", documentOf("\"buffers\":[{\"byteLength\":1,\"uri\":\"data:application/octet-stream;base64," +
                            std::string(many * 4, 'A') + "\"}]")},
    };
    for (const auto& [name, text] : documents) expectWithinLimits(name, std::as_bytes(std::span(text)), text.size());

    // Colours of three bytes become four floats.
    constexpr size_t vertices = 3 * 87382;
    GltfBuilder builder;
    const int colors = builder.accessor(std::vector<uint8_t>(3 * vertices), "VEC3", true);
    builder.json["meshes"][0]["primitives"][0]["attributes"] = {{"POSITION", colors}, {"COLOR_0", colors}};
    const std::vector<std::byte> glb = builder.glb();
    ASSERT_THAT(parseGltf(glb), IsOk());
    expectWithinLimits("colours", glb, 1000, vertices * sizeof(Vector3f));
    EXPECT_GE(leastLimit(glb), vertices * (sizeof(Vector3f) + sizeof(Vector4f) + sizeof(uint32_t)));
    setLogCallback({});
}
