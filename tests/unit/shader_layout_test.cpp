#include "shader_test.h"

using namespace glint;
using namespace glint::test;

namespace {

class ShaderLayout : public ShaderTest {
protected:
    struct Stage {
        ShaderStage stage;
        std::string text;
    };

    static Expected<BindingLayout> merge(const std::vector<Stage>& stages) {
        std::vector<Reflection> reflections;
        for (const Stage& stage : stages) {
            const std::string body = stage.text + "void main() {}\n";
            const Expected<CompiledShader> result = compileShader(glsl(body, stage.stage));
            EXPECT_THAT(result, IsOk());
            if (!result) return unexpected(result.error());
            reflections.push_back(result->reflection);
        }
        std::vector<const Reflection*> pointers;
        for (const Reflection& reflection : reflections) pointers.push_back(&reflection);
        return mergeLayouts(pointers);
    }

    static std::vector<std::string> names(const BindingLayout& layout, SlotKind kind) {
        std::vector<std::string> result;
        for (uint32_t slot = 0; layout.find(kind, slot); slot++) result.push_back(layout.find(kind, slot)->name);
        return result;
    }
};

using Names = std::vector<std::string>;
constexpr ShaderStage Vertex = ShaderStage::Vertex;
constexpr ShaderStage Fragment = ShaderStage::Fragment;
constexpr ShaderStage Compute = ShaderStage::Compute;

}  // namespace

TEST_F(ShaderLayout, NothingAtAll) {
    const Expected<BindingLayout> layout = mergeLayouts({});
    ASSERT_THAT(layout, IsOk());
    EXPECT_EQ(layout->set_count, 0u);
    EXPECT_EQ(layout->stages, 0u);
    EXPECT_EQ(layout->find(SlotKind::Uniform, 0), nullptr);
    EXPECT_EQ(layout->findSlot(SlotKind::Uniform, "a"), -1);
    EXPECT_EQ(layout->findSlot(SlotKind::Uniform, 0, 0), -1);
}

TEST_F(ShaderLayout, SlotsCountInSetAndBindingOrderOverAllStages) {
    const Expected<BindingLayout> layout =
        merge({{Vertex, "layout(set = 1, binding = 0) uniform Late { float late; };\n"
                        "layout(set = 0, binding = 5) buffer Positions { vec4 p[]; };\n"
                        "layout(set = 0, binding = 7) uniform Shared { vec4 s; };\n"},
               {Fragment, "layout(set = 0, binding = 7) uniform Shared { vec4 s; };\n"
                          "layout(set = 0, binding = 2) uniform Early { float early; };\n"
                          "layout(set = 2, binding = 0) uniform texture2D color[4];\n"
                          "layout(set = 2, binding = 4) uniform texture2D normal;\n"
                          "layout(set = 0, binding = 6) readonly buffer Unused { float u; };\n"}});
    ASSERT_THAT(layout, IsOk());
    EXPECT_EQ(names(*layout, SlotKind::Uniform), (Names{"Early", "Shared", "Late"}));
    EXPECT_EQ(names(*layout, SlotKind::Storage), (Names{"Positions", "Unused"}));
    EXPECT_EQ(names(*layout, SlotKind::Texture), (Names{"color", "normal"}));
    EXPECT_EQ(layout->set_count, 3u);
    EXPECT_EQ(layout->stages, stageBit(Vertex) | stageBit(Fragment));
    EXPECT_EQ(layout->find(SlotKind::Uniform, 1)->stages, stageBit(Vertex) | stageBit(Fragment));
    EXPECT_EQ(layout->find(SlotKind::Uniform, 0)->stages, stageBit(Fragment));
    EXPECT_EQ(layout->find(SlotKind::Texture, 0)->count, 4u);
    EXPECT_EQ(layout->findSlot(SlotKind::Texture, "normal"), 1);
    EXPECT_EQ(layout->findSlot(SlotKind::Texture, 2, 4), 1);
    EXPECT_EQ(layout->findSlot(SlotKind::Texture, 2, 3), -1);
    EXPECT_EQ(layout->findSlot(SlotKind::Uniform, 2, 4), -1);
    EXPECT_EQ(layout->findSlot(SlotKind::Uniform, "normal"), -1);
    EXPECT_EQ(layout->findSlot(SlotKind::Uniform, ""), -1);
}

