// Files that are broken in every way that came to mind: each gives its error with its place, and takes no memory for
// what it only claims.

#include "support/allocations.h"
#include "support/matchers.h"
#include "support/png_chunks.h"
#include "support/reference.h"

#include <glint/base/log.h>
#include <glint/format/image.h>
#include <glint/format/mesh.h>

#include <fmt/format.h>

#include <gtest/gtest.h>

#include <cstring>

using namespace glint;
using namespace glint::test;
using namespace std::string_literals;

namespace {

std::span<const std::byte> bytesOf(std::string_view text) { return std::as_bytes(std::span(text)); }

std::string textOf(const std::vector<std::byte>& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

struct Case {
    std::string file;
    const char* id;
    const char* place;  ///< what the error's text has to contain: the byte, the line or the element
};

template <class Read, size_t N>
void expectErrors(const Case (&cases)[N], const Read& read) {
    for (size_t i = 0; i < N; i++) {
        const auto result = read(cases[i].file);
        EXPECT_THAT(result, HasErrorId(cases[i].id)) << "case " << i << ": " << cases[i].file.substr(0, 1000);
        if (result) continue;
        EXPECT_NE(result.error().text().find(cases[i].place), std::string::npos)
            << "case " << i << " has no '" << cases[i].place << "' in: " << result.error().text();
    }
}

std::string replaced(std::string text, std::string_view what, std::string_view with) {
    const size_t at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    return at == std::string::npos ? text : text.replace(at, what.size(), with);
}

Expected<Mesh> readPly(const std::string& file) { return parsePly(bytesOf(file), "test.ply", 1 << 20); }
Expected<Mesh> readObj(const std::string& file) { return parseObj(file, "test.obj", 1 << 20); }
Expected<Image> readPng(const std::string& file) { return decodePng(bytesOf(file), 1 << 20); }
Expected<Image> readHdr(const std::string& file) { return decodeHdr(bytesOf(file), 1 << 20); }
Expected<Image> readExr(const std::string& file) { return decodeExr(bytesOf(file), 1 << 20); }

const std::string ascii = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                          "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
                          "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 2 1 0\n";

/// The same with other faces.
std::string faces(const std::string& text) { return replaced(ascii, "3 0 1 2\n3 2 1 0\n", text); }

std::string binaryHeader(const char* vertices, const char* face_count, const char* list = "uchar int") {
    return fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
                       "property float z\nelement face {}\nproperty list {} vertex_indices\nend_header\n",
                       vertices, face_count, list);
}

/// 169 or so bytes of header, 3 vertices, 1 face.
std::string binaryPly(const std::string& face, const char* list = "uchar int") {
    std::string file = binaryHeader("3", "1", list);
    for (const float value : {0, 0, 0, 1, 0, 0, 0, 1, 0}) {
        char bytes[4];
        std::memcpy(bytes, &value, 4);
        file.append(bytes, 4);
    }
    return file + face;
}

std::string u32(uint64_t value, int size = 4) {
    std::string bytes;
    for (int i = 0; i < size; i++) bytes += static_cast<char>(value >> 8 * i);
    return bytes;
}

std::string f32(float value) {
    uint32_t bits = 0;
    std::memcpy(&bits, &value, 4);
    return u32(bits);
}

struct ExrParts {
    std::string version = "\x76\x2f\x31\x01\2\0\0\0"s;
    std::string channels = channel("R");
    std::string compression = "\0"s;
    std::string window = u32(0) + u32(0) + u32(3) + u32(1);
    std::string more;  ///< attributes
    std::string data;  ///< after the header; empty: the right ones

    static std::string channel(const char* name, uint32_t type = 1, uint32_t sampling = 1) {
        return name + "\0"s + u32(type) + u32(0) + u32(sampling) + u32(sampling);
    }
    static std::string attribute(const std::string& name, const std::string& type, const std::string& value) {
        return name + '\0' + type + '\0' + u32(value.size()) + value;
    }
    static std::string tiles(uint32_t width, uint32_t height) {
        return attribute("tiles", "tiledesc", u32(width) + u32(height) + "\0"s);
    }

    std::string header() const {
        return version + attribute("channels", "chlist", channels + '\0') +
               attribute("compression", "compression", compression) + attribute("dataWindow", "box2i", window) +
               attribute("displayWindow", "box2i", window) + attribute("lineOrder", "lineOrder", "\0"s) +
               attribute("pixelAspectRatio", "float", f32(1)) +
               attribute("screenWindowCenter", "v2f", f32(0) + f32(0)) +
               attribute("screenWindowWidth", "float", f32(1)) + more + '\0';
    }
    std::string file() const {
        const std::string first = header();
        if (!data.empty()) return first + data;
        // Two lines of four halves.
        std::string rest = u32(first.size() + 16, 8) + u32(first.size() + 32, 8);
        for (uint32_t y = 0; y < 2; y++) rest += u32(y) + u32(8) + "\0\x3c\0\x40\0\x44\0\x48"s;
        return first + rest;
    }
};

std::string exr(const std::function<void(ExrParts&)>& change) {
    ExrParts parts;
    change(parts);
    return parts.file();
}

std::string hdr(std::string_view size, std::string_view data) {
    return fmt::format("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{}\n{}", size, data);
}

/// A scan line of 8 texels, packed as runs.
const std::string scan_line = "\2\2\0\x08\x88\x80\x88\x40\x88\x20\x88\x88"s;

Image gradient(Format format, uint32_t width, uint32_t height) {
    Image image = Image::create(format, width, height).value();
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++)
            image.store(x, y, Vector4f(static_cast<float>(x) / 16, static_cast<float>(y) / 16, 0.5f, 0.25f));
    return image;
}

