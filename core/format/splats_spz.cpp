#include <glint/format/detail/splat_blocks.h>

#include <glint/base/format_error.h>

#include <glm/gtc/packing.hpp>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace glint {

namespace {

static_assert(std::endian::native == std::endian::little, "values are copied as they are");

struct Header {
    std::array<char, 4> magic = {'N', 'G', 'S', 'P'};
    uint32_t version = 3;
    uint32_t count = 0;
    uint8_t degree = 0;
    uint8_t fraction_bits = 12;  // of positions
    uint8_t flags = 0;
    uint8_t reserved = 0;
};
static_assert(sizeof(Header) == 16);

constexpr uint8_t flag_antialiased = 1;
constexpr uint32_t max_degree = 4;  // in the file; coefficients above Splats::max_degree are passed over
constexpr int32_t max_fixed = (1 << 23) - 1;
constexpr float color_scale = 0.15f;

// The file's axes are right, up, back; those of the paper's program, and so of Splats, are right, down, front: half a
// turn about x lies between them. A harmonic is even or odd under it.
constexpr std::array<float, 16> turned = {1, -1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1};

/// Where each array begins, in bytes.
struct Layout {
    explicit Layout(const Header& header) {
        position_size = header.version == 1 ? 6 : 9;
        rotation_size = header.version < 3 ? 3 : 4;
        harmonics_size = size_t{3} * ((header.degree + 1) * (header.degree + 1) - 1);
        const uint64_t n = header.count;
        opacities = sizeof(Header) + n * position_size;
        colors = opacities + n;
        scales = colors + 3 * n;
        rotations = scales + 3 * n;
        harmonics = rotations + n * rotation_size;
        size = harmonics + n * harmonics_size;
    }

    size_t position_size, rotation_size, harmonics_size;  // of a splat
    uint64_t positions = sizeof(Header);
    uint64_t opacities, colors, scales, rotations, harmonics, size;
};

template <class... Args>
Error failure(ErrorCode code, const char* id, const std::string& name, fmt::format_string<Args...> format,
              Args&&... args) {
    return Error::inFile(code, id, fmt::format(format, std::forward<Args>(args)...), name, 0);
}

/// Unpacks a gzip file.
class Unpacker {
public:
    Unpacker(std::span<const std::byte> file, const std::string& name) : name_(name), rest_(file) {
        is_ready_ = ::inflateInit2(&stream_, 16 + MAX_WBITS) == Z_OK;
    }
    ~Unpacker() {
        if (is_ready_) ::inflateEnd(&stream_);
    }
    Unpacker(const Unpacker&) = delete;
    Unpacker& operator=(const Unpacker&) = delete;

    /// Fills `to`, or says why it cannot be filled.
    Status read(std::span<std::byte> to) {
        while (!to.empty()) {
            const Expected<size_t> count = next(to);
            if (!count) return count.error();
            if (*count == 0)
                return failure(ErrorCode::Io, "splats.truncated", name_,
                               "the unpacked file ends at byte {}, {} before its last splat does", done_, to.size());
            to = to.subspan(*count);
        }
        return {};
    }

    /// Goes to the end, where the checksum is.
    Status finish() {
        std::array<std::byte, 4096> nothing;
        while (true) {
            const Expected<size_t> count = next(nothing);
            if (!count) return count.error();
            if (*count == 0) return {};
        }
    }

private:
    /// Bytes that were unpacked; 0 at the end.
    Expected<size_t> next(std::span<std::byte> to) {
        constexpr size_t most = 1u << 30;  // zlib counts in 32 bits
        if (!is_ready_) return unexpected(makeError(ErrorCode::OutOfMemory, "splats.spz_data", "no memory for zlib"));
        stream_.next_out = reinterpret_cast<Bytef*>(to.data());
        const size_t room = std::min(to.size(), most);
        stream_.avail_out = static_cast<uInt>(room);
        while (!is_done_ && stream_.avail_out == room) {
            const size_t part = std::min(rest_.size(), most);
            stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(rest_.data()));
            stream_.avail_in = static_cast<uInt>(part);
            const int result = ::inflate(&stream_, Z_NO_FLUSH);
            rest_ = rest_.subspan(part - stream_.avail_in);
            is_done_ = result == Z_STREAM_END;
            if (result == Z_BUF_ERROR && rest_.empty())
                return unexpected(failure(ErrorCode::Io, "splats.truncated", name_,
                                          "the packed file ends early, after {} unpacked bytes", done_));
            if (result != Z_OK && result != Z_STREAM_END)
                return unexpected(failure(ErrorCode::Io, "splats.spz_data", name_,
                                          "the packed data are damaged after {} unpacked bytes: {}", done_,
                                          stream_.msg ? stream_.msg : "zlib says no more"));
        }
        const size_t count = room - stream_.avail_out;
        done_ += count;
        return count;
    }

