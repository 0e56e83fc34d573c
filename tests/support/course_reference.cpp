#include "support/course_reference.h"

#include <array>
#include <cmath>

namespace glint::test {

namespace {

/// How far float32 may move a ray sideways where it meets a surface, in units of |origin| + t. With u = 2^-24:
/// - the direction is a sum of three vectors of lengths 1.25, 1.30 and 0.73, two of them scaled by a quotient good to
///   2.5 ulp: 9u of 3.3 in all, brought to unit length with 2u more: 32u t;
/// - the ray is moved to object space by an inverse that was computed in float32, 12u, and a product, 4u, of an origin
///   and a translation, which is at most |origin| + t + 2, and of a direction: 32u |origin| + 32u t;
/// - the triangle's test takes differences and products of numbers of up to t: 16u t.
/// Together less than 96u (|origin| + t). The same holds for the rays to the lamp.
constexpr double ray_error = 0x1p-17;

/// Cosines whose sign float32 may get wrong: products of vectors good to 16u.
constexpr double sign_error = 0x1p-18;

/// Over the surface: rays start higher than the first, which is float64's rounding, and lower than the second, of which
/// the offset of a spawn point (docs/rays.md) on a triangle of size 10, some 1500u, is less.
constexpr double lowest_start = 1e-9, highest_start = 3e-4;

constexpr double far = 1000.0;

double encode(double value) {
    value = std::clamp(value, 0.0, 1.0);
    return value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1.0 / 2.4) - 0.055;
}

/// Four directions across one.
std::array<Vector3d, 4> around(const Vector3d& direction) {
    const Vector3d side = glm::normalize(glm::cross(direction, Vector3d(0.3, 0.5, 0.8)));
    const Vector3d up = glm::cross(side, direction);
    return {side, -side, up, -up};
}

}  // namespace

CourseReference::CourseReference(const CourseStage& stage, CourseShading shading, float time, uint32_t width,
                                 uint32_t height)
    : stage_(stage),
      shading_(shading),
      size_(width, height),
      camera_(CourseStage::camera(time, static_cast<float>(width) / static_cast<float>(height)).parameters()),
      light_(Vector3f(CourseStage::light())),
      power_(CourseStage::light().w) {
    for (uint32_t i = 0; i < CourseStage::object_count; i++)
        objects_.emplace_back(stage.mesh(i), std::span(&stage.transform(i), 1));
}

CourseReference::Hit CourseReference::closestHit(const Vector3d& origin, const Vector3d& direction) const {
    Hit result;
    result.t = far;
    InstancedReference::Hit hit = {.barycentrics = Vector2d(0.0)};
    for (uint32_t i = 0; i < CourseStage::object_count; i++) {
        const InstancedReference::Hit each = objects_[i].closestHit(origin, direction, result.t);
        if (each.instance == InstancedReference::none) continue;
        hit = each;
        result.object = i;
        result.t = each.t;
    }
    if (result.object == CourseStage::object_count) return result;
    const Mesh& mesh = stage_.mesh(result.object);
    const Matrix4x4d to_world(stage_.transform(result.object).matrix());
    const uint32_t* corners = &mesh.indices[hit.triangle * size_t{3}];
    std::array<Vector3d, 3> places;
    Vector3d normal(0.0);
    const std::array weights = {1.0 - hit.barycentrics.x - hit.barycentrics.y, hit.barycentrics.x, hit.barycentrics.y};
    for (size_t i = 0; i < 3; i++) {
        places[i] = Vector3d(to_world * Vector4d(Vector3d(mesh.positions[corners[i]]), 1.0));
        normal += weights[i] * Vector3d(mesh.normals[corners[i]]);
        result.position += weights[i] * places[i];
    }
    result.geometric = glm::normalize(glm::cross(places[1] - places[0], places[2] - places[0]));
    if (glm::dot(result.geometric, direction) > 0.0) result.geometric = -result.geometric;
    result.normal = glm::normalize(normal * glm::dmat3(objects_[result.object].inverse(0)));
    if (glm::dot(result.normal, result.geometric) < 0.0) result.normal = -result.normal;
    return result;
}

bool CourseReference::isVisible(const Vector3d& position) const {
    const Vector3d way = light_ - position;
    const double distance = glm::length(way);
    return std::all_of(objects_.begin(), objects_.end(), [&](const InstancedReference& object) {
        return object.closestHit(position, way / distance, distance).instance == InstancedReference::none;
    });
}

