#include "support/spawn_tracer.h"

#include "support/hierarchies.h"
#include "support/reference.h"

#include <glint/math/ray.h>

#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace glint::test {

namespace {

constexpr const char* source = R"(
#include <glint/ray.h>
#if DRIVER
layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;
#define QUERY rayQueryEXT
#define START(q, o, d, t1) rayQueryInitializeEXT(q, scene, 1u, 0xffu, o, 0.0, d, t1)
#define PROCEED rayQueryProceedEXT
#define TYPE rayQueryGetIntersectionTypeEXT
#define DISTANCE rayQueryGetIntersectionTEXT
#define PRIMITIVE rayQueryGetIntersectionPrimitiveIndexEXT
#define INSTANCE rayQueryGetIntersectionInstanceIdEXT
#define BARYCENTRICS rayQueryGetIntersectionBarycentricsEXT
#define TO_WORLD rayQueryGetIntersectionObjectToWorldEXT
#define TO_OBJECT rayQueryGetIntersectionWorldToObjectEXT
#else
#include <glint/tracing/query.h>
#define QUERY GlintQuery
#define START(q, o, d, t1) glintQueryInitialize(q, 0u, 0u, 1u, 0xffu, o, 0.0, d, t1)
#define PROCEED glintQueryProceed
#define TYPE glintQueryType
#define DISTANCE glintQueryT
#define PRIMITIVE glintQueryPrimitiveIndex
#define INSTANCE glintQueryInstanceId
#define BARYCENTRICS glintQueryBarycentrics
#define TO_WORLD glintQueryObjectToWorld
#define TO_OBJECT glintQueryWorldToObject
#endif

layout(local_size_x = 32) in;
struct Sample { vec3 origin; float azimuth; vec3 direction; float elevation; };
struct Result {
    uint first, second; float t, elevation;
    vec3 position; float offset;
    vec3 origin; float slope;
    vec3 direction; uint target;
    vec3 normal; float distance;
    vec3 target_normal; float target_offset;
};
layout(set = 0, binding = 1) uniform Parameters { uint count, mode; float multiple, longest; };
layout(set = 0, binding = 2) readonly buffer Samples { Sample samples[]; };
layout(set = 0, binding = 3) readonly buffer Positions { float positions[]; };
layout(set = 0, binding = 4) readonly buffer Indices { uint indices[]; };
layout(set = 0, binding = 5) writeonly buffer Results { Result results[]; };

vec3 corner(uint i) {
    const uint vertex = 3u * indices[i];
    return vec3(positions[vertex], positions[vertex + 1u], positions[vertex + 2u]);
}

void main() {
    const uint index = gl_GlobalInvocationID.x;
    if (index >= count) return;
    Result result;
    result.first = result.second = result.target = 0xffffffffu;
    result.t = result.elevation = result.offset = result.slope = result.distance = result.target_offset = 0.0;
    result.position = result.origin = result.direction = result.normal = result.target_normal = vec3(0.0);

    // Traversal is compiled once: 0 and 1 are primary rays, 2 is the ray between or from their hits.
    GlintSurfacePoint points[2];
    points[0] = points[1] = glintFreePoint(vec3(0.0));
    uint primitives[2] = uint[2](0xffffffffu, 0xffffffffu);
    for (uint turn = 0u; turn < 3u; turn++) {
        if (turn == 1u && mode != 2u) continue;
        vec3 origin, direction;
        float end = 3.0e38;
        if (turn < 2u) {
            const Sample each = samples[(index + turn) % count];
            origin = each.origin;
            direction = each.direction;
        } else {
            if (primitives[0] == 0xffffffffu || (mode == 2u && primitives[1] == 0xffffffffu)) break;
            points[0].offset *= multiple;
            points[1].offset *= multiple;
            points[1].slope *= multiple;
            if (mode == 2u) {
                glintSegment(points[0], points[1], origin, direction);
                end = GLINT_SEGMENT_END;
            } else {
                const vec3 n = points[0].normal;
                const vec3 x = glintUnit(abs(n.x) > 0.5 ? vec3(-n.y, n.x, 0.0) : vec3(0.0, -n.z, n.y));
                const vec3 y = cross(n, x);
                const float sine = samples[index].elevation;
                const float angle = samples[index].azimuth;
                direction = (x * cos(angle) + y * sin(angle)) * sqrt(1.0 - sine * sine) + n * sine;
                origin = glintSpawnPoint(points[0], direction);
            }
            result.origin = origin;
            result.direction = direction;
            result.elevation = glintDot(points[0].normal, direction);
        }
        QUERY q;
        START(q, origin, direction, end);
        while (PROCEED(q)) {}
        if (uint(TYPE(q, true)) == 0u) continue;
        const uint primitive = uint(PRIMITIVE(q, true));
        if (mode == 3u) {
            primitives[0] = primitive;
            result.second = uint(INSTANCE(q, true));
            result.t = DISTANCE(q, true);
            break;
        }
        if (turn == 2u) {
            result.second = primitive;
            result.t = DISTANCE(q, true);
        } else {
            const vec3 a = corner(3u * primitive);
            const vec3 b = corner(3u * primitive + 1u);
            const vec3 c = corner(3u * primitive + 2u);
            const mat4x3 to_world = TO_WORLD(q, true);
            const mat4x3 to_object = TO_OBJECT(q, true);
            points[turn] = glintSurfacePoint(a, b, c, BARYCENTRICS(q, true), to_world, to_object);
            if (mode == 1u) {
                points[turn] = glintSurfacePoint(origin, direction, DISTANCE(q, true), points[turn].normal, longest,
                                                 to_world, to_object);
            }
            primitives[turn] = primitive;
        }
    }
    result.first = primitives[0];
    result.position = points[0].position;
    result.normal = points[0].normal;
    result.offset = points[0].offset;
    result.slope = points[0].slope;
    if (mode == 2u) {
        result.target = primitives[1];
        result.distance = glintLargest(abs(points[1].position - points[0].position));
        result.target_normal = points[1].normal;
        result.target_offset = points[1].offset + points[1].slope * result.distance;
    }
    results[index] = result;
}
)";

