#pragma once

// Embree, a second opinion: another library's tracing of the same rays in float32, on the CPU.

#include <glint/graphics/ray_caster.h>

#include <span>
#include <string>
#include <vector>

namespace glint::test {

/// Whether Embree's watertight triangle test (RTC_SCENE_FLAG_ROBUST) or its faster default is used.
enum class EmbreeMode : bool { Fast, Robust };

/// The closest hits of rays, one at a time. Primitives count as in the mesh, the geometry is 0. Triangles and rays have
/// to be finite. `seconds` gets the time of the casting alone, by one thread.
std::vector<RayHit> castWithEmbree(const Mesh& mesh, std::span<const Ray> rays, EmbreeMode mode,
                                   double* seconds = nullptr);

/// "Embree 3.13.5".
std::string embreeName();

}  // namespace glint::test
