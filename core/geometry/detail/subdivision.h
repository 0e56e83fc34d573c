#pragma once

// What refine and toLimit share: connectivity, the values that are refined over it, and the rules.

#include <glint/geometry/refine.h>

#include <array>

namespace glint::detail {

constexpr uint32_t none = UINT32_MAX;

/// Faces and edges. A corner of a face is also the half-edge from it to the face's next corner.
struct Topology {
    uint32_t vertex_count = 0;
    std::vector<uint32_t> offsets;                ///< as PolygonMesh::offsets
    std::vector<uint32_t> faces;                  ///< of each corner
    std::vector<uint32_t> vertices;               ///< of each corner
    std::vector<uint32_t> edges;                  ///< of each half-edge
    std::vector<std::array<uint32_t, 2>> halves;  ///< of each edge; the second is `none` at the boundary
    std::vector<float> sharpness;                 ///< of each edge; infinity at the boundary

    uint32_t faceCount() const { return static_cast<uint32_t>(offsets.size() - 1); }
    uint32_t cornerCount() const { return static_cast<uint32_t>(vertices.size()); }
    uint32_t edgeCount() const { return static_cast<uint32_t>(halves.size()); }

    uint32_t next(uint32_t half) const {
        return half + 1 == offsets[faces[half] + 1] ? offsets[faces[half]] : half + 1;
    }
    uint32_t previous(uint32_t half) const {
        return half == offsets[faces[half]] ? offsets[faces[half] + 1] - 1 : half - 1;
    }
    uint32_t isSecond(uint32_t half) const { return halves[edges[half]][1] == half ? 1 : 0; }
    /// The half-edge on the other side, or `none`.
    uint32_t twin(uint32_t half) const { return halves[edges[half]][1 - isSecond(half)]; }
};

/// Adds `count` weighted numbers.
inline void addTo(double* sum, const double* values, double weight, uint32_t count) {
    if (count == 3) {  // positions: twice as fast as the loop
        sum[0] += weight * values[0];
        sum[1] += weight * values[1];
        sum[2] += weight * values[2];
        return;
    }
    for (uint32_t i = 0; i < count; i++) sum[i] += weight * values[i];
}

/// Numbers at the corners of faces: positions, or an attribute.
struct Channel {
    uint32_t components = 0;
    std::vector<double> values;
    std::vector<uint32_t> indices;  ///< of the value at each corner, each of one vertex only; empty: as the vertices

    size_t count() const { return values.size() / components; }
};

/// What is refined: positions come first, then the attributes without normals.
struct Surface {
    Topology topology;
    std::vector<Channel> channels;
};

/// Weights of a vertex' new place: itself, each of its neighbours, each of its faces' centroids, and each neighbour
/// along an edge that is sharper than `threshold`.
struct VertexRule {
    double self = 1.0, edge = 0.0, face = 0.0, crease = 0.0;
    float threshold = 0.0f;
};

/// The smooth rule of a vertex with n edges in Loop's scheme: the weight of each neighbour (Loop 1987).
double loopWeight(uint32_t n);

/// The checked cage with its edges.
Expected<Surface> makeSurface(const PolygonMesh& cage, Subdivision scheme);
/// One step.
Surface refineOnce(const Surface& surface, Subdivision scheme);
/// All of refine but the rounding.
Expected<Surface> refineSurface(const PolygonMesh& cage, Subdivision scheme, uint32_t steps, uint64_t limit);
/// Rounds to float32; names and the like are those of the cage.
PolygonMesh toPolygonMesh(Surface&& surface, const PolygonMesh& cage);

}  // namespace glint::detail
