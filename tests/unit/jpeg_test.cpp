// JPEG files as libjpeg-turbo's own encoder writes them, and what damage makes of them.

#include "support/allocations.h"
#include "support/files.h"
#include "support/matchers.h"
#include "support/reference.h"

#include <glint/base/file.h>
#include <glint/format/image.h>

#include <turbojpeg.h>

#include <gtest/gtest.h>

#include <cstring>

using namespace glint;
using namespace glint::test;

namespace {

using Bytes = std::vector<std::byte>;

enum class Colors : uint8_t { Gray, Rgb, Printers };

/// Squares of 8x8 texels, each of one colour from `seed`.
std::vector<uint8_t> squares(int width, int height, int channels, uint64_t seed = 1) {
    Random random(seed);
    std::vector<uint8_t> colors(static_cast<size_t>((width + 7) / 8 * ((height + 7) / 8) * channels));
    for (uint8_t& color : colors) color = static_cast<uint8_t>(random.below(256));
    std::vector<uint8_t> texels;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            for (int k = 0; k < channels; k++)
                texels.push_back(colors[static_cast<size_t>((y / 8 * ((width + 7) / 8) + x / 8) * channels + k)]);
    return texels;
}

Bytes encode(const std::vector<uint8_t>& texels, int width, int height, Colors colors, int flags = 0,
             int subsampling = TJSAMP_444, int quality = 100) {
    const int formats[] = {TJPF_GRAY, TJPF_RGB, TJPF_CMYK};
    const tjhandle encoder = tjInitCompress();
    unsigned char* data = nullptr;
    unsigned long size = 0;
    EXPECT_EQ(tjCompress2(encoder, texels.data(), width, 0, height, formats[static_cast<int>(colors)], &data, &size,
                          colors == Colors::Gray ? TJSAMP_GRAY : subsampling, quality, flags),
              0)
        << tjGetErrorStr2(encoder);
    const auto* first = reinterpret_cast<const std::byte*>(data);
    Bytes bytes(first, first + size);
    tjFree(data);
    tjDestroy(encoder);
    return bytes;
}

Bytes encode(int width, int height, Colors colors, int flags = 0) {
    return encode(squares(width, height,
                          colors == Colors::Gray  ? 1
                          : colors == Colors::Rgb ? 3
                                                  : 4),
                  width, height, colors, flags);
}

/// The first segment of this kind: its place, at the ff before the kind.
size_t findSegment(const Bytes& file, int kind) {
    for (size_t i = 2; i + 3 < file.size();) {
        if (file[i + 1] == std::byte(kind)) return i;
        i += 2 + static_cast<size_t>(file[i + 2]) * 256 + static_cast<size_t>(file[i + 3]);
    }
    ADD_FAILURE() << "no segment " << kind;
    return 0;
}

}  // namespace

// A block of one colour has one coefficient that is not 0, which is 8 times the level and a whole number at quality
// 100, so gray ones come back exactly.
TEST(Jpeg, Gray) {
    const std::vector<uint8_t> texels = squares(35, 21, 1);
    const Expected<Image> image = decodeJpeg(encode(texels, 35, 21, Colors::Gray));
    ASSERT_THAT(image, IsOk());
    EXPECT_EQ(image->format(), FormatRu8n);
    EXPECT_EQ(image->width(), 35u);
    EXPECT_EQ(image->height(), 21u);
    ASSERT_EQ(image->bytes().size(), texels.size());
    EXPECT_EQ(std::memcmp(image->bytes().data(), texels.data(), texels.size()), 0);
}

// Turning colours to luminance and back rounds the three levels twice; their factors sum up to at most 1 + 1.77 each,
// so that they are less than 3 levels apart.
TEST(Jpeg, Colours) {
    const std::vector<uint8_t> texels = squares(35, 21, 3);
    const Expected<Image> image = decodeJpeg(encode(texels, 35, 21, Colors::Rgb));
    ASSERT_THAT(image, IsOk());
    EXPECT_EQ(image->format(), FormatRGBAu8n);
    for (uint32_t i = 0; i < 35 * 21; i++) {
        const Vector4f texel = 255.0f * image->load(i % 35, i / 35);
        for (int k = 0; k < 3; k++) EXPECT_NEAR(texel[k], texels[3 * i + static_cast<size_t>(k)], 3.0f) << i;
        EXPECT_EQ(texel.w, 255.0f);
    }
}