// The tutorials' own order: a uniform block, storage blocks that go on counting, images, samplers, structures.
TEST_F(ShaderLayout, TutorialsCountFromZero) {
    const Expected<BindingLayout> layout =
        merge({{Compute, "layout(std140, row_major, binding = 0) uniform CommonParameters { mat4 projection; };\n"
                         "layout(std430, binding = 1) readonly buffer VertexBuffer { vec4 vertices[]; };\n"
                         "layout(std430, binding = 2) readonly buffer IndexBuffer { uint indices[]; };\n"
                         "layout(binding = 0, set = 1) uniform accelerationStructureEXT tracing;\n"
                         "layout(binding = 0, set = 2, rgba8) uniform writeonly image2D out_surface;\n"}});
    ASSERT_THAT(layout, IsOk());
    EXPECT_EQ(layout->findSlot(SlotKind::Uniform, "CommonParameters"), 0);
    EXPECT_EQ(layout->findSlot(SlotKind::Storage, "VertexBuffer"), 0);
    EXPECT_EQ(layout->findSlot(SlotKind::Storage, "IndexBuffer"), 1);
    EXPECT_EQ(layout->findSlot(SlotKind::Tracing, "tracing"), 0);
    EXPECT_EQ(layout->findSlot(SlotKind::Surface, "out_surface"), 0);
    EXPECT_TRUE(layout->find(SlotKind::Uniform, 0)->has_row_major);
}

TEST_F(ShaderLayout, AliasesShareASlotAndAllTheirNames) {
    const Expected<BindingLayout> layout =
        merge({{Compute, "layout(set = 0, binding = 0) buffer Words { uint words[]; } as_words;\n"
                         "layout(set = 0, binding = 0) readonly buffer Vectors { vec4 head; vec4 v[]; } as_vectors;\n"
                         "layout(set = 0, binding = 1) buffer Next { uint n; };\n"},
               {Compute, "layout(set = 0, binding = 1) buffer Other { uint n[8]; } other;\n"}});
    ASSERT_THAT(layout, IsOk());
    ASSERT_EQ(layout->slots[static_cast<size_t>(SlotKind::Storage)].size(), 2u);
    for (const char* name : {"Words", "as_words", "Vectors", "as_vectors"})
        EXPECT_EQ(layout->findSlot(SlotKind::Storage, name), 0) << name;
    for (const char* name : {"Next", "Other", "other"}) EXPECT_EQ(layout->findSlot(SlotKind::Storage, name), 1) << name;
    EXPECT_EQ(layout->find(SlotKind::Storage, 0)->size, 16u);
    EXPECT_TRUE(layout->find(SlotKind::Storage, 0)->write);
    EXPECT_EQ(layout->find(SlotKind::Storage, 1)->size, 32u);
}

TEST_F(ShaderLayout, CombinedSamplersTakeASlotOfEachKind) {
    const Expected<BindingLayout> layout = merge({{Fragment, "layout(set = 0, binding = 1) uniform sampler2D both;\n"
                                                             "layout(set = 0, binding = 0) uniform sampler first;\n"
                                                             "layout(set = 0, binding = 2) uniform texture2D picture;\n"
                                                             "layout(set = 0, binding = 3) uniform sampler last;\n"}});
    ASSERT_THAT(layout, IsOk());
    EXPECT_EQ(names(*layout, SlotKind::Texture), (Names{"both", "picture"}));
    EXPECT_EQ(names(*layout, SlotKind::Sampler), (Names{"first", "both", "last"}));
    EXPECT_EQ(layout->find(SlotKind::Texture, 0), layout->find(SlotKind::Sampler, 1));
    EXPECT_EQ(layout->findSlot(SlotKind::Sampler, 0, 1), 1);
    EXPECT_EQ(layout->resources.size(), 4u);
}

