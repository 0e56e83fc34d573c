#include "support/files.h"
#include "support/matchers.h"
#include "support/reference.h"

#include <glint/base/file.h>
#include <glint/format/npy.h>

#include <gtest/gtest.h>

#include <sys/resource.h>

#include <csignal>
#include <cstring>
#include <filesystem>

using namespace glint;
using namespace glint::test;

namespace {

using Bytes = std::vector<std::byte>;
using Kind = NpyField::Kind;

Bytes bytesOf(std::string_view text) {
    const auto bytes = std::as_bytes(std::span(text));
    return {bytes.begin(), bytes.end()};
}

/// A file with this header's text, as NumPy would frame it but for the padding.
Bytes makeFile(std::string_view header, std::string_view data = {}, int major = 1, int minor = 0) {
    std::string file("\x93NUMPY");
    file += static_cast<char>(major);
    file += static_cast<char>(minor);
    for (int i = 0; i < (major == 1 ? 2 : 4); i++) file += static_cast<char>(header.size() >> 8 * i);
    file += header;
    file += data;
    return bytesOf(file);
}

std::string dictionary(std::string_view type, std::string_view shape, std::string_view fortran = "False") {
    return "{'descr': " + std::string(type) + ", 'fortran_order': " + std::string(fortran) +
           ", 'shape': " + std::string(shape) + ", }\n";
}

struct Malformed {
    const char* name;
    const char* id;
    Bytes bytes;
};

std::vector<Malformed> malformedFiles() {
    const auto typed = [](std::string_view type) { return makeFile(dictionary(type, "(1,)"), "01234567"); };
    const auto shaped = [](std::string_view shape) { return makeFile(dictionary("'|u1'", shape), "a"); };
    std::string many = "[";
    for (int i = 0; i < 1025; i++) many += "('f" + std::to_string(i) + "', '<f4'), ";
    const Bytes good = makeFile(dictionary("'<f4'", "(2,)"), "01234567");
    return {
        {"empty", "npy.magic", {}},
        {"other file", "npy.magic", bytesOf("\x89PNG\r\n\x1a\nxxxxxxxx")},
        {"magic cut", "npy.magic", bytesOf("\x93NUM")},
        {"ends after magic", "npy.truncated", bytesOf("\x93NUMPY")},
        {"ends in length", "npy.truncated", bytesOf(std::string_view("\x93NUMPY\1\0\x10", 9))},
        {"ends in long length", "npy.truncated", bytesOf(std::string_view("\x93NUMPY\2\0\x10\0", 10))},
        {"version 0", "npy.version", makeFile(dictionary("'|u1'", "(1,)"), "a", 0)},
        {"version 4", "npy.version", makeFile(dictionary("'|u1'", "(1,)"), "a", 4)},
        {"version 1.1", "npy.version", makeFile(dictionary("'|u1'", "(1,)"), "a", 1, 1)},
        {"header of 4 GiB", "npy.header", bytesOf(std::string_view("\x93NUMPY\2\0\xff\xff\xff\xff", 12))},
        {"header beyond the end", "npy.truncated", bytesOf(std::string_view("\x93NUMPY\1\0\xff\xff{", 11))},
        {"no header", "npy.header", makeFile("")},
        {"no dictionary", "npy.header", makeFile("(1, 2)\n")},
        {"open dictionary", "npy.header", makeFile("{'descr': '<f4', ")},
        {"open string", "npy.header", makeFile("{'descr: '<f4\n")},
        {"no colon", "npy.header", makeFile("{'descr' '<f4'}")},
        {"no comma", "npy.header", makeFile("{'descr': '<f4' 'shape': ()}")},
        {"a word", "npy.header", makeFile("{'descr': float32}")},
        {"a null", "npy.header", makeFile(std::string_view("{'descr': \0}", 12))},
        {"a lone minus", "npy.header", makeFile(dictionary("'<f4'", "(-,)"))},
        {"text after", "npy.header", makeFile("{'descr': '<f4', 'fortran_order': False, 'shape': ()} x", "0123")},
        {"brackets without end", "npy.header", makeFile(std::string(60000, '['))},
        {"no shape", "npy.header", makeFile("{'descr': '<f4', 'fortran_order': False}", "0123")},
        {"no order", "npy.header", makeFile("{'descr': '<f4', 'shape': ()}", "0123")},
        {"no type", "npy.header", makeFile("{'fortran_order': False, 'shape': ()}", "0123")},
        {"a key twice", "npy.header",
         makeFile("{'descr': '<f4', 'descr': '<f4', 'fortran_order': False, 'shape': ()}")},
        {"a key too many", "npy.header", makeFile("{'descr': '<f4', 'x': 1, 'fortran_order': False, 'shape': ()}")},
        {"a number as key", "npy.header", makeFile("{1: '<f4', 'fortran_order': False, 'shape': ()}")},
        {"order is a number", "npy.header", makeFile(dictionary("'<f4'", "()", "1"), "0123")},
        {"bad escape", "npy.header", makeFile(dictionary("'\\q'", "()"))},
        {"cut escape", "npy.header", makeFile(dictionary("[('\\xg1', '<f4')]", "()"))},
        {"escape at the end", "npy.header", makeFile("{'\\")},
        {"complex", "npy.type", typed("'<c8'")},
        {"text", "npy.type", typed("'<U2'")},
        {"object", "npy.type", typed("'|O'")},
        {"date", "npy.type", typed("'<M8[s]'")},
        {"int of 3 bytes", "npy.type", typed("'<i3'")},
        {"float of 1 byte", "npy.type", typed("'|f1'")},
        {"float of 16 bytes", "npy.type", typed("'<f16'")},
        {"bool of 2 bytes", "npy.type", typed("'<b2'")},
        {"huge size", "npy.type", typed("'<f99999999999'")},
        {"no size", "npy.type", typed("'<f'")},
        {"no order", "npy.type", typed("'f4'")},
        {"type is a number", "npy.type", typed("4")},
        {"raw bytes", "npy.type", typed("'|V8'")},
        {"no fields", "npy.type", typed("[]")},
        {"padding only", "npy.type", typed("[('', '|V4')]")},
        {"field is no tuple", "npy.type", typed("['<f4']")},
        {"field without type", "npy.type", typed("[('a',)]")},
        {"field with title", "npy.type", typed("[(('t', 'a'), '<f4')]")},
        {"field without name", "npy.type", typed("[('', '<f4'), ('b', '<f4')]")},
        {"lone field without name", "npy.type", typed("[('', '<f4')]")},
        {"two of one name", "npy.type", typed("[('a', '<f4'), ('a', '<f4')]")},
        {"nested structure", "npy.type", typed("[('a', [('b', '<f4')])]")},
        {"matrix field", "npy.type", typed("[('a', '<f4', (2, 2))]")},
        {"empty run", "npy.type", typed("[('a', '<f4', (0,))]")},
        {"too many fields", "npy.type", typed(many + "]")},
        {"element too large", "npy.type", typed("[('a', '<f8', (60000,))]")},
        {"shape is a number", "npy.shape", shaped("(1)")},
        {"shape is a list", "npy.shape", shaped("[1]")},
        {"negative dimension", "npy.shape", shaped("(-1,)")},
        {"dimension is text", "npy.shape", shaped("('1',)")},
        {"dimension of 2^64", "npy.shape", shaped("(18446744073709551616,)")},
        {"product overflows", "npy.shape", shaped("(4294967296, 4294967296)")},
        {"overflow behind a 0", "npy.shape", shaped("(0, 4294967296, 4294967296)")},
        {"33 dimensions", "npy.shape", shaped("(1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1)")},
        {"columns first", "npy.fortran_order", makeFile(dictionary("'|u1'", "(2, 2)", "True"), "abcd")},
        {"more than the limit", "npy.too_large", makeFile(dictionary("'<f4'", "(1099511627776,)"))},
        {"data cut", "npy.truncated", Bytes(good.begin(), good.end() - 1)},
        {"no data", "npy.truncated", makeFile(dictionary("'<f4'", "(2,)"))},
        {"bytes too many", "npy.trailing", makeFile(dictionary("'<f4'", "(1,)"), "01234")},
    };
}

NpyArray decode(const Bytes& bytes) {
    const Expected<NpyArray> array = decodeNpy(bytes);
    EXPECT_THAT(array, IsOk());
    return array ? *array : NpyArray();
}

template <class T>
void expectRoundTrip(const std::vector<T>& values, const char* type) {
    const NpyHeader header{{NpyField::of<T>()}, {values.size()}};
    const Expected<Bytes> file = encodeNpy(header, std::as_bytes(std::span(values)));
    ASSERT_THAT(file, IsOk());
    EXPECT_NE(std::string_view(reinterpret_cast<const char*>(file->data()), file->size()).find(type),
              std::string_view::npos)
        << type;
    const NpyArray array = decode(*file);
    EXPECT_EQ(array.header, header);
    const auto read = array.values<T>();
    EXPECT_EQ(std::vector<T>(read.begin(), read.end()), values);
}

/// The fields of `glint cast`'s hits, with a run to boot.
NpyHeader structure(uint64_t count) {
    return {{NpyField::of<float>("t"), NpyField::of<uint32_t>("primitive"), NpyField::of<float>("uv", 2),
             NpyField::of<bool>("front"), NpyField::padding(3)},
            {count}};
}

}  // namespace

