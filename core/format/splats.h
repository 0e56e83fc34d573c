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

    /// Reads a file; its ending says which format it has (".ply", see parsePlySplats). Errors: those of readFile,
    /// "splats.unknown_extension" and those of the format; they name the file.
    static Expected<Splats> load(const std::filesystem::path& path, uint64_t limit = default_limit,
                                 SplatReport* report = nullptr);

    /// Writes a file, as its ending says (".ply", see encodePlySplats). Errors: those of writeFile,
    /// "splats.unknown_extension" and those of the format.
    Status save(const std::filesystem::path& path) const;

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

/// Reads a PLY file of splats (ASCII, or binary in either byte order; see parsePlyHeader), of element `vertex` by the
/// names of its properties, in any order and of any type: x, y, z; scale_0 to scale_2 (logarithms); rot_0 to rot_3
/// (quaternion w, x, y, z of any length); opacity (its logit); f_dc_0 to f_dc_2; and none, 9, 24 or 45 of f_rest_0, ...
/// (all of red, then all of green, then all of blue). All else is passed over.
///
/// `name` names the file in errors. The splats may take `limit` bytes. `report`, if there is one, says what became of
/// bad values. Errors: those of parsePlyHeader and PlyReader, "splats.property" (a property is missing), "splats.rest"
/// (another number of f_rest), "splats.too_large".
Expected<Splats> parsePlySplats(std::span<const std::byte> file, const std::string& name,
                                uint64_t limit = Splats::default_limit, SplatReport* report = nullptr);

/// Makes a PLY file's bytes: binary, little-endian, float32, properties in the order of the paper's own program. The
/// file has no place for `is_antialiased`. Errors: those of validate().
Expected<std::vector<std::byte>> encodePlySplats(const Splats& splats);

}  // namespace glint
