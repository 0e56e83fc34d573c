#include "common/orbit.h"

#include <algorithm>
#include <cmath>

using namespace glint;

namespace {

constexpr double double_click = 0.4;  // seconds
constexpr float steepest = radians(89.0f);

}  // namespace

void OrbitView::update(const Window& window, bool has_mouse, double seconds) {
    const Vector2f mouse = window.getMouse();
    bool is_reset = window.isKeyPressed(Window::KeyHome);
    if (has_mouse && window.isMousePressed(Window::ButtonLeft)) {
        is_dragging_ = true;
        is_reset = is_reset || seconds - pressed_ < double_click;
        pressed_ = seconds;
        mouse_ = mouse;
    }
    is_dragging_ = is_dragging_ && window.isMouseDown(Window::ButtonLeft);
    if (is_dragging_) {
        // From edge to edge of the picture is half a turn.
        turn_ -= pi * (mouse.x - mouse_.x) / static_cast<float>(std::max(window.getWidth(), 1u));
        tilt_ += pi * (mouse.y - mouse_.y) / static_cast<float>(std::max(window.getHeight(), 1u));
    }
    mouse_ = mouse;
    if (has_mouse) distance_ = std::clamp(distance_ * std::pow(0.9f, window.getWheel().y), 0.02f, 50.0f);
    tilt_ = std::clamp(tilt_, -pi, pi);
    if (is_reset) {
        turn_ = tilt_ = 0.0f;
        distance_ = 1.0f;
    }
}

Vector3f OrbitView::eye(const Vector3f& from, const Vector3f& to) const {
    if (turn_ == 0.0f && tilt_ == 0.0f && distance_ == 1.0f) return from;
    const Vector3f offset = from - to;
    const float length = std::sqrt(offset.x * offset.x + offset.y * offset.y + offset.z * offset.z);
    if (!(length > 0.0f)) return from;
    const float angle = std::atan2(offset.y, offset.x) + turn_;
    const float height = std::clamp(std::asin(std::clamp(offset.z / length, -1.0f, 1.0f)) + tilt_, -steepest, steepest);
    const Vector3f direction = {std::cos(height) * std::cos(angle), std::cos(height) * std::sin(angle),
                                std::sin(height)};
    return to + direction * (length * distance_);
}
