#pragma once

#include <glint/shader/shader_compiler.h>

#include <cstdint>
#include <span>
#include <string>

namespace glint {

/// What a shader can be converted to.
enum class ShadingLanguage : uint8_t {
    VulkanGLSL,  ///< GLSL 4.60 for Vulkan: sets and bindings as they were
    GLSL,        ///< GLSL 4.60 for OpenGL 4.6
    ESSL,        ///< GLSL ES 3.20
    HLSL,        ///< shader model 6.0, 6.5 with ray queries; sets are spaces
    MSL,         ///< Metal 2.4; the text says which index a resource has
    Count,
};

/// "Vulkan GLSL", "GLSL", ...
const char* toString(ShadingLanguage language);

namespace shader {

/// SPIR-V to the text of another language, by SPIRV-Cross. `source` gives the stage, the entry point and the name in
/// messages; `words` are valid, and best not optimised, which keeps more names and structure.
///
/// Clip space stays that of Glint (Y up, depth 0 to 1): for OpenGL and OpenGL ES, whose depth goes from -1 to 1, vertex
/// shaders get a line that converts. These two know no sets: their bindings count from 0 for each of uniform blocks,
/// storage blocks, samplers and images, in the order of (set, binding), and push constants become a uniform structure.
/// Textures and samplers that are separate are joined there. Specialisation constants keep their defaults, and can be
/// replaced by macros where the language has them.
///
/// What cannot be converted faithfully is refused with "shader.convert", never converted to something else: ray-tracing
/// stages, and task and mesh shaders, but to Vulkan GLSL; tessellation and geometry shaders to HLSL and MSL; ray
/// queries to GLSL and ESSL; to MSL also ray queries with flags or a mask other than 0xff, which SPIRV-Cross drops;
/// buffer addresses but to Vulkan GLSL and MSL; shader printf but to Vulkan GLSL. Errors: "shader.convert", and those
/// of validate and reflect.
Expected<std::string> convert(const ShaderSource& source, std::span<const uint32_t> words, ShadingLanguage language);

}  // namespace shader

}  // namespace glint
