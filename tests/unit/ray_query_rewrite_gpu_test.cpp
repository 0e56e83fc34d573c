// What rewritten shaders compute: the same shader asks the driver's ray queries and, rewritten, the plain library,
// about the same random scenes.

#include "ray_query_scene.h"

#include "conformance/conformance.h"
#include "support/plain_library.h"

#include <glint/shader/shader_compiler.h>

#include <cmath>
#include <set>
#include <tuple>

namespace glint::test {

namespace {

struct Ray {
    Vector3f origin;
    uint32_t mask = 0xff;
    Vector3f direction;
    float maximum = 1000;
};

struct Hit {
    uint32_t kind, front, instance, data;
    uint32_t geometry, primitive, record, candidates;
    float t, tmin;
    Vector2f barycentrics;
    Vector4f origin, direction;  ///< in the object's space
    Matrix4x4f to_world, to_object;
};

constexpr uint32_t ray_opaque = 1, ray_no_opaque = 2, ray_first = 4, ray_cull_back = 16, ray_cull_front = 32,
                   ray_cull_opaque = 64, ray_cull_no_opaque = 128, ray_skip_triangles = 256, ray_skip_boxes = 512;

constexpr std::string_view declarations = R"(
layout(local_size_x = 64) in;
struct Ray { vec3 origin; uint mask; vec3 direction; float maximum; };
struct Hit { uint kind, front, instance, data, geometry, primitive, record, candidates; float t, tmin; vec2 barycentrics;
             vec4 origin, direction; mat4 to_world, to_object; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Hits { Hit hits[]; };
layout(set = 1, binding = 0, std430) readonly buffer Boxes { float boxes[]; };
layout(push_constant) uniform Push { uint count; uint flags; uint confirm; };

Hit describe(rayQueryEXT q, uint candidates) {
    Hit hit;
    hit.kind = rayQueryGetIntersectionTypeEXT(q, true);
    hit.candidates = candidates;
    hit.front = hit.instance = hit.data = hit.geometry = hit.primitive = hit.record = 0u;
    hit.t = 0.0;
    hit.tmin = rayQueryGetRayTMinEXT(q);
    hit.barycentrics = vec2(0.0);
    hit.origin = vec4(rayQueryGetWorldRayOriginEXT(q), float(rayQueryGetRayFlagsEXT(q)));
    hit.direction = vec4(rayQueryGetWorldRayDirectionEXT(q), 0.0);
    hit.to_world = hit.to_object = mat4(0.0);
    if (hit.kind == gl_RayQueryCommittedIntersectionNoneEXT) return hit;
    hit.instance = uint(rayQueryGetIntersectionInstanceIdEXT(q, true));
    hit.t = rayQueryGetIntersectionTEXT(q, true);
    hit.primitive = uint(rayQueryGetIntersectionPrimitiveIndexEXT(q, true));
#ifndef BRIEF
    hit.data = uint(rayQueryGetIntersectionInstanceCustomIndexEXT(q, true));
    hit.geometry = uint(rayQueryGetIntersectionGeometryIndexEXT(q, true));
    hit.record = rayQueryGetIntersectionInstanceShaderBindingTableRecordOffsetEXT(q, true);
    hit.origin = vec4(rayQueryGetIntersectionObjectRayOriginEXT(q, true), hit.origin.w);
    hit.direction = vec4(rayQueryGetIntersectionObjectRayDirectionEXT(q, true), 0.0);
    hit.to_world = mat4(rayQueryGetIntersectionObjectToWorldEXT(q, true));
    hit.to_object = mat4(rayQueryGetIntersectionWorldToObjectEXT(q, true));
    if (hit.kind == gl_RayQueryCommittedIntersectionTriangleEXT) {
        hit.barycentrics = rayQueryGetIntersectionBarycentricsEXT(q, true);
        hit.front = rayQueryGetIntersectionFrontFaceEXT(q, true) ? 1u : 0u;
    }
#endif
    return hit;
}

float enterBox(vec3 origin, vec3 direction, uint box) {
    vec3 a = (vec3(boxes[box * 6u], boxes[box * 6u + 1u], boxes[box * 6u + 2u]) - origin) / direction;
    vec3 b = (vec3(boxes[box * 6u + 3u], boxes[box * 6u + 4u], boxes[box * 6u + 5u]) - origin) / direction;
    vec3 near = min(a, b), far = max(a, b);
    float enter = max(max(near.x, near.y), max(near.z, 0.0));
    return enter <= min(min(far.x, far.y), far.z) ? enter : -1.0;
}

// Whether a non-opaque triangle is there: depends on the candidate's getters.
bool takes(rayQueryEXT q) {
    uint primitive = uint(rayQueryGetIntersectionPrimitiveIndexEXT(q, false));
    if (confirm == 2u) return (primitive + uint(rayQueryGetIntersectionInstanceIdEXT(q, false))) % 3u != 0u;
    if (confirm == 3u) return rayQueryGetIntersectionFrontFaceEXT(q, false);
    if (confirm == 4u) return rayQueryGetIntersectionBarycentricsEXT(q, false).x < 0.5;
    return confirm == 1u;
}

uint finish(rayQueryEXT q) {
    uint candidates = 0u;
    while (rayQueryProceedEXT(q)) {
        candidates++;
        if (rayQueryGetIntersectionTypeEXT(q, false) == gl_RayQueryCandidateIntersectionTriangleEXT) {
            if (takes(q)) rayQueryConfirmIntersectionEXT(q);
        } else {
            float t = enterBox(rayQueryGetIntersectionObjectRayOriginEXT(q, false),
                               rayQueryGetIntersectionObjectRayDirectionEXT(q, false),
                               uint(rayQueryGetIntersectionPrimitiveIndexEXT(q, false)));
            if (t >= 0.0 && confirm != 0u) rayQueryGenerateIntersectionEXT(q, t);
        }
        if (confirm == 5u) rayQueryTerminateEXT(q);
    }
    return candidates;
}
)";

constexpr std::string_view simple = R"(
layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    rayQueryEXT q;
    rayQueryInitializeEXT(q, scene, flags, rays[i].mask, rays[i].origin, 0.0, rays[i].direction, rays[i].maximum);
    uint candidates = finish(q);
    hits[i] = describe(q, candidates);
})";

