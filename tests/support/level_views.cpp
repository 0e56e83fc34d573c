#include "support/level_views.h"

#include <glm/geometric.hpp>

#include <cmath>

namespace glint::test {

const char* nameOf(ViewKind kind) {
    switch (kind) {
        case ViewKind::Near: return "near";
        case ViewKind::Far: return "far";
        case ViewKind::Inside: return "inside";
        case ViewKind::Grazing: return "grazing";
        default: return "wide";
    }
}

LevelView levelView(Random& random, ViewKind kind, const Mesh& mesh, float aspect) {
    const BoundBox box = mesh.bounds();
    const Vector3d center(box.center());
    const double radius = 0.5 * glm::length(Vector3d(box.size()));
    const auto between = [&](double low, double high) { return radius * std::exp(random.uniform(low, high)); };
    Vector3d eye = center + random.direction() * between(0.2, 1.0), at = center;
    double fov = 60.0;
    switch (kind) {
        case ViewKind::Near: break;
        case ViewKind::Far: eye = center + random.direction() * between(1.0, 3.5); break;
        case ViewKind::Inside:
            eye = center + random.direction() * radius * random.uniform();
            at = random.below(2) == 0 ? center : eye + random.direction();
            break;
        case ViewKind::Grazing: {
            // Above a triangle, towards where its edge goes.
            const size_t triangle = random.below(mesh.triangleCount()) * 3;
            const auto corner = [&](size_t k) { return Vector3d(mesh.positions[mesh.indices[triangle + k]]); };
            const Vector3d normal = glm::cross(corner(1) - corner(0), corner(2) - corner(0));
            if (glm::length(normal) == 0.0) break;
            eye = corner(0) + glm::normalize(normal) * between(-5.0, -2.0);
            at = eye + (corner(1) - corner(0)) * (random.below(2) == 0 ? 1.0 : -1.0);
            break;
        }
        case ViewKind::Wide:
            eye = center + random.direction() * between(-0.5, 1.0);
            fov = random.uniform(120.0, 170.0);
            break;
    }
    LevelView view;
    const Matrix4x4f to_world = random.below(2) == 0
                                    ? Matrix4x4f(1.0f)
                                    : translate({3, 1, 2}) * rotateX(40.0f) * scale({1.0f, -1.5f, 0.3f}) *
                                          rotateZ(static_cast<float>(random.uniform(0, 360)));
    view.instance = Transform3x4(to_world);
    view.camera = Camera()
                      .lookAt(transformPoint(to_world, Vector3f(eye)), transformPoint(to_world, Vector3f(at)))
                      .perspective(static_cast<float>(fov), aspect, static_cast<float>(radius * 0.01))
                      .parameters();
    return view;
}

}  // namespace glint::test
