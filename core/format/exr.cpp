#include "detail/exr_header.h"

#include <glint/format/image.h>

#include <glint/base/format_error.h>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfTiledInputFile.h>

#include <algorithm>
#include <cstring>
#include <new>

namespace glint {

namespace {

Error malformed(const char* reason) {
    return makeError(ErrorCode::Io, "image.exr_malformed", "no readable EXR file: {}", reason);
}

/// The file with another header in front.
class Input : public Imf::IStream {
public:
    Input(std::span<const std::byte> file, std::span<const std::byte> header)
        : IStream("EXR"), file_(file), header_(header) {}

    bool read(char bytes[], int count) override {
        const auto size = static_cast<size_t>(std::max(count, 0));
        if (size > file_.size() - at_) throw std::runtime_error("the file ends too early");
        const size_t from_header = at_ < header_.size() ? std::min(size, header_.size() - at_) : 0;
        if (from_header > 0) std::memcpy(bytes, header_.data() + at_, from_header);
        if (size > from_header) std::memcpy(bytes + from_header, file_.data() + at_ + from_header, size - from_header);
        at_ += size;
        return at_ < file_.size();
    }
    uint64_t tellg() override { return at_; }
    void seekg(uint64_t position) override { at_ = std::min<uint64_t>(position, file_.size()); }

private:
    std::span<const std::byte> file_;
    std::span<const std::byte> header_;
    size_t at_ = 0;
};

class Output : public Imf::OStream {
public:
    explicit Output(std::vector<std::byte>& file) : OStream("EXR"), file_(file) {}

    void write(const char bytes[], int count) override {
        const auto size = static_cast<size_t>(count);
        file_.resize(std::max(file_.size(), at_ + size));
        std::memcpy(file_.data() + at_, bytes, size);
        at_ += size;
    }
    uint64_t tellp() override { return at_; }
    void seekp(uint64_t position) override { at_ = position; }

private:
    std::vector<std::byte>& file_;
    size_t at_ = 0;
};

/// Where each channel of an image lies in its texels. `window` is the part of the plane that the image covers.
Imf::FrameBuffer frameOf(Image& image, const std::vector<std::string>& channels, const Imath::Box2i& window) {
    const FormatInfo& info = formatInfo(image.format());
    const size_t channel_size = info.block_size / info.components;
    const Imf::PixelType type = channel_size == 2 ? Imf::HALF : Imf::FLOAT;
    Imf::FrameBuffer frame;
    for (size_t i = 0; i < channels.size(); i++)
        frame.insert(channels[i],
                     Imf::Slice::Make(type, image.bytes().data() + i * channel_size, window, info.block_size,
                                      static_cast<size_t>(image.width()) * info.block_size, 1, 1,
                                      // What the file lacks: no colour, but opaque.
                                      i == 3 ? 1.0 : 0.0));
    return frame;
}

}  // namespace

Expected<Image> decodeExr(std::span<const std::byte> bytes, uint64_t limit) {
    const Expected<ExrHeader> header = parseExrHeader(bytes, limit);
    if (!header) return unexpected(header.error());
    Expected<Image> image = Image::create(header->format, header->width, header->height, limit);
    if (!image) return image;
    try {
        Input input(bytes, header->bytes);
        if (header->is_tiled) {
            Imf::TiledInputFile file(input);
            file.setFrameBuffer(frameOf(*image, header->channels, file.header().dataWindow()));
            file.readTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
        } else {
            Imf::InputFile file(input);
            const Imath::Box2i window = file.header().dataWindow();
            file.setFrameBuffer(frameOf(*image, header->channels, window));
            file.readPixels(window.min.y, window.max.y);
        }
    } catch (const std::bad_alloc&) {
        return unexpected(makeError(ErrorCode::OutOfMemory, "image.out_of_memory", "OpenEXR has no memory to go on"));
    } catch (const std::exception& exception) { return unexpected(malformed(exception.what())); }
    return image;
}

Expected<std::vector<std::byte>> encodeExr(const Image& image) {
    if (image.isEmpty())
        return unexpected(makeError(ErrorCode::InvalidArgument, "image.size_zero", "an empty image cannot be an EXR"));
    std::vector<std::string> channels;
    switch (image.format()) {
        case FormatRf16:
        case FormatRf32: channels = {"Y"}; break;
        case FormatRGf16:
        case FormatRGf32: channels = {"R", "G"}; break;
        case FormatRGBf32: channels = {"R", "G", "B"}; break;
        case FormatRGBAf16:
        case FormatRGBAf32: channels = {"R", "G", "B", "A"}; break;
        default:
            return unexpected(makeError(ErrorCode::Unsupported, "image.exr_format",
                                        "EXR cannot hold {}: convert to a format of 16 or 32 float bits",
                                        toString(image.format())));
    }
    if (std::max(image.width(), image.height()) > ExrHeader::max_side)
        return unexpected(makeError(ErrorCode::OutOfRange, "image.too_large",
                                    "{}x{} texels: a side of an EXR ends at {}", image.width(), image.height(),
                                    ExrHeader::max_side));
    std::vector<std::byte> file;
    try {
        Imf::Header header(static_cast<int>(image.width()), static_cast<int>(image.height()));
        header.compression() = Imf::ZIP_COMPRESSION;
        // The library takes no pointer to what is not to be changed, and changes nothing when it writes.
        const Imf::FrameBuffer frame = frameOf(const_cast<Image&>(image), channels, header.dataWindow());
        for (auto slice = frame.begin(); slice != frame.end(); ++slice)
            header.channels().insert(slice.name(), Imf::Channel(slice.slice().type));
        Output output(file);
        Imf::OutputFile writer(output, header);
        writer.setFrameBuffer(frame);
        writer.writePixels(static_cast<int>(image.height()));
    } catch (const std::bad_alloc&) {
        return unexpected(makeError(ErrorCode::OutOfMemory, "image.out_of_memory", "OpenEXR has no memory to go on"));
    } catch (const std::exception& exception) {
        return unexpected(makeError(ErrorCode::Internal, "image.exr_write", "OpenEXR: {}", exception.what()));
    }
    return file;
}

}  // namespace glint
