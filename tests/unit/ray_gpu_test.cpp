// Spawn points, segments and normals of <glint/ray.h> on the device: against both engines, float64 and the functions of
// the same names in C++. docs/rays.md has the promises.

#include "support/device_fixture.h"
#include "support/reference.h"
#include "support/seam_rays.h"
#include "support/spawn_tracer.h"

#include <glint/geometry/primitives.h>
#include <glint/math/ray.h>

#include <fmt/format.h>

#include <cmath>
#include <cstring>

namespace glint::test {

namespace {

class RayHelpers : public DeviceTest {
protected:
    RayHelpers() : DeviceTest("vulkan", TracingEngine::Driver) {}

    /// Runs a body for each engine that the device has, with the number of rays that suits its speed.
    template <class Body>
    void withEngines(const Body& body) {
        for (const bool driver : {false, true}) {
            if (driver && !device.getFeatures().has(FeatureComputeTracing)) continue;
            SCOPED_TRACE(driver ? "driver" : "software");
            SpawnTracer tracer(device, driver);
            body(tracer, driver ? 4000u : 20000u);
        }
    }
};

struct Count {
    uint32_t tried = 0;
    uint32_t own = 0;
};

/// How many rays meet the triangle that they leave, or are to end at, of those that the filter lets pass.
template <class Filter>
Count countOwn(const std::vector<SpawnResult>& results, const Filter& filter) {
    Count count;
    for (const SpawnResult& result : results) {
        if (result.first == SpawnResult::none || !filter(result)) continue;
        count.tried++;
        count.own += result.meetsItsOwn() ? 1 : 0;
    }
    return count;
}

Count countOwn(const std::vector<SpawnResult>& results) {
    return countOwn(results, [](const SpawnResult&) { return true; });
}

TEST_F(RayHelpers, RaysDoNotMeetWhatTheyLeave) {
    withEngines([](SpawnTracer& tracer, uint32_t rays) {
        for (const SpawnCase& scene : spawnCases()) {
            SCOPED_TRACE(scene.name);
            const std::vector<SpawnSample> samples = spawnSamples(scene, rays, 1);
            const Count none = countOwn(tracer.trace(scene, samples, SpawnMode::Corners, 0.0f));
            const Count all = countOwn(tracer.trace(scene, samples, SpawnMode::Corners));
            EXPECT_GT(all.tried, rays / 2);
            EXPECT_EQ(all.own, 0u);
            EXPECT_GT(none.own, rays / 50);
        }
    });
}

TEST_F(RayHelpers, RaysByDistanceDoNotMeetWhatTheyLeave) {
    withEngines([](SpawnTracer& tracer, uint32_t rays) {
        for (const SpawnCase& scene : spawnCases()) {
            SCOPED_TRACE(scene.name);
            const std::vector<SpawnSample> samples = spawnSamples(scene, rays, 2);
            const Count count = countOwn(tracer.trace(scene, samples, SpawnMode::Ray, 1.0f, fat_triangle_side),
                                         [](const SpawnResult& result) { return result.first % 3 == 0; });
            EXPECT_GT(count.tried, rays / 4);
            EXPECT_EQ(count.own, 0u);
        }
    });
}

TEST_F(RayHelpers, SegmentsMeetNeitherEnd) {
    // Both ends have to see each other from above the offsets; twice, as the direction contains both.
    const auto seen = [](const SpawnResult& result) {
        const double lifts = 2.0 * (double(result.offset) + result.target_offset);
        return result.target != SpawnResult::none && result.first != result.target &&
               std::abs(glm::dot(Vector3d(result.normal), Vector3d(result.direction))) > lifts &&
               std::abs(glm::dot(Vector3d(result.target_normal), Vector3d(result.direction))) > lifts;
    };
    withEngines([&](SpawnTracer& tracer, uint32_t rays) {
        for (const SpawnCase& scene : spawnCases()) {
            SCOPED_TRACE(scene.name);
            const std::vector<SpawnSample> samples = spawnSamples(scene, rays / 2, 3);
            const Count none = countOwn(tracer.trace(scene, samples, SpawnMode::Segment, 0.0f), seen);
            const Count all = countOwn(tracer.trace(scene, samples, SpawnMode::Segment), seen);
            EXPECT_GT(all.tried, rays / 8);
            EXPECT_EQ(all.own, 0u);
            EXPECT_GT(none.own, 0u);
        }
    });
}

/// A tilted plane: its corners are rounded, so triangles that share an edge are flat but for that.
Mesh tiltedPlane() {
    Mesh mesh = createPlane(2.0f, 16);
    mesh.normals.clear();
    mesh.texcoords.clear();
    for (Vector3f& p : mesh.positions) {
        const double x = p.x + 100.0;
        const double y = p.y - 50.0;
        p = Vector3f(Vector3d(x, y, 0.3137 * x + 0.2113 * y));
    }
    return mesh;
}

std::array<Vector3d, 3> cornersOf(const Mesh& mesh, uint32_t triangle) {
    std::array<Vector3d, 3> corners;
    for (size_t i = 0; i < 3; i++) corners[i] = Vector3d(mesh.positions[mesh.indices[size_t{3} * triangle + i]]);
    return corners;
}

double largest(const Vector3d& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// All corners of `other` are within twice the size of `triangle` of each point of it.
bool isWithinReach(const Mesh& mesh, uint32_t triangle, uint32_t other) {
    const auto a = cornersOf(mesh, triangle);
    const double size = std::max({largest(a[1] - a[0]), largest(a[2] - a[1]), largest(a[0] - a[2])});
    for (const Vector3d& p : a)
        for (const Vector3d& q : cornersOf(mesh, other))
            if (largest(p - q) > 2.0 * size) return false;
    return true;
}

bool shareEdge(const Mesh& mesh, uint32_t triangle, uint32_t other) {
    uint32_t shared = 0;
    for (const Vector3d& p : cornersOf(mesh, triangle))
        for (const Vector3d& q : cornersOf(mesh, other)) shared += p == q ? 1 : 0;
    return shared == 2;
}

TEST_F(RayHelpers, RaysDoNotMeetNeighbours) {
    const std::pair<const char*, Mesh> meshes[] = {
        {"sphere", createSphere(1.0f, 3)}, {"cube", createCellCube(8)}, {"tilted plane", tiltedPlane()}};
    withEngines([&](SpawnTracer& tracer, uint32_t rays) {
        for (const auto& [name, mesh] : meshes) {
            const bool convex = std::string_view(name) != "tilted plane";
            uint32_t found_without = 0;
            for (SpawnCase scene : spawnCases()) {
                SCOPED_TRACE(fmt::format("{} {}", name, scene.name));
                scene.mesh = mesh;
                const std::vector<SpawnSample> samples = spawnSamples(scene, rays / 4, 4);
                for (const float multiple : {0.0f, 1.0f}) {
                    uint32_t left = 0;
                    uint32_t met = 0;
                    for (const SpawnResult& result : tracer.trace(scene, samples, SpawnMode::Corners, multiple)) {
                        if (result.first == SpawnResult::none || result.elevation < 0.0f) continue;
                        left++;
                        if (result.second == SpawnResult::none) continue;
                        // Outside of what is promised: the same plane far away, at a grazing angle; on the tilted one,
                        // whose corners stick out by their rounding, anything but neighbours.
                        const bool climbs = result.elevation >= result.slope * largest(Vector3d(result.direction));
                        if (convex ? climbs || isWithinReach(mesh, result.first, result.second)
                                   : shareEdge(mesh, result.first, result.second) || result.meetsItsOwn())
                            met++;
                    }
                    EXPECT_GT(left, samples.size() / 4);
                    if (multiple == 1.0f)
                        EXPECT_EQ(met, 0u);
                    else
                        found_without += met;
                }
            }
            EXPECT_GT(found_without, 100u) << name;
        }
    });
}

// A second surface over the first, at 1.5 to 64 times the offset: the ray has to see it. (Its own error there is below
// the offset, which covers it as it covers that of the first one.)
TEST_F(RayHelpers, RaysMeetSurfacesBeyondTheOffset) {
    const Vector3f place(10.0f, 20.0f, 30.0f);
    Mesh mesh;
    const auto add = [&](float z) {
        for (const Vector3f& p : {Vector3f(-1, -1, z), Vector3f(1, -1, z), Vector3f(0, 1, z)}) {
            mesh.indices.push_back(static_cast<uint32_t>(mesh.positions.size()));
            mesh.positions.push_back(p + place);
        }
    };
    add(0.0f);
    withEngines([&](SpawnTracer& tracer, uint32_t) {
        SpawnSample sample;
        sample.origin = place + Vector3f(0.1f, 0.0f, 1.0f);
        sample.direction = Vector3f(0, 0, -1);
        sample.elevation = 0.9f;
        SpawnCase scene = {"gap", mesh, {Transform3x4()}};
        const float offset = tracer.trace(scene, {&sample, 1}, SpawnMode::Corners)[0].offset;
        EXPECT_GT(offset, 0x1p-21f * 30.0f);
        EXPECT_LT(offset, 0x1p-17f * 30.0f);
        // The primary ray comes from between the surfaces.
        for (const float gap : {1.5f, 2.0f, 4.0f, 64.0f}) {
            Mesh two = mesh;
            for (uint32_t i = 0; i < 3; i++) {
                two.indices.push_back(3 + i);
                two.positions.push_back(mesh.positions[i] + Vector3f(0, 0, gap * offset));
            }
            scene.mesh = two;
            sample.origin = place + Vector3f(0.1f, 0.0f, 0.5f * gap * offset);
            const SpawnResult result = tracer.trace(scene, {&sample, 1}, SpawnMode::Corners)[0];
            EXPECT_EQ(result.first, 0u) << gap;
            EXPECT_EQ(result.second, 1u) << gap;
        }
    });
}

/// The transforms that the helpers are compared under, with triangles of all shapes.
struct Input {
    Vector3f a;
    float u;
    Vector3f b;
    float v;
    Vector3f c;
    float t;
    Vector3f direction;
    float longest;
    Vector4f rows[3];
    Vector4f inverse_rows[3];
};

struct Output {
    SurfacePoint point, along;
    Vector3f spawn;
    float determinant;
    Vector3f origin;
    float unused;
    Vector3f way;
    float unused1;
    Vector3f normal;
    float unused2;
    Vector4f tangent;
};

constexpr const char* comparison_source = R"(
#include <glint/ray.h>
layout(local_size_x = 32) in;
struct Input { vec3 a; float u; vec3 b; float v; vec3 c; float t; vec3 direction; float longest; vec4 rows[3]; vec4 inverse_rows[3]; };
struct Output {
    vec3 position; vec3 normal; float offset, slope;
};
layout(set = 0, binding = 0, std430) readonly buffer Inputs { Input inputs[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Outputs { float outputs[]; };
uint place;
void put(float x) { outputs[place++] = x; }
void put(vec3 v) { put(v.x); put(v.y); put(v.z); }
void put(GlintSurfacePoint p) { put(p.position); put(p.normal); put(p.offset); put(p.slope); }
void main() {
    const uint index = gl_GlobalInvocationID.x;
    if (index >= inputs.length()) return;
    place = index * 36u;
    const Input i = inputs[index];
    const mat4x3 to_world = transpose(mat3x4(i.rows[0], i.rows[1], i.rows[2]));
    const mat4x3 to_object = transpose(mat3x4(i.inverse_rows[0], i.inverse_rows[1], i.inverse_rows[2]));
    const GlintSurfacePoint point = glintSurfacePoint(i.a, i.b, i.c, vec2(i.u, i.v), to_world, to_object);
    const GlintSurfacePoint along = glintSurfacePoint(i.a, i.direction, i.t, point.normal, i.longest, to_world, to_object);
    put(point);
    put(along);
    put(glintSpawnPoint(point, i.direction));
    put(glintDeterminant(to_world));
    vec3 origin, way;
    glintSegment(point, along, origin, way);
    put(origin); put(0.0);
    put(way); put(0.0);
    put(glintTransformNormal(to_world, i.direction)); put(0.0);
    const vec4 tangent = glintTransformTangent(to_world, vec4(i.direction, 1.0));
    put(tangent.xyz); put(tangent.w);
}
)";

glm::dmat3 linear(const Transform3x4& transform) { return glm::dmat3(glm::dmat4(transform.matrix())); }
glm::dmat3 cofactors(const Transform3x4& transform) {
    const glm::dmat3 m = linear(transform);
    return {glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1])};
}

/// How much larger an error of a direction can be, relative to the direction, once the matrix has been applied: each
/// component's products are as large as before where their sum is not. 1 more for the lengths taken then.
double grown(const glm::dmat3& matrix, const Vector3f& direction) {
    const Vector3d d(direction);
    const Vector3d terms = glm::abs(matrix[0] * d.x) + glm::abs(matrix[1] * d.y) + glm::abs(matrix[2] * d.z);
    const double sum = largest(matrix * d);
    return sum > 0.0 ? 2.0 + std::sqrt(3.0) * largest(terms) / sum : 2.0;
}

TEST_F(RayHelpers, GiveTheBitsOfCpp) {
    static_assert(sizeof(Output) == 36 * sizeof(float));
    Random random(8);
    std::vector<Input> inputs;
    const auto vector = [&](double size) { return Vector3f(random.direction() * size); };
    for (const SpawnCase& scene : spawnCases()) {
        for (int i = 0; i < 500; i++) {
            const double size = std::exp2(random.uniform(-20.0, 20.0));
            Input input = {};
            input.a = vector(random.uniform(0.0, 100.0) * size);
            input.b = input.a + vector(size);
            input.c = input.a + vector(size * random.uniform());
            if (i % 50 == 0) input.c = input.b;
            input.u = static_cast<float>(random.uniform(0.0, 0.5));
            input.v = static_cast<float>(random.uniform(0.0, 0.5));
            input.t = static_cast<float>(random.uniform(0.0, 10.0));
            input.direction = vector(random.uniform(0.1, 10.0));
            input.longest = static_cast<float>(size);
            const Transform3x4 inverted = inverse(scene.transforms[0]);
            std::memcpy(input.rows, &scene.transforms[0], sizeof(input.rows));
            std::memcpy(input.inverse_rows, &inverted, sizeof(input.inverse_rows));
            inputs.push_back(input);
        }
    }
    Kernel kernel = device.createKernel();
    kernel.createShaderGLSL(comparison_source);
    ASSERT_TRUE(kernel.create()) << kernel.error().text();
    const Buffer input_buffer = device.createBuffer(Buffer::FlagStorage, std::span(inputs));
    const Buffer output_buffer = device.createBuffer(Buffer::FlagStorage, inputs.size() * sizeof(Output));
    Compute compute = device.createCompute();
    compute.setKernel(kernel);
    compute.setStorageBuffers(0, {input_buffer, output_buffer});
    compute.dispatch(static_cast<uint32_t>(inputs.size()));
    ASSERT_TRUE(device.submit(compute));
    const std::vector<Output> outputs = *device.read<Output>(output_buffer);

    // Lengths: a square root through inversesqrt (2 ulp) and two divisions (2.5 ulp each) make 14 u; products of such
    // with exact ones as much; the slenderness has another square root. Sums of positive terms keep that.
    const float lengths = 32 * 0x1p-24f;
    const auto close = [&](const Vector3f& a, const Vector3f& b) {
        return largest(Vector3d(a) - Vector3d(b)) <= lengths * largest(Vector3d(b));
    };
    // Of directions of length 1.
    const auto apart = [](const Vector3f& a, const Vector3f& b) { return largest(Vector3d(a) - Vector3d(b)); };
    for (size_t i = 0; i < inputs.size(); i++) {
        SCOPED_TRACE(i);
        const Input& input = inputs[i];
        const Output& output = outputs[i];
        Transform3x4 to_world;
        Transform3x4 to_object;
        std::memcpy(&to_world, input.rows, sizeof(to_world));
        std::memcpy(&to_object, input.inverse_rows, sizeof(to_object));
        const SurfacePoint point = surfacePoint(input.a, input.b, input.c, {input.u, input.v}, to_world, to_object);
        ASSERT_EQ(output.point.position, point.position);
        ASSERT_TRUE(close(output.point.normal, point.normal));
        ASSERT_LE(std::abs(output.point.offset - point.offset), lengths * point.offset);
        ASSERT_LE(std::abs(output.point.slope - point.slope), lengths * point.slope);
        // From here on with the device's lengths: what follows are sums and products.
        const SurfacePoint along =
            surfacePoint(input.a, input.direction, input.t, output.point.normal, input.longest, to_world, to_object);
        ASSERT_EQ(std::memcmp(&along, &output.along, sizeof(along)), 0) << along.offset << " " << output.along.offset;
        ASSERT_EQ(output.spawn, spawnPoint(output.point, input.direction));
        const Segment between = segment(output.point, output.along);
        ASSERT_EQ(output.origin, between.origin);
        ASSERT_EQ(output.way, between.direction);
        const Vector3f direction = input.direction;
        ASSERT_LE(apart(output.normal, transformNormal(to_world, direction)),
                  lengths * grown(cofactors(to_world), direction));
        const Vector4f tangent = transformTangent(to_world, Vector4f(direction, 1.0f));
        ASSERT_LE(apart(Vector3f(output.tangent), Vector3f(tangent)), lengths * grown(linear(to_world), direction));
        ASSERT_EQ(output.tangent.w, tangent.w);
        ASSERT_EQ(output.tangent.w < 0.0f, output.determinant < 0.0f);
    }
}

// 60 models around a point at 1e9, seen by an eye that goes around it.
TEST_F(RayHelpers, ScenesFarFromTheOriginLookAsAtTheOrigin) {
    const Mesh torus = createTorus(1.0f, 0.4f, 24, 12);
    Random random(9);
    const Vector3d far(1.0e9, -1.3e9, 0.7e9);
    std::vector<Matrix4x4d> models;
    for (uint32_t i = 0; i < 60; i++) {
        Matrix4x4d model(rotateX(static_cast<float>(random.uniform(0.0, 360.0))) *
                         rotateZ(static_cast<float>(random.uniform(0.0, 360.0))));
        model[3] = Vector4d(random.direction() * random.uniform(0.0, 8.0), 1.0);
        models.push_back(model);
    }
    const auto scene = [&](const Vector3d& place, const Vector3d& eye) {
        SpawnCase result = {"far", torus, {}};
        for (Matrix4x4d model : models) {
            // Where the model is, in float64: this is what rounds at 1e9.
            for (int i = 0; i < 3; i++) model[3][i] += place[i];
            result.transforms.push_back(relativeTransform(model, place + eye));
        }
        return result;
    };
    withEngines([&](SpawnTracer& tracer, uint32_t rays) {
        for (const double angle : {0.3, 2.4, 4.5}) {
            SCOPED_TRACE(angle);
            const Vector3d eye(20.0 * std::cos(angle), 20.0 * std::sin(angle), 3.0);
            std::vector<SpawnSample> samples(rays / 2);
            for (SpawnSample& sample : samples)
                sample.direction = Vector3f(glm::normalize(random.direction() * 8.0 - eye));
            const SpawnCase near_scene = scene(Vector3d(0.0), eye);
            const std::vector<SpawnResult> here = tracer.trace(near_scene, samples, SpawnMode::Primary);
            const std::vector<SpawnResult> there = tracer.trace(scene(far, eye), samples, SpawnMode::Primary);
            // The same, with everything in float32 at 1e9, where its unit is 64.
            SpawnCase naive = {"naive", torus, {}};
            for (Matrix4x4d model : models) {
                for (int i = 0; i < 3; i++) model[3][i] += far[i];
                naive.transforms.emplace_back(Matrix4x4f(model));
            }
            std::vector<SpawnSample> naive_samples = samples;
            for (SpawnSample& sample : naive_samples) sample.origin = Vector3f(far + eye);
            const std::vector<SpawnResult> lost = tracer.trace(naive, naive_samples, SpawnMode::Primary);

            // Positions are off by 2^-53 of 1.3e9 twice, and of what is 28 away by 2^-24; the tests' own errors are 16
            // u of that, twice. So a plane is moved by `shift` at most.
            const double shift = 2.0 * 0x1p-53 * 1.3e9 * 1.8 + (1.0 + 32.0) * 0x1p-24 * 29.4;
            uint32_t hits = 0;
            uint32_t differ = 0;
            uint32_t naive_differ = 0;
            for (size_t i = 0; i < samples.size(); i++) {
                hits += here[i].first != SpawnResult::none ? 1 : 0;
                const auto same = [&](const SpawnResult& other) {
                    if (here[i].first != other.first || here[i].second != other.second) return false;
                    if (here[i].first == SpawnResult::none) return true;
                    const auto corners = cornersOf(torus, here[i].first);
                    const Vector3d normal(
                        transformNormal(near_scene.transforms[here[i].second],
                                        Vector3f(glm::cross(corners[1] - corners[0], corners[2] - corners[0]))));
                    const double cosine = std::abs(glm::dot(normal, Vector3d(samples[i].direction)));
                    return std::abs(double(here[i].t) - other.t) <= shift / cosine;
                };
                differ += same(there[i]) ? 0 : 1;
                naive_differ += same(lost[i]) ? 0 : 1;
            }
            EXPECT_GT(hits, samples.size() / 4);
            // Rays that pass an edge within `shift` may change sides. Some 20 edges, of triangles 0.1 to 0.4 wide, are
            // near to a ray's way, so one in 20 * 2 * shift / 0.1 does.
            EXPECT_LE(differ, 1.0 + 400.0 * shift * static_cast<double>(samples.size()));
            EXPECT_GT(naive_differ, hits / 2);
        }
    });
}

}  // namespace

}  // namespace glint::test
