#include "support/files.h"
#include "support/matchers.h"
#include "support/reference.h"

#include <glint/base/file.h>
#include <glint/format/image.h>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <fmt/format.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

using namespace glint;
using namespace glint::test;

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

Image randomBits(Format format, uint32_t width, uint32_t height, uint64_t seed = 1) {
    Image image = Image::create(format, width, height).value();
    Random random(seed);
    for (std::byte& byte : image.bytes()) byte = static_cast<std::byte>(random.bits());
    return image;
}

std::vector<std::byte> bytesOf(std::string_view text) {
    const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
    return {bytes.begin(), bytes.end()};
}

std::string hdrOf(std::string_view size, std::string_view data, std::string_view lines = "FORMAT=32-bit_rle_rgbe\n") {
    return fmt::format("#?RADIANCE\n# comment\n{}\n{}\n{}", lines, size, data);
}

Vector4f roundTripHdr(const Vector4f& value, Format format = FormatRGBAf32) {
    Image image = Image::create(format, 1, 1).value();
    image.store(0, 0, value);
    return decodeHdr(encodeHdr(image).value()).value().load(0, 0);
}

}  // namespace

// The bound is that of encodeHdr: half a unit of the last place of the largest channel, which has 128 of them at least
// or is just below a power of two with 127.75.
TEST(Hdr, ErrorIsWithinItsBound) {
    Random random(1);
    double worst = 0.0;
    for (int run = 0; run < 60; run++) {
        const auto width = static_cast<uint32_t>(1 + random.below(40));
        Image image = Image::create(FormatRGBf32, width, 5).value();
        for (uint32_t y = 0; y < 5; y++)
            for (uint32_t x = 0; x < width; x++) {
                const double size = std::pow(10.0, random.uniform(-31, 38));
                const double most = random.below(4) ? random.uniform() : 1.0 - random.uniform(0.0, 0.01);
                image.store(x, y, Vector4f(Vector3d(random.uniform(), random.uniform(), most) * size, 1.0));
            }
        const Expected<Image> read = decodeHdr(encodeHdr(image).value());
        ASSERT_THAT(read, IsOk());
        ASSERT_EQ(read->format(), FormatRGBAf32);
        ASSERT_EQ(read->width(), width);
        for (uint32_t y = 0; y < 5; y++)
            for (uint32_t x = 0; x < width; x++) {
                const Vector4f wanted = image.load(x, y);
                const Vector4f found = read->load(x, y);
                const double most = std::max({wanted.x, wanted.y, wanted.z});
                for (int i = 0; i < 3; i++)
                    worst = std::max(worst, std::abs(static_cast<double>(found[i]) - wanted[i]) / most);
                EXPECT_EQ(found.w, 1.0f);
            }
    }
    EXPECT_LE(worst, 2.0 / 511.0);
    EXPECT_GT(worst, 0.95 / 256.0) << "the bound is reached, or the test sees nothing";
}

TEST(Hdr, WhatItCanHoldComesBackExactly) {
    Random random(2);
    for (int run = 0; run < 2000; run++) {
        Vector4f value(0, 0, 0, 1);
        const int exponent = static_cast<int>(random.below(200)) - 100;
        for (int i = 0; i < 3; i++) value[i] = std::ldexp(static_cast<float>(random.below(256)), exponent);
        value[static_cast<int>(random.below(3))] = std::ldexp(static_cast<float>(128 + random.below(128)), exponent);
        EXPECT_EQ(roundTripHdr(value), value);
    }
}

