#pragma once

#include "common/example.h"

#include <glint/device/device.h>

#include <string>
#include <utility>
#include <vector>

/// Opens the device that the arguments ask for and notes it in the statistics. On failure the handle carries the error.
glint::Device openDevice(Example& example, glint::FeatureMask required = glint::FeatureNone);

/// Writes the picture where --image says, the statistics where --stats says, and ends the program: the exit code.
int finish(Example& example, glint::Device& device, const glint::Texture& picture);

/// Measures passes on the GPU for the statistics; does nothing on a device without time queries.
class PassTimer {
public:
    PassTimer(Example& example, glint::Device& device) : example_(example), device_(device) {}

    /// Names the work of the recorder from here to end(), and times it.
    void begin(glint::Recorder& recorder, const std::string& pass);
    void end(glint::Recorder& recorder);
    /// After the submit: waits for the frame and adds its times.
    glint::Status collect();

private:
    Example& example_;
    glint::Device& device_;
    std::vector<std::pair<std::string, glint::Query>>
        queries_;  // one for each pass of the frame, used again by the next
    size_t used_ = 0;
};
