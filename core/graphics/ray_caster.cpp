#include <glint/graphics/ray_caster.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/software_tracing.h>
#include <glint/geometry/triangle_order.h>
#include <glint/graphics/detail/piece_size.h>

#include <algorithm>
#include <array>
#include <chrono>

namespace glint {

namespace {

static_assert(sizeof(Ray) == 32 && sizeof(RayHit) == 28);

constexpr const char* source = R"(
#include <glint/tracing/ray_records.h>

layout(local_size_x = 64) in;

layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1) readonly buffer Rays { GlintRay rays[]; };
#if ANY
layout(binding = 2) writeonly buffer Hits { uint hits[]; };
#else
layout(binding = 2) writeonly buffer Hits { GlintHit hits[]; };
#endif
layout(push_constant) uniform Push { uint count, mask; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    GlintRay ray = rays[i];
    float scale = glintScale(ray);
    rayQueryEXT query;
    bool hit = false;
    if (scale != 0.0) {
        uint flags = gl_RayFlagsOpaqueEXT;
#if ANY
        flags |= gl_RayFlagsTerminateOnFirstHitEXT;
#endif
        rayQueryInitializeEXT(query, scene, flags, mask, ray.origin, ray.t_min, ray.direction, ray.t_max);
        while (rayQueryProceedEXT(query)) {}
        hit = rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT;
    }
#if ANY
    hits[i] = hit ? 1u : 0u;
#else
    hits[i] = GlintHit(uintBitsToFloat(GLINT_INFINITY), GLINT_NO_HIT, GLINT_NO_HIT, 0.0, 0.0, 0u, GLINT_NO_HIT);
    if (hit) {
        vec2 barycentrics = rayQueryGetIntersectionBarycentricsEXT(query, true);
        hits[i].t = rayQueryGetIntersectionTEXT(query, true) * scale;
        hits[i].primitive = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true));
        hits[i].u = barycentrics.x;
        hits[i].v = barycentrics.y;
        hits[i].front = rayQueryGetIntersectionFrontFaceEXT(query, true) ? 1u : 0u;
        hits[i].instance = uint(rayQueryGetIntersectionInstanceIdEXT(query, true));
    }
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

/// What one piece travels in.
struct Batch {
    Buffer rays;
    Buffer results;
    Fence fence;
    Query time;          ///< null on a device without time queries
    uint32_t count = 0;  ///< 0 while idle
    std::chrono::steady_clock::time_point begin;
};

/// A kernel, and how fast it is.
struct Pass {
    Kernel kernel;
    detail::PieceSize pieces;
    /// What a kernel reads that does without a query.
    std::optional<detail::TexelHierarchy> lone;
};

/// One of the meshes on the device, and what its triangles are called.
struct Model {
    Tracing tracing;
    Vector3f center = Vector3f(0.0f);
    std::vector<uint32_t> numbers;
    std::vector<uint32_t> part_begins;  ///< in triangles
    std::vector<uint32_t> part_ends;

    void name(RayHit& hit) const {
        hit.primitive = numbers[hit.primitive];
        hit.geometry = 0;
        if (part_ends.empty()) return;
        const auto part = std::upper_bound(part_ends.begin(), part_ends.end(), hit.primitive);
        const auto place = static_cast<size_t>(part - part_ends.begin());
        const bool inside = part != part_ends.end() && part_begins[place] <= hit.primitive;
        hit.geometry = static_cast<uint32_t>(inside ? place : part_ends.size());
    }
};

/// The numbers of the instances in an order in which those that are near in space are near in memory, for the same
/// reason as with triangles, and by the same sort: of triangles without extent at their centres.
std::vector<uint32_t> sortedInstances(std::span<const Model> models, std::span<const MeshInstance> instances) {
    Mesh centers;
    for (uint32_t i = 0; i < instances.size(); i++) {
        centers.positions.push_back(transformPoint(instances[i].transform.matrix(), models[instances[i].mesh].center));
        centers.indices.insert(centers.indices.end(), 3, i);
    }
    return sortTriangles(centers);
}

