#pragma once

// Meshes in hierarchies of the software tracing engine.

#include <glint/format/mesh.h>
#include <glint/tracing/detail/hierarchy.h>

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
                                     detail::BuildMode mode = detail::BuildMode::Quality, ThreadPool* pool = nullptr) {
    Expected<detail::Hierarchy> hierarchy = detail::buildHierarchy(std::span(&geometry, 1), mode, pool);
    if (!hierarchy) throw std::runtime_error(hierarchy.error().text());
    return std::move(*hierarchy);
}

inline detail::Hierarchy hierarchyOf(const Mesh& mesh, detail::BuildMode mode = detail::BuildMode::Quality,
                                     ThreadPool* pool = nullptr) {
    return hierarchyOf(geometryOf(mesh), mode, pool);
}

}  // namespace glint::test
