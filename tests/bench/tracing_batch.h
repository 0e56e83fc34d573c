#pragma once

// Sets of rays traced by Glint's own kernels, and clocks for races between them and others.

#include "bench/bench.h"

#include <glint/graphics/ray_caster.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace glint::bench {

/// A kernel over one set of rays, whose slots are those of shaders/tracing/batch.h.
class RayBatch {
public:
    /// `structure`: texels of our hierarchies, or the driver's structure.
    RayBatch(const Device& device, const Kernel& kernel, const std::variant<Buffer, Tracing>& structure,
             std::span<const Ray> rays)
        : device_(device),
          kernel_(kernel),
          structure_(structure),
          count_(static_cast<uint32_t>(rays.size())),
          rays_(device_.createBuffer(Buffer::FlagStorage, rays)),
          hits_(device_.createBuffer(Buffer::FlagStorage, rays.size() * sizeof(RayHit))) {}

    uint32_t size() const { return count_; }

    void trace(uint32_t threads) {
        Compute compute = device_.createCompute();
        compute.setKernel(kernel_);
        compute.setUniform(0, std::array<uint32_t, 4>{count_, 0, 0, 0});
        if (const Buffer* texels = std::get_if<Buffer>(&structure_))
            compute.setTexelBuffer(0, *texels, FormatRGBAu32);
        else
            compute.setTracing(0, std::get<Tracing>(structure_));
        compute.setStorageBuffers(0, {rays_, hits_});
        compute.dispatch(threads);
        check(device_.submit(compute));
        check(device_.finish());
    }

    std::vector<RayHit> hits() { return *check(device_.read<RayHit>(hits_)); }

private:
    Device device_;
    Kernel kernel_;
    std::variant<Buffer, Tracing> structure_;
    uint32_t count_;
    Buffer rays_;
    Buffer hits_;
};

/// Closest hits by a query of each ray: with DRIVER=1 the driver's, else the engine's, as rewritten shaders have it.
constexpr const char* query_kernel = R"(
#if DRIVER
layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;
#define QUERY rayQueryEXT
#define START(q, f, m, o, t0, d, t1) rayQueryInitializeEXT(q, scene, f, m, o, t0, d, t1)
#define PROCEED rayQueryProceedEXT
#define TYPE rayQueryGetIntersectionTypeEXT
#define DISTANCE rayQueryGetIntersectionTEXT
#define PRIMITIVE rayQueryGetIntersectionPrimitiveIndexEXT
#define INSTANCE rayQueryGetIntersectionInstanceIdEXT
#define BARYCENTRICS rayQueryGetIntersectionBarycentricsEXT
#define FRONT rayQueryGetIntersectionFrontFaceEXT
#else
#include <glint/tracing/query.h>
#define QUERY GlintQuery
#define START(q, f, m, o, t0, d, t1) glintQueryInitialize(q, 0u, 0u, f, m, o, t0, d, t1)
#define PROCEED glintQueryProceed
#define TYPE glintQueryType
#define DISTANCE glintQueryT
#define PRIMITIVE glintQueryPrimitiveIndex
#define INSTANCE glintQueryInstanceId
#define BARYCENTRICS glintQueryBarycentrics
#define FRONT glintQueryFrontFace
#endif

layout(local_size_x = 64) in;
struct Ray { vec3 origin; float t_min; vec3 direction; float t_max; };
struct Hit { float t; uint primitive, geometry; float u, v; uint front, instance; };
layout(set = 0, binding = 1) uniform Parameters { uint ray_count; };
layout(set = 0, binding = 2) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 3) writeonly buffer Hits { Hit hits[]; };

void main() {
    const uint index = gl_GlobalInvocationID.x;
    if (index >= ray_count) return;
    const Ray ray = rays[index];
    QUERY query;
    START(query, 1u, 0xffu, ray.origin, ray.t_min, ray.direction, ray.t_max);
    while (PROCEED(query)) {}
    Hit hit = Hit(uintBitsToFloat(0x7f800000u), 0xffffffffu, 0xffffffffu, 0.0, 0.0, 0u, 0xffffffffu);
    if (uint(TYPE(query, true)) != 0u) {
        const vec2 at = BARYCENTRICS(query, true);
        hit = Hit(DISTANCE(query, true), uint(PRIMITIVE(query, true)), 0u, at.x, at.y, FRONT(query, true) ? 1u : 0u,
                  uint(INSTANCE(query, true)));
    }
    hits[index] = hit;
}
)";

constexpr const char* batch_kernel = "#include <glint/tracing/batch.h>\n";

inline Kernel createRayKernel(const Device& device, const char* source, const std::string& macros) {
    Device maker = device;
    Kernel kernel = maker.createKernel();
    kernel.createShaderGLSL(source, "GLINT_TRACING_MEMORY=0;" + macros);
    check(kernel.create());
    return kernel;
}

/// Seconds of all the process' threads on processors. Both sides keep two threads busy, so half of it is the time that
/// they take where nothing else runs.
inline double processSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct RaceTimes {
    Times wall;
    Times process;

    template <class Work>
    void take(const Work& work, bool counts) {
        const double wall_begin = wallSeconds();
        const double process_begin = processSeconds();
        work();
        if (!counts) return;
        wall.values.push_back(wallSeconds() - wall_begin);
        process.values.push_back(0.5 * (processSeconds() - process_begin));
    }
};

}  // namespace glint::bench
