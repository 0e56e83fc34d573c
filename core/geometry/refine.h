#pragma once

#include <glint/geometry/polygon_mesh.h>

namespace glint {

/// The rules by which a cage of polygons is refined towards a smooth surface.
enum class Subdivision : uint8_t {
    CatmullClark,  ///< any polygons to quadrilaterals: bicubic B-splines but at vertices where not 4 edges meet
    Loop,          ///< triangles to triangles: quartic box splines but at vertices where not 6 edges meet
};

/// Refines a cage `steps` times. Each step of Catmull-Clark makes a quadrilateral of every corner, each step of Loop
/// four triangles of every triangle; faces that come from one face follow each other. The first vertices are those of
/// the cage, moved, in their order. Vertices in no face stay where they are.
///
/// - Boundary edges follow the uniform cubic B-spline of their vertices. A vertex that belongs to one face only stays
///   where it is: a square keeps its corners.
/// - Creases (DeRose, Kass and Truong 1998): an edge of sharpness s >= 1 is refined as a boundary is, one of 0 < s < 1
///   lies between that and the smooth rule, and what it is split into has s - 1. A vertex with one sharp edge is
///   smooth, with two on a crease, with more it stays. Where the edges that are sharp at a vertex will not all be so in
///   the next step, it moves by both rules, weighted by the mean sharpness of those edges that will not.
/// - Attributes are refined as positions are where all faces around a vertex agree on the value. Along a seam they are
///   linear: its vertices keep their values, and its edges are split in the middle. The attribute "normal" is left out:
///   a refined surface has its own (see toLimit).
///
/// Computed in float64 and rounded once: coordinates differ from the exact ones by half a unit in the last place of
/// float32 and steps * (n + 1) * 2^-51 of the largest coordinate around, with at most n edges at a vertex and n corners
/// of a face. One thread; the same on every machine.
///
/// `limit` bounds the bytes of the result; about three times that is needed meanwhile. Errors: those of
/// PolygonMesh::validate; "refine.edge_faces" (an edge of more than two faces), "refine.edge_direction" (two faces run
/// along an edge in the same direction), "refine.vertex_fans" (faces meet at a vertex without being joined by edges),
/// "refine.crease_edge" (a crease that is no edge), "refine.not_triangles" (Loop with other faces), "refine.too_large".
Expected<PolygonMesh> refine(const PolygonMesh& cage, Subdivision scheme, uint32_t steps,
                             uint64_t limit = Mesh::default_limit);

/// Refines a cage `steps` times and moves each vertex to the place where refining for ever would bring it. The
/// attribute "normal" has the limit surface's unit normals: one value for each vertex, or, on creases and at corners,
/// for each sector between sharp edges. Vertices in no face have none.
///
/// Not everywhere has the limit a tangent plane. At a corner (more than two sharp edges, or one face at the boundary)
/// the normal is that of the plane of the sector's two sharp edges. On a crease or boundary whose sector has more than
/// 3 faces (Catmull-Clark) or 5 (Loop) it is that of the plane of the crease's tangent and of the direction that
/// shrinks slowest inside the sector (Biermann, Levin and Zorin 2000 change the rules there; DeRose's are kept here).
/// Where tangents vanish it is the mean of the faces' normals, weighted by area, and (0, 0, 1) if that vanishes too.
///
/// Formulas: Halstead, Kass and DeRose 1993 for Catmull-Clark, Loop 1987 for triangles; at boundaries and creases
/// eigenvectors of the same rules. Errors: those of refine; "refine.crease_left" (an edge is semi-sharp still after
/// `steps`: refine further).
Expected<PolygonMesh> toLimit(const PolygonMesh& cage, Subdivision scheme, uint32_t steps = 0,
                              uint64_t limit = Mesh::default_limit);

}  // namespace glint
