#pragma once

// The scene of the tutorial in numbers, apart from how it is drawn: tests and benchmarks use it too.

#include "common/torus.h"

#include <glint/geometry/triangle_order.h>
#include <glint/math/camera.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <vector>

/// Three meshes and 163 instances: 9 x 9 models and as many dodecahedra between them, 5 units apart and 4 above a
/// plane.
class TraversalScene {
public:
    static constexpr uint32_t grid = 9;
    static constexpr float pitch = 5.0f;
    static constexpr float height = 4.0f;
    static constexpr float plane_size = 163.84f;
    static constexpr float dodecahedron_size = 0.4f;  ///< from its middle to where it reaches farthest along an axis
    static constexpr float model_size = 3.7f;         ///< longest side
    /// Meshes, and the hit groups of their instances: each has one for primary rays and one for reflections.
    static constexpr uint32_t mesh_model = 0, mesh_dodecahedron = 1, mesh_plane = 2, mesh_count = 3;

    struct Instance {
        uint32_t mesh = 0;
        glint::Transform3x4 transform;  ///< object to world
    };

    /// 60 vertices and 36 triangles, flat: each pentagon has corners of its own.
    static glint::Mesh dodecahedron();

    /// The model is the torus of 90,112 triangles, or the mesh of a file.
    static glint::Expected<TraversalScene> load(const std::filesystem::path& path = {});

    const glint::Mesh& mesh(uint32_t index) const { return meshes_[index]; }
    const std::vector<Instance>& instances() const { return instances_; }

    static glint::Camera camera(float time, float aspect) {
        const glint::Matrix4x4f turn = glint::rotateZ(4.0f * std::sin(time));
        const float distance = 1.0f + 0.2f * std::sin(0.5f * time);
        const glint::Vector3f from(16.0f * distance, 0.0f, (8.0f + 0.5f * std::cos(2.0f * time)) * distance);
        return glint::Camera().lookAt(glint::transformPoint(turn, from), target()).perspective(60.0f, aspect);
    }
    /// What it looks at.
    static glint::Vector3f target() { return {0.0f, 0.0f, -3.0f}; }
    /// Where the light is.
    static glint::Vector3f light(float time) {
        return {12.0f + 2.0f * std::sin(0.5f * time), 2.0f * std::cos(0.5f * time), 8.0f};
    }

private:
    std::array<glint::Mesh, mesh_count> meshes_;
    std::vector<Instance> instances_;
};

// The corners are those of a cube and of three rectangles of sides 2 / phi and 2 phi. A face lies around each corner of
// an icosahedron, (0, 1, phi) and its like: its corners are the five that are nearest to that.
inline glint::Mesh TraversalScene::dodecahedron() {
    constexpr double phi = 1.618033988749895;
    std::vector<glint::Vector3d> corners, axes;
    for (int i = 0; i < 8; i++) corners.emplace_back(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < 4; i++) {
            const double first = i & 1 ? 1 : -1, second = i & 2 ? 1 : -1;
            glint::Vector3d corner(0.0), face(0.0);
            corner[(axis + 1) % 3] = first / phi;
            corner[(axis + 2) % 3] = second * phi;
            face[(axis + 1) % 3] = first * phi;
            face[(axis + 2) % 3] = second;
            corners.push_back(corner);
            axes.push_back(glm::normalize(face));
        }

    glint::Mesh mesh;
    for (const glint::Vector3d& normal : axes) {
        const glint::Vector3d side = glm::normalize(glm::cross(normal, glint::Vector3d(0.3, 0.5, 0.8)));
        const glint::Vector3d up = glm::cross(normal, side);
        std::vector<glint::Vector3d> face = corners;
        std::nth_element(face.begin(), face.begin() + 4, face.end(),
                         [&](const glint::Vector3d& a, const glint::Vector3d& b) {
                             return glm::dot(a, normal) > glm::dot(b, normal);
                         });
        face.resize(5);
        // Counter-clockwise, seen from outside.
        const auto angle = [&](const glint::Vector3d& p) { return std::atan2(glm::dot(p, up), glm::dot(p, side)); };
        std::sort(face.begin(), face.end(),
                  [&](const glint::Vector3d& a, const glint::Vector3d& b) { return angle(a) < angle(b); });
        const auto first = static_cast<uint32_t>(mesh.positions.size());
        for (const glint::Vector3d& corner : face) {
            mesh.positions.emplace_back(corner * (static_cast<double>(dodecahedron_size) / phi));
            mesh.normals.emplace_back(normal);
        }
        for (uint32_t i = 1; i < 4; i++) mesh.indices.insert(mesh.indices.end(), {first, first + i, first + i + 1});
    }
    return mesh;
}

inline glint::Expected<TraversalScene> TraversalScene::load(const std::filesystem::path& path) {
    glint::Expected<glint::Mesh> model = path.empty() ? refinedTorus() : glint::Mesh::load(path);
    if (!model) return glint::unexpected(model.error());
    model->parts.clear();
    // Lavapipe traces triangles that are near in space and in memory many times faster.
    glint::sortTriangles(*model);
    if (model->normals.empty()) model->createNormals();

    // The torus lies, and leans; models of files mostly have Y up and Z to the front: they stand, and face the camera.
    const glint::BoundBox box = model->bounds();
    const glint::Vector3f size = box.size();
    const glint::Matrix4x4f turn =
        path.empty() ? glint::Matrix4x4f(1.0f) : glint::rotateZ(90.0f) * glint::rotateX(90.0f);
    const glint::Matrix4x4f pose =
        turn * glint::scale(glint::Vector3f(model_size / std::max({size.x, size.y, size.z, 1e-30f}))) *
        glint::translate(-box.center());

    TraversalScene scene;
    scene.meshes_ = {std::move(*model), dodecahedron(), glint::createPlane(plane_size, 8)};
    const auto placeOf = [](uint32_t i, float offset) {
        const uint32_t column = i % grid, row = i / grid;
        return glint::Vector3f((static_cast<float>(column) - 0.5f * (grid - 1) + offset) * pitch,
                               (static_cast<float>(row) - 0.5f * (grid - 1) + offset) * pitch, height);
    };
    for (uint32_t i = 0; i < grid * grid; i++) {
        const glint::Matrix4x4f lean = path.empty()
                                           ? glint::rotateZ(40.0f * static_cast<float>(i)) * glint::rotateX(55.0f)
                                           : glint::Matrix4x4f(1.0f);
        scene.instances_.push_back({mesh_model, glint::Transform3x4(glint::translate(placeOf(i, 0.0f)) * lean * pose)});
    }
    for (uint32_t i = 0; i < grid * grid; i++)
        scene.instances_.push_back({mesh_dodecahedron, glint::Transform3x4(glint::translate(placeOf(i, 0.5f)))});
    scene.instances_.push_back({mesh_plane, glint::Transform3x4()});
    return scene;
}
