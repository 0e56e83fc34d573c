// Hits on instances - turned, scaled, mirrored, stretched, sheared, moved - against float64.

#include "support/device_fixture.h"
#include "support/hit_accuracy.h"

#include <glint/geometry/primitives.h>
#include <glint/graphics/ray_caster.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace glint::test {

namespace {

constexpr double u = 0x1p-24;

/// What rounding may do to a ray that is brought into an instance's space.
///
/// The inverse's entries are 2 x 2 minors over the determinant. With columns a, b, c a minor is off by 3 u |a| |b|, the
/// determinant by 6 u |a| |b| |c|, and the division by 5 u: a row of the inverse by 14 u k times its length, where k =
/// |a| |b| |c| / |determinant|, which is 1 for columns at right angles. Bringing a place there adds the roundings of
/// four products and sums, and of the two sides of `inverse * origin - inverse * translation`; 2 u are those of this
/// test, which hands the ray to hitBound in float32. Together less than 32 u k times |inverse| and the sizes of what is
/// multiplied: origin, translation, and t times the direction.
class Placement {
public:
    Placement(const Mesh& mesh, const MeshInstance& instance)
        : mesh_(mesh),
          reference_(mesh),
          matrix_(instance.transform.matrix()),
          inverse_(glm::inverse(matrix_)),
          index_(instance.index) {
        double product = 1.0, squares = 0.0;
        for (int i = 0; i < 3; i++) {
            product *= glm::length(Vector3d(matrix_[i]));
            for (int j = 0; j < 3; j++) squares += inverse_[i][j] * inverse_[i][j];
        }
        spread_ = 32.0 * u * std::sqrt(squares) * product / std::abs(glm::determinant(matrix_));
    }

    Ray toObject(const Ray& ray) const {
        return {Vector3f(inverse_ * Vector4d(ray.origin, 1.0)), ray.t_min,
                Vector3f(inverse_ * Vector4d(ray.direction, 0.0)), ray.t_max};
    }
    Vector3d origin(const Ray& ray) const { return Vector3d(inverse_ * Vector4d(ray.origin, 1.0)); }
    Vector3d direction(const Ray& ray) const { return Vector3d(inverse_ * Vector4d(ray.direction, 0.0)); }

    ReferenceHit closestHit(const Ray& ray, double t_max, const ReferenceHierarchy::Filter& filter = {}) const {
        return reference_.closestHit(origin(ray), direction(ray), ray.t_min, t_max, filter);
    }

    /// How far off the hit with a triangle may be: hitBound's, and what bringing the ray here adds.
    HitBound bound(const Ray& ray, uint32_t triangle, double t) const {
        HitBound bound = hitBound(mesh_, triangle, toObject(ray));
        const double added = spread_ * (glm::length(Vector3d(ray.origin)) + glm::length(Vector3d(matrix_[3])) +
                                        t * glm::length(Vector3d(ray.direction)));
        const Vector3d along = direction(ray);
        bound.edge += added;
        // Off by `added` across a plane at a grazing angle: further along the ray by 1 / cosine.
        bound.t += added / std::max(std::abs(glm::dot(normal(triangle), along)), 1e-300);
        return bound;
    }

    /// Where the line of the ray meets the triangle's plane.
    double planeDistance(const Ray& ray, uint32_t triangle) const {
        const Vector3d n = normal(triangle);
        return glm::dot(corner(triangle, 0) - origin(ray), n) / glm::dot(direction(ray), n);
    }
    double border(const Ray& ray, uint32_t triangle) const { return borderDistance(mesh_, triangle, toObject(ray)); }
    /// Of unit length, towards the side from which the corners are counter-clockwise.
    Vector3d normal(uint32_t triangle) const {
        const Vector3d a = corner(triangle, 0);
        return glm::normalize(glm::cross(corner(triangle, 1) - a, corner(triangle, 2) - a));
    }
    Vector3d toWorld(const Vector3d& p) const { return Vector3d(matrix_ * Vector4d(p, 1.0)); }
    const Mesh& mesh() const { return mesh_; }
    uint32_t index() const { return index_; }

private:
    Vector3d corner(uint32_t triangle, size_t i) const {
        return Vector3d(mesh_.positions[mesh_.indices[triangle * size_t{3} + i]]);
    }

