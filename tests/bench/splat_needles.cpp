// splat.needle.*: errors of weights against the length of needles, for the inverse covariance that splats are usually
// drawn with and for the factors that SplatRenderer stores, both in float32 on the host, and of what the device draws.
// `./dev report` makes the table and the chart of docs/accuracy.md from what is written.

#include "bench/bench.h"
#include "support/reference.h"
#include "support/splat_device.h"

#include <fmt/format.h>
#include <glint/base/file.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace glint::bench {

namespace {

constexpr float low_pass = 0.3f;
constexpr uint32_t trials = 40000;

/// The matrix from the unit sphere to the picture: two rows.
struct Rows {
    std::array<float, 3> m1, m2;
};

template <class T>
T dot(const std::array<float, 3>& a, const std::array<float, 3>& b) {
    return static_cast<T>(a[0]) * static_cast<T>(b[0]) + static_cast<T>(a[1]) * static_cast<T>(b[1]) +
           static_cast<T>(a[2]) * static_cast<T>(b[2]);
}

/// By the covariance and its inverse. A splat whose determinant is not positive is left out, as is a power above 0.
float classicWeight(const Rows& rows, float dx, float dy) {
    const float a = dot<float>(rows.m1, rows.m1) + low_pass;
    const float b = dot<float>(rows.m1, rows.m2);
    const float c = dot<float>(rows.m2, rows.m2) + low_pass;
    const float determinant = a * c - b * b;
    if (!(determinant > 0.0f)) return 0.0f;
    const float inverse = 1.0f / determinant;
    const float power = -0.5f * (c * inverse * dx * dx + a * inverse * dy * dy) + b * inverse * dx * dy;
    return power > 0.0f ? 0.0f : std::exp(power);
}

/// The model of docs/splatting.md in any arithmetic.
template <class T>
T weight(const Rows& rows, float dx, float dy) {
    const T s1 = dot<T>(rows.m1, rows.m1);
    const T s2 = dot<T>(rows.m2, rows.m2);
    const auto cross = [&](size_t i, size_t j) {
        return static_cast<T>(rows.m1[i]) * static_cast<T>(rows.m2[j]) -
               static_cast<T>(rows.m1[j]) * static_cast<T>(rows.m2[i]);
    };
    const T x = cross(1, 2), y = cross(2, 0), z = cross(0, 1);
    const T filter = static_cast<T>(low_pass);
    const T determinant = x * x + y * y + z * z + filter * (s1 + s2) + filter * filter;
    const T a = s1 + filter;
    const T shear = dot<T>(rows.m1, rows.m2) / a;
    const T across = static_cast<T>(dy) - shear * static_cast<T>(dx);
    return std::exp(static_cast<T>(-0.5) *
                    (static_cast<T>(dx) * static_cast<T>(dx) / a + across * across * (a / determinant)));
}

struct Errors {
    double classic_99 = 0.0, classic = 0.0, ours_99 = 0.0, ours = 0.0, device = 0.0;
    double lost = 0.0;  ///< share of the needles that the inverse covariance does not draw
};

double quantile(std::vector<double>& values, double share) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

Errors errorsOf(double sigma) {
    test::Random random(31);
    std::vector<double> classic, ours;
    Errors errors;
    for (uint32_t i = 0; i < trials; i++) {
        const double angle = random.uniform(0.0, 6.283185307179586), other = random.uniform(0.0, 6.283185307179586);
        const double c = std::cos(angle), s = std::sin(angle);
        // A needle of this length and 0.1 pixel, whose own axes are turned about its length.
        const double p = 0.1 * std::cos(other), q = 0.1 * std::sin(other);
        const Rows rows = {{static_cast<float>(c * sigma), static_cast<float>(-s * p), static_cast<float>(-s * q)},
                           {static_cast<float>(s * sigma), static_cast<float>(c * p), static_cast<float>(c * q)}};
        // A place within two standard deviations, the low-pass included.
        const double along = random.uniform(-2.0, 2.0) * std::sqrt(sigma * sigma + 0.3);
        const double across = random.uniform(-2.0, 2.0) * std::sqrt(0.31);
        const auto dx = static_cast<float>(c * along - s * across);
        const auto dy = static_cast<float>(s * along + c * across);
        const auto exact = static_cast<double>(weight<long double>(rows, dx, dy));
        const auto by_inverse = static_cast<double>(classicWeight(rows, dx, dy));
        classic.push_back(std::abs(by_inverse - exact));
        ours.push_back(std::abs(static_cast<double>(weight<float>(rows, dx, dy)) - exact));
        errors.lost += by_inverse == 0.0 && exact > 0.01;
    }
    errors.lost /= trials;
    errors.classic_99 = quantile(classic, 0.99);
    errors.classic = quantile(classic, 1.0);
    errors.ours_99 = quantile(ours, 0.99);
    errors.ours = quantile(ours, 1.0);
    return errors;
}

/// The largest error in pictures of 512 x 512 pixels of one white needle each.
double drawnError(test::SplatDrawer& drawer, double sigma) {
    const test::SplatScene all = test::needleScene(16, static_cast<float>(sigma), 512, 512);
    double largest = 0.0;
    for (size_t i = 0; i < all.splats.size(); i++) {
        test::SplatScene scene = {"needle", {}, all.camera, 512, 512};
        test::addSplat(scene.splats, all.splats.positions[i], all.splats.scales[i], all.splats.rotations[i], 1.0f,
                       {1, 1, 1});
        const test::SplatPicture actual = drawer.draw(scene, SplatModel::StorageFloat);
        const test::SplatPicture expected = test::referenceOf(scene, drawer.settings());
        largest = std::max(largest, test::comparePictures(actual, expected).largest);
    }
    return largest;
}

void run(Report& report) {
    const Device device = createDevice();
    SplatRenderer::Options options;
    options.alpha_cut = 1e-6f;
    test::SplatDrawer drawer(device, options);
    std::string table = fmt::format("{}.\n\n| length, pixels | inverse covariance: 99 % | largest | not drawn | "
                                    "factors: 99 % | largest | drawn, largest |\n"
                                    "|---|---|---|---|---|---|---|\n",
                                    deviceName(device));
    std::string curve = "# length, inverse covariance 99 %, largest, factors 99 %, largest, drawn\n";
    Errors last;
    for (const double sigma : {1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0}) {
        Errors errors = errorsOf(sigma);
        errors.device = drawnError(drawer, sigma);
        table +=
            fmt::format("| {} | {:.1e} | {:.1e} | {:.1f} % | {:.1e} | {:.1e} | {:.1e} |\n", sigma, errors.classic_99,
                        errors.classic, 100.0 * errors.lost, errors.ours_99, errors.ours, errors.device);
        curve += fmt::format("{} {:.4e} {:.4e} {:.4e} {:.4e} {:.4e}\n", sigma, errors.classic_99, errors.classic,
                             errors.ours_99, errors.ours, errors.device);
        last = errors;
    }
    fmt::print("{}\n", table);
    check(writeTextFile(report.folder() / "splat_needles.md", table));
    check(writeTextFile(report.folder() / "splat_needles.dat", curve));
    const std::string processor = processorName();
    report.add("splat.needle.classic", last.classic, "largest error of a weight, 5,000 pixels", "long double",
               processor);
    report.add("splat.needle.factors", last.ours, "largest error of a weight, 5,000 pixels", "long double", processor);
    report.add("splat.needle.drawn", last.device, "largest error of a weight, 5,000 pixels", "float64 reference",
               deviceName(device));
}

}  // namespace

Benchmark splatNeedlesBenchmark() {
    return {{"splat.needle.classic", "splat.needle.factors", "splat.needle.drawn"}, run};
}

}  // namespace glint::bench
