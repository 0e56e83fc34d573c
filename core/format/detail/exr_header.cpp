#include "exr_header.h"

#include <glint/base/format_error.h>
#include <glint/base/status.h>

#include <zlib.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string_view>

namespace glint {

namespace {

// "OpenEXR File Layout": https://openexr.com/en/latest/OpenEXRFileLayout.html

constexpr uint32_t magic = 20000630;
constexpr uint32_t flag_tiled = 0x200;
constexpr uint32_t flag_deep = 0x800;
constexpr uint32_t flag_parts = 0x1000;

/// An attribute that the library has to understand.
struct Known {
    std::string_view name;
    std::string_view type;
    uint32_t size;  ///< 0 for any
};
constexpr std::array<Known, 9> known_attributes = {{{"channels", "chlist", 0},
                                                    {"compression", "compression", 1},
                                                    {"dataWindow", "box2i", 16},
                                                    {"displayWindow", "box2i", 16},
                                                    {"lineOrder", "lineOrder", 1},
                                                    {"pixelAspectRatio", "float", 4},
                                                    {"screenWindowCenter", "v2f", 8},
                                                    {"screenWindowWidth", "float", 4},
                                                    {"tiles", "tiledesc", 9}}};

/// Lines of a strip for each compression: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB.
constexpr std::array<uint32_t, 10> strip_lines = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};

enum class ChannelType : uint32_t { Uint, Half, Float };

template <class... Args>
Error malformed(size_t byte, fmt::format_string<Args...> format, Args&&... args) {
    return makeError(ErrorCode::Io, "image.exr_malformed", "no readable EXR file, at byte {}: {}", byte,
                     fmt::format(format, std::forward<Args>(args)...));
}

template <class... Args>
Error unsupported(fmt::format_string<Args...> format, Args&&... args) {
    return makeError(ErrorCode::Unsupported, "image.exr_unsupported", "the EXR file cannot be read: {}",
                     fmt::format(format, std::forward<Args>(args)...));
}

class HeaderParser {
public:
    HeaderParser(std::span<const std::byte> file, uint64_t limit) : file_(file), limit_(limit) {}

    Expected<ExrHeader> parse() {
        for (const auto step : {&HeaderParser::readVersion, &HeaderParser::readAttributes, &HeaderParser::judgeSize,
                                &HeaderParser::judgeChannels, &HeaderParser::judgeChunks, &HeaderParser::judgeMemory,
                                &HeaderParser::readChunks})
            if (Status status = (this->*step)(); !status) return unexpected(status.error());
        return std::move(header_);
    }

private:
    struct Channel {
        ChannelType type = ChannelType::Half;
        bool is_subsampled = false;
    };

    bool has(uint64_t size) const { return file_.size() - at_ >= size; }

    uint32_t u32(size_t at) const {
        uint32_t value = 0;
        for (size_t i = 0; i < 4; i++) value |= static_cast<uint32_t>(file_[at + i]) << 8 * i;
        return value;
    }

    /// A text that ends in a zero byte before `end`.
    std::optional<std::string_view> takeText(size_t end) {
        const std::string_view rest(reinterpret_cast<const char*>(file_.data()) + at_, end - at_);
        const size_t length = rest.find('\0');
        if (length > 255) return std::nullopt;  // npos too
        at_ += length + 1;
        return rest.substr(0, length);
    }

    Status readVersion() {
        if (!has(8) || u32(0) != magic) return malformed(0, "it does not begin with EXR's magic number");
        flags_ = u32(4);
        if ((flags_ & 0xff) != 2) return unsupported("its version is {}, and only 2 is known", flags_ & 0xff);
        if ((flags_ & flag_deep) != 0) return unsupported("it holds deep data");
        if ((flags_ & flag_parts) != 0) return unsupported("it consists of several parts");
        header_.is_tiled = (flags_ & flag_tiled) != 0;
        at_ = 8;
        return {};
    }

