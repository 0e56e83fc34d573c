#pragma once

// Which instance each pixel of a picture shows (--ids of the examples), and whether two pictures agree about it.

#include "support/instanced_reference.h"

#include <glint/base/expected.h>
#include <glint/math/camera.h>

#include <cstdint>
#include <filesystem>
#include <vector>

namespace glint::test {

struct InstancePicture {
    static constexpr uint32_t none = UINT32_MAX;

    uint32_t width = 0;
    uint32_t height = 0;
    std::vector<uint32_t> instances;  ///< row after row; `none` where there is background

    /// Reads what --ids has written. Errors: those of reading .npy files, "test.shape".
    static Expected<InstancePicture> load(const std::filesystem::path& path);

    uint32_t at(uint32_t x, uint32_t y) const { return instances[size_t{y} * width + x]; }
    /// True if one of the pixels around it shows something else.
    bool isNearEdge(uint32_t x, uint32_t y) const;
};

/// Pixels at which two pictures of one size show different instances.
struct InstanceDifferences {
    uint64_t pixels = 0;       ///< of a picture
    uint64_t edge_pixels = 0;  ///< pixels near an edge in either picture
    uint64_t near_both = 0;    ///< differences near an edge in both pictures
    uint64_t near_one = 0;     ///< in one of them: something thinner than a pixel, or a stray pixel
    uint64_t elsewhere = 0;    ///< in neither
    std::vector<Vector2u> near_both_pixels;
    std::vector<Vector2u> other_pixels;  ///< of the last two kinds

    uint64_t count() const { return near_both + near_one + elsewhere; }
};

InstanceDifferences compareInstances(const InstancePicture& a, const InstancePicture& b);

/// Says by rays in float64 what may be seen at a pixel.
class InstanceJudge {
public:
    /// Keeps a reference to the mesh.
    InstanceJudge(const Mesh& mesh, std::span<const Transform3x4> instances, const CameraParameters& camera,
                  uint32_t width, uint32_t height)
        : reference_(mesh, instances), camera_(camera), width_(width), height_(height) {}

    /// What is seen at a point of the picture, in pixels from its top left corner.
    uint32_t at(const Vector2d& place) const;
    /// True if the instance is seen at a place at most `distance` pixels from the pixel's centre, in x and in y: at one
    /// of the points of a grid eight to the pixel.
    bool isSeen(uint32_t instance, const Vector2u& pixel, double distance) const;

private:
    InstancedReference reference_;
    CameraParameters camera_;
    double width_, height_;
};

}  // namespace glint::test
