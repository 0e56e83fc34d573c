#pragma once

#include <glint/device/device.h>
#include <glint/format/mesh.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace glint {

/// A ray: the points origin + t * direction with t_min <= t <= t_max. The direction may have any length; t counts in
/// that length. A negative t_min counts as 0.
///
/// Rays that mean nothing miss: a NaN anywhere, an infinite origin or direction, a direction of length zero (or whose
/// components are all smaller than 2^-126), t_min > t_max. An infinite t_max is no limit.
struct Ray {
    Vector3f origin = Vector3f(0.0f);
    float t_min = 0.0f;
    Vector3f direction = Vector3f(0.0f);
    float t_max = std::numeric_limits<float>::infinity();
};

/// Where a ray meets a mesh first.
struct RayHit {
    static constexpr uint32_t none = 0xffffffff;

    float t = std::numeric_limits<float>::infinity();  ///< infinity if there is no hit
    uint32_t primitive = none;                         ///< triangle, counted over the whole mesh in its own order
    uint32_t geometry = none;  ///< the part that it belongs to: 0 in a mesh without parts, parts.size() if to none
    float u = 0.0f;            ///< barycentric coordinate of the second corner
    float v = 0.0f;            ///< and of the third
    uint32_t front = 0;        ///< 1 if the corners are counter-clockwise seen from the origin

    bool isHit() const { return primitive != none; }
    bool operator==(const RayHit&) const = default;
};

/// Casts rays at a mesh, any number of them, a chunk at a time: while the device traces one, the next is fetched and
/// the one before handed out. Takes 112 bytes of memory for each ray of a chunk, beside the mesh.
///
/// Triangles with a corner that is NaN or infinite are left out, so nothing hits them. Triangles of zero area are never
/// hit. Of triangles at the same distance any one may be reported. How exact hits are: docs/accuracy.md.
///
/// One thread at a time.
class RayCaster {
public:
    /// Rays of a chunk.
    static constexpr uint32_t chunk = 1u << 18;

    /// Builds the acceleration structure. Errors: those of Mesh::validate but "mesh.not_finite"; "mesh.no_faces" too if
    /// no triangle has finite corners; "device.unsupported" without FeatureComputeTracing; those of Tracing::create.
    static Expected<RayCaster> create(const Device& device, const Mesh& mesh);

    RayCaster(RayCaster&&) noexcept;
    RayCaster& operator=(RayCaster&&) noexcept;
    ~RayCaster();

    /// Fills the rays from the first on, and says how many; 0 ends the cast, an error ends it with that error.
    using Source = std::function<Expected<uint64_t>(std::span<Ray> rays)>;
    /// Takes the hits of the next rays, in their order. An error ends the cast with that error.
    using HitSink = std::function<Status(std::span<const RayHit> hits)>;
    /// The same for castAny: 1 if anything lies between t_min and t_max, else 0.
    using AnySink = std::function<Status(std::span<const uint8_t> hits)>;

    /// The closest hit of each ray.
    Status cast(const Source& source, const HitSink& sink);
    /// Whether each ray hits anything at all: cheaper than the closest hit.
    Status castAny(const Source& source, const AnySink& sink);

    /// The same for rays in memory.
    Expected<std::vector<RayHit>> cast(std::span<const Ray> rays);
    Expected<std::vector<uint8_t>> castAny(std::span<const Ray> rays);

    /// Bytes of the acceleration structure.
    uint64_t getMemory() const;

private:
    struct State;
    explicit RayCaster(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace glint
