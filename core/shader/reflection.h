#pragma once

#include <glint/base/expected.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace glint {

/// The stages a shader can be written for.
enum class ShaderStage : uint8_t {
    Vertex, Control, Evaluate, Geometry, Fragment, Compute, Task, Mesh,
    RayGen, RayMiss, Closest, FirstHit, Intersection, Callable,
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

enum class ImageDimension : uint8_t { None, Image2D, Image3D, Cube, Image2DArray, CubeArray, Image2DMultisample };

/// One resource as the shader declares it.
struct ShaderResource {
    SlotKind kind = SlotKind::Uniform;
    std::string name;        ///< the block's or the variable's name
    uint32_t set = 0;
    uint32_t binding = 0;
    uint32_t count = 1;      ///< array elements, 0 for an array of unknown length
    uint32_t size = 0;       ///< blocks: bytes of the fixed part
    uint32_t stride = 0;     ///< blocks: bytes of one element of a trailing unsized array, 0 if there is none
    bool read = true;        ///< false if the shader declares it writeonly
    bool write = false;      ///< storage blocks, surfaces and storage texel buffers not declared readonly
    bool combined = false;   ///< a combined image and sampler
    bool has_lone_matrix = false;  ///< a uniform block whose only member is one column-major matrix
    ImageDimension dimension = ImageDimension::None;
    ShaderMask stages = 0;
};

struct SpecializationConstant {
    enum class Type : uint8_t { Bool, Int, Uint, Float };
    uint32_t id = 0;
    std::string name;
    Type type = Type::Uint;
    uint32_t default_value = 0;  ///< bit pattern
};

/// A vertex attribute or a fragment output.
struct ShaderVariable {
    enum class Type : uint8_t { Float, Int, Uint };
    uint32_t location = 0;
    std::string name;
    Type type = Type::Float;
    uint32_t components = 4;
};

/// Everything Glint reads off one SPIR-V module.
struct Reflection {
    ShaderStage stage = ShaderStage::Compute;
    std::string entry = "main";
    std::vector<ShaderResource> resources;      ///< in (set, binding) order, unused ones included
    std::vector<SpecializationConstant> constants;
    std::vector<ShaderVariable> inputs;         ///< vertex stage: attributes
    std::vector<ShaderVariable> outputs;        ///< fragment stage: targets
    uint32_t push_size = 0;                     ///< bytes of the push-constant block, 0 if there is none
    std::array<uint32_t, 3> group_size = {1, 1, 1};  ///< compute, task and mesh stages
    bool uses_ray_query = false;
    bool uses_addresses = false;                ///< buffer references
    bool uses_float64 = false;
    bool uses_int64 = false;
    bool uses_subgroups = false;
};

/// Reads a module that has passed validation. Errors: "shader.reflect".
Expected<Reflection> reflect(std::span<const uint32_t> words);

/// The resources of all stages of a program, merged: what a layout is made from and what setUniform(i) counts in.
struct BindingLayout {
    /// Merged resources in (set, binding) order; `stages` is the union.
    std::vector<ShaderResource> resources;
    /// slots[kind][i] is the index into `resources` of slot i of that kind; aliases of one binding share a resource.
    std::array<std::vector<uint32_t>, static_cast<size_t>(SlotKind::Count)> slots;
    uint32_t push_size = 0;
    ShaderMask push_stages = 0;
    ShaderMask stages = 0;
    uint32_t set_count = 0;  ///< highest set + 1, 0 without resources

    const ShaderResource* find(SlotKind kind, uint32_t slot) const;
    /// Slot of the resource with this name (block name, instance name or variable name), -1 if there is none.
    int32_t findSlot(SlotKind kind, std::string_view name) const;
    /// Slot of the resource at this set and binding, -1 if there is none.
    int32_t findSlot(SlotKind kind, uint32_t set, uint32_t binding) const;
};

/// Merges the stages of one program. Errors: "shader.binding_conflict" when stages disagree about a binding's kind,
/// count or dimension, naming both stages and both names.
Expected<BindingLayout> mergeLayouts(std::span<const Reflection* const> stages);

}  // namespace glint
