// 26_procedural against a rendering in float64: bodies given by planes, refraction, Fresnel's shares, what is behind.

#include "26_procedural/hull.h"
#include "golden/render.h"
#include "support/instanced_reference.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

namespace glint::test {

namespace {

/// What the example's shader does, in float64, with the defaults of its settings.
class GlassReference {
public:
    GlassReference(const CourseStage& stage) : mesh_(stage.mesh(CourseStage::object_mesh)), hulls_(createHulls(stage)) {
        const Transform3x4 transform = floatingMesh(stage, hulls_[0].box.center());
        to_world_ = Matrix4x4d(transform.matrix());
        solid_.emplace_back(mesh_, std::span(&transform, 1));
    }

    /// Linear. `surfaces`: of glass that the way through it has met.
    Vector3d color(const Vector3d& origin, const Vector3d& direction, uint32_t& surfaces) const {
        Way mirrored;
        uint32_t unused;
        const Vector3d color = followed({origin, direction, Vector3d(1.0)}, mirrored, surfaces);
        return surfaces > 0 ? color + followed(mirrored, mirrored, unused) : color;
    }

private:
    struct Way {
        Vector3d origin, direction, open;
    };

    Vector3d followed(Way way, Way& mirrored, uint32_t& surfaces) const {
        bool is_inside = false;
        for (surfaces = 0; surfaces < 8; surfaces++) {
            const Hit hit = nearest(way.origin, way.direction, is_inside);
            if (is_inside) way.open *= glm::exp(-Vector3d(0.18f, 0.05f, 0.07f) * hit.t);
            if (!hit.is_glass) return way.open * shaded(hit, way.origin, way.direction);
            way.origin += way.direction * hit.t;
            const Vector3d normal = glm::dot(hit.normal, way.direction) > 0.0 ? -hit.normal : hit.normal;
            const double eta = is_inside ? 1.5 : 1.0 / 1.5, cosine = -glm::dot(normal, way.direction);
            const double k = 1.0 - eta * eta * (1.0 - cosine * cosine), beyond = std::sqrt(std::max(k, 0.0));
            const double across = (eta * cosine - beyond) / (eta * cosine + beyond);
            const double along = (cosine - eta * beyond) / (cosine + eta * beyond);
            const double share = k <= 0.0 ? 1.0 : 0.5 * (across * across + along * along);
            const Vector3d reflected = way.direction + 2.0 * cosine * normal;
            if (surfaces == 0) mirrored = {way.origin, reflected, way.open * share};
            if (share < 1.0) {
                way.open *= 1.0 - share;
                way.direction = glm::normalize(eta * way.direction + (eta * cosine - beyond) * normal);
                is_inside = !is_inside;
            } else {
                way.direction = reflected;
            }
        }
        return way.open * sky(way.direction);
    }

    struct Hit {
        double t = 1000.0;
        bool is_glass = false, is_mesh = false, is_floor = false;
        Vector3d normal = Vector3d(0.0), geometric = Vector3d(0.0);
    };

    static Vector3d sky(const Vector3d& direction) {
        return glm::mix(Vector3d(0.70, 0.76, 0.82), Vector3d(0.16, 0.27, 0.46), std::sqrt(std::max(direction.z, 0.0)));
    }

    Hit nearest(const Vector3d& origin, const Vector3d& direction, bool is_inside) const {
        Hit hit;
        const InstancedReference::Hit solid = solid_[0].closestHit(origin, direction, hit.t);
        if (solid.instance != InstancedReference::none) {
            hit.t = solid.t;
            hit.is_mesh = true;
            const uint32_t* corners = &mesh_.indices[solid.triangle * size_t{3}];
            const std::array weights = {1.0 - solid.barycentrics.x - solid.barycentrics.y, solid.barycentrics.x,
                                        solid.barycentrics.y};
            std::array<Vector3d, 3> places;
            for (size_t i = 0; i < 3; i++) {
                places[i] = Vector3d(to_world_ * Vector4d(Vector3d(mesh_.positions[corners[i]]), 1.0));
                hit.normal += weights[i] * Vector3d(mesh_.normals[corners[i]]);
            }
            hit.geometric = glm::normalize(glm::cross(places[1] - places[0], places[2] - places[0]));
            if (glm::dot(hit.geometric, direction) > 0.0) hit.geometric = -hit.geometric;
            hit.normal = glm::normalize(hit.normal * glm::dmat3(solid_[0].inverse(0)));
            if (glm::dot(hit.normal, hit.geometric) < 0.0) hit.normal = -hit.normal;
        }
        const double floor_t = -origin.z / direction.z;
        const Vector3d floor = origin + direction * floor_t;
        if (floor_t > 0.0 && floor_t < hit.t && std::max(std::abs(floor.x), std::abs(floor.y)) <= 5.0) {
            hit = Hit();
            hit.t = floor_t;
            hit.is_floor = true;
            hit.normal = hit.geometric = Vector3d(0, 0, direction.z > 0.0 ? -1.0 : 1.0);
        }
        for (const Hull& hull : hulls_) {
            double enter = -1000.0, leave = 1000.0;
            Vector3d front(0.0), back(0.0);
            for (const Vector4f& each : hull.planes) {
                const Vector4d plane(each);
                const double speed = glm::dot(Vector3d(plane), direction);
                const double t = (plane.w - glm::dot(Vector3d(plane), origin)) / speed;
                if (speed < 0.0 && t > enter) {
                    enter = t;
                    front = Vector3d(plane);
                } else if (speed > 0.0 && t < leave) {
                    leave = t;
                    back = Vector3d(plane);
                }
            }
            if (leave - enter <= 1e-5) continue;
            const bool is_met = is_inside ? enter < 1e-5 && leave > -1e-5 : enter >= 0.0;
            const double t = is_inside ? std::max(leave, 0.0) : enter;
            if (!is_met || t >= hit.t) continue;
            hit = Hit();
            hit.t = t;
            hit.is_glass = true;
            hit.normal = is_inside ? back : front;
        }
        return hit;
    }

