#pragma once

#include <glint/device/pipeline.h>
#include <glint/device/recorder.h>

namespace glint {

/// Records draws into a Target. Made by Device::createCommand; the target begins with the list and ends with it.
class Command : public Recorder {
public:
    explicit Command(detail::RecorderPtr core) : Recorder(std::move(core)) {}

    void setPipeline(const Pipeline& pipeline, Where where = Where::current());

    /// Vertices for the pipeline's buffer slot `index`.
    void setVertexBuffer(uint32_t index, const Buffer& buffer, uint64_t offset = 0, Where where = Where::current());
    /// The same with inline data.
    void setVertexData(uint32_t index, const void* data, uint64_t size, Where where = Where::current());
    template <class T, size_t N>
    void setVertices(uint32_t index, const T (&vertices)[N], Where where = Where::current()) {
        setVertexData(index, vertices, sizeof(vertices), where);
    }
    template <class T>
    void setVertices(uint32_t index, std::span<const T> vertices, Where where = Where::current()) {
        setVertexData(index, vertices.data(), vertices.size_bytes(), where);
    }
    /// Indices: FormatRu16 or FormatRu32.
    void setIndexBuffer(Format format, const Buffer& buffer, uint64_t offset = 0, Where where = Where::current());
    void setIndexData(Format format, const void* data, uint64_t size, Where where = Where::current());
    template <class T, size_t N>
    void setIndices(const T (&indices)[N], Where where = Where::current()) {
        static_assert(sizeof(T) == 2 || sizeof(T) == 4);
        setIndexData(sizeof(T) == 2 ? FormatRu16 : FormatRu32, indices, sizeof(indices), where);
    }

    /// The whole target by default.
    void setViewport(float x, float y, float width, float height, float minimum_depth = 0.0f,
                     float maximum_depth = 1.0f);
    /// Several, chosen by gl_ViewportIndex, which vertex (FeatureVertexLayer), geometry and mesh shaders write: at most
    /// Features::maxViewports, more than one with FeatureMultiViewport ("draw.viewports"). One scissor cuts them all.
    void setViewports(std::span<const Viewport> viewports, Where where = Where::current());
    void setViewports(std::initializer_list<Viewport> viewports, Where where = Where::current()) {
        setViewports(std::span(viewports.begin(), viewports.size()), where);
    }
    void setScissor(int32_t x, int32_t y, uint32_t width, uint32_t height);
    /// One for each viewport: as many as there are viewports when something is drawn ("draw.scissors").
    void setScissors(std::span<const Scissor> scissors, Where where = Where::current());
    void setScissors(std::initializer_list<Scissor> scissors, Where where = Where::current()) {
        setScissors(std::span(scissors.begin(), scissors.size()), where);
    }
    /// Constant of BlendFuncFactor.
    void setBlendFactor(const Color& color);
    void setStencilRef(uint32_t reference);

    /// Draws vertices. Errors: "draw.*", "bind.*".
    void drawArrays(uint32_t vertices, uint32_t first = 0, Where where = Where::current());
    void drawArraysInstanced(uint32_t vertices, uint32_t first, uint32_t instances, uint32_t first_instance = 0,
                             Where where = Where::current());
    void drawElements(uint32_t indices, uint32_t first = 0, int32_t base_vertex = 0, Where where = Where::current());
    void drawElementsInstanced(uint32_t indices, uint32_t first, int32_t base_vertex, uint32_t instances,
                               uint32_t first_instance = 0, Where where = Where::current());
    /// Arguments from a buffer with FlagIndirect: four uint32_t a draw (vertices, instances, first, first instance) or
    /// five (indices, instances, first, base vertex, first instance), `stride` bytes apart (0: tightly packed).
    void drawArraysIndirect(const Buffer& buffer, uint64_t offset = 0, uint32_t draws = 1, uint32_t stride = 0,
                            Where where = Where::current());
    void drawElementsIndirect(const Buffer& buffer, uint64_t offset = 0, uint32_t draws = 1, uint32_t stride = 0,
                              Where where = Where::current());
    /// The same with the number of draws from a buffer: the uint32_t at `count_offset` of `count`, which has
    /// FlagIndirect too, or `draws` if that is less. Needs FeatureIndirectCount ("draw.count").
    void drawArraysIndirect(const Buffer& buffer, uint64_t offset, const Buffer& count, uint64_t count_offset,
                            uint32_t draws, uint32_t stride = 0, Where where = Where::current());
    void drawElementsIndirect(const Buffer& buffer, uint64_t offset, const Buffer& count, uint64_t count_offset,
                              uint32_t draws, uint32_t stride = 0, Where where = Where::current());

    /// Starts groups of the pipeline's task shader, or of its mesh shader if it has no task shader. (Not threads, as
    /// dispatch counts them.) Errors: "draw.mesh_groups", "draw.mesh".
    void drawMesh(uint32_t x, uint32_t y = 1, uint32_t z = 1, Where where = Where::current());
    /// Group counts from a buffer: three uint32_t a draw. Counts beyond the limits are undefined.
    void drawMeshIndirect(const Buffer& buffer, uint64_t offset = 0, uint32_t draws = 1, uint32_t stride = 0,
                          Where where = Where::current());
    void drawMeshIndirect(const Buffer& buffer, uint64_t offset, const Buffer& count, uint64_t count_offset,
                          uint32_t draws, uint32_t stride = 0, Where where = Where::current());
};

}  // namespace glint
