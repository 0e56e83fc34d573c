#pragma once

// Rays from the spawn points of <glint/ray.h>, through the driver's ray queries and through Glint's own: does a ray
// meet the triangle that it starts from?

#include <glint/device/device.h>
#include <glint/format/mesh.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace glint::test {

/// A mesh and the transforms of its instances, mostly one.
struct SpawnCase {
    std::string name;
    Mesh mesh;
    std::vector<Transform3x4> transforms;
};

/// Triangles of all shapes, each in a cell of its own, under hard transforms: scaled 1e-4 and 1e4, stretched and
/// squashed 1:1000, mirrored, moved to 1e7, with object coordinates far from the origin.
std::vector<SpawnCase> spawnCases();
/// Number of the soup's triangles that are no needles and not flat: those whose number is divisible by three. Their
/// sides are at most this long, and none is narrower than an eighth of it.
constexpr float fat_triangle_side = 0.125f;

/// A primary ray, and where to go from its hit: an angle around the normal, and the sine of the elevation over the
/// plane, negative to go through it.
struct SpawnSample {
    Vector3f origin;
    float azimuth = 0.0f;
    Vector3f direction;
    float elevation = 0.0f;
};

/// At random points of random triangles of the first instance from random sides; elevations from 2^-30 to 1, their
/// logarithms evenly distributed, one of eight negative.
std::vector<SpawnSample> spawnSamples(const SpawnCase& scene, uint32_t count, uint64_t seed);

struct SpawnResult {
    static constexpr uint32_t none = 0xffffffff;

    uint32_t first = none;   ///< triangle that the primary ray meets
    uint32_t second = none;  ///< triangle that the ray from there meets
    float t = 0.0f;          ///< of that one
    float elevation = 0.0f;  ///< dot(normal, direction)
    Vector3f position;
    float offset = 0.0f;
    Vector3f origin;
    float slope = 0.0f;
    Vector3f direction;
    uint32_t target = none;  ///< of segments: the triangle of their other end
    Vector3f normal;
    float distance = 0.0f;  ///< of segments: the largest component of what is between the two points
    Vector3f target_normal;
    float target_offset = 0.0f;

    /// The ray has come back to what it left, or to what it was to end before.
    bool meetsItsOwn() const { return second != none && (second == first || second == target); }
};

enum class SpawnMode : uint32_t {
    Corners,  ///< surfacePoint by corners and barycentrics
    Ray,      ///< surfacePoint by origin + t * direction
    Segment,  ///< from the hit of each sample to the hit of the next one
    Primary,  ///< nothing but the primary ray: first is the triangle, second the instance, t the distance
};

class SpawnTracer {
public:
    /// `driver`: by the driver's ray queries, else by Glint's own. Throws std::runtime_error with the device's errors.
    SpawnTracer(const Device& device, bool driver);

    /// One result for each sample. `multiple`: of the offset; `longest`: for SpawnMode::Ray.
    std::vector<SpawnResult> trace(const SpawnCase& scene, std::span<const SpawnSample> samples, SpawnMode mode,
                                   float multiple = 1.0f, float longest = 0.0f);

private:
    Device device_;
    bool driver_;
    Kernel kernel_;
};

}  // namespace glint::test
