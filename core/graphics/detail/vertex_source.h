#pragma once

#include <glint/device/pipeline.h>
#include <glint/format/mesh.h>
#include <glint/format/scene.h>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace glint::detail {

const char* toString(Pipeline::Attribute attribute);

/// The vertices and indices that a model lays out, whether they come from a mesh or from one of a scene. Looks at the
/// mesh's arrays where it can.
struct VertexSource {
    std::span<const Vector3f> positions;
    std::span<const Vector3f> normals;  ///< empty unless asked for
    std::array<std::span<const Vector2f>, 2> texcoords;
    std::span<const Vector4f> tangents, colors, weights;  ///< empty: MeshModel's defaults
    std::span<const std::array<uint16_t, 4>> joints;
    std::span<const uint32_t> indices;
    std::vector<MeshPart> parts;
    bool is_scene = false;

    VertexSource() = default;
    VertexSource(VertexSource&&) = default;  // the arrays stay where they are; a copy would look at another's
    VertexSource& operator=(VertexSource&&) = default;

    /// Of valid meshes. `with_normals`: makes them where there are none.
    static VertexSource of(const Mesh& mesh, bool with_normals);
    static VertexSource of(const SceneMesh& mesh, bool with_normals);

    /// Writes an attribute of all vertices; `bytes` are zero, and the first vertex's. `set`: of texture coordinates.
    /// Errors: "model.attribute", "model.format", "model.range".
    Error write(const Pipeline::VertexAttribute& attribute, size_t set, std::byte* bytes) const;

private:
    /// What the spans look at where no mesh has it; moves with the source.
    std::vector<Vector3f> own_positions_, own_normals_;
    std::array<std::vector<Vector2f>, 2> own_texcoords_;
    std::vector<Vector4f> own_tangents_, own_colors_, own_weights_;
    std::vector<std::array<uint16_t, 4>> own_joints_;
    std::vector<uint32_t> own_indices_;
};

}  // namespace glint::detail
