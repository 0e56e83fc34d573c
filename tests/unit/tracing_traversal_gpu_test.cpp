// The traversal of shaders/tracing on the device: against float64, against the driver's ray queries, and at the places
// where rays slip through.

#include "support/device_fixture.h"
#include "support/hierarchies.h"
#include "support/reference.h"

#include <glint/geometry/primitives.h>
#include <glint/graphics/ray_caster.h>
#include <glint/tracing/detail/instances.h>

#include <fmt/format.h>

#include <cmath>
#include <cstring>

namespace glint::test {

namespace {

using namespace glint::detail;

Ray rayTo(const Vector3d& origin, const Vector3d& target) {
    Ray ray;
    ray.origin = Vector3f(origin);
    ray.direction = Vector3f(target - Vector3d(ray.origin));
    return ray;
}

/// Every test runs with every form of nodes.
class TracingTraversal : public DeviceTest, public ::testing::WithParamInterface<NodeForm> {
protected:
    TracingTraversal() : DeviceTest("vulkan", TracingEngine::Driver) {}

    Hierarchy buildMesh(const Mesh& mesh, BuildMode mode = BuildMode::Quality, bool opaque = true) const {
        TriangleGeometry geometry = geometryOf(mesh);
        geometry.opaque = opaque;
        return hierarchyOf(geometry, mode, nullptr, GetParam());
    }

    std::string macros(uint32_t memory = 0) const {
        return fmt::format("GLINT_TRACING_MEMORY={};GLINT_TRACING_NODES={};", memory, static_cast<int>(GetParam()));
    }

    std::vector<RayHit> trace(const Hierarchy& hierarchy, const std::vector<Ray>& rays, bool refill,
                              uint32_t memory = 0) {
        return trace(std::span(hierarchy.texels.data(), hierarchy.texels.size()), rays, 1, refill, memory);
    }

