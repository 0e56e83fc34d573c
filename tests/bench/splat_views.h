#pragma once

// The scenes of splats that the benchmarks of accuracy look at, and other ways to store splats.

#include "bench/bench.h"
#include "support/splat_device.h"

#include <glint/format/splats.h>

#include <string>
#include <vector>

namespace glint::bench {

/// The scenes of figures, "playbot" if $GLINT_SPLATS names it and "mesh", with pictures of 480 x 270.
std::vector<test::SplatScene> splatViews();

/// A way to store splats: what becomes of them, and the bytes that one takes.
struct SplatStorage {
    std::string name;
    Splats (*store)(const Splats&);
    uint32_t (*bytes)(uint32_t coefficients);
};

/// Float32, the renderer's default, covariances in float16, and the quantisation of .spz files.
std::vector<SplatStorage> splatStorages();

/// The same splats with harmonics up to a degree.
Splats withDegree(const Splats& splats, uint32_t degree);

}  // namespace glint::bench
