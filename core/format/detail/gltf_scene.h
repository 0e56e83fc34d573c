#pragma once

#include <glint/format/detail/gltf_accessor.h>
#include <glint/format/scene.h>

namespace glint::detail {

/// Makes a scene, but for its images, of what tinygltf has read. The document has passed checkGltf(). Errors: those of
/// GltfAccessors, "gltf.count", "gltf.vertex_index", "gltf.joint", "gltf.two_parents", "gltf.cycle", "gltf.root",
/// "gltf.key_order", "gltf.channel", "gltf.index", "gltf.value".
Expected<Scene> makeGltfScene(const tinygltf::Model& model, const GltfAccessors& accessors, GltfBudget& budget,
                              const GltfPath& root);

/// The parts of it that stand in files of their own.
Expected<SceneMesh> makeGltfMesh(const tinygltf::Mesh& source, const GltfAccessors& accessors, GltfBudget& budget,
                                 const GltfPath& path);
Expected<SceneMaterial> makeGltfMaterial(const tinygltf::Material& source, const GltfPath& path);

/// A number of tinygltf's, where it has one.
inline uint32_t gltfNumber(int index) { return index < 0 ? scene_none : static_cast<uint32_t>(index); }

}  // namespace glint::detail
