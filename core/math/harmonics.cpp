#include <glint/math/harmonics.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace glint {

namespace {

// sqrt of the rational number times 1 / pi, as the harmonics are normalised.
template <class T>
std::array<T, max_harmonics> evaluate(T x, T y, T z) {
    constexpr T c0 = T(0.28209479177387814);   // 1/4
    constexpr T c1 = T(0.48860251190291992);   // 3/4
    constexpr T c2a = T(1.0925484305920792);   // 15/4
    constexpr T c2b = T(0.31539156525252005);  // 5/16
    constexpr T c2c = T(0.54627421529603959);  // 15/16
    constexpr T c3a = T(0.59004358992664352);  // 35/32
    constexpr T c3b = T(2.8906114426405538);   // 105/4
    constexpr T c3c = T(0.45704579946446572);  // 21/32
    constexpr T c3d = T(0.37317633259011546);  // 7/16
    constexpr T c3e = T(1.4453057213202769);   // 105/16
    const T xx = x * x, yy = y * y, zz = z * z;
    return {c0,
            -c1 * y,
            c1 * z,
            -c1 * x,
            c2a * x * y,
            -c2a * y * z,
            c2b * (2 * zz - xx - yy),
            -c2a * x * z,
            c2c * (xx - yy),
            -c3a * y * (3 * xx - yy),
            c3b * x * y * z,
            -c3c * y * (4 * zz - xx - yy),
            c3d * z * (2 * zz - 3 * xx - 3 * yy),
            -c3c * x * (4 * zz - xx - yy),
            c3e * z * (xx - yy),
            -c3a * x * (xx - 3 * yy)};
}

/// Legendre's polynomial of degree n at x, and its derivative; |x| < 1.
std::pair<double, double> legendre(uint32_t n, double x) {
    double before = 1.0, value = x;
    for (uint32_t k = 2; k <= n; k++) {
        const double next = ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k;
        before = value;
        value = next;
    }
    return {value, n * (x * value - before) / (x * x - 1.0)};
}

using Square = std::array<std::array<double, max_harmonics>, max_harmonics>;

/// Cholesky's factor in the lower triangle. Rows whose pivot is rounding alone depend on those before them: they become
/// 0, with a 0 on the diagonal.
void factorise(Square& a, uint32_t n) {
    for (uint32_t i = 0; i < n; i++) {
        const double scale = a[i][i];
        for (uint32_t j = 0; j <= i; j++) {
            double value = a[i][j];
            for (uint32_t k = 0; k < j; k++) value -= a[i][k] * a[j][k];
            if (i == j)
                a[i][i] = value > scale * 1e-12 ? std::sqrt(value) : 0.0;
            else
                a[i][j] = a[j][j] > 0.0 ? value / a[j][j] : 0.0;
        }
    }
}

void solve(const Square& factor, uint32_t n, std::array<double, max_harmonics>& x) {
    for (uint32_t i = 0; i < n; i++) {
        for (uint32_t k = 0; k < i; k++) x[i] -= factor[i][k] * x[k];
        x[i] = factor[i][i] > 0.0 ? x[i] / factor[i][i] : 0.0;
    }
    for (uint32_t i = n; i-- > 0;) {
        for (uint32_t k = i + 1; k < n; k++) x[i] -= factor[k][i] * x[k];
        x[i] = factor[i][i] > 0.0 ? x[i] / factor[i][i] : 0.0;
    }
}

}  // namespace

std::array<double, max_harmonics> evaluateHarmonics(const Vector3d& direction) {
    return evaluate(direction.x, direction.y, direction.z);
}

std::array<float, max_harmonics> evaluateHarmonics(const Vector3f& direction) {
    return evaluate(direction.x, direction.y, direction.z);
}

SphereRule sphereRule(uint32_t order) {
    const uint32_t n = std::clamp(order, 1u, 64u);
    SphereRule rule;
    for (uint32_t i = 0; i < n; i++) {
        // Newton's iteration from Tricomi's estimate converges to the i-th zero.
        double z = n == 1 ? 0.0 : std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5));
        for (int step = 0; step < 8; step++) {
            const auto [value, slope] = legendre(n, z);
            z -= value / slope;
        }
        const double slope = legendre(n, z).second;
        const double parallel = 2.0 / ((1.0 - z * z) * slope * slope);
        const double radius = std::sqrt(1.0 - z * z);
        for (uint32_t k = 0; k < 2 * n; k++) {
            const double angle = std::numbers::pi * (k + 0.5) / n;
            rule.directions.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
            rule.weights.push_back(parallel * std::numbers::pi / n);
        }
    }
    return rule;
}

HarmonicsFit::HarmonicsFit(uint32_t degree, std::span<const Vector3d> directions, std::span<const double> weights) {
    directions = directions.first(std::min(directions.size(), weights.size()));
    count_ = (std::min(degree, 3u) + 1) * (std::min(degree, 3u) + 1);
    Square gram = {};
    for (size_t i = 0; i < directions.size(); i++) {
        const auto y = evaluateHarmonics(directions[i]);
        for (uint32_t row = 0; row < count_; row++)
            for (uint32_t column = 0; column <= row; column++) gram[row][column] += weights[i] * y[row] * y[column];
    }
    factorise(gram, count_);
    matrix_.resize(directions.size() * count_);
    for (size_t i = 0; i < directions.size(); i++) {
        auto column = evaluateHarmonics(directions[i]);
        for (double& value : column) value *= weights[i];
        solve(gram, count_, column);
        for (uint32_t k = 0; k < count_; k++) matrix_[i * count_ + k] = static_cast<float>(column[k]);
    }
}

void HarmonicsFit::fit(std::span<const Vector3f> values, std::span<Vector3f> coefficients) const {
    std::array<Vector3f, max_harmonics> sums;
    sums.fill(Vector3f(0.0f));
    for (size_t i = 0; i < std::min(values.size(), directionCount()); i++)
        for (uint32_t k = 0; k < count_; k++) sums[k] += matrix_[i * count_ + k] * values[i];
    std::copy_n(sums.begin(), std::min<size_t>(count_, coefficients.size()), coefficients.begin());
}

}  // namespace glint
