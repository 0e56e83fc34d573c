#pragma once

#include <glint/device/kernel.h>
#include <glint/device/recorder.h>
#include <glint/device/traversal.h>

namespace glint {

/// Records dispatches, copies and builds. Made by Device::createCompute.
class Compute : public Recorder {
public:
    explicit Compute(detail::RecorderPtr core) : Recorder(std::move(core)) {}

    void setKernel(const Kernel& kernel, Where where = Where::current());
    /// In the place of a kernel: dispatches start rays with this ray-generation shader of the traversal's, counted in
    /// load order. Errors: "traversal.generation".
    void setTraversal(const Traversal& traversal, uint32_t generation = 0, Where where = Where::current());

    /// With a kernel, runs at least width x height x depth threads: whole groups are started, so that the shader has to
    /// check. With a traversal, starts as many rays and no more. Nothing is recorded if one is 0. Errors: "dispatch.*",
    /// "bind.*".
    void dispatch(uint64_t width, uint64_t height = 1, uint64_t depth = 1, Where where = Where::current());
    /// One thread or ray for each texel of the texture's first mip level.
    void dispatch(const Texture& texture, Where where = Where::current());
    /// Group counts, with a traversal counts of rays (three uint32_t) from a buffer with FlagIndirect, at a multiple of
    /// 4. Rays: Features::indirectRays; too many of them are undefined.
    void dispatchIndirect(const Buffer& buffer, uint64_t offset = 0, Where where = Where::current());

    /// Copies. Offsets and sizes in bytes; buffers must not overlap. Errors: "copy.range", "copy.overlap".
    void setBuffer(const Buffer& buffer, uint64_t offset, const void* data, uint64_t size,
                   Where where = Where::current());
    void copyBuffer(const Buffer& destination, uint64_t destination_offset, const Buffer& source,
                    uint64_t source_offset, uint64_t size, Where where = Where::current());
    /// Fills with a 32-bit value; offset and size are multiples of 4, size 0 is all that is left.
    void clearBuffer(const Buffer& buffer, uint32_t value = 0, uint64_t offset = 0, uint64_t size = 0,
                     Where where = Where::current());

    /// Tightly packed texels of `region` of mip level slice.mip, for slice.layers layers.
    void setTexture(const Texture& texture, const void* data, uint64_t size, const Slice& slice = {},
                    const Region& region = {}, Where where = Where::current());
    using Recorder::setTexture;
    void copyTexture(const Texture& destination, const Slice& destination_slice, const Texture& source,
                     const Slice& source_slice, const Region& source_region = {}, uint32_t x = 0, uint32_t y = 0,
                     uint32_t z = 0, Where where = Where::current());
    void copyTextureToBuffer(const Buffer& destination, uint64_t offset, const Texture& source, const Slice& slice = {},
                             const Region& region = {}, Where where = Where::current());
    void copyBufferToTexture(const Texture& destination, const Buffer& source, uint64_t offset, const Slice& slice = {},
                             const Region& region = {}, Where where = Where::current());
    /// All texels of the slice; depth in color.r, stencil in color.g.
    void clearTexture(const Texture& texture, const Color& color, const Slice& slice = {},
                      Where where = Where::current());
    /// Fills the mip levels above 0: each texel is the mean of what it covers of the level below, in float32 and linear
    /// values, rounded only as it is stored; of an odd size the texels at the edges count in part (docs/drawing.md).
    /// Tracked whatever setTracking says. Errors: "mipmaps.format".
    void createMipmaps(const Texture& texture, Where where = Where::current());

    /// Replaces the instances of a top-level structure; at most as many as it has room for.
    void setInstances(const Tracing& tracing, std::span<const Tracing::Instance> instances,
                      Where where = Where::current());
    /// Builds a structure; without a scratch buffer the SDK brings one. Builds and updates that are recorded one after
    /// the other run side by side where none needs what another one builds, or its scratch memory.
    void buildTracing(const Tracing& tracing, Where where = Where::current());
    void buildTracing(const Tracing& tracing, const Buffer& scratch, uint64_t offset = 0,
                      Where where = Where::current());
    /// Refits a structure made with FlagUpdate to moved vertices.
    void updateTracing(const Tracing& tracing, Where where = Where::current());
    void updateTracing(const Tracing& tracing, const Buffer& scratch, uint64_t offset = 0,
                       Where where = Where::current());
};

}  // namespace glint
