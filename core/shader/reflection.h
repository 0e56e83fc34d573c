#pragma once

#include <glint/base/expected.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace glint {

/// The stages a shader can be written for.
enum class ShaderStage : uint8_t {
    Vertex,
    Control,
    Evaluate,
    Geometry,
    Fragment,
    Compute,
    Task,
    Mesh,
    RayGen,
    RayMiss,
    Closest,
    FirstHit,
    Intersection,
    Callable,
    Count,
};

/// "Vertex", "Control", ...
const char* toString(ShaderStage stage);

/// One bit per stage.
using ShaderMask = uint32_t;
constexpr ShaderMask stageBit(ShaderStage stage) { return 1u << static_cast<uint32_t>(stage); }

/// What a shader's resource is, independent of the descriptor type an API gives it.
enum class SlotKind : uint8_t {
    Uniform,  ///< uniform block
    Storage,  ///< storage block
    Texture,  ///< sampled image; a combined image and sampler takes one Texture and one Sampler slot
    Surface,  ///< storage image
    Sampler,
    Tracing,  ///< acceleration structure
    Texel,    ///< uniform or storage texel buffer
    Table,    ///< array of unknown length
    Count,
};

/// "uniform", "storage", ...: the words messages use.
const char* toString(SlotKind kind);

/// The shape of an image, as the shader declares it.
enum class ImageDimension : uint8_t { None, Image2D, Image3D, Cube, Image2DArray, CubeArray, Image2DMultisample };

/// One resource as the shader declares it.
struct ShaderResource {
    SlotKind kind = SlotKind::Uniform;
    SlotKind element = SlotKind::Uniform;  ///< what one element of a Table is; the kind itself for anything else
    /// What the module declares there for each binding: the same as `element`, but for a Tracing that was rewritten
    /// for the software engine. That is one block, Uniform or Storage, of its `count` references, 16 bytes apart.
    SlotKind descriptor = SlotKind::Uniform;
    std::string name;      ///< the block's or the variable's name
    std::string instance;  ///< blocks: the variable's name, empty without one
    uint32_t set = 0;
    uint32_t binding = 0;
    uint32_t count = 1;          ///< array elements (the product of all dimensions), 0 for an array of unknown length
    uint32_t size = 0;           ///< blocks: bytes of the fixed part
    uint32_t stride = 0;         ///< blocks: bytes of one element of a trailing unsized array, 0 if there is none
    bool read = true;            ///< false if the shader declares it writeonly
    bool write = false;          ///< storage blocks, surfaces and storage texel buffers not declared readonly
    bool combined = false;       ///< a combined image and sampler
    bool texel_storage = false;  ///< a storage texel buffer (imageBuffer), where a uniform one (textureBuffer) is not
    /// A uniform block whose only member is one column-major matrix: such a block takes a GLM matrix byte for byte, if
    /// its columns have four rows. A lone matrix without this mark is row-major (see `has_row_major`) and must be
    /// converted first, or every product with it is transposed and no size betrays it.
    bool has_lone_matrix = false;
    bool has_row_major = false;  ///< a block in which some matrix of two or more rows and columns is row_major
    ImageDimension dimension = ImageDimension::None;
    ShaderMask stages = 0;
    std::vector<std::string> aliases;  ///< in a BindingLayout: further names of this binding, in any of the stages

    /// An acceleration structure that the software engine answers for.
    bool isRewritten() const { return kind == SlotKind::Tracing && descriptor != SlotKind::Tracing; }
    /// Elements of the binding that a list binds: a table is one.
    uint32_t descriptorCount() const { return isRewritten() || kind == SlotKind::Table ? 1 : count; }
};

/// A specialisation constant of 32 bits or bool; wider and narrower ones are left out and keep their default.
struct SpecializationConstant {
    enum class Type : uint8_t { Bool, Int, Uint, Float };
    uint32_t id = 0;
    std::string name;
    Type type = Type::Uint;
    uint32_t default_value = 0;  ///< bit pattern
};

/// A vertex attribute or a fragment output. A matrix or an array is one entry for each location it takes.
struct ShaderVariable {
    enum class Type : uint8_t { Float, Int, Uint };
    uint32_t location = 0;
    std::string name;
    Type type = Type::Float;
    uint32_t components = 4;
};

