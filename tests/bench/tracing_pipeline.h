#pragma once

// The driver's ray-tracing pipeline, by hand: what Glint's own engine is compared with where there are no ray queries.

#include "bench/raw_vulkan.h"
#include "bench/tracing_batch.h"

#include <glint/format/mesh.h>
#include <glint/graphics/ray_caster.h>
#include <glint/math/math.h>

#include <span>
#include <vector>

namespace glint::bench {

/// Instances of a mesh in structures that the driver builds for fast tracing, and a pipeline of three shaders (ray
/// generation, miss, closest hit) that reads rays from a buffer and writes the records of hits. Opaque, no culling.
class TracingPipeline {
public:
    /// `device` has Tracing::Pipelines and outlives this. Sets of at most `capacity` rays.
    TracingPipeline(RawDevice& device, const Mesh& mesh, std::span<const Transform3x4> instances, size_t capacity);

    void setRays(std::span<const Ray> rays);
    /// One launch. Returns the seconds that the device took for it.
    double trace();
    std::vector<RayHit> hits();

private:
    void build(const Mesh& mesh, std::span<const Transform3x4> instances);
    void buildOne(VkAccelerationStructureTypeKHR type, const RawAcceleration& structure,
                  const VkAccelerationStructureGeometryKHR& geometry, uint32_t primitives);
    void writeSet();
    void copy(const RawBuffer& from, const RawBuffer& to, size_t size);

    RawDevice& device_;
    RawAcceleration model_, scene_;
    RawRays rays_program_;
    VkDescriptorSet set_ = VK_NULL_HANDLE;
    RawBuffer staging_, rays_, hits_;
    VkQueryPool queries_ = VK_NULL_HANDLE;
    uint32_t count_ = 0;
};

}  // namespace glint::bench