std::string repaired(std::string png) {
    std::vector<std::byte> bytes(bytesOf(png).begin(), bytesOf(png).end());
    repairChecksums(bytes);
    return textOf(bytes);
}

/// 8 bytes of signature; IHDR's length at 8, width at 16, height at 20, depth, colour, compression, filter and
/// interlace at 24 to 28, its checksum at 29; IDAT's length at 33, its data at 41.
std::string png() { return textOf(encodePng(gradient(FormatRGBAu8n, 6, 5)).value()); }

std::string pngWith(size_t at, std::string_view bytes) {
    std::string file = png();
    return repaired(file.replace(at, bytes.size(), bytes));
}

std::string pngWithChunk(const char* name, const std::string& data) {
    std::string chunk = u32(data.size());
    std::reverse(chunk.begin(), chunk.end());
    std::string file = png();
    return repaired(file.insert(33, chunk + name + data + "\0\0\0\0"s));
}

}  // namespace

TEST(Malformed, TheFilesAreGoodWithoutTheirDefects) {
    EXPECT_THAT(readPly(ascii), IsOk());
    EXPECT_THAT(readPly(binaryPly("\3"s + u32(0) + u32(1) + u32(2))), IsOk());
    EXPECT_THAT(readExr(ExrParts().file()), IsOk());
    EXPECT_THAT(readHdr(hdr("-Y 2 +X 8", scan_line + scan_line)), IsOk());
    EXPECT_THAT(readPng(png()), IsOk());
    EXPECT_THAT(readPng(pngWithChunk("teXt", "a\0b"s)), IsOk());
}