    std::vector<RayHit> trace(std::span<const Texel> hierarchies, const std::vector<Ray>& rays, uint32_t levels,
                              bool refill, uint32_t memory = 0) {
        Kernel kernel = device.createKernel();
        kernel.createShaderGLSL("#include <glint/tracing/batch.h>\n",
                                macros(memory) +
                                    fmt::format("GLINT_TRACING_LEVELS={};GLINT_TRACING_REFILL={};GLINT_TRACING_RAYS=4",
                                                levels, refill ? 1 : 0));
        EXPECT_TRUE(kernel.create()) << kernel.error().text();
        Buffer::Flags flags = Buffer::FlagTexel | Buffer::FlagStorage;
        if (memory == 2) flags |= Buffer::FlagAddress;
        const Buffer texels = device.createBuffer(flags, hierarchies);
        const Buffer ray_buffer = device.createBuffer(Buffer::FlagStorage, std::span(rays));
        const Buffer hit_buffer = device.createBuffer(Buffer::FlagStorage, rays.size() * sizeof(RayHit));
        device.clearBuffer(hit_buffer, 0x12345678u);
        const auto count = static_cast<uint32_t>(rays.size());
        Compute compute = device.createCompute();
        compute.setKernel(kernel);
        const uint64_t address = texels.getAddress();
        compute.setUniform(
            0, std::array<uint32_t, 4>{count, 0, static_cast<uint32_t>(address), static_cast<uint32_t>(address >> 32)});
        if (memory == 0) compute.setTexelBuffer(0, texels, FormatRGBAu32);
        if (memory == 1) compute.setStorageBuffer(0, texels);
        if (memory == 2) compute.useBuffer(texels, false);
        compute.setStorageBuffers(memory == 1 ? 1 : 0, {ray_buffer, hit_buffer});
        compute.dispatch(refill ? (count + 3) / 4 : count);
        const Status status = device.submit(compute);
        EXPECT_TRUE(status) << status.error().text();
        const Expected<std::vector<RayHit>> results = device.read<RayHit>(hit_buffer);
        if (!results) ADD_FAILURE() << results.error().text();
        return results.value_or(std::vector<RayHit>());
    }
};

/// How far apart the distances of exact and of float32 arithmetic may be at a triangle, for a direction of length 1.
/// The corners are moved by less than 2^-20 of the reach (docs/tracing.md, "Triangles"), so the plane's crossing is
/// moved by that over the cosine of the angle between ray and normal; the weights' rounding adds the triangle's length,
/// times the ratio of its square to the area.
double distanceBound(const Mesh& mesh, uint32_t triangle, const Ray& ray) {
    const Vector3d a(mesh.positions[mesh.indices[3 * triangle]]);
    const Vector3d b(mesh.positions[mesh.indices[3 * triangle + 1]]);
    const Vector3d c(mesh.positions[mesh.indices[3 * triangle + 2]]);
    const Vector3d origin(ray.origin);
    const Vector3d direction(ray.direction);
    const Vector3d normal = glm::cross(b - a, c - a);
    const double reach = std::max({glm::length(a - origin), glm::length(b - origin), glm::length(c - origin)});
    const double length = std::max({glm::length(b - a), glm::length(c - b), glm::length(a - c)});
    const double cosine = std::abs(glm::dot(normal, direction)) / (glm::length(normal) * glm::length(direction));
    const double aspect = length * length / glm::length(normal);
    return 0x1p-20 * (reach + length * aspect) / cosine / glm::length(direction);
}

/// Compares with trying every triangle in float64.
void expectReference(const Mesh& mesh, const std::vector<Ray>& rays, const std::vector<RayHit>& hits) {
    uint32_t met = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        const ReferenceHit exact =
            closestHit(mesh, Vector3d(rays[i].origin), Vector3d(rays[i].direction), rays[i].t_min, rays[i].t_max);
        ASSERT_EQ(hits[i].isHit(), exact.hit) << "ray " << i;
        if (!exact.hit) continue;
        met++;
        double bound = distanceBound(mesh, exact.triangle, rays[i]);
        if (hits[i].primitive != exact.triangle) bound += distanceBound(mesh, hits[i].primitive, rays[i]);
        ASSERT_LE(std::abs(hits[i].t - exact.t), bound) << "ray " << i << " triangle " << exact.triangle;
    }
    EXPECT_GT(met, rays.size() / 50);
}

std::vector<Ray> randomRays(const Mesh& mesh, uint32_t count, uint64_t seed) {
    Random random(seed);
    const BoundBox bounds = mesh.bounds();
    const Vector3d center(bounds.center());
    const double radius = 0.5 * glm::length(Vector3d(bounds.size()));
    std::vector<Ray> rays;
    for (uint32_t i = 0; i < count; i++) {
        Ray ray = rayTo(center + radius * 1.7 * random.direction(), center + radius * 0.6 * random.direction());
        if (i % 3 == 0) ray.direction = glm::normalize(ray.direction);
        if (i % 5 == 0) ray.direction[i / 5 % 3] = 0.0f;
        if (i % 7 == 0) ray.origin = Vector3f(center + radius * 0.3 * random.direction());
        rays.push_back(ray);
    }
    return rays;
}

Mesh moved(Mesh mesh, double scale, const Vector3d& offset) {
    for (Vector3f& p : mesh.positions) p = Vector3f(Vector3d(p) * scale + offset);
    return mesh;
}

Mesh needles() {
    Random random(21);
    Mesh mesh;
    for (uint32_t i = 0; i < 300; i++) {
        const Vector3d a = random.direction();
        const Vector3d along = random.direction();
        mesh.positions.push_back(Vector3f(a));
        mesh.positions.push_back(Vector3f(a + along));
        mesh.positions.push_back(Vector3f(a + 0.5 * along + 1e-2 * random.direction()));
        for (uint32_t c = 0; c < 3; c++) mesh.indices.push_back(3 * i + c);
    }
    return mesh;
}

TEST_P(TracingTraversal, FindsWhatFloat64Finds) {
    const Mesh torus = createTorus(1.0f, 0.4f, 24, 12);
    const std::pair<const char*, Mesh> cases[] = {
        {"torus", torus},
        {"sphere", createSphere(1.0f, 2)},
        {"needles", needles()},
        {"small", moved(torus, 1e-6, Vector3d(0.0))},
        {"large", moved(torus, 1e9, Vector3d(0.0))},
        {"far away", moved(torus, 1.0, Vector3d(1000.0, -2000.0, 500.0))},
    };
    for (const auto& [name, mesh] : cases) {
        SCOPED_TRACE(name);
        const std::vector<Ray> rays = randomRays(mesh, 3001, 5);
        const Hierarchy hierarchy = buildMesh(mesh);
        const std::vector<RayHit> hits = trace(hierarchy, rays, false);
        expectReference(mesh, rays, hits);
        // The other forms do the same arithmetic, so they give the same bits; and so does a second run.
        EXPECT_EQ(trace(hierarchy, rays, true), hits);
        EXPECT_EQ(trace(hierarchy, rays, false, 1), hits);
        if (device.getFeatures().bufferAddress) { EXPECT_EQ(trace(hierarchy, rays, false, 2), hits); }
        EXPECT_EQ(trace(hierarchy, rays, false), hits);
        EXPECT_EQ(trace(buildMesh(mesh, BuildMode::Fast), rays, true), hits);
    }
}

TEST_P(TracingTraversal, LetsNothingThroughClosedMeshes) {
    // From the middle of the tube at corners and at points of edges. The directions are rounded, so the rays pass
    // within rounding of what they aim at, on either side.
    const Mesh torus = createTorus(1.0f, 0.4f, 48, 24);
    const std::pair<const char*, Mesh> cases[] = {
        {"torus", torus},
        {"large", moved(torus, 1000.0, Vector3d(0.0))},
        {"small", moved(torus, 1e-3, Vector3d(0.0))},
        {"far away", moved(torus, 1.0, Vector3d(300.0, 100.0, -200.0))},
    };
    for (const auto& [name, mesh] : cases) {
        SCOPED_TRACE(name);
        const BoundBox bounds = mesh.bounds();
        const Vector3d center(bounds.center());
        const double radius = 0.5 * bounds.size().x / 1.4;
        Random random(22);
        std::vector<Ray> rays;
        std::vector<double> farthest;
        for (uint32_t i = 0; i < 60000; i++) {
            const uint64_t triangle = random.below(mesh.triangleCount());
            const Vector3d a(mesh.positions[mesh.indices[3 * triangle + i % 3]]);
            const Vector3d b(mesh.positions[mesh.indices[3 * triangle + (i + 1) % 3]]);
            const double along = i % 2 == 0 ? 0.0 : random.uniform();
            const Vector3d target = a + (b - a) * along;
            // The circle within the tube, at the angle of the target and a bit beside it.
            const Vector3d out = target - center;
            const double angle = std::atan2(out.y, out.x) + random.uniform(-0.2, 0.2);
            const Vector3d origin = center + radius * Vector3d(std::cos(angle), std::sin(angle), 0.0);
            rays.push_back(rayTo(origin, target));
            // Nothing of the mesh is beyond the target by more than the bound: the ray leaves the tube there, and t
            // = 1.
            farthest.push_back(1.0 + 1e-2);
        }
        for (const bool refill : {false, true}) {
            const std::vector<RayHit> hits = trace(buildMesh(mesh), rays, refill);
            uint32_t missed = 0;
            uint32_t beyond = 0;
            for (size_t i = 0; i < hits.size(); i++) {
                missed += hits[i].isHit() ? 0 : 1;
                beyond += hits[i].isHit() && hits[i].t > farthest[i] ? 1 : 0;
            }
            EXPECT_EQ(missed, 0u);
            EXPECT_EQ(beyond, 0u);
        }
    }
}

TEST_P(TracingTraversal, KeepsToTheIntervalAndTheOrderOfTies) {
    // Three copies of a triangle at z = 2 and one at z = 4.
    Mesh mesh;
    for (const float z : {4.0f, 2.0f, 2.0f, 2.0f}) {
        for (const Vector3f& p : {Vector3f(-1, -1, z), Vector3f(1, -1, z), Vector3f(0, 1, z)}) {
            mesh.indices.push_back(static_cast<uint32_t>(mesh.positions.size()));
            mesh.positions.push_back(p);
        }
    }
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float infinity = std::numeric_limits<float>::infinity();
    const Vector3f up(0, 0, 1);
    const Vector3f zero(0.0f);
    const std::vector<Ray> rays = {
        {zero, 0, up, infinity},   {zero, 2, up, infinity},
        {zero, 0, up, 2},          {zero, 1.5f, up, 2.5f},
        {zero, 4, up, 5},          {zero, 5, up, 1},
        {zero, 0, zero, infinity}, {{nan, 0, 0}, 0, up, 9},
        {zero, 0, {0, nan, 1}, 9}, {zero, nan, up, 9},
        {zero, 0, up, nan},        {{infinity, 0, 0}, 0, up, 9},
        {zero, -3, up, 9},         {{0, 0, 2}, -3, up, infinity},
        {{0, 0, 3}, 0, -up, 9},
    };
    const uint32_t none = RayHit::none;
    const std::vector<uint32_t> expected = {1, 0, none, 1, none, none, none, none, none, none, none, none, 1, 0, 1};
    for (const bool refill : {false, true}) {
        const std::vector<RayHit> hits = trace(buildMesh(mesh), rays, refill);
        for (size_t i = 0; i < rays.size(); i++) EXPECT_EQ(hits[i].primitive, expected[i]) << "ray " << i;
        EXPECT_EQ(hits[0].t, 2.0f);
        EXPECT_EQ(hits[0].u, 0.25f);
        EXPECT_EQ(hits[0].v, 0.5f);
        // The corners are counter-clockwise seen from above.
        EXPECT_EQ(hits[0].front, 0u);
        EXPECT_EQ(hits[14].front, 1u);
        EXPECT_EQ(trace(buildMesh(Mesh()), rays, refill)[0].primitive, none);
    }
}

/// A top level, and the models behind it. The instances' texels are the models' numbers.
std::vector<Texel> sceneOf(std::vector<HierarchyInstance> instances, std::span<const Hierarchy> models, NodeForm form) {
    for (HierarchyInstance& instance : instances) instance.bounds = boundsOf(models[instance.texel]);
    const auto top = [&] {
        return std::move(
            *buildHierarchy(std::span<const HierarchyInstance>(instances), BuildMode::Quality, nullptr, form));
    };
    // Its size does not depend on where the models are.
    size_t end = top().texels.size();
    std::vector<uint32_t> places;
    for (const Hierarchy& model : models) {
        places.push_back(static_cast<uint32_t>(end));
        end += model.texels.size();
    }
    for (HierarchyInstance& instance : instances) instance.texel = places[instance.texel];
    std::vector<Texel> all;
    const auto append = [&](const Hierarchy& each) { all.insert(all.end(), each.texels.begin(), each.texels.end()); };
    append(top());
    for (const Hierarchy& model : models) append(model);
    return all;
}

// One kernel for both engines: the library's calls, or GL_EXT_ray_query's.
constexpr const char* query_source = R"(
#if DRIVER
layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;
#define QUERY rayQueryEXT
#define START(q, f, m, o, t0, d, t1) rayQueryInitializeEXT(q, scene, f, m, o, t0, d, t1)
#define PROCEED rayQueryProceedEXT
#define CONFIRM rayQueryConfirmIntersectionEXT
#define GENERATE rayQueryGenerateIntersectionEXT
#define TERMINATE rayQueryTerminateEXT
#define TYPE rayQueryGetIntersectionTypeEXT
#define DISTANCE rayQueryGetIntersectionTEXT
#define PRIMITIVE rayQueryGetIntersectionPrimitiveIndexEXT
#define GEOMETRY rayQueryGetIntersectionGeometryIndexEXT
#define INSTANCE rayQueryGetIntersectionInstanceIdEXT
#define CUSTOM rayQueryGetIntersectionInstanceCustomIndexEXT
#define OFFSET rayQueryGetIntersectionInstanceShaderBindingTableRecordOffsetEXT
#define BARYCENTRICS rayQueryGetIntersectionBarycentricsEXT
#define FRONT rayQueryGetIntersectionFrontFaceEXT
#define OBJECT_ORIGIN rayQueryGetIntersectionObjectRayOriginEXT
#define OBJECT_DIRECTION rayQueryGetIntersectionObjectRayDirectionEXT
#define TO_WORLD rayQueryGetIntersectionObjectToWorldEXT
#define TO_OBJECT rayQueryGetIntersectionWorldToObjectEXT
#else
#include <glint/tracing/query.h>
#define QUERY GlintQuery
#define START(q, f, m, o, t0, d, t1) glintQueryInitialize(q, 0u, 0u, f, m, o, t0, d, t1)
#define PROCEED glintQueryProceed
#define CONFIRM glintQueryConfirm
#define GENERATE glintQueryGenerate
#define TERMINATE glintQueryTerminate
#define TYPE glintQueryType
#define DISTANCE glintQueryT
#define PRIMITIVE glintQueryPrimitiveIndex
#define GEOMETRY glintQueryGeometryIndex
#define INSTANCE glintQueryInstanceId
#define CUSTOM glintQueryInstanceCustomIndex
#define OFFSET glintQueryInstanceOffset
#define BARYCENTRICS glintQueryBarycentrics
#define FRONT glintQueryFrontFace
#define OBJECT_ORIGIN glintQueryObjectRayOrigin
#define OBJECT_DIRECTION glintQueryObjectRayDirection
#define TO_WORLD glintQueryObjectToWorld
#define TO_OBJECT glintQueryWorldToObject
#endif

layout(local_size_x = 32) in;
struct Ray { vec3 origin; float t_min; vec3 direction; float t_max; };
struct Hit {
    uint type, primitive, geometry, instance;
    uint custom, offset, front, candidates;
    vec2 barycentrics; float t, unused;
    vec3 object_origin; float matrices;
    vec3 object_direction; float other;
};
layout(set = 0, binding = 1) uniform Parameters { uint ray_count, flags, mask, policy; };
layout(set = 0, binding = 2) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 3) writeonly buffer Hits { Hit hits[]; };