    const std::string& name_;
    std::span<const std::byte> rest_;
    z_stream stream_ = {};
    bool is_ready_ = false;
    bool is_done_ = false;
    uint64_t done_ = 0;
};

Status checkHeader(const Header& header, const std::string& name) {
    if (header.magic != Header().magic)
        return failure(ErrorCode::Io, "splats.spz_header", name, "no .spz file: unpacked, it does not begin with NGSP");
    if (header.version < 1 || header.version > 3)
        return failure(ErrorCode::Unsupported, "splats.spz_version", name,
                       "the file has version {}; 1, 2 and 3 are known", header.version);
    if (header.degree > max_degree)
        return failure(ErrorCode::Io, "splats.spz_header", name, "harmonics of degree {}; a file has 0 to {}",
                       header.degree, max_degree);
    if (header.fraction_bits > 23)
        return failure(ErrorCode::Io, "splats.spz_header", name, "positions of 24 bits have {} behind the point",
                       header.fraction_bits);
    return {};
}

Vector3f decodePosition(const std::byte* bytes, const Header& header) {
    Vector3f position;
    for (int axis = 0; axis < 3; axis++) {
        if (header.version == 1) {
            uint16_t half = 0;
            std::memcpy(&half, bytes + 2 * axis, 2);
            position[axis] = glm::unpackHalf1x16(half);
        } else {
            uint32_t fixed = 0;
            std::memcpy(&fixed, bytes + 3 * axis, 3);
            // The sign comes into place by shifting to the left and back.
            position[axis] =
                std::ldexp(static_cast<float>(static_cast<int32_t>(fixed << 8) >> 8), -int{header.fraction_bits});
        }
    }
    return position;
}

Vector4f decodeRotation(const std::byte* bytes, const Header& header) {
    Vector4f q(0.0f);
    float squares = 0.0f;
    int derived = 3;
    if (header.version < 3) {
        for (int k = 0; k < 3; k++) q[k] = static_cast<float>(bytes[k]) / 127.5f - 1.0f;
    } else {
        // From the highest bits: the index of the largest component, then a sign and 9 bits for each of the others.
        uint32_t bits = 0;
        std::memcpy(&bits, bytes, 4);
        derived = static_cast<int>(bits >> 30);
        for (int k = 3; k >= 0; k--) {
            if (k == derived) continue;
            const float size = static_cast<float>(bits & 511) * (std::sqrt(0.5f) / 511.0f);
            q[k] = (bits & 512) ? -size : size;
            bits >>= 10;
        }
    }
    for (int k = 0; k < 4; k++) squares += q[k] * q[k];
    q[derived] = std::sqrt(std::max(0.0f, 1.0f - squares));
    return q;
}

/// The other way round; the quaternion is of unit length.
uint32_t encodeRotation(const Vector4f& q) {
    int largest = 0;
    for (int k = 1; k < 4; k++)
        if (std::abs(q[k]) > std::abs(q[largest])) largest = k;
    auto bits = static_cast<uint32_t>(largest);
    for (int k = 0; k < 4; k++) {
        if (k == largest) continue;
        const auto size =
            static_cast<uint32_t>(std::min(std::round(std::abs(q[k]) * (511.0f / std::sqrt(0.5f))), 511.0f));
        const bool is_negative = (q[k] < 0.0f) != (q[largest] < 0.0f);
        bits = bits << 10 | (is_negative ? 512u : 0u) | size;
    }
    return bits;
}