class RewriteGpuTest : public ConformanceTest {
protected:
    RewriteGpuTest() : ConformanceTest("vulkan", TracingEngine::Driver) {}

    void SetUp() override {
        ConformanceTest::SetUp();
        GLINT_NEED_FEATURE(FeatureComputeTracing);
    }

    Buffer input(const void* data, size_t size) {
        return device.createBuffer(Buffer::FlagTracing | Buffer::FlagStorage, data, size, "input");
    }

    /// The scene as the driver has it.
    Tracing build(const Scene& scene) {
        std::vector<Tracing> bottoms;
        for (const Bottom& bottom : scene.bottoms) {
            Tracing tracing = device.createTracing("bottom");
            const bool boxes = !bottom.geometries[0].boxes.empty();
            for (const Geometry& geometry : bottom.geometries) {
                if (boxes) {
                    tracing.addBoundBuffer(static_cast<uint32_t>(geometry.boxes.size() / 6), 24,
                                           input(geometry.boxes.data(), geometry.boxes.size() * 4));
                    continue;
                }
                const Mesh& mesh = geometry.mesh;
                tracing.addVertexBuffer(static_cast<uint32_t>(mesh.positions.size()), FormatRGBf32, 12,
                                        input(mesh.positions.data(), mesh.positions.size() * 12));
                tracing.addIndexBuffer(static_cast<uint32_t>(mesh.indices.size()), FormatRu32,
                                       input(mesh.indices.data(), mesh.indices.size() * 4));
            }
            Tracing::Flags flags = Tracing::FlagFastTrace;
            if (!bottom.opaque) flags |= Tracing::FlagTransparent;
            EXPECT_THAT(tracing.create(boxes ? Tracing::TypeBound : Tracing::TypeTriangle, flags), IsOk());
            bottoms.push_back(tracing);
        }
        std::vector<Tracing::Instance> instances = scene.instances;
        for (size_t i = 0; i < instances.size(); i++) instances[i].tracing = &bottoms[scene.used[i]];
        const Tracing top = device.createTracing(std::span<const Tracing::Instance>(instances));
        for (const Tracing& bottom : bottoms) device.buildTracing(bottom);
        device.buildTracing(top);
        return top;
    }

