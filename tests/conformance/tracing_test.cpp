#include "conformance/conformance.h"
#include "support/reference.h"

#include <glint/geometry/primitives.h>

#include <numeric>

namespace glint::test {

namespace {

struct Ray {
    float origin[3];
    uint32_t mask;
    float direction[3];
    float maximum;
};

struct Hit {
    uint32_t kind;  ///< 0 nothing, 1 triangle, 2 box
    uint32_t instance;
    uint32_t data;
    uint32_t geometry;
    uint32_t primitive;
    float t;
    float barycentrics[2];
};

enum RayFlag : uint32_t {
    RayNone = 0,
    RayOpaque = 1,
    RayTransparent = 2,
    RayFirst = 4,
    RayCullBack = 16,
    RayCullFront = 32
};

constexpr const char* query_source = R"(
struct Ray { vec3 origin; uint mask; vec3 direction; float maximum; };
struct Hit { uint kind, instance, data, geometry, primitive; float t; vec2 barycentrics; };
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1, std430) readonly buffer Rays { Ray rays[]; };
layout(binding = 2, std430) writeonly buffer Hits { Hit hits[]; };
layout(binding = 3, std430) readonly buffer Boxes { float boxes[]; };
layout(push_constant) uniform Push { uint count; uint flags; uint confirm; };

float enterBox(vec3 origin, vec3 direction, uint box) {
    vec3 a = (vec3(boxes[box * 6u], boxes[box * 6u + 1u], boxes[box * 6u + 2u]) - origin) / direction;
    vec3 b = (vec3(boxes[box * 6u + 3u], boxes[box * 6u + 4u], boxes[box * 6u + 5u]) - origin) / direction;
    vec3 near = min(a, b), far = max(a, b);
    float enter = max(max(near.x, near.y), max(near.z, 0.0));
    float leave = min(min(far.x, far.y), far.z);
    return enter <= leave ? enter : -1.0;
}

Hit trace(Ray ray) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, flags, ray.mask, ray.origin, 0.0, ray.direction, ray.maximum);
    while (rayQueryProceedEXT(query)) {
        if (rayQueryGetIntersectionTypeEXT(query, false) == gl_RayQueryCandidateIntersectionTriangleEXT) {
            if (confirm != 0u) rayQueryConfirmIntersectionEXT(query);
        } else {
            float t = enterBox(rayQueryGetIntersectionObjectRayOriginEXT(query, false),
                               rayQueryGetIntersectionObjectRayDirectionEXT(query, false),
                               uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, false)));
            if (t >= 0.0) rayQueryGenerateIntersectionEXT(query, t);
        }
    }
    Hit hit = Hit(rayQueryGetIntersectionTypeEXT(query, true), 0u, 0u, 0u, 0u, 0.0, vec2(0.0));
    if (hit.kind == gl_RayQueryCommittedIntersectionNoneEXT) return hit;
    hit.instance = uint(rayQueryGetIntersectionInstanceIdEXT(query, true));
    hit.data = uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, true));
    hit.geometry = uint(rayQueryGetIntersectionGeometryIndexEXT(query, true));
    hit.primitive = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true));
    hit.t = rayQueryGetIntersectionTEXT(query, true);
    if (hit.kind == gl_RayQueryCommittedIntersectionTriangleEXT)
        hit.barycentrics = rayQueryGetIntersectionBarycentricsEXT(query, true);
    return hit;
}
)";

const std::string query_kernel = std::string("layout(local_size_x = 64) in;\n") + query_source + R"(
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < count) hits[i] = trace(rays[i]);
})";

/// What the scene is, for the float64 reference.
struct ReferenceInstance {
    std::vector<const Mesh*> geometries;
    Matrix4x4f transform = Matrix4x4f(1.0f);
    uint32_t mask = 0xff;
};

struct Expected64 {
    bool hit = false;
    double t = 1e300;
    uint32_t instance = 0, geometry = 0, primitive = 0;
    Vector2d barycentrics;
};

Expected64 reference(const std::vector<ReferenceInstance>& scene, const Ray& ray) {
    Expected64 best;
    for (uint32_t i = 0; i < scene.size(); i++) {
        if (!(scene[i].mask & ray.mask)) continue;
        const Matrix4x4d inverse = glm::inverse(Matrix4x4d(scene[i].transform));
        const Vector3d origin(inverse * Vector4d(ray.origin[0], ray.origin[1], ray.origin[2], 1));
        const Vector3d direction(inverse * Vector4d(ray.direction[0], ray.direction[1], ray.direction[2], 0));
        for (uint32_t g = 0; g < scene[i].geometries.size(); g++) {
            const ReferenceHit hit = closestHit(*scene[i].geometries[g], origin, direction, 0.0, ray.maximum);
            if (hit.hit && hit.t < best.t) best = {true, hit.t, i, g, hit.triangle, hit.barycentrics};
        }
    }
    return best;
}

