#pragma once

// Splats to write into files, and files of splats value by value.

#include <glint/format/splats.h>

#include <string>
#include <vector>

namespace glint::test {

/// Splats as scenes have them: within 2 units of the origin, scales 1e-4 to 1, harmonics within -1 and 1 that become
/// smaller with their degree.
Splats randomSplats(size_t count, uint32_t degree, uint64_t seed);

/// The properties of a PLY file as the paper's program writes them: 62 at degree 3.
std::vector<std::string> plySplatNames(uint32_t degree);

/// A PLY file's vertices.
struct PlyRows {
    std::vector<std::string> names;
    std::vector<std::vector<float>> rows;

    float& at(size_t row, const std::string& name);
    /// Binary, little-endian.
    std::vector<std::byte> bytes() const;
};

/// Rows of those properties that mean something: logarithms of scales, logits, quaternions of any length.
PlyRows randomPlyRows(size_t count, uint32_t degree, uint64_t seed);

/// What a file of a row has to give, to the last place or so: computed in float64, and harmonics one by one.
Splats expectedSplats(const PlyRows& rows, uint32_t degree);

}  // namespace glint::test