TEST(Malformed, Ply) {
    const size_t header_size = binaryHeader("3", "1").size();
    const std::string at_faces = fmt::format("byte {}:", header_size + 36);
    const Case cases[] = {
        {"", "ply.header", "begin"},
        {"ply", "ply.header", "begin"},
        {"plyx\n", "ply.header", "begin"},
        {"PLY\n", "ply.header", "begin"},
        {"ply\n", "ply.header", ":1:"},
        {"ply\nformat ascii 1.0\n", "ply.header", ":2:"},
        {"ply\nend_header\n", "ply.header", ":2:"},
        {replaced(ascii, "ascii", "text"), "ply.header", ":2:"},
        {replaced(ascii, "1.0", "1.1"), "ply.header", ":2:"},
        {replaced(ascii, "1.0", "1.0 more"), "ply.header", ":2:"},
        {replaced(ascii, "element vertex", "format ascii 1.0\nelement vertex"), "ply.header", ":3:"},
        {replaced(ascii, "element vertex 3\n", ""), "ply.header", ":3:"},
        {replaced(ascii, "vertex 3", "vertex -3"), "ply.header", ":3:"},
        {replaced(ascii, "vertex 3", "vertex 3.0"), "ply.header", ":3:"},
        {replaced(ascii, "vertex 3", "vertex"), "ply.header", ":3:"},
        {replaced(ascii, "vertex 3", "vertex 99999999999999999999"), "ply.header", ":3:"},
        {replaced(ascii, "element face 2", "element vertex 2"), "ply.header", ":7:"},
        {replaced(ascii, "float x", "half x"), "ply.header", ":4:"},
        {replaced(ascii, "float x", "float"), "ply.header", ":4:"},
        {replaced(ascii, "float y", "float x"), "ply.header", ":5:"},
        {replaced(ascii, "list uchar int", "list float int"), "ply.header", ":8:"},
        {replaced(ascii, "list uchar int", "list int"), "ply.header", ":8:"},
        {replaced(ascii, "end_header", "end"), "ply.header", ":9:"},
        {replaced(ascii, "vertex 3", "vertex 4000000000"), "ply.truncated", "4000000000 records of element 'vertex'"},
        {replaced(ascii, "face 2", "face 18446744073709551615"), "ply.truncated", "of element 'face'"},
        {replaced(ascii, "vertex 3", "vertex 0"), "mesh.no_positions", "test.ply"},
        {replaced(ascii, "element vertex", "element points"), "mesh.no_positions", "'vertex'"},
        {replaced(ascii, "float z", "float w"), "mesh.no_positions", "x, y and z"},
        {replaced(ascii, "float z\n", "list uchar float z\n"), "mesh.no_positions", "x, y and z"},
        {replaced(ascii, "element face", "element facet"), "mesh.no_faces", "test.ply"},
        {replaced(ascii, "vertex_indices", "corners"), "mesh.no_faces", "test.ply"},
        {replaced(ascii, "1 0 0", "1 zero 0"), "ply.value", ":11: vertex 1: property 'y'"},
        {replaced(ascii, "1 0 0", "1 1e999 0"), "ply.value", ":11: vertex 1: property 'y'"},
        {replaced(ascii, "1 0 0", "1 0x1 0"), "ply.value", ":11: vertex 1"},
        {replaced(ascii, "1 0 0", "1 + 0"), "ply.value", ":11: vertex 1"},
        {replaced(ascii, "1 0 0", "1 \0 0"s), "ply.value", ":11: vertex 1"},
        {replaced(ascii, "1 0 0", "1 nan 0"), "mesh.not_finite", "vertex 1"},
        {replaced(ascii, "0 1 0", "0 -inf 0"), "mesh.not_finite", "vertex 2"},
        {replaced(ascii, "0 1 0", "0 1e39 0"), "mesh.not_finite", "vertex 2"},
        {faces("3 0 1 2\n"), "ply.truncated", "face 1"},
        {faces("3 0 1 2\n3 2 1"), "ply.list_length", ":14: face 1"},
        {faces("3 0 1 2\n3   2 1  "), "ply.truncated", ":14: face 1"},
        {faces("3 0 1 2\n-3 2 1 0\n"), "ply.list_length", ":14: face 1"},
        {faces("3 0 1 2\n4000000000 2 1 0\n"), "ply.list_length", ":14: face 1"},
        {faces("3 0 1 2\n2.5 2 1 0\n"), "ply.list_length", ":14: face 1"},
        {faces("3 0 1 2\nnan 2 1 0\n"), "ply.list_length", ":14: face 1"},
        {faces("3 0 1 2\n2 1 0\n"), "mesh.face_corners", ":14: face 1"},
        {faces("0\n3 0 1 2\n"), "mesh.face_corners", ":13: face 0"},
        {faces("3 0 1 3\n3 2 1 0\n"), "mesh.index_range", ":13: face 0: corner 2"},
        {faces("3 0 1 -1\n3 2 1 0\n"), "mesh.index_range", ":13: face 0: corner 2"},
        {faces("3 0 1.5 1\n3 2 1 0\n"), "mesh.index_range", ":13: face 0: corner 1"},
        {faces("3 0 nan 1\n3 2 1 0\n"), "mesh.index_range", ":13: face 0: corner 1"},
        {faces("3 0 x 1\n3 2 1 0\n"), "ply.value", ":13: face 0"},
        {replaced(faces("4 0 1 2 3 4 2 1 0 9"), "element face", "element tristrips"), "mesh.index_range",
         ":13: tristrips 0: corner 3"},
        {binaryHeader("3", "1"), "ply.truncated", "'vertex'"},
        {binaryHeader("18446744073709551615", "1") + "0123", "ply.truncated", "18446744073709551615"},
        {binaryPly(""), "ply.truncated", "'face'"},
        {binaryPly("\3"), "ply.list_length", "face 0"},
        {binaryPly("\3"s + u32(0) + u32(1) + "\0\0\0"s), "ply.list_length", "face 0"},
        {binaryPly("\xff"s + u32(0) + u32(1) + u32(2)), "ply.list_length", "has the length 255"},
        {binaryPly("\xff"s + u32(0), "char int"), "ply.list_length", "has the length -1"},
        {binaryPly(u32(0xffffffff) + u32(0), "int int"), "ply.list_length", "has the length -1"},
        {binaryPly(u32(0xffffffff) + u32(0), "uint int"), "ply.list_length", "has the length 4294967295"},
        {binaryPly("\3"s + u32(0) + u32(1) + u32(3)), "mesh.index_range", "face 0, before byte"},
        {binaryPly("\3"s + u32(0) + u32(1) + u32(0x80000000)), "mesh.index_range", "vertex -2147483648 of 3"},
        {binaryPly("\3"s + f32(0) + f32(1) + f32(0.5f), "uchar float"), "mesh.index_range", "vertex 0.5 of 3"},
        {binaryPly("\3"s + u32(0) + u32(1) + u32(2)).replace(header_size + 4, 4, "\0\0\xc0\x7f"s), "mesh.not_finite",
         "vertex 0"},
    };
    expectErrors(cases, readPly);
    EXPECT_NE(readPly(binaryPly("\2"s + u32(0) + u32(1))).error().text().find(fmt::format("byte {}", header_size + 45)),
              std::string::npos);
}

