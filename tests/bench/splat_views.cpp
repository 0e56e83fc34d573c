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
Splats asHalfCovariance(const Splats& splats) {
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
    return result;
}

float quantise(float value, float scale, float offset) {
    return (std::clamp(std::round(value * scale + offset), 0.0f, 255.0f) - offset) / scale;
}

/// The numbers of an .spz file of version 2 (https://github.com/nianticlabs/spz): positions with 12 fractional bits,
/// logarithms of scales in steps of 1/16, 8 bits for all else, of which harmonics use 5 at degree 1 and 4 above.
Splats asSpz(const Splats& splats) {
    Splats result = splats;
    for (size_t i = 0; i < splats.size(); i++) {
        for (int k = 0; k < 3; k++) {
            result.positions[i][k] = std::round(splats.positions[i][k] * 4096.0f) / 4096.0f;
            const float logarithm = std::log(std::max(splats.scales[i][k], 1e-30f));
            result.scales[i][k] = std::exp(quantise(logarithm, 16.0f, 160.0f));
        }
        const Vector4f q = splats.rotations[i].w < 0.0f ? -splats.rotations[i] : splats.rotations[i];
        Vector3d p;
        for (int k = 0; k < 3; k++) p[k] = static_cast<double>(quantise(q[k], 127.5f, 127.5f));
        const double w = std::sqrt(std::max(0.0, 1.0 - glm::dot(p, p)));
        result.rotations[i] = Vector4f(glm::normalize(Vector4d(p, w)));
        result.opacities[i] = quantise(splats.opacities[i], 255.0f, 0.0f);
        const uint32_t n = splats.coefficientCount();
        for (uint32_t c = 0; c < n; c++)
            for (int k = 0; k < 3; k++) {
                float& value = result.harmonics[i * n + c][k];
                const float step = c < 4 ? 8.0f : 16.0f;
                value = c == 0 ? quantise(value, 0.15f * 255.0f, 0.5f * 255.0f)
                               : std::clamp(std::round(value * 128.0f / step) * step, -128.0f, 127.0f) / 128.0f;
            }
    }
    return result;
}

}  // namespace

std::vector<test::SplatScene> splatViews() {
    std::vector<test::SplatScene> views;
    if (test::splatsPath().empty())
        fmt::print("  left out: the real scene, which GLINT_SPLATS=FILE.ply names\n");
    else
        views.push_back(std::move(*check(test::realSplatScene(480, 270))));
    views.push_back(test::surfaceScene(30000, 3, 480, 270));
    views.back().name = "mesh";
    return views;
}

std::vector<SplatStorage> splatStorages() {
    return {{"float32", [](const Splats& splats) { return splats; }, [](uint32_t n) { return 44 + 12 * n; }},
            {"default", [](const Splats& splats) { return SplatModel::decoded(splats, SplatModel::StorageHalf); },
             [](uint32_t n) { return 36 + 6 * n; }},
            {"float16 covariance", asHalfCovariance, [](uint32_t n) { return 28 + 6 * n; }},
            {".spz", asSpz, [](uint32_t n) { return 16 + 3 * n; }}};
}

Splats withDegree(const Splats& splats, uint32_t degree) {
    Splats result = splats;
    result.degree = std::min(degree, splats.degree);
    const uint32_t kept = result.coefficientCount();
    const uint32_t all = splats.coefficientCount();
    for (size_t i = 0; i < splats.size(); i++)
        for (uint32_t c = 0; c < kept; c++) result.harmonics[i * kept + c] = splats.harmonics[i * all + c];
    result.harmonics.resize(splats.size() * kept);
    return result;
}

}  // namespace glint::bench
