#pragma once

#include <glint/device/device.h>
#include <glint/format/scene.h>
#include <glint/graphics/mesh_model.h>

#include <cstdint>
#include <map>
#include <source_location>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace glint {

/// A scene on a device: its meshes as a pipeline's vertices, its images as textures with mip levels, and where
/// everything is at one moment. What the vertices are shaded with is the program's.
///
///     SceneModel model(device, pipeline, *scene);
///     ...
///     model.setPose(scene->pose(0, time));
///     for (const SceneModel::Item& item : model.getItems()) {
///         command.setPushConstants(item.vertices);
///         command.setTexture(0, model.getTexture(scene->materials[item.material].base_color_texture, true));
///         model.draw(command, item);
///     }
///
/// Vertices are skinned, and morphed, where the shader reads the buffers of transforms, weights and targets:
/// <glint/skin.h> and docs/models.md. Copies share what is on the device. Carries its first error, as handles do.
class SceneModel {
public:
    using Where = std::source_location;
    using Layout = MeshModel::Layout;

    /// Where a vertex shader finds what moves a vertex. 24 bytes, all of them uint.
    struct Vertices {
        uint32_t first_transform = 0;  ///< of joint 0; of the node if it has no skin
        uint32_t joint_step = 0;       ///< 1, or 0 if the item has no skin: transform first_transform + joint * step
        uint32_t first_weight = 0;     ///< of the morph targets
        uint32_t targets = 0;          ///< how many
        uint32_t first_target = 0;  ///< vertex v of target k is record first_target + k * count + v, v = gl_VertexIndex
        uint32_t count = 0;         ///< of the mesh's vertices
    };

    /// A primitive of a shown node: one draw.
    struct Item {
        uint32_t node = 0;               ///< of Scene::nodes
        uint32_t mesh = 0;               ///< of Scene::meshes
        uint32_t primitive = 0;          ///< of the mesh
        uint32_t material = scene_none;  ///< of Scene::materials
        Vertices vertices;
    };

    SceneModel() = default;
    /// These are create(); the error is carried.
    SceneModel(const Device& device, const Pipeline& pipeline, const Scene& scene, std::string_view name = "scene",
               Where where = Where::current());
    SceneModel(const Device& device, const Layout& layout, const Scene& scene, std::string_view name = "scene",
               Where where = Where::current());

    /// Uploads all of it, at rest. A layout with tangents has them made (createTangents) for primitives whose material
    /// has a normal map and that lack them. Meshes that no shown node has stay on the host, and so do images that no
    /// material of an item uses. Errors: those of Scene::validate, MeshModel::create, Image::convert and of the device,
    /// "model.no_items" (no shown node has triangles), "model.out_of_memory".
    Status create(const Device& device, const Pipeline& pipeline, const Scene& scene, std::string_view name = "scene",
                  Where where = Where::current());
    Status create(const Device& device, const Layout& layout, const Scene& scene, std::string_view name = "scene",
                  Where where = Where::current());

    /// True once created without an error.
    explicit operator bool() const { return device_ && !error_; }
    Error error() const { return device_ || error_ ? error_ : device_.error(); }

    /// Queues the upload of a pose of the scene that the model was made of: lists submitted before have the old one,
    /// lists submitted from now on this one. Errors: "model.pose" (of another scene).
    Status setPose(const ScenePose& pose, Where where = Where::current());

    /// In the order of a walk from the scene's roots, but those whose material blends come last.
    const std::vector<Item>& getItems() const { return items_; }
    /// Draws an item with the command's pipeline, which has the layout's attributes. Errors: "model.item" (of
    /// another model), those of MeshModel::draw.
    void draw(Command& command, const Item& item, Where where = Where::current()) const;

    /// Transform3x4 each: to the world. Joints' are those of Scene::jointMatrices.
    const Buffer& getTransforms() const { return transforms_; }
    /// float each, of the items' morph targets.
    const Buffer& getWeights() const { return weights_; }
    /// Nine floats a record: what a target adds to a vertex' position, normal and tangent.
    const Buffer& getTargets() const { return targets_; }

    /// The texture that a material reads, RGBA of 8 bits; gray images are gray in it. `is_color` converts from sRGB.
    /// Null if it reads none, or none that an item's material reads in this way (base colour and emission as colours,
    /// all others not).
    const Texture& getTexture(const SceneTextureUse& use, bool is_color) const;
    /// How it reads it; the first wrap mode stands for both. One that repeats and is trilinear for no texture.
    const Sampler& getSampler(const SceneTextureUse& use) const;

    /// Triangles of all items, bytes of all textures, and joints of all skins.
    uint64_t getTriangles() const { return triangles_; }
    uint64_t getTextureSize() const { return texture_size_; }
    uint32_t getJoints() const { return joints_; }

private:
    Error build(const Layout& layout, const Scene& scene, Where where);
    void findItems(const Scene& scene);
    Error uploadMeshes(const Layout& layout, const Scene& scene, Where where);
    Error uploadTextures(const Scene& scene, Where where);
    Error uploadTexture(const Scene& scene, const SceneTextureUse& use, bool is_color, Where where);
    Status fail(const Error& error);

    Device device_;
    Error error_;
    std::string name_ = "scene";
    std::vector<Item> items_;
    std::map<uint32_t, MeshModel> models_;  ///< of the shown meshes
    /// What setPose() puts where: for skins and nodes the first of their transforms, for nodes the first of their
    /// weights.
    std::vector<SceneSkin> skins_;
    std::map<uint32_t, uint32_t> skin_places_, node_places_, weight_places_;
    std::vector<size_t> weight_counts_;  ///< of each node of the scene
    uint64_t transform_count_ = 0, weight_count_ = 0;
    Buffer transforms_, weights_, targets_;

    std::map<std::pair<uint32_t, bool>, Texture> textures_;  ///< by image and way to read it
    std::vector<uint32_t> images_;                           ///< of the scene's textures
    std::vector<Sampler> samplers_;                          ///< of the scene's textures, and one for none
    uint64_t triangles_ = 0, texture_size_ = 0;
    uint32_t joints_ = 0;
};
static_assert(sizeof(SceneModel::Vertices) == 24);

}  // namespace glint
