#pragma once

// Meshes and rays for the benchmarks of tracing, and Embree's answers.

#include "bench/bench.h"

#include <glint/format/mesh.h>
#include <glint/graphics/ray_caster.h>

#include <embree3/rtcore.h>

#include <memory>

namespace glint::bench {

/// A scene of Embree's: medium build quality.
class EmbreeScene {
public:
    EmbreeScene(const Mesh& mesh, bool robust);
    ~EmbreeScene();
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;

    /// One ray at a time (rtcIntersect1) on two threads. RayHit::geometry is 0.
    void trace(std::span<const Ray> rays, std::span<RayHit> hits) const;

private:
    RTCDevice device_ = nullptr;
    RTCScene scene_ = nullptr;
};

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
