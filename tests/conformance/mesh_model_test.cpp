#include "conformance/conformance.h"
#include "support/reference.h"

#include <glint/format/image.h>
#include <glint/geometry/primitives.h>
#include <glint/graphics/mesh_model.h>

#include <cstring>
#include <tuple>

namespace glint::test {

namespace {

using Attribute = Pipeline::VertexAttribute;
using Bytes = std::vector<std::byte>;

/// Takes over what a model hands out, and says where it begins among the rest.
MeshModel::BufferCallback appendTo(Bytes& bytes, uint64_t& offset) {
    return [&](const void* src, size_t size) {
        offset = bytes.size();
        const auto* begin = static_cast<const std::byte*>(src);
        bytes.insert(bytes.end(), begin, begin + size);
        return true;
    };
}

/// A model whose bytes are kept here instead of in buffers.
struct Captured {
    MeshModel model;
    Bytes vertices, indices;

    template <class AnyMesh>
    Status create(const Device& device, const MeshModel::Layout& layout, const AnyMesh& mesh,
                  MeshModel::Flags flags = MeshModel::FlagNone) {
        const auto into = [](Bytes& bytes) {
            return [&bytes](const void* src, size_t size) {
                const auto* begin = static_cast<const std::byte*>(src);
                bytes.assign(begin, begin + size);
                return true;
            };
        };
        model.setVertexBufferCallback(into(vertices));
        model.setIndexBufferCallback(into(indices));
        return model.create(device, layout, mesh, flags);
    }

    /// An attribute of a vertex as a shader reads it.
    Vector4f load(const Attribute& attribute, uint32_t vertex) const {
        const uint32_t size = formatInfo(attribute.format).block_size;
        const uint64_t offset =
            model.getVertexOffset(attribute.buffer) + vertex * uint64_t(attribute.stride) + attribute.offset;
        const Expected<Image> image = Image::create(attribute.format, 1, 1, std::span(vertices).subspan(offset, size));
        return image ? image->load(0, 0) : Vector4f(NAN);
    }
    uint32_t index(uint32_t i) const {
        uint32_t value = 0;
        const size_t size = model.getIndexFormat() == FormatRu16 ? 2 : 4;
        std::memcpy(&value, &indices[i * size], size);
        return value;
    }
};

/// A box and a plane in one mesh: two parts.
Mesh twoParts() {
    Mesh mesh = createBox({1, 1, 1});
    const Mesh plane = createPlane(4.0f);
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    const auto count = static_cast<uint32_t>(mesh.indices.size());
    for (const uint32_t index : plane.indices) mesh.indices.push_back(first + index);
    for (const Vector3f& position : plane.positions) mesh.positions.push_back(position - Vector3f(0, 0, 2));
    mesh.normals.insert(mesh.normals.end(), plane.normals.begin(), plane.normals.end());
    mesh.texcoords.insert(mesh.texcoords.end(), plane.texcoords.begin(), plane.texcoords.end());
    mesh.parts = {{"box", 0, count}, {"plane", count, static_cast<uint32_t>(plane.indices.size())}};
    return mesh;
}

constexpr const char* mesh_vertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 texcoord;
layout(location = 0) out vec3 shade;
void main() {
    gl_Position = vec4(position.xy * 0.4 + 0.1 * float(gl_InstanceIndex), position.z * 0.1 + 0.5, 1.0);
    shade = vec3(texcoord, normal.z * 0.25 + 0.5);
}
)";
constexpr const char* shade_fragment = R"(
layout(location = 0) in vec3 shade;
layout(location = 0) out vec4 color;
void main() { color = vec4(shade, 1.0); }
)";

class MeshModelTest : public ApiTest {};
class MeshModelGpuTest : public ConformanceTest {
protected:
    Pipeline shaded(const MeshModel::Layout& layout) {
        return makePipeline(mesh_vertex, shade_fragment, [&](Pipeline& pipeline) {
            for (const Attribute& a : layout)
                pipeline.addAttribute(a.attribute, a.format, a.buffer, a.offset, a.stride);
        });
    }
    /// What the first geometries, or all, look like.
    std::vector<Pixel> picture(const Pipeline& pipeline, const std::function<void(Command&)>& record) {
        const Texture color = makeTexture(FormatRGBAu8n, 32, 32);
        draw(color, [&](Command& list) {
            list.setPipeline(pipeline);
            record(list);
        });
        return readTexture<Pixel>(color);
    }
};