// A progressive file holds the same coefficients, in another order.
TEST(Jpeg, ProgressiveIsTheSame) {
    for (const Colors colors : {Colors::Gray, Colors::Rgb}) {
        const Expected<Image> image = decodeJpeg(encode(35, 21, colors, TJFLAG_PROGRESSIVE));
        ASSERT_THAT(image, IsOk());
        EXPECT_EQ(*image, *decodeJpeg(encode(35, 21, colors)));
    }
}

// However colours are subsampled; what is one colour all over stays that, within the two roundings of above.
TEST(Jpeg, EverySubsampling) {
    const std::vector<uint8_t> texels(static_cast<size_t>(35 * 21 * 3), 77);
    for (const int subsampling : {TJSAMP_444, TJSAMP_422, TJSAMP_420, TJSAMP_440, TJSAMP_411}) {
        const Expected<Image> image = decodeJpeg(encode(texels, 35, 21, Colors::Rgb, 0, subsampling));
        ASSERT_THAT(image, IsOk()) << subsampling;
        for (uint32_t i = 0; i < 35 * 21; i++) EXPECT_NEAR(255.0f * image->load(i % 35, i / 35).y, 77.0f, 3.0f);
    }
}

TEST(Jpeg, ColoursOfPrintersAreRefused) {
    const Expected<Image> image = decodeJpeg(encode(16, 8, Colors::Printers));
    ASSERT_THAT(image, HasErrorId("image.jpeg_unsupported"));
    EXPECT_NE(image.error().message().find("16x8"), std::string::npos) << image.error().text();
}

TEST(Jpeg, Limits) {
    for (const Colors colors : {Colors::Gray, Colors::Rgb}) {
        const Bytes file = encode(35, 21, colors);
        const uint64_t size = 35 * 21 * (colors == Colors::Gray ? 1 : 4);
        EXPECT_THAT(decodeJpeg(file, size), IsOk());
        EXPECT_THAT(decodeJpeg(file, size - 1), HasErrorId("image.too_large"));
        EXPECT_THAT(decodeJpeg(file, 0), HasErrorId("image.too_large"));
    }
}

// Four times the image beside it, whatever the order of the file. The slack is for the allocator's pages and the
// library's tables.
TEST(Jpeg, MemoryStaysWithinItsLimits) {
    constexpr uint64_t slack = 6 << 20;
    for (const Colors colors : {Colors::Gray, Colors::Rgb})
        for (const int flags : {0, TJFLAG_PROGRESSIVE}) {
            const Bytes file = encode(2401, 2001, colors, flags);
            const uint64_t size = 2401 * 2001 * (colors == Colors::Gray ? 1 : 4);
            EXPECT_LE(peakMemory([&] { EXPECT_THAT(decodeJpeg(file, size), IsOk()); }), 5 * size + slack);
            EXPECT_LE(peakMemory([&] { EXPECT_THAT(decodeJpeg(file, size - 1), HasErrorId("image.too_large")); }),
                      slack);
        }
    Bytes large = encode(16, 16, Colors::Rgb);
    // Height and width follow the start of the frame, ff c0, its length and depth.
    std::fill_n(large.begin() + static_cast<ptrdiff_t>(findSegment(large, 0xc0)) + 5, 4, std::byte(0xff));
    EXPECT_LE(peakMemory([&] { EXPECT_THAT(decodeJpeg(large, ~0ull), HasErrorId("image.jpeg_malformed")); }), slack)
        << "65535 x 65535 in a few hundred bytes";
}

// What is missing at the end is gray, as in browsers; without all of its tables there is no picture.
TEST(Jpeg, EveryTruncation) {
    const Bytes file = encode(16, 16, Colors::Rgb);
    const size_t start = findSegment(file, 0xda);
    for (size_t size = 0; size < file.size(); size++) {
        const Expected<Image> image = decodeJpeg(std::span(file).first(size));
        if (size <= start) { EXPECT_THAT(image, HasErrorId("image.jpeg_malformed")) << size; }
        if (size >= start + 14) { EXPECT_THAT(image, IsOk()) << size; }
    }
}

