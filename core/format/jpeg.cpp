#include <glint/format/image.h>

#include <glint/base/format_error.h>

#include <turbojpeg.h>

#include <memory>

namespace glint {

namespace {

struct Release {
    void operator()(void* decoder) const { tjDestroy(decoder); }
};

}  // namespace

Expected<Image> decodeJpeg(std::span<const std::byte> bytes, uint64_t limit) {
    const auto malformed = [](const char* reason) {
        return unexpected(makeError(ErrorCode::Io, "image.jpeg_malformed", "not a readable JPEG file: {}", reason));
    };
    const std::unique_ptr<void, Release> decoder(tjInitDecompress());
    if (!decoder)
        return unexpected(makeError(ErrorCode::OutOfMemory, "image.too_large", "no memory for a JPEG decoder"));
    const auto* first = reinterpret_cast<const unsigned char*>(bytes.data());
    const auto size = static_cast<unsigned long>(bytes.size());
    int width = 0, height = 0, subsampling = 0, space = 0;
    if (tjDecompressHeader3(decoder.get(), first, size, &width, &height, &subsampling, &space))
        return malformed(tjGetErrorStr2(decoder.get()));
    if (space == TJCS_CMYK || space == TJCS_YCCK) return malformed("it has the colours of a printer (CMYK)");
    if (width <= 0 || height <= 0) return malformed("it has no texels");
    // A block of 8x8 texels of the component with the most of them takes at least a bit. Saying so before anything is
    // allocated keeps a file of 100 bytes from claiming all of `limit`.
    const uint64_t texels = static_cast<uint64_t>(width) * static_cast<uint64_t>(height);
    if (texels / 512 > bytes.size()) return malformed("the file ends too early");
    const bool gray = space == TJCS_GRAY;
    Expected<Image> image = Image::create(gray ? FormatRu8n : FormatRGBAu8n, static_cast<uint32_t>(width),
                                          static_cast<uint32_t>(height), limit);
    if (!image) return image;
    // Progressive files of thousands of scans would take hours. A warning leaves a picture, filled up with gray.
    if (tjDecompress2(decoder.get(), first, size, reinterpret_cast<unsigned char*>(image->bytes().data()), width, 0,
                      height, gray ? TJPF_GRAY : TJPF_RGBA, TJFLAG_LIMITSCANS) &&
        tjGetErrorCode(decoder.get()) != TJERR_WARNING)
        return malformed(tjGetErrorStr2(decoder.get()));
    return image;
}

}  // namespace glint
