#pragma once

#include <glint/math/math.h>

namespace glint {

/// What a shader needs of a camera. 256 bytes in GLSL's default column-major std140 and std430 layouts:
///
///     struct Camera { mat4 view, inverse_view, projection; vec4 position, ray_corner, ray_x, ray_y; };
///
/// A ray through pixel p of a picture of size s starts at `position.xyz` with the direction, not of unit length,
///
///     ray_corner.xyz + ray_x.xyz * (p.x + 0.5) / s.x + ray_y.xyz * (p.y + 0.5) / s.y
///
/// whose component along the viewing direction is 1: `t` of a hit is then its view depth. Pixel (0, 0) is top left.
struct CameraParameters {
    Matrix4x4f view = Matrix4x4f(1.0f);          ///< world to view; the view looks along -Z, with +Y up
    Matrix4x4f inverse_view = Matrix4x4f(1.0f);  ///< view to world
    Matrix4x4f projection = Matrix4x4f(1.0f);    ///< view to clip
    Vector4f position = {0, 0, 0, 1};            ///< of the eye, in the world; w is 1
    Vector4f ray_corner = {0, 0, 0, 0};          ///< direction to the picture's top left corner; w is 0
    Vector4f ray_x = {0, 0, 0, 0};               ///< from the left to the right edge of the picture; w is 0
    Vector4f ray_y = {0, 0, 0, 0};               ///< from its top to its bottom edge; w is 0

    /// The same for a shader whose block is declared `layout(row_major)`: the matrices are transposed.
    CameraParameters rowMajor() const;
};
static_assert(sizeof(CameraParameters) == 256);

/// A pinhole camera in a right-handed world with Z up.
///
/// Clip space: x to the right, y up, depth z / w = near / distance: 1 at the near plane, 0 at infinity (reversed, so
/// clear depth to 0 and keep what is Greater). The defaults are those of the tutorials.
class Camera {
public:
    /// Looks from `from` at `to`. Where `up` is parallel to that direction another one is chosen; where the two points
    /// coincide the camera looks along +Y.
    Camera& lookAt(const Vector3f& from, const Vector3f& to, const Vector3f& up = {0, 0, 1});
    /// `fov`: angle from the bottom to the top of the picture in degrees, in (0, 180). `aspect`: width / height,
    /// positive. `near`: distance of the near plane, positive. Values outside are clamped to [0.01, 179], [1e-4, 1e4],
    /// [1e-6, inf).
    Camera& perspective(float fov, float aspect, float near = 0.1f);

    const Vector3f& position() const { return position_; }
    Vector3f forward() const { return -Vector3f(inverse_view_[2]); }
    Vector3f right() const { return Vector3f(inverse_view_[0]); }
    Vector3f up() const { return Vector3f(inverse_view_[1]); }
    /// World to view.
    Matrix4x4f view() const;
    /// View to clip.
    Matrix4x4f projection() const;

    CameraParameters parameters() const;

private:
    Vector3f position_ = {0, 0, 0};
    Matrix4x4f inverse_view_ = Matrix4x4f({1, 0, 0, 0}, {0, 0, 1, 0}, {0, -1, 0, 0}, {0, 0, 0, 1});
    float tangent_ = 0.57735026919f;  // of half the vertical angle; 60 degrees
    float aspect_ = 16.0f / 9.0f;
    float near_ = 0.1f;
};

}  // namespace glint
