#include "support/secondary_rays.h"

#include "support/reference.h"

#include <glint/geometry/primitives.h>
#include <glint/math/ray.h>

#include <cmath>
#include <cstring>
#include <stdexcept>

namespace glint::test {

namespace {

constexpr const char* source = R"(
#include <glint/ray.h>

struct Sample { vec3 origin; float unused; vec3 direction; float unused1; vec3 lamp; float unused2; };
struct Result {
    uint first, instance; vec2 barycentrics;
    vec3 position; float offset;
    vec3 normal; float slope;
    vec3 mirrored; uint shadow;
    uint shadow_instance, mirror, mirror_instance; float mirror_t;
    mat3x4 to_object;
};
layout(set = 0, binding = 0) uniform Parameters { uint count, is_fixed; float multiple, nearest, reach; };
layout(set = 0, binding = 1) readonly buffer Samples { Sample samples[]; };
layout(set = 0, binding = 2) readonly buffer Positions { float positions[]; };
layout(set = 0, binding = 3) readonly buffer Indices { uint indices[]; };
layout(set = 0, binding = 4) writeonly buffer Results { Result results[]; };
layout(set = 1, binding = 0) uniform accelerationStructureEXT scene;

const uint none = 0xffffffffu, not_traced = 0xfffffffeu;
const float farthest = 3.0e38;
const uint shadow_flags = gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT;
const Result nothing = Result(none, 0u, vec2(0.0), vec3(0.0), 0.0, vec3(0.0), 0.0, vec3(0.0), none, 0u, none, 0u, 0.0,
                              mat3x4(0.0));

struct Hit { uint primitive, instance; float t; };
struct Way { vec3 origin; float nearest; vec3 direction; float farthest; };

vec3 corner(uint i) {
    const uint vertex = 3u * indices[i];
    return vec3(positions[vertex], positions[vertex + 1u], positions[vertex + 2u]);
}

GlintSurfacePoint pointOf(uint primitive, vec2 barycentrics, mat4x3 to_world, mat4x3 to_object) {
    return glintSurfacePoint(corner(3u * primitive), corner(3u * primitive + 1u), corner(3u * primitive + 2u),
                             barycentrics, to_world, to_object);
}

Result resultOf(GlintSurfacePoint point, uint primitive, uint instance, vec2 barycentrics, mat4x3 to_object,
                vec3 direction) {
    Result result = nothing;
    result.first = primitive;
    result.instance = instance;
    result.barycentrics = barycentrics;
    result.position = point.position;
    result.offset = point.offset;
    result.normal = point.normal;
    result.slope = point.slope;
    result.mirrored = reflect(direction, point.normal);
    result.to_object = transpose(to_object);
    return result;
}

// The side from which the primary ray comes has to face the lamp.
bool facesLamp(GlintSurfacePoint point, vec3 direction, vec3 lamp) {
    return (glintDot(point.normal, lamp - point.position) > 0.0) == (glintDot(point.normal, direction) < 0.0);
}

Way shadowWay(GlintSurfacePoint point, vec3 lamp) {
    if (is_fixed != 0u)
        return Way(point.position, nearest, normalize(lamp - point.position), distance(lamp, point.position));
    point.offset *= multiple;
    Way way = Way(vec3(0.0), 0.0, vec3(0.0), GLINT_SEGMENT_END);
    glintSegment(point, glintFreePoint(lamp), way.origin, way.direction);
    return way;
}

Way mirrorWay(GlintSurfacePoint point, vec3 mirrored) {
    if (is_fixed != 0u) return Way(point.position, nearest, mirrored, reach);
    point.offset *= multiple;
    return Way(glintSpawnPoint(point, mirrored), 0.0, mirrored, reach);
}

#if RAYGEN_SHADER

layout(location = 0) rayPayloadEXT uint unused;

void main() {
    const Sample each = samples[gl_LaunchIDEXT.x];
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, each.origin, 0.0, each.direction, farthest, 0);
}

#elif PRIMARY_MISS_SHADER

void main() { results[gl_LaunchIDEXT.x] = nothing; }

#elif SECONDARY_MISS_SHADER

void main() {}

#elif PRIMARY_SHADER

layout(location = 0) rayPayloadInEXT uint unused;
layout(location = 1) rayPayloadEXT Hit hit;
hitAttributeEXT vec2 barycentrics;

void main() {
    const uint index = gl_LaunchIDEXT.x;
    const GlintSurfacePoint point = pointOf(gl_PrimitiveID, barycentrics, gl_ObjectToWorldEXT, gl_WorldToObjectEXT);
    Result result = resultOf(point, gl_PrimitiveID, gl_InstanceID, barycentrics, gl_WorldToObjectEXT,
                             samples[index].direction);
    result.shadow = not_traced;
    if (facesLamp(point, samples[index].direction, samples[index].lamp)) {
        const Way way = shadowWay(point, samples[index].lamp);
        hit = Hit(none, 0u, 0.0);
        traceRayEXT(scene, shadow_flags, 0xff, 1, 0, 1, way.origin, way.nearest, way.direction, way.farthest, 1);
        result.shadow = hit.primitive;
        result.shadow_instance = hit.instance;
    }
    const Way way = mirrorWay(point, result.mirrored);
    hit = Hit(none, 0u, 0.0);
    traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 1, 0, 1, way.origin, way.nearest, way.direction, way.farthest, 1);
    result.mirror = hit.primitive;
    result.mirror_instance = hit.instance;
    result.mirror_t = hit.t;
    results[index] = result;
}

