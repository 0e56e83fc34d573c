#include <glint/geometry/triangle_order.h>

#include <algorithm>
#include <array>

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
    std::array<uint32_t, 3> corners;
};

}  // namespace

void sortTriangles(Mesh& mesh) {
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
            const Vector3f cell = glm::clamp((centre - box.min) / size * 1024.0f, 0.0f, 1023.0f);
            triangles[i].code = spread(static_cast<uint32_t>(cell.x)) | spread(static_cast<uint32_t>(cell.y)) << 1 |
                                spread(static_cast<uint32_t>(cell.z)) << 2;
            std::copy(corners, corners + 3, triangles[i].corners.begin());
        }
        std::stable_sort(triangles.begin(), triangles.end(),
                         [](const SortedTriangle& a, const SortedTriangle& b) { return a.code < b.code; });
        for (size_t i = 0; i < triangles.size(); i++)
            std::copy(triangles[i].corners.begin(), triangles[i].corners.end(), &mesh.indices[first + i * 3]);
    };
    if (mesh.parts.empty()) return sort(0, mesh.indices.size());
    for (const MeshPart& part : mesh.parts) sort(part.first_index, part.index_count);
}

}  // namespace glint
