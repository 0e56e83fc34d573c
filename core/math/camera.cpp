#include <glint/math/camera.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>

namespace glint {

CameraParameters CameraParameters::rowMajor() const {
    CameraParameters result = *this;
    result.view = toRowMajor(view);
    result.inverse_view = toRowMajor(inverse_view);
    result.projection = toRowMajor(projection);
    return result;
}

Camera& Camera::lookAt(const Vector3f& from, const Vector3f& to, const Vector3f& up) {
    // In float64: with both points far from the origin, float would lose the direction between them.
    const Vector3d difference = Vector3d(to) - Vector3d(from);
    const double distance = glm::length(difference);
    const Vector3d forward = distance > 0.0 ? difference / distance : Vector3d(0, 1, 0);

    Vector3d right = glm::cross(forward, Vector3d(up));
    if (!(glm::length(right) > 1e-6 * glm::length(Vector3d(up)))) {
        const Vector3d other = std::abs(forward.y) < 0.9 ? Vector3d(0, 1, 0) : Vector3d(0, 0, 1);
        right = glm::cross(forward, other);
    }
    right = glm::normalize(right);
    const Vector3d upward = glm::cross(right, forward);

    position_ = from;
    inverse_view_ = Matrix4x4f(Vector4f(Vector3f(right), 0.0f), Vector4f(Vector3f(upward), 0.0f),
                               Vector4f(Vector3f(-forward), 0.0f), Vector4f(from, 1.0f));
    return *this;
}

Camera& Camera::perspective(float fov, float aspect, float near) {
    // The order of the arguments makes a NaN the lower bound.
    const auto clampTo = [](float value, float low, float high) { return std::min(std::max(low, value), high); };
    tangent_ = static_cast<float>(std::tan(static_cast<double>(radians(clampTo(fov, 0.01f, 179.0f))) * 0.5));
    aspect_ = clampTo(aspect, 1e-4f, 1e4f);
    near_ = clampTo(near, 1e-6f, std::numeric_limits<float>::max());
    return *this;
}

Matrix4x4f Camera::view() const {
    const Matrix4x4d m(inverse_view_);
    const Vector3d position(position_);
    // The inverse of a rotation is its transpose; the translation is rounded once.
    Matrix4x4d view(1.0);
    for (int axis = 0; axis < 3; axis++) {
        for (int k = 0; k < 3; k++) view[k][axis] = m[axis][k];
        view[3][axis] = -glm::dot(Vector3d(m[axis]), position);
    }
    return Matrix4x4f(view);
}

Matrix4x4f Camera::projection() const {
    Matrix4x4f projection(0.0f);
    projection[0][0] = 1.0f / (tangent_ * aspect_);
    projection[1][1] = 1.0f / tangent_;
    projection[2][3] = -1.0f;
    projection[3][2] = near_;
    return projection;
}

CameraParameters Camera::parameters() const {
    const Vector3f half_x = right() * (tangent_ * aspect_);
    const Vector3f half_y = up() * tangent_;
    return {
        .view = view(),
        .inverse_view = inverse_view_,
        .projection = projection(),
        .position = Vector4f(position_, 1.0f),
        .ray_corner = Vector4f(forward() - half_x + half_y, 0.0f),
        .ray_x = Vector4f(half_x * 2.0f, 0.0f),
        .ray_y = Vector4f(half_y * -2.0f, 0.0f),
    };
}

}  // namespace glint
