#pragma once

// Embree, a second opinion: another library's tracing of the same rays in float32, on the CPU.

#include <glint/graphics/ray_caster.h>
#include <glint/math/math.h>

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace glint::test {

/// Whether Embree's watertight triangle test (RTC_SCENE_FLAG_ROBUST) or its faster default is used.
enum class EmbreeMode : bool { Fast, Robust };

/// Where one of several meshes is.
struct EmbreeInstance {
    uint32_t mesh = 0;
    Transform3x4 transform;
};

/// A mesh in Embree, of its medium build quality; or instances of it.
class EmbreeScene {
public:
    /// Throws std::runtime_error if Embree has no memory.
    EmbreeScene(const Mesh& mesh, EmbreeMode mode, std::span<const Transform3x4> instances = {});
    /// Instances of several meshes, in their order.
    EmbreeScene(std::span<const Mesh* const> meshes, std::span<const EmbreeInstance> instances, EmbreeMode mode);
    ~EmbreeScene();
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;

    /// The closest hits of rays, one ray at a time (rtcIntersect1), by this thread and others. Primitives count as in
    /// the mesh, the geometry is 0; of instances, `front` means nothing. Triangles and rays have to be finite.
    void cast(std::span<const Ray> rays, std::span<RayHit> hits, uint32_t threads = 1,
              std::span<uint32_t> instances = {}) const;
    std::vector<RayHit> cast(std::span<const Ray> rays) const;
    /// Whether rays hit anything (rtcOccluded1): 1 or 0 each.
    void castAny(std::span<const Ray> rays, std::span<uint8_t> hits, uint32_t threads = 1) const;

private:
    struct Handles;
    std::unique_ptr<Handles> handles_;
};

/// "Embree 3.13.5".
std::string embreeName();

}  // namespace glint::test
