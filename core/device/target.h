#pragma once

#include <glint/device/handle.h>
#include <glint/device/texture.h>
#include <glint/device/types.h>

#include <source_location>

namespace glint {

/// The textures that a Command draws to. Created by Device::createTarget; the state at Device::createCommand counts.
/// With slices of several layers (an array's, or the faces of a cube) draws go to the layer that gl_Layer says, which
/// vertex shaders (FeatureVertexLayer), geometry and mesh shaders write, or to the first; clears go to all.
/// Not thread-safe: configure and use a target from one thread at a time.
class Target : public Handle {
public:
    using Where = std::source_location;

    enum Operation : uint8_t {
        BeginLoad = 1,
        BeginClear = 2,
        BeginDiscard = 4,
        EndStore = 8,
        EndDiscard = 16,
        OpDefault = BeginClear | EndStore,
    };

    Target() = default;
    explicit Target(detail::Object* object) : Handle(object) {}

    /// One mip level of the texture, which needs FlagTarget; a null texture removes it. Errors: "target.texture".
    void setColorTexture(uint32_t index, const Texture& texture, const Slice& slice = {},
                         Where where = Where::current());
    /// Multisampled colour `index` is averaged into this texture at the end.
    void setColorResolve(uint32_t index, const Texture& texture, const Slice& slice = {},
                         Where where = Where::current());
    void setDepthTexture(const Texture& texture, const Slice& slice = {}, Where where = Where::current());
    /// The first sample of multisampled depth, and stencil, is kept in this texture at the end.
    void setDepthResolve(const Texture& texture, const Slice& slice = {}, Where where = Where::current());

    void setColorOperation(uint32_t index, uint8_t operation);
    void setDepthOperation(uint8_t operation);
    void setClearColor(uint32_t index, const Color& color);
    void setClearColor(const Color& color) { setClearColor(0, color); }
    /// Depth from 0 to 1 ("clear.depth").
    void setClearDepth(float depth, uint32_t stencil = 0, Where where = Where::current());

    /// Pixels of the smallest texture; 0 without textures.
    uint32_t getWidth() const;
    uint32_t getHeight() const;
};

}  // namespace glint
