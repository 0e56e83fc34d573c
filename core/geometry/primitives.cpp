#include <glint/geometry/primitives.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <unordered_map>

namespace glint {

namespace {

constexpr double two_pi = 6.283185307179586476925;

void addTriangle(Mesh& mesh, uint32_t a, uint32_t b, uint32_t c) { mesh.indices.insert(mesh.indices.end(), {a, b, c}); }

/// Two triangles of the corners a, b, c, d in counter-clockwise order.
void addQuad(Mesh& mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    addTriangle(mesh, a, b, c);
    addTriangle(mesh, a, c, d);
}

/// On the circle of radius 1 that the tube follows.
Vector3d torusCenter(uint32_t column, uint32_t columns) {
    const double around = two_pi * column / columns;
    return {std::cos(around), std::sin(around), 0.0};
}

Vector3d torusNormal(uint32_t column, uint32_t columns, uint32_t row, uint32_t rows) {
    const double across = two_pi * row / rows;
    return torusCenter(column, columns) * std::cos(across) + Vector3d(0, 0, std::sin(across));
}

}  // namespace

PolygonMesh createTorusQuads(float ring, float tube, uint32_t ring_segments, uint32_t tube_segments) {
    const uint32_t columns = std::max(ring_segments, 3u);
    const uint32_t rows = std::max(tube_segments, 3u);
    PolygonMesh cage;
    cage.positions.reserve(size_t{columns} * rows);
    cage.indices.reserve(size_t{columns} * rows * 4);
    cage.offsets.reserve(size_t{columns} * rows + 1);
    cage.offsets.push_back(0);
    for (uint32_t i = 0; i < columns; i++) {
        const uint32_t here = i * rows;
        const uint32_t next = (i + 1) % columns * rows;
        for (uint32_t j = 0; j < rows; j++) {
            const Vector3d center = torusCenter(i, columns);
            const Vector3d normal = torusNormal(i, columns, j, rows);
            cage.positions.emplace_back(center * static_cast<double>(ring) + normal * static_cast<double>(tube));
            const uint32_t k = (j + 1) % rows;
            cage.indices.insert(cage.indices.end(), {here + j, next + j, next + k, here + k});
            cage.offsets.push_back(static_cast<uint32_t>(cage.indices.size()));
        }
    }
    return cage;
}

Mesh createTorus(float ring, float tube, uint32_t ring_segments, uint32_t tube_segments) {
    PolygonMesh cage = createTorusQuads(ring, tube, ring_segments, tube_segments);
    const uint32_t columns = std::max(ring_segments, 3u);
    const uint32_t rows = std::max(tube_segments, 3u);
    Mesh mesh;
    mesh.positions = std::move(cage.positions);
    mesh.normals.reserve(mesh.positions.size());
    for (uint32_t i = 0; i < columns; i++)
        for (uint32_t j = 0; j < rows; j++) mesh.normals.emplace_back(torusNormal(i, columns, j, rows));
    mesh.indices.reserve(cage.indices.size() / 4 * 6);
    for (size_t i = 0; i < cage.indices.size(); i += 4)
        addQuad(mesh, cage.indices[i], cage.indices[i + 1], cage.indices[i + 2], cage.indices[i + 3]);
    return mesh;
}

Mesh createSphere(float radius, uint32_t subdivisions) {
    // Corners of three golden rectangles.
    const double g = (1.0 + std::sqrt(5.0)) / 2.0;
    std::vector<Vector3d> points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                                    {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    for (Vector3d& point : points) point = glm::normalize(point);
    std::vector<Vector3u> faces = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                                   {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                                   {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};

    for (uint32_t step = 0; step < std::min(subdivisions, 10u); step++) {
        std::unordered_map<uint64_t, uint32_t> middles;
        middles.reserve(faces.size() * 3 / 2);
        const auto middle = [&](uint32_t a, uint32_t b) {
            const uint64_t edge = static_cast<uint64_t>(std::min(a, b)) << 32 | std::max(a, b);
            const auto [entry, is_new] = middles.try_emplace(edge, static_cast<uint32_t>(points.size()));
            if (is_new) points.push_back(glm::normalize(points[a] + points[b]));
            return entry->second;
        };
        std::vector<Vector3u> finer;
        finer.reserve(faces.size() * 4);
        for (const Vector3u& f : faces) {
            const Vector3u m(middle(f.x, f.y), middle(f.y, f.z), middle(f.z, f.x));
            finer.insert(finer.end(), {{f.x, m.x, m.z}, {f.y, m.y, m.x}, {f.z, m.z, m.y}, m});
        }
        faces = std::move(finer);
    }

    Mesh mesh;
    for (const Vector3d& point : points) {
        mesh.positions.emplace_back(point * static_cast<double>(radius));
        mesh.normals.emplace_back(point);
    }
    mesh.indices.reserve(faces.size() * 3);
    for (const Vector3u& f : faces) addTriangle(mesh, f.x, f.y, f.z);
    return mesh;
}

Mesh createBox(const Vector3f& size) {
    const Vector3f half = size * 0.5f;
    Mesh mesh;
    for (int axis = 0; axis < 3; axis++) {
        for (const float side : {-1.0f, 1.0f}) {
            Vector3f normal(0.0f), x(0.0f), y(0.0f);
            normal[axis] = side;
            x[(axis + 1) % 3] = side;  // mirrored together with the normal, so that x, y, normal stay right-handed
            y[(axis + 2) % 3] = 1.0f;
            const auto first = static_cast<uint32_t>(mesh.positions.size());
            for (const Vector2f corner : {Vector2f(0, 0), Vector2f(1, 0), Vector2f(1, 1), Vector2f(0, 1)}) {
                mesh.positions.push_back((normal + x * (2 * corner.x - 1) + y * (2 * corner.y - 1)) * half);
                mesh.normals.push_back(normal);
                mesh.texcoords.push_back(corner);
            }
            addQuad(mesh, first, first + 1, first + 2, first + 3);
        }
    }
    return mesh;
}

Mesh createPlane(float size, uint32_t segments) {
    const uint32_t cells = std::max(segments, 1u);
    Mesh mesh;
    for (uint32_t i = 0; i <= cells; i++) {
        for (uint32_t j = 0; j <= cells; j++) {
            const Vector2f place(static_cast<float>(j) / static_cast<float>(cells),
                                 static_cast<float>(i) / static_cast<float>(cells));
            mesh.positions.emplace_back((place.x - 0.5f) * size, (place.y - 0.5f) * size, 0.0f);
            mesh.normals.emplace_back(0, 0, 1);
            mesh.texcoords.push_back(place);
        }
    }
    for (uint32_t i = 0; i < cells; i++) {
        for (uint32_t j = 0; j < cells; j++) {
            const uint32_t here = i * (cells + 1) + j;
            const uint32_t above = here + cells + 1;
            addQuad(mesh, here, here + 1, above + 1, above);
        }
    }
    return mesh;
}

}  // namespace glint