void main() {
    const uint index = gl_GlobalInvocationID.x;
    if (index >= ray_count) return;
    const Ray ray = rays[index];
    QUERY q;
    START(q, flags, mask, ray.origin, ray.t_min, ray.direction, ray.t_max);
    uint candidates = 0u;
    while (PROCEED(q)) {
        const uint id = uint(PRIMITIVE(q, false)) * 64u + uint(INSTANCE(q, false));
        if (uint(TYPE(q, false)) == 1u) {
            // A ball in the unit box around the origin, in object space.
            const vec3 o = OBJECT_ORIGIN(q, false);
            const vec3 d = OBJECT_DIRECTION(q, false);
            const float b = dot(o, d) / dot(d, d);
            const float rest = b * b - (dot(o, o) - 0.25) / dot(d, d);
            const float t = -b - sqrt(max(rest, 0.0));
            const float end = uint(TYPE(q, true)) == 0u ? ray.t_max : DISTANCE(q, true);
            if (rest > 0.0 && t > ray.t_min && t < end) GENERATE(q, t);
        } else {
            // Policy 1 takes every other triangle; policy 2 none, so that all that there are have to be seen.
            if (policy == 2u) candidates += id * 2654435761u;
            if (policy == 0u || (policy == 1u && (PRIMITIVE(q, false) & 1) == 0)) CONFIRM(q);
            if (policy == 3u) { CONFIRM(q); TERMINATE(q); }
        }
    }
    Hit hit;
    hit.type = uint(TYPE(q, true));
    hit.candidates = candidates;
    hit.primitive = hit.geometry = hit.instance = hit.custom = hit.offset = hit.front = 0u;
    hit.barycentrics = vec2(0.0);
    hit.object_origin = hit.object_direction = vec3(0.0);
    hit.t = hit.unused = hit.matrices = hit.other = 0.0;
    if (hit.type != 0u) {
        hit.primitive = uint(PRIMITIVE(q, true));
        hit.geometry = uint(GEOMETRY(q, true));
        hit.instance = uint(INSTANCE(q, true));
        hit.custom = uint(CUSTOM(q, true));
        hit.offset = uint(OFFSET(q, true));
        hit.t = DISTANCE(q, true);
        hit.object_origin = OBJECT_ORIGIN(q, true);
        hit.object_direction = OBJECT_DIRECTION(q, true);
        const mat4x3 to_world = TO_WORLD(q, true);
        const mat4x3 to_object = TO_OBJECT(q, true);
        hit.matrices = dot(to_world[0], vec3(1, 2, 3)) + dot(to_world[3], vec3(4, 5, 6));
        hit.other = dot(to_object[1], vec3(1, 2, 3)) + dot(to_object[3], vec3(4, 5, 6));
    }
    if (hit.type == 1u) {
        hit.barycentrics = BARYCENTRICS(q, true);
        hit.front = FRONT(q, true) ? 1u : 0u;
    }
    hits[index] = hit;
}
)";

