#pragma once

#include <glint/base/status.h>
#include <glint/math/bounds.h>
#include <glint/math/math.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace glint {

/// Gaussian splats in host memory (Kerbl et al., "3D Gaussian Splatting for Real-Time Radiance Field Rendering", 2023).
/// A plain value: fill the arrays, or load a file; valid when validate() says so.
///
/// Splat i weighs a point p by opacity * exp(-1/2 |S^-1 R^T (p - position)|^2), R its rotation, S the diagonal matrix
/// of its scales. Seen along the unit direction d from the eye, in the space of the splats, it has the color
/// max(0, 1/2 + sum over k of harmonics[k] * Y_k(d)), where Y_k are the real spherical harmonics with the signs of that
/// paper: 0.282095; -0.488603 (y, -z, x); 1.092548 xy, -1.092548 yz, 0.315392 (2zz - xx - yy), ... Colors are those to
/// show, without another transfer function.
struct Splats {
    static constexpr uint32_t max_degree = 3;

    uint32_t degree = 0;              ///< of the harmonics, 0 to 3
    std::vector<Vector3f> positions;  ///< centres
    std::vector<Vector3f> scales;     ///< standard deviations along the splat's axes, at least 0, in units of positions
    std::vector<Vector4f> rotations;  ///< unit quaternions (x, y, z, w) from the splat's axes to the scene's
    std::vector<float> opacities;     ///< 0 to 1
    std::vector<Vector3f> harmonics;  ///< coefficientCount() of each splat, one splat after the other
    bool is_antialiased = false;      ///< made for a renderer with Mip-Splatting's 2D filter

    size_t size() const { return positions.size(); }
    /// (degree + 1)^2.
    uint32_t coefficientCount() const { return (degree + 1) * (degree + 1); }

    /// Errors: "splats.degree", "splats.count" (an array that does not go with the positions), "splats.value" (the
    /// first value that is not finite, a negative scale, an opacity outside of 0 to 1, a quaternion whose length is
    /// not within 1e-3 of 1), each with the splat's number.
    Status validate() const;

    /// The box of the centres.
    BoundBox bounds() const { return BoundBox(positions); }

    bool operator==(const Splats&) const = default;
};

}  // namespace glint