TEST(Hdr, ValuesItHasNoPlaceFor) {
    const float largest = 255.0f * 0x1p119f;
    const struct {
        Vector4f value;
        Vector3f read;
    } cases[] = {
        {{0, 0, 0, 0.5f}, {0, 0, 0}},
        {{-1, 2, -0.0f, 1}, {0, 2, 0}},
        {{-1, -infinity, -1e38f, 1}, {0, 0, 0}},
        {{not_a_number, 1, not_a_number, 1}, {0, 1, 0}},
        {{not_a_number, not_a_number, not_a_number, not_a_number}, {0, 0, 0}},
        {{infinity, 1e38f, 1, 1}, {largest, std::round(1e38f / 0x1p119f) * 0x1p119f, 0}},
        {{std::numeric_limits<float>::max(), infinity, not_a_number, 1}, {largest, largest, 0}},
        {{1.69e38f, 0, 0, 1}, {std::round(1.69e38f / 0x1p119f) * 0x1p119f, 0, 0}},
        {{1e-33f, 9e-33f, 1e-45f, 1}, {0, 0, 0}},
        {{1, 1e-3f, 0, 1}, {1, 0, 0}},
        {{0.999f, 0.5f, 0.0039f, 1}, {1, 0.5f, 0}},
    };
    for (const auto& each : cases) {
        const Vector4f read = roundTripHdr(each.value);
        EXPECT_EQ(Vector3f(read), each.read) << each.value.x << " " << each.value.y << " " << each.value.z;
        EXPECT_EQ(read.w, 1.0f);
    }
    EXPECT_EQ(roundTripHdr(Vector4f(0.75f, 9, 9, 9), FormatRf16), Vector4f(0.75f, 0.75f, 0.75f, 1));
    EXPECT_EQ(roundTripHdr(Vector4f(0.75f, 0.5f, 0.25f, 9), FormatRGBAf16), Vector4f(0.75f, 0.5f, 0.25f, 1));
}

TEST(Hdr, EveryWidth) {
    // Below 8 and from 32768 on scan lines are not packed. Long runs and none at all.
    for (const uint32_t width : {1u, 7u, 8u, 9u, 127u, 128u, 129u, 300u, 32767u, 32768u, 40000u})
        for (const uint64_t period : {1u, 2u, 3u, 1000u}) {
            Image image = Image::create(FormatRGBAf32, width, 3).value();
            for (uint32_t y = 0; y < 3; y++)
                for (uint32_t x = 0; x < width; x++)
                    image.store(x, y,
                                Vector4f(1.0f + static_cast<float>(x / 150 % 3), static_cast<float>(x % period % 7),
                                         static_cast<float>(y), 1));
            const Expected<Image> read = decodeHdr(encodeHdr(image).value());
            ASSERT_THAT(read, IsOk());
            EXPECT_EQ(*read, image) << width << " " << period;
        }
}

TEST(Hdr, ReadsWhatOthersWrite) {
    // Two rows that are not packed; exponents 129 (times 2^-7) and 136 (times 1); no exponent is black.
    const std::string flat("\x80\x40\x00\x81\x01\x02\x83\x88\x00\x00\x00\x00\xff\xff\xff\x80", 16);
    Expected<Image> image = decodeHdr(bytesOf(hdrOf("-Y 2 +X 2", flat)));
    ASSERT_THAT(image, IsOk());
    EXPECT_EQ(image->load(0, 0), Vector4f(1, 0.5f, 0, 1));
    EXPECT_EQ(image->load(1, 0), Vector4f(1, 2, 131, 1));
    EXPECT_EQ(image->load(0, 1), Vector4f(0, 0, 0, 1));
    EXPECT_EQ(image->load(1, 1), Vector4f(Vector3f(255.0f / 256.0f), 1));

    // A packed row of 8: red a run of 8, green 3 as they are and a run of 5, the others runs.
    const std::string packed("\2\2\0\x08\x88\x80\3\1\2\3\x85\7\x88\0\x88\x88", 16);
    std::string file = hdrOf("-Y 1 +X 8", packed, "FORMAT=32-bit_rle_rgbe\nEXPOSURE=2.0\nSOFTWARE=x y z\n");
    file.replace(0, 10, "#?RGBE");
    image = decodeHdr(bytesOf(file));
    ASSERT_THAT(image, IsOk());
    for (uint32_t x = 0; x < 8; x++) EXPECT_EQ(image->load(x, 0), Vector4f(128, x < 3 ? x + 1.0f : 7.0f, 0, 1)) << x;
    // A packed width, but not packed.
    std::string texels;
    for (int x = 0; x < 8; x++) texels += std::string("\x80\x40\x20\x88", 4);
    image = decodeHdr(bytesOf(hdrOf("-Y 1 +X 8", texels)));
    ASSERT_THAT(image, IsOk());
    for (uint32_t x = 0; x < 8; x++) EXPECT_EQ(image->load(x, 0), Vector4f(128, 64, 32, 1));
}