    static std::vector<Ray> castRays(uint32_t count) {
        Random random(count);
        std::vector<Ray> rays;
        for (uint32_t i = 0; i < count; i++) {
            const Vector3d origin = random.direction() * random.uniform(1, 7);
            const Vector3d aim = random.direction() * random.uniform(0, 2.5);
            const uint32_t masks[] = {0xff, 0x01, 0x30, 0x80, 0xffffff0f};
            rays.push_back({Vector3f(origin), masks[i % 5], Vector3f(aim - origin) * 0.37f, i % 7 ? 1000.0f : 2.0f});
        }
        return rays;
    }

    Kernel driverKernel(std::string_view text) {
        Kernel kernel = device.createKernel("driver");
        kernel.createShaderGLSL(text);
        EXPECT_THAT(kernel.create(), IsOk());
        return kernel;
    }

    /// The rewritten shader as the SPIR-V that it now is: the references are an ordinary block. Not optimised yet, so
    /// that what it declares and does not use keeps its slot.
    static Shader softwareShader(const std::string& text, ShaderStage stage, Shader::Type type,
                                 const char* library = plainLibrary()) {
        ShaderSource source;
        source.stage = stage;
        source.text = text;
        source.name = "test.shader";
        source.tracing.library = library;
        const Expected<shader::Preprocessed> preprocessed = shader::preprocess(source);
        EXPECT_THAT(preprocessed, IsOk());
        const Expected<std::vector<uint32_t>> words = shader::compile(source, *preprocessed);
        EXPECT_THAT(words, IsOk());
        if (!words) return {};
        Expected<Reflection> reflection = reflect(*words);
        EXPECT_THAT(reflection, IsOk());
        const Expected<std::vector<uint32_t>> rewritten = shader::rewriteRayQueries(source, *words, *reflection);
        EXPECT_THAT(rewritten, IsOk());
        return rewritten ? Shader::createSPIRV(type, *rewritten, "rewritten") : Shader();
    }

    Kernel softwareKernel(const std::string& text, const char* library = plainLibrary()) {
        Kernel kernel = device.createKernel("software");
        kernel.setShader(softwareShader(text, ShaderStage::Compute, Shader::TypeCompute, library));
        EXPECT_THAT(kernel.create(), IsOk());
        return kernel;
    }

    struct Call {
        uint32_t flags = 0;
        uint32_t confirm = 1;
        std::vector<float> boxes = {0};
    };

    std::vector<Hit> run(const Kernel& kernel, const std::vector<Ray>& rays, const Call& call,
                         const std::function<void(Compute&)>& bind) {
        const Buffer ray_buffer = makeBuffer(rays), box_buffer = makeBuffer(call.boxes);
        const Buffer hits = device.createBuffer(Buffer::FlagStorage, rays.size() * sizeof(Hit));
        compute([&](Compute& list) {
            list.setKernel(kernel);
            bind(list);
            list.setStorageBuffer(Slot::at(0, 1), ray_buffer);
            list.setStorageBuffer(Slot::at(0, 2), hits);
            list.setStorageBuffer(Slot::at(1, 0), box_buffer);
            list.setPushConstants(
                std::array<uint32_t, 3>{static_cast<uint32_t>(rays.size()), call.flags, call.confirm});
            list.dispatch(rays.size());
        });
        return read<Hit>(hits);
    }

    void prepare() {
        const std::string text = std::string(declarations) + std::string(simple);
        if (!driver_) driver_ = driverKernel(text);
        if (!plain_) plain_ = softwareKernel(text);
        if (!fast_) fast_ = softwareKernel(text, "glint/tracing/query.h");
    }