TEST(Malformed, Obj) {
    const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    std::string corners = vertices + "f";
    for (int i = 0; i < 2000; i++) corners += " 1";
    const Case cases[] = {
        {"", "mesh.empty_file", "test.obj"},
        {"ply\nformat ascii 1.0\n", "mesh.no_faces", "test.obj"},
        {"v 0 0\nf 1 1 1\n", "mesh.syntax", ":1: position 1"},
        {"v 0 0 0\nv 0 one 0\n", "mesh.syntax", ":2: position 2"},
        {"v 0 0 0\nvt 0 1e\n", "mesh.syntax", ":2: texture coordinate 1"},
        {"v 0 0 nan\n", "mesh.not_finite", ":1: position 1"},
        {"v 0 0 0\nvn inf 0 0\n", "mesh.not_finite", ":2: normal 1"},
        {"v 0 0 1e400\n", "mesh.syntax", ":1: position 1"},
        {vertices + "f 1 2 4\n", "mesh.index_range", ":4: face 1: '4'"},
        {vertices + "f 1 2 -4\n", "mesh.index_range", ":4: face 1: '-4'"},
        {vertices + "f 1 2 3\nf 0 1 2\n", "mesh.index_range", ":5: face 2: '0'"},
        {vertices + "f 1/1 2/1 3/1\n", "mesh.index_range", ":4: face 1: '1/1'"},
        {vertices + "f 1 2 340282366920938463463374607431768211456\n", "mesh.index_range", ":4: face 1"},
        {vertices + "f 1 2\n", "mesh.face_corners", ":4: face 1"},
        {corners, "mesh.face_corners", ":4: face 1"},
        {vertices + "f 1 2 3\0"s, "mesh.index_range", ":4: face 1"},
    };
    expectErrors(cases, readObj);
}

TEST(Malformed, Png) {
    std::string truncated_rows = png();
    truncated_rows.erase(41 + 20);
    const Case cases[] = {
        {"", "image.png_malformed", "byte 0"},
        {"\x89PNG", "image.png_malformed", "byte 0"},
        {replaced(png(), "PNG", "MNG"), "image.png_malformed", "byte 0"},
        {png().substr(0, 8), "image.png_malformed", "byte 8"},
        {png().substr(0, 20), "image.png_malformed", "byte 16"},
        {truncated_rows, "image.png_malformed", "byte 41"},
        {png().replace(29, 4, "\0\0\0\0"s), "image.png_malformed", "byte 33"},
        {pngWith(8, "\xff\xff\xff\xff"), "image.png_malformed", "byte 16"},
        {pngWith(8, "\0\0\0\x0c"s), "image.png_malformed", "byte"},
        {pngWith(12, "IDAT"), "image.png_malformed", "byte 16"},
        {pngWith(16, "\0\0\0\0"s), "image.png_malformed", "byte 33"},
        {pngWith(20, "\0\0\0\0"s), "image.png_malformed", "byte 33"},
        {pngWith(16, "\xff\xff\xff\xff"), "image.png_malformed", "byte 33"},
        {pngWith(16, "\x7f\xff\xff\xff\x7f\xff\xff\xff"), "image.png_malformed", "byte"},
        {pngWith(16, "\0\0\x40\0"s), "image.png_malformed", "byte"},
        {pngWith(20, "\0\0\0\x06"s), "image.png_malformed", "byte"},
        {pngWith(24, "\7"), "image.png_malformed", "byte 33"},
        {pngWith(25, "\5"), "image.png_malformed", "byte 33"},
        {pngWith(25, "\3"), "image.png_malformed", "byte"},
        {pngWith(26, "\1"), "image.png_malformed", "byte 33"},
        {pngWith(27, "\1"), "image.png_malformed", "byte 33"},
        {pngWith(28, "\2"), "image.png_malformed", "byte 33"},
        {pngWith(41, "\0\0"s), "image.png_malformed", "byte"},
        {pngWith(37, "IEND"), "image.png_malformed", "byte"},
        {pngWithChunk("ABCD", ""), "image.png_malformed", "byte 45: ABCD"},
        {pngWithChunk("IHDR", std::string(13, '\0')), "image.png_malformed", "byte"},
    };
    expectErrors(cases, readPng);
    EXPECT_THAT(decodePng(bytesOf(png()), 119), HasErrorId("image.too_large"));
}

