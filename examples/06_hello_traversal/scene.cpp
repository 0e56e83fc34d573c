#include "06_hello_traversal/scene.h"

#include <algorithm>

using namespace glint;

// The corners are those of a cube and of three rectangles of sides 2 / phi and 2 phi. A face lies around each corner of
// an icosahedron, (0, 1, phi) and its like: its corners are the five that are nearest to that.
Mesh TraversalScene::dodecahedron() {
    constexpr double phi = 1.618033988749895;
    std::vector<Vector3d> corners, axes;
    for (int i = 0; i < 8; i++) corners.emplace_back(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < 4; i++) {
            const double first = i & 1 ? 1 : -1, second = i & 2 ? 1 : -1;
            Vector3d corner(0.0), face(0.0);
            corner[(axis + 1) % 3] = first / phi;
            corner[(axis + 2) % 3] = second * phi;
            face[(axis + 1) % 3] = first * phi;
            face[(axis + 2) % 3] = second;
            corners.push_back(corner);
            axes.push_back(glm::normalize(face));
        }

    Mesh mesh;
    for (const Vector3d& normal : axes) {
        const Vector3d side = glm::normalize(glm::cross(normal, Vector3d(0.3, 0.5, 0.8)));
        const Vector3d up = glm::cross(normal, side);
        std::vector<Vector3d> face = corners;
        std::nth_element(face.begin(), face.begin() + 4, face.end(), [&](const Vector3d& a, const Vector3d& b) {
            return glm::dot(a, normal) > glm::dot(b, normal);
        });
        face.resize(5);
        // Counter-clockwise, seen from outside.
        const auto angle = [&](const Vector3d& p) { return std::atan2(glm::dot(p, up), glm::dot(p, side)); };
        std::sort(face.begin(), face.end(), [&](const Vector3d& a, const Vector3d& b) { return angle(a) < angle(b); });
        const auto first = static_cast<uint32_t>(mesh.positions.size());
        for (const Vector3d& corner : face) {
            mesh.positions.emplace_back(corner * (static_cast<double>(dodecahedron_size) / phi));
            mesh.normals.emplace_back(normal);
        }
        for (uint32_t i = 1; i < 4; i++) mesh.indices.insert(mesh.indices.end(), {first, first + i, first + i + 1});
    }
    return mesh;
}

Expected<TraversalScene> TraversalScene::load(const std::filesystem::path& path) {
    Expected<Mesh> model = path.empty() ? refinedTorus() : Mesh::load(path);
    if (!model) return unexpected(model.error());
    model->parts.clear();
    // Lavapipe traces triangles that are near in space and in memory many times faster.
    sortTriangles(*model);
    if (model->normals.empty()) model->createNormals();

    // The torus lies, and leans; models of files mostly have Y up and Z to the front: they stand, and face the camera.
    const BoundBox box = model->bounds();
    const Vector3f size = box.size();
    const Matrix4x4f turn = path.empty() ? Matrix4x4f(1.0f) : rotateZ(90.0f) * rotateX(90.0f);
    const Matrix4x4f pose =
        turn * scale(Vector3f(model_size / std::max({size.x, size.y, size.z, 1e-30f}))) * translate(-box.center());

    TraversalScene scene;
    scene.meshes_ = {std::move(*model), dodecahedron(), createPlane(plane_size, 8)};
    for (uint32_t i = 0; i < grid * grid; i++) {
        const Vector3f place((static_cast<float>(i % grid) - 0.5f * (grid - 1)) * pitch,
                             (static_cast<float>(i / grid) - 0.5f * (grid - 1)) * pitch, height);
        const Matrix4x4f lean =
            path.empty() ? rotateZ(40.0f * static_cast<float>(i)) * rotateX(55.0f) : Matrix4x4f(1.0f);
        scene.instances_.push_back({mesh_model, Transform3x4(translate(place) * lean * pose)});
    }
    for (uint32_t i = 0; i < grid * grid; i++) {
        const Vector3f place((static_cast<float>(i % grid) - 0.5f * (grid - 1) + 0.5f) * pitch,
                             (static_cast<float>(i / grid) - 0.5f * (grid - 1) + 0.5f) * pitch, height);
        scene.instances_.push_back({mesh_dodecahedron, Transform3x4(translate(place))});
    }
    scene.instances_.push_back({mesh_plane, Transform3x4()});
    return scene;
}
