#pragma once

// What a rasteriser has to do, in whole numbers and float64: the rules of docs/rasterization.md, each as it is stated.

#include <glint/math/math.h>

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace glint::test {

/// A corner where the rasteriser has it: 1/256 pixels from the picture's top left corner, y down.
struct FixedCorner {
    int64_t x = 0, y = 0;
    double depth = 0.0;
};
using FixedTriangle = std::array<FixedCorner, 3>;

/// Of a point in clip space with w = 1, by the float32 arithmetic that is promised.
FixedCorner fixedCorner(const Vector3f& p, const Vector2u& size);

/// Positive if the corners are clockwise on the picture, that is a back face; 0 without an area.
int areaSign(const FixedTriangle& triangle);

/// Calls visit(x, y, depth) for each pixel that the triangle covers. Depth: of the plane through the corners.
void forEachPixel(const FixedTriangle& triangle, const Vector2u& size,
                  const std::function<void(uint32_t x, uint32_t y, double depth)>& visit);

/// A triangle in clip space.
using ClipTriangle = std::array<Vector4d, 3>;

/// What is seen of it (0 <= z <= w), in pixels from the top left corner; empty if nothing is.
std::vector<Vector2d> windowPolygon(const ClipTriangle& triangle, const Vector2u& size);

/// How many triangles a picture's pixels should have, front and back faces apart: those whose edges are all farther
/// from the centre than `tolerance` pixels, and how many others there may be besides.
struct ExpectedCounts {
    struct Pixel {
        uint32_t sure[2] = {};      ///< front, back
        uint32_t doubtful[2] = {};  ///< with an edge within the tolerance
        uint32_t inside[2] = {};    ///< by float64
        double distance = 1e30;     ///< of the nearest edge, pixels
    };
    std::vector<Pixel> pixels;
    ExpectedCounts(const std::vector<ClipTriangle>& triangles, const Vector2u& size, double tolerance);
};

}  // namespace glint::test
