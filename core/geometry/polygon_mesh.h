#pragma once

#include <glint/format/mesh.h>

namespace glint {

/// Values at the corners of polygons, each of `components` numbers, with an index of their own for each corner: so two
/// faces may have different values at a vertex that they share (a seam).
struct PolygonAttribute {
    std::string name;               ///< what the conversions to and from Mesh know: "texcoord" (2), "normal" (3)
    uint32_t components = 0;        ///< at least 1
    std::vector<float> values;      ///< `components` for each value
    std::vector<uint32_t> indices;  ///< the value at each corner, as many as PolygonMesh::indices
    bool operator==(const PolygonAttribute&) const = default;
};

/// How sharp the edge between two vertices is: 0 is smooth, infinity a crease for ever, and what lies between is a
/// crease for that many steps of refinement (see refine).
struct PolygonCrease {
    uint32_t first = 0, second = 0;  ///< in any order
    float sharpness = 0.0f;
    bool operator==(const PolygonCrease&) const = default;
};

/// Polygons in host memory: the cage of a subdivision surface, and what it is refined to. A plain value, valid when
/// validate() says so. Faces are counter-clockwise seen from outside in a right-handed world.
struct PolygonMesh {
    std::vector<Vector3f> positions;
    std::vector<uint32_t> offsets;  ///< face i has the corners offsets[i] to offsets[i + 1] - 1; one more than faces
    std::vector<uint32_t> indices;  ///< the vertex of each corner
    std::vector<PolygonAttribute> attributes;
    std::vector<PolygonCrease> creases;  ///< of an edge that is named more than once the sharpest counts

    size_t faceCount() const { return offsets.empty() ? 0 : offsets.size() - 1; }

    /// The attribute of this name, nullptr if there is none.
    const PolygonAttribute* attribute(std::string_view name) const;

    /// Errors: "polygon.no_faces", "polygon.offsets" (that do not begin with 0, do not end with the number of indices
    /// or run backwards), "polygon.face_corners" (fewer than 3), "polygon.index_range", "polygon.repeated_vertex" (a
    /// face that names a vertex twice), "polygon.attribute_count" (values or indices that are not as many as they
    /// should be), "polygon.attribute_range" (an index that names no value), "polygon.crease" (a vertex that is not
    /// there, or a sharpness that is negative or NaN), "polygon.not_finite" (a position or attribute is NaN or
    /// infinite).
    Status validate() const;

    bool operator==(const PolygonMesh&) const = default;
};

/// The triangles of a mesh as polygons. Vertices of equal position become one, so that what was split for the sake of
/// its attributes holds together; texture coordinates become the attribute "texcoord", of which equal ones at a vertex
/// are one value; normals are left out. So are triangles with two corners at one place. Errors: those of
/// Mesh::validate, "polygon.no_faces" if nothing is left.
Expected<PolygonMesh> toPolygons(const Mesh& mesh);

/// Splits polygons into triangles, in order: quadrilaterals along their shorter diagonal, others from their first
/// corner (right for convex ones). The attributes "texcoord" and "normal" come along, normals brought to unit length;
/// others do not. There is one vertex for each distinct combination of a position with its attributes, in order of
/// first use; without those attributes the vertices stay as they are. Errors: those of PolygonMesh::validate,
/// "polygon.too_large" (more than 2^32 - 1 indices), "polygon.attribute_count" also for attributes of these names with
/// other components.
Expected<Mesh> toTriangles(const PolygonMesh& polygons);

}  // namespace glint
