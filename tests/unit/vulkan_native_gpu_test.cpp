#include "support/device_fixture.h"

#include "platform/vulkan/native.h"

namespace glint::test {

namespace {

class VulkanNativeTest : public DeviceTest {};

}  // namespace

TEST_F(VulkanNativeTest, HandlesAreThere) {
    const vulkan::NativeDevice native = vulkan::nativeDevice(device);
    EXPECT_TRUE(native.instance && native.adapter && native.device && native.queue && native.timeline);
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, 64);
    const Texture texture = device.createTexture2D(FormatRGBAu8n, 4, 4);
    EXPECT_NE(vulkan::nativeBuffer(buffer), VkBuffer());
    EXPECT_NE(vulkan::nativeImage(texture), VkImage());
    EXPECT_EQ(vulkan::nativeBuffer(Buffer()), VkBuffer());
    EXPECT_EQ(vulkan::nativeImage(Texture()), VkImage());
    EXPECT_EQ(vulkan::nativePipeline(device.createKernel()), VkPipeline());
    EXPECT_EQ(vulkan::nativeDevice(Device()).device, VkDevice());
    EXPECT_EQ(vulkan::nativeDevice(sharedDevice("null")).device, VkDevice());
}

TEST_F(VulkanNativeTest, DeviceOverForeignHandles) {
    const vulkan::NativeDevice native = vulkan::nativeDevice(device);
    vulkan::DeviceImport source;
    source.instance = native.instance;
    source.adapter = native.adapter;
    source.device = native.device;
    source.queue = native.queue;
    source.family = native.family;
    source.features = device.getFeatures().mask;
    const MessageLog foreign_log;
    source.message = foreign_log.callback();
    Device foreign = vulkan::importDevice(source);
    ASSERT_TRUE(foreign) << foreign.error().text();

    // A buffer and a texture of one device, seen from the other.
    const std::vector<uint32_t> values = {1, 2, 3, 4};
    const Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values));
    const Texture texture = device.createTexture2D(FormatRu32, 2, 2);
    device.setTexture(texture, values.data(), 16);
    ASSERT_THAT(device.finish(), IsOk());
    const Buffer seen = vulkan::importBuffer(foreign, vulkan::nativeBuffer(buffer), 16, Buffer::FlagStorage, "seen");
    ASSERT_TRUE(seen) << seen.error().text();
    const Expected<std::vector<uint32_t>> read = foreign.read<uint32_t>(seen);
    ASSERT_THAT(read, IsOk());
    EXPECT_EQ(*read, values);

    TextureDesc desc;
    desc.format = FormatRu32;
    desc.width = desc.height = 2;
    const Texture image = vulkan::importTexture(foreign, vulkan::nativeImage(texture), desc,
                                                VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, "image");
    ASSERT_TRUE(image) << image.error().text();
    std::vector<uint32_t> texels(4);
    ASSERT_THAT(foreign.getTexture(image, texels.data(), 16), IsOk());
    EXPECT_EQ(texels, values);
    ASSERT_THAT(foreign.finish(), IsOk());
    foreign_log.expectNone();
}

TEST_F(VulkanNativeTest, ImportsThatFail) {
    EXPECT_THAT(vulkan::importDevice({}), HasErrorId("native.null"));
    expectError("native.null", [&] { return vulkan::importBuffer(device, VkBuffer(), 16, 0); });
    const Texture texture = device.createTexture2D(FormatRu32, 2, 2);
    expectError("native.layout", [&] {
        return vulkan::importTexture(device, vulkan::nativeImage(texture), {}, VK_IMAGE_LAYOUT_PREINITIALIZED);
    });
    EXPECT_THAT(vulkan::importBuffer(Device(), VkBuffer(), 16, 0), HasErrorId("handle.null"));
    EXPECT_THAT(vulkan::importBuffer(sharedDevice("null"), VkBuffer(), 16, 0), HasErrorId("native.api"));
    sharedLog("null").take();
}

}  // namespace glint::test