const MeshModel::Layout interleaved = {{Pipeline::AttributePosition, FormatRGBf32, 0, 0, 32},
                                       {Pipeline::AttributeNormal, FormatRGBf32, 0, 12, 32},
                                       {Pipeline::AttributeTexCoord, FormatRGf32, 0, 24, 32}};

}  // namespace

INSTANTIATE_APIS(MeshModelTest);

TEST_P(MeshModelTest, LaysOutWhatThePipelineWants) {
    Pipeline pipeline = device.createPipeline("pipeline");
    pipeline.addAttribute(Pipeline::AttributeTexCoord, FormatRGf32, 2, 4, 16);
    pipeline.addAttribute(Pipeline::AttributeColor, FormatRGBAf32, 1, 0, 16, 1);
    pipeline.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 0, 0, 20);
    pipeline.addAttribute(Pipeline::AttributeColor, FormatRGBAu8n, 0, 16, 20);
    const std::vector<Attribute> attributes = pipeline.getAttributes();
    ASSERT_EQ(attributes.size(), 4u);
    EXPECT_EQ(attributes[0], (Attribute{Pipeline::AttributeTexCoord, FormatRGf32, 2, 4, 16, 0}));
    EXPECT_EQ(attributes[1].rate, 1u);

    const Mesh mesh = createBox({1, 2, 3});
    Captured captured;
    ASSERT_THAT(captured.create(device, attributes, mesh), IsOk());
    const MeshModel& model = captured.model;
    // The slot of instances is the program's; slots follow one another in the order of their first attributes.
    EXPECT_EQ(model.getLayout().size(), 3u);
    EXPECT_EQ(model.getVertexOffset(2), 0u);
    EXPECT_EQ(model.getVertexStride(2), 16u);
    EXPECT_EQ(model.getVertexStride(0), 20u);
    EXPECT_EQ(model.getVertexStride(1), 0u);
    EXPECT_EQ(model.getVertexOffset(0), (24u * 16 + 19) / 20 * 20);
    EXPECT_EQ(model.getBaseVertex(0) * 20, model.getVertexOffset(0));
    EXPECT_EQ(captured.vertices.size(), model.getVertexOffset(0) + 24 * 20);
    EXPECT_EQ(captured.vertices.size(), model.getVertexSize());
    for (uint32_t i = 0; i < 24; i++) {
        EXPECT_EQ(captured.load(attributes[0], i), Vector4f(mesh.texcoords[i], 0, 1));
        EXPECT_EQ(captured.load(attributes[2], i), Vector4f(mesh.positions[i], 1));
        EXPECT_EQ(captured.load(attributes[3], i), Vector4f(1));
        // What no attribute takes is 0.
        uint32_t gap = 1;
        std::memcpy(&gap, &captured.vertices[i * 16], 4);
        EXPECT_EQ(gap, 0u);
    }
    ASSERT_EQ(model.getGeometries(), 1u);
    EXPECT_EQ(model.getIndices(), 36u);
    for (uint32_t i = 0; i < 36; i++) EXPECT_EQ(captured.index(i), mesh.indices[i]);
}