TEST(Hdr, EncodeErrors) {
    EXPECT_THAT(encodeHdr(Image()), HasErrorId("image.size_zero"));
    for (const Format format : {FormatRGBAu8n, FormatRGf32, FormatRGf16, FormatRu32, FormatDf32})
        EXPECT_THAT(encodeHdr(Image::create(format, 1, 1).value()), HasErrorId("image.hdr_format"));
}

TEST(Exr, EveryBitComesBack) {
    for (const Format format :
         {FormatRf16, FormatRGf16, FormatRGBAf16, FormatRf32, FormatRGf32, FormatRGBf32, FormatRGBAf32})
        for (const auto& [width, height] : {std::pair(1u, 1u), {7u, 5u}, {64u, 33u}, {1u, 300u}, {500u, 2u}}) {
            // Random bits: infinities, NaN of every kind and subnormals are among them.
            const Image image = randomBits(format, width, height, width);
            const Expected<std::vector<std::byte>> bytes = encodeExr(image);
            ASSERT_THAT(bytes, IsOk());
            const Expected<Image> read = decodeExr(*bytes);
            ASSERT_THAT(read, IsOk());
            if (format != FormatRGBf32) {
                EXPECT_EQ(*read, image) << toString(format);
                continue;
            }
            ASSERT_EQ(read->format(), FormatRGBAf32);
            for (uint32_t i = 0; i < width * height; i++) {
                EXPECT_EQ(
                    std::memcmp(read->texel(i % width, i / width).data(), image.texel(i % width, i / width).data(), 12),
                    0);
                EXPECT_EQ(read->load(i % width, i / width).w, 1.0f);
            }
        }
}

TEST(Exr, ValuesOfEveryKind) {
    const float values[] = {-1.5f, -0.0f, 65504.0f, 1e38f, -1e38f, infinity, -infinity, not_a_number, 1e-45f};
    for (const Format format : {FormatRf32, FormatRf16}) {
        Image image = Image::create(format, std::size(values), 1).value();
        for (uint32_t i = 0; i < std::size(values); i++) image.store(i, 0, Vector4f(values[i]));
        const Image read = decodeExr(encodeExr(image).value()).value();
        EXPECT_EQ(read, image);
        EXPECT_EQ(read.load(5, 0).x, infinity);
        EXPECT_TRUE(std::isnan(read.load(7, 0).x));
        // What is too large for float16 has become infinity when it was stored.
        EXPECT_EQ(read.load(3, 0).x, format == FormatRf16 ? infinity : 1e38f);
    }
}