    Vector3d shaded(const Hit& hit, const Vector3d& origin, const Vector3d& direction) const {
        if (!hit.is_mesh && !hit.is_floor) return sky(direction);
        const Vector3d position = origin + direction * hit.t, light = Vector3d(Vector3f(CourseStage::light()));
        Vector3d color(0.80, 0.42, 0.22);
        if (hit.is_floor) {
            const double cell = std::floor(position.x) + std::floor(position.y);
            color = Vector3d(std::fmod(std::abs(cell), 2.0) < 0.5 ? 0.62 : 0.30);
        }
        const Vector3d way = light - position;
        const double distance = glm::length(way);
        const Vector3d to_light = way / distance;
        const double diffuse = glm::dot(hit.normal, to_light);
        Vector3d result = color * 0.12;
        if (diffuse <= 0.0 || glm::dot(hit.geometric, to_light) <= 0.0) return result;
        if (solid_[0].closestHit(position + 1e-7 * hit.geometric, to_light, distance).instance !=
            InstancedReference::none)
            return result;
        const Vector3d mirrored = direction - 2.0 * glm::dot(hit.normal, direction) * hit.normal;
        const double highlight = 0.4 * std::pow(std::max(glm::dot(mirrored, to_light), 0.0), 40.0);
        return result +
               (color * diffuse + highlight) * (static_cast<double>(CourseStage::light().w) / distance / distance);
    }

    const Mesh& mesh_;
    std::vector<Hull> hulls_;
    Matrix4x4d to_world_;
    std::vector<InstancedReference> solid_;
};

double shown(double value) {
    value = std::clamp(value, 0.0, 1.0);
    return value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1.0 / 2.4) - 0.055;
}

}  // namespace

// Sides of glass are flat: they turn rays, but do not spread them, so float32 moves a ray by some 2^-20 of its way with
// each, less than four rays about the exact one are apart that are tilted by 2^-16. What those show bounds what may be
// seen; where they disagree by more than two steps is an edge, of which glass has many. Beside that 0.6 steps are
// rounding to 8 bits, and 2^-12 the shading (course_reference.h).
TEST(CourseGlass, AgreesWithFloat64) {
    constexpr uint32_t width = 96, height = 54;
    const Expected<CourseStage> stage = CourseStage::load({});
    ASSERT_TRUE(stage);
    const GlassReference reference(*stage);
    const CameraParameters camera =
        CourseStage::camera(0.0f, static_cast<float>(width) / static_cast<float>(height)).parameters();
    const TempDir folder;
    for (const char* form : {" --tracing driver", " --query"}) {
        const Expected<Image> picture = renderExample("26_procedural", std::string("--size 96x54") + form, folder);
        ASSERT_TRUE(picture);
        uint32_t glass = 0, deep = 0, edges = 0, wrong = 0;
        double largest = 0.0;
        for (uint32_t y = 0; y < height; y++)
            for (uint32_t x = 0; x < width; x++) {
                const Vector2d place = (Vector2d(x, y) + 0.5) / Vector2d(width, height);
                const Vector3d direction =
                    glm::normalize(Vector3d(Vector3f(camera.ray_corner)) + Vector3d(Vector3f(camera.ray_x)) * place.x +
                                   Vector3d(Vector3f(camera.ray_y)) * place.y);
                const Vector3d side = glm::normalize(glm::cross(direction, Vector3d(0, 0, 1)));
                const Vector3d up = glm::cross(side, direction);
                Vector3d low(1e300), high(-1e300);
                uint32_t surfaces = 0;
                for (const Vector3d& tilt : {side, -side, up, -up, Vector3d(0.0)}) {
                    const Vector3d linear = reference.color(Vector3d(Vector3f(camera.position)),
                                                            glm::normalize(direction + 0x1p-16 * tilt), surfaces);
                    const Vector3d color(shown(linear.x), shown(linear.y), shown(linear.z));
                    low = glm::min(low, color);
                    high = glm::max(high, color);
                }
                glass += surfaces > 0;
                deep += surfaces > 2;
                const Vector3d range = high - low;
                if (std::max({range.x, range.y, range.z}) > 2.0 / 255.0) {
                    edges++;
                    continue;
                }
                const Vector3d actual(Vector3f(picture->load(x, y)));
                const Vector3d outside = glm::max(glm::max(low - actual, actual - high), Vector3d(0.0));
                const double error = std::max({outside.x, outside.y, outside.z});
                largest = std::max(largest, error);
                wrong += error > 0.6 / 255.0 + 0x1p-12;
            }
        std::printf("%u pixels show glass, %u through more than two sides; %u are edges; elsewhere off by at most %.2f "
                    "steps, %u by more than allowed\n",
                    glass, deep, edges, largest * 255.0, wrong);
        EXPECT_GT(glass, width * height / 10);
        EXPECT_GT(deep, width * height / 100);
        EXPECT_LT(edges, width * height / 20);
        EXPECT_EQ(wrong, 0u);
    }
}

}  // namespace glint::test
