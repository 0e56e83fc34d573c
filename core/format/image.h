#pragma once

#include <glint/base/expected.h>
#include <glint/base/status.h>
#include <glint/format/format.h>
#include <glint/math/math.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

namespace glint {

/// A picture in host memory: rows of texels from top to bottom, left to right, without padding. A value: copies copy
/// the texels. Formats whose texels stand alone (all but the block-compressed ones).
class Image {
public:
    /// Largest number of bytes that an image read from a file may take, unless the caller says otherwise.
    static constexpr uint64_t default_limit = 1ull << 30;

    /// An empty image: no texels, FormatUnknown.
    Image() = default;

    /// An image of zeros. Errors: "image.size_zero", "image.format" (unknown or compressed), "image.too_large" (more
    /// than `limit` bytes), "image.out_of_memory".
    static Expected<Image> create(Format format, uint32_t width, uint32_t height, uint64_t limit = default_limit);

    /// An image of the given texels. Errors: those above and "image.data_size" (not width * height texels).
    static Expected<Image> create(Format format, uint32_t width, uint32_t height, std::span<const std::byte> data);

    /// Reads a file; its ending says which format it has (".png", ".jpg" or ".jpeg", ".hdr", ".exr"; see decodePng,
    /// decodeJpeg, decodeHdr, decodeExr). `limit` bounds the bytes of the file and of the image. Errors: those of
    /// readFile, "image.unknown_extension" and those of the format, which name the file.
    static Expected<Image> load(const std::filesystem::path& path, uint64_t limit = default_limit);

    /// Writes a file, as its ending says (".png", ".hdr", ".exr"; see encodePng, encodeHdr, encodeExr). Errors: those
    /// of writeFile, "image.unknown_extension" and those of the format.
    Status save(const std::filesystem::path& path) const;

    uint32_t width() const { return width_; }
    uint32_t height() const { return height_; }
    Format format() const { return format_; }
    /// Bytes of one texel.
    uint32_t texelSize() const { return formatInfo(format_).block_size; }
    bool isEmpty() const { return bytes_.empty(); }

    std::span<std::byte> bytes() { return bytes_; }
    std::span<const std::byte> bytes() const { return bytes_; }

    /// The bytes of one texel; x < width(), y < height().
    std::span<std::byte> texel(uint32_t x, uint32_t y);
    std::span<const std::byte> texel(uint32_t x, uint32_t y) const;

    /// A texel as a shader's `texelFetch` returns it, but for sRGB formats, whose stored values are not decoded:
    /// channels in the order R, G, B, A, normalised ones in [0, 1] or [-1, 1], absent ones 0, absent alpha 1. For
    /// formats with channels of 8 normalised, 16 normalised, float16 or float32 bits; all others, and places outside of
    /// the image, give (0, 0, 0, 1).
    Vector4f load(uint32_t x, uint32_t y) const;

    /// The inverse, for the same formats: normalised values are clamped and rounded to nearest, NaN becomes 0. Other
    /// formats, and places outside of the image, are left as they are.
    void store(uint32_t x, uint32_t y, const Vector4f& value);

    /// The same picture in another format, by load() and store(). Errors: "image.format" if one of both cannot.
    Expected<Image> convert(Format format) const;