TEST_P(MeshModelTest, TheShortFormHasPositions) {
    const Mesh mesh = twoParts();
    const MeshModel model(device, mesh);
    ASSERT_THAT(model, IsOk());
    EXPECT_EQ(model.getVertices(), 28u);
    EXPECT_EQ(model.getVertexStride(), 12u);
    EXPECT_EQ(model.getVertexBuffer().getSize(), 28 * 12u);
    EXPECT_EQ(model.getVertexBuffer().getFlags(), Buffer::FlagVertex);
    EXPECT_EQ(model.getIndexBuffer().getFlags(), Buffer::FlagIndex);
    ASSERT_EQ(model.getGeometries(), 2u);
    EXPECT_EQ(model.getName(1), "plane");
    EXPECT_EQ(model.getIndices(0), 36u);
    EXPECT_EQ(model.getFirstIndex(1), 36u);
    EXPECT_EQ(model.getIndices(1), 6u);
    EXPECT_EQ(model.getIndices(2), 0u);
    EXPECT_EQ(model.getName(2), "");
    const std::vector<Vector3f> positions = read<Vector3f>(model.getVertexBuffer());
    EXPECT_EQ(positions, mesh.positions);
    const std::vector<uint16_t> indices = read<uint16_t>(model.getIndexBuffer());
    EXPECT_TRUE(std::equal(mesh.indices.begin(), mesh.indices.end(), indices.begin()));

    const MeshModel copy = model;
    EXPECT_EQ(copy.getVertexBuffer(), model.getVertexBuffer());
    EXPECT_THAT(MeshModel(), HasErrorId("handle.null"));
}

TEST_P(MeshModelTest, ChoosesTheWidthOfIndices) {
    Mesh mesh = createPlane(1.0f);
    mesh.normals.clear();
    mesh.texcoords.clear();
    const auto format = [&](size_t vertices, MeshModel::Flags flags) {
        mesh.positions.resize(vertices);
        mesh.indices[0] = static_cast<uint32_t>(vertices - 1);
        Captured captured;
        EXPECT_THAT(captured.create(device, {{Pipeline::AttributePosition, FormatRGBf32, 0, 0, 12}}, mesh, flags),
                    IsOk());
        EXPECT_EQ(captured.index(0), vertices - 1);
        EXPECT_EQ(captured.indices.size(), captured.model.getIndexSize());
        EXPECT_EQ(captured.indices.size() % 4, 0u);
        return captured.model.getIndexFormat();
    };
    EXPECT_EQ(format(65536, MeshModel::FlagNone), FormatRu16);
    EXPECT_EQ(format(65537, MeshModel::FlagNone), FormatRu32);
    EXPECT_EQ(format(65536, MeshModel::FlagIndices16), FormatRu16);
    EXPECT_EQ(format(4, MeshModel::FlagIndices32), FormatRu32);
    // A shader that reads the indices has to know their width.
    EXPECT_EQ(format(4, MeshModel::FlagBufferStorage), FormatRu32);
    EXPECT_EQ(format(4, MeshModel::FlagBufferStorage | MeshModel::FlagIndices16), FormatRu16);
    EXPECT_EQ(format(4, MeshModel::FlagBufferTracing), FormatRu16);
    mesh.indices.resize(3);  // 6 bytes are padded to 8
    EXPECT_EQ(format(4, MeshModel::FlagNone), FormatRu16);
}

// The bounds are those that the header states: half a step of normalised values, 2^-11 of the value in half floats, or
// half of their smallest step.
TEST_P(MeshModelTest, RoundsToNearest) {
    Mesh mesh = createSphere(1.0f, 3);
    mesh.texcoords.clear();
    Random random(7);
    for (size_t i = 0; i < mesh.positions.size(); i++)
        mesh.texcoords.emplace_back(random.uniform(), std::exp2(random.uniform(-30, -1)));
    const auto bound = [](Format format, float value) {
        switch (format) {
            case FormatRGBAu8n:
            case FormatRGu8n: return 0.5 / 255;
            case FormatRGBAi8n: return 0.5 / 127;
            case FormatRGBAu16n: return 0.5 / 65535;
            case FormatRGi16n:
            case FormatRGBAi16n: return 0.5 / 32767;
            case FormatRGf16:
            case FormatRGBAf16: return std::max(std::abs(static_cast<double>(value)) * 0x1p-11, 0x1p-25);
            default: return 0.0;
        }
    };
    for (const Format format : {FormatRGBAi8n, FormatRGBAi16n, FormatRGBAf16, FormatRGBf32, FormatRGf32, FormatRGf16,
                                FormatRGi16n, FormatRGu8n, FormatRGBAu16n, FormatRGBAu8n, FormatRi8n}) {
        SCOPED_TRACE(toString(format));
        const uint32_t stride = formatInfo(format).block_size;
        const bool is_signed = format != FormatRGu8n && format != FormatRGBAu16n && format != FormatRGBAu8n;
        const Attribute attribute = {is_signed ? Pipeline::AttributeNormal : Pipeline::AttributeTexCoord, format, 0, 0,
                                     stride};
        Captured captured;
        ASSERT_THAT(captured.create(device, {attribute}, mesh), IsOk());
        double largest = 0.0;
        for (uint32_t i = 0; i < mesh.positions.size(); i++) {
            const Vector4f value = is_signed ? Vector4f(mesh.normals[i], 0) : Vector4f(mesh.texcoords[i], 0, 0);
            const Vector4f loaded = captured.load(attribute, i);
            for (int c = 0; c < std::min<int>(formatInfo(format).components, is_signed ? 3 : 2); c++) {
                const double error = std::abs(static_cast<double>(loaded[c]) - static_cast<double>(value[c]));
                // Decoding rounds to float32 once more.
                EXPECT_LE(error, bound(format == FormatRi8n ? FormatRGBAi8n : format, value[c]) + 0x1p-25);
                largest = std::max(largest, error);
            }
        }
        // Rounded, and not cut off or left alone.
        const double expected = bound(format == FormatRi8n ? FormatRGBAi8n : format, 1.0f);
        EXPECT_GE(largest, 0.9 * (format == FormatRGBAf16 || format == FormatRGf16 ? expected / 2 : expected));
    }
}

