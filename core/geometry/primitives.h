#pragma once

#include <glint/format/mesh.h>
#include <glint/geometry/polygon_mesh.h>

namespace glint {

// Meshes made by formula: indexed, with normals that point outwards and counter-clockwise front faces, Z up, centred on
// the origin. The torus, the sphere and the box are closed: every edge belongs to exactly two triangles, and triangles
// that meet have bit-equal corners. The order of triangles is that of the loops, so the same on every machine.

/// A torus around the Z axis: `ring` is the radius of the circle that the tube follows, `tube` that of the tube.
/// ring_segments * tube_segments vertices, twice as many triangles, row by row around the ring. Segments are at
/// least 3.
Mesh createTorus(float ring, float tube, uint32_t ring_segments, uint32_t tube_segments);

/// The same torus as quadrilaterals, without normals: a cage to refine. The surface that refining leads to is thinner
/// than the cage. `createTorusQuads(1.07208f, 0.77792f, 16, 11)` has 176 quadrilaterals and reaches from -1.85 to 1.85
/// along X and Y and from -0.77 to 0.77 along Z.
PolygonMesh createTorusQuads(float ring, float tube, uint32_t ring_segments, uint32_t tube_segments);

/// An icosahedron whose faces have been split in four `subdivisions` times, with vertices on the sphere:
/// 20 * 4^subdivisions triangles. At most 10 subdivisions (21 million triangles).
Mesh createSphere(float radius, uint32_t subdivisions);

/// A box with sides of the given lengths: 12 triangles, and 24 vertices, so that each face has its own normals and
/// texture coordinates. Closed by position, not by index.
Mesh createBox(const Vector3f& size);

/// A square in the XY plane facing +Z with sides of length `size`, of segments * segments cells with two triangles
/// each, with normals and with texture coordinates from (0, 0) at -X -Y to (1, 1). Segments are at least 1.
Mesh createPlane(float size, uint32_t segments = 1);

}  // namespace glint
