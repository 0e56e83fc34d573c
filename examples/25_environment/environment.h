#pragma once

#include <glint/format/image.h>
#include <glint/math/math.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

/// A picture of all directions that needs no file: a sky, a sun, and ground below the horizon; RGBAf32, with values
/// above 1.
inline glint::Expected<glint::Image> createSky(uint32_t width, uint32_t height) {
    using namespace glint;
    Expected<Image> image = Image::create(FormatRGBAf32, width, height);
    if (!image) return image;
    const Vector3f sun = glm::normalize(Vector3f(0.3f, -0.7f, 0.65f));
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            // As <glint/environment.h> has it.
            const float longitude = (0.5f - (static_cast<float>(x) + 0.5f) / static_cast<float>(width)) * 2.0f * pi;
            const float latitude = (0.5f - (static_cast<float>(y) + 0.5f) / static_cast<float>(height)) * pi;
            const Vector3f direction(std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude),
                                     std::sin(latitude));
            const float cosine = std::max(glm::dot(direction, sun), 0.0f);
            const float rise = std::sqrt(std::max(direction.z, 0.0f));
            Vector3f color = glm::mix(Vector3f(0.80f, 0.84f, 0.88f), Vector3f(0.13f, 0.27f, 0.60f), rise);
            if (direction.z < 0.0f) color = Vector3f(0.24f, 0.21f, 0.17f) * (1.0f + 0.6f * direction.z);
            color += Vector3f(1.0f, 0.8f, 0.5f) * (0.5f * std::pow(cosine, 24.0f) + 60.0f * std::pow(cosine, 1500.0f));
            image->store(x, y, Vector4f(color, 1.0f));
        }
    return image;
}

/// The picture of a file, or the sky for "sky"; without a name one of Debian's package blender-data if it is installed.
/// As the device filters it: float16, whose largest number is 65504.
inline glint::Expected<glint::Image> loadEnvironment(std::filesystem::path path) {
    using namespace glint;
    if (path.empty()) {
        path = "/usr/share/blender/datafiles/studiolights/world/forest.exr";
        std::error_code none;
        if (!std::filesystem::exists(path, none)) path = "sky";
    }
    Expected<Image> image = path == "sky" ? createSky(512, 256) : Image::load(path);
    if (image) image = image->convert(FormatRGBAf32);
    if (!image) return image;
    for (uint32_t y = 0; y < image->height(); y++)
        for (uint32_t x = 0; x < image->width(); x++)
            image->store(x, y, glm::clamp(image->load(x, y), Vector4f(0.0f), Vector4f(65504.0f)));
    return image->convert(FormatRGBAf16);
}