TEST_P(MeshModelTest, MakesWhatIsMissing) {
    Mesh mesh = createSphere(2.0f, 3);
    const std::vector<Vector3f> normals = mesh.normals;
    mesh.normals.clear();
    const MeshModel::Layout layout = {{Pipeline::AttributeNormal, FormatRGBf32, 0, 0, 36},
                                      {Pipeline::AttributeWeights, FormatRGBAf32, 0, 12, 36},
                                      {Pipeline::AttributeJoints, FormatRGBAu16, 0, 28, 36}};
    Captured captured;
    ASSERT_THAT(captured.create(device, layout, mesh), IsOk());
    Mesh expected = mesh;
    expected.createNormals();
    for (uint32_t i = 0; i < mesh.positions.size(); i++) {
        EXPECT_EQ(captured.load(layout[0], i), Vector4f(expected.normals[i], 1));
        EXPECT_GT(glm::dot(expected.normals[i], normals[i]), 0.99f);
        EXPECT_EQ(captured.load(layout[1], i), Vector4f(1, 0, 0, 0));
        uint64_t joints = 1;
        std::memcpy(&joints, &captured.vertices[i * 36 + 28], 8);
        EXPECT_EQ(joints, 0u);
    }
    // What rounds to the end of the range is in it; what does not is refused.
    mesh.texcoords.assign(mesh.positions.size(), Vector2f(1.0f + 1e-6f, -1e-6f));
    EXPECT_THAT(captured.create(device, {{Pipeline::AttributeTexCoord, FormatRGu8n, 0, 0, 2}}, mesh), IsOk());
    mesh.texcoords.back().y = -0.01f;
    expectError("model.range", [&] {
        return captured.create(device, {{Pipeline::AttributeTexCoord, FormatRGu8n, 0, 0, 2}}, mesh);
    });
    // The model that failed can be created again.
    EXPECT_FALSE(captured.model);
    EXPECT_THAT(captured.create(device, layout, mesh), IsOk());
    EXPECT_TRUE(captured.model);
}

