#include <glint/device/texture.h>

#include <glint/device/detail/object.h>
#include <glint/device/detail/texture_layout.h>

namespace glint {

namespace {

const detail::TextureObject* ready(const Texture& texture) {
    return texture ? static_cast<const detail::TextureObject*>(texture.object()) : nullptr;
}

}  // namespace

Texture::Type Texture::getType() const {
    const auto* texture = ready(*this);
    return texture ? texture->desc.type : Type2D;
}

Format Texture::getFormat() const {
    const auto* texture = ready(*this);
    return texture ? texture->desc.format : FormatUnknown;
}

Texture::Flags Texture::getFlags() const {
    const auto* texture = ready(*this);
    return texture ? texture->desc.flags : 0;
}

uint32_t Texture::getWidth() const {
    const auto* texture = ready(*this);
    return texture ? texture->desc.width : 0;
}

uint32_t Texture::getHeight() const {
    const auto* texture = ready(*this);
    return texture ? texture->desc.height : 0;
}

uint32_t Texture::getDepth() const {
    const auto* texture = ready(*this);
    return texture ? texture->desc.depth : 0;
}

uint32_t Texture::getLayers() const {
    const auto* texture = ready(*this);
    return texture ? texture->desc.layers : 0;
}

uint32_t Texture::getMipmaps() const {
    const auto* texture = ready(*this);
    return texture ? texture->desc.mipmaps : 0;
}

uint32_t Texture::getSamples() const {
    const auto* texture = ready(*this);
    return texture ? texture->samples : 0;
}

uint64_t Texture::getDataSize(uint32_t mip) const {
    const auto* texture = ready(*this);
    if (!texture || mip >= texture->desc.mipmaps) return 0;
    return detail::dataSize(texture->desc.format, detail::mipRegion(texture->desc, mip));
}

}  // namespace glint
