#pragma once

// Closest hits in float64 on meshes too large to try every triangle, and what they say about hits in float32.

#include "support/reference.h"

#include <glint/format/mesh.h>

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace glint::test {

/// A bounding-volume hierarchy in float64 that gives what closestHit gives by trying every triangle, bit for bit: both
/// use the same triangle test, and boxes are wide enough for it. Keeps a reference to the mesh.
class ReferenceHierarchy {
public:
    explicit ReferenceHierarchy(const Mesh& mesh);

    /// Says whether a hit counts.
    using Filter = std::function<bool(const ReferenceHit& hit)>;

    /// Closest hit with t_min <= t <= t_max, of those that the filter lets pass.
    ReferenceHit closestHit(const Vector3d& origin, const Vector3d& direction, double t_min = 0.0, double t_max = 1e300,
                            const Filter& filter = {}) const;

    const Mesh& mesh() const { return mesh_; }

private:
    struct Node {
        Vector3d min, max;
        uint32_t first = 0;  ///< of the children, or of the leaf's triangles in order_
        uint32_t count = 0;  ///< of triangles; 0 in an inner node
    };
    void build(uint32_t node, uint32_t first, uint32_t count, const std::vector<Vector3d>& centres);

    const Mesh& mesh_;
    std::vector<Node> nodes_;
    std::vector<uint32_t> order_;
};

}  // namespace glint::test
