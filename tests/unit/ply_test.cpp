#include "support/allocations.h"
#include "support/files.h"
#include "support/matchers.h"
#include "support/reference.h"

#include <glint/base/file.h>
#include <glint/format/mesh.h>
#include <glint/format/ply.h>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

using namespace glint;
using namespace glint::test;

namespace {

std::span<const std::byte> bytesOf(std::string_view text) { return std::as_bytes(std::span(text)); }

Expected<Mesh> parse(std::string_view text, uint64_t limit = Mesh::default_limit) {
    return parsePly(bytesOf(text), "test.ply", limit);
}

const std::string triangle = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                             "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
                             "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

/// A value as a binary file has it.
template <class T>
void append(std::string& file, double value, bool is_big) {
    const auto typed = static_cast<T>(value);
    std::string bytes(sizeof(T), '\0');
    std::memcpy(bytes.data(), &typed, sizeof(T));
    if (is_big) std::reverse(bytes.begin(), bytes.end());
    file += bytes;
}

using Append = void (*)(std::string&, double, bool);
struct Type {
    const char* name;
    Append append;
};
const Type types[] = {{"char", append<int8_t>},     {"uint8", append<uint8_t>}, {"short", append<int16_t>},
                      {"uint16", append<uint16_t>}, {"int", append<int32_t>},   {"uint32", append<uint32_t>},
                      {"float", append<float>},     {"float64", append<double>}};

}  // namespace