    const Mesh& mesh_;
    ReferenceHierarchy reference_;
    Matrix4x4d matrix_, inverse_;
    double spread_ = 0.0;
    uint32_t index_;
};

struct Judgement {
    uint64_t hits = 0, wrong = 0, fronts = 0;
    double worst = 0.0;  ///< error of t over its bound
    std::string first;
};

/// As compareHits judges hits on one mesh.
Judgement judge(const std::vector<Placement>& places, const std::vector<Ray>& rays, const std::vector<RayHit>& hits) {
    Judgement result;
    for (size_t i = 0; i < rays.size(); i++) {
        const Ray& ray = rays[i];
        const RayHit& hit = hits[i];
        const auto complain = [&](const std::string& what) {
            if (result.wrong++ == 0) result.first = fmt::format("ray {}: {}", i, what);
        };
        double nearest = ray.t_max;
        if (hit.isHit()) {
            result.hits++;
            const auto place = std::find_if(places.begin(), places.end(),
                                            [&](const Placement& each) { return each.index() == hit.instance; });
            if (place == places.end() || hit.primitive >= place->mesh().triangleCount()) {
                complain(fmt::format("triangle {} of instance {}", hit.primitive, hit.instance));
                continue;
            }
            const double t = place->planeDistance(ray, hit.primitive);
            const HitBound bound = place->bound(ray, hit.primitive, t);
            const bool inside =
                intersectTriangle(place->mesh(), hit.primitive, place->origin(ray), place->direction(ray)).hit;
            if (!inside && place->border(ray, hit.primitive) > bound.edge)
                complain(fmt::format("it passes triangle {} of instance {}", hit.primitive, hit.instance));
            const double error = std::abs(hit.t - t) / bound.t;
            result.worst = std::max(result.worst, error);
            if (!(error <= 1.0))
                complain(fmt::format("t on instance {} is {}, not {}: {} of the bound", hit.instance, hit.t, t, error));
            // Which side, where the angle is clear.
            const double facing = glm::dot(place->normal(hit.primitive), glm::normalize(place->direction(ray)));
            if (std::abs(facing) > 0.01) {
                result.fronts += hit.front;
                if ((facing < 0.0) != (hit.front == 1)) complain(fmt::format("front of instance {}", hit.instance));
            }
            nearest = t - bound.t;
        }
        for (const Placement& place : places) {
            const ReferenceHit missed = place.closestHit(ray, nearest, [&](const ReferenceHit& candidate) {
                const HitBound bound = place.bound(ray, candidate.triangle, candidate.t);
                return candidate.t < nearest - bound.t && candidate.t > ray.t_min + bound.t &&
                       place.border(ray, candidate.triangle) > bound.edge;
            });
            if (missed.hit) {
                complain(fmt::format("it meets triangle {} of instance {} at {}, reported is {}", missed.triangle,
                                     place.index(), missed.t, hit.t));
                break;
            }
        }
    }
    return result;
}

class InstanceAccuracy : public DeviceTest {
protected:
    void SetUp() override {
        DeviceTest::SetUp();
        GLINT_NEED_FEATURE(FeatureComputeTracing);
    }

    const std::vector<Mesh> meshes = {createTorus(1.0f, 0.4f, 40, 20), createSphere(1.0f, 3)};
};

}  // namespace

TEST_F(InstanceAccuracy, TurnedScaledMirroredStretched) {
    Random random(5);
    std::vector<MeshInstance> instances;
    const auto add = [&](const Vector3f& factors, float distance) {
        const auto angle = [&] { return static_cast<float>(random.uniform(0.0, 360.0)); };
        const Vector3f place = Vector3f(random.direction() * static_cast<double>(distance));
        const Matrix4x4f turn = rotateX(angle()) * rotateY(angle()) * rotateZ(angle());
        const auto number = static_cast<uint32_t>(instances.size());
        instances.push_back({.mesh = number % 2,
                             .transform = Transform3x4(translate(place) * turn * scale(factors)),
                             .index = 1000 + 7 * number});
    };
    for (int i = 0; i < 8; i++) add(Vector3f(1.0f), 6.0f);
    for (const float size : {1e-3f, 1e-2f, 0.1f, 10.0f, 100.0f, 1e4f}) add(Vector3f(size), 20.0f * size);
    for (int i = 0; i < 3; i++) add({1, -1, 1}, 8.0f);
    add({-2, -2, -2}, 8.0f);
    add({1, 1000, 1}, 10.0f);
    add({0.01f, 10, 1}, 10.0f);
    add({-30, 0.03f, 1}, 10.0f);
    // Sheared: columns that are not at right angles.
    instances.push_back({.mesh = 0, .transform = {}, .index = 5});
    instances.back().transform.rows = {1, 0.9f, 0.3f, -5, 0.2f, 1, 0.8f, -6, -0.4f, 0.1f, 1, 7};

    std::vector<Placement> places;
    places.reserve(instances.size());
    for (const MeshInstance& instance : instances) places.emplace_back(meshes[instance.mesh], instance);

    // To a point of each instance in turn, from as far as it is large.
    std::vector<Ray> rays;
    for (size_t i = 0; i < 6000; i++) {
        const Placement& place = places[i % places.size()];
        const auto point = [&](double radius) { return place.toWorld(random.direction() * radius); };
        const Vector3d from = point(random.uniform(2.0, 5.0)), to = point(random.uniform(0.0, 1.3));
        Ray ray;
        ray.origin = Vector3f(from);
        ray.direction = Vector3f(to - Vector3d(ray.origin));
        rays.push_back(ray);
    }
    Expected<RayCaster> caster = RayCaster::create(device, meshes, instances);
    ASSERT_THAT(caster, IsOk());
    const Expected<std::vector<RayHit>> hits = caster->cast(rays);
    ASSERT_THAT(hits, IsOk());
    const Judgement result = judge(places, rays, *hits);
    RecordProperty("worst", fmt::format("{}", result.worst));
    EXPECT_EQ(result.wrong, 0u) << result.first;
    EXPECT_GT(result.hits, 3000u);
    // From outside of closed meshes nearly all are seen from in front, mirrored ones included: the mesh's own space
    // says what that is.
    EXPECT_GT(result.fronts, result.hits * 6 / 10);
    EXPECT_GT(result.worst, 0.0);
    // The judge notices: another instance, another triangle, another distance.
    std::vector<RayHit> changed = *hits;
    size_t spoiled = 0;
    for (RayHit& hit : changed) {
        if (!hit.isHit() || spoiled == 300) continue;
        if (spoiled % 3 == 0) hit.t *= 1.01f;
        if (spoiled % 3 == 1) hit.primitive = (hit.primitive + 777) % 1280;
        if (spoiled % 3 == 2) hit = RayHit();
        spoiled++;
    }
    EXPECT_GT(judge(places, rays, changed).wrong, 250u);

    const Expected<std::vector<uint8_t>> any = caster->castAny(rays);
    ASSERT_THAT(any, IsOk());
    for (size_t i = 0; i < rays.size(); i++) EXPECT_EQ((*any)[i], (*hits)[i].isHit()) << i;
}