    std::vector<Hit> castDriver(const Scene& scene, const std::vector<Ray>& rays, const Call& call) {
        prepare();
        const Tracing top = build(scene);
        return run(driver_, rays, call, [&](Compute& list) { list.setTracing(0, top); });
    }

    /// By a rewritten shader; `Memory` is what its library reads.
    template <class Memory>
    std::vector<Hit> castSoftware(const Scene& scene, const std::vector<Ray>& rays, const Call& call) {
        prepare();
        std::vector<Memory> memory;
        const std::array<uint32_t, 4> reference = {encode(scene, memory), 0, 0, 0};
        const Buffer buffer = makeBuffer(memory);
        return run(std::is_same_v<Memory, uint32_t> ? plain_ : fast_, rays, call, [&](Compute& list) {
            list.setUniform(Slot::at(0, 0), reference);
            list.setStorageBuffer(Slot::at(7, 0), buffer);
        });
    }
    std::vector<Hit> castPlain(const Scene& scene, const std::vector<Ray>& rays, const Call& call) {
        return castSoftware<uint32_t>(scene, rays, call);
    }
    std::vector<Hit> castFast(const Scene& scene, const std::vector<Ray>& rays, const Call& call) {
        return castSoftware<detail::Texel>(scene, rays, call);
    }

    /// All engines give the same; returns how many rays hit.
    size_t compare(const Scene& scene, const std::vector<Ray>& rays, const Call& call) {
        const std::vector<Hit> driver = castDriver(scene, rays, call);
        const size_t found = expectSame(scene, driver, castPlain(scene, rays, call));
        SCOPED_TRACE("the engine's own traversal");
        expectSame(scene, driver, castFast(scene, rays, call));
        return found;
    }

    /// How far apart the engines' t may be. In the object's space every coordinate of the ray and of the corners is
    /// rounded to within a few units of 2^-24 of the largest, R: the transform of the origin has 4 terms, differences
    /// and products add as many again, less than 16 in all. Along the ray that is R 2^-20 / cos, for each of two
    /// engines; cos between the ray and the triangle's normal is computed here in float64.
    static double tolerance(const Scene& scene, const Hit& hit) {
        const Geometry& geometry = scene.bottoms[scene.used[hit.instance]].geometries[hit.geometry];
        const Vector3d origin = Vector3f(hit.origin), direction = Vector3f(hit.direction);
        double slope = 1, largest = glm::length(origin) + glm::length(direction) * std::abs(static_cast<double>(hit.t));
        if (geometry.boxes.empty()) {
            std::array<Vector3d, 3> corners;
            for (size_t k = 0; k < 3; k++)
                corners[k] = Vector3d(geometry.mesh.positions[geometry.mesh.indices[3 * hit.primitive + k]]);
            for (const Vector3d& corner : corners) largest = std::max(largest, glm::length(corner));
            const Vector3d normal = glm::normalize(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
            slope = std::abs(glm::dot(normal, direction));
        } else {
            // A box is entered through an axis' plane.
            slope = 1e300;
            for (int axis = 0; axis < 3; axis++)
                if (std::abs(direction[axis]) > 1e-3) slope = std::min(slope, std::abs(direction[axis]));
        }
        return 2 * largest * 0x1p-20 / slope;
    }

    static bool nearEdge(const Hit& hit) {
        return hit.kind == 1 &&
               std::min({hit.barycentrics.x, hit.barycentrics.y, 1 - hit.barycentrics.x - hit.barycentrics.y}) < 1e-4f;
    }

    /// The engines agree on every ray, but for those that pass an edge or meet two surfaces at once.
    static size_t expectSame(const Scene& scene, const std::vector<Hit>& driver, const std::vector<Hit>& software) {
        size_t found = 0, apart = 0;
        EXPECT_EQ(driver.size(), software.size());
        for (size_t i = 0; i < driver.size(); i++) {
            const Hit &a = driver[i], &b = software[i];
            SCOPED_TRACE(i);
            found += a.kind != 0;
            EXPECT_EQ(a.tmin, b.tmin);
            EXPECT_EQ(a.origin.w, b.origin.w);
            if (a.kind == 0 && b.kind == 0) continue;
            if (a.kind != b.kind || a.instance != b.instance || a.geometry != b.geometry ||
                a.primitive != b.primitive) {
                const bool tied = a.kind && b.kind && std::abs(a.t - b.t) <= tolerance(scene, a) + tolerance(scene, b);
                EXPECT_TRUE(tied || nearEdge(a) || nearEdge(b))
                    << a.kind << " " << a.instance << " " << a.geometry << " " << a.primitive << " " << a.t
                    << " against " << b.kind << " " << b.instance << " " << b.geometry << " " << b.primitive << " "
                    << b.t;
                apart++;
                continue;
            }
            EXPECT_EQ(a.front, b.front);
            EXPECT_EQ(a.data, b.data);
            EXPECT_EQ(a.record, b.record);
            EXPECT_NEAR(a.t, b.t, tolerance(scene, a));
            // Of two roundings of the same products of numbers below 10.
            for (int k = 0; k < 3; k++) {
                EXPECT_NEAR(a.origin[k], b.origin[k], 1e-5);
                EXPECT_NEAR(a.direction[k], b.direction[k], 1e-5);
            }
            for (int column = 0; column < 4; column++)
                for (int row = 0; row < 3; row++) {
                    EXPECT_EQ(a.to_world[column][row], b.to_world[column][row]);
                    EXPECT_NEAR(a.to_object[column][row], b.to_object[column][row], 1e-5);
                }
        }
        EXPECT_LE(apart, driver.size() / 100);
        return found;
    }

    static void TearDownTestSuite() { driver_ = plain_ = fast_ = {}; }

    // Compiled once: the driver takes a second for it.
    static inline Kernel driver_, plain_, fast_;
};

}  // namespace

