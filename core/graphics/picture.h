#pragma once

#include <glint/device/device.h>
#include <glint/format/image.h>

#include <filesystem>
#include <source_location>

namespace glint {

/// Reads one layer of a mip level back; waits for it. Formats that Image knows. Errors: those of Device::getTexture and
/// of Image::create.
Expected<Image> readImage(Device& device, const Texture& texture, const Slice& slice = {},
                          std::source_location where = std::source_location::current());

/// Reads mip level 0 of layer 0 and writes it to a file, as its ending says (".png").
Status savePicture(Device& device, const Texture& texture, const std::filesystem::path& path,
                   std::source_location where = std::source_location::current());

}  // namespace glint
