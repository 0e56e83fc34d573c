#pragma once

#include <glint/base/expected.h>
#include <glint/format/mesh.h>
#include <glint/format/scene.h>

#include <vector>

namespace glint {

/// Makes the tangents that normal maps are read with: for each vertex a vector of unit length, at a right angle to the
/// normal n, that points to where the first texture coordinate grows; w = 1 or -1, so that the bitangent is w * (n x
/// t).
///
/// - In a triangle with the edges d1, d2 and their differences of texture coordinates (u1, v1), (u2, v2), the tangent
/// is
///   the direction of s * (v2 * d1 - v1 * d2), and w is s, the sign of u1 * v2 - u2 * v1. Triangles whose coordinates
///   have no area are left out.
/// - At a vertex the triangles' tangents are projected to the plane of n, brought to unit length and added, each
/// weighted
///   by the triangle's angle at the vertex, in float64: the weights of MikkTSpace, so that maps baked for it fit. As
///   there, vertices at one place with equal normals and texture coordinates share one sum, whatever their numbers.
/// - A vertex whose triangles differ in w is split: the copy for w = -1 is put at the end of the mesh, and indices are
///   changed. Any direction at a right angle to n, the same on every machine, with w = 1, where no triangle counts.
///
/// Errors: those of Mesh::validate, "mesh.attribute_count" also where normals or texture coordinates are missing, and
/// "mesh.too_large" (more than 2^32 - 1 vertices after splitting).
Expected<std::vector<Vector4f>> createTangents(Mesh& mesh);

/// The same for a primitive of a scene and the set of texture coordinates that its normal map is read with. Their v
/// goes down the picture and glTF's maps count up it, so the bitangent points to where v shrinks. Replaces the
/// primitive's tangents, and splits vertices with all that they have, joints, weights and morph targets included.
/// Errors: those of ScenePrimitive::validate, "mesh.no_faces", "mesh.attribute_count" and "mesh.too_large" as above.
Status createTangents(ScenePrimitive& primitive, uint32_t texcoord = 0);

}  // namespace glint