Status checkInstances(size_t meshes, std::span<const MeshInstance> instances) {
    if (instances.empty())
        return makeError(ErrorCode::InvalidArgument, "caster.instances", "there are no instances to cast rays at");
    for (size_t i = 0; i < instances.size(); i++) {
        const MeshInstance& instance = instances[i];
        if (instance.mesh >= meshes)
            return makeError(ErrorCode::OutOfRange, "caster.mesh", "instance {} is of mesh {}, there are {}", i,
                             instance.mesh, meshes);
        if (!isInvertible(instance.transform))
            return makeError(ErrorCode::InvalidArgument, "caster.transform",
                             "the transform of instance {} is not finite, or makes a plane, a line or a point of its "
                             "mesh",
                             i);
        if (instance.mask > 0xff)
            return makeError(ErrorCode::OutOfRange, "caster.mask", "the mask of instance {} is {:#x}; it has 8 bits", i,
                             instance.mask);
    }
    return {};
}

}  // namespace

struct RayCaster::State {
    Device device;
    std::vector<Model> models;
    std::vector<MeshInstance> instances;  ///< as they lie in the scene; each has an index
    Tracing scene;
    Pass closest;
    Pass any;
    Pass alone;  ///< closest hits of a mesh that lies in the scene alone and as it is
    std::array<Batch, 2> batches;
    uint32_t room = chunk;
    uint32_t mask = 0xff;

    Status addModel(const Mesh& mesh);
    Status build(std::span<const MeshInstance> unsorted);
    Expected<Pass*> closestPass();
    Status prepare(Pass& pass, std::string_view text, std::string_view macros);
    Status start(Batch& batch, const Pass& pass);
    Expected<double> wait(Batch& batch);
    Status stream(Pass& pass, const Source& fetch, const std::function<Status(Batch&)>& take);
};

Status RayCaster::State::addModel(const Mesh& mesh) {
    if (Status status = mesh.validate(); !status && status.error().id() != "mesh.not_finite") return status;
    if (const uint64_t limit = device.getFeatures().maxTracingPrimitives; mesh.triangleCount() > limit)
        return makeError(ErrorCode::OutOfRange, "tracing.too_large", "the mesh has {} triangles, the device takes {}",
                         mesh.triangleCount(), limit);
    Triangles triangles = sortedTriangles(mesh);
    if (triangles.numbers.empty())
        return makeError(ErrorCode::InvalidArgument, "mesh.no_faces",
                         "none of the {} triangles has three finite corners", mesh.triangleCount());
    Model model;
    model.center = mesh.bounds().center();
    model.numbers = std::move(triangles.numbers);
    for (const MeshPart& part : mesh.parts) {
        model.part_begins.push_back(part.first_index / 3);
        model.part_ends.push_back((part.first_index + part.index_count) / 3);
    }
    const Buffer vertices =
        device.createBuffer(Buffer::FlagTracing, std::span(triangles.mesh.positions), "ray caster: positions");
    const Buffer indices =
        device.createBuffer(Buffer::FlagTracing, std::span(triangles.mesh.indices), "ray caster: indices");
    model.tracing = device.createTracing("ray caster: triangles");
    model.tracing.addVertexBuffer(static_cast<uint32_t>(triangles.mesh.positions.size()), FormatRGBf32,
                                  sizeof(Vector3f), vertices);
    model.tracing.addIndexBuffer(static_cast<uint32_t>(triangles.mesh.indices.size()), FormatRu32, indices);
    if (Status status = model.tracing.create(Tracing::TypeTriangle); !status) return status;
    models.push_back(std::move(model));
    return {};
}

Status RayCaster::State::build(std::span<const MeshInstance> unsorted) {
    std::vector<Tracing::Instance> records;
    for (const uint32_t number : sortedInstances(models, unsorted)) {
        MeshInstance& instance = instances.emplace_back(unsorted[number]);
        if (instance.index == MeshInstance::by_place) instance.index = number;
        Tracing::Instance& record = records.emplace_back();
        std::copy(instance.transform.rows.begin(), instance.transform.rows.end(), record.transform);
        record.tracing = &models[instance.mesh].tracing;
        record.mask = instance.mask;
    }
    scene = device.createTracing(records, Tracing::FlagFastTrace, "ray caster: instances");
    std::vector<Tracing> tracings;
    tracings.reserve(models.size() + 1);
    for (const Model& model : models) tracings.push_back(model.tracing);
    tracings.push_back(scene);
    if (Status status = device.buildTracings(tracings, Buffer()); !status) return status;

    room = static_cast<uint32_t>(std::min<uint64_t>(chunk, device.getFeatures().maxStorageSize / sizeof(Ray)));
    for (Batch& batch : batches) {
        const Buffer::Flags flags = Buffer::FlagStorage | Buffer::FlagMapped;
        batch.rays = device.createBuffer(flags, uint64_t{room} * sizeof(Ray), "ray caster: rays");
        batch.results = device.createBuffer(flags, uint64_t{room} * sizeof(RayHit), "ray caster: hits");
        batch.fence = device.createFence();
        if (!batch.rays) return batch.rays.error();
        if (!batch.results) return batch.results.error();
        if (!batch.fence) return batch.fence.error();
        if (!device.getFeatures().has(FeatureTimestamps)) continue;
        batch.time = device.createQuery(Query::TypeTime, "ray caster");
        if (!batch.time) return batch.time.error();
    }
    return device.finish();
}