Vector3d CourseReference::color(const Hit& hit, const Vector3d& direction, bool is_left, bool is_lit,
                                bool has_highlight) const {
    if (shading_ == CourseShading::Normals)
        return hit.object == CourseStage::object_count ? Vector3d(0.25) : hit.normal * 0.5 + 0.5;
    Vector3d color;
    if (hit.object == CourseStage::object_count) {
        color = glm::mix(Vector3d(0.70, 0.76, 0.82), Vector3d(0.16, 0.27, 0.46), std::sqrt(std::max(direction.z, 0.0)));
    } else {
        Vector3d surface(0.80, 0.42, 0.22);
        if (hit.object == CourseStage::object_floor) {
            const double cell = std::floor(hit.position.x) + std::floor(hit.position.y);
            surface = Vector3d(std::fmod(std::abs(cell), 2.0) < 0.5 ? 0.62 : 0.30);
        }
        const Vector3d way = light_ - hit.position;
        const double arriving = power_ / glm::dot(way, way);
        const Vector3d to_light = glm::normalize(way);
        const bool use_geometric = shading_ == CourseShading::Diffuse && is_left;
        const Vector3d normal = use_geometric ? hit.geometric : hit.normal;
        const Vector3d mirrored = direction - 2.0 * glm::dot(normal, direction) * normal;
        const double highlight =
            has_highlight ? 0.4 * std::pow(std::max(glm::dot(mirrored, to_light), 0.0), 40.0) : 0.0;
        color = surface * 0.12 +
                (surface * std::max(glm::dot(normal, to_light), 0.0) + highlight) * (is_lit ? arriving : 0.0);
    }
    return {encode(color.x), encode(color.y), encode(color.z)};
}

void CourseReference::shade(const Hit& hit, const Vector3d& direction, bool is_left, double radius,
                            Pixel& pixel) const {
    const auto add = [&](bool is_lit, bool has_highlight) {
        pixel.add(color(hit, direction, is_left, is_lit, has_highlight));
    };
    const bool is_hit = hit.object != CourseStage::object_count;
    if (!is_hit || shading_ < CourseShading::Phong) return add(true, false);

    const Vector3d to_light = glm::normalize(light_ - hit.position);
    const double cosine = glm::dot(hit.normal, to_light), geometric = glm::dot(hit.geometric, to_light);
    bool may_be_lit = true, may_be_dark = false;
    if (shading_ == CourseShading::Shadows) {
        may_be_lit = geometric > -sign_error;
        may_be_dark = geometric < sign_error;
        if (may_be_lit) {
            uint32_t tried = 0, visible = 0;
            const auto tryFrom = [&](const Vector3d& start) {
                tried++;
                visible += isVisible(start);
            };
            tryFrom(hit.position + hit.geometric * lowest_start);
            if (radius > 0.0) pixel.is_shadow = geometric > 0.0 && cosine > 0.0 && visible == 0;
            if (radius > 0.0) {
                // As for the primary ray, and where that may have brought the hit to.
                const double moved =
                    std::sqrt(2.0) * ray_error * (glm::length(hit.position) + glm::length(light_ - hit.position)) +
                    radius / std::max(-glm::dot(hit.geometric, direction), 1e-3);
                tryFrom(hit.position + hit.geometric * highest_start);
                for (const Vector3d& side : around(to_light))
                    tryFrom(hit.position + hit.geometric * (lowest_start + moved) + side * moved);
            }
            may_be_lit = visible > 0;
            may_be_dark = may_be_dark || visible < tried;
        }
    }
    for (const bool is_lit : {true, false}) {
        if (!(is_lit ? may_be_lit : may_be_dark)) continue;
        if (cosine > -sign_error) add(is_lit, true);
        if (cosine < sign_error) add(is_lit, false);
    }
}

CourseReference::Pixel CourseReference::pixel(uint32_t x, uint32_t y) const {
    const Vector3d origin(camera_.position);
    const Vector2d place = (Vector2d(x, y) + 0.5) / size_;
    const Vector3d direction =
        glm::normalize(Vector3d(Vector4d(camera_.ray_corner)) + Vector3d(Vector4d(camera_.ray_x)) * place.x +
                       Vector3d(Vector4d(camera_.ray_y)) * place.y);
    const bool is_left = x + 0.5 < 0.5 * size_.x;
    const Hit hit = closestHit(origin, direction);
    Pixel pixel;
    pixel.is_miss = hit.object == CourseStage::object_count;
    // The disc of all that float32 may have taken lies within the square of four rays, so that a straight border
    // through the disc has one of them on its other side. A miss is moved as far as a hit of the farthest corner would
    // be.
    const double t = pixel.is_miss ? 16.0 : hit.t;
    const double radius = std::sqrt(2.0) * ray_error * (glm::length(origin) + t);
    shade(hit, direction, is_left, radius, pixel);
    for (const Vector3d& side : around(direction))
        shade(closestHit(origin + side * radius, direction), direction, is_left, 0.0, pixel);
    return pixel;
}

}  // namespace glint::test
