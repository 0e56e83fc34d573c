#pragma once

#include <glint/device/device.h>
#include <glint/format/mesh.h>
#include <glint/format/mesh_scene.h>
#include <glint/math/ray.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace glint {

/// Where a ray meets a mesh, or instances of meshes, first.
struct RayHit {
    static constexpr uint32_t none = 0xffffffff;

    float t = std::numeric_limits<float>::infinity();  ///< infinity if there is no hit
    uint32_t primitive = none;                         ///< triangle, counted over the whole mesh in its own order
    uint32_t geometry = none;  ///< the part that it belongs to: 0 in a mesh without parts, parts.size() if to none
    float u = 0.0f;            ///< barycentric coordinate of the second corner
    float v = 0.0f;            ///< and of the third
    uint32_t front = 0;        ///< 1 if the corners are counter-clockwise seen from the origin, in the mesh's own space
    uint32_t instance = none;  ///< MeshInstance::index, or the instance's number; 0 where there is a mesh alone

    bool isHit() const { return primitive != none; }
    bool operator==(const RayHit&) const = default;
};

/// Casts rays at a mesh, or at instances of several, any number of rays, a piece at a time: while the device traces
/// one, the next is fetched and the one before handed out. Takes 120 bytes of memory for each ray of the largest piece,
/// beside the meshes.
///
/// Pieces are small at first; from the time that they take the next are made as large as the device traces in about 25
/// ms, so that no dispatch gets long enough for a watchdog, and a source that ends the cast is asked soon. Times are
/// those of the device where it was made with FeatureTimestamps; else those until the host has seen the end, which is
/// later, so that pieces may be smaller than they need to be.
///
/// Triangles with a corner that is NaN or infinite are left out, so nothing hits them. Triangles of zero area are never
/// hit. Of triangles at the same distance any one may be reported. How exact hits are: docs/accuracy.md.
///
/// One thread at a time.
class RayCaster {
public:
    /// Rays of the largest piece.
    static constexpr uint32_t chunk = 1u << 18;

    /// Builds the acceleration structure. Errors: those of Mesh::validate but "mesh.not_finite"; "mesh.no_faces" too if
    /// no triangle has finite corners; "device.unsupported" without FeatureComputeTracing; those of Tracing::create.
    static Expected<RayCaster> create(const Device& device, const Mesh& mesh);
    /// The same for instances of meshes. Ties between instances are settled as those between triangles. Further errors:
    /// "caster.instances" (there are none), "caster.mesh" (an instance of a mesh that is not among them),
    /// "caster.transform" (see isInvertible), "caster.mask" (more than 8 bits).
    static Expected<RayCaster> create(const Device& device, std::span<const Mesh> meshes,
                                      std::span<const MeshInstance> instances);

    RayCaster(RayCaster&&) noexcept;
    RayCaster& operator=(RayCaster&&) noexcept;
    ~RayCaster();

    /// Fills the rays from the first on, and says how many; 0 ends the cast, an error ends it with that error.
    using Source = std::function<Expected<uint64_t>(std::span<Ray> rays)>;
    /// Takes the hits of the next rays, in their order. An error ends the cast with that error.
    using HitSink = std::function<Status(std::span<const RayHit> hits)>;
    /// The same for castAny: 1 if anything lies between t_min and t_max, else 0.
    using AnySink = std::function<Status(std::span<const uint8_t> hits)>;

    /// Rays from now on see instances whose mask shares a bit with this one; all 8 bits are set at first.
    void setMask(uint8_t mask);

    /// The closest hit of each ray.
    Status cast(const Source& source, const HitSink& sink);
    /// Whether each ray hits anything at all: cheaper than the closest hit.
    Status castAny(const Source& source, const AnySink& sink);

    /// The same for rays in memory.
    Expected<std::vector<RayHit>> cast(std::span<const Ray> rays);
    Expected<std::vector<uint8_t>> castAny(std::span<const Ray> rays);

    /// Bytes of the acceleration structures.
    uint64_t getMemory() const;

private:
    struct State;
    explicit RayCaster(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace glint
