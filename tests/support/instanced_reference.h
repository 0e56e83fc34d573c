#pragma once

// Closest hits in float64 on many instances of one mesh.

#include "support/reference.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace glint::test {

/// Two levels: the mesh has a hierarchy of boxes, the instances have balls that are all tried. Keeps a reference to the
/// mesh.
class InstancedReference {
public:
    static constexpr uint32_t none = UINT32_MAX;

    struct Hit {
        uint32_t instance = none;  ///< `none`: nothing is hit
        uint32_t triangle = 0;
        double t = 0.0;
        Vector2d barycentrics;  ///< of the second and the third corner
    };

    /// Transforms are affine and can be inverted.
    InstancedReference(const Mesh& mesh, std::span<const Transform3x4> instances);

    /// Closest hit with 0 <= t <= t_max from both sides, passing over instance `skip`. The direction has unit length.
    /// Edges belong to both triangles, with the width of float64's rounding.
    Hit closestHit(const Vector3d& origin, const Vector3d& direction, double t_max, uint32_t skip = none) const;

    /// World to object of an instance: normals become object normals as row vectors times its upper 3 x 3.
    const Matrix4x4d& inverse(uint32_t instance) const { return instances_[instance].inverse; }

private:
    struct Instance {
        Matrix4x4d inverse;
        Vector3d center;  ///< of a ball around it
        double radius = 0.0;
    };
    struct Node {
        Vector3d min, max;
        uint32_t first = 0;  ///< of the two children, or of the leaf's triangles in order_
        uint32_t count = 0;  ///< of triangles; 0 in an inner node
    };
    void build(uint32_t node, uint32_t first, uint32_t count);
    void traverse(const Vector3d& origin, const Vector3d& direction, uint32_t instance, Hit& best) const;
    std::array<Vector3d, 3> corners(uint32_t triangle) const;

    const Mesh& mesh_;
    std::vector<Node> nodes_;
    std::vector<uint32_t> order_;
    std::vector<Instance> instances_;
};

}  // namespace glint::test
