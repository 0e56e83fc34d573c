#pragma once

#include <glint/device/device.h>
#include <glint/format/mesh.h>
#include <glint/format/scene.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <source_location>
#include <string>
#include <string_view>
#include <vector>

namespace glint {

namespace detail {
struct VertexSource;
}

/// A mesh on a device: vertices laid out as a pipeline's attributes want them, indices of 16 or 32 bits, and one
/// geometry for each part of the mesh (one in all for a mesh without parts).
///
///     MeshModel model(device, pipeline, mesh);
///     command.setPipeline(pipeline);
///     model.draw(command);
///
///     MeshModel model(device, mesh, MeshModel::FlagBufferStorage | MeshModel::FlagBufferTracing);
///     Tracing tracing = model.createTracing();
///
/// A value: copies share the buffers. Like a handle it carries its first error, of which the device's message callback
/// is told; drawing and tracing a failed model fails.
///
/// What an attribute gets:
///
/// | attribute | value of a Mesh                                            | components beyond |
/// |-----------|------------------------------------------------------------|-------------------|
/// | Position  | positions                                                  | w is 1            |
/// | Normal    | normals; a mesh without them: those of createNormals()     | 0                 |
/// | TexCoord  | texcoords; a mesh without them is refused                  | 0                 |
/// | Color     | white                                                      |                   |
/// | Joints    | 0, in an integer format                                    |                   |
/// | Weights   | (1, 0, 0, 0): with Joints a mesh that joint 0 moves rigidly|                   |
/// | others    | refused ("model.attribute")                                |                   |
///
/// The mesh of a scene has a geometry for each of its primitives, and what a primitive has: tangents, colours, joints
/// and weights, and in a second TexCoord its second set. A primitive without some attribute gets what a Mesh gets, but
/// texture coordinates of 0 and tangents of 0, which show no direction.
///
/// Formats are float32, float16, and normalised 8 and 16 bits; components that a format lacks are dropped. Values are
/// rounded to nearest: by at most 2^-11 of themselves in float16 (2^-25 where that is more), 1/510 in u8n, 1/254 in
/// i8n, 1/131070 in u16n and 1/65534 in i16n. One that the format cannot hold is refused ("model.range"): nothing is
/// clamped by more than that. Bytes between attributes are 0. Attributes that step by instance are left to the program.
class MeshModel {
public:
    using Where = std::source_location;
    /// Attributes; those of one vertex buffer slot share a stride.
    using Layout = std::vector<Pipeline::VertexAttribute>;
    /// Takes `size` bytes of vertices or indices; true if it has taken them over, so that the model makes no buffer.
    using BufferCallback = std::function<bool(const void* src, size_t size)>;

    enum Flag : uint32_t {
        FlagNone = 0,
        FlagIndices16 = 1u << 0,      ///< at most 65,536 vertices
        FlagIndices32 = 1u << 1,      ///< neither: 16 bits where they suffice and no shader reads them, else 32
        FlagBufferStorage = 1u << 2,  ///< shaders read the buffers: Buffer::FlagStorage
        FlagBufferTexel = 1u << 3,    ///< Buffer::FlagTexel
        FlagBufferAddress = 1u << 4,  ///< Buffer::FlagAddress
        FlagBufferTracing = 1u << 5,  ///< for createTracing(): Buffer::FlagTracing
    };
    using Flags = uint32_t;

    MeshModel() = default;
    /// These are create(); the error is carried. Without a pipeline or layout, positions alone are laid out:
    /// FormatRGBf32, 12 bytes a vertex.
    MeshModel(const Device& device, const Mesh& mesh, Flags flags = FlagNone, Where where = Where::current());
    MeshModel(const Device& device, const Pipeline& pipeline, const Mesh& mesh, Flags flags = FlagNone,
              Where where = Where::current());
    MeshModel(const Device& device, const Layout& layout, const Mesh& mesh, Flags flags = FlagNone,
              Where where = Where::current());
    MeshModel(const Device& device, const Pipeline& pipeline, const SceneMesh& mesh, Flags flags = FlagNone,
              Where where = Where::current());
    MeshModel(const Device& device, const Layout& layout, const SceneMesh& mesh, Flags flags = FlagNone,
              Where where = Where::current());

    /// Hand the bytes over instead of making buffers of them, so that many models lie in one: set before create(),
    /// which calls each once, vertices first. What was taken over comes back by setVertexBuffer and setIndexBuffer.
    void setVertexBufferCallback(BufferCallback callback) { vertex_callback_ = std::move(callback); }
    void setIndexBufferCallback(BufferCallback callback) { index_callback_ = std::move(callback); }
    /// Names the model in messages, and its buffers; set before create().
    void setName(std::string_view name) { name_ = name; }

    /// Lays out and uploads, anew if there was something. The vertices of each buffer slot of the layout follow one
    /// another in one buffer, each slot's from a multiple of 4 bytes and of its stride; the bytes of indices are
    /// padded to a multiple of 4. The pipeline need not have been created. Errors: those of Mesh::validate or
    /// ScenePrimitive::validate, and of Device::createBuffer, "mesh.no_faces", "model.layout", "model.attribute",
    /// "model.format", "model.range", "model.flags", "model.indices", "model.too_large", "model.out_of_memory".
    Status create(const Device& device, const Mesh& mesh, Flags flags = FlagNone, Where where = Where::current());
    Status create(const Device& device, const Pipeline& pipeline, const Mesh& mesh, Flags flags = FlagNone,
                  Where where = Where::current());
    Status create(const Device& device, const Layout& layout, const Mesh& mesh, Flags flags = FlagNone,
                  Where where = Where::current());
    Status create(const Device& device, const Pipeline& pipeline, const SceneMesh& mesh, Flags flags = FlagNone,
                  Where where = Where::current());
    Status create(const Device& device, const Layout& layout, const SceneMesh& mesh, Flags flags = FlagNone,
                  Where where = Where::current());