TEST_F(RewriteGpuTest, TrianglesWithEveryFlag) {
    const std::vector<Ray> rays = castRays(1000);
    const Scene scene = triangles(1);
    for (const uint32_t flags : {0u, ray_opaque, ray_no_opaque, ray_cull_back, ray_cull_front, ray_cull_opaque,
                                 ray_cull_no_opaque, ray_opaque | ray_cull_back, ray_no_opaque | ray_cull_front}) {
        SCOPED_TRACE(flags);
        EXPECT_GT(compare(scene, rays, {flags, 1}), 50u);
    }
    EXPECT_EQ(compare(scene, rays, {ray_opaque | ray_cull_opaque, 1}), 0u);
}

TEST_F(RewriteGpuTest, CandidatesAreChosenByTheShader) {
    const std::vector<Ray> rays = castRays(1000);
    for (const uint32_t seed : {2u, 3u}) {
        const Scene scene = triangles(seed);
        for (const uint32_t confirm : {0u, 2u, 3u, 4u}) {
            SCOPED_TRACE(confirm);
            EXPECT_GT(compare(scene, rays, {0, confirm}), 100u);
            EXPECT_EQ(compare(scene, rays, {ray_no_opaque, confirm}) > 100u, confirm != 0u);
        }
    }
}

TEST_F(RewriteGpuTest, FirstHitAndTermination) {
    const std::vector<Ray> rays = castRays(600);
    const Scene scene = triangles(4);
    const std::vector<Hit> closest = castDriver(scene, rays, {0, 1});
    for (const bool fast : {false, true}) {
        SCOPED_TRACE(fast);
        const auto cast = [&](const Call& call) {
            return fast ? castFast(scene, rays, call) : castPlain(scene, rays, call);
        };
        const std::vector<Hit> first = cast({ray_first, 1});
        for (size_t i = 0; i < rays.size(); i++) {
            if (nearEdge(closest[i])) continue;
            EXPECT_EQ(first[i].kind, closest[i].kind) << i;
            if (first[i].kind) { EXPECT_GE(first[i].t, closest[i].t - tolerance(scene, closest[i])) << i; }
        }
        // Terminated at the first candidate: it is the only one, and nothing is committed among transparent surfaces.
        size_t candidates = 0;
        for (const Hit& hit : cast({ray_no_opaque, 5})) {
            EXPECT_LE(hit.candidates, 1u);
            candidates += hit.candidates;
            EXPECT_EQ(hit.kind, 0u);
        }
        EXPECT_GT(candidates, 50u);
    }
}

