#pragma once

// What a cut through levels of detail shows against the mesh it stands for, pixel by pixel, in float64.
//
// The promise: a point of one surface has a partner in the other, no further away than the error e of the group that
// the cut shows there, and both lie in that group's ball, in which MeshGraphView::error is at most `pixels`. Where both
// are beyond the near plane, the partner of a point that is seen more than `pixels` within the border of the picture is
// therefore seen within `pixels`. So for each pixel of either picture: search the other surface for a partner. That
// outlines and coverage are within `pixels` follows, and is judged by itself: a pixel that only one picture covers has
// covered ground of the other within `pixels` (of what it covers exactly, not of its pixels' centres, which thin things
// fall between). And of depths: within `pixels` the other picture has something at most e farther away.

#include "support/exact_picture.h"

#include <glint/format/mesh_graph.h>

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace glint::test {

/// What compareLevel finds.
struct LevelComparison {
    uint64_t pixels = 0;       ///< compared, of both pictures
    uint64_t different = 0;    ///< covered in one picture only
    uint64_t at_near = 0;      ///< whose only partners are before the near plane
    uint64_t unexplained = 0;  ///< without a partner
    std::string first;         ///< the first of those
    size_t triangles = 0;      ///< of the cut

    double silhouette = 0.0;    ///< pixels from one covered in one picture only to what the other covers, largest
    double displacement = 0.0;  ///< pixels to the partner that is seen nearest, largest
    double distance = 0.0;      ///< to the nearest partner in units of e, largest
    /// Of pixels that both cover: differences of depth along the ray over `pixels` * depth / scale, which no e exceeds
    /// where that depth is seen. They are larger where the surface is steep or only one picture has something in front.
    std::vector<double> depths;

    void add(const LevelComparison& other);
    /// The value of `depths` that a share of them does not exceed; 0 without any.
    double depth(double share);
};

/// What a pixel of a device's picture shows.
struct SeenTriangle {
    uint32_t cluster = UINT32_MAX;  ///< UINT32_MAX: nothing
    uint32_t triangle = 0;          ///< of the cluster
};

/// A mesh and its graph, to be compared from many views.
class LevelJudge {
public:
    /// Keeps references to both. Only triangles of the mesh that cover something have to be in the graph.
    LevelJudge(const Mesh& mesh, const MeshGraph& graph);
    ~LevelJudge();

    /// Compares a cut with the mesh. Of the pixels that both cover every `stride`-th is judged. `seen`: a picture of
    /// the cut, row after row, that a device has made of it, with corners rounded to 2^-8 pixel; without it the exact
    /// one. A pixel of a cluster that is not in the cut is unexplained.
    LevelComparison compare(std::span<const uint32_t> cut, const CameraParameters& camera, const Transform3x4& instance,
                            const Vector2u& size, double pixels, uint32_t stride = 1,
                            std::span<const SeenTriangle> seen = {}) const;

private:
    class Tree;
    struct Side;

    void look(const Side& from, const Side& to, uint32_t stride, LevelComparison& result) const;

    const Mesh& mesh_;
    const MeshGraph& graph_;
    std::unique_ptr<Tree> tree_;
};

}  // namespace glint::test
