#include <glint/format/image.h>

#include <glint/base/format_error.h>

#include <algorithm>
#include <charconv>
#include <climits>
#include <cmath>
#include <cstring>
#include <memory>
#include <string_view>

#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_HDR
#define STBI_NO_STDIO
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image.h>
#include <stb/stb_image_write.h>

namespace glint {

namespace {

template <class... Args>
Error malformed(size_t byte, fmt::format_string<Args...> format, Args&&... args) {
    return makeError(ErrorCode::Io, "image.hdr_malformed", "no readable HDR file, at byte {}: {}", byte,
                     fmt::format(format, std::forward<Args>(args)...));
}

/// Stands before stb_image (2.27), which reads over the end of a file as zeros, or for ever, begins anew at a scan line
/// that is not packed like the first, and allocates what the header says.
class HdrGuard {
public:
    explicit HdrGuard(std::span<const std::byte> file)
        : file_(file), text_(reinterpret_cast<const char*>(file.data()), file.size()) {}

    /// Whether the header is one that the library reads, and says how large the image is.
    Status readHeader() {
        Expected<std::string_view> line = takeLine();
        if (!line || (*line != "#?RADIANCE" && *line != "#?RGBE"))
            return malformed(0, "it does not begin with a line '#?RADIANCE' or '#?RGBE'");
        std::string_view format;
        while (true) {
            line = takeLine();
            if (!line) return line.error();
            if (line->empty()) break;
            if (line->starts_with("FORMAT=")) format = line->substr(7);
        }
        if (format != "32-bit_rle_rgbe")
            return makeError(ErrorCode::Unsupported, "image.hdr_unsupported",
                             "the format '{}' cannot be read, only 32-bit_rle_rgbe", format);
        line = takeLine();
        if (!line) return line.error();
        if (!line->starts_with("-Y "))
            return makeError(ErrorCode::Unsupported, "image.hdr_unsupported",
                             "rows in the order '{}' cannot be read, only -Y HEIGHT +X WIDTH", *line);
        const char* end = line->data() + line->size();
        const auto [height_end, failure] = std::from_chars(line->data() + 3, end, height);
        constexpr std::string_view between = " +X ";
        if (failure != std::errc() || !std::string_view(height_end, end).starts_with(between))
            return malformed(at_, "the size '{}' is not -Y HEIGHT +X WIDTH", *line);
        const auto [width_end, failed] = std::from_chars(height_end + between.size(), end, width);
        if (failed != std::errc() || width_end != end || width == 0 || height == 0)
            return malformed(at_, "the size '{}' is not -Y HEIGHT +X WIDTH", *line);
        return {};
    }

    /// Whether the data hold the image.
    Status checkTexels() {
        const bool may_be_packed = width >= 8 && width < 32768;
        if (may_be_packed && left() >= 3 && at(0) == 2 && at(1) == 2 && at(2) < 128) {
            for (uint32_t y = 0; y < height; y++)
                if (Status status = checkScanLine(y); !status) return status;
            return {};
        }
        if (left() / 4 < static_cast<uint64_t>(width) * height)
            return malformed(file_.size(), "the file ends before its {}x{} texels do", width, height);
        // An older way of packing, which the library takes for texels. No texel looks like that: one channel of it has
        // the highest bit set.
        for (uint64_t texel = 0; texel < static_cast<uint64_t>(width) * height; texel++)
            if (at(4 * texel) == 1 && at(4 * texel + 1) == 1 && at(4 * texel + 2) == 1)
                return makeError(ErrorCode::Unsupported, "image.hdr_unsupported",
                                 "texel {} is a run of the older kind, which cannot be read", texel);
        return {};
    }

    uint32_t width = 0;
    uint32_t height = 0;

private:
    uint64_t left() const { return file_.size() - at_; }
    uint8_t at(uint64_t byte) const { return static_cast<uint8_t>(file_[at_ + byte]); }

    Expected<std::string_view> takeLine() {
        // The library's buffer for a line has 1024 bytes.
        constexpr size_t longest = 1000;
        const size_t length = text_.substr(at_, longest + 1).find('\n');
        if (length == std::string_view::npos)
            return unexpected(malformed(at_, "a line of the header has no end, or more than {} bytes", longest));
        const std::string_view line = text_.substr(at_, length);
        if (line.find('\0') != std::string_view::npos)
            return unexpected(malformed(at_, "a line of the header has a zero byte"));
        at_ += length + 1;
        return line;
    }