/// Without the level of instances a mesh is traced a tenth faster.
Expected<Pass*> RayCaster::State::closestPass() {
    const bool is_lone = instances.size() == 1 && instances[0].transform == Transform3x4();
    if (is_lone && (instances[0].mask & mask) != 0) {
        if (!alone.lone) alone.lone = detail::texelHierarchy(models[0].tracing);
        if (alone.lone) {
            Status status = prepare(alone, "#include <glint/tracing/batch.h>\n", alone.lone->macros);
            if (!status) return unexpected(status.error());
            return &alone;
        }
    }
    if (Status status = prepare(closest, source, "ANY=0"); !status) return unexpected(status.error());
    return &closest;
}

Status RayCaster::State::prepare(Pass& pass, std::string_view text, std::string_view macros) {
    if (pass.kernel) return {};
    pass.kernel = device.createKernel("ray caster");
    pass.kernel.createShaderGLSL(text, macros);
    return pass.kernel.create();
}

Status RayCaster::State::start(Batch& batch, const Pass& pass) {
    Compute compute = device.createCompute(Queue::Main, "ray caster");
    if (batch.time) compute.beginQuery(batch.time);
    compute.setKernel(pass.kernel);
    if (pass.lone) {
        compute.setUniform(0, std::array<uint32_t, 4>{batch.count, pass.lone->first});
        compute.setTexelBuffer(0, pass.lone->texels, FormatRGBAu32);
    } else {
        compute.setTracing(0, scene);
        compute.setPushConstants(std::array{batch.count, mask});
    }
    compute.setStorageBuffers(0, {batch.rays, batch.results});
    compute.dispatch(batch.count);
    if (batch.time) compute.endQuery(batch.time);
    batch.begin = std::chrono::steady_clock::now();
    return device.submit(compute, batch.fence);
}

/// Waits for the batch: the seconds that it took.
Expected<double> RayCaster::State::wait(Batch& batch) {
    if (Status status = batch.fence.wait(); !status) return unexpected(status.error());
    if (!batch.time) return std::chrono::duration<double>(std::chrono::steady_clock::now() - batch.begin).count();
    const Expected<uint64_t> nanoseconds = device.getTime(batch.time);
    if (!nanoseconds) return unexpected(nanoseconds.error());
    return static_cast<double>(*nanoseconds) * 1e-9;
}

Status RayCaster::State::stream(Pass& pass, const Source& fetch, const std::function<Status(Batch&)>& take) {
    const auto finish = [&](Batch& batch) {
        if (batch.count == 0) return Status();
        const Expected<double> seconds = wait(batch);
        Status status = seconds ? Status() : Status(seconds.error());
        if (status) {
            pass.pieces.add(batch.count, *seconds);
            status = take(batch);
        }
        batch.count = 0;
        return status;
    };
    // The device works on one batch while the other is emptied and filled.
    Status status;
    for (size_t turn = 0; status; turn++) {
        Batch& batch = batches[turn % 2];
        const uint32_t size = pass.pieces.next(room);
        const Expected<uint64_t> count = fetch({static_cast<Ray*>(batch.rays.map()), size});
        if (!count) {
            status = count.error();
            break;
        }
        batch.count = static_cast<uint32_t>(std::min<uint64_t>(*count, size));
        Batch& other = batches[(turn + 1) % 2];
        if (batch.count == 0) {
            status = finish(other);
            break;
        }
        status = start(batch, pass);
        if (status) status = finish(other);
    }
    // After an error the other batch may still be under way.
    for (Batch& batch : batches) {
        if (std::exchange(batch.count, 0) == 0) continue;
        if (Status waited = batch.fence.wait(); !waited && status) status = waited;
    }
    return status;
}