TEST_P(MeshModelTest, LaysOutMeshesOfScenes) {
    ScenePrimitive full;
    for (int i = 0; i < 3; i++) {
        const auto f = static_cast<float>(i);
        full.positions.emplace_back(f, f * f, 1);
        full.normals.emplace_back(0, 0, -1);
        full.tangents.emplace_back(0, 1, 0, -1);
        full.texcoords[0].emplace_back(f, 0);
        full.texcoords[1].emplace_back(0, f);
        full.colors.emplace_back(f, 0.5f, 0, 1);
        full.joints.push_back({static_cast<uint16_t>(i), 300, 2, 1});
        full.weights.emplace_back(0.5f, 0.25f, 0.25f, 0);
    }
    full.indices = {0, 1, 2};
    full.material = 5;
    ScenePrimitive bare;
    bare.positions = full.positions;
    bare.indices = {2, 1, 0, 0, 2, 1};
    const SceneMesh mesh{"two", {full, bare}, {}};

    const MeshModel::Layout layout = {{Pipeline::AttributePosition, FormatRGBf32, 0, 0, 100},
                                      {Pipeline::AttributeNormal, FormatRGBf32, 0, 12, 100},
                                      {Pipeline::AttributeTangent, FormatRGBAf32, 0, 24, 100},
                                      {Pipeline::AttributeTexCoord, FormatRGf32, 0, 40, 100},
                                      {Pipeline::AttributeTexCoord, FormatRGf32, 0, 48, 100},
                                      {Pipeline::AttributeColor, FormatRGBAf32, 0, 56, 100},
                                      {Pipeline::AttributeJoints, FormatRGBAu16, 0, 72, 100},
                                      {Pipeline::AttributeWeights, FormatRGBAf32, 0, 80, 100}};
    Captured captured;
    ASSERT_THAT(captured.create(device, layout, mesh), IsOk());
    const MeshModel& model = captured.model;
    EXPECT_EQ(model.getVertices(), 6u);
    ASSERT_EQ(model.getGeometries(), 2u);
    EXPECT_EQ(model.getName(1), "two");
    EXPECT_EQ(model.getFirstIndex(1), 3u);
    EXPECT_EQ(model.getIndices(1), 6u);
    for (uint32_t i = 0; i < 9; i++)
        EXPECT_EQ(captured.index(i), i < 3 ? full.indices[i] : 3 + bare.indices[i - 3]) << i;
    const auto joints = [&](uint32_t vertex) {
        std::array<uint16_t, 4> values;
        std::memcpy(values.data(), &captured.vertices[vertex * 100 + 72], sizeof(values));
        return values;
    };
    for (uint32_t i = 0; i < 3; i++) {
        EXPECT_EQ(captured.load(layout[2], i), full.tangents[i]);
        EXPECT_EQ(Vector2f(captured.load(layout[3], i)), full.texcoords[0][i]);
        EXPECT_EQ(Vector2f(captured.load(layout[4], i)), full.texcoords[1][i]);
        EXPECT_EQ(captured.load(layout[5], i), full.colors[i]);
        EXPECT_EQ(joints(i), full.joints[i]);
        EXPECT_EQ(captured.load(layout[7], i), full.weights[i]);
    }
    for (uint32_t i = 3; i < 6; i++) {
        EXPECT_EQ(Vector3f(captured.load(layout[0], i)), bare.positions[i - 3]);
        EXPECT_EQ(captured.load(layout[2], i), Vector4f(0, 0, 0, 1));
        EXPECT_EQ(Vector2f(captured.load(layout[3], i)), Vector2f(0.0f));
        EXPECT_EQ(captured.load(layout[5], i), Vector4f(1.0f));
        EXPECT_EQ(joints(i), (std::array<uint16_t, 4>{}));
        EXPECT_EQ(captured.load(layout[7], i), Vector4f(1, 0, 0, 0));
        // Of the triangle 2 1 0, twice.
        EXPECT_EQ(Vector3f(captured.load(layout[1], i)), Vector3f(0, 0, -1));
    }

    const auto with = [&](Pipeline::Attribute attribute, Format format) {
        return [&, attribute, format] {
            const uint32_t size = formatInfo(format).block_size;
            return MeshModel(device,
                             {{Pipeline::AttributePosition, FormatRGBf32, 1, 0, 12}, {attribute, format, 0, 0, size}},
                             mesh)
                .error();
        };
    };
    for (const Format format : {FormatRGBAu32, FormatRu16, FormatRGBAi16, FormatRGBAi32})
        EXPECT_THAT(with(Pipeline::AttributeJoints, format)(), IsOk()) << toString(format);
    expectError("model.range", with(Pipeline::AttributeJoints, FormatRGBAu8));
    expectError("model.range", with(Pipeline::AttributeJoints, FormatRGBAi8));
    expectError("model.format", with(Pipeline::AttributeJoints, FormatRGBAf32));
    expectError("model.range", with(Pipeline::AttributeColor, FormatRGBAu8n));
    expectError("model.attribute", with(Pipeline::AttributeBasis, FormatRGBAf32));
    expectError("model.attribute", [&] {
        MeshModel::Layout third = layout;
        third.push_back({Pipeline::AttributeTexCoord, FormatRGf32, 1, 0, 8});
        return MeshModel(device, third, mesh).error();
    });
    expectError("mesh.no_faces", [&] { return MeshModel(device, layout, SceneMesh()).error(); });
    expectError("scene.vertex_index", [&] {
        SceneMesh wrong = mesh;
        wrong.primitives[1].indices[0] = 3;
        return MeshModel(device, layout, wrong).error();
    });
}

