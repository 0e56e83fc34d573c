#pragma once

#include <glint/format/scene.h>

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace glint {

/// Gives the bytes of a file that a document names, of at most `limit` bytes. `name` is a relative path with `/`,
/// decoded, and without `..`.
using GltfReader = std::function<Expected<std::vector<std::byte>>(const std::string& name, uint64_t limit)>;

/// What is read of a document, and how much of it.
struct GltfOptions {
    /// Names the document in errors.
    std::string name = "glTF";
    /// Bounds the bytes of the scene, of what the document names, and of what tinygltf makes of it. Beside them the
    /// reader takes at most 128 bytes for each byte of the JSON text, the largest accessor once more, and five times an
    /// image while it is decoded.
    uint64_t limit = Mesh::default_limit;
    /// Without images, Scene::images holds their names alone, and their files are not asked for.
    bool with_images = true;
    /// Without one, everything has to be within the document.
    GltfReader read;
};

/// Reads a glTF 2.0 document, JSON or binary (GLB), with tinygltf, behind a guard: the library sees only the properties
/// that are listed here, checked against the specification's types, ranges and references.
///
/// - Materials (metallic-roughness), textures, PNG and JPEG images, nodes, skins, animations, cameras; the extensions
///   KHR_lights_punctual, KHR_materials_emissive_strength, KHR_materials_ior, KHR_materials_transmission,
///   KHR_materials_unlit, KHR_mesh_quantization and KHR_texture_transform. Other extensions are passed over unless the
///   document requires them.
/// - POSITION, NORMAL, TANGENT, TEXCOORD_0 and 1, COLOR_0, JOINTS_0, WEIGHTS_0 and morph targets of the first three;
///   integers, normalised or not, become float32; sparse accessors are filled in. Further sets are left out with the
///   warning "gltf.attribute_dropped".
/// - Triangle strips and fans become triangles, with the winding that the specification gives them; primitives without
///   indices get them; points and lines are left out with the warning "gltf.primitive_dropped".
/// - Normals and tangents are brought to unit length ((0, 0, 1) and (1, 0, 0) if they have none), weights of joints
///   to a sum of 1 (all on the first joint if they are 0).
/// - One scene is read: the document's default one, else the first, else all nodes without a parent.
///
/// Every error names the document and the element: "nodes[3].children[1]". Errors:
/// - the container: "gltf.glb", "gltf.json", "gltf.version", "gltf.extension" (required and unknown), "gltf.library"
///   (tinygltf refuses the document);
/// - a property: "gltf.type", "gltf.missing", "gltf.value", "gltf.index" (names an element that is not there);
/// - binary data: "gltf.uri", "gltf.buffer_size", "gltf.view_range", "gltf.accessor_range", "gltf.accessor_type",
///   "gltf.alignment", "gltf.stride", "gltf.sparse", "gltf.not_finite", "gltf.too_large", and what `read` gives;
/// - meshes: "gltf.count" (attributes, targets or indices that do not fit each other), "gltf.vertex_index",
///   "gltf.joint";
/// - nodes and animations: "gltf.two_parents", "gltf.cycle", "gltf.root", "gltf.key_order", "gltf.channel";
/// - images: "gltf.image_format" (neither PNG nor JPEG), "image.png_malformed", "image.jpeg_malformed",
///   "image.jpeg_unsupported".
Expected<Scene> parseGltf(std::span<const std::byte> bytes, const GltfOptions& options = {});

}  // namespace glint