    Status checkScanLine(uint32_t y) {
        if (left() < 4 || at(0) != 2 || at(1) != 2 || (at(2) << 8 | at(3)) != static_cast<int>(width))
            return malformed(at_, "scan line {} does not begin with 2, 2 and its width {}", y, width);
        at_ += 4;
        for (int channel = 0; channel < 4; channel++)
            for (uint32_t x = 0; x < width;) {
                const uint32_t code = left() > 0 ? at(0) : 0;
                const uint32_t run = code > 128 ? code - 128 : code;
                const uint32_t size = code > 128 ? 2 : 1 + code;
                if (run == 0 || run > width - x || left() < size)
                    return malformed(at_,
                                     "channel {} of scan line {} has a run of {} texels at texel {} of {}, {} bytes "
                                     "before the end of the file",
                                     channel, y, run, x, width, left());
                x += run;
                at_ += size;
            }
        return {};
    }

    std::span<const std::byte> file_;
    std::string_view text_;
    size_t at_ = 0;
};

// What the library writes is cut off, not rounded, has no sense for NaN and negative values, and no end at large ones;
// so it gets values that it need not change.
Vector3f quantize(const Vector4f& value) {
    constexpr float largest = 255.0f * 0x1p119f;
    Vector3f clamped;
    for (int i = 0; i < 3; i++) clamped[i] = value[i] > 0.0f ? std::min(value[i], largest) : 0.0f;
    const float most = std::max({clamped.x, clamped.y, clamped.z});
    int exponent = 0;
    (void)std::frexp(most, &exponent);
    // 255.5 units and more round to 256, which is the next exponent's 128.
    if (std::ldexp(most, 8 - exponent) >= 255.5f) exponent++;
    for (int i = 0; i < 3; i++)
        clamped[i] = std::ldexp(std::nearbyint(std::ldexp(clamped[i], 8 - exponent)), exponent - 8);
    return clamped;
}

}  // namespace

Expected<Image> decodeHdr(std::span<const std::byte> bytes, uint64_t limit) {
    HdrGuard guard(bytes);
    if (Status status = guard.readHeader(); !status) return unexpected(status.error());
    const uint64_t most = std::min<uint64_t>(limit, INT_MAX);
    if (bytes.size() > INT_MAX || static_cast<uint64_t>(guard.width) * guard.height > most / sizeof(Vector4f) ||
        std::max(guard.width, guard.height) > STBI_MAX_DIMENSIONS)
        return unexpected(makeError(ErrorCode::OutOfRange, "image.too_large",
                                    "an HDR image of {}x{} texels in a file of {} bytes exceeds the limit of {} bytes",
                                    guard.width, guard.height, bytes.size(), most));
    if (Status status = guard.checkTexels(); !status) return unexpected(status.error());

    int width = 0;
    int height = 0;
    const std::unique_ptr<float, void (*)(void*)> texels(
        stbi_loadf_from_memory(reinterpret_cast<const stbi_uc*>(bytes.data()), static_cast<int>(bytes.size()), &width,
                               &height, nullptr, 4),
        stbi_image_free);
    if (!texels)
        return unexpected(
            makeError(ErrorCode::OutOfMemory, "image.out_of_memory", "stb_image: {}", stbi_failure_reason()));
    Expected<Image> image = Image::create(FormatRGBAf32, guard.width, guard.height, limit);
    if (image) std::memcpy(image->bytes().data(), texels.get(), image->bytes().size());
    return image;
}

Expected<std::vector<std::byte>> encodeHdr(const Image& image) {
    if (image.isEmpty())
        return unexpected(makeError(ErrorCode::InvalidArgument, "image.size_zero", "an empty image cannot be an HDR"));
    const bool is_gray = image.format() == FormatRf16 || image.format() == FormatRf32;
    if (!is_gray && image.format() != FormatRGBf32 && image.format() != FormatRGBAf16 &&
        image.format() != FormatRGBAf32)
        return unexpected(makeError(ErrorCode::Unsupported, "image.hdr_format",
                                    "HDR cannot hold {}: convert to a float format of one, three or four channels",
                                    toString(image.format())));
    const uint64_t texels = static_cast<uint64_t>(image.width()) * image.height();
    if (texels > INT_MAX / 3)
        return unexpected(makeError(ErrorCode::OutOfRange, "image.too_large",
                                    "{}x{} texels: an HDR is written up to {}", image.width(), image.height(),
                                    INT_MAX / 3));

    std::vector<Vector3f> values;
    values.reserve(texels);
    for (uint32_t y = 0; y < image.height(); y++)
        for (uint32_t x = 0; x < image.width(); x++) {
            const Vector4f value = image.load(x, y);
            values.push_back(quantize(is_gray ? Vector4f(value.x) : value));
        }
    std::vector<std::byte> file;
    const auto write = [](void* context, void* data, int size) {
        const auto* first = static_cast<const std::byte*>(data);
        static_cast<std::vector<std::byte>*>(context)->insert(static_cast<std::vector<std::byte>*>(context)->end(),
                                                              first, first + size);
    };
    stbi_write_hdr_to_func(write, &file, static_cast<int>(image.width()), static_cast<int>(image.height()), 3,
                           &values[0].x);
    return file;
}

}  // namespace glint