// A header that the library warns about can still be read: here a revision of JFIF that is not known.
TEST(Jpeg, HeadersWithWarnings) {
    const Bytes file = encode(16, 16, Colors::Gray);
    Bytes revised = file;
    revised[findSegment(revised, 0xe0) + 9] = std::byte(2);
    const Expected<Image> image = decodeJpeg(revised);
    ASSERT_THAT(image, IsOk());
    EXPECT_EQ(*image, *decodeJpeg(file));
}

// Application data may hold anything, also what looks like a table.
TEST(Jpeg, CommentsArePassedOver) {
    const Bytes file = encode(16, 16, Colors::Rgb);
    Bytes comment(2 + 40, std::byte(0xff));
    comment[1] = std::byte(0xfe), comment[2] = std::byte(0), comment[3] = std::byte(40);
    comment[10] = std::byte(0xff), comment[11] = std::byte(0xc4), comment[12] = comment[14] = std::byte(0);
    Bytes commented = file;
    commented.insert(commented.begin() + 2, comment.begin(), comment.end());
    ASSERT_THAT(decodeJpeg(commented), IsOk());
    EXPECT_EQ(*decodeJpeg(commented), *decodeJpeg(file));
}

TEST(Jpeg, HuffmanTablesOfTooManyCodes) {
    Bytes file = encode(16, 16, Colors::Rgb);
    // The numbers of codes follow the start of a table, ff c4, its length and kind.
    const size_t table = findSegment(file, 0xc4);
    file[table + 19] = file[table + 20] = std::byte(0xff);
    EXPECT_THAT(decodeJpeg(file), HasErrorId("image.jpeg_malformed")) << "510 codes";
}

// Every change of a byte leaves an error or a whole picture: the library takes an error after a warning for a
// warning, and leaves texels as they were then.
TEST(Jpeg, MutationsAreErrorsOrPictures) {
    size_t pictures = 0, errors = 0;
    for (const int flags : {0, TJFLAG_PROGRESSIVE}) {
        const Bytes file = encode(40, 24, Colors::Rgb, flags);
        Random random(3);
        for (int i = 0; i < 4000; i++) {
            Bytes changed = file;
            for (uint64_t k = 1 + random.below(4); k > 0; k--)
                changed[2 + random.below(changed.size() - 2)] ^= static_cast<std::byte>(1 << random.below(8));
            const Expected<Image> image = decodeJpeg(changed, 1 << 20);
            if (!image) {
                EXPECT_TRUE(image.error().id().starts_with("image.")) << image.error().text();
                errors++;
            } else if (image->format() == FormatRGBAu8n) {
                const uint32_t last = image->height() - 1;
                ASSERT_EQ(image->texel(image->width() - 1, last)[3], std::byte(0xff)) << "mutation " << i;
                pictures++;
            }
        }
    }
    EXPECT_GT(pictures, 1000u);
    EXPECT_GT(errors, 500u);
}

TEST(Jpeg, Files) {
    const TempDir dir;
    const Bytes file = encode(35, 21, Colors::Rgb);
    for (const char* name : {"a.jpg", "a.jpeg", "a.JPG"}) {
        ASSERT_THAT(writeFile(dir / name, file), IsOk());
        const Expected<Image> image = Image::load(dir / name);
        ASSERT_THAT(image, IsOk());
        EXPECT_EQ(*image, *decodeJpeg(file));
        EXPECT_THAT(Image::load(dir / name, file.size() - 1), HasErrorId("file.too_large"));
        // Nothing is written that loses what it is given.
        EXPECT_THAT(image->save(dir / name), HasErrorId("image.unknown_extension"));
    }
    ASSERT_THAT(writeFile(dir / "cut.jpg", std::span(file).first(100)), IsOk());
    const Expected<Image> cut = Image::load(dir / "cut.jpg");
    ASSERT_THAT(cut, HasErrorId("image.jpeg_malformed"));
    EXPECT_EQ(cut.error().file(), "cut.jpg");
}