void decode(const std::vector<std::byte>& file, const Header& header, const Layout& layout, uint64_t first,
            uint32_t count, detail::SplatBlock& block) {
    const uint32_t degree = std::min<uint32_t>(header.degree, Splats::max_degree);
    const uint32_t coefficients = (degree + 1) * (degree + 1);
    const auto value = [&file](uint64_t at) { return static_cast<float>(file[at]); };
    for (uint32_t i = 0; i < count; i++) {
        const uint64_t k = first + i;
        detail::FileSplat& splat = block.splats[i];
        const Vector3f p = decodePosition(&file[layout.positions + k * layout.position_size], header);
        const Vector4f q = decodeRotation(&file[layout.rotations + k * layout.rotation_size], header);
        splat.position = {p.x, -p.y, -p.z};
        splat.quaternion = {q.x, -q.y, -q.z, q.w};
        splat.opacity = value(layout.opacities + k) / 255.0f;
        Vector3f* harmonics = &block.harmonics[size_t{i} * coefficients];
        for (int axis = 0; axis < 3; axis++) {
            splat.scale[axis] = std::exp(value(layout.scales + 3 * k + axis) / 16.0f - 10.0f);
            harmonics[0][axis] = (value(layout.colors + 3 * k + axis) / 255.0f - 0.5f) / color_scale;
            const uint64_t rest = layout.harmonics + k * layout.harmonics_size + axis;
            for (uint32_t c = 1; c < coefficients; c++)
                harmonics[c][axis] = (value(rest + 3 * (c - 1)) - 128.0f) / 128.0f * turned[c];
        }
    }
}

Expected<std::vector<std::byte>> pack(const std::vector<std::byte>& bytes) {
    z_stream stream = {};
    const auto fail = [] {
        return unexpected(makeError(ErrorCode::OutOfMemory, "splats.spz_data", "zlib cannot pack: no memory"));
    };
    if (::deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, 16 + MAX_WBITS, 9, Z_DEFAULT_STRATEGY) != Z_OK)
        return fail();
    std::vector<std::byte> packed;
    std::vector<std::byte> piece(1u << 16);
    constexpr size_t most = 1u << 30;
    size_t done = 0;
    int result = Z_OK;
    while (result != Z_STREAM_END) {
        const size_t part = std::min(bytes.size() - done, most);
        stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data() + done));
        stream.avail_in = static_cast<uInt>(part);
        stream.next_out = reinterpret_cast<Bytef*>(piece.data());
        stream.avail_out = static_cast<uInt>(piece.size());
        result = ::deflate(&stream, done + part == bytes.size() ? Z_FINISH : Z_NO_FLUSH);
        if (result != Z_OK && result != Z_STREAM_END) break;
        done += part - stream.avail_in;
        packed.insert(packed.end(), piece.begin(), piece.end() - static_cast<std::ptrdiff_t>(stream.avail_out));
    }
    ::deflateEnd(&stream);
    if (result != Z_STREAM_END) return fail();
    return packed;
}

std::byte toByte(float value) { return static_cast<std::byte>(std::clamp(std::round(value), 0.0f, 255.0f)); }