struct QueryHit {
    uint32_t type, primitive, geometry, instance;
    uint32_t custom, offset, front, candidates;
    Vector2f barycentrics;
    float t, unused;
    Vector3f object_origin;
    float matrices;
    Vector3f object_direction;
    float other;
};

std::string describe(size_t ray, const QueryHit& hit) {
    return fmt::format(
        "ray {}: type {} primitive {} geometry {} instance {} custom {} offset {} front {} candidates {} "
        "barycentrics {} {} t {} origin {} {} {} direction {} {} {} matrices {} {}\n",
        ray, hit.type, hit.primitive, hit.geometry, hit.instance, hit.custom, hit.offset, hit.front, hit.candidates,
        hit.barycentrics.x, hit.barycentrics.y, hit.t, hit.object_origin.x, hit.object_origin.y, hit.object_origin.z,
        hit.object_direction.x, hit.object_direction.y, hit.object_direction.z, hit.matrices, hit.other);
}

bool near(const Vector3f& a, const Vector3f& b, float bound) { return glm::length(a - b) <= bound; }

TEST_P(TracingTraversal, QueriesAsTheDriverDoes) {
    GLINT_NEED_FEATURE(FeatureComputeTracing);
    const Mesh meshes[] = {createTorus(0.4f, 0.15f, 16, 8), createSphere(0.5f, 1)};
    const float box[6] = {-0.5f, -0.5f, -0.5f, 0.5f, 0.5f, 0.5f};

    // Three models: opaque, not opaque, a box; in both engines.
    std::vector<Hierarchy> models;
    std::vector<Tracing> driver_models;
    std::vector<Buffer> kept;
    for (uint32_t i = 0; i < 2; i++) {
        models.push_back(buildMesh(meshes[i], BuildMode::Quality, i == 0));
        kept.push_back(device.createBuffer(Buffer::FlagTracing, std::span(meshes[i].positions)));
        kept.push_back(device.createBuffer(Buffer::FlagTracing, std::span(meshes[i].indices)));
        Tracing tracing = device.createTracing();
        tracing.addVertexBuffer(static_cast<uint32_t>(meshes[i].positions.size()), FormatRGBf32, 12, kept[2 * i]);
        tracing.addIndexBuffer(static_cast<uint32_t>(meshes[i].indices.size()), FormatRu32, kept[2 * i + 1]);
        ASSERT_TRUE(tracing.create(Tracing::TypeTriangle, i == 0 ? Tracing::FlagNone : Tracing::FlagTransparent));
        driver_models.push_back(tracing);
    }
    BoxGeometry boxes;
    boxes.boxes = reinterpret_cast<const std::byte*>(box);
    boxes.count = 1;
    boxes.opaque = false;
    models.push_back(
        std::move(*buildHierarchy(std::span<const BoxGeometry>(&boxes, 1), BuildMode::Quality, nullptr, GetParam())));
    kept.push_back(device.createBuffer(Buffer::FlagTracing, std::span(box)));
    Tracing box_tracing = device.createTracing();
    box_tracing.addBoundBuffer(1, 24, kept.back());
    ASSERT_TRUE(box_tracing.create(Tracing::TypeBound, Tracing::FlagTransparent));
    driver_models.push_back(box_tracing);

    // Instances turned, stretched and mirrored, with all flags.
    Random random(23);
    std::vector<Tracing::Instance> driver_instances;
    std::vector<HierarchyInstance> instances;
    for (uint32_t i = 0; i < 60; i++) {
        const uint32_t model = i % 3;
        const auto angle = [&] { return static_cast<float>(random.uniform(0.0, 360.0)); };
        const auto place = [&] { return static_cast<float>(random.uniform(-1.5, 1.5)); };
        const Vector3f size(static_cast<float>(random.uniform(0.3, 1.5)), static_cast<float>(random.uniform(0.3, 1.5)),
                            i % 4 == 0 ? -0.7f : 0.7f);
        HierarchyInstance instance;
        const Vector3f where(place(), place(), place());
        instance.transform = Transform3x4(translate(where) * rotateX(angle()) * rotateY(angle()) * scale(size));
        instance.texel = model;
        instance.custom_index = 1000 + i;
        instance.mask = 1u << i % 8;
        instance.offset = 7 * i;
        instance.flags = static_cast<uint32_t>(random.below(4));
        if (i % 5 == 0) instance.flags |= i % 2 == 0 ? Tracing::InstanceOpaque : Tracing::InstanceTransparent;
        instances.push_back(instance);
        Tracing::Instance other;
        std::memcpy(other.transform, instance.transform.rows.data(), sizeof(other.transform));
        other.tracing = &driver_models[model];
        other.data = instance.custom_index;
        other.mask = instance.mask;
        other.offset = instance.offset;
        other.flags = instance.flags;
        driver_instances.push_back(other);
    }
    // All of them, and one alone of each model, for which the way begins at the instance.
    struct Scene {
        std::string name;
        Tracing driver;
        Buffer texels;
        uint32_t masks = 0;
        bool is_lone = false;
    };
    std::vector<Scene> scenes;
    for (const auto& [first, count] : {std::pair(0u, 60u), std::pair(0u, 1u), std::pair(1u, 1u), std::pair(2u, 1u)}) {
        Scene& scene = scenes.emplace_back();
        scene.name = fmt::format("{} instances from {}", count, first);
        scene.driver = device.createTracing(std::span(driver_instances).subspan(first, count));
        ASSERT_TRUE(device.buildTracings({driver_models[0], driver_models[1], driver_models[2], scene.driver}));
        const std::span some = std::span(instances).subspan(first, count);
        const std::vector<Texel> all = sceneOf({some.begin(), some.end()}, models, GetParam());
        scene.texels = device.createBuffer(Buffer::FlagTexel, std::span(all));
        for (const HierarchyInstance& instance : some) scene.masks |= instance.mask;
        scene.is_lone = count == 1;
    }

    Kernel kernels[2];
    for (int i = 0; i < 2; i++) {
        kernels[i] = device.createKernel();
        kernels[i].createShaderGLSL(query_source, i == 1 ? "DRIVER=1" : "DRIVER=0;" + macros());
        ASSERT_TRUE(kernels[i].create()) << kernels[i].error().text();
    }
    std::vector<Ray> rays;
    for (uint32_t i = 0; i < 4000; i++) {
        Ray ray = rayTo(3.0 * random.direction(), 1.5 * random.direction());
        ray.t_min = i % 4 == 0 ? 0.5f : 0.0f;
        ray.t_max = i % 5 == 0 ? 1.0f : 100.0f;
        rays.push_back(ray);
    }
    const Buffer ray_buffer = device.createBuffer(Buffer::FlagStorage, std::span(rays));

    struct Case {
        uint32_t flags, mask, policy;
    };
    std::vector<Case> cases;
    for (const uint32_t flags : {0u, 1u, 2u, 16u, 32u, 64u, 128u, 256u, 512u, 16u | 2u, 32u | 64u})
        for (const uint32_t policy : {0u, 1u}) cases.push_back({flags, 0xff, policy});
    // Nothing may be committed on the way: that would end the ray, and what is seen before depends on the order.
    for (const uint32_t flags : {2u | 512u, 2u | 16u | 512u}) cases.push_back({flags, 0xff, 2});
    cases.push_back({0, 0x15, 1});
    cases.push_back({0, 0, 0});
    cases.push_back({4, 0xff, 0});  // ends at the first hit, whichever that is: only whether there is one
    cases.push_back({2, 0xff, 3});
    uint32_t lone_met = 0;
    const auto compare = [&](const Scene& scene, const Case& each) {
        SCOPED_TRACE(fmt::format("{}: flags {} mask {} policy {}", scene.name, each.flags, each.mask, each.policy));
        std::vector<QueryHit> results[2];
        for (int i = 0; i < 2; i++) {
            const Buffer hits = device.createBuffer(Buffer::FlagStorage, rays.size() * sizeof(QueryHit));
            Compute compute = device.createCompute();
            compute.setKernel(kernels[i]);
            compute.setUniform(
                0, std::array<uint32_t, 4>{static_cast<uint32_t>(rays.size()), each.flags, each.mask, each.policy});
            if (i == 1)
                compute.setTracing(0, scene.driver);
            else
                compute.setTexelBuffer(0, scene.texels, FormatRGBAu32);
            compute.setStorageBuffers(0, {ray_buffer, hits});
            compute.dispatch(static_cast<uint32_t>(rays.size()));
            ASSERT_TRUE(device.submit(compute));
            results[i] = *device.read<QueryHit>(hits);
        }
        // The driver's triangle test is another one: rays through edges may go either way. One in a thousand, at least.
        uint32_t differ = 0;
        uint32_t met = 0;
        std::string detail;
        for (size_t i = 0; i < rays.size(); i++) {
            const QueryHit& ours = results[0][i];
            const QueryHit& theirs = results[1][i];
            met += theirs.type != 0 || theirs.candidates != 0 ? 1 : 0;
            bool same = ours.type == theirs.type || (each.policy == 3 && (ours.type != 0) == (theirs.type != 0));
            const bool any_hit = each.flags == 4 || each.policy == 3;
            if (each.flags == 4) same = (ours.type != 0) == (theirs.type != 0);
            if (same && !any_hit && ours.type != 0) {
                same = ours.instance == theirs.instance && ours.primitive == theirs.primitive &&
                       ours.geometry == theirs.geometry && ours.custom == theirs.custom &&
                       ours.offset == theirs.offset && ours.front == theirs.front &&
                       std::abs(ours.t - theirs.t) < 1e-4f &&
                       glm::length(ours.barycentrics - theirs.barycentrics) < 1e-2f &&
                       near(ours.object_origin, theirs.object_origin, 1e-4f) &&
                       near(ours.object_direction, theirs.object_direction, 1e-4f) &&
                       std::abs(ours.matrices - theirs.matrices) < 1e-4f && std::abs(ours.other - theirs.other) < 1e-3f;
            }
            same = same && ours.candidates == theirs.candidates;
            differ += same ? 0 : 1;
            if (!same && differ <= 5) detail += describe(i, ours) + describe(i, theirs);
        }
        EXPECT_LE(differ, rays.size() / 1000) << detail;
        const bool is_seen = (each.mask & scene.masks) != 0;
        EXPECT_TRUE(is_seen || met == 0) << met;
        EXPECT_TRUE(scene.is_lone || !is_seen || met > 100) << met;
        lone_met += scene.is_lone ? met : 0;
    };
    for (const Scene& scene : scenes)
        for (const Case& each : cases) ASSERT_NO_FATAL_FAILURE(compare(scene, each));
    EXPECT_GT(lone_met, 1000u);
}

