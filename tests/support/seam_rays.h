#pragma once

// Rays from within closed meshes at their corners and edges: where rays slip through, if anywhere.

#include <glint/format/mesh.h>
#include <glint/graphics/ray_caster.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace glint::test {

struct ClosedMesh {
    std::string name;
    Mesh mesh;
    double scale = 1.0;  ///< of all coordinates, before
    Vector3d offset = Vector3d(0.0);
    bool torus = false;  ///< of radius 1 around Z; else all of it is seen from all points within 0.3 of the middle
};

/// Tori, a sphere, a cube of many triangles in flat faces, in sizes of 1e-3 to 1e3 and away from the origin: up to
/// 20,480 triangles each, closed by position, front faces outside.
std::vector<ClosedMesh> closedMeshes();

/// The faces of a cube from -1 to 1, each of cells * cells squares in two triangles. All corners are exactly in its
/// planes, and shared bit for bit, if `cells` is a power of two.
Mesh createCellCube(uint32_t cells);

/// From points well within the mesh, every other one at a corner, the rest at points on edges. Directions are rounded,
/// so rays pass on either side of what they aim at. Each leaves the mesh at t = 1, but for rounding.
std::vector<Ray> raysAtSeams(const ClosedMesh& mesh, uint32_t count, uint64_t seed);

struct SeamLeaks {
    uint64_t misses = 0;
    uint64_t beyond = 0;  ///< hits on the far side: t is larger than float64 and its bound allow
    uint64_t wrong = 0;   ///< hits on triangles that the ray passes, or with a t that is not the triangle's
    uint64_t all() const { return misses + beyond + wrong; }
    SeamLeaks& operator+=(const SeamLeaks& other) {
        misses += other.misses;
        beyond += other.beyond;
        wrong += other.wrong;
        return *this;
    }
};

/// Bounds are those of support/hit_accuracy.h.
SeamLeaks countLeaks(const ClosedMesh& mesh, std::span<const Ray> rays, std::span<const RayHit> hits);

}  // namespace glint::test