TEST(Npy, EveryTypeRoundTrips) {
    expectRoundTrip<float>({0.0f, -1.5f, 3e38f}, "'<f4'");
    expectRoundTrip<double>({0.0, -1.5, 1e300}, "'<f8'");
    expectRoundTrip<int8_t>({-128, 127}, "'|i1'");
    expectRoundTrip<int16_t>({-32768, 32767}, "'<i2'");
    expectRoundTrip<int32_t>({INT32_MIN, 7}, "'<i4'");
    expectRoundTrip<int64_t>({INT64_MIN, 7}, "'<i8'");
    expectRoundTrip<uint8_t>({0, 255}, "'|u1'");
    expectRoundTrip<uint16_t>({0, 65535}, "'<u2'");
    expectRoundTrip<uint32_t>({0, UINT32_MAX}, "'<u4'");
    expectRoundTrip<uint64_t>({0, UINT64_MAX}, "'<u8'");
}

TEST(Npy, IsWhatNumPyWrites) {
    // numpy.save of numpy.arange(3, dtype='>i2').reshape(1, 3), byte for byte but for the length of the padding.
    const NpyArray array =
        decode(makeFile("{'descr': '>i2', 'fortran_order': False, 'shape': (1, 3), }                 \n",
                        std::string("\0\0\0\1\0\2", 6)));
    EXPECT_EQ(array.header.shape, (std::vector<uint64_t>{1, 3}));
    const auto values = array.values<int16_t>();
    EXPECT_EQ(std::vector<int16_t>(values.begin(), values.end()), (std::vector<int16_t>{0, 1, 2}));

    const uint8_t value = 'a';
    const Expected<Bytes> file = encodeNpy({{NpyField::of<uint8_t>()}, {1}}, std::as_bytes(std::span(&value, 1)));
    ASSERT_THAT(file, IsOk());
    const std::string text = "{'descr': '|u1', 'fortran_order': False, 'shape': (1,), }";
    Bytes expected = bytesOf(std::string_view("\x93NUMPY\1\0\x76\0", 10));
    for (const char c : text + std::string(117 - text.size(), ' ') + "\na") expected.push_back(std::byte(c));
    EXPECT_EQ(*file, expected);
}

