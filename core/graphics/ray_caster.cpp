#include <glint/graphics/ray_caster.h>

#include <glint/base/format_error.h>
#include <glint/geometry/triangle_order.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>

namespace glint {

namespace {

static_assert(sizeof(Ray) == 32 && sizeof(RayHit) == 24);

// Floats are judged by their bits: compilers of shaders may assume that there is no NaN. Scaling the direction by a
// power of two, so that its largest component lies in [1, 2), and t by the inverse, is exact, and keeps the driver's
// products within range whatever the direction's length.
constexpr const char* source = R"(
layout(local_size_x = 64) in;

layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, std430) readonly buffer Rays { vec4 rays[]; };
layout(binding = 2, std430) writeonly buffer Hits { uint hits[]; };
layout(push_constant) uniform Push { uint count; };

const uint infinity = 0x7f800000u;

bool isFinite(vec3 v) {
    uvec3 exponents = floatBitsToUint(v) & infinity;
    return max(max(exponents.x, exponents.y), exponents.z) != infinity;
}

bool isNumber(float x) { return (floatBitsToUint(x) & 0x7fffffffu) <= infinity; }

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    vec4 origin = rays[i * 2u];
    vec4 direction = rays[i * 2u + 1u];
    uvec3 exponents = (floatBitsToUint(direction.xyz) & infinity) >> 23;
    uint exponent = min(max(max(exponents.x, exponents.y), exponents.z), 253u);
    bool valid = isFinite(origin.xyz) && isFinite(direction.xyz) && isNumber(origin.w) && isNumber(direction.w) &&
                 exponent != 0u;

    float scale = uintBitsToFloat((254u - exponent) << 23);
    float inverse_scale = uintBitsToFloat(exponent << 23);
    float t_min = valid ? max(origin.w, 0.0) * inverse_scale : 0.0;
    float t_max = valid ? direction.w * inverse_scale : 0.0;
    valid = valid && t_min <= t_max && floatBitsToUint(t_min) != infinity;

    rayQueryEXT query;
    bool hit = false;
    if (valid) {
#if ANY
        uint flags = gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT;
#else
        uint flags = gl_RayFlagsOpaqueEXT;
#endif
        rayQueryInitializeEXT(query, scene, flags, 0xff, origin.xyz, t_min, direction.xyz * scale, t_max);
        while (rayQueryProceedEXT(query)) {}
        hit = rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT;
    }
#if ANY
    hits[i] = hit ? 1u : 0u;
#else
    uint place = i * 6u;
    vec2 barycentrics = vec2(0.0);
    if (hit) barycentrics = rayQueryGetIntersectionBarycentricsEXT(query, true);
    hits[place] = hit ? floatBitsToUint(rayQueryGetIntersectionTEXT(query, true) * scale) : infinity;
    hits[place + 1u] = hit ? uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true)) : 0xffffffffu;
    hits[place + 2u] = 0xffffffffu;
    hits[place + 3u] = floatBitsToUint(barycentrics.x);
    hits[place + 4u] = floatBitsToUint(barycentrics.y);
    hits[place + 5u] = hit && rayQueryGetIntersectionFrontFaceEXT(query, true) ? 1u : 0u;
#endif
}
)";

/// The mesh's triangles that can be hit, sorted in space, as one part.
struct Triangles {
    Mesh mesh;
    std::vector<uint32_t> numbers;  ///< of each triangle in the mesh given
};

Triangles sortedTriangles(const Mesh& mesh) {
    Triangles triangles;
    triangles.mesh.positions = mesh.positions;
    std::vector<uint32_t> kept;
    for (uint32_t i = 0; i < mesh.triangleCount(); i++) {
        const uint32_t* corners = &mesh.indices[i * size_t{3}];
        const bool finite =
            std::all_of(corners, corners + 3, [&](uint32_t corner) { return isFinite(mesh.positions[corner]); });
        if (!finite) continue;
        kept.push_back(i);
        triangles.mesh.indices.insert(triangles.mesh.indices.end(), corners, corners + 3);
    }
    // Lavapipe builds its structures in the order of the triangles.
    triangles.numbers = sortTriangles(triangles.mesh);
    for (uint32_t& number : triangles.numbers) number = kept[number];
    return triangles;
}

/// What one chunk travels in.
struct Batch {
    Buffer rays;
    Buffer results;
    Fence fence;
    uint32_t count = 0;  ///< 0 while idle
};

}  // namespace

