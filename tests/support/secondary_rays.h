#pragma once

// Shadow rays and mirrored rays from what primary rays meet, on cases that are hard for the start of a ray, through
// ray-tracing pipelines and through ray queries. secondary_judge.h counts what went wrong.

#include <glint/device/device.h>
#include <glint/format/mesh.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace glint::test {

/// A floor with pillars and a sphere standing in it, once upright and once as the ceiling over itself: two instances of
/// one mesh, which is about 2 wide in its own space.
struct SecondaryCase {
    std::string name;
    Mesh mesh;
    std::vector<Transform3x4> transforms;
    float reach = 0.0f;  ///< length of mirrored rays, in the world: beyond the whole scene
    double lowest = 0.0,
           highest = 0.0;  ///< sines of the lamps' and the eyes' elevations over surfaces, in object space
};

/// Tens of units large, the same in grazing light, 1e-3 of it, stretched and squashed 1:1000, moved to 1e7, and that
/// relative to the eye.
std::vector<SecondaryCase> secondaryCases();

/// A primary ray, and the lamp that its hit looks for.
struct SecondarySample {
    Vector3f origin;
    float unused = 0.0f;
    Vector3f direction;  ///< of length 1, but for rounding
    float unused1 = 0.0f;
    Vector3f lamp;
    float unused2 = 0.0f;
};

/// One half to random triangles; the other to the floor near a pillar, 1e-6 to 0.1 away from it in object space (the
/// logarithms evenly distributed), with a lamp behind the pillar and the eye opposite.
std::vector<SecondarySample> secondarySamples(const SecondaryCase& scene, uint32_t count, uint64_t seed);

/// How rays start: at glintSpawnPoint with `multiple` of the derived offset, or, if `is_fixed`, at the same point of
/// the surface with t_min = `nearest`, in the world's units.
struct SecondaryStart {
    float multiple = 1.0f;
    float nearest = 0.0f;
    bool is_fixed = false;

    static SecondaryStart derived(float multiple = 1.0f) { return {.multiple = multiple}; }
    static SecondaryStart fixed(float nearest) { return {.nearest = nearest, .is_fixed = true}; }
};

struct SecondaryResult {
    static constexpr uint32_t none = 0xffffffff;
    static constexpr uint32_t not_traced = 0xfffffffe;  ///< the surface faces away from the lamp

    uint32_t first = none;  ///< triangle that the primary ray meets
    uint32_t instance = 0;
    Vector2f barycentrics;
    Vector3f position;  ///< of glintSurfacePoint, as the next ones
    float offset = 0.0f;
    Vector3f normal;
    float slope = 0.0f;
    Vector3f mirrored;       ///< direction of the mirrored ray
    uint32_t shadow = none;  ///< triangle that the shadow ray meets: any in its way
    uint32_t shadow_instance = 0;
    uint32_t mirror = none;  ///< triangle that the mirrored ray meets first
    uint32_t mirror_instance = 0;
    float mirror_t = 0.0f;
    Transform3x4 to_object;  ///< of the instance, as the engine has it

    bool operator==(const SecondaryResult&) const = default;
};

/// Whether rays are traced by a ray-tracing pipeline, whose closest-hit shader traces the secondary rays, or by ray
/// queries in a compute shader.
enum class SecondaryForm { Pipeline, Query };

class SecondaryTracer {
public:
    /// Throws std::runtime_error with the device's errors, as trace() does.
    SecondaryTracer(const Device& device, SecondaryForm form);

    /// Puts a case on the device, with its samples.
    void load(const SecondaryCase& scene, std::span<const SecondarySample> samples);
    /// One result for each sample.
    std::vector<SecondaryResult> trace(const SecondaryStart& start);

private:
    Device device_;
    Traversal traversal_;
    Kernel kernel_;
    Tracing bottom_, top_;
    Buffer positions_, indices_, samples_, results_;
    uint32_t count_ = 0;
    float reach_ = 0.0f;
};

}  // namespace glint::test