template <class T>
decltype(auto) need(T&& result) {
    if (!result) throw std::runtime_error(result.error().text());
    return std::forward<T>(result);
}

Vector3d transformed(const Transform3x4& transform, const Vector3d& p) {
    Vector3d result;
    for (int row = 0; row < 3; row++) {
        const float* m = &transform.rows[size_t(4 * row)];
        result[row] = double(m[0]) * p.x + double(m[1]) * p.y + double(m[2]) * p.z + double(m[3]);
    }
    return result;
}

/// One triangle in each cell of a grid: a third of all shapes, a third needles of up to 1:1000, a third flat ones (an
/// angle near 180 degrees) of up to 1:100.
Mesh triangleSoup(const Vector3d& place) {
    constexpr int cells = 8;
    Random random(31);
    Mesh mesh;
    for (int cell = 0; cell < cells * cells * cells; cell++) {
        const Vector3d center(cell % cells, cell / cells % cells, cell / cells / cells);
        const Vector3d along = random.direction();
        const Vector3d across = glm::normalize(glm::cross(along, random.direction()));
        const double height =
            cell % 3 == 0 ? random.uniform(0.3, 1.0) : std::pow(10.0, random.uniform(cell % 3 == 1 ? -3.0 : -2.0, 0.0));
        const double apex = cell % 3 == 1 ? random.uniform(-0.5, -0.4) : random.uniform(-0.3, 0.3);
        const Vector3d corners[3] = {along * -0.5, along * 0.5, along * apex + across * height * 0.7};
        for (const Vector3d& corner : corners) {
            mesh.indices.push_back(static_cast<uint32_t>(mesh.positions.size()));
            mesh.positions.push_back(Vector3f((center - 0.5 * (cells - 1) + 0.45 * corner) * 0.25 + place));
        }
    }
    return mesh;
}

}  // namespace

std::vector<SpawnCase> spawnCases() {
    const Mesh shapes = triangleSoup(Vector3d(0.0));
    const auto turned = [](const Matrix4x4f& matrix) {
        return Transform3x4(rotateX(31.0f) * rotateZ(57.0f) * matrix * rotateY(23.0f) * rotateX(71.0f));
    };
    const auto moved = [&](float x, float y, float z, const Transform3x4& transform) {
        return Transform3x4(translate({x, y, z}) * transform.matrix());
    };
    const auto uniform = [&](float size) { return turned(scale(Vector3f(size))); };
    return {
        {"identity", shapes, {Transform3x4()}},
        {"object far", triangleSoup({1000.0, -700.0, 300.0}), {Transform3x4()}},
        {"turned", shapes, {uniform(1.0f)}},
        {"scaled 1e-4", shapes, {moved(1, 2, -3, uniform(1e-4f))}},
        {"scaled 1e4", shapes, {moved(100, 20, -3, uniform(1e4f))}},
        {"stretched", shapes, {moved(1, 2, -3, turned(scale({1, 1, 1000})))}},
        {"squashed", shapes, {moved(1, 2, -3, turned(scale({1, 1, 1e-3f})))}},
        {"mirrored", shapes, {moved(1, 2, -3, turned(scale({1, -1, 1})))}},
        {"moved 1e7", shapes, {moved(1e7f, -1e7f, 0.7e7f, uniform(1e3f))}},
        {"mirrored, stretched, moved, object far",
         triangleSoup({30.0, -7.0, 10.0}),
         {moved(1e4f, -2e4f, 3e3f, turned(scale({1, -30, 300})))}},
    };
}

