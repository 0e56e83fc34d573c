#pragma once

// The scenes of splats that the benchmarks of accuracy look at, and ways to store splats.

#include "bench/bench.h"
#include "support/splat_device.h"

#include <glint/format/splats.h>

#include <string>
#include <vector>

namespace glint::bench {

/// The scenes of figures, "playbot" if $GLINT_SPLATS names it and "mesh", with pictures of 480 x 270.
std::vector<test::SplatScene> splatViews();

/// Splats as something has stored them.
struct StoredSplats {
    Splats splats;
    double bytes = 0.0;  ///< of each
};

struct SplatStorage {
    std::string name;
    StoredSplats (*store)(const Splats&);
};

/// Float32, the renderer's default, covariances in float16, and what files round: .spz (whose bytes are counted before
/// they are packed) and .splat, which has no harmonics.
std::vector<SplatStorage> splatStorages();

}  // namespace glint::bench
