#pragma once

// Answers in float64, to test float32 code against.

#include <glint/format/mesh.h>
#include <glint/math/math.h>

#include <cstdint>
#include <random>

namespace glint::test {

/// Number of float32 values from `a` to `b`: 0 if equal (also 0 and -0), 2^32 - 1 if one of them is NaN.
uint32_t ulpDistance(float a, float b);

/// Where a ray meets a mesh first.
struct ReferenceHit {
    bool hit = false;
    double t = 0.0;                         ///< in units of the direction's length
    uint32_t triangle = 0;                  ///< the lowest of those with the same t
    Vector2d barycentrics = Vector2d(0.0);  ///< of the second and the third corner
};

/// Where the line of a ray meets a triangle, whatever t. From both sides. Signs are those of exact arithmetic (products
/// near 0 are taken again with 113 bits), so that edges and corners belong to all their triangles and nothing leaks;
/// t and the barycentrics are rounded as float64 is. Triangles of zero area, those with a corner that is not finite,
/// and rays in a triangle's plane do not meet.
ReferenceHit intersectTriangle(const Mesh& mesh, uint32_t triangle, const Vector3d& origin, const Vector3d& direction);

/// Closest hit with t_min <= t <= t_max by trying every triangle; of equally close ones that with the lowest number.
ReferenceHit closestHit(const Mesh& mesh, const Vector3d& origin, const Vector3d& direction, double t_min = 0.0,
                        double t_max = 1e300);

/// True if every directed edge has its opposite exactly once: by position, so that split vertices count as one.
bool isClosed(const Mesh& mesh);
/// Volume within a closed mesh; negative if front faces are clockwise seen from outside.
double volumeOf(const Mesh& mesh);
double areaOf(const Mesh& mesh);

/// A generator of random numbers whose values are the same with every standard library.
class Random {
public:
    explicit Random(uint64_t seed) : engine_(seed) {}

    /// In [0, 2^64).
    uint64_t bits() { return engine_(); }
    /// In [0, count); count is positive.
    uint64_t below(uint64_t count) { return engine_() % count; }
    /// In [low, high).
    double uniform(double low = 0.0, double high = 1.0) {
        return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
    }
    /// Uniform on the unit sphere.
    Vector3d direction();

private:
    std::mt19937_64 engine_;
};

}  // namespace glint::test
