#pragma once

#include "common/example.h"

#include <glint/device/device.h>

/// What the panel says besides what the statistics have.
struct PanelFigures {
    double frames_per_second = 0.0;
    bool is_paused = false;
};

/// The panel of an example's window, by Dear ImGui: figures, and a knob for each argument that may change while it
/// runs. Drawn by Glint itself. One at a time.
class Panel {
public:
    /// `format`: of the window. Check error() before use.
    Panel(glint::Device& device, glint::Format format);
    ~Panel();
    Panel(const Panel&) = delete;
    Panel& operator=(const Panel&) = delete;
    glint::Error error() const;

    /// Builds the panel of one frame from what the user did. `seconds`: since the last frame. Changes the values of
    /// knobs.
    void update(const glint::Window& window, Example& example, const PanelFigures& figures, double seconds);
    /// True if the mouse, or the keyboard, is the panel's.
    bool hasMouse() const;
    bool hasKeyboard() const;
    /// Draws what update() has built.
    void draw(glint::Command& command) const;

private:
    glint::Pipeline pipeline_;
    glint::Texture font_;
    glint::Sampler sampler_;
};