std::vector<SpawnSample> spawnSamples(const SpawnCase& scene, uint32_t count, uint64_t seed) {
    Random random(seed);
    std::vector<SpawnSample> samples(count);
    for (SpawnSample& sample : samples) {
        const uint64_t triangle = random.below(scene.mesh.triangleCount());
        Vector3d corners[3];
        for (uint64_t i = 0; i < 3; i++)
            corners[i] =
                transformed(scene.transforms[0], Vector3d(scene.mesh.positions[scene.mesh.indices[3 * triangle + i]]));
        double u = random.uniform();
        double v = random.uniform();
        if (u + v > 1.0) {
            u = 1.0 - u;
            v = 1.0 - v;
        }
        const Vector3d target = corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]);
        const double length = glm::length(corners[1] - corners[0]) * std::pow(10.0, random.uniform(-1.0, 1.0));
        sample.origin = Vector3f(target + random.direction() * length);
        sample.direction = Vector3f(target - Vector3d(sample.origin));
        sample.azimuth = static_cast<float>(random.uniform(0.0, 6.283));
        sample.elevation = static_cast<float>(std::exp2(random.uniform(-30.0, 0.0)));
        if (random.below(8) == 0) sample.elevation = -sample.elevation;
    }
    return samples;
}

SpawnTracer::SpawnTracer(const Device& device, bool driver)
    : device_(device), driver_(driver), kernel_(device_.createKernel()) {
    kernel_.createShaderGLSL(source, driver ? "DRIVER=1" : "DRIVER=0;GLINT_TRACING_MEMORY=0");
    need(kernel_.create());
}

std::vector<SpawnResult> SpawnTracer::trace(const SpawnCase& scene, std::span<const SpawnSample> samples,
                                            SpawnMode mode, float multiple, float longest) {
    const Buffer positions = device_.createBuffer(Buffer::FlagStorage | (driver_ ? Buffer::FlagTracing : 0u),
                                                  std::span(scene.mesh.positions));
    const Buffer indices =
        device_.createBuffer(Buffer::FlagStorage | (driver_ ? Buffer::FlagTracing : 0u), std::span(scene.mesh.indices));
    const Buffer sample_buffer = device_.createBuffer(Buffer::FlagStorage, samples);
    const Buffer results = device_.createBuffer(Buffer::FlagStorage, samples.size() * sizeof(SpawnResult));

    Compute compute = device_.createCompute();
    compute.setKernel(kernel_);
    struct Parameters {
        uint32_t count;
        SpawnMode mode;
        float multiple, longest;
    };
    compute.setUniform(0, Parameters{static_cast<uint32_t>(samples.size()), mode, multiple, longest});
    Tracing bottom = device_.createTracing();
    Tracing top;
    Buffer texels;
    if (driver_) {
        bottom.addVertexBuffer(static_cast<uint32_t>(scene.mesh.positions.size()), FormatRGBf32, 12, positions);
        bottom.addIndexBuffer(static_cast<uint32_t>(scene.mesh.indices.size()), FormatRu32, indices);
        need(bottom.create(Tracing::TypeTriangle));
        std::vector<Tracing::Instance> instances(scene.transforms.size());
        for (size_t i = 0; i < instances.size(); i++) {
            std::memcpy(instances[i].transform, scene.transforms[i].rows.data(), sizeof(instances[i].transform));
            instances[i].tracing = &bottom;
        }
        top = device_.createTracing(instances);
        need(device_.buildTracings({bottom, top}));
        compute.setTracing(0, top);
    } else {
        const std::vector<detail::Texel> all = instancesOf(hierarchyOf(scene.mesh), scene.transforms);
        texels = device_.createBuffer(Buffer::FlagTexel, std::span(all));
        compute.setTexelBuffer(0, texels, FormatRGBAu32);
    }
    compute.setStorageBuffers(0, {sample_buffer, positions, indices, results});
    compute.dispatch(static_cast<uint32_t>(samples.size()));
    need(device_.submit(compute));
    return std::move(*need(device_.read<SpawnResult>(results)));
}

}  // namespace glint::test