    /// Where the vertices or indices that a callback has taken over lie. The offset is a multiple of 4, and such that
    /// each slot's vertices begin at a multiple of their stride (as they do where models of one layout with one slot
    /// follow each other). Errors, which the model carries: "model.buffer".
    void setVertexBuffer(const Buffer& buffer, uint64_t offset = 0, Where where = Where::current());
    void setIndexBuffer(const Buffer& buffer, uint64_t offset = 0, Where where = Where::current());

    /// True once created without an error.
    explicit operator bool() const { return device_ && !error_; }
    /// Why the model failed; "handle.null" before create().
    Error error() const;

    const Buffer& getVertexBuffer() const { return vertex_buffer_; }
    const Buffer& getIndexBuffer() const { return index_buffer_; }
    const Layout& getLayout() const { return layout_; }
    uint32_t getVertices() const { return vertices_; }
    /// Bytes of vertices, and of indices.
    uint64_t getVertexSize() const { return vertex_size_; }
    uint64_t getIndexSize() const { return index_size_; }
    /// FormatRu16 or FormatRu32.
    Format getIndexFormat() const { return index_format_; }
    /// Of a slot's vertices: bytes from one to the next, bytes in the vertex buffer before the first, and the same
    /// counted in vertices. 0 for a slot that the layout does not have.
    uint32_t getVertexStride(uint32_t slot = 0) const;
    uint64_t getVertexOffset(uint32_t slot = 0) const;
    uint32_t getBaseVertex(uint32_t slot = 0) const;

    uint32_t getGeometries() const { return static_cast<uint32_t>(geometries_.size()); }
    /// Name, number of indices, and indices in the index buffer before its first, of a geometry. Empty and 0 for one
    /// that does not exist.
    const std::string& getName(uint32_t geometry) const { return find(geometry).name; }
    uint32_t getIndices(uint32_t geometry = 0) const { return find(geometry).index_count; }
    uint32_t getFirstIndex(uint32_t geometry = 0) const;

    /// Draws all geometries, or `instances` of one. The command's pipeline has the layout's attributes; its vertex
    /// buffers of the layout's slots and its index buffer are replaced. Errors: "model.geometry", and "handle.null" for
    /// what a callback has taken over and was not set.
    void draw(Command& command, Where where = Where::current()) const;
    void draw(Command& command, uint32_t geometry, uint32_t instances = 1, Where where = Where::current()) const;

    /// A bottom-level structure with one geometry for each of the model's, created and not built. Asks for
    /// FlagBufferTracing and for positions of FormatRGBf32; the structure carries the errors ("buffer.flag",
    /// "tracing.format", "tracing.buffer" if the model has no buffers).
    Tracing createTracing(Tracing::Flags flags = Tracing::FlagFastTrace, Where where = Where::current()) const;

private:
    /// The vertices of one buffer slot.
    struct Stream {
        uint32_t slot = 0;
        uint32_t stride = 0;
        uint64_t offset = 0;  ///< from the beginning of the model's vertices
    };

    Status layoutOf(const Device& device, const Pipeline& pipeline, Where where);
    /// `source` checks the mesh and says what is laid out; it is asked once the numbers have been found to fit.
    using MakeSource = std::function<Expected<detail::VertexSource>()>;
    Status create(const Device& device, const Layout& layout, Flags flags, Where where, uint64_t vertices,
                  uint64_t indices, const MakeSource& source);
    Status build(uint64_t vertex_count, uint64_t index_count, const MakeSource& make, Where where);
    Error checkFlags(uint64_t vertices, Where where) const;
    Error findStreams(uint64_t vertices, Where where);
    Error placed(const char* what, const Buffer& buffer, uint64_t offset, uint64_t size, Where where) const;
    Status fail(const Error& error);
    const Stream* stream(uint32_t slot) const;
    const MeshPart& find(uint32_t geometry) const;
    bool setBuffers(Command& command, Where where) const;

    std::string name_ = "model";
    BufferCallback vertex_callback_, index_callback_;
    Device device_;
    Error error_;
    Layout layout_;
    Flags flags_ = FlagNone;
    std::vector<Stream> streams_;
    std::vector<MeshPart> geometries_;
    uint32_t vertices_ = 0;
    Format index_format_ = FormatRu32;
    uint64_t vertex_size_ = 0, index_size_ = 0;
    uint64_t vertex_offset_ = 0, index_offset_ = 0;  ///< of the model in its buffers
    Buffer vertex_buffer_, index_buffer_;
};

/// Both flags.
constexpr MeshModel::Flags operator|(MeshModel::Flag a, MeshModel::Flag b) {
    return static_cast<MeshModel::Flags>(a) | static_cast<MeshModel::Flags>(b);
}

}  // namespace glint
