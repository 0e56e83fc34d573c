#pragma once

// What the first examples of the ray-tracing course show, in float64, with what float32 may make of it.

#include "common/course.h"
#include "support/instanced_reference.h"

#include <algorithm>

namespace glint::test {

/// What an example's shader does with a hit, with its settings' defaults.
enum class CourseShading : uint8_t { Normals, Diffuse, Phong, Shadows };

class CourseReference {
public:
    /// Of a picture of this size. Keeps a reference to the stage.
    CourseReference(const CourseStage& stage, CourseShading shading, float time, uint32_t width, uint32_t height);

    /// All values, as they are stored in [0, 1], that rays within the error of float32 have in a pixel: an interval for
    /// each channel.
    struct Pixel {
        Vector3d low = Vector3d(1e300), high = Vector3d(-1e300);
        bool is_miss = false;    ///< the exact ray meets nothing
        bool is_shadow = false;  ///< the exact ray's hit faces the lamp, which does not see it
        void add(const Vector3d& color) {
            low = glm::min(low, color);
            high = glm::max(high, color);
        }
        /// More than two steps of 8 bits apart: rays that float32 cannot tell apart see different things.
        bool isEdge() const {
            const Vector3d range = high - low;
            return std::max({range.x, range.y, range.z}) > 2.0 / 255.0;
        }
    };
    Pixel pixel(uint32_t x, uint32_t y) const;

    /// How far a stored value may be from its interval: rounding to 8 bits, for which APIs allow 0.6 steps, and the
    /// arithmetic of the shading. With u = 2^-24 the largest part of that is a highlight, pow(x, 40): x is a product of
    /// unit vectors, off by 16u, and log2(x) by 2^-21, so the power is off by 40 (16u + 0.7 * 2^-21) < 2^-15 of itself,
    /// which 0.4 of what arrives, at most 3, has 1.2 times of; sRGB's slope is below 4 where there is the light of the
    /// surroundings, and its own power is good to 2^-18. Together less than 2^-12.
    static constexpr double shade_error = 0.6 / 255.0 + 0x1p-12;

private:
    struct Hit {
        uint32_t object = CourseStage::object_count;  ///< none
        double t = 0.0;
        Vector3d position = Vector3d(0.0), geometric = Vector3d(0.0), normal = Vector3d(0.0);
    };
    Hit closestHit(const Vector3d& origin, const Vector3d& direction) const;
    bool isVisible(const Vector3d& position) const;
    /// Adds what the hit looks like. `radius`: how far float32 may have moved the ray; 0: as it is.
    void shade(const Hit& hit, const Vector3d& direction, bool is_left, double radius, Pixel& pixel) const;
    Vector3d color(const Hit& hit, const Vector3d& direction, bool is_left, bool is_lit, bool has_highlight) const;

    const CourseStage& stage_;
    const CourseShading shading_;
    const Vector2d size_;
    const CameraParameters camera_;
    const Vector3d light_;
    const double power_;
    std::vector<InstancedReference> objects_;
};

}  // namespace glint::test
