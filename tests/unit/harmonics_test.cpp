#include <glint/math/harmonics.h>

#include <glm/geometric.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

using namespace glint;

namespace {

constexpr double pi_d = std::numbers::pi;

std::vector<Vector3d> randomDirections(size_t count) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    std::vector<Vector3d> directions(count);
    for (Vector3d& d : directions) d = glm::normalize(Vector3d(normal(random), normal(random), normal(random)));
    return directions;
}

double factorial2(int n) { return n <= 1 ? 1.0 : n * factorial2(n - 2); }

/// The integral of x^2i y^2j z^2k over the sphere.
double momentOf(int i, int j, int k) {
    return 4.0 * pi_d * factorial2(2 * i - 1) * factorial2(2 * j - 1) * factorial2(2 * k - 1) /
           factorial2(2 * (i + j + k) + 1);
}

double integrate(const SphereRule& rule, auto&& f) {
    double sum = 0.0;
    for (size_t i = 0; i < rule.weights.size(); i++) sum += rule.weights[i] * f(rule.directions[i]);
    return sum;
}

double valueOf(std::span<const Vector3f> coefficients, const Vector3d& direction) {
    const auto y = evaluateHarmonics(direction);
    double sum = 0.0;
    for (size_t k = 0; k < coefficients.size(); k++) sum += y[k] * double{coefficients[k].x};
    return sum;
}

std::vector<Vector3f> sample(std::span<const Vector3d> directions, auto&& f) {
    std::vector<Vector3f> values;
    for (const Vector3d& d : directions) values.emplace_back(static_cast<float>(f(d)));
    return values;
}

/// Root of the mean square of the fit's error over directions that `counts` accepts.
double errorOf(std::span<const Vector3f> coefficients, auto&& f, auto&& counts) {
    double sum = 0.0, count = 0.0;
    for (const Vector3d& d : randomDirections(20000)) {
        if (!counts(d)) continue;
        sum += std::pow(valueOf(coefficients, d) - f(d), 2.0);
        count++;
    }
    return std::sqrt(sum / count);
}

}  // namespace

TEST(Harmonics, HaveTheSignsOfSplats) {
    const Vector3d d = glm::normalize(Vector3d(1, 2, 3));
    const auto y = evaluateHarmonics(d);
    EXPECT_NEAR(y[0], 0.282095, 1e-6);
    EXPECT_NEAR(y[1], -0.488603 * d.y, 1e-6);
    EXPECT_NEAR(y[2], 0.488603 * d.z, 1e-6);
    EXPECT_NEAR(y[3], -0.488603 * d.x, 1e-6);
    EXPECT_NEAR(y[4], 1.092548 * d.x * d.y, 1e-6);
    EXPECT_NEAR(y[5], -1.092548 * d.y * d.z, 1e-6);
    EXPECT_NEAR(y[6], 0.315392 * (2 * d.z * d.z - d.x * d.x - d.y * d.y), 1e-6);
    EXPECT_NEAR(y[7], -1.092548 * d.x * d.z, 1e-6);
    EXPECT_NEAR(y[8], 0.546274 * (d.x * d.x - d.y * d.y), 1e-6);
    EXPECT_NEAR(y[9], -0.590044 * d.y * (3 * d.x * d.x - d.y * d.y), 1e-6);
    EXPECT_NEAR(y[10], 2.890611 * d.x * d.y * d.z, 1e-6);
    EXPECT_NEAR(y[11], -0.457046 * d.y * (4 * d.z * d.z - d.x * d.x - d.y * d.y), 1e-6);
    EXPECT_NEAR(y[12], 0.373176 * d.z * (2 * d.z * d.z - 3 * d.x * d.x - 3 * d.y * d.y), 1e-6);
    EXPECT_NEAR(y[13], -0.457046 * d.x * (4 * d.z * d.z - d.x * d.x - d.y * d.y), 1e-6);
    EXPECT_NEAR(y[14], 1.445306 * d.z * (d.x * d.x - d.y * d.y), 1e-6);
    EXPECT_NEAR(y[15], -0.590044 * d.x * (d.x * d.x - 3 * d.y * d.y), 1e-6);
}