TEST(Ply, Triangle) {
    const Expected<Mesh> mesh = parse(triangle);
    ASSERT_THAT(mesh, IsOk());
    EXPECT_EQ(mesh->positions, (std::vector<Vector3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(mesh->indices, (std::vector<uint32_t>{0, 1, 2}));
    EXPECT_TRUE(mesh->normals.empty() && mesh->texcoords.empty() && mesh->parts.empty());
    EXPECT_THAT(mesh->validate(), IsOk());
}

// Two vertices' records hold every type in turn for every property, in a shuffled order and among others; the values
// are small integers, which every type holds.
TEST(Ply, EveryTypeInEveryOrderAndEncoding) {
    const std::vector<std::string> names = {"x", "y", "z", "nx", "ny", "nz", "s", "t", "quality", "red"};
    Random random(1);
    for (int run = 0; run < 400; run++) {
        const int encoding = run % 3;  // ASCII, little-endian, big-endian
        const bool is_big = encoding == 2;
        std::vector<size_t> order(names.size());
        for (size_t i = 0; i < order.size(); i++) order[i] = i;
        for (size_t i = order.size() - 1; i > 0; i--) std::swap(order[i], order[random.below(i + 1)]);
        const size_t list_at = random.below(12);  // beyond the last: no list
        const Type& index_type = types[random.below(8)];
        const Type& length_type = types[random.below(6)];
        std::vector<const Type*> chosen;
        for (size_t i = 0; i < names.size(); i++) chosen.push_back(&types[random.below(8)]);

        std::string text = fmt::format(
            "ply\nformat {} 1.0\ncomment a b c\nelement camera 2\nproperty list short float vertex_indices\n"
            "element vertex 3\n",
            std::array{"ascii", "binary_little_endian", "binary_big_endian"}[static_cast<size_t>(encoding)]);
        for (size_t i = 0; i < names.size(); i++) {
            if (i == list_at) text += "property list uint8 double more\n";
            text += fmt::format("property {} {}\n", chosen[order[i]]->name, names[order[i]]);
        }
        text += fmt::format("obj_info x\nelement face 1\nproperty int material\nproperty list {} {} vertex_{}\n"
                            "property list uint ushort texcoord\nelement empty 1000000000000\nend_header\n",
                            length_type.name, index_type.name, run % 2 ? "index" : "indices");
        const auto value = [&](double number, const Type& type) {
            if (encoding == 0)
                text += fmt::format("{}{}", number, random.below(2) ? " " : "\r\n");
            else
                type.append(text, number, is_big);
        };
        const Type& u8 = types[1];
        value(1, types[2]), value(0.5, types[6]);
        value(0, types[2]);
        std::vector<Vector3f> positions(3), normals(3);
        std::vector<Vector2f> texcoords(3);
        for (size_t record = 0; record < 3; record++)
            for (size_t i = 0; i < names.size(); i++) {
                if (i == list_at) { value(2, u8), value(1e300, types[7]), value(-3, types[7]); }
                const auto number = static_cast<float>(1 + random.below(100));
                const int what = static_cast<int>(order[i]);
                if (what < 3) positions[record][what] = number;
                if (what >= 3 && what < 6) normals[record][what - 3] = number;
                if (what >= 6 && what < 8) texcoords[record][what - 6] = number;
                value(number, *chosen[order[i]]);
            }
        value(7, types[4]);
        value(3, length_type);
        for (const int corner : {2, 0, 1}) value(corner, index_type);
        value(1, types[5]), value(9, types[3]);

        const Expected<Mesh> mesh = parse(text);
        ASSERT_THAT(mesh, IsOk()) << text;
        EXPECT_EQ(mesh->positions, positions);
        EXPECT_EQ(mesh->texcoords, texcoords);
        EXPECT_EQ(mesh->indices, (std::vector<uint32_t>{2, 0, 1}));
        ASSERT_EQ(mesh->normals.size(), 3u);
        for (size_t i = 0; i < 3; i++) {
            // Normalised in float64 and rounded once.
            const Vector3d unit =
                Vector3d(normals[i]) / std::sqrt(glm::dot(Vector3d(normals[i]), Vector3d(normals[i])));
            for (int k = 0; k < 3; k++) EXPECT_LE(ulpDistance(mesh->normals[i][k], static_cast<float>(unit[k])), 1u);
        }
    }
}

TEST(Ply, LineEndsOfTheHeader) {
    for (const std::string end : {"\n", "\r\n", "\r"}) {
        std::string text = "ply|format binary_big_endian 1.0|element vertex 1|property char x|property char y|"
                           "property char z|element face 1|property list uchar uchar vertex_indices|end_header|";
        for (size_t at = text.find('|'); at != std::string::npos; at = text.find('|')) text.replace(at, 1, end);
        // The first byte of the data looks like the rest of a line's end.
        const Expected<Mesh> mesh = parse(text + std::string("\n\r\n\3\0\0\0", 7));
        ASSERT_THAT(mesh, IsOk());
        EXPECT_EQ(mesh->positions[0], Vector3f(10, 13, 10));
    }
}

TEST(Ply, TextIsWords) {
    std::string text = triangle;
    text.replace(text.find("1 0 0\n0 1"), 9, "+1 -0.0\t\n 0e5 .0 1.");
    const Expected<Mesh> mesh = parse(text + "\n\nwhatever follows");
    ASSERT_THAT(mesh, IsOk());
    EXPECT_EQ(*mesh, parse(triangle).value());
    EXPECT_THAT(parse(triangle.substr(0, triangle.size() - 1)), IsOk()) << "the last line may end with the file";
}

TEST(Ply, NumbersAreRoundedToNearest) {
    // As text and as float64 a number is rounded to float64, then to float32: together at most 1/2 + 2^-30 ulp.
    Random random(2);
    for (int run = 0; run < 300; run++) {
        const double value = random.uniform(-10, 10) * std::pow(10.0, random.uniform(-40, 37));
        std::string text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                           "property double z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n";
        const Expected<Mesh> mesh = parse(text + fmt::format("{:.17g} {:.25e} {} 3 0 0 0", value, value, value));
        ASSERT_THAT(mesh, IsOk());
        for (int k = 0; k < 3; k++) EXPECT_EQ(mesh->positions[0][k], static_cast<float>(value)) << value;
    }
}

TEST(Ply, FacesMayStandBeforeVertices) {
    const Expected<Mesh> mesh =
        parse("ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int vertex_indices\nelement vertex 4\n"
              "property float x\nproperty float y\nproperty float z\nend_header\n"
              "4 0 1 2 3\n3 0 2 3\n0 0 0\n4 0 0\n5 1 0\n1 1 0\n");
    ASSERT_THAT(mesh, IsOk());
    EXPECT_EQ(mesh->indices, (std::vector<uint32_t>{1, 2, 3, 1, 3, 0, 0, 2, 3}));
}

TEST(Ply, PolygonsAreSplitAsStated) {
    const std::string vertices = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n"
                                 "property float z\nelement face 1\nproperty list int int vertex_indices\nend_header\n"
                                 "0 0 0  4 0 0  5 1 0  1 1 0  0.5 0.9 0  0 0.5 0\n";
    EXPECT_EQ(parse(vertices + "4 0 1 2 3").value().indices, (std::vector<uint32_t>{1, 2, 3, 1, 3, 0}));
    EXPECT_EQ(parse(vertices + "4 1 2 3 0").value().indices, (std::vector<uint32_t>{1, 2, 3, 1, 3, 0}));
    EXPECT_EQ(parse(vertices + "6 0 1 2 3 4 5").value().indices,
              (std::vector<uint32_t>{0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5}));
    // The same corners in OBJ, whose quadrilaterals go the same way.
    const Expected<Mesh> obj = parseObj("v 0 0 0\nv 4 0 0\nv 5 1 0\nv 1 1 0\nf 1 2 3 4", "test.obj");
    ASSERT_THAT(obj, IsOk());
    const Mesh ply = parse(vertices + "4 0 1 2 3").value();
    for (size_t i = 0; i < 6; i += 3) {
        Vector3f mean_obj(0.0f), mean_ply(0.0f);
        for (size_t k = i; k < i + 3; k++) {
            mean_obj += obj->positions[obj->indices[k]];
            mean_ply += ply.positions[ply.indices[(k + 3) % 6]];
        }
        EXPECT_EQ(mean_obj, mean_ply) << "triangle " << i / 3;
    }
}

TEST(Ply, TriangleStrips) {
    const Expected<Mesh> mesh =
        parse("ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
              "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
              "0 0 0 1 0 0 0 1 0 1 1 0 0 2 0 1 2 0\n13 0 1 2 3 4 -1 -1 5 4 -1 3 2 5");
    ASSERT_THAT(mesh, IsOk());
    EXPECT_EQ(mesh->indices, (std::vector<uint32_t>{0, 1, 2, 2, 1, 3, 2, 3, 4, 3, 2, 5}));
}

TEST(Ply, RoundTrip) {
    Random random(3);
    for (int run = 0; run < 8; run++) {
        Mesh mesh;
        const size_t count = 3 + random.below(300);
        for (size_t i = 0; i < count; i++) {
            mesh.positions.emplace_back(random.uniform(-1e30, 1e30), random.uniform(), -0.0f);
            if (run & 1) mesh.normals.push_back(random.below(2) ? Vector3f(0, 0, -1) : Vector3f(0.6f, -0.8f, 0));
            if (run & 2) mesh.texcoords.emplace_back(random.uniform(), random.uniform(-9, 9));
        }
        for (size_t i = 0; i < 3 * count; i++) mesh.indices.push_back(static_cast<uint32_t>(random.below(count)));
        const Expected<std::vector<std::byte>> file = encodePly(mesh);
        ASSERT_THAT(file, IsOk());
        const Expected<Mesh> read = parsePly(*file, "test.ply");
        ASSERT_THAT(read, IsOk());
        EXPECT_EQ(read->positions, mesh.positions);
        EXPECT_EQ(read->texcoords, mesh.texcoords);
        EXPECT_EQ(read->indices, mesh.indices);
        ASSERT_EQ(read->normals.size(), mesh.normals.size());
        for (size_t i = 0; i < mesh.normals.size(); i++)
            for (int k = 0; k < 3; k++) EXPECT_LE(ulpDistance(read->normals[i][k], mesh.normals[i][k]), 1u);
    }
    EXPECT_THAT(encodePly(Mesh()), HasErrorId("mesh.no_faces"));
    Mesh bad = parse(triangle).value();
    bad.indices[1] = 3;
    EXPECT_THAT(encodePly(bad), HasErrorId("mesh.index_range"));
}

TEST(Ply, Files) {
    const TempDir dir;
    const Mesh mesh = parse(triangle).value();
    ASSERT_THAT(mesh.save(dir / "a.PLY"), IsOk());
    const Expected<Mesh> read = Mesh::load(dir / "a.PLY");
    ASSERT_THAT(read, IsOk());
    EXPECT_EQ(*read, mesh);
    EXPECT_THAT(mesh.save(dir / "a.obj"), HasErrorId("mesh.unknown_extension"));
    EXPECT_THAT(mesh.save(dir / "absent/a.ply"), HasErrorId("file.create"));
    EXPECT_THAT(Mesh::load(dir / "b.ply"), HasErrorId("file.open"));
    EXPECT_THAT(Mesh::load(dir / "a.PLY", 10), HasErrorId("file.too_large"));
}

TEST(Ply, ErrorsNameThePlace) {
    std::string text = triangle;
    text.replace(text.rfind('2'), 1, "3");
    EXPECT_EQ(parse(text).error().text(), "test.ply:13: face 0: corner 2 names vertex 3 of 3 [mesh.index_range]");
    text = triangle;
    text.replace(text.find("1 0 0"), 5, "1 zero");
    EXPECT_EQ(parse(text).error().text(), "test.ply:11: vertex 1: property 'y' has 'zero' for a number [ply.value]");
    Mesh mesh = parse(triangle).value();
    std::vector<std::byte> bytes = encodePly(mesh).value();
    const size_t size = bytes.size();
    bytes[size - 1] = std::byte(0x80);
    const Expected<Mesh> negative = parsePly(bytes, "test.ply");
    ASSERT_THAT(negative, HasErrorId("mesh.index_range"));
    EXPECT_EQ(negative.error().message(),
              fmt::format("face 0, before byte {}: corner 2 names vertex {} of 3", size, -2147483646.0));
}

TEST(Ply, MemoryIsBounded) {
    // Three vertices of 32 bytes at most, and three indices.
    EXPECT_THAT(parse(triangle, 108), IsOk());
    EXPECT_THAT(parse(triangle, 107), HasErrorId("mesh.too_large"));
    EXPECT_THAT(parse(triangle, 95), HasErrorId("mesh.too_large"));
    EXPECT_THAT(parse(triangle, 0), HasErrorId("mesh.too_large"));

    // Counts are judged before they are believed: nothing is allocated for these but the header and the message.
    const uint64_t before = residentMemory();
    for (const char* count : {"4000000000", "18446744073709551615", "1000000000000"})
        for (const char* format : {"ascii", "binary_little_endian"})
            for (const char* element : {"vertex", "face"}) {
                std::string huge = triangle;
                huge.replace(huge.find("ascii"), 5, format);
                const size_t at = huge.find(element) + std::strlen(element) + 1;
                huge.replace(at, 1, count);
                const uint64_t made = allocations().made;
                EXPECT_THAT(parse(huge), HasErrorId("ply.truncated")) << huge;
                EXPECT_LT(allocations().made - made, 100u);
            }
    EXPECT_LT(residentMemory(), before + (1u << 20));
}

// One allocation for each array and a few for the header: none for a number, a vertex or a face.
TEST(Ply, NothingIsAllocatedForANumber) {
    Mesh mesh;
    for (uint32_t i = 0; i < 30000; i++) {
        mesh.positions.emplace_back(i, 1, 2);
        mesh.normals.emplace_back(0, 0, 1);
        mesh.texcoords.emplace_back(0, i);
        for (const uint32_t k : {0, 1, 2}) mesh.indices.push_back((i + k) % 30000);
    }
    const std::vector<std::byte> binary = encodePly(mesh).value();
    std::string text(reinterpret_cast<const char*>(binary.data()), binary.size());
    text.resize(text.find("end_header\n") + 11);
    text.replace(text.find("binary_little_endian"), 20, "ascii");
    for (size_t i = 0; i < mesh.positions.size(); i++) text += fmt::format("{} 1 2 0 0 1 0 {}\n", i, i);
    for (size_t i = 0; i < mesh.indices.size(); i += 3)
        text += fmt::format("3 {} {} {}\n", mesh.indices[i], mesh.indices[i + 1], mesh.indices[i + 2]);
    for (const std::span<const std::byte> file : {std::span<const std::byte>(binary), bytesOf(text)}) {
        const uint64_t before = allocations().made;
        const Expected<Mesh> read = parsePly(file, "test.ply");
        EXPECT_LT(allocations().made - before, 100u);
        ASSERT_THAT(read, IsOk());
        EXPECT_EQ(*read, mesh);
    }
}

TEST(PlyHeader, NamesTypesAndPlaces) {
    const std::string text = "ply\nformat binary_little_endian 1.0\ncomment splats\nelement vertex 2\n"
                             "property float x\nproperty uchar red\nproperty double f_dc_0\nelement face 0\n"
                             "property list ushort int vertex_indices\nproperty short last\nend_header\n";
    const Expected<PlyHeader> header = parsePlyHeader(bytesOf(text + std::string(26, '\1')), "test.ply");
    ASSERT_THAT(header, IsOk());
    EXPECT_EQ(header->encoding, PlyEncoding::LittleEndian);
    EXPECT_EQ(header->size, text.size());
    ASSERT_EQ(header->elements.size(), 2u);
    const PlyElement* vertex = header->find("vertex");
    ASSERT_EQ(vertex, &header->elements[0]);
    EXPECT_EQ(vertex->count, 2u);
    EXPECT_EQ(vertex->stride, 13u);
    EXPECT_FALSE(vertex->has_list);
    ASSERT_NE(vertex->find("f_dc_0"), nullptr);
    EXPECT_EQ(*vertex->find("f_dc_0"), (PlyProperty{.name = "f_dc_0", .type = PlyType::Float64, .offset = 5}));
    EXPECT_EQ(vertex->find("f_rest_0"), nullptr);
    EXPECT_EQ(header->find("splat"), nullptr);
    const PlyElement& face = header->elements[1];
    EXPECT_TRUE(face.has_list);
    EXPECT_EQ(face.stride, 4u);
    EXPECT_EQ(face.properties[0].count_type, PlyType::Uint16);
    EXPECT_EQ(face.properties[1].offset, 2u);
}

TEST(PlyReader, ColumnsByName) {
    std::string text = "ply\nformat binary_big_endian 1.0\nelement vertex 1000\nproperty float opacity\n"
                       "property short scale\nelement more 2\nproperty list char char values\nend_header\n";
    for (int i = 0; i < 1000; i++) {
        append<float>(text, i * 0.5, true);
        append<int16_t>(text, -i, true);
    }
    for (const double value : {2, 10, 20, 0}) append<int8_t>(text, value, true);
    const PlyHeader header = parsePlyHeader(bytesOf(text), "test.ply").value();
    const std::string name = "test.ply";
    PlyReader reader(bytesOf(text), header, name);
    const PlyElement& vertex = header.elements[0];
    std::vector<Vector2f> values(1000);
    const PlyReader::Column columns[] = {{vertex.find("scale"), &values[0].x, 2},
                                         {vertex.find("opacity"), &values[0].y, 2}};
    ASSERT_THAT(reader.readColumns(vertex, columns), IsOk());
    for (int i = 0; i < 1000; i++) ASSERT_EQ(values[static_cast<size_t>(i)], Vector2f(-i, i * 0.5));
    std::vector<std::vector<double>> lists;
    const auto visit = [&](uint64_t, std::span<const double> list) -> Status {
        lists.emplace_back(list.begin(), list.end());
        return {};
    };
    ASSERT_THAT(reader.readLists(header.elements[1], header.elements[1].properties[0], visit), IsOk());
    EXPECT_EQ(lists, (std::vector<std::vector<double>>{{10, 20}, {}}));
    EXPECT_EQ(reader.position(), text.size());
}

TEST(Ply, StanfordBunnyRoundTrips) {
    GLINT_NEED_BUNNY();
    const std::filesystem::path path = bunnyPath();
    Mesh mesh = Mesh::load(path).value();
    const Expected<Mesh> read = parsePly(encodePly(mesh).value(), "bunny.ply");
    ASSERT_THAT(read, IsOk());
    mesh.parts.clear();
    EXPECT_EQ(*read, mesh);
}