    Status readAttributes() {
        std::vector<size_t> unknown_types;
        while (true) {
            const size_t begin = at_;
            const std::optional<std::string_view> name = takeText(file_.size());
            if (!name) return malformed(begin, "a name of an attribute has no end, or more than 255 letters");
            if (name->empty()) break;
            const size_t type_at = at_;
            const std::optional<std::string_view> type = takeText(file_.size());
            if (!type || type->empty()) return malformed(type_at, "the type of attribute '{}' has no end", *name);
            if (!has(4)) return malformed(at_, "the file ends within attribute '{}'", *name);
            const uint32_t size = u32(at_);
            at_ += 4;
            if (!has(size))
                return malformed(at_, "attribute '{}' has {} bytes, and the file {} more", *name, size,
                                 file_.size() - at_);
            const auto* known = std::find_if(known_attributes.begin(), known_attributes.end(),
                                             [&](const Known& each) { return each.name == *name; });
            if (known == known_attributes.end()) {
                unknown_types.push_back(type_at);
            } else {
                if (*type != known->type || (known->size != 0 && size != known->size))
                    return malformed(begin, "attribute '{}' is a {} of {} bytes, not a {} of {}", *name, *type, size,
                                     known->type, known->size);
                if (!attributes_.emplace(*name, std::pair(at_, size)).second)
                    return malformed(begin, "attribute '{}' stands there twice", *name);
            }
            at_ += size;
        }
        header_.bytes.assign(file_.begin(), file_.begin() + static_cast<std::ptrdiff_t>(at_));
        for (const size_t place : unknown_types) header_.bytes[place] = std::byte('?');
        for (const char* name : {"channels", "compression", "dataWindow", header_.is_tiled ? "tiles" : "channels"})
            if (!attributes_.contains(name)) return malformed(at_, "there is no attribute '{}'", name);
        return {};
    }

    size_t placeOf(std::string_view name) const { return attributes_.find(name)->second.first; }

    Status judgeSize() {
        const size_t place = placeOf("dataWindow");
        std::array<int64_t, 4> window;  // least x and y, largest x and y
        for (size_t i = 0; i < 4; i++) window[i] = static_cast<int32_t>(u32(place + 4 * i));
        const int64_t width = window[2] - window[0] + 1;
        const int64_t height = window[3] - window[1] + 1;
        const bool is_near = std::all_of(window.begin(), window.end(),
                                         [](int64_t each) { return std::abs(each) <= ExrHeader::max_side; });
        if (width < 1 || height < 1 || !is_near || width > ExrHeader::max_side || height > ExrHeader::max_side)
            return malformed(place, "the data window goes from ({}, {}) to ({}, {})", window[0], window[1], window[2],
                             window[3]);
        header_.width = static_cast<uint32_t>(width);
        header_.height = static_cast<uint32_t>(height);
        return {};
    }

    Status readChannels() {
        const auto [begin, size] = attributes_.find("channels")->second;
        const size_t end = begin + size;
        at_ = begin;
        while (true) {
            const size_t place = at_;
            const std::optional<std::string_view> name = takeText(end);
            if (!name) return malformed(place, "the list of channels has no end");
            if (name->empty()) break;
            if (end - at_ < 16) return malformed(at_, "channel '{}' has no end", *name);
            const uint32_t type = u32(at_);
            if (type > 2) return malformed(at_, "channel '{}' has the type {}, 0 to 2 are known", *name, type);
            const bool is_subsampled = u32(at_ + 8) != 1 || u32(at_ + 12) != 1;
            // The library needs the order of the alphabet, to find them in the data.
            if (!channels_.empty() && channels_.rbegin()->first >= *name)
                return malformed(place, "channel '{}' stands behind '{}'", *name, channels_.rbegin()->first);
            channels_.emplace(*name, Channel{.type = static_cast<ChannelType>(type), .is_subsampled = is_subsampled});
            at_ += 16;
        }
        return at_ == end ? Status() : malformed(at_, "the list of channels ends {} bytes early", end - at_);
    }