// Products of two have degree 6, which order 4 integrates exactly.
TEST(Harmonics, AreOrthonormal) {
    const SphereRule rule = sphereRule(4);
    for (uint32_t i = 0; i < max_harmonics; i++) {
        for (uint32_t k = 0; k <= i; k++) {
            const double product = integrate(rule, [&](const Vector3d& d) {
                const auto y = evaluateHarmonics(d);
                return y[i] * y[k];
            });
            EXPECT_NEAR(product, i == k ? 1.0 : 0.0, 1e-13) << i << " " << k;
        }
    }
}

// A few operations with factors below 3 each, all rounded to 2^-24: 4e-7 leaves twice that.
TEST(Harmonics, Float32IsNearFloat64) {
    for (const Vector3d& d : randomDirections(10000)) {
        const auto exact = evaluateHarmonics(Vector3d(Vector3f(d)));
        const auto rounded = evaluateHarmonics(Vector3f(d));
        for (uint32_t k = 0; k < max_harmonics; k++) ASSERT_NEAR(double{rounded[k]}, exact[k], 4e-7) << k;
    }
}

TEST(SphereRule, IsExactToItsDegree) {
    for (const uint32_t order : {1u, 2u, 3u, 4u, 7u, 16u, 64u}) {
        const SphereRule rule = sphereRule(order);
        ASSERT_EQ(rule.directions.size(), 2u * order * order);
        EXPECT_TRUE(std::all_of(rule.weights.begin(), rule.weights.end(), [](double w) { return w > 0.0; }));
        const int degree = 2 * static_cast<int>(order) - 1;
        const auto error = [&](int i, int j, int k) {
            return std::abs(integrate(rule,
                                      [&](const Vector3d& d) {
                                          return std::pow(d.x, 2 * i) * std::pow(d.y, 2 * j) * std::pow(d.z, 2 * k);
                                      }) -
                            momentOf(i, j, k));
        };
        for (int i = 0; 2 * i <= std::min(degree, 12); i++)
            for (int j = 0; 2 * (i + j) <= std::min(degree, 12); j++)
                EXPECT_LT(error(i, j, std::min(degree, 40) / 2 - i - j), 1e-13) << order << ": " << i << " " << j;
        // The next degree is beyond it.
        if (order <= 7) { EXPECT_GT(error(0, 0, static_cast<int>(order)), 1e-6) << order; }
    }
    EXPECT_EQ(sphereRule(0).directions.size(), 2u);
    EXPECT_EQ(sphereRule(1000).directions.size(), 8192u);
}

// max(0, z) = (z + |z|) / 2, whose Chebyshev series cut off after the even degree m is off by at most 1 / (pi (m + 1)):
// the polynomial that the bound of sphereRule wants is no farther.
TEST(HarmonicsFit, ProjectsWithinTheStatedBound) {
    const auto cosine = [](const Vector3d& d) { return std::max(d.z, 0.0); };
    const auto exact = [](uint32_t k) {
        const double bands[] = {pi_d, 2.0 * pi_d / 3.0, pi_d / 4.0, 0.0};
        const uint32_t zonal[] = {0, 2, 6, 12};
        for (uint32_t l = 0; l < 4; l++)
            if (k == zonal[l]) return bands[l] * std::sqrt((2 * l + 1) / (4 * pi_d));
        return 0.0;
    };
    double last = 1.0;
    for (const uint32_t order : {4u, 8u, 16u, 32u, 64u}) {
        const SphereRule rule = sphereRule(order);
        const HarmonicsFit fit(3, rule.directions, rule.weights);
        std::vector<Vector3f> coefficients(fit.coefficientCount());
        fit.fit(sample(rule.directions, cosine), coefficients);
        double error = 0.0;
        for (uint32_t k = 0; k < max_harmonics; k++)
            error = std::max(error, std::abs(double{coefficients[k].x} - exact(k)));
        const double nearest = 1.0 / (pi_d * (2.0 * order - 3.0));
        EXPECT_LT(error, 8.0 * pi_d * 0.747 * nearest) << order;
        EXPECT_LT(error, last) << order;
        last = error;
    }
    // It goes with the square of the distance between parallels.
    EXPECT_LT(last, 1e-3);
}