bool nearEdge(double u, double v) { return std::min({u, v, 1 - u - v}) < 1e-3; }

class TracingTest : public ConformanceTest {
protected:
    void SetUp() override {
        ConformanceTest::SetUp();
        GLINT_NEED_FEATURE(FeatureComputeTracing);
    }

    Buffer input(const void* data, size_t size) {
        return device.createBuffer(Buffer::FlagTracing | Buffer::FlagStorage, data, size, "input");
    }

    /// A structure of these meshes, one geometry each; every second one without indices, 16-bit indices where they fit.
    Tracing bottom(const std::vector<const Mesh*>& meshes, Tracing::Flags flags = Tracing::FlagFastTrace) {
        Tracing tracing = device.createTracing("bottom");
        bool flat = false;
        for (const Mesh* mesh : meshes) {
            if (flat) {
                std::vector<Vector3f> corners;
                corners.reserve(mesh->indices.size());
                for (const uint32_t index : mesh->indices) corners.push_back(mesh->positions[index]);
                tracing.addVertexBuffer(static_cast<uint32_t>(corners.size()), FormatRGBf32, 12,
                                        input(corners.data(), corners.size() * 12));
            } else {
                // Positions are spread, to see that the stride is minded.
                std::vector<Vector4f> spread;
                spread.reserve(mesh->positions.size());
                for (const Vector3f& position : mesh->positions) spread.push_back(Vector4f(position, 7.0f));
                tracing.addVertexBuffer(static_cast<uint32_t>(spread.size()), FormatRGBf32, 16,
                                        input(spread.data(), spread.size() * 16));
                const auto count = static_cast<uint32_t>(mesh->indices.size());
                if (mesh->positions.size() <= 65536) {
                    const std::vector<uint16_t> small(mesh->indices.begin(), mesh->indices.end());
                    tracing.addIndexBuffer(count, FormatRu16, input(small.data(), count * 2));
                } else {
                    tracing.addIndexBuffer(count, FormatRu32, input(mesh->indices.data(), count * 4));
                }
            }
            flat = !flat;
        }
        EXPECT_THAT(tracing.create(Tracing::TypeTriangle, flags), IsOk());
        return tracing;
    }

    static Tracing::Instance instance(const Tracing& tracing, const Matrix4x4f& transform = Matrix4x4f(1.0f)) {
        Tracing::Instance result;
        result.tracing = &tracing;
        const Transform3x4 rows(transform);
        std::copy(rows.rows.begin(), rows.rows.end(), result.transform);
        return result;
    }

    std::vector<Hit> trace(const Tracing& scene, const std::vector<Ray>& rays, uint32_t flags = RayNone,
                           bool confirm = true, const std::vector<float>& boxes = {0}) {
        const Buffer ray_buffer = makeBuffer(rays);
        const Buffer hits = device.createBuffer(Buffer::FlagStorage, rays.size() * sizeof(Hit));
        const Buffer box_buffer = makeBuffer(boxes);
        compute([&](Compute& list) {
            if (!kernel) kernel = makeKernel(query_kernel);
            list.setKernel(kernel);
            list.setTracing(0, scene);
            list.setStorageBuffers(0, {ray_buffer, hits, box_buffer});
            list.setPushConstants(
                std::array<uint32_t, 3>{static_cast<uint32_t>(rays.size()), flags, confirm ? 1u : 0u});
            list.dispatch(rays.size());
        });
        return read<Hit>(hits);
    }
    void TearDown() override {
        kernel = {};
        ConformanceTest::TearDown();
    }

    /// Rays from a sphere of this radius to points near the origin.
    static std::vector<Ray> rays(uint32_t count, float radius = 8, float spread = 2) {
        Random random(count);
        std::vector<Ray> result;
        for (uint32_t i = 0; i < count; i++) {
            const Vector3d origin = random.direction() * static_cast<double>(radius);
            const Vector3d aim = random.direction() * random.uniform(0, spread);
            const Vector3f from(origin);
            const Vector3f to = Vector3f(aim - origin) * 0.37f;
            result.push_back({{from.x, from.y, from.z}, 0xff, {to.x, to.y, to.z}, 1000});
        }
        return result;
    }