namespace {

class ExrOutput : public Imf::OStream {
public:
    ExrOutput() : OStream("test") {}
    void write(const char data[], int count) override {
        bytes.resize(std::max(bytes.size(), at_ + static_cast<size_t>(count)));
        std::memcpy(bytes.data() + at_, data, static_cast<size_t>(count));
        at_ += static_cast<size_t>(count);
    }
    uint64_t tellp() override { return at_; }
    void seekp(uint64_t position) override { at_ = position; }
    std::vector<std::byte> bytes;

private:
    size_t at_ = 0;
};

class ExrInput : public Imf::IStream {
public:
    explicit ExrInput(const std::vector<std::byte>& bytes) : IStream("test"), bytes_(bytes) {}
    bool read(char data[], int count) override {
        if (static_cast<size_t>(count) > bytes_.size() - at_) throw std::runtime_error("end");
        std::memcpy(data, bytes_.data() + at_, static_cast<size_t>(count));
        at_ += static_cast<size_t>(count);
        return at_ < bytes_.size();
    }
    uint64_t tellg() override { return at_; }
    void seekg(uint64_t position) override { at_ = position; }

private:
    const std::vector<std::byte>& bytes_;
    size_t at_ = 0;
};

struct ExrFile {
    Imf::Compression compression = Imf::ZIP_COMPRESSION;
    std::vector<std::pair<std::string, Imf::PixelType>> channels = {
        {"R", Imf::HALF}, {"G", Imf::HALF}, {"B", Imf::HALF}};
    Imath::Box2i window = {{0, 0}, {20, 12}};
    int tile = 0;  ///< side of a tile; 0: scan lines
    Imf::LevelMode levels = Imf::ONE_LEVEL;
    Imf::LineOrder order = Imf::INCREASING_Y;
};

/// The value of a channel at a place, the same for every type.
float valueAt(size_t channel, int x, int y) {
    return static_cast<float>(channel * 100) + static_cast<float>(x) * 0.5f - static_cast<float>(y);
}

std::vector<std::byte> write(const ExrFile& file) {
    const int width = file.window.max.x - file.window.min.x + 1;
    const int height = file.window.max.y - file.window.min.y + 1;
    Imf::Header header({{0, 0}, {99, 99}}, file.window);
    header.compression() = file.compression;
    header.lineOrder() = file.order;
    header.insert("comments", Imf::StringAttribute("a picture"));
    std::vector<std::vector<float>> floats;
    std::vector<std::vector<Imath::half>> halves;
    std::vector<std::vector<uint32_t>> uints;
    Imf::FrameBuffer frame;
    for (size_t i = 0; i < file.channels.size(); i++) {
        const auto& [name, type] = file.channels[i];
        header.channels().insert(name, Imf::Channel(type));
        floats.emplace_back();
        for (int y = file.window.min.y; y <= file.window.max.y; y++)
            for (int x = file.window.min.x; x <= file.window.max.x; x++) floats[i].push_back(valueAt(i, x, y));
        halves.emplace_back(floats[i].begin(), floats[i].end());
        uints.emplace_back(floats[i].size(), 7u);
    }
    for (size_t i = 0; i < file.channels.size(); i++) {
        const auto& [name, type] = file.channels[i];
        const void* data = type == Imf::HALF    ? static_cast<const void*>(halves[i].data())
                           : type == Imf::FLOAT ? static_cast<const void*>(floats[i].data())
                                                : uints[i].data();
        const size_t size = type == Imf::HALF ? 2 : 4;
        frame.insert(name, Imf::Slice::Make(type, data, file.window, size, size * static_cast<size_t>(width)));
    }
    ExrOutput output;
    if (file.tile == 0) {
        Imf::OutputFile writer(output, header);
        writer.setFrameBuffer(frame);
        writer.writePixels(height);
    } else {
        const auto side = static_cast<unsigned>(file.tile);
        header.setTileDescription(Imf::TileDescription(side, side, file.levels));
        Imf::TiledOutputFile writer(output, header);
        writer.setFrameBuffer(frame);
        // Smaller levels get the first one's texels: nobody reads them.
        for (int ly = 0; ly < writer.numYLevels(); ly++)
            for (int lx = 0; lx < writer.numXLevels(); lx++)
                if (writer.isValidLevel(lx, ly))
                    writer.writeTiles(0, writer.numXTiles(lx) - 1, 0, writer.numYTiles(ly) - 1, lx, ly);
    }
    return output.bytes;
}

/// The halves that OpenEXR's general reader finds in a file.
std::vector<Imath::half> readByLibrary(const std::vector<std::byte>& bytes, const char* channel) {
    ExrInput input(bytes);
    Imf::InputFile file(input);
    const Imath::Box2i window = file.header().dataWindow();
    const auto width = static_cast<size_t>(window.max.x - window.min.x + 1);
    std::vector<Imath::half> values(width * static_cast<size_t>(window.max.y - window.min.y + 1));
    Imf::FrameBuffer frame;
    frame.insert(channel, Imf::Slice::Make(Imf::HALF, values.data(), window, 2, 2 * width));
    file.setFrameBuffer(frame);
    file.readPixels(window.min.y, window.max.y);
    return values;
}

}  // namespace

