#pragma once

// Distances between surfaces, and borders of sets of triangles, by plain means in float64.

#include <glint/format/mesh.h>

#include <array>
#include <compare>
#include <cstdint>
#include <vector>

namespace glint::test {

/// The point of a triangle nearest to a point, by the region of the triangle's plane that it projects to.
Vector3d nearestOnTriangle(const std::array<Vector3d, 3>& triangle, const Vector3d& point);
/// The distance to it.
double distanceToTriangle(const std::array<Vector3d, 3>& triangle, const Vector3d& point);

/// Nearest points of a mesh, by looking at every triangle that may be nearer.
class NearestReference {
public:
    explicit NearestReference(const Mesh& mesh);
    double distance(const Vector3d& point) const;
    /// The point of the mesh that is nearest.
    Vector3d nearest(const Vector3d& point) const;

private:
    struct Item {
        std::array<Vector3d, 3> corners;
        Vector3d center;
        double radius;
    };
    std::vector<Item> items_;
};

/// Points of a mesh's triangles: a triangle's corners, and others so that none of its points is further than `spacing`
/// from one of them.
std::vector<Vector3d> samplePoints(const Mesh& mesh, double spacing);

/// How much more often an edge is run along one way than the other, by position, for all edges where that is not 0: the
/// boundary of the triangles. The same for two sets of triangles if one can stand for the other without a crack.
struct BoundaryEdge {
    std::array<float, 6> ends;
    int64_t count = 0;
    auto operator<=>(const BoundaryEdge&) const = default;
};
std::vector<BoundaryEdge> boundaryOf(const Mesh& mesh);

}  // namespace glint::test
