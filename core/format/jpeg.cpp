#include <glint/format/image.h>

#include <glint/base/format_error.h>

// stb_image with its JPEG reader alone, and under no name that a program's own copy could meet.
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_JPEG
#define STBI_NO_STDIO
#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#include <stb/stb_image.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

#include <climits>
#include <cstring>

namespace glint {

Expected<Image> decodeJpeg(std::span<const std::byte> bytes, uint64_t limit) {
    const auto malformed = [](const char* reason) {
        return unexpected(makeError(ErrorCode::Io, "image.jpeg_malformed", "not a readable JPEG file: {}",
                                    reason ? reason : "unknown"));
    };
    if (bytes.size() > INT_MAX) return malformed("it is longer than 2 GiB");
    const auto* first = reinterpret_cast<const stbi_uc*>(bytes.data());
    const int size = static_cast<int>(bytes.size());
    int width = 0, height = 0, components = 0;
    if (size < 4 || !stbi_info_from_memory(first, size, &width, &height, &components))
        return malformed(size < 4 ? "it is too short" : stbi_failure_reason());
    if (width <= 0 || height <= 0) return malformed("it has no texels");
    // A block of 8x8 texels of the component with the most of them takes at least a bit. Saying so before anything is
    // allocated keeps a file of 100 bytes from claiming all of `limit`.
    const uint64_t texels = static_cast<uint64_t>(width) * static_cast<uint64_t>(height);
    if (texels / 512 > bytes.size()) return malformed("the file ends too early");
    const int wanted = components == 1 ? 1 : 4;
    Expected<Image> image = Image::create(wanted == 1 ? FormatRu8n : FormatRGBAu8n, static_cast<uint32_t>(width),
                                          static_cast<uint32_t>(height), limit);
    if (!image) return image;
    stbi_uc* texel_bytes = stbi_load_from_memory(first, size, &width, &height, &components, wanted);
    if (!texel_bytes) return malformed(stbi_failure_reason());
    std::memcpy(image->bytes().data(), texel_bytes, image->bytes().size());
    stbi_image_free(texel_bytes);
    return image;
}

}  // namespace glint
