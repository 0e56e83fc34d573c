#include "support/reference.h"

#include <glint/math/bounds.h>
#include <glint/math/camera.h>
#include <glint/math/math.h>

#include <glm/geometric.hpp>

#include <gtest/gtest.h>

using namespace glint;
using namespace glint::test;

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float quiet_nan = std::numeric_limits<float>::quiet_NaN();

void expectNear(const Vector3f& a, const Vector3f& b, float tolerance = 1e-6f) {
    for (int i = 0; i < 3; i++) EXPECT_NEAR(a[i], b[i], tolerance) << "component " << i;
}

}  // namespace

TEST(Matrix, RotationsTurnCounterClockwise) {
    expectNear(transformPoint(rotateX(90), {0, 1, 0}), {0, 0, 1});
    expectNear(transformPoint(rotateY(90), {0, 0, 1}), {1, 0, 0});
    expectNear(transformPoint(rotateZ(90), {1, 0, 0}), {0, 1, 0});
    expectNear(transformPoint(translate({1, 2, 3}) * scale({2, 2, 2}), {1, 1, 1}), {3, 4, 5});
}

TEST(Transform, IsRowMajor) {
    EXPECT_EQ(Transform3x4().matrix(), Matrix4x4f(1.0f));
    const Transform3x4 transform(translate({1, 2, 3}) * scale({4, 5, 6}));
    const std::array<float, 12> expected = {4, 0, 0, 1, 0, 5, 0, 2, 0, 0, 6, 3};
    EXPECT_EQ(transform.rows, expected);
    EXPECT_EQ(Transform3x4(transform.matrix()), transform);
}

TEST(Bounds, EmptyBox) {
    BoundBox box;
    EXPECT_TRUE(box.isEmpty());
    EXPECT_EQ(box.size(), Vector3f(0.0f));
    EXPECT_EQ(box.center(), Vector3f(0.0f));
    EXPECT_FALSE(box.contains({0, 0, 0}));
    BoundBox other({1, 1, 1}, {2, 2, 2});
    other.add(box);
    EXPECT_EQ(other, BoundBox({1, 1, 1}, {2, 2, 2}));
    EXPECT_TRUE(BoundBox({quiet_nan, 0, 0}, {1, 1, 1}).isEmpty());
}

TEST(Bounds, OnePointIsNotEmpty) {
    BoundBox box;
    EXPECT_TRUE(box.add(Vector3f(1, 2, 3)));
    EXPECT_FALSE(box.isEmpty());
    EXPECT_TRUE(box.contains({1, 2, 3}));
    EXPECT_EQ(box.center(), Vector3f(1, 2, 3));
}

TEST(Bounds, LeavesOutWhatIsNotFinite) {
    const std::vector<Vector3f> points = {{0, 0, 0}, {quiet_nan, 5, 5}, {5, infinity, 5}, {5, 5, -infinity}, {1, 2, 3}};
    EXPECT_EQ(BoundBox(points), BoundBox({0, 0, 0}, {1, 2, 3}));
    const BoundSphere sphere(points);
    EXPECT_NEAR(sphere.radius, std::sqrt(14.0f) / 2, 1e-5f);
    EXPECT_TRUE(BoundSphere(std::span(points).subspan(1, 3)).isEmpty());
}

TEST(Bounds, CenterOfLargestBoxIsFinite) {
    const float largest = std::numeric_limits<float>::max();
    EXPECT_EQ(BoundBox(Vector3f(-largest), Vector3f(largest)).center(), Vector3f(0.0f));
    EXPECT_EQ(BoundBox(Vector3f(largest), Vector3f(largest)).center(), Vector3f(largest));
}

TEST(Bounds, SphereHoldsEveryPoint) {
    Random random(1);
    for (int run = 0; run < 100; run++) {
        const double size = std::pow(10.0, random.uniform(-10, 10));
        std::vector<Vector3f> points;
        for (int i = 0; i < 50; i++) points.emplace_back(random.direction() * size * random.uniform());
        const BoundSphere sphere(points);
        for (const Vector3f& point : points)
            EXPECT_LE(glm::length(Vector3d(point) - Vector3d(sphere.center)), static_cast<double>(sphere.radius));
        EXPECT_LE(static_cast<double>(sphere.radius),
                  glm::length(Vector3d(BoundBox(points).size())) * 0.5 * (1 + 1e-6));
    }
}

TEST(Camera, LooksAlongMinusZWithUpY) {
    const Camera camera = Camera().lookAt({10, 0, 0}, {0, 0, 0});
    expectNear(camera.forward(), {-1, 0, 0});
    expectNear(camera.right(), {0, 1, 0});
    expectNear(camera.up(), {0, 0, 1});
    expectNear(transformPoint(camera.view(), {0, 0, 0}), {0, 0, -10});
    expectNear(transformPoint(camera.view(), {10, 2, 3}), {2, 3, 0});
}

TEST(Camera, DefaultLooksAlongY) {
    expectNear(Camera().forward(), {0, 1, 0});
    expectNear(Camera().right(), {1, 0, 0});
    expectNear(Camera().up(), {0, 0, 1});
}

