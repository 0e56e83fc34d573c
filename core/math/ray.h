#pragma once

// Rays; points to start them from and to end them at, normals under transforms, and scenes far from the origin.
// docs/rays.md derives the bounds and says what is promised. shaders/ray.h has the same functions for GLSL, called
// glintSurfacePoint and so on: sums and products give the same bits on both sides, lengths (of normals, and what is
// divided by them) differ by Vulkan's errors of division and square root.

#include <glint/math/math.h>

#include <limits>

namespace glint {

/// A ray: the points origin + t * direction with t_min <= t <= t_max. The direction may have any length; t counts in
/// that length. A negative t_min counts as 0.
///
/// Rays that mean nothing miss: a NaN anywhere, an infinite origin or direction, a direction of length zero (or whose
/// components are all smaller than 2^-126), t_min > t_max. An infinite t_max is no limit.
struct Ray {
    Vector3f origin = Vector3f(0.0f);
    float t_min = 0.0f;
    Vector3f direction = Vector3f(0.0f);
    float t_max = std::numeric_limits<float>::infinity();
};

/// Where a segment ends, in its own lengths: 1 - 2^-20.
constexpr float segment_end = 1.0f - 0x1p-20f;

/// A point on a triangle, in the world, with what its rays have to keep away from the triangle's plane.
struct SurfacePoint {
    Vector3f position = Vector3f(0.0f);
    /// Of the plane, length 1, to the side from which the corners are counter-clockwise; 0: there is none.
    Vector3f normal = Vector3f(0.0f);
    float offset = 0.0f;  ///< along the normal: rays start this far from the position
    float slope = 0.0f;   ///< the same for each unit of distance, for rays that come from afar
};

/// A hit on a triangle with the corners a, b, c, in object space: its barycentrics are of b and c, as queries give
/// them. `to_object` is the inverse of `to_world`, as queries or inverse() give it. A triangle of no area, or one that
/// the transform leaves no area, has a point without normal and offset.
SurfacePoint surfacePoint(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector2f& barycentrics,
                          const Transform3x4& to_world, const Transform3x4& to_object);

/// A hit at origin + t * direction, for programs that do not have the corners: many times the offset of the above.
/// `normal`: the triangle's in the world, of length 1 and right to 2^-20. `longest`: no side of a triangle is longer,
/// in object space, and none is narrower than an eighth of it.
SurfacePoint surfacePoint(const Vector3f& origin, const Vector3f& direction, float t, const Vector3f& normal,
                          float longest, const Transform3x4& to_world, const Transform3x4& to_object);

/// Where a ray with this direction starts, with t_min = 0: on the side of the plane that it goes to.
Vector3f spawnPoint(const SurfacePoint& point, const Vector3f& direction);

/// The points origin + t * direction, t from 0 to segment_end.
struct Segment {
    Vector3f origin = Vector3f(0.0f);
    Vector3f direction = Vector3f(0.0f);
};

/// A ray from one point to another that meets the triangle of neither.
Segment segment(const SurfacePoint& from, const SurfacePoint& to);

/// A normal under any affine transform, by cofactors: no inverse is needed, and a transform that flattens everything to
/// a plane gives that plane's. Outside stays outside under mirrors. Length 1, or 0 where the normal has no image.
Vector3f transformNormal(const Transform3x4& to_world, const Vector3f& normal);

/// A tangent with the sign of its bitangent in w: cross(normal, tangent) * w. Length 1, or 0 where it has no image.
Vector4f transformTangent(const Transform3x4& to_world, const Vector4f& tangent);

/// Taken in float64 and rounded once. All NaN if there is none: no volume, or not finite.
Transform3x4 inverse(const Transform3x4& transform);

/// An instance's transform relative to an eye, for scenes far from the origin: differences are taken in float64 and
/// rounded once, so whatever the coordinates are, the result is off by 2^-24 of the distance to the eye, along each
/// axis, and by 2^-24 of each of the matrix' other entries. (The positions themselves have 53 bits: 1e-7 at 1e9.) Rays
/// are then traced from an eye at the origin. `to_world` is affine; its last row is not looked at.
Transform3x4 relativeTransform(const Matrix4x4d& to_world, const Vector3d& eye);

/// The same for a point: a lamp, the corner of a mesh.
inline Vector3f relativePosition(const Vector3d& position, const Vector3d& eye) { return Vector3f(position - eye); }

}  // namespace glint