TEST_P(MeshModelTest, RefusesMoreThanABufferHolds) {
    const uint64_t limit = device.getFeatures().maxBufferSize;
    if (limit > 1ull << 33)
        GTEST_SKIP() << "a buffer beyond the device's limit of " << limit
                     << " bytes needs data of that size in host memory";
    Mesh mesh = createPlane(1.0f);
    mesh.positions.resize(limit / 2048 + 1);
    mesh.normals.clear();
    mesh.texcoords.clear();
    expectError("model.too_large", [&] {
        return MeshModel(device, {{Pipeline::AttributePosition, FormatRGBf32, 0, 0, 2048}}, mesh);
    });
}

TEST_P(MeshModelTest, ACallbackMayDecline) {
    MeshModel model;
    size_t seen = 0;
    model.setVertexBufferCallback([&](const void*, size_t size) {
        seen = size;
        return false;
    });
    ASSERT_THAT(model.create(device, createPlane(1.0f)), IsOk());
    EXPECT_EQ(seen, 48u);
    EXPECT_EQ(model.getVertexBuffer().getSize(), 48u);
    EXPECT_TRUE(model.getIndexBuffer());
}

// The same picture from four layouts, from parts, and from a model drawn by hand.
TEST_F(MeshModelGpuTest, DrawsEveryLayout) {
    const Mesh mesh = twoParts();
    const MeshModel model(device, interleaved, mesh);
    ASSERT_THAT(model, IsOk());
    const Pipeline pipeline = shaded(interleaved);
    const std::vector<Pixel> whole = picture(pipeline, [&](Command& list) { model.draw(list); });

    struct Vertex {
        Vector3f position, normal;
        Vector2f texcoord;
    };
    std::vector<Vertex> corners;
    for (const uint32_t index : mesh.indices)
        corners.push_back({mesh.positions[index], mesh.normals[index], mesh.texcoords[index]});
    const std::vector<Pixel> expected = picture(pipeline, [&](Command& list) {
        list.setVertices(0, std::span<const Vertex>(corners));
        list.drawArrays(static_cast<uint32_t>(corners.size()));
    });
    EXPECT_EQ(whole, expected);
    EXPECT_GT(countPixels(expected, black), 100u);
    EXPECT_LT(countPixels(expected, black), 900u);

    EXPECT_EQ(picture(pipeline,
                      [&](Command& list) {
                          model.draw(list, 0);
                          model.draw(list, 1);
                      }),
              whole);
    // Parts and instances are seen.
    EXPECT_NE(picture(pipeline, [&](Command& list) { model.draw(list, 0); }), whole);
    EXPECT_NE(picture(pipeline, [&](Command& list) { model.draw(list, 0, 2); }),
              picture(pipeline, [&](Command& list) { model.draw(list, 0, 1); }));
    EXPECT_EQ(countPixels(picture(pipeline, [&](Command& list) { model.draw(list, 0, 0); }), black), 1024u);

    // All positions, normals and texture coordinates of this mesh are exact in these formats.
    const MeshModel::Layout layouts[] = {
        {{Pipeline::AttributePosition, FormatRGBf32, 2, 0, 12},
         {Pipeline::AttributeNormal, FormatRGBf32, 0, 0, 12},
         {Pipeline::AttributeTexCoord, FormatRGf32, 1, 0, 8}},
        {{Pipeline::AttributePosition, FormatRGBAf16, 0, 0, 16},
         {Pipeline::AttributeNormal, FormatRGBAi8n, 0, 8, 16},
         {Pipeline::AttributeTexCoord, FormatRGu16n, 0, 12, 16}},
        {{Pipeline::AttributePosition, FormatRGBAf32, 0, 0, 24},
         {Pipeline::AttributeNormal, FormatRGBAi16n, 0, 16, 24},
         {Pipeline::AttributeTexCoord, FormatRGu8n, 1, 0, 2}},
    };
    for (const MeshModel::Layout& layout : layouts)
        for (const MeshModel::Flags flags : {MeshModel::FlagIndices16, MeshModel::FlagIndices32}) {
            const Pipeline other = shaded(layout);
            const MeshModel same(device, other, mesh, flags);
            ASSERT_THAT(same, IsOk());
            EXPECT_EQ(picture(other, [&](Command& list) { same.draw(list); }), whole);
        }
}

