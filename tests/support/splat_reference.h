#pragma once

// Pictures of Gaussian splats in float64: what the renderer's model says, with and without what a renderer leaves out.

#include <glint/format/splats.h>
#include <glint/math/camera.h>

#include <optional>
#include <span>
#include <vector>

namespace glint::test {

/// In which order splats cover each other.
enum class SplatOrder : uint8_t {
    Centres,   ///< the same for all pixels: by the view depth of the centres as float32, then instance, then number
    PerPixel,  ///< by the depth at which the ray of the pixel meets the splat's greatest weight, then as Centres
};

/// The model's parameters, with the renderer's defaults, and its cut-offs, which are 0 where nothing is left out.
struct SplatSettings {
    float near = 0.2f;      ///< splats whose centre has a smaller view depth are not seen
    float low_pass = 0.3f;  ///< added to the variances, in squared pixels
    bool is_antialiased = false;
    uint32_t max_degree = Splats::max_degree;
    float alpha_cut = 0.0f;           ///< a splat is left out of a pixel where its alpha is below
    float transmittance_stop = 0.0f;  ///< a pixel ends after the splat that takes its transmittance below
    SplatOrder order = SplatOrder::Centres;
};

/// Splats with an affine transform to the world.
struct SplatInstance {
    const Splats* splats = nullptr;
    Matrix4x4f transform = Matrix4x4f(1.0f);
};

/// A splat in a picture. Of a pixel whose centre is d away from `centre` it has the weight
/// exp(-1/2 (d.x^2 / a + (d.y - shear d.x)^2 * scale)).
struct ProjectedSplat {
    float depth = 0.0f;               ///< of its centre
    Vector2d centre = Vector2d(0.0);  ///< in pixels from the top left corner of the picture, y down
    double a = 0.0, c = 0.0;          ///< variances along x and y, in squared pixels
    double shear = 0.0;               ///< covariance of x and y over a
    double scale = 0.0;               ///< a over the determinant of the covariance
    double opacity = 0.0;
    Vector3d color = Vector3d(0.0);

    double power(const Vector2d& offset) const {
        const double across = offset.y - shear * offset.x;
        return -0.5 * (offset.x * offset.x / a + across * across * scale);
    }
};

/// The model of docs/splatting.md for one splat: none if its centre is nearer than the near plane, or if it has no area
/// at all (which takes a low-pass of 0).
std::optional<ProjectedSplat> projectSplat(const SplatInstance& instance, size_t splat, const CameraParameters& camera,
                                           uint32_t width, uint32_t height, const SplatSettings& settings = {});

/// Depth at which the ray of a pixel (its centre, in pixels from the top left corner) meets a splat's greatest weight.
/// Scales below 1e-6 of the largest are taken to be that.
double splatDepthAlong(const SplatInstance& instance, size_t splat, const CameraParameters& camera, uint32_t width,
                       uint32_t height, const Vector2d& pixel);

/// Rows from top to bottom.
struct SplatPicture {
    uint32_t width = 0, height = 0;
    std::vector<Vector3d> color;        ///< sum of T alpha color: what covers a black background
    std::vector<double> transmittance;  ///< T behind the last splat
    std::vector<double> depth;          ///< sum of T alpha depth over 1 - T; infinity where that is 0

    /// The centre of a pixel, in pixels from the top left corner.
    Vector2d place(size_t pixel) const {
        const size_t row = pixel / width;
        return {static_cast<double>(pixel - row * width) + 0.5, static_cast<double>(row) + 0.5};
    }
};

/// The whole picture, on all cores. Where the settings leave nothing out, the result still differs from the sum over
/// all splats by less than 1e-12 times the largest color: alphas below 1e-12 / 4 over the number of splats are dropped,
/// as taking a splat out changes a pixel by at most its alpha times the largest color, on either side of it; and pixels
/// end at a transmittance of 1e-12 / 4, which bounds all that is behind.
SplatPicture renderSplats(const Camera& camera, uint32_t width, uint32_t height,
                          std::span<const SplatInstance> instances, const SplatSettings& settings = {});

/// How much two pictures' colors differ, over all channels of all pixels.
struct PictureError {
    double rmse = 0.0;     ///< root of the mean square
    double largest = 0.0;  ///< infinity where one is not finite
    uint64_t above = 0;    ///< pixels with a channel that differs by more than the threshold

    /// Signal-to-noise ratio for a peak of 1, in dB; 999 for equal pictures.
    double psnr() const;
};
PictureError comparePictures(const SplatPicture& actual, const SplatPicture& expected, double threshold = 1.0 / 255.0);

}  // namespace glint::test
