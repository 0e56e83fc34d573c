#include <glint/format/image.h>

#include <glint/base/format_error.h>

#include <png.h>

#include <algorithm>
#include <bit>
#include <csetjmp>
#include <cstdio>
#include <cstring>

// libpng reports errors by longjmp. Each function here that calls setjmp keeps nothing with a destructor in its frame,
// and changes no local variable of it after the setjmp: all state lives in the object it is handed.

namespace glint {

namespace {

struct Session {
    png_structp png = nullptr;
    png_infop info = nullptr;
    bool writing = false;
    char message[200] = {};

    std::span<const std::byte> input;
    size_t position = 0;
    std::vector<std::byte>* output = nullptr;

    Session() = default;
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;
    ~Session() {
        if (writing)
            png_destroy_write_struct(&png, &info);
        else
            png_destroy_read_struct(&png, &info, nullptr);
    }
};

[[noreturn]] void onError(png_structp png, png_const_charp text) {
    Session& session = *static_cast<Session*>(png_get_error_ptr(png));
    std::snprintf(session.message, sizeof session.message, "%s", text);
    std::longjmp(png_jmpbuf(png), 1);
}

// Warnings concern chunks that do not change the values of the texels.
void onWarning(png_structp, png_const_charp) {}

void onRead(png_structp png, png_bytep bytes, size_t size) {
    Session& session = *static_cast<Session*>(png_get_io_ptr(png));
    if (size > session.input.size() - session.position) png_error(png, "the file ends too early");
    std::memcpy(bytes, session.input.data() + session.position, size);
    session.position += size;
}

void onWrite(png_structp png, png_bytep bytes, size_t size) {
    Session& session = *static_cast<Session*>(png_get_io_ptr(png));
    const auto* first = reinterpret_cast<const std::byte*>(bytes);
    session.output->insert(session.output->end(), first, first + size);
}

struct Header {
    uint32_t width = 0;
    uint32_t height = 0;
    Format format = FormatUnknown;
};

// Up to the first row. libpng allocates its rows later, so that the size can be judged first.
bool readHeader(Session& session, Header& header) {
    if (setjmp(png_jmpbuf(session.png))) return false;
    png_set_read_fn(session.png, &session, onRead);
    png_set_user_limits(session.png, 0x7fffffff, 0x7fffffff);
    // Text and profiles are of no use here; the cap keeps a small file from unpacking into a large one.
    png_set_chunk_malloc_max(session.png, 4u << 20);
    png_set_chunk_cache_max(session.png, 64);
    png_read_info(session.png, session.info);

    header.width = png_get_image_width(session.png, session.info);
    header.height = png_get_image_height(session.png, session.info);
    const bool is_deep = png_get_bit_depth(session.png, session.info) == 16;
    const int color = png_get_color_type(session.png, session.info);
    const bool has_alpha =
        (color & PNG_COLOR_MASK_ALPHA) != 0 || png_get_valid(session.png, session.info, PNG_INFO_tRNS) != 0;
    if ((color & PNG_COLOR_MASK_COLOR) != 0)
        header.format = is_deep ? FormatRGBAu16n : FormatRGBAu8n;
    else if (has_alpha)
        header.format = is_deep ? FormatRGu16n : FormatRGu8n;
    else
        header.format = is_deep ? FormatRu16n : FormatRu8n;

    png_set_expand(session.png);
    if ((color & PNG_COLOR_MASK_COLOR) != 0 && !has_alpha) png_set_add_alpha(session.png, 0xffff, PNG_FILLER_AFTER);
    if (std::endian::native == std::endian::little) png_set_swap(session.png);
    return true;
}

bool readRows(Session& session, png_bytep bytes, size_t row_size, uint32_t height) {
    if (setjmp(png_jmpbuf(session.png))) return false;
    const int passes = png_set_interlace_handling(session.png);
    png_read_update_info(session.png, session.info);
    if (png_get_rowbytes(session.png, session.info) != row_size) png_error(session.png, "unexpected size of a row");
    for (int pass = 0; pass < passes; pass++)
        for (uint32_t y = 0; y < height; y++) png_read_row(session.png, bytes + y * row_size, nullptr);
    png_read_end(session.png, nullptr);
    return true;
}

struct Layout {
    int color = 0;
    int depth = 8;
    bool is_bgr = false;
    bool is_srgb = false;
    bool drop_alpha = false;
};

bool writeRows(Session& session, const Image& image, const Layout& layout) {
    if (setjmp(png_jmpbuf(session.png))) return false;
    png_set_write_fn(session.png, &session, onWrite, nullptr);
    png_set_user_limits(session.png, 0x7fffffff, 0x7fffffff);
    png_set_IHDR(session.png, session.info, image.width(), image.height(), layout.depth,
                 layout.drop_alpha ? PNG_COLOR_TYPE_RGB : layout.color, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (layout.is_srgb) png_set_sRGB(session.png, session.info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(session.png, session.info);
    if (layout.depth == 16 && std::endian::native == std::endian::little) png_set_swap(session.png);
    if (layout.is_bgr) png_set_bgr(session.png);
    if (layout.drop_alpha) png_set_filler(session.png, 0, PNG_FILLER_AFTER);
    for (uint32_t y = 0; y < image.height(); y++)
        png_write_row(session.png, reinterpret_cast<png_const_bytep>(image.texel(0, y).data()));
    png_write_end(session.png, nullptr);
    return true;
}

bool isOpaque(const Image& image, size_t channel_size) {
    const std::span<const std::byte> bytes = image.bytes();
    const size_t stride = 4 * channel_size;
    for (size_t i = 3 * channel_size; i < bytes.size(); i += stride)
        for (size_t k = 0; k < channel_size; k++)
            if (bytes[i + k] != std::byte(0xff)) return false;
    return true;
}

Expected<Layout> layoutOf(const Image& image) {
    Layout layout;
    switch (image.format()) {
        case FormatRu8n: layout.color = PNG_COLOR_TYPE_GRAY; break;
        case FormatRGu8n: layout.color = PNG_COLOR_TYPE_GRAY_ALPHA; break;
        case FormatRGBAu8n: layout.color = PNG_COLOR_TYPE_RGB_ALPHA; break;
        case FormatRGBAu8ns: layout = {.color = PNG_COLOR_TYPE_RGB_ALPHA, .is_srgb = true}; break;
        case FormatBGRAu8n: layout = {.color = PNG_COLOR_TYPE_RGB_ALPHA, .is_bgr = true}; break;
        case FormatBGRAu8ns: layout = {.color = PNG_COLOR_TYPE_RGB_ALPHA, .is_bgr = true, .is_srgb = true}; break;
        case FormatRu16n: layout = {.color = PNG_COLOR_TYPE_GRAY, .depth = 16}; break;
        case FormatRGu16n: layout = {.color = PNG_COLOR_TYPE_GRAY_ALPHA, .depth = 16}; break;
        case FormatRGBAu16n: layout = {.color = PNG_COLOR_TYPE_RGB_ALPHA, .depth = 16}; break;
        default:
            return unexpected(makeError(ErrorCode::Unsupported, "image.png_format",
                                        "PNG cannot hold {}: convert to a normalised format of 8 or 16 bits",
                                        toString(image.format())));
    }
    layout.drop_alpha = layout.color == PNG_COLOR_TYPE_RGB_ALPHA && isOpaque(image, layout.depth == 16 ? 2 : 1);
    return layout;
}

}  // namespace

Expected<Image> decodePng(std::span<const std::byte> bytes, uint64_t limit) {
    Session session;
    session.input = bytes;
    const auto malformed = [&](const char* reason) {
        return unexpected(makeError(ErrorCode::Io, "image.png_malformed", "no readable PNG file, before byte {}: {}",
                                    session.position, reason));
    };
    if (bytes.size() < 8 || png_sig_cmp(reinterpret_cast<png_const_bytep>(bytes.data()), 0, 8) != 0)
        return malformed("it does not begin with PNG's signature");

    session.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &session, onError, onWarning);
    if (session.png) session.info = png_create_info_struct(session.png);
    if (!session.info)
        return unexpected(makeError(ErrorCode::OutOfMemory, "image.out_of_memory", "libpng has no memory to start"));

    Header header;
    if (!readHeader(session, header)) return malformed(session.message);
    // DEFLATE packs at most 1032 to 1, and eight texels are a byte or more: a larger image cannot be in there. Saying
    // so before anything is allocated keeps a file of 100 bytes from claiming all of `limit`.
    const uint64_t texels = static_cast<uint64_t>(header.width) * header.height;
    if (texels / 8 > static_cast<uint64_t>(bytes.size()) * 1032) return malformed("the file ends too early");
    Expected<Image> image = Image::create(header.format, header.width, header.height, limit);
    if (!image) return image;
    if (!readRows(session, reinterpret_cast<png_bytep>(image->bytes().data()),
                  size_t{header.width} * image->texelSize(), header.height))
        return malformed(session.message);
    return image;
}

Expected<std::vector<std::byte>> encodePng(const Image& image) {
    if (image.isEmpty())
        return unexpected(makeError(ErrorCode::InvalidArgument, "image.size_zero", "an empty image cannot be a PNG"));
    const Expected<Layout> layout = layoutOf(image);
    if (!layout) return unexpected(layout.error());
    if (std::max(image.width(), image.height()) > 0x7fffffffu)
        return unexpected(makeError(ErrorCode::OutOfRange, "image.too_large",
                                    "{}x{} texels: a side of a PNG ends at 2^31 - 1", image.width(), image.height()));

    std::vector<std::byte> output;
    Session session;
    session.writing = true;
    session.output = &output;
    session.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &session, onError, onWarning);
    if (session.png) session.info = png_create_info_struct(session.png);
    if (!session.info)
        return unexpected(makeError(ErrorCode::OutOfMemory, "image.out_of_memory", "libpng has no memory to start"));

    if (!writeRows(session, image, *layout))
        return unexpected(makeError(ErrorCode::Internal, "image.png_write", "libpng: {}", session.message));
    return output;
}

}  // namespace glint