// Three models whose vertices lie in one buffer and whose indices in another draw as they do by themselves.
TEST_F(MeshModelGpuTest, DrawsFromMergedBuffers) {
    const Mesh meshes[] = {createSphere(0.7f, 2), twoParts(), createTorus(1.5f, 0.4f, 9, 5)};
    Mesh textured[3];
    const Pipeline pipeline = shaded(interleaved);
    Bytes vertices, indices;
    MeshModel merged[3], alone[3];
    uint64_t vertex_offsets[3], index_offsets[3];
    for (int i = 0; i < 3; i++) {
        textured[i] = meshes[i];
        if (textured[i].texcoords.empty())
            textured[i].texcoords.assign(textured[i].positions.size(), Vector2f(0.25f, 0.75f));
        merged[i].setVertexBufferCallback(appendTo(vertices, vertex_offsets[i]));
        merged[i].setIndexBufferCallback(appendTo(indices, index_offsets[i]));
        ASSERT_THAT(
            merged[i].create(device, pipeline, textured[i], i == 1 ? MeshModel::FlagIndices32 : MeshModel::FlagNone),
            IsOk());
        EXPECT_FALSE(merged[i].getVertexBuffer());
        ASSERT_THAT(alone[i].create(device, pipeline, textured[i]), IsOk());
    }
    const Buffer vertex_buffer = device.createBuffer(Buffer::FlagVertex, std::span(vertices), "vertices");
    const Buffer index_buffer = device.createBuffer(Buffer::FlagIndex, std::span(indices), "indices");
    uint32_t first_vertex = 0;
    for (int i = 0; i < 3; i++) {
        merged[i].setVertexBuffer(vertex_buffer, vertex_offsets[i]);
        merged[i].setIndexBuffer(index_buffer, index_offsets[i]);
        EXPECT_EQ(merged[i].getBaseVertex(), first_vertex);
        EXPECT_EQ(merged[i].getFirstIndex(0) * (i == 1 ? 4 : 2), index_offsets[i]);
        first_vertex += merged[i].getVertices();
        const std::vector<Pixel> pixels = picture(pipeline, [&](Command& list) { merged[i].draw(list); });
        EXPECT_EQ(pixels, picture(pipeline, [&](Command& list) { alone[i].draw(list); }));
        EXPECT_LT(countPixels(pixels, black), 1000u);
    }
    EXPECT_EQ(merged[1].getFirstIndex(1), merged[1].getFirstIndex(0) + 36);
}

