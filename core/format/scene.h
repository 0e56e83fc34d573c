#pragma once

#include <glint/base/expected.h>
#include <glint/base/status.h>
#include <glint/format/image.h>
#include <glint/format/mesh.h>
#include <glint/math/math.h>

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace glint {

/// In place of the number of an element: there is none.
constexpr uint32_t scene_none = UINT32_MAX;

/// How a part of a material reads a texture.
struct SceneTextureUse {
    uint32_t texture = scene_none;  ///< of Scene::textures
    uint32_t texcoord = 0;          ///< which of ScenePrimitive::texcoords
    /// The place read is `offset + R * (scale * uv)` with the rows (cos, sin) and (-sin, cos) of R: the picture turns
    /// clockwise on the surface by `rotation` in radians. KHR_texture_transform.
    Vector2f offset = {0, 0};
    float rotation = 0.0f;
    Vector2f scale = {1, 1};
    bool operator==(const SceneTextureUse&) const = default;
};

/// What the alpha of a material means.
enum class SceneAlpha : uint8_t {
    Opaque,  ///< alpha is passed over
    Mask,    ///< visible where alpha >= SceneMaterial::alpha_cutoff
    Blend,
};

/// Metallic-roughness, as glTF 2.0 defines it. Factors are linear and multiply what is read of the texture; the
/// textures of base colour and emission hold sRGB values, all others linear ones.
struct SceneMaterial {
    std::string name;
    Vector4f base_color = {1, 1, 1, 1};  ///< in [0, 1]
    SceneTextureUse base_color_texture;
    float metallic = 1.0f;                       ///< in [0, 1]
    float roughness = 1.0f;                      ///< in [0, 1]
    SceneTextureUse metallic_roughness_texture;  ///< metallic in blue, roughness in green
    SceneTextureUse normal_texture;              ///< tangent space, 2 * value - 1
    float normal_scale = 1.0f;                   ///< of x and y
    SceneTextureUse occlusion_texture;           ///< in red
    float occlusion_strength = 1.0f;             ///< in [0, 1]
    Vector3f emission = {0, 0, 0};               ///< in cd/m^2; strength (KHR_materials_emissive_strength) included
    SceneTextureUse emission_texture;
    float transmission = 0.0f;             ///< in [0, 1]; KHR_materials_transmission
    SceneTextureUse transmission_texture;  ///< in red
    float ior = 1.5f;                      ///< 0 or at least 1; KHR_materials_ior
    SceneAlpha alpha = SceneAlpha::Opaque;
    float alpha_cutoff = 0.5f;
    bool is_double_sided = false;
    bool is_unlit = false;  ///< base colour alone; KHR_materials_unlit
    bool operator==(const SceneMaterial&) const = default;
};

/// How an image is sampled: between its texels, and beyond its edges.
enum class SceneFilter : uint8_t { Nearest, Linear };
enum class SceneWrap : uint8_t { Repeat, Mirror, Clamp };

/// An image with the way to read it.
struct SceneTexture {
    std::string name;
    uint32_t image = scene_none;  ///< of Scene::images
    SceneFilter mag_filter = SceneFilter::Linear;
    SceneFilter min_filter = SceneFilter::Linear;
    std::optional<SceneFilter> mip_filter = SceneFilter::Linear;  ///< without one, mip levels are not used
    std::array<SceneWrap, 2> wrap = {SceneWrap::Repeat, SceneWrap::Repeat};
    bool operator==(const SceneTexture&) const = default;
};

/// A picture that materials use.
struct SceneImage {
    std::string name;
    Image image;  ///< as decodePng and decodeJpeg give it; empty if images were not asked for
    bool operator==(const SceneImage&) const = default;
};

/// What a morph target adds at weight 1: each array is empty or has an element for each vertex.
struct SceneMorphTarget {
    std::vector<Vector3f> positions;
    std::vector<Vector3f> normals;
    std::vector<Vector3f> tangents;
    bool operator==(const SceneMorphTarget&) const = default;
};

/// Indexed triangles of one material. Every array but `positions`, `indices` and `targets` is empty or has an element
/// for each vertex.
struct ScenePrimitive {
    uint32_t material = scene_none;  ///< of Scene::materials
    std::vector<uint32_t> indices;   ///< three for each triangle
    std::vector<Vector3f> positions;
    std::vector<Vector3f> normals;                   ///< of unit length
    std::vector<Vector4f> tangents;                  ///< of unit length; w = 1 or -1 is the side of the bitangent
    std::array<std::vector<Vector2f>, 2> texcoords;  ///< v goes down the picture
    std::vector<Vector4f> colors;                    ///< linear; to multiply the base colour with
    std::vector<std::array<uint16_t, 4>> joints;     ///< of the skin of the node
    std::vector<Vector4f> weights;                   ///< of the joints: none negative, their sum is 1
    std::vector<SceneMorphTarget> targets;

    /// Checks what the fields promise, and that the numbers of a vertex are finite. Errors: "scene.attribute_count"
    /// (arrays that are not as long as they have to be), "scene.vertex_index", "scene.not_finite", "scene.weights"
    /// (negative, or their sum is off 1 by more than 2^-16).
    Status validate() const;
    bool operator==(const ScenePrimitive&) const = default;
};

/// Primitives that are drawn together.
struct SceneMesh {
    std::string name;
    std::vector<ScenePrimitive> primitives;  ///< all with the same number of targets
    std::vector<float> weights;              ///< of the morph targets, one each
    bool operator==(const SceneMesh&) const = default;
};

/// p' = translation + rotation * (scale * p). The rotation is a quaternion x, y, z, w of any length; of length zero it
/// turns nothing.
struct SceneTransform {
    Vector3f translation = {0, 0, 0};
    Vector4f rotation = {0, 0, 0, 1};
    Vector3f scale = {1, 1, 1};
    Matrix4x4f matrix() const;
    bool operator==(const SceneTransform&) const = default;
};

/// A place in the scene, with what stands there.
struct SceneNode {
    std::string name;
    std::vector<uint32_t> children;    ///< of Scene::nodes: a forest, so no node has two parents
    SceneTransform transform;          ///< to the parent
    std::optional<Matrix4x4f> matrix;  ///< if set, stands for the transform; such a node cannot be animated
    uint32_t mesh = scene_none;        ///< of Scene::meshes
    uint32_t skin = scene_none;        ///< of Scene::skins; the mesh has joints and weights then
    uint32_t camera = scene_none;      ///< of Scene::cameras; looks along -Z with +Y up
    uint32_t light = scene_none;       ///< of Scene::lights; shines along -Z
    std::vector<float> weights;        ///< of the morph targets; empty means the mesh's
    bool operator==(const SceneNode&) const = default;
};

/// The joints that move a mesh.
struct SceneSkin {
    std::string name;
    std::vector<uint32_t> joints;          ///< of Scene::nodes
    std::vector<Matrix4x4f> inverse_bind;  ///< one for each joint: mesh to joint
    bool operator==(const SceneSkin&) const = default;
};

/// What an animation changes of a node, and how it goes from key to key.
enum class ScenePath : uint8_t { Translation, Rotation, Scale, Weights };
enum class SceneInterpolation : uint8_t { Step, Linear, CubicSpline };

/// One property of one node over time.
struct SceneChannel {
    uint32_t node = scene_none;  ///< of Scene::nodes
    ScenePath path = ScenePath::Translation;
    SceneInterpolation interpolation = SceneInterpolation::Linear;
    std::vector<float> times;   ///< in seconds, increasing
    std::vector<float> values;  ///< 3, 4, 3 or weights each; for cubic splines in-tangent, value and out-tangent
    bool operator==(const SceneChannel&) const = default;
};

/// Changes of several nodes over one time.
struct SceneAnimation {
    std::string name;
    std::vector<SceneChannel> channels;  ///< no two of one node and path
    /// The last key's time, in seconds.
    float duration() const;
    bool operator==(const SceneAnimation&) const = default;
};

/// A camera without its place, which is its node's.
struct SceneCamera {
    std::string name;
    bool is_perspective = true;
    float fov = 1.0f;             ///< perspective: from bottom to top of the picture, in radians, in (0, pi)
    float aspect = 0.0f;          ///< perspective: width / height; 0 is the picture's
    Vector2f half_size = {1, 1};  ///< orthographic: from the centre to the right and upper edge
    float near = 0.1f;            ///< distance of the near plane
    float far = 0.0f;             ///< distance of the far plane; 0 is infinite, perspective only
    bool operator==(const SceneCamera&) const = default;
};

/// Where light comes from: one direction, a point, or a point within a cone.
enum class SceneLightType : uint8_t { Directional, Point, Spot };

/// KHR_lights_punctual.
struct SceneLight {
    std::string name;
    SceneLightType type = SceneLightType::Point;
    Vector3f color = {1, 1, 1};     ///< linear
    float intensity = 1.0f;         ///< lux for directional lights, else candela
    float range = 0.0f;             ///< where point and spot lights end; 0 is infinite
    float inner_angle = 0.0f;       ///< spot: from the axis to where the light begins to fade, in radians
    float outer_angle = pi / 4.0f;  ///< spot: to where it has faded; at most pi / 2
    bool operator==(const SceneLight&) const = default;
};

/// Where everything is at one moment.
struct ScenePose {
    std::vector<Matrix4x4f> world;            ///< for each node: to the world
    std::vector<std::vector<float>> weights;  ///< for each node: of its mesh's morph targets
};

/// What a glTF file holds: nodes with meshes, materials, textures, skins, animations, cameras and lights. A plain
/// value; fill it or load it. Right-handed, lengths in metres, +Y up. One that is filled by hand has to keep what the
/// fields promise (numbers of elements in range, sizes of arrays), which validate() checks; what load() and parseGltf()
/// give does.
struct Scene {
    std::vector<SceneNode> nodes;
    std::vector<uint32_t> roots;  ///< the nodes that are shown, with all below them; none is another's child
    std::vector<SceneMesh> meshes;
    std::vector<SceneMaterial> materials;
    std::vector<SceneTexture> textures;
    std::vector<SceneImage> images;
    std::vector<SceneSkin> skins;
    std::vector<SceneAnimation> animations;
    std::vector<SceneCamera> cameras;
    std::vector<SceneLight> lights;

    /// Reads a .gltf or .glb file and the files that it names, which have to lie beside or below it: see parseGltf for
    /// what is read, the meaning of `limit` and `with_images`, and the errors, to which those of readFile come.
    static Expected<Scene> load(const std::filesystem::path& path, uint64_t limit = Mesh::default_limit,
                                bool with_images = true);

    /// Errors, which name the element: those of ScenePrimitive::validate; "scene.index_range" (a number of an element
    /// that is not there), "scene.tree" (the nodes are no forest, or a root has a parent or stands there twice),
    /// "scene.joint_range" (a vertex follows a joint that the skin does not have), "scene.attribute_count" (also of
    /// weights, targets, inverse binds and values of keys), "scene.not_finite" (also of transforms, matrices and keys),
    /// "scene.key_order" (a channel without keys, or keys that are not one after the other), "scene.channel" (what
    /// cannot move, or one property twice).
    Status validate() const;

    /// Where everything is at rest, or at a time of an animation. Before the first and after the last key a property is
    /// as it is there, and so it is where the time is NaN; what no channel moves is at rest. Rotations go along the
    /// shorter arc; cubic splines of them are brought to unit length, and where they pass through zero nothing turns.
    /// An animation that is not there moves nothing.
    ScenePose pose() const;
    ScenePose pose(uint32_t animation, float time) const;

    /// For each joint of a skin: mesh to world, which is what the weights of a vertex blend.
    std::vector<Matrix4x4f> jointMatrices(const ScenePose& pose, uint32_t skin) const;

    /// The shown nodes' triangles in the world, morphed and skinned; a part for each primitive, named after its node or
    /// else its mesh, with its material. Nodes in the order of a walk from the roots, parents first.
    ///
    /// - Normals are kept if every primitive has them, and so are the first texture coordinates; otherwise they are
    /// left
    ///   out with the warning "mesh.attribute_dropped".
    /// - Triangles of a node that mirrors are turned, so that front faces stay counter-clockwise. A skinned mesh
    /// follows
    ///   its joints and not its node.
    ///
    /// Errors: "mesh.too_large" (more than `limit` bytes), "mesh.no_faces", "mesh.not_finite" (a position overflows).
    Expected<Mesh> mesh(const ScenePose& pose, uint64_t limit = Mesh::default_limit) const;

    bool operator==(const Scene&) const = default;
};

}  // namespace glint
