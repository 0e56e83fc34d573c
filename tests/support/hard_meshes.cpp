#include "support/hard_meshes.h"

#include "support/reference.h"

#include <glint/geometry/mesh_optimize.h>
#include <glint/geometry/primitives.h>
#include <glint/geometry/refine.h>

#include <glm/geometric.hpp>

#include <cmath>

namespace glint::test {

namespace {

void append(Mesh& mesh, const Mesh& other, const Matrix4x4f& transform) {
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (const Vector3f& p : other.positions) mesh.positions.push_back(transformPoint(transform, p));
    for (const uint32_t index : other.indices) mesh.indices.push_back(first + index);
}

}  // namespace

Mesh tutorialTorus(uint32_t steps) {
    return *toTriangles(*refine(createTorusQuads(1.07208f, 0.77792f, 16, 11), Subdivision::CatmullClark, steps));
}

Mesh tornSheet() {
    Mesh mesh = createPlane(4.0f, 60);
    for (Vector3f& p : mesh.positions) p.z = 0.2f * std::sin(3.0f * p.x) * std::cos(2.0f * p.y);
    mesh.createNormals();
    Mesh torn = mesh;
    torn.indices.clear();
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        Vector3f center(0.0f);
        for (size_t k = 0; k < 3; k++) center += mesh.positions[mesh.indices[i + k]] / 3.0f;
        if (glm::length(center - Vector3f(0.7f, 0.4f, center.z)) < 0.5f) continue;
        for (size_t k = 0; k < 3; k++) {
            uint32_t vertex = mesh.indices[i + k];
            if (center.x > 0.0f && mesh.positions[vertex].x == 0.0f) {
                torn.positions.push_back(mesh.positions[vertex]);
                torn.normals.push_back(mesh.normals[vertex]);
                torn.texcoords.push_back(mesh.texcoords[vertex] + 0.5f);
                vertex = static_cast<uint32_t>(torn.positions.size()) - 1;
            }
            torn.indices.push_back(vertex);
        }
    }
    return torn;
}

Mesh twoParts() {
    Mesh mesh = createTorus(2.0f, 0.7f, 60, 40);
    const auto half = static_cast<uint32_t>(mesh.indices.size() / 6 * 3);
    mesh.parts = {{"left", 0, half, 3}, {"right", half, static_cast<uint32_t>(mesh.indices.size()) - half, 5}};
    return mesh;
}

Mesh soup(uint64_t seed, size_t points, size_t triangles) {
    Random random(seed);
    Mesh mesh;
    for (size_t i = 0; i < points; i++) mesh.positions.emplace_back(random.direction());
    for (size_t i = 0; i < 3 * triangles; i++) mesh.indices.push_back(static_cast<uint32_t>(random.below(points)));
    return mesh;
}

Mesh nonManifold() {
    Mesh mesh = createTorus(2.0f, 0.7f, 60, 40);
    const std::vector<uint32_t> indices = mesh.indices;
    for (size_t i = 0; i < indices.size(); i += 24) {
        const uint32_t a = indices[i], b = indices[i + 1];
        mesh.positions.push_back(mesh.positions[a] * 1.2f);
        const auto tip = static_cast<uint32_t>(mesh.positions.size()) - 1;
        mesh.indices.insert(mesh.indices.end(), {a, b, tip});
        if (i % 96 == 0) mesh.indices.insert(mesh.indices.end(), {indices[i], indices[i + 1], indices[i + 2]});
        if (i % 120 != 0) continue;
        const auto first = static_cast<uint32_t>(mesh.positions.size());
        for (int k = 0; k < 3; k++)
            mesh.positions.push_back(mesh.positions[indices[i + 2]] * 1.1f + 0.05f * Vector3f(k == 0, k == 1, k == 2));
        for (uint32_t k = 0; k < 3; k++)
            mesh.indices.insert(mesh.indices.end(), {indices[i + 2], first + k, first + (k + 1) % 3});
    }
    mesh.normals.clear();
    return mesh;
}

Mesh boxes(uint64_t seed, uint32_t count, uint32_t cells) {
    // A box of squares, whose sides share the vertices of their edges by position only.
    Mesh box;
    const Mesh side = createPlane(1.0f, cells);
    const Matrix4x4f up = translate({0, 0, 0.5f});
    for (int i = 0; i < 4; i++) append(box, side, rotateX(90.0f * static_cast<float>(i)) * up);
    append(box, side, rotateY(90.0f) * up);
    append(box, side, rotateY(-90.0f) * up);
    // Turning rounds: what is meant to be one half is made so.
    for (Vector3f& p : box.positions)
        for (int k = 0; k < 3; k++)
            p[k] = std::round(p[k] * 2.0f * static_cast<float>(cells)) / 2.0f / static_cast<float>(cells);

    Random random(seed);
    const auto any = [&](double low, double high) { return static_cast<float>(random.uniform(low, high)); };
    Mesh mesh;
    for (uint32_t i = 0; i < count; i++)
        append(mesh, box,
               translate(Vector3f(1.5 * random.direction())) * rotateZ(any(0, 360)) * rotateX(any(0, 360)) *
                   scale({any(0.2, 1.0), any(0.2, 1.0), any(0.2, 1.0)}));
    weld(mesh);
    for (Vector3f& p : mesh.positions) p += Vector3f(0.003 * random.direction());
    return mesh;
}

Mesh spheres() {
    Mesh mesh;
    Random random(9);
    for (int i = 0; i < 60; i++) append(mesh, createSphere(0.3f, 2), translate(Vector3f(4.0 * random.direction())));
    return mesh;
}

}  // namespace glint::test
