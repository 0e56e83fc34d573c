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

}  // namespace glint
