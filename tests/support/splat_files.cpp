#include "support/splat_files.h"

#include "support/reference.h"

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace glint::test {

Splats randomSplats(size_t count, uint32_t degree, uint64_t seed) {
    Random random(seed);
    const auto uniform = [&random](double low, double high) { return static_cast<float>(random.uniform(low, high)); };
    const auto vector = [&uniform](double low, double high) {
        return Vector3f(uniform(low, high), uniform(low, high), uniform(low, high));
    };
    Splats splats;
    splats.degree = degree;
    for (size_t i = 0; i < count; i++) {
        splats.positions.push_back(vector(-2.0, 2.0));
        const Vector3f logarithms = vector(std::log(1e-4), 0.0);
        splats.scales.emplace_back(std::exp(logarithms.x), std::exp(logarithms.y), std::exp(logarithms.z));
        const Vector4d q(vector(-1.0, 1.0), uniform(-1.0, 1.0));
        splats.rotations.emplace_back(q / std::max(1e-3, glm::length(q)));
        if (!(glm::length(q) > 1e-3)) splats.rotations.back() = {0, 0, 0, 1};
        splats.opacities.push_back(uniform(0.0, 1.0));
        for (uint32_t band = 0; band <= degree; band++)
            for (uint32_t k = 0; k < 2 * band + 1; k++)
                splats.harmonics.push_back(vector(-1.0, 1.0) / static_cast<float>(1u << band));
    }
    return splats;
}

std::vector<std::string> plySplatNames(uint32_t degree) {
    std::vector<std::string> names = {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"};
    for (uint32_t i = 0; i < 3 * ((degree + 1) * (degree + 1) - 1); i++) names.push_back(fmt::format("f_rest_{}", i));
    for (const char* name : {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"})
        names.emplace_back(name);
    return names;
}

float& PlyRows::at(size_t row, const std::string& name) {
    return rows[row][static_cast<size_t>(std::find(names.begin(), names.end(), name) - names.begin())];
}

std::vector<std::byte> PlyRows::bytes() const {
    std::string text = fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", rows.size());
    for (const std::string& name : names) text += fmt::format("property float {}\n", name);
    text += "end_header\n";
    std::vector<std::byte> file(text.size() + rows.size() * names.size() * sizeof(float));
    std::memcpy(file.data(), text.data(), text.size());
    std::byte* at = file.data() + text.size();
    for (const std::vector<float>& row : rows) {
        std::memcpy(at, row.data(), row.size() * sizeof(float));
        at += row.size() * sizeof(float);
    }
    return file;
}

PlyRows randomPlyRows(size_t count, uint32_t degree, uint64_t seed) {
    Random random(seed);
    PlyRows rows{plySplatNames(degree), {}};
    for (size_t i = 0; i < count; i++) {
        std::vector<float> row;
        for (const std::string& name : rows.names) {
            const bool is_log = name.starts_with("scale") || name == "opacity";
            row.push_back(static_cast<float>(is_log ? random.uniform(-8.0, 3.0) : random.uniform(-1.5, 1.5)));
        }
        rows.rows.push_back(row);
    }
    return rows;
}

Splats expectedSplats(const PlyRows& rows, uint32_t degree) {
    PlyRows copy = rows;
    Splats splats;
    splats.degree = degree;
    const uint32_t coefficients = splats.coefficientCount();
    for (size_t i = 0; i < rows.rows.size(); i++) {
        const auto value = [&](const std::string& name) { return copy.at(i, name); };
        const auto power = [&](const std::string& name) { return static_cast<float>(std::exp(double{value(name)})); };
        splats.positions.emplace_back(value("x"), value("y"), value("z"));
        splats.scales.emplace_back(power("scale_0"), power("scale_1"), power("scale_2"));
        const Vector4d q(value("rot_1"), value("rot_2"), value("rot_3"), value("rot_0"));
        splats.rotations.emplace_back(q / glm::length(q));
        splats.opacities.push_back(static_cast<float>(1.0 / (1.0 + std::exp(-double{value("opacity")}))));
        splats.harmonics.emplace_back(value("f_dc_0"), value("f_dc_1"), value("f_dc_2"));
        for (uint32_t k = 1; k < coefficients; k++) {
            Vector3f harmonic;
            for (uint32_t channel = 0; channel < 3; channel++)
                harmonic[static_cast<int>(channel)] =
                    value(fmt::format("f_rest_{}", channel * (coefficients - 1) + k - 1));
            splats.harmonics.push_back(harmonic);
        }
    }
    return splats;
}

}  // namespace glint::test
