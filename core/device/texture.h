#pragma once

#include <glint/device/handle.h>
#include <glint/device/types.h>
#include <glint/format/format.h>

#include <cstdint>

namespace glint {

/// An image in device memory. Created by Device::createTexture*. Row 0 is the top row of a picture.
class Texture : public Handle {
public:
    enum Type : uint8_t { Type2D, Type3D, TypeCube };

    /// What the texture is used for besides being sampled and copied, which is always possible.
    enum Flag : uint32_t {
        FlagNone = 0,
        FlagTarget = 1u << 0,   ///< colour or depth texture of a Target
        FlagSurface = 1u << 1,  ///< image load and store in shaders
        FlagMipmaps = 1u << 2,  ///< a full chain of mip levels
        FlagMultisample2 = 1u << 3,
        FlagMultisample4 = 1u << 4,
        FlagMultisample8 = 1u << 5,
    };
    using Flags = uint32_t;

    Texture() = default;
    explicit Texture(detail::Object* object) : Handle(object) {}

    Type getType() const;
    Format getFormat() const;
    Flags getFlags() const;
    /// Texels of mip level 0; 0 unless ready.
    uint32_t getWidth() const;
    uint32_t getHeight() const;
    uint32_t getDepth() const;
    /// Array layers, for cubes six each.
    uint32_t getLayers() const;
    uint32_t getMipmaps() const;
    uint32_t getSamples() const;
    /// Bytes of tightly packed data of one layer of a mip level.
    uint64_t getDataSize(uint32_t mip = 0) const;
};

/// Both flags.
constexpr Texture::Flags operator|(Texture::Flag a, Texture::Flag b) {
    return static_cast<Texture::Flags>(a) | static_cast<Texture::Flags>(b);
}

/// Everything about a texture; the createTexture2D, 3D, Cube calls fill it.
struct TextureDesc {
    Texture::Type type = Texture::Type2D;
    Format format = FormatUnknown;
    uint32_t width = 1;
    uint32_t height = 1;
    uint32_t depth = 1;
    uint32_t layers = 1;   ///< array layers; of a cube map: cubes
    uint32_t mipmaps = 1;  ///< ignored with FlagMipmaps
    Texture::Flags flags = Texture::FlagNone;
};

}  // namespace glint
