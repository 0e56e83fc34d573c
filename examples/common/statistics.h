#pragma once

#include <glint/base/status.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

/// What a run of an example was and how long it took, for --stats. Written as one JSON object:
///
///     {"example": "05_tracing", "width": 1600, "height": 900, "frames": 10,
///      "adapter": "...", "driver": "...", "api": "...", "tracing": "software", "features": ["computeTracing"],
///      "counts": {"triangles": 69666}, "series": {"error": [1e-5, 1e-6]}, "rays_per_second": 5.5e6,
///      "passes": [{"name": "trace", "gpu_ns": [812345, 810123], "median_ns": 811234, "min_ns": 810123}]}
///
/// What was not set is left out; numbers that are not finite are null.
struct Statistics {
    std::string example;
    uint32_t width = 0;
    uint32_t height = 0;
    uint32_t frames = 0;
    std::string adapter;
    std::string driver;
    std::string api;
    std::string tracing;  ///< the engine used: "driver" or "software"
    std::vector<std::string> features;
    std::map<std::string, uint64_t> counts;
    std::map<std::string, std::vector<double>> series;  ///< columns of what an example measures by itself

    /// GPU time of a pass in one frame, nanoseconds. Passes keep the order in which they were first seen.
    void addPass(const std::string& name, uint64_t nanoseconds);
    /// Rays that one run of this pass casts: gives `rays_per_second`, from the median time of the pass.
    void setRays(const std::string& pass, uint64_t rays);

    /// Times of a pass in the order of the frames, nanoseconds; empty for an unknown pass.
    const std::vector<uint64_t>& times(const std::string& pass) const;
    /// Median of a pass's times, nanoseconds; 0 for an unknown pass.
    double median(const std::string& pass) const;

    /// In the order in which they were first seen.
    std::vector<std::string> passNames() const;
    /// The newest time of a pass, nanoseconds; 0 for an unknown pass.
    double last(const std::string& pass) const;

    /// The JSON text, ending in a newline.
    std::string text() const;
    /// Errors: those of writeFile.
    glint::Status write(const std::filesystem::path& path) const;

private:
    struct Pass {
        std::string name;
        std::vector<uint64_t> times;
    };
    std::vector<Pass> passes_;
    std::string ray_pass_;
    uint64_t rays_ = 0;
};
