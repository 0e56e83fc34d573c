#include "support/splat_reference.h"

#include <glint/base/thread_pool.h>

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace glint::test {

namespace {

using Matrix3x3d = glm::dmat3;

constexpr uint32_t tile_size = 8;
constexpr double left_out = 0.25e-12;

/// Of the basis in the order of Splats::harmonics; from the definition of the real spherical harmonics, with the
/// Condon-Shortley phase: these are sqrt((2l+1)/4pi (l-m)!/(l+m)!) P_l^m and, for m != 0, sqrt(2) cos or sin of m phi.
std::array<double, 16> harmonicsOf(const Vector3d& d) {
    const double x = d.x, y = d.y, z = d.z, pi = glm::pi<double>();
    const double k1 = std::sqrt(3.0 / (4.0 * pi));
    const double k2 = std::sqrt(15.0 / (4.0 * pi));
    const double k20 = std::sqrt(5.0 / (16.0 * pi));
    const double k33 = std::sqrt(35.0 / (32.0 * pi));
    const double k32 = std::sqrt(105.0 / (4.0 * pi));
    const double k31 = std::sqrt(21.0 / (32.0 * pi));
    const double k30 = std::sqrt(7.0 / (16.0 * pi));
    return {std::sqrt(1.0 / (4.0 * pi)),
            -k1 * y,
            k1 * z,
            -k1 * x,
            k2 * x * y,
            -k2 * y * z,
            k20 * (2.0 * z * z - x * x - y * y),
            -k2 * x * z,
            0.5 * k2 * (x * x - y * y),
            -k33 * y * (3.0 * x * x - y * y),
            k32 * x * y * z,
            -k31 * y * (4.0 * z * z - x * x - y * y),
            k30 * z * (2.0 * z * z - 3.0 * x * x - 3.0 * y * y),
            -k31 * x * (4.0 * z * z - x * x - y * y),
            0.5 * k32 * z * (x * x - y * y),
            -k33 * x * (x * x - 3.0 * y * y)};
}

/// What all splats of an instance have in common.
struct View {
    Matrix4x4d to_view;
    Vector3d eye;       ///< in the space of the splats
    Vector2d focal;     ///< pixels
    Vector2d tangents;  ///< of half the fields of view
    Vector2d middle;    ///< of the picture, in pixels

    View(const SplatInstance& instance, const CameraParameters& camera, uint32_t width, uint32_t height)
        : to_view(exactView(camera) * Matrix4x4d(instance.transform)),
          eye(glm::inverse(Matrix4x4d(instance.transform)) * Vector4d(camera.position)),
          tangents(1.0 / static_cast<double>(camera.projection[0][0]),
                   1.0 / static_cast<double>(camera.projection[1][1])),
          middle(0.5 * width, 0.5 * height) {
        focal = middle / tangents;
    }

    /// The camera's axes and its eye as they are: the view matrix has a translation that was rounded.
    static Matrix4x4d exactView(const CameraParameters& camera) {
        const Matrix3x3d axes(Matrix4x4d(camera.view));
        Matrix4x4d view(axes);
        view[3] = Vector4d(-(axes * Vector3d(camera.position)), 1.0);
        return view;
    }
    /// From the unit sphere to the splat in view space, around its centre.
    Matrix3x3d shapeOf(const Splats& splats, size_t i, const Vector3d& scales) const {
        const Vector4d q = glm::normalize(Vector4d(splats.rotations[i]));
        Matrix3x3d shape = Matrix3x3d(to_view) * glm::mat3_cast(glm::dquat(q.w, q.x, q.y, q.z));
        for (int k = 0; k < 3; k++) shape[k] *= scales[k];
        return shape;
    }
    Vector3d centreOf(const Splats& splats, size_t i) const {
        return Vector3d(to_view * Vector4d(Vector3d(splats.positions[i]), 1.0));
    }
    /// Direction through a point of the picture whose component along the viewing direction is 1.
    Vector3d rayThrough(const Vector2d& pixel) const {
        const Vector2d offset = (pixel - middle) / focal;
        return {offset.x, -offset.y, -1.0};
    }
};

std::optional<ProjectedSplat> project(const View& view, const Splats& splats, size_t i, const SplatSettings& settings) {
    ProjectedSplat result;
    const Vector3d v = view.centreOf(splats, i);
    const double z = -v.z;
    result.depth = static_cast<float>(z);
    if (!(result.depth >= settings.near)) return std::nullopt;
    result.centre = view.middle + view.focal * Vector2d(v.x, -v.y) / z;

    // Rows of the Jacobian; the picture's y points down, and z is against the viewing direction.
    const Vector2d limit = 1.3 * view.tangents;
    const double tx = std::clamp(v.x / z, -limit.x, limit.x);
    const double ty = std::clamp(v.y / z, -limit.y, limit.y);
    const Matrix3x3d shape = view.shapeOf(splats, i, Vector3d(splats.scales[i]));
    const Vector3d m1 = Vector3d(view.focal.x / z, 0.0, view.focal.x * tx / z) * shape;
    const Vector3d m2 = Vector3d(0.0, -view.focal.y / z, -view.focal.y * ty / z) * shape;

    const auto low_pass = static_cast<double>(settings.low_pass);
    const double s1 = glm::dot(m1, m1), s2 = glm::dot(m2, m2);
    const Vector3d product = glm::cross(m1, m2);
    const double plain = glm::dot(product, product);
    const double determinant = plain + low_pass * (s1 + s2) + low_pass * low_pass;
    if (!(determinant > 0.0)) return std::nullopt;
    result.a = s1 + low_pass;
    result.c = s2 + low_pass;
    result.shear = glm::dot(m1, m2) / result.a;
    result.scale = result.a / determinant;
    result.opacity = static_cast<double>(splats.opacities[i]);
    if (settings.is_antialiased) result.opacity *= std::sqrt(plain / determinant);

    const std::array<double, 16> basis = harmonicsOf(glm::normalize(Vector3d(splats.positions[i]) - view.eye));
    const uint32_t degree = std::min(splats.degree, settings.max_degree);
    const Vector3f* harmonics = &splats.harmonics[i * splats.coefficientCount()];
    Vector3d color(0.5);
    for (uint32_t k = 0; k < (degree + 1) * (degree + 1); k++) color += basis[k] * Vector3d(harmonics[k]);
    result.color = glm::max(color, Vector3d(0.0));
    return result;
}

/// Where rays from the eye meet a splat's greatest weight.
struct AlongRays {
    Matrix3x3d to_unit;  ///< view space to the space in which the splat is a unit sphere
    Vector3d centre;     ///< there, relative to the eye

    AlongRays() = default;
    AlongRays(const View& view, const Splats& splats, size_t i) {
        Vector3d scales(splats.scales[i]);
        const double largest = std::max({scales.x, scales.y, scales.z});
        scales = largest > 0.0 ? glm::max(scales, Vector3d(1e-6 * largest)) : Vector3d(1.0);
        to_unit = glm::inverse(view.shapeOf(splats, i, scales));
        centre = to_unit * view.centreOf(splats, i);
    }
    double depth(const Vector3d& ray) const {
        const Vector3d d = to_unit * ray;
        return glm::dot(d, centre) / glm::dot(d, d);
    }
};

struct Drawn {
    ProjectedSplat splat;
    double least_power = 0.0;  ///< below, alpha is left out
    AlongRays along;
};

struct Rectangle {
    uint32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// The pixels whose centres a splat's ellipse of `least_power` can hold; none if there are none.
std::optional<Rectangle> pixelsOf(const Drawn& drawn, uint32_t width, uint32_t height) {
    const double t = -2.0 * drawn.least_power;
    // A pixel more than needed takes care of rounding.
    const Vector2d reach = Vector2d(std::sqrt(t * drawn.splat.a), std::sqrt(t * drawn.splat.c)) + 1.0;
    const Vector2d low = glm::max(drawn.splat.centre - reach, Vector2d(0.0));
    const Vector2d high = glm::min(drawn.splat.centre + reach, Vector2d(width, height));
    if (!(low.x < high.x && low.y < high.y)) return std::nullopt;
    return Rectangle{static_cast<uint32_t>(low.x), static_cast<uint32_t>(low.y),
                     static_cast<uint32_t>(std::ceil(high.x)), static_cast<uint32_t>(std::ceil(high.y))};
}

struct Pixel {
    Vector3d color = Vector3d(0.0);
    double transmittance = 1.0;
    double weight = 0.0;  // 1 - transmittance, without its cancellation
    double depth = 0.0;

    void add(const ProjectedSplat& splat, double alpha) {
        const double share = transmittance * alpha;
        color += share * splat.color;
        depth += share * static_cast<double>(splat.depth);
        weight += share;
        transmittance *= 1.0 - alpha;
    }
};

struct Job {
    const std::vector<Drawn>& drawn;
    std::span<const uint32_t> list;  ///< of the tile, in the order of the centres
    const View& view;
    const SplatSettings& settings;
    double alpha_cut, stop;

    /// -1 if it is left out.
    double alphaOf(const Drawn& each, const Vector2d& place) const {
        const double power = each.splat.power(place - each.splat.centre);
        if (!(power >= each.least_power)) return -1.0;
        const double alpha = each.splat.opacity * std::exp(power);
        return alpha >= alpha_cut ? alpha : -1.0;
    }

    Pixel inCentreOrder(const Vector2d& place) const {
        Pixel pixel;
        for (const uint32_t index : list) {
            const double alpha = alphaOf(drawn[index], place);
            if (alpha < 0.0) continue;
            pixel.add(drawn[index].splat, alpha);
            if (pixel.transmittance < stop) break;
        }
        return pixel;
    }

    Pixel inPixelOrder(const Vector2d& place) const {
        struct Entry {
            double depth;
            uint32_t index;  // in the order of the centres
            double alpha;
        };
        thread_local std::vector<Entry> entries;
        entries.clear();
        const Vector3d ray = view.rayThrough(place);
        for (const uint32_t index : list) {
            const double alpha = alphaOf(drawn[index], place);
            if (alpha >= 0.0) entries.push_back({drawn[index].along.depth(ray), index, alpha});
        }
        std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
            return a.depth != b.depth ? a.depth < b.depth : a.index < b.index;
        });
        Pixel pixel;
        for (const Entry& entry : entries) {
            pixel.add(drawn[entry.index].splat, entry.alpha);
            if (pixel.transmittance < stop) break;
        }
        return pixel;
    }
};

}  // namespace