    void expectAgreement(const std::vector<Hit>& hits, const std::vector<ReferenceInstance>& scene,
                         const std::vector<Ray>& cast) {
        size_t found = 0, edges = 0;
        ASSERT_EQ(hits.size(), cast.size());
        for (size_t i = 0; i < cast.size(); i++) {
            const Expected64 expected = reference(scene, cast[i]);
            const Hit& hit = hits[i];
            found += expected.hit;
            const bool same =
                (hit.kind == 1) == expected.hit &&
                (!expected.hit || (hit.instance == expected.instance && hit.geometry == expected.geometry &&
                                   hit.primitive == expected.primitive));
            if (!same) {
                // Rounding may move a ray over an edge, and nowhere else.
                const bool edge = (expected.hit && nearEdge(expected.barycentrics.x, expected.barycentrics.y)) ||
                                  (hit.kind == 1 && nearEdge(hit.barycentrics[0], hit.barycentrics[1]));
                EXPECT_TRUE(edge) << "ray " << i << ": kind " << hit.kind << ", instance " << hit.instance
                                  << ", primitive " << hit.primitive << " at " << hit.t << "; expected " << expected.hit
                                  << ", " << expected.instance << ", " << expected.primitive << " at " << expected.t;
                edges++;
            } else if (expected.hit) {
                EXPECT_NEAR(hit.t, expected.t, 1e-4 * (1 + expected.t)) << i;
                EXPECT_NEAR(hit.barycentrics[0], expected.barycentrics.x, 5e-3) << i;
                EXPECT_NEAR(hit.barycentrics[1], expected.barycentrics.y, 5e-3) << i;
            }
        }
        EXPECT_GT(found, cast.size() / 10);
        EXPECT_LE(edges, cast.size() / 50);
    }

    const Mesh sphere = createSphere(1.5f, 2);
    const Mesh torus = createTorus(1.2f, 0.4f, 12, 8);
    const Mesh box = createBox(Vector3f(1.5f, 0.8f, 2.5f));
    Kernel kernel;
};

constexpr Tracing::Flags build_flags[] = {Tracing::FlagNone, Tracing::FlagFastBuild, Tracing::FlagFastTrace,
                                          Tracing::FlagUpdate | Tracing::FlagFastTrace,
                                          Tracing::FlagCompact | Tracing::FlagFastTrace};

}  // namespace

TEST_F(TracingTest, KnowsItsProperties) {
    const Tracing tracing = bottom({&sphere, &box});
    EXPECT_EQ(tracing.getType(), Tracing::TypeTriangle);
    EXPECT_EQ(tracing.getGeometries(), 2u);
    EXPECT_EQ(tracing.getPrimitives(), 320u + 12u);
    EXPECT_GT(tracing.getBuildSize(), 0u);
    EXPECT_GT(tracing.getMemory(), 0u);
    const Tracing null;
    EXPECT_EQ(null.getGeometries() + null.getPrimitives() + null.getBuildSize() + null.getUpdateSize() +
                  null.getMemory(),
              0u);
    device.buildTracing(tracing);
}

TEST_F(TracingTest, SeveralGeometriesWithEveryFlag) {
    const std::vector<Ray> cast = rays(300);
    for (const Tracing::Flags flags : build_flags) {
        SCOPED_TRACE(flags);
        const Tracing meshes = bottom({&torus, &box}, flags);
        const Tracing scene = device.createTracing({instance(meshes)});
        EXPECT_THAT(device.buildTracings({meshes, scene}), IsOk());
        expectAgreement(trace(scene, cast), {{{&torus, &box}}}, cast);
    }
}