TEST(Malformed, Hdr) {
    const size_t data_at = hdr("-Y 2 +X 8", "").size();
    const std::string second_line = fmt::format("byte {}: ", data_at + scan_line.size());
    const std::string in_second_line = fmt::format("byte {}: channel", data_at + scan_line.size() + 4);
    const auto second = [&](const std::string& line) { return hdr("-Y 2 +X 8", scan_line + line); };
    const Case cases[] = {
        {"", "image.hdr_malformed", "byte 0"},
        {"#?RADIANCE", "image.hdr_malformed", "byte 0"},
        {"#?RADIANT\n\n-Y 1 +X 1\n", "image.hdr_malformed", "byte 0"},
        {"#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 1 +X 1\r\n", "image.hdr_malformed", "byte 0"},
        {"#?RGBE\nFORMAT=32-bit_rle_rgbe\n", "image.hdr_malformed", "byte 30"},
        {"#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n", "image.hdr_malformed", "byte 31"},
        {"#?RGBE\nFORMAT=32-bit\0\n\n"s, "image.hdr_malformed", "byte 7"},
        {"#?RGBE\n#" + std::string(2000, 'x') + "\n\n", "image.hdr_malformed", "byte 7"},
        {"#?RGBE\n\n-Y 1 +X 1\n\1\1\1\1", "image.hdr_unsupported", "format ''"},
        {replaced(hdr("-Y 1 +X 1", "\1\2\3\4"), "rgbe", "xyze"), "image.hdr_unsupported", "32-bit_rle_xyze"},
        {hdr("+Y 1 +X 1", "\1\2\3\4"), "image.hdr_unsupported", "+Y 1 +X 1"},
        {hdr("+X 1 -Y 1", "\1\2\3\4"), "image.hdr_unsupported", "+X 1 -Y 1"},
        {hdr("-Y 1 -X 1", "\1\2\3\4"), "image.hdr_malformed", "-Y 1 -X 1"},
        {hdr("-Y 0 +X 1", ""), "image.hdr_malformed", "-Y 0 +X 1"},
        {hdr("-Y 1 +X 0", ""), "image.hdr_malformed", "-Y 1 +X 0"},
        {hdr("-Y -1 +X 1", "\1\2\3\4"), "image.hdr_malformed", "-Y -1 +X 1"},
        {hdr("-Y 1 +X 1x", "\1\2\3\4"), "image.hdr_malformed", "-Y 1 +X 1x"},
        {hdr("-Y 1 +X", "\1\2\3\4"), "image.hdr_malformed", "-Y 1 +X"},
        {hdr("-Y 99999999999 +X 1", "\1\2\3\4"), "image.hdr_malformed", "-Y 99999999999"},
        {hdr("-Y 4294967295 +X 4294967295", "\1\2\3\4"), "image.too_large", "4294967295x4294967295"},
        {hdr("-Y 2147483647 +X 1", "\1\2\3\4"), "image.too_large", "1x2147483647"},
        {hdr("-Y 100 +X 600", "\1\2\3\4"), "image.hdr_malformed", "600x100"},
        {hdr("-Y 1 +X 1", "\1\2\3"), "image.hdr_malformed", "1x1"},
        {hdr("-Y 1 +X 2", "\x80\2\3\4\1\1\1\5"), "image.hdr_unsupported", "texel 1"},
        {second(""), "image.hdr_malformed", second_line.c_str()},
        {second("\2\2\0"s), "image.hdr_malformed", second_line.c_str()},
        {second("\1\2\0\x08\x88\x80"s), "image.hdr_malformed", second_line.c_str()},
        {second("\2\2\0\x09\x88\x80"s), "image.hdr_malformed", second_line.c_str()},
        {second("\2\2\0\x08"s), "image.hdr_malformed", in_second_line.c_str()},
        {second("\2\2\0\x08\x88"s), "image.hdr_malformed", in_second_line.c_str()},
        {second("\2\2\0\x08\x89\x80"s), "image.hdr_malformed", in_second_line.c_str()},
        {second("\2\2\0\x08\0\x80"s), "image.hdr_malformed", in_second_line.c_str()},
        {second("\2\2\0\x08\x09"s + std::string(40, 'x')), "image.hdr_malformed", in_second_line.c_str()},
        {second("\2\2\0\x08\4xxx"s), "image.hdr_malformed", in_second_line.c_str()},
        {second(scan_line.substr(0, 11)), "image.hdr_malformed", "channel 3 of scan line 1"},
        {second("\2\2\0\x08\x80"s + std::string(40, 'x')), "image.hdr_malformed", in_second_line.c_str()},
    };
    expectErrors(cases, readHdr);
}

