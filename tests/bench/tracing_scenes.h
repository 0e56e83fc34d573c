#pragma once

// Meshes and rays for the benchmarks of tracing.

#include "bench/bench.h"

#include <glint/format/mesh.h>
#include <glint/graphics/ray_caster.h>

#include <string>
#include <vector>

namespace glint::bench {

struct TracingScene {
    std::string name;
    Mesh mesh;
    std::vector<Ray> camera;  ///< 1024 x 1024, 55 degrees, pixels along a Z-order curve
    std::vector<Ray> bounce;  ///< cosine-weighted, from where those hit
};

/// "bunny": the Stanford bunny of Debian's package glmark2-data, in the order of its file; "100k", "1m": a torus with
/// bumps of that many triangles, in grid order. All stand in a closed room of 12 triangles, so every ray hits. Throws
/// if the bunny is missing.
TracingScene makeTracingScene(const std::string& name);

}  // namespace glint::bench
