#include "bench/splat_views.h"

#include <fmt/format.h>

#include <glm/gtc/packing.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>

namespace glint::bench {

namespace {

float toHalf(float value) { return glm::unpackHalf1x16(glm::packHalf1x16(std::clamp(value, -65504.0f, 65504.0f))); }

/// Turns a symmetric matrix into a diagonal one by Jacobi's rotations, and gives the axes.
glm::dmat3 eigenvectors(glm::dmat3& m) {
    glm::dmat3 axes(1.0);
    for (int sweep = 0; sweep < 30; sweep++)
        for (int p = 0; p < 2; p++)
            for (int q = p + 1; q < 3; q++) {
                const double angle = 0.5 * std::atan2(2.0 * m[p][q], m[q][q] - m[p][p]);
                glm::dmat3 turn(1.0);
                turn[p][p] = turn[q][q] = std::cos(angle);
                turn[q][p] = std::sin(angle);
                turn[p][q] = -std::sin(angle);
                m = glm::transpose(turn) * m * turn;
                axes = axes * turn;
            }
    return axes;
}

/// Covariances of six float16, as some viewers hold them, and harmonics in float16.
StoredSplats asHalfCovariance(const Splats& splats) {
    Splats result = splats;
    for (Vector3f& harmonic : result.harmonics) harmonic = {toHalf(harmonic.x), toHalf(harmonic.y), toHalf(harmonic.z)};
    for (size_t i = 0; i < splats.size(); i++) {
        const Vector4d q(splats.rotations[i]);
        glm::dmat3 shape = glm::mat3_cast(glm::normalize(glm::dquat(q.w, q.x, q.y, q.z)));
        for (int k = 0; k < 3; k++) shape[k] *= static_cast<double>(splats.scales[i][k]);
        glm::dmat3 covariance = shape * glm::transpose(shape);
        for (int k = 0; k < 3; k++)
            for (int l = 0; l < 3; l++)
                covariance[k][l] = static_cast<double>(toHalf(static_cast<float>(covariance[k][l])));
        glm::dmat3 axes = eigenvectors(covariance);
        if (glm::determinant(axes) < 0.0) axes[0] = -axes[0];
        const glm::dquat turn = glm::normalize(glm::quat_cast(axes));
        result.rotations[i] = Vector4f(Vector4d(turn.x, turn.y, turn.z, turn.w));
        // Rounding may have made it indefinite.
        for (int k = 0; k < 3; k++)
            result.scales[i][k] = static_cast<float>(std::sqrt(std::max(covariance[k][k], 0.0)));
    }
    return {result, 28.0 + 6.0 * splats.coefficientCount()};
}

StoredSplats asSpz(const Splats& splats) {
    const std::vector<std::byte> file = std::move(*check(encodeSpz(splats)));
    return {std::move(*check(parseSpz(file, "splats"))), 17.0 + 3.0 * splats.coefficientCount()};
}

StoredSplats asDotSplat(const Splats& splats) {
    const std::vector<std::byte> file = std::move(*check(encodeDotSplat(splats)));
    return {std::move(*check(parseDotSplat(file, "splats"))), 32.0};
}

}  // namespace

std::vector<test::SplatScene> splatViews() {
    std::vector<test::SplatScene> views;
    if (test::splatsPath().empty())
        fmt::print("  left out: the real scene, which GLINT_SPLATS=FILE.ply names\n");
    else
        views.push_back(std::move(*check(test::realSplatScene(480, 270))));
    views.push_back(test::meshScene(createDevice(), 50000, 32, 480, 270));
    return views;
}

std::vector<SplatStorage> splatStorages() {
    return {{"float32",
             [](const Splats& splats) -> StoredSplats {
                 return {splats, 44.0 + 12.0 * splats.coefficientCount()};
             }},
            {"default",
             [](const Splats& splats) -> StoredSplats {
                 // Harmonics fill words of two.
                 const uint32_t words = (3 * splats.coefficientCount() + 1) / 2;
                 return {SplatModel::decoded(splats, SplatModel::StorageHalf), 36.0 + 4.0 * words};
             }},
            {"float16 covariance", asHalfCovariance},
            {".spz", asSpz},
            {".splat", asDotSplat}};
}

}  // namespace glint::bench
