#include "conformance/conformance.h"

#include <bit>
#include <thread>

namespace glint::test {

namespace {

class DeviceTests : public ApiTest {
protected:
    DeviceDesc desc(const MessageLog& messages) const {
        return {.api = GetParam(), .validation = DeviceDesc::Validation::On, .message = messages.callback()};
    }
};

}  // namespace

TEST_P(DeviceTests, SaysWhatItIs) {
    const DeviceInfo& info = device.getInfo();
    EXPECT_EQ(info.api, GetParam());
    EXPECT_FALSE(info.name.empty());
    EXPECT_FALSE(info.driver.empty());
    EXPECT_FALSE(info.version.empty());
    EXPECT_TRUE(device.check());
    const Expected<std::vector<DeviceInfo>> adapters = Device::adapters(GetParam());
    ASSERT_THAT(adapters, IsOk());
    ASSERT_LT(info.index, adapters->size());
    EXPECT_EQ((*adapters)[info.index].name, info.name);
    EXPECT_EQ((*adapters)[info.index].features, info.features);
}

TEST_P(DeviceTests, FeaturesAreThoseAskedFor) {
    const Features& features = device.getFeatures();
    // Ray queries and ray-tracing pipelines in software need nothing of the adapter's.
    FeatureMask own = FeatureNone;
    if (features.tracingEngine == TracingEngine::Software) own |= FeatureComputeTracing | FeatureFragmentTracing;
    if (features.traversalEngine == TracingEngine::Software) own |= FeatureRayTracing;
    EXPECT_EQ(features.mask & ~(device.getInfo().features | own), 0u);
    EXPECT_EQ(features.computeTracing, features.has(FeatureComputeTracing));
    EXPECT_EQ(features.fragmentTracing, features.has(FeatureFragmentTracing));
    EXPECT_EQ(features.rayTracing, features.has(FeatureRayTracing));
    EXPECT_EQ(features.meshShader, features.has(FeatureMeshShader));
    EXPECT_EQ(features.bufferAddress, features.has(FeatureBufferAddress));
    EXPECT_EQ(features.textureTable, features.has(FeatureTextureTable));
    EXPECT_EQ(features.shaderf16, features.has(FeatureShaderf16));
    EXPECT_EQ(features.shaderf64, features.has(FeatureShaderf64));
    EXPECT_EQ(features.shaderu8, features.has(FeatureShaderu8));
    EXPECT_EQ(features.shaderu16, features.has(FeatureShaderu16));
    EXPECT_EQ(features.shaderu64, features.has(FeatureShaderu64));
    EXPECT_EQ(features.atomicBufferu64, features.has(FeatureAtomicBufferu64));

    MessageLog messages;
    DeviceDesc plain = desc(messages);
    plain.optional = FeatureNone;
    const Device bare = Device::create(plain);
    ASSERT_TRUE(bare) << bare.error().text();
    EXPECT_EQ(bare.getFeatures().mask, 0u);
    EXPECT_EQ(bare.getInfo().features, device.getInfo().features);
    messages.expectNone();
}

TEST_P(DeviceTests, EveryFeatureByItself) {
    for (uint32_t i = 0; i < FeatureCount; i++) {
        const FeatureMask feature = 1ull << i;
        if (!(device.getInfo().features & feature)) continue;
        SCOPED_TRACE(featureNames(feature));
        MessageLog messages;
        DeviceDesc one = desc(messages);
        one.required = feature;
        one.optional = FeatureNone;
        const Device created = Device::create(one);
        ASSERT_TRUE(created) << created.error().text();
        EXPECT_TRUE(created.getFeatures().has(feature));
        messages.expectNone();
    }
}

TEST_P(DeviceTests, LimitsAreUsable) {
    const Features& features = device.getFeatures();
    EXPECT_GE(features.maxTexture2DSize, 4096u);
    EXPECT_GE(features.maxTexture3DSize, 256u);
    EXPECT_GE(features.maxTextureCubeSize, 4096u);
    EXPECT_GE(features.maxTextureLayers, 256u);
    EXPECT_GE(features.maxTextureSamples, 4u);
    EXPECT_GE(features.maxTargets, 4u);
    EXPECT_GE(features.maxGroupThreads, 128u);
    EXPECT_GE(features.maxGroupSizeX, 128u);
    EXPECT_GE(features.maxGroupCountX, 65535u);
    EXPECT_GE(features.groupMemory, 16384u);
    EXPECT_GE(features.maxPushSize, 128u);
    EXPECT_GE(features.maxUniformSize, 16384u);
    EXPECT_GE(features.maxStorageSize, 1u << 27);
    EXPECT_GE(features.maxBufferSize, 1u << 27);
    EXPECT_TRUE(std::has_single_bit(features.uniformAlignment));
    EXPECT_TRUE(std::has_single_bit(features.storageAlignment));
    EXPECT_TRUE(std::has_single_bit(features.texelAlignment));
    if (features.computeTracing) {
        EXPECT_TRUE(std::has_single_bit(features.scratchAlignment));
        EXPECT_GT(features.maxTracingInstances, 0u);
        EXPECT_GT(features.maxTracingPrimitives, 0u);
    }
    if (features.has(FeatureTimestamps)) { EXPECT_GT(features.timestampPeriod, 0.0); }
}

TEST_P(DeviceTests, FormatsThatEveryAdapterHas) {
    EXPECT_TRUE(device.hasTexture(FormatRGBAu8n, Texture::FlagTarget | Texture::FlagSurface));
    EXPECT_TRUE(device.hasTexture(FormatRGBAf32, Texture::FlagSurface));
    EXPECT_TRUE(device.hasTexture(FormatRf32, Texture::FlagMipmaps));
    EXPECT_TRUE(device.hasTexture(FormatDf32, Texture::FlagTarget));
    EXPECT_TRUE(device.hasTexture(FormatRGBAu8n, 0, Texture::Type3D));
    EXPECT_TRUE(device.hasTexture(FormatRGBAu8n, 0, Texture::TypeCube));
    EXPECT_FALSE(device.hasTexture(FormatUnknown));
    EXPECT_FALSE(device.hasTexture(FormatCount));
    EXPECT_FALSE(device.hasTexture(FormatDf32, Texture::FlagSurface));
}

TEST_P(DeviceTests, NullDeviceIsHarmless) {
    Device nobody;
    EXPECT_FALSE(nobody);
    EXPECT_FALSE(nobody.check());
    EXPECT_EQ(nobody.getFeatures().mask, 0u);
    EXPECT_EQ(nobody.getInfo().name, "");
    EXPECT_EQ(nobody.getMemory().bytes, 0u);
    EXPECT_FALSE(nobody.hasTexture(FormatRGBAu8n));
    EXPECT_FALSE(nobody.hasQueue(Queue::Main));
    EXPECT_THAT(nobody.createBuffer(Buffer::FlagStorage, 4), HasErrorId("handle.null"));
    EXPECT_THAT(nobody.createTexture2D(FormatRGBAu8n, 1, 1), HasErrorId("handle.null"));
    EXPECT_THAT(nobody.createSampler(), HasErrorId("handle.null"));
    EXPECT_THAT(nobody.createQuery(Query::TypeTime), HasErrorId("handle.null"));
    EXPECT_THAT(nobody.createFence(), HasErrorId("handle.null"));
    EXPECT_THAT(nobody.createTarget(), HasErrorId("handle.null"));
    Kernel kernel = nobody.createKernel();
    kernel.setStorages(1);
    EXPECT_FALSE(kernel.createShaderGLSL("layout(local_size_x = 1) in; void main() {}"));
    EXPECT_THAT(kernel.create(), HasErrorId("handle.null"));
    EXPECT_THAT(kernel.reload(), HasErrorId("handle.null"));
    EXPECT_THAT(kernel.wait(), HasErrorId("handle.null"));
    Pipeline pipeline = nobody.createPipeline();
    pipeline.setColorFormat(FormatRGBAu8n);
    pipeline.addAttribute(Pipeline::AttributePosition, FormatRGBf32, 0, 0, 12);
    EXPECT_THAT(pipeline.create(), HasErrorId("handle.null"));
    for (Traversal traversal : {nobody.createTraversal(), Traversal()}) {
        EXPECT_FALSE(traversal.createShaderGLSL(Shader::TypeRayGen, "void main() {}"));
        traversal.addHitGroup().setRecursionDepth(2);
        traversal.setTracingMask(0, Shader::MaskTracing);
        EXPECT_EQ(traversal.addHitRecord(0, 1u), 0u);
        EXPECT_EQ(traversal.getHitRecords(), 0u);
        EXPECT_EQ(traversal.getHitGroups(), 0u);
        EXPECT_THAT(traversal.create(), HasErrorId("handle.null"));
    }
    Tracing tracing = nobody.createTracing();
    EXPECT_THAT(tracing.create(Tracing::TypeInstance), HasErrorId("handle.null"));
    Compute compute = nobody.createCompute();
    compute.setKernel(kernel);
    compute.setTraversal(Traversal());
    compute.setUniform(0, 1);
    compute.setStorageBuffers(0, {Buffer(), Buffer()});
    compute.dispatch(1);
    EXPECT_FALSE(compute);
    EXPECT_THAT(compute.end(), HasErrorId("recorder.null"));
    Command command = nobody.createCommand(Target());
    command.setPipeline(pipeline);
    command.drawArrays(3);
    EXPECT_THAT(command.end(), HasErrorId("recorder.null"));
    nobody.setBuffer(Buffer(), 0, nullptr, 4);
    nobody.clearTexture(Texture(), Color());
    nobody.flushBuffers({Buffer()});
    EXPECT_THAT(nobody.submit(compute), HasErrorId("handle.null"));
    EXPECT_THAT(nobody.flush(), HasErrorId("handle.null"));
    EXPECT_THAT(nobody.finish(), HasErrorId("handle.null"));
    int value = 0;
    EXPECT_THAT(nobody.getBuffer(Buffer(), 0, &value, 4), HasErrorId("handle.null"));
    EXPECT_THAT(nobody.getTexture(Texture(), &value, 4), HasErrorId("handle.null"));
    EXPECT_THAT(nobody.getTime(Query()), HasErrorId("handle.null"));
}

TEST_P(DeviceTests, ObjectsOutliveTheirDevice) {
    MessageLog messages;
    {
        Buffer buffer;
        Texture texture;
        Kernel kernel;
        {
            Device other = Device::create(desc(messages));
            ASSERT_TRUE(other) << other.error().text();
            buffer = other.createBuffer(Buffer::FlagStorage, 64, "outlives");
            texture = other.createTexture2D(FormatRGBAu8n, 4, 4, Texture::FlagTarget);
            kernel = other.createKernel();
            kernel.createShaderGLSL(
                "layout(local_size_x = 1) in; layout(binding = 0) buffer B { uint b; }; void main() { b = 1u; }");
            EXPECT_THAT(kernel.create(), IsOk());
            Compute list = other.createCompute();
            list.setKernel(kernel);
            list.setStorageBuffer(0, buffer);
            list.dispatch(1);
            EXPECT_THAT(other.submit(list), IsOk());
            other.clearBuffer(buffer, 7);  // queued and never played
        }
        EXPECT_TRUE(buffer);
        EXPECT_EQ(buffer.getSize(), 64u);
        EXPECT_TRUE(texture);
        EXPECT_TRUE(kernel);
    }
    messages.expectNone();
}

TEST_P(DeviceTests, RecordersOutliveTheirDevice) {
    MessageLog messages;
    {
        Device other = Device::create(desc(messages));
        ASSERT_TRUE(other) << other.error().text();
        Compute list = other.createCompute();
        list.clearBuffer(other.createBuffer(Buffer::FlagStorage, 64), 1);
        other = {};
        EXPECT_TRUE(list);
        EXPECT_THAT(list.end(), IsOk());
    }
    messages.expectNone();
}

TEST_P(DeviceTests, CreatedAndDroppedManyTimes) {
    for (int i = 0; i < 3; i++) {
        MessageLog messages;
        {
            const Device other = Device::create(desc(messages));
            EXPECT_TRUE(other) << other.error().text();
        }
        messages.expectNone();
    }
}

TEST_P(DeviceTests, ErrorsComeAtOnceAndAreCarried) {
    MessageLog messages;
    {
        Device other = Device::create(desc(messages));
        ASSERT_TRUE(other) << other.error().text();
        const Buffer buffer = other.createBuffer(Buffer::FlagStorage, 0, "nothing");
        EXPECT_EQ(buffer.state(), ObjectState::Failed);
        EXPECT_THAT(buffer, HasErrorId("buffer.size_zero"));
        EXPECT_EQ(buffer.error().file(), "device_test.cpp");
        EXPECT_GT(buffer.error().line(), 0u);
        EXPECT_NE(buffer.error().message().find("nothing"), std::string::npos);
        const std::vector<Message> told = messages.take();
        ASSERT_EQ(told.size(), 1u);
        EXPECT_EQ(told[0].severity, Message::Severity::Error);
        EXPECT_EQ(told[0].error.id(), "buffer.size_zero");
        // A recorder that is dropped unread has told of its error.
        { other.createCompute().dispatch(1); }
        const std::vector<Message> dropped = messages.take();
        ASSERT_EQ(dropped.size(), 1u);
        EXPECT_EQ(dropped[0].error.id(), "dispatch.kernel");
    }
    messages.expectNone();
}

TEST_P(DeviceTests, QueuedTransfersArePlayedInOrder) {
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(4));
    device.clearBuffer(buffer, 1);
    const uint32_t two = 2;
    device.setBuffer(buffer, 4, &two, 4);
    device.copyBuffer(buffer, 8, buffer, 4, 4);
    EXPECT_THAT(device.flush(), IsOk());
    EXPECT_EQ(read<uint32_t>(buffer), (std::vector<uint32_t>{1, 2, 2, 1}));
}

TEST_P(DeviceTests, FlushesOfResourcesAreAccepted) {
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(4));
    const Texture texture = makeTexture(FormatRGBAu8n, 4, 4);
    device.flushBuffer(buffer);
    device.flushBuffers({buffer, buffer});
    device.flushTexture(texture);
    device.flushTextures({texture, texture});
    EXPECT_THAT(device.finish(), IsOk());
}

TEST_P(DeviceTests, AdapterByIndexAndName) {
    MessageLog messages;
    DeviceDesc chosen = desc(messages);
    chosen.adapter = std::to_string(device.getInfo().index);
    EXPECT_TRUE(Device::create(chosen));
    chosen.adapter = device.getInfo().name.substr(0, 4);
    EXPECT_TRUE(Device::create(chosen));
    messages.expectNone();
}

INSTANTIATE_APIS(DeviceTests);

}  // namespace glint::test
