#include "bench/tracing_scenes.h"

#include "support/reference.h"

#include <glint/geometry/primitives.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <thread>

namespace glint::bench {

namespace {

constexpr uint32_t size = 1024;
constexpr const char* bunny_path = "/usr/share/glmark2/models/bunny.obj";

void append(Mesh& mesh, const Mesh& other) {
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
    for (const uint32_t index : other.indices) mesh.indices.push_back(first + index);
}

Mesh bumpyTorus(uint32_t segments) {
    Mesh mesh = createTorus(1.0f, 0.45f, 2 * segments, segments);
    for (size_t i = 0; i < mesh.positions.size(); i++) {
        const Vector3f p = mesh.positions[i];
        const float bump = std::sin(23.0f * p.x) * std::sin(19.0f * p.y) * std::sin(29.0f * p.z);
        mesh.positions[i] = p + mesh.normals[i] * (0.04f * bump);
    }
    mesh.normals.clear();
    return mesh;
}

Mesh bunny() {
    Mesh mesh = *check(Mesh::load(bunny_path));
    mesh.normals.clear();
    mesh.texcoords.clear();
    mesh.parts.clear();
    const BoundBox bounds = mesh.bounds();
    const Vector3f extent = bounds.size();
    const float scale = 2.4f / std::max({extent.x, extent.y, extent.z});
    for (Vector3f& p : mesh.positions) p = (p - bounds.center()) * scale;
    return mesh;
}

uint32_t evenBits(uint32_t x) {
    uint32_t result = 0;
    for (uint32_t i = 0; i < 16; i++) result |= (x >> (2 * i) & 1u) << i;
    return result;
}

std::vector<Ray> cameraRays() {
    const Vector3f eye(0.3f, 1.9f, 2.3f);
    const Vector3f forward = glm::normalize(-eye);
    const Vector3f right = glm::normalize(glm::cross(forward, Vector3f(0, 1, 0)));
    const Vector3f up = glm::cross(right, forward);
    const float extent = std::tan(radians(55.0f) / 2);
    std::vector<Ray> rays(size_t(size) * size);
    for (uint32_t i = 0; i < rays.size(); i++) {
        const float x = (static_cast<float>(evenBits(i)) + 0.5f) * (2.0f / size) - 1.0f;
        const float y = (static_cast<float>(evenBits(i >> 1)) + 0.5f) * (2.0f / size) - 1.0f;
        rays[i].origin = eye;
        rays[i].direction = glm::normalize(forward + right * (x * extent) - up * (y * extent));
    }
    return rays;
}

std::vector<Ray> bounceRays(const Mesh& mesh, std::span<const Ray> rays) {
    std::vector<RayHit> hits(rays.size());
    EmbreeScene(mesh, true).trace(rays, hits);
    test::Random random(1);
    std::vector<Ray> result(rays.size());
    for (size_t i = 0; i < rays.size(); i++) {
        if (!hits[i].isHit()) throw std::runtime_error("a camera ray leaves the room");
        const uint32_t* corner = &mesh.indices[3 * size_t(hits[i].primitive)];
        const Vector3f a = mesh.positions[corner[0]];
        Vector3f normal = glm::normalize(glm::cross(mesh.positions[corner[1]] - a, mesh.positions[corner[2]] - a));
        if (glm::dot(normal, rays[i].direction) > 0.0f) normal = -normal;
        result[i].origin = rays[i].origin + rays[i].direction * hits[i].t + normal * 1e-4f;
        const Vector3f direction = normal * 1.0001f + Vector3f(random.direction());
        result[i].direction = glm::normalize(direction);
    }
    return result;
}

}  // namespace

EmbreeScene::EmbreeScene(const Mesh& mesh, bool robust) : device_(rtcNewDevice("threads=2")) {
    scene_ = rtcNewScene(device_);
    if (robust) rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_MEDIUM);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* vertices =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.positions.size());
    void* indices =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangleCount());
    std::memcpy(vertices, mesh.positions.data(), 12 * mesh.positions.size());
    std::memcpy(indices, mesh.indices.data(), 4 * mesh.indices.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
}

EmbreeScene::~EmbreeScene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
}

void EmbreeScene::trace(std::span<const Ray> rays, std::span<RayHit> hits) const {
    constexpr size_t chunk = 4096;
    std::atomic<size_t> next = 0;
    const auto work = [&] {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        for (size_t begin = next.fetch_add(chunk); begin < rays.size(); begin = next.fetch_add(chunk)) {
            for (size_t i = begin; i < std::min(rays.size(), begin + chunk); i++) {
                RTCRayHit query;
                query.ray = {rays[i].origin.x,
                             rays[i].origin.y,
                             rays[i].origin.z,
                             rays[i].t_min,
                             rays[i].direction.x,
                             rays[i].direction.y,
                             rays[i].direction.z,
                             0.0f,
                             rays[i].t_max,
                             0xffffffffu,
                             0,
                             0};
                query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
                query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
                rtcIntersect1(scene_, &context, &query);
                const bool hit = query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
                hits[i] = {};
                if (hit) hits[i] = {query.ray.tfar, query.hit.primID, 0, query.hit.u, query.hit.v, 0};
            }
        }
    };
    std::thread other(work);
    work();
    other.join();
}

TracingScene makeTracingScene(const std::string& name) {
    TracingScene scene;
    scene.name = name;
    scene.mesh = name == "bunny" ? bunny() : bumpyTorus(name == "1m" ? 500 : 158);
    append(scene.mesh, createBox(Vector3f(6.0f)));
    scene.camera = cameraRays();
    scene.bounce = bounceRays(scene.mesh, scene.camera);
    return scene;
}

}  // namespace glint::bench