TEST(Malformed, Exr) {
    const auto window = [](int32_t x0, int32_t y0, int32_t x1, int32_t y1) {
        return exr([&](ExrParts& parts) { parts.window = u32(x0) + u32(y0) + u32(x1) + u32(y1); });
    };
    const auto channels = [](const std::string& list) { return exr([&](ExrParts& parts) { parts.channels = list; }); };
    const auto more = [](const std::string& attributes) {
        return exr([&](ExrParts& parts) { parts.more = attributes; });
    };
    const auto version = [](const std::string& bytes) { return exr([&](ExrParts& parts) { parts.version = bytes; }); };
    const auto tiled = [](uint32_t width, uint32_t height) {
        return exr([&](ExrParts& parts) {
            parts.version[5] = 2;
            parts.more = ExrParts::tiles(width, height);
        });
    };
    const auto data = [](const std::string& bytes) { return exr([&](ExrParts& parts) { parts.data = bytes; }); };
    const auto size = static_cast<uint32_t>(ExrParts().header().size());
    const std::string offsets = u32(size + 16, 8) + u32(size + 32, 8);
    const std::string line = u32(0) + u32(8) + "12345678";
    // The same first block with other contents. Of compressions for more than a line both lines are in it.
    const auto packed = [](int compression, const std::string& bytes) {
        return exr([&](ExrParts& parts) {
            parts.compression = static_cast<char>(compression);
            const uint64_t at = parts.header().size();
            const std::string block = u32(0) + u32(bytes.size()) + bytes;
            parts.data = compression < 3
                             ? u32(at + 16, 8) + u32(at + 16 + block.size(), 8) + block + u32(1) + u32(8) + "12345678"
                             : u32(at + 8, 8) + block + std::string(16, '\0');
        });
    };
    const auto channel = [](const char* name, uint32_t type = 1, uint32_t sampling = 1) {
        return ExrParts::channel(name, type, sampling);
    };
    const Case cases[] = {
        {"", "image.exr_malformed", "byte 0"},
        {"\x76\x2f\x31\x01", "image.exr_malformed", "byte 0"},
        {version("\x76\x2f\x31\x02\2\0\0\0"s), "image.exr_malformed", "byte 0"},
        {version("\x76\x2f\x31\x01\3\0\0\0"s), "image.exr_unsupported", "version is 3"},
        {version("\x76\x2f\x31\x01\2\x08\0\0"s), "image.exr_unsupported", "deep"},
        {version("\x76\x2f\x31\x01\2\x10\0\0"s), "image.exr_unsupported", "several parts"},
        {version("\x76\x2f\x31\x01\2\2\0\0"s), "image.exr_malformed", "'tiles'"},
        {ExrParts().header().substr(0, 8), "image.exr_malformed", "byte 8"},
        {ExrParts().header().substr(0, 12), "image.exr_malformed", "byte 8"},
        {ExrParts().header().substr(0, 20), "image.exr_malformed", "byte 17"},
        {ExrParts().header().substr(0, 26), "image.exr_malformed", "byte 24"},
        {ExrParts().header().substr(0, 40), "image.exr_malformed", "byte 28"},
        {ExrParts().header().substr(0, size - 1), "image.exr_malformed", "byte"},
        {replaced(ExrParts().file(), "channels", "chanells"), "image.exr_malformed", "no attribute 'channels'"},
        {replaced(ExrParts().file(), "dataWindow", "dataWidnow"), "image.exr_malformed", "no attribute 'dataWindow'"},
        {replaced(ExrParts().file(), "compression", "impressions"), "image.exr_malformed",
         "no attribute 'compression'"},
        {replaced(ExrParts().file(), "box2i", "box2f"), "image.exr_malformed", "'dataWindow' is a box2f"},
        {replaced(ExrParts().file(), "v2f", "v3f"), "image.exr_malformed", "'screenWindowCenter' is a v3f"},
        {more(ExrParts::attribute("lineOrder", "lineOrder", "\0"s)), "image.exr_malformed", "'lineOrder' stands"},
        {more(ExrParts::attribute(std::string(300, 'n'), "float", "0123")), "image.exr_malformed", "255 letters"},
        {more("x\0\0"s + u32(0)), "image.exr_malformed", "type of attribute 'x'"},
        {more("x\0string\0"s + u32(0x7fffffff)), "image.exr_malformed", "'x' has 2147483647 bytes"},
        {more("x\0string\0"s + u32(0xffffffff)), "image.exr_malformed", "'x' has 4294967295 bytes"},
        {window(0, 0, -1, 1), "image.exr_malformed", "(0, 0) to (-1, 1)"},
        {window(5, 5, 4, 9), "image.exr_malformed", "(5, 5) to (4, 9)"},
        {window(INT32_MIN, 0, INT32_MAX, 1), "image.exr_malformed", "to (2147483647, 1)"},
        {window(-0x3fffffff, 0, 0x3fffffff, 0), "image.exr_malformed", "(1073741823, 0)"},
        {window(0, 0, 0x3ffffffe, 0), "image.too_large", "1073741823x1"},
        {window(0, 0, 3, 0x3ffffffe), "image.exr_malformed", "1073741823 blocks"},
        {window(0, 0, 3, 2), "image.exr_malformed", "EXR file"},
        {window(0, 0, 4, 1), "image.exr_malformed", "EXR file"},
        {channels(""), "image.exr_unsupported", "channels ''"},
        {channels(channel("a") + channel("b")), "image.exr_unsupported", "'a, b'"},
        {channels(channel("BY") + channel("RY") + channel("Y")), "image.exr_unsupported", "chroma"},
        {channels(channel("R", 0)), "image.exr_unsupported", "'R' holds integers"},
        {channels(channel("R", 3)), "image.exr_malformed", "channel 'R' has the type 3"},
        {channels(channel("R", 1, 2)), "image.exr_unsupported", "'R' is subsampled"},
        {channels(channel("R", 1, 0)), "image.exr_unsupported", "'R' is subsampled"},
        {channels(channel("R") + channel("R")), "image.exr_malformed", "'R' stands behind 'R'"},
        {channels(channel("R") + channel("G")), "image.exr_malformed", "'G' stands behind 'R'"},
        {channels("R"), "image.exr_malformed", "channel 'R' has no end"},
        {channels("R\0abc"s), "image.exr_malformed", "channel 'R' has no end"},
        {channels(channel("R") + "\0\0"s), "image.exr_malformed", "ends 2 bytes early"},
        {exr([](ExrParts& parts) { parts.compression = "\x0a"; }), "image.exr_malformed", "compression 10"},
        {exr([](ExrParts& parts) { parts.compression = "\xff"; }), "image.exr_malformed", "compression 255"},
        {tiled(0, 4), "image.exr_malformed", "0x4"},
        {tiled(4, 0xffffffff), "image.exr_malformed", "4x4294967295"},
        {tiled(0x3fffffff, 0x3fffffff), "image.too_large", "block of"},
        {tiled(1, 1), "image.exr_malformed", "8 blocks"},
        {data("x"), "image.exr_malformed", "2 blocks"},
        {data(offsets + line), "image.exr_malformed", "EXR file"},
        {data(offsets + line + line), "image.exr_malformed", "EXR file"},
        {data(u32(0, 8) + u32(0, 8) + line + u32(7) + u32(8) + "12345678"), "image.exr_malformed", "EXR file"},
        {data(offsets + u32(0) + u32(9) + "12345678" + line), "image.exr_malformed", "EXR file"},
        {data(offsets + u32(0) + u32(0xffffffff) + "12345678" + line), "image.exr_malformed", "EXR file"},
        {data(offsets + u32(0) + u32(0) + "12345678" + line), "image.exr_malformed", "block 0 of 2 has 0 bytes for 8"},
        {data(offsets + u32(1) + u32(8) + "12345678" + line), "image.exr_malformed", "block 0 of 2"},
        {data(u32(9, 8) + u32(size + 16, 8) + line + line), "image.exr_malformed", "block 0 of 2 lies at byte 9"},
        // Runs that unpack to 7 and to 9 of 8 bytes and one that is cut; no stream; too few bytes as they are.
        {packed(1, "\6\0"s), "image.exr_malformed", "does not unpack to 8 bytes"},
        {packed(1, "\x08\0"s), "image.exr_malformed", "does not unpack to 8 bytes"},
        {packed(1, "\xfe\0"s), "image.exr_malformed", "does not unpack to 8 bytes"},
        {packed(2, "\x78\x9c\1\2\3"s), "image.exr_malformed", "does not unpack to 8 bytes"},
        {packed(0, "1234567"), "image.exr_malformed", "does not unpack to 8 bytes"},
        {packed(4, ""), "image.exr_malformed", "block 0 of 1 has 0 bytes for 16"},
        {packed(9, "abc"), "image.exr_malformed", "EXR file"},
        {data(u32(~0ull, 8) + u32(~0ull, 8) + line.substr(0, 15)), "image.exr_malformed", "EXR file"},
    };
    expectErrors(cases, readExr);
}

