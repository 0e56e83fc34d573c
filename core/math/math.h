#pragma once

// GLM under the names that the tutorials use. No GLM_FORCE_ macro is set here: GLM's functions are inline, and a
// program that includes GLM with other settings of its own would get either definition. What depends on a depth range
// or a handedness (projections) is Glint's own: see <glint/math/camera.h>.

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cmath>

namespace glint {

/// Vectors of floats, doubles, and signed and unsigned numbers.
using Vector2f = glm::vec2;
using Vector3f = glm::vec3;
using Vector4f = glm::vec4;
using Vector2d = glm::dvec2;
using Vector3d = glm::dvec3;
using Vector4d = glm::dvec4;
using Vector2i = glm::ivec2;
using Vector3i = glm::ivec3;
using Vector4i = glm::ivec4;
using Vector2u = glm::uvec2;
using Vector3u = glm::uvec3;
using Vector4u = glm::uvec4;

/// Column-major, as GLSL's default layout has them: `matrix[column][row]`.
using Matrix3x3f = glm::mat3;
using Matrix4x4f = glm::mat4;
using Matrix4x4d = glm::dmat4;

/// Angles: pi, and degrees to radians.
constexpr float pi = 3.14159265358979323846f;
constexpr float radians(float degrees) { return degrees * (pi / 180.0f); }

/// True if no component is NaN or infinite.
inline bool isFinite(const Vector3f& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// The matrix as a shader that is declared `layout(row_major)` reads it.
inline Matrix4x4f toRowMajor(const Matrix4x4f& matrix) { return glm::transpose(matrix); }

/// Rotations about an axis through the origin, counter-clockwise seen from the axis' tip. Angles in degrees.
Matrix4x4f rotateX(float degrees);
Matrix4x4f rotateY(float degrees);
Matrix4x4f rotateZ(float degrees);
Matrix4x4f translate(const Vector3f& offset);
Matrix4x4f scale(const Vector3f& factors);

/// The point (p, 1) transformed; for affine matrices.
inline Vector3f transformPoint(const Matrix4x4f& matrix, const Vector3f& p) {
    return Vector3f(matrix * Vector4f(p, 1.0f));
}

/// An affine transform as instances hold it: three rows of four floats, the translation in the last column.
/// Its memory is that of VkTransformMatrixKHR and of a GLSL `layout(row_major) mat4x3`.
struct Transform3x4 {
    std::array<float, 12> rows = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

    Transform3x4() = default;
    /// The upper three rows; the last one is taken to be (0, 0, 0, 1).
    explicit Transform3x4(const Matrix4x4f& matrix);

    Matrix4x4f matrix() const;
    bool operator==(const Transform3x4&) const = default;
};
static_assert(sizeof(Transform3x4) == 48);

}  // namespace glint
