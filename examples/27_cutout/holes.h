#pragma once

#include <glint/format/image.h>
#include <glint/math/math.h>

#include <algorithm>

/// How much of the mesh there is: round holes with soft borders, in rows that are half a step apart.
inline glint::Expected<glint::Image> createHoles() {
    using namespace glint;
    constexpr uint32_t size = 256;
    Expected<Image> image = Image::create(FormatRu8n, size, size);
    if (!image) return image;
    for (uint32_t y = 0; y < size; y++)
        for (uint32_t x = 0; x < size; x++) {
            const Vector2f place = (Vector2f(x, y) + 0.5f) / static_cast<float>(size);
            float distance = 1.0f;  // to the nearest of the corners' holes and the centre's
            for (const Vector2f hole : {Vector2f(0.5f), Vector2f(0, 0), Vector2f(1, 0), Vector2f(0, 1), Vector2f(1, 1)})
                distance = std::min(distance, glm::length(place - hole));
            image->store(x, y, Vector4f(std::clamp((distance - 0.18f) / 0.14f, 0.0f, 1.0f)));
        }
    return image;
}