TEST_F(InstanceAccuracy, MasksAndNumbers) {
    // Three floors above each other, seen from above by rays straight down.
    const std::vector<Mesh> planes = {createPlane(2.0f, 4), createPlane(2.0f)};
    std::vector<MeshInstance> instances(3);
    for (uint32_t i = 0; i < 3; i++) {
        instances[i].mesh = i % 2;
        instances[i].transform = Transform3x4(translate({0, 0, static_cast<float>(i)}));
        instances[i].mask = 1u << i;
    }
    instances[0].index = 42;
    Expected<RayCaster> caster = RayCaster::create(device, planes, instances);
    ASSERT_THAT(caster, IsOk());
    const std::vector<Ray> rays = {{{0.3f, 0.1f, 10}, 0, {0, 0, -1}, 100}, {{5, 0, 10}, 0, {0, 0, -1}, 100}};
    const auto seen = [&](uint8_t mask) {
        caster->setMask(mask);
        const Expected<std::vector<RayHit>> hits = caster->cast(rays);
        EXPECT_THAT(hits, IsOk());
        EXPECT_EQ((*hits)[1], RayHit());
        EXPECT_EQ(caster->castAny(rays)->at(0), (*hits)[0].isHit());
        return (*hits)[0];
    };
    EXPECT_EQ(seen(0xff).instance, 2u);
    EXPECT_EQ(seen(0xff).t, 8.0f);
    EXPECT_EQ(seen(0x02).instance, 1u);
    EXPECT_LT(seen(0x02).primitive, 2u);
    EXPECT_EQ(seen(0x03).instance, 1u);
    EXPECT_EQ(seen(0x01).instance, 42u);
    EXPECT_GE(seen(0x01).primitive, 2u);
    EXPECT_EQ(seen(0x08), RayHit());
    EXPECT_EQ(seen(0), RayHit());
}

TEST_F(InstanceAccuracy, Refuses) {
    const auto create = [&](const MeshInstance& instance) {
        return RayCaster::create(device, meshes, std::vector{MeshInstance(), instance});
    };
    EXPECT_THAT(RayCaster::create(device, meshes, {}), HasErrorId("caster.instances"));
    EXPECT_THAT(RayCaster::create(device, {}, std::vector{MeshInstance()}), HasErrorId("caster.mesh"));
    EXPECT_THAT(create({.mesh = 2}), HasErrorId("caster.mesh"));
    EXPECT_THAT(create({.mask = 256}), HasErrorId("caster.mask"));
    EXPECT_THAT(create({.transform = Transform3x4(scale({1, 0, 1}))}), HasErrorId("caster.transform"));
    EXPECT_THAT(create({.transform = Transform3x4(translate({NAN, 0, 0}))}), HasErrorId("caster.transform"));
    const std::vector<Mesh> empty = {meshes[0], Mesh()};
    const Expected<RayCaster> caster = RayCaster::create(device, empty, std::vector{MeshInstance()});
    EXPECT_THAT(caster, HasErrorId("mesh.no_faces"));
    EXPECT_EQ(caster.error().object(), "mesh 1");
}

}  // namespace glint::test