TEST(Exr, EveryCompressionTilingAndOrder) {
    constexpr auto first = static_cast<int>(Imf::NO_COMPRESSION);
    constexpr auto last = static_cast<int>(Imf::DWAB_COMPRESSION);
    for (int compression = first; compression <= last; compression++)
        for (const auto& [tile, levels] :
             {std::pair(0, Imf::ONE_LEVEL), {8, Imf::ONE_LEVEL}, {64, Imf::MIPMAP_LEVELS}, {5, Imf::RIPMAP_LEVELS}})
            for (const Imf::LineOrder order : {Imf::INCREASING_Y, Imf::DECREASING_Y}) {
                ExrFile file;
                file.compression = static_cast<Imf::Compression>(compression);
                file.window = {{-3, -40}, {40, 7}};
                file.tile = tile;
                file.levels = levels;
                file.order = order;
                const std::vector<std::byte> bytes = write(file);
                const Expected<Image> image = decodeExr(bytes);
                ASSERT_THAT(image, IsOk()) << compression << " " << tile;
                ASSERT_EQ(image->format(), FormatRGBAf16);
                ASSERT_EQ(image->width(), 44u);
                ASSERT_EQ(image->height(), 48u);
                const char* names[] = {"R", "G", "B"};
                for (size_t channel = 0; channel < 3; channel++) {
                    // Some compressions lose something, but all readers the same.
                    const std::vector<Imath::half> wanted = readByLibrary(bytes, names[channel]);
                    for (uint32_t i = 0; i < 44 * 48; i++) {
                        const Vector4f value = image->load(i % 44, i / 44);
                        ASSERT_EQ(value[static_cast<int>(channel)], static_cast<float>(wanted[i]));
                        ASSERT_EQ(value.w, 1.0f);
                        const float written =
                            valueAt(channel, static_cast<int>(i % 44) - 3, static_cast<int>(i / 44) - 40);
                        // Coarse: that it is the right texel of the right channel.
                        ASSERT_NEAR(value[static_cast<int>(channel)], written, 8.0f) << compression;
                    }
                }
            }
}