TEST_F(ShaderLayout, ArraysOfUnknownLengthAreTables) {
    const Expected<BindingLayout> layout =
        merge({{Fragment, "layout(set = 1, binding = 0) uniform texture2D flat_ones[];\n"
                          "layout(set = 1, binding = 0) uniform textureCube cubes[];\n"
                          "layout(set = 2, binding = 0) uniform sampler2D both[];\n"
                          "layout(set = 0, binding = 0) uniform texture2D one;\n"}});
    ASSERT_THAT(layout, IsOk());
    EXPECT_EQ(names(*layout, SlotKind::Table), (Names{"flat_ones", "both"}));
    EXPECT_EQ(names(*layout, SlotKind::Texture), (Names{"one"}));
    EXPECT_TRUE(names(*layout, SlotKind::Sampler).empty());
    EXPECT_EQ(layout->findSlot(SlotKind::Table, "cubes"), 0);
    EXPECT_EQ(layout->find(SlotKind::Table, 0)->dimension, ImageDimension::None);
    EXPECT_TRUE(layout->find(SlotKind::Table, 1)->combined);
}

TEST_F(ShaderLayout, ConflictsNameBothStagesAndNames) {
    const std::pair<const char*, const char*> pairs[] = {
        {"uniform A { float a; };\n", "buffer B { float b; };\n"},
        {"uniform A { float a; };\n", "uniform B { float b; } b[2];\n"},
        {"uniform texture2D A;\n", "uniform textureCube B;\n"},
        {"uniform texture2D A;\n", "uniform texture2DArray B;\n"},
        {"uniform texture2D A;\n", "uniform sampler2D B;\n"},
        {"uniform texture2D A;\n", "uniform texture2D B[];\n"},
        {"uniform texture2D A[];\n", "uniform sampler B[];\n"},
        {"uniform textureBuffer A;\n", "uniform readonly imageBuffer B;\n"},
        {"uniform texture2D A;\n", "uniform readonly image2D B;\n"},
    };
    for (const auto& [first, second] : pairs) {
        const std::string place = "layout(set = 1, binding = 3) ";
        const Expected<BindingLayout> layout = merge({{Vertex, place + first}, {Fragment, place + second}});
        ASSERT_THAT(layout, HasErrorId("shader.binding_conflict")) << first << second;
        const std::string& message = layout.error().message();
        for (const char* part : {"set 1, binding 3", "Vertex", "Fragment", "'A'", "'B'"})
            EXPECT_NE(message.find(part), std::string::npos) << message;
        EXPECT_THAT(merge({{Fragment, place + first + place + second}}), HasErrorId("shader.binding_conflict"));
        EXPECT_THAT(merge({{Vertex, place + first}, {Fragment, "layout(set = 1, binding = 4) " + std::string(second)}}),
                    IsOk());
    }
}

TEST_F(ShaderLayout, PushConstantsTakeTheLargest) {
    const Expected<BindingLayout> layout = merge({{Vertex, "layout(push_constant) uniform P { mat4 a; };\n"},
                                                  {Fragment, "layout(push_constant) uniform P { mat4 a; vec4 b; };\n"},
                                                  {Compute, ""}});
    ASSERT_THAT(layout, IsOk());
    EXPECT_EQ(layout->push_size, 80u);
    EXPECT_EQ(layout->push_stages, stageBit(Vertex) | stageBit(Fragment));
}

TEST_F(ShaderLayout, AStageMayComeMoreThanOnce) {
    const std::string scene = "layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;\n";
    const Expected<BindingLayout> layout =
        merge({{ShaderStage::RayGen, scene},
               {ShaderStage::Closest, scene + "layout(set = 0, binding = 1) buffer First { float f; };\n"},
               {ShaderStage::Closest, "layout(set = 0, binding = 2) buffer Second { float f; };\n"}});
    ASSERT_THAT(layout, IsOk());
    EXPECT_EQ(names(*layout, SlotKind::Storage), (Names{"First", "Second"}));
    EXPECT_EQ(layout->find(SlotKind::Tracing, 0)->stages,
              stageBit(ShaderStage::RayGen) | stageBit(ShaderStage::Closest));
}

TEST_F(ShaderLayout, NamesOfStagesAndKinds) {
    EXPECT_STREQ(toString(ShaderStage::FirstHit), "FirstHit");
    EXPECT_STREQ(toString(ShaderStage::Callable), "Callable");
    EXPECT_STREQ(toString(ShaderStage::Count), "Unknown");
    EXPECT_STREQ(toString(SlotKind::Table), "table");
    EXPECT_STREQ(toString(SlotKind::Count), "unknown");
}