    Status judgeChannels() {
        if (Status status = readChannels(); !status) return status;
        const auto has_channel = [&](const char* name) { return channels_.contains(name); };
        std::vector<std::string>& names = header_.channels;
        if (has_channel("R") || has_channel("G") || has_channel("B")) {
            if (has_channel("B") || has_channel("A"))
                names = {"R", "G", "B", "A"};
            else if (has_channel("G"))
                names = {"R", "G"};
            else
                names = {"R"};
        } else if (has_channel("RY") || has_channel("BY")) {
            return unsupported("it stores luminance and chroma");
        } else if (has_channel("Y")) {
            names = {"Y"};
            if (has_channel("A")) names.emplace_back("A");
        } else if (channels_.size() == 1) {
            names = {std::string(channels_.begin()->first)};
        } else {
            std::string all;
            for (const auto& [name, channel] : channels_) all.append(all.empty() ? "" : ", ").append(name);
            return unsupported("it has the channels '{}', and R, G, B, A or Y, A or a single one can be read",
                               all.substr(0, 200));
        }
        bool is_float = false;
        for (const std::string& name : names) {
            const auto found = channels_.find(name);
            if (found == channels_.end()) continue;
            if (found->second.type == ChannelType::Uint) return unsupported("channel '{}' holds integers", name);
            is_float |= found->second.type == ChannelType::Float;
        }
        for (const auto& [name, channel] : channels_)
            if (channel.is_subsampled) return unsupported("channel '{}' is subsampled", name);
        static constexpr Format formats[2][3] = {{FormatRf16, FormatRGf16, FormatRGBAf16},
                                                 {FormatRf32, FormatRGf32, FormatRGBAf32}};
        header_.format = formats[is_float ? 1 : 0][std::min<size_t>(names.size(), 3) - 1];
        return {};
    }

    Status judgeChunks() {
        for (const auto& [name, channel] : channels_) texel_size_ += channel.type == ChannelType::Half ? 2 : 4;
        const size_t compression_at = placeOf("compression");
        compression_ = static_cast<uint32_t>(file_[compression_at]);
        if (compression_ >= strip_lines.size())
            return malformed(compression_at, "compression {} is not known", compression_);
        chunk_width_ = header_.width;
        chunk_height_ = std::min(strip_lines[compression_], header_.height);
        if (header_.is_tiled) {
            const size_t place = placeOf("tiles");
            chunk_width_ = u32(place);
            chunk_height_ = u32(place + 4);
            if (chunk_width_ < 1 || chunk_height_ < 1 || std::max(chunk_width_, chunk_height_) > ExrHeader::max_side)
                return malformed(place, "tiles of {}x{} texels", chunk_width_, chunk_height_);
        }
        // Each has a place in the table of offsets, and a header.
        columns_ = (header_.width - 1) / chunk_width_ + 1;
        const uint64_t chunks = columns_ * ((header_.height - 1) / chunk_height_ + uint64_t{1});
        const uint64_t least = 8 + chunkHeaderSize();
        if (chunks > (file_.size() - header_.bytes.size()) / least)
            return malformed(file_.size(),
                             "the file ends too early: {}x{} texels lie in {} blocks, of {} bytes at least",
                             header_.width, header_.height, chunks, least);
        chunks_ = chunks;
        return {};
    }

    Status judgeMemory() {
        const uint64_t texels = static_cast<uint64_t>(header_.width) * header_.height;
        if (texels > limit_ / formatInfo(header_.format).block_size)
            return makeError(ErrorCode::OutOfRange, "image.too_large",
                             "{}x{} texels of {} take more than the limit of {} bytes", header_.width, header_.height,
                             toString(header_.format), limit_);
        constexpr uint64_t more = 16u << 20;
        const uint64_t chunk_texels = static_cast<uint64_t>(chunk_width_) * chunk_height_;
        if (chunk_texels > (limit_ + std::min(more, UINT64_MAX - limit_)) / texel_size_)
            return makeError(ErrorCode::OutOfRange, "image.too_large",
                             "a block of {}x{} texels, {} bytes each, takes more than {} bytes and the limit of {}",
                             chunk_width_, chunk_height_, texel_size_, more, limit_);
        return {};
    }

    size_t chunkHeaderSize() const { return header_.is_tiled ? 20 : 8; }

