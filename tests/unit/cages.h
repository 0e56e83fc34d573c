#pragma once

// Cages of subdivision surfaces, for their tests.

#include "support/matchers.h"
#include "support/reference.h"
#include "support/subdivision.h"

#include <glint/geometry/primitives.h>
#include <glint/geometry/refine.h>

#include <gtest/gtest.h>

#include <limits>
#include <set>

namespace glint::test {

inline constexpr float infinity = std::numeric_limits<float>::infinity();
inline constexpr Subdivision catmull_clark = Subdivision::CatmullClark;
inline constexpr Subdivision loop = Subdivision::Loop;

inline PolygonMesh makeMesh(std::vector<Vector3f> positions, const std::vector<std::vector<uint32_t>>& faces) {
    PolygonMesh mesh;
    mesh.positions = std::move(positions);
    mesh.offsets = {0};
    for (const auto& face : faces) {
        mesh.indices.insert(mesh.indices.end(), face.begin(), face.end());
        mesh.offsets.push_back(static_cast<uint32_t>(mesh.indices.size()));
    }
    return mesh;
}

inline PolygonMesh cube() {
    return makeMesh(
        {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}},
        {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}});
}

/// n corners below and above; with a point in the middle of either end, so that there are two vertices of n edges, or
/// with polygons of n corners.
inline PolygonMesh prism(uint32_t n, bool with_poles, bool open = false) {
    std::vector<Vector3f> positions;
    for (const float z : {-1.0f, 1.0f})
        for (uint32_t i = 0; i < n; i++) {
            const float angle = 2.0f * pi * static_cast<float>(i) / static_cast<float>(n);
            positions.emplace_back(std::cos(angle), std::sin(angle), z);
        }
    std::vector<std::vector<uint32_t>> faces;
    std::vector<uint32_t> bottom, top;
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t j = (i + 1) % n;
        faces.push_back({i, j, n + j, n + i});
        bottom.insert(bottom.begin(), i);
        top.push_back(n + i);
        if (!with_poles) continue;
        faces.push_back({j, i, 2 * n});
        if (!open) faces.push_back({n + i, n + j, 2 * n + 1});
    }
    if (with_poles) {
        positions.emplace_back(0, 0, -1.4);
        if (!open) positions.emplace_back(0, 0, 1.3);
    } else {
        faces.push_back(bottom);
        if (!open) faces.push_back(top);
    }
    return makeMesh(positions, faces);
}

/// Quadrilaterals cut in two, for Loop.
inline PolygonMesh triangles(const PolygonMesh& mesh) {
    Expected<Mesh> cut = toTriangles(mesh);
    EXPECT_THAT(cut, IsOk());
    PolygonMesh result = *toPolygons(*cut);
    result.creases = mesh.creases;
    return result;
}

/// A grid of columns * rows points in the plane, moved at random by up to `noise`.
inline PolygonMesh grid(uint32_t columns, uint32_t rows, float noise, bool cut = false) {
    Random random(7);
    std::vector<Vector3f> positions;
    std::vector<std::vector<uint32_t>> faces;
    for (uint32_t j = 0; j < rows; j++)
        for (uint32_t i = 0; i < columns; i++)
            positions.push_back(Vector3f(i, j, 0) + noise * Vector3f(random.direction()));
    for (uint32_t j = 0; j + 1 < rows; j++)
        for (uint32_t i = 0; i + 1 < columns; i++) {
            const uint32_t a = j * columns + i, b = a + 1, c = b + columns, d = a + columns;
            if (cut)
                faces.insert(faces.end(), {{a, b, c}, {a, c, d}});
            else
                faces.push_back({a, b, c, d});
        }
    return makeMesh(positions, faces);
}

inline void shake(PolygonMesh& mesh, uint64_t seed, double amount = 0.3) {
    Random random(seed);
    for (Vector3f& p : mesh.positions) p += Vector3f(amount * random.direction());
}

inline std::set<std::pair<uint32_t, uint32_t>> edgesOf(const PolygonMesh& mesh) {
    std::set<std::pair<uint32_t, uint32_t>> edges;
    for (size_t face = 0; face < mesh.faceCount(); face++)
        for (uint32_t corner = mesh.offsets[face]; corner < mesh.offsets[face + 1]; corner++) {
            const uint32_t next = corner + 1 < mesh.offsets[face + 1] ? corner + 1 : mesh.offsets[face];
            edges.insert(std::minmax(mesh.indices[corner], mesh.indices[next]));
        }
    return edges;
}

/// Creases the given share of the edges; `sharpness` 0 chooses one of 0.25, 0.5, ... 3 for each.
inline void crease(PolygonMesh& mesh, uint64_t seed, double share, float sharpness) {
    Random random(seed);
    for (const auto& [a, b] : edgesOf(mesh))
        if (random.uniform() < share)
            mesh.creases.push_back(
                {a, b, sharpness > 0 ? sharpness : 0.25f * static_cast<float>(1 + random.below(12))});
}

inline long eulerCharacteristic(const PolygonMesh& mesh) {
    return static_cast<long>(mesh.positions.size()) - static_cast<long>(edgesOf(mesh).size()) +
           static_cast<long>(mesh.faceCount());
}

struct CageCase {
    const char* name;
    Subdivision scheme;
    PolygonMesh cage;
    bool closed;
};

/// Cages with vertices of 3 to 9 edges, polygons of 3 to 7 corners, closed and open, with and without creases.
inline std::vector<CageCase> cageCases() {
    std::vector<CageCase> list;
    const auto add = [&](const char* name, PolygonMesh mesh, bool closed) {
        list.push_back({name, catmull_clark, mesh, closed});
        PolygonMesh cut = triangles(mesh);
        if (cut.indices.size() / 3 == cut.faceCount()) list.push_back({name, loop, std::move(cut), closed});
    };
    add("cube", cube(), true);
    add("prism with polygons", prism(7, false), true);
    add("prism with poles", prism(9, true), true);
    add("open prism", prism(6, true, true), false);
    add("open prism with polygon", prism(5, false, true), false);
    add("grid", grid(4, 5, 0.2f), false);
    add("one triangle", makeMesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}), false);
    list.push_back({"grid of triangles", loop, grid(5, 4, 0.2f, true), false});
    list.push_back({"torus", catmull_clark, createTorusQuads(2.0f, 0.7f, 5, 4), true});
    const size_t plain = list.size();
    for (size_t i = 0; i < plain; i++) {
        shake(list[i].cage, i);
        CageCase creased = list[i];
        creased.cage.creases.clear();
        crease(creased.cage, i, 0.3, infinity);
        list.push_back(creased);
    }
    return list;
}

/// Half a unit in the last place of float32, and rounding of float64 (see refine).
inline double roundingOf(const Vector3d& p, double largest) {
    return 0x1p-24 * std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) + 1e-13 * largest;
}

inline double largestOf(const PolygonMesh& mesh) {
    double largest = 0.0;
    for (const Vector3f& p : mesh.positions)
        largest = std::max({largest, std::abs(double{p.x}), std::abs(double{p.y}), std::abs(double{p.z})});
    return largest;
}

inline bool isClosedPolygons(const PolygonMesh& mesh) {
    const Expected<Mesh> cut = toTriangles(mesh);
    return cut && isClosed(*cut);
}

}  // namespace glint::test
