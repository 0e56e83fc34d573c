#pragma once

// Meshes in hierarchies of the software tracing engine.

#include "support/reference.h"

#include <glint/format/mesh.h>
#include <glint/tracing/detail/device_build.h>
#include <glint/tracing/detail/hierarchy.h>
#include <glint/tracing/detail/instances.h>

#include <stdexcept>
#include <utility>

namespace glint::test {

/// The triangles of a mesh, which has to outlive the geometry.
inline detail::TriangleGeometry geometryOf(const Mesh& mesh) {
    detail::TriangleGeometry geometry;
    geometry.positions = reinterpret_cast<const std::byte*>(mesh.positions.data());
    geometry.vertices = static_cast<uint32_t>(mesh.positions.size());
    geometry.indices = reinterpret_cast<const std::byte*>(mesh.indices.data());
    geometry.index = detail::TriangleGeometry::Index::Uint32;
    geometry.triangles = static_cast<uint32_t>(mesh.triangleCount());
    return geometry;
}

/// Throws std::runtime_error where there is none.
inline detail::Hierarchy hierarchyOf(const detail::TriangleGeometry& geometry,
                                     detail::BuildMode mode = detail::BuildMode::Quality, ThreadPool* pool = nullptr,
                                     detail::NodeForm form = detail::NodeForm::Packed) {
    Expected<detail::Hierarchy> hierarchy = detail::buildHierarchy(std::span(&geometry, 1), mode, pool, form);
    if (!hierarchy) throw std::runtime_error(hierarchy.error().text());
    return std::move(*hierarchy);
}

inline detail::Hierarchy hierarchyOf(const Mesh& mesh, detail::BuildMode mode = detail::BuildMode::Quality,
                                     ThreadPool* pool = nullptr, detail::NodeForm form = detail::NodeForm::Packed) {
    return hierarchyOf(geometryOf(mesh), mode, pool, form);
}

/// The same in device memory, each buffer from its begin.
inline detail::DeviceGeometry deviceGeometryOf(const Mesh& mesh) {
    detail::DeviceGeometry geometry;
    geometry.primitives = static_cast<uint32_t>(mesh.triangleCount());
    geometry.vertices = static_cast<uint32_t>(mesh.positions.size());
    geometry.index = detail::TriangleGeometry::Index::Uint32;
    return geometry;
}

/// Small triangles in a cube.
inline Mesh soup(uint32_t triangles, uint64_t seed, double size = 1.0, double offset = 0.0) {
    Random random(seed);
    Mesh mesh;
    for (uint32_t i = 0; i < triangles; i++) {
        const Vector3d center(random.uniform(), random.uniform(), random.uniform());
        for (uint32_t c = 0; c < 3; c++) {
            mesh.indices.push_back(3 * i + c);
            mesh.positions.push_back(Vector3f((center + 0.1 * random.direction()) * size + offset));
        }
    }
    return mesh;
}

/// A top level over instances of one hierarchy, of its form, and that hierarchy behind it. The masks are 0xff.
inline std::vector<detail::Texel> instancesOf(const detail::Hierarchy& model, std::span<const Transform3x4> transforms,
                                              ThreadPool* pool = nullptr) {
    std::vector<detail::HierarchyInstance> instances(transforms.size());
    const auto top = [&](uint32_t texel) {
        for (size_t i = 0; i < instances.size(); i++) {
            instances[i].transform = transforms[i];
            instances[i].bounds = boundsOf(model);
            instances[i].texel = texel;
        }
        Expected<detail::Hierarchy> hierarchy = detail::buildHierarchy(
            std::span<const detail::HierarchyInstance>(instances), detail::BuildMode::Quality, pool, model.form);
        if (!hierarchy) throw std::runtime_error(hierarchy.error().text());
        return std::move(*hierarchy);
    };
    // Its size does not depend on where the model is.
    const detail::Hierarchy hierarchy = top(static_cast<uint32_t>(top(0).texels.size()));
    std::vector<detail::Texel> texels(hierarchy.texels.begin(), hierarchy.texels.end());
    texels.insert(texels.end(), model.texels.begin(), model.texels.end());
    return texels;
}

}  // namespace glint::test