TEST(Exr, ChannelsMakeFormats) {
    using enum Imf::PixelType;
    const struct {
        std::vector<std::pair<std::string, Imf::PixelType>> channels;
        Format format;
        std::vector<int> order;  ///< which of them is red, green, ...; -1: absent
    } cases[] = {
        {{{"Y", HALF}}, FormatRf16, {0}},
        {{{"Y", FLOAT}}, FormatRf32, {0}},
        {{{"Z", FLOAT}}, FormatRf32, {0}},
        {{{"depth.distance", HALF}}, FormatRf16, {0}},
        {{{"R", HALF}}, FormatRf16, {0}},
        {{{"R", HALF}, {"layer.R", FLOAT}, {"Z", FLOAT}}, FormatRf16, {0}},
        {{{"G", FLOAT}, {"R", HALF}}, FormatRGf32, {1, 0}},
        {{{"Y", HALF}, {"A", HALF}}, FormatRGf16, {0, 1}},
        {{{"B", HALF}, {"G", HALF}, {"R", HALF}}, FormatRGBAf16, {2, 1, 0, -1}},
        {{{"A", HALF}, {"B", HALF}, {"G", HALF}, {"R", HALF}}, FormatRGBAf16, {3, 2, 1, 0}},
        {{{"A", FLOAT}, {"B", HALF}, {"G", HALF}, {"R", HALF}, {"id", UINT}}, FormatRGBAf32, {3, 2, 1, 0}},
        {{{"A", HALF}, {"R", HALF}}, FormatRGBAf16, {1, -1, -1, 0}},
        {{{"B", HALF}}, FormatRGBAf16, {-1, -1, 0, -1}},
    };
    for (const auto& each : cases)
        for (const int tile : {0, 16}) {
            ExrFile file;
            file.channels = each.channels;
            file.tile = tile;
            const Expected<Image> image = decodeExr(write(file));
            ASSERT_THAT(image, IsOk()) << each.channels[0].first;
            ASSERT_EQ(image->format(), each.format);
            for (int y = 0; y <= 12; y++)
                for (int x = 0; x <= 20; x++)
                    for (size_t i = 0; i < each.order.size(); i++)
                        ASSERT_EQ(image->load(static_cast<uint32_t>(x), static_cast<uint32_t>(y))[static_cast<int>(i)],
                                  each.order[i] < 0 ? (i == 3 ? 1.0f : 0.0f)
                                                    : valueAt(static_cast<size_t>(each.order[i]), x, y));
        }
    for (const auto& channels : std::vector<std::vector<std::pair<std::string, Imf::PixelType>>>{
             {{"R", UINT}, {"G", HALF}}, {{"Y", UINT}}, {{"a", HALF}, {"b", HALF}}, {{"Y", HALF}, {"RY", HALF}}}) {
        ExrFile file;
        file.channels = channels;
        EXPECT_THAT(decodeExr(write(file)), HasErrorId("image.exr_unsupported")) << channels[0].first;
    }
}

TEST(Exr, EncodeErrors) {
    EXPECT_THAT(encodeExr(Image()), HasErrorId("image.size_zero"));
    for (const Format format : {FormatRGBAu8n, FormatRu32, FormatDf32})
        EXPECT_THAT(encodeExr(Image::create(format, 1, 1).value()), HasErrorId("image.exr_format"));
}

TEST(FloatImages, Limits) {
    const Image image = randomBits(FormatRGBAf32, 20, 20);
    const std::vector<std::byte> exr = encodeExr(image).value();
    const std::vector<std::byte> hdr = encodeHdr(image).value();
    EXPECT_THAT(decodeExr(exr, 6400), IsOk());
    EXPECT_THAT(decodeExr(exr, 6399), HasErrorId("image.too_large"));
    EXPECT_THAT(decodeHdr(hdr, 6400), IsOk());
    EXPECT_THAT(decodeHdr(hdr, 6399), HasErrorId("image.too_large"));
}

TEST(FloatImages, Files) {
    const TempDir dir;
    const Image image = randomBits(FormatRGBAf16, 5, 4);
    ASSERT_THAT(image.save(dir / "a.EXR"), IsOk());
    EXPECT_EQ(Image::load(dir / "a.EXR").value(), image);
    ASSERT_THAT(image.save(dir / "a.hdr"), IsOk());
    EXPECT_EQ(Image::load(dir / "a.hdr")->format(), FormatRGBAf32);
    for (const char* name : {"b.hdr", "b.exr"}) {
        EXPECT_THAT(Image::load(dir / name), HasErrorId("file.open"));
        ASSERT_THAT(writeTextFile(dir / name, "no picture"), IsOk());
        const Expected<Image> malformed = Image::load(dir / name);
        EXPECT_THAT(malformed, HasErrorId(name[2] == 'h' ? "image.hdr_malformed" : "image.exr_malformed"));
        EXPECT_EQ(malformed.error().file(), name);
    }
}