// A stream that is in order but too short: OpenEXR would fill the rest with what its memory held before.
TEST(Malformed, ExrBlocksThatUnpackShort) {
    const Image image = Image::create(FormatRf32, 64, 16).value();
    const std::string good = textOf(encodeExr(image).value());
    const size_t shorter = 64 * 16 * 4 - 1;
    std::vector<Bytef> stream(compressBound(shorter));
    // Zeros, as differences from the byte before, to which 128 is added.
    std::vector<Bytef> differences(shorter + 2, 128);
    differences[0] = 0;
    for (const size_t size : {shorter, shorter + 1, shorter + 2}) {
        uLongf length = stream.size();
        ASSERT_EQ(compress(stream.data(), &length, differences.data(), size), Z_OK);
        // One block: its offset is the last thing before it.
        size_t table = 0;
        for (size_t at = 8; at + 8 < good.size() && table == 0; at++)
            if (good.substr(at, 8) == u32(at + 8, 8)) table = at;
        ASSERT_NE(table, 0u);
        const std::string file = good.substr(0, table + 8) + u32(0) + u32(length) +
                                 std::string(reinterpret_cast<const char*>(stream.data()), length);
        if (size == shorter + 1)
            EXPECT_EQ(readExr(file).value(), image);
        else
            EXPECT_THAT(readExr(file), HasErrorId("image.exr_malformed")) << size;
    }
}

