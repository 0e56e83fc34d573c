#include "shader_source.h"

#include <algorithm>

namespace glint::shader {

namespace {

/// Everything that changes nothing for a shader that does not use it. Left out: extensions whose keywords are plain
/// words (demote).
constexpr std::string_view common[] = {
    "GL_ARB_gpu_shader_int64",
    "GL_EXT_buffer_reference",
    "GL_EXT_buffer_reference2",
    "GL_EXT_buffer_reference_uvec2",
    "GL_EXT_control_flow_attributes",
    "GL_EXT_debug_printf",
    "GL_EXT_nonuniform_qualifier",
    "GL_EXT_null_initializer",
    "GL_EXT_ray_flags_primitive_culling",
    "GL_EXT_ray_query",
    "GL_EXT_samplerless_texture_functions",
    "GL_EXT_scalar_block_layout",
    "GL_EXT_shader_16bit_storage",
    "GL_EXT_shader_8bit_storage",
    "GL_EXT_shader_atomic_float",
    "GL_EXT_shader_atomic_float2",
    "GL_EXT_shader_atomic_int64",
    "GL_EXT_shader_image_int64",
    "GL_EXT_shader_image_load_formatted",
    "GL_EXT_shader_realtime_clock",
    "GL_KHR_memory_scope_semantics",
    "GL_KHR_shader_subgroup_arithmetic",
    "GL_KHR_shader_subgroup_ballot",
    "GL_KHR_shader_subgroup_basic",
    "GL_KHR_shader_subgroup_clustered",
    "GL_KHR_shader_subgroup_quad",
    "GL_KHR_shader_subgroup_shuffle",
    "GL_KHR_shader_subgroup_shuffle_relative",
    "GL_KHR_shader_subgroup_vote",
};
/// With any of these the compiler resolves overloads so strictly that sqrt(2) is ambiguous: only for shaders that use
/// their types. 64-bit integers come from GL_ARB_gpu_shader_int64, which leaves overloads alone; so subgroup operations
/// on them need an #extension line of the shader's own.
constexpr std::string_view explicit_types[] = {
    "GL_EXT_shader_explicit_arithmetic_types",         "GL_EXT_shader_explicit_arithmetic_types_float16",
    "GL_EXT_shader_explicit_arithmetic_types_float32", "GL_EXT_shader_explicit_arithmetic_types_float64",
    "GL_EXT_shader_explicit_arithmetic_types_int16",   "GL_EXT_shader_explicit_arithmetic_types_int32",
    "GL_EXT_shader_explicit_arithmetic_types_int64",   "GL_EXT_shader_explicit_arithmetic_types_int8",
    "GL_EXT_shader_subgroup_extended_types_float16",   "GL_EXT_shader_subgroup_extended_types_int16",
    "GL_EXT_shader_subgroup_extended_types_int64",     "GL_EXT_shader_subgroup_extended_types_int8",
};
constexpr std::string_view vertex[] = {"GL_ARB_shader_viewport_layer_array", "GL_EXT_multiview"};
constexpr std::string_view fragment[] = {"GL_ARB_shader_stencil_export", "GL_EXT_fragment_shader_barycentric",
                                         "GL_EXT_mesh_shader", "GL_EXT_multiview"};
constexpr std::string_view compute[] = {"GL_EXT_shared_memory_block"};
constexpr std::string_view mesh[] = {"GL_EXT_mesh_shader", "GL_EXT_shared_memory_block"};
// GL_EXT_ray_cull_mask would ask every device for VK_KHR_ray_tracing_maintenance1.
constexpr std::string_view tracing[] = {"GL_EXT_ray_tracing"};

std::span<const std::string_view> extensionsOf(ShaderStage stage) {
    switch (stage) {
        case ShaderStage::Vertex: return vertex;
        case ShaderStage::Fragment: return fragment;
        case ShaderStage::Compute: return compute;
        case ShaderStage::Task:
        case ShaderStage::Mesh: return mesh;
        case ShaderStage::RayGen:
        case ShaderStage::RayMiss:
        case ShaderStage::Closest:
        case ShaderStage::FirstHit:
        case ShaderStage::Intersection:
        case ShaderStage::Callable: return tracing;
        default: return {};
    }
}

/// float16_t, u8vec4, f64mat3x2, ...: the types of explicit width besides 64-bit integers.
bool isExplicitType(std::string_view name) {
    static constexpr std::string_view scalars[] = {"int8_t",   "int16_t",   "int32_t",   "uint8_t",  "uint16_t",
                                                   "uint32_t", "float16_t", "float32_t", "float64_t"};
    if (std::find(std::begin(scalars), std::end(scalars), name) != std::end(scalars)) return true;
    const char kind = name[0];
    name.remove_prefix(1);
    const size_t digits = name.starts_with('8') ? 1 : 2;
    const std::string_view width = name.substr(0, digits);
    const bool has_width =
        kind == 'f' ? width == "16" || width == "32" || width == "64" : width == "8" || width == "16" || width == "32";
    if (!has_width) return false;
    name.remove_prefix(digits);
    return name.starts_with("vec") || (kind == 'f' && name.starts_with("mat"));
}

std::string makeLines(std::span<const std::string_view> names) {
    std::string text;
    for (std::string_view name : names) text.append("#extension ").append(name).append(" : enable\n");
    return text;
}

}  // namespace

bool usesExplicitTypes(std::string_view text) {
    const auto is_name = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    };
    for (size_t i = 0; i < text.size();) {
        size_t end = i;
        while (end < text.size() && is_name(text[end])) end++;
        if (end - i >= 5 && (text[i] == 'i' || text[i] == 'u' || text[i] == 'f') &&
            isExplicitType(text.substr(i, end - i)))
            return true;
        i = end + 1;
    }
    return false;
}

std::string extensionLines(ShaderStage stage, bool with_explicit_types) {
    std::string text = makeLines(common) + makeLines(extensionsOf(stage));
    if (with_explicit_types) text += makeLines(explicit_types);
    return text;
}

}  // namespace glint::shader