TEST_F(TracingTest, InstancesWithTransformsMasksAndData) {
    const Tracing ball = bottom({&sphere}), block = bottom({&box}), ring = bottom({&torus});
    const std::vector<Matrix4x4f> transforms = {
        translate({-1.5f, 0.5f, 0}) * rotateX(30),
        translate({1.2f, 0, 0.3f}) * rotateZ(50) * scale({0.5f, 1.5f, 0.7f}),
        translate({0, 1.4f, -0.5f}) * scale({-1, 1, 1}) * rotateY(20),  // mirrored
        rotateX(77) * scale({0.3f, 0.3f, 0.3f}),
    };
    std::vector<Tracing::Instance> instances = {instance(ball, transforms[0]), instance(block, transforms[1]),
                                                instance(ring, transforms[2]), instance(ball, transforms[3])};
    std::vector<ReferenceInstance> expected = {
        {{&sphere}, transforms[0]}, {{&box}, transforms[1]}, {{&torus}, transforms[2]}, {{&sphere}, transforms[3]}};
    const uint32_t masks[] = {1, 2, 4, 0xff};
    for (size_t i = 0; i < 4; i++) {
        instances[i].data = static_cast<uint32_t>(0xfffff0 + i);
        instances[i].mask = expected[i].mask = masks[i];
    }
    const Tracing scene = device.createTracing(std::span<const Tracing::Instance>(instances));
    EXPECT_THAT(device.buildTracings({scene, ball, block, ring}), IsOk());
    std::vector<Ray> cast = rays(600);
    for (size_t i = 0; i < cast.size(); i++) cast[i].mask = i % 3 == 0 ? 0xff : i % 3 == 1 ? 3 : 4;
    const std::vector<Hit> hits = trace(scene, cast);
    expectAgreement(hits, expected, cast);
    for (const Hit& hit : hits)
        if (hit.kind) { EXPECT_EQ(hit.data, 0xfffff0 + hit.instance); }
}

TEST_F(TracingTest, Boxes) {
    Random random(5);
    std::vector<float> bounds;
    for (int i = 0; i < 50; i++) {
        float low[3], high[3];
        for (int axis = 0; axis < 3; axis++) {
            low[axis] = static_cast<float>(random.uniform(-3, 2.5));
            high[axis] = low[axis] + static_cast<float>(random.uniform(0.1, 0.8));
        }
        bounds.insert(bounds.end(), low, low + 3);
        bounds.insert(bounds.end(), high, high + 3);
    }
    Tracing boxes = device.createTracing("boxes");
    boxes.addBoundBuffer(50, 24, input(bounds.data(), bounds.size() * 4));
    ASSERT_THAT(boxes.create(Tracing::TypeBound), IsOk());
    EXPECT_EQ(boxes.getPrimitives(), 50u);
    const Tracing scene = device.createTracing({instance(boxes)});
    EXPECT_THAT(device.buildTracings({boxes, scene}), IsOk());
    const std::vector<Ray> cast = rays(400);
    const std::vector<Hit> hits = trace(scene, cast, RayNone, true, bounds);
    size_t found = 0;
    for (size_t i = 0; i < cast.size(); i++) {
        double best = 1e300, margin = 1e300;
        for (size_t b = 0; b < 50; b++) {
            double enter = 0, leave = 1e300;
            for (size_t axis = 0; axis < 3; axis++) {
                const double origin = cast[i].origin[axis], direction = cast[i].direction[axis];
                const double first = (bounds[b * 6 + axis] - origin) / direction;
                const double second = (bounds[b * 6 + 3 + axis] - origin) / direction;
                enter = std::max(enter, std::min(first, second));
                leave = std::min(leave, std::max(first, second));
            }
            margin = std::min(margin, std::abs(enter - leave));
            if (enter <= leave) best = std::min(best, enter);
        }
        if (margin < 1e-4) continue;  // it grazes a box
        found += best < 1e300;
        EXPECT_EQ(hits[i].kind, best < 1e300 ? 2u : 0u) << i;
        if (hits[i].kind) { EXPECT_NEAR(hits[i].t, best, 1e-4) << i; }
    }
    EXPECT_GT(found, 50u);
}

TEST_F(TracingTest, TransparentGeometriesAreCandidates) {
    const std::vector<Ray> cast = rays(200);
    const Tracing meshes = bottom({&sphere}, Tracing::FlagTransparent);
    const Tracing opaque = bottom({&sphere});
    const Tracing scene = device.createTracing({instance(meshes)});
    Tracing::Instance forced = instance(meshes);
    forced.flags = Tracing::InstanceOpaque;
    const Tracing forced_opaque = device.createTracing({forced});
    Tracing::Instance unforced = instance(opaque);
    unforced.flags = Tracing::InstanceTransparent;
    const Tracing forced_transparent = device.createTracing({unforced});
    EXPECT_THAT(device.buildTracings({meshes, opaque, scene, forced_opaque, forced_transparent}), IsOk());
    const auto found = [&](const Tracing& tracing, uint32_t flags, bool confirm) {
        const std::vector<Hit> hits = trace(tracing, cast, flags, confirm);
        return std::count_if(hits.begin(), hits.end(), [](const Hit& hit) { return hit.kind != 0; });
    };
    const auto all = found(scene, RayNone, true);
    EXPECT_GT(all, 20);
    EXPECT_EQ(found(scene, RayNone, false), 0);
    EXPECT_EQ(found(scene, RayOpaque, false), all);
    EXPECT_EQ(found(forced_opaque, RayNone, false), all);
    EXPECT_EQ(found(forced_transparent, RayNone, false), 0);
    EXPECT_EQ(found(forced_transparent, RayNone, true), all);
    EXPECT_EQ(found(forced_opaque, RayTransparent, false), 0);
    expectAgreement(trace(scene, cast), {{{&sphere}}}, cast);
}