TEST_P(TracingTraversal, TracesInstancesInBatches) {
    const float box[6] = {-0.5f, -0.5f, -0.5f, 0.5f, 0.5f, 0.5f};
    BoxGeometry boxes;
    boxes.boxes = reinterpret_cast<const std::byte*>(box);
    boxes.count = 1;
    std::vector<Hierarchy> models;
    models.push_back(buildMesh(createTorus(0.4f, 0.15f, 16, 8)));
    models.push_back(buildMesh(createSphere(0.5f, 1)));
    models.push_back(
        std::move(*buildHierarchy(std::span<const BoxGeometry>(&boxes, 1), BuildMode::Quality, nullptr, GetParam())));

    // Turned, stretched, mirrored and flipped; some cannot be seen, some are twice in the same place.
    Random random(24);
    std::vector<HierarchyInstance> instances;
    for (uint32_t i = 0; i < 200; i++) {
        const auto at = [&](double most) { return static_cast<float>(random.uniform(-most, most)); };
        HierarchyInstance instance;
        const Matrix4x4f turn = rotateX(at(180.0)) * rotateY(at(180.0));
        const Vector3f size(0.6f + at(0.5), 0.6f + at(0.5), i % 4 == 0 ? -0.7f : 0.7f);
        instance.transform = Transform3x4(translate(Vector3f(at(2.0), at(2.0), at(2.0))) * turn * scale(size));
        instance.texel = i % 3;
        instance.mask = i % 7 == 0 ? 0u : 1u << i % 8;
        if (i % 5 == 0) instance.flags = Tracing::InstanceFlipFacing;
        instances.push_back(instance);
        if (i % 9 == 0) instances.push_back(instance);
    }
    const std::vector<Texel> scene = sceneOf(instances, models, GetParam());
    std::vector<Ray> rays;
    for (uint32_t i = 0; i < 3001; i++) {
        Ray ray = rayTo(4.0 * random.direction(), 2.0 * random.direction());
        ray.t_min = i % 4 == 0 ? 0.5f : 0.0f;
        if (i % 5 == 0) ray.t_max = 1.0f;
        rays.push_back(ray);
    }

    // What a query finds that sees all masks and takes all triangles.
    Kernel kernel = device.createKernel();
    kernel.createShaderGLSL(query_source, "DRIVER=0;" + macros());
    ASSERT_TRUE(kernel.create()) << kernel.error().text();
    const Buffer texels = device.createBuffer(Buffer::FlagTexel, std::span(scene));
    const Buffer ray_buffer = device.createBuffer(Buffer::FlagStorage, std::span(rays));
    const Buffer hits = device.createBuffer(Buffer::FlagStorage, rays.size() * sizeof(QueryHit));
    Compute compute = device.createCompute();
    compute.setKernel(kernel);
    constexpr uint32_t opaque_without_boxes = 1 | 512;
    compute.setUniform(0, std::array<uint32_t, 4>{static_cast<uint32_t>(rays.size()), opaque_without_boxes, 0xff, 0});
    compute.setTexelBuffer(0, texels, FormatRGBAu32);
    compute.setStorageBuffers(0, {ray_buffer, hits});
    compute.dispatch(static_cast<uint32_t>(rays.size()));
    ASSERT_TRUE(device.submit(compute));
    const std::vector<QueryHit> expected = *device.read<QueryHit>(hits);

    const std::vector<RayHit> found = trace(scene, rays, 2, false);
    ASSERT_EQ(found.size(), expected.size());
    uint32_t met = 0;
    uint32_t twice = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        const RayHit& hit = found[i];
        ASSERT_EQ(hit.isHit(), expected[i].type != 0) << "ray " << i;
        if (!hit.isHit()) continue;
        met++;
        twice += hit.instance + 1 < instances.size() &&
                         instances[hit.instance].transform == instances[hit.instance + 1].transform
                     ? 1
                     : 0;
        // The same arithmetic, so the same bits.
        ASSERT_EQ(hit.instance, expected[i].instance) << "ray " << i;
        ASSERT_EQ(hit.primitive, expected[i].primitive) << "ray " << i;
        ASSERT_EQ(hit.t, expected[i].t) << "ray " << i;
        ASSERT_EQ(Vector2f(hit.u, hit.v), expected[i].barycentrics) << "ray " << i;
        ASSERT_EQ(hit.front, expected[i].front) << "ray " << i;
    }
    EXPECT_GT(met, rays.size() / 4);
    EXPECT_GT(twice, 20u);
    EXPECT_FALSE(trace(sceneOf({}, {}, GetParam()), {rays[0]}, 2, false)[0].isHit());
}

INSTANTIATE_TEST_SUITE_P(Nodes, TracingTraversal, ::testing::Values(NodeForm::Packed, NodeForm::Full),
                         [](const auto& each) { return each.param == NodeForm::Packed ? "Packed" : "Full"; });

}  // namespace

}  // namespace glint::test