#elif SECONDARY_SHADER

layout(location = 1) rayPayloadInEXT Hit hit;

void main() { hit = Hit(gl_PrimitiveID, gl_InstanceID, gl_HitTEXT); }

#else

layout(local_size_x = 32) in;

void main() {
    const uint index = gl_GlobalInvocationID.x;
    if (index >= count) return;
    const vec3 direction = samples[index].direction;
    const vec3 lamp = samples[index].lamp;
    Result result = nothing;
    GlintSurfacePoint point = glintFreePoint(vec3(0.0));
    // Traversal is compiled once: the primary, the shadow and the mirrored ray.
    for (uint turn = 0u; turn < 3u; turn++) {
        Way way = Way(samples[index].origin, 0.0, direction, farthest);
        if (turn == 1u) {
            result.shadow = not_traced;
            if (!facesLamp(point, direction, lamp)) continue;
            way = shadowWay(point, lamp);
        } else if (turn == 2u) {
            way = mirrorWay(point, result.mirrored);
        }
        rayQueryEXT query;
        rayQueryInitializeEXT(query, scene, turn == 1u ? shadow_flags : gl_RayFlagsOpaqueEXT, 0xffu, way.origin,
                              way.nearest, way.direction, way.farthest);
        while (rayQueryProceedEXT(query)) {}
        const bool is_hit =
            rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionTriangleEXT;
        if (!is_hit && turn == 0u) break;
        const uint primitive = is_hit ? rayQueryGetIntersectionPrimitiveIndexEXT(query, true) : none;
        const uint instance = is_hit ? rayQueryGetIntersectionInstanceIdEXT(query, true) : 0u;
        if (turn == 0u) {
            const vec2 barycentrics = rayQueryGetIntersectionBarycentricsEXT(query, true);
            const mat4x3 to_object = rayQueryGetIntersectionWorldToObjectEXT(query, true);
            point = pointOf(primitive, barycentrics, rayQueryGetIntersectionObjectToWorldEXT(query, true), to_object);
            result = resultOf(point, primitive, instance, barycentrics, to_object, direction);
        } else if (turn == 1u) {
            result.shadow = primitive;
            result.shadow_instance = instance;
        } else {
            result.mirror = primitive;
            result.mirror_instance = instance;
            result.mirror_t = is_hit ? rayQueryGetIntersectionTEXT(query, true) : 0.0;
        }
    }
    results[index] = result;
}

#endif
)";

template <class T>
decltype(auto) need(T&& result) {
    if (!result) throw std::runtime_error(result.error().text());
    return std::forward<T>(result);
}

struct Pillar {
    double x, y;
};
constexpr Pillar pillars[] = {{-0.55, -0.5}, {0.1, -0.35}, {-0.3, 0.45}, {0.65, 0.3}};
constexpr double pillar_width = 0.2;
constexpr double ceiling_height = 1.1;

/// From the space in which the floor is z = 0: no plane's corners are exactly in it once they are rounded.
Matrix4x4d tilt() { return Matrix4x4d(translate({0.3f, -0.2f, 0.1f}) * rotateX(17.0f) * rotateZ(29.0f)); }