struct RayCaster::State {
    Device device;
    Tracing model;
    Tracing scene;
    Kernel closest;
    Kernel any;
    std::array<Batch, 2> batches;
    std::vector<uint32_t> numbers;
    std::vector<uint32_t> part_begins;  ///< in triangles
    std::vector<uint32_t> part_ends;
    uint32_t room = chunk;

    Status build(const Mesh& mesh);
    Status prepare(Kernel& kernel, const char* macros);
    Status start(Batch& batch, const Kernel& kernel);
    Status stream(const Kernel& kernel, const Source& fetch, const std::function<Status(Batch&)>& take);
    void nameTriangles(std::span<RayHit> hits) const;
};

Status RayCaster::State::build(const Mesh& mesh) {
    Triangles triangles = sortedTriangles(mesh);
    if (triangles.numbers.empty())
        return makeError(ErrorCode::InvalidArgument, "mesh.no_faces",
                         "none of the {} triangles has three finite corners", mesh.triangleCount());
    numbers = std::move(triangles.numbers);
    for (const MeshPart& part : mesh.parts) {
        part_begins.push_back(part.first_index / 3);
        part_ends.push_back((part.first_index + part.index_count) / 3);
    }

    const Buffer vertices =
        device.createBuffer(Buffer::FlagTracing, std::span(triangles.mesh.positions), "ray caster: positions");
    const Buffer indices =
        device.createBuffer(Buffer::FlagTracing, std::span(triangles.mesh.indices), "ray caster: indices");
    model = device.createTracing("ray caster: triangles");
    model.addVertexBuffer(static_cast<uint32_t>(triangles.mesh.positions.size()), FormatRGBf32, sizeof(Vector3f),
                          vertices);
    model.addIndexBuffer(static_cast<uint32_t>(triangles.mesh.indices.size()), FormatRu32, indices);
    if (Status status = model.create(Tracing::TypeTriangle); !status) return status;
    scene = device.createTracing({Tracing::Instance{.tracing = &model}});
    if (Status status = device.buildTracings({model, scene}); !status) return status;

    room = static_cast<uint32_t>(std::min<uint64_t>(chunk, device.getFeatures().maxStorageSize / sizeof(Ray)));
    for (Batch& batch : batches) {
        const Buffer::Flags flags = Buffer::FlagStorage | Buffer::FlagMapped;
        batch.rays = device.createBuffer(flags, uint64_t{room} * sizeof(Ray), "ray caster: rays");
        batch.results = device.createBuffer(flags, uint64_t{room} * sizeof(RayHit), "ray caster: hits");
        batch.fence = device.createFence();
        if (!batch.rays) return batch.rays.error();
        if (!batch.results) return batch.results.error();
        if (!batch.fence) return batch.fence.error();
    }
    return device.finish();
}

Status RayCaster::State::prepare(Kernel& kernel, const char* macros) {
    if (kernel) return {};
    kernel = device.createKernel("ray caster");
    kernel.createShaderGLSL(source, macros);
    return kernel.create();
}

Status RayCaster::State::start(Batch& batch, const Kernel& kernel) {
    Compute compute = device.createCompute(Queue::Main, "ray caster");
    compute.setKernel(kernel);
    compute.setTracing(0, scene);
    compute.setStorageBuffers(0, {batch.rays, batch.results});
    compute.setPushConstants(batch.count);
    compute.dispatch(batch.count);
    return device.submit(compute, batch.fence);
}

Status RayCaster::State::stream(const Kernel& kernel, const Source& fetch, const std::function<Status(Batch&)>& take) {
    const auto finish = [&](Batch& batch) {
        if (batch.count == 0) return Status();
        Status status = batch.fence.wait();
        if (status) status = take(batch);
        batch.count = 0;
        return status;
    };
    // The device works on one batch while the other is emptied and filled.
    Status status;
    for (size_t turn = 0; status; turn++) {
        Batch& batch = batches[turn % 2];
        const Expected<uint64_t> count = fetch({static_cast<Ray*>(batch.rays.map()), room});
        if (!count) {
            status = count.error();
            break;
        }
        batch.count = static_cast<uint32_t>(std::min<uint64_t>(*count, room));
        Batch& other = batches[(turn + 1) % 2];
        if (batch.count == 0) {
            status = finish(other);
            break;
        }
        status = start(batch, kernel);
        if (status) status = finish(other);
    }
    // After an error the other batch may still be under way.
    for (Batch& batch : batches) {
        if (std::exchange(batch.count, 0) == 0) continue;
        if (Status waited = batch.fence.wait(); !waited && status) status = waited;
    }
    return status;
}

