#pragma once

#include <glint/device/window.h>
#include <glint/math/math.h>

/// How the user looks at a scene: drag with the left button to turn, wheel to zoom, Home or a double click to begin
/// anew.
class OrbitView {
public:
    /// Takes what the user did since the last frame. `has_mouse`: the mouse is not the panel's. `seconds`: since some
    /// moment.
    void update(const glint::Window& window, bool has_mouse, double seconds);

    /// Where the example's camera at `from`, which looks at `to` in a world with Z up, stands now: exactly `from` until
    /// the user has done something.
    glint::Vector3f eye(const glint::Vector3f& from, const glint::Vector3f& to) const;
    /// Radians about Z, counter-clockwise seen from above.
    float turn() const { return turn_; }
    /// Distance over that of the example's camera.
    float distance() const { return distance_; }

private:
    float turn_ = 0.0f;
    float tilt_ = 0.0f;
    float distance_ = 1.0f;
    bool is_dragging_ = false;
    glint::Vector2f mouse_ = {0, 0};
    double pressed_ = -1.0;  ///< when the left button went down last
};
