#include <glint/geometry/triangle_order.h>

#include <algorithm>
#include <array>
#include <numeric>

namespace glint {

namespace {

/// Spreads 10 bits so that two zeros follow each.
uint32_t spread(uint32_t value) {
    value = (value | value << 16) & 0x030000ff;
    value = (value | value << 8) & 0x0300f00f;
    value = (value | value << 4) & 0x030c30c3;
    return (value | value << 2) & 0x09249249;
}

struct SortedTriangle {
    uint32_t code;
    uint32_t number;  ///< before the sort
    std::array<uint32_t, 3> corners;
};

/// A coordinate of 10 bits; 0 for NaN, which boxes of nearly infinite size give.
uint32_t cellOf(float place) { return place > 0.0f ? static_cast<uint32_t>(std::min(place, 1023.0f)) : 0; }

}  // namespace

std::vector<uint32_t> sortTriangles(Mesh& mesh) {
    std::vector<uint32_t> order(mesh.triangleCount());
    std::iota(order.begin(), order.end(), 0u);
    const BoundBox box = mesh.bounds();
    const Vector3f size = glm::max(box.max - box.min, Vector3f(1e-30f));
    const auto sort = [&](size_t first, size_t count) {
        std::vector<SortedTriangle> triangles(count / 3);
        for (size_t i = 0; i < triangles.size(); i++) {
            const uint32_t* corners = &mesh.indices[first + i * 3];
            const Vector3f& a = mesh.positions[corners[0]];
            const Vector3f& b = mesh.positions[corners[1]];
            const Vector3f& c = mesh.positions[corners[2]];
            const Vector3f centre = (glm::min(a, glm::min(b, c)) + glm::max(a, glm::max(b, c))) * 0.5f;
            const Vector3f cell = (centre - box.min) / size * 1024.0f;
            triangles[i].code = spread(cellOf(cell.x)) | spread(cellOf(cell.y)) << 1 | spread(cellOf(cell.z)) << 2;
            triangles[i].number = static_cast<uint32_t>(first / 3 + i);
            std::copy(corners, corners + 3, triangles[i].corners.begin());
        }
        std::stable_sort(triangles.begin(), triangles.end(),
                         [](const SortedTriangle& a, const SortedTriangle& b) { return a.code < b.code; });
        for (size_t i = 0; i < triangles.size(); i++) {
            std::copy(triangles[i].corners.begin(), triangles[i].corners.end(), &mesh.indices[first + i * 3]);
            order[first / 3 + i] = triangles[i].number;
        }
    };
    if (mesh.parts.empty()) sort(0, mesh.indices.size());
    for (const MeshPart& part : mesh.parts) sort(part.first_index, part.index_count);
    return order;
}

}  // namespace glint
