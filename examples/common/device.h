#pragma once

#include "common/example.h"

#include <glint/device/device.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

/// Opens the device that the arguments ask for and notes it in the statistics. On failure the handle carries the error.
glint::Device openDevice(Example& example, glint::FeatureMask required = glint::FeatureNone);

/// For examples with two forms, a ray-tracing pipeline and ray queries: true, and said on stderr, if the device has no
/// pipelines whose traces nest `recursion` deep. Notes the engine in the statistics.
bool needsQueries(Example& example, const glint::Device& device, uint32_t recursion);

/// Measures passes on the GPU for the statistics; does nothing on a device without time queries.
class PassTimer {
public:
    /// Frames that may be under way at once.
    static constexpr size_t frames = 3;

    PassTimer(Example& example, glint::Device& device) : example_(example), device_(device) {}

    /// Names the work of the recorder from here to end(), and times it.
    void begin(glint::Recorder& recorder, const std::string& pass);
    void end(glint::Recorder& recorder);
    /// Begins a frame: adds the times of the frame that was begun `frames` calls ago, for which it waits.
    glint::Status next();
    /// Adds the times of all frames that are under way, and waits for the device.
    glint::Status finish();

private:
    /// The passes of one frame; queries are used again.
    struct Passes {
        std::vector<std::pair<std::string, glint::Query>> queries;
        size_t used = 0;
    };
    glint::Status collect(Passes& passes);

    Example& example_;
    glint::Device& device_;
    std::array<Passes, frames> passes_;
    size_t frame_ = 0;
};