TEST_F(TracingTest, FirstHitIsSomeHit) {
    const std::vector<Ray> cast = rays(300);
    const Tracing meshes = bottom({&torus});
    const Tracing scene = device.createTracing({instance(meshes)});
    EXPECT_THAT(device.buildTracings({meshes, scene}), IsOk());
    const std::vector<Hit> closest = trace(scene, cast), first = trace(scene, cast, RayFirst);
    for (size_t i = 0; i < cast.size(); i++) {
        EXPECT_EQ(first[i].kind, closest[i].kind) << i;
        if (first[i].kind) { EXPECT_GE(first[i].t, closest[i].t - 1e-4f); }
    }
}

TEST_F(TracingTest, FacingIsThatOfTheObject) {
    // Counter-clockwise seen from +Z, where the first ray comes from: its front.
    Mesh facing;
    facing.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
    facing.indices = {0, 1, 2};
    const Tracing triangle = bottom({&facing});
    const std::vector<Ray> cast = {{{0, 0, 5}, 0xff, {0, 0, -1}, 100}, {{0, 0, -5}, 0xff, {0, 0, 1}, 100}};
    const auto kinds = [&](uint32_t instance_flags, uint32_t ray_flags, const Matrix4x4f& transform) {
        Tracing::Instance one = instance(triangle, transform);
        one.flags = instance_flags;
        const Tracing scene = device.createTracing({one});
        EXPECT_THAT(device.buildTracings({triangle, scene}), IsOk());
        const std::vector<Hit> hits = trace(scene, cast, ray_flags);
        return std::pair(hits[0].kind, hits[1].kind);
    };
    const Matrix4x4f identity(1.0f), mirrored = scale({-1, 1, 1});
    EXPECT_EQ(kinds(0, RayNone, identity), std::pair(1u, 1u));
    EXPECT_EQ(kinds(0, RayCullBack, identity), std::pair(1u, 0u));
    EXPECT_EQ(kinds(0, RayCullFront, identity), std::pair(0u, 1u));
    EXPECT_EQ(kinds(Tracing::InstanceFlipFacing, RayCullBack, identity), std::pair(0u, 1u));
    EXPECT_EQ(kinds(Tracing::InstanceCullDisable, RayCullBack, identity), std::pair(1u, 1u));
    // Facing is judged in object space: the mirrored triangle keeps its front where the object has it.
    EXPECT_EQ(kinds(0, RayCullBack, mirrored), std::pair(1u, 0u));
}

TEST_F(TracingTest, UpdatesFollowTheVertices) {
    Mesh moving = createSphere(1.0f, 2);
    const Buffer vertices = input(moving.positions.data(), moving.positions.size() * 12);
    const Buffer indices = input(moving.indices.data(), moving.indices.size() * 4);
    Tracing meshes = device.createTracing("moving");
    meshes.addVertexBuffer(static_cast<uint32_t>(moving.positions.size()), FormatRGBf32, 12, vertices);
    meshes.addIndexBuffer(static_cast<uint32_t>(moving.indices.size()), FormatRu32, indices);
    ASSERT_THAT(meshes.create(Tracing::TypeTriangle, Tracing::FlagUpdate | Tracing::FlagFastBuild), IsOk());
    EXPECT_GT(meshes.getUpdateSize(), 0u);
    Tracing scene = device.createTracing("scene");
    scene.setInstances(1);
    ASSERT_THAT(scene.create(Tracing::TypeInstance, Tracing::FlagUpdate), IsOk());
    const Tracing::Instance placed = instance(meshes);
    device.setTracing(scene, {&placed, 1});
    device.buildTracing(meshes);
    device.buildTracing(scene);
    const std::vector<Ray> cast = rays(200);
    expectAgreement(trace(scene, cast), {{{&moving}}}, cast);

    for (Vector3f& position : moving.positions)
        position = position * Vector3f(1.4f, 0.6f, 1.0f) + Vector3f(0.3f, 0, 0.2f);
    device.setBuffer(vertices, 0, moving.positions.data(), moving.positions.size() * 12);
    device.updateTracing(meshes);
    device.updateTracing(scene);
    expectAgreement(trace(scene, cast), {{{&moving}}}, cast);

    const Buffer scratch =
        device.createBuffer(Buffer::FlagScratch, std::max(meshes.getUpdateSize(), meshes.getBuildSize()));
    for (Vector3f& position : moving.positions) position *= 1.2f;
    device.setBuffer(vertices, 0, moving.positions.data(), moving.positions.size() * 12);
    device.updateTracing(meshes, scratch);
    device.buildTracing(scene);
    expectAgreement(trace(scene, cast), {{{&moving}}}, cast);
}

