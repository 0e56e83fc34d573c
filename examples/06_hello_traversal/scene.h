#pragma once

// The scene of the tutorial in numbers, apart from how it is drawn: tests and benchmarks use it too.

#include "common/torus.h"

#include <glint/geometry/triangle_order.h>
#include <glint/math/camera.h>

#include <array>
#include <cmath>
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
