#pragma once

#include <glint/base/expected.h>
#include <glint/base/status.h>
#include <glint/math/bounds.h>
#include <glint/math/math.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace glint {

/// A named run of a mesh's triangles.
struct MeshPart {
    std::string name;
    uint32_t first_index = 0;        ///< a multiple of 3
    uint32_t index_count = 0;        ///< a multiple of 3
    uint32_t material = UINT32_MAX;  ///< of Scene::materials of the same file; UINT32_MAX is none
    bool operator==(const MeshPart&) const = default;
};

/// Indexed triangles in host memory. A plain value: fill the arrays, or load a file; valid when validate() says so.
/// Front faces are counter-clockwise in a right-handed world, unless the file's author thought otherwise.
struct Mesh {
    /// Largest number of bytes of a file, and of the mesh made from it, unless the caller says otherwise.
    static constexpr uint64_t default_limit = 1ull << 32;

    std::vector<Vector3f> positions;
    std::vector<Vector3f> normals;    ///< empty, or one of unit length for each position
    std::vector<Vector2f> texcoords;  ///< empty, or one for each position
    std::vector<uint32_t> indices;    ///< three for each triangle
    std::vector<MeshPart> parts;      ///< in the order of their triangles; empty means one part without a name

    /// Reads a file; its ending says which format it has (".obj", see parseObj; ".ply", see parsePly; ".gltf" and
    /// ".glb": the scene at rest, see Scene::mesh). Degenerate and repeated triangles are kept, and triangles keep the
    /// order of the file. Errors: those of readFile, "mesh.unknown_extension" and those of the format; they name the
    /// file and the line or the element.
    ///
    /// `glint mesh convert` makes PLY of the other formats that docs/formats.md lists.
    static Expected<Mesh> load(const std::filesystem::path& path, uint64_t limit = default_limit);

    /// Writes a file, as its ending says (".ply", see encodePly). Errors: those of writeFile, "mesh.unknown_extension"
    /// and those of the format.
    Status save(const std::filesystem::path& path) const;

    size_t triangleCount() const { return indices.size() / 3; }

    /// Errors: "mesh.no_faces", "mesh.index_count" (no multiple of 3), "mesh.index_range", "mesh.attribute_count"
    /// (normals or texture coordinates that are not as many as the positions), "mesh.not_finite" (a coordinate of a
    /// position is NaN or infinite), "mesh.part_range" (parts that are out of order, overlap or end past the indices).
    Status validate() const;

    /// The box of all positions, also of those that no triangle uses.
    BoundBox bounds() const { return BoundBox(positions); }

    /// Replaces the normals: at each vertex the mean of its triangles' normals, weighted by their areas, of unit
    /// length. (0, 0, 1) where no triangle of nonzero area meets the vertex. Indices have to be in range.
    void createNormals();

    bool operator==(const Mesh&) const = default;
};

/// Reads a Wavefront OBJ file's text with tinyobjloader: `v`, `vt`, `vn`, `f` (with indices from the start or,
/// negative, from the end) and `o` and `g`, each of which begins a part. Everything else is passed over: materials,
/// curves, lines, points.
///
/// - A vertex is made of each distinct triple of indices, in the order in which the triangles use them; positions in no
///   face are left out.
/// - Polygons are split along existing corners: a quadrilateral along its shorter diagonal, n corners into n - 2
///   triangles. Right for flat convex polygons. A concave one may be covered wrongly, and one of more than four corners
///   may lose triangles too, which gives the warning "mesh.polygon_incomplete": have the modelling program write
///   triangles.
/// - Normals and texture coordinates are kept if every corner of every face has them, otherwise they are left out with
///   the warning "mesh.attribute_dropped". Normals are brought to unit length; one of length zero becomes (0, 0, 1).
/// - Numbers are rounded to float32 within one unit of the last place.
///
/// `name` names the file in errors; those at one line have the line. The mesh may take `limit` bytes; beside it the
/// reader takes at most 128 bytes for each byte of text. Errors: "mesh.empty_file", "mesh.no_faces", "mesh.syntax" (a
/// number is missing or malformed), "mesh.index_range" (an index is malformed, 0 or names nothing that stands above
/// it), "mesh.not_finite", "mesh.face_corners" (fewer than 3 or more than 1024), "mesh.too_large".
Expected<Mesh> parseObj(std::string_view text, const std::string& name, uint64_t limit = Mesh::default_limit);

/// Reads a PLY file (ASCII, or binary in either byte order; see parsePlyHeader): of element `vertex` the properties x,
/// y, z, of any type; nx, ny, nz; and u, v or s, t or texture_u, texture_v or u0, v0. Of the elements `face` and
/// `tristrips` the list `vertex_indices` or `vertex_index`. All else is passed over.
///
/// - Vertices keep their order, also those in no face. There are no parts.
/// - Polygons are split along existing corners: a quadrilateral along its shorter diagonal, n corners into n - 2
///   triangles that share the first one. Right for flat convex polygons.
/// - Triangle strips alternate their orientation, begin with that of their first three corners and end at -1.
/// - Normals are brought to unit length; one of length zero becomes (0, 0, 1).
///
/// `name` names the file in errors; they have the line of a text, or the byte of a binary file, or the vertex. The mesh
/// may take `limit` bytes, while it is read up to twice that; beside it the reader takes at most 8 bytes for each byte
/// of the file. Errors: those of parsePlyHeader and PlyReader, "mesh.no_positions", "mesh.no_faces", "mesh.not_finite",
/// "mesh.index_range", "mesh.face_corners" (fewer than 3), "mesh.too_large".
Expected<Mesh> parsePly(std::span<const std::byte> file, const std::string& name, uint64_t limit = Mesh::default_limit);

/// Makes a PLY file's bytes: binary, little-endian, float32, texture coordinates as s and t. What parsePly reads from
/// it differs from `mesh` by its parts, which PLY has no place for, and by the last place of normals that were not of
/// unit length. Errors: those of validate(), "mesh.too_large" (more than 2^31 - 1 vertices).
Expected<std::vector<std::byte>> encodePly(const Mesh& mesh);

}  // namespace glint