TEST_F(TracingTest, CompactionKeepsTheHits) {
    const std::vector<Ray> cast = rays(200);
    const Tracing ball = bottom({&sphere}, Tracing::FlagCompact | Tracing::FlagFastTrace);
    const Tracing ring = bottom({&torus}, Tracing::FlagCompact | Tracing::FlagFastTrace);
    const Matrix4x4f moved = translate({1, 1, 0});
    const Tracing scene = device.createTracing({instance(ball), instance(ring, moved)});
    const uint64_t before = ball.getMemory() + ring.getMemory();
    EXPECT_THAT(device.buildTracings({ball, ring, scene}, Tracing::FlagCompact), IsOk());
    EXPECT_LE(ball.getMemory() + ring.getMemory(), before);
    EXPECT_GT(ball.getMemory(), 0u);
    // Whoever still refers to where the structures were will find this instead.
    EXPECT_THAT(device.finish(), IsOk());
    std::vector<Buffer> rubbish;
    for (uint64_t size = 4096; size <= 1 << 18; size *= 2)
        for (int i = 0; i < 4; i++) {
            rubbish.push_back(device.createBuffer(Buffer::FlagStorage | Buffer::FlagScratch, size));
            device.clearBuffer(rubbish.back(), 0xffffffff);
        }
    EXPECT_THAT(device.finish(), IsOk());
    expectAgreement(trace(scene, cast), {{{&sphere}}, {{&torus}, moved}}, cast);
    // A top level made of compacted ones.
    const Tracing other = device.createTracing({instance(ring)});
    EXPECT_THAT(device.buildTracings({other}), IsOk());
    expectAgreement(trace(other, cast), {{{&torus}}}, cast);
}

TEST_F(TracingTest, BatchesFitTheScratchBuffer) {
    std::array<Mesh, 12> meshes;
    std::array<Tracing, 12> structures;
    std::vector<Tracing::Instance> instances;
    std::vector<ReferenceInstance> expected;
    uint64_t largest = 0;
    for (uint32_t i = 0; i < 12; i++) {
        meshes[i] = createSphere(0.3f + 0.05f * static_cast<float>(i), 1 + i % 3);
        structures[i] = bottom({&meshes[i]});
        largest = std::max(largest, structures[i].getBuildSize());
        const uint32_t column = i % 4, row = i / 4;
        const Matrix4x4f place = translate({static_cast<float>(column) - 1.5f, static_cast<float>(row) - 1.0f, 0});
        instances.push_back(instance(structures[i], place));
        expected.push_back({{&meshes[i]}, place});
    }
    const Tracing scene = device.createTracing(std::span<const Tracing::Instance>(instances));
    largest = std::max(largest, scene.getBuildSize());
    const Buffer scratch = device.createBuffer(Buffer::FlagScratch, largest, "scratch");
    std::vector<Tracing> all(structures.begin(), structures.end());
    all.push_back(scene);
    EXPECT_THAT(device.buildTracings(std::span<const Tracing>(all), scratch), IsOk());
    const std::vector<Ray> cast = rays(300);
    expectAgreement(trace(scene, cast), expected, cast);
}

TEST_F(TracingTest, InstancesComeAndGo) {
    const Tracing ball = bottom({&sphere});
    Tracing scene = device.createTracing("scene");
    scene.setInstances(3);
    ASSERT_THAT(scene.create(Tracing::TypeInstance), IsOk());
    device.buildTracing(ball);
    const std::vector<Ray> cast = rays(200);
    const auto set = [&](const std::vector<Tracing::Instance>& instances) {
        device.setTracing(scene, instances);
        device.buildTracing(scene);
    };
    set({});
    for (const Hit& hit : trace(scene, cast)) EXPECT_EQ(hit.kind, 0u);
    const Matrix4x4f left = translate({-1, 0, 0}), right = translate({1, 0, 0});
    set({instance(ball, left), instance(ball, right)});
    expectAgreement(trace(scene, cast), {{{&sphere}, left}, {{&sphere}, right}}, cast);
    // An instance of nothing is never hit, and keeps its number.
    set({Tracing::Instance{}, instance(ball, right)});
    expectAgreement(trace(scene, cast), {{{}}, {{&sphere}, right}}, cast);
    set({instance(ball, left), instance(ball, right), instance(ball)});
    expectAgreement(trace(scene, cast), {{{&sphere}, left}, {{&sphere}, right}, {{&sphere}}}, cast);
}