    bool operator==(const Image&) const = default;

private:
    Format format_ = FormatUnknown;
    uint32_t width_ = 0;
    uint32_t height_ = 0;
    std::vector<std::byte> bytes_;
};

/// Reads a PNG file's bytes. One and two channels give FormatRu8n, RGu8n, Ru16n or RGu16n; three channels, palettes and
/// transparent colours give RGBAu8n or RGBAu16n. Values are those stored: no gamma or colour profile is applied.
/// Never reads outside of `bytes`, and takes at most `limit` bytes for the image and a few megabytes beside it.
/// Errors: "image.png_malformed", "image.too_large".
Expected<Image> decodePng(std::span<const std::byte> bytes, uint64_t limit = Image::default_limit);

/// Reads a JPEG file's bytes with libjpeg-turbo, baseline or progressive: FormatRu8n for one channel, RGBAu8n for
/// three. Values are those stored: no colour profile is applied, and no orientation of the camera. A file that ends
/// early is a picture with gray in it. The image may take `limit` bytes, and the reader four times as much beside it.
/// Errors: "image.jpeg_malformed"; "image.jpeg_unsupported" (the colours of printers, CMYK and YCCK);
/// "image.too_large".
Expected<Image> decodeJpeg(std::span<const std::byte> bytes, uint64_t limit = Image::default_limit);

/// Makes a PNG file's bytes. For FormatRu8n, RGu8n, RGBAu8n, RGBAu8ns, BGRAu8n, BGRAu8ns, Ru16n, RGu16n and RGBAu16n;
/// the sRGB ones are marked so. An image whose alpha is 1 everywhere is written without alpha. Errors:
/// "image.png_format", "image.size_zero" (an empty image), "image.too_large" (a side of 2^31 or more).
Expected<std::vector<std::byte>> encodePng(const Image& image);

/// Reads a Radiance HDR file's bytes (RGBE; rows from top to bottom, packed or not) into FormatRGBAf32 with alpha 1.
/// Values are those stored: EXPOSURE and the like are not applied. A texel (m, e) is m * 2^(e - 136), so its largest
/// value is 1.7e38. Takes at most `limit` bytes for the image and as much again while it reads. Errors:
/// "image.hdr_malformed", with the byte; "image.hdr_unsupported" (XYZE, rows in another order, runs of the format's
/// first years); "image.too_large" (more than `limit`, or than 2 GiB).
Expected<Image> decodeHdr(std::span<const std::byte> bytes, uint64_t limit = Image::default_limit);

/// Makes a Radiance HDR file's bytes. For FormatRf16 and Rf32 (as gray), RGBf32, RGBAf16 and RGBAf32; alpha is dropped.
/// RGBE has one exponent for three mantissas of 8 bits, which are rounded to nearest: a channel differs by at most
/// 2/511 of the largest channel of its texel (half a unit; the largest has 128 of them or more, or 127.75 where it is
/// about to round up to the next power of two). What RGBE has no place for is changed further: a texel whose largest
/// channel is below 1e-32 becomes 0, negative values and NaN become 0, infinity and all above 255 * 2^119 = 1.69e38
/// become that. Errors: "image.hdr_format", "image.size_zero", "image.too_large" (more than 715827882 texels).
Expected<std::vector<std::byte>> encodeHdr(const Image& image);

/// Reads an OpenEXR file's bytes: one part, scan lines or tiles (the largest level), any compression, channels of
/// float16 or float32 that are not subsampled. R, G, B, A give RGBA (absent colours are 0, absent alpha is 1); R, G
/// without B and A give RG; Y, A give RG; R, Y or a single channel of any name give R; further channels are passed
/// over. 16 bits if all of them have, else 32. Values are those stored, NaN and infinity included. The image is the
/// file's data window; where it lies within the display window is dropped. Takes at most `limit` bytes for the image;
/// beside it OpenEXR takes some times the size of a strip or tile, which itself is kept to `limit` and 16 MiB. Errors:
/// "image.exr_malformed", "image.exr_unsupported", "image.too_large".
Expected<Image> decodeExr(std::span<const std::byte> bytes, uint64_t limit = Image::default_limit);

/// Makes an OpenEXR file's bytes: scan lines packed by ZIP, every value as it is, NaN and infinity included. For
/// FormatRf16 and Rf32 (channel Y), RGf16 and RGf32 (R, G), RGBf32, RGBAf16 and RGBAf32. Errors: "image.exr_format",
/// "image.size_zero", "image.too_large" (a side of 2^30 or more).
Expected<std::vector<std::byte>> encodeExr(const Image& image);

}  // namespace glint
