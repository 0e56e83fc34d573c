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
    const std::unique_ptr<void, Release> holder(tjInitDecompress());
    void* decoder = holder.get();
    if (!decoder)
        return unexpected(makeError(ErrorCode::OutOfMemory, "image.too_large", "no memory for a JPEG decoder"));
    const auto* first = reinterpret_cast<const unsigned char*>(bytes.data());
    const auto size = static_cast<unsigned long>(bytes.size());
    int width = 0, height = 0, subsampling = -1, space = -1;
    const bool is_told = tjDecompressHeader3(decoder, first, size, &width, &height, &subsampling, &space) == 0;
    // A warning about the header comes with all that it says.
    if (!is_told && (tjGetErrorCode(decoder) != TJERR_WARNING || subsampling < 0 || space < 0))
        return malformed(tjGetErrorStr2(decoder));
    if (width <= 0 || height <= 0) return malformed("it has no texels");
    if (space == TJCS_CMYK || space == TJCS_YCCK)
        return unexpected(makeError(ErrorCode::Unsupported, "image.jpeg_unsupported",
                                    "its {}x{} texels have the colours of a printer (CMYK); this reader reads gray and "
                                    "RGB",
                                    width, height));
    // A block of 8x8 texels of the component with the most of them takes at least a bit. Saying so before anything is
    // allocated keeps a file of 100 bytes from claiming all of `limit`.
    const uint64_t texels = static_cast<uint64_t>(width) * static_cast<uint64_t>(height);
    if (texels / 512 > bytes.size()) return malformed("the file ends too early");
    const bool gray = space == TJCS_GRAY;
    Expected<Image> image = Image::create(gray ? FormatRu8n : FormatRGBAu8n, static_cast<uint32_t>(width),
                                          static_cast<uint32_t>(height), limit);
    if (!image) return image;
    // Progressive files of thousands of scans would take hours.
    const auto decode = [&] {
        return tjDecompress2(decoder, first, size, reinterpret_cast<unsigned char*>(image->bytes().data()), width, 0,
                             height, gray ? TJPF_GRAY : TJPF_RGBA, TJFLAG_LIMITSCANS) == 0;
    };
    if (decode()) return image;
    if (tjGetErrorCode(decoder) == TJERR_WARNING) {
        // A warning leaves a picture, filled up with gray. But libjpeg-turbo 2.1.5 calls an error that comes after a
        // warning one, too: then the last texel keeps what it has.
        std::byte& last = image->bytes().back();
        const std::byte found = last;
        last = ~found;
        decode();
        if (last == found) return image;
    }
    return malformed(tjGetErrorStr2(decoder));
}

}  // namespace glint