TEST(HarmonicsFit, FindsSumsOfHarmonics) {
    std::vector<Vector3f> exact(max_harmonics);
    for (uint32_t k = 0; k < max_harmonics; k++) exact[k] = Vector3f(0.1f * static_cast<float>(k) - 0.7f);
    const SphereRule rule = sphereRule(6);
    const auto f = [&](const Vector3d& d) { return valueOf(exact, d); };
    for (uint32_t degree = 0; degree <= 3; degree++) {
        const HarmonicsFit fit(degree, rule.directions, rule.weights);
        ASSERT_EQ(fit.coefficientCount(), (degree + 1) * (degree + 1));
        ASSERT_EQ(fit.directionCount(), 72u);
        std::vector<Vector3f> coefficients(fit.coefficientCount());
        fit.fit(sample(rule.directions, f), coefficients);
        // 72 values below 3, weights that add up to 4 pi, sums in float32: 72 * 3 * 0.75 * 4 pi / 72 * 2^-24 * 2.
        for (uint32_t k = 0; k < coefficients.size(); k++) EXPECT_NEAR(coefficients[k].x, exact[k].x, 5e-6f) << k;
    }
}

// A highlight that matters on one side: there the fit is better than the projection, and elsewhere not much worse.
TEST(HarmonicsFit, IsBestWhereTheWeightsAre) {
    const Vector3d peak = glm::normalize(Vector3d(1, 0, 1));
    const auto lobe = [&](const Vector3d& d) { return std::pow(std::max(glm::dot(d, peak), 0.0), 12.0); };
    const auto above = [](const Vector3d& d) { return d.z > 0.0; };
    const auto below = [](const Vector3d& d) { return d.z <= 0.0; };
    const SphereRule rule = sphereRule(12);
    std::vector<double> weights = rule.weights;
    for (size_t i = 0; i < weights.size(); i++)
        if (below(rule.directions[i])) weights[i] *= 0.01;
    const HarmonicsFit everywhere(3, rule.directions, rule.weights);
    const HarmonicsFit upper(3, rule.directions, weights);
    std::vector<Vector3f> projection(max_harmonics), best(max_harmonics);
    everywhere.fit(sample(rule.directions, lobe), projection);
    upper.fit(sample(rule.directions, lobe), best);
    // No sum is nearer there, but for what the other side counts; the lobe is too narrow for any to be very near.
    EXPECT_LT(errorOf(best, lobe, above), 0.9 * errorOf(projection, lobe, above));
    EXPECT_LT(errorOf(best, lobe, below), 0.5);
}

TEST(HarmonicsFit, TakesWhatSaysTooLittle) {
    const std::vector<Vector3d> directions = {{0, 0, 1}, {0, 0, 1}, {1, 0, 0}};
    const std::vector<double> weights = {1.0, 0.0, 2.0};
    for (const size_t count : {0u, 1u, 2u, 3u}) {
        const HarmonicsFit fit(9, std::span(directions).first(count), weights);
        EXPECT_EQ(fit.coefficientCount(), 16u);
        std::vector<Vector3f> coefficients(16, Vector3f(1.0f));
        const std::vector<Vector3f> values(count, Vector3f(2.0f));
        fit.fit(values, coefficients);
        for (const Vector3f& c : coefficients) EXPECT_TRUE(isFinite(c));
        EXPECT_NEAR(valueOf(coefficients, directions[0]), count > 0 ? 2.0 : 0.0, 1e-5);
    }
}