TEST(Malformed, EveryTruncation) {
    setLogCallback([](LogLevel, std::string_view, std::string_view) {});
    Mesh mesh = readPly(ascii).value();
    mesh.createNormals();
    const std::string strips = "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty char x\nproperty char y\n"
                               "property char z\nelement tristrips 1\nproperty list char char vertex_indices\n"
                               "end_header\n"s +
                               "\0\0\0\0\1\0\0\0\1\3\0\1\2"s;
    const auto every = [](const std::string& file, const auto& read, auto expect) {
        ASSERT_THAT(read(file), IsOk());
        for (size_t size = 0; size < file.size(); size++) expect(read(file.substr(0, size)), size);
    };
    const auto expectError = [](const auto& result, size_t size) { EXPECT_FALSE(result.has_value()) << size; };
    every(textOf(encodePly(mesh).value()), readPly, expectError);
    every(strips, readPly, expectError);
    for (const Format format : {FormatRGBAf32, FormatRf16}) {
        every(textOf(encodeExr(gradient(format, 9, 40)).value()), readExr, expectError);
        every(textOf(encodeHdr(gradient(format, 9, 7)).value()), readHdr, expectError);
        every(textOf(encodeHdr(gradient(format, 5, 7)).value()), readHdr, expectError);
    }
    every(ExrParts().file(), readExr, expectError);
    every(png(), readPng, expectError);
    // A text may be cut where it still makes sense.
    const auto expectErrorOrMesh = [](const Expected<Mesh>& result, size_t size) {
        if (result) { EXPECT_THAT(result->validate(), IsOk()) << size; }
    };
    every(ascii, readPly, expectErrorOrMesh);
    every("o a\nv 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 1e-3\nvt 0 0\nvn 0 0 1\ng b\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -1//-1 "
          "-2//-1 -3//-1\n",
          readObj, expectErrorOrMesh);
    setLogCallback({});
}

// What each reader promises to take: `limit` for the result, and beside it what its declaration says. The slack is for
// the allocator's pages and the libraries' own tables.
TEST(Malformed, MemoryStaysWithinItsLimits) {
    constexpr uint64_t slack = 6 << 20;
    const auto expectPeak = [&](const char* what, uint64_t allowed, const std::function<void()>& run) {
        const uint64_t peak = peakMemory(run);
        EXPECT_LE(peak, allowed + slack) << what;
    };
    const Image image = gradient(FormatRGBAf32, 1200, 1000);
    const uint64_t size = image.bytes().size();
    const std::vector<std::byte> exr_file = encodeExr(image).value();
    const std::vector<std::byte> hdr_file = encodeHdr(image).value();
    expectPeak("EXR", size, [&] { EXPECT_THAT(decodeExr(exr_file, size), IsOk()); });
    expectPeak("EXR", 0, [&] { EXPECT_THAT(decodeExr(exr_file, size - 1), HasErrorId("image.too_large")); });
    expectPeak("HDR", 2 * size, [&] { EXPECT_THAT(decodeHdr(hdr_file, size), IsOk()); });
    expectPeak("HDR", 0, [&] { EXPECT_THAT(decodeHdr(hdr_file, size - 1), HasErrorId("image.too_large")); });
    const Image small = gradient(FormatRGBAu8n, 2400, 2000);
    const std::vector<std::byte> png_file = encodePng(small).value();
    expectPeak("PNG", small.bytes().size(), [&] { EXPECT_THAT(decodePng(png_file), IsOk()); });
    expectPeak("PNG", 0, [&] { EXPECT_THAT(decodePng(png_file, 100000), HasErrorId("image.too_large")); });

    // Quadrilaterals, whose second triangles come unannounced.
    constexpr uint32_t count = 300000;
    std::string quads = "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty char x\nproperty char y\n"
                        "property char z\nelement face 300000\nproperty list char char vertex_indices\nend_header\n"s +
                        "\0\0\0\1\0\0\1\1\0\0\1\0"s;
    for (uint32_t i = 0; i < count; i++) quads += "\4\0\1\2\3"s;
    const uint64_t mesh_size = 4 * 32 + count * 6 * sizeof(uint32_t);
    expectPeak("PLY", 2 * mesh_size, [&] { EXPECT_THAT(parsePly(bytesOf(quads), "test.ply", mesh_size), IsOk()); });
    expectPeak("PLY", 2 * mesh_size,
               [&] { EXPECT_THAT(parsePly(bytesOf(quads), "test.ply", mesh_size - 1), HasErrorId("mesh.too_large")); });
    std::string text = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
    for (int i = 0; i < 20000; i++) text += "f 1 2 3\n";
    expectPeak("OBJ", 128 * text.size() + 20000 * 12,
               [&] { EXPECT_THAT(parseObj(text, "test.obj", 20000 * 12 + 96), IsOk()); });

    // Claims of hundreds of megabytes by files of some hundred bytes, none beyond its limit.
    constexpr uint64_t limit = 1 << 30;
    const auto claim = [&](uint32_t compression, uint32_t side) {
        return exr([&](ExrParts& parts) {
            parts.compression = static_cast<char>(compression);
            parts.window = u32(0) + u32(0) + u32(side - 1) + u32(side - 1);
        });
    };
    for (uint32_t compression = 0; compression < 10; compression++)
        expectPeak("EXR", 0, [&] {
            EXPECT_THAT(decodeExr(bytesOf(claim(compression, 8192)), limit), HasErrorId("image.exr_malformed"));
        });
    expectPeak("HDR", 0, [&] {
        EXPECT_THAT(decodeHdr(bytesOf(hdr("-Y 8000 +X 8000", scan_line)), limit), HasErrorId("image.hdr_malformed"));
    });
}