TEST(Npy, BothByteOrdersInStructures) {
    const NpyArray array =
        decode(makeFile(dictionary("[('a', '>u4'), ('', '|V1'), ('b', '<u2', (2,)), ('c', '>f8')]", "()"),
                        std::string("\0\0\1\2x\1\0\2\0\x3f\xf0\0\0\0\0\0\0", 17)));
    ASSERT_EQ(array.data.size(), 17u);
    uint32_t a = 0;
    std::array<uint16_t, 2> b = {};
    double c = 0.0;
    std::memcpy(&a, array.data.data(), 4);
    std::memcpy(&b, array.data.data() + 5, 4);
    std::memcpy(&c, array.data.data() + 9, 8);
    EXPECT_EQ(a, 258u);
    EXPECT_EQ(b, (std::array<uint16_t, 2>{1, 2}));
    EXPECT_EQ(c, 1.0);
    EXPECT_EQ(describe(array.header), "{a: uint32, 1 bytes, b: uint16[2], c: float64} []");
}

TEST(Npy, EveryVersion) {
    const std::string header = dictionary("'<f4'", "(0, 8)");
    for (const int version : {1, 2, 3}) EXPECT_EQ(decode(makeFile(header, {}, version)).header.shape[1], 8u);
}

TEST(Npy, NamesOfAllKinds) {
    NpyHeader header = structure(1);
    header.fields[0].name = "it's \"a\" \\ name";
    header.fields[1].name = "\xc3\xb6\xe2\x82\xac";
    const Bytes data(header.elementSize());
    const Expected<Bytes> file = encodeNpy(header, data);
    ASSERT_THAT(file, IsOk());
    EXPECT_EQ((*file)[6], std::byte{3});  // UTF-8 needs version 3
    EXPECT_EQ(decode(*file).header, header);
    EXPECT_EQ(decode(makeFile(dictionary("[('\\u20ac\\xe9', '|u1')]", "()"), "a")).header.fields[0].name,
              "\xe2\x82\xac\xc3\xa9");

    header.fields.assign(700, {});
    for (size_t i = 0; i < header.fields.size(); i++) header.fields[i].name = std::string(100, 'n') + std::to_string(i);
    const Expected<Bytes> longer = encodeNpy(header, Bytes(header.elementSize()));
    ASSERT_THAT(longer, IsOk());
    EXPECT_EQ((*longer)[6], std::byte{2});  // more than 65,535 bytes
    EXPECT_EQ(decode(*longer).header, header);
}

