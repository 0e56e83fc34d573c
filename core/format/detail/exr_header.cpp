#include "exr_header.h"

#include <glint/base/format_error.h>
#include <glint/base/status.h>

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
    explicit HeaderParser(std::span<const std::byte> file) : file_(file) {}

    Expected<ExrHeader> parse() {
        for (const auto step : {&HeaderParser::readVersion, &HeaderParser::readAttributes, &HeaderParser::judgeSize,
                                &HeaderParser::judgeChannels, &HeaderParser::judgeChunks})
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
        uint64_t texel_size = 0;
        for (const auto& [name, channel] : channels_) texel_size += channel.type == ChannelType::Half ? 2 : 4;
        const size_t compression_at = placeOf("compression");
        const auto compression = static_cast<size_t>(file_[compression_at]);
        if (compression >= strip_lines.size())
            return malformed(compression_at, "compression {} is not known", compression);
        uint64_t width = header_.width;
        uint64_t height = std::min(strip_lines[compression], header_.height);
        if (header_.is_tiled) {
            const size_t place = placeOf("tiles");
            width = u32(place);
            height = u32(place + 4);
            if (width < 1 || height < 1 || width > ExrHeader::max_side || height > ExrHeader::max_side)
                return malformed(place, "tiles of {}x{} texels", width, height);
        }
        const uint64_t texels = width * height;
        header_.chunk_bytes = texels > ~0ull / texel_size ? ~0ull : texels * texel_size;
        // Each has a place in the table of offsets, and a header.
        const uint64_t chunks = ((header_.width + width - 1) / width) * ((header_.height + height - 1) / height);
        const uint64_t least = header_.is_tiled ? 28 : 16;
        const uint64_t rest = file_.size() - header_.bytes.size();
        if (chunks > rest / least)
            return malformed(file_.size(),
                             "the file ends too early: {}x{} texels lie in {} blocks, of {} bytes at least",
                             header_.width, header_.height, chunks, least);
        return {};
    }

    std::span<const std::byte> file_;
    size_t at_ = 0;
    uint32_t flags_ = 0;
    std::map<std::string_view, std::pair<size_t, uint32_t>> attributes_;  // known ones: place and size of the value
    std::map<std::string_view, Channel> channels_;
    ExrHeader header_;
};

}  // namespace

Expected<ExrHeader> parseExrHeader(std::span<const std::byte> file) { return HeaderParser(file).parse(); }

}  // namespace glint