std::optional<ProjectedSplat> projectSplat(const SplatInstance& instance, size_t splat, const CameraParameters& camera,
                                           uint32_t width, uint32_t height, const SplatSettings& settings) {
    return project(View(instance, camera, width, height), *instance.splats, splat, settings);
}

double splatDepthAlong(const SplatInstance& instance, size_t splat, const CameraParameters& camera, uint32_t width,
                       uint32_t height, const Vector2d& pixel) {
    const View view(instance, camera, width, height);
    return AlongRays(view, *instance.splats, splat).depth(view.rayThrough(pixel));
}

SplatPicture renderSplats(const Camera& camera, uint32_t width, uint32_t height,
                          std::span<const SplatInstance> instances, const SplatSettings& settings) {
    const CameraParameters parameters = camera.parameters();
    size_t count = 0;
    for (const SplatInstance& instance : instances) count += instance.splats->size();
    const double alpha_cut = std::max(static_cast<double>(settings.alpha_cut), left_out / std::max(count, size_t{1}));
    const double stop = std::max(static_cast<double>(settings.transmittance_stop), left_out);

    std::vector<Drawn> drawn;
    for (const SplatInstance& instance : instances) {
        const View view(instance, parameters, width, height);
        for (size_t i = 0; i < instance.splats->size(); i++) {
            const std::optional<ProjectedSplat> splat = project(view, *instance.splats, i, settings);
            if (!splat || !(splat->opacity >= alpha_cut)) continue;
            // A little lower, so that it is alpha itself that decides.
            Drawn each = {*splat, std::log(alpha_cut / splat->opacity) - 1e-9, {}};
            if (!pixelsOf(each, width, height)) continue;
            if (settings.order == SplatOrder::PerPixel) each.along = AlongRays(view, *instance.splats, i);
            drawn.push_back(each);
        }
    }
    std::stable_sort(drawn.begin(), drawn.end(),
                     [](const Drawn& a, const Drawn& b) { return a.splat.depth < b.splat.depth; });

    // Lists of the tiles, one after the other.
    const uint32_t columns = (width + tile_size - 1) / tile_size, rows = (height + tile_size - 1) / tile_size;
    std::vector<size_t> begins(size_t{columns} * rows + 1);
    const auto forEachTile = [&](const Drawn& each, auto&& visit) {
        const Rectangle pixels = *pixelsOf(each, width, height);
        for (uint32_t y = pixels.y0 / tile_size; y <= (pixels.y1 - 1) / tile_size; y++)
            for (uint32_t x = pixels.x0 / tile_size; x <= (pixels.x1 - 1) / tile_size; x++)
                visit(size_t{y} * columns + x);
    };
    for (const Drawn& each : drawn) forEachTile(each, [&](size_t tile) { begins[tile + 1]++; });
    for (size_t tile = 1; tile < begins.size(); tile++) begins[tile] += begins[tile - 1];
    std::vector<uint32_t> lists(begins.back());
    std::vector<size_t> ends(begins.begin(), begins.end() - 1);
    for (uint32_t i = 0; i < drawn.size(); i++) forEachTile(drawn[i], [&](size_t tile) { lists[ends[tile]++] = i; });

    const size_t pixels = size_t{width} * height;
    SplatPicture picture = {width, height, std::vector<Vector3d>(pixels), std::vector<double>(pixels),
                            std::vector<double>(pixels)};
    // Any instance's will do: rays are those of the camera.
    const View view({nullptr, Matrix4x4f(1.0f)}, parameters, width, height);
    const auto drawRow = [&](uint32_t row) {
        for (uint32_t y = row * tile_size; y < std::min((row + 1) * tile_size, height); y++)
            for (uint32_t x = 0; x < width; x++) {
                const size_t tile = size_t{row} * columns + x / tile_size;
                const Job job = {drawn,     std::span(lists).subspan(begins[tile], begins[tile + 1] - begins[tile]),
                                 view,      settings,
                                 alpha_cut, stop};
                const Vector2d place(x + 0.5, y + 0.5);
                const Pixel pixel =
                    settings.order == SplatOrder::Centres ? job.inCentreOrder(place) : job.inPixelOrder(place);
                const size_t at = size_t{y} * width + x;
                picture.color[at] = pixel.color;
                picture.transmittance[at] = pixel.transmittance;
                picture.depth[at] =
                    pixel.weight > 0.0 ? pixel.depth / pixel.weight : std::numeric_limits<double>::infinity();
            }
    };
    ThreadPool pool;
    for (uint32_t row = 0; row < rows; row++) pool.submit([&drawRow, row] { drawRow(row); });
    pool.wait();
    return picture;
}

double PictureError::psnr() const { return rmse > 0.0 ? -20.0 * std::log10(rmse) : 999.0; }

PictureError comparePictures(const SplatPicture& actual, const SplatPicture& expected, double threshold) {
    if (actual.width != expected.width || actual.height != expected.height)
        throw std::runtime_error("pictures of different sizes are compared");
    PictureError error;
    double squares = 0.0;
    for (size_t i = 0; i < expected.color.size(); i++) {
        const Vector3d difference = glm::abs(actual.color[i] - expected.color[i]);
        double largest = std::max({difference.x, difference.y, difference.z});
        if (!std::isfinite(difference.x + difference.y + difference.z))
            largest = std::numeric_limits<double>::infinity();
        squares += std::isfinite(largest) ? glm::dot(difference, difference) : largest;
        error.largest = std::max(error.largest, largest);
        error.above += largest > threshold;
    }
    error.rmse = std::sqrt(squares / (3.0 * static_cast<double>(expected.color.size())));
    return error;
}

}  // namespace glint::test