TEST_F(RewriteGpuTest, BoxesAreGenerated) {
    Random random(5);
    Scene scene;
    const std::vector<float> boxes = randomBoxes(random, 30);
    scene.bottoms.push_back({{{{}, boxes}}, true});
    scene.bottoms.push_back({{{soup(random, 12), {}}}, false});
    place(scene, 0, translate({0.3f, 0, 0}) * rotateX(40));
    place(scene, 1, rotateY(70));
    place(scene, 0, translate({-1, 1, 0}) * scale({0.5f, 1.5f, 0.7f}), 0x0f);
    const std::vector<Ray> rays = castRays(800);
    for (const uint32_t flags : {0u, ray_opaque, ray_cull_no_opaque, ray_no_opaque}) {
        SCOPED_TRACE(flags);
        EXPECT_GT(compare(scene, rays, {flags, 1, boxes}), 100u);
    }
}

TEST_F(RewriteGpuTest, SkippedKindsOfPrimitives) {
    // Drivers want a pipeline flag for these, so that only the software engine is asked.
    Random random(6);
    Scene scene;
    const std::vector<float> boxes = randomBoxes(random, 10);
    scene.bottoms.push_back({{{{}, boxes}}, true});
    scene.bottoms.push_back({{{soup(random, 20), {}}}, true});
    place(scene, 0, rotateX(40));
    place(scene, 1, rotateY(70));
    const std::vector<Ray> rays = castRays(400);
    for (const bool fast : {false, true}) {
        const auto kinds = [&](uint32_t flags) {
            const Call call = {flags, 1, boxes};
            std::set<uint32_t> found;
            for (const Hit& hit : fast ? castFast(scene, rays, call) : castPlain(scene, rays, call))
                found.insert(hit.kind);
            return found;
        };
        EXPECT_EQ(kinds(0), (std::set<uint32_t>{0, 1, 2}));
        EXPECT_EQ(kinds(ray_skip_triangles), (std::set<uint32_t>{0, 2}));
        EXPECT_EQ(kinds(ray_skip_boxes), (std::set<uint32_t>{0, 1}));
        EXPECT_EQ(kinds(ray_skip_boxes | ray_skip_triangles), (std::set<uint32_t>{0}));
    }
}