// Rays down through two models in merged buffers, each with two geometries: every ray meets what the float64 reference
// says, and the shader finds the corner of the triangle that was hit through base vertex and first index.
TEST_F(MeshModelGpuTest, TracesFromMergedBuffers) {
    GLINT_NEED_FEATURE(FeatureComputeTracing);
    const Mesh mesh = twoParts();
    MeshModel models[2];
    Bytes vertices, indices;
    uint64_t offsets[2][2];
    for (int i = 0; i < 2; i++) {
        models[i].setVertexBufferCallback(appendTo(vertices, offsets[i][0]));
        models[i].setIndexBufferCallback(appendTo(indices, offsets[i][1]));
        ASSERT_THAT(models[i].create(device, interleaved, mesh, MeshModel::FlagIndices32), IsOk());
    }
    const Buffer::Flags flags = Buffer::FlagTracing | Buffer::FlagStorage;
    const Buffer vertex_buffer = device.createBuffer(flags, std::span(vertices), "vertices");
    const Buffer index_buffer = device.createBuffer(flags, std::span(indices), "indices");
    Tracing structures[2];
    std::vector<uint32_t> places;  // of each geometry: base vertex, first index
    for (int i = 0; i < 2; i++) {
        models[i].setVertexBuffer(vertex_buffer, offsets[i][0]);
        models[i].setIndexBuffer(index_buffer, offsets[i][1]);
        structures[i] = models[i].createTracing();
        ASSERT_THAT(structures[i], IsOk());
        EXPECT_EQ(structures[i].getGeometries(), 2u);
        EXPECT_EQ(structures[i].getPrimitives(), 14u);
        for (uint32_t g = 0; g < 2; g++) {
            places.push_back(models[i].getBaseVertex());
            places.push_back(models[i].getFirstIndex(g));
        }
    }
    Tracing::Instance instances[2] = {{.tracing = &structures[0]}, {.tracing = &structures[1], .data = 1}};
    instances[1].transform[3] = 5.0f;
    const Tracing scene = device.createTracing(instances);
    ASSERT_THAT(device.buildTracings({structures[0], structures[1], scene}), IsOk());

    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 8, local_size_y = 8) in;
        layout(binding = 0) uniform accelerationStructureEXT scene;
        layout(binding = 1, std430) readonly buffer Vertices { float vertices[]; };
        layout(binding = 2, std430) readonly buffer Indices { uint indices[]; };
        layout(binding = 3, std430) readonly buffer Places { uvec2 places[]; };
        layout(binding = 4, std430) writeonly buffer Hits { vec4 hits[]; };
        void main() {
            uvec2 id = gl_GlobalInvocationID.xy;
            vec2 xy = vec2(id) * vec2(0.21, 0.13) + vec2(-1.937, -1.87);
            rayQueryEXT query;
            rayQueryInitializeEXT(query, scene, 0, 0xff, vec3(xy, 4.0), 0.0, vec3(0.0, 0.0, -1.0), 100.0);
            while (rayQueryProceedEXT(query)) {}
            vec4 hit = vec4(-1.0);
            if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionTriangleEXT) {
                uint model = uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, true));
                uvec2 place = places[model * 2 + uint(rayQueryGetIntersectionGeometryIndexEXT(query, true))];
                uint triangle = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true));
                uint vertex = (indices[place.y + triangle * 3] + place.x) * 8;
                hit = vec4(vertices[vertex], vertices[vertex + 1], vertices[vertex + 2],
                           rayQueryGetIntersectionTEXT(query, true));
            }
            hits[id.y * 40 + id.x] = hit;
        })");
    const Buffer hits = device.createBuffer(Buffer::FlagStorage, 40 * 32 * sizeof(Vector4f));
    const Buffer place_buffer = makeBuffer(places);
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setTracing(0, scene);
        list.setStorageBuffers(0, {vertex_buffer, index_buffer, place_buffer, hits});
        list.dispatch(40, 32);
    });
    const std::vector<Vector4f> found = read<Vector4f>(hits);
    uint32_t met = 0;
    for (uint32_t y = 0; y < 32; y++)
        for (uint32_t x = 0; x < 40; x++) {
            const double px = x * 0.21 - 1.937, py = y * 0.13 - 1.87;
            const Vector4f& hit = found[y * 40 + x];
            ReferenceHit best = closestHit(mesh, {px, py, 4}, {0, 0, -1});
            const ReferenceHit moved = closestHit(mesh, {px - 5.0, py, 4}, {0, 0, -1});
            if (moved.hit && (!best.hit || moved.t < best.t)) best = moved;
            ASSERT_EQ(best.hit, hit.w >= 0.0f) << px << " " << py;
            if (!best.hit) continue;
            met++;
            EXPECT_NEAR(hit.w, best.t, 1e-5);
            EXPECT_EQ(Vector3f(hit), mesh.positions[mesh.indices[best.triangle * 3]]);
        }
    EXPECT_GT(met, 600u);
    EXPECT_LT(met, 1280u);
}

}  // namespace glint::test