void append(Mesh& mesh, const Mesh& part, const Vector3d& place) {
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (const Vector3f& p : part.positions)
        mesh.positions.emplace_back(Vector3d(tilt() * Vector4d(Vector3d(p) + place, 1.0)));
    for (const uint32_t index : part.indices) mesh.indices.push_back(first + index);
}

Mesh hall() {
    Mesh mesh;
    append(mesh, createPlane(2.0f, 16), Vector3d(0.0));
    const auto width = static_cast<float>(pillar_width);
    for (const Pillar& pillar : pillars)
        append(mesh, createBox({width, width, 0.6f}), {pillar.x, pillar.y, 0.2});  // a sixth of it in the floor
    append(mesh, createSphere(0.2f, 2), {0.5, -0.5, 0.18});
    return mesh;
}

Vector3f rounded(const Matrix4x4d& matrix, const Vector3d& p) { return Vector3f(Vector3d(matrix * Vector4d(p, 1.0))); }

}  // namespace

std::vector<SecondaryCase> secondaryCases() {
    const Mesh mesh = hall();
    const Matrix4x4d ceiling = tilt() * Matrix4x4d(translate({0, 0, static_cast<float>(ceiling_height)})) *
                               Matrix4x4d(rotateX(180.0f)) * glm::inverse(tilt());
    const auto turned = [](const Vector3f& factors) {
        return Matrix4x4d(rotateX(31.0f) * rotateZ(57.0f) * scale(factors) * rotateY(23.0f) * rotateX(71.0f));
    };
    std::vector<SecondaryCase> cases;
    const auto add = [&](std::string name, const Vector3d& place, const Vector3f& factors, double lowest = 0x1p-5,
                         double highest = 1.0, const Vector3d& eye = Vector3d(0.0)) {
        Matrix4x4d floor = turned(factors);
        floor[3] = Vector4d(place, 1.0);
        const float size = std::max({factors.x, factors.y, factors.z});
        cases.push_back({std::move(name),
                         mesh,
                         {relativeTransform(floor, eye), relativeTransform(floor * ceiling, eye)},
                         4.0f * size,
                         lowest,
                         highest});
    };
    const Vector3d far(1e7, -1e7, 0.7e7);
    add("plain", {12, -7, 3}, Vector3f(10));
    add("grazing light", {12, -7, 3}, Vector3f(10), 0x1p-13, 0x1p-5);
    add("scaled 1e-3", {0.1, -0.2, 0.3}, Vector3f(1e-3f));
    add("stretched 1:1000", {12, -7, 3}, Vector3f(1, 1, 1000));
    add("squashed 1:1000", {1, -2, 3}, Vector3f(1, 1, 1e-3f));
    add("at 1e7", far, Vector3f(1e3f));
    add("at 1e7, relative to the eye", far, Vector3f(1e3f), 0x1p-5, 1.0, far + Vector3d(200, -700, 300));
    return cases;
}

std::vector<SecondarySample> secondarySamples(const SecondaryCase& scene, uint32_t count, uint64_t seed) {
    Random random(seed);
    std::vector<SecondarySample> samples(count);
    for (SecondarySample& sample : samples) {
        // In the mesh's space: where to look, the normal there, and the two ways along the surface.
        Vector3d target, normal, ahead;
        if (random.below(2) == 0) {
            const uint64_t triangle = random.below(scene.mesh.triangleCount());
            Vector3d corners[3];
            for (uint64_t i = 0; i < 3; i++)
                corners[i] = Vector3d(scene.mesh.positions[scene.mesh.indices[3 * triangle + i]]);
            double u = random.uniform();
            double v = random.uniform();
            if (u + v > 1.0) {
                u = 1.0 - u;
                v = 1.0 - v;
            }
            target = corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]);
            normal = glm::normalize(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
            ahead = glm::normalize(glm::cross(normal, random.direction()));
        } else {
            const Pillar& pillar = pillars[random.below(std::size(pillars))];
            const double along = random.uniform(-0.5, 0.5) * pillar_width;
            const double away = 0.5 * pillar_width + std::pow(10.0, random.uniform(-6.0, -1.0));
            // A side, and within 60 degrees of the way to it.
            const double side = 0.5 * 3.14159265358979 * static_cast<double>(random.below(4));
            const Vector3d out(std::cos(side), std::sin(side), 0.0);
            const Vector3d across(-out.y, out.x, 0.0);
            const double angle = random.uniform(-1.05, 1.05);
            target = Vector3d(tilt() * Vector4d(Vector3d(pillar.x, pillar.y, 0.0) + out * away + across * along, 1.0));
            normal = Vector3d(tilt() * Vector4d(0, 0, 1, 0));
            ahead = Vector3d(tilt() * Vector4d(across * std::sin(angle) - out * std::cos(angle), 0.0));
        }
        const auto sine = [&] { return std::exp2(random.uniform(std::log2(scene.lowest), std::log2(scene.highest))); };
        const auto risen = [&](const Vector3d& way, double rise) {
            return way * std::sqrt(1.0 - rise * rise) + normal * rise;
        };
        const Matrix4x4d to_world(scene.transforms[random.below(scene.transforms.size())].matrix());
        const double turn = random.uniform(-0.5, 0.5);
        const Vector3d lamp_way = ahead * std::cos(turn) + glm::cross(normal, ahead) * std::sin(turn);
        const Vector3d eye = target + risen(-ahead, sine()) * random.uniform(0.1, 0.9);
        sample.lamp = rounded(to_world, target + risen(lamp_way, sine()) * random.uniform(0.3, 0.9));
        sample.origin = rounded(to_world, eye);
        sample.direction =
            Vector3f(glm::normalize(Vector3d(to_world * Vector4d(target, 1.0)) - Vector3d(sample.origin)));
    }
    return samples;
}

