#include "support/bad_meshes.h"

#include "support/hard_meshes.h"

#include <glint/geometry/primitives.h>

#include <cmath>
#include <functional>
#include <limits>

namespace glint::test {

namespace {

Mesh changed(const std::function<void(Mesh&)>& change) {
    Mesh mesh = createTorus(1.0f, 0.4f, 30, 20);
    change(mesh);
    return mesh;
}

Mesh scaled(float factor) {
    return changed([&](Mesh& mesh) {
        for (Vector3f& p : mesh.positions) p *= factor;
    });
}

/// Points at place(i), and `count` triangles of three that follow each other, in a circle.
Mesh strip(uint32_t points, uint32_t count, const std::function<Vector3f(uint32_t)>& place) {
    Mesh mesh;
    for (uint32_t i = 0; i < points; i++) mesh.positions.push_back(place(i));
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t k = 0; k < 3; k++) mesh.indices.push_back((i + k) % points);
    return mesh;
}

}  // namespace

std::vector<BadMesh> badMeshes() {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    std::vector<BadMesh> list;
    const auto refused = [&](const char* name, const char* id, Mesh mesh) {
        list.push_back({name, std::move(mesh), id, id});
    };
    const auto valid = [&](const char* name, Mesh mesh, const char* no_graph = "") {
        list.push_back({name, std::move(mesh), "", no_graph});
    };
    refused("nothing", "mesh.no_faces", Mesh());
    refused("points without triangles", "mesh.no_faces", changed([](Mesh& mesh) { mesh.indices.clear(); }));
    refused("two thirds of a triangle", "mesh.index_count", changed([](Mesh& mesh) { mesh.indices.pop_back(); }));
    refused("an index beyond the vertices", "mesh.index_range", changed([](Mesh& mesh) { mesh.indices[7] = 600; }));
    refused("the largest index", "mesh.index_range", changed([](Mesh& mesh) { mesh.indices[7] = UINT32_MAX; }));
    refused("triangles without vertices", "mesh.index_range", changed([](Mesh& mesh) {
                mesh.positions.clear();
                mesh.normals.clear();
                mesh.texcoords.clear();
            }));
    refused("NaN", "mesh.not_finite", changed([](Mesh& mesh) { mesh.positions[9].y = NAN; }));
    refused("NaN everywhere", "mesh.not_finite", scaled(NAN));
    refused("infinity", "mesh.not_finite", changed([](Mesh& mesh) { mesh.positions[9].z = -infinity; }));
    refused("fewer normals than vertices", "mesh.attribute_count",
            changed([](Mesh& mesh) { mesh.normals.pop_back(); }));
    refused("parts that overlap", "mesh.part_range", changed([](Mesh& mesh) {
                mesh.parts = {{"a", 0, 600}, {"b", 300, 600}};
            }));

    valid("one point", strip(1, 1, [](uint32_t) { return Vector3f(1, 2, 3); }), "graph.no_triangles");
    valid("all vertices equal", strip(500, 2000, [](uint32_t) { return Vector3f(1, 2, 3); }), "graph.no_triangles");
    valid("a line", strip(1000, 998, [](uint32_t i) { return Vector3f(0.001f * static_cast<float>(i), 0, 0); }));
    valid("a line back and forth",
          strip(1000, 2000, [](uint32_t i) { return Vector3f(static_cast<float>(i * 7 % 10), 0, 0); }));
    valid("one triangle", strip(3, 1, [](uint32_t i) { return Vector3f(i == 1, i == 2, 0); }));
    valid("one triangle many times", strip(3, 3000, [](uint32_t i) { return Vector3f(i == 1, i == 2, 0); }));
    valid("needles", strip(3000, 2998, [](uint32_t i) {
              return Vector3f(static_cast<float>(i % 2), 1e-6f * static_cast<float>(i), 0);
          }));
    valid("a fan of hundreds", [] {
        Mesh mesh;
        mesh.positions.push_back({0, 0, 0});
        for (uint32_t i = 0; i < 700; i++) {
            const float angle = 2.0f * pi * static_cast<float>(i) / 700.0f;
            mesh.positions.push_back({std::cos(angle), std::sin(angle), 0.1f * static_cast<float>(i % 2)});
            mesh.indices.insert(mesh.indices.end(), {0, i + 1, (i + 1) % 700 + 1});
        }
        return mesh;
    }());
    valid("doubled", changed([](Mesh& mesh) {
              const std::vector<uint32_t> once = mesh.indices;
              mesh.indices.insert(mesh.indices.end(), once.begin(), once.end());
          }));
    valid("doubled the other way round", changed([](Mesh& mesh) {
              const std::vector<uint32_t> once = mesh.indices;
              mesh.indices.insert(mesh.indices.end(), once.rbegin(), once.rend());
          }));
    valid("open and torn", tornSheet());
    valid("not manifold", nonManifold());
    valid("a soup", soup(7, 60, 2000));
    valid("coordinates of 1e-30", scaled(1e-30f));
    valid("coordinates of 1e-42", scaled(1e-42f));
    valid("coordinates of 1e17", scaled(1e17f));
    valid("coordinates of 1e30", scaled(1e30f), "graph.too_large");
    valid("the largest coordinates", changed([](Mesh& mesh) {
              for (Vector3f& p : mesh.positions)
                  for (int k = 0; k < 3; k++) p[k] = std::copysign(std::numeric_limits<float>::max(), p[k]);
          }),
          "graph.too_large");
    valid("a corner far away", changed([](Mesh& mesh) { mesh.positions[9] = {1e17f, -1e17f, 1e17f}; }));
    valid("normals of NaN", changed([](Mesh& mesh) { mesh.normals[9].y = NAN; }), "mesh.not_finite");
    valid("normals of zero", changed([](Mesh& mesh) {
              for (Vector3f& n : mesh.normals) n = {0, 0, 0};
          }));
    return list;
}

}  // namespace glint::test
