// Models of meshes.

#include "conformance/misuse.h"

#include <glint/geometry/primitives.h>
#include <glint/graphics/mesh_model.h>

#include <limits>

namespace glint::test {

namespace {

using Attribute = Pipeline::VertexAttribute;

Error model(MisuseKit& kit, const MeshModel::Layout& layout, const Mesh& mesh = createPlane(1.0f),
            MeshModel::Flags flags = MeshModel::FlagNone) {
    return MeshModel(kit.device, layout, mesh, flags).error();
}

Error flagged(MisuseKit& kit, MeshModel::Flags flags, const Mesh& mesh = createPlane(1.0f)) {
    return MeshModel(kit.device, mesh, flags).error();
}

constexpr Attribute positions = {Pipeline::AttributePosition, FormatRGBf32, 0, 0, 12};

/// A mesh of this many vertices.
Mesh large(size_t vertices) {
    Mesh mesh = createPlane(1.0f);
    mesh.positions.resize(vertices);
    mesh.normals.clear();
    mesh.texcoords.clear();
    return mesh;
}

/// A model whose vertices and indices were taken over and are nowhere yet.
MeshModel taken(MisuseKit& kit, MeshModel::Flags flags = MeshModel::FlagBufferTracing) {
    MeshModel result;
    result.setVertexBufferCallback([](const void*, size_t) { return true; });
    result.setIndexBufferCallback([](const void*, size_t) { return true; });
    EXPECT_THAT(result.create(kit.device, createPlane(1.0f), flags), IsOk());
    return result;
}

}  // namespace

MISUSE(ModelOfNothing, "mesh.no_faces") { return flagged(kit, MeshModel::FlagNone, Mesh()); }
MISUSE(ModelOfIndicesOutOfRange, "mesh.index_range") {
    Mesh mesh = createPlane(1.0f);
    mesh.indices[2] = 4;
    return flagged(kit, MeshModel::FlagNone, mesh);
}
MISUSE(ModelOfAFailedPipeline, "pipeline.attribute") {
    Pipeline pipeline =
        kit.unfinished([](Pipeline& made) { made.addAttribute(Pipeline::AttributeNormal, FormatUnknown, 0, 0, 16); });
    kit.log.take();
    return MeshModel(kit.device, pipeline, createPlane(1.0f)).error();
}
MISUSE(ModelOfNoPipeline, "handle.null") { return MeshModel(kit.device, Pipeline(), createPlane(1.0f)).error(); }
MISUSE(ModelOfContraryWidths, "model.flags") {
    return flagged(kit, MeshModel::FlagIndices16 | MeshModel::FlagIndices32);
}
MISUSE(ModelOfUnknownFlags, "model.flags") { return flagged(kit, 1u << 20); }
MISUSE(ModelTooLargeFor16Bits, "model.indices") { return flagged(kit, MeshModel::FlagIndices16, large(65537)); }
MISUSE(ModelWithoutAttributes, "model.layout") { return model(kit, {}); }
MISUSE(ModelOfInstanceAttributes, "model.layout") {
    return model(kit, {{Pipeline::AttributePosition, FormatRGBf32, 0, 0, 12, 1}});
}
MISUSE(ModelOfUnknownFormat, "model.layout") {
    return model(kit, {{Pipeline::AttributePosition, FormatUnknown, 0, 0, 12}});
}
MISUSE(ModelOfABlockFormat, "model.layout") {
    return model(kit, {{Pipeline::AttributePosition, FormatBC7RGBAu8n, 0, 0, 16}});
}
MISUSE(ModelBeyondItsStride, "model.layout") {
    return model(kit, {{Pipeline::AttributePosition, FormatRGBf32, 0, 4, 12}});
}
MISUSE(ModelOfEndlessOffset, "model.layout") {
    return model(kit, {{Pipeline::AttributePosition, FormatRGBf32, 0, UINT32_MAX - 3, 12}});
}
MISUSE(ModelOfAHighSlot, "model.layout") {
    return model(kit, {{Pipeline::AttributePosition, FormatRGBf32, 16, 0, 12}});
}
MISUSE(ModelOfTwoStrides, "model.layout") {
    return model(kit, {positions, {Pipeline::AttributeNormal, FormatRGBf32, 0, 12, 24}});
}
MISUSE(ModelOfOverlappingAttributes, "model.layout") {
    return model(kit, {{Pipeline::AttributePosition, FormatRGBAf32, 0, 0, 24},
                       {Pipeline::AttributeNormal, FormatRGBf32, 0, 12, 24}});
}
MISUSE(ModelWithoutTextureCoordinates, "model.attribute") {
    Mesh mesh = createPlane(1.0f);
    mesh.texcoords.clear();
    return model(kit, {positions, {Pipeline::AttributeTexCoord, FormatRGf32, 1, 0, 8}}, mesh);
}
MISUSE(ModelWithTangents, "model.attribute") {
    return model(kit, {positions, {Pipeline::AttributeTangent, FormatRGBAf32, 1, 0, 16}});
}
MISUSE(ModelOfIntegerPositions, "model.format") {
    return model(kit, {{Pipeline::AttributePosition, FormatRGBAi16, 0, 0, 8}});
}
MISUSE(ModelOfPackedNormals, "model.format") {
    return model(kit, {positions, {Pipeline::AttributeNormal, FormatRGBu10Au2n, 1, 0, 4}});
}
MISUSE(ModelOfFloatJoints, "model.format") {
    return model(kit, {positions, {Pipeline::AttributeJoints, FormatRGBAf32, 1, 0, 16}});
}
MISUSE(ModelOfPositionsBeyondOne, "model.range") {
    return model(kit, {{Pipeline::AttributePosition, FormatRGBAi16n, 0, 0, 8}}, createPlane(2.1f));
}
MISUSE(ModelOfNegativeNormals, "model.range") {
    return model(kit, {positions, {Pipeline::AttributeNormal, FormatRGBAu8n, 1, 0, 4}}, createBox(Vector3f(1.0f)));
}
MISUSE(ModelBeyondHalfFloats, "model.range") {
    return model(kit, {{Pipeline::AttributePosition, FormatRGBAf16, 0, 0, 8}}, createPlane(131072.0f));
}
MISUSE(ModelOfNormalsThatAreNoNumbers, "model.range") {
    Mesh mesh = createPlane(1.0f);
    mesh.normals[3].y = std::numeric_limits<float>::quiet_NaN();
    return model(kit, {positions, {Pipeline::AttributeNormal, FormatRGBf32, 1, 0, 12}}, mesh);
}
MISUSE(ModelWithAddressesNobodyHas, "buffer.feature") {
    return MeshModel(kit.bare, createPlane(1.0f), MeshModel::FlagBufferAddress).error();
}
MISUSE(ModelForTracingOnABareDevice, "buffer.feature") {
    return MeshModel(kit.bare, createPlane(1.0f), MeshModel::FlagBufferTracing).error();
}
MISUSE(ModelInAFailedBuffer, "model.buffer") {
    MeshModel moved = taken(kit);
    moved.setVertexBuffer(kit.failedBuffer());
    return moved.error();
}
MISUSE(ModelInAShortBuffer, "model.buffer") {
    MeshModel moved = taken(kit);
    moved.setVertexBuffer(kit.buffer(Buffer::FlagVertex, moved.getVertexSize() + 11), 12);
    return moved.error();
}
MISUSE(ModelBetweenVertices, "model.buffer") {
    MeshModel moved = taken(kit);
    moved.setVertexBuffer(kit.buffer(Buffer::FlagVertex), 16);
    return moved.error();
}
MISUSE(ModelWithIndicesAtAnOddOffset, "model.buffer") {
    MeshModel moved = taken(kit);
    moved.setIndexBuffer(kit.buffer(Buffer::FlagIndex), 2);
    return moved.error();
}
MISUSE(DrawOfAFailedModel, "model.flags") {
    const MeshModel failed(kit.device, createPlane(1.0f), 1u << 20);
    kit.log.take();
    return kit.command([&](Command& list) { failed.draw(list); });
}
MISUSE(DrawOfNoModel, "handle.null") {
    return kit.command([&](Command& list) { MeshModel().draw(list); });
}
MISUSE(DrawOfAMissingGeometry, "model.geometry") {
    const MeshModel plane(kit.device, createPlane(1.0f));
    return kit.command([&](Command& list) { plane.draw(list, 1); });
}
MISUSE(DrawOfWhatIsNowhere, "handle.null") {
    const MeshModel moved = taken(kit);
    return kit.command([&](Command& list) { moved.draw(list); });
}
MISUSE(DrawBeforeThePipeline, "draw.pipeline") {
    const MeshModel plane(kit.device, createPlane(1.0f));
    return kit.command([&](Command& list) { plane.draw(list); });
}
MISUSE(TraceOfWhatIsNowhere, "tracing.buffer") { return taken(kit).createTracing().error(); }
MISUSE(TraceOfAModelThatFailedLater, "tracing.buffer") {
    MeshModel plane(kit.device, createPlane(1.0f), MeshModel::FlagBufferTracing);
    plane.setIndexBuffer(kit.buffer(Buffer::FlagIndex), 2);
    kit.log.take();
    return plane.createTracing().error();
}
MISUSE(TraceOfAnUntraceableModel, "buffer.flag") {
    return MeshModel(kit.device, createPlane(1.0f)).createTracing().error();
}
MISUSE(TraceOfHalfFloats, "tracing.format") {
    const MeshModel::Layout layout = {{Pipeline::AttributePosition, FormatRGBAf16, 0, 0, 8}};
    return MeshModel(kit.device, layout, createPlane(1.0f), MeshModel::FlagBufferTracing).createTracing().error();
}
MISUSE(TraceOfAFailedModel, "tracing.empty") {
    const MeshModel failed(kit.device, createPlane(1.0f), 1u << 20);
    kit.log.take();
    return failed.createTracing().error();
}

}  // namespace glint::test