void RayCaster::State::nameTriangles(std::span<RayHit> hits) const {
    for (RayHit& hit : hits) {
        if (!hit.isHit()) continue;
        hit.primitive = numbers[hit.primitive];
        hit.geometry = 0;
        if (part_ends.empty()) continue;
        const auto part = std::upper_bound(part_ends.begin(), part_ends.end(), hit.primitive);
        const auto place = static_cast<size_t>(part - part_ends.begin());
        const bool inside = part != part_ends.end() && part_begins[place] <= hit.primitive;
        hit.geometry = static_cast<uint32_t>(inside ? place : part_ends.size());
    }
}

RayCaster::RayCaster(std::unique_ptr<State> state) : state_(std::move(state)) {}
RayCaster::RayCaster(RayCaster&&) noexcept = default;
RayCaster& RayCaster::operator=(RayCaster&&) noexcept = default;
RayCaster::~RayCaster() = default;

Expected<RayCaster> RayCaster::create(const Device& device, const Mesh& mesh) {
    if (!device) return unexpected(device.error());
    if (!device.getFeatures().computeTracing)
        return unexpected(makeError(ErrorCode::Unsupported, "device.unsupported", "{} lacks {}", device.getInfo().name,
                                    featureNames(FeatureComputeTracing)));
    if (Status status = mesh.validate(); !status && status.error().id() != "mesh.not_finite")
        return unexpected(status.error());
    if (const uint64_t limit = device.getFeatures().maxTracingPrimitives; mesh.triangleCount() > limit)
        return unexpected(makeError(ErrorCode::OutOfRange, "tracing.too_large",
                                    "the mesh has {} triangles, the device takes {}", mesh.triangleCount(), limit));
    auto state = std::make_unique<State>();
    state->device = device;
    if (Status status = state->build(mesh); !status) return unexpected(status.error());
    return RayCaster(std::move(state));
}

Status RayCaster::cast(const Source& fetch, const HitSink& sink) {
    if (Status status = state_->prepare(state_->closest, "ANY=0"); !status) return status;
    return state_->stream(state_->closest, fetch, [&](Batch& batch) {
        const std::span hits(static_cast<RayHit*>(batch.results.map()), batch.count);
        state_->nameTriangles(hits);
        return sink(hits);
    });
}

Status RayCaster::castAny(const Source& fetch, const AnySink& sink) {
    if (Status status = state_->prepare(state_->any, "ANY=1"); !status) return status;
    std::vector<uint8_t> packed;
    return state_->stream(state_->any, fetch, [&](Batch& batch) {
        const std::span hits(static_cast<const uint32_t*>(batch.results.map()), batch.count);
        packed.assign(hits.begin(), hits.end());
        return sink(packed);
    });
}

namespace {

RayCaster::Source sourceOf(std::span<const Ray>& left) {
    return [&left](std::span<Ray> rays) -> Expected<uint64_t> {
        const size_t count = std::min(rays.size(), left.size());
        std::copy(left.begin(), left.begin() + static_cast<std::ptrdiff_t>(count), rays.begin());
        left = left.subspan(count);
        return count;
    };
}

}  // namespace

Expected<std::vector<RayHit>> RayCaster::cast(std::span<const Ray> rays) {
    std::vector<RayHit> all;
    all.reserve(rays.size());
    const Status status = cast(sourceOf(rays), [&](std::span<const RayHit> hits) {
        all.insert(all.end(), hits.begin(), hits.end());
        return Status();
    });
    if (!status) return unexpected(status.error());
    return all;
}

Expected<std::vector<uint8_t>> RayCaster::castAny(std::span<const Ray> rays) {
    std::vector<uint8_t> all;
    all.reserve(rays.size());
    const Status status = castAny(sourceOf(rays), [&](std::span<const uint8_t> hits) {
        all.insert(all.end(), hits.begin(), hits.end());
        return Status();
    });
    if (!status) return unexpected(status.error());
    return all;
}

uint64_t RayCaster::getMemory() const { return state_->model.getMemory() + state_->scene.getMemory(); }

}  // namespace glint
