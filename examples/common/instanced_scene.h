#pragma once

// The scene of 03, 04 and 05 in numbers, apart from how it is drawn: tests and benchmarks use it too.

#include "common/torus.h"

#include <glint/geometry/triangle_order.h>
#include <glint/math/camera.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

/// A mesh and where its instances are: two layers of 48 x 48, 4 units apart in the layer and 2 from layer to layer,
/// that turn against each other about the Z axis. Or one instance, for a mesh of its own.
class InstancedScene {
public:
    static constexpr uint32_t grid = 48;
    static constexpr uint32_t layers = 2;
    static constexpr float pitch = 4.0f;
    static constexpr float layer_distance = 2.0f;
    /// Longest side of the torus, and of every mesh in its place.
    static constexpr float mesh_size = 3.7f;

    /// The scene of a file's mesh, or of the torus if `path` is empty.
    static glint::Expected<InstancedScene> load(const std::filesystem::path& path, bool is_single) {
        glint::Expected<glint::Mesh> mesh = path.empty() ? refinedTorus() : glint::Mesh::load(path);
        if (!mesh) return glint::unexpected(mesh.error());
        InstancedScene scene;
        scene.mesh_ = std::move(*mesh);
        scene.is_single_ = is_single;
        // Lavapipe traces triangles, and instances, that are near in space and in memory many times faster.
        sortTriangles(scene.mesh_);
        if (scene.mesh_.normals.empty()) scene.mesh_.createNormals();
        // The torus rolls along; models of files mostly have Y up and Z to the front: they stand, and face +X.
        const glint::BoundBox box = scene.mesh_.bounds();
        const glint::Vector3f size = box.size();
        const glint::Matrix4x4f turn =
            path.empty() ? glint::rotateY(90.0f) : glint::rotateZ(90.0f) * glint::rotateX(90.0f);
        const float factor = mesh_size / std::max({size.x, size.y, size.z, 1e-30f});
        scene.pose_ = turn * glint::scale(glint::Vector3f(factor)) * glint::translate(-box.center());
        return scene;
    }

    const glint::Mesh& mesh() const { return mesh_; }
    uint32_t instances() const { return is_single_ ? 1 : grid * grid * layers; }

    /// Object to world of every instance at a moment.
    std::vector<glint::Transform3x4> transforms(float time) const {
        if (is_single_) return {glint::Transform3x4(pose_)};
        std::vector<glint::Transform3x4> result;
        result.reserve(instances());
        for (uint32_t z = 0; z < layers; z++) {
            const glint::Matrix4x4f turn = glint::rotateZ((16.0f * static_cast<float>(z) - 8.0f) * time);
            glint::Transform3x4 transform(turn * pose_);
            const glint::Vector3f rest(transform.rows[3], transform.rows[7], transform.rows[11]);
            for (uint32_t i = 0; i < grid * grid; i++) {
                const auto [x, y] = cell(i);
                const glint::Vector3f place((static_cast<float>(x) - 0.5f * (grid - 1)) * pitch,
                                            (static_cast<float>(y) - 0.5f * (grid - 1)) * pitch,
                                            (static_cast<float>(z) - 0.5f * (layers - 1)) * layer_distance);
                const glint::Vector3f offset = rest + glint::transformPoint(turn, place);
                for (int row = 0; row < 3; row++) transform.rows[row * 4 + 3] = offset[row];
                result.push_back(transform);
            }
        }
        return result;
    }

    /// Above the layers and nearer to the middle now and then; one mesh is circled.
    glint::Camera camera(float time, float aspect) const {
        const float k = 1.0f - std::cos(0.2f * time);
        const glint::Vector3f from =
            is_single_ ? glint::Vector3f(5.0f, -1.0f, 1.5f) : glint::Vector3f(32.0f + 24.0f * k, 0.0f, 8.0f + 8.0f * k);
        const glint::Matrix4x4f turn = glint::rotateZ((is_single_ ? 20.0f : 2.0f) * time);
        return glint::Camera().lookAt(glint::transformPoint(turn, from), target()).perspective(60.0f, aspect);
    }
    /// What it looks at.
    glint::Vector3f target() const { return {0.0f, 0.0f, is_single_ ? 0.0f : -16.0f}; }

    /// Left of it the picture is plain, right of it coloured by instance; as a share of its width.
    static float split(float time) { return 0.75f + 0.25f * std::cos(time); }

private:
    /// Column and row of an instance in its layer: blocks of 16 x 16, each along a Z-order curve.
    static std::pair<uint32_t, uint32_t> cell(uint32_t i) {
        const uint32_t block = i / 256, inner = i % 256;
        const auto gather = [](uint32_t bits) {
            return (bits & 1) | (bits >> 1 & 2) | (bits >> 2 & 4) | (bits >> 3 & 8);
        };
        return {block % 3 * 16 + gather(inner), block / 3 * 16 + gather(inner >> 1)};
    }

    glint::Mesh mesh_;
    glint::Matrix4x4f pose_ = glint::Matrix4x4f(1.0f);
    bool is_single_ = false;
};
