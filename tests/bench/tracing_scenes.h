#pragma once

// Meshes and rays for the benchmarks of tracing.

#include "bench/bench.h"

#include <glint/format/mesh.h>
#include <glint/graphics/ray_caster.h>

#include <filesystem>
#include <string>
#include <vector>

namespace glint::bench {

struct TracingScene {
    std::string name;
    Mesh mesh;
    std::vector<Transform3x4> instances;  ///< empty: the mesh itself
    std::vector<Ray> camera;              ///< size x size, 55 degrees (instances: 60), pixels along a Z-order curve
    std::vector<Ray> bounce;              ///< cosine-weighted, from where those hit
};

/// "bunny": the Stanford bunny of Debian's package glmark2-data, in the order of its file; "100k", "1m": a torus with
/// bumps of that many triangles, in grid order; "dragon": the file at dragonPath(). These stand in a closed room of 12
/// triangles, so every ray hits. "instances": what 05_hello_tracing shows at time 0, 4,608 instances of a torus of
/// 90,112 triangles in the order of a curve; a third of the camera's rays miss, and have no bounces. Throws if a file
/// is missing. `size` is a power of two.
TracingScene makeTracingScene(const std::string& name, uint32_t size = 1024);

/// $GLINT_DRAGON: where the Stanford dragon of 871,414 triangles is, a .ply file that may not be passed on. Empty if it
/// is not set.
std::filesystem::path dragonPath();

}  // namespace glint::bench
