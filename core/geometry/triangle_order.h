#pragma once

#include <glint/format/mesh.h>

#include <cstdint>
#include <vector>

namespace glint {

/// Sorts the triangles of each part along a Z-order curve through the centres of their boxes, 10 bits an axis:
/// triangles that are near in space come to be near in memory. The same triangles, the same vertices; stable, so
/// deterministic. Returns for each triangle the number that it had before.
///
/// Some drivers build their acceleration structures in the order of the primitives (Mesa's lavapipe does), and trace
/// meshes in the order of a scan many times slower than sorted ones. Indices have to be in range.
std::vector<uint32_t> sortTriangles(Mesh& mesh);

}  // namespace glint
