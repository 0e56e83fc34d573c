#pragma once

#include <glint/base/expected.h>
#include <glint/base/status.h>
#include <glint/math/bounds.h>
#include <glint/math/math.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace glint {

/// What a reader did with splats that have values which mean nothing; docs/splatting.md has the rule. Each splat is
/// counted once, by the first of its bad values in the order here.
struct SplatReport {
    /// Splats by the kind of their bad value.
    struct Counts {
        uint64_t position = 0;
        uint64_t scale = 0;
        uint64_t rotation = 0;
        uint64_t opacity = 0;
        uint64_t harmonics = 0;

        uint64_t total() const { return position + scale + rotation + opacity + harmonics; }
        bool operator==(const Counts&) const = default;
    };

    uint64_t splats = 0;  ///< in the file
    Counts dropped;
    Counts repaired;
    bool operator==(const SplatReport&) const = default;
};

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
    /// Largest number of bytes of a file, and of the splats made from it, unless the caller says otherwise.
    static constexpr uint64_t default_limit = 1ull << 34;

    uint32_t degree = 0;              ///< of the harmonics, 0 to 3
    std::vector<Vector3f> positions;  ///< centres
    std::vector<Vector3f> scales;     ///< standard deviations along the splat's axes, at least 0, in units of positions
    std::vector<Vector4f> rotations;  ///< unit quaternions (x, y, z, w) from the splat's axes to the scene's
    std::vector<float> opacities;     ///< 0 to 1
    std::vector<Vector3f> harmonics;  ///< coefficientCount() of each splat, one splat after the other
    bool is_antialiased = false;      ///< made for a renderer with Mip-Splatting's 2D filter

    /// Reads a file; its ending says which format it has (".ply", see parsePlySplats; ".splat", see parseDotSplat;
    /// ".spz", see parseSpz). `report`, if there is one, says what became of bad values. Splats keep the order of the
    /// file. Errors: those of readFile, "splats.unknown_extension", "splats.out_of_memory" and those of the format;
    /// they name the file.
    static Expected<Splats> load(const std::filesystem::path& path, uint64_t limit = default_limit,
                                 SplatReport* report = nullptr);

    /// Writes a file, as its ending says (".ply", see encodePlySplats; ".splat", see encodeDotSplat; ".spz", see
    /// encodeSpz). Errors: those of writeFile, "splats.unknown_extension", "splats.out_of_memory" and those of the
    /// format.
    Status save(const std::filesystem::path& path) const;

    size_t size() const { return positions.size(); }
    /// (degree + 1)^2.
    uint32_t coefficientCount() const { return (degree + 1) * (degree + 1); }

    /// Errors: "splats.degree", "splats.count" (an array that does not go with the positions), "splats.value" (the
    /// first value that is not finite, a negative scale, an opacity outside of 0 to 1, a quaternion whose length is
    /// not within 1e-3 of 1), each with the splat's number.
    Status validate() const;

    /// Leaves out the harmonics above a degree. Each degree is orthogonal to the others, so what is left is the nearest
    /// that the lower degree can come to the colors, in the mean over all directions and before they are cut off at 0.
    void reduceDegree(uint32_t to);

    /// The box of the centres.
    BoundBox bounds() const { return BoundBox(positions); }

    bool operator==(const Splats&) const = default;
};

// The readers are given the name of the file for errors, and `limit`, the bytes that the splats may take. `report`, if
// there is one, says what became of bad values. All positions are in the axes of the paper's program: those of its PLY
// files and cameras, which for photographs are x right, y down, z forward. docs/splatting.md has the formats in detail,
// and what each of them rounds.

/// Reads a PLY file of splats (ASCII, or binary in either byte order; see parsePlyHeader): of element `vertex` by the
/// names of its properties, in any order and of any type, x, y, z; scale_0 to scale_2 (natural logarithms); rot_0 to
/// rot_3 (quaternion w, x, y, z of any length); opacity (its logit); f_dc_0 to f_dc_2; and none, 9, 24 or 45 of
/// f_rest_0, ... (all of red, then all of green, then all of blue). All else is passed over.
///
/// Beside the splats it takes as much again, and 8 bytes for each byte of the file, unless the file is little-endian
/// and all those are float32. Errors: those of parsePlyHeader and PlyReader, "splats.property" (one is missing),
/// "splats.rest" (another number of f_rest), "splats.too_large".
Expected<Splats> parsePlySplats(std::span<const std::byte> file, const std::string& name,
                                uint64_t limit = Splats::default_limit, SplatReport* report = nullptr);

/// Makes a PLY file's bytes: binary, little-endian, float32, properties in the order of the paper's program, normals of
/// zeros included. What parsePlySplats reads from it differs from `splats` by a few units of the last place in scales,
/// opacities and rotations, and by `is_antialiased`, which the file has no place for. Errors: those of validate().
Expected<std::vector<std::byte>> encodePlySplats(const Splats& splats);

/// Reads a `.splat` file: 32 bytes for each splat, which are its position and its scale as float32, red, green, blue
/// and opacity as bytes, and its quaternion w, x, y, z as bytes of which 128 is 0. Harmonics are of degree 0. Errors:
/// "splats.truncated" (a part of a splat), "splats.too_large".
Expected<Splats> parseDotSplat(std::span<const std::byte> file, const std::string& name,
                               uint64_t limit = Splats::default_limit, SplatReport* report = nullptr);

/// Makes a `.splat` file's bytes. Positions and scales are kept; colors are those of degree 0, within 0 to 1. Errors:
/// those of validate().
Expected<std::vector<std::byte>> encodeDotSplat(const Splats& splats);

/// Reads an `.spz` file of version 1, 2 or 3. Its axes are x right, y up, z backward, and are turned to those of PLY
/// files. Harmonics of degree 4 are passed over, and extensions. Beside the splats it takes the unpacked file, up to 92
/// bytes for each. Errors: "splats.spz_header" (no such file, or an impossible header), "splats.spz_version",
/// "splats.spz_data" (damaged, or no memory to unpack it), "splats.truncated", "splats.too_large".
Expected<Splats> parseSpz(std::span<const std::byte> file, const std::string& name,
                          uint64_t limit = Splats::default_limit, SplatReport* report = nullptr);

/// Makes an `.spz` file's bytes, of version 3. Errors: those of validate(), "splats.range" (a position 2^23 or more
/// from the origin, more than 2^32 - 1 splats), "splats.spz_data" (no memory to pack it).
Expected<std::vector<std::byte>> encodeSpz(const Splats& splats);

}  // namespace glint