TEST(Npy, ColumnsFirstOfOneColumn) {
    EXPECT_EQ(decode(makeFile(dictionary("'|u1'", "(1, 3, 1)", "True"), "abc")).header.shape.size(), 3u);
    EXPECT_EQ(decode(makeFile(dictionary("'|u1'", "(2, 3, 0)", "True"))).data.size(), 0u);
}

TEST(Npy, Malformed) {
    const TempDir dir;
    size_t cases = 0;
    for (const Malformed& file : malformedFiles()) {
        SCOPED_TRACE(file.name);
        EXPECT_THAT(decodeNpy(file.bytes, 1u << 20), HasErrorId(file.id));
        cases++;
        // Reading piece by piece says the same, but knows no limit.
        if (std::string_view(file.id) == "npy.too_large") continue;
        const auto path = dir / "file.npy";
        ASSERT_THAT(writeFile(path, file.bytes), IsOk());
        const Expected<NpyReader> reader = NpyReader::open(path);
        EXPECT_THAT(reader, HasErrorId(file.id));
        if (reader) continue;
        EXPECT_NE(reader.error().text().find("file.npy"), std::string::npos);
    }
    EXPECT_GE(cases, 60u);
}

TEST(Npy, TruncatedAnywhere) {
    const Expected<Bytes> file = encodeNpy(structure(3), Bytes(3 * structure(3).elementSize()));
    ASSERT_THAT(file, IsOk());
    ASSERT_THAT(decodeNpy(*file), IsOk());
    for (size_t size = 0; size < file->size(); size++)
        EXPECT_FALSE(decodeNpy(std::span(*file).first(size))) << "the first " << size << " bytes";
}

TEST(Npy, ErrorsNameTheByte) {
    const Bytes file = makeFile(dictionary("'<c8'", "(1,)"), "01234567");
    EXPECT_NE(decodeNpy(file).error().message().find("byte 20:"), std::string::npos)
        << decodeNpy(file).error().message();
}

TEST(Npy, WritingRefuses) {
    const Bytes data(24);
    EXPECT_THAT(encodeNpy({{}, {1}}, data), HasErrorId("npy.type"));
    EXPECT_THAT(encodeNpy({{NpyField::padding(4)}, {6}}, data), HasErrorId("npy.type"));
    EXPECT_THAT(encodeNpy({{{"", Kind::Float, 3, 1}}, {8}}, data), HasErrorId("npy.type"));
    EXPECT_THAT(encodeNpy({{{"", Kind::Float, 4, 2}}, {3}}, data), HasErrorId("npy.type"));
    EXPECT_THAT(encodeNpy({{{"a\n", Kind::Float, 4, 1}}, {6}}, data), HasErrorId("npy.type"));
    EXPECT_THAT(encodeNpy({{NpyField::of<float>()}, {1ull << 60, 8}}, data), HasErrorId("npy.shape"));
    EXPECT_THAT(encodeNpy({{NpyField::of<float>()}, {7}}, data), HasErrorId("npy.data_size"));
}