SecondaryTracer::SecondaryTracer(const Device& device, SecondaryForm form) : device_(device) {
    if (form == SecondaryForm::Query) {
        kernel_ = device_.createKernel();
        kernel_.createShaderGLSL(source);
        need(kernel_.create());
        return;
    }
    traversal_ = device_.createTraversal();
    traversal_.createShaderGLSL(Shader::TypeRayGen, source, "RAYGEN_SHADER=1");
    traversal_.createShaderGLSL(Shader::TypeRayMiss, source, "PRIMARY_MISS_SHADER=1");
    traversal_.createShaderGLSL(Shader::TypeRayMiss, source, "SECONDARY_MISS_SHADER=1");
    traversal_.createShaderGLSL(Shader::TypeClosest, source, "PRIMARY_SHADER=1");
    traversal_.createShaderGLSL(Shader::TypeClosest, source, "SECONDARY_SHADER=1");
    traversal_.setRecursionDepth(2);
    need(traversal_.create());
}

void SecondaryTracer::load(const SecondaryCase& scene, std::span<const SecondarySample> samples) {
    const Buffer::Flags flags = Buffer::FlagStorage | Buffer::FlagTracing;
    positions_ = device_.createBuffer(flags, std::span(scene.mesh.positions));
    indices_ = device_.createBuffer(flags, std::span(scene.mesh.indices));
    samples_ = device_.createBuffer(Buffer::FlagStorage, samples);
    results_ = device_.createBuffer(Buffer::FlagStorage, samples.size() * sizeof(SecondaryResult));
    count_ = static_cast<uint32_t>(samples.size());
    reach_ = scene.reach;

    bottom_ = device_.createTracing();
    bottom_.addVertexBuffer(static_cast<uint32_t>(scene.mesh.positions.size()), FormatRGBf32, 12, positions_);
    bottom_.addIndexBuffer(static_cast<uint32_t>(scene.mesh.indices.size()), FormatRu32, indices_);
    need(bottom_.create(Tracing::TypeTriangle));
    std::vector<Tracing::Instance> instances(scene.transforms.size());
    for (size_t i = 0; i < instances.size(); i++) {
        std::memcpy(instances[i].transform, scene.transforms[i].rows.data(), sizeof(instances[i].transform));
        instances[i].tracing = &bottom_;
    }
    top_ = device_.createTracing(instances);
    need(device_.buildTracings({bottom_, top_}));
}

std::vector<SecondaryResult> SecondaryTracer::trace(const SecondaryStart& start) {
    Compute compute = device_.createCompute();
    if (traversal_)
        compute.setTraversal(traversal_);
    else
        compute.setKernel(kernel_);
    struct Parameters {
        uint32_t count, is_fixed;
        float multiple, nearest, reach;
    };
    compute.setUniform(0, Parameters{count_, start.is_fixed ? 1u : 0u, start.multiple, start.nearest, reach_});
    compute.setStorageBuffers(0, {samples_, positions_, indices_, results_});
    compute.setTracing(0, top_);
    compute.dispatch(count_);
    need(device_.submit(compute));
    return std::move(*need(device_.read<SecondaryResult>(results_)));
}

}  // namespace glint::test
