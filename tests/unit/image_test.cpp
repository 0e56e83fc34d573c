#include "support/allocations.h"
#include "support/files.h"
#include "support/image_compare.h"
#include "support/matchers.h"
#include "support/png_chunks.h"
#include "support/reference.h"

#include <glint/base/file.h>
#include <glint/format/image.h>

#include <gtest/gtest.h>

#include <cstring>

using namespace glint;
using namespace glint::test;

namespace {

constexpr Format png_formats[] = {FormatRu8n,     FormatRGu8n, FormatRGBAu8n, FormatRGBAu8ns, FormatBGRAu8n,
                                  FormatBGRAu8ns, FormatRu16n, FormatRGu16n,  FormatRGBAu16n};

Image randomImage(Format format, uint32_t width, uint32_t height, uint64_t seed = 1) {
    Image image = Image::create(format, width, height).value();
    Random random(seed);
    for (std::byte& byte : image.bytes()) byte = static_cast<std::byte>(random.bits());
    return image;
}

std::vector<std::byte> bytesOf(std::initializer_list<int> values) {
    std::vector<std::byte> bytes;
    for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
    return bytes;
}

// What a PNG file is made of; `rows` are not compressed, each row begins with its filter.
struct RawPng {
    uint32_t width = 0;
    uint32_t height = 0;
    int depth = 8;
    int color = 0;
    bool is_interlaced = false;
    std::vector<std::byte> palette;
    std::vector<std::byte> transparency;
    std::vector<std::byte> rows;
};

void append(std::vector<std::byte>& bytes, uint64_t value, int size) {
    for (int shift = 8 * (size - 1); shift >= 0; shift -= 8) bytes.push_back(static_cast<std::byte>(value >> shift));
}

void appendChunk(std::vector<std::byte>& png, const char* name, const std::vector<std::byte>& data) {
    append(png, data.size(), 4);
    for (size_t k = 0; k < 4; k++) png.push_back(static_cast<std::byte>(name[k]));
    png.insert(png.end(), data.begin(), data.end());
    append(png, 0, 4);
}

std::vector<std::byte> makePng(const RawPng& raw) {
    std::vector<std::byte> png = bytesOf({0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'});
    std::vector<std::byte> header;
    append(header, raw.width, 4);
    append(header, raw.height, 4);
    for (const int value : {raw.depth, raw.color, 0, 0, raw.is_interlaced ? 1 : 0})
        header.push_back(static_cast<std::byte>(value));
    appendChunk(png, "IHDR", header);
    if (!raw.palette.empty()) appendChunk(png, "PLTE", raw.palette);
    if (!raw.transparency.empty()) appendChunk(png, "tRNS", raw.transparency);
    // zlib's header, one stored block, Adler's checksum.
    const auto size = static_cast<uint32_t>(raw.rows.size());
    std::vector<std::byte> data = bytesOf({0x78, 0x01, 0x01});
    for (const uint32_t value : {size, ~size})
        for (int shift = 0; shift < 16; shift += 8) data.push_back(static_cast<std::byte>(value >> shift));
    data.insert(data.end(), raw.rows.begin(), raw.rows.end());
    uint32_t low = 1;
    uint32_t high = 0;
    for (const std::byte byte : raw.rows) {
        low = (low + static_cast<uint32_t>(byte)) % 65521;
        high = (high + low) % 65521;
    }
    append(data, high << 16 | low, 4);
    appendChunk(png, "IDAT", data);
    appendChunk(png, "IEND", {});
    repairChecksums(png);
    return png;
}

}  // namespace

TEST(Image, CreateIsZero) {
    const Expected<Image> image = Image::create(FormatRGBAf32, 3, 2);
    ASSERT_THAT(image, IsOk());
    EXPECT_EQ(image->bytes().size(), 96u);
    EXPECT_EQ(image->texelSize(), 16u);
    EXPECT_EQ(image->load(2, 1), Vector4f(0.0f));
    EXPECT_TRUE(Image().isEmpty());
}

TEST(Image, CreateErrors) {
    EXPECT_THAT(Image::create(FormatRGBAu8n, 0, 4), HasErrorId("image.size_zero"));
    EXPECT_THAT(Image::create(FormatRGBAu8n, 4, 0), HasErrorId("image.size_zero"));
    EXPECT_THAT(Image::create(FormatUnknown, 4, 4), HasErrorId("image.format"));
    EXPECT_THAT(Image::create(FormatBC7RGBAu8n, 4, 4), HasErrorId("image.format"));
    EXPECT_THAT(Image::create(FormatRGBAf32, UINT32_MAX, UINT32_MAX), HasErrorId("image.too_large"));
    EXPECT_THAT(Image::create(FormatRu8n, UINT32_MAX, UINT32_MAX, ~0ull), HasErrorId("image.out_of_memory"));
    EXPECT_THAT(Image::create(FormatRu8n, 4, 4, 16), IsOk());
    EXPECT_THAT(Image::create(FormatRu8n, 4, 4, 15), HasErrorId("image.too_large"));
    const std::vector<std::byte> data(15);
    EXPECT_THAT(Image::create(FormatRu8n, 4, 4, data), HasErrorId("image.data_size"));
    EXPECT_THAT(Image::create(FormatRGu8n, 4, 2, data), HasErrorId("image.data_size"));
    EXPECT_THAT(Image::create(FormatRu8n, 5, 3, data), IsOk());
    EXPECT_THAT(Image::create(FormatRu8n, 0, 3, data), HasErrorId("image.size_zero"));
}

TEST(Image, TexelsLieRowByRow) {
    const std::vector<std::byte> data = bytesOf({1, 2, 3, 4, 5, 6});
    Image image = Image::create(FormatRu8n, 3, 2, data).value();
    EXPECT_EQ(image.texel(0, 0)[0], std::byte(1));
    EXPECT_EQ(image.texel(2, 0)[0], std::byte(3));
    EXPECT_EQ(image.texel(1, 1)[0], std::byte(5));
    image.texel(1, 1)[0] = std::byte(9);
    EXPECT_EQ(image.bytes()[4], std::byte(9));
}

TEST(Image, LoadIsTheInverseOfStore) {
    for (const Format format :
         {FormatRu8n, FormatRi8n, FormatRGu8n, FormatRGBAu8n, FormatBGRAu8n, FormatRu16n, FormatRi16n, FormatRGBAu16n,
          FormatRf16, FormatRGBAf16, FormatRf32, FormatRGBf32, FormatRGBAf32, FormatDf32, FormatDu16n}) {
        Image image = Image::create(format, 2, 2).value();
        const Vector4f value(0.25f, 0.5f, 0.75f, 1.0f);
        image.store(1, 1, value);
        const Vector4f loaded = image.load(1, 1);
        for (int i = 0; i < formatInfo(format).components; i++)
            EXPECT_NEAR(loaded[i], value[i], 0.5f / 127.0f) << toString(format);
        EXPECT_EQ(image.load(0, 0)[0], 0.0f);
    }
}

TEST(Image, EveryStoredByteComesBack) {
    for (const Format format : {FormatRu8n, FormatRu16n, FormatRi16n, FormatRf16}) {
        const uint32_t count = formatInfo(format).block_size == 1 ? 256 : 65536;
        Image image = Image::create(format, count, 1).value();
        for (uint32_t i = 0; i < count; i++) std::memcpy(image.texel(i, 0).data(), &i, image.texelSize());
        for (uint32_t i = 0; i < count; i++) {
            const Vector4f value = image.load(i, 0);
            if (std::isnan(value.x)) continue;
            if (format == FormatRi16n && i == 0x8000) continue;  // -32768 and -32767 are both -1
            Image copy = Image::create(format, 1, 1).value();
            copy.store(0, 0, value);
            EXPECT_TRUE(std::equal(copy.bytes().begin(), copy.bytes().end(), image.texel(i, 0).begin()))
                << toString(format) << " " << i;
        }
    }
}

TEST(Image, StoreClampsAndRounds) {
    Image image = Image::create(FormatRGBAu8n, 1, 1).value();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float infinity = std::numeric_limits<float>::infinity();
    image.store(0, 0, {-1, 2, nan, 0.5f});
    EXPECT_EQ(image, Image::create(FormatRGBAu8n, 1, 1, bytesOf({0, 255, 0, 128})).value());
    image.store(0, 0, {infinity, -infinity, 0.0019f, 0.0021f});
    EXPECT_EQ(image, Image::create(FormatRGBAu8n, 1, 1, bytesOf({255, 0, 0, 1})).value());
    image.store(7, 0, {1, 1, 1, 1});
    image.store(0, 7, {1, 1, 1, 1});
    EXPECT_EQ(image.load(0, 0).x, 1.0f);
    EXPECT_EQ(image.load(7, 7), Vector4f(0, 0, 0, 1));
}

TEST(Image, ConvertSwapsChannels) {
    Image image = Image::create(FormatBGRAu8n, 1, 1, bytesOf({10, 20, 30, 40})).value();
    const Expected<Image> converted = image.convert(FormatRGBAu8n);
    ASSERT_THAT(converted, IsOk());
    EXPECT_EQ(*converted, Image::create(FormatRGBAu8n, 1, 1, bytesOf({30, 20, 10, 40})).value());
    EXPECT_THAT(image.convert(FormatRu32), HasErrorId("image.format"));
    EXPECT_THAT(Image().convert(FormatRGBAu8n), HasErrorId("image.format"));
}

TEST(Png, RoundTripOfEveryFormat) {
    for (const Format format : png_formats) {
        for (const auto& [width, height] : {std::pair(1u, 1u), {7u, 5u}, {64u, 3u}, {1u, 300u}}) {
            const Image image = randomImage(format, width, height);
            const Expected<std::vector<std::byte>> bytes = encodePng(image);
            ASSERT_THAT(bytes, IsOk());
            const Expected<Image> read = decodePng(*bytes);
            ASSERT_THAT(read, IsOk()) << toString(format);
            EXPECT_EQ(read->convert(FormatRGBAu16n).value(), image.convert(FormatRGBAu16n).value()) << toString(format);
        }
    }
}

TEST(Png, OpaqueImagesHaveNoAlphaChannel) {
    for (const Format format : {FormatRGBAu8n, FormatBGRAu8n, FormatRGBAu16n}) {
        Image image = randomImage(format, 9, 9);
        for (uint32_t i = 0; i < 81; i++) {
            Vector4f value = image.load(i % 9, i / 9);
            value.w = 1.0f;
            image.store(i % 9, i / 9, value);
        }
        std::vector<std::byte> bytes = encodePng(image).value();
        EXPECT_EQ(bytes[25], std::byte(2)) << "colour type";
        EXPECT_EQ(decodePng(bytes)->convert(FormatRGBAu16n).value(), image.convert(FormatRGBAu16n).value());
        image.store(8, 8, {0, 0, 0, 0.99f});
        bytes = encodePng(image).value();
        EXPECT_EQ(bytes[25], std::byte(6)) << "colour type";
    }
}

TEST(Png, SameImageSameBytes) {
    const Image image = randomImage(FormatRGBAu8n, 33, 21);
    EXPECT_EQ(encodePng(image).value(), encodePng(image).value());
}

TEST(Png, EncodeErrors) {
    EXPECT_THAT(encodePng(Image()), HasErrorId("image.size_zero"));
    EXPECT_THAT(encodePng(Image::create(FormatRGBAf32, 1, 1).value()), HasErrorId("image.png_format"));
    EXPECT_THAT(encodePng(Image::create(FormatRu32, 1, 1).value()), HasErrorId("image.png_format"));
}

TEST(Png, DecodeErrors) {
    EXPECT_THAT(decodePng({}), HasErrorId("image.png_malformed"));
    EXPECT_THAT(decodePng(bytesOf({0x89, 'P', 'N', 'G'})), HasErrorId("image.png_malformed"));
    EXPECT_THAT(decodePng(bytesOf({0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'})), HasErrorId("image.png_malformed"));
    const std::vector<std::byte> bytes = encodePng(randomImage(FormatRGBAu8n, 20, 20)).value();
    for (size_t size = 0; size < bytes.size(); size++)
        EXPECT_THAT(decodePng(std::span(bytes).first(size)), HasErrorId("image.png_malformed")) << size;
    EXPECT_THAT(decodePng(bytes, 1600), IsOk());
    EXPECT_THAT(decodePng(bytes, 1599), HasErrorId("image.too_large"));
}

TEST(Png, PalettesAndTransparentColours) {
    const RawPng palette = {.width = 3,
                            .height = 1,
                            .depth = 2,
                            .color = 3,
                            .palette = bytesOf({1, 2, 3, 4, 5, 6, 7, 8, 9}),
                            .transparency = bytesOf({100, 255}),
                            .rows = bytesOf({0, 0b01001000})};
    const std::vector<std::byte> indexed = bytesOf({4, 5, 6, 255, 1, 2, 3, 100, 7, 8, 9, 255});
    EXPECT_EQ(decodePng(makePng(palette)).value(), Image::create(FormatRGBAu8n, 3, 1, indexed).value());

    const RawPng bits = {.width = 4, .height = 1, .depth = 1, .rows = bytesOf({0, 0b10110000})};
    EXPECT_EQ(decodePng(makePng(bits)).value(), Image::create(FormatRu8n, 4, 1, bytesOf({255, 0, 255, 255})).value());

    const RawPng gray = {.width = 2, .height = 1, .transparency = bytesOf({0, 7}), .rows = bytesOf({0, 7, 8})};
    EXPECT_EQ(decodePng(makePng(gray)).value(), Image::create(FormatRGu8n, 2, 1, bytesOf({7, 0, 8, 255})).value());

    const RawPng color = {.width = 2,
                          .height = 1,
                          .color = 2,
                          .transparency = bytesOf({0, 1, 0, 2, 0, 3}),
                          .rows = bytesOf({0, 1, 2, 3, 4, 5, 6})};
    const std::vector<std::byte> keyed = bytesOf({1, 2, 3, 0, 4, 5, 6, 255});
    EXPECT_EQ(decodePng(makePng(color)).value(), Image::create(FormatRGBAu8n, 2, 1, keyed).value());
}

TEST(Png, SixteenBitsAreInTheMachinesOrder) {
    const RawPng raw = {
        .width = 1, .height = 1, .depth = 16, .color = 2, .rows = bytesOf({0, 0x12, 0x34, 0, 1, 0xff, 0xfe})};
    const Image image = decodePng(makePng(raw)).value();
    ASSERT_EQ(image.format(), FormatRGBAu16n);
    const Vector4f value = image.load(0, 0) * 65535.0f;
    EXPECT_EQ(value, Vector4f(0x1234, 1, 0xfffe, 0xffff));
}

TEST(Png, Interlaced) {
    // Adam7: (0, 0), then (2, 0), then row 2 of even columns, then the odd column of even rows, then row 1.
    const RawPng raw = {
        .width = 3, .height = 3, .is_interlaced = true, .rows = bytesOf({0, 1, 0, 3, 0, 7, 9, 0, 2, 0, 8, 0, 4, 5, 6})};
    EXPECT_EQ(decodePng(makePng(raw)).value(),
              Image::create(FormatRu8n, 3, 3, bytesOf({1, 2, 3, 4, 5, 6, 7, 8, 9})).value());
}

TEST(Png, HugeSizesTakeNoMemory) {
    const uint64_t before = residentMemory();
    for (const auto& [width, height] : {std::pair(0x7fffffffu, 0x7fffffffu),
                                        {0x7fffffffu, 1u},
                                        {1u, 0x7fffffffu},
                                        {30000u, 30000u},
                                        {0xffffffffu, 2u},
                                        {0u, 5u}})
        for (const int color : {0, 2, 3, 4, 6})
            for (const bool is_interlaced : {false, true}) {
                const RawPng raw = {.width = width,
                                    .height = height,
                                    .color = color,
                                    .is_interlaced = is_interlaced,
                                    .palette = bytesOf({1, 2, 3}),
                                    .rows = bytesOf({0, 0, 0, 0})};
                EXPECT_THAT(decodePng(makePng(raw)), HasErrorId("image.png_malformed"));
            }
    EXPECT_LT(residentMemory(), before + (64u << 20));
}

// A file that a few bytes make must neither crash nor take more than the limit.
TEST(Png, MutationsAreErrorsOrImages) {
    constexpr uint64_t limit = 1 << 20;
    Random random(7);
    const auto mutate = [&](std::vector<std::byte>& bytes) {
        const size_t at = random.below(bytes.size() + 1);
        const auto place = bytes.begin() + static_cast<std::ptrdiff_t>(at);
        const uint64_t kind = random.below(4);
        if (kind == 0)
            bytes.insert(place, static_cast<std::byte>(random.bits()));
        else if (at == bytes.size())
            return;
        else if (kind == 1)
            bytes[at] = static_cast<std::byte>(random.bits());
        else if (kind == 2)
            bytes[at] ^= static_cast<std::byte>(1u << random.below(8));
        else
            bytes.resize(at);
    };
    std::vector<std::vector<std::byte>> seeds;
    for (const Format format : png_formats) seeds.push_back(encodePng(randomImage(format, 13, 11)).value());
    int readable = 0;
    for (int run = 0; run < 8000; run++) {
        std::vector<std::byte> bytes;
        if (run % 2) {
            // Below the checksums and the compression: filters, texels, palettes, headers.
            constexpr int depths[] = {1, 2, 4, 8, 16};
            constexpr int colors[] = {0, 2, 3, 4, 6};
            constexpr int channels[] = {1, 3, 1, 2, 4};
            const uint64_t color = random.below(5);
            RawPng raw = {.width = 5,
                          .height = 4,
                          .depth = depths[random.below(5)],
                          .color = colors[color],
                          .is_interlaced = random.below(4) == 0};
            if (color == 1 || color == 2) raw.palette.resize(3 * (1 + random.below(16)));
            if (random.below(2)) raw.transparency.resize(random.below(7));
            const size_t row_size = 1 + static_cast<size_t>(raw.depth * channels[color] * 5 + 7) / 8;
            raw.rows.resize(4 * row_size);
            for (size_t i = 0; i < raw.rows.size(); i++)
                raw.rows[i] = static_cast<std::byte>(i % row_size ? random.bits() : random.below(5));
            if (random.below(2)) mutate(raw.rows);
            bytes = makePng(raw);
        } else {
            bytes = seeds[random.below(seeds.size())];
        }
        for (uint64_t edit = random.below(4); edit > 0; edit--) mutate(bytes);
        // With right checksums a mutation reaches what lies behind them.
        if (run % 3) repairChecksums(bytes);
        const Expected<Image> image = decodePng(bytes, limit);
        if (image) {
            readable++;
            EXPECT_LE(image->bytes().size(), limit);
            EXPECT_EQ(image->bytes().size(), size_t{image->width()} * image->height() * image->texelSize());
        } else {
            const std::string_view id = image.error().id();
            EXPECT_TRUE(id == "image.png_malformed" || id == "image.too_large") << image.error().text();
        }
    }
    EXPECT_GT(readable, 1000);
}

TEST(Png, Files) {
    const TempDir dir;
    const Image image = randomImage(FormatRGBAu8n, 5, 4);
    ASSERT_THAT(image.save(dir / "a.png"), IsOk());
    const Expected<Image> read = Image::load(dir / "a.png");
    ASSERT_THAT(read, IsOk());
    EXPECT_EQ(*read, image);
    ASSERT_THAT(image.save(dir / "B.PNG"), IsOk());
    EXPECT_THAT(image.save(dir / "a.jpg"), HasErrorId("image.unknown_extension"));
    EXPECT_THAT(image.save(dir / "absent/a.png"), HasErrorId("file.create"));
    EXPECT_THAT(Image::load(dir / "a.tga"), HasErrorId("image.unknown_extension"));
    EXPECT_THAT(Image::load(dir / "b.png"), HasErrorId("file.open"));
    EXPECT_THAT(Image::load(dir / "a.png", 10), HasErrorId("file.too_large"));
    ASSERT_THAT(writeTextFile(dir / "c.png", "no picture"), IsOk());
    const Expected<Image> malformed = Image::load(dir / "c.png");
    EXPECT_THAT(malformed, HasErrorId("image.png_malformed"));
    EXPECT_EQ(malformed.error().file(), "c.png");
}

TEST(ImageCompare, CountsWhatDiffers) {
    const Image a = randomImage(FormatRGBAu8n, 8, 8);
    Image b = a;
    EXPECT_EQ(compareImages(a, b, 0.0f).differing, 0u);
    b.store(3, 4, b.load(3, 4) + Vector4f(b.load(3, 4).x < 0.5f ? 0.25f : -0.25f, 0, 0, 0));
    const ImageDifference difference = compareImages(a, b, 1.0f / 255.0f);
    EXPECT_TRUE(difference.is_comparable);
    EXPECT_EQ(difference.differing, 1u);
    EXPECT_NEAR(difference.largest, 0.25f, 1.0f / 255.0f);
    EXPECT_EQ(difference.heat_map.load(3, 4).x, 1.0f);
    EXPECT_EQ(difference.heat_map.load(0, 0), Vector4f(0, 0, 0, 1));
    EXPECT_FALSE(compareImages(a, randomImage(FormatRGBAu8n, 8, 7), 0.0f).is_comparable);
    EXPECT_FALSE(compareImages(a, Image::create(FormatRu32, 8, 8).value(), 0.0f).is_comparable);
}

TEST(ImageCompare, NanDiffersFromItself) {
    Image a = Image::create(FormatRGBAf32, 2, 2).value();
    a.store(0, 0, Vector4f(std::numeric_limits<float>::quiet_NaN()));
    a.store(1, 1, Vector4f(std::numeric_limits<float>::infinity()));
    const ImageDifference difference = compareImages(a, a, 1e9f);
    EXPECT_EQ(difference.differing, 1u);
    EXPECT_TRUE(std::isnan(difference.largest));
}

TEST(ImageCompare, FailureLeavesPictures) {
    const Image a = randomImage(FormatRGBAu8n, 8, 8, 1);
    const Image b = randomImage(FormatRGBAu8n, 8, 8, 2);
    EXPECT_TRUE(imagesMatch(a, a, "image_test"));
    EXPECT_TRUE(imagesMatch(a, b, "image_test", {.channel = 1.0f}));
    EXPECT_TRUE(imagesMatch(a, b, "image_test", {.texels = 64}));
    const testing::AssertionResult result = imagesMatch(a, b, "image_test");
    EXPECT_FALSE(result);
    for (const char* kind : {"actual", "expected", "heat"}) {
        const std::filesystem::path path = outputDir() / (std::string("image_test.") + kind + ".png");
        EXPECT_THAT(Image::load(path), IsOk());
        std::filesystem::remove(path);
    }
}