// Structures in an array, as parameters and from an address; queries in an array, several at once, one of the module,
// in a chain of calls: each gives what one plain query gives.
TEST_F(RewriteGpuTest, FormsOfStructuresAndQueries) {
    const std::array<Scene, 2> scenes = {triangles(7), triangles(8)};
    const std::vector<Ray> rays = castRays(300);
    std::vector<uint32_t> words = {0, 0, 0, 0, 0};
    std::array<uint32_t, 2> tops = {};
    for (size_t i = 0; i < 2; i++) tops[i] = encode(scenes[i], words);
    const Buffer buffer = makeBuffer(words);
    const std::array<uint32_t, 4> one = {tops[1], 0, 0, 0};
    const std::array<uint32_t, 12> many = {0, 0, 0, 0, tops[0], 0, 0, 0, tops[1], 0, 0, 0};
    const auto trace = [&](const Kernel& kernel, const auto& references) {
        return run(kernel, rays, {}, [&](Compute& list) {
            list.setUniform(Slot::at(0, 0), references);
            list.setStorageBuffer(Slot::at(7, 0), buffer);
        });
    };
    prepare();
    const std::vector<Hit> expected = trace(plain_, one);
    const std::string head = "#define BRIEF\n" + std::string(declarations) + R"(
#define RAY flags, rays[i].mask, rays[i].origin, 0.0, rays[i].direction, rays[i].maximum
#define BEGIN uint i = gl_GlobalInvocationID.x; if (i >= count) return;
layout(set = 0, binding = 0) uniform accelerationStructureEXT )";
    const auto expectEqual = [&](const std::string& text, const auto& references) {
        SCOPED_TRACE(text);
        const std::vector<Hit> hits = trace(softwareKernel(head + text), references);
        ASSERT_EQ(hits.size(), expected.size());
        size_t found = 0;
        for (size_t i = 0; i < hits.size(); i++) {
            const Hit &a = hits[i], &b = expected[i];
            EXPECT_EQ(std::tuple(a.kind, a.instance, a.primitive, a.candidates, a.t, a.tmin),
                      std::tuple(b.kind, b.instance, b.primitive, b.candidates, b.t, b.tmin))
                << i;
            found += a.kind != 0;
        }
        EXPECT_GT(found, hits.size() / 10);
    };
    expectEqual(R"(scenes[3];
        void main() { BEGIN rayQueryEXT q[3]; uint n[3];
            for (uint k = 0u; k < 3u; k++) { rayQueryInitializeEXT(q[k], scenes[k], RAY); n[k] = 0u; }
            for (uint k = 0u; k < 3u; k++)
                while (rayQueryProceedEXT(q[k])) { n[k]++; rayQueryConfirmIntersectionEXT(q[k]); }
            rayQueryEXT none; rayQueryInitializeEXT(none, scenes[0], RAY);
            Hit hit = describe(none, n[2]);
            hit.kind = rayQueryGetIntersectionTypeEXT(q[2], true);
            if (hit.kind != 0u) {
                hit.instance = uint(rayQueryGetIntersectionInstanceIdEXT(q[2], true));
                hit.t = rayQueryGetIntersectionTEXT(q[2], true);
                hit.primitive = uint(rayQueryGetIntersectionPrimitiveIndexEXT(q[2], true));
            }
            hits[i] = hit; })",
                many);
    expectEqual(R"(scenes[3];
        Hit three(rayQueryEXT q, uint n) { return describe(q, n); }
        Hit two(rayQueryEXT q) { return three(q, finish(q)); }
        Hit one(accelerationStructureEXT s, uint i) { rayQueryEXT q; rayQueryInitializeEXT(q, s, RAY); return two(q); }
        Hit zero(accelerationStructureEXT s[3], uint k, uint i) { return one(s[k], i); }
        void main() { BEGIN hits[i] = zero(scenes, nonuniformEXT(2u - (flags & i)), i); })",
                many);
    expectEqual(R"(scene;
        rayQueryEXT q;
        void start(accelerationStructureEXT s, uint i) { rayQueryInitializeEXT(q, s, RAY); }
        uint loop() { uint n = 0u; while (rayQueryProceedEXT(q)) { n++; rayQueryConfirmIntersectionEXT(q); } return n; }
        void main() { BEGIN start(scene, i);
            if ((i & 1u) == 0u) rayQueryInitializeEXT(q, accelerationStructureEXT(uvec2()" +
                    std::to_string(tops[1]) + R"(u, 0u)), RAY);
            uint n = loop(); hits[i] = describe(q, n); })",
                one);
}

TEST_F(RewriteGpuTest, QueriesHaveNumbers) {
    setShaderInclude("numbers.h", R"(
struct GlintQuery { uint number; };
void glintQueryInitialize(inout GlintQuery q, uint number, uint top, uint flags, uint mask, vec3 o, float t_min, vec3 d,
                          float t_max) { q.number = number; }
float glintQueryT(GlintQuery q, bool committed) { return float(q.number + 100 * GLINT_TRACING_QUERIES); })");
    const std::string text = R"(
layout(local_size_x = 1) in;
layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;
layout(set = 0, binding = 1, std430) writeonly buffer Numbers { float numbers[6]; };
#define RAY 0u, 0xffu, vec3(0.0), 0.0, vec3(1.0), 1.0
rayQueryEXT everywhere;
float inner() { rayQueryEXT q; rayQueryInitializeEXT(q, scene, RAY); return rayQueryGetIntersectionTEXT(q, true); }
void start(rayQueryEXT q) { rayQueryInitializeEXT(q, scene, RAY); }
void main() {
    rayQueryEXT one, many[3];
    start(everywhere);
    start(one);
    for (int i = 0; i < 3; i++) rayQueryInitializeEXT(many[i], scene, RAY);
    for (int i = 0; i < 3; i++) numbers[i] = rayQueryGetIntersectionTEXT(many[i], true);
    numbers[3] = rayQueryGetIntersectionTEXT(one, true);
    numbers[4] = rayQueryGetIntersectionTEXT(everywhere, true);
    numbers[5] = inner();
})";
    Kernel kernel = device.createKernel("numbers");
    kernel.setShader(softwareShader(text, ShaderStage::Compute, Shader::TypeCompute, "numbers.h"));
    setShaderInclude("numbers.h", "");
    ASSERT_THAT(kernel.create(), IsOk());
    const Buffer numbers = device.createBuffer(Buffer::FlagStorage, 6 * sizeof(float));
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setUniform(Slot::at(0, 0), std::array<uint32_t, 4>());
        list.setStorageBuffer(Slot::at(0, 1), numbers);
        list.dispatch(1);
    });
    std::vector<float> found = read<float>(numbers);
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, (std::vector<float>{600, 601, 602, 603, 604, 605}));
}

