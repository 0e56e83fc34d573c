#pragma once

#include <glint/math/bounds.h>
#include <glint/math/math.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace glint::detail {

/// The point of a triangle that is nearest to `point`, rounding aside; of a triangle without area too.
Vector3d nearestPoint(const std::array<Vector3d, 3>& triangle, const Vector3d& point);

/// Triangles, to find the nearest one of. What it is made from has to outlive it.
class TriangleTree {
public:
    struct Nearest {
        uint32_t triangle = UINT32_MAX;
        double distance2 = 0.0;
    };

    /// `indices` has at least three, all in range; positions are finite.
    TriangleTree(std::span<const Vector3f> positions, std::span<const uint32_t> indices);

    /// The nearest triangle; the search starts from the distance of `guess`, which may be any triangle.
    Nearest nearest(const Vector3d& point, uint32_t guess = 0) const;

    std::array<Vector3d, 3> triangle(uint32_t i) const {
        return {Vector3d(positions_[indices_[i * size_t{3}]]), Vector3d(positions_[indices_[i * size_t{3} + 1]]),
                Vector3d(positions_[indices_[i * size_t{3} + 2]])};
    }
    std::span<const Vector3f> positions() const { return positions_; }
    std::span<const uint32_t> indices() const { return indices_; }
    uint32_t size() const { return static_cast<uint32_t>(order_.size()); }

private:
    struct Node {
        BoundBox box;
        uint32_t first = 0;  ///< inner: the second child, the first one follows the node; leaf: into order_
        uint32_t count = 0;  ///< of triangles; 0 for inner nodes
    };

    uint32_t build(uint32_t begin, uint32_t end, std::vector<Vector3f>& centers);

    std::span<const Vector3f> positions_;
    std::span<const uint32_t> indices_;
    std::vector<uint32_t> order_;
    std::vector<Node> nodes_;
};

}  // namespace glint::detail
