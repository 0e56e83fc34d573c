#pragma once

// Real spherical harmonics of degree 0 to 3, and functions of direction as sums of them. The functions are orthonormal
// over the sphere; order and signs are those of Splats: Y_0 = 0.282095; Y_1..3 = 0.488603 (-y, z, -x);
// Y_4..8 = 1.092548 xy, -1.092548 yz, 0.315392 (2zz - xx - yy), -1.092548 xz, 0.546274 (xx - yy); Y_9..15 of degree 3.

#include <glint/math/math.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace glint {

/// (degree + 1)^2 functions make up all degrees to 3.
constexpr uint32_t max_harmonics = 16;

/// The values of Y_0 to Y_15 for a direction of length 1. They are polynomials: a direction whose length is off by a
/// factor of 1 + e gives values of degree l that are off by about l e.
std::array<double, max_harmonics> evaluateHarmonics(const Vector3d& direction);
/// The same in float32: right to 4e-7.
std::array<float, max_harmonics> evaluateHarmonics(const Vector3f& direction);

/// Directions of length 1 with weights that add up to 4 pi: the integral of f over the sphere is about the sum of
/// weights[i] * f(directions[i]).
struct SphereRule {
    std::vector<Vector3d> directions;
    std::vector<double> weights;  ///< positive
};

/// `order` parallels at the nodes of Gauss and Legendre, with 2 * order directions each. Exact but for rounding (1e-14)
/// for polynomials of degree up to 2 * order - 1, so Y_k f is integrated exactly for an f of degree up to
/// 2 * order - 4. For any other f the integral of Y_k f is off by at most 8 pi max|Y_k| E, where max|Y_k| < 0.747 and E
/// is the largest distance between f and the polynomial of that degree that is nearest to it. `order` from 1 to 64;
/// values outside are clamped.
SphereRule sphereRule(uint32_t order);

/// The sum c_0 Y_0 + ... that is nearest to a function of direction, by weighted least squares: it minimises the sum of
/// weights[i] * |f(directions[i]) - sum|^2.
///
/// With the directions and weights of a sphereRule of order 4 or more this is the projection, c_k = integral of f Y_k.
/// Where a part of the sphere matters more, give the rest small weights; without any the sum may be anything there.
class HarmonicsFit {
public:
    /// `degree`: 0 to 3, larger ones count as 3. `weights`: one for each direction, not negative; what is left over of
    /// the longer of the two is passed over. Directions that do not determine the coefficients, such as too few of
    /// them, leave those at 0 that they say nothing of.
    HarmonicsFit(uint32_t degree, std::span<const Vector3d> directions, std::span<const double> weights);

    /// (degree + 1)^2.
    uint32_t coefficientCount() const { return count_; }
    size_t directionCount() const { return matrix_.size() / count_; }

    /// From the function's values in the directions, in their order, to the coefficients: as many of both as given, at
    /// most directionCount() and coefficientCount(). From any thread.
    void fit(std::span<const Vector3f> values, std::span<Vector3f> coefficients) const;

private:
    uint32_t count_ = 1;
    std::vector<float> matrix_;  ///< from a value to the coefficients, value after value
};

}  // namespace glint