TEST(Camera, DegenerateDirectionsGiveSomeFrame) {
    for (const Vector3f& to : {Vector3f(0, 0, 5), Vector3f(0, 0, -5), Vector3f(0, 0, 0), Vector3f(0, 5, 0)}) {
        for (const Vector3f& up :
             {Vector3f(0, 0, 1), Vector3f(0, 0, 0), Vector3f(quiet_nan, 0, 0), Vector3f(0, 1, 0)}) {
            const Camera camera = Camera().lookAt({0, 0, 0}, to, up);
            EXPECT_NEAR(glm::length(camera.right()), 1.0f, 1e-6f);
            EXPECT_NEAR(glm::dot(camera.right(), camera.forward()), 0.0f, 1e-6f);
            EXPECT_NEAR(glm::dot(glm::cross(camera.right(), camera.up()), camera.forward()), -1.0f, 1e-6f);
        }
    }
}

TEST(Camera, DepthIsReversedAndInfinite) {
    const Camera camera = Camera().perspective(60.0f, 2.0f, 0.1f);
    const auto depth = [&](float distance) {
        const Vector4f clip = camera.projection() * Vector4f(0, 0, -distance, 1);
        return clip.z / clip.w;
    };
    EXPECT_FLOAT_EQ(depth(0.1f), 1.0f);
    EXPECT_FLOAT_EQ(depth(1.0f), 0.1f);
    EXPECT_GT(depth(1e30f), 0.0f);
    EXPECT_LT(depth(1e30f), 1e-30f);
}

TEST(Camera, FieldOfViewIsVertical) {
    const Camera camera = Camera().perspective(60.0f, 2.0f);
    const float y = std::tan(radians(30.0f));
    const Vector4f corner = camera.projection() * Vector4f(2 * y, y, -1, 1);
    EXPECT_NEAR(corner.x / corner.w, 1.0f, 1e-6f);
    EXPECT_NEAR(corner.y / corner.w, 1.0f, 1e-6f);
}

TEST(Camera, WrongNumbersAreClamped) {
    for (const float value : {quiet_nan, -1.0f, 0.0f, infinity, -infinity}) {
        const Matrix4x4f projection = Camera().perspective(value, value, value).projection();
        EXPECT_TRUE(std::isfinite(projection[0][0]) && projection[0][0] > 0.0f);
        EXPECT_TRUE(std::isfinite(projection[1][1]) && projection[1][1] > 0.0f);
        EXPECT_TRUE(std::isfinite(projection[3][2]) && projection[3][2] > 0.0f);
    }
}

// The rays of the parameters and the matrices describe one camera: what a ray meets is projected to its pixel.
TEST(Camera, RaysAgreeWithTheProjection) {
    const Camera camera = Camera().lookAt({3, -7, 5}, {1, 2, 0.5f}).perspective(50.0f, 1.6f, 0.2f);
    const CameraParameters p = camera.parameters();
    Random random(2);
    for (int i = 0; i < 1000; i++) {
        const auto u = static_cast<float>(random.uniform());
        const auto v = static_cast<float>(random.uniform());
        const auto t = static_cast<float>(random.uniform(0.5, 50.0));
        const Vector3f direction(p.ray_corner + p.ray_x * u + p.ray_y * v);
        const Vector3f point = Vector3f(p.position) + direction * t;
        const Vector4f clip = p.projection * (p.view * Vector4f(point, 1.0f));
        EXPECT_NEAR(clip.x / clip.w, u * 2 - 1, 1e-5f);
        EXPECT_NEAR(clip.y / clip.w, 1 - v * 2, 1e-5f);
        EXPECT_NEAR(clip.w, t, 1e-5f * t + 1e-5f);
    }
}

TEST(Camera, InverseViewInvertsFarFromTheOrigin) {
    const Camera camera = Camera().lookAt({1e6f, -2e6f, 3e6f}, {1e6f + 10, -2e6f, 3e6f + 1});
    EXPECT_NEAR(glm::length(Vector3d(camera.forward()) - glm::normalize(Vector3d(10, 0, 1))), 0.0, 1e-7);
    const CameraParameters p = camera.parameters();
    const Matrix4x4f product = p.view * p.inverse_view;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) EXPECT_NEAR(product[i][k], i == k ? 1.0f : 0.0f, 1e-6f);
}

TEST(Camera, RowMajorTransposesTheMatricesOnly) {
    const CameraParameters p = Camera().lookAt({3, -7, 5}, {1, 2, 0.5f}).parameters();
    const CameraParameters r = p.rowMajor();
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 4; k++) EXPECT_EQ(r.view[i][k], p.view[k][i]);
    EXPECT_EQ(r.position, p.position);
    EXPECT_EQ(r.ray_x, p.ray_x);
}

TEST(Reference, UlpDistance) {
    EXPECT_EQ(ulpDistance(1.0f, 1.0f), 0u);
    EXPECT_EQ(ulpDistance(0.0f, -0.0f), 0u);
    EXPECT_EQ(ulpDistance(1.0f, std::nextafter(1.0f, 2.0f)), 1u);
    EXPECT_EQ(ulpDistance(std::numeric_limits<float>::denorm_min(), -std::numeric_limits<float>::denorm_min()), 2u);
    EXPECT_EQ(ulpDistance(quiet_nan, 1.0f), UINT32_MAX);
    EXPECT_GT(ulpDistance(-infinity, infinity), 0xff000000u - 2);
}