// A whole fragment shader: a picture from either engine.
TEST_F(RewriteGpuTest, FragmentShader) {
    GLINT_NEED_FEATURE(FeatureFragmentTracing);
    const std::string text = R"(
layout(set = 2, binding = 3) uniform accelerationStructureEXT scene;
layout(location = 0) out vec4 color;
void main() {
    rayQueryEXT q;
    rayQueryInitializeEXT(q, scene, gl_RayFlagsOpaqueEXT, 0xff, vec3((gl_FragCoord.xy / 64.0 - 0.5) * 5.0, 5.0), 0.0, vec3(0.0, 0.0, -1.0), 100.0);
    rayQueryProceedEXT(q);
    if (rayQueryGetIntersectionTypeEXT(q, true) == gl_RayQueryCommittedIntersectionNoneEXT) MISS;
    color = vec4(rayQueryGetIntersectionBarycentricsEXT(q, true), float(rayQueryGetIntersectionInstanceIdEXT(q, true)) / 8.0, 1.0);
})";
    const Scene scene = triangles(9);
    const Tracing top = build(scene);
    std::vector<uint32_t> words;
    const std::array<uint32_t, 4> reference = {encode(scene, words), 0, 0, 0};
    const Buffer buffer = makeBuffer(words);
    const auto picture = [&](bool software) {
        Pipeline pipeline = device.createPipeline("pipeline");
        pipeline.createShaderGLSL(Shader::TypeVertex, cover_vertex);
        if (software)
            pipeline.setShader(
                softwareShader("#define MISS discard\n" + text, ShaderStage::Fragment, Shader::TypeFragment));
        else
            // Mesa 25.0.7 crashes in a shader that discards after a query of its own.
            pipeline.createShaderGLSL(Shader::TypeFragment,
                                      "#define MISS { color = vec4(0.0, 0.0, 0.0, 1.0); return; }\n" + text);
        pipeline.setColorFormat(FormatRGBAu8n);
        EXPECT_THAT(pipeline.create(), IsOk());
        const Texture target = makeTexture(FormatRGBAu8n, 64, 64, Texture::FlagTarget);
        draw(target, [&](Command& list) {
            list.setPipeline(pipeline);
            if (software) {
                list.setUniform(Slot::at(2, 3), reference);
                list.setStorageBuffer(Slot::at(7, 0), buffer);
            } else {
                list.setTracing(0, top);
            }
            list.drawArrays(3);
        });
        return readTexture<Pixel>(target);
    };
    const std::vector<Pixel> driver = picture(false), software = picture(true);
    size_t different = 0;
    for (size_t i = 0; i < driver.size(); i++)
        for (size_t k = 0; k < 4; k++)
            if (std::abs(int(driver[i][k]) - int(software[i][k])) > 1) {
                different++;
                break;
            }
    EXPECT_GT(driver.size() - countPixels(driver, black), 500u);
    // Pixels whose ray passes an edge.
    EXPECT_LE(different, 20u);
}

}  // namespace glint::test
