#pragma once

// For sources only.

#include <cstdint>
#include <vector>

namespace glint::shader {

/// glslang declares all of gl_MeshPrimitivesEXT where a mesh shader writes one member of it, and with
/// gl_PrimitiveShadingRateEXT asks every device for VK_KHR_fragment_shading_rate. Takes that member out of a valid
/// module, unless the shader names it, and what asks for the extension.
void dropUnusedShadingRate(std::vector<uint32_t>& words);

}  // namespace glint::shader
