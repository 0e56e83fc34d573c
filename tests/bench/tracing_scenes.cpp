#include "bench/tracing_scenes.h"

#include "accuracy/embree.h"
#include "common/instanced_scene.h"
#include "support/reference.h"

#include <glint/geometry/primitives.h>
#include <glint/math/ray.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <thread>

namespace glint::bench {

namespace {

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

/// A file's mesh, in the middle and 2.4 units long.
Mesh model(const std::filesystem::path& path) {
    Mesh mesh = *check(Mesh::load(path));
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

std::vector<Ray> cameraRays(const Vector3f& eye, const Vector3f& target, const Vector3f& up_axis, float degrees,
                            uint32_t size) {
    const Vector3f forward = glm::normalize(target - eye);
    const Vector3f right = glm::normalize(glm::cross(forward, up_axis));
    const Vector3f up = glm::cross(right, forward);
    const float extent = std::tan(radians(degrees) / 2);
    std::vector<Ray> rays(size_t(size) * size);
    for (uint32_t i = 0; i < rays.size(); i++) {
        const float x = (static_cast<float>(evenBits(i)) + 0.5f) * (2.0f / static_cast<float>(size)) - 1.0f;
        const float y = (static_cast<float>(evenBits(i >> 1)) + 0.5f) * (2.0f / static_cast<float>(size)) - 1.0f;
        rays[i].origin = eye;
        rays[i].direction = glm::normalize(forward + right * (x * extent) - up * (y * extent));
    }
    return rays;
}

std::vector<Ray> bounceRays(const TracingScene& scene) {
    const Mesh& mesh = scene.mesh;
    const std::vector<Ray>& rays = scene.camera;
    std::vector<RayHit> hits(rays.size());
    std::vector<uint32_t> instances(rays.size());
    test::EmbreeScene(mesh, test::EmbreeMode::Robust, scene.instances)
        .cast(rays, hits, std::thread::hardware_concurrency(), instances);
    test::Random random(1);
    std::vector<Ray> result;
    result.reserve(rays.size());
    for (size_t i = 0; i < rays.size(); i++) {
        if (!hits[i].isHit()) continue;
        const uint32_t* corner = &mesh.indices[3 * size_t(hits[i].primitive)];
        const Transform3x4 transform = scene.instances.empty() ? Transform3x4() : scene.instances[instances[i]];
        const SurfacePoint point =
            surfacePoint(mesh.positions[corner[0]], mesh.positions[corner[1]], mesh.positions[corner[2]],
                         {hits[i].u, hits[i].v}, transform, inverse(transform));
        const Vector3f normal = glm::dot(point.normal, rays[i].direction) > 0.0f ? -point.normal : point.normal;
        Ray ray;
        ray.direction = glm::normalize(normal * 1.0001f + Vector3f(random.direction()));
        ray.origin = spawnPoint(point, ray.direction);
        result.push_back(ray);
    }
    return result;
}

}  // namespace

std::filesystem::path dragonPath() {
    const char* path = std::getenv("GLINT_DRAGON");
    return path ? path : "";
}

TracingScene makeTracingScene(const std::string& name, uint32_t size) {
    TracingScene scene;
    scene.name = name;
    if (name == "instances") {
        const InstancedScene places = *check(InstancedScene::load({}, false));
        scene.mesh = places.mesh();
        scene.instances = places.transforms(0.0f);
        scene.camera =
            cameraRays(places.camera(0.0f, 1.0f).position(), places.target(), Vector3f(0, 0, 1), 60.0f, size);
    } else {
        const bool is_file = name == "bunny" || name == "dragon";
        scene.mesh =
            is_file ? model(name == "bunny" ? bunny_path : dragonPath()) : bumpyTorus(name == "1m" ? 500 : 158);
        append(scene.mesh, createBox(Vector3f(6.0f)));
        scene.camera = cameraRays(Vector3f(0.3f, 1.9f, 2.3f), Vector3f(0.0f), Vector3f(0, 1, 0), 55.0f, size);
    }
    scene.bounce = bounceRays(scene);
    if (scene.instances.empty() && scene.bounce.size() != scene.camera.size())
        throw std::runtime_error("a camera ray leaves the room");
    return scene;
}

}  // namespace glint::bench