TEST_F(TracingTest, RefusedInstancesChangeNothing) {
    const Tracing ball = bottom({&sphere});
    Tracing scene = device.createTracing("scene");
    scene.setInstances(2);
    ASSERT_THAT(scene.create(Tracing::TypeInstance), IsOk());
    device.buildTracing(ball);
    device.setTracing(scene, std::vector{instance(ball)});
    device.buildTracing(scene);
    const std::vector<Ray> cast = rays(200);
    expectAgreement(trace(scene, cast), {{{&sphere}}}, cast);

    std::vector<Tracing::Instance> wrong(2, instance(ball, translate({1, 0, 0})));
    wrong[1].mask = 0x100;
    expectError("tracing.instance_bits", [&] {
        device.setTracing(scene, wrong);
        return device.flush();
    });
    expectAgreement(trace(scene, cast), {{{&sphere}}}, cast);
    device.buildTracing(scene);
    expectAgreement(trace(scene, cast), {{{&sphere}}}, cast);
}

TEST_F(TracingTest, BuildsOfADroppedListAreNone) {
    const Tracing ball = bottom({&sphere});
    const Tracing scene = device.createTracing({instance(ball)});
    {
        Compute dropped = device.createCompute();
        dropped.buildTracing(ball);
        dropped.buildTracing(scene);
    }
    expectError("tracing.unbuilt", [&] {
        Compute list = device.createCompute();
        list.buildTracing(scene);
        return device.submit(list);
    });
}

TEST_F(TracingTest, BuiltAndTracedInOneList) {
    Mesh moving = createSphere(1.0f, 2);
    const Buffer vertices = input(moving.positions.data(), moving.positions.size() * 12);
    const Buffer indices = input(moving.indices.data(), moving.indices.size() * 4);
    Tracing ball = device.createTracing("ball");
    ball.addVertexBuffer(static_cast<uint32_t>(moving.positions.size()), FormatRGBf32, 12, vertices);
    ball.addIndexBuffer(static_cast<uint32_t>(moving.indices.size()), FormatRu32, indices);
    ASSERT_THAT(ball.create(Tracing::TypeTriangle), IsOk());
    Tracing scene = device.createTracing("scene");
    scene.setInstances(1);
    ASSERT_THAT(scene.create(Tracing::TypeInstance), IsOk());
    const Buffer scratch =
        device.createBuffer(Buffer::FlagScratch, std::max(ball.getBuildSize(), scene.getBuildSize()));
    const Kernel move = makeKernel(R"(
        layout(local_size_x = 64) in;
        layout(binding = 0) buffer Positions { float positions[]; };
        void main() {
            uint i = gl_GlobalInvocationID.x;
            if (i < positions.length()) positions[i] *= i % 3u == 0u ? 1.5 : 0.8;
        })");
    const Kernel query = makeKernel(query_kernel);
    const std::vector<Ray> cast = rays(200);
    const Buffer ray_buffer = makeBuffer(cast);
    const Buffer hits = device.createBuffer(Buffer::FlagStorage, cast.size() * sizeof(Hit));
    const Tracing::Instance placed = instance(ball);
    const auto frame = [&] {
        compute([&](Compute& list) {
            list.setKernel(move);
            list.setStorageBuffer(0, vertices);
            list.dispatch(moving.positions.size() * 3);
            list.buildTracing(ball, scratch);
            list.setInstances(scene, {&placed, 1});
            list.buildTracing(scene, scratch);
            list.setKernel(query);
            list.setTracing(0, scene);
            list.setStorageBuffers(0, {ray_buffer, hits, vertices});
            list.setPushConstants(std::array<uint32_t, 3>{static_cast<uint32_t>(cast.size()), 0, 1});
            list.dispatch(cast.size());
        });
        for (Vector3f& position : moving.positions) position *= Vector3f(1.5f, 0.8f, 0.8f);
    };
    for (int i = 0; i < 3; i++) {
        frame();
        expectAgreement(read<Hit>(hits), {{{&moving}}}, cast);
    }
}