/// As many bits behind the point as the farthest position leaves, 12 at most: those are 0.24 mm where units are metres.
Expected<uint8_t> findFractionBits(const Splats& splats) {
    float farthest = 0.0f;
    for (const Vector3f& p : splats.positions)
        farthest = std::max({farthest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    for (int bits = 12; bits >= 0; bits--)
        if (std::ldexp(farthest, bits) <= static_cast<float>(max_fixed)) return static_cast<uint8_t>(bits);
    return unexpected(makeError(ErrorCode::OutOfRange, "splats.range",
                                "a position is {} from the origin; .spz files end at {}", farthest, max_fixed));
}

}  // namespace

Expected<Splats> parseSpz(std::span<const std::byte> file, const std::string& name, uint64_t limit,
                          SplatReport* report) {
    const auto begins = [&file](std::string_view text) {
        return file.size() >= text.size() && std::memcmp(file.data(), text.data(), text.size()) == 0;
    };
    if (begins("NGSP"))
        return unexpected(failure(ErrorCode::Unsupported, "splats.spz_version", name,
                                  "the file is of version 4 or later, which packs with zstd; 1, 2 and 3 are known"));
    if (!begins("\x1f\x8b"))
        return unexpected(failure(ErrorCode::Io, "splats.spz_header", name, "no .spz file: it is not packed by gzip"));
    Unpacker unpacker(file, name);
    Header header;
    if (Status status = unpacker.read(std::as_writable_bytes(std::span(&header, 1))); !status)
        return unexpected(status.error());
    if (Status status = checkHeader(header, name); !status) return unexpected(status.error());
    const Layout layout(header);
    detail::SplatSource source{
        .name = name, .count = header.count, .degree = std::min<uint32_t>(header.degree, Splats::max_degree)};
    if (Status status = detail::checkSplatBytes(source, limit); !status) return unexpected(status.error());
    // Deflate packs 1032 bytes into one at best, so nobody is led to make room for more than the file can hold.
    if (layout.size / 1032 > file.size())
        return unexpected(failure(ErrorCode::Io, "splats.truncated", name,
                                  "{} splats take {} bytes, and {} packed bytes cannot hold that", header.count,
                                  layout.size, file.size()));
    std::vector<std::byte> bytes(layout.size);
    std::memcpy(bytes.data(), &header, sizeof header);
    if (Status status = unpacker.read(std::span(bytes).subspan(sizeof header)); !status)
        return unexpected(status.error());
    // Extensions may follow.
    if (Status status = unpacker.finish(); !status) return unexpected(status.error());

    source.read = [&](uint64_t first, uint32_t count, detail::SplatBlock& block) -> Status {
        decode(bytes, header, layout, first, count, block);
        return {};
    };
    Expected<Splats> splats = detail::readSplats(source, limit, report);
    if (splats) splats->is_antialiased = (header.flags & flag_antialiased) != 0;
    return splats;
}

Expected<std::vector<std::byte>> encodeSpz(const Splats& splats) {
    if (Status status = splats.validate(); !status) return unexpected(status.error());
    if (splats.size() > UINT32_MAX)
        return unexpected(makeError(ErrorCode::OutOfRange, "splats.range", "{} splats; .spz files end at {}",
                                    splats.size(), UINT32_MAX));
    const Expected<uint8_t> fraction_bits = findFractionBits(splats);
    if (!fraction_bits) return unexpected(fraction_bits.error());
    const Header header{.count = static_cast<uint32_t>(splats.size()),
                        .degree = static_cast<uint8_t>(splats.degree),
                        .fraction_bits = *fraction_bits,
                        .flags = splats.is_antialiased ? flag_antialiased : uint8_t{0}};
    const Layout layout(header);
    const uint32_t coefficients = splats.coefficientCount();
    std::vector<std::byte> bytes(layout.size);
    std::memcpy(bytes.data(), &header, sizeof header);
    for (size_t i = 0; i < splats.size(); i++) {
        const Vector3f p = {splats.positions[i].x, -splats.positions[i].y, -splats.positions[i].z};
        const Vector4f& q = splats.rotations[i];
        const uint32_t rotation = encodeRotation({q.x, -q.y, -q.z, q.w});
        std::memcpy(&bytes[layout.rotations + i * sizeof rotation], &rotation, sizeof rotation);
        bytes[layout.opacities + i] = toByte(splats.opacities[i] * 255.0f);
        const Vector3f* harmonics = &splats.harmonics[i * coefficients];
        for (int axis = 0; axis < 3; axis++) {
            const auto fixed = static_cast<int32_t>(std::round(std::ldexp(p[axis], *fraction_bits)));
            std::memcpy(&bytes[layout.positions + i * layout.position_size + 3 * axis], &fixed, 3);
            bytes[layout.scales + 3 * i + axis] = toByte((std::log(splats.scales[i][axis]) + 10.0f) * 16.0f);
            bytes[layout.colors + 3 * i + axis] = toByte((harmonics[0][axis] * color_scale + 0.5f) * 255.0f);
            const uint64_t rest = layout.harmonics + i * layout.harmonics_size + axis;
            for (uint32_t c = 1; c < coefficients; c++)
                bytes[rest + 3 * (c - 1)] = toByte(harmonics[c][axis] * turned[c] * 128.0f + 128.0f);
        }
    }
    return pack(bytes);
}

}  // namespace glint