/// A variable through which a stage of ray-tracing pipelines hands something to another one, or gets it. Its location
/// is GLSL's alone: modules have none.
struct RayVariable {
    enum class Kind : uint8_t { Payload, IncomingPayload, Callable, IncomingCallable, Attribute };
    Kind kind = Kind::Payload;
    std::string name;
    uint32_t size = 0;  ///< bytes of its components, without padding
};
/// The record that a traceRayEXT names for a miss, or an executeCallableEXT.
struct RayCall {
    static constexpr uint32_t unknown = ~0u;  ///< decided as the shader runs
    bool is_callable = false;
    uint32_t record = unknown;
};
/// "payload", "incoming payload", ...: the words messages use.
const char* toString(RayVariable::Kind kind);

/// Everything Glint reads off one SPIR-V module.
struct Reflection {
    static constexpr uint32_t no_constant = ~0u;
    ShaderStage stage = ShaderStage::Compute;
    std::string entry = "main";
    std::vector<ShaderResource> resources;  ///< in (set, binding) order, unused ones included
    std::vector<SpecializationConstant> constants;
    std::vector<ShaderVariable> inputs;              ///< vertex stage: attributes
    std::vector<ShaderVariable> outputs;             ///< fragment stage: targets
    std::vector<RayVariable> ray_variables;          ///< ray-tracing stages: those that functions use
    std::vector<RayCall> ray_calls;                  ///< ray-tracing stages
    uint32_t record_size = 0;                        ///< bytes of the shaderRecordEXT block, 0 if there is none
    uint32_t push_size = 0;                          ///< bytes of the push-constant block, 0 if there is none
    std::array<uint32_t, 3> group_size = {1, 1, 1};  ///< compute, task and mesh stages; constants at their defaults
    /// Id of the specialisation constant that sets this dimension of group_size, no_constant if it is fixed.
    std::array<uint32_t, 3> group_constants = {no_constant, no_constant, no_constant};
    /// What the software engine binds for a rewritten shader, in a set of its own; none of them is a user's slot.
    std::vector<ShaderResource> hidden;
    bool uses_ray_query = false;  ///< or declares an acceleration structure outside the ray-tracing stages
    bool uses_addresses = false;  ///< buffer references
    bool uses_float64 = false;
    bool uses_int64 = false;
    bool uses_subgroups = false;
    bool uses_layer = false;       ///< vertex and evaluate stages: gl_Layer or gl_ViewportIndex
    uint32_t payload_size = 0;     ///< task and mesh stages: bytes of the taskPayloadSharedEXT variable
    uint32_t mesh_vertices = 0;    ///< mesh stage: most that a group writes
    uint32_t mesh_primitives = 0;  ///< likewise
};

/// Reads one entry point of a module, the first one if `entry` is empty. Resources that the entry point does not use
/// are included, so reflect before optimising. Checks the module first: malformed words are an error, never a crash.
/// Errors: "shader.reflect" (malformed, no such entry point, or a resource that Glint has no kind for: subpass inputs,
/// 1D, rectangle and multisampled array images). Safe to call from several threads.
Expected<Reflection> reflect(std::span<const uint32_t> words, std::string_view entry = {});

/// The resources of all stages of a program, merged: what a layout is made from and what setUniform(i) counts in.
struct BindingLayout {
    /// Merged resources in (set, binding) order; `stages` is the union.
    std::vector<ShaderResource> resources;
    std::vector<ShaderResource> hidden;  ///< likewise, the software engine's own
    /// slots[kind][i] is the index into `resources` of slot i of that kind; aliases of one binding share a resource.
    std::array<std::vector<uint32_t>, static_cast<size_t>(SlotKind::Count)> slots;
    uint32_t push_size = 0;
    ShaderMask push_stages = 0;
    ShaderMask stages = 0;
    uint32_t set_count = 0;  ///< highest set + 1, hidden ones included; 0 without resources

    const ShaderResource* find(SlotKind kind, uint32_t slot) const;
    /// Slot of the resource with this name (block name, instance name or variable name, in any stage), -1 if there is
    /// none.
    int32_t findSlot(SlotKind kind, std::string_view name) const;
    /// Slot of the resource at this set and binding, -1 if there is none.
    int32_t findSlot(SlotKind kind, uint32_t set, uint32_t binding) const;
};

/// Merges the stages of one program; a stage may occur more than once (a Traversal's hit shaders). Where stages declare
/// blocks of different sizes for one binding, the largest counts. Aliases in a table may differ in image dimension,
/// which is then None. Errors: "shader.binding_conflict" when stages, or aliases within one, disagree about a binding's
/// kind, count or dimension, naming both stages and both names.
Expected<BindingLayout> mergeLayouts(std::span<const Reflection* const> stages);

}  // namespace glint
