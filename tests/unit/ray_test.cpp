// Normals, tangents, inverses and relative transforms of <glint/math/ray.h> against float64.

#include "support/reference.h"

#include <glint/math/ray.h>

#include <glm/geometric.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace glint::test {

namespace {

constexpr double u = 0x1p-24;

struct Exact {
    Vector3d columns[4];
    Vector3d cofactors[3];  ///< columns
    double determinant;

    explicit Exact(const Transform3x4& transform) {
        for (int column = 0; column < 4; column++)
            for (int row = 0; row < 3; row++) columns[column][row] = transform.rows[size_t(4 * row + column)];
        for (int i = 0; i < 3; i++) cofactors[i] = glm::cross(columns[(i + 1) % 3], columns[(i + 2) % 3]);
        determinant = glm::dot(columns[0], cofactors[0]);
    }
};

Transform3x4 randomTransform(Random& random, const Vector3f& size) {
    const auto angle = [&] { return static_cast<float>(random.uniform(0.0, 360.0)); };
    return Transform3x4(translate(Vector3f(random.direction() * 100.0)) * rotateX(angle()) * rotateY(angle()) *
                        scale(size) * rotateZ(angle()) * rotateX(angle()));
}

const Vector3f sizes[] = {{1, 1, 1},  {1e-4f, 1e-4f, 1e-4f}, {1e4f, 1e4f, 1e4f}, {1, 1, 1000},          {1, 1, 1e-3f},
                          {1, -1, 1}, {-3, -2, -1},          {1e-4f, 1, 1e4f},   {1e15f, 1e15f, 1e12f}, {1, 30, 1000}};

TEST(TransformNormal, IsThatOfFloat64) {
    Random random(1);
    for (const Vector3f& size : sizes) {
        for (int i = 0; i < 2000; i++) {
            const Transform3x4 transform = randomTransform(random, size);
            const Vector3f normal(random.direction() * std::exp2(random.uniform(-20.0, 20.0)));
            const Exact exact(transform);
            Vector3d expected(0.0);
            Vector3d weight(0.0);
            for (int column = 0; column < 3; column++) {
                expected += exact.cofactors[column] * double(normal[column]);
                weight += glm::abs(exact.cofactors[column] * double(normal[column]));
            }
            if (exact.determinant < 0.0) expected = -expected;
            // A cofactor is right to 2 u. The normal's length divides by a square root (3 u) and rounds its own square
            // (3 u), product and sum add 3 u; the same again for the result's length.
            const double bound = 16.0 * u * glm::length(weight) / glm::length(expected);
            const Vector3d result(transformNormal(transform, normal));
            ASSERT_LE(glm::length(result - glm::normalize(expected)), bound);
            // Stretched 1:1000, that is 1e-3 in the worst direction.
            if (std::abs(size.z) == 1000.0f && size.y == 1.0f) {
                ASSERT_LE(glm::length(result - glm::normalize(expected)), 1e-3);
            }
            ASSERT_NEAR(glm::length(result), 1.0, 8.0 * u);
        }
    }
}

TEST(TransformNormal, StaysOutsideUnderMirrors) {
    const Transform3x4 mirror(scale({1, 1, -2}));
    EXPECT_EQ(transformNormal(mirror, {0, 0, 1}), Vector3f(0, 0, -1));
    EXPECT_EQ(transformNormal(mirror, {1, 0, 0}), Vector3f(1, 0, 0));
    EXPECT_EQ(transformTangent(mirror, {0, 1, 0, 1}), Vector4f(0, 1, 0, -1));
    EXPECT_EQ(transformTangent(Transform3x4(scale({2, 3, 4})), {0, 1, 0, -1}), Vector4f(0, 1, 0, -1));
}

TEST(TransformNormal, TakesSingularTransforms) {
    // All goes to the plane z = 0: that is what is left of any surface.
    const Transform3x4 flat(scale({1, 1, 0}));
    EXPECT_EQ(transformNormal(flat, {0.6f, 0, 0.8f}), Vector3f(0, 0, 1));
    EXPECT_EQ(transformNormal(flat, {1, 0, 0}), Vector3f(0, 0, 0));
    EXPECT_EQ(transformTangent(flat, {0.6f, 0, 0.8f, 1}), Vector4f(1, 0, 0, 1));
    EXPECT_EQ(transformTangent(flat, {0, 0, 1, 1}), Vector4f(0, 0, 0, 1));
    // To a line, to a point, and what means nothing.
    EXPECT_EQ(transformNormal(Transform3x4(scale({1, 0, 0})), {0, 0, 1}), Vector3f(0, 0, 0));
    EXPECT_EQ(transformNormal(Transform3x4(scale({0, 0, 0})), {0, 0, 1}), Vector3f(0, 0, 0));
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float infinity = std::numeric_limits<float>::infinity();
    EXPECT_EQ(transformNormal(Transform3x4(), {nan, 0, 1}), Vector3f(0, 0, 0));
    EXPECT_EQ(transformNormal(Transform3x4(), {infinity, 0, 1}), Vector3f(0, 0, 0));
    EXPECT_EQ(transformNormal(Transform3x4(), {0, 0, 0}), Vector3f(0, 0, 0));
    EXPECT_EQ(transformNormal(Transform3x4(scale({infinity, 1, 1})), {0, 0, 1}), Vector3f(0, 0, 0));
    EXPECT_EQ(transformNormal(Transform3x4(scale({1, nan, 1})), {0, 0, 1}), Vector3f(0, 0, 0));
}

TEST(SurfacePoint, HasTheNormalOfTheTriangle) {
    Random random(2);
    for (const Vector3f& size : sizes) {
        for (int i = 0; i < 1000; i++) {
            const Transform3x4 transform = randomTransform(random, size);
            const Transform3x4 inverted = inverse(transform);
            Vector3f corners[3];
            for (Vector3f& corner : corners) corner = Vector3f(random.direction());
            const SurfacePoint point =
                surfacePoint(corners[0], corners[1], corners[2], {0.3f, 0.3f}, transform, inverted);
            const Vector3d object =
                glm::cross(Vector3d(corners[1]) - Vector3d(corners[0]), Vector3d(corners[2]) - Vector3d(corners[0]));
            const Exact inverse_exact(inverted);
            Vector3d expected;
            Vector3d weight;
            for (int column = 0; column < 3; column++) {
                expected[column] = glm::dot(object, inverse_exact.columns[column]);
                // Edges 2 u, the cross product 2 u of products that are 4 at most, the row 3 u.
                weight[column] = glm::dot(glm::abs(object) * 3.0 + 4.0 * 8.0, glm::abs(inverse_exact.columns[column]));
            }
            const double bound = u * (glm::length(weight) / glm::length(expected) + 8.0);
            ASSERT_LE(glm::length(Vector3d(point.normal) - glm::normalize(expected)), bound);
            ASSERT_GT(point.offset, 0.0f);
        }
    }
}

// The height of a spawn point over the exact triangle, in float64: never on the wrong side, also before an engine adds
// its rounding.
TEST(SurfacePoint, StartsRaysAboveTheTriangle) {
    Random random(3);
    for (const Vector3f& size : sizes) {
        if (size.x > 1e10f) continue;
        for (int i = 0; i < 2000; i++) {
            const Transform3x4 transform = randomTransform(random, size);
            const Exact exact(transform);
            const Vector3d place = random.direction() * std::exp2(random.uniform(-5.0, 10.0));
            Vector3f corners[3];
            for (Vector3f& corner : corners) corner = Vector3f(place + random.direction());
            const double share = random.uniform();
            const Vector2f barycentrics(static_cast<float>(share * random.uniform()), static_cast<float>(1.0 - share));
            const SurfacePoint point =
                surfacePoint(corners[0], corners[1], corners[2], barycentrics, transform, inverse(transform));
            Vector3d world[3];
            for (int c = 0; c < 3; c++)
                world[c] = exact.columns[0] * double(corners[c].x) + exact.columns[1] * double(corners[c].y) +
                           exact.columns[2] * double(corners[c].z) + exact.columns[3];
            Vector3d normal = glm::cross(world[1] - world[0], world[2] - world[0]);
            if (exact.determinant < 0.0) normal = -normal;
            for (const float side : {-1.0f, 1.0f}) {
                const Vector3f origin = spawnPoint(point, point.normal * side);
                const double height = glm::dot(Vector3d(origin) - world[0], glm::normalize(normal)) * double(side);
                ASSERT_GT(height, 0.0);
                ASSERT_LT(height, 2.5 * double(point.offset));
            }
        }
    }
}

TEST(SurfacePoint, TakesTrianglesWithoutArea) {
    const Vector3f a(1, 2, 3);
    const Vector3f b(4, 5, 6);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float infinity = std::numeric_limits<float>::infinity();
    for (const Vector3f& c : {a, b, Vector3f(7, 8, 9), Vector3f(nan, 1, 1), Vector3f(infinity, 0, 0)}) {
        const SurfacePoint point = surfacePoint(a, b, c, {0.25f, 0.0f}, {}, {});
        EXPECT_EQ(point.normal, Vector3f(0.0f));
        EXPECT_EQ(point.offset, 0.0f);
        EXPECT_EQ(point.slope, 0.0f);
        if (std::isfinite(c.x)) { EXPECT_EQ(spawnPoint(point, {1, 0, 0}), Vector3f(1.75f, 2.75f, 3.75f)); }
    }
    // Singular transforms have no inverse.
    const Transform3x4 flat(scale({1, 1, 0}));
    EXPECT_EQ(surfacePoint(a, b, {0, 1, 0}, {0.25f, 0.0f}, flat, inverse(flat)).normal, Vector3f(0.0f));
}

// Powers of two do not change roundings, so everything scales.
TEST(SurfacePoint, ScalesWithPowersOfTwo) {
    Random random(4);
    for (int i = 0; i < 100; i++) {
        Vector3f corners[3];
        for (Vector3f& corner : corners) corner = Vector3f(random.direction() * 3.0);
        const SurfacePoint one = surfacePoint(corners[0], corners[1], corners[2], {0.3f, 0.4f}, {}, {});
        for (const float size : {0x1p-30f, 0x1p30f}) {
            const SurfacePoint other =
                surfacePoint(corners[0] * size, corners[1] * size, corners[2] * size, {0.3f, 0.4f}, {}, {});
            EXPECT_EQ(other.position, one.position * size);
            EXPECT_EQ(other.normal, one.normal);
            EXPECT_EQ(other.offset, one.offset * size);
            EXPECT_EQ(other.slope, one.slope);
        }
    }
}

TEST(Inverse, IsRoundedOnce) {
    Random random(5);
    for (const Vector3f& size : sizes) {
        for (int i = 0; i < 500; i++) {
            const Transform3x4 transform = randomTransform(random, size);
            const Exact exact(transform);
            const Transform3x4 result = inverse(transform);
            // float64's own errors grow with the ratio of the sizes, here up to 1e8, and stay below a rounding.
            for (int row = 0; row < 3; row++) {
                const Vector3d expected = exact.cofactors[row] / exact.determinant;
                double largest = std::max({std::abs(expected.x), std::abs(expected.y), std::abs(expected.z)});
                for (int column = 0; column < 3; column++)
                    ASSERT_NEAR(result.rows[size_t(4 * row + column)], expected[column], 2.0 * u * largest);
            }
        }
    }
    EXPECT_TRUE(std::isnan(inverse(Transform3x4(scale({1, 1, 0}))).rows[0]));
    EXPECT_TRUE(std::isnan(inverse(Transform3x4(scale({1, 1, std::numeric_limits<float>::infinity()}))).rows[0]));
    EXPECT_EQ(inverse(Transform3x4()), Transform3x4());
}

TEST(RelativeTransform, RoundsOnce) {
    Random random(6);
    for (int i = 0; i < 1000; i++) {
        const Vector3d eye = random.direction() * std::pow(10.0, random.uniform(7.0, 9.0));
        Matrix4x4d model(Matrix4x4f(rotateX(33.0f) * scale({1, 1000, 1e-3f})));
        const Vector3d place = eye + random.direction() * std::pow(10.0, random.uniform(-3.0, 5.0));
        model[3] = Vector4d(place, 1.0);
        const Transform3x4 result = relativeTransform(model, eye);
        for (int row = 0; row < 3; row++) {
            for (int column = 0; column < 3; column++)
                EXPECT_EQ(double(result.rows[size_t(4 * row + column)]), model[column][row]);
            // The difference of float64 numbers as near as these to one another is exact up to a rounding of theirs.
            const long double exact = (long double)place[row] - (long double)eye[row];
            EXPECT_LE(std::abs(double((long double)result.rows[size_t(4 * row + 3)] - exact)),
                      (u + 0x1p-53) * std::abs(double(exact)));
        }
        EXPECT_EQ(relativePosition(place, eye), Vector3f(result.rows[3], result.rows[7], result.rows[11]));
    }
}

}  // namespace

}  // namespace glint::test