RayCaster::RayCaster(std::unique_ptr<State> state) : state_(std::move(state)) {}
RayCaster::RayCaster(RayCaster&&) noexcept = default;
RayCaster& RayCaster::operator=(RayCaster&&) noexcept = default;
RayCaster::~RayCaster() = default;

Expected<RayCaster> RayCaster::create(const Device& device, const Mesh& mesh) {
    return create(device, {&mesh, 1}, std::array{MeshInstance()});
}

Expected<RayCaster> RayCaster::create(const Device& device, std::span<const Mesh> meshes,
                                      std::span<const MeshInstance> instances) {
    if (!device) return unexpected(device.error());
    if (!device.getFeatures().computeTracing)
        return unexpected(makeError(ErrorCode::Unsupported, "device.unsupported", "{} lacks {}", device.getInfo().name,
                                    featureNames(FeatureComputeTracing)));
    if (Status status = checkInstances(meshes.size(), instances); !status) return unexpected(status.error());
    auto state = std::make_unique<State>();
    state->device = device;
    state->models.reserve(meshes.size());  // instances point at them
    for (size_t i = 0; i < meshes.size(); i++) {
        const Status status = state->addModel(meshes[i]);
        if (status) continue;
        return unexpected(meshes.size() == 1 ? status.error() : status.error().named(fmt::format("mesh {}", i)));
    }
    if (Status status = state->build(instances); !status) return unexpected(status.error());
    return RayCaster(std::move(state));
}

void RayCaster::setMask(uint8_t mask) { state_->mask = mask; }

Status RayCaster::cast(const Source& fetch, const HitSink& sink) {
    const Expected<Pass*> pass = state_->closestPass();
    if (!pass) return pass.error();
    return state_->stream(**pass, fetch, [&](Batch& batch) {
        const std::span hits(static_cast<RayHit*>(batch.results.map()), batch.count);
        for (RayHit& hit : hits) {
            if (!hit.isHit()) continue;
            const MeshInstance& instance = state_->instances[hit.instance];
            state_->models[instance.mesh].name(hit);
            hit.instance = instance.index;
        }
        return sink(hits);
    });
}

Status RayCaster::castAny(const Source& fetch, const AnySink& sink) {
    if (Status status = state_->prepare(state_->any, source, "ANY=1"); !status) return status;
    std::vector<uint8_t> packed;
    return state_->stream(state_->any, fetch, [&](Batch& batch) {
        const std::span hits(static_cast<const uint32_t*>(batch.results.map()), batch.count);
        packed.assign(hits.begin(), hits.end());
        return sink(packed);
    });
}

namespace {

/// What `cast(source, sink)` gives for rays in memory.
template <class Hit, class Cast>
Expected<std::vector<Hit>> collect(std::span<const Ray> left, Cast&& cast) {
    std::vector<Hit> all;
    all.reserve(left.size());
    const RayCaster::Source fetch = [&](std::span<Ray> rays) -> Expected<uint64_t> {
        const size_t count = std::min(rays.size(), left.size());
        std::copy_n(left.begin(), count, rays.begin());
        left = left.subspan(count);
        return count;
    };
    const Status status = cast(fetch, [&](std::span<const Hit> hits) {
        all.insert(all.end(), hits.begin(), hits.end());
        return Status();
    });
    if (!status) return unexpected(status.error());
    return all;
}

}  // namespace

Expected<std::vector<RayHit>> RayCaster::cast(std::span<const Ray> rays) {
    return collect<RayHit>(rays, [&](const Source& fetch, const HitSink& sink) { return cast(fetch, sink); });
}

Expected<std::vector<uint8_t>> RayCaster::castAny(std::span<const Ray> rays) {
    return collect<uint8_t>(rays, [&](const Source& fetch, const AnySink& sink) { return castAny(fetch, sink); });
}

uint64_t RayCaster::getMemory() const {
    uint64_t bytes = state_->scene.getMemory();
    for (const Model& model : state_->models) bytes += model.tracing.getMemory();
    return bytes;
}

}  // namespace glint