TEST(Npy, PieceByPiece) {
    const TempDir dir;
    const auto path = dir / "hits.npy";
    const NpyHeader header = structure(1000);
    Random random(1);
    Bytes data(1000 * header.elementSize());
    for (std::byte& byte : data) byte = static_cast<std::byte>(random.bits());

    Expected<NpyWriter> writer = NpyWriter::create(path, header);
    ASSERT_THAT(writer, IsOk());
    const std::span<const std::byte> all(data);
    ASSERT_THAT(writer->write(all.first(300 * header.elementSize())), IsOk());
    EXPECT_FALSE(std::filesystem::exists(path)) << "half a file has the final name";
    ASSERT_THAT(writer->write(all.subspan(300 * header.elementSize())), IsOk());
    EXPECT_THAT(writer->write(all.first(header.elementSize())), HasErrorId("npy.data_size"));
    ASSERT_THAT(writer->close(), IsOk());
    EXPECT_THAT(writer->close(), HasErrorId("npy.data_size"));
    EXPECT_EQ(decode(*readFile(path)), (NpyArray{header, data}));

    Expected<NpyReader> reader = NpyReader::open(path);
    ASSERT_THAT(reader, IsOk());
    Bytes read;
    while (reader->remaining() > 0) {
        // Not a whole number of elements: the rest stays for the next call.
        Bytes piece(7 * header.elementSize() + 3);
        const Expected<uint64_t> count = reader->read(piece);
        ASSERT_THAT(count, IsOk());
        EXPECT_EQ(*count, std::min<uint64_t>(7, (data.size() - read.size()) / header.elementSize()));
        read.insert(read.end(), piece.begin(),
                    piece.begin() + static_cast<std::ptrdiff_t>(*count * header.elementSize()));
    }
    EXPECT_EQ(read, data);
    EXPECT_EQ(*reader->read(read), 0u);
}

TEST(Npy, AWriterThatIsDroppedLeavesNothing) {
    const TempDir dir;
    {
        Expected<NpyWriter> writer = NpyWriter::create(dir / "a.npy", structure(10));
        ASSERT_THAT(writer, IsOk());
        EXPECT_FALSE(std::filesystem::is_empty(dir.path()));
        NpyWriter moved = std::move(*writer);
    }
    EXPECT_TRUE(std::filesystem::is_empty(dir.path()));
    Expected<NpyWriter> writer = NpyWriter::create(dir / "a.npy", structure(10));
    ASSERT_THAT(writer, IsOk());
    EXPECT_THAT(writer->close(), HasErrorId("npy.data_size"));
    EXPECT_TRUE(std::filesystem::is_empty(dir.path()));
}

// A limit on the size of files stands for a disk that is full: what does not fit is an error, and nothing is left.
TEST(Npy, ADiskThatIsFull) {
    const TempDir dir;
    rlimit before = {};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto old = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small = {100000, before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
    const NpyHeader header = {{NpyField::of<double>()}, {20000}};
    Expected<NpyWriter> writer = NpyWriter::create(dir / "a.npy", header);
    Status status = writer ? writer->write(Bytes(160000)) : writer.error();
    if (status) status = writer->close();
    // The last bytes reach the file when it is closed.
    Expected<NpyWriter> late = NpyWriter::create(dir / "b.npy", {{NpyField::of<uint8_t>()}, {100000}});
    Status late_status;
    for (int i = 0; i < 100000 && late && late_status; i++) late_status = late->write(Bytes(1));
    if (late && late_status) late_status = late->close();
    ::setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, old);
    EXPECT_THAT(status, HasErrorId("file.write"));
    EXPECT_THAT(late, IsOk());
    EXPECT_THAT(late_status, HasErrorId("file.write"));
    EXPECT_TRUE(std::filesystem::is_empty(dir.path()));
}

TEST(Npy, FilesThatCannotBe) {
    const TempDir dir;
    EXPECT_THAT(NpyReader::open(dir / "absent.npy"), HasErrorId("file.open"));
    EXPECT_THAT(NpyReader::open(dir.path()), HasErrorId("file.open"));
    EXPECT_THAT(NpyWriter::create(dir / "absent" / "a.npy", structure(1)), HasErrorId("file.create"));
    EXPECT_THAT(NpyWriter::create(dir.path(), structure(1)), HasErrorId("file.create"));
    EXPECT_THAT(NpyWriter::create("/dev/null", structure(1)), HasErrorId("file.create"));
    EXPECT_THAT(NpyWriter::create(dir / "a.npy", {}), HasErrorId("npy.type"));
}