    /// Whether the chunks of the picture are there, and unpack to as many bytes as they have to: of short ones the
    /// library makes texels from whatever its memory held before. The other kinds of packing it checks itself.
    Status readChunks() {
        const size_t table = header_.bytes.size();
        for (uint64_t i = 0; i < chunks_; i++) {
            const size_t entry = table + 8 * i;
            const uint64_t offset = u32(entry) | static_cast<uint64_t>(u32(entry + 4)) << 32;
            if (offset < table || offset > file_.size() || file_.size() - offset < chunkHeaderSize())
                return malformed(entry, "block {} of {} lies at byte {}", i, chunks_, offset);
            const auto x = static_cast<uint32_t>(i % columns_);
            const auto y = static_cast<uint32_t>(i / columns_);
            const bool is_named = header_.is_tiled ? u32(offset) == x && u32(offset + 4) == y && u32(offset + 8) == 0 &&
                                                         u32(offset + 12) == 0
                                                   : u32(offset) == u32(placeOf("dataWindow") + 4) + y * chunk_height_;
            const uint64_t size = u32(offset + chunkHeaderSize() - 4);
            const uint64_t unpacked = texel_size_ * std::min(chunk_width_, header_.width - x * chunk_width_) *
                                      std::min(chunk_height_, header_.height - y * chunk_height_);
            const size_t begin = offset + chunkHeaderSize();
            if (!is_named || size == 0 || size > unpacked || size > file_.size() - begin)
                return malformed(offset, "block {} of {} has {} bytes for {}, or is another one", i, chunks_, size,
                                 unpacked);
            // What does not become smaller is stored as it is.
            if (size < unpacked && !unpacksTo(file_.subspan(begin, size), unpacked))
                return malformed(offset, "block {} of {} does not unpack to {} bytes", i, chunks_, unpacked);
        }
        return {};
    }

    bool unpacksTo(std::span<const std::byte> packed, uint64_t size) const {
        if (compression_ == 0) return false;
        if (compression_ == 1) return runLength(packed) == size;
        if (compression_ == 2 || compression_ == 3) return inflatedLength(packed, size) == size;
        return true;
    }

    static uint64_t runLength(std::span<const std::byte> packed) {
        uint64_t length = 0;
        for (size_t at = 0; at < packed.size();) {
            const auto code = static_cast<int8_t>(packed[at]);
            const size_t bytes = code < 0 ? 1 + static_cast<size_t>(-code) : 2;
            if (bytes > packed.size() - at) return 0;
            length += code < 0 ? static_cast<uint64_t>(-code) : static_cast<uint64_t>(code) + 1;
            at += bytes;
        }
        return length;
    }

    /// How much zlib makes of it, as far as `most` and a little more.
    static uint64_t inflatedLength(std::span<const std::byte> packed, uint64_t most) {
        z_stream stream = {};
        if (inflateInit(&stream) != Z_OK) return 0;
        std::array<Bytef, 16384> output;
        stream.next_in = reinterpret_cast<z_const Bytef*>(const_cast<std::byte*>(packed.data()));
        stream.avail_in = static_cast<uInt>(packed.size());
        int result = Z_OK;
        while (result == Z_OK && stream.total_out <= most) {
            stream.next_out = output.data();
            stream.avail_out = output.size();
            result = inflate(&stream, Z_NO_FLUSH);
        }
        const uint64_t length = result == Z_STREAM_END ? stream.total_out : 0;
        inflateEnd(&stream);
        return length;
    }

    std::span<const std::byte> file_;
    uint64_t limit_ = 0;
    size_t at_ = 0;
    uint32_t flags_ = 0;
    std::map<std::string_view, std::pair<size_t, uint32_t>> attributes_;  // known ones: place and size of the value
    std::map<std::string_view, Channel> channels_;
    uint64_t texel_size_ = 0;  // with all channels
    uint32_t compression_ = 0;
    uint32_t chunk_width_ = 0;
    uint32_t chunk_height_ = 0;
    uint64_t columns_ = 0;  // of chunks
    uint64_t chunks_ = 0;
    ExrHeader header_;
};

}  // namespace

Expected<ExrHeader> parseExrHeader(std::span<const std::byte> file, uint64_t limit) {
    return HeaderParser(file, limit).parse();
}

}  // namespace glint
