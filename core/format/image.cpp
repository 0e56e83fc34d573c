#include <glint/format/image.h>

#include <glint/base/file.h>
#include <glint/base/format_error.h>

#include <glm/gtc/packing.hpp>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <exception>

namespace glint {

namespace {

enum class ChannelType : uint8_t { None, U8n, I8n, U16n, I16n, F16, F32 };

ChannelType channelType(Format format) {
    switch (format) {
        case FormatRu8n:
        case FormatRGu8n:
        case FormatRGBAu8n:
        case FormatRGBAu8ns:
        case FormatBGRAu8n:
        case FormatBGRAu8ns: return ChannelType::U8n;
        case FormatRi8n:
        case FormatRGi8n:
        case FormatRGBAi8n: return ChannelType::I8n;
        case FormatRu16n:
        case FormatRGu16n:
        case FormatRGBAu16n:
        case FormatDu16n: return ChannelType::U16n;
        case FormatRi16n:
        case FormatRGi16n:
        case FormatRGBAi16n: return ChannelType::I16n;
        case FormatRf16:
        case FormatRGf16:
        case FormatRGBAf16: return ChannelType::F16;
        case FormatRf32:
        case FormatRGf32:
        case FormatRGBf32:
        case FormatRGBAf32:
        case FormatDf32: return ChannelType::F32;
        default: return ChannelType::None;
    }
}

bool isBgra(Format format) { return format == FormatBGRAu8n || format == FormatBGRAu8ns; }

template <class T>
T get(const std::byte* bytes, uint32_t index) {
    T value;
    std::memcpy(&value, bytes + index * sizeof(T), sizeof(T));
    return value;
}

template <class T>
void put(std::byte* bytes, uint32_t index, T value) {
    std::memcpy(bytes + index * sizeof(T), &value, sizeof(T));
}

float decode(ChannelType type, const std::byte* bytes, uint32_t index) {
    switch (type) {
        case ChannelType::None: return 0.0f;
        case ChannelType::U8n: return static_cast<float>(get<uint8_t>(bytes, index)) / 255.0f;
        case ChannelType::I8n: return std::max(static_cast<float>(get<int8_t>(bytes, index)) / 127.0f, -1.0f);
        case ChannelType::U16n: return static_cast<float>(get<uint16_t>(bytes, index)) / 65535.0f;
        case ChannelType::I16n: return std::max(static_cast<float>(get<int16_t>(bytes, index)) / 32767.0f, -1.0f);
        case ChannelType::F16: return glm::unpackHalf1x16(get<uint16_t>(bytes, index));
        case ChannelType::F32: return get<float>(bytes, index);
    }
    return 0.0f;
}

template <class T>
T quantize(float value, float low, float scale) {
    if (std::isnan(value)) return 0;
    return static_cast<T>(std::lround(std::clamp(value, low, 1.0f) * scale));
}

void encode(ChannelType type, std::byte* bytes, uint32_t index, float value) {
    switch (type) {
        case ChannelType::None: break;
        case ChannelType::U8n: put(bytes, index, quantize<uint8_t>(value, 0.0f, 255.0f)); break;
        case ChannelType::I8n: put(bytes, index, quantize<int8_t>(value, -1.0f, 127.0f)); break;
        case ChannelType::U16n: put(bytes, index, quantize<uint16_t>(value, 0.0f, 65535.0f)); break;
        case ChannelType::I16n: put(bytes, index, quantize<int16_t>(value, -1.0f, 32767.0f)); break;
        case ChannelType::F16: put(bytes, index, glm::packHalf1x16(value)); break;
        case ChannelType::F32: put(bytes, index, value); break;
    }
}

std::string extension(const std::filesystem::path& path) {
    std::string text = path.extension().string();
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

struct FileFormat {
    std::string_view extension;
    Expected<Image> (*decode)(std::span<const std::byte>, uint64_t limit);
    Expected<std::vector<std::byte>> (*encode)(const Image&);  // null: not written
};
constexpr FileFormat file_formats[] = {{".png", decodePng, encodePng},
                                       {".jpg", decodeJpeg, nullptr},
                                       {".jpeg", decodeJpeg, nullptr},
                                       {".hdr", decodeHdr, encodeHdr},
                                       {".exr", decodeExr, encodeExr}};

Expected<FileFormat> fileFormat(const std::filesystem::path& path, bool is_written) {
    const std::string ending = extension(path);
    for (const FileFormat& format : file_formats)
        if (format.extension == ending && (format.encode || !is_written)) return format;
    return unexpected(makeError(ErrorCode::Unsupported, "image.unknown_extension",
                                "'{}': images that are {} end in {}.hdr or .exr, not in '{}'", path.string(),
                                is_written ? "written" : "read", is_written ? ".png, " : ".png, .jpg, .jpeg, ",
                                path.extension().string()));
}

}  // namespace

Expected<Image> Image::create(Format format, uint32_t width, uint32_t height, uint64_t limit) {
    const FormatInfo& info = formatInfo(format);
    if (info.block_size == 0 || info.compressed)
        return unexpected(makeError(ErrorCode::InvalidArgument, "image.format",
                                    "an image cannot have the format {}: its texels must stand alone", info.name));
    if (width == 0 || height == 0)
        return unexpected(makeError(ErrorCode::InvalidArgument, "image.size_zero", "an image of {}x{} texels has none",
                                    width, height));
    // At most 2^32 * 2^32 texels, so divide rather than multiply by their size.
    const uint64_t texels = static_cast<uint64_t>(width) * height;
    if (texels > limit / info.block_size)
        return unexpected(makeError(ErrorCode::OutOfRange, "image.too_large",
                                    "{}x{} texels of {} take more than the limit of {} bytes", width, height, info.name,
                                    limit));
    Image image;
    image.format_ = format;
    image.width_ = width;
    image.height_ = height;
    try {
        image.bytes_.resize(texels * info.block_size);
    } catch (const std::exception&) {
        return unexpected(makeError(ErrorCode::OutOfMemory, "image.out_of_memory",
                                    "{}x{} texels of {} take {} bytes, which are not there", width, height, info.name,
                                    texels * info.block_size));
    }
    return image;
}

Expected<Image> Image::create(Format format, uint32_t width, uint32_t height, std::span<const std::byte> data) {
    const uint64_t texels = static_cast<uint64_t>(width) * height;
    const uint64_t texel_size = formatInfo(format).block_size;
    if (texel_size != 0 && texels != 0 && (data.size() % texel_size != 0 || data.size() / texel_size != texels))
        return unexpected(makeError(ErrorCode::InvalidArgument, "image.data_size",
                                    "{} bytes are not {}x{} texels of {}, {} bytes each", data.size(), width, height,
                                    toString(format), texel_size));
    Expected<Image> image = create(format, width, height, data.size());
    if (image) std::copy(data.begin(), data.end(), image->bytes_.begin());
    return image;
}

Expected<Image> Image::load(const std::filesystem::path& path, uint64_t limit) {
    const Expected<FileFormat> format = fileFormat(path, false);
    if (!format) return unexpected(format.error());
    Expected<std::vector<std::byte>> bytes = readFile(path, limit);
    if (!bytes) return unexpected(bytes.error());
    Expected<Image> image = format->decode(*bytes, limit);
    if (!image)
        return unexpected(Error::inFile(image.error().code(), image.error().id().data(), image.error().message(),
                                        path.filename().string(), 0));
    return image;
}

Status Image::save(const std::filesystem::path& path) const {
    const Expected<FileFormat> format = fileFormat(path, true);
    if (!format) return format.error();
    Expected<std::vector<std::byte>> bytes = format->encode(*this);
    if (!bytes) return bytes.error();
    return writeFile(path, *bytes);
}

std::span<std::byte> Image::texel(uint32_t x, uint32_t y) {
    return std::span(bytes_).subspan((static_cast<size_t>(y) * width_ + x) * texelSize(), texelSize());
}

std::span<const std::byte> Image::texel(uint32_t x, uint32_t y) const {
    return std::span(bytes_).subspan((static_cast<size_t>(y) * width_ + x) * texelSize(), texelSize());
}

Vector4f Image::load(uint32_t x, uint32_t y) const {
    Vector4f value(0, 0, 0, 1);
    const ChannelType type = channelType(format_);
    if (type == ChannelType::None || x >= width_ || y >= height_) return value;
    const std::byte* bytes = texel(x, y).data();
    for (uint32_t i = 0; i < formatInfo(format_).components; i++) value[static_cast<int>(i)] = decode(type, bytes, i);
    if (isBgra(format_)) std::swap(value.x, value.z);
    return value;
}

void Image::store(uint32_t x, uint32_t y, const Vector4f& value) {
    const ChannelType type = channelType(format_);
    if (type == ChannelType::None || x >= width_ || y >= height_) return;
    const Vector4f ordered = isBgra(format_) ? Vector4f(value.z, value.y, value.x, value.w) : value;
    std::byte* bytes = texel(x, y).data();
    for (uint32_t i = 0; i < formatInfo(format_).components; i++) encode(type, bytes, i, ordered[static_cast<int>(i)]);
}

Expected<Image> Image::convert(Format format) const {
    for (const Format each : {format_, format})
        if (channelType(each) == ChannelType::None)
            return unexpected(makeError(ErrorCode::Unsupported, "image.format",
                                        "cannot convert {} to {}: {} has no channels of 8 or 16 normalised or of 16 or "
                                        "32 float bits",
                                        toString(format_), toString(format), toString(each)));
    Expected<Image> image = create(format, width_, height_, ~0ull);
    if (!image) return image;
    for (uint32_t y = 0; y < height_; y++)
        for (uint32_t x = 0; x < width_; x++) image->store(x, y, load(x, y));
    return image;
}

}  // namespace glint
