#pragma once

// Triangles as a camera sees them, in float64: which is nearest at a pixel's centre, and how far a place of the picture
// is from what they cover.

#include <glint/format/mesh.h>
#include <glint/math/camera.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace glint::test {

/// World (or object) to clip space in float64, of a camera's float32 matrices as they are.
Matrix4x4d toClip(const CameraParameters& camera, const Transform3x4& instance = {});

/// A mesh under a transform to clip space, seen from both sides. Beyond the near plane means z <= w and w > 0. Keeps a
/// reference to the mesh.
class ExactPicture {
public:
    static constexpr uint32_t none = UINT32_MAX;

    ExactPicture(const Mesh& mesh, const Matrix4x4d& to_clip, const Vector2u& size);

    /// Takes over which triangle each pixel shows, row after row, from someone else's picture; `none` for nothing.
    void show(std::span<const uint32_t> triangles);

    const Vector2u& size() const { return size_; }
    /// The nearest triangle at a pixel's centre, edges included, the lowest of equally near ones; `none` if nothing is
    /// there.
    uint32_t triangle(uint32_t x, uint32_t y) const { return pixels_[y * size_t{size_.x} + x].triangle; }
    /// Of it: w, which is the distance along the camera's axis; infinite where nothing is.
    double depth(uint32_t x, uint32_t y) const { return pixels_[y * size_t{size_.x} + x].depth; }
    /// The point of the mesh that is seen there: exactly in its triangle, rounding aside, also if the triangle that
    /// show() was told of only comes near.
    Vector3d point(uint32_t x, uint32_t y) const;

    /// Where a point of the mesh is in the picture, in pixels from its top left corner; w in the third place.
    Vector3d project(const Vector3d& point) const;

    /// How far a place of the picture is from the nearest that the triangles cover, whether a pixel's centre or not,
    /// in the picture or beside it; infinite if that is more than `reach` (up to 16) pixels.
    double distanceToCoverage(const Vector2d& place, double reach) const;

private:
    struct Pixel {
        double depth;
        uint32_t triangle;
    };
    /// What the near plane leaves of a triangle, in pixels.
    struct Polygon {
        std::array<Vector2d, 4> corners;
        uint32_t count = 0;
    };
    static constexpr uint32_t tile = 16;

    std::array<Vector3d, 3> corners(uint32_t triangle) const;
    void draw(uint32_t triangle, const Polygon& polygon, const std::array<Vector4d, 3>& clip);
    void sort(const Polygon& polygon);

    const Mesh& mesh_;
    Matrix4x4d to_clip_;
    Vector2u size_, tiles_;
    std::vector<Pixel> pixels_;
    std::vector<Polygon> polygons_;
    std::vector<std::vector<uint32_t>> at_tile_;  ///< with a border of one tile around the picture
};

}  // namespace glint::test
