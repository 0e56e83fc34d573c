#include <glint/graphics/picture.h>

#include <algorithm>

namespace glint {

Expected<Image> readImage(Device& device, const Texture& texture, const Slice& slice, std::source_location where) {
    if (!texture) return unexpected(texture.error().at(where));
    const uint32_t width = std::max(texture.getWidth() >> slice.mip, 1u);
    const uint32_t height = std::max(texture.getHeight() >> slice.mip, 1u);
    Expected<Image> image = Image::create(texture.getFormat(), width, height);
    if (!image) return unexpected(image.error().at(where));
    const Slice layer = {slice.mip, 1, slice.layer, 1};
    if (Status status = device.getTexture(texture, image->bytes().data(), image->bytes().size(), layer, where); !status)
        return unexpected(status.error());
    return image;
}

Status savePicture(Device& device, const Texture& texture, const std::filesystem::path& path,
                   std::source_location where) {
    const Expected<Image> image = readImage(device, texture, {}, where);
    return image ? image->save(path) : Status(image.error());
}

}  // namespace glint