TEST_F(TracingTest, StructuresOfNothing) {
    Tracing nothing = device.createTracing("nothing");
    const float unused[12] = {};
    nothing.addVertexBuffer(0, FormatRGBf32, 12, input(unused, sizeof(unused)));
    ASSERT_THAT(nothing.create(Tracing::TypeTriangle), IsOk());
    const Tracing scene = device.createTracing({instance(nothing)});
    EXPECT_THAT(device.buildTracings({nothing, scene}), IsOk());
    for (const Hit& hit : trace(scene, rays(50))) EXPECT_EQ(hit.kind, 0u);
    EXPECT_THAT(device.buildTracings({}), IsOk());
}

TEST_F(TracingTest, ReferencedStructuresStayAlive) {
    Tracing scene;
    {
        const Tracing ball = bottom({&sphere});
        scene = device.createTracing({instance(ball)});
        EXPECT_THAT(device.buildTracings({ball, scene}), IsOk());
    }
    const std::vector<Ray> cast = rays(100);
    expectAgreement(trace(scene, cast), {{{&sphere}}}, cast);
}

TEST_F(TracingTest, ShortIntervals) {
    const Tracing ball = bottom({&sphere});
    const Tracing scene = device.createTracing({instance(ball)});
    EXPECT_THAT(device.buildTracings({ball, scene}), IsOk());
    std::vector<Ray> cast = rays(200);
    for (size_t i = 0; i < cast.size(); i++) cast[i].maximum = i % 2 ? 2.3f : 1e10f;
    expectAgreement(trace(scene, cast), {{{&sphere}}}, cast);
}

TEST_F(TracingTest, QueriesInFragments) {
    GLINT_NEED_FEATURE(FeatureFragmentTracing);
    const Tracing ball = bottom({&sphere}), block = bottom({&box});
    const Matrix4x4f turned = translate({1, 0.5f, 0.8f}) * rotateX(40) * rotateY(30);
    const Tracing scene = device.createTracing({instance(ball), instance(block, turned)});
    EXPECT_THAT(device.buildTracings({ball, block, scene}), IsOk());
    constexpr uint32_t size = 24;
    const Texture color = makeTexture(FormatRGBAf32, size, size);
    const Pipeline pipeline = makePipeline(cover_vertex, std::string(query_source) + R"(
        layout(location = 0) out vec4 color;
        void main() {
            vec2 p = (gl_FragCoord.xy / 24.0 * 2.0 - 1.0) * vec2(2.5, -2.5);
            Hit hit = trace(Ray(vec3(p, 6.0), 0xffu, vec3(0.01, 0.02, -1.0), 100.0));
            color = vec4(hit.kind, hit.instance, hit.primitive, hit.t);
        })",
                                           {}, FormatRGBAf32);
    const Buffer unused = makeBuffer(std::vector<float>(16));
    draw(color, [&](Command& list) {
        list.setPipeline(pipeline);
        list.setTracing(0, scene);
        list.setStorageBuffers(0, {unused, makeBuffer(std::vector<float>(16)), unused});
        list.setPushConstants(std::array<uint32_t, 3>{0, 0, 1});
        list.drawArrays(3);
    });
    const std::vector<std::array<float, 4>> texels = readTexture<std::array<float, 4>>(color);
    size_t found = 0, edges = 0;
    for (uint32_t y = 0; y < size; y++)
        for (uint32_t x = 0; x < size; x++) {
            const float px = ((static_cast<float>(x) + 0.5f) / 24 * 2 - 1) * 2.5f;
            const float py = ((static_cast<float>(y) + 0.5f) / 24 * 2 - 1) * -2.5f;
            const Expected64 expected =
                reference({{{&sphere}}, {{&box}, turned}}, {{px, py, 6}, 0xff, {0.01f, 0.02f, -1}, 100});
            const std::array<float, 4>& texel = texels[y * size + x];
            found += expected.hit;
            const bool same = (texel[0] == 1) == expected.hit &&
                              (!expected.hit || (texel[1] == static_cast<float>(expected.instance) &&
                                                 texel[2] == static_cast<float>(expected.primitive)));
            if (!same) {
                edges++;
            } else if (expected.hit) {
                EXPECT_NEAR(texel[3], expected.t, 1e-3);
            }
        }
    EXPECT_GT(found, 150u);
    EXPECT_LE(edges, 4u);
}

}  // namespace glint::test
