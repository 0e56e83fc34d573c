#include "support/seam_rays.h"

#include "support/hit_accuracy.h"

#include <glint/geometry/primitives.h>

#include <cmath>

namespace glint::test {

Mesh createCellCube(uint32_t cells) {
    Mesh mesh;
    for (int face = 0; face < 6; face++) {
        const int axis = face / 2;
        const float side = face % 2 == 0 ? -1.0f : 1.0f;
        const auto first = static_cast<uint32_t>(mesh.positions.size());
        for (uint32_t y = 0; y <= cells; y++) {
            for (uint32_t x = 0; x <= cells; x++) {
                Vector3f p;
                p[axis] = side;
                p[(axis + 1) % 3] = (2.0f * static_cast<float>(x) / static_cast<float>(cells) - 1.0f) * side;
                p[(axis + 2) % 3] = 2.0f * static_cast<float>(y) / static_cast<float>(cells) - 1.0f;
                mesh.positions.push_back(p);
            }
        }
        for (uint32_t y = 0; y < cells; y++) {
            for (uint32_t x = 0; x < cells; x++) {
                const uint32_t i = first + y * (cells + 1) + x;
                for (const uint32_t corner : {i, i + 1, i + cells + 2, i, i + cells + 2, i + cells + 1})
                    mesh.indices.push_back(corner);
            }
        }
    }
    return mesh;
}

std::vector<ClosedMesh> closedMeshes() {
    const Mesh torus = createTorus(1.0f, 0.4f, 100, 50);
    std::vector<ClosedMesh> list = {
        {"torus", torus, 1.0, {}, true},
        {"sphere", createSphere(1.0f, 5), 1.0, {}, false},
        {"cube", createCellCube(32), 1.0, {}, false},
        {"small torus", torus, 1e-3, {1.0, 0.5, -0.25}, true},
        {"large sphere", createSphere(1.0f, 4), 1e3, {100.0, -300.0, 700.0}, false},
        {"torus away", torus, 1.0, {300.0, 100.0, -200.0}, true},
        {"cube away", createCellCube(32), 1.0, {20.0, 10.0, -30.0}, false},
    };
    for (ClosedMesh& each : list)
        for (Vector3f& p : each.mesh.positions) p = Vector3f(Vector3d(p) * each.scale + each.offset);
    return list;
}

namespace {

// Not inlined: where it is, GCC 12 forgets that the origin has been rounded (its vectoriser takes float(x) back to
// double as x), and the ray misses what it is aimed at.
[[gnu::noinline]] Ray rayTo(const Vector3f& origin, const Vector3d& target) {
    Ray ray;
    ray.origin = origin;
    ray.direction = Vector3f(target - Vector3d(origin));
    return ray;
}

}  // namespace

std::vector<Ray> raysAtSeams(const ClosedMesh& mesh, uint32_t count, uint64_t seed) {
    Random random(seed);
    std::vector<Ray> rays(count);
    const auto& [name, triangles, scale, offset, torus] = mesh;
    for (uint32_t i = 0; i < count; i++) {
        const uint64_t triangle = random.below(triangles.triangleCount());
        const Vector3d a(triangles.positions[triangles.indices[3 * triangle + i % 3]]);
        const Vector3d b(triangles.positions[triangles.indices[3 * triangle + (i + 1) % 3]]);
        const Vector3d target = i % 2 == 0 ? a : a + (b - a) * random.uniform();
        Vector3d from;
        if (torus) {
            // On the circle within the tube, at the angle of the target or a bit beside it.
            const Vector3d out = target - offset;
            const double angle = std::atan2(out.y, out.x) + random.uniform(-0.2, 0.2);
            from = Vector3d(std::cos(angle), std::sin(angle), 0.0);
        } else {
            from = Vector3d(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3));
        }
        rays[i] = rayTo(Vector3f(from * scale + offset), target);
    }
    return rays;
}

SeamLeaks countLeaks(const ClosedMesh& mesh, std::span<const Ray> rays, std::span<const RayHit> hits) {
    SeamLeaks leaks;
    for (size_t i = 0; i < rays.size(); i++) {
        if (!hits[i].isHit()) {
            leaks.misses++;
            continue;
        }
        const Ray& ray = rays[i];
        const HitBound bound = hitBound(mesh.mesh, hits[i].primitive, ray);
        const uint32_t* corners = &mesh.mesh.indices[3 * size_t{hits[i].primitive}];
        const Vector3d a(mesh.mesh.positions[corners[0]]);
        const Vector3d normal =
            glm::cross(Vector3d(mesh.mesh.positions[corners[1]]) - a, Vector3d(mesh.mesh.positions[corners[2]]) - a);
        const Vector3d origin(ray.origin);
        const Vector3d direction(ray.direction);
        const double t = glm::dot(a - origin, normal) / glm::dot(direction, normal);
        // The direction's rounding moves where the ray comes through by 2^-24 of it along each axis. That is less than
        // the lateral 16 * 2^-24 of the reach in the bound of t.
        if (hits[i].t > 1.0 + 2.0 * bound.t)
            leaks.beyond++;
        else if (!(std::abs(hits[i].t - t) <= bound.t) ||
                 (borderDistance(mesh.mesh, hits[i].primitive, ray) > bound.edge &&
                  !intersectTriangle(mesh.mesh, hits[i].primitive, origin, direction).hit))
            leaks.wrong++;
    }
    return leaks;
}

}  // namespace glint::test
